//! What the levels of a class tell of its camera, number by number, each with its interval or with what would tell it.

use super::curve::{Curve, Values, below_saturation, first_cut, stuck_shares, without_clipped, without_stuck};
use super::dark::{doubling_temperature, parted_pattern};
use super::dark_noise::DarkNoise;
use super::doubts::{doubts, gain_in_doubt};
use super::few::told_of_few;
use super::level::{Level, is_same_time};
use super::limit::Limit;
use super::linearity::{Linearity, Response, linearity};
use super::pattern::{Part, drift_of, fixed, of_light, with_hidden};
use super::reasons::{DRIFT_OF_FEW_ROWS, LOST_DARK, NO_NOISE, Reasons, frames_of_noise, of_gain, time_of_noise};
use super::rounding::{Steps, least_normal};
use super::row_drift::RowDrift;
use super::scatter::Scatter;
use super::settings::Settings;
use super::sheet::{ClassFindings, CurvePoint, DarkPoint, Found, finding, over, over_correlated};
use super::suspects::suspects;
use super::unknown::without_gain;
use crate::numerics::variance_components::Interval;
use crate::text::in_digits;

/// What the levels of a class tell; flats in the order of their light, darks of the flats' temperature, and all darks.
#[allow(clippy::too_many_lines, reason = "finding after finding, as the data sheet has them")]
pub fn of_class(
    name: &str,
    flats: &[Level],
    darks: &[Level],
    all_darks: &[Level],
    settings: &Settings,
) -> ClassFindings {
    let Settings { confidence, .. } = *settings;
    let (rounding, given) = (settings.rounding(), flats);
    // Photosites that are stuck at an end of the codes cut nothing off.
    let stuck = stuck_shares(flats, darks);
    let [flats, darks, all_darks] = [flats, darks, all_darks].map(|levels| without_stuck(levels, stuck));
    // Nor do darks that code 0 cuts off count where others tell what they would.
    let ((darks, is_left_out), clipped) = (without_clipped(&darks, &flats, rounding), darks.len());
    let clipped = clipped - darks.len();
    let (flats, darks, all_darks) = (&flats[..], &darks[..], &all_darks[..]);
    let below: Vec<&Level> =
        below_saturation(flats, first_cut(flats, darks, rounding)).into_iter().map(|flat| &flats[flat]).collect();
    let steady = if is_left_out { without_clipped(all_darks, flats, rounding).0 } else { all_darks.to_vec() };
    let scatter = Scatter::of(&below, &steady);
    let curve_of = |levels: [&[Level]; 2]| {
        Curve::of(levels[0], levels[1], &scatter, settings).filter(|curve| curve.values().is_some())
    };
    // By the gain is known how coarse shot noise is.
    let first = curve_of([flats, darks]);
    let stepped = first.as_ref().and_then(|first| with_steps(first, [flats, darks, all_darks], rounding));
    let curve = stepped.as_ref().map_or(first, |[flats, darks, _]| curve_of([flats, darks]));
    let (flats, darks, all_darks) =
        stepped.as_ref().map_or((flats, darks, all_darks), |[flats, darks, all]| (&flats[..], &darks[..], &all[..]));
    let nothing = |why: String| without_gain(name, why, [given, darks, all_darks], &scatter, settings);
    let Some(curve) = curve else { return nothing(of_gain(flats, darks, rounding)) };
    if let Some(gain) = curve.interval(|values| Some(values.gain), confidence).filter(|gain| gain.low <= 0.0) {
        return nothing(format!(
            "no gain follows: by the flats it is {} to {}, as their variance does not rise with their mean beyond chance; are \
             they exchanged with the darks, or all saturated?",
            in_digits(gain.low, 4),
            in_digits(gain.high, 4)
        ));
    }
    let mut found = Vec::new();
    let mut add = |key: &'static str, result: Found| found.push(finding(key, result));
    let number = |of: &dyn Fn(&Values) -> Option<f64>, why: String| curve.interval(of, confidence).ok_or(why);
    let reasons = Reasons { curve: &curve, flats, darks, all_darks, is_left_out };
    let (no_darks, no_photons) = (|| reasons.of_darks(), || reasons.of_photons());
    let gain = number(&|v| Some(v.gain), String::new());
    add("gain_adu_per_e", gain.clone());
    let responsivity = number(&|v| v.responsivity, no_photons());
    add("responsivity_adu_per_photon", responsivity.clone());
    let efficiency = curve.over_gain(|v| v.responsivity, confidence).ok_or_else(no_photons);
    add("quantum_efficiency", efficiency.clone());
    add("black_level_adu", number(&|v| v.dark_mean, no_darks()));
    let noise = DarkNoise::of(&curve, darks, rounding, confidence);
    let of_darks = noise.variance(Part::Total);
    // Beneath the rounding, and where the line through the flats ends below none, nothing is left to tell.
    let variance_of = |of: &dyn Fn(&Values) -> Option<f64>| {
        number(of, reasons.of_noise())
            .and_then(|found| if found.high > 0.0 { Ok(found) } else { Err(reasons.of_noise()) })
    };
    let all = of_darks.map_or_else(|| variance_of(&|v| v.dark_variance), Ok);
    add("dark_noise_adu", all.map(Interval::root));
    // In electrons, less so much of the variance in samples².
    let all_but = |less: f64| match (of_darks, &gain) {
        (Some(variance), Ok(gain)) => {
            let left = variance.map(|variance| variance - less);
            if left.high > 0.0 { Ok(noise.in_electrons(Part::Total, left, *gain)) } else { Err(reasons.of_noise()) }
        }
        _ => variance_of(&|v| Some((v.dark_variance? - less) / (v.gain * v.gain))).map(Interval::root),
    };
    add("dark_noise_e", all_but(rounding));
    let over_gain = |part: Found| -> Found {
        let root = part?.root();
        if root.high > 0.0 { Ok(over(root, gain.clone()?)) } else { Err(NO_NOISE.into()) }
    };
    let drift = drift_of(noise.darks()).zip(gain.as_ref().ok()).map(|(drift, gain)| drift.in_electrons(gain.value));
    for (key, part) in [("row_noise_e", Part::Row), ("column_noise_e", Part::Column), ("pixel_noise_e", Part::Pixel)] {
        let is_hidden = part == Part::Row && drift.is_some_and(|drift| drift.hides_rows());
        let less = if part == Part::Pixel { rounding } else { 0.0 };
        let told = noise.variance(part).map(|told| told.map(|variance| variance - less));
        let told = if is_hidden { Err(DRIFT_OF_FEW_ROWS.into()) } else { told.ok_or_else(|| reasons.of_noise()) };
        add(
            key,
            told.and_then(|told| {
                if told.root().high > 0.0 {
                    Ok(noise.in_electrons(part, told, gain.clone()?))
                } else {
                    Err(NO_NOISE.into())
                }
            }),
        );
    }
    // The signal that equals its noise: ½ + √(¼ + σ²) [EMVA1288, Eq. 25].
    let threshold = |noise_e: f64| 0.5 + (0.25 + noise_e * noise_e).sqrt();
    let threshold_e = all_but(0.0).map(|noise_e| noise_e.map(threshold));
    add("threshold_e", threshold_e.clone());
    let alike = || {
        let threshold = |v: &Values| Some(threshold(v.dark_variance?.max(0.0).sqrt() / v.gain));
        curve.correlation(&threshold, &|v| Some(v.responsivity? / v.gain))
    };
    add(
        "threshold_photons",
        threshold_e.clone().and_then(|threshold| Ok(over_correlated(threshold, efficiency?, alike()))),
    );
    let limit = Limit::of(&curve, flats, settings);
    let [saturation_e, saturation_photons, full_well] = limit.capacities(reasons, gain.clone(), confidence);
    add("saturation_e", saturation_e.clone());
    let off = |photons: Interval| widened(photons, (settings.photon_error * photons.value).powi(2), confidence);
    add("saturation_photons", saturation_photons.map(off));
    add("full_well_e", full_well);
    add("snr_max", saturation_e.clone().map(Interval::root));
    let range = |saturation: Interval, threshold: Interval| Interval {
        value: saturation.value / threshold.value,
        low: saturation.low / threshold.high,
        high: saturation.high / threshold.low,
    };
    add("dynamic_range", saturation_e.and_then(|saturation| Ok(range(saturation, threshold_e?))));
    let straight = straightness(reasons, &scatter, confidence);
    let in_doubt = gain_in_doubt(&curve, confidence);
    let straight = straight.map_err(|why| in_doubt.iter().fold(why, |why, doubt| format!("{why}; {doubt}")));
    for (key, end) in [("linearity_error_min", 0), ("linearity_error_max", 1)] {
        add(key, straight.as_ref().map(|line| line.extremes[end]).map_err(Clone::clone));
    }
    let stacks = stacks(&curve, flats, darks);
    let [lit, dark] = stacks;
    let places =
        [lit.map(|(flat, level)| (level.place, curve.signal(flat))), dark.map(|(_, level)| (level.place, 0.0))];
    add_patterns(&mut add, reasons, stacks, &over_gain, settings);
    let is_hidden = darks.iter().any(|dark| curve.hides(Some(dark), confidence));
    let parted = || parted_pattern(darks, rounding, confidence).ok_or_else(|| reasons.of_times());
    let parted = if is_hidden { Err(reasons.of_noise()) } else { parted() };
    let photosites: f64 = darks.iter().map(Level::count).fold(f64::INFINITY, f64::min);
    // The photosites that there are are a sample of those of the camera.
    let sampled = |current: Interval| match (&parted, &gain) {
        (Ok([_, of_time]), Ok(gain)) => {
            widened(current, of_time.value.max(0.0) / photosites / gain.value.powi(2), confidence)
        }
        _ => current,
    };
    let per_second = || curve.over_gain(|v| v.dark_slope, confidence).ok_or_else(|| reasons.of_times());
    // What darks took off the frames they do not show.
    let kept = |found: Found| if settings.lost_dark() { Err(LOST_DARK.into()) } else { found };
    add("dark_current_e_per_s", kept(per_second().map(sampled)));
    let from_variance = |v: &Values| Some(v.dark_variance_slope? / (v.gain * v.gain));
    let why = if curve.is_silent { reasons.of_noise() } else { reasons.of_times() };
    add("dark_current_from_variance_e_per_s", number(&from_variance, why).map(sampled));
    add("dark_current_doubling_k", kept(doubling_temperature(all_darks, &scatter, rounding, confidence)));
    let offset = parted.clone().map(|[offset, _]| offset);
    add("dsnu_offset_e", over_gain(offset));
    let slope = curve.interval(|values| values.dark_slope, confidence).filter(|slope| slope.low > 0.0);
    let uneven = parted.and_then(|[_, square]| {
        let slope = slope.ok_or(
            "the dark current is not told from none, nor is how it differs among photosites: darks of longer exposure would tell",
        )?;
        Ok(over(square.root(), slope))
    });
    add("dcnu", kept(uneven));
    let points = given.iter().enumerate().map(|(place, flat)| {
        CurvePoint::of(flat, [curve.signal(place), curve.noise(place)], curve.fitted().contains(&place))
    });
    for finding in found.iter_mut().filter(|finding| finding.key.starts_with("saturation_")) {
        finding.what = limit.saturation;
    }
    let (curve_points, values) = (points.collect(), curve.values());
    let mut notes = notes(&curve, flats, lit.map(|(_, level)| level.frames), &limit);
    notes.extend(told_of_few(&noise.darks().iter().map(|dark| (*dark).clone()).collect::<Vec<_>>()));
    notes.extend(drift.map(|RowDrift { variance, .. }| {
        format!(
            "the black level drifts along rows, by {} e- rms: that is in temporal dark noise, and not in that of rows",
            in_digits(variance.sqrt(), 2)
        )
    }));
    if is_left_out {
        let times = if clipped == 1 { "one exposure time".to_owned() } else { format!("{clipped} exposure times") };
        notes.push(format!(
            "darks of {times} are clipped at code 0 and left out: black level, dark noise and dark current are told by the others"
        ));
    }
    let suspects = suspects(Some(&curve), flats, all_darks, &scatter, rounding);
    let mut doubts = doubts(&curve, flats, &suspects, confidence);
    if let [Some((_, lit)), Some((_, dark))] = stacks
        && !is_same_time(dark.condition.exposure_s, lit.condition.exposure_s)
        && let Some((flat_s, dark_s)) = lit.condition.exposure_s.zip(dark.condition.exposure_s)
    {
        doubts.push(format!(
            "patterns under light, of flats of {flat_s} s, are told from those of darks of {dark_s} s, as there are none of their \
             exposure: the pattern that dark current has in that time counts as one of light, or against it"
        ));
    }
    let by_levels = straight.as_ref().ok().and_then(|line| line.told.clone());
    for (text, is_doubt) in scatter.told.iter().cloned().chain(curve.dark_told.clone()).chain(by_levels) {
        if is_doubt { doubts.push(text) } else { notes.push(text) }
    }
    ClassFindings {
        name: name.into(),
        findings: found,
        curve: curve_points,
        darks: darks.iter().map(DarkPoint::of).collect(),
        linearity: straight.ok(),
        values,
        stacks: places,
        notes,
        doubts,
        suspects,
        stuck: Vec::new(),
        early: Vec::new(),
        hot: None,
        drift,
    }
}

