//! Cameras whose numbers are known, simulated and measured: each number comes back within its interval as often as is stated.
//!
//! CYANOMETER_CAMERAS=500 measures so many, and tells how often each interval held.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

mod support;

use cyanometer::analysis::photon_transfer::{
    Asked, ClassFindings, Condition, KEYS, Level, Settings, Site, full_mean, of_class, survey, survey_as,
};
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::readout::ReadOut;
use cyanometer::chain::{CameraSetup, uniform_frame};
use cyanometer::metadata::Scene;
use cyanometer::numerics::normal::NearlyNormal;
use cyanometer::random::Source;
use cyanometer::random::philox::philox4x32_10;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;
use std::collections::BTreeMap;
use support::workshop::Workshop;

const CONFIDENCE: f64 = 0.95;
const QUANTUM_EFFICIENCY: f64 = 0.5;
/// Exposure time of the flats, and of the dark stack.
const FLAT_S: f64 = 0.02;

/// Uniform numbers of a camera.
struct Chance {
    camera: u32,
    drawn: u32,
}

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.drawn += 1;
        let [word, ..] = philox4x32_10([self.camera, self.drawn, 0, 0], [0x5EED, 7]);
        (f64::from(word) + 0.5) / 4_294_967_296.0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }
}

/// Whether rows and columns have noise and patterns of their own.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Ccd,
    Cmos,
}

/// A camera drawn from the ranges of real ones.
fn camera(index: u32, kind: Kind) -> ReadOut {
    let mut chance = Chance { camera: index, drawn: 0 };
    let ccd = ccd(&mut chance);
    if kind == Kind::Ccd {
        return ccd;
    }
    let read_noise_e = ccd.read_noise_e;
    let mut share = |low: f64, high: f64| read_noise_e * chance.between(low, high);
    let (row_noise_e, column_noise_e) = (share(0.1, 0.5), share(0.05, 0.3));
    let (dsnu_e, dsnu_row_e, dsnu_column_e) = (share(0.2, 1.0), share(0.05, 0.5), share(0.1, 0.8));
    let prnu_row = ccd.prnu * chance.between(0.05, 0.3);
    let prnu_column = ccd.prnu * chance.between(0.05, 0.5);
    ReadOut { row_noise_e, column_noise_e, dsnu_e, dsnu_row_e, dsnu_column_e, prnu_row, prnu_column, ..ccd }
}

/// 0, 1, 2 or 3.
fn quarter(chance: &mut Chance) -> u32 {
    let at = chance.uniform();
    [0.25, 0.5, 0.75].into_iter().map(|bound| u32::from(at >= bound)).sum()
}

fn ccd(chance: &mut Chance) -> ReadOut {
    let full_well_e = chance.log_between(3000.0, 80_000.0);
    let bits = 10 + 2 * quarter(chance);
    let top = f64::from((1_u32 << bits) - 1);
    let bias_adu = (top * chance.between(0.01, 0.05)).round();
    let adu_per_e = (top - bias_adu) / full_well_e * chance.between(0.7, 1.4);
    // Noise that the converter sees: at least 0.6 codes.
    let least = 0.6 / adu_per_e;
    ReadOut {
        full_well_e,
        bits,
        bias_adu,
        adu_per_e,
        read_noise_e: chance.log_between(1.0, 30.0).max(least).min(full_well_e / 50.0),
        prnu: chance.log_between(0.002, 0.02),
        dcnu: chance.between(0.05, 0.2),
        dark_current_na_per_cm2: None,
        dark_current_e_per_s: Some(chance.log_between(5.0, 2000.0)),
        temperature_k: 300.0,
        ..support::readout()
    }
}

const SIZE: [usize; 2] = [96, 64];

/// What frames scatter by besides noise, standard deviations.
#[derive(Clone, Copy, Default)]
struct Shake {
    /// Of the light from frame to frame, relative.
    light: f64,
    /// Of the black level from frame to frame, in codes.
    black_adu: f64,
    /// Of exposure times from level to level, relative.
    time: f64,
}

/// Temperature of further darks, beside 300 K.
const WARM_K: f64 = 308.0;

impl Shake {
    fn is_any(self) -> bool {
        self.light + self.black_adu + self.time > 0.0
    }

    /// What the light, the black level in codes, and the time of a frame are changed by.
    fn drawn(self, index: u32, frame: u32, first: u32) -> [f64; 3] {
        // The sum of 12 uniform numbers is normal enough.
        let normal = |place: u32, which: u32| {
            let mut chance = Chance { camera: 10_000 * (which + 1) + index, drawn: 12 * place };
            (0..12).map(|_| chance.uniform()).sum::<f64>() - 6.0
        };
        [1.0 + self.light * normal(frame, 0), self.black_adu * normal(frame, 1), 1.0 + self.time * normal(first, 2)]
    }
}

/// Frames of one condition of a camera.
fn level(camera: (&ReadOut, u32, Shake), condition: Condition, expected_e: f64, frames: [u32; 2]) -> Level {
    level_in(camera, condition, expected_e, frames, None)
}

/// The same, where photosites of such a mean count as full.
fn level_in(
    (readout, index, shake): (&ReadOut, u32, Shake),
    condition: Condition,
    expected_e: f64,
    [frames, first]: [u32; 2],
    full: Option<f64>,
) -> Level {
    let mut taken: Vec<MemoryFrame> = (first..first + frames)
        .map(|frame| {
            let [of_light, black_adu, of_time] = shake.drawn(index, frame, first);
            let expected_e = expected_e * of_light * of_time;
            let mut sensor = support::sensor();
            sensor.readout = Some(ReadOut { bias_adu: readout.bias_adu + black_adu, ..readout.clone() });
            let exposure_s = condition.exposure_s.unwrap() * of_time;
            let exposure = Exposure { exposure_s, f_number: 8.0, lens_transmittance: 1.0 };
            let setup = CameraSetup::new(sensor, exposure);
            let head = setup.plane(SIZE, Scene::uniform("flat", [expected_e; 3])).unwrap();
            let light = uniform_frame(head, [expected_e; 3]).unwrap();
            let settings = NoiseSettings {
                seed: index.into(),
                sensor_seed: index.into(),
                frame,
                temperature_k: condition.temperature_k,
                ..NoiseSettings::default()
            };
            let noisy = light.through(&AddNoise::new(&light.header, &settings).unwrap()).unwrap().0;
            let digitized = noisy.through(&Digitize::new(&noisy.header, &AdcSettings::default()).unwrap()).unwrap().0;
            MemoryFrame::new(digitized.header, digitized.samples)
        })
        .collect();
    let top = f64::from((1_u32 << readout.bits) - 1);
    let sites = Site::of(&taken[0].header);
    let found = survey_as(&mut taken, &Asked { top: Some(top), full, ..Asked::default() }).unwrap();
    let green = sites.iter().zip(found.sites).filter(|(site, _)| site.class == "G");
    Level::of(0, condition, green.map(|(_, survey)| survey).collect())
}

