//! `measure`: statistics of a frame beside what propagation predicts.

use crate::cli;
use crate::error::Result;
use crate::formats::plots;
use crate::report::{self, Findings, ReportFormat};
use crate::requests::independence::check_copies;
use crate::requests::options::{Makes, Output};
use crate::requests::{self, described::DescribedInput, measurement::Measurement, values};
use crate::stream::RowSource;
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measure mean, spread and covariance of a frame, beside what the formulas predict
///
/// Predictions are made for uniform scenes, from electrons to XYZ, xyY and L*a*b*. Planes behind a color filter array
/// are also measured class by class. With --check, means are tested by z, variances by chi-square with the effective
/// degrees of freedom of correlated pixels, correlations by Fisher's z. With --patches, the spread of each patch is
/// predicted at the level of its own means. With --over frames, what is drawn anew in each of several exposures of a scene is
/// told from what is the same in all.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    #[command(flatten)]
    measurement: Measurement,
    /// Form of the report; by default that of the ending of its file, or text
    #[arg(long, value_parser = values::choice::<ReportFormat>())]
    output_format: Option<ReportFormat>,
    /// File for the report; by default standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.input.frame.is_pipe());
    cli::start("measure", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let frames = &arguments.input.frame;
    arguments.measurement.announce(&frames.inputs, arguments.output.as_deref())?;
    let output = arguments.output.as_deref();
    let format = report::form_of(arguments.output_format, output)?.unwrap_or(ReportFormat::Text);
    if let Some(statistics) = arguments.measurement.over_frames() {
        check_copies(frames)?;
        let one = Output { makes: Makes::One, ..Output::default() };
        session.each_frame::<Arguments>(frames, &one, |turn| {
            let mut reader = arguments.input.with(turn.input.clone()).open_all()?;
            turn.session.report_reader(&reader);
            statistics.add(&mut reader)
        })?;
        let pixels = arguments.measurement.pixels_output();
        return session.tell_over_frames(statistics, pixels.as_ref(), format, output);
    }
    let reports = Output { makes: Makes::Reports, ..Output::default() };
    let findings = Findings::new(format, frames.inputs.len() > 1, arguments.output.clone());
    let measured = session.each_frame::<Arguments>(frames, &reports, |turn| measure(arguments, turn, &findings));
    findings.end(measured)
}

fn measure(arguments: &Arguments, turn: &cli::Turn<'_>, findings: &Findings) -> Result<()> {
    let cli::Turn { session, input, output, .. } = *turn;
    let mut reader = arguments.input.with(arguments.measurement.settled(input)).open_all()?;
    session.report_reader(&reader);
    let measurement = arguments.measurement.for_frame(input.path(), output.index, reader.header());
    let (report, portrait) = findings.measure(|laws| measurement.of(&mut reader, laws))?;
    if let (Some(path), Some(portrait)) = (&measurement.plot, &portrait) {
        session.place(reader.header(), &Output { output: Some(path.clone()), ..output.clone() })?;
        plots::write_plot(path, &report::portrait(portrait, &report.regions[0]))?;
    }
    session.tell(&requests::of_statistics(&report, reader.header()));
    findings.add(reader.header(), output.index, report)
}
