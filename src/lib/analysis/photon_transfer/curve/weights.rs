//! What the levels of a curve count in its fits.

use super::super::fit::{Line, Point, variance_besides};
use super::super::scatter::{Component, among, few};
use super::{Curve, Datum, Point4, Weights};
use crate::numerics::significance;
use crate::text::in_digits;

/// The probability to be beyond 5 standard deviations of a normal law.
pub const BEYOND_FIVE: f64 = 5.7e-7;

impl Curve {
    /// Weights, from the first fit on at its levels; what points miss their lines by is added to what they scatter by.
    pub(super) fn weigh(&mut self) {
        self.weigh_darks();
        let fitted: Vec<Point4> = self.fitted.iter().map(|&flat| self.flats[flat].clone()).collect();
        let relative = relative_scatter_of(&fitted);
        let parameters = if self.is_offset_free { 2 } else { 1 };
        let freedom = self.fitted.len().saturating_sub(parameters) as f64;
        let mut besides = 0.0;
        for _ in 0..3 {
            let Some(line) = self.gain_line() else { return };
            let own: Vec<f64> = self
                .fitted
                .iter()
                .map(|&flat| {
                    let dark = self.no_light(flat).map_or(0.0, |[_, variance]| variance);
                    let level = line.at(self.charge_of_noise(flat)) + if self.is_offset_free { 0.0 } else { dark };
                    let point = &self.flats[flat];
                    let beneath = self.scatter_beneath(flat);
                    let of_dark = if self.is_offset_free { 0.0 } else { beneath[1] };
                    relative / point.freedom * level.max(self.rounding).powi(2)
                        + point.variance.hidden.powi(2)
                        + of_dark
                        + line.slope.powi(2) * (point.mean.scatter() + beneath[0])
                })
                .collect();
            let points: Vec<Point> = self.gain_points().collect();
            let weight = |own: &f64, besides: f64| 1.0 / (own + besides).max(f64::MIN_POSITIVE);
            let misfit = |besides: f64| {
                let weighed =
                    points.iter().zip(&own).map(|(point, own)| Point { weight: weight(own, besides), ..*point });
                self.line_of_gain(weighed.clone()).map_or(0.0, |line| line.chi_square(weighed))
            };
            let largest = self.fitted.iter().map(|&flat| self.noise(flat).powi(2)).fold(0.0, f64::max);
            besides = if freedom > 0.0 { variance_besides(freedom, misfit, largest) } else { 0.0 };
            let missed = misfit(0.0);
            let is_beyond = missed > freedom && significance::of_chi_square(missed, freedom) < BEYOND_FIVE;
            self.gain_error = is_beyond.then(|| (besides / largest).sqrt());
            self.weights.gain = own.iter().map(|own| weight(own, besides)).collect();
            self.weights.own = own;
        }
        for &flat in &self.fitted {
            self.flats[flat].variance.variance += besides;
        }
        self.weigh_response();
    }

    fn weigh_darks(&mut self) {
        let weigh = |of: fn(&Point4) -> Datum, besides: f64| -> Vec<f64> {
            self.darks.iter().map(|dark| 1.0 / (of(dark).scatter() + besides).max(f64::MIN_POSITIVE)).collect()
        };
        let (means, variances) = (weigh(|dark| dark.mean, 0.0), weigh(|dark| dark.variance, 0.0));
        (self.weights.dark_mean, self.weights.dark_variance) = (means, variances);
        let freedom = self.whole_darks().count() as f64 - 2.0;
        // What code 0 cuts off is no line.
        if self.times() < 2 || freedom <= 0.0 || self.are_darks_clipped {
            return;
        }
        // A variance that is low by chance does not count more.
        let relative = relative_scatter_of(&self.darks);
        for _ in 0..2 {
            let Some([_, line]) = self.dark_lines() else { return };
            for (dark, weight) in self.darks.iter_mut().zip(&mut self.weights.dark_variance) {
                let level = line.at(dark.exposure_s.unwrap_or(0.0)).max(self.rounding).max(0.5 * dark.variance.value);
                dark.variance.variance = relative / dark.freedom * level * level;
                *weight = 1.0 / dark.variance.scatter().max(f64::MIN_POSITIVE);
            }
        }
        self.weigh_dark_means(freedom);
        let (found, _) = self.off_line(|dark| dark.variance, freedom);
        let besides = found.known(self.confidence);
        for (dark, weight) in self.darks.iter_mut().zip(&mut self.weights.dark_variance) {
            dark.variance.variance += besides;
            *weight = 1.0 / dark.variance.scatter().max(f64::MIN_POSITIVE);
        }
    }

