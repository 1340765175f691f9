//! Moments by formula: what the noise of a uniform scene amounts to, before any number is drawn.
//!
//! Each stage has the **exact** moments and, where they differ, those of the **paper**. [`classes`] knows photosites,
//! [`mixture`] what becomes of them when each pixel is a weighted sum of many, [`paper`] the equations of \[HP2005].

pub mod chain;
pub mod classes;
pub mod mixture;
pub mod paper;
pub mod pixels;
pub mod sampling;
pub mod smooth_hue;

pub use classes::{adu, electrons};

use crate::cfa::Class;
use crate::color;
use crate::demosaic::Method;
use crate::demosaic::weights::{PHASES, WeightTable, Weights};
use crate::metadata::{FrameHeader, NoiseRecord, PoissonKind, PredictedRecord};
use crate::noise::NoiseModel;
use crate::numerics::normal::{self, MeanVariance};
use crate::transfer::{Transfer, uniform_share};
use crate::units::QuantityKind;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Which equations to predict by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Equations {
    /// Exact moments.
    #[default]
    Exact,
    /// Those of \[HP2005], misprints mended.
    Paper,
}

/// Predicted moments of the samples of one class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Mean and variance over the photosites of a frame; fixed patterns count as variance.
    pub moments: MeanVariance,
    /// Excess kurtosis, for the spread of a sample variance.
    pub excess_kurtosis: f64,
}

/// Predicted moments of a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum FramePrediction {
    /// Classes that are drawn apart: R, G and B before demosaicking.
    Planes([Prediction; 3]),
    /// Pixels that are mixtures of photosites.
    Mixed(Box<Mixture>),
}

/// Moments of pixels each of which is a weighted sum of photosites that are drawn apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    /// Mean of the three channels, bias included.
    pub mean: [f64; 3],
    /// How far noise moves the mean where the channels are curved functions of the photosites, to second order.
    pub bias: [f64; 3],
    /// Covariance of the three channels of a pixel, over all pixels of a large frame; to second order for smooth hue
    /// transition, whose first order, as everyone's covariance, follows from `weights` and `sites`.
    pub covariance: Matrix3<f64>,
    /// What each channel is made of, to first order.
    pub weights: Weights,
    /// Derivatives of these channels with respect to demosaicked R, G and B.
    pub from_camera: Matrix3<f64>,
    /// Moments of the photosites of R, G and B, in the unit that the weights act on.
    pub sites: [Prediction; 3],
}

impl Mixture {
    /// What demosaicking makes of photosites, by the exact weights or by the paper's equations.
    ///
    /// `black` is what was subtracted. The hues that smooth hue transition divides by are those of the means.
    fn demosaicked(frame: &FrameHeader, method: Method, sites: [Prediction; 3], equations: Equations) -> Option<Self> {
        let record = frame.metadata.demosaic.as_ref()?;
        let mean = sites.map(|site| site.moments.mean - record.black);
        let hues = hues(mean);
        let weights = WeightTable::of(method, record.cfa).about(hues);
        let variances = sites.map(|site| site.moments.variance);
        let mut bias = [0.0; 3];
        let covariance = match equations {
            Equations::Exact => {
                let first = mixture::mean_pixel(&weights).covariance(variances);
                let green = third_cumulant_of_green(frame);
                match smooth_hue::second_order(method, record.cfa, mean, variances, green) {
                    Some(second) => {
                        bias = second.bias;
                        second.covariance
                    }
                    None => first,
                }
            }
            Equations::Paper => {
                let geometry = &frame.geometry;
                paper::demosaicked(method, variances, mean, Some([geometry.width, geometry.height]))?
            }
        };
        Some(Self {
            mean: [0, 1, 2].map(|i| mean[i] + bias[i]),
            bias,
            covariance,
            weights,
            from_camera: Matrix3::identity(),
            sites,
        })
    }

    /// The same pixels in the channels that are `matrix` times these, less `black`.
    #[must_use]
    pub fn through(&self, matrix: &Matrix3<f64>, black: f64) -> Self {
        Self {
            mean: (matrix * Vector3::from(self.mean.map(|mean| mean - black))).into(),
            bias: (matrix * Vector3::from(self.bias)).into(),
            covariance: matrix * self.covariance * matrix.transpose(),
            weights: self.weights.through(matrix),
            from_camera: matrix * self.from_camera,
            sites: self.sites,
        }
    }

    /// The same pixels in a space that is not linear in these channels: covariance to first order, through the Jacobian
    /// at the mean; the mean with its bias of second order.
    #[must_use]
    fn curved(&self, local: &color::Local) -> Self {
        let straight = self.through(&local.jacobian, 0.0);
        let bias = local.bias(&self.covariance);
        Self { mean: [0, 1, 2].map(|i| local.value[i] + bias[i]), bias, ..straight }
    }

