//! Moments of a photosite of one class: in electrons, in ADU, less dark frames.

use super::charge::{charge, sensitivity};
use super::law::Law;
use super::masters::{Dark, Flat, MOST_DARKS};
use super::memory::Print;
use super::moments::{Equations, Prediction};
use super::pattern::{Seen, Shared};
use super::reading::{Reading, codes_of};
use crate::metadata::{AdcRecord, PoissonKind};
use crate::numerics::averages::Combine;
use crate::stages::noise::NoiseModel;

/// The standard deviation of a median, in codes, below which it shows how codes are rounded: what else rounding does to a mean is
/// less than e^(−2π²σ²)/π, 3·10⁻⁴ of a code.
const VISIBLE: f64 = 0.6;

/// Codes over which photosites scatter so that rounding is a uniform error of theirs.
const MANY_CODES: f64 = 2.5;

/// The standard deviation, in codes, of what is drawn anew in two frames beyond which their roundings have nothing in common:
/// e^(−2π²σ²) of the little that they have, 2·10⁻⁴.
const VISIBLE_IN_BOTH: f64 = 0.65;

/// Codes of an electron from which counts lie at few places in a code, so that they do not blur how codes are rounded.
const WHOLE_CODES: f64 = 0.5;

/// Skewness of what is drawn anew beyond which a median keeps another share than of normal samples.
pub(super) const SKEW: f64 = 0.15;

/// What a photosite's samples follow from, but for the light that reaches it.
///
/// # Examples
///
/// ```
/// use cyanometer::metadata::PoissonKind;
/// use cyanometer::propagation::{Equations, Photosite};
/// use cyanometer::stages::noise::{LineNoise, NoiseModel, Tails};
///
/// let model = NoiseModel {
///     dark_e: 0.0,
///     dcnu: 0.0,
///     prnu: 0.01,
///     read_noise_e: 10.0,
///     full_well_e: 40_000.0,
///     dark_shot: true,
///     signal_shot: true,
///     poisson: PoissonKind::Exact,
///     lines: LineNoise::default(),
///     tails: Tails::default(),
/// };
/// let variance = |equations| Photosite::of_electrons(model, equations).moments(10_000.0).moments.variance;
/// // Shot noise 10⁴, non-uniformity (10⁴ · 0.01)², read noise 10².
/// assert!((variance(Equations::Paper) - 20_100.0).abs() < 1e-6);
/// // Brighter photosites have more shot noise too: 10⁴ · 0.01² more, which the paper's Eq. 11 leaves out.
/// assert!((variance(Equations::Exact) - 20_101.0).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Photosite {
    /// The noise of its charge.
    pub model: NoiseModel,
    /// The converter that reads it; none where samples are electrons.
    pub adc: Option<AdcRecord>,
    /// Averages of dark frames that were subtracted from its codes.
    pub darks: [Option<Dark>; MOST_DARKS],
    /// The flat field by which it was divided.
    pub flat: Option<Flat>,
    /// Which equations to predict by.
    pub equations: Equations,
    /// Whether so few photosites are such that it does not matter where in a code full well lies.
    pub is_rare: bool,
}

impl Print for NoiseModel {
    fn print(&self, before: u64) -> u64 {
        [self.dark_e, self.dcnu, self.prnu, self.read_noise_e, self.tails.trap_e, self.tails.hot_share].print(before)
    }
}

impl Print for Photosite {
    fn print(&self, before: u64) -> u64 {
        let of_darks = |before: u64| self.darks.iter().flatten().fold(before, |before, dark| dark.model.print(before));
        of_darks((self.model, self.slope()).print(before))
    }
}

impl Photosite {
    /// A photosite in electrons.
    pub fn of_electrons(model: NoiseModel, equations: Equations) -> Self {
        Self { model, adc: None, darks: [None; MOST_DARKS], flat: None, equations, is_rare: false }
    }

    /// The same as the converter reads it.
    #[must_use]
    pub fn digitized(self, adc: AdcRecord) -> Self {
        Self { adc: Some(adc), ..self }
    }

    /// The same after the mean of so many dark frames was subtracted; before a converter there are none.
    #[must_use]
    pub fn less_dark_frames(self, dark_frames: u32) -> Self {
        let mut darks = [None; MOST_DARKS];
        darks[0] = (dark_frames > 0).then(|| Dark::mean_of(self.model, dark_frames));
        Self { darks, ..self }
    }

