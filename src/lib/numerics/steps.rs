//! The step that codes lie apart by.

/// Codes that differ by so many steps tell the step.
const TELLING: i64 = 16;

/// The step of whole numbers: the largest power of two that all differences are multiples of.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Steps {
    range: Option<[i64; 2]>,
    bits: u64,
    has_others: bool,
}

impl Steps {
    /// Looks at more numbers.
    pub fn take(&mut self, samples: impl Iterator<Item = f64>) {
        for sample in samples {
            let whole = sample.round();
            if (sample - whole).abs() > 1e-3 || whole.abs() > 1e15 {
                self.has_others |= sample.is_finite();
                continue;
            }
            #[expect(clippy::cast_possible_truncation, reason = "not beyond 10¹⁵")]
            let whole = whole as i64;
            let [low, high] = self.range.unwrap_or([whole; 2]);
            self.bits |= whole.abs_diff(low);
            self.range = Some([low.min(whole), high.max(whole)]);
        }
    }

    /// The step, however few the numbers are; 1 where some are not whole.
    pub fn least(&self) -> f64 {
        if self.bits == 0 || self.has_others { 1.0 } else { f64::from(self.bits.trailing_zeros()).exp2() }
    }

    /// Whether they lie multiples of a power of two apart, however few they are.
    pub fn are_multiples_of(&self, scale: u64) -> bool {
        self.bits != 0 && !self.has_others && self.bits.trailing_zeros() >= scale.trailing_zeros()
    }

    /// Whether some numbers are not whole.
    pub fn has_fractions(&self) -> bool {
        self.has_others
    }

    /// Whether it is 1 whatever more numbers are.
    pub fn is_one(&self) -> bool {
        self.has_others || self.bits & 1 == 1
    }

    /// The step; none of few numbers, and where some are not whole.
    pub fn step(&self) -> Option<u64> {
        let [low, high] = self.range?;
        let step = 1_u64 << self.bits.trailing_zeros().min(32);
        let is_told = high.abs_diff(low) >= step.saturating_mul(TELLING.unsigned_abs());
        (is_told && !self.has_others).then_some(step)
    }
}
