//! The paper's camera: frames drawn in memory by the same stages as the programs', and the moments of their samples.

use cyanometer::analysis::characterization::regression::{FitSettings, fit};
use cyanometer::analysis::characterization::signals;
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::sensor::Sensor;
use cyanometer::cfa::Class;
use cyanometer::color::{self, Space, White};
use cyanometer::error::{Error, Result};
use cyanometer::formats::{data, spectral};
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::{AdcRecord, FrameHeader, Metadata, Scene};
use cyanometer::numerics::moments::Moments;
use cyanometer::spectrum::WavelengthGrid;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseModel, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{MemoryFrame, Stage};
use cyanometer::units::QuantityKind;
use nalgebra::Matrix3;
use std::path::Path;

/// 33 ms at f/8 [HP2005, Sec. 4.1].
pub const EXPOSURE: Exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };

/// Columns and rows of the paper's frames [HP2005, Sec. 4.2].
pub const SMALL: [usize; 2] = [40, 30];

/// Columns and rows of frames whose sampling error is below 0.2 %.
pub const LARGE: [usize; 2] = [600, 400];

/// The methods of the paper.
pub const METHODS: [Method; 3] = [Method::Bilinear, Method::SmoothHue, Method::EffectiveColor];

/// The sensor, its converter, and the matrix to XYZ.
pub struct Camera {
    sensor: Sensor,
    /// What the noise of a photosite follows from.
    pub model: NoiseModel,
    /// The converter.
    pub adc: AdcRecord,
    color: ColorSettings,
    /// XYZ in cd m⁻² from ADU above black at [`EXPOSURE`].
    pub xyz_from_adu: Matrix3<f64>,
    /// Electrons of the 912 skies, the brightest class at three quarters of full well.
    pub skies: Vec<[f64; 3]>,
}

impl Camera {
    /// The KAF-5101CE, and SkyRadLS fitted to the 912 skies.
    pub fn new() -> Result<Self> {
        let tree = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let loaded = data::load_sensor(&tree.join("sample_data/sensors/kaf-5101ce.yaml").display().to_string())?;
        let library = spectral::read_library(&tree.join("sample_data/skies/sky912.exr"), None)?;
        let grid = WavelengthGrid::default();
        let signals = signals(&library, &loaded.sensor, &loaded.response, &data::load_observer()?, &grid)?;
        let all: Vec<usize> = (0..library.radiance.nrows()).collect();
        let settings = FitSettings { training: all, ..FitSettings::default() };
        let xyz_from_camera = fit(&signals, &signals, &settings, None)?.xyz_from_camera;
        let sensor = loaded.sensor;
        let skies = signals.camera.row_iter().map(|row| {
            let full = 0.75 * sensor.full_well_e / row.max();
            [row[0] * full, row[1] * full, row[2] * full]
        });
        let skies = skies.collect();
        let color = ColorSettings {
            xyz_from_camera,
            method: None,
            space: Space::Xyz,
            white: White::D65,
            white_luminance: None,
        };
        let head = expected(&sensor, SMALL, [0.0; 3]).header;
        let noise = AddNoise::new(&head, &NoiseSettings::default())?.header().clone();
        let codes = Digitize::new(&noise, &AdcSettings::default())?.header().clone();
        let missing = || Error::Data("the stages left no record".into());
        let model = NoiseModel::of(&noise, noise.metadata.noise.as_ref().ok_or_else(missing)?)?;
        let adc = codes.metadata.adc.ok_or_else(missing)?;
        let xyz_from_adu = color::matrix(&xyz_from_camera) / EXPOSURE.exposure_s_sr();
        Ok(Self { sensor, model, adc, color, xyz_from_adu, skies })
    }

    /// Noisy electrons of three planes.
    pub fn electrons(&self, size: [usize; 2], electrons: [f64; 3], seed: u64) -> Result<MemoryFrame> {
        noisy(&expected(&self.sensor, size, electrons), seed)
    }

    /// Noisy codes behind the filter array.
    pub fn plane(&self, size: [usize; 2], electrons: [f64; 3], seed: u64) -> Result<MemoryFrame> {
        // Mosaicking first gives the same samples to the bit, for a third of the work.
        mosaicked(&noisy(&mosaicked(&expected(&self.sensor, size, electrons))?, seed)?).and_then(|plane| codes(&plane))
    }

    /// XYZ of a demosaicked frame.
    pub fn xyz(&self, rgb: &MemoryFrame) -> Result<MemoryFrame> {
        Ok(rgb.through(&ToXyz::new(&rgb.header, &self.color)?)?.0)
    }
}

