//! The matrix that takes a camera's signals of known colors to their XYZ, both sides weighed by how well they are known.

use crate::error::{Error, Result};
use crate::numerics::least_squares::LARGEST_CONDITION;
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

/// Elements of the matrix, row by row.
const ELEMENTS: usize = 9;

/// The fewest patches: three would be met exactly, and nothing would tell how well.
const FEWEST: usize = 4;

/// In each mixture of the classes the signals are so many times their noise at least, as squares: noise alone makes 1, within 0.3 of 24
/// patches.
const LEAST_ABOVE_NOISE: f64 = 4.0;

/// Covariance of the elements of the matrix, row by row.
pub type ElementCovariance = SMatrix<f64, ELEMENTS, ELEMENTS>;

/// A patch of known color.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Its name.
    pub name: String,
    /// What the camera reads, R, G and B.
    pub signal: Vector3<f64>,
    /// How well that is known.
    pub covariance: Matrix3<f64>,
    /// XYZ that it has.
    pub reference: Vector3<f64>,
}

/// What is taken of the references, and of a matrix as a model of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Misfit {
    /// Both are exact: what a patch is off by is its noise.
    None,
    /// X, Y and Z of every patch are off by errors of one standard deviation, which follows from the patches.
    #[default]
    Estimated,
    /// The same, of a known standard deviation.
    Known(f64),
}

/// A fitted matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct ChartMatrix {
    /// XYZ from signals.
    pub xyz_from_camera: Matrix3<f64>,
    /// Covariance of its elements.
    pub covariance: ElementCovariance,
    /// Standard deviation by which X, Y and Z are off beside the noise.
    pub misfit: f64,
    /// The sum of the squared residuals in units of what they are expected to be.
    pub chi_squared: f64,
    /// What it is expected to be: three residuals a patch, less the nine elements.
    pub degrees: usize,
    /// What it would be if noise were all; none where the noise of a patch is not known.
    pub chi_squared_of_noise: Option<f64>,
    /// Condition number of the signals, each class scaled to unit length.
    pub condition: f64,
}

