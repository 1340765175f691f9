//! The variance of a stage by cause.

use super::predicted::CauseVariance;
use crate::metadata::FrameHeader;
use crate::propagation::budget::{Budget, Cause};
use crate::propagation::frame::{FixedPart, Predicted, Sites};
use crate::propagation::gains;
use crate::propagation::tapped::TapMoments;
use crate::propagation::{Equations, FramePrediction, PixelMoments, SiteCovariance, TappedPixels};
use nalgebra::Matrix3;

/// Variances of photosites by cause.
pub(super) enum Causes {
    /// Of R, G and B.
    Classes(Box<[Budget; 3]>),
    /// The same with what of the pixels that are made of them is the same in every exposure.
    Pixels(Box<([Budget; 3], FixedPart)>),
    /// The same behind each amplifier, and the means that their photosites have over exposures.
    Taps(Vec<(usize, [Budget; 3])>, Box<TapMoments>),
}

impl Causes {
    /// Those of a frame of such photosites, whose variances have these causes.
    pub fn of(sites: &Sites, head: &FrameHeader, prediction: &FramePrediction, causes: [Budget; 3]) -> Predicted<Self> {
        Ok(match prediction {
            FramePrediction::Pixels(mixture) if sites.photosite.equations == Equations::Exact => {
                Self::Pixels(Box::new((causes, sites.fixed(head, mixture, fixed_of(&causes))?)))
            }
            _ => Self::Classes(Box::new(causes)),
        })
    }

    /// Variances of the channels of a stage by cause; none for mixtures by the paper's equations, which do not keep causes apart.
    pub fn of_stage(
        &self,
        prediction: &FramePrediction,
        covariance: &Matrix3<f64>,
        equations: Equations,
    ) -> Vec<CauseVariance> {
        match (self, prediction) {
            (Self::Pixels(of), FramePrediction::Pixels(mixture)) if equations == Equations::Exact => {
                of_pixels(mixture, &of.0, covariance, &of.1)
            }
            (Self::Classes(causes), FramePrediction::Planes(_) | FramePrediction::Groups(_)) => {
                each(|cause| [0, 1, 2].map(|class| causes[class][cause as usize]))
            }
            (Self::Taps(budgets, means), FramePrediction::Tapped(pixels)) => {
                of_tapped(pixels, budgets, means, covariance)
            }
            _ => Vec::new(),
        }
    }
}

fn each(variance: impl Fn(Cause) -> [f64; 3]) -> Vec<CauseVariance> {
    Cause::ALL.into_iter().map(|cause| CauseVariance { cause, variance: variance(cause) }).collect()
}

/// Variances of R, G and B that fixed patterns cause.
pub(super) fn fixed_of(causes: &[Budget; 3]) -> [f64; 3] {
    let fixed = || Cause::ALL.iter().filter(|cause| cause.is_fixed_pattern());
    causes.each_ref().map(|budget| fixed().map(|cause| budget[*cause as usize]).sum())
}

