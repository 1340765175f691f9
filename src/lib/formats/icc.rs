//! ICC profiles of TIFF files: which color three samples are, for programs that manage color \[ICC2022].
//!
//! Each is a matrix behind straight lines: v = (s − b) / (w − b) of sample s, black level b and white level w, and
//! XYZ under D50 = A M diag(w − b) v / Y, M to XYZ, Y that of white, A the adaptation from the light's white by Bradford.

use crate::color::adaptation::Adaptation;
use crate::color::{self, D65_XY, SRGB_PRIMARIES};
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::units::QuantityKind;
use moxcms::{ColorProfile, LocalizableString, Matrix3d, ProfileText, ToneReprCurve, Xyzd};
use nalgebra::{Matrix3, Vector3};

/// Slopes of the lines that 16 bits behind the point still tell to 1 in 10³, and more than which no file has.
const SLOPES: std::ops::Range<f64> = 1.0 / 64.0..65_536.0;

/// The white of the profile connection space \[ICC2022, 7.2.16].
const D50: [f64; 3] = [0.9642, 1.0, 0.8249];
/// Where a profile has the time at which it was made, and the day on which the specification was published: year, month, day,
/// hour, minute, second in two bytes each.
const DATE_PLACE: std::ops::Range<usize> = 24..36;
const DATE: [u8; 12] = [0x07, 0xe6, 0, 5, 0, 1, 0, 0, 0, 0, 0, 0];

/// What the samples of three planes are.
struct Light {
    words: &'static str,
    /// Relative XYZ of v, Y = 1 for white.
    xyz_from_shares: Matrix3<f64>,
    /// Samples of no light and of white.
    range: [[f64; 2]; 3],
    white_xy: [f64; 2],
}

/// The profile of a frame whose samples are stored times `scale`, as shares of `full`; none of what is not three planes of
/// known color, or is stored so that viewers would show black or white alone.
///
/// # Errors
///
/// [`Error::Data`] where the crate does not write the profile.
pub(super) fn profile(frame: &FrameHeader, scale: f64, full: f64) -> Result<Option<Vec<u8>>> {
    if !frame.has_three_planes() {
        return Ok(None);
    }
    let mut profile = ColorProfile::new_srgb();
    // The crate's are the cones of Bradford, not what adapts D65 to D50, and a tag that calls its codes narrow.
    profile.cicp = None;
    let adapted = Adaptation::Bradford.between(D65_XY, color::chromaticity(D50)).ok();
    profile.chromatic_adaptation = adapted.map(|matrix| Matrix3d { v: color::rows_of(&matrix) });
    profile.description = Some(text("sRGB"));
    profile.copyright = Some(text("No copyright, use freely"));
    if frame.metadata.quantity != QuantityKind::Srgb {
        let Some(light) = Light::of(frame) else { return Ok(None) };
        let lines = light.range.map(|[black, white]| {
            let slope = full / scale / (white - black);
            [slope, -black / (white - black)]
        });
        if !lines.iter().all(|[slope, _]| SLOPES.contains(slope)) {
            return Ok(None);
        }
        let Ok(adapt) = Adaptation::Bradford.between(light.white_xy, color::chromaticity(D50)) else { return Ok(None) };
        light.describe(&mut profile, &adapt, lines);
    }
    let [x, y, z] = D50;
    profile.white_point = Xyzd { x, y, z };
    profile.media_white_point = Some(profile.white_point);
    let encoded = profile.encode();
    let mut bytes =
        encoded.map_err(|error| Error::Data(format!("{}: no ICC profile can be made: {error}", frame.name)))?;
    // The crate puts the time in; files of the same frame have the same bytes.
    bytes.get_mut(DATE_PLACE).ok_or_else(|| Error::Data("an ICC profile is too short".into()))?.copy_from_slice(&DATE);
    Ok(Some(bytes))
}

