//! Sensors that are read by row and column: noise, gains and offsets of these, and what is predicted of them.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

mod support;

use cyanometer::analysis::statistics::{Region, RegionReport, Saturated, measure};
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::CfaPattern;
use cyanometer::color::{Space, White};
use cyanometer::metadata::Scene;
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::propagation::covariance::symmetric;
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::propagation::{Equations, FramePrediction, of_frame};
use cyanometer::random::{Source, of_column, of_row};
use cyanometer::sigma::WithSigma;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::{DarkFrames, LessDarks};
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{MemoryFrame, Stage, run};
use rayon::prelude::*;
use support::{assert_same, at, crop, expected, sensor, through, through_cuts};

/// Sources that only sensors of this kind have.
const OWN: [Source; 7] = [
    Source::RowNoise,
    Source::ColumnNoise,
    Source::Dsnu,
    Source::DsnuRow,
    Source::DsnuColumn,
    Source::PrnuRow,
    Source::PrnuColumn,
];

/// The read-out of a CMOS sensor whose rows and columns are as noisy as its photosites.
fn cmos(readout: &mut ReadOut) {
    readout.dark_current_na_per_cm2 = None;
    readout.dark_current_e_per_s = Some(60.0);
    readout.dcnu = 0.15;
    readout.prnu = 0.006;
    readout.read_noise_e = 6.0;
    readout.row_noise_e = 4.0;
    readout.column_noise_e = 2.0;
    readout.dsnu_e = 5.0;
    readout.dsnu_row_e = 1.5;
    readout.dsnu_column_e = 7.0;
    readout.prnu_row = 0.002;
    readout.prnu_column = 0.004;
    readout.full_well_e = 30_000.0;
    readout.bits = 14;
    readout.bias_adu = 500.0;
    readout.adu_per_e = 0.4;
}

fn with_readout(frame: &mut MemoryFrame, change: impl Fn(&mut ReadOut)) {
    let sensor = frame.header.metadata.sensor.as_mut().unwrap();
    change(sensor.readout.as_mut().unwrap());
    sensor.readout.as_ref().unwrap().check().unwrap();
}

/// The frame of a uniform scene.
fn scene(size: [usize; 2], electrons: [f32; 3]) -> MemoryFrame {
    let mut frame = expected(size[0], size[1], |_, _, class| electrons[class as usize]);
    frame.header.metadata.scene = Some(Scene::uniform("test", electrons.map(f64::from)));
    with_readout(&mut frame, cmos);
    frame
}

fn settings(seed: u64) -> NoiseSettings {
    NoiseSettings { seed, sensor_seed: seed, ..Default::default() }
}

fn noisy(scene: &MemoryFrame, settings: &NoiseSettings) -> MemoryFrame {
    through(scene, &AddNoise::new(&scene.header, settings).unwrap())
}

fn digitized(frame: &MemoryFrame) -> MemoryFrame {
    through(frame, &Digitize::new(&frame.header, &AdcSettings::default()).unwrap())
}

fn plane_of(codes: &MemoryFrame) -> MemoryFrame {
    through(codes, &Mosaic::new(&codes.header, None).unwrap())
}

fn demosaicked(plane: &MemoryFrame, method: Method) -> MemoryFrame {
    through(plane, &Demosaic::new(&plane.header, method, Black::Auto, None).unwrap())
}

fn color_settings(space: Space) -> ColorSettings {
    ColorSettings {
        is_relative: false,
        xyz_from_camera: sensor().xyz_from_camera.unwrap(),
        method: None,
        residual: None,
        space,
        white: White::D65,
        white_luminance: None,
    }
}

fn colored(camera: &MemoryFrame, space: Space) -> MemoryFrame {
    through(camera, &ToXyz::new(&camera.header, &color_settings(space)).unwrap())
}

fn regions(frame: &MemoryFrame, regions: &[Region]) -> Vec<RegionReport> {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    measure(&mut source, regions, Saturated::Kept, Equations::Exact, Some(0.5)).unwrap().regions
}

fn corrected(region: &RegionReport) -> f64 {
    let smallest = region.tests.iter().map(|test| test.p).fold(1.0, f64::min);
    of_smallest(smallest, region.tests.len())
}

// --- what is drawn ---------------------------------------------------------------------------------------------------

