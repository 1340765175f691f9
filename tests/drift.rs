//! Sensors whose black level drifts along rows, behind one amplifier and several: what is drawn, what is predicted and what is refused.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support::chain::{colored, demosaicked, digitized, less_darks, noisy, plane_of, settings, with_readout};
use crate::support::cmos::{
    SEEDS, before_demosaicking, drifting, regions, regions_cover, regions_cover_over, regions_or, scene, several_taps,
    sigma_covers, tapped, tapped_with_lines,
};
use crate::support::misses::trials;
use crate::support::{assert_same, crop, through, through_cuts};
use cyanometer::analysis::statistics::Region;
use cyanometer::camera::linearity::Linearization;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::color::Space;
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::propagation::{Equations, of_frame};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;

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

/// So do pixels and colors, of a drift that is a part of the noise and of one that is most of it.
#[test]
fn drifting_pixels_raise_false_alarms_at_the_stated_rate() {
    let parts = [Region { x: 0, y: 0, width: 24, height: 19 }, Region { x: 2, y: 3, width: 17, height: 12 }];
    for (drift_e, rows) in [(7.0, 3.3), (80.0, 20.0), (80.0, 170.0)] {
        let mut scene = drifting([24, 19], [900.0, 2500.0, 1800.0], rows);
        with_readout(&mut scene, |readout| readout.black_drift_e = drift_e);
        let made = |seed: u64| {
            let plane = plane_of(&digitized(&noisy(&scene, &settings(seed))));
            let less = demosaicked(&less_darks(&plane, &scene, seed, 2), Method::Malvar);
            let [bilinear, effective, hue] =
                [Method::Bilinear, Method::EffectiveColor, Method::SmoothHue].map(|method| demosaicked(&plane, method));
            let xyz = colored(&effective, Space::Xyz);
            vec![bilinear, less, xyz, hue]
        };
        regions_cover(&format!("{drift_e} e- of drift over {rows} rows"), &parts, made);
    }
}

/// Of a sensor whose black level drifts, and whose taps each make another thing of that.
fn drifting_taps(size: [usize; 2], taps: &Taps, rows: f64, drift_e: f64) -> MemoryFrame {
    let mut scene = tapped_with_lines(size, [900.0, 2500.0, 1800.0], taps);
    with_readout(&mut scene, |readout| (readout.black_drift_e, readout.black_drift_rows) = (drift_e, rows));
    scene
}

/// So do frames of several amplifiers, of photosites and of pixels, less dark frames and as XYZ.
#[test]
fn drifting_taps_raise_false_alarms_at_the_stated_rate() {
    let parts = [Region { x: 0, y: 0, width: 24, height: 20 }, Region { x: 2, y: 3, width: 17, height: 12 }];
    for (layout, rows, drift_e) in [(0, 3.3, 30.0), (2, 40.0, 80.0), (3, 6.0, 80.0), (4, 20.0, 7.0)] {
        let scene = drifting_taps([24, 20], &several_taps()[layout], rows, drift_e);
        let made = |seed: u64| {
            let codes = digitized(&noisy(&scene, &settings(seed)));
            let plane = plane_of(&codes);
            let bilinear = demosaicked(&plane, Method::Bilinear);
            let xyz = colored(&demosaicked(&plane, Method::EffectiveColor), Space::Xyz);
            vec![codes, bilinear, xyz]
        };
        let what = format!("{drift_e} e- of drift over {rows} rows, layout {layout}");
        regions_cover(&what, &parts, made);
        let made = |seed: u64| {
            let less = less_darks(&plane_of(&digitized(&noisy(&scene, &settings(seed)))), &scene, seed, 2);
            let pixels = demosaicked(&less, Method::Malvar);
            vec![less, pixels]
        };
        regions_cover_over(SEEDS / 10, &format!("{what}, less darks"), &parts, made);
    }
}

