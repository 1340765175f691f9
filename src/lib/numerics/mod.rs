//! Mathematics that knows no camera.

pub mod averages;
pub mod distribution;
pub mod gauss;
pub mod least_squares;
pub mod medians;
pub mod moments;
pub mod normal;
pub mod planes;
pub mod quadrature;
pub mod rounding;
pub mod significance;
pub mod sums;
pub mod vectors;
