//! The black level as the masked border of a frame has it: photosites beside the active area, which no light reaches.

use super::border_doubts::MeasuredLevel;
use super::border_lines::{Axis, CLIP, Lean, left_of, offs_of, scatter, variance_of_lines};
use super::notes::Note;
use crate::camera::levels::BlackLevel;
use crate::error::{Error, Result};
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::places::in_stream;
use crate::frame::{Geometry, to_sample};
use crate::metadata::{BlackNoise, FrameHeader};
use crate::numerics::averages::{Combine, average};
use crate::numerics::cut_off::AtZero;
use crate::stream::RowSource;
use std::path::Path;

/// What a black level is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Border {
    /// The whole border: a level for each of the 2×2 sites.
    Whole,
    /// The same, and what the masked photosites of each row are off.
    Rows,
    /// The same, and what the masked photosites of each column are off.
    Columns,
}

/// Reads a frame for the black level that its border has, and notes it in `frame`, the same frame's head; says what it is, and what
/// speaks against it.
///
/// # Errors
///
/// [`Error::Usage`] for a frame that cannot be read twice; [`Error::Format`] for one of several planes, or whose metadata know no
/// masked photosites, or none beside each row or column; those of the reader.
pub fn measure_black(frame: &mut FrameHeader, options: &InputOptions, border: Border) -> Result<Vec<Note>> {
    check(frame, options)?;
    let mut masked = Masked::read(frame, options)?;
    let mut sites = masked.by_site();
    if sites.iter().any(Vec::is_empty) {
        return Err(frame.refuse("not all of its 2x2 sites have masked photosites"));
    }
    let low = masked.lowest_codes();
    let levels = sites.each_mut().map(|of_site| average(Combine::Clipped, of_site, CLIP).0);
    masked.take_off(levels);
    let lines = Axis::BOTH.map(|axis| masked.lines(axis));
    let along = border.axis();
    let offs = along.map(|axis| offs_of(&lines[axis as usize]));
    let noise = noise(&masked, along, &lines, offs.as_deref());
    let others = Axis::BOTH.into_iter().filter(|axis| Some(*axis) != along);
    let leans = others.filter_map(|axis| Lean::of(axis, &lines[axis as usize]));
    let measured = MeasuredLevel { levels, site_adu2: noise.site_adu2, lean: leans.reduce(Lean::larger), low };
    let mut notes: Vec<Note> = measured.doubts(frame)?.into_iter().map(Note::Warning).collect();
    let deltas = along
        .zip(offs)
        .map(|(axis, offs)| deltas(frame, axis, &offs, options).map(|deltas| (axis, deltas)))
        .transpose()?;
    let level = BlackLevel::Sites(levels);
    let metadata = &mut frame.metadata;
    metadata.black_noise = Some(noise);
    metadata.set_black_adu(Some(level.uniform().map_or(level, BlackLevel::from)));
    let off = deltas.as_ref().map(|(axis, deltas)| {
        format!("; {} are off by {}", axis.name(), range_of(&deltas[first_of(frame.geometry.origin[*axis as usize])..]))
    });
    (metadata.black_by_row, metadata.black_by_column) = match deltas {
        Some((Axis::Rows, deltas)) => (deltas, Vec::new()),
        Some((Axis::Columns, deltas)) => (Vec::new(), deltas),
        None => (Vec::new(), Vec::new()),
    };
    let [a, b, c, d] = levels;
    notes.push(Note::Remark(format!(
        "{}: the {} photosites of its border read {a:.3}, {b:.3}, {c:.3} and {d:.3} ADU at the 2x2 sites, row by row{}",
        frame.name,
        masked.photosites.len(),
        off.unwrap_or_default()
    )));
    Ok(notes)
}

/// Makes sure that a frame can tell the level of its border.
fn check(frame: &FrameHeader, options: &InputOptions) -> Result<()> {
    let is_file = options.path.as_deref().is_some_and(|path| path != Path::new("-"));
    if !is_file || in_stream(&frame.name) != frame.name {
        let problem = "a frame whose border tells its black level is read twice; name a file that holds it alone";
        return Err(Error::Usage(problem.into()));
    }
    if frame.geometry.channels.len() != 1 {
        return Err(frame.refuse(format!("it holds {}; the border of one plane is told", frame.holds())));
    }
    if frame.metadata.masked_areas.is_empty() {
        return Err(frame.refuse(
            "its metadata know no masked photosites (`masked_areas`); `import-raw --crop full` keeps those of a DNG that has any",
        ));
    }
    Ok(())
}

