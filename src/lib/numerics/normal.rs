//! The normal distribution, and the moments of what is left of it after clipping and rounding.

use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::sync::LazyLock;

/// Density of the standard normal distribution, φ(z).
pub fn density(z: f64) -> f64 {
    (-0.5 * z * z).exp() / (2.0 * PI).sqrt()
}

/// Cumulative standard normal distribution, Φ(z), to full relative precision in the lower tail.
pub fn cumulative(z: f64) -> f64 {
    let below = -z.abs();
    if below.is_nan() || below <= -f64::from(FARTHEST) {
        return 0.5 * libm::erfc(-z * FRAC_1_SQRT_2);
    }
    let place = (-below * f64::from(PLACES)).round();
    let h = below + place / f64::from(PLACES);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and bounded")]
    let terms = &TAYLOR[place as usize];
    let tail = terms.iter().rev().fold(0.0, |sum, term| sum * h + term);
    if z > 0.0 { 1.0 - tail } else { tail }
}

/// Places to a unit of z about which Φ is expanded, and how far down.
const PLACES: u32 = 32;
const FARTHEST: u32 = 10;

/// Φ⁽ⁿ⁾(z₀)/n! at z₀ = 0, −1/32, −2/32 …: Φ⁽ⁿ⁺¹⁾ = (−1)ⁿ Heₙ φ. What is left off at 1/64 from there is (|z|/64)¹⁰/10! of Φ, less than
/// 3·10⁻¹⁵.
static TAYLOR: LazyLock<Vec<[f64; 10]>> = LazyLock::new(|| {
    let at = |z: f64| {
        let mut terms = [0.0; 10];
        terms[0] = 0.5 * libm::erfc(-z * FRAC_1_SQRT_2);
        let (mut before, mut hermite, mut factor) = (0.0, 1.0, density(z));
        for (n, term) in (1_i32..).map(f64::from).zip(&mut terms[1..]) {
            factor /= n;
            *term = factor * hermite;
            factor = -factor;
            (before, hermite) = (hermite, z * hermite - (n - 1.0) * before);
        }
        terms
    };
    (0..=FARTHEST * PLACES).map(|step| at(-f64::from(step) / f64::from(PLACES))).collect()
});

/// A mean and a variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanVariance {
    /// The mean.
    pub mean: f64,
    /// The variance.
    pub variance: f64,
}

impl MeanVariance {
    /// The standard deviation.
    pub fn std(self) -> f64 {
        self.variance.max(0.0).sqrt()
    }
}

/// A random variable known by its first four cumulants: nearly normal, as the sum of many small things is.
///
/// Tail expectations follow from the Edgeworth series to the order of kurtosis and squared skewness, whose error is of
/// the order of the skewness cubed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearlyNormal {
    /// κ₁, the mean.
    pub mean: f64,
    /// κ₂, the variance.
    pub variance: f64,
    /// κ₃, the third central moment.
    pub third: f64,
    /// κ₄, the fourth central moment minus 3 κ₂².
    pub fourth: f64,
}

impl NearlyNormal {
    /// A normal variable.
    pub fn normal(mean: f64, variance: f64) -> Self {
        Self { mean, variance, third: 0.0, fourth: 0.0 }
    }

    /// The sum of two independent variables: cumulants add.
    pub fn plus(self, other: Self) -> Self {
        Self {
            mean: self.mean + other.mean,
            variance: self.variance + other.variance,
            third: self.third + other.third,
            fourth: self.fourth + other.fourth,
        }
    }

