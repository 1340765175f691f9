//! The photon transfer curve of a class: gain, dark noise, responsivity and dark current, with what they are uncertain by.
//!
//! Of flats above the dark level, σ² − σ_d² = K (μ − μ_d) \[EMVA1288, Eq. 13], and μ − μ_d = R μ_p \[EMVA1288, Eq. 9]; of darks,
//! μ_d = μ_0 + K I t and σ_d² = σ_0² + K² I t \[EMVA1288, Eqs. 4, 5].
//!
//! Every point has the weight of what both of its coordinates scatter by, worked out at the level of the fit, so that a point
//! that lies low by chance counts no more than one that lies high. Intervals follow from how each number changes with each mean and
//! variance that was measured, which are independent. Where points miss their line by more than they scatter, as those of a camera
//! that is not quite linear do, all of them have one more error, alike, which is as large as they miss it: then the line tends to
//! that of equal weights, which the standard fits.

mod bend;
mod ends;
mod intervals;
mod moved;
mod point;
mod response;
mod values;
mod weights;

pub use ends::{
    LEAST_VARIANCE, are_whole, below_saturation, cut_off, first_cut, full_mean, hot_share, is_clipped, may_be_largest,
    stuck_shares, without_clipped, without_stuck,
};
pub use values::Values;
pub use weights::{BEYOND_FIVE, relative_scatter};

use super::fit::{Line, Point};
use super::level::{Level, SAME_TIME, is_same_time};
use super::pattern::{Part, fixed};
use super::scatter::{Component, Scatter};
use super::settings::Settings;
use crate::numerics::variance_components::Interval;
use ends::peak;
use moved::Remembered;
use point::{Datum, Point4};

/// The fits end at this share of saturation [EMVA1288, Sec. 6.5].
const HIGHEST: f64 = 0.7;
/// Patterns under light are measured to this share of saturation: few photosites see a tenth more than the mean.
const HIGHEST_PATTERN: f64 = 0.9;
/// Where the dark signal beneath a flat is known from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beneath {
    /// A dark level.
    Dark(usize),
    /// The lines through all.
    Lines,
    /// Nowhere.
    Unknown,
}

/// The levels of a class, and how they are fitted.
#[derive(Debug, Clone)]
pub struct Curve {
    flats: Vec<Point4>,
    darks: Vec<Point4>,
    /// Exposure times of darks that the lines over time take.
    dark_times: usize,
    beneath: Vec<Beneath>,
    /// Flats that the fits of gain and responsivity take.
    fitted: Vec<usize>,
    /// Flats that patterns under light may be measured on.
    patterned: Vec<usize>,
    /// The flat whose variance is the largest, where brighter ones have less.
    pub saturated: Option<usize>,
    /// The flat from which on part of the photosites is cut off, where no variance falls.
    pub cut_from: Option<usize>,
    /// Whether the variance of no light is left to the fit, as darks are silent beneath the rounding, clipped, or absent, or of times that
    /// are not known.
    pub is_offset_free: bool,
    /// Whether there are darks, and their temporal noise is so small that rounding hides it.
    pub is_silent: bool,
    /// Whether darks are clipped at 0, and too few others are there.
    pub are_darks_clipped: bool,
    /// Whether the response is told by how the mean of flats of one exposure time rises with light, whatever black is.
    is_response_free: bool,
    /// The share of the light that signals miss their line by, beyond what they scatter by: a standard deviation.
    pub light_error: f64,
    /// What variances of flats miss the line of the gain by beyond what they scatter by, as a share of the largest; none where that may be
    /// chance.
    pub gain_error: Option<f64>,
    /// What is to be said of darks whose means miss their line over time by more than they scatter, and whether it is a doubt.
    pub dark_told: Option<(String, bool)>,
    /// What means of darks miss that line by besides.
    dark_besides: Component,
    /// How far the black level may have moved from the darks of the shortest time to those of the longest, at most, in their order.
    dark_drift: f64,
    confidence: f64,
    photon_error: f64,
    rounding: f64,
    weights: Weights,
    moved: Remembered,
}

#[derive(Debug, Clone, Default)]
struct Weights {
    gain: Vec<f64>,
    /// What points of the gain scatter by without what they miss their line by, variances.
    own: Vec<f64>,
    response: Vec<f64>,
    dark_mean: Vec<f64>,
    dark_variance: Vec<f64>,
}

