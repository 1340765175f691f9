//! Colour: from camera signals to CIE XYZ and on to xyY, L*a*b* and a viewable sRGB.

pub mod comparison;
pub mod difference;
pub mod locus;

use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{ColorRecord, FrameHeader};
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::propagation::pixels::{self, PixelNoise};
use crate::stage::{Counts, Stage};
use crate::units::{Adu, QuantityKind, Tristimulus};
use nalgebra::{Matrix3, Vector3};
use std::fmt;

/// A colour space that frames are given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// Absolute XYZ, Y in cd m⁻².
    Xyz,
    /// Chromaticities x, y and luminance Y in cd m⁻².
    Xyy,
    /// CIE 1976 L*a*b*.
    Lab,
    /// sRGB for viewing.
    Srgb,
}

impl fmt::Display for Space {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Xyz => "XYZ",
            Self::Xyy => "xyY",
            Self::Lab => "L*a*b*",
            Self::Srgb => "sRGB",
        })
    }
}

/// The white that L*a*b* and sRGB refer to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum White {
    /// Chromaticity of D65; the luminance is chosen apart.
    D65,
    /// Chromaticity of equal energy, (⅓, ⅓).
    EqualEnergy,
    /// Absolute XYZ.
    Absolute([f64; 3]),
}

/// Chromaticity of D65 for the 2° observer, as IEC 61966-2-1 has it.
pub const D65_XY: [f64; 2] = [0.3127, 0.3290];

/// Linear sRGB from XYZ of unit white luminance [IEC 61966-2-1].
const SRGB_FROM_XYZ: Matrix3<f64> = Matrix3::new(
    3.2406, -1.5372, -0.4986, //
    -0.9689, 1.8758, 0.0415, //
    0.0557, -0.2040, 1.0570,
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

/// What a curved space does to small changes of XYZ about one colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local {
    /// The colour itself in that space.
    pub value: [f64; 3],
    /// Derivatives: rows are the space's coordinates, columns X, Y, Z.
    pub jacobian: Matrix3<f64>,
    /// Second derivatives of each coordinate.
    pub hessian: [Matrix3<f64>; 3],
}

impl Local {
    /// How far the mean of noisy colours lies from the colour, to second order: ½ tr(H Σ).
    pub fn bias(&self, covariance: &Matrix3<f64>) -> [f64; 3] {
        self.hessian.map(|hessian| 0.5 * hessian.component_mul(covariance).sum())
    }
}

/// L*a*b* about a colour.
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

/// xyY about a colour; none where X + Y + Z is not above zero.
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
fn rows_of(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
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

/// What a user may set of the conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorSettings {
    /// The matrix, XYZ from black-free ADU per s sr.
    pub xyz_from_camera: [[f64; 3]; 3],
    /// How it was fitted, for the record.
    pub method: Option<String>,
    /// The space.
    pub space: Space,
    /// The white of L*a*b* and sRGB.
    pub white: White,
    /// Luminance of a white that is given by its chromaticity, cd m⁻²; that at which the camera saturates where none is
    /// given.
    pub white_luminance: Option<f64>,
}

/// Turns demosaicked ADU into colours.
///
/// x = M ρ / H        ρ: ADU above black; H = t π T / (4N² + 1)        [HP2005, Eq. 18, per exposure]
#[derive(Debug, Clone)]
pub struct ToXyz {
    header: FrameHeader,
    space: Space,
    /// XYZ from ADU above black, exposure included.
    xyz_from_adu: Matrix3<f64>,
    black: f64,
    white: [f64; 3],
    srgb_from_xyz: Matrix3<f64>,
    sigma: Option<PixelNoise>,
}

/// Channels of the layer of covariances of XYZ.
pub const COVARIANCE_LAYER: [&str; 6] =
    ["covariance.XX", "covariance.XY", "covariance.XZ", "covariance.YY", "covariance.YZ", "covariance.ZZ"];

