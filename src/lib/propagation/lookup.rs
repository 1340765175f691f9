//! The density of a charge below zero, and functions of such charges that are looked up.

use super::counts::Count;
use super::effort;
use crate::numerics::normal::density;
use crate::numerics::rounding::REACH;

/// Normal laws whose density is asked for at many places.
pub(super) struct Densities(Vec<Bell>);

/// A normal law: its mean, one over its standard deviation, and its density at the mean times its weight.
struct Bell {
    electrons: f64,
    scale: f64,
    height: f64,
}

impl Densities {
    /// Of counts, which noise blurs too.
    pub fn of(counts: &[Count], noise_e: f64) -> Self {
        let bell = |count: &Count| {
            let scale = 1.0 / if noise_e > 0.0 { count.spread.hypot(noise_e) } else { count.spread };
            Bell { electrons: count.electrons, scale, height: density(0.0) * count.weight * scale }
        };
        Self(counts.iter().map(bell).collect())
    }

    /// The density at a charge below most of them.
    pub fn at(&self, electrons: f64) -> f64 {
        effort::spend(self.0.len() as u64);
        let of = |bell: &Bell| {
            let z = (electrons - bell.electrons) * bell.scale;
            if z > -REACH { bell.height * (-0.5 * z * z).exp() } else { 0.0 }
        };
        self.0.iter().map(of).sum()
    }

    /// The same, and how it rises with the charge.
    pub fn with_slope(&self, electrons: f64) -> [f64; 2] {
        effort::spend(self.0.len() as u64);
        let (mut sum, mut slope) = (0.0, 0.0);
        for bell in &self.0 {
            let z = (electrons - bell.electrons) * bell.scale;
            if z > -REACH - 1.0 {
                let share = bell.height * (-0.5 * z * z).exp();
                sum += share;
                slope -= share * z * bell.scale;
            }
        }
        [sum, slope]
    }
}

/// A function of v < 0: cubic between places that are even in ln(1 + |v|/a), by its values and slopes there.
pub(super) struct Lookup {
    /// a, e⁻.
    scale: f64,
    step: f64,
    /// Values, and slopes by the step; nothing lies beyond the last.
    pub values: Vec<[f64; 2]>,
}

impl Lookup {
    /// Steps between places.
    pub const STEPS: usize = 1000;

    /// One that is zero down to −`extent`.
    pub fn new(scale: f64, extent: f64) -> Self {
        let step = (extent / scale).ln_1p() / Self::STEPS as f64;
        Self { scale, step, values: vec![[0.0; 2]; Self::STEPS + 1] }
    }

    /// |v| at a place.
    pub fn distance(&self, index: usize) -> f64 {
        self.scale * (index as f64 * self.step).exp_m1()
    }

    /// d|v| by the step, (a + |v|) du, at such a distance.
    pub fn by_step(&self, distance: f64) -> f64 {
        (self.scale + distance) * self.step
    }

    /// The function at `electrons` < 0.
    pub fn at(&self, electrons: f64) -> f64 {
        let place = (-electrons / self.scale).max(0.0).ln_1p() / self.step;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and bounded")]
        let index = (place as usize).min(Self::STEPS - 1);
        let t = place - index as f64;
        if t > 1.0 + 1e-9 {
            return 0.0;
        }
        let ([a, da], [b, db]) = (self.values[index], self.values[index + 1]);
        let s = 1.0 - t;
        a * s * s * (1.0 + 2.0 * t) + b * t * t * (1.0 + 2.0 * s) + t * s * (s * da - t * db)
    }
}
