//! Frames in memory.

use super::counts::Counts;
use super::drive::run;
use super::stage::{RowSink, RowSource, Stage};
use crate::error::Result;
use crate::metadata::FrameHeader;

/// A whole frame in memory: source and sink for tests and small work.
///
/// # Examples
///
/// ```
/// use cyanometer::frame::Geometry;
/// use cyanometer::metadata::{FrameHeader, Metadata};
/// use cyanometer::stages::adc::{AdcSettings, Digitize};
/// use cyanometer::stream::MemoryFrame;
/// use cyanometer::units::QuantityKind;
///
/// let (geometry, metadata) = (Geometry::new(2, 1, &["R", "G", "B"]), Metadata::new(QuantityKind::Electrons));
/// let header = FrameHeader { name: "two pixels".into(), geometry, metadata };
/// let electrons = MemoryFrame::new(header, vec![0.0, 10.0, 100.0, 1000.0, 10_000.0, 100_000.0]);
///
/// let settings = AdcSettings { bits: Some(12), bias_adu: Some(100.0), adu_per_e: Some(0.1) };
/// let (codes, counts) = electrons.through(&Digitize::new(&electrons.header, &settings)?)?;
/// assert_eq!(codes.samples, [100.0, 101.0, 110.0, 200.0, 1100.0, 4095.0]);
/// assert_eq!(counts.clipped_high, 1);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
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
