//! The work of `predict-noise`: from a request to a noise budget.

use super::Session;
use super::rendering;
use crate::analysis::characterization::evaluation::{Filling, SampleExposure, of_sample, per_exposure};
use crate::analysis::characterization::signals;
use crate::camera::optics::Exposure;
use crate::camera::sensor::Sensor;
use crate::cfa::{CfaPattern, Class};
use crate::chain::{Chain, ChainPrediction, ChainSettings, Uncertainty};
use crate::color::{Space, White};
use crate::error::{Error, Result};
use crate::formats::files::regular_file;
use crate::formats::plots::{PlotFormat, write_plot};
use crate::formats::{data, output, spectral};
use crate::plot::Plot;
use crate::propagation::Equations;
use crate::report::{self, ReportFormat, SamplePrediction};
use crate::spectrum::WavelengthGrid;
use crate::stages::demosaic::Method;
use crate::stages::noise::NoiseSettings;
use crate::stages::to_xyz::ColorSettings;
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What is to be predicted, and how.
#[derive(Debug, Clone)]
pub struct Request {
    /// Sensor, exposure and light.
    pub scene: rendering::Request,
    /// Noise sources and temperature.
    pub noise: NoiseSettings,
    /// Demosaicking method.
    pub method: Method,
    /// Pattern of the filter array.
    pub pattern: Option<CfaPattern>,
    /// Matrix file.
    pub matrix: Option<PathBuf>,
    /// White of L*a*b*.
    pub white: White,
    /// Its luminance.
    pub white_luminance: Option<f64>,
    /// Dark frames to subtract.
    pub dark_frames: u32,
    /// Equations.
    pub equations: Equations,
    /// Patch.
    pub patch: Option<[usize; 2]>,
    /// Its corner.
    pub patch_at: Option<[i64; 2]>,
    /// Wanted uncertainty.
    pub wanted: Option<Uncertainty>,
    /// Levels to go through.
    pub sweep: Option<Sweep>,
    /// Whether every sample of a library is predicted.
    pub all_samples: bool,
    /// File for the photon transfer curve.
    pub plot: Option<PathBuf>,
}

/// Levels of the brightest class, in electrons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    start_e: f64,
    end_e: f64,
    count: usize,
    is_logarithmic: bool,
}

impl Sweep {
    /// Reads `START:END:COUNT`, `COUNT` with `log` or `lin` behind it.
    ///
    /// # Errors
    ///
    /// What is expected, in words.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let wrong = || "give START:END:COUNTlog or START:END:COUNTlin in electrons, such as 10:40000:50log".to_owned();
        let [start, end, count] = text.split(':').collect::<Vec<_>>().try_into().map_err(|_| wrong())?;
        let number = |text: &str| text.parse().ok().filter(|e: &f64| e.is_finite() && *e >= 0.0).ok_or_else(wrong);
        let (start_e, end_e) = (number(start)?, number(end)?);
        let (count, is_logarithmic) = match (count.strip_suffix("log"), count.strip_suffix("lin")) {
            (Some(count), _) => (count, true),
            (_, Some(count)) => (count, false),
            _ => (count, false),
        };
        let count = count.parse().ok().filter(|count| (1..=100_000).contains(count)).ok_or_else(wrong)?;
        if is_logarithmic && !(start_e > 0.0 && end_e > 0.0) {
            return Err("a logarithmic sweep starts and ends above 0 electrons".into());
        }
        Ok(Self { start_e, end_e, count, is_logarithmic })
    }

    fn levels(self) -> impl Iterator<Item = f64> {
        let Self { start_e, end_e, count, is_logarithmic } = self;
        (0..count).map(move |i| {
            let share = if count == 1 { 0.0 } else { i as f64 / (count - 1) as f64 };
            match i {
                0 => start_e,
                _ if i == count - 1 => end_e,
                _ if is_logarithmic => start_e * (end_e / start_e).powf(share),
                _ => start_e + share * (end_e - start_e),
            }
        })
    }
}

/// Reads a wanted uncertainty: `0.5%` or `0.1jnd`.
///
/// # Errors
///
/// What is expected, in words.
pub fn uncertainty(text: &str) -> std::result::Result<Uncertainty, String> {
    let positive = |text: &str| text.trim().parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
    let relative = text.strip_suffix('%').and_then(positive).map(|percent| Uncertainty::Relative(percent / 100.0));
    let jnd = text.strip_suffix("jnd").and_then(positive).map(Uncertainty::Jnd);
    relative
        .or(jnd)
        .ok_or_else(|| "give per cent of the signal, such as 0.5%, or a colour difference, such as 0.1jnd".into())
}

