//! Numbers of samples by value, in bins that come with the samples.

use std::collections::BTreeMap;

/// Histograms have at most so many bins at a time.
const MOST_BINS: usize = 4096;
/// The bins that a histogram begins with are this part of the range of the middle two thirds of its first samples, or of all where
/// these are the same.
const FINEST: f64 = 64.0;
/// Samples farther off are counted in this bin; doubles count no farther.
const FARTHEST_BIN: f64 = 9e15;

/// Numbers of samples in bins of one width.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Width of a bin; bin k begins at k widths, less half of one of whole numbers.
    pub width: f64,
    /// Where bins begin: −½ of whole numbers, which lie in the middle of theirs.
    pub shift: f64,
    /// Samples in each.
    pub counts: BTreeMap<i64, u64>,
    /// The lowest and the highest sample.
    pub ends: [f64; 2],
}

impl Histogram {
    /// No samples yet, codes or others.
    pub(super) fn new(is_codes: bool) -> Self {
        Self {
            width: if is_codes { 1.0 } else { 0.0 },
            shift: if is_codes { -0.5 } else { 0.0 },
            counts: BTreeMap::new(),
            ends: [f64::INFINITY, f64::NEG_INFINITY],
        }
    }

    /// Takes in finite samples; the first that differ tell the width of bins, which doubles when they become too many.
    pub(super) fn add(&mut self, samples: impl Iterator<Item = f64> + Clone) {
        let is_of_codes = self.shift != 0.0;
        // Samples that are all the same tell no width.
        if !is_of_codes && self.ends[0] >= self.ends[1] {
            self.begin_with(samples.clone());
        }
        // One sample far off makes no bins in which all others are one; many do.
        let beyond = |width: f64| samples.clone().filter(|sample| sample.abs() > FARTHEST_BIN * width).count() as u64;
        while beyond(self.width) > (self.total() + samples.clone().count() as u64) / 6 {
            *self = self.merged(2);
        }
        for sample in samples {
            self.ends = [self.ends[0].min(sample), self.ends[1].max(sample)];
            *self.counts.entry(self.bin(sample)).or_default() += 1;
            while self.counts.len() > MOST_BINS {
                *self = self.merged(2);
            }
        }
    }