/// Each source alone, from its documented draws: row and column noise, offsets, gains.
#[test]
fn rows_and_columns_have_their_own_draws() {
    let level = 1000.0_f32;
    let mut light = scene([40, 30], [level; 3]);
    light.header.geometry.origin = [-7, 300];
    let take = |kept: Source| {
        let without = Source::ALL.into_iter().filter(|source| *source != kept).collect();
        noisy(&light, &NoiseSettings { seed: 5, sensor_seed: 6, frame: 9, without, ..Default::default() })
    };
    let none = noisy(&light, &NoiseSettings { without: Source::ALL.to_vec(), ..Default::default() });
    for source in OWN.into_iter().filter(|source| *source != Source::Dsnu) {
        let frame = take(source);
        assert_eq!(frame.header.metadata.noise.as_ref().unwrap().sources, [source]);
        for (y, x, channel) in (0..30).flat_map(|y| (0..40).flat_map(move |x| (0..3).map(move |c| (y, x, c)))) {
            let row = of_row([5, 6], 9, 300 + i32::try_from(y).unwrap());
            let column = of_column([5, 6], 9, i32::try_from(x).unwrap() - 7);
            let off = match source {
                Source::RowNoise => 4.0 * row.temporal,
                Source::ColumnNoise => 2.0 * column.temporal,
                Source::DsnuRow => 1.5 * row.offset,
                Source::DsnuColumn => 7.0 * column.offset,
                Source::PrnuRow => f64::from(level) * 0.002 * row.response,
                _ => f64::from(level) * 0.004 * column.response,
            };
            let found = f64::from(at(&frame, x, y, channel)) - f64::from(at(&none, x, y, channel));
            // Single precision at 1000 e⁻.
            assert!((found - off).abs() < 3e-4, "{source:?} {x} {y}: {found} {off}");
        }
    }
    let offsets = take(Source::Dsnu);
    let found: Vec<f64> = offsets.samples.iter().zip(&none.samples).map(|(a, b)| f64::from(a - b)).collect();
    let square = found.iter().map(|offset| offset * offset).sum::<f64>() / 25.0;
    assert!(of_chi_square(square, found.len() as f64) > 1e-4);
    assert_same(
        &offsets,
        &noisy(
            &light,
            &NoiseSettings {
                seed: 50,
                sensor_seed: 6,
                frame: 1,
                without: Source::ALL.into_iter().filter(|source| *source != Source::Dsnu).collect(),
                ..Default::default()
            },
        ),
        "offsets are fixed",
    );
}

/// The mosaic commutes with noise and converter to the bit, a crop of the noisy frame is the noise of the crop, and neither
/// bands, threads nor instructions change a bit.
#[test]
fn draws_belong_to_places() {
    let light = scene([530, 37], [900.0, 2000.0, 1500.0]);
    let settings = NoiseSettings { seed: 3, sensor_seed: 4, frame: 7, ..Default::default() };
    let stage = AddNoise::new(&light.header, &settings).unwrap();
    let whole = through(&light, &stage);
    for pattern in CfaPattern::ALL.iter().copied() {
        let plane = through(&light, &Mosaic::new(&light.header, Some(pattern)).unwrap());
        let first = noisy(&plane, &settings);
        let last = through(&whole, &Mosaic::new(&whole.header, Some(pattern)).unwrap());
        assert_same(&first, &last, "mosaic and noise");
    }
    for [x, y, width, height] in [[0, 0, 530, 37], [3, 5, 300, 20], [129, 1, 70, 36], [513, 30, 17, 7], [64, 0, 1, 1]] {
        let part = noisy(&crop(&light, x, y, width, height), &settings);
        assert_same(&part, &crop(&whole, x, y, width, height), "crop");
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_same(&pool.install(|| through(&light, &stage)), &whole, "threads");
    }
    assert_same(&through_cuts(&light, &stage, &[1, 5, 17]).0, &whole, "bands");
    for instructions in [Instructions::widest(), Instructions::up_to_256_bits()] {
        assert_same(&through(&light, &stage.clone().on(instructions)), &whole, "instructions");
    }
    // With perfect charge transfer the same charge meets the same read-out.
    let transferred = noisy(&light, &NoiseSettings { cte: Some(1.0), ..settings });
    for (a, b) in transferred.samples.iter().zip(&whole.samples) {
        assert!((a - b).abs() <= 4.0 * f32::EPSILON * b.abs(), "{a} {b}");
    }
}

/// Without the keys nothing of them is in the metadata.
#[test]
fn sensors_without_them_say_nothing_of_them() {
    let mut frame = expected(4, 4, |_, _, _| 100.0);
    frame.header.metadata.scene = Some(Scene::uniform("test", [100.0; 3]));
    let made = noisy(&frame, &settings(1));
    let text = serde_yaml::to_string(&made.header.metadata).unwrap();
    for word in ["row_noise", "column_noise", "dsnu", "prnu_row", "prnu_column"] {
        assert!(!text.contains(word), "{word}");
    }
}

// --- what is predicted -----------------------------------------------------------------------------------------------

const SEEDS: u64 = 400;

