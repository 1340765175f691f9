//! What the photosites of a row, or of a column, share, in the covariance of a demosaicked pixel where several amplifiers read them and the
//! converter is curved.
//!
//! A photosite of class k behind amplifier t, which reads the level of all, has the slope s_tk of its code to the charge there, and the
//! signal x_tk. What two share is s s' (a + b (x + x') + c x x') e² ([`LineTerms`]), so that with W_p(r; t, k) the weights of plane p in
//! row r
//!
//! cov(p, q) = Σ_r a A_p A_q + b (A_p B_q + B_p A_q) + c B_p B_q,  A = Σ_tk W s,  B = Σ_tk W s x
//!
//! and of a drift the sum over knots of what the rows give to each, in place of that over rows.

use super::covariance::{Covariance, PAIRS};
use super::lines::LineTerms;
use super::photosite::Photosite;
use super::pixel_gains::phase_at;
use crate::frame::Geometry;
use crate::metadata::AverageRecord;
use crate::stages::demosaic::stencil::{REACH, Stencil};
use crate::stages::demosaic::weights::WeightTable;
use crate::stages::noise::knots;

/// Most amplifiers of a sensor.
pub(super) const TAPS: usize = 4;

/// Numbers of the classes behind each amplifier.
pub(super) type OfTaps = [f64; 3 * TAPS];

/// Weights on the photosites of lines: their distance, and sums by amplifier and class.
type OfLines = Vec<(isize, OfTaps)>;

/// Weights of a pixel, of its three planes and those of its hue, by lines.
type LineWeights = [[OfLines; 3]; 2];

/// Lines that a pixel reaches.
const LINES: usize = 2 * REACH.unsigned_abs() + 1;

/// The last knot up to a row, and the weights of it and the next.
type Knots = (i64, [f64; 2]);

/// What planes have of each line, A and B.
type Loads = [[[f64; 2]; LINES]; 3];

/// What photosites share by rows and by columns, at any pixel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PixelTapLines {
    /// Those of each amplifier, and what no light reads behind it, less what it does without them.
    taps: Vec<(Photosite, f64)>,
    terms: [LineTerms; 2],
    /// The variance of the drift, and the knots of the rows of the frame; none where there is none.
    drift: Option<(f64, Vec<Knots>)>,
    /// By kinds of pixels, by rows and by columns.
    weights: Vec<[LineWeights; 2]>,
}

/// Slopes and signals of photosites at some level.
#[derive(Debug, Clone, Copy)]
pub(super) struct TapLevels {
    slopes: OfTaps,
    signals: OfTaps,
}

impl PixelTapLines {
    /// Of the photosites behind each amplifier of a frame, an average or not, of which such places are the kinds of pixels.
    pub fn of(
        taps: Vec<(Photosite, f64)>,
        average: Option<&AverageRecord>,
        table: &WeightTable,
        kinds: &[[usize; 2]],
        geometry: &Geometry,
        tap: impl Fn([isize; 2]) -> usize,
    ) -> Option<Self> {
        let (photosite, _) = taps.first()?;
        let [rows, columns] = photosite.line_terms(average);
        let variance_e2 = photosite.drift_e2(average);
        let knots = |row: usize| knots(i64::from(geometry.origin[1]) + row as i64, photosite.drift_rows());
        let drift = photosite.drifts().then(|| (variance_e2, (0..geometry.height).map(knots).collect()));
        let terms = [if drift.is_some() { rows.less(variance_e2) } else { rows }, columns];
        let weights =
            kinds.iter().map(|at| [0, 1].map(|axis| line_weights(table, *at, geometry, axis, &tap))).collect();
        Some(Self { taps, terms, drift, weights })
    }

    /// Slopes and signals where all photosites read such levels above black.
    pub fn at(&self, level: [f64; 3]) -> TapLevels {
        let mut found = TapLevels { slopes: [0.0; 3 * TAPS], signals: [0.0; 3 * TAPS] };
        for (tap, (photosite, shift)) in self.taps.iter().enumerate().take(TAPS) {
            let model = &photosite.model;
            for (class, level) in level.into_iter().enumerate() {
                // `max` drops what is no number.
                let light_e = photosite.expected_at((level - shift).max(0.0)).max(0.0).min(model.full_well_e);
                found.signals[3 * tap + class] = light_e;
                found.slopes[3 * tap + class] =
                    photosite.adc.map_or(1.0, |adc| adc.sample_per_e(light_e + model.dark_e));
            }
        }
        found
    }

