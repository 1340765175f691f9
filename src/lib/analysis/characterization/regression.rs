//! The regressions of [HP2005, Sec. 3.6] and what goes with them: weights, ridge, rank, residuals, uncertainty.

use super::noise_aware::NoiseTerms;
use super::{MatrixUncertainty, Signals};
use crate::error::{Error, Result};
use crate::names::Named;
use crate::numerics::least_squares::{Fit, LARGEST_CONDITION, Problem, Undetermined, ridge_rows};
use nalgebra::DMatrix;

/// How the matrix is fitted \[FinlaysonDrew1997; HP2005, Sec. 3.6].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Regression {
    /// Least squares on training samples.
    #[default]
    SkyRadLs,
    /// Least squares on training samples, one sample kept exact.
    SkyRadSppls,
    /// Maximum ignorance: any power at each wavelength is as likely as any other, of either sign; one sample kept exact.
    MaxIgnSppls,
    /// Maximum ignorance with positivity: power at each wavelength is even between 0 and 1; one sample kept exact.
    MaxIgnPositiveSppls,
}

impl Regression {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::SkyRadLs, Self::SkyRadSppls, Self::MaxIgnSppls, Self::MaxIgnPositiveSppls];

    /// Whether one sample is kept exact.
    pub fn keeps_a_sample(self) -> bool {
        self != Self::SkyRadLs
    }

    /// Whether it is fitted on training samples, rather than on the responses alone.
    pub fn is_trained(self) -> bool {
        matches!(self, Self::SkyRadLs | Self::SkyRadSppls)
    }
}

impl Named for Regression {
    const ALL: &'static [Self] = &Self::ALL;

    fn name(self) -> &'static str {
        match self {
            Self::SkyRadLs => "sky-rad-ls",
            Self::SkyRadSppls => "sky-rad-sppls",
            Self::MaxIgnSppls => "max-ign-sppls",
            Self::MaxIgnPositiveSppls => "max-ign-positive-sppls",
        }
    }
}

/// How much each training sample counts.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Weights {
    /// All the same: errors of XYZ in cd m⁻², so bright samples lead.
    #[default]
    Equal,
    /// By 1/Y²: errors relative to the sample's luminance.
    Relative,
    /// One weight of the squared errors for each training sample.
    Given(Vec<f64>),
}

/// What is fitted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FitSettings {
    /// The regression.
    pub regression: Regression,
    /// Training samples.
    pub training: Vec<usize>,
    /// The sample that is kept exact, where one is.
    pub kept: Option<usize>,
    /// Weights of the training samples.
    pub weights: Weights,
    /// Ridge: share of each signal's own sum of squares that is added to it.
    pub ridge: f64,
}

/// A fitted matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedMatrix {
    /// XYZ from ADU above black, per s sr.
    pub xyz_from_camera: [[f64; 3]; 3],
    /// Condition number of the training signals.
    pub condition: f64,
    /// Number of independent training signals.
    pub rank: usize,
    /// How well the elements are known; none where a sample is indispensable.
    pub uncertainty: Option<MatrixUncertainty>,
    /// Observations fitted: samples, or wavelengths.
    pub count: usize,
}

/// Checks that a library has the samples that are asked for.
fn check_samples(signals: &Signals, samples: impl IntoIterator<Item = usize>) -> Result<()> {
    let available = signals.camera.nrows();
    match samples.into_iter().find(|&sample| sample >= available) {
        Some(bad) => {
            Err(Error::Usage(format!("there is no sample {bad}: the library has samples 0 to {}", available - 1)))
        }
        None => Ok(()),
    }
}