/// Fails when alarms come more often than the level, or more seldom than `share` of it; bounds as in tests/checks.rs, 3.9 standard
/// deviations.
fn judge(what: &str, corrected: &[f64], share: f64) {
    let n = corrected.len() as f64;
    for level in [0.05, 0.01] {
        let alarms = corrected.iter().filter(|p| **p < level).count() as f64;
        let bound = 3.9 * (n * level * (1.0 - level)).sqrt();
        eprintln!("{what}: {alarms} alarms in {n} at level {level}, expected {}", n * level);
        assert!(alarms <= n * level + bound, "{what}: {alarms} alarms of {n} at {level}");
        assert!(alarms >= share * n * level - bound, "{what}: only {alarms} alarms of {n} at {level}");
    }
}

fn coverage(scene: &MemoryFrame, what: &str, share: f64) {
    let names =
        ["electrons", "ADU", "CFA plane", "less 3 darks", "BI", "SHTI", "ECI", "MHC", "darks, ECI", "XYZ", "L*a*b*"];
    let trials: Vec<Vec<f64>> = (0..SEEDS)
        .into_par_iter()
        .map(|seed| {
            let electrons = noisy(scene, &settings(seed));
            let codes = digitized(&electrons);
            let plane = plane_of(&codes);
            let less = less_darks(&plane, scene, seed, 3);
            let cameras = [Method::Bilinear, Method::SmoothHue, Method::EffectiveColor, Method::Malvar]
                .map(|method| demosaicked(&plane, method));
            let of_less = demosaicked(&less, Method::EffectiveColor);
            let [xyz, lab] = [Space::Xyz, Space::Lab].map(|space| colored(&cameras[2], space));
            let frames = [electrons, codes, plane, less].into_iter().chain(cameras).chain([of_less, xyz, lab]);
            frames.map(|frame| corrected(&regions(&frame, &[])[0])).collect()
        })
        .collect();
    for (index, name) in names.iter().enumerate() {
        let corrected: Vec<f64> = trials.iter().map(|trial| trial[index]).collect();
        judge(&format!("{what}, {name}"), &corrected, share);
    }
}

/// A plane less the mean of so many dark frames of the same sensor.
fn less_darks(plane: &MemoryFrame, light: &MemoryFrame, seed: u64, frames: u32) -> MemoryFrame {
    let mut dark = light.clone();
    dark.samples.fill(0.0);
    dark.header.metadata.scene = Some(Scene::uniform("test", [0.0; 3]));
    let taken = |frame| plane_of(&digitized(&noisy(&dark, &NoiseSettings { frame, ..settings(seed) })));
    let mut darks = DarkFrames::of((1..=frames).map(taken).collect()).unwrap().unwrap();
    let settings = CorrectionSettings { black: Black::None, cte: None };
    let stage = CorrectFrame::new(&plane.header, &settings, Some(darks.stack())).unwrap();
    let mut source = MemoryFrame::new(plane.header.clone(), plane.samples.clone());
    let mut corrected = MemoryFrame::new(stage.header().clone(), Vec::new());
    run(&stage, &mut LessDarks::new(&mut source, &mut darks), &mut corrected, &mut |_| ()).unwrap();
    MemoryFrame::new(corrected.header, corrected.samples)
}

/// Whole small frames of one exposure at every stage, each seed another sensor.
#[test]
fn frames_raise_false_alarms_at_the_stated_rate() {
    // What rows share makes channels alarm together, which makes alarms rarer than independent tests would.
    coverage(&scene([24, 18], [900.0, 2500.0, 1800.0]), "lit", 0.6);
    coverage(&scene([25, 17], [9000.0, 14_000.0, 11_000.0]), "bright", 0.6);
}

