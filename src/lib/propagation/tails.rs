//! Photosites that are unlike most: hot ones, and those whose reading jumps.
//!
//! Each photosite of a sensor has its own excess of dark current t hot_e and amplitude of jumps s rts_e, t and s exponential
//! numbers of mean 1 on a share of the photosites and 0 on the others, the same in all its frames. Given t and s it is a photosite
//! like those of a sensor without tails, of a larger dark signal, whose reading is off by −a, 0 or a. So moments about the mean of
//! all are those of a mixture,
//!
//! E (y − μ)ⁿ = Σ w Σ_k C(n, k) (μ_w − μ)ⁿ⁻ᵏ m_k,w
//!
//! with w the weights of quadrature in t and s: Gauss and Laguerre's, exact for polynomials of degree 19, where nothing ends or
//! shows how codes are rounded as far as e^(−40); else panels that narrow towards full well and the ends of the codes.

use super::amplitudes::{REACH, Wanted};
use super::blur::blur_e;
use super::budget::{Budget, Cause};
use super::effort;
use super::law::Law;
use super::line_means::Kinds;
use super::memory::Memory;
use super::mixture::mixture;
use super::moments::{Equations, Prediction};
use super::photosite::Photosite;
use super::tail_nodes::Nodes;
use super::unpredictable::{Predicted, Unpredictable};
use crate::numerics::averages::Combine;
use crate::numerics::gauss::laguerre;
use crate::stages::noise::{NoiseModel, Tails};
use std::sync::LazyLock;

/// Why the paper says nothing.
const NOT_IN_THE_PAPER: &str = "the paper has no equations for hot pixels, nor for random telegraph signals";

/// Why nothing is said of charge that moves.
pub(super) const TRANSFERRED: &str = "charge transfer spreads hot pixels over their columns";

/// Why nothing is said of averages that are no means.
const NO_MEANS: &str = "medians and clipped means of frames with hot pixels or random telegraph signals follow no formula here; use \
                        `--combine mean`";

/// Why nothing is said of frames some of whose noise is left out.
const UNLIKE_FRAMES: &str = "hot pixels, random telegraph signals or DCNU are left out of the frame, or of a frame that it was corrected by, and not \
                             of the others; draw all with the same `--without`";

/// Why nothing is said of codes that are not straight.
const BENT: &str = "hot pixels or random telegraph signals before a converter that is not straight";

/// Why nothing is said where rounding shows.
const TOO_FINE: &str = "hot pixels or random telegraph signals go over many codes, and what each photosite has of its own blurs none of \
                        them; give the sensor read noise";

/// Why nothing is said of what is curved.
pub(super) const CURVED: &str = "hot pixels and random telegraph signals reach too far for the series of what is curved in the \
                                 photosites";

/// Standard deviation, in codes, of what blurs them from which rounding of jumps is a uniform error to 3·10⁻⁶ of a squared code.
const BLURRED: f64 = 0.8;

/// Evaluations of one count, place or photosite that a class may take, a fifth of a second.
const MOST_WORK: u64 = 16_000_000;

/// What a kind of photosites has beyond others, in units of the means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub hot: f64,
    pub trap: f64,
}

/// What holds for a kind of photosites, and their share.
#[derive(Debug, Clone, Copy)]
struct Kind<T> {
    weight: f64,
    /// Whether jumps come to it as an error of its own.
    is_free: bool,
    value: T,
}

/// For photosites that are hot and have a trap: exact for polynomials of degree 9.
pub(super) static FEW: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| laguerre(5));

impl NoiseModel {
    /// That of the photosites of one kind.
    fn at(&self, state: &State) -> Self {
        let hot_e = self.tails.hot_e * state.hot;
        let dark_e = self.dark_e + hot_e;
        // The non-uniformity is that of the dark current which all have.
        let dcnu = if hot_e > 0.0 { self.dcnu * self.dark_e / dark_e } else { self.dcnu };
        let tails = Tails { trap_e: self.tails.rts_e * state.trap, ..Tails::default() };
        Self { dark_e, dcnu, tails, ..*self }
    }
}

