//! Files: bytes to frames and back.

pub mod atomic;
pub mod csv;
pub mod data;
pub mod digest;
pub mod dng;
pub mod exr;
pub mod files;
pub mod foreign;
pub mod format;
pub mod input;
mod ljpeg;
pub mod output;
pub mod picture;
pub mod pipe;
pub mod places;
pub mod plots;
pub mod radiance_unit;
pub mod register;
pub mod spectral;
pub mod standard;
pub mod table;
pub mod tiff;
pub mod unread;
pub mod yaml;
pub mod yaml_guard;
pub mod yaml_writer;
