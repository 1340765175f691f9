//! Frames that come off a frame, or divide it: what is said of its camera counts for them, what scales them is the bias of its sensor, and
//! those that lie above what no light reads are told.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::frame::to_sample;
use std::fs;
use support::dng::dng;
use support::fits::{chance, write_fits, write_sensor};
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

const SIZE: [u32; 2] = [384, 32];
const DARK: (&str, &str) = ("IMAGETYP", "'Dark Frame'");

/// Codes without a header, about a level.
fn write_raw(shop: &Workshop, name: &str, level: f64, seed: u64) {
    let [width, height] = SIZE;
    let code = |x: u32, y: u32| (level + 10.0 * chance(x, y, seed)).round();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "codes of 16 bits")]
    let codes = (0..height).flat_map(|y| (0..width).flat_map(move |x| (code(x, y) as u16).to_le_bytes()));
    fs::write(shop.path(name), codes.collect::<Vec<u8>>()).unwrap();
}

/// Sky of `level` and a dark signal over a bias of 500 ADU, both of a camera of 1 e⁻ per ADU and a read noise of 5 e⁻.
fn write(shop: &Workshop, name: &str, [level, dark]: [f64; 2], seed: u64, cards: &[(&str, &str)]) {
    let cards = [&[("INSTRUME", "'A'")], cards].concat();
    let scatter = (6.0 * (25.0 + level + dark)).sqrt();
    write_fits(shop, name, SIZE, &cards, |x, y| 500.0 + dark + level + scatter * chance(x, y, seed));
}

fn sensor(shop: &Workshop, dark_current_e_per_s: f64) {
    write_sensor(shop, SIZE, dark_current_e_per_s, [0.0, 0.0, 5.0]);
}

/// A description of the input holds for the frames beside that have none, but for what it says of an exposure; as options do, and as one
/// beside each frame does.
#[test]
fn what_is_said_of_a_camera_counts_for_frames_beside() {
    let shop = Workshop::new();
    let raws = [("light.raw", 1700.0, 1), ("dark.raw", 520.0, 2), ("flat.raw", 2500.0, 3), ("flat-dark.raw", 510.0, 4)];
    for (name, level, seed) in raws {
        write_raw(&shop, name, level, seed);
    }
    let camera = "schema: cyanometer/1\nquantity: adu\ncamera: A\ncfa: grbg\nwhite_level_adu: 4095\nblack_level_adu: 500\norigin: [1, 0]\n";
    let said = format!("{camera}exposure_time_s: 2.0\n");
    fs::write(shop.path("said.yaml"), &said).unwrap();
    let line = "correct-frame light.raw --raw 384x32:u16le --dark dark.raw --flat flat.raw";
    let described = format!("{line} --flat-dark flat-dark.raw --metadata said.yaml");
    assert_eq!(shop.said(&format!("{described} -o described.exr"), 0), "");
    let colorless = shop.said(&format!("{described} -o described.dng"), 0);
    assert!(colorless.starts_with("correct-frame: warning: the DNG has no colors"), "{colorless}");
    assert_eq!(colorless.lines().count(), 1);
    assert_eq!(shop.sidecar("described.dng").cfa.unwrap().to_string(), "grbg");
    // Flats alone: the black level is that of the description.
    let black = "correct-frame light.raw --raw 384x32:u16le --flat flat.raw --black 500 --metadata said.yaml -o b.exr";
    assert_eq!(shop.said(black, 0), "");
    assert!(
        shop.said(&format!("{line} --flat-dark flat-dark.raw --scale-dark --metadata said.yaml -o s.exr"), BAD_DATA)
            .contains("dark.raw: nothing tells its exposure time")
    );
    // Frames that are described themselves keep to that.
    fs::write(shop.path("dark.raw.yaml"), camera.replace("grbg", "rggb")).unwrap();
    assert!(
        shop.said(&format!("{described} -o x.exr"), BAD_DATA)
            .contains("its pattern is rggb, but that of light.raw is grbg")
    );
    for name in ["light", "dark", "flat", "flat-dark"] {
        fs::write(shop.path(&format!("{name}.raw.yaml")), camera).unwrap();
    }
    assert_eq!(shop.said(&format!("{line} --flat-dark flat-dark.raw -o own.exr"), 0), "");
    assert_eq!(shop.read("described.exr").0, shop.read("own.exr").0);
}

/// Dark frames of 60 s, 120 ADU of dark signal, for a frame of 30 s: what comes off it is half of both bias and dark frame, 560 ADU; of a
/// bias of 0 it were 310. The mean of 12 288 samples of 300 ADU has a standard deviation of 0.2 ADU.
#[test]
fn dark_signals_are_scaled_above_the_bias_of_the_sensor_that_is_named() {
    let shop = Workshop::new();
    sensor(&shop, 2.0);
    write(&shop, "light.fits", [300.0, 60.0], 1, &[("EXPTIME", "30.0")]);
    write(&shop, "dark.fits", [0.0, 120.0], 2, &[DARK, ("EXPTIME", "60.0")]);
    let line = "correct-frame light.fits --scale-dark --dark dark.fits -o out.exr";
    assert!(shop.said(line, BAD_DATA).contains("`black_level_adu`"));
    shop.said(&format!("{line} --sensor s.yaml"), 0);
    let samples = shop.read("out.exr").0;
    let mean = samples.iter().map(|sample| f64::from(*sample)).sum::<f64>() / samples.len() as f64;
    assert!((mean - 300.0).abs() < 1.0, "{mean}");
}

