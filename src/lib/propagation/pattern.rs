//! What fixed patterns alone make of a reading: the variance, over photosites, of the mean that each has over exposures.
//!
//! Given its sensitivities x and y to light and to dark current a photosite has the temporal law of x P + y D, P and D counts.
//! Few counts are gone through one by one; of many the first four cumulants tell the mean of what is clipped, by Edgeworth's
//! series, to about the cube of their skewness, and rounding, which many counts cover, is a uniform error.

use super::counts::{Charge, Count};
use super::memory::Memory;
use super::node::Law;
use super::reading::Reading;
use crate::metadata::PoissonKind;
use crate::numerics::gauss::panel;
use crate::numerics::normal::{NearlyNormal, density};
use crate::numerics::rounding::REACH;

/// What light and dark frames have of the pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shared {
    /// Variance of the means of photosites in light frames.
    pub light: f64,
    /// The same in dark frames.
    pub dark: f64,
    /// The covariance of the two.
    pub both: f64,
}

/// Evaluations up to which counts are gone through one by one.
const AFFORDABLE: usize = 6_000;

impl Shared {
    /// Of two laws that share the pattern of the dark current.
    pub fn of((light, light_reading): (&Law, &Reading), (dark, dark_reading): (&Law, &Reading)) -> Self {
        thread_local! { static KNOWN: Memory<[(Law, Reading); 2], Shared> = const { Memory::new() }; }
        let asked = [(*light, *light_reading), (*dark, *dark_reading)];
        KNOWN
            .with(|known| known.recall(asked, |[light, dark]| Self::work_out((&light.0, &light.1), (&dark.0, &dark.1))))
    }

    fn work_out((light, light_reading): (&Law, &Reading), (dark, dark_reading): (&Law, &Reading)) -> Self {
        let (of_light, of_dark) = (Temporal::of(light, light_reading), Temporal::of(dark, dark_reading));
        let [xs, ys] = [&light.light, &light.dark].map(|charge| sensitivities(charge, light));
        let mut sums = [0.0; 5];
        let inner = of_light.evaluations(xs.len() * ys.len());
        for &(y, of_y) in &ys {
            let dark_mean = of_dark.mean(1.0, y, of_dark.evaluations(ys.len()) <= AFFORDABLE);
            for &(x, of_x) in &xs {
                let light_mean = of_light.mean(x, y, inner <= AFFORDABLE);
                let weight = of_x * of_y;
                let terms =
                    [light_mean, light_mean * light_mean, dark_mean, dark_mean * dark_mean, light_mean * dark_mean];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += weight * term;
                }
            }
        }
        let [light_mean, light_square, dark_mean, dark_square, both] = sums;
        Self {
            light: (light_square - light_mean * light_mean).max(0.0),
            dark: (dark_square - dark_mean * dark_mean).max(0.0),
            both: both - light_mean * dark_mean,
        }
    }

    /// The variance that the pattern gives to a reading of one law.
    pub fn of_one(law: &Law, reading: &Reading) -> f64 {
        Self::of((law, reading), (law, reading)).light
    }
}

/// Sensitivities and their weights, as many as the means over exposures need, which follow them the more steeply the less
/// temporal noise there is.
fn sensitivities(charge: &Charge, law: &Law) -> Vec<(f64, f64)> {
    let sigma = charge.pattern;
    if sigma <= 0.0 || charge.rate <= 0.0 {
        return vec![(1.0, 1.0)];
    }
    let temporal = law.light.shot_std().hypot(law.dark.shot_std()).hypot(law.read_noise_e).max(1e-9);
    let steepness = sigma * charge.rate / temporal;
    let scale = (1.0 / (1.0 + steepness * steepness).sqrt()).max(0.02);
    let lowest = (-1.0 / sigma).max(-REACH);
    if lowest <= -REACH {
        let step = scale / 1.3;
        let steps = (REACH / step).ceil();
        let mut z = -steps * step;
        let mut found = Vec::new();
        while z <= steps * step + 0.5 * step {
            found.push((1.0 + sigma * z, step * density(z)));
            z += step;
        }
        return found;
    }
    // Those below zero are zero.
    let mut found = vec![(0.0, crate::numerics::normal::cumulative(lowest))];
    let panels = ((REACH - lowest) / (3.0 * scale)).ceil();
    let width = (REACH - lowest) / panels;
    let mut low = lowest;
    while low < REACH - 0.5 * width {
        found.extend(panel(low, low + width).map(|(z, weight)| (1.0 + sigma * z, weight * density(z))));
        low += width;
    }
    found
}

