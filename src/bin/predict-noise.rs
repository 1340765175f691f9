//! `predict-noise`: the noise budget of a uniform scene, by formula.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::report::BudgetOutputs;
use cyanometer::requests::NoisePrediction;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Predict the noise of a uniform scene at every stage, by formula and without pixels
///
/// Takes a spectrum or the electrons of R,G,B, and gives mean, spread, covariance and signal-to-noise ratio of electrons,
/// ADU, demosaicked RGB, XYZ and L*a*b*, the share of each cause, and the uncertainty of the mean of a patch.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    prediction: NoisePrediction,
    #[command(flatten)]
    outputs: BudgetOutputs,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    cli::start(env!("CARGO_BIN_NAME"), |arguments: &Arguments| arguments.general.clone(), run)
}

fn run(Arguments { prediction, outputs, .. }: &Arguments, session: &cli::Session) -> Result<()> {
    outputs.check()?;
    let mut found = prediction.run()?;
    session.tell(&found.notes);
    outputs.write(&mut found)
}
