//! What metadata tell of the samples themselves.

use super::records::is_false;
use serde::{Deserialize, Serialize};

/// By what is known ahead of the last row, which samples metadata were written with: other programs crop, turn, scale and encode
/// frames, and keep the metadata as they are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Seal {
    /// Columns and rows of the stored frame.
    pub size: [usize; 2],
    /// The digest of the samples of the first row, as [`SamplesRecord::digest`] is that of all.
    pub first_row: String,
}

/// What is known only after the last row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SamplesRecord {
    /// `blake3:`, or `sha256:` in older sidecars, and the digest of all samples as little-endian 32-bit floats, rows top
    /// to bottom, in each row channel by channel.
    pub digest: String,
    /// Whether all samples have one value. Exposures whose samples do are alike without being copies.
    #[serde(default, skip_serializing_if = "is_false")]
    pub one_value: bool,
    /// Photosites whose charge was clipped at full well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_well: Option<u64>,
    /// Samples clipped to the smallest code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clipped_low: Option<u64>,
    /// Samples clipped to the largest code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clipped_high: Option<u64>,
    /// Samples that are NaN or infinite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_finite: Option<u64>,
    /// Expected electrons below zero, taken as zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub negative: Option<u64>,
    /// Hues that could not be formed because green was zero; bilinear values stand in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undefined_hue: Option<u64>,
    /// Pixels whose green, by which smooth hue transition divides, is less than ten times its noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dim_green: Option<u64>,
    /// Colors outside sRGB, clipped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub out_of_gamut: Option<u64>,
    /// Colors more than ten times as bright as the white that they refer to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub far_above_white: Option<u64>,
    /// Colors without a correlated color temperature, NaN.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub off_locus: Option<u64>,
    /// Colors without a chromaticity, whose coordinates are those of white.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_chromaticity: Option<u64>,
    /// Pixels whose noise cannot be propagated, green being too near its noise to divide by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub propagation_void: Option<u64>,
    /// Samples at full well or the white level or above; of demosaicked frames and colors, pixels that were made of such.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturated: Option<u64>,
    /// Defective photosites.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub defective: Option<u64>,
    /// Those among them that were interpolated from others of their class.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corrected: Option<u64>,
    /// Pixels that were made of defective or interpolated samples, or of others that are marked but not saturated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marked: Option<u64>,
}
