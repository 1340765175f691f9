//! Corrected frames have the noise that is predicted of them, whatever they were corrected by.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Saturated, measure};
use cyanometer::camera::linearity::Linearization;
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::CfaPattern;
use cyanometer::frame::Geometry;
use cyanometer::metadata::FrameHeader;
use cyanometer::numerics::averages::Combine;
use cyanometer::propagation::Equations;
use cyanometer::sigma::WithSigma;
use cyanometer::stages::black::Black;
use cyanometer::stages::darks::DarkSettings;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::masters::Averaging;
use cyanometer::stages::saturation::WithMask;
use cyanometer::stream::MemoryFrame;
use support::kit::{Camera, Chance, Kit, classes};
use support::through;

/// A camera and a chain of corrections as chance has them, and the corrected frame.
#[allow(clippy::too_many_lines, reason = "a camera and its frames, setting after setting")]
fn chain(seed: u64) -> (String, MemoryFrame) {
    let mut chance = Chance(seed);
    for _ in 0..4 {
        chance.next();
    }
    let mut readout = support::readout();
    readout.dcnu = [0.0, chance.between(0.02, 0.3)][chance.whole(0, 1)];
    readout.prnu = chance.between(0.0, 0.03);
    readout.read_noise_e = chance.between(8.0, 30.0);
    readout.bits = 14;
    readout.adu_per_e = chance.between(0.15, 0.3);
    readout.bias_adu = chance.between(200.0, 900.0);
    // Every third camera is not straight, by up to a twentieth at the top of its codes; numbers of their own leave the others.
    if seed.is_multiple_of(3) {
        let [bend, sway] = [(); 2].map(|()| Chance(chance.0 ^ 1).between(-0.05, 0.05) / 16_384.0);
        readout.linearization = Some(Linearization::polynomial(vec![1.0, bend, sway / 16_384.0]).unwrap());
    }
    let cfa = (chance.next() < 0.7).then_some(CfaPattern::ALL[chance.whole(0, 3)]);
    let camera = Camera { readout, size: [90, 70], cfa, seed: 1000 * seed, frames: 0.into() };
    let (exposure_s, temperature_k) = (chance.between(0.02, 0.2), chance.between(310.0, 335.0));
    let electrons = [(); 3].map(|()| chance.between(100.0, 20_000.0));
    let combine = [Combine::Mean, Combine::Median, Combine::Clipped][chance.whole(0, 2)];
    let averaging = Averaging { combine, clip: chance.between(1.6, 3.5) };
    let is_scaled = chance.next() < 0.5;
    let has_flats = chance.next() < 0.75;
    let count = |chance: &mut Chance| chance.whole(1, 9);
    let mut kit = Kit { settings: DarkSettings { averaging, is_scaled }, ..Default::default() };
    let mut said = format!("{seed}: {averaging:?}, scaled {is_scaled}, {:?}", camera.cfa);
    let darks = count(&mut chance);
    if is_scaled {
        let factor = chance.between(0.3, 3.0);
        let at_k = temperature_k + chance.between(-5.0, 5.0);
        kit.darks = camera.darks(darks, factor * exposure_s, at_k);
        match chance.whole(0, 2) {
            0 => {
                let n = count(&mut chance);
                kit.biases = camera.darks(n, 1e-4, temperature_k);
            }
            1 => {
                let n = count(&mut chance);
                kit.darks.extend(camera.darks(n, exposure_s * if factor > 1.0 { 0.4 } else { 2.5 }, temperature_k));
            }
            _ => {}
        }
        said += &format!(", {darks} darks of {factor}, {} biases", kit.biases.len());
    } else if chance.next() < 0.2 {
        kit.black = Some(Black::Auto);
        said += ", black";
    } else if chance.next() < 0.85 {
        kit.darks = camera.darks(darks, exposure_s, temperature_k);
        said += &format!(", {darks} darks");
    } else {
        kit.biases = camera.darks(darks, 1e-4, temperature_k);
        said += &format!(", {darks} biases");
    }
    if has_flats {
        let (flats, flat_s) = (count(&mut chance), chance.between(0.01, 0.1));
        let level = [(); 3].map(|()| chance.between(6000.0, 20_000.0));
        kit.flats = (0..flats).map(|_| camera.expose(level, flat_s, temperature_k)).collect();
        said += &format!(", {flats} flats");
        if chance.next() < 0.7 {
            let n = count(&mut chance);
            kit.flat_darks = camera.darks(n, flat_s, temperature_k);
            said += &format!(", {n} flat darks");
        }
    }
    let defects = chance.whole(0, 60);
    kit.defects = (0..defects).map(|_| [chance.whole(0, 69), chance.whole(0, 89)]).collect();
    let frame = camera.expose(electrons, exposure_s, temperature_k);
    (said, kit.correct(&frame))
}

