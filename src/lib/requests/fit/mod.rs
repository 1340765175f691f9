//! Fitting a matrix: from a library of spectra, with parts of it held out, to a matrix and how well it does.

mod evaluation;
mod fitting;
mod library;
mod training;

pub use evaluation::{Conditions, DifferenceSummaries, Evaluation, Group, NoiseReport};
pub use training::TrainingChoice;

use super::notes::Note;
use super::options::{SampleExposureChoice, WhiteChoice, defaults};
use super::values;
use crate::analysis::characterization::noise_aware::TradeOff;
use crate::analysis::characterization::regression::{Regression, Weights};
use crate::analysis::characterization::{CameraMatrix, responses};
use crate::color::White;
use crate::error::{Error, Result};
use crate::formats::data;
use crate::names::Named;
use crate::random::Source;
use crate::spectrum::WavelengthGrid;
use crate::stages::demosaic::Method;
use crate::stages::noise::NoiseSettings;
use crate::units::RadianceUnit;
use clap::Args;
use fitting::Fitting;
use library::Viewer;
use std::path::{Path, PathBuf};
use training::Plan;

/// What is to be fitted and evaluated, and how.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("white_luminance", |option| option.help(
    "Luminance of the white d65 or e in cd/m2; by default that at which the camera saturates, by the sensor file's matrix"
)))]
pub struct Fit {
    /// Library of spectra, EXR or CSV
    pub library: PathBuf,
    /// Sensor: a known name, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = data::DEFAULT_SENSOR)]
    pub sensor: String,
    /// Method: least squares on the training samples (sky-rad-ls), with one sample kept exact (sky-rad-sppls), or on the
    /// responses alone with one sample kept exact (max-ign-sppls; with positive spectra, max-ign-positive-sppls)
    #[arg(id = "method", long, value_name = "METHOD", default_value = Regression::default().name(), value_parser = values::choice::<Regression>())]
    pub regression: Regression,
    /// Training samples: a list such as 0,17,240, or one number, that many chosen to span the library; by default all
    #[arg(long, value_name = "LIST|COUNT", value_parser = training::training)]
    pub train: Option<TrainingChoice>,
    /// Sample that is kept exact; by default the one of the most average chromaticity
    #[arg(long, value_name = "N")]
    pub white_sample: Option<usize>,
    /// Weights of the squared errors of the training samples: equal, relative (to luminance), or one number for each
    #[arg(long, default_value = "equal", value_name = "equal|relative|LIST", value_parser = training::weights)]
    pub weights: Weights,
    /// Ridge: share of each signal's own sum of squares that is added to it
    #[arg(long, default_value_t = 0.0, value_name = "SHARE", value_parser = values::not_negative, allow_negative_numbers = true)]
    pub ridge: f64,
    /// Minimize squared Delta E*ab, with noise weighed in by WEIGHT: 1 for single pixels, 1/N for means of N; adds the
    /// trade-off curve
    #[arg(long, value_name = "WEIGHT", value_parser = values::not_negative, allow_negative_numbers = true)]
    pub noise_weight: Option<f64>,
    /// Labels of the samples: a column of a CSV table with one row a sample
    #[arg(long, value_name = "FILE:COLUMN", value_parser = training::labels)]
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
    #[arg(long, default_value = Method::default().name(), value_parser = values::choice::<Method>())]
    pub demosaic: Method,
    /// Pixels of each sample
    #[arg(long, default_value = "20x16", value_name = "WxH", value_parser = values::patch)]
    pub patch: [usize; 2],
    /// Subtract the mean of so many dark frames rather than the black level
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1000), allow_negative_numbers = true)]
    pub dark_frames: u32,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Seed of the sensor's fixed patterns
    #[arg(long, default_value_t = 0)]
    pub sensor_seed: u64,
    /// Noise sources to leave out, between commas: dcsn, dcnu, ssn, prnu, ron
    #[arg(long, value_delimiter = ',', value_name = "SOURCES", value_parser = values::choice::<Source>())]
    pub without: Vec<Source>,
    /// Evaluate without noise only
    #[arg(long)]
    pub noise_free: bool,
    /// The white of L\*a\*b\*.
    #[command(flatten)]
    pub white: WhiteChoice,
}

/// A fitted matrix with what was found out about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Characterization {
    /// The matrix.
    pub matrix: CameraMatrix,
    /// How it does on a library.
    pub evaluation: Option<Evaluation>,
    /// Matrices of other noise weights.
    pub trade_off: Vec<TradeOff>,
    /// What came up.
    pub notes: Vec<Note>,
}

impl Fit {
    /// Least squares on all samples of a library for the default sensor, not evaluated.
    pub fn of(library: impl Into<PathBuf>) -> Self {
        defaults(&["--".into(), library.into().into_os_string()])
    }

    /// The files that are read, so that no output is written over one.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_sensor`].
    pub fn inputs(&self) -> Result<Vec<PathBuf>> {
        let own = data::sensor_files(&self.sensor, &data::load_sensor(&self.sensor)?.sensor);
        let labels = self.labels.as_ref().map(|(file, _)| file);
        Ok(std::iter::once(&self.library).chain(&self.evaluate).chain(labels).cloned().chain(own).collect())
    }

