//! Averages of repeated samples, and how much noise each keeps: the mean, the median, and the mean of what clipping leaves.
//!
//! Of independent normal samples the mean has 1/N of their variance. The difference of any other average from the mean hangs
//! on the scatter of the samples alone and is independent of their mean \[Basu1955], so that its variance adds.

use super::gauss::panel;
use super::normal::{cumulative, density};
use crate::frame::to_sample;
use crate::names::{Named, serde_by_name};
use crate::random::{Run, RunWords, Source};
use std::cmp::Ordering;
use std::f64::consts::FRAC_PI_2;

/// How repeated samples are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combine {
    /// Their mean.
    #[default]
    Mean,
    /// Their median; of an even number the mean of the two in the middle.
    Median,
    /// The mean of those that lie within some standard deviations of the median, or at that limit, again and again until none is
    /// left out.
    Clipped,
}

impl Named for Combine {
    const ALL: &'static [Self] = &[Self::Mean, Self::Median, Self::Clipped];

    fn name(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Median => "median",
            Self::Clipped => "clipped",
        }
    }
}

serde_by_name!(Combine);

/// Standard deviations beyond which samples are clipped unless another number is given.
pub const CLIP: f64 = 3.0;

/// The limit beside which a sample still lies at it: codes may lie there exactly, and the standard deviation is rounded.
const AT_LIMIT: f64 = 1.0 + 1e-12;

/// What is left of the noise of samples in their average.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept {
    /// Variance of the average to that of a sample, for normal samples.
    pub variance: f64,
    /// The share of the variance of rounding, where samples are rounded and scatter over a few codes.
    pub rounding: f64,
    /// Mean square of the samples that count, in their variance, less 1. Skewness moves the average by κ₃/6κ₂ times this:
    /// Cornish and Fisher's x = z + γ/6 (z² − 1).
    pub lean: f64,
}

impl Kept {
    /// What the mean of so many samples keeps.
    pub fn of_mean(count: u32) -> Self {
        let share = 1.0 / f64::from(count.max(1));
        Self { variance: share, rounding: share, lean: 0.0 }
    }

    /// What an average of so many samples keeps, whose standard deviation in codes is `std_codes`; those that are clipped lie
    /// beyond `clip` standard deviations.
    pub fn of(combine: Combine, count: u32, clip: f64, std_codes: f64) -> Self {
        match combine {
            Combine::Mean => Self::of_mean(count),
            _ if count < 3 => Self::of_mean(count),
            Combine::Median => Self::of_median(count, std_codes),
            Combine::Clipped => Self::of_clipped(count, clip, std_codes),
        }
    }

