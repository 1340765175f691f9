//! What may make the numbers of a camera wrong, as its levels show it.

use super::curve::{Bend, Curve, below_saturation};
use super::level::Level;
use super::suspects::Suspect;
use crate::numerics::quantiles::of_student;

/// So many standard deviations are beyond chance.
const BEYOND: f64 = 5.0;
/// The confidence of an interval of as many.
const CONFIDENCE: f64 = 1.0 - 5.7e-7;
/// Signals of levels differ by so large a share where one is of more light.
const LEAST_STEP: f64 = 0.01;
/// Signals that miss the line of the response by so large a share are told of.
const MISSED: f64 = 0.02;
/// Light that changes by so large a share from frame to frame, at one level after another, is told of.
const DRIFT: f64 = 1e-3;

/// What a user should be warned of.
pub fn doubts(curve: &Curve, flats: &[Level], suspects: &[Suspect], confidence: f64) -> Vec<String> {
    // Of a level that is named the response seems to bend.
    let is_named = flats.iter().any(|flat| suspects.iter().any(|suspect| suspect.place == flat.place));
    let other_time = curve.other_time().map(|([least, most], flat)| {
        let darks = if least < most { format!("the line through darks of {least} to {most} s") } else { format!("darks of {least} s") };
        format!(
            "flats of {flat} s stand above {darks}, as there are none of their exposure: black level and dark noise beneath them are taken \
             from these"
        )
    });
    let unknown_time = curve.is_time_unknown().then(|| {
        "flats stand above darks of which one tells its exposure time and the other does not: black level and dark noise beneath them \
         are taken from these"
            .to_owned()
    });
    // As sure as 5 standard deviations, whatever the intervals are that are asked for.
    let falls = curve.interval(|values| values.dark_slope, CONFIDENCE).is_some_and(|slope| slope.high < 0.0);
    let falling = falls
        .then(|| "the dark signal falls with exposure time beyond chance: is there a flat among the darks?".to_owned());
    let all = [
        other_time,
        unknown_time,
        falling,
        lit_by_none(curve, flats),
        exchanged(curve, flats),
        missed(curve),
        drifting(curve, flats),
        bent(curve, confidence).filter(|_| !is_named),
        cut_off(curve, flats),
    ];
    all.into_iter().flatten().collect()
}

/// Whether a signal is beyond another by more than chance.
fn is_more(curve: &Curve, flat: usize, other: f64, variance: f64) -> bool {
    curve.signal(flat) > other + BEYOND * (curve.signal_variance(flat) + variance).sqrt()
}

/// A flat that is said to be of no photons, and has a signal.
fn lit_by_none(curve: &Curve, flats: &[Level]) -> Option<String> {
    let is_lit = |flat: &usize| flats[*flat].condition.photons == Some(0.0) && is_more(curve, *flat, 0.0, 0.0);
    let flat = (0..flats.len()).filter(|&flat| curve.knows_black(flat)).find(is_lit)?;
    Some(format!(
        "a flat of 0 photons has a signal of {:.2} ADU: photons that are not known are left empty",
        curve.signal(flat)
    ))
}

/// Flats of more photons that have less signal; of full photosites it is less where more of their charge is that of the dark.
fn exchanged(curve: &Curve, flats: &[Level]) -> Option<String> {
    let below = below_saturation(flats);
    let counted = |flat: usize| Some((flat, flats[flat].condition.photons?));
    let mut counted: Vec<(usize, f64)> = (0..flats.len()).filter_map(counted).collect();
    counted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let is_less = |two: &&[(usize, f64)]| {
        let [(less, photons), (more, more_photons)] = [two[0], two[1]];
        let (signal, variance) = (curve.signal(more), curve.signal_variance(more));
        let is_apart = more_photons > photons * (1.0 + LEAST_STEP);
        let [mean, more_mean] = [less, more].map(|flat| flats[flat].mean);
        let is_full = !below.contains(&more) && more_mean > mean * (1.0 - LEAST_STEP);
        is_apart && !is_full && is_more(curve, less, signal * (1.0 + LEAST_STEP), variance)
    };
    let two = counted.windows(2).find(is_less)?;
    let [(less, photons), (more, more_photons)] = [two[0], two[1]];
    Some(format!(
        "flats of {more_photons} photons have less signal, {:.1} ADU, than those of {photons}, {:.1} ADU: are photons exchanged?",
        curve.signal(more),
        curve.signal(less)
    ))
}

