//! Moments of what is a curved function of noisy channels: L\*a\*b\* and xyY of XYZ.

use super::moments::Prediction;
use nalgebra::{Matrix3, Vector3};

/// Third joint cumulants of three channels, and fourth.
pub(super) type Third = [[[f64; 3]; 3]; 3];
type Fourth = [Third; 3];

/// Joint cumulants 2 to 4 of three channels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct PixelLaw {
    pub covariance: Matrix3<f64>,
    pub third: Third,
    pub fourth: Fourth,
}

impl PixelLaw {
    /// Of channels that are sums of photosites drawn apart, from their weights and predictions.
    pub fn of<'a>(sites: impl IntoIterator<Item = ([f64; 3], &'a Prediction)>) -> Self {
        let mut law = Self::default();
        for (w, site) in sites {
            let weights = Vector3::from(w);
            law.covariance += site.moments.variance * weights * weights.transpose();
            let fourth = site.fourth();
            for (a, b, c) in indices() {
                law.third[a][b][c] += site.third * w[a] * w[b] * w[c];
                for d in 0..3 {
                    law.fourth[a][b][c][d] += fourth * w[a] * w[b] * w[c] * w[d];
                }
            }
        }
        law
    }
}

/// Places in a tensor of three indices.
fn indices() -> impl Iterator<Item = (usize, usize, usize)> {
    (0..27).map(|index| (index / 9, index / 3 % 3, index % 3))
}

/// Share of a channel that its noise may be where curved functions of it are predicted.
///
/// What is left out goes with the fourth power of the share, times about 10: 10⁻³ of a variance at a tenth.
pub(super) const LARGEST_SHARE: f64 = 0.1;

/// Cumulants along principal axes, third and fourth, beyond which the series is cut off too soon.
const MOST_SKEWED: f64 = 2.0;
const MOST_PEAKED: f64 = 6.0;

/// What the series may be off by, of a variance, where cumulants are larger and left out: noise is so small a share of the channels that
/// a color is straight over it.
const STRAIGHT: f64 = 1e-3;

/// How far skewness and excess may move a variance, of itself: what further cumulants do is of the order of the square of that.
const MOST_MOVED: f64 = 0.03;

/// Why nothing is said where noise is larger.
pub(super) const VOID: &str =
    "the noise of X, Y or Z is more than a tenth of it, too much to be propagated to a color that is curved in it";

/// Why nothing is said where a law is far from normal.
pub(super) const FAR_FROM_NORMAL: &str = "its noise, of few codes or of hues that divide by a weak green, is too far from a normal law to \
                                          be propagated to a color that is curved in it";

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

/// Mean and covariance of `value` over pixels of several laws alike, all of one mean; none where these are so far from normal that the
/// first four cumulants do not tell.
///
/// Along the principal axes of the covariance, channels = mean + A z, the density of z is
/// φ(z) \[1 + Σ κ_ijk He_ijk(z)/6 + Σ κ_ijkl He_ijkl(z)/24], and expectations are sums over 7³ nodes: exact for what is a parabola over
/// the noise.
pub(super) fn moments(
    mean: [f64; 3],
    laws: &[PixelLaw],
    value: impl Fn([f64; 3]) -> [f64; 3],
) -> Option<([f64; 3], Matrix3<f64>)> {
    let reference = Vector3::from(value(mean));
    let (mut first, mut second) = (Vector3::zeros(), Matrix3::zeros());
    // The same as if all were normal.
    let (mut normal, mut normal_square) = (Vector3::zeros(), Matrix3::zeros());
    for law in laws {
        let [along, back] = principal(&law.covariance);
        let shape = Shape::along(law, &back);
        let shape = match shape.is_told() {
            true => shape,
            false if shape.matters(largest_share(mean, &law.covariance)) => return None,
            false => Shape::default(),
        };
        for (of_normal, z) in grid() {
            let weight = of_normal * (1.0 + shape.at(z));
            let channels = Vector3::from(mean) + along * Vector3::from(z);
            let offset = Vector3::from(value(channels.into())) - reference;
            first += weight * offset;
            second += weight * offset * offset.transpose();
            normal += of_normal * offset;
            normal_square += of_normal * offset * offset.transpose();
        }
    }
    let count = laws.len() as f64;
    (first, second) = (first / count, second / count);
    (normal, normal_square) = (normal / count, normal_square / count);
    let covariance = second - first * first.transpose();
    let of_normal = normal_square - normal * normal.transpose();
    let is_told = |i: usize| (covariance[(i, i)] - of_normal[(i, i)]).abs() <= MOST_MOVED * of_normal[(i, i)];
    (0..3).all(is_told).then(|| ((reference + first).into(), covariance))
}

