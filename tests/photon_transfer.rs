//! Cameras whose numbers are known, simulated and measured: each number comes back within its interval as often as is stated.
//!
//! CYANOMETER_CAMERAS=500 measures so many, and tells how often each interval held.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::photon_transfer::{ClassFindings, Condition, KEYS, Level, Settings, of_class, survey};
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::readout::ReadOut;
use cyanometer::chain::{CameraSetup, uniform_frame};
use cyanometer::metadata::Scene;
use cyanometer::numerics::variance_components::Interval;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;
use std::collections::BTreeMap;
use support::misses::{CONFIDENCE, allowed_misses, check_misses, trials};
use support::photon_transfer::{
    Chance, FLAT_S, Kind, QUANTUM_EFFICIENCY, SIZE, Shake, WARM_K, camera, expected_variance, found, level, levels,
    levels_of, measured, saturation, settings, truths,
};

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
        eprintln!(
            "{key}: {missed} of {known} missed, median half-width {width:.2e}, mean error over half-width {:.3}",
            off / f64::from(known)
        );
        assert!(known * 10 >= count * 6, "{key} is known of {known} of {count} cameras alone");
        let allowed = allowed_misses(known as usize);
        assert!(f64::from(missed) <= allowed, "{key}: {missed} of {known} intervals missed");
    }
}

/// A level as it is with another light than is said: its signal so many times as large.
fn relit(flat: &Level, dark: &Level, times: f64) -> Level {
    Level { mean: dark.mean + (flat.mean - dark.mean) * times, ..flat.clone() }
}

