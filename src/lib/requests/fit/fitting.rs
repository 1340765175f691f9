//! The fit itself: the matrix, what other noise weights would give, and how it does on its own library.

use super::library::SeenLibrary;
use super::request::Fit;
use super::training::Plan;
use crate::analysis::characterization::evaluation::{
    EvaluationSettings, SampleExposure, evaluate, noise_free, pixel_covariances,
};
use crate::analysis::characterization::noise_aware::{NoiseTerms, NoisySample, TradeOff};
use crate::analysis::characterization::regression::{FitSettings, FittedMatrix, Weights, fit, residuals};
use crate::analysis::characterization::{CameraMatrix, MATRIX_SCHEMA, MATRIX_UNIT, Performance, Signals, Training};
use crate::camera::sensor::Sensor;
use crate::color::{Space, White};
use crate::error::{Error, Result};
use crate::names::Named;
use crate::spectrum::WavelengthGrid;
use crate::stages::to_xyz::ColorSettings;
use nalgebra::DMatrix;

/// A fit that is ready to be made.
pub(super) struct Fitting<'a> {
    pub(super) fit: &'a Fit,
    pub(super) sensor: &'a Sensor,
    pub(super) seen: &'a SeenLibrary,
    /// Signals at single wavelengths, for maximum ignorance.
    pub(super) responses: Signals,
    pub(super) plan: Plan,
    pub(super) exposure: SampleExposure,
}

/// Noise weights of the trade-off curve: from the best matrix without noise to one that hardly sees color.
fn noise_weights() -> impl Iterator<Item = f64> {
    std::iter::once(0.0).chain((-16..=8).map(|quarter| 10f64.powf(f64::from(quarter) / 4.0)))
}

