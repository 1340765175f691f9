//! A stage between a source and whoever reads on: its rows are made as they are asked for.

use super::counts::Counts;
use super::drive::make;
use super::stage::{RowSource, Stage};
use crate::error::Result;
use crate::frame::Window;
use crate::metadata::FrameHeader;

/// The rows that a stage makes of those of a source.
///
/// # Examples
///
/// ```
/// use cyanometer::stages::mosaic::Mosaic;
/// use cyanometer::stream::{MemoryFrame, RowSource, Stage, Through};
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Adu);
/// # let geometry = Geometry::new(2, 2, &["R", "G", "B"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// let mut planes = MemoryFrame::new(header, vec![1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
/// let mosaic = Mosaic::new(&planes.header, None)?;
/// let mut plane = Through::new(&mosaic, &mut planes);
/// let mut samples = Vec::new();
/// plane.read(1, &mut samples)?;
/// assert_eq!(samples, [1.0, 2.0]);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub struct Through<'a, S> {
    stage: &'a S,
    source: &'a mut dyn RowSource,
    /// Rows of the source from `first` on.
    seen: Vec<f32>,
    first: usize,
    read: usize,
    made: usize,
    counts: Counts,
}

impl<'a, S: Stage> Through<'a, S> {
    /// What `stage` makes of `source`.
    pub fn new(stage: &'a S, source: &'a mut dyn RowSource) -> Self {
        Self { stage, source, seen: Vec::new(), first: 0, read: 0, made: 0, counts: Counts::default() }
    }

    /// What was counted so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }
}

impl<S: Stage> RowSource for Through<'_, S> {
    fn header(&self) -> &FrameHeader {
        self.stage.header()
    }

    fn natural_rows(&self) -> usize {
        self.source.natural_rows()
    }

    fn may_wait(&self) -> bool {
        self.source.may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let geometry = &self.source.header().geometry;
        let (height, width, channels) = (geometry.height, geometry.width, geometry.channels.len());
        let row_samples = geometry.row_samples();
        let (end, reach) = (self.made + rows, self.stage.reach());
        let kept = self.made.saturating_sub(reach).max(self.first);
        self.seen.drain(..(kept - self.first) * row_samples);
        self.first = kept;
        let wanted = (end + reach).min(height).saturating_sub(self.read);
        if wanted > 0 {
            self.source.read(wanted, &mut self.seen)?;
            self.read += wanted;
        }
        let window = Window::new(height, self.first, width, channels, &self.seen);
        let start = samples.len();
        samples.resize(start + rows * self.stage.header().geometry.row_samples(), 0.0);
        let counted = make(self.stage, window, self.made..end, &mut samples[start..], rayon::current_num_threads());
        self.counts = self.counts.plus(counted);
        self.made = end;
        Ok(())
    }
}
