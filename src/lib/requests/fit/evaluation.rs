//! How a matrix does on a library: with and without noise, and in which parts of the library.

use super::fitting::Fitting;
use super::library::SeenLibrary;
use crate::analysis::characterization::evaluation::{SampleEvaluation, SampleExposure, evaluate, noise_free, noisy};
use crate::analysis::characterization::regression::FittedMatrix;
use crate::color::difference::{DELTA_E_PER_JND, DifferenceReport};
use crate::error::{Error, Result};
use crate::names::Named;
use serde::Serialize;

/// How a matrix does on a library.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// What was evaluated, and under which conditions.
    pub conditions: Conditions,
    /// Differences without noise.
    pub noise_free: DifferenceReport,
    /// What noise does.
    pub noise: Option<NoiseReport>,
    /// Parts of the library.
    pub groups: Vec<Group>,
    /// Each sample.
    pub samples: Vec<SampleEvaluation>,
    /// Label of each sample, where there are labels.
    pub labels: Vec<String>,
}

/// What was evaluated, and under which conditions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conditions {
    /// The library.
    pub library: String,
    /// Samples of it.
    pub samples: usize,
    /// How they were exposed.
    pub exposure: String,
    /// The white of L*a*b*.
    pub white: String,
    /// Demosaicking method.
    pub demosaic: &'static str,
    /// Pixels of each sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patch: Option<[usize; 2]>,
    /// Seed of the noise.
    pub seed: u64,
    /// Dark frames whose mean was subtracted.
    pub dark_frames: u32,
}

/// What noise does to the samples of a library.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseReport {
    /// Differences between the mean color of each sample's pixels and the true color.
    pub patch_mean: DifferenceReport,
    /// Mean difference of each sample's pixels from the true color.
    pub pixel_mean: DifferenceReport,
    /// Standard deviation of these differences over each sample's pixels.
    pub pixel_std: DifferenceReport,
    /// Largest of these differences.
    pub pixel_max: DifferenceReport,
    /// Mean distance of each sample's pixels from the color that the camera gives without noise.
    pub noise: DifferenceSummaries,
    /// Pixels clipped at full well or at the last code.
    pub clipped: u64,
}

/// The distance that noise makes, simulated and by formula, ΔE*ab: mean over the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DifferenceSummaries {
    /// Simulated.
    pub simulated_delta_e: f64,
    /// By formula; none where nothing is predicted.
    pub predicted_delta_e: Option<f64>,
    /// Simulated, in just noticeable differences.
    pub simulated_jnd: f64,
    /// By formula.
    pub predicted_jnd: Option<f64>,
}

/// A part of the library.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// Its label.
    pub name: String,
    /// Samples.
    pub samples: usize,
    /// Samples that the matrix was fitted on.
    pub trained_on: usize,
    /// Differences without noise.
    #[serde(flatten)]
    pub differences: DifferenceReport,
}

impl Evaluation {
    /// The number of samples with a class beyond full well, which the differences without noise do not show.
    pub fn beyond_full_well(&self, full_well_e: f64) -> usize {
        self.samples.iter().filter(|sample| sample.electrons.iter().any(|e| *e > full_well_e)).count()
    }
}

impl Fitting<'_> {
    /// Evaluates the matrix on a library; its parts are told apart where it is the one that was trained on.
    pub(super) fn evaluation(&self, fitted: &FittedMatrix, seen: &SeenLibrary) -> Result<Evaluation> {
        let settings = self.evaluation_settings(fitted.xyz_from_camera, seen.library.columns);
        let samples = evaluate(self.sensor, &seen.signals, &settings)?;
        let none = || Error::Data(format!("{} holds no samples", seen.name));
        Ok(Evaluation {
            conditions: Conditions {
                library: seen.name.clone(),
                samples: samples.len(),
                exposure: in_words(settings.exposure),
                white: self.white_in_words(),
                demosaic: settings.method.name(),
                patch: settings.patch,
                seed: settings.noise.seed,
                dark_frames: settings.dark_frames,
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
        let settings = &self.plan.settings;
        let is_trained = |sample: &&SampleEvaluation| {
            settings.kept == Some(sample.sample) || settings.training.contains(&sample.sample)
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
        for label in self.seen.distinct_labels() {
            let members = samples.iter().filter(|sample| self.seen.labels[sample.sample] == label).collect();
            let held = if self.fit.hold_out.contains(&label) { " (held out)" } else { "" };
            groups.push(group(format!("{label}{held}"), members));
        }
        groups.into_iter().flatten().collect()
    }
}

fn in_words(exposure: SampleExposure) -> String {
    match exposure {
        SampleExposure::Fixed(exposure) => format!("exposed {} s at f/{}", exposure.exposure_s, exposure.f_number),
        SampleExposure::Filled { fraction, by, .. } => {
            format!("each exposed to {fraction} of full well by its {}", by.name())
        }
    }
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
