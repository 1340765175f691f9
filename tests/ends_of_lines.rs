//! Rows and columns that share noise beside full well and the ends of the codes, where some of them are cut off more than others: how samples
//! scatter there, behind one amplifier and behind two.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support::chain::{averaged, demosaicked, digitized, noisy, plane_of, settings, with_readout};
use crate::support::cmos::{cmos, quiet_lines, scene};
use cyanometer::analysis::statistics::{
    Laws, OverFrames, OverFramesSettings, Region, Saturated, measure, measure_among, patches,
};
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::metadata::Scene;
use cyanometer::numerics::averages::Combine;
use cyanometer::propagation::Equations;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;
use std::sync::Mutex;

const SIZE: [usize; 2] = [60, 44];

/// A sensor of rows and columns as noisy as its photosites, and such a change of it; the top code stands for 39 707 e⁻, above full well or below it.
fn lit(light_e: f32, taps: Option<Taps>, full_well_e: f64, bias_adu: f64) -> MemoryFrame {
    let mut frame = scene(SIZE, [light_e, light_e - 150.0, light_e - 300.0].map(|e| e.max(0.0)));
    with_readout(&mut frame, |readout| {
        cmos(readout);
        (readout.full_well_e, readout.bias_adu, readout.taps) = (full_well_e, bias_adu, taps.clone());
    });
    frame
}

/// z of variances of the frames of so many seeds and of a part of them, at each stage; the laws of frames that differ in seeds are the same.
fn deviates(seeds: u64, made: impl Fn(u64) -> Vec<MemoryFrame> + Sync) -> Vec<Vec<f64>> {
    let part = Region { x: 5, y: 4, width: 41, height: 33 };
    let whole = Region { x: 0, y: 0, width: SIZE[0], height: SIZE[1] };
    let laws: Mutex<Vec<Vec<Laws>>> = Mutex::default();
    let of = |seed: u64| -> Vec<Vec<f64>> {
        let mut frames = made(seed + 40_000);
        for noise in frames.iter_mut().filter_map(|frame| frame.header.metadata.noise.as_mut()) {
            noise.sensor_seed = 0;
        }
        let mut known = laws.lock().unwrap().pop().unwrap_or_default();
        known.resize_with(frames.len(), Laws::default);
        let mut found = Vec::new();
        for (frame, laws) in frames.iter().zip(&mut known) {
            let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
            let report =
                measure_among(laws, &mut source, &[whole, part], Saturated::Kept, Equations::Exact, Some(0.5)).unwrap();
            let tests = report.regions.iter().flat_map(|region| &region.tests);
            let variances = tests.filter(|test| format!("{:?}", test.subject) == "Variance");
            found.push(variances.filter_map(|test| test.z).collect());
        }
        laws.lock().unwrap().push(known);
        found
    };
    let all: Vec<Vec<Vec<f64>>> = (0..seeds).into_par_iter().map(of).collect();
    (0..all[0].len()).map(|stage| all.iter().flat_map(|found| found[stage].clone()).collect()).collect()
}

/// The mean square of z is 1, of each stage of some cases together. Of m frames, with up to six of them each of which some go together, and laws
/// that are skewed, it scatters by about √(3/m); where lines were taken to scatter alike it was 1.4 to 3.7 for the most part. Where a bound alone
/// is known there is none.
fn judge(what: &str, stages: &[Vec<f64>], frames: u64) {
    for (stage, z) in stages.iter().enumerate() {
        let square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
        eprintln!("{what}, {stage}: mean square of {} deviates {square:.3}", z.len());
        assert!((square - 1.0).abs() < 4.0 * (3.0 / frames as f64).sqrt(), "{what}, {stage}: {square} of {}", z.len());
    }
}

/// The deviates of a case beside those of others, by stage.
fn add(all: &mut Vec<Vec<f64>>, found: Vec<Vec<f64>>) {
    all.resize_with(found.len(), Vec::new);
    all.iter_mut().zip(found).for_each(|(all, found)| all.extend(found));
}

