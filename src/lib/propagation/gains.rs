//! Covariances of pixels that are weighted sums of photosites: of one pixel, of two, of the mean of a patch.
//!
//! With weights w on sites s of independent noise, cov(Σ w s, Σ w′ s) = Σ w w′ σ², where σ² is that of the site's
//! class. So every covariance here is a sum over the classes of a gain times a variance.

use crate::cfa::Class;
use crate::stages::demosaic::stencil::{PHASES, REACH, phase};
use crate::stages::demosaic::weights::Weights;
use nalgebra::Matrix3;

/// What each class adds to a covariance of the three channels, per variance of its photosites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains(pub [Matrix3<f64>; 3]);

impl Gains {
    /// No gain.
    pub fn zero() -> Self {
        Self([Matrix3::zeros(); 3])
    }

    /// The covariance at given variances of the photosites of R, G and B.
    pub fn covariance(&self, variances: [f64; 3]) -> Matrix3<f64> {
        self.0[0] * variances[0] + self.0[1] * variances[1] + self.0[2] * variances[2]
    }

    /// The gains of the channels that `matrix` makes of these: Σ′ = M Σ Mᵀ.
    #[must_use]
    pub fn through(&self, matrix: &Matrix3<f64>) -> Self {
        Self(self.0.map(|gain| matrix * gain * matrix.transpose()))
    }

    fn add(&mut self, class: Class, first: [f64; 3], second: [f64; 3], times: f64) {
        self.0[class as usize] += Matrix3::from_fn(|i, j| times * first[i] * second[j]);
    }
}

/// Gains of the covariance of a pixel of one phase.
pub fn pixel(weights: &Weights, phase: usize) -> Gains {
    autocovariance(weights, phase, [0, 0])
}

/// Gains of the covariance of a pixel over all phases, that of the pixels of a large frame.
pub fn mean_pixel(weights: &Weights) -> Gains {
    let phases = [0, 1, 2, 3].map(|phase| pixel(weights, phase));
    Gains([0, 1, 2].map(|class| phases.iter().map(|gains| gains.0[class]).sum::<Matrix3<f64>>() / 4.0))
}

/// Gains of the covariance of the channels of a pixel of one phase (rows) with those of the pixel `lag` (column, row)
/// away (columns).
pub fn autocovariance(weights: &Weights, phase: usize, lag: [isize; 2]) -> Gains {
    let mut gains = Gains::zero();
    let other = phase_at(PHASES[phase], lag);
    for y in (-REACH).max(lag[1] - REACH)..=REACH.min(lag[1] + REACH) {
        for x in (-REACH).max(lag[0] - REACH)..=REACH.min(lag[0] + REACH) {
            let first = [0, 1, 2].map(|channel| weights.stencil(phase, channel).at([x, y]));
            let second = [0, 1, 2].map(|channel| weights.stencil(other, channel).at([x - lag[0], y - lag[1]]));
            gains.add(weights.class(phase, [x, y]), first, second, 1.0);
        }
    }
    gains
}

/// Gains of the covariance of the means of a patch of `size` (columns, rows) whose corner is a pixel of `phase`, well
/// within a frame.
///
/// The mean of a patch is itself a weighted sum of sites. All sites farther than [`REACH`] within the patch have
/// weights that repeat with the array's period, so only the rim is gone through site by site.
pub fn patch_mean(weights: &Weights, phase: usize, size: [usize; 2]) -> Gains {
    let mut gains = Gains::zero();
    let corner = PHASES[phase];
    let count = size[0] as f64 * size[1] as f64;
    let [columns, rows] = size.map(distinct_sites);
    let [width, height] = size.map(usize::cast_signed);
    for &(y, times_y) in &rows {
        for &(x, times_x) in &columns {
            let mut weight = [0.0; 3];
            for dy in (y - height + 1).max(-REACH)..=y.min(REACH) {
                for dx in (x - width + 1).max(-REACH)..=x.min(REACH) {
                    let pixel = phase_at(corner, [x - dx, y - dy]);
                    for (channel, weight) in weight.iter_mut().enumerate() {
                        *weight += weights.stencil(pixel, channel).at([dx, dy]);
                    }
                }
            }
            let mean = weight.map(|weight| weight / count);
            gains.add(weights.class(phase, [x, y]), mean, mean, times_x * times_y);
        }
    }
    gains
}

/// Gains of the covariance of the means of patches whose corner may have any phase, the average over the four.
pub fn mean_patch_mean(weights: &Weights, size: [usize; 2]) -> Gains {
    let phases = [0, 1, 2, 3].map(|phase| patch_mean(weights, phase, size));
    Gains([0, 1, 2].map(|class| phases.iter().map(|gains| gains.0[class]).sum::<Matrix3<f64>>() / 4.0))
}

/// Along one axis of a patch of `length` pixels that starts at 0: the sites that differ in what they give to its mean,
/// and how many there are of each.
fn distinct_sites(length: usize) -> Vec<(isize, f64)> {
    let end = length.cast_signed();
    let one = |site| (site, 1.0);
    if end <= 2 * REACH + 2 {
        return (-REACH..end + REACH).map(one).collect();
    }
    let interior = length - 2 * REACH.unsigned_abs();
    let halves = [(REACH, interior.div_ceil(2) as f64), (REACH + 1, (interior / 2) as f64)];
    (-REACH..REACH).map(one).chain(halves).chain((end - REACH..end + REACH).map(one)).collect()
}

