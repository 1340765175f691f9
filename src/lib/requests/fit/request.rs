//! What is to be fitted: the options of a fit, and how they are read.

use super::ChartExposure;
use crate::analysis::characterization::regression::{Regression, Weights};
use crate::color::White;
use crate::error::{Error, Result};
use crate::names::Named;
use crate::random::Source;
use crate::requests::options::{SampleExposureChoice, WhiteChoice, defaults};
use crate::requests::sensor::SensorRequest;
use crate::requests::values;
use crate::stages::demosaic::Method;
use crate::stages::noise::NoiseSettings;
use crate::units::RadianceUnit;
use clap::{ArgGroup, Args};
use std::path::PathBuf;

/// What is to be fitted and evaluated, and how.
#[derive(Debug, Clone, Args)]
#[command(group = ArgGroup::new("noisy").args(["evaluate", "noise_weight"]).multiple(true))]
#[command(mut_arg("white_luminance", |option| option.help(
    "Luminance of the white d65, d50 or e in cd/m2; by default that at which the camera saturates, by the sensor file's matrix"
)))]
pub struct Fit {
    /// Library of spectra, EXR or CSV
    pub library: PathBuf,
    /// The sensor.
    #[command(flatten)]
    pub sensor: SensorRequest,
    /// Least squares on the training samples (sky-rad-ls), with one sample kept exact (sky-rad-sppls), or on the responses
    /// alone with one sample kept exact (max-ign-sppls; with positive spectra, max-ign-positive-sppls)
    #[arg(long, alias = "method", value_name = "NAME", default_value = Regression::default().name(), value_parser = values::regression())]
    pub regression: Regression,
    /// Training samples: a list such as 0,17,240, or one number, that many chosen to span the library; by default all
    #[arg(long, value_name = "LIST|COUNT", value_parser = training)]
    pub train: Option<TrainingChoice>,
    /// Sample that is kept exact; by default the one of the most average chromaticity
    #[arg(long, value_name = "N")]
    pub white_sample: Option<usize>,
    /// Weights of the squared errors of the training samples: equal, relative (to luminance), or one number for each
    #[arg(long, default_value = "equal", value_name = "equal|relative|LIST", value_parser = weights)]
    pub weights: Weights,
    /// Ridge: share of each signal's own sum of squares that is added to it
    #[arg(long, default_value_t = 0.0, value_name = "SHARE", value_parser = values::not_negative)]
    pub ridge: f64,
    /// Minimize squared Delta E*ab, with noise weighed in by WEIGHT: 1 for single pixels, 1/N for means of N; adds the
    /// trade-off curve
    #[arg(long, value_name = "WEIGHT", value_parser = values::not_negative)]
    pub noise_weight: Option<f64>,
    /// Labels of the samples: a column of a CSV table with one row a sample
    #[arg(long, value_name = "FILE:COLUMN", value_parser = labels)]
    pub labels: Option<(PathBuf, String)>,
    /// Labels whose samples are kept out of the training, between commas
    #[arg(long, value_delimiter = ',', value_name = "LABELS")]
    pub hold_out: Vec<String>,
    /// Unit of the libraries' radiance, such as "W m-2 sr-1 nm-1"; by default what the file says, or W cm-2 sr-1 nm-1
    #[arg(long, value_name = "UNIT", value_parser = values::radiance_unit)]
    pub radiance_unit: Option<RadianceUnit>,
    /// Library to evaluate the matrix on
    #[arg(long, value_name = "LIBRARY")]
    pub evaluate: Option<PathBuf>,
    /// How samples are exposed.
    #[command(flatten)]
    pub exposure: SampleExposureChoice,
    /// Demosaicking method: bi (bilinear), shti (smooth-hue), eci (effective-color), mhc (malvar)
    #[arg(long, default_value = Method::default().name(), value_parser = values::demosaicking(), requires = "noisy")]
    pub demosaic: Method,
    /// Pixels of each sample
    #[arg(long, default_value = "20x16", value_name = "WxH", value_parser = values::patch, requires = "evaluate")]
    pub patch: [usize; 2],
    /// Subtract the mean of so many dark frames rather than the black level
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1000), requires = "noisy")]
    pub dark_frames: u32,
    /// Seed of the noise
    #[arg(long, default_value_t = 0, requires = "evaluate", conflicts_with = "noise_free")]
    pub seed: u64,
    /// Seed of the sensor's fixed patterns
    #[arg(long, default_value_t = 0, requires = "evaluate", conflicts_with = "noise_free")]
    pub sensor_seed: u64,
    /// Noise sources to leave out, between commas: dcsn, dcnu, ssn, prnu, ron; row_noise,
    /// column_noise, dsnu, dsnu_row, dsnu_column, prnu_row, prnu_column, black_drift; hot_pixels, rts
    #[arg(long, value_delimiter = ',', value_name = "SOURCES", value_parser = values::choice::<Source>(), requires = "noisy")]
    pub without: Vec<Source>,
    /// Evaluate without noise only
    #[arg(long, requires = "evaluate", conflicts_with = "patch")]
    pub noise_free: bool,
    /// The white of L\*a\*b\*.
    #[command(flatten)]
    pub white: WhiteChoice,
}

