//! Averages of dark frames, and of flats, as predictions know them.

use super::charge::{charge, sensitivity};
use super::moments::Prediction;
use super::photosite::Photosite;
use crate::metadata::{AdcRecord, AverageRecord, FlatRecord, FrameHeader, MasterKind, MasterRecord, PoissonKind};
use crate::numerics::averages::{CLIP, Combine, Kept};
use crate::numerics::gauss::panel;
use crate::numerics::normal::{cumulative, density};
use crate::stages::noise::NoiseModel;
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
pub(super) struct Average {
    /// How far skewness moves the mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
    /// Share of the variance that is kept, rounding apart.
    pub kept: f64,
}

/// What is asked of averages that take time to work out: how, of how many, clipped where, and at which spread in codes.
type Asked = (Combine, u32, u64, u64);

/// What averages keep, worked out once for each.
fn kept(combine: Combine, frames: u32, clip: f64, std_codes: f64) -> Kept {
    static KNOWN: Mutex<Vec<(Asked, Kept)>> = Mutex::new(Vec::new());
    if combine == Combine::Mean {
        return Kept::of_mean(frames);
    }
    // The spread matters for the rounding of the median of an even number alone, for which two digits will do.
    let is_even_median = combine == Combine::Median && frames.is_multiple_of(2);
    let std_codes = if is_even_median { (std_codes * 20.0).round() / 20.0 } else { 1.0 };
    let asked = (combine, frames, clip.to_bits(), std_codes.to_bits());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, kept)) = known.iter().find(|(of, _)| *of == asked) {
        return *kept;
    }
    let found = Kept::of(combine, frames, clip, std_codes);
    known.push((asked, found));
    found
}

impl Dark {
    /// The mean of so many frames, less which a frame is.
    pub fn mean_of(model: NoiseModel, frames: u32) -> Self {
        Self { weight: 1.0, is_bias: false, model, frames, combine: Combine::Mean, clip: CLIP }
    }

    /// What is recorded of an average; none where the noise of its frames is not.
    fn of(frame: &FrameHeader, record: &MasterRecord) -> Option<Self> {
        let model = NoiseModel::of(frame, &record.noise.as_ref()?.record()).ok()?;
        let AverageRecord { frames, combine, clip } = record.average;
        let is_bias = record.kind == MasterKind::Bias;
        Some(Self { weight: record.weight, is_bias, model, frames, combine, clip: clip.unwrap_or(CLIP) })
    }

    /// All that is recorded; none where one of them is not known.
    pub fn all(frame: &FrameHeader, records: &[MasterRecord]) -> Option<[Option<Self>; MOST_DARKS]> {
        let mut found = [None; MOST_DARKS];
        for (place, record) in records.iter().enumerate() {
            *found.get_mut(place)? = Some(Self::of(frame, record)?);
        }
        Some(found)
    }

    /// What the average keeps of the variance of its frames, about.
    pub(super) fn kept(&self) -> f64 {
        kept(self.combine, self.frames, self.clip, 10.0).variance
    }

    /// What it keeps of samples of such variance, rounding included, and third cumulant about the mean of a photosite.
    pub(super) fn average(&self, variance: f64, third: f64) -> Average {
        let before = (variance - 1.0 / 12.0).max(0.0);
        let kept = kept(self.combine, self.frames, self.clip, before.sqrt());
        if self.combine == Combine::Mean {
            return Average { mean: 0.0, variance: kept.variance * variance, kept: kept.variance };
        }
        let mean = if before > 0.0 { third / (6.0 * before) * kept.lean } else { 0.0 };
        Average { mean, variance: kept.variance * before + kept.rounding / 12.0, kept: kept.variance }
    }

    /// The average at a photosite.
    fn drawn(&self, adc: &AdcRecord, expected_e: f64, site: [f64; 2]) -> Drawn {
        let one = Drawn::codes(&self.model, adc, expected_e, site);
        let average = self.average(one.variance, one.third);
        Drawn { mean: one.mean + average.mean, variance: average.variance, third: one.third * average.kept.powi(2) }
    }
}

/// A flat field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flat {
    /// Signal electrons of its classes R, G and B.
    pub expected_e: [f64; 3],
    /// Photosites over which each was normalized.
    pub photosites: [f64; 3],
    /// The frames themselves: the noise of each, and how they were averaged.
    pub frames: Dark,
    /// What came off them first.
    pub darks: [Option<Dark>; MOST_DARKS],
}

/// Cumulants of what is drawn anew at one photosite.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    mean: f64,
    variance: f64,
    third: f64,
}