impl Fitting<'_> {
    fn solve(&self, noise: Option<&NoiseTerms>) -> Result<FittedMatrix> {
        fit(&self.seen.signals, &self.responses, &self.plan.settings, noise)
    }

    /// The matrix, and what other noise weights would have given.
    pub(super) fn fit(&self) -> Result<(FittedMatrix, Vec<TradeOff>)> {
        let signals = &self.seen.signals;
        let Some(weight) = self.fit.noise_weight else { return Ok((self.solve(None)?, Vec::new())) };
        // The white's luminance, where the camera saturates, takes a matrix: that without noise.
        let first = self.solve(None)?;
        let columns = self.seen.library.columns;
        let settings = self.evaluation_settings(first.xyz_from_camera, columns);
        let training = &self.plan.settings.training;
        let noise = pixel_covariances(self.sensor, signals, &settings, training)?;
        let row = |matrix: &DMatrix<f64>, sample: usize| [0, 1, 2].map(|j| matrix[(sample, j)]);
        let samples = training.iter().zip(noise).map(|(&sample, (covariance, white))| NoisySample {
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

    /// The matrix with all that is known of it, `grid` the wavelengths that signals are sums over.
    pub(super) fn matrix(&self, fitted: &FittedMatrix, grid: WavelengthGrid) -> Result<CameraMatrix> {
        let glass = self.sensor.response.as_ref().and_then(|files| files.cover_glass.as_ref());
        Ok(CameraMatrix {
            schema: MATRIX_SCHEMA.into(),
            sensor: Some(self.sensor.name.clone()),
            filter: glass.map(|glass| match &glass.column {
                Some(column) => format!("{}, {column}", glass.file),
                None => glass.file.clone(),
            }),
            response: self.sensor.response.clone(),
            pixel_pitch_um: self.sensor.readout.as_ref().and_then(|readout| readout.pixel_pitch_um),
            method: Some(self.fit.regression.name().into()),
            adu_per_e: self.sensor.readout.as_ref().map(|readout| readout.adu_per_e),
            iso_speed: None,
            camera_settings: None,
            range_adu: None,
            unit: Some(MATRIX_UNIT.into()),
            xyz_from_camera: fitted.xyz_from_camera,
            white_xy: None,
            // None where a ridge stands in for signals that are missing.
            condition: Some(fitted.condition).filter(|condition| condition.is_finite()),
            rank: Some(fitted.rank),
            training: Some(self.training(fitted)),
            uncertainty: fitted.uncertainty.clone(),
            performance: self.performance(fitted)?,
            chart: None,
            observer: Some("CIE 1931 2 degrees".into()),
            wavelengths: Some(grid),
        })
    }

    /// What the matrix was fitted on, and how well.
    fn training(&self, fitted: &FittedMatrix) -> Training {
        let FitSettings { regression, training, kept, weights, ridge } = &self.plan.settings;
        let every: Vec<usize> = (0..self.seen.signals.camera.nrows()).collect();
        let judged = if regression.is_trained() { training } else { &every };
        let (relative_rms, max_chromaticity_error) = residuals(&fitted.xyz_from_camera, &self.seen.signals, judged);
        Training {
            library: self.seen.name.clone(),
            samples: Some(training.clone()).filter(|samples| !samples.is_empty() && *samples != every),
            chosen_by: self.plan.chosen_by.clone(),
            held_out: self.fit.hold_out.clone(),
            count: fitted.count,
            weights: match weights {
                Weights::Equal => None,
                Weights::Relative => Some("relative".into()),
                Weights::Given(_) => Some("given".into()),
            },
            ridge: Some(*ridge).filter(|ridge| *ridge > 0.0),
            noise_weight: self.fit.noise_weight,
            white_sample: *kept,
            relative_rms,
            max_chromaticity_error,
        }
    }

    /// How the matrix does without noise on its own library; none where that has samples without light, or the matrix
    /// gives no white.
    fn performance(&self, fitted: &FittedMatrix) -> Result<Option<Performance>> {
        let settings = EvaluationSettings {
            patch: None,
            ..self.evaluation_settings(fitted.xyz_from_camera, self.seen.library.columns)
        };
        let samples = match evaluate(self.sensor, &self.seen.signals, &settings) {
            Ok(samples) => samples,
            Err(Error::Data(_) | Error::Usage(_) | Error::Advised { .. }) => return Ok(None),
            Err(error) => return Err(error),
        };
        Ok(noise_free(&samples).map(|differences| Performance {
            library: self.seen.name.clone(),
            samples: samples.len() as u64,
            white: self.white_in_words(),
            differences,
        }))
    }

    /// How a matrix is evaluated on a library with so many samples beside each other.
    pub(super) fn evaluation_settings(&self, xyz_from_camera: [[f64; 3]; 3], columns: usize) -> EvaluationSettings {
        EvaluationSettings {
            exposure: self.exposure,
            noise: self.fit.noise(),
            method: self.fit.demosaic,
            pattern: None,
            color: ColorSettings {
                is_relative: false,
                xyz_from_camera,
                method: None,
                residual: None,
                space: Space::Lab,
                white: self.fit.white.or_daylight(),
                white_luminance: self.fit.white.white_luminance,
            },
            patch: (!self.fit.noise_free).then_some(self.fit.patch),
            columns,
            dark_frames: self.fit.dark_frames,
        }
    }

    /// The white of L\*a\*b\*, in words.
    pub(super) fn white_in_words(&self) -> String {
        let name = match self.fit.white.or_daylight() {
            White::Absolute([x, y, z]) => return format!("XYZ {x} {y} {z}"),
            White::Chromaticity([x, y]) => format!("x {x}, y {y}"),
            White::D65 => "D65".into(),
            White::D50 => "D50".into(),
            White::EqualEnergy => "equal energy".into(),
        };
        match self.fit.white.white_luminance {
            Some(luminance) => format!("{name} of {luminance} cd/m2"),
            None => format!(
                "{name}, as bright as saturates the camera at the sample's exposure, by the sensor file's matrix"
            ),
        }
    }
}
