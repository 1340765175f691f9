//! What may make the numbers of a camera wrong, as its levels show it.

use super::curve::{BEYOND_FIVE, Curve, below_saturation};
use super::level::Level;
use super::site_survey::SiteSurvey;
use super::suspects::Suspect;

/// So many standard deviations are beyond chance.
const BEYOND: f64 = 5.0;
/// The confidence of an interval of as many.
const CONFIDENCE: f64 = 1.0 - BEYOND_FIVE;
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
        bent(curve, confidence).or_else(|| curved(curve)).or_else(|| unlit(curve, confidence)).filter(|_| !is_named),
        cut_off(curve, flats).or_else(|| smoothed(curve, flats)),
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
    let below = below_saturation(flats, curve.cut_from);
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

/// The mean of what grids of fitted flats tell, by its variances, and what it scatters by, a standard deviation.
fn of_fitted(curve: &Curve, flats: &[Level], of: impl Fn(&SiteSurvey) -> [f64; 2]) -> [f64; 2] {
    /// A variance of less codes² is one of few codes.
    const LEAST_VARIANCE: f64 = 1.0;
    let [mut all, mut sum] = [0.0; 2];
    for flat in curve.fitted().iter().map(|&flat| &flats[flat]).filter(|flat| flat.variance >= LEAST_VARIANCE) {
        for [value, variance] in flat.sites.iter().map(&of) {
            all += 1.0 / variance;
            sum += value / variance;
        }
    }
    [sum / all, all.sqrt().recip()]
}

/// Temporal noise of flats that neighbors have in common, as where a camera smooths samples.
fn smoothed(curve: &Curve, flats: &[Level]) -> Option<String> {
    /// Charge that spills into the next photosites leaves less.
    const LEAST: f64 = 0.03;
    let of_axis = |axis: usize| of_fitted(curve, flats, |site| site.neighbors[axis]);
    let is_told = |[shared, scatter]: &[f64; 2]| shared.abs() > LEAST && shared.abs() > BEYOND * scatter;
    let told = ["row", "column"].into_iter().enumerate().map(|(axis, line)| (line, of_axis(axis)));
    let told = told.filter(|(_, found)| is_told(found));
    let (line, [shared, _]) = told.max_by(|(_, a), (_, b)| a[0].abs().total_cmp(&b[0].abs()))?;
    Some(format!(
        "temporal noise of flats is shared by neighbors in a {line}, a correlation of {shared:.2} beyond that of photosites farther apart: where the \
         camera mends or smooths samples by itself, the gain is wrong, and dark noise with it; take frames without its noise reduction"
    ))
}

/// Temporal noise of flats that has no tails, as where a camera mends what is far off.
fn cut_off(curve: &Curve, flats: &[Level]) -> Option<String> {
    /// Noise that is rounded, to codes of its standard deviation or finer, lacks less.
    const LEAST: f64 = -0.1;
    let [excess, scatter] = of_fitted(curve, flats, |site| site.excess);
    (excess < LEAST && excess < -BEYOND * scatter).then(|| {
        format!(
            "temporal noise of flats has fewer samples far off than noise has, an excess kurtosis of {excess:.2}: where the camera mends or smooths \
             samples by itself, the gain is wrong, and dark noise with it; take frames without its noise reduction"
        )
    })
}