    /// Covariance of a pixel of each phase of the filter array; what the second order adds counts for all alike.
    pub fn phase_covariances(&self) -> [Matrix3<f64>; PHASES.len()] {
        let variances = self.sites.map(|site| site.moments.variance);
        let further = self.covariance - mixture::mean_pixel(&self.weights).covariance(variances);
        std::array::from_fn(|phase| mixture::pixel(&self.weights, phase).covariance(variances) + further)
    }

    /// Distance of a pixel from what lies `offset` before the mean, the phases of the filter array in these shares.
    ///
    /// Pixels of each phase are normal, those of all together are not: the mean length is the mean over the phases.
    pub fn noise_length(&self, offset: [f64; 3], shares: [f64; PHASES.len()]) -> MeanVariance {
        let offset = Vector3::from(offset);
        let (mut mean, mut square) = (0.0, 0.0);
        for (share, covariance) in shares.into_iter().zip(self.phase_covariances()) {
            let length = normal::length(&offset, &covariance);
            mean += share * length.mean;
            square += share * (length.variance + length.mean.powi(2));
        }
        MeanVariance { mean, variance: (square - mean * mean).max(0.0) }
    }

    /// Gains of the covariance of the mean of a patch, its corner on `phase`, or on any.
    pub fn patch_mean_covariance(&self, phase: Option<usize>, size: [usize; 2]) -> Matrix3<f64> {
        let gains = match phase {
            Some(phase) => mixture::patch_mean(&self.weights, phase, size),
            None => mixture::mean_patch_mean(&self.weights, size),
        };
        gains.covariance(self.sites.map(|site| site.moments.variance))
    }
}

/// Ratios of red and of blue to green; 1 where green is not above zero and there is no hue.
pub fn hues(mean: [f64; 3]) -> [f64; 2] {
    let green = mean[Class::Green as usize];
    [Class::Red, Class::Blue].map(|class| if green > 0.0 { mean[class as usize] / green } else { 1.0 })
}

/// Predicts a frame from its metadata alone; none where the scene is not uniform, the stage is beyond what is predicted,
/// or the metadata do not say enough.
pub fn of_frame(frame: &FrameHeader, equations: Equations) -> Option<FramePrediction> {
    let sites = sites(frame, of_plane(frame), equations)?;
    from_sites(frame, sites, equations)
}

/// The quantity of the photosites that a frame was made of.
fn of_plane(frame: &FrameHeader) -> QuantityKind {
    match (frame.metadata.quantity, &frame.metadata.demosaic) {
        (QuantityKind::Electrons | QuantityKind::ExpectedElectrons, _) | (_, None) => frame.metadata.quantity,
        _ => QuantityKind::Adu,
    }
}

/// Predicts a frame from the moments of the photosites that it was made of.
fn from_sites(frame: &FrameHeader, sites: [Prediction; 3], equations: Equations) -> Option<FramePrediction> {
    let metadata = &frame.metadata;
    if metadata.demosaic.is_none() {
        return Some(FramePrediction::Planes(sites));
    }
    let method = Method::named(&metadata.demosaic.as_ref()?.method)?;
    let camera = Mixture::demosaicked(frame, method, sites, equations)?;
    let Some(record) = &metadata.color else {
        return (metadata.quantity == of_plane(frame)).then(|| FramePrediction::Mixed(Box::new(camera)));
    };
    let xyz_from_adu = color::matrix(&record.xyz_from_camera) / metadata.exposure?.exposure_s_sr();
    let xyz = match equations {
        Equations::Paper if method != Method::EffectiveColor => {
            // Eq. 19 of [HP2005] takes the channels as independent; Eq. 20 keeps the correlations, for ECI.
            let squares = xyz_from_adu.map(|element| element * element);
            let independent = Matrix3::from_diagonal(&(squares * camera.covariance.diagonal()));
            Mixture { covariance: independent, ..camera.through(&xyz_from_adu, record.black_adu) }
        }
        _ => camera.through(&xyz_from_adu, record.black_adu),
    };
    let mixed = match metadata.quantity {
        QuantityKind::Xyz => xyz,
        QuantityKind::Xyy => xyz.curved(&color::xyy_about(xyz.mean)?),
        QuantityKind::Lab => xyz.curved(&color::lab_about(xyz.mean, record.white?)),
        _ => return None,
    };
    Some(FramePrediction::Mixed(Box::new(mixed)))
}