impl Photosite {
    /// Whether photosites are unlike each other.
    pub(super) fn has_tails(&self) -> bool {
        self.models().any(|model| !model.tails.is_none())
    }

    /// Makes sure that formulas are known for photosites that are unlike most.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`].
    pub(super) fn check_tails(&self, expected_e: [f64; 3]) -> Predicted<()> {
        if !self.has_tails() {
            return Ok(());
        }
        let beyond = |why| Err(Unpredictable::Beyond(why));
        if self.equations == Equations::Paper {
            return beyond(NOT_IN_THE_PAPER);
        }
        if self.adc.is_some_and(|adc| adc.is_bent()) {
            return beyond(BENT);
        }
        if self.averages().any(|dark| dark.frames > 2 && dark.combine != Combine::Mean) {
            return beyond(NO_MEANS);
        }
        // What is divided scatters over codes, or is refused.
        if self.flat.is_some() {
            return if self.are_tails_alike() { Ok(()) } else { beyond(UNLIKE_FRAMES) };
        }
        let amplitude_e = self.most(|tails| tails.rts_e);
        let is_too_fine = |expected_e: f64| {
            self.hot_nodes(expected_e, Wanted::Moments).is_none()
                || self.trap_nodes(expected_e, Wanted::Moments).is_none() && self.jumps_show(expected_e, amplitude_e)
        };
        if expected_e.into_iter().any(is_too_fine) {
            return beyond(TOO_FINE);
        }
        Ok(())
    }

    /// Whether each photosite has the same excess and amplitude, and the same DCNU, in all frames that its samples follow from.
    fn are_tails_alike(&self) -> bool {
        const NEXT_TO_NONE: f64 = 1e-6;
        let alike = |of: fn(&NoiseModel) -> f64| {
            let first = of(&self.model);
            self.models().all(|model| (of(model) - first).abs() <= NEXT_TO_NONE * first.abs())
        };
        // Frames of next to no exposure have no dark signal to differ in.
        let exposed = || self.models().filter(|model| model.dark_e + model.tails.hot_e > 0.0);
        let excess = |model: &NoiseModel| model.tails.hot_e / (model.tails.hot_e + model.dark_e);
        let first = exposed().next().map_or(0.0, excess);
        alike(|model| model.tails.hot_share)
            && alike(|model| model.tails.rts_share)
            && alike(|model| model.tails.rts_e)
            && alike(|model| model.dcnu)
            && exposed().all(|model| (excess(model) - first).abs() <= NEXT_TO_NONE)
    }

    /// The same photosites, those of one kind.
    pub(super) fn at(&self, state: &State) -> Self {
        self.with_models(|model| model.at(state))
    }

    /// That of the frames which have it.
    pub(super) fn most(&self, of: fn(&Tails) -> f64) -> f64 {
        self.models().map(|model| of(&model.tails)).fold(0.0, f64::max)
    }