/// What a camera is found to be.
fn measured(readout: &ReadOut, index: u32) -> ClassFindings {
    let [flats, darks] = levels(readout, index);
    let found = found(&flats, &darks);
    assert_eq!(found.suspects, [], "{index}");
    found
}

fn settings() -> Settings {
    Settings { confidence: CONFIDENCE, photon_error: 0.0, are_codes: true, top: None }
}

fn found(flats: &[Level], darks: &[Level]) -> ClassFindings {
    of_class("G", flats, darks, darks, &settings())
}

/// Flats and darks of a camera.
fn levels(readout: &ReadOut, index: u32) -> [Vec<Level>; 2] {
    let [flats, darks, _] = levels_of((readout, index, Shake::default()));
    [flats, darks]
}

/// Flats and darks of a camera, and darks at [`WARM_K`].
fn levels_of(camera: (&ReadOut, u32, Shake)) -> [Vec<Level>; 3] {
    let readout = camera.0;
    let lit = |photons: f64| Condition {
        is_lit: true,
        exposure_s: Some(FLAT_S),
        photons: Some(photons),
        temperature_k: None,
    };
    let dark =
        |exposure_s: f64| Condition { is_lit: false, exposure_s: Some(exposure_s), photons: None, temperature_k: None };
    let end = readout.full_well_e.min((f64::from((1_u32 << readout.bits) - 1) - readout.bias_adu) / readout.adu_per_e);
    let shares = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.05, 1.3];
    let mut number = 0;
    let mut next = |frames: u32| {
        number += frames;
        number - frames
    };
    let flats: Vec<Level> = shares
        .iter()
        .map(|share| {
            let frames = if *share == 0.5 { 8 } else { 2 };
            level(camera, lit(share * end / QUANTUM_EFFICIENCY), share * end, [frames, next(frames)])
        })
        .collect();
    let full = full_mean(&flats);
    let mut darks_at = |temperature_k: f64| -> Vec<Level> {
        let of = |(time, frames): &(f64, u32)| {
            let condition = Condition { temperature_k: Some(temperature_k), ..dark(*time) };
            level_in(camera, condition, 0.0, [*frames, next(*frames)], full)
        };
        [(FLAT_S, 8), (0.1, 2), (0.25, 2), (0.5, 4), (1.0, 4)].iter().map(of).collect()
    };
    let (darks, warm) =
        (darks_at(readout.temperature_k), if camera.2.is_any() { darks_at(WARM_K) } else { Vec::new() });
    [flats, darks, warm]
}

/// The signal of the largest temporal variance, in electrons.
fn saturation(readout: &ReadOut) -> f64 {
    let top = (f64::from((1_u32 << readout.bits) - 1) + 0.5 - readout.bias_adu) / readout.adu_per_e;
    let dark = readout.dark_current_e_per_s(readout.temperature_k) * FLAT_S;
    let variance = |signal: f64| -> f64 {
        // Over the photosites: a normal law in 21 steps.
        let steps = (-10..=10).map(|step| f64::from(step) / 2.5);
        let (mut sum, mut weights) = (0.0, 0.0);
        for step in steps {
            let rate = signal * (1.0 + readout.prnu * step) + dark;
            let held = NearlyNormal::normal(rate, rate).clipped_above(readout.full_well_e);
            let read = NearlyNormal::normal(held.mean, held.variance + readout.read_noise_e.powi(2)).clipped_above(top);
            let weight = (-0.5 * step * step).exp();
            sum += weight * read.variance;
            weights += weight;
        }
        sum / weights
    };
    let levels = (500..=1400).map(|share| f64::from(share) / 1000.0 * top.min(readout.full_well_e));
    levels.max_by(|a, b| variance(*a).total_cmp(&variance(*b))).unwrap()
}

/// The mean sensitivity of a camera's green photosites.
fn mean_sensitivity(readout: &ReadOut, index: u32) -> f64 {
    const LEVEL_E: f64 = 1000.0;
    let mut sensor = support::sensor();
    sensor.readout = Some(ReadOut { full_well_e: 1e6, ..readout.clone() });
    let exposure = Exposure { exposure_s: FLAT_S, f_number: 8.0, lens_transmittance: 1.0 };
    let head = CameraSetup::new(sensor, exposure).plane(SIZE, Scene::uniform("flat", [LEVEL_E; 3])).unwrap();
    let light = uniform_frame(head, [LEVEL_E; 3]).unwrap();
    let of_response = [Source::Prnu, Source::PrnuRow, Source::PrnuColumn];
    let without = Source::ALL.into_iter().filter(|source| !of_response.contains(source)).collect();
    let settings = NoiseSettings { sensor_seed: index.into(), without, ..NoiseSettings::default() };
    let mut pattern = vec![light.through(&AddNoise::new(&light.header, &settings).unwrap()).unwrap().0; 2];
    let dark = pattern[0].header.metadata.dark_signal_e.unwrap();
    let pattern: Vec<MemoryFrame> =
        pattern.drain(..).map(|frame| MemoryFrame::new(frame.header, frame.samples)).collect();
    let sites = Site::of(&pattern[0].header);
    let found = survey(&mut pattern.clone(), None, false).unwrap();
    let green: Vec<f64> =
        sites.iter().zip(found.sites).filter(|(site, _)| site.class == "G").map(|(_, survey)| survey.mean).collect();
    (green.iter().sum::<f64>() / green.len() as f64 - dark) / LEVEL_E
}

