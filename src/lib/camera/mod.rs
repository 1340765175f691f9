//! The description of a camera: its lens, its sensor.
//!
//! A sensor is two parts that are measured apart: the [`readout`], which photon transfer tells, and the spectral
//! [`response`]. [`sensor`] holds what a file says of both, [`levels`] what is black and white among its codes,
//! and [`linearity`] how these bend.

pub mod levels;
pub mod linearity;
pub mod noise_profile;
pub mod optics;
pub mod readout;
pub mod response;
pub mod sensor;