/// The means that photosites have over exposures.
struct Temporal<'a> {
    law: &'a Law,
    reading: &'a Reading,
    light: Vec<Count>,
    dark: Vec<Count>,
    at_full: f64,
    /// What rounding does to the mean at full well.
    rounding_at_full: f64,
}

impl<'a> Temporal<'a> {
    fn of(law: &'a Law, reading: &'a Reading) -> Self {
        let counts = |charge: &Charge| {
            let mut counts = Charge { pattern: 0.0, ..*charge }.counts(law.read_noise_e.max(1e-3));
            counts.retain(|count| count.weight > 1e-15);
            counts
        };
        let full = law.full_well_e;
        let (at_full, smooth) =
            if full.is_finite() { (reading.at(full, 0.0)[0], reading.smooth_at(full)[0]) } else { (0.0, 0.0) };
        Self {
            law,
            reading,
            light: counts(&law.light),
            dark: counts(&law.dark),
            at_full,
            rounding_at_full: at_full - smooth,
        }
    }

    /// How often counts are gone through at so many sensitivities.
    fn evaluations(&self, sensitivities: usize) -> usize {
        sensitivities.saturating_mul(self.light.len()).saturating_mul(self.dark.len())
    }

    fn mean(&self, x: f64, y: f64, is_affordable: bool) -> f64 {
        if is_affordable { self.sum(x, y) } else { self.edgeworth(x, y) }
    }

    fn sum(&self, x: f64, y: f64) -> f64 {
        let full = self.law.full_well_e;
        let mut mean = 0.0;
        for dark in &self.dark {
            for light in &self.light {
                let electrons = x * light.electrons + y * dark.electrons;
                let variance = (x * light.spread).powi(2) + (y * dark.spread).powi(2);
                let read = if electrons >= full { self.at_full } else { self.reading.at(electrons, variance)[0] };
                mean += light.weight * dark.weight * read;
            }
        }
        mean
    }

    fn edgeworth(&self, x: f64, y: f64) -> f64 {
        let of = |charge: &Charge, factor: f64| {
            let shot = |kind| if charge.shot == Some(kind) { charge.rate } else { 0.0 };
            let counted = shot(PoissonKind::Exact);
            let variable = NearlyNormal {
                mean: charge.rate,
                variance: counted + shot(PoissonKind::Gaussian),
                third: counted,
                fourth: counted,
            };
            variable.scaled(factor)
        };
        let charge = of(&self.law.light, x).plus(of(&self.law.dark, y));
        let full = self.law.full_well_e;
        let [lower, upper] = self.reading.rails_e();
        let noise = NearlyNormal::normal(0.0, self.law.read_noise_e.powi(2));
        let (read, is_full) = if upper <= full { (charge.plus(noise), false) } else { (charge, full.is_finite()) };
        let above = |variable: NearlyNormal, limit: f64| {
            if limit.is_finite() { variable.mean - variable.clipped_above(limit).mean } else { 0.0 }
        };
        let mut mean = read.mean - above(read, if is_full { full } else { upper });
        let whole = charge.plus(noise);
        let mirrored = NearlyNormal { mean: -whole.mean, third: -whole.third, ..whole };
        mean += above(mirrored, -lower);
        let offset = self.reading.smooth_at(mean)[0];
        if is_full { offset + self.rounding_at_full * charge.exceeds(full) } else { offset }
    }
}
