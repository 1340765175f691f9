//! The programs as a shell sees them: pipes, files, sidecars, known samples.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::units::QuantityKind;
use sha2::Digest;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::process::Stdio;
use std::sync::mpsc;
use std::time::Duration;
use support::TREE;
use support::workshop::{BAD_DATA, BAD_USAGE, SKY, Workshop, programs};

#[test]
fn a_pipeline_runs_all_at_once_with_tees_between() {
    let shop = Workshop::new();
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    let report = shop.pipe(&format!(
        "{SKY} | tee expected.exr | add-noise --seed 7 | tee noisy.exr | digitize | mosaic | tee plane.exr \
         | demosaic --method eci | to-xyz --matrix matrix.yaml | tee xyz.exr | measure --output-format json"
    ));
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    let region = &report["regions"][0];
    assert_eq!(region["count"], 64 * 48);
    let channels = region["channels"].as_array().unwrap();
    let names: Vec<&str> = channels.iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["X", "Y", "Z"]);
    // The spectrum's own luminance is 1391.68 cd m⁻², as its file says; a matrix fitted to 912 skies restores that of a
    // sky to some percent.
    let luminance = channels[1]["mean"].as_f64().unwrap();
    assert!((luminance / 1391.68 - 1.0).abs() < 0.1, "{luminance}");

    // Program by program the same bytes come out, and what tee kept can be gone on with.
    shop.run(&format!("{SKY} -o again.exr"), &[]);
    assert_eq!(shop.bytes("again.exr"), shop.bytes("expected.exr"));
    let noisy = shop.run("add-noise --seed 7", &shop.bytes("expected.exr"));
    assert_eq!(noisy, shop.bytes("noisy.exr"));
    let plane = shop.run("mosaic", &shop.run("digitize", &noisy));
    assert_eq!(plane, shop.bytes("plane.exr"));
    let rgb = shop.run("demosaic --method eci", &plane);
    assert_eq!(shop.run("to-xyz --matrix matrix.yaml", &rgb), shop.bytes("xyz.exr"));
    shop.run("measure noisy.exr", &[]);
}

/// Mosaicking first does a third of the work, and changes no sample of what comes out.
#[test]
fn the_mosaic_may_come_anywhere_before_demosaicking() {
    let shop = Workshop::new();
    let planes: Vec<Vec<f32>> = [
        format!("{SKY} | add-noise --seed 7 | digitize | mosaic -o last.exr"),
        format!("{SKY} | add-noise --seed 7 | mosaic | digitize -o middle.exr"),
        format!("{SKY} | mosaic | add-noise --seed 7 | digitize -o first.exr"),
        format!("{SKY} --cfa rggb | add-noise --seed 7 | digitize -o never.exr"),
    ]
    .iter()
    .map(|pipeline| {
        assert!(shop.pipe(pipeline).is_empty());
        shop.read(pipeline.rsplit(' ').next().unwrap()).0
    })
    .collect();
    for plane in &planes[1..] {
        assert_eq!(planes[0], *plane);
    }
}

/// A redirection and a name give the same file, whatever the format.
#[test]
fn named_output_is_the_standard_output_byte_for_byte() {
    let shop = Workshop::with_frames();
    let mut runs: Vec<(String, &str)> = [
        ("render-radiance --electrons 1,2,3 --size 9x7", ""),
        ("add-noise --seed 3", "expected.exr"),
        ("digitize", "noisy.exr"),
        ("mosaic", "noisy.exr"),
        ("correct-frame --quiet --black auto --cte 0.999", "plane.exr"),
        ("demosaic --method shti", "plane.exr"),
        ("to-xyz --matrix matrix.yaml --space srgb", "rgb.exr"),
        ("to-xyz", "rgb.exr"),
        ("measure", "noisy.exr"),
        ("measure --output-format json", "noisy.exr"),
    ]
    .map(|(line, input)| (line.to_owned(), input))
    .into();
    for storage in [
        "--format exr --compression zip",
        "--format exr --compression piz --sample-type f16 --quiet",
        "--format tiff",
        "--format tiff --compression lzw",
        "--format tiff --compression deflate --sample-type f32",
    ] {
        runs.push((format!("digitize {storage}"), "noisy.exr"));
    }
    for (line, input) in runs {
        let input = if input.is_empty() { Vec::new() } else { shop.bytes(input) };
        let redirected = shop.run(&line, &input);
        assert!(!redirected.is_empty(), "{line}");
        assert!(shop.run(&format!("{line} -o named"), &input).is_empty());
        assert_eq!(shop.bytes("named"), redirected, "{line}");
        fs::remove_file(shop.path("named")).unwrap();
        assert_eq!(shop.run(&format!("{line} -o -"), &input), redirected, "{line}");
    }
    assert!(!shop.files().contains(&"-".to_owned()));
}

