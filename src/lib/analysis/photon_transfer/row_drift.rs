//! Noise of rows apart from a black level that drifts along them.
//!
//! Means d_r of rows that are drawn one by one have second differences of the variance 6 σ²; what changes smoothly from row to row adds next
//! to nothing to these, and all of itself to the scatter of the means. First differences tell whether it is there: of R independent means
//! Σ (d_r − d_r−1)²/(2 Σ d²) is 1 to within √((R − 2)/(R² − 1)) \[vonNeumann1941]. Second differences of R − 2 rows are worth (R − 2) 18/35
//! degrees of freedom, as neighbors of them are correlated by −2/3 and 1/6 \[HKT1990].
//!
//! Half the mean square of d_r+k − d_r, the variogram, is σ² + b (1 − c(k/L)) of a drift of the variance b whose knots are L rows apart
//! ([`covariance`]), whatever frames are off by as a whole.

use crate::numerics::variance_components::MeanSquare;
use crate::propagation::drift::covariance;

/// Distances, in rows, at which the variogram is told.
const LAGS: usize = 12;
/// Standard deviations by which differences must be too small for chance.
const BEYOND: f64 = 5.0;
/// Fewer rows tell nothing.
const LEAST_ROWS: usize = 16;

/// Sums over means of rows, of a grid in all frames of a condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowScatter {
    rows: usize,
    columns: usize,
    /// Frames that are independent of each other.
    tables: f64,
    /// Σ d².
    all: f64,
    /// Σ of squared first, and second, differences.
    first: f64,
    second: f64,
    /// The variogram at [`lags`].
    variogram: [f64; LAGS],
}

impl RowScatter {
    /// Of deviations of means of rows from that of the frame, `[frame][row]`, in a grid of so many columns.
    pub fn of(deviations: &[Vec<f64>], tables: f64, columns: usize) -> Self {
        let rows = deviations.first().map_or(0, Vec::len);
        let sum = |of: &dyn Fn(&[f64]) -> f64| deviations.iter().map(|of_frame| of(of_frame)).sum::<f64>();
        let apart = |lag: usize| sum(&|d| d.iter().zip(d.iter().skip(lag)).map(|(a, b)| (b - a).powi(2)).sum());
        let half_mean = |lag: usize| apart(lag) / (2.0 * tables * (rows.saturating_sub(lag)) as f64);
        Self {
            rows,
            columns,
            tables,
            all: sum(&|d| d.iter().map(|d| d * d).sum()),
            first: apart(1),
            second: sum(&|d| d.windows(3).map(|d| (d[2] - 2.0 * d[1] + d[0]).powi(2)).sum()),
            variogram: if rows < LEAST_ROWS { [0.0; LAGS] } else { lags(rows).map(half_mean) },
        }
    }

    /// The mean square of rows without what drifts.
    pub fn mean_square_apart(&self) -> MeanSquare {
        let differences = self.rows as f64 - 2.0;
        let value = self.columns as f64 * self.second / (6.0 * self.tables * differences);
        MeanSquare { value, freedom: self.tables * differences * 18.0 / 35.0 }
    }

    /// Σ d² less what it would be by first differences of independent rows, and the variance of that.
    fn smooth(&self) -> [f64; 2] {
        let n = self.rows as f64;
        let independent = self.first / 2.0 * n / (n - 1.0);
        [self.all - independent, self.all * self.all * (n - 2.0) / (n * n - 1.0) / self.tables]
    }
}

/// Rows from one to the other at which the variogram of so many is told: from 1 to half of them.
fn lags(rows: usize) -> [usize; LAGS] {
    let ratio = (rows as f64 / 2.0).powf(1.0 / (LAGS - 1) as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "half of the rows at most")]
    std::array::from_fn(|index| (ratio.powi(i32::try_from(index).unwrap_or_default()).round() as usize).max(1))
}

/// A black level that drifts along the rows of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowDrift {
    /// Its variance.
    pub variance: f64,
    /// Rows of the grid from one knot to the next.
    pub rows_per_knot: f64,
}

impl RowDrift {
    /// Whether knots are so near to each other that second differences of rows have much of it.
    pub fn hides_rows(&self) -> bool {
        const NEAR: f64 = 5.0;
        self.rows_per_knot < NEAR
    }

