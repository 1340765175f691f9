//! Checks of predictions: they pass frames that are as predicted, fail others, and raise false alarms as often as they
//! say.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::Verdict;
use cyanometer::analysis::statistics::{Laws, Region, RegionReport, Saturated, measure};
use cyanometer::color::Space;
use cyanometer::metadata::Scene;
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::propagation::Equations;
use cyanometer::random::Source;
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::{DarkFrames, LessDarks};
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::{MemoryFrame, Stage, run};
use rayon::prelude::*;
use support::alarms::{corrected, judge, over_seeds, regions_among};
use support::chain::{colored, digitized};
use support::misses::trials;
use support::{at, expected, through};

/// The frame of a uniform scene.
fn scene(size: [usize; 2], electrons: [f32; 3]) -> MemoryFrame {
    let mut frame = expected(size[0], size[1], |_, _, class| electrons[class as usize]);
    frame.header.metadata.scene = Some(Scene::uniform("test", electrons.map(f64::from)));
    frame
}

fn noisy(scene: &MemoryFrame, seed: u64) -> MemoryFrame {
    let settings = NoiseSettings { seed, sensor_seed: seed, ..Default::default() };
    through(scene, &AddNoise::new(&scene.header, &settings).unwrap())
}

fn demosaicked(codes: &MemoryFrame, method: Method) -> MemoryFrame {
    let plane = through(codes, &Mosaic::new(&codes.header, None).unwrap());
    through(&plane, &Demosaic::new(&plane.header, method, Black::Auto, None).unwrap())
}

fn regions(frame: &MemoryFrame, regions: &[Region], equations: Equations) -> Vec<RegionReport> {
    regions_among(&mut Laws::default(), frame, regions, equations)
}

fn verdict(frame: &MemoryFrame, equations: Equations) -> Verdict {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    measure(&mut source, &[], Saturated::Kept, equations, Some(1e-4)).unwrap().check.unwrap()
}

fn seeds() -> u64 {
    trials(2000)
}

/// Whole small frames, every stage of one exposure: electrons, ADU, three demosaickings, XYZ and L*a*b*.
#[test]
fn whole_frames_raise_false_alarms_at_the_stated_rate() {
    let scene = scene([24, 18], [3000.0, 9000.0, 20_000.0]);
    let alarms = over_seeds(2000, &[], |seed| {
        let electrons = noisy(&scene, seed);
        let codes = digitized(&electrons);
        let plane = through(&codes, &Mosaic::new(&codes.header, None).unwrap());
        let cameras = [Method::Bilinear, Method::EffectiveColor, Method::Malvar].map(|m| demosaicked(&codes, m));
        let [xyz, lab] = [Space::Xyz, Space::Lab].map(|space| colored(&cameras[1], space));
        [electrons, codes, plane].into_iter().chain(cameras).chain([xyz, lab]).collect()
    });
    let names = ["electrons", "ADU", "CFA plane", "BI", "ECI", "MHC", "XYZ", "L*a*b*"];
    for (name, corrected) in names.iter().zip(&alarms) {
        // Tests of channels that are correlated alarm together, which would make alarms rarer; it does not show.
        judge(name, corrected, 1.0);
    }
}

/// Patches of one frame, far enough apart to be independent: 5×5 of each size.
#[test]
fn patches_raise_false_alarms_at_the_stated_rate() {
    for [width, height] in [[7, 5], [16, 16]] {
        let pitch = 24;
        let scene = scene([5 * pitch, 5 * pitch], [3000.0, 9000.0, 20_000.0]);
        let patches: Vec<Region> =
            (0..25).map(|i| Region { x: i % 5 * pitch + i % 2, y: i / 5 * pitch + i % 3, width, height }).collect();
        let trials: Vec<f64> = (0..seeds() / 25)
            .into_par_iter()
            .flat_map(|seed| {
                let camera = demosaicked(&digitized(&noisy(&scene, seed)), Method::EffectiveColor);
                regions(&camera, &patches, Equations::Exact).iter().map(corrected).collect::<Vec<_>>()
            })
            .collect();
        // 35 pixels, correlated as they are, have 12 to 24 degrees of freedom: there χ² and Fisher's z lean to caution.
        judge(&format!("{width}x{height}"), &trials, if width * height < 100 { 0.6 } else { 1.0 });
    }
}

