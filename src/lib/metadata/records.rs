//! Records of what was done to a frame, one for each program that later ones must know of.

use crate::camera::levels::BlackLevel;
use crate::camera::optics::Exposure;
use crate::cfa::CfaPattern;
use crate::color::{self, adaptation::Adaptation};
use crate::names::{Named, serde_by_name};
use crate::random::Source;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// What the camera looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// File, column or sample, or `--electrons`.
    pub source: String,
    /// Whether every photosite of a class expects the same.
    pub uniform: bool,
    /// Expected signal electrons of R, G and B where the scene is uniform.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_electrons: Option<[f64; 3]>,
    /// XYZ of its spectrum in cd m⁻², which no camera has come near, where the scene is uniform and its spectrum was summed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub true_xyz: Option<[f64; 3]>,
    /// Focal length in mm where natural vignetting was applied.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vignetting_focal_length_mm: Option<f64>,
    /// Photosites that show one pixel of the source, width and height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patch: Option<[usize; 2]>,
    /// Pixels in a row of the source, where each is shown as a patch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_width: Option<usize>,
    /// Largest expected signal of any class in e⁻, where it was worked out for `--expose-to`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brightest_e: Option<f64>,
    /// How spectra were made up, where the source is a picture in RGB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upsampling: Option<UpsamplingRecord>,
}

/// How the spectra of a picture in RGB were made up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UpsamplingRecord {
    /// The method: `jakob-hanika-2019`.
    pub method: String,
    /// How samples stood for linear light: `linear`, `srgb`, or the power of them that it was.
    pub encoding: String,
    /// Chromaticities of the primaries R, G, B and of white.
    pub primaries: [[f64; 2]; 4],
    /// The illuminant that lit the scene.
    pub illuminant: String,
    /// Luminance of R = G = B = 1 in cd m⁻².
    pub white_luminance: f64,
}

impl Scene {
    /// Whether no light fell, as far as it tells.
    pub fn is_dark(&self) -> bool {
        self.expected_electrons == Some([0.0; 3])
    }

    /// A scene of which nothing is known but what it is called.
    pub fn of(source: impl Into<String>) -> Self {
        Self {
            source: source.into(),
            uniform: false,
            expected_electrons: None,
            true_xyz: None,
            vignetting_focal_length_mm: None,
            patch: None,
            source_width: None,
            brightest_e: None,
            upsampling: None,
        }
    }

    /// A scene of which every photosite of a class expects the same signal electrons: of R, G and B.
    pub fn uniform(source: impl Into<String>, electrons: [f64; 3]) -> Self {
        Self { uniform: true, expected_electrons: Some(electrons), ..Self::of(source) }
    }
}

/// How Poisson numbers are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PoissonKind {
    /// Exactly.
    #[default]
    Exact,
    /// As normal numbers of the same mean and variance, to see what that approximation costs.
    Gaussian,
}

impl Named for PoissonKind {
    const ALL: &'static [Self] = &[Self::Exact, Self::Gaussian];

    fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Gaussian => "gaussian",
        }
    }
}

serde_by_name!(PoissonKind);

/// The noise that was drawn, enough to draw it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseRecord {
    /// Sources drawn, in the order of Eq. 9.
    pub sources: Vec<Source>,
    /// Seed of the temporal noise.
    pub seed: u64,
    /// Seed of the fixed patterns.
    pub sensor_seed: u64,
    /// Number of the exposure.
    pub frame: u32,
    /// Temperature of the sensor in K.
    pub temperature_k: f64,
    /// Mean dark signal of a photosite before non-uniformity, Q_DC of Eq. 7, in e⁻.
    pub dark_e: f64,
    /// Mean excess of the dark signal of hot photosites, in e⁻; 0 where there are none.
    #[serde(default, skip_serializing_if = "is_no_charge")]
    pub hot_pixel_e: f64,
    /// How Poisson numbers were drawn.
    pub poisson: PoissonKind,
    /// Share of a packet that each move to the output takes along, where charge transfer was simulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cte: Option<f64>,
    /// Share of the light of each photosite of its column that a packet has as smear; 0 where there is none.
    #[serde(default, skip_serializing_if = "is_no_charge")]
    pub smear_per_row: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
pub(super) fn is_no_charge(value: &f64) -> bool {
    *value == 0.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
pub(super) fn is_false(flag: &bool) -> bool {
    !*flag
}

/// How the missing classes were interpolated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DemosaicRecord {
    /// Method.
    pub method: String,
    /// Pattern of the plane.
    pub cfa: CfaPattern,
    /// What was subtracted first, in the unit of the samples.
    pub black: BlackLevel,
    /// Whether what rows and columns add came off with it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub black_deltas: bool,
    /// Column and row on the sensor of the plane's corner, and its width and height, where several amplifiers have read it: at its
    /// edges pixels are made of what is mirrored there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<[i64; 4]>,
}

