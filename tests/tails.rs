//! Sensors with hot pixels and with photosites whose reading jumps: what is drawn, and what is predicted of it.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Region, RegionReport, Saturated, measure};
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::CfaPattern;
use cyanometer::color::Space;
use cyanometer::metadata::{PoissonKind, Scene};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::propagation::{Equations, of_frame};
use cyanometer::random::Source;
use cyanometer::random::philox::philox4x32_10;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;
use support::alarms::{corrected, judge, over_seeds};
use support::chain::{colored, demosaicked, digitized, less_darks, noisy, plane_of, settings, with_readout};
use support::{assert_same, at, crop, expected, through, through_cuts};

/// A CMOS sensor with tails of both kinds.
fn tailed(readout: &mut ReadOut) {
    readout.dark_current_na_per_cm2 = None;
    readout.dark_current_e_per_s = Some(60.0);
    readout.dcnu = 0.15;
    readout.prnu = 0.006;
    readout.read_noise_e = 4.0;
    readout.hot_pixel_share = 0.02;
    readout.hot_pixel_dark_current_e_per_s = 3000.0;
    readout.rts_share = 0.05;
    readout.rts_amplitude_e = 12.0;
    readout.full_well_e = 30_000.0;
    readout.bits = 14;
    readout.bias_adu = 500.0;
    readout.adu_per_e = 0.4;
}

pub fn scene(size: [usize; 2], electrons: [f32; 3], change: impl Fn(&mut ReadOut)) -> MemoryFrame {
    let mut frame = expected(size[0], size[1], |_, _, class| electrons[class as usize]);
    frame.header.metadata.scene = Some(Scene::uniform("test", electrons.map(f64::from)));
    with_readout(&mut frame, change);
    frame
}

/// Nothing where nothing is predicted.
fn told(frame: &MemoryFrame) -> Option<RegionReport> {
    of_frame(&frame.header, Equations::Exact).is_ok().then(|| report(frame))
}

pub fn report(frame: &MemoryFrame) -> RegionReport {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    let none: [Region; 0] = [];
    measure(&mut source, &none, Saturated::Kept, Equations::Exact, Some(0.5)).unwrap().regions.remove(0)
}

// --- what is drawn ---------------------------------------------------------------------------------------------------

fn only(source: Source) -> Vec<Source> {
    Source::ALL.into_iter().filter(|other| *other != source).collect()
}

/// Of hot pixels alone, without shot noise, the shares and the moments of the exponential law; of jumps the three values, a
/// quarter, a half and a quarter over exposures. Bounds are 5 standard errors.
#[test]
fn tails_are_drawn_as_documented() {
    let dark = scene([600, 400], [0.0; 3], |readout| {
        tailed(readout);
        readout.dark_current_e_per_s = Some(0.0);
    });
    let n = dark.samples.len() as f64;
    let exposure_s = dark.header.metadata.exposure.unwrap().exposure_s;
    let hot_e = 3000.0 * exposure_s;
    let of = |frame: u32, source| {
        let settings = NoiseSettings { seed: 5, sensor_seed: 6, frame, without: only(source), ..Default::default() };
        noisy(&dark, &settings)
    };
    let hot = of(0, Source::HotPixels);
    assert_eq!(hot.header.metadata.noise.as_ref().unwrap().sources, [Source::HotPixels]);
    assert_same(&hot, &of(7, Source::HotPixels), "hot pixels are fixed");
    let excess: Vec<f64> = hot.samples.iter().filter(|e| **e > 0.0).map(|e| f64::from(*e)).collect();
    let count = excess.len() as f64;
    assert!((count - 0.02 * n).abs() < 5.0 * (n * 0.02 * 0.98).sqrt(), "{count} of {n}");
    for (power, factorial, twice) in [(1, 1.0, 2.0), (2, 2.0, 24.0), (3, 6.0, 720.0)] {
        let mean = excess.iter().map(|e| (e / hot_e).powi(power)).sum::<f64>() / count;
        let error = ((twice - factorial * factorial) / count).sqrt();
        assert!((mean - factorial).abs() < 5.0 * error, "{power}: {mean}");
    }
    // Left out, hot pixels leave their mean to all.
    let none = of(0, Source::Prnu);
    assert!(none.samples.iter().all(|e| (f64::from(*e) / (0.02 * hot_e) - 1.0).abs() < 1e-6));
    let dark = scene([600, 400], [0.0; 3], |readout| {
        tailed(readout);
        readout.dark_current_e_per_s = Some(0.0);
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (0.0, 0.0);
    });
    let of = |frame: u32| {
        let settings =
            NoiseSettings { seed: 5, sensor_seed: 6, frame, without: only(Source::Rts), ..Default::default() };
        noisy(&dark, &settings)
    };
    let frames: Vec<MemoryFrame> = (0..60).map(of).collect();
    let (mut traps, mut amplitude, mut ups, mut downs) = (0.0, 0.0, 0.0, 0.0);
    for index in 0..dark.samples.len() {
        let values: Vec<f32> = frames.iter().map(|frame| frame.samples[index]).collect();
        let most = values.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
        if most == 0.0 {
            continue;
        }
        assert!(values.iter().all(|value| value.abs() == most || *value == 0.0), "{values:?}");
        traps += 1.0;
        amplitude += f64::from(most);
        ups += values.iter().filter(|value| **value > 0.0).count() as f64;
        downs += values.iter().filter(|value| **value < 0.0).count() as f64;
    }
    assert!((traps - 0.05 * n).abs() < 5.0 * (n * 0.05 * 0.95).sqrt(), "{traps}");
    assert!((amplitude / traps / 12.0 - 1.0).abs() < 5.0 / f64::sqrt(traps));
    for often in [ups, downs] {
        let all = 60.0 * traps;
        assert!((often / all - 0.25).abs() < 5.0 * (0.25 * 0.75 / all).sqrt(), "{often} of {all}");
    }
}

