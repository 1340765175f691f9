//! Moments of photosites that were divided by a flat field.

use super::charge::{charge, sensitivities};
use super::divided_kinds::CUT_OFF;
use super::masters::{Dark, Drawn, Flat};
use super::mixture::mixture;
use super::moments::{LineCovariance, Prediction};
use super::photosite::Photosite;
use super::quotients::{Quotients, few_sensitivities};
use super::unlike::{Temporal, Unlike, UnlikeSums};
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::AdcRecord;
use crate::numerics::averages::Combine;
use crate::stages::noise::{LineNoise, NoiseModel};

/// Why nothing is predicted of samples that were divided by a flat field.
const NARROW: &str = "what was divided by a flat field, or the flat field, reaches full well or an end of the codes, or \
                                 scatters over less than half a code";
/// The same of a converter that is not straight.
const BENT: &str = "it was divided by a flat field, and the curve of its converter (`linearization`) is in both: what it makes of the quotient is not \
                    predicted; correct it with `--linearize`";

/// Why nothing is said of samples that were divided by noise.
pub(super) const NOISY: &str = "the flat field is so noisy that what is divided by it follows no series here (standard deviations beyond \
                                10 % of its level; beyond 22 % not even those of --sigma); average more flats, or brighter ones";

/// The least standard deviation, in codes, of which rounding is a uniform error: what else it does to the variance is below
/// 4σ² e^(−2π²σ²), 1 % of it, and less where patterns spread it.
const LEAST_CODES: f64 = 0.5;

/// How noisy flat fields may be for the series of the quotient.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Relative variance of a flat field at most.
    noise: f64,
    /// The share of photosites at most that are noisier, and left out: what they, which their dark signal leaves hardly any light, make
    /// of the light is no ordinary pixel.
    left_out: f64,
    /// What the series may leave out of the variance at photosites that are unlike most, and noisier.
    lost: f64,
}

/// Where the series is good to 10⁻³.
const STRICT: Limits = Limits { noise: 0.01, left_out: 0.0, lost: 1e-6 };
/// Where it is good to a few hundredths, and a normal flat field near zero, 4.5 standard deviations off, adds as little.
const WIDE: Limits = Limits { noise: 0.05, left_out: 0.01, lost: 0.01 };

/// The relative variance of a flat field beyond which no photosite is followed.
const MOST_NOISE: f64 = 0.1;

/// The covariance of the samples of a photosite with its flat field, and the variance of that, ADU².
#[derive(Debug, Clone, Copy)]
pub(super) struct OfLevel {
    pub with: f64,
    pub variance: f64,
}

impl Photosite {
    /// Moments of the class R, G or B after division by the flat field: with A what is left of the codes and F the flat
    /// field at a photosite, ⟨F⟩ the mean of the class,
    ///
    /// y = A ⟨F⟩ / F,  E\[1/F] = (1 + ρ − s + 3ρ²)/f,  E\[1/F²] = (1 + 3ρ − 4s + 15ρ²)/f²
    ///
    /// f, ρ and s are mean, relative variance and κ₃/f³ of F over exposures; all is averaged over the sensitivities of
    /// photosites, which A and F share. Noise of bias or dark frames that came off both is in both. None where samples are clipped
    /// or scatter over less than a code.
    pub fn divided(&self, class: usize, expected_e: f64) -> Option<Prediction> {
        self.divided_over(class, expected_e).map(|(prediction, _)| prediction)
    }

    /// The same beside what is drawn anew in each frame that is divided by one flat field, less the same dark frames; what it
    /// differs by among photosites has the noise of the flat field in it.
    pub(super) fn divided_over(&self, class: usize, expected_e: f64) -> Option<(Prediction, Temporal)> {
        self.divided_within(class, expected_e, STRICT).map(|(prediction, temporal, _)| (prediction, temporal))
    }

    /// What samples of a photosite and its flat field have in common with the level of that, as far as it is theirs.
    pub(super) fn of_level(&self, class: usize, expected_e: f64) -> Option<OfLevel> {
        self.divided_within(class, expected_e, STRICT).map(|(_, _, of_level)| of_level)
    }

