//! The noise equations of \[HP2005], its misprints mended, for comparison with the exact covariances.
//!
//! Mended are: Eqs. 16 and 17, whose 1/32 and 1/16 stand outside the root (Eqs. 55 and 57 have them inside); Eq. 54,
//! which lacks the factor σ_o after r₁ and r₂; the last term of Eq. 57, which has σ^(g→y) for σ^(g→x); Eqs. 38 and 39a,
//! which put in the mean number of neighbors, 2.66, where the mean of its inverse, 5/12, belongs; and Eq. 58, whose
//! 80 for green should be 82.

use super::gains;
use crate::cfa::{CfaPattern, Class};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{PHASES, Stencil};
use crate::stages::demosaic::weights::{WeightTable, Weights};
use nalgebra::Matrix3;
use serde::Serialize;

/// Numbers of photosites: of the class in question, of green, of the remaining class, of all.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Populations {
    own: f64,
    green: f64,
    other: f64,
    all: f64,
}

impl Populations {
    /// n, v, w, n′ of a frame of `size`: half of its sites are green, a quarter red or blue.
    fn of([width, height]: [usize; 2]) -> Self {
        let all = width as f64 * height as f64;
        Self { own: all / 4.0, green: all / 2.0, other: all / 4.0, all }
    }
}

/// Variance of an interpolated channel over that of its photosites.
///
/// σ_demos²/σ_o² = (n − 1)/(n′ − 1) + (1/m) (n′ − n − 1)/(n′ − 1)        [HP2005, Eqs. 14, 36]
///
/// `share` is the mean of 1/m over the interpolated sites: 1/4 for green, 5/12 for red and blue. Without a size the
/// frame is large: 5/8 and 9/16 [Eq. 39].
fn bilinear(own: f64, share: f64, all: Option<f64>) -> f64 {
    match all {
        Some(all) => (own - 1.0) / (all - 1.0) + share * (all - own - 1.0) / (all - 1.0),
        None => own + share * (1.0 - own),
    }
}

/// Mean of 1/m over the sites where red or blue is interpolated: two thirds have two neighbors, one third four.
const CHROMINANCE_SHARE: f64 = 2.0 / 3.0 / 2.0 + 1.0 / 3.0 / 4.0;

/// The covariance of demosaicked channels from variances and means (above black) of the photosites of R, G and B; none
/// for a method that the paper does not treat.
///
/// BI and SHTI leave channels uncorrelated there; ECI correlates them as Table 8 says for equal signals. Populations
/// enter BI and SHTI where `size` is given; ECI has large frames only.
pub fn demosaicked(
    method: Method,
    variances: [f64; 3],
    means: [f64; 3],
    size: Option<[usize; 2]>,
) -> Option<Matrix3<f64>> {
    let populations = size.map(Populations::of);
    let (own_share, green_share) = populations.map_or((0.25, 0.5), |p| (p.own, p.green));
    let all = populations.map(|p| p.all);
    let [red, green, blue] = variances;
    let green_demosaicked = green * bilinear(green_share, 0.25, all);
    match method {
        Method::Bilinear => {
            let factor = bilinear(own_share, CHROMINANCE_SHARE, all);
            Some(Matrix3::from_diagonal(&[red * factor, green_demosaicked, blue * factor].into()))
        }
        Method::SmoothHue => {
            let chrominance = |class: Class| {
                let ratio = means[class as usize] / means[Class::Green as usize];
                smooth_hue(variances[class as usize], ratio, green_demosaicked, populations)
            };
            let diagonal = [chrominance(Class::Red), green_demosaicked, chrominance(Class::Blue)];
            Some(Matrix3::from_diagonal(&diagonal.into()))
        }
        Method::EffectiveColor => Some(effective_color(variances, &Coefficients::EQUAL_SIGNAL)),
        Method::Malvar => None,
    }
}

/// Variance of red or blue after SHTI.
///
/// σ_x² = [(4n + 2v + w − 7) σ_o² + (6v + 5w − 11) (x̄/ḡ)² σ_g²] / 4(n′ − 1)        [HP2005, Eqs. 15, 45]
///
/// and for large frames [9 σ_o² + 17 (x̄/ḡ)² σ_g²] / 16 [Eq. 47].
fn smooth_hue(variance: f64, ratio: f64, green_demosaicked: f64, populations: Option<Populations>) -> f64 {
    let hue = ratio * ratio * green_demosaicked;
    match populations {
        None => (9.0 * variance + 17.0 * hue) / 16.0,
        Some(Populations { own, green, other, all }) => {
            let direct = 4.0 * own + 2.0 * green + other - 7.0;
            let through_green = 6.0 * green + 5.0 * other - 11.0;
            (direct * variance + through_green * hue) / (4.0 * (all - 1.0))
        }
    }
}

