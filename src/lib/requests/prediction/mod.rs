//! Predicting noise: from a scene, or a library of them, to noise budgets by formula.

mod doubts;
mod sweep;

pub use sweep::Sweep;

use super::conversion::{OF_SENSOR, doubt_of_white};
use super::described::either;
use super::notes::Note;
use super::options::{ExposureChoice, NoiseChoice, SignalLevel, SpectrumChoice, Subject, WhiteChoice, defaults};
use super::scene::{Scene, Uniform, own_xyz};
use super::values;
use crate::analysis::characterization::evaluation::{Filling, SampleExposure, of_sample, per_exposure};
use crate::analysis::characterization::{CameraMatrix, signals};
use crate::camera::optics::Exposure;
use crate::camera::sensor::Sensor;
use crate::cfa::{CfaPattern, Class};
use crate::chain::{
    CameraSetup, ChainPrediction, ChainStage, Predictor, PredictorSettings, StagePrediction, Uncertainty,
};
use crate::color::Space;
use crate::error::{Error, Result};
use crate::formats::{data, spectral};
use crate::metadata::{AdcRecord, Coverage, Metadata};
use crate::names::Named;
use crate::propagation::Equations;
use crate::spectrum::WavelengthGrid;
use crate::stages::demosaic::Method;
use crate::stages::to_xyz::ColorSettings;
use crate::units::QuantityKind;
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};
use sweep::uncertainty;

/// What is to be predicted, and how.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("input", |input| {
    input.help("Spectrum or library as CSV, or spectral image as EXR; `-` for standard input")
}))]
#[command(mut_arg("expose_to", |option| {
    option.help("Choose the exposure time that puts the brightest class at this fraction of full well")
}))]
#[command(mut_arg("electrons", |option| option.help("Expected electrons of R,G,B")))]
#[command(mut_arg("sample", |option| option.help("One spectrum of a library, counted from 0")))]
#[command(mut_arg("white", |option| option.requires("matrix")))]
#[command(mut_arg("white_luminance", |option| option.requires("matrix")))]
pub struct NoisePrediction {
    /// Light and sensor.
    #[command(flatten)]
    pub subject: Subject,
    /// Exposure time and lens.
    #[command(flatten)]
    pub exposure: ExposureChoice,
    /// How strong the signal is.
    #[command(flatten)]
    pub level: SignalLevel,
    /// Which spectrum of a file.
    #[command(flatten)]
    pub spectrum: SpectrumChoice,
    /// Noise sources and temperature.
    #[command(flatten)]
    pub noise: NoiseChoice,
    /// Demosaicking method: bi (bilinear), shti (smooth-hue), eci (effective-color), mhc (malvar)
    #[arg(long, default_value = Method::default().name(), value_parser = values::demosaicking())]
    pub method: Method,
    /// Pattern of the filter array, rggb, bggr, grbg or gbrg; by default the sensor's own
    #[arg(long, value_name = "PATTERN", value_parser = values::pattern)]
    pub cfa: Option<CfaPattern>,
    /// The same by its other name.
    #[arg(long, hide = true, value_name = "PATTERN", value_parser = values::pattern)]
    pub pattern: Option<CfaPattern>,
    /// Matrix file, as fit-matrix makes it, for XYZ and L*a*b*; `sensor` for that of the sensor itself, which to-xyz takes by
    /// default
    #[arg(long, value_name = "FILE|sensor")]
    pub matrix: Option<PathBuf>,
    /// The white of L\*a\*b\*.
    #[command(flatten)]
    pub white: WhiteChoice,
    /// Subtract the mean of so many dark frames rather than the black level
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub dark_frames: u32,
    /// Patch whose mean is predicted, in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub patch: Option<[usize; 2]>,
    /// Column and row of the patch's corner on the sensor; by default any, on average
    #[arg(long, value_name = "X,Y", value_parser = values::place, allow_hyphen_values = true, requires = "patch")]
    pub patch_at: Option<[i64; 2]>,
    /// Say how many pixels a square patch needs for this uncertainty of its mean, such as 0.5% or 0.1jnd
    #[arg(long, value_name = "PERCENT%|JNDjnd", value_parser = uncertainty)]
    pub uncertainty: Option<Uncertainty>,
    /// Levels of the brightest class to go through, in electrons, as CSV; append log or lin
    #[arg(long, value_name = "START:END:COUNT", value_parser = Sweep::parse)]
    pub sweep: Option<Sweep>,
    /// Predict every spectrum of a library, one row each as CSV; with --expose-to each at an exposure time of its own
    #[arg(long, conflicts_with_all = ["electrons", "dark", "column", "sample", "sweep"])]
    pub all_samples: bool,
    /// Equations to predict by: exact, or those of the paper
    #[arg(long, default_value = Equations::default().name(), value_parser = values::choice::<Equations>())]
    pub equations: Equations,
}

