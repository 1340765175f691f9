//! What rows of a frame share by the drift of its black level, however far apart.
//!
//! Row y has b_j(y) z_j + b_j+1(y) z_j+1, z the normal numbers of knots, b = cos(πt/2) and sin(πt/2) ([`knots`]). Over a set
//! of photosites, C_y of row y and n together, the covariance V = B Bᵀ has as many dimensions as knots; with P the projection that
//! takes off the mean, T = BᵀB (tridiagonal) and g = Bᵀ1,
//!
//! - 1ᵀV1 = gᵀg
//! - tr PVP = n − gᵀg/n
//! - tr (PVP)² = tr T² − 2 gᵀTg/n + (gᵀg)²/n²
//! - tr (PVP)³ = tr T³ − 3 gᵀT²g/n + 3 gᵀTg gᵀg/n² − (gᵀg)³/n³
//!
//! Over places of rows, rows δ knots apart have the covariance (1 − δ/2) cos(πδ/2) + sin(πδ/2)/π up to δ = 2, and none beyond.

use crate::stages::noise::knots;
use std::f64::consts::{FRAC_PI_2, PI};

/// Independent numbers of a knot at most: that of a frame, and that of the flat field by which it was divided.
pub const NUMBERS: usize = 2;

/// Rows of the sensor of which photosites are taken: the first, from one to the next, how many, and photosites of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftRows {
    /// The first, on the sensor.
    pub first: i64,
    /// From one to the next.
    pub step: i64,
    /// How many.
    pub count: usize,
    /// Photosites of each.
    pub columns: f64,
}

/// What photosites of such rows share, of a drift of variance 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Drift {
    count: f64,
    first_knot: i64,
    rows_per_knot: f64,
    /// Diagonal of T, what is beside it, and g.
    diagonal: Vec<f64>,
    beside: Vec<f64>,
    sums: Vec<f64>,
}

impl Drift {
    /// Of photosites of rows, of a sensor that has so many rows from knot to knot.
    pub fn of(all: &[DriftRows], rows_per_knot: f64) -> Self {
        let ends = all.iter().filter(|rows| rows.count > 0).map(|rows| {
            let last = rows.first + rows.step * (rows.count as i64 - 1);
            [knots(rows.first, rows_per_knot).0, knots(last, rows_per_knot).0 + 1]
        });
        let [first_knot, last] = ends.fold([i64::MAX, i64::MIN], |[a, b], [c, d]| [a.min(c), b.max(d)]);
        let length = usize::try_from(last.saturating_sub(first_knot)).unwrap_or_default() + 1;
        let [mut diagonal, mut beside, mut sums] = [(); 3].map(|()| vec![0.0; length]);
        let mut count = 0.0;
        for rows in all {
            count += rows.columns * rows.count as f64;
            for y in (0..rows.count).map(|index| rows.first + rows.step * index as i64) {
                let (knot, [a, b]) = knots(y, rows_per_knot);
                let j = usize::try_from(knot - first_knot).unwrap_or_default();
                diagonal[j] += rows.columns * a * a;
                diagonal[j + 1] += rows.columns * b * b;
                beside[j] += rows.columns * a * b;
                sums[j] += rows.columns * a;
                sums[j + 1] += rows.columns * b;
            }
        }
        Self { count, first_knot, rows_per_knot, diagonal, beside, sums }
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let at = |j: Option<usize>| j.and_then(|j| x.get(j)).copied().unwrap_or_default();
        let row = |j: usize| {
            let before = j.checked_sub(1);
            let of_before = before.map_or(0.0, |before| self.beside[before]);
            of_before * at(before) + self.diagonal[j] * x[j] + self.beside[j] * at(Some(j + 1))
        };
        (0..x.len()).map(row).collect()
    }

    fn square(&self) -> f64 {
        dot(&self.sums, &self.sums)
    }

    /// Variance of the mean.
    pub fn of_mean(&self) -> f64 {
        self.square() / (self.count * self.count)
    }

    /// Traces of PVP, of its square and of its cube.
    pub fn traces(&self) -> [f64; 3] {
        let n = self.count;
        let (g, of_g) = (&self.sums, self.times(&self.sums));
        let [gg, gtg, gttg] = [dot(g, g), dot(g, &of_g), dot(&of_g, &of_g)];
        let d = &self.diagonal;
        let squares: f64 = d.iter().map(|d| d * d).sum::<f64>() + 2.0 * self.beside.iter().map(|b| b * b).sum::<f64>();
        // tr T³ of a tridiagonal matrix: each step aside and back meets the diagonal at either end.
        let aside = |j: usize| self.beside[j].powi(2) * (d[j] + d.get(j + 1).copied().unwrap_or_default());
        let cubes = d.iter().map(|d| d.powi(3)).sum::<f64>() + 3.0 * (0..d.len()).map(aside).sum::<f64>();
        [
            (n - gg / n).max(0.0),
            (squares - 2.0 * gtg / n + (gg / n).powi(2)).max(0.0),
            (cubes - 3.0 * gttg / n + 3.0 * gtg * gg / (n * n) - (gg / n).powi(3)).max(0.0),
        ]
    }

