//! The programs as a shell sees them: pipes, files, sidecars, complaints.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

mod support;

use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::output::{FrameWriter, OutputOptions};
use cyanometer::formats::yaml::parse_metadata;
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::stream::{Counts, RowSink, RowSource};
use cyanometer::units::QuantityKind;
use sha2::Digest;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::sync::mpsc;
use std::time::Duration;
use support::TREE;
use tempfile::TempDir;

/// The programs that there are, by their sources.
fn programs() -> Vec<String> {
    let sources = fs::read_dir(Path::new(TREE).join("src/bin")).unwrap();
    let mut names: Vec<String> =
        sources.map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned()).collect();
    names.sort();
    assert!(names.len() >= 8, "{names:?}");
    names
}

/// A program where cargo has built it; another name is left to the shell's path.
fn path_of(program: &str) -> PathBuf {
    let built = Path::new(env!("CARGO_BIN_EXE_add-noise")).with_file_name(program);
    if built.exists() { built } else { program.into() }
}

/// A directory to work in.
struct Workshop {
    directory: TempDir,
}

impl Workshop {
    fn new() -> Self {
        Self { directory: TempDir::new().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.directory.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// A command line, split at spaces.
    fn command(&self, line: &str) -> Command {
        let line = line.replace("SAMPLES", &format!("{TREE}/sample_data"));
        let mut words = line.split(' ');
        let mut command = Command::new(path_of(words.next().unwrap()));
        command.args(words).current_dir(self.directory.path()).env_remove("CYANOMETER_DATA");
        command.env_remove("CYANOMETER_VECTORS");
        command
    }

    /// Runs a command on `input` to its end.
    fn attempt(&self, line: &str, input: &[u8]) -> Output {
        let mut command = self.command(line);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut stdin = child.stdin.take().unwrap();
        let input = input.to_vec();
        // A program that refuses its input does not read it all.
        let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
        let output = child.wait_with_output().unwrap();
        writer.join().unwrap();
        output
    }

    /// Runs a command that shall succeed without a word on the standard error, and gives its output.
    #[track_caller]
    fn run(&self, line: &str, input: &[u8]) -> Vec<u8> {
        let output = self.attempt(line, input);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.is_empty(), "{line}: {} {said}", output.status);
        output.stdout
    }

    fn spawn(&self, line: &str, input: Stdio) -> Child {
        self.command(line)
            .stdin(input)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{line}: {error}"))
    }

    /// Runs a pipeline, all its commands at once, and gives what comes out at its end.
    #[track_caller]
    fn pipe(&self, pipeline: &str) -> Vec<u8> {
        let lines: Vec<&str> = pipeline.split(" | ").collect();
        let mut children: Vec<Child> = Vec::new();
        for line in &lines {
            let before: Option<ChildStdout> = children.last_mut().map(|child| child.stdout.take().unwrap());
            children.push(self.spawn(line, before.map_or(Stdio::null(), Stdio::from)));
        }
        let last = children.pop().unwrap().wait_with_output().unwrap();
        let mut outputs: Vec<Output> = children.into_iter().map(|child| child.wait_with_output().unwrap()).collect();
        outputs.push(last);
        for (line, output) in lines.iter().zip(&outputs) {
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success() && said.is_empty(), "{line}: {} {said}", output.status);
        }
        outputs.pop().unwrap().stdout
    }

    fn sidecar(&self, name: &str) -> Metadata {
        let text = String::from_utf8(self.bytes(&format!("{name}.yaml"))).unwrap();
        parse_metadata(name, &text).unwrap()
    }

    /// All samples of a frame and its metadata, by the library's reader.
    fn read(&self, name: &str) -> (Vec<f32>, Metadata) {
        let options = InputOptions { path: Some(self.path(name)), ..Default::default() };
        let mut reader = FrameReader::open(&options).unwrap();
        let (height, mut samples) = (reader.header().geometry.height, Vec::new());
        reader.read(height, &mut samples).unwrap();
        (samples, reader.header().metadata.clone())
    }

