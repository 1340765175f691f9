//! The colors of a camera as a DNG tells them.

use super::tags::{D65, UNKNOWN_LIGHT};
use crate::color::{D65_XY, linear_srgb_from_xyz, matrix, rows_of, xyz_of_chromaticity};
use crate::metadata::Metadata;
use nalgebra::Vector3;

/// What leads from XYZ to the signals of a camera, and from these to a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CameraColor {
    /// The light that they are for, as Exif numbers it.
    pub illuminant: u16,
    /// Signals of R, G and B from XYZ, scaled so that the largest of the signals of white with Y = 1 is 1 \[DNG2023,
    /// ColorMatrix1].
    pub camera_from_xyz: [[f64; 3]; 3],
    /// The signals of white, the largest 1.
    pub neutral: [f64; 3],
    /// Linear sRGB from signals; the neutral is white.
    pub srgb_from_camera: [[f64; 3]; 3],
}

impl CameraColor {
    /// Those of the sensor, for D65; or of the raw file that a frame comes from, for the white of its exposure.
    pub fn of_frame(metadata: &Metadata) -> Option<Self> {
        let of_sensor = metadata.sensor.as_ref().and_then(|sensor| sensor.xyz_from_camera);
        let of_raw = metadata.relative_matrix.as_ref();
        let of_raw = || of_raw.and_then(|raw| Self::of(&raw.xyz_from_camera, raw.white_xy, UNKNOWN_LIGHT));
        of_sensor.and_then(|matrix| Self::of(&matrix, D65_XY, D65)).or_else(of_raw)
    }

    /// Those of a matrix of any scale for a white; none where it has no inverse, or white no signal in a class.
    pub fn of(xyz_from_camera: &[[f64; 3]; 3], white_xy: [f64; 2], illuminant: u16) -> Option<Self> {
        let white = xyz_of_chromaticity(white_xy, 1.0);
        let inverse = matrix(xyz_from_camera).try_inverse()?;
        let signals = inverse * Vector3::from(white);
        let largest = signals.max();
        if !signals.iter().all(|signal| *signal > 0.0 && signal.is_finite()) {
            return None;
        }
        let camera_from_xyz = inverse / largest;
        let srgb_from_camera = linear_srgb_from_xyz(white) * matrix(xyz_from_camera) * largest;
        Some(Self {
            illuminant,
            camera_from_xyz: rows_of(&camera_from_xyz),
            neutral: (signals / largest).into(),
            srgb_from_camera: rows_of(&srgb_from_camera),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::data::load_sensor;
    use crate::metadata::RelativeMatrix;
    use crate::units::QuantityKind;

    #[test]
    fn daylight_is_neutral_and_white() {
        let xyz_from_camera = [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]];
        let color = CameraColor::of(&xyz_from_camera, D65_XY, D65).unwrap();
        let white = Vector3::from(xyz_of_chromaticity(D65_XY, 1.0));
        let neutral = Vector3::from(color.neutral);
        assert!(
            (matrix(&color.camera_from_xyz) * white - neutral).amax() < 1e-12 && (neutral.max() - 1.0).abs() < 1e-15
        );
        // The matrix of sRGB has four decimals.
        assert!((matrix(&color.srgb_from_camera) * neutral).add_scalar(-1.0).amax() < 2e-4);
        let scaled = CameraColor::of(&xyz_from_camera.map(|row| row.map(|x| 7.0 * x)), D65_XY, D65).unwrap();
        assert!((Vector3::from(scaled.neutral) - neutral).amax() < 1e-12);
    }

    /// The white of the exposure is the neutral, and white in the picture; a sensor's own matrix comes first.
    #[test]
    fn the_matrix_of_a_raw_file_is_told_for_its_white() {
        let xyz_from_camera = [[1.66, 0.143, 0.175], [0.553, 0.971, -0.329], [-0.027, -0.238, 1.77]];
        let white_xy = [0.338, 0.3686];
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.relative_matrix = Some(RelativeMatrix { xyz_from_camera, white_xy, method: String::new() });
        let color = CameraColor::of_frame(&metadata).unwrap();
        let white = Vector3::from(xyz_of_chromaticity(white_xy, 1.0));
        let neutral = Vector3::from(color.neutral);
        assert!((matrix(&color.camera_from_xyz) * white - neutral).amax() < 1e-12 && color.illuminant == UNKNOWN_LIGHT);
        // The matrix of sRGB has four decimals.
        assert!((matrix(&color.srgb_from_camera) * neutral).add_scalar(-1.0).amax() < 3e-4);
        metadata.sensor = Some(load_sensor("kaf-5101ce").unwrap().sensor);
        let of_sensor = metadata.sensor.as_ref().and_then(|sensor| sensor.xyz_from_camera);
        let illuminant = CameraColor::of_frame(&metadata).unwrap().illuminant;
        assert_eq!(illuminant, if of_sensor.is_some() { D65 } else { UNKNOWN_LIGHT });
    }

    #[test]
    fn what_tells_no_colors_is_left_out() {
        let of = |matrix| CameraColor::of(matrix, D65_XY, D65);
        assert_eq!(of(&[[1.0; 3]; 3]), None);
        assert_eq!(of(&[[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), None);
        assert_eq!(of(&[[f64::NAN; 3]; 3]), None);
    }
}