impl Default for NoisePrediction {
    /// The default sensor behind the paper's lens, at its exposure; the light is to be named.
    fn default() -> Self {
        defaults(&[])
    }
}

/// What a prediction was made for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conditions {
    /// Name of the sensor.
    pub sensor: String,
    /// Name of the setting of its read-out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setting: Option<String>,
    /// Exposure time and lens; of a library that of the samples which have none of their own.
    pub exposure_s: f64,
    /// Relative aperture.
    pub f_number: f64,
    /// Temperature of the sensor in K.
    pub temperature_k: f64,
    /// Demosaicking method.
    pub method: &'static str,
    /// Pattern of the filter array.
    pub pattern: CfaPattern,
    /// Equations.
    pub equations: Equations,
    /// Patch whose mean is predicted, in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patch: Option<[usize; 2]>,
    /// Of the expected electrons of R, G and B, relative; where a spectrum was summed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature_error: Option<[f64; 3]>,
    /// Absolute XYZ of the spectrum itself, Y in cd m⁻², which no matrix has come near; where one leads to absolute XYZ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_xyz: Option<[f64; 3]>,
    /// What standard deviations count.
    pub uncertainty: Coverage,
}

/// What is predicted of one sample of a library.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SamplePrediction {
    /// Its number.
    pub sample: usize,
    /// Its exposure.
    #[serde(flatten)]
    pub exposure: Exposure,
    /// Absolute XYZ of its spectrum itself, Y in cd m⁻²; where a matrix leads to absolute XYZ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_xyz: Option<[f64; 3]>,
    /// The prediction.
    #[serde(flatten)]
    pub prediction: ChainPrediction,
}

/// Noise budgets.
#[derive(Debug, Clone, PartialEq)]
pub enum Budgets {
    /// Of one scene.
    Scene(ChainPrediction),
    /// Of one scene at one level after another.
    Sweep(Vec<ChainPrediction>),
    /// Of the samples of a library.
    Samples(Vec<SamplePrediction>),
}

impl Budgets {
    fn scenes(&self) -> Vec<&ChainPrediction> {
        match self {
            Self::Scene(scene) => vec![scene],
            Self::Sweep(levels) => levels.iter().collect(),
            Self::Samples(samples) => samples.iter().map(|one| &one.prediction).collect(),
        }
    }
}

/// What was predicted.
#[derive(Debug)]
pub struct PredictedNoise {
    /// What for.
    pub conditions: Conditions,
    /// The budgets.
    pub budgets: Budgets,
    /// What came up.
    pub notes: Vec<Note>,
    /// The predictor and the electrons of the scene; none of a library.
    scene: Option<(Predictor, [f64; 3])>,
    sweep: Option<Sweep>,
}

/// Predictions of one level after another, to draw noise against signal.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferCurve {
    /// Name of the sensor.
    pub sensor: String,
    /// The brightest class, which the levels are those of.
    pub class: Class,
    /// Full well of the sensor.
    pub full_well_e: f64,
    /// The predictions.
    pub levels: Vec<ChainPrediction>,
}