/// A camera's matrix for relative XYZ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RelativeMatrix {
    /// Rows X, Y, Z; columns R, G, B: XYZ from shares of white level less black level. The white by which the first class
    /// reaches its white level has Y = 1.
    pub xyz_from_camera: [[f64; 3]; 3],
    /// Chromaticity of that white, the light of the exposure.
    pub white_xy: [f64; 2],
    /// Where it comes from.
    pub method: String,
}

/// What a camera was set to, in its own units, as its file tells it. No number of ours hangs on it, but frames of other settings
/// are not of the same codes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraSettings {
    /// Gain, in units of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<f64>,
    /// What its driver takes for the electrons of an ADU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub e_per_adu: Option<f64>,
    /// Offset of the codes, in units of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// Mode of the read-out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout_mode: Option<String>,
    /// Filter before the sensor, by its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
}

impl CameraSettings {
    /// The first setting in which others differ, as far as both tell it: what it is, and what it is here and there. What codes mean does
    /// not hang on the filter, which is none of these.
    pub fn other_than(&self, others: &Self) -> Option<(&'static str, String, String)> {
        let number = |number: Option<f64>| number.map(|number| number.to_string());
        [
            ("gain in units of the camera", number(self.gain), number(others.gain)),
            ("gain in e-/ADU", number(self.e_per_adu), number(others.e_per_adu)),
            ("offset in units of the camera", number(self.offset), number(others.offset)),
            ("mode of the read-out", self.readout_mode.clone(), others.readout_mode.clone()),
        ]
        .into_iter()
        .find_map(|(what, here, there)| {
            here.zip(there).filter(|(here, there)| here != there).map(|(here, there)| (what, here, there))
        })
    }

    /// The names of the filters here and there, where both are told and differ in more than capitals.
    pub fn other_filter<'a>(&'a self, others: &'a Self) -> Option<[&'a str; 2]> {
        let (here, there) = self.filter.as_deref().zip(others.filter.as_deref())?;
        (!here.eq_ignore_ascii_case(there)).then_some([here, there])
    }
}

/// What a frame was taken as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TakenAs {
    /// A picture of a scene.
    Light,
    /// Without light.
    Dark,
    /// Without light, of next to no exposure.
    Bias,
    /// Of even light.
    Flat,
}

impl TakenAs {
    /// With its article: `a dark frame`.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Light => "a light frame",
            Self::Dark => "a dark frame",
            Self::Bias => "a bias frame",
            Self::Flat => "a flat",
        }
    }
}

/// Variance of codes as a raw file tells it: S x + O over the signal x from 0 at black to 1 at white \[DNG2023, NoiseProfile].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProfileRecord {
    /// S and O of each class; one pair holds for all.
    pub lines: Vec<[f64; 2]>,
    /// ADU from black to white in that file.
    pub range_adu: f64,
}

/// How colors were computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ColorRecord {
    /// The matrix, XYZ per black-free ADU per s sr; where XYZ are relative, per share of [`Self::range_adu`].
    pub xyz_from_camera: [[f64; 3]; 3],
    /// White level less black level of R, G and B, by which signals were divided in place of the exposure; absent where XYZ
    /// are absolute.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_adu: Option<[f64; 3]>,
    /// What it was fitted by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// Black level that was left in the camera's signals and subtracted first, ADU.
    #[serde(default)]
    pub black_adu: f64,
    /// XYZ of the white that Lab and sRGB refer to, on the scale of the frame's XYZ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white: Option<[f64; 3]>,
    /// Chromaticity of the light that the colors are seen under, where it is known: that of the scene, or that which they were
    /// adapted to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_white_xy: Option<[f64; 2]>,
    /// The adaptation from one light to another, which is part of the matrix.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adapted: Option<AdaptationRecord>,
    /// How far the matrix is off without noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix_residual: Option<MatrixResidual>,
    /// Relative error of X, Y and Z that the matrix makes of the scene's own spectrum, without noise, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_error: Option<[f64; 3]>,
}

/// How colors were adapted from one light to another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AdaptationRecord {
    /// The transform.
    pub transform: Adaptation,
    /// Chromaticity of the light that they had.
    pub from_xy: [f64; 2],
    /// Chromaticity of the light that they have now.
    pub to_xy: [f64; 2],
}

