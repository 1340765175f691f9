//! What levels tell of a class whose gain they do not tell: black level and dark noise in codes.

use super::curve::{LEAST_VARIANCE, Values, is_clipped};
use super::level::Level;
use super::reasons::{CLIPPED, no_darks, silent};
use super::scatter::Scatter;
use super::settings::Settings;
use super::sheet::{ClassFindings, CurvePoint, DarkPoint, Found, KEYS, finding};
use super::suspects::suspects;
use crate::numerics::variance_components::Interval;

/// What is known of a class of which no gain follows, for that reason, from flats, darks of their temperature, and all darks, whose
/// frames scatter so beyond noise.
pub fn without_gain(
    name: &str,
    why: String,
    [flats, darks, all_darks]: [&[Level]; 3],
    scatter: &Scatter,
    settings: &Settings,
) -> ClassFindings {
    let [black, noise] = of_darks(darks, all_darks, scatter, settings);
    let found = |key: &str| match key {
        "black_level_adu" => black.clone(),
        "dark_noise_adu" => noise.clone(),
        _ => Err(why.clone()),
    };
    let beneath = |flat: &Level| {
        let own = darks.iter().find(|dark| dark.condition.exposure_s == flat.condition.exposure_s);
        own.or(shortest(darks)).map_or([0.0; 2], |dark| [dark.mean, dark.variance])
    };
    let point = |flat: &Level| {
        let [mean, variance] = beneath(flat);
        CurvePoint::of(flat, [flat.mean - mean, flat.variance - variance], false)
    };
    ClassFindings {
        name: name.into(),
        findings: KEYS.iter().map(|(key, ..)| finding(key, found(key))).collect(),
        curve: flats.iter().map(point).collect(),
        darks: darks.iter().map(DarkPoint::of).collect(),
        linearity: None,
        values: None::<Values>,
        stacks: [None; 2],
        notes: Vec::new(),
        doubts: Vec::new(),
        suspects: suspects(None, flats, all_darks, scatter, settings.rounding()),
        stuck: Vec::new(),
        early: Vec::new(),
        hot: None,
        drift: None,
    }
}

fn shortest(darks: &[Level]) -> Option<&Level> {
    let time = |dark: &Level| dark.condition.exposure_s.unwrap_or(f64::INFINITY);
    darks.iter().min_by(|a, b| time(a).total_cmp(&time(b)))
}

/// Black level and temporal noise of the shortest darks, in samples.
fn of_darks(darks: &[Level], all_darks: &[Level], scatter: &Scatter, settings: &Settings) -> [Found; 2] {
    let (rounding, confidence) = (settings.rounding(), settings.confidence);
    let Some(dark) = shortest(darks) else { return [0, 1].map(|_| Err(no_darks(all_darks).into())) };
    if is_clipped(dark, rounding) {
        return [0, 1].map(|_| Err(CLIPPED.into()));
    }
    let hidden = dark.hidden(rounding);
    let with_hidden = |value: f64, variance: f64, hidden: f64| {
        let Interval { low, high, .. } = Interval::normal(value, variance, confidence);
        Interval { value, low: low - hidden, high: high + hidden }
    };
    let of_mean = dark.mean_variance + scatter.of_black(dark).known(confidence);
    let noise = if rounding > 0.0 && dark.variance < LEAST_VARIANCE {
        Err(silent())
    } else {
        Ok(with_hidden(dark.variance, dark.variance_variance, hidden.variance).root())
    };
    [Ok(with_hidden(dark.mean, of_mean, hidden.mean)), noise]
}
