//! From demosaicked ADU to CIE XYZ and on to xyY, L*a*b*, L*u*v*, color temperatures and sRGB.

use crate::color::coordinates::Coordinates;
use crate::color::saturation::Saturation;
use crate::color::temperature::Locus;
use crate::color::{Space, White, rows_of};
use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{ColorRecord, FrameHeader, MatrixResidual};
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::stream::{Counts, Stage};
use crate::text::in_decimals;
use crate::units::{Adu, QuantityKind, Tristimulus};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// What a user may set of the conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorSettings {
    /// The matrix, XYZ from black-free ADU per s sr; where it is relative, per share of white level less black level.
    pub xyz_from_camera: [[f64; 3]; 3],
    /// Whether it gives relative XYZ, and no exposure is needed.
    pub is_relative: bool,
    /// How it was fitted, for the record.
    pub method: Option<String>,
    /// How far it is off without noise, for the record.
    pub residual: Option<MatrixResidual>,
    /// The space.
    pub space: Space,
    /// The white of L*a*b* and sRGB.
    pub white: White,
    /// Luminance of a white that is given by its chromaticity, cd m⁻²; that by which the first class saturates where none is
    /// given. Of relative XYZ it is 1, and none can be given.
    pub white_luminance: Option<f64>,
}

/// Turns demosaicked ADU into colors.
///
/// x = M ρ / H        ρ: ADU above black; H = t π T / (4N² + 1)        [HP2005, Eq. 18, per exposure]
///
/// By a relative matrix x = M ρ / (white level − black level), class by class, and Y = 1 is the white by which the first
/// class reaches its white level.
///
/// # Examples
///
/// ```
/// use cyanometer::color::{Space, White};
/// use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
/// use cyanometer::stream::MemoryFrame;
/// # use cyanometer::camera::optics::Exposure;
/// # use cyanometer::formats::data::load_sensor;
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let mut metadata = Metadata::new(QuantityKind::Adu);
/// # metadata.sensor = Some(load_sensor("kaf-5101ce")?.sensor);
/// # metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
/// # metadata.black_level_adu = Some(0.0.into());
/// # let geometry = Geometry::new(1, 1, &["R", "G", "B"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// let settings = ColorSettings {
///     xyz_from_camera: [[2e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 4e-3]],
///     is_relative: false,
///     method: None,
///     residual: None,
///     space: Space::Xyz,
///     white: White::D65,
///     white_luminance: None,
/// };
/// let rgb = MemoryFrame::new(header, vec![100.0, 200.0, 300.0]);
/// let xyz = rgb.through(&ToXyz::new(&rgb.header, &settings)?)?.0;
/// // 33 ms at f/8: H = 0.033 π / (4·8² + 1) s sr, and 0.2 / H cd m⁻².
/// let luminance = 0.2 * 257.0 / (0.033 * std::f32::consts::PI);
/// assert!((xyz.samples[1] / luminance - 1.0).abs() < 1e-6);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ToXyz {
    header: FrameHeader,
    coordinates: Coordinates,
    /// XYZ from ADU above black, the exposure or the range of codes included.
    xyz_from_adu: Matrix3<f64>,
    black: f64,
    /// Whether the luminance of its white is that of equal signals.
    white_stands_in: bool,
}

impl ToXyz {
    /// The conversion of `input`.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless the frame holds three planes of ADU; [`Error::MissingKey`] without black level, or without
    /// exposure where the matrix needs one; [`Error::Usage`] for an impossible white; [`Error::Format`] where the black level
    /// differs among photosites, and without white level above black where the matrix is relative.
    pub fn new(input: &FrameHeader, settings: &ColorSettings) -> Result<Self> {
        Self::beside(input, settings, None)
    }

