//! Frames in memory, what the stages make of them, and the moments of their samples.

use crate::camera::EXPOSURE;
use cyanometer::camera::sensor::Sensor;
use cyanometer::chain::{CameraSetup, uniform_frame};
use cyanometer::error::Result;
use cyanometer::metadata::{FrameHeader, Scene};
use cyanometer::numerics::moments::Moments;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::MemoryFrame;

/// The head of a frame of expected electrons, columns and rows; `uniform` are those of a uniform scene.
pub fn head(sensor: &Sensor, size: [usize; 2], uniform: Option<[f64; 3]>) -> FrameHeader {
    let source = "a study held in memory";
    setup(sensor).planes(size, uniform.map_or_else(|| Scene::of(source), |electrons| Scene::uniform(source, electrons)))
}

/// The camera of all studies: a sensor at the exposure of the paper.
pub fn setup(sensor: &Sensor) -> CameraSetup {
    CameraSetup::new(sensor.clone(), EXPOSURE)
}

/// Three planes of a uniform scene, expected electrons of R, G, B.
///
/// # Errors
///
/// None: three planes are behind no filter array.
pub fn uniform(sensor: &Sensor, size: [usize; 2], electrons: [f64; 3]) -> Result<MemoryFrame> {
    uniform_frame(head(sensor, size, Some(electrons)), electrons)
}

/// One exposure: temporal noise by `seed`, patterns by `sensor_seed`.
///
/// # Errors
///
/// That the frame is not one of expected electrons.
pub fn exposed(expected: &MemoryFrame, seed: u64, sensor_seed: u64) -> Result<MemoryFrame> {
    let settings = NoiseSettings { seed, sensor_seed, ..NoiseSettings::default() };
    Ok(expected.through(&AddNoise::new(&expected.header, &settings)?)?.0)
}

/// Codes of electrons.
///
/// # Errors
///
/// That the frame is not one of electrons.
pub fn codes(electrons: &MemoryFrame) -> Result<MemoryFrame> {
    Ok(electrons.through(&Digitize::new(&electrons.header, &AdcSettings::default())?)?.0)
}

/// The plane behind the sensor's filter array.
///
/// # Errors
///
/// That the frame has not three planes.
pub fn mosaicked(frame: &MemoryFrame) -> Result<MemoryFrame> {
    Ok(frame.through(&Mosaic::new(&frame.header, None)?)?.0)
}

/// A demosaicked plane, above black.
///
/// # Errors
///
/// That the frame is not behind a filter array.
pub fn demosaicked(plane: &MemoryFrame, method: Method) -> Result<MemoryFrame> {
    Ok(plane.through(&Demosaic::new(&plane.header, method, Black::Auto, None)?)?.0)
}

/// Colors of demosaicked codes.
///
/// # Errors
///
/// That the frame has no codes above black.
pub fn colors(rgb: &MemoryFrame, settings: &ColorSettings) -> Result<MemoryFrame> {
    Ok(rgb.through(&ToXyz::new(&rgb.header, settings)?)?.0)
}

/// The samples of a frame, row by row, each channel's by itself.
pub fn rows(frame: &MemoryFrame) -> impl Iterator<Item = Vec<&[f32]>> {
    let geometry = &frame.header.geometry;
    frame.samples.chunks_exact(geometry.row_samples()).map(|row| row.chunks_exact(geometry.width).collect())
}

/// Moments of all pixels.
pub fn moments(frame: &MemoryFrame) -> Moments {
    let mut moments = Moments::new(frame.header.geometry.channels.len());
    rows(frame).for_each(|row| moments.add(&row));
    moments
}

/// The standard deviation of a channel; NaN of none.
pub fn std(moments: &Moments, channel: usize) -> f64 {
    moments.std(channel).unwrap_or(f64::NAN)
}

/// The standard deviations of three channels.
pub fn stds(moments: &Moments) -> [f64; 3] {
    [0, 1, 2].map(|channel| std(moments, channel))
}

/// The middle value; NaN of none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