    /// The same of flat fields within such limits.
    fn divided_within(&self, class: usize, expected_e: f64, limits: Limits) -> Option<(Prediction, Temporal, OfLevel)> {
        let flat = self.flat?;
        if !self.is_all_open(class, expected_e) || !self.are_tails_open(class, expected_e) {
            return None;
        }
        let (mut all, mut unlike) = (Quotients::default(), UnlikeSums::default());
        let mut parts = Vec::new();
        for kind in self.kinds_divided(class, expected_e) {
            let found = kind.site.quotients(class, expected_e, (kind.share, kind.is_rare), limits, &mut unlike)?;
            if found.weight > 0.0 {
                parts.push((
                    found.weight,
                    found.law(kind.site.fourth_of_jumps(&found), kind.site.sixth_of_jumps(&found)),
                ));
            }
            all.take(&found);
        }
        if all.left_out > limits.left_out * (all.weight + all.left_out) {
            return None;
        }
        let [first, square, scale, third, above, of_flat] = all.means();
        let of_level = OfLevel { with: scale * (above - scale * first), variance: of_flat - scale * scale };
        if all.lost > limits.lost * (square - first * first) * all.weight {
            return None;
        }
        let mean = first * scale;
        let variance = ((square - first * first) * scale * scale).max(0.0);
        // ⟨F⟩ is a mean over as many photosites, the same patterns and the same noise as A/F: those that it counts share.
        let off = flat.counted_share[class] * 2.0 * first * of_level.with + first * first * of_level.variance;
        let prediction = if self.has_tails() {
            parts.iter_mut().for_each(|(weight, _)| *weight /= all.weight);
            mixture(&parts).scaled(scale)
        } else {
            Prediction::of_cumulants(mean, variance, third * scale.powi(3), 0.0)
        };
        let (anew, unlike) = unlike.found();
        let unlike = Unlike { spread: unlike.spread + all.of_flat_noise / all.weight, of_means: None, ..unlike };
        let square = scale * scale;
        let temporal = Temporal {
            variance: anew * square,
            rounding: all.rounding / all.weight * square,
            unlike: (!self.has_tails()).then(|| unlike.scaled(scale)),
            single: [0.0; 2],
            lines: LineCovariance::default(),
        };
        let prediction = Prediction { common: off / flat.photosites[class].max(1.0), ..prediction };
        let ratio = flat.ratios[class];
        if ratio == 1.0 {
            return Some((prediction, temporal, of_level));
        }
        // Behind one of several amplifiers the level is that of all, and what it makes of them together is not told by one.
        let unlike = temporal.unlike.map(|unlike| unlike.scaled(ratio));
        let square = ratio * ratio;
        let temporal =
            Temporal { variance: square * temporal.variance, rounding: square * temporal.rounding, unlike, ..temporal };
        Some((prediction.scaled(ratio), temporal, OfLevel { with: ratio * of_level.with, ..of_level }))
    }

