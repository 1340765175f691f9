//! The brightest white of a camera, to which the colors of an evaluation refer.

use crate::camera::sensor::Sensor;
use crate::color::matrix;
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use nalgebra::Vector3;

/// The luminance at which equal signals reach the top code, by the matrix of the sensor's own file: a matrix that is
/// judged shall not set the white that it is judged by. None for a sensor without one.
///
/// # Errors
///
/// [`Error::Data`] where the dark signal of the exposure leaves no codes for light.
pub(super) fn luminance(sensor: &Sensor, camera: &FrameHeader) -> Result<Option<f64>> {
    let metadata = &camera.metadata;
    let levels = metadata.white_level_adu.zip(metadata.uniform_black_adu());
    let range = levels.map(|(white, black)| white.less([black; 3]).classes());
    let (Some(range), Some(own), Some(exposure)) = (range, sensor.xyz_from_camera, metadata.exposure) else {
        return Ok(None);
    };
    let luminance = (matrix(&own) / exposure.exposure_s_sr() * Vector3::from(range)).y;
    if luminance > 0.0 {
        return Ok(Some(luminance));
    }
    let problem = format!(
        "in {} s the dark signal fills the range of the codes, and no white saturates the camera; expose for a shorter time",
        exposure.exposure_s
    );
    Err(Error::Data(problem).give(&["white_luminance"]))
}
