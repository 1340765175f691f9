//! What fixed patterns alone make of a reading: the variance, over photosites, of the mean that each has over exposures.
//!
//! Given its sensitivities x and y to light and to dark current a photosite has the temporal law of x P + y D, P and D counts.
//! Few counts are gone through one by one; of many the first four cumulants tell the mean of what is clipped, by Edgeworth's
//! series, to about the cube of their skewness, and rounding, which many counts cover, is a uniform error.

use super::counts::{Charge, Count};
use super::effort;
use super::memory::{Memory, Print};
use super::moments::Prediction;
use super::node::Law;
use super::pattern_nodes::{Axis, Knee, fine_sensitivities, sensitivities, smooth_sensitivities};
use super::reading::{Asked, Moments, Reading};
use crate::metadata::PoissonKind;
use crate::numerics::medians::median;
use crate::numerics::normal::NearlyNormal;
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
    /// The law of the dark frames, over exposures and photosites, where they stand for a median.
    pub median: Option<Prediction>,
}

/// Codes of frames, or medians of the codes of so many frames that show how codes are rounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub law: Law,
    pub reading: Reading,
    pub median_of: Option<u32>,
    /// Whether it shows in the means of photosites how codes are rounded.
    pub is_fine: bool,
}

impl Print for Seen {
    fn print(&self, before: u64) -> u64 {
        let flags = f64::from(self.median_of.unwrap_or(0)) + if self.is_fine { 0.5 } else { 0.0 };
        (self.law, self.reading, flags).print(before)
    }
}

impl Seen {
    /// Read noise, e⁻, that hides the codes of a charge which full well leaves alone; none of others.
    fn hidden_e(&self) -> Option<f64> {
        let noise_e = self.law.read_noise_e;
        let is_hidden = self.median_of.is_none() && noise_e > 0.0 && self.reading.straight().is_some();
        (is_hidden && !self.reading.is_coarse() && !self.law.reaches_full_well()).then_some(noise_e)
    }

    /// Whether the means of photosites are alike, and no median is asked for: each holds full well in every exposure, all are read as
    /// one code, or patterns are a millionth of what is drawn anew, 10⁻¹² of the variance.
    fn is_even(&self) -> bool {
        const NOTHING: f64 = 1e-6;
        let Law { light, dark, full_well_e, read_noise_e, trap_e, .. } = self.law;
        let [least, most] = self.law.extent();
        let is_one = || self.reading.is_one(least - trap_e, most.min(full_well_e) + trap_e);
        let drawn_e = light.shot_std().hypot(dark.shot_std()).hypot(read_noise_e);
        let patterns_e = (light.pattern * light.rate).hypot(dark.pattern * dark.rate);
        self.median_of.is_none() && (least >= full_well_e || is_one() || patterns_e < NOTHING * drawn_e)
    }
}

/// Evaluations up to which counts are gone through one by one.
const AFFORDABLE: usize = 6_000;

/// The same of few photosites.
const AFFORDABLE_IF_FEW: usize = 400;

/// The same where rounding shows.
const AFFORDABLE_IF_FINE: usize = 150_000;

/// Counts of a smaller read noise are told apart by this, in e⁻.
const LEAST_NOISE_E: f64 = 0.1;

impl Shared {
    /// Of two laws that share the pattern of the dark current.
    pub fn of(light: Seen, dark: Seen) -> Self {
        thread_local! { static KNOWN: Memory<[Seen; 2], Shared> = const { Memory::new() }; }
        KNOWN.with(|known| known.recall([light, dark], |[light, dark]| Self::work_out(light, dark)))
    }

