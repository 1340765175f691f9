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
use super::line_means::{Kinds, LineMeans, Pair, STRAIGHT};
use super::lines::nodes;
use super::photosite::Photosite;
use crate::metadata::{AdcRecord, PoissonKind};
use crate::stages::noise::{LineNoise, NoiseModel};
use std::cell::OnceCell;

/// Counts from which they are as good as normal numbers, whose skewness is 1/√λ: how lines scatter is asked for to a hundredth.
const MANY_E: f64 = 400.0;

/// Photosites of a class in an average of exposures.
pub(super) struct Averaging {
    frames: f64,
    /// Photosites that have what is drawn anew alone.
    anew: Kinds,
    /// What blurs their codes, e⁻.
    blur_e: f64,
    /// On which scale means are smooth where full well is out of reach, e⁻.
    smooth_e: f64,
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
        let is_many = expected_e + site.model.dark_e >= MANY_E;
        let anew = |model: &NoiseModel| {
            let read_noise_e = rest(model).read_noise().hypot(left_e);
            let poisson = if is_many { PoissonKind::Gaussian } else { model.poisson };
            NoiseModel { read_noise_e, prnu: 0.0, dcnu: 0.0, poisson, lines: LineNoise::default(), ..rest(model) }
        };
        let (own, temporal) = (rest(&site.model), anew(&site.model));
        let law = Law::of(&temporal, expected_e);
        let own_e2 = law.light.shot_std().powi(2) + law.dark.shot_std().powi(2) + own.read_noise().powi(2);
        let anew_e2 = own_e2 + left_e * left_e;
        let charge_e = expected_e + own.dark_e;
        let pattern_e = (own.response() * expected_e).hypot(own.dcnu * own.dark_e);
        let is_full = Law::of(&own, expected_e).reaches_full_well() && charge_e > 0.0;
        let offset_e = if is_full { own.offsets() } else { own.offsets().hypot(pattern_e) };
        let smooth_e = anew_e2.sqrt();
        let blur_e = site.adc.map_or(f64::INFINITY, |adc| blur_e(&temporal, &adc, expected_e));
        let gain = |(z, weight): (f64, f64)| ((1.0 + z * pattern_e / charge_e).max(0.0), weight);
        let gains = || nodes(pattern_e, smooth_e).into_iter().map(gain).collect();
        Self {
            frames: n,
            anew: site.kinds_of_line(expected_e, anew),
            blur_e,
            smooth_e: if site.adc.is_none_or(|adc| adc.adu_per_e * blur_e >= STRAIGHT) { smooth_e } else { blur_e },
            kept: if anew_e2 > 0.0 { own_e2 / anew_e2 } else { 1.0 },
            light_e: expected_e,
            charge_e,
            gains: is_full.then(gains),
            offsets: nodes(offset_e, smooth_e).into_iter().map(|(z, weight)| (offset_e * z, weight)).collect(),
            all: OnceCell::new(),
        }
    }

    /// Photosites of a line that has such a share of the light, about one center for all; where full well is out of reach its gain is an
    /// offset, and shot noise that of the mean light.
    pub fn line(&self, share: f64, adc: Option<AdcRecord>) -> AveragedMeans<'_> {
        // What is read has the noise of this law, too.
        let about = self.anew.most();
        let means = |(weight, law): (f64, Law)| {
            let kind = Kinds { laws: vec![(1.0, law)], jumps: self.anew.jumps.clone() };
            (weight, LineMeans::of(&kind, about, adc, self.blur_e).smooth_over(self.smooth_e))
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
        let is_of_all = matches!(self.parts, Parts::OfAll(_));
        let mut found = [0.0; 2];
        for (of_part, means) in parts {
            for (of_site_e, weight) in &self.of.offsets {
                let place_e = offset_e + self.offset_e + of_site_e;
                let [mean, square] = if is_of_all { means.near(place_e) } else { means.at(place_e) };
                let anew = (square - mean * mean).max(0.0) * self.of.kept / self.of.frames;
                found[0] += of_part * weight * mean;
                found[1] += of_part * weight * (mean * mean + anew);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::Equations;
    use crate::propagation::reading::codes_of;
    use crate::stages::noise::Tails;
    use std::f64::consts::TAU;

    fn site(adc: AdcRecord, full_well_e: f64, has_shot: bool, [fixed_e, read_noise_e, prnu]: [f64; 3]) -> Photosite {
        let model = NoiseModel {
            dark_e: 0.0,
            dcnu: 0.0,
            prnu,
            read_noise_e,
            full_well_e,
            dark_shot: has_shot,
            signal_shot: has_shot,
            poisson: PoissonKind::Exact,
            lines: LineNoise { dsnu_e: fixed_e, ..LineNoise::default() },
            tails: Tails::default(),
        };
        Photosite::of_electrons(model, Equations::Exact).digitized(adc)
    }

    /// Mean about the center and variance in an average of so many exposures, in a line that is off by such a share and so much.
    fn of_average(site: &Photosite, expected_e: f64, frames: u32, share: f64, offset_e: f64) -> [f64; 2] {
        let averaging = Averaging::of(site, expected_e, |model| *model, 0.0, frames);
        let [mean, square] = averaging.line(share, site.adc).at(offset_e);
        let center = |law: &Law| site.adc.map_or(0.0, |adc| law.of_codes(&adc, codes_of(&adc)).center);
        let moved = center(averaging.anew.most()) - center(&Law::of(&site.model, expected_e));
        [mean + moved, square - mean * mean]
    }

    /// Two exposures of a photosite are on one side of a step of one bit with the correlation asin ρ/2π in squared codes \[Sheppard1899], ρ the share
    /// of what is fixed: that is the variance of the means, and the rest of 1/4 is drawn anew. Places a third of the blur apart leave 10⁻⁵.
    #[test]
    fn averages_of_one_bit_keep_the_arc_sine() {
        for [fixed_e, read_noise_e] in [[10.0, 30.0], [40.0, 20.0], [300.0, 20.0]] {
            let site = site(AdcRecord::new(1, 0.0, 1e-5), 1e6, false, [fixed_e, read_noise_e, 0.0]);
            let of_means = (fixed_e * fixed_e / (fixed_e * fixed_e + read_noise_e * read_noise_e)).asin() / TAU;
            for frames in [1, 2, 7, 1000] {
                let [_, found] = of_average(&site, 5e4, frames, 1.0, 0.0);
                let wanted = of_means + (0.25 - of_means) / f64::from(frames);
                assert!((found - wanted).abs() < 3e-5, "{fixed_e} {read_noise_e} {frames}: {found} {wanted}");
            }
        }
    }

    /// An average of one is one exposure, beside the top code, where sensitivities are offsets and shot noise that of the mean light (off by their
    /// spread of 0.6 % in the variance), and at full well.
    #[test]
    fn the_average_of_one_is_an_exposure() {
        for (full_well_e, expected_e) in [(60_000.0, 39_600.0), (30_000.0, 29_800.0)] {
            let site = site(AdcRecord::new(14, 500.0, 0.4), full_well_e, true, [5.0, 6.0, 0.006]);
            for (share, offset_e) in [(1.0, 0.0), (1.004, -3.0), (0.99, 40.0)] {
                let law = Law::of(&site.model, expected_e);
                let kinds = Kinds { laws: vec![(1.0, law)], jumps: Vec::new() };
                let [mean, square] = LineMeans::of(&kinds.gained(share), &law, site.adc, 200.0).at(offset_e);
                let variance = square - mean * mean;
                let [of_mean, found] = of_average(&site, expected_e, 1, share, offset_e);
                assert!((of_mean - mean).abs() < 0.01 * variance.sqrt(), "{expected_e} {share}: {of_mean} {mean}");
                assert!((found / variance - 1.0).abs() < 0.02, "{expected_e} {share}: {found} {variance}");
            }
        }
    }
}
