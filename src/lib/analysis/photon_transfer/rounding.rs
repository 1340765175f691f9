//! What rounding to codes hides of noise that spreads over less than a few of them.
//!
//! A normal sample of mean m and variance u, rounded, has in codes
//!
//! - the mean m + Σ (−1)ᵏ/(πk) e^(−2π²k²u) sin 2πkm
//! - the variance u + 1/12 + Σ (−1)ᵏ (1/(πk)² + 4u) e^(−2π²k²u) cos 2πkm, less the square of that sum,
//!
//! k from 1 on, as the error of rounding is a sawtooth of the sample. Where between two codes m lies differs from photosite to
//! photosite and is not known: what both sums may be at most is an error that does not average out, and no more frames take it away.
//! Noise is taken to be normal: shot noise of few electrons, each of half a code or more, has steps that smooth less.

use crate::numerics::quantiles::of_normal;
use std::f64::consts::PI;

/// Terms of the sums.
const TERMS: u32 = 30;
/// Beyond this variance in codes², e^(−2π²u) is nothing.
const SMOOTH: f64 = 2.0;
/// Smaller variances the terms do not resolve, in codes².
const RESOLVED: f64 = 1e-4;
/// Variances of noise that reaches no second edge from half way between two codes, 5 standard deviations off, in codes².
const ALIKE: f64 = 1e-2;
/// The error of rounding, in codes².
const EVEN: f64 = 1.0 / 12.0;

/// How far what rounded samples tell may be off, at most.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Hidden {
    /// Their mean, in codes.
    pub mean: f64,
    /// Their variance less 1/12, in codes².
    pub variance: f64,
    /// How much less, or more, of a small step of the mean they show: a share of it.
    pub step: f64,
}

impl Hidden {
    /// By the variance of samples and what that scatters by, a variance.
    pub fn behind(variance: f64, scatter: f64) -> Self {
        /// The variance that was measured may be more than that of the samples, so likely.
        const SURE: f64 = 0.99;
        let low = variance - of_normal(SURE) * scatter.max(0.0).sqrt();
        if low > SMOOTH + EVEN {
            return Self::default();
        }
        // Between the codes noise shows most, at a code least.
        let [least, most] = [(low, -1.0), (variance.max(RESOLVED), 1.0)].map(|(variance, sign)| before(variance, sign));
        // Half way between two codes all noise below a tenth of a code looks alike.
        let least = if least < ALIKE { 0.0 } else { least };
        let even = variance - EVEN;
        let sum = |of: fn(f64) -> f64| (1..=TERMS).map(|k| of(f64::from(k)) * wave(k, least)).sum::<f64>();
        Self {
            mean: sum(|k| 1.0 / (PI * k)).min(0.5),
            variance: (even - least).max(most - even).max(0.0),
            step: sum(|_| 2.0),
        }
    }
}

/// e^(−2π²k²u).
fn wave(k: u32, u: f64) -> f64 {
    (-2.0 * (PI * f64::from(k)).powi(2) * u).exp()
}

/// The variance of rounded samples whose mean is a code, where `at_code` is 1, or half way between two, where it is −1.
fn after(u: f64, at_code: f64) -> f64 {
    let term = |k: u32| {
        let sign = if at_code > 0.0 && k % 2 == 1 { -1.0 } else { 1.0 };
        sign * (1.0 / (PI * f64::from(k)).powi(2) + 4.0 * u) * wave(k, u)
    };
    u + EVEN + (1..=TERMS).map(term).sum::<f64>()
}

/// The variance before rounding that has such a one after it; 0 where none has.
fn before(variance: f64, at_code: f64) -> f64 {
    let (mut low, mut high) = (0.0, variance.max(0.0) + 1.0);
    if after(low, at_code) >= variance {
        return low;
    }
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if after(middle, at_code) < variance { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::normal::cumulative;

    /// Mean and variance of a rounded normal variable, by sums over codes.
    fn rounded(mean: f64, std: f64) -> [f64; 2] {
        let share = |code: f64| cumulative((code + 0.5 - mean) / std) - cumulative((code - 0.5 - mean) / std);
        let codes = || (-20..=20).map(f64::from);
        let first: f64 = codes().map(|code| share(code) * code).sum();
        [first, codes().map(|code| share(code) * (code - first).powi(2)).sum()]
    }

    /// Of noise from a twentieth of a code to one code, wherever the mean lies, neither mean nor variance is off by more; and at the
    /// worst place they are off by nearly as much.
    #[test]
    fn means_and_variances_of_rounded_noise_are_off_by_no_more() {
        for std in [0.05, 0.1, 0.2, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.85, 1.0] {
            let mut worst = [0.0_f64; 2];
            for place in 0..100 {
                let mean = f64::from(place) / 100.0;
                let [found, variance] = rounded(mean, std);
                let hidden = Hidden::behind(variance, 0.0);
                let off = [(found - mean).abs(), (variance - EVEN - std * std).abs()];
                assert!(off[0] <= hidden.mean + 1e-9, "{std} {mean}: {off:?} {hidden:?}");
                assert!(off[1] <= hidden.variance + 1e-9, "{std} {mean}: {off:?} {hidden:?}");
                let slope = (rounded(mean + 1e-4, std)[0] - rounded(mean - 1e-4, std)[0]) / 2e-4;
                assert!((slope - 1.0).abs() <= hidden.step + 1e-6, "{std} {mean}: {slope} {hidden:?}");
                worst = [worst[0].max(off[0] / hidden.mean), worst[1].max(off[1] / hidden.variance)];
            }
            assert!(std < 0.45 || worst.iter().all(|share| *share > 0.5), "{std}: {worst:?}");
        }
        assert_eq!(Hidden::behind(9.0, 1e-4), Hidden::default());
    }
}