fn of_pixels(
    mixture: &PixelMoments,
    causes: &[Budget; 3],
    covariance: &Matrix3<f64>,
    fixed: &FixedPart,
) -> Vec<CauseVariance> {
    let (gains, sites) = (gains::mean_pixel(&mixture.weights), mixture.site_covariance());
    let mut found = each(|cause| {
        let of_classes = [0, 1, 2].map(|class| causes[class][cause as usize]);
        match cause.shared_by() {
            None => gains.covariance(of_classes).diagonal().into(),
            Some(axis) => {
                let shared = Matrix3::from_fn(|k, l| (of_classes[k] * of_classes[l]).max(0.0).sqrt());
                let mut alone = SiteCovariance::independent([0.0; 3]);
                *(if axis == 0 { &mut alone.row } else { &mut alone.column }) = shared;
                if cause == Cause::BlackDrift {
                    (alone.drift, alone.drift_rows) = (shared, sites.drift_rows);
                }
                gains::mean_pixel_covariance(&mixture.weights, &alone).diagonal().into()
            }
        }
    });
    let first_order = gains::mean_pixel_covariance(&mixture.weights, &sites);
    let has_lines = found.iter().any(|entry| entry.cause.shared_by().is_some() && entry.variance != [0.0; 3]);
    if has_lines || !sites.is_independent() {
        add_curved_lines(&mut found, curving(causes), &first_order, &fixed.first_order);
    }
    let all = [0, 1, 2].map(|i| found.iter().map(|entry| entry.variance[i].abs()).sum::<f64>());
    let [pattern, whole] = [fixed.covariance - fixed.first_order, covariance - first_order];
    // Where nothing is curved there is rounding.
    let of_pattern = [0, 1, 2].map(|i| if pattern[(i, i)].abs() > 1e-13 * all[i] { pattern[(i, i)] } else { 0.0 });
    found[Cause::CurvedPattern as usize].variance = of_pattern;
    found[Cause::Curvature as usize].variance = [0, 1, 2].map(|i| whole[(i, i)] - of_pattern[i]);
    found
}

/// Adds what is curved in what rows and columns share: of what is drawn anew in each exposure, and of what is not.
fn add_curved_lines(found: &mut [CauseVariance], curving: Cause, first_order: &Matrix3<f64>, fixed: &Matrix3<f64>) {
    let parts = [(false, curving, first_order - fixed), (true, Cause::ClippedPattern, *fixed)];
    for (is_fixed, cause, part) in parts {
        let of_part = || found.iter().filter(|entry| entry.cause.is_fixed_pattern() == is_fixed);
        let left = [0, 1, 2].map(|i| part[(i, i)] - of_part().map(|entry| entry.variance[i]).sum::<f64>());
        if (0..3).any(|i| left[i].abs() > 1e-9 * first_order[(i, i)]) {
            let variance = &mut found[cause as usize].variance;
            variance.iter_mut().zip(left).for_each(|(variance, left)| *variance += left);
        }
    }
}

/// What makes photosites follow what they share on a curve.
fn curving(causes: &[Budget; 3]) -> Cause {
    let acts = |cause: &Cause| causes.iter().any(|budget| budget[*cause as usize] != 0.0);
    [Cause::Rails, Cause::FullWell].into_iter().find(acts).unwrap_or(Cause::Quantization)
}

/// What is between places of pixels that several amplifiers have a part in is theirs.
fn of_tapped(
    pixels: &TappedPixels,
    budgets: &[(usize, [Budget; 3])],
    means: &TapMoments,
    covariance: &Matrix3<f64>,
) -> Vec<CauseVariance> {
    let of_tap = |tap: usize| budgets.iter().find(|(of, _)| *of == tap);
    let mut found = each(|cause| {
        let of_site = |tap: usize, class: usize| of_tap(tap).map_or(0.0, |(_, causes)| causes[class][cause as usize]);
        pixels.within(cause.shared_by(), cause == Cause::BlackDrift, of_site).diagonal().into()
    });
    if pixels.has_lines() {
        let (first_order, fixed) = (pixels.first_order(), pixels.fixed(means));
        let curving = budgets.first().map_or(Cause::Quantization, |(_, causes)| curving(causes));
        add_curved_lines(&mut found, curving, &first_order, &fixed);
    }
    let between = pixels.between();
    let told = [0, 1, 2].map(|i| found.iter().map(|entry| entry.variance[i]).sum::<f64>() + between[(i, i)]);
    found[Cause::Taps as usize].variance = between.diagonal().into();
    if pixels.bias != [0.0; 3] {
        let of_pattern = pixels.curved_pattern(means);
        found[Cause::CurvedPattern as usize].variance = of_pattern.diagonal().into();
        found[Cause::Curvature as usize].variance =
            [0, 1, 2].map(|i| covariance[(i, i)] - told[i] - of_pattern[(i, i)]);
    }
    found
}