    /// The same after what `of` makes of the noise of each frame that its samples follow from.
    #[must_use]
    pub(super) fn with_models(&self, of: impl Fn(NoiseModel) -> NoiseModel) -> Self {
        let of_dark = |dark: Dark| Dark { model: of(dark.model), ..dark };
        let all = |darks: [Option<Dark>; MOST_DARKS]| darks.map(|dark| dark.map(of_dark));
        let flat = self.flat.map(|flat| Flat { frames: of_dark(flat.frames), darks: all(flat.darks), ..flat });
        Self { model: of(self.model), darks: all(self.darks), flat, ..*self }
    }

    /// Sum of the weights of the averages that were subtracted.
    pub(super) fn weight(&self) -> f64 {
        self.darks.iter().flatten().map(|dark| dark.weight).sum()
    }

    /// The signal electrons that a level above what no light reads stands for.
    pub(super) fn expected_at(&self, level: f64) -> f64 {
        match self.adc {
            None => level,
            Some(adc) if adc.is_bent() => {
                let black = adc.level_at(self.model.dark_e);
                adc.electrons_between(black, black + level)
            }
            Some(adc) => level / adc.adu_per_e,
        }
    }

    /// The same of a class, as the level of the flat field that divided its samples has it.
    pub(super) fn expected_of(&self, class: usize, level: f64) -> f64 {
        self.expected_at(level / self.flat.map_or(1.0, |flat| flat.ratios[class]))
    }

    /// Units of its samples to an electron; of codes that are not straight, where there are few.
    pub fn slope(&self) -> f64 {
        self.adc.map_or(1.0, |adc| adc.adu_per_e)
    }

    /// The level above black at full well.
    pub(super) fn largest(&self) -> f64 {
        let scale = self.flat.map_or(1.0, |flat| flat.ratios.into_iter().fold(1.0, f64::max));
        scale * self.model.full_well_e * self.slope()
    }

    /// Mean and variance of its samples over the photosites of a frame, before any division by a flat field.
    pub fn moments(&self, expected_e: f64) -> Prediction {
        if self.has_tails() {
            return self.mixed(expected_e);
        }
        match self.adc {
            None => self.electrons(expected_e),
            Some(adc) if self.darks[0].is_some() => self.less_dark(&adc, expected_e, true),
            Some(adc) => self.adu(&adc, expected_e),
        }
    }

    pub(super) fn electrons(&self, expected_e: f64) -> Prediction {
        let model = &self.model;
        let read = model.added().powi(2);
        match self.equations {
            Equations::Paper => {
                // Eq. 11 of [HP2005]; each source counts only where it is drawn.
                let shot = if model.signal_shot { expected_e } else { 0.0 };
                let dark_shot = if model.dark_shot { model.dark_e } else { 0.0 };
                let patterns = (model.dark_e * model.dcnu).powi(2) + (expected_e * model.prnu).powi(2);
                let variance = dark_shot + shot + patterns + read;
                Prediction::of_cumulants(model.dark_e + expected_e, variance, 0.0, 0.0)
            }
            Equations::Exact => {
                let law = Law::of(model, expected_e);
                if law.reaches_full_well() {
                    return law.predict(&law.of_electrons());
                }
                let charge = charge(model, expected_e);
                let jumps = model.tails.trap_variance();
                // Fourth cumulant of −a, 0 or a, a quarter, a half and a quarter: a⁴/2 − 3 (a²/2)².
                let fourth = charge.fourth - jumps * jumps;
                Prediction::of_cumulants(charge.mean, charge.variance + read + jumps, charge.third, fourth)
            }
        }
    }

    /// Exact: the moments of the rounded and clipped charge ([`Law`]), or, where codes are the charge, a uniform error and
    /// nothing else, with Sheppard's corrections, 1/12 to the variance and −1/120 to the fourth cumulant. The paper scales Eq. 11
    /// by the slope and takes the converter's noise as nil.
    pub(super) fn adu(&self, adc: &AdcRecord, expected_e: f64) -> Prediction {
        let law = Law::of(&self.model, expected_e);
        let is_paper = self.equations == Equations::Paper;
        if !is_paper && !law.is_plain(adc) {
            return law.predict(&self.reading(&law, adc));
        }
        let (before, slope) = (self.electrons(expected_e), adc.adu_per_e);
        let [of_variance, of_fourth] = if is_paper { [0.0; 2] } else { [1.0 / 12.0, -1.0 / 120.0] };
        Prediction::of_cumulants(
            adc.bias_adu + slope * before.moments.mean,
            before.moments.variance * slope * slope + of_variance,
            before.third * slope.powi(3),
            before.fourth() * slope.powi(4) + of_fourth,
        )
    }

