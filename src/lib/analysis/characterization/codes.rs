//! The codes that a matrix was fitted to, and what XYZ are off by of codes that stand for other light.

use super::{CameraMatrix, RELATIVE_MATRIX_UNIT};
use crate::camera::levels::OF_ONE_SCALE;
use crate::metadata::{CameraSettings, Metadata};
use crate::text::in_decimals;

/// Numbers that differ by no more of themselves are one, written with other digits.
const SAME_NUMBER: f64 = 1e-6;
/// Ranges that differ by no more of themselves are one: a black level that is measured frame by frame moves them by less.
const SAME_RANGE: f64 = 0.01;

impl CameraMatrix {
    /// A matrix that was fitted to the codes of a frame, where it was one, with `range_adu` between black and white, where that is
    /// known. Gain and sensitivity are kept where XYZ hang on them, which relative ones do not.
    pub fn of_codes(
        unit: &str,
        xyz_from_camera: [[f64; 3]; 3],
        frame: Option<&Metadata>,
        range_adu: Option<f64>,
    ) -> Self {
        let frame = frame.filter(|_| unit != RELATIVE_MATRIX_UNIT);
        Self {
            adu_per_e: frame.and_then(Metadata::adu_per_e),
            iso_speed: frame.and_then(|frame| frame.iso_speed).filter(|speed| *speed > 0.0 && speed.is_finite()),
            camera_settings: frame.and_then(|frame| frame.camera_settings.clone()),
            range_adu,
            ..Self::bare(unit, xyz_from_camera)
        }
    }

    /// What XYZ are off by, in words, of codes that are described so: of another gain or sensitivity, or of another range between black
    /// and white, than those that the matrix was fitted to. What either does not tell is not looked at.
    pub fn doubts_of_codes(&self, codes: &Metadata) -> Vec<String> {
        let gain = self.doubt_of_gain(codes.adu_per_e()).or_else(|| self.doubt_of_setting(codes));
        gain.into_iter().chain(self.doubt_of_range(codes)).collect()
    }

    /// Of codes of another slope in ADU per e⁻.
    fn doubt_of_gain(&self, adu_per_e: Option<f64>) -> Option<String> {
        let [own, other] = unlike(self.adu_per_e.filter(|_| !self.is_relative()), adu_per_e, SAME_NUMBER)?;
        let ratio = other / own;
        Some(format!(
            "is for {own} ADU per electron, and the codes have {other}: XYZ come out {ratio:.4} times what they are"
        ))
    }

    /// Of codes of a camera that was set to another gain, in its own units.
    fn doubt_of_setting(&self, codes: &Metadata) -> Option<String> {
        if self.is_relative() {
            return None;
        }
        let own = self.camera_settings.clone().unwrap_or_default();
        let others = codes.camera_settings.clone().unwrap_or_default();
        if let Some([own, other]) = unlike(own.e_per_adu, others.e_per_adu, SAME_NUMBER) {
            let ratio = own / other;
            return Some(format!(
                "was fitted to codes of {own} electrons per ADU, and the frame has {other}: XYZ come out {ratio:.4} times what they are"
            ));
        }
        if let Some([own, other]) = unlike(self.iso_speed, codes.iso_speed, SAME_NUMBER) {
            let ratio = other / own;
            return Some(format!(
                "was fitted at ISO {own}, and the frame has ISO {other}: XYZ come out {ratio:.4} times what they are, as far as codes \
                 go with it"
            ));
        }
        // The offset is part of the black level, which comes off.
        let settings = CameraSettings { e_per_adu: None, offset: None, ..own };
        if let Some([own, other]) = settings.other_filter(&others) {
            return Some(format!(
                "was fitted to a frame through the filter `{own}`, and this one is through `{other}`: XYZ are off as its light is"
            ));
        }
        let (what, own, other) = settings.other_than(&others)?;
        Some(format!(
            "was fitted to a frame whose {what} is {own}, and that of this one is {other}: XYZ are off as codes are"
        ))
    }

    /// Of codes of another range between black and white. Relative XYZ are made of codes divided by it; absolute ones are made of the
    /// codes themselves, of which other numbers of bits make another scale.
    fn doubt_of_range(&self, codes: &Metadata) -> Option<String> {
        let black = codes.uniform_black_adu();
        let range_adu = codes.white_level_adu.zip(black).map(|(white, black)| white.range_above(black));
        let apart = if self.is_relative() { SAME_RANGE } else { 0.0 };
        let [own, other] = unlike(self.range_adu, range_adu, apart)?;
        let [shown_own, shown_other] = [own, other].map(|range| in_decimals(range, 2));
        if self.is_relative() {
            let ratio = own / other;
            return Some(format!(
                "was fitted to codes with {shown_own} ADU from black to white, and the codes have {shown_other}, by which they are \
                 divided: XYZ come out {ratio:.4} times what they are, unless codes go with that range"
            ));
        }
        let ratio = other / own;
        let is_scale_known = self.adu_per_e.is_some() && codes.adu_per_e().is_some();
        (!is_scale_known && ratio.max(ratio.recip()) > OF_ONE_SCALE).then(|| {
            format!(
                "was fitted to codes with {shown_own} ADU from black to white, and the codes have {shown_other}: XYZ come out {ratio:.4} \
                 times what they are if codes go with that range"
            )
        })
    }
}

