//! A stage maps bands to bands; [`run`] drives one from a source of rows to a sink.

mod drive;

pub use drive::run;

use crate::error::Result;
use crate::frame::{Rows, Window};
use crate::metadata::{FrameHeader, SamplesRecord};
use crate::units::Quantity;

/// Rows of a frame, top to bottom.
pub trait RowSource: Send {
    /// Geometry and metadata.
    fn header(&self) -> &FrameHeader;
    /// The number of rows that the source makes together; asking for multiples of it saves work.
    fn natural_rows(&self) -> usize;
    /// Whether the rows come from another program, which may take any time to give them.
    fn may_wait(&self) -> bool {
        false
    }
    /// Appends the next `rows` rows, laid out as `[row][channel][column]`.
    ///
    /// # Errors
    ///
    /// What the file's reader complains of. Rows beyond the last must not be asked for.
    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()>;
}

/// Takes rows, top to bottom.
pub trait RowSink: Send {
    /// Takes whole rows, laid out as `[row][channel][column]`.
    ///
    /// # Errors
    ///
    /// What the file's writer complains of.
    fn write(&mut self, samples: &[f32]) -> Result<()>;
}

/// What a stage counts while samples pass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Photosites whose charge was clipped at full well.
    pub full_well: u64,
    /// Samples clipped to the smallest code.
    pub clipped_low: u64,
    /// Samples clipped to the largest code.
    pub clipped_high: u64,
    /// Samples that are NaN or infinite.
    pub not_finite: u64,
    /// Expected electrons below zero.
    pub negative: u64,
    /// Demosaicked values without a green to divide by, or beyond the range of samples.
    pub undefined_hue: u64,
    /// Colours outside sRGB.
    pub out_of_gamut: u64,
    /// Pixels whose noise cannot be propagated.
    pub propagation_void: u64,
}

impl Counts {
    /// The sums of two counts.
    pub fn plus(self, other: Self) -> Self {
        Self {
            full_well: self.full_well + other.full_well,
            clipped_low: self.clipped_low + other.clipped_low,
            clipped_high: self.clipped_high + other.clipped_high,
            not_finite: self.not_finite + other.not_finite,
            negative: self.negative + other.negative,
            undefined_hue: self.undefined_hue + other.undefined_hue,
            out_of_gamut: self.out_of_gamut + other.out_of_gamut,
            propagation_void: self.propagation_void + other.propagation_void,
        }
    }

    /// The record for a sidecar: what did not happen is left out.
    pub fn record(self, digest: String) -> SamplesRecord {
        let some = |count: u64| (count > 0).then_some(count);
        SamplesRecord {
            digest,
            full_well: some(self.full_well),
            clipped_low: some(self.clipped_low),
            clipped_high: some(self.clipped_high),
            not_finite: some(self.not_finite),
            negative: some(self.negative),
            undefined_hue: some(self.undefined_hue),
            out_of_gamut: some(self.out_of_gamut),
            propagation_void: some(self.propagation_void),
        }
    }

    /// What a user should hear about, one sentence each.
    pub fn warnings(self) -> Vec<String> {
        [
            (self.full_well, "photosites were clipped at full well"),
            (self.clipped_low, "samples were clipped to the smallest code"),
            (self.clipped_high, "samples were clipped to the largest code"),
            (self.not_finite, "samples are NaN or infinite"),
            (self.negative, "expected signals below zero were taken as zero"),
            (
                self.undefined_hue,
                "values had no green to divide by, or lay beyond the range of samples; bilinear ones stand in",
            ),
            (self.out_of_gamut, "colours lie outside sRGB and were clipped"),
            (
                self.propagation_void,
                "pixels have a green too near its noise to divide by; their standard deviations say only that they are large",
            ),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect()
    }
}

/// A step of the chain: a value with a method from band to band.
pub trait Stage: Sync {
    /// What the samples were.
    type Input: Quantity;
    /// What they become.
    type Output: Quantity;

    /// The head of the frame that comes out.
    fn header(&self) -> &FrameHeader;

    /// Rows above and below that a row of the output depends on.
    fn reach(&self) -> usize {
        0
    }

    /// Fills `output` from `input`, which holds the same rows and [`Self::reach`] more on either side.
    ///
    /// What a row becomes must not depend on how the frame is cut into bands.
    fn apply(&self, input: Window<'_, Self::Input>, output: Rows<'_, Self::Output>) -> Counts;
}

/// A whole frame in memory: source and sink for tests and small work.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryFrame {
    /// Its head.
    pub header: FrameHeader,
    /// Samples, `[row][channel][column]`.
    pub samples: Vec<f32>,
    next_row: usize,
}

impl MemoryFrame {
    /// A frame of `samples`; none yet for one that is to be filled.
    pub fn new(header: FrameHeader, samples: Vec<f32>) -> Self {
        Self { header, samples, next_row: 0 }
    }

    /// Drives the frame through a stage.
    ///
    /// # Errors
    ///
    /// None in practice: reading and writing memory does not fail.
    pub fn through<S: Stage>(&self, stage: &S) -> Result<(Self, Counts)> {
        let mut source = Self::new(self.header.clone(), self.samples.clone());
        let mut sink = Self::new(stage.header().clone(), Vec::new());
        let counts = run(stage, &mut source, &mut sink, &mut |_| ())?;
        Ok((sink, counts))
    }
}

impl RowSource for MemoryFrame {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn natural_rows(&self) -> usize {
        1
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let row = self.header.geometry.row_samples();
        samples.extend_from_slice(&self.samples[self.next_row * row..(self.next_row + rows) * row]);
        self.next_row += rows;
        Ok(())
    }
}

impl RowSink for MemoryFrame {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        self.samples.extend_from_slice(samples);
        Ok(())
    }
}