/// Predicts the photosites of a frame, or of the plane that a frame was made of, in the unit of `quantity`.
fn sites(frame: &FrameHeader, quantity: QuantityKind, equations: Equations) -> Option<[Prediction; 3]> {
    let metadata = &frame.metadata;
    let expected = metadata.scene.as_ref().filter(|scene| scene.uniform)?.expected_electrons?;
    let model = model(frame)?;
    match quantity {
        QuantityKind::ExpectedElectrons => Some(
            expected.map(|mean| Prediction { moments: MeanVariance { mean, variance: 0.0 }, excess_kurtosis: 0.0 }),
        ),
        QuantityKind::Electrons => {
            let classes = expected.map(|mean| electrons(&model, mean, equations));
            transferred(frame, &model, classes, 1.0, 0.0)
        }
        QuantityKind::Adu => {
            let adc = metadata.adc?;
            let codes = expected.map(|mean| adu(&model, &adc, mean, equations));
            let Some(correction) = &metadata.correction else {
                let below_bias = codes.map(|code| Prediction {
                    moments: MeanVariance { mean: code.moments.mean - adc.bias_adu, ..code.moments },
                    ..code
                });
                return Some(transferred(frame, &model, below_bias, adc.adu_per_e, 1.0 / 12.0)?.map(|code| {
                    Prediction {
                        moments: MeanVariance { mean: code.moments.mean + adc.bias_adu, ..code.moments },
                        ..code
                    }
                }));
            };
            // What charge transfer and its undoing do to each photosite's noise differs from place to place.
            if correction.cte.is_some() || metadata.noise.as_ref().is_some_and(|noise| noise.cte.is_some()) {
                return None;
            }
            Some(match correction.dark_frames {
                0 => codes.map(|code| Prediction {
                    moments: MeanVariance { mean: code.moments.mean - correction.black_adu, ..code.moments },
                    ..code
                }),
                frames => expected.map(|mean| classes::less_dark(&model, &adc, mean, frames, equations)),
            })
        }
        _ => None,
    }
}

/// What charge transfer leaves of photosites whose mean is in proportion to charge, `slope` units to an electron: the same
/// share of the mean everywhere, and of the variance, apart from read noise and from that of `rounding`, what it leaves on
/// average over the frame. None after demosaicking, and where classes of unequal signals share charge.
fn transferred(
    frame: &FrameHeader,
    model: &NoiseModel,
    classes: [Prediction; 3],
    slope: f64,
    rounding: f64,
) -> Option<[Prediction; 3]> {
    let Some(cte) = frame.metadata.noise.as_ref().and_then(|noise| noise.cte) else { return Some(classes) };
    // Behind a filter array charge moves between classes: where they differ, so do means from place to place.
    let is_level = classes.iter().all(|class| class.moments.mean == classes[0].moments.mean);
    if frame.metadata.demosaic.is_some() || (frame.metadata.cfa.is_some() && !is_level) {
        return None;
    }
    let of_variance = Transfer::new(cte, &frame.geometry).ok()?.mean_square_share();
    let after = model.read_noise_e.powi(2) * slope * slope + rounding;
    Some(classes.map(|class| {
        let mean = class.moments.mean * uniform_share(cte);
        let variance = (class.moments.variance - after).max(0.0) * of_variance + after.min(class.moments.variance);
        Prediction { moments: MeanVariance { mean, variance }, ..class }
    }))
}

/// Third cumulant of the green photosites that a frame was made of, before anything clips or rounds.
fn third_cumulant_of_green(frame: &FrameHeader) -> f64 {
    let expected = frame.metadata.scene.as_ref().and_then(|scene| scene.expected_electrons);
    let slope = match (of_plane(frame), frame.metadata.adc) {
        (QuantityKind::Adu, Some(adc)) => adc.adu_per_e,
        _ => 1.0,
    };
    let third = model(frame).zip(expected).map(|(model, e)| classes::charge(&model, e[Class::Green as usize]).third);
    third.unwrap_or(0.0) * slope.powi(3)
}

/// The noise model of a frame; one without noise record has no noise, and no dark signal.
fn model(frame: &FrameHeader) -> Option<NoiseModel> {
    let silent = NoiseRecord {
        sources: vec![],
        seed: 0,
        sensor_seed: 0,
        frame: 0,
        temperature_k: 0.0,
        dark_e: 0.0,
        poisson: PoissonKind::Exact,
        cte: None,
    };
    let record = frame.metadata.noise.as_ref().unwrap_or(&silent);
    let mut model = NoiseModel::of(frame, record).ok()?;
    if frame.metadata.noise.is_none() {
        model.full_well_e = f64::INFINITY;
    }
    Some(model)
}

/// Writes the predicted moments of a frame into its metadata, where there are any.
pub fn note(frame: &mut FrameHeader, equations: Equations) {
    frame.metadata.predicted = of_frame(frame, equations).map(|prediction| match prediction {
        FramePrediction::Planes(classes) => PredictedRecord {
            mean: classes.map(|class| class.moments.mean),
            std: classes.map(|class| class.moments.std()),
        },
        FramePrediction::Mixed(mixture) => {
            PredictedRecord { mean: mixture.mean, std: [0, 1, 2].map(|i| mixture.covariance[(i, i)].max(0.0).sqrt()) }
        }
    });
}