impl NoisePrediction {
    /// Predicts.
    ///
    /// # Errors
    ///
    /// Those of readers, sensor and matrix files and of the predictor; [`Error::Usage`] where the request makes no sense.
    pub fn run(&self) -> Result<PredictedNoise> {
        let mut found = if self.all_samples { self.of_library()? } else { self.of_scene()? };
        found.notes.extend(match &found.budgets {
            Budgets::Scene(scene) => doubts::of_cut(scene),
            // It goes through full well.
            Budgets::Sweep(_) => None,
            Budgets::Samples(_) => doubts::of_cuts(&found.budgets.scenes()),
        });
        let first_order = found.budgets.scenes().into_iter().filter_map(|scene| scene.first_order);
        if let Some(void) = first_order.into_iter().find(|first_order| !first_order.holds) {
            found.notes.push(Note::Warning(format!(
                "green is {:.1} times its noise: smooth hue transition divides by it, and its noise cannot be propagated \
                 to first order",
                void.green_over_noise
            )));
        }
        let no_pixels = found.budgets.scenes().into_iter().find_map(|scene| scene.no_pixels.clone());
        if let Some(why) = no_pixels {
            let has_pixels = |stage: &StagePrediction| stage.stage == ChainStage::Demosaicked;
            let has_pixels = found.budgets.scenes().into_iter().any(|scene| scene.stages.iter().any(has_pixels));
            let what =
                if has_pixels { "of L*a*b* nothing is predicted" } else { "nothing is predicted from demosaicking on" };
            found.notes.push(Note::Warning(format!("{what}: {why}")));
        }
        let stages = found.budgets.scenes().into_iter().flat_map(|scene| &scene.stages);
        let void = stages.filter(|stage| stage.stage == ChainStage::Lab).find_map(|stage| stage.void);
        if let Some(why) = void {
            found.notes.push(Note::Warning(format!("what is predicted of L*a*b* is void: {why}")));
        }
        Ok(found)
    }

    /// One scene, or one after another level of it.
    fn of_scene(&self) -> Result<PredictedNoise> {
        let Uniform { sensor, exposure, electrons, quadrature_error, radiance, mut notes } = self.scene()?.uniform()?;
        if self.sweep.is_some() && electrons == [0.0; 3] {
            return Err(Error::Usage("a sweep scales the signal of a scene, but this one is dark".into()));
        }
        notes.extend(doubts::of_converter(sensor.readout()?));
        doubts::check_place(sensor.readout()?, self.patch, self.patch_at)?;
        let color = self.color(&sensor, &mut notes)?;
        let is_absolute = color.as_ref().is_some_and(|color| !color.is_relative) && self.sweep.is_none();
        let true_xyz = radiance.filter(|_| is_absolute).and_then(|radiance| {
            own_xyz(&radiance)
                .map_err(|why| notes.push(Note::Warning(format!("the XYZ of the spectrum itself are not told: {why}"))))
                .ok()
        });
        let conditions =
            Conditions { quadrature_error, true_xyz, ..self.conditions(&sensor, exposure, color.as_ref())? };
        let mut predictor = self.predictor(&sensor, exposure, color)?;
        let budgets = match self.sweep {
            Some(sweep) => Budgets::Sweep(predictions(&mut predictor, sweep.levels(), electrons)?),
            None => Budgets::Scene(predictor.predict(electrons)?),
        };
        Ok(PredictedNoise { conditions, budgets, notes, scene: Some((predictor, electrons)), sweep: self.sweep })
    }

    /// The scene as it would be rendered; for a sweep any that is not dark.
    fn scene(&self) -> Result<Scene> {
        let Self { subject, exposure, mut level, spectrum, .. } = self.clone();
        if subject.input.is_none() && level.given().is_none() {
            if self.sweep.is_none() {
                return Err(Error::Usage("give a spectrum, --electrons R,G,B, --dark or --sweep".into()));
            }
            level.electrons = Some([1.0; 3]);
        }
        Ok(Scene { subject, exposure, level, spectrum, ..Scene::default() })
    }

