//! Sums over the pixels of a rectangle of what they share by rows and columns, where several amplifiers have a part in them.
//!
//! Pixel a has ℓ_a(r, ρ) of the factor ρ of row r, of the variance λ_ρ ([`tapped_factors`](super::tapped_factors)), so that R_ij = L_i Λ L_jᵀ, and
//! what is known of all pixels is known of all pairs of rows within reach of one pixel:
//!
//! - M_ij(r, r′) = Σ_a ℓ_a,i(r) ℓ_a,j(r′)ᵀ,  tr R_ik R_lj = Σ_rr′ λ λ′ M_ij M_kl,  tr R³ = Σ λ λ′ λ″ M(r, r′) M(r′, r″) M(r″, r)
//! - T_i(r) = Σ_a ℓ_a,i(r),  1ᵀR_ij 1 = Σ_r λ T_i T_j, and with the distances of means from that of all, T_ik(r) = Σ_a ℓ_a,i(r) d_k
//! - with columns c, X_ij(r, c) = Σ_a ℓ_a,i(r) ν_a,j(c)ᵀ,  tr R_ik S_lj = Σ_rc λ λ′ X_ij X_kl
//!
//! Rows that are alike as far as this reaches are gone through once, and pixels of a row by the kinds of their columns.

use super::covariance::PAIRS;
use super::line_sampling::{Nonlocal, Powers, sum_of};
use super::tapped::{Kind, TappedPixels};
use super::tapped_drift::{DriftShares, RowProducts};
use super::tapped_lines::{Lines, crossing};
use crate::stages::demosaic::stencil::REACH;
use nalgebra::Matrix3;

/// What the pixels of a rectangle share.
pub(super) struct Shares<'a> {
    pixels: &'a TappedPixels,
    /// By rows and by columns.
    lines: [Lines<'a>; 2],
    /// By rows that are near each other.
    drift: Option<DriftShares<'a>>,
}

impl<'a> Shares<'a> {
    /// Of pixels whose photosites share rows or columns; none of others.
    pub fn of(pixels: &'a TappedPixels) -> Option<Self> {
        let shared = pixels.array.moments.shared.as_ref()?;
        let lines = [0, 1].map(|axis| Lines::of(pixels, &shared.lines[axis], axis, axis));
        let drift = shared.drift.as_ref().map(|drift| DriftShares::of(pixels, drift));
        Some(Self { pixels, lines, drift })
    }

