//! Sums over the pixels of a rectangle of what the drift of the black level makes of them, where several amplifiers have a part in them.
//!
//! A drift is a factor of each row ([`super::tapped_factors`]), but those of two rows are not independent: row r has Σ_m b_m(r) z_m of the
//! numbers of knots ([`knots`]). Pixel a, which has ℓ_a(r) of the row, thus has V(a; m) = Σ_r ℓ_a(r) b_m(r) of the knot m; where there are two
//! factors a knot has two numbers, one after another. And
//!
//! - T_ij(m, m′) = Σ_rr′ M_ij(r, r′) b_m(r) b_m′(r′), of what [`super::drift_bands`] tells the rest, M(r, r′) = Σ_a ℓ_a(r) ℓ_a(r′)ᵀ
//! - with what a row r′ has otherwise, X_ij(m; r′) = Σ_r b_m(r) Σ_a ℓ_a,i(r) ℓ′_a,j(r′), and with columns likewise,
//!   tr D_ik R_lj = Σ λ X_ij X_kl
//!
//! What meets a drift only once, such as what is a photosite's own, meets its mean over rows that are else alike.

use super::covariance::PAIRS;
use super::drift_bands::{Bands, WIDTH};
use super::line_sampling::add_both;
use super::tapped::{Kind, TappedPixels};
use super::tapped_factors::Drifting;
use super::tapped_lines::{Lines, crossing};
use crate::stages::noise::knots;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// What the pixels of a rectangle share of the drift of the black level.
pub(super) struct DriftShares<'a> {
    lines: Lines<'a>,
    /// The knots of the lines that have a part in the rectangle, from the first on.
    knots: Vec<Knots>,
    bands: Bands,
    /// Σ_a V_i(a; m) d_k(a), d the distance of the mean of a pixel from that of all.
    of_distances: Vec<Matrix3<f64>>,
    /// The first line of the rectangle, the kinds of its lines, and what those of a kind have around them.
    start: usize,
    kinds: Vec<usize>,
    around: Vec<Around>,
}

/// The knot before a line, from the first on, and the weights of it and the next.
type Knots = (usize, [f64; 2]);

/// Covariance of two lines of a drift of variance 1.
fn between((j, [a, b]): Knots, (k, [c, d]): Knots) -> f64 {
    match k.cast_signed() - j.cast_signed() {
        0 => a * c + b * d,
        1 => b * c,
        -1 => a * d,
        _ => 0.0,
    }
}

/// What pixels of the lines of a kind have around them, on average over these.
struct Around {
    /// Covariances of lines as far away as a pixel reaches with those as far as another does that has photosites together with it.
    between: Vec<Vec<f64>>,
    /// What a line so far away has together with the sum of all pixels, and with that of their distances, by factor.
    sums: Vec<Vector3<f64>>,
    of_distances: Vec<Vector3<f64>>,
}

impl<'a> DriftShares<'a> {
    /// Of such a drift.
    pub fn of(pixels: &'a TappedPixels, drift: &'a Drifting) -> Self {
        let lines = Lines::of(pixels, &drift.factors, 2, 0);
        let rows = &pixels.array.axes[1];
        let of_line = |line: usize| knots(rows.first + line as i64, drift.rows_per_knot);
        let (base, _) = of_line(lines.first);
        let of_lines = (0..lines.kinds.len()).map(|index| {
            let (knot, weights) = of_line(lines.first + index);
            (usize::try_from(knot - base).unwrap_or_default(), weights)
        });
        let knots: Vec<Knots> = of_lines.collect();
        let length = knots.last().map_or(0, |(last, _)| last * lines.rank() + WIDTH);
        let reach = lines.reach;
        let (kinds, examples) = rows.alike(rows.lines.clone(), 3 * reach, true);
        let mut shares = Self {
            bands: bands(pixels, &lines, &knots, length),
            of_distances: vec![Matrix3::zeros(); length],
            start: rows.lines.start,
            kinds,
            around: Vec::new(),
            lines,
            knots,
        };
        for (index, (knot, weights)) in shares.knots.iter().enumerate() {
            let rank = shares.lines.rank();
            for (part, (_, t)) in shares.lines.total(shares.lines.first + index).iter().enumerate() {
                (0..2).for_each(|p| shares.of_distances[(knot + p) * rank + part] += weights[p] * t);
            }
        }
        shares.add_around(examples.len());
        shares
    }

