//! Moments of what is a curved function of noisy channels: L\*a\*b\* and xyY of XYZ.

use nalgebra::{Matrix3, Vector3};

/// Third joint cumulants of three channels.
pub(super) type Third = [[[f64; 3]; 3]; 3];

/// Share of a channel that its noise may be where curved functions of it are predicted.
///
/// What is left out goes with the fourth power of the share, times about 10: 10⁻³ of a variance at a tenth.
pub(super) const LARGEST_SHARE: f64 = 0.1;

/// Skewness along a principal axis beyond which the series is no density.
const MOST_SKEWED: f64 = 1.0;

/// Why nothing is said where noise is larger.
pub(super) const VOID: &str =
    "the noise of X, Y or Z is more than a tenth of it, too much to be propagated to a color that is curved in it";

/// Gauss and Hermite's nodes and weights for a standard normal variable: exact for polynomials of degree 13.
pub(super) const NODES: [(f64, f64); 7] = [
    (0.0, 16.0 / 35.0),
    (1.154_405_394_739_968_2, 0.240_123_178_605_012_6),
    (-1.154_405_394_739_968_2, 0.240_123_178_605_012_6),
    (2.366_759_410_734_541_5, 0.030_757_123_967_586_498),
    (-2.366_759_410_734_541_5, 0.030_757_123_967_586_498),
    (3.750_439_717_725_742, 5.482_688_559_722_185e-4),
    (-3.750_439_717_725_742, 5.482_688_559_722_185e-4),
];

/// Mean and covariance of `value` over pixels of several laws alike, all of one mean, by their covariances and third
/// cumulants.
///
/// Along the principal axes of the covariance, channels = mean + A z, the density of z is φ(z) \[1 + Σ κ_ijk He_ijk(z)/6], and
/// expectations are sums over 7³ nodes.
pub(super) fn moments(
    mean: [f64; 3],
    laws: &[(Matrix3<f64>, Third)],
    value: impl Fn([f64; 3]) -> [f64; 3],
) -> ([f64; 3], Matrix3<f64>) {
    let reference = Vector3::from(value(mean));
    let (mut first, mut second) = (Vector3::zeros(), Matrix3::zeros());
    for (covariance, third) in laws {
        let axes = covariance.symmetric_eigen();
        let largest = axes.eigenvalues.max().max(0.0);
        let lengths = axes.eigenvalues.map(|value| if value > 1e-14 * largest { value.sqrt() } else { 0.0 });
        let along = axes.eigenvectors * Matrix3::from_diagonal(&lengths);
        let inverse = lengths.map(|length| if length > 0.0 { 1.0 / length } else { 0.0 });
        let skewness = rotated(third, &(Matrix3::from_diagonal(&inverse) * axes.eigenvectors.transpose()));
        let most = skewness.iter().flatten().flatten().fold(0.0, |most: f64, cumulant| most.max(cumulant.abs()));
        // A density that is skewed by more is none: what hardly ever leaves its value is as good as straight.
        let skewness = if most <= MOST_SKEWED { skewness } else { Third::default() };
        for (x, of_x) in NODES {
            for (y, of_y) in NODES {
                for (z, of_z) in NODES {
                    let weight = of_x * of_y * of_z * (1.0 + skew([x, y, z], &skewness));
                    let channels = Vector3::from(mean) + along * Vector3::new(x, y, z);
                    let offset = Vector3::from(value(channels.into())) - reference;
                    first += weight * offset;
                    second += weight * offset * offset.transpose();
                }
            }
        }
    }
    let count = laws.len() as f64;
    (first, second) = (first / count, second / count);
    ((reference + first).into(), second - first * first.transpose())
}

/// Σ κ_ijk He_ijk(z)/6.
fn skew(z: [f64; 3], third: &Third) -> f64 {
    let mut sum = 0.0;
    for (i, plane) in third.iter().enumerate() {
        for (j, row) in plane.iter().enumerate() {
            for (k, cumulant) in row.iter().enumerate() {
                let pairs = [(i == j, z[k]), (i == k, z[j]), (j == k, z[i])];
                let traces: f64 = pairs.into_iter().filter(|(is_pair, _)| *is_pair).map(|(_, z)| z).sum();
                sum += cumulant * (z[i] * z[j] * z[k] - traces);
            }
        }
    }
    sum / 6.0
}

fn rotated(third: &Third, by: &Matrix3<f64>) -> Third {
    let entry = |i: usize, j: usize, k: usize| -> f64 {
        let of_plane = |a: usize, b: usize| (0..3).map(|c| by[(k, c)] * third[a][b][c]).sum::<f64>();
        (0..3).map(|a| by[(i, a)] * (0..3).map(|b| by[(j, b)] * of_plane(a, b)).sum::<f64>()).sum()
    };
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| [0, 1, 2].map(|k| entry(i, j, k))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What hardly ever leaves its value has a skewness in the tens; its variance is that of the straight function.
    #[test]
    fn no_variance_is_negative() {
        let mut third = [[[0.0; 3]; 3]; 3];
        third[1][1][1] = 30.0 * 1e-3_f64.powi(3);
        let covariance = Matrix3::from_diagonal(&[1e-6; 3].into());
        let (_, found) = moments([1.0, 2.0, 3.0], &[(covariance, third)], |[x, y, z]| [y * y, x, z]);
        assert!((found[(0, 0)] / 16e-6 - 1.0).abs() < 1e-5 && found[(1, 1)] > 0.0, "{found}");
    }

    /// A square of a skew variable: with variance s and third cumulant k about m, (m + d)² has the mean m² + s and the
    /// variance 4m²s + 4mk + 2s², but for the fourth cumulant.
    #[test]
    fn squares_have_their_known_moments() {
        let (m, s, k) = (2.0, 0.09, 0.004);
        let mut third = [[[0.0; 3]; 3]; 3];
        third[1][1][1] = k;
        let covariance = Matrix3::from_diagonal(&[0.5, s, 0.0].into());
        let square = |[x, y, z]: [f64; 3]| [y * y, x, z];
        let (mean, found) = moments([1.0, m, 3.0], &[(covariance, third)], square);
        assert!((mean[0] - m * m - s).abs() < 1e-12 && (mean[1] - 1.0).abs() < 1e-12 && (mean[2] - 3.0).abs() < 1e-12);
        assert!((found[(0, 0)] - 4.0 * m * m * s - 4.0 * m * k - 2.0 * s * s).abs() < 1e-12, "{found}");
        assert!((found[(1, 1)] - 0.5).abs() < 1e-12 && found[(0, 1)].abs() < 1e-12);
    }
}
