//! What photosites of several amplifiers share by rows or by columns, as sums over independent factors, and what pixels that are made
//! of them have of these.
//!
//! The covariance R of two photosites of a row, by amplifiers and classes, is Σ_ρ λ_ρ u_ρ u_ρᵀ. Pixel a has of the factor ρ of row r what its
//! photosites there have, ℓ_a(r, ρ) = Σ_s w_a(s) u_ρ(s); so pixels a and b, however far apart in it, share Σ_rρ λ_ρ ℓ_a(r, ρ) ℓ_b(r, ρ)ᵀ.
//!
//! A drift of the black level is one factor more, or over a flat field two, of which rows near each other have a part in common: on average over their places
//! c(r − r′) of it ([`super::drift::covariance`]).

use super::drift::{self, NUMBERS};
use super::moments::Prediction;
use super::tap_lines::TapLines;
use crate::stages::demosaic::stencil::REACH;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Independent factors of what photosites of a line share.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Factors {
    /// Their variances.
    pub values: Vec<f64>,
    /// What a photosite has of each, by amplifier and class, 3 a + k.
    loads: Vec<Vec<f64>>,
}

impl Factors {
    /// Of the covariances of photosites of groups, which are of such amplifiers, as parts of numbers as large as `most`.
    pub fn of(covariance: DMatrix<f64>, most: f64, taps: &[usize]) -> Self {
        let found = covariance.symmetric_eigen();
        let count = number_of(taps);
        let mut factors = Self { values: Vec::new(), loads: Vec::new() };
        for (value, vector) in found.eigenvalues.iter().zip(found.eigenvectors.column_iter()) {
            // What is left of a matrix of lower rank is rounding.
            if value.abs() <= 1e-15 * most {
                continue;
            }
            let mut loads = vec![0.0; count];
            for (group, tap) in taps.iter().enumerate() {
                (0..3).for_each(|class| loads[3 * tap + class] = vector[3 * group + class]);
            }
            factors.values.push(*value);
            factors.loads.push(loads);
        }
        factors
    }

    /// One factor, of which photosites have so much by amplifier and class.
    pub fn single(taps: usize, load: impl Fn(usize, usize) -> f64) -> Self {
        let loads = (0..3 * taps).map(|at| load(at / 3, at % 3)).collect();
        Self { values: vec![1.0], loads: vec![loads] }
    }

    /// None.
    pub fn none() -> Self {
        Self { values: Vec::new(), loads: Vec::new() }
    }

    /// So many of variance 1, of which photosites have so much by amplifier and class.
    pub fn several(rank: usize, taps: usize, load: impl Fn(usize, usize) -> [f64; NUMBERS]) -> Self {
        let loads = |part: usize| (0..3 * taps).map(|at| load(at / 3, at % 3)[part]).collect();
        Self { values: vec![1.0; rank], loads: (0..rank).map(loads).collect() }
    }

    /// What a photosite of an amplifier and class has of the first few.
    pub fn load(&self, tap: usize, class: usize) -> [f64; NUMBERS] {
        let part = |part: usize| self.loads.get(part).and_then(|loads| loads.get(3 * tap + class)).copied();
        std::array::from_fn(|index| part(index).unwrap_or_default())
    }

    /// What pixels have of each, `sites` being their photosites: how many lines they are away, of which amplifier and class, and their
    /// weights.
    pub fn of_pixel(&self, sites: impl Iterator<Item = (isize, [usize; 2], [f64; 3])>) -> Loads {
        let rank = self.values.len();
        let mut found = vec![[0.0; 3]; LINES * rank];
        for (offset, [tap, class], weights) in sites {
            let line = (offset + REACH).cast_unsigned();
            for (sums, loads) in found[line * rank..][..rank].iter_mut().zip(&self.loads) {
                let load = loads.get(3 * tap + class).copied().unwrap_or_default();
                sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * load);
            }
        }
        Loads { rank, loads: found }
    }

    /// What two photosites share, each by amplifier and class.
    pub fn between(&self, [tap, class]: [usize; 2], [other, of_other]: [usize; 2]) -> f64 {
        let load = |loads: &Vec<f64>, at: usize| loads.get(at).copied().unwrap_or_default();
        let both = |loads: &Vec<f64>| load(loads, 3 * tap + class) * load(loads, 3 * other + of_other);
        self.values.iter().zip(&self.loads).map(|(value, loads)| value * both(loads)).sum()
    }
}

/// Photosites of amplifiers up to the last, by class.
fn number_of(taps: &[usize]) -> usize {
    3 * taps.iter().map(|tap| tap + 1).max().unwrap_or_default()
}

