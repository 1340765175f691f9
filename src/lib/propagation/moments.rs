//! What is predicted of a sample, and by which equations.

use crate::names::{Named, serde_by_name};
use crate::numerics::normal::MeanVariance;

/// Which equations to predict by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Equations {
    /// Exact moments.
    #[default]
    Exact,
    /// Those of \[HP2005], misprints mended.
    Paper,
}

impl Named for Equations {
    const ALL: &'static [Self] = &[Self::Exact, Self::Paper];

    fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Paper => "paper",
        }
    }
}

serde_by_name!(Equations);

/// Predicted moments of the samples of one class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Mean and variance over the photosites of a frame; fixed patterns count as variance.
    pub moments: MeanVariance,
    /// Excess kurtosis, for the spread of a sample variance.
    pub excess_kurtosis: f64,
}
