//! Characterisation: the matrix from camera signals to XYZ, fitted on known radiances.

use crate::error::{Error, Result};
use crate::numerics::least_squares;
use crate::optics::Exposure;
use crate::sensor::{Sensor, SpectralResponse};
use crate::spectrum::{Observer, SpectralLibrary, WavelengthGrid, fold};
use crate::units::{CM2_PER_M2, LUMINOUS_EFFICACY_LM_PER_W};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The schema that matrix files name.
pub const MATRIX_SCHEMA: &str = "cyanometer-matrix/1";
/// The unit of the elements of a matrix.
pub const MATRIX_UNIT: &str = "cd m-2 per (ADU s-1 sr-1)";

/// A matrix file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraMatrix {
    /// `cyanometer-matrix/1`.
    pub schema: String,
    /// Name of the sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<String>,
    /// Method of the fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// Unit of the elements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Rows X, Y, Z; columns R, G, B: XYZ from ADU above black, per s sr of exposure.
    pub xyz_from_camera: [[f64; 3]; 3],
    /// Condition number of the training signals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<f64>,
    /// What it was fitted on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub training: Option<Training>,
    /// The observer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observer: Option<String>,
    /// The wavelengths summed over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelengths: Option<WavelengthGrid>,
}

/// What a matrix was fitted on, and how well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// The library.
    pub library: String,
    /// Samples used, counted from 0; absent where all were.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<Vec<usize>>,
    /// Number of samples used.
    pub count: usize,
    /// Relative rms error of X, Y and Z over the samples, each relative to the sample's own value.
    pub relative_rms: [f64; 3],
    /// Largest error of the chromaticities x and y.
    pub max_chromaticity_error: [f64; 2],
}

impl CameraMatrix {
    /// Checks schema and numbers.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn check(&self) -> std::result::Result<(), String> {
        if self.schema != MATRIX_SCHEMA {
            return Err(format!("its schema is `{}`, not `{MATRIX_SCHEMA}`", self.schema));
        }
        if let Some(unit) = self.unit.as_ref().filter(|unit| *unit != MATRIX_UNIT) {
            return Err(format!("its unit is `{unit}`, but only `{MATRIX_UNIT}` is understood"));
        }
        if super::matrix(&self.xyz_from_camera).try_inverse().is_none() {
            return Err("its `xyz_from_camera` is singular: three signals would not give three stimuli".into());
        }
        Ok(())
    }
}

/// Radiances as the camera and as the observer see them.
#[derive(Debug, Clone, PartialEq)]
pub struct Signals {
    /// Expected ADU above black per s sr, shape samples × 3.
    pub camera: DMatrix<f64>,
    /// Absolute XYZ, Y in cd m⁻², shape samples × 3.
    pub xyz: DMatrix<f64>,
}

/// Works out what camera and observer make of every radiance of a library.
///
/// X = K_m Σ_j L_j x̄_j Δλ, K_m = 683 lm W⁻¹, L in W m⁻² sr⁻¹ nm⁻¹.
///
/// # Errors
///
/// Those of the grid; [`Error::Data`] where the library leaves out more than 10⁻³ of what camera or observer respond to.
pub fn signals(
    library: &SpectralLibrary,
    sensor: &Sensor,
    response: &SpectralResponse,
    observer: &Observer,
    grid: &WavelengthGrid,
) -> Result<Signals> {
    let (wavelengths, widths) = grid.points()?;
    let unit = Exposure { exposure_s: 1.0, f_number: 1.0, lens_transmittance: 1.0 };
    let electrons = response.electron_weights(sensor, &unit, &wavelengths, &widths);
    let per_exposure = sensor.adu_per_e / unit.exposure_s_sr();
    let matching = observer.matching.each_ref().map(|curve| -> Vec<f64> {
        let weight = |(&nm, width): (&f64, &f64)| LUMINOUS_EFFICACY_LM_PER_W * CM2_PER_M2 * curve.at(nm) * width;
        wavelengths.iter().zip(&widths).map(weight).collect()
    });
    let project = |weights: &[f64], what: &str| -> Result<Vec<f64>> {
        let folded = fold(&library.wavelength_nm, &wavelengths, weights);
        if folded.uncovered > 1e-3 {
            return Err(Error::Data(format!(
                "the library does not cover {:.1} % of what {what} responds to between {} and {} nm",
                100.0 * folded.uncovered,
                grid.start_nm,
                grid.end_nm
            )));
        }
        let dot = |row: ndarray::ArrayView1<'_, f64>| row.iter().zip(&folded.weights).map(|(l, w)| l * w).sum();
        Ok(library.radiance.rows().into_iter().map(dot).collect())
    };
    let columns = |all: [Vec<f64>; 3], factor: f64, what: &str| -> Result<DMatrix<f64>> {
        let mut made = DMatrix::zeros(library.radiance.nrows(), 3);
        for (j, weights) in all.iter().enumerate() {
            for (i, value) in project(weights, what)?.into_iter().enumerate() {
                made[(i, j)] = factor * value;
            }
        }
        Ok(made)
    };
    Ok(Signals {
        camera: columns(electrons, per_exposure, "the camera")?,
        xyz: columns(matching, 1.0, "the observer")?,
    })
}

/// Fits the matrix that takes camera signals to XYZ with the least squares of the training samples alone: SkyRadLS
/// [HP2005, Sec. 3.6].
///
/// # Errors
///
/// [`Error::Data`] where the samples do not determine it; [`Error::Usage`] for a sample that there is not.
pub fn fit_sky_rad_ls(signals: &Signals, samples: &[usize], library: &str) -> Result<([[f64; 3]; 3], f64, Training)> {
    let available = signals.camera.nrows();
    if let Some(bad) = samples.iter().find(|&&sample| sample >= available) {
        return Err(Error::Usage(format!("there is no sample {bad}: the library has samples 0 to {}", available - 1)));
    }
    let camera = signals.camera.select_rows(samples);
    let xyz = signals.xyz.select_rows(samples);
    let fit = least_squares::fit(&camera, &xyz)?;
    // The paper's M acts on row vectors; ours takes columns to columns, so it is the transpose.
    let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| fit.coefficients[(j, i)]));
    let fitted = &camera * &fit.coefficients;
    let count = samples.len();
    let relative_rms = [0, 1, 2].map(|j| {
        let square = |i: usize| (fitted[(i, j)] / xyz[(i, j)] - 1.0).powi(2);
        ((0..count).map(square).sum::<f64>() / count as f64).sqrt()
    });
    let max_chromaticity_error = [0, 1].map(|j| {
        let chromaticity = |m: &DMatrix<f64>, i: usize| m[(i, j)] / m.row(i).sum();
        (0..count).map(|i| (chromaticity(&fitted, i) - chromaticity(&xyz, i)).abs()).fold(0.0, f64::max)
    });
    let all = samples.iter().copied().eq(0..available);
    let training = Training {
        library: library.into(),
        samples: (!all).then(|| samples.to_vec()),
        count,
        relative_rms,
        max_chromaticity_error,
    };
    Ok((rows, fit.condition, training))
}