/// A camera of little noise or none, whose dark frames, their means or medians, show how codes are rounded.
fn quiet(seed: u64) -> (String, MemoryFrame) {
    let mut chance = Chance(seed);
    for _ in 0..4 {
        chance.next();
    }
    let mut readout = support::readout();
    readout.dcnu = [0.0, chance.between(0.02, 0.3), chance.between(0.1, 1.0)][chance.whole(0, 2)];
    readout.prnu = [0.0, chance.between(0.0, 0.03)][chance.whole(0, 1)];
    readout.read_noise_e = [0.0, chance.between(0.2, 9.0)][usize::from(chance.next() < 0.7)];
    readout.bits = 14;
    readout.adu_per_e = chance.between(0.01, 0.2);
    readout.bias_adu = chance.between(200.0, 900.0);
    if seed.is_multiple_of(5) {
        let bend = chance.between(-0.05, 0.05) / 16_384.0;
        readout.linearization = Some(Linearization::polynomial(vec![1.0, bend]).unwrap());
    }
    let camera = Camera { readout, size: [90, 70], cfa: None, seed: 1000 * seed, frames: 0.into() };
    let (exposure_s, temperature_k) = (chance.between(0.002, 0.05), chance.between(290.0, 325.0));
    // Light that scatters, or next to none.
    let electrons = [0.0, chance.between(0.0, 30.0), chance.between(100.0, 20_000.0)];
    let combine = [Combine::Mean, Combine::Median][chance.whole(0, 1)];
    let averaging = Averaging { combine, ..Default::default() };
    let is_scaled = chance.next() < 0.5;
    let count = [chance.whole(1, 5), chance.whole(3, 40)][chance.whole(0, 1)];
    let dark_s = exposure_s * if is_scaled { chance.between(0.3, 3.0) } else { 1.0 };
    let kit = Kit {
        darks: camera.darks(count, dark_s, temperature_k),
        biases: camera.darks(if is_scaled { chance.whole(1, 9) } else { 0 }, 1e-5, temperature_k),
        settings: DarkSettings { averaging, is_scaled },
        ..Default::default()
    };
    let ReadOut { read_noise_e, adu_per_e, dcnu, .. } = &camera.readout;
    let said =
        format!("{seed}: {combine:?} of {count}, scaled {is_scaled}, {read_noise_e} e- {adu_per_e} ADU/e- {dcnu}");
    (said, kit.correct(&camera.expose(electrons, exposure_s, temperature_k)))
}