    /// Odd numbers: ∫ z² f, f the density of the sample in the middle; the median of rounded samples is the rounded median.
    /// Even numbers: the same integral over both in the middle; their roundings share what the distance of the two, in
    /// codes, does not tell apart: r = 1 − 3 ⟨{d} (1 − {d})⟩.
    fn of_median(count: u32, std_codes: f64) -> Self {
        let n = f64::from(count);
        let below = ((n - 1.0) / 2.0).floor();
        // No sample of the middle lies so far out.
        let reach = (12.0 / n.sqrt()).min(9.0);
        let ends: Vec<f64> = (0..=12).map(|i| reach * (f64::from(i) / 6.0 - 1.0)).collect();
        let places: Vec<(f64, f64)> = ends.windows(2).flat_map(|ends| panel(ends[0], ends[1])).collect();
        let power = |share: f64| if share > 0.0 { (below * share.ln()).exp() } else { 0.0 };
        let (mut weight, mut square, mut apart) = (0.0, 0.0, 0.0);
        if count % 2 == 1 {
            for (z, width) in places {
                let tails = below * ((4.0 * cumulative(z) * cumulative(-z)).max(f64::MIN_POSITIVE)).ln();
                let share = width * density(z) * tails.exp();
                weight += share;
                square += share * z * z;
            }
            let variance = square / weight;
            return Self { variance, rounding: 1.0, lean: variance - 1.0 };
        }
        let mut own = 0.0;
        for &(low, width) in &places {
            // The distance to the next falls off as an exponential whose scale is that of one sample among n.
            let scale = 1.0 / (n * density(low).max(1e-12));
            let farthest = (40.0 * scale).min(2.0 * reach + 1.0);
            let steps = 8_u32;
            let inner = (0..steps).flat_map(|i| {
                let end = |i: u32| farthest * (f64::from(i) / f64::from(steps)).powi(2);
                panel(end(i), end(i + 1))
            });
            for (distance, step) in inner {
                let high = low + distance;
                let share = width
                    * step
                    * density(low)
                    * density(high)
                    * power(2.0 * cumulative(low))
                    * power(2.0 * cumulative(-high));
                let fraction = (distance * std_codes).rem_euclid(1.0);
                weight += share;
                square += share * (0.5 * (low + high)).powi(2);
                own += share * 0.5 * (low * low + high * high);
                apart += share * fraction * (1.0 - fraction);
            }
        }
        Self { variance: square / weight, rounding: 1.0 - 3.0 * apart / weight, lean: own / weight - 1.0 }
    }

    /// By the variance of its difference from the mean in normal samples that are drawn here and rounded, always the same: it is a
    /// small part of the whole, and known to a few hundredths of itself. Where samples are codes, clipping comes to its end
    /// sooner than where they are not.
    fn of_clipped(count: u32, clip: f64, std_codes: f64) -> Self {
        let n = f64::from(count);
        // One sample far from all others is √N standard deviations from their median, and none can be farther.
        if clip >= n.sqrt() {
            return Self::of_mean(count);
        }
        let trials = (400_000 / count.max(1)).clamp(400, 8000);
        let mut samples = vec![0.0_f32; count as usize];
        let (mut square, mut kept_square, mut kept) = (0.0, 0.0, 0.0);
        for trial in 0..trials {
            draw(trial, &mut samples);
            let phase = phase(trial);
            for sample in &mut samples {
                *sample = to_sample((f64::from(*sample) * std_codes + phase).round());
            }
            let mean = samples.iter().map(|code| f64::from(*code)).sum::<f64>() / n;
            let (average, which) = clipped(&mut samples, clip);
            let left = &samples[which];
            square += (average - mean).powi(2);
            kept_square += left.iter().map(|code| (f64::from(*code) - phase).powi(2)).sum::<f64>();
            kept += left.len() as f64;
        }
        let rounded = std_codes * std_codes + 1.0 / 12.0;
        let variance = 1.0 / n + square / f64::from(trials) / rounded;
        Self { variance, rounding: variance, lean: kept_square / kept / rounded - 1.0 }
    }
}

/// Where in a code the mean of a trial lies: each place as often as any other.
fn phase(trial: u32) -> f64 {
    (f64::from(trial) * 0.618_033_988_749_895).fract()
}

/// Whether what clipping leaves of so many samples hangs on where in a code their mean lies: the limits, which the median and
/// the standard deviation of the samples make, scatter over less than 0.6 of a code.
pub fn is_clipped_by_code(count: u32, clip: f64, std_codes: f64) -> bool {
    let n = f64::from(count);
    clip < n.sqrt() && std_codes * ((0.5 * clip * clip + FRAC_PI_2) / n).sqrt() < 0.6
}

/// Fills `samples` with normal numbers, each trial with its own.
pub(super) fn draw(trial: u32, samples: &mut [f32]) {
    let mut words = RunWords::default();
    let mut column = 0_i32;
    for chunk in samples.chunks_mut(128) {
        let run = Run {
            seed: 0x00c1_1bbe_d000,
            sensor_seed: 0,
            frame: trial,
            place: [column, 0],
            classes: [0; 2],
            length: 128,
        };
        let mut normals = [0.0; 128];
        run.make_temporal(&mut words);
        run.normals(&words, Source::Ron, &mut normals);
        chunk.copy_from_slice(&normals[..chunk.len()]);
        column += 128;
    }
}

