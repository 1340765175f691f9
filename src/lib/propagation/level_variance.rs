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

/// Steps between values that are worked out in any case of those that take long: fewer than a bend at full well extends over.
const WIDE: usize = 32;

/// How far, of itself, the value in the middle of some steps may be off the chord over them so that a parabola tells the others.
const STRAIGHT: f64 = 1e-4;

/// The values of all steps of a function that is smooth for the most part: fewer are worked out the straighter it is.
fn few_worked_out(value: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
    let mut values = vec![f64::NAN; STEPS + 1];
    let work_out = |places: Vec<usize>, values: &mut Vec<f64>| {
        let found: Vec<f64> = places.par_iter().map(|place| value(*place)).collect();
        places.iter().zip(found).for_each(|(place, found)| values[*place] = found);
    };
    work_out((0..=STEPS / WIDE).map(|place| place * WIDE).collect(), &mut values);
    let mut open: Vec<usize> = (0..STEPS / WIDE).map(|place| place * WIDE).collect();
    let mut half = WIDE / 2;
    while half > 0 {
        work_out(open.iter().map(|start| start + half).collect(), &mut values);
        let mut next = Vec::new();
        for start in open {
            let [low, middle, high] = [0, half, 2 * half].map(|offset| values[start + offset]);
            if half > 1 && (middle - 0.5 * (low + high)).abs() > STRAIGHT * middle.abs() {
                next.extend([start, start + half]);
                continue;
            }
            for offset in (1..2 * half).filter(|offset| *offset != half) {
                let t = offset as f64 / (2 * half) as f64;
                let parabola =
                    low * (1.0 - t) * (1.0 - 2.0 * t) + 4.0 * middle * t * (1.0 - t) + high * t * (2.0 * t - 1.0);
                values[start + offset] = parabola;
            }
        }
        (open, half) = (next, half / 2);
    }
    values
}

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
        // Patterns that are cut off at zero, tails, and codes that are not straight take long to predict.
        let is_rectified = photosite.model.response().max(photosite.model.dcnu) > 0.2;
        let is_bent = photosite.adc.is_some_and(|adc| adc.linearization.is_some());
        let is_slow = is_rectified || is_bent || photosite.has_tails();
        let step = largest / STEPS as f64;
        let one = |expected_e: f64| {
            if photosite.flat.is_some() {
                return photosite.variance_divided(class, expected_e);
            }
            if photosite.has_tails() {
                return photosite.variance_by_few(expected_e);
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
        let told_from = match (0..=STEPS).rev().find(is_by_code) {
            Some(last) if last == STEPS => f64::INFINITY,
            Some(last) => (last + 1) as f64 * step,
            None => f64::NEG_INFINITY,
        };
        let values =
            if is_slow { few_worked_out(variance) } else { (0..=STEPS).into_par_iter().map(variance).collect() };
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A parabola, which is told by few; and one that ends in a bend, as variance does at full well.
    #[test]
    fn few_values_tell_all_where_they_are_smooth() {
        let level = |place: usize| place as f64 / STEPS as f64;
        let smooth = |place: usize| 3.0 + level(place) + 0.7 * level(place).powi(2);
        let bent = |place: usize| smooth(place) / (1.0 + ((level(place) - 0.9) / 0.01).exp());
        for (function, most, off) in [(&smooth as &(dyn Fn(usize) -> f64 + Sync), 65, 1e-12), (&bent, 300, 1e-3)] {
            let count = AtomicUsize::new(0);
            let counting = |place: usize| {
                count.fetch_add(1, Ordering::Relaxed);
                function(place)
            };
            let found = few_worked_out(counting);
            let worst = (0..=STEPS).map(|place| (found[place] / function(place) - 1.0).abs()).fold(0.0, f64::max);
            let count = count.into_inner();
            assert!(count <= most && worst < off, "{count} values, {worst} off");
        }
        assert!(few_worked_out(|_| f64::NAN).iter().all(|value| value.is_nan()));
    }
}