/// How many exposure times the darks have that the lines over time take.
fn times_of(darks: &[Point4]) -> usize {
    let mut times: Vec<f64> = darks.iter().filter(|dark| dark.is_whole).filter_map(|dark| dark.exposure_s).collect();
    times.sort_by(f64::total_cmp);
    times.dedup_by(|a, b| (*a - *b).abs() <= SAME_TIME * b.abs());
    times.len()
}

impl Curve {
    /// Of flats in the order of their light, and darks of one temperature, whose frames scatter so beyond noise. None where no gain
    /// follows.
    pub fn of(flats: &[Level], darks: &[Level], scatter: &Scatter, settings: &Settings) -> Option<Self> {
        let rounding = settings.rounding();
        let point = |level: &Level| Point4::of(level, scatter, settings);
        let of_dark = |(dark, is_whole): (&Level, bool)| Point4 { is_whole, ..point(dark) };
        let are_darks_clipped = darks.iter().any(|dark| is_clipped(dark, rounding));
        let is_silent = rounding > 0.0 && darks.iter().all(|dark| dark.variance < LEAST_VARIANCE);
        let hot = hot_share(darks);
        let dark_points: Vec<Point4> = darks.iter().zip(are_whole(darks)).map(of_dark).collect();
        let mut curve = Self {
            beneath: Vec::new(),
            flats: flats.iter().map(point).collect(),
            dark_times: times_of(&dark_points),
            darks: dark_points,
            fitted: Vec::new(),
            patterned: Vec::new(),
            saturated: peak(flats),
            cut_from: first_cut(flats, darks, rounding),
            is_offset_free: is_silent || are_darks_clipped,
            is_silent: is_silent && !darks.is_empty(),
            are_darks_clipped,
            is_response_free: false,
            light_error: 0.0,
            gain_error: None,
            dark_told: None,
            dark_besides: Component::NONE,
            dark_drift: 0.0,
            confidence: settings.confidence,
            photon_error: settings.photon_error,
            rounding,
            weights: Weights::default(),
            moved: Remembered::default(),
        };
        curve.beneath = curve.flats.iter().map(|flat| curve.beneath(flat)).collect();
        let no_light = |index: usize| curve.no_light(index).map_or(0.0, |[mean, _]| mean);
        let signal = |flat: usize| flats[flat].mean - no_light(flat);
        // What is cut off ends less than a spread of the photosites above.
        let saturation = curve.saturated.or(curve.cut_from).map_or(f64::INFINITY, signal);
        let whole = |highest: f64| -> Vec<usize> {
            let is_whole = |&index: &usize| {
                let is_told = cut_off(&flats[index], hot, rounding).is_none();
                is_told && signal(index) <= highest * saturation
            };
            (0..flats.len()).filter(is_whole).collect()
        };
        (curve.fitted, curve.patterned) = (whole(HIGHEST), whole(HIGHEST_PATTERN));
        if curve.fitted.is_empty() && curve.cut_from.is_some() {
            curve.fitted = curve.patterned.clone();
        }
        if !curve.is_offset_free && curve.fitted.iter().any(|&index| curve.beneath[index] == Beneath::Unknown) {
            curve.is_offset_free = true;
        }
        curve.is_response_free = are_darks_clipped && curve.are_of_one_time();
        let needed = if curve.is_offset_free { 2 } else { 1 };
        if curve.fitted.len() < needed {
            return None;
        }
        // Between any two darks all other frames may have been taken.
        curve.drift_over(scatter.drift, flats.iter().chain(darks).map(|level| level.frames).sum());
        curve.weigh();
        Some(curve)
    }

    /// The flats that gain and responsivity are fitted to, by their places.
    pub fn fitted(&self) -> &[usize] {
        &self.fitted
    }

    /// The flats that patterns under light may be measured on, by their places.
    pub fn patterned(&self) -> &[usize] {
        &self.patterned
    }

    fn beneath(&self, flat: &Point4) -> Beneath {
        let is_same = |dark: &Point4| is_same_time(dark.exposure_s, flat.exposure_s);
        match self.darks.iter().position(is_same) {
            Some(dark) => Beneath::Dark(dark),
            None if flat.exposure_s.is_some() && self.times() >= 2 => Beneath::Lines,
            // A camera whose dark signal is not known in time: the level of the only darks.
            None if self.darks.len() == 1 => Beneath::Dark(0),
            None => Beneath::Unknown,
        }
    }