/// Flat fields that keep dark signal of strong patterns, as nothing or bias frames alone came off them.
fn dark_flats(seed: u64) -> (String, MemoryFrame) {
    let mut chance = Chance(seed);
    for _ in 0..4 {
        chance.next();
    }
    let mut readout = support::readout();
    readout.dcnu = chance.between(0.2, 0.4);
    readout.prnu = chance.between(0.0, 0.006);
    readout.read_noise_e = chance.between(8.0, 30.0);
    readout.bits = 14;
    readout.adu_per_e = chance.between(0.15, 0.3);
    readout.bias_adu = 400.0;
    readout.full_well_e = 60_000.0;
    let camera = Camera { readout, size: [90, 70], cfa: None, seed: 1000 * seed, frames: 0.into() };
    let temperature_k = chance.between(345.0, 358.0);
    let (exposure_s, flat_s) = (chance.between(0.02, 0.2), chance.between(0.1, 0.25));
    let (flats, darks, biases) = (chance.whole(1, 9), chance.whole(1, 9), chance.whole(1, 9));
    let level = [(); 3].map(|()| chance.between(4000.0, 20_000.0));
    let has_darks = chance.next() < 0.5;
    let kit = Kit {
        darks: camera.darks(if has_darks { darks } else { 0 }, exposure_s, temperature_k),
        biases: camera.darks(if has_darks { 0 } else { biases }, 1e-5, temperature_k),
        flats: (0..flats).map(|_| camera.expose(level, flat_s, temperature_k)).collect(),
        ..Default::default()
    };
    let electrons = [(); 3].map(|()| chance.between(100.0, 20_000.0));
    let said =
        format!("{seed}: {flats} flats of {level:?}, darks {has_darks}, {temperature_k} K {exposure_s} {flat_s} s");
    (said, kit.correct(&camera.expose(electrons, exposure_s, temperature_k)))
}

/// z scores of means and standard deviations of all classes over so many chains: they are normal numbers where predictions hold,
/// the largest of 1200 of which exceeds 5 in one of 1500 cases, and the rms of which is 1 to within 1/√2400 = 0.02, four
/// times of which is allowed.
fn check(seeds: std::ops::RangeInclusive<u64>, chain: fn(u64) -> (String, MemoryFrame)) {
    let (mut square, mut count) = ([0.0; 2], 0.0);
    let mut worst = (0.0, String::new());
    for seed in seeds {
        let (said, corrected) = chain(seed);
        for class in classes(&corrected) {
            let z = [class.z_mean.unwrap(), class.z_std.unwrap()];
            if std::env::var("SHOW").is_ok() && z.iter().any(|z| z.abs() > 3.0) {
                eprintln!("{said}: {z:?} {class:?}");
            }
            for (square, z) in square.iter_mut().zip(z) {
                *square += z * z;
                if z.abs() > worst.0 {
                    worst = (z.abs(), format!("{said}: {class:?}"));
                }
            }
            count += 1.0;
        }
    }
    let rms = square.map(|square: f64| (square / count).sqrt());
    if std::env::var("SHOW").is_ok() {
        eprintln!("rms {rms:?} over {count}; worst {worst:?}");
    }
    let tolerance = 4.0 / (2.0_f64 * count).sqrt();
    assert!(rms.iter().all(|rms| (rms - 1.0).abs() < tolerance), "rms {rms:?} over {count}; worst {worst:?}");
    assert!(worst.0 < 5.0, "rms {rms:?}; {worst:?}");
}

#[test]
fn corrected_frames_have_the_noise_that_is_predicted() {
    check(1..=200, chain);
}

#[test]
fn codes_of_little_noise_are_predicted() {
    check(1..=60, quiet);
}

/// A camera of 240 x 180 photosites that has such a dark signal in a second, and the frame of a second that is corrected by so many dark ones.
fn less_darks(readout: ReadOut, light: [f64; 3], frames: usize, combine: Combine) -> MemoryFrame {
    let temperature_k = readout.temperature_k;
    let camera = Camera { readout, size: [240, 180], cfa: Some(CfaPattern::Rggb), seed: 77, frames: 0.into() };
    let averaging = Averaging { combine, ..Default::default() };
    let kit = Kit {
        darks: camera.darks(frames, 1.0, temperature_k),
        settings: DarkSettings { averaging, is_scaled: false },
        ..Default::default()
    };
    kit.correct(&camera.expose(light, 1.0, temperature_k))
}

/// The mean and the spread of all classes are within 5 standard errors.
fn is_as_predicted(what: &str, frame: &MemoryFrame) {
    for class in classes(frame) {
        let z = [class.z_mean.unwrap(), class.z_std.unwrap()];
        assert!(z.iter().all(|z| z.abs() < 5.0), "{what}: {z:?} {class:?}");
    }
}