    /// Every sample of a library, each at its own exposure where one is to be chosen.
    fn of_library(&self) -> Result<PredictedNoise> {
        let Some(input) = &self.subject.input else {
            return Err(Error::Usage("--all-samples is for a library of spectra; name one".into()));
        };
        let (loaded, doubts) = self.subject.sensor.load()?;
        let (library, warnings) = spectral::read_library(input, self.spectrum.radiance_unit)?;
        let observer = data::load_observer()?;
        let signals = signals(&library, &loaded.sensor, loaded.response()?, &observer, &WavelengthGrid::default())?;
        let base = self.exposure.chosen()?;
        let exposing = match self.level.expose_to {
            Some(fraction) => SampleExposure::Filled { base, fraction, by: Filling::Time },
            None => SampleExposure::Fixed(base),
        };
        let mut notes: Vec<Note> =
            warnings.into_iter().map(Note::Warning).chain(doubts).chain(base.doubts().map(Note::Warning)).collect();
        notes.extend(doubts::of_converter(loaded.sensor.readout()?));
        doubts::check_place(loaded.sensor.readout()?, self.patch, self.patch_at)?;
        let color = self.color(&loaded.sensor, &mut notes)?;
        let one = |sample: usize| -> Result<SamplePrediction> {
            let per_exposure = per_exposure(&signals, sample, &loaded.sensor)?;
            let exposure = exposing.of(per_exposure, loaded.sensor.readout()?.full_well_e)?;
            let mut predictor = self.predictor(&loaded.sensor, exposure, color.clone())?;
            let prediction = predictor.predict(per_exposure.map(|e| e * exposure.exposure_s_sr()))?;
            let is_absolute = color.as_ref().is_some_and(|color| !color.is_relative);
            let true_xyz = is_absolute.then(|| std::array::from_fn(|i| signals.xyz[(sample, i)]));
            Ok(SamplePrediction { sample, exposure, true_xyz, prediction })
        };
        let found = (0..library.radiance.nrows())
            .into_par_iter()
            .map(|sample| one(sample).map_err(|error| of_sample(sample, error)));
        let budgets = Budgets::Samples(found.collect::<Result<_>>()?);
        Ok(PredictedNoise {
            conditions: self.conditions(&loaded.sensor, base, color.as_ref())?,
            budgets,
            notes,
            scene: None,
            sweep: None,
        })
    }

    fn conditions(&self, sensor: &Sensor, exposure: Exposure, color: Option<&ColorSettings>) -> Result<Conditions> {
        Ok(Conditions {
            sensor: sensor.name.clone(),
            setting: sensor.readout()?.setting.clone(),
            exposure_s: exposure.exposure_s,
            f_number: exposure.f_number,
            temperature_k: self.noise.temperature_k.unwrap_or(sensor.readout()?.temperature_k),
            method: self.method.name(),
            pattern: either(self.cfa, self.pattern)?.map_or_else(|| sensor.bayer(), Ok)?,
            equations: self.equations,
            patch: self.patch,
            quadrature_error: None,
            true_xyz: None,
            uncertainty: Coverage::noise_only(color.and_then(|color| color.residual.clone())),
        })
    }

    fn predictor(&self, sensor: &Sensor, exposure: Exposure, color: Option<ColorSettings>) -> Result<Predictor> {
        Predictor::new(PredictorSettings {
            camera: CameraSetup {
                sensor: sensor.clone(),
                exposure,
                noise: self.noise.settings(),
                pattern: either(self.cfa, self.pattern)?,
                dark_frames: self.dark_frames,
                method: self.method,
            },
            color,
            equations: self.equations,
            patch: self.patch,
            patch_at: self.patch_at,
            wanted: self.uncertainty,
        })
    }

