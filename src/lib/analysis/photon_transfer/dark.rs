//! What darks tell beyond one temperature and one exposure time: how dark current rises with temperature, and how it differs from
//! photosite to photosite.

use super::curve::{are_whole, is_clipped, relative_scatter};
use super::fit::{Line, Point};
use super::level::Level;
use super::pattern::{Part, hidden_pattern, temporal};
use super::reasons::{CLIPPED, CUT_OFF};
use super::scatter::{Scatter, among};
use crate::numerics::variance_components::{Interval, MeanSquare, combination};
use std::f64::consts::LN_2;

/// A line through points with what its slope and offset scatter by, variances, for intervals of such confidence; points miss it by no
/// more than they scatter, or else all have one more error alike.
fn fitted(points: &[(f64, f64, f64)], confidence: f64) -> Option<(Line, [f64; 2])> {
    let weighted = |besides: f64| -> Vec<Point> {
        points
            .iter()
            .map(|(x, y, variance)| Point { x: *x, y: *y, weight: 1.0 / (variance + besides).max(f64::MIN_POSITIVE) })
            .collect()
    };
    let misfit = |besides: f64| Line::through(weighted(besides)).map_or(0.0, |line| line.chi_square(weighted(besides)));
    let freedom = points.len() as f64 - 2.0;
    let largest = points.iter().map(|(_, y, _)| y * y).fold(0.0, f64::max);
    let points = weighted(among(freedom, misfit, largest).known(confidence));
    let line = Line::through(points.clone())?;
    let all: f64 = points.iter().map(|point| point.weight).sum();
    let mean = points.iter().map(|point| point.weight * point.x).sum::<f64>() / all;
    let spread: f64 = points.iter().map(|point| point.weight * (point.x - mean).powi(2)).sum();
    Some((line, [1.0 / all + mean * mean / spread, 1.0 / spread]))
}

/// The same of a signal over time, where what points miss the line by may be in proportion to it besides, as of wrong times: the
/// larger error of the slope counts.
fn fitted_in_time(points: &[(f64, f64, f64)], confidence: f64) -> Option<(Line, [f64; 2])> {
    let (line, variances) = fitted(points, confidence)?;
    let share = |share: f64| -> Vec<(f64, f64, f64)> {
        points.iter().map(|(x, y, variance)| (*x, *y, variance + share * (line.slope * x).powi(2))).collect()
    };
    let misfit = |of: f64| {
        let points: Vec<Point> =
            share(of).into_iter().map(|(x, y, variance)| Point { x, y, weight: 1.0 / variance }).collect();
        Line::through(points.clone()).map_or(0.0, |line| line.chi_square(points))
    };
    let found = among(points.len() as f64 - 2.0, misfit, 1.0).known(confidence);
    // With these errors of their own the points miss the line by no more.
    let (other, others) = fitted(&share(found), confidence)?;
    Some(if others[1] > variances[1] { (other, others) } else { (line, variances) })
}