/// Dark frames a part of whose samples is code 0: their medians are those of what is cut off, and clipped means are not told.
#[test]
fn medians_of_dark_frames_that_code_0_cuts_off_are_predicted() {
    let readout = |bias_adu: f64| ReadOut {
        full_well_e: 3800.0,
        dark_current_na_per_cm2: None,
        dark_current_e_per_s: Some(1.0),
        dcnu: 0.1,
        prnu: 0.01,
        read_noise_e: 2.3,
        bits: 12,
        bias_adu,
        adu_per_e: 1.0,
        ..support::readout()
    };
    for (bias_adu, frames) in [(0.0, 8), (0.0, 7), (1.0, 8), (1.0, 3), (2.0, 7), (4.0, 8)] {
        let corrected = less_darks(readout(bias_adu), [40.0, 60.0, 50.0], frames, Combine::Median);
        is_as_predicted(&format!("median of {frames} above {bias_adu}"), &corrected);
    }
    let mut clipped = less_darks(readout(1.0), [40.0, 60.0, 50.0], 8, Combine::Clipped);
    let report = measure(&mut clipped, &[], Saturated::LeftOut, Equations::Exact, None).unwrap();
    let why = report.unpredicted.unwrap().to_string();
    assert!(why.contains("an end of the codes cuts off the dark or bias frames"), "{why}");
}

/// A pattern of the dark current that goes over many codes, and knots of a table of codes: what dark frames leave of it is a small
/// difference.
#[test]
fn tables_behind_wide_patterns_are_predicted() {
    let codes = [0.0, 648.0, 1296.0, 1944.0, 2591.0, 3239.0, 3887.0];
    let linear = [0.0, 622.36, 1289.77, 1916.01, 2588.58, 3218.16, 3888.41];
    for (dark_e, dcnu) in [(5000.0, 0.26), (5000.0, 0.1), (3000.0, 0.26)] {
        let readout = ReadOut {
            full_well_e: 52_000.0,
            dark_current_na_per_cm2: None,
            dark_current_e_per_s: Some(dark_e),
            dcnu,
            prnu: 0.01,
            read_noise_e: 15.0,
            bits: 12,
            bias_adu: 208.0,
            adu_per_e: 0.0674,
            linearization: Some(Linearization::table(codes.to_vec(), linear.to_vec()).unwrap()),
            ..support::readout()
        };
        let corrected = less_darks(readout, [26_000.0, 18_000.0, 10_400.0], 4, Combine::Mean);
        is_as_predicted(&format!("{dark_e} e- of {dcnu}"), &corrected);
    }
}

#[test]
fn flat_fields_may_keep_their_dark_signal() {
    check(1..=60, dark_flats);
}

/// Means of a few photosites share the noise of the mean of the flat field that they are divided by, as far as they are of cells whose
/// photosites are all good: of 5 x 3 photosites two cells are counted, of 15 x 11 with defects two thirds of the photosites or less. Of
/// 100 frames of three classes the rms of z is 1 within 0.04, four times of which is allowed; as if all were counted, variances of means
/// fall below 0.
#[test]
fn means_share_the_noise_of_the_flat_that_they_count_in() {
    for (size, defects) in [([5, 3], 0), ([15, 11], 25)] {
        let mut sum = [0.0; 3];
        for seed in 1..=100_u64 {
            let mut chance = Chance(seed);
            let readout = ReadOut { prnu: 0.0, dcnu: 0.0, adu_per_e: 0.2, bits: 14, ..support::readout() };
            let cfa = Some(CfaPattern::ALL[chance.whole(0, 3)]);
            let camera = Camera { readout, size, cfa, seed: 1000 * seed, frames: 0.into() };
            let place = |chance: &mut Chance| [chance.whole(0, size[1] - 1), chance.whole(0, size[0] - 1)];
            let kit = Kit {
                darks: camera.darks(4, 0.02, 300.0),
                flats: vec![camera.expose([9000.0; 3], 0.02, 300.0)],
                flat_darks: camera.darks(4, 0.02, 300.0),
                defects: (0..defects).map(|_| place(&mut chance)).collect(),
                ..Default::default()
            };
            let mut corrected = kit.correct(&camera.expose([16_000.0; 3], 0.02, 300.0));
            for class in classes(&corrected) {
                sum[0] += class.z_mean.unwrap().powi(2);
                sum[1] += 1.0;
            }
            correction(&mut corrected.header).flat.as_mut().unwrap().left_out.clear();
            for class in classes(&corrected) {
                sum[2] += class.z_mean.unwrap().powi(2);
            }
        }
        let [rms, of_all] = [sum[0], sum[2]].map(|square: f64| (square / sum[1]).sqrt());
        let tolerance = 4.0 / (2.0 * sum[1]).sqrt();
        assert!((rms - 1.0).abs() < tolerance, "{size:?}: {rms}");
        assert!(of_all.is_nan() || (of_all - 1.0).abs() > tolerance, "{size:?}: {of_all}");
    }
}

