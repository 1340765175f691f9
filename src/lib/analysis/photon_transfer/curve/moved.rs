//! The values that a curve leads to where each number that was measured is a step less, or more.

use super::point::Datum;
use super::values::Values;
use crate::numerics::variance_components::Interval;
use std::sync::OnceLock;

/// What was found of a curve, once it was asked for. A copy begins anew: the numbers of its curve may be changed.
#[derive(Debug, Default)]
pub(super) struct Remembered(OnceLock<Option<Moved>>);

impl Remembered {
    /// What is known, or what `find` tells.
    pub fn or_find(&self, find: impl FnOnce() -> Option<Moved>) -> Option<&Moved> {
        self.0.get_or_init(find).as_ref()
    }
}

impl Clone for Remembered {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// The values of a curve, and where numbers that were measured are less and more, each by a step.
#[derive(Debug)]
pub(super) struct Moved {
    pub values: Values,
    pub data: Vec<Nudge>,
    /// All darks by what black may have drifted.
    pub drift: Option<[Option<Values>; 2]>,
    /// All numbers of photons by what they may be off by together.
    pub photons: [Option<Values>; 2],
}

/// A number that was measured, and the values where it is a step less and more.
#[derive(Debug)]
pub(super) struct Nudge {
    pub datum: Datum,
    pub step: f64,
    pub ends: [Option<Values>; 2],
}

impl Moved {
    /// The correlation of what two numbers that follow from the values are off by chance; 0 where one of them does not follow, or is off by
    /// nothing.
    pub fn correlation(&self, of: &dyn Fn(&Values) -> Option<f64>, with: &dyn Fn(&Values) -> Option<f64>) -> f64 {
        let [Some(own), Some(other)] = [of(&self.values), with(&self.values)] else { return 0.0 };
        let slopes = |ends: &[Option<Values>; 2]| {
            [(of, own), (with, other)].map(|(of, value)| {
                let [below, above] = ends.each_ref().map(|values| values.as_ref().and_then(of).unwrap_or(value));
                (above - below) / 2.0
            })
        };
        let by_chance = self.data.iter().filter(|nudge| nudge.datum.variance > 0.0).map(|nudge| &nudge.ends);
        let sums = by_chance
            .chain([&self.photons])
            .map(slopes)
            .fold([0.0; 3], |[aa, ab, bb], [a, b]| [aa + a * a, ab + a * b, bb + b * b]);
        let scatter = (sums[0] * sums[2]).sqrt();
        if scatter > 0.0 { (sums[1] / scatter).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// The interval of a number that follows from the values, at such confidence; none where it does not follow.
    pub fn interval(&self, of: impl Fn(&Values) -> Option<f64>, confidence: f64) -> Option<Interval> {
        let value = of(&self.values)?;
        let slope = |ends: &[Option<Values>; 2]| {
            let [below, above] = ends.map(|values| values.as_ref().and_then(&of).unwrap_or(value));
            (above - below) / 2.0
        };
        let (mut variance, mut hidden) = (0.0, 0.0);
        for Nudge { datum, step, ends } in &self.data {
            let slope = slope(ends);
            variance += if datum.variance > 0.0 { slope.powi(2) } else { 0.0 };
            hidden += (slope / step * datum.hidden).abs();
        }
        hidden += self.drift.as_ref().map_or(0.0, |ends| slope(ends).abs());
        variance += slope(&self.photons).powi(2);
        let Interval { low, high, .. } = Interval::normal(value, variance, confidence);
        // What rounding hides of one level it may hide of all alike, and no chance makes it less.
        Some(Interval { value, low: low - hidden, high: high + hidden })
    }
}
