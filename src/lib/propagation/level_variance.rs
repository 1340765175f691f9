//! The variance of a photosite against its level.

use super::charge;
use super::photosite::Photosite;
use crate::metadata::AverageRecord;
use std::sync::{Arc, OnceLock};

/// Variance of a photosite against its level above black, linear between equally spaced levels.
///
/// Variance is a parabola in the level away from saturation, so a table of 1024 steps is off by less than
/// prnu² step²/4 ≈ 0.02 e² of several hundred. What no pixel asks for is not worked out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LevelVariance {
    of: Variances,
    stretches: Arc<[OnceLock<Stretch>]>,
    /// The level below which an average hangs on where in a code it lies, which no level of a pixel tells.
    told_from: f64,
}

/// The function that is tabulated, by steps of the level.
#[derive(Debug, Clone, PartialEq)]
struct Variances {
    photosite: Photosite,
    class: usize,
    average: Option<AverageRecord>,
    step: f64,
}

/// The values of some steps, the first of the next stretch among them.
type Stretch = [f64; WIDE + 1];

const STEPS: usize = 1024;

/// Steps of a stretch, fewer than a bend at full well extends over.
const WIDE: usize = 32;

/// Noise in codes below which what rounding does hangs on the fraction of a code, which no pixel's level tells.
pub(super) const HALF_A_CODE: f64 = 0.5;

/// How far, of itself, the value in the middle of some steps may be off the chord over them so that a parabola tells the others.
const STRAIGHT: f64 = 1e-4;

/// The values of a stretch of a function that is smooth for the most part: fewer are worked out the straighter it is.
fn few_worked_out(value: impl Fn(usize) -> f64) -> Stretch {
    let mut values = [f64::NAN; WIDE + 1];
    [values[0], values[WIDE]] = [0, WIDE].map(&value);
    let mut open = vec![0];
    let mut half = WIDE / 2;
    while half > 0 {
        let mut next = Vec::new();
        for start in open {
            let middle = value(start + half);
            values[start + half] = middle;
            let [low, high] = [0, 2 * half].map(|offset| values[start + offset]);
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

impl Variances {
    /// Whether they take long: of patterns that are cut off at zero, of tails, and of codes that are not straight.
    fn are_slow(&self) -> bool {
        let is_rectified = self.photosite.model.response().max(self.photosite.model.dcnu) > 0.2;
        let is_bent = self.photosite.adc.is_some_and(|adc| adc.linearization.is_some());
        is_rectified || is_bent || self.photosite.has_tails()
    }

    fn stretch(&self, start: usize) -> Stretch {
        let value = |offset: usize| self.at(start + offset);
        if self.are_slow() { few_worked_out(value) } else { std::array::from_fn(value) }
    }

    fn at(&self, place: usize) -> f64 {
        let expected_e = self.photosite.expected_of(self.class, place as f64 * self.step);
        let one = self.of_one(expected_e);
        let averaged = |record| self.photosite.variance_of_average(self.class, expected_e, one, record);
        self.average.as_ref().map_or(one, averaged)
    }

    /// That of one exposure.
    fn of_one(&self, expected_e: f64) -> f64 {
        let photosite = &self.photosite;
        if photosite.flat.is_some() {
            return photosite.variance_divided(self.class, expected_e);
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
        if charge.sqrt() * slope < HALF_A_CODE * adc.sample_slope(adc.level_at(electrons)) {
            charge * slope * slope + adc.rounding_at(electrons)
        } else {
            photosite.moments(expected_e).moments.variance
        }
    }

    /// Whether an average hangs on where in a code it lies.
    fn is_by_code(&self, place: usize) -> bool {
        let Some(record) = &self.average else { return false };
        let expected_e = self.photosite.expected_of(self.class, place as f64 * self.step);
        self.photosite.is_average_by_code(expected_e, record) && !self.photosite.is_spread_over_codes(expected_e)
    }
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
        let step = largest / STEPS as f64;
        let of = Variances { photosite: *photosite, class, average: average.cloned(), step };
        let told_from = match (0..=STEPS).rev().find(|place| of.is_by_code(*place)) {
            Some(last) if last == STEPS => f64::INFINITY,
            Some(last) => (last + 1) as f64 * step,
            None => f64::NEG_INFINITY,
        };
        Self { of, stretches: (0..STEPS / WIDE).map(|_| OnceLock::new()).collect(), told_from }
    }

    /// The variance at a level, and whether it is known: what takes too long is no number.
    pub fn told_at(&self, level: f64) -> (f64, bool) {
        let variance = self.at(level);
        // What is no level has a neighbor's variance.
        let is_by_code = level < self.told_from;
        let takes_long = self.of.photosite.has_tails() && variance.is_nan();
        (variance, !(is_by_code || takes_long))
    }

    /// The variance at a level; below zero as at zero, beyond the last as there.
    pub fn at(&self, level: f64) -> f64 {
        let place = (level / self.of.step).clamp(0.0, STEPS as f64);
        // A level that is not finite has a neighbor's variance, as its sample has no meaning; `min` and `max` drop NaN.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1024; NaN becomes 0")]
        let index = (place as usize).min(STEPS - 1);
        let share = if place.is_nan() { 0.0 } else { place - index as f64 };
        let (stretch, step) = (index / WIDE, index % WIDE);
        let values = self.stretches[stretch].get_or_init(|| self.of.stretch(stretch * WIDE));
        values[step] + share * (values[step + 1] - values[step])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// A parabola, which is told by few; and one that ends in a bend, as variance does at full well.
    #[test]
    fn few_values_tell_all_where_they_are_smooth() {
        let level = |place: usize| place as f64 / STEPS as f64;
        let smooth = |place: usize| 3.0 + level(place) + 0.7 * level(place).powi(2);
        let bent = |place: usize| smooth(place) / (1.0 + ((level(place) - 0.9) / 0.01).exp());
        for (function, most, off) in [(&smooth as &dyn Fn(usize) -> f64, 96, 1e-12), (&bent, 330, 1e-3)] {
            let count = Cell::new(0);
            let counting = |place: usize| {
                count.set(count.get() + 1);
                function(place)
            };
            let (mut worst, mut values) = (0.0_f64, 0);
            for start in (0..STEPS).step_by(WIDE) {
                for (offset, found) in few_worked_out(|offset| counting(start + offset)).into_iter().enumerate() {
                    worst = worst.max((found / function(start + offset) - 1.0).abs());
                    values += 1;
                }
            }
            assert!(count.get() <= most && worst < off, "{} of {values} values, {worst} off", count.get());
        }
        assert!(few_worked_out(|_| f64::NAN).iter().all(|value| value.is_nan()));
    }
}