/// A camera with a strong pattern of the response, and a kit of five darks and four flats with three darks of their own.
fn strong() -> (Camera, Kit) {
    let readout = ReadOut { prnu: 0.02, dcnu: 0.2, adu_per_e: 0.2, bits: 14, bias_adu: 400.0, ..support::readout() };
    let camera = Camera { readout, size: [240, 200], cfa: Some(CfaPattern::Rggb), seed: 77, frames: 0.into() };
    let kit = Kit {
        darks: camera.darks(5, 0.05, 330.0),
        flats: (0..4).map(|_| camera.expose([9000.0, 16_000.0, 12_000.0], 0.03, 330.0)).collect(),
        flat_darks: camera.darks(3, 0.03, 330.0),
        defects: (0..40).map(|i| [5 * i % 200, 7 * i % 240]).collect(),
        ..Default::default()
    };
    (camera, kit)
}

/// What the record is wrong about is seen: of a flat field of so many frames more, or darks that were scaled otherwise.
#[test]
fn wrong_records_are_seen() {
    let (camera, kit) = strong();
    let corrected = kit.correct(&camera.expose([9000.0, 16_000.0, 12_000.0], 0.05, 330.0));
    let largest = |frame: &MemoryFrame| {
        let z = classes(frame).into_iter().flat_map(|class| [class.z_mean.unwrap(), class.z_std.unwrap()]);
        z.fold(0.0_f64, |most, z| most.max(z.abs()))
    };
    assert!(largest(&corrected) < 4.5, "{}", largest(&corrected));
    type Change = fn(&mut FrameHeader);
    let changes: [(Change, f64); 4] = [
        // A fifth of the variance is that of the flat field.
        (|head| correction(head).flat.as_mut().unwrap().average.frames = 8, 6.0),
        // The median of four keeps 0.298 of a variance, their mean 0.25.
        (|head| correction(head).flat.as_mut().unwrap().average.combine = Combine::Median, 3.5),
        (|head| correction(head).masters[0].weight = 0.9, 6.0),
        (|head| correction(head).flat = None, 6.0),
    ];
    for (index, (change, least)) in changes.into_iter().enumerate() {
        let mut wrong = corrected.clone();
        change(&mut wrong.header);
        assert!(largest(&wrong) > least, "{index}: {}", largest(&wrong));
    }
}

fn correction(head: &mut FrameHeader) -> &mut cyanometer::metadata::CorrectionRecord {
    head.metadata.correction.as_mut().unwrap()
}