    /// What holds for each kind of photosites: those that jump apart only where jumps show how codes are rounded, or end; where the rounding
    /// of codes shows, all amplitudes that tell it, or few.
    fn each_of<T>(&self, expected_e: f64, wanted: Wanted, of: impl Fn(&Self) -> T) -> Vec<Kind<T>> {
        let [hot_share, trap_share] = [self.most(|tails| tails.hot_share), self.most(|tails| tails.rts_share)];
        let mut kinds = vec![(0.0, 1.0 - hot_share)];
        if hot_share > 0.0 {
            let nodes = self.hot_nodes(expected_e, wanted).unwrap_or_default();
            kinds.extend(nodes.iter().map(|(t, weight)| (*t, hot_share * weight)));
        }
        let sum: f64 = kinds.iter().map(|(_, weight)| weight).sum();
        let amplitude_e = self.most(|tails| tails.rts_e);
        let jumps_show = kinds.iter().map(|(hot, _)| {
            trap_share > 0.0 && self.at(&State { hot: *hot, trap: 0.0 }).jumps_show(expected_e, amplitude_e)
        });
        let jumps_show: Vec<bool> = jumps_show.collect();
        let of_hot =
            kinds.iter().zip(&jumps_show).skip(1).filter(|(_, show)| **show).map(|((_, weight), _)| weight / sum);
        let matter_if_hot = self.jumps_matter(expected_e, trap_share * of_hot.sum::<f64>());
        let variance = self.at(&State { hot: 0.0, trap: 0.0 }).moments(expected_e).moments.variance;
        let mut found = Vec::new();
        let mut foreseen = effort::Foreseen::of(kinds.len() - 1);
        // Most photosites first, then hot ones from all over, which tell early how much work all are.
        let order = std::iter::once(0).chain(effort::scattered(kinds.len() - 1).map(|index| index + 1));
        for index in order {
            let (hot, weight) = (kinds[index].0, kinds[index].1 / sum);
            if hot > 0.0 {
                foreseen.begin_next();
            }
            if effort::is_spent() {
                break;
            }
            let site = |trap: f64| match hot > 0.0 {
                true => self.at(&State { hot, trap }).if_few(hot_share),
                false if trap > 0.0 => self.at(&State { hot, trap }).if_few(trap_share),
                false => self.at(&State { hot, trap }),
            };
            let quiet = Self { is_rare: self.is_rare_if(hot, weight, variance), ..site(0.0) };
            let jumps_apart = (hot == 0.0 || matter_if_hot) && jumps_show[index];
            let is_free = trap_share > 0.0 && !jumps_apart;
            let share = if jumps_apart { 1.0 - trap_share } else { 1.0 };
            found.push(Kind { weight: weight * share, is_free, value: of(&quiet) });
            if !jumps_apart {
                continue;
            }
            let traps = match hot == 0.0 && wanted == Wanted::Moments {
                true => self.trap_nodes(expected_e, Wanted::Moments).unwrap_or_default(),
                false => FEW.as_slice().into(),
            };
            let all: f64 = traps.iter().map(|(_, weight)| weight).sum();
            let mut foreseen = effort::Foreseen::of(traps.len());
            for index in effort::scattered(traps.len()) {
                foreseen.begin_next();
                if effort::is_spent() {
                    break;
                }
                let (trap, of_trap) = traps[index];
                let weight = weight * trap_share * of_trap / all;
                found.push(Kind { weight, is_free: false, value: of(&site(trap)) });
            }
        }
        found
    }

    /// Whether jumps of this mean amplitude end with the codes, or show how these are rounded.
    fn jumps_show(&self, expected_e: f64, amplitude_e: f64) -> bool {
        let Some(adc) = self.adc else { return false };
        let [lower, upper] = [0.0, f64::from(adc.top_code())].map(|code| adc.electrons_at(code));
        self.frames(expected_e).any(|(model, light_e)| {
            let law = Law::of(model, light_e);
            let own = if law.reaches_full_well() { model.added() } else { blur_e(model, &adc, light_e) };
            let [low, high] = law.reach();
            let high = high.min(model.full_well_e + 9.0 * model.added());
            adc.adu_per_e * own < BLURRED || low - REACH * amplitude_e < lower || high + REACH * amplitude_e > upper
        })
    }

    /// Whether it matters how jumps of such a share of the photosites, which are hot too, are rounded or end: they add less than their share
    /// times the square of their mean amplitude to the variance that the others have, and a fourth of the amplitude to a mean.
    fn jumps_matter(&self, expected_e: f64, share: f64) -> bool {
        const NEGLIGIBLE: f64 = 2e-7;
        let amplitude = self.slope() * self.most(|tails| tails.rts_e);
        if share <= 0.0 {
            return false;
        }
        let others = self.at(&State { hot: 0.0, trap: 0.0 }).moments(expected_e).moments;
        let is_little = share * amplitude * amplitude <= NEGLIGIBLE * others.variance
            && 0.25 * share * amplitude <= NEGLIGIBLE * others.std();
        !is_little
    }