/// What a camera is.
fn truths(readout: &ReadOut, index: u32) -> Vec<(&'static str, f64)> {
    // The responsivity is that of the photosites there are.
    let efficiency = QUANTUM_EFFICIENCY * mean_sensitivity(readout, index);
    let current = readout.dark_current_e_per_s(readout.temperature_k);
    let dark_e = current * FLAT_S;
    let dark_pattern = readout.dcnu * dark_e;
    let ReadOut { row_noise_e, column_noise_e, dsnu_e, dsnu_row_e, dsnu_column_e, prnu_row, prnu_column, .. } =
        *readout;
    let dark_noise_e = readout.read_noise_e.hypot(row_noise_e).hypot(column_noise_e);
    let dark_variance = dark_noise_e.powi(2) + 1.0 / 12.0 / readout.adu_per_e.powi(2);
    let dsnu_pixel_e = dsnu_e.hypot(dark_pattern);
    vec![
        ("gain_adu_per_e", readout.adu_per_e),
        ("responsivity_adu_per_photon", readout.adu_per_e * efficiency),
        ("quantum_efficiency", efficiency),
        ("dark_noise_e", dark_noise_e),
        ("threshold_e", 0.5 + (0.25 + dark_variance).sqrt()),
        ("row_noise_e", row_noise_e),
        ("column_noise_e", column_noise_e),
        ("pixel_noise_e", readout.read_noise_e),
        ("saturation_e", saturation(readout)),
        ("linearity_error_min", 0.0),
        ("linearity_error_max", 0.0),
        ("prnu", readout.prnu.hypot(prnu_row).hypot(prnu_column)),
        ("prnu_row", prnu_row),
        ("prnu_column", prnu_column),
        ("prnu_pixel", readout.prnu),
        ("dsnu_e", dsnu_pixel_e.hypot(dsnu_row_e).hypot(dsnu_column_e)),
        ("dsnu_pixel_e", dsnu_pixel_e),
        ("dsnu_row_e", dsnu_row_e),
        ("dsnu_column_e", dsnu_column_e),
        ("dsnu_offset_e", dsnu_e),
        ("dcnu", readout.dcnu),
        ("dark_current_e_per_s", current),
        // Fixed patterns multiply counts, so that the temporal variance goes by the square of what a photosite has.
        ("dark_current_from_variance_e_per_s", current * (1.0 + readout.dcnu.powi(2))),
    ]
}

#[test]
fn numbers_of_ccds_lie_within_their_intervals() {
    check_coverage(Kind::Ccd);
}

#[test]
fn numbers_of_cmos_cameras_lie_within_their_intervals() {
    check_coverage(Kind::Cmos);
}

/// Of n cameras so many intervals may miss by chance: 4 standard deviations beyond 5 %.
fn check_coverage(kind: Kind) {
    let count: u32 = std::env::var("CYANOMETER_CAMERAS").map_or(40, |count| count.parse().unwrap());
    let found: Vec<_> = (0..count)
        .into_par_iter()
        .map(|index| {
            let readout = camera(index, kind);
            let found = measured(&readout, index);
            let judged = truths(&readout, index).into_iter().map(|(key, truth)| {
                let interval = found.get(key);
                let held = interval.map(|interval| (interval.low - 1e-12..=interval.high + 1e-12).contains(&truth));
                let width = interval.map_or(f64::NAN, |interval| (interval.high - interval.low) / 2.0);
                let off = interval.map_or(f64::NAN, |interval| interval.value - truth);
                (key, held, width / truth, off / width)
            });
            judged.collect::<Vec<_>>()
        })
        .collect();
    let mut tally: BTreeMap<&str, (u32, u32, Vec<f64>, f64)> = BTreeMap::new();
    for (key, held, width, off) in found.into_iter().flatten() {
        let entry = tally.entry(key).or_default();
        if let Some(held) = held {
            entry.0 += 1;
            entry.1 += u32::from(!held);
            entry.2.push(width);
            entry.3 += off;
        }
    }
    for (key, (known, missed, mut widths, off)) in tally {
        widths.sort_by(f64::total_cmp);
        let width = widths.get(widths.len() / 2).copied().unwrap_or(f64::NAN);
        let n = f64::from(known);
        eprintln!(
            "{key}: {missed} of {known} missed, median half-width {width:.2e}, mean error over half-width {:.3}",
            off / n
        );
        let allowed = n * (1.0 - CONFIDENCE) + 4.0 * (n * CONFIDENCE * (1.0 - CONFIDENCE)).sqrt();
        assert!(known * 10 >= count * 6, "{key} is known of {known} of {count} cameras alone");
        assert!(f64::from(missed) <= allowed, "{key}: {missed} of {known} intervals missed");
    }
}

/// A level as it is with another light than is said: its signal so many times as large.
fn relit(flat: &Level, dark: &Level, times: f64) -> Level {
    Level { mean: dark.mean + (flat.mean - dark.mean) * times, ..flat.clone() }
}

/// A lamp whose light scatters by 0.5 % from level to level, alike in proportion at all: of 60 measurements 3 responsivities may
/// lie outside their intervals, and 10 by chance, 4 standard deviations.
#[test]
fn a_lamp_that_flickers_widens_the_responsivity() {
    const COUNT: u32 = 60;
    let readout = camera(3, Kind::Ccd);
    let [flats, darks] = levels(&readout, 3);
    let key = "responsivity_adu_per_photon";
    let truth = found(&flats, &darks).get(key).unwrap().value;
    let missed = (0..COUNT).filter(|draw| {
        let mut chance = Chance { camera: 1000 + draw, drawn: 0 };
        // The sum of 12 uniform numbers is normal enough.
        let mut normal = || (0..12).map(|_| chance.uniform()).sum::<f64>() - 6.0;
        let lit: Vec<Level> = flats.iter().map(|flat| relit(flat, &darks[0], 1.0 + 0.005 * normal())).collect();
        let interval = found(&lit, &darks).get(key).unwrap();
        !(interval.low..=interval.high).contains(&truth)
    });
    let missed = missed.count();
    eprintln!("{missed} of {COUNT}");
    assert!(missed <= 10, "{missed} of {COUNT}");
}

