//! Rows and columns that share noise beside full well and the ends of the codes, where some of them are cut off more than others: how samples
//! scatter there, behind one amplifier and behind two.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support::chain::{demosaicked, digitized, noisy, plane_of, settings, with_readout};
use crate::support::cmos::{cmos, scene};
use cyanometer::analysis::statistics::{Laws, Region, Saturated, measure_among};
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::propagation::Equations;
use cyanometer::stages::demosaic::Method;
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
fn deviates(scene: &MemoryFrame, seeds: u64, stages: impl Fn(MemoryFrame) -> Vec<MemoryFrame> + Sync) -> Vec<Vec<f64>> {
    let part = Region { x: 5, y: 4, width: 41, height: 33 };
    let whole = Region { x: 0, y: 0, width: SIZE[0], height: SIZE[1] };
    let laws: Mutex<Vec<Vec<Laws>>> = Mutex::default();
    let of = |seed: u64| -> Vec<Vec<f64>> {
        let mut frames = stages(noisy(scene, &settings(seed + 40_000)));
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
            add(&mut all, deviates(&lit(light_e, taps.clone(), 60_000.0, 500.0), SEEDS, pixels));
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
        add(&mut full, deviates(&lit(light_e, None, 30_000.0, 500.0), SEEDS, before));
    }
    judge("full well", &full, 2 * SEEDS);
    judge("code 0", &deviates(&lit(0.0, None, 30_000.0, 2.0), SEEDS, before), SEEDS);
}
