//! OpenEXR: scanline files written, scanline and tiled files read, in bands, from files and from pipes.
//!
//! The crate `exr` parses headers and (de)compresses blocks; the order of reading and writing is ours, so that rows
//! stream by and a pipe needs no seek. Uncompressed scanlines of one type of float, which is what pipes carry, are moved
//! without the crate.

mod attributes;
mod blocks;
mod format;
mod header;
mod layered;
mod read;
mod straight;
mod write;
mod write_behind;

use crate::stages::saturation::MASK_LAYER;

pub use format::FORMAT;
pub use read::ExrReader;
pub use write::{ExrWriter, TablePatch, patch_table};

/// The string attribute that holds the metadata.
const METADATA_ATTRIBUTE: &str = "cyanometer";
/// The unit of a spectral image \[Fichet2021].
const UNITS_ATTRIBUTE: &str = "emissiveUnits";
/// The attribute that names the color space.
const INTEROP_ATTRIBUTE: &str = "colorInteropID";
/// What it says of channels that are no colors \[CIF2025].
const DATA: &str = "data";
/// What the parts of a file are called whose layers stand apart.
const PART_NAMES: [&str; 2] = ["image", "layers"];
/// Blocks smaller than this are read 32 at a time, larger ones two, to save memory; blocks to be written are gathered up to
/// this, or one that is larger.
const PARALLEL_BLOCK_BYTES: usize = 4 << 20;

/// How samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExrSamples {
    /// 32-bit float.
    F32,
    /// 16-bit float.
    F16,
}

impl ExrSamples {
    /// Bytes of a sample.
    fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 => 2,
        }
    }
}

/// How blocks are compressed, all without loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExrCompression {
    /// Not at all: the only way down a pipe.
    None,
    /// Run lengths.
    Rle,
    /// Deflate, row by row.
    Zips,
    /// Deflate, 16 rows at a time.
    Zip,
    /// Wavelets, 32 rows at a time: best on noise.
    Piz,
}

/// Where layers (standard deviations, covariances, marks) stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layers {
    /// Beside the image, in its part: a pipe needs no seek so.
    BesideTheImage,
    /// In a second part, whose channels are marked as data.
    InAPartOfTheirOwn,
}

/// Whether a channel is one of a layer.
fn is_layer(channel: &str) -> bool {
    channel.contains('.') || channel == MASK_LAYER
}

pub use crate::color::rgb::Primaries;

/// Chromaticities that mark XYZ stored as R, G, B: an OpenEXR convention.
pub const XYZ_PRIMARIES: Primaries = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]];

/// Attributes that other software understands, and ours.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExrTags {
    /// The metadata, YAML.
    pub metadata: Option<String>,
    /// `software`.
    pub software: Option<String>,
    /// `expTime` in s.
    pub exposure_s: Option<f64>,
    /// `aperture`, the f-number.
    pub f_number: Option<f64>,
    /// `isoSpeed`.
    pub iso_speed: Option<f64>,
    /// `whiteLuminance` in cd m⁻².
    pub white_luminance: Option<f64>,
    /// `adoptedNeutral`: the chromaticity that counts as neutral.
    pub neutral_xy: Option<[f64; 2]>,
    /// `colorInteropID`: the color space by a name of the Color Interop Forum.
    pub interop_id: Option<String>,
    /// `chromaticities`.
    pub primaries: Option<Primaries>,
    /// `emissiveUnits` of a spectral image.
    pub emissive_units: Option<String>,
    /// `spectralLayoutVersion` of a spectral image.
    pub spectral_layout: Option<String>,
}
