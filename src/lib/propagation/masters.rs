//! Averages of dark frames, and of flats, as predictions know them.

use super::charge::sensitivity;
use super::moments::Prediction;
use crate::metadata::{AdcRecord, AverageRecord, FlatRecord, FrameHeader, MasterKind, MasterRecord, PoissonKind};
use crate::numerics::averages::{CLIP, Combine, Kept, is_clipped_by_code};
use crate::numerics::leveled::Leveled;
use crate::stages::noise::{NoiseModel, Tails};
use std::sync::{Mutex, PoisonError};

/// Averages that can come off a frame: of the dark frames on either side of it, and of the bias.
pub const MOST_DARKS: usize = 3;

/// An average of frames without light that was subtracted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dark {
    /// What it was multiplied by.
    pub weight: f64,
    /// Whether it is the bias, which flats may share.
    pub is_bias: bool,
    /// The noise of its frames.
    pub model: NoiseModel,
    /// How many there are.
    pub frames: u32,
    /// How they were averaged.
    pub combine: Combine,
    /// Standard deviations beyond which samples were clipped.
    pub clip: f64,
}

/// What averaging leaves of what is drawn anew in each frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Average {
    /// How far skewness moves the mean.
    mean: f64,
    /// Variance.
    variance: f64,
    /// Share of the variance that is kept, rounding apart.
    kept: f64,
}

/// What is asked of averages that take time to work out: how, of how many, clipped where, and at which spread in codes.
type Asked = (Combine, u32, u64, u64);

/// What averages keep, worked out once for each.
pub(super) fn kept(combine: Combine, frames: u32, clip: f64, std_codes: f64) -> Kept {
    static KNOWN: Mutex<Vec<(Asked, Kept)>> = Mutex::new(Vec::new());
    if combine == Combine::Mean {
        return Kept::of_mean(frames);
    }
    // The spread matters where rounding does more than add its error to each: for even medians, for which two digits will do, and
    // for clipped means, known no better than to a few hundredths.
    let std_codes = match combine {
        Combine::Median if frames.is_multiple_of(2) => (std_codes * 20.0).round() / 20.0,
        Combine::Clipped => ((4.0 * std_codes.clamp(0.1, 16.0).log2()).round() / 4.0).exp2(),
        _ => 1.0,
    };
    let asked = (combine, frames, clip.to_bits(), std_codes.to_bits());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, kept)) = known.iter().find(|(of, _)| *of == asked) {
        return *kept;
    }
    let found = Kept::of(combine, frames, clip, std_codes);
    known.push((asked, found));
    found
}

/// The share of a variance that a part of it is; all of none.
fn share_of(part: f64, all: f64) -> f64 {
    if all > 0.0 { part / all } else { 1.0 }
}

/// What is asked of leveled samples: how they are averaged, clipped where, and from which levels.
type AskedLeveled = (Combine, u64, Vec<u64>);

/// What averages of leveled samples keep, worked out once for each.
fn leveled(combine: Combine, clip: f64, levels: &[f64]) -> Leveled {
    static KNOWN: Mutex<Vec<(AskedLeveled, Leveled)>> = Mutex::new(Vec::new());
    let bits: Vec<u64> = levels.iter().map(|level| level.to_bits()).collect();
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let asked = (combine, clip.to_bits(), bits);
    if let Some((_, found)) = known.iter().find(|(of, _)| *of == asked) {
        return *found;
    }
    let found = Leveled::of(combine, clip, levels);
    known.push((asked, found));
    found
}

impl Dark {
    /// The mean of so many frames, less which a frame is.
    pub fn mean_of(model: NoiseModel, frames: u32) -> Self {
        Self { weight: 1.0, is_bias: false, model, frames, combine: Combine::Mean, clip: CLIP }
    }

