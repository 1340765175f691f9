//! The work of `fit-matrix`: from a request to a matrix and what is known of it.

use super::Session;
use crate::analysis::characterization::evaluation::{
    EvaluationSettings, SampleEvaluation, SampleExposure, evaluate, noise_free, noisy, pixel_covariances,
};
use crate::analysis::characterization::noise_aware::{NoiseTerms, NoisySample, TradeOff};
use crate::analysis::characterization::regression::{FitSettings, FittedMatrix, Regression, Weights, fit, residuals};
use crate::analysis::characterization::training::{CHOSEN_BY, average_sample, spanning_subset};
use crate::analysis::characterization::{
    CameraMatrix, MATRIX_SCHEMA, MATRIX_UNIT, Performance, Signals, Training, responses, signals,
};
use crate::camera::sensor::Sensor;
use crate::color::difference::DELTA_E_PER_JND;
use crate::color::{Space, White};
use crate::error::{Error, Result};
use crate::formats::plots::{PlotFormat, write_plot};
use crate::formats::{csv, data, files, output, spectral};
use crate::report::characterization::{
    About, Characterization, DifferenceSummaries, Evaluation, Group, NoiseReport, characterization, matrix,
};
use crate::report::{self, ReportFormat};
use crate::spectrum::{SpectralLibrary, WavelengthGrid};
use crate::stages::demosaic::Method;
use crate::stages::noise::NoiseSettings;
use crate::stages::to_xyz::ColorSettings;
use crate::units::RadianceUnit;
use std::path::{Path, PathBuf};

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
pub fn training(text: &str) -> std::result::Result<TrainingChoice, String> {
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
pub fn weights(text: &str) -> std::result::Result<Weights, String> {
    match text {
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
pub fn labels(text: &str) -> std::result::Result<(PathBuf, String), String> {
    match text.rsplit_once(':') {
        Some((file, column)) if !file.is_empty() && !column.is_empty() => Ok((file.into(), column.into())),
        _ => Err("give FILE:COLUMN, such as sky912_meta.csv:aerosol".into()),
    }
}

/// What is to be fitted and evaluated, and how.
#[derive(Debug, Clone)]
pub struct Request {
    /// Library to train on.
    pub library: PathBuf,
    /// Unit of its radiance, and of that to evaluate.
    pub radiance_unit: Option<RadianceUnit>,
    /// Sensor, name or file.
    pub sensor: String,
    /// Regression.
    pub regression: Regression,
    /// Training samples.
    pub train: Option<TrainingChoice>,
    /// Sample kept exact.
    pub white_sample: Option<usize>,
    /// Weights of training samples.
    pub weights: Weights,
    /// Ridge.
    pub ridge: f64,
    /// Weight of noise.
    pub noise_weight: Option<f64>,
    /// File and column of the samples' labels.
    pub labels: Option<(PathBuf, String)>,
    /// Labels to keep out of the training.
    pub hold_out: Vec<String>,
    /// Library to evaluate.
    pub evaluate: Option<PathBuf>,
    /// How samples are exposed.
    pub exposure: SampleExposure,
    /// Noise.
    pub noise: NoiseSettings,
    /// Demosaicking method.
    pub method: Method,
    /// White of L*a*b*.
    pub white: White,
    /// Its luminance.
    pub white_luminance: Option<f64>,
    /// Pixels of each sample.
    pub patch: [usize; 2],
    /// Dark frames to subtract.
    pub dark_frames: u32,
    /// Whether noise is left out of the evaluation.
    pub noise_free: bool,
    /// Matrix file.
    pub output: Option<PathBuf>,
    /// Form of the report.
    pub format: Option<ReportFormat>,
    /// File for the trade-off curve.
    pub plot: Option<PathBuf>,
}

/// A library as the camera sees it.
struct Seen {
    name: String,
    library: SpectralLibrary,
    signals: Signals,
    labels: Vec<String>,
}

/// Noise weights of the trade-off curve: from the best matrix without noise to one that hardly sees color.
fn noise_weights() -> impl Iterator<Item = f64> {
    std::iter::once(0.0).chain((-16..=8).map(|quarter| 10f64.powf(f64::from(quarter) / 4.0)))
}

impl Request {
    /// Fits, evaluates, and writes matrix and report.
    ///
    /// # Errors
    ///
    /// Those of readers and writers; [`Error::Data`] where the matrix is not determined; [`Error::Usage`] where the request
    /// makes no sense.
    pub fn run(&self, session: &Session) -> Result<()> {
        let loaded = data::load_sensor(&self.sensor)?;
        self.check(&loaded.sensor)?;
        let observer = data::load_observer()?;
        let grid = WavelengthGrid::default();
        let see = |path: &Path, labels: Vec<String>| -> Result<Seen> {
            let library = spectral::read_library(path, self.radiance_unit)?;
            let signals = signals(&library, &loaded.sensor, &loaded.response, &observer, &grid)?;
            let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            Ok(Seen { name, library, signals, labels })
        };
        let seen = see(&self.library, self.read_labels()?)?;
        let (settings, chosen) = self.settings(&seen)?;
        let responses = responses(&loaded.sensor, &loaded.response, &observer, &grid)?;
        let fitting = Fitting { request: self, sensor: &loaded.sensor, seen: &seen, responses, settings, chosen };
        let (fitted, trade_off) = fitting.fit()?;
        session.note(&format!("fitted {} observations, condition number {:.1}", fitted.count, fitted.condition));
        let mut made = fitting.matrix(&fitted, grid);
        made.filter = loaded.sensor.cover_glass.as_ref().map(|glass| match &glass.column {
            Some(column) => format!("{}, {column}", glass.file),
            None => glass.file.clone(),
        });
        made.performance = fitting.performance(&fitted)?;
        let evaluation = match &self.evaluate {
            None => None,
            Some(path) if is_same(path, &self.library) => Some(fitting.evaluation(&fitted, &seen)?),
            Some(path) => Some(fitting.evaluation(&fitted, &see(path, Vec::new())?)?),
        };
        if let Some(evaluation) = &evaluation {
            let full = evaluation.samples.iter().filter(|s| s.electrons.iter().any(|e| *e > loaded.sensor.full_well_e));
            match full.count() {
                0 => {}
                count => session.warn(&format!(
                    "{count} samples exceed full well at their exposure; the differences without noise do not show it"
                )),
            }
        }
        self.write(&Characterization { matrix: made, evaluation, trade_off })
    }

    /// What can be refused before any work.
    fn check(&self, sensor: &Sensor) -> Result<()> {
        if let Some(plot) = &self.plot {
            PlotFormat::of_path(plot)?;
            if self.noise_weight.is_none() {
                return Err(Error::Usage("--plot draws the trade-off of --noise-weight; give that too".into()));
            }
        }
        if self.format == Some(ReportFormat::Csv) && !self.has_report() {
            return Err(Error::Usage(
                "csv has one row for each sample of --evaluate LIBRARY, or for each weight of --noise-weight; give one of \
                 them too"
                    .into(),
            ));
        }
        if let White::Absolute(white) = self.white
            && !white.iter().all(|value| *value > 0.0)
        {
            let [x, y, z] = white;
            return Err(Error::Usage(format!("a white of XYZ {x} {y} {z} is impossible; all three must be above 0")));
        }
        let own = data::sensor_files(&self.sensor, sensor);
        let labels = self.labels.as_ref().map(|(file, _)| file);
        let inputs: Vec<&Path> = std::iter::once(&self.library)
            .chain(&self.evaluate)
            .chain(labels)
            .chain(&own)
            .map(PathBuf::as_path)
            .collect();
        output::check_outputs(&[self.output.as_deref(), self.plot.as_deref()], &inputs)
    }

    fn has_report(&self) -> bool {
        self.evaluate.is_some() || self.noise_weight.is_some()
    }

    fn write(&self, found: &Characterization) -> Result<()> {
        let to_file = files::named(self.output.as_deref());
        if let Some(path) = to_file {
            output::write_text(Some(path), &matrix(&found.matrix)?, None)?;
        }
        if let Some(plot) = &self.plot {
            write_plot(plot, &report::trade_off(&found.trade_off), None)?;
        }
        let format = self.format.unwrap_or(if self.has_report() { ReportFormat::Text } else { ReportFormat::Yaml });
        if to_file.is_none() || self.has_report() || format != ReportFormat::Yaml {
            output::write_text(None, &characterization(found, format)?, None)?;
        }
        Ok(())
    }

    fn read_labels(&self) -> Result<Vec<String>> {
        match &self.labels {
            Some((file, column)) => csv::text_column(&file.display().to_string(), &files::read_file(file)?, column),
            None if self.hold_out.is_empty() => Ok(Vec::new()),
            None => Err(Error::Usage("--hold-out names labels; give them with --labels FILE:COLUMN".into())),
        }
    }

    /// Training samples and the one kept exact, and how they were chosen.
    fn settings(&self, seen: &Seen) -> Result<(FitSettings, Option<String>)> {
        let available = seen.library.radiance.nrows();
        if !seen.labels.is_empty() && seen.labels.len() != available {
            return Err(Error::Usage(format!(
                "there are {} labels for {available} samples of {}",
                seen.labels.len(),
                seen.name
            )));
        }
        if let Some(unknown) = self.hold_out.iter().find(|label| !seen.labels.contains(label)) {
            let mut known = seen.labels.clone();
            known.sort();
            known.dedup();
            return Err(Error::Usage(format!("no sample has the label `{unknown}`; there are {}", known.join(", "))));
        }
        let is_held = |sample: &usize| seen.labels.get(*sample).is_some_and(|label| self.hold_out.contains(label));
        let candidates: Vec<usize> = (0..available).filter(|sample| !is_held(sample)).collect();
        if candidates.is_empty() {
            return Err(Error::Usage("all samples are held out; none is left to train on".into()));
        }
        let mut chosen = None;
        let training = match &self.train {
            _ if !self.regression.is_trained() => {
                if self.train.is_some() {
                    return Err(Error::Usage(format!(
                        "{} is fitted on the responses alone; it has no training samples",
                        self.regression.name()
                    )));
                }
                Vec::new()
            }
            None => candidates.clone(),
            Some(TrainingChoice::List(list)) => {
                if let Some(held) = list.iter().find(|sample| is_held(sample)) {
                    return Err(Error::Usage(format!("sample {held} is held out; leave it out of --train")));
                }
                list.clone()
            }
            Some(TrainingChoice::Count(count)) => {
                chosen = Some(CHOSEN_BY.to_owned());
                spanning_subset(&seen.library, &candidates, *count)?
            }
        };
        let kept = match (self.regression.keeps_a_sample(), self.white_sample) {
            (true, Some(sample)) if is_held(&sample) => {
                return Err(Error::Usage(format!(
                    "sample {sample} is held out; keep another exact with --white-sample"
                )));
            }
            (true, Some(sample)) => Some(sample),
            (true, None) => Some(average_sample(&seen.signals, &candidates)?),
            (false, None) => None,
            (false, Some(_)) => {
                return Err(Error::Usage(format!(
                    "{} keeps no sample exact; leave out --white-sample, or choose another --method",
                    self.regression.name()
                )));
            }
        };
        let settings = FitSettings {
            regression: self.regression,
            training,
            kept,
            weights: self.weights.clone(),
            ridge: self.ridge,
        };
        Ok((settings, chosen))
    }

    fn evaluation_settings(&self, xyz_from_camera: [[f64; 3]; 3], columns: usize) -> EvaluationSettings {
        EvaluationSettings {
            exposure: self.exposure,
            noise: self.noise.clone(),
            method: self.method,
            pattern: None,
            color: ColorSettings {
                xyz_from_camera,
                method: None,
                space: Space::Lab,
                white: self.white,
                white_luminance: self.white_luminance,
            },
            patch: (!self.noise_free).then_some(self.patch),
            columns,
            dark_frames: self.dark_frames,
        }
    }

    fn white_in_words(&self) -> String {
        let name = match self.white {
            White::Absolute([x, y, z]) => return format!("XYZ {x} {y} {z}"),
            White::D65 => "D65",
            White::EqualEnergy => "equal energy",
        };
        match self.white_luminance {
            Some(luminance) => format!("{name} of {luminance} cd/m2"),
            None => format!(
                "{name}, as bright as saturates the camera at the sample's exposure, by the sensor file's matrix"
            ),
        }
    }

    fn exposure_in_words(&self) -> String {
        match self.exposure {
            SampleExposure::Fixed(exposure) => format!("exposed {} s at f/{}", exposure.exposure_s, exposure.f_number),
            SampleExposure::Filled { fraction, by, .. } => {
                format!("each exposed to {fraction} of full well by its {}", by.name())
            }
        }
    }
}

/// A fit that is ready to be made.
struct Fitting<'a> {
    request: &'a Request,
    sensor: &'a Sensor,
    seen: &'a Seen,
    responses: Signals,
    settings: FitSettings,
    chosen: Option<String>,
}

impl Fitting<'_> {
    fn solve(&self, noise: Option<&NoiseTerms>) -> Result<FittedMatrix> {
        fit(&self.seen.signals, &self.responses, &self.settings, noise)
    }

    /// The matrix, and what other noise weights would have given.
    fn fit(&self) -> Result<(FittedMatrix, Vec<TradeOff>)> {
        let signals = &self.seen.signals;
        let Some(weight) = self.request.noise_weight else { return Ok((self.solve(None)?, Vec::new())) };
        // The white's luminance, where the camera saturates, takes a matrix: that without noise.
        let first = self.solve(None)?;
        let columns = self.seen.library.columns;
        let settings = self.request.evaluation_settings(first.xyz_from_camera, columns);
        let noise = pixel_covariances(self.sensor, signals, &settings, &self.settings.training)?;
        let row = |matrix: &nalgebra::DMatrix<f64>, sample: usize| [0, 1, 2].map(|j| matrix[(sample, j)]);
        let samples = self.settings.training.iter().zip(noise).map(|(&sample, (covariance, white))| NoisySample {
            camera: row(&signals.camera, sample),
            xyz: row(&signals.xyz, sample),
            white,
            covariance,
        });
        let mut terms = NoiseTerms { samples: samples.collect(), weight };
        let fitted = self.solve(Some(&terms))?;
        let mut trade_off = Vec::new();
        let mut weights: Vec<f64> = noise_weights().chain(std::iter::once(weight)).collect();
        weights.sort_by(f64::total_cmp);
        weights.dedup();
        for weight in weights {
            terms.weight = weight;
            trade_off.push(terms.trade_off(&self.solve(Some(&terms))?.xyz_from_camera));
        }
        Ok((fitted, trade_off))
    }

    fn matrix(&self, fitted: &FittedMatrix, grid: WavelengthGrid) -> CameraMatrix {
        let FitSettings { regression, training, kept, weights, ridge } = &self.settings;
        let available = self.seen.signals.camera.nrows();
        let every: Vec<usize> = (0..available).collect();
        let judged = if regression.is_trained() { training } else { &every };
        let (relative_rms, max_chromaticity_error) = residuals(&fitted.xyz_from_camera, &self.seen.signals, judged);
        CameraMatrix {
            schema: MATRIX_SCHEMA.into(),
            sensor: Some(self.sensor.name.clone()),
            filter: None,
            method: Some(regression.name().into()),
            unit: Some(MATRIX_UNIT.into()),
            xyz_from_camera: fitted.xyz_from_camera,
            // None where a ridge stands in for signals that are missing.
            condition: Some(fitted.condition).filter(|condition| condition.is_finite()),
            rank: Some(fitted.rank),
            training: Some(Training {
                library: self.seen.name.clone(),
                samples: Some(training.clone()).filter(|samples| !samples.is_empty() && *samples != every),
                chosen_by: self.chosen.clone(),
                held_out: self.request.hold_out.clone(),
                count: fitted.count,
                weights: match weights {
                    Weights::Equal => None,
                    Weights::Relative => Some("relative".into()),
                    Weights::Given(_) => Some("given".into()),
                },
                ridge: Some(*ridge).filter(|ridge| *ridge > 0.0),
                noise_weight: self.request.noise_weight,
                white_sample: *kept,
                relative_rms,
                max_chromaticity_error,
            }),
            uncertainty: fitted.uncertainty.clone(),
            performance: None,
            observer: Some("CIE 1931 2 degrees".into()),
            wavelengths: Some(grid),
        }
    }

    /// How the matrix does without noise on its own library; none where that has samples without light, or the matrix
    /// gives no white.
    fn performance(&self, fitted: &FittedMatrix) -> Result<Option<Performance>> {
        let settings = EvaluationSettings {
            patch: None,
            ..self.request.evaluation_settings(fitted.xyz_from_camera, self.seen.library.columns)
        };
        let samples = match evaluate(self.sensor, &self.seen.signals, &settings) {
            Ok(samples) => samples,
            Err(Error::Data(_) | Error::Usage(_)) => return Ok(None),
            Err(error) => return Err(error),
        };
        Ok(noise_free(&samples).map(|differences| Performance {
            library: self.seen.name.clone(),
            samples: samples.len() as u64,
            white: self.request.white_in_words(),
            differences,
        }))
    }

    fn evaluation(&self, fitted: &FittedMatrix, seen: &Seen) -> Result<Evaluation> {
        let settings = self.request.evaluation_settings(fitted.xyz_from_camera, seen.library.columns);
        let samples = evaluate(self.sensor, &seen.signals, &settings)?;
        let none = || Error::Data(format!("{} holds no samples", seen.name));
        Ok(Evaluation {
            about: About {
                library: seen.name.clone(),
                samples: samples.len(),
                exposure: self.request.exposure_in_words(),
                white: self.request.white_in_words(),
                demosaic: self.request.method.names()[0],
                patch: settings.patch,
                seed: self.request.noise.seed,
                dark_frames: self.request.dark_frames,
            },
            noise_free: noise_free(&samples).ok_or_else(none)?,
            noise: noise_report(&samples),
            groups: if std::ptr::eq(seen, self.seen) { self.groups(&samples) } else { Vec::new() },
            samples,
            labels: seen.labels.clone(),
        })
    }

    /// The samples that were trained on and the others; and those of each label.
    fn groups(&self, samples: &[SampleEvaluation]) -> Vec<Group> {
        let is_trained = |sample: &&SampleEvaluation| {
            self.settings.kept == Some(sample.sample) || self.settings.training.contains(&sample.sample)
        };
        let group = |name: String, members: Vec<&SampleEvaluation>| {
            let trained_on = members.iter().filter(|sample| is_trained(sample)).count();
            noise_free(members.iter().copied()).map(|differences| Group {
                name,
                samples: members.len(),
                trained_on,
                differences,
            })
        };
        let (trained, others): (Vec<_>, Vec<_>) = samples.iter().partition(is_trained);
        let mut groups = Vec::new();
        if !trained.is_empty() && !others.is_empty() {
            groups.push(group("trained on".into(), trained));
            groups.push(group("never trained on".into(), others));
        }
        let mut labels = self.seen.labels.clone();
        labels.sort();
        labels.dedup();
        for label in labels {
            let members = samples.iter().filter(|sample| self.seen.labels[sample.sample] == label).collect();
            let held = if self.request.hold_out.contains(&label) { " (held out)" } else { "" };
            groups.push(group(format!("{label}{held}"), members));
        }
        groups.into_iter().flatten().collect()
    }
}

/// Whether two paths lead to one file.
fn is_same(one: &Path, other: &Path) -> bool {
    one == other || one.canonicalize().is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}

/// What noise does to the samples; none where they have none.
fn noise_report(samples: &[SampleEvaluation]) -> Option<NoiseReport> {
    let noises: Vec<_> = samples.iter().map(|sample| sample.noise).collect::<Option<_>>()?;
    let count = noises.len() as f64;
    let simulated = noises.iter().map(|noise| noise.noise_delta_e).sum::<f64>() / count;
    let predicted: Option<Vec<f64>> = noises.iter().map(|noise| noise.predicted.map(|by| by.delta_e)).collect();
    let predicted = predicted.map(|all| all.iter().sum::<f64>() / count);
    Some(NoiseReport {
        patch_mean: noisy(samples, |noise| noise.patch_mean)?,
        pixel_mean: noisy(samples, |noise| noise.pixel_mean)?,
        pixel_std: noisy(samples, |noise| noise.pixel_std)?,
        pixel_max: noisy(samples, |noise| noise.pixel_max)?,
        noise: DifferenceSummaries {
            simulated_delta_e: simulated,
            predicted_delta_e: predicted,
            simulated_jnd: simulated / DELTA_E_PER_JND,
            predicted_jnd: predicted.map(|delta_e| delta_e / DELTA_E_PER_JND),
        },
        clipped: noises.iter().map(|noise| noise.clipped).sum(),
    })
}
