//! Raw files of cameras to import.

use super::batch::Job;
use super::described::DescribedWithBlack;
use super::values;
use crate::analysis::statistics::Region;
use crate::error::Result;
use crate::formats::dng::RawArea;
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::makers::Worker;
use crate::formats::pipe;
use crate::names::Named;
use clap::Args;
use std::path::PathBuf;
use std::str::FromStr;

/// Raw files, and what of them is read.
#[derive(Debug, Clone, Args)]
pub struct RawFiles {
    /// Raw files; `-` or none for standard input. Several go to -o DIR/, or to a name with {stem}, such as {stem}.tiff
    #[arg(value_name = "RAW")]
    pub raws: Vec<PathBuf>,
    /// Which photosites: active, those that see light; full, all that are stored; default, those that converters show; or a
    /// rectangle X,Y,W,H of the active ones. All keep class, levels and noise
    #[arg(
        long,
        value_name = "active|full|default|X,Y,W,H",
        default_value = RawArea::Active.name(),
        value_parser = str::parse::<RawCrop>,
        allow_hyphen_values = true
    )]
    pub crop: RawCrop,
    /// YAML file whose metadata replace those that come with the file
    #[arg(long, value_name = "FILE")]
    pub metadata: Option<PathBuf>,
    /// Print YAML to begin such a file with, each key explained
    #[arg(long)]
    pub metadata_template: bool,
    /// What is said of it.
    #[command(flatten)]
    pub described: DescribedWithBlack,
}

/// Which photosites of a raw image are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RawCrop {
    /// An area that the file tells.
    Area(RawArea),
    /// A rectangle of those that see light.
    Rectangle(Region),
}

impl FromStr for RawCrop {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        if let Some(area) = RawArea::ALL.iter().find(|area| area.name().eq_ignore_ascii_case(text)) {
            return Ok(Self::Area(*area));
        }
        let expected = |_| "give active, full, default, or X,Y,W,H between commas".to_owned();
        values::region(text).map(Self::Rectangle).map_err(expected)
    }
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
    /// Those of [`FrameReader::open_raw`] and [`DescribedWithBlack::apply`].
    pub fn open(&self, job: &Job, worker: Worker) -> Result<FrameReader> {
        let (area, crop) = match self.crop {
            RawCrop::Area(area) => (area, None),
            RawCrop::Rectangle(crop) => (RawArea::Active, Some(crop)),
        };
        let (path, metadata) = (job.input.clone(), self.metadata.clone());
        let options = InputOptions { path, metadata, crop, tells_top: true, ..InputOptions::default() };
        let mut reader = FrameReader::open_raw(&options, area, worker)?;
        self.described.apply(reader.header_mut())?;
        Ok(reader)
    }
}
