//! Moments of the codes of a converter that is not straight, or of these made straight.

use super::effort;
use crate::camera::linearity::Linearization;
use crate::metadata::AdcRecord;
use crate::numerics::edges;
use crate::numerics::normal::{cumulative, density};
use crate::numerics::rounding::{REACH, Rounding, SMOOTH};

/// Moments 1 to 4 about `center` of the samples of a normal charge, in e⁻, that is read as codes between `ends`.
///
/// Σ over the edges t between codes of \[g(t + ½) − g(t − ½)] T(t), with g the powers of a code's sample and T the probability
/// of a charge beyond the edge; of a wide law over fewer [places](edges::over), from one knot of a table to the next. Good to 3·10⁻⁷ of the charge's own moments.
pub(super) fn moments(adc: &AdcRecord, ends: Rounding, mean_e: f64, std_e: f64, center: f64) -> [f64; 4] {
    let code_of = |electrons: f64| ends.code(adc.level_at(electrons));
    if std_e <= 0.0 {
        return powers(adc.sample(code_of(mean_e)) - center);
    }
    let reach = REACH * std_e;
    let (first, last) = (code_of(mean_e - reach), code_of(mean_e + reach));
    let levels = [mean_e - reach, mean_e + reach].map(|electrons| adc.level_at(electrons));
    let sigma = (levels[1] - levels[0]) / (2.0 * REACH);
    if first > ends.lowest
        && last < ends.highest
        && let Some(found) = smooth(adc, levels, [mean_e, std_e], center)
    {
        return found;
    }
    let mut sum = Sum { moments: powers(adc.sample(first) - center), mean_e, std_e, center };
    let knots = adc.linearization.map_or(&[][..], Linearization::knots);
    let mut code = first;
    for knot in knots.iter().map(|knot| adc.bias_adu + knot).filter(|knot| *knot > first && *knot < last) {
        // The knot lies between this code and the next, unless that was gone through.
        let below = knot.floor();
        if below >= code {
            sum.run(adc, code, below, sigma);
            sum.one_by_one(adc, below, below + 1.0);
            code = below + 1.0;
        }
    }
    sum.run(adc, code, last, sigma);
    sum.moments
}