impl Drawn {
    /// Codes of one exposure at a photosite of sensitivities x to light and u to dark current, above the bias of the
    /// converter.
    fn codes(model: &NoiseModel, adc: &AdcRecord, expected_e: f64, [x, u]: [f64; 2]) -> Self {
        let k = adc.adu_per_e;
        let shot = |rate: f64, is_shot: bool| if is_shot { rate } else { 0.0 };
        let (light, dark) = (shot(expected_e, model.signal_shot), shot(model.dark_e, model.dark_shot));
        let charge = x * x * light + u * u * dark;
        let skew = x.powi(3) * light + u.powi(3) * dark;
        Self {
            mean: k * (x * expected_e + u * model.dark_e),
            variance: k * k * (charge + model.read_noise_e.powi(2)) + 1.0 / 12.0,
            third: if model.poisson == PoissonKind::Exact { k.powi(3) * skew } else { 0.0 },
        }
    }

    /// The same less averages of dark frames.
    fn less(mut self, darks: &[Option<Dark>], adc: &AdcRecord, site: [f64; 2]) -> Self {
        for dark in darks.iter().flatten() {
            let average = dark.drawn(adc, 0.0, site);
            self.mean -= dark.weight * average.mean;
            self.variance += dark.weight.powi(2) * average.variance;
            self.third -= dark.weight.powi(3) * average.third;
        }
        self
    }
}

/// Sensitivities max(0, 1 + σ z) and their weights.
fn sensitivities(sigma: f64) -> Vec<(f64, f64)> {
    /// Standard deviations beyond which nothing counts.
    const REACH: f64 = 8.0;
    const PANELS: u32 = 4;
    if sigma <= 0.0 {
        return vec![(1.0, 1.0)];
    }
    let lowest = (-1.0 / sigma).max(-REACH);
    let width = (REACH - lowest) / f64::from(PANELS);
    let mut found = vec![(0.0, cumulative(lowest))];
    for index in 0..PANELS {
        let low = lowest + width * f64::from(index);
        found.extend(panel(low, low + width).map(|(z, weight)| (1.0 + sigma * z, weight * density(z))));
    }
    found.retain(|(_, weight)| *weight > 1e-14);
    found
}

/// Why nothing is predicted of samples that were divided by a flat field.
pub(super) const NARROW: &str = "what was divided by a flat field, or the flat field, reaches full well or an end of the codes, or \
                                 scatters over less than a code";

/// The least standard deviation, in codes, of which rounding is a uniform error: what else it does to the variance is below
/// 4σ² e^(−2π²σ²), 1 % of it, and less where patterns spread it.
const LEAST_CODES: f64 = 0.5;

/// Relative variance of a flat field beyond which dividing by it follows no series.
const MOST_NOISE: f64 = 0.01;

impl Photosite {
    /// Moments of the class R, G or B after division by the flat field: with A what is left of the codes and F the flat
    /// field at a photosite, ⟨F⟩ the mean of the class,
    ///
    /// y = A ⟨F⟩ / F,  E\[1/F] = (1 + ρ − s + 3ρ²)/f,  E\[1/F²] = (1 + 3ρ − 4s + 15ρ²)/f²
    ///
    /// f, ρ and s are mean, relative variance and κ₃/f³ of F over exposures; all is averaged over the sensitivities of
    /// photosites, which A and F share. Noise of bias frames that came off both is in both. None where samples are clipped
    /// or scatter over less than a code.
    pub fn divided(&self, class: usize, expected_e: f64) -> Option<Prediction> {
        let (adc, flat) = (self.adc?, self.flat?);
        let light_e = flat.expected_e[class];
        let mut averages = self.darks.iter().chain(&flat.darks).flatten();
        let is_open = self.is_open(&adc, expected_e)
            && self.of_dark(&flat.frames).is_open(&adc, light_e)
            && averages.all(|dark| self.of_dark(dark).is_open(&adc, 0.0));
        if !is_open {
            return None;
        }
        let bias = |darks: &[Option<Dark>]| darks.iter().flatten().find(|dark| dark.is_bias).copied();
        let in_both = bias(&self.darks).zip(bias(&flat.darks)).filter(|(a, b)| a.frames == b.frames);
        let [lights, darks] = [self.model.prnu, self.model.dcnu].map(sensitivities);
        let mut sums = [0.0; 6];
        for (&(x, of_x), &(u, of_u)) in lights.iter().flat_map(|x| darks.iter().map(move |u| (x, u))) {
            let site = [x, u];
            let above = Drawn::codes(&self.model, &adc, expected_e, site).less(&self.darks, &adc, site);
            let below = flat.frames.drawn(&adc, light_e, site).less(&flat.darks, &adc, site);
            // Photosites that see no light are marked as defective.
            if below.mean <= 0.0 {
                continue;
            }
            let f = below.mean;
            let (rho, skew) = (below.variance / (f * f), below.third / f.powi(3));
            if rho > MOST_NOISE {
                return None;
            }
            let both = in_both.map_or(0.0, |(a, b)| a.weight * b.weight * a.drawn(&adc, 0.0, site).variance) / f;
            let first = (above.mean * (1.0 + rho - skew + 3.0 * rho * rho) - both) / f;
            let of_square = 1.0 + 3.0 * rho - 4.0 * skew + 15.0 * rho * rho;
            let square = ((above.mean.powi(2) + above.variance) * of_square - 4.0 * above.mean * both) / (f * f);
            // Third cumulant of the quotient, of its own noise and of the curvature of 1/F.
            let noise = above.variance / (f * f);
            let third = (above.third - above.mean.powi(3) * skew) / f.powi(3)
                + 6.0 * first * rho * (noise + first * first * rho);
            for (sum, value) in sums.iter_mut().zip([1.0, first, square, f, third, rho]) {
                *sum += of_x * of_u * value;
            }
        }
        let [weight, sums @ ..] = sums;
        let [first, square, scale, third, rho] = sums.map(|sum| sum / weight);
        let mean = first * scale;
        let variance = ((square - first * first) * scale * scale).max(0.0);
        // The mean of the flat field is that of so many sensitivities, as is that of the frame; its noise is in both too.
        let off = (sensitivity(self.model.prnu).1 - rho) / flat.photosites[class].max(1.0);
        let prediction = Prediction::of_cumulants(mean, variance, third * scale.powi(3), 0.0);
        Some(Prediction { common: mean * mean * off, ..prediction })
    }

