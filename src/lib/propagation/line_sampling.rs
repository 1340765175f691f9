//! How sample means and covariances scatter where photosites share rows and columns.
//!
//! Pixels a and b have the covariance C(a, b) = B(a, b) + R(a, b) + S(a, b): B of what is each photosite's own, within reach of
//! the weights; R of rows, Σ_r Σ_kl A_rk(a) R_kl A_rl(b) with A_rk(a) the sum of the weights of a on the sites of class k in row r,
//! however far apart a and b are; S so of columns. R hangs on the rows of two pixels and the parities of their columns alone,
//! since folding at an edge keeps class and row. So with n_p columns of each parity p
//!
//! - Σ_ab R = Σ n_p n_q R(p, y; q, y′)
//! - Σ_ab R ⊗ R = Σ n_p n_q R(p, y; q, y′) ⊗ R(p, y; q, y′)
//! - Σ_ab R ⊗ S = Σ over parities of \[Σ_yy′ R\] ⊗ \[Σ_xx′ S\]
//!
//! and B ⊗ R is local. Sums over y grow with every two rows by the same amount, as those of B do.

use super::covariance::PAIRS;
use super::moments::SiteCovariance;
use super::place::{Place, add_products, steps};
use crate::stages::demosaic::stencil::{REACH, phase};
use crate::stages::demosaic::weights::Weights;
use nalgebra::{Matrix3, Vector3};

/// Lines that a pixel reaches.
const LINES: usize = 2 * REACH.unsigned_abs() + 1;

/// What the sites of each line within reach of a pixel give to its channels, by classes.
pub(super) type Profile = [[[f64; 3]; 3]; LINES];

/// What the pixels of a rectangle share by its rows, or by its columns.
pub(super) struct Shared {
    covariance: Matrix3<f64>,
    /// Pixels of a line, by parity.
    counts: [f64; 2],
    /// Of the pixels of each line, by parity along it.
    profiles: Vec<[Profile; 2]>,
}

impl Shared {
    /// By rows where `axis` is 0, by columns where it is 1; lines have so many pixels along them.
    pub fn of(weights: &Weights, covariance: &Matrix3<f64>, axis: usize, place: &Place, along: usize) -> Self {
        let across = 1 - axis;
        let profile = |t: usize, p: usize| {
            let mut at = place.corner;
            at[axis] += p.min(place.size[axis] - 1);
            at[across] += t;
            let [x, y] = [0, 1].map(|i| i64::from(place.origin[i]) + at[i] as i64);
            let phase = phase(x, y);
            let stencils = [0, 1, 2].map(|channel| weights.stencil(phase, channel).folded(at, place.frame));
            let mut found = Profile::default();
            for (channel, stencil) in stencils.iter().enumerate() {
                for (offset, weight) in stencil.sites() {
                    let class = weights.class(phase, offset) as usize;
                    found[(offset[across] + REACH).cast_unsigned()][class][channel] += weight;
                }
            }
            found
        };
        Self {
            covariance: *covariance,
            counts: [along.div_ceil(2) as f64, (along / 2) as f64],
            profiles: (0..place.size[across]).map(|t| [0, 1].map(|p| profile(t, p))).collect(),
        }
    }

    /// What the sites of each line within reach of a pixel give to its channels.
    pub fn profile(&self, t: usize, p: usize) -> &Profile {
        &self.profiles[t][p]
    }

    /// Pixels of a line, by parity.
    pub fn counts(&self) -> [f64; 2] {
        self.counts
    }

    /// Whether nothing is shared.
    pub fn is_none(&self) -> bool {
        self.covariance == Matrix3::zeros()
    }

    /// The covariance of the channels of a pixel (rows) with those of another (columns), each by parity along and line.
    pub fn covariance(&self, [p, t]: [usize; 2], [q, u]: [usize; 2]) -> Matrix3<f64> {
        let (first, second) = (&self.profiles[t][p], &self.profiles[u][q]);
        let lag = u.cast_signed() - t.cast_signed();
        let mut found = Matrix3::zeros();
        for (line, mine) in first.iter().enumerate() {
            let Some(theirs) = line.checked_add_signed(-lag).and_then(|there| second.get(there)) else { continue };
            for (k, mine) in mine.iter().enumerate() {
                for (l, theirs) in theirs.iter().enumerate() {
                    let (mine, theirs) = (Vector3::from(*mine), Vector3::from(*theirs));
                    found += self.covariance[(k, l)] * mine * theirs.transpose();
                }
            }
        }
        found
    }

