//! The independent numbers that a level tells.

use super::super::level::Level;
use super::super::scatter::Scatter;
use super::super::settings::Settings;

/// A measured number and what it scatters by, a variance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Datum {
    pub(super) value: f64,
    pub(super) variance: f64,
    /// How far rounding may have it off, at most.
    pub(super) hidden: f64,
}

impl Datum {
    /// What it may be off by in all, a variance.
    pub(super) fn scatter(&self) -> f64 {
        self.variance + self.hidden * self.hidden
    }
}

/// What a level tells: its independent numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Point4 {
    pub(super) exposure_s: Option<f64>,
    pub(super) mean: Datum,
    /// How far the mean of a dark is off the line over time where the response bends.
    pub(super) bent: Datum,
    pub(super) variance: Datum,
    pub(super) photons: Option<Datum>,
    /// What its light is uncertain by, as frames scatter: a relative variance.
    pub(super) light_variance: f64,
    pub(super) freedom: f64,
    pub(super) frames: f64,
    /// What noise makes the mean scatter by.
    pub(super) noise: f64,
    /// Whether no more of its photosites are cut off than in all darks.
    pub(super) is_whole: bool,
}

impl Point4 {
    pub(super) fn of(level: &Level, scatter: &Scatter, settings: &Settings) -> Self {
        let (confidence, hidden) = (settings.confidence, level.hidden(settings.rounding()));
        let light_variance = scatter.of_light(level).known(confidence);
        let of_photons = |value: f64| light_variance * value * value;
        let of_black = scatter.of_black(level).known(confidence);
        Self {
            exposure_s: level.condition.exposure_s,
            mean: Datum { value: level.mean, variance: level.mean_variance + of_black, hidden: hidden.mean },
            bent: Datum::default(),
            variance: Datum { value: level.variance, variance: level.variance_variance, hidden: hidden.variance },
            photons: level.condition.photons.map(|value| Datum { value, variance: of_photons(value), hidden: 0.0 }),
            light_variance,
            freedom: level.freedom(),
            frames: level.frames as f64,
            noise: level.mean_variance,
            is_whole: true,
        }
    }

    /// The mean of a dark as a point of the line over time.
    pub(super) fn mean_of_line(&self) -> Datum {
        let Self { mean, bent, .. } = *self;
        Datum { value: mean.value + bent.value, variance: mean.variance + bent.variance, ..mean }
    }
}