    /// What is recorded of an average; none where the noise of its frames is not, unless that of the sensor counts for all.
    fn of(frame: &FrameHeader, record: &MasterRecord, of_sensor: Option<NoiseModel>) -> Option<Self> {
        let model = match &record.noise {
            Some(noise) => NoiseModel::of(frame, &noise.record()).ok()?,
            None => {
                let exposure_s = match record.kind {
                    MasterKind::Bias => record.exposure_s.or(Some(0.0)),
                    MasterKind::Dark => record.exposure_s.or_else(|| frame.metadata.time_s()),
                };
                model_at(frame, exposure_s, record.temperature_k, of_sensor?)?
            }
        };
        let AverageRecord { frames, combine, clip } = record.average;
        let is_bias = record.kind == MasterKind::Bias;
        Some(Self { weight: record.weight, is_bias, model, frames, combine, clip: clip.unwrap_or(CLIP) })
    }

    /// All that is recorded; none where one of them is not known.
    pub fn all(
        frame: &FrameHeader,
        records: &[MasterRecord],
        of_sensor: Option<NoiseModel>,
    ) -> Option<[Option<Self>; MOST_DARKS]> {
        let mut found = [None; MOST_DARKS];
        for (place, record) in records.iter().enumerate() {
            *found.get_mut(place)? = Some(Self::of(frame, record, of_sensor)?);
        }
        Some(found)
    }

    /// What the average keeps of the variance of its frames, about, and of that of rounding.
    pub(super) fn kept(&self) -> [f64; 2] {
        let kept = kept(self.combine, self.frames, self.clip, 10.0);
        [kept.variance, kept.rounding]
    }

    /// Standard deviation, in codes, of what is drawn anew in each of its frames.
    pub(super) fn std_codes(&self, adc: &AdcRecord, expected_e: f64) -> f64 {
        let one = Drawn::codes(&self.model, adc, expected_e, [1.0; 2]);
        let charge = expected_e + self.model.dark_e;
        (one.variance - adc.rounding_at(charge)).max(0.0).sqrt() / adc.sample_slope(adc.level_at(charge))
    }

    /// Whether no formula tells what it keeps, as clipping hangs on where in a code the mean lies.
    pub(super) fn is_clipped_by_code(&self, adc: &AdcRecord, expected_e: f64) -> bool {
        self.combine == Combine::Clipped && is_clipped_by_code(self.frames, self.clip, self.std_codes(adc, expected_e))
    }

    /// What it keeps of samples of such variance, rounding included, and third cumulant about the mean of a photosite.
    fn average(&self, variance: f64, third: f64) -> Average {
        let before = (variance - 1.0 / 12.0).max(0.0);
        let kept = kept(self.combine, self.frames, self.clip, before.sqrt());
        // So are few frames of any kind.
        if kept == Kept::of_mean(self.frames) {
            return Average { mean: 0.0, variance: kept.variance * variance, kept: kept.variance };
        }
        let mean = if before > 0.0 { third / (6.0 * before) * kept.lean } else { 0.0 };
        Average { mean, variance: kept.variance * before + kept.rounding / 12.0, kept: kept.variance }
    }

    /// The average over the photosites of a frame whose codes have such a prediction, of which their pattern has the variance
    /// `pattern`, and what is drawn anew the third cumulant `third`.
    pub(super) fn averaged(&self, code: &Prediction, pattern: f64, third: f64) -> Prediction {
        let Average { mean, variance, kept } = self.average(code.moments.variance - pattern, third);
        let (mean, variance) = (code.moments.mean + mean, variance + pattern);
        Prediction::of_cumulants(mean, variance, kept.powi(2) * code.third, kept.powi(3) * code.fourth())
    }

    /// The average at a photosite.
    pub(super) fn drawn(&self, adc: &AdcRecord, expected_e: f64, site: [f64; 2]) -> Drawn {
        let one = Drawn::codes(&self.model, adc, expected_e, site);
        let average = self.average(one.variance, one.third);
        Drawn { mean: one.mean + average.mean, variance: average.variance, third: one.third * average.kept.powi(2) }
    }
}