/// Fits a matrix to patches: total least squares with a covariance of its own for each.
///
/// min over M and c* of Σ (c − c*)ᵀ S⁻¹ (c − c*) + (x − M c*)ᵀ T⁻¹ (x − M c*)        [Fuller1987, Sec. 3.1]
///
/// c: signals, S: their covariance, x: reference, T = τ² I: misfit. The true signals c* drop out: what is left is
/// Σ rᵀ W r with r = x − M c and W = (M S Mᵀ + T)⁻¹, whose minimum has Σ W r c*ᵀ = 0, c* = c + S Mᵀ W r. Steps of Gauss and
/// Newton lead there; the covariance of the elements is the inverse of Σ c* c*ᵀ ⊗ W. That c* stands where c would be is what
/// keeps noise from drawing the matrix towards zero. τ is what makes Σ rᵀ W r its expectation, 3 N − 9 \[PauleMandel1982]; 0
/// where noise explains all.
///
/// # Errors
///
/// [`Error::Data`] for fewer than 4 patches, signals that do not determine the matrix, or patches without noise where there is
/// no misfit.
///
/// # Examples
///
/// ```
/// use cyanometer::analysis::chart::fit::{Misfit, Patch, fit};
/// use nalgebra::{Matrix3, Vector3};
///
/// let matrix = Matrix3::new(0.9, 0.1, 0.2, 0.3, 0.7, -0.1, 0.0, -0.2, 1.1);
/// let signals = [[0.1, 0.2, 0.3], [0.2, 0.1, 0.1], [0.4, 0.1, 0.0], [0.3, 0.3, 0.5], [0.1, 0.0, 0.2]];
/// let patches = signals.map(|signal| {
///     let signal = Vector3::from(signal);
///     let covariance = Matrix3::from_diagonal_element(1e-8);
///     Patch { name: String::new(), signal, covariance, reference: matrix * signal }
/// });
/// let found = fit(&patches, Misfit::Estimated)?;
/// assert!((found.xyz_from_camera - matrix).amax() < 1e-12);
/// assert_eq!((found.misfit, found.degrees), (0.0, 6));
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub fn fit(patches: &[Patch], misfit: Misfit) -> Result<ChartMatrix> {
    if patches.len() < FEWEST {
        let count = patches.len();
        return Err(Error::Data(format!(
            "{count} patches do not determine a matrix and its errors; give {FEWEST} or more"
        )));
    }
    let condition = condition(patches);
    if !(0.0..LARGEST_CONDITION).contains(&condition) {
        return Err(Error::Data(format!(
            "the signals of the patches do not determine the matrix: their condition number {condition:.1e} is above \
             {LARGEST_CONDITION:.0e}; give more varied colors"
        )));
    }
    if least_above_noise(patches) < LEAST_ABOVE_NOISE {
        return Err(Error::Data(
            "the signals of the patches do not determine the matrix: what tells one class from the others is no more than \
             their noise; check that the classes are R, G and B, or give more varied colors"
                .into(),
        ));
    }
    let start = plain(patches)?;
    let degrees = 3 * patches.len() - ELEMENTS;
    let squares: f64 = patches.iter().map(|patch| patch.residual(&start).norm_squared()).sum();
    let expected = degrees as f64;
    let of_noise = settled(patches, start, 0.0);
    let (variance, found) = match misfit {
        Misfit::None => (0.0, of_noise.clone().ok_or_else(|| unknown_noise(patches))?),
        Misfit::Known(deviation) => (deviation.powi(2), settled_or(patches, start, deviation.powi(2))?),
        Misfit::Estimated => match &of_noise {
            Some(found) if found.chi_squared <= expected => (0.0, found.clone()),
            _ => {
                // No W is larger than I / τ², so that the sum at this τ² is no more than expected.
                let most = (squares / expected).max(f64::EPSILON.powi(2));
                let variance = balanced(most, |variance| {
                    settled(patches, start, variance).map_or(f64::INFINITY, |found| found.chi_squared) - expected
                });
                (variance, settled_or(patches, start, variance)?)
            }
        },
    };
    Ok(ChartMatrix {
        xyz_from_camera: found.matrix,
        covariance: found.covariance,
        misfit: variance.sqrt(),
        chi_squared: found.chi_squared,
        degrees,
        chi_squared_of_noise: of_noise.map(|found| found.chi_squared),
        condition,
    })
}

impl Patch {
    /// What a matrix leaves of the reference.
    pub fn residual(&self, matrix: &Matrix3<f64>) -> Vector3<f64> {
        self.reference - matrix * self.signal
    }
}

/// Where the steps end.
#[derive(Debug, Clone)]
struct Settled {
    matrix: Matrix3<f64>,
    covariance: ElementCovariance,
    chi_squared: f64,
}

/// Least squares with equal weights.
fn plain(patches: &[Patch]) -> Result<Matrix3<f64>> {
    let moments = |right: fn(&Patch) -> Vector3<f64>| {
        patches.iter().fold(Matrix3::zeros(), |sum, patch| sum + right(patch) * patch.signal.transpose())
    };
    let inverse = moments(|patch| patch.signal).try_inverse();
    let inverse =
        inverse.ok_or_else(|| Error::Data("the signals of the patches do not determine the matrix".into()))?;
    Ok(moments(|patch| patch.reference) * inverse)
}

/// Condition number of the signals, each class scaled to unit length.
fn condition(patches: &[Patch]) -> f64 {
    let mut signals = DMatrix::from_fn(patches.len(), 3, |i, j| patches[i].signal[j]);
    for mut column in signals.column_iter_mut() {
        let length = column.norm();
        column /= length;
    }
    if !signals.iter().all(|value| value.is_finite()) {
        return f64::INFINITY;
    }
    let singular = signals.singular_values();
    singular.max() / singular.min()
}

/// The smallest ratio of Σ (wᵀc)² to Σ wᵀS w that a mixture w of the classes has; infinite where the noise is not known, or has none of a
/// mixture.
fn least_above_noise(patches: &[Patch]) -> f64 {
    let sum = |of: &dyn Fn(&Patch) -> Matrix3<f64>| patches.iter().fold(Matrix3::zeros(), |sum, patch| sum + of(patch));
    let noise = sum(&|patch| patch.covariance);
    let Some(inverse) = noise.cholesky().and_then(|factors| factors.l().try_inverse()) else { return f64::INFINITY };
    let signals = sum(&|patch| patch.signal * patch.signal.transpose());
    (inverse * signals * inverse.transpose()).symmetric_eigenvalues().min()
}