    /// What is the own of photosites that have such variances.
    pub fn own(&self, whole: OfTaps, level: &TapLevels) -> OfTaps {
        let drift = self.drift.as_ref().map_or(0.0, |(variance, _)| *variance);
        std::array::from_fn(|index| {
            let (slope, x) = (level.slopes[index], level.signals[index]);
            let shared: f64 = self.terms.iter().map(|terms| terms.at(x, x)).sum();
            (whole[index] - slope * slope * (shared + drift)).max(0.0)
        })
    }

    /// What of the covariance of a pixel of a kind, in a row of the frame, photosites of such levels make by what they share.
    pub fn covariance(&self, kind: usize, row: usize, level: &TapLevels, hues: Option<[f64; 3]>) -> Covariance {
        let loads = self.weights[kind].each_ref().map(|weights| loads(weights, level, hues));
        let of_axis = |axis: usize, [p, q]: [usize; 2]| -> f64 {
            loads[axis][p].iter().zip(&loads[axis][q]).map(|(a, b)| self.terms[axis].of_sums(*a, *b)).sum()
        };
        let of_drift = self.drift.as_ref().map(|(variance, knots)| (*variance, taken_up(knots, row, &loads[0])));
        PAIRS.map(|pair| {
            let drift = of_drift.as_ref().map_or(0.0, |(variance, sums)| {
                variance * sums[pair[0]].iter().zip(&sums[pair[1]]).map(|(a, b)| a * b).sum::<f64>()
            });
            of_axis(0, pair) + of_axis(1, pair) + drift
        })
    }
}

/// What planes have of each line.
fn loads(weights: &LineWeights, level: &TapLevels, hues: Option<[f64; 3]>) -> Loads {
    let mut found = [[[0.0; 2]; LINES]; 3];
    let [fixed, of_hue] = weights;
    for plane in 0..3 {
        let parts = std::iter::once((&fixed[plane], 1.0)).chain(hues.map(|hues| (&of_hue[plane], hues[plane])));
        for (lines, factor) in parts {
            for (distance, weights) in lines {
                let sums = &mut found[plane][(distance + REACH).cast_unsigned()];
                for (index, weight) in weights.iter().enumerate() {
                    let load = factor * weight * level.slopes[index];
                    sums[0] += load;
                    sums[1] += load * level.signals[index];
                }
            }
        }
    }
    found
}

/// What planes of a pixel in a row have of each knot from the first on that its rows meet.
fn taken_up(knots: &[Knots], row: usize, loads: &Loads) -> [[f64; LINES + 1]; 3] {
    let reach = REACH.unsigned_abs();
    let first = knots.get(row.saturating_sub(reach)).map_or(0, |(knot, _)| *knot);
    loads.each_ref().map(|lines| {
        let mut sums = [0.0; LINES + 1];
        for (line, [load, _]) in lines.iter().enumerate().filter(|(_, load)| **load != [0.0; 2]) {
            let Some((knot, parts)) = (row + line).checked_sub(reach).and_then(|row| knots.get(row)) else { continue };
            for (place, part) in (*knot - first..).zip(parts) {
                if let Some(sum) = usize::try_from(place).ok().and_then(|place| sums.get_mut(place)) {
                    *sum += load * part;
                }
            }
        }
        sums
    })
}

fn line_weights(
    table: &WeightTable,
    at: [usize; 2],
    geometry: &Geometry,
    axis: usize,
    tap: impl Fn([isize; 2]) -> usize,
) -> LineWeights {
    let phase = phase_at(at, geometry);
    let by_lines = |stencil: &Stencil| {
        let mut lines = OfLines::new();
        for (offset, weight) in stencil.folded(at, [geometry.width, geometry.height]).sites() {
            let distance = offset[1 - axis];
            let place = lines.iter().position(|(line, _)| *line == distance).unwrap_or_else(|| {
                lines.push((distance, [0.0; 3 * TAPS]));
                lines.len() - 1
            });
            let to = [0, 1].map(|axis| at[axis].cast_signed() + offset[axis]);
            if let Some(sum) = lines[place].1.get_mut(3 * tap(to) + table.class(phase, offset) as usize) {
                *sum += weight;
            }
        }
        lines
    };
    [table.fixed(phase), table.of_hue(phase)].map(|stencils| stencils.each_ref().map(by_lines))
}