/// The same of a charge that scatters over so many codes that rounding is a uniform error of theirs, none of which between two levels is an end,
/// or a knot of a table; none of others.
///
/// Σ_k g(k) P(k) = ∫ E g(t + u) φ(z(t)) z′(t) dt, z(t) how far off the charge is which the level t is of, u uniform on ±½: a sum over levels, as
/// exact as for any normal law (Poisson's summation).
fn smooth(adc: &AdcRecord, levels: [f64; 2], [mean_e, std_e]: [f64; 2], center: f64) -> Option<[f64; 4]> {
    const STEPS_TO_SIGMA: f64 = 1.5;
    const MOST_BENT: f64 = 1.5;
    let is_within = levels[0] >= 0.0 && levels[1] <= f64::from(adc.top_code());
    let curve = adc.linearization.filter(|curve| is_within && curve.knots().is_empty())?;
    let slope = |level: f64| curve.slope(level - adc.bias_adu) / (adc.adu_per_e * std_e);
    let [low, high] = levels.map(slope);
    let steepest = low.max(high).max(slope(f64::midpoint(levels[0], levels[1])));
    if !(low.min(high) > 0.0 && steepest < MOST_BENT * low.min(high) && steepest * SMOOTH < 1.0) {
        return None;
    }
    let steps = ((levels[1] - levels[0]) * steepest * STEPS_TO_SIGMA).ceil();
    let step = (levels[1] - levels[0]) / steps;
    let errors = [(-0.15_f64.sqrt(), 5.0 / 18.0), (0.0, 4.0 / 9.0), (0.15_f64.sqrt(), 5.0 / 18.0)];
    let mut found = [0.0; 4];
    let mut index = 0.0;
    while index <= steps {
        let level = levels[0] + index * step;
        let weight = step * density((adc.electrons_at(level) - mean_e) / std_e) * slope(level);
        for (error, share) in if adc.is_linearized { &errors[..] } else { &[(0.0, 1.0)] } {
            for (moment, power) in found.iter_mut().zip(powers(adc.sample(level + error) - center)) {
                *moment += weight * share * power;
            }
        }
        index += 1.0;
    }
    if !adc.is_linearized {
        let [first, second, ..] = found;
        let uniform = [0.0, 1.0 / 12.0, 0.25 * first, 0.5 * second + 1.0 / 80.0];
        found.iter_mut().zip(uniform).for_each(|(moment, of_error)| *moment += of_error);
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some dozens")]
    effort::spend(steps as u64);
    Some(found)
}

/// Powers 1 to 4.
fn powers(x: f64) -> [f64; 4] {
    [x, x * x, x * x * x, x * x * x * x]
}

/// Moments of a normal charge, so far.
struct Sum {
    moments: [f64; 4],
    mean_e: f64,
    std_e: f64,
    center: f64,
}

/// What is linear between two knots, and so beyond them.
struct Line {
    code: f64,
    sample: f64,
    sample_slope: f64,
    electrons: f64,
    electrons_slope: f64,
}

impl Line {
    /// That of a table at a code.
    fn at(adc: &AdcRecord, code: f64) -> Self {
        let slope = adc.linearization.map_or(1.0, |curve| curve.slope(code - adc.bias_adu));
        Self {
            code,
            sample: adc.sample(code),
            sample_slope: if adc.is_linearized { slope } else { 1.0 },
            electrons: adc.electrons_at(code),
            electrons_slope: slope / adc.adu_per_e,
        }
    }
}

impl Sum {
    /// Takes in an edge at which charges of `electrons` are read as one sample or the other.
    fn add(&mut self, weight: f64, electrons: f64, [below, above]: [f64; 2]) {
        let weight = weight * cumulative((self.mean_e - electrons) / self.std_e);
        let [below, above] = [below, above].map(|sample| powers(sample - self.center));
        for ((moment, above), below) in self.moments.iter_mut().zip(above).zip(below) {
            *moment += weight * (above - below);
        }
    }

    /// The edges from one code to another.
    fn one_by_one(&mut self, adc: &AdcRecord, first: f64, last: f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "codes, from 0 on")]
        effort::spend((last - first).max(0.0) as u64);
        let mut code = first;
        while code < last {
            let samples = [code, code + 1.0].map(|code| adc.sample(code));
            self.add(1.0, adc.electrons_at(code + 0.5), samples);
            code += 1.0;
        }
    }

    /// The same where no knot lies between the codes, over each of which `sigma` are a standard deviation.
    fn run(&mut self, adc: &AdcRecord, first: f64, last: f64, sigma: f64) {
        // What is smooth goes on beyond the ends of the codes as it is.
        let curve = adc.linearization.filter(|curve| curve.knots().is_empty());
        let line = Line::at(adc, 0.5 * (first + last));
        let above_bias = |code: f64| curve.map(|curve| curve.linear(code - adc.bias_adu));
        let sample = |code: f64| match above_bias(code) {
            Some(above) if adc.is_linearized => adc.bias_adu + above,
            Some(_) => code,
            None => line.sample + line.sample_slope * (code - line.code),
        };
        let electrons = |edge: f64| match above_bias(edge) {
            Some(above) => above / adc.adu_per_e,
            None => line.electrons + line.electrons_slope * (edge - line.code),
        };
        let places = edges::over(first, last, sigma, |edge, weight| {
            self.add(weight, electrons(edge), [edge - 0.5, edge + 0.5].map(sample));
        });
        effort::spend(places);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::rounding::partial_moments;

    /// The probabilities of all codes one by one.
    fn reference(adc: &AdcRecord, mean_e: f64, std_e: f64, center: f64) -> [f64; 4] {
        let top = adc.top_code();
        let at = |edge: f64| (adc.electrons_at(edge) - mean_e) / std_e;
        let mut moments = [0.0; 4];
        for code in 0..=top {
            let below = if code == 0 { f64::NEG_INFINITY } else { at(f64::from(code) - 0.5) };
            let above = if code == top { f64::INFINITY } else { at(f64::from(code) + 0.5) };
            let probability = partial_moments([below, above])[0];
            for (power, moment) in (1..).zip(&mut moments) {
                *moment += probability * (adc.sample(f64::from(code)) - center).powi(power);
            }
        }
        moments
    }

    /// Spreads of a tenth of a code to half the range, in the middle and at both ends.
    #[test]
    fn moments_are_those_of_the_codes_one_by_one() {
        let polynomials = [vec![1.0, 4e-6], vec![1.05, -3e-6, 1e-10], vec![1.0]];
        let knots = |codes: &[f64], linear: &[f64]| Linearization::table(codes.to_vec(), linear.to_vec()).unwrap();
        let tables = [
            knots(&[0.0, 648.0, 1296.0, 1944.0, 2591.0, 3239.0], &[0.0, 622.4, 1289.8, 1916.0, 2588.6, 3218.2]),
            knots(&[-90.5, 700.2, 700.4, 701.3, 3995.0], &[-80.0, 710.0, 710.3, 710.9, 4100.0]),
        ];
        let curves = polynomials.map(|curve| Linearization::polynomial(curve).unwrap());
        for curve in curves.into_iter().chain(tables) {
            let linearization = Some(curve);
            for is_linearized in [false, true] {
                let adc = AdcRecord { linearization, is_linearized, ..AdcRecord::new(12, 100.0, 0.25) };
                let ends = Rounding { lowest: 0.0, highest: 4095.0 };
                for std_e in [0.4, 3.0, 40.0, 120.0, 500.0, 3000.0] {
                    for code in [-20.0, 0.3, 101.0, 2000.4, 4090.0, 4150.0] {
                        let mean_e = adc.electrons_at(code);
                        let center = adc.sample(ends.code(code));
                        let found = moments(&adc, ends, mean_e, std_e, center);
                        let expected = reference(&adc, mean_e, std_e, center);
                        for (power, (found, expected)) in (1..).zip(found.into_iter().zip(expected)) {
                            let scale = (0.25 * std_e).clamp(1.0, 4096.0).powi(power);
                            assert!((found - expected).abs() < 3e-7 * scale, "{std_e} {code}: {found} {expected}");
                        }
                    }
                }
            }
        }
    }

    /// Without a bend they are those of plain rounding.
    #[test]
    fn a_straight_curve_is_none() {
        let straight = AdcRecord::new(12, 100.0, 0.25);
        let adc = AdcRecord { linearization: Some(Linearization::polynomial(vec![1.0]).unwrap()), ..straight };
        let ends = Rounding { lowest: 0.0, highest: 4095.0 };
        for (mean_e, std_e) in [(1000.0, 0.5), (1000.0, 30.0), (16_000.0, 600.0), (-400.0, 5000.0)] {
            let found = moments(&adc, ends, mean_e, std_e, 350.0);
            let expected = ends.moments(straight.level_at(mean_e), 0.25 * std_e, 350.0);
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-8 * expected.abs().max(1.0), "{mean_e}: {found} {expected}");
            }
        }
    }
}