/// The sky library as a chart, from radiance to L*a*b*: each of 912 patches is as noisy as its own level predicts.
#[test]
#[allow(clippy::too_many_lines, reason = "a session at the shell, in its order")]
fn patches_of_a_library_are_as_noisy_as_predicted() {
    let shop = Workshop::new();
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    shop.pipe(
        "render-radiance SAMPLES/skies/sky912.exr --patch 20x16 --expose-to 0.8 | add-noise --seed 3 | tee noisy.exr \
         | digitize | mosaic | tee plane.exr | demosaic --method eci | tee rgb.exr \
         | to-xyz --matrix matrix.yaml --space lab -o lab.exr",
    );
    let regions = |line: &str| -> Vec<serde_json::Value> {
        let report: serde_json::Value = serde_json::from_slice(&shop.run(line, &[])).unwrap();
        report["regions"].as_array().unwrap().clone()
    };
    for (file, key, margin) in [
        ("noisy.exr", "channels", 0),
        ("plane.exr", "classes", 0),
        ("rgb.exr", "channels", 3),
        ("lab.exr", "channels", 3),
    ] {
        let patches = regions(&format!("measure --patches {file} --output-format json"));
        assert_eq!(patches.len(), 912);
        for (sample, patch) in patches.iter().enumerate() {
            assert_eq!(patch["sample"], sample);
            assert_eq!(patch["patch"], serde_json::json!([sample % 38, sample / 38]));
            assert_eq!(patch["count"], (20 - 2 * margin) * (16 - 2 * margin));
            assert!(patch["patch_mean_std"].is_array() && patch["predicted_covariance"].is_array());
        }
        for channel in 0..3 {
            let z: Vec<f64> = patches
                .iter()
                .map(|patch| {
                    let channel = &patch[key][channel];
                    assert!(channel["z_mean"].is_null() && channel["predicted_mean"].is_null());
                    assert!(channel["predicted_std"].as_f64().unwrap() > 0.0);
                    channel["z_std"].as_f64().unwrap()
                })
                .collect();
            // Five standard errors of the mean, 1/√n, and of the mean square, √(2/n). A standard deviation of ν degrees
            // of freedom is expected 1/4ν low, 0.35/√ν of its error: 0.07 for 25, fewer than 14x10 pixels have on
            // average, 44 to 117 by channel and method. With 70 a spread mispredicted by 3 % moves z by 0.35.
            let n = z.len() as f64;
            let mean = z.iter().sum::<f64>() / n;
            let mean_square = z.iter().map(|z| z * z).sum::<f64>() / n;
            assert!(mean.abs() < 5.0 / n.sqrt() + 0.07, "{file} {channel}: mean {mean}");
            assert!((mean_square - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{file} {channel}: mean square {mean_square}");
        }
        // Patch 40 stands in row 1, column 2; its interior is a region like any other.
        let rectangle = format!("{},{},{},{}", 40 + margin, 16 + margin, 20 - 2 * margin, 16 - 2 * margin);
        let region = regions(&format!("measure {file} --region {rectangle} --output-format json")).remove(0);
        assert_eq!(region["covariance"], patches[40]["covariance"]);
        for channel in 0..3 {
            for value in ["count", "mean", "std", "min", "max", "snr_db", "clipped"] {
                assert_eq!(region[key][channel][value], patches[40][key][channel][value], "{file} {channel} {value}");
            }
        }
    }
    let text = String::from_utf8(shop.run("measure --patches rgb.exr", &[])).unwrap();
    assert!(text.starts_with("912 patches, 14x10 pixels of ADU [ADU] in each\nsample  count   R mean"), "{text}");
    // Title, heading, patches, and what standard deviations count.
    assert_eq!(text.lines().count(), 915);
    let csv = String::from_utf8(shop.run("measure --patches=20x16 rgb.exr --output-format csv", &[])).unwrap();
    assert!(
        csv.lines()
            .next()
            .unwrap()
            .ends_with(",z_std,sample,patch_column,patch_row,mean_error,std_error,quantity,unit")
    );
    assert!(csv.lines().last().unwrap().contains(",911,37,23,"));
    assert_eq!(csv.lines().count(), 1 + 3 * 912);
    let plain = String::from_utf8(shop.run("measure rgb.exr --output-format csv", &[])).unwrap();
    assert!(plain.lines().next().unwrap().ends_with(",z_std,mean_error,std_error,quantity,unit"));
    for line in ["measure --patches lab.exr --output-format json", "measure --patches plane.exr --output-format json"] {
        assert_eq!(shop.run(&format!("{line} --threads 1"), &[]), shop.run(&format!("{line} --threads 3"), &[]));
    }
}

/// In a pipeline each program has one thread; alone, or where it is told to, it has more.
#[test]
fn frames_through_a_pipe_take_one_thread() {
    let shop = Workshop::with_frames();
    let is_alone = |line: &str, input: Stdio, output: Stdio| {
        let done = shop.command(line).stdin(input).stdout(output).stderr(Stdio::piped()).output().unwrap();
        assert!(done.status.success(), "{line}");
        !String::from_utf8_lossy(&done.stderr).contains("one thread, as frames pass through a pipe")
    };
    let file = || Stdio::from(File::open(shop.path("noisy.exr")).unwrap());
    let place = || Stdio::from(File::create(shop.path("place.exr")).unwrap());
    assert!(is_alone("digitize -v", file(), place()));
    assert!(is_alone("digitize noisy.exr -v", Stdio::piped(), place()));
    assert!(!is_alone("digitize noisy.exr -v", file(), Stdio::piped()));
    assert!(!is_alone("render-radiance --dark --size 3x2 -v", Stdio::null(), Stdio::piped()));
    assert!(is_alone("digitize -v --threads 2", file(), Stdio::piped()));
    // What goes down these pipes is no frame.
    assert!(is_alone("measure noisy.exr -v", file(), Stdio::piped()));
    assert!(is_alone("color-difference xyz.exr 1,2,3 -v", file(), Stdio::piped()));
    assert!(is_alone("predict-noise --electrons 1,2,3 -v", file(), Stdio::piped()));
    let output = shop.attempt("measure -v", &shop.bytes("noisy.exr"));
    assert!(
        String::from_utf8_lossy(&output.stderr).starts_with("measure: one thread, as frames pass through a pipe; ")
    );
}

/// Rows leave before the last has come: half of a frame goes in, and some of the result comes out.
#[test]
fn every_stage_of_a_pipeline_streams() {
    let shop = Workshop::new();
    // 12 MB of expected electrons, of which a band takes one.
    let frame = shop.run("render-radiance --electrons 90,900,9000 --size 1000x1000", &[]);
    for line in ["add-noise", "mosaic", "digitize"] {
        let mut child = shop.spawn(line, Stdio::piped());
        let (mut stdin, mut stdout) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let (come, has_come) = mpsc::channel();
        let reader = std::thread::spawn(move || {
            let mut first = vec![0; 1 << 19];
            come.send(stdout.read_exact(&mut first).is_ok()).unwrap();
            let mut rest = Vec::new();
            stdout.read_to_end(&mut rest).unwrap();
            first.len() + rest.len()
        });
        let (half, rest) = frame.split_at(frame.len() / 2);
        stdin.write_all(half).unwrap();
        let streams = has_come.recv_timeout(Duration::from_secs(60));
        if streams != Ok(true) {
            child.kill().unwrap();
        }
        assert_eq!(streams, Ok(true), "{line} keeps its rows back");
        stdin.write_all(rest).unwrap();
        drop(stdin);
        assert!(child.wait().unwrap().success(), "{line}");
        assert!(reader.join().unwrap() > 1_000_000 * 4);
    }
}

/// `… | head -c 100`: whoever listens has heard enough, and that is no error.
#[test]
fn a_closed_pipe_is_no_error() {
    let shop = Workshop::new();
    let frame = shop.run("render-radiance --electrons 90,900,9000 --size 1000x500", &[]);
    fs::write(shop.path("expected.exr"), frame).unwrap();
    for line in [
        "render-radiance --dark --size 1000x500",
        "add-noise expected.exr",
        "mosaic expected.exr",
        "digitize expected.exr --format tiff --quiet",
    ] {
        let mut child = shop.spawn(line, Stdio::null());
        let mut first = [0; 100];
        let mut stdout = child.stdout.take().unwrap();
        stdout.read_exact(&mut first).unwrap();
        drop(stdout);
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{line}: {output:?}");
    }
}

/// A frame and its darks through a sensor that loses charge, and back.
#[test]
fn darks_and_transfer_are_taken_back() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 900,9000,19000 --size 60x50 --cfa rggb | add-noise --cte 0.9995 | digitize -o light.tiff");
    for frame in 1..4 {
        let scene = "render-radiance --dark --size 60x50 --cfa rggb";
        shop.pipe(&format!("{scene} | add-noise --cte 0.9995 --frame {frame} | digitize -o dark{frame}.tiff"));
    }
    let darks = "--dark dark1.tiff --dark dark2.tiff --dark dark3.tiff";
    shop.run(&format!("correct-frame light.tiff {darks} --cte 0.9995 -o corrected.tiff"), &[]);
    let (samples, metadata) = shop.read("corrected.tiff");
    // Thirds of codes, some below zero, are not what 16 bits hold.
    assert!(samples.iter().any(|sample| sample.fract() != 0.0));
    assert_eq!(metadata.black_level_adu, Some(0.0.into()));
    let white = (4095.0 - shop.read("light.tiff").1.uniform_black_adu().unwrap()) / 0.9995_f64.powi(2);
    assert!((metadata.white_level_adu.unwrap().uniform().unwrap() - white).abs() < 1e-9);
    let record = metadata.correction.unwrap();
    assert_eq!((record.black_adu, record.dark_frames, record.cte), (0.0.into(), 3, Some(0.9995)));
    assert_eq!(metadata.noise.unwrap().cte, Some(0.9995));
    // On through the chain: black is off already.
    shop.run("demosaic corrected.tiff -o rgb.exr", &[]);
    let (rgb, metadata) = shop.read("rgb.exr");
    assert_eq!(metadata.demosaic.unwrap().black, 0.0.into());
    for (class, electrons) in [900.0, 9000.0, 19_000.0].into_iter().enumerate() {
        let rows = rgb.chunks(60).skip(class).step_by(3).flatten();
        let mean = rows.map(|sample| f64::from(*sample)).sum::<f64>() / 3000.0;
        // A photosite of 19,000 e⁻ scatters by 210 e⁻ at most: shot noise 138, PRNU 152, read noise and darks 30. Five
        // times that of the mean of 750, doubled because edges and the other classes lend some of them weight.
        let wanted = 0.058824 * electrons;
        assert!((mean - wanted).abs() < 0.058824 * 10.0 * 210.0 / 750.0_f64.sqrt(), "{class}: {mean} {wanted}");
    }
    // 16 bits are refused, and so is what would write over a dark.
    for (line, complaint) in [
        ("light.tiff --black auto --sample-type u16 -o other.tiff", "u16 would round or clip ADU; write f32"),
        (
            "light.tiff --dark dark1.tiff --dark dark2.tiff -o ./dark2.tiff",
            "./dark2.tiff: it is the same file as the input dark2.tiff; name another output",
        ),
        (
            "corrected.tiff --black auto",
            "corrected.tiff: it holds a CFA plane of ADU that is corrected already; correction is done once",
        ),
    ] {
        let output = shop.attempt(&format!("correct-frame {line}"), &[]);
        assert_eq!(String::from_utf8_lossy(&output.stderr), format!("correct-frame: {complaint}\n"));
        assert!(!output.status.success() && output.stdout.is_empty());
    }
}

/// Predictions, checks and layers of uncertainty as a shell sees them, and the likely mistakes.
#[test]
#[allow(clippy::too_many_lines, reason = "a session at the shell, in its order")]
fn noise_is_predicted_checked_and_carried_along() {
    let shop = Workshop::new();
    shop.pipe(
        "render-radiance --electrons 900,9000,19000 --size 60x50 | add-noise | digitize | mosaic | demosaic -o rgb.exr",
    );
    shop.run(
        "fit-matrix -q --train 20 SAMPLES -o m.yaml"
            .replace("SAMPLES", &format!("{TREE}/sample_data/skies/sky912.exr"))
            .as_str(),
        &[],
    );
    assert!(shop.attempt("measure rgb.exr --check", &[]).status.success());
    let failed = shop.attempt("measure rgb.exr --check --equations paper --level 1", &[]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stdout).contains("not as predicted: 9 tests"));
    assert!(String::from_utf8_lossy(&failed.stderr).starts_with("measure: rgb.exr: it is not as predicted"));
    // Layers go to a file, and down a pipe into the next stage, which takes R, G and B of them.
    shop.pipe("render-radiance --electrons 900,9000,19000 --size 60x50 --cfa rggb | add-noise | digitize -o cfa.exr");
    shop.pipe("demosaic cfa.exr --sigma | to-xyz --matrix m.yaml --sigma -o xyz.exr");
    assert_eq!(shop.read("xyz.exr").0.len(), 60 * 50 * 3);
    let measured = String::from_utf8(shop.run("measure xyz.exr --output-format csv", &[])).unwrap();
    for channel in ["X", "Z", "covariance.XY", "sigma.R"] {
        assert!(measured.contains(&format!(",{channel},3000,")), "{channel}: {measured}");
    }
    for (line, status, complaint) in [
        (
            "demosaic cfa.exr --sigma -o s.tiff",
            2,
            "a TIFF has no names for the layers of standard deviations; write an EXR",
        ),
        (
            "to-xyz rgb.exr --matrix m.yaml --space srgb --sigma",
            2,
            "standard deviations are those of xyz, xyy, lab, luv, cct or linear-srgb; srgb is a picture to look at",
        ),
        ("predict-noise", 2, "give a spectrum, --electrons R,G,B, --dark or --sweep"),
        ("predict-noise --dark --sweep 1:10:3lin", 2, "a sweep scales the signal of a scene, but this one is dark"),
        (
            "predict-noise --dark --method mhc --equations paper",
            2,
            "the paper has no equations for the method mhc; choose bi, shti or eci",
        ),
        (
            "predict-noise --dark --uncertainty 1jnd",
            2,
            "an uncertainty in jnd needs colors; give --matrix FILE, or --matrix sensor",
        ),
        (
            "predict-noise --dark --plot curve.jpg",
            2,
            "curve.jpg: a plot is written as SVG or PNG; end the name in .svg or .png",
        ),
        (
            "measure cfa.exr --check --region 70,0,5,5",
            2,
            "cfa.exr: region 70,0,5,5 does not lie within the frame of 60x50",
        ),
    ] {
        let output = shop.attempt(line, &[]);
        let program = line.split(' ').next().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stderr), format!("{program}: {complaint}\n"), "{line}");
        assert_eq!(output.status.code(), Some(status), "{line}");
    }
}