    /// Lines that share something with one.
    pub fn near(&self, t: usize) -> std::ops::Range<usize> {
        t.saturating_sub(LINES - 1)..(t + LINES).min(self.profiles.len())
    }

    /// The covariance of a pixel with the sum of all pixels.
    fn row_sum(&self, p: usize, t: usize) -> Matrix3<f64> {
        let all = self.near(t).flat_map(|u| [0, 1].map(|q| [q, u]));
        all.map(|other| self.counts[other[0]] * self.covariance([p, t], other)).sum()
    }
}

/// What the pixels of a small place share, whose lines are as long as those of the place that it stands for.
pub(super) struct Local {
    /// Covariances by rows and by columns of two pixels, by line and parity of each.
    tables: [Vec<Matrix3<f64>>; 2],
    lines: [usize; 2],
    /// Row sums by rows and by columns, `[axis][line][parity]`.
    sums: [Vec<[Matrix3<f64>; 2]>; 2],
}

impl Local {
    /// Of a place that stands for one of a size.
    pub fn of(weights: &Weights, sites: &SiteCovariance, small: &Place, size: [usize; 2]) -> Self {
        let shared = [0, 1].map(|axis| Shared::of(weights, sites.lines()[axis], axis, small, size[axis]));
        let sums = shared
            .each_ref()
            .map(|shared| (0..shared.profiles.len()).map(|t| [0, 1].map(|p| shared.row_sum(p, t))).collect());
        let tables = shared.each_ref().map(|shared| {
            let pixels = 2 * shared.profiles.len();
            let both = (0..pixels).flat_map(|a| (0..pixels).map(move |b| [[a % 2, a / 2], [b % 2, b / 2]]));
            both.map(|[a, b]| shared.covariance(a, b)).collect()
        });
        Self { tables, lines: shared.map(|shared| shared.profiles.len()), sums }
    }

    /// The covariance of two pixels, by column and row in the place.
    pub fn covariance(&self, [x, y]: [usize; 2], [other_x, other_y]: [usize; 2]) -> Matrix3<f64> {
        let of_axis = |axis: usize, [p, t]: [usize; 2], [q, u]: [usize; 2]| {
            self.tables[axis][(2 * t + p) * 2 * self.lines[axis] + 2 * u + q]
        };
        of_axis(0, [x % 2, y], [other_x % 2, other_y]) + of_axis(1, [y % 2, x], [other_y % 2, other_x])
    }

    /// The covariance of a pixel with the sum of all.
    pub fn row_sum(&self, [x, y]: [usize; 2]) -> Matrix3<f64> {
        self.sums[0][y][x % 2] + self.sums[1][x][y % 2]
    }
}

/// Sums over the pixels of a place of what they share.
pub(super) struct Nonlocal {
    /// Σ_ab C.
    pub total: Matrix3<f64>,
    /// Σ_ab C_ik C_jl + C_il C_jk.
    pub products: [[f64; 6]; 6],
    /// Of row sums, in both orders.
    pub row_products: [[f64; 6]; 6],
    /// Σ λ, Σ λ² and Σ λ³ of what rows share, columns, and rows near each other, for each channel, as the mean leaves them.
    pub powers: [[[f64; 3]; 3]; 3],
}

/// Sums of one axis over all its lines.
pub(super) struct AxisSums {
    pub total: Matrix3<f64>,
    products: [[f64; 6]; 6],
    row_products: [[f64; 6]; 6],
    /// Σ over lines of parities q, q′ of what pixels of parities p, p′ share: `[p][p′][q][q′]`.
    pub by_parity: [[[[Matrix3<f64>; 2]; 2]; 2]; 2],
    /// Σ over lines of parity q of the row sums of pixels of parity p: `[p][q]`.
    pub row_sums: [[Matrix3<f64>; 2]; 2],
    powers: [Powers; 3],
}

