//! The whole noise budget of a uniform scene, stage by stage, by formula alone.
//!
//! The heads of the frames that the programs would pass on are made by the stages themselves; only no sample is. So what
//! is predicted here is what `measure` compares such frames with.

use super::camera::CameraSetup;
use super::causes::{Causes, fixed_of};
use super::patches::PatchMeans;
use super::predicted::{CauseVariance, ChainPrediction, ChainStage, NoiseDeltaE, PhaseCovariance, StagePrediction};
use crate::camera::sensor::Sensor;
use crate::cfa::Class;
use crate::color::Space;
use crate::color::difference::DELTA_E_PER_JND;
use crate::error::{Error, Result};
use crate::metadata::{CorrectionRecord, FrameHeader, Scene};
use crate::names::Named;
use crate::numerics::normal::{self, MeanVariance};
use crate::propagation::budget::{Budget, Cause};
use crate::propagation::frame::{Predicted, Sites, Unpredictable};
use crate::propagation::gains;
use crate::propagation::ground::{has_tails, quantity_of_sites};
use crate::propagation::saturation;
use crate::propagation::smooth_hue::FirstOrder;
use crate::propagation::taps::pooled;
use crate::propagation::{Equations, FramePrediction, SiteCovariance, of_frame};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::PHASES;
use crate::stages::to_xyz::ColorSettings;
use crate::stream::Stage;
use crate::units::QuantityKind;
use nalgebra::{Matrix3, Vector3};

/// What a prediction follows.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictorSettings {
    /// The camera.
    pub camera: CameraSetup,
    /// Matrix and white; XYZ and L*a*b* are predicted where there is one.
    pub color: Option<ColorSettings>,
    /// Equations to predict by.
    pub equations: Equations,
    /// Patch whose mean is predicted, columns and rows.
    pub patch: Option<[usize; 2]>,
    /// Column and row of the patch's corner on the sensor; any where none is given.
    pub patch_at: Option<[i64; 2]>,
    /// The uncertainty that a mean shall have.
    pub wanted: Option<Uncertainty>,
}

impl PredictorSettings {
    /// The exact noise of a camera, without colors.
    pub fn of(camera: CameraSetup) -> Self {
        let equations = Equations::Exact;
        Self { camera, color: None, equations, patch: None, patch_at: None, wanted: None }
    }
}

/// A wanted uncertainty of a mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Uncertainty {
    /// Standard deviation over mean signal.
    Relative(f64),
    /// Expected color difference, in just noticeable differences of 2.3 ΔE*ab.
    Jnd(f64),
}

/// The stages of the chain, ready to predict one scene after another.
///
/// # Examples
///
/// ```
/// use cyanometer::camera::optics::Exposure;
/// use cyanometer::chain::{CameraSetup, ChainStage, Predictor, PredictorSettings};
/// use cyanometer::formats::data::load_sensor;
/// use cyanometer::stages::demosaic::Method;
///
/// let exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };
/// let camera = CameraSetup::new(load_sensor("kaf-5101ce")?.sensor, exposure);
/// let camera = CameraSetup { method: Method::Bilinear, ..camera };
/// let mut predictor = Predictor::new(PredictorSettings::of(camera))?;
/// let stages = predictor.predict([10_000.0; 3])?.stages;
/// let variance = |wanted| stages.iter().find(|stage| stage.stage == wanted).map(|stage| stage.covariance[0][0]);
/// // Red is measured at a quarter of the pixels and else the mean of two neighbors, of two, and of four:
/// // (1 + ½ + ½ + ¼)/4 of the variance of a photosite.
/// let ratio = variance(ChainStage::Demosaicked).zip(variance(ChainStage::Adu)).map(|(pixel, photosite)| pixel / photosite);
/// assert!((ratio.unwrap() - 9.0 / 16.0).abs() < 1e-12);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Predictor {
    settings: PredictorSettings,
    heads: Vec<(ChainStage, FrameHeader)>,
}

/// The share of saturated samples from which a signal has no ratio to its noise: what is left of the noise says nothing of
/// the light.
const SATURATED: f64 = 1e-3;

/// What photosites are: their quantity, how they were corrected, and whether their columns have smear of a plane.
type Plane = (QuantityKind, Option<CorrectionRecord>, bool);

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)]))
}

fn diagonal_std(covariance: &Matrix3<f64>) -> [f64; 3] {
    [0, 1, 2].map(|i| covariance[(i, i)].max(0.0).sqrt())
}