/// Darks 64 ADU too high under bright light, which no sample of the frame tells: by the sensor, by a black level and a short time, by
/// others of their kind, by masked photosites.
#[test]
fn darks_above_what_no_light_reads_are_told() {
    let shop = Workshop::new();
    sensor(&shop, 0.1);
    let cards = [DARK, ("EXPTIME", "0.05")];
    write(&shop, "light.fits", [4000.0, 0.0], 1, &[("EXPTIME", "0.05")]);
    for seed in 2..6 {
        write(&shop, &format!("dark{seed}.fits"), [0.0, 0.0], seed, &cards);
    }
    write(&shop, "high.fits", [64.0, 0.0], 7, &cards);
    let line = |darks: &str, more: &str| {
        let darks = darks.split(' ').map(|dark| format!("--dark {dark}.fits")).collect::<Vec<_>>().join(" ");
        format!("correct-frame light.fits {darks} {more} -o out.exr").replace("  ", " ")
    };
    let good = "dark2 dark3 dark4 dark5";
    let sensor = "--sensor s.yaml";
    assert_eq!(shop.said(&line(good, sensor), 0), "");
    assert_eq!(shop.said(&line(good, ""), 0), "");
    let high = "by the frame's sensor dark frames have 510.1 ADU at most";
    assert!(shop.said(&line("high", sensor), 0).contains(high), "{}", shop.said(&line("high", sensor), 0));
    // Nothing tells it of a camera that nobody knows.
    assert_eq!(shop.said(&line("high", ""), 0), "");
    for combine in ["mean", "median"] {
        let told = shop.said(&line(&format!("{good} high"), &format!("--combine {combine}")), 0);
        assert!(told.contains("high.fits: its mean is 56") && told.contains("which it counts as one with "), "{told}");
    }
    let metadata = "schema: cyanometer/1\nquantity: adu\ncamera: A\ncfa: rggb\nexposure_time_s: 0.05\n";
    fs::write(shop.path("light.fits.yaml"), format!("{metadata}black_level_adu: 500\n")).unwrap();
    assert_eq!(shop.said(&line("dark2", ""), 0), "");
    let told = shop.said(&line("high", ""), 0);
    assert!(told.contains("by the frame's black level dark frames have 525.0 ADU at most"), "{told}");
    // Photosites of the light frame that no light reaches: its first 16 columns.
    write_fits(&shop, "light.fits", SIZE, &[("INSTRUME", "'A'")], |x, y| {
        500.0 + if x < 16 { 12.0 * chance(x, y, 1) } else { 4000.0 + 160.0 * chance(x, y, 1) }
    });
    fs::write(shop.path("light.fits.yaml"), format!("{metadata}masked_areas: [[0, 0, 16, 32]]\n")).unwrap();
    assert_eq!(shop.said(&line("dark2", ""), 0), "");
    let told = shop.said(&line("high", ""), 0);
    assert!(told.contains("light.fits: -6") && told.contains("ADU are left of its masked photosites"), "{told}");
}

/// Codes that are made straight end beyond 4095: flats that reach up to 4080 are not saturated, though straight codes of 3950 are 4109.
#[test]
fn a_white_level_that_is_said_is_one_of_codes_as_they_come() {
    let shop = Workshop::new();
    let readout = format!(
        "width: {}, height: {}, cfa: rggb, full_well_e: 600000, dark_current_e_per_s: 0, temperature_k: 263, dcnu: 0, prnu: 0, \
         read_noise_e: 5, bits: 12, bias_adu: 100, adu_per_e: 0.01, linearization: {{polynomial: [1.0, 1.2e-5]}}",
        SIZE[0], SIZE[1]
    );
    fs::write(shop.path("s.yaml"), format!("schema: cyanometer-sensor/2\nname: s\nreadout: {{{readout}}}\n")).unwrap();
    write_raw(&shop, "light.raw", 1000.0, 1);
    write_raw(&shop, "flat.raw", 4050.0, 2);
    let line =
        "correct-frame light.raw --raw 384x32:u16le --cfa rggb --white 4095 --black 100 --sensor s.yaml --linearize";
    let said = shop.said(&format!("{line} --flat flat.raw -o out.exr"), 0);
    assert!(!said.contains("saturated"), "{said}");
}

