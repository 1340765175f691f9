//! `digitize`: codes from electrons.

use crate::cli;
use crate::error::Result;
use crate::propagation::{self, Equations};
use crate::requests::{self, described::DescribedInput, options, values};
use crate::stages::adc::{AdcSettings, Digitize};
use crate::stream::{RowSource, Stage};
use clap::Parser;
use std::process::ExitCode;

/// Turn electrons into the codes of the analog-to-digital converter (ADU)
///
/// Each sample becomes round(bias + slope * electrons), clipped to 0 ... 2^bits - 1. Rounding is the quantization noise;
/// nothing else is added.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    /// Bits of the converter, 1 to 16; by default the sensor's
    #[arg(long, value_name = "N")]
    bits: Option<u32>,
    /// Bias in ADU; by default the sensor's
    #[arg(long, value_name = "ADU", value_parser = values::number)]
    bias: Option<f64>,
    /// Slope in ADU per electron; by default the sensor's
    #[arg(long, value_name = "ADU_PER_E", value_parser = values::positive)]
    slope: Option<f64>,
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
    cli::start("digitize", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    session.each_frame::<Arguments>(&arguments.input.frame, &arguments.output, |turn| digitize(arguments, turn))
}

fn digitize(arguments: &Arguments, turn: &cli::Turn<'_>) -> Result<()> {
    let cli::Turn { session, input, output, .. } = *turn;
    let mut reader = arguments.input.with(input.clone()).open()?;
    session.tell(&arguments.sensor.apply(&mut reader)?);
    let settings = AdcSettings { bits: arguments.bits, bias_adu: arguments.bias, adu_per_e: arguments.slope };
    let mut stage = Digitize::new(reader.header(), &settings)?;
    session.tell(requests::of_expected(reader.header()).as_slice());
    propagation::note(stage.header_mut(), Equations::Exact);
    session.sign(stage.header_mut());
    session.tell(requests::of_levels(stage.header()).as_slice());
    session.tell(requests::of_slope(stage.header()).as_slice());
    session.drive(reader, &stage, output)
}
