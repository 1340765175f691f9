//! `demosaic`: sensor RGB from a CFA plane.

use crate::cli;
use crate::error::Result;
use crate::names::Named;
use crate::propagation::pixels::dim_green_below;
use crate::requests::described::{self, Described};
use crate::requests::{self, options, values};
use crate::sigma::WithSigma;
use crate::stages::black::Black;
use crate::stages::demosaic::{Demosaic, Method};
use crate::stream::{RowSource, Stage};
use clap::Parser;
use std::process::ExitCode;

/// Interpolate the two classes that each photosite did not measure
///
/// The black level (bias plus mean dark signal) is removed first and values stay signed. Edges are mirrored without
/// repeating the edge sample.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: options::Input,
    #[command(flatten)]
    described: Described,
    /// Method: bi (bilinear), shti (smooth-hue), eci (effective-color), mhc (malvar)
    #[arg(long, default_value = Method::default().name(), value_parser = values::demosaicking())]
    method: Method,
    /// Black level to remove: auto (from the metadata), none, a number in the unit of the samples, or four of them, of the 2x2
    /// sites at the sensor's corner, row by row
    #[arg(
        long,
        default_value = "auto",
        value_name = "auto|none|N[,N,N,N]",
        value_parser = values::black,
        allow_hyphen_values = true
    )]
    black: Black,
    /// Add a layer with the standard deviation of each pixel, from the sensor's noise model at the pixel's own level
    #[arg(long)]
    sigma: bool,
    #[command(flatten)]
    sensor: options::SensorChoice,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input, &arguments.output);
    cli::start("demosaic", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    session.each_frame::<Arguments>(&arguments.input, &arguments.output, |turn| demosaic(arguments, turn))
}

fn demosaic(arguments: &Arguments, turn: &cli::Turn<'_>) -> Result<()> {
    let cli::Turn { session, input, output, .. } = *turn;
    let mut reader = arguments.described.open(&input.options())?;
    session.tell(&arguments.sensor.apply(&mut reader)?);
    let mut stage = Demosaic::new(reader.header(), arguments.method, arguments.black, None)?;
    session.tell(described::doubt_of_black(reader.header(), arguments.black)?.as_slice());
    described::hold_black(&mut reader, arguments.black)?;
    session.sign(stage.header_mut());
    session.tell(requests::of_levels(stage.header()).as_slice());
    session.tell(requests::of_bent_codes(reader.header()).as_slice());
    if arguments.sigma {
        let stage = WithSigma::of_demosaicking(stage)?;
        session.tell(&requests::of_sigma(reader.header()));
        session.drive(reader, &stage, output)
    } else {
        dim_green_below(stage.header()).into_iter().for_each(|level| stage.count_greens_below(level));
        session.drive(reader, &stage, output)
    }
}