    /// The share that is left of the degrees of freedom of rows of such a variance, `left` of the drift's in it: 1/(1 + 2 Σ ρ²).
    pub fn kept_freedom(&self, variance: f64, left: f64) -> f64 {
        let share = (left * self.variance / variance).min(1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some rows")]
        let farthest = (2.0 * self.rows_per_knot).ceil() as usize;
        let sum: f64 = (1..farthest).map(|rows| covariance(rows as f64 / self.rows_per_knot).powi(2)).sum();
        1.0 / (1.0 + 2.0 * share * share * sum)
    }

    /// The same in e-², of such a gain.
    #[must_use]
    pub fn in_electrons(self, adu_per_e: f64) -> Self {
        Self { variance: self.variance / (adu_per_e * adu_per_e), ..self }
    }
}

/// Whether rows drift beyond chance, of grids that have it alike.
pub fn are_smooth(scatters: &[RowScatter]) -> bool {
    let sums = scatters.iter().filter(|of| of.rows >= LEAST_ROWS && of.tables > 0.0).map(RowScatter::smooth);
    let [smooth, variance] = sums.fold([0.0; 2], |[a, b], [smooth, variance]| [a + smooth, b + variance]);
    smooth > BEYOND * variance.sqrt()
}

/// The drift of rows of grids that have it alike, in samples²; none where none is told.
pub fn drift_among(scatters: &[RowScatter]) -> Option<RowDrift> {
    if !are_smooth(scatters) {
        return None;
    }
    let rows = scatters.iter().map(|of| of.rows).max()?;
    let own = || scatters.iter().filter(|of| of.rows == rows);
    let weight: f64 = own().map(|of| of.tables).sum();
    let mean = |index: usize| own().map(|of| of.tables * of.variogram[index]).sum::<f64>() / weight;
    let points: Vec<(f64, f64)> =
        lags(rows).into_iter().enumerate().map(|(index, lag)| (lag as f64, mean(index))).collect();
    // Knots from two rows apart to twice the frame, each a twentieth farther.
    let (most, ratio) = (2.0 * rows as f64, 1.05_f64);
    let tried = std::iter::successors(Some(2.0), |rows| Some(rows * ratio)).take_while(|rows| *rows <= most);
    let fits = tried.map(|rows_per_knot| {
        let (variance, misfit) = fit(&points, rows as f64, rows_per_knot);
        (RowDrift { variance, rows_per_knot }, misfit)
    });
    let best = fits.filter(|(drift, _)| drift.variance > 0.0).min_by(|(_, a), (_, b)| a.total_cmp(b));
    best.map(|(drift, _)| drift)
}

/// The variance of a drift of such knots that fits a variogram best, beside one of rows by themselves, and by how much it misses: points
/// count by the pairs of rows that they are of.
fn fit(points: &[(f64, f64)], rows: f64, rows_per_knot: f64) -> (f64, f64) {
    let of = |(lag, value): &(f64, f64)| (rows - lag, 1.0 - covariance(lag / rows_per_knot), *value);
    let [mut all, mut x_sum, mut y_sum] = [0.0; 3];
    for (weight, x, y) in points.iter().map(of) {
        (all, x_sum, y_sum) = (all + weight, x_sum + weight * x, y_sum + weight * y);
    }
    let (x_mean, y_mean) = (x_sum / all, y_sum / all);
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for (weight, x, y) in points.iter().map(of) {
        let [x, y] = [x - x_mean, y - y_mean];
        (xx, xy, yy) = (xx + weight * x * x, xy + weight * x * y, yy + weight * y * y);
    }
    if xx > 0.0 { (xy / xx, yy - xy * xy / xx) } else { (0.0, yy) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::quantiles::of_normal;
    use crate::random::philox::philox4x32_10;
    use crate::stages::noise::knots;

    /// Normal numbers.
    fn drawn(count: u32, seed: u32) -> Vec<f64> {
        let of = |index: u32| {
            let [word, ..] = philox4x32_10([index, seed, 0, 0], [3, 5]);
            of_normal((f64::from(word) + 0.5) / 4_294_967_296.0)
        };
        (0..count).map(of).collect()
    }

    /// 40 frames of 240 rows of such a noise, and of a drift of such knots.
    fn taken(own: f64, drift: f64, rows_per_knot: f64) -> RowScatter {
        let of_frame = |frame: u32| -> Vec<f64> {
            let of_knots = drawn(400, 1000 + frame);
            let place = |row: i64| {
                let (knot, [a, b]) = knots(row, rows_per_knot);
                let knot = usize::try_from(knot).unwrap_or_default();
                a * of_knots[knot] + b * of_knots[knot + 1]
            };
            let rows: Vec<f64> = (0..240).zip(drawn(240, frame)).map(|(row, z)| own * z + drift * place(row)).collect();
            let mean = rows.iter().sum::<f64>() / 240.0;
            rows.iter().map(|row| row - mean).collect()
        };
        let frames: Vec<Vec<f64>> = (0..40).map(of_frame).collect();
        RowScatter::of(&frames, 40.0, 100)
    }

    /// Rows of 0.5 beside a drift of 1.5 whose knots are 30 or 8 rows apart: both are found, 1.5 to the chance of so many knots.
    #[test]
    fn drifts_come_off_rows() {
        for rows_per_knot in [30.0, 8.0] {
            let taken = taken(0.5, 1.5, rows_per_knot);
            let apart = taken.mean_square_apart();
            let own = apart.value / 100.0;
            // What is left of the drift in second differences: 8 b δ³ and less, of δ knots.
            assert!((own / 0.25 - 1.0).abs() < 5.0 * (2.0 / apart.freedom).sqrt() + 0.03, "{own}");
            let found = drift_among(&[taken]).unwrap();
            let knots = 40.0 * 240.0 / rows_per_knot;
            assert!((found.variance / 2.25 - 1.0).abs() < 5.0 * (2.0 / knots).sqrt(), "{found:?}");
            assert!((found.rows_per_knot / rows_per_knot - 1.0).abs() < 0.25, "{found:?}");
        }
    }

    #[test]
    fn independent_rows_drift_nowhere() {
        assert_eq!(drift_among(&[taken(0.5, 0.0, 30.0)]), None);
    }
}