    /// Whether so few photosites have such an excess of dark current that how codes are rounded where they end does not show in a variance.
    ///
    /// 2 w d e^(−2π²σ²) ≤ 10⁻¹⁰ V        w their share, d how far off they are and σ what blurs them, in codes, V the variance of most
    fn is_rare_if(&self, hot: f64, weight: f64, variance: f64) -> bool {
        const NEGLIGIBLE: f64 = 1e-10;
        let Some(adc) = self.adc.filter(|_| hot > 0.0) else { return false };
        let [off, blur] = [hot * self.most(|tails| tails.hot_e), self.model.added()].map(|e| adc.adu_per_e * e);
        let ripple = libm::exp(-2.0 * (std::f64::consts::PI * blur).powi(2));
        2.0 * weight * (off + 1.0) * ripple <= NEGLIGIBLE * variance
    }

    /// Cumulants 2, 4 and 6 of what jumps add to samples, those of averages that came off included: given its amplitude a, what is
    /// drawn anew in a frame has a²/2, −a⁴/4 and a⁶/2.
    fn jump_cumulants(&self) -> [f64; 3] {
        let [rts_share, rts_e] = [self.most(|tails| tails.rts_share), self.most(|tails| tails.rts_e)];
        let mut given = if self.model.tails.has_rts() { [0.5, -0.25, 0.5] } else { [0.0; 3] };
        for dark in self.darks.iter().flatten().filter(|dark| dark.model.tails.has_rts()) {
            let frames = f64::from(dark.frames.max(1));
            given[0] += 0.5 * dark.weight.powi(2) / frames;
            given[1] -= 0.25 * dark.weight.powi(4) / frames.powi(3);
            given[2] += 0.5 * dark.weight.powi(6) / frames.powi(5);
        }
        let [second, fourth, sixth] = given;
        let square = (rts_e * self.slope()).powi(2);
        let m2 = rts_share * 2.0 * square * second;
        let m4 = rts_share * 24.0 * square.powi(2) * (fourth + 3.0 * second * second);
        let m6 = rts_share * 720.0 * square.powi(3) * (sixth + 15.0 * fourth * second + 15.0 * second.powi(3));
        [m2, m4 - 3.0 * m2 * m2, m6 - 15.0 * m4 * m2 + 30.0 * m2.powi(3)]
    }

    /// The frames that a sample follows from: their noise, and the light in them.
    pub(super) fn frames(&self, expected_e: f64) -> impl Iterator<Item = (&NoiseModel, f64)> {
        let darks = self.darks.iter().flatten().map(|dark| (&dark.model, 0.0));
        std::iter::once((&self.model, expected_e)).chain(darks)
    }

    /// What photosites of a line differ in, each of what a part of their noise leaves; for sums over the rest.
    pub(super) fn kinds_of_line(&self, expected_e: f64, part: impl Fn(&NoiseModel) -> NoiseModel) -> Kinds {
        let [hot_share, trap_share, trap_e] =
            [|tails: &Tails| tails.hot_share, |tails: &Tails| tails.rts_share, |tails: &Tails| tails.rts_e]
                .map(|of| self.most(of));
        let law = |hot: f64| {
            let site = self.at(&State { hot, trap: 0.0 });
            Law::of(&part(&if hot > 0.0 { site.if_few(hot_share) } else { site }.model), expected_e)
        };
        let of_share = |nodes: Option<Nodes>, share: f64| -> Vec<(f64, f64)> {
            let nodes = nodes.filter(|_| share > 0.0).unwrap_or_default();
            let sum: f64 = nodes.iter().map(|(_, weight)| weight).sum();
            nodes.iter().map(|(at, weight)| (share * weight / sum, *at)).collect()
        };
        // Where what all have of their own does not hide codes, amplitudes show how these are rounded.
        let is_coarse =
            self.adc.is_some_and(|adc| adc.adu_per_e * blur_e(&part(&self.model), &adc, expected_e) < BLURRED);
        let wanted = if is_coarse { Wanted::Moments } else { Wanted::Variances };
        let hot = self.hot_nodes(expected_e, wanted).or_else(|| self.hot_nodes(expected_e, Wanted::Variances));
        let hot = of_share(hot, hot_share);
        let jumps_show = trap_share > 0.0 && self.jumps_show(expected_e, trap_e);
        let jumps = self.trap_nodes(expected_e, wanted).or_else(|| self.trap_nodes(expected_e, Wanted::Variances));
        let jumps = of_share(jumps, if jumps_show { trap_share } else { 0.0 });
        Kinds {
            laws: std::iter::once((1.0 - hot_share, 0.0)).chain(hot).map(|(share, hot)| (share, law(hot))).collect(),
            jumps: jumps.into_iter().map(|(share, trap)| (share, trap_e * trap)).collect(),
        }
    }