impl Predictor {
    /// Sets the chain up.
    ///
    /// # Errors
    ///
    /// Those of the stages.
    pub fn new(settings: PredictorSettings) -> Result<Self> {
        let camera = &settings.camera;
        if settings.equations == Equations::Paper && camera.method == Method::Malvar {
            return Err(Error::Usage("the paper has no equations for the method mhc; choose bi, shti or eci".into()));
        }
        let readout = camera.sensor.readout()?;
        let size = [readout.width as usize, readout.height as usize];
        let expected =
            FrameHeader { name: "the prediction".into(), ..camera.planes(size, Scene::uniform("formula", [0.0; 3])) };
        let stages = camera.stages(&expected)?;
        let of_sites = [
            Some((ChainStage::Electrons, stages.add_noise.header())),
            Some((ChainStage::Adu, stages.digitize.header())),
            stages.correct.as_ref().map(|correct| (ChainStage::DarkSubtracted, correct.header())),
        ];
        let of_sites = of_sites.into_iter().flatten().map(|(stage, head)| Ok((stage, camera.behind_array(head)?)));
        let mut heads = of_sites.collect::<Result<Vec<_>>>()?;
        heads.push((ChainStage::Demosaicked, stages.demosaic.header().clone()));
        if let Some(color) = &settings.color {
            for (stage, space) in [(ChainStage::Xyz, Space::Xyz), (ChainStage::Lab, Space::Lab)] {
                heads.push((stage, stages.to_xyz(&ColorSettings { space, ..color.clone() })?.header().clone()));
            }
        }
        Ok(Self { settings, heads })
    }

    /// The sensor.
    pub fn sensor(&self) -> &Sensor {
        &self.settings.camera.sensor
    }

    /// The heads of the frames of each stage.
    pub fn heads(&self) -> impl Iterator<Item = (ChainStage, &FrameHeader)> {
        self.heads.iter().map(|(stage, head)| (*stage, head))
    }

    /// Has all frames expect so many signal electrons of R, G and B, and refuses what no formula tells before anything is worked out.
    fn light(&mut self, electrons: [f64; 3]) -> Result<()> {
        for (_, head) in &mut self.heads {
            if let Some(scene) = &mut head.metadata.scene {
                scene.expected_electrons = Some(electrons);
            }
        }
        let equations = self.settings.equations;
        let of_sites = || self.heads().filter(|(_, head)| head.metadata.demosaic.is_none() && head.taps().is_none());
        let mut checks = of_sites().map(|(stage, head)| (stage, Sites::check(head, equations)));
        checks.try_for_each(|(stage, check)| check.map_err(|why| refused(stage, electrons, why)))?;
        // Photosites that are unlike each other may take too long in codes, where their electrons do not; what is found is remembered.
        let are_codes = |head: &FrameHeader| quantity_of_sites(head) == QuantityKind::Adu && has_tails(head);
        let mut codes = of_sites().filter(|(_, head)| are_codes(head));
        codes.try_for_each(|(stage, head)| {
            Sites::of(head, equations).map(drop).map_err(|why| refused(stage, electrons, why))
        })
    }

