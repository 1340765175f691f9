//! Moments of the codes of a converter that is not straight, or of these made straight.

use super::effort;
use crate::metadata::AdcRecord;
use crate::numerics::gauss::panel;
use crate::numerics::normal::cumulative;
use crate::numerics::rounding::{REACH, Rounding};

/// Codes up to which they are gone through one by one.
const ONE_BY_ONE: f64 = 400.0;
/// Widest panel of an integral over codes, in standard deviations.
const WIDEST: f64 = 1.5;
/// Step of a derivative, in standard deviations.
const STEP: f64 = 0.1;

/// Moments 1 to 4 about `center` of the samples of a normal charge, in e⁻, that is read as codes between `ends`.
///
/// Σ over the edges t between codes of \[g(t + ½) − g(t − ½)] T(t), with g the powers of a code's sample and T the probability
/// of a charge beyond the edge. Many codes are an integral, less \[(D T)′]/24 − 7 \[(D T)‴]/5760 at its ends, by Euler and Maclaurin. Good to
/// 3·10⁻⁷ of the charge's own moments.
pub(super) fn moments(adc: &AdcRecord, ends: Rounding, mean_e: f64, std_e: f64, center: f64) -> [f64; 4] {
    let powers = |code: f64| {
        let x = adc.sample(code) - center;
        [x, x * x, x * x * x, x * x * x * x]
    };
    let code_of = |electrons: f64| ends.code(adc.level_at(electrons));
    if std_e <= 0.0 {
        return powers(code_of(mean_e));
    }
    let reach = REACH * std_e;
    let (first, last) = (code_of(mean_e - reach), code_of(mean_e + reach));
    let mut moments = powers(first);
    let beyond = |edge: f64| cumulative((mean_e - adc.electrons_at(edge)) / std_e);
    let mut add = |weight: f64, above: [f64; 4], below: [f64; 4]| {
        for ((moment, above), below) in moments.iter_mut().zip(above).zip(below) {
            *moment += weight * (above - below);
        }
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "codes, from 0 on")]
    effort::spend((last - first).min(ONE_BY_ONE) as u64);
    if last - first <= ONE_BY_ONE {
        let mut code = first;
        while code < last {
            add(beyond(code + 0.5), powers(code + 1.0), powers(code));
            code += 1.0;
        }
        return moments;
    }
    let sigma = (adc.level_at(mean_e + reach) - adc.level_at(mean_e - reach)) / (2.0 * REACH);
    let panels = ((last - first) / (WIDEST * sigma)).ceil();
    let width = (last - first) / panels;
    let mut index = 0.0;
    while index < panels {
        for (edge, weight) in panel(first + index * width, first + (index + 1.0) * width) {
            add(weight * beyond(edge), powers(edge + 0.5), powers(edge - 0.5));
        }
        index += 1.0;
    }
    // First and third derivatives by differences.
    let step = STEP * sigma;
    let [first_factor, third_factor] = [1.0 / (24.0 * 12.0 * step), 7.0 / (5760.0 * 2.0 * step.powi(3))];
    for (end, sign) in [(last, 1.0), (first, -1.0)] {
        for (steps, of_first, of_third) in [(1.0, 8.0, -2.0), (2.0, -1.0, 1.0)] {
            let factor = sign * (third_factor * of_third - first_factor * of_first);
            for (edge, side) in [(end + steps * step, 1.0), (end - steps * step, -1.0)] {
                add(side * factor * beyond(edge), powers(edge + 0.5), powers(edge - 0.5));
            }
        }
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::linearity::Linearization;
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
        for curve in [vec![1.0, 4e-6], vec![1.05, -3e-6, 1e-10], vec![1.0]] {
            let linearization = Some(Linearization::polynomial(curve).unwrap());
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
