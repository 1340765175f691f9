//! Rectangles of a frame, and how sums over their pixels grow.

use super::covariance::PAIRS;
use crate::stages::demosaic::stencil::REACH;
use nalgebra::Matrix3;

/// A rectangle of a frame: where it lies in the frame, and the frame on the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Columns and rows of the frame.
    pub frame: [usize; 2],
    /// Sensor column and row of the frame's first pixel.
    pub origin: [i32; 2],
    /// Column and row of the rectangle's first pixel in the frame.
    pub corner: [usize; 2],
    /// Columns and rows of the rectangle.
    pub size: [usize; 2],
}

impl Place {
    /// The same rectangle in a larger frame: its first column and row on the sensor, its columns and rows; none where the frame does not lie
    /// within it.
    #[must_use]
    pub fn within(self, [x, y, width, height]: [i64; 4]) -> Option<Self> {
        let axis = |axis: usize, first: i64, length: i64| {
            let before = usize::try_from(i64::from(self.origin[axis]) - first).ok()?;
            let length = usize::try_from(length).ok()?;
            let is_within = before.checked_add(self.frame[axis])? <= length;
            is_within.then_some((i32::try_from(first).ok()?, before + self.corner[axis], length))
        };
        let [columns, rows] = [axis(0, x, width)?, axis(1, y, height)?];
        Some(Self {
            frame: [columns.2, rows.2],
            origin: [columns.0, rows.0],
            corner: [columns.1, rows.1],
            size: self.size,
        })
    }

    /// A place of the same law near the corner of a small frame: only phases, size and edges within reach matter; and rows on the sensor, where
    /// these drift.
    #[must_use]
    pub fn canonical(self, do_rows_drift: bool) -> Self {
        let mut place = self;
        for axis in 0..if do_rows_drift { 1 } else { 2 } {
            let before = place.corner[axis];
            let after = place.frame[axis] - place.size[axis] - before;
            // Far edges come as near as they can without being felt, on the same phase.
            let near = |distance: usize| if distance > FAR { FAR - (FAR + distance) % 2 } else { distance };
            place.corner[axis] = near(before);
            place.frame[axis] = near(before) + place.size[axis] + near(after);
            place.origin[axis] &= 1;
        }
        place
    }
}

/// From so many pixels on an edge is out of reach, whatever the phase.
pub(super) const FAR: usize = REACH.unsigned_abs() + 1;

/// The extents whose sums, in these shares, make up that of `extent`: itself, or two small ones of its parity, from which
/// on sums grow in proportion. Two row sums of covariances reach four times as far apart as weights do.
pub(super) fn steps(extent: usize, reach: isize) -> Vec<(usize, f64)> {
    let small = 4 * reach.unsigned_abs() + 4;
    let small = small + (extent + small) % 2;
    if extent <= small + 2 {
        return vec![(extent, 1.0)];
    }
    let further = (extent - small) as f64 / 2.0;
    vec![(small, 1.0 - further), (small + 2, further)]
}

/// Adds `share` times C_ik C_jl + C_il C_jk for all pairs ij (rows) and kl (columns).
pub(super) fn add_products(table: &mut [[f64; 6]; 6], c: &Matrix3<f64>, share: f64) {
    for (row, [i, j]) in table.iter_mut().zip(PAIRS) {
        for (entry, [k, l]) in row.iter_mut().zip(PAIRS) {
            *entry += share * (c[(i, k)] * c[(j, l)] + c[(i, l)] * c[(j, k)]);
        }
    }
}
