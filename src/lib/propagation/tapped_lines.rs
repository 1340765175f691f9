//! What the pixels of a rectangle share by the lines of one axis, and sums of it over all of these ([`super::tapped_shares`]).

use super::covariance::PAIRS;
use super::line_sampling::Powers;
use super::tapped::{Kind, TappedPixels};
use super::tapped_factors::{Factors, Loads};
use crate::stages::demosaic::stencil::REACH;
use nalgebra::{DMatrix, DVector, Matrix3};
use std::collections::BTreeMap;

/// What they share by the lines of one axis: by rows where it is 0, by columns where it is 1.
pub(super) struct Lines<'a> {
    pub axis: usize,
    /// Which of what a pixel has it is.
    part: usize,
    /// Lines that a pixel reaches to either side.
    pub reach: usize,
    pub factors: &'a Factors,
    /// The kinds of the lines that have a part in the rectangle, from the first on, and one of each with their number.
    pub first: usize,
    pub kinds: Vec<usize>,
    pub examples: Vec<(usize, f64)>,
    /// By kind, T of the channels and T of these and the distances, by factor.
    pub totals: Vec<Vec<Total>>,
}

/// T of the channels, and T of these and the distances.
pub(super) type Total = ([f64; 3], Matrix3<f64>);

impl<'a> Lines<'a> {
    /// Of the factors that stand at a place of what pixels have, by an axis.
    pub fn of(pixels: &TappedPixels, factors: &'a Factors, part: usize, axis: usize) -> Self {
        let reach = pixels.array.weights.reach().unsigned_abs();
        let across = &pixels.array.axes[1 - axis];
        // Three rows of which each is within reach of one pixel with the next, and what such pixels are made of.
        let (first, kinds, examples) = across.kinds_around(reach, 4 * reach);
        let mut lines = Self { axis, part, reach, factors, first, kinds, examples, totals: Vec::new() };
        lines.add_totals(pixels);
        lines
    }

    /// What a pixel has of these.
    pub fn loads<'p>(&self, kind: &'p Kind) -> Option<&'p Loads> {
        kind.loads.as_ref().map(|loads| &loads[self.part])
    }

    pub fn rank(&self) -> usize {
        self.factors.values.len()
    }

    /// Lines that have a part in the rectangle no farther from one than so many.
    pub fn near(&self, line: usize, far: usize) -> std::ops::Range<usize> {
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

    /// T of a line, by factor.
    pub fn total(&self, line: usize) -> &[Total] {
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
    fn gram(&self, pixels: &TappedPixels, lines: [usize; 2]) -> DMatrix<f64> {
        self.gram_with(self, pixels, lines)
    }

    /// The same of a line of these factors and one of others of the same axis.
    pub fn gram_with(&self, other: &Lines<'_>, pixels: &TappedPixels, [line, to]: [usize; 2]) -> DMatrix<f64> {
        let mut found = DMatrix::zeros(3 * self.rank(), 3 * other.rank());
        let lag = to.cast_signed() - line.cast_signed();
        for (kind, offset, count) in self.around(pixels, line) {
            let Some((loads, others)) = self.loads(kind).zip(other.loads(kind)) else { continue };
            for (a, mine) in loads.at(offset).iter().enumerate() {
                if *mine == [0.0; 3] {
                    continue;
                }
                for (b, theirs) in others.at(offset + lag).iter().enumerate() {
                    for i in 0..3 {
                        (0..3).for_each(|j| found[(3 * a + i, 3 * b + j)] += count * mine[i] * theirs[j]);
                    }
                }
            }
        }
        found
    }

    /// Σ_r λ Tᵀ T, and the products of pairs of channels, and for each channel the powers.
    pub fn sums(&self, pixels: &TappedPixels) -> (Matrix3<f64>, [[f64; 6]; 6], [Powers; 3]) {
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

/// X of a line of the first factors and one across of the second, symmetric in the channels, by factors of both.
pub(super) fn crossing(
    pixels: &TappedPixels,
    [rows, columns]: [&Lines<'_>; 2],
    [line, column]: [usize; 2],
) -> Vec<[f64; 6]> {
    let mut found = vec![[0.0; 6]; rows.rank() * columns.rank()];
    for (pixel, [x, y]) in pixels.near([column, line], REACH) {
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
