//! What a drift of the black level makes of sums over rows, over its places among the knots.
//!
//! Photosites of class k have κ_k times the drift of their row, so that a channel that gives a row the weights A_k has q = Σ κ_k A_k of it.
//! Two channels have the covariance Σ_rs q_r q′_s c(r − s), c that of rows so far apart ([`drift::covariance`]), 1 of a row with itself. Where a
//! flat field divided them κ and q have two parts, of numbers that are independent, and q q′ is their product.

use super::drift::{self, NUMBERS};
use super::moments::SiteCovariance;
use crate::stages::demosaic::stencil::REACH;
use nalgebra::{Matrix3, Matrix3x2, RowVector2, Vector3};

/// What the sites of a row, or column, give to the three channels, by classes.
pub(super) type LineWeights = [[f64; 3]; 3];

/// What a row gives to the three channels, by parts.
pub(super) type Load = Matrix3x2<f64>;

/// κ of classes that share so much of a drift in one row, and how many parts it has: D = κ κᵀ, by the largest of what is left first.
fn loads(drift: &Matrix3<f64>) -> ([[f64; NUMBERS]; 3], usize) {
    /// What is left of a matrix of one part is rounding.
    const ROUNDING: f64 = 1e-12;
    let scales = [0, 1, 2].map(|k| drift[(k, k)].max(0.0).sqrt());
    let most = scales.into_iter().fold(0.0, f64::max).powi(2);
    let left = Matrix3::from_fn(|k, l| drift[(k, l)] - scales[k] * scales[l]);
    if left.amax() <= ROUNDING * most {
        return (scales.map(|scale| [scale, 0.0]), 1);
    }
    let mut left = *drift;
    let mut found = [[0.0; NUMBERS]; 3];
    for part in 0..NUMBERS {
        let largest = left.diagonal().imax();
        let value = left[(largest, largest)];
        if value <= ROUNDING * most {
            return (found, part.max(1));
        }
        let column = left.column(largest) / value.sqrt();
        (0..3).for_each(|k| found[k][part] = column[k]);
        left -= column * column.transpose();
    }
    (found, NUMBERS)
}

/// The drift of photosites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowDrift {
    /// κ of each class.
    pub loads: [[f64; NUMBERS]; 3],
    /// How many of its parts are not zero in all.
    pub rank: usize,
    /// Rows from one knot to the next.
    pub rows_per_knot: f64,
}

impl RowDrift {
    /// That of photosites of such covariances; none where they have none.
    pub fn of(sites: &SiteCovariance) -> Option<Self> {
        let (loads, rank) = loads(&sites.drift);
        sites.drifts().then_some(Self { loads, rank, rows_per_knot: sites.drift_rows })
    }

    /// What a row gives to the channels.
    pub fn load(&self, weights: &LineWeights) -> Load {
        weights.iter().zip(self.loads).map(|(weights, load)| Vector3::from(*weights) * RowVector2::from(load)).sum()
    }

    fn between(&self, rows_apart: isize) -> f64 {
        drift::covariance(rows_apart as f64 / self.rows_per_knot)
    }

    /// What rows that are not one add to the covariance of channels with others, of which both tell what each row gives.
    pub fn apart(&self, first: &[(isize, Load)], second: &[(isize, Load)]) -> Matrix3<f64> {
        let of = |(row, load): &(isize, Load)| -> Matrix3<f64> {
            let others = second.iter().filter(|(other, _)| other != row);
            let sum: Load = others.map(|(other, theirs)| self.between(row - other) * theirs).sum();
            load * sum.transpose()
        };
        first.iter().map(of).sum()
    }

    /// What rows that are not one add to the covariance of the mean of a patch of so many rows, of which those that differ are told: all of a
    /// low one; of a high one the rims and two between, which stand for all there by turns.
    pub fn apart_in_patch(&self, rows: &[(isize, Load)], height: usize) -> Matrix3<f64> {
        let margin = 2 * REACH.unsigned_abs();
        if rows.len() == height + margin {
            return self.apart(rows, rows);
        }
        let within = height - margin;
        let (upper, others) = rows.split_at(margin);
        let (turns, lower) = others.split_at(2);
        let rim: Vec<_> = upper.iter().chain(lower).copied().collect();
        let first = turns[0].0;
        let turn = |index: usize| turns[index % 2].1;
        // Farther rows share nothing.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let farthest = within.min((2.0 * self.rows_per_knot).ceil() as usize);
        let mut covariance = self.apart(&rim, &rim);
        for lag in 1..farthest {
            let pairs = within - lag;
            let [even, odd] = [pairs.div_ceil(2) as f64, (pairs / 2) as f64];
            let sum = even * turn(0) * turn(lag).transpose() + odd * turn(1) * turn(lag + 1).transpose();
            covariance += self.between(lag.cast_signed()) * (sum + sum.transpose());
        }
        for (row, load) in &rim {
            let last = first + within.cast_signed();
            let near = if *row < first {
                first..last.min(first + farthest.cast_signed())
            } else {
                first.max(last - farthest.cast_signed())..last
            };
            let sum: Load = near.map(|other| self.between(row - other) * turn((other - first).unsigned_abs())).sum();
            let product = load * sum.transpose();
            covariance += product + product.transpose();
        }
        covariance
    }
}