    fn work_out(light: &Seen, dark: &Seen) -> Self {
        if light.is_even() && dark.is_even() {
            return Self { light: 0.0, dark: 0.0, both: 0.0, median: None };
        }
        let (of_light, of_dark) = (Temporal::of(light), Temporal::of(dark));
        let (law, is_fine) = (&light.law, light.is_fine || dark.is_fine);
        let hidden_e = [light, dark].map(Seen::hidden_e);
        let at_std = |charge: &Charge| match hidden_e {
            [Some(a), Some(b)] => smooth_sensitivities(charge, of_light.std(), a.min(b)),
            _ => sensitivities(charge, of_light.std()),
        };
        let xs = if is_fine { fine_sensitivities(&law.light, of_light.finest()) } else { at_std(&law.light) };
        let wider = if law.dark.rate > dark.law.dark.rate { law.dark } else { dark.law.dark };
        let ys = if is_fine {
            fine_sensitivities(&wider, of_light.finest().min(of_dark.finest()))
        } else {
            at_std(&law.dark)
        };
        let is_light_summed = of_light.evaluations(xs.len() * ys.len()) <= of_light.affordable();
        let is_dark_summed = of_dark.evaluations(ys.len()) <= of_dark.affordable();
        let mut sums = Sums::default();
        let mut add = |[x, y]: [(f64, f64); 2], dark: Moments| {
            sums.add(x.1 * y.1, of_light.at(x.0, y.0, is_light_summed)[0], dark);
        };
        let at_dark = |y: f64| of_dark.at(1.0, y, is_dark_summed);
        if is_light_summed {
            for &y in &ys {
                let dark = at_dark(y.0);
                xs.iter().for_each(|&x| add([x, y], dark));
            }
            return sums.shared(dark);
        }
        let [along_light, along_dark] = [&law.light, &law.dark].map(Axis::of);
        let is_curved = is_fine || light.reading.is_bent() || dark.reading.is_bent();
        // Where it shows, means follow every edge of the codes, over what a photosite scatters by.
        let along_light = if is_fine { along_light.followed_over(of_light.std()) } else { along_light };
        // Bends for the dark signal: of most photosites, of those without light, and of dark frames.
        let mut bends = of_light.knees(along_dark, along_light, 1.0, along_light.spread());
        bends.extend(of_light.knees(along_dark, along_light, 0.0, 0.0));
        bends.extend(of_dark.knees(along_dark, along_light, 0.0, 0.0));
        for y in if is_fine { ys } else { along_dark.points(&bends, is_curved) } {
            let dark = at_dark(y.0);
            let bends = of_light.knees(along_light, along_dark, y.0, 0.0);
            along_light.points(&bends, is_curved).into_iter().for_each(|x| add([x, y], dark));
        }
        sums.shared(dark)
    }

    /// The variance that the pattern gives to a reading of one law.
    pub fn of_one(law: &Law, reading: &Reading) -> f64 {
        let seen = Seen { law: *law, reading: *reading, median_of: None, is_fine: false };
        Self::of(seen, seen).light
    }
}

/// Weighted sums of the means of light and of dark frames, their squares, and their product; and of the moments of dark frames.
#[derive(Debug, Default)]
struct Sums {
    light: [f64; 2],
    dark: [f64; 2],
    both: f64,
    moments: Moments,
}

impl Sums {
    fn add(&mut self, weight: f64, light: f64, dark: Moments) {
        self.light[0] += weight * light;
        self.light[1] += weight * light * light;
        self.dark[0] += weight * dark[0];
        self.dark[1] += weight * dark[0] * dark[0];
        self.both += weight * light * dark[0];
        for (sum, moment) in self.moments.iter_mut().zip(dark) {
            *sum += weight * moment;
        }
    }

    fn shared(&self, dark: &Seen) -> Shared {
        let variance = |[mean, square]: [f64; 2]| (square - mean * mean).max(0.0);
        let both = self.both - self.light[0] * self.dark[0];
        let median = dark.median_of.map(|_| Prediction::about(dark.reading.center, &self.moments));
        Shared { light: variance(self.light), dark: variance(self.dark), both, median }
    }
}

/// The means that photosites have over exposures, or moments of medians.
struct Temporal<'a> {
    law: &'a Law,
    reading: &'a Reading,
    median_of: Option<u32>,
    is_fine: bool,
    light: Vec<Count>,
    dark: Vec<Count>,
    /// What both reach; none where they are not listed.
    extents: Option<[Extent; 2]>,
    jumps: Vec<Jump>,
}

/// One of the ways in which a reading is off, and how often.
#[derive(Debug, Clone, Copy)]
struct Jump {
    share: f64,
    reading: Reading,
    at_full: f64,
    /// What rounding does to the mean at full well.
    rounding_at_full: f64,
}