/// Steps from a matrix to the minimum for a variance of the misfit; none where it is not reached, or a weight is infinite.
fn settled(patches: &[Patch], start: Matrix3<f64>, variance: f64) -> Option<Settled> {
    const MOST_STEPS: usize = 200;
    /// Of the largest element.
    const NEAR: f64 = 1e-13;
    let mut matrix = start;
    for step in 0..=MOST_STEPS {
        let mut information = ElementCovariance::zeros();
        let mut right = SVector::<f64, ELEMENTS>::zeros();
        let mut chi_squared = 0.0;
        for patch in patches {
            let spread = matrix * patch.covariance * matrix.transpose() + Matrix3::from_diagonal_element(variance);
            let weight = spread.cholesky()?.inverse();
            let pull = weight * patch.residual(&matrix);
            chi_squared += patch.residual(&matrix).dot(&pull);
            let signal = patch.signal + patch.covariance * matrix.transpose() * pull;
            for i in 0..3 {
                for j in 0..3 {
                    right[3 * i + j] += pull[i] * signal[j];
                    for k in 0..3 {
                        for l in 0..3 {
                            information[(3 * i + j, 3 * k + l)] += weight[(i, k)] * signal[j] * signal[l];
                        }
                    }
                }
            }
        }
        let factors = scaled_cholesky(&information)?;
        let change = factors.solve(&right);
        let is_there = change.amax() <= NEAR * matrix.amax();
        if is_there || step == MOST_STEPS {
            let covariance = factors.inverse();
            return (is_there || change.amax() <= 1e-9 * matrix.amax()).then_some(Settled {
                matrix,
                covariance,
                chi_squared,
            });
        }
        matrix += Matrix3::from_fn(|i, j| change[3 * i + j]);
        if !matrix.iter().all(|element| element.is_finite()) {
            return None;
        }
    }
    None
}

/// A positive definite matrix by its factors, scaled so that its diagonal is 1.
struct Factors {
    scale: SVector<f64, ELEMENTS>,
    cholesky: nalgebra::Cholesky<f64, nalgebra::Const<ELEMENTS>>,
}

fn scaled_cholesky(matrix: &ElementCovariance) -> Option<Factors> {
    let scale = matrix.diagonal().map(|value| value.sqrt().recip());
    let scaled = ElementCovariance::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j]);
    Some(Factors { scale, cholesky: scaled.cholesky()? })
}

impl Factors {
    fn solve(&self, right: &SVector<f64, ELEMENTS>) -> SVector<f64, ELEMENTS> {
        self.cholesky.solve(&right.component_mul(&self.scale)).component_mul(&self.scale)
    }

    fn inverse(&self) -> ElementCovariance {
        let inverse = self.cholesky.inverse();
        ElementCovariance::from_fn(|i, j| inverse[(i, j)] * self.scale[i] * self.scale[j])
    }
}

fn settled_or(patches: &[Patch], start: Matrix3<f64>, variance: f64) -> Result<Settled> {
    settled(patches, start, variance).ok_or_else(|| {
        Error::Data(
            "the patches contradict each other so much that no matrix was found; check their order and names".into(),
        )
    })
}

/// The complaint where noise alone shall weigh, and a patch has none.
fn unknown_noise(patches: &[Patch]) -> Error {
    let without = patches.iter().find(|patch| patch.covariance.cholesky().is_none());
    Error::Data(match without {
        Some(patch) => format!(
            "the noise of the patch `{}` is not known, or zero, and nothing else is to weigh it; leave the misfit to be \
             estimated",
            patch.name
        ),
        None => {
            "the patches are off by so much more than their noise that no matrix was found; leave the misfit to be \
                 estimated"
                .into()
        }
    })
}

