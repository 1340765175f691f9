//! Exposures of one scene that several amplifiers have read: what scatters from frame to frame and what is the same in all.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support::alarms::judge;
use crate::support::chain::{colored, demosaicked, digitized, less_darks, noisy, plane_of, settings, with_readout};
use crate::support::cmos::{several_taps, tapped, tapped_with_lines};
use crate::support::misses::trials;
use cyanometer::analysis::statistics::{OverFrames, OverFramesSettings, Region, RepeatedReport, Saturated};
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::color::Space;
use cyanometer::error::Result;
use cyanometer::numerics::significance::of_smallest;
use cyanometer::propagation::Equations;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;

const STAGES: [&str; 7] = ["electrons", "ADU", "CFA plane", "less 2 darks", "camera", "XYZ", "less 2 darks, MHC"];

/// Exposures at each stage, which have their dark frames in common.
fn chain(scene: &MemoryFrame, seed: u64, frames: u32, method: Method) -> Vec<Vec<MemoryFrame>> {
    // Dark frames are the first of the seed.
    let taken = |frame: u32| noisy(scene, &NoiseSettings { frame: 10 + frame, ..settings(seed) });
    let electrons: Vec<MemoryFrame> = (0..frames).map(taken).collect();
    let codes: Vec<MemoryFrame> = electrons.iter().map(digitized).collect();
    let planes: Vec<MemoryFrame> = codes.iter().map(plane_of).collect();
    let less: Vec<MemoryFrame> = planes.iter().map(|plane| less_darks(plane, scene, seed, 2)).collect();
    let camera: Vec<MemoryFrame> = planes.iter().map(|plane| demosaicked(plane, method)).collect();
    let xyz = camera.iter().map(|camera| colored(camera, Space::Xyz)).collect();
    let of_less = less.iter().map(|plane| demosaicked(plane, Method::Malvar)).collect();
    vec![electrons, codes, planes, less, camera, xyz, of_less]
}

fn over_frames(frames: &[MemoryFrame], regions: &[Region], level: Option<f64>) -> Result<RepeatedReport> {
    let settings = OverFramesSettings {
        regions: regions.to_vec(),
        saturated: Saturated::Kept,
        equations: Equations::Exact,
        level,
    };
    let mut statistics = OverFrames::new(settings);
    for frame in frames {
        statistics.add(&mut MemoryFrame::new(frame.header.clone(), frame.samples.clone()))?;
    }
    Ok(statistics.finish()?.0)
}

/// Whole frames and regions of several amplifiers of every layout, with rows and columns that share noise and without, at every stage: checks raise
/// false alarms no more often than the level.
#[test]
fn exposures_of_taps_raise_false_alarms_at_the_stated_rate() {
    const FRAMES: u32 = 4;
    let parts = [Region { x: 0, y: 0, width: 22, height: 18 }, Region { x: 3, y: 2, width: 13, height: 14 }];
    let taps = several_taps();
    let methods = [Method::EffectiveColor, Method::Bilinear, Method::Malvar, Method::EffectiveColor, Method::Bilinear];
    let of = |case: u64| -> Vec<[f64; 2]> {
        // Draws hang on seed and place alone: each case has a seed of its own.
        let which = usize::try_from(case % 10).unwrap();
        let scene = if which < 5 { tapped } else { tapped_with_lines };
        let scene = scene([22, 18], [900.0, 2500.0, 1800.0], &taps[which % 5]);
        let stages = chain(&scene, case, FRAMES, methods[which % 5]);
        let of_stage = |frames: &Vec<MemoryFrame>| {
            let regions = over_frames(frames, &parts, Some(0.05)).unwrap().regions;
            [0, 1].map(|part: usize| {
                let tests = &regions[part].tests;
                of_smallest(tests.iter().map(|test| test.p).fold(1.0, f64::min), tests.len())
            })
        };
        stages.iter().map(of_stage).collect()
    };
    let all: Vec<Vec<[f64; 2]>> = (0..10 * trials(60)).into_par_iter().map(of).collect();
    for (stage, name) in STAGES.iter().enumerate() {
        for part in [0, 1] {
            let told: Vec<f64> = all.iter().map(|stages| stages[stage][part]).collect();
            judge(&format!("{name}, {part}"), &told, 0.2);
        }
    }
}

/// An amplifier whose gain, read noise or offset is not what is said, alone of four, is caught at every stage.
#[test]
fn a_tap_that_is_not_as_said_is_caught() {
    type Lie = fn(&mut Taps);
    let lies: [(&str, Lie); 3] = [
        ("gain", |taps| taps.gain[1] *= 1.02),
        ("read noise", |taps| taps.read_noise_e[1] = 20.0),
        ("offset", |taps| taps.offset_e[1] += 30.0),
    ];
    let taps = &several_taps()[4];
    let scene = tapped([64, 48], [300.0, 500.0, 400.0], taps);
    for (stage, frames) in chain(&scene, 5, 8, Method::Bilinear).iter().enumerate() {
        let passed = |frames: &[MemoryFrame]| over_frames(frames, &[], Some(1e-4)).unwrap().check.unwrap().passed;
        assert!(passed(frames), "{}", STAGES[stage]);
        for (what, lie) in lies {
            let mut told = frames.clone();
            for frame in &mut told {
                let adc = frame.header.metadata.adc;
                with_readout(frame, |readout| lie(readout.taps.as_mut().unwrap()));
                frame.header.metadata.adc = adc;
            }
            // Before the converter neither gain nor offset of an amplifier is in the samples.
            let is_there = stage > 0 || what == "read noise";
            // What the same dark frames have is off alike.
            let is_left = what != "offset" || !STAGES[stage].contains("less");
            assert_eq!(passed(&told), !(is_there && is_left), "{}, {what}", STAGES[stage]);
        }
    }
}

