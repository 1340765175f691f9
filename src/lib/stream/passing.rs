//! A source whose rows are shown to somebody as they pass.

use super::RowSource;
use crate::error::Result;
use crate::metadata::FrameHeader;

/// The rows of a source, which `show` sees as they pass: all samples of each reading.
pub struct Passing<'a, F> {
    source: &'a mut dyn RowSource,
    show: F,
}

impl<'a, F: FnMut(&[f32]) + Send> Passing<'a, F> {
    /// The rows of `source`, shown to `show`.
    pub fn new(source: &'a mut dyn RowSource, show: F) -> Self {
        Self { source, show }
    }
}

impl<F: FnMut(&[f32]) + Send> RowSource for Passing<'_, F> {
    fn header(&self) -> &FrameHeader {
        self.source.header()
    }

    fn natural_rows(&self) -> usize {
        self.source.natural_rows()
    }

    fn may_wait(&self) -> bool {
        self.source.may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        self.source.read(rows, samples)?;
        (self.show)(&samples[start..]);
        Ok(())
    }
}
