//! What a drift of the black level adds to the sums over the pixels of a rectangle of which [`super::sampling`] is made.
//!
//! Row r of the sensor has Σ_m b_m(r) z_m, z the normal numbers of knots ([`knots`]), and photosites of class k have κ_k times that. A
//! pixel a whose channel i gives row r the weights A_rk thus has V_i(a; m) = Σ_rk κ_k A_rk b_m(r) of the knot m, and two have the
//! covariance D_ij(a, b) = Σ_m V_i(a; m) V_j(b; m). With g = Σ_a V(a), and T_ij(m, m′) = Σ_a V_i(a; m) V_j(a; m′), which has a few
//! diagonals,
//!
//! - Σ_ab D = g gᵀ, and the row sums are V(a) gᵀ
//! - Σ_ab D_ik D_jl = Σ_mm′ T_ij(m, m′) T_kl(m, m′)
//!
//! Where a flat field divided them a knot has two numbers, each with a κ of its own, which count as two.
//!
//! Pixels of one row and parity have one V. So the products with what is each photosite's own, or shared by row or column, are sums over rows
//! of what these have together in all columns, which far from the edges is the same in every other row.

use super::covariance::PAIRS;
use super::drift_bands::{Bands, WIDTH};
use super::line_sampling::{AxisSums, Nonlocal, Shared, add_both, sum_of};
use super::mixed_pixel::pixels_of;
use super::moments::SiteCovariance;
use super::place::{Place, add_products, steps};
use super::row_drift::RowDrift;
use crate::stages::demosaic::stencil::REACH;
use crate::stages::demosaic::weights::Weights;
use crate::stages::noise::knots;
use nalgebra::{Matrix3, Vector3};

/// Products of two covariances by pairs of channels, and those of their row sums in both orders.
pub(super) struct Products {
    /// Σ_ab C_ik C_jl + C_il C_jk.
    pub of_pairs: [[f64; 6]; 6],
    /// The same of row sums.
    pub of_rows: [[f64; 6]; 6],
}

/// Sums over the pixels of a rectangle.
pub(super) struct DriftSums {
    /// Σ_a D(a, a) and Σ_ab D.
    pub variance: Matrix3<f64>,
    pub total: Matrix3<f64>,
    /// Of the drift with itself and with what else rows and columns share.
    pub shared: Products,
    /// Of the drift with what is each photosite's own.
    pub with_own: Products,
    /// Σ λ, Σ λ² and Σ λ³ as the mean leaves them, for each channel.
    pub powers: [[f64; 3]; 3],
}

/// What a pixel has of each number of the knots, from the first on.
#[derive(Clone, Copy)]
struct Loads {
    first: usize,
    of_numbers: [Vector3<f64>; WIDTH],
}

impl Loads {
    fn covariance(&self, other: &Self) -> Matrix3<f64> {
        let mine = self.of_numbers.iter().enumerate();
        mine.filter_map(|(k, mine)| {
            let theirs = other.of_numbers.get((self.first + k).checked_sub(other.first)?)?;
            Some(mine * theirs.transpose())
        })
        .sum()
    }

    /// Σ_m V(m) xᵀ(m).
    fn with(&self, all: &[Vector3<f64>]) -> Matrix3<f64> {
        self.of_numbers.iter().zip(&all[self.first..]).map(|(mine, sum)| mine * sum.transpose()).sum()
    }
}

/// The pixels of a rectangle, by row and parity of their column.
struct Lines {
    /// Pixels of a row, by parity.
    counts: [f64; 2],
    loads: Vec<[Loads; 2]>,
    bands: Bands,
}

impl Lines {
    fn of(rows: &Shared, drift: &RowDrift, place: &Place) -> Self {
        let first_row = i64::from(place.origin[1]) + place.corner[1] as i64;
        let of_row = |row: i64| knots(row, drift.rows_per_knot);
        let reach = REACH as i64;
        let base = of_row(first_row - reach).0;
        let place_of = |knot: i64| usize::try_from(knot - base).unwrap_or_default();
        let loads: Vec<[Loads; 2]> = (0..place.size[1])
            .map(|t| {
                let row = first_row + t as i64;
                let first = of_row(row - reach).0;
                [0, 1].map(|p| {
                    let mut of_numbers = [Vector3::zeros(); WIDTH];
                    for (line, weights) in rows.profile(t, p).iter().enumerate() {
                        let load = drift.load(weights);
                        let (knot, [a, b]) = of_row(row - reach + line as i64);
                        let k = usize::try_from(knot - first).unwrap_or_default();
                        for (part, load) in load.column_iter().take(drift.rank).enumerate() {
                            of_numbers[k * drift.rank + part] += a * load;
                            of_numbers[(k + 1) * drift.rank + part] += b * load;
                        }
                    }
                    Loads { first: place_of(first) * drift.rank, of_numbers }
                })
            })
            .collect();
        let counts = rows.counts();
        let length = loads.last().map_or(0, |[last, _]| last.first) + WIDTH;
        let mut bands = Bands::zero(length);
        for (loads, count) in loads.iter().flat_map(|both| both.iter().zip(counts)) {
            for (k, load) in loads.of_numbers.iter().enumerate() {
                bands.sums[loads.first + k] += count * load;
                for (apart, other) in loads.of_numbers[k..].iter().enumerate() {
                    bands.products[loads.first + k][apart] += count * load * other.transpose();
                }
            }
        }
        Self { counts, loads, bands }
    }

