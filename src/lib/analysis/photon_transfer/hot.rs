//! Hot photosites apart from all others: a share of them whose dark current has an excess by an exponential law, as sensor files have it.
//!
//! Beyond a threshold T above most, an exponential law of mean H has an excess of mean H again, wherever T lies, and a share e^(−T/H) of
//! its photosites: n of N that stand out by d_i > T make H = mean of d_i − T, and the share n/N e^(T/H). What most differ by, by their
//! median absolute deviation, is the dark current non-uniformity without the hot ones.

use super::curve::{are_whole, is_clipped};
use super::level::Level;
use super::sites::Site;
use super::view::{Blur, OUTSTANDING};
use crate::numerics::robust::{NORMAL_MEDIAN, median};

/// Hot photosites of a class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HotTail {
    /// Exposure time in s of the darks that show them.
    pub exposure_s: f64,
    /// The share of the photosites.
    pub share: f64,
    /// Mean excess of their dark current, in samples per second.
    pub excess_per_s: f64,
    /// How many stand out.
    pub count: usize,
    /// What all others differ by in these darks, a variance, without the noise that is left in the mean of the frames.
    pub others: f64,
    /// The same of single photosites alone parted into what no time adds and what goes by it: variances in samples², and per second²,
    /// where darks of two times tell it.
    pub parted: Option<[f64; 2]>,
}

/// What photosites differ by, a variance each, in darks of two exposure times in s, parted into what no time adds and what goes by it.
pub fn parted([(short_s, short), (long_s, long)]: [(f64, f64); 2]) -> Option<[f64; 2]> {
    let between = long_s * long_s - short_s * short_s;
    let per_s2 = ((long - short) / between).max(0.0);
    (between > 0.0).then(|| [(short - per_s2 * short_s * short_s).max(0.0), per_s2])
}

/// The dark of the shortest time, of which code 0 cuts off none, of codes whose error of rounding has such a variance.
pub fn dark_of_offset(darks: &[Level], rounding: f64) -> Option<&Level> {
    let timed = darks.iter().filter(|dark| dark.condition.exposure_s.is_some() && !is_clipped(dark, rounding));
    let time = |dark: &Level| dark.condition.exposure_s.unwrap_or(0.0);
    timed.min_by(|a, b| time(a).total_cmp(&time(b)))
}

/// The dark that shows hot photosites best, of darks of one temperature: the longest in which no more of them are full than in all. None
/// where photosites differ as those of a normal law do.
pub fn dark_of_tail(darks: &[Level]) -> Option<&Level> {
    /// Fourth cumulant over the square of the variance that is no normal law's.
    const HEAVY: f64 = 1.0;
    let whole = darks.iter().zip(are_whole(darks)).filter(|(_, is_whole)| *is_whole).map(|(dark, _)| dark);
    let time = |dark: &Level| dark.condition.exposure_s.unwrap_or(0.0);
    let longest = whole.max_by(|a, b| time(a).total_cmp(&time(b))).filter(|dark| time(dark) > 0.0)?;
    let is_heavy = |site: &super::site_survey::SiteSurvey| site.fourth > HEAVY * site.spatial.rest.value.powi(2);
    longest.sites.iter().any(is_heavy).then_some(longest)
}

/// Hot photosites of the class whose grids are `sites`, in the mean of the frames of a dark of `exposure_s`, a picture of so many columns
/// and planes, which `blur` makes uncertain. None where none stand out.
pub fn hot_tail(
    sites: &[&Site],
    [width, planes]: [usize; 2],
    picture: &[f32],
    exposure_s: f64,
    blur: Blur,
) -> Option<HotTail> {
    /// An exponential law that is told by those of its photosites that are so much fewer than all is none.
    const REACH: f64 = 3.0;
    let mut above: Vec<f64> = Vec::new();
    for site in sites {
        let [columns, rows] = site.size;
        let index = |x: usize, y: usize| {
            ((site.first[1] + y * site.step[1]) * planes + site.plane) * width + site.first[0] + x * site.step[0]
        };
        let own = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        let own: Vec<f64> = own.map(|(x, y)| f64::from(picture[index(x, y)])).collect();
        let middle = median(&mut own.clone());
        above.extend(own.iter().map(|value| value - middle));
    }
    let mut absolute: Vec<f64> = above.iter().map(|value| value.abs()).collect();
    let spread = median(&mut absolute) / NORMAL_MEDIAN;
    let threshold = OUTSTANDING * spread.max(blur.noise) + 2.0 * blur.hidden;
    let beyond: Vec<f64> = above.iter().filter(|value| **value > threshold).map(|value| value - threshold).collect();
    let (count, all) = (beyond.len(), above.len() as f64);
    let excess = beyond.iter().sum::<f64>() / count.max(1) as f64;
    let share = count as f64 / all * (threshold / excess).exp();
    let is_told = count > 0 && threshold < REACH * excess && share < 0.5;
    let others = (spread * spread - blur.noise * blur.noise).max(0.0);
    is_told.then(|| HotTail { exposure_s, share, excess_per_s: excess / exposure_s, count, others, parted: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::to_sample;
    use crate::random::philox::philox4x32_10;

    /// Variances 4 and 9 per second² make 4 + 9 t² at each time; of one time nothing is parted.
    #[test]
    fn patterns_of_two_times_are_parted() {
        assert_eq!(parted([(0.5, 6.25), (2.0, 40.0)]), Some([4.0, 9.0]));
        assert_eq!(parted([(2.0, 40.0), (2.0, 40.0)]), None);
    }

    /// Of 40 000 photosites that differ by 2, 800 have an excess of mean 60: the share and the mean come back within 4 standard deviations,
    /// 1/√n of those that stand out, and so does what the others differ by. Of none nothing is told.
    #[test]
    fn hot_photosites_come_back() {
        const SIDE: usize = 200;
        let chance = |index: usize, key: u32| {
            let [word, ..] = philox4x32_10([u32::try_from(index).unwrap(), 0, 0, 0], [9, key]);
            (f64::from(word) + 0.5) / 4_294_967_296.0
        };
        let normal = |index: usize| (0..12).map(|key| chance(index, key)).sum::<f64>() - 6.0;
        let of = |share: f64| -> Option<HotTail> {
            let value = |index: usize| {
                let hot = if chance(index, 20) < share { -60.0 * chance(index, 21).ln() } else { 0.0 };
                to_sample(100.0 + 2.0 * normal(index) + hot)
            };
            let picture: Vec<f32> = (0..SIDE * SIDE).map(value).collect();
            let site = Site { class: "Y".into(), plane: 0, first: [0, 0], step: [1, 1], size: [SIDE, SIDE] };
            hot_tail(&[&site], [SIDE, 1], &picture, 0.5, Blur { noise: 0.0, hidden: 0.0 })
        };
        let found = of(0.02).unwrap();
        let allowed = 4.0 / (found.count as f64).sqrt();
        assert!((found.share / 0.02 - 1.0).abs() < allowed, "{found:?}");
        assert!((found.excess_per_s / 120.0 - 1.0).abs() < allowed, "{found:?}");
        assert!((found.others / 4.0 - 1.0).abs() < 0.1, "{found:?}");
        assert_eq!(of(0.0), None);
    }
}
