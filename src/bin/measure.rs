//! `measure`: statistics of a frame beside what propagation predicts.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::{output, plots, register};
use cyanometer::report::{self, ReportFormat};
use cyanometer::requests::{self, described::DescribedInput, measurement::Measurement, values};
use cyanometer::stream::RowSource;
use std::path::PathBuf;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Measure mean, spread and covariance of a frame, beside what the formulas predict
///
/// Predictions are made for uniform scenes, from electrons to XYZ, xyY and L*a*b*. Planes behind a color filter array
/// are also measured class by class. With --check, means are tested by z, variances by chi-square with the effective
/// degrees of freedom of correlated pixels, correlations by Fisher's z. With --patches, the spread of each patch is
/// predicted at the level of its own means.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    #[command(flatten)]
    measurement: Measurement,
    /// Form of the report
    #[arg(long, default_value = "text", value_parser = values::choice::<ReportFormat>())]
    output_format: ReportFormat,
    /// File for the report; by default standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.input.frame.is_pipe());
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Measurement { plot, .. } = &arguments.measurement;
    register::announce(&[arguments.output.as_deref(), plot.as_deref()])?;
    let mut reader = arguments.input.open_all()?;
    session.report_reader(&reader);
    let (report, portrait) = arguments.measurement.of(&mut reader)?;
    if let (Some(path), Some(portrait)) = (plot, &portrait) {
        plots::write_plot(path, &report::portrait(portrait, &report.regions[0]))?;
    }
    let text = report::render(&report, arguments.output_format)?;
    output::write_text(arguments.output.as_deref(), &text)?;
    session.tell(&requests::of_statistics(&report));
    report.check.map_or(Ok(()), |verdict| verdict.judge(&reader.header().name))
}
