//! Levels that stand far off what all others show: a flat among the darks, a dark among the flats, an exposure time that is wrong.

use super::curve::{Curve, below_saturation, is_clipped};
use super::fit::{Line, Point, variance_besides};
use super::level::Level;
use super::scatter::Scatter;
use crate::numerics::quantiles::of_student;
use crate::numerics::robust::{NORMAL_MEDIAN, median};
use crate::numerics::significance;

/// So many standard deviations off the others is plainly off.
const BEYOND: f64 = 10.0;
/// A level is told from so many others, which must agree.
const OTHERS: usize = 3;

/// A level that may not be what it is said to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// Its condition, by its place among all.
    pub place: usize,
    /// What is wrong with it.
    pub problem: String,
}

/// Flats and darks of a class that stand far off the others; of darks that code 0 cuts off the means are no line over time, of codes whose
/// error of rounding has such a variance.
pub fn suspects(
    curve: Option<&Curve>,
    flats: &[Level],
    darks: &[Level],
    scatter: &Scatter,
    rounding: f64,
) -> Vec<Suspect> {
    let mut temperatures: Vec<Option<f64>> = Vec::new();
    for dark in darks {
        if !temperatures.contains(&dark.condition.temperature_k) {
            temperatures.push(dark.condition.temperature_k);
        }
    }
    let mut found: Vec<Suspect> = Vec::new();
    for temperature in temperatures {
        let own = || darks.iter().filter(|dark| dark.condition.temperature_k == temperature);
        let whole: Vec<&Level> = own().filter(|dark| !is_clipped(dark, rounding)).collect();
        found.extend(off_line(&whole, scatter));
        let is_of_it = |flat: &&Level| flat.condition.temperature_k.is_none_or(|kelvin| Some(kelvin) == temperature);
        let flats = || flats.iter().filter(is_of_it);
        let alone = |dark| full(dark).or_else(|| above_a_flat(dark, flats(), scatter));
        for suspect in own().filter_map(alone) {
            if !found.iter().any(|known| known.place == suspect.place) {
                found.push(suspect);
            }
        }
    }
    // Above the mean of what code 0 cuts off little light has too little signal.
    let of_black = curve.filter(|curve| !curve.are_darks_clipped);
    found.extend(of_black.into_iter().flat_map(|curve| off_response(curve, flats, scatter)));
    found
}

/// What the mean of a level scatters by, a variance.
fn variance(level: &Level, scatter: &Scatter) -> f64 {
    level.mean_variance + scatter.of_black(level).variance
}

/// The dark that is farthest off the line of the others over time, where these are straight.
fn off_line(darks: &[&Level], scatter: &Scatter) -> Option<Suspect> {
    /// Codes, and a share of the dark signal, that are worth a word.
    const LEAST: f64 = 1.0;
    const SHARE: f64 = 0.1;
    /// Points that miss their line so likely by chance are straight.
    const BY_CHANCE: f64 = 1e-3;
    /// What is as sure is beyond chance.
    const SURE: f64 = 0.9999;
    let timed: Vec<(&Level, f64)> = darks.iter().filter_map(|dark| Some((*dark, dark.condition.exposure_s?))).collect();
    if timed.len() <= OTHERS {
        return None;
    }
    // The scatter of frames is that of all, the one that is off too: of the others it is what they miss their line by.
    let off = |(place, (dark, time)): (usize, &(&Level, f64))| {
        let others: Vec<Point> = timed
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != place)
            .map(|(_, (other, x))| Point {
                x: *x,
                y: other.mean,
                weight: 1.0 / variance(other, scatter).max(f64::MIN_POSITIVE),
            })
            .collect();
        let line = Line::through(others.clone())?;
        let (misfit, freedom) = (line.chi_square(others.iter().copied()), others.len() as f64 - 2.0);
        // Others that miss their line by more than they scatter tell the more of it the more there are: Student's law.
        let is_straight = misfit <= freedom || significance::of_chi_square(misfit, freedom) > BY_CHANCE;
        let reach = if is_straight { BEYOND } else { of_student(SURE, freedom) * (misfit / freedom).sqrt() };
        let all: f64 = others.iter().map(|point| point.weight).sum();
        let middle = others.iter().map(|point| point.weight * point.x).sum::<f64>() / all;
        let spread: f64 = others.iter().map(|point| point.weight * (point.x - middle).powi(2)).sum();
        let of_line = 1.0 / all + (time - middle).powi(2) / spread;
        let missed = dark.mean - line.at(*time);
        // Times that are a little off all make the longest miss most.
        let least = LEAST.max(SHARE * (line.slope * time).abs());
        let far = missed.abs() / (variance(dark, scatter) + of_line).sqrt() / reach.max(BEYOND);
        Some((far.min(missed.abs() / least), missed, place))
    };
    let farthest = timed.iter().enumerate().filter_map(off).max_by(|a, b| a.0.total_cmp(&b.0));
    let (_, missed, place) = farthest.filter(|(far, ..)| *far > 1.0)?;
    let (way, is_it) = if missed > 0.0 { ("above", "are they flats, or is") } else { ("below", "is") };
    let problem = format!(
        "their mean stands {:.1} ADU {way} the line of the other darks over time, far beyond chance: {is_it} their exposure time wrong?",
        missed.abs()
    );
    Some(Suspect { place: timed[place].0.place, problem })
}

