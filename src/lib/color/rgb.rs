//! RGB of pictures: primaries, encodings, and XYZ under D65 from them.

use super::BRADFORD;
use crate::names::Named;
use nalgebra::{Matrix3, Vector3};

/// Chromaticities (x, y) of the three primaries and of white.
pub type Primaries = [[f64; 2]; 4];

/// Sets of primaries that have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NamedPrimaries {
    /// Those of sRGB and ITU-R BT.709 [IEC 61966-2-1].
    Srgb,
    /// Display P3: those of SMPTE RP 431-2 with the white D65.
    DisplayP3,
    /// Those of ITU-R BT.2020.
    Rec2020,
    /// Those of Adobe RGB (1998).
    AdobeRgb,
    /// AP1, those of ACEScg, white near D60.
    AcesCg,
    /// AP0, those of ACES2065-1, white near D60.
    Aces,
}

impl Named for NamedPrimaries {
    const ALL: &'static [Self] =
        &[Self::Srgb, Self::DisplayP3, Self::Rec2020, Self::AdobeRgb, Self::AcesCg, Self::Aces];

    fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::DisplayP3 => "display-p3",
            Self::Rec2020 => "rec2020",
            Self::AdobeRgb => "adobe-rgb",
            Self::AcesCg => "acescg",
            Self::Aces => "aces",
        }
    }

    fn other_names(self) -> &'static [&'static str] {
        if self == Self::Srgb { &["rec709"] } else { &[] }
    }
}

impl NamedPrimaries {
    /// Their chromaticities.
    pub fn chromaticities(self) -> Primaries {
        const ACES_WHITE: [f64; 2] = [0.321_68, 0.337_67];
        let d65 = super::D65_XY;
        match self {
            Self::Srgb => [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], d65],
            Self::DisplayP3 => [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], d65],
            Self::Rec2020 => [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], d65],
            Self::AdobeRgb => [[0.64, 0.33], [0.21, 0.71], [0.15, 0.06], d65],
            Self::AcesCg => [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044], ACES_WHITE],
            Self::Aces => [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770], ACES_WHITE],
        }
    }

    /// The set of these chromaticities, to the digits that files hold; none of others.
    pub fn of(primaries: &Primaries) -> Option<Self> {
        let is_near = |known: Primaries| {
            known.iter().flatten().zip(primaries.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-4)
        };
        Self::ALL.iter().copied().find(|set| is_near(set.chromaticities()))
    }
}

/// How samples stand for linear light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Encoding {
    /// They are proportional to it.
    Linear,
    /// By the curve of sRGB, continued below zero by its mirror image.
    Srgb,
    /// Light is this power of them, mirrored below zero.
    Power(f64),
}

impl Encoding {
    /// Linear light of a sample, 1 that of full scale.
    pub fn decode(self, sample: f64) -> f64 {
        let magnitude = sample.abs();
        match self {
            Self::Linear => sample,
            Self::Srgb => super::srgb_decode(magnitude).copysign(sample),
            Self::Power(power) => magnitude.powf(power).copysign(sample),
        }
    }
}

impl std::fmt::Display for Encoding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Linear => f.write_str("linear"),
            Self::Srgb => f.write_str("srgb"),
            Self::Power(power) => write!(f, "{power}"),
        }
    }
}

/// The matrix to XYZ about a white of unit luminance from linear RGB of primaries, whose own white becomes that white:
/// adapted by Bradford \[Lam1985], nothing where it is that white already.
///
/// None where the primaries lie on a line or their white is none.
pub fn xyz_from_rgb(primaries: &Primaries, white: [f64; 3]) -> Option<Matrix3<f64>> {
    let [red, green, blue, own] = primaries.map(|[x, y]| Vector3::new(x, y, 1.0 - x - y));
    let columns = Matrix3::from_columns(&[red, green, blue]);
    let own_white = own / own.y;
    let gains = columns.try_inverse()? * own_white;
    let source = BRADFORD * own_white;
    let gains_of_cones = (BRADFORD * Vector3::from(white)).component_div(&source);
    let adapt = BRADFORD.try_inverse()? * Matrix3::from_diagonal(&gains_of_cones) * BRADFORD;
    let matrix = adapt * columns * Matrix3::from_diagonal(&gains);
    let is_sound = matrix.iter().all(|value| value.is_finite()) && source.iter().all(|cone| *cone > 0.0);
    (is_sound && matrix.determinant().abs() > 1e-6).then_some(matrix)
}

#[cfg(test)]
mod tests {
    use super::super::{D65_XY, SRGB_FROM_XYZ, srgb_encode, xyz_of_chromaticity};
    use super::*;

    /// Of the same primaries; and to the four decimals of IEC 61966-2-1, but for the last.
    #[test]
    fn the_matrix_of_srgb_is_that_of_the_standard() {
        let white = xyz_of_chromaticity(D65_XY, 1.0);
        let matrix = xyz_from_rgb(&NamedPrimaries::Srgb.chromaticities(), white).unwrap();
        let product = SRGB_FROM_XYZ * matrix;
        assert!((product - Matrix3::identity()).abs().max() < 1e-14, "{product}");
        let standard = Matrix3::new(3.2406, -1.5372, -0.4986, -0.9689, 1.8758, 0.0415, 0.0557, -0.2040, 1.0570);
        assert!((SRGB_FROM_XYZ - standard).abs().max() < 4e-4);
    }

    #[test]
    fn white_becomes_the_white_of_any_primaries() {
        let white = [0.9504, 1.0, 1.0889];
        for set in NamedPrimaries::ALL {
            let made = xyz_from_rgb(&set.chromaticities(), white).unwrap() * Vector3::repeat(1.0);
            assert!((made - Vector3::from(white)).abs().max() < 1e-12, "{} {made}", set.name());
            assert_eq!(NamedPrimaries::of(&set.chromaticities()), Some(*set));
        }
        assert_eq!(xyz_from_rgb(&[[0.3, 0.3]; 4], white), None);
        let no_white = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3, 0.0]];
        assert_eq!(xyz_from_rgb(&no_white, white), None);
    }

    #[test]
    fn encodings_are_undone() {
        for linear in [0.0, 0.001, 0.003_130_8, 0.2, 1.0, 3.0] {
            assert!((Encoding::Srgb.decode(srgb_encode(linear)) - linear).abs() < 1e-6 * (1.0 + linear));
        }
        assert_eq!(Encoding::Srgb.decode(-0.5), -Encoding::Srgb.decode(0.5));
        assert_eq!((Encoding::Power(2.0).decode(0.5), Encoding::Linear.decode(-7.0)), (0.25, -7.0));
    }
}