    /// Predicts the scene that expects so many signal electrons of R, G and B.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] for electrons that no chain can have.
    pub fn predict(&mut self, electrons: [f64; 3]) -> Result<ChainPrediction> {
        let mut stages = Vec::new();
        let mut noise_delta_e = None;
        let mut first_order = None;
        let mut no_pixels = None;
        // Photosites are the same from the converter, or the subtraction of dark frames, on.
        let mut known: Option<(Plane, Sites, [Budget; 3])> = None;
        let has_smear = self.sensor().readout.as_ref().is_some_and(|readout| readout.smear_line_s > 0.0);
        self.light(electrons)?;
        for (stage, head) in &self.heads {
            let none = |why| refused(*stage, electrons, why);
            let is_pixels = head.metadata.demosaic.is_some();
            if head.taps().is_some() {
                match self.settings.of_taps(head) {
                    Ok((prediction, causes)) => {
                        if let (FramePrediction::Tapped(pixels), ChainStage::Lab) = (&prediction, *stage) {
                            let patches = self.settings.patches(head, &prediction, &pixels.covariance).map_err(none)?;
                            noise_delta_e = Some(self.settings.delta_e(pixels.noise_length(), &patches));
                        }
                        if let (FramePrediction::Tapped(pixels), ChainStage::Demosaicked) = (&prediction, *stage) {
                            first_order = pixels.of_hue;
                        }
                        stages.push(self.settings.stage(*stage, head, &prediction, &causes).map_err(none)?);
                    }
                    Err(why) if is_pixels => no_pixels = Some(why.to_string()),
                    Err(why) => return Err(none(why)),
                }
                continue;
            }
            let is_plane = head.metadata.cfa.is_some() || head.metadata.demosaic.is_some();
            let plane = (quantity_of_sites(head), head.metadata.correction.clone(), is_plane && has_smear);
            let (sites, causes) = match known.take().filter(|(of, ..)| *of == plane) {
                Some((_, sites, causes)) => (sites, causes),
                None => {
                    let sites = Sites::of(head, self.settings.equations).map_err(none)?;
                    // One class after the other: of those after one that is not predicted nothing is worked out.
                    let of_class = |e: f64| sites.photosite.causes(e).map_err(none);
                    let [r, g, b] = sites.expected_e;
                    let causes = [of_class(r)?, of_class(g)?, of_class(b)?];
                    (sites, causes)
                }
            };
            let prediction = sites.frame(head).map_err(none)?;
            match &prediction {
                FramePrediction::Pixels(mixture) if *stage == ChainStage::Lab => {
                    let length = match self.settings.equations {
                        Equations::Exact => {
                            mixture.noise_length(mixture.bias, [1.0 / PHASES.len() as f64; PHASES.len()])
                        }
                        Equations::Paper => normal::length(&Vector3::from(mixture.bias), &mixture.covariance),
                    };
                    let patches = self.settings.patches(head, &prediction, &mixture.covariance).map_err(none)?;
                    noise_delta_e = Some(self.settings.delta_e(length, &patches));
                }
                FramePrediction::Pixels(mixture) if *stage == ChainStage::Demosaicked => {
                    let variances = mixture.sites.map(|site| site.moments.variance);
                    first_order = (self.settings.camera.method == Method::SmoothHue)
                        .then(|| FirstOrder::of(mixture.mean, variances));
                }
                _ => {}
            }
            let of_stage = Causes::of(&sites, head, &prediction, causes).map_err(none)?;
            stages.push(self.settings.stage(*stage, head, &prediction, &of_stage).map_err(none)?);
            known = Some((plane, sites, causes));
        }
        Ok(ChainPrediction { electrons, stages, noise_delta_e, first_order, no_pixels })
    }
}

/// Says that nothing is predicted of a stage.
fn refused(stage: ChainStage, electrons: [f64; 3], why: Unpredictable) -> Error {
    Error::Data(format!("nothing can be predicted of {} at {electrons:?} electrons: {why}", stage.name()))
}

impl PredictorSettings {
    /// A frame that several amplifiers read, and the variances of its photosites by cause: of photosites means over all of a class, of
    /// pixels those behind each.
    fn of_taps(&self, head: &FrameHeader) -> Predicted<(FramePrediction, Causes)> {
        let prediction = of_frame(head, self.equations)?;
        let (mut budgets, mut counts, mut means) = (Vec::new(), Vec::new(), Vec::new());
        let all = Sites::of_taps(head, self.equations)?;
        for (tap, of_tap, sites) in &all {
            let of_class = |e: f64| sites.photosite.causes(e);
            let [r, g, b] = sites.expected_e;
            let causes = [of_class(r)?, of_class(g)?, of_class(b)?];
            let is_curved = head.metadata.quantity == QuantityKind::Lab;
            means.push((*tap, sites.means_over_exposures(fixed_of(&causes), is_curved)?.moments));
            budgets.push((*tap, causes));
            counts.push(*of_tap);
        }
        let FramePrediction::Groups(whole) = &prediction else {
            return Ok((prediction, Causes::Taps(budgets, Box::new(Sites::over_exposures(&all, &means)?))));
        };
        let mut causes = [[0.0; Cause::ALL.len()]; 3];
        for (k, causes) in causes.iter_mut().enumerate() {
            let n: f64 = counts.iter().map(|counts| counts[k]).sum();
            for (counts, (_, budgets)) in counts.iter().zip(&budgets) {
                causes.iter_mut().zip(budgets[k]).for_each(|(sum, variance)| *sum += counts[k] * variance / n);
            }
        }
        for (causes, class) in causes.iter_mut().zip(pooled(&whole.groups)) {
            causes[Cause::Taps as usize] = class.moments.variance - causes.iter().sum::<f64>();
        }
        Ok((prediction, Causes::Classes(Box::new(causes))))
    }