/// The variance at which what falls with it is 0, at most `most`: by halves of its logarithm.
fn balanced(most: f64, excess: impl Fn(f64) -> f64) -> f64 {
    /// Far below what any camera tells apart.
    const LEAST: f64 = 1e-14;
    const HALVES: usize = 60;
    let (mut low, mut high) = ((most * LEAST).ln(), most.ln());
    if !(low.is_finite() && high.is_finite()) {
        return most;
    }
    for _ in 0..HALVES {
        let middle = low.midpoint(high);
        if excess(middle.exp()) > 0.0 { low = middle } else { high = middle }
    }
    high.exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::significance::of_chi_square;
    use crate::random::gaussian::quantile;

    const FITS: usize = 200;

    /// Standard normal numbers from the words of SplitMix64.
    struct Normals(u64);

    impl Normals {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            quantile(mixed ^ (mixed >> 31))
        }

        fn three(&mut self) -> Vector3<f64> {
            Vector3::from_fn(|_, _| self.next())
        }
    }

    /// Of the size of a camera's.
    const TRUE: Matrix3<f64> = Matrix3::new(0.9, 0.4, 0.25, 0.35, 1.0, -0.1, 0.02, -0.2, 1.6);

    /// 24 colors: signals from 0.02 to 0.9 that are alike, as those of real charts.
    fn signals() -> Vec<Vector3<f64>> {
        let mut normals = Normals(24);
        let color = |level: f64, hue: Vector3<f64>| (hue * 0.35).map(f64::exp) * level;
        (0..24).map(|k| color(0.02 + 0.025 * f64::from(k), normals.three())).collect()
    }

    /// One chart: signals with shot and read noise of means of `photosites`, full well 20 000 e⁻, read noise 20 e⁻; references that
    /// are off by `misfit`.
    fn chart(seed: u64, photosites: f64, misfit: f64) -> Vec<Patch> {
        let mut normals = Normals(seed << 32);
        let patch = |signal: Vector3<f64>| {
            let variance = signal.map(|c| (c * 20_000.0 + 400.0) / (4e8 * photosites));
            let noise = normals.three().component_mul(&variance.map(f64::sqrt));
            Patch {
                name: String::new(),
                reference: TRUE * signal + normals.three() * misfit,
                signal: signal + noise,
                covariance: Matrix3::from_diagonal(&variance),
            }
        };
        signals().into_iter().map(patch).collect()
    }

    /// What many fits are off by, in units of what they say: the sum of the nine squares, and the share of single elements within
    /// 1.96 standard errors; with means of χ² and of the misfit.
    fn many(photosites: f64, misfit: f64, taken: Misfit) -> [f64; 5] {
        let (mut distances, mut within, mut chi_squared, mut found_misfit) = (0.0, 0.0, 0.0, 0.0);
        let mut bias = SVector::<f64, ELEMENTS>::zeros();
        let mut spread = ElementCovariance::zeros();
        for seed in 0..FITS as u64 {
            let found = fit(&chart(seed, photosites, misfit), taken).unwrap();
            let off = found.xyz_from_camera - TRUE;
            let off = SVector::<f64, ELEMENTS>::from_fn(|k, _| off[(k / 3, k % 3)]);
            distances += off.dot(&scaled_cholesky(&found.covariance).unwrap().solve(&off));
            let inside = |k: &usize| off[*k].abs() <= 1.959_964 * found.covariance[(*k, *k)].sqrt();
            within += (0..ELEMENTS).filter(inside).count() as f64 / ELEMENTS as f64;
            chi_squared += found.chi_squared;
            found_misfit += found.misfit;
            bias += off;
            spread += found.covariance;
        }
        let count = FITS as f64;
        // The mean over the fits against its own uncertainty: χ² of nine degrees.
        let of_mean = bias.dot(&scaled_cholesky(&spread).unwrap().solve(&bias));
        [distances / count, within / count, chi_squared / count, of_mean, found_misfit / count]
    }

    /// Noise alone. χ² of nine degrees has a variance of 18 and that of 63 one of 126, so that means of 200 lie within 4.5
    /// standard errors of 1.35 and 3.6; 95 % of 1800 intervals, of which the three of a row hang together, within
    /// 4.5 √(0.95 · 0.05 · 3/1800) = 4 %; and the mean of all matrices is the true one. Noise of
    /// three times the variance of a photosite is so strong that weights alone, without the true signals, would draw it away: χ² of
    /// the mean is 42 then.
    #[test]
    fn the_true_matrix_lies_within_its_standard_errors() {
        for photosites in [0.3, 400.0] {
            let [distance, within, chi_squared, of_mean, _] = many(photosites, 0.0, Misfit::None);
            assert!((distance - 9.0).abs() < 1.35, "{photosites}: {distance}");
            assert!((within - 0.95).abs() < 0.04, "{photosites}: {within}");
            assert!((chi_squared - 63.0).abs() < 3.6, "{photosites}: {chi_squared}");
            assert!(of_chi_square(of_mean, 9.0) > 1e-4, "{photosites}: {of_mean}");
        }
    }

    /// References that are off by 0.01. Its estimate has 63 degrees of freedom, so that the nine squares are 9 F(9, 63), of mean
    /// 9 · 63/61 = 9.3 and variance 23.6: within 4.5 √(23.6/200) = 1.55; the misfit's own error is 0.01/√(2 · 63), that of
    /// the mean of 200 is 0.6 % of it, and a root is short by 1/(4 · 63): 3.3 % in all.
    #[test]
    fn errors_of_the_references_are_found_beside_the_noise() {
        let [distance, within, chi_squared, of_mean, misfit] = many(400.0, 0.01, Misfit::Estimated);
        assert!((distance - 9.3).abs() < 1.55, "{distance}");
        assert!((within - 0.95).abs() < 0.04, "{within}");
        assert!((chi_squared - 63.0).abs() < 1e-6, "{chi_squared}");
        assert!(of_chi_square(of_mean, 9.0) > 1e-4, "{of_mean}");
        assert!((misfit / 0.01 - 1.0).abs() < 0.033, "{misfit}");
    }

    /// Patches without known noise are fitted by least squares with equal weights, whose standard errors are those of the
    /// textbook: s² (Cᵀ C)⁻¹, rows independent.
    #[test]
    fn without_noise_it_is_plain_least_squares() {
        let patches: Vec<Patch> =
            chart(5, 400.0, 0.01).into_iter().map(|p| Patch { covariance: Matrix3::zeros(), ..p }).collect();
        let found = fit(&patches, Misfit::Estimated).unwrap();
        let plain = plain(&patches).unwrap();
        assert!((found.xyz_from_camera - plain).amax() < 1e-10 && found.chi_squared_of_noise.is_none());
        let squares: f64 = patches.iter().map(|patch| patch.residual(&plain).norm_squared()).sum();
        let moments = patches.iter().fold(Matrix3::zeros(), |sum, p| sum + p.signal * p.signal.transpose());
        let expected = moments.try_inverse().unwrap() * (squares / 63.0);
        for (i, k) in [(0, 0), (1, 1), (2, 2), (0, 1)] {
            let block = found.covariance.fixed_view::<3, 3>(3 * i, 3 * k).into_owned();
            let expected = if i == k { expected } else { Matrix3::zeros() };
            assert!((block - expected).amax() < 1e-8 * moments.try_inverse().unwrap().amax());
        }
    }

    #[test]
    fn what_determines_no_matrix_is_told() {
        let said = |patches: &[Patch], misfit| fit(patches, misfit).unwrap_err().to_string();
        let all = chart(1, 400.0, 0.01);
        assert!(said(&all[..3], Misfit::Estimated).contains("3 patches"));
        let gray: Vec<Patch> = all.iter().map(|p| Patch { signal: Vector3::repeat(p.signal.y), ..p.clone() }).collect();
        assert!(said(&gray, Misfit::Estimated).contains("condition number"));
        let silent: Vec<Patch> = all.iter().map(|p| Patch { covariance: Matrix3::zeros(), ..p.clone() }).collect();
        assert!(said(&silent, Misfit::None).contains("is not known"));
        let lost: Vec<Patch> = all.iter().map(|p| Patch { signal: p.signal * f64::NAN, ..p.clone() }).collect();
        assert!(fit(&lost, Misfit::Estimated).is_err());
    }
}