    /// The covariance of a photosite of a row with the mean.
    fn with_mean(&self, y: i64) -> f64 {
        let (knot, [a, b]) = knots(y, self.rows_per_knot);
        let sum = |knot: i64| usize::try_from(knot - self.first_knot).ok().and_then(|j| self.sums.get(j)).copied();
        (a * sum(knot).unwrap_or_default() + b * sum(knot + 1).unwrap_or_default()) / self.count
    }

    /// Sums of PVP over pairs of photosites that have a row of these in common, and over pairs of one column: tr (PVP J).
    pub fn with_lines(&self, rows: &DriftRows) -> [f64; 2] {
        let of_mean = self.of_mean();
        let means: f64 = (0..rows.count).map(|index| self.with_mean(rows.first + rows.step * index as i64)).sum();
        let count = rows.count as f64;
        let own = Self::of(&[DriftRows { columns: 1.0, ..*rows }], self.rows_per_knot).square();
        [
            rows.columns * rows.columns * (count - 2.0 * means + count * of_mean),
            rows.columns * (own - 2.0 * count * means + count * count * of_mean),
        ]
    }

    /// Σ (Σ x)² of what the drift makes of a sum over photosites, `sum` telling that of the weights of each row.
    pub fn of_sums(all: &[DriftRows], rows_per_knot: f64, weights: &[f64]) -> f64 {
        let weighted: Vec<DriftRows> = all
            .iter()
            .zip(weights)
            .map(|(rows, weight)| DriftRows { columns: rows.columns * weight, ..*rows })
            .collect();
        Self::of(&weighted, rows_per_knot).square()
    }
}

/// What the mean of some rows has of each knot of a drift.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct KnotMeans {
    first: i64,
    means: Vec<f64>,
}

impl KnotMeans {
    /// Of rows of the sensor, the first of them, from one to the next and how many; of none nothing.
    pub fn of(rows: &DriftRows, rows_per_knot: f64) -> Self {
        let Drift { count, first_knot, sums, .. } = Drift::of(&[DriftRows { columns: 1.0, ..*rows }], rows_per_knot);
        match count > 0.0 {
            true => Self { first: first_knot, means: sums.iter().map(|sum| sum / count).collect() },
            false => Self { first: 0, means: Vec::new() },
        }
    }

    /// Of rows of the sensor, from the first on, of which the mean has such shares.
    pub fn of_shares(first: i64, shares: &[f64], rows_per_knot: f64) -> Self {
        let base = knots(first, rows_per_knot).0;
        let mut means = Vec::new();
        for (index, share) in shares.iter().enumerate() {
            let (knot, parts) = knots(first + index as i64, rows_per_knot);
            let place = usize::try_from(knot - base).unwrap_or_default();
            means.resize((place + 2).max(means.len()), 0.0);
            (0..2).for_each(|part| means[place + part] += share * parts[part]);
        }
        Self { first: base, means }
    }

    /// Of a knot.
    pub fn at(&self, knot: i64) -> f64 {
        let place = usize::try_from(knot - self.first).ok();
        place.and_then(|place| self.means.get(place)).copied().unwrap_or_default()
    }

