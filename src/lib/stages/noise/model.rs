//! The noise of a photosite in numbers, and what a user may set of it.

use crate::error::Result;
use crate::metadata::{FrameHeader, NoiseRecord, PoissonKind};
use crate::random::Source;

/// The numbers that the noise of a photosite follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// Mean dark signal Q_DC before non-uniformity, e⁻ [HP2005, Eq. 7].
    pub dark_e: f64,
    /// Relative rms of the dark current over photosites; 0 when left out.
    pub dcnu: f64,
    /// Relative rms of the response over photosites; 0 when left out.
    pub prnu: f64,
    /// Read noise, rms e⁻; 0 when left out.
    pub read_noise_e: f64,
    /// Full well, e⁻.
    pub full_well_e: f64,
    /// Whether the dark signal has shot noise.
    pub dark_shot: bool,
    /// Whether the light signal has shot noise.
    pub signal_shot: bool,
    /// How Poisson numbers are drawn.
    pub poisson: PoissonKind,
}

impl NoiseModel {
    /// The model of a noise record.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`](crate::error::Error::MissingKey) when the frame has no sensor, or that no read-out.
    pub fn of(frame: &FrameHeader, record: &NoiseRecord) -> Result<Self> {
        let readout = frame.readout()?;
        let drawn = |source| record.sources.contains(&source);
        let if_drawn = |source, value| if drawn(source) { value } else { 0.0 };
        Ok(Self {
            dark_e: record.dark_e,
            dcnu: if_drawn(Source::Dcnu, readout.dcnu),
            prnu: if_drawn(Source::Prnu, readout.prnu),
            read_noise_e: if_drawn(Source::Ron, readout.read_noise_e),
            full_well_e: readout.full_well_e,
            dark_shot: drawn(Source::Dcsn),
            signal_shot: drawn(Source::Ssn),
            poisson: record.poisson,
        })
    }
}

/// What a user may set of the noise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoiseSettings {
    /// Seed of the temporal noise.
    pub seed: u64,
    /// Seed of the fixed patterns.
    pub sensor_seed: u64,
    /// Number of the exposure.
    pub frame: u32,
    /// Sources to leave out; their means stay.
    pub without: Vec<Source>,
    /// Whether all are left out, so that the frame is the mean of noisy ones.
    pub clean: bool,
    /// Temperature in K, the sensor's own where none is given.
    pub temperature_k: Option<f64>,
    /// How to draw Poisson numbers.
    pub poisson: PoissonKind,
    /// Share of a packet that each move to the output takes along; none leaves transfer out.
    pub cte: Option<f64>,
}

/// Mean of max(0, N) for N normal with mean 1: a photosite has no negative sensitivity, so draws below zero count as
/// zero, which lifts the mean by σ φ(1/σ) − Φ(−1/σ) (10⁻⁸ at σ = 0.2).
pub fn rectified_mean(sigma: f64) -> f64 {
    use crate::numerics::normal::{cumulative, density};
    if sigma <= 0.0 { 1.0 } else { cumulative(1.0 / sigma) + sigma * density(1.0 / sigma) }
}

/// Mean square of max(0, N) for N normal with mean 1.
pub fn rectified_mean_square(sigma: f64) -> f64 {
    use crate::numerics::normal::{cumulative, density};
    if sigma <= 0.0 { 1.0 } else { (1.0 + sigma * sigma) * cumulative(1.0 / sigma) + sigma * density(1.0 / sigma) }
}