/// Signals that miss the line of the response by much.
fn missed(curve: &Curve) -> Option<String> {
    (curve.light_error >= MISSED).then(|| {
        format!(
            "signals miss the line of the response by {:.1} % more than they scatter by, so that light drifted, photons are wrong or \
             the response bends; intervals of responsivity and quantum efficiency take that as an error of each level by itself",
            curve.light_error * 100.0
        )
    })
}

/// Light that rises, or falls, within each level.
fn drifting(curve: &Curve, flats: &[Level]) -> Option<String> {
    let step = |&flat: &usize| {
        let level = &flats[flat];
        let signal = curve.signal(flat);
        let risen = level.frame_mean(level.frames - 1) - level.frame_mean(0);
        (signal > 0.0).then(|| risen / (level.frames - 1) as f64 / signal)
    };
    let steps: Vec<f64> = curve.fitted().iter().filter_map(step).collect();
    let count = steps.len() as f64;
    if count < 5.0 {
        return None;
    }
    let mean = steps.iter().sum::<f64>() / count;
    let scatter = steps.iter().map(|step| (step - mean).powi(2)).sum::<f64>() / (count - 1.0) / count;
    (mean.abs() > BEYOND * scatter.sqrt() && mean.abs() >= DRIFT).then(|| {
        let way = if mean > 0.0 { "rises" } else { "falls" };
        format!(
            "light {way} by {:.2} % from frame to frame, at one level after another: numbers of photons are wrong where the lamp \
             drifts on between levels, and responsivity and quantum efficiency with them",
            mean.abs() * 100.0
        )
    })
}

/// Temporal noise of flats that has no tails, as where a camera mends what is far off.
fn cut_off(curve: &Curve, flats: &[Level]) -> Option<String> {
    /// Noise that is rounded, to codes of its standard deviation or finer, lacks less.
    const LEAST: f64 = -0.1;
    /// A variance of less codes² is one of few codes.
    const LEAST_VARIANCE: f64 = 1.0;
    let [mut all, mut sum] = [0.0; 2];
    for flat in curve.fitted().iter().map(|&flat| &flats[flat]).filter(|flat| flat.variance >= LEAST_VARIANCE) {
        for [excess, variance] in flat.sites.iter().map(|site| site.excess) {
            all += 1.0 / variance;
            sum += excess / variance;
        }
    }
    let excess = sum / all;
    (excess < LEAST && excess < -BEYOND / all.sqrt()).then(|| {
        format!(
            "temporal noise of flats has fewer samples far off than noise has, an excess kurtosis of {excess:.2}: where the camera mends or smooths \
             samples by itself, the gain is wrong, and dark noise with it; take frames without its noise reduction"
        )
    })
}

/// A response that bends, which the variances follow and their scatter hides.
fn bent(curve: &Curve, confidence: f64) -> Option<String> {
    /// What is as sure is beyond chance.
    const SURE: f64 = 0.999;
    let Bend { missed, scatter, freedom } = curve.bend()?;
    let gain = curve.interval(|values| Some(values.gain), confidence)?;
    let width = (gain.high - gain.low) / (2.0 * gain.value);
    // Beyond what light that flickers from level to level makes of it, and more than half of what the interval has room for.
    let is_told = missed.abs() > of_student(SURE, freedom) * scatter && missed.abs() > width / 2.0;
    is_told.then(|| {
        format!(
            "the response bends, so that the gain, the slope of the whole photon transfer curve, is about {:.1} % {} than that of \
             little light; its interval, {:.1} %, is that of the slope",
            missed.abs() * 100.0,
            if missed > 0.0 { "more" } else { "less" },
            width * 100.0
        )
    })
}
