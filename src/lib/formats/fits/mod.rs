//! FITS: images of astronomy, as sky cameras store them \[FITS4].
//!
//! A file is a chain of parts (HDUs): a header of cards and an array, each in blocks of 2880 bytes.

mod header;
mod keywords;
mod read;
mod sections;
#[cfg(test)]
mod tests;
mod units;

pub use read::{FORMAT, FitsReader};