    /// The knots of a line; none of one that has no part in the rectangle.
    fn knots_of(&self, line: usize, offset: isize) -> Option<Knots> {
        let index = line.checked_add_signed(offset)?.checked_sub(self.lines.first)?;
        self.knots.get(index).copied()
    }

    fn add_around(&mut self, kinds: usize) {
        let reach = self.lines.reach.cast_signed();
        let far = 3 * reach;
        let [near, all] = [2 * reach + 1, 2 * far + 1].map(isize::cast_unsigned);
        let rank = self.lines.rank();
        let none = || Around {
            between: vec![vec![0.0; all]; near],
            sums: vec![Vector3::zeros(); near * rank],
            of_distances: vec![Vector3::zeros(); near * rank],
        };
        let mut around: Vec<Around> = (0..kinds).map(|_| none()).collect();
        let mut counts = vec![0.0; kinds];
        for (index, kind) in self.kinds.iter().enumerate() {
            let line = self.start + index;
            counts[*kind] += 1.0;
            for (place, offset) in (-reach..=reach).enumerate() {
                let Some(mine) = self.knots_of(line, offset) else { continue };
                for (other, there) in (-far..=far).enumerate() {
                    if let Some(theirs) = self.knots_of(line, there) {
                        around[*kind].between[place][other] += between(mine, theirs);
                    }
                }
                let (knot, weights) = mine;
                for (knot, weight) in (knot..).zip(weights) {
                    for part in 0..rank {
                        let [to, from] = [place * rank + part, knot * rank + part];
                        around[*kind].sums[to] += weight * self.bands.sums[from];
                        around[*kind].of_distances[to] += weight * self.of_distances[from].diagonal();
                    }
                }
            }
        }
        for (around, count) in around.iter_mut().zip(&counts) {
            around.between.iter_mut().flatten().for_each(|sum| *sum /= count);
            around.sums.iter_mut().chain(&mut around.of_distances).for_each(|sum| *sum /= *count);
        }
        self.around = around;
    }

    /// What pixels of a line of the rectangle have around them.
    fn around(&self, line: usize) -> &Around {
        &self.around[self.kinds[line - self.start]]
    }

    /// What a pixel of a line shares with one so many lines away, on average over lines of its kind.
    pub fn covariance(&self, pixel: &Kind, other: &Kind, line: usize, lag: isize) -> Matrix3<f64> {
        let reach = self.lines.reach.cast_signed();
        let around = self.around(line);
        let both = self.lines.loads(pixel).zip(self.lines.loads(other));
        let Some((mine, theirs)) = both else { return Matrix3::zeros() };
        let mut found = Matrix3::zeros();
        for (place, offset) in (-reach..=reach).enumerate() {
            for there in -reach..=reach {
                let shared = around.between[place][(lag + there + 3 * reach).cast_unsigned()];
                for (mine, theirs) in mine.at(offset).iter().zip(theirs.at(there)).filter(|_| shared != 0.0) {
                    found += shared * Vector3::from(*mine) * Vector3::from(*theirs).transpose();
                }
            }
        }
        found
    }

    /// What a pixel of a line shares with the sum of all, and of each channel, with the sum of all times their distances, on average over
    /// lines of its kind.
    pub fn row_sum(&self, pixel: &Kind, line: usize) -> (Matrix3<f64>, [f64; 3]) {
        let reach = self.lines.reach.cast_signed();
        let around = self.around(line);
        let (mut found, mut moved) = (Matrix3::zeros(), [0.0; 3]);
        let Some(loads) = self.lines.loads(pixel) else { return (found, moved) };
        for (place, offset) in (-reach..=reach).enumerate() {
            for (part, load) in loads.at(offset).iter().enumerate() {
                let from = place * self.lines.rank() + part;
                found += Vector3::from(*load) * around.sums[from].transpose();
                (0..3).for_each(|i| moved[i] += load[i] * around.of_distances[from][i]);
            }
        }
        (found, moved)
    }

    /// Σ_ab D, and what powers of each channel leave when the mean comes off.
    pub fn total(&self) -> Matrix3<f64> {
        self.bands.total()
    }

