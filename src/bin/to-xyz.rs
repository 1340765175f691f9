//! `to-xyz`: colours from sensor RGB.

use clap::Parser;
use cyanometer::camera::optics::Exposure;
use cyanometer::cli::{self, options};
use cyanometer::color::{Space, White};
use cyanometer::error::Result;
use cyanometer::formats::data;
use cyanometer::formats::files::{regular_file, same_file};
use cyanometer::formats::input::FrameReader;
use cyanometer::sigma::WithSigma;
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::RowSource;
use std::path::PathBuf;
use std::process::ExitCode;

/// Turn demosaicked ADU into CIE XYZ, xyY, L*a*b* or a viewable sRGB picture
///
/// XYZ is absolute, Y in cd/m2. L*a*b* and sRGB refer to a white; by default that of D65, as bright as makes the camera
/// saturate.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: options::Input,
    /// Matrix file, as fit-matrix makes it
    #[arg(long, value_name = "FILE")]
    matrix: PathBuf,
    /// Colour space
    #[arg(long, default_value = "xyz", value_parser = options::choice(&[("xyz", Space::Xyz), ("xyy", Space::Xyy), ("lab", Space::Lab), ("srgb", Space::Srgb)]))]
    space: Space,
    /// White of lab and srgb: d65, e, or its absolute X,Y,Z in cd/m2
    #[arg(long, default_value = "d65", value_name = "d65|e|X,Y,Z", value_parser = options::white, allow_hyphen_values = true)]
    white: White,
    /// Luminance of the white d65 or e in cd/m2; by default that at which the camera saturates
    #[arg(long, value_name = "CD_PER_M2", value_parser = options::positive, allow_negative_numbers = true)]
    white_luminance: Option<f64>,
    /// Exposure time in s, for a frame whose metadata do not state it
    #[arg(long, value_name = "S", value_parser = options::positive, allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Relative aperture, for a frame whose metadata do not state it
    #[arg(long, value_name = "N", value_parser = options::positive, allow_negative_numbers = true)]
    f_number: Option<f64>,
    /// Transmittance of the lens, 0 to 1, for a frame whose metadata do not state it
    #[arg(long, value_name = "FRACTION", value_parser = options::fraction, allow_negative_numbers = true)]
    lens_transmittance: Option<f64>,
    /// Add a layer with the standard deviation of each pixel, and for xyz one with the covariances, from the sensor's noise
    /// model at the pixel's own level
    #[arg(long)]
    sigma: bool,
    #[command(flatten)]
    sensor: options::SensorChoice,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: options::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input, &arguments.output);
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let shown = arguments.matrix.display().to_string();
    let matrix = data::load_matrix(&arguments.matrix)?;
    let output = arguments.output.output.as_deref().and_then(regular_file);
    if let (Some((output, name)), Some((matrix, _))) = (output, regular_file(&arguments.matrix))
        && output == matrix
    {
        return Err(same_file(&name, &shown));
    }
    let mut reader = FrameReader::open(&arguments.input.options())?;
    arguments.sensor.apply(&mut reader)?;
    let metadata = &mut reader.header_mut().metadata;
    let known = metadata.exposure;
    let exposure_s = arguments.exposure.or(known.map(|e| e.exposure_s));
    let f_number = arguments.f_number.or(known.map(|e| e.f_number));
    let lens_transmittance = arguments.lens_transmittance.or(known.map(|e| e.lens_transmittance)).unwrap_or(1.0);
    if let Some((exposure_s, f_number)) = exposure_s.zip(f_number) {
        metadata.exposure = Some(Exposure { exposure_s, f_number, lens_transmittance }.checked()?);
    }
    if let (Some(of_matrix), Some(of_frame)) = (&matrix.sensor, metadata.sensor.as_ref().map(|sensor| &sensor.name))
        && of_matrix != of_frame
    {
        session.warn(&format!("{shown} was fitted for the sensor {of_matrix}, but the frame comes from {of_frame}"));
    }
    let settings = ColorSettings {
        xyz_from_camera: matrix.xyz_from_camera,
        method: matrix.method,
        space: arguments.space,
        white: arguments.white,
        white_luminance: arguments.white_luminance,
    };
    let mut stage = ToXyz::new(reader.header(), &settings)?;
    session.sign(stage.header_mut());
    if arguments.sigma {
        let stage = WithSigma::of_conversion(stage, reader.header())?;
        session.drive(reader, &stage, &arguments.output)?;
    } else {
        session.drive(reader, &stage, &arguments.output)?;
    }
    Ok(())
}