    /// Darks that the lines over time take.
    fn whole_darks(&self) -> impl Iterator<Item = &Point4> {
        self.darks.iter().filter(|dark| dark.is_whole)
    }

    /// How many exposure times the darks have of which no more photosites are cut off than of all.
    pub fn times(&self) -> usize {
        self.dark_times
    }

    /// Lines of mean and variance of the darks over time, where there are several times.
    fn dark_lines(&self) -> Option<[Line; 2]> {
        if self.times() < 2 {
            return None;
        }
        let line = |of: fn(&Point4) -> f64, weights: &[f64]| {
            let point = |(index, dark): (usize, &Point4)| {
                Some(Point { x: dark.exposure_s?, y: of(dark), weight: weights.get(index).copied().unwrap_or(1.0) })
            };
            Line::through(self.darks.iter().enumerate().filter(|(_, dark)| dark.is_whole).filter_map(point))
        };
        let mean = line(|dark| dark.mean_of_line().value, &self.weights.dark_mean)?;
        Some([mean, line(|dark| dark.variance.value, &self.weights.dark_variance)?])
    }

    /// Mean and variance of no light beneath a flat.
    fn no_light(&self, flat: usize) -> Option<[f64; 2]> {
        match self.beneath.get(flat)? {
            Beneath::Dark(dark) => Some([self.darks[*dark].mean.value, self.darks[*dark].variance.value]),
            Beneath::Lines => {
                let time = self.flats[flat].exposure_s?;
                self.dark_lines().map(|lines| lines.map(|line| line.at(time)))
            }
            Beneath::Unknown => None,
        }
    }

    /// Mean above no light.
    pub fn signal(&self, flat: usize) -> f64 {
        self.flats[flat].mean.value - self.no_light(flat).map_or(0.0, |[mean, _]| mean)
    }

