//! The programs as a shell starts them, in a directory of their own.

#![allow(dead_code, reason = "each file of tests takes what it needs")]

use super::{TREE, advised};
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::output::{FrameWriter, OutputOptions};
use cyanometer::formats::yaml::parse_metadata;
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::stream::{Counts, MemoryFrame, RowSink, RowSource};
use cyanometer::units::QuantityKind;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use tempfile::TempDir;

/// Exit status for bad data.
pub const BAD_DATA: i32 = 1;
/// Exit status for bad usage.
pub const BAD_USAGE: i32 = 2;

/// The programs that there are, by their sources.
pub fn programs() -> Vec<String> {
    let sources = fs::read_dir(Path::new(TREE).join("src/bin")).unwrap();
    let mut names: Vec<String> =
        sources.map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned()).collect();
    names.sort();
    assert!(names.len() >= 8, "{names:?}");
    names
}

/// A program where cargo has built it; another name is left to the shell's path.
pub fn path_of(program: &str) -> PathBuf {
    let built = Path::new(env!("CARGO_BIN_EXE_add-noise")).with_file_name(program);
    if built.exists() { built } else { program.into() }
}

/// A directory to work in.
pub struct Workshop {
    directory: TempDir,
}

impl Workshop {
    pub fn new() -> Self {
        Self { directory: TempDir::new().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.directory.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// A command line, split at spaces.
    pub fn command(&self, line: &str) -> Command {
        let line = line.replace("SAMPLES", &format!("{TREE}/sample_data"));
        let mut words = line.split(' ');
        let mut command = Command::new(path_of(words.next().unwrap()));
        command.args(words).current_dir(self.directory.path()).env_remove("CYANOMETER_DATA");
        command.env_remove("CYANOMETER_VECTORS");
        command
    }

    /// Runs a command on `input` to its end. Whatever it says names options that it has.
    #[track_caller]
    pub fn attempt(&self, line: &str, input: &[u8]) -> Output {
        let mut command = self.command(line);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut stdin = child.stdin.take().unwrap();
        let input = input.to_vec();
        // A program that refuses its input does not read it all.
        let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
        let output = child.wait_with_output().unwrap();
        writer.join().unwrap();
        advised::check(line, &String::from_utf8_lossy(&output.stderr));
        output
    }

    /// Runs a command that shall succeed without a word on the standard error, and gives its output.
    #[track_caller]
    pub fn run(&self, line: &str, input: &[u8]) -> Vec<u8> {
        let output = self.attempt(line, input);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.is_empty(), "{line}: {} {said}", output.status);
        output.stdout
    }

    /// What a command says that ends with `status`.
    #[track_caller]
    pub fn said(&self, line: &str, status: i32) -> String {
        let output = self.attempt(line, &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{line}: {said}");
        said
    }

    pub fn spawn(&self, line: &str, input: Stdio) -> Child {
        self.command(line)
            .stdin(input)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{line}: {error}"))
    }

    /// Runs a pipeline, all its commands at once, and gives what comes out at its end.
    #[track_caller]
    pub fn pipe(&self, pipeline: &str) -> Vec<u8> {
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

    pub fn sidecar(&self, name: &str) -> Metadata {
        let text = String::from_utf8(self.bytes(&format!("{name}.yaml"))).unwrap();
        parse_metadata(name, &text).unwrap()
    }

    /// All samples of a frame and its metadata, by the library's reader.
    pub fn read(&self, name: &str) -> (Vec<f32>, Metadata) {
        let options = InputOptions { path: Some(self.path(name)), ..Default::default() };
        let mut reader = FrameReader::open(&options).unwrap();
        let (height, mut samples) = (reader.header().geometry.height, Vec::new());
        reader.read(height, &mut samples).unwrap();
        (samples, reader.header().metadata.clone())
    }

    /// A whole frame in memory.
    pub fn frame(&self, name: &str) -> MemoryFrame {
        self.frame_with(name, &[])
    }

    /// The same with the layers behind its channels.
    pub fn frame_with(&self, name: &str, layers: &[&str]) -> MemoryFrame {
        let options = InputOptions { path: Some(self.path(name)), ..Default::default() };
        let mut reader = FrameReader::open(&options).unwrap();
        assert!(layers.is_empty() || reader.keep(layers));
        let mut samples = Vec::new();
        reader.read(reader.header().geometry.height, &mut samples).unwrap();
        MemoryFrame::new(reader.header().clone(), samples)
    }

    /// One frame of each stage, and a matrix.
    pub fn with_frames() -> Self {
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

impl Workshop {
    /// What color-difference says in JSON.
    #[track_caller]
    pub fn difference(&self, arguments: &str) -> serde_json::Value {
        let report = self.run(&format!("color-difference {arguments} --output-format json"), &[]);
        serde_json::from_slice(&report).unwrap()
    }

    /// A frame of three planes and one column, a pixel a row.
    pub fn write_colors(&self, name: &str, quantity: QuantityKind, pixels: &[[f32; 3]]) {
        let header = FrameHeader {
            name: name.into(),
            geometry: Geometry::new(1, pixels.len(), &["R", "G", "B"]),
            metadata: Metadata::new(quantity),
        };
        self.write(name, &header, pixels.as_flattened());
    }

    /// Writes a frame.
    pub fn write(&self, name: &str, header: &FrameHeader, samples: &[f32]) {
        let options = OutputOptions { path: Some(self.path(name)), ..OutputOptions::default() };
        let mut writer = FrameWriter::create(&options, header).unwrap();
        writer.write(samples).unwrap();
        writer.finish(Counts::default()).unwrap();
    }
}

pub const SKY: &str = "render-radiance SAMPLES/skies/measured_blue.csv --expose-to 0.8 --size 64x48";