    /// The same, with the black bodies that [`Space::Cct`] looks for the nearest of; without them its temperatures are NaN.
    ///
    /// # Errors
    ///
    /// Those of [`Self::new`].
    pub fn beside(input: &FrameHeader, settings: &ColorSettings, locus: Option<Arc<Locus>>) -> Result<Self> {
        check_camera(input)?;
        if !settings.is_relative {
            input.exposure()?;
        }
        let black = input.uniform_black_adu()?;
        let range_adu = settings.is_relative.then(|| range(input, black)).transpose()?;
        let mut record = ColorRecord {
            xyz_from_camera: settings.xyz_from_camera,
            range_adu,
            method: settings.method.clone(),
            black_adu: black,
            white: None,
            scene_white_xy: None,
            adapted: None,
            matrix_residual: settings.residual.clone(),
            scene_error: None,
        };
        let scaled = record.xyz_from_adu(input.metadata.exposure);
        let xyz_from_adu = scaled.ok_or_else(|| input.missing("exposure"))?;
        let (white, white_stands_in) = reference_white(input, settings, &xyz_from_adu, black)?;
        record.white = white;
        let Some(white) = record.white.or_else(|| (!needs_white(settings.space)).then(|| settings.white.xyz(1.0)))
        else {
            return Err(input.missing("white_level_adu"));
        };
        check_white(settings.space, white)?;
        let (quantity, channels) = planes_of(settings.space);
        let mut metadata = input.metadata.becoming(quantity);
        metadata.set_black_adu(None);
        metadata.white_level_adu = None;
        metadata.color = Some(record);
        if settings.is_relative {
            metadata.unit = quantity.relative_unit().into();
        }
        let geometry = input.geometry.with_channels(&channels);
        let header = FrameHeader { name: input.name.clone(), geometry, metadata };
        let coordinates = Coordinates::new(settings.space, white, locus);
        Ok(Self { header, coordinates, xyz_from_adu, black, white_stands_in })
    }

    /// The space of the converted frame.
    pub fn space(&self) -> Space {
        self.coordinates.space()
    }

    /// XYZ of the white that L*a*b*, L*u*v* and sRGB refer to.
    pub fn white(&self) -> [f64; 3] {
        self.coordinates.white()
    }

    /// Whether the luminance of the white is that of all classes at the end of their range, for the matrix tells none of the
    /// white itself.
    pub fn white_stands_in(&self) -> bool {
        self.white_stands_in
    }

    /// From XYZ to the coordinates of its space.
    pub fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// XYZ from ADU above black, the exposure or the range of codes included.
    pub fn xyz_from_adu(&self) -> &Matrix3<f64> {
        &self.xyz_from_adu
    }

    /// XYZ of a pixel of the input.
    pub fn xyz(&self, rgb: [f64; 3]) -> Vector3<f64> {
        self.xyz_from_adu * Vector3::from(rgb.map(|sample| sample - self.black))
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
        if self.space() == Space::Xyz {
            let xyz_from_adu = rows_of(&self.xyz_from_adu);
            for y in output.range() {
                let rgb = [0, 1, 2].map(|channel| input.row(y.cast_signed(), channel));
                let (black, xyz) = (self.black, output.three(y));
                counts.not_finite += vectors::run_on(instructions, XyzRow { xyz_from_adu, black, rgb, xyz });
            }
            return counts;
        }
        for y in output.range() {
            let planes = [0, 1, 2].map(|channel| input.row(y.cast_signed(), channel));
            let [first, second, third] = output.three(y);
            for x in 0..input.width() {
                let xyz = self.xyz(planes.map(|plane| f64::from(plane[x])));
                let color = place(&self.coordinates, xyz.into(), &mut counts);
                (first[x], second[x], third[x]) = (to_sample(color[0]), to_sample(color[1]), to_sample(color[2]));
            }
        }
        counts
    }
}

/// The coordinates of XYZ, and what is counted of them.
pub(super) fn place(coordinates: &Coordinates, xyz: [f64; 3], counts: &mut Counts) -> [f64; 3] {
    let placed = coordinates.of(xyz);
    counts.out_of_gamut += u64::from(placed.was_clipped);
    counts.far_above_white += u64::from(placed.is_far_above_white);
    counts.off_locus += u64::from(placed.is_off_locus);
    counts.no_chromaticity += u64::from(placed.has_no_chromaticity);
    // Where there is no temperature, what is no number is counted already.
    let is_finite = placed.value.iter().all(|value| value.is_finite());
    counts.not_finite += u64::from(!is_finite && !placed.is_off_locus);
    placed.value
}