    /// One frame of each stage, and a matrix.
    fn with_frames() -> Self {
        let shop = Self::new();
        shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
        shop.run("render-radiance --electrons 100,200,300 --size 8x6 -o expected.exr", &[]);
        shop.run("add-noise expected.exr --seed 7 -o noisy.exr", &[]);
        shop.run("digitize noisy.exr -o codes.exr", &[]);
        shop.run("mosaic codes.exr -o plane.exr", &[]);
        shop.run("demosaic plane.exr -o rgb.exr", &[]);
        shop.run("to-xyz rgb.exr --matrix matrix.yaml -o xyz.exr", &[]);
        shop
    }
}

const SKY: &str = "render-radiance SAMPLES/skies/measured_blue.csv --expose-to 0.8 --size 64x48";

// --- good runs -----------------------------------------------------------------------------------------------------

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
        ("correct-frame --black auto --cte 0.999", "plane.exr"),
        ("demosaic --method shti", "plane.exr"),
        ("to-xyz --matrix matrix.yaml --space srgb", "rgb.exr"),
        ("measure", "noisy.exr"),
        ("measure --output-format json", "noisy.exr"),
    ]
    .map(|(line, input)| (line.to_owned(), input))
    .into();
    for storage in [
        "--format exr --compression zip",
        "--format exr --compression piz --sample-type f16",
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
    assert_eq!(text.lines().count(), 914);
    let csv = String::from_utf8(shop.run("measure --patches=20x16 rgb.exr --output-format csv", &[])).unwrap();
    assert!(csv.lines().next().unwrap().ends_with(",z_std,sample,patch_column,patch_row,mean_error,std_error"));
    assert!(csv.lines().last().unwrap().contains(",911,37,23,"));
    assert_eq!(csv.lines().count(), 1 + 3 * 912);
    let plain = String::from_utf8(shop.run("measure rgb.exr --output-format csv", &[])).unwrap();
    assert!(plain.lines().next().unwrap().ends_with(",z_std,mean_error,std_error"));
    for line in ["measure --patches lab.exr --output-format json", "measure --patches plane.exr --output-format json"] {
        assert_eq!(shop.run(&format!("{line} --threads 1"), &[]), shop.run(&format!("{line} --threads 3"), &[]));
    }
}

#[test]
fn threads_change_no_byte() {
    let shop = Workshop::new();
    let light = shop.run("render-radiance --electrons 90,900,9000 --size 300x200", &[]);
    let alone = shop.run("add-noise --threads 1", &light);
    assert_eq!(shop.run("add-noise --threads 3", &light), alone);
    let codes = shop.run("mosaic", &shop.run("digitize", &alone));
    for method in ["bi", "shti", "eci"] {
        let line = format!("demosaic --method {method}");
        let rgb = shop.run(&format!("{line} --threads 1"), &codes);
        assert_eq!(shop.run(&format!("{line} --threads 3"), &codes), rgb);
    }
    let report = shop.run("measure --output-format json --threads 1", &alone);
    assert_eq!(shop.run("measure --output-format json --threads 3", &alone), report);
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
        "digitize expected.exr --format tiff",
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
            "standard deviations are those of xyz, xyy or lab; srgb is a picture to look at",
        ),
        ("predict-noise", 2, "give a spectrum, --electrons R,G,B, --dark or --sweep"),
        ("predict-noise --dark --sweep 1:10:3lin", 2, "a sweep scales the signal of a scene, but this one is dark"),
        (
            "predict-noise --dark --method mhc --equations paper",
            2,
            "the paper has no equations for the method mhc; choose bi, shti or eci",
        ),
        ("predict-noise --dark --uncertainty 1jnd", 2, "an uncertainty in jnd needs colors; give --matrix FILE"),
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

// --- differences of colors -------------------------------------------------------------------------------------------

impl Workshop {
    /// What color-difference says in JSON.
    #[track_caller]
    fn difference(&self, arguments: &str) -> serde_json::Value {
        let report = self.run(&format!("color-difference {arguments} --output-format json"), &[]);
        serde_json::from_slice(&report).unwrap()
    }