impl ColorRecord {
    /// That of XYZ of which no camera is known: the matrix is the identity.
    pub fn of_xyz() -> Self {
        Self {
            xyz_from_camera: color::rows_of(&Matrix3::identity()),
            range_adu: None,
            method: None,
            black_adu: 0.0,
            white: None,
            scene_white_xy: None,
            adapted: None,
            matrix_residual: None,
            scene_error: None,
        }
    }

    /// Notes that XYZ were adapted by a matrix, which becomes part of that of the camera.
    pub fn adapt(&mut self, record: AdaptationRecord, adaptation: &Matrix3<f64>) {
        self.xyz_from_camera = color::rows_of(&(adaptation * color::matrix(&self.xyz_from_camera)));
        self.scene_white_xy = Some(record.to_xy);
        self.adapted = Some(record);
    }

    /// Whether XYZ are relative: Y = 1 for the white by which the first class reaches its white level.
    pub fn is_relative(&self) -> bool {
        self.range_adu.is_some()
    }

    /// XYZ from ADU above black.
    ///
    /// M / H, H the exposure in s sr; where XYZ are relative M diag(1 / (white − black)). None without exposure where one is
    /// needed.
    pub fn xyz_from_adu(&self, exposure: Option<Exposure>) -> Option<Matrix3<f64>> {
        let xyz_from_camera = color::matrix(&self.xyz_from_camera);
        match self.range_adu {
            Some(range) => Some(xyz_from_camera * Matrix3::from_diagonal(&Vector3::from(range.map(f64::recip)))),
            None => Some(xyz_from_camera / exposure?.exposure_s_sr()),
        }
    }
}

/// How far a matrix is off on the spectra that it was judged by, without noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MatrixResidual {
    /// Where the spectra come from.
    pub library: String,
    /// Root of the mean squared relative error of X, Y and Z.
    pub relative_rms: [f64; 3],
}

impl MatrixResidual {
    /// The same in words.
    pub fn in_words(&self) -> String {
        let [x, y, z] = self.relative_rms.map(|rms| 100.0 * rms);
        format!("the matrix is off by {x:.2} % of X, {y:.2} % of Y and {z:.2} % of Z, rms over {}", self.library)
    }
}

/// What standard deviations count in all reports and layers: noise. What a matrix is off by is told beside them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// `noise only`.
    pub std_counts: String,
    /// What is beside the noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix_residual: Option<MatrixResidual>,
    /// The same of the scene's own spectrum: relative error of X, Y and Z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_error: Option<[f64; 3]>,
}

impl Coverage {
    /// That of noise, beside what a matrix is off by.
    pub fn noise_only(matrix_residual: Option<MatrixResidual>) -> Self {
        Self { std_counts: "noise only".into(), matrix_residual, scene_error: None }
    }

    /// That of the noise of colors, beside what their matrix is off by.
    pub fn of_colors(record: Option<&ColorRecord>) -> Self {
        let residual = record.and_then(|record| record.matrix_residual.clone());
        Self { scene_error: record.and_then(|record| record.scene_error), ..Self::noise_only(residual) }
    }

    /// The same in words.
    pub fn in_words(&self) -> String {
        let mut said = format!("standard deviations count {}", self.std_counts);
        if let Some([x, y, z]) = self.scene_error.map(|error| error.map(|part| 100.0 * part)) {
            said += &format!(
                "; of this scene's spectrum the matrix is off by {x:+.2} % of X, {y:+.2} % of Y and {z:+.2} % of Z"
            );
        }
        if let Some(residual) = &self.matrix_residual {
            said += &format!("; {}", residual.in_words());
            if self.scene_error.is_none() {
                said += ", and may be by more of spectra unlike these";
            }
        }
        said
    }
}

/// Moments by formula.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictedRecord {
    /// Mean of R, G and B in the unit of the samples.
    pub mean: [f64; 3],
    /// Standard deviation of R, G and B over the photosites of a frame, fixed patterns included.
    pub std: [f64; 3],
    /// Share of the samples of R, G and B that are saturated; of electrons, of photosites whose charge reaches full well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturated: Option<[f64; 3]>,
}

/// Work that was left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The program.
    pub program: String,
    /// What was left out.
    pub what: String,
    /// Why the result is the same.
    pub why: String,
}

/// One program of the chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HistoryEntry {
    /// Name.
    pub program: String,
    /// Version.
    pub version: String,
    /// Arguments that bear on the samples: where and how the output is stored is left out.
    pub arguments: Vec<String>,
}
