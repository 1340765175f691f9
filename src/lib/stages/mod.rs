//! The stages, in the order in which light meets them. Each is a [`crate::stream::Stage`] that refuses a frame which comes
//! at the wrong time.

pub mod black;
pub mod bounds;
pub mod import;
pub mod render;

pub mod noise;
pub mod transfer;

pub mod adc;

pub mod correct;
pub mod darks;
pub mod defects;
pub mod exposures;
pub mod flats;
pub mod level_sums;
pub mod masters;
pub mod sites;

pub mod linearize;
pub mod mosaic;

pub mod saturation;

pub mod demosaic;

pub mod from_xyz;
pub mod to_xyz;