/// The excess has shot noise, fills wells, and goes with temperature as the dark current does.
#[test]
fn the_excess_is_dark_current() {
    let dark = scene([400, 300], [0.0; 3], |readout| {
        tailed(readout);
        (readout.dcnu, readout.rts_share, readout.rts_amplitude_e, readout.read_noise_e) = (0.0, 0.0, 0.0, 0.0);
        readout.dark_current_e_per_s = Some(0.0);
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (1.0, 300_000.0);
    });
    let take = |frame: u32, without: &[Source], temperature_k: f64| {
        let (without, temperature_k) = (without.to_vec(), Some(temperature_k));
        noisy(&dark, &NoiseSettings { frame, without, temperature_k, ..Default::default() })
    };
    let own_k = dark.header.metadata.sensor.as_ref().unwrap().readout.as_ref().unwrap().temperature_k;
    let still = take(0, &[Source::Dcsn], own_k);
    let (first, second) = (take(1, &[], own_k), take(2, &[], own_k));
    let (mut square, mut sites) = (0.0, 0.0);
    for index in 0..still.samples.len() {
        let [mean, a, b] = [&still, &first, &second].map(|frame| f64::from(frame.samples[index]));
        assert!(a <= 30_000.0 && a == a.round());
        if (20.0..29_000.0).contains(&mean) {
            square += (a - b).powi(2) / (2.0 * mean);
            sites += 1.0;
        }
    }
    assert!((square / sites - 1.0).abs() < 5.0 * f64::sqrt(2.0 / sites) * 1.1, "{}", square / sites);
    let full = still.samples.iter().filter(|e| **e >= 30_000.0).count() as f64 / still.samples.len() as f64;
    let exposure_s = dark.header.metadata.exposure.unwrap().exposure_s;
    let expected = (-30_000.0 / (300_000.0 * exposure_s)).exp();
    assert!((full - expected).abs() < 5.0 * (expected / still.samples.len() as f64).sqrt(), "{full} {expected}");
    let readout = dark.header.metadata.sensor.as_ref().unwrap().readout.clone().unwrap();
    let cold = take(0, &[Source::Dcsn], own_k - 20.0);
    let ratio = readout.hot_pixel_e_per_s(own_k - 20.0) / readout.hot_pixel_e_per_s(own_k);
    let law = ReadOut { dark_current_e_per_s: Some(1.0), ..readout };
    assert!((ratio / law.dark_current_e_per_s(own_k - 20.0) - 1.0).abs() < 1e-12);
    for (warm, cold) in still.samples.iter().zip(&cold.samples).filter(|(warm, _)| **warm < 30_000.0) {
        assert!((f64::from(*cold) / f64::from(*warm) / ratio - 1.0).abs() < 1e-6, "{warm} {cold}");
    }
}