/// What works, but may not be what was meant.
#[test]
fn planes_apart_and_unlike_darks_are_told_of() {
    let shop = Workshop::with_frames();
    let output = shop.attempt("add-noise expected.exr --cte 0.9999 -o moved.exr", &[]);
    assert!(output.status.success());
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "add-noise: warning: each of the three planes is transferred by itself, as if its class were at every photosite; \
         for what a sensor does run `mosaic` first\n"
    );
    shop.pipe("render-radiance --dark --exposure 2 --size 8x6 | add-noise --temperature 300 | digitize -o dark.exr");
    let output = shop.attempt("correct-frame codes.exr --dark dark.exr -o less.exr", &[]);
    assert!(output.status.success());
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "correct-frame: warning: dark.exr: its exposure is 2 s, but that of codes.exr is 0.033 s; their dark signals \
         differ\ncorrect-frame: warning: dark.exr: its temperature is 300 K, but that of codes.exr is 333 K; their dark \
         signals differ\n"
    );
}

fn close(found: &serde_json::Value, expected: f64, tolerance: f64) -> bool {
    found.as_f64().is_some_and(|found| (found - expected).abs() <= tolerance)
}

/// The first pair of Sharma, Wu and Dalal; and by hand L* = 116 · 0.2^⅓ − 16 of a fifth of the white, whose difference
/// from white is in lightness alone.
#[test]
fn two_colors_are_compared() {
    let shop = Workshop::new();
    let found = shop.difference("50,2.6772,-79.7751 50,0,-82.7485 --space lab");
    assert!(close(&found["delta_e_2000"]["median"], 2.0425, 0.5e-4), "{found}");
    let by_distance = 2.6772_f64.hypot(82.7485 - 79.7751);
    assert!(close(&found["delta_e_76"]["max"], by_distance, 1e-12));
    assert!(close(&found["jnd"]["max"], by_distance / 2.3, 1e-12));
    assert_eq!((&found["white"], &found["count"], &found["not_finite"]), (&().into(), &1.into(), &0.into()));
    // Negative numbers are no options, wherever they stand.
    let found = shop.difference("--space lab 50,2.6772,-79.7751 -50,2.6772,-79.7751");
    assert!(close(&found["delta_e_94"]["mean"], 100.0, 1e-9));
    let found = shop.difference("-1,2,3 -1,2,3 --space lab");
    assert_eq!(found["delta_e_76"]["below_tenth"], 1.0);
    // The first is the reference of the 1994 formula, by whose chroma of 50 the second's is weighed.
    let found = shop.difference("60,30,40 60,0,0 --space lab");
    assert!(close(&found["delta_e_94"]["mean"], 50.0 / 3.25, 1e-9));
    let found = shop.difference("60,0,0 60,30,40 --space lab");
    assert!(close(&found["delta_e_94"]["mean"], 50.0, 1e-9));

    let lightness = 116.0 * 0.2_f64.cbrt() - 16.0;
    let found = shop.difference("20,20,20 100,100,100 --white e");
    assert!(close(&found["delta_e_76"]["mean"], 100.0 - lightness, 1e-9));
    let found = shop.difference("1,2,3 5,10,15 --white 5,10,15");
    assert!(close(&found["delta_e_76"]["mean"], 100.0 - lightness, 1e-9));
    let text = String::from_utf8(shop.run("color-difference 20,30,40 21,30,40", &[])).unwrap();
    let head: Vec<&str> = text.lines().take(4).collect();
    let expected =
        ["reference: 20,30,40, XYZ", "compared: 21,30,40, XYZ", "white: XYZ 95.046 100.000 108.906", "pixels: 1"];
    assert_eq!(head, expected);
    assert_eq!(text.lines().count(), 9, "{text}");
    let csv = String::from_utf8(shop.run("color-difference 1,2,3 3,2,1 --output-format csv", &[])).unwrap();
    let names: Vec<&str> = csv.lines().map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(names, ["formula", "delta_e_76", "jnd", "delta_e_94", "delta_e_2000"]);
    assert_eq!(shop.run("color-difference 1,2,3 3,2,1 --output-format yaml -o report.yaml", &[]), b"");
    assert!(shop.bytes("report.yaml").starts_with(b"delta_e_76:\n  min: "));
}