    fn reading(&self, law: &Law, adc: &AdcRecord) -> Reading {
        let reading = law.of_codes(adc, codes_of(adc));
        if self.is_rare { reading.coarse() } else { reading }
    }

    /// After averages of dark frames of the same sensor were subtracted, each times its weight w:
    ///
    /// Var(y − Σ w d̄) = \[Var y − v] + Σ w² e \[Var d − v_d] + Var(E y − Σ w E d),
    ///
    /// v the variances of the means that each photosite has over exposures, and e what an average keeps of variance. The last
    /// term is that of what these means leave of each other: light and dark frames share the pattern of the dark current,
    /// and everything else is drawn anew. Where nothing is clipped it is that of light, and of the dose of dark current
    /// that is left.
    ///
    /// How codes are rounded counts where `shows_codes`; a level that is not known to a fraction of a code does not tell it. That of dark
    /// frames is known.
    pub(super) fn less_dark(&self, adc: &AdcRecord, expected_e: f64, shows_codes: bool) -> Prediction {
        let light = self.adu(adc, expected_e);
        let darks: Vec<(&Dark, Self)> = self.darks.iter().flatten().map(|dark| (dark, self.of_dark(dark))).collect();
        let (mut mean, mut third, mut fourth) = (light.moments.mean, light.third, light.fourth());
        let mut variance = light.moments.variance;
        let mut apart = variance;
        for (index, (dark, site)) in darks.iter().enumerate() {
            let code = site.adu(adc, 0.0);
            let median_of = site.visible_median(dark, adc);
            let is_fine = shows_codes && self.rounds_as(adc, expected_e, dark, site);
            let shared = self.shared(adc, (expected_e, None), (site, median_of.filter(|_| shows_codes)), is_fine);
            let weight = dark.weight;
            let own = if shows_codes {
                shared
            } else {
                site.shared(adc, (0.0, None), (site, median_of), site.rounds_as(adc, 0.0, dark, site))
            };
            let average = own.median.unwrap_or_else(|| dark.averaged(&code, own.dark, site.temporal_third(adc)));
            mean -= weight * average.moments.mean;
            third -= weight.powi(3) * average.third;
            fourth += weight.powi(4) * average.fourth();
            variance += weight * weight * average.moments.variance - 2.0 * weight * shared.both;
            apart += weight * weight * average.moments.variance;
            for (other, of_other) in &darks[..index] {
                let other_median = of_other.visible_median(other, adc).filter(|_| shows_codes);
                let is_fine = shows_codes && of_other.rounds_as(adc, 0.0, dark, site);
                let both = of_other.shared(adc, (0.0, other_median), (site, median_of), is_fine).both;
                variance += 2.0 * weight * other.weight * both;
            }
        }
        // What takes too long is no number.
        let variance = if variance.is_nan() { variance } else { variance.max(0.0) };
        // Patterns that cancel take what is flat in their law with them.
        let left = if fourth < 0.0 { (variance / apart).powi(2) } else { 1.0 };
        Prediction::of_cumulants(mean, variance, third, fourth * left)
    }

    /// Photosites of dark frames.
    pub(super) fn of_dark(&self, dark: &Dark) -> Self {
        Self { model: dark.model, darks: [None; MOST_DARKS], flat: None, ..*self }
    }

    /// Third cumulant of what is drawn anew in each dark frame at a photosite of mean sensitivity, ADU³.
    fn temporal_third(&self, adc: &AdcRecord) -> f64 {
        let is_counted = self.model.dark_shot && self.model.poisson == PoissonKind::Exact;
        if is_counted { self.model.dark_e * adc.adu_per_e.powi(3) } else { 0.0 }
    }

