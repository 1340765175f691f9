//! What a drift of the black level makes of the covariance of a demosaicked pixel.
//!
//! Row r of the sensor has d (b_j(r) z_j + b_j+1(r) z_j+1) ([`knots`]) in the charge of each photosite. With W_k(r, c) the weights
//! that plane k of a pixel gives the photosites of class c in row r, and K_c the slope of their samples to the charge, it has
//!
//! Σ_j (Σ_r Σ_c W_k(r, c) K_c b_j(r)) d z_j,
//!
//! so that cov(k, m) is d² times the sum over knots of the products of what is in brackets: exact, at whatever row of the frame.

use super::covariance::{Covariance, PAIRS};
use super::lines::LineTerms;
use super::photosite::Photosite;
use super::pixel_gains::phase_at;
use crate::frame::Geometry;
use crate::metadata::AverageRecord;
use crate::stages::demosaic::stencil::Stencil;
use crate::stages::demosaic::weights::WeightTable;
use crate::stages::noise::knots;

/// The drift of the rows of a frame, and how each kind of pixel takes it up.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PixelDrift {
    variance_e2: f64,
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
        table: &WeightTable,
        kinds: &[[usize; 2]],
        geometry: &Geometry,
        gain: impl Fn([isize; 2]) -> f64,
    ) -> Self {
        let first = i64::from(geometry.origin[1]);
        let rows_per_knot = photosite.drift_rows();
        Self {
            variance_e2: photosite.drift_e2(average),
            knots: (0..geometry.height).map(|row| knots(first + row as i64, rows_per_knot)).collect(),
            weights: kinds.iter().map(|&at| RowWeights::of(table, at, geometry, &gain)).collect(),
        }
    }

    /// The terms of rows without it: what photosites of one row share otherwise.
    pub fn off(&self, terms: LineTerms) -> LineTerms {
        terms.less(self.variance_e2)
    }

    /// Its variance in a photosite whose samples have such a slope to the charge.
    pub fn of_site(&self, slope: f64) -> f64 {
        slope * slope * self.variance_e2
    }

    /// The covariance of a pixel of a kind in a row of the frame, whose classes have such slopes.
    pub fn covariance(&self, kind: usize, row: usize, slopes: [f64; 3], hues: Option<[f64; 3]>) -> Covariance {
        let RowWeights([fixed, of_hue]) = &self.weights[kind];
        let lowest = fixed.iter().chain(of_hue).flatten().map(|(distance, _)| *distance).min().unwrap_or_default();
        let knots = |distance: isize| row.checked_add_signed(distance).and_then(|row| self.knots.get(row));
        let first = knots(lowest).map_or(0, |(knot, _)| *knot);
        let taken_up: [[f64; KNOTS]; 3] = std::array::from_fn(|plane| {
            let mut sums = [0.0; KNOTS];
            let mut add = |rows: &[(isize, [f64; 3])], factor: f64| {
                for (distance, weights) in rows {
                    let Some((knot, parts)) = knots(*distance) else { continue };
                    let weight: f64 = weights.iter().zip(slopes).map(|(weight, slope)| weight * slope).sum();
                    for (place, part) in (*knot - first..).zip(parts) {
                        let sum = usize::try_from(place).ok().and_then(|place| sums.get_mut(place));
                        if let Some(sum) = sum {
                            *sum += factor * weight * part;
                        }
                    }
                }
            };
            add(&fixed[plane], 1.0);
            if let Some(hues) = hues {
                add(&of_hue[plane], hues[plane]);
            }
            sums
        });
        let of_pair = |[k, m]: [usize; 2]| -> f64 { taken_up[k].iter().zip(&taken_up[m]).map(|(a, b)| a * b).sum() };
        PAIRS.map(|pair| self.variance_e2 * of_pair(pair))
    }
}