/// The temperature step that doubles the dark current, K, from darks at several temperatures, each at several times:
/// log₂ I is a line over temperature \[EMVA1288, Eq. 33]. Frames scatter so beyond noise; darks that code 0 clips, and those whose hot
/// photosites are full, do not count, where the error of rounding has such a variance.
///
/// # Errors
///
/// Which frames would tell it.
pub fn doubling_temperature(
    darks: &[Level],
    scatter: &Scatter,
    rounding: f64,
    confidence: f64,
) -> Result<Interval, String> {
    let is_clipped = |dark: &Level| is_clipped(dark, rounding);
    let unclipped = || darks.iter().zip(are_whole(darks)).filter(|(dark, _)| !is_clipped(dark));
    let whole: Vec<&Level> = unclipped().filter(|(_, is_whole)| *is_whole).map(|(dark, _)| dark).collect();
    let of_rate = |temperature: f64| -> Option<(f64, f64)> {
        let own = whole.iter().filter(|dark| dark.condition.temperature_k == Some(temperature));
        let variance = |dark: &Level| {
            dark.mean_variance + scatter.of_black(dark).known(confidence) + dark.hidden(rounding).mean.powi(2)
        };
        let points: Vec<(f64, f64, f64)> =
            own.filter_map(|dark| Some((dark.condition.exposure_s?, dark.mean, variance(dark)))).collect();
        let (line, [_, variance]) = fitted_in_time(&points, confidence)?;
        Some((line.slope, variance))
    };
    let mut temperatures: Vec<f64> = whole.iter().filter_map(|dark| dark.condition.temperature_k).collect();
    temperatures.sort_by(f64::total_cmp);
    temperatures.dedup();
    let found: Vec<(f64, f64, f64)> = temperatures
        .iter()
        .filter_map(|temperature| of_rate(*temperature).map(|(slope, variance)| (*temperature, slope, variance)))
        .collect();
    if found.len() < 2 {
        let few = "it takes darks at two temperatures or more, each at two exposure times or more";
        let are_others_warmer =
            darks.iter().any(|dark| dark.condition.temperature_k != darks[0].condition.temperature_k);
        let reason = if darks.iter().any(is_clipped) { CLIPPED } else { CUT_OFF };
        let is_for_ends = are_others_warmer && whole.len() < darks.len();
        return Err(if is_for_ends { reason } else { few }.into());
    }
    // The logarithm of a rate that is not told from none tells nothing.
    let is_told = |(_, slope, variance): &&(f64, f64, f64)| *slope > 3.0 * variance.sqrt();
    let rates: Vec<(f64, f64, f64)> = found
        .iter()
        .filter(is_told)
        .map(|(temperature, slope, variance)| (*temperature, slope.log2(), variance / (slope * LN_2).powi(2)))
        .collect();
    let untold = "the dark current is told from none at fewer than two temperatures: darks of longer exposure, or warmer ones, would tell";
    let (line, [_, variance]) = if rates.len() < 2 { None } else { fitted(&rates, confidence) }.ok_or(untold)?;
    let slope = Interval::normal(line.slope, variance, confidence);
    if slope.low <= 0.0 {
        return Err("the dark current does not rise with temperature beyond chance: darks of longer exposure, or at temperatures \
                    farther apart, would tell"
            .into());
    }
    Ok(Interval { value: 1.0 / slope.value, low: 1.0 / slope.high, high: 1.0 / slope.low })
}

/// The temporal variance in the dark, of single photosites or the whole, rounding included: at no exposure time, as the line through darks of three
/// times or more has it, or else that of the shortest, with the shot noise of its dark charge.
pub fn variance_of_darks(darks: &[&Level], part: Part, rounding: f64, confidence: f64) -> Interval {
    let time = |dark: &Level| dark.condition.exposure_s.unwrap_or(0.0);
    let hidden = |darks: &[&Level]| darks.iter().map(|dark| dark.hidden(rounding).variance).fold(0.0, f64::max);
    let with_hidden = |of: Interval, hidden: f64| Interval { low: of.low - hidden, high: of.high + hidden, ..of };
    let all: Vec<Level> = darks.iter().map(|dark| (*dark).clone()).collect();
    let whole: Vec<&Level> =
        all.iter().zip(are_whole(&all)).filter(|(_, is_whole)| *is_whole).map(|(dark, _)| dark).collect();
    let mut times: Vec<f64> = whole.iter().filter_map(|dark| dark.condition.exposure_s).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let of_line = noise_over_time(&whole, part, rounding, confidence).filter(|_| times.len() >= 3);
    if let Some((line, [of_offset, _])) = of_line {
        return with_hidden(Interval::normal(line.offset, of_offset, confidence), hidden(&whole));
    }
    let shortest = darks.iter().map(|dark| time(dark)).fold(f64::INFINITY, f64::min);
    let short: Vec<&Level> = darks.iter().copied().filter(|dark| time(dark) <= shortest).collect();
    with_hidden(temporal(&short, part, confidence), hidden(&short))
}

/// The line through such temporal variances of darks over time, as [`fitted`] has it. Where these scatter by far more than those of normal
/// noise, as where few photosites jump, what each of them scatters by is itself chance, and one that is low by chance would count more: there each scatters
/// as the line has it, and as all of them together do.
fn noise_over_time(darks: &[&Level], part: Part, rounding: f64, confidence: f64) -> Option<(Line, [f64; 2])> {
    /// So many times what normal noise scatters by is far more: a variance.
    const FAR: f64 = 4.0;
    /// Relative variance of a variance of normal noise, times its freedom.
    const NORMAL: f64 = 2.0;
    let relative = relative_scatter(darks.iter().map(|dark| (dark.freedom(), dark.variance, dark.variance_variance)));
    let of = |line: Option<Line>| {
        let point = |dark: &&Level| {
            let (time, value) = (dark.condition.exposure_s?, temporal(&[*dark], part, confidence).value);
            let level = line.map_or(value, |line| line.at(time)).max(rounding).max(0.5 * value);
            let scatter = if relative > FAR * NORMAL {
                relative / dark.freedom() * level * level
            } else {
                dark.variance_variance
            };
            Some((time, value, scatter + dark.hidden(rounding).variance.powi(2)))
        };
        fitted(&darks.iter().filter_map(point).collect::<Vec<_>>(), confidence)
    };
    let first = of(None).map(|(line, _)| line);
    let second = of(first).map(|(line, _)| line);
    of(second)
}