/// A drift of the black level, as factors of each row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drifting {
    /// Of variance 1.
    pub factors: Factors,
    /// Rows from one knot to the next.
    pub rows_per_knot: f64,
}

impl Drifting {
    /// What a pixel shares with itself of such loads by rows, on average over their places.
    fn covariance(&self, loads: &Loads) -> Matrix3<f64> {
        let each =
            |part: usize| (-REACH..=REACH).filter_map(move |row| Some((row, Vector3::from(*loads.at(row).get(part)?))));
        let of = |part: usize, (row, load): (isize, Vector3<f64>)| -> Matrix3<f64> {
            let with = |(other, theirs): (isize, Vector3<f64>)| {
                drift::covariance((row - other) as f64 / self.rows_per_knot) * theirs
            };
            load * each(part).map(with).sum::<Vector3<f64>>().transpose()
        };
        (0..self.factors.values.len()).flat_map(|part| each(part).map(move |load| of(part, load))).sum()
    }
}

/// What photosites share.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shared {
    /// By rows and by columns.
    pub lines: [Factors; 2],
    /// By rows that are near each other.
    pub drift: Option<Drifting>,
}

impl Shared {
    /// Of photosites of groups, which are of such amplifiers.
    fn of(lines: &TapLines, taps: &[usize]) -> Self {
        let [row, column] = lines.axes();
        let alone = DMatrix::from_fn(row.nrows(), row.ncols(), |a, b| lines.row_alone(a, b));
        let drift = lines.drift.as_ref().map(|drift| {
            let group = |tap: usize| taps.iter().position(|of| *of == tap);
            let load = |tap, class| group(tap).map_or([0.0; NUMBERS], |group| drift.loads[3 * group + class]);
            let factors = Factors::several(drift.rank(), number_of(taps) / 3, load);
            Drifting { factors, rows_per_knot: drift.rows_per_knot }
        });
        let lines = [Factors::of(alone, row.amax(), taps), Factors::of(column.clone(), column.amax(), taps)];
        Self { lines, drift }
    }

    /// One factor alone, of rows (0) or columns (1), or where rows have knots, a drift of these.
    pub fn single(axis: usize, factors: Factors, rows_per_knot: Option<f64>) -> Self {
        match rows_per_knot {
            Some(rows_per_knot) => {
                Self { lines: [Factors::none(), Factors::none()], drift: Some(Drifting { factors, rows_per_knot }) }
            }
            None if axis == 0 => Self { lines: [factors, Factors::none()], drift: None },
            None => Self { lines: [Factors::none(), factors], drift: None },
        }
    }

    /// What two photosites of a pixel share that lies at such a place among the knots of the drift.
    pub fn between(&self, one: &Site, other: &Site, place: f64) -> f64 {
        let [mine, theirs] = [one, other].map(|site| [site.tap, site.class]);
        let of_axis = |axis: usize| {
            let is_shared = one.offset[1 - axis] == other.offset[1 - axis];
            if is_shared { self.lines[axis].between(mine, theirs) } else { 0.0 }
        };
        let of_drift = self.drift.as_ref().map_or(0.0, |drift| {
            let [row, other_row] = [one, other].map(|site| place + site.offset[1] as f64 / drift.rows_per_knot);
            drift.factors.between(mine, theirs) * drift::between(row, other_row)
        });
        of_axis(0) + of_axis(1) + of_drift
    }

    /// What a pixel of such photosites has of what they share by rows, by columns, and by the drift of rows.
    pub fn loads(&self, sites: &[Site]) -> [Loads; 3] {
        let none = Factors::none();
        let drift = self.drift.as_ref().map_or(&none, |drift| &drift.factors);
        [(&self.lines[0], 0), (&self.lines[1], 1), (drift, 0)].map(|(factors, axis)| loads(sites, factors, axis))
    }

    /// What a pixel of such photosites shares with itself.
    fn covariance(&self, sites: &[Site]) -> Matrix3<f64> {
        let [rows, columns, drifting] = self.loads(sites);
        let of_lines = rows.covariance(&rows, 0, &self.lines[0].values);
        let of_drift = self.drift.as_ref().map(|drift| drift.covariance(&drifting));
        of_lines + columns.covariance(&columns, 0, &self.lines[1].values) + of_drift.unwrap_or_default()
    }
}

/// Lines that a pixel reaches.
const LINES: usize = 2 * REACH.unsigned_abs() + 1;

/// What the channels of a pixel have of the factors of each line around it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Loads {
    rank: usize,
    loads: Vec<[f64; 3]>,
}

impl Loads {
    /// Of the line so far away, by factor; of none that is out of reach.
    pub fn at(&self, offset: isize) -> &[[f64; 3]] {
        match offset.abs() <= REACH {
            true => &self.loads[(offset + REACH).cast_unsigned() * self.rank..][..self.rank],
            false => &[],
        }
    }

