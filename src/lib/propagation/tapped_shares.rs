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
use super::line_sampling::{Nonlocal, Powers};
use super::tapped::{Kind, TappedPixels};
use super::tapped_factors::{Factors, Loads};
use crate::stages::demosaic::stencil::REACH;
use nalgebra::{DMatrix, DVector, Matrix3};
use std::collections::BTreeMap;

/// What the pixels of a rectangle share.
pub(super) struct Shares<'a> {
    pixels: &'a TappedPixels,
    /// By rows and by columns.
    lines: [Lines<'a>; 2],
}

/// What they share by the lines of one axis: by rows where it is 0, by columns where it is 1.
struct Lines<'a> {
    axis: usize,
    /// Lines that a pixel reaches to either side.
    reach: usize,
    factors: &'a Factors,
    /// The kinds of the lines that have a part in the rectangle, from the first on, and one of each with their number.
    first: usize,
    kinds: Vec<usize>,
    examples: Vec<(usize, f64)>,
    /// By kind, T of the channels and T of these and the distances, by factor.
    totals: Vec<Vec<([f64; 3], Matrix3<f64>)>>,
}

impl Lines<'_> {
    fn loads<'a>(&self, kind: &'a Kind) -> Option<&'a Loads> {
        kind.loads.as_ref().map(|loads| &loads[self.axis])
    }

    fn rank(&self) -> usize {
        self.factors.values.len()
    }

    /// Lines that have a part in the rectangle no farther from one than so many.
    fn near(&self, line: usize, far: usize) -> std::ops::Range<usize> {
        line.saturating_sub(far).max(self.first)..(line + far + 1).min(self.first + self.kinds.len())
    }

    /// The kinds of pixels of the lines of the rectangle within reach of one, each with how far it is from that and how many there are in its
    /// line.
    fn around<'p>(&self, pixels: &'p TappedPixels, line: usize) -> impl Iterator<Item = (&'p Kind, isize, f64)> {
        let [along, across] = [&pixels.array.axes[self.axis], &pixels.array.axes[1 - self.axis]];
        let reach = self.reach;
        let lines = line.saturating_sub(reach).max(across.lines.start)..(line + reach + 1).min(across.lines.end);
        let is_rows = self.axis == 0;
        lines.flat_map(move |t| {
            let place = move |p: usize| if is_rows { [p, t] } else { [t, p] };
            let offset = line.cast_signed() - t.cast_signed();
            along.examples.iter().map(move |(p, count)| (pixels.kind(place(*p)), offset, *count))
        })
    }

    fn total(&self, line: usize) -> &[([f64; 3], Matrix3<f64>)] {
        line.checked_sub(self.first).and_then(|index| self.kinds.get(index)).map_or(&[], |kind| &self.totals[*kind])
    }

    fn add_totals(&mut self, pixels: &TappedPixels) {
        let of_line = |line: usize| {
            let mut found = vec![([0.0; 3], Matrix3::zeros()); self.rank()];
            for (kind, offset, count) in self.around(pixels, line) {
                let Some(loads) = self.loads(kind) else { continue };
                let off = pixels.off(kind);
                for ((total, of_distances), load) in found.iter_mut().zip(loads.at(offset)) {
                    for i in 0..3 {
                        total[i] += count * load[i];
                        (0..3).for_each(|k| of_distances[(i, k)] += count * load[i] * off[k]);
                    }
                }
            }
            found
        };
        self.totals = self.examples.iter().map(|(line, _)| of_line(*line)).collect();
    }

    /// M of two lines: channel i and factor ρ stand at 3 ρ + i.
    fn gram(&self, pixels: &TappedPixels, [line, other]: [usize; 2]) -> DMatrix<f64> {
        let size = 3 * self.rank();
        let mut found = DMatrix::zeros(size, size);
        let lag = other.cast_signed() - line.cast_signed();
        for (kind, offset, count) in self.around(pixels, line) {
            let Some(loads) = self.loads(kind) else { continue };
            for (a, mine) in loads.at(offset).iter().enumerate() {
                if *mine == [0.0; 3] {
                    continue;
                }
                for (b, theirs) in loads.at(offset + lag).iter().enumerate() {
                    for i in 0..3 {
                        (0..3).for_each(|j| found[(3 * a + i, 3 * b + j)] += count * mine[i] * theirs[j]);
                    }
                }
            }
        }
        found
    }

    /// Σ_r λ Tᵀ T, and the products of pairs of channels, and for each channel the powers.
    fn sums(&self, pixels: &TappedPixels) -> (Matrix3<f64>, [[f64; 6]; 6], [Powers; 3]) {
        let (mut total, mut products, mut powers) = (Matrix3::zeros(), [[0.0; 6]; 6], [Powers::default(); 3]);
        let far = 2 * self.reach;
        let values = &self.factors.values;
        let mut known: BTreeMap<[usize; 2], DMatrix<f64>> = BTreeMap::new();
        for (line, times) in self.examples.clone() {
            for near in self.near(line, far) {
                for other in self.near(near, far).filter(|other| line.abs_diff(*other) <= far) {
                    known.entry([near, other]).or_insert_with(|| self.gram(pixels, [near, other]));
                }
            }
            for (factor, value) in values.iter().enumerate() {
                let of_line = self.total(line)[factor].0;
                total += times * *value * Matrix3::from_fn(|i, j| of_line[i] * of_line[j]);
            }
            for near in self.near(line, far) {
                add_products(&mut products, &known[&[line, near]], values, times);
            }
            for (channel, powers) in powers.iter_mut().enumerate() {
                self.add_powers(powers, channel, [line, far], times, &known);
            }
        }
        (total, products, powers)
    }

    /// What a line adds to the powers of a channel.
    fn add_powers(
        &self,
        powers: &mut Powers,
        channel: usize,
        [line, far]: [usize; 2],
        times: f64,
        known: &BTreeMap<[usize; 2], DMatrix<f64>>,
    ) {
        let values = DVector::from_column_slice(&self.factors.values);
        let rank = self.rank();
        // M Λ of a channel.
        let scaled = |lines: [usize; 2]| {
            let gram = &known[&lines];
            DMatrix::from_fn(rank, rank, |a, b| gram[(3 * a + channel, 3 * b + channel)] * values[b])
        };
        let total =
            |line: usize| DVector::from_iterator(rank, self.total(line).iter().map(|(total, _)| total[channel]));
        powers.traces[0] += times * scaled([line, line]).trace();
        let mut further = DVector::zeros(rank);
        for near in self.near(line, far) {
            let one = scaled([line, near]);
            powers.traces[1] += times * one.dot(&scaled([near, line]).transpose());
            further += &one * total(near);
            for other in self.near(near, far).filter(|other| line.abs_diff(*other) <= far) {
                powers.traces[2] += times * (&one * scaled([near, other])).dot(&scaled([other, line]).transpose());
            }
        }
        powers.of_row_sums[0] += times * values.component_mul(&total(line)).dot(&further);
        powers.of_row_sums[1] += times * values.component_mul(&further).dot(&further);
    }
}

