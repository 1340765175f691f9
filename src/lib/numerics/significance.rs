//! Tests of significance: how likely a deviation at least as large is by chance alone.

use super::normal;
use statrs::function::gamma::{checked_gamma_lr, checked_gamma_ur};

/// Two-sided probability of a standard normal deviate.
pub fn of_normal(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { (2.0 * normal::cumulative(-z.abs())).min(1.0) }
}

/// Two-sided probability of a sum of squares `x` that has the χ² distribution with `freedom` degrees of freedom, whole
/// or not: twice the smaller tail.
pub fn of_chi_square(x: f64, freedom: f64) -> f64 {
    if !(x >= 0.0 && x.is_finite() && freedom > 0.0 && freedom.is_finite()) {
        return 0.0;
    }
    if x == 0.0 {
        return 0.0;
    }
    // P and Q are regularized incomplete gamma functions of half of each; both exist for what passed the check.
    let tail =
        if x < freedom { checked_gamma_lr(freedom / 2.0, x / 2.0) } else { checked_gamma_ur(freedom / 2.0, x / 2.0) };
    (2.0 * tail.unwrap_or(0.0)).clamp(0.0, 1.0)
}

/// Skewness below which a variable is as good as normal: at 5 σ its tails differ from those by 2 %.
const STRAIGHT: f64 = 1e-3;

/// Two-sided probability of a deviate `z` of a variable of mean 0, variance 1 and such skewness γ: twice the smaller tail of a
/// shifted gamma variable of shape 4/γ², Pearson's type III.
pub fn of_skewed(z: f64, skewness: f64) -> f64 {
    let gamma = skewness.abs();
    // A skewness that is not known is none.
    if gamma < STRAIGHT || !gamma.is_finite() {
        return of_normal(z);
    }
    let shape = 4.0 / (gamma * gamma);
    of_chi_square(2.0 * (shape + z * skewness.signum() * shape.sqrt()), 2.0 * shape)
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

    /// A sum of squares is a gamma variable; a Poisson number of mean 25 is nearly one: P(X ≥ 43) = 6.66·10⁻⁴, P(X ≤ 10) =
    /// 5.86·10⁻⁴, by the sums of its probabilities, where the normal law has 2.3 and 18.7·10⁻⁴ at the half steps:
    /// to the seventh that steps leave open.
    #[test]
    fn skewed_deviates_have_the_tails_of_their_law() {
        for (x, freedom) in [(40.0_f64, 20.0_f64), (6.0, 20.0), (110.0, 100.0)] {
            let z = (x - freedom) / (2.0 * freedom).sqrt();
            let skewness = (8.0 / freedom).sqrt();
            assert!((of_skewed(z, skewness) / of_chi_square(x, freedom) - 1.0).abs() < 1e-9);
            assert_eq!(of_skewed(-z, -skewness), of_skewed(z, skewness));
        }
        for (count, tail) in [(42.5, 6.66e-4), (10.5, 5.86e-4)] {
            let found = of_skewed((count - 25.0) / 5.0, 0.2) / 2.0;
            assert!((found / tail - 1.0).abs() < 0.15, "{count}: {found:e}");
        }
        assert_eq!(of_skewed(2.0, 0.0), of_normal(2.0));
        assert_eq!(of_skewed(f64::NAN, 0.5), 0.0);
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
    fn senseless_sums_are_no_chance() {
        for (x, freedom) in [(f64::NAN, 3.0), (-1.0, 3.0), (f64::INFINITY, 3.0), (3.0, 0.0), (3.0, f64::NAN)] {
            assert_eq!(of_chi_square(x, freedom), 0.0);
        }
        assert_eq!(of_normal(f64::NAN), 0.0);
    }

    #[test]
    fn the_smallest_of_many_is_less_of_a_surprise() {
        assert!((of_smallest(1e-20, 10) / 1e-19 - 1.0).abs() < 1e-12);
        assert!((of_smallest(0.5, 2) - 0.75).abs() < 1e-15);
        assert_eq!(of_smallest(0.0, 5), 0.0);
    }
}
