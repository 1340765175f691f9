//! `predict-noise`: the noise budget of a uniform scene, by formula.

use clap::Parser;
use cyanometer::cfa::CfaPattern;
use cyanometer::chain::Uncertainty;
use cyanometer::cli::{self, options, prediction, rendering};
use cyanometer::color::White;
use cyanometer::error::Result;
use cyanometer::formats::data;
use cyanometer::propagation::Equations;
use cyanometer::random::Source;
use cyanometer::report::ReportFormat;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer::units::RadianceUnit;
use std::path::PathBuf;
use std::process::ExitCode;

/// Predict the noise of a uniform scene at every stage, by formula and without pixels
///
/// Takes a spectrum or the electrons of R,G,B, and gives mean, spread, covariance and signal-to-noise ratio of electrons,
/// ADU, demosaicked RGB, XYZ and L*a*b*, the share of each cause, and the uncertainty of the mean of a patch.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Spectrum or library as CSV, or spectral image as EXR; `-` for standard input
    #[arg(conflicts_with_all = ["electrons", "dark"])]
    input: Option<PathBuf>,
    /// Sensor: a known name, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = data::DEFAULT_SENSOR)]
    sensor: String,
    /// Exposure time in s
    #[arg(long, value_name = "S", default_value_t = 0.033, value_parser = options::positive, allow_negative_numbers = true)]
    exposure: f64,
    /// Relative aperture
    #[arg(long, value_name = "N", default_value_t = 8.0, value_parser = options::positive, allow_negative_numbers = true)]
    f_number: f64,
    /// Transmittance of the lens, 0 to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0, value_parser = options::fraction, allow_negative_numbers = true)]
    lens_transmittance: f64,
    /// Choose the exposure time that puts the brightest class at this fraction of full well
    #[arg(long, value_name = "FRACTION", value_parser = options::positive, allow_negative_numbers = true, conflicts_with_all = ["electrons", "dark", "exposure"])]
    expose_to: Option<f64>,
    /// Expected electrons of R,G,B
    #[arg(long, value_name = "R,G,B", value_parser = options::electrons, allow_hyphen_values = true)]
    electrons: Option<[f64; 3]>,
    /// No light at all
    #[arg(long, conflicts_with = "electrons")]
    dark: bool,
    /// Unit of the radiance, such as "W m-2 sr-1 nm-1"; by default what the file says, or W cm-2 sr-1 nm-1
    #[arg(long, value_name = "UNIT", value_parser = options::radiance_unit)]
    radiance_unit: Option<RadianceUnit>,
    /// Column of the spectrum in a table
    #[arg(long, value_name = "NAME", conflicts_with = "sample")]
    column: Option<String>,
    /// One spectrum of a library, counted from 0
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    sample: Option<usize>,
    /// Sources to leave out, between commas; their means stay: dcsn, dcnu, ssn, prnu, ron
    #[arg(long, value_delimiter = ',', value_name = "SOURCES", value_parser = options::choice(&options::SOURCES))]
    without: Vec<Source>,
    /// Temperature of the sensor in K; by default the sensor's own
    #[arg(long, value_name = "K", value_parser = options::positive, allow_negative_numbers = true)]
    temperature: Option<f64>,
    /// Demosaicking method: bi (bilinear), shti (smooth-hue), eci (effective-color), mhc (malvar)
    #[arg(long, default_value = "eci", value_parser = options::choice(&options::METHODS))]
    method: Method,
    /// Pattern of the filter array; by default the sensor's own
    #[arg(long, value_parser = options::pattern)]
    pattern: Option<CfaPattern>,
    /// Matrix file, as fit-matrix makes it, for XYZ and L*a*b*
    #[arg(long, value_name = "FILE")]
    matrix: Option<PathBuf>,
    /// White of L*a*b*: d65, e, or its absolute X,Y,Z in cd/m2
    #[arg(long, default_value = "d65", value_name = "d65|e|X,Y,Z", value_parser = options::white, allow_hyphen_values = true)]
    white: White,
    /// Luminance of the white d65 or e in cd/m2; by default that at which the camera saturates
    #[arg(long, value_name = "CD_PER_M2", value_parser = options::positive, allow_negative_numbers = true)]
    white_luminance: Option<f64>,
    /// Subtract the mean of so many dark frames rather than the black level
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=100_000), allow_negative_numbers = true)]
    dark_frames: u32,
    /// Patch whose mean is predicted, in pixels
    #[arg(long, value_name = "WxH", value_parser = options::size)]
    patch: Option<[usize; 2]>,
    /// Column and row of the patch's corner on the sensor; by default any, on average
    #[arg(long, value_name = "X,Y", value_parser = options::place, allow_hyphen_values = true, requires = "patch")]
    patch_at: Option<[i64; 2]>,
    /// Say how many pixels a square patch needs for this uncertainty of its mean, such as 0.5% or 0.1jnd
    #[arg(long, value_name = "PERCENT%|JNDjnd", value_parser = prediction::uncertainty)]
    uncertainty: Option<Uncertainty>,
    /// Levels of the brightest class to go through, in electrons, as CSV; append log or lin
    #[arg(long, value_name = "START:END:COUNT", value_parser = prediction::Sweep::parse)]
    sweep: Option<prediction::Sweep>,
    /// Predict every spectrum of a library, one row each as CSV; with --expose-to each at an exposure time of its own
    #[arg(long, conflicts_with_all = ["electrons", "dark", "column", "sample", "sweep", "plot"])]
    all_samples: bool,
    /// Equations to predict by: exact, or those of the paper
    #[arg(long, default_value = "exact", value_parser = options::choice(&[("exact", Equations::Exact), ("paper", Equations::Paper)]))]
    equations: Equations,
    /// Form of the report; by default text, and csv for a sweep or all samples
    #[arg(long, value_parser = options::choice(&[("text", ReportFormat::Text), ("json", ReportFormat::Json), ("yaml", ReportFormat::Yaml), ("csv", ReportFormat::Csv)]))]
    output_format: Option<ReportFormat>,
    /// Draw the photon transfer curve, with its read, shot and fixed-pattern regimes, as SVG or PNG
    #[arg(long, value_name = "FILE.svg|png")]
    plot: Option<PathBuf>,
    /// File for the report; by default standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    general: options::General,
}

fn main() -> ExitCode {
    cli::start(env!("CARGO_BIN_NAME"), |arguments: &Arguments| arguments.general.clone(), run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let a = arguments;
    let request = prediction::Request {
        scene: rendering::Request {
            input: a.input.clone(),
            sensor: a.sensor.clone(),
            exposure_s: a.exposure,
            f_number: a.f_number,
            lens_transmittance: a.lens_transmittance,
            expose_to: a.expose_to,
            electrons: if a.dark { Some([0.0; 3]) } else { a.electrons },
            radiance_unit: a.radiance_unit,
            column: a.column.clone(),
            sample: a.sample,
            ..rendering::Request::default()
        },
        noise: NoiseSettings { without: a.without.clone(), temperature_k: a.temperature, ..NoiseSettings::default() },
        method: a.method,
        pattern: a.pattern,
        matrix: a.matrix.clone(),
        white: a.white,
        white_luminance: a.white_luminance,
        dark_frames: a.dark_frames,
        equations: a.equations,
        patch: a.patch,
        patch_at: a.patch_at,
        wanted: a.uncertainty,
        sweep: a.sweep,
        all_samples: a.all_samples,
        plot: a.plot.clone(),
    };
    request.predict(session, a.output_format, a.output.as_deref())
}
