//! `correct-frame`: codes without black, dark signal and the traces of charge transfer.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::input::FrameReader;
use cyanometer::formats::register::check_inputs;
use cyanometer::requests::{self, described::Described, options, values};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::DarkFrames;
use cyanometer::stream::{RowSource, Stage};
use std::path::PathBuf;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Take black level, dark frames and charge transfer back from a frame of ADU
///
/// Works before demosaicking. What no light reads is subtracted first, as a constant or as the mean of dark frames; then
/// charge transfer is undone. Values become signed and fractional.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: options::Input,
    #[command(flatten)]
    described: Described,
    /// Black level to remove: auto (from the metadata), none, or a number of ADU
    #[arg(long, default_value = "none", value_name = "auto|none|N", value_parser = values::black)]
    black: Black,
    /// Dark frame to subtract sample by sample, read with the --raw, --channel and --crop of the input; given more than once,
    /// the mean of all
    #[arg(long, value_name = "FILE", conflicts_with = "black")]
    dark: Vec<PathBuf>,
    /// Charge transfer efficiency to undo, above 0 and at most 1; the bias of the converter is left out of it
    #[arg(long, value_name = "X", value_parser = values::fraction)]
    cte: Option<f64>,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input, &arguments.output);
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let darks = arguments.dark.iter().map(PathBuf::as_path);
    check_inputs(darks.map(Some).chain([arguments.input.input.as_deref()]))?;
    let reader = arguments.described.open(&arguments.input.options())?;
    let open = |path: &PathBuf| FrameReader::open(&arguments.input.beside(path));
    let darks = DarkFrames::of(arguments.dark.iter().map(open).collect::<Result<_>>()?)?;
    let settings = CorrectionSettings { black: arguments.black, cte: arguments.cte };
    let stack = darks.as_ref().map(DarkFrames::stack);
    let mut stage = CorrectFrame::new(reader.header(), &settings, stack)?;
    session.sign(stage.header_mut());
    session.tell(requests::of_levels(stage.header()).as_slice());
    for warning in stage.warnings() {
        session.warn(warning);
    }
    session.drive_less_darks(reader, darks, &stage, &arguments.output)?;
    Ok(())
}