impl ToXyz {
    /// The conversion of `input`.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless the frame holds three planes of ADU; [`Error::MissingKey`] without exposure;
    /// [`Error::Usage`] for an impossible white.
    pub fn new(input: &FrameHeader, settings: &ColorSettings) -> Result<Self> {
        let holds = input.holds();
        match input.metadata.quantity {
            QuantityKind::Adu | QuantityKind::Unspecified => {}
            QuantityKind::Electrons | QuantityKind::ExpectedElectrons => {
                return Err(input.out_of_order(format!("it holds {holds}, not ADU"), "digitize"));
            }
            _ => return Err(input.refuse(format!("it holds {holds}: it is converted already"))),
        }
        if input.metadata.cfa.is_some() || input.geometry.channels.len() == 1 {
            return Err(input.out_of_order(format!("it holds {holds}, not three classes at each pixel"), "demosaic"));
        }
        if !input.has_three_planes() {
            return Err(input.refuse(format!("it holds {holds}; a camera has the three planes R, G and B")));
        }
        let exposure = input.exposure()?;
        let black = input.metadata.black_level_adu.unwrap_or(0.0);
        let xyz_from_adu = matrix(&settings.xyz_from_camera) / exposure.exposure_s_sr();
        let needs_white = matches!(settings.space, Space::Lab | Space::Srgb);
        let mut known_white = true;
        let white = match settings.white {
            White::Absolute(white) => white,
            White::D65 | White::EqualEnergy => {
                let xy = if settings.white == White::D65 { D65_XY } else { [1.0 / 3.0, 1.0 / 3.0] };
                let at_saturation = || -> Option<f64> {
                    let range = input.metadata.white_level_adu? - black;
                    Some((xyz_from_adu * Vector3::repeat(range)).y)
                };
                let luminance = match settings.white_luminance.or_else(at_saturation) {
                    Some(luminance) => luminance,
                    None if needs_white => {
                        return Err(input.missing("white_level_adu", "--white-luminance CD_PER_M2"));
                    }
                    None => {
                        known_white = false;
                        1.0
                    }
                };
                xyz_of_chromaticity(xy, luminance)
            }
        };
        if needs_white && !white.iter().all(|&value| value > 0.0 && value.is_finite()) {
            return Err(Error::Usage(format!(
                "a white of XYZ {:.6} {:.6} {:.6} is impossible; all three must be above 0",
                white[0], white[1], white[2]
            )));
        }
        let (quantity, channels) = match settings.space {
            Space::Xyz => (QuantityKind::Xyz, ["R", "G", "B"]),
            Space::Xyy => (QuantityKind::Xyy, ["x", "y", "Y"]),
            Space::Lab => (QuantityKind::Lab, ["L", "a", "b"]),
            Space::Srgb => (QuantityKind::Srgb, ["R", "G", "B"]),
        };
        let mut metadata = input.metadata.becoming(quantity);
        metadata.black_level_adu = None;
        metadata.white_level_adu = None;
        metadata.color = Some(ColorRecord {
            xyz_from_camera: settings.xyz_from_camera,
            method: settings.method.clone(),
            black_adu: black,
            white: known_white.then_some(white),
        });
        let geometry = input.geometry.with_channels(&channels);
        let srgb_from_xyz = if needs_white { linear_srgb_from_xyz(white) } else { Matrix3::identity() };
        let header = FrameHeader { name: input.name.clone(), geometry, metadata };
        Ok(Self { header, space: settings.space, xyz_from_adu, black, white, srgb_from_xyz, sigma: None })
    }

    /// Adds a layer with the standard deviation of each channel of each pixel, and for XYZ one with the six covariances,
    /// from the sensor's noise model at the level of the pixel in `input`. xyY and L*a*b* are taken to first order.
    ///
    /// # Errors
    ///
    /// Those of [`PixelNoise::of`]; [`Error::Usage`] for sRGB, a picture.
    pub fn with_sigma(mut self, input: &FrameHeader) -> Result<Self> {
        let layer = match self.space {
            Space::Xyz => ["sigma.R", "sigma.G", "sigma.B"],
            Space::Xyy => ["sigma.x", "sigma.y", "sigma.Y"],
            Space::Lab => ["sigma.L", "sigma.a", "sigma.b"],
            Space::Srgb => {
                return Err(Error::Usage(
                    "--sigma gives the uncertainty of xyz, xyy or lab; srgb is a picture to look at".into(),
                ));
            }
        };
        self.sigma = Some(PixelNoise::of(input)?);
        // In the order in which files have layers.
        let channels = &mut self.header.geometry.channels;
        if self.space == Space::Xyz {
            channels.extend(COVARIANCE_LAYER.map(str::to_owned));
        }
        channels.extend(layer.map(str::to_owned));
        Ok(self)
    }