/// The noise of frames that is that of the sensor, of another exposure, and temperature where it is known; none where dark current makes
/// it hang on an exposure that nobody knows.
fn model_at(
    frame: &FrameHeader,
    exposure_s: Option<f64>,
    temperature_k: Option<f64>,
    of_sensor: NoiseModel,
) -> Option<NoiseModel> {
    let readout = frame.readout().ok()?;
    let temperature_k = temperature_k.unwrap_or(readout.temperature_k);
    let [dark_e, hot_e] = readout.dark_charges_e(temperature_k, exposure_s)?;
    let tails = Tails { hot_e, ..of_sensor.tails };
    Some(NoiseModel { dark_e, tails, ..of_sensor })
}

/// A flat field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flat {
    /// Signal electrons of its classes R, G and B.
    pub expected_e: [f64; 3],
    /// Photosites over which each was normalized.
    pub photosites: [f64; 3],
    /// The share of good photosites that these are.
    pub counted_share: [f64; 3],
    /// The frames themselves: the noise of each, and how they were averaged.
    pub frames: Dark,
    /// What their average keeps, where they were brought to one level first.
    pub levels: Option<Leveled>,
    /// What came off them first.
    pub darks: [Option<Dark>; MOST_DARKS],
    /// Whether what came off them came off the frame that is divided too.
    pub shares_masters: bool,
    /// How many lines of cells its level is of; none where that is not recorded.
    pub level_lines: Option<LevelLines>,
    /// The level of each class over the mean of F: behind one of several amplifiers not 1.
    pub ratios: [f64; 3],
    /// What came off as a level, beyond the bias of the converter, ADU: of the frame that is divided, and of the flat field.
    pub levels_adu: [f64; 2],
}

/// The lines of cells that the level of a flat field is the mean of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelLines {
    /// Rows and columns.
    pub lines: [f64; 2],
    /// Whether cells are those of a filter array, so that red and blue photosites share none; planes share all.
    pub is_array: bool,
    /// The first of the rows of the sensor that they are of, and how many; none where that is not recorded.
    pub rows: Option<[i64; 2]>,
}

impl LevelLines {
    /// What is recorded; none where nothing is.
    fn of(record: &FlatRecord, is_array: bool) -> Option<Self> {
        let cell = if is_array { 2 } else { 1 };
        let rows = record.area.map(|[_, first, _, height]| [first, height - height.rem_euclid(cell)]);
        record.cell_lines.map(|lines| Self { lines, is_array, rows })
    }

    /// Whether all of its rows count as much: 1 + (their rms difference)² is as many as there are over as many as they count for.
    pub(super) fn are_rows_even(&self) -> bool {
        /// The level of rows that differ by 5 % has a drift that is less off.
        const UNEVEN: f64 = 1.0025;
        let cells = |[_, rows]: [i64; 2]| if self.is_array { rows as f64 / 2.0 } else { rows as f64 };
        self.rows.is_some_and(|rows| cells(rows) <= UNEVEN * self.lines[0])
    }

    /// Rows, and columns, of cells of an area over as many as count as if all had as many whole ones.
    pub(super) fn unevenness(&self, area: Option<[i64; 4]>) -> [f64; 2] {
        let cell = if self.is_array { 2 } else { 1 };
        let [_, _, width, height] = area.unwrap_or_default();
        let of = |length: i64, lines: f64| if lines > 0.0 { ((length / cell) as f64 / lines).max(1.0) } else { 1.0 };
        [of(height, self.lines[0]), of(width, self.lines[1])]
    }

    /// What the means of two classes R, G and B have in common of what each row has by itself (0), or each column (1): Σ w w′ over lines.
    pub(super) fn shared(&self, axis: usize, [k, l]: [usize; 2]) -> f64 {
        let one = self.lines[axis].recip();
        match (self.is_array, k == 1 || l == 1) {
            (false, _) => one,
            (true, true) => 0.5 * one,
            (true, false) => {
                if k == l {
                    one
                } else {
                    0.0
                }
            }
        }
    }
}