/// Frames of one scene with two noises: XYZ, xyY and L*a*b* give one result, through files and pipes; the map holds what
/// the statistics are of.
/// A table of spectra is a chart as an image is: six spectra make three columns and two rows of patches, and each patch is
/// what its spectrum gives alone.
#[test]
fn a_table_of_spectra_makes_a_chart() {
    let shop = Workshop::with_frames();
    let mut table = String::from("# Unit: W cm-2 sr-1 nm-1\nwavelength_nm,a,b,c,d,e,f\n");
    for nm in (360..=830).step_by(10) {
        let radiance = |i: i32| f64::from(1 + i) * 1e-6 * (1.0 + 0.3 * (f64::from(nm + 40 * i) / 60.0).sin());
        let cells: Vec<String> = (0..6).map(|i| radiance(i).to_string()).collect();
        table.push_str(&format!("{nm},{}\n", cells.join(",")));
    }
    fs::write(shop.path("six.csv"), table).unwrap();
    shop.run("render-radiance six.csv --patch 4x2 --exposure 0.001 -o chart.exr", &[]);
    let (chart, metadata) = shop.read("chart.exr");
    // Rows of three planes of 12 columns.
    assert_eq!(chart.len(), 4 * 3 * 12);
    let scene = metadata.scene.unwrap();
    assert_eq!((scene.patch, scene.source_width), (Some([4, 2]), Some(3)));
    for (index, name) in ["a", "b", "c", "d", "e", "f"].into_iter().enumerate() {
        shop.run(&format!("render-radiance six.csv --column {name} --size 4x2 --exposure 0.001 -o {name}.exr"), &[]);
        let (alone, _) = shop.read(&format!("{name}.exr"));
        for channel in 0..3 {
            let (x, y) = (4 * (index % 3) + 3, 2 * (index / 3) + 1);
            assert_eq!(chart[(3 * y + channel) * 12 + x].to_bits(), alone[4 * channel].to_bits(), "{name} {channel}");
        }
    }
}