/// Flats, darks and all darks with the steps that smooth their codes, where these leave more of the error of rounding than normal noise
/// of their variance would; none where none do.
fn with_steps(curve: &Curve, levels: [&[Level]; 3], rounding: f64) -> Option<[Vec<Level>; 3]> {
    /// Codes that are worth a second look.
    const LEAST: f64 = 1e-4;
    /// What is less likely is not reckoned with.
    const SURE: f64 = 0.98;
    let (gain, darks) = (curve.values()?.gain, levels[1]);
    let time = |dark: &&Level| dark.condition.exposure_s.unwrap_or(0.0);
    let quietest = darks.iter().min_by(|a, b| time(a).total_cmp(&time(b)).then(a.variance.total_cmp(&b.variance)))?;
    let black = curve.values()?.black.unwrap_or(quietest.mean);
    let of_charge = gain * (quietest.mean - black).max(0.0);
    let of_quietest = least_normal(quietest.variance, quietest.variance_variance) - of_charge;
    // That of no time, where darks tell it.
    let at_none = curve.interval(|values| values.dark_variance, SURE).filter(|_| curve.time_of_noise().is_none());
    let of_none = at_none.map_or(0.0, |at_none| least_normal(at_none.low, 0.0));
    let normal = of_quietest.max(of_none).max(0.0);
    if rounding <= 0.0 || gain.is_nan() || gain <= 0.0 {
        return None;
    }
    let mut is_any = false;
    let stepped = levels.map(|levels| {
        let of = |level: &Level| {
            let electrons = ((level.mean - black) / gain).max(0.0);
            let own = Level { steps: Some(Steps { normal, electrons, gain }), ..level.clone() };
            let is_coarse = own.hidden(rounding).mean > level.hidden(rounding).mean + LEAST;
            is_any |= is_coarse;
            if is_coarse { own } else { level.clone() }
        };
        levels.iter().map(of).collect::<Vec<Level>>()
    });
    is_any.then_some(stepped)
}