/// Cumulants of what is drawn anew at one photosite.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drawn {
    pub mean: f64,
    pub variance: f64,
    pub third: f64,
}

impl Drawn {
    /// Codes of one exposure at a photosite of sensitivities x to light and u to dark current, above the bias of the
    /// converter.
    pub fn codes(model: &NoiseModel, adc: &AdcRecord, expected_e: f64, [x, u]: [f64; 2]) -> Self {
        let k = adc.adu_per_e;
        let shot = |rate: f64, is_shot: bool| if is_shot { rate } else { 0.0 };
        let (light, dark) = (shot(expected_e, model.signal_shot), shot(model.dark_e, model.dark_shot));
        let charge = x * x * light + u * u * dark;
        let skew = x.powi(3) * light + u.powi(3) * dark;
        let mean_e = x * expected_e + u * model.dark_e;
        Self {
            mean: k * mean_e,
            variance: k * k * (charge + model.read_noise().powi(2) + model.tails.trap_variance())
                + adc.rounding_at(mean_e),
            third: if model.poisson == PoissonKind::Exact { k.powi(3) * skew } else { 0.0 },
        }
    }

    /// The same less averages of dark frames.
    pub fn less(mut self, darks: &[Option<Dark>], adc: &AdcRecord, site: [f64; 2]) -> Self {
        for dark in darks.iter().flatten() {
            let average = dark.drawn(adc, 0.0, site);
            self.mean -= dark.weight * average.mean;
            self.variance += dark.weight.powi(2) * average.variance;
            self.third -= dark.weight.powi(3) * average.third;
        }
        self
    }
}

impl Flat {
    /// What is recorded of a flat field; none where the noise of its frames is not, unless that of the sensor counts for all, or
    /// where not all of its classes are R, G and B.
    pub fn of(
        frame: &FrameHeader,
        record: &FlatRecord,
        adc: &AdcRecord,
        of_sensor: Option<NoiseModel>,
    ) -> Option<Self> {
        let AverageRecord { frames, combine, clip } = record.average;
        let model = match &record.noise {
            Some(noise) => NoiseModel::of(frame, &noise.record()).ok()?,
            None => match record.exposure_s.or_else(|| frame.metadata.time_s()) {
                Some(exposure_s) => model_at(frame, Some(exposure_s), record.temperature_k, of_sensor?)?,
                None => of_sensor?,
            },
        };
        let three = |values: &[f64]| match values {
            [one] => Some([*one; 3]),
            [red, green, blue] => Some([*red, *green, *blue]),
            _ => None,
        };
        let photosites: Vec<f64> = record.photosites.iter().map(|count| *count as f64).collect();
        let left_out = record.left_out.iter().map(|count| *count as f64).chain(std::iter::repeat(0.0));
        let counted: Vec<f64> = photosites.iter().zip(left_out).map(|(n, left)| n / (n + left).max(1.0)).collect();
        let darks = Dark::all(frame, &record.masters, of_sensor)?;
        let is_green = |channel: &String| channel == "G";
        let are_planes = record.means_adu.len() == 1
            || frame.metadata.demosaic.is_none() && frame.geometry.channels.iter().any(is_green);
        let level_adu = |adc: &AdcRecord| record.black_adu.map_or(0.0, |black| black - adc.bias_adu);
        // What dark signal is left in the means is no light.
        let dark_e = |model: &NoiseModel| model.dark_e * sensitivity(model.dcnu).0 + model.tails.mean_hot_e();
        let off_e: f64 = darks.iter().flatten().map(|dark| dark.weight * dark_e(&dark.model)).sum();
        let left_e = |adc: &AdcRecord| dark_e(&model) - off_e - level_adu(adc) / adc.adu_per_e;
        let (means, response) = (three(&record.means_adu)?, sensitivity(model.response()).0);
        let light_e = |k: usize| match record.tap_shares(k) {
            // The mean is that of what all have made of the light.
            Some(shares) => {
                let all = || shares.iter().zip(&record.converters);
                let left: f64 = all().map(|(share, adc)| share * adc.adu_per_e * left_e(adc)).sum();
                (means[k] - left) / (response * all().map(|(share, adc)| share * adc.adu_per_e).sum::<f64>())
            }
            None => (means[k] / adc.adu_per_e - left_e(adc)) / response,
        };
        let expected_e = [0, 1, 2].map(light_e);
        let ratio = |k: usize| means[k] / (adc.adu_per_e * (expected_e[k] * response + left_e(adc)));
        Some(Self {
            expected_e,
            ratios: if record.converters.is_empty() { [1.0; 3] } else { [0, 1, 2].map(ratio) },
            photosites: three(&photosites)?,
            counted_share: three(&counted)?,
            frames: Dark { weight: 1.0, is_bias: false, model, frames, combine, clip: clip.unwrap_or(CLIP) },
            levels: (record.levels.len() > 1).then(|| leveled(combine, clip.unwrap_or(CLIP), &record.levels)),
            darks,
            shares_masters: record.shares_masters,
            level_lines: LevelLines::of(record, !are_planes),
            levels_adu: [0.0, level_adu(adc)],
        })
    }

