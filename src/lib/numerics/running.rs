//! Mean and variance of every sample of frames that stream by, whatever their number.

use rayon::prelude::*;

/// Samples that are worth a task of their own.
const SHARE: usize = 1 << 13;

/// Mean and sum of squared deviations of each of many variables, of which observations come one after another.
///
/// By the update of Welford \[Welford1962], in doubles: δ = x − x̄, x̄ += δ/n, q += δ (x − x̄). A variable of which an observation is
/// no finite number stays without a number.
///
/// # Examples
///
/// ```
/// use cyanometer::numerics::running::Running;
///
/// let mut running = Running::new(2);
/// for frame in [[1.0, 5.0], [2.0, 5.0], [6.0, f32::NAN]] {
///     running.begin();
///     running.add(0, &frame);
/// }
/// assert_eq!((running.means()[0], running.variance(0)), (3.0, 7.0));
/// assert!(running.means()[1].is_nan());
/// ```
#[derive(Debug, Clone, Default)]
pub struct Running {
    count: u32,
    means: Vec<f64>,
    squares: Vec<f64>,
}

impl Running {
    /// So many variables of which nothing was seen yet.
    pub fn new(variables: usize) -> Self {
        Self { count: 0, means: vec![0.0; variables], squares: vec![0.0; variables] }
    }

    /// Begins the next observation of all variables.
    pub fn begin(&mut self) {
        self.count += 1;
    }

    /// Takes in the current observation of the variables from `first` on, each once.
    pub fn add(&mut self, first: usize, samples: &[f32]) {
        let share = 1.0 / f64::from(self.count);
        let places = first..first + samples.len();
        let means = self.means[places.clone()].par_chunks_mut(SHARE);
        let squares = self.squares[places].par_chunks_mut(SHARE);
        means.zip(squares).zip(samples.par_chunks(SHARE)).for_each(|((means, squares), samples)| {
            for ((mean, square), sample) in means.iter_mut().zip(squares).zip(samples) {
                let sample = f64::from(*sample);
                let off = sample - *mean;
                *mean += off * share;
                *square += off * (sample - *mean);
            }
        });
    }

    /// Takes in the current observation of all variables.
    pub fn add_doubles(&mut self, values: &[f64]) {
        let share = 1.0 / f64::from(self.count);
        for ((mean, square), value) in self.means.iter_mut().zip(&mut self.squares).zip(values) {
            let off = value - *mean;
            *mean += off * share;
            *square += off * (value - *mean);
        }
    }

    /// How many observations began.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The means.
    pub fn means(&self) -> &[f64] {
        &self.means
    }

    /// The sample variance of a variable, divisor n − 1; no number of fewer than two observations.
    pub fn variance(&self, index: usize) -> f64 {
        self.squares[index] / (f64::from(self.count) - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against two passes in doubles; levels that are large beside their scatter lose no more than 10⁻¹² of it.
    #[test]
    fn it_agrees_with_two_passes() {
        let frames: Vec<Vec<f32>> = (0..50_u32)
            .map(|f| (0..20_000_u32).map(|i| 60_000.0 + ((f * 7919 + i * 104_729) % 1013) as f32 / 64.0).collect())
            .collect();
        let mut running = Running::new(20_000);
        for frame in &frames {
            running.begin();
            running.add(0, &frame[..9000]);
            running.add(9000, &frame[9000..]);
        }
        for i in (0..20_000).step_by(37) {
            let mean = frames.iter().map(|frame| f64::from(frame[i])).sum::<f64>() / 50.0;
            let variance = frames.iter().map(|frame| (f64::from(frame[i]) - mean).powi(2)).sum::<f64>() / 49.0;
            assert!((running.means()[i] / mean - 1.0).abs() < 1e-14);
            assert!((running.variance(i) / variance - 1.0).abs() < 1e-9);
        }
    }
}