    /// The variable times a constant.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            mean: self.mean * factor,
            variance: self.variance * factor.powi(2),
            third: self.third * factor.powi(3),
            fourth: self.fourth * factor.powi(4),
        }
    }

    /// Probability that the variable exceeds `edge`; 0, ½ or 1 where there is no spread.
    ///
    /// 1 − Φ(z) + φ(z) [γ₁/6 He₂(z) + γ₂/24 He₃(z) + γ₁²/72 He₅(z)], γ₁ = κ₃/κ₂^1.5, γ₂ = κ₄/κ₂².
    pub fn exceeds(self, edge: f64) -> f64 {
        if self.variance <= 0.0 {
            return match self.mean.partial_cmp(&edge) {
                Some(std::cmp::Ordering::Greater) => 1.0,
                Some(std::cmp::Ordering::Equal) => 0.5,
                _ => 0.0,
            };
        }
        let sigma = self.variance.sqrt();
        let z = (edge - self.mean) / sigma;
        let (skewness, kurtosis) = (self.third / sigma.powi(3), self.fourth / sigma.powi(4));
        let he2 = z * z - 1.0;
        let he3 = z * (z * z - 3.0);
        let he5 = z * (z.powi(4) - 10.0 * z * z + 15.0);
        let series = skewness / 6.0 * he2 + kurtosis / 24.0 * he3 + skewness.powi(2) / 72.0 * he5;
        (cumulative(-z) + density(z) * series).clamp(0.0, 1.0)
    }

    /// Expected amount by which the variable exceeds `limit`, 0 where it does not: the first tail integral of
    /// [`Self::clipped_above`].
    pub fn excess(self, limit: f64) -> f64 {
        let sigma = self.variance.max(0.0).sqrt();
        let z = (limit - self.mean) / sigma;
        // Farther off nothing is left of a normal law, nor of its series.
        if sigma <= 0.0 || z.abs() > 12.0 {
            return (self.mean - limit).max(0.0);
        }
        let (skewness, kurtosis) = (self.third / sigma.powi(3), self.fourth / sigma.powi(4));
        sigma * first_tail(z, [density(z), cumulative(-z)], skewness, kurtosis)
    }

    /// Mean and variance of the smaller of the variable and `limit`.
    ///
    /// With u = limit − x, the loss is E[(−u)₊] and E[(−u)₊²], tail integrals of [`Self::exceeds`] that the Edgeworth
    /// series gives in closed form.
    pub fn clipped_above(self, limit: f64) -> MeanVariance {
        if self.variance <= 0.0 {
            return MeanVariance { mean: self.mean.min(limit), variance: 0.0 };
        }
        let sigma = self.variance.sqrt();
        let z = (limit - self.mean) / sigma;
        if z > 40.0 {
            return MeanVariance { mean: self.mean, variance: self.variance };
        }
        let (skewness, kurtosis) = (self.third / sigma.powi(3), self.fourth / sigma.powi(4));
        let (phi, tail) = (density(z), cumulative(-z));
        let he3 = z * (z * z - 3.0);
        let first = first_tail(z, [phi, tail], skewness, kurtosis);
        // Second, I₂ = ∫_z^∞ (t − z) P(X > t) dt = ½ E[(X − z)₊²].
        let second = 0.5 * ((1.0 + z * z) * tail - z * phi)
            + phi * (skewness / 6.0 + kurtosis / 24.0 * z + skewness.powi(2) / 72.0 * he3);
        // About the limit: y = min(X, z) − z has E[y] = −z − I₁ and E[y²] = E[(X − z)²] − 2 I₂.
        let mean = -z - first;
        let variance = 1.0 + z * z - 2.0 * second - mean * mean;
        MeanVariance { mean: limit + sigma * mean, variance: (self.variance * variance).max(0.0) }
    }
}

/// The first tail integral I₁ = ∫_z^∞ P(X > t) dt = E[(X − z)₊] of Edgeworth's series, in units of σ; φ(z) and 1 − Φ(z) are
/// given.
fn first_tail(z: f64, [phi, tail]: [f64; 2], skewness: f64, kurtosis: f64) -> f64 {
    // ∫ He_n φ from z upward is He_{n−1}(z) φ(z).
    let he4 = z.powi(4) - 6.0 * z * z + 3.0;
    let he2 = z * z - 1.0;
    phi - z * tail + phi * (skewness / 6.0 * z + kurtosis / 24.0 * he2 + skewness.powi(2) / 72.0 * he4)
}

