//! Frames to read and frames to write.

use crate::analysis::statistics::Region;
use crate::error::{Error, Result};
use crate::formats::headerless::Layout;
use crate::formats::input::InputOptions;
use crate::formats::output::{CompressionKind, Format, OutputOptions, SampleKind};
use crate::formats::pipe;
use crate::formats::places::{is_pattern, is_waited_on, named, numbered, output_of};
use crate::formats::sequence::Sequence;
use crate::metadata::FrameHeader;
use crate::names::Named;
use crate::requests::values;
use clap::Args;
use std::path::{Path, PathBuf};

/// A frame to read, or several.
#[derive(Debug, Clone, Args)]
pub struct Input {
    /// Frames to read, EXR, TIFF, DNG, PNG or FITS; `-` or none for standard input, which may bring several one after another
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Of which the next frame is taken.
    #[arg(skip)]
    pub sequence: Option<Sequence>,
    /// What of it is read.
    #[command(flatten)]
    pub selection: Selection,
    /// YAML file whose metadata replace those that come with the input
    #[arg(long, value_name = "FILE")]
    pub metadata: Option<PathBuf>,
    /// Print YAML to begin such a file with, each key explained
    #[arg(long)]
    pub metadata_template: bool,
}

/// What of a file is read as the frame, and how.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct Selection {
    /// Part of a multi-part EXR or FITS, or page of a TIFF, counted from 0
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub part: usize,
    /// Read a file without a header: rows of u8, u16le, u16be or f32le, behind OFFSET bytes if given
    #[arg(long, value_name = "WxH:TYPE[:OFFSET]", value_parser = str::parse::<Layout>)]
    pub raw: Option<Layout>,
    /// Take one channel alone, by its name, as a single plane
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Take a rectangle X,Y,W,H in pixels alone; its photosites keep class, levels and noise
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region, allow_hyphen_values = true)]
    pub crop: Option<Region>,
}

impl Selection {
    /// A file, of which this is read.
    pub fn of(&self, path: &Path) -> InputOptions {
        let Self { part, raw, channel, crop } = self.clone();
        InputOptions { path: Some(path.to_owned()), part, raw, channel, crop, ..InputOptions::default() }
    }
}

impl Input {
    /// The first file; none for the standard input.
    pub fn path(&self) -> Option<&Path> {
        self.inputs.first().map(PathBuf::as_path)
    }

    /// The same with this file alone, or the frames of this sequence.
    pub fn only(&self, path: Option<&Path>, sequence: Option<Sequence>) -> Self {
        Self { inputs: path.into_iter().map(Path::to_owned).collect(), sequence, ..self.clone() }
    }

    /// Whether frames come through a pipe.
    pub fn is_pipe(&self) -> bool {
        pipe::is_input(self.path())
    }

    /// What to open; channels besides R, G, B or Y are left out.
    pub fn options(&self) -> InputOptions {
        let path = self.path().map(Path::to_owned);
        let Self { sequence, selection: Selection { part, raw, channel, crop }, metadata, .. } = self.clone();
        InputOptions { path, sequence, part, raw, metadata, channel, crop, ..InputOptions::default() }
    }

    /// The same with all channels.
    pub fn options_for_all(&self) -> InputOptions {
        InputOptions { all_channels: true, ..self.options() }
    }

    /// Another frame of the same camera, of which the same part of file and sensor is read, or the single part of its file; its metadata
    /// are its own.
    pub fn beside(&self, path: &Path) -> InputOptions {
        InputOptions { or_single_part: true, ..self.selection.of(path) }
    }
}

/// A frame to write.
#[derive(Debug, Clone, Default, Args)]
pub struct Output {
    /// File to write, with a sidecar FILE.yaml; `-` or none for standard output. Of several frames DIR/, or a name with {stem},
    /// that of the input, {frame}, the number of the exposure, or {index}, that in the stream: {frame:05} has five digits
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Leave alone what is complete: a file whose samples are those that its sidecar describes, made by the same programs with the
    /// same options
    #[arg(long)]
    pub resume: bool,
    /// The number of the frame in its stream.
    #[arg(skip)]
    pub index: u64,
    /// What follows it.
    #[arg(skip)]
    pub following: Following,
    /// What is made of several frames.
    #[arg(skip)]
    pub makes: Makes,
    /// Format; by default that of the file's extension, or EXR; DNG for one plane of ADU alone, PNG for whole codes and sRGB
    #[arg(long, value_parser = values::choice::<Format>())]
    pub format: Option<Format>,
    /// Compression, without loss: rle, zips, zip, piz for EXR; lzw, deflate for TIFF; deflate for DNG of floats; none
    /// by default, but a PNG is always deflated
    #[arg(long, value_parser = values::choice::<CompressionKind>())]
    pub compression: Option<CompressionKind>,
    /// How samples are stored: f32 or f16 in EXR, u16 or f32 in TIFF and DNG, u16 in PNG; by default f32, and u16 for codes in
    /// TIFF and DNG
    #[arg(long, value_name = "TYPE", value_parser = values::choice::<SampleKind>())]
    pub sample_type: Option<SampleKind>,
    /// Scale samples by a power of two so that viewers show them: white between half and all of 1, or of 16 bits. Programs of
    /// this toolchain undo it to the bit. In a DNG levels go with them, whose fractions converters drop. Layers of an EXR stand
    /// apart, as with --separate-layers
    #[arg(long)]
    pub viewable: bool,
    /// Put the layers of an EXR file (standard deviations, covariances, marks) into a second part of it, marked as data
    #[arg(long)]
    pub separate_layers: bool,
}