/// Behind demosaicking predictions hold, marked pixels left out; and the layer of standard deviations, whose mean square is the
/// temporal variance, is what pixels scatter by about the scene.
#[test]
fn demosaicked_frames_have_the_noise_that_is_predicted() {
    let (camera, kit) = strong();
    let corrected = kit.correct(&camera.expose([2000.0, 9000.0, 5000.0], 0.05, 330.0));
    for method in [Method::Bilinear, Method::EffectiveColor, Method::Malvar] {
        let mut plane = corrected.header.clone();
        plane.geometry.channels.truncate(1);
        let demosaic = Demosaic::new(&plane, method, Black::Auto, None).unwrap();
        let stage = WithSigma::of_demosaicking(demosaic).unwrap();
        let masked = WithMask::new(&stage);
        let mut made = through(&corrected, &masked);
        made.header.metadata.history = corrected.header.metadata.history.clone();
        let mut source = MemoryFrame::new(made.header.clone(), made.samples.clone());
        let report = measure(&mut source, &[], Saturated::LeftOut, Equations::Exact, None).unwrap();
        let region = &report.regions[0];
        for channel in &region.channels[..3] {
            let z = [channel.z_mean.unwrap(), channel.z_std.unwrap()];
            // Six numbers, each beyond 4.5 in one of 150 000 cases; the correlations of neighbors widen that of std.
            assert!(z[0].abs() < 4.5 && z[1].abs() < 9.0, "{method:?}: {channel:?}");
        }
        assert!(region.corrected > 40 && region.not_finite == 0, "{region:?}");
        for k in 0..3 {
            let (pixel, sigma) = (&region.channels[k], &region.channels[3 + k]);
            let ratio = sigma.mean.unwrap().hypot(sigma.std.unwrap()) / pixel.std.unwrap();
            // Levels of pixels scatter by a tenth, their standard deviations by a twentieth; phases differ by more.
            assert!((ratio - 1.0).abs() < 0.04, "{method:?} {k}: {ratio}");
            assert!(sigma.max.unwrap().is_finite());
        }
        let infinite = made.samples.iter().filter(|sample| sample.is_infinite()).count() as u64;
        assert_eq!(infinite, 3 * region.corrected.max(region.defective));
    }
}

/// A camera of little noise and next to no dark signal.
fn quiet_camera(prnu: f64, read_noise_e: f64) -> Camera {
    let noise = ReadOut { prnu, dcnu: 0.0, read_noise_e, ..support::readout() };
    let readout = ReadOut { adu_per_e: 1.0, bits: 14, bias_adu: 400.0, ..noise };
    Camera { readout, size: [240, 200], cfa: Some(CfaPattern::Rggb), seed: 5, frames: 0.into() }
}

/// The root mean square of the standard deviations of green, and its scatter, of a corrected plane.
fn green(plane: &MemoryFrame, header: FrameHeader) -> Result<[f64; 2], String> {
    let demosaic = Demosaic::new(&header, Method::Bilinear, Black::Auto, None).unwrap();
    let stage = WithSigma::of_demosaicking(demosaic).map_err(|error| error.to_string())?;
    let source = MemoryFrame::new(header, plane.samples.clone());
    let mut made = through(&source, &stage);
    let report = measure(&mut made, &[], Saturated::Kept, Equations::Exact, None).unwrap();
    let channels = &report.regions[0].channels;
    Ok([channels[4].mean.unwrap().hypot(channels[4].std.unwrap()), channels[1].std.unwrap()])
}

/// Light of 3000 e⁻ over flats of 30 e⁻ and a read noise of 6 e⁻: their noise, relative variance ρ = 0.073 of one, is all there is. Of
/// two and more the standard deviations of pixels hold, of one they are refused; predictions say that it is the noise of the flat field.
#[test]
fn dim_flat_fields_are_followed_or_refused() {
    let camera = quiet_camera(0.01, 6.0);
    for count in [1, 2, 4] {
        let kit = Kit {
            biases: camera.darks(16, 1e-6, 260.0),
            flats: (0..count).map(|_| camera.expose([30.0; 3], 1e-6, 260.0)).collect(),
            ..Default::default()
        };
        let corrected = kit.correct(&camera.expose([3000.0; 3], 1e-6, 260.0));
        let mut source = MemoryFrame::new(corrected.header.clone(), corrected.samples.clone());
        let report = measure(&mut source, &[], Saturated::LeftOut, Equations::Exact, None).unwrap();
        assert!(report.unpredicted.is_some_and(|why| why.to_string().starts_with("the flat field is so noisy")));
        let mut header = corrected.header.clone();
        header.geometry.channels.truncate(1);
        let width = header.geometry.width;
        let samples = corrected.samples.chunks_exact(2 * width).flat_map(|rows| rows[..width].to_vec()).collect();
        match green(&MemoryFrame::new(header.clone(), samples), header) {
            Err(why) => assert!(count == 1 && why.contains("the flat field is so noisy"), "{count}: {why}"),
            // Levels of pixels scatter by √ρ, so that the mean square of their deviations is larger by ρ, 4 % of two.
            Ok([sigma, std]) => assert!(count > 1 && (sigma / std - 1.0).abs() < 0.04, "{count}: {sigma} {std}"),
        }
    }
}

