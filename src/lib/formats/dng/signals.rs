//! The colors of a camera as a DNG tells them.

use crate::color::{D65_XY, linear_srgb_from_xyz, matrix, rows_of, xyz_of_chromaticity};
use nalgebra::Vector3;

/// What leads from XYZ to the signals of a camera, and from these to a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CameraColor {
    /// Signals of R, G and B from XYZ, scaled so that the largest of the signals of D65 with Y = 1 is 1 \[DNG2023,
    /// ColorMatrix1].
    pub camera_from_xyz: [[f64; 3]; 3],
    /// The signals of D65, the largest 1.
    pub neutral: [f64; 3],
    /// Linear sRGB from signals; the neutral is white.
    pub srgb_from_camera: [[f64; 3]; 3],
}

impl CameraColor {
    /// Those of a matrix of any scale; none where it has no inverse, or daylight no signal in a class.
    pub fn of(xyz_from_camera: &[[f64; 3]; 3]) -> Option<Self> {
        let white = xyz_of_chromaticity(D65_XY, 1.0);
        let inverse = matrix(xyz_from_camera).try_inverse()?;
        let signals = inverse * Vector3::from(white);
        let largest = signals.max();
        if !signals.iter().all(|signal| *signal > 0.0 && signal.is_finite()) {
            return None;
        }
        let camera_from_xyz = inverse / largest;
        let srgb_from_camera = linear_srgb_from_xyz(white) * matrix(xyz_from_camera) * largest;
        Some(Self {
            camera_from_xyz: rows_of(&camera_from_xyz),
            neutral: (signals / largest).into(),
            srgb_from_camera: rows_of(&srgb_from_camera),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn daylight_is_neutral_and_white() {
        let xyz_from_camera = [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]];
        let color = CameraColor::of(&xyz_from_camera).unwrap();
        let white = Vector3::from(xyz_of_chromaticity(D65_XY, 1.0));
        let neutral = Vector3::from(color.neutral);
        assert!(
            (matrix(&color.camera_from_xyz) * white - neutral).amax() < 1e-12 && (neutral.max() - 1.0).abs() < 1e-15
        );
        // The matrix of sRGB has four decimals.
        assert!((matrix(&color.srgb_from_camera) * neutral).add_scalar(-1.0).amax() < 2e-4);
        let scaled = CameraColor::of(&xyz_from_camera.map(|row| row.map(|x| 7.0 * x))).unwrap();
        assert!((Vector3::from(scaled.neutral) - neutral).amax() < 1e-12);
    }

    #[test]
    fn what_tells_no_colors_is_left_out() {
        assert_eq!(CameraColor::of(&[[1.0; 3]; 3]), None);
        assert_eq!(CameraColor::of(&[[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), None);
        assert_eq!(CameraColor::of(&[[f64::NAN; 3]; 3]), None);
    }
}
