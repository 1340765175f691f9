//! Distributions of numbers that stream by: extremes, mean, quantiles, shares.

use serde::{Deserialize, Serialize};

/// So many numbers are kept as they are; beyond, they are counted in buckets.
const KEPT: usize = 1 << 20;
/// Bits of the mantissa that tell buckets apart: 4096 to a factor of two.
const MANTISSA_BITS: u32 = 12;
/// Exponents of the smallest and of the largest number that has a bucket of its own.
const EXPONENTS: [i32; 2] = [-24, 16];

/// Non-negative numbers, seen one after another in bounded memory.
///
/// Up to 2²⁰ of them every quantile is exact. Beyond, numbers are counted in buckets that are 2⁻¹² of a number wide, so
/// a quantile is within 2⁻¹³ (0.012 %) of the true one; minimum, maximum and mean stay exact.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Distribution {
    kept: Vec<f64>,
    buckets: Vec<u64>,
    count: u64,
    not_finite: u64,
    sum: f64,
    min: f64,
    max: f64,
}

/// What is said of a distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Smallest number.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Half of the numbers are below.
    pub median: f64,
    /// 95 % of the numbers are below.
    pub p95: f64,
    /// Largest number.
    pub max: f64,
}

impl Distribution {
    /// The distribution of `numbers`.
    pub fn of(numbers: impl IntoIterator<Item = f64>) -> Self {
        let mut made = Self::default();
        made.add(numbers);
        made
    }

    /// Takes in numbers; what is NaN or infinite is counted and left out.
    pub fn add(&mut self, numbers: impl IntoIterator<Item = f64>) {
        // A sum of its own for each row keeps the error of the sum from growing with the number of rows' elements.
        let mut sum = 0.0;
        for number in numbers {
            if !number.is_finite() {
                self.not_finite += 1;
                continue;
            }
            let is_first = self.count == 0;
            self.min = if is_first { number } else { self.min.min(number) };
            self.max = if is_first { number } else { self.max.max(number) };
            self.count += 1;
            sum += number;
            if self.buckets.is_empty() {
                self.kept.push(number);
                if self.kept.len() > KEPT {
                    self.fold();
                }
            } else {
                self.buckets[bucket(number)] += 1;
            }
        }
        self.sum += sum;
    }

    /// Moves the numbers that were kept into buckets.
    fn fold(&mut self) {
        self.buckets = vec![0; bucket(f64::INFINITY) + 1];
        for number in std::mem::take(&mut self.kept) {
            self.buckets[bucket(number)] += 1;
        }
    }

    /// Finite numbers seen.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Numbers left out because they are NaN or infinite.
    pub fn not_finite(&self) -> u64 {
        self.not_finite
    }

    /// Extremes, mean and quantiles; none of no numbers.
    pub fn summary(&self) -> Option<Summary> {
        if self.count == 0 {
            return None;
        }
        let mut sorted = self.kept.clone();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| self.quantile(&sorted, share).clamp(self.min, self.max);
        Some(Summary {
            min: self.min,
            mean: self.sum / self.count as f64,
            median: quantile(0.5),
            p95: quantile(0.95),
            max: self.max,
        })
    }

    /// Share of the numbers that are below `limit`, which beyond 2²⁰ numbers is moved to the edge of its bucket.
    pub fn share_below(&self, limit: f64) -> f64 {
        let below = if self.buckets.is_empty() {
            self.kept.iter().filter(|&&number| number < limit).count() as u64
        } else {
            self.buckets[..bucket(limit)].iter().sum()
        };
        below as f64 / self.count.max(1) as f64
    }

    /// The number with `share` of all below it, linear between neighbors: type 7 of \[Hyndman1996].
    fn quantile(&self, sorted: &[f64], share: f64) -> f64 {
        let rank = share * (self.count - 1) as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 0, below the count")]
        let below = rank.floor() as u64;
        let number = |rank: u64| match usize::try_from(rank) {
            Ok(index) if self.buckets.is_empty() => sorted[index],
            _ => self.in_bucket(rank),
        };
        let (low, high) = (number(below), number((below + 1).min(self.count - 1)));
        low + (rank - below as f64) * (high - low)
    }

    /// The middle of the bucket of the number that has `rank` others below it.
    fn in_bucket(&self, rank: u64) -> f64 {
        let mut seen = 0;
        let found = self.buckets.iter().position(|&count| {
            seen += count;
            seen > rank
        });
        let place = found.unwrap_or(self.buckets.len() - 1);
        if place == 0 { 0.0 } else { 0.5 * (edge(place) + edge(place + 1)) }
    }
}

/// The bucket of a number: the first holds what is too small for one of its own, the last what is too large.
fn bucket(number: f64) -> usize {
    let place = |number: f64| number.to_bits() >> (f64::MANTISSA_DIGITS - 1 - MANTISSA_BITS);
    let [lowest, highest] = EXPONENTS.map(|exponent| f64::from(exponent).exp2());
    let first = place(lowest);
    if number < lowest {
        return 0;
    }
    usize::try_from(place(number.min(highest)) - first + 1).unwrap_or(usize::MAX)
}

/// The smallest number of a bucket.
fn edge(place: usize) -> f64 {
    let first = f64::from(EXPONENTS[0]).exp2().to_bits() >> (f64::MANTISSA_DIGITS - 1 - MANTISSA_BITS);
    f64::from_bits((first + place as u64 - 1) << (f64::MANTISSA_DIGITS - 1 - MANTISSA_BITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_sorted_numbers() {
        let summary = Distribution::of([4.0, 1.0, 2.0, 8.0, f64::NAN]).summary().unwrap();
        // Ranks 1.5 and 2.85 of 1, 2, 4, 8.
        assert_eq!((summary.min, summary.mean, summary.median, summary.max), (1.0, 3.75, 3.0, 8.0));
        assert!((summary.p95 - (4.0 + 0.85 * 4.0)).abs() < 1e-12);
        assert_eq!(Distribution::of([4.0, 1.0, 2.0, 8.0]).share_below(4.0), 0.5);
        assert_eq!(Distribution::default().summary(), None);
    }

    #[test]
    fn buckets_find_quantiles_within_their_width() {
        let count = 2 * KEPT;
        // x² of an even grid on 0…3: quantile q is 9 q².
        let number = |i: usize| (3.0 * i as f64 / (count - 1) as f64).powi(2);
        let mut distribution = Distribution::default();
        for row in 0..1024 {
            distribution.add((0..count / 1024).map(|i| number(row + 1024 * i)));
        }
        let summary = distribution.summary().unwrap();
        for (found, share) in [(summary.median, 0.5_f64), (summary.p95, 0.95)] {
            let truth = 9.0 * share * share;
            // Half a bucket, and what the grid's own steps are coarse by.
            assert!((found / truth - 1.0).abs() < 2f64.powi(-13) + 2e-6, "{found} {truth}");
        }
        assert!((summary.mean - 3.0).abs() < 1e-5 && summary.max == 9.0 && summary.min == 0.0);
        assert!((distribution.share_below(2.25) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn buckets_begin_where_they_say() {
        for number in [1e-7, 0.3, 1.0, 77.7, 65_000.0] {
            let place = bucket(number);
            assert!(edge(place) <= number && number < edge(place + 1), "{number}");
            assert!(edge(place + 1) / edge(place) <= 1.0 + 2f64.powi(-12));
        }
        assert_eq!(bucket(0.0), 0);
        assert_eq!(bucket(f64::INFINITY), bucket(65_536.0));
    }
}