/// Cameras whose frames scatter beyond noise, in one way or another: what means tell lies within its interval as often as is stated,
/// and the scatter is told of. Of n cameras so many may miss by chance: 4 standard deviations beyond 5 %.
#[test]
fn frames_that_scatter_beyond_noise_widen_intervals() {
    let count: u32 = std::env::var("CYANOMETER_CAMERAS").map_or(24, |count| count.parse().unwrap());
    let none = Shake::default();
    for (name, shake, words) in [
        ("light", Shake { light: 0.001, ..none }, "light scatters by"),
        ("black", Shake { black_adu: 0.3, ..none }, "the black level moves"),
        ("both", Shake { light: 0.002, black_adu: 0.3, ..none }, "the black level moves"),
        ("time", Shake { time: 0.01, ..none }, "from level to level"),
    ] {
        let found: Vec<_> = (0..count).into_par_iter().map(|index| shaken(index, shake, words)).collect();
        let told = found.iter().filter(|(told, _)| *told).count();
        for (place, key) in SHAKEN.iter().enumerate() {
            let known: Vec<[f64; 2]> = found.iter().filter_map(|(_, held)| held[place]).collect();
            let missed = known.iter().filter(|[off, _]| off.abs() > 1.0).count();
            let mut widths: Vec<f64> = known.iter().map(|[_, width]| *width).collect();
            widths.sort_by(f64::total_cmp);
            let n = known.len() as f64;
            let width = widths.get(known.len() / 2).copied().unwrap_or(f64::NAN);
            eprintln!("{name}, {key}: {missed} of {n} missed, median half-width {width:.2e}; {told} of {count} told");
            let allowed = n * (1.0 - CONFIDENCE) + 4.0 * (n * CONFIDENCE * (1.0 - CONFIDENCE)).sqrt();
            assert!(n * 2.0 >= f64::from(count), "{name}: {key} is known of {n} of {count} cameras alone");
            assert!(missed as f64 <= allowed, "{name}, {key}: {missed} of {n} intervals missed");
        }
    }
}

/// Numbers that means of frames tell.
const SHAKEN: [&str; 6] = [
    "linearity_error_min",
    "linearity_error_max",
    "dark_current_e_per_s",
    "dark_current_doubling_k",
    "quantum_efficiency",
    "gain_adu_per_e",
];

/// Of a camera whose frames scatter: whether words of that are among what is told, and how far each of the numbers is off over half the
/// width of its interval, with that.
fn shaken(index: u32, shake: Shake, words: &str) -> (bool, [Option<[f64; 2]>; 6]) {
    let readout = camera(index, Kind::Ccd);
    let [flats, darks, warm] = levels_of((&readout, index, shake));
    let all: Vec<Level> = darks.iter().chain(&warm).cloned().collect();
    let settings = Settings { confidence: CONFIDENCE, photon_error: 0.0, are_codes: true, top: None };
    let found = of_class("G", &flats, &darks, &all, &settings);
    assert_eq!(found.suspects, [], "{index}");
    let currents = [readout.temperature_k, WARM_K].map(|kelvin| readout.dark_current_e_per_s(kelvin));
    let doubling = (WARM_K - readout.temperature_k) / (currents[1] / currents[0]).log2();
    let mut truths: BTreeMap<&str, f64> = truths(&readout, index).into_iter().collect();
    truths.insert("dark_current_doubling_k", doubling);
    let held = SHAKEN.map(|key| {
        let (interval, truth) = (found.get(key)?, truths[key]);
        let width = (interval.high - interval.low) / 2.0;
        let half = if interval.value > truth { interval.value - interval.low } else { interval.high - interval.value };
        Some([(interval.value - truth) / half, width])
    });
    (found.notes.iter().chain(&found.doubts).any(|told| told.contains(words)), held)
}

/// What levels show of wrong photons and of light that drifts is told; a camera that is as it should be raises no doubt.
#[test]
fn light_that_is_not_as_said_is_doubted() {
    let readout = camera(3, Kind::Ccd);
    let [flats, darks] = levels(&readout, 3);
    assert_eq!(found(&flats, &darks).doubts, Vec::<String>::new());
    let doubt = |flats: &[Level], words: &str| {
        let doubts = found(flats, &darks).doubts;
        assert!(doubts.iter().any(|doubt| doubt.contains(words)), "{words}: {doubts:?}");
    };
    let mut exchanged = flats.clone();
    exchanged.swap(3, 4);
    let photons = [3, 4].map(|place| exchanged[place].condition.photons);
    (exchanged[3].condition.photons, exchanged[4].condition.photons) = (photons[1], photons[0]);
    doubt(&exchanged, "are photons exchanged?");
    let mut none = flats.clone();
    none[0].condition.photons = Some(0.0);
    doubt(&none, "a flat of 0 photons has a signal of");
    let mut drifting = flats.clone();
    for site in drifting.iter_mut().flat_map(|flat| &mut flat.sites) {
        let (first, dark) = (site.frame_means[0], darks[0].mean);
        for (frame, mean) in site.frame_means.iter_mut().enumerate() {
            *mean = first + (first - dark) * 0.01 * frame as f64;
        }
    }
    doubt(&drifting, "light rises by 1.00 % from frame to frame");
    let brightest = flats[12].mean - darks[0].mean;
    let bent = |flat: &Level| relit(flat, &darks[0], 1.0 - 0.02 * (flat.mean - darks[0].mean) / brightest);
    doubt(&flats.iter().map(bent).collect::<Vec<_>>(), "the response bends");
    let wrong = |(place, flat): (usize, &Level)| relit(flat, &darks[0], if place % 2 == 0 { 1.0 } else { 1.05 });
    doubt(&flats.iter().enumerate().map(wrong).collect::<Vec<_>>(), "signals miss the line of the response by");
}

/// Cameras of which two in a hundred photosites are hot: dark current and patterns of the dark lie within their
/// intervals as often as is stated. Of n cameras so many may miss by chance: 4 standard deviations beyond 5 %.
#[test]
fn hot_photosites_widen_intervals_of_the_dark() {
    const OF_DARK: [&str; 4] = ["dsnu_e", "dsnu_pixel_e", "dark_current_e_per_s", "dcnu"];
    let count: u32 = std::env::var("CYANOMETER_CAMERAS").map_or(40, |count| count.parse().unwrap());
    let found: Vec<[Option<bool>; 4]> = (0..count)
        .into_par_iter()
        .map(|index| {
            let plain = camera(index, Kind::Ccd);
            // No photosite is full after the longest exposure, 1 s.
            let current = plain.dark_current_e_per_s.unwrap().min(plain.full_well_e / 50.0);
            let (share, hot) = (0.02, 5.0 * current);
            let readout = ReadOut {
                dark_current_e_per_s: Some(current),
                hot_pixel_share: share,
                hot_pixel_dark_current_e_per_s: hot,
                ..plain
            };
            let [flats, darks] = levels(&readout, index);
            let found = found(&flats, &darks);
            let mean = current + share * hot;
            // An exponential law has a variance of the square of its mean.
            let variance = (readout.dcnu * mean).powi(2) + share * (2.0 - share) * hot * hot;
            let of_flats = variance.sqrt() * FLAT_S;
            let truths = [of_flats, of_flats, mean, variance.sqrt() / mean];
            let holds = |(key, truth): (&str, f64)| {
                let interval = found.get(key)?;
                Some((interval.low..=interval.high).contains(&truth))
            };
            [0, 1, 2, 3].map(|place| holds((OF_DARK[place], truths[place])))
        })
        .collect();
    for (place, key) in OF_DARK.iter().enumerate() {
        let held: Vec<bool> = found.iter().filter_map(|held| held[place]).collect();
        let (n, missed) = (held.len() as f64, held.iter().filter(|held| !**held).count());
        eprintln!("{key}: {missed} of {n} missed");
        let allowed = n * (1.0 - CONFIDENCE) + 4.0 * (n * CONFIDENCE * (1.0 - CONFIDENCE)).sqrt();
        assert!(missed as f64 <= allowed, "{key}: {missed} of {n} intervals missed");
    }
}