/// The average of samples, whose order is lost; those that are no number lead to no number. Gives how many were clipped too.
///
/// # Examples
///
/// ```
/// use cyanometer::numerics::averages::{Combine, average};
///
/// let mut samples = [5.0, 4.0, 90.0, 5.0];
/// assert_eq!(average(Combine::Mean, &mut samples, 3.0), (26.0, 0));
/// assert_eq!(average(Combine::Median, &mut samples, 3.0), (5.0, 0));
/// // 90 lies 1.99 standard deviations from the median; of what is left, 4 lies 1.73 off.
/// assert_eq!(average(Combine::Clipped, &mut samples, 1.9), (14.0 / 3.0, 1));
/// ```
pub fn average(combine: Combine, samples: &mut [f32], clip: f64) -> (f64, u64) {
    let mean = |samples: &[f32]| samples.iter().map(|sample| f64::from(*sample)).sum::<f64>() / samples.len() as f64;
    if combine == Combine::Mean || samples.iter().any(|sample| !sample.is_finite()) {
        return (mean(samples), 0);
    }
    if combine == Combine::Median {
        samples.sort_unstable_by(f32::total_cmp);
        return (middle(samples), 0);
    }
    let all = samples.len();
    let (average, kept) = clipped(samples, clip);
    (average, (all - kept.len()) as u64)
}

/// The variance of what clipping leaves of samples, whose order is lost.
pub fn clipped_variance(samples: &mut [f32], clip: f64) -> f64 {
    let (mean, kept) = clipped(samples, clip);
    let left = &samples[kept];
    let degrees = left.len().saturating_sub(1).max(1) as f64;
    left.iter().map(|sample| (f64::from(*sample) - mean).powi(2)).sum::<f64>() / degrees
}

/// The middle of sorted samples.
fn middle(sorted: &[f32]) -> f64 {
    let half = sorted.len() / 2;
    match sorted.len() % 2 {
        _ if sorted.is_empty() => f64::NAN,
        1 => f64::from(sorted[half]),
        _ => 0.5 * (f64::from(sorted[half - 1]) + f64::from(sorted[half])),
    }
}

