//! Sensors that are read by row and column: noise, gains and offsets of these, and what is predicted of them.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Laws, Region, RegionReport, Saturated, measure};
use cyanometer::camera::linearity::Linearization;
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::cfa::CfaPattern;
use cyanometer::chain::{CameraSetup, Predictor, PredictorSettings};
use cyanometer::color::{Space, White};
use cyanometer::metadata::Scene;
use cyanometer::names::Named;
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::propagation::covariance::{PAIRS, symmetric};
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::propagation::{Equations, FramePrediction, TappedPixels, of_frame};
use cyanometer::random::{Source, of_column, of_knot, of_row};
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
use support::alarms::{judge, over_seeds, regions_among};
use support::misses::trials;
use support::{assert_same, at, crop, expected, sensor, through, through_cuts};

/// Sources that only sensors of this kind have.
const OWN: [Source; 8] = [
    Source::RowNoise,
    Source::ColumnNoise,
    Source::Dsnu,
    Source::DsnuRow,
    Source::DsnuColumn,
    Source::PrnuRow,
    Source::PrnuColumn,
    Source::BlackDrift,
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
    regions_among(&mut Laws::default(), frame, regions, Equations::Exact)
}

// --- what is drawn ---------------------------------------------------------------------------------------------------

/// Each source alone, from its documented draws: row and column noise, offsets, gains.
#[test]
fn rows_and_columns_have_their_own_draws() {
    let level = 1000.0_f32;
    let mut light = scene([40, 30], [level; 3]);
    light.header.geometry.origin = [-7, 300];
    let per_row = 6.5;
    with_readout(&mut light, |readout| (readout.black_drift_e, readout.black_drift_rows) = (3.0, per_row));
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
                Source::BlackDrift => {
                    let place = f64::from(300 + u32::try_from(y).unwrap()) / per_row;
                    #[allow(clippy::cast_possible_truncation, reason = "some hundreds")]
                    let (knot, angle) = (place.floor() as i32, std::f64::consts::FRAC_PI_2 * place.fract());
                    3.0 * (angle.cos() * of_knot(5, 9, knot) + angle.sin() * of_knot(5, 9, knot + 1))
                }
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
    for word in ["row_noise", "column_noise", "dsnu", "prnu_row", "prnu_column", "black_drift", "taps"] {
        assert!(!text.contains(word), "{word}");
    }
}

// --- what is predicted -----------------------------------------------------------------------------------------------

/// Seeds of which a third is tried, or all.
const SEEDS: u64 = 900;

