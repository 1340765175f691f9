//! Means and covariances of samples that stream by, merged without loss.

use super::sums::{self, Limits, Sums};

/// Samples of a channel that are summed about one center.
pub const BLOCK: usize = 4096;

/// So many channels are followed together; of more, each is followed by itself, and covariances are not known: time and
/// memory go by the square of their number. A spectrum of 360 to 830 nm in steps of 1 nm has 471.
pub const MOST_TOGETHER: usize = 512;

/// The channels from `i` on whose products with channel `i` are summed, of so many.
fn partners(i: usize, channels: usize) -> std::ops::Range<usize> {
    i..if channels > MOST_TOGETHER { i + 1 } else { channels }
}

/// How many products are summed of so many channels.
pub fn pairs(channels: usize) -> usize {
    if channels > MOST_TOGETHER { channels } else { channels * (channels + 1) / 2 }
}

/// Count, means, extremes and sums of products of deviations of `channels` variables observed together.
///
/// Blocks of up to [`BLOCK`] observations are summed about a center, the block's first observation, or its mean where the
/// first turns out to lie far from it, so that nothing cancels; blocks are merged by the pairwise update of Chan, Golub
/// and LeVeque \[Chan1983], means as offsets from the first center, so that they lose nothing beside a large level. What
/// comes out has the same bits on every set of instructions, and is within 10⁻¹² of what two passes in doubles give.
///
/// # Examples
///
/// ```
/// use cyanometer::numerics::moments::Moments;
///
/// // Two variables, observed together.
/// let mut moments = Moments::new(2);
/// moments.add(&[&[1.0, 2.0, 3.0], &[30.0, 20.0, 10.0]]);
/// let mut rest = Moments::new(2);
/// rest.add(&[&[4.0, f32::NAN], &[0.0, 5.0]]);
/// moments.merge(&rest);
///
/// assert_eq!((moments.count, moments.not_finite), (4, 1));
/// assert_eq!(moments.mean, [2.5, 15.0]);
/// // Σ (x − x̄)(y − ȳ) / (n − 1)
/// assert_eq!(moments.covariance(0, 0), Some(5.0 / 3.0));
/// assert_eq!(moments.covariance(0, 1), Some(-50.0 / 3.0));
/// ```
#[derive(Debug, Clone)]
pub struct Moments {
    /// Observations in which every channel was finite.
    pub count: u64,
    /// Observations left out because a channel was NaN or infinite.
    pub not_finite: u64,
    /// Mean of each channel.
    pub mean: Vec<f64>,
    /// Smallest sample of each channel.
    pub min: Vec<f64>,
    /// Largest sample of each channel.
    pub max: Vec<f64>,
    /// Samples of each channel at or beyond the limits, whether its fellows are finite or not.
    pub beyond: Vec<u64>,
    /// The mean is origin + offset.
    origin: Vec<f64>,
    offset: Vec<f64>,
    /// Σ (xᵢ − x̄ᵢ)(xⱼ − x̄ⱼ), the upper triangle row by row.
    comoments: Vec<f64>,
    /// Room for the sums of a block.
    block: Block,
}

impl Moments {
    /// No observation yet of `channels` variables.
    pub fn new(channels: usize) -> Self {
        Self {
            count: 0,
            not_finite: 0,
            mean: vec![0.0; channels],
            min: vec![f64::INFINITY; channels],
            max: vec![f64::NEG_INFINITY; channels],
            beyond: vec![0; channels],
            origin: vec![0.0; channels],
            offset: vec![0.0; channels],
            comoments: vec![0.0; pairs(channels)],
            block: Block::new(channels),
        }
    }

    /// What is known otherwise of so many observations: means and covariances (divisor n − 1) of their channels, and nothing of
    /// their extremes.
    pub fn known(count: u64, mean: Vec<f64>, covariance: impl Fn(usize, usize) -> f64) -> Self {
        let channels = mean.len();
        let free = count.saturating_sub(1) as f64;
        let pair = |i: usize| partners(i, channels).map(move |j| (i, j));
        let comoments = (0..channels).flat_map(pair).map(|(i, j)| free * covariance(i, j)).collect();
        Self { count, origin: mean.clone(), mean, comoments, ..Self::new(channels) }
    }

