//! What the pixels of a rectangle have together of each knot of a drift of the black level.
//!
//! Pixel a has V_i(a; m) of the number m: a knot has one, or where a flat field divided them as many as [`NUMBERS`], one after another. With
//! g = Σ_a V(a), and T_ij(m, m′) = Σ_a V_i(a; m) V_j(a; m′), which has a few diagonals, two pixels have the covariance
//! D_ij(a, b) = Σ_m V_i(a; m) V_j(b; m), and
//!
//! - Σ_a D(a, a) = Σ_m T(m, m),  Σ_ab D = g gᵀ
//! - Σ_ab D_ik D_jl = Σ_mm′ T_ij(m, m′) T_kl(m, m′)

use super::covariance::PAIRS;
use super::drift::NUMBERS;
use super::line_sampling::Powers;
use crate::stages::demosaic::stencil::REACH;
use nalgebra::{Matrix3, Vector3};

/// Knots that the rows of a stencil meet: there are two rows at least from one to the next.
const KNOTS: usize = REACH.unsigned_abs() + 3;

/// The numbers of these.
pub(super) const WIDTH: usize = NUMBERS * KNOTS;

/// g and T.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bands {
    /// g.
    pub sums: Vec<Vector3<f64>>,
    /// T(m, m + δ).
    pub products: Vec<[Matrix3<f64>; WIDTH]>,
}

impl Bands {
    /// Of so many numbers, nothing yet.
    pub fn zero(numbers: usize) -> Self {
        Self { sums: vec![Vector3::zeros(); numbers], products: vec![[Matrix3::zeros(); WIDTH]; numbers] }
    }

    /// Σ_a D(a, a).
    pub fn variance(&self) -> Matrix3<f64> {
        self.products.iter().map(|band| band[0]).sum()
    }

    /// Σ_ab D.
    pub fn total(&self) -> Matrix3<f64> {
        self.sums.iter().map(|sum| sum * sum.transpose()).sum()
    }

    /// T(m, m′) of all m and m′ that have one.
    pub fn each(&self) -> impl Iterator<Item = (usize, usize, Matrix3<f64>)> + '_ {
        self.products.iter().enumerate().flat_map(|(m, of_knot)| {
            of_knot.iter().enumerate().flat_map(move |(apart, band)| {
                let both = match (*band == Matrix3::zeros(), apart) {
                    (true, _) => 0,
                    (false, 0) => 1,
                    (false, _) => 2,
                };
                [(m, m + apart, *band), (m + apart, m, band.transpose())].into_iter().take(both)
            })
        })
    }

    /// Σ_ab D_ik D_jl + D_il D_jk, by pairs of channels.
    pub fn products_of_pairs(&self) -> [[f64; 6]; 6] {
        let mut found = [[0.0; 6]; 6];
        for (_, _, t) in self.each() {
            for (row, [i, j]) in found.iter_mut().zip(PAIRS) {
                for (entry, [k, l]) in row.iter_mut().zip(PAIRS) {
                    *entry += t[(i, j)] * (t[(k, l)] + t[(l, k)]);
                }
            }
        }
        found
    }

    /// T x of a channel.
    pub fn times(&self, channel: usize, x: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut found = vec![0.0; self.sums.len()];
        for (m, n, t) in self.each() {
            if t[(channel, channel)] != 0.0 {
                found[m] += t[(channel, channel)] * x(n);
            }
        }
        found
    }

    /// What powers of a channel's covariance are made of.
    pub fn powers(&self, channel: usize) -> Powers {
        let length = self.products.len();
        let entry = |m: usize, n: usize| {
            let (low, high) = (m.min(n), m.max(n));
            self.products[low].get(high - low).map_or(0.0, |band| band[(channel, channel)])
        };
        let near = |m: usize| m.saturating_sub(WIDTH - 1)..(m + WIDTH).min(length);
        let [mut one, mut two, mut three, mut square, mut cube] = [0.0; 5];
        for m in 0..length {
            one += entry(m, m);
            let of_sums: f64 = near(m).map(|n| entry(m, n) * self.sums[n][channel]).sum();
            square += self.sums[m][channel] * of_sums;
            cube += of_sums * of_sums;
            for n in near(m) {
                two += entry(m, n).powi(2);
                three += near(n).map(|l| entry(m, n) * entry(n, l) * entry(l, m)).sum::<f64>();
            }
        }
        Powers { traces: [one, two, three], of_row_sums: [square, cube] }
    }
}
