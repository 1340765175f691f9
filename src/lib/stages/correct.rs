//! Corrections of a frame of codes before demosaicking: black, dark frames, charge transfer.
//!
//! First what no light reads is subtracted, as a constant or as the mean of dark frames, sample by sample; then the
//! transfer of what is left is undone. Values become signed and fractional: clipping them at zero would bias means.

use crate::camera::levels::{BlackLevels, RowBlack, WhiteLevel};
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{CorrectionRecord, DefectsRecord, FlatRecord, FrameHeader, Metadata};
use crate::stages::black::{Black, is_said, white_left};
use crate::stages::darks::{DarkStack, check_codes, check_setting};
use crate::stages::saturation::FullLevels;
use crate::stages::transfer::{Transfer, uniform_share};
use crate::stream::{Counts, Stage};
use crate::units::{Adu, QuantityKind};

/// What a user may ask to be corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionSettings {
    /// What to subtract as a constant.
    pub black: Black,
    /// Charge transfer efficiency to undo.
    pub cte: Option<f64>,
}

/// Subtracts a constant and undoes charge transfer; dark frames are subtracted while rows are read, by
/// [`LessDarks`](super::darks::LessDarks).
///
/// y = b + A⁻¹(x − b)        A of [`Transfer`], b = bias where nothing was subtracted from x, else 0
///
/// The converter adds its bias after transfer, so that it is no charge. A black level of the metadata is subtracted
/// photosite by photosite where it differs among them.
#[derive(Debug, Clone)]
pub struct CorrectFrame {
    header: FrameHeader,
    black: BlackLevels,
    bias_adu: f64,
    transfer: Option<Transfer>,
    warnings: Vec<String>,
}

impl CorrectFrame {
    /// The correction of `input`, from which the mean of `darks` is subtracted before it comes here.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless the frame holds ADU; [`Error::Format`] for a frame that is demosaicked or corrected already,
    /// darks that do not fit, and crops whose transfer would be undone; [`Error::MissingKey`] where the metadata know no
    /// black level or bias; [`Error::Usage`] where there is nothing to do, or too much.
    pub fn new(input: &FrameHeader, settings: &CorrectionSettings, darks: Option<&DarkStack>) -> Result<Self> {
        Self::of(input, settings, darks, false)
    }

    /// The same where `is_more` says that there is something to correct even if nothing of these.
    ///
    /// # Errors
    ///
    /// As of [`Self::new`].
    pub fn of(
        input: &FrameHeader,
        settings: &CorrectionSettings,
        darks: Option<&DarkStack>,
        is_more: bool,
    ) -> Result<Self> {
        let CorrectionSettings { black, cte } = *settings;
        check_codes(input)?;
        let mut warnings = Vec::new();
        if let Some(darks) = darks {
            check_setting(input, darks.head())?;
            darks.check_dark()?;
            warnings = darks.warnings_beside(input);
        }
        warnings.extend(cte.and_then(|undone| doubt_of_transfer(input, undone)));
        let known_black = input.black_levels()?;
        let levels = match black {
            Black::None if darks.is_none() && cte.is_none() && !is_more => {
                let problem = Error::Usage("there is nothing to correct".into());
                return Err(problem.give(&["black", "dark", "bias", "flat", "defects", "linearize", "cte"]));
            }
            Black::None => BlackLevels::uniform_at(0.0),
            _ if darks.is_some() => {
                return Err(Error::Usage("dark frames hold the black level already".into()).leave_out(&["black"]));
            }
            Black::Auto => known_black.clone().ok_or_else(|| input.missing("black_level_adu"))?,
            Black::Level(level) => BlackLevels::of_sites(level, input.geometry.origin),
        };
        let is_subtracted = black != Black::None || darks.is_some();
        let mut bias_adu = 0.0;
        let mut transfer = None;
        if let Some(cte) = cte {
            input.check_corner()?;
            input.check_one_output()?;
            transfer = Some(Transfer::undoing(cte, &input.geometry)?);
            if !is_subtracted {
                bias_adu = input.metadata.adc.ok_or_else(|| input.missing("adc"))?.bias_adu;
            }
        }
        let mut metadata = input.metadata.becoming(QuantityKind::Adu);
        // How much a dark takes off is known where the black level is.
        let bias = input.metadata.adc.map(|adc| BlackLevels::uniform_at(adc.bias_adu));
        let off = match darks {
            None => Some(&levels),
            Some(darks) if darks.is_bias() && bias.is_some() => bias.as_ref(),
            Some(_) => known_black.as_ref(),
        };
        note_levels(&mut metadata, input, off, is_subtracted, is_said(black, input))?;
        if let Some(cte) = cte {
            restore_levels(&mut metadata, input, cte, bias_adu)?;
        }
        if is_subtracted && darks.is_none() && levels.uniform() == Some(0.0) {
            metadata.leave_out("correct-frame", "subtraction of the black level", "it is zero");
        }
        let off = darks.and_then(DarkStack::level).unwrap_or(&levels);
        metadata.correction = Some(CorrectionRecord {
            dark_frames: darks.map_or(0, DarkStack::frames),
            masters: darks.map_or_else(Vec::new, DarkStack::masters),
            cte,
            ..CorrectionRecord::of_black(off.level(), off.has_deltas())
        });
        let header = FrameHeader { metadata, ..input.clone() };
        Ok(Self { header, black: levels, bias_adu, transfer, warnings })
    }