/// Expected length and standard deviation of the length of a normal vector of three components.
///
/// With Q = |δ|², E√Q = (1/2√π) ∫₀^∞ t^(−3/2) (1 − E e^(−tQ)) dt, and along the principal axes of the covariance, with
/// variances λᵢ and means mᵢ, E e^(−tQ) = Π (1 + 2λᵢt)^(−1/2) exp(−t mᵢ²/(1 + 2λᵢt)). The integral over u = ln t is a sum
/// in steps of ¼: the integrand is tame up to |Im u| = π/2, so the sum is off by e^(−4π²) ≈ 10⁻¹⁷; both tails are
/// geometric series.
pub fn length(mean: &Vector3<f64>, covariance: &Matrix3<f64>) -> MeanVariance {
    const STEP: f64 = 0.25;
    const STEPS: i32 = 112;
    let axes = covariance.symmetric_eigen();
    let along = axes.eigenvectors.transpose() * mean;
    let square = covariance.trace() + mean.norm_squared();
    if !(square > 0.0 && square.is_finite()) {
        return MeanVariance { mean: 0.0, variance: 0.0 };
    }
    let lambda = axes.eigenvalues.map(|value| value.max(0.0) / square);
    let offset = along.component_mul(&along) / square;
    let shortfall = |t: f64| {
        let log: f64 = (0..3)
            .map(|i| {
                let widened = 2.0 * lambda[i] * t;
                0.5 * widened.ln_1p() + t * offset[i] / (1.0 + widened)
            })
            .sum();
        -(-log).exp_m1()
    };
    let sum: f64 = (-STEPS..=STEPS)
        .map(|k| {
            let u = STEP * f64::from(k);
            (-u / 2.0).exp() * shortfall(u.exp())
        })
        .sum();
    // Beyond the steps the integrand is e^(u/2) below (E Q = 1) and e^(−u/2) above.
    let edge = (-STEP * f64::from(STEPS + 1) / 2.0).exp() / (1.0 - (-STEP / 2.0).exp());
    let expected = STEP * (sum + 2.0 * edge) / (2.0 * PI.sqrt());
    MeanVariance { mean: expected * square.sqrt(), variance: (square * (1.0 - expected * expected)).max(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the table ends and beyond, both tails: that of libm. φ in the table is off by what rounding does to z²/2, up to 50.
    #[test]
    fn the_table_is_the_cumulative_distribution() {
        for step in -13_000..=13_000 {
            let z = 1e-3 * f64::from(step);
            let expected = 0.5 * libm::erfc(-z * FRAC_1_SQRT_2);
            assert!((cumulative(z) / expected - 1.0).abs() < 2e-14, "{z}: {} {expected}", cumulative(z));
        }
        assert_eq!([f64::NEG_INFINITY, 0.0, f64::INFINITY].map(cumulative), [0.0, 0.5, 1.0]);
        assert!(cumulative(f64::NAN).is_nan());
    }

    /// Σ over a fine lattice of a density: an independent reckoning of any expectation.
    fn expectation(variable: NearlyNormal, f: impl Fn(f64) -> f64) -> f64 {
        let sigma = variable.variance.sqrt();
        let step = 24.0 / 200_000.0;
        (0..=200_000)
            .map(|i| {
                let z = -12.0 + step * f64::from(i);
                let skewness = variable.third / sigma.powi(3);
                let kurtosis = variable.fourth / sigma.powi(4);
                let he6 = z.powi(6) - 15.0 * z.powi(4) + 45.0 * z * z - 15.0;
                let series = 1.0
                    + skewness / 6.0 * (z.powi(3) - 3.0 * z)
                    + kurtosis / 24.0 * (z.powi(4) - 6.0 * z * z + 3.0)
                    + skewness * skewness / 72.0 * he6;
                step * density(z) * series * f(variable.mean + sigma * z)
            })
            .sum()
    }

    /// Lengths of known law: half-normal √(2/π), Rayleigh √(π/2), Maxwell √(8/π); without spread the mean's own; far off
    /// the origin the mean's own and what spreads across it, m + (λ₂ + λ₃)/2m.
    #[test]
    fn lengths_of_normal_vectors_have_their_known_means() {
        let none = Vector3::zeros();
        let diagonal = |a: f64, b: f64, c: f64| Matrix3::from_diagonal(&Vector3::new(a, b, c));
        for (covariance, expected, square) in [
            (diagonal(4.0, 0.0, 0.0), 2.0 * (2.0 / PI).sqrt(), 4.0),
            (diagonal(1.0, 0.0, 1.0), (PI / 2.0).sqrt(), 2.0),
            (diagonal(0.25, 0.25, 0.25), 0.5 * (8.0 / PI).sqrt(), 0.75),
        ] {
            let found = length(&none, &covariance);
            assert!((found.mean - expected).abs() < 1e-11, "{} {expected}", found.mean);
            assert!((found.variance - (square - expected * expected)).abs() < 1e-11);
        }
        let still = length(&Vector3::new(3.0, 0.0, 4.0), &Matrix3::zeros());
        assert!((still.mean - 5.0).abs() < 1e-11 && still.variance < 1e-10);
        let far = length(&Vector3::new(0.0, 1000.0, 0.0), &diagonal(1.0, 9.0, 2.0));
        assert!((far.mean - 1_000.001_5).abs() < 1e-7 && (far.variance - 9.0).abs() < 1e-4, "{far:?}");
        assert_eq!(length(&none, &Matrix3::zeros()).mean, 0.0);
    }

    #[test]
    fn clipping_agrees_with_numerical_integration() {
        for (third, fourth) in [(0.0, 0.0), (12.0, 30.0)] {
            let variable = NearlyNormal { mean: 100.0, variance: 25.0, third, fourth };
            for limit in [80.0, 97.0, 100.0, 104.0, 130.0] {
                let clipped = variable.clipped_above(limit);
                let mean = expectation(variable, |x| x.min(limit));
                let square = expectation(variable, |x| (x.min(limit) - mean).powi(2));
                // Trapezoid sum of a kinked function: error ~ (step σ)² / 12 ≈ 3·10⁻⁸.
                assert!((clipped.mean - mean).abs() < 1e-7, "{limit} {} {mean}", clipped.mean);
                let excess = variable.excess(limit);
                assert!((excess - (100.0 - clipped.mean)).abs() < 1e-12, "{limit} {excess}");
                assert!((clipped.variance - square).abs() < 1e-6, "{limit} {} {square}", clipped.variance);
            }
        }
    }
}