fn pixels(noisy: MemoryFrame) -> Vec<MemoryFrame> {
    let plane = plane_of(&digitized(&noisy));
    let cameras = [Method::Bilinear, Method::EffectiveColor].map(|method| demosaicked(&plane, method));
    [plane].into_iter().chain(cameras).collect()
}

const SEEDS: u64 = 120;

const LEVELS_E: [f32; 5] = [38_900.0, 39_300.0, 39_500.0, 39_650.0, 39_800.0];

/// From where few are cut off to where half of a class are, of codes, BI and ECI.
#[test]
fn variances_scatter_as_predicted_beside_the_top_code() {
    let turns = Taps { layout: TapLayout::Columns, gain: vec![1.0, 1.03], offset_e: vec![], read_noise_e: vec![] };
    for taps in [None, Some(turns)] {
        let mut all = Vec::new();
        for light_e in LEVELS_E {
            let scene = lit(light_e, taps.clone(), 60_000.0, 500.0);
            add(&mut all, deviates(SEEDS, |seed| pixels(noisy(&scene, &settings(seed)))));
        }
        let what = format!("{} taps", taps.as_ref().map_or(1, Taps::count));
        judge(&what, &all, SEEDS * LEVELS_E.len() as u64);
    }
}

/// Beside full well, before the converter and behind it, and beside code 0.
#[test]
fn variances_scatter_as_predicted_beside_full_well_and_the_lowest_code() {
    let before = |noisy: MemoryFrame| {
        vec![noisy.clone(), digitized(&noisy), demosaicked(&plane_of(&digitized(&noisy)), Method::Bilinear)]
    };
    let mut full = Vec::new();
    for light_e in [29_700.0, 29_900.0] {
        let scene = lit(light_e, None, 30_000.0, 500.0);
        add(&mut full, deviates(SEEDS, |seed| before(noisy(&scene, &settings(seed)))));
    }
    judge("full well", &full, 2 * SEEDS);
    let dark = lit(0.0, None, 30_000.0, 2.0);
    judge("code 0", &deviates(SEEDS, |seed| before(noisy(&dark, &settings(seed)))), SEEDS);
}

/// Lines that differ by twice as much.
fn with_wide_lines(mut frame: MemoryFrame) -> MemoryFrame {
    with_readout(&mut frame, |readout| (readout.prnu_row, readout.prnu_column) = (0.004, 0.008));
    frame
}

/// Planes of so many exposures of one sensor.
fn exposures(scene: &MemoryFrame, seed: u64, frames: u32) -> Vec<MemoryFrame> {
    let of = |frame| plane_of(&digitized(&noisy(scene, &NoiseSettings { frame, ..settings(seed) })));
    (0..frames).map(of).collect()
}

/// Averages of exposures, and pixels that are made of these: fixed patterns alone bend as in one exposure. Taken to scatter alike, lines
/// left mean squares of 1.5 to 2.
#[test]
fn variances_of_averages_scatter_as_predicted() {
    const SEEDS: u64 = 200;
    let made = |scene: &MemoryFrame, seed: u64| {
        let plane = averaged(&exposures(scene, seed, 3), Combine::Mean);
        let camera = demosaicked(&plane, Method::Bilinear);
        vec![plane, camera]
    };
    let mut all = Vec::new();
    for scene in [lit(39_700.0, None, 60_000.0, 500.0), lit(29_900.0, None, 30_000.0, 500.0)].map(with_wide_lines) {
        add(&mut all, deviates(SEEDS, |seed| made(&scene, seed)));
    }
    judge("averages", &all, 2 * SEEDS);
}

/// Smooth hue transition, by its weights about the hues.
#[test]
fn variances_by_smooth_hue_transition_scatter_as_predicted() {
    const SEEDS: u64 = 200;
    let mut all = Vec::new();
    for scene in [lit(39_500.0, None, 60_000.0, 500.0), lit(29_800.0, None, 30_000.0, 500.0)].map(with_wide_lines) {
        let made =
            |seed: u64| vec![demosaicked(&plane_of(&digitized(&noisy(&scene, &settings(seed)))), Method::SmoothHue)];
        add(&mut all, deviates(SEEDS, made));
    }
    judge("smooth hue transition", &all, 2 * SEEDS);
}