    /// The variance after division by the flat field; where [`Self::divided`] gives none, to first order: that of the codes
    /// less the pattern of the response, and what the noise of the flat field adds.
    pub(super) fn variance_divided(&self, class: usize, expected_e: f64) -> f64 {
        if let Some(divided) = self.divided(class, expected_e) {
            return divided.moments.variance;
        }
        let own = self.moments(expected_e).moments.variance;
        let (Some(adc), Some(flat)) = (self.adc, self.flat) else { return own };
        let below = flat.frames.drawn(&adc, flat.expected_e[class], [1.0; 2]).less(&flat.darks, &adc, [1.0; 2]);
        let level = expected_e * adc.adu_per_e;
        (own - (self.model.prnu * level).powi(2)).max(0.0) + below.variance * (level / below.mean).powi(2)
    }

    /// Whether codes are charge and a uniform error: they scatter, and neither full well nor an end of the codes is within 6
    /// standard deviations.
    fn is_open(&self, adc: &AdcRecord, expected_e: f64) -> bool {
        const REACH: f64 = 6.0;
        let of_charge = charge(&self.model, expected_e);
        let temporal = Drawn::codes(&self.model, adc, expected_e, [1.0; 2]).variance - 1.0 / 12.0;
        let read_e = self.model.read_noise_e;
        let reach_e = REACH * (of_charge.variance + read_e * read_e).sqrt();
        let level = |charge_e: f64| adc.bias_adu + adc.adu_per_e * charge_e;
        temporal.sqrt() >= LEAST_CODES
            && level((of_charge.mean - reach_e).max(-REACH * read_e)) > 0.0
            && level(of_charge.mean + reach_e) < f64::from(adc.top_code())
            && of_charge.mean + REACH * of_charge.variance.sqrt() < self.model.full_well_e
    }
}

impl Flat {
    /// What is recorded of a flat field; none where the noise of its frames is not, or not all of its classes are R, G and B.
    pub fn of(frame: &FrameHeader, record: &FlatRecord, adc: &AdcRecord) -> Option<Self> {
        let AverageRecord { frames, combine, clip } = record.average;
        let model = NoiseModel::of(frame, &record.noise.as_ref()?.record()).ok()?;
        let three = |values: &[f64]| match values {
            [one] => Some([*one; 3]),
            [red, green, blue] => Some([*red, *green, *blue]),
            _ => None,
        };
        let photosites: Vec<f64> = record.photosites.iter().map(|count| *count as f64).collect();
        let signal = sensitivity(model.prnu).0 * adc.adu_per_e;
        Some(Self {
            expected_e: three(&record.means_adu)?.map(|mean| mean / signal),
            photosites: three(&photosites)?,
            frames: Dark { weight: 1.0, is_bias: false, model, frames, combine, clip: clip.unwrap_or(CLIP) },
            darks: Dark::all(frame, &record.masters)?,
        })
    }
}