/// An interval of which the number has another error besides, a variance.
fn widened(Interval { value, low, high }: Interval, variance: f64, confidence: f64) -> Interval {
    let other = Interval::normal(0.0, variance, confidence);
    Interval { value, low: value - (value - low).hypot(other.low), high: value + (high - value).hypot(other.high) }
}

/// The deviations from a straight line, against photons, or against time where light was constant.
fn straightness(reasons: Reasons, scatter: &Scatter, confidence: f64) -> Result<Linearity, String> {
    let Reasons { curve, flats, .. } = reasons;
    let light = |level: &Level| level.condition.photons.or(level.condition.exposure_s);
    let peak = curve.saturated.ok_or_else(|| reasons.of_saturation())?;
    if !curve.knows_black(peak) {
        return Err(reasons.of_darks());
    }
    let levels: Vec<Response> = flats
        .iter()
        .enumerate()
        .filter(|(index, _)| curve.knows_black(*index))
        .filter_map(|(index, flat)| {
            Some(Response {
                light: light(flat)?,
                signal: curve.signal(index),
                variance: curve.variance_parts(index, scatter),
                light_variance: scatter.of_light(flat),
            })
        })
        .collect();
    let few = "it takes three flats or more between 5 and 95 % of saturation, of known photons or exposure times";
    linearity(&levels, curve.signal(peak), confidence).ok_or_else(|| few.into())
}

