//! Frames to test with, and ways to drive them: shared by the tests of laws, statistics and programs.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

pub mod advised;
pub mod alarms;
pub mod bounds;
pub mod chain;
pub mod cmos;
pub mod dng;
pub mod fits;
pub mod kit;
pub mod makers;
pub mod misses;
pub mod photon_transfer;
pub mod workshop;

use cyanometer::camera::optics::Exposure;
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::sensor::Sensor;
use cyanometer::cfa::Class;
use cyanometer::error::Result;
use cyanometer::formats::data::load_sensor;
use cyanometer::frame::{Geometry, Rows, Window};
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::stages::linearize::Linearize;
use cyanometer::stream::{Counts, MemoryFrame, RowSink, RowSource, Stage, run};
use cyanometer::units::QuantityKind;
use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};

/// The root of the source tree.
pub const TREE: &str = env!("CARGO_MANIFEST_DIR");

/// The exposure of the paper: 33 ms at f/8.
pub const EXPOSURE: Exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };

/// The sensor of the paper, from the tree, whatever the environment says.
pub fn sensor() -> Sensor {
    load_sensor(&format!("{TREE}/sample_data/sensors/kaf-5101ce.yaml")).unwrap().sensor
}

/// Its read-out.
pub fn readout() -> ReadOut {
    sensor().readout.unwrap()
}

/// The head of a frame that the paper's camera took.
pub fn header(quantity: QuantityKind, geometry: Geometry) -> FrameHeader {
    let mut metadata = Metadata::new(quantity);
    metadata.sensor = Some(sensor());
    metadata.exposure = Some(EXPOSURE);
    FrameHeader { name: "test".into(), geometry, metadata }
}

/// A frame of any channels from a function of column, row and channel.
pub fn frame(header: FrameHeader, f: impl Fn(usize, usize, usize) -> f32) -> MemoryFrame {
    let Geometry { width, height, ref channels, .. } = header.geometry;
    let channels = channels.len();
    let mut samples = Vec::with_capacity(width * channels * height);
    for y in 0..height {
        for channel in 0..channels {
            samples.extend((0..width).map(|x| f(x, y, channel)));
        }
    }
    MemoryFrame::new(header, samples)
}

/// Three planes of expected electrons.
pub fn expected(width: usize, height: usize, f: impl Fn(usize, usize, Class) -> f32) -> MemoryFrame {
    let header = header(QuantityKind::ExpectedElectrons, Geometry::new(width, height, &["R", "G", "B"]));
    frame(header, |x, y, channel| f(x, y, Class::ALL[channel]))
}

/// A number from 0 to 1 that looks like chance and is the same every time.
pub fn scatter(x: usize, y: usize, channel: usize) -> f32 {
    let mixed = (x * 7919 + y * 104_729 + channel * 1_299_709 + x * y * 31) % 10_007;
    mixed as f32 / 10_006.0
}

/// The rows and columns of a frame that a crop keeps; the crop says where on the sensor it starts.
pub fn crop(whole: &MemoryFrame, x: usize, y: usize, width: usize, height: usize) -> MemoryFrame {
    let mut header = whole.header.clone();
    let [x0, y0] = header.geometry.origin;
    let shift = |start: i32, by: usize| start.wrapping_add(i32::try_from(by).unwrap());
    header.geometry.origin = [shift(x0, x), shift(y0, y)];
    header.geometry.width = width;
    header.geometry.height = height;
    frame(header, |i, j, channel| at(whole, x + i, y + j, channel))
}

/// One sample of a frame.
pub fn at(frame: &MemoryFrame, x: usize, y: usize, channel: usize) -> f32 {
    let Geometry { width, ref channels, .. } = frame.header.geometry;
    frame.samples[(y * channels.len() + channel) * width + x]
}

/// Samples as bits: two NaN are the same, 0 and −0 are not.
pub fn bits(frame: &MemoryFrame) -> Vec<u32> {
    frame.samples.iter().map(|sample| sample.to_bits()).collect()
}

/// Says where two frames differ, if they do.
pub fn first_difference(a: &MemoryFrame, b: &MemoryFrame) -> Option<String> {
    if a.samples.len() != b.samples.len() {
        return Some(format!("{} samples and {}", a.samples.len(), b.samples.len()));
    }
    let index = bits(a).iter().zip(bits(b)).position(|(a, b)| *a != b)?;
    let Geometry { width, ref channels, .. } = a.header.geometry;
    let (row, x) = (index / width, index % width);
    Some(format!(
        "column {x}, row {}, channel {}: {} and {}",
        row / channels.len(),
        row % channels.len(),
        a.samples[index],
        b.samples[index]
    ))
}

/// Fails unless two frames are the same to the bit.
#[track_caller]
pub fn assert_same(a: &MemoryFrame, b: &MemoryFrame, what: &str) {
    if let Some(difference) = first_difference(a, b) {
        panic!("{what}: {difference}");
    }
}

