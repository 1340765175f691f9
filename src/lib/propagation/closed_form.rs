//! Readings of a charge in closed form, where codes do not show, less what their ends take.
//!
//! Electrons, and codes whose rounding is a uniform error, follow the charge as a straight line does, so that their moments are those of its
//! cumulants, whatever counts and patterns it is made of. With g what is read between the ends and h what would be without,
//!
//! E g(N) = E h(N) + E \[g(N) − h(N)],
//!
//! and g − h is nothing but within reach of an end: of the normal laws that make up that of the charge ([`law`](super::law)) few have any.

use super::charge::product;
use super::counts::Charge;
use super::effort;
use super::node::Law;
use super::reading::{Moments, Reading};
use crate::metadata::{AdcRecord, PoissonKind};
use crate::numerics::normal::NearlyNormal;
use crate::numerics::rounding::REACH;

/// Standard deviations that both ends are off the mean at least: what they take is then no larger than what is left.
const WITHIN: f64 = 2.0;

/// Evaluations that cumulants take.
const OF_CUMULANTS: u64 = 4;

impl Charge {
    /// Its cumulants.
    fn cumulants(&self) -> NearlyNormal {
        let is_shot = self.shot_std() > 0.0;
        product(self.rate.max(0.0), is_shot, self.shot.unwrap_or(PoissonKind::Gaussian), self.pattern)
    }
}

impl Law {
    /// Cumulants of the charge, which full well leaves alone.
    pub(super) fn cumulants(&self) -> NearlyNormal {
        self.light.cumulants().plus(self.dark.cumulants())
    }

    /// Moments of a reading that full well leaves alone; none where codes show or are not straight, or most of what is read is at an end.
    pub(super) fn in_closed_form(&self, reading: &Reading) -> Option<Moments> {
        // Counts hide codes too, but not what the ends take from each law.
        let counts_hide = |adc: &AdcRecord| reading.noise_e == self.read_noise_e && self.counts_hide(adc);
        let [slope, variance, fourth] = reading.straight_where(counts_hide)?;
        let charge = self.cumulants();
        let [lower, upper] = reading.rails_e();
        let reach = WITHIN * (charge.variance + reading.noise_e.powi(2)).sqrt();
        if !(charge.mean - reach > lower && charge.mean + reach < upper) {
            return None;
        }
        let x = reading.smooth_at(charge.mean)[0];
        let second = slope * slope * charge.variance + variance;
        let third = slope.powi(3) * charge.third;
        let fourth = slope.powi(4) * charge.fourth + fourth + 3.0 * second * second;
        let square = x * x;
        let whole = [
            x,
            square + second,
            x * (square + 3.0 * second) + third,
            square * (square + 6.0 * second) + 4.0 * x * third + fourth,
        ];
        let ([least, most], noise_e) = (self.extent(), REACH * reading.noise_e);
        if least - noise_e > lower && most + noise_e < upper {
            effort::spend(OF_CUMULANTS);
            return Some(whole);
        }
        let taken = self.sum_of_nodes(&reading.taken()?, true);
        effort::spend(OF_CUMULANTS);
        Some([0, 1, 2, 3].map(|j| whole[j] + taken[j]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::normal::{cumulative, density};
    use crate::propagation::reading::codes_of;
    use crate::random::poisson::probability;

    const ADC: AdcRecord = AdcRecord::new(8, 4.0, 0.5);

    fn law(light_e: f64, dark_e: f64, [prnu, dcnu]: [f64; 2], read_noise_e: f64) -> Law {
        let charge = |rate: f64, pattern: f64| Charge { rate, shot: Some(PoissonKind::Exact), pattern };
        let [light, dark] = [charge(light_e, prnu), charge(dark_e, dcnu)];
        Law { light, dark, full_well_e: 1e6, read_noise_e, trap_e: 0.0, are_few: false }
    }

    /// The sum over normal laws, which is good to what it leaves out of rectification, and the closed form less what the ends take.
    #[test]
    fn closed_forms_are_the_sums_over_laws() {
        for (light_e, dark_e, patterns, read_noise_e, within) in [
            (4.0, 6.0, [0.02, 0.1], 3.0, 1e-10),
            (420.0, 9.0, [0.05, 0.1], 6.0, 1e-10),
            (0.0, 30.0, [0.0, 0.5], 8.0, 1e-7),
            (30.0, 20.0, [0.3, 0.7], 8.0, 1e-7),
        ] {
            let law = law(light_e, dark_e, patterns, read_noise_e);
            let reading = law.of_codes(&ADC, codes_of(&ADC));
            let [found, wanted] = [law.in_closed_form(&reading).unwrap(), law.sum_of_nodes(&reading, true)];
            assert!(reading.taken().is_some_and(|taken| law.sum_of_nodes(&taken, true)[0].abs() > 1e-12));
            for (j, (found, wanted)) in found.iter().zip(wanted).enumerate() {
                let scale = law.sum_of_nodes(&reading, true)[if j < 2 { 1 } else { 3 }].sqrt();
                assert!((found - wanted).abs() < within * scale.max(wanted.abs()), "{law:?} {j}: {found} {wanted}");
            }
        }
        // Most of what is read is at an end, or codes show.
        let full = law(900.0, 1.0, [0.01; 2], 6.0);
        assert!(full.in_closed_form(&full.of_codes(&ADC, codes_of(&ADC))).is_none());
        let sharp = law(2.0, 1.0, [0.01; 2], 0.3);
        assert!(sharp.in_closed_form(&sharp.of_codes(&ADC, codes_of(&ADC))).is_none());
    }

    /// Codes at the lower end by the probabilities of all counts, sensitivities and codes; Simpson's rule is good to 10⁻⁸ of its integrand but
    /// for the bend at zero, which costs the square of a step of 1/200.
    #[test]
    fn codes_beside_their_end_are_those_of_all_counts() {
        let (rate, dcnu, read_noise_e) = (30.0, 0.4, 6.0);
        let law = law(0.0, rate, [0.0, dcnu], read_noise_e);
        let reading = law.of_codes(&ADC, codes_of(&ADC));
        let found = law.in_closed_form(&reading).unwrap();
        let (mut first, mut second) = (0.0, 0.0);
        let steps = 3200;
        for step in 0..=steps {
            let z = -8.0 + f64::from(step) / 200.0;
            let simpson = if step == 0 || step == steps { 1.0 } else { 2.0 + 2.0 * f64::from(step % 2) };
            let of_z = simpson / 600.0 * density(z);
            for count in 0..90 {
                let weight = of_z * probability(f64::from(count), rate);
                if weight < 1e-12 {
                    continue;
                }
                let level = ADC.level_at(f64::from(count) * (1.0 + dcnu * z).max(0.0));
                for code in 1..120 {
                    let code = f64::from(code);
                    let beyond = weight * cumulative((level - code + 0.5) / (ADC.adu_per_e * read_noise_e));
                    first += beyond;
                    second += beyond * (2.0 * code - 1.0);
                }
            }
        }
        let mean = found[0] + reading.center;
        let square = found[1] + 2.0 * reading.center * found[0] + reading.center * reading.center;
        assert!(
            (mean / first - 1.0).abs() < 2e-6 && (square / second - 1.0).abs() < 2e-6,
            "{mean} {first} {square} {second}"
        );
    }
}
