//! Frames of sensors that are no plain ones, divided by a flat field: they have the noise that is predicted of them.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Region, Saturated, measure};
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::cfa::CfaPattern;
use cyanometer::color::Space;
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FlatRecord, FrameHeader};
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::propagation::covariance::symmetric;
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::propagation::{Equations, of_frame};
use cyanometer::sigma::WithSigma;
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;
use support::alarms::{judge, over_seeds};
use support::chain::{colored, demosaicked};
use support::kit::{Camera, Chance, Kit};
use support::{at, through};

const STAGES: [&str; 7] = ["three planes", "CFA plane", "a region", "BI", "ECI", "MHC", "XYZ"];

/// A seed, and of each stage the subjects of tests and their deviates.
type Trial = (u64, Vec<Vec<(String, f64)>>);

/// A part of a plane.
const PART: Region = Region { x: 21, y: 12, width: 44, height: 32 };

/// A camera, its kit and the exposure of its frames.
struct Bench {
    camera: Camera,
    kit: Kit,
    exposure_s: f64,
    electrons: [f64; 3],
}

/// A camera that `change` makes of a plain one, with darks, flats and darks of these or bias frames, as chance has them.
fn bench(seed: u64, size: [usize; 2], is_plane: bool, change: impl Fn(&mut Chance, &mut ReadOut)) -> Bench {
    let mut chance = Chance(seed);
    for _ in 0..4 {
        chance.next();
    }
    let mut readout = support::readout();
    readout.dark_current_na_per_cm2 = None;
    readout.dark_current_e_per_s = Some(chance.between(20.0, 400.0));
    readout.dcnu = chance.between(0.02, 0.2);
    readout.prnu = chance.between(0.002, 0.02);
    readout.read_noise_e = chance.between(4.0, 12.0);
    readout.bits = 14;
    readout.full_well_e = 60_000.0;
    readout.adu_per_e = chance.between(0.2, 0.3);
    readout.bias_adu = chance.between(500.0, 900.0);
    change(&mut chance, &mut readout);
    let temperature_k = readout.temperature_k;
    let pattern = CfaPattern::ALL[chance.whole(0, 3)];
    let cfa = Some(pattern).filter(|_| is_plane);
    readout.cfa = pattern.into();
    let camera = Camera { readout, size, cfa, seed: 1000 * seed, frames: 0.into() };
    let (exposure_s, flat_s) = (chance.between(0.02, 0.3), chance.between(0.02, 0.2));
    let mut electrons = [(); 3].map(|()| chance.between(300.0, 16_000.0));
    let mut level = [(); 3].map(|()| chance.between(6000.0, 16_000.0));
    if camera.readout.smear_line_s > 0.0 {
        // Columns with red photosites have the smear of those with blue ones.
        (electrons[2], level[2]) = (electrons[0], level[0]);
    }
    let mut kit = Kit::default();
    let mut count = || chance.whole(1, 6);
    let counts = [(); 4].map(|()| count());
    kit.darks = camera.darks(counts[0], exposure_s, temperature_k);
    kit.flats = (0..counts[1]).map(|_| camera.expose(level, flat_s, temperature_k)).collect();
    match seed % 3 {
        // Dark signal stays in the flat field.
        0 => kit.biases = camera.darks(counts[2], 1e-5, temperature_k),
        _ => kit.flat_darks = camera.darks(counts[2], flat_s, temperature_k),
    }
    if seed.is_multiple_of(3) {
        // Of frames that keep theirs too bias frames alone come off.
        kit.darks.clear();
    }
    Bench { camera, kit, exposure_s, electrons }
}

impl Bench {
    fn frame(&self) -> MemoryFrame {
        let temperature_k = self.camera.readout.temperature_k;
        self.kit.correct(&self.camera.expose(self.electrons, self.exposure_s, temperature_k))
    }
}

/// The corrected plane without its layer of marks, where no sample has any.
fn plane(corrected: &MemoryFrame) -> MemoryFrame {
    let mut header = corrected.header.clone();
    header.geometry.channels.pop();
    let [all, ours] = [&corrected.header, &header].map(|header| header.geometry.row_samples());
    let rows = || corrected.samples.chunks_exact(all);
    assert!(rows().all(|row| row[ours..].iter().all(|mark| *mark == 0.0)), "samples are marked");
    MemoryFrame::new(header, rows().flat_map(|row| row[..ours].to_vec()).collect())
}

