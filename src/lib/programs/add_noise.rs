//! `add-noise`: one noisy exposure from expected electrons.

use crate::cli;
use crate::error::Result;
use crate::requests::{described::DescribedInput, options};
use clap::Parser;
use std::process::ExitCode;

/// Draw one noisy exposure from expected electrons
///
/// Takes the frame of expected electrons that render-radiance makes, three planes or one CFA plane, and gives the
/// electrons of one exposure: dark and signal shot noise, dark-current and photo-response non-uniformity, full well,
/// read noise. The same seeds give the same noise at each photosite, whatever else is drawn.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    #[command(flatten)]
    noise: options::DrawnNoise,
    #[command(flatten)]
    sensor: options::SensorChoice,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input.frame, &arguments.output);
    cli::start("add-noise", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { input, noise, output, .. } = arguments;
    session.each_exposure::<Arguments>(&input.frame, output, noise.frames.clone(), |turn| expose(arguments, turn))
}

fn expose(arguments: &Arguments, turn: &cli::Turn<'_>) -> Result<()> {
    let cli::Turn { session, input, output, exposure } = *turn;
    let mut reader = arguments.input.with(input.clone()).open()?;
    session.tell(&arguments.sensor.apply(&mut reader)?);
    session.expose(reader, &arguments.noise.settings(exposure), exposure, output)
}
