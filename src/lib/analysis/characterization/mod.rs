//! Characterization: the matrix from camera signals to XYZ, fitted on known radiances or on the responses alone.

mod codes;
pub mod evaluation;
pub mod noise_aware;
pub mod regression;
mod saturating;
pub mod training;

use crate::camera::optics::Exposure;
use crate::camera::response::SpectralResponse;
use crate::camera::sensor::{ResponseFiles, Sensor};
use crate::color::difference::DifferenceReport;
use crate::error::{Error, Result};
use crate::metadata::{CameraSettings, MatrixResidual, RelativeMatrix};
use crate::spectrum::{Observer, SpectralLibrary, WavelengthGrid, fold};
use crate::units::{CM2_PER_M2, LUMINOUS_EFFICACY_LM_PER_W};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The schema that matrix files name.
pub const MATRIX_SCHEMA: &str = "cyanometer-matrix/1";
/// The unit of the elements of a matrix.
pub const MATRIX_UNIT: &str = "cd m-2 per (ADU s-1 sr-1)";

/// The unit of the elements of a matrix for relative XYZ: signals are shares of white level less black level, and Y = 1
/// is the white by which the first class reaches its white level.
pub const RELATIVE_MATRIX_UNIT: &str = "relative XYZ per (white level - black level)";

/// A matrix file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraMatrix {
    /// `cyanometer-matrix/1`.
    pub schema: String,
    /// Name of the sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<String>,
    /// What covers the sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// The response of the sensor whose signals it was fitted to, by which others of the same name are told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub response: Option<ResponseFiles>,
    /// Distance of neighboring photosites in µm, on whose square absolute XYZ hang.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel_pitch_um: Option<f64>,
    /// Method of the fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// Slope of the converter that it is for, ADU per e⁻, where it is known; XYZ that are relative do not depend on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adu_per_e: Option<f64>,
    /// The sensitivity of the frame that absolute XYZ were fitted to, ISO.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso_speed: Option<f64>,
    /// What its camera was set to besides, in its own units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_settings: Option<CameraSettings>,
    /// White level less black level of the frame that it was fitted to, ADU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_adu: Option<f64>,
    /// Unit of the elements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Rows X, Y, Z; columns R, G, B: XYZ from ADU above black, per s sr of exposure or, for relative XYZ, per share of white
    /// level less black level.
    pub xyz_from_camera: [[f64; 3]; 3],
    /// Chromaticity of the white that has Y = 1, of a matrix for relative XYZ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white_xy: Option<[f64; 2]>,
    /// Condition number of the training signals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<f64>,
    /// Number of independent training signals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rank: Option<usize>,
    /// What it was fitted on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub training: Option<Training>,
    /// How well it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<MatrixUncertainty>,
    /// How well it does without noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub performance: Option<Performance>,
    /// The chart that it was fitted to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chart: Option<ChartRecord>,
    /// The observer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observer: Option<String>,
    /// The wavelengths summed over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelengths: Option<WavelengthGrid>,
}

impl CameraMatrix {
    /// That of a raw file, for relative XYZ.
    pub fn relative(matrix: &RelativeMatrix, camera: Option<&str>) -> Self {
        Self {
            sensor: camera.map(str::to_owned),
            method: Some(matrix.method.clone()),
            white_xy: Some(matrix.white_xy),
            ..Self::bare(RELATIVE_MATRIX_UNIT, matrix.xyz_from_camera)
        }
    }

    /// That of a sensor's description.
    pub fn of_sensor(sensor: &Sensor, xyz_from_camera: [[f64; 3]; 3]) -> Self {
        let method = Some("xyz_from_camera of the sensor".into());
        let adu_per_e = sensor.readout.as_ref().map(|readout| readout.adu_per_e);
        Self { sensor: Some(sensor.name.clone()), method, adu_per_e, ..Self::bare(MATRIX_UNIT, xyz_from_camera) }
    }

    /// What the sensor of a frame has other than that which the matrix was fitted for, in words, whatever they are called.
    pub fn doubt_of_sensor(&self, sensor: &Sensor) -> Option<String> {
        let own_pitch = self.pixel_pitch_um.filter(|_| !self.is_relative());
        let pitch = own_pitch.zip(sensor.readout.as_ref().and_then(|readout| readout.pixel_pitch_um));
        let response = self.response.as_ref().zip(sensor.response.as_ref());
        let differs = response.and_then(|(own, other)| own.other_than(other));
        let differs = differs.or_else(|| pitch.filter(|(own, other)| own != other).map(|_| "pixel pitch"))?;
        Some(format!("was fitted for another {differs} than that of the sensor {}", sensor.name))
    }

    /// A matrix of which no more is known.
    pub fn bare(unit: &str, xyz_from_camera: [[f64; 3]; 3]) -> Self {
        Self {
            schema: MATRIX_SCHEMA.into(),
            sensor: None,
            filter: None,
            response: None,
            pixel_pitch_um: None,
            method: None,
            adu_per_e: None,
            iso_speed: None,
            camera_settings: None,
            range_adu: None,
            unit: Some(unit.into()),
            xyz_from_camera,
            white_xy: None,
            condition: None,
            rank: None,
            training: None,
            uncertainty: None,
            performance: None,
            chart: None,
            observer: None,
            wavelengths: None,
        }
    }

