//! The variance of a photosite against its level.

use super::charge;
use super::photosite::Photosite;
use crate::metadata::AverageRecord;
use rayon::prelude::*;

/// Variance of a photosite against its level above black, linear between equally spaced levels.
///
/// Variance is a parabola in the level away from saturation, so a table of 1024 steps is off by less than
/// prnu² step²/4 ≈ 0.02 e² of several hundred.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LevelVariance {
    step: f64,
    values: Vec<f64>,
    /// The level below which an average hangs on where in a code it lies, which no level of a pixel tells.
    told_from: f64,
}

const STEPS: usize = 1024;

impl LevelVariance {
    /// Of R, G and B, which differ where flat fields do.
    pub fn of_classes(photosite: &Photosite, average: Option<&AverageRecord>, largest: f64) -> [Self; 3] {
        match photosite.flat {
            None => {
                let all = Self::new(photosite, 0, average, largest);
                [all.clone(), all.clone(), all]
            }
            Some(_) => [0, 1, 2].map(|class| Self::new(photosite, class, average, largest)),
        }
    }

    fn new(photosite: &Photosite, class: usize, average: Option<&AverageRecord>, largest: f64) -> Self {
        // Patterns that are cut off at zero take long to predict, and their variances are smooth.
        let is_rectified = photosite.model.response().max(photosite.model.dcnu) > 0.2;
        let steps = if is_rectified || photosite.has_tails() { STEPS / 8 } else { STEPS };
        let step = largest / steps as f64;
        let one = |expected_e: f64| {
            if photosite.flat.is_some() {
                return photosite.variance_divided(class, expected_e);
            }
            if photosite.has_tails() {
                return photosite.moments(expected_e).moments.variance;
            }
            let Some(adc) = photosite.adc else { return photosite.moments(expected_e).moments.variance };
            if photosite.darks[0].is_some() {
                return photosite.less_dark(&adc, expected_e, false).moments.variance;
            }
            let electrons = photosite.model.dark_e + expected_e;
            let slope = adc.sample_per_e(electrons);
            let charge = charge::charge(&photosite.model, expected_e).variance + photosite.model.added().powi(2);
            // Below half a code what rounding does hangs on the fraction of a code, which no pixel's level tells.
            if charge.sqrt() * slope < 0.5 * adc.sample_slope(adc.level_at(electrons)) {
                charge * slope * slope + adc.rounding_at(electrons)
            } else {
                photosite.moments(expected_e).moments.variance
            }
        };
        let variance = |index: usize| {
            let expected_e = photosite.expected_at(index as f64 * step);
            let one = one(expected_e);
            average.map_or(one, |record| photosite.variance_of_average(class, expected_e, one, record))
        };
        let is_by_code = |index: &usize| {
            let expected_e = photosite.expected_at(*index as f64 * step);
            let is_by_code = |record| photosite.is_average_by_code(expected_e, record);
            average.is_some_and(is_by_code) && !photosite.is_spread_over_codes(expected_e)
        };
        let told_from = match (0..=steps).rev().find(is_by_code) {
            Some(last) if last == steps => f64::INFINITY,
            Some(last) => (last + 1) as f64 * step,
            None => f64::NEG_INFINITY,
        };
        let values: Vec<f64> = (0..=steps).into_par_iter().map(variance).collect();
        // What takes too long is no number.
        let is_known = !photosite.has_tails() || values.iter().all(|value| !value.is_nan());
        Self { step, values, told_from: if is_known { told_from } else { f64::INFINITY } }
    }

    /// The level from which on they are known.
    pub fn told_from(&self) -> f64 {
        self.told_from
    }

    /// The variance at a level; below zero as at zero, beyond the last as there.
    pub fn at(&self, level: f64) -> f64 {
        let steps = self.values.len() - 1;
        let place = (level / self.step).clamp(0.0, steps as f64);
        // A level that is not finite has a neighbor's variance, as its sample has no meaning; `min` and `max` drop NaN.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1024; NaN becomes 0")]
        let index = (place as usize).min(steps - 1);
        let share = if place.is_nan() { 0.0 } else { place - index as f64 };
        self.values[index] + share * (self.values[index + 1] - self.values[index])
    }
}