    /// The covariance of two of these, of a drift of variance 1.
    pub fn between(&self, other: &Self) -> f64 {
        (self.first..).zip(&self.means).map(|(knot, mean)| mean * other.at(knot)).sum()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Places between two knots over which what is curved in a drift is told.
pub const PLACES: [f64; 8] = [0.0625, 0.1875, 0.3125, 0.4375, 0.5625, 0.6875, 0.8125, 0.9375];

/// Covariance of rows at two places, in knots, of a drift of variance 1.
pub fn between(one: f64, other: f64) -> f64 {
    let [(j, [a, b]), (k, [c, d])] = [one, other].map(|place| {
        let angle = FRAC_PI_2 * (place - place.floor());
        #[expect(clippy::cast_possible_truncation, reason = "a few rows about a pixel")]
        (place.floor() as i64, [libm::cos(angle), libm::sin(angle)])
    });
    match k - j {
        0 => a * c + b * d,
        1 => b * c,
        -1 => a * d,
        _ => 0.0,
    }
}

/// Covariance of rows so many knots apart, over their places, of a drift of variance 1.
pub fn covariance(knots_apart: f64) -> f64 {
    let delta = knots_apart.abs();
    if delta >= 2.0 {
        return 0.0;
    }
    let angle = FRAC_PI_2 * delta;
    (1.0 - 0.5 * delta) * libm::cos(angle) + libm::sin(angle) / PI
}

/// Variance of the mean of so many rows, over their places, of a drift of variance 1.
pub fn of_mean_of_rows(rows: usize, rows_per_knot: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let farthest = rows.min((2.0 * rows_per_knot).ceil() as usize);
    let n = rows as f64;
    let apart = (1..farthest).map(|lag| 2.0 * (n - lag as f64) * covariance(lag as f64 / rows_per_knot));
    (n + apart.sum::<f64>()) / (n * n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[allow(clippy::cast_possible_truncation, reason = "a few columns")]
    fn matrix(rows: &[DriftRows], per_knot: f64) -> (Vec<(i64, usize, usize)>, DMatrix<f64>) {
        let sites: Vec<(i64, usize, usize)> = rows
            .iter()
            .enumerate()
            .flat_map(|(grid, rows)| {
                let columns = 0..rows.columns as usize;
                (0..rows.count)
                    .flat_map(move |i| columns.clone().map(move |x| (rows.first + rows.step * i as i64, x, grid)))
            })
            .collect();
        let level = |y: i64, knot: i64| {
            let (first, [a, b]) = knots(y, per_knot);
            if knot == first {
                a
            } else if knot == first + 1 {
                b
            } else {
                0.0
            }
        };
        let v = DMatrix::from_fn(sites.len(), sites.len(), |a, b| {
            (-40..40).map(|knot| level(sites[a].0, knot) * level(sites[b].0, knot)).sum()
        });
        (sites, v)
    }

    /// Sums of a thousand numbers of one size: relative 10⁻¹².
    #[test]
    fn traces_are_those_of_full_matrices() {
        let one = [DriftRows { first: -7, step: 1, count: 19, columns: 5.0 }];
        let two = [
            DriftRows { first: -6, step: 2, count: 9, columns: 4.0 },
            DriftRows { first: -5, step: 2, count: 8, columns: 3.0 },
        ];
        for (rows, per_knot) in [(&one[..], 4.0), (&one[..], 5.5), (&one[..], 1000.0), (&two[..], 3.2), (&two[..], 2.0)]
        {
            let (sites, v) = matrix(rows, per_knot);
            let n = sites.len();
            let p = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
            let u = &p * &v * &p;
            let drift = Drift::of(rows, per_knot);
            let close = |found: f64, expected: f64| {
                assert!((found - expected).abs() < 1e-10 * n as f64, "{per_knot}: {found} {expected}");
            };
            close(drift.of_mean(), v.sum() / (n * n) as f64);
            let [one, two, three] = drift.traces();
            close(one, u.trace());
            close(two, (&u * &u).trace());
            close(three, (&u * &u * &u).trace());
            for (grid, rows) in rows.iter().enumerate() {
                let sum = |is_pair: &dyn Fn(usize, usize) -> bool| -> f64 {
                    let all = (0..n).flat_map(|a| (0..n).map(move |b| (a, b)));
                    let here = all.filter(|(a, b)| sites[*a].2 == grid && sites[*b].2 == grid && is_pair(*a, *b));
                    here.map(|(a, b)| u[(a, b)]).sum()
                };
                let [of_rows, of_columns] = drift.with_lines(rows);
                close(of_rows, sum(&|a, b| sites[a].0 == sites[b].0));
                close(of_columns, sum(&|a, b| sites[a].1 == sites[b].1));
            }
        }
    }

    /// The mean over places of the sums over knots: of whole numbers of rows from knot to knot it is exact as their number grows, off
    /// by the rule of trapezoids, 10⁻⁵ of 500.
    #[test]
    fn the_covariance_over_places_is_that_of_the_law() {
        let per_knot = 500;
        for lag in [0, 3, 120, 499, 500, 731, 999, 1000, 1500] {
            let of_place = |y: i64| -> f64 {
                let ((j, [a, b]), (k, [c, d])) = (knots(y, per_knot as f64), knots(y + lag, per_knot as f64));
                match k - j {
                    0 => a * c + b * d,
                    1 => b * c,
                    _ => 0.0,
                }
            };
            let mean = (0..per_knot).map(of_place).sum::<f64>() / per_knot as f64;
            assert!((mean - covariance(lag as f64 / per_knot as f64)).abs() < 1e-5, "{lag}: {mean}");
        }
        let rows = DriftRows { first: 0, step: 1, count: 40, columns: 1.0 };
        let over_places =
            (0..7).map(|first| Drift::of(&[DriftRows { first, ..rows }], 7.0).of_mean()).sum::<f64>() / 7.0;
        assert!((over_places / of_mean_of_rows(40, 7.0) - 1.0).abs() < 2e-2, "{over_places}");
    }
}