/// Exact predictions hold where the paper's do not, on half a million pixels: each method, each stage, dim and bright.
#[test]
fn exact_predictions_hold_where_the_papers_fail() {
    for (seed, electrons) in [[0.0; 3], [400.0, 900.0, 700.0], [9000.0, 14_000.0, 6000.0]].into_iter().enumerate() {
        let codes = digitized(&noisy(&scene([800, 600], electrons), seed as u64));
        assert!(verdict(&codes, Equations::Exact).passed, "{electrons:?}");
        for method in Method::ALL {
            // In the dark there is no hue.
            if method == Method::SmoothHue && seed == 0 {
                continue;
            }
            let camera = demosaicked(&codes, method);
            let found = verdict(&camera, Equations::Exact);
            assert!(found.passed, "{method:?} {electrons:?}: {found:?}");
            let xyz = colored(&camera, Space::Xyz);
            let found = verdict(&xyz, Equations::Exact);
            assert!(found.passed, "XYZ by {method:?} {electrons:?}: {found:?}");
            if matches!(method, Method::SmoothHue | Method::EffectiveColor) {
                assert!(!verdict(&camera, Equations::Paper).passed, "{method:?} {electrons:?}");
                assert!(!verdict(&xyz, Equations::Paper).passed, "XYZ by {method:?} {electrons:?}");
            }
        }
    }
}

/// The dark floor: Eq. 11 is 0.53 % below what dark shot noise times non-uniformity makes, 7 standard errors of
/// 2·10⁶ samples.
#[test]
fn the_papers_dark_floor_is_caught() {
    let scene = scene([1000, 700], [0.0; 3]);
    let settings = NoiseSettings { seed: 3, sensor_seed: 8, without: vec![Source::Ron], ..Default::default() };
    let dark = through(&scene, &AddNoise::new(&scene.header, &settings).unwrap());
    assert!(verdict(&dark, Equations::Exact).passed);
    assert!(!verdict(&dark, Equations::Paper).passed);
}

/// Samples that hardly ever leave their code are no normal deviates: without any noise there is one code, and a frame of
/// it passes, one of the next does not.
#[test]
fn frames_without_spread_are_checked_too() {
    let scene = scene([20, 10], [1000.0, 2000.0, 3000.0]);
    let all = vec![Source::Dcsn, Source::Dcnu, Source::Ssn, Source::Prnu, Source::Ron];
    let settings = NoiseSettings { without: all, ..Default::default() };
    let mut codes = digitized(&through(&scene, &AddNoise::new(&scene.header, &settings).unwrap()));
    assert!(verdict(&codes, Equations::Exact).passed);
    codes.samples[77] += 1.0;
    assert!(!verdict(&codes, Equations::Exact).passed);
}

/// A wrong matrix, pattern or level is not as predicted.
#[test]
fn wrong_predictions_are_caught() {
    let scene = scene([200, 150], [3000.0, 9000.0, 20_000.0]);
    let codes = digitized(&noisy(&scene, 5));
    let mut camera = demosaicked(&codes, Method::Bilinear);
    assert!(verdict(&camera, Equations::Exact).passed);
    camera.header.metadata.demosaic.as_mut().unwrap().method = "eci".into();
    assert!(!verdict(&camera, Equations::Exact).passed);
    let mut brighter = codes.clone();
    let levels = brighter.header.metadata.scene.as_mut().unwrap().expected_electrons.as_mut().unwrap();
    levels[1] *= 1.01;
    assert!(!verdict(&brighter, Equations::Exact).passed);
    brighter.header.metadata.scene = None;
    let refused = measure(&mut brighter, &[], Saturated::Kept, Equations::Exact, Some(0.1)).unwrap_err();
    assert!(refused.to_string().contains("nothing can be checked"), "{refused}");
}

