//! How well a matrix does: color differences of each sample of a library, without noise and through the noisy shot.

use super::{Signals, saturating};
use crate::camera::optics::Exposure;
use crate::camera::sensor::Sensor;
use crate::cfa::CfaPattern;
use crate::chain::{CameraSetup, CameraStages, uniform_frame};
use crate::color::difference::{Difference, DifferenceReport, Differences, delta_e_76};
use crate::color::{Space, White, lab_from_xyz, matrix};
use crate::error::{Error, Result};
use crate::metadata::{FrameHeader, Scene};
use crate::numerics::normal;
use crate::propagation::frame::{Predicted, Sites};
use crate::propagation::{Equations, FramePrediction, PixelMoments, Unpredictable};
use crate::stages::darks::{DarkFrames, LessDarks};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{PHASES, phase};
use crate::stages::noise::{AddNoise, NoiseSettings};
use crate::stages::to_xyz::{ColorSettings, ToXyz};
use crate::stream::{Counts, MemoryFrame, Stage, run};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// How each sample is exposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleExposure {
    /// All alike.
    Fixed(Exposure),
    /// Each so that its brightest class fills this share of full well, the rest as in `base`.
    Filled {
        /// What is not chosen.
        base: Exposure,
        /// Share of full well.
        fraction: f64,
        /// What is chosen.
        by: Filling,
    },
}

/// What is set to reach a share of full well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Filling {
    /// The exposure time.
    Time,
    /// The aperture.
    Aperture,
}

impl Filling {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "exposure time",
            Self::Aperture => "aperture",
        }
    }
}

impl SampleExposure {
    /// The exposure of a sample that gives `per_exposure` electrons per s sr in R, G, B.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] for a dark sample, or one that no aperture makes bright enough.
    pub fn of(self, per_exposure: [f64; 3], full_well_e: f64) -> Result<Exposure> {
        let (base, fraction, by) = match self {
            Self::Fixed(exposure) => return Ok(exposure),
            Self::Filled { base, fraction, by } => (base, fraction, by),
        };
        let brightest = per_exposure.into_iter().fold(0.0, f64::max);
        if !(brightest > 0.0 && brightest.is_finite()) {
            return Err(Error::Data("it is dark: no exposure reaches a fraction of full well".into()));
        }
        let wanted = fraction * full_well_e / brightest;
        match by {
            Filling::Time => Exposure { exposure_s: wanted / base.image_illumination_sr(), ..base }.checked(),
            Filling::Aperture => {
                // H = t π T / (4N² + 1), solved for N.
                let squared = (base.exposure_s * PI * base.lens_transmittance / wanted - 1.0) / 4.0;
                if squared.is_nan() || squared <= 0.0 {
                    return Err(Error::Data(format!(
                        "no aperture fills {fraction} of full well in {} s, which is too short",
                        base.exposure_s
                    ))
                    .change(&["exposure"]));
                }
                Exposure { f_number: squared.sqrt(), ..base }.checked()
            }
        }
    }
}

/// What is evaluated, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationSettings {
    /// How samples are exposed.
    pub exposure: SampleExposure,
    /// Noise.
    pub noise: NoiseSettings,
    /// Demosaicking method.
    pub method: Method,
    /// Pattern of the filter array, the sensor's own where none is given.
    pub pattern: Option<CfaPattern>,
    /// Matrix and white.
    pub color: ColorSettings,
    /// Pixels of each sample, columns and rows; none leaves noise out.
    pub patch: Option<[usize; 2]>,
    /// Samples beside each other on the sensor.
    pub columns: usize,
    /// Dark frames whose mean is subtracted; none where the black level is subtracted as a constant.
    pub dark_frames: u32,
}

/// One sample, evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleEvaluation {
    /// Its number in the library.
    pub sample: usize,
    /// Its exposure.
    pub exposure: Exposure,
    /// Expected signal electrons of R, G, B.
    pub electrons: [f64; 3],
    /// The white of L*a*b*, XYZ.
    pub white: [f64; 3],
    /// True XYZ.
    pub xyz: [f64; 3],
    /// XYZ that the camera gives without noise.
    pub camera_xyz: [f64; 3],
    /// Difference of the two.
    pub noise_free: Difference,
    /// What noise does.
    pub noise: Option<SampleNoise>,
}

