//! DNG: the raw image of a file by Adobe's specification \[DNG2023], for all programs.
//!
//! A DNG is a TIFF whose raw image lies in its first directory or right below it. Directories are read by
//! [`super::tiff`]; what is a raw image, its levels and its samples are read here. Levels, filter array and origin are
//! those of the project: counted from the sensor's corner, which is that of the stored image; files that are written here say
//! where on the sensor that image lies (XPosition, YPosition).

mod area;
mod color;
mod describe;
mod digest;
mod illuminants;
mod image;
mod levels;
mod noise;
mod opcodes;
mod preview;
mod ratio;
mod read;
mod samples;
mod signals;
mod storage;
mod tags;
mod tell;
#[cfg(test)]
mod tests;
mod write;
#[cfg(test)]
mod written;

pub use area::RawArea;
pub(super) use area::Rectangle;
pub use color::{OwnMatrix, own_matrix};
pub(super) use describe::exposure_of;
pub(super) use illuminants::temperature_k;
pub use read::{DngReader, FORMAT};
pub(super) use signals::are_other_colors;
pub(super) use tell::{of_exposure, written_white};
pub use write::{DngWriter, check_frame};
