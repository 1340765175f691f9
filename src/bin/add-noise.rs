//! `add-noise`: one noisy exposure from expected electrons.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::metadata::PoissonKind;
use cyanometer::names::Named;
use cyanometer::propagation::{self, Equations};
use cyanometer::requests::{described::DescribedInput, options, values};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::RowSource;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

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
    /// Seed of the temporal noise
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u64>, conflicts_with = "clean")]
    seed: u64,
    /// Seed of the fixed patterns: another number, another sensor
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u64>, conflicts_with = "clean")]
    sensor_seed: u64,
    /// Number of the exposure: another number, other temporal noise
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u32>, conflicts_with = "clean")]
    frame: u32,
    #[command(flatten)]
    noise: options::DrawnNoise,
    /// How Poisson numbers are drawn: exact, or gaussian to see what that approximation costs
    #[arg(long, default_value = PoissonKind::default().name(), value_parser = values::choice::<PoissonKind>(), conflicts_with = "clean")]
    poisson: PoissonKind,
    /// Charge transfer efficiency: the share of a packet that each move to the output takes along, above 0 and at most 1;
    /// by default transfer is left out
    #[arg(long, value_name = "X", value_parser = values::fraction)]
    cte: Option<f64>,
    #[command(flatten)]
    sensor: options::SensorChoice,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input.frame, &arguments.output);
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let mut reader = arguments.input.open()?;
    session.tell(&arguments.sensor.apply(&mut reader)?);
    session.tell(arguments.noise.choice.doubt().as_slice());
    let settings = NoiseSettings {
        seed: arguments.seed,
        sensor_seed: arguments.sensor_seed,
        frame: arguments.frame,
        poisson: arguments.poisson,
        cte: arguments.cte,
        ..arguments.noise.settings()
    };
    let mut stage = AddNoise::new(reader.header(), &settings)?;
    propagation::note(stage.header_mut(), Equations::Exact);
    session.sign(stage.header_mut());
    if let Some(warning) = stage.warning() {
        session.warn(&warning);
    }
    session.drive(reader, &stage, &arguments.output)?;
    Ok(())
}