/// Which samples to train on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TrainingChoice {
    /// So many, chosen to span the library.
    Count(usize),
    /// These.
    List(Vec<usize>),
}

/// Reads sample numbers between commas, or how many.
///
/// # Errors
///
/// What is expected, in words.
fn training(text: &str) -> std::result::Result<TrainingChoice, String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([count]) if *count > 0 => Ok(TrainingChoice::Count(*count)),
        Some(list) if list.len() > 1 => Ok(TrainingChoice::List(list.to_vec())),
        _ => Err("give sample numbers between commas, or how many".into()),
    }
}

/// Reads `equal`, `relative`, or one weight for each training sample.
///
/// # Errors
///
/// What is expected, in words.
fn weights(text: &str) -> std::result::Result<Weights, String> {
    match text.to_ascii_lowercase().as_str() {
        "equal" => Ok(Weights::Equal),
        "relative" => Ok(Weights::Relative),
        list => {
            let weight = |part: &str| part.trim().parse().ok().filter(|w: &f64| (0.0..f64::INFINITY).contains(w));
            let given: Option<Vec<f64>> = list.split(',').map(weight).collect();
            given.map(Weights::Given).ok_or_else(|| {
                "give equal, relative, or a weight for each training sample between commas, none below 0".into()
            })
        }
    }
}

/// Reads `FILE:COLUMN`.
///
/// # Errors
///
/// What is expected, in words.
fn labels(text: &str) -> std::result::Result<(PathBuf, String), String> {
    match text.rsplit_once(':') {
        Some((file, column)) if !file.is_empty() && !column.is_empty() => Ok((file.into(), column.into())),
        _ => Err("give FILE:COLUMN, such as sky912_meta.csv:aerosol".into()),
    }
}

impl Fit {
    /// Least squares on all samples of a library for the default sensor, not evaluated.
    pub fn of(library: impl Into<PathBuf>) -> Self {
        defaults(&["--".into(), library.into().into_os_string()])
    }

    /// The names of its options, those of the groups in it included.
    pub fn ids() -> Vec<clap::Id> {
        Self::augment_args(clap::Command::new("fit")).get_arguments().map(|option| option.get_id().clone()).collect()
    }

    /// The same but for those that a frame of a chart has too.
    pub(super) fn own_ids() -> Vec<clap::Id> {
        let is_own = |id: &clap::Id| !ChartExposure::OPTIONS.contains(&id.as_str());
        Self::ids().into_iter().filter(is_own).collect()
    }

    /// Refuses a white that cannot be.
    pub(super) fn check_white(&self) -> Result<()> {
        self.white.check()?;
        match self.white.or_daylight() {
            White::Absolute(white) if !white.iter().all(|value| *value > 0.0) => {
                let [x, y, z] = white;
                Err(Error::Usage(format!("a white of XYZ {x} {y} {z} is impossible; all three must be above 0")))
            }
            _ => Ok(()),
        }
    }

    /// The noise of the evaluation.
    pub(super) fn noise(&self) -> NoiseSettings {
        NoiseSettings {
            seed: self.seed,
            sensor_seed: self.sensor_seed,
            without: self.without.clone(),
            ..NoiseSettings::default()
        }
    }
}
