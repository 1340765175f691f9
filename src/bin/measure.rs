//! `measure`: statistics of a frame beside what propagation predicts.

use clap::Parser;
use cyanometer::analysis::statistics::{Region, Saturated, measure, patches};
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::{output, register};
use cyanometer::names::Named;
use cyanometer::propagation::Equations;
use cyanometer::report::{self, ReportFormat};
use cyanometer::requests::{self, described::DescribedInput, values};
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
    /// Rectangle X,Y,W,H in pixels; may be given more than once; by default the whole frame
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region, allow_hyphen_values = true)]
    region: Vec<Region>,
    /// Measure each patch of a chart, as --patch of render-radiance draws them or as WxH says, less the rim that
    /// demosaicking mixes
    #[arg(long, value_name = "WxH", num_args = 0..=1, require_equals = true, value_parser = values::size, conflicts_with_all = ["region", "check"])]
    patches: Option<Option<[usize; 2]>>,
    /// Keep pixels in the statistics that were made of saturated samples
    #[arg(long)]
    keep_saturated: bool,
    /// Form of the report
    #[arg(long, default_value = "text", value_parser = values::choice::<ReportFormat>())]
    output_format: ReportFormat,
    /// Equations to predict by: exact, or those of the paper
    #[arg(long, default_value = Equations::default().name(), value_parser = values::choice::<Equations>())]
    equations: Equations,
    /// Test every prediction, and exit with status 1 when one does not hold, which the report says (`passed`), or when nothing
    /// can be checked, of which there is no report
    #[arg(long)]
    check: bool,
    /// Chance of a false alarm that --check accepts, all tests together
    #[arg(long, value_name = "P", default_value_t = 1e-4, value_parser = values::fraction, requires = "check")]
    level: f64,
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
    register::announce(&[arguments.output.as_deref()])?;
    let mut reader = arguments.input.open_all()?;
    session.report_reader(&reader);
    let level = arguments.check.then_some(arguments.level);
    let saturated = if arguments.keep_saturated { Saturated::Kept } else { Saturated::LeftOut };
    let report = match arguments.patches {
        Some(size) => patches::measure(&mut reader, size, saturated, arguments.equations)?,
        None => measure(&mut reader, &arguments.region, saturated, arguments.equations, level)?,
    };
    let text = report::render(&report, arguments.output_format)?;
    output::write_text(arguments.output.as_deref(), &text)?;
    session.tell(&requests::of_statistics(&report));
    report.check.map_or(Ok(()), |verdict| verdict.judge(&reader.header().name))
}
