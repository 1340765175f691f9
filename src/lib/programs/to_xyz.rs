//! `to-xyz`: colors from sensor RGB.

use crate::analysis::characterization::CameraMatrix;
use crate::cli;
use crate::error::Result;
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::register::{announce, check_inputs};
use crate::requests::{self, Conversion, options};
use crate::sigma::WithSigma;
use crate::stream::RowSource;
use clap::Parser;
use std::process::ExitCode;

/// Turn demosaicked ADU into CIE XYZ, and either into xyY, L*a*b*, L*u*v*, color temperatures, linear or viewable sRGB
///
/// XYZ is absolute, Y in cd/m2, or, by a matrix that says so, relative: Y = 1 for the white by which the first class reaches
/// its white level, whatever the exposure. L*a*b*, L*u*v* and sRGB refer to a white; by default that of D65, as bright as
/// makes the first class reach its white level. Colors are those under the light of the scene, unless --adapt-to names another.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: options::Input,
    #[command(flatten)]
    conversion: Conversion,
    /// Add a layer with the standard deviation of each pixel, and for xyz one with the covariances, from the sensor's noise
    /// model at the pixel's own level; of XYZ from their layer of covariances, which also comes along without this
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
    cli::start("to-xyz", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { conversion, output, .. } = arguments;
    session.tell(conversion.doubt_of(output).as_slice());
    announce(&[output.output.as_deref()])?;
    check_inputs(conversion.matrix_file().map(Some).into_iter().chain([arguments.input.path()]))?;
    let matrix = conversion.load_matrix()?;
    session.each_frame::<Arguments>(&arguments.input, output, |turn| convert(arguments, matrix.clone(), turn))
}

fn convert(
    Arguments { conversion, sensor, sigma, .. }: &Arguments,
    matrix: Option<CameraMatrix>,
    turn: &cli::Turn<'_>,
) -> Result<()> {
    let cli::Turn { session, input, output, .. } = *turn;
    let mut reader = FrameReader::open(&InputOptions { tells_top: true, ..input.options() })?;
    session.tell(&sensor.apply(&mut reader)?);
    let holds_layers = output.options().holds_layers()?;
    if let Some(mut stage) = conversion.stage_of_xyz(&mut reader, *sigma, holds_layers)? {
        session.tell(conversion.doubt_of_xyz(reader.header()).as_slice());
        session.sign(stage.header_mut());
        return session.drive(reader, &stage, output);
    }
    let (mut stage, notes) = conversion.stage(matrix, reader.header_mut())?;
    session.tell(&notes);
    session.sign(stage.header_mut());
    if *sigma {
        let stage = WithSigma::of_conversion(stage, reader.header())?;
        session.tell(&requests::of_sigma(reader.header()));
        session.drive(reader, &stage, output)
    } else {
        session.drive(reader, &stage, output)
    }
}
