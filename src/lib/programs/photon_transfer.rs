//! `photon-transfer`: what a camera is, measured from flats and darks.

use crate::cli;
use crate::error::Result;
use crate::report::CameraOutputs;
use crate::requests::photon_transfer::PhotonTransfer;
use clap::Parser;
use std::process::ExitCode;

/// Measure a camera from flats and darks: gain, noise, saturation, patterns, linearity, dark current
///
/// After EMVA 1288 release 4.0, linear model: from pairs or stacks of flats at several levels of light and of darks at several
/// exposure times, before demosaicking, each class of photosites by itself. Every number has an interval that holds it with the
/// stated confidence; of what the frames do not determine it says which would.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    measurement: PhotonTransfer,
    #[command(flatten)]
    outputs: CameraOutputs,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    cli::start("photon-transfer", |arguments: &Arguments| arguments.general.clone(), run)
}

fn run(Arguments { measurement, outputs, .. }: &Arguments, session: &cli::Session) -> Result<()> {
    outputs.check()?;
    let camera = measurement.run(outputs.draws())?;
    session.tell(&camera.notes);
    outputs.write(&camera)
}