/// The flat and the dark that patterns are measured on: of the most frames, the flat below saturation at every photosite; of such, the
/// flat nearest to half of saturation, and the dark of its exposure time, or, where there is none, the one nearest to that.
fn stacks<'a>(curve: &Curve, flats: &'a [Level], darks: &'a [Level]) -> [Option<(usize, &'a Level)>; 2] {
    let half = curve.saturated.or(curve.cut_from).map_or_else(
        || curve.fitted().last().map_or(0.0, |&flat| curve.signal(flat)) / 2.0,
        |peak| curve.signal(peak) / 2.0,
    );
    let frames = curve.patterned().iter().map(|&flat| flats[flat].frames).max();
    let off = |flat: &usize| (curve.signal(*flat) - half).abs();
    let with_most = curve.patterned().iter().copied().filter(|&flat| Some(flats[flat].frames) == frames);
    let flat = with_most.min_by(|a, b| off(a).total_cmp(&off(b)));
    let time = |level: &Level| level.condition.exposure_s.unwrap_or(0.0);
    let wanted = flat.map_or(0.0, |flat| time(&flats[flat]));
    let apart = |dark: &(usize, &Level)| (time(dark.1) - wanted).abs();
    let of_time = |dark: &Level| {
        flat.is_some_and(|flat| is_same_time(flats[flat].condition.exposure_s, dark.condition.exposure_s))
    };
    let is_any = darks.iter().any(of_time);
    let most = darks.iter().filter(|dark| of_time(dark) == is_any).map(|dark| dark.frames).max();
    let dark = darks.iter().enumerate().filter(|(_, dark)| of_time(dark) == is_any && Some(dark.frames) == most);
    [flat.map(|flat| (flat, &flats[flat])), dark.min_by(|a, b| apart(a).total_cmp(&apart(b)))]
}

