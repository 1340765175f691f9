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
use crate::propagation::drift::{Drift, DriftRows};
use crate::propagation::moments::common;
use crate::propagation::sampling::Sampling;
use crate::propagation::{LineCovariance, Prediction, SiteCovariance};
use nalgebra::{Matrix3, Vector3};

/// A grid of photosites: rows and columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    rows: f64,
    columns: f64,
    /// Its first row on the sensor, and from one to the next.
    first: i64,
    step: i64,
}

impl Grid {
    /// All of a region.
    pub fn of_planes(region: Region, origin: [i32; 2]) -> Self {
        let first = i64::from(origin[1]) + region.y as i64;
        Self { rows: region.height as f64, columns: region.width as f64, first, step: 1 }
    }

    /// Its rows as the drift of the black level meets them.
    fn drift_rows(&self) -> DriftRows {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number")]
        let count = self.rows as usize;
        DriftRows { first: self.first, step: self.step, count, columns: self.columns }
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
    /// Its first row on the sensor.
    first: i64,
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
            first: y0 + region.y as i64,
        }
    }

    /// The grids of a class.
    pub fn grids(&self, class: Class) -> Vec<Grid> {
        let places = self.places().filter(|[q, p]| self.classes[*q][*p] == class as usize);
        let grids = places.map(|[q, p]| self.grid(q, p));
        grids.filter(|grid| grid.count() > 0.0).collect()
    }

    fn grid(&self, q: usize, p: usize) -> Grid {
        Grid { rows: self.rows[q], columns: self.columns[p], first: self.first + q as i64, step: 2 }
    }

    fn places(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        (0..4).map(|place| [place / 2, place % 2])
    }

    /// Adds what the drift of the black level makes of all photosites taken together, whose means are off by such weights at each
    /// place, and which have such a variance by themselves and with their rows.
    fn add_drift(&self, found: &mut PlaneScatter, sites: &SiteCovariance, weights: &[f64], own: f64) {
        let rows: Vec<DriftRows> = self.places().map(|[q, p]| self.grid(q, p).drift_rows()).collect();
        let drift = Drift::of(&rows, sites.drift_rows);
        // Slopes of the classes differ by what rounding makes of a mean, if at all.
        let variance = sites.drift.diagonal().mean();
        let [one, two, _] = drift.traces();
        let count: f64 = rows.iter().map(|rows| rows.columns * rows.count as f64).sum();
        found.mean_variance += variance * drift.of_mean();
        found.sample.mean += variance * one / (count - 1.0);
        let of_offsets = variance * Drift::of_sums(&rows, sites.drift_rows, weights);
        let scatter = 2.0 * (2.0 * own * variance * one + variance * variance * two) + 4.0 * of_offsets;
        found.sample.variance += scatter / (count - 1.0).powi(2);
    }

    /// Mean and expected sample variance of all photosites taken together, and the variances of both.
    pub fn of_plane(&self, classes: &[Prediction; 3]) -> PlaneScatter {
        let drifting = SiteCovariance::of(classes);
        let classes = &without_drift(classes);
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
        let third = (1.0 - 1.0 / n) * sum(&|at| classes[class(at)].third * offset(at));
        let fourth = sum(&|at| classes[class(at)].fourth());
        let shares = [0, 1, 2].map(|k| sum(&|at| if class(at) == k { 1.0 } else { 0.0 }) / n);
        let shares = Vector3::from(shares);
        let common = shares.dot(&(common(classes) * shares));
        let variance = sum(&|at| classes[class(at)].moments.variance + offset(at).powi(2)) - total / n;
        let mut found = PlaneScatter {
            mean_variance: total / (n * n) + common,
            sample: MeanVariance {
                mean: variance / (n - 1.0),
                variance: (2.0 * trace + 4.0 * (of_offsets + third) + fourth).max(0.0) / (n - 1.0).powi(2),
            },
        };
        if drifting.drifts() {
            let weights: Vec<f64> = self.places().map(offset).collect();
            let columns: f64 = self.columns.iter().sum();
            let own = sum(&|at| sites.own[class(at)] + columns * sites.row[(class(at), class(at))]) / n;
            self.add_drift(&mut found, &drifting, &weights, own);
        }
        found
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

/// The same photosites without what the drift of the black level makes of them.
fn without_drift(channels: &[Prediction; 3]) -> [Prediction; 3] {
    [0, 1, 2].map(|k| {
        let Prediction { moments, lines, .. } = channels[k];
        if lines.drift == [0.0; 3] {
            return channels[k];
        }
        let variance = moments.variance - lines.drift[k];
        let row = [0, 1, 2].map(|l| lines.row[l] - lines.drift[l]);
        let excess_kurtosis = if variance > 0.0 { channels[k].fourth() / (variance * variance) } else { 0.0 };
        let lines = LineCovariance { row, drift: [0.0; 3], drift_rows: 0.0, ..lines };
        Prediction { moments: MeanVariance { variance, ..moments }, excess_kurtosis, lines, ..channels[k] }
    })
}

/// Three channels alike, all of a class.
pub(super) fn alike(prediction: &Prediction, class: Class) -> [Prediction; 3] {
    let LineCovariance { row, column, drift, drift_rows, level, .. } = prediction.lines;
    let of_class = |shared: [f64; 3]| [shared[class as usize]; 3];
    let lines = LineCovariance {
        row: of_class(row),
        column: of_class(column),
        drift: of_class(drift),
        drift_rows,
        together: [0.0; 3],
        level: of_class(level),
    };
    [Prediction { lines, ..*prediction }; 3]
}

/// The law of samples of three channels that stand on such grids.
pub(super) fn sampling(channels: &[Prediction; 3], grids: &[Grid]) -> Sampling {
    let sites = SiteCovariance::of(channels);
    if !sites.drifts() {
        return without_drift_sampling(channels, grids);
    }
    let mut found = without_drift_sampling(&without_drift(channels), grids);
    add_drift(&mut found, &sites, grids);
    found
}

/// Adds what the drift of the black level makes: U = PVP, with V what it shares, beside what has been counted, A, whose products
/// with it are those of what is a photosite's own, of rows and of columns.
fn add_drift(found: &mut Sampling, sites: &SiteCovariance, grids: &[Grid]) {
    let rows: Vec<DriftRows> = grids.iter().map(Grid::drift_rows).collect();
    let drift = Drift::of(&rows, sites.drift_rows);
    let [one, two, three] = drift.traces();
    let lines = rows.iter().map(|rows| drift.with_lines(rows)).fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    let row = sites.row - sites.drift;
    let own = sites.own_of_planes();
    let free = (found.count - 1.0).max(f64::MIN_POSITIVE);
    // tr AU, of channels.
    let beside: Matrix3<f64> = own * one + row * lines[0] + sites.column * lines[1];
    let product = |ik: (usize, usize), lj: (usize, usize)| {
        beside[ik] * sites.drift[lj] + sites.drift[ik] * beside[lj] + sites.drift[ik] * sites.drift[lj] * two
    };
    for (a, [i, j]) in PAIRS.into_iter().enumerate() {
        for (b, [k, l]) in PAIRS.into_iter().enumerate() {
            found.spread[a][b] += (product((i, k), (l, j)) + product((i, l), (k, j))) / (free * free);
        }
    }
    found.mean_covariance += sites.drift * drift.of_mean();
    found.covariance += sites.drift * (one / free);
    // On what is the same along rows what is a photosite's own and the rows' has one value, of grids of as many columns.
    let columns = grids.iter().map(Grid::count).sum::<f64>() / grids.iter().map(|grid| grid.rows).sum::<f64>();
    for (i, third) in found.variance_thirds.iter_mut().flatten().enumerate() {
        let (value, of_drift) = (own[(i, i)] + columns * row[(i, i)], sites.drift[(i, i)]);
        let cubes =
            3.0 * value * value * of_drift * one + 3.0 * value * of_drift.powi(2) * two + of_drift.powi(3) * three;
        *third += 8.0 * cubes / free.powi(3);
    }
}

/// The same where no black level drifts.
fn without_drift_sampling(channels: &[Prediction; 3], grids: &[Grid]) -> Sampling {
    let sites = SiteCovariance::of(channels);
    let own = sites.own_of_planes();
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
    Sampling {
        count,
        mean_covariance: total / (count * count) + common(channels),
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
            let lines = LineCovariance { row: line(0), column: line(1), ..Default::default() };
            let variance = [1.0, 2.0, 0.5][k] + lines.row[k] + lines.column[k];
            let moments = MeanVariance { mean: [3.0, 7.0, 4.0][k], variance };
            Prediction { moments, third: 0.2 + 0.3 * k as f64, excess_kurtosis: 0.3, sixth: 0.0, common: 0.0, lines }
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
        let three = sampling(&sites(), &[Grid::of_planes(region, [0, 0])]);
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
        let third: f64 = places.iter().zip(&offsets).map(|(at, off)| sites()[class(*at)].third * off).sum();
        let third = third * (1.0 - 1.0 / n as f64);
        let p = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
        let pc = &p * &c;
        let found = array.of_plane(&sites());
        let expected = PlaneScatter {
            mean_variance: c.sum() / (n * n) as f64,
            sample: MeanVariance {
                mean: (pc.trace() + offsets.norm_squared()) / (n as f64 - 1.0),
                variance: (2.0 * (&pc * &pc).trace() + 4.0 * (offsets.dot(&(&c * &offsets)) + third) + fourth)
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