/// A dark most of whose samples are the largest code.
fn full(dark: &Level) -> Option<Suspect> {
    let problem = || "most of their samples are the largest code: are they flats?".to_owned();
    (dark.at_ends[0] > 0.5).then(|| Suspect { place: dark.place, problem: problem() })
}

/// A dark whose mean is above that of a flat that was exposed as long or longer.
fn above_a_flat<'a>(dark: &Level, flats: impl Iterator<Item = &'a Level>, scatter: &Scatter) -> Option<Suspect> {
    /// Codes that are worth a word.
    const LEAST: f64 = 1.0;
    let is_as_long = |flat: &&Level| match (flat.condition.exposure_s, dark.condition.exposure_s) {
        (Some(flat), Some(dark)) => flat >= dark,
        (flat, dark) => flat == dark,
    };
    let is_below = |flat: &&Level| {
        let by_chance = (variance(flat, scatter) + variance(dark, scatter)).sqrt();
        dark.mean > flat.mean + (BEYOND * by_chance).max(LEAST)
    };
    let below = flats.filter(is_as_long).find(is_below)?;
    let problem = format!(
        "their mean, {:.1} ADU, is above that of flats that were exposed as long or longer, {:.1} ADU: are they flats, or these darks?",
        dark.mean, below.mean
    );
    Some(Suspect { place: dark.place, problem })
}

/// Flats whose signal over light is far off that of the others, where these agree.
fn off_response(curve: &Curve, flats: &[Level], scatter: &Scatter) -> Vec<Suspect> {
    /// By so large a share, and one of the largest signal, is worth a word.
    const SHARES: [f64; 2] = [0.1, 0.005];
    let is_by_photons = flats.iter().all(|flat| flat.condition.photons.is_some());
    let light = |flat: &Level| if is_by_photons { flat.condition.photons } else { flat.condition.exposure_s };
    let known: Vec<(usize, f64)> = below_saturation(flats, curve.cut_from)
        .into_iter()
        .filter(|&flat| curve.knows_black(flat))
        .filter_map(|flat| Some((flat, light(&flats[flat]).filter(|light| *light > 0.0)?)))
        .collect();
    let ratios: Vec<f64> = known.iter().map(|(flat, light)| curve.signal(*flat) / light).collect();
    if ratios.len() <= OTHERS {
        return Vec::new();
    }
    let middle = median(&mut ratios.clone());
    let mut off: Vec<f64> = ratios.iter().map(|ratio| (ratio / middle - 1.0).abs()).collect();
    let spread = median(&mut off) / NORMAL_MEDIAN;
    let largest = known.iter().map(|(flat, _)| curve.signal(*flat)).fold(0.0, f64::max);
    let off = |&(flat, light): &(usize, f64)| {
        let (signal, wanted) = (curve.signal(flat), middle * light);
        let by_chance = (variance(&flats[flat], scatter) + (spread * wanted).powi(2)).sqrt();
        let least = (BEYOND * by_chance).max(SHARES[0] * wanted).max(SHARES[1] * largest);
        ((signal - wanted).abs() > least).then(|| unlike(&flats[flat], [signal, wanted], is_by_photons))
    };
    let mut found: Vec<Suspect> = known.iter().filter_map(off).collect();
    if found.is_empty() {
        found.extend(farthest_off(curve, flats, &known, is_by_photons));
    }
    // Where many are off, no one is: the response is not straight, or light was not counted so.
    if middle > 0.0 && found.len() * OTHERS < known.len() { found } else { Vec::new() }
}

