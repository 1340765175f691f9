//! How samples of photosites that share rows and columns scatter in a region, before demosaicking.
//!
//! The photosites of a class are full grids, every second column of every second row, which share neither rows nor columns with
//! each other; planes are one grid. On a grid of R rows and C columns the covariance of channels k and l has the eigenvalues D,
//! D + C R_kl, D + R S_kl and their sum, D what is a photosite's own, R_kl and S_kl what two share in a row and in a column.

use super::region::Region;
use crate::cfa::{CfaPattern, Class};
use crate::frame::Geometry;
use crate::numerics::normal::MeanVariance;
use crate::propagation::covariance::PAIRS;
use crate::propagation::sampling::Sampling;
use crate::propagation::{LineCovariance, Prediction, SiteCovariance};
use nalgebra::Matrix3;

/// A grid of photosites: rows and columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    rows: f64,
    columns: f64,
}

impl Grid {
    /// All of a region.
    pub fn of_planes(region: Region) -> Self {
        Self { rows: region.height as f64, columns: region.width as f64 }
    }

    fn count(&self) -> f64 {
        self.rows * self.columns
    }
}

/// The photosites of a region behind a filter array, by parity of row and column in the region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Array {
    classes: [[usize; 2]; 2],
    rows: [f64; 2],
    columns: [f64; 2],
}

impl Array {
    /// Those of a region of a frame.
    pub fn of(pattern: CfaPattern, geometry: &Geometry, region: Region) -> Self {
        let [x0, y0] = geometry.origin.map(i64::from);
        let class = |q: usize, p: usize| pattern.class(x0 + (region.x + p) as i64, y0 + (region.y + q) as i64) as usize;
        let halves = |length: usize| [length.div_ceil(2) as f64, (length / 2) as f64];
        Self {
            classes: [0, 1].map(|q| [0, 1].map(|p| class(q, p))),
            rows: halves(region.height),
            columns: halves(region.width),
        }
    }

    /// The grids of a class.
    pub fn grids(&self, class: Class) -> Vec<Grid> {
        let places = self.places().filter(|[q, p]| self.classes[*q][*p] == class as usize);
        let grids = places.map(|[q, p]| Grid { rows: self.rows[q], columns: self.columns[p] });
        grids.filter(|grid| grid.count() > 0.0).collect()
    }

    fn places(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        (0..4).map(|place| [place / 2, place % 2])
    }

    /// Mean and expected sample variance of all photosites taken together, and the variances of both.
    pub fn of_plane(&self, classes: &[Prediction; 3]) -> PlaneScatter {
        let sites = SiteCovariance::of(classes);
        let class = |[q, p]: [usize; 2]| self.classes[q][p];
        let count = |[q, p]: [usize; 2]| self.rows[q] * self.columns[p];
        let n: f64 = self.places().map(count).sum();
        let sum = |of: &dyn Fn([usize; 2]) -> f64| self.places().map(|at| count(at) * of(at)).sum::<f64>();
        let mean = sum(&|at| classes[class(at)].moments.mean) / n;
        let offset = |at: [usize; 2]| classes[class(at)].moments.mean - mean;
        // A photosite with the sum of all, each times a number of its place.
        let with_all = |at: [usize; 2], times: &dyn Fn([usize; 2]) -> f64| {
            let [q, p] = at;
            let k = class(at);
            let row: f64 = (0..2).map(|p| self.columns[p] * sites.row[(k, class([q, p]))] * times([q, p])).sum();
            let column: f64 = (0..2).map(|q| self.rows[q] * sites.column[(k, class([q, p]))] * times([q, p])).sum();
            sites.own[k] * times(at) + row + column
        };
        let row_sum = |at| with_all(at, &|_| 1.0);
        let total = sum(&row_sum);
        let square = |at: [usize; 2]| {
            let [q, p] = at;
            let k = class(at);
            let others = |is_here: bool, length: f64| length - if is_here { 1.0 } else { 0.0 };
            let row =
                (0..2).map(|other| others(other == p, self.columns[other]) * sites.row[(k, class([q, other]))].powi(2));
            let column =
                (0..2).map(|other| others(other == q, self.rows[other]) * sites.column[(k, class([other, p]))].powi(2));
            classes[k].moments.variance.powi(2) + row.sum::<f64>() + column.sum::<f64>()
        };
        // tr(PCPC) = tr CC − (2/n) 1ᵀCC1 + (1ᵀC1)²/n².
        let trace = sum(&square) - 2.0 * sum(&|at| row_sum(at).powi(2)) / n + (total / n).powi(2);
        let of_offsets = sum(&|at| offset(at) * with_all(at, &offset));
        let fourth = sum(&|at| classes[class(at)].fourth());
        let common: f64 = [0, 1, 2]
            .map(|k| {
                let share = sum(&|at| if class(at) == k { 1.0 } else { 0.0 }) / n;
                share * share * classes[k].common
            })
            .iter()
            .sum();
        let variance = sum(&|at| classes[class(at)].moments.variance + offset(at).powi(2)) - total / n;
        PlaneScatter {
            mean_variance: total / (n * n) + common,
            sample: MeanVariance {
                mean: variance / (n - 1.0),
                variance: (2.0 * trace + 4.0 * of_offsets + fourth).max(0.0) / (n - 1.0).powi(2),
            },
        }
    }
}

