//! The variance of a photosite, cause by cause.

use super::charge::sensitivity;
use super::moments::Equations;
use super::photosite::Photosite;
use super::tail::Tail;
use crate::metadata::AdcRecord;
use crate::numerics::normal::{self, MeanVariance};
use serde::Serialize;

/// A cause of variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Shot noise of the light.
    SignalShot,
    /// Photo-response non-uniformity, a fixed pattern.
    Prnu,
    /// Shot noise of the dark signal.
    DarkShot,
    /// Dark-current non-uniformity, a fixed pattern.
    Dcnu,
    /// Shot noise as the patterns scale it, the cross terms λ s² that Eq. 11 of \[HP2005] drops.
    ShotTimesPattern,
    /// Read noise.
    Read,
    /// Full well, which takes from the variance.
    FullWell,
    /// Rounding to whole codes.
    Quantization,
    /// The ends of the range of codes, which take from the variance.
    Rails,
}

impl Cause {
    /// All causes, in the order in which they act.
    pub const ALL: [Self; 9] = [
        Self::SignalShot,
        Self::Prnu,
        Self::DarkShot,
        Self::Dcnu,
        Self::ShotTimesPattern,
        Self::Read,
        Self::FullWell,
        Self::Quantization,
        Self::Rails,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::SignalShot => "signal_shot",
            Self::Prnu => "prnu",
            Self::DarkShot => "dark_shot",
            Self::Dcnu => "dcnu",
            Self::ShotTimesPattern => "shot_times_pattern",
            Self::Read => "read",
            Self::FullWell => "full_well",
            Self::Quantization => "quantization",
            Self::Rails => "rails",
        }
    }

    /// Whether it is the same in every exposure of one sensor.
    pub fn is_fixed_pattern(self) -> bool {
        matches!(self, Self::Prnu | Self::Dcnu)
    }
}

/// Variances by cause, in the order of [`Cause::ALL`]; they add up to the whole variance.
pub type Budget = [f64; Cause::ALL.len()];

impl Photosite {
    /// The variance of its samples by cause, in e² or ADU².
    pub fn budget(&self, expected_e: f64) -> Budget {
        match self.adc {
            Some(adc) if self.dark_frames > 0 => {
                let (light, dark) = (self.digitized_budget(&adc, expected_e), self.digitized_budget(&adc, 0.0));
                // The pattern of the dark current is the same in light and dark frames.
                Cause::ALL.map(|cause| match cause {
                    Cause::Dcnu => 0.0,
                    _ => light[cause as usize] + dark[cause as usize] / f64::from(self.dark_frames),
                })
            }
            Some(adc) => self.digitized_budget(&adc, expected_e),
            None => self.charge_budget(expected_e, self.electrons(expected_e).moments),
        }
    }

    /// The variance of the charge and of its read noise, in e²; `whole` are their moments.
    fn charge_budget(&self, expected_e: f64, whole: MeanVariance) -> Budget {
        let model = &self.model;
        let exact = self.equations == Equations::Exact;
        let product = |rate: f64, shot: bool, sigma: f64| {
            let mean = if exact { sensitivity(sigma).0 } else { 1.0 };
            let pattern = self.pattern(sigma);
            let shot = if shot { rate } else { 0.0 };
            [mean * mean * shot, pattern * rate * rate, if exact { pattern * shot } else { 0.0 }]
        };
        let light = product(expected_e, model.signal_shot, model.prnu);
        let dark = product(model.dark_e, model.dark_shot, model.dcnu);
        let mut budget = [0.0; Cause::ALL.len()];
        let mut set = |cause: Cause, variance: f64| budget[cause as usize] = variance;
        set(Cause::SignalShot, light[0]);
        set(Cause::Prnu, light[1]);
        set(Cause::DarkShot, dark[0]);
        set(Cause::Dcnu, dark[1]);
        set(Cause::ShotTimesPattern, light[2] + dark[2]);
        set(Cause::Read, model.read_noise_e.powi(2));
        let unclipped: f64 = budget.iter().sum();
        // Below rounding nothing is clipped.
        let clipped = whole.variance - unclipped;
        budget[Cause::FullWell as usize] = if exact && clipped.abs() > 1e-12 * unclipped { clipped } else { 0.0 };
        budget
    }

    /// The variance of the codes, in ADU².
    fn digitized_budget(&self, adc: &AdcRecord, expected_e: f64) -> Budget {
        let slope = adc.adu_per_e;
        let electrons = self.electrons(expected_e).moments;
        let mut budget = self.charge_budget(expected_e, electrons).map(|variance| variance * slope * slope);
        if self.equations == Equations::Exact {
            let whole = self.adu(adc, expected_e).moments.variance;
            let endless = self.endless_variance(adc, expected_e, electrons).unwrap_or(whole);
            budget[Cause::Quantization as usize] = endless - electrons.variance * slope * slope;
            budget[Cause::Rails as usize] = whole - endless;
        }
        budget
    }

    /// The variance that codes without ends would have; none where the ends are out of reach.
    fn endless_variance(&self, adc: &AdcRecord, expected_e: f64, electrons: MeanVariance) -> Option<f64> {
        let mean = adc.bias_adu + adc.adu_per_e * electrons.mean;
        let sigma = adc.adu_per_e * electrons.std();
        if mean > 9.0 * sigma + 1.0 && mean + 9.0 * sigma + 1.0 < f64::from(adc.top_code()) {
            return None;
        }
        let tail = Tail::of(&self.model, adc, expected_e);
        // Moved up by whole codes until the lowest is far away, with as many more above.
        let up = (9.0 * sigma + 2.0 - mean).max(0.0).ceil();
        let top = mean + up + 9.0 * sigma + 2.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and `as` saturates")]
        let top = top as u32;
        let moved = normal::rounded(mean + up, sigma, top, |edge| tail.exceeds(adc.electrons_at(edge - up)));
        Some(moved.0.variance)
    }
}