#[test]
fn images_are_compared_with_images_and_colors() {
    let shop = Workshop::with_frames();
    for seed in [8, 9] {
        shop.pipe(&format!("add-noise expected.exr --seed {seed} | digitize | mosaic | demosaic -o rgb{seed}.exr"));
        for space in ["xyz", "xyy", "lab"] {
            shop.run(&format!("to-xyz rgb{seed}.exr --matrix matrix.yaml --space {space} -o {space}{seed}.exr"), &[]);
        }
    }
    shop.run("to-xyz rgb9.exr --matrix matrix.yaml --sigma -o sigma9.exr", &[]);
    let whole = shop.difference("xyz8.exr xyz9.exr --map map.exr");
    assert_eq!(whole["count"], 48);
    let white = shop.sidecar("xyz8.exr").color.unwrap().white.unwrap();
    assert!((0..3).all(|i| close(&whole["white"][i], white[i], 1e-9)));
    assert_eq!(shop.difference("xyz8.exr sigma9.exr"), whole, "further channels do not count");
    for pair in ["lab8.exr lab9.exr", "xyy8.exr lab9.exr", "lab8.exr xyz9.exr"] {
        let same = shop.difference(pair);
        for formula in ["delta_e_76", "jnd", "delta_e_94", "delta_e_2000"] {
            for key in ["min", "mean", "median", "p95", "max"] {
                let expected = whole[formula][key].as_f64().unwrap();
                // L*a*b* of a size of 100 is stored in 24 bits: 4·10⁻⁶ in each coordinate, and differences are at most that far
                // off by their largest slope, a few.
                assert!(close(&same[formula][key], expected, 1e-4), "{pair} {formula} {key}");
            }
        }
    }
    let piped = shop.run("color-difference - xyz9.exr --output-format json", &shop.bytes("xyz8.exr"));
    assert_eq!(serde_json::from_slice::<serde_json::Value>(&piped).unwrap(), whole);

    let (map, metadata) = shop.read("map.exr");
    assert_eq!(metadata.quantity, QuantityKind::ColorDifference);
    let last = metadata.history.last().unwrap();
    assert_eq!((last.program.as_str(), last.arguments.join(" ")), ("color-difference", "xyz8.exr xyz9.exr".into()));
    shop.run("measure map.exr", &[]);
    for (plane, formula) in ["delta_e_2000", "delta_e_76", "delta_e_94", "jnd"].into_iter().enumerate() {
        let mut pixels: Vec<f64> = map
            .chunks(4 * 8)
            .flat_map(|row| &row[8 * plane..8 * (plane + 1)])
            .map(|&sample| f64::from(sample))
            .collect();
        pixels.sort_by(f64::total_cmp);
        let found = &whole[formula];
        let mean = pixels.iter().sum::<f64>() / 48.0;
        let expected =
            [("min", pixels[0]), ("mean", mean), ("median", (pixels[23] + pixels[24]) / 2.0), ("max", pixels[47])];
        for (key, expected) in expected {
            // Half a unit in the last of 24 bits.
            assert!(close(&found[key], expected, expected * 2f64.powi(-24)), "{formula} {key}");
        }
        for (key, limit) in [("below_tenth", 0.1), ("below_quarter", 0.25), ("below_half", 0.5)] {
            assert!(close(&found[key], pixels.iter().filter(|&&pixel| pixel < limit).count() as f64 / 48.0, 1e-12));
        }
    }

    // A frame against the color of one of its pixels.
    let (samples, _) = shop.read("xyz8.exr");
    let color = [0, 8, 16].map(|place| f64::from(samples[place]).to_string()).join(",");
    let found = shop.difference(&format!("{color} xyz8.exr --map map.exr"));
    assert_eq!((found["count"].as_u64(), found["delta_e_76"]["min"].as_f64()), (Some(48), Some(0.0)));
    assert_eq!(shop.read("map.exr").0[8], 0.0);
}