/// The mosaic commutes with noise to the bit, a crop of the noisy frame is the noise of the crop, and neither bands, threads nor
/// instructions change a bit.
#[test]
fn draws_belong_to_places() {
    let light = scene([530, 37], [900.0, 2000.0, 1500.0], tailed);
    for poisson in [PoissonKind::Exact, PoissonKind::Gaussian] {
        let settings = NoiseSettings { seed: 3, sensor_seed: 4, frame: 7, poisson, ..Default::default() };
        let stage = AddNoise::new(&light.header, &settings).unwrap();
        let whole = through(&light, &stage);
        for pattern in CfaPattern::ALL.iter().copied() {
            let plane = through(&light, &Mosaic::new(&light.header, Some(pattern)).unwrap());
            let last = through(&whole, &Mosaic::new(&whole.header, Some(pattern)).unwrap());
            assert_same(&noisy(&plane, &settings), &last, "mosaic and noise");
        }
        for [x, y, width, height] in
            [[0, 0, 530, 37], [3, 5, 300, 20], [129, 1, 70, 36], [513, 30, 17, 7], [64, 0, 1, 1]]
        {
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
        let transferred = noisy(&light, &NoiseSettings { cte: Some(1.0), ..settings });
        for (a, b) in transferred.samples.iter().zip(&whole.samples) {
            assert!((a - b).abs() <= 4.0 * f32::EPSILON * b.abs().max(30_000.0), "{a} {b}");
        }
    }
}

/// Photosites that are neither hot nor have a trap have the noise of a sensor without, to the bit.
#[test]
fn most_photosites_are_as_ever() {
    let with = scene([300, 40], [900.0, 2000.0, 1500.0], tailed);
    let without = scene([300, 40], [900.0, 2000.0, 1500.0], |readout| {
        tailed(readout);
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (0.0, 0.0);
        (readout.rts_share, readout.rts_amplitude_e) = (0.0, 0.0);
    });
    let [with, without] = [with, without].map(|scene| noisy(&scene, &settings(3)));
    let same = with.samples.iter().zip(&without.samples).filter(|(a, b)| a == b).count() as f64;
    let share = same / with.samples.len() as f64;
    // 0.98 (0.95 + 0.05/2) are untouched.
    assert!((share - 0.98 * 0.975).abs() < 0.006, "{share}");
    let text = serde_yaml::to_string(&without.header.metadata).unwrap();
    assert!(!text.contains("hot_pixel") && !text.contains("rts"), "{text}");
}

// --- what is predicted -----------------------------------------------------------------------------------------------

const STAGES: [&str; 8] = ["electrons", "ADU", "CFA plane", "less 3 darks", "BI", "ECI", "MHC", "XYZ"];

fn chain(scene: &MemoryFrame, seed: u64) -> Vec<MemoryFrame> {
    let electrons = noisy(scene, &settings(seed));
    let codes = digitized(&electrons);
    let plane = plane_of(&codes);
    let less = less_darks(&plane, scene, seed, 3);
    let cameras = [Method::Bilinear, Method::EffectiveColor, Method::Malvar].map(|method| demosaicked(&plane, method));
    let xyz = colored(&cameras[1], Space::Xyz);
    [electrons, codes, plane, less].into_iter().chain(cameras).chain([xyz]).collect()
}

/// Even numbers.
pub struct Random(pub u32, pub u32);

impl Random {
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        self.1 += 1;
        let [word, ..] = philox4x32_10([self.1, 0, 0, 0], [self.0, 77]);
        low + (high - low) * f64::from(word) * 2f64.powi(-32)
    }
}

