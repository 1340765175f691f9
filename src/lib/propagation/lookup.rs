//! Functions of charges below zero, looked up.

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