#[test]
fn images_without_metadata_are_what_space_says() {
    let shop = Workshop::new();
    shop.write_colors("a.exr", QuantityKind::Unspecified, &[[50.0, 3.0, 4.0], [50.0, 0.0, f32::NAN], [40.0, 0.0, 0.0]]);
    let output = shop.attempt("color-difference 50,0,0 a.exr --space lab --map map.exr --output-format json", &[]);
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "color-difference: warning: 1 pixel is NaN or infinite; it is left out of the statistics\n"
    );
    assert!(output.status.success());
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&found["count"], &found["not_finite"]), (&2.into(), &1.into()));
    assert!(close(&found["delta_e_76"]["mean"], 7.5, 1e-12) && close(&found["delta_e_76"]["max"], 10.0, 1e-12));
    let (map, _) = shop.read("map.exr");
    assert!(map[4..8].iter().all(|sample| sample.is_nan()) && map[1] == 5.0 && map[9] == 10.0, "{map:?}");
    assert_eq!(shop.sidecar("map.exr").samples.unwrap().not_finite, Some(1));

    shop.write_colors("b.exr", QuantityKind::Unspecified, &[[100.0; 3], [20.0; 3]]);
    let found = shop.difference("100,100,100 b.exr --white e --white-luminance 100");
    assert!(close(&found["delta_e_76"]["max"], 116.0 - 116.0 * 0.2_f64.cbrt(), 1e-9), "{found}");
    shop.write_colors("c.exr", QuantityKind::Lab, &[[f32::NAN; 3]]);
    let refused = |line: &str, status: i32, complaint: &str| {
        let files = shop.files();
        let output = shop.attempt(line, &[]);
        assert_eq!(String::from_utf8_lossy(&output.stderr), format!("color-difference: {complaint}\n"), "{line}");
        assert_eq!((output.status.code(), shop.files()), (Some(status), files), "{line}");
    };
    refused(
        "color-difference b.exr 1,2,3",
        BAD_DATA,
        "b.exr: the metadata has no `color.white`; give --white-luminance CD_PER_M2",
    );
    refused(
        "color-difference a.exr b.exr",
        BAD_DATA,
        "b.exr: its size is 1x2, but that of a.exr is 1x3; compare images of one size",
    );
    refused(
        "color-difference c.exr 1,2,3 --space lab --map new.exr",
        BAD_DATA,
        "c.exr: no pixel can be compared with 1,2,3; in every pair a color is NaN or infinite",
    );
    for option in ["--map", "-o"] {
        let complaint = "b.exr: it is the same file as the input b.exr; name another output";
        refused(&format!("color-difference 1,2,3 b.exr --white-luminance 9 {option} b.exr"), BAD_USAGE, complaint);
    }
    // What is the name of a file is a file.
    fs::rename(shop.path("b.exr"), shop.path("1,2,3")).unwrap();
    assert_eq!(shop.difference("1,2,3 4,5,6 --white-luminance 9")["count"], 2);
}