/// What the lines of a frame are off by, counted from the sensor's corner.
fn deltas(frame: &FrameHeader, axis: Axis, offs: &[Option<f64>], options: &InputOptions) -> Result<Vec<f64>> {
    let found: Option<Vec<f64>> = offs.iter().copied().collect();
    let found = found.ok_or_else(|| uncovered(frame, axis, offs, options))?;
    let first = usize::try_from(frame.geometry.origin[axis as usize])
        .map_err(|_| frame.refuse("it begins before the sensor's corner"))?;
    Ok([vec![0.0; first], found].concat())
}

/// The complaint about a frame not all of whose lines have masked photosites, with the rectangle that leaves such lines out where
/// the others lie together.
fn uncovered(frame: &FrameHeader, axis: Axis, offs: &[Option<f64>], options: &InputOptions) -> Error {
    let has = |off: &Option<f64>| off.is_some();
    let problem = format!("not all of its {} have masked photosites", axis.name());
    let ends = offs.iter().position(has).zip(offs.iter().rposition(has));
    let Some((first, last)) = ends.filter(|(first, last)| offs[*first..=*last].iter().all(has)) else {
        return frame.refuse(problem);
    };
    // A rectangle is counted from the first sample that is stored.
    let [x, y] = options.crop.map_or([0, 0], |crop| [crop.x, crop.y]);
    let (Geometry { width, height, .. }, count) = (&frame.geometry, last - first + 1);
    let rectangle = match axis {
        Axis::Columns => format!("{},{y},{count},{height}", x + first),
        Axis::Rows => format!("{x},{},{width},{count}", y + first),
    };
    frame.refuse(format!("{problem}, and those that have lie in the rectangle {rectangle}")).give(&["crop"])
}

impl Border {
    /// The lines whose own levels come off.
    fn axis(self) -> Option<Axis> {
        match self {
            Self::Whole => None,
            Self::Rows => Some(Axis::Rows),
            Self::Columns => Some(Axis::Columns),
        }
    }
}

/// A masked photosite: column and row in the frame, and what it reads.
#[derive(Debug, Clone, Copy)]
struct Photosite {
    at: [u32; 2],
    sample: f32,
}

/// The masked photosites of a frame.
struct Masked {
    photosites: Vec<Photosite>,
    /// Columns and rows of the frame.
    size: [usize; 2],
    /// Whether the first photosite is one of an odd column, or row, of the sensor.
    is_odd: [bool; 2],
}

impl Masked {
    /// Reads those of a frame.
    fn read(frame: &FrameHeader, options: &InputOptions) -> Result<Self> {
        // The next frame of several is not meant.
        let mut reader = FrameReader::open(&InputOptions { sequence: None, ..options.clone() })?;
        let Geometry { width, height, origin, .. } = frame.geometry;
        let first = origin.map(i64::from);
        let is_within = |[left, top, wide, high]: &[i64; 4], place: [i64; 2]| {
            (*left..left.saturating_add(*wide)).contains(&place[0])
                && (*top..top.saturating_add(*high)).contains(&place[1])
        };
        let (mut photosites, mut samples) = (Vec::new(), Vec::new());
        for y in 0..u32::try_from(height).unwrap_or(u32::MAX) {
            samples.clear();
            reader.read(1, &mut samples)?;
            for (x, sample) in (0..).zip(&samples[..width]).filter(|(_, sample)| sample.is_finite()) {
                let place = [first[0] + i64::from(x), first[1] + i64::from(y)];
                if frame.metadata.masked_areas.iter().any(|area| is_within(area, place)) {
                    photosites.push(Photosite { at: [x, y], sample: *sample });
                }
            }
        }
        Ok(Self { photosites, size: [width, height], is_odd: origin.map(|at| at & 1 != 0) })
    }