    /// How many dark frames a median is of that scatters over less than a code, and its photosites over few, or that an end of the codes cuts off.
    pub(super) fn visible_median(&self, dark: &Dark, adc: &AdcRecord) -> Option<u32> {
        let is_median = self.equations == Equations::Exact && dark.combine == Combine::Median && dark.frames > 2;
        // Few electrons are no normal law either.
        let variance = dark.std_codes(adc, 0.0).powi(2);
        let is_skewed = self.temporal_third(adc) > SKEW * variance.powf(1.5);
        let is_fine = || dark.std_codes(adc, 0.0) * dark.kept()[0].sqrt() < VISIBLE || is_skewed;
        let is_told = || is_fine() && adc.adu_per_e * self.dark_pattern().sqrt() < MANY_CODES;
        (is_median && (is_told() || self.is_cut(adc))).then_some(dark.frames)
    }

    /// Whether an end of the codes cuts off more than next to none of its dark frames, so that their medians and clipped means are not those of
    /// a normal law.
    pub(super) fn is_cut(&self, adc: &AdcRecord) -> bool {
        const NEXT_TO_NONE: f64 = 1e-5;
        let law = Law::of(&self.model, 0.0);
        let [lower, upper] = [0.5, f64::from(adc.top_code()) - 0.5].map(|edge| adc.electrons_at(edge));
        !law.is_nearly_within(adc)
            && (law.is_read_from(lower) < 1.0 - NEXT_TO_NONE || law.is_read_from(upper) > NEXT_TO_NONE)
    }

    /// Whether roundings of its codes and of those of dark frames have something in common: neither scatters over codes from
    /// exposure to exposure, nor does light from photosite to photosite.
    pub(super) fn rounds_as(&self, adc: &AdcRecord, expected_e: f64, dark: &Dark, of_dark: &Self) -> bool {
        // Whole electrons that are codes or more do not blur them: what does is read noise.
        let blur = |site: &Self, std_codes: f64| match adc.adu_per_e < WHOLE_CODES {
            true => std_codes,
            false => adc.adu_per_e * site.model.read_noise(),
        };
        let own = blur(self, Dark::mean_of(self.model, 1).std_codes(adc, expected_e));
        let light = adc.adu_per_e * self.pattern(self.model.response()).sqrt() * expected_e;
        self.equations == Equations::Exact
            && (of_dark.model.dark_e * of_dark.model.dcnu > 0.0 || of_dark.model.offsets() > 0.0)
            && own.hypot(blur(of_dark, dark.std_codes(adc, 0.0))) < VISIBLE_IN_BOTH
            && light < MANY_CODES / 2.0
    }

    /// What its codes, or medians of them, and those of dark frames have of the pattern; `is_fine` where it shows in the means of
    /// photosites how codes are rounded.
    pub(super) fn shared(
        &self,
        adc: &AdcRecord,
        (expected_e, median_of): (f64, Option<u32>),
        (dark, dark_median_of): (&Self, Option<u32>),
        is_fine: bool,
    ) -> Shared {
        let (law, of_dark) = (Law::of(&self.model, expected_e), Law::of(&dark.model, 0.0));
        let is_fine = is_fine || median_of.or(dark_median_of).is_some();
        let is_plain = law.is_plain(adc) && of_dark.is_plain(adc) && !is_fine;
        if self.equations == Equations::Paper || is_plain {
            let square = adc.adu_per_e * adc.adu_per_e;
            let [own, of_dark] = [self, dark].map(|site| site.dark_pattern() * square);
            let light = self.pattern(self.model.response()) * expected_e * expected_e * square;
            let shared = Shared { light: light + own, dark: of_dark, both: (own * of_dark).sqrt(), median: None };
            return self.with_offsets(shared, dark, [adc.adu_per_e; 2]);
        }
        let seen = |law: Law, median_of| Seen { law, reading: self.reading(&law, adc), median_of, is_fine };
        let shared = Shared::of(seen(law, median_of), seen(of_dark, dark_median_of));
        if self.model.offsets() == 0.0 && dark.model.offsets() == 0.0 {
            return shared;
        }
        let medians = [median_of, dark_median_of];
        if !(self.is_rare || self.model.tails.are_few)
            && let Some(exact) = self.shared_over_offsets(adc, [law, of_dark], (dark, medians), is_fine)
        {
            return exact;
        }
        // Of few, how codes are rounded does not matter, and what is added to full ones is read as to others.
        let slope = |law: &Law| match self.is_rare && !adc.is_bent() && law.is_read_within(adc) {
            true => adc.adu_per_e,
            false => law.mean_slope(adc),
        };
        self.with_offsets(shared, dark, [slope(&law), slope(&of_dark)])
    }

