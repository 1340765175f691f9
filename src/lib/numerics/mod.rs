//! Mathematics that knows no camera.

pub mod distribution;
pub mod least_squares;
pub mod moments;
pub mod normal;
pub mod planes;
pub mod quadrature;
pub mod significance;
pub mod sums;
pub mod vectors;