    /// Forgets all observations, and keeps its memory.
    pub fn clear(&mut self) {
        (self.count, self.not_finite) = (0, 0);
        self.mean.fill(0.0);
        self.min.fill(f64::INFINITY);
        self.max.fill(f64::NEG_INFINITY);
        self.beyond.fill(0);
        self.origin.fill(0.0);
        self.offset.fill(0.0);
        self.comoments.fill(0.0);
    }

    /// Number of variables.
    pub fn channels(&self) -> usize {
        self.mean.len()
    }

    /// Takes in observations: one slice per channel, all of one length.
    pub fn add(&mut self, samples: &[&[f32]]) {
        assert_eq!(samples.len(), self.channels());
        self.add_within(samples.first().map_or(0, |line| line.len()), |i| samples[i], Limits::NONE);
    }

    /// Takes in `length` observations, those of channel i in `line(i)`, and counts the samples at or beyond `limits`.
    pub fn add_within<'a>(&mut self, length: usize, line: impl Fn(usize) -> &'a [f32], limits: Limits) {
        let mut block = std::mem::take(&mut self.block);
        for start in (0..length).step_by(BLOCK) {
            let end = (start + BLOCK).min(length);
            block.sum(end - start, |i| &line(i)[start..end], limits);
            self.take_in(&mut block);
        }
        self.block = block;
    }

    /// Takes in what another instance has seen.
    pub fn merge(&mut self, other: &Self) {
        self.not_finite += other.not_finite;
        for (mine, theirs) in self.beyond.iter_mut().zip(&other.beyond) {
            *mine += theirs;
        }
        self.merge_finite(other.count, &other.origin, &other.offset, &other.comoments, [&other.min, &other.max]);
    }

    /// Takes in a block; its sums become offsets and comoments.
    fn take_in(&mut self, block: &mut Block) {
        self.not_finite += block.length as u64 - block.count;
        for (mine, theirs) in self.beyond.iter_mut().zip(&block.beyond) {
            *mine += theirs;
        }
        block.finish();
        self.merge_finite(block.count, &block.center, &block.sums, &block.products, [&block.min, &block.max]);
    }

    fn merge_finite(&mut self, count: u64, origin: &[f64], offset: &[f64], comoments: &[f64], [min, max]: [&[f64]; 2]) {
        if count == 0 {
            return;
        }
        if self.count == 0 {
            self.origin.copy_from_slice(origin);
        }
        let channels = self.channels();
        let (mine, theirs) = (self.count as f64, count as f64);
        let total = mine + theirs;
        let share = theirs / total;
        let shift = |moments: &Self, i: usize| (origin[i] - moments.origin[i]) + (offset[i] - moments.offset[i]);
        let mut pair = 0;
        for i in 0..channels {
            let shift_i = shift(self, i);
            for j in partners(i, channels) {
                self.comoments[pair] += comoments[pair] + shift_i * shift(self, j) * mine * share;
                pair += 1;
            }
        }
        for i in 0..channels {
            self.offset[i] += shift(self, i) * share;
            self.mean[i] = self.origin[i] + self.offset[i];
            self.min[i] = self.min[i].min(min[i]);
            self.max[i] = self.max[i].max(max[i]);
        }
        self.count += count;
    }

    /// Sample covariance of channels `i` and `j` (divisor n − 1); none below two observations, nor of two of more than
    /// [`MOST_TOGETHER`] channels.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        let (i, j) = (i.min(j), i.max(j));
        let channels = self.channels();
        let pair = match channels > MOST_TOGETHER {
            true if i != j => return None,
            true => i,
            false => i * (2 * channels - i + 1) / 2 + (j - i),
        };
        (self.count > 1).then(|| self.comoments[pair] / (self.count - 1) as f64)
    }

    /// Sample standard deviation of a channel (divisor n − 1); none below two observations.
    pub fn std(&self, channel: usize) -> Option<f64> {
        self.covariance(channel, channel).map(|variance| variance.max(0.0).sqrt())
    }
}

