//! Means and covariances of samples that stream by, merged without loss.

/// Count, means, extremes and sums of products of deviations of `channels` variables observed together.
///
/// Each row is summed about a pivot taken from itself, so that nothing cancels; rows are merged by the pairwise update
/// of Chan, Golub and LeVeque \[Chan1983], so the result does not depend on how a frame is cut into bands beyond
/// rounding.
#[derive(Debug, Clone, PartialEq)]
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
    /// Σ (xᵢ − x̄ᵢ)(xⱼ − x̄ⱼ), the upper triangle row by row.
    comoments: Vec<f64>,
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
            comoments: vec![0.0; channels * (channels + 1) / 2],
        }
    }

    /// Number of variables.
    pub fn channels(&self) -> usize {
        self.mean.len()
    }

    /// Takes in observations: one slice per channel, all of one length.
    pub fn add(&mut self, samples: &[&[f32]]) {
        let channels = self.channels();
        assert_eq!(samples.len(), channels);
        let length = samples.first().map_or(0, |row| row.len());
        let mut part = Self::new(channels);
        let finite = |x: usize| samples.iter().all(|row| row[x].is_finite());
        let Some(first) = (0..length).find(|&x| finite(x)) else {
            self.not_finite += length as u64;
            return;
        };
        let pivot: Vec<f64> = samples.iter().map(|row| f64::from(row[first])).collect();
        let mut sums = vec![0.0; channels];
        let mut deviations = vec![0.0; channels];
        for x in first..length {
            if !finite(x) {
                continue;
            }
            part.count += 1;
            let mut pair = 0;
            for (i, row) in samples.iter().enumerate() {
                let value = f64::from(row[x]);
                part.min[i] = part.min[i].min(value);
                part.max[i] = part.max[i].max(value);
                deviations[i] = value - pivot[i];
                sums[i] += deviations[i];
            }
            for i in 0..channels {
                for j in i..channels {
                    part.comoments[pair] += deviations[i] * deviations[j];
                    pair += 1;
                }
            }
        }
        part.not_finite = length as u64 - part.count;
        let count = part.count as f64;
        let mut pair = 0;
        for i in 0..channels {
            part.mean[i] = pivot[i] + sums[i] / count;
            for j in i..channels {
                part.comoments[pair] -= sums[i] * sums[j] / count;
                pair += 1;
            }
        }
        self.merge(&part);
    }

    /// Takes in what another instance has seen.
    pub fn merge(&mut self, other: &Self) {
        self.not_finite += other.not_finite;
        if other.count == 0 {
            return;
        }
        let (mine, theirs) = (self.count as f64, other.count as f64);
        let total = mine + theirs;
        let shift: Vec<f64> = self.mean.iter().zip(&other.mean).map(|(a, b)| b - a).collect();
        let mut pair = 0;
        for i in 0..self.channels() {
            for j in i..self.channels() {
                self.comoments[pair] += other.comoments[pair] + shift[i] * shift[j] * mine * theirs / total;
                pair += 1;
            }
            self.mean[i] += shift[i] * theirs / total;
            self.min[i] = self.min[i].min(other.min[i]);
            self.max[i] = self.max[i].max(other.max[i]);
        }
        self.count += other.count;
    }

    /// Sample covariance of channels `i` and `j` (divisor n − 1); none below two observations.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        let (i, j) = (i.min(j), i.max(j));
        let pair = i * (2 * self.channels() - i + 1) / 2 + (j - i);
        (self.count > 1).then(|| self.comoments[pair] / (self.count - 1) as f64)
    }

    /// Sample standard deviation of a channel (divisor n − 1); none below two observations.
    pub fn std(&self, channel: usize) -> Option<f64> {
        self.covariance(channel, channel).map(|variance| variance.max(0.0).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