/// A frame in memory that hands out its rows as a file with blocks of `natural` rows would.
pub struct Blocks<'a> {
    frame: &'a MemoryFrame,
    natural: usize,
    next_row: usize,
}

impl<'a> Blocks<'a> {
    /// The rows of `frame`, from its first.
    pub fn new(frame: &'a MemoryFrame, natural: usize) -> Self {
        Self { frame, natural, next_row: 0 }
    }
}

impl RowSource for Blocks<'_> {
    fn header(&self) -> &FrameHeader {
        &self.frame.header
    }

    fn natural_rows(&self) -> usize {
        self.natural
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let height = self.frame.header.geometry.height;
        assert!(rows > 0 && self.next_row + rows <= height, "asked for rows beyond the last");
        // Blocks that are too large to hold more than once are taken piecemeal; a stage may make three planes of one.
        let planes = Geometry { channels: vec![String::new(); 3], ..self.frame.header.geometry.clone() };
        let too_large = planes.step_rows(self.natural) != self.natural;
        assert!(
            too_large || rows.is_multiple_of(self.natural) || self.next_row + rows == height,
            "asked for {rows} rows of blocks of {}",
            self.natural
        );
        let row = self.frame.header.geometry.row_samples();
        samples.extend_from_slice(&self.frame.samples[self.next_row * row..(self.next_row + rows) * row]);
        self.next_row += rows;
        Ok(())
    }
}

/// Keeps the samples that it is given, and how many rows came at a time.
pub struct Keep {
    pub samples: Vec<f32>,
    pub bands: Vec<usize>,
    row_samples: usize,
}

impl RowSink for Keep {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        assert!(samples.len().is_multiple_of(self.row_samples), "bands are whole rows");
        self.bands.push(samples.len() / self.row_samples);
        self.samples.extend_from_slice(samples);
        Ok(())
    }
}

/// Drives a frame through a stage from blocks of `natural` rows on `threads` threads; gives the heights of the bands
/// too.
pub fn through_blocks<S: Stage>(
    input: &MemoryFrame,
    stage: &S,
    natural: usize,
    threads: usize,
) -> (MemoryFrame, Counts, Vec<usize>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let row_samples = stage.header().geometry.row_samples();
        let mut sink = Keep { samples: Vec::new(), bands: Vec::new(), row_samples };
        let counts = run(stage, &mut Blocks::new(input, natural), &mut sink, &mut |_| ()).unwrap();
        (MemoryFrame::new(stage.header().clone(), sink.samples), counts, sink.bands)
    })
}

/// Applies a stage to the rows `0..cuts[0]`, `cuts[0]..cuts[1]`, … each on its own, with no row more in sight than the
/// stage says it needs.
pub fn through_cuts<S: Stage>(input: &MemoryFrame, stage: &S, cuts: &[usize]) -> (MemoryFrame, Counts) {
    let Geometry { width, height, ref channels, .. } = input.header.geometry;
    let output = &stage.header().geometry;
    let mut made = vec![f32::NAN; output.row_samples() * height];
    let mut counts = Counts::default();
    let mut first = 0;
    for &end in cuts.iter().chain([&height]) {
        if end == first {
            continue;
        }
        let seen = first.saturating_sub(stage.reach())..(end + stage.reach()).min(height);
        let row = input.header.geometry.row_samples();
        let window =
            Window::new(height, seen.start, width, channels.len(), &input.samples[seen.start * row..seen.end * row]);
        let samples = &mut made[first * output.row_samples()..end * output.row_samples()];
        let rows = Rows::new(first, output.width, output.channels.len(), samples);
        counts = counts.plus(stage.apply(window, rows));
        first = end;
    }
    (MemoryFrame::new(stage.header().clone(), made), counts)
}

/// Drives a frame through a stage all at once.
pub fn through<S: Stage>(input: &MemoryFrame, stage: &S) -> MemoryFrame {
    through_cuts(input, stage, &[]).0
}

/// Codes made straight, row after row.
pub fn straightened(codes: &MemoryFrame) -> MemoryFrame {
    let mut frame = codes.clone();
    let linearize = Linearize::of(&mut frame.header).unwrap();
    let rows = frame.samples.chunks_exact_mut(codes.header.geometry.row_samples());
    rows.enumerate().for_each(|(y, row)| linearize.apply(row, y));
    frame
}

/// Checks a law on `cases` values, always the same ones, and shows the simplest that breaks it.
#[track_caller]
pub fn for_all<S: Strategy>(cases: u32, values: S, law: impl Fn(S::Value) -> std::result::Result<(), TestCaseError>) {
    let config = Config { cases, rng_seed: RngSeed::Fixed(1789), failure_persistence: None, ..Config::default() };
    if let Err(error) = TestRunner::new(config).run(&values, law) {
        panic!("{error}");
    }
}
