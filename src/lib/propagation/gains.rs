//! Covariances of pixels that are weighted sums of photosites: of one pixel, of two, of the mean of a patch.
//!
//! With weights w on sites s of independent noise, cov(Σ w s, Σ w′ s) = Σ w w′ σ², where σ² is that of the site's
//! class. So every covariance here is a sum over the classes of a gain times a variance.
//!
//! What photosites share by rows adds Σ_r Σ_kl A_rk A′_rl R_kl, A_rk the sum of the weights on the sites of class k in row r and R
//! their covariance ([`SiteCovariance`]); so do columns. A drift of the black level is shared by rows that are near too: over its places
//! (`row_drift`).

use super::covariance::PAIRS;
use super::moments::SiteCovariance;
use super::row_drift::{LineWeights, Load, RowDrift};
use crate::cfa::Class;
use crate::stages::demosaic::stencil::{PHASES, REACH, phase};
use crate::stages::demosaic::weights::Weights;
use nalgebra::{Matrix3, Vector3};

/// What each class adds to a covariance of the three channels, per variance of its photosites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Of what is a photosite's own.
    pub own: [Matrix3<f64>; 3],
    /// Of what the photosites of rows and of columns share, by pairs of classes.
    pub lines: [LineGains; 2],
}

/// What each pair of classes, in the order of [`PAIRS`], adds to a covariance of the three channels, per covariance of their
/// photosites within rows, or within columns.
pub type LineGains = [Matrix3<f64>; PAIRS.len()];

impl Gains {
    /// No gain.
    pub fn zero() -> Self {
        Self { own: [Matrix3::zeros(); 3], lines: [[Matrix3::zeros(); PAIRS.len()]; 2] }
    }

    /// The covariance for photosites of such covariances, but for what rows apart share.
    fn of(&self, sites: &SiteCovariance) -> Matrix3<f64> {
        let own = self.covariance(sites.own);
        if sites.is_independent() { own } else { own + self.of_lines(sites.lines()) }
    }

    /// What the covariances of photosites within rows and columns give.
    pub fn of_lines(&self, lines: [&Matrix3<f64>; 2]) -> Matrix3<f64> {
        let of_axis = |(gains, covariance): (&LineGains, &Matrix3<f64>)| -> Matrix3<f64> {
            PAIRS.iter().zip(gains).map(|(&[k, l], gain)| covariance[(k, l)] * gain).sum()
        };
        self.lines.iter().zip(lines).map(of_axis).sum()
    }

    /// The covariance at given variances of the photosites of R, G and B.
    pub fn covariance(&self, variances: [f64; 3]) -> Matrix3<f64> {
        self.own[0] * variances[0] + self.own[1] * variances[1] + self.own[2] * variances[2]
    }

    /// The gains of the channels that `matrix` makes of these: Σ′ = M Σ Mᵀ.
    #[must_use]
    pub fn through(&self, matrix: &Matrix3<f64>) -> Self {
        let carried = |gain: Matrix3<f64>| matrix * gain * matrix.transpose();
        Self { own: self.own.map(carried), lines: self.lines.map(|gains| gains.map(carried)) }
    }

    fn add(&mut self, class: Class, first: [f64; 3], second: [f64; 3], times: f64) {
        self.own[class as usize] += Matrix3::from_fn(|i, j| times * first[i] * second[j]);
    }

    /// Adds a row (0), or a column (1), so many times.
    fn add_line(&mut self, axis: usize, first: &LineWeights, second: &LineWeights, times: f64) {
        for (gain, [k, l]) in self.lines[axis].iter_mut().zip(PAIRS) {
            *gain += Matrix3::from_fn(|i, j| {
                let both = first[k][i] * second[l][j];
                times * if k == l { both } else { both + first[l][i] * second[k][j] }
            });
        }
    }

    fn mean(all: &[Self; PHASES.len()]) -> Self {
        let share = 1.0 / PHASES.len() as f64;
        let mean = |of: &dyn Fn(&Self) -> Matrix3<f64>| all.iter().map(of).sum::<Matrix3<f64>>() * share;
        Self {
            own: [0, 1, 2].map(|class| mean(&|gains| gains.own[class])),
            lines: [0, 1].map(|axis| std::array::from_fn(|pair| mean(&|gains| gains.lines[axis][pair]))),
        }
    }
}

/// The covariance of a pixel of one phase, for photosites of such covariances.
pub fn pixel_covariance(weights: &Weights, phase: usize, sites: &SiteCovariance) -> Matrix3<f64> {
    lagged_covariance(weights, phase, [0, 0], sites)
}

