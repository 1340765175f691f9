//! What averages of exposures make of the photosites of a line, by what the line has in them on average.
//!
//! A photosite of the sensitivity x and the offset o, both the same in all N exposures, has the mean μ(x, o, a) over exposures in which its line
//! has a, and the variance w(x, o, a). So in an average it has, over the photosites of a line,
//!
//! m(a) = E μ,   v(a) = Var μ + E w/N
//!
//! with a what is fixed of the line and the mean of what it has anew, which is 1/N of that in variance. By what is left of that in each
//! exposure, 1 − 1/N, photosites follow a on less of a curve, as by noise of their own; of w it is no part, since it adds up to nothing.

use super::blur::blur_e;
use super::law::Law;
use super::line_means::{Kinds, LineMeans, Pair};
use super::lines::nodes;
use super::photosite::Photosite;
use crate::metadata::AdcRecord;
use crate::stages::noise::{LineNoise, NoiseModel};
use std::cell::OnceCell;

/// Photosites of a class in an average of exposures.
pub(super) struct Averaging {
    frames: f64,
    /// Photosites that have what is drawn anew alone.
    anew: Kinds,
    /// What blurs their codes, e⁻.
    blur_e: f64,
    /// The share of w in what is drawn anew.
    kept: f64,
    /// The light, and the charge, e⁻.
    light_e: f64,
    charge_e: f64,
    /// Relative sensitivities of photosites to the charge, with their weights; none where full well is out of reach, so that they are offsets.
    gains: Option<Vec<(f64, f64)>>,
    /// Their fixed offsets, e⁻.
    offsets: Vec<(f64, f64)>,
    /// Photosites of all lines, where sensitivities are offsets.
    all: OnceCell<Vec<(f64, LineMeans)>>,
}

impl Averaging {
    /// Of so many exposures; `rest` is the noise of photosites but for that of their line, which has so much anew in each, e⁻.
    pub fn of(
        site: &Photosite,
        expected_e: f64,
        rest: impl Fn(&NoiseModel) -> NoiseModel,
        line_e: f64,
        frames: u32,
    ) -> Self {
        let n = f64::from(frames.max(1));
        let left_e = line_e * (1.0 - 1.0 / n).sqrt();
        let anew = |model: &NoiseModel| {
            let read_noise_e = rest(model).read_noise().hypot(left_e);
            NoiseModel { read_noise_e, prnu: 0.0, dcnu: 0.0, lines: LineNoise::default(), ..rest(model) }
        };
        let (own, temporal) = (rest(&site.model), anew(&site.model));
        let law = Law::of(&temporal, expected_e);
        let own_e2 = law.light.shot_std().powi(2) + law.dark.shot_std().powi(2) + own.read_noise().powi(2);
        let anew_e2 = own_e2 + left_e * left_e;
        let charge_e = expected_e + own.dark_e;
        let pattern_e = (own.response() * expected_e).hypot(own.dcnu * own.dark_e);
        let is_full = Law::of(&own, expected_e).reaches_full_well() && charge_e > 0.0;
        let gain = |(z, weight): (f64, f64)| ((1.0 + z * pattern_e / charge_e).max(0.0), weight);
        let gains = || nodes(pattern_e, anew_e2.sqrt()).into_iter().map(gain).collect();
        let [offset_e, smooth_e] = match is_full {
            true => [own.offsets(), temporal.read_noise_e],
            false => [own.offsets().hypot(pattern_e), anew_e2.sqrt()],
        };
        Self {
            frames: n,
            anew: site.kinds_of_line(expected_e, anew),
            blur_e: site.adc.map_or(f64::INFINITY, |adc| blur_e(&temporal, &adc, expected_e)),
            kept: if anew_e2 > 0.0 { own_e2 / anew_e2 } else { 1.0 },
            light_e: expected_e,
            charge_e,
            gains: is_full.then(gains),
            offsets: nodes(offset_e, smooth_e).into_iter().map(|(z, weight)| (offset_e * z, weight)).collect(),
            all: OnceCell::new(),
        }
    }

    /// Photosites of a line that has such a share of the light, about the center that `about` has; where full well is out of reach its gain
    /// is an offset, and shot noise that of the mean light.
    pub fn line(&self, share: f64, about: &Law, adc: Option<AdcRecord>) -> AveragedMeans<'_> {
        let means = |(weight, law): (f64, Law)| {
            let kind = Kinds { laws: vec![(1.0, law)], jumps: self.anew.jumps.clone() };
            (weight, LineMeans::of(&kind, about, adc, self.blur_e))
        };
        let gained_e = self.light_e * (share - 1.0);
        let Some(gains) = &self.gains else {
            let all = || self.anew.laws.iter().copied().map(means).collect();
            return AveragedMeans { of: self, offset_e: gained_e, parts: Parts::OfAll(self.all.get_or_init(all)) };
        };
        let share = 1.0 + gained_e / self.charge_e;
        let of_kind = |(weight, law): &(f64, Law)| {
            let (weight, law) = (*weight, *law);
            gains.iter().map(move |(gain, of_gain)| (weight * of_gain, law.gained(share * gain)))
        };
        let parts = self.anew.laws.iter().flat_map(of_kind).map(means).collect();
        AveragedMeans { of: self, offset_e: 0.0, parts: Parts::OfLine(parts) }
    }
}

/// The photosites of a class in one line, in an average.
pub(super) struct AveragedMeans<'a> {
    of: &'a Averaging,
    /// What its gain adds to the charge.
    offset_e: f64,
    parts: Parts<'a>,
}

/// Photosites of unlike sensitivities, with their shares.
enum Parts<'a> {
    OfAll(&'a [(f64, LineMeans)]),
    OfLine(Vec<(f64, LineMeans)>),
}

impl AveragedMeans<'_> {
    /// The mean about the center where so much is added to the charge, and that of the square.
    pub fn at(&self, offset_e: f64) -> Pair {
        let parts = match &self.parts {
            Parts::OfAll(all) => all,
            Parts::OfLine(parts) => &parts[..],
        };
        let mut found = [0.0; 2];
        for (of_part, means) in parts {
            for (of_site_e, weight) in &self.of.offsets {
                let [mean, square] = means.near(offset_e + self.offset_e + of_site_e);
                let anew = (square - mean * mean).max(0.0) * self.of.kept / self.of.frames;
                found[0] += of_part * weight * mean;
                found[1] += of_part * weight * (mean * mean + anew);
            }
        }
        found
    }
}
