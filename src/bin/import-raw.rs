//! `import-raw`: cameras' raw files as frames.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::makers::{self, Worker};
use cyanometer::formats::output::SampleKind;
use cyanometer::report::RawOutputs;
use cyanometer::requests::RawFiles;
use cyanometer::requests::batch::Job;
use cyanometer::requests::options::Output;
use cyanometer::stages::import::Import;
use cyanometer::stream::RowSource;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Make frames of cameras' raw files: their codes as they are, with filter array, levels and exposure
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
    #[command(flatten)]
    files: RawFiles,
    #[command(flatten)]
    beside: RawOutputs,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    if let Some(done) = makers::serve() {
        return done;
    }
    let general = |arguments: &Arguments| {
        arguments.general.clone().in_pipeline(arguments.files.is_pipe() || arguments.output.is_pipe())
    };
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let jobs = arguments.beside.jobs(&arguments.files, &arguments.output)?;
    let session = session.among(&arguments.files.raws);
    session.each::<Arguments, _>(&jobs, arguments.output.is_stream(), |session, job| {
        import(job, arguments, &session.on(job.input.as_deref()))
    })
}

fn import(job: &Job, arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let reader = arguments.files.open(job, Worker::this_program())?;
    let texts = RawOutputs::of(&reader, job)?;
    let mut stage = Import::new(reader.header())?;
    session.sign(stage.header_mut());
    // Floats of other programs need not be whole.
    let of_floats = reader.sample_type().filter(|stored| stored.is_float()).map(|_| SampleKind::F32);
    let sample_type = arguments.output.sample_type.or(of_floats);
    session.drive(reader, &stage, &Output { output: job.frame.clone(), sample_type, ..arguments.output.clone() })?;
    RawOutputs::write(&texts)
}