    /// What means of darks miss their line by besides is an error of their line alone where the response bends, and else one of black.
    fn weigh_dark_means(&mut self, freedom: f64) {
        /// So much of what darks miss their line by is left where they are straightened, at most: a variance.
        const LEFT: f64 = 0.1;
        let (found, misfit) = self.off_line(Point4::mean_of_line, freedom);
        let besides = found.known(self.confidence);
        if besides <= 0.0 {
            return;
        }
        let left = self.straightened().map(|straight| straight.off_line(Point4::mean_of_line, freedom).0);
        let is_bent = left.is_some_and(|left| left.variance <= LEFT * found.variance);
        let (missed, cause) = (found.variance.sqrt(), self.cause(is_bent));
        self.dark_told = self.dark_told.take().or(told_off_line(misfit, freedom, missed, &cause));
        if is_bent {
            self.darks.iter_mut().for_each(|dark| dark.bent.variance = besides);
        } else {
            self.dark_drift = self.dark_drift.max(self.drift_of(misfit, freedom, missed));
            self.dark_besides = found;
            // A black level that moves does so under light too.
            self.darks.iter_mut().chain(&mut self.flats).for_each(|level| level.mean.variance += besides);
        }
        self.weights.dark_mean = self.darks.iter().map(|dark| 1.0 / dark.mean_of_line().scatter()).collect();
    }

    /// Why darks miss their line over time, in words.
    fn cause(&self, is_bent: bool) -> String {
        if is_bent {
            return ", as the response bends, which it does as much under light; intervals of dark current and black level take that in".into();
        }
        let or_bends = match self.curvature(0.0) {
            Some(_) => "",
            None => ", or the response bends, which flats of known light would tell",
        };
        format!(
            ": the black level moves between them, exposure times are wrong, or the sensor was warmer for some{or_bends}; intervals of dark \
             current, black level and linearity take that in"
        )
    }

    /// What darks miss their line over time by besides their own scatter, and the sum of squares that tells it.
    fn off_line(&self, of: fn(&Point4) -> Datum, freedom: f64) -> (Component, f64) {
        let points = |besides: f64| -> Vec<Point> {
            let point = |dark: &Point4| {
                let weight = 1.0 / (of(dark).scatter() + besides).max(f64::MIN_POSITIVE);
                Some(Point { x: dark.exposure_s?, y: of(dark).value, weight })
            };
            self.whole_darks().filter_map(point).collect()
        };
        let misfit = |besides: f64| {
            let points = points(besides);
            Line::through(points.clone()).map_or(0.0, |line| line.chi_square(points))
        };
        let largest = self.whole_darks().map(|dark| of(dark).value.powi(2)).fold(0.0, f64::max);
        (among(freedom, misfit, largest), misfit(0.0))
    }

    /// How far black may have moved from the first of the darks to the last, in the order of their times, where they miss their line by so much
    /// beyond chance: most of what moves evenly is taken for dark current, and only the rest is missed.
    fn drift_of(&self, misfit: f64, freedom: f64, missed: f64) -> f64 {
        /// What is less likely is reckoned with.
        const LEVEL: f64 = 1e-2;
        /// Of times that are even the line hides all: no more than so many times what is missed is reckoned with.
        const MOST: f64 = 10.0;
        if significance::of_chi_square(misfit, freedom) >= LEVEL {
            return 0.0;
        }
        let places = self.darks.iter().zip(self.places_in_time()).filter(|(dark, _)| dark.is_whole);
        let points: Vec<Point> =
            places.filter_map(|(dark, y)| Some(Point { x: dark.exposure_s?, y, weight: 1.0 })).collect();
        let Some(line) = Line::through(points.clone()) else { return 0.0 };
        let left = (line.chi_square(points) / freedom).sqrt();
        missed * left.recip().min(MOST)
    }

