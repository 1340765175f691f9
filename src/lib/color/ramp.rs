//! Colors for numbers: equal steps of a number look equal.

use super::{D65_XY, linear_srgb_from_xyz, srgb_encode, xyz_from_lab, xyz_of_chromaticity};
use nalgebra::Vector3;

/// CIE L\*a\*b\* of the lowest and of the highest number: a dark blue and a yellow.
const ENDS: [[f64; 3]; 2] = [[18.0, 24.0, -48.0], [92.0, -12.0, 88.0]];

/// Steps of a ramp: what eight bits can tell apart.
pub const STEPS: usize = 256;

/// The ramp as codes of sRGB: a straight line in CIE L\*a\*b\* under D65, in equal steps.
///
/// L\*a\*b\* (t) = (18, 24, −48) (1 − t) + (92, −12, 88) t
///
/// Every step is the same ΔE\*ab, 159.9/255, and lightness rises by the same amount, so that it stays in order in print without
/// color; from blue over gray to yellow it does so for those who do not tell red from green, too. The ends are the points of sRGB
/// that are the farthest apart, to steps of 2 in L\* and b\* and 4 in a\*, of those whose line stays within sRGB.
pub fn ramp() -> Vec<[u8; 3]> {
    let white = xyz_of_chromaticity(D65_XY, 1.0);
    let to_srgb = linear_srgb_from_xyz(white);
    let color = |step: usize| {
        let t = step as f64 / (STEPS - 1) as f64;
        let lab = [0, 1, 2].map(|i| ENDS[0][i] * (1.0 - t) + ENDS[1][i] * t);
        let linear = to_srgb * Vector3::from(xyz_from_lab(lab, white));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
        let code = |value: f64| (srgb_encode(value.clamp(0.0, 1.0)) * 255.0).round() as u8;
        linear.map(code).into()
    };
    (0..STEPS).map(color).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{lab_from_xyz, rgb::NamedPrimaries, rgb::xyz_from_rgb, srgb_decode};
    use super::*;
    use crate::color::difference::delta_e_76;

    /// Codes are off by at most ½ of 255, which is at most 1.2 ΔE*ab in the blue, where L*a*b* is the steepest.
    #[test]
    fn equal_steps_look_equal_and_lightness_rises() {
        let white = xyz_of_chromaticity(D65_XY, 1.0);
        let to_xyz = xyz_from_rgb(&NamedPrimaries::Srgb.chromaticities(), white).unwrap();
        let lab = |rgb: [u8; 3]| {
            let linear = Vector3::from(rgb.map(|code| srgb_decode(f64::from(code) / 255.0)));
            lab_from_xyz((to_xyz * linear).into(), white)
        };
        let colors: Vec<[f64; 3]> = ramp().into_iter().map(lab).collect();
        let whole = delta_e_76(colors[0], colors[255]);
        assert!((whole - 159.9).abs() < 1.5, "{whole}");
        for from in (0..=204).step_by(17) {
            let step = delta_e_76(colors[from], colors[from + 51]);
            assert!((step / (whole / 5.0) - 1.0).abs() < 0.07, "from {from}: {step}");
        }
        // Three steps are 0.87 of lightness; half a code of green is at most 0.25.
        assert!(colors.windows(4).all(|pair| pair[3][0] > pair[0][0]));
    }

    #[test]
    fn the_ends_are_those_stated() {
        let ramp = ramp();
        assert_eq!((ramp.len(), ramp[0], ramp[255]), (256, [0x04, 0x24, 0x73], [0xfe, 0xeb, 0x1b]));
    }
}
