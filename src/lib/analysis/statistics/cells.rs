//! How samples of photosites scatter that are read through several amplifiers and share rows and columns.
//!
//! A cell is the photosites of the n rows of one kind and the m columns of one, which are of one amplifier and class. What its rows
//! differ in, and its columns, leaves the covariance C of all photosites in blocks, each on its own subspace:
//!
//! - (n − 1)(m − 1) times D, what is a photosite's own, for each cell
//! - n − 1 times D δ + √(m m′) R over the cells of a kind of rows, and m − 1 times D δ + √(n n′) S over those of a kind of columns
//! - once D δ + √(m m′) R + √(n n′) S over all cells, R where they have rows in common and S where columns
//!
//! with R and S the covariances of two photosites in a row and in a column, by amplifiers and classes. Of the last block alone the mean
//! takes something off, and in it alone lie the distances d of the means of cells from that of all, so that
//!
//! - E s_ij = \[tr P C_ij + d_i·d_j]/(n − 1)
//! - (n − 1)² cov(s_ij, s_kl) = tr(P C_ik P C_lj) + tr(P C_il P C_kj) + d_i C_jl d_k + d_i C_jk d_l + d_j C_il d_k + d_j C_ik d_l
//!
//! and what the third and fourth cumulants of photosites add, and of whole lines where their photosites follow these on a curve, are sums over
//! small matrices.

use super::cell_drift::{DriftCell, DriftCells, DriftSums, RowKinds};
use crate::cfa::Class;
use crate::propagation::Prediction;
use crate::propagation::bent_lines::{BeyondNormal, LineForm};
use crate::propagation::covariance::PAIRS;
use crate::propagation::sampling::Sampling;
use crate::propagation::tap_lines::TapLines;
use crate::propagation::taps::{Cell, TappedSites};
use nalgebra::{DMatrix, DVector, Matrix3};

/// Which samples are seen together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    /// Three planes.
    Planes,
    /// One class of a plane behind a filter array.
    Class(Class),
    /// All of such a plane.
    All,
}

/// The samples that are seen.
struct Samples<'a> {
    sites: &'a TappedSites,
    lines: &'a TapLines,
    seen: Seen,
    cells: Vec<&'a Cell>,
}

/// A block of the covariance: the cells that it is over, how often it comes, and the covariances of three channels with each other.
struct Block {
    times: f64,
    covariances: [DMatrix<f64>; 9],
}

impl Block {
    fn of(&self, i: usize, k: usize) -> &DMatrix<f64> {
        &self.covariances[3 * i + k]
    }
}

impl<'a> Samples<'a> {
    fn of(sites: &'a TappedSites, lines: &'a TapLines, seen: Seen) -> Self {
        let is_seen = |cell: &&Cell| match seen {
            Seen::Class(class) => cell.class == Some(class),
            Seen::Planes | Seen::All => true,
        };
        let cells = sites.cells.all.iter().filter(is_seen).filter(|cell| sites.cells.count(cell) > 0.0).collect();
        Self { sites, lines, seen, cells }
    }

    /// Where the photosites of a cell stand in what lines share.
    fn place(&self, cell: &Cell, channel: usize) -> usize {
        let class = match (self.seen, cell.class) {
            (Seen::Planes, _) | (_, None) => channel,
            (_, Some(class)) => class as usize,
        };
        3 * cell.group + class
    }

    fn site(&self, cell: &Cell, channel: usize) -> &Prediction {
        let place = self.place(cell, channel);
        &self.sites.groups[place / 3].sites[place % 3]
    }

    /// What two channels of a photosite have in common apart from its row and column.
    fn own(&self, cell: &Cell, i: usize, k: usize) -> f64 {
        let [one, other] = [i, k].map(|channel| self.place(cell, channel));
        match one == other {
            true => self.lines.own(one, self.site(cell, i).moments.variance),
            false => self.lines.together[cell.group][(one % 3, other % 3)],
        }
    }