#[test]
fn the_sidecar_tells_what_was_done_and_what_came_of_it() {
    let shop = Workshop::new();
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    let bright = "render-radiance --electrons 100,39900,45000 --size 32x20";
    shop.run(&format!("{bright} -q -o expected.exr"), &[]);
    let output = shop.attempt("add-noise expected.exr --seed 7 --frame 2 -v -o noisy.exr", &[]);
    assert!(output.status.success());
    let output = shop.attempt("digitize noisy.exr -q --threads 2 -o codes.tiff", &[]);
    assert!(output.status.success() && output.stderr.is_empty(), "--quiet is quiet");
    shop.run("mosaic codes.tiff -q --compression zip -o plane.exr", &[]);
    shop.run("demosaic plane.exr -q --method bi -orgb.exr", &[]);
    shop.run("to-xyz -q --output=xyz.exr --matrix matrix.yaml rgb.exr", &[]);

    let metadata = shop.sidecar("xyz.exr");
    let history: Vec<String> =
        metadata.history.iter().map(|entry| format!("{} {}", entry.program, entry.arguments.join(" "))).collect();
    // Where and how the output is stored is left out: the samples do not depend on it.
    assert_eq!(
        history,
        [
            bright,
            "add-noise expected.exr --seed 7 --frame 2",
            "digitize noisy.exr",
            "mosaic codes.tiff",
            "demosaic plane.exr --method bi",
            "to-xyz --matrix matrix.yaml rgb.exr",
        ]
    );
    assert!(metadata.history.iter().all(|entry| entry.version == env!("CARGO_PKG_VERSION")));

    for name in ["expected.exr", "noisy.exr", "codes.tiff", "plane.exr", "rgb.exr", "xyz.exr"] {
        let mut sidecar = shop.sidecar(name);
        let (samples, _) = shop.read(name);
        let record = sidecar.samples.take().unwrap();
        assert_eq!(record.digest, format!("blake3:{}", blake3::hash(&bytes_of(&samples)).to_hex()), "{name}");
        let count = |is: &dyn Fn(f32) -> bool| {
            let count = samples.iter().filter(|&&sample| is(sample)).count() as u64;
            (count > 0).then_some(count)
        };
        match name {
            "codes.tiff" => {
                // Every code at the top was cut off there but for those that were just right.
                let at_top = count(&|code| code >= 4095.0).unwrap();
                assert!(record.clipped_high.unwrap() <= at_top && record.clipped_high.unwrap() > 640);
                assert_eq!(record.clipped_low, None);
            }
            "noisy.exr" => {
                // 45,000 e⁻ always overflow, 39,900 with 73 more often, 100 never.
                let full = record.full_well.unwrap();
                assert!((641..1280).contains(&full), "{full}");
            }
            _ => assert_eq!((record.full_well, record.clipped_high), (None, None), "{name}"),
        }
        assert_eq!(record.not_finite, None);
        // What the file itself carries is the same, but for what only the last row could tell; readers take the seal off.
        assert_eq!(
            sidecar.seal.take().unwrap().size,
            [shop.frame(name).header.geometry.width, shop.frame(name).header.geometry.height]
        );
        fs::rename(shop.path(&format!("{name}.yaml")), shop.path("aside.yaml")).unwrap();
        assert_eq!(shop.read(name).1, sidecar, "{name}");
        fs::rename(shop.path("aside.yaml"), shop.path(&format!("{name}.yaml"))).unwrap();
    }
}