/// The mean of a patch scatters from frame to frame as predicted, and pixels as `--sigma` says: 2000 frames, each of another
/// sensor. Variances of 2000 have χ² of 1999 degrees of freedom.
#[test]
fn patch_means_scatter_as_predicted() {
    let scene = scene([26, 24], [900.0, 2500.0, 1800.0]);
    let whole = Region { x: 0, y: 0, width: 26, height: 24 };
    let patches = [[1, 1], [3, 2], [7, 5], [16, 16]];
    let mut patches: Vec<Region> =
        patches.into_iter().map(|[width, height]| Region { x: 4, y: 5, width, height }).collect();
    patches.push(whole);
    let of = |frame: &MemoryFrame| -> Vec<f64> {
        let mean = |patch: &Region, channel: usize| {
            let rows = patch.y..patch.y + patch.height;
            let sites = rows.flat_map(|y| (patch.x..patch.x + patch.width).map(move |x| (x, y)));
            let sum: f64 = sites.map(|(x, y)| f64::from(at(frame, x, y, channel))).sum();
            sum / (patch.width * patch.height) as f64
        };
        patches.iter().flat_map(|patch| (0..3).map(|channel| mean(patch, channel)).collect::<Vec<_>>()).collect()
    };
    let frames = |seed: u64| {
        let electrons = noisy(&scene, &settings(seed + 10_000));
        let codes = digitized(&electrons);
        let plane = plane_of(&codes);
        let mut made = vec![electrons, codes];
        made.extend(Method::ALL.map(|method| demosaicked(&plane, method)));
        made.push(demosaicked(&less_darks(&plane, &scene, seed + 10_000, 2), Method::EffectiveColor));
        made.push(colored(&made[4], Space::Xyz));
        made
    };
    let seeds: u64 = 2000;
    let all: Vec<Vec<Vec<f64>>> =
        (0..seeds).into_par_iter().map(|seed| frames(seed).iter().map(of).collect()).collect();
    let mut smallest = 1.0_f64;
    let mut tests = 0;
    for (stage, frame) in frames(0).iter().enumerate() {
        let reports = regions(frame, &patches);
        let predicted: Vec<f64> = reports.into_iter().flat_map(|region| region.patch_mean_std.unwrap()).collect();
        for (index, predicted) in predicted.iter().enumerate() {
            let values: Vec<f64> = all.iter().map(|frames| frames[stage][index]).collect();
            let mean = values.iter().sum::<f64>() / seeds as f64;
            let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            let p = of_chi_square(square / predicted.powi(2), seeds as f64 - 1.0);
            let ratio = (square / (seeds as f64 - 1.0)).sqrt() / predicted;
            assert!(p > 1e-6, "stage {stage}, {:?}, channel {}: {ratio}", patches[index / 3], index % 3);
            smallest = smallest.min(p);
            tests += 1;
        }
    }
    assert!(of_smallest(smallest, tests) > 1e-4, "{smallest} of {tests}");
}

/// The standard deviations beside pixels are those that a uniform scene is predicted to have at each phase.
#[test]
fn sigma_beside_pixels_is_the_prediction() {
    let mut scene = scene([40, 30], [900.0, 2500.0, 1800.0]);
    // So little noise that pixels are at their means.
    let mut quiet = noisy(&scene, &NoiseSettings { without: Source::ALL.to_vec(), ..Default::default() });
    quiet.header = noisy(&scene, &settings(3)).header;
    scene.samples.clear();
    let plane = plane_of(&digitized(&quiet));
    for method in [Method::Bilinear, Method::EffectiveColor, Method::Malvar] {
        let camera = demosaicked(&plane, method);
        let Ok(FramePrediction::Pixels(pixels)) = of_frame(&camera.header, Equations::Exact) else { panic!() };
        let noise = PixelNoise::of(&camera.header).unwrap();
        for ([x, y], phase) in [([20, 14], 0), ([21, 14], 1), ([20, 15], 2), ([21, 15], 3)] {
            let rgb = [0, 1, 2].map(|channel| f64::from(at(&camera, x, y, channel)));
            let found = symmetric(&noise.covariance([x, y], rgb).0);
            let expected = pixels.phase_covariances()[phase];
            // Levels are rounded to codes, half a code in 360: 1.4 parts in a thousand of shot noise.
            assert!((found - expected).abs().max() < 3e-3 * expected.max(), "{method:?} {phase}: {found} {expected}");
        }
        let stage = Demosaic::new(&plane.header, method, Black::Auto, None).unwrap();
        assert!(WithSigma::of_demosaicking(stage).is_ok());
    }
}

/// A prediction that takes the photosites of a row for independent is caught.
#[test]
fn what_rows_share_is_not_left_out() {
    let scene = scene([60, 40], [900.0, 2500.0, 1800.0]);
    let plane = plane_of(&digitized(&noisy(&scene, &settings(2))));
    let camera = demosaicked(&plane, Method::Bilinear);
    let mut independent = camera.clone();
    with_readout(&mut independent, |readout| {
        let added = [readout.row_noise_e, readout.column_noise_e, readout.dsnu_row_e, readout.dsnu_column_e];
        readout.read_noise_e = added.iter().fold(readout.read_noise_e, |sum, part| sum.hypot(*part));
        readout.prnu = readout.prnu.hypot(readout.prnu_row).hypot(readout.prnu_column);
        (readout.row_noise_e, readout.column_noise_e, readout.dsnu_row_e, readout.dsnu_column_e) = (0.0, 0.0, 0.0, 0.0);
        (readout.prnu_row, readout.prnu_column) = (0.0, 0.0);
    });
    let std = |frame: &MemoryFrame| regions(frame, &[])[0].patch_mean_std.clone().unwrap();
    for (shared, alone) in std(&camera).into_iter().zip(std(&independent)) {
        // 40 rows and 60 columns instead of 2400 pixels.
        assert!(shared > 1.5 * alone, "{shared} {alone}");
    }
}
