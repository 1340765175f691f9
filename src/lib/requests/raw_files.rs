//! Raw files of cameras to import.

use super::batch::Job;
use super::values;
use crate::error::Result;
use crate::formats::dng::RawArea;
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::makers::Worker;
use crate::formats::pipe;
use crate::names::Named;
use clap::Args;
use std::path::PathBuf;

/// Raw files, and what of them is read.
#[derive(Debug, Clone, Args)]
pub struct RawFiles {
    /// Raw files; `-` or none for standard input. Several go to -o DIR/, or to a name with {stem}, such as {stem}.tiff
    #[arg(value_name = "RAW")]
    pub raws: Vec<PathBuf>,
    /// Which photosites: active, those that see light; full, all that are stored; default, those that converters show
    #[arg(long, value_name = "PART", default_value = RawArea::Active.name(), value_parser = values::choice::<RawArea>())]
    pub crop: RawArea,
    /// YAML file whose metadata replace those that come with the file
    #[arg(long, value_name = "FILE")]
    pub metadata: Option<PathBuf>,
}

impl RawFiles {
    /// Whether a raw file comes through a pipe.
    pub fn is_pipe(&self) -> bool {
        pipe::is_input(self.raws.first().map(PathBuf::as_path))
    }

    /// Opens that of a job; a worker decodes the makers' own formats.
    ///
    /// # Errors
    ///
    /// Those of [`FrameReader::open_raw`].
    pub fn open(&self, job: &Job, worker: Worker) -> Result<FrameReader> {
        let options =
            InputOptions { path: job.input.clone(), metadata: self.metadata.clone(), ..InputOptions::default() };
        FrameReader::open_raw(&options, self.crop, worker)
    }
}