/// A sensor of any kind: tails from a tenth to ten times the other noise, wells that hot pixels fill, converters that they leave,
/// codes coarse and fine.
fn random_sensor(random: &mut Random) -> impl Fn(&mut ReadOut) + use<> {
    let mut log = |low: f64, high: f64| random.within(low.ln(), high.ln()).exp();
    let [current, dcnu, noise, hot, rts, gain, prnu] = [
        log(10.0, 3000.0),
        log(0.02, 0.3),
        log(2.0, 12.0),
        log(300.0, 200_000.0),
        log(2.0, 60.0),
        log(0.25, 1.5),
        log(0.002, 0.02),
    ];
    let [hot_share, rts_share] = [log(0.02, 0.3), log(0.02, 0.5)];
    let kinds = random.within(0.0, 6.0).floor();
    let shared = random.within(0.0, 3.0) < 1.0;
    move |readout: &mut ReadOut| {
        tailed(readout);
        readout.dark_current_e_per_s = Some(current);
        (readout.dcnu, readout.prnu, readout.read_noise_e, readout.adu_per_e) = (dcnu, prnu, noise, gain);
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) =
            if kinds < 1.0 { (0.0, 0.0) } else { (hot_share, hot) };
        (readout.rts_share, readout.rts_amplitude_e) = if kinds == 1.0 { (0.0, 0.0) } else { (rts_share, rts) };
        (readout.full_well_e, readout.bias_adu) = (12_000.0, 600.0);
        if shared {
            (readout.row_noise_e, readout.column_noise_e, readout.prnu_row) = (1.5, 1.0, 0.002);
            // What is shared is predicted where codes follow it as straight lines do.
            (readout.dcnu, readout.read_noise_e) = (dcnu.min(0.15), noise.max(1.0 / gain));
        }
    }
}

/// A seed, and of each stage the subjects of tests and their deviates.
type Trial = (u64, Vec<Vec<(String, f64)>>);