    /// Sets the width by the first samples, those before being none or all the same.
    fn begin_with(&mut self, samples: impl Iterator<Item = f64>) {
        let before = (self.total(), self.ends[0]);
        let mut sorted: Vec<f64> = samples.chain((before.0 > 0).then_some(before.1)).collect();
        sorted.sort_by(f64::total_cmp);
        let ([low, .., high] | [low @ high]) = sorted.as_slice() else { return };
        // One sample far off makes no bins in which all others are one.
        let sixth = sorted.len() / 6;
        let middle = sorted[sorted.len() - 1 - sixth] - sorted[sixth];
        let spread = if middle > 0.0 { middle } else { high - low };
        // A power of two, so that halves of bins meet exactly; at least what a sample can tell.
        let largest = sorted[sixth].abs().max(sorted[sorted.len() - 1 - sixth].abs());
        let finest = (largest * f64::from(f32::EPSILON)).max(f64::from(f32::MIN_POSITIVE));
        self.width = (spread / FINEST).max(finest).log2().floor().exp2();
        self.counts.clear();
        if before.0 > 0 {
            self.counts.insert(self.bin(before.1), before.0);
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a bin that is no farther than doubles count")]
    fn bin(&self, sample: f64) -> i64 {
        (sample / self.width - self.shift).floor().clamp(-FARTHEST_BIN, FARTHEST_BIN) as i64
    }

    /// The same with bins so many times as wide.
    #[must_use]
    pub fn merged(&self, times: i64) -> Self {
        let mut counts = BTreeMap::new();
        for (bin, count) in &self.counts {
            *counts.entry(bin.div_euclid(times)).or_default() += count;
        }
        Self { width: self.width * times as f64, shift: self.shift / times as f64, counts, ends: self.ends }
    }

    /// The same of samples that are all whole numbers, each in the middle of a bin or of its part of one.
    #[must_use]
    pub fn of_whole(&self) -> Self {
        if self.shift != 0.0 || self.width <= 0.0 {
            return self.clone();
        }
        if self.width >= 1.0 {
            return Self { shift: -0.5 / self.width, ..self.clone() };
        }
        let mut counts = BTreeMap::new();
        for (bin, count) in &self.counts {
            #[expect(clippy::cast_possible_truncation, reason = "a bin that is no farther than doubles count")]
            let whole = (*bin as f64 * self.width).round() as i64;
            *counts.entry(whole).or_default() += count;
        }
        Self { width: 1.0, shift: -0.5, counts, ends: self.ends }
    }

    /// The same with bins about so many times as wide that begin with the lowest sample, so that the highest is near the end of the last.
    #[must_use]
    pub fn merged_within(&self, times: i64) -> Self {
        /// How far the width may be from that which is asked for.
        const LEAST: f64 = 0.7;
        const MOST: f64 = 1.4;
        let [Some(first), Some(last)] = [self.counts.keys().next(), self.counts.keys().next_back()] else {
            return self.clone();
        };
        let bins = last - first + 1;
        #[expect(clippy::cast_possible_truncation, reason = "a few bins; casts saturate")]
        let [least, most] = [(LEAST * times as f64).ceil() as i64, (MOST * times as f64).floor() as i64];
        let beyond = |times: &i64| (bins.div_euclid(*times) + i64::from(bins % times > 0)) * times - bins;
        let times = (least.max(1)..=most.max(1)).min_by_key(|one| (beyond(one), (one - times).abs())).unwrap_or(1);
        let mut counts = BTreeMap::new();
        for (bin, count) in &self.counts {
            *counts.entry((bin - first).div_euclid(times)).or_default() += count;
        }
        let shift = (*first as f64 + self.shift) / times as f64;
        Self { width: self.width * times as f64, shift, counts, ends: self.ends }
    }

    /// Where a bin begins.
    pub fn begin(&self, bin: i64) -> f64 {
        (bin as f64 + self.shift) * self.width
    }

    /// Samples in all bins.
    pub fn total(&self) -> u64 {
        self.counts.values().sum()
    }

    /// From where to where all samples lie but for this share of them at each end, and one where there are a few.
    pub fn middle(&self, left_out: f64) -> Option<[f64; 2]> {
        /// Of fewer samples none is left out.
        const FEW: u64 = 20;
        let total = self.total();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of the samples")]
        let beyond = ((left_out * total as f64) as u64).max(u64::from(total >= FEW));
        let reaches = |before: &mut u64, count: u64| {
            *before += count;
            *before > beyond
        };
        let (mut below, mut above) = (0, 0);
        let first = self.counts.iter().find(|(_, count)| reaches(&mut below, **count))?.0;
        let last = self.counts.iter().rev().find(|(_, count)| reaches(&mut above, **count))?.0;
        Some([self.begin(*first), self.begin(last + 1)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn histogram(samples: &[f64]) -> Histogram {
        let mut histogram = Histogram::new(false);
        histogram.add(samples.iter().copied());
        histogram
    }

    /// The middle of 0, 1 … 999, less 5 at each end, with a far sample or without; of few samples all.
    /// Every code of eight bits once makes the same count in all bins, from first to last, whatever their number; so do its multiples.
    #[test]
    fn whole_numbers_fill_bins_evenly() {
        for (is_codes, step) in [(true, 1.0), (false, 1.0), (false, 64.0)] {
            let mut ramp = Histogram::new(is_codes);
            ramp.add((0..256).map(|code| step * f64::from(code)));
            let ramp = ramp.of_whole();
            for times in [1, 3, 7, 9, 10, 26] {
                let merged = ramp.merged_within(times * if step > 1.0 { 16 } else { 1 });
                let density = |bin: &i64, count: &u64| {
                    let end = merged.begin(bin + 1).min(merged.ends[1] + 0.5 * step);
                    *count as f64 / (end - merged.begin(*bin))
                };
                let seen: Vec<f64> = merged.counts.iter().map(|(bin, count)| density(bin, count)).collect();
                assert!(
                    seen.iter().all(|one| (one * step - 1.0).abs() < 1e-9 || step > 1.0),
                    "{is_codes} {times}: {seen:?}"
                );
                assert!(merged.begin(0) <= 0.0 && merged.width.fract() == 0.0, "{times}: {}", merged.width);
                assert_eq!(merged.total(), 256);
            }
        }
    }

    #[test]
    fn the_middle_leaves_out_what_is_far_and_bins_stay_fine() {
        let mut samples: Vec<f64> = (0..1000).map(f64::from).collect();
        for far in [0.0, -1e30, 1e30] {
            samples[0] = far;
            let histogram = histogram(&samples);
            assert!(histogram.width <= 16.0, "{}", histogram.width);
            let [low, high] = histogram.middle(0.005).unwrap();
            assert!((5.0 - low).abs() <= 1.0 + histogram.width && (994.0 - high).abs() <= 1.0 + histogram.width);
            assert_eq!(histogram.ends, [far.min(1.0), far.max(999.0)]);
        }
        // Rows that are all the same, or next to it, come first.
        for first in [vec![0.0; 40], vec![3.0; 40], [vec![0.0; 39], vec![1e-30]].concat(), vec![1e-35, 2e-35, 3e-35]] {
            let mut late = histogram(&first);
            late.add(samples[1..999].iter().copied());
            assert!(late.width <= 16.0 && late.counts.len() > 60, "{first:?}: {} {}", late.width, late.counts.len());
            assert_eq!(late.total(), first.len() as u64 + 998);
            let [_, high] = late.middle(0.005).unwrap();
            assert!((993.0 - high).abs() <= 2.0 + late.width, "{first:?}: {high}");
        }
        let few = histogram(&[1.0, 2.0, 3.0, 100.0]);
        let [low, high] = few.middle(0.005).unwrap();
        assert!(low <= 1.0 && high >= 100.0);
        assert_eq!(histogram(&[]).middle(0.005), None);
    }
}