impl Light {
    fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        match metadata.quantity {
            QuantityKind::LinearSrgb => Some(Self {
                words: "linear sRGB",
                xyz_from_shares: color::rgb::xyz_from_rgb(&SRGB_PRIMARIES, color::xyz_of_chromaticity(D65_XY, 1.0))?,
                range: [[0.0, 1.0]; 3],
                white_xy: D65_XY,
            }),
            QuantityKind::Xyz => {
                let white = metadata.color.as_ref()?.white?;
                Some(Self {
                    words: "CIE XYZ",
                    xyz_from_shares: Matrix3::identity(),
                    range: [[0.0, white[1]]; 3],
                    white_xy: color::chromaticity(white),
                })
            }
            QuantityKind::Adu if metadata.cfa.is_none() => Self::of_camera(frame),
            _ => None,
        }
    }

    /// Sensor RGB by the frame's own matrix, or that of its sensor, under whose light nothing is known but D65.
    fn of_camera(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let (matrix, white_xy) = match (&metadata.relative_matrix, &metadata.sensor) {
            (Some(relative), _) => (relative.xyz_from_camera, relative.white_xy),
            (None, sensor) => (sensor.as_ref()?.xyz_from_camera?, D65_XY),
        };
        let black = metadata.uniform_black_adu().unwrap_or(0.0);
        let range = metadata.white_level_adu?.classes().map(|white| [black, white]);
        let signals = Vector3::from(range.map(|[black, white]| white - black));
        let xyz_from_camera = color::matrix(&matrix) * Matrix3::from_diagonal(&signals);
        let white = xyz_from_camera.column_sum();
        let is_sound = white.y > 0.0 && white.y.is_finite() && signals.min() > 0.0;
        is_sound.then(|| Self { words: "sensor RGB", xyz_from_shares: xyz_from_camera / white.y, range, white_xy })
    }

    fn describe(&self, profile: &mut ColorProfile, adapt: &Matrix3<f64>, lines: [[f64; 2]; 3]) {
        let colorants = adapt * self.xyz_from_shares;
        let colorant = |j: usize| Xyzd { x: colorants[(0, j)], y: colorants[(1, j)], z: colorants[(2, j)] };
        [profile.red_colorant, profile.green_colorant, profile.blue_colorant] = [0, 1, 2].map(colorant);
        // Straight on both sides of 0, (aX + b)ᵍ + e above d and cX + f below \[ICC2022, Table 68]: of the curve that ends at 0 nothing is left
        // of what noise makes negative. Codes have such below their black alone, and there darktable takes no other curve.
        #[expect(clippy::cast_possible_truncation, reason = "the profile holds 16 bits behind the point")]
        let curve = |[slope, offset]: [f64; 2]| match offset == 0.0 {
            true => [1.0, slope, 0.0, slope, 0.0, 0.0, 0.0].map(|parameter| parameter as f32).to_vec(),
            false => [1.0, slope, offset].map(|parameter| parameter as f32).to_vec(),
        };
        let curves = lines.map(|line| Some(ToneReprCurve::Parametric(curve(line))));
        [profile.red_trc, profile.green_trc, profile.blue_trc] = curves;
        profile.chromatic_adaptation = Some(Matrix3d { v: color::rows_of(adapt) });
        profile.description = Some(text(self.words));
    }
}

/// A text of an even number of letters: the crate sets one tag right behind another, and each has to begin at a multiple of four
/// bytes \[ICC2022, 7.3.1].
fn text(words: &str) -> ProfileText {
    let padding = if words.encode_utf16().count() % 2 == 1 { " " } else { "" };
    let text = LocalizableString::new("en".into(), "US".into(), format!("{words}{padding}"));
    ProfileText::Localizable(vec![text])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;

    /// libpng refuses others, and with them the picture.
    #[test]
    fn tags_begin_at_multiples_of_four() {
        for quantity in [QuantityKind::Srgb, QuantityKind::LinearSrgb] {
            let (geometry, metadata) = (Geometry::new(1, 1, &["R", "G", "B"]), Metadata::new(quantity));
            let frame = FrameHeader { name: "frame".into(), geometry, metadata };
            let bytes = profile(&frame, 1.0, 1.0).unwrap().unwrap();
            let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).unwrap();
            let number = |at: usize| u32::from_be_bytes(word(at)) as usize;
            assert_eq!(number(0), bytes.len());
            let tags = (0..number(128)).map(|tag| 132 + 12 * tag);
            assert!(tags.clone().all(|tag| number(tag + 4).is_multiple_of(4)));
            assert!(tags.clone().all(|tag| number(tag + 4) + number(tag + 8) <= bytes.len()));
            assert_eq!(bytes, profile(&frame, 1.0, 1.0).unwrap().unwrap());
            // The sum of the colorants is the white of the connection space, to the 16 bits behind the point.
            let colorants = [b"rXYZ", b"gXYZ", b"bXYZ"].map(|name| {
                let tag = tags.clone().find(|tag| bytes[*tag..*tag + 4] == name[..]).unwrap();
                [8, 12, 16].map(|place| f64::from(i32::from_be_bytes(word(number(tag + 4) + place))) / 65_536.0)
            });
            for (axis, white) in D50.into_iter().enumerate() {
                let sum: f64 = colorants.iter().map(|colorant| colorant[axis]).sum();
                assert!((sum - white).abs() < 3e-4, "{quantity}: {axis}: {sum}");
            }
        }
    }
}