fn coverage(scene: &MemoryFrame, what: &str, share: f64) {
    let names =
        ["electrons", "ADU", "CFA plane", "less 3 darks", "BI", "SHTI", "ECI", "MHC", "darks, ECI", "XYZ", "L*a*b*"];
    let made = |seed: u64| {
        let electrons = noisy(scene, &settings(seed));
        let codes = digitized(&electrons);
        let plane = plane_of(&codes);
        let less = less_darks(&plane, scene, seed, 3);
        let cameras = [Method::Bilinear, Method::SmoothHue, Method::EffectiveColor, Method::Malvar]
            .map(|method| demosaicked(&plane, method));
        let of_less = demosaicked(&less, Method::EffectiveColor);
        let [xyz, lab] = [Space::Xyz, Space::Lab].map(|space| colored(&cameras[2], space));
        [electrons, codes, plane, less].into_iter().chain(cameras).chain([of_less, xyz, lab]).collect()
    };
    for (name, corrected) in names.iter().zip(over_seeds(SEEDS, &[], made)) {
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

/// The mean of a patch scatters from frame to frame as predicted, and pixels as `--sigma` says: n frames, each of another
/// sensor. Variances of n have χ² of n − 1 degrees of freedom.
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
    let seeds = trials(2000);
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

// --- amplifiers and drift --------------------------------------------------------------------------------------------

/// Layouts with numbers of taps that differ in everything.
fn several_taps() -> [Taps; 5] {
    let of = |layout, count: usize| Taps {
        layout,
        gain: vec![1.0, 1.02, 0.97, 1.05][..count].to_vec(),
        offset_e: vec![3.0, -20.0, 11.0, 0.0][..count].to_vec(),
        read_noise_e: vec![4.0, 9.0, 14.0, 2.0][..count].to_vec(),
    };
    [
        of(TapLayout::Columns, 2),
        of(TapLayout::Columns, 3),
        of(TapLayout::LeftRight, 2),
        of(TapLayout::TopBottom, 2),
        of(TapLayout::Quadrants, 4),
    ]
}

/// The frame of a uniform scene of a sensor that is read through taps, whose middle is that of the frame.
fn tapped(size: [usize; 2], electrons: [f32; 3], taps: &Taps) -> MemoryFrame {
    let mut frame = scene(size, electrons);
    with_readout(&mut frame, |readout| {
        quiet_lines(readout);
        readout.dsnu_e = 5.0;
        (readout.width, readout.height) = (u32::try_from(size[0]).unwrap(), u32::try_from(size[1]).unwrap());
        readout.taps = Some(taps.clone());
    });
    frame
}

/// The same of a sensor whose rows and columns are as noisy as its photosites.
fn tapped_with_lines(size: [usize; 2], electrons: [f32; 3], taps: &Taps) -> MemoryFrame {
    let mut frame = tapped(size, electrons, taps);
    with_readout(&mut frame, |readout| {
        let taps = readout.taps.take();
        cmos(readout);
        readout.taps = taps;
    });
    frame
}

/// Without what rows and columns share.
fn quiet_lines(readout: &mut ReadOut) {
    (readout.row_noise_e, readout.column_noise_e, readout.dsnu_e) = (0.0, 0.0, 0.0);
    (readout.dsnu_row_e, readout.dsnu_column_e) = (0.0, 0.0);
    (readout.prnu_row, readout.prnu_column) = (0.0, 0.0);
}

/// The frame of a uniform scene of a sensor whose black level drifts, by as much as photosites have of their own.
fn drifting(size: [usize; 2], electrons: [f32; 3], rows: f64) -> MemoryFrame {
    let mut frame = scene(size, electrons);
    with_readout(&mut frame, |readout| (readout.black_drift_e, readout.black_drift_rows) = (7.0, rows));
    frame
}

/// Of two amplifiers by columns red lies behind the first, blue behind the second and green behind both, by halves: what is predicted of electrons and
/// codes is that, not of three planes each of which lies behind both. Numbers of red and blue by hand, of green by their mixture.
#[test]
fn stages_before_demosaicking_are_those_of_the_plane() {
    let taps = Taps {
        layout: TapLayout::Columns,
        gain: vec![1.0, 1.02],
        offset_e: vec![0.0, 8.0],
        read_noise_e: vec![4.0, 12.0],
    };
    let mut camera = sensor();
    camera.readout = Some(ReadOut {
        width: 64,
        height: 48,
        cfa: CfaPattern::Rggb.into(),
        full_well_e: 15_000.0,
        dark_current_na_per_cm2: None,
        dark_current_e_per_s: Some(0.0),
        dcnu: 0.0,
        prnu: 0.002,
        read_noise_e: 5.0,
        bits: 12,
        bias_adu: 120.0,
        adu_per_e: 0.25,
        taps: Some(taps),
        ..camera.readout.unwrap()
    });
    let setup = CameraSetup { method: Method::Bilinear, ..CameraSetup::new(camera, support::EXPOSURE) };
    let stages = Predictor::new(PredictorSettings::of(setup)).unwrap().predict([1000.0; 3]).unwrap().stages;
    // Shot noise, that of the sensitivities, which scatters by 1 + prnu², and read noise.
    let variance = |gain: f64, read_noise_e: f64| {
        (0.25 * gain).powi(2) * (1000.0 + 4.0 + 0.004 + read_noise_e * read_noise_e) + 1.0 / 12.0
    };
    let (red, blue) = ((120.0 + 250.0, variance(1.0, 4.0)), (120.0 + 0.25 * 1.02 * 1008.0, variance(1.02, 12.0)));
    let half = f64::midpoint(red.0, blue.0);
    let green = (half, f64::midpoint(red.1, blue.1) + (blue.0 - half).powi(2));
    assert_eq!(stages[1].channels, ["R", "G", "B"]);
    for (class, (mean, variance)) in [red, green, blue].into_iter().enumerate() {
        assert!((stages[1].mean[class] - mean).abs() < 1e-6, "{class}: {} {mean}", stages[1].mean[class]);
        assert!((stages[1].std[class] / variance.sqrt() - 1.0).abs() < 1e-6, "{class}: {}", stages[1].std[class]);
    }
    assert_eq!(stages[1].covariance[0][2], 0.0, "red and blue are other photosites");
    assert!((stages[0].std[0].powi(2) - 1020.004).abs() < 1e-6 && (stages[0].std[2].powi(2) - 1148.004).abs() < 1e-6);
    // The mean of a channel is what it was, black of the code range taken off.
    let demosaicked = &stages[2];
    assert!(
        [red, green, blue].iter().zip(demosaicked.mean).all(|((mean, _), found)| (mean - 120.0 - found).abs() < 1e-6)
    );
}

/// What each tap makes of a charge: by the sensor's own numbers, and by those of the tap; and read noise in proportion.
#[test]
fn taps_have_their_own_numbers() {
    for taps in several_taps() {
        let light = tapped([44, 31], [900.0, 2000.0, 1500.0], &taps);
        let only = |kept: Source| {
            let without = Source::ALL.into_iter().filter(|source| *source != kept).collect();
            noisy(&light, &NoiseSettings { seed: 5, without, ..Default::default() })
        };
        let mut alike = light.clone();
        with_readout(&mut alike, |readout| (readout.taps, readout.read_noise_e) = (None, 1.0));
        let without: Vec<Source> = Source::ALL.into_iter().filter(|source| *source != Source::Ron).collect();
        let unit = noisy(&alike, &NoiseSettings { seed: 5, without, ..Default::default() });
        let noisy = only(Source::Ron);
        let codes = digitized(&noisy);
        for (y, x, channel) in (0..31).flat_map(|y| (0..44).flat_map(move |x| (0..3).map(move |c| (y, x, c)))) {
            let half = |at: usize, extent: usize| usize::from(at >= extent / 2);
            let tap = match taps.layout {
                TapLayout::Columns => x % taps.gain.len(),
                TapLayout::LeftRight => half(x, 44),
                TapLayout::TopBottom => half(y, 31),
                TapLayout::Quadrants => 2 * half(y, 31) + half(x, 44),
            };
            let charge = f64::from(at(&noisy, x, y, channel));
            let dark = f64::from(at(&light, x, y, channel)) + light_dark(&noisy);
            let off = f64::from(at(&unit, x, y, channel)) - dark;
            // Single precision at 2000 e-, times the read noise.
            assert!((charge - dark - taps.read_noise_e[tap] * off).abs() < 5e-3, "{x} {y}: {charge} {off}");
            let level = 500.0 + 0.4 * taps.gain[tap] * (charge + taps.offset_e[tap]);
            let code = f64::from(at(&codes, x, y, channel));
            assert!((code - level).abs() <= 0.5 + 1e-9, "{taps:?} {x} {y}: {code} {level}");
        }
    }
}

fn light_dark(noisy: &MemoryFrame) -> f64 {
    noisy.header.metadata.noise.as_ref().unwrap().dark_e
}

/// Mosaic, crops, bands, threads and instructions change no bit of what taps and drift make, before and behind the converter.
#[test]
fn taps_and_drift_belong_to_places() {
    let settings = NoiseSettings { seed: 3, sensor_seed: 4, frame: 7, ..Default::default() };
    for taps in several_taps() {
        let mut light = tapped([530, 37], [900.0, 2000.0, 1500.0], &taps);
        with_readout(&mut light, |readout| (readout.black_drift_e, readout.black_drift_rows) = (7.0, 5.5));
        let stage = AddNoise::new(&light.header, &settings).unwrap();
        let whole = through(&light, &stage);
        let converter = Digitize::new(&whole.header, &AdcSettings::default()).unwrap();
        let codes = through(&whole, &converter);
        let plane = through(&light, &Mosaic::new(&light.header, None).unwrap());
        assert_same(&digitized(&noisy(&plane, &settings)), &plane_of(&codes), "mosaic");
        for [x, y, width, height] in
            [[0, 0, 530, 37], [3, 5, 300, 20], [129, 17, 70, 20], [264, 30, 17, 7], [265, 18, 1, 1]]
        {
            let part = noisy(&crop(&light, x, y, width, height), &settings);
            assert_same(&part, &crop(&whole, x, y, width, height), "crop");
            assert_same(&digitized(&part), &crop(&codes, x, y, width, height), "crop of codes");
        }
        assert_same(&through_cuts(&light, &stage, &[1, 18, 20]).0, &whole, "bands");
        assert_same(&through_cuts(&whole, &converter, &[1, 18, 20]).0, &codes, "bands of codes");
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_same(&pool.install(|| through(&light, &stage)), &whole, "threads");
        }
        assert_same(&through(&light, &stage.clone().on(Instructions::up_to_256_bits())), &whole, "instructions");
    }
    // Taps that do not differ are none.
    let light = scene([60, 37], [900.0, 2000.0, 1500.0]);
    let mut alike = light.clone();
    with_readout(&mut alike, |readout| {
        let taps =
            Taps { layout: TapLayout::Quadrants, gain: vec![1.0; 4], offset_e: vec![], read_noise_e: vec![6.0; 4] };
        readout.taps = Some(taps);
    });
    assert_same(&digitized(&noisy(&alike, &settings)), &digitized(&noisy(&light, &settings)), "taps alike");
}

/// False alarms of the regions of frames come no more often than the level says.
fn regions_cover(what: &str, parts: &[Region], made: impl Fn(u64) -> Vec<MemoryFrame> + Sync + Send) {
    for (index, corrected) in over_seeds(SEEDS, parts, made).iter().enumerate() {
        judge(&format!("{what}, {index}"), corrected, 0.0);
    }
}

/// An exposure of a scene at each stage before demosaicking, and less two dark frames.
fn before_demosaicking(scene: &MemoryFrame, seed: u64) -> Vec<MemoryFrame> {
    let electrons = noisy(scene, &settings(seed));
    let codes = digitized(&electrons);
    let plane = plane_of(&codes);
    let less = less_darks(&plane, scene, seed, 2);
    vec![electrons, codes, plane, less]
}

/// Whole frames and regions of several taps before demosaicking, less dark frames too, of rows and columns that share noise and of others;
/// behind one tap at every stage.
#[test]
fn frames_of_taps_raise_false_alarms_at_the_stated_rate() {
    let whole = Region { x: 0, y: 0, width: 26, height: 21 };
    let some = Region { x: 3, y: 2, width: 15, height: 14 };
    let corner = Region { x: 14, y: 11, width: 12, height: 10 };
    for taps in several_taps() {
        for scene in [tapped, tapped_with_lines].map(|scene| scene([26, 21], [900.0, 2500.0, 1800.0], &taps)) {
            let sites = |seed: u64| before_demosaicking(&scene, seed);
            regions_cover(&format!("{:?}", taps.layout), &[whole, some, corner], sites);
        }
    }
    let scene = tapped([26, 21], [900.0, 2500.0, 1800.0], &several_taps()[4]);
    let lower_right = Region { x: 16, y: 13, width: 10, height: 8 };
    let pixels = |seed: u64| {
        let plane = plane_of(&digitized(&noisy(&scene, &settings(seed))));
        let camera = demosaicked(&plane, Method::EffectiveColor);
        let xyz = colored(&camera, Space::Xyz);
        let of_less = demosaicked(&less_darks(&plane, &scene, seed, 2), Method::Bilinear);
        vec![camera, xyz, of_less]
    };
    regions_cover("behind one tap", &[lower_right], pixels);
}

/// Whole frames and regions of pixels that several taps have a part in, in camera channels, XYZ and L*a*b*; the part is that of a crop
/// too.
#[test]
fn pixels_of_several_taps_raise_false_alarms_at_the_stated_rate() {
    let whole = Region { x: 0, y: 0, width: 22, height: 18 };
    let some = Region { x: 3, y: 2, width: 13, height: 14 };
    for (taps, method) in several_taps().iter().zip([
        Method::EffectiveColor,
        Method::Bilinear,
        Method::Malvar,
        Method::EffectiveColor,
        Method::Bilinear,
    ]) {
        for scene in [tapped, tapped_with_lines].map(|scene| scene([22, 18], [900.0, 2500.0, 1800.0], taps)) {
            let made = |seed: u64| {
                let plane = plane_of(&digitized(&noisy(&scene, &settings(seed))));
                let camera = demosaicked(&plane, method);
                let less = demosaicked(&less_darks(&plane, &scene, seed, 2), method);
                vec![less, colored(&camera, Space::Xyz), colored(&camera, Space::Lab), camera]
            };
            for (index, corrected) in over_seeds(SEEDS, &[whole, some], made).iter().enumerate() {
                judge(&format!("{:?}, {method:?}, {index}", taps.layout), corrected, 0.4);
            }
        }
    }
}

/// Means of pixels of several taps lie about the predicted ones with the predicted scatter over n sensors, and sample variances and
/// covariances too, of rows and columns that share noise and of others: sums of squares of n have chi-square of as many degrees of freedom,
/// and means of that many z lie within 5 standard errors.
#[test]
fn pixels_of_several_taps_scatter_as_predicted() {
    let seeds = trials(1500);
    let mut smallest = 1.0_f64;
    let mut tests = 0;
    let methods = [Method::Bilinear, Method::EffectiveColor, Method::Malvar, Method::Bilinear, Method::EffectiveColor];
    let cases = several_taps().into_iter().zip(methods);
    for ((taps, method), has_lines) in cases.flat_map(|case| [false, true].map(|has_lines| (case.clone(), has_lines))) {
        let scene = if has_lines { tapped_with_lines } else { tapped };
        let scene = scene([22, 18], [900.0, 2500.0, 1800.0], &taps);
        let made = |seed: u64| {
            let plane = plane_of(&digitized(&noisy(&scene, &settings(seed + 90_000))));
            [Space::Xyz, Space::Lab].map(|space| crop(&colored(&demosaicked(&plane, method), space), 2, 3, 17, 12))
        };
        let laws: Vec<_> = made(0)
            .iter()
            .map(|frame| match of_frame(&frame.header, Equations::Exact) {
                Ok(FramePrediction::Tapped(pixels)) => pixels,
                other => panic!("{other:?}"),
            })
            .collect();
        laws.iter().for_each(|law| assert!(law.sampling().count == 17.0 * 12.0));
        let of = |seed: u64| -> Vec<[f64; 9]> {
            let of_frame = |(frame, law): (&MemoryFrame, &TappedPixels)| {
                let sample = |index: usize, channel: usize| f64::from(at(frame, index % 17, index / 17, channel));
                let n = 17.0 * 12.0;
                let mean = [0, 1, 2].map(|c| (0..204).map(|index| sample(index, c)).sum::<f64>() / n);
                let s = |i: usize, j: usize| {
                    (0..204).map(|a| (sample(a, i) - mean[i]) * (sample(a, j) - mean[j])).sum::<f64>() / (n - 1.0)
                };
                let sampling = law.sampling();
                let mut found = [0.0; 9];
                for i in 0..3 {
                    found[i] = (mean[i] - law.mean[i]) / sampling.mean_covariance[(i, i)].sqrt();
                }
                for (index, [i, j]) in PAIRS.into_iter().enumerate() {
                    found[3 + index] = (s(i, j) - sampling.covariance[(i, j)]) / sampling.spread[index][index].sqrt();
                }
                found
            };
            made(seed).iter().zip(&laws).map(|(frame, law)| of_frame((frame, law))).collect()
        };
        let all: Vec<Vec<[f64; 9]>> = (0..seeds).into_par_iter().map(of).collect();
        for (frame, index) in (0..2).flat_map(|frame| (0..9).map(move |index| (frame, index))) {
            let z: Vec<f64> = all.iter().map(|found| found[frame][index]).collect();
            let n = seeds as f64;
            let mean = z.iter().sum::<f64>() / n;
            let square: f64 = z.iter().map(|z| z * z).sum();
            assert!(mean.abs() < 5.0 / n.sqrt(), "{:?} {frame} {index}: {mean}", taps.layout);
            let p = of_chi_square(square, n);
            assert!(p > 1e-6, "{:?} {frame} {index}: {}", taps.layout, square / n);
            smallest = smallest.min(p);
            tests += 1;
        }
    }
    assert!(of_smallest(smallest, tests) > 1e-4, "{smallest} of {tests}");
}

/// So do frames whose black level drifts over fewer rows than they have, as many, and more.
#[test]
fn drifting_frames_raise_false_alarms_at_the_stated_rate() {
    for rows in [3.3, 20.0, 170.0] {
        let scene = drifting([24, 19], [900.0, 2500.0, 1800.0], rows);
        let sites = |seed: u64| before_demosaicking(&scene, seed);
        let some = Region { x: 2, y: 3, width: 17, height: 12 };
        regions_cover(&format!("drift over {rows} rows"), &[Region { x: 0, y: 0, width: 24, height: 19 }, some], sites);
    }
}

/// Means and variances of regions over many sensors, as standard deviations of their scatter: means have the predicted variance, and
/// sample variances the predicted mean.
#[test]
fn regions_of_taps_and_drift_scatter_as_predicted() {
    let seeds = trials(1500);
    let scenes = [
        tapped([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[4]),
        tapped([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[1]),
        tapped_with_lines([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[4]),
        tapped_with_lines([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[1]),
        drifting([26, 22], [900.0, 2500.0, 1800.0], 9.0),
        drifting([26, 22], [900.0, 2500.0, 1800.0], 60.0),
    ];
    let part = [Region { x: 5, y: 3, width: 16, height: 15 }];
    let mut smallest = 1.0_f64;
    let mut tests = 0;
    for scene in &scenes {
        let of = |seed: u64| {
            let codes = digitized(&noisy(scene, &settings(seed + 70_000)));
            let plane = plane_of(&codes);
            let less = less_darks(&plane, scene, seed + 70_000, 2);
            let reports = [&codes, &plane, &less].map(|frame| regions(frame, &part).remove(0));
            let [codes, plane, less] = reports;
            let mut found = codes.channels;
            found.extend(plane.classes);
            found.extend(plane.channels);
            found.extend(less.classes);
            found
        };
        let all: Vec<_> = (0..seeds).into_par_iter().map(of).collect();
        for index in 0..all[0].len() {
            let z: Vec<f64> = all.iter().map(|channels| channels[index].z_mean.unwrap()).collect();
            let mean = z.iter().sum::<f64>() / seeds as f64;
            let square: f64 = z.iter().map(|z| z * z).sum();
            // Standard errors are known, means too: chi-square of so many, and a normal mean.
            let p = of_chi_square(square, seeds as f64);
            assert!(p > 1e-6, "mean {index}: {}", (square / seeds as f64).sqrt());
            assert!(mean.abs() < 5.0 / (seeds as f64).sqrt(), "mean {index}: {mean}");
            smallest = smallest.min(p);
            tests += 1;
        }
    }
    assert!(of_smallest(smallest, tests) > 1e-4, "{smallest} of {tests}");
}

/// What is not predicted is refused with the key in the reason.
#[test]
fn what_taps_and_drift_leave_open_is_refused() {
    let why = |frame: &MemoryFrame| of_frame(&frame.header, Equations::Exact).unwrap_err().to_string();
    let taps = &several_taps()[2];
    let scene = tapped([26, 22], [900.0, 2500.0, 1800.0], taps);
    let plane = plane_of(&digitized(&noisy(&scene, &settings(1))));
    let camera = demosaicked(&plane, Method::SmoothHue);
    assert!(why(&camera).contains("several amplifiers (`taps`"), "{}", why(&camera));
    // The left half with the reach of the method is predicted, and one column more is not; by another method all is.
    let left = |width: usize| Region { x: 0, y: 0, width, height: 22 };
    let reach = Method::SmoothHue.reach();
    assert!(regions_or(&camera, left(13 - reach)).is_ok());
    assert!(regions_or(&camera, left(14 - reach)).is_err());
    let mut camera = demosaicked(&plane, Method::Bilinear);
    assert!(regions_or(&camera, left(14)).is_ok());
    assert!(of_frame(&camera.header, Equations::Paper).unwrap_err().to_string().contains("one amplifier"));
    camera.header.metadata.demosaic.as_mut().unwrap().plane = None;
    assert_eq!(why(&camera), "the metadata has no `demosaic.plane`");
    camera.header.metadata.demosaic.as_mut().unwrap().plane = Some([1, 0, 26, 22]);
    assert!(why(&camera).contains("`demosaic.plane`"), "{}", why(&camera));
    let mut drifting_taps = scene.clone();
    with_readout(&mut drifting_taps, |readout| (readout.black_drift_e, readout.black_drift_rows) = (7.0, 9.0));
    let codes = digitized(&noisy(&drifting_taps, &settings(1)));
    for told in [why(&codes), why(&demosaicked(&plane_of(&codes), Method::Bilinear))] {
        assert!(told.contains("`black_drift_e`") && told.contains("several amplifiers"), "{told}");
    }
    assert!(regions_or(&codes, left(13)).is_ok());
    let turns = tapped([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[0]);
    let told = why(&demosaicked(&plane_of(&digitized(&noisy(&turns, &settings(1)))), Method::SmoothHue));
    assert!(told.contains("several amplifiers (`taps`") && !told.contains("behind one"), "{told}");
    let cte =
        AddNoise::new(&scene.header, &NoiseSettings { cte: Some(0.9999), ..settings(1) }).unwrap_err().to_string();
    assert!(cte.contains("several `taps`"), "{cte}");
    let drift = drifting([26, 22], [900.0, 2500.0, 1800.0], 9.0);
    let camera = demosaicked(&plane_of(&digitized(&noisy(&drift, &settings(1)))), Method::Bilinear);
    assert!(why(&camera).contains("`black_drift_e`"), "{}", why(&camera));
    assert!(PixelNoise::of(&camera.header).is_ok());
    let full = drifting([26, 22], [29_990.0, 2500.0, 1800.0], 9.0);
    assert!(why(&digitized(&noisy(&full, &settings(1)))).contains("black level drifts along rows, and full well"));
    let mut bent = drift;
    with_readout(&mut bent, |readout| {
        readout.linearization = Some(Linearization::polynomial(vec![1.0, 1.2e-5]).unwrap());
    });
    let told = why(&digitized(&noisy(&bent, &settings(1))));
    assert!(told.contains("black level drifts along rows, and the curve of the converter"), "{told}");
}

fn regions_or(frame: &MemoryFrame, region: Region) -> cyanometer::error::Result<()> {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    measure(&mut source, &[region], Saturated::Kept, Equations::Exact, Some(0.5)).map(|_| ())
}

/// What is predicted of taps that do not differ is what is predicted of one, at each stage and of a region of a frame: sums in another order,
/// 10⁻¹² of them, and of the law of a variance, whose ends are cut off after a part in 10⁸, as much.
#[test]
#[allow(clippy::too_many_lines, reason = "one sensor and its twin, stage after stage")]
fn taps_that_do_not_differ_predict_as_one() {
    let light = [900.0, 2500.0, 1800.0];
    for (layout, count) in [(TapLayout::Columns, 3), (TapLayout::TopBottom, 2), (TapLayout::Quadrants, 4)] {
        let alike = Taps { layout, gain: vec![1.0; count], offset_e: vec![], read_noise_e: vec![] };
        let mut several = tapped_with_lines([26, 22], light, &alike);
        with_readout(&mut several, |readout| readout.taps = Some(alike.clone()));
        let mut alone = several.clone();
        with_readout(&mut alone, |readout| readout.taps = None);
        let predicted = |scene: &MemoryFrame| {
            let metadata = &scene.header.metadata;
            let setup = CameraSetup::new(metadata.sensor.clone().unwrap(), metadata.exposure.unwrap());
            let setup = CameraSetup { noise: settings(3), dark_frames: 3, method: Method::EffectiveColor, ..setup };
            let settings = PredictorSettings {
                patch: Some([7, 5]),
                color: Some(color_settings(Space::Xyz)),
                ..PredictorSettings::of(setup)
            };
            Predictor::new(settings).unwrap().predict(light.map(f64::from)).unwrap()
        };
        let close = |found: f64, expected: f64, what: &str| {
            assert!(
                (found - expected).abs() < 1e-12 * expected.abs().max(1.0),
                "{layout:?} {what}: {found} {expected}"
            );
        };
        let [found, wanted] = [&several, &alone].map(predicted);
        assert_eq!(found.stages.len(), 6);
        for (found, wanted) in found.stages.iter().zip(&wanted.stages) {
            let what = found.stage.name();
            for k in 0..3 {
                // Pixels at the edges of the frame are among these, and what is curved moves them otherwise.
                let share = if wanted.phases.is_empty() { 1e-12 } else { 0.1 };
                assert!((found.std[k] / wanted.std[k] - 1.0).abs() < share, "{what}");
                if what == "lab" {
                    assert!((found.mean[k] - wanted.mean[k]).abs() < 1e-3, "{what}");
                    continue;
                }
                close(found.mean[k], wanted.mean[k], what);
                close(found.patch_mean_std.unwrap()[k], wanted.patch_mean_std.unwrap()[k], what);
                for entry in wanted.causes.iter().filter(|_| share < 0.1) {
                    let same = found.causes.iter().find(|found| found.cause == entry.cause).unwrap();
                    close(same.variance[k], entry.variance[k], what);
                }
            }
        }
        let some = Region { x: 3, y: 2, width: 15, height: 14 };
        let stages = |scene: &MemoryFrame| {
            let mut found = before_demosaicking(scene, 3);
            found.push(demosaicked(&found[2], Method::EffectiveColor));
            found.push(colored(&found[4], Space::Xyz));
            found
        };
        for (found, wanted) in stages(&several).iter().zip(&stages(&alone)) {
            let [found, wanted] = [found, wanted].map(|frame| regions(frame, &[some]).remove(0));
            let all = |report: &RegionReport| -> Vec<[Option<f64>; 3]> {
                let channels = report.channels.iter().chain(&report.classes);
                channels.map(|channel| [channel.z_mean, channel.mean_error, channel.std_error]).collect()
            };
            // Third cumulants of the classes of a plane, with the distances of their means, count where taps are told alone.
            let tolerance = |index: usize| if index == 0 && !found.classes.is_empty() { 2e-3 } else { 1e-9 };
            for (index, (found, wanted)) in all(&found).into_iter().zip(all(&wanted)).enumerate() {
                for (found, wanted) in found.into_iter().flatten().zip(wanted.into_iter().flatten()) {
                    let close = (found - wanted).abs() < tolerance(index) * wanted.abs();
                    assert!(close, "{layout:?} {index}: {found} {wanted}");
                }
            }
            for (found, wanted) in found.tests.iter().zip(&wanted.tests) {
                close(found.expected, wanted.expected, "tests");
                assert!((found.p - wanted.p).abs() < 1e-6, "{found:?} {wanted:?}");
                assert!(found.z.zip(wanted.z).is_none_or(|(found, wanted)| (found - wanted).abs() < 1e-9));
            }
        }
    }
}

/// A frame that lies behind one tap is predicted as that of a sensor with its numbers, and the budget of all photosites holds what
/// taps add.
#[test]
fn one_tap_is_a_sensor_of_its_own() {
    let taps = &several_taps()[4];
    let scene = tapped([40, 32], [900.0, 2500.0, 1800.0], taps);
    let made =
        |scene: &MemoryFrame| demosaicked(&plane_of(&digitized(&noisy(scene, &settings(3)))), Method::EffectiveColor);
    let quarter = made(&crop(&scene, 20, 0, 20, 16));
    let mut alone = crop(&scene, 20, 0, 20, 16);
    with_readout(&mut alone, |readout| {
        readout.taps = None;
        (readout.read_noise_e, readout.adu_per_e) = (9.0, 0.4 * 1.02);
        readout.bias_adu = 500.0 + 0.4 * 1.02 * -20.0;
    });
    let mut alone = made(&alone);
    // Black is that of the sensor with taps.
    alone.header.metadata.demosaic = quarter.header.metadata.demosaic.clone();
    let pixels = |frame: &MemoryFrame| match of_frame(&frame.header, Equations::Exact) {
        Ok(FramePrediction::Pixels(pixels)) => pixels,
        other => panic!("{other:?}"),
    };
    // The crop ends at the border of its tap, so that pixels there may have been made of the next.
    let part = |frame: &MemoryFrame| crop(frame, 4, 0, 16, 12);
    assert_eq!(pixels(&part(&quarter)).covariance, pixels(&part(&alone)).covariance);
    assert_eq!(pixels(&part(&quarter)).mean, pixels(&part(&alone)).mean);
    let setup =
        CameraSetup::new(scene.header.metadata.sensor.clone().unwrap(), scene.header.metadata.exposure.unwrap());
    let setup = CameraSetup { noise: settings(3), dark_frames: 3, ..setup };
    let found = Predictor::new(PredictorSettings::of(setup.clone())).unwrap().predict([900.0, 2500.0, 1800.0]).unwrap();
    assert_eq!(found.no_pixels, None);
    assert_eq!(found.stages.len(), 4);
    for stage in &found.stages {
        let causes = [0, 1, 2].map(|k| stage.causes.iter().map(|entry| entry.variance[k]).sum::<f64>());
        let of_taps = stage.causes.iter().find(|entry| entry.cause.name() == "taps").unwrap().variance;
        for k in 0..3 {
            assert!((causes[k] / stage.std[k].powi(2) - 1.0).abs() < 1e-12);
            // 4 equal parts of gains 1, 1.02, 0.97 and 1.05, and offsets; of electrons they do not differ.
            let light = [900.0, 2500.0, 1800.0][k] + 60.0 * 0.033;
            let level = |tap: usize| 0.4 * taps.gain[tap] * (light + taps.offset_e[tap]);
            let mean = (0..4).map(level).sum::<f64>() / 4.0;
            let between = (0..4).map(|tap| (level(tap) - mean).powi(2)).sum::<f64>() / 4.0;
            match stage.stage.name() {
                "electrons" => assert!(of_taps[k].abs() < 1e-6 * stage.std[k].powi(2), "{}", of_taps[k]),
                "adu" => assert!((of_taps[k] / between - 1.0).abs() < 1e-3, "{} {between}", of_taps[k]),
                "dark_subtracted" => assert!(of_taps[k] > 0.5 * between && of_taps[k] < 1.5 * between),
                _ => {}
            }
        }
    }
    // Of pixels, borders of taps included, what is left without noise; codes are off by half of one, of 15 between the taps of red.
    let setup = CameraSetup { dark_frames: 0, ..setup };
    let found = Predictor::new(PredictorSettings::of(setup)).unwrap().predict([900.0, 2500.0, 1800.0]).unwrap();
    let pixels = found.stages.last().unwrap();
    assert_eq!(pixels.stage.name(), "demosaicked");
    let of_taps = pixels.causes.iter().find(|entry| entry.cause.name() == "taps").unwrap().variance;
    let without = Source::ALL.to_vec();
    let quiet = digitized(&noisy(&scene, &NoiseSettings { without, ..Default::default() }));
    let quiet = demosaicked(&plane_of(&quiet), Method::EffectiveColor);
    for (k, of_taps) in of_taps.into_iter().enumerate() {
        let samples: Vec<f64> = (0..40 * 32).map(|i| f64::from(at(&quiet, i % 40, i / 40, k))).collect();
        let mean = samples.iter().sum::<f64>() / 1280.0;
        let variance = samples.iter().map(|sample| (sample - mean).powi(2)).sum::<f64>() / 1280.0;
        assert!((of_taps / variance - 1.0).abs() < 0.1, "{k}: {of_taps} {variance}");
    }
}

/// Standard deviations beside pixels against the scatter of 3000 frames, each of another sensor: chi-square of 2999.
fn sigma_covers(what: &str, scene: &MemoryFrame, methods: &[Method], places: &[[usize; 2]]) {
    for &method in methods {
        let made = |seed: u64| demosaicked(&plane_of(&digitized(&noisy(scene, &settings(seed)))), method);
        let frames = 3000;
        let all: Vec<Vec<[f64; 3]>> = (0..frames)
            .into_par_iter()
            .map(|seed| {
                let frame = made(seed);
                places.iter().map(|[x, y]| [0, 1, 2].map(|c| f64::from(at(&frame, *x, *y, c)))).collect()
            })
            .collect();
        let noise = PixelNoise::of(&made(0).header).unwrap();
        let n = frames as f64;
        let mut smallest = 1.0_f64;
        for (index, place) in places.iter().enumerate() {
            let mean = [0, 1, 2].map(|c| all.iter().map(|frame| frame[index][c]).sum::<f64>() / n);
            let predicted = symmetric(&noise.covariance(*place, mean).0);
            for c in 0..3 {
                let square: f64 = all.iter().map(|frame| (frame[index][c] - mean[c]).powi(2)).sum();
                let p = of_chi_square(square / predicted[(c, c)], n - 1.0);
                let ratio = square / (n - 1.0) / predicted[(c, c)];
                assert!(p > 1e-6, "{what} {method:?} {place:?} {c}: {ratio}");
                smallest = smallest.min(p);
            }
        }
        assert!(of_smallest(smallest, 3 * places.len()) > 1e-4, "{what} {method:?}: {smallest}");
    }
}

/// At the border of taps and away from it.
#[test]
fn sigma_knows_the_taps_of_each_photosite() {
    for taps in several_taps() {
        let mut scene = tapped([14, 12], [900.0, 2500.0, 1800.0], &taps);
        with_readout(&mut scene, |readout| {
            // Levels are taken to be the same behind all taps; read noise differs.
            let taps = readout.taps.as_mut().unwrap();
            (taps.gain, taps.offset_e) = (vec![], vec![]);
            taps.read_noise_e.iter_mut().for_each(|noise| *noise *= 8.0);
        });
        let places: Vec<[usize; 2]> = (2..12).flat_map(|x| [[x, 5], [x, 6]]).collect();
        sigma_covers(&format!("{taps:?}"), &scene, &[Method::EffectiveColor], &places);
        // Of hardly any light they read the same whatever their gains.
        let mut scene = tapped_with_lines([14, 12], [2.0, 6.0, 4.0], &taps);
        with_readout(&mut scene, |readout| {
            (readout.row_noise_e, readout.dsnu_column_e) = (20.0, 15.0);
            let taps = readout.taps.as_mut().unwrap();
            taps.offset_e = vec![];
            taps.gain.iter_mut().for_each(|gain| *gain = 1.0 + 6.0 * (*gain - 1.0));
        });
        sigma_covers(&format!("{taps:?} with lines"), &scene, &[Method::EffectiveColor], &places);
    }
}

/// At each row, edges too, of a drift that is most of the noise, from knots nearer than stencils reach to those farther off than the
/// frame. One that is left out, or taken to be the same in all rows, is half or twice the variance.
#[test]
fn sigma_knows_how_black_drifts() {
    let methods = [Method::Bilinear, Method::EffectiveColor, Method::SmoothHue, Method::Malvar];
    let places: Vec<[usize; 2]> = (0..13).flat_map(|y| [[4, y], [5, y]]).collect();
    for rows in [2.0, 3.3, 40.0] {
        let mut scene = drifting([10, 13], [900.0, 2500.0, 1800.0], rows);
        with_readout(&mut scene, |readout| readout.black_drift_e = 80.0);
        sigma_covers(&format!("{rows} rows"), &scene, &methods, &places);
    }
}