    /// Fills the layers of a pixel, each plane `width` long; gives whether propagation holds.
    fn fill_sigma(
        &self,
        noise: &PixelNoise,
        [x, y, width]: [usize; 3],
        rgb: [f64; 3],
        xyz: [f64; 3],
        planes: &mut [f32],
    ) -> bool {
        let (camera, holds) = noise.covariance([x, y], rgb);
        let of_xyz = pixels::through(&camera, &self.xyz_from_adu);
        let covariance = match self.space {
            Space::Lab => pixels::through(&of_xyz, &lab_about(xyz, self.white).jacobian),
            Space::Xyy => xyy_about(xyz).map_or([0.0; 6], |local| pixels::through(&of_xyz, &local.jacobian)),
            Space::Xyz | Space::Srgb => of_xyz,
        };
        let covariances = if self.space == Space::Xyz { &covariance[..] } else { &[] };
        let layers = covariances.iter().copied().chain(pixels::stds(&covariance));
        for (plane, value) in layers.enumerate() {
            planes[plane * width + x] = to_sample(value);
        }
        holds
    }

    /// The head of the converted frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// What [`Stage::apply`] does, on one set of instructions; the bits are the same on all of them.
    pub fn apply_on(
        &self,
        instructions: Instructions,
        input: Window<'_, Adu>,
        mut output: Rows<'_, Tristimulus>,
    ) -> Counts {
        let mut counts = Counts::default();
        if self.space == Space::Xyz && self.sigma.is_none() {
            let xyz_from_adu = rows_of(&self.xyz_from_adu);
            for y in output.range() {
                let rgb = [0, 1, 2].map(|channel| input.row(y.cast_signed(), channel));
                let (black, xyz) = (self.black, output.three(y));
                counts.not_finite += vectors::run_on(instructions, XyzRow { xyz_from_adu, black, rgb, xyz });
            }
            return counts;
        }
        let white_sum: f64 = self.white.iter().sum();
        let white_xy = [self.white[0] / white_sum, self.white[1] / white_sum];
        for y in output.range() {
            let planes = [0, 1, 2].map(|channel| input.row(y.cast_signed(), channel));
            let ([first, second, third], layers) = output.three_and_rest(y);
            for x in 0..input.width() {
                let rgb = planes.map(|plane| f64::from(plane[x]));
                let signal = Vector3::from(rgb.map(|sample| sample - self.black));
                let xyz = self.xyz_from_adu * signal;
                if let Some(noise) = &self.sigma {
                    let holds = self.fill_sigma(noise, [x, y, input.width()], rgb, xyz.into(), layers);
                    counts.propagation_void += u64::from(!holds);
                }
                let color = match self.space {
                    Space::Xyz => xyz.into(),
                    Space::Xyy => xyy_from_xyz(xyz.into(), white_xy),
                    Space::Lab => lab_from_xyz(xyz.into(), self.white),
                    Space::Srgb => {
                        let linear = self.srgb_from_xyz * xyz;
                        counts.out_of_gamut += u64::from(linear.iter().any(|v| !(-1e-6..=1.0 + 1e-6).contains(v)));
                        <[f64; 3]>::from(linear).map(|v| srgb_encode(v.clamp(0.0, 1.0)))
                    }
                };
                counts.not_finite += u64::from(color.iter().any(|value| !value.is_finite()));
                (first[x], second[x], third[x]) = (to_sample(color[0]), to_sample(color[1]), to_sample(color[2]));
            }
        }
        counts
    }
}

