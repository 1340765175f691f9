//! Files: bytes to frames and back.

pub mod exr;
