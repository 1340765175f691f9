//! Where the patches of a chart lie in a frame, by the centers of its four corner patches.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Patches in a row of a ColorChecker, and rows.
pub const COLUMNS: usize = 6;
/// Rows of patches.
pub const ROWS: usize = 4;

/// Half the side of the part of a patch that is read, as a share of the distance of patches: the middle half of a patch, whose
/// side is 0.8 to 0.9 of that distance.
const HALF_SIDE: f64 = 0.21;

/// The patches of a chart in a frame, seen in perspective.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Columns and rows of patches, homogeneous, from columns and rows of the frame.
    chart_from_frame: Matrix3<f64>,
    corners: [[f64; 2]; 4],
}

impl Grid {
    /// The grid whose corner patches have these centers, column and row of the frame from its first sample on: the first of the
    /// first row, the last of it, the last and the first of the last row. Of a ColorChecker these are dark skin, bluish
    /// green, black and white.
    ///
    /// # Errors
    ///
    /// In words, for corners that no chart in perspective has, or that run the other way round.
    pub fn new(corners: [[f64; 2]; 4]) -> Result<Self, String> {
        let turn = |k: usize| {
            let [a, b, c] = [corners[k], corners[(k + 1) % 4], corners[(k + 2) % 4]];
            (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        };
        let turns = [0, 1, 2, 3].map(turn);
        if turns.iter().all(|turn| *turn < 0.0) {
            return Err(
                "the corners run against the clock; the chart is mirrored, or they are in another order than dark \
                        skin, bluish green, black, white"
                    .into(),
            );
        }
        if !turns.iter().all(|turn| *turn > 0.0 && turn.is_finite()) {
            return Err(
                "the corners make no quadrangle; give the centers of dark skin, bluish green, black, white".into()
            );
        }
        let (right, bottom) = ((COLUMNS - 1) as f64, (ROWS - 1) as f64);
        let chart = [[0.0, 0.0], [right, 0.0], [right, bottom], [0.0, bottom]];
        let chart_from_frame =
            homography(corners, chart).ok_or("the corners are too near to a line to tell the perspective")?;
        Ok(Self { chart_from_frame, corners })
    }

    /// The patch, row by row, whose middle holds a place of the frame.
    pub fn patch(&self, x: f64, y: f64) -> Option<usize> {
        let seen = self.chart_from_frame * Vector3::new(x, y, 1.0);
        // Behind the horizon there is no chart.
        if seen.z.is_nan() || seen.z <= 0.0 {
            return None;
        }
        let inside = |place: f64, count: usize| -> Option<usize> {
            let nearest = place.round();
            let is_inside = (place - nearest).abs() <= HALF_SIDE && (0.0..count as f64).contains(&nearest);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be a small count")]
            is_inside.then_some(nearest as usize)
        };
        let (column, row) = (inside(seen.x / seen.z, COLUMNS)?, inside(seen.y / seen.z, ROWS)?);
        Some(row * COLUMNS + column)
    }

    /// The centers of the corner patches.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        self.corners
    }
}

/// The projective map of four points to four others, positive in front: h (x, y, 1) ∝ (u, v, 1), with eight unknowns.
fn homography(from: [[f64; 2]; 4], to: [[f64; 2]; 4]) -> Option<Matrix3<f64>> {
    let mut equations = SMatrix::<f64, 8, 8>::zeros();
    let mut right = SVector::<f64, 8>::zeros();
    // Coordinates of the size of 1 keep the equations well conditioned.
    let scale = from.as_flattened().iter().fold(1.0, |largest: f64, value| largest.max(value.abs()));
    for (k, ([x, y], [u, v])) in from.map(|point| point.map(|value| value / scale)).into_iter().zip(to).enumerate() {
        let rows = [[x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y], [0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y]];
        for (i, row) in rows.into_iter().enumerate() {
            equations.set_row(2 * k + i, &SVector::from(row).transpose());
        }
        right[2 * k] = u;
        right[2 * k + 1] = v;
    }
    let found = equations.lu().solve(&right)?;
    let scaled = Matrix3::new(found[0], found[1], found[2], found[3], found[4], found[5], found[6], found[7], 1.0);
    let matrix = scaled * Matrix3::from_diagonal(&Vector3::new(1.0 / scale, 1.0 / scale, 1.0));
    // The sign is that which has the chart in front.
    let middle = from.iter().fold(Vector3::zeros(), |sum, [x, y]| sum + Vector3::new(*x, *y, 1.0));
    let matrix = if (matrix * middle).z < 0.0 { -matrix } else { matrix };
    matrix.iter().all(|element| element.is_finite()).then_some(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tilted chart: places through a known perspective are found in their patches, and no others.
    #[test]
    fn patches_lie_where_the_perspective_has_them() {
        let frame_from_chart = Matrix3::new(90.0, 8.0, 200.0, -5.0, 95.0, 150.0, 0.02, 0.01, 1.0);
        let at = |u: f64, v: f64| {
            let seen = frame_from_chart * Vector3::new(u, v, 1.0);
            [seen.x / seen.z, seen.y / seen.z]
        };
        let grid = Grid::new([at(0.0, 0.0), at(5.0, 0.0), at(5.0, 3.0), at(0.0, 3.0)]).unwrap();
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let (u, v) = (column as f64, row as f64);
                for [du, dv] in [[0.0, 0.0], [0.2, -0.2], [-0.2, 0.2]] {
                    let [x, y] = at(u + du, v + dv);
                    assert_eq!(grid.patch(x, y), Some(row * COLUMNS + column));
                }
                for [du, dv] in [[0.22, 0.0], [0.0, -0.22], [0.5, 0.5]] {
                    let [x, y] = at(u + du, v + dv);
                    assert_eq!(grid.patch(x, y), None);
                }
            }
        }
        let [x, y] = at(6.0, 0.0);
        assert_eq!(grid.patch(x, y), None);
    }

    #[test]
    fn corners_that_are_none_are_told() {
        let said = |corners: [[f64; 2]; 4]| Grid::new(corners).unwrap_err();
        assert!(said([[0.0, 0.0], [0.0, 3.0], [5.0, 3.0], [5.0, 0.0]]).contains("against the clock"));
        assert!(said([[0.0, 0.0], [5.0, 0.0], [0.0, 3.0], [5.0, 3.0]]).contains("no quadrangle"));
        assert!(said([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]).contains("no quadrangle"));
        assert!(said([[f64::NAN; 2]; 4]).contains("no quadrangle"));
    }
}
