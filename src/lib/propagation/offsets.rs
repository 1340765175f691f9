//! Fixed offsets of photosites where codes show or end: with the offset u a photosite is one of a sensor whose readings are off by u.
//!
//! What light and dark frames share is, with u ~ N(0, σ²) and patterns of the charge beside it, by the law of total covariance
//!
//! cov(y, y') = E cov(y, y' | u) + cov(E(y|u), E(y'|u)).
//!
//! The means follow u as smoothly as what is drawn anew lets them, read noise alone at full well, so that equal steps, a fraction of it, are
//! exact to rounding.

use super::effort;
use super::law::Law;
use super::memory::Memory;
use super::moments::Prediction;
use super::pattern::{Seen, Shared};
use super::photosite::Photosite;
use super::reading::codes_of;
use crate::metadata::AdcRecord;
use crate::numerics::normal::density;
use crate::numerics::rounding::REACH;

/// Steps at most; where there is next to no read noise, means follow offsets by steps of their own, and more would be needed.
const MOST_STEPS: f64 = 16_384.0;

/// Evaluations beyond which nothing is said.
const MOST: u64 = 30_000_000;

impl Photosite {
    /// What codes, and those of dark frames, or `medians` of so many of them, share of patterns and offsets, where offsets of the two are
    /// the same but for their size, and an end of the codes or the codes show (`is_fine`); none where slopes tell, or offsets differ. NaN
    /// where it takes too long.
    pub(super) fn shared_over_offsets(
        &self,
        adc: &AdcRecord,
        laws: [Law; 2],
        (dark, medians): (&Self, [Option<u32>; 2]),
        is_fine: bool,
    ) -> Option<Shared> {
        let models = [&self.model, &dark.model];
        let sigmas = models.map(|model| model.offsets());
        let product = sigmas[0] * sigmas[1];
        let is_one = (self.model.offsets_shared_with(&dark.model) - product).abs() <= 1e-9 * product;
        let is_straight = !is_fine && adc.linearization.is_none() && laws.iter().all(|law| law.is_within(adc));
        if !is_one || is_straight {
            return None;
        }
        let seen = [0, 1].map(|k| {
            let law = Law { read_noise_e: models[k].read_noise(), ..laws[k] };
            Seen { law, reading: law.of_codes(adc, codes_of(adc)), median_of: medians[k], is_fine }
        });
        thread_local! { static KNOWN: Memory<([Seen; 2], [f64; 2]), Shared> = const { Memory::new() }; }
        Some(KNOWN.with(|known| known.recall((seen, sigmas), |(seen, sigmas)| over_offsets(seen, sigmas))))
    }
}

/// What is no number, as it takes too long.
const TOO_LONG: Shared = Shared { light: f64::NAN, dark: f64::NAN, both: f64::NAN, median: None };

/// What the mean of a photosite follows offsets over, e⁻: what is drawn anew in it, where read noise blurs counts, and full well cuts
/// none of it off before offsets come to it.
fn blur_e(law: &Law) -> f64 {
    /// Of single counts e^(−2π²σ²) is left, 3·10⁻⁹.
    const BLURRED_E: f64 = 1.0;
    match law.read_noise_e >= BLURRED_E && !law.reaches_full_well() {
        true => law.light.shot_std().hypot(law.dark.shot_std()).hypot(law.read_noise_e),
        false => law.read_noise_e,
    }
}

