//! Color: CIE XYZ, xyY, L*a*b* and a viewable sRGB; differences; loci. Knows no camera.

pub mod adaptation;
pub mod calibration;
pub mod coordinates;
pub mod difference;
pub mod illuminant;
pub mod locus;
pub mod luv;
pub mod ramp;
pub mod rgb;
pub mod saturation;
pub mod temperature;
pub mod upsampling;

use crate::names::Named;
use nalgebra::{Matrix3, Vector3};
use std::fmt;

/// A color space that frames are given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// Absolute XYZ, Y in cd m⁻².
    Xyz,
    /// Chromaticities x, y and luminance Y in cd m⁻².
    Xyy,
    /// CIE 1976 L*a*b*.
    Lab,
    /// CIE 1976 L*u*v*.
    Luv,
    /// Correlated color temperature in K, distance from black bodies Duv, luminance Y in cd m⁻².
    Cct,
    /// sRGB for viewing.
    Srgb,
    /// Linear light of the primaries of sRGB, white 1, signed and not clipped.
    LinearSrgb,
}

impl Named for Space {
    const ALL: &'static [Self] = &[Self::Xyz, Self::Xyy, Self::Lab, Self::Luv, Self::Cct, Self::Srgb, Self::LinearSrgb];

    fn name(self) -> &'static str {
        match self {
            Self::Xyz => "xyz",
            Self::Xyy => "xyy",
            Self::Lab => "lab",
            Self::Luv => "luv",
            Self::Cct => "cct",
            Self::Srgb => "srgb",
            Self::LinearSrgb => "linear-srgb",
        }
    }
}

impl fmt::Display for Space {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Xyz => "XYZ",
            Self::Xyy => "xyY",
            Self::Lab => "L*a*b*",
            Self::Luv => "L*u*v*",
            Self::Cct => "CCT, Duv, Y",
            Self::Srgb => "sRGB",
            Self::LinearSrgb => "linear sRGB",
        })
    }
}

/// The white that L*a*b*, L*u*v* and sRGB refer to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum White {
    /// Chromaticity of D65; the luminance is chosen apart.
    #[default]
    D65,
    /// That of D50.
    D50,
    /// Chromaticity of equal energy, (⅓, ⅓).
    EqualEnergy,
    /// Another chromaticity, x and y.
    Chromaticity([f64; 2]),
    /// Absolute XYZ.
    Absolute([f64; 3]),
}

impl fmt::Display for White {
    /// As options have it: `d65`, `d50`, `e`, or X,Y,Z.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::D65 => f.write_str("d65"),
            Self::D50 => f.write_str("d50"),
            Self::EqualEnergy => f.write_str("e"),
            Self::Chromaticity([x, y]) => write!(f, "of x {x:.4}, y {y:.4}"),
            Self::Absolute([x, y, z]) => write!(f, "{x},{y},{z}"),
        }
    }
}

impl White {
    /// The white of a chromaticity, by its name where it has one.
    pub fn of_chromaticity(xy: [f64; 2]) -> Self {
        let named = [(D65_XY, Self::D65), (D50_XY, Self::D50), ([1.0 / 3.0; 2], Self::EqualEnergy)];
        let is_it = |known: [f64; 2]| (known[0] - xy[0]).abs().max((known[1] - xy[1]).abs()) < 1e-6;
        named.into_iter().find(|(known, _)| is_it(*known)).map_or(Self::Chromaticity(xy), |(_, white)| white)
    }

    /// Its XYZ where it has this luminance; those given outright stay.
    pub fn xyz(self, luminance: f64) -> [f64; 3] {
        match self {
            Self::Absolute(white) => white,
            Self::Chromaticity(xy) => xyz_of_chromaticity(xy, luminance),
            Self::D65 => xyz_of_chromaticity(D65_XY, luminance),
            Self::D50 => xyz_of_chromaticity(D50_XY, luminance),
            Self::EqualEnergy => xyz_of_chromaticity([1.0 / 3.0; 2], luminance),
        }
    }
}

/// Chromaticity of D65 for the 2° observer, as IEC 61966-2-1 has it.
pub const D65_XY: [f64; 2] = [0.3127, 0.3290];

/// Chromaticity of D50 for the 2° observer.
pub const D50_XY: [f64; 2] = [0.3457, 0.3585];

/// Primaries of sRGB, red, green, blue, and its white [IEC 61966-2-1].
pub const SRGB_PRIMARIES: [[f64; 2]; 4] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65_XY];

/// Linear sRGB from XYZ of unit white luminance, of the primaries and the white of sRGB exactly; the four decimals of IEC 61966-2-1
/// leave white at 0.9998, 1.0001, 1.0001.
const SRGB_FROM_XYZ: Matrix3<f64> = Matrix3::new(
    3.240_969_941_904_521_3,
    -1.537_383_177_570_093_5,
    -0.498_610_760_293_003_3,
    -0.969_243_636_280_879_8,
    1.875_967_501_507_720_6,
    0.041_555_057_407_175_61,
    0.055_630_079_696_993_61,
    -0.203_976_958_888_976_57,
    1.056_971_514_242_878_6,
);