/// The covariance of a pixel over all phases, that of the pixels of a large frame.
pub fn mean_pixel_covariance(weights: &Weights, sites: &SiteCovariance) -> Matrix3<f64> {
    mean_of_phases(|phase| pixel_covariance(weights, phase, sites))
}

/// The covariance of the channels of a pixel of one phase (rows) with those of the pixel `lag` (column, row) away (columns).
pub fn lagged_covariance(weights: &Weights, phase: usize, lag: [isize; 2], sites: &SiteCovariance) -> Matrix3<f64> {
    let covariance = autocovariance(weights, phase, lag).of(sites);
    let Some(drift) = RowDrift::of(sites) else { return covariance };
    let loads = |phase: usize, first: isize| -> Vec<(isize, Load)> {
        let load = |row: isize| (first + row, drift.load(&line_weights(weights, phase, 0, row)));
        (-REACH..=REACH).map(load).collect()
    };
    covariance + drift.apart(&loads(phase, 0), &loads(phase_at(PHASES[phase], lag), lag[1]))
}

/// The covariance of the means of a patch of `size` (columns, rows) well within a frame, whose corner is a pixel of `phase`, or of any.
pub fn patch_covariance(
    weights: &Weights,
    phase: Option<usize>,
    size: [usize; 2],
    sites: &SiteCovariance,
) -> Matrix3<f64> {
    let of = |phase: usize| {
        let covariance = patch_mean(weights, phase, size).of(sites);
        let Some(drift) = RowDrift::of(sites) else { return covariance };
        let rows =
            distinct_sites(size[1]).into_iter().map(|(y, _)| (y, drift.load(&row_of_mean(weights, phase, size, y))));
        covariance + drift.apart_in_patch(&rows.collect::<Vec<_>>(), size[1])
    };
    phase.map_or_else(|| mean_of_phases(of), of)
}

fn mean_of_phases(of: impl Fn(usize) -> Matrix3<f64>) -> Matrix3<f64> {
    (0..PHASES.len()).map(of).sum::<Matrix3<f64>>() / PHASES.len() as f64
}

/// What the sites of a row from the corner of a patch give to its mean.
fn row_of_mean(weights: &Weights, phase: usize, size: [usize; 2], y: isize) -> LineWeights {
    let mut found = LineWeights::default();
    for (x, times) in distinct_sites(size[0]) {
        let class = weights.class(phase, [x, y]) as usize;
        let mean = in_mean(weights, phase, size, [x, y]);
        found[class].iter_mut().zip(mean).for_each(|(sum, mean)| *sum += times * mean);
    }
    found
}

/// Gains of the covariance of a pixel of one phase.
pub fn pixel(weights: &Weights, phase: usize) -> Gains {
    autocovariance(weights, phase, [0, 0])
}