/// Sums over the pixels of a place of what one channel of them shares, r = C1 its row sums.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Powers {
    /// tr C, tr C² and tr C³.
    pub traces: [f64; 3],
    /// r·r and r·Cr.
    pub of_row_sums: [f64; 2],
}

impl Powers {
    /// tr (PC)ᵏ, P the projection that takes the mean of so many pixels off.
    pub fn projected(&self, total: f64, count: f64) -> [f64; 3] {
        let [one, two, three] = self.traces;
        let [square, cube] = self.of_row_sums;
        let mean = total / count;
        let found = [
            one - mean,
            two - 2.0 * square / count + mean * mean,
            three - 3.0 * cube / count + 3.0 * mean * square / count - mean.powi(3),
        ];
        found.map(|power| power.max(0.0))
    }
}

impl AxisSums {
    pub fn of(weights: &Weights, covariance: &Matrix3<f64>, axis: usize, place: &Place) -> Self {
        let none = [[0.0; 6]; 6];
        let mut sums = Self {
            total: Matrix3::zeros(),
            products: none,
            row_products: none,
            by_parity: Default::default(),
            row_sums: Default::default(),
            powers: Default::default(),
        };
        let across = 1 - axis;
        for (extent, share) in steps(place.size[across], weights.reach()) {
            let mut small = *place;
            small.frame[across] = place.frame[across] - place.size[across] + extent;
            small.size[across] = extent;
            sums.add(share, &Shared::of(weights, covariance, axis, &small, place.size[axis]));
        }
        sums
    }

    fn add(&mut self, share: f64, shared: &Shared) {
        let n = shared.counts;
        for t in 0..shared.profiles.len() {
            for p in 0..2 {
                let mut row_sum = Matrix3::zeros();
                for u in shared.near(t) {
                    for q in 0..2 {
                        let c = shared.covariance([p, t], [q, u]);
                        row_sum += n[q] * c;
                        add_products(&mut self.products, &c, share * n[p] * n[q]);
                        self.by_parity[p][q][t % 2][u % 2] += share * c;
                    }
                }
                self.total += share * n[p] * row_sum;
                self.row_sums[p][t % 2] += share * row_sum;
                add_products(&mut self.row_products, &row_sum, share * n[p]);
                add_products(&mut self.row_products, &row_sum.transpose(), share * n[p]);
            }
        }
        for channel in 0..3 {
            self.add_powers(share, shared, channel);
        }
    }

    fn add_powers(&mut self, share: f64, shared: &Shared, channel: usize) {
        let lines = || (0..shared.profiles.len()).flat_map(|t| [[0, t], [1, t]]);
        let covariance = |a: [usize; 2], b: [usize; 2]| shared.variance_of(channel, a, b);
        let near = |t: usize| shared.near(t).flat_map(|u| [[0, u], [1, u]]);
        let count = |[p, _]: [usize; 2]| shared.counts[p];
        let row_sum = |a: [usize; 2]| near(a[1]).map(|b| count(b) * covariance(a, b)).sum::<f64>();
        let row_sums: Vec<f64> = lines().map(row_sum).collect();
        let of_row = |[p, t]: [usize; 2]| row_sums[2 * t + p];
        let Powers { traces, of_row_sums } = &mut self.powers[channel];
        for a in lines() {
            let weight = share * count(a);
            let others: Vec<([usize; 2], f64)> = near(a[1]).map(|b| (b, covariance(a, b))).collect();
            traces[0] += weight * covariance(a, a);
            of_row_sums[0] += weight * of_row(a) * of_row(a);
            for (b, one) in &others {
                let weight = weight * count(*b) * one;
                traces[1] += weight * one;
                of_row_sums[1] += weight * of_row(a) * of_row(*b);
                traces[2] += others.iter().map(|(c, two)| weight * count(*c) * covariance(*b, *c) * two).sum::<f64>();
            }
        }
    }
}