/// The mean of a patch scatters from frame to frame as predicted: n frames, each of another sensor, the patch on one place. The
/// variance of n means has χ² of n − 1 degrees of freedom; the bound leaves 10⁻⁴ to chance for all together.
#[test]
fn patch_means_scatter_as_predicted() {
    let scene = scene([26, 24], [3000.0, 9000.0, 20_000.0]);
    let sizes = [[1, 1], [2, 2], [7, 5], [16, 16]];
    let place =
        |[width, height]: [usize; 2], phase: usize| Region { x: 4 + phase % 2, y: 4 + phase / 2, width, height };
    let patches: Vec<Region> = sizes.into_iter().flat_map(|size| [0, 1, 3].map(|phase| place(size, phase))).collect();
    let means = |frame: &MemoryFrame| -> Vec<f64> {
        let mean = |patch: &Region, channel: usize| {
            let rows = patch.y..patch.y + patch.height;
            let sites = rows.flat_map(|y| (patch.x..patch.x + patch.width).map(move |x| (x, y)));
            let sum: f64 = sites.map(|(x, y)| f64::from(at(frame, x, y, channel))).sum();
            sum / (patch.width * patch.height) as f64
        };
        patches.iter().flat_map(|patch| [0, 1, 2].map(|channel| mean(patch, channel))).collect()
    };
    for method in Method::ALL {
        let frame = |seed: u64| {
            let camera = demosaicked(&digitized(&noisy(&scene, seed + 40_000)), method);
            [colored(&camera, Space::Xyz), camera]
        };
        for stage in 0..2 {
            let reports = regions(&frame(0)[stage], &patches, Equations::Exact);
            let predicted: Vec<f64> = reports.into_iter().flat_map(|region| region.patch_mean_std.unwrap()).collect();
            let all: Vec<Vec<f64>> = (0..seeds()).into_par_iter().map(|seed| means(&frame(seed)[stage])).collect();
            let mut smallest = 1.0_f64;
            for (index, predicted) in predicted.iter().enumerate() {
                let n = seeds() as f64;
                let mean = all.iter().map(|frame| frame[index]).sum::<f64>() / n;
                let square: f64 = all.iter().map(|frame| (frame[index] - mean).powi(2)).sum();
                let p = of_chi_square(square / predicted.powi(2), n - 1.0);
                let patch = patches[index / 3];
                let ratio = (square / (n - 1.0)).sqrt() / predicted;
                assert!(
                    p > 1e-6,
                    "{method:?} {patch:?} channel {}: scatters by {ratio} of what is predicted",
                    index % 3
                );
                smallest = smallest.min(p);
            }
            assert!(of_smallest(smallest, predicted.len()) > 1e-4, "{method:?} {stage}: {smallest}");
        }
    }
}

/// What the paper's way of averaging would say of the same patches: after BI, which keeps 9/16 and 5/8 of the variance of
/// a photosite, σ/√n is too small by √(4/(9/16)) = 2.67 for red and blue and by √(2/(5/8)) = 1.79 for green.
#[test]
fn averaging_as_if_pixels_were_independent_is_caught() {
    let scene = scene([200, 150], [9000.0; 3]);
    let camera = demosaicked(&digitized(&noisy(&scene, 1)), Method::Bilinear);
    let region = regions(&camera, &[Region { x: 20, y: 20, width: 64, height: 64 }], Equations::Exact).remove(0);
    for (i, keeps) in [(0, (4.0_f64 / (9.0 / 16.0)).sqrt()), (1, (2.0_f64 / (5.0 / 8.0)).sqrt()), (2, 8.0 / 3.0)] {
        let independent = region.channels[i].predicted_std.unwrap() / 64.0;
        let ratio = region.patch_mean_std.as_ref().unwrap()[i] / independent;
        // The rim of the patch leans on sites outside, which takes off a percent or two.
        assert!((ratio / keeps - 1.0).abs() < 0.03, "channel {i}: {ratio}, not {keeps}");
    }
}