impl Stage for ToXyz {
    type Input = Adu;
    type Output = Tristimulus;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn apply(&self, input: Window<'_, Adu>, output: Rows<'_, Tristimulus>) -> Counts {
        self.apply_on(Instructions::widest(), input, output)
    }
}

/// XYZ of a row, in doubles; gives the pixels that are not finite.
struct XyzRow<'a> {
    xyz_from_adu: [[f64; 3]; 3],
    black: f64,
    rgb: [&'a [f32]; 3],
    xyz: [&'a mut [f32]; 3],
}

impl Kernel for XyzRow<'_> {
    type Output = u64;

    #[inline(always)]
    fn run(self) -> u64 {
        let Self { xyz_from_adu: m, black, rgb: [red, green, blue], xyz: [to_x, to_y, to_z] } = self;
        let width = to_x.len();
        let (red, green, blue) = (&red[..width], &green[..width], &blue[..width]);
        let (to_y, to_z) = (&mut to_y[..width], &mut to_z[..width]);
        let [[rx, gx, bx], [ry, gy, by], [rz, gz, bz]] = m;
        let mut not_finite = 0;
        for index in 0..width {
            let r = f64::from(red[index]) - black;
            let g = f64::from(green[index]) - black;
            let b = f64::from(blue[index]) - black;
            let x = rx * r + gx * g + bx * b;
            let y = ry * r + gy * g + by * b;
            let z = rz * r + gz * g + bz * b;
            not_finite += u64::from(!(x.is_finite() & y.is_finite() & z.is_finite()));
            to_x[index] = to_sample(x);
            to_y[index] = to_sample(y);
            to_z[index] = to_sample(z);
        }
        not_finite
    }
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

    /// Sharma, Wu and Dalal's CIEDE2000 data start from L*a*b*; here the classic check of CIELAB itself: a colour of
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
        // Middle grey of IEC 61966-2-1: linear 0.2140 is code 127.5/255.
        assert!((srgb_encode(0.214_041_140_482_232_55) - 0.5).abs() < 1e-12);
    }

    /// Also where one colour of a pixel is no number, at every place of a vector.
    #[test]
    fn rows_of_xyz_are_the_products_of_the_matrix_on_every_set_of_instructions() {
        let matrix = Matrix3::new(8.7e-4, 4.5e-5, 4.4e-5, 3.7e-4, 3.1e-4, -2.6e-5, 1.0e-4, -1.6e-4, 5.3e-4);
        let plane = |seed: usize| -> Vec<f32> {
            let strange = [f32::NAN, f32::INFINITY, f32::MAX];
            let sample = |x: usize| if x % 37 == seed { strange[x % 3] } else { (x * 7919 % 4096 * seed) as f32 };
            (0..331).map(sample).collect()
        };
        let planes = [1, 2, 3].map(plane);
        for set in Instructions::ALL {
            let mut made = [(); 3].map(|()| vec![0.0; 331]);
            let rgb = planes.each_ref().map(|plane| &plane[..]);
            let xyz = made.each_mut().map(|plane| &mut plane[..]);
            let row = XyzRow { xyz_from_adu: rows_of(&matrix), black: 102.3, rgb, xyz };
            let not_finite = vectors::run_on(set, row);
            let mut expected = 0;
            for x in 0..331 {
                let value = matrix * Vector3::from(planes.each_ref().map(|plane| f64::from(plane[x]) - 102.3));
                expected += u64::from(value.iter().any(|value| !value.is_finite()));
                for (made, value) in made.iter().zip(&value) {
                    let sample = to_sample(*value);
                    assert!(made[x].to_bits() == sample.to_bits() || made[x].is_nan() && sample.is_nan());
                }
            }
            assert_eq!(not_finite, expected);
        }
    }

    #[test]
    fn a_matrix_implies_its_columns_as_primaries() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let third = 1.0 / 3.0;
        assert_eq!(implied_primaries(&identity), Some([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [third, third]]));
        assert_eq!(implied_primaries(&[[0.0; 3]; 3]), None);
    }
}