/// Two numbers where both are known and above 0, and further apart than this share of the first.
fn unlike(own: Option<f64>, other: Option<f64>, apart: f64) -> Option<[f64; 2]> {
    let (own, other) = own.zip(other)?;
    (own > 0.0 && other > 0.0 && (other / own - 1.0).abs() > apart).then_some([own, other])
}

#[cfg(test)]
mod tests {
    use super::super::MATRIX_UNIT;
    use super::*;
    use crate::units::QuantityKind;

    const DIAGONAL: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// Codes of a camera at ISO 100, black at 512 and white so much above it.
    fn codes(range_adu: f64) -> Metadata {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.iso_speed = Some(100.0);
        metadata.black_level_adu = Some(512.0.into());
        metadata.white_level_adu = Some((512.0 + range_adu).into());
        metadata
    }

    fn fitted(unit: &str, frame: &Metadata) -> CameraMatrix {
        CameraMatrix::of_codes(unit, DIAGONAL, Some(frame), Some(4000.0))
    }

    #[test]
    fn another_sensitivity_is_told_of_absolute_xyz_alone() {
        let faster = Metadata { iso_speed: Some(800.0), ..codes(4000.0) };
        let absolute = fitted(MATRIX_UNIT, &codes(4000.0));
        assert_eq!(
            absolute.doubts_of_codes(&faster),
            [
                "was fitted at ISO 100, and the frame has ISO 800: XYZ come out 8.0000 times what they are, as far as codes go with it"
            ]
        );
        let silent: [Metadata; 3] =
            [codes(4000.0), Metadata { iso_speed: None, ..codes(4000.0) }, Metadata::new(QuantityKind::Adu)];
        for metadata in silent {
            assert_eq!(absolute.doubts_of_codes(&metadata), [""; 0]);
        }
        let relative = fitted(RELATIVE_MATRIX_UNIT, &codes(4000.0));
        assert_eq!((relative.iso_speed, relative.range_adu), (None, Some(4000.0)));
        assert_eq!(relative.doubts_of_codes(&faster), [""; 0]);
        assert_eq!(CameraMatrix::bare(MATRIX_UNIT, DIAGONAL).doubts_of_codes(&faster), [""; 0]);
    }

    #[test]
    fn other_settings_are_told_by_their_factor_where_there_is_one() {
        let set = |gain, e_per_adu, offset| {
            let settings = CameraSettings { gain: Some(gain), e_per_adu, offset: Some(offset), ..Default::default() };
            Metadata { iso_speed: None, camera_settings: Some(settings), ..codes(4000.0) }
        };
        let told = |own: &Metadata, other: &Metadata| fitted(MATRIX_UNIT, own).doubts_of_codes(other).join("; ");
        let own = set(0.0, Some(1.0), 10.0);
        assert_eq!(told(&own, &set(0.0, Some(1.0), 50.0)), "");
        assert!(told(&own, &set(120.0, Some(0.25), 10.0)).ends_with("XYZ come out 4.0000 times what they are"));
        let told = told(&own, &set(120.0, None, 10.0));
        assert!(told.contains("gain in units of the camera is 0, and that of this one is 120"), "{told}");
    }

    /// Codes that are divided by the range of their frame are off by any other range; undivided ones by another scale.
    #[test]
    fn another_range_is_told() {
        let relative = fitted(RELATIVE_MATRIX_UNIT, &codes(4000.0));
        let absolute = fitted(MATRIX_UNIT, &codes(4000.0));
        for (range_adu, of_relative, of_absolute) in [
            (4000.0, "", ""),
            (4039.0, "", ""),
            (4100.0, "XYZ come out 0.9756 times", ""),
            (16_000.0, "XYZ come out 0.2500 times", "XYZ come out 4.0000 times"),
            (1000.0, "XYZ come out 4.0000 times", "XYZ come out 0.2500 times"),
        ] {
            for (matrix, expected) in [(&relative, of_relative), (&absolute, of_absolute)] {
                let told = matrix.doubts_of_codes(&codes(range_adu)).join("; ");
                let names_both = told.contains("with 4000 ADU") && told.contains(&format!("codes have {range_adu}"));
                assert!(told.contains(expected) && told.is_empty() == expected.is_empty(), "{range_adu}: {told}");
                assert_eq!(names_both, !told.is_empty(), "{range_adu}: {told}");
            }
        }
        assert_eq!(CameraMatrix::bare(RELATIVE_MATRIX_UNIT, DIAGONAL).doubts_of_codes(&codes(16_000.0)), [""; 0]);
    }
}
