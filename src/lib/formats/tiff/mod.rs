//! TIFF: rows of samples in and out, without ever holding a whole image.
//!
//! The crate `tiff` supplies the vocabulary (numbers of tags, types, compressions) and, in the tests, an independent
//! witness. Directories and samples are read and written here, because its decoder inverts MinIsWhite of any
//! depth, does not open photometric 32803 (CFA), and decodes a strip whole, be it a gigabyte that is not even compressed; and
//! its encoder has no floating-point predictor. Both work on one thread.

mod capture;
mod chunk;
mod directory;
mod exif;
mod extent;
mod first;
mod grid;
mod layout;
mod read;
mod tags;
#[cfg(test)]
mod tests;
mod write;

pub(in crate::formats) use capture::told_orientation;
pub(in crate::formats) use chunk::Predictor;
pub use directory::{Directory, TiffFile, begins_so};
pub use exif::{exif_block, exposure_of_block};
pub(in crate::formats) use first::FirstImage;
pub(in crate::formats) use layout::passed_over;
pub use read::{FORMAT, TiffReader};
pub use tags::{ExtraTag, TagValue};
pub use write::{TiffSettings, TiffWriter};

/// What a TIFF's own tags say in words.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TiffTags {
    /// ImageDescription (270).
    pub description: Option<String>,
    /// Software (305).
    pub software: Option<String>,
}

/// How samples are stored in a file that we write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TiffSamples {
    /// 16-bit unsigned integers.
    U16,
    /// 32-bit floats.
    F32,
}

impl TiffSamples {
    /// Bytes of a sample.
    pub(in crate::formats) fn bytes(self) -> usize {
        match self {
            Self::U16 => 2,
            Self::F32 => 4,
        }
    }
}

/// How strips are compressed in a file that we write; without loss, all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TiffCompression {
    /// Not at all.
    None,
    /// LZW: every reader knows it.
    Lzw,
    /// Deflate at level 1; higher levels gain nothing on noise.
    Deflate,
}