    fn row_sum(&self, t: usize, p: usize) -> Matrix3<f64> {
        self.loads[t][p].with(&self.bands.sums)
    }
}

impl DriftSums {
    /// Of the pixels of a place, of photosites that share so much; the place has its rows on the sensor. None where nothing drifts.
    pub fn of(weights: &Weights, sites: &SiteCovariance, place: &Place) -> Option<Self> {
        let drift = RowDrift::of(sites)?;
        let others = sites.without_drift();
        let rows = Shared::of(weights, &others.row, 0, place, place.size[0]);
        let lines = Lines::of(&rows, &drift, place);
        let mut sums = Self {
            variance: lines.bands.variance(),
            total: lines.bands.total(),
            shared: Products::none(),
            with_own: Products::none(),
            powers: Default::default(),
        };
        let pixels = (place.size[0] * place.size[1]) as f64;
        let columns = AxisSums::of(weights, &others.column, 1, place);
        let of_rows = sums.shared.add_rows(&lines, &rows);
        sums.shared.add_columns(&lines, &columns);
        let others = of_rows + columns.total;
        sums.powers = [0, 1, 2].map(|i| {
            let [one, two, three] = lines.bands.powers(i).projected(sums.total[(i, i)], pixels);
            // What other things rows and columns share adds to these as much as one trace of both tells.
            let together = sums.shared.trace(i, others[(i, i)] * sums.total[(i, i)], pixels);
            let beside = if one > 0.0 { together.max(0.0) / one } else { 0.0 };
            [one, two + 2.0 * beside * one, three + 3.0 * beside * (two + beside * one)]
        });
        sums.shared.add_itself(&lines);
        sums.with_own.add_own(&lines, &OwnLines::of(weights, sites.own, place));
        Some(sums)
    }

    /// Adds what rows share by it to what they share otherwise.
    pub fn add_to(&self, shared: &mut Nonlocal) {
        shared.total += self.total;
        shared.products = sum_of(&shared.products, &self.shared.of_pairs);
        shared.row_products = sum_of(&shared.row_products, &self.shared.of_rows);
        shared.powers[2] = self.powers;
    }
}

impl Products {
    fn none() -> Self {
        Self { of_pairs: [[0.0; 6]; 6], of_rows: [[0.0; 6]; 6] }
    }

    /// Of the row sums of a pixel by the drift and of what all pixels like it have otherwise.
    fn add_row_sums(&mut self, of_drift: &Matrix3<f64>, others: &Matrix3<f64>) {
        add_both(&mut self.of_rows, of_drift, others);
        add_both(&mut self.of_rows, &of_drift.transpose(), &others.transpose());
    }

    fn add_itself(&mut self, lines: &Lines) {
        self.of_pairs = sum_of(&self.of_pairs, &lines.bands.products_of_pairs());
        for t in 0..lines.loads.len() {
            for p in 0..2 {
                let row_sum = lines.row_sum(t, p);
                add_products(&mut self.of_rows, &row_sum, lines.counts[p]);
                add_products(&mut self.of_rows, &row_sum.transpose(), lines.counts[p]);
            }
        }
    }

    /// tr PDPC of a channel, where these are the products of the two alone, whose sums have such a product.
    fn trace(&self, channel: usize, totals: f64, pixels: f64) -> f64 {
        let pair = PAIRS.iter().position(|pair| *pair == [channel, channel]).unwrap_or_default();
        (self.of_pairs[pair][pair] - self.of_rows[pair][pair] / pixels) / 4.0 + totals / (pixels * pixels)
    }