    fn stage(
        &self,
        stage: ChainStage,
        head: &FrameHeader,
        prediction: &FramePrediction,
        causes: &Causes,
    ) -> Predicted<StagePrediction> {
        let metadata = &head.metadata;
        let (mean, covariance) = self.mean_and_covariance(prediction, metadata.quantity == QuantityKind::Lab);
        let second_order = match prediction {
            FramePrediction::Pixels(mixture) if self.camera.method == Method::SmoothHue => {
                Some(rows(&mixture.covariance))
            }
            FramePrediction::Tapped(pixels) if self.camera.method == Method::SmoothHue => {
                Some(rows(&pixels.covariance))
            }
            _ => None,
        };
        let by_cause = self.by_cause(prediction, causes, &covariance);
        let part = |fixed: bool| spread_of(&by_cause, fixed);
        let std = diagonal_std(&covariance);
        let black = match metadata.quantity {
            QuantityKind::Electrons => metadata.dark_signal_e.unwrap_or(0.0),
            // The converter gives all photosites the same.
            QuantityKind::Adu => metadata.uniform_black_adu().unwrap_or(0.0),
            _ => 0.0,
        };
        let signal = mean.map(|mean| mean - black);
        let saturated = saturation::expected(head);
        let is_signal = metadata.quantity != QuantityKind::Lab;
        let patches = self.patches(head, prediction, &covariance)?;
        let certain_enough = |wanted: f64, i: usize, side: usize| {
            let variance = patches.anywhere([side; 2])[(i, i)];
            variance.max(0.0).sqrt() <= wanted * signal[i]
        };
        let pixels_needed = match self.wanted {
            Some(Uncertainty::Relative(wanted)) if is_signal => Some([0, 1, 2].map(|i| {
                let is_lit = signal[i] > 0.0;
                is_lit.then(|| smallest_square(|side| certain_enough(wanted, i, side))).flatten()
            })),
            _ => None,
        };
        Ok(StagePrediction {
            stage,
            unit: metadata.unit.clone(),
            channels: match metadata.cfa {
                Some(_) => Class::ALL.map(|class| class.letter().to_owned()).to_vec(),
                None => (0..3).map(|index| head.channel_name(index).to_owned()).collect(),
            },
            void: match prediction {
                FramePrediction::Pixels(mixture) => mixture.void,
                FramePrediction::Planes(_) | FramePrediction::Groups(_) | FramePrediction::Tapped(_) => None,
            },
            mean,
            bias: match prediction {
                FramePrediction::Pixels(mixture) if mixture.bias != [0.0; 3] => Some(mixture.bias),
                FramePrediction::Tapped(pixels) if pixels.bias != [0.0; 3] => Some(pixels.bias),
                _ => None,
            },
            std,
            temporal_std: part(false),
            fixed_pattern_std: part(true),
            snr_db: if is_signal { snr_db(signal, std, saturated) } else { [None; 3] },
            saturated,
            covariance: rows(&covariance),
            second_order_covariance: second_order.filter(|_| self.equations == Equations::Exact),
            phases: self.phases(prediction),
            causes: by_cause,
            patch_mean_std: patches.asked.as_ref().map(diagonal_std),
            patch_mean_covariance: patches.asked.as_ref().map(rows),
            pixels_needed,
        })
    }

    /// Mean and covariance of a pixel, by the exact equations to first order unless the stage is curved.
    fn mean_and_covariance(&self, prediction: &FramePrediction, is_curved: bool) -> ([f64; 3], Matrix3<f64>) {
        match prediction {
            FramePrediction::Planes(classes) => {
                let sites = SiteCovariance::of(classes);
                (classes.map(|class| class.moments.mean), sites.own_of_planes() + sites.row + sites.column)
            }
            FramePrediction::Groups(sites) => {
                (pooled(&sites.groups).map(|class| class.moments.mean), sites.covariance())
            }
            FramePrediction::Pixels(mixture) if self.equations == Equations::Paper => {
                (mixture.mean, mixture.covariance)
            }
            FramePrediction::Pixels(mixture) => {
                let first_order = || gains::mean_pixel_covariance(&mixture.weights, &mixture.site_covariance());
                (mixture.mean, if is_curved { mixture.covariance } else { first_order() })
            }
            FramePrediction::Tapped(pixels) if pixels.of_hue.is_some() && !is_curved => {
                (pixels.mean, pixels.first_order() + pixels.between())
            }
            FramePrediction::Tapped(pixels) => (pixels.mean, pixels.covariance),
        }
    }