    fn weigh_response(&mut self) {
        let parameters = if self.is_response_free { 2.0 } else { 1.0 };
        let freedom = self.response_points().count() as f64 - parameters;
        if freedom < 0.0 {
            return;
        }
        let weights = |besides: f64, share: f64| -> Vec<f64> {
            let own = |&flat: &usize| {
                let (point, signal) = (&self.flats[flat], self.signal(flat));
                let of_black = if self.is_response_free { 0.0 } else { self.scatter_beneath(flat)[0] };
                let scatter = point.mean.scatter() + of_black;
                scatter + besides + (share + point.light_variance) * signal.powi(2)
            };
            self.fitted.iter().map(|flat| 1.0 / own(flat).max(f64::MIN_POSITIVE)).collect()
        };
        let misfit = |besides: f64, share: f64| {
            let response = weights(besides, share);
            let weighted = Self { weights: Weights { response, ..self.weights.clone() }, ..self.clone() };
            weighted.response_line().map_or(0.0, |line| line.chi_square(weighted.response_points()))
        };
        let largest = self.fitted.iter().map(|&flat| self.signal(flat).powi(2)).fold(0.0, f64::max);
        let [besides, share] = if freedom > 0.0 {
            let alike = variance_besides(freedom, |besides| misfit(besides, 0.0), largest);
            [alike, variance_besides(freedom, |share| misfit(0.0, share), 1.0)]
        } else {
            [0.0; 2]
        };
        self.weights.response = weights(besides, 0.0);
        self.light_error = share.sqrt();
        // What they miss it by is an error of the light: it tells nothing of the gain. It may be alike at all levels, or in proportion
        // to them, as that of a lamp that flickers; the larger counts, and it is known from few levels.
        let Some(line) = self.response_line() else { return };
        let few = few(freedom, self.confidence);
        for flat in 0..self.flats.len() {
            let signal = self.signal(flat);
            let missed = few * besides.max(share * signal * signal);
            if let Some(photons) = &mut self.flats[flat].photons {
                photons.variance += missed / line.slope.powi(2);
            }
        }
    }
}

/// What is said of darks whose means miss their line over time by so much besides their own scatter, a standard deviation, if that is beyond
/// chance.
fn told_off_line(misfit: f64, freedom: f64, besides: f64, cause: &str) -> Option<(String, bool)> {
    /// Less likely is beyond chance.
    const LEVEL: f64 = 1e-4;
    let is_beyond = misfit > freedom && significance::of_chi_square(misfit, freedom) < LEVEL;
    is_beyond.then(|| {
        let missed = in_digits(besides, 3);
        let text = format!(
            "means of darks miss their line over exposure time by {missed} ADU more than their frames scatter by{cause}"
        );
        (text, true)
    })
}

/// Relative variance of a variance, times its freedom, over several levels: 2 of normal noise. Of each its freedom, the variance and what that
/// scatters by, a variance.
pub fn relative_scatter(levels: impl Iterator<Item = (f64, f64, f64)> + Clone) -> f64 {
    let all: f64 = levels.clone().map(|(freedom, ..)| freedom).sum();
    let share = |(freedom, value, scatter): (f64, f64, f64)| freedom / all * freedom * scatter / (value * value);
    let pooled: f64 = levels.filter(|(_, value, _)| *value > 0.0).map(share).sum();
    if pooled > 0.0 { pooled } else { 2.0 }
}

/// The same of points.
fn relative_scatter_of(points: &[Point4]) -> f64 {
    relative_scatter(points.iter().map(|point| (point.freedom, point.variance.value, point.variance.variance)))
}