    /// The same with the fixed offsets of photosites, which codes follow with such slopes.
    fn with_offsets(&self, shared: Shared, dark: &Self, [slope, of_dark]: [f64; 2]) -> Shared {
        let (a, b) = (&self.model, &dark.model);
        Shared {
            light: shared.light + slope * slope * a.offsets().powi(2),
            dark: shared.dark + of_dark * of_dark * b.offsets().powi(2),
            both: shared.both + slope * of_dark * a.offsets_shared_with(b),
            ..shared
        }
    }

    /// Variance of the fixed pattern of the dark current, λ² c₂, in e².
    fn dark_pattern(&self) -> f64 {
        self.pattern(self.model.dcnu) * self.model.dark_e * self.model.dark_e
    }

    /// c₂, the variance of the sensitivities whose relative rms is `sigma`.
    pub(super) fn pattern(&self, sigma: f64) -> f64 {
        match self.equations {
            Equations::Exact => sensitivity(sigma).1,
            Equations::Paper => sigma * sigma,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::to_sample;
    use crate::numerics::normal::{self, NearlyNormal};
    use crate::propagation::budget::Cause;
    use crate::propagation::charge::product;
    use crate::stages::noise::{LineNoise, Tails};

    /// Probabilities of the counts of a Poisson variable.
    fn counts(rate: f64) -> Vec<(f64, f64)> {
        let mut found = vec![((-rate).exp(), 0.0)];
        while let Some(&(probability, count)) =
            found.last().filter(|(_, count)| *count < rate + 12.0 * rate.sqrt() + 40.0)
        {
            found.push((probability * rate / (count + 1.0), count + 1.0));
        }
        found
    }

    fn electrons(model: &NoiseModel, expected_e: f64, equations: Equations) -> Prediction {
        Photosite::of_electrons(*model, equations).moments(expected_e)
    }

    fn adu(model: &NoiseModel, adc: &AdcRecord, expected_e: f64, equations: Equations) -> Prediction {
        Photosite::of_electrons(*model, equations).digitized(*adc).moments(expected_e)
    }

    fn paper_model() -> NoiseModel {
        NoiseModel {
            dark_e: 73.2138,
            dcnu: 0.2,
            prnu: 0.008,
            read_noise_e: 0.0,
            full_well_e: 40_000.0,
            dark_shot: true,
            signal_shot: true,
            poisson: PoissonKind::Exact,
            lines: LineNoise::default(),
            tails: Tails::default(),
        }
    }

    /// Read noise alone, from 0.01 to 10 ADU at every twentieth of a code, near both rails and between: the codes'
    /// probabilities by Simpson's rule on the density, whose error is below (h/σ)⁴/180 · 3 ≈ 10⁻¹² for steps of σ/400.
    #[test]
    fn rounding_agrees_with_numerical_integration() {
        let slope = ADC.adu_per_e;
        for sigma in [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0, 1.4, 1.6, 3.0, 10.0] {
            for base in [-1.0, 0.0, 2000.0, 4094.0] {
                for twentieth in 0..20 {
                    // Charges without shot noise are single precision, as samples are.
                    let electrons_e = f64::from(to_sample((base + f64::from(twentieth) / 20.0 + 10.0) / slope));
                    let mean = slope * electrons_e - 10.0;
                    let model = NoiseModel {
                        dark_e: 0.0,
                        dcnu: 0.0,
                        prnu: 0.0,
                        read_noise_e: sigma / slope,
                        full_well_e: 1e9,
                        dark_shot: false,
                        signal_shot: false,
                        ..paper_model()
                    };
                    let adc = AdcRecord { bias_adu: -10.0, ..ADC };
                    let found = adu(&model, &adc, electrons_e, Equations::Exact).moments;
                    let (mut first, mut second) = (0.0, 0.0);
                    let steps = 9600;
                    let step = 24.0 / f64::from(steps);
                    let code = |z: f64| (mean + sigma * z).round().clamp(0.0, 4095.0);
                    // Between two jumps of the code the integrand is smooth: each stretch by itself.
                    let mut edges: Vec<f64> = vec![-12.0, 12.0];
                    let mut edge = (mean - 12.0 * sigma).floor() - 0.5;
                    while edge < mean + 12.0 * sigma + 1.0 {
                        edges.push(((edge - mean) / sigma).clamp(-12.0, 12.0));
                        edge += 1.0;
                    }
                    edges.sort_by(f64::total_cmp);
                    let center = mean.round();
                    for pair in edges.windows(2).filter(|pair| pair[1] > pair[0]) {
                        let halves = 2.0 * ((pair[1] - pair[0]) / step).ceil();
                        let h = (pair[1] - pair[0]) / halves;
                        let mut probability = 0.0;
                        let mut k = 0.0;
                        while k <= halves {
                            let weight = if k == 0.0 || k == halves { 1.0 } else { 2.0 + 2.0 * (k % 2.0) };
                            probability += weight * h / 3.0 * normal::density(pair[0] + k * h);
                            k += 1.0;
                        }
                        let offset = code(f64::midpoint(pair[0], pair[1])) - center;
                        first += probability * offset;
                        second += probability * offset * offset;
                    }
                    let variance = second - first * first;
                    assert!((found.mean - center - first).abs() < 1e-9, "{sigma} {mean}: {}", found.mean);
                    assert!((found.variance - variance).abs() < 1e-9, "{sigma} {mean}: {}", found.variance - variance);
                }
            }
        }
    }

    /// Causes add up to the variance, whatever clips or rounds it.
    #[test]
    fn causes_add_up() {
        let quiet = NoiseModel { dark_e: 0.0, read_noise_e: 0.3, ..paper_model() };
        let loud = NoiseModel { read_noise_e: 15.7, ..paper_model() };
        for model in [quiet, loud] {
            for electrons_e in [0.0, 3.0, 500.0, 20_000.0, 39_800.0, 41_000.0] {
                for equations in [Equations::Exact, Equations::Paper] {
                    let found: f64 = Photosite::of_electrons(model, equations).budget(electrons_e).iter().sum();
                    let whole = electrons(&model, electrons_e, equations).moments.variance;
                    assert!((found - whole).abs() <= 1e-9 * whole, "{electrons_e}: {found} {whole}");
                    let found: f64 =
                        Photosite::of_electrons(model, equations).digitized(ADC).budget(electrons_e).iter().sum();
                    let whole = adu(&model, &ADC, electrons_e, equations).moments.variance;
                    assert!((found - whole).abs() <= 1e-9 * whole + 1e-12, "{electrons_e} ADU: {found} {whole}");
                }
            }
        }
        let rounding = Photosite::of_electrons(loud, Equations::Exact).digitized(ADC).budget(20_000.0)
            [Cause::Quantization as usize];
        assert!((rounding - 1.0 / 12.0).abs() < 1e-6);
        let cross = Photosite::of_electrons(loud, Equations::Exact).budget(0.0)[Cause::ShotTimesPattern as usize];
        assert!((cross - 73.2138 * 0.04).abs() < 1e-4);
    }

    const ADC: AdcRecord = AdcRecord::new(12, 1753.0, 0.058824);

    /// MODEL's figures, from the paper's constants: 16.96 by Eq. 11, 17.05 with the cross term; with 15.7 e⁻ of read
    /// noise 23.2, not the 23.0 of Table 1.
    #[test]
    fn the_dark_floor_is_17_05_and_the_papers_16_96() {
        let floor = |model: &NoiseModel, equations| electrons(model, 0.0, equations).moments.std();
        assert!((floor(&paper_model(), Equations::Exact) - 17.05).abs() < 0.005);
        assert!((floor(&paper_model(), Equations::Paper) - 16.96).abs() < 0.005);
        let with_read = NoiseModel { read_noise_e: 15.7, ..paper_model() };
        assert!((floor(&with_read, Equations::Exact) - 23.2).abs() < 0.05);
    }

    /// Cumulants of the product against sums over all counts and a fine grid of sensitivities.
    #[test]
    fn cumulants_of_the_product_agree_with_summation() {
        for (rate, sigma) in [(3.0, 0.2), (40.0, 0.05), (10.0, 0.8)] {
            let mut raw = [0.0; 5];
            let step = 16.0 / 4000.0;
            for i in 0..=4000 {
                let z = -8.0 + step * f64::from(i);
                let x = (1.0 + sigma * z).max(0.0);
                for (p, count) in counts(rate) {
                    for (k, sum) in raw.iter_mut().enumerate() {
                        *sum += step * normal::density(z) * p * (count * x).powi(i32::try_from(k).unwrap());
                    }
                }
            }
            let [_, m1, m2, m3, m4] = raw.map(|sum| sum / raw[0]);
            let v = m2 - m1 * m1;
            let third = m3 - 3.0 * m1 * m2 + 2.0 * m1.powi(3);
            let fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4) - 3.0 * v * v;
            let found = product(rate, true, PoissonKind::Exact, sigma);
            // The kink of the rectified normal at zero costs the sum about step² ≈ 10⁻⁵.
            for (a, b) in [(found.mean, m1), (found.variance, v), (found.third, third), (found.fourth, fourth)] {
                assert!((a / b - 1.0).abs() < 1e-4, "{rate} {sigma}: {a} {b}");
            }
        }
    }

    #[test]
    fn rounding_adds_a_twelfth_in_the_middle_of_the_range() {
        let model = NoiseModel { read_noise_e: 15.7, ..paper_model() };
        let before = electrons(&model, 10_000.0, Equations::Exact).moments;
        let after = adu(&model, &ADC, 10_000.0, Equations::Exact).moments;
        assert!((after.variance - before.variance * 0.058824f64.powi(2) - 1.0 / 12.0).abs() < 1e-6);
        assert!((after.mean - 1753.0 - 0.058824 * before.mean).abs() < 1e-6);
    }

    /// A few electrons without read noise, digitized at 17 e⁻ per code: the sum over counts by hand.
    #[test]
    fn few_electrons_are_counted_one_by_one() {
        let model = NoiseModel { dark_e: 0.0, prnu: 0.0, ..paper_model() };
        let found = adu(&model, &ADC, 5.0, Equations::Exact).moments;
        let codes: Vec<(f64, f64)> = counts(5.0).iter().map(|&(p, n)| (p, (1753.0 + 0.058824 * n).round())).collect();
        let mean: f64 = codes.iter().map(|(p, code)| p * code).sum();
        let variance: f64 = codes.iter().map(|(p, code)| p * (code - mean).powi(2)).sum();
        assert!((found.mean - mean).abs() < 1e-9 && (found.variance - variance).abs() < 1e-9);
    }

    /// Full well and the top code, in front of which the spread shrinks: against a sum over the counts.
    #[test]
    fn clipping_at_full_well_and_at_the_top_code() {
        let model = NoiseModel { dark_e: 0.0, read_noise_e: 15.7, ..paper_model() };
        for expected in [39_500.0, 40_000.0] {
            let reference = electrons(&model, expected, Equations::Exact).moments;
            // Condition on the count, exactly normal then: P·X ~ N(n, (n s)²), clipped; and on nothing else.
            let (mut m1, mut m2, mut total) = (0.0, 0.0, 0.0);
            let spread = expected.sqrt();
            let mut n = (expected - 9.0 * spread).floor();
            while n < expected + 9.0 * spread {
                let log_p = n * expected.ln() - expected - libm::lgamma(n + 1.0);
                let given = NearlyNormal::normal(n, (n * model.prnu).powi(2)).clipped_above(model.full_well_e);
                m1 += log_p.exp() * given.mean;
                m2 += log_p.exp() * (given.variance + (given.mean - expected).powi(2));
                total += log_p.exp();
                n += 1.0;
            }
            let mean = m1 / total;
            let variance = m2 / total - (mean - expected).powi(2) + 15.7 * 15.7;
            // lgamma at 4·10⁵ is good to 10⁻¹⁰ relative to the probabilities; Edgeworth to skewness³ ≈ 10⁻⁶.
            assert!((reference.mean - mean).abs() < 1e-2, "{} {mean}", reference.mean);
            assert!((reference.std() / variance.sqrt() - 1.0).abs() < 1e-4, "{} {}", reference.std(), variance.sqrt());
        }
        let codes = adu(&model, &ADC, 40_000.0, Equations::Exact).moments;
        assert!(codes.mean < 4095.0 && codes.mean > 4070.0 && codes.variance > 0.0);
    }
}
