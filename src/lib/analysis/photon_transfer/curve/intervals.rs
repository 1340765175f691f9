//! What numbers that follow from a curve are uncertain by: how each changes with each number that was measured, and with what all darks
//! may be off by together.

use super::super::scatter::Drift;
use super::{Curve, Datum, Point4, Values};
use crate::numerics::variance_components::Interval;
use crate::text::in_digits;

/// A black level that drifts by so many codes over all frames is told of.
const MUCH_DRIFT: f64 = 0.1;

/// What is said of means of darks that drift so from frame to frame.
fn drifting(drift: f64) -> String {
    format!(
        "means of darks drift from frame to frame, alike at one level after another, by up to {} ADU: the black level, or the temperature, does; \
         intervals of dark current and black level have room for as much over all frames",
        in_digits(drift, 2)
    )
}

impl Curve {
    /// Takes in that means of darks drift so from frame to frame, over so many frames.
    pub(super) fn drift_over(&mut self, drift: Drift, frames: usize) {
        self.dark_drift = drift.most * frames as f64;
        if drift.is_sure && self.dark_drift >= MUCH_DRIFT && !self.are_darks_clipped {
            self.dark_told = Some((drifting(drift.most), true));
        }
    }

    /// The interval of a number that follows from the values, at such confidence; none where it does not follow.
    pub fn interval(&self, of: impl Fn(&Values) -> Option<f64>, confidence: f64) -> Option<Interval> {
        let value = of(&self.values()?)?;
        let (mut variance, mut hidden) = (0.0, 0.0);
        let mut moved = self.clone();
        let mut add = |curve: &mut Self, datum: &dyn Fn(&mut Self) -> Option<&mut Datum>| {
            let Some(Datum { value: at, variance: own, hidden: most }) = datum(curve).copied() else { return };
            let step = if own > 0.0 { own.sqrt() } else { most };
            if step <= 0.0 {
                return;
            }
            let mut ends = [value; 2];
            for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
                if let Some(datum) = datum(curve) {
                    datum.value = at + sign * step;
                }
                *end = curve.values().as_ref().and_then(&of).unwrap_or(value);
            }
            if let Some(datum) = datum(curve) {
                datum.value = at;
            }
            let slope = (ends[1] - ends[0]) / 2.0;
            variance += if own > 0.0 { slope.powi(2) } else { 0.0 };
            hidden += (slope / step * most).abs();
        };
        for &flat in &self.fitted {
            add(&mut moved, &|curve| Some(&mut curve.flats[flat].mean));
            add(&mut moved, &|curve| Some(&mut curve.flats[flat].variance));
            add(&mut moved, &|curve| curve.flats[flat].photons.as_mut());
        }
        for dark in 0..self.darks.len() {
            add(&mut moved, &|curve| Some(&mut curve.darks[dark].mean));
            add(&mut moved, &|curve| Some(&mut curve.darks[dark].bent));
            add(&mut moved, &|curve| Some(&mut curve.darks[dark].variance));
        }
        // All darks are off together, where black drifts from one to the next.
        if self.dark_drift > 0.0 {
            let off = self.places_in_time();
            let ends = [-1.0, 1.0].map(|sign| {
                let mut moved = self.clone();
                for (dark, place) in moved.darks.iter_mut().zip(&off) {
                    dark.mean.value += sign * self.dark_drift * place;
                }
                moved.values().as_ref().and_then(&of).unwrap_or(value)
            });
            hidden += ((ends[1] - ends[0]) / 2.0).abs();
        }
        // All numbers of photons are off alike.
        let ends = [-1.0, 1.0].map(|sign| {
            let mut moved = self.clone();
            let scale = 1.0 + sign * self.photon_error;
            moved.flats.iter_mut().filter_map(|flat| flat.photons.as_mut()).for_each(|photons| photons.value *= scale);
            moved.values().as_ref().and_then(&of).unwrap_or(value)
        });
        variance += ((ends[1] - ends[0]) / 2.0).powi(2);
        let Interval { low, high, .. } = Interval::normal(value, variance, confidence);
        // What rounding hides of one level it may hide of all alike, and no chance makes it less.
        Some(Interval { value, low: low - hidden, high: high + hidden })
    }

    /// Places of the darks in the order of their times, from −½ of the shortest to ½ of the longest.
    pub(super) fn places_in_time(&self) -> Vec<f64> {
        let time = |dark: &Point4| dark.exposure_s.unwrap_or(0.0);
        let last = (self.darks.len() as f64 - 1.0).max(1.0);
        let before = |own: &Point4| self.darks.iter().filter(|dark| time(dark) < time(own)).count() as f64;
        self.darks.iter().map(|dark| before(dark) / last - 0.5).collect()
    }
}