/// What a prediction was made for.
#[derive(Debug, Clone, Serialize)]
struct About {
    sensor: String,
    exposure_s: f64,
    f_number: f64,
    temperature_k: f64,
    method: &'static str,
    pattern: CfaPattern,
    equations: Equations,
    #[serde(skip_serializing_if = "Option::is_none")]
    patch: Option<[usize; 2]>,
    /// Of the expected electrons of R, G and B, relative; where a spectrum was summed.
    #[serde(skip_serializing_if = "Option::is_none")]
    quadrature_error: Option<[f64; 3]>,
}

impl Request {
    /// Predicts, and writes the report.
    ///
    /// # Errors
    ///
    /// Those of readers, sensor and matrix files and of the chain.
    pub fn predict(&self, session: &Session, format: Option<ReportFormat>, path: Option<&Path>) -> Result<()> {
        if let Some(plot) = &self.plot {
            PlotFormat::of_path(plot)?;
        }
        let sensor = data::load_sensor(&self.scene.sensor)?.sensor;
        let own = data::sensor_files(&self.scene.sensor, &sensor);
        let inputs: Vec<&Path> =
            self.scene.input.iter().chain(&self.matrix).chain(&own).map(PathBuf::as_path).collect();
        output::check_outputs(&[path, self.plot.as_deref()], &inputs)?;
        let input = self.scene.input.as_deref().and_then(regular_file);
        if self.all_samples {
            let (about, found) = self.samples(session)?;
            self.warn(session, found.iter().map(|one| &one.prediction));
            let text = report::samples(&about, &found, format.unwrap_or(ReportFormat::Csv))?;
            return output::write_text(path, &text, input.as_ref());
        }
        let (mut chain, about, electrons) = self.chain(session)?;
        let text = match self.sweep {
            Some(sweep) => {
                let found = sweep_levels(&mut chain, sweep, electrons)?;
                self.warn(session, found.iter());
                report::sweep(&about, &found, format.unwrap_or(ReportFormat::Csv))?
            }
            None => {
                let found = chain.predict(electrons)?;
                self.warn(session, std::iter::once(&found));
                report::prediction(&about, &found, about.quadrature_error, format.unwrap_or(ReportFormat::Text))?
            }
        };
        if let Some(plot) = &self.plot {
            write_plot(plot, &self.curve(&mut chain, electrons)?, input.as_ref())?;
        }
        output::write_text(path, &text, input.as_ref())
    }

    /// The photon transfer curve of the brightest class, over the levels of the sweep, or up to full well.
    fn curve(&self, chain: &mut Chain, electrons: [f64; 3]) -> Result<Plot> {
        let sensor = chain.sensor();
        let (full_well_e, name) = (sensor.full_well_e, sensor.name.clone());
        let all = Sweep { start_e: 1.0, end_e: full_well_e, count: 200, is_logarithmic: true };
        let electrons = if electrons == [0.0; 3] { [1.0; 3] } else { electrons };
        let levels = sweep_levels(chain, self.sweep.unwrap_or(all), electrons)?;
        let brightest = (0..3).max_by(|&a, &b| electrons[a].total_cmp(&electrons[b])).unwrap_or_default();
        let title = format!("Photon transfer of {name}, class {}", Class::ALL[brightest].letter());
        Ok(report::photon_transfer(&levels, brightest, full_well_e, &title))
    }

    fn chain(&self, session: &Session) -> Result<(Chain, About, [f64; 3])> {
        if self.scene.input.is_none() && self.scene.electrons.is_none() && self.sweep.is_none() {
            return Err(Error::Usage("give a spectrum, --electrons R,G,B, --dark or --sweep".into()));
        }
        let mut scene = self.scene.clone();
        if scene.input.is_none() && scene.electrons.is_none() {
            scene.electrons = Some([1.0; 3]);
        }
        let rendering::Uniform { sensor, exposure, electrons, quadrature_error } = scene.uniform(session)?;
        if self.sweep.is_some() && electrons == [0.0; 3] {
            return Err(Error::Usage("a sweep scales the signal of a scene, but this one is dark".into()));
        }
        let color = self.color(session, &sensor)?;
        let about = About { quadrature_error, ..self.about(&sensor, exposure) };
        Ok((self.settled(&sensor, exposure, color)?, about, electrons))
    }