/// Adds what M of two lines, of factors of such variances, gives to the products of pairs of channels.
fn add_products(products: &mut [[f64; 6]; 6], gram: &DMatrix<f64>, values: &[f64], times: f64) {
    for (a, value) in values.iter().enumerate() {
        for (b, other) in values.iter().enumerate() {
            let m = Matrix3::from_fn(|i, j| gram[(3 * a + i, 3 * b + j)]);
            for (row, [i, j]) in products.iter_mut().zip(PAIRS) {
                for (entry, [k, l]) in row.iter_mut().zip(PAIRS) {
                    *entry += times * value * other * m[(i, j)] * (m[(k, l)] + m[(l, k)]);
                }
            }
        }
    }
}

impl<'a> Shares<'a> {
    /// Of pixels whose photosites share rows or columns; none of others.
    pub fn of(pixels: &'a TappedPixels) -> Option<Self> {
        let factors = pixels.array.moments.factors.as_ref()?;
        let reach = pixels.array.weights.reach().unsigned_abs();
        let lines = [0, 1].map(|axis| {
            let across = &pixels.array.axes[1 - axis];
            // Three rows of which each is within reach of one pixel with the next, and what such pixels are made of.
            let (first, kinds, examples) = across.kinds_around(reach, 4 * reach);
            let mut lines = Lines { axis, reach, factors: &factors[axis], first, kinds, examples, totals: Vec::new() };
            lines.add_totals(pixels);
            lines
        });
        Some(Self { pixels, lines })
    }