/// Of 50 flats a hundredth of saturation apart, and of 10, variances scatter by 2.6 %: saturation lies within its interval as often as is stated.
#[test]
fn saturation_of_many_levels_lies_within_its_interval() {
    const CAMERAS: u32 = 4;
    let draws = u32::try_from(trials(60)).unwrap();
    let cameras: Vec<(ReadOut, [Vec<Level>; 2])> = (0..CAMERAS)
        .into_par_iter()
        .map(|index| {
            let readout = camera(index, Kind::Ccd);
            let levels = levels(&readout, index);
            (readout, levels)
        })
        .collect();
    for count in [10, 50] {
        let held = (0..).zip(&cameras).flat_map(|(index, (readout, [flats, darks])): (u32, _)| {
            let truth = saturation(readout);
            let lit = |place: u32| {
                let signal_e = truth * (0.75 + 0.5 * f64::from(place) / f64::from(count));
                let condition = Condition { photons: Some(signal_e / QUANTUM_EFFICIENCY), ..flats[8].condition };
                let mean = darks[0].mean + readout.adu_per_e * signal_e;
                let variance = readout.adu_per_e.powi(2) * expected_variance(readout, signal_e);
                Level { condition, mean, variance, ..flats[8].clone() }
            };
            let many: Vec<Level> = (0..count).map(lit).collect();
            let held = (0..draws).into_par_iter().map(move |draw| {
                let mut chance = Chance { camera: 1000 * index + draw, drawn: 0 };
                // The sum of 12 uniform numbers is normal enough.
                let mut normal = || (0..12).map(|_| chance.uniform()).sum::<f64>() - 6.0;
                let drawn = |flat: &Level| {
                    let scatter = (2.0 / flat.freedom()).sqrt();
                    let variance = flat.variance * (1.0 + scatter * normal());
                    Level { variance, variance_variance: (variance * scatter).powi(2), ..flat.clone() }
                };
                let flats: Vec<Level> = flats[..8].iter().cloned().chain(many.iter().map(drawn)).collect();
                let found = found(&flats, darks);
                [("saturation_e", truth), ("saturation_photons", truth / QUANTUM_EFFICIENCY)].map(|(key, truth)| {
                    let Interval { low, high, .. } = found.get(key).unwrap();
                    (low..=high).contains(&truth)
                })
            });
            held.collect::<Vec<_>>()
        });
        let held: Vec<[bool; 2]> = held.collect();
        for which in [0, 1] {
            check_misses(&format!("{count} levels"), held.iter().map(|held| Some(held[which])));
        }
    }
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
            let n = known.len();
            let width = widths.get(n / 2).copied().unwrap_or(f64::NAN);
            eprintln!("{name}, {key}: {missed} of {n} missed, median half-width {width:.2e}; {told} of {count} told");
            assert!(2 * n >= count as usize, "{name}: {key} is known of {n} of {count} cameras alone");
            assert!(missed as f64 <= allowed_misses(n), "{name}, {key}: {missed} of {n} intervals missed");
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
    let settings = Settings { confidence: CONFIDENCE, photon_error: 0.0, are_codes: true, top: None, corrected: None };
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

/// A level as a response has it that bends by such a share of a signal of so many codes above the mean of no light.
fn bent(level: &Level, black_adu: f64, share: f64, at_adu: f64) -> Level {
    let signal = level.mean - black_adu;
    let (part, slope) = (1.0 + share * signal / at_adu, 1.0 + 2.0 * share * signal / at_adu);
    Level {
        mean: black_adu + signal * part,
        variance: level.variance * slope.powi(2),
        mean_variance: level.mean_variance * slope.powi(2),
        variance_variance: level.variance_variance * slope.powi(4),
        ..level.clone()
    }
}

/// Darks of up to a third of the range of a camera whose response bends miss their line over time: that is not said to be a black level that moves,
/// and it hides neither that K is off nor how far the response is from a line. Of a camera whose black level
/// moves, or whose light is not known, that is said as before.
#[test]
fn darks_that_a_bending_response_bends_are_no_black_that_moves() {
    let readout = ReadOut {
        bits: 12,
        bias_adu: 100.0,
        adu_per_e: 0.5,
        full_well_e: 6000.0,
        read_noise_e: 5.0,
        dark_current_e_per_s: Some(2000.0),
        ..camera(3, Kind::Ccd)
    };
    let black_adu = readout.bias_adu;
    let at_adu = readout.full_well_e * readout.adu_per_e;
    let own = levels(&readout, 3);
    let has = |told: &[String], words: &str| told.iter().any(|text| text.contains(words));
    for share in [-0.05, -0.03, 0.03, 0.05] {
        let [flats, darks] = own
            .each_ref()
            .map(|levels| -> Vec<Level> { levels.iter().map(|level| bent(level, black_adu, share, at_adu)).collect() });
        let found = found(&flats, &darks);
        assert!(has(&found.doubts, "as the response bends, which it does as much under light"), "{:?}", found.doubts);
        assert!(has(&found.doubts, "than that of little light"), "{:?}", found.doubts);
        assert!(!has(&found.doubts, "black level moves"), "{:?}", found.doubts);
        let [least, largest] = ["linearity_error_min", "linearity_error_max"].map(|key| found.get(key).unwrap());
        assert!(largest.high - least.low < 0.05, "{least:?} {largest:?}");
        // By how much K is off dark current is too.
        let [current, gain] = ["dark_current_e_per_s", "gain_adu_per_e"].map(|key| found.get(key).unwrap());
        let current_e = 2000.0 * readout.adu_per_e / gain.value;
        assert!((current.low..=current.high).contains(&current_e), "{current:?} {gain:?}");
        let unlit = |flat: &Level| Level { condition: Condition { photons: None, ..flat.condition }, ..flat.clone() };
        let of_unknown = self::found(&flats.iter().map(unlit).collect::<Vec<_>>(), &darks);
        assert!(has(&of_unknown.doubts, "or the response bends, which flats of known light would tell"));
    }
    let [flats, mut darks] = own;
    assert!(!has(&found(&flats, &darks).doubts, "bends"));
    darks[2].mean += 4.0;
    let doubts = found(&flats, &darks).doubts;
    assert!(has(&doubts, "black level moves") && !has(&doubts, "bends"), "{doubts:?}");
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
            let settings =
                Settings { confidence: CONFIDENCE, photon_error: 0.0, are_codes: true, top, corrected: None };
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

/// Flats and darks of a camera at such a black level, whose exposure time sets the light, each flat beside darks of its time; of every flat a
/// tenth of the charge is that of the dark.
fn lit_by_time(readout: &ReadOut, index: u32) -> [Vec<Level>; 2] {
    let end = readout.full_well_e;
    let current = readout.dark_current_e_per_s.unwrap();
    let levels = |is_lit: bool| -> Vec<Level> {
        let shares = [0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        (0..)
            .zip(shares)
            .map(|(place, share)| {
                let lit_e = if is_lit { 0.9 * share * end } else { 0.0 };
                let condition = Condition {
                    is_lit,
                    exposure_s: Some(0.1 * share * end / current),
                    photons: is_lit.then_some(lit_e / QUANTUM_EFFICIENCY),
                    temperature_k: None,
                };
                let first = 4 * place + if is_lit { 0 } else { 100 };
                level((readout, index, Shake::default()), condition, lit_e, [4, first])
            })
            .collect()
    };
    [levels(true), levels(false)]
}

/// Cameras of black level 0, where exposure time sets the light and the shortest darks are clipped: these are left out, which is said, and
/// the gain lies within its interval as often as is stated, though a tenth of all charge is that of the dark; so it does where all darks are
/// said to be clipped. No clipped dark is taken for a flat.
#[test]
fn clipped_darks_do_not_change_the_gain() {
    let found: Vec<[Option<bool>; 2]> = (0..40_u32)
        .into_par_iter()
        .map(|index| {
            let plain = camera(index, Kind::Ccd);
            let full_well_e = 20_000.0;
            let readout = ReadOut {
                bits: 14,
                bias_adu: 0.0,
                adu_per_e: 0.5,
                full_well_e,
                read_noise_e: 8.0,
                dark_current_e_per_s: Some(500.0),
                ..plain
            };
            let [flats, darks] = lit_by_time(&readout, index);
            let of_others = found(&flats, &darks);
            assert!(of_others.notes.iter().any(|note| note.contains("clipped at code 0 and left out")), "{index}");
            assert!(!of_others.suspects.iter().any(|suspect| suspect.problem.contains("are they flats")), "{index}");
            let clipped: Vec<Level> = darks.iter().map(|dark| Level { at_ends: [0.0, 0.3], ..dark.clone() }).collect();
            let of_none = found(&flats, &clipped);
            assert!(of_none.get("dark_current_e_per_s").is_none(), "{index}");
            [of_others, of_none].map(|found| {
                let gain = found.get("gain_adu_per_e")?;
                // By a tenth it was too large.
                assert!((gain.value / readout.adu_per_e - 1.0).abs() < 0.04, "{index}: {gain:?}");
                Some((gain.low..=gain.high).contains(&readout.adu_per_e))
            })
        })
        .collect();
    for (place, which) in ["others", "none"].into_iter().enumerate() {
        check_misses(which, found.iter().map(|held| held[place]));
    }
}

/// Where all darks are clipped, black is not their mean. Of flats of one exposure time, whose black may lie far below that, the responsivity is
/// the same within its interval, which holds as often as is stated; there is no PRNU. Of flats of several times, above unknown dark charges, there is
/// no responsivity either.
#[test]
fn clipped_darks_are_not_black() {
    const BELOW_ADU: f64 = 200.0;
    let held: Vec<Option<bool>> = (0..20_u32)
        .into_par_iter()
        .map(|index| {
            let readout = camera(index, Kind::Ccd);
            let [flats, darks] = levels(&readout, index);
            let clipped = [Level { at_ends: [0.0, 0.3], ..darks[0].clone() }];
            let lowered: Vec<Level> =
                flats.iter().map(|flat| Level { mean: flat.mean - BELOW_ADU, ..flat.clone() }).collect();
            let [own, low] = [&flats, &lowered].map(|flats| found(flats, &clipped));
            for key in ["prnu", "prnu_pixel", "prnu_row", "prnu_column"] {
                assert!(why(&low, key).contains("clipped at code 0"), "{index}: {key}");
            }
            let [own, low] = [own, low].map(|found| found.get("responsivity_adu_per_photon").unwrap());
            // Which levels count, and their weights, go by the signal: within the interval they differ.
            assert!((own.value - low.value).abs() < 0.5 * (low.high - low.low), "{index}: {own:?} {low:?}");
            let truths: BTreeMap<&str, f64> = truths(&readout, index).into_iter().collect();
            Some((low.low..=low.high).contains(&truths["responsivity_adu_per_photon"]))
        })
        .collect();
    check_misses("responsivity", held);
    let readout = ReadOut { full_well_e: 20_000.0, ..camera(3, Kind::Ccd) };
    let [flats, darks] = lit_by_time(&readout, 3);
    let clipped: Vec<Level> = darks.iter().map(|dark| Level { at_ends: [0.0, 0.3], ..dark.clone() }).collect();
    let found = found(&flats, &clipped);
    for key in ["responsivity_adu_per_photon", "quantum_efficiency"] {
        assert!(why(&found, key).contains("clipped at code 0"), "{key}");
    }
}

/// Black levels that rise, or fall, evenly by 1 ADU over all frames, while darks are taken in the order of their times: what of that looks like
/// dark current is within its interval, as often as is stated, and it is told of.
#[test]
fn a_black_level_that_drifts_is_no_dark_current() {
    /// Frames of [`levels_of`].
    const FRAMES: f64 = 56.0;
    let held: Vec<Option<bool>> = (0..20_u32)
        .into_par_iter()
        .map(|index| {
            // Noise of 0.6 codes, which means of few frames of few photosites leave less of than of the drift.
            let readout = ReadOut {
                bits: 14,
                adu_per_e: 0.5,
                full_well_e: 20_000.0,
                read_noise_e: 1.2,
                dark_current_e_per_s: Some(4.0),
                ..camera(index, Kind::Ccd)
            };
            let drift_adu = if index % 2 == 0 { 1.0 } else { -1.0 } / FRAMES;
            let [flats, darks, _] = levels_of((&readout, index, Shake { drift_adu, ..Shake::default() }));
            let found = found(&flats, &darks);
            let mut told = found.doubts.iter().chain(&found.notes);
            assert!(
                told.any(|told| told.contains("drift from frame to frame") || told.contains("the black level moves")),
                "{index}: {:?} {:?}",
                found.doubts,
                found.notes
            );
            let current = found.get("dark_current_e_per_s")?;
            Some((current.low..=current.high).contains(&readout.dark_current_e_per_s.unwrap()))
        })
        .collect();
    check_misses("dark_current_e_per_s", held);
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
            &Settings { confidence: CONFIDENCE, photon_error, are_codes: true, top: None, corrected: None },
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
    let missed = (0..COUNT).into_par_iter().filter(|&index| {
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
/// between two codes, and neither a black level that moves nor a response that bends is told of.
#[test]
fn what_rounding_hides_of_quiet_darks_is_within_intervals() {
    const KEYS: [&str; 5] =
        ["black_level_adu", "dark_current_e_per_s", "gain_adu_per_e", "dark_noise_e", "quantum_efficiency"];
    for noise_adu in [0.1, 0.2, 0.3, 0.4, 0.5] {
        let found: Vec<[Option<bool>; 5]> = (0..u32::try_from(trials(60)).unwrap())
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
            check_misses(&format!("{noise_adu} codes, {key}"), found.iter().map(|held| held[place]));
        }
    }
}
