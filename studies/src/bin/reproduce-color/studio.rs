//! The camera, the skies, and what is done with them.

use crate::{Choice, HeldOut};
use cyanometer::analysis::characterization::evaluation::{
    EvaluationSettings, Filling, SampleEvaluation, SampleExposure, evaluate, noise_free, pixel_covariances,
};
use cyanometer::analysis::characterization::noise_aware::{NoiseTerms, NoisySample, TradeOff};
use cyanometer::analysis::characterization::regression::{FitSettings, Regression, Weights, fit};
use cyanometer::analysis::characterization::training::{average_sample, spanning_subset};
use cyanometer::color::Space;
use cyanometer::color::difference::DifferenceReport;
use cyanometer::error::{Error, Result};
use cyanometer::formats::{csv, files};
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer_studies::camera::{Camera, EXPOSURE, Matrix, Seen, color_settings, sample_data};

/// Pixels of each sky, columns and rows: the paper's 15 × 20.
pub const PATCH: [usize; 2] = [20, 15];
/// Share of full well that the brightest class fills: the aperture follows.
pub const FILLING: f64 = 0.75;
/// Training samples.
pub const TRAINING: usize = 20;
/// Seed of the noise.
pub const SEED: u64 = 3;

/// Camera, observer and skies.
pub struct Studio {
    /// The camera and the 912 computed skies.
    pub camera: Camera,
    /// The measured skies.
    pub measured: Seen,
    aerosols: Vec<String>,
    /// The samples that are trained on.
    pub training: Vec<usize>,
    /// The sample that is kept exact.
    pub kept: usize,
}

impl Studio {
    pub fn new() -> Result<Self> {
        let camera = Camera::new()?;
        let labels = |column| {
            let path = sample_data("skies/sky912_meta.csv");
            csv::text_column(&path.display().to_string(), &files::read_file(&path)?, column)
        };
        // Rural skies come in two visibilities.
        let aerosols = labels("aerosol")?.into_iter().zip(labels("vis_km")?);
        let aerosols = aerosols.map(|(name, vis_km)| match vis_km.parse() {
            Ok(0.0_f64) | Err(_) => name,
            Ok(km) => format!("{} {km} km", name.trim_end_matches(|c: char| c.is_ascii_digit())),
        });
        let all: Vec<usize> = (0..camera.skies.library.radiance.nrows()).collect();
        Ok(Self {
            training: spanning_subset(&camera.skies.library, &all, TRAINING)?,
            kept: average_sample(&camera.skies.signals, &all)?,
            aerosols: aerosols.collect(),
            measured: camera.measured_skies()?,
            camera,
        })
    }

    /// The aerosol of a sky.
    pub fn aerosol(&self, sky: usize) -> &str {
        &self.aerosols[sky]
    }

    pub fn fit(&self, regression: Regression, training: &[usize], weights: &Weights) -> Result<Matrix> {
        let trained = regression.is_trained();
        let settings = FitSettings {
            regression,
            training: if trained { training.to_vec() } else { Vec::new() },
            kept: regression.keeps_a_sample().then_some(self.kept),
            weights: if trained { weights.clone() } else { Weights::Equal },
            ridge: 0.0,
        };
        Ok(fit(&self.camera.skies.signals, &self.camera.responses, &settings, None)?.xyz_from_camera)
    }

    fn settings(&self, seen: &Seen, xyz_from_camera: Matrix, method: Method, with_noise: bool) -> EvaluationSettings {
        EvaluationSettings {
            exposure: SampleExposure::Filled { base: EXPOSURE, fraction: FILLING, by: Filling::Aperture },
            noise: NoiseSettings { seed: SEED, ..NoiseSettings::default() },
            method,
            pattern: None,
            color: color_settings(xyz_from_camera, Space::Lab),
            patch: with_noise.then_some(PATCH),
            columns: seen.library.columns,
            dark_frames: 1,
        }
    }

    pub fn evaluate(
        &self,
        seen: &Seen,
        matrix: &Matrix,
        method: Method,
        with_noise: bool,
    ) -> Result<Vec<SampleEvaluation>> {
        evaluate(&self.camera.sensor, &seen.signals, &self.settings(seen, *matrix, method, with_noise))
    }