    /// What two pixels share that are so far apart.
    pub fn covariance(&self, pixel: &Kind, other: &Kind, lag: [isize; 2]) -> Matrix3<f64> {
        let of_axis = |lines: &Lines<'_>| {
            let (mine, theirs) = (lines.loads(pixel), lines.loads(other));
            let both = mine.zip(theirs);
            both.map(|(mine, theirs)| mine.covariance(theirs, lag[1 - lines.axis], &lines.factors.values))
        };
        self.lines.iter().filter_map(of_axis).sum()
    }

    /// What a pixel at a place shares with the sum of all, and of each channel, with the sum of all times their distances in it.
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
        found
    }

    /// X of a row and a column, symmetric in the channels, by factors of both.
    fn crossing(&self, [line, column]: [usize; 2]) -> Vec<[f64; 6]> {
        let [rows, columns] = &self.lines;
        let mut found = vec![[0.0; 6]; rows.rank() * columns.rank()];
        for (pixel, [x, y]) in self.pixels.near([column, line], REACH) {
            let (Some(of_rows), Some(of_columns)) = (rows.loads(pixel), columns.loads(pixel)) else { continue };
            for (a, mine) in of_rows.at(-y).iter().enumerate() {
                for (b, theirs) in of_columns.at(-x).iter().enumerate() {
                    for (sum, [i, j]) in found[a * columns.rank() + b].iter_mut().zip(PAIRS) {
                        *sum += mine[i] * theirs[j] + mine[j] * theirs[i];
                    }
                }
            }
        }
        found
    }

    /// Sums of all that is shared; what meets what is a photosite's own is not among them.
    pub fn sums(&self, row_products: [[f64; 6]; 6]) -> Nonlocal {
        let [(of_rows, mut products, of_row), (of_columns, more, of_column)] =
            self.lines.each_ref().map(|lines| lines.sums(self.pixels));
        products.iter_mut().flatten().zip(more.iter().flatten()).for_each(|(sum, more)| *sum += more);
        let [rows, columns] = &self.lines;
        for (line, of_line) in &rows.examples {
            for (column, of_column) in &columns.examples {
                for (index, x) in self.crossing([*line, *column]).into_iter().enumerate() {
                    let (a, b) = (index / columns.rank(), index % columns.rank());
                    let times = of_line * of_column * rows.factors.values[a] * columns.factors.values[b];
                    for a in 0..6 {
                        (0..6).for_each(|b| products[a][b] += times * x[a] * x[b]);
                    }
                }
            }
        }
        let count = self.pixels.array.axes.iter().map(|axis| axis.lines.len() as f64).product();
        let powers =
            |powers: &[Powers; 3], total: &Matrix3<f64>| [0, 1, 2].map(|i| powers[i].projected(total[(i, i)], count));
        let powers = [powers(&of_row, &of_rows), powers(&of_column, &of_columns), [[0.0; 3]; 3]];
        Nonlocal { total: of_rows + of_columns, products, row_products, powers }
    }
}