fn why(found: &ClassFindings, key: &str) -> String {
    found.findings.iter().find(|finding| finding.key == key).unwrap().found.clone().unwrap_err()
}

/// Of darks that code 0 clips each number that they would tell says that, and which frames would tell it; of flats whose exposure
/// time no dark is known to have, that.
#[test]
fn reasons_are_true() {
    const OF_DARKS: [&str; 13] = [
        "black_level_adu",
        "dark_noise_e",
        "row_noise_e",
        "pixel_noise_e",
        "threshold_e",
        "dsnu_e",
        "dsnu_row_e",
        "dsnu_column_e",
        "dsnu_pixel_e",
        "dark_current_e_per_s",
        "dark_current_from_variance_e_per_s",
        "dsnu_offset_e",
        "dcnu",
    ];
    let readout = camera(3, Kind::Ccd);
    let [flats, darks] = levels(&readout, 3);
    let clipped: Vec<Level> = darks.iter().map(|dark| Level { at_ends: [0.0, 0.3], ..dark.clone() }).collect();
    let of_clipped = found(&flats, &clipped);
    for key in OF_DARKS {
        let said = why(&of_clipped, key);
        assert!(
            said.contains("clipped at code 0") && said.contains("black level of the camera raised"),
            "{key}: {said}"
        );
    }
    let untimed: Vec<Level> = darks[..2]
        .iter()
        .map(|dark| Level { condition: Condition { exposure_s: None, ..dark.condition }, ..dark.clone() })
        .collect();
    let of_untimed = found(&flats, &untimed);
    for key in ["quantum_efficiency", "saturation_e", "linearity_error_max", "prnu"] {
        let said = why(&of_untimed, key);
        assert!(said.contains("no dark is known to have the exposure time of the flats"), "{key}: {said}");
    }
    assert!(of_untimed.get("row_noise_e").is_some(), "{}", why(&of_untimed, "row_noise_e"));
    for key in OF_DARKS.into_iter().filter(|key| !key.starts_with("dark_current") && !key.starts_with("dsnu_offset")) {
        let said = why(&found(&flats, &[]), key);
        assert!(said.contains("two darks or more") || key == "dcnu", "{key}: {said}");
    }
    let full: Vec<Level> = flats[..2].iter().map(|flat| Level { at_ends: [0.5, 0.0], ..flat.clone() }).collect();
    let said = why(&found(&full, &darks), "gain_adu_per_e");
    assert!(said.ends_with("(of 2 levels of flats 2 reach the largest code)"), "{said}");
}

/// Where no gain follows what darks tell is told, and every other number has its reason; clipped darks, dead photosites and darks of
/// another time are told as what they are.
#[test]
fn what_is_known_is_told_and_no_more() {
    let readout = camera(3, Kind::Ccd);
    let [flats, darks] = levels(&readout, 3);
    let clipped: Vec<Level> = darks.iter().map(|dark| Level { at_ends: [0.0, 0.3], ..dark.clone() }).collect();
    let full: Vec<Level> = flats[..2].iter().map(|flat| Level { at_ends: [0.5, 0.0], ..flat.clone() }).collect();
    let of_full = found(&full, &darks);
    assert_eq!(of_full.findings.len(), KEYS.len());
    for (key, ..) in KEYS {
        match key {
            "black_level_adu" | "dark_noise_adu" => assert!(of_full.get(key).is_some(), "{key}"),
            _ => assert!(why(&of_full, key).starts_with("no gain follows"), "{key}"),
        }
    }
    assert!(
        of_full.curve.len() == 2 && of_full.curve[0].mean_adu == full[0].mean && of_full.darks.len() == darks.len()
    );
    let said = why(&of_class("G", &flats, &[], &darks, &settings()), "black_level_adu");
    assert!(said.contains("of other temperatures than the flats"), "{said}");
    // Clipped darks are no black level that moves, whatever their line over time does.
    let bent = clipped
        .iter()
        .enumerate()
        .map(|(place, dark)| Level { mean: dark.mean + [0.0, 4.0, 0.0, 0.0, 0.0][place], ..dark.clone() });
    let doubts = found(&flats, &bent.collect::<Vec<_>>()).doubts;
    assert!(!doubts.iter().any(|doubt| doubt.contains("black level moves")), "{doubts:?}");
    // Photosites that are at code 0 in all flats empty no report.
    let dead = |levels: &[Level]| {
        levels.iter().map(|level| Level { at_ends: [level.at_ends[0], 0.002], ..level.clone() }).collect::<Vec<_>>()
    };
    let of_dead = found(&dead(&flats), &dead(&darks));
    assert!(
        of_dead.get("gain_adu_per_e") == found(&flats, &darks).get("gain_adu_per_e")
            && of_dead.get("dark_noise_e").is_some()
    );
    // Darks of another time stand in with a word.
    let doubts = found(&flats, &darks[2..]).doubts;
    assert!(
        doubts.iter().any(|doubt| doubt.contains("stand above the line through darks of 0.25 to 1 s")),
        "{doubts:?}"
    );
    assert!(doubts.iter().any(|doubt| doubt.contains("told from those of darks of 0.5 s")), "{doubts:?}");
    // A dark of the flats' time is what comes off patterns under light, be it of fewer frames.
    let mut few: Vec<Level> =
        darks.iter().enumerate().map(|(place, dark)| Level { place: 100 + place, ..dark.clone() }).collect();
    few[0].frames = 2;
    assert_eq!(found(&flats, &few).stacks[1].unwrap().0, 100);
}