    /// Differences without noise of the skies that `chosen` names, or all.
    fn report(&self, seen: &Seen, matrix: &Matrix, chosen: impl Fn(usize) -> bool) -> Result<DifferenceReport> {
        let skies = self.evaluate(seen, matrix, Method::EffectiveColor, false)?;
        noise_free(skies.iter().filter(|sky| chosen(sky.sample))).ok_or_else(|| Error::Data("no skies".into()))
    }

    /// Both regressions that are trained, on some samples.
    fn trained(
        &self,
        training: &[usize],
        weights: &Weights,
        chosen: impl Fn(usize) -> bool + Copy,
    ) -> Result<[DifferenceReport; 2]> {
        let one = |regression| self.report(&self.camera.skies, &self.fit(regression, training, weights)?, chosen);
        Ok([one(Regression::SkyRadLs)?, one(Regression::SkyRadSppls)?])
    }

    /// Other choices of training samples and weights.
    pub fn choices(&self) -> Result<Vec<Choice>> {
        let all: Vec<usize> = (0..self.aerosols.len()).collect();
        let mut choices = Vec::new();
        for count in [3, 5, 10, 20, 40, 80, all.len()] {
            let training = if count == all.len() {
                all.clone()
            } else {
                spanning_subset(&self.camera.skies.library, &all, count)?
            };
            for (name, weights) in [("relative", Weights::Relative), ("equal", Weights::Equal)] {
                choices.push(Choice {
                    training: count.to_string(),
                    weights: name,
                    reports: self.trained(&training, &weights, |_| true)?,
                });
            }
        }
        Ok(choices)
    }

    /// Each aerosol left out in turn.
    pub fn held_out(&self) -> Result<Vec<HeldOut>> {
        let mut names = self.aerosols.clone();
        names.sort();
        names.dedup();
        names
            .into_iter()
            .map(|aerosol| {
                let is_one = |sky: usize| self.aerosols[sky] == aerosol;
                let others: Vec<usize> = (0..self.aerosols.len()).filter(|&sky| !is_one(sky)).collect();
                let without = spanning_subset(&self.camera.skies.library, &others, TRAINING)?;
                Ok(HeldOut {
                    count: self.aerosols.len() - others.len(),
                    with: self.trained(&self.training, &Weights::Relative, is_one)?,
                    without: self.trained(&without, &Weights::Relative, is_one)?,
                    aerosol,
                })
            })
            .collect()
    }

    /// The measured skies, by matrices that never saw them, and by their own.
    pub fn measured_skies(&self) -> Result<(Vec<(&'static str, DifferenceReport)>, DifferenceReport)> {
        let never = crate::REGRESSIONS
            .into_iter()
            .map(|(name, regression)| {
                let matrix = self.fit(regression, &self.training, &Weights::Relative)?;
                Ok((name, self.report(&self.measured, &matrix, |_| true)?))
            })
            .collect::<Result<_>>()?;
        let all = (0..self.measured.library.radiance.nrows()).collect();
        let settings = FitSettings { training: all, weights: Weights::Relative, ..FitSettings::default() };
        let own = fit(&self.measured.signals, &self.camera.responses, &settings, None)?.xyz_from_camera;
        Ok((never, self.report(&self.measured, &own, |_| true)?))
    }

    /// What errors of color cost in noise: SkyRadLS on the training samples.
    pub fn trade_off(&self) -> Result<Vec<TradeOff>> {
        let first = self.fit(Regression::SkyRadLs, &self.training, &Weights::Equal)?;
        let signals = &self.camera.skies.signals;
        let settings = self.settings(&self.camera.skies, first, Method::EffectiveColor, false);
        let noise = pixel_covariances(&self.camera.sensor, signals, &settings, &self.training)?;
        let samples = self.training.iter().zip(noise).map(|(&sky, (covariance, white))| NoisySample {
            camera: [0, 1, 2].map(|j| signals.camera[(sky, j)]),
            xyz: [0, 1, 2].map(|j| signals.xyz[(sky, j)]),
            white,
            covariance,
        });
        let mut terms = NoiseTerms { samples: samples.collect(), weight: 0.0 };
        let weights = std::iter::once(0.0).chain((-16..=8).map(|quarter| 10f64.powf(f64::from(quarter) / 4.0)));
        let fit_settings = FitSettings { training: self.training.clone(), ..FitSettings::default() };
        weights
            .map(|weight| {
                terms.weight = weight;
                let fitted = fit(signals, &self.camera.responses, &fit_settings, Some(&terms))?;
                Ok(terms.trade_off(&fitted.xyz_from_camera))
            })
            .collect()
    }
}