    /// Sums over the sensitivities of photosites that are alike but for these, of such a share of all, and whether they are so few that
    /// none counts whose flat field is too noisy.
    fn quotients(
        &self,
        class: usize,
        expected_e: f64,
        (share, is_rare): (f64, bool),
        limits: Limits,
        unlike: &mut UnlikeSums,
    ) -> Option<Quotients> {
        let (adc, flat) = (self.adc?, self.flat?);
        let light_e = flat.expected_e[class];
        let in_both: Vec<[Dark; 2]> = flat.in_both(&self.darks).collect();
        let [lights, darks] = [self.model.response(), self.model.dcnu]
            .map(|sigma| if share == 1.0 { sensitivities(sigma) } else { few_sensitivities(sigma) });
        let mut found = Quotients::default();
        for (&(x, of_x), &(u, of_u)) in lights.iter().flat_map(|x| darks.iter().map(move |u| (x, u))) {
            let (site, weight) = ([x, u], share * of_x * of_u);
            let drawn = Drawn::codes(&self.model, &adc, expected_e, site);
            let mut above = drawn.less(&self.darks, &adc, site);
            let below = flat.drawn(&adc, light_e, site);
            above.mean -= flat.levels_adu[0];
            // Photosites that see no light are marked as defective.
            if below.mean <= 0.0 {
                continue;
            }
            let f = below.mean;
            let (rho, skew) = (below.variance / (f * f), below.third / f.powi(3));
            if rho > limits.noise && (share == 1.0 || is_rare || rho > MOST_NOISE) {
                found.left_out += if is_rare { 0.0 } else { weight };
                continue;
            }
            let of_both = |[a, b]: &[Dark; 2]| a.weight * b.weight * a.drawn(&adc, 0.0, site).variance;
            let of_darks = if in_both.is_empty() { 1.0 } else { flat.share_of_darks(&adc, light_e, site) };
            let both = of_darks * in_both.iter().map(of_both).sum::<f64>() / f;
            let first = (above.mean * (1.0 + rho - skew + 3.0 * rho * rho) - both) / f;
            let of_square = 1.0 + 3.0 * rho - 4.0 * skew + 15.0 * rho * rho;
            let square = ((above.mean.powi(2) + above.variance) * of_square - 4.0 * above.mean * both) / (f * f);
            // Third cumulant of the quotient, of its own noise and of the curvature of 1/F.
            let noise = above.variance / (f * f);
            if rho > limits.noise {
                found.lost += weight * 105.0 * rho.powi(3) * (first * first + noise);
            }
            let offset = self.offsets_left(&adc, &flat, above.mean / f) / (f * f);
            let square = square + offset;
            let third = (above.third - above.mean.powi(3) * skew) / f.powi(3)
                + 6.0 * first * rho * (noise + first * first * rho);
            let anew = drawn.variance * of_square / (f * f);
            unlike.add(weight, [first, anew, drawn.third / f.powi(3), 0.0]);
            found.of_flat_noise += weight * 4.0 * rho * anew * anew;
            found.rounding += weight * adc.rounding_at(x * expected_e + u * self.model.dark_e) * of_square / (f * f);
            found.add(weight, [first, square, f, third, above.mean, f * f + below.variance]);
        }
        Some(found)
    }

    /// Whether codes of the frame, of its flats and of what came off both, at so many electrons in the frame, are charge and a uniform
    /// error.
    pub(super) fn is_all_open(&self, class: usize, expected_e: f64) -> bool {
        let (Some(adc), Some(flat)) = (&self.adc, &self.flat) else { return false };
        let light_e = flat.expected_e[class];
        let is_smooth = |dark: &Dark, expected_e: f64| self.of_dark(dark).is_smooth(dark, adc, expected_e);
        let mut averages = self.darks.iter().chain(&flat.darks).flatten();
        self.is_open(adc, expected_e)
            && flat.ends_e(light_e).into_iter().all(|end_e| self.of_dark(&flat.frames).is_open(adc, end_e))
            && is_smooth(&flat.frames, light_e)
            && averages.all(|dark| self.of_dark(dark).is_open(adc, 0.0) && is_smooth(dark, 0.0))
    }

    /// The variance, in ADU², of the fixed offsets that darks leave of the codes and of the flat field, which counts by the
    /// ratio of the two.
    fn offsets_left(&self, adc: &AdcRecord, flat: &Flat, ratio: f64) -> f64 {
        let left = |own: &NoiseModel, darks: &[Option<Dark>], part: fn(&LineNoise) -> f64| {
            let off: f64 = darks.iter().flatten().map(|dark| dark.weight * part(&dark.model.lines)).sum();
            part(&own.lines) - off
        };
        let parts: [fn(&LineNoise) -> f64; 3] =
            [|lines| lines.dsnu_e, |lines| lines.dsnu_row_e, |lines| lines.dsnu_column_e];
        let sum: f64 = parts
            .map(|part| left(&self.model, &self.darks, part) - ratio * left(&flat.frames.model, &flat.darks, part))
            .iter()
            .map(|left| left * left)
            .sum();
        adc.adu_per_e * adc.adu_per_e * sum
    }

