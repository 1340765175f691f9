//! Mathematics that knows no camera.

pub mod averages;
pub mod cut_off;
pub mod distribution;
pub mod edges;
pub mod gauss;
pub mod largest;
pub mod least_squares;
pub mod leveled;
pub mod medians;
pub mod moments;
pub mod normal;
pub mod planes;
pub mod quadrature;
pub mod quantiles;
pub mod robust;
pub mod rounding;
pub mod running;
pub mod significance;
pub mod steps;
pub mod sums;
pub mod variance_components;
pub mod vectors;