/// Dark signals of 9600 and 500 ADU in 240 s are those of a sensor of 40 and of 2 e⁻/s, as far as it is named.
#[test]
fn dark_signals_that_the_sensor_predicts_are_not_doubted() {
    let shop = Workshop::new();
    let metadata =
        "schema: cyanometer/1\nquantity: adu\ncamera: A\ncfa: rggb\nexposure_time_s: 240\nblack_level_adu: 500\n";
    fs::write(shop.path("light.fits.yaml"), format!("{metadata}white_level_adu: 16383\n")).unwrap();
    let line = "correct-frame light.fits --dark dark.fits -o out.exr";
    let cases = [
        (9600.0, 40.0, "60 % of the way from black to white"),
        (500.0, 2.0, "ADU, 2 times its black level; are these of another number of bits"),
    ];
    for (dark, dark_current_e_per_s, doubt) in cases {
        write(&shop, "light.fits", [300.0, dark], 1, &[]);
        write(&shop, "dark.fits", [0.0, dark], 2, &[("EXPTIME", "240.0")]);
        // In 240 s a dark signal may be as much as the black level.
        let told = shop.said(line, 0);
        assert_eq!(told.contains(doubt), dark > 500.0, "{told}");
        for (current, is_told) in [(dark_current_e_per_s, false), (0.1 * dark_current_e_per_s, true)] {
            sensor(&shop, current);
            let told = shop.said(&format!("{line} --sensor s.yaml"), 0);
            assert_eq!(told.contains(doubt), is_told, "{dark}, {current}: {told}");
        }
    }
}

/// A dark frame less its bias has samples below zero: of sums of two numbers from -5 to 5, 45 % once they are whole.
#[test]
fn darks_without_their_bias_are_told_by_samples_below_zero() {
    let shop = Workshop::new();
    let write = |name: &str, level: f64, scatter: f64, seed: u64| {
        let [width, height] = SIZE;
        let sample = |x: u32, y: u32| to_sample((level + scatter * chance(x, y, seed)).round());
        let samples = (0..height).flat_map(|y| (0..width).flat_map(move |x| sample(x, y).to_le_bytes()));
        fs::write(shop.path(name), samples.collect::<Vec<u8>>()).unwrap();
    };
    write("light.raw", 1700.0, 30.0, 1);
    let line = "correct-frame light.raw --raw 384x32:f32le --cfa rggb --white 16383 --dark dark.raw -o out.exr";
    for (level, is_told) in [(0.0, true), (10.0, false), (500.0, false)] {
        write("dark.raw", level, 10.0, 2);
        let told = shop.said(line, 0);
        let doubt = "of its samples are below zero, as no camera writes them; was a bias taken off?";
        assert_eq!(told.contains(doubt), is_told, "{level}: {told}");
    }
    // A frame that comes near zero, or is no whole numbers as the dark frame is none, may lack its bias too.
    let text = "of its samples are below zero";
    write("dark.raw", 0.0, 10.0, 2);
    write("light.raw", 20.0, 30.0, 1);
    assert!(!shop.said(line, 0).contains(text));
    let fine = |name: &str, level: f64, scatter: f64, seed: u64| {
        let [width, height] = SIZE;
        let sample = |x: u32, y: u32| to_sample(level + scatter * chance(x, y, seed));
        let samples = (0..height).flat_map(|y| (0..width).flat_map(move |x| sample(x, y).to_le_bytes()));
        fs::write(shop.path(name), samples.collect::<Vec<u8>>()).unwrap();
    };
    fine("dark.raw", 0.0, 10.0, 2);
    for (is_fine, is_told) in [(false, true), (true, false)] {
        if is_fine {
            fine("light.raw", 1700.0, 30.0, 1)
        } else {
            write("light.raw", 1700.0, 30.0, 1)
        }
        let told = shop.said(line, 0);
        assert_eq!(told.contains(text), is_told, "{is_fine}: {told}");
    }
}

/// Dark frames less a bias that were cut off at zero, as whole numbers without a sign are: half of the samples and more are 0. A frame that is
/// far from it has its bias; one that is not may be of black 0.
#[test]
fn darks_that_are_cut_off_at_zero_are_told() {
    let shop = Workshop::new();
    let codes = |name: &str, level: f64, scatter: f64, seed: u64| {
        write_fits(&shop, name, SIZE, &[("INSTRUME", "'A'")], |x, y| level + scatter * chance(x, y, seed));
    };
    let line = "correct-frame light.fits --dark dark.fits --white 16383 -o out.exr";
    let text = "of its samples are exactly 0, and nothing of what it comes off is near it; was a bias taken off";
    for (light, dark, is_told) in [(1700.0, 0.0, true), (100.0, 0.0, false), (1700.0, 20.0, false)] {
        codes("light.fits", light, 30.0, 1);
        codes("dark.fits", dark, 10.0, 2);
        let told = shop.said(line, 0);
        assert_eq!(told.contains(text), is_told, "{light} {dark}: {told}");
    }
}