    /// Makes sure that the flat field of no class is too noisy for the variance of what is divided by it; that has none where the flat
    /// field reaches zero.
    pub(super) fn check_flat(&self) -> Predicted<()> {
        let (Some(adc), Some(flat)) = (self.adc, self.flat) else { return Ok(()) };
        let is_quiet = |light_e: f64| {
            let below = flat.drawn(&adc, light_e, [1.0; 2]);
            below.mean > 0.0 && below.variance <= WIDE.noise * below.mean.powi(2)
        };
        if flat.expected_e.into_iter().all(is_quiet) { Ok(()) } else { Err(Unpredictable::Beyond(NOISY)) }
    }

    /// Why [`Self::divided`] gives nothing of a class.
    pub(super) fn why_not_divided(&self, class: usize, expected_e: f64) -> Unpredictable {
        if self.adc.is_some_and(|adc| adc.is_bent()) {
            return Unpredictable::Beyond(BENT);
        }
        Unpredictable::Beyond(match self.is_all_open(class, expected_e) {
            false => NARROW,
            true if !self.are_tails_open(class, expected_e) => CUT_OFF,
            true => NOISY,
        })
    }

    /// The variance after division by the flat field; where [`Self::divided`] gives none, to second order at the mean sensitivities: that
    /// of the codes less the pattern of the response, and what the noise of the flat field adds.
    pub(super) fn variance_divided(&self, class: usize, expected_e: f64) -> f64 {
        if let Some(divided) = self.divided(class, expected_e) {
            return divided.moments.variance;
        }
        if let Some((divided, ..)) = self.divided_within(class, expected_e, WIDE) {
            return divided.moments.variance;
        }
        let own = match self.has_tails() {
            true => self.variance_by_few(expected_e),
            false => self.moments(expected_e).moments.variance,
        };
        let (Some(adc), Some(flat)) = (self.adc, self.flat) else { return own };
        let below = flat.drawn(&adc, flat.expected_e[class], [1.0; 2]);
        let level = expected_e * adc.adu_per_e;
        let codes = (own - (self.model.response() * level).powi(2)).max(0.0);
        let rho = below.variance / below.mean.powi(2);
        // E[1/F²], and its excess over E[1/F]².
        flat.ratios[class].powi(2) * (codes * (1.0 + 3.0 * rho) + level * level * rho * (1.0 + 8.0 * rho))
    }

    /// Whether rounding is a uniform error of an average of such codes: averages, or photosites, scatter.
    fn is_smooth(&self, average: &Dark, adc: &AdcRecord, expected_e: f64) -> bool {
        let temporal = average.std_codes(adc, expected_e) * average.kept()[0].sqrt();
        let Self { model, .. } = self;
        let patterns =
            adc.adu_per_e * (model.response() * expected_e).hypot(model.dcnu * model.dark_e).hypot(model.offsets());
        match average.combine {
            Combine::Mean => true,
            Combine::Median => temporal.hypot(patterns) >= LEAST_CODES,
            Combine::Clipped => !average.is_clipped_by_code(adc, expected_e),
        }
    }

    /// Whether codes are charge and a uniform error: they scatter, and neither full well nor an end of the codes is within 6
    /// standard deviations.
    fn is_open(&self, adc: &AdcRecord, expected_e: f64) -> bool {
        const REACH: f64 = 6.0;
        let of_charge = charge(&self.model, expected_e);
        let rounding = adc.rounding_at(expected_e + self.model.dark_e);
        let temporal = Drawn::codes(&self.model, adc, expected_e, [1.0; 2]).variance - rounding;
        let read_e = self.model.added();
        let jump_e = self.model.tails.trap_e;
        let reach_e = REACH * (of_charge.variance + read_e * read_e).sqrt() + jump_e;
        let level = |charge_e: f64| adc.level_at(charge_e);
        !adc.is_bent()
            && temporal.sqrt() >= LEAST_CODES
            && level((of_charge.mean - reach_e).max(-REACH * read_e - jump_e)) > 0.0
            && level(of_charge.mean + reach_e) < f64::from(adc.top_code())
            && of_charge.mean + REACH * of_charge.variance.sqrt() < self.model.full_well_e
    }
}
