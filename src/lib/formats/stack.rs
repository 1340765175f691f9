//! Frames on disk, of which each sample is looked at across all of them: memory is a few rows of each.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::os::unix::fs::FileExt;

/// The samples of frames of one size, one frame behind another in a file without a name.
#[derive(Debug)]
pub struct FrameStack {
    file: BufWriter<File>,
    /// Samples of a frame.
    samples: usize,
    /// Samples of all so far.
    written: usize,
}

/// What messages call it.
const NAME: &str = "the temporary file of all frames";

impl FrameStack {
    /// No frame yet, of so many samples each.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn new(samples: usize) -> Result<Self> {
        let file = tempfile::tempfile().map_err(|error| Error::disk(NAME, "create", error))?;
        Ok(Self { file: BufWriter::new(file), samples, written: 0 })
    }

    /// Adds the next samples.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn add(&mut self, samples: &[f32]) -> Result<()> {
        self.written += samples.len();
        self.file.write_all(bytemuck::cast_slice(samples)).map_err(|error| Error::disk(NAME, "write", error))
    }

    /// How many frames are whole.
    pub fn frames(&self) -> usize {
        self.written / self.samples.max(1)
    }

    /// The samples from `first` on of all frames, `count` of each, one frame behind another.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn read(&mut self, first: usize, count: usize, samples: &mut Vec<f32>) -> Result<()> {
        self.file.flush().map_err(|error| Error::disk(NAME, "write", error))?;
        samples.resize(self.frames() * count, 0.0);
        for (frame, strip) in samples.chunks_exact_mut(count.max(1)).enumerate() {
            let at = (frame * self.samples + first) * size_of::<f32>();
            let read = self.file.get_ref().read_exact_at(bytemuck::cast_slice_mut(strip), at as u64);
            read.map_err(|error| Error::disk(NAME, "read", error))?;
        }
        Ok(())
    }
}
