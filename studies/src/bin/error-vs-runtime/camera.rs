//! The camera that all studies use: the default sensor at the default exposure, and frames in memory.

use cyanometer::analysis::characterization::regression::{FitSettings, Weights, fit};
use cyanometer::analysis::characterization::{Signals, responses, signals};
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::sensor::{Sensor, SpectralResponse};
use cyanometer::chain::{Chain, ChainSettings};
use cyanometer::color::{Space, White};
use cyanometer::error::Result;
use cyanometer::formats::{data, spectral};
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::{FrameHeader, Metadata, Scene};
use cyanometer::numerics::moments::Moments;
use cyanometer::propagation::Equations;
use cyanometer::spectrum::{SpectralLibrary, WavelengthGrid};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::MemoryFrame;
use cyanometer::units::QuantityKind;
use std::path::{Path, PathBuf};

/// 33 ms at f/8.
pub const EXPOSURE: Exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };

/// A clear sky at three quarters of full well, e⁻ of R, G, B.
pub const SKY: [f64; 3] = [4448.0, 16_599.0, 30_000.0];

/// The methods with the names that plots give them.
pub const METHODS: [(&str, Method); 4] =
    [("BI", Method::Bilinear), ("SHTI", Method::SmoothHue), ("ECI", Method::EffectiveColor), ("MHC", Method::Malvar)];

/// Sensor, skies, and the matrix fitted to them.
pub struct Camera {
    pub sensor: Sensor,
    pub response: SpectralResponse,
    pub skies: SpectralLibrary,
    pub signals: Signals,
    pub responses: Signals,
    /// SkyRadLS on all 912 skies, errors relative to luminance.
    pub color: ColorSettings,
}

/// A file of the tree.
pub fn sample_data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join("sample_data").join(name)
}

impl Camera {
    pub fn new() -> Result<Self> {
        let loaded = data::load_sensor(data::DEFAULT_SENSOR)?;
        let (sensor, response) = (loaded.sensor, loaded.response);
        let observer = data::load_observer()?;
        let skies = spectral::read_library(&sample_data("skies/sky912.exr"), None)?;
        let grid = WavelengthGrid::default();
        let signals = signals(&skies, &sensor, &response, &observer, &grid)?;
        let responses = responses(&sensor, &response, &observer, &grid)?;
        let all = (0..skies.radiance.nrows()).collect();
        let settings = FitSettings { training: all, weights: Weights::Relative, ..FitSettings::default() };
        let xyz_from_camera = fit(&signals, &responses, &settings, None)?.xyz_from_camera;
        let color = ColorSettings {
            xyz_from_camera,
            method: None,
            space: Space::Xyz,
            white: White::D65,
            white_luminance: None,
        };
        Ok(Self { sensor, response, skies, signals, responses, color })
    }

    /// The head of a frame of expected electrons; `uniform` are those of a uniform scene.
    pub fn head(&self, [width, height]: [usize; 2], uniform: Option<[f64; 3]>) -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
        metadata.sensor = Some(self.sensor.clone());
        metadata.exposure = Some(EXPOSURE);
        metadata.scene = Some(Scene {
            source: "error against run time".into(),
            uniform: uniform.is_some(),
            expected_electrons: uniform,
            vignetting_focal_length_mm: None,
            patch: None,
            source_width: None,
            brightest_e: None,
        });
        FrameHeader { name: "memory".into(), geometry: Geometry::new(width, height, &["R", "G", "B"]), metadata }
    }

    /// A uniform scene behind the filter array.
    pub fn plane(&self, size: [usize; 2], electrons: [f64; 3]) -> Result<MemoryFrame> {
        let row: Vec<f32> = electrons.iter().flat_map(|e| std::iter::repeat_n(to_sample(*e), size[0])).collect();
        mosaicked(&MemoryFrame::new(self.head(size, Some(electrons)), row.repeat(size[1])))
    }

    /// The noise budget by formula, ready to predict.
    pub fn chain(&self, method: Method, equations: Equations, with_color: bool) -> Result<Chain> {
        Chain::new(ChainSettings {
            sensor: self.sensor.clone(),
            exposure: EXPOSURE,
            noise: NoiseSettings::default(),
            method,
            pattern: None,
            color: with_color.then(|| self.color.clone()),
            dark_frames: 0,
            equations,
            patch: None,
            patch_at: None,
            wanted: None,
        })
    }

    /// XYZ of demosaicked codes.
    pub fn xyz(&self, rgb: &MemoryFrame) -> Result<MemoryFrame> {
        Ok(rgb.through(&ToXyz::new(&rgb.header, &self.color)?)?.0)
    }
}

/// One exposure: temporal noise by `seed`, patterns by `sensor_seed`.
pub fn exposed(expected: &MemoryFrame, seed: u64, sensor_seed: u64) -> Result<MemoryFrame> {
    let settings = NoiseSettings { seed, sensor_seed, ..NoiseSettings::default() };
    Ok(expected.through(&AddNoise::new(&expected.header, &settings)?)?.0)
}

/// Codes of electrons.
pub fn codes(electrons: &MemoryFrame) -> Result<MemoryFrame> {
    Ok(electrons.through(&Digitize::new(&electrons.header, &AdcSettings::default())?)?.0)
}

/// The plane behind the sensor's filter array.
pub fn mosaicked(frame: &MemoryFrame) -> Result<MemoryFrame> {
    Ok(frame.through(&Mosaic::new(&frame.header, None)?)?.0)
}

/// A demosaicked plane.
pub fn demosaicked(plane: &MemoryFrame, method: Method) -> Result<MemoryFrame> {
    Ok(plane.through(&Demosaic::new(&plane.header, method, Black::Auto, None)?)?.0)
}

/// Moments of all pixels.
pub fn moments(frame: &MemoryFrame) -> Moments {
    let geometry = &frame.header.geometry;
    let mut moments = Moments::new(geometry.channels.len());
    for row in frame.samples.chunks_exact(geometry.row_samples()) {
        moments.add(&row.chunks_exact(geometry.width).collect::<Vec<_>>());
    }
    moments
}

/// Standard deviation of a channel.
pub fn std(moments: &Moments, channel: usize) -> f64 {
    moments.std(channel).unwrap_or(f64::NAN)
}
