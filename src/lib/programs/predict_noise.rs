//! `predict-noise`: the noise budget of a uniform scene, by formula.

use crate::cli;
use crate::error::Result;
use crate::report::BudgetOutputs;
use crate::requests::NoisePrediction;
use clap::Parser;
use std::process::ExitCode;

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

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    cli::start("predict-noise", |arguments: &Arguments| arguments.general.clone(), run)
}

fn run(Arguments { prediction, outputs, .. }: &Arguments, session: &cli::Session) -> Result<()> {
    outputs.check()?;
    let mut found = prediction.run()?;
    session.tell(&found.notes);
    outputs.write(&mut found)
}