/// Fits the matrix that takes camera signals to XYZ. `responses` are those at single wavelengths, for maximum ignorance.
///
/// All three rows follow from one factorization: min Σ wᵢ |xᵢ − M ρᵢ|², where M ρ₀ = x₀ for the sample kept exact. Maximum
/// ignorance takes each wavelength as a sample; with positivity the correlation of the powers, E(L Lᵀ) = I/12 + 1 1ᵀ/4,
/// adds one sample of equal power, √3 times as strong. With `noise` the noise of the camera is weighed in.
///
/// # Errors
///
/// [`Error::Data`] where the samples do not determine the matrix; [`Error::Usage`] for samples that there are not, and
/// weights that do not fit.
///
/// # Examples
///
/// ```
/// use cyanometer::analysis::characterization::Signals;
/// use cyanometer::analysis::characterization::regression::{FitSettings, fit};
/// use nalgebra::DMatrix;
///
/// // Five colors that a matrix explains exactly; it is found again.
/// let xyz_from_camera = DMatrix::from_row_slice(3, 3, &[0.9, 0.1, 0.2, 0.3, 0.7, -0.1, 0.0, -0.2, 1.1]);
/// let camera = DMatrix::from_row_slice(5, 3, &[1., 2., 3., 2., 1., 1., 4., 1., 0., 3., 3., 5., 1., 0., 2.]);
/// let signals = Signals { xyz: &camera * xyz_from_camera.transpose(), camera };
/// let settings = FitSettings { training: vec![0, 1, 2, 3, 4], ..FitSettings::default() };
/// let found = fit(&signals, &signals, &settings, None)?;
/// assert_eq!(found.rank, 3);
/// for (i, row) in found.xyz_from_camera.iter().enumerate() {
///     for (j, element) in row.iter().enumerate() {
///         assert!((element - xyz_from_camera[(i, j)]).abs() < 1e-12);
///     }
/// }
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub fn fit(
    signals: &Signals,
    responses: &Signals,
    settings: &FitSettings,
    noise: Option<&NoiseTerms>,
) -> Result<FittedMatrix> {
    check_samples(signals, settings.training.iter().copied().chain(settings.kept))?;
    let regression = settings.regression;
    let trained = regression.is_trained();
    let (mut camera, mut xyz) = match regression {
        _ if trained => (signals.camera.select_rows(&settings.training), signals.xyz.select_rows(&settings.training)),
        Regression::MaxIgnPositiveSppls => (with_equal_power(&responses.camera), with_equal_power(&responses.xyz)),
        _ => (responses.camera.clone(), responses.xyz.clone()),
    };
    if !trained && (noise.is_some() || settings.weights != Weights::Equal) {
        return Err(Error::Usage(format!(
            "{} is fitted on the responses alone; it has no samples to weigh",
            regression.name()
        )));
    }
    if camera.iter().chain(xyz.iter()).any(|value| !value.is_finite()) {
        return Err(Error::Data("a training sample gives signals that are not finite".into()));
    }
    let weights = weights(&settings.weights, &xyz)?;
    if let Some(sample) =
        settings.training.iter().filter(|_| trained).find(|&&sample| signals.camera.row(sample).min() < 0.0)
    {
        return Err(Error::Data(format!("sample {sample} gives a negative signal; it cannot be trained on")));
    }
    for (row, weight) in weights.iter().enumerate() {
        camera.row_mut(row).scale_mut(weight.sqrt());
        xyz.row_mut(row).scale_mut(weight.sqrt());
    }
    let kept = kept_sample(signals, settings)?;
    let count = camera.nrows();
    let refused = |undetermined: Undetermined| refuse(undetermined, count, trained, kept.is_some());
    let (fit, elements) = match noise {
        None => {
            let penalty = ridge_rows(&camera, settings.ridge);
            let equality = kept.as_ref().map(|(left, right)| (left, right));
            let problem =
                Problem { regressors: &camera, responses: &xyz, group: 1, penalty: penalty.as_ref(), equality };
            let fit = problem.solve().map_err(refused)?;
            (fit, None)
        }
        Some(terms) => {
            let fit = terms.fit(&weights, settings.ridge, kept.as_ref()).map_err(refused)?;
            let elements = fit.coefficients.clone();
            (fit, Some(elements))
        }
    };
    // The paper's M acts on row vectors; ours takes columns to columns, so it is the transpose.
    let element = |i: usize, j: usize| match &elements {
        None => fit.coefficients[(j, i)],
        Some(elements) => elements[(3 * i + j, 0)],
    };
    let singular = camera.singular_values();
    Ok(FittedMatrix {
        xyz_from_camera: [0, 1, 2].map(|i| [0, 1, 2].map(|j| element(i, j))),
        condition: singular.max() / singular.min(),
        rank: if elements.is_some() { fit.rank / 3 } else { fit.rank },
        uncertainty: uncertainty(&fit),
        count,
    })
}