/// The phase of the pixel `offset` away from one of the phase `from`.
fn phase_at(from: [isize; 2], offset: [isize; 2]) -> usize {
    phase((from[0] + offset[0]) as i64, (from[1] + offset[1]) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cfa::CfaPattern;
    use crate::stages::demosaic::Method;
    use crate::stages::demosaic::weights::WeightTable;

    fn weights(method: Method) -> Weights {
        WeightTable::new(method, CfaPattern::Rggb).about([0.8, 1.7])
    }

    fn close(a: &Matrix3<f64>, b: &Matrix3<f64>, tolerance: f64) -> bool {
        (a - b).abs().max() < tolerance
    }

    /// The mean of a patch has the covariance of all pairs of its pixels: (1/n²) Σ C(a, b).
    #[test]
    fn patches_agree_with_the_sum_over_all_pairs_of_pixels() {
        let variances = [2.0, 3.0, 5.0];
        for method in Method::ALL {
            let weights = weights(method);
            for (phase, [width, height]) in [(0, [1, 1]), (1, [2, 2]), (2, [7, 5]), (3, [9, 8]), (0, [10, 13])] {
                let places: Vec<[isize; 2]> = (0..height).flat_map(|y| (0..width).map(move |x| [x, y])).collect();
                let n = places.len() as f64;
                let mut sum = Matrix3::zeros();
                for a in &places {
                    for b in &places {
                        let lag = [b[0] - a[0], b[1] - a[1]];
                        let from = phase_at(PHASES[phase], *a);
                        sum += autocovariance(&weights, from, lag).covariance(variances);
                    }
                }
                let size = [width.cast_unsigned(), height.cast_unsigned()];
                let found = patch_mean(&weights, phase, size).covariance(variances);
                assert!(close(&found, &(sum / (n * n)), 1e-13), "{method:?} {size:?}: {found} {sum}");
            }
        }
    }

    /// MODEL's figures for large patches: about 4σ²/n for red and blue and 2σ²/n for green: there each pixel's mean is
    /// that of the photosites of its class, one in four or one in two, for weights of unit sum about neutral scenes.
    #[test]
    fn large_patches_are_as_good_as_their_photosites() {
        for method in Method::ALL {
            let weights = WeightTable::new(method, CfaPattern::Rggb).about([1.0, 1.0]);
            let side = 2000;
            let n = f64::from(side).powi(2);
            let gains = mean_patch_mean(&weights, [side as usize; 2]);
            for (class, share) in [(Class::Red, 4.0), (Class::Green, 2.0), (Class::Blue, 4.0)] {
                let index = class as usize;
                let total: f64 = gains.0.iter().map(|gain| gain[(index, index)]).sum();
                // The rim is REACH/side = 0.15 % of the sites on each side.
                assert!((total * n / share - 1.0).abs() < 0.01, "{method:?} {class:?}: {}", total * n);
            }
        }
    }

    /// Figures of the paper, from its own sums: BI keeps 9/16 of the variance of red and blue (Eq. 39a mended) and 5/8
    /// of that of green (Eq. 39b), and leaves the channels uncorrelated.
    #[test]
    fn bilinear_interpolation_keeps_what_the_paper_says() {
        let gains = mean_pixel(&weights(Method::Bilinear));
        let covariance = gains.covariance([1.0, 1.0, 1.0]);
        assert!(close(&covariance, &Matrix3::from_diagonal(&[9.0 / 16.0, 5.0 / 8.0, 9.0 / 16.0].into()), 1e-15));
    }

    #[test]
    fn autocovariances_are_symmetric_and_end() {
        for method in Method::ALL {
            let weights = weights(method);
            for (phase, place) in PHASES.into_iter().enumerate() {
                for lag in [[1, 0], [2, -1], [-3, 2], [0, 4]] {
                    let other = phase_at(place, lag);
                    let there = autocovariance(&weights, phase, lag).covariance([2.0, 3.0, 5.0]);
                    let back = autocovariance(&weights, other, [-lag[0], -lag[1]]).covariance([2.0, 3.0, 5.0]);
                    assert!(close(&there, &back.transpose(), 1e-14));
                }
                assert_eq!(autocovariance(&weights, phase, [7, 0]), Gains::zero());
            }
        }
    }

    #[test]
    fn mixtures_through_a_matrix_have_gains_through_it() {
        let weights = weights(Method::EffectiveColor);
        let matrix = Matrix3::new(0.4, 0.3, 0.2, 0.2, 0.7, 0.1, 0.0, 0.1, 0.9);
        let a = mean_pixel(&weights.through(&matrix)).covariance([2.0, 3.0, 5.0]);
        let b = mean_pixel(&weights).through(&matrix).covariance([2.0, 3.0, 5.0]);
        assert!(close(&a, &b, 1e-14));
    }
}