/// Correlation coefficients of Eqs. 16, 17 and 20.
///
/// The names are the paper's: between red (blue) and the mean of the K domain about it, r₁ (r₂); between measured green
/// and the K of its red (blue) neighbors, r′₁; between interpolated green and K, r′₂; between interpolated green and
/// the red (blue) measured there, r₃; between demosaicked channels r_rg, r_rb, r_gb.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coefficients {
    /// r₁, in the variance of green at red.
    pub r1: f64,
    /// r₂, in the variance of green at blue.
    pub r2: f64,
    /// r′₁ of red and of blue.
    pub r1_prime: [f64; 2],
    /// r′₂ of red and of blue.
    pub r2_prime: [f64; 2],
    /// r₃ of red and of blue.
    pub r3: [f64; 2],
    /// r_rg.
    pub red_green: f64,
    /// r_rb.
    pub red_blue: f64,
    /// r_gb.
    pub green_blue: f64,
}

impl Coefficients {
    /// Table 8 of \[HP2005] for equal signals, from the paper's simulations.
    pub const EQUAL_SIGNAL: Self = Self {
        r1: -0.65,
        r2: -0.65,
        r1_prime: [0.41; 2],
        r2_prime: [0.41; 2],
        r3: [0.64; 2],
        red_green: 0.74,
        red_blue: 0.64,
        green_blue: 0.74,
    };

    /// Table 8 of \[HP2005], means over 912 skies.
    pub const SKIES: Self = Self {
        r1: -0.44,
        r2: -0.73,
        r1_prime: [0.57, 0.31],
        r2_prime: [0.45, 0.32],
        r3: [0.40, 0.63],
        red_green: 0.81,
        red_blue: 0.68,
        green_blue: 0.68,
    };

    /// None correlated: Eqs. 56 and 58.
    pub const NONE: Self = Self {
        r1: 0.0,
        r2: 0.0,
        r1_prime: [0.0; 2],
        r2_prime: [0.0; 2],
        r3: [0.0; 2],
        red_green: 0.0,
        red_blue: 0.0,
        green_blue: 0.0,
    };

    /// The correlations themselves, as Eq. 50 defines them and simulations estimate them: between a value and the mean
    /// of the K that it is restored with.
    pub fn simulated(variances: [f64; 3]) -> Self {
        let exact = Exact::new(variances);
        let here = Stencil::site([0, 0]);
        let channel = |at: Class, of: Class| exact.stencil(at, of);
        let mean_of_k = |at: Class, own: Class| match at {
            // Green = X + mean of K where X is measured; X = green − mean of K elsewhere.
            _ if at == own => channel(at, Class::Green).plus(-1.0, &here),
            _ => channel(at, Class::Green).plus(-1.0, &channel(at, own)),
        };
        let both = [(Class::Red, Class::Blue), (Class::Blue, Class::Red)];
        let r1 = both.map(|(own, _)| exact.correlation(own, &here, &mean_of_k(own, own)));
        let with_green = |at: Class, own: Class| exact.correlation(at, &channel(at, Class::Green), &mean_of_k(at, own));
        Self {
            r1: r1[0],
            r2: r1[1],
            r1_prime: both.map(|(own, _)| with_green(Class::Green, own)),
            r2_prime: both.map(|(own, other)| with_green(other, own)),
            ..Self::effective(variances)
        }
    }

    /// The coefficients that make Eqs. 16, 17 and 20 exact at given variances of the photosites: each is solved from the
    /// exact variance, by the weights, of the sum that it stands in.
    ///
    /// r₃, r_rg, r_rb and r_gb are plain correlations; the others also make up for what the paper leaves out, that the
    /// K in a mean are correlated with each other, so they are what its equations need rather than what a simulation
    /// measures ([`Self::simulated`]).
    pub fn effective(variances: [f64; 3]) -> Self {
        let exact = Exact::new(variances);
        let [red, green, blue] = variances;
        let both = [(Class::Red, Class::Blue, red), (Class::Blue, Class::Red, blue)];
        let interpolated = |class: Class| exact.variance(class, Class::Green);
        let r1 = both.map(|(class, _, own)| {
            // Eq. 52: σ² = σ_o² + σ_K² + 2 r σ_o σ_K, σ_K² = (σ_g² + σ_o²/2)/4 by Eq. 53.
            let k = mean_of_k(green, own);
            quotient(interpolated(class) - own - k, 2.0 * (own * k).sqrt())
        });
        let here = Stencil::site([0, 0]);
        let r3 = both.map(|(class, _, _)| exact.correlation(class, &exact.stencil(class, Class::Green), &here));
        let k = [0, 1].map(|i| difference(interpolated(both[i].0), both[i].2, r3[i]));
        let r1_prime = [0, 1].map(|i| {
            // Red at green: σ² = σ_g² + σ_K²/2 − √2 r σ_g σ_K.
            let rest = green + k[i] / 2.0 - exact.variance(Class::Green, both[i].0);
            quotient(rest, std::f64::consts::SQRT_2 * (green * k[i]).sqrt())
        });
        let r2_prime = [0, 1].map(|i| {
            // Red at blue: σ² = σ_(g→b)² + σ_K²/4 − r σ_(g→b) σ_K.
            let (own, other, _) = both[i];
            let rest = interpolated(other) + k[i] / 4.0 - exact.variance(other, own);
            quotient(rest, (interpolated(other) * k[i]).sqrt())
        });
        let covariance = gains::mean_pixel(&exact.weights).covariance(variances);
        let correlation = |a: Class, b: Class| {
            let [a, b] = [a as usize, b as usize];
            quotient(covariance[(a, b)], (covariance[(a, a)] * covariance[(b, b)]).sqrt())
        };
        Self {
            r1: r1[0],
            r2: r1[1],
            r1_prime,
            r2_prime,
            r3,
            red_green: correlation(Class::Red, Class::Green),
            red_blue: correlation(Class::Red, Class::Blue),
            green_blue: correlation(Class::Green, Class::Blue),
        }
    }
}

