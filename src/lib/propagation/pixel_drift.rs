//! What a drift of the black level makes of the covariance of a demosaicked pixel.
//!
//! Row r of the sensor has d (b_j(r) z_j + b_j+1(r) z_j+1) ([`knots`]) in the charge of each photosite. With W_k(r, c) the weights
//! that plane k of a pixel gives the photosites of class c in row r, and K_c the slope of their samples to the charge, it has
//!
//! Σ_j (Σ_r Σ_c W_k(r, c) K_c b_j(r)) d z_j,
//!
//! so that cov(k, m) is d² times the sum over knots of the products of what is in brackets: exact, at whatever row of the frame. Over a flat
//! field a knot has two numbers, K_c d is what a class has of either, and the level of the flat field, a mean over its rows, takes some of it off
//! again ([`super::divided_drift`]): all rows of that have a part in the sum.

use super::covariance::{Covariance, PAIRS};
use super::divided_drift::level_means;
use super::drift::{KnotMeans, NUMBERS};
use super::lines::LineTerms;
use super::photosite::Photosite;
use super::pixel_gains::phase_at;
use crate::cfa::CfaPattern;
use crate::frame::Geometry;
use crate::metadata::AverageRecord;
use crate::stages::demosaic::stencil::Stencil;
use crate::stages::demosaic::weights::WeightTable;
use crate::stages::noise::knots;

/// The drift of the rows of a frame, and how each kind of pixel takes it up.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PixelDrift {
    /// What it is in e² of the frame, of frame and flat field together, and of the flat field.
    terms: [f64; 3],
    /// What the levels of classes have of each knot, and their covariances, where a flat field divided them.
    level: Option<([KnotMeans; 3], [[f64; 3]; 3])>,
    /// The last knot up to each row of the frame, and the weights of it and the next.
    knots: Vec<(i64, [f64; 2])>,
    /// Of each kind of pixels.
    weights: Vec<RowWeights>,
}

/// The weights of each plane of a pixel, those that are fixed and those of its hue, by rows: its distance, and the sum of each class.
#[derive(Debug, Clone, PartialEq)]
struct RowWeights([[OfRows; 3]; 2]);

/// The distances of rows, and the sums of the weights of each class there.
type OfRows = Vec<(isize, [f64; 3])>;

impl RowWeights {
    fn of(table: &WeightTable, at: [usize; 2], geometry: &Geometry, gain: impl Fn([isize; 2]) -> f64) -> Self {
        let phase = phase_at(at, geometry);
        let by_rows = |stencil: &Stencil| {
            let mut rows = OfRows::new();
            for (offset, weight) in stencil.folded(at, [geometry.width, geometry.height]).sites() {
                let place = rows.iter().position(|(row, _)| *row == offset[1]).unwrap_or_else(|| {
                    rows.push((offset[1], [0.0; 3]));
                    rows.len() - 1
                });
                let of_site = gain([0, 1].map(|axis| at[axis].cast_signed() + offset[axis]));
                rows[place].1[table.class(phase, offset) as usize] += weight * of_site;
            }
            rows
        };
        Self([table.fixed(phase), table.of_hue(phase)].map(|stencils| stencils.each_ref().map(by_rows)))
    }
}

/// Knots of the drift that the rows of a stencil meet: there are two rows at least from one to the next.
const KNOTS: usize = 6;

impl PixelDrift {
    /// That of the pixels of a frame, an average or not, of which such places are the kinds; `gain` is the slope of the photosite at a place,
    /// relative to that of all.
    pub fn of(
        photosite: &Photosite,
        average: Option<&AverageRecord>,
        pattern: Option<CfaPattern>,
        table: &WeightTable,
        kinds: &[[usize; 2]],
        geometry: &Geometry,
        gain: impl Fn([isize; 2]) -> f64,
    ) -> Self {
        let first = i64::from(geometry.origin[1]);
        let rows_per_knot = photosite.drift_rows();
        Self {
            terms: photosite.drift_terms(average),
            level: photosite.flat.and_then(|flat| flat.level_lines).map(|lines| {
                let means = level_means(&lines, pattern, rows_per_knot);
                let between = std::array::from_fn(|k| std::array::from_fn(|l| means[k].between(&means[l])));
                (means, between)
            }),
            knots: (0..geometry.height).map(|row| knots(first + row as i64, rows_per_knot)).collect(),
            weights: kinds.iter().map(|&at| RowWeights::of(table, at, geometry, &gain)).collect(),
        }
    }

