//! What follows from the levels of a class.

/// What the levels of a class lead to, in the unit of the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Values {
    /// K, samples per electron.
    pub gain: f64,
    /// Temporal variance of no light, rounding included.
    pub dark_variance: Option<f64>,
    /// Mean of no light and no time, or of the shortest darks.
    pub dark_mean: Option<f64>,
    /// Mean of no light where the line through darks of two exposure times or more has it at no time.
    pub black: Option<f64>,
    /// R, samples per photon.
    pub responsivity: Option<f64>,
    /// Dark signal per second.
    pub dark_slope: Option<f64>,
    /// Dark variance per second.
    pub dark_variance_slope: Option<f64>,
}