/// The cone responses of the Bradford transform \[Lam1985].
const BRADFORD: Matrix3<f64> = Matrix3::new(
    0.8951, 0.2664, -0.1614, //
    -0.7502, 1.7135, 0.0367, //
    0.0389, -0.0685, 1.0296,
);

/// XYZ of a chromaticity at a luminance.
pub fn xyz_of_chromaticity([x, y]: [f64; 2], luminance: f64) -> [f64; 3] {
    [luminance * x / y, luminance, luminance * (1.0 - x - y) / y]
}

/// The chromaticity of XYZ.
pub fn chromaticity([x, y, z]: [f64; 3]) -> [f64; 2] {
    let sum = x + y + z;
    [x / sum, y / sum]
}

/// xyY of XYZ; where X + Y + Z is not above zero there is no chromaticity, and that of `white` stands in.
pub fn xyy_from_xyz([x, y, z]: [f64; 3], white: [f64; 2]) -> [f64; 3] {
    let sum = x + y + z;
    if sum > 0.0 { [x / sum, y / sum, y] } else { [white[0], white[1], y] }
}

/// CIE 1976 L*a*b* of XYZ about a white [CIE 015, Eqs. 8.3–8.8]; the straight part of f goes on below zero, where noise
/// may lead.
pub fn lab_from_xyz(xyz: [f64; 3], white: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |index: usize| {
        let t = xyz[index] / white[index];
        if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [fx, fy, fz] = [f(0), f(1), f(2)];
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// XYZ of CIE 1976 L*a*b* about a white, the inverse of [`lab_from_xyz`].
pub fn xyz_from_lab([lightness, a, b]: [f64; 3], white: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let fy = (lightness + 16.0) / 116.0;
    let f = [fy + a / 500.0, fy, fy - b / 200.0];
    [0, 1, 2].map(|i| {
        let t = if f[i] > DELTA { f[i].powi(3) } else { 3.0 * DELTA * DELTA * (f[i] - 4.0 / 29.0) };
        white[i] * t
    })
}

/// What a curved space does to small changes of XYZ about one color.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local {
    /// The color itself in that space.
    pub value: [f64; 3],
    /// Derivatives: rows are the space's coordinates, columns X, Y, Z.
    pub jacobian: Matrix3<f64>,
    /// Second derivatives of each coordinate.
    pub hessian: [Matrix3<f64>; 3],
}

impl Local {
    /// How far the mean of noisy colors lies from the color, to second order: ½ tr(H Σ).
    pub fn bias(&self, covariance: &Matrix3<f64>) -> [f64; 3] {
        self.hessian.map(|hessian| 0.5 * hessian.component_mul(covariance).sum())
    }
}

/// The share of white below which L*a*b* is straight in XYZ: (6/29)³.
pub const LAB_STRAIGHT_BELOW: f64 = 216.0 / 24_389.0;

/// L*a*b* about a color.
pub fn lab_about(xyz: [f64; 3], white: [f64; 3]) -> Local {
    const DELTA: f64 = 6.0 / 29.0;
    let derivatives = |i: usize| {
        let t = xyz[i] / white[i];
        let (first, second) = if t > DELTA.powi(3) {
            let root = t.cbrt();
            (1.0 / (3.0 * root * root), -2.0 / (9.0 * root.powi(5)))
        } else {
            (1.0 / (3.0 * DELTA * DELTA), 0.0)
        };
        [first / white[i], second / white[i].powi(2)]
    };
    let [x, y, z] = [0, 1, 2].map(derivatives);
    let jacobian = Matrix3::new(
        0.0,
        116.0 * y[0],
        0.0, //
        500.0 * x[0],
        -500.0 * y[0],
        0.0, //
        0.0,
        200.0 * y[0],
        -200.0 * z[0],
    );
    let diagonal = |a: f64, b: f64, c: f64| Matrix3::from_diagonal(&Vector3::new(a, b, c));
    let hessian = [
        diagonal(0.0, 116.0 * y[1], 0.0),
        diagonal(500.0 * x[1], -500.0 * y[1], 0.0),
        diagonal(0.0, 200.0 * y[1], -200.0 * z[1]),
    ];
    Local { value: lab_from_xyz(xyz, white), jacobian, hessian }
}

/// xyY about a color; none where X + Y + Z is not above zero.
pub fn xyy_about([x, y, z]: [f64; 3]) -> Option<Local> {
    let sum = x + y + z;
    if !(sum > 0.0 && sum.is_finite()) {
        return None;
    }
    let value = [x / sum, y / sum, y];
    let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    // x = X/S: ∂ᵢ = (δ − x)/S, ∂ᵢⱼ = (2x − δᵢ − δⱼ)/S², with δ = 1 for the numerator's own stimulus.
    let first = |k: usize, i: usize| (unit(k, i) - value[k]) / sum;
    let second = |k: usize, i: usize, j: usize| (2.0 * value[k] - unit(k, i) - unit(k, j)) / (sum * sum);
    let jacobian = Matrix3::from_fn(|k, i| if k < 2 { first(k, i) } else { unit(1, i) });
    let hessian = [0, 1, 2].map(|k| if k < 2 { Matrix3::from_fn(|i, j| second(k, i, j)) } else { Matrix3::zeros() });
    Some(Local { value, jacobian, hessian })
}

/// The transfer curve of sRGB from linear light 0…1 [IEC 61966-2-1].
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Linear light of a value of sRGB, the inverse of [`srgb_encode`] [IEC 61966-2-1].
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The matrix to linear sRGB from absolute XYZ under a white that shall look white: Bradford adaptation to D65.
pub fn linear_srgb_from_xyz(white: [f64; 3]) -> Matrix3<f64> {
    let source = BRADFORD * Vector3::from(white) / white[1];
    let target = BRADFORD * Vector3::from(xyz_of_chromaticity(D65_XY, 1.0));
    let gains = Matrix3::from_diagonal(&target.component_div(&source));
    // The constant matrix is far from singular.
    let back = BRADFORD.try_inverse().unwrap_or_else(Matrix3::identity);
    SRGB_FROM_XYZ * back * gains * BRADFORD / white[1]
}

/// A 3×3 matrix row by row, as files and metadata have it.
pub fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

/// A 3×3 matrix as its rows, the inverse of [`matrix`].
pub fn rows_of(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)]))
}

