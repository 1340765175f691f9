//! What all samples of a frame are off together by the level of a flat field that several amplifiers have read.
//!
//! The level of a class is the mean ⟨F⟩ over its photosites, of which amplifier b has read the share s_b. The mean ȳ of a frame, of which
//! amplifier a has read w_a, goes with it by T = Σ w_a E y_a/⟨F⟩, so that beyond what photosites and lines make of it the means of two classes
//! have in common
//!
//! T_l cov(ȳ_k, ⟨F_l⟩) + T_k cov(⟨F_k⟩, ȳ_l) + T_k T_l cov(⟨F_k⟩, ⟨F_l⟩)
//!
//! Each covariance is a sum over amplifiers of what photosites that are in both have, 1/N of N in the level, and of what their rows and columns
//! have: Σ p_a q_b over lines, p_a the shares of these in the photosites of amplifier a, q_b those in the level; and of a drift the same of knots.

use super::drift::KnotMeans;
use super::lines::Axis;
use super::tap_lines::Lit;
use crate::camera::readout::ReadOut;
use crate::cfa::CfaPattern;
use crate::metadata::FlatRecord;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Photosites behind an amplifier: which, and what is predicted of them.
pub(super) struct Behind {
    pub tap: usize,
    pub lit: Lit,
    pub means: [f64; 3],
}

/// Photosites of a rectangle of the sensor, by amplifier and class, 3 a + k, and by line.
pub(super) struct Rectangle {
    /// How many of them there are.
    counts: Vec<f64>,
    /// The first row and the first column.
    first: [i64; 2],
    /// Shares of them by rows, and by columns.
    shares: [Vec<Vec<f64>>; 2],
}

/// Lines of a kind: the amplifiers that read them, and their parity.
type LineKind = [usize; 3];

impl Rectangle {
    /// Of a column, a row, a width and a height, of photosites behind such filters.
    pub fn of(readout: &ReadOut, pattern: Option<CfaPattern>, [x0, y0, width, height]: [i64; 4]) -> Self {
        let kind = |axis: usize, line: i64| -> LineKind {
            let [one, other] = readout.taps_of_line(axis, line);
            [one, other, usize::from(line.rem_euclid(2) == 1)]
        };
        let lines = [(1, y0, height), (0, x0, width)];
        let mut kinds = [BTreeMap::<LineKind, (i64, f64)>::new(), BTreeMap::new()];
        for (kinds, (axis, first, length)) in kinds.iter_mut().zip(lines) {
            (first..first + length).for_each(|line| kinds.entry(kind(axis, line)).or_insert((line, 0.0)).1 += 1.0);
        }
        let places = 3 * readout.taps.as_ref().map_or(1, |taps| taps.count());
        let mut counts = vec![0.0; places];
        // What lines of each kind have.
        let mut of_kinds: [BTreeMap<LineKind, Vec<f64>>; 2] = Default::default();
        for (row_kind, (y, rows)) in &kinds[0] {
            for (column_kind, (x, columns)) in &kinds[1] {
                let tap = readout.tap([*x, *y]);
                let class = pattern.map(|pattern| pattern.class(*x, *y) as usize);
                for place in (0..3).filter(|k| class.is_none_or(|class| class == *k)).map(|k| 3 * tap + k) {
                    counts[place] += rows * columns;
                    of_kinds[0].entry(*row_kind).or_insert_with(|| vec![0.0; places])[place] += columns;
                    of_kinds[1].entry(*column_kind).or_insert_with(|| vec![0.0; places])[place] += rows;
                }
            }
        }
        let shares = [0, 1].map(|index| {
            let (axis, first, length) = lines[index];
            let share = |line: i64, place: usize| {
                let of_line = of_kinds[index].get(&kind(axis, line)).map_or(0.0, |of_kind| of_kind[place]);
                if counts[place] > 0.0 { of_line / counts[place] } else { 0.0 }
            };
            (0..places).map(|place| (first..first + length).map(|line| share(line, place)).collect()).collect()
        });
        Self { counts, first: [y0, x0], shares }
    }

    /// The share of photosites of a class that an amplifier has read.
    fn share(&self, tap: usize, class: usize) -> f64 {
        let all: f64 = self.counts.iter().skip(class).step_by(3).sum();
        if all > 0.0 { self.counts[3 * tap + class] / all } else { 0.0 }
    }

    /// Σ p q over rows (0) or columns (1) of photosites at such places here and there.
    fn overlap(&self, index: usize, place: usize, other: &Self, other_place: usize) -> f64 {
        let apart = self.first[index] - other.first[index];
        let theirs = &other.shares[index][other_place];
        let of_line = |(line, share): (i64, &f64)| -> f64 {
            share * usize::try_from(line).ok().and_then(|line| theirs.get(line)).copied().unwrap_or_default()
        };
        (apart..).zip(&self.shares[index][place]).map(of_line).sum()
    }

    fn knots(&self, place: usize, rows_per_knot: f64) -> KnotMeans {
        KnotMeans::of_shares(self.first[0], &self.shares[0][place], rows_per_knot)
    }
}

/// One photosite, or mean, of a frame or of the level: what it has of lines, and of the numbers of a drift.
struct Part {
    place: usize,
    lines: [Vector3<f64>; 2],
    drift: [f64; 2],
}