    /// The block over some cells, with what they share by rows, and by columns.
    fn block(&self, times: f64, cells: &[&Cell], [has_rows, has_columns]: [bool; 2]) -> Block {
        let kinds = &self.sites.cells;
        let entry = |i: usize, k: usize, a: &Cell, b: &Cell| {
            let places = (self.place(a, i), self.place(b, k));
            let own = if a == b { self.own(a, i, k) } else { 0.0 };
            let row = if has_rows && a.row == b.row {
                self.lines.row_alone(places.0, places.1) * (kinds.columns[a.column] * kinds.columns[b.column]).sqrt()
            } else {
                0.0
            };
            let column = if has_columns && a.column == b.column {
                self.lines.column[places] * (kinds.rows[a.row] * kinds.rows[b.row]).sqrt()
            } else {
                0.0
            };
            own + row + column
        };
        let of_channels =
            |i: usize, k: usize| DMatrix::from_fn(cells.len(), cells.len(), |a, b| entry(i, k, cells[a], cells[b]));
        Block { times, covariances: std::array::from_fn(|pair| of_channels(pair / 3, pair % 3)) }
    }

    /// What the drift of the black level adds, of cells whose means are off by so much; none where there is none.
    fn drift(&self, off: &[DVector<f64>; 3]) -> Option<DriftSums> {
        let drift = self.lines.drift.as_ref()?;
        let kinds = &self.sites.cells;
        let of_cell = |(index, cell): (usize, &&Cell)| DriftCell {
            row: cell.row,
            columns: kinds.columns[cell.column],
            rows: kinds.rows[cell.row],
            scales: [0, 1, 2].map(|channel| drift.loads[self.place(cell, channel)]),
            off: [0, 1, 2].map(|channel| off[channel][index]),
            own: Matrix3::from_fn(|i, k| self.own(cell, i, k)),
        };
        let place = |[index, channel]: [usize; 2]| self.place(self.cells[index], channel);
        let in_column = |one: [usize; 2], other: [usize; 2]| {
            let is_here = self.cells[one[0]].column == self.cells[other[0]].column;
            if is_here { self.lines.column[(place(one), place(other))] } else { 0.0 }
        };
        let cells = DriftCells {
            cells: self.cells.iter().enumerate().map(of_cell).collect(),
            in_row: &|one, other| self.lines.row_alone(place(one), place(other)),
            in_column: &in_column,
            rows: RowKinds::of(kinds.first_row, &kinds.kinds_of_rows, drift.rows_per_knot),
        };
        Some(cells.sums())
    }

    /// All blocks but the one over all cells.
    fn blocks(&self) -> Vec<Block> {
        let kinds = &self.sites.cells;
        let inner = |cell: &&Cell| (kinds.rows[cell.row] - 1.0) * (kinds.columns[cell.column] - 1.0);
        let mut found: Vec<Block> =
            self.cells.iter().map(|cell| self.block(inner(cell), &[*cell], [false; 2])).collect();
        for (kind, count) in kinds.rows.iter().enumerate() {
            let cells: Vec<&Cell> = self.cells.iter().copied().filter(|cell| cell.row == kind).collect();
            found.push(self.block(count - 1.0, &cells, [true, false]));
        }
        for (kind, count) in kinds.columns.iter().enumerate() {
            let cells: Vec<&Cell> = self.cells.iter().copied().filter(|cell| cell.column == kind).collect();
            found.push(self.block(count - 1.0, &cells, [false, true]));
        }
        found
    }
}

/// Σ over blocks of tr(C_ik C_lj).
fn product(blocks: &[Block], [i, k]: [usize; 2], [l, j]: [usize; 2]) -> f64 {
    blocks.iter().map(|block| block.times * block.of(i, k).dot(&block.of(l, j).transpose())).sum()
}

fn cube(matrix: &DMatrix<f64>) -> f64 {
    (matrix * matrix).dot(&matrix.transpose())
}

/// What third and fourth cumulants of photosites of some channels add, `off` the distances of the means of cells by channel.
fn of_cumulants(samples: &Samples<'_>, off: &[DVector<f64>; 3], n: f64, [i, j]: [usize; 2], [k, l]: [usize; 2]) -> f64 {
    let kept = 1.0 - 1.0 / n;
    let of_cell = |(index, cell): (usize, &&Cell)| {
        let count = samples.sites.cells.count(cell);
        let is_one = |channels: [usize; 3]| {
            let [a, b, c] = channels.map(|channel| samples.place(cell, channel));
            a == b && b == c
        };
        let own =
            |channel: usize| samples.lines.own_cumulants(samples.place(cell, channel), samples.site(cell, channel));
        let third = |channels: [usize; 3], other: usize| {
            if is_one(channels) { own(channels[0])[0] * off[other][index] } else { 0.0 }
        };
        let thirds = third([i, j, l], k) + third([i, j, k], l) + third([j, k, l], i) + third([i, k, l], j);
        let is_fourth = is_one([i, j, k]) && is_one([j, k, l]);
        let fourth = if is_fourth { own(i)[1] } else { 0.0 };
        count * (kept * thirds + kept * kept * fourth)
    };
    samples.cells.iter().enumerate().map(of_cell).sum()
}