/// Takes in one variable's samples at the even places of a line, another's at the odd ones, without setting them apart.
pub fn add_alternating(moments: [&mut Moments; 2], samples: &[f32], limits: Limits) {
    let [even, odd] = moments;
    let mut blocks = [std::mem::take(&mut even.block), std::mem::take(&mut odd.block)];
    for part in samples.chunks(BLOCK) {
        Block::sum_alternating(&mut blocks, part, limits);
        even.take_in(&mut blocks[0]);
        odd.take_in(&mut blocks[1]);
    }
    [even.block, odd.block] = blocks;
}

/// Sums over a block of observations about `center`.
#[derive(Debug, Clone, Default)]
struct Block {
    /// Observations, and those of them that are finite.
    length: usize,
    count: u64,
    center: Vec<f64>,
    /// Σ (xᵢ − cᵢ).
    sums: Vec<f64>,
    /// Σ (xᵢ − cᵢ)(xⱼ − cⱼ), the upper triangle row by row.
    products: Vec<f64>,
    min: Vec<f64>,
    max: Vec<f64>,
    beyond: Vec<u64>,
}

impl Block {
    fn new(channels: usize) -> Self {
        Self {
            length: 0,
            count: 0,
            center: vec![0.0; channels],
            sums: vec![0.0; channels],
            products: vec![0.0; pairs(channels)],
            min: vec![0.0; channels],
            max: vec![0.0; channels],
            beyond: vec![0; channels],
        }
    }

