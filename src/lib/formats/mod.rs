//! Files.

pub mod tiff;
