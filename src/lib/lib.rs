//! Cyanometer.
pub mod cfa;
pub mod error;
pub mod formats;
pub mod frame;
pub mod units;