/// Chromaticities of the primaries that a matrix implies (XYZ of its columns) and of their sum; none where one has none.
pub fn implied_primaries(xyz_from_camera: &[[f64; 3]; 3]) -> Option<[[f64; 2]; 4]> {
    let matrix = matrix(xyz_from_camera);
    let chromaticity = |xyz: Vector3<f64>| {
        let sum = xyz.sum();
        (sum.abs() > f64::EPSILON * xyz.abs().sum()).then(|| [xyz.x / sum, xyz.y / sum])
    };
    let column = |j| chromaticity(matrix.column(j).into_owned());
    Some([column(0)?, column(1)?, column(2)?, chromaticity(matrix.column_sum())?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_white_is_white_in_every_space() {
        for white in [[95.047, 100.0, 108.883], [3000.0, 3000.0, 3000.0], [109.85, 100.0, 35.585]] {
            let lab = lab_from_xyz(white, white);
            assert!((lab[0] - 100.0).abs() < 1e-12 && lab[1].abs() < 1e-12 && lab[2].abs() < 1e-12);
            // The four decimals of the matrix of IEC 61966-2-1 leave 2·10⁻⁴.
            let linear = linear_srgb_from_xyz(white) * Vector3::from(white);
            assert!(linear.iter().all(|v| (v - 1.0).abs() < 3e-4), "{linear}");
        }
    }

    /// Sharma, Wu and Dalal's CIEDE2000 data start from L*a*b*; here the classic check of CIELAB itself: a color of
    /// XYZ (19.01, 20, 21.78) under D65 (95.047, 100, 108.883) is the neutral of L* = 116 · 0.2^⅓ − 16 = 51.837.
    #[test]
    fn neutrals_have_no_chroma_and_the_lightness_of_the_cube_root() {
        let white = [95.047, 100.0, 108.883];
        let lab = lab_from_xyz(white.map(|value| value / 5.0), white);
        assert!((lab[0] - 51.837_211).abs() < 1e-5 && lab[1].abs() < 1e-9 && lab[2].abs() < 1e-9);
        // Below (6/29)³ the curve is a straight line: 24389/27 · t, here t = 0.001.
        let dark = lab_from_xyz(white.map(|value| value / 1000.0), white);
        assert!((dark[0] - 0.903_296_3).abs() < 1e-6);
    }

    /// Both ways round, on both pieces of f and below zero; doubles round to 10⁻¹⁶ of a white of 100.
    #[test]
    fn lab_leads_back_to_xyz() {
        let white = [95.0, 100.0, 108.0];
        for xyz in [[20.0, 30.0, 50.0], [0.1, 0.2, 0.05], [-1.0, 0.0, 3.0], white] {
            let back = xyz_from_lab(lab_from_xyz(xyz, white), white);
            assert!((0..3).all(|i| (back[i] - xyz[i]).abs() < 1e-12 * 100.0), "{xyz:?} {back:?}");
        }
    }

    #[test]
    fn the_srgb_curve_joins_its_two_pieces() {
        assert!((srgb_encode(0.003_130_8) - srgb_encode(0.003_130_800_1)).abs() < 1e-7);
        assert_eq!(srgb_encode(0.0), 0.0);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-15);
        // Middle gray of IEC 61966-2-1: linear 0.2140 is code 127.5/255.
        assert!((srgb_encode(0.214_041_140_482_232_55) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_matrix_implies_its_columns_as_primaries() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let third = 1.0 / 3.0;
        assert_eq!(implied_primaries(&identity), Some([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [third, third]]));
        assert_eq!(implied_primaries(&[[0.0; 3]; 3]), None);
    }
}
