//! The rows of a frame on disk, for what must see all of them before it makes the first: memory is a few rows.

use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::stream::{RowSink, RowSource};
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt;

/// The rows of one frame, in a file without a name, which ends with the program however that ends.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::stored_rows::StoredRows;
/// use cyanometer::stream::{RowSink, RowSource};
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Electrons);
/// # let header = FrameHeader { name: "example".into(), geometry: Geometry::new(2, 3, &["Y"]), metadata };
/// let mut rows = StoredRows::new(&header)?;
/// rows.write(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])?;
/// // From the last row to the first, those of two rows at a time.
/// rows.change_from_the_last(2, |row| row[0] *= 10.0)?;
/// let mut samples = Vec::new();
/// rows.read(3, &mut samples)?;
/// assert_eq!(samples, [10.0, 2.0, 30.0, 4.0, 50.0, 6.0]);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug)]
pub struct StoredRows {
    file: File,
    header: FrameHeader,
    written: usize,
    next_row: usize,
}

/// What messages call it.
const NAME: &str = "the temporary file of a frame";

impl StoredRows {
    /// No row yet of a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn new(header: &FrameHeader) -> Result<Self> {
        let file = tempfile::tempfile().map_err(|error| Error::disk(NAME, "create", error))?;
        Ok(Self { file, header: header.clone(), written: 0, next_row: 0 })
    }

    /// Where the rows of a range are in the file, in bytes.
    fn place(&self, first: usize) -> u64 {
        (first * self.header.geometry.row_samples() * size_of::<f32>()) as u64
    }

    fn read_rows(&self, rows: Range<usize>, samples: &mut [f32]) -> Result<()> {
        let read = self.file.read_exact_at(bytemuck::cast_slice_mut(samples), self.place(rows.start));
        read.map_err(|error| Error::disk(NAME, "read", error))
    }

    /// Changes each row in place, from the last to the first, so many of them in memory at a time.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn change_from_the_last(&mut self, together: usize, mut change: impl FnMut(&mut [f32])) -> Result<()> {
        let row_samples = self.header.geometry.row_samples();
        let mut samples = Vec::new();
        let mut end = self.written;
        while end > 0 {
            let first = end.saturating_sub(together.max(1));
            samples.resize((end - first) * row_samples, 0.0);
            self.read_rows(first..end, &mut samples)?;
            samples.chunks_exact_mut(row_samples).rev().for_each(&mut change);
            let written = self.file.write_all_at(bytemuck::cast_slice(&samples), self.place(first));
            written.map_err(|error| Error::disk(NAME, "write", error))?;
            end = first;
        }
        Ok(())
    }
}

impl RowSink for StoredRows {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        let written = self.file.write_all_at(bytemuck::cast_slice(samples), self.place(self.written));
        self.written += samples.len() / self.header.geometry.row_samples().max(1);
        written.map_err(|error| Error::disk(NAME, "write", error))
    }
}

impl RowSource for StoredRows {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn natural_rows(&self) -> usize {
        1
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        samples.resize(start + rows * self.header.geometry.row_samples(), 0.0);
        self.read_rows(self.next_row..self.next_row + rows, &mut samples[start..])?;
        self.next_row += rows;
        Ok(())
    }
}
