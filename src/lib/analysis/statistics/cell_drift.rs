//! What the drift of the black level adds to how samples of photosites scatter that are read through several amplifiers.
//!
//! Beside the covariance A of cells, which [`super::cells`] has, a photosite of channel i in a cell c has κ_i(c) Σ_m b_m(r) z_m of what its
//! row r has of knots ([`crate::stages::noise::knots`]): V_ij = G_i G_jᵀ, G_i of one column v_i,m(s) = κ_i(c) b_m(r) for each knot. Rows of one
//! kind ρ have β_ρ = Σ_r b(r) and τ_ρ = Σ_r b bᵀ together, and with n_c photosites of a cell in each row
//!
//! - g_i = G_iᵀ1 = Σ_c n_c κ_i β,  T_ij = G_iᵀG_j = Σ_c n_c κ_i κ_j τ, which is tridiagonal
//! - A_ik v_l,m = ξ(c) b_m(r) + η_m(c): what is a photosite's own and its row's goes along with b, what its column has is the same in all rows
//!   of a cell
//!
//! so that traces of products of P A and P V are sums over cells and kinds of rows of products of β and τ. Over a flat field a knot has two
//! numbers, each with a κ of its own: G has a part for each, and products are sums over these. Third cumulants take channels as if they had
//! one, of all that both are.

use crate::propagation::covariance::PAIRS;
use crate::propagation::drift::NUMBERS;
use crate::stages::noise::knots;
use nalgebra::{DMatrix, Matrix3};

/// Photosites of a cell.
pub(super) struct DriftCell {
    /// The kind of its rows, and how many of its photosites each has.
    pub row: usize,
    pub columns: f64,
    /// How many rows there are.
    pub rows: f64,
    /// κ of both numbers, and the distance of the mean from that of all, by channel.
    pub scales: [[f64; NUMBERS]; 3],
    pub off: [f64; 3],
    /// What two channels of a photosite have in common apart from rows and columns.
    pub own: Matrix3<f64>,
}

/// Of the cells of a region, what two of them share by rows but for the drift, and by columns, of channels of the first and the second.
pub(super) struct DriftCells<'a> {
    pub cells: Vec<DriftCell>,
    pub in_row: &'a dyn Fn([usize; 2], [usize; 2]) -> f64,
    pub in_column: &'a dyn Fn([usize; 2], [usize; 2]) -> f64,
    pub rows: RowKinds,
}

/// What the drift adds, before anything is divided by the number of samples.
pub(super) struct DriftSums {
    /// 1ᵀV1 and tr PV.
    pub of_mean: Matrix3<f64>,
    pub trace: Matrix3<f64>,
    /// (n − 1)² of the covariances of sample covariances.
    pub spread: [[f64; 6]; 6],
    /// (n − 1)³ of the third cumulants of sample variances.
    pub thirds: [f64; 3],
}

/// A tridiagonal matrix, symmetric.
#[derive(Clone)]
struct Tridiagonal {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl Tridiagonal {
    fn zero(length: usize) -> Self {
        Self { diagonal: vec![0.0; length], beside: vec![0.0; length] }
    }

    fn add(&mut self, times: f64, other: &Self) {
        self.diagonal.iter_mut().zip(&other.diagonal).for_each(|(sum, more)| *sum += times * more);
        self.beside.iter_mut().zip(&other.beside).for_each(|(sum, more)| *sum += times * more);
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut found: Vec<f64> = self.diagonal.iter().zip(x).map(|(d, x)| d * x).collect();
        for (j, beside) in self.beside.iter().enumerate().take(x.len().saturating_sub(1)) {
            found[j] += beside * x[j + 1];
            found[j + 1] += beside * x[j];
        }
        found
    }

    /// tr of the product with another.
    fn trace_with(&self, other: &Self) -> f64 {
        dot(&self.diagonal, &other.diagonal) + 2.0 * dot(&self.beside, &other.beside)
    }