impl Jump {
    fn of((share, offset_e): (f64, f64), reading: &Reading, full: f64) -> Self {
        let reading = reading.off_by(offset_e);
        let (at_full, smooth) =
            if full.is_finite() { (reading.at(full, 0.0)[0], reading.smooth_at(full)[0]) } else { (0.0, 0.0) };
        Self { share, reading, at_full, rounding_at_full: at_full - smooth }
    }
}

/// What counts reach, and their sums.
#[derive(Debug, Clone, Copy)]
struct Extent {
    least: f64,
    most: f64,
    /// The largest spread of one.
    spread: f64,
    /// Of their weights, and of these times electrons.
    weight: f64,
    sum: f64,
}

impl Extent {
    fn of(counts: &[Count]) -> Option<Self> {
        let first = counts.first()?.electrons;
        let start = Self { least: first, most: first, spread: 0.0, weight: 0.0, sum: 0.0 };
        Some(counts.iter().fold(start, |found, count| Self {
            least: found.least.min(count.electrons),
            most: found.most.max(count.electrons),
            spread: found.spread.max(count.spread),
            weight: found.weight + count.weight,
            sum: found.sum + count.weight * count.electrons,
        }))
    }
}

impl<'a> Temporal<'a> {
    fn of(Seen { law, reading, median_of, is_fine }: &'a Seen) -> Self {
        let noise_e = law.read_noise_e.max(1e-3);
        let [light, dark] = [law.light, law.dark].map(|charge| Charge { pattern: 0.0, ..charge });
        // More than are ever gone through are not listed.
        let affordable = if law.are_few { AFFORDABLE_IF_FEW } else { AFFORDABLE_IF_FINE };
        let is_listed = light.least_counts(noise_e) * dark.least_counts(noise_e) <= affordable as f64;
        let counts = |charge: &Charge| {
            let mut counts = if is_listed { charge.counts(noise_e) } else { Vec::new() };
            counts.retain(|count| count.weight > 1e-15);
            counts
        };
        let (light, dark) = (counts(&light), counts(&dark));
        Self {
            law,
            reading,
            median_of: *median_of,
            is_fine: *is_fine,
            extents: Extent::of(&light).zip(Extent::of(&dark)).map(Into::into),
            light,
            dark,
            jumps: law.jumps().into_iter().map(|jump| Jump::of(jump, reading, law.full_well_e)).collect(),
        }
    }

    /// What a photosite's charge scatters over exposures, or the median of so many, in e⁻.
    fn std(&self) -> f64 {
        let law = self.law;
        let one = law.light.shot_std().hypot(law.dark.shot_std()).hypot(law.read_noise_e).max(1e-9);
        self.median_of.map_or(one, |count| one / f64::from(count).sqrt())
    }

    /// What the mean of a photosite changes over as its sensitivity does, in e⁻: each count moves beyond an edge by itself.
    fn finest(&self) -> f64 {
        let is_counted = [self.law.light, self.law.dark].iter().any(|charge| charge.shot == Some(PoissonKind::Exact));
        if is_counted { self.std().min(self.law.read_noise_e.max(LEAST_NOISE_E)) } else { self.std() }
    }

    /// Evaluations up to which counts are gone through one by one.
    fn affordable(&self) -> usize {
        match self.is_fine {
            _ if self.law.are_few => AFFORDABLE_IF_FEW,
            true => AFFORDABLE_IF_FINE,
            false => AFFORDABLE,
        }
    }

    /// How often counts are gone through at so many sensitivities; of more than are listed no number would do.
    fn evaluations(&self, sensitivities: usize) -> usize {
        if self.light.is_empty() || self.dark.is_empty() {
            return usize::MAX;
        }
        sensitivities.saturating_mul(self.light.len()).saturating_mul(self.dark.len())
    }