impl Shared {
    /// The covariance of one channel of two pixels.
    fn variance_of(&self, channel: usize, [p, t]: [usize; 2], [q, u]: [usize; 2]) -> f64 {
        if t.abs_diff(u) >= LINES {
            return 0.0;
        }
        let (first, second) = (&self.profiles[t][p], &self.profiles[u][q]);
        let lag = u.cast_signed() - t.cast_signed();
        let mut sum = 0.0;
        for (line, mine) in first.iter().enumerate() {
            let Some(theirs) = line.checked_add_signed(-lag).and_then(|there| second.get(there)) else { continue };
            for (k, mine) in mine.iter().enumerate() {
                for (l, theirs) in theirs.iter().enumerate() {
                    sum += mine[channel] * self.covariance[(k, l)] * theirs[channel];
                }
            }
        }
        sum
    }
}

impl Nonlocal {
    /// Of the pixels of a place.
    pub fn of(weights: &Weights, sites: &SiteCovariance, place: &Place) -> Self {
        let [rows, columns] = [0, 1].map(|axis| AxisSums::of(weights, sites.lines()[axis], axis, place));
        let pixels = (place.size[0] * place.size[1]) as f64;
        let powers = |sums: &AxisSums| [0, 1, 2].map(|i| sums.powers[i].projected(sums.total[(i, i)], pixels));
        let mut found = Self {
            total: rows.total + columns.total,
            products: sum_of(&rows.products, &columns.products),
            row_products: sum_of(&rows.row_products, &columns.row_products),
            powers: [powers(&rows), powers(&columns), [[0.0; 3]; 3]],
        };
        for p in 0..2 {
            for q in 0..2 {
                for p_other in 0..2 {
                    for q_other in 0..2 {
                        let of_rows = &rows.by_parity[p][p_other][q][q_other];
                        add_both(&mut found.products, of_rows, &columns.by_parity[q][q_other][p][p_other]);
                    }
                }
                let (of_rows, of_columns) = (&rows.row_sums[p][q], &columns.row_sums[q][p]);
                add_both(&mut found.row_products, of_rows, of_columns);
                add_both(&mut found.row_products, &of_rows.transpose(), &of_columns.transpose());
            }
        }
        found
    }

    /// Third cumulant of the quadratic form Σ (x − x̄)² of a channel, of which what is each photosite's own makes up `own`,
    /// Σ λ and Σ λ², and `cross` is tr PDPC of that and of what is shared: 8 Σ λ³, what is shared with as much beside it of a pixel's
    /// own as these two traces tell, and of what is own as of χ².
    pub fn third(&self, channel: usize, own: [f64; 2], cross: f64) -> f64 {
        let of_own = if own[0] > 0.0 { own[1] * own[1] / own[0] } else { 0.0 };
        let shared = || self.powers.iter().map(|powers| powers[channel]);
        let all: f64 = shared().map(|[one, ..]| one).sum();
        let beside = if all > 0.0 { cross.max(0.0) / all } else { 0.0 };
        let of_shared = shared().map(|[one, two, three]| three + 3.0 * beside * (two + beside * one)).sum::<f64>();
        8.0 * (of_own + of_shared)
    }

    /// tr (PC)² of what is shared, of a channel and its pair in [`PAIRS`].
    pub fn square(&self, channel: usize, pair: usize, count: f64) -> f64 {
        let total = self.total[(channel, channel)];
        0.5 * (self.products[pair][pair] - self.row_products[pair][pair] / count) + (total / count).powi(2)
    }
}

pub(super) fn sum_of(a: &[[f64; 6]; 6], b: &[[f64; 6]; 6]) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// What the products of the sum of two covariances have beyond those of each.
pub(super) fn add_both(table: &mut [[f64; 6]; 6], a: &Matrix3<f64>, b: &Matrix3<f64>) {
    for (row, [i, j]) in table.iter_mut().zip(PAIRS) {
        for (entry, [k, l]) in row.iter_mut().zip(PAIRS) {
            *entry += a[(i, k)] * b[(j, l)] + b[(i, k)] * a[(j, l)] + a[(i, l)] * b[(j, k)] + b[(i, l)] * a[(j, k)];
        }
    }
}