/// A flat that has another signal than the others make of its light.
fn unlike(flat: &Level, [signal, wanted]: [f64; 2], is_by_photons: bool) -> Suspect {
    /// A signal below such a share of what it should be is none.
    const NONE: f64 = 0.05;
    let what = if is_by_photons { "number of photons" } else { "exposure time" };
    let is_it = if signal < NONE * wanted { "are they darks, or is" } else { "is" };
    let problem = format!(
        "their signal is {signal:.1} ADU, where the other flats make {wanted:.1} of their {what}: {is_it} that wrong?"
    );
    Suspect { place: flat.place, problem }
}

/// The flat whose signal over light is farthest off the line of the others over light, which a response that bends evenly follows, where
/// it is beyond what these miss that line by.
fn farthest_off(curve: &Curve, flats: &[Level], known: &[(usize, f64)], is_by_photons: bool) -> Option<Suspect> {
    /// By so large a share, and one of the largest signal, is worth a word.
    const SHARES: [f64; 2] = [0.03, 0.001];
    /// What is as sure is beyond chance.
    const SURE: f64 = 0.99999;
    /// So many others tell by how much they miss a line.
    const ENOUGH: usize = 5;
    if known.len() <= ENOUGH {
        return None;
    }
    let point = |&(flat, light): &(usize, f64)| {
        let signal = curve.signal(flat);
        (light, signal / light, curve.signal_variance(flat) / (light * light))
    };
    let brightest = known.iter().map(|(flat, _)| curve.signal(*flat)).fold(0.0, f64::max);
    let off = |place: usize| {
        let others: Vec<(f64, f64, f64)> =
            known.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, level)| point(level)).collect();
        let weighted = |besides: f64| -> Vec<Point> {
            others
                .iter()
                .map(|&(x, y, own)| Point { x, y, weight: 1.0 / (own + besides).max(f64::MIN_POSITIVE) })
                .collect()
        };
        let misfit =
            |besides: f64| Line::through(weighted(besides)).map_or(0.0, |line| line.chi_square(weighted(besides)));
        let freedom = others.len() as f64 - 2.0;
        let largest = others.iter().map(|(_, y, _)| y * y).fold(0.0, f64::max);
        let besides = variance_besides(freedom, misfit, largest);
        let points = weighted(besides);
        let line = Line::through(points.clone())?;
        let all: f64 = points.iter().map(|point| point.weight).sum();
        let middle = points.iter().map(|point| point.weight * point.x).sum::<f64>() / all;
        let spread: f64 = points.iter().map(|point| point.weight * (point.x - middle).powi(2)).sum();
        let (light, ratio, own) = point(&known[place]);
        let scatter = (own + besides + 1.0 / all + (light - middle).powi(2) / spread).sqrt();
        let missed = (ratio - line.at(light)).abs();
        let least = (SHARES[0] * line.at(light).abs()).max(SHARES[1] * brightest / light);
        let far = (missed / scatter / of_student(SURE, freedom)).min(missed / least);
        Some((far, place, line.at(light) * light))
    };
    let (_, place, wanted) =
        (0..known.len()).filter_map(off).max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(far, ..)| *far > 1.0)?;
    let flat = known[place].0;
    Some(unlike(&flats[flat], [curve.signal(flat), wanted], is_by_photons))
}
