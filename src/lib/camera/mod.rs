//! The description of a camera: its lens, its sensor.
//!
//! A sensor is two parts that are measured apart: the [`readout`], which photon transfer tells, and the spectral
//! [`response`]. [`sensor`] holds what a file says of both, [`levels`] what is black and white among its codes,
//! [`linearity`] how these bend, and [`taps`] through which amplifier each photosite is read.

pub mod levels;
pub mod linearity;
pub mod noise_profile;
pub mod optics;
pub mod readout;
pub mod response;
pub mod sensor;
pub mod taps;
