//! `import-raw`: a camera's raw file as a frame.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::dng::RawArea;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::makers::{self, Worker};
use cyanometer::formats::pipe;
use cyanometer::names::Named;
use cyanometer::report::RawOutputs;
use cyanometer::requests::batch::{Job, jobs};
use cyanometer::requests::{options, values};
use cyanometer::stages::import::Import;
use cyanometer::stream::RowSource;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Make a frame of a camera's raw file: its codes as they are, with filter array, levels and exposure
///
/// DNG is read by all programs; here a part is chosen, and what the file tells is kept beside the codes in our terms. The makers'
/// own formats (NEF, CR2, CR3, ARW, RAF, ORF, RW2, PEF and others) are read here alone, by the library rawler (LGPL-2.1) in a
/// process of its own, whose memory and time are limited. The frame begins at its place on the sensor, whose corner is that of
/// the stored image. Where color matrices are known, that for the file's own light goes along, for relative XYZ under the scene's
/// own white: ColorMatrix, CameraCalibration and AnalogBalance for AsShotNeutral or AsShotWhiteXY. Nothing is adapted to D50, so
/// that ForwardMatrix does not count, nor does BaselineExposure.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Raw files; `-` or none for standard input. Several go to -o DIR/, or to a name with {stem}, such as {stem}.tiff
    #[arg(value_name = "RAW")]
    raws: Vec<PathBuf>,
    /// Which photosites: active, those that see light; full, all that are stored; default, those that converters show
    #[arg(long, value_name = "PART", default_value = RawArea::Active.name(), value_parser = values::choice::<RawArea>())]
    crop: RawArea,
    #[command(flatten)]
    beside: RawOutputs,
    /// YAML file whose metadata replace those that come with the file
    #[arg(long, value_name = "FILE")]
    metadata: Option<PathBuf>,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    if let Some(done) = makers::serve() {
        return done;
    }
    let general = |arguments: &Arguments| {
        let pipeline = pipe::is_input(arguments.raws.first().map(PathBuf::as_path)) || arguments.output.is_pipe();
        arguments.general.clone().in_pipeline(pipeline)
    };
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { raws, output, beside, .. } = arguments;
    let jobs = jobs(raws, output.output.as_deref(), output.extension(), &beside.paths())?;
    RawOutputs::announce(&jobs)?;
    session.each::<Arguments, _>(&jobs, |job| import(job, arguments, session))
}

/// Imports one of the files.
fn import(job: &Job, arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { raws, crop, metadata, .. } = arguments;
    let options = InputOptions { path: job.input.clone(), metadata: metadata.clone(), ..InputOptions::default() };
    let reader = FrameReader::open_raw(&options, *crop, Worker::this_program())?;
    let texts = RawOutputs::of(&reader, job)?;
    let mut stage = Import::new(reader.header())?;
    let others: Vec<&Path> =
        raws.iter().map(PathBuf::as_path).filter(|raw| Some(*raw) != job.input.as_deref()).collect();
    session.sign_among(stage.header_mut(), &others);
    session.drive(reader, &stage, &options::Output { output: job.frame.clone(), ..arguments.output.clone() })?;
    RawOutputs::write(&texts)
}