/// Frames of one condition of which the second, or the third, is a copy; nearly full ones, the same but for no photosite, are none.
#[test]
fn copies_are_told_from_full_frames() {
    let readout = camera(3, Kind::Ccd);
    let mut sensor = support::sensor();
    sensor.readout = Some(readout.clone());
    let exposure = Exposure { exposure_s: FLAT_S, f_number: 8.0, lens_transmittance: 1.0 };
    let head = CameraSetup::new(sensor, exposure).plane(SIZE, Scene::uniform("flat", [1000.0; 3])).unwrap();
    let light = uniform_frame(head, [1000.0; 3]).unwrap();
    let taken = |frame: u32| {
        let noisy =
            light.through(&AddNoise::new(&light.header, &NoiseSettings { frame, ..NoiseSettings::default() }).unwrap());
        let noisy = noisy.unwrap().0;
        let digitized = noisy.through(&Digitize::new(&noisy.header, &AdcSettings::default()).unwrap()).unwrap().0;
        MemoryFrame::new(digitized.header, digitized.samples)
    };
    let full = |frame: u32| {
        let mut frame = taken(frame);
        let top = frame.samples.iter().copied().fold(0.0, f32::max);
        let samples = (0..frame.samples.len()).map(|place| if place % 1000 == 7 { top - 9.0 } else { top }).collect();
        frame = MemoryFrame::new(frame.header.clone(), samples);
        frame
    };
    let copies = |mut frames: Vec<MemoryFrame>| survey(&mut frames, None, false).unwrap().sites[0].copies;
    assert_eq!(copies(vec![taken(0), taken(1)]), None);
    assert_eq!(copies(vec![taken(0), taken(0)]), Some([0, 1]));
    assert_eq!(copies(vec![taken(0), taken(1), taken(2), taken(1)]), Some([1, 3]));
    // A number that was added makes no other frame of it.
    let raised = |frame: u32| {
        let own = taken(frame);
        MemoryFrame::new(own.header.clone(), own.samples.iter().map(|sample| sample + 1.0).collect())
    };
    assert_eq!(copies(vec![taken(0), raised(0)]), Some([0, 1]));
    assert_eq!(copies(vec![taken(0), taken(1), raised(0)]), Some([0, 2]));
    assert_eq!(copies(vec![taken(0), raised(1)]), None);
    assert_eq!(copies(vec![full(0), full(1)]), None);
    assert_eq!(copies(vec![full(0), full(1), full(2)]), None);
}

/// A flat among the darks, a dark among the flats, and exposure times that are wrong are named by their level, and no other is; of
/// levels as they should be none is.
#[test]
fn levels_that_are_not_what_they_are_said_to_be_are_named() {
    let placed = |levels: Vec<Level>, first: usize| -> Vec<Level> {
        levels.into_iter().enumerate().map(|(place, level)| Level { place: first + place, ..level }).collect()
    };
    let suspects = |flats: &[Level], darks: &[Level]| -> Vec<(usize, String)> {
        found(flats, darks).suspects.into_iter().map(|suspect| (suspect.place, suspect.problem)).collect()
    };
    for index in 0..8 {
        let readout = camera(index, Kind::Ccd);
        let [flats, darks] = levels(&readout, index);
        let (flats, darks) = (placed(flats, 0), placed(darks, 100));
        assert_eq!(suspects(&flats, &darks), [], "{index}");
        let only = |found: Vec<(usize, String)>, place: usize, words: &str| {
            let [(own, problem)] = &found[..] else { panic!("{index}: {found:?}") };
            assert!(*own == place && problem.contains(words), "{index}: {own} {problem}");
        };
        // A flat among the darks, with its own exposure time.
        let mut lit = darks.clone();
        lit[2] = Level { condition: darks[2].condition, place: 102, ..flats[4].clone() };
        only(suspects(&flats, &lit), 102, "are they flats");
        // The same beside one dark alone.
        let two = [darks[0].clone(), Level { condition: darks[0].condition, place: 103, ..flats[6].clone() }];
        assert!(
            suspects(&flats, &two).iter().any(|(place, problem)| *place == 103 && problem.contains("are they flats"))
        );
        // A dark among the flats.
        let mut unlit = flats.clone();
        unlit[5] = Level { condition: flats[5].condition, place: 5, ..darks[0].clone() };
        unlit.sort_by(|a, b| a.mean.total_cmp(&b.mean));
        only(suspects(&unlit, &darks), 5, "are they darks");
        // A number of photons, and without photons an exposure time, that is wrong by a third.
        let mut wrong = flats.clone();
        wrong[6].condition.photons = wrong[6].condition.photons.map(|photons| photons * 1.5);
        only(suspects(&wrong, &darks), 6, "of their number of photons: is that wrong?");
    }
}

/// A stack at 80 % of saturation, beyond what the gain is fitted to, is what patterns are measured on; one at saturation is not, and that
/// is said.
#[test]
fn patterns_are_measured_on_the_stack_below_saturation() {
    let readout = camera(3, Kind::Ccd);
    let [flats, darks] = levels(&readout, 3);
    let stacked = |place: usize, first: u32| -> ClassFindings {
        let condition = flats[place].condition;
        let expected_e = condition.photons.unwrap() * QUANTUM_EFFICIENCY;
        let stack = level((&readout, 3, Shake::default()), condition, expected_e, [16, first]);
        let mut flats = flats.clone();
        flats[place] = Level { place: 77, ..stack };
        found(&flats, &darks)
    };
    let near = stacked(9, 900);
    assert_eq!(near.stacks[0].unwrap().0, 77);
    let [own, pairs] = [&near, &found(&flats, &darks)].map(|found| found.get("prnu_pixel").unwrap());
    assert!(own.high - own.low < pairs.high - pairs.low, "{own:?} {pairs:?}");
    let full = stacked(12, 950);
    assert_ne!(full.stacks[0].unwrap().0, 77);
    assert!(
        full.notes.iter().any(|note| note.contains("flats of 16 frames are too near saturation")),
        "{:?}",
        full.notes
    );
}