/// A response that bends, which the variances follow and their scatter hides.
fn bent(curve: &Curve, confidence: f64) -> Option<String> {
    let bend = curve.bend()?;
    let (missed, width) = (bend.missed, width_of_gain(curve, confidence)?);
    // More than half of what the interval has room for.
    let is_told = bend.is_sure() && missed.abs() > width / 2.0;
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

/// Half of the interval of the gain, a share of it.
fn width_of_gain(curve: &Curve, confidence: f64) -> Option<f64> {
    let gain = curve.interval(|values| Some(values.gain), confidence)?;
    Some((gain.high - gain.low) / (2.0 * gain.value))
}

/// A share of the gain, in words.
fn more_or_less(share: f64) -> String {
    format!("{:.1} % {}", share.abs() * 100.0, if share > 0.0 { "more" } else { "less" })
}

/// Why no light tells whether the response is straight, and which frames would; none where it does.
fn why_unlit(curve: &Curve) -> Option<[&'static str; 2]> {
    const NO_BLACK: [&str; 2] = ["no darks tell black beneath the flats", "darks of their exposure times"];
    const NO_LIGHT: [&str; 2] = [
        "the light of the flats is not known",
        "flats of known photons, or of several exposure times under one light,",
    ];
    (!curve.tells_bend()).then(|| if curve.knows_light() { NO_BLACK } else { NO_LIGHT })
}

/// A response that bends, as the variances of flats alone tell it, where no light does.
fn unlit(curve: &Curve, confidence: f64) -> Option<String> {
    let [why, wanted] = why_unlit(curve)?;
    let (width, bend) = (width_of_gain(curve, confidence)?, curve.bend_of_noise()?);
    let interval = bend.interval(confidence);
    let [low, high] = [interval.low, interval.high].map(more_or_less);
    (bend.is_sure() && bend.missed.abs() > width / 2.0).then(|| {
        format!(
            "variances of flats bend over their mean, as of a response that bends or charge that photosites share: the gain, the slope of the whole \
             photon transfer curve, is about {} than that of little light ({low} to {high}); its interval, {:.1} %, is that of the slope; {why}: \
             {wanted} would tell how straight the response is",
            more_or_less(bend.missed),
            width * 100.0
        )
    })
}

/// What is said beside why the linearity is not told: by how much a response that bends may have the gain off, where variances alone tell it
/// and the interval of the gain has no room for that.
pub fn gain_in_doubt(curve: &Curve, confidence: f64) -> Option<String> {
    let [why, wanted] = why_unlit(curve)?;
    let width = width_of_gain(curve, confidence)?;
    let Some(bend) = curve.bend_of_noise() else {
        return Some(format!(
            "nothing tells whether the response is straight, as {why}: where it bends by a share of the signal of the brightest flat, the gain is off \
             by up to three times that share; {wanted} would tell"
        ));
    };
    let interval = bend.interval(confidence);
    let is_within = interval.low.abs().max(interval.high.abs()) <= width;
    let [low, high] = [interval.low, interval.high].map(more_or_less);
    (!is_within).then(|| {
        format!(
            "nothing but their variances tells whether the response is straight, as {why}: by these the gain, the slope of the whole photon \
             transfer curve, is {low} to {high} than that of little light, and its interval, {:.1} %, is that of the slope; {wanted} would tell",
            width * 100.0
        )
    })
}

/// Variances that are no line over their means, whatever the light is, as those of a curve of tones are.
fn curved(curve: &Curve) -> Option<String> {
    /// Photosites that share charge where they are full bend it by less.
    const LEAST: f64 = 0.03;
    let missed = curve.gain_error.filter(|missed| *missed >= LEAST)?;
    Some(format!(
        "variances of flats miss their line over the mean by {:.1} % of the largest, far beyond chance: the response bends, as where codes went \
         through a curve of tones, or the camera processes them by level; the gain is that of no level, and its interval that of the slope",
        missed * 100.0
    ))
}

#[cfg(test)]
mod tests {
    use super::super::findings::of_class;
    use super::super::level::{Condition, Level};
    use super::super::settings::Settings;
    use super::super::sheet::ClassFindings;
    use super::super::strangers::tests::normal;
    use super::super::survey::survey;
    use crate::frame::{Geometry, to_sample};
    use crate::metadata::{FrameHeader, Metadata};
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;

    const SIDE: usize = 64;

    /// Two frames of a camera of black 200, half a code to an electron and a noise of 2 codes, whose codes are changed so.
    fn level(signal: f64, time_s: f64, key: u32, change: &dyn Fn(f64) -> f64) -> Level {
        let of = |frame: u32| {
            let geometry = Geometry::new(SIDE, SIDE, &["Y"]);
            let header = FrameHeader { name: "a".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
            let noise = |place: usize| (0.5 * signal + 4.0).sqrt() * normal(place, frame, key);
            let code = |place: usize| to_sample(change(200.0 + signal + noise(place)).round());
            MemoryFrame::new(header, (0..SIDE * SIDE).map(code).collect())
        };
        let sites = survey(&mut [of(0), of(1)], Some(4095.0), false).unwrap().sites;
        let condition = Condition { is_lit: signal > 0.0, exposure_s: Some(time_s), ..Condition::default() };
        Level::of(key as usize, condition, sites)
    }

    /// What is doubted of six flats, of exposure times in proportion to their light or all of one, and their darks.
    fn doubted(change: &dyn Fn(f64) -> f64, drop_adu: f64, is_timed: bool) -> Vec<String> {
        measured(change, drop_adu, is_timed).doubts
    }

    /// What is found of them.
    fn measured(change: &dyn Fn(f64) -> f64, drop_adu: f64, is_timed: bool) -> ClassFindings {
        let times = || (1..=6_u32).map(|time| (time, 0.01 * f64::from(time)));
        let flat = |(key, s): (u32, f64)| level(40_000.0 * s, if is_timed { s } else { 0.01 }, key, change);
        let flats: Vec<Level> = times().map(flat).collect();
        let dark = |(key, s): (u32, f64)| level(0.0, s, 10 + key, &|code| change(code - drop_adu * f64::from(key)));
        let darks: Vec<Level> = times().map(dark).collect();
        let settings =
            Settings { confidence: 0.95, photon_error: 0.0, are_codes: true, top: Some(4095.0), corrected: None };
        of_class("Y", &flats, &darks, &darks, &settings)
    }

    /// A gamma of 1.2 is told, by variances or by the light, and a straight response is not. Means of darks of 2 codes over two frames of 4096 photosites scatter by 0.02
    /// codes, their slope over six times by 0.005 codes a time: one that falls by 0.012, two or three standard deviations, is not told, and one by 0.2 is.
    #[test]
    fn curves_of_tones_and_falling_darks_are_told_beyond_chance() {
        let bends = |doubts: &[String]| doubts.iter().any(|doubt| doubt.contains("the response bends"));
        let falls = |doubts: &[String]| doubts.iter().any(|doubt| doubt.contains("the dark signal falls"));
        let straight = |code: f64| code;
        for (drop_adu, wanted) in [(0.0, false), (0.012, false), (0.2, true)] {
            let doubts = doubted(&straight, drop_adu, true);
            assert_eq!([bends(&doubts), falls(&doubts)], [false, wanted], "{drop_adu}: {doubts:?}");
        }
        let doubts = doubted(&|code| 4095.0 * (code / 4095.0).powf(1.0 / 1.2), 0.0, true);
        assert!(bends(&doubts), "{doubts:?}");
    }

    /// Flats of which no light is known leave it in doubt whether the response is straight, which is said where the linearity is not told; those of
    /// known light do not.
    #[test]
    fn light_that_is_not_known_leaves_the_response_in_doubt() {
        let words = "tells whether the response is straight, as the light of the flats is not known";
        for (is_timed, wanted) in [(true, false), (false, true)] {
            let found = measured(&|code| code, 0.0, is_timed);
            let finding = found.findings.iter().find(|finding| finding.key == "linearity_error_max").unwrap();
            let is_told = finding.found.as_ref().is_err_and(|why| why.contains(words));
            assert_eq!(is_told, wanted, "{finding:?}");
            assert!(!found.doubts.iter().any(|doubt| doubt.contains("bend")), "{:?}", found.doubts);
        }
    }
}
