//! What is predicted of a sample, and by which equations.

use crate::numerics::normal::MeanVariance;
use serde::{Deserialize, Serialize};

/// Which equations to predict by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Equations {
    /// Exact moments.
    #[default]
    Exact,
    /// Those of \[HP2005], misprints mended.
    Paper,
}

/// Predicted moments of the samples of one class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Mean and variance over the photosites of a frame; fixed patterns count as variance.
    pub moments: MeanVariance,
    /// Excess kurtosis, for the spread of a sample variance.
    pub excess_kurtosis: f64,
}