/// So do pixels by smooth hue transition, whose weights hang on which taps read what, with and without a drift, at the edges too.
#[test]
fn hues_of_taps_raise_false_alarms_at_the_stated_rate() {
    let parts = [Region { x: 0, y: 0, width: 24, height: 20 }, Region { x: 6, y: 3, width: 15, height: 13 }];
    for (layout, rows, drift_e) in [(0, 3.3, 30.0), (1, 0.0, 0.0), (2, 0.0, 0.0), (4, 20.0, 40.0)] {
        let scene = drifting_taps([24, 20], &several_taps()[layout], rows, drift_e);
        let made = |seed: u64| {
            let plane = plane_of(&digitized(&noisy(&scene, &settings(seed))));
            let hue = demosaicked(&plane, Method::SmoothHue);
            vec![colored(&hue, Space::Xyz), hue]
        };
        let what = format!("hues, {drift_e} e- of drift over {rows} rows, layout {layout}");
        regions_cover(&what, &parts, made);
        let made = |seed: u64| {
            let plane = plane_of(&digitized(&noisy(&scene, &settings(seed))));
            vec![demosaicked(&less_darks(&plane, &scene, seed, 2), Method::SmoothHue)]
        };
        regions_cover_over(SEEDS / 60, &format!("{what}, less darks"), &parts, made);
    }
}

/// Means and variances of regions over many sensors, as standard deviations of their scatter: means have the predicted variance, and
/// sample variances the predicted mean.
#[test]
fn regions_of_taps_and_drift_scatter_as_predicted() {
    let seeds = trials(240);
    let scenes = [
        tapped([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[4]),
        tapped([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[1]),
        tapped_with_lines([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[4]),
        tapped_with_lines([26, 22], [900.0, 2500.0, 1800.0], &several_taps()[1]),
        drifting_taps([26, 22], &several_taps()[4], 9.0, 7.0),
        drifting_taps([26, 22], &several_taps()[1], 60.0, 20.0),
        drifting_taps([26, 22], &several_taps()[3], 2.6, 7.0),
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
    let left = |width: usize| Region { x: 0, y: 0, width, height: 22 };
    let mut camera = demosaicked(&plane, Method::Bilinear);
    assert!(regions_or(&camera, left(14)).is_ok());
    assert!(of_frame(&camera.header, Equations::Paper).unwrap_err().to_string().contains("one amplifier"));
    camera.header.metadata.demosaic.as_mut().unwrap().plane = None;
    assert_eq!(why(&camera), "the metadata has no `demosaic.plane`");
    camera.header.metadata.demosaic.as_mut().unwrap().plane = Some([1, 0, 26, 22]);
    assert!(why(&camera).contains("`demosaic.plane`"), "{}", why(&camera));
    let cte =
        AddNoise::new(&scene.header, &NoiseSettings { cte: Some(0.9999), ..settings(1) }).unwrap_err().to_string();
    assert!(cte.contains("several `taps`"), "{cte}");
    let drift = drifting([26, 22], [900.0, 2500.0, 1800.0], 9.0);
    let full = drifting([26, 22], [29_990.0, 2500.0, 1800.0], 9.0);
    assert!(why(&digitized(&noisy(&full, &settings(1)))).contains("black level drifts along rows, and full well"));
    let mut bent = drift;
    with_readout(&mut bent, |readout| {
        readout.linearization = Some(Linearization::polynomial(vec![1.0, 1.2e-5]).unwrap());
    });
    let told = why(&digitized(&noisy(&bent, &settings(1))));
    assert!(told.contains("black level drifts along rows, and the curve of the converter"), "{told}");
}

/// So where amplifiers differ: of hardly any light, so that all read the same but for the drift, which is most of the noise.
#[test]
fn sigma_knows_what_taps_make_of_the_drift() {
    for (layout, rows) in [(0, 2.6), (3, 9.0), (4, 40.0)] {
        let mut scene = drifting_taps([10, 12], &several_taps()[layout], rows, 80.0);
        let electrons = [2.0, 6.0, 4.0];
        let lit = tapped([10, 12], electrons, &several_taps()[layout]);
        (scene.samples, scene.header.metadata.scene) = (lit.samples, lit.header.metadata.scene);
        with_readout(&mut scene, |readout| {
            let taps = readout.taps.as_mut().unwrap();
            taps.offset_e = vec![];
            taps.gain.iter_mut().for_each(|gain| *gain = 1.0 + 6.0 * (*gain - 1.0));
        });
        let places: Vec<[usize; 2]> = (0..12).flat_map(|y| [[4, y], [5, y]]).collect();
        sigma_covers(&format!("{layout}, {rows} rows"), &scene, &[Method::EffectiveColor, Method::Malvar], &places);
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
