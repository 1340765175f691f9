//! Tests of significance: how likely a deviation at least as large is by chance alone.

use super::normal;
use statrs::function::gamma::{checked_gamma_lr, checked_gamma_ur};

/// Two-sided probability of a standard normal deviate; no number of none.
pub fn of_normal(z: f64) -> f64 {
    if z.is_nan() { f64::NAN } else { (2.0 * normal::cumulative(-z.abs())).min(1.0) }
}

/// Two-sided probability of a sum of squares `x` that has the χ² distribution with `freedom` degrees of freedom, whole
/// or not: twice the smaller tail. No number where there is no such law, nor of what is no number.
pub fn of_chi_square(x: f64, freedom: f64) -> f64 {
    if x.is_nan() || !(freedom > 0.0 && freedom.is_finite()) {
        return f64::NAN;
    }
    if x <= 0.0 || x == f64::INFINITY {
        return 0.0;
    }
    // P and Q are regularized incomplete gamma functions of half of each; both exist for what passed the check.
    let tail =
        if x < freedom { checked_gamma_lr(freedom / 2.0, x / 2.0) } else { checked_gamma_ur(freedom / 2.0, x / 2.0) };
    (2.0 * tail.unwrap_or(f64::NAN)).clamp(0.0, 1.0)
}

/// Two-sided probability of a sum of squares `x` of normal variables of any variances, by its first three cumulants: a power of it
/// is nearly normal \[JS1972],
///
/// (x/κ₁)ʰ,  h = 1 − κ₁κ₃/3κ₂²,  with mean 1 + h (h − 1) κ₂/2κ₁² and variance h² κ₂/κ₁².
///
/// Of χ² h is ⅓, Wilson and Hilferty's. All that is above zero is possible, and below the mean no less likely than by χ² of the same
/// mean and variance. No number where there is no such law, nor of what is no number.
pub fn of_sum_of_squares(x: f64, [mean, variance, third]: [f64; 3]) -> f64 {
    let is_law = mean > 0.0 && variance > 0.0 && mean.is_finite() && variance.is_finite() && third.is_finite();
    if !is_law || x.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 0.0;
    }
    let (h, spread) = (1.0 - mean * third / (3.0 * variance * variance), variance.sqrt() / mean);
    let log = (x / mean).ln();
    // (qʰ − 1)/h, which is ln q where h is none.
    let power = if h.abs() < 1e-9 { log } else { (h * log).exp_m1() / h };
    let p = of_normal((power - 0.5 * (h - 1.0) * spread * spread) / spread);
    let freedom = 2.0 / (spread * spread);
    if x < mean { p.max(of_chi_square(freedom * x / mean, freedom)) } else { p }
}

/// Skewness below which a variable is as good as normal: at 5 σ its tails differ from those by 2 %.
const STRAIGHT: f64 = 1e-3;

/// Two-sided probability of a deviate `z` of a variable of mean 0, variance 1 and such skewness γ: twice the smaller tail of a
/// shifted gamma variable of shape 4/γ², Pearson's type III. That law ends at −2/γ, where others of the same skewness go on: to that
/// side the probability is no less than a normal deviate's.
pub fn of_skewed(z: f64, skewness: f64) -> f64 {
    let gamma = skewness.abs();
    // A skewness that is not known is none.
    if gamma < STRAIGHT || !gamma.is_finite() || z.is_nan() {
        return of_normal(z);
    }
    let shape = 4.0 / (gamma * gamma);
    let z = z * skewness.signum();
    let p = of_chi_square(2.0 * (shape + z * shape.sqrt()), 2.0 * shape);
    if z < 0.0 { p.max(of_normal(z)) } else { p }
}