/// Signals and XYZ of the sample that is kept exact, where one is.
fn kept_sample(signals: &Signals, settings: &FitSettings) -> Result<Option<(DMatrix<f64>, DMatrix<f64>)>> {
    match (settings.regression.keeps_a_sample(), settings.kept) {
        (true, Some(sample)) if signals.camera.row(sample).amax() == 0.0 => {
            Err(Error::Data(format!("sample {sample} is dark: it cannot be kept exact")))
        }
        (true, Some(sample)) => {
            Ok(Some((signals.camera.rows(sample, 1).into_owned(), signals.xyz.rows(sample, 1).into_owned())))
        }
        (true, None) => Err(Error::Usage(format!("{} keeps a sample exact; choose it", settings.regression.name()))),
        (false, _) => Ok(None),
    }
}

/// The rows and their sum, √3 times as strong.
fn with_equal_power(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let mut stacked = rows.clone().resize_vertically(rows.nrows() + 1, 0.0);
    stacked.row_mut(rows.nrows()).copy_from(&(rows.row_sum() * 3f64.sqrt()));
    stacked
}

/// Weights of the squared errors.
fn weights(weights: &Weights, xyz: &DMatrix<f64>) -> Result<Vec<f64>> {
    match weights {
        Weights::Equal => Ok(Vec::new()),
        Weights::Relative if xyz.column(1).iter().all(|y| *y > 0.0) => {
            Ok(xyz.column(1).iter().map(|y| y.powi(-2)).collect())
        }
        Weights::Relative => Err(Error::Data("a training sample has no luminance to be relative to".into())),
        Weights::Given(given) if given.len() != xyz.nrows() => {
            Err(Error::Usage(format!("{} weights do not fit {} training samples", given.len(), xyz.nrows())))
        }
        Weights::Given(given) => Ok(given.clone()),
    }
}

fn refuse(undetermined: Undetermined, count: usize, trained: bool, keeps: bool) -> Error {
    let Undetermined { rank, unknowns, condition } = undetermined;
    let what = if trained { "training samples" } else { "wavelengths" };
    let kept = if keeps { " and the one kept exact" } else { "" };
    Error::Data(if count == 1 && trained && !keeps {
        "1 training sample does not determine the matrix, which takes 3 that are independent; give more".into()
    } else if condition.is_finite() && rank == unknowns {
        format!(
            "{count} {what}{kept} do not determine the matrix: with each signal scaled to unit length, their condition \
             number {condition:.1e} is above {LARGEST_CONDITION:.0e}; give more varied ones"
        )
    } else {
        // The noise-aware fit has the nine elements for unknowns, the others three in each row.
        let rows = unknowns / 3;
        format!(
            "{count} {what}{kept} do not determine the matrix: only {} of the 3 signals they need are independent; give \
             more varied ones",
            rank / rows
        )
    })
}

fn uncertainty(fit: &Fit) -> Option<MatrixUncertainty> {
    let by_response = fit.covariance.as_ref()?;
    let element = |i: usize, j: usize, k: usize| match by_response.as_slice() {
        [all] => all[(3 * i + j, 3 * i + k)],
        rows => rows[i][(j, k)],
    };
    let covariance = [0, 1, 2].map(|i| [0, 1, 2].map(|j| [0, 1, 2].map(|k| element(i, j, k))));
    Some(MatrixUncertainty {
        method: "jackknife".into(),
        standard_error: [0, 1, 2].map(|i| [0, 1, 2].map(|j| covariance[i][j][j].max(0.0).sqrt())),
        covariance,
        element_covariance: None,
    })
}

/// Relative rms error of X, Y, Z and largest error of x, y that a matrix makes on samples.
pub fn residuals(matrix: &[[f64; 3]; 3], signals: &Signals, samples: &[usize]) -> ([f64; 3], [f64; 2]) {
    let matrix = crate::color::matrix(matrix);
    let camera = signals.camera.select_rows(samples);
    let xyz = signals.xyz.select_rows(samples);
    let fitted = &camera * DMatrix::from_fn(3, 3, |j, i| matrix[(i, j)]);
    let count = samples.len();
    let relative_rms = [0, 1, 2].map(|j| {
        let square = |i: usize| (fitted[(i, j)] / xyz[(i, j)] - 1.0).powi(2);
        ((0..count).map(square).sum::<f64>() / count as f64).sqrt()
    });
    let max_chromaticity_error = [0, 1].map(|j| {
        let chromaticity = |m: &DMatrix<f64>, i: usize| m[(i, j)] / m.row(i).sum();
        (0..count).map(|i| (chromaticity(&fitted, i) - chromaticity(&xyz, i)).abs()).fold(0.0, f64::max)
    });
    (relative_rms, max_chromaticity_error)
}