    /// Where means bend along one axis, at a sensitivity of the other: at full well and at the ends of the codes. The other
    /// charge may spread out by `spread_e`, which widens the bends.
    fn knees(&self, axis: Axis, across: Axis, other: f64, spread_e: f64) -> Vec<Knee> {
        if axis.sigma <= 0.0 {
            return Vec::new();
        }
        let elsewhere = other * across.rate;
        let noise_e = self.law.read_noise_e;
        let rails = self.law.jumps().into_iter().flat_map(|(_, offset_e)| self.reading.off_by(offset_e).rails_e());
        let levels = std::iter::once((self.law.full_well_e, 0.0)).chain(rails.map(|rail| (rail, noise_e)));
        let knee = |(level, noise_e): (f64, f64)| {
            let own = (level - elsewhere).max(0.0);
            let shot = |axis: Axis, variance: f64| if axis.is_shot { variance } else { 0.0 };
            let of_shot = shot(axis, own * own / axis.rate) + shot(across, elsewhere * other);
            let z = ((level - elsewhere) / axis.rate - 1.0) / axis.sigma;
            Knee { z, width: (of_shot + noise_e * noise_e + spread_e * spread_e).sqrt() / axis.spread() }
        };
        let is_near = |knee: &Knee| knee.z.abs() < REACH * (1.0 + knee.width) + 1.0;
        levels.filter(|(level, _)| level.is_finite()).map(knee).filter(is_near).collect()
    }

    /// Moments at sensitivities x and y: of the median, or the mean and none else.
    fn at(&self, x: f64, y: f64, is_affordable: bool) -> Moments {
        if effort::is_spent() {
            return [0.0; 4];
        }
        match (self.median_of, self.reading.asked) {
            (Some(count), Asked::Codes(adc, ends)) => {
                let beyond = |code: f64| self.reaches(adc.electrons_at(code - 0.5), [x, y], is_affordable);
                let at_least = |code: f64| match code {
                    _ if code <= ends.lowest => 1.0,
                    _ if code > ends.highest => 0.0,
                    _ => beyond(code),
                };
                let expected_e = (x * self.law.light.rate + y * self.law.dark.rate).min(self.law.full_well_e);
                let near = ends.code(adc.level_at(expected_e + self.reading.offset_e));
                median(count, near, at_least, |code| adc.sample(code) - self.reading.center)
            }
            _ => {
                let mean = |jump: &Jump| {
                    let mean = if is_affordable {
                        self.sum(&jump.reading, jump.at_full, x, y)
                    } else {
                        self.edgeworth(jump, x, y)
                    };
                    jump.share * mean
                };
                [self.jumps.iter().map(mean).sum(), 0.0, 0.0, 0.0]
            }
        }
    }

    /// The probability that a reading, jumps and all, is no less than a level.
    fn reaches(&self, level_e: f64, [x, y]: [f64; 2], is_affordable: bool) -> f64 {
        let noise_e = self.law.read_noise_e;
        let reaches = |jump: &Jump| {
            let offset_e = jump.reading.offset_e;
            if !is_affordable {
                let read = self.law.cumulants_at([x, y]).plus(NearlyNormal::normal(0.0, noise_e.powi(2)));
                return jump.share * read.exceeds(level_e - offset_e);
            }
            // Ties go upward.
            let reading = Reading::beyond(noise_e, level_e - 1e-12 * level_e.abs().max(1.0)).off_by(offset_e);
            let full = self.law.full_well_e;
            let at_full = if full.is_finite() { reading.at(full, 0.0)[0] } else { 1.0 };
            jump.share * self.sum(&reading, at_full, x, y)
        };
        self.jumps.iter().map(reaches).sum()
    }

    /// The sum over counts; where these are all read straight, or as one code, of their mean.
    fn sum(&self, reading: &Reading, at_full: f64, x: f64, y: f64) -> f64 {
        let full = self.law.full_well_e;
        if let Some(mean) = self.even_sum(reading, x, y) {
            return mean;
        }
        let mut mean = 0.0;
        effort::spend((self.dark.len() * self.light.len()) as u64);
        for dark in &self.dark {
            for light in &self.light {
                let electrons = x * light.electrons + y * dark.electrons;
                let variance = (x * light.spread).powi(2) + (y * dark.spread).powi(2);
                let read = if electrons >= full { at_full } else { reading.mean_at(electrons, variance) };
                mean += light.weight * dark.weight * read;
            }
        }
        mean
    }

    /// The sum over counts none of which is full, nor read as an end of the codes by chance; none of others.
    fn even_sum(&self, reading: &Reading, x: f64, y: f64) -> Option<f64> {
        let [light, dark] = self.extents?;
        let spread = REACH * (x * light.spread).hypot(y * dark.spread);
        let low = x * light.least + y * dark.least - spread;
        let high = x * light.most + y * dark.most + spread;
        if high >= self.law.full_well_e {
            return None;
        }
        let weight = light.weight * dark.weight;
        if reading.is_one(low, high) {
            return Some(weight * reading.mean_at(low, 0.0));
        }
        let (slope, _) = reading.straight_between(low, high)?;
        let charge = x * light.sum * dark.weight + y * dark.sum * light.weight;
        Some(weight * reading.smooth_at(low)[0] + slope * (charge - weight * low))
    }