    /// F at a photosite, of a class of so many electrons.
    ///
    /// Of leveled frames, F = ⟨s (M − D)⟩: what M has of noise counts by the law of the average, what D has once for all frames.
    pub(super) fn drawn(&self, adc: &AdcRecord, light_e: f64, site: [f64; 2]) -> Drawn {
        let Some(levels) = &self.levels else {
            let mut found = self.frames.drawn(adc, light_e, site).less(&self.darks, adc, site);
            found.mean -= self.levels_adu[1];
            return found;
        };
        let [one, unlit] = [light_e, 0.0].map(|light_e| Drawn::codes(&self.frames.model, adc, light_e, site));
        let off =
            Drawn { mean: unlit.mean - self.levels_adu[1], variance: 0.0, third: 0.0 }.less(&self.darks, adc, site);
        let kept = levels.at(share_of(unlit.variance, one.variance));
        let lean = if one.variance > 0.0 { one.third / (6.0 * one.variance) * kept.lean } else { 0.0 };
        Drawn {
            mean: one.mean - unlit.mean + kept.shift * off.mean + lean,
            variance: kept.variance * one.variance + kept.shift.powi(2) * off.variance,
            third: kept.variance.powi(2) * one.third + kept.shift.powi(3) * off.third,
        }
    }

    /// What counts in F of what came off its frames, at such light.
    pub(super) fn share_of_darks(&self, adc: &AdcRecord, light_e: f64, site: [f64; 2]) -> f64 {
        let variance = |light_e: f64| Drawn::codes(&self.frames.model, adc, light_e, site).variance;
        self.levels.as_ref().map_or(1.0, |levels| levels.at(share_of(variance(0.0), variance(light_e))).shift)
    }

    /// Electrons of the dimmest and of the brightest of its frames, of a class of so many on average.
    pub(super) fn ends_e(&self, light_e: f64) -> [f64; 2] {
        self.levels.as_ref().map_or([light_e; 2], |levels| levels.ends.map(|end| end * light_e))
    }

    /// The averages of the same frames that came off both, as they came off a frame and off the flat field: the bias, or all.
    pub(super) fn in_both<'a>(&'a self, of_frame: &'a [Option<Dark>]) -> impl Iterator<Item = [Dark; 2]> + 'a {
        let of_flat = |dark: &Dark| self.darks.iter().flatten().find(|other| other.is_bias == dark.is_bias).copied();
        let pairs = of_frame.iter().flatten().filter_map(move |dark| Some([*dark, of_flat(dark)?]));
        pairs.filter(|[a, b]| a.frames == b.frames && (a.is_bias || self.shares_masters))
    }
}