/// Codes of 12 bits in 16 lie 16 apart: two of these above the bias of the sensor are no light. Where no time is told, the dark signal is that
/// of a minute, 6 ADU of a sensor of 0.1 e⁻/s, ten times at most.
#[test]
fn levels_of_coarse_codes_and_of_unknown_times_have_room() {
    let shop = Workshop::new();
    sensor(&shop, 0.1);
    let line = "correct-frame light.fits --dark dark.fits --sensor s.yaml -o out.exr";
    let coarse = |name: &str, level: f64, scatter: f64, seed: u64| {
        write_fits(&shop, name, SIZE, &[("INSTRUME", "'A'"), ("EXPTIME", "0.05")], |x, y| {
            ((level + scatter * chance(x, y, seed)) / 16.0).round() * 16.0
        });
    };
    coarse("light.fits", 4500.0, 400.0, 1);
    for (level, is_told) in [(528.0, false), (576.0, true)] {
        coarse("dark.fits", level, 40.0, 2);
        let told = shop.said(line, 0);
        assert_eq!(
            told.contains("by the frame's sensor dark frames have 542.0 ADU at most"),
            is_told,
            "{level}: {told}"
        );
    }
    write(&shop, "light.fits", [4000.0, 0.0], 1, &[]);
    let text = "by the frame's sensor, in a minute, as no time is told, dark frames have 570.0 ADU at most";
    for (level, is_told) in [(40.0, false), (100.0, true)] {
        write(&shop, "dark.fits", [level, 0.0], 2, &[]);
        let told = shop.said(line, 0);
        assert_eq!(told.contains(text), is_told, "{level}: {told}");
    }
}

/// A dark signal of 480 ADU in 240 s at 263 K: dark frames of a bias alone, and a frame that has none of it either, are told where the
/// temperature is; where it is not, a cooled sensor may have so little.
#[test]
fn dark_signals_far_below_those_of_the_sensor_are_told() {
    let shop = Workshop::new();
    sensor(&shop, 2.0);
    let line = "correct-frame light.fits --dark dark.fits --sensor s.yaml -o out.exr";
    let short = "by the frame's sensor, exposure and temperature dark frames have 538.0 ADU at least";
    let no_time = "in its exposure of 240 s its sensor has a dark signal of 48 ADU at least, and the darkest part of the frame is";
    let time = ("EXPTIME", "240.0");
    for (dark, of_light, temperature, wanted) in [
        (480.0, 480.0, "-10.15", [false, false]),
        (160.0, 160.0, "-10.15", [false, false]),
        (0.0, 480.0, "-10.15", [true, false]),
        (0.0, 0.0, "-10.15", [false, true]),
        (0.0, 480.0, "", [false, false]),
        (0.0, 0.0, "", [false, false]),
    ] {
        let told: Vec<_> = [("CCD-TEMP", temperature)].into_iter().filter(|(_, value)| !value.is_empty()).collect();
        write(&shop, "light.fits", [20.0, of_light], 1, &[&[time], told.as_slice()].concat());
        write(&shop, "dark.fits", [0.0, dark], 2, &[&[DARK, time], told.as_slice()].concat());
        let said = shop.said(line, 0);
        assert_eq!([short, no_time].map(|text| said.contains(text)), wanted, "{dark} {of_light} {temperature}: {said}");
    }
    // A sensor of 100 times the dark current that is cooled so far has 48 ADU in place of 48000, and a warm one that tells it has not.
    sensor(&shop, 200.0);
    for (temperature, wanted) in [("", [false, false]), ("-10.15", [false, true])] {
        let told: Vec<_> = [("CCD-TEMP", temperature)].into_iter().filter(|(_, value)| !value.is_empty()).collect();
        write(&shop, "light.fits", [20.0, 48.0], 1, &[&[time], told.as_slice()].concat());
        write(&shop, "dark.fits", [0.0, 48.0], 2, &[&[DARK, time], told.as_slice()].concat());
        let said = shop.said(line, 0);
        let texts = ["sensor, exposure and temperature dark frames have", "its sensor has a dark signal of"];
        assert_eq!(texts.map(|text| said.contains(text)), wanted, "{temperature}: {said}");
    }
}

/// Bias frames beside dark frames that are scaled: of 500 ADU where dark frames have 620. Lit ones are above these; long ones above the bias
/// of the sensor, or the black level.
#[test]
fn bias_frames_that_are_none_are_told() {
    let shop = Workshop::new();
    sensor(&shop, 2.0);
    write(&shop, "light.fits", [300.0, 60.0], 1, &[("EXPTIME", "30.0")]);
    write(&shop, "dark.fits", [0.0, 120.0], 2, &[DARK, ("EXPTIME", "60.0")]);
    let line = "correct-frame light.fits --scale-dark --dark dark.fits --bias bias.fits -o out.exr";
    let lit = "above that of the dark frames, 6";
    let long = "bias frames have 510.0 ADU at most; was it lit, or exposed for long?";
    for (level, more, wanted) in [
        (0.0, "", [false, false]),
        (0.0, "--sensor s.yaml", [false, false]),
        (400.0, "", [true, false]),
        (60.0, "", [false, false]),
        (60.0, "--sensor s.yaml", [false, true]),
    ] {
        write(&shop, "bias.fits", [0.0, level], 3, &[("IMAGETYP", "'Bias Frame'")]);
        // That the bias is of no time is said of the camera, which tells none.
        let said = shop.said(format!("{line} {more}").trim_end(), 0);
        assert_eq!([lit, long].map(|text| said.contains(text)), wanted, "{level} {more}: {said}");
    }
}