    /// Of the drift and what rows share alone; gives the sum of the latter over all pairs.
    fn add_rows(&mut self, lines: &Lines, rows: &Shared) -> Matrix3<f64> {
        let mut total = Matrix3::zeros();
        if rows.is_none() {
            return total;
        }
        for t in 0..lines.loads.len() {
            for p in 0..2 {
                let mut row_sum = Matrix3::zeros();
                for u in rows.near(t) {
                    for q in 0..2 {
                        let together = lines.counts[p] * lines.counts[q] * rows.covariance([p, t], [q, u]);
                        row_sum += together;
                        add_both(&mut self.of_pairs, &lines.loads[t][p].covariance(&lines.loads[u][q]), &together);
                    }
                }
                self.add_row_sums(&lines.row_sum(t, p), &row_sum);
                total += row_sum;
            }
        }
        total
    }

    fn add_columns(&mut self, lines: &Lines, columns: &AxisSums) {
        if columns.total == Matrix3::zeros() {
            return;
        }
        // Of the pixels of a column, by its parity and that of their row.
        let mut sums = [[(); 2]; 2].map(|of| of.map(|()| vec![Vector3::zeros(); lines.bands.sums.len()]));
        for (t, both) in lines.loads.iter().enumerate() {
            for (p, loads) in both.iter().enumerate() {
                let sums = sums[p][t % 2][loads.first..].iter_mut();
                sums.zip(&loads.of_numbers).for_each(|(sum, load)| *sum += load);
                self.add_row_sums(&lines.row_sum(t, p), &columns.row_sums[t % 2][p]);
            }
        }
        for [p, q, other_p, other_q] in (0..16).map(|bits| [0, 1, 2, 3].map(|bit| bits >> bit & 1)) {
            let both = sums[p][q].iter().zip(&sums[other_p][other_q]);
            let together: Matrix3<f64> = both.map(|(one, other)| one * other.transpose()).sum();
            add_both(&mut self.of_pairs, &together, &columns.by_parity[q][other_q][p][other_p]);
        }
    }

    fn add_own(&mut self, lines: &Lines, own: &OwnLines) {
        let height = lines.loads.len();
        for t in 0..height {
            for p in 0..2 {
                let mut row_sum = Matrix3::zeros();
                for u in t.saturating_sub(own.far)..(t + own.far + 1).min(height) {
                    for q in 0..2 {
                        let together = own.between([p, t], [q, u], height);
                        row_sum += together;
                        add_both(&mut self.of_pairs, &lines.loads[t][p].covariance(&lines.loads[u][q]), together);
                    }
                }
                self.add_row_sums(&lines.row_sum(t, p), &row_sum);
            }
        }
    }
}

/// Covariances of what is each photosite's own, of pixels of two rows and parities together in all columns.
struct OwnLines {
    /// Rows that pixels have photosites together with, on either side.
    far: usize,
    /// Rows that stand for all.
    rows: usize,
    /// By row and parity of the one, and of the other.
    sums: Vec<Matrix3<f64>>,
}

impl OwnLines {
    fn of(weights: &Weights, variances: [f64; 3], place: &Place) -> Self {
        let reach = weights.reach().unsigned_abs();
        let far = 2 * reach;
        let height = place.size[1];
        // Rows on either side that an edge of the frame is felt in, even by pixels that are as far again.
        let small = 2 * (far + reach) + 4;
        let rows = height.min(small + (height + small) % 2);
        let mut sums = vec![Matrix3::zeros(); 4 * rows * rows];
        for (width, share) in steps(place.size[0], weights.reach()) {
            let frame = [place.frame[0] - place.size[0] + width, place.frame[1] - height + rows];
            let small = Place { frame, size: [width, rows], ..*place };
            let pixels = pixels_of(weights, &small);
            for (a, pixel) in pixels.iter().enumerate() {
                let [x, y] = [a % width, a / width];
                for other_y in y.saturating_sub(far)..(y + far + 1).min(rows) {
                    for other_x in x.saturating_sub(far)..(x + far + 1).min(width) {
                        let lag = [other_x.cast_signed() - x.cast_signed(), other_y.cast_signed() - y.cast_signed()];
                        let other = &pixels[other_y * width + other_x];
                        sums[((2 * y + x % 2) * rows + other_y) * 2 + other_x % 2] +=
                            share * pixel.covariance(other, lag, variances);
                    }
                }
            }
        }
        Self { far, rows, sums }
    }

    /// Of two rows of a rectangle of so many.
    fn between(&self, [p, t]: [usize; 2], [q, u]: [usize; 2], height: usize) -> &Matrix3<f64> {
        let stand_in = if self.rows == height {
            t
        } else {
            let half = self.rows / 2 - 1;
            match (t, height - 1 - t) {
                (above, _) if above < half => above,
                (_, below) if below < half => self.rows - 1 - below,
                _ => half + (t + half) % 2,
            }
        };
        let other = (stand_in + u) - t;
        &self.sums[((2 * stand_in + p) * self.rows + other) * 2 + q]
    }
}
