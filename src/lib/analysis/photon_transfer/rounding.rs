//! What rounding to codes hides of noise that spreads over less than a few of them.
//!
//! A normal sample of mean m and variance u, rounded, has in codes
//!
//! - the mean m + Σ (−1)ᵏ/(πk) e^(−2π²k²u) sin 2πkm
//! - the variance u + 1/12 + Σ (−1)ᵏ (1/(πk)² + 4u) e^(−2π²k²u) cos 2πkm, less the square of that sum,
//!
//! k from 1 on, as the error of rounding is a sawtooth of the sample. Where between two codes m lies differs from photosite to
//! photosite and is not known: what both sums may be at most is an error that does not average out, and no more frames take it away.
//!
//! Shot noise is that of whole electrons: of a Poisson law of n electrons, K codes each, beside normal noise of variance u the waves
//! are e^(−2π²k²u − n (1 − cos 2πkK)), and in place of 4u stands 4 (u + n K |sin πkK|/πk) at most. Of electrons of one code each shot
//! noise smooths nothing at all.

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
/// The variance that was measured may be more than that of the samples, so likely.
const SURE: f64 = 0.99;
/// The error of rounding, in codes².
const EVEN: f64 = 1.0 / 12.0;

/// Noise that smooths codes, as it is drawn: normal, and that of whole electrons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// The variance of normal noise, no more than there is, in codes².
    pub normal: f64,
    /// Electrons whose shot noise stands beside it.
    pub electrons: f64,
    /// Codes of an electron.
    pub gain: f64,
}

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

impl Hidden {
    /// The same of noise as it is drawn.
    pub fn of(Steps { normal, electrons, gain }: Steps) -> Self {
        if normal > SMOOTH {
            return Self::default();
        }
        let term = |k: u32| {
            let (phase, k) = (PI * f64::from(k) * gain, f64::from(k));
            let left = (-2.0 * (PI * k).powi(2) * normal - 2.0 * electrons * phase.sin().powi(2)).exp();
            let slope = normal + electrons * gain * phase.sin().abs() / (PI * k);
            [left / (PI * k), left * ((PI * k).powi(-2) + 4.0 * slope), 2.0 * left]
        };
        let sum = |which: usize| (1..=TERMS).map(|k| term(k)[which]).sum::<f64>();
        Self { mean: sum(0).min(0.5), variance: sum(1), step: sum(2) }
    }

    /// The larger of both, each by itself.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let Self { mean, variance, step } = self;
        Self { mean: mean.max(other.mean), variance: variance.max(other.variance), step: step.max(other.step) }
    }
}

/// The variance in codes² that normal noise has at least, by that of rounded samples; none that is sure of such a one.
pub fn least_normal(variance: f64, scatter: f64) -> f64 {
    before(variance - of_normal(SURE) * scatter.max(0.0).sqrt(), -1.0)
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

    /// Of 0 to 40 electrons of 0.4 to 1.5 codes each and of normal noise, rounded, neither mean nor variance is off by more; of one code
    /// each by as much as without any.
    #[test]
    fn electrons_smooth_no_more_than_their_steps_do() {
        let poisson = |n: f64| {
            let mut terms = vec![(-n).exp()];
            (1..120).for_each(|count: u32| terms.push(terms[count as usize - 1] * n / f64::from(count)));
            terms
        };
        for (n, gain, std) in [
            (0.0, 1.0, 0.3),
            (5.0, 1.0, 0.3),
            (40.0, 1.0, 0.4),
            (40.0, 1.01, 0.3),
            (3.0, 0.4, 0.2),
            (10.0, 0.5, 0.1),
            (8.0, 0.7, 0.2),
            (20.0, 1.5, 0.25),
        ] {
            let hidden = Hidden::of(Steps { normal: std * std, electrons: n, gain });
            for place in 0..50 {
                let offset = f64::from(place) / 50.0;
                let (mut first, mut second, mut all) = (0.0, 0.0, 0.0);
                for (count, share) in (0..).map(f64::from).zip(poisson(n)) {
                    let at = offset + gain * count;
                    let [mean, variance] = rounded(at - at.floor(), std);
                    let mean = at.floor() + mean;
                    (first, second, all) =
                        (first + share * mean, second + share * (variance + mean * mean), all + share);
                }
                assert!((all - 1.0).abs() < 1e-9);
                let truth = [offset + gain * n, std * std + gain * gain * n + EVEN];
                let off = [(first - truth[0]).abs(), (second - first * first - truth[1]).abs()];
                assert!(off[0] <= hidden.mean + 1e-6, "{n} {gain} {std} {offset}: {off:?} {hidden:?}");
                assert!(off[1] <= hidden.variance + 1e-6, "{n} {gain} {std} {offset}: {off:?} {hidden:?}");
            }
        }
        let [one, none] = [5.0, 0.0].map(|electrons| Hidden::of(Steps { normal: 0.09, electrons, gain: 1.0 }));
        assert!((one.mean - none.mean).abs() < 1e-12 && Hidden::behind(5.0, 0.0) == Hidden::default());
    }
}