fn add_patterns(
    add: &mut impl FnMut(&'static str, Found),
    reasons: Reasons,
    [flat, dark]: [Option<(usize, &Level)>; 2],
    over_gain: &dyn Fn(Found) -> Found,
    settings: &Settings,
) {
    let (curve, confidence) = (reasons.curve, settings.confidence);
    for (key, part) in
        [("prnu", Part::Total), ("prnu_row", Part::Row), ("prnu_column", Part::Column), ("prnu_pixel", Part::Pixel)]
    {
        let result = match (flat, dark) {
            // Of darks that code 0 cuts off neither black nor what comes off the pattern is known.
            (Some((index, flat)), Some((_, dark))) if curve.knows_black(index) && !curve.are_darks_clipped => {
                let signal = curve.signal(index);
                let spread = of_light(flat, dark, part, confidence).root();
                if spread.high > 0.0 { Ok(spread.map(|spread| spread / signal)) } else { Err(NO_NOISE.into()) }
            }
            (None, _) => Err("it takes two flats or more below saturation".into()),
            _ => Err(reasons.of_darks()),
        };
        add(key, result);
    }
    for (key, part) in [
        ("dsnu_e", Part::Total),
        ("dsnu_row_e", Part::Row),
        ("dsnu_column_e", Part::Column),
        ("dsnu_pixel_e", Part::Pixel),
    ] {
        let hidden = || curve.hides(dark.map(|(_, dark)| dark), confidence);
        let result = match dark {
            Some(_) if hidden() => Err(reasons.of_noise()),
            Some((_, dark)) => {
                over_gain(Ok(with_hidden(fixed(dark, part, confidence), part, dark, settings.rounding())))
            }
            None => Err(reasons.of_darks()),
        };
        add(key, result);
    }
}

fn notes(curve: &Curve, flats: &[Level], frames: Option<usize>, limit: &Limit) -> Vec<String> {
    /// Of as many darks each photosite that jumps has done so but one in ten.
    const ENOUGH: f64 = 4.0;
    let mut notes: Vec<String> = limit.told.iter().cloned().collect();
    if let Some(cut) = curve.cut_from {
        notes.push(format!(
            "part of the photosites is cut off in flats of a mean of {:.1} ADU and more, the brighter of which have less noise than others: gain and \
             responsivity are told by flats of up to 70 % of that, or of up to 90 % where there are none, as patterns are",
            flats[cut].mean
        ));
    }
    let most = flats.iter().map(|flat| flat.frames).max();
    if let Some((frames, most)) = frames.zip(most).filter(|(frames, most)| frames < most) {
        notes.push(format!(
            "flats of {most} frames are too near saturation for patterns, which are measured on {frames}: histograms have more temporal \
             noise of these"
        ));
    }
    if curve.is_offset_free {
        let end = if curve.times() >= 2 && !curve.are_darks_clipped { "no light and no time" } else { "no signal" };
        let of_gain = if curve.is_noise_of_line() { "" } else { " as far as the gain goes" };
        notes.push(format!(
            "the variance of no light is that which the line through the flats has at {end}{of_gain}, as darks do not tell it"
        ));
    }
    if curve.are_darks_clipped {
        notes.push(
            "darks are clipped at code 0, and too few others tell the dark charge: the gain is the slope of the variance over the mean \
             itself, which has that in it"
                .into(),
        );
    }
    notes.extend(curve.values().and_then(|values| values.dark_variance).and(curve.time_of_noise()).map(time_of_noise));
    notes.extend(curve.frames_of_noise().filter(|frames| *frames < ENOUGH).map(frames_of_noise));
    let lit = flats.iter().filter(|flat| flat.condition.photons.is_none()).count();
    if lit > 0 && flats.iter().any(|flat| flat.condition.photons.is_some()) {
        notes.push(format!("{lit} flats have no number of photons, and do not count for the responsivity"));
    }
    notes
}