/// What noise does to a sample: simulated, and predicted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleNoise {
    /// Difference between the mean color of the patch and the true one.
    pub patch_mean: Difference,
    /// Mean over the pixels of their differences from the true color.
    pub pixel_mean: Difference,
    /// Standard deviation of these differences over the pixels.
    pub pixel_std: Difference,
    /// Largest of these differences.
    pub pixel_max: Difference,
    /// Standard deviation of X, Y, Z over the pixels.
    pub xyz_std: [f64; 3],
    /// Standard deviation of L*, a*, b* over the pixels.
    pub lab_std: [f64; 3],
    /// Mean distance in L*a*b* of the pixels from the color that the camera gives without noise, ΔE*ab.
    pub noise_delta_e: f64,
    /// The same by formula; none where nothing is predicted.
    pub predicted: Option<PredictedNoise>,
    /// Photosites of the patch and its margins clipped at full well or at the last code.
    pub clipped: u64,
}

/// The noise of a sample by formula.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedNoise {
    /// Standard deviation of X, Y, Z over the pixels.
    pub xyz_std: [f64; 3],
    /// Standard deviation of L*, a*, b* over the pixels.
    pub lab_std: [f64; 3],
    /// Expected distance of a pixel from the color that the camera gives without noise, ΔE*ab.
    pub delta_e: f64,
    /// Standard deviation of that distance.
    pub delta_e_std: f64,
    /// Expected distance of the patch's mean color from that color.
    pub patch_delta_e: f64,
}

/// Evaluates every sample of a library, in parallel; the result does not depend on threads.
///
/// Each sample is a patch of a chart on the sensor, surrounded by as many photosites of its own light as demosaicking
/// reaches, so that all its pixels are whole: the chart that `render-radiance --patch` draws.
///
/// # Errors
///
/// Those of the stages, naming the sample.
pub fn evaluate(sensor: &Sensor, signals: &Signals, settings: &EvaluationSettings) -> Result<Vec<SampleEvaluation>> {
    (0..signals.camera.nrows())
        .into_par_iter()
        .map(|sample| Evaluator { sensor, signals, settings }.sample(sample).map_err(|error| of_sample(sample, error)))
        .collect()
}

/// Covariance of the camera signals of a demosaicked pixel of each sample at its exposure, in (ADU per s sr)², and the
/// white that L*a*b* refers to there.
///
/// # Errors
///
/// As [`evaluate`]; [`Error::Data`] where nothing is predicted.
pub fn pixel_covariances(
    sensor: &Sensor,
    signals: &Signals,
    settings: &EvaluationSettings,
    samples: &[usize],
) -> Result<Vec<(Matrix3<f64>, [f64; 3])>> {
    samples
        .par_iter()
        .map(|&sample| {
            let evaluator = Evaluator { sensor, signals, settings };
            let shot = evaluator.shot(sample, [8, 8]).map_err(|error| of_sample(sample, error))?;
            let mixture = pixels_of(shot.camera())
                .map_err(|why| Error::Data(format!("the noise of sample {sample} cannot be predicted: {why}")))?;
            let exposure_s_sr = shot.exposure.exposure_s_sr();
            Ok((mixture.covariance / exposure_s_sr.powi(2), shot.white()?))
        })
        .collect()
}

/// Signal electrons of R, G, B that a sample gives per s sr.
///
/// # Errors
///
/// [`Error::Data`] where they are negative or not finite; [`Error::MissingKey`] for a sensor of unknown read-out.
pub fn per_exposure(signals: &Signals, sample: usize, sensor: &Sensor) -> Result<[f64; 3]> {
    let row = signals.camera.row(sample);
    let adu_per_e = sensor.readout()?.adu_per_e;
    let electrons = [0, 1, 2].map(|class| row[class] / adu_per_e);
    if electrons.iter().all(|e| (0.0..f64::INFINITY).contains(e)) {
        return Ok(electrons);
    }
    Err(Error::Data("its radiance is negative or not finite".into()))
}

/// What is wrong with a sample, with its number.
pub fn of_sample(sample: usize, error: Error) -> Error {
    match error {
        Error::Data(problem) => Error::Data(format!("sample {sample}: {problem}")),
        Error::Advised { error, advice } => Error::Advised { error: Box::new(of_sample(sample, *error)), advice },
        other => other,
    }
}

