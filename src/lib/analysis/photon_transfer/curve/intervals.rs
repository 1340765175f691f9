//! What numbers that follow from a curve are uncertain by: how each changes with each number that was measured, and with what all darks
//! may be off by together.

use super::super::scatter::Drift;
use super::moved::{Moved, Nudge};
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
        self.moved.or_find(|| self.moved())?.interval(of, confidence)
    }

    /// The interval of a number that follows from the values over the gain: what was measured moves both.
    pub fn over_gain(&self, of: impl Fn(&Values) -> Option<f64>, confidence: f64) -> Option<Interval> {
        let [own, gain] = [self.interval(&of, confidence)?, self.interval(|values| Some(values.gain), confidence)?];
        Some(own.over(gain, self.correlation(&of, &|values| Some(values.gain))))
    }

    /// The correlation of what chance has two numbers off by that follow from the values.
    pub fn correlation(&self, of: &dyn Fn(&Values) -> Option<f64>, with: &dyn Fn(&Values) -> Option<f64>) -> f64 {
        self.moved.or_find(|| self.moved()).map_or(0.0, |moved| moved.correlation(of, with))
    }

    /// The values where each number that was measured is moved; none where there are none.
    fn moved(&self) -> Option<Moved> {
        let values = self.values()?;
        let mut curve = self.clone();
        let mut data = Vec::new();
        let mut add = |of: &dyn Fn(&mut Self) -> Option<&mut Datum>| {
            let Some(datum) = of(&mut curve).copied() else { return };
            let step = if datum.variance > 0.0 { datum.variance.sqrt() } else { datum.hidden };
            if step <= 0.0 {
                return;
            }
            let mut at = |value: f64| {
                if let Some(datum) = of(&mut curve) {
                    datum.value = value;
                }
                curve.values()
            };
            let ends = [at(datum.value - step), at(datum.value + step)];
            if let Some(moved) = of(&mut curve) {
                *moved = datum;
            }
            data.push(Nudge { datum, step, ends });
        };
        for &flat in &self.fitted {
            add(&|curve| Some(&mut curve.flats[flat].mean));
            add(&|curve| Some(&mut curve.flats[flat].variance));
            add(&|curve| curve.flats[flat].photons.as_mut());
        }
        for dark in 0..self.darks.len() {
            add(&|curve| Some(&mut curve.darks[dark].mean));
            add(&|curve| Some(&mut curve.darks[dark].bent));
            add(&|curve| Some(&mut curve.darks[dark].variance));
        }
        // All darks are off together, where black drifts from one to the next.
        let drift = (self.dark_drift > 0.0).then(|| {
            let off = self.places_in_time();
            [-1.0, 1.0].map(|sign| {
                let mut moved = self.clone();
                for (dark, place) in moved.darks.iter_mut().zip(&off) {
                    dark.mean.value += sign * self.dark_drift * place;
                }
                moved.values()
            })
        });
        // All numbers of photons are off alike.
        let photons = [-1.0, 1.0].map(|sign| {
            let mut moved = self.clone();
            let scale = 1.0 + sign * self.photon_error;
            moved.flats.iter_mut().filter_map(|flat| flat.photons.as_mut()).for_each(|photons| photons.value *= scale);
            moved.values()
        });
        Some(Moved { values, data, drift, photons })
    }

    /// Places of the darks in the order of their times, from −½ of the shortest to ½ of the longest.
    pub(super) fn places_in_time(&self) -> Vec<f64> {
        let time = |dark: &Point4| dark.exposure_s.unwrap_or(0.0);
        let last = (self.darks.len() as f64 - 1.0).max(1.0);
        let before = |own: &Point4| self.darks.iter().filter(|dark| time(dark) < time(own)).count() as f64;
        self.darks.iter().map(|dark| before(dark) / last - 0.5).collect()
    }
}