    /// Σ λ, Σ λ² and Σ λ³ of a channel as the mean of so many pixels leaves them.
    pub fn powers(&self, channel: usize, pixels: f64) -> [f64; 3] {
        self.bands.powers(channel).projected(self.total()[(channel, channel)], pixels)
    }

    /// Σ_ab D_ik D_jl + D_il D_jk.
    pub fn products(&self) -> [[f64; 6]; 6] {
        self.bands.products_of_pairs()
    }

    /// The same of the row sums V(a) gᵀ, in both orders.
    pub fn row_products(&self) -> [[f64; 6]; 6] {
        // gᵀ_k T_ij g_l.
        let mut forms = [[[[0.0; 3]; 3]; 3]; 3];
        for (m, n, t) in self.bands.each().filter(|(.., t)| *t != Matrix3::zeros()) {
            let sums = self.bands.sums[m] * self.bands.sums[n].transpose();
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                for (k, l) in (0..3).flat_map(|k| (0..3).map(move |l| (k, l))) {
                    forms[i][j][k][l] += t[(i, j)] * sums[(k, l)];
                }
            }
        }
        PAIRS.map(|[i, j]| {
            PAIRS.map(|[k, l]| forms[i][j][k][l] + forms[i][j][l][k] + forms[k][l][i][j] + forms[l][k][i][j])
        })
    }

    /// Σ_a q², of each channel, of what pixels share of it with the sum of all times their distances.
    pub fn squares_of_distances(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| {
            let of = |m: usize| self.of_distances[m][(i, i)];
            self.bands.times(i, of).iter().enumerate().map(|(m, sum)| of(m) * sum).sum()
        })
    }

    /// Σ d_i D_jl d_k + d_i D_jk d_l + d_j D_il d_k + d_j D_ik d_l, by pairs ij and kl.
    pub fn of_distances(&self) -> [[f64; 6]; 6] {
        let mut found = [[0.0; 6]; 6];
        for t in &self.of_distances {
            let both = PAIRS.map(|[i, j]| t[(i, j)] + t[(j, i)]);
            for a in 0..6 {
                (0..6).for_each(|b| found[a][b] += both[a] * both[b]);
            }
        }
        found
    }

    /// What the products of the sum of it and of what rows and columns share else have beyond those of each.
    pub fn products_with(&self, pixels: &TappedPixels, [rows, columns]: &[Lines<'_>; 2]) -> [[f64; 6]; 6] {
        let mut found = [[0.0; 6]; 6];
        self.add_rows(pixels, rows, &mut found);
        self.add_columns(pixels, columns, &mut found);
        found
    }

    fn add_rows(&self, pixels: &TappedPixels, rows: &Lines<'_>, found: &mut [[f64; 6]; 6]) {
        let far = 2 * self.lines.reach;
        for (kind, (line, _)) in rows.examples.iter().enumerate().filter(|_| rows.rank() > 0) {
            let of_line = |near: usize| {
                let gram = self.lines.gram_with(rows, pixels, [near, *line]);
                let of_factor = |index: usize| {
                    let [part, factor] = [index / rows.rank(), index % rows.rank()].map(|at| 3 * at);
                    PAIRS.map(|[i, j]| gram[(part + i, factor + j)] + gram[(part + j, factor + i)])
                };
                let both = self.lines.rank() * rows.rank();
                (near.cast_signed() - line.cast_signed(), (0..both).map(of_factor).collect::<Vec<_>>())
            };
            let near: Vec<(isize, Vec<[f64; 6]>)> = rows.near(*line, far).map(of_line).collect();
            for (offset, mine) in &near {
                for (other, theirs) in &near {
                    let all = rows.kinds.iter().enumerate().filter(|(_, of)| **of == kind);
                    let shared: f64 = all
                        .filter_map(|(index, _)| {
                            let at = |offset: isize| self.knots_of(rows.first + index, offset);
                            Some(between(at(*offset)?, at(*other)?))
                        })
                        .sum();
                    for ((mine, theirs), value) in mine.iter().zip(theirs).zip(rows.factors.values.iter().cycle()) {
                        add_outer(found, mine, theirs, shared * value);
                    }
                }
            }
        }
    }

    fn add_columns(&self, pixels: &TappedPixels, columns: &Lines<'_>, found: &mut [[f64; 6]; 6]) {
        if columns.rank() == 0 {
            return;
        }
        let kinds = self.lines.examples.len();
        let knots = self.knots.last().map_or(0, |(last, _)| last + 2);
        let mut sums = vec![vec![0.0; knots]; kinds];
        for (kind, (knot, weights)) in self.lines.kinds.iter().zip(&self.knots) {
            (0..2).for_each(|p| sums[*kind][knot + p] += weights[p]);
        }
        let dot = |a: &Vec<f64>, b: &Vec<f64>| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let shared: Vec<Vec<f64>> = sums.iter().map(|a| sums.iter().map(|b| dot(a, b)).collect()).collect();
        for (column, times) in &columns.examples {
            let of_kind = |(line, _): &(usize, f64)| crossing(pixels, [&self.lines, columns], [*line, *column]);
            let all: Vec<Vec<[f64; 6]>> = self.lines.examples.iter().map(of_kind).collect();
            let values = columns.factors.values.iter().cycle().take(self.lines.rank() * columns.rank());
            for (factor, value) in values.enumerate() {
                for (mine, of_mine) in all.iter().zip(&shared) {
                    let mut together = [0.0; 6];
                    for (theirs, shared) in all.iter().zip(of_mine) {
                        (0..6).for_each(|b| together[b] += shared * theirs[factor][b]);
                    }
                    add_outer(found, &mine[factor], &together, times * value);
                }
            }
        }
    }
}

