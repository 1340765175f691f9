//! Frames that were corrected before they are measured: what comes back, and what does not.

use crate::analysis::photon_transfer::Corrected;
use crate::camera::levels::{BlackLevel, BlackLevels};
use crate::cfa::FilterArray;
use crate::error::Result;
use crate::formats::many::OneOfMany;
use crate::frame::{Geometry, to_sample};
use crate::metadata::{CorrectionRecord, FrameHeader, MasterKind};
use crate::stream::RowSource;

/// Makes of the head of a frame off which a level alone came that of the frame before; gives the level, which its samples lack.
pub fn give_back(head: &mut FrameHeader) -> Option<BlackLevels> {
    let record = head.metadata.correction.take_if(|record| record.is_a_shift())?;
    let off = BlackLevels::of_sites(record.black_adu, head.geometry.origin);
    let Geometry { width, height, origin, .. } = head.geometry;
    let pattern = head.metadata.cfa.and_then(FilterArray::bayer);
    let [x0, y0] = origin.map(i64::from);
    let class = |x: usize, y: usize| pattern.map(|pattern| pattern.class(x0 + x as i64, y0 + y as i64));
    let most = off.largest([width, height], class).map(|off| -off);
    head.metadata.white_level_adu = head.metadata.white_level_adu.map(|white| white.less(most));
    let again = |left: BlackLevel| {
        let ([a, b, c, d], [e, f, g, h]) = (left.sites(), record.black_adu.sites());
        let sum = BlackLevel::Sites([a + e, b + f, c + g, d + h]);
        sum.uniform().map_or(sum, BlackLevel::from)
    };
    head.metadata.black_level_adu = head.metadata.black_level_adu.map(again);
    Some(off)
}

/// What was done to samples of which no level alone came off; none of samples as a camera gives them.
pub fn corrected(head: &FrameHeader, is_marked: bool) -> Option<Corrected> {
    let record = head.metadata.correction.as_ref()?;
    let is_dark = record.masters.iter().any(|master| master.kind == MasterKind::Dark);
    let lost_dark = is_dark || record.black_deltas || record.dark_frames > 0 && record.masters.is_empty();
    Some(Corrected { is_marked, lost_dark })
}

/// What a frame was corrected by.
#[derive(Debug, PartialEq)]
struct Steps<'a> {
    masters: Vec<MasterKind>,
    dark_frames: bool,
    by_lines: bool,
    cte: Option<f64>,
    flat: Option<&'a [f64]>,
    defects: bool,
}

impl<'a> Steps<'a> {
    fn of(record: &'a CorrectionRecord) -> Self {
        let mut masters: Vec<MasterKind> = record.masters.iter().map(|master| master.kind).collect();
        masters.sort_by_key(|kind| *kind == MasterKind::Dark);
        masters.dedup();
        Self {
            masters,
            dark_frames: record.dark_frames > 0,
            by_lines: record.black_deltas,
            cte: record.cte,
            flat: record.flat.as_ref().map(|flat| &flat.means_adu[..]),
            defects: record.defects.is_some(),
        }
    }

    fn in_words(&self) -> String {
        let has = |kind| self.masters.contains(&kind);
        let all = [
            (has(MasterKind::Bias), "bias frames"),
            (has(MasterKind::Dark) || self.dark_frames && self.masters.is_empty(), "dark frames"),
            (self.by_lines, "black of rows and columns"),
            (self.cte.is_some(), "charge transfer"),
            (self.flat.is_some(), "a flat field"),
            (self.defects, "defects"),
        ];
        let own: Vec<&str> = all.into_iter().filter(|(is, _)| *is).map(|(_, what)| what).collect();
        if own.is_empty() { "nothing".into() } else { own.join(", ") }
    }
}

/// Makes sure that two frames were corrected by the same.
///
/// # Errors
///
/// [`crate::error::Error::Order`] where they differ.
pub fn check_same(first: &FrameHeader, other: &FrameHeader) -> Result<()> {
    let [own, theirs] = [first, other].map(|head| head.metadata.correction.as_ref().map(Steps::of));
    if own == theirs {
        return Ok(());
    }
    let [own, theirs] = [own, theirs].map(|steps| steps.map_or("nothing".to_owned(), |steps| steps.in_words()));
    let problem = if own == theirs {
        format!("its flat field, or the efficiency that was undone, is not that of {}", first.name)
    } else {
        format!("it was corrected by {theirs}, and {} by {own}", first.name)
    };
    Err(other.refuse(problem + "; flats and darks are measured that were corrected alike"))
}