/// What lines add whose photosites follow what these share on a curve, `off` as of cumulants.
fn beyond_normal(samples: &Samples<'_>, off: &[DVector<f64>; 3], n: f64) -> BeyondNormal {
    let mut found = BeyondNormal::default();
    let kinds = &samples.sites.cells;
    for (axis, bent) in samples.lines.bent.iter().enumerate() {
        let Some(bent) = bent else { continue };
        let (lines, lengths) = if axis == 0 { (&kinds.rows, &kinds.columns) } else { (&kinds.columns, &kinds.rows) };
        for (kind, count) in lines.iter().enumerate() {
            let of_cell = |(index, cell): (usize, &&Cell)| {
                let [line, along] = if axis == 0 { [cell.row, cell.column] } else { [cell.column, cell.row] };
                let places = [0, 1, 2].map(|channel| samples.place(cell, channel));
                (line == kind).then(|| (places, lengths[along], [0, 1, 2].map(|channel| off[channel][index])))
            };
            let cells: Vec<([usize; 3], f64, [f64; 3])> =
                samples.cells.iter().enumerate().filter_map(of_cell).collect();
            let form = |[i, j]: [usize; 2]| {
                let mut form = LineForm::zero(bent.places());
                for (places, length, off) in &cells {
                    if places[i] == places[j] {
                        form.add_square(places[i], length * (1.0 - 1.0 / n));
                    }
                    form.add_product([places[i], places[j]], *length);
                    form.add_linear(places[i], length * off[j]);
                    form.add_linear(places[j], length * off[i]);
                    for (others, of_others, _) in &cells {
                        form.add_product([places[i], others[j]], -length * of_others / n);
                    }
                }
                form
            };
            bent.add(&PAIRS.map(form), *count, &mut found);
        }
    }
    found
}