    /// tr of the third power: each step aside and back meets the diagonal at either end.
    fn trace_of_cube(&self) -> f64 {
        let d = &self.diagonal;
        let aside = |j: usize| self.beside[j].powi(2) * (d[j] + d.get(j + 1).copied().unwrap_or_default());
        d.iter().map(|d| d.powi(3)).sum::<f64>() + 3.0 * (0..d.len()).map(aside).sum::<f64>()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What two channels of photosites have in common of the numbers of a knot.
fn between(one: &[f64; NUMBERS], other: &[f64; NUMBERS]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn add(sum: &mut [f64], times: f64, more: &[f64]) {
    sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += times * more);
}

/// β and τ of rows of each kind.
#[derive(Clone)]
pub(super) struct RowKinds {
    sums: Vec<Vec<f64>>,
    squares: Vec<Tridiagonal>,
}

impl RowKinds {
    /// Of rows of such kinds from one of the sensor on, with so many of them from knot to knot.
    pub fn of(first: i64, kinds: &[usize], rows_per_knot: f64) -> Self {
        let base = knots(first, rows_per_knot).0;
        let at = |index: usize| {
            let (knot, weights) = knots(first + index as i64, rows_per_knot);
            (usize::try_from(knot - base).unwrap_or_default(), weights)
        };
        let length = kinds.len().checked_sub(1).map_or(0, |last| at(last).0 + 2);
        let count = kinds.iter().max().map_or(0, |most| most + 1);
        let mut found = Self { sums: vec![vec![0.0; length]; count], squares: vec![Tridiagonal::zero(length); count] };
        for (index, kind) in kinds.iter().enumerate() {
            let (knot, [a, b]) = at(index);
            let (sums, squares) = (&mut found.sums[*kind], &mut found.squares[*kind]);
            sums[knot] += a;
            sums[knot + 1] += b;
            squares.diagonal[knot] += a * a;
            squares.diagonal[knot + 1] += b * b;
            squares.beside[knot] += a * b;
        }
        found
    }

    fn length(&self) -> usize {
        self.sums.first().map_or(0, Vec::len)
    }
}

/// Parts of G: those of each number for each channel.
const PARTS: usize = 3 * NUMBERS;

/// What is made of G of three channels.
struct Knotted {
    /// g, of the number a and the channel i as 3 a + i.
    sums: [Vec<f64>; PARTS],
    /// T, of two of these.
    squares: Vec<Tridiagonal>,
    /// Σ_c n_c κ_j d_i β, by number and as 3 j + i.
    of_distances: [[Vec<f64>; 9]; NUMBERS],
    /// β_ρ·β_ρ′.
    together: DMatrix<f64>,
}

impl Knotted {
    /// T of two parts.
    fn square(&self, one: usize, other: usize) -> &Tridiagonal {
        &self.squares[PARTS * one + other]
    }
}

impl DriftCells<'_> {
    fn count(&self) -> f64 {
        self.cells.iter().map(|cell| cell.columns * cell.rows).sum()
    }

    fn knotted(&self) -> Knotted {
        let length = self.rows.length();
        let of_cells = |of: &dyn Fn(&DriftCell) -> f64| {
            let mut sums = vec![0.0; length];
            self.cells.iter().for_each(|cell| add(&mut sums, cell.columns * of(cell), &self.rows.sums[cell.row]));
            sums
        };
        let scale = |cell: &DriftCell, part: usize| cell.scales[part % 3][part / 3];
        let squares = |i: usize, j: usize| {
            let mut sums = Tridiagonal::zero(length);
            for cell in &self.cells {
                sums.add(cell.columns * scale(cell, i) * scale(cell, j), &self.rows.squares[cell.row]);
            }
            sums
        };
        let kinds = self.rows.sums.len();
        Knotted {
            sums: std::array::from_fn(|part| of_cells(&|cell| scale(cell, part))),
            squares: (0..PARTS * PARTS).map(|pair| squares(pair / PARTS, pair % PARTS)).collect(),
            of_distances: std::array::from_fn(|number| {
                std::array::from_fn(|pair| of_cells(&|cell| cell.scales[pair / 3][number] * cell.off[pair % 3]))
            }),
            together: DMatrix::from_fn(kinds, kinds, |a, b| dot(&self.rows.sums[a], &self.rows.sums[b])),
        }
    }

    /// What A of two channels makes in each cell of numbers that all photosites of a cell have: of what is their own and their rows', and of
    /// their columns'.
    fn along_rows(&self, [i, k]: [usize; 2], x: &dyn Fn(&DriftCell) -> f64) -> Vec<f64> {
        let of_cell = |(c, cell): (usize, &DriftCell)| {
            let others = self.cells.iter().enumerate().filter(|(_, other)| other.row == cell.row);
            let of_row: f64 = others.map(|(o, other)| (self.in_row)([c, i], [o, k]) * other.columns * x(other)).sum();
            cell.own[(i, k)] * x(cell) + of_row
        };
        self.cells.iter().enumerate().map(of_cell).collect()
    }

    /// What two cells share by their columns.
    fn in_columns(&self, [i, k]: [usize; 2]) -> DMatrix<f64> {
        DMatrix::from_fn(self.cells.len(), self.cells.len(), |c, o| (self.in_column)([c, i], [o, k]))
    }

    /// What the drift adds.
    pub fn sums(&self) -> DriftSums {
        let n = self.count();
        let made = self.knotted();
        let g = &made.sums;
        let numbers = 0..self.numbers();
        let of_mean =
            Matrix3::from_fn(|i, j| numbers.clone().map(|number| dot(&g[3 * number + i], &g[3 * number + j])).sum());
        let trace = |i: usize, j: usize| {
            let of_cell = |cell: &DriftCell| cell.columns * cell.rows * between(&cell.scales[i], &cell.scales[j]);
            self.cells.iter().map(of_cell).sum::<f64>() - of_mean[(i, j)] / n
        };
        // tr P V_ik P V_lj, of the numbers a of the first and b of the other.
        let both: Vec<[usize; 2]> = numbers.clone().flat_map(|a| numbers.clone().map(move |b| [a, b])).collect();
        let itself = |[i, k]: [usize; 2], [l, j]: [usize; 2]| -> f64 {
            let of_numbers = |[a, b]: &[usize; 2]| {
                let [i, k, l, j] = [3 * a + i, 3 * a + k, 3 * b + l, 3 * b + j];
                let [t_kl, t_ji] = [made.square(k, l), made.square(j, i)];
                let means = dot(&g[i], &t_kl.times(&g[j])) + dot(&g[l], &t_ji.times(&g[k]));
                t_kl.trace_with(t_ji) - means / n + dot(&g[l], &g[j]) * dot(&g[k], &g[i]) / (n * n)
            };
            both.iter().map(of_numbers).sum()
        };
        let crossed: Vec<[[f64; 3]; 3]> = (0..9).map(|pair| self.crossed(&made, [pair / 3, pair % 3], n)).collect();
        let cross = |[i, k]: [usize; 2], [l, j]: [usize; 2]| crossed[3 * i + k][l][j] + crossed[3 * l + j][i][k];
        let form = |one: usize, other: usize| -> f64 {
            numbers.clone().map(|a| dot(&made.of_distances[a][one], &made.of_distances[a][other])).sum()
        };
        let e = |j: usize, i: usize| 3 * j + i;
        let spread = PAIRS.map(|[i, j]| {
            PAIRS.map(|[k, l]| {
                let of = |ik: [usize; 2], lj: [usize; 2]| itself(ik, lj) + cross(ik, lj);
                let [one, other] = [[e(j, i), e(i, j)], [e(l, k), e(k, l)]];
                let forms: f64 = one.iter().flat_map(|one| other.map(|other| form(*one, other))).sum();
                of([i, k], [l, j]) + of([i, l], [k, j]) + forms
            })
        });
        let thirds = match numbers.end {
            1 => [0, 1, 2].map(|i| self.third(&made, i, n)),
            _ => self.with_one_number(|cells| [0, 1, 2].map(|i| cells.third(&cells.knotted(), i, n))),
        };
        DriftSums { of_mean, trace: Matrix3::from_fn(trace), spread, thirds }
    }

    /// How many numbers of a knot any cell has.
    fn numbers(&self) -> usize {
        let has_two = |cell: &DriftCell| cell.scales.iter().any(|scales| scales[1] != 0.0);
        if self.cells.iter().any(has_two) { NUMBERS } else { 1 }
    }

    /// The same cells as if each channel had one number, of all that both are.
    fn with_one_number<T>(&self, make: impl FnOnce(&DriftCells<'_>) -> T) -> T {
        let one = |scales: [f64; NUMBERS]| [scales[0].hypot(scales[1]), 0.0];
        let of_cell = |cell: &DriftCell| DriftCell { scales: cell.scales.map(one), ..*cell };
        let Self { in_row, in_column, .. } = *self;
        make(&DriftCells {
            cells: self.cells.iter().map(of_cell).collect(),
            in_row,
            in_column,
            rows: self.rows.clone(),
        })
    }

    /// tr P A_ik P V_lj of two channels i and k, by l and j: Σ_m v_jᵀ P A_ik P v_l.
    fn crossed(&self, made: &Knotted, channels: [usize; 2], n: f64) -> [[f64; 3]; 3] {
        let mut found = [[0.0; 3]; 3];
        for number in 0..self.numbers() {
            let of_number = self.crossed_by(made, channels, number, n);
            found.iter_mut().flatten().zip(of_number.iter().flatten()).for_each(|(sum, of)| *sum += of);
        }
        found
    }

    /// What one number has of it.
    fn crossed_by(&self, made: &Knotted, [i, k]: [usize; 2], number: usize, n: f64) -> [[f64; 3]; 3] {
        let g = &made.sums[3 * number..][..3];
        let in_columns = self.in_columns([i, k]);
        let along = self.along_rows([i, k], &|_| 1.0);
        let row_sum = |c: usize| {
            let all: f64 = self.cells.iter().enumerate().map(|(o, other)| in_columns[(c, o)] * other.rows).sum();
            along[c] + all
        };
        let row_sums: Vec<f64> = (0..self.cells.len()).map(row_sum).collect();
        let all: f64 = self.cells.iter().zip(&row_sums).map(|(cell, sum)| cell.columns * cell.rows * sum).sum();
        let with_sums: Vec<[f64; 3]> =
            (self.rows.sums.iter()).map(|sums| [0, 1, 2].map(|l| dot(sums, &g[l]))).collect();
        [0, 1, 2].map(|l| {
            let xi = self.along_rows([i, k], &|cell| cell.scales[l][number]);
            [0, 1, 2].map(|j| {
                let (mut whole, mut of_ones, mut of_sums) = (0.0, 0.0, 0.0);
                for (c, cell) in self.cells.iter().enumerate() {
                    // η·β of its rows, and η·g.
                    let (mut with_row, mut with_all) = (0.0, 0.0);
                    for (o, other) in self.cells.iter().enumerate() {
                        let load = in_columns[(c, o)] * other.scales[l][number];
                        with_row += load * made.together[(cell.row, other.row)];
                        with_all += load * with_sums[other.row][j];
                    }
                    whole += cell.columns * cell.scales[j][number] * (xi[c] * cell.rows + with_row);
                    of_ones += cell.columns * (xi[c] * with_sums[cell.row][j] + cell.rows * with_all);
                    of_sums += cell.columns * cell.scales[j][number] * row_sums[c] * with_sums[cell.row][l];
                }
                whole - (of_ones + of_sums) / n + dot(&g[j], &g[l]) * all / (n * n)
            })
        })
    }

    /// What the drift adds to 8 tr (PC)³ + 24 |P C d|² of a channel, A of which alone is counted, where knots have one number.
    fn third(&self, made: &Knotted, i: usize, n: f64) -> f64 {
        let (g, t) = (&made.sums[i], made.square(i, i));
        let in_columns = self.in_columns([i, i]);
        let xi = self.along_rows([i, i], &|cell| cell.scales[i][0]);
        let ones = self.along_rows([i, i], &|_| 1.0);
        let length = self.rows.length();
        // A P v = ξ b(r) + ζ(c), ζ = η − α g/n.
        let zeta = |c: usize| {
            let (mut found, mut row_sum) = (vec![0.0; length], ones[c]);
            for (o, other) in self.cells.iter().enumerate() {
                add(&mut found, in_columns[(c, o)] * other.scales[i][0], &self.rows.sums[other.row]);
                row_sum += in_columns[(c, o)] * other.rows;
            }
            add(&mut found, -row_sum / n, g);
            found
        };
        let (mut squares, mut sums) = (0.0, vec![0.0; length]);
        let (tg, gg) = (t.times(g), dot(g, g));
        let (mut traces, mut means) = (0.0, 0.0);
        for (c, cell) in self.cells.iter().enumerate() {
            let (zeta, beta) = (zeta(c), &self.rows.sums[cell.row]);
            let square = xi[c] * xi[c] * cell.rows + 2.0 * xi[c] * dot(beta, &zeta) + cell.rows * dot(&zeta, &zeta);
            squares += cell.columns * square;
            add(&mut sums, cell.columns * xi[c], beta);
            add(&mut sums, cell.columns * cell.rows, &zeta);
            let tau = &self.rows.squares[cell.row];
            let load = cell.columns * cell.scales[i][0];
            traces += load * (xi[c] * t.trace_with(tau) + dot(beta, &t.times(&zeta)));
            means += load * (xi[c] * dot(g, &tau.times(g)) + dot(g, beta) * dot(&zeta, g));
        }
        let once = squares - dot(&sums, &sums) / n;
        let twice = traces - dot(&tg, &sums) / n - (means - gg * dot(&sums, g) / n) / n;
        let thrice = t.trace_of_cube() - 3.0 * dot(&tg, &tg) / n + 3.0 * dot(g, &tg) * gg / (n * n) - (gg / n).powi(3);
        8.0 * (3.0 * once + 3.0 * twice + thrice) + 24.0 * self.distances(made, i, n)
    }

    /// |P C d|² less |P A d|² of a channel.
    fn distances(&self, made: &Knotted, i: usize, n: f64) -> f64 {
        let (g, e) = (&made.sums[i], &made.of_distances[0][4 * i]);
        let in_columns = self.in_columns([i, i]);
        let along = self.along_rows([i, i], &|cell| cell.off[i]);
        let (mut cross, mut all) = (0.0, 0.0);
        for (c, cell) in self.cells.iter().enumerate() {
            let others = self.cells.iter().enumerate();
            let of_column: f64 = others.map(|(o, other)| in_columns[(c, o)] * other.rows * other.off[i]).sum();
            let found = along[c] + of_column;
            cross += found * cell.columns * cell.scales[i][0] * dot(&self.rows.sums[cell.row], e);
            all += found * cell.columns * cell.rows;
        }
        let with_all = dot(g, e);
        2.0 * (cross - all * with_all / n) + dot(e, &made.square(i, i).times(e)) - with_all * with_all / n
    }
}
