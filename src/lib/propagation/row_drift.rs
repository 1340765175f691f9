//! What a drift of the black level makes of sums over rows, over its places among the knots.
//!
//! Photosites of class k have κ_k times the drift of their row, so that a channel that gives a row the weights A_k has q = Σ κ_k A_k of it.
//! Two channels have the covariance Σ_rs q_r q′_s c(r − s), c that of rows so far apart ([`drift::covariance`]), 1 of a row with itself.

use super::drift;
use super::moments::SiteCovariance;
use crate::stages::demosaic::stencil::REACH;
use nalgebra::{Matrix3, Vector3};

/// What the sites of a row, or column, give to the three channels, by classes.
pub(super) type LineWeights = [[f64; 3]; 3];

/// The drift of photosites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowDrift {
    /// Its rms in samples of each class.
    pub scales: [f64; 3],
    /// Rows from one knot to the next.
    pub rows_per_knot: f64,
}

impl RowDrift {
    /// That of photosites of such covariances; none where they have none.
    pub fn of(sites: &SiteCovariance) -> Option<Self> {
        let scales = [0, 1, 2].map(|k| sites.drift[(k, k)].max(0.0).sqrt());
        sites.drifts().then_some(Self { scales, rows_per_knot: sites.drift_rows })
    }

    /// What a row gives to the channels.
    pub fn load(&self, weights: &LineWeights) -> Vector3<f64> {
        weights.iter().zip(self.scales).map(|(weights, scale)| scale * Vector3::from(*weights)).sum()
    }

    fn between(&self, rows_apart: isize) -> f64 {
        drift::covariance(rows_apart as f64 / self.rows_per_knot)
    }

    /// What rows that are not one add to the covariance of channels with others, of which both tell what each row gives.
    pub fn apart(&self, first: &[(isize, Vector3<f64>)], second: &[(isize, Vector3<f64>)]) -> Matrix3<f64> {
        let of = |(row, load): &(isize, Vector3<f64>)| -> Matrix3<f64> {
            let others = second.iter().filter(|(other, _)| other != row);
            let sum: Vector3<f64> = others.map(|(other, theirs)| self.between(row - other) * theirs).sum();
            load * sum.transpose()
        };
        first.iter().map(of).sum()
    }

    /// What rows that are not one add to the covariance of the mean of a patch of so many rows, of which those that differ are told: all of a
    /// low one; of a high one the rims and two between, which stand for all there by turns.
    pub fn apart_in_patch(&self, rows: &[(isize, Vector3<f64>)], height: usize) -> Matrix3<f64> {
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
            let sum: Vector3<f64> =
                near.map(|other| self.between(row - other) * turn((other - first).unsigned_abs())).sum();
            let product = load * sum.transpose();
            covariance += product + product.transpose();
        }
        covariance
    }
}
