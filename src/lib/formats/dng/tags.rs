//! Tags of DNG by their names, and their numbers checked.

use crate::error::{Error, Result};
use crate::formats::tiff::{Directory, ExtraTag, TagValue, TiffFile};
use tiff::tags::Tag;

/// A tag and what the specification calls it.
#[derive(Debug, Clone, Copy)]
pub(super) struct DngTag(u16, pub &'static str);

pub(super) const ORIENTATION: DngTag = DngTag(274, "Orientation");
pub(super) const X_POSITION: DngTag = DngTag(286, "XPosition");
pub(super) const Y_POSITION: DngTag = DngTag(287, "YPosition");
pub(super) const SUB_IFDS: DngTag = DngTag(330, "SubIFDs");
pub(super) const CFA_REPEAT: DngTag = DngTag(33421, "CFARepeatPatternDim");
pub(super) const CFA_PATTERN: DngTag = DngTag(33422, "CFAPattern");
pub(super) const EXPOSURE_TIME: DngTag = DngTag(33434, "ExposureTime");
pub(super) const F_NUMBER: DngTag = DngTag(33437, "FNumber");
pub(super) const SHUTTER_SPEED_VALUE: DngTag = DngTag(37377, "ShutterSpeedValue");
pub(super) const APERTURE_VALUE: DngTag = DngTag(37378, "ApertureValue");
pub(super) const PHOTOGRAPHIC_SENSITIVITY: DngTag = DngTag(34855, "PhotographicSensitivity");
pub(super) const ISO_SPEED: DngTag = DngTag(34867, "ISOSpeed");
pub(super) const EXIF: DngTag = DngTag(34665, "Exif IFD");
pub(super) const DNG_VERSION: DngTag = DngTag(50706, "DNGVersion");
pub(super) const DNG_BACKWARD_VERSION: DngTag = DngTag(50707, "DNGBackwardVersion");
pub(super) const CFA_PLANE_COLOR: DngTag = DngTag(50710, "CFAPlaneColor");
pub(super) const CFA_LAYOUT: DngTag = DngTag(50711, "CFALayout");
pub(super) const LINEARIZATION_TABLE: DngTag = DngTag(50712, "LinearizationTable");
pub(super) const BLACK_REPEAT: DngTag = DngTag(50713, "BlackLevelRepeatDim");
pub(super) const BLACK_LEVEL: DngTag = DngTag(50714, "BlackLevel");
pub(super) const BLACK_DELTA_H: DngTag = DngTag(50715, "BlackLevelDeltaH");
pub(super) const BLACK_DELTA_V: DngTag = DngTag(50716, "BlackLevelDeltaV");
pub(super) const WHITE_LEVEL: DngTag = DngTag(50717, "WhiteLevel");
pub(super) const DEFAULT_CROP_ORIGIN: DngTag = DngTag(50719, "DefaultCropOrigin");
pub(super) const DEFAULT_CROP_SIZE: DngTag = DngTag(50720, "DefaultCropSize");
pub(super) const COLOR_MATRICES: [DngTag; 3] =
    [DngTag(50721, "ColorMatrix1"), DngTag(50722, "ColorMatrix2"), DngTag(52531, "ColorMatrix3")];
pub(super) const FORWARD_MATRICES: [DngTag; 3] =
    [DngTag(50964, "ForwardMatrix1"), DngTag(50965, "ForwardMatrix2"), DngTag(52532, "ForwardMatrix3")];
pub(super) const CAMERA_CALIBRATIONS: [DngTag; 3] =
    [DngTag(50723, "CameraCalibration1"), DngTag(50724, "CameraCalibration2"), DngTag(52530, "CameraCalibration3")];
pub(super) const ANALOG_BALANCE: DngTag = DngTag(50727, "AnalogBalance");
pub(super) const AS_SHOT_NEUTRAL: DngTag = DngTag(50728, "AsShotNeutral");
pub(super) const AS_SHOT_WHITE_XY: DngTag = DngTag(50729, "AsShotWhiteXY");
pub(super) const BASELINE_EXPOSURE: DngTag = DngTag(50730, "BaselineExposure");
pub(super) const LINEAR_RESPONSE_LIMIT: DngTag = DngTag(50734, "LinearResponseLimit");
pub(super) const COLORIMETRIC_REFERENCE: DngTag = DngTag(50879, "ColorimetricReference");
pub(super) const NOISE_REDUCTION_APPLIED: DngTag = DngTag(50935, "NoiseReductionApplied");
pub(super) const CALIBRATION_ILLUMINANTS: [DngTag; 3] = [
    DngTag(50778, "CalibrationIlluminant1"),
    DngTag(50779, "CalibrationIlluminant2"),
    DngTag(52529, "CalibrationIlluminant3"),
];
pub(super) const ILLUMINANT_DATA: [DngTag; 3] =
    [DngTag(52533, "IlluminantData1"), DngTag(52534, "IlluminantData2"), DngTag(52535, "IlluminantData3")];
/// Of the camera, of the profile.
pub(super) const CALIBRATION_SIGNATURES: [DngTag; 2] =
    [DngTag(50931, "CameraCalibrationSignature"), DngTag(50932, "ProfileCalibrationSignature")];
pub(super) const SUB_TILE_BLOCK: DngTag = DngTag(50974, "SubTileBlockSize");
pub(super) const ROW_INTERLEAVE: DngTag = DngTag(50975, "RowInterleaveFactor");
pub(super) const COLUMN_INTERLEAVE: DngTag = DngTag(52547, "ColumnInterleaveFactor");
pub(super) const MASKED_AREAS: DngTag = DngTag(50830, "MaskedAreas");
pub(super) const ACTIVE_AREA: DngTag = DngTag(50829, "ActiveArea");
pub(super) const OPCODES: [DngTag; 3] =
    [DngTag(51008, "OpcodeList1"), DngTag(51009, "OpcodeList2"), DngTag(51022, "OpcodeList3")];

// Light sources of Exif.
pub(super) const UNKNOWN_LIGHT: u16 = 0;
pub(super) const D65: u16 = 21;

// Those that are written only.
pub(super) const NEW_SUBFILE_TYPE: DngTag = DngTag(254, "NewSubfileType");
pub(super) const MAKE: DngTag = DngTag(271, "Make");
pub(super) const MODEL: DngTag = DngTag(272, "Model");
pub(super) const UNIQUE_CAMERA_MODEL: DngTag = DngTag(50708, "UniqueCameraModel");
pub(super) const DEFAULT_SCALE: DngTag = DngTag(50718, "DefaultScale");
pub(super) const COLOR_MATRIX_1: DngTag = DngTag(50721, "ColorMatrix1");
pub(super) const CALIBRATION_ILLUMINANT_1: DngTag = DngTag(50778, "CalibrationIlluminant1");
pub(super) const EXIF_VERSION: DngTag = DngTag(36864, "ExifVersion");
pub(super) const PREVIEW_COLOR_SPACE: DngTag = DngTag(50970, "PreviewColorSpace");
pub(super) const NOISE_PROFILE: DngTag = DngTag(51041, "NoiseProfile");
pub(super) const NEW_RAW_IMAGE_DIGEST: DngTag = DngTag(51111, "NewRawImageDigest");

impl DngTag {
    /// The tag with a value, to be written.
    pub fn with(self, value: TagValue) -> ExtraTag {
        ExtraTag { number: self.0, value }
    }

    pub fn tag(self) -> Tag {
        Tag::from_u16_exhaustive(self.0)
    }

    /// Whether the tag is there.
    pub fn is_in(self, directory: &Directory) -> bool {
        directory.has(self.tag())
    }

    /// Complaints about the tag by its name.
    fn by_name(self, error: Error) -> Error {
        match error {
            Error::Format { file, problem } => {
                let problem = problem.replace(&format!("{:?}", self.tag()), self.1);
                Error::Format { file, problem }
            }
            other => other,
        }
    }

    /// Its numbers; none where it is missing.
    ///
    /// # Errors
    ///
    /// When they lie outside the file, are none, or are not finite: ratios whose divisor is zero.
    pub fn numbers(self, file: &mut TiffFile, directory: &Directory, at_most: u64) -> Result<Option<Vec<f64>>> {
        let found = file.numbers(directory, self.tag(), at_most).map_err(|error| self.by_name(error))?;
        let Some(numbers) = found else { return Ok(None) };
        if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
            let what = if number.is_nan() { "0/0" } else { "divided by zero" };
            return Err(file.problem(format!("it is damaged; its tag {} has a number that is {what}", self.1)));
        }
        if numbers.is_empty() {
            return Err(file.problem(format!("it is damaged; its tag {} has no value", self.1)));
        }
        Ok(Some(numbers))
    }

    /// So many numbers.
    ///
    /// # Errors
    ///
    /// As [`Self::numbers`]; when there are fewer or more.
    pub fn exactly<const N: usize>(self, file: &mut TiffFile, directory: &Directory) -> Result<Option<[f64; N]>> {
        let Some(numbers) = self.numbers(file, directory, N as u64 + 1)? else { return Ok(None) };
        let count = numbers.len();
        <[f64; N]>::try_from(numbers).map(Some).map_err(|_| {
            let has = if count > N { format!("more than {N} numbers") } else { format!("{count} of {N} numbers") };
            file.problem(format!("it is damaged; its tag {} has {has}", self.1))
        })
    }

    /// So many levels, or more that are all alike, as some cameras write one for each of their classes.
    ///
    /// # Errors
    ///
    /// As [`Self::numbers`]; when there are fewer, or more that differ.
    pub fn levels(self, file: &mut TiffFile, directory: &Directory, count: usize) -> Result<Option<Vec<f64>>> {
        /// Levels that are looked at; no filter array has more sites.
        const MOST: usize = 1 << 12;
        let Some(mut numbers) = self.numbers(file, directory, MOST as u64 + 1)? else { return Ok(None) };
        let found = numbers.len();
        let are_alike = found <= MOST && numbers.iter().all(|number| *number == numbers[0]);
        if found < count || (found > count && !are_alike) {
            let has = if found > MOST { "more".to_owned() } else { found.to_string() };
            return Err(file.problem(format!(
                "it is damaged; its {} has {has} numbers, and {count} {} asked for{}",
                self.1,
                if count == 1 { "is" } else { "are" },
                if self.0 == BLACK_LEVEL.0 { " by BlackLevelRepeatDim" } else { "" }
            )));
        }
        numbers.truncate(count);
        Ok(Some(numbers))
    }

    /// So many whole numbers that are not negative.
    ///
    /// # Errors
    ///
    /// As [`Self::exactly`]; when one is no such number.
    pub fn whole<const N: usize>(self, file: &mut TiffFile, directory: &Directory) -> Result<Option<[usize; N]>> {
        let Some(numbers) = self.exactly::<N>(file, directory)? else { return Ok(None) };
        if let Some(number) = numbers.iter().find(|number| number.fract() != 0.0 || !(0.0..4.3e9).contains(*number)) {
            return Err(file.problem(format!("it is damaged; its tag {} has {number}, no whole number", self.1)));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole and of 32 bits")]
        Ok(Some(numbers.map(|number| number as usize)))
    }

    /// One whole number.
    ///
    /// # Errors
    ///
    /// As [`Self::whole`].
    pub fn one(self, file: &mut TiffFile, directory: &Directory) -> Result<Option<usize>> {
        Ok(self.whole::<1>(file, directory)?.map(|[number]| number))
    }

    /// All of its unsigned numbers or bytes.
    ///
    /// # Errors
    ///
    /// When they lie outside the file or are not of such a type.
    pub fn unsigned(self, file: &mut TiffFile, directory: &Directory, at_most: u64) -> Result<Option<Vec<u64>>> {
        file.unsigned(directory, self.tag(), at_most).map_err(|error| self.by_name(error))
    }
}