    /// A frame of three planes and one column, a pixel a row.
    fn write_colors(&self, name: &str, quantity: QuantityKind, pixels: &[[f32; 3]]) {
        let header = FrameHeader {
            name: name.into(),
            geometry: Geometry::new(1, pixels.len(), &["R", "G", "B"]),
            metadata: Metadata::new(quantity),
        };
        let options = OutputOptions { path: Some(self.path(name)), ..Default::default() };
        let mut writer = FrameWriter::create(&options, &header, &[]).unwrap();
        writer.write(pixels.as_flattened()).unwrap();
        writer.finish(Counts::default()).unwrap();
    }
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
    let found = shop.difference("-1,2,3 -1,2,3");
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
    let mut table = String::from("wavelength_nm,a,b,c,d,e,f\n");
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
        "color-difference: warning: 1 pixels are NaN or infinite; they are left out of the statistics\n"
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

// --- sidecars ------------------------------------------------------------------------------------------------------

#[test]
fn the_sidecar_tells_what_was_done_and_what_came_of_it() {
    let shop = Workshop::new();
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    let bright = "render-radiance --electrons 100,39900,45000 --size 32x20";
    shop.run(&format!("{bright} -o expected.exr"), &[]);
    let output = shop.attempt("add-noise expected.exr --seed 7 --frame 2 -v -o noisy.exr", &[]);
    assert!(output.status.success());
    let output = shop.attempt("digitize noisy.exr -q --threads 2 -o codes.tiff", &[]);
    assert!(output.status.success() && output.stderr.is_empty(), "--quiet is quiet");
    shop.run("mosaic codes.tiff --compression zip -o plane.exr", &[]);
    shop.run("demosaic plane.exr --method bi -orgb.exr", &[]);
    shop.run("to-xyz --output=xyz.exr --matrix matrix.yaml rgb.exr", &[]);

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
        // What the file itself carries is the same, but for what only the last row could tell.
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

// --- help and mistakes ---------------------------------------------------------------------------------------------

#[test]
fn every_program_tells_its_version_and_its_options() {
    let shop = Workshop::new();
    for program in programs() {
        let version = shop.run(&format!("{program} --version"), &[]);
        let expected = format!("{program} {}\n", env!("CARGO_PKG_VERSION"));
        assert_eq!(String::from_utf8(version).unwrap(), expected);
        let help = String::from_utf8(shop.run(&format!("{program} --help"), &[])).unwrap();
        assert!(help.contains(&format!("Usage: {program} ")), "{help}");
        for option in ["--help", "--version", "--quiet", "--verbose"] {
            assert!(help.contains(option), "{program}: no {option} in its help");
        }
        assert!(shop.files().is_empty(), "{program}");
    }
}

const BAD_DATA: i32 = 1;
const BAD_USAGE: i32 = 2;

/// The likeliest mistakes with each program: the command, the exit status, the line.
const MISTAKES: [(&str, i32, &str); 74] = [
    ("render-radiance missing.csv", BAD_DATA, "missing.csv: cannot open: no such file or directory"),
    (
        "render-radiance --dark --size 8",
        BAD_USAGE,
        "`8` is no value for --size <WIDTHxHEIGHT>: a size is WIDTHxHEIGHT in photosites, such as 1332x1000; see \
         `render-radiance --help`",
    ),
    (
        "render-radiance --electrons 1,2",
        BAD_USAGE,
        "`1,2` is no value for --electrons <R,G,B>: give the electrons of R,G,B between commas, none below 0; see \
         `render-radiance --help`",
    ),
    (
        "render-radiance --dark --sensor kaf-5101",
        BAD_USAGE,
        "there is no sensor `kaf-5101`; known are kaf-5101ce; for a file of your own give its path, ending in .yaml",
    ),
    (
        "render-radiance sky.csv --electrons 1,2,3",
        BAD_USAGE,
        "[INPUT] and --electrons <R,G,B> exclude each other; see `render-radiance --help`",
    ),
    ("add-noise", BAD_DATA, "standard input: it is empty; the program before it wrote nothing"),
    (
        "add-noise noisy.exr",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons that have their noise already; noise is added once",
    ),
    (
        "add-noise codes.exr",
        BAD_DATA,
        "codes.exr: it holds three planes of ADU, not expected electrons of photosites; run `render-radiance` first",
    ),
    (
        "add-noise expected.exr --without ssm",
        BAD_USAGE,
        "`ssm` is no value for --without <SOURCES>; it is one of dcsn, dcnu, ssn, prnu, ron; did you mean `ssn`?; see \
         `add-noise --help`",
    ),
    (
        "add-noise expected.exr --sed 7",
        BAD_USAGE,
        "unknown option or extra argument `--sed`; did you mean `--seed`?; see `add-noise --help`",
    ),
    (
        "add-noise expected.exr -o expected.exr",
        BAD_USAGE,
        "expected.exr: it is the same file as the input expected.exr; name another output",
    ),
    (
        "add-noise matrix.yaml",
        BAD_DATA,
        "matrix.yaml: it is neither an EXR nor a TIFF file; it looks like text (a spectrum goes into \
         `render-radiance`)",
    ),
    (
        "add-noise expected.exr --cte 1.1",
        BAD_USAGE,
        "`1.1` is no value for --cte <X>: give a fraction above 0 and at most 1; see `add-noise --help`",
    ),
    ("correct-frame codes.exr", BAD_USAGE, "there is nothing to correct; give --black, --dark or --cte"),
    (
        "correct-frame noisy.exr --cte 0.9",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not ADU; run `digitize` first",
    ),
    (
        "correct-frame rgb.exr --black 3",
        BAD_DATA,
        "rgb.exr: it holds three demosaicked planes of ADU; corrections come before demosaicking",
    ),
    (
        "correct-frame codes.exr --cte 0.1",
        BAD_USAGE,
        "a charge transfer efficiency of 0.1 is too poor to be undone over 6 moves; errors would grow more than 1000 times",
    ),
    (
        "correct-frame codes.exr --dark plane.exr",
        BAD_DATA,
        "plane.exr: its number of planes is 1, but that of codes.exr is 3",
    ),
    (
        "correct-frame codes.exr --dark noisy.exr",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not ADU; run `digitize` first",
    ),
    (
        "correct-frame codes.exr --dark codes.exr --black 3",
        BAD_USAGE,
        "--dark <FILE> and --black <auto|none|N> exclude each other; see `correct-frame --help`",
    ),
    ("correct-frame codes.exr --dark missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    ("digitize codes.exr", BAD_DATA, "codes.exr: it holds three planes of ADU: it is digitized already"),
    ("digitize noisy.exr --bits 20", BAD_USAGE, "a converter of 20 bits is impossible here; give 1 to 16"),
    (
        "digitize noisy.exr --slope 0",
        BAD_USAGE,
        "`0` is no value for --slope <ADU_PER_E>: give a number above 0; see `digitize --help`",
    ),
    (
        "digitize noisy.exr -o codes.png",
        BAD_USAGE,
        "codes.png: `.png` names no format that is written here; end the name in .exr or .tiff, or give --format",
    ),
    ("mosaic plane.exr", BAD_DATA, "plane.exr: it is a CFA plane already, rggb"),
    (
        "mosaic codes.exr --pattern rgbg",
        BAD_USAGE,
        "`rgbg` is no value for --pattern <PATTERN>: a pattern is rggb, bggr, grbg or gbrg; see `mosaic --help`",
    ),
    (
        "mosaic xyz.exr",
        BAD_DATA,
        "xyz.exr: it holds three demosaicked planes of XYZ; a mosaic is made of the three planes R, G and B of a sensor",
    ),
    ("demosaic codes.exr", BAD_DATA, "codes.exr: it holds three planes of ADU, not a CFA plane; run `mosaic` first"),
    (
        "demosaic plane.exr --black dark",
        BAD_USAGE,
        "`dark` is no value for --black <auto|none|N>: give auto, none or a number; see `demosaic --help`",
    ),
    ("demosaic rgb.exr", BAD_DATA, "rgb.exr: it holds three demosaicked planes of ADU; demosaicking is done once"),
    ("demosaic plane.exr -o no/where.exr", BAD_DATA, "no/where.exr: there is no directory `no`; make it first"),
    ("to-xyz rgb.exr", BAD_USAGE, "--matrix <FILE> is missing; see `to-xyz --help`"),
    (
        "to-xyz plane.exr --matrix matrix.yaml",
        BAD_DATA,
        "plane.exr: it holds a CFA plane of ADU, not three classes at each pixel; run `demosaic` first",
    ),
    ("to-xyz rgb.exr --matrix missing.yaml", BAD_DATA, "missing.yaml: cannot open: no such file or directory"),
    (
        "to-xyz noisy.exr --matrix matrix.yaml",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not ADU; run `digitize` first",
    ),
    ("measure missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    ("measure noisy.exr --region 0,0,9,9", BAD_USAGE, "noisy.exr: region 0,0,9,9 does not lie within the frame of 8x6"),
    (
        "measure --patches noisy.exr",
        BAD_USAGE,
        "noisy.exr: its metadata tell of no patches of several photosites; give --patches=WxH",
    ),
    ("measure --patches=4x9 noisy.exr", BAD_USAGE, "noisy.exr: no patch of 4x9 lies whole within the frame of 8x6"),
    (
        "measure --patches=4x3 rgb.exr",
        BAD_USAGE,
        "rgb.exr: patches of 4x3 have no interior: eci mixes colors up to 3 pixels from their edges; they must be 7x7 at least",
    ),
    (
        "measure --patches=4 noisy.exr",
        BAD_USAGE,
        "`4` is no value for --patches[=<WxH>]: a size is WIDTHxHEIGHT in photosites, such as 1332x1000; see `measure --help`",
    ),
    (
        "measure --patches=4x3 noisy.exr --check",
        BAD_USAGE,
        "--patches[=<WxH>] and --check exclude each other; see `measure --help`",
    ),
    (
        "measure --patches=4x3 noisy.exr --region 0,0,1,1",
        BAD_USAGE,
        "--patches[=<WxH>] and --region <X,Y,W,H> exclude each other; see `measure --help`",
    ),
    ("measure noisy.exr codes.exr", BAD_USAGE, "unknown option or extra argument `codes.exr`; see `measure --help`"),
    (
        "measure noisy.exr --output-format xml",
        BAD_USAGE,
        "`xml` is no value for --output-format <OUTPUT_FORMAT>; it is one of text, json, yaml, csv; did you mean `yaml`?; see \
         `measure --help`",
    ),
    ("color-difference xyz.exr", BAD_USAGE, "<B> is missing; see `color-difference --help`"),
    ("color-difference xyz.exr missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    (
        "color-difference xyz.exr 1,2",
        BAD_USAGE,
        "`1,2` is no value for <B>: it is no option, no file, and no color, which is three numbers between commas; see \
         `color-difference --help`",
    ),
    (
        "color-difference rgb.exr xyz.exr",
        BAD_DATA,
        "rgb.exr: it holds three demosaicked planes of ADU, not colors; run `to-xyz` first",
    ),
    (
        "color-difference xyz.exr plane.exr",
        BAD_DATA,
        "plane.exr: it holds a CFA plane of ADU, not colors; run `to-xyz` first",
    ),
    (
        "color-difference xyz.exr noisy.exr",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not colors; run `to-xyz` first",
    ),
    ("color-difference - -", BAD_USAGE, "only one of A and B can be the standard input; name a file for the other"),
    (
        "color-difference 1,2,3 4,5,6 --map map.exr",
        BAD_USAGE,
        "a map needs an image; two colors have no map of differences",
    ),
    (
        "color-difference xyz.exr 4,5,6 --map map.tiff",
        BAD_USAGE,
        "`map.tiff` is no value for --map <FILE.exr>: end the name in .exr; see `color-difference --help`",
    ),
    (
        "color-difference xyz.exr 4,5,6 --map map.exr -o ./map.exr",
        BAD_USAGE,
        "the map and the report have the same place; name a file for each",
    ),
    (
        "color-difference 1,2,3 4,5,6 --white 1,0,1",
        BAD_USAGE,
        "a white of XYZ 1.000000 0.000000 1.000000 is impossible; all three must be above 0",
    ),
    (
        "color-difference 1,2,3 4,5,6 --white 1,1,1 --white-luminance 2",
        BAD_USAGE,
        "a white of X,Y,Z has its luminance already; leave out --white-luminance",
    ),
    (
        "color-difference xyz.exr 4,5,6 --map -",
        BAD_USAGE,
        "the map and the report have the same place; name a file for each",
    ),
    ("fit-matrix", BAD_USAGE, "<LIBRARY> is missing; see `fit-matrix --help`"),
    ("fit-matrix missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --hold-out maritime23",
        BAD_USAGE,
        "--hold-out names labels; give them with --labels FILE:COLUMN",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --labels SAMPLES/skies/sky912_meta.csv:aerosol --hold-out marine",
        BAD_USAGE,
        "no sample has the label `marine`; there are maritime23, none, rural25, rural5, tropospheric50, urban5",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --white-sample 3",
        BAD_USAGE,
        "sky-rad-ls keeps no sample exact; leave out --white-sample, or choose another --method",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --method max-ign-sppls --train 20",
        BAD_USAGE,
        "max-ign-sppls is fitted on the responses alone; it has no training samples",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --train 5,5,5,5",
        BAD_DATA,
        "4 training samples do not determine the matrix: only 1 of the 3 signals they need are independent; give more \
         varied ones",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --plot x.svg",
        BAD_USAGE,
        "--plot draws the trade-off of --noise-weight; give that too",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --evaluate SAMPLES/skies/sky912.exr --expose-to 1.5",
        BAD_USAGE,
        "`1.5` is no value for --expose-to <FRACTION>: give a fraction above 0 and at most 1; see `fit-matrix --help`",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --white 0,0,0",
        BAD_USAGE,
        "a white of XYZ 0 0 0 is impossible; all three must be above 0",
    ),
    ("predict-noise --all-samples", BAD_USAGE, "--all-samples is for a library of spectra; name one"),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --train 2000",
        BAD_USAGE,
        "the library has 912 samples to train on, fewer than 2000",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --train 0,1",
        BAD_DATA,
        "2 training samples do not determine the matrix: only 2 of the 3 signals they need are independent; give more \
         varied ones",
    ),
    ("preview expected.exr", BAD_USAGE, "--output <FILE.png> is missing; see `preview --help`"),
    ("preview missing.exr -o picture.png", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
];

#[test]
fn mistakes_are_answered_in_one_line() {
    let shop = Workshop::with_frames();
    let files = shop.files();
    for (line, status, complaint) in MISTAKES {
        let output = shop.attempt(line, &[]);
        let program = line.split(' ').next().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(said, format!("{program}: {complaint}\n"), "{line}");
        assert_eq!(output.status.code(), Some(status), "{line}");
        assert!(output.stdout.is_empty(), "{line}");
        assert_eq!(shop.files(), files, "{line} leaves something behind");
    }
}

#[test]
fn an_unknown_set_of_instructions_is_a_mistake() {
    let shop = Workshop::with_frames();
    for (name, is_known) in [("avx2", true), ("baseline", true), ("", true), ("sse9", false)] {
        let output = shop.command("mosaic expected.exr").env("CYANOMETER_VECTORS", name).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let complaint =
            format!("mosaic: CYANOMETER_VECTORS={name} names no instructions; give one of baseline, avx2, avx512\n");
        assert_eq!(said, if is_known { "" } else { &complaint });
        assert_eq!(output.status.code(), Some(if is_known { 0 } else { 2 }));
    }
}

/// Samples of a chain whose bits are known: those of x86-64 with SSE2, AVX2 and AVX-512, and of aarch64. A change here is a
/// change of samples, which the changelog says first.
#[test]
fn the_bits_of_a_chain_are_known_and_those_of_every_processor() {
    let shop = Workshop::new();
    fs::write(shop.path("matrix.yaml"), KNOWN_MATRIX).unwrap();
    for vectors in ["baseline", "avx2", "avx512"] {
        for (line, digest) in KNOWN {
            let output = shop.command(line).env("CYANOMETER_VECTORS", vectors).output().unwrap();
            assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
            let made = shop.sidecar(line.split("-o ").nth(1).unwrap()).samples.unwrap().digest;
            assert!(made.starts_with(digest), "{line} on {vectors}: {made}");
        }
    }
}

const KNOWN_MATRIX: &str = "\
schema: cyanometer-matrix/1
sensor: kaf-5101ce
method: sky-rad-ls
unit: cd m-2 per (ADU s-1 sr-1)
xyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]]
";

const KNOWN: [(&str, &str); 9] = [
    ("render-radiance SAMPLES/skies/sky912.exr --patch 6x5 --cfa grbg -o rates.exr", "blake3:2db94414f43002d2"),
    ("add-noise rates.exr --seed 7 -o noisy.exr", "blake3:c1b8bd99fd9601f5"),
    ("add-noise rates.exr --seed 7 --cte 0.9999 -o moved.exr", "blake3:867567a35a058ca9"),
    ("digitize noisy.exr -o codes.exr", "blake3:3116139da09d2b7f"),
    ("demosaic codes.exr --method bi -o bi.exr", "blake3:04b1bb40c2ba76de"),
    ("demosaic codes.exr --method shti -o shti.exr", "blake3:abfb343751d6b305"),
    ("demosaic codes.exr --method mhc -o mhc.exr", "blake3:17101b09391fabfd"),
    ("demosaic codes.exr --method eci -o eci.exr", "blake3:392fe55602668f70"),
    ("to-xyz eci.exr --matrix matrix.yaml --space lab -o lab.exr", "blake3:30a72eebc15f8299"),
];

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

/// What is read is not written over, whatever it is called; devices are written to, not replaced.
#[test]
fn inputs_and_devices_are_not_written_over() {
    let shop = Workshop::with_frames();
    fs::copy(format!("{TREE}/sample_data/skies/sky912.exr"), shop.path("library.exr")).unwrap();
    std::os::unix::fs::symlink(shop.path("expected.exr"), shop.path("link.exr")).unwrap();
    for (line, input) in [
        ("add-noise", "expected.exr"),
        ("mosaic", "noisy.exr"),
        ("measure", "noisy.exr"),
        ("preview", "noisy.exr"),
        ("fit-matrix", "library.exr"),
    ] {
        let before = shop.bytes(input);
        for output in [input.to_owned(), format!("./{input}")] {
            let done = shop.attempt(&format!("{line} {input} -o {output}"), &[]);
            assert_eq!(
                String::from_utf8_lossy(&done.stderr),
                format!("{line}: {output}: it is the same file as the input {input}; name another output\n")
            );
            assert_eq!(done.status.code(), Some(BAD_USAGE), "{line}");
            assert!(shop.bytes(input) == before, "{line} has written over its input");
        }
    }
    assert_eq!(shop.attempt("measure expected.exr -o link.exr", &[]).status.code(), Some(BAD_USAGE));
    // A named pipe stands for all devices: replacing it harms nobody.
    let fifo = shop.path("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    for line in ["measure noisy.exr -o fifo", "preview noisy.exr -o fifo", "add-noise expected.exr -o fifo"] {
        let listener = std::thread::spawn({
            let fifo = fifo.clone();
            move || fs::read(fifo).unwrap().len()
        });
        let done = shop.attempt(line, &[]);
        let is_kept = std::os::unix::fs::FileTypeExt::is_fifo(&fifo.metadata().unwrap().file_type());
        assert!(done.status.success() && is_kept, "{line} has replaced a named pipe");
        assert!(listener.join().unwrap() > 0, "{line}");
    }
}

/// A run that fails in the middle leaves the output of the run before as it was.
#[test]
fn a_failed_run_keeps_the_old_output() {
    let shop = Workshop::with_frames();
    let (old, old_sidecar) = (shop.bytes("noisy.exr"), shop.bytes("noisy.exr.yaml"));
    let files = shop.files();
    let whole = shop.bytes("expected.exr");
    let output = shop.attempt("add-noise -o noisy.exr", &whole[..whole.len() - 20]);
    assert_eq!(output.status.code(), Some(BAD_DATA));
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "add-noise: standard input: the file ends before its last row; it was cut short\n"
    );
    assert_eq!((shop.bytes("noisy.exr"), shop.bytes("noisy.exr.yaml")), (old, old_sidecar));
    assert_eq!(shop.files(), files);
}