struct Evaluator<'a> {
    sensor: &'a Sensor,
    signals: &'a Signals,
    settings: &'a EvaluationSettings,
}

/// The camera in front of one sample.
struct Shot {
    exposure: Exposure,
    electrons: [f64; 3],
    plane: FrameHeader,
    stages: CameraStages,
    xyz: ToXyz,
    lab: FrameHeader,
}

impl Shot {
    /// The head of the sensor RGB.
    fn camera(&self) -> &FrameHeader {
        self.stages.demosaic.header()
    }

    fn white(&self) -> Result<[f64; 3]> {
        let color = self.lab.metadata.color.as_ref();
        color.and_then(|color| color.white).ok_or_else(|| Error::Data("L*a*b* has no white".into()))
    }
}

impl Evaluator<'_> {
    /// Expected electrons of a sample, and what it is exposed to.
    fn exposed(&self, sample: usize) -> Result<(Exposure, [f64; 3])> {
        let per_exposure = per_exposure(self.signals, sample, self.sensor)?;
        let exposure = self.settings.exposure.of(per_exposure, self.sensor.readout()?.full_well_e)?;
        Ok((exposure, per_exposure.map(|e| e * exposure.exposure_s_sr())))
    }

    /// The camera in front of a patch of `size`, margins included.
    fn shot(&self, sample: usize, size: [usize; 2]) -> Result<Shot> {
        let (exposure, electrons) = self.exposed(sample)?;
        let settings = self.settings;
        let setup = CameraSetup {
            sensor: self.sensor.clone(),
            exposure,
            noise: settings.noise.clone(),
            pattern: settings.pattern,
            dark_frames: settings.dark_frames,
            method: settings.method,
        };
        let mut plane = setup.plane(size, Scene::uniform(format!("sample {sample}"), electrons))?;
        let place = [sample % settings.columns, sample / settings.columns];
        for axis in 0..2 {
            plane.geometry.origin[axis] = i32::try_from(place[axis] * size[axis])
                .map_err(|_| Error::Data("so many patches do not fit a sensor".into()))?;
        }
        let stages = setup.stages(&plane)?;
        let white_luminance = match (settings.color.white_luminance, settings.color.white) {
            (None, White::Absolute(_)) => None,
            (None, _) => saturating::luminance(self.sensor, stages.demosaic.header())?,
            (given, _) => given,
        };
        let made = |space| stages.to_xyz(&ColorSettings { space, white_luminance, ..settings.color.clone() });
        let (xyz, lab) = (made(Space::Xyz)?, made(Space::Lab)?.header().clone());
        Ok(Shot { exposure, electrons, plane, stages, xyz, lab })
    }

    fn sample(&self, sample: usize) -> Result<SampleEvaluation> {
        let margin = self.settings.method.reach();
        let patch = self.settings.patch.unwrap_or([1, 1]);
        let shot = self.shot(sample, patch.map(|pixels| pixels + 2 * margin))?;
        let white = shot.white()?;
        let (camera, truth) = (self.signals.camera.row(sample), self.signals.xyz.row(sample));
        let xyz = [truth[0], truth[1], truth[2]];
        let signal = Vector3::new(camera[0], camera[1], camera[2]);
        let camera_xyz: [f64; 3] = (matrix(&self.settings.color.xyz_from_camera) * signal).into();
        let lab = lab_from_xyz(xyz, white);
        let camera_lab = lab_from_xyz(camera_xyz, white);
        let noise = match self.settings.patch {
            Some(patch) => Some(self.noise(&shot, patch, margin, lab, camera_lab)?),
            None => None,
        };
        Ok(SampleEvaluation {
            sample,
            exposure: shot.exposure,
            electrons: shot.electrons,
            white,
            xyz,
            camera_xyz,
            noise_free: Difference::between(lab, camera_lab),
            noise,
        })
    }

    fn noise(
        &self,
        shot: &Shot,
        patch: [usize; 2],
        margin: usize,
        lab: [f64; 3],
        camera_lab: [f64; 3],
    ) -> Result<SampleNoise> {
        let white = shot.white()?;
        let (pixels, counts) = self.pixels(shot, patch, margin)?;
        let count = pixels.len() as f64;
        let mean = |of: &dyn Fn(&[f64; 3]) -> f64| pixels.iter().map(of).sum::<f64>() / count;
        let mean_xyz = [0, 1, 2].map(|i| mean(&|xyz| xyz[i]));
        let labs: Vec<[f64; 3]> = pixels.iter().map(|xyz| lab_from_xyz(*xyz, white)).collect();
        let differences: Vec<Difference> = labs.iter().map(|pixel| Difference::between(lab, *pixel)).collect();
        let (pixel_mean, pixel_std, pixel_max) = moments(&differences);
        let std = |values: &[[f64; 3]]| {
            [0, 1, 2].map(|i| {
                let mean = values.iter().map(|value| value[i]).sum::<f64>() / count;
                let squares: f64 = values.iter().map(|value| (value[i] - mean).powi(2)).sum();
                (squares / (count - 1.0).max(1.0)).sqrt()
            })
        };
        // A color without a prediction, such as one beyond the converter's range, has none in the report.
        let by_formula = pixels_of(shot.xyz.header()).and_then(|xyz| Ok((xyz, pixels_of(&shot.lab)?))).ok();
        let by_formula =
            by_formula.map(|(xyz, lab)| predicted(&xyz, &lab, [camera_lab, white], &shot.plane, patch, margin));
        Ok(SampleNoise {
            patch_mean: Difference::between(lab, lab_from_xyz(mean_xyz, white)),
            pixel_mean,
            pixel_std,
            pixel_max,
            xyz_std: std(&pixels),
            lab_std: std(&labs),
            noise_delta_e: labs.iter().map(|pixel| delta_e_76(camera_lab, *pixel)).sum::<f64>() / count,
            predicted: by_formula,
            // What fills a photosite mostly reaches the last code too.
            clipped: counts.full_well.max(counts.clipped_high),
        })
    }

    /// XYZ of the pixels within the margin.
    fn pixels(&self, shot: &Shot, patch: [usize; 2], margin: usize) -> Result<(Vec<[f64; 3]>, Counts)> {
        let (mut codes, mut counts) = self.codes(shot, shot.electrons, 0)?;
        let frames = 1..=self.settings.dark_frames;
        let darks = frames.map(|frame| self.codes(shot, [0.0; 3], frame).map(|(dark, _)| dark));
        if let Some((correct, mut darks)) =
            shot.stages.correct.as_ref().zip(DarkFrames::of(darks.collect::<Result<_>>()?)?)
        {
            let mut corrected = MemoryFrame::new(correct.header().clone(), Vec::new());
            counts =
                run(correct, &mut LessDarks::new(&mut codes, &mut darks), &mut corrected, &mut |_| ())?.plus(counts);
            codes = corrected;
        }
        let (rgb, more) = codes.through(&shot.stages.demosaic)?;
        let (xyz, and_more) = rgb.through(&shot.xyz)?;
        let geometry = &xyz.header.geometry;
        let at = |x: usize, y: usize, channel: usize| f64::from(xyz.samples[(y * 3 + channel) * geometry.width + x]);
        let inside = (margin..margin + patch[1]).flat_map(|y| (margin..margin + patch[0]).map(move |x| [x, y]));
        let pixels = inside.map(|[x, y]| [0, 1, 2].map(|channel| at(x, y, channel))).collect();
        Ok((pixels, counts.plus(more).plus(and_more)))
    }

    /// Codes of the patch's photosites in exposure number `frame` after the first.
    fn codes(&self, shot: &Shot, electrons: [f64; 3], frame: u32) -> Result<(MemoryFrame, Counts)> {
        let expected = uniform_frame(shot.plane.clone(), electrons)?;
        let (charge, full_well) = if frame == 0 {
            expected.through(&shot.stages.add_noise)?
        } else {
            let number = self.settings.noise.frame.wrapping_add(frame);
            expected.through(&AddNoise::new(
                &shot.plane,
                &NoiseSettings { frame: number, ..self.settings.noise.clone() },
            )?)?
        };
        let (codes, clipped) = charge.through(&shot.stages.digitize)?;
        Ok((codes, full_well.plus(clipped)))
    }
}

