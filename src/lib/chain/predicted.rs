//! What is predicted of a scene: the moments of every stage, their causes, and the color difference that noise makes.

use crate::names::{Named, serde_by_name};
use crate::propagation::budget::Cause;
use crate::propagation::smooth_hue::FirstOrder;
use serde::Serialize;

/// A stage of the chain that is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChainStage {
    /// Electrons of one exposure.
    Electrons,
    /// Codes.
    Adu,
    /// Codes less the mean of dark frames.
    DarkSubtracted,
    /// Sensor RGB.
    Demosaicked,
    /// CIE XYZ.
    Xyz,
    /// CIE L\*a\*b\*.
    Lab,
}

impl Named for ChainStage {
    const ALL: &'static [Self] =
        &[Self::Electrons, Self::Adu, Self::DarkSubtracted, Self::Demosaicked, Self::Xyz, Self::Lab];

    fn name(self) -> &'static str {
        match self {
            Self::Electrons => "electrons",
            Self::Adu => "adu",
            Self::DarkSubtracted => "dark_subtracted",
            Self::Demosaicked => "demosaicked",
            Self::Xyz => "xyz",
            Self::Lab => "lab",
        }
    }
}

serde_by_name!(ChainStage);

/// What is predicted of one scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChainPrediction {
    /// Expected signal electrons of R, G and B.
    pub electrons: [f64; 3],
    /// One entry per stage.
    pub stages: Vec<StagePrediction>,
    /// Color difference that noise makes at a pixel, where there is a matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_delta_e: Option<NoiseDeltaE>,
    /// How far to trust the linearization of smooth hue transition, where that is the method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_order: Option<FirstOrder>,
    /// Why stages from demosaicking on are left out, where any is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub no_pixels: Option<String>,
}

/// Moments of one stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StagePrediction {
    /// `electrons`, `adu`, `dark_subtracted` (where dark frames are), `demosaicked`, `xyz` or `lab`.
    pub stage: ChainStage,
    /// Unit of the samples.
    pub unit: String,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Why its numbers, which are those of the first order, are void; none where they hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub void: Option<&'static str>,
    /// Mean of each.
    pub mean: [f64; 3],
    /// The part of the mean that noise brings about because the stage is curved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bias: Option<[f64; 3]>,
    /// Standard deviation over the pixels of a frame, fixed patterns included.
    pub std: [f64; 3],
    /// The part that differs from exposure to exposure; none where it is not known apart.
    pub temporal_std: Option<[f64; 3]>,
    /// The part that is the same in every exposure of one sensor.
    pub fixed_pattern_std: Option<[f64; 3]>,
    /// 20 log₁₀ of the mean above black over the standard deviation; none where the mean is no signal, or saturated.
    pub snr_db: [Option<f64>; 3],
    /// Share of the samples that are saturated, or of the pixels that were made of such; none below 10⁻¹².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturated: Option<[f64; 3]>,
    /// Covariance of the channels of a pixel, over the phases of the filter array.
    pub covariance: [[f64; 3]; 3],
    /// The same to second order, of smooth hue transition; `covariance` and `std` are its first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_order_covariance: Option<[[f64; 3]; 3]>,
    /// The covariance for each of the four phases, of a demosaicked frame.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub phases: Vec<PhaseCovariance>,
    /// Variance by cause; the causes add up to the variance.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<CauseVariance>,
    /// Standard deviation of the mean of the patch.
    pub patch_mean_std: Option<[f64; 3]>,
    /// Covariance of the mean of the patch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patch_mean_covariance: Option<[[f64; 3]; 3]>,
    /// Pixels of the smallest square patch whose mean is as certain as wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixels_needed: Option<[Option<u64>; 3]>,
}

/// Variance that one cause gives to the channels.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CauseVariance {
    /// The cause.
    pub cause: Cause,
    /// Variance of each channel.
    pub variance: [f64; 3],
}

/// Covariance of the pixels of one phase.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhaseCovariance {
    /// Parity of the sensor's column.
    pub column: isize,
    /// Parity of the sensor's row.
    pub row: isize,
    /// Class of the photosite there.
    pub class: &'static str,
    /// Covariance of the channels.
    pub covariance: [[f64; 3]; 3],
}

/// Color difference that noise makes: the distance in L*a*b* between a pixel and the color without noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseDeltaE {
    /// Expected ΔE*ab.
    pub mean: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Expected difference in just noticeable ones.
    pub jnd: f64,
    /// Expected ΔE*ab of the mean of the patch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patch_mean: Option<f64>,
    /// Pixels of the smallest square patch whose mean differs by no more than wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixels_needed: Option<u64>,
}
