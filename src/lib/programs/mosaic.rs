//! `mosaic`: one CFA plane from three.

use crate::cfa::FilterArray;
use crate::cli::{self, Turn};
use crate::error::Result;
use crate::requests::{described::DescribedInput, options, values};
use crate::stages::mosaic::Mosaic;
use crate::stream::RowSource;
use clap::Parser;
use std::process::ExitCode;

/// Keep of three planes what a Bayer color filter array lets through
///
/// Works at any stage: on expected electrons, on noisy ones, on ADU. The noise of a photosite does not depend on when
/// the mosaic is made, so making it first saves two thirds of the work.
#[derive(Parser)]
#[command(version)]
#[command(mut_arg("cfa", |option| option.value_parser(values::bayer).help(
    "Pattern to make, at the sensor's corner: rggb, bggr, grbg or gbrg; by default the sensor's, or rggb"
)))]
#[command(mut_arg("pattern", |option| option.value_parser(values::bayer)))]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input.frame, &arguments.output);
    cli::start("mosaic", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    session.each_frame::<Arguments>(
        &arguments.input.frame,
        &arguments.output,
        |Turn { session, input, output, .. }| {
            let (reader, array) = arguments.input.with((*input).clone()).open_planes()?;
            let mut stage = Mosaic::new(reader.header(), array.and_then(FilterArray::bayer))?;
            session.sign(stage.header_mut());
            session.drive(reader, &stage, output)
        },
    )
}
