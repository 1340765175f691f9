//! Sensors that are read through several amplifiers: what each makes of a charge, and what is predicted of them.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use crate::support::alarms::{judge, over_seeds};
use crate::support::chain::{
    color_settings, colored, demosaicked, digitized, less_darks, noisy, plane_of, settings, with_readout,
};
use crate::support::cmos::{
    SEEDS, before_demosaicking, regions, regions_cover, several_taps, sigma_covers, tapped, tapped_with_lines,
};
use crate::support::kit::{Camera, Chance, Kit, classes};
use crate::support::misses::trials;
use crate::support::{at, crop, sensor};
use cyanometer::analysis::statistics::{Region, RegionReport};
use cyanometer::camera::linearity::Linearization;
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::cfa::CfaPattern;
use cyanometer::chain::{CameraSetup, Predictor, PredictorSettings};
use cyanometer::color::Space;
use cyanometer::names::Named;
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::propagation::covariance::PAIRS;
use cyanometer::propagation::{Equations, FramePrediction, TappedPixels, of_frame};
use cyanometer::random::Source;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;

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

/// What is predicted of taps that do not differ is what is predicted of one, at each stage and of a region of a frame: sums in another order,
/// 10⁻¹² of them, and of the law of a variance, whose ends are cut off after a part in 10⁸, as much.
#[test]
#[allow(clippy::too_many_lines, reason = "one sensor and its twin, stage after stage")]
fn taps_that_do_not_differ_predict_as_one() {
    let light = [900.0, 2500.0, 1800.0];
    for (layout, count, drift_e) in [
        (TapLayout::Columns, 3, 0.0),
        (TapLayout::TopBottom, 2, 0.0),
        (TapLayout::Quadrants, 4, 0.0),
        (TapLayout::Columns, 2, 12.0),
        (TapLayout::Quadrants, 4, 5.0),
    ] {
        let alike = Taps { layout, gain: vec![1.0; count], offset_e: vec![], read_noise_e: vec![] };
        let mut several = tapped_with_lines([26, 22], light, &alike);
        with_readout(&mut several, |readout| {
            readout.taps = Some(alike.clone());
            (readout.black_drift_e, readout.black_drift_rows) = (drift_e, if drift_e > 0.0 { 9.0 } else { 0.0 });
        });
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
                // Third cumulants that a drift has beside columns are told of one tap to a part.
                let of_drift = if drift_e > 0.0 { 2e-3 } else { 1e-6 };
                assert!((found.p - wanted.p).abs() < of_drift, "{found:?} {wanted:?}");
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

/// So behind a converter whose curve takes a fifth off the slope of what rows and columns share, where taps read about the same level.
#[test]
fn sigma_knows_what_taps_share_behind_a_curve() {
    for (taps, drift_e) in several_taps().into_iter().zip([0.0, 30.0, 0.0, 40.0, 0.0]) {
        let mut scene = tapped_with_lines([14, 12], [9000.0, 9300.0, 8700.0], &taps);
        with_readout(&mut scene, |readout| {
            readout.linearization = Some(Linearization::polynomial(vec![1.0, -2.5e-5]).unwrap());
            (readout.row_noise_e, readout.dsnu_column_e, readout.prnu_row) = (150.0, 120.0, 0.01);
            (readout.black_drift_e, readout.black_drift_rows) = (drift_e, if drift_e > 0.0 { 3.3 } else { 0.0 });
            let taps = readout.taps.as_mut().unwrap();
            taps.offset_e = vec![];
            taps.gain.iter_mut().for_each(|gain| *gain = 1.0 + 0.1 * (*gain - 1.0));
        });
        let places: Vec<[usize; 2]> = (2..12).flat_map(|x| [[x, 5], [x, 6]]).collect();
        sigma_covers(&format!("{taps:?} behind a curve"), &scene, &[Method::EffectiveColor], &places);
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

/// Codes of amplifiers that bend, each made straight from its own bias and taken off dark frames, over a flat field or none: z scores of
/// means and deviations are normal numbers, the rms of n of which is 1 within 4/√(2n).
#[test]
fn bent_amplifiers_are_made_straight_each_from_its_own_bias() {
    let (mut square, mut count) = ([0.0; 2], 0.0);
    for (index, taps) in several_taps().into_iter().enumerate() {
        for seed in 0..trials(40) {
            let mut chance = Chance(1000 * index as u64 + seed);
            let size = [60, 48];
            let mut readout = support::readout();
            (readout.bits, readout.adu_per_e, readout.bias_adu, readout.full_well_e) = (14, 0.2, 900.0, 60_000.0);
            (readout.dcnu, readout.prnu, readout.read_noise_e) = (0.05, 0.004, 8.0);
            (readout.width, readout.height) = (60, 48);
            let [bend, sway] = [(); 2].map(|()| chance.between(-0.05, 0.05) / 16_384.0);
            readout.linearization = Some(Linearization::polynomial(vec![1.0, bend, sway / 16_384.0]).unwrap());
            let offset_e = taps.offset_e.iter().map(|offset_e| 60.0 * offset_e).collect();
            readout.taps = Some(Taps { offset_e, ..taps.clone() });
            let cfa = Some(CfaPattern::ALL[chance.whole(0, 3)]);
            let camera = Camera { readout, size, cfa, seed: 10_000 * index as u64 + 10 * seed, frames: 0.into() };
            let darks = camera.darks(3, 0.02, 300.0);
            let has_flats = seed % 2 == 0;
            let flats = if has_flats { vec![camera.expose([16_000.0; 3], 0.02, 300.0); 1] } else { Vec::new() };
            let flat_darks = if has_flats { darks.clone() } else { Vec::new() };
            let kit = Kit { darks, flats, flat_darks, ..Kit::default() };
            let light = [(); 3].map(|()| chance.between(2000.0, 40_000.0));
            for class in classes(&kit.correct(&camera.expose(light, 0.02, 300.0))) {
                let z = [class.z_mean.unwrap(), class.z_std.unwrap()];
                assert!(z.iter().all(|z| z.abs() < 5.5), "{index} {seed}: {z:?} {class:?}");
                square.iter_mut().zip(z).for_each(|(square, z)| *square += z * z);
                count += 1.0;
            }
        }
    }
    let rms = square.map(|square: f64| (square / count).sqrt());
    assert!(rms.iter().all(|rms| (rms - 1.0).abs() < 4.0 / (2.0_f64 * count).sqrt()), "{rms:?} of {count}");
}