/// Sums of what two sets of photosites share.
struct Sharing<'a> {
    flat: &'a FlatRecord,
    /// What rows and columns add, and how many more count in the level than are as even.
    lines: [Matrix3<f64>; 2],
    uneven: [f64; 2],
    rows_per_knot: f64,
}

impl Sharing<'_> {
    /// What a part of a rectangle shares with one of the level, beyond what is counted of photosites that are in both.
    fn between(&self, (here, one): (&Rectangle, &Part), (there, other): (&Rectangle, &Part)) -> f64 {
        let photosites = self.flat.photosites.get(one.place % 3).or(self.flat.photosites.first());
        let itself = match one.place == other.place {
            true => {
                (there.share(one.place / 3, one.place % 3) * photosites.map_or(1.0, |n| *n as f64)).max(1.0).recip()
            }
            false => 0.0,
        };
        let of_axis = |index: usize| {
            let shared = here.overlap(index, one.place, there, other.place) * self.uneven[index];
            one.lines[index].dot(&(self.lines[index] * other.lines[index])) * (shared - itself)
        };
        let both: f64 = one.drift.iter().zip(other.drift).map(|(a, b)| a * b).sum();
        let of_drift = if both != 0.0 {
            let [mine, theirs] =
                [(here, one), (there, other)].map(|(of, part)| of.knots(part.place, self.rows_per_knot));
            both * (mine.between(&theirs) - itself)
        } else {
            0.0
        };
        of_axis(0) + of_axis(1) + of_drift
    }
}

/// The covariance of what all samples of R, G and B of a rectangle are off together, `level` the one whose photosites the flat field's level is
/// the mean of, `all` those behind each amplifier; none where no formula tells.
pub(super) fn level(flat: &FlatRecord, [here, level]: [&Rectangle; 2], all: &[Behind]) -> Option<Matrix3<f64>> {
    let first = &all.first()?.lit.0;
    let of_flat = first.flat?;
    let drift = first.level_loads([1.0; 3], [1.0; 3])[0];
    let lines_of = |axis: Axis, (photosite, expected_e): &Lit| photosite.line_parts(axis, *expected_e);
    let counted = of_flat.level_lines.map_or([1.0; 2], |lines| lines.unevenness(flat.area));
    let sharing = Sharing {
        flat,
        lines: Axis::ALL.map(|axis| lines_of(axis, &all[0].lit).map_or_else(Matrix3::zeros, |(shared, _)| shared)),
        uneven: counted,
        rows_per_knot: first.drift_rows().max(2.0),
    };
    let means = |k: usize| flat.means_adu.get(k).or(flat.means_adu.first()).copied().unwrap_or(f64::NAN);
    let share_of_level = |behind: &Behind, k: usize| level.share(behind.tap, k);
    // A mean of the frame, and of the level, by amplifiers.
    let of_frame = |behind: &Behind, k: usize| {
        let (photosite, expected_e) = &behind.lit;
        let slope = photosite.slope() * photosite.flat.map_or(1.0, |flat| flat.ratios[k]);
        let times = here.share(behind.tap, k);
        let lines = Axis::ALL.map(|axis| {
            lines_of(axis, &behind.lit).map_or_else(Vector3::zeros, |(_, of_lines)| times * slope * of_lines[k])
        });
        let loads = photosite.drift_loads(photosite.ratios(*expected_e), [slope; 3], None);
        Part { place: 3 * behind.tap + k, lines, drift: loads[k].map(|load| times * load) }
    };
    let of_level = |behind: &Behind, k: usize| {
        let times = share_of_level(behind, k) * behind.lit.0.slope();
        let light_e = behind.lit.0.flat.map_or(0.0, |flat| flat.expected_e[k]);
        let lines = [times * Vector3::new(0.0, 1.0, light_e); 2];
        Part { place: 3 * behind.tap + k, lines, drift: drift.map(|load| times * load) }
    };
    let own = |behind: &Behind, k: usize| behind.lit.0.of_level(k, behind.lit.1[k]);
    let photosites = |k: usize| of_flat.photosites[k].max(1.0);
    let (mut with, mut levels) = (Matrix3::<f64>::zeros(), Matrix3::<f64>::zeros());
    for [k, l] in (0..9).map(|pair| [pair / 3, pair % 3]) {
        for a in all {
            let has_here = here.share(a.tap, k) > 0.0;
            let has_level = share_of_level(a, k) > 0.0;
            if k == l && (has_here || has_level) {
                let own = own(a, k)?;
                with[(k, k)] += here.share(a.tap, k) * of_flat.counted_share[k] * own.with / photosites(k);
                levels[(k, k)] += share_of_level(a, k) * own.variance / photosites(k);
            }
            for b in all.iter().filter(|b| share_of_level(b, l) > 0.0) {
                let other = (level, &of_level(b, l));
                with[(k, l)] += if has_here { sharing.between((here, &of_frame(a, k)), other) } else { 0.0 };
                levels[(k, l)] += if has_level { sharing.between((level, &of_level(a, k)), other) } else { 0.0 };
            }
        }
    }
    let goes_with =
        [0, 1, 2].map(|k| all.iter().map(|behind| here.share(behind.tap, k) * behind.means[k]).sum::<f64>() / means(k));
    Some(Matrix3::from_fn(|k, l| {
        let [one, other] = [goes_with[k], goes_with[l]];
        other * with[(k, l)] + one * with[(l, k)] + one * other * levels[(k, l)]
    }))
}
