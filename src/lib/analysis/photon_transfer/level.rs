//! What a class of photosites does at one level of light, or in the dark.

use super::rounding::{Hidden, Steps};
use super::site_survey::SiteSurvey;

/// Exposure times that differ by less are one.
pub const SAME_TIME: f64 = 1e-6;

/// Whether exposure times in s are one, or neither is known.
pub fn is_same_time(time: Option<f64>, reference: Option<f64>) -> bool {
    match (time, reference) {
        (Some(time), Some(reference)) => (time - reference).abs() <= SAME_TIME * reference.abs(),
        (None, None) => true,
        _ => false,
    }
}

/// A level of light, or darkness, as frames of it were taken.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Condition {
    /// Whether light fell.
    pub is_lit: bool,
    /// Exposure time in s, where it is known.
    pub exposure_s: Option<f64>,
    /// Photons per photosite during the exposure, where they are known.
    pub photons: Option<f64>,
    /// Temperature of the sensor in K, where it is known.
    pub temperature_k: Option<f64>,
}

/// What a class does under one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// The condition.
    pub condition: Condition,
    /// Which of all the conditions it is.
    pub place: usize,
    /// Frames.
    pub frames: usize,
    /// Mean of the samples.
    pub mean: f64,
    /// What it scatters by: a variance.
    pub mean_variance: f64,
    /// Temporal variance of a sample.
    pub variance: f64,
    /// What it scatters by: a variance.
    pub variance_variance: f64,
    /// Shares of the samples at or above the top code, and at or below 0.
    pub at_ends: [f64; 2],
    /// The share of the photosites whose means are those of full ones, where that is counted.
    pub full: f64,
    /// What smooths its codes as it is drawn, where that is known to be coarser than normal noise of its variance.
    pub steps: Option<Steps>,
    /// The grids of the class.
    pub sites: Vec<SiteSurvey>,
}

impl Level {
    /// Of grids of one class under the condition at such a place among all, each counted by its photosites.
    pub fn of(place: usize, condition: Condition, sites: Vec<SiteSurvey>) -> Self {
        let count: f64 = sites.iter().map(|site| site.count() as f64).sum();
        let share = |site: &SiteSurvey| site.count() as f64 / count;
        let mean = |of: &dyn Fn(&SiteSurvey) -> f64| sites.iter().map(|site| share(site) * of(site)).sum();
        let scatter = |of: &dyn Fn(&SiteSurvey) -> f64| sites.iter().map(|site| share(site).powi(2) * of(site)).sum();
        let frames = sites.first().map_or(0, |site| site.frames);
        let at_end = |end: usize| mean(&|site| site.at_ends[end] as f64 / (site.count() * site.frames) as f64);
        Self {
            condition,
            place,
            frames,
            mean: mean(&|site| site.mean),
            mean_variance: scatter(&|site| site.mean_variance),
            variance: mean(&|site| site.variance),
            variance_variance: scatter(&|site| site.variance_variance),
            at_ends: [at_end(0), at_end(1)],
            full: mean(&|site| site.full as f64 / site.count() as f64),
            steps: None,
            sites,
        }
    }

    /// Mean of all photosites of a frame.
    pub fn frame_mean(&self, frame: usize) -> f64 {
        self.sites.iter().map(|site| site.frame_means[frame] * site.count() as f64).sum::<f64>() / self.count()
    }

    /// How far its mean and its variance may be off as rounding hides noise; samples that are not rounded hide none.
    pub fn hidden(&self, rounding: f64) -> Hidden {
        if rounding > 0.0 { self.hidden_beneath(0.0) } else { Hidden::default() }
    }

    /// The same of samples that a pattern of such a variance spreads besides.
    pub fn hidden_beneath(&self, pattern: f64) -> Hidden {
        let of_variance = Hidden::behind(self.variance + pattern, self.variance_variance);
        let of_steps = self.steps.map(|steps| Hidden::of(Steps { normal: steps.normal + pattern, ..steps }));
        of_steps.map_or(of_variance, |hidden| of_variance.or(hidden))
    }

    /// Independent values that its variance is an average of.
    pub fn freedom(&self) -> f64 {
        (self.frames as f64 - 1.0) * self.count()
    }

    /// Photosites.
    pub fn count(&self) -> f64 {
        self.sites.iter().map(|site| site.count() as f64).sum()
    }
}
