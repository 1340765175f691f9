//! Smooth hue transition beyond first order, and where nothing can be propagated.
//!
//! X̂ = ĝ₀ · mean of xᵢ/ĝᵢ divides by green, so its moments are those of a quotient. With greens ḡ(1 + u) the
//! expectation of (1 + a)ᵖ/((1 + u)(1 + v)) is expanded to the fourth order in noise over signal, by the second to fourth
//! joint cumulants of a, u and v, which are sums over the weights of green.

use super::gains;
use super::moments::Prediction;
use super::moments::SiteCovariance;
use crate::cfa::{CfaPattern, Class};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{PHASES, Stencil};
use crate::stages::demosaic::weights::{WeightTable, greens_of_hue};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// Ratios of red and of blue to green; 1 where green is not above zero and there is no hue.
pub fn hues(mean: [f64; 3]) -> [f64; 2] {
    let green = mean[Class::Green as usize];
    [Class::Red, Class::Blue].map(|class| if green > 0.0 { mean[class as usize] / green } else { 1.0 })
}

pub(super) mod expansion;
mod sharing;

/// How far green is from where smooth hue transition would divide by zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FirstOrder {
    /// Whether propagation holds.
    pub holds: bool,
    /// Mean of green, above black, over the standard deviation of green where it is interpolated.
    pub green_over_noise: f64,
}

/// Green over its noise below which propagation is void.
///
/// The terms of second order in X̂ = ĝ x/ĝ′ add about 2.5/z² to the variance of a channel that is noisy because green is,
/// z = ḡ/σ_ĝ: 2.5 % at z = 10, where ĝ′ ≤ 0 has a probability of 10⁻²³; the third, about 10/z⁴, is left out. Below,
/// moments lean on ever rarer pixels and soon do not exist.
pub const VOID_BELOW: f64 = 10.0;

/// Why nothing is said below it.
pub(super) const VOID: &str =
    "green is less than ten times its noise; smooth hue transition divides by it, and no moments can be relied on";

impl FirstOrder {
    /// Of the means above black and the variances of the photosites.
    pub fn of(mean: [f64; 3], variances: [f64; 3]) -> Self {
        let green = Class::Green as usize;
        // Interpolated green is the mean of four photosites.
        let noise = (variances[green] / 4.0).sqrt();
        let ratio = if noise > 0.0 { mean[green] / noise } else { f64::MAX.copysign(mean[green]) };
        Self { holds: ratio >= VOID_BELOW, green_over_noise: ratio }
    }
}

/// Moments to second order.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrder {
    /// How far the means of the channels lie from those without noise.
    pub bias: [f64; 3],
    /// Covariance of the channels over all pixels of a large frame.
    pub covariance: Matrix3<f64>,
}

/// The moments of smooth hue transition to second order; none for other methods, which are linear, and where
/// propagation is void.
///
/// `mean` is above black; `sites` are the moments of the photosites, whose third and fourth cumulants count for green.
pub fn second_order(
    method: Method,
    pattern: CfaPattern,
    mean: [f64; 3],
    sites: &[Prediction; 3],
) -> Option<SecondOrder> {
    let variances = sites.map(|site| site.moments.variance);
    if method != Method::SmoothHue || !FirstOrder::of(mean, variances).holds {
        return None;
    }
    let weights = WeightTable::of(method, pattern).about(hues(mean));
    let covariance = SiteCovariance::of(sites);
    let moments = [0, 1, 2, 3].map(|phase| {
        if !covariance.is_independent() {
            return sharing::of_phase(pattern, phase, mean, sites, &weights);
        }
        let linear = gains::pixel(&weights, phase).covariance(variances);
        of_phase(pattern, phase, mean, sites, linear)
    });
    let center = moments.iter().map(|(mean, _)| mean).sum::<Vector3<f64>>() / 4.0;
    let spread = |mean: &Vector3<f64>| (mean - center) * (mean - center).transpose();
    let covariance =
        moments.iter().map(|(mean, covariance)| covariance + spread(mean)).sum::<Matrix3<f64>>() / PHASES.len() as f64;
    Some(SecondOrder { bias: (center - Vector3::from(mean)).into(), covariance })
}