/// Of two halves, by hand: what scatters from frame to frame is the mean of what does behind each amplifier, and what is the same in all is the
/// pattern behind each and how far their means lie apart.
#[test]
fn exposures_of_two_halves_have_the_numbers_of_both() {
    let taps = Taps {
        layout: TapLayout::LeftRight,
        gain: vec![1.0, 1.02],
        offset_e: vec![0.0, 8.0],
        read_noise_e: vec![4.0, 12.0],
    };
    let mut scene = tapped([32, 24], [1000.0; 3], &taps);
    with_readout(&mut scene, |readout| {
        *readout = ReadOut {
            dark_current_e_per_s: Some(0.0),
            dcnu: 0.0,
            dsnu_e: 0.0,
            prnu: 0.01,
            adu_per_e: 0.25,
            bits: 14,
            bias_adu: 500.0,
            ..readout.clone()
        };
    });
    let frames: Vec<MemoryFrame> = chain(&scene, 3, 3, Method::Bilinear).swap_remove(2);
    let report = over_frames(&frames, &[], None).unwrap();
    let all = &report.regions[0].channels[0];
    let half = |gain: f64, offset_e: f64, read_noise_e: f64| {
        let slope = 0.25 * gain;
        let mean = 500.0 + slope * (1000.0 + offset_e);
        // Sensitivities multiply what was counted: shot noise is that of 1 + prnu².
        let temporal_e2 = 1000.0 * (1.0 + 0.01 * 0.01) + read_noise_e * read_noise_e;
        (mean, slope * slope * temporal_e2 + 1.0 / 12.0, (slope * 10.0).powi(2))
    };
    let [(m1, t1, f1), (m2, t2, f2)] = [half(1.0, 0.0, 4.0), half(1.02, 8.0, 12.0)];
    let near = |found: Option<f64>, expected: f64, what: &str| {
        let found = found.unwrap();
        assert!((found / expected - 1.0).abs() < 1e-6, "{what}: {found} {expected}");
    };
    let n = 32.0 * 24.0;
    near(all.predicted_mean, f64::midpoint(m1, m2), "mean");
    near(all.predicted_temporal_std, f64::midpoint(t1, t2).sqrt(), "temporal");
    // A sample variance of n photosites has n/(n − 1) of what lies between halves.
    let fixed = f64::midpoint(f1, f2) + ((m2 - m1) / 2.0).powi(2) * n / (n - 1.0);
    near(all.predicted_fixed_std, fixed.sqrt(), "fixed");
    near(all.predicted_std_of_means, (fixed + f64::midpoint(t1, t2) / 3.0).sqrt(), "of means");
    // The left half alone is that of its amplifier.
    let left = over_frames(&frames, &[Region { x: 0, y: 0, width: 16, height: 24 }], None).unwrap();
    near(left.regions[0].channels[0].predicted_temporal_std, t1.sqrt(), "temporal of the left");
    near(left.regions[0].channels[0].predicted_fixed_std, f1.sqrt(), "fixed of the left");
    // Pixels that lie a reach from the other half are made of one alone.
    let camera: Vec<MemoryFrame> = frames.iter().map(|frame| demosaicked(frame, Method::Bilinear)).collect();
    let of = |x: usize| {
        let found = over_frames(&camera, &[Region { x, y: 4, width: 8, height: 16 }], None).unwrap();
        found.regions[0].channels[1].predicted_temporal_std.unwrap()
    };
    assert!((of(20) / of(4) / (t2 / t1).sqrt() - 1.0).abs() < 1e-9, "{} {}", of(4), of(20));
}

/// What is refused, and why: hot pixels, of how far statistics scatter; what is curved; what flat fields divided.
#[test]
fn what_is_not_told_of_exposures_of_taps_says_why() {
    let taps = &several_taps()[0];
    let mut scene = tapped([16, 12], [900.0, 2500.0, 1800.0], taps);
    with_readout(&mut scene, |readout| {
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (0.01, 500.0);
    });
    let planes = chain(&scene, 3, 3, Method::Bilinear).swap_remove(2);
    let why = over_frames(&planes, &[], Some(0.05)).unwrap_err().to_string();
    assert!(why.contains("not predicted of hot pixels"), "{why}");
    let told = over_frames(&planes, &[], None).unwrap();
    assert!(told.regions[0].channels[0].predicted_temporal_std.is_some());
    let plain = tapped([16, 12], [900.0, 2500.0, 1800.0], taps);
    let planes = chain(&plain, 3, 3, Method::Bilinear).swap_remove(2);
    let hues: Vec<MemoryFrame> = planes.iter().map(|plane| demosaicked(plane, Method::SmoothHue)).collect();
    let why = over_frames(&hues, &[], Some(0.05)).unwrap_err().to_string();
    assert!(why.contains("linear in the samples of photosites alone"), "{why}");
}