/// Of a camera's frame, that records no noise, what no light reads is that of its sensor where the black level is a little off.
#[test]
fn black_levels_a_little_below_the_bias_are_no_light() {
    let camera = quiet_camera(0.01, 2.0);
    let plane = camera.expose([2.0; 3], 1e-6, 260.0);
    for black_adu in [397.0, 398.0, 399.0, 400.0] {
        let mut header = plane.header.clone();
        (header.metadata.noise, header.metadata.scene, header.metadata.adc) = (None, None, None);
        header.metadata.set_black_adu(Some(black_adu.into()));
        let [sigma, std] = green(&plane, header).unwrap();
        // 48 000 pixels, of which half are sums of four: 0.5 %. Three electrons more would be 25 % of the variance.
        assert!((sigma / std - 1.0).abs() < 0.03, "{black_adu}: {sigma} {std}");
    }
}

/// Rows may be asked for in any steps, and made on any threads: not a bit changes. A crop is corrected as the whole is,
/// where nothing hangs on means over the frame.
#[test]
fn threads_and_crops_change_nothing() {
    let (camera, mut kit) = strong();
    kit.settings.averaging = Averaging { combine: Combine::Clipped, clip: 1.2 };
    let frame = camera.expose([2000.0, 9000.0, 5000.0], 0.05, 330.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (_, mut kit) = strong();
            kit.settings.averaging = Averaging { combine: Combine::Clipped, clip: 1.2 };
            kit.correct(&frame)
        })
    };
    let alone = on(1);
    for threads in [2, 5] {
        support::assert_same(&on(threads), &alone, "threads");
    }
    let (x, y, size) = (31, 17, [100, 90]);
    kit.flats.clear();
    kit.flat_darks.clear();
    kit.defects.clear();
    let whole = kit.correct(&frame);
    let cut = |frame: &MemoryFrame| support::crop(frame, x, y, size[0], size[1]);
    kit.darks = kit.darks.iter().map(cut).collect();
    support::assert_same(&kit.correct(&cut(&frame)), &cut(&whole), "crop");
}

/// A linear scene is interpolated exactly; a photosite without good neighbors stays, marked as defective alone.
#[test]
fn defects_are_interpolated_within_their_class() {
    let head = {
        let (camera, _) = strong();
        camera.expose([100.0; 3], 0.05, 330.0).header
    };
    let mut head = FrameHeader { geometry: Geometry::new(20, 16, &["Y"]), ..head };
    head.metadata.scene = None;
    let ramp = |x: usize, y: usize| {
        (100 + 7 * x + 3 * y) as f32 + 1000.0 * f32::from(u8::from(x.is_multiple_of(2) && y.is_multiple_of(2)))
    };
    let frame = support::frame(head, |x, y, _| ramp(x, y));
    let isolated = [8, 10];
    let around = (4..=12).flat_map(|y| (6..=14).map(move |x| [y, x]));
    let mut kit = Kit { defects: around.filter(|[y, x]| y % 2 == 0 && x % 2 == 0).collect(), ..Kit::default() };
    kit.black = Some(Black::Level(0.0.into()));
    kit.defects.extend([[3, 3], [2, 2], [15, 4]]);
    let made = kit.correct(&frame);
    for y in 0..16 {
        for x in 0..20 {
            let (sample, mark) = (support::at(&made, x, y, 0), support::at(&made, x, y, 1));
            if !kit.defects.contains(&[y, x]) {
                assert_eq!((sample, mark), (ramp(x, y), 0.0));
            } else if [y, x] == isolated {
                assert_eq!((sample, mark), (ramp(x, y), 2.0));
            } else {
                assert_eq!(mark, 6.0, "{x} {y}");
                if y == 3 || y == 2 {
                    assert!((sample - ramp(x, y)).abs() < 1e-3, "{x} {y}: {sample}");
                }
            }
        }
    }
}