    /// Fits and evaluates.
    ///
    /// # Errors
    ///
    /// Those of readers; [`Error::Data`] where the matrix is not determined; [`Error::Usage`] where the request makes no
    /// sense.
    pub fn run(&self) -> Result<Characterization> {
        let exposure = self.exposure.chosen()?;
        self.check_white()?;
        let loaded = data::load_sensor(&self.sensor)?;
        let viewer = Viewer { loaded: &loaded, observer: data::load_observer()?, grid: WavelengthGrid::default() };
        let seen = viewer.see_training(self)?;
        let plan = Plan::new(self, &seen)?;
        let responses = responses(&loaded.sensor, &loaded.response, &viewer.observer, &viewer.grid)?;
        let fitting = Fitting { fit: self, sensor: &loaded.sensor, seen: &seen, responses, plan, exposure };
        let (fitted, trade_off) = fitting.fit()?;
        let mut notes = vec![Note::Remark(format!(
            "fitted {} observations, condition number {:.1}",
            fitted.count, fitted.condition
        ))];
        let matrix = fitting.matrix(&fitted, viewer.grid)?;
        let evaluation = match &self.evaluate {
            None => None,
            Some(path) if is_same(path, &self.library) => Some(fitting.evaluation(&fitted, &seen)?),
            Some(path) => Some(fitting.evaluation(&fitted, &viewer.see(path, self)?)?),
        };
        match evaluation.as_ref().map_or(0, |evaluation| evaluation.beyond_full_well(loaded.sensor.full_well_e)) {
            0 => {}
            count => notes.push(Note::Warning(format!(
                "{count} samples exceed full well at their exposure; the differences without noise do not show it"
            ))),
        }
        Ok(Characterization { matrix, evaluation, trade_off, notes })
    }

    fn check_white(&self) -> Result<()> {
        match self.white.white {
            White::Absolute(white) if !white.iter().all(|value| *value > 0.0) => {
                let [x, y, z] = white;
                Err(Error::Usage(format!("a white of XYZ {x} {y} {z} is impossible; all three must be above 0")))
            }
            _ => Ok(()),
        }
    }

    fn noise(&self) -> NoiseSettings {
        NoiseSettings {
            seed: self.seed,
            sensor_seed: self.sensor_seed,
            without: self.without.clone(),
            ..NoiseSettings::default()
        }
    }
}

/// Whether two paths lead to one file.
fn is_same(one: &Path, other: &Path) -> bool {
    one == other || one.canonicalize().is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/sample_data/skies/");

    /// A fit of the 912 skies without noise, those of one aerosol held out.
    fn without_urban() -> Fit {
        let library = format!("{SKIES}sky912.exr");
        Fit {
            labels: Some((format!("{SKIES}sky912_meta.csv").into(), "aerosol".into())),
            hold_out: vec!["urban5".into()],
            evaluate: Some(library.clone().into()),
            noise_free: true,
            ..Fit::of(library)
        }
    }

    #[test]
    fn what_is_held_out_is_not_trained_on() {
        let found = without_urban().run().unwrap();
        let evaluation = found.evaluation.unwrap();
        let group = |name: &str| evaluation.groups.iter().find(|group| group.name == name).unwrap();
        let (held, trained, others) = (group("urban5 (held out)"), group("trained on"), group("never trained on"));
        assert_eq!((held.trained_on, held.samples), (0, others.samples));
        assert_eq!(held.differences, others.differences);
        assert_eq!((trained.trained_on, trained.samples + others.samples), (trained.samples, 912));
        let training = found.matrix.training.unwrap();
        assert_eq!((training.count, training.held_out.as_slice()), (trained.samples, &["urban5".to_owned()][..]));
        assert_eq!((evaluation.noise, found.trade_off.len()), (None, 0));
        assert!(matches!(&found.notes[..], [Note::Remark(text)] if text.starts_with("fitted ")), "{:?}", found.notes);
    }

    #[test]
    fn a_count_of_training_samples_leaves_the_held_out_alone() {
        let fit = Fit { train: Some(TrainingChoice::Count(12)), evaluate: None, ..without_urban() };
        let found = fit.run().unwrap();
        let training = found.matrix.training.unwrap();
        assert!(training.chosen_by.is_some() && found.evaluation.is_none());
        let all = without_urban().run().unwrap().matrix.training.unwrap().samples.unwrap();
        let chosen = training.samples.unwrap();
        assert!(chosen.len() == 12 && chosen.iter().all(|sample| all.contains(sample)), "{chosen:?}");
    }

    #[test]
    fn choices_that_contradict_each_other_are_refused() {
        let complaint = |fit: Fit| fit.run().unwrap_err().to_string();
        assert!(complaint(Fit { labels: None, ..without_urban() }).contains("--labels FILE:COLUMN"));
        assert!(complaint(Fit { hold_out: vec!["urban".into()], ..without_urban() }).contains("there are "));
        let untrained = Fit { regression: Regression::MaxIgnSppls, ..without_urban() };
        let train = Some(TrainingChoice::Count(12));
        assert!(complaint(Fit { train, ..untrained }).contains("has no training samples"));
        assert!(complaint(Fit { white_sample: Some(3), ..without_urban() }).contains("keeps no sample exact"));
        let white = WhiteChoice { white: White::Absolute([1.0, 0.0, 1.0]), white_luminance: None };
        assert!(complaint(Fit { white, ..without_urban() }).contains("is impossible"));
    }
}