/// Sorts samples; the mean of those that clipping leaves, and which these are.
pub(super) fn clipped(samples: &mut [f32], clip: f64) -> (f64, std::ops::Range<usize>) {
    samples.sort_unstable_by(f32::total_cmp);
    let mut kept = 0..samples.len();
    loop {
        let left = &samples[kept.clone()];
        let n = left.len() as f64;
        let mean = left.iter().map(|sample| f64::from(*sample)).sum::<f64>() / n;
        if left.len() < 3 {
            return (mean, kept);
        }
        let variance = left.iter().map(|sample| (f64::from(*sample) - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let (center, reach) = (middle(left), clip * variance.sqrt() * AT_LIMIT);
        let is_near = |sample: f32| (f64::from(sample) - center).abs() <= reach;
        let first = left.iter().position(|sample| is_near(*sample));
        let last = left.iter().rposition(|sample| is_near(*sample));
        let (Some(first), Some(last)) = (first, last) else { return (mean, kept) };
        let next = kept.start + first..kept.start + last + 1;
        if next.len().cmp(&kept.len()) != Ordering::Less {
            return (mean, kept);
        }
        kept = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variances of the medians of 3, 4, 5 and 10 normal samples: Arnold, Balakrishnan and Nagaraja, A First Course in Order
    /// Statistics, Table 4.9.2 (σ² of the middle one 0.4487, 0.2868; covariances for even numbers); and π/2n of many.
    #[test]
    fn medians_have_their_tabulated_variances() {
        for (count, variance) in [(3, 0.448_671), (5, 0.286_834), (7, 0.210_447), (4, 0.298_157), (6, 0.214_737)] {
            let found = Kept::of(Combine::Median, count, 3.0, 1.0).variance;
            assert!((found / variance - 1.0).abs() < 1e-3, "{count}: {found}");
        }
        for count in [2001, 2000] {
            let found = Kept::of(Combine::Median, count, 3.0, 1.0).variance * f64::from(count);
            assert!((found / FRAC_PI_2 - 1.0).abs() < 1e-3, "{found}");
        }
    }

    /// What is predicted, against normal samples of another seed, rounded to codes: variance, and rounding's part of it.
    #[test]
    fn averages_keep_what_they_should() {
        let trials = 20_000_u32;
        for (combine, count, clip, std) in [
            (Combine::Median, 4, 3.0, 1.0),
            (Combine::Median, 9, 3.0, 2.5),
            (Combine::Median, 10, 3.0, 2.5),
            (Combine::Median, 30, 3.0, 5.0),
            (Combine::Clipped, 5, 1.5, 40.0),
            (Combine::Clipped, 12, 2.0, 40.0),
            (Combine::Clipped, 25, 3.0, 40.0),
            (Combine::Clipped, 30, 1.0, 2.5),
            (Combine::Clipped, 5, 1.0, 1.0),
            (Combine::Clipped, 30, 2.0, 2.5),
        ] {
            let mut samples = vec![0.0; count as usize];
            let (mut sum, mut square) = (0.0, 0.0);
            for trial in 0..trials {
                draw(trial + 100_000, &mut samples);
                let phase = phase(trial);
                for sample in &mut samples {
                    *sample = to_sample((f64::from(*sample) * std + phase).round());
                }
                let off = average(combine, &mut samples, clip).0 - phase;
                sum += off;
                square += off * off;
            }
            let n = f64::from(trials);
            let variance = (square - sum * sum / n) / (n - 1.0);
            let kept = Kept::of(combine, count, clip, std);
            let expected = kept.variance * std * std + kept.rounding / 12.0;
            // 4 standard errors of a variance, and what is drawn in working the clipped mean out.
            let tolerance = 4.0 * (2.0 / n).sqrt() + if combine == Combine::Clipped { 0.02 } else { 0.0 };
            assert!((variance / expected - 1.0).abs() < tolerance, "{combine:?} {count}: {variance} {expected}");
        }
    }

    #[test]
    fn clipping_goes_on_until_nothing_is_left_out() {
        let mut samples = [1.0, 2.0, 3.0, 2.0, 1.0, 3.0, 2.0, 2.0, 2.0, 60.0, 900.0];
        assert_eq!(average(Combine::Clipped, &mut samples, 2.5), (2.0, 2));
        assert!(average(Combine::Clipped, &mut [1.0, f32::NAN, 2.0], 2.5).0.is_nan());
        assert_eq!(average(Combine::Clipped, &mut [7.0; 5], 2.5), (7.0, 0));
    }

    /// Six codes and three of the next have s = ½ exactly, so that two standard deviations reach the next code, wherever the codes
    /// lie: mean 129⅓, squares 6/9 + 3·4/9 = 2, over 8.
    #[test]
    fn what_lies_at_the_limit_stays() {
        for low in [0_u16, 1, 3, 129, 130, 4095, 65_000] {
            let mut samples = [f32::from(low); 9];
            samples[..3].fill(f32::from(low) + 1.0);
            let (mean, clipped) = average(Combine::Clipped, &mut samples, 2.0);
            assert!(clipped == 0 && (mean - f64::from(low) - 1.0 / 3.0).abs() < 1e-10, "{low}: {mean}, {clipped}");
            assert_eq!(average(Combine::Clipped, &mut samples, 1.999_999).1, 3, "{low}");
        }
    }
}
