//! What codes that are cut off at 0 are too high by on average.

use super::normal::cumulative;
use statrs::function::erf::erfc_inv;

/// How many codes are 0, and how many 0 or 1, of how many.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AtZero {
    /// Codes.
    pub count: f64,
    /// Those that are 0.
    pub zeros: f64,
    /// Those that are 1.
    pub ones: f64,
}

impl AtZero {
    /// The same and others.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let Self { count, zeros, ones } = other;
        Self { count: self.count + count, zeros: self.zeros + zeros, ones: self.ones + ones }
    }

    /// The share that is 0.
    pub fn share(&self) -> f64 {
        if self.count > 0.0 { self.zeros / self.count } else { 0.0 }
    }

    /// Mean and standard deviation of the normal law of such codes, as shares of codes below ½ and 1½ tell them; none where too few codes are
    /// 0 or 1, or nearly all.
    pub fn law(&self) -> Option<[f64; 2]> {
        /// Numbers of ones, and of codes above, that tell a standard deviation to a tenth.
        const LEAST: f64 = 100.0;
        let others = self.count - self.zeros - self.ones;
        if self.zeros < LEAST || self.ones < LEAST || others < LEAST {
            return None;
        }
        let z = |many: f64| -std::f64::consts::SQRT_2 * erfc_inv(2.0 * many / self.count);
        let below = z(self.zeros);
        let std = 1.0 / (z(self.zeros + self.ones) - below);
        Some([0.5 - std * below, std])
    }

    /// By how much the mean is too high, of rounded numbers of a normal law, as shares of codes below ½ and 1½ tell its mean and standard
    /// deviation; of averages that keep such a share of the variance of a code, and are cut off as a code is.
    ///
    /// μ = ½ − σ z₀,  σ = 1/(z₁ − z₀);  E\[max(y, 0)] − μ = Σ Φ((−½ − j − μ)/σ) over j = 0, 1 …
    ///
    /// None where too few codes are 0 or 1, or nearly all.
    ///
    /// # Examples
    ///
    /// ```
    /// // Of normal numbers of mean 0 and standard deviation 1.5 these shares are rounded to 0 or less, and to 1.
    /// let codes = cyanometer::numerics::cut_off::AtZero { count: 1e6, zeros: 630_559.0, ones: 210_786.0 };
    /// // E max(x, 0) = σ/√(2π) = 0.598 before rounding, and σ²/24 of the density at 0 less by it.
    /// assert!((codes.excess(1.0).unwrap() - 0.598).abs() < 0.012);
    /// ```
    pub fn excess(&self, kept: f64) -> Option<f64> {
        let [mean, std] = self.law()?;
        let std = std * kept.sqrt();
        let of = |step: u32| cumulative((-0.5 - f64::from(step) - mean) / std);
        // Beyond 9 standard deviations there is nothing, and what scatters over more codes is an integral.
        let steps = (0..100_000).map(of).take_while(|share| *share > 1e-15);
        (std < 1e4).then(|| steps.sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The excess over codes k ≥ 1 of their probabilities, and shares, by sums apart from those above.
    #[test]
    fn the_excess_is_that_of_codes_summed_one_by_one() {
        for (mean, std) in [(0.0, 1.5), (2.0, 1.5), (-1.0, 2.0), (5.0, 8.0), (0.3, 0.6), (30.0, 15.0)] {
            let reached = |code: f64| cumulative((mean - code + 0.5) / std);
            let expected: f64 = (1..400).map(|code| reached(f64::from(code))).sum::<f64>() - mean;
            // Rounding moves the mean of what scatters over little, which is no excess.
            let rounded: f64 =
                (-400..400).map(|k| f64::from(k) * (reached(f64::from(k)) - reached(f64::from(k) + 1.0))).sum();
            let (zero, one) = (1.0 - reached(1.0), reached(1.0) - reached(2.0));
            let codes = AtZero { count: 1e9, zeros: 1e9 * zero, ones: 1e9 * one };
            let found = codes.excess(1.0).unwrap();
            assert!((found - expected - (mean - rounded)).abs() < 1e-6, "{mean} {std}: {found} {expected}");
        }
        // Of the median of many there is less below 0, and nothing is told of codes all of which are 0.
        let codes = AtZero { count: 1e4, zeros: 2000.0, ones: 1500.0 };
        assert!(codes.excess(0.3).unwrap() < 0.3 * codes.excess(1.0).unwrap());
        assert_eq!(AtZero { count: 1e4, zeros: 1e4, ones: 0.0 }.excess(1.0), None);
    }
}