    /// Whether it gives relative XYZ.
    pub fn is_relative(&self) -> bool {
        self.unit.as_deref() == Some(RELATIVE_MATRIX_UNIT)
    }

    /// How far it is off on what it was fitted on.
    pub fn residual(&self) -> Option<MatrixResidual> {
        let Training { library, relative_rms, .. } = self.training.as_ref()?;
        Some(MatrixResidual { library: library.clone(), relative_rms: *relative_rms })
    }
}

/// What a matrix was fitted on, and how well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// The library.
    pub library: String,
    /// Samples used, counted from 0; absent where all were, or where the responses alone were fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<Vec<usize>>,
    /// How they were chosen, where a number of them was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen_by: Option<String>,
    /// Labels of samples that were kept out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub held_out: Vec<String>,
    /// Number of samples, or of wavelengths, that were fitted.
    pub count: usize,
    /// How samples were weighted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
    /// Ridge, relative to the signals' own sums of squares.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ridge: Option<f64>,
    /// Weight of noise, where it was weighed against the error of colors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_weight: Option<f64>,
    /// The sample of the library whose color is kept exact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white_sample: Option<usize>,
    /// Relative rms error of X, Y and Z over the samples, each relative to the sample's own value; over all samples of the
    /// library where the responses alone were fitted.
    pub relative_rms: [f64; 3],
    /// Largest error of the chromaticities x and y over the same samples.
    pub max_chromaticity_error: [f64; 2],
}

impl Training {
    /// So many samples of a library; how well they are met is not known.
    pub fn of(library: String, count: usize) -> Self {
        Self {
            library,
            samples: None,
            chosen_by: None,
            held_out: Vec::new(),
            count,
            weights: None,
            ridge: None,
            noise_weight: None,
            white_sample: None,
            relative_rms: [0.0; 3],
            max_chromaticity_error: [0.0; 2],
        }
    }
}

/// The chart that a matrix was fitted to. XYZ are those in the light of the chart, Y = 1 for a perfect diffuser in its place, at
/// its exposure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChartRecord {
    /// Where the colors come from.
    pub reference: String,
    /// The light that XYZ are for.
    pub light: String,
    /// Patches that do not count, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// Standard deviation by which X, Y and Z are off beside the noise, in units of the diffuser's Y.
    pub misfit: f64,
    /// Squared residuals, in units of noise and misfit, over their degrees of freedom.
    pub chi_squared_per_degree: f64,
    /// The same in units of noise alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chi_squared_per_degree_of_noise: Option<f64>,
    /// Degrees of freedom: three a patch, less nine.
    pub degrees: usize,
    /// Y of the white by which the first class reaches its white level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturation_y: Option<f64>,
}

/// How well a matrix is known: how it changes when training samples are left out one at a time (the jackknife), ridge and
/// noise terms staying as they are; or by the noise of the patches of a chart and what they are off by beside it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MatrixUncertainty {
    /// What it comes from.
    pub method: String,
    /// Standard error of each element of `xyz_from_camera`.
    pub standard_error: [[f64; 3]; 3],
    /// Covariance of the three elements of the rows X, Y and Z.
    pub covariance: [[[f64; 3]; 3]; 3],
    /// Covariance of all nine elements, row by row, where rows hang together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element_covariance: Option<[[f64; 9]; 9]>,
}

