//! What is asked of a measurement, and what is said of its samples.

/// Variance of the error of rounding, in codes² [EMVA1288, Sec. 2.5].
const ROUNDING: f64 = 1.0 / 12.0;

/// What is asked of the measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Probability that an interval holds its number.
    pub confidence: f64,
    /// Relative standard uncertainty of all numbers of photons together.
    pub photon_error: f64,
    /// Whether samples are codes, which are rounded.
    pub are_codes: bool,
    /// The largest code, where it is known.
    pub top: Option<f64>,
    /// What was done to the samples before, where more than a level came off.
    pub corrected: Option<Corrected>,
}

/// What was done to samples before they are measured, beyond a level that comes back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corrected {
    /// Whether marks beside the samples, and not their levels, tell which are saturated.
    pub is_marked: bool,
    /// Whether what dark charge adds on average came off.
    pub lost_dark: bool,
}

/// Samples at which codes end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// The least; none where what came off samples hides which were that.
    pub bottom: Option<f64>,
    /// The largest, where it is known by its level.
    pub top: Option<f64>,
}

impl Default for Ends {
    fn default() -> Self {
        Self { bottom: Some(0.0), top: None }
    }
}

impl Settings {
    /// Whether what dark charge adds on average came off the samples.
    pub fn lost_dark(&self) -> bool {
        self.corrected.is_some_and(|corrected| corrected.lost_dark)
    }

    /// The variance of the error of rounding, in samples².
    pub fn rounding(&self) -> f64 {
        if self.are_codes { ROUNDING } else { 0.0 }
    }
}