/// The saturation capacity is said to be that of the converter or of the photosites, whichever ends first; where the largest code is not
/// known, a converter that ends is not called a full well.
#[test]
fn saturation_is_said_to_be_of_photosites_or_of_the_converter() {
    let mut kinds = [0; 2];
    for index in 0..12 {
        let readout = camera(index, Kind::Ccd);
        let top = f64::from((1_u32 << readout.bits) - 1);
        let range = (top - readout.bias_adu) / readout.adu_per_e / readout.full_well_e;
        if (0.95..1.05).contains(&range) {
            continue;
        }
        let [flats, darks] = levels(&readout, index);
        let of = |top: Option<f64>| {
            let settings = Settings { confidence: CONFIDENCE, photon_error: 0.0, are_codes: true, top };
            let found = of_class("G", &flats, &darks, &darks, &settings);
            let what = found.findings.iter().find(|finding| finding.key == "saturation_e").unwrap().what;
            (what, found)
        };
        let ((what, known), (guess, unknown)) = (of(Some(top)), of(None));
        let is_converter = range < 1.0;
        kinds[usize::from(is_converter)] += 1;
        if is_converter {
            assert_eq!(
                (what, guess),
                ("saturation capacity, of the converter", "saturation capacity, of either"),
                "{index}"
            );
            assert!(why(&known, "full_well_e").starts_with(&format!("the converter ends first, at the code {top}")));
            assert!(why(&unknown, "full_well_e").contains("--white"), "{index}");
        } else {
            assert_eq!([what, guess], ["saturation capacity, of the photosites"; 2], "{index}");
            assert!(known.get("full_well_e").is_some() && unknown.get("full_well_e").is_some(), "{index}");
        }
    }
    assert!(kinds.iter().all(|count| *count > 1), "{kinds:?}");
}

/// An uncertainty of all numbers of photons together is one of what they tell, however many levels there are.
#[test]
fn an_error_of_all_photons_does_not_average_out() {
    let readout = camera(3, Kind::Ccd);
    let [flats, darks] = levels(&readout, 3);
    let of = |photon_error: f64| {
        of_class(
            "G",
            &flats,
            &darks,
            &darks,
            &Settings { confidence: CONFIDENCE, photon_error, are_codes: true, top: None },
        )
    };
    let (exact, off) = (of(0.0), of(0.03));
    for key in ["responsivity_adu_per_photon", "quantum_efficiency", "saturation_photons"] {
        let [own, wide] = [&exact, &off].map(|found| found.get(key).unwrap());
        // Errors that are independent of each other add as squares, but what rounding hides, a thousandth here; 1.96 standard deviations
        // of 3 %, and its square at most.
        let wanted = (own.high - own.value).hypot(1.96 * 0.03 * own.value);
        assert!(((wide.high - wide.value) / wanted - 1.0).abs() < 0.03, "{key}: {own:?} {wide:?}");
    }
    assert_eq!(exact.get("gain_adu_per_e"), off.get("gain_adu_per_e"));
}

/// Full well is that of all charge, saturation that of light alone: cameras of 200 to 1000 e- of dark signal in the flats, of one exposure
/// time after another, as that of a lamp that does not change. Flats beyond full well have the less signal the longer they are exposed,
/// and nobody exchanged their photons. Of 20 full wells 5 may lie outside by chance, 4 standard deviations.
#[test]
fn full_well_counts_the_dark_charge() {
    const COUNT: u32 = 20;
    let missed = (0..COUNT).filter(|&index| {
        let full_well_e = 12_000.0;
        let readout = ReadOut {
            full_well_e,
            bits: 12,
            bias_adu: 100.0,
            adu_per_e: 0.3,
            read_noise_e: 6.0,
            dark_current_e_per_s: Some(f64::from(index + 1) * 2500.0),
            ..camera(index, Kind::Ccd)
        };
        let own = (&readout, index, Shake::default());
        let dark = |exposure_s: f64, first: u32| {
            let condition =
                Condition { is_lit: false, exposure_s: Some(exposure_s), photons: None, temperature_k: None };
            level(own, condition, 0.0, [2, first])
        };
        let flat = |(place, share): (u32, &f64)| {
            let exposure_s = Some(FLAT_S * share);
            let photons = Some(share * full_well_e / QUANTUM_EFFICIENCY);
            let condition = Condition { is_lit: true, exposure_s, photons, temperature_k: None };
            level(own, condition, share * full_well_e, [2, 100 + 2 * place])
        };
        let shares = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.4, 1.8];
        let flats: Vec<Level> = (0..).zip(&shares).map(flat).collect();
        let darks: Vec<Level> =
            (0..).zip(&shares).map(|(place, share)| dark(FLAT_S * share, 200 + 2 * place)).collect();
        let of_all = found(&flats, &darks);
        assert!(!of_all.doubts.iter().any(|doubt| doubt.contains("exchanged")), "{:?}", of_all.doubts);
        // Darks of one time have room for the charge that they do not tell.
        let of_one = found(&flats, &darks[darks.len() - 1..]);
        let [most, gain] = ["full_well_e", "gain_adu_per_e"].map(|key| of_one.get(key).unwrap());
        assert!(most.high * gain.value > full_well_e * readout.adu_per_e, "{index}: {most:?} {gain:?}");
        let interval = of_all.get("full_well_e").unwrap();
        assert!(interval.value > of_all.get("saturation_e").unwrap().value);
        !(interval.low..=interval.high).contains(&full_well_e)
    });
    let missed = missed.count();
    eprintln!("{missed} of {COUNT}");
    assert!(missed <= 5, "{missed} of {COUNT}");
}

/// Cameras whose noise is 0.1 to 0.5 of a code: what means and variances of darks tell holds what rounding hides, wherever black lies
/// between two codes, and neither a black level that moves nor a response that bends is told of. Of 40 so many may lie outside by chance: 4 standard deviations
/// beyond 5 %.
#[test]
fn what_rounding_hides_of_quiet_darks_is_within_intervals() {
    const KEYS: [&str; 5] =
        ["black_level_adu", "dark_current_e_per_s", "gain_adu_per_e", "dark_noise_e", "quantum_efficiency"];
    for noise_adu in [0.1, 0.2, 0.3, 0.4, 0.5] {
        let found: Vec<[Option<bool>; 5]> = (0..40_u32)
            .into_par_iter()
            .map(|index| {
                let mut chance = Chance { camera: 5000 + index, drawn: 0 };
                let plain = camera(index, Kind::Ccd);
                // Of a code to few electrons their shot noise is nearly normal.
                let adu_per_e = plain.adu_per_e.min(0.3);
                let readout = ReadOut {
                    bias_adu: (plain.bias_adu + chance.uniform()).max(8.0),
                    adu_per_e,
                    read_noise_e: noise_adu / adu_per_e,
                    dsnu_e: 0.0,
                    dark_current_e_per_s: Some(chance.log_between(0.5, 20.0) / adu_per_e),
                    ..plain
                };
                let [flats, darks] = levels(&readout, index);
                let found = found(&flats, &darks);
                for untrue in ["the black level moves", "the response bends", "falls with exposure time"] {
                    assert!(
                        !found.doubts.iter().any(|doubt| doubt.contains(untrue)),
                        "{noise_adu} {index}: {:?}",
                        found.doubts
                    );
                }
                let truths: BTreeMap<&str, f64> = truths(&readout, index).into_iter().collect();
                KEYS.map(|key| {
                    let truth = if key == "black_level_adu" { readout.bias_adu } else { truths[key] };
                    found.get(key).map(|interval| (interval.low..=interval.high).contains(&truth))
                })
            })
            .collect();
        for (place, key) in KEYS.iter().enumerate() {
            let held: Vec<bool> = found.iter().filter_map(|held| held[place]).collect();
            let (n, missed) = (held.len() as f64, held.iter().filter(|held| !**held).count());
            eprintln!("{noise_adu} codes, {key}: {missed} of {n} missed");
            let allowed = n * (1.0 - CONFIDENCE) + 4.0 * (n * CONFIDENCE * (1.0 - CONFIDENCE)).sqrt();
            assert!(missed as f64 <= allowed, "{noise_adu} codes, {key}: {missed} of {n} intervals missed");
        }
    }
}