/// A quotient, 0 where there is nothing to divide by.
fn quotient(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

/// Exact covariances of ECI about the sites of a class.
struct Exact {
    weights: Weights,
    variances: [f64; 3],
}

impl Exact {
    fn new(variances: [f64; 3]) -> Self {
        let weights = WeightTable::of(Method::EffectiveColor, CfaPattern::Rggb).about([1.0, 1.0]);
        Self { weights, variances }
    }

    /// A phase whose sites are of a class: green has two, which differ in which way red and blue lie, so that all
    /// variances are the same.
    fn phase(&self, at: Class) -> usize {
        (0..PHASES.len()).find(|&phase| self.weights.class(phase, [0, 0]) == at).unwrap_or_default()
    }

    /// The weights of channel `of` at the sites of class `at`.
    fn stencil(&self, at: Class, of: Class) -> Stencil {
        self.weights.stencil(self.phase(at), of as usize).clone()
    }

    /// The covariance of two sums of sites about a site of class `at`.
    fn covariance(&self, at: Class, a: &Stencil, b: &Stencil) -> f64 {
        let variance = |offset| self.variances[self.weights.class(self.phase(at), offset) as usize];
        a.sites().map(|(offset, weight)| weight * b.at(offset) * variance(offset)).sum()
    }

    fn correlation(&self, at: Class, a: &Stencil, b: &Stencil) -> f64 {
        let square = self.covariance(at, a, a) * self.covariance(at, b, b);
        quotient(self.covariance(at, a, b), square.sqrt())
    }

    /// The variance of channel `of` at the sites of class `at`.
    fn variance(&self, at: Class, of: Class) -> f64 {
        let stencil = self.stencil(at, of);
        self.covariance(at, &stencil, &stencil)
    }
}

/// Variance of the mean of four K about a red or blue site [HP2005, Eq. 53].
fn mean_of_k(green: f64, own: f64) -> f64 {
    (green + own / 2.0) / 4.0
}

/// Variance of K = G − X where green was interpolated: σ_g² − 2 r₃ σ_g σ_x + σ_x².
fn difference(green: f64, own: f64, r3: f64) -> f64 {
    (green - 2.0 * r3 * (green * own).sqrt() + own).max(0.0)
}

/// The covariance of the channels after ECI at given variances of the photosites of R, G and B.
///
/// [HP2005, Eqs. 16, 17, 52–55, 57], and Eq. 20 for the covariances.
pub fn effective_color(variances: [f64; 3], r: &Coefficients) -> Matrix3<f64> {
    let [red, green, blue] = variances;
    // Eqs. 52, 54: green at red and at blue.
    let interpolated = |own: f64, r: f64| {
        let k = mean_of_k(green, own);
        own + k + 2.0 * r * (own * k).sqrt()
    };
    let at_red = interpolated(red, r.r1);
    let at_blue = interpolated(blue, r.r2);
    // Eq. 55.
    let green_variance = (at_red + 2.0 * green + at_blue) / 4.0;
    // Eq. 57: `at_own` is green interpolated where x is measured, `at_other` where the remaining class is.
    let chrominance = |own: f64, at_own: f64, at_other: f64, index: usize| {
        let (r1_prime, r2_prime, r3) = (r.r1_prime[index], r.r2_prime[index], r.r3[index]);
        let k = difference(at_own, own, r3);
        let with_k = (8.0 * (2.0 * green).sqrt() * r1_prime + 4.0 * r2_prime * at_other.sqrt()) * k.sqrt();
        let sum = 9.0 * own + 8.0 * green + 5.0 * at_own + 4.0 * at_other - with_k;
        (sum - 10.0 * r3 * (at_own * own).sqrt()) / 16.0
    };
    let red_variance = chrominance(red, at_red, at_blue, 0);
    let blue_variance = chrominance(blue, at_blue, at_red, 1);
    let std = [red_variance, green_variance, blue_variance].map(f64::sqrt);
    let correlations =
        Matrix3::new(1.0, r.red_green, r.red_blue, r.red_green, 1.0, r.green_blue, r.red_blue, r.green_blue, 1.0);
    Matrix3::from_fn(|i, j| correlations[(i, j)] * std[i] * std[j])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eqs. 39 and 47: 5/8, 9/16 and 17/16, from the printed figures.
    #[test]
    fn large_frames_have_the_printed_fractions() {
        let bilinear = demosaicked(Method::Bilinear, [1.0; 3], [1.0; 3], None).unwrap();
        assert_eq!(bilinear.diagonal().as_slice(), [0.5625, 0.625, 0.5625]);
        let smooth = demosaicked(Method::SmoothHue, [1.0; 3], [2.0, 1.0, 1.0], None).unwrap();
        assert!((smooth[(0, 0)] - (9.0 + 17.0 * 4.0 * 0.625) / 16.0).abs() < 1e-15);
        // Eq. 38 at p = 300 as printed but with 5/12 for 1/2.66: 30×40 sites.
        let small = demosaicked(Method::Bilinear, [1.0; 3], [1.0; 3], Some([40, 30])).unwrap();
        let expected = (299.0 + 5.0 / 12.0 * 899.0) / 1199.0;
        assert!((small[(0, 0)] - expected).abs() < 1e-15);
        assert_eq!(demosaicked(Method::Malvar, [1.0; 3], [1.0; 3], None), None);
    }

    /// Eqs. 56 and 58, the forms without correlation: (9, 20, 9)/32 and (117, 82, 36)/128. Eq. 58 is printed with 80 for
    /// green; Eq. 57 without correlations, 8 + 5 · 2/8 + 4 · 2/8 sixteenths, gives 82.
    #[test]
    fn uncorrelated_effective_color_has_the_printed_fractions() {
        let covariance = effective_color([1.0; 3], &Coefficients::NONE);
        assert!((covariance[(1, 1)] - 38.0 / 32.0).abs() < 1e-15);
        assert!((covariance[(0, 0)] - 235.0 / 128.0).abs() < 1e-15);
        let unequal = effective_color([2.0, 3.0, 5.0], &Coefficients::NONE);
        assert!((unequal[(1, 1)] - (18.0 + 60.0 + 45.0) / 32.0).abs() < 1e-14);
        assert!((unequal[(0, 0)] - (117.0 * 2.0 + 82.0 * 3.0 + 36.0 * 5.0) / 128.0).abs() < 1e-14);
        assert!((unequal[(2, 2)] - (117.0 * 5.0 + 82.0 * 3.0 + 36.0 * 2.0) / 128.0).abs() < 1e-14);
    }

    /// With the coefficients of the weights the paper's equations are exact at any variances.
    #[test]
    fn effective_coefficients_make_the_equations_exact() {
        for variances in [[1.0, 1.0, 1.0], [2.0, 3.0, 5.0], [0.3, 10.0, 0.01], [40.0, 0.5, 3.0]] {
            let weights = WeightTable::new(Method::EffectiveColor, CfaPattern::Gbrg).about([1.0, 1.0]);
            let exact = gains::mean_pixel(&weights).covariance(variances);
            let paper = effective_color(variances, &Coefficients::effective(variances));
            assert!((exact - paper).abs().max() < 1e-12 * exact.max(), "{variances:?} {exact} {paper}");
        }
    }

    /// Table 8, case of equal signals, was simulated on 30×40 frames, whose sampling error of a correlation of 0.65 is
    /// about 0.58/√300 = 0.03 in one frame.
    #[test]
    fn simulated_coefficients_are_near_table_8() {
        let r = Coefficients::simulated([1.0; 3]);
        let table = Coefficients::EQUAL_SIGNAL;
        let pairs = [
            (r.r1, table.r1),
            (r.r2, table.r2),
            (r.r1_prime[0], table.r1_prime[0]),
            (r.r3[0], table.r3[0]),
            (r.red_green, table.red_green),
            (r.red_blue, table.red_blue),
            (r.green_blue, table.green_blue),
        ];
        for (ours, theirs) in pairs {
            assert!((ours - theirs).abs() < 0.05, "{ours} {theirs}: {r:?}");
        }
        // r′₂ is given as 0.41, the value of r′₁. It is 0.34, and what Eq. 57 needs is 0.26.
        assert!((r.r2_prime[0] - 0.339).abs() < 0.001);
        assert!((Coefficients::effective([1.0; 3]).r2_prime[0] - 0.264).abs() < 0.001);
    }
}