/// What the planes of a space hold, and what they are called.
pub(super) fn planes_of(space: Space) -> (QuantityKind, [&'static str; 3]) {
    match space {
        Space::Xyz => (QuantityKind::Xyz, ["R", "G", "B"]),
        Space::Xyy => (QuantityKind::Xyy, ["x", "y", "Y"]),
        Space::Lab => (QuantityKind::Lab, ["L", "a", "b"]),
        Space::Luv => (QuantityKind::Luv, ["L", "u", "v"]),
        Space::Cct => (QuantityKind::Cct, ["CCT", "Duv", "Y"]),
        Space::Srgb => (QuantityKind::Srgb, ["R", "G", "B"]),
        Space::LinearSrgb => (QuantityKind::LinearSrgb, ["R", "G", "B"]),
    }
}

/// Whether the colors of a space hang on a white.
pub fn needs_white(space: Space) -> bool {
    matches!(space, Space::Lab | Space::Luv | Space::Srgb | Space::LinearSrgb)
}

/// Refuses a white that cannot be, where the space needs one.
pub(super) fn check_white(space: Space, white: [f64; 3]) -> Result<()> {
    if !needs_white(space) || white.iter().all(|&value| value > 0.0 && value.is_finite()) {
        return Ok(());
    }
    let [x, y, z] = white;
    Err(Error::Usage(format!("a white of XYZ {x:.6} {y:.6} {z:.6} is impossible; all three must be above 0")))
}

/// XYZ of the white that colors refer to, and whether equal signals tell its luminance; none where it is that by which the
/// camera saturates, and the white level is unknown.
fn reference_white(
    input: &FrameHeader,
    settings: &ColorSettings,
    xyz_from_adu: &Matrix3<f64>,
    black: f64,
) -> Result<(Option<[f64; 3]>, bool)> {
    if settings.is_relative && settings.white_luminance.is_some() {
        let problem = "the matrix gives relative XYZ, in which the white has Y = 1 and no luminance in cd/m2";
        return Err(Error::Usage(format!("{}: {problem}", input.name)).leave_out(&["white_luminance"]));
    }
    if let White::Absolute(white) = settings.white {
        return Ok((Some(white), false));
    }
    if settings.is_relative {
        return Ok((Some(settings.white.xyz(1.0)), false));
    }
    if let Some(luminance) = settings.white_luminance {
        return Ok((Some(settings.white.xyz(luminance)), false));
    }
    let Some(level) = input.metadata.white_level_adu else { return Ok((None, false)) };
    let saturation = Saturation::of(xyz_from_adu, level.less([black; 3]).classes(), settings.white.xyz(1.0));
    if saturation.luminance > 0.0 {
        return Ok((Some(settings.white.xyz(saturation.luminance)), !saturation.is_of_white));
    }
    if !needs_white(settings.space) {
        return Ok((None, false));
    }
    if level.range_above(black) > 0.0 {
        let problem = "its matrix tells no white by which the camera saturates, and none is named";
        return Err(input.refuse(problem).give(&["white_luminance"]));
    }
    // Without light codes are at their end already.
    let [black, white] = [black, level.range_above(0.0)].map(|level| in_decimals(level, 1));
    let problem = format!(
        "its black level, {black} ADU, is no less than its white level, {white} ADU: no white saturates the camera, and \
         none is named; expose for a shorter time"
    );
    Err(input.refuse(problem).give(&["white_luminance"]))
}

/// White level less black level, for R, G and B.
fn range(input: &FrameHeader, black: f64) -> Result<[f64; 3]> {
    let Some(white) = input.metadata.white_level_adu else {
        return Err(input.refuse(
            "the metadata has no `white_level_adu`, in which relative XYZ are counted; add it to its metadata, or take a \
             matrix for absolute XYZ",
        ));
    };
    let range = white.range_above(black);
    if range > 0.0 && range.is_finite() {
        return Ok([range; 3]);
    }
    Err(input.refuse(format!(
        "its white level, {}, is not above its black level, {black}; relative XYZ are counted between them",
        white.classes().map(|level| level.to_string()).join(", ")
    )))
}

/// Makes sure that a frame holds the three planes of a camera's codes.
fn check_camera(frame: &FrameHeader) -> Result<()> {
    let holds = frame.holds();
    match frame.metadata.quantity {
        QuantityKind::Adu | QuantityKind::Unspecified => {}
        QuantityKind::Electrons | QuantityKind::ExpectedElectrons => {
            return Err(frame.out_of_order(format!("it holds {holds}, not ADU"), "digitize"));
        }
        _ => return Err(frame.refuse(format!("it holds {holds}: it is converted already"))),
    }
    frame.bayer("turned into colors")?;
    if frame.metadata.cfa.is_some() || frame.geometry.channels.len() == 1 {
        return Err(frame.out_of_order(format!("it holds {holds}, not three classes at each pixel"), "demosaic"));
    }
    if !frame.has_three_planes() {
        return Err(frame.refuse(format!("it holds {holds}; a camera has the three planes R, G and B")));
    }
    Ok(())
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

    /// Also where one color of a pixel is no number, at every place of a vector.
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
}