/// Gains of the covariance of a pixel over all phases, that of the pixels of a large frame.
pub fn mean_pixel(weights: &Weights) -> Gains {
    Gains::mean(&[0, 1, 2, 3].map(|phase| pixel(weights, phase)))
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
    // However far apart along a row two pixels are, they share it.
    for axis in [0, 1] {
        let lag = lag[1 - axis];
        for line in (-REACH).max(lag - REACH)..=REACH.min(lag + REACH) {
            let first = line_weights(weights, phase, axis, line);
            let second = line_weights(weights, other, axis, line - lag);
            gains.add_line(axis, &first, &second, 1.0);
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
    let [columns, rows] = size.map(distinct_sites);
    let mut lines = [vec![LineWeights::default(); rows.len()], vec![LineWeights::default(); columns.len()]];
    for (row, &(y, times_y)) in rows.iter().enumerate() {
        for (column, &(x, times_x)) in columns.iter().enumerate() {
            let mean = in_mean(weights, phase, size, [x, y]);
            let class = weights.class(phase, [x, y]);
            gains.add(class, mean, mean, times_x * times_y);
            for (channel, mean) in mean.into_iter().enumerate() {
                lines[0][row][class as usize][channel] += times_x * mean;
                lines[1][column][class as usize][channel] += times_y * mean;
            }
        }
    }
    for (axis, (lines, places)) in lines.iter().zip([&rows, &columns]).enumerate() {
        for (line, (_, times)) in lines.iter().zip(places) {
            gains.add_line(axis, line, line, *times);
        }
    }
    gains
}

/// What the site in a column and row from the corner of a patch gives to its mean.
fn in_mean(weights: &Weights, phase: usize, size: [usize; 2], [x, y]: [isize; 2]) -> [f64; 3] {
    let [width, height] = size.map(usize::cast_signed);
    let mut weight = [0.0; 3];
    for dy in (y - height + 1).max(-REACH)..=y.min(REACH) {
        for dx in (x - width + 1).max(-REACH)..=x.min(REACH) {
            let pixel = phase_at(PHASES[phase], [x - dx, y - dy]);
            for (channel, weight) in weight.iter_mut().enumerate() {
                *weight += weights.stencil(pixel, channel).at([dx, dy]);
            }
        }
    }
    let count = size[0] as f64 * size[1] as f64;
    weight.map(|weight| weight / count)
}

/// The covariance of the means of a patch as in [`patch_mean`], of photosites that share nothing and have such variances at the places of
/// the array.
pub fn patch_mean_by_place(
    weights: &Weights,
    phase: usize,
    size: [usize; 2],
    variances: [f64; PHASES.len()],
) -> Matrix3<f64> {
    let [columns, rows] = size.map(distinct_sites);
    let mut covariance = Matrix3::zeros();
    for &(y, times_y) in &rows {
        for &(x, times_x) in &columns {
            let mean = Vector3::from(in_mean(weights, phase, size, [x, y]));
            let variance = variances[phase_at(PHASES[phase], [x, y])];
            covariance += times_x * times_y * variance * mean * mean.transpose();
        }
    }
    covariance
}

/// What the sites of a row (axis 0), or column (1), `line` away from a pixel give to its channels.
fn line_weights(weights: &Weights, phase: usize, axis: usize, line: isize) -> LineWeights {
    let mut found = LineWeights::default();
    for along in -REACH..=REACH {
        let offset = if axis == 0 { [along, line] } else { [line, along] };
        let class = weights.class(phase, offset) as usize;
        for (channel, sum) in found[class].iter_mut().enumerate() {
            *sum += weights.stencil(phase, channel).at(offset);
        }
    }
    found
}

/// Gains of the covariance of the means of patches whose corner may have any phase, the average over the four.
pub fn mean_patch_mean(weights: &Weights, size: [usize; 2]) -> Gains {
    Gains::mean(&[0, 1, 2, 3].map(|phase| patch_mean(weights, phase, size)))
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

    /// So it has of photosites whose rows drift, of knots nearer than a stencil reaches, and farther off than a patch.
    #[test]
    fn patches_that_drift_agree_with_the_sum_over_all_pairs_of_pixels() {
        let drift = Matrix3::from_fn(|k, l| [0.9, 0.5, 1.3][k] * [0.9, 0.5, 1.3][l]);
        for (rows_per_knot, method) in [(2.0, Method::Bilinear), (4.7, Method::Malvar), (90.0, Method::EffectiveColor)]
        {
            let sites = SiteCovariance {
                row: drift + Matrix3::from_diagonal_element(0.3),
                drift,
                drift_rows: rows_per_knot,
                ..SiteCovariance::independent([2.0, 3.0, 5.0])
            };
            let weights = weights(method);
            for (phase, [width, height]) in [(0, [1, 1]), (1, [2, 3]), (2, [3, 8]), (3, [2, 9]), (0, [3, 16])] {
                let places: Vec<[isize; 2]> = (0..height).flat_map(|y| (0..width).map(move |x| [x, y])).collect();
                let n = places.len() as f64;
                let pairs = places.iter().flat_map(|a| places.iter().map(move |b| (*a, *b)));
                let of = |(a, b): ([isize; 2], [isize; 2])| {
                    lagged_covariance(&weights, phase_at(PHASES[phase], a), [b[0] - a[0], b[1] - a[1]], &sites)
                };
                let sum: Matrix3<f64> = pairs.map(of).sum();
                let size = [width, height].map(isize::cast_unsigned);
                let found = patch_covariance(&weights, Some(phase), size, &sites);
                assert!(close(&found, &(sum / (n * n)), 1e-12), "{method:?} {size:?}: {found} {}", sum / (n * n));
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
                let total: f64 = gains.own.iter().map(|gain| gain[(index, index)]).sum();
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
                assert_eq!(autocovariance(&weights, phase, [7, 7]), Gains::zero());
                assert_eq!(autocovariance(&weights, phase, [7, 0]).own, Gains::zero().own);
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
