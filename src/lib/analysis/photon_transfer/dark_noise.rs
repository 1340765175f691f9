//! Temporal noise in the dark: all of it, and what rows, columns and single photosites have of it.
//!
//! In electrons it is a root over the gain. The gain is a slope of variances less that of the dark: what chance adds to the noise of few darks it
//! takes from the gain, and both move the quotient alike. Of a part P of the variance v of the dark, made of mean squares that v is made of too, and
//! a gain K,
//!
//! ρ(P, K) = ρ(P, v) ρ(v, K)
//!
//! as all that P has in common with K goes by v.

use super::curve::{Curve, Values};
use super::dark::variance_of_darks;
use super::level::Level;
use super::pattern::{Part, correlation_with_variance, temporal, with_hidden};
use super::sheet::over_correlated;
use crate::numerics::variance_components::Interval;

/// What tells the temporal noise in the dark.
pub struct DarkNoise<'a> {
    curve: &'a Curve,
    /// Darks of two frames or more.
    darks: Vec<&'a Level>,
    rounding: f64,
    confidence: f64,
}

impl<'a> DarkNoise<'a> {
    /// Of darks, of codes whose error of rounding has such a variance.
    pub fn of(curve: &'a Curve, darks: &'a [Level], rounding: f64, confidence: f64) -> Self {
        let darks = darks.iter().filter(|dark| dark.frames >= 2).collect();
        Self { curve, darks, rounding, confidence }
    }

    /// The darks that tell it.
    pub fn darks(&self) -> &[&'a Level] {
        &self.darks
    }

    /// The variance that a part of it has, in samples², rounding included; none where darks do not tell it.
    pub fn variance(&self, part: Part) -> Option<Interval> {
        let Self { darks, rounding, confidence, .. } = self;
        let quietest = darks.iter().min_by(|a, b| a.variance.total_cmp(&b.variance))?;
        self.curve.tells_dark_noise().then(|| match part {
            Part::Total | Part::Pixel => variance_of_darks(darks, part, *rounding, *confidence),
            Part::Row | Part::Column => with_hidden(temporal(darks, part, *confidence), part, quietest, *rounding),
        })
    }

    /// The root of a variance of a part in samples² over such a gain.
    pub fn in_electrons(&self, part: Part, variance: Interval, gain: Interval) -> Interval {
        over_correlated(variance.root(), gain, self.correlation(part))
    }

    /// The correlation of what chance has a part of it, and the gain, off by.
    fn correlation(&self, part: Part) -> f64 {
        let time = |dark: &&&Level| dark.condition.exposure_s.unwrap_or(f64::INFINITY);
        let Some(shortest) = self.darks.iter().min_by(|a, b| time(a).total_cmp(&time(b))) else { return 0.0 };
        // Noise of lines is that of all darks, the others that of the shortest, or of the line through all as that of the gain is.
        let own = match part {
            Part::Row | Part::Column => &self.darks[..],
            Part::Total | Part::Pixel => std::slice::from_ref(shortest),
        };
        let of_dark = |values: &Values| values.dark_variance;
        let with_gain = self.curve.correlation(&of_dark, &|values| Some(values.gain));
        with_gain * correlation_with_variance(own, part, shortest)
    }
}
