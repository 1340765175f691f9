//! Corrections of a frame of codes before demosaicking: black, dark frames, charge transfer.
//!
//! First what no light reads is subtracted, as a constant or as the mean of dark frames, sample by sample; then the
//! transfer of what is left is undone. Values become signed and fractional: clipping them at zero would bias means.

use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{CorrectionRecord, FrameHeader};
use crate::stages::black::Black;
use crate::stages::transfer::{Transfer, uniform_share};
use crate::stream::{Counts, RowSource, Stage};
use crate::units::{Adu, QuantityKind};

/// What a user may ask to be corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionSettings {
    /// What to subtract as a constant.
    pub black: Black,
    /// Charge transfer efficiency to undo.
    pub cte: Option<f64>,
}

/// Subtracts a constant and undoes charge transfer; dark frames are subtracted while rows are read, by [`LessDarks`].
///
/// y = b + A⁻¹(x − b)        A of [`Transfer`], b = bias where nothing was subtracted from x, else 0
///
/// The converter adds its bias after transfer, so that it is no charge.
#[derive(Debug, Clone)]
pub struct CorrectFrame {
    header: FrameHeader,
    black_adu: f64,
    bias_adu: f64,
    transfer: Option<Transfer>,
    warnings: Vec<String>,
}

impl CorrectFrame {
    /// The correction of `input`, from which the mean of `darks` is subtracted before it comes here.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless the frames hold ADU; [`Error::Format`] for frames that are demosaicked or corrected
    /// already, darks that do not fit, and crops whose transfer would be undone; [`Error::MissingKey`] where the metadata
    /// know no black level or bias; [`Error::Usage`] where there is nothing to do, or too much.
    pub fn new(input: &FrameHeader, settings: &CorrectionSettings, darks: &[&FrameHeader]) -> Result<Self> {
        let CorrectionSettings { black, cte } = *settings;
        check_codes(input)?;
        let mut warnings = Vec::new();
        for dark in darks {
            check_dark(input, dark)?;
            warnings.extend(differences(input, dark));
        }
        let known_black = input.metadata.black_level_adu;
        let black_adu = match black {
            Black::None if darks.is_empty() && cte.is_none() => {
                return Err(Error::Usage("there is nothing to correct".into()).give(&["black", "dark", "cte"]));
            }
            Black::None => 0.0,
            _ if !darks.is_empty() => {
                return Err(Error::Usage("dark frames hold the black level already".into()).leave_out(&["black"]));
            }
            Black::Auto => known_black.ok_or_else(|| input.missing("black_level_adu"))?,
            Black::Level(level) => level,
        };
        let is_subtracted = black != Black::None || !darks.is_empty();
        let mut bias_adu = 0.0;
        let mut transfer = None;
        if let Some(cte) = cte {
            input.check_corner()?;
            transfer = Some(Transfer::undoing(cte, &input.geometry)?);
            if !is_subtracted {
                bias_adu = input.metadata.adc.ok_or_else(|| input.missing("adc"))?.bias_adu;
            }
        }
        let mut metadata = input.metadata.becoming(QuantityKind::Adu);
        // A frame of unknown black counts as black-free after a subtraction; how much a dark takes off its white is then
        // not known.
        let less = |level: f64| if darks.is_empty() { Some(level - black_adu) } else { known_black.map(|b| level - b) };
        let restored = |level: f64| bias_adu + (level - bias_adu) / cte.map_or(1.0, uniform_share);
        let black_left = known_black.and_then(less).or(is_subtracted.then_some(0.0));
        metadata.black_level_adu = black_left.map(restored);
        metadata.white_level_adu = metadata.white_level_adu.and_then(less).map(restored);
        if is_subtracted && darks.is_empty() && black_adu == 0.0 {
            metadata.leave_out("correct-frame", "subtraction of the black level", "it is zero");
        }
        let dark_frames = u32::try_from(darks.len()).unwrap_or(u32::MAX);
        metadata.correction = Some(CorrectionRecord { black_adu, dark_frames, cte });
        let header = FrameHeader { metadata, ..input.clone() };
        Ok(Self { header, black_adu, bias_adu, transfer, warnings })
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

/// Makes sure that a frame holds codes of photosites as the converter gave them, or another program's samples.
fn check_codes(frame: &FrameHeader) -> Result<()> {
    let (metadata, holds) = (&frame.metadata, frame.holds());
    if metadata.demosaic.is_some() {
        return Err(frame.refuse(format!("it holds {holds}; corrections come before demosaicking")));
    }
    if metadata.correction.is_some() {
        return Err(frame.refuse(format!("it holds {holds} that is corrected already; correction is done once")));
    }
    match metadata.quantity {
        QuantityKind::Adu | QuantityKind::Unspecified => Ok(()),
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons => {
            Err(frame.out_of_order(format!("it holds {holds}, not ADU"), "digitize"))
        }
        _ => Err(frame.refuse(format!("it holds {holds}, not ADU of photosites"))),
    }
}

/// Makes sure that a dark frame shows the photosites of `frame`.
fn check_dark(frame: &FrameHeader, dark: &FrameHeader) -> Result<()> {
    check_codes(dark)?;
    let differs = |what: &str, its: String, theirs: String| {
        Err(dark.refuse(format!("its {what} is {its}, but that of {} is {theirs}", frame.name)))
    };
    let (a, b) = (&frame.geometry, &dark.geometry);
    if [a.width, a.height] != [b.width, b.height] {
        return differs("size", format!("{}x{}", b.width, b.height), format!("{}x{}", a.width, a.height));
    }
    if a.origin != b.origin {
        let place = |[column, row]: [i32; 2]| format!("{column},{row}");
        return differs("place on the sensor", place(b.origin), place(a.origin));
    }
    if a.channels.len() != b.channels.len() {
        return differs("number of planes", b.channels.len().to_string(), a.channels.len().to_string());
    }
    let (a, b) = (frame.metadata.cfa, dark.metadata.cfa);
    if a != b {
        let name = |cfa: Option<crate::cfa::CfaPattern>| cfa.map_or("none".to_owned(), |cfa| cfa.to_string());
        return differs("pattern", name(b), name(a));
    }
    Ok(())
}

/// What makes the dark signal of two frames differ.
fn differences(frame: &FrameHeader, dark: &FrameHeader) -> Vec<String> {
    let exposure_s = |frame: &FrameHeader| frame.metadata.exposure.map(|exposure| exposure.exposure_s);
    let temperature_k = |frame: &FrameHeader| {
        let of_sensor = frame.metadata.sensor.as_ref().map(|sensor| sensor.temperature_k);
        frame.metadata.noise.as_ref().map(|noise| noise.temperature_k).or(of_sensor)
    };
    let pairs = [
        ("exposure", "s", exposure_s(dark).zip(exposure_s(frame))),
        ("temperature", "K", temperature_k(dark).zip(temperature_k(frame))),
    ];
    let warn = |(what, unit, pair): (&str, &str, Option<(f64, f64)>)| {
        // Equal but for what a text with seven digits may have lost.
        let (its, theirs) = pair.filter(|(a, b)| (a - b).abs() > 1e-6 * b.abs())?;
        Some(format!(
            "{}: its {what} is {its} {unit}, but that of {} is {theirs} {unit}; their dark signals differ",
            dark.name, frame.name
        ))
    };
    pairs.into_iter().filter_map(warn).collect()
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
                    if self.black_adu == 0.0 {
                        let (codes, samples) = (input.row(y.cast_signed(), channel), output.row(y, channel));
                        samples.copy_from_slice(codes);
                        counts.not_finite += codes.iter().filter(|code| !code.is_finite()).count() as u64;
                        continue;
                    }
                    for (&code, sample) in input.row(y.cast_signed(), channel).iter().zip(output.row(y, channel)) {
                        store(f64::from(code) - self.black_adu, sample, &mut counts);
                    }
                }
                continue;
            };
            let mut passage = transfer.passage();
            for y in rows.start.saturating_sub(transfer.reach())..rows.end {
                for (&code, charge) in input.row(y.cast_signed(), channel).iter().zip(passage.entering(y)) {
                    *charge = f64::from(code) - self.black_adu - self.bias_adu;
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

/// The rows of a frame less the mean of those of dark frames, all read in step; memory is some rows of each.
pub struct LessDarks<'a, S> {
    frame: &'a mut S,
    darks: &'a mut [S],
    dark: Vec<f32>,
    sums: Vec<f64>,
}

impl<'a, S: RowSource> LessDarks<'a, S> {
    /// `frame` less the mean of `darks`, which fit it as [`CorrectFrame::new`] makes sure; without any, `frame` itself.
    pub fn new(frame: &'a mut S, darks: &'a mut [S]) -> Self {
        Self { frame, darks, dark: Vec::new(), sums: Vec::new() }
    }
}

impl<S: RowSource> RowSource for LessDarks<'_, S> {
    fn header(&self) -> &FrameHeader {
        self.frame.header()
    }

    fn natural_rows(&self) -> usize {
        self.darks.iter().map(S::natural_rows).fold(self.frame.natural_rows(), usize::max)
    }

    fn may_wait(&self) -> bool {
        self.frame.may_wait() || self.darks.iter().any(S::may_wait)
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        self.frame.read(rows, samples)?;
        if self.darks.is_empty() {
            return Ok(());
        }
        self.sums.clear();
        self.sums.resize(samples.len() - start, 0.0);
        for dark in &mut *self.darks {
            self.dark.clear();
            dark.read(rows, &mut self.dark)?;
            for (sum, &sample) in self.sums.iter_mut().zip(&self.dark) {
                *sum += f64::from(sample);
            }
        }
        let count = self.darks.len() as f64;
        for (sample, sum) in samples[start..].iter_mut().zip(&self.sums) {
            *sample = to_sample(f64::from(*sample) - sum / count);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::optics::Exposure;
    use crate::cfa::CfaPattern;
    use crate::frame::Geometry;
    use crate::metadata::{AdcRecord, Metadata};

    fn codes() -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(CfaPattern::Rggb);
        metadata.adc = Some(AdcRecord { bits: 12, bias_adu: 100.0, adu_per_e: 0.05 });
        metadata.black_level_adu = Some(104.0);
        metadata.white_level_adu = Some(4095.0);
        metadata.exposure = Some(Exposure { exposure_s: 0.1, f_number: 8.0, lens_transmittance: 1.0 });
        FrameHeader { name: "codes".into(), geometry: Geometry::new(4, 3, &["Y"]), metadata }
    }

    fn correct(frame: &FrameHeader, black: Black, cte: Option<f64>, darks: &[&FrameHeader]) -> Result<CorrectFrame> {
        CorrectFrame::new(frame, &CorrectionSettings { black, cte }, darks)
    }

    #[test]
    fn levels_follow_what_is_subtracted_and_restored() {
        let frame = codes();
        let levels = |black, cte, darks: &[&FrameHeader]| {
            let metadata = &correct(&frame, black, cte, darks).unwrap().header.metadata;
            [metadata.black_level_adu.unwrap(), metadata.white_level_adu.unwrap()]
        };
        assert_eq!(levels(Black::Auto, None, &[]), [0.0, 3991.0]);
        assert_eq!(levels(Black::Level(100.0), None, &[]), [4.0, 3995.0]);
        assert_eq!(levels(Black::None, None, &[&frame, &frame]), [0.0, 3991.0]);
        // Of what lies above the bias a quarter was left.
        assert_eq!(levels(Black::None, Some(0.5), &[]), [116.0, 100.0 + 4.0 * 3995.0]);
        assert_eq!(levels(Black::Auto, Some(0.5), &[]), [0.0, 4.0 * 3991.0]);
        assert_eq!(levels(Black::None, Some(0.5), &[&frame]), [0.0, 4.0 * 3991.0]);
        let mut unknown = frame.clone();
        unknown.metadata.black_level_adu = None;
        let found = correct(&unknown, Black::Level(9.0), None, &[]).unwrap().header.metadata;
        assert_eq!((found.black_level_adu, found.white_level_adu), (Some(0.0), Some(4086.0)));
        let found = correct(&unknown, Black::None, None, &[&frame]).unwrap().header.metadata;
        assert_eq!((found.black_level_adu, found.white_level_adu), (Some(0.0), None));
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
        let refused =
            |input: &FrameHeader, black, cte, darks: &[&FrameHeader]| correct(input, black, cte, darks).unwrap_err();
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
        assert!(correct(&bare, Black::Level(100.0), Some(0.99), &[]).is_ok());
        let unlike = [
            with(&|f| f.geometry.width = 9),
            crop,
            with(&|f| f.metadata.cfa = Some(CfaPattern::Bggr)),
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
        let stage = correct(&frame, Black::None, None, &[&frame, &long]).unwrap();
        let said = "long: its exposure is 0.5 s, but that of codes is 0.1 s; their dark signals differ";
        assert_eq!(stage.warnings(), [said]);
    }
}
