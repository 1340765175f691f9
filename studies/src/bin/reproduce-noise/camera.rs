//! The paper's camera: its noise, its converter, its matrix, and the frames that it takes.

use cyanometer::analysis::characterization::regression::Weights;
use cyanometer::camera::sensor::Sensor;
use cyanometer::cfa::{Class, FilterArray};
use cyanometer::color::{self, Space};
use cyanometer::error::{Error, Result};
use cyanometer::frame::to_sample;
use cyanometer::metadata::AdcRecord;
use cyanometer::numerics::moments::Moments;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::noise::{AddNoise, NoiseModel, NoiseSettings};
use cyanometer::stages::to_xyz::ColorSettings;
use cyanometer::stream::{MemoryFrame, Stage};
use cyanometer_studies::camera::{self, EXPOSURE, color_settings};
use cyanometer_studies::frames::{self, codes, exposed, moments, mosaicked, rows};
use nalgebra::Matrix3;

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
        let camera = camera::Camera::new()?;
        let xyz_from_camera = camera.fit_to_skies(Weights::Equal)?;
        let sensor = camera.sensor;
        let full_well_e = sensor.readout()?.full_well_e;
        let skies = camera.skies.signals.camera.row_iter().map(|row| {
            let full = 0.75 * full_well_e / row.max();
            [row[0] * full, row[1] * full, row[2] * full]
        });
        let skies = skies.collect();
        let head = frames::head(&sensor, SMALL, Some([0.0; 3]));
        let noise = AddNoise::new(&head, &NoiseSettings::default())?.header().clone();
        let codes = Digitize::new(&noise, &AdcSettings::default())?.header().clone();
        let missing = || Error::Data("the stages left no record".into());
        let model = NoiseModel::of(&noise, noise.metadata.noise.as_ref().ok_or_else(missing)?)?;
        let adc = codes.metadata.adc.ok_or_else(missing)?;
        let xyz_from_adu = color::matrix(&xyz_from_camera) / EXPOSURE.exposure_s_sr();
        Ok(Self { sensor, model, adc, color: color_settings(xyz_from_camera, Space::Xyz), xyz_from_adu, skies })
    }

    /// Noisy electrons of three planes. Each seed has patterns of its own: no draw is used twice.
    pub fn electrons(&self, size: [usize; 2], electrons: [f64; 3], seed: u64) -> Result<MemoryFrame> {
        exposed(&frames::uniform(&self.sensor, size, electrons)?, seed, seed)
    }

    /// Noisy codes behind the filter array.
    pub fn plane(&self, size: [usize; 2], electrons: [f64; 3], seed: u64) -> Result<MemoryFrame> {
        // Mosaicking first gives the same samples to the bit, for a third of the work.
        codes(&exposed(&mosaicked(&frames::uniform(&self.sensor, size, electrons)?)?, seed, seed)?)
    }

    /// XYZ of a demosaicked frame.
    pub fn xyz(&self, rgb: &MemoryFrame) -> Result<MemoryFrame> {
        frames::colors(rgb, &self.color)
    }
}

/// A plane demosaicked above a black level, ADU.
pub fn demosaicked_above(black_adu: f64, plane: &MemoryFrame, method: Method) -> Result<MemoryFrame> {
    Ok(plane.through(&Demosaic::new(&plane.header, method, Black::Level(black_adu.into()), None)?)?.0)
}

/// Moments of the pixels at the sites of each class, of a demosaicked frame or a plane.
pub fn class_moments(frame: &MemoryFrame) -> [Moments; 3] {
    let metadata = &frame.header.metadata;
    let Some(pattern) =
        metadata.cfa.and_then(FilterArray::bayer).or(metadata.demosaic.as_ref().map(|record| record.cfa))
    else {
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
