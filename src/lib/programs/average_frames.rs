//! `average-frames`: one frame of several exposures of a scene.

use crate::cli;
use crate::error::Result;
use crate::propagation::{self, Equations};
use crate::requests::averaging::{AverageRequest, SharedAverage};
use crate::requests::described::DescribedInput;
use crate::requests::independence::{check_copies, check_exposures};
use crate::requests::options;
use crate::stream::Counts;
use clap::Parser;
use std::process::ExitCode;

/// Average exposures of one scene: mean, median, or the mean without outliers
///
/// Works at any stage up to XYZ. What is drawn anew in each exposure averages out, fixed patterns do not: predictions of later
/// programs know it, and so do the layers of standard deviations. A pixel that is marked in a frame is marked in the average;
/// one that is saturated in fewer than half of the frames is not in their median.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    #[command(flatten)]
    request: AverageRequest,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input.frame, &arguments.output);
    cli::start("average-frames", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let average = arguments.request.begin()?;
    arguments.output.check_one()?;
    let frames = &arguments.input.frame;
    check_exposures(&frames.inputs)?;
    check_copies(frames)?;
    let in_order = options::Output { makes: options::Makes::One, ..options::Output::default() };
    session.each_frame::<Arguments>(frames, &in_order, |turn| {
        // With its marks, and the layers of its uncertainty where they are the only ones.
        let mut reader = arguments.input.with(turn.input.clone()).open_all()?;
        turn.session.report_reader(&reader);
        average.add(&mut reader)
    })?;
    write(arguments, session, average)
}

fn write(arguments: &Arguments, session: &cli::Session, average: SharedAverage) -> Result<()> {
    let mut averaged = average.finish()?;
    let output = &arguments.output;
    session.sign(&mut averaged.header);
    propagation::note(&mut averaged.header, Equations::Exact);
    averaged.warnings.iter().for_each(|warning| session.warn(warning));
    let layers = output.options().holds_layers()?;
    let counts = session.write(&averaged.marked(layers), output, |writer, progress| {
        let propagation_void = averaged.write(layers, writer, progress)?;
        Ok(Counts { propagation_void, saturated_pixels: averaged.saturated, ..Counts::default() })
    })?;
    counts.map_or_else(Vec::new, Counts::warnings).iter().for_each(|warning| session.warn(warning));
    Ok(())
}
