//! Files: bytes to frames and back.

pub mod atomic;
pub mod csv;
pub mod data;
pub mod digest;
pub mod exr;
pub mod input;
pub mod output;
pub mod picture;
pub mod pipe;
pub mod spectral;
pub mod tiff;
pub mod yaml;