/// Dark frames of flats: less their bias, and of light that the flats have not.
#[test]
fn dark_frames_that_flats_cannot_have_are_told() {
    let shop = Workshop::new();
    write(&shop, "light.fits", [1000.0, 0.0], 1, &[]);
    write(&shop, "dark.fits", [0.0, 0.0], 2, &[DARK]);
    // A circle of light, as a fisheye has it.
    let flat = |name: &str, seed: u64| {
        write_fits(&shop, name, SIZE, &[("INSTRUME", "'A'")], |x, y| {
            let light = if (128..256).contains(&x) { 8000.0 } else { 0.0 };
            500.0 + light + (6.0 * (25.0_f64 + light)).sqrt() * chance(x, y, seed)
        });
    };
    flat("flat.fits", 3);
    let line = "correct-frame light.fits --dark dark.fits --flat flat.fits --flat-dark flat-dark.fits -o out.exr";
    let below = "its mean is below that of what came off; are these dark or bias frames of it?";
    for (level, is_told) in [(0.0, false), (300.0, true)] {
        write(&shop, "flat-dark.fits", [0.0, level], 4, &[DARK]);
        let said = shop.said(line, 0);
        assert_eq!(said.contains(&format!("flat.fits: in 67 % of it {below}")), is_told, "{level}: {said}");
    }
    // Signed codes about zero: half of them below, and a flat that has no bias either.
    let signed = |name: &str, level: f64, seed: u64| {
        let [width, height] = SIZE;
        let sample = |x: u32, y: u32| to_sample((level + 10.0 * chance(x, y, seed)).round());
        let samples = (0..height).flat_map(|y| (0..width).flat_map(move |x| sample(x, y).to_le_bytes()));
        fs::write(shop.path(name), samples.collect::<Vec<u8>>()).unwrap();
    };
    for (name, level, seed) in [("light", 1700.0, 5), ("dark", 500.0, 6), ("flat", 4000.0, 7)] {
        signed(&format!("{name}.raw"), level, seed);
    }
    let line = "correct-frame light.raw --raw 384x32:f32le --cfa rggb --white 16383 --dark dark.raw --flat flat.raw --flat-dark f.raw -o out.exr";
    for (level, is_told) in [(0.0, true), (500.0, false)] {
        signed("f.raw", level, 8);
        let said = shop.said(line, 0);
        let text = "% of its samples are below zero, as no camera writes them";
        assert_eq!(said.contains(text), is_told, "{level}: {said}");
    }
}

/// Codes of 12 bits that were shifted to 16, beside darks that were not; averages of dark frames that were shifted too have finer codes.
#[test]
fn shifted_codes_beside_darks_that_are_not_are_told() {
    let shop = Workshop::new();
    let shifted = |name: &str, level: f64, scatter: f64, times: f64, step: f64, seed: u64| {
        write_fits(&shop, name, SIZE, &[("INSTRUME", "'A'")], |x, y| {
            // Hot photosites tell the step of quiet darks.
            let code = level + scatter * chance(x, y, seed) + if x % 97 == 5 { 20.0 } else { 0.0 };
            ((code * times / step).round() * step).min(65_535.0)
        });
    };
    let line = "correct-frame light.fits --dark dark.fits -o out.exr";
    let text = "light.fits: its codes are multiples of 16, those of what came off of 1, and it is brighter throughout by as many times";
    // Level and scatter in codes of 12 bits.
    for (level, dark_times, scatter, is_told) in
        [(2000.0, 1.0, 5.0, true), (2000.0, 16.0, 5.0, false), (200.0, 16.0, 0.1, false)]
    {
        shifted("light.fits", level, 80.0, 16.0, 16.0, 1);
        shifted("dark.fits", 100.0, scatter, dark_times, 1.0, 2);
        let said = shop.said(line, 0);
        assert_eq!(said.contains(text), is_told, "{level} {dark_times}: {said}");
    }
}