/// The smallest of `count` probabilities, corrected for their number: the chance that any of as many independent ones
/// is as small, 1 − (1 − p)ⁿ (Šidák).
pub fn of_smallest(p: f64, count: usize) -> f64 {
    // ln(1 − p) loses nothing however small p is.
    -(count as f64 * (-p).ln_1p()).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of tables: 1.959964 leaves 5 %; e^(−x/2) is the upper tail of χ² with two degrees of freedom.
    #[test]
    fn tails_have_their_tabulated_size() {
        assert!((of_normal(1.959_963_984_540_054) - 0.05).abs() < 1e-15);
        assert!((of_normal(-6.0) / 1.973_175_290_075_396e-9 - 1.0).abs() < 1e-12);
        for x in [4.0_f64, 30.0, 300.0, 1200.0] {
            assert!((of_chi_square(x, 2.0) / (2.0 * (-x / 2.0).exp()) - 1.0).abs() < 1e-10, "{x}");
        }
        // Lower tail: 1 − e^(−x/2).
        assert!((of_chi_square(0.01, 2.0) / (-2.0 * (-0.005_f64).exp_m1()) - 1.0).abs() < 1e-12);
    }

    /// A sum of squares is a gamma variable; a Poisson number of mean 25 is nearly one: P(X ≥ 43) = 6.66·10⁻⁴, by the sum of its
    /// probabilities, where the normal law has 2.3·10⁻⁴ at the half step: to the seventh that steps leave open. P(X ≤ 10) =
    /// 5.86·10⁻⁴ is no more than what is given.
    #[test]
    fn skewed_deviates_have_the_tails_of_their_law() {
        for (x, freedom) in [(40.0_f64, 20.0_f64), (25.0, 20.0), (110.0, 100.0)] {
            let z = (x - freedom) / (2.0 * freedom).sqrt();
            let skewness = (8.0 / freedom).sqrt();
            assert!((of_skewed(z, skewness) / of_chi_square(x, freedom) - 1.0).abs() < 1e-9);
            assert_eq!(of_skewed(-z, -skewness), of_skewed(z, skewness));
        }
        let found = of_skewed((42.5 - 25.0) / 5.0, 0.2) / 2.0;
        assert!((found / 6.66e-4 - 1.0).abs() < 0.15, "{found:e}");
        let found = of_skewed((10.5 - 25.0) / 5.0, 0.2) / 2.0;
        assert!((5.86e-4..20e-4).contains(&found), "{found:e}");
        assert_eq!(of_skewed(2.0, 0.0), of_normal(2.0));
        assert!(of_skewed(f64::NAN, 0.5).is_nan());
        // Nothing is impossible where the law of that skewness ends.
        for skewness in [0.3, 0.8, 1.8, 3.0] {
            assert_eq!(of_skewed(-2.5 / skewness, skewness), of_normal(-2.5 / skewness));
        }
    }

    /// Weighted sums of squares: of equal weights χ², to 5 % of its tails beyond 10⁻⁴ from 5 degrees of freedom on; of two weights
    /// the exact law, aX + bY of two exponential variables, P(> x) = (a e^(−x/2a) − b e^(−x/2b))/(a − b), to 15 %, below the mean
    /// no less than that and up to twice as much.
    #[test]
    fn sums_of_squares_have_the_tails_of_their_law() {
        for freedom in [5.0_f64, 12.0, 60.0, 400.0] {
            for z in [-1.2, -0.5, 0.5, 1.5, 3.0, 4.0] {
                let x = freedom + z * (2.0 * freedom).sqrt();
                let (found, expected) =
                    (of_sum_of_squares(x, [freedom, 2.0 * freedom, 8.0 * freedom]), of_chi_square(x, freedom));
                assert!((found / expected - 1.0).abs() < 0.05, "{freedom} {z}: {found:e} {expected:e}");
            }
        }
        for (a, b) in [(3.0_f64, 1.0_f64), (10.0, 1.0)] {
            let cumulants = [2.0 * (a + b), 4.0 * (a * a + b * b), 16.0 * (a.powi(3) + b.powi(3))];
            for share in [0.2, 0.5, 2.5, 4.0] {
                let x = share * cumulants[0];
                let upper = (a * (-x / (2.0 * a)).exp() - b * (-x / (2.0 * b)).exp()) / (a - b);
                let expected = 2.0 * upper.min(1.0 - upper);
                let found = of_sum_of_squares(x, cumulants);
                let most = if share < 1.0 { 2.0 } else { 1.15 };
                assert!((0.85..most).contains(&(found / expected)), "{a} {b} {share}: {found:e} {expected:e}");
            }
        }
        // However skewed: honest values far below the mean are possible.
        for skewness in [-1.0, 0.0, 0.9, 1.8, 6.0] {
            let p = of_sum_of_squares(0.2, [1.0, 0.2, skewness * 0.2_f64.powf(1.5)]);
            assert!(p > 7e-3, "{skewness}: {p}");
        }
    }

    /// With many degrees of freedom (x/ν)^⅓ is normal with mean 1 − 2/9ν and variance 2/9ν (Wilson and Hilferty 1931), to
    /// a few parts in 10³ of these tails at ν = 10⁴ and better beyond.
    #[test]
    fn many_degrees_of_freedom_are_nearly_normal() {
        for freedom in [1e4_f64, 1e6, 3.3e7] {
            for z in [-5.0, -2.0, 1.0, 4.0] {
                let c = 2.0 / (9.0 * freedom);
                let x = freedom * (1.0 - c + z * c.sqrt()).powi(3);
                let ratio = of_chi_square(x, freedom) / of_normal(z);
                assert!((ratio - 1.0).abs() < 5e-3, "{freedom} {z}: {ratio}");
            }
        }
        assert!((of_chi_square(99.33, 100.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn no_number_leads_to_none() {
        for (x, freedom) in [(f64::NAN, 3.0), (3.0, 0.0), (3.0, f64::NAN), (3.0, f64::INFINITY), (3.0, -1.0)] {
            assert!(of_chi_square(x, freedom).is_nan(), "{x} {freedom}");
        }
        assert_eq!([of_chi_square(0.0, 3.0), of_chi_square(-1.0, 3.0), of_chi_square(f64::INFINITY, 3.0)], [0.0; 3]);
        assert!(of_normal(f64::NAN).is_nan());
        for law in [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, f64::NAN]] {
            assert!(of_sum_of_squares(1.0, law).is_nan(), "{law:?}");
        }
    }

    #[test]
    fn the_smallest_of_many_is_less_of_a_surprise() {
        assert!((of_smallest(1e-20, 10) / 1e-19 - 1.0).abs() < 1e-12);
        assert!((of_smallest(0.5, 2) - 0.75).abs() < 1e-15);
        assert_eq!(of_smallest(0.0, 5), 0.0);
    }
}