/// Dark frames of the same sensor take its dark pattern with them and bring their own noise: predicted for one, two and
/// nine of them, before and after demosaicking.
#[test]
fn dark_frames_bring_their_noise_and_take_the_pattern() {
    let exposure = |scene: &MemoryFrame, frame: u32| {
        let settings = NoiseSettings { seed: 6, sensor_seed: 7, frame, ..Default::default() };
        digitized(&through(scene, &AddNoise::new(&scene.header, &settings).unwrap()))
    };
    let size = [400, 300];
    let light = exposure(&scene(size, [200.0, 400.0, 300.0]), 0);
    let all: Vec<MemoryFrame> = (1..10).map(|frame| exposure(&scene(size, [0.0; 3]), frame)).collect();
    for count in [1, 2, 9] {
        let mut darks = DarkFrames::of(all[..count].to_vec()).unwrap().unwrap();
        let settings = CorrectionSettings { black: Black::None, cte: None };
        let stage = CorrectFrame::new(&light.header, &settings, Some(darks.stack())).unwrap();
        let mut source = MemoryFrame::new(light.header.clone(), light.samples.clone());
        let mut corrected = MemoryFrame::new(stage.header().clone(), Vec::new());
        let mut less = LessDarks::new(&mut source, &mut darks);
        run(&stage, &mut less, &mut corrected, &mut |_| ()).unwrap();
        let found = verdict(&corrected, Equations::Exact);
        assert!(found.passed, "{count} dark frames: {found:?}");
        let camera = demosaicked(&corrected, Method::EffectiveColor);
        let found = verdict(&camera, Equations::Exact);
        assert!(found.passed, "{count} dark frames, ECI: {found:?}");
        // As many dark frames as there are not would be caught: a ninth of their noise is 10 % of the variance.
        corrected.header.metadata.correction.as_mut().unwrap().masters[0].average.frames = 20;
        assert!(!verdict(&corrected, Equations::Exact).passed, "{count}");
    }
}

/// Transfer takes its share of the mean and of the variance, and a frame of it is not checked as if its photosites were
/// alone; where classes of unequal signals share charge nothing is predicted.
#[test]
fn charge_transfer_is_in_the_predicted_mean() {
    let planes = scene([300, 200], [3000.0, 9000.0, 20_000.0]);
    let level = scene([300, 200], [9000.0; 3]);
    let plane = |scene: &MemoryFrame| through(scene, &Mosaic::new(&scene.header, None).unwrap());
    let settings = NoiseSettings { seed: 2, sensor_seed: 2, cte: Some(0.9999), ..Default::default() };
    let noisy = |scene: &MemoryFrame| through(scene, &AddNoise::new(&scene.header, &settings).unwrap());
    for electrons in [noisy(&planes), noisy(&plane(&level))] {
        for frame in [digitized(&electrons), electrons] {
            let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
            let report = measure(&mut source, &[], Saturated::Kept, Equations::Exact, None).unwrap();
            for channel in &report.regions[0].channels {
                // 5 standard errors; the charge that neighbors share widens them by less than 10 %.
                let (predicted, n) = (channel.predicted_std.unwrap(), channel.count as f64);
                let z_mean = (channel.mean.unwrap() - channel.predicted_mean.unwrap()) / predicted * n.sqrt();
                let z_std = (channel.std.unwrap() / predicted - 1.0) * (2.0 * (n - 1.0)).sqrt();
                assert!(z_mean.abs() < 5.0 && z_std.abs() < 5.0, "{channel:?}");
                // As neighbors share charge, errors of independent samples are not given.
                assert_eq!(
                    (channel.z_mean, channel.z_std, channel.mean_error, channel.std_error),
                    (None, None, None, None)
                );
                // Without transfer's share of 1 − 2·10⁻⁴ the mean of 9000 e⁻ would be off by 1.8 e⁻, 3 standard errors.
            }
            let mut again = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
            let refused =
                measure(&mut again, &[], Saturated::Kept, Equations::Exact, Some(1e-4)).unwrap_err().to_string();
            assert!(refused.contains("charge transfer"), "{refused}");
        }
    }
    let mut mixed = noisy(&plane(&planes));
    assert_eq!(
        measure(&mut mixed, &[], Saturated::Kept, Equations::Exact, None).unwrap().regions[0].channels[0]
            .predicted_mean,
        None
    );
}