    /// Notes the flat field by which samples are divided next, and how defective photosites are told; nothing is predicted of
    /// samples any more by their levels alone.
    pub fn note_further(&mut self, flat: Option<FlatRecord>, defects: Option<DefectsRecord>) {
        if let Some(correction) = &mut self.header.metadata.correction {
            (correction.flat, correction.defects) = (flat, defects);
        }
    }

    /// The head of the corrected frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// What a user should hear before the frame is made.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

/// A warning of charge that was transferred with another efficiency than that which is undone.
fn doubt_of_transfer(input: &FrameHeader, undone: f64) -> Option<String> {
    let simulated = input.metadata.noise.as_ref()?.cte.unwrap_or(1.0);
    let truth = match simulated {
        1.0 => "its charge was not transferred".to_owned(),
        efficiency => format!("its charge was transferred with an efficiency of {efficiency}"),
    };
    let name = &input.name;
    (undone != simulated).then(|| format!("{name}: {truth}, as its metadata say; {undone} is undone all the same"))
}

/// Moves black and white level as undoing the transfer of charge above the bias moves them.
fn restore_levels(metadata: &mut Metadata, input: &FrameHeader, cte: f64, bias_adu: f64) -> Result<()> {
    if metadata.black_level_adu.is_some() && metadata.uniform_black_adu().is_none() {
        return Err(input.refuse(
            "what is left of its black level differs among photosites, so that it is no charge; subtract it with \
             --black auto as transfer is undone",
        ));
    }
    let restored = |level: f64| bias_adu + (level - bias_adu) / uniform_share(cte);
    metadata.black_level_adu = metadata.black_level_adu.map(|level| level.map(restored));
    metadata.white_level_adu = metadata.white_level_adu.map(|white| white.map(restored));
    Ok(())
}

/// Notes what is left of black and white once `off`, where that is known, is subtracted; a frame of unknown black counts
/// as black-free after a subtraction, and so does one whose black level is said.
fn note_levels(
    metadata: &mut Metadata,
    input: &FrameHeader,
    off: Option<&BlackLevels>,
    is_subtracted: bool,
    is_said: bool,
) -> Result<()> {
    let pattern = input.metadata.cfa.and_then(FilterArray::bayer);
    let left = |white| off.map(|off| white_left(white, off, &input.geometry, pattern));
    let is_by_lines = off.is_some_and(BlackLevels::has_deltas) && metadata.adc.is_none();
    // Once rows or columns have levels of their own, no charge tells which samples were full.
    let full = FullLevels::of(input).filter(|_| is_by_lines);
    let full = full.map(|levels| match levels.classes().map(f64::from) {
        [red, green, blue] if red == green && green == blue => WhiteLevel::Uniform(red),
        levels => WhiteLevel::Classes(levels),
    });
    metadata.white_level_adu = full.or(metadata.white_level_adu).and_then(left);
    match (input.black_levels()?, off) {
        (Some(known), Some(off)) if is_said || known == *off => metadata.set_black_adu(Some(0.0.into())),
        (Some(_), Some(off)) => {
            // Only a number that a user gives is not the black level, and it is the same everywhere.
            let number = off.uniform().unwrap_or_default();
            metadata.black_level_adu = metadata.black_level_adu.map(|level| level.map(|black| black - number));
        }
        _ => metadata.set_black_adu(is_subtracted.then_some(0.0.into())),
    }
    Ok(())
}

impl Stage for CorrectFrame {
    type Input = Adu;
    type Output = Adu;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn reach(&self) -> usize {
        self.transfer.as_ref().map_or(0, Transfer::reach)
    }

