//! `stack-frames`: many frames in one Zarr store, and out of it.
//!
//! What reads and writes the store stands here and not in the library: the crate for it registers its codecs when a program starts, and
//! would be part of every other program.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::input::FrameReader;
use cyanometer::requests::{described::DescribedInput, options};
use std::process::ExitCode;

mod layout;
mod read;
mod samples;
mod stacking;
mod write;

use stacking::{SharedStack, StackRequest};

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Put many frames into one stack on disk, a Zarr store, or take them out
///
/// Frames go in as they come, in files or in a stream, with their metadata, layers of uncertainty and marks, and come out the
/// same. xarray, dask and napari read a stack as it is.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    #[command(flatten)]
    request: StackRequest,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input.frame, &arguments.output);
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { input: DescribedInput { frame: input, described }, request, output, .. } = arguments;
    let stacked = request.stacked(input, output)?;
    let stack = SharedStack::of(output)?;
    let into = stack.as_ref();
    match stacked {
        Some(frames) => session.one_by_one(frames.count(), frames.turns(), |session, frame| {
            let (mut reader, output) = frame.open(input, output)?;
            described.apply(reader.header_mut())?;
            pass(session, reader, into, &output)
        })?,
        None => {
            let of_stack = options::Output { makes: options::Makes::One, ..options::Output::default() };
            let output = if into.is_some() { &of_stack } else { output };
            session.each_frame::<Arguments>(input, output, |turn| {
                let reader = described.open(&turn.input.options_for_all())?;
                pass(turn.session, reader, into, turn.output)
            })?;
        }
    }
    stack.map_or(Ok(0), SharedStack::finish).map(drop)
}

fn pass(
    session: &cli::Session,
    mut reader: FrameReader,
    stack: Option<&SharedStack>,
    output: &options::Output,
) -> Result<()> {
    session.report_reader(&reader);
    match stack {
        Some(stack) => stack.add(&mut reader),
        None => session.pass(reader, output),
    }
}