/// A part is that of dark frames too, unless they are the single part of their file, as averages are.
#[test]
fn parts_are_those_of_dark_frames() {
    let shop = Workshop::new();
    for (name, level, seed) in [("light", 1000.0, 1), ("dark", 500.0, 2)] {
        let cards = [("EXPTIME", "3.0"), ("BUNIT", "'adu'")];
        write_fits(&shop, "single.fits", SIZE, &cards, |x, y| level + 20.0 * chance(x, y, seed));
        let bytes = shop.bytes("single.fits");
        fs::write(shop.path(&format!("{name}.single.fits")), &bytes).unwrap();
        let mut primary =
            ["SIMPLE  = T", "BITPIX  = 16", "NAXIS   = 0", "END"].map(|card| format!("{card:<80}")).concat();
        primary += &" ".repeat(2880 - primary.len());
        let extension = format!("{:<80}", "XTENSION= 'IMAGE   '").into_bytes();
        fs::write(shop.path(&format!("{name}.fits")), [primary.as_bytes(), &extension, &bytes[80..]].concat()).unwrap();
    }
    shop.run("correct-frame light.fits --part 1 --dark dark.fits -o parts.exr", &[]);
    shop.run("correct-frame light.fits --part 1 --dark dark.single.fits -o mixed.exr", &[]);
    shop.run("correct-frame light.single.fits --dark dark.single.fits -o single.exr", &[]);
    let samples = |name: &str| shop.frame(name).samples.clone();
    assert_eq!(samples("parts.exr"), samples("single.exr"));
    assert_eq!(samples("mixed.exr"), samples("single.exr"));
    let said = shop.said("correct-frame light.fits --part 2 --dark dark.fits -o out.exr", BAD_USAGE);
    assert!(said.contains("light.fits: there is no part 2; its last one is 1"), "{said}");
}

/// Keywords are in s by the standard, and not always by those who write them.
#[test]
fn times_in_ms_that_files_tell_are_told() {
    let shop = Workshop::new();
    let line = "demosaic light.fits --black 500 -o out.exr";
    for (time, level, wanted) in [
        (
            "33.3",
            20_000.0,
            "an exposure of 33.3 s by its own tags is long for a frame that is as bright; 33.3 ms is 0.0333 s",
        ),
        ("33.3", 900.0, ""),
        ("30.0", 20_000.0, ""),
        (
            "0.033 / exposure time in ms",
            900.0,
            "its EXPTIME of 0.033 counts as s, as is the rule, and its comment tells ms",
        ),
        ("0.033 / exposure time in seconds", 900.0, ""),
    ] {
        write_fits(&shop, "light.fits", SIZE, &[("EXPTIME", time)], |x, y| {
            500.0 + level * (1.0 + 0.5 * f64::from(x) / 384.0) + 60.0 * chance(x, y, 1)
        });
        let said = shop.said(line, 0);
        assert_eq!(said.contains(wanted) && !wanted.is_empty(), !said.is_empty(), "{time}: {said}");
    }
}

/// The first 16 columns see no light and read 500 ADU.
#[test]
fn black_levels_that_masked_photosites_contradict_are_told() {
    let shop = Workshop::new();
    write_fits(&shop, "light.fits", SIZE, &[], |x, y| {
        500.0 + if x < 16 { 12.0 * chance(x, y, 1) } else { 4000.0 + 160.0 * chance(x, y, 1) }
    });
    let text = "ADU, and 600 ADU come off as its black level; one of the two is wrong";
    for (black, is_told) in [(600, true), (505, false), (500, false)] {
        let metadata = format!(
            "schema: cyanometer/1\nquantity: adu\ncfa: rggb\nblack_level_adu: {black}\nmasked_areas: [[0, 0, 16, 32]]\n"
        );
        fs::write(shop.path("light.fits.yaml"), metadata).unwrap();
        for line in ["demosaic light.fits -o out.exr", "correct-frame light.fits --black auto -o out.exr"] {
            let said = shop.said(line, 0);
            assert_eq!(said.contains(text), is_told, "{black}: {said}");
        }
        let border = shop.said("correct-frame light.fits --black border -o out.exr", 0);
        assert!(!border.contains(text), "{border}");
        // A crop has none of them.
        assert!(!shop.said("demosaic light.fits --crop 16,0,368,32 -o out.exr", 0).contains("masked photosites"));
    }
}

/// The first 16 columns see no light and read 500 ADU beside 4500 of light: areas of masked photosites that are told wrong, or lit, are told
/// whatever tells their level.
#[test]
fn borders_that_light_reaches_are_told() {
    let shop = Workshop::new();
    let light = |border: f64| {
        let level = move |x: u32| if x < 16 { [border, 12.0] } else { [4500.0, 160.0] };
        write_fits(&shop, "light.fits", SIZE, &[], |x, y| level(x)[0] + level(x)[1] * chance(x, y, 1));
    };
    let other = "and its metadata have a black level of 500.0 ADU; one of the two is wrong";
    let uneven = "are uneven: their mean is";
    for (border, area, time, wanted) in [
        (500.0, "[0, 0, 16, 32]", "0.01", [false, false]),
        (506.0, "[0, 0, 16, 32]", "0.01", [false, false]),
        (600.0, "[0, 0, 16, 32]", "0.01", [true, false]),
        // As much dark signal as black in a second, and more than all of it stays.
        (900.0, "[0, 0, 16, 32]", "1.0", [false, false]),
        (400.0, "[0, 0, 16, 32]", "60.0", [true, false]),
        (0.0, "[0, 0, 16, 32]", "0.01", [true, false]),
        (500.0, "[64, 0, 16, 32]", "1.0", [true, false]),
        (500.0, "[0, 0, 20, 32]", "60.0", [false, true]),
        (500.0, "[14, 0, 16, 32]", "0.01", [false, true]),
    ] {
        light(border);
        let metadata = format!(
            "schema: cyanometer/1\nquantity: adu\ncfa: rggb\nexposure_time_s: {time}\nblack_level_adu: 500\nmasked_areas: [{area}]\n"
        );
        fs::write(shop.path("light.fits.yaml"), metadata).unwrap();
        for black in ["border", "rows"] {
            let said = shop.said(&format!("correct-frame light.fits --black {black} -o out.exr"), 0);
            assert_eq!(
                [other, uneven].map(|text| said.contains(text)),
                wanted,
                "{border} {area} {time} {black}: {said}"
            );
            assert_eq!(said.is_empty(), wanted == [false, false], "{border} {area} {time} {black}: {said}");
        }
    }
    // A sensor that is named tells its bias.
    sensor(&shop, 0.1);
    light(500.0);
    for (area, is_told) in [("[0, 0, 16, 32]", false), ("[64, 0, 16, 32]", true)] {
        let metadata = format!("schema: cyanometer/1\nquantity: adu\ncfa: rggb\nmasked_areas: [{area}]\n");
        fs::write(shop.path("light.fits.yaml"), metadata).unwrap();
        let said = shop.said("correct-frame light.fits --black border --sensor s.yaml -o out.exr", 0);
        assert_eq!(said.contains("ADU, is far from the bias of s, 500 ADU"), is_told, "{said}");
    }
}

