//! `import-raw`: a camera's raw file as a frame.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::dng::RawArea;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::makers::{self, Worker};
use cyanometer::formats::pipe;
use cyanometer::names::Named;
use cyanometer::report::RawMatrixOutput;
use cyanometer::requests::{options, values};
use cyanometer::stages::import::Import;
use cyanometer::stream::RowSource;
use std::path::PathBuf;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Make a frame of a camera's raw file: its codes as they are, with filter array, levels and exposure
///
/// All programs read the raw files that this one reads; here a part is chosen, and what the file tells is kept beside the
/// codes in our terms. The frame begins at its place on the sensor, whose corner is that of the stored image. Where the file has
/// color matrices, that for its own light goes along, for relative XYZ under the scene's own white: ColorMatrix,
/// CameraCalibration and AnalogBalance for AsShotNeutral or AsShotWhiteXY. Nothing is adapted to D50, so that ForwardMatrix does
/// not count, nor does BaselineExposure.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Raw file, DNG; `-` or none for standard input
    raw: Option<PathBuf>,
    /// Which photosites: active, those that see light; full, all that are stored; default, those that converters show
    #[arg(long, value_name = "PART", default_value = RawArea::Active.name(), value_parser = values::choice::<RawArea>())]
    crop: RawArea,
    #[command(flatten)]
    write_matrix: RawMatrixOutput,
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
        let pipeline = pipe::is_input(arguments.raw.as_deref()) || arguments.output.is_pipe();
        arguments.general.clone().in_pipeline(pipeline)
    };
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { raw, metadata, output, write_matrix, .. } = arguments;
    write_matrix.announce(output.output.as_deref())?;
    let options = InputOptions { path: raw.clone(), metadata: metadata.clone(), ..InputOptions::default() };
    let reader = FrameReader::open_raw(&options, arguments.crop, Worker::this_program())?;
    let matrix = write_matrix.of(reader.header())?;
    let mut stage = Import::new(reader.header())?;
    session.sign(stage.header_mut());
    session.drive(reader, &stage, output)?;
    write_matrix.write(matrix.as_deref())
}
