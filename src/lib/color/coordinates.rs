//! From XYZ to the coordinates of a space, and what small changes of XYZ become there.

use super::luv::{luv_about, luv_from_xyz, uv_prime};
use super::temperature::Locus;
use super::{Space, chromaticity, lab_about, lab_from_xyz, linear_srgb_from_xyz, srgb_encode, xyy_about, xyy_from_xyz};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Linear light that is so little outside 0…1 counts as inside: the roundings of the four decimals of the matrix.
const GAMUT_MARGIN: f64 = 1e-6;

/// Colors so many times as bright as white are hardly meant: they have L* = 116·∛10 − 16 = 234.
const FAR_ABOVE_WHITE: f64 = 10.0;

/// A space about a white.
#[derive(Debug, Clone)]
pub struct Coordinates {
    space: Space,
    white: [f64; 3],
    white_xy: [f64; 2],
    srgb_from_xyz: Matrix3<f64>,
    locus: Option<Arc<Locus>>,
}

/// A color in a space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Its coordinates.
    pub value: [f64; 3],
    /// Whether it was clipped to a gamut.
    pub was_clipped: bool,
    /// Whether it is far brighter than the white that it refers to.
    pub is_far_above_white: bool,
    /// Whether it has no correlated color temperature.
    pub is_off_locus: bool,
    /// Whether its coordinates are those of white because it has no chromaticity.
    pub has_no_chromaticity: bool,
}

impl Coordinates {
    /// Those of a space about XYZ of a white; `locus` is for [`Space::Cct`], which gives NaN without.
    pub fn new(space: Space, white: [f64; 3], locus: Option<Arc<Locus>>) -> Self {
        let is_srgb = matches!(space, Space::Srgb | Space::LinearSrgb);
        let srgb_from_xyz = if is_srgb { linear_srgb_from_xyz(white) } else { Matrix3::identity() };
        Self { space, white, white_xy: chromaticity(white), srgb_from_xyz, locus }
    }

    /// The space.
    pub fn space(&self) -> Space {
        self.space
    }

    /// XYZ of the white.
    pub fn white(&self) -> [f64; 3] {
        self.white
    }

    /// The coordinates of XYZ.
    pub fn of(&self, xyz: [f64; 3]) -> Placed {
        let (mut was_clipped, mut is_off_locus) = (false, false);
        let value = match self.space {
            Space::Xyz => xyz,
            Space::Xyy => xyy_from_xyz(xyz, self.white_xy),
            Space::Lab => lab_from_xyz(xyz, self.white),
            Space::Luv => luv_from_xyz(xyz, self.white),
            Space::Cct => {
                let found = self.locus.as_ref().and_then(|locus| locus.beside(xyz));
                is_off_locus = found.is_none();
                found.map_or([f64::NAN, f64::NAN, xyz[1]], |found| [found.temperature_k, found.duv, xyz[1]])
            }
            Space::LinearSrgb => (self.srgb_from_xyz * Vector3::from(xyz)).into(),
            Space::Srgb => {
                let linear = self.srgb_from_xyz * Vector3::from(xyz);
                was_clipped = linear.iter().any(|v| !(-GAMUT_MARGIN..=1.0 + GAMUT_MARGIN).contains(v));
                <[f64; 3]>::from(linear).map(|v| srgb_encode(v.clamp(0.0, 1.0)))
            }
        };
        let refers = matches!(self.space, Space::Lab | Space::Luv | Space::LinearSrgb);
        let is_far_above_white = refers && xyz[1] > FAR_ABOVE_WHITE * self.white[1];
        let is_finite = xyz.iter().all(|value| value.is_finite());
        let has_no_chromaticity = match self.space {
            Space::Xyy => is_finite && xyz.iter().sum::<f64>() <= 0.0,
            Space::Luv => is_finite && uv_prime(xyz).is_none(),
            _ => false,
        };
        Placed { value, was_clipped, is_far_above_white, is_off_locus, has_no_chromaticity }
    }

    /// Variances of the coordinates of a color that has no derivatives, by the variance of its luminance: of a chromaticity that is
    /// that of white for want of one there is no end, and a temperature that is none has none.
    pub fn variances_without_chromaticity(&self, xyz: [f64; 3], of_luminance: f64) -> [f64; 3] {
        match self.space {
            Space::Cct => [f64::NAN, f64::NAN, of_luminance],
            Space::Xyy => [f64::INFINITY, f64::INFINITY, of_luminance],
            Space::Luv => {
                let slope = lab_about(xyz, self.white).jacobian[(0, 1)];
                [slope * slope * of_luminance, f64::INFINITY, f64::INFINITY]
            }
            _ => [0.0; 3],
        }
    }

    /// Derivatives of the coordinates in X, Y and Z at a color; none of a picture to look at, and where the color has no
    /// chromaticity or temperature.
    pub fn jacobian(&self, xyz: [f64; 3]) -> Option<Matrix3<f64>> {
        match self.space {
            Space::Xyz => Some(Matrix3::identity()),
            Space::Xyy => xyy_about(xyz).map(|local| local.jacobian),
            Space::Lab => Some(lab_about(xyz, self.white).jacobian),
            Space::Luv => luv_about(xyz, self.white).map(|local| local.jacobian),
            Space::Cct => {
                let [temperature, duv] = {
                    let found = self.locus.as_ref()?.beside(xyz)?.jacobian;
                    [found.row(0).into_owned(), found.row(1).into_owned()]
                };
                Some(Matrix3::from_rows(&[temperature, duv, nalgebra::RowVector3::new(0.0, 1.0, 0.0)]))
            }
            Space::LinearSrgb => Some(self.srgb_from_xyz),
            Space::Srgb => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// L* of ten times the luminance of white is 116·∛10 − 16 = 233.9 \[CIE15].
    #[test]
    fn colors_far_above_their_white_are_told() {
        let white = [95.0, 100.0, 108.0];
        for space in [Space::Lab, Space::Luv, Space::LinearSrgb, Space::Srgb, Space::Xyz] {
            let coordinates = Coordinates::new(space, white, None);
            let is_told = |factor: f64| coordinates.of(white.map(|value| factor * value)).is_far_above_white;
            let refers = !matches!(space, Space::Srgb | Space::Xyz);
            assert_eq!([0.5, 9.9, 10.1, 100.0].map(is_told), [false, false, refers, refers], "{space:?}");
        }
        let lightest = Coordinates::new(Space::Lab, white, None).of(white.map(|value| 10.0 * value)).value[0];
        assert!((lightest - 233.9).abs() < 0.05, "{lightest}");
    }
}