/// What single photosites of a dark differ by.
struct Pattern {
    exposure_s: f64,
    /// The variance between them, and what the noise that is left in the mean of the frames makes it scatter by, a variance.
    variance: f64,
    own: f64,
    /// Fourth cumulant of a photosite.
    fourth: f64,
}

impl Pattern {
    fn of(dark: &Level, rounding: f64) -> Option<Self> {
        let count = dark.count();
        let mut pattern = Self { exposure_s: dark.condition.exposure_s?, variance: 0.0, own: 0.0, fourth: 0.0 };
        for site in &dark.sites {
            let (share, noise) = (site.count() as f64 / count, site.temporal.rest.value / dark.frames as f64);
            let variance = site.spatial.rest.value - noise;
            let of_means = 2.0 * (site.spatial.rest.value.powi(2) - variance.max(0.0).powi(2)) / site.count() as f64;
            let of_noise = 2.0 * noise * noise / site.temporal.rest.freedom;
            pattern.variance += share * variance;
            pattern.own += share * share * (of_means.max(0.0) + of_noise);
            pattern.fourth += share * site.fourth;
        }
        pattern.own += hidden_pattern(dark, rounding).variance.powi(2);
        Some(pattern)
    }
}

/// The interval of a variance between `count` photosites of such a fourth cumulant, whose estimate scatters by `own` besides.
fn of_photosites(variance: f64, own: f64, fourth: f64, count: f64, confidence: f64) -> Interval {
    let square = MeanSquare { value: variance.max(0.0), freedom: count - 1.0 }.with_tails(fourth, count);
    let [sampled, other] = [combination(&[(1.0, square)], confidence), Interval::normal(0.0, own, confidence)];
    Interval {
        value: variance,
        low: variance - (square.value - sampled.low).hypot(other.low),
        high: variance + (sampled.high - square.value).hypot(other.high),
    }
}

/// The fixed pattern of darks parted into what no time adds and what goes by it: variances of single photosites at no exposure, in
/// samples², and per second², of codes whose error of rounding has such a variance. None of fewer than three exposure times; darks
/// whose hot photosites are full, as they are not in the shortest, do not count.
pub fn parted_pattern(darks: &[Level], rounding: f64, confidence: f64) -> Option<[Interval; 2]> {
    let whole = darks.iter().zip(are_whole(darks)).filter(|(_, is_whole)| *is_whole);
    let mut patterns: Vec<Pattern> = whole.filter_map(|(dark, _)| Pattern::of(dark, rounding)).collect();
    patterns.sort_by(|a, b| a.exposure_s.total_cmp(&b.exposure_s));
    let mut times: Vec<f64> = patterns.iter().map(|pattern| pattern.exposure_s).collect();
    times.dedup();
    let (true, [first, .., last]) = (times.len() >= 3, &patterns[..]) else { return None };
    // The pattern is the same in all of them: that it is one of many is an error that they share.
    let points: Vec<(f64, f64, f64)> =
        patterns.iter().map(|pattern| (pattern.exposure_s.powi(2), pattern.variance, pattern.own)).collect();
    let (line, [of_offset, of_slope]) = fitted(&points, confidence)?;
    // Fourth cumulants of what no time adds and of what goes by it add up, as variances do.
    let [short, long] = [first, last].map(|pattern| pattern.exposure_s.powi(4));
    let of_time = ((last.fourth - first.fourth) / (long - short)).max(0.0);
    let of_none = (first.fourth - of_time * short).max(0.0);
    let count = darks.first().map_or(2.0, Level::count);
    Some([
        of_photosites(line.offset, of_offset, of_none, count, confidence),
        of_photosites(line.slope, of_slope, of_time, count, confidence),
    ])
}