    fn edgeworth(&self, jump: &Jump, x: f64, y: f64) -> f64 {
        let Jump { reading, rounding_at_full, .. } = jump;
        effort::spend(4);
        let charge = self.law.cumulants_at([x, y]);
        let full = self.law.full_well_e;
        let [lower, upper] = reading.rails_e();
        let noise = NearlyNormal::normal(0.0, self.law.read_noise_e.powi(2));
        let (read, is_full) = if upper <= full { (charge.plus(noise), false) } else { (charge, full.is_finite()) };
        let above = |variable: NearlyNormal, limit: f64| if limit.is_finite() { variable.excess(limit) } else { 0.0 };
        let mut mean = read.mean - above(read, if is_full { full } else { upper });
        let whole = charge.plus(noise);
        let mirrored = NearlyNormal { mean: -whole.mean, third: -whole.third, ..whole };
        mean += above(mirrored, -lower);
        // Where it shows, rounding is that of a normal law.
        let shows = self.is_fine && reading.is_free_at(mean, whole.variance);
        let offset = if shows {
            reading.mean_at(mean, charge.variance)
        } else if self.is_fine && !is_full {
            let normal = NearlyNormal::normal(whole.mean, whole.variance);
            let below = NearlyNormal::normal(-whole.mean, whole.variance);
            let clipped = normal.mean - above(normal, upper) + above(below, -lower);
            reading.smooth_at(mean)[0] + reading.mean_at(whole.mean, charge.variance) - reading.smooth_at(clipped)[0]
        } else {
            reading.smooth_at(mean)[0]
        };
        if is_full { offset + rounding_at_full * charge.exceeds(full) } else { offset }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::normal::{cumulative, density};
    use crate::stages::noise::{LineNoise, NoiseModel, Tails};

    /// Of dark current that fills three of four wells, and none in one: what is left of the variance beside the pattern is the
    /// mean variance of a photosite over exposures, which a fine sum over sensitivities gives by itself.
    #[test]
    fn what_is_temporal_is_the_mean_variance_of_photosites() {
        for (light_e, dark_e, dcnu, full_well_e, read_noise_e) in [
            (9.9356, 168_124.0, 1.5752, 8021.84, 0.985_78),
            (8.1751, 340_076.0, 1.2045, 3491.55, 0.0),
            (2000.0, 900.0, 0.4, 3000.0, 4.0),
        ] {
            let model = NoiseModel {
                dark_e,
                dcnu,
                prnu: 0.0,
                read_noise_e,
                full_well_e,
                dark_shot: true,
                signal_shot: true,
                poisson: PoissonKind::Exact,
                lines: LineNoise::default(),
                tails: Tails::default(),
            };
            let law = Law::of(&model, light_e);
            let reading = law.of_electrons();
            let temporal = law.predict(&reading).moments.variance - Shared::of_one(&law, &reading);
            let of_photosite = |sensitivity: f64| {
                let skew = light_e + sensitivity.powi(3) * dark_e;
                let charge = NearlyNormal {
                    mean: light_e + sensitivity * dark_e,
                    variance: light_e + sensitivity.powi(2) * dark_e,
                    third: skew,
                    fourth: skew,
                };
                charge.clipped_above(full_well_e).variance
            };
            let (step, lowest) = (2e-6, -1.0 / dcnu);
            let mut expected = read_noise_e.powi(2) + cumulative(lowest) * light_e;
            // Above the well of most photosites nothing is left to vary.
            let above = ((2.0 * full_well_e / dark_e).min(4.0) - 1.0) / dcnu;
            let mut z = lowest + 0.5 * step;
            while z < above {
                expected += step * density(z) * of_photosite(1.0 + dcnu * z);
                z += step;
            }
            // A difference of variances a million times as large, each good to 10⁻¹⁰.
            assert!((temporal / expected - 1.0).abs() < 1e-3, "{temporal} {expected}");
        }
    }
}