/// Mean, standard deviation (divisor n − 1) and maximum by each formula.
fn moments(differences: &[Difference]) -> (Difference, Difference, Difference) {
    let count = differences.len() as f64;
    let by = |of: &dyn Fn(&Difference) -> f64| {
        let mean = differences.iter().map(of).sum::<f64>() / count;
        let squares: f64 = differences.iter().map(|difference| (of(difference) - mean).powi(2)).sum();
        [mean, (squares / (count - 1.0).max(1.0)).sqrt(), differences.iter().map(of).fold(0.0, f64::max)]
    };
    let formulas = [by(&|d| d.delta_e_76), by(&|d| d.delta_e_94), by(&|d| d.delta_e_2000)];
    let moment = |which: usize| Difference {
        delta_e_76: formulas[0][which],
        delta_e_94: formulas[1][which],
        delta_e_2000: formulas[2][which],
    };
    (moment(0), moment(1), moment(2))
}

/// What is predicted of a frame of demosaicked pixels, or of colors: where that is void, to first order, beside which the
/// simulation stands.
fn pixels_of(head: &FrameHeader) -> Predicted<Box<PixelMoments>> {
    match Sites::of(head, Equations::Exact)?.frame(head)? {
        FramePrediction::Pixels(pixels) => Ok(pixels),
        FramePrediction::Planes(_) | FramePrediction::Groups(_) | FramePrediction::Tapped(_) => {
            Err(Unpredictable::Missing("demosaic"))
        }
    }
}