/// Mean and covariance of the pixels of one phase; `linear` is their covariance to first order.
fn of_phase(
    pattern: CfaPattern,
    phase: usize,
    mean: [f64; 3],
    sites: &[Prediction; 3],
    linear: Matrix3<f64>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let green = Class::Green as usize;
    let variances = sites.map(|site| site.moments.variance);
    let class = |offset: [isize; 2]| {
        let [x, y] = PHASES[phase];
        pattern.class((x + offset[0]) as i64, (y + offset[1]) as i64)
    };
    let noise = GreenNoise {
        class: &class,
        second: variances[green] / mean[green].powi(2),
        third: sites[green].third / mean[green].powi(3),
        fourth: sites[green].fourth() / mean[green].powi(4),
    };
    let chrominances = [Class::Red, Class::Blue].map(|class| (class, greens_of_hue(pattern, phase, class)));
    let (mut means, mut covariance) = (Vector3::from(mean), linear);
    // Mean over the neighbors of E (1 + a)ᵖ/(1 + uᵢ) − 1. All expectations are kept less 1, so that nothing cancels.
    let average = |power: u32, here: &Stencil, around: &[Stencil]| {
        around.iter().map(|stencil| noise.quotient(power, here, stencil, None)).sum::<f64>() / around.len() as f64
    };
    for (class, (here, around)) in chrominances.iter().filter(|(_, (_, around))| !around.is_empty()) {
        let channel = *class as usize;
        let count = around.len() as f64;
        let first = average(1, here, around);
        means[channel] += mean[channel] * first;
        let mut square = 0.0;
        let mut own = 0.0;
        for (i, one) in around.iter().enumerate() {
            for (j, other) in around.iter().enumerate() {
                let both = noise.quotient(2, here, one, Some(other)) / (count * count);
                square += both;
                own += if i == j { 1.0 / (count * count) + both } else { 0.0 };
            }
        }
        // E x_i x_j = x̄² + σ² where i = j.
        covariance[(channel, channel)] =
            mean[channel].powi(2) * (square - 2.0 * first - first * first) + variances[channel] * own;
        let with_green = mean[channel] * mean[green] * (average(2, here, around) - first);
        covariance[(channel, green)] = with_green;
        covariance[(green, channel)] = with_green;
    }
    if let [(_, (here, reds)), (_, (_, blues))] = &chrominances
        && !reds.is_empty()
        && !blues.is_empty()
    {
        let pairs = reds.iter().flat_map(|red| blues.iter().map(move |blue| (red, blue)));
        let both = pairs.map(|(red, blue)| noise.quotient(2, here, red, Some(blue))).sum::<f64>()
            / (reds.len() * blues.len()) as f64;
        let (red_alone, blue_alone) = (average(1, here, reds), average(1, here, blues));
        let [red, blue] = [Class::Red as usize, Class::Blue as usize];
        let together = mean[red] * mean[blue] * (both - red_alone - blue_alone - red_alone * blue_alone);
        covariance[(red, blue)] = together;
        covariance[(blue, red)] = together;
    }
    (means, covariance)
}

/// Cumulants of the relative noise of green photosites about a pixel.
struct GreenNoise<'a, C> {
    class: &'a C,
    /// σ²/ḡ².
    second: f64,
    /// κ₃/ḡ³.
    third: f64,
    /// κ₄/ḡ⁴.
    fourth: f64,
}