    /// Variance by cause; none of causes that the sensor does not know.
    fn by_cause(&self, prediction: &FramePrediction, causes: &Causes, covariance: &Matrix3<f64>) -> Vec<CauseVariance> {
        let mut found = causes.of_stage(prediction, covariance, self.equations);
        let readout = self.camera.sensor.readout();
        let is_known = |cause: Cause| readout.as_ref().is_ok_and(|readout| cause.optional(readout) != Some(0.0));
        found.retain(|entry| is_known(entry.cause));
        found
    }

    fn phases(&self, prediction: &FramePrediction) -> Vec<PhaseCovariance> {
        let FramePrediction::Pixels(mixture) = prediction else { return Vec::new() };
        if self.equations == Equations::Paper {
            return Vec::new();
        }
        let sites = mixture.site_covariance();
        let entry = |(phase, [column, row]): (usize, [isize; 2])| PhaseCovariance {
            column,
            row,
            class: mixture.weights.class(phase, [0, 0]).letter(),
            covariance: rows(&gains::pixel_covariance(&mixture.weights, phase, &sites)),
        };
        PHASES.into_iter().enumerate().map(entry).collect()
    }

    fn patches<'a>(
        &self,
        head: &FrameHeader,
        prediction: &'a FramePrediction,
        covariance: &'a Matrix3<f64>,
    ) -> Predicted<PatchMeans<'a>> {
        PatchMeans::of(head, (prediction, covariance), self.equations, self.patch, self.patch_at)
    }

    /// The color difference that noise makes in L*a*b*, `found` of a pixel.
    fn delta_e(&self, found: MeanVariance, patches: &PatchMeans<'_>) -> NoiseDeltaE {
        // The mean of a patch is taken of XYZ, so that the curvature of L*a*b* does not bias it.
        let length = |covariance: &Matrix3<f64>| normal::length(&Vector3::zeros(), covariance).mean;
        let of_patch = |size: [usize; 2]| length(&patches.anywhere(size));
        let pixels_needed = match self.wanted {
            Some(Uncertainty::Jnd(wanted)) => smallest_square(|side| of_patch([side; 2]) <= wanted * DELTA_E_PER_JND),
            _ => None,
        };
        NoiseDeltaE {
            mean: found.mean,
            std: found.std(),
            jnd: found.mean / DELTA_E_PER_JND,
            patch_mean: patches.asked.as_ref().map(length),
            pixels_needed,
        }
    }
}

/// Ratios of signals to their noise; none where that is void, or the signal is saturated.
fn snr_db(signal: [f64; 3], std: [f64; 3], saturated: Option<[f64; 3]>) -> [Option<f64>; 3] {
    [0, 1, 2].map(|i| {
        let ratio = signal[i] / std[i];
        let is_clear = saturated.is_none_or(|shares| shares[i] < SATURATED);
        (is_clear && ratio > 0.0 && ratio.is_finite()).then(|| 20.0 * ratio.log10())
    })
}

/// Standard deviations of the causes that are fixed patterns, or of those that are not; none where causes are not kept apart.
fn spread_of(by_cause: &[CauseVariance], fixed: bool) -> Option<[f64; 3]> {
    let chosen = by_cause.iter().filter(|entry| entry.cause.is_fixed_pattern() == fixed);
    let sum = chosen.fold([0.0; 3], |sum, entry| [0, 1, 2].map(|i| sum[i] + entry.variance[i]));
    let all = by_cause.iter().fold([0.0; 3], |all, entry| [0, 1, 2].map(|i| all[i] + entry.variance[i].abs()));
    // What is left of causes that cancel is rounding.
    let part = |i: usize| if sum[i] > 1e-13 * all[i] { sum[i].sqrt() } else { 0.0 };
    (!by_cause.is_empty()).then(|| [0, 1, 2].map(part))
}

/// Pixels of the smallest square that is large enough; none up to 2²⁰ on a side.
fn smallest_square(enough: impl Fn(usize) -> bool) -> Option<u64> {
    let above = (0..=20).map(|power| 1_usize << power).find(|&side| enough(side))?;
    let (mut too_small, mut fits) = (above / 2, above);
    while fits - too_small > 1 {
        let middle = usize::midpoint(too_small, fits);
        if enough(middle) { fits = middle } else { too_small = middle }
    }
    Some((fits * fits) as u64)
}