/// A bias of 500 ADU and a dark signal of 60: a mean below 490 ADU, and a tenth of that, is none of dark frames, whatever the time and
/// whether it is told.
#[test]
fn darks_below_the_bias_of_the_sensor_are_told() {
    let shop = Workshop::new();
    sensor(&shop, 2.0);
    let told = "are these of another camera or converter, or was their level shifted?";
    for (time, level, is_told) in [
        ("0.1", -40.0, true),
        ("0.1", 0.0, false),
        ("0.1", -5.0, false),
        ("30.0", -40.0, true),
        ("30.0", 60.0, false),
        ("", -40.0, true),
        ("", 0.0, false),
    ] {
        let cards: Vec<_> = [("EXPTIME", time)].into_iter().filter(|(_, time)| !time.is_empty()).collect();
        write(&shop, "light.fits", [4000.0, 60.0], 1, &cards);
        write_fits(&shop, "dark.fits", SIZE, &[&[("INSTRUME", "'A'"), DARK], cards.as_slice()].concat(), |x, y| {
            500.0 + level + 12.0 * chance(x, y, 2)
        });
        let said = shop.said("correct-frame light.fits --dark dark.fits --sensor s.yaml -o out.exr", 0);
        assert_eq!(said.contains(told), is_told, "{time} {level}: {said}");
        assert_eq!(said.is_empty(), !is_told, "{time} {level}: {said}");
    }
}

/// One dark frame and one bias frame of a longer exposure: the complaint is of the dark frame alone.
#[test]
fn a_dark_frame_that_is_no_longer_than_the_bias_is_named() {
    let shop = Workshop::new();
    write(&shop, "light.fits", [4000.0, 60.0], 1, &[("EXPTIME", "30.0")]);
    write(&shop, "dark.fits", [0.0, 10.0], 2, &[DARK, ("EXPTIME", "5.0")]);
    write(&shop, "bias.fits", [0.0, 40.0], 3, &[("EXPTIME", "20.0")]);
    let said =
        shop.said("correct-frame light.fits --dark dark.fits --bias bias.fits --scale-dark -o out.exr", BAD_DATA);
    assert!(said.contains("dark.fits: its exposure is no longer than that of the bias frames"), "{said}");
    assert!(!said.contains("other"), "{said}");
}

/// A temperature in degrees Celsius is refused in the metadata of a frame as in a sensor file.
#[test]
fn temperatures_of_frames_in_celsius_are_refused() {
    let shop = Workshop::new();
    write(&shop, "light.fits", [4000.0, 60.0], 1, &[]);
    for (told, wanted) in [("20", "293.15"), ("-20", "253.15")] {
        let metadata = format!("schema: cyanometer/1\nquantity: adu\ncfa: rggb\nsensor_temperature_k: {told}\n");
        fs::write(shop.path("light.fits.yaml"), metadata).unwrap();
        for line in ["measure light.fits", "demosaic light.fits --black 500 -o out.exr"] {
            let said = shop.said(line, BAD_DATA);
            let text = format!(
                "`sensor_temperature_k` is {told}; it is in K, and {told} looks like degrees Celsius, which is {wanted} K"
            );
            assert!(said.contains("light.fits.yaml: its ") && said.contains(&text), "{line}: {said}");
        }
    }
}