impl<C: Fn([isize; 2]) -> Class> GreenNoise<'_, C> {
    /// Joint cumulant of two to four sums of greens.
    fn cumulant(&self, forms: &[&Stencil]) -> f64 {
        let Some((first, rest)) = forms.split_first() else { return 0.0 };
        let greens = first.sites().filter(|(offset, _)| (self.class)(*offset) == Class::Green);
        let sum: f64 =
            greens.map(|(offset, weight)| rest.iter().fold(weight, |product, form| product * form.at(offset))).sum();
        sum * match forms.len() {
            2 => self.second,
            3 => self.third,
            _ => self.fourth,
        }
    }

    /// E (1 + a)ᵖ/((1 + u)(1 + v)) − 1, or without v, to fourth order:
    ///
    /// ½ Σ fᵢⱼ κᵢⱼ + ⅙ Σ fᵢⱼₖ κᵢⱼₖ + Σ fᵢⱼₖₗ (κᵢⱼ κₖₗ/8 + κᵢⱼₖₗ/24)
    ///
    /// with the derivatives f at the means, which are products of factorials.
    fn quotient(&self, power: u32, a: &Stencil, u: &Stencil, v: Option<&Stencil>) -> f64 {
        let forms: Vec<&Stencil> = [a, u].into_iter().chain(v).collect();
        let variables = forms.len();
        let derivative = |indices: &[usize]| {
            let order = |variable: usize| indices.iter().filter(|&&index| index == variable).count();
            let falling: f64 = (0..order(0)).map(|k| f64::from(power) - k as f64).product();
            let inverse = |order: usize| (1..=order).map(|k| -(k as f64)).product::<f64>();
            falling * inverse(order(1)) * inverse(order(2))
        };
        let second: Vec<f64> = (0..variables * variables)
            .map(|ij| self.cumulant(&[forms[ij / variables], forms[ij % variables]]))
            .collect();
        let pair = |i: usize, j: usize| second[i * variables + j];
        let mut expected = 0.0;
        for i in 0..variables {
            for j in 0..variables {
                expected += derivative(&[i, j]) * pair(i, j) / 2.0;
                for k in 0..variables {
                    expected += derivative(&[i, j, k]) * self.cumulant(&[forms[i], forms[j], forms[k]]) / 6.0;
                    for l in 0..variables {
                        let all = self.cumulant(&[forms[i], forms[j], forms[k], forms[l]]);
                        expected += derivative(&[i, j, k, l]) * (pair(i, j) * pair(k, l) / 8.0 + all / 24.0);
                    }
                }
            }
        }
        expected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::LineCovariance;

    fn sites(variances: [f64; 3]) -> [Prediction; 3] {
        variances.map(|variance| Prediction::of_cumulants(0.0, variance, 0.0, 0.0))
    }

    /// Where noise is small the second order is the first.
    #[test]
    fn quiet_greens_leave_the_first_order() {
        let mean = [0.5, 1.0, 2.0];
        let variances = [2e-10, 3e-10, 5e-10];
        let second = second_order(Method::SmoothHue, CfaPattern::Grbg, mean, &sites(variances)).unwrap();
        let weights = WeightTable::new(Method::SmoothHue, CfaPattern::Grbg).about(super::hues(mean));
        let first = gains::mean_pixel(&weights).covariance(variances);
        assert!((second.covariance - first).abs().max() < 1e-8 * first.max(), "{} {first}", second.covariance);
        assert!(second.bias.iter().all(|bias| bias.abs() < 1e-9));
        assert_eq!(second_order(Method::Bilinear, CfaPattern::Grbg, mean, &sites(variances)), None);
        assert_eq!(second_order(Method::SmoothHue, CfaPattern::Grbg, mean, &sites([1.0, 0.041, 1.0])), None);
    }

    /// A simulation in numpy, apart from all code here: 4 frames of 2000×2000 normal photosites, edges wrapped round. The
    /// relative sampling error of a variance is √(2 · 1.5/1.6·10⁷) = 4·10⁻⁴; what is left out is of the third order,
    /// about 100/z⁶ = 10⁻⁵ at z = 15.5. The first order is off by 1 %.
    #[test]
    fn noisy_greens_follow_the_second_order() {
        let (mean, variances) = ([30.0, 60.0, 200.0], [4.0, 60.0, 30.0]);
        let simulated = Matrix3::new(
            7.594_616,
            12.218_251,
            31.547_332, //
            12.218_251,
            37.471_389,
            81.484_104, //
            31.547_332,
            81.484_104,
            253.894_613,
        );
        let found = second_order(Method::SmoothHue, CfaPattern::Rggb, mean, &sites(variances)).unwrap();
        for (found, simulated) in found.covariance.iter().zip(simulated.iter()) {
            assert!((found / simulated - 1.0).abs() < 5.0 * 4e-4, "{found} {simulated}");
        }
        // The mean of so many pixels is sure to √(4 σ²/1.6·10⁷).
        for (found, (simulated, error)) in found.bias.iter().zip([(0.01704, 0.001), (0.00088, 0.004), (0.10844, 0.008)])
        {
            assert!((found - simulated).abs() < 5.0 * error, "{found} {simulated}");
        }
        let weights = WeightTable::new(Method::SmoothHue, CfaPattern::Rggb).about(super::hues(mean));
        let first = gains::mean_pixel(&weights).covariance(variances);
        assert!(simulated[(0, 0)] / first[(0, 0)] > 1.008 && simulated[(2, 2)] / first[(2, 2)] > 1.008, "{first}");
    }

    /// The moments of photosites that share rows are those of the other formulas where they share next to nothing, but for what
    /// those have of the sixth order: the variance of red or blue times 15 s² of green, s = 6/60²/4, 3·10⁻⁶ of it.
    #[test]
    fn both_expansions_are_one() {
        let mean = [30.0, 60.0, 200.0];
        let plain = [4.0, 6.0, 30.0].map(|variance| Prediction::of_cumulants(0.0, variance, 0.3, 0.8));
        let shared = plain.map(|site| Prediction {
            lines: LineCovariance { row: [1e-14; 3], column: [0.0; 3], ..Default::default() },
            ..site
        });
        for pattern in [CfaPattern::Rggb, CfaPattern::Gbrg] {
            let [a, b] = [plain, shared].map(|s| second_order(Method::SmoothHue, pattern, mean, &s).unwrap());
            assert!(
                (a.covariance - b.covariance).abs().max() < 3e-6 * a.covariance.max(),
                "{} {}",
                a.covariance,
                b.covariance
            );
            assert!((0..3).all(|i| (a.bias[i] - b.bias[i]).abs() < 1e-9), "{a:?} {b:?}");
        }
    }

    /// A drift over far more rows than a pixel has, and no other noise, adds one number z to all: (x̄ + κ_x z)(ḡ + κ z)/(ḡ + κ z), whatever
    /// the fourth order leaves out of it.
    #[test]
    fn a_drift_of_all_photosites_together_divides_out() {
        let mean = [30.0, 60.0, 200.0];
        let site = Prediction::of_cumulants(0.0, 4.0, 0.0, 0.0);
        for (rows, variance) in [(1e9, 4.0), (2.0, 4.0)] {
            let lines = LineCovariance { row: [4.0; 3], drift: [4.0; 3], drift_rows: rows, ..Default::default() };
            let found =
                second_order(Method::SmoothHue, CfaPattern::Grbg, mean, &[Prediction { lines, ..site }; 3]).unwrap();
            let is_one = (found.covariance - Matrix3::from_element(variance)).abs().max() < 1e-5;
            assert_eq!(is_one, rows > 1e8, "{rows}: {}", found.covariance);
            assert_eq!(found.bias.iter().all(|bias| bias.abs() < 1e-9), rows > 1e8, "{rows}: {:?}", found.bias);
        }
    }

    /// One quotient against what is known of it: with a = 0 and u normal of variance s, E 1/(1 + u) = 1 + s + 3s² + …
    /// and E 1/(1 + u)² = 1 + 3s + 15s² + …; a third cumulant k adds −k and −4k.
    #[test]
    fn quotients_have_the_moments_of_their_series() {
        let class = |_: [isize; 2]| Class::Green;
        let (none, one) = (Stencil::zero(), Stencil::site([0, 0]));
        let (s, k) = (0.01, 0.001);
        let normal = GreenNoise { class: &class, second: s, third: 0.0, fourth: 0.0 };
        assert!((normal.quotient(1, &none, &one, None) - (s + 3.0 * s * s)).abs() < 1e-15);
        assert!((normal.quotient(1, &none, &one, Some(&one)) - (3.0 * s + 15.0 * s * s)).abs() < 1e-15);
        // (1 + u)/(1 + u) is 1 whatever u does.
        assert!(normal.quotient(1, &one, &one, None).abs() < 1e-15);
        let skew = GreenNoise { class: &class, second: 0.0, third: k, fourth: 0.0 };
        assert!((skew.quotient(1, &none, &one, None) + k).abs() < 1e-15);
        assert!((skew.quotient(1, &none, &one, Some(&one)) + 4.0 * k).abs() < 1e-15);
        // A fourth cumulant k adds k and 5k.
        let heavy = GreenNoise { class: &class, second: 0.0, third: 0.0, fourth: k };
        assert!((heavy.quotient(1, &none, &one, None) - k).abs() < 1e-15);
        assert!((heavy.quotient(1, &none, &one, Some(&one)) - 5.0 * k).abs() < 1e-15);
    }
}
