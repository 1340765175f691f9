//! What is found out about frames and cameras: statistics beside predictions, differences, matrices.

pub mod characterization;
pub mod chart;
pub mod comparison;
pub mod photon_transfer;
pub mod statistics;