/// Exposures of which one is of another scale.
#[test]
fn frames_of_another_scale_are_not_averaged_without_a_word() {
    let shop = Workshop::new();
    let frame = |name: &str, scale: f64, level: f64, seed: u64| {
        write_fits(&shop, name, SIZE, &[], |x, y| scale * (level + 60.0 * chance(x, y, seed)).round());
    };
    frame("a.fits", 1.0, 500.0, 1);
    frame("b.fits", 1.0, 900.0, 2);
    assert_eq!(shop.said("average-frames a.fits b.fits -o out.exr", 0), "");
    frame("b.fits", 4.0, 500.0, 2);
    for line in ["average-frames a.fits b.fits -o out.exr", "average-frames b.fits a.fits --combine median -o out.exr"]
    {
        let said = shop.said(line, 0);
        let is_of_both = |line: &&str| line.contains("its codes are multiples of ") && line.contains("scales differ");
        assert_eq!(said.lines().filter(is_of_both).count(), 1, "{said}");
    }
    frame("b.fits", 1.0 / 16384.0, 500.0, 2);
    assert!(shop.said("average-frames a.fits b.fits -o out.exr", 0).contains("are some shares of 1"));
}

/// Dark frames whose bias is below their noise, averaged first: the average tells what its codes lost, which is what the frames tell one by
/// one. Those of a bias that is high enough tell nothing.
#[test]
fn averages_of_dark_frames_that_are_cut_off_tell_it() {
    let shop = Workshop::new();
    for (bias, is_cut) in [(2.0, true), (60.0, false)] {
        write_fits(&shop, "light.fits", SIZE, &[("INSTRUME", "'A'")], |x, y| bias + 40.0 + 12.0 * chance(x, y, 90));
        for seed in 0..4_u32 {
            let name = format!("dark{seed}.fits");
            write_fits(&shop, &name, SIZE, &[("INSTRUME", "'A'"), DARK], |x, y| {
                let sum: f64 = (0..6).map(|part| chance(x, y, u64::from(10 * seed + part))).sum();
                bias + 5.0 * sum
            });
        }
        let (files, told) = ("dark0.fits dark1.fits dark2.fits dark3.fits", "are 0, where codes are cut off");
        for combine in ["mean", "median", "clipped"] {
            let said = shop.said(&format!("average-frames {files} --combine {combine} -o mean.exr"), 0);
            assert_eq!(
                said.contains(told) && said.contains("have the camera add an offset"),
                is_cut,
                "{combine}: {said}"
            );
        }
        let said = shop.said(&format!("average-frames {files} -o mean.exr"), 0);
        let record = shop.sidecar("mean.exr").average.unwrap().cut_off;
        assert_eq!(record.is_some(), is_cut, "{said}");
        let excess = |said: &str| -> f64 {
            let before = said.split(" ADU too high").next().unwrap();
            before.rsplit(' ').next().unwrap().parse().unwrap()
        };
        let by_mean = shop.said("correct-frame light.fits --dark mean.exr -o out.exr", 0);
        let darks = files.replace("dark", "--dark dark");
        let one_by_one = shop.said(&format!("correct-frame light.fits {darks} -o out.exr"), 0);
        assert_eq!([&by_mean, &one_by_one].map(|said| said.contains(told)), [is_cut; 2], "{by_mean} {one_by_one}");
        if is_cut {
            // Told to two digits of the same codes, of which an average looks at some rows.
            let [a, b] = [&by_mean, &one_by_one].map(|said| excess(said));
            assert!((a - b).abs() < 0.1 * b, "{a} {b}");
            assert!((record.unwrap().excess_adu - a).abs() < 0.006, "{record:?} {a}");
        }
    }
}

/// Dark frames of 8 bits beside a frame of 16, of which nothing tells the scale; beside a frame that 8 bits hold, or in 16 bits, they are
/// nothing to speak of.
#[test]
fn dark_frames_of_8_bits_beside_a_frame_of_16_are_told() {
    let shop = Workshop::new();
    let plane = |name: &str, bits: u32, level: u32| {
        let code = |at: u32| level + at * 7919 % 13;
        let bytes = (0..32 * 24).flat_map(|at| code(at).to_le_bytes()[..bits as usize / 8].to_vec());
        fs::write(shop.path(name), dng([32, 24], bits, 1, &bytes.collect::<Vec<u8>>(), &[])).unwrap();
        // No DNG any more: a TIFF without levels.
        let mut bytes = shop.bytes(name);
        let at = bytes.windows(2).position(|two| two == 50706_u16.to_le_bytes()).unwrap();
        bytes[at..at + 2].copy_from_slice(&65000_u16.to_le_bytes());
        fs::write(shop.path(name), bytes).unwrap();
    };
    let told = "dark.tif: it is stored in 8 bits, and what it comes off averages";
    for (light, bits, is_told) in [(2000, 8, true), (2000, 16, false), (180, 8, false)] {
        plane("light.tif", 16, light);
        plane("dark.tif", bits, 20);
        let said = shop.said("correct-frame light.tif --dark dark.tif -o out.exr", 0);
        assert_eq!(said.contains(told), is_told, "{light} {bits}: {said}");
        plane("flat.tif", 16, light + 40);
        let said = shop.said("correct-frame light.tif --black 20 --flat flat.tif --flat-dark dark.tif -o out.exr", 0);
        assert_eq!(said.contains(told), is_told, "{light} {bits}: {said}");
    }
}