    /// Which of the 2×2 sites of the sensor, row by row, a photosite is.
    fn site(&self, photosite: &Photosite) -> usize {
        let [x, y] = [0, 1].map(|axis| usize::from((photosite.at[axis] & 1 != 0) != self.is_odd[axis]));
        2 * y + x
    }

    fn by_site(&self) -> [Vec<f32>; 4] {
        let mut sites: [Vec<f32>; 4] = Default::default();
        self.photosites.iter().for_each(|photosite| sites[self.site(photosite)].push(photosite.sample));
        sites
    }

    /// How many samples are the lowest codes.
    fn lowest_codes(&self) -> AtZero {
        let of = |code: f32| self.photosites.iter().filter(|photosite| photosite.sample == code).count() as f64;
        AtZero { count: self.photosites.len() as f64, zeros: of(0.0), ones: of(1.0) }
    }

    /// Takes the level of its site off each sample.
    fn take_off(&mut self, levels: [f64; 4]) {
        let sites: Vec<usize> = self.photosites.iter().map(|photosite| self.site(photosite)).collect();
        for (photosite, site) in self.photosites.iter_mut().zip(sites) {
            photosite.sample = to_sample(f64::from(photosite.sample) - levels[site]);
        }
    }

    /// The samples of each line.
    fn lines(&self, axis: Axis) -> Vec<Vec<f32>> {
        let mut lines = vec![Vec::new(); self.size[axis as usize]];
        self.photosites.iter().for_each(|photosite| lines[photosite.at[axis as usize] as usize].push(photosite.sample));
        lines
    }

    /// Σ (n/N)² of the n of the N photosites of a site that are in each line, the largest of the four: what the mean of a site has of a
    /// variance that lines have in common.
    fn share_of_lines(&self, axis: Axis) -> f64 {
        let mut lines = vec![[0.0; 4]; self.size[axis as usize]];
        self.photosites.iter().for_each(|place| lines[place.at[axis as usize] as usize][self.site(place)] += 1.0);
        let share = |site: usize| {
            let all: f64 = lines.iter().map(|line| line[site]).sum();
            lines.iter().map(|line| line[site] * line[site]).sum::<f64>() / (all * all).max(1.0)
        };
        (0..4).map(share).fold(0.0, f64::max)
    }
}

/// What such a black level is uncertain by: samples scatter about the level of their site and what their line is off, which is none of it
/// where it is taken off `along` lines. What lines have in common else, the level of a site has as far as it is not the mean of many.
fn noise(masked: &Masked, along: Option<Axis>, lines: &[Vec<Vec<f32>>; 2], offs: Option<&[Option<f64>]>) -> BlackNoise {
    let (scatter, fewest) = match along.zip(offs) {
        Some((axis, offs)) => {
            let lines = &lines[axis as usize];
            let fewest = lines.iter().map(Vec::len).min().unwrap_or_default();
            (scatter(&mut left_of(lines, offs), offs.iter().flatten().count()), fewest)
        }
        None => (scatter(&mut masked.photosites.iter().map(|photosite| photosite.sample).collect::<Vec<_>>(), 1), 0),
    };
    // Of a mean of so many, the fewest that one has.
    let of_mean = |count: usize| scatter / count.max(1) as f64;
    let of_lines = |axis: Axis| if along == Some(axis) { of_mean(fewest) } else { 0.0 };
    let in_common = |axis: Axis| match along {
        Some(own) if own == axis => 0.0,
        _ => masked.share_of_lines(axis) * variance_of_lines(&lines[axis as usize]),
    };
    let fewest_of_site = masked.by_site().iter().map(Vec::len).min().unwrap_or_default();
    BlackNoise {
        site_adu2: of_mean(fewest_of_site) + Axis::BOTH.into_iter().map(in_common).sum::<f64>(),
        row_adu2: of_lines(Axis::Rows),
        column_adu2: of_lines(Axis::Columns),
    }
}

/// Where the lines of a frame begin among those of the sensor, none of which come before its corner.
fn first_of(origin: i32) -> usize {
    usize::try_from(origin).unwrap_or_default()
}

/// The smallest and the largest of some numbers of ADU, in words.
fn range_of(off: &[f64]) -> String {
    let [low, high] =
        off.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], off| [low.min(*off), high.max(*off)]);
    format!("{low:.3} to {high:.3} ADU")
}