/// Makes sure that frames of one exposure time are less the same darks.
///
/// # Errors
///
/// [`crate::error::Error::Order`] where they differ.
pub fn check_masters<'a>(frames: impl Iterator<Item = (&'a FrameHeader, Option<f64>)>) -> Result<()> {
    let mut known: Vec<(&FrameHeader, Option<f64>)> = Vec::new();
    let masters = |head: &'a FrameHeader| head.metadata.correction.as_ref().map(|record| &record.masters);
    for (head, exposure_s) in frames {
        match known.iter().find(|(_, of)| *of == exposure_s) {
            None => known.push((head, exposure_s)),
            Some((first, _)) if masters(first) == masters(head) => {}
            Some((first, _)) => {
                return Err(head.refuse(format!(
                    "other dark frames came off it than off {}, of the same exposure time; flats and darks of one time are measured that are \
                     less the same",
                    first.name
                )));
            }
        }
    }
    Ok(())
}

/// What is said of numbers of frames that were corrected.
pub fn in_words(head: &FrameHeader, Corrected { is_marked, lost_dark }: Corrected) -> Option<String> {
    let steps = Steps::of(head.metadata.correction.as_ref()?).in_words();
    let mut text = format!("the frames were corrected by {steps}: patterns are those which that left");
    if head.metadata.correction.as_ref().is_some_and(|record| record.black_deltas) {
        text += ", and so is noise of rows or columns";
    }
    if lost_dark {
        text += ", and what dark charge adds on average is off";
    }
    text += match is_marked {
        true => "; samples that are marked as saturated end the curve, and none at code 0 are seen",
        false => "; no sample is marked as saturated, so that clipped levels are told by their variance alone",
    };
    Some(text)
}

/// A frame with the level that came off it.
pub struct AsTaken {
    frame: OneOfMany,
    off: Option<BlackLevels>,
    rows_read: usize,
}

impl AsTaken {
    /// That of a frame that is described already.
    pub fn of(mut frame: OneOfMany) -> Self {
        let off = give_back(frame.header_mut());
        if frame.header().metadata.correction.is_some() {
            frame.keep_mask();
        }
        Self { frame, off, rows_read: 0 }
    }
}

impl RowSource for AsTaken {
    fn header(&self) -> &FrameHeader {
        self.frame.header()
    }

    fn natural_rows(&self) -> usize {
        self.frame.natural_rows()
    }

    fn may_wait(&self) -> bool {
        self.frame.may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let before = samples.len();
        self.frame.read(rows, samples)?;
        if let Some(off) = &self.off {
            let Geometry { width, channels, .. } = &self.frame.header().geometry;
            for (index, of_channel) in samples[before..].chunks_exact_mut(*width).enumerate() {
                let black = off.row(self.rows_read + index / channels.len());
                for (x, sample) in of_channel.iter_mut().enumerate() {
                    *sample = code_before(*sample, black.at(x));
                }
            }
        }
        self.rows_read += rows;
        Ok(())
    }
}

/// The code off which a level came: a whole number where digits that samples lost leave that open.
fn code_before(sample: f32, black: f64) -> f32 {
    let code = f64::from(sample) + black;
    let lost = f64::from(f32::EPSILON) * (f64::from(sample).abs() + black.abs());
    let whole = code.round();
    to_sample(if (code - whole).abs() <= lost { whole } else { code })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_come_back_whole() {
        for black in [0.0, 100.0, 63.718_25, 2047.9] {
            for code in [0_u16, 1, 63, 64, 4095, 65_535] {
                let less = to_sample(f64::from(code) - black);
                assert_eq!(code_before(less, black), f32::from(code), "{code} {black}");
            }
        }
        assert_eq!(code_before(0.25, 100.0), 100.25);
    }
}