    /// The exposure times in s of darks, the least and the largest, that stand beneath flats of another time, and the time of the
    /// flat that is farthest off these; none where that is within them, or darks of all times are there.
    pub fn other_time(&self) -> Option<([f64; 2], f64)> {
        let times = || self.darks.iter().filter_map(|dark| dark.exposure_s);
        let ends = [times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max)];
        let off = |(flat, beneath): (&Point4, &Beneath)| {
            let time = flat.exposure_s?;
            let is_other = match beneath {
                Beneath::Dark(dark) => (self.darks[*dark].exposure_s? - time).abs() > SAME_TIME * time,
                Beneath::Lines => !(ends[0]..=ends[1]).contains(&time),
                Beneath::Unknown => false,
            };
            is_other.then(|| (time, (time / ends[1]).max(ends[0] / time)))
        };
        let farthest = self.flats.iter().zip(&self.beneath).filter_map(off).max_by(|a, b| a.1.total_cmp(&b.1));
        farthest.map(|(time, _)| (ends, time))
    }

    /// Whether some flats, or the only darks beneath them, do not tell their exposure time, and others do.
    pub fn is_time_unknown(&self) -> bool {
        let differ = |(flat, beneath): (&Point4, &Beneath)| match beneath {
            Beneath::Dark(dark) => flat.exposure_s.is_some() != self.darks[*dark].exposure_s.is_some(),
            _ => false,
        };
        self.flats.iter().zip(&self.beneath).any(differ)
    }

    /// Whether more photosites of some darks are cut off than of all.
    pub fn are_darks_cut_off(&self) -> bool {
        self.darks.iter().any(|dark| !dark.is_whole)
    }

    /// The whole charge of a flat, in samples: its mean above no light and no time; and how much more it may be, at most: where darks of
    /// one time alone are there, the dark signal that their variance has room for. None where darks tell no black level.
    pub fn charge(&self, flat: usize) -> Option<(Interval, f64)> {
        let mean = &self.flats[flat].mean;
        let Interval { value, low, high } = Interval::normal(mean.value, mean.scatter(), self.confidence);
        if let Some(black) = self.interval(|values| values.black, self.confidence) {
            let below = (value - low).hypot(black.high - black.value);
            let above = (high - value).hypot(black.value - black.low);
            let value = value - black.value;
            return Some((Interval { value, low: value - below, high: value + above }, 0.0));
        }
        let values = self.values()?;
        let (dark, variance) = (self.no_light(flat)?[0], values.dark_variance?);
        // Shot noise of so much charge is all that darks are uncertain by.
        let room = (variance - self.rounding).max(0.0) / values.gain;
        Some((Interval { value: value - dark, low: low - dark, high: high - dark }, room))
    }

    /// Whether the mean of no light beneath a flat is known.
    pub fn knows_black(&self, flat: usize) -> bool {
        self.no_light(flat).is_some()
    }

    /// Whether the dark noise is what the line through the flats ends in, as the darks that there are do not tell it.
    pub fn is_noise_of_line(&self) -> bool {
        self.is_offset_free && !self.tells_dark_noise()
    }

    /// Whether what the variance of a flat goes by is above no light.
    fn knows_charge(&self, flat: usize) -> bool {
        self.times() >= 2 || self.knows_black(flat)
    }

    /// The exposure time that the dark noise is of, in s, where it is known; none of noise of no time.
    pub fn time_of_noise(&self) -> Option<Option<f64>> {
        if self.is_noise_of_line() {
            let longest = || self.fitted.iter().filter_map(|&flat| self.flats[flat].exposure_s).reduce(f64::max);
            return (self.times() < 2).then(longest);
        }
        let shortest = || self.darks.iter().filter_map(|dark| dark.exposure_s).reduce(f64::min);
        (self.times() < 3).then(shortest).filter(|time| *time != Some(0.0))
    }

    /// How many darks the dark noise is told by; none where the line through several exposure times, or through the flats, tells it.
    pub fn frames_of_noise(&self) -> Option<f64> {
        let time = |dark: &&Point4| dark.exposure_s.unwrap_or(f64::INFINITY);
        let shortest = self.darks.iter().min_by(|a, b| time(a).total_cmp(&time(b))).map(|dark| dark.frames);
        shortest.filter(|_| self.times() < 3 && self.tells_dark_noise())
    }

    /// Whether the temporal variance of darks is that of their noise.
    pub fn tells_dark_noise(&self) -> bool {
        !self.is_silent && !self.are_darks_clipped
    }

    /// Whether rounding hides what the pattern of a dark is, as temporal noise and pattern together do not spread codes enough, or
    /// code 0 cuts it off.
    pub fn hides(&self, dark: Option<&Level>, confidence: f64) -> bool {
        let spread = |dark: &Level| dark.variance + fixed(dark, Part::Total, confidence).value;
        self.are_darks_clipped || self.is_silent && dark.is_some_and(|dark| spread(dark) < LEAST_VARIANCE)
    }

    /// Temporal variance above that of no light; of a curve whose offset is free, all of it.
    pub fn noise(&self, flat: usize) -> f64 {
        let dark = if self.is_offset_free { 0.0 } else { self.no_light(flat).map_or(0.0, |[_, variance]| variance) };
        self.flats[flat].variance.value - dark
    }

    /// What the variance of a flat goes by: its mean above no light; or, where the line ends in the variance of no light, its whole charge,
    /// above no light and no time, where darks tell that: so that no shot noise of the dark charge stands at the end. Of darks that code 0 cuts
    /// off nothing is known but that black is the same beneath all flats: it is the mean itself, which has the dark charge in it.
    pub fn charge_of_noise(&self, flat: usize) -> f64 {
        if self.are_darks_clipped {
            return self.flats[flat].mean.value;
        }
        let lines = if self.is_offset_free { self.dark_lines() } else { None };
        lines.map_or_else(|| self.signal(flat), |[mean, _]| self.flats[flat].mean.value - mean.offset)
    }

    fn gain_points(&self) -> impl Iterator<Item = Point> + Clone {
        self.fitted.iter().enumerate().map(|(place, &flat)| Point {
            x: self.charge_of_noise(flat),
            y: self.noise(flat),
            weight: self.weights.gain.get(place).copied().unwrap_or(1.0),
        })
    }

    fn gain_line(&self) -> Option<Line> {
        self.line_of_gain(self.gain_points().collect::<Vec<_>>())
    }

    fn line_of_gain(&self, points: impl IntoIterator<Item = Point> + Clone) -> Option<Line> {
        if self.is_offset_free { Line::through(points) } else { Line::through_zero(points) }
    }

    /// What scatters beneath a flat: of the mean and of the variance of no light.
    fn scatter_beneath(&self, flat: usize) -> [f64; 2] {
        match self.beneath[flat] {
            Beneath::Dark(dark) => [self.darks[dark].mean.scatter(), self.darks[dark].variance.scatter()],
            Beneath::Lines => {
                let count = self.whole_darks().count() as f64;
                // What rounding hides does not average out.
                let of = |of: fn(&Point4) -> Datum| {
                    let hidden = self.whole_darks().map(|dark| of(dark).hidden).fold(0.0, f64::max);
                    self.whole_darks().map(|dark| of(dark).variance).sum::<f64>() / (count * count) + hidden * hidden
                };
                [of(Point4::mean_of_line), of(|dark| dark.variance)]
            }
            Beneath::Unknown => [0.0; 2],
        }
    }

    /// What the levels lead to.
    pub fn values(&self) -> Option<Values> {
        let line = self.gain_line()?;
        let dark_lines = self.dark_lines();
        let lines = dark_lines.filter(|_| self.times() >= 3);
        let shortest = || {
            let time = |dark: &&Point4| dark.exposure_s.unwrap_or(f64::INFINITY);
            self.darks.iter().min_by(|a, b| time(a).total_cmp(&time(b)))
        };
        let mean = lines.map(|[mean, _]| mean.offset).or_else(|| shortest().map(|dark| dark.mean.value));
        let measured =
            lines.map(|[_, variance]| variance.offset).or_else(|| shortest().map(|dark| dark.variance.value));
        let has_darks = !self.darks.is_empty() && !self.are_darks_clipped;
        let by_line = || self.fitted.iter().all(|&flat| self.knows_charge(flat)).then_some(line.offset);
        let dark_variance = if self.is_noise_of_line() { by_line() } else { measured };
        Some(Values {
            gain: line.slope,
            dark_variance: dark_variance.filter(|_| has_darks),
            dark_mean: mean.filter(|_| has_darks),
            black: dark_lines.map(|[mean, _]| mean.offset).filter(|_| has_darks),
            responsivity: self.response_line().map(|line| line.slope),
            dark_slope: lines.map(|[mean, _]| mean.slope).filter(|_| has_darks),
            dark_variance_slope: lines
                .map(|[_, variance]| variance.slope)
                .filter(|_| has_darks && self.tells_dark_noise()),
        })
    }

    /// What the mean above no light scatters by: noise; black levels, whose frames scatter so; and what darks miss their line by.
    pub fn variance_parts(&self, flat: usize, scatter: &Scatter) -> [Component; 3] {
        let own = &self.flats[flat];
        let share = 1.0 / own.frames;
        let [noise, frames, levels] = match self.beneath[flat] {
            Beneath::Dark(dark) => [self.darks[dark].noise, 1.0 / self.darks[dark].frames, 1.0],
            Beneath::Lines => {
                let count = self.whole_darks().count() as f64;
                let mean = |of: fn(&Point4) -> f64| self.whole_darks().map(of).sum::<f64>() / (count * count);
                [mean(|dark| dark.noise), mean(|dark| 1.0 / dark.frames), 1.0 / count]
            }
            Beneath::Unknown => [0.0; 3],
        };
        let hidden = own.mean.hidden.hypot(self.hidden_beneath(flat));
        let noise = Component { variance: own.noise + noise + hidden * hidden, ..Component::NONE };
        [noise, scatter.black.times(share + frames), self.dark_besides.times(1.0 + levels)]
    }

    /// What the mean above no light scatters by, a variance.
    pub fn signal_variance(&self, flat: usize) -> f64 {
        self.flats[flat].mean.scatter() + self.scatter_beneath(flat)[0]
    }

    /// How far rounding may have the mean of no light beneath a flat off, at most.
    fn hidden_beneath(&self, flat: usize) -> f64 {
        match self.beneath[flat] {
            Beneath::Dark(dark) => self.darks[dark].mean.hidden,
            Beneath::Lines => self.whole_darks().map(|dark| dark.mean.hidden).fold(0.0, f64::max),
            Beneath::Unknown => 0.0,
        }
    }
}
