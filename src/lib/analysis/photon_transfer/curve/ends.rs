//! Samples at the ends of the codes, photosites that are full, and where flats saturate.

use super::super::falling::Falling;
use super::super::level::{Level, is_same_time};
use crate::numerics::quantiles;

/// Below this temporal variance in codes² nothing is known of noise: without any, codes have as much half way between two of them.
/// The standard's limit is 0.24 \[EMVA1288, Sec. 6.4].
pub const LEAST_VARIANCE: f64 = 0.25;

/// So many samples at an end, beyond those that darks have there, and what is measured of the others is no longer that of all.
pub const FEW_AT_ENDS: f64 = 1e-5;

/// Why samples of a flat are not those of all photosites, or tell no noise; none where they do. Darks have such a share of hot
/// photosites at the largest code.
pub fn cut_off(flat: &Level, hot: f64, rounding: f64) -> Option<&'static str> {
    let [at_top, at_bottom] = flat.at_ends;
    if at_top > hot + FEW_AT_ENDS {
        Some("reach the largest code")
    } else if rounding > 0.0 && at_bottom > FEW_AT_ENDS {
        Some("reach code 0")
    } else {
        (rounding > 0.0 && flat.variance < LEAST_VARIANCE).then_some("have a variance that rounding hides")
    }
}

/// The largest share of samples that darks have at the largest code.
pub fn hot_share(darks: &[Level]) -> f64 {
    darks.iter().map(|dark| dark.at_ends[0]).fold(0.0, f64::max)
}

/// Levels without the photosites that are at an end whether light falls or not: at the largest code in all darks, and at code 0 in
/// all flats.
pub fn without_stuck(levels: &[Level], [at_top, at_bottom]: [f64; 2]) -> Vec<Level> {
    let without = |level: &Level| {
        let [top, bottom] = level.at_ends;
        Level { at_ends: [(top - at_top).max(0.0), (bottom - at_bottom).max(0.0)], ..level.clone() }
    };
    levels.iter().map(without).collect()
}

/// Shares of the photosites that are at the largest code in all darks, and at code 0 in all flats, where noise brings no others there.
pub fn stuck_shares(flats: &[Level], darks: &[Level]) -> [f64; 2] {
    /// More are no defects.
    const MOST: f64 = 0.1;
    /// Standard deviations that noise does not reach over.
    const BEYOND: f64 = 6.0;
    let least = |levels: &[Level], end: usize| {
        let share = levels.iter().min_by(|a, b| a.at_ends[end].total_cmp(&b.at_ends[end]));
        share
            .filter(|level| end == 0 || level.mean > BEYOND * level.variance.sqrt())
            .map_or(0.0, |level| level.at_ends[end])
    };
    [least(darks, 0), least(flats, 1)].map(|share| if share < MOST { share } else { 0.0 })
}

/// Which darks tell how the dark signal goes with time: of no more photosites than of all of them samples are cut off, at the largest
/// code or where photosites are full.
pub fn are_whole(darks: &[Level]) -> Vec<bool> {
    let least = |of: fn(&Level) -> f64| darks.iter().map(of).fold(f64::INFINITY, f64::min) + FEW_AT_ENDS;
    let [at_end, full] = [least(|dark| dark.at_ends[0]), least(|dark| dark.full)];
    darks.iter().map(|dark| dark.at_ends[0] <= at_end && dark.full <= full).collect()
}

/// The mean from which on a photosite counts as full, by flats beyond saturation.
pub fn full_mean(flats: &[Level]) -> Option<f64> {
    /// Of the brightest flat: above it a signal does not follow the charge.
    const SHARE: f64 = 0.9;
    let mut flats = flats.to_vec();
    flats.sort_by(|a, b| a.mean.total_cmp(&b.mean));
    peak(&flats)?;
    flats.last().map(|brightest| SHARE * brightest.mean)
}

/// Whether code 0 cuts off what is beneath a dark, of codes whose error of rounding has such a variance.
pub fn is_clipped(dark: &Level, rounding: f64) -> bool {
    /// Of so few samples means and variances are those of all.
    const FEW: f64 = 1e-3;
    rounding > 0.0 && dark.at_ends[1] > FEW
}

