//! Whether what is rounded off, where samples of more bits become single precision, is what tells them apart.

use super::format::SampleType;

/// Rows that are looked at: the first of a frame, so that of a small one all are, and some of the others.
const FIRST: usize = 16;
const EVERY: usize = 64;

/// The part of the squares of differences between neighbors that rounding may change: samples that scatter by σ, rounded to steps of q, are
/// off by q²/12 of σ², which is 1 % where σ is less than three steps, 2·10⁻⁷ of the samples. No camera is so quiet.
const MOST: f64 = 0.01;

/// Doubles that differ by less than this part of them are alike: sums in another order leave 10⁻¹⁶ of each of up to a million terms.
const ALIKE: f64 = 1e-10;

/// Squares of the differences between neighbors in a frame, and of what rounding changes of them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rounded {
    told: f64,
    lost: f64,
    /// The first sample of the row that was looked at last, as stored and as read.
    before: Option<(f64, f32)>,
}

impl Rounded {
    /// Whether a row of samples that are so stored is looked at.
    pub(super) fn looks_at(stored: SampleType, row: usize) -> bool {
        use SampleType::{F64, I32, I64, U32, U64};
        matches!(stored, U32 | I32 | U64 | I64 | F64) && (row < FIRST || row.is_multiple_of(EVERY))
    }

    /// Takes in a row, of lines of so many samples, as stored and as read.
    pub(super) fn take(&mut self, stored: SampleType, values: &[f64], samples: &[f32], width: usize) {
        let alike = if stored == SampleType::F64 { ALIKE } else { 0.0 };
        let first = values.first().copied().zip(samples.first().copied());
        if let Some(pair) = self.before.zip(first) {
            self.compare(pair, alike);
        }
        self.before = first;
        for (values, samples) in values.chunks(width).zip(samples.chunks(width)) {
            for (values, samples) in values.windows(2).zip(samples.windows(2)) {
                self.compare(((values[0], samples[0]), (values[1], samples[1])), alike);
            }
        }
    }

    fn compare(&mut self, (one, other): ((f64, f32), (f64, f32)), alike: f64) {
        let difference = other.0 - one.0;
        let lost = f64::from(other.1) - f64::from(one.1) - difference;
        if difference.abs() > alike * one.0.abs().max(other.0.abs()) && lost.is_finite() {
            self.told += difference * difference;
            self.lost += lost * lost;
        }
    }

    /// What is to be said of a file when all its rows were read.
    pub(super) fn doubt(&self, name: &str) -> Option<String> {
        let share = (self.lost / self.told).sqrt();
        (self.lost > MOST * self.told).then(|| {
            format!(
                "{name}: its samples have more digits than single precision, in which they are read: what tells neighbors apart is off by {:.0} % \
                 (rms); subtract first what all have in common",
                100.0 * share
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of samples in rows of eight; of integers or doubles.
    fn said(values: &[f64], stored: SampleType) -> Option<String> {
        let mut rounded = Rounded::default();
        for row in values.chunks(8) {
            #[expect(clippy::cast_possible_truncation, reason = "it is what is tested")]
            let samples: Vec<f32> = row.iter().map(|value| *value as f32).collect();
            rounded.take(stored, row, &samples, 8);
        }
        rounded.doubt("a")
    }

    #[test]
    fn samples_that_become_alike_are_told() {
        let integers = |from: f64, step: f64| (0..64).map(|i| from + step * f64::from(i)).collect::<Vec<_>>();
        let pairs: Vec<f64> = (0..64).map(|i| 1_073_741_824.0 + f64::from(i * 7 % 3 % 2)).collect();
        for (values, stored) in [
            (integers(1e9, 1.0), SampleType::U32),
            (integers(1e9, 1.0), SampleType::F64),
            (integers(-1e9, 1.0), SampleType::I32),
            (integers(1e15, 1e3), SampleType::U64),
            (pairs, SampleType::U32),
            (integers(1.0, 1e-9), SampleType::F64),
        ] {
            assert!(said(&values, stored).is_some(), "{values:?}");
        }
    }

    #[test]
    fn digits_that_tell_nothing_are_not_missed() {
        let noise = |mean: f64, scatter: f64| -> Vec<f64> {
            (0..64).map(|i| mean + scatter * (f64::from(i * 2_654_435 % 1009) / 1009.0 - 0.5)).collect()
        };
        let jitter: Vec<f64> = (0..64).map(|i| 0.3 + f64::EPSILON * f64::from(i % 5)).collect();
        // Rows that are alike but for some digits, of a frame that is not.
        let ramp: Vec<f64> = (0..64).map(|i| f64::from(i / 8) / 3.0 + 1e-9 * f64::from(i % 8)).collect();
        for (values, stored) in [
            (noise(1000.1, 1e-2), SampleType::F64),
            (noise(0.123_456_789, 1e-5), SampleType::F64),
            // The sum of a thousand exposures.
            (noise(6e7, 8e3).iter().map(|value| value.round()).collect(), SampleType::U32),
            (noise(60_000.0, 100.0).iter().map(|value| value.round()).collect(), SampleType::I64),
            (vec![0.1; 64], SampleType::F64),
            (vec![3e9; 64], SampleType::U32),
            (vec![f64::NAN; 64], SampleType::F64),
            (jitter, SampleType::F64),
            (ramp, SampleType::F64),
            (Vec::new(), SampleType::F64),
        ] {
            assert_eq!(said(&values, stored), None, "{values:?}");
        }
    }

    #[test]
    fn few_rows_are_looked_at() {
        let of = |stored| (0..1024).filter(|row| Rounded::looks_at(stored, *row)).count();
        assert_eq!(
            [of(SampleType::F64), of(SampleType::U32), of(SampleType::U16), of(SampleType::F32)],
            [31, 31, 0, 0]
        );
    }
}
