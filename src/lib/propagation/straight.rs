//! What full well takes from a normal law whose reading is straight there, in closed form.
//!
//! A straight reading is a slope times the charge and an error whose law is the same for all charges. What it has at a charge beyond
//! full well above what it has there is then a polynomial in the distance, and the integral of that is one of the partial moments
//!
//! I_k = ∫_z^∞ (x − z)ᵏ φ(x) dx,   I_0 = Φ(−z),   I_1 = φ(z) − z I_0,   I_k = (k − 1) I_{k−2} − z I_{k−1}
//!
//! of the law.

use super::node::Node;
use super::reading::{Moments, Reading};
use crate::numerics::normal::{cumulative, density};

/// A reading that is straight from full well as far as laws reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct Straight {
    full: f64,
    /// Units to an electron, and the variance of the error.
    slope: f64,
    variance: f64,
    /// The mean at full well, from the center of the reading.
    at_full: f64,
}

impl Straight {
    /// That of a reading from `full` to `end`; none where codes show, are not straight, or end.
    pub fn of(reading: &Reading, full: f64, end: f64) -> Option<Self> {
        let (slope, variance) = reading.straight_between(full.min(end), full.max(end))?;
        let [at_full, ..] = reading.smooth_at(full);
        Some(Self { full, slope, variance, at_full })
    }

    /// The integral over a normal law beyond full well (`direction` 1), or below it (−1), of what is read there less what is read at
    /// full well.
    pub fn beyond(&self, node: &Node, direction: f64) -> Moments {
        let z = direction * (self.full - node.mean) / node.std;
        let none = cumulative(-z);
        let first = density(z) - z * none;
        let second = none - z * first;
        let third = 2.0 * first - z * second;
        let fourth = 3.0 * second - z * third;
        let unit = direction * node.std * self.slope;
        let [d1, d2, d3, d4] = [unit * first, unit.powi(2) * second, unit.powi(3) * third, unit.powi(4) * fourth];
        let (m, v) = (self.at_full, self.variance);
        [
            d1,
            2.0 * m * d1 + d2,
            3.0 * (m * m + v) * d1 + 3.0 * m * d2 + d3,
            4.0 * (m * m + 3.0 * v) * m * d1 + 6.0 * (m * m + v) * d2 + 4.0 * m * d3 + d4,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::AdcRecord;
    use crate::numerics::gauss::panel;
    use crate::propagation::reading::codes_of;

    const ADC: AdcRecord = AdcRecord {
        bits: 12,
        bias_adu: 100.0,
        adu_per_e: 0.5,
        linearization: None,
        is_linearized: false,
        white_adu: None,
    };

    /// Against quadrature of the readings themselves, of electrons and of codes, on both sides.
    #[test]
    fn straight_readings_are_integrated() {
        let readings = [Reading::electrons(7.0, 900.0), Reading::codes(ADC, codes_of(&ADC), 7.0, 900.0)];
        let full = 1000.0;
        for reading in readings {
            for (mean, std, direction) in
                [(980.0, 40.0, 1.0), (1000.0, 5.0, 1.0), (1060.0, 30.0, -1.0), (700.0, 45.0, 1.0)]
            {
                let node = Node { mean, std, weight: 1.0, floor: f64::NEG_INFINITY };
                let end = full + direction * 9.0 * std;
                let found = Straight::of(&reading, full, end).unwrap().beyond(&node, direction);
                let mut sum = [0.0; 4];
                for step in 0..18 {
                    let [near, far] = [step, step + 1].map(|step| 0.5 * std * f64::from(step));
                    for (distance, weight) in panel(near, far) {
                        let charge = full + direction * distance;
                        let (at, at_full) = (reading.at(charge, 0.0), reading.at(full, 0.0));
                        let share = weight * density((charge - mean) / std) / std;
                        (0..4).for_each(|j| sum[j] += share * (at[j] - at_full[j]));
                    }
                }
                for j in 0..4 {
                    let scale = (reading.at(full, std * std)[j]).abs().max(1e-30);
                    assert!((found[j] - sum[j]).abs() < 1e-12 * scale, "{j}: {} {}", found[j], sum[j]);
                }
            }
        }
    }

    #[test]
    fn what_ends_or_shows_is_not_straight() {
        let of = |noise_e: f64, full: f64, end: f64| {
            Straight::of(&Reading::codes(ADC, codes_of(&ADC), noise_e, 900.0), full, end).is_some()
        };
        assert!(of(7.0, 1000.0, 1300.0));
        // Codes of two electrons show; the highest is that of 7990 electrons, the lowest of -200.
        assert!(!of(0.5, 1000.0, 1300.0) && !of(7.0, 1000.0, 7950.0) && !of(7.0, 1000.0, -150.0));
    }
}