    /// The terms of rows without it: what photosites of one row share otherwise.
    pub fn off(&self, terms: LineTerms) -> LineTerms {
        let [of_frame, of_both, of_flat] = self.terms;
        let LineTerms { constant, linear, square } = terms;
        LineTerms { constant: constant - of_frame, linear: linear + of_both, square: square - of_flat }
    }

    /// The covariance of a pixel of a kind in a row of the frame, whose classes have so much of the numbers of a knot, and their levels.
    pub fn covariance(&self, kind: usize, row: usize, level: &DriftLoads, hues: Option<[f64; 3]>) -> Covariance {
        let RowWeights([fixed, of_hue]) = &self.weights[kind];
        let lowest = fixed.iter().chain(of_hue).flatten().map(|(distance, _)| *distance).min().unwrap_or_default();
        let knots = |distance: isize| row.checked_add_signed(distance).and_then(|row| self.knots.get(row));
        let first = knots(lowest).map_or(0, |(knot, _)| *knot);
        let taken_up: [TakenUp; 3] = std::array::from_fn(|plane| {
            let mut found = TakenUp::default();
            let mut add = |rows: &[(isize, [f64; 3])], factor: f64| {
                for (distance, weights) in rows {
                    let Some((knot, parts)) = knots(*distance) else { continue };
                    (0..3).for_each(|class| found.classes[class] += factor * weights[class]);
                    let of_number = |number: usize| -> f64 {
                        weights.iter().zip(level.of_rows).map(|(weight, load)| weight * load[number]).sum()
                    };
                    let weight: [f64; NUMBERS] = std::array::from_fn(of_number);
                    for (place, part) in (*knot - first..).zip(parts) {
                        let sums = usize::try_from(place).ok().and_then(|place| found.knots.get_mut(place));
                        let sums = sums.into_iter().flatten().zip(weight);
                        sums.for_each(|(sum, weight)| *sum += factor * weight * part);
                    }
                }
            };
            add(&fixed[plane], 1.0);
            if let Some(hues) = hues {
                add(&of_hue[plane], hues[plane]);
            }
            found
        });
        PAIRS.map(|[i, j]| {
            let [one, other] = [&taken_up[i], &taken_up[j]];
            let of_rows: f64 = one.knots.iter().flatten().zip(other.knots.iter().flatten()).map(|(a, b)| a * b).sum();
            let Some((means, between)) = &self.level else { return of_rows };
            let with = |one: &TakenUp, other: &TakenUp| one.with_level(first, other, means, &level.of_level);
            let of_levels = |[k, l]: [usize; 2]| -> f64 {
                let both: f64 = level.of_level[k].iter().zip(level.of_level[l]).map(|(a, b)| a * b).sum();
                one.classes[k] * other.classes[l] * both * between[k][l]
            };
            let of_levels: f64 = (0..9).map(|pair| of_levels([pair / 3, pair % 3])).sum();
            of_rows + with(one, other) + with(other, one) + of_levels
        })
    }
}

/// What the classes of photosites have of the numbers of a knot, by their rows and by their levels.
#[derive(Debug, Clone, Copy)]
pub(super) struct DriftLoads {
    pub of_rows: [[f64; NUMBERS]; 3],
    pub of_level: [[f64; NUMBERS]; 3],
}

impl DriftLoads {
    /// The variance of a photosite of a class.
    pub fn of_site(&self, class: usize) -> f64 {
        self.of_rows[class].iter().map(|load| load * load).sum()
    }
}

/// What a plane of a pixel takes up: of the numbers of knots by its rows, and of photosites of each class.
#[derive(Default)]
struct TakenUp {
    knots: [[f64; NUMBERS]; KNOTS],
    classes: [f64; 3],
}

impl TakenUp {
    /// What its rows share with the level of another, knots counted from the first.
    fn with_level(&self, first: i64, other: &Self, means: &[KnotMeans; 3], loads: &[[f64; NUMBERS]; 3]) -> f64 {
        let of_knot = |(knot, sums): (i64, &[f64; NUMBERS])| -> f64 {
            let of_class = |class: usize| {
                let both: f64 = sums.iter().zip(loads[class]).map(|(sum, load)| sum * load).sum();
                other.classes[class] * both * means[class].at(knot)
            };
            (0..3).map(of_class).sum()
        };
        (first..).zip(&self.knots).map(of_knot).sum()
    }
}