/// Covariance, over pixels of several laws, of the means that `value` has over exposures: channels = `mean` + f + t, f the fixed pattern,
/// of these laws, and t what is drawn anew, of such covariances.
///
/// E \[value | f] is a mean over ± √3 σ along the principal axes of t: exact for a cubic. So of a parabola with the second derivatives H
/// the pattern has J Σ_f Jᵀ + ½ tr(H Σ_f H Σ_f), and what is drawn anew the rest, ½ tr(H Σ_t H Σ_t) + tr(H Σ_f H Σ_t) and J Σ_t Jᵀ.
/// Where the variance of t differs with f, cov(f, ½ tr H Σ_t) counts twice, as the third cumulant of f does, in which it is to be.
pub(super) fn fixed(
    mean: [f64; 3],
    parts: &[(PixelLaw, Matrix3<f64>)],
    value: impl Fn([f64; 3]) -> [f64; 3],
) -> Matrix3<f64> {
    let reference = Vector3::from(value(mean));
    let (mut first, mut second) = (Vector3::zeros(), Matrix3::zeros());
    for (law, anew) in parts {
        let [along, back] = principal(&law.covariance);
        let shape = Shape::along(law, &back);
        let [axes, _] = principal(anew);
        let blurred = |channels: Vector3<f64>| {
            let beside = |axis: usize| {
                let off = 3.0_f64.sqrt() * axes.column(axis);
                Vector3::from(value((channels + off).into())) + Vector3::from(value((channels - off).into()))
            };
            (beside(0) + beside(1) + beside(2)) / 6.0
        };
        for (of_normal, z) in grid() {
            let weight = of_normal * (1.0 + shape.at(z));
            let offset = blurred(Vector3::from(mean) + along * Vector3::from(z)) - reference;
            first += weight * offset;
            second += weight * offset * offset.transpose();
        }
    }
    let count = parts.len() as f64;
    second / count - first * first.transpose() / (count * count)
}

/// Standard normal numbers along three axes, with their weights.
fn grid() -> impl Iterator<Item = (f64, [f64; 3])> {
    let plane = |(x, of_x): (f64, f64)| {
        let line = move |(y, of_y): (f64, f64)| NODES.map(|(z, of_z)| (of_x * of_y * of_z, [x, y, z]));
        NODES.into_iter().flat_map(line)
    };
    NODES.into_iter().flat_map(plane)
}

/// Standard deviations along the principal axes of a covariance, as columns, and the way back to numbers of unit variance.
fn principal(covariance: &Matrix3<f64>) -> [Matrix3<f64>; 2] {
    let axes = covariance.symmetric_eigen();
    let largest = axes.eigenvalues.max().max(0.0);
    let lengths = axes.eigenvalues.map(|value| if value > 1e-14 * largest { value.sqrt() } else { 0.0 });
    let inverse = lengths.map(|length| if length > 0.0 { 1.0 / length } else { 0.0 });
    let along = axes.eigenvectors * Matrix3::from_diagonal(&lengths);
    [along, Matrix3::from_diagonal(&inverse) * axes.eigenvectors.transpose()]
}

/// The largest share of a channel that its noise is.
fn largest_share(mean: [f64; 3], covariance: &Matrix3<f64>) -> f64 {
    (0..3).map(|i| covariance[(i, i)].max(0.0).sqrt() / mean[i].abs()).fold(0.0, f64::max)
}

/// How a law differs from a normal one: third and fourth cumulants along axes in which it has unit variance.
#[derive(Debug, Default)]
struct Shape {
    third: Third,
    fourth: Fourth,
}

impl Shape {
    fn along(law: &PixelLaw, by: &Matrix3<f64>) -> Self {
        let mut shape = Self { third: rotated(&law.third, by), fourth: law.fourth.map(|third| rotated(&third, by)) };
        let before = shape.fourth;
        for (b, c, d) in indices() {
            for a in 0..3 {
                shape.fourth[a][b][c][d] = (0..3).map(|e| by[(a, e)] * before[e][b][c][d]).sum();
            }
        }
        shape
    }

    /// The largest of the third cumulants, and of the fourth.
    fn largest(&self) -> [f64; 2] {
        let largest = |most: f64, cumulant: &f64| most.max(cumulant.abs());
        let third = self.third.iter().flatten().flatten().fold(0.0, largest);
        [third, self.fourth.iter().flatten().flatten().flatten().fold(0.0, largest)]
    }

    fn is_told(&self) -> bool {
        let [third, fourth] = self.largest();
        third <= MOST_SKEWED && fourth <= MOST_PEAKED
    }

    /// Whether a curved function of noise that is such a share of its channels shows it.
    fn matters(&self, share: f64) -> bool {
        let [third, fourth] = self.largest();
        third * share + fourth * share * share > STRAIGHT
    }