    fn color(&self, sensor: &Sensor, notes: &mut Vec<Note>) -> Result<Option<ColorSettings>> {
        let Some(path) = &self.matrix else {
            return match self.uncertainty {
                Some(Uncertainty::Jnd(_)) => Err(Error::Usage(
                    "an uncertainty in jnd needs colors; give --matrix FILE, or --matrix sensor".into(),
                )),
                _ => Ok(None),
            };
        };
        self.white.check()?;
        let matrix = match (path == Path::new(OF_SENSOR), sensor.xyz_from_camera) {
            (true, Some(xyz_from_camera)) => CameraMatrix::of_sensor(sensor, xyz_from_camera),
            (true, None) => {
                let problem = format!("sensor {} has no matrix of its own; name a file of one", sensor.name);
                return Err(Error::Usage(problem).change(&["matrix"]));
            }
            (false, _) => data::load_matrix(path)?,
        };
        if let Some(of_matrix) = matrix.sensor.as_ref().filter(|name| **name != sensor.name) {
            let text = format!("{} was fitted for the sensor {of_matrix}, not {}", path.display(), sensor.name);
            notes.push(Note::Warning(text));
        }
        let doubts = matrix.doubt_of_sensor(sensor).into_iter().chain(matrix.doubts_of_codes(&codes_of(sensor)));
        notes.extend(doubts.map(|doubt| Note::Warning(format!("{} {doubt}", path.display()))));
        notes.extend(doubt_of_white(self.white.or_daylight(), matrix.is_relative()));
        Ok(Some(ColorSettings {
            is_relative: matrix.is_relative(),
            xyz_from_camera: matrix.xyz_from_camera,
            residual: matrix.residual(),
            method: matrix.method,
            space: Space::Xyz,
            white: self.white.or_daylight(),
            white_luminance: self.white.white_luminance,
        }))
    }
}

/// What the codes of a sensor are, for a matrix to judge: where they are not straight their range is another once they are.
fn codes_of(sensor: &Sensor) -> Metadata {
    let mut codes = Metadata::new(QuantityKind::Adu);
    if let Some(readout) = &sensor.readout {
        let adc = AdcRecord::of_readout(readout);
        codes.adc = Some(adc);
        codes.black_level_adu = Some(readout.bias_adu.into());
        codes.white_level_adu = (!adc.is_bent()).then(|| f64::from(adc.top_code()).into());
    }
    codes
}

/// Levels of a curve that are enough for its bends, but for that at full well.
const SMOOTH: usize = 60;
/// From where a curve is drawn whose first level is dark, e⁻.
const DIMMEST_E: f64 = 1.0;

impl PredictedNoise {
    /// The photon transfer curve of the brightest class, over the levels of the sweep, or up to full well, with more levels between: as many
    /// as a curve takes that has no chords, and near full well, where it bends, more of them.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a library, whose samples are no levels of one scene; those of the predictor.
    pub fn transfer_curve(&mut self) -> Result<TransferCurve> {
        let Some((predictor, electrons)) = &mut self.scene else {
            return Err(Error::Usage("a library has no photon transfer curve; choose one sample".into()));
        };
        let (full_well_e, sensor) = (predictor.sensor().readout()?.full_well_e, predictor.sensor().name.clone());
        let all = Sweep { start_e: 1.0, end_e: full_well_e, count: 200, is_logarithmic: true };
        let electrons = if *electrons == [0.0; 3] { [1.0; 3] } else { *electrons };
        let mut levels: Vec<f64> = self.sweep.unwrap_or(all).levels().collect();
        // No farther than the levels: to full well only where they reach it.
        let low = levels.iter().copied().fold(f64::INFINITY, f64::min);
        let high = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        levels.extend(near_full_well(full_well_e).filter(|level| (low..=high).contains(level)));
        let first = if low > 0.0 { low } else { DIMMEST_E.min(high) };
        if first < high && self.sweep.is_some() {
            let between = Sweep { start_e: first, end_e: high, count: SMOOTH, is_logarithmic: true };
            levels.extend(between.levels().filter(|level| (low..=high).contains(level)));
        }
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let levels = predictions(predictor, levels.into_iter(), electrons)?;
        let brightest = (0..3).max_by(|&a, &b| electrons[a].total_cmp(&electrons[b])).unwrap_or_default();
        Ok(TransferCurve { sensor, class: Class::ALL[brightest], full_well_e, levels })
    }
}

