//! Cyanometer.
pub mod adc;
pub mod cfa;
pub mod demosaic;
pub mod error;
pub mod formats;
pub mod frame;
pub mod metadata;
pub mod mosaic;
pub mod noise;
pub mod numerics;
pub mod optics;
pub mod random;
pub mod sensor;
pub mod spectrum;
pub mod stage;
pub mod units;