/// What is said of a frame: subjects of tests and their deviates.
fn told(frame: &MemoryFrame, parts: &[Region]) -> Vec<(String, f64)> {
    if let Err(why) = of_frame(&frame.header, Equations::Exact) {
        eprintln!("nothing predicted: {why}");
        return Vec::new();
    }
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    let report = measure(&mut source, parts, Saturated::Kept, Equations::Exact, Some(0.5)).unwrap();
    let tests = report.regions.into_iter().next().unwrap().tests;
    tests.iter().filter_map(|test| test.deviate().map(|z| (format!("{:?}", test.subject), z))).collect()
}

/// Deviates of means and variances at every stage have mean 0 and rms 1 within 4 standard errors, and none is above 5. CYANOMETER_CAMERAS sets how many
/// cameras.
fn check(most: u64, size: [usize; 2], change: impl Fn(&mut Chance, &mut ReadOut) + Sync) {
    let cameras: u64 = std::env::var("CYANOMETER_CAMERAS").map_or(most, |count| count.parse().unwrap());
    let trials: Vec<Trial> = (1..=cameras)
        .into_par_iter()
        .map(|seed| {
            let [planes, plane] = [false, true].map(|is_plane| plane(&bench(seed, size, is_plane, &change).frame()));
            let methods = [Method::Bilinear, Method::EffectiveColor, Method::Malvar];
            let pixels = methods.map(|method| demosaicked(&plane, method));
            let xyz = colored(&pixels[1], Space::Xyz);
            let first = [told(&planes, &[]), told(&plane, &[]), told(&plane, &[PART])];
            (seed, first.into_iter().chain(pixels.iter().chain([&xyz]).map(|frame| told(frame, &[]))).collect())
        })
        .collect();
    let mut failures = Vec::new();
    for (stage, name) in STAGES.iter().enumerate() {
        for subject in ["Mean", "Variance"] {
            let of = |(seed, stages): &Trial| -> Vec<(u64, f64)> {
                stages[stage].iter().filter(|(of, _)| of == subject).map(|(_, z)| (*seed, *z)).collect()
            };
            let deviates: Vec<(u64, f64)> = trials.iter().flat_map(of).collect();
            let n = deviates.len() as f64;
            let rms = (deviates.iter().map(|(_, z)| z * z).sum::<f64>() / n).sqrt();
            let (worst, most) =
                deviates.iter().fold((0, 0.0_f64), |at, (seed, z)| if z.abs() > at.1.abs() { (*seed, *z) } else { at });
            // Channels that are made of the same photosites are as good as one.
            let error = (0.5 / if stage < 3 { n } else { n / 3.0 }).sqrt();
            let mean = deviates.iter().map(|(_, z)| z).sum::<f64>() / n;
            eprintln!(
                "{name}, {subject}: mean {mean:.3}, rms {rms:.3} of {n}, ±{error:.3}; largest {most:.2} of camera {worst}"
            );
            let is_off = mean.abs() > 4.0 * error * 2.0_f64.sqrt();
            if is_off || n < 2.5 * cameras as f64 || (rms - 1.0).abs() > 4.0 * error || most.abs() > 5.0 {
                failures.push(format!("{name}, {subject}: rms {rms}, largest {most} of camera {worst}"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Hot pixels that make up to half the dark signal, and jumps as large as the read noise.
fn tailed(chance: &mut Chance, readout: &mut ReadOut) {
    let kinds = chance.whole(0, 2);
    if kinds != 0 {
        readout.hot_pixel_share = chance.between(0.005, 0.1);
        readout.hot_pixel_dark_current_e_per_s = chance.between(300.0, 3000.0);
    }
    if kinds != 1 {
        readout.rts_share = chance.between(0.02, 0.3);
        readout.rts_amplitude_e = chance.between(4.0, 40.0);
    }
}

/// Rows and columns whose noise and offsets are as large as what photosites have of their own.
fn noisy_lines(chance: &mut Chance, readout: &mut ReadOut) {
    let mut part = |most: f64| if chance.next() < 0.4 { 0.0 } else { chance.between(0.2 * most, most) };
    (readout.row_noise_e, readout.column_noise_e) = (part(30.0), part(30.0));
    (readout.dsnu_e, readout.dsnu_row_e, readout.dsnu_column_e) = (part(20.0), part(20.0), part(20.0));
    readout.read_noise_e = readout.read_noise_e.max(1.0 / readout.adu_per_e);
}

/// A black level that drifts over few rows or many, beside noise of rows and offsets.
fn drifting(chance: &mut Chance, readout: &mut ReadOut) {
    noisy_lines(chance, readout);
    readout.black_drift_e = chance.between(5.0, 60.0);
    readout.black_drift_rows = 2.0 * 60.0_f64.powf(chance.next());
}

/// Amplifiers that differ in everything, of a sensor of such a size, beside noise of rows and a drift of these, or not.
fn tapped(size: [u32; 2]) -> impl Fn(&mut Chance, &mut ReadOut) + Sync {
    move |chance, readout| {
        match chance.whole(0, 2) {
            0 => {}
            1 => noisy_lines(chance, readout),
            _ => drifting(chance, readout),
        }
        let (layout, count) = [
            (TapLayout::Columns, 2),
            (TapLayout::Columns, 3),
            (TapLayout::LeftRight, 2),
            (TapLayout::TopBottom, 2),
            (TapLayout::Quadrants, 4),
        ][chance.whole(0, 4)];
        let mut some = |low: f64, high: f64| (0..count).map(|_| chance.between(low, high)).collect();
        let least = 1.2 / readout.adu_per_e;
        readout.taps = Some(Taps {
            layout,
            gain: some(0.85, 1.15),
            offset_e: some(-60.0, 60.0),
            read_noise_e: some(least, 3.0 * least),
        });
        (readout.width, readout.height) = (size[0], size[1]);
    }
}

/// Rows and columns whose gains move the level of a frame by more than all of its noise.
fn gained_lines(chance: &mut Chance, readout: &mut ReadOut) {
    (readout.prnu_row, readout.prnu_column) = (chance.between(0.002, 0.006), chance.between(0.002, 0.006));
    // Of half of the cameras nothing is left in rows and columns.
    if chance.next() < 0.5 {
        (readout.row_noise_e, readout.dsnu_column_e) = (chance.between(0.0, 5.0), chance.between(0.0, 5.0));
    }
}

/// The standard deviations of pixels of a layer are those that are predicted of them on the mean. Levels of pixels scatter by a tenth, their
/// standard deviations by a twentieth.
#[test]
fn layers_of_sigma_are_as_predicted() {
    let briefly = |chance: &mut Chance, readout: &mut ReadOut| {
        noisy_lines(chance, readout);
        (readout.black_drift_e, readout.black_drift_rows) = (chance.between(5.0, 40.0), 2.0);
    };
    let changes: [fn(&mut Chance, &mut ReadOut); 3] = [tailed, noisy_lines, briefly];
    let mut told = 0;
    for (seed, change) in (1..=2).flat_map(|seed| changes.map(|change| (seed, change))) {
        let plane = plane(&bench(seed, [60, 48], true, change).frame());
        for method in [Method::Bilinear, Method::Malvar] {
            let stage = Demosaic::new(&plane.header, method, Black::Auto, None).unwrap();
            let mut made = through(&plane, &WithSigma::of_demosaicking(stage).unwrap());
            let report = measure(&mut made, &[], Saturated::Kept, Equations::Exact, None).unwrap();
            let channels = &report.regions[0].channels;
            for k in 0..3 {
                let sigma = channels[3 + k].mean.unwrap().hypot(channels[3 + k].std.unwrap());
                let Some(predicted) = channels[k].predicted_std else { continue };
                told += 1;
                assert!((sigma / predicted - 1.0).abs() < 0.04, "{seed} {method:?} {k}: {sigma} {predicted}");
            }
        }
    }
    assert!(told >= 27, "{told}");
}

/// What is not predicted is refused by name.
#[test]
fn what_is_beyond_is_named() {
    let why = |size: [usize; 2], change: &dyn Fn(&mut ReadOut), after: &dyn Fn(&mut MemoryFrame)| {
        let mut frame = bench(1, size, true, |_, readout| change(readout)).frame();
        after(&mut frame);
        let whole = FrameHeader { geometry: Geometry::new(size[0], size[1], &["Y"]), ..frame.header };
        of_frame(&whole, Equations::Exact).map_or_else(|why| why.to_string(), |_| "predicted".to_owned())
    };
    let as_it_is = |_: &mut MemoryFrame| ();
    let rows = |readout: &mut ReadOut| readout.row_noise_e = 5.0;
    assert_eq!(why([20, 16], &rows, &as_it_is), "predicted");
    let before = |frame: &mut MemoryFrame| {
        frame.header.metadata.correction.as_mut().unwrap().flat.as_mut().unwrap().cell_lines = None;
    };
    let unrecorded = why([20, 16], &rows, &before);
    assert!(unrecorded.contains("correct the frame anew"), "{unrecorded}");
    let drift = |readout: &mut ReadOut| (readout.black_drift_e, readout.black_drift_rows) = (3.0, 20.0);
    assert_eq!(why([20, 16], &drift, &as_it_is), "predicted");
    let flat = |frame: &mut MemoryFrame, change: fn(&mut FlatRecord)| {
        change(frame.header.metadata.correction.as_mut().unwrap().flat.as_mut().unwrap());
    };
    let unplaced = why([20, 16], &drift, &|frame| flat(frame, |flat| flat.area = None));
    assert!(unplaced.contains("correct the frame anew"), "{unplaced}");
    let uneven = why([20, 16], &drift, &|frame| flat(frame, |flat| flat.cell_lines = Some([7.5, 10.0])));
    assert!(uneven.contains("so many photosites are defective"), "{uneven}");
    let gains = |readout: &mut ReadOut| (readout.prnu_column, readout.read_noise_e) = (0.05, 200.0);
    let by_gains = why([20, 200], &gains, &as_it_is);
    assert!(by_gains.contains("differ so much in response"), "{by_gains}");
    let hot = |readout: &mut ReadOut| {
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (0.01, 1e5);
    };
    let by_wells = why([20, 16], &hot, &as_it_is);
    assert!(by_wells.contains("fill up or go beyond the codes"), "{by_wells}");
}

#[test]
fn noise_of_rows_and_columns_is_predicted() {
    check(8, [120, 100], noisy_lines);
}

#[test]
fn drifts_are_predicted() {
    check(8, [70, 50], drifting);
}

/// Checks call frames wrong as often as the level says, of few rows and of the whole frame, by smooth hue transition too.
#[test]
fn drifts_raise_false_alarms_at_the_stated_rate() {
    let parts = [Region { x: 0, y: 0, width: 26, height: 20 }, Region { x: 3, y: 5, width: 19, height: 12 }];
    let made = |seed: u64| {
        let [planes, plane] =
            [false, true].map(|is_plane| plane(&bench(seed + 1, [26, 20], is_plane, drifting).frame()));
        let [hue, pixels] = [Method::SmoothHue, Method::Malvar].map(|method| demosaicked(&plane, method));
        let xyz = colored(&pixels, Space::Xyz);
        vec![planes, plane, hue, pixels, xyz]
    };
    for (index, corrected) in over_seeds(60, &parts, made).iter().enumerate() {
        judge(&format!("drifts over flats, {index}"), corrected, 0.0);
    }
}

/// Standard deviations beside pixels against the scatter of as many cameras: chi-square of all but one.
#[test]
fn sigma_of_drifts_covers() {
    let places = [[0, 0], [7, 1], [8, 8], [3, 13], [16, 15]];
    let halves = |layout, count: usize| Taps {
        layout,
        gain: vec![1.0, 1.08, 0.93, 1.04][..count].to_vec(),
        offset_e: vec![3.0, -20.0, 11.0, 0.0][..count].to_vec(),
        read_noise_e: vec![8.0, 14.0, 25.0, 6.0][..count].to_vec(),
    };
    let cases = [
        (3.0, None),
        (11.0, None),
        (60.0, None),
        (11.0, Some(halves(TapLayout::Columns, 3))),
        (60.0, Some(halves(TapLayout::Quadrants, 4))),
    ];
    for (rows, taps) in cases {
        let drift = |readout: &mut ReadOut| {
            (readout.dcnu, readout.prnu, readout.read_noise_e) = (0.05, 0.005, 8.0);
            (readout.black_drift_e, readout.black_drift_rows) = (60.0, rows);
            (readout.width, readout.height, readout.taps) = (18, 16, taps.clone());
        };
        let electrons = [3000.0, 9000.0, 5000.0];
        let made = |seed: u64| {
            let mut readout = support::readout();
            (readout.bits, readout.full_well_e, readout.adu_per_e, readout.bias_adu) = (14, 60_000.0, 0.25, 700.0);
            drift(&mut readout);
            let camera =
                Camera { readout, size: [18, 16], cfa: Some(CfaPattern::Grbg), seed: 7 * seed, frames: 0.into() };
            let (exposure_s, temperature_k) = (0.02, camera.readout.temperature_k);
            let darks = camera.darks(2, exposure_s, temperature_k);
            let flats = (0..2).map(|_| camera.expose([9000.0, 12_000.0, 7000.0], exposure_s, temperature_k)).collect();
            let kit = Kit { flat_darks: darks.clone(), darks, flats, ..Kit::default() };
            demosaicked(&plane(&kit.correct(&camera.expose(electrons, exposure_s, temperature_k))), Method::Bilinear)
        };
        let cameras = 300;
        let all: Vec<MemoryFrame> = (1..=cameras).into_par_iter().map(made).collect();
        let noise = PixelNoise::of(&all[0].header).unwrap();
        let mut smallest = 1.0_f64;
        for [x, y] in places {
            let of = |c: usize| all.iter().map(move |frame| f64::from(at(frame, x, y, c)));
            let n = cameras as f64;
            let means = [0, 1, 2].map(|c| of(c).sum::<f64>() / n);
            let predicted = symmetric(&noise.covariance([x, y], means).0);
            for c in 0..3 {
                let square: f64 = of(c).map(|sample| (sample - means[c]).powi(2)).sum();
                let p = of_chi_square(square / predicted[(c, c)], n - 1.0);
                eprintln!("{rows} {x} {y} {c}: {:.3}, p {p:.1e}", square / (n - 1.0) / predicted[(c, c)]);
                smallest = smallest.min(p);
            }
        }
        assert!(of_smallest(smallest, 3 * places.len()) > 1e-4, "{rows}: {smallest}");
    }
}

#[test]
fn taps_are_predicted() {
    check(10, [70, 50], tapped([70, 50]));
}

/// So do frames of several amplifiers, of their parts behind one and behind all.
#[test]
fn taps_raise_false_alarms_at_the_stated_rate() {
    let parts = [
        Region { x: 0, y: 0, width: 26, height: 20 },
        Region { x: 3, y: 5, width: 19, height: 12 },
        Region { x: 1, y: 1, width: 9, height: 7 },
    ];
    let change = tapped([26, 20]);
    let made = |seed: u64| {
        let [planes, plane] =
            [false, true].map(|is_plane| plane(&bench(seed + 1, [26, 20], is_plane, &change).frame()));
        let [hue, pixels] = [Method::SmoothHue, Method::Malvar].map(|method| demosaicked(&plane, method));
        let xyz = colored(&pixels, Space::Xyz);
        vec![planes, plane, hue, pixels, xyz]
    };
    for (index, corrected) in over_seeds(60, &parts, made).iter().enumerate() {
        judge(&format!("taps over flats, {index}"), corrected, 0.0);
    }
}

#[test]
fn gains_of_rows_and_columns_are_predicted() {
    check(8, [120, 100], gained_lines);
}

/// Smear of up to a tenth of the light.
#[test]
fn smear_is_predicted() {
    check(6, [120, 100], |chance, readout| readout.smear_line_s = chance.between(2e-7, 1e-6));
}

#[test]
fn hot_pixels_and_jumps_are_predicted() {
    check(12, [120, 100], tailed);
}