    /// What two pixels share that are so far apart, the first of them in a line; of a drift on average over lines of its kind.
    pub fn covariance(&self, pixel: &Kind, other: &Kind, line: usize, lag: [isize; 2]) -> Matrix3<f64> {
        let of_axis = |lines: &Lines<'_>| {
            let (mine, theirs) = (lines.loads(pixel), lines.loads(other));
            let both = mine.zip(theirs);
            both.map(|(mine, theirs)| mine.covariance(theirs, lag[1 - lines.axis], &lines.factors.values))
        };
        let of_drift = self.drift.as_ref().map(|drift| drift.covariance(pixel, other, line, lag[1]));
        self.lines.iter().filter_map(of_axis).sum::<Matrix3<f64>>() + of_drift.unwrap_or_default()
    }

    /// What a pixel of a line shares with the sum of all by the drift, and of each channel, with the sum of all times their distances in it.
    pub fn drift_sum(&self, pixel: &Kind, line: usize) -> (Matrix3<f64>, [f64; 3]) {
        self.drift.as_ref().map_or((Matrix3::zeros(), [0.0; 3]), |drift| drift.row_sum(pixel, line))
    }

    /// Σ over all of the squares of the latter, by channel.
    pub fn squares_of_drift(&self) -> [f64; 3] {
        self.drift.as_ref().map_or([0.0; 3], DriftShares::squares_of_distances)
    }

    /// What a pixel at a place shares with the sum of all but for the drift, and of each channel, with the sum of all times their distances in
    /// it.
    pub fn row_sum(&self, pixel: &Kind, at: [usize; 2]) -> (Matrix3<f64>, [f64; 3]) {
        let (mut found, mut moved) = (Matrix3::zeros(), [0.0; 3]);
        for lines in &self.lines {
            let (Some(loads), line) = (lines.loads(pixel), at[1 - lines.axis]) else { continue };
            for offset in -REACH..=REACH {
                let Some(there) = line.checked_add_signed(offset) else { continue };
                for ((load, (total, of_distances)), value) in
                    loads.at(offset).iter().zip(lines.total(there)).zip(&lines.factors.values)
                {
                    found += *value * Matrix3::from_fn(|i, k| load[i] * total[k]);
                    (0..3).for_each(|i| moved[i] += value * load[i] * of_distances[(i, i)]);
                }
            }
        }
        (found, moved)
    }

    /// Σ over all of d_i C_jl d_k + d_i C_jk d_l + d_j C_il d_k + d_j C_ik d_l, by pairs ij and kl.
    pub fn of_distances(&self) -> [[f64; 6]; 6] {
        let mut found = [[0.0; 6]; 6];
        for lines in &self.lines {
            for ((_, times), totals) in lines.examples.iter().zip(&lines.totals) {
                for ((_, t), value) in totals.iter().zip(&lines.factors.values) {
                    let both = PAIRS.map(|[i, j]| t[(i, j)] + t[(j, i)]);
                    for a in 0..6 {
                        (0..6).for_each(|b| found[a][b] += times * value * both[a] * both[b]);
                    }
                }
            }
        }
        self.drift.as_ref().map_or(found, |drift| sum_of(&found, &drift.of_distances()))
    }

    /// Sums of all that is shared; what meets what is a photosite's own is not among them.
    pub fn sums(&self, row_products: &RowProducts) -> Nonlocal {
        let [(of_rows, mut products, of_row), (of_columns, more, of_column)] =
            self.lines.each_ref().map(|lines| lines.sums(self.pixels));
        products.iter_mut().flatten().zip(more.iter().flatten()).for_each(|(sum, more)| *sum += more);
        let [rows, columns] = &self.lines;
        for (line, of_line) in &rows.examples {
            for (column, of_column) in &columns.examples {
                for (index, x) in crossing(self.pixels, [rows, columns], [*line, *column]).into_iter().enumerate() {
                    let (a, b) = (index / columns.rank(), index % columns.rank());
                    let times = of_line * of_column * rows.factors.values[a] * columns.factors.values[b];
                    for a in 0..6 {
                        (0..6).for_each(|b| products[a][b] += times * x[a] * x[b]);
                    }
                }
            }
        }
        let count = self.pixels.count();
        let powers =
            |powers: &[Powers; 3], total: &Matrix3<f64>| [0, 1, 2].map(|i| powers[i].projected(total[(i, i)], count));
        let powers = [powers(&of_row, &of_rows), powers(&of_column, &of_columns), [[0.0; 3]; 3]];
        let lines = Nonlocal { total: of_rows + of_columns, products, row_products: row_products.lines, powers };
        match &self.drift {
            Some(drift) => self.with_drift(drift, lines, &row_products.with_drift),
            None => lines,
        }
    }

    /// The same with the drift beside what is shared else, `of_rows` the products of row sums of both.
    fn with_drift(&self, drift: &DriftShares<'_>, lines: Nonlocal, of_rows: &[[f64; 6]; 6]) -> Nonlocal {
        let count = self.pixels.count();
        let both = drift.products_with(self.pixels, &self.lines);
        let total = drift.total();
        let of_drift = [0, 1, 2].map(|i| {
            let [one, two, three] = drift.powers(i, count);
            // What other things rows and columns share adds to these as much as one trace of both tells.
            let pair = PAIRS.iter().position(|pair| *pair == [i, i]).unwrap_or_default();
            let totals = lines.total[(i, i)] * total[(i, i)];
            let together = (both[pair][pair] - of_rows[pair][pair] / count) / 4.0 + totals / (count * count);
            let beside = if one > 0.0 { together.max(0.0) / one } else { 0.0 };
            [one, two + 2.0 * beside * one, three + 3.0 * beside * (two + beside * one)]
        });
        let [rows, columns, _] = lines.powers;
        Nonlocal {
            total: lines.total + total,
            products: sum_of(&sum_of(&lines.products, &both), &drift.products()),
            row_products: sum_of(&sum_of(&lines.row_products, of_rows), &drift.row_products()),
            powers: [rows, columns, of_drift],
        }
    }
}