impl Output {
    /// Whether the frame goes through a pipe.
    pub fn is_pipe(&self) -> bool {
        pipe::is_output(self.output.as_deref())
    }

    /// Whether frames go one after another to one place: the standard output, a named pipe, a device.
    pub fn is_stream(&self) -> bool {
        named(self.output.as_deref()).is_none_or(is_waited_on)
    }

    /// Makes sure that one frame, made of all that come, has one place.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a directory or a pattern.
    pub fn check_one(&self) -> Result<()> {
        match named(self.output.as_deref()).filter(|path| is_pattern(path)) {
            Some(path) => {
                let problem = format!("{}: one frame is made of all; name a single file", path.display());
                Err(Error::Usage(problem).change(&["output"]))
            }
            None => Ok(()),
        }
    }

    /// Whether a file is named whose format is EXR.
    pub fn is_exr(&self) -> bool {
        let ends_so = |path: &PathBuf| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("exr"));
        self.output.as_ref().is_some_and(ends_so) && self.format.is_none_or(|format| format == Format::Exr)
    }

    /// What names end in that nobody has chosen.
    pub fn extension(&self) -> &'static str {
        self.format.unwrap_or(Format::Exr).name()
    }

    /// Where and how to write a frame of several. Where it does not tell the number of its exposure, that in the stream counts.
    pub fn options_for(&self, made: &FrameHeader) -> OutputOptions {
        let options = self.options();
        let exposure = made.metadata.noise.as_ref().map(|noise| u64::from(noise.frame));
        let file = made.metadata.file.as_deref().map(Path::new);
        let named = |path: PathBuf| match file.filter(|_| named(Some(&path)).is_some()) {
            Some(file) => output_of(&path, file, self.extension()),
            None => path,
        };
        let pattern = options.path.map(named);
        let ahead = |path: &Path, count: u64| {
            numbered(path, exposure.unwrap_or(self.index).saturating_add(count), self.index.saturating_add(count))
        };
        let files_to_come = pattern.as_deref().map_or(0, |path| self.missing(|count| ahead(path, count)));
        let path = pattern.map(|path| ahead(&path, 0).unwrap_or(path));
        OutputOptions { path, frames_to_come: self.following.frames(), files_to_come, ..options }
    }

    /// How many of the files that the exposures behind this one get are not there yet, of the first of them: a file that is
    /// there gives its room when it is replaced.
    fn missing(&self, path: impl Fn(u64) -> Option<PathBuf>) -> u64 {
        /// So many are looked for.
        const LOOKED_FOR: u64 = 100_000;
        let all = if self.is_stream() { 0 } else { self.following.files_left.min(LOOKED_FOR) };
        (1..=all).filter(|count| path(*count).is_some_and(|path| !path.exists())).count() as u64
    }

    /// Where and how to write.
    pub fn options(&self) -> OutputOptions {
        OutputOptions {
            path: self.output.clone(),
            format: self.format,
            compression: self.compression,
            samples: self.sample_type,
            is_viewable: self.viewable,
            separates_layers: self.separate_layers,
            frames_to_come: 0,
            files_to_come: 0,
        }
    }
}

/// What is made of several frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Makes {
    /// A frame of each, one behind another.
    #[default]
    Frames,
    /// A report of each, which can stand without the others.
    Reports,
    /// One thing of all, which is whole or not at all.
    One,
}

/// What is made behind a frame in the same run, as far as it is known.
#[derive(Debug, Clone, Default)]
pub struct Following {
    /// The frames of the same input.
    pub sequence: Option<Sequence>,
    /// Exposures of each scene.
    pub exposures: u64,
    /// Those of the same scene that are left.
    pub exposures_left: u64,
    /// Those that get files of their own, where this is the first.
    pub files_left: u64,
    /// Inputs that are left.
    pub inputs_left: u64,
}

impl Following {
    /// How many frames that is, at least.
    pub fn frames(&self) -> u64 {
        let scenes = self.sequence.as_ref().map_or(0, Sequence::to_come).saturating_add(self.inputs_left);
        scenes.saturating_mul(self.exposures).saturating_add(self.exposures_left)
    }
}
