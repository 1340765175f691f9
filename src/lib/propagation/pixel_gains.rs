//! How the covariance of a demosaicked pixel follows from variances of its photosites: by its place and its hues.

use super::covariance::{Covariance, PAIRS};
use crate::frame::Geometry;
use crate::stages::demosaic::stencil::{Stencil, phase};
use crate::stages::demosaic::weights::WeightTable;

/// Gains of three variances, those of the classes or of the black level, for the six covariances, as polynomials in the pixel's
/// hues: with weights f + ρ h, cov(k, m) = Σ \[f f + ρ_k h f + ρ_m f h + ρ_k ρ_m h h] σ².
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PixelGains<const N: usize = 3>([[[f64; N]; 4]; 6]);

impl PixelGains {
    /// Those of the classes.
    pub fn new(table: &WeightTable, at: [usize; 2], geometry: &Geometry) -> Self {
        let phase = phase_at(at, geometry);
        let class = |offset| table.class(phase, offset) as usize;
        Self::by(table, at, geometry, |a, b| {
            let mut sums = [0.0; 3];
            for (offset, weight) in a.sites() {
                sums[class(offset)] += weight * b.at(offset);
            }
            sums
        })
    }

    /// Those of what the photosites of a row, of a column and of a site of 2×2 have in common.
    pub fn of_black(table: &WeightTable, at: [usize; 2], geometry: &Geometry) -> Self {
        let is_even = |distance: isize| distance & 1 == 0;
        Self::by(table, at, geometry, |a, b| {
            let mut sums = [0.0; 3];
            for ([x, y], weight) in a.sites() {
                for ([other_x, other_y], other) in b.sites() {
                    let both = weight * other;
                    sums[0] += if y == other_y { both } else { 0.0 };
                    sums[1] += if x == other_x { both } else { 0.0 };
                    sums[2] += if is_even(x - other_x) && is_even(y - other_y) { both } else { 0.0 };
                }
            }
            sums
        })
    }
}

impl<const N: usize> PixelGains<N> {
    pub fn by(
        table: &WeightTable,
        at: [usize; 2],
        geometry: &Geometry,
        dot: impl Fn(&Stencil, &Stencil) -> [f64; N],
    ) -> Self {
        let phase = phase_at(at, geometry);
        let folded = |stencil: &Stencil| stencil.folded(at, [geometry.width, geometry.height]);
        let [fixed, of_hue] = [table.fixed(phase), table.of_hue(phase)].map(|stencils| stencils.each_ref().map(folded));
        Self(PAIRS.map(|[k, m]| {
            [
                dot(&fixed[k], &fixed[m]),
                dot(&of_hue[k], &fixed[m]),
                dot(&fixed[k], &of_hue[m]),
                dot(&of_hue[k], &of_hue[m]),
            ]
        }))
    }

    pub fn covariance(&self, variances: [f64; N], hues: Option<[f64; 3]>) -> Covariance {
        let sum = |gains: &[f64; N]| {
            let (first, rest) = (gains[0] * variances[0], gains.iter().zip(variances).skip(1));
            rest.fold(first, |sum, (gain, variance)| sum + gain * variance)
        };
        let mut covariance = [0.0; 6];
        for ((value, [k, m]), gains) in covariance.iter_mut().zip(PAIRS).zip(&self.0) {
            *value = sum(&gains[0]);
            if let Some(hue) = hues {
                *value += hue[k] * sum(&gains[1]) + hue[m] * sum(&gains[2]) + hue[k] * hue[m] * sum(&gains[3]);
            }
        }
        covariance
    }
}

/// The phase of the filter array at a pixel of a frame.
pub(super) fn phase_at(at: [usize; 2], geometry: &Geometry) -> usize {
    let origin = geometry.origin.map(i64::from);
    phase(origin[0] + at[0] as i64, origin[1] + at[1] as i64)
}
