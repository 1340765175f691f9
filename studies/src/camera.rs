//! The camera of all studies: the default sensor at the exposure of the paper, and the skies that it sees.

use cyanometer::analysis::characterization::regression::{FitSettings, Weights, fit};
use cyanometer::analysis::characterization::{Signals, responses, signals};
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::response::SpectralResponse;
use cyanometer::camera::sensor::Sensor;
use cyanometer::color::{Space, White};
use cyanometer::error::Result;
use cyanometer::formats::data::LoadedSensor;
use cyanometer::formats::{data, spectral};
use cyanometer::spectrum::{Observer, SpectralLibrary, WavelengthGrid};
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::to_xyz::ColorSettings;
use std::path::{Path, PathBuf};

/// 33 ms at f/8 [HP2005, Sec. 4.1].
pub const EXPOSURE: Exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };

/// A clear sky at three quarters of full well, e⁻ of R, G, B.
pub const SKY: [f64; 3] = [4448.0, 16_599.0, 30_000.0];

/// The demosaicking methods with the names that tables and plots give them.
pub const METHODS: [(&str, Method); 4] =
    [("BI", Method::Bilinear), ("SHTI", Method::SmoothHue), ("ECI", Method::EffectiveColor), ("MHC", Method::Malvar)];

/// A matrix from camera signals to XYZ.
pub type Matrix = [[f64; 3]; 3];

/// A file of the tree.
pub fn sample_data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../sample_data").join(name)
}

/// The KAF-5101CE from the tree, whatever the environment says.
///
/// # Errors
///
/// None unless the tree is damaged.
pub fn sensor() -> Result<LoadedSensor> {
    data::load_sensor(&sample_data("sensors/kaf-5101ce.yaml").display().to_string())
}

/// What turns sensor RGB into a space by a matrix, white D65.
pub fn color_settings(xyz_from_camera: Matrix, space: Space) -> ColorSettings {
    ColorSettings {
        xyz_from_camera,
        is_relative: false,
        method: None,
        residual: None,
        space,
        white: White::D65,
        white_luminance: None,
    }
}

/// A library as camera and observer see it.
pub struct Seen {
    /// The spectra.
    pub library: SpectralLibrary,
    /// Their signals, per unit of exposure.
    pub signals: Signals,
}

/// Sensor, observer, and skies.
pub struct Camera {
    /// The sensor.
    pub sensor: Sensor,
    /// Its curves.
    pub response: SpectralResponse,
    /// The CIE 1931 observer.
    pub observer: Observer,
    /// Responses of both at single wavelengths.
    pub responses: Signals,
    /// The 912 computed skies.
    pub skies: Seen,
}

impl Camera {
    /// Loads all of it from the tree.
    ///
    /// # Errors
    ///
    /// None unless the tree is damaged.
    pub fn new() -> Result<Self> {
        let loaded = sensor()?;
        let (response, sensor) = (loaded.response()?.clone(), loaded.sensor);
        let observer = data::load_observer()?;
        let responses = responses(&sensor, &response, &observer, &WavelengthGrid::default())?;
        let skies = see(&sensor, &response, &observer, "skies/sky912.exr")?;
        Ok(Self { sensor, response, observer, responses, skies })
    }

    /// The skies that Kider measured.
    ///
    /// # Errors
    ///
    /// None unless the tree is damaged.
    pub fn measured_skies(&self) -> Result<Seen> {
        see(&self.sensor, &self.response, &self.observer, "skies/kider2014.exr")
    }

    /// SkyRadLS fitted to all computed skies.
    ///
    /// # Errors
    ///
    /// None: the skies determine a matrix.
    pub fn fit_to_skies(&self, weights: Weights) -> Result<Matrix> {
        let training = (0..self.skies.library.radiance.nrows()).collect();
        let settings = FitSettings { training, weights, ..FitSettings::default() };
        Ok(fit(&self.skies.signals, &self.responses, &settings, None)?.xyz_from_camera)
    }
}

fn see(sensor: &Sensor, response: &SpectralResponse, observer: &Observer, file: &str) -> Result<Seen> {
    let (library, _) = spectral::read_library(&sample_data(file), None)?;
    let signals = signals(&library, sensor, response, observer, &WavelengthGrid::default())?;
    Ok(Seen { library, signals })
}
