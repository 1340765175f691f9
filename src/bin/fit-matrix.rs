//! `fit-matrix`: a characterisation matrix from a library of spectra.

use clap::Parser;
use cyanometer::cli::{self, options};
use cyanometer::color::characterization::{CameraMatrix, MATRIX_SCHEMA, MATRIX_UNIT, fit_sky_rad_ls, signals};
use cyanometer::error::{Error, Result};
use cyanometer::formats::{data, input::regular_file, output, spectral};
use cyanometer::report::{self, ReportFormat};
use cyanometer::spectrum::WavelengthGrid;
use cyanometer::units::RadianceUnit;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fit the matrix that turns a sensor's signals into CIE XYZ
///
/// The training samples are spectral radiances: a spectral EXR (channels named like S0.550,000000nm), or a CSV table with one spectrum in
/// each row or column. The matrix takes ADU above black, divided by exposure, to absolute XYZ.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Library of spectra, EXR or CSV
    library: PathBuf,
    /// Sensor: a known name, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = data::DEFAULT_SENSOR)]
    sensor: String,
    /// Method: unconstrained least squares on the training samples
    #[arg(long, default_value = "sky-rad-ls", value_parser = options::choice(&[("sky-rad-ls", "sky-rad-ls")]))]
    method: &'static str,
    /// Training samples: a list such as 0,17,240, or one number, that many spread evenly; by default all
    #[arg(long, value_name = "LIST|COUNT", value_parser = training)]
    train: Option<TrainingChoice>,
    /// Unit of the library's radiance, such as "W m-2 sr-1 nm-1"; by default what the file says, or W cm-2 sr-1 nm-1
    #[arg(long, value_name = "UNIT", value_parser = options::radiance_unit)]
    radiance_unit: Option<RadianceUnit>,
    /// Form of what goes to standard output
    #[arg(long, default_value = "yaml", value_parser = options::choice(&[("yaml", ReportFormat::Yaml), ("json", ReportFormat::Json), ("text", ReportFormat::Text)]))]
    output_format: ReportFormat,
    /// Matrix file to write
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    general: options::General,
}

#[derive(Clone)]
enum TrainingChoice {
    Count(usize),
    List(Vec<usize>),
}

fn training(text: &str) -> std::result::Result<TrainingChoice, String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([count]) if *count > 0 => Ok(TrainingChoice::Count(*count)),
        Some(list) if list.len() > 1 => Ok(TrainingChoice::List(list.to_vec())),
        _ => Err("give sample numbers between commas, or how many".into()),
    }
}

fn main() -> ExitCode {
    cli::start(env!("CARGO_BIN_NAME"), |arguments: &Arguments| arguments.general.clone(), run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let loaded = data::load_sensor(&arguments.sensor)?;
    let library = spectral::read_library(&arguments.library, arguments.radiance_unit)?;
    let available = library.radiance.nrows();
    let samples: Vec<usize> = match &arguments.train {
        None => (0..available).collect(),
        Some(TrainingChoice::List(list)) => list.clone(),
        Some(TrainingChoice::Count(count)) if *count > available => {
            return Err(Error::Usage(format!("the library has {available} samples, fewer than {count}")));
        }
        Some(TrainingChoice::Count(count)) => (0..*count).map(|i| i * available / count).collect(),
    };
    let grid = WavelengthGrid::default();
    let signals = signals(&library, &loaded.sensor, &loaded.response, &data::load_observer()?, &grid)?;
    let name = arguments.library.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let (xyz_from_camera, condition, training) = fit_sky_rad_ls(&signals, &samples, &name)?;
    let matrix = CameraMatrix {
        schema: MATRIX_SCHEMA.into(),
        sensor: Some(loaded.sensor.name),
        method: Some(arguments.method.into()),
        unit: Some(MATRIX_UNIT.into()),
        xyz_from_camera,
        condition: Some(condition),
        training: Some(training),
        observer: Some("CIE 1931 2 degrees".into()),
        wavelengths: Some(grid),
    };
    session.note(&format!("fitted {} samples, condition number {condition:.1}", samples.len()));
    let to_file = arguments.output.as_deref().filter(|path| *path != std::path::Path::new("-"));
    if let Some(path) = to_file {
        let text = report::matrix(&matrix, ReportFormat::Yaml)?;
        output::write_text(Some(path), &text, regular_file(&arguments.library).as_ref())?;
    }
    if to_file.is_none() || arguments.output_format != ReportFormat::Yaml {
        output::write_text(None, &report::matrix(&matrix, arguments.output_format)?, None)?;
    }
    Ok(())
}