    /// Sums up `length` observations, at least one.
    fn sum<'a>(&mut self, length: usize, line: impl Fn(usize) -> &'a [f32], limits: Limits) {
        for (i, center) in self.center.iter_mut().enumerate() {
            *center = f64::from(line(i)[0]);
        }
        (self.length, self.count) = (length, length as u64);
        self.sum_finite(&line, limits);
        if !self.is_finite() {
            return self.sum_some(length, |i, x| line(i)[x], limits);
        }
        if self.recenter() {
            self.sum_finite(&line, limits);
        }
    }

    /// Sums up the even and the odd places of a line that is not empty.
    fn sum_alternating(blocks: &mut [Self; 2], samples: &[f32], limits: Limits) {
        let first = |parity: usize| samples.get(parity).copied().map_or(0.0, f64::from);
        for (parity, block) in blocks.iter_mut().enumerate() {
            block.center[0] = first(parity);
            block.length = (samples.len() + 1 - parity) / 2;
            block.count = block.length as u64;
        }
        let both = |blocks: &mut [Self; 2]| {
            let centers = blocks.each_ref().map(|block| block.center[0]);
            let of_both = sums::alternating(samples, centers);
            for (parity, (block, sums)) in blocks.iter_mut().zip(&of_both).enumerate() {
                let beyond = limits.count(samples.iter().skip(parity).step_by(2), [sums.min, sums.max]);
                block.keep(0, 0, sums, beyond);
            }
        };
        both(blocks);
        if !blocks.iter().all(Self::is_finite) {
            for (parity, block) in blocks.iter_mut().enumerate() {
                block.sum_some(block.length, |_, x| samples[2 * x + parity], limits);
            }
            return;
        }
        let moved = blocks.each_mut().map(Self::recenter);
        if moved.contains(&true) {
            both(blocks);
        }
    }

    /// Notes the sums of a channel; `pair` is the place of its square.
    fn keep(&mut self, channel: usize, pair: usize, sums: &Sums, beyond: u64) {
        self.sums[channel] = sums.first;
        self.products[pair] = sums.second;
        self.min[channel] = f64::from(sums.min);
        self.max[channel] = f64::from(sums.max);
        self.beyond[channel] = beyond;
    }

    /// Sums up observations as if all were finite.
    fn sum_finite<'a>(&mut self, line: &impl Fn(usize) -> &'a [f32], limits: Limits) {
        let beyond = |i: usize, sums: &Sums| limits.count(line(i).iter(), [sums.min, sums.max]);
        match *self.center.as_slice() {
            [a] => {
                let ([sums], []) = sums::together([line(0)], [a]);
                self.keep(0, 0, &sums, beyond(0, &sums));
            }
            [a, b, c] => {
                let (of_channels, [ab, ac, bc]) = sums::together([line(0), line(1), line(2)], [a, b, c]);
                for (channel, (pair, sums)) in [0, 3, 5].into_iter().zip(&of_channels).enumerate() {
                    self.keep(channel, pair, sums, beyond(channel, sums));
                }
                (self.products[1], self.products[2], self.products[4]) = (ab, ac, bc);
            }
            _ => {
                let channels = self.center.len();
                let mut pair = 0;
                for i in 0..channels {
                    let ([sums], []) = sums::together([line(i)], [self.center[i]]);
                    self.keep(i, pair, &sums, beyond(i, &sums));
                    let partners = partners(i, channels);
                    for j in partners.clone().skip(1) {
                        let centers = [self.center[i], self.center[j]];
                        self.products[pair + j - i] = sums::product([line(i), line(j)], centers);
                    }
                    pair += partners.len();
                }
            }
        }
    }

    /// Sums up observations one by one, those left out that are not finite.
    fn sum_some(&mut self, length: usize, sample: impl Fn(usize, usize) -> f32, limits: Limits) {
        let channels = self.center.len();
        let finite = |x: usize| (0..channels).all(|i| sample(i, x).is_finite());
        for (i, beyond) in self.beyond.iter_mut().enumerate() {
            *beyond = (0..length).filter(|&x| limits.reached(sample(i, x))).count() as u64;
        }
        (self.length, self.count) = (length, 0);
        let Some(first) = (0..length).find(|&x| finite(x)) else { return };
        for (i, center) in self.center.iter_mut().enumerate() {
            *center = f64::from(sample(i, first));
        }
        self.sum_scalar(first..length, &finite, &sample);
        if self.recenter() {
            self.sum_scalar(first..length, &finite, &sample);
        }
    }

    fn sum_scalar(
        &mut self,
        places: std::ops::Range<usize>,
        finite: &impl Fn(usize) -> bool,
        sample: &impl Fn(usize, usize) -> f32,
    ) {
        let channels = self.center.len();
        self.count = 0;
        self.sums.fill(0.0);
        self.products.fill(0.0);
        self.min.fill(f64::INFINITY);
        self.max.fill(f64::NEG_INFINITY);
        for x in places.filter(|&x| finite(x)) {
            self.count += 1;
            let mut pair = 0;
            for i in 0..channels {
                let value = f64::from(sample(i, x));
                let deviation = value - self.center[i];
                self.sums[i] += deviation;
                self.min[i] = self.min[i].min(value);
                self.max[i] = self.max[i].max(value);
                for j in partners(i, channels) {
                    self.products[pair] += deviation * (f64::from(sample(j, x)) - self.center[j]);
                    pair += 1;
                }
            }
        }
    }

    fn is_finite(&self) -> bool {
        self.sums.iter().all(|sum| sum.is_finite())
    }

    /// Moves the center to the mean where it lies more than √15 standard deviations from it in a channel: about it,
    /// subtracting the square of the mean would cost over four bits. Whether it has moved.
    fn recenter(&mut self) -> bool {
        let (channels, count) = (self.center.len(), self.count as f64);
        let mut moved = false;
        let mut pair = 0;
        for i in 0..channels {
            if self.sums[i].powi(2) > 15.0 / 16.0 * count * self.products[pair] {
                self.center[i] += self.sums[i] / count;
                moved = true;
            }
            pair += partners(i, channels).len();
        }
        moved
    }

    /// Turns sums into offsets of the means from the center, products into comoments.
    fn finish(&mut self) {
        let (channels, count) = (self.center.len(), self.count.max(1) as f64);
        let mut pair = 0;
        for i in 0..channels {
            for j in partners(i, channels) {
                self.products[pair] -= self.sums[i] * (self.sums[j] / count);
                pair += 1;
            }
        }
        for sum in &mut self.sums {
            *sum /= count;
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::needless_range_loop, reason = "channels index several arrays")]

    use super::*;

    /// More channels than are followed together have the moments that each has by itself, a sample that is not finite
    /// leaving out its fellows as before.
    #[test]
    fn too_many_channels_are_followed_each_by_itself() {
        for channels in [MOST_TOGETHER, MOST_TOGETHER + 1] {
            for with_nan in [false, true] {
                let sample = |channel: usize, x: usize| match with_nan && channel == 3 && x == 4 {
                    true => f32::NAN,
                    false => ((channel * 31 + x * x * 17) % 101) as f32,
                };
                let mut moments = Moments::new(channels);
                for rows in [0..9, 9..10, 10..40] {
                    let lines: Vec<Vec<f32>> =
                        (0..channels).map(|channel| rows.clone().map(|x| sample(channel, x)).collect()).collect();
                    let mut part = Moments::new(channels);
                    part.add(&lines.iter().map(Vec::as_slice).collect::<Vec<_>>());
                    moments.merge(&part);
                }
                let seen: Vec<usize> = (0..40).filter(|x| !(with_nan && *x == 4)).collect();
                for channel in [0, 3, channels - 1] {
                    let values: Vec<f64> = seen.iter().map(|&x| f64::from(sample(channel, x))).collect();
                    let mean = values.iter().sum::<f64>() / values.len() as f64;
                    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
                    let variance = squares / (values.len() - 1) as f64;
                    // Sums of 40 terms of up to 10⁴: a few of their roundings, of 10⁻¹⁶ each.
                    assert!((moments.mean[channel] / mean - 1.0).abs() < 1e-14);
                    assert!((moments.covariance(channel, channel).unwrap() / variance - 1.0).abs() < 1e-13);
                }
                assert_eq!((moments.count, moments.not_finite), (seen.len() as u64, u64::from(with_nan)));
                assert_eq!(moments.covariance(0, 1).is_some(), channels == MOST_TOGETHER);
            }
        }
    }

    #[test]
    fn rows_merge_into_the_moments_of_the_whole() {
        // Deviations of order 1 on a mean of 10⁶, where the textbook sum of squares loses 10 digits.
        let a: Vec<f32> = (0..1000).map(|i| 1e6 + ((i * 37) % 11) as f32).collect();
        let b: Vec<f32> = (0..1000).map(|i| ((i * 17) % 7) as f32 - 2.0 * a[i] / 1e6).collect();
        let mut moments = Moments::new(2);
        for start in (0..1000).step_by(130) {
            let end = (start + 130).min(1000);
            moments.add(&[&a[start..end], &b[start..end]]);
        }
        let mean = |x: &[f32]| x.iter().map(|&v| f64::from(v)).sum::<f64>() / 1000.0;
        let covariance = |x: &[f32], y: &[f32]| -> f64 {
            let (mx, my) = (mean(x), mean(y));
            x.iter().zip(y).map(|(&u, &v)| (f64::from(u) - mx) * (f64::from(v) - my)).sum::<f64>() / 999.0
        };
        assert_eq!(moments.count, 1000);
        // Double rounding, 1000 terms: relative 1000 · 2⁻⁵³ ≈ 10⁻¹³, on sums that reach 10 per sample.
        for (i, j, x, y) in [(0, 0, &a, &a), (0, 1, &a, &b), (1, 0, &b, &a), (1, 1, &b, &b)] {
            assert!((moments.covariance(i, j).unwrap() - covariance(x, y)).abs() < 1e-11);
        }
        assert!((moments.mean[0] - mean(&a)).abs() < 1e-9);
        assert_eq!((moments.min[0], moments.max[0]), (1e6, 1e6 + 10.0));
    }

    fn lines(count: usize, of: impl Fn(usize, usize) -> f32) -> [Vec<f32>; 3] {
        [0, 1, 2].map(|channel| (0..count).map(|x| of(channel, x)).collect())
    }

    /// Even deviates in ±1, apart for channels that differ.
    fn deviate(channel: usize, x: usize) -> f32 {
        let mixed = (x as u64 * 3 + channel as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (mixed >> 40) as f32 / 8_388_608.0 - 1.0
    }

    /// Means and covariances of the finite observations, by two passes in doubles with compensated sums.
    fn two_passes(lines: &[Vec<f32>; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let kept: Vec<usize> = (0..lines[0].len()).filter(|&x| lines.iter().all(|line| line[x].is_finite())).collect();
        let sum = |values: &mut dyn Iterator<Item = f64>| {
            let (mut sum, mut lost) = (0.0_f64, 0.0);
            for value in values {
                let next = sum + value;
                lost += if sum.abs() >= value.abs() { (sum - next) + value } else { (value - next) + sum };
                sum = next;
            }
            sum + lost
        };
        let of = |i: usize, x: usize| f64::from(lines[i][x]);
        let mean = [0, 1, 2].map(|i| sum(&mut kept.iter().map(|&x| of(i, x))) / kept.len() as f64);
        let covariance = [0, 1, 2].map(|i| {
            [0, 1, 2].map(|j| {
                sum(&mut kept.iter().map(|&x| (of(i, x) - mean[i]) * (of(j, x) - mean[j]))) / (kept.len() - 1) as f64
            })
        });
        (mean, covariance)
    }

    fn check(lines: &[Vec<f32>; 3], row: usize) {
        let mut moments = Moments::new(3);
        for start in (0..lines[0].len()).step_by(row) {
            let end = (start + row).min(lines[0].len());
            moments.add_within(end - start, |i| &lines[i][start..end], Limits::NONE);
        }
        let (mean, covariance) = two_passes(lines);
        for i in 0..3 {
            let scale = mean[i].abs().max(covariance[i][i].sqrt());
            assert!((moments.mean[i] - mean[i]).abs() < 1e-12 * scale, "{} {}", moments.mean[i], mean[i]);
            for j in 0..3 {
                let (found, expected) = (moments.covariance(i, j).unwrap(), covariance[i][j]);
                let scale = (covariance[i][i] * covariance[j][j]).sqrt();
                assert!((found - expected).abs() < 1e-12 * scale, "{i} {j}: {found} {expected}");
            }
        }
        for i in 0..3 {
            let mut alone = Moments::new(1);
            alone.add(&[&lines[i]]);
            if alone.not_finite == moments.not_finite {
                assert!((alone.covariance(0, 0).unwrap() / covariance[i][i] - 1.0).abs() < 1e-12);
            }
        }
    }

    /// Worst case of a sum of 512 terms on one lane is 512 · 2⁻⁵³ = 6·10⁻¹⁴ of it, which a center √15 standard deviations
    /// away makes 16 times as much: 9·10⁻¹³; what is seen is about 10⁻¹⁵.
    #[test]
    fn sums_are_as_good_as_two_passes_wherever_the_level_and_the_first_sample() {
        for row in [37, 2654, 5000] {
            check(&lines(100_000, |i, x| 1e6 + deviate(i, x)), row);
            check(&lines(100_000, |i, x| 100.0 * deviate(i, x) + deviate(0, x)), row);
            // Every row starts at an outlier.
            check(&lines(100_000, |i, x| if x % row == 0 { 3e7 } else { 500.0 + 20.0 * deviate(i, x) }), row);
            // A gradient, and samples that are not finite.
            check(&lines(100_000, |i, x| x as f32 + deviate(i, x)), row);
            check(&lines(100_000, |i, x| if x % 1013 == i { f32::NAN } else { 1e6 + deviate(i, x) }), row);
        }
    }

    #[test]
    fn more_channels_than_three_are_summed_as_three_are() {
        let lines = lines(3000, |i, x| 50.0 + deviate(i, x) * (i + 1) as f32);
        let [a, b, c] = lines.each_ref().map(Vec::as_slice);
        let (mut three, mut five) = (Moments::new(3), Moments::new(5));
        three.add(&[a, b, c]);
        five.add(&[c, a, b, a, c]);
        for (i, of) in [2, 0, 1, 0, 2].into_iter().enumerate() {
            for (j, and) in [2, 0, 1, 0, 2].into_iter().enumerate() {
                let (found, expected) = (five.covariance(i, j).unwrap(), three.covariance(of, and).unwrap());
                assert!((found - expected).abs() < 1e-12);
            }
            assert!((five.mean[i] - three.mean[of]).abs() < 1e-12);
            assert_eq!((five.min[i], five.max[i]), (three.min[of], three.max[of]));
        }
    }

    /// What the samples give that are set apart, but for the lanes that they are summed on.
    #[test]
    fn samples_that_take_turns_are_told_apart() {
        for bad in [usize::MAX, 4000] {
            let line: Vec<f32> = (0..9001)
                .map(|x| if x == bad { f32::INFINITY } else { [10.0, 700.0][x % 2] + deviate(0, x) })
                .collect();
            let mut found = [Moments::new(1), Moments::new(1)];
            let [even, odd] = &mut found;
            let limits = Limits { low: 9.5, high: 700.5 };
            add_alternating([even, odd], &line, limits);
            for (parity, found) in found.iter().enumerate() {
                let apart: Vec<f32> = line.iter().skip(parity).step_by(2).copied().collect();
                let mut expected = Moments::new(1);
                expected.add_within(apart.len(), |_| &apart, limits);
                assert_eq!((found.count, found.not_finite), (expected.count, expected.not_finite));
                assert_eq!((&found.min, &found.max), (&expected.min, &expected.max));
                assert_eq!(found.beyond, expected.beyond);
                assert!((found.mean[0] / expected.mean[0] - 1.0).abs() < 1e-14);
                assert!((found.std(0).unwrap() / expected.std(0).unwrap() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn samples_at_limits_are_counted_channel_by_channel() {
        let limits = Limits { low: f32::NAN, high: 4.0 };
        let mut moments = Moments::new(2);
        moments.add_within(4, |i| [&[1.0, 4.0, f32::INFINITY, 5.0], &[4.0, 1.0, 4.0, f32::NAN]][i], limits);
        assert_eq!((moments.beyond.as_slice(), moments.count, moments.not_finite), ([3, 2].as_slice(), 2, 2));
        moments.clear();
        moments.add(&[&[1.0], &[4.0]]);
        assert_eq!((moments.beyond.as_slice(), moments.count, moments.mean[1]), ([0, 0].as_slice(), 1, 4.0));
    }

    #[test]
    fn what_is_not_finite_is_counted_and_left_out() {
        let mut moments = Moments::new(1);
        moments.add(&[&[f32::NAN, 1.0, f32::INFINITY, 3.0]]);
        moments.add(&[&[f32::NAN]]);
        assert_eq!((moments.count, moments.not_finite, moments.mean[0]), (2, 3, 2.0));
        assert_eq!(moments.covariance(0, 0), Some(2.0));
    }

    #[test]
    fn the_triangle_is_indexed_as_it_is_filled() {
        let mut moments = Moments::new(3);
        moments.add(&[&[0.0, 2.0], &[0.0, 4.0], &[0.0, -6.0]]);
        let covariances: Vec<f64> =
            (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| moments.covariance(i, j).unwrap()).collect();
        assert_eq!(covariances, [2.0, 4.0, -6.0, 4.0, 8.0, -12.0, -6.0, -12.0, 18.0]);
    }
}
