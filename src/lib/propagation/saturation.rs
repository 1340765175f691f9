//! How much of a frame is saturated, by the law of its scene.

use super::charge::charge;
use super::frame::{FramePrediction, Sites, of_frame};
use super::ground::{Ground, has_tails, quantity_of_sites};
use super::law::Law;
use super::moments::{Equations, Prediction};
use super::taps;
use crate::cfa::CfaPattern;
use crate::frame::to_sample;
use crate::metadata::{AdcRecord, FrameHeader, Scene};
use crate::names::Named;
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::PHASES;
use crate::stages::demosaic::weights::WeightTable;
use crate::stages::noise::NoiseModel;
use crate::stages::saturation::{FullLevels, least_full_e};
use crate::stages::transfer::uniform_share;
use crate::units::QuantityKind;

/// Standard deviations below the level at which no sample of any frame reaches it: beyond 12 a normal variable lies in one
/// of 10³² cases.
const OUT_OF_REACH: f64 = 12.0;

/// Whether samples of a frame may reach the levels from which they are full: not where the law of a uniform scene, or the
/// brightest signal of another, keeps them 12 standard deviations below.
pub fn is_possible(frame: &FrameHeader, levels: &FullLevels) -> bool {
    let mut bounding = frame.clone();
    if let Some(scene) = &frame.metadata.scene
        && let (false, Some(brightest_e)) = (scene.uniform, scene.brightest_e)
    {
        bounding.metadata.scene = Some(Scene::uniform(scene.source.clone(), [brightest_e; 3]));
    }
    // Tails of hot pixels reach farther than any number of standard deviations.
    if has_tails(frame) {
        return true;
    }
    if are_far_below(&bounding, levels) {
        return false;
    }
    let of_class = |class: Prediction| (class.moments.mean, class.moments.std());
    let moments: Vec<[(f64, f64); 3]> = match of_frame(&bounding, Equations::Exact) {
        Ok(FramePrediction::Planes(classes)) => vec![classes.map(of_class)],
        Ok(FramePrediction::Groups(sites)) => sites.groups.iter().map(|group| group.sites.map(of_class)).collect(),
        Ok(FramePrediction::Pixels(pixels)) => {
            vec![[0, 1, 2].map(|k| (pixels.mean[k], pixels.covariance[(k, k)].max(0.0).sqrt()))]
        }
        Ok(FramePrediction::Tapped(pixels)) => pixels.each_kind().collect(),
        Err(_) => return true,
    };
    let is_beyond = |(level, (mean, std)): (f32, (f64, f64))| is_out_of_reach(f64::from(level), mean, std);
    !moments.into_iter().all(|moments| levels.classes().into_iter().zip(moments).all(is_beyond))
}

fn is_out_of_reach(level: f64, mean: f64, std: f64) -> bool {
    level - mean > OUT_OF_REACH * std
}

/// Whether the charge of each class, with all that is added to it, is as far below the level: what can be told in no time of frames that
/// nothing was made of since they were read.
fn are_far_below(frame: &FrameHeader, levels: &FullLevels) -> bool {
    let metadata = &frame.metadata;
    let is_made = metadata.demosaic.is_some() || metadata.correction.is_some() || metadata.average.is_some();
    let Ok(ground) = Ground::of(frame, Equations::Exact) else { return false };
    if is_made || metadata.is_transferred() || ground.photosite.has_tails() {
        return false;
    }
    let model = &ground.photosite.model;
    let is_far = |(level, expected_e): (f32, f64)| {
        let level_e = match (ground.quantity, ground.photosite.adc) {
            (QuantityKind::Electrons, _) => f64::from(level),
            (QuantityKind::Adu, Some(adc)) if !adc.is_linearized => adc.electrons_at(f64::from(level) - 0.5),
            _ => return false,
        };
        let charge = charge(model, expected_e);
        is_out_of_reach(level_e, charge.mean, charge.variance.max(0.0).sqrt().hypot(model.added()))
    };
    levels.classes().into_iter().zip(ground.smeared.expected_e).all(is_far)
}

/// The expected shares of the samples of R, G and B that count as full: that are read from [`least_full_e`] on. None where the
/// scene is not uniform, or the samples are not those of photosites.
pub fn shares(frame: &FrameHeader) -> Option<[f64; 3]> {
    let least_e = least_full_e(frame)?;
    if frame.taps().is_some() {
        return shares_of_taps(frame, least_e);
    }
    shares_from(frame, least_e, f64::INFINITY)
}

