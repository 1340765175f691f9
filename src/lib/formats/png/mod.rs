//! PNG: pictures of 8 or 16 bits, in which programs store their codes too \[PNG2025].

mod plain;
mod read;
mod write;

pub use read::{FORMAT, PngReader};
pub use write::{PngSettings, PngWriter, check_frame};

/// The chunk that says where a picture lies: column and row, and the unit, 0 for pixels \[PNG1999].
const PLACE: [u8; 4] = *b"oFFs";

/// How many bytes one byte of Deflate can become at most: a match of 258 in two bits.
const DEFLATE_EXPANSION: u64 = 1032;