#[test]
fn samples_that_are_not_the_sidecars_are_told_of() {
    let shop = Workshop::with_frames();
    fs::copy(shop.path("expected.exr"), shop.path("noisy.exr")).unwrap();
    let output = shop.attempt("measure noisy.exr", &[]);
    assert!(output.status.success());
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "measure: warning: noisy.exr: its samples are not those that noisy.exr.yaml describes; one of the two was \
         changed\n"
    );
}

#[test]
fn unknown_keys_go_down_the_chain() {
    let shop = Workshop::with_frames();
    let sidecar = shop.path("expected.exr.yaml");
    let mut file = File::options().append(true).open(sidecar).unwrap();
    writeln!(file, "observatory: Pic du Midi").unwrap();
    drop(file);
    shop.run("add-noise expected.exr -o noisy.exr", &[]);
    shop.run("digitize noisy.exr -o codes.tiff", &[]);
    fs::remove_file(shop.path("codes.tiff.yaml")).unwrap();
    shop.run("mosaic codes.tiff -o plane.exr", &[]);
    let text = String::from_utf8(shop.bytes("plane.exr.yaml")).unwrap();
    assert!(text.contains("\nobservatory: Pic du Midi\n"), "{text}");
}

#[test]
fn every_program_tells_its_version_and_its_options() {
    let shop = Workshop::new();
    for program in programs() {
        let version = shop.run(&format!("{program} --version"), &[]);
        let version = String::from_utf8(version).unwrap();
        let project = if program == "cyanometer" { "" } else { " (cyanometer)" };
        let expected = format!("{program}{project} {}", env!("CARGO_PKG_VERSION"));
        // A build that was told its commit says it behind the version.
        let rest = version.strip_prefix(&expected).unwrap_or_else(|| panic!("{version}"));
        assert!(rest == "\n" || rest.starts_with(" (") && rest.ends_with(")\n"), "{version}");
        let help = String::from_utf8(shop.run(&format!("{program} --help"), &[])).unwrap();
        assert!(help.contains(&format!("Usage: {program} ")), "{help}");
        // The front door works on nothing itself.
        let talking: &[&str] = if program == "cyanometer" { &[] } else { &["--quiet", "--verbose"] };
        for option in ["--help", "--version"].iter().chain(talking) {
            assert!(help.contains(option), "{program}: no {option} in its help");
        }
        assert!(shop.files().is_empty(), "{program}");
    }
}

/// Sidecars of earlier versions hold SHA-256; a digest of either kind that does not match is a warning.
#[test]
fn digests_of_both_kinds_are_compared() {
    let shop = Workshop::with_frames();
    let text = String::from_utf8(shop.bytes("noisy.exr.yaml")).unwrap();
    let (samples, metadata) = shop.read("noisy.exr");
    let digest = metadata.samples.unwrap().digest;
    let sha256 =
        sha2::Sha256::digest(bytes_of(&samples)).iter().fold(String::new(), |hex, byte| format!("{hex}{byte:02x}"));
    for (digest_now, is_right) in [
        (digest.clone(), true),
        (format!("sha256:{sha256}"), true),
        (format!("sha256:{}", sha256.replace('0', "1")), false),
        (digest.replace('0', "1"), false),
        (sha256, false),
    ] {
        fs::write(shop.path("noisy.exr.yaml"), text.replace(&digest, &digest_now)).unwrap();
        for threads in 1..=2 {
            let done = shop.attempt(&format!("digitize noisy.exr --threads {threads}"), &[]);
            let said = String::from_utf8_lossy(&done.stderr);
            assert_eq!(said.contains("one of the two was changed"), !is_right, "{digest_now}: {said}");
        }
    }
}

fn bytes_of(samples: &[f32]) -> Vec<u8> {
    samples.iter().flat_map(|sample| sample.to_le_bytes()).collect()
}