/// What two laws share whose readings are off by σ z and σ' z, z normal.
fn over_offsets(seen: &[Seen; 2], sigmas: &[f64; 2]) -> Shared {
    // Medians scatter less.
    let narrowing = |k: usize| seen[k].median_of.map_or(1.0, |count| f64::from(count).sqrt());
    let steepness = |k: usize| sigmas[k] * narrowing(k) / blur_e(&seen[k].law).max(1e-9);
    let steepest = steepness(0).max(steepness(1));
    let step = (1.0 + steepest * steepest).sqrt().recip() / 1.3;
    if step < 2.0 * REACH / MOST_STEPS {
        return TOO_LONG;
    }
    let has_patterns = seen.iter().any(|seen| seen.law.light.pattern > 0.0 || seen.law.dark.pattern > 0.0);
    let sums = effort::within(MOST, || {
        let (mut means, mut products, mut moments) = ([0.0; 2], [0.0; 3], [0.0; 4]);
        let steps = (REACH / step).ceil();
        let mut z = -steps * step;
        while z <= (steps + 0.5) * step && !effort::is_spent() {
            let weight = step * density(z);
            let off = [0, 1].map(|k| Seen { reading: seen[k].reading.off_by(sigmas[k] * z), ..seen[k] });
            let medians = off.map(|seen| seen.median_of.and_then(|_| Shared::of(seen, seen).median));
            let mean = |k: usize| match &medians[k] {
                Some(median) => median.moments.mean - off[k].reading.center,
                None => off[k].law.expect(&off[k].reading)[0],
            };
            let [light, dark] = [mean(0), mean(1)];
            means = [means[0] + weight * light, means[1] + weight * dark];
            if let Some(median) = &medians[1] {
                let about = median.moments_about(off[1].reading.center);
                moments.iter_mut().zip(about).for_each(|(sum, moment)| *sum += weight * moment);
            }
            let within =
                has_patterns.then(|| Shared::of(off[0], off[1])).map_or([0.0; 3], |s| [s.light, s.dark, s.both]);
            for (sum, (product, within)) in
                products.iter_mut().zip([light * light, dark * dark, light * dark].into_iter().zip(within))
            {
                *sum += weight * (product + within);
            }
            z += step;
        }
        (means, products, moments)
    });
    let Some(([light, dark], products, moments)) = sums else {
        return TOO_LONG;
    };
    let both = products[2] - light * dark;
    let variance = |square: f64, mean: f64| (square - mean * mean).max(0.0);
    let median = seen[1].median_of.map(|_| Prediction::about(seen[1].reading.center, &moments));
    Shared { light: variance(products[0], light), dark: variance(products[1], dark), both, median }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::PoissonKind;
    use crate::numerics::averages::Combine;
    use crate::numerics::normal::cumulative;
    use crate::propagation::Equations;
    use crate::propagation::budget::Cause;
    use crate::propagation::masters::Dark;
    use crate::stages::noise::{LineNoise, NoiseModel, Tails};

    fn site(dsnu_e: f64, read_noise_e: f64, [bits, adu_per_e, bias_adu]: [f64; 3]) -> Photosite {
        let model = NoiseModel {
            dark_e: 0.0,
            dcnu: 0.0,
            prnu: 0.0,
            read_noise_e,
            full_well_e: 50_000.0,
            dark_shot: true,
            signal_shot: true,
            poisson: PoissonKind::Exact,
            lines: LineNoise { dsnu_e, ..LineNoise::default() },
            tails: Tails::default(),
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number")]
        let adc = AdcRecord::new(bits as u32, bias_adu, adu_per_e);
        Photosite::of_electrons(model, Equations::Exact).digitized(adc)
    }

    /// Temporal and fixed variance of codes without light, by the probabilities of all codes at each of many offsets.
    fn by_codes(dsnu_e: f64, read_noise_e: f64, [bits, adu_per_e, bias_adu]: [f64; 3]) -> [f64; 2] {
        let top = bits.exp2() - 1.0;
        let (step, mut z) = (2e-3, -8.0);
        let [mut temporal, mut mean, mut square] = [0.0; 3];
        while z < 8.0 {
            let level = bias_adu + adu_per_e * dsnu_e * z;
            let (mut first, mut second, mut code) = (0.0, 0.0, 1.0);
            while code <= top && code < level + 12.0 * adu_per_e * read_noise_e + 2.0 {
                let share = cumulative((level - code + 0.5) / (adu_per_e * read_noise_e));
                first += share;
                second += share * (2.0 * code - 1.0);
                code += 1.0;
            }
            let weight = step * (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            temporal += weight * (second - first * first);
            mean += weight * first;
            square += weight * first * first;
            z += step;
        }
        [temporal, square - mean * mean]
    }

    /// Offsets that an end of the codes cuts off, and such as are read by coarse codes: exact after dark frames, and in the two parts.
    #[test]
    fn offsets_are_exact_beside_ends_and_over_coarse_codes() {
        for (dsnu_e, read_noise_e, adc) in
            [(100.0, 50.0, [12.0, 1.8, 205.0]), (80.0, 20.0, [8.0, 0.005, 10.3]), (80.0, 20.0, [8.0, 0.005, 10.5])]
        {
            let [temporal, fixed] = by_codes(dsnu_e, read_noise_e, adc);
            let one = site(dsnu_e, read_noise_e, adc);
            for frames in [0, 1, 4] {
                let left = if frames == 0 { 1.0 } else { 0.0 };
                let anew = if frames == 0 { 1.0 } else { 1.0 + 1.0 / f64::from(frames) };
                let causes = one.less_dark_frames(frames).causes(0.0).unwrap();
                let part = |is_fixed: bool| -> f64 {
                    let of_part = Cause::ALL.iter().filter(|cause| cause.is_fixed_pattern() == is_fixed);
                    of_part.map(|cause| causes[*cause as usize]).sum()
                };
                let all = temporal * anew + fixed * left;
                assert!((part(false) - temporal * anew).abs() < 1e-4 * all, "{frames} {} {temporal}", part(false));
                assert!((part(true) - fixed * left).abs() < 1e-4 * all, "{frames} {} {fixed}", part(true));
            }
        }
    }

    fn temporal(site: &Photosite, light_e: f64) -> f64 {
        site.temporal_variance(light_e, site.moments(light_e).moments.variance)
    }

    /// Codes of 685 e⁻ beside patterns of many: by a sum over all counts at each of 6000 sensitivities, outside this library. Few hot
    /// photosites, and small jumps of few, hardly add to it.
    #[test]
    fn what_is_drawn_anew_is_told_from_wide_patterns_of_coarse_codes() {
        for (prnu, expected, most_off) in
            [(0.1, 0.060_800_7, 1e-4), (0.2, 0.060_798_3, 1e-4), (0.499, 0.061_067_1, 3e-3)]
        {
            let with = |tails: Tails| {
                let mut one = site(0.0, 0.05, [10.0, 0.001_46, 51.0]);
                one.model.prnu = prnu;
                one.model.full_well_e = 562_074.0;
                one.model.tails = tails;
                temporal(&one, 5448.0) / expected - 1.0
            };
            let off = with(Tails::default());
            assert!(off.abs() < most_off, "{prnu}: {off}");
            if prnu > 0.4 {
                // Each hot photosite beside so wide a pattern takes as long.
                continue;
            }
            let hot = with(Tails { hot_share: 9e-4, hot_e: 303.0, ..Tails::default() });
            assert!(hot.abs() < most_off + 1e-3, "{prnu}: {hot}");
            // Of codes so coarse it goes as the mean difference of two charges, of which jumps of 1.2 σ on average make a third as
            // much again: 0.005 of it, and half of that is what few amplitudes are good to.
            let jumps = with(Tails { rts_share: 0.0146, rts_e: 92.0, ..Tails::default() });
            assert!((jumps - 0.005).abs() < 2.5e-3 + most_off, "{prnu}: {jumps}");
        }
    }

    /// Light and dark signal near the top code, with offsets beside: the mean over offsets of what is drawn anew at sensors whose bias is
    /// off by these.
    #[test]
    fn offsets_beside_patterns_at_an_end_leave_what_is_drawn_anew() {
        let with = |dsnu_e: f64, off_e: f64| {
            let mut one = site(dsnu_e, 1.2, [12.0, 1.163, 123.0 + 1.163 * off_e]);
            (one.model.dark_e, one.model.dcnu, one.model.prnu) = (290.0, 0.38, 0.018);
            temporal(&one, 2861.0)
        };
        for dsnu_e in [20.0, 26.0, 60.0] {
            let places = (-28..=28).map(|step| f64::from(step) * 0.25);
            let expected: f64 =
                places.map(|z| 0.25 * crate::numerics::normal::density(z) * with(0.0, dsnu_e * z)).sum();
            let found = with(dsnu_e, 0.0);
            assert!((found / expected - 1.0).abs() < 1e-4, "{dsnu_e}: {found} {expected}");
        }
    }

    /// Mean and variance of a code less the median of five others, at photosites of all offsets, by the probabilities of all codes: the
    /// third of five in rising order reaches a code where three or more do.
    fn less_median_of_five(dsnu_e: f64, read_noise_e: f64, [bits, adu_per_e, bias_adu]: [f64; 3]) -> [f64; 2] {
        let top = bits.exp2() - 1.0;
        let (step, mut z) = (2e-3, -8.0);
        let [mut temporal, mut mean, mut square] = [0.0; 3];
        while z < 8.0 {
            let level = bias_adu + adu_per_e * dsnu_e * z;
            let (mut one, mut middle, mut code) = ([0.0; 2], [0.0; 2], 1.0);
            while code <= top && code < level + 12.0 * adu_per_e * read_noise_e + 2.0 {
                let p = cumulative((level - code + 0.5) / (adu_per_e * read_noise_e));
                let of_median = p.powi(3) * (10.0 - 15.0 * p + 6.0 * p * p);
                let both = [&mut one, &mut middle].into_iter().zip([p, of_median]);
                both.for_each(|(sum, p)| *sum = [sum[0] + p, sum[1] + p * (2.0 * code - 1.0)]);
                code += 1.0;
            }
            let weight = step * (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            temporal += weight * (one[1] - one[0] * one[0] + middle[1] - middle[0] * middle[0]);
            mean += weight * (one[0] - middle[0]);
            square += weight * (one[0] - middle[0]).powi(2);
            z += step;
        }
        [mean, temporal + square - mean * mean]
    }

    #[test]
    fn medians_of_dark_frames_are_exact_beside_offsets() {
        for (dsnu_e, read_noise_e, adc) in
            [(8.0, 3.0, [12.0, 0.12, 100.0]), (5.0, 2.0, [12.0, 0.12, 100.4]), (100.0, 50.0, [8.0, 0.009, 0.3])]
        {
            let one = site(dsnu_e, read_noise_e, adc);
            let record = Dark { combine: Combine::Median, ..Dark::mean_of(one.model, 5) };
            let after = Photosite { darks: [Some(record), None, None], ..one };
            let adc_record = one.adc.unwrap();
            let [mean, variance] = less_median_of_five(dsnu_e, read_noise_e, adc);
            let found = after.less_dark(&adc_record, 0.0, true).moments;
            assert!((found.mean - mean).abs() < 1e-6, "{} {mean}", found.mean);
            assert!((found.variance / variance - 1.0).abs() < 1e-5, "{} {variance}", found.variance);
        }
    }
}