    /// Moments of the samples of all kinds of photosites together.
    pub(super) fn mixed(&self, expected_e: f64) -> Prediction {
        self.mixture(expected_e).0
    }

    /// The same beside the variance of the means of the kinds.
    fn mixture(&self, expected_e: f64) -> (Prediction, f64) {
        thread_local! { static KNOWN: Memory<(Photosite, f64), (Prediction, f64)> = const { Memory::new() }; }
        KNOWN.with(|known| known.recall((*self, expected_e), |(site, expected_e)| site.work_out(*expected_e)))
    }

    /// No numbers where it takes too long.
    fn work_out(&self, expected_e: f64) -> (Prediction, f64) {
        let none = Prediction::of_cumulants(f64::NAN, f64::NAN, f64::NAN, f64::NAN);
        effort::within(MOST_WORK, || self.mixture_of_kinds(expected_e, Wanted::Moments)).unwrap_or((none, f64::NAN))
    }

    /// The variance of all together by few amplitudes, which tell it where the rounding of codes does not show; no number where it takes
    /// too long.
    pub(super) fn variance_by_few(&self, expected_e: f64) -> f64 {
        let variance = || self.mixture_of_kinds(expected_e, Wanted::Variances).0.moments.variance;
        effort::within(MOST_WORK, variance).unwrap_or(f64::NAN)
    }

    fn mixture_of_kinds(&self, expected_e: f64, wanted: Wanted) -> (Prediction, f64) {
        let [second, fourth, sixth] = self.jump_cumulants();
        let with_jumps = |kind: Kind<Prediction>| {
            let Kind { weight, is_free, value } = kind;
            if !is_free {
                return (weight, value);
            }
            let (variance, of_fourth) = (value.moments.variance + second, value.fourth() + fourth);
            let with = Prediction::of_cumulants(value.moments.mean, variance, value.third, of_fourth);
            (weight, Prediction { sixth: value.sixth + sixth, ..with })
        };
        let kinds = self.each_of(expected_e, wanted, |site| {
            // Sixth cumulant of −a, 0 or a.
            let trap = 0.5 * (site.slope() * site.model.tails.trap_e).powi(6);
            Prediction { sixth: trap, ..site.moments(expected_e) }
        });
        let parts: Vec<(f64, Prediction)> = kinds.into_iter().map(with_jumps).collect();
        let found = mixture(&parts);
        let of_means =
            parts.iter().map(|(weight, part)| weight * (part.moments.mean - found.moments.mean).powi(2)).sum();
        (found, of_means)
    }

    /// The mean over all kinds of photosites of a number that no rounding shows in, and that jumps do not change where they are free, to
    /// some 10⁻⁶ of what the hot ones have; no number where it takes too long.
    pub(super) fn mean_of(&self, expected_e: f64, of: impl Fn(&Self) -> f64) -> f64 {
        let mean = || self.each_of(expected_e, Wanted::Shares, of).iter().map(|kind| kind.weight * kind.value).sum();
        effort::within(MOST_WORK, mean).unwrap_or(f64::NAN)
    }