fn expected(sensor: &Sensor, size: [usize; 2], electrons: [f64; 3]) -> MemoryFrame {
    let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
    metadata.sensor = Some(sensor.clone());
    metadata.exposure = Some(EXPOSURE);
    metadata.scene = Some(Scene {
        source: "reproduction".into(),
        uniform: true,
        expected_electrons: Some(electrons),
        vignetting_focal_length_mm: None,
        patch: None,
        source_width: None,
        brightest_e: None,
    });
    let [width, height] = size;
    let row: Vec<f32> = electrons.iter().flat_map(|e| std::iter::repeat_n(to_sample(*e), width)).collect();
    let header =
        FrameHeader { name: "reproduction".into(), geometry: Geometry::new(width, height, &["R", "G", "B"]), metadata };
    MemoryFrame::new(header, row.repeat(height))
}

/// Each seed has patterns of its own: no draw is used twice.
fn noisy(frame: &MemoryFrame, seed: u64) -> Result<MemoryFrame> {
    let settings = NoiseSettings { seed, sensor_seed: seed, ..NoiseSettings::default() };
    Ok(frame.through(&AddNoise::new(&frame.header, &settings)?)?.0)
}

/// Codes of electrons.
pub fn codes(electrons: &MemoryFrame) -> Result<MemoryFrame> {
    Ok(electrons.through(&Digitize::new(&electrons.header, &AdcSettings::default())?)?.0)
}

/// The plane behind the sensor's filter array; one that is behind it already stays.
pub fn mosaicked(frame: &MemoryFrame) -> Result<MemoryFrame> {
    if frame.header.metadata.cfa.is_some() {
        return Ok(frame.clone());
    }
    Ok(frame.through(&Mosaic::new(&frame.header, None)?)?.0)
}

/// Demosaicked codes.
pub fn demosaicked(plane: &MemoryFrame, method: Method, black: Black) -> Result<MemoryFrame> {
    Ok(plane.through(&Demosaic::new(&plane.header, method, black, None)?)?.0)
}

/// The samples of a frame, row by row.
fn rows(frame: &MemoryFrame) -> impl Iterator<Item = Vec<&[f32]>> {
    let geometry = &frame.header.geometry;
    frame.samples.chunks_exact(geometry.row_samples()).map(|row| row.chunks_exact(geometry.width).collect())
}

/// Moments of all pixels.
pub fn moments(frame: &MemoryFrame) -> Moments {
    let mut moments = Moments::new(frame.header.geometry.channels.len());
    rows(frame).for_each(|row| moments.add(&row));
    moments
}

/// Moments of the pixels at the sites of each class, of a demosaicked frame or a plane.
pub fn class_moments(frame: &MemoryFrame) -> [Moments; 3] {
    let metadata = &frame.header.metadata;
    let Some(pattern) = metadata.cfa.or(metadata.demosaic.as_ref().map(|record| record.cfa)) else {
        return Class::ALL.map(|_| moments(frame));
    };
    let mut found = Class::ALL.map(|_| Moments::new(frame.header.geometry.channels.len()));
    for (y, row) in rows(frame).enumerate() {
        for (parity, class) in pattern.row_classes(frame.header.geometry.origin, y).into_iter().enumerate() {
            let sites: Vec<Vec<f32>> =
                row.iter().map(|line| line.iter().skip(parity).step_by(2).copied().collect()).collect();
            found[class as usize].add(&sites.iter().map(Vec::as_slice).collect::<Vec<_>>());
        }
    }
    found
}

/// Moments of the means of the patches that a frame can be cut into.
pub fn patch_moments(frame: &MemoryFrame, [width, height]: [usize; 2]) -> Moments {
    let geometry = &frame.header.geometry;
    let mut found = Moments::new(geometry.channels.len());
    for band in frame.samples.chunks_exact(geometry.row_samples() * height) {
        let mut sums = vec![vec![0.0; geometry.width / width]; geometry.channels.len()];
        for (index, line) in band.chunks_exact(geometry.width).enumerate() {
            let sums = &mut sums[index % geometry.channels.len()];
            for (sum, patch) in sums.iter_mut().zip(line.chunks_exact(width)) {
                *sum += patch.iter().map(|&sample| f64::from(sample)).sum::<f64>();
            }
        }
        let count = (width * height) as f64;
        let means: Vec<Vec<f32>> =
            sums.iter().map(|sums| sums.iter().map(|sum| to_sample(sum / count)).collect()).collect();
        found.add(&means.iter().map(Vec::as_slice).collect::<Vec<_>>());
    }
    found
}

/// The covariance of three channels.
pub fn covariance(moments: &Moments) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| moments.covariance(i, j).unwrap_or(f64::NAN))
}

/// The standard deviations of three channels.
pub fn std(moments: &Moments) -> [f64; 3] {
    [0, 1, 2].map(|channel| moments.std(channel).unwrap_or(f64::NAN))
}
