//! Files: bytes to frames and back.

pub mod atomic;
pub mod csv;
pub mod data;
pub mod digest;
pub mod exr;
pub mod files;
pub mod foreign;
pub mod format;
pub mod input;
pub mod output;
pub mod picture;
pub mod pipe;
pub mod plots;
pub mod radiance_unit;
pub mod spectral;
pub mod table;
pub mod tiff;
pub mod unread;
pub mod yaml;