    /// The variance by cause: the mean over all kinds of photosites, and that of their means, which hot pixels make.
    ///
    /// Where hot photosites or jumps show how codes are rounded few of their amplitudes tell the causes; what all make of rounding is
    /// the rest. No numbers where it takes too long.
    pub(super) fn mixed_budget(&self, expected_e: f64) -> Budget {
        let [jumps, ..] = self.jump_cumulants();
        let (whole, of_means) = self.mixture(expected_e);
        if whole.moments.variance.is_nan() {
            return [f64::NAN; Cause::ALL.len()];
        }
        let kinds = || self.each_of(expected_e, Wanted::Variances, |site| site.budget(expected_e));
        let Some(kinds) = effort::within(MOST_WORK, kinds) else { return [f64::NAN; Cause::ALL.len()] };
        let mut budget =
            Cause::ALL.map(|cause| kinds.iter().map(|kind| kind.weight * kind.value[cause as usize]).sum::<f64>());
        let has_hot = self.models().any(|model| model.tails.has_hot());
        // Of jumps alone means differ as their codes are rounded or end.
        budget[if has_hot { Cause::HotPixels } else { Cause::ClippedPattern } as usize] += of_means;
        for kind in kinds.iter().filter(|kind| kind.is_free) {
            budget[Cause::Rts as usize] += kind.weight * jumps;
        }
        if self.adc.is_some() {
            budget[Cause::Quantization as usize] += whole.moments.variance - budget.iter().sum::<f64>();
        }
        budget
    }

    /// What is drawn anew in each exposure where the rounding of codes shows: its mean over photosites of all kinds.
    pub(super) fn mixed_temporal(&self, expected_e: f64) -> f64 {
        thread_local! { static KNOWN: Memory<(Photosite, f64), f64> = const { Memory::new() }; }
        KNOWN.with(|known| known.recall((*self, expected_e), |(site, expected_e)| site.temporal_of_kinds(*expected_e)))
    }

    fn temporal_of_kinds(&self, expected_e: f64) -> f64 {
        let [jumps, ..] = self.jump_cumulants();
        let drawn = |site: &Self| site.temporal_variance(expected_e, site.moments(expected_e).moments.variance);
        let kinds = effort::within(MOST_WORK, || self.each_of(expected_e, Wanted::Moments, drawn));
        let of_kind = |kind: &Kind<f64>| kind.weight * (kind.value + if kind.is_free { jumps } else { 0.0 });
        kinds.map_or(f64::NAN, |kinds| kinds.iter().map(of_kind).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hot pixels of millions of counts that nothing blurs: no numbers rather than minutes, and the same whatever was asked before.
    #[test]
    fn what_takes_too_long_is_no_number() {
        let tails = Tails { hot_share: 0.1, hot_e: 5e6, rts_share: 0.0, ..Tails::default() };
        let model = NoiseModel {
            dark_e: 300.0,
            dcnu: 0.01,
            prnu: 0.004,
            read_noise_e: 0.0,
            full_well_e: 4e5,
            dark_shot: true,
            signal_shot: true,
            poisson: crate::metadata::PoissonKind::Exact,
            lines: crate::stages::noise::LineNoise::default(),
            tails,
        };
        let site = Photosite::of_electrons(model, Equations::Exact);
        let spent = |allowed: u64| {
            let before = effort::left();
            let found = effort::within(allowed, || site.mixture_of_kinds(1.5, Wanted::Moments).0.moments.mean);
            (found.is_none(), before - effort::left())
        };
        let first = spent(20_000);
        assert_eq!(first, (true, 20_000));
        assert_eq!(spent(20_000), first);
        assert!(site.budget(1.5).iter().all(|variance| !variance.is_nan()) || site.causes(1.5).is_err());
    }
}
