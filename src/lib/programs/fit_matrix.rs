//! `fit-matrix`: a characterization matrix from spectra, from a chart or from a raw file's own tags, and how well it does.

use crate::cli;
use crate::error::Result;
use crate::report::characterization::MatrixOutputs;
use crate::requests::fit::MatrixRequest;
use clap::Parser;
use std::process::ExitCode;

/// Fit the matrix that turns a sensor's signals into CIE XYZ
///
/// The training samples are spectral radiances: a spectral EXR (channels named like S0.550,000000nm), or a CSV table with one spectrum in
/// each row or column. The matrix takes ADU above black, divided by exposure, to absolute XYZ. With --evaluate every sample
/// of a library goes through the camera, without noise and with it, and the color differences are reported. From a chart or a
/// DNG's own tags no spectra are needed; the matrix gives relative XYZ.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    request: MatrixRequest,
    #[command(flatten)]
    outputs: MatrixOutputs,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    cli::start("fit-matrix", |arguments: &Arguments| arguments.general.clone(), run)
}

fn run(Arguments { request, outputs, .. }: &Arguments, session: &cli::Session) -> Result<()> {
    outputs.check_request(request)?;
    let found = request.run()?;
    session.tell(found.notes());
    outputs.write_found(&found)
}