/// Levels so near to each other that the bend of a curve at full well is seen.
fn near_full_well(full_well_e: f64) -> impl Iterator<Item = f64> {
    const WITHIN: f64 = 0.2;
    const STEPS: u32 = 160;
    let part = |step: u32| 1.0 - WITHIN + 2.0 * WITHIN * f64::from(step) / f64::from(STEPS);
    (0..=STEPS).map(move |step| part(step) * full_well_e)
}

/// Predicts the scene at one level of its brightest class after another.
fn predictions(
    predictor: &mut Predictor,
    levels: impl Iterator<Item = f64>,
    electrons: [f64; 3],
) -> Result<Vec<ChainPrediction>> {
    let brightest = electrons.iter().copied().fold(0.0, f64::max);
    levels.map(|level| predictor.predict(electrons.map(|e| e / brightest * level))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(electrons: [f64; 3]) -> NoisePrediction {
        let level = SignalLevel { electrons: Some(electrons), ..SignalLevel::default() };
        NoisePrediction { level, ..NoisePrediction::default() }
    }

    #[test]
    fn a_scene_is_predicted_stage_by_stage() {
        let found = given([1000.0, 2000.0, 3000.0]).run().unwrap();
        let Budgets::Scene(scene) = &found.budgets else { panic!("{:?}", found.budgets) };
        let stages: Vec<&str> = scene.stages.iter().map(|stage| stage.stage.name()).collect();
        assert_eq!(stages, ["electrons", "adu", "demosaicked"]);
        let conditions = &found.conditions;
        assert_eq!((conditions.method, conditions.exposure_s, conditions.quadrature_error), ("eci", 0.033, None));
        assert_eq!(found.notes, []);
    }

    /// The XYZ of the spectrum itself: of a flat one the sums of the color matching functions [CIE15, 1931, 1 nm]. They hang on neither
    /// exposure nor matrix.
    #[test]
    fn a_spectrum_has_xyz_of_its_own() {
        let directory = tempfile::tempdir().unwrap();
        let flat: String = (360..=830).map(|nm| format!("{nm},0.001\n")).collect();
        let path = directory.path().join("flat.csv");
        std::fs::write(&path, format!("wavelength_nm,radiance W m-2 sr-1 nm-1\n{flat}")).unwrap();
        let mut wanted = NoisePrediction::default();
        let matrix = directory.path().join("m.yaml");
        let text = "schema: cyanometer-matrix/1\nunit: cd m-2 per (ADU s-1 sr-1)\n\
                    xyz_from_camera: [[2, 0, 0], [0, 3, 0], [0, 0, 4]]\n";
        std::fs::write(&matrix, text).unwrap();
        wanted.matrix = Some(matrix);
        wanted.subject.input = Some(path);
        for fraction in [0.2, 0.6] {
            wanted.level.expose_to = Some(fraction);
            let own = wanted.run().unwrap().conditions.true_xyz.unwrap();
            for (value, sum) in own.iter().zip([106.8655, 106.8569, 106.8922]) {
                // Sums are printed to seven digits.
                assert!((value / (0.683 * sum) - 1.0).abs() < 1e-6, "{value} {sum}");
            }
        }
        wanted.sweep = Some(Sweep { start_e: 10.0, end_e: 1000.0, count: 3, is_logarithmic: true });
        wanted.level.expose_to = None;
        assert_eq!(wanted.run().unwrap().conditions.true_xyz, None);
        wanted.sweep = None;
        wanted.matrix = None;
        assert_eq!(wanted.run().unwrap().conditions.true_xyz, None);
    }

    #[test]
    fn levels_scale_the_brightest_class() {
        let sweep = Some(Sweep { start_e: 10.0, end_e: 1000.0, count: 3, is_logarithmic: true });
        let mut found = NoisePrediction { sweep, ..given([1.0, 4.0, 2.0]) }.run().unwrap();
        let Budgets::Sweep(levels) = &found.budgets else { panic!("{:?}", found.budgets) };
        let electrons: Vec<[f64; 3]> = levels.iter().map(|level| level.electrons).collect();
        assert_eq!((electrons[0], electrons[2]), ([2.5, 10.0, 5.0], [250.0, 1000.0, 500.0]));
        let levels = levels.clone();
        let curve = found.transfer_curve().unwrap();
        assert_eq!(curve.class, Class::Green);
        assert!(levels.iter().all(|level| curve.levels.contains(level)));
    }

    #[test]
    fn a_curve_has_no_chords_where_full_well_bends_it() {
        let curve = NoisePrediction { sweep: None, ..given([1.0, 4.0, 2.0]) }.run().unwrap().transfer_curve().unwrap();
        let points: Vec<[f64; 2]> =
            curve.levels.iter().map(|level| [level.electrons[1], level.stages[0].std[1]]).collect();
        assert!(points.is_sorted_by(|a, b| a[0] < b[0]));
        // No step of more than a tenth of the largest noise: the drop at full well is several of its standard deviations wide.
        let highest = points.iter().map(|[_, std]| *std).fold(0.0, f64::max);
        assert!(points.windows(2).all(|pair| (pair[1][1] - pair[0][1]).abs() < 0.12 * highest));
    }

    /// Full well lies within the figure where the sweep reaches it, and nothing is drawn that was not asked for.
    #[test]
    fn a_curve_goes_no_farther_than_its_sweep() {
        for (start_e, end_e) in [(10.0, 1000.0), (1000.0, 10.0), (30_000.0, 50_000.0), (60_000.0, 90_000.0)] {
            let sweep = Some(Sweep { start_e, end_e, count: 5, is_logarithmic: true });
            let curve = NoisePrediction { sweep, ..given([1.0, 4.0, 2.0]) }.run().unwrap().transfer_curve().unwrap();
            let levels: Vec<f64> = curve.levels.iter().map(|level| level.electrons[1]).collect();
            let (low, high) = (f64::min(start_e, end_e), f64::max(start_e, end_e));
            assert_eq!((levels[0], *levels.last().unwrap()), (low, high));
            // More levels stand about full well.
            assert!(levels.len() > SMOOTH);
            assert_eq!(levels.len() > SMOOTH + 5, (low..=high).contains(&curve.full_well_e), "{low} to {high}");
        }
    }

    #[test]
    fn each_sample_of_a_library_has_an_exposure_of_its_own() {
        let library = concat!(env!("CARGO_MANIFEST_DIR"), "/sample_data/skies/kider2014.exr");
        let mut wanted = NoisePrediction { all_samples: true, ..NoisePrediction::default() };
        wanted.subject.input = Some(library.into());
        wanted.level.expose_to = Some(0.5);
        let mut found = wanted.run().unwrap();
        let Budgets::Samples(samples) = &found.budgets else { panic!("{:?}", found.budgets) };
        for (number, one) in samples.iter().enumerate() {
            let brightest = one.prediction.electrons.into_iter().fold(0.0, f64::max);
            assert_eq!(one.sample, number);
            assert!((brightest / 20_000.0 - 1.0).abs() < 1e-12, "{number}: {brightest}");
        }
        assert!(found.transfer_curve().is_err());
    }

    #[test]
    fn a_void_first_order_is_noted() {
        let found = NoisePrediction { method: Method::SmoothHue, ..given([1.0; 3]) }.run().unwrap();
        assert!(found.notes[0].text().starts_with("green is "), "{:?}", found.notes);
        assert!(NoisePrediction::default().run().is_err());
    }
}
