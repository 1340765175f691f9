//! DNG: the raw image of a file by Adobe's specification \[DNG2023], for all programs.
//!
//! A DNG is a TIFF whose raw image lies in its first directory or right below it. Directories are read by
//! [`super::tiff`]; what is a raw image, its levels and its samples are read here. Levels, filter array and origin are
//! those of the project: counted from the sensor's corner, which is that of the stored image.

mod area;
mod color;
mod describe;
mod image;
mod levels;
mod read;
mod samples;
mod storage;
mod tags;
#[cfg(test)]
mod tests;

pub use area::RawArea;
pub use read::{DngReader, FORMAT};
