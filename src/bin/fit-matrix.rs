//! `fit-matrix`: a characterisation matrix from a library of spectra, and how well it does.

use clap::Parser;
use cyanometer::analysis::characterization::regression::{Regression, Weights};
use cyanometer::cli::characterization::{self, Request, TrainingChoice};
use cyanometer::cli::{self, options};
use cyanometer::color::White;
use cyanometer::error::Result;
use cyanometer::formats::data;
use cyanometer::random::Source;
use cyanometer::report::ReportFormat;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer::units::RadianceUnit;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fit the matrix that turns a sensor's signals into CIE XYZ
///
/// The training samples are spectral radiances: a spectral EXR (channels named like S0.550,000000nm), or a CSV table with one spectrum in
/// each row or column. The matrix takes ADU above black, divided by exposure, to absolute XYZ. With --evaluate every sample
/// of a library goes through the camera, without noise and with it, and the color differences are reported.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Library of spectra, EXR or CSV
    library: PathBuf,
    /// Sensor: a known name, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = data::DEFAULT_SENSOR)]
    sensor: String,
    /// Method: least squares on the training samples (sky-rad-ls), with one sample kept exact (sky-rad-sppls), or on the
    /// responses alone with one sample kept exact (max-ign-sppls; with positive spectra, max-ign-positive-sppls)
    #[arg(long, default_value = "sky-rad-ls", value_parser = options::choice(&options::REGRESSIONS))]
    method: Regression,
    /// Training samples: a list such as 0,17,240, or one number, that many chosen to span the library; by default all
    #[arg(long, value_name = "LIST|COUNT", value_parser = characterization::training)]
    train: Option<TrainingChoice>,
    /// Sample that is kept exact; by default the one of the most average chromaticity
    #[arg(long, value_name = "N")]
    white_sample: Option<usize>,
    /// Weights of the squared errors of the training samples: equal, relative (to luminance), or one number for each
    #[arg(long, default_value = "equal", value_name = "equal|relative|LIST", value_parser = characterization::weights)]
    weights: Weights,
    /// Ridge: share of each signal's own sum of squares that is added to it
    #[arg(long, default_value_t = 0.0, value_name = "SHARE", value_parser = options::not_negative, allow_negative_numbers = true)]
    ridge: f64,
    /// Minimize squared Delta E*ab, with noise weighed in by WEIGHT: 1 for single pixels, 1/N for means of N; adds the
    /// trade-off curve
    #[arg(long, value_name = "WEIGHT", value_parser = options::not_negative, allow_negative_numbers = true)]
    noise_weight: Option<f64>,
    /// Labels of the samples: a column of a CSV table with one row a sample
    #[arg(long, value_name = "FILE:COLUMN", value_parser = characterization::labels)]
    labels: Option<(PathBuf, String)>,
    /// Labels whose samples are kept out of the training, between commas
    #[arg(long, value_delimiter = ',', value_name = "LABELS")]
    hold_out: Vec<String>,
    /// Unit of the libraries' radiance, such as "W m-2 sr-1 nm-1"; by default what the file says, or W cm-2 sr-1 nm-1
    #[arg(long, value_name = "UNIT", value_parser = options::radiance_unit)]
    radiance_unit: Option<RadianceUnit>,
    /// Library to evaluate the matrix on
    #[arg(long, value_name = "LIBRARY")]
    evaluate: Option<PathBuf>,
    #[command(flatten)]
    exposure: options::SampleExposure,
    /// Demosaicking method: bi (bilinear), shti (smooth-hue), eci (effective-color), mhc (malvar)
    #[arg(long, default_value = "eci", value_parser = options::choice(&options::METHODS))]
    demosaic: Method,
    /// Pixels of each sample
    #[arg(long, default_value = "20x16", value_name = "WxH", value_parser = options::patch)]
    patch: [usize; 2],
    /// Subtract the mean of so many dark frames rather than the black level
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1000), allow_negative_numbers = true)]
    dark_frames: u32,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Seed of the sensor's fixed patterns
    #[arg(long, default_value_t = 0)]
    sensor_seed: u64,
    /// Noise sources to leave out, between commas: dcsn, dcnu, ssn, prnu, ron
    #[arg(long, value_delimiter = ',', value_name = "SOURCES", value_parser = options::choice(&options::SOURCES))]
    without: Vec<Source>,
    /// Evaluate without noise only
    #[arg(long)]
    noise_free: bool,
    /// White of L*a*b*: d65, e, or its absolute X,Y,Z in cd/m2
    #[arg(long, default_value = "d65", value_name = "d65|e|X,Y,Z", value_parser = options::white, allow_hyphen_values = true)]
    white: White,
    /// Luminance of the white d65 or e in cd/m2; by default that at which the camera saturates, by the sensor file's matrix
    #[arg(long, value_name = "CD_PER_M2", value_parser = options::positive, allow_negative_numbers = true)]
    white_luminance: Option<f64>,
    /// Form of what goes to standard output; by default yaml, and text with --evaluate or --noise-weight
    #[arg(long, value_parser = options::choice(&[("yaml", ReportFormat::Yaml), ("json", ReportFormat::Json), ("text", ReportFormat::Text), ("csv", ReportFormat::Csv)]))]
    output_format: Option<ReportFormat>,
    /// Draw the trade-off of --noise-weight, as SVG or PNG
    #[arg(long, value_name = "FILE.svg|png")]
    plot: Option<PathBuf>,
    /// Matrix file to write, as YAML; reports go to standard output
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
    let request = Request {
        library: a.library.clone(),
        radiance_unit: a.radiance_unit,
        sensor: a.sensor.clone(),
        regression: a.method,
        train: a.train.clone(),
        white_sample: a.white_sample,
        weights: a.weights.clone(),
        ridge: a.ridge,
        noise_weight: a.noise_weight,
        labels: a.labels.clone(),
        hold_out: a.hold_out.clone(),
        evaluate: a.evaluate.clone(),
        exposure: a.exposure.chosen()?,
        noise: NoiseSettings {
            seed: a.seed,
            sensor_seed: a.sensor_seed,
            without: a.without.clone(),
            ..NoiseSettings::default()
        },
        method: a.demosaic,
        white: a.white,
        white_luminance: a.white_luminance,
        patch: a.patch,
        dark_frames: a.dark_frames,
        noise_free: a.noise_free,
        output: a.output.clone(),
        format: a.output_format,
        plot: a.plot.clone(),
    };
    request.run(session)
}
