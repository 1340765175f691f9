//! Sensors that are read by row and column: noise, gains and offsets of these, and what is predicted of them.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support::alarms::{judge, over_seeds};
use crate::support::chain::{colored, demosaicked, digitized, less_darks, noisy, plane_of, settings, with_readout};
use crate::support::cmos::{SEEDS, regions, scene};
use crate::support::misses::trials;
use crate::support::{assert_same, at, crop, expected, through, through_cuts};
use cyanometer::analysis::statistics::{Region, Saturated, measure};
use cyanometer::cfa::CfaPattern;
use cyanometer::color::Space;
use cyanometer::metadata::Scene;
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::propagation::covariance::symmetric;
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::propagation::{Equations, FramePrediction, of_frame};
use cyanometer::random::{Source, of_column, of_knot, of_row};
use cyanometer::sigma::WithSigma;
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;

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

/// Noise of rows that is said to be noise of photosites leaves the variance of a frame as it is, and so of columns; means of rows and of
/// columns show it, before demosaicking.
#[test]
fn noise_of_rows_and_columns_is_not_that_of_photosites() {
    let light = scene([320, 240], [900.0, 1100.0, 1000.0]);
    let planes = digitized(&noisy(&light, &NoiseSettings { seed: 11, sensor_seed: 12, ..Default::default() }));
    let plane = plane_of(&planes);
    for frame in [&planes, &plane] {
        assert!(is_as_predicted(frame));
        for (what, lie) in [
            (
                "rows",
                (|readout| readout.read_noise_e = readout.read_noise_e.hypot(std::mem::take(&mut readout.row_noise_e)))
                    as Lie,
            ),
            ("columns", |readout| readout.dsnu_e = readout.dsnu_e.hypot(std::mem::take(&mut readout.dsnu_column_e))),
        ] {
            let mut said = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
            with_readout(&mut said, lie);
            assert!(!is_as_predicted(&said), "{what} of {} channels", said.header.geometry.channels.len());
        }
    }
}

type Lie = fn(&mut cyanometer::camera::readout::ReadOut);

fn is_as_predicted(frame: &MemoryFrame) -> bool {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    measure(&mut source, &[], Saturated::Kept, Equations::Exact, Some(1e-4)).unwrap().check.unwrap().passed
}