/// Variances of the means over two exposures, of lines that are drawn anew in each.
#[test]
fn variances_of_means_over_frames_scatter_as_predicted() {
    const SEEDS: u64 = 300;
    let mut scene = lit(39_550.0, None, 60_000.0, 500.0);
    with_readout(&mut scene, |readout| {
        quiet_lines(readout);
        (readout.row_noise_e, readout.column_noise_e) = (250.0, 200.0);
    });
    let of = |seed: u64| -> Vec<f64> {
        let (regions, saturated, equations) = (Vec::new(), Saturated::Kept, Equations::Exact);
        let mut over = OverFrames::new(OverFramesSettings { regions, saturated, equations, level: Some(0.5) });
        exposures(&scene, seed, 2).into_iter().for_each(|mut frame| over.add(&mut frame).unwrap());
        let (report, _) = over.finish().unwrap();
        let tests = report.regions.iter().flat_map(|region| &region.tests);
        tests.filter(|test| format!("{:?}", test.subject) == "VarianceOfMeans").filter_map(|test| test.z).collect()
    };
    let all: Vec<Vec<f64>> = (0..SEEDS).into_par_iter().map(of).collect();
    judge("over frames", &[all.concat()], SEEDS);
}

/// Patches of a chart, whose level is worked back from means that the top code holds back: by the means as they are, standard deviations were
/// told too large by half to all of their error. They scatter by less than that, since the level goes with them.
#[test]
fn patches_beside_the_top_code_have_the_level_of_their_means() {
    let mut chart = lit(39_650.0, None, 60_000.0, 500.0);
    let whole = chart.header.metadata.scene.clone().unwrap();
    chart.header.metadata.scene = Some(Scene { uniform: false, expected_electrons: None, ..whole });
    let of = |seed: u64| -> Vec<f64> {
        let mut frame = plane_of(&digitized(&noisy(&chart, &settings(seed))));
        let report = patches::measure(&mut frame, Some([15, 22]), Saturated::Kept, Equations::Exact).unwrap();
        let classes = report.regions.iter().flat_map(|region| &region.classes);
        classes.filter_map(|class| class.z_std).collect()
    };
    let all: Vec<Vec<f64>> = (0..12).into_par_iter().map(of).collect();
    let z = all.concat();
    let n = z.len() as f64;
    let [mean, square] = [z.iter().sum::<f64>() / n, z.iter().map(|z| z * z).sum::<f64>() / n];
    eprintln!("{n} patches: mean {mean:.3}, mean square {square:.3}");
    // The patches of a sensor share rows and columns: the mean of each sensor scatters by 0.4 at most.
    assert!(n > 200.0 && mean.abs() < 4.0 * 0.4 / 12_f64.sqrt() && square < 1.3, "{n} {mean} {square}");
}

/// The classes of a plane have the shares that they have: of few classes far apart its variance is far surer than of samples of any class.
#[test]
fn planes_scatter_by_their_classes() {
    const SEEDS: u64 = 200;
    let mut frame = scene(SIZE, [4000.0, 8000.0, 3000.0]);
    with_readout(&mut frame, quiet_lines);
    let of = |seed: u64| -> [f64; 2] {
        let mut plane = plane_of(&digitized(&noisy(&frame, &settings(seed))));
        let whole = Region { x: 0, y: 0, width: SIZE[0], height: SIZE[1] };
        let report = measure(&mut plane, &[whole], Saturated::Kept, Equations::Exact, None).unwrap();
        let channel = &report.regions[0].channels[0];
        [channel.z_mean.unwrap(), channel.z_std.unwrap()]
    };
    let all: Vec<[f64; 2]> = (0..SEEDS).into_par_iter().map(of).collect();
    for i in 0..2 {
        let square = all.iter().map(|z| z[i] * z[i]).sum::<f64>() / SEEDS as f64;
        eprintln!("planes, {i}: {square:.3}");
        assert!((square - 1.0).abs() < 4.0 * (2.0 / SEEDS as f64).sqrt(), "{i}: {square}");
    }
}