/// Random sensors, each one frame at every stage: deviates of means and variances have rms 1 within 4 standard errors, and none is
/// above 5. CYANOMETER_CAMERAS sets how many sensors.
#[test]
fn moments_are_as_predicted_at_every_stage() {
    let sensors: u64 = std::env::var("CYANOMETER_CAMERAS").map_or(16, |count| count.parse().unwrap());
    let trials: Vec<Trial> = (0..sensors)
        .into_par_iter()
        .map(|seed| {
            let mut random = Random(u32::try_from(seed).unwrap(), 0);
            let levels = [200.0, 900.0, 500.0].map(|level| level * random.within(0.2, 8.0));
            #[expect(clippy::cast_possible_truncation, reason = "samples are single precision")]
            let scene = scene([260, 240], levels.map(|level| level as f32), random_sensor(&mut random));
            let of = |frame: &MemoryFrame| {
                let tests = told(frame).map(|region| region.tests).unwrap_or_default();
                tests.iter().filter_map(|test| test.deviate().map(|z| (format!("{:?}", test.subject), z))).collect()
            };
            (seed, chain(&scene, seed).iter().map(of).collect())
        })
        .collect();
    let mut failures = Vec::new();
    for (stage, name) in STAGES.iter().enumerate() {
        for subject in ["Mean", "Variance"] {
            let mut deviates: Vec<(u64, f64)> = Vec::new();
            for (seed, stages) in &trials {
                let of_stage = stages[stage].iter().filter(|(of, _)| *of == subject);
                deviates.extend(of_stage.map(|(_, z)| (*seed, *z)));
            }
            let n = deviates.len() as f64;
            // Few are refused.
            assert!(n >= 2.0 * sensors as f64, "{name}: {n} of {sensors}");
            let rms = (deviates.iter().map(|(_, z)| z * z).sum::<f64>() / n).sqrt();
            let (worst, most) =
                deviates.iter().fold((0, 0.0_f64), |at, (seed, z)| if z.abs() > at.1.abs() { (*seed, *z) } else { at });
            // Channels that are made of the same photosites, or share rows, are as good as one.
            let apart = if stage < 4 { n } else { n / 3.0 };
            let error = (0.5 / apart).sqrt();
            eprintln!("{name}, {subject}: rms {rms:.3} of {n}, ±{error:.3}; largest {most:.2} of sensor {worst}");
            if (rms - 1.0).abs() > 4.0 * error || most.abs() > 5.0 {
                failures.push(format!("{name}, {subject}: rms {rms}, largest {most} of sensor {worst}"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Codes of four electrons and more, over which neither light nor the mean of seven dark frames scatters by one: both are rounded alike at
/// most photosites, and at those that are hot.
#[test]
fn dark_frames_of_less_than_a_code_are_predicted() {
    let trials: Vec<Vec<(String, f64)>> = (0..12_u64)
        .into_par_iter()
        .map(|seed| {
            let mut random = Random(u32::try_from(seed).unwrap(), 1);
            let [gain, noise_e, hot] =
                [(0.05, 0.25), (0.5, 1.5), (30.0, 3000.0)].map(|(low, high)| random.within(low, high));
            let coarse = |readout: &mut ReadOut| {
                tailed(readout);
                (readout.adu_per_e, readout.read_noise_e, readout.bits) = (gain, noise_e, 12);
                (readout.hot_pixel_dark_current_e_per_s, readout.rts_share, readout.rts_amplitude_e) = (hot, 0.0, 0.0);
            };
            let scene = scene([260, 240], [3.0, 12.0, 7.0], coarse);
            let plane = plane_of(&digitized(&noisy(&scene, &settings(seed))));
            let less = less_darks(&plane, &scene, seed, 7);
            let region = told(&less)
                .unwrap_or_else(|| panic!("{seed}: {}", of_frame(&less.header, Equations::Exact).unwrap_err()));
            region.tests.iter().filter_map(|test| test.deviate().map(|z| (format!("{:?}", test.subject), z))).collect()
        })
        .collect();
    for subject in ["Mean", "Variance"] {
        let of_subject = trials.iter().flatten().filter(|(of, _)| of == subject);
        let deviates: Vec<f64> = of_subject.map(|(_, z)| *z).collect();
        let n = deviates.len() as f64;
        let rms = (deviates.iter().map(|z| z * z).sum::<f64>() / n).sqrt();
        assert!(n >= 24.0 && (rms - 1.0).abs() < 4.0 * (0.5 / n).sqrt(), "{subject}: rms {rms} of {n}: {deviates:?}");
    }
}

/// Frames small and large raise false alarms no more often than the level.
#[test]
fn false_alarms_are_no_more_than_the_level() {
    let rare = |readout: &mut ReadOut| {
        tailed(readout);
        (readout.hot_pixel_share, readout.rts_share) = (0.001, 0.01);
    };
    let cases = [
        ("small", scene([24, 18], [900.0, 2500.0, 1800.0], tailed)),
        ("rare", scene([60, 50], [300.0, 500.0, 400.0], rare)),
        ("large", scene([300, 200], [300.0, 500.0, 400.0], tailed)),
    ];
    for (what, scene) in cases {
        let trials = over_seeds(if what == "large" { 300 } else { 900 }, &[], |seed| chain(&scene, 40_000 + seed));
        for (name, corrected) in STAGES.iter().zip(&trials) {
            judge(&format!("{what}, {name}"), corrected, 0.0);
        }
    }
}

/// A few jumps do not tell how far off samples are that full well or single counts leave off: honest frames raise no alarm, of two
/// samples too that are off at the same place.
#[test]
fn tails_of_other_reasons_are_no_alarm() {
    let few = |full_well_e: f64, amplitude_e: f64| {
        move |readout: &mut ReadOut| {
            readout.dark_current_na_per_cm2 = None;
            readout.dark_current_e_per_s = Some(0.0);
            (readout.dcnu, readout.prnu, readout.read_noise_e) = (0.0, 0.0, 0.01);
            readout.full_well_e = full_well_e;
            (readout.bits, readout.bias_adu, readout.adu_per_e) = (12, 100.0, 0.19);
            (readout.rts_share, readout.rts_amplitude_e) = (1e-4, amplitude_e);
        }
    };
    let cases = [
        ("full well", scene([24, 18], [552.0; 3], few(500.0, 3.0))),
        ("single counts", scene([64, 64], [0.01; 3], few(20_000.0, 0.5))),
    ];
    for (what, scene) in cases {
        for seed in 1..=60 {
            let region = report(&noisy(&scene, &settings(seed)));
            assert!(!region.tests.is_empty() && corrected(&region) > 1e-4, "{what}, {seed}: {:#?}", region.tests);
        }
    }
}

/// Where rare hot photosites make up a covariance, planes that are copies of each other are told all the same.
#[test]
fn copies_are_told_beside_hot_photosites() {
    let rare = |readout: &mut ReadOut| {
        tailed(readout);
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (0.01, 20_000.0);
    };
    // 1600 of them in a plane, enough for the law of a variance; the excess kurtosis of a photosite is 500, that of a product 2.
    const SIZE: [usize; 2] = [440, 360];
    let scene = scene(SIZE, [500.0; 3], rare);
    let honest = noisy(&scene, &settings(3));
    let correlations = |frame: &MemoryFrame| {
        let tests = report(frame).tests.into_iter().filter(|test| test.channels.len() == 2);
        tests.map(|test| test.p).collect::<Vec<_>>()
    };
    assert!(matches!(correlations(&honest)[..], [a, b, c] if a.min(b).min(c) > 0.01), "{:?}", correlations(&honest));
    let mut copied = MemoryFrame::new(honest.header.clone(), honest.samples.clone());
    let [width, _] = SIZE;
    copied.samples.chunks_mut(3 * width).for_each(|row| row.copy_within(width..2 * width, 2 * width));
    // (3 + κ)/z⁴ with z² = 158 400.
    let told = correlations(&copied).iter().filter(|p| **p < 1e-8).count();
    assert_eq!(told, 1, "{:?}", correlations(&copied));
}

/// What is not predicted is refused by name.
#[test]
fn what_is_beyond_is_named() {
    let light = scene([40, 30], [900.0, 2500.0, 1800.0], tailed);
    let electrons = noisy(&light, &settings(1));
    let why = |frame: &MemoryFrame, equations| of_frame(&frame.header, equations).unwrap_err().to_string();
    assert!(why(&electrons, Equations::Paper).contains("the paper has no equations for hot pixels"));
    let plane = plane_of(&digitized(&electrons));
    for method in [Method::SmoothHue, Method::EffectiveColor] {
        let camera = demosaicked(&plane, method);
        let of_camera = of_frame(&camera.header, Equations::Exact);
        assert_eq!(of_camera.is_err(), method == Method::SmoothHue);
        assert!(why(&colored(&camera, Space::Lab), Equations::Exact).contains("reach too far"));
    }
    let transferred = noisy(&light, &NoiseSettings { cte: Some(0.9999), ..settings(1) });
    assert!(why(&transferred, Equations::Exact).contains("charge transfer spreads hot pixels"));
    assert!(at(&electrons, 0, 0, 0).is_finite());
}

/// How fast noise is drawn, of a sensor without tails, with them, and with all that CMOS sensors have, in photosites per µs. Run
/// by `cargo test --test all tails::speed -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn speed() {
    let all = |readout: &mut ReadOut| {
        tailed(readout);
        (readout.hot_pixel_share, readout.rts_share) = (0.001, 0.01);
        (readout.row_noise_e, readout.column_noise_e, readout.dsnu_e) = (1.0, 1.0, 2.0);
        (readout.dsnu_row_e, readout.dsnu_column_e, readout.prnu_row, readout.prnu_column) = (0.5, 1.0, 0.001, 0.001);
    };
    let tails = |readout: &mut ReadOut| {
        all(readout);
        (readout.row_noise_e, readout.column_noise_e, readout.dsnu_e) = (0.0, 0.0, 0.0);
        (readout.dsnu_row_e, readout.dsnu_column_e, readout.prnu_row, readout.prnu_column) = (0.0, 0.0, 0.0, 0.0);
    };
    let none = |readout: &mut ReadOut| {
        tails(readout);
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (0.0, 0.0);
        (readout.rts_share, readout.rts_amplitude_e) = (0.0, 0.0);
    };
    let size = [2048, 1024];
    let level = [900.0, 2000.0, 1500.0];
    let scenes = [scene(size, level, none), scene(size, level, tails), scene(size, level, all)];
    let mut best = [f64::INFINITY; 3];
    for _ in 0..7 {
        for (scene, best) in scenes.iter().zip(&mut best) {
            let stage = AddNoise::new(&scene.header, &settings(1)).unwrap();
            let start = std::time::Instant::now();
            let made = through(scene, &stage);
            *best = best.min(start.elapsed().as_secs_f64());
            assert!(!made.samples.is_empty());
        }
    }
    let rate = best.map(|seconds| (size[0] * size[1] * 3) as f64 / seconds / 1e6);
    eprintln!(
        "none {:.1}, tails {:.1} ({:.0} %), all {:.1} ({:.0} %)",
        rate[0],
        rate[1],
        100.0 * rate[1] / rate[0],
        rate[2],
        100.0 * rate[2] / rate[0]
    );
}