/// The noise of the patch by formula, each phase of the filter array counted as often as it occurs.
fn predicted(
    xyz: &PixelMoments,
    lab: &PixelMoments,
    [camera_lab, white]: [[f64; 3]; 2],
    plane: &FrameHeader,
    patch: [usize; 2],
    margin: usize,
) -> PredictedNoise {
    let corner = plane.geometry.origin.map(|first| i64::from(first) + margin as i64);
    let mut shares = [0.0; PHASES.len()];
    for y in 0..patch[1].min(2) {
        for x in 0..patch[0].min(2) {
            // Columns and rows of this parity.
            let times = (patch[0] - x).div_ceil(2) * (patch[1] - y).div_ceil(2);
            shares[phase(corner[0] + x as i64, corner[1] + y as i64)] += times as f64 / (patch[0] * patch[1]) as f64;
        }
    }
    let std = |mixture: &PixelMoments| {
        let covariances = mixture.phase_covariances();
        let variance =
            |i: usize| shares.iter().zip(&covariances).map(|(share, of_phase)| share * of_phase[(i, i)]).sum();
        [0, 1, 2].map(|i| f64::max(variance(i), 0.0).sqrt())
    };
    // Clipping and rounding move the mean, and so does the curvature of L*a*b*, but for the mean of XYZ.
    let from_camera = |mean: [f64; 3]| [0, 1, 2].map(|i| mean[i] - camera_lab[i]);
    let length = lab.noise_length(from_camera(lab.mean), shares);
    let offset = Vector3::from(from_camera(lab_from_xyz(xyz.mean, white)));
    let of_patch = lab.patch_mean_covariance(Some(phase(corner[0], corner[1])), patch);
    PredictedNoise {
        xyz_std: std(xyz),
        lab_std: std(lab),
        delta_e: length.mean,
        delta_e_std: length.std(),
        patch_delta_e: normal::length(&offset, &of_patch).mean,
    }
}

/// Differences of some samples, without noise.
pub fn noise_free<'a>(samples: impl IntoIterator<Item = &'a SampleEvaluation>) -> Option<DifferenceReport> {
    summary(samples.into_iter().map(|sample| Some(sample.noise_free)))
}

/// Differences of some samples as `of` gives them for their noise; none where one has none.
pub fn noisy<'a>(
    samples: impl IntoIterator<Item = &'a SampleEvaluation>,
    of: impl Fn(&SampleNoise) -> Difference,
) -> Option<DifferenceReport> {
    summary(samples.into_iter().map(|sample| sample.noise.as_ref().map(&of)))
}

fn summary(differences: impl Iterator<Item = Option<Difference>>) -> Option<DifferenceReport> {
    let all: Vec<Difference> = differences.collect::<Option<_>>()?;
    Differences::of(&all).report()
}