/// Darks without those that code 0 cuts off, and whether the others stand for all: two times of them tell the dark signal beneath any flat, and
/// one that of flats of its own. Where they do not, all.
pub fn without_clipped(darks: &[Level], flats: &[Level], rounding: f64) -> (Vec<Level>, bool) {
    let whole: Vec<Level> = darks.iter().filter(|dark| !is_clipped(dark, rounding)).cloned().collect();
    if whole.len() == darks.len() {
        return (whole, false);
    }
    let timed = || whole.iter().zip(are_whole(&whole)).filter(|(_, is_whole)| *is_whole).map(|(dark, _)| dark);
    let first = timed().find_map(|dark| dark.condition.exposure_s);
    let time = |dark: &Level| dark.condition.exposure_s;
    let are_several = timed().any(|dark| time(dark).is_some() && !is_same_time(time(dark), first));
    let has_own = |flat: &Level| whole.iter().any(|dark| is_same_time(time(dark), time(flat)));
    let is_told = !whole.is_empty() && (are_several || flats.iter().all(has_own));
    if is_told { (whole, true) } else { (darks.to_vec(), false) }
}

/// Flats of light that is well below saturation, so that their means follow it, by their places; from one on photosites are cut off.
pub fn below_saturation(flats: &[Level], cut_from: Option<usize>) -> Vec<usize> {
    /// Of the mean that saturates.
    const SHARE: f64 = 0.95;
    /// More samples than these at the largest code, and means do not follow the light.
    const FEW: f64 = 1e-3;
    let reach = peak(flats).map_or(f64::INFINITY, |peak| SHARE * flats[peak].mean);
    let is_below = |flat: &usize| flats[*flat].at_ends[0] <= FEW && flats[*flat].mean <= reach;
    (0..cut_from.unwrap_or(flats.len())).filter(is_below).collect()
}

/// The flat from which on part of the photosites is cut off, where no variance falls that would show it: bright photosites have less noise than
/// others, in the brightest flat and in all from this one on. Those that reach the largest code are left out anyway.
pub fn first_cut(flats: &[Level], darks: &[Level], rounding: f64) -> Option<usize> {
    if peak(flats).is_some() {
        return None;
    }
    let hot = hot_share(darks);
    let black = darks.iter().map(|dark| dark.mean).reduce(f64::min).unwrap_or(0.0);
    let is_cut = |flat: &Level| {
        let falling = Falling::of_all(flat.sites.iter().map(|site| site.falling));
        falling.is_cut([flat.variance, flat.frames as f64], flat.mean - black, flat.hidden(rounding).variance)
    };
    let within = (0..flats.len()).rev().filter(|&flat| flats[flat].at_ends[0] <= hot + FEW_AT_ENDS);
    within.take_while(|&flat| is_cut(&flats[flat])).last()
}

/// The flat of the largest temporal variance, where a brighter one has less beyond chance \[EMVA1288, Sec. 6.6].
pub(super) fn peak(flats: &[Level]) -> Option<usize> {
    let (peak, largest) = flats.iter().enumerate().max_by(|(_, a), (_, b)| a.variance.total_cmp(&b.variance))?;
    /// Standard deviations that are beyond chance.
    const BEYOND: f64 = 5.0;
    let falls = |after: &Level| {
        let scatter = (after.variance_variance + largest.variance_variance).sqrt();
        after.variance < largest.variance - BEYOND * scatter && after.variance < 0.9 * largest.variance
    };
    flats[peak + 1..].iter().any(falls).then_some(peak)
}

/// The first and the last of the flats, by their places, whose expected variance may be the largest: the one that has it is among those that no
/// other exceeds by more than both scatter by, with such a probability, whichever of the others may do so by chance \[Gupta1965].
pub fn may_be_largest(flats: &[Level], confidence: f64) -> [usize; 2] {
    let others = flats.len().saturating_sub(1).max(1) as f64;
    let beyond = quantiles::of_normal(1.0 - (1.0 - confidence) / others);
    let exceeds = |other: &Level, own: &Level| {
        other.variance - own.variance > beyond * (other.variance_variance + own.variance_variance).sqrt()
    };
    let may_be = |flat: &Level| !flats.iter().any(|other| exceeds(other, flat));
    let [first, last] = [flats.iter().position(may_be), flats.iter().rposition(may_be)];
    [first.unwrap_or(0), last.unwrap_or(0)]
}