/// How well a matrix does without noise on a library.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Performance {
    /// The library.
    pub library: String,
    /// Samples of it.
    pub samples: u64,
    /// The white of L*a*b*, in words.
    pub white: String,
    /// Differences between the colors that the camera gives and the true ones.
    #[serde(flatten)]
    pub differences: DifferenceReport,
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
        if let Some(unit) =
            self.unit.as_ref().filter(|unit| ![MATRIX_UNIT, RELATIVE_MATRIX_UNIT].contains(&unit.as_str()))
        {
            return Err(format!("its unit is `{unit}`; understood are `{MATRIX_UNIT}` and `{RELATIVE_MATRIX_UNIT}`"));
        }
        let numbers = [("adu_per_e", self.adu_per_e), ("iso_speed", self.iso_speed), ("range_adu", self.range_adu)];
        for (key, number) in numbers {
            if let Some(number) = number.filter(|number| !(*number > 0.0 && number.is_finite())) {
                return Err(format!("`{key}` is {number}; it must be above 0"));
            }
        }
        /// The least of its singular values to the largest: decimals of equal rows leave 1e-17, cameras are above 0.01.
        const LEAST: f64 = 1e-9;
        let singular = crate::color::matrix(&self.xyz_from_camera).singular_values();
        if singular.min().partial_cmp(&(LEAST * singular.max())) != Some(std::cmp::Ordering::Greater) {
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
/// A library whose wavelengths are closer than the grid's is integrated between them.
///
/// # Errors
///
/// Those of the grid; [`Error::MissingKey`] for a sensor of unknown read-out; [`Error::Data`] where the library leaves out
/// more than 10⁻³ of what camera or observer respond to.
pub fn signals(
    library: &SpectralLibrary,
    sensor: &Sensor,
    response: &SpectralResponse,
    observer: &Observer,
    grid: &WavelengthGrid,
) -> Result<Signals> {
    let at = points(library, observer, response.knots_nm(), grid)?;
    let camera = electron_weights(sensor, response, &at)?;
    Ok(Signals {
        camera: sums(library, &at.0, &camera, "the camera", grid)?,
        xyz: sums(library, &at.0, &matching_weights(observer, &at), "the observer", grid)?,
    })
}

/// Works out the absolute XYZ of every radiance of a library, shape samples × 3, as [`signals`] does.
///
/// # Errors
///
/// Those of the grid; [`Error::Data`] where the library leaves out more than 10⁻³ of what the observer responds to.
pub fn stimuli(library: &SpectralLibrary, observer: &Observer, grid: &WavelengthGrid) -> Result<DMatrix<f64>> {
    let at = points(library, observer, Vec::new(), grid)?;
    sums(library, &at.0, &matching_weights(observer, &at), "the observer", grid)
}

/// Wavelengths and their widths: those of the grid, or, where the library's are closer, all between which curves are straight.
fn points(
    library: &SpectralLibrary,
    observer: &Observer,
    others: impl IntoIterator<Item = f64>,
    grid: &WavelengthGrid,
) -> Result<(Vec<f64>, Vec<f64>)> {
    if !grid.is_coarser_than(&library.wavelength_nm) {
        return grid.points();
    }
    let knots = observer.matching.iter().flat_map(|curve| curve.wavelengths_nm().iter().copied());
    Ok(grid.points_between(knots.chain(others).chain(library.wavelength_nm.iter().copied())))
}

/// Three sums over the wavelengths of every radiance of a library, shape samples × 3.
fn sums(
    library: &SpectralLibrary,
    wavelengths: &[f64],
    weights: &Three,
    what: &str,
    grid: &WavelengthGrid,
) -> Result<DMatrix<f64>> {
    let mut made = DMatrix::zeros(library.radiance.nrows(), 3);
    for (j, weights) in weights.iter().enumerate() {
        let folded = fold(&library.wavelength_nm, wavelengths, weights);
        if folded.uncovered > 1e-3 {
            return Err(Error::Data(format!(
                "the radiance does not cover {:.1} % of what {what} responds to between {} and {} nm",
                100.0 * folded.uncovered,
                grid.start_nm,
                grid.end_nm
            )));
        }
        for (i, row) in library.radiance.rows().into_iter().enumerate() {
            made[(i, j)] = row.iter().zip(&folded.weights).map(|(l, w)| l * w).sum();
        }
    }
    Ok(made)
}

/// Camera and observer at single wavelengths: what maximum ignorance is fitted on.
///
/// # Errors
///
/// Those of the grid; [`Error::MissingKey`] for a sensor of unknown read-out.
pub fn responses(
    sensor: &Sensor,
    response: &SpectralResponse,
    observer: &Observer,
    grid: &WavelengthGrid,
) -> Result<Signals> {
    let at = grid.points()?;
    let count = at.0.len();
    let (camera, xyz) = (electron_weights(sensor, response, &at)?, matching_weights(observer, &at));
    let columns = |weights: [Vec<f64>; 3]| DMatrix::from_fn(count, 3, |i, j| weights[j][i]);
    Ok(Signals { camera: columns(camera), xyz: columns(xyz) })
}

/// Weights of three sums over wavelengths.
type Three = [Vec<f64>; 3];

/// What a radiance of 1 W cm⁻² sr⁻¹ nm⁻¹ at each of some wavelengths, with their weights, adds to the signals of R, G and B.
fn electron_weights(
    sensor: &Sensor,
    response: &SpectralResponse,
    (wavelengths, widths): &(Vec<f64>, Vec<f64>),
) -> Result<Three> {
    let unit = Exposure { exposure_s: 1.0, f_number: 1.0, lens_transmittance: 1.0 };
    let per_exposure = sensor.readout()?.adu_per_e / unit.exposure_s_sr();
    let classes = response.electron_weights(sensor, &unit, wavelengths, widths)?;
    Ok(classes.map(|class| class.into_iter().map(|electrons| electrons * per_exposure).collect()))
}

/// What the same adds to X, Y, Z.
fn matching_weights(observer: &Observer, (wavelengths, widths): &(Vec<f64>, Vec<f64>)) -> Three {
    observer.matching.each_ref().map(|curve| -> Vec<f64> {
        let weight = |(&nm, width): (&f64, &f64)| LUMINOUS_EFFICACY_LM_PER_W * CM2_PER_M2 * curve.at(nm) * width;
        wavelengths.iter().zip(widths).map(weight).collect()
    })
}