fn add_outer(found: &mut [[f64; 6]; 6], mine: &[f64; 6], theirs: &[f64; 6], times: f64) {
    for (row, mine) in found.iter_mut().zip(mine) {
        row.iter_mut().zip(theirs).for_each(|(entry, theirs)| *entry += times * mine * theirs);
    }
}

/// g and T of the lines that have a part in the rectangle, of so many knots.
fn bands(pixels: &TappedPixels, lines: &Lines<'_>, knots: &[Knots], length: usize) -> Bands {
    let mut bands = Bands::zero(length);
    let far = 2 * lines.reach;
    let rank = lines.rank();
    let of_example = |(line, _): &(usize, f64)| -> Vec<(isize, DMatrix<f64>)> {
        let near = lines.near(*line, far);
        let gram = |near: usize| lines.gram_with(lines, pixels, [*line, near]);
        near.map(|near| (near.cast_signed() - line.cast_signed(), gram(near))).collect()
    };
    let grams: Vec<Vec<(isize, DMatrix<f64>)>> = lines.examples.iter().map(of_example).collect();
    for (index, (kind, (knot, weights))) in lines.kinds.iter().zip(knots).enumerate() {
        for (part, (total, _)) in lines.totals[*kind].iter().enumerate() {
            (0..2).for_each(|p| bands.sums[(knot + p) * rank + part] += weights[p] * Vector3::from(*total));
        }
        for (lag, gram) in &grams[*kind] {
            let Some((other, of_other)) = index.checked_add_signed(*lag).and_then(|index| knots.get(index)) else {
                continue;
            };
            for (m, mine) in (*knot..).zip(weights) {
                for (n, theirs) in (*other..).zip(of_other) {
                    for [a, b] in (0..rank * rank).map(|index| [index / rank, index % rank]) {
                        let [from, to] = [m * rank + a, n * rank + b];
                        if let Some(band) = to.checked_sub(from).and_then(|apart| bands.products[from].get_mut(apart)) {
                            *band += mine * theirs * gram.fixed_view::<3, 3>(3 * a, 3 * b);
                        }
                    }
                }
            }
        }
    }
    bands
}

/// Products of row sums of what pixels share.
#[derive(Debug, Default)]
pub(super) struct RowProducts {
    /// Of what is shared by rows and columns but for the drift.
    pub lines: [[f64; 6]; 6],
    /// Of these with the drift.
    pub with_drift: [[f64; 6]; 6],
}

impl RowProducts {
    /// Adds those of so many pixels, with what they share by lines and by the drift, in both orders.
    pub fn add(&mut self, lines: &Matrix3<f64>, drift: &Matrix3<f64>, times: f64) {
        for (lines, drift) in [(*lines, *drift), (lines.transpose(), drift.transpose())] {
            super::place::add_products(&mut self.lines, &lines, times);
            if drift != Matrix3::zeros() {
                add_both(&mut self.with_drift, &(times * lines), &drift);
            }
        }
    }
}