/// The same of a sensor that is read through several amplifiers, the lowest of whose full codes counts for all.
fn shares_of_taps(frame: &FrameHeader, least_e: f64) -> Option<[f64; 3]> {
    let parts = taps::parts(frame);
    let full_sample = |adc: AdcRecord| adc.sample(adc.full_code(least_e));
    let lowest = match (frame.metadata.adc, frame.taps()) {
        (Some(adc), Some(taps)) => {
            (0..taps.count()).map(|tap| full_sample(adc.of_tap(taps, tap))).fold(f64::INFINITY, f64::min)
        }
        _ => f64::INFINITY,
    };
    let [mut sums, mut counts] = [[0.0; 3]; 2];
    for part in parts {
        let of_part = shares_from(&part.frame, least_e, lowest)?;
        for k in 0..3 {
            sums[k] += part.counts[k] * of_part[k];
            counts[k] += part.counts[k];
        }
    }
    Some([0, 1, 2].map(|k| if counts[k] > 0.0 { sums[k] / counts[k] } else { 0.0 }))
}

/// The lowest code whose sample is no less.
fn code_of(adc: &AdcRecord, sample: f64) -> f64 {
    const ROUNDED: f64 = 1e-6;
    match adc.is_linearized {
        true => (adc.level_at((sample - adc.bias_adu) / adc.adu_per_e) - ROUNDED).ceil(),
        false => sample,
    }
}

/// The shares of samples that are read from a charge on, or reach a sample.
fn shares_from(frame: &FrameHeader, least_e: f64, sample: f64) -> Option<[f64; 3]> {
    // Which exposures of an average a full photosite was full in is not told.
    let Sites { photosite, expected_e, .. } =
        Sites::of(frame, Equations::Exact).ok().filter(|_| frame.metadata.average.is_none())?;
    // Charges are those before transfer.
    let left = frame.metadata.noise.as_ref().and_then(|noise| noise.cte).map_or(1.0, uniform_share);
    let first_e = match (quantity_of_sites(frame), photosite.adc) {
        (QuantityKind::Electrons, _) => f64::from(to_sample(least_e)),
        (QuantityKind::Adu, Some(adc)) => adc.electrons_at(adc.full_code(least_e).min(code_of(&adc, sample)) - 0.5),
        _ => return None,
    } / left;
    let share = |expected_e: f64| {
        let of = |model: &NoiseModel| Law::of(model, expected_e).is_read_from(first_e);
        if photosite.has_tails() {
            return photosite.mean_of(expected_e, |site| of(&site.model));
        }
        of(&photosite.model)
    };
    let mut shares = [0.0; 3];
    for (found, expected_e) in shares.iter_mut().zip(expected_e) {
        *found = share(expected_e);
        // What takes too long is no number.
        if found.is_nan() {
            return None;
        }
    }
    Some(shares)
}

/// The expected share of the pixels of a demosaicked frame that used a full sample; of a frame far from its edges.
///
/// 1 − ⟨Π (1 − pₖ)⟩ over the sites that a pixel is made of, k their classes, and the mean that of the four phases
pub fn share_of_pixels(frame: &FrameHeader) -> Option<f64> {
    let record = frame.metadata.demosaic.as_ref()?;
    let method = Method::named(&record.method)?;
    // Which pixels several amplifiers have a part in is not followed.
    frame.taps().is_none().then(|| shares(frame)).flatten().map(|shares| used(method, record.cfa, shares))
}

/// Shares below which nothing is told: the law's tails are no better than this.
const TOLD: f64 = 1e-12;

/// What is expected of the samples of R, G and B, or of all pixels that are made of several; none where next to nothing is
/// saturated, or nothing is known.
pub fn expected(frame: &FrameHeader) -> Option<[f64; 3]> {
    known(frame).filter(|shares| shares.iter().any(|share| *share > TOLD))
}

/// Whether the law of a uniform scene says that next to nothing is saturated.
pub fn is_negligible(frame: &FrameHeader) -> bool {
    known(frame).is_some() && expected(frame).is_none()
}

fn known(frame: &FrameHeader) -> Option<[f64; 3]> {
    match frame.metadata.demosaic {
        None => shares(frame),
        Some(_) => share_of_pixels(frame).map(|share| [share; 3]),
    }
}

fn used(method: Method, pattern: CfaPattern, shares: [f64; 3]) -> f64 {
    let table = WeightTable::of(method, pattern);
    let free = |phase: usize| -> f64 {
        table.sites(phase).into_iter().map(|offset| 1.0 - shares[table.class(phase, offset) as usize]).product()
    };
    1.0 - (0..PHASES.len()).map(free).sum::<f64>() / PHASES.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: bilinear red sites use all nine about them (1 red, 4 green, 4 blue), green ones five (1 green, 2 red, 2 blue).
    #[test]
    fn the_share_of_bilinear_pixels_is_that_of_their_sites() {
        let [r, g, b] = [0.1_f64, 0.02, 0.3].map(|share| 1.0 - share);
        let full = r * g.powi(4) * b.powi(4) + b * g.powi(4) * r.powi(4) + 2.0 * g * r * r * b * b;
        assert!((used(Method::Bilinear, CfaPattern::Rggb, [0.1, 0.02, 0.3]) - (1.0 - full / 4.0)).abs() < 1e-15);
        assert_eq!(used(Method::EffectiveColor, CfaPattern::Gbrg, [0.0; 3]), 0.0);
    }
}