/// The law of the samples that are seen of photosites which share such rows and columns.
pub(super) fn sampling(sites: &TappedSites, lines: &TapLines, seen: Seen) -> Sampling {
    let samples = Samples::of(sites, lines, seen);
    let counts = DVector::from_iterator(samples.cells.len(), samples.cells.iter().map(|cell| sites.cells.count(cell)));
    let (n, roots) = (counts.sum(), counts.map(f64::sqrt));
    let free = (n - 1.0).max(f64::MIN_POSITIVE);
    // Distances of means, as they are, and as they stand in the block over all cells.
    let off = [0, 1, 2].map(|i| {
        let means = samples.cells.iter().map(|cell| samples.site(cell, i).moments.mean);
        let means = DVector::from_iterator(samples.cells.len(), means);
        means.add_scalar(-means.dot(&counts) / n)
    });
    let d = off.each_ref().map(|off| off.component_mul(&roots));
    let mut blocks = samples.blocks();
    let whole = samples.block(1.0, &samples.cells, [true; 2]);
    let of_mean = Matrix3::from_fn(|i, j| roots.dot(&(whole.of(i, j) * &roots)));
    let p = DMatrix::identity(counts.len(), counts.len()) - &roots * roots.transpose() / n;
    let projected = Block { times: 1.0, covariances: whole.covariances.map(|covariance| &p * covariance * &p) };
    let form = |i: usize, [j, l]: [usize; 2], k: usize| d[i].dot(&(projected.of(j, l) * &d[k]));
    let forms = PAIRS.map(|[i, j]| {
        PAIRS.map(|[k, l]| form(i, [j, l], k) + form(i, [j, k], l) + form(j, [i, l], k) + form(j, [i, k], l))
    });
    let of_distances = |i: usize| (projected.of(i, i) * &d[i]).norm_squared();
    let of_distances = [0, 1, 2].map(of_distances);
    blocks.push(projected);
    let beyond = beyond_normal(&samples, &off, n);
    let drift = samples.drift(&off);
    let of_drift = |of: &dyn Fn(&DriftSums) -> f64| drift.as_ref().map_or(0.0, of);
    let spread = std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let ([i, j], [k, l]) = (PAIRS[a], PAIRS[b]);
            let normal = product(&blocks, [i, k], [l, j]) + product(&blocks, [i, l], [k, j]);
            let lines = beyond.spread[a][b] + of_drift(&|drift| drift.spread[a][b]);
            let found = normal + lines + forms[a][b] + of_cumulants(&samples, &off, n, [i, j], [k, l]);
            (if a == b { found.max(0.0) } else { found }) / (free * free)
        })
    });
    let trace = |i: usize, j: usize| blocks.iter().map(|block| block.times * block.of(i, j).trace()).sum::<f64>();
    let third = |i: usize| {
        let of_noise: f64 = blocks.iter().map(|block| block.times * cube(block.of(i, i))).sum();
        let lines = beyond.thirds[i] + of_drift(&|drift| drift.thirds[i]);
        (8.0 * of_noise + 24.0 * of_distances[i] + lines) / free.powi(3)
    };
    Sampling {
        count: n,
        mean_covariance: (of_mean + drift.as_ref().map_or(Matrix3::zeros(), |drift| drift.of_mean)) / (n * n),
        covariance: Matrix3::from_fn(|i, j| {
            (trace(i, j) + d[i].dot(&d[j]) + of_drift(&|drift| drift.trace[(i, j)])) / free
        }),
        spread,
        variance_thirds: Some([0, 1, 2].map(third)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::grids::{self, Grid};
    use super::super::region::Region;
    use super::*;
    use crate::propagation::LineCovariance;
    use crate::propagation::tap_lines::TapDrift;
    use crate::propagation::taps::{Cells, Group};
    use crate::stages::noise::knots;

    /// Covariance of two rows of a drift of variance 1, by the knot before each and the weights of it and the next.
    fn between([(j, [a, b]), (k, [c, d])]: [(i64, [f64; 2]); 2]) -> f64 {
        [(j, a), (j + 1, b)]
            .iter()
            .flat_map(|(m, x)| [(k, c), (k + 1, d)].map(|(n, y)| if *m == n { x * y } else { 0.0 }))
            .sum()
    }

    /// What row and column make of each class of an amplifier.
    fn loads(group: usize, class: usize, by: f64) -> [[f64; 2]; 2] {
        let more = 1.0 + by * group as f64;
        let x = [2.0, 3.0, 1.5][class];
        [[0.4 * more, 0.2 * more * x], [0.3 * more, 0.1 * more * x]]
    }

    const ROWS_PER_KNOT: f64 = 3.3;
    const FIRST_ROW: i64 = -4;

    fn lines(groups: usize, by: f64, together: f64, drifts: bool) -> TapLines {
        let load = |place: usize| {
            let more = 1.0 + by * (place / 3) as f64;
            [[0.7, 0.9, 0.5], [-0.6, 0.2, 0.4]].map(|loads| more * loads[place % 3])
        };
        let drift = TapDrift { loads: (0..3 * groups).map(load).collect(), rows_per_knot: ROWS_PER_KNOT };
        let of_drift = DMatrix::from_fn(3 * groups, 3 * groups, |a, b| if drifts { drift.between(a, b) } else { 0.0 });
        let drift = drifts.then_some(drift);
        let of = |axis: usize| {
            DMatrix::from_fn(3 * groups, 3 * groups, |a, b| {
                let [one, other] = [a, b].map(|place| loads(place / 3, place % 3, by)[axis]);
                one[0] * other[0] + one[1] * other[1]
            })
        };
        let matrix = Matrix3::from_fn(|k, l| if k == l { 0.0 } else { together });
        let row = of(0) + of_drift;
        TapLines { row, drift, column: of(1), together: vec![matrix; groups], bent: [None, None] }
    }

    /// Photosites of an amplifier, more of each group by a share.
    fn group(group: usize, lines: &TapLines, by: f64, counts: [f64; 3]) -> Group {
        let sites = [0, 1, 2].map(|k| {
            let (more, place) = (by * group as f64, 3 * group + k);
            let own = 1.0 + 0.5 * k as f64 + more;
            let variance = own + lines.row[(place, place)] + lines.column[(place, place)];
            let of_row = |lines: &DMatrix<f64>| [0, 1, 2].map(|l| lines[(place, 3 * group + l)]);
            let line = LineCovariance {
                row: of_row(&lines.row),
                column: of_row(&lines.column),
                together: [0, 1, 2].map(|l| lines.together[group][(k, l)]),
                drift: [0, 1, 2].map(|l| lines.drift(place, 3 * group + l)),
                drift_rows: ROWS_PER_KNOT,
                level: [0.0; 3],
            };
            let found = Prediction::of_cumulants(20.0 + 3.0 * k as f64 + 4.0 * more, variance, 0.4 + more, 0.3);
            Prediction { lines: line, ..found }
        });
        Group { counts, sites }
    }

    /// Rows of two amplifiers and three columns by turns behind a filter array, or without one.
    fn sites(by: f64, is_plane: bool, drifts: bool) -> TappedSites {
        let lines = lines(6, by, if is_plane { 0.0 } else { 0.1 }, drifts);
        let (rows, columns) = (vec![3.0, 2.0, 2.0, 4.0], vec![2.0, 1.0, 3.0, 2.0, 2.0, 1.0]);
        let class =
            |row: usize, column: usize| [[Class::Red, Class::Green], [Class::Green, Class::Blue]][row % 2][column % 2];
        let cell = |row: usize, column: usize| Cell {
            row,
            column,
            group: 3 * (row / 2) + column % 3,
            class: is_plane.then(|| class(row, column)),
        };
        let all = (0..4).flat_map(|row| (0..6).map(move |column| cell(row, column))).collect();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few lines")]
        let kinds_of_rows = rows.iter().enumerate().flat_map(|(kind, count)| vec![kind; *count as usize]).collect();
        let cells = Cells { rows, columns, all, are_by_turns: true, first_row: FIRST_ROW, kinds_of_rows };
        let count = |of: usize, k: usize| -> f64 {
            let is_here = |cell: &&Cell| cell.group == of && cell.class.is_none_or(|class| class as usize == k);
            cells.all.iter().filter(is_here).map(|cell| cells.count(cell)).sum()
        };
        let groups = (0..6).map(|index| group(index, &lines, by, [0, 1, 2].map(|k| count(index, k)))).collect();
        TappedSites { groups, lines: Some(Box::new(lines)), cells, level: Matrix3::zeros() }
    }

    /// By full matrices over all samples: sums of up to 10⁴ products, relative 10⁻¹².
    #[test]
    #[allow(clippy::too_many_lines, reason = "one set of matrices for all sums")]
    fn cells_agree_with_full_matrices() {
        let all = [Seen::Planes, Seen::Class(Class::Green), Seen::Class(Class::Blue), Seen::All];
        for (seen, drifts) in all.into_iter().flat_map(|seen| [(seen, false), (seen, true)]) {
            let sites = sites(0.2, seen != Seen::Planes, drifts);
            let lines = sites.lines.as_deref().unwrap();
            let found = sampling(&sites, lines, seen);
            let samples = Samples::of(&sites, lines, seen);
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few lines")]
            let lines_of = |counts: &[f64]| -> Vec<(usize, usize)> {
                let all = counts.iter().enumerate().flat_map(|(kind, count)| vec![kind; *count as usize]);
                all.enumerate().collect()
            };
            let mut places: Vec<([usize; 2], &Cell)> = Vec::new();
            for (y, row) in lines_of(&sites.cells.rows) {
                for (x, column) in lines_of(&sites.cells.columns) {
                    let cell = samples.cells.iter().find(|cell| [cell.row, cell.column] == [row, column]);
                    places.extend(cell.map(|cell| ([x, y], *cell)));
                }
            }
            let n = places.len();
            let p = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
            let c = |i: usize, k: usize| {
                DMatrix::from_fn(n, n, |a, b| {
                    let ((at, cell), (other, of_other)) = (places[a], places[b]);
                    let pair = (samples.place(cell, i), samples.place(of_other, k));
                    let own = if a == b { samples.own(cell, i, k) } else { 0.0 };
                    let of_rows = [at[1], other[1]].map(|row| knots(FIRST_ROW + row as i64, ROWS_PER_KNOT));
                    own + lines.drift(pair.0, pair.1) * between(of_rows)
                        + if at[1] == other[1] { lines.row_alone(pair.0, pair.1) } else { 0.0 }
                        + if at[0] == other[0] { lines.column[pair] } else { 0.0 }
                })
            };
            let site = |a: usize, i: usize| samples.site(places[a].1, i);
            let d = [0, 1, 2].map(|i| &p * DVector::from_fn(n, |a, _| site(a, i).moments.mean));
            let c: Vec<DMatrix<f64>> = (0..9).map(|pair| &p * c(pair / 3, pair % 3) * &p).collect();
            let trace = |[i, k]: [usize; 2], [l, j]: [usize; 2]| c[3 * i + k].dot(&c[3 * l + j].transpose());
            let free = n as f64 - 1.0;
            let close = |found: f64, expected: f64, scale: f64| {
                assert!((found - expected).abs() < 1e-12 * scale, "{seen:?}: {found} {expected}");
            };
            let is_one = |a: usize, channels: &[usize]| {
                channels.iter().all(|i| samples.place(places[a].1, *i) == samples.place(places[a].1, channels[0]))
            };
            for (a, [i, j]) in PAIRS.into_iter().enumerate() {
                let expected = (c[3 * i + j].trace() + d[i].dot(&d[j])) / free;
                close(found.covariance[(i, j)], expected, found.covariance.diagonal().max());
                for (b, [k, l]) in PAIRS.into_iter().enumerate() {
                    let of = |x: usize, y: usize, z: usize, w: usize| d[x].dot(&(&c[3 * y + w] * &d[z]));
                    let linear = of(i, j, k, l) + of(i, j, l, k) + of(j, i, k, l) + of(j, i, l, k);
                    let kept = 1.0 - 1.0 / n as f64;
                    let cumulants: f64 = (0..n)
                        .map(|s| {
                            let third = |channels: [usize; 3], other: usize| match is_one(s, &channels) {
                                true => kept * site(s, channels[0]).third * d[other][s],
                                false => 0.0,
                            };
                            let own = samples.own(places[s].1, i, i);
                            let fourth = kept * kept * site(s, i).fourth_of_own(own);
                            third([i, j, l], k)
                                + third([i, j, k], l)
                                + third([j, k, l], i)
                                + third([i, k, l], j)
                                + if is_one(s, &[i, j, k, l]) { fourth } else { 0.0 }
                        })
                        .sum();
                    let normal = trace([i, k], [l, j]) + trace([i, l], [k, j]);
                    let scale = (found.spread[a][a] * found.spread[b][b]).sqrt();
                    close(found.spread[a][b], (normal + linear + cumulants) / (free * free), scale);
                }
                if i == j {
                    let of_distances = (&c[4 * i] * &d[i]).norm_squared();
                    let third = (8.0 * cube(&c[4 * i]) + 24.0 * of_distances) / free.powi(3);
                    // Classes that follow two numbers of a drift unlike are taken together as if they had one.
                    let scale = if seen == Seen::All && drifts { 0.2 / 1e-12 } else { 1.0 };
                    close(found.variance_thirds.unwrap()[i], third, scale * third);
                }
            }
        }
    }

    /// Amplifiers that are alike are one: planes of 11 rows and 11 columns, sums in another order, relative 10⁻¹².
    #[test]
    fn cells_that_are_alike_are_one_grid() {
        [false, true].into_iter().for_each(check_alike);
    }

    /// Of grids that drift what is no fourth cumulant is the same; these are of what is a photosite's own, whatever it shares.
    fn check_alike(drifts: bool) {
        let sites = sites(0.0, false, drifts);
        let found = sampling(&sites, sites.lines.as_deref().unwrap(), Seen::Planes);
        let grid = Grid::of_planes(Region { x: 0, y: 0, width: 11, height: 11 }, [0, -4]);
        let one = grids::sampling(&sites.groups[0].sites.map(|site| Prediction { third: 0.0, ..site }), &[grid]);
        for (a, [i, j]) in PAIRS.into_iter().enumerate() {
            assert!((found.covariance[(i, j)] - one.covariance[(i, j)]).abs() < 1e-12);
            assert!((found.mean_covariance[(i, j)] - one.mean_covariance[(i, j)]).abs() < 1e-12);
            for b in 0..6 {
                let close = (found.spread[a][b] - one.spread[a][b].max(0.0)).abs();
                assert!(close < 1e-12 * one.spread[a][a].max(one.spread[b][b]), "{a} {b}: {close}");
            }
        }
        let thirds = found.variance_thirds.unwrap().into_iter().zip(one.variance_thirds.unwrap());
        thirds.for_each(|(found, one)| assert!((found / one - 1.0).abs() < 1e-12, "{found} {one}"));
    }
}