    /// Σ κ_ijk He_ijk(z)/6 + Σ κ_ijkl He_ijkl(z)/24, whose terms are products of He_n(z_i)/n! over the three axes.
    fn at(&self, z: [f64; 3]) -> f64 {
        let hermite = z.map(|z| {
            let square = z * z;
            let third = z * (square - 3.0) / 6.0;
            [1.0, z, (square - 1.0) / 2.0, third, (square * (square - 6.0) + 3.0) / 24.0]
        });
        let mut sum = 0.0;
        for i in 0..3 {
            for j in i..3 {
                for k in j..3 {
                    let term = |of: &[usize]| -> f64 {
                        let count = |axis: usize| of.iter().filter(|index| **index == axis).count();
                        (0..3).map(|axis| hermite[axis][count(axis)]).product()
                    };
                    sum += self.third[i][j][k] * term(&[i, j, k]);
                    sum += (k..3).map(|l| self.fourth[i][j][k][l] * term(&[i, j, k, l])).sum::<f64>();
                }
            }
        }
        sum
    }
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

    fn law(covariance: Matrix3<f64>, along: usize, [third, fourth]: [f64; 2]) -> PixelLaw {
        let mut law = PixelLaw { covariance, ..PixelLaw::default() };
        law.third[along][along][along] = third;
        law.fourth[along][along][along][along] = fourth;
        law
    }

    /// What hardly ever leaves its value has a skewness in the tens: its variance is that of the straight function where it is next to
    /// nothing beside its mean, and void elsewhere.
    #[test]
    fn what_hardly_ever_leaves_its_value_is_straight_or_void() {
        let found = |std: f64| {
            let law = law(Matrix3::from_diagonal(&[std * std; 3].into()), 1, [30.0 * std.powi(3), 900.0 * std.powi(4)]);
            moments([1.0, 2.0, 3.0], &[law], |[x, y, z]| [y * y, x, z])
        };
        let (_, straight) = found(1e-5).unwrap();
        assert!((straight[(0, 0)] / 16e-10 - 1.0).abs() < 1e-5 && straight[(1, 1)] > 0.0, "{straight}");
        assert_eq!(found(1e-2), None);
    }

    /// A square of a skew variable: with variance s, third cumulant k and fourth q about m, (m + d)² has the mean m² + s and the
    /// variance 4m²s + 4mk + 2s² + q.
    #[test]
    fn squares_have_their_known_moments() {
        let (m, s, k, q) = (2.0, 0.09, 0.004, 0.003);
        let law = law(Matrix3::from_diagonal(&[0.5, s, 0.0].into()), 1, [k, q]);
        let square = |[x, y, z]: [f64; 3]| [y * y, x, z];
        let (mean, found) = moments([1.0, m, 3.0], &[law], square).unwrap();
        assert!((mean[0] - m * m - s).abs() < 1e-12 && (mean[1] - 1.0).abs() < 1e-12 && (mean[2] - 3.0).abs() < 1e-12);
        assert!((found[(0, 0)] - 4.0 * m * m * s - 4.0 * m * k - 2.0 * s * s - q).abs() < 1e-12, "{found}");
        assert!((found[(1, 1)] - 0.5).abs() < 1e-12 && found[(0, 1)].abs() < 1e-12);
    }

    /// The product of two sums of coins, each of one, two or both, by all ways in which they fall.
    #[test]
    fn products_of_few_coins_are_exact() {
        let weights =
            [[0.5, 0.2, 0.0], [0.3, 0.0, 0.1], [0.1, 0.6, 0.0], [0.2, 0.1, 0.3], [0.0, 0.4, 0.2], [0.3, 0.2, 0.4]];
        // A coin that shows 1 with the probability 0.3.
        let p: f64 = 0.3;
        let v = p * (1.0 - p);
        let coin = Prediction::of_cumulants(p, v, v * (1.0 - 2.0 * p), v * (1.0 - 6.0 * v));
        let law = PixelLaw::of(weights.iter().map(|weights| (*weights, &coin)));
        let mean = [0, 1, 2].map(|i| 12.0 + weights.iter().map(|weights| p * weights[i]).sum::<f64>());
        let value = |[x, y, z]: [f64; 3]| [x * y, y * y, z * x];
        let (mut first, mut second) = (Vector3::zeros(), Matrix3::zeros());
        for ways in 0..64_u32 {
            let mut channels = [12.0; 3];
            let mut probability = 1.0;
            for (coin, weights) in weights.iter().enumerate() {
                let shows = f64::from(ways >> coin & 1);
                probability *= if shows > 0.0 { p } else { 1.0 - p };
                channels.iter_mut().zip(weights).for_each(|(channel, weight)| *channel += shows * weight);
            }
            let made = Vector3::from(value(channels));
            first += probability * made;
            second += probability * made * made.transpose();
        }
        let (found, covariance) = moments(mean, &[law], value).unwrap();
        assert!((Vector3::from(found) - first).norm() < 1e-10, "{found:?} {first}");
        let exact = second - first * first.transpose();
        assert!((covariance - exact).norm() < 1e-9 * exact.norm(), "{covariance} {exact}");
    }
}