    /// Every sample of a library, each at its own exposure where one is to be chosen.
    fn samples(&self, session: &Session) -> Result<(About, Vec<SamplePrediction>)> {
        let Some(input) = &self.scene.input else {
            return Err(Error::Usage("--all-samples is for a library of spectra; name one".into()));
        };
        let loaded = data::load_sensor(&self.scene.sensor)?;
        let library = spectral::read_library(input, self.scene.radiance_unit)?;
        let observer = data::load_observer()?;
        let signals = signals(&library, &loaded.sensor, &loaded.response, &observer, &WavelengthGrid::default())?;
        let base = Exposure {
            exposure_s: self.scene.exposure_s,
            f_number: self.scene.f_number,
            lens_transmittance: self.scene.lens_transmittance,
        }
        .checked()?;
        let exposing = match self.scene.expose_to {
            Some(fraction) => SampleExposure::Filled { base, fraction, by: Filling::Time },
            None => SampleExposure::Fixed(base),
        };
        let color = self.color(session, &loaded.sensor)?;
        let one = |sample: usize| -> Result<SamplePrediction> {
            let per_exposure = per_exposure(&signals, sample, &loaded.sensor)?;
            let exposure = exposing.of(per_exposure, loaded.sensor.full_well_e)?;
            let mut chain = self.settled(&loaded.sensor, exposure, color.clone())?;
            let prediction = chain.predict(per_exposure.map(|e| e * exposure.exposure_s_sr()))?;
            Ok(SamplePrediction { sample, exposure, prediction })
        };
        let found = (0..library.radiance.nrows())
            .into_par_iter()
            .map(|sample| one(sample).map_err(|error| of_sample(sample, error)));
        Ok((self.about(&loaded.sensor, base), found.collect::<Result<_>>()?))
    }

    fn about(&self, sensor: &Sensor, exposure: Exposure) -> About {
        About {
            sensor: sensor.name.clone(),
            exposure_s: exposure.exposure_s,
            f_number: exposure.f_number,
            temperature_k: self.noise.temperature_k.unwrap_or(sensor.temperature_k),
            method: self.method.names()[0],
            pattern: self.pattern.unwrap_or(sensor.cfa),
            equations: self.equations,
            patch: self.patch,
            quadrature_error: None,
        }
    }

    fn settled(&self, sensor: &Sensor, exposure: Exposure, color: Option<ColorSettings>) -> Result<Chain> {
        Chain::new(ChainSettings {
            sensor: sensor.clone(),
            exposure,
            noise: self.noise.clone(),
            method: self.method,
            pattern: self.pattern,
            color,
            dark_frames: self.dark_frames,
            equations: self.equations,
            patch: self.patch,
            patch_at: self.patch_at,
            wanted: self.wanted,
        })
    }

    fn color(&self, session: &Session, sensor: &Sensor) -> Result<Option<ColorSettings>> {
        let Some(path) = &self.matrix else {
            return match self.wanted {
                Some(Uncertainty::Jnd(_)) => {
                    Err(Error::Usage("an uncertainty in jnd needs colours; give --matrix FILE".into()))
                }
                _ => Ok(None),
            };
        };
        let matrix = data::load_matrix(path)?;
        if let Some(of_matrix) = matrix.sensor.as_ref().filter(|name| **name != sensor.name) {
            session.warn(&format!("{} was fitted for the sensor {of_matrix}, not {}", path.display(), sensor.name));
        }
        Ok(Some(ColorSettings {
            xyz_from_camera: matrix.xyz_from_camera,
            method: matrix.method,
            space: Space::Xyz,
            white: self.white,
            white_luminance: self.white_luminance,
        }))
    }

    /// Says where the first order is void.
    fn warn<'a>(&self, session: &Session, mut found: impl Iterator<Item = &'a ChainPrediction>) {
        let void = found.find_map(|scene| scene.first_order.filter(|first_order| !first_order.holds));
        if let Some(first_order) = void {
            session.warn(&format!(
                "green is {:.1} times its noise: smooth hue transition divides by it, and its noise cannot be propagated \
                 to first order",
                first_order.green_over_noise
            ));
        }
    }
}

/// Predicts the scene at one level of its brightest class after another.
fn sweep_levels(chain: &mut Chain, sweep: Sweep, electrons: [f64; 3]) -> Result<Vec<ChainPrediction>> {
    let brightest = electrons.iter().copied().fold(0.0, f64::max);
    sweep.levels().map(|level| chain.predict(electrons.map(|e| e / brightest * level))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_start_and_end_where_they_say() {
        let sweep = Sweep::parse("10:40000:50log").unwrap();
        let levels: Vec<f64> = sweep.levels().collect();
        assert_eq!((levels.len(), levels[0], levels[49]), (50, 10.0, 40_000.0));
        assert!((levels[1] / levels[0] - 4000.0_f64.powf(1.0 / 49.0)).abs() < 1e-12);
        assert_eq!(Sweep::parse("0:10:3").unwrap().levels().collect::<Vec<_>>(), [0.0, 5.0, 10.0]);
        for wrong in ["10:40000", "0:10:3log", "a:b:c", "1:2:0log", "-1:2:3lin"] {
            assert!(Sweep::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn uncertainties_are_in_per_cent_or_jnd() {
        assert_eq!(uncertainty("0.5%"), Ok(Uncertainty::Relative(0.005)));
        assert_eq!(uncertainty("0.1jnd"), Ok(Uncertainty::Jnd(0.1)));
        assert!(uncertainty("0.1").is_err() && uncertainty("-1%").is_err());
    }
}
