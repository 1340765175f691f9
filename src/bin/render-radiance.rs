//! `render-radiance`: expected electrons from spectral radiance.

use clap::Parser;
use cyanometer::cfa::CfaPattern;
use cyanometer::cli::{self, options, rendering};
use cyanometer::error::Result;
use cyanometer::formats::data;
use cyanometer::numerics::quadrature::Rule;
use cyanometer::units::RadianceUnit;
use std::path::PathBuf;
use std::process::ExitCode;

/// Render what a camera expects to collect of a spectral radiance: electrons per photosite and sensor class
///
/// Takes a spectrum (CSV: wavelength in nm, radiance), one of a library, or a spectral EXR (channels like S0.550,000000nm) whose
/// every pixel becomes a patch; or electrons given outright. Nothing is random yet: add-noise comes next.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Spectrum or library as CSV, or spectral image as EXR; `-` or none for standard input
    #[arg(conflicts_with_all = ["electrons", "dark"])]
    input: Option<PathBuf>,
    /// Sensor: a known name, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = data::DEFAULT_SENSOR)]
    sensor: String,
    /// Size of the frame in photosites; by default the sensor's, or that of the patches of a spectral image
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = options::size)]
    size: Option<[usize; 2]>,
    /// Exposure time in s
    #[arg(long, value_name = "S", default_value_t = 0.033, value_parser = options::positive, allow_negative_numbers = true)]
    exposure: f64,
    /// Relative aperture
    #[arg(long, value_name = "N", default_value_t = 8.0, value_parser = options::positive, allow_negative_numbers = true)]
    f_number: f64,
    /// Transmittance of the lens, 0 to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0, value_parser = options::fraction, allow_negative_numbers = true)]
    lens_transmittance: f64,
    /// Focal length in mm, for --vignetting
    #[arg(long, value_name = "MM", default_value_t = 50.0, value_parser = options::positive, allow_negative_numbers = true)]
    focal_length: f64,
    /// Darken the frame away from its centre by the fourth power of the cosine
    #[arg(long)]
    vignetting: bool,
    /// Choose the exposure time that puts the brightest class, on the axis, at this fraction of full well
    #[arg(long, value_name = "FRACTION", value_parser = options::positive, allow_negative_numbers = true, conflicts_with_all = ["electrons", "dark", "exposure"])]
    expose_to: Option<f64>,
    /// Expected electrons of R,G,B, given outright
    #[arg(long, value_name = "R,G,B", value_parser = options::electrons, allow_hyphen_values = true)]
    electrons: Option<[f64; 3]>,
    /// No light at all
    #[arg(long, conflicts_with = "electrons")]
    dark: bool,
    /// Wavelengths to sum over, in nm
    #[arg(long, value_name = "START:END:STEP", default_value = "360:830:1", value_parser = rendering::wavelengths)]
    wavelengths: [f64; 3],
    /// Rule of summation
    #[arg(long, default_value = "rectangle", value_parser = options::choice(&[("rectangle", Rule::Rectangle), ("trapezoid", Rule::Trapezoid), ("simpson", Rule::Simpson)]))]
    quadrature: Rule,
    /// Unit of the radiance, such as "W m-2 sr-1 nm-1"; by default what the file says, or W cm-2 sr-1 nm-1
    #[arg(long, value_name = "UNIT", value_parser = options::radiance_unit)]
    radiance_unit: Option<RadianceUnit>,
    /// Column of the spectrum in a table
    #[arg(long, value_name = "NAME", conflicts_with = "sample")]
    column: Option<String>,
    /// One spectrum of a library, counted from 0 (pixels row by row)
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    sample: Option<usize>,
    /// Photosites that show one pixel of a spectral image, by default 1x1; or one spectrum of a table, to show them all
    #[arg(long, value_name = "WxH", value_parser = options::size)]
    patch: Option<[usize; 2]>,
    /// Render only the plane that the mosaic of this pattern keeps: rggb, bggr, grbg or gbrg
    #[arg(long, value_name = "PATTERN", value_parser = options::pattern)]
    cfa: Option<CfaPattern>,
    /// Part of a multi-part EXR, counted from 0
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true)]
    part: usize,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: options::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.output.is_pipe());
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let a = arguments;
    rendering::Request {
        input: a.input.clone(),
        part: a.part,
        sensor: a.sensor.clone(),
        size: a.size,
        exposure_s: a.exposure,
        f_number: a.f_number,
        lens_transmittance: a.lens_transmittance,
        vignetting_focal_length_mm: a.vignetting.then_some(a.focal_length),
        expose_to: a.expose_to,
        electrons: if a.dark { Some([0.0; 3]) } else { a.electrons },
        wavelengths: a.wavelengths,
        quadrature: a.quadrature,
        radiance_unit: a.radiance_unit,
        column: a.column.clone(),
        sample: a.sample,
        patch: a.patch,
        cfa: a.cfa,
    }
    .render(session, &a.output)
}
