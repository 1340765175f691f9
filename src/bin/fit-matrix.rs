//! `fit-matrix`: a characterization matrix from spectra, from a chart or from a raw file's own tags, and how well it does.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::{Error, Result};
use cyanometer::report::characterization::MatrixOutputs;
use cyanometer::requests::Fit;
use cyanometer::requests::fit::{ChartFit, RawMatrix};
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Fit the matrix that turns a sensor's signals into CIE XYZ
///
/// From a library: the training samples are spectral radiances: a spectral EXR (channels named like S0.550,000000nm), or a CSV
/// table with one spectrum in each row or column. The matrix takes ADU above black, divided by exposure, to absolute XYZ. With
/// --evaluate every sample of a library goes through the camera, without noise and with it, and the color differences are
/// reported. From a chart (--chart, --patches) or a DNG's own tags (--from-raw) no spectral response is needed; the matrix gives
/// relative XYZ.
#[derive(Parser)]
#[command(version)]
#[command(mut_group("Fit", |group| group.args(Fit::ids())))]
#[command(mut_arg("library", |library| library.required(false).required_unless_present_any(["chart", "patches", "from_raw"])))]
struct Arguments {
    #[command(flatten)]
    fit: Option<Fit>,
    #[command(flatten)]
    chart: ChartFit,
    #[command(flatten)]
    raw: RawMatrix,
    #[command(flatten)]
    outputs: MatrixOutputs,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    cli::start(env!("CARGO_BIN_NAME"), |arguments: &Arguments| arguments.general.clone(), run)
}

fn run(Arguments { fit, chart, raw, outputs, .. }: &Arguments, session: &cli::Session) -> Result<()> {
    if let Some(fit) = fit {
        outputs.check(fit)?;
        let found = fit.run()?;
        session.tell(&found.notes);
        return outputs.write(&found);
    }
    outputs.check_alone(raw.from_raw.is_none())?;
    if let Some((matrix, notes)) = raw.run(chart)? {
        session.tell(&notes);
        return outputs.write_matrix(matrix);
    }
    let found = chart.run()?.ok_or_else(|| Error::Usage("name a library, a chart or a raw file".into()))?;
    session.tell(&found.notes);
    outputs.write_chart(&found)
}