    /// What the channels (rows) share with those of a pixel `lag` lines away (columns), by factors of such variances.
    pub fn covariance(&self, other: &Self, lag: isize, values: &[f64]) -> Matrix3<f64> {
        let mut found = Matrix3::zeros();
        for offset in (-REACH).max(lag - REACH)..=REACH.min(lag + REACH) {
            for ((mine, theirs), value) in self.at(offset).iter().zip(other.at(offset - lag)).zip(values) {
                if *mine != [0.0; 3] && *theirs != [0.0; 3] {
                    found += *value * Vector3::from(*mine) * Vector3::from(*theirs).transpose();
                }
            }
        }
        found
    }
}

/// A photosite of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Site {
    pub offset: [isize; 2],
    pub class: usize,
    pub tap: usize,
    /// What is its own.
    pub variance: f64,
    /// What it gives to the channels, to first order.
    pub weights: [f64; 3],
}

pub(super) fn product(a: &[f64; 3], b: &[f64; 3]) -> Matrix3<f64> {
    Vector3::from(*a) * Vector3::from(*b).transpose()
}

/// What a pixel of such photosites has of what they share by an axis.
fn loads(sites: &[Site], factors: &Factors, axis: usize) -> Loads {
    factors.of_pixel(sites.iter().map(|site| (site.offset[1 - axis], [site.tap, site.class], site.weights)))
}

/// To first order, the covariance of a pixel of photosites that have such variances by themselves, and share so much.
pub(super) fn first_order(sites: &[Site], own: impl Fn(&Site) -> f64, shared: Option<&Shared>) -> Matrix3<f64> {
    let own: Matrix3<f64> = sites.iter().map(|site| own(site) * product(&site.weights, &site.weights)).sum();
    shared.map_or(own, |shared| own + shared.covariance(sites))
}

/// Moments of photosites behind each of some amplifiers, of one exposure or of their means over exposures.
#[derive(Debug, Clone, PartialEq)]
pub struct TapMoments {
    /// By amplifier; none of those that read no photosite.
    pub(super) sites: Vec<[Prediction; 3]>,
    /// What of their variances is their own.
    pub(super) own: Vec<[f64; 3]>,
    /// What of their third and fourth cumulants is.
    pub(super) cumulants: Vec<[[f64; 2]; 3]>,
    /// What they share by rows and by columns; none where they share nothing.
    pub(super) shared: Option<Shared>,
    /// Which of the groups are of an amplifier.
    groups: Vec<usize>,
}

impl TapMoments {
    /// Of groups, each with its amplifier and moments, and of what these share.
    pub fn of(groups: &[(usize, [Prediction; 3])], lines: Option<&TapLines>) -> Self {
        let count = groups.iter().map(|(tap, _)| tap + 1).max().unwrap_or_default();
        let none = [Prediction::of_cumulants(0.0, 0.0, 0.0, 0.0); 3];
        let taps: Vec<usize> = groups.iter().map(|(tap, _)| *tap).collect();
        let mut found = Self {
            sites: vec![none; count],
            own: vec![[0.0; 3]; count],
            cumulants: vec![[[0.0; 2]; 3]; count],
            shared: lines.map(|lines| Shared::of(lines, &taps)),
            groups: vec![0; count],
        };
        for (index, (tap, sites)) in groups.iter().enumerate() {
            let of_class = |class: usize| {
                let (place, site) = (3 * index + class, &sites[class]);
                let variance = site.moments.variance;
                match lines {
                    Some(lines) => (lines.own(place, variance), lines.own_cumulants(place, site)),
                    None => (variance, [site.third, site.fourth_of_own(variance)]),
                }
            };
            let of_classes = [0, 1, 2].map(of_class);
            found.sites[*tap] = *sites;
            found.own[*tap] = of_classes.map(|(own, _)| own);
            found.cumulants[*tap] = of_classes.map(|(_, cumulants)| cumulants);
            found.groups[*tap] = index;
        }
        found
    }

    /// Whether rows share the drift of the black level.
    pub(super) fn drifts(&self) -> bool {
        self.shared.as_ref().is_some_and(|shared| shared.drift.is_some())
    }

    /// Where photosites of an amplifier and class stand in what lines share.
    pub(super) fn place(&self, tap: usize, class: usize) -> usize {
        3 * self.groups[tap] + class
    }

    /// To first order, the covariance of a pixel of such photosites.
    pub(super) fn first_order(&self, sites: &[Site]) -> Matrix3<f64> {
        first_order(sites, |site| self.own[site.tap][site.class], self.shared.as_ref())
    }
}