/// How the photosites of a plane scatter, of whatever class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlaneScatter {
    /// Variance of the mean.
    pub mean_variance: f64,
    /// Expected sample variance, and its variance.
    pub sample: MeanVariance,
}

/// Three channels alike, all of a class.
pub(super) fn alike(prediction: &Prediction, class: Class) -> [Prediction; 3] {
    let LineCovariance { row, column } = prediction.lines;
    let lines = LineCovariance { row: [row[class as usize]; 3], column: [column[class as usize]; 3] };
    [Prediction { lines, ..*prediction }; 3]
}

/// The law of samples of three channels that stand on such grids.
pub(super) fn sampling(channels: &[Prediction; 3], grids: &[Grid]) -> Sampling {
    let sites = SiteCovariance::of(channels);
    let own = Matrix3::from_diagonal(&sites.own.into());
    let count: f64 = grids.iter().map(Grid::count).sum();
    let free = (count - 1.0).max(f64::MIN_POSITIVE);
    // Eigenvalues and how often they come, of the mean of each grid last.
    let spectra: Vec<[(f64, Matrix3<f64>); 4]> = grids
        .iter()
        .map(|grid| {
            let (rows, columns) = (grid.columns * sites.row, grid.rows * sites.column);
            let (r, c) = (grid.rows - 1.0, grid.columns - 1.0);
            [(r * c, own), (r, own + rows), (c, own + columns), (1.0, own + rows + columns)]
        })
        .collect();
    let means = || grids.iter().zip(&spectra).map(|(grid, spectrum)| (grid.count(), spectrum[3].1));
    let total: Matrix3<f64> = means().map(|(count, value)| count * value).sum();
    let all = || spectra.iter().flatten();
    let trace: Matrix3<f64> = all().map(|(times, value)| *times * value).sum();
    let product = |ik: (usize, usize), lj: (usize, usize)| {
        let of_all: f64 = all().map(|(times, value)| times * value[ik] * value[lj]).sum();
        let of_means: f64 = means().map(|(count, value)| count * value[ik] * value[lj]).sum();
        of_all - 2.0 * of_means / count + total[ik] * total[lj] / (count * count)
    };
    let cube = |i: usize| {
        let at = (i, i);
        let of_all: f64 = all().map(|(times, value)| times * value[at].powi(3)).sum();
        let of_means = |power: i32| means().map(|(count, value)| count * value[at].powi(power)).sum::<f64>() / count;
        let mean = total[at] / count;
        of_all - 3.0 * of_means(3) + 3.0 * mean * of_means(2) - mean.powi(3)
    };
    let fourth = |i: usize| channels[i].fourth_of_own(sites.own[i]) * count * (1.0 - 1.0 / count).powi(2);
    let spread = PAIRS.map(|[i, j]| {
        PAIRS.map(|[k, l]| {
            let normal = product((i, k), (l, j)) + product((i, l), (k, j));
            let of_sites = if i == j && k == l && i == k { fourth(i) } else { 0.0 };
            (normal + of_sites).max(0.0) / (free * free)
        })
    });
    let common = Matrix3::from_diagonal(&channels.map(|channel| channel.common).into());
    Sampling {
        count,
        mean_covariance: total / (count * count) + common,
        covariance: (trace - total / count) / free,
        spread,
        variance_thirds: Some([0, 1, 2].map(|i| 8.0 * cube(i) / free.powi(3))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn sites() -> [Prediction; 3] {
        let offset = [[0.4, 0.5, 0.3], [0.2, 0.3, 0.1]];
        [0, 1, 2].map(|k| {
            let line = |axis: usize| [0, 1, 2].map(|l| offset[axis][k] * offset[axis][l]);
            let lines = LineCovariance { row: line(0), column: line(1) };
            let variance = [1.0, 2.0, 0.5][k] + lines.row[k] + lines.column[k];
            let moments = MeanVariance { mean: [3.0, 7.0, 4.0][k], variance };
            Prediction { moments, third: 0.0, excess_kurtosis: 0.3, sixth: 0.0, common: 0.0, lines }
        })
    }

    fn matrix(places: &[[usize; 2]], channels: [usize; 2], class: impl Fn(usize, usize) -> usize) -> DMatrix<f64> {
        let sites = sites();
        DMatrix::from_fn(places.len(), places.len(), |a, b| {
            let [k, l] = [class(channels[0], a), class(channels[1], b)];
            let shared = |axis: usize, line: [f64; 3]| if places[a][axis] == places[b][axis] { line[l] } else { 0.0 };
            let own = if a == b && k == l {
                sites[k].moments.variance - sites[k].lines.row[k] - sites[k].lines.column[k]
            } else {
                0.0
            };
            own + shared(1, sites[k].lines.row) + shared(0, sites[k].lines.column)
        })
    }

    fn places(region: Region) -> Vec<[usize; 2]> {
        (0..region.height).flat_map(|y| (0..region.width).map(move |x| [x, y])).collect()
    }

    /// Sums of a few hundred numbers of one size: relative 10⁻¹².
    #[test]
    fn grids_agree_with_full_matrices() {
        let region = Region { x: 3, y: 2, width: 7, height: 6 };
        let geometry = Geometry::new(20, 20, &["Y"]);
        let pattern = CfaPattern::Rggb;
        let array = Array::of(pattern, &geometry, region);
        let class = |[x, y]: [usize; 2]| pattern.class((x + 3) as i64, (y + 2) as i64) as usize;
        let three = sampling(&sites(), &[Grid::of_planes(region)]);
        let green_sites: Vec<[usize; 2]> = places(region).into_iter().filter(|at| class(*at) == 1).collect();
        let green = sampling(&alike(&sites()[1], Class::Green), &array.grids(Class::Green));
        for (found, places, is_green) in [(three, places(region), false), (green, green_sites, true)] {
            let n = places.len();
            let free = n as f64 - 1.0;
            let p = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
            let c = |i: usize, j: usize| matrix(&places, [i, j], |channel, _| if is_green { 1 } else { channel });
            for (a, [i, j]) in PAIRS.into_iter().enumerate().filter(|(a, _)| !is_green || *a == 0) {
                let close = |found: f64, expected: f64| {
                    assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{i}{j}: {found} {expected}");
                };
                close(found.mean_covariance[(i, j)], c(i, j).sum() / (n * n) as f64);
                close(found.covariance[(i, j)], (&p * c(i, j)).trace() / free);
                for (b, [k, l]) in PAIRS.into_iter().enumerate().filter(|(b, _)| !is_green || *b == 0) {
                    let normal = (&p * c(i, k) * &p * c(l, j)).trace() + (&p * c(i, l) * &p * c(k, j)).trace();
                    let fourth = if i == j && k == l && i == k {
                        sites()[if is_green { 1 } else { i }].fourth() * n as f64 * (1.0 - 1.0 / n as f64).powi(2)
                    } else {
                        0.0
                    };
                    close(found.spread[a][b], (normal + fourth) / (free * free));
                }
                if i == j {
                    let pc = &p * c(i, i);
                    let third = found.variance_thirds.unwrap()[i];
                    close(third, 8.0 * (&pc * &pc * &pc).trace() / free.powi(3));
                }
            }
        }
        let places = places(region);
        let n = places.len();
        let c = matrix(&places, [0, 0], |_, at| class(places[at]));
        let means = DVector::from_fn(n, |at, _| sites()[class(places[at])].moments.mean);
        let offsets = means.add_scalar(-means.mean());
        let fourth: f64 = places.iter().map(|at| sites()[class(*at)].fourth()).sum();
        let p = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
        let pc = &p * &c;
        let found = array.of_plane(&sites());
        let expected = PlaneScatter {
            mean_variance: c.sum() / (n * n) as f64,
            sample: MeanVariance {
                mean: (pc.trace() + offsets.norm_squared()) / (n as f64 - 1.0),
                variance: (2.0 * (&pc * &pc).trace() + 4.0 * offsets.dot(&(&c * &offsets)) + fourth)
                    / (n as f64 - 1.0).powi(2),
            },
        };
        for (found, expected) in [
            (found.mean_variance, expected.mean_variance),
            (found.sample.mean, expected.sample.mean),
            (found.sample.variance, expected.sample.variance),
        ] {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
    }
}
