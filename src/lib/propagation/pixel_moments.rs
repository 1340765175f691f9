//! Moments of pixels that are weighted sums of photosites: demosaicked, and what is made of them.

use super::curved::{self, PixelLaw};
use super::gains;
use super::moments::SiteCovariance;
use super::moments::{Equations, Prediction};
use super::paper;
use super::smooth_hue::{self, FirstOrder, hues};
use crate::cfa::CfaPattern;
use crate::color;
use crate::numerics::normal::{self, MeanVariance};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{PHASES, REACH};
use crate::stages::demosaic::weights::{WeightTable, Weights};
use nalgebra::{Matrix3, Vector3};

/// Moments of pixels each of which is a weighted sum of photosites that are drawn apart.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelMoments {
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
    /// Why these moments are void, where they are.
    pub void: Option<&'static str>,
}

impl PixelMoments {
    /// What demosaicking makes of photosites, by the exact weights or by the paper's equations; none where the paper has
    /// none.
    ///
    /// `size` is that of the frame. The hues that smooth hue transition
    /// divides by are those of the means above `black`, the level that was subtracted.
    pub(super) fn demosaicked(
        pattern: CfaPattern,
        black: f64,
        method: Method,
        sites: [Prediction; 3],
        size: [usize; 2],
        equations: Equations,
    ) -> Option<Self> {
        let mean = sites.map(|site| site.moments.mean - black);
        let weights = WeightTable::of(method, pattern).about(hues(mean));
        let variances = sites.map(|site| site.moments.variance);
        let mut bias = [0.0; 3];
        let mut void = None;
        let covariance = match equations {
            Equations::Exact => {
                let second = smooth_hue::second_order(method, pattern, mean, &sites);
                let is_possible = second.as_ref().is_none_or(|second| is_covariance(&second.covariance));
                if method == Method::SmoothHue && !(FirstOrder::of(mean, variances).holds && is_possible) {
                    void = Some(smooth_hue::VOID);
                }
                match second.filter(|_| is_possible) {
                    Some(second) => {
                        bias = second.bias;
                        second.covariance
                    }
                    None => gains::mean_pixel_covariance(&weights, &SiteCovariance::of(&sites)),
                }
            }
            Equations::Paper => paper::demosaicked(method, variances, mean, Some(size))?,
        };
        Some(Self {
            mean: [0, 1, 2].map(|i| mean[i] + bias[i]),
            bias,
            covariance,
            weights,
            from_camera: Matrix3::identity(),
            sites,
            void,
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
            void: self.void,
        }
    }

    /// The same pixels in a space that is not linear in these channels, `local` about their means without noise and `value` the
    /// color of any: weights by the Jacobian, mean and covariance by [`curved::moments`]; none where that has none.
    #[must_use]
    pub(super) fn curved(&self, local: &color::Local, value: impl Fn([f64; 3]) -> [f64; 3]) -> Option<Self> {
        let straight = self.through(&local.jacobian, 0.0);
        let further = self.beyond_weights();
        if is_bent_by(self.mean, &self.covariance, &further) {
            return None;
        }
        // What rows and columns share is in the covariance alone: it is normal.
        let covariances = self.phase_covariances();
        let laws: [_; PHASES.len()] =
            std::array::from_fn(|phase| PixelLaw { covariance: covariances[phase], ..self.law(phase) });
        let (mean, covariance) = curved::moments(self.mean, &laws, value)?;
        Some(Self { mean, bias: [0, 1, 2].map(|i| mean[i] - local.value[i]), covariance, ..straight })
    }

    /// What of the covariance in a space that is curved in these channels, `value` the color of any, is the same in every exposure: `means`
    /// are pixels of the means that photosites have over exposures.
    pub(super) fn fixed_in(&self, means: &Self, value: impl Fn([f64; 3]) -> [f64; 3]) -> Matrix3<f64> {
        let [whole, fixed] = [self, means].map(Self::phase_covariances);
        let part = |phase: usize| {
            let law = PixelLaw { covariance: fixed[phase], ..means.law(phase) };
            (law, whole[phase] - fixed[phase])
        };
        curved::fixed(self.mean, &std::array::from_fn::<_, { PHASES.len() }, _>(part), value)
    }

    /// The same to first order, with the bias of second order.
    #[must_use]
    pub(super) fn linearized(&self, local: &color::Local) -> Self {
        let straight = self.through(&local.jacobian, 0.0);
        let bias = local.bias(&self.covariance);
        Self { mean: [0, 1, 2].map(|i| local.value[i] + bias[i]), bias, ..straight }
    }

    /// Cumulants of the channels of a pixel of one phase, by the weights, as if all photosites were drawn apart.
    fn law(&self, phase: usize) -> PixelLaw {
        let offsets = (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| [x, y]));
        PixelLaw::of(offsets.map(|offset| {
            let weights = [0, 1, 2].map(|channel| self.weights.stencil(phase, channel).at(offset));
            (weights, &self.sites[self.weights.class(phase, offset) as usize])
        }))
    }

    /// Covariance of a pixel of each phase of the filter array; what the second order adds counts for all alike.
    pub fn phase_covariances(&self) -> [Matrix3<f64>; PHASES.len()] {
        let sites = self.site_covariance();
        let further = self.beyond_weights();
        std::array::from_fn(|phase| gains::pixel_covariance(&self.weights, phase, &sites) + further)
    }

    /// The covariance of the photosites.
    pub fn site_covariance(&self) -> SiteCovariance {
        SiteCovariance::of(&self.sites)
    }

    /// What is predicted of the covariance beyond the weights: the second order of smooth hue transition, or the paper's
    /// equations.
    pub fn beyond_weights(&self) -> Matrix3<f64> {
        self.covariance - gains::mean_pixel_covariance(&self.weights, &self.site_covariance())
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

    /// The covariance of the mean of a patch, its corner on `phase`, or on any.
    pub fn patch_mean_covariance(&self, phase: Option<usize>, size: [usize; 2]) -> Matrix3<f64> {
        gains::patch_covariance(&self.weights, phase, size, &self.site_covariance())
    }
}

/// Whether what smooth hue transition adds to the covariance in second order is so much that the third cumulants which it adds, about
/// three times the root of its share, show in what is curved in the channels.
pub(super) fn is_bent_by(mean: [f64; 3], covariance: &Matrix3<f64>, further: &Matrix3<f64>) -> bool {
    const SHOWS: f64 = 5e-3;
    (0..3).any(|i| {
        let variance = covariance[(i, i)].max(f64::MIN_POSITIVE);
        let share = variance.sqrt() / mean[i].abs();
        share * 3.0 * (further[(i, i)].abs() / variance).sqrt() > SHOWS
    })
}

/// Whether no variance is below zero and no correlation beyond 1, but for rounding.
pub(super) fn is_covariance(matrix: &Matrix3<f64>) -> bool {
    let allowance = 1e-9 * matrix.trace().abs();
    matrix.symmetric_eigenvalues().iter().all(|value| *value >= -allowance)
}
