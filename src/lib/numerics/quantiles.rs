//! Quantiles: what a confidence interval reaches to.

use statrs::function::erf::erf_inv;
use statrs::function::gamma::checked_gamma_lr;

/// The standard normal deviate that a share `p` lies below, 0 < p < 1.
pub fn of_normal(p: f64) -> f64 {
    std::f64::consts::SQRT_2 * erf_inv(2.0 * p - 1.0)
}

/// Degrees of freedom from which on the approximation is good to 10⁻⁴ of the quantile for 0.001 < p < 0.999.
const MANY: f64 = 2000.0;

/// The sum of squares of `freedom` degrees of freedom, whole or not, that a share `p` lies below, 0 < p < 1: for few by
/// bisection of the incomplete gamma function, for many by the cube of a normal deviate \[WH1931].
pub fn of_chi_square(p: f64, freedom: f64) -> f64 {
    let ninth = 2.0 / (9.0 * freedom);
    let near = freedom * (1.0 - ninth + of_normal(p) * ninth.sqrt()).max(0.0).powi(3);
    if freedom >= MANY {
        return near;
    }
    let below = |x: f64| checked_gamma_lr(freedom / 2.0, x / 2.0).unwrap_or(1.0);
    let (mut low, mut high) = (0.0, near.max(1.0));
    while below(high) < p {
        high *= 2.0;
    }
    // Doubles have 53 bits.
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if below(middle) < p { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tabulated quantiles [AbramowitzStegun1964, Tables 26.1 and 26.8].
    #[test]
    fn quantiles_are_the_tabulated() {
        assert!((of_normal(0.975) - 1.959_963_985).abs() < 1e-8);
        assert!((of_normal(0.5)).abs() < 1e-12);
        for (p, freedom, tabulated) in [
            (0.95, 1.0, 3.84146),
            (0.025, 10.0, 3.24697),
            (0.975, 10.0, 20.4831),
            (0.005, 100.0, 67.3276),
            (0.995, 100.0, 140.169),
        ] {
            let found = of_chi_square(p, freedom);
            assert!((found / tabulated - 1.0).abs() < 5e-6, "{p} {freedom}: {found}");
        }
        // The two ways meet.
        for p in [0.001, 0.025, 0.5, 0.975, 0.999] {
            let [few, many] = [MANY - 1e-9, MANY].map(|freedom| of_chi_square(p, freedom));
            assert!((few / many - 1.0).abs() < 1e-4, "{p}: {few} {many}");
        }
    }
}