    fn apply(&self, input: Window<'_, Adu>, mut output: Rows<'_, Adu>) -> Counts {
        let mut counts = Counts::default();
        let rows = output.range();
        for channel in 0..input.channels() {
            let store = |corrected: f64, sample: &mut f32, counts: &mut Counts| {
                counts.not_finite += u64::from(!corrected.is_finite());
                *sample = to_sample(corrected);
            };
            let Some(transfer) = &self.transfer else {
                for y in rows.clone() {
                    let (codes, samples) = (input.row(y.cast_signed(), channel), output.row(y, channel));
                    match self.black.row(y) {
                        RowBlack::Uniform(0.0) => {
                            samples.copy_from_slice(codes);
                            counts.not_finite += codes.iter().filter(|code| !code.is_finite()).count() as u64;
                        }
                        RowBlack::Uniform(black) => {
                            for (&code, sample) in codes.iter().zip(samples) {
                                store(f64::from(code) - black, sample, &mut counts);
                            }
                        }
                        black @ RowBlack::Varying(..) => {
                            for (x, (&code, sample)) in codes.iter().zip(samples).enumerate() {
                                store(f64::from(code) - black.at(x), sample, &mut counts);
                            }
                        }
                    }
                }
                continue;
            };
            let mut passage = transfer.passage();
            for y in rows.start.saturating_sub(transfer.reach())..rows.end {
                let black = self.black.row(y);
                for (x, (&code, charge)) in
                    input.row(y.cast_signed(), channel).iter().zip(passage.entering(y)).enumerate()
                {
                    *charge = f64::from(code) - black.at(x) - self.bias_adu;
                }
                if y >= rows.start {
                    for (&charge, sample) in passage.leaving(y).iter().zip(output.row(y, channel)) {
                        store(charge + self.bias_adu, sample, &mut counts);
                    }
                }
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::levels::WhiteLevel;
    use crate::camera::optics::Exposure;
    use crate::cfa::CfaPattern;
    use crate::frame::Geometry;
    use crate::metadata::{AdcRecord, Metadata};

    fn codes() -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(CfaPattern::Rggb.into());
        metadata.adc = Some(AdcRecord::new(12, 100.0, 0.05));
        metadata.black_level_adu = Some(104.0.into());
        metadata.white_level_adu = Some(4095.0.into());
        metadata.exposure = Some(Exposure { exposure_s: 0.1, f_number: 8.0, lens_transmittance: 1.0 });
        FrameHeader { name: "codes".into(), geometry: Geometry::new(4, 3, &["Y"]), metadata }
    }

    fn correct(frame: &FrameHeader, black: Black, cte: Option<f64>, darks: &[&FrameHeader]) -> Result<CorrectFrame> {
        let stack = DarkStack::of(darks.iter().copied())?;
        CorrectFrame::new(frame, &CorrectionSettings { black, cte }, stack.as_ref())
    }

    #[test]
    fn levels_follow_what_is_subtracted_and_restored() {
        let frame = codes();
        let levels = |black, cte, darks: &[&FrameHeader]| {
            let metadata = &correct(&frame, black, cte, darks).unwrap().header.metadata;
            let white = metadata.white_level_adu.and_then(WhiteLevel::uniform);
            [metadata.uniform_black_adu().unwrap(), white.unwrap()]
        };
        assert_eq!(levels(Black::Auto, None, &[]), [0.0, 3991.0]);
        assert_eq!(levels(Black::Level(100.0.into()), None, &[]), [4.0, 3995.0]);
        assert_eq!(levels(Black::None, None, &[&frame, &frame]), [0.0, 3991.0]);
        // Of what lies above the bias a quarter was left.
        assert_eq!(levels(Black::None, Some(0.5), &[]), [116.0, 100.0 + 4.0 * 3995.0]);
        assert_eq!(levels(Black::Auto, Some(0.5), &[]), [0.0, 4.0 * 3991.0]);
        assert_eq!(levels(Black::None, Some(0.5), &[&frame]), [0.0, 4.0 * 3991.0]);
        let mut unknown = frame.clone();
        unknown.metadata.black_level_adu = None;
        let found = correct(&unknown, Black::Level(9.0.into()), None, &[]).unwrap().header.metadata;
        assert_eq!((found.black_level_adu, found.white_level_adu), (Some(0.0.into()), Some(4086.0.into())));
        let found = correct(&unknown, Black::None, None, &[&frame]).unwrap().header.metadata;
        assert_eq!((found.black_level_adu, found.white_level_adu), (Some(0.0.into()), None));
        let found = correct(&unknown, Black::None, Some(0.5), &[]).unwrap().header.metadata;
        assert_eq!(found.black_level_adu, None);
    }

    #[test]
    fn what_cannot_be_corrected_is_refused() {
        let frame = codes();
        let with = |change: &dyn Fn(&mut FrameHeader)| {
            let mut changed = frame.clone();
            change(&mut changed);
            changed
        };
        let refused = |input: &FrameHeader, black, cte, darks: &[&FrameHeader]| {
            correct(input, black, cte, darks).unwrap_err().bare()
        };
        assert!(matches!(refused(&frame, Black::None, None, &[]), Error::Usage(_)));
        assert!(matches!(refused(&frame, Black::Auto, None, &[&frame]), Error::Usage(_)));
        assert!(matches!(refused(&frame, Black::None, Some(0.0), &[]), Error::Usage(_)));
        let electrons = with(&|f| f.metadata.quantity = QuantityKind::Electrons);
        assert!(matches!(refused(&electrons, Black::Auto, None, &[]), Error::Order { first: "digitize", .. }));
        let once = correct(&frame, Black::Auto, None, &[]).unwrap().header;
        assert!(matches!(refused(&once, Black::Auto, None, &[]), Error::Format { .. }));
        let crop = with(&|f| f.geometry.origin = [0, 2]);
        assert!(matches!(refused(&crop, Black::None, Some(0.99), &[]), Error::Format { .. }));
        assert!(correct(&crop, Black::Auto, None, &[]).is_ok());
        let bare = with(&|f| (f.metadata.adc, f.metadata.black_level_adu) = (None, None));
        assert!(matches!(refused(&bare, Black::Auto, None, &[]), Error::MissingKey { key: "black_level_adu", .. }));
        assert!(matches!(refused(&bare, Black::None, Some(0.99), &[]), Error::MissingKey { key: "adc", .. }));
        assert!(correct(&bare, Black::Level(100.0.into()), Some(0.99), &[]).is_ok());
        let unlike = [
            with(&|f| f.geometry.width = 9),
            crop,
            with(&|f| f.metadata.cfa = Some(CfaPattern::Bggr.into())),
            with(&|f| f.geometry.channels = vec!["R".into(), "G".into(), "B".into()]),
            electrons,
            once,
        ];
        for dark in &unlike {
            assert!(correct(&frame, Black::None, None, &[&frame, dark]).is_err(), "{dark:?}");
        }
    }

    #[test]
    fn darks_of_another_exposure_are_told_of() {
        let frame = codes();
        let mut long = frame.clone();
        long.name = "long".into();
        long.metadata.exposure = Some(Exposure { exposure_s: 0.5, f_number: 8.0, lens_transmittance: 1.0 });
        let said = |darks: &[&FrameHeader]| {
            let made = correct(&frame, Black::None, None, darks).unwrap();
            let (on_trust, others): (Vec<_>, Vec<_>) =
                made.warnings().iter().cloned().partition(|text| text.contains("the metadata do not tell whether"));
            // None of them says which sensor took it, and that none is lit, and nor does the frame: that is no doubt of them.
            assert_eq!(on_trust, [""; 0]);
            others
        };
        let differ = "its exposure is 0.5 s, but that of codes is 0.1 s; their dark signals differ";
        assert_eq!(said(&[&long]), [format!("long: {differ}")]);
        assert_eq!(said(&[&frame, &long]), [format!("long: {differ}")]);
        assert_eq!(said(&[&long, &long]), [format!("the mean of long and 1 other: {differ}")]);
        assert_eq!(said(&[&frame, &frame]), [""; 0]);
    }
}
