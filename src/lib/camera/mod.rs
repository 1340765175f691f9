//! The description of a camera: its lens, its sensor.

pub mod optics;
pub mod sensor;