/// Hot photosites that are full in the longer darks, and as many as are at the largest code there: dark current and its pattern are
/// those of shorter darks, or the reason is that.
#[test]
fn full_hot_photosites_do_not_count_in_dark_current() {
    const OF_DARK: [&str; 2] = ["dark_current_e_per_s", "dcnu"];
    let found: Vec<[Option<bool>; 2]> = (0..40_u32)
        .into_par_iter()
        .map(|index| {
            let plain = camera(index, Kind::Ccd);
            let current = plain.dark_current_e_per_s.unwrap().min(plain.full_well_e / 50.0);
            // Of a hundred hot photosites one has 4.6 times the mean: full after a quarter of a second, or half of one.
            let (share, hot) = (0.02, 0.6 * plain.full_well_e);
            let readout = ReadOut {
                dark_current_e_per_s: Some(current),
                hot_pixel_share: share,
                hot_pixel_dark_current_e_per_s: hot,
                ..plain
            };
            let [flats, mut darks] = levels(&readout, index);
            let full = full_mean(&flats);
            for (place, exposure_s) in (0..).zip([0.003, 0.006, 0.01, 0.05]) {
                let condition = Condition { exposure_s: Some(exposure_s), ..darks[0].condition };
                darks.push(level_in((&readout, index, Shake::default()), condition, 0.0, [4, 500 + 4 * place], full));
            }
            let found = found(&flats, &darks);
            let mean = current + share * hot;
            let variance = (readout.dcnu * mean).powi(2) + share * (2.0 - share) * hot * hot;
            let truths = [mean, variance.sqrt() / mean];
            [0, 1].map(|place| {
                let interval = found.get(OF_DARK[place])?;
                Some((interval.low..=interval.high).contains(&truths[place]))
            })
        })
        .collect();
    for (place, key) in OF_DARK.iter().enumerate() {
        let held: Vec<bool> = found.iter().filter_map(|held| held[place]).collect();
        let (n, missed) = (held.len() as f64, held.iter().filter(|held| !**held).count());
        eprintln!("{key}: {missed} of {n} missed");
        let allowed = n * (1.0 - CONFIDENCE) + 4.0 * (n * CONFIDENCE * (1.0 - CONFIDENCE)).sqrt();
        assert!(n >= 20.0 && missed as f64 <= allowed, "{key}: {missed} of {n} intervals missed");
    }
}

/// Of a camera three photosites that hold the largest code, one value, and code 0 with light and without are named and left out: its
/// patterns are those without them, dead ones empty no report, and their neighbors do not stand out.
#[test]
fn stuck_photosites_are_named_and_left_out() {
    const STUCK: [([usize; 2], f32); 3] = [([20, 10], 4095.0), ([31, 21], 900.0), ([40, 30], 0.0)];
    let shop = Workshop::new();
    for folder in ["whole", "stuck"] {
        std::fs::create_dir(shop.path(folder)).unwrap();
    }
    for level in [0, 500, 2000, 5000, 10_000, 15_000, 20_000, 25_000, 30_000, 35_000] {
        for frame in 1..3 {
            let kind = if level == 0 { "dark" } else { "flat" };
            let name = format!("{kind}-{level}-{frame}.exr");
            shop.pipe(&format!(
                "render-radiance --electrons {level},{level},{level} --size 64x48 --cfa rggb | add-noise --frame {level}{frame} | \
                 digitize -o whole/{name}"
            ));
            let mut taken = shop.frame(&format!("whole/{name}"));
            for ([x, y], code) in STUCK {
                taken.samples[y * 64 + x] = code;
            }
            shop.write(&format!("stuck/{name}"), &taken.header, &taken.samples);
        }
    }
    let channels = |folder: &str| -> serde_json::Value {
        let told = shop.run(&format!("photon-transfer {folder} --output-format json"), &[]);
        serde_json::from_slice::<serde_json::Value>(&told).unwrap()["channels"].clone()
    };
    let [whole, stuck] = ["whole", "stuck"].map(channels);
    let mut places: Vec<[u64; 2]> = Vec::new();
    for (whole, stuck) in whole.as_array().unwrap().iter().zip(stuck.as_array().unwrap()) {
        for key in ["gain_adu_per_e", "prnu", "prnu_pixel", "dsnu_e", "dsnu_pixel_e", "dark_noise_e"] {
            let [own, wanted] = [stuck, whole].map(|channel| channel[key]["value"].as_f64().unwrap());
            assert!((own / wanted - 1.0).abs() < 0.02, "{} {key}: {own} {wanted}", whole["name"]);
        }
        for place in ["light", "dark"] {
            let [own, wanted] = [stuck, whole].map(|channel| channel["defects"][place]["count"].as_f64().unwrap());
            assert!((own - wanted).abs() <= 1.0, "{} {place}: {own} {wanted}", whole["name"]);
        }
        let sites = stuck["defects"]["stuck"]["sites"].as_array().unwrap();
        places.extend(sites.iter().map(|site| ["x", "y"].map(|axis| site[axis].as_u64().unwrap())));
        assert_eq!(whole["defects"]["stuck"]["count"], 0);
    }
    places.sort_unstable();
    assert_eq!(places, STUCK.map(|([x, y], _)| [x as u64, y as u64]));
}
