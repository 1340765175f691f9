//! Moments of one class of photosites, in electrons and in ADU.

use super::{Equations, Prediction};
use crate::metadata::{AdcRecord, PoissonKind};
use crate::noise::{NoiseModel, rectified_mean, rectified_mean_square};
use crate::numerics::normal::{self, MeanVariance, NearlyNormal};
use serde::Serialize;

/// Central moments 2, 3 and 4 of a photosite's sensitivity max(0, N), N normal with mean 1 and standard deviation σ.
fn sensitivity(sigma: f64) -> (f64, f64, f64, f64) {
    let variance = sigma * sigma;
    // Below σ = 1/9 a draw under zero has a probability of 10⁻¹⁹: the normal's own moments are exact to rounding.
    if sigma < 1.0 / 9.0 {
        return (1.0, variance, 0.0, 3.0 * variance * variance);
    }
    // Raw moments over the positive half: M_k = M_{k−1} + (k − 1) σ² M_{k−2}.
    let (m1, m2) = (rectified_mean(sigma), rectified_mean_square(sigma));
    let m3 = m2 + 2.0 * variance * m1;
    let m4 = m3 + 3.0 * variance * m2;
    let c2 = m2 - m1 * m1;
    let c3 = m3 - 3.0 * m1 * m2 + 2.0 * m1.powi(3);
    let c4 = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4);
    (m1, c2, c3, c4)
}

/// Cumulants of the product of a count P of mean λ and an independent sensitivity X.
///
/// With δ = P − λ and X = μ + ε the product is λμ + μδ + εP; hence κ₂ = μ²λ + c₂(λ² + λ), the cross term λ c₂ of
/// which Eqs. 11 and 24–26 of \[HP2005] drop, and κ₃, κ₄ below. The third and fourth cumulant of P are λ for a Poisson
/// count, 0 for its Gaussian substitute; without shot noise P = λ.
fn product(rate: f64, shot: bool, kind: PoissonKind, sigma: f64) -> NearlyNormal {
    let (mu, c2, c3, c4) = sensitivity(sigma);
    let l = rate;
    if !shot {
        return NearlyNormal {
            mean: l * mu,
            variance: l * l * c2,
            third: l.powi(3) * c3,
            fourth: l.powi(4) * (c4 - 3.0 * c2 * c2),
        };
    }
    let k = if kind == PoissonKind::Exact { l } else { 0.0 };
    let cube = l.powi(3) + 3.0 * l * l + k;
    let fourth_power = l.powi(4) + 6.0 * l.powi(3) + 4.0 * l * k + k + 3.0 * l * l;
    NearlyNormal {
        mean: l * mu,
        variance: mu * mu * l + c2 * (l * l + l),
        third: mu.powi(3) * k + 3.0 * mu * c2 * (2.0 * l * l + k) + c3 * cube,
        fourth: mu.powi(4) * k
            + 6.0 * mu * mu * c2 * (2.0 * l * k + k + 2.0 * l * l)
            + 4.0 * mu * c3 * (3.0 * l.powi(3) + 3.0 * l * k + k + 3.0 * l * l)
            + (c4 - 3.0 * c2 * c2) * fourth_power
            + 3.0 * c2 * c2 * (4.0 * l.powi(3) + 4.0 * l * k + k + 2.0 * l * l),
    }
}

/// Cumulants of a photosite's charge, light and dark together, before full well and read-out.
pub(super) fn charge(model: &NoiseModel, expected_e: f64) -> NearlyNormal {
    let light = product(expected_e, model.signal_shot, model.poisson, model.prnu);
    light.plus(product(model.dark_e, model.dark_shot, model.poisson, model.dcnu))
}

/// The moments of one class of photosites in electrons.
pub fn electrons(model: &NoiseModel, expected_e: f64, equations: Equations) -> Prediction {
    let read = model.read_noise_e.powi(2);
    match equations {
        Equations::Paper => {
            // Eq. 11 of [HP2005]; each source counts only where it is drawn.
            let shot = if model.signal_shot { expected_e } else { 0.0 };
            let dark_shot = if model.dark_shot { model.dark_e } else { 0.0 };
            let patterns = (model.dark_e * model.dcnu).powi(2) + (expected_e * model.prnu).powi(2);
            let variance = dark_shot + shot + patterns + read;
            Prediction { moments: MeanVariance { mean: model.dark_e + expected_e, variance }, excess_kurtosis: 0.0 }
        }
        Equations::Exact => {
            let charge = charge(model, expected_e);
            let clipped = charge.clipped_above(model.full_well_e);
            let variance = clipped.variance + read;
            let fourth = charge.fourth_clipped_above(model.full_well_e);
            let excess_kurtosis = if variance > 0.0 { fourth / variance.powi(2) } else { 0.0 };
            Prediction { moments: MeanVariance { mean: clipped.mean, variance }, excess_kurtosis }
        }
    }
}

/// The moments of one class of photosites in ADU.
///
/// Exact: first and second moments of the rounded and clipped charge, from spread 0 up and at both rails. The paper
/// scales Eq. 11 by the slope and takes the converter's noise as nil.
pub fn adu(model: &NoiseModel, adc: &AdcRecord, expected_e: f64, equations: Equations) -> Prediction {
    if equations == Equations::Paper {
        let before = electrons(model, expected_e, equations);
        let MeanVariance { mean, variance } = before.moments;
        let moments =
            MeanVariance { mean: adc.bias_adu + adc.adu_per_e * mean, variance: variance * adc.adu_per_e.powi(2) };
        return Prediction { moments, ..before };
    }
    let tail = Tail::of(model, adc, expected_e);
    let before = electrons(model, expected_e, equations);
    let mean = adc.bias_adu + adc.adu_per_e * before.moments.mean;
    let sigma = adc.adu_per_e * before.moments.std();
    let (moments, fourth) = match &tail {
        Tail::Whole(whole) if is_smooth(mean, sigma, adc) => {
            let fourth = whole.fourth * adc.adu_per_e.powi(4) - 1.0 / 120.0;
            (MeanVariance { mean, variance: sigma * sigma + 1.0 / 12.0 }, fourth)
        }
        _ => normal::rounded(mean, sigma, adc.top_code(), |edge| tail.exceeds(adc.electrons_at(edge))),
    };
    let excess_kurtosis = if moments.variance > 0.0 { fourth / moments.variance.powi(2) } else { 0.0 };
    Prediction { moments, excess_kurtosis }
}

/// Whether rounding adds 1/12 to the variance and −1/120 to the fourth cumulant, Sheppard's corrections, and no more:
/// what else it does is below e^(−2π²σ²), 4·10⁻¹⁴ at σ = 1.25 codes, away from both ends of the range by 9 σ.
fn is_smooth(mean: f64, sigma: f64, adc: &AdcRecord) -> bool {
    sigma >= 1.25 && mean > 9.0 * sigma && mean + 9.0 * sigma < f64::from(adc.top_code())
}

/// A cause of variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Shot noise of the light.
    SignalShot,
    /// Photo-response non-uniformity, a fixed pattern.
    Prnu,
    /// Shot noise of the dark signal.
    DarkShot,
    /// Dark-current non-uniformity, a fixed pattern.
    Dcnu,
    /// Shot noise as the patterns scale it, the cross terms λ s² that Eq. 11 of \[HP2005] drops.
    ShotTimesPattern,
    /// Read noise.
    Read,
    /// Full well, which takes from the variance.
    FullWell,
    /// Rounding to whole codes.
    Quantization,
    /// The ends of the range of codes, which take from the variance.
    Rails,
}

impl Cause {
    /// All causes, in the order in which they act.
    pub const ALL: [Self; 9] = [
        Self::SignalShot,
        Self::Prnu,
        Self::DarkShot,
        Self::Dcnu,
        Self::ShotTimesPattern,
        Self::Read,
        Self::FullWell,
        Self::Quantization,
        Self::Rails,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::SignalShot => "signal_shot",
            Self::Prnu => "prnu",
            Self::DarkShot => "dark_shot",
            Self::Dcnu => "dcnu",
            Self::ShotTimesPattern => "shot_times_pattern",
            Self::Read => "read",
            Self::FullWell => "full_well",
            Self::Quantization => "quantization",
            Self::Rails => "rails",
        }
    }

    /// Whether it is the same in every exposure of one sensor.
    pub fn is_fixed_pattern(self) -> bool {
        matches!(self, Self::Prnu | Self::Dcnu)
    }
}

/// The moments of one class after the mean of `frames` dark frames of the same sensor was subtracted.
///
/// Var(y − d̄) = \[Var y − v] + \[Var d − v]/n,  v = K² λ² c₂
///
/// since light and dark frames share the pattern of the dark current, whose variance is v; everything else is drawn
/// anew. Rounding errors count as independent, which they are when noise covers a code.
pub fn less_dark(
    model: &NoiseModel,
    adc: &AdcRecord,
    expected_e: f64,
    frames: u32,
    equations: Equations,
) -> Prediction {
    let (light, dark) = (adu(model, adc, expected_e, equations), adu(model, adc, 0.0, equations));
    let shared = budget(model, Some(adc), 0.0, equations)[Cause::Dcnu as usize];
    let n = f64::from(frames);
    let variance = light.moments.variance - shared + (dark.moments.variance - shared) / n;
    let fourth = |prediction: Prediction| prediction.excess_kurtosis * prediction.moments.variance.powi(2);
    let excess_kurtosis =
        if variance > 0.0 { (fourth(light) + fourth(dark) / n.powi(3)) / variance.powi(2) } else { 0.0 };
    Prediction { moments: MeanVariance { mean: light.moments.mean - dark.moments.mean, variance }, excess_kurtosis }
}

/// The variance of one class in ADU² by cause, after the mean of `frames` dark frames was subtracted.
pub fn budget_less_dark(
    model: &NoiseModel,
    adc: &AdcRecord,
    expected_e: f64,
    frames: u32,
    equations: Equations,
) -> Budget {
    let light = budget(model, Some(adc), expected_e, equations);
    let dark = budget(model, Some(adc), 0.0, equations);
    Cause::ALL.map(|cause| match cause {
        Cause::Dcnu => 0.0,
        _ => light[cause as usize] + dark[cause as usize] / f64::from(frames),
    })
}

/// Variances by cause, in the order of [`Cause::ALL`]; they add up to the whole variance.
pub type Budget = [f64; Cause::ALL.len()];

/// The variance of one class in e² by cause; with `adc`, in ADU².
pub fn budget(model: &NoiseModel, adc: Option<&AdcRecord>, expected_e: f64, equations: Equations) -> Budget {
    let slope = adc.map_or(1.0, |adc| adc.adu_per_e);
    let exact = equations == Equations::Exact;
    let product = |rate: f64, shot: bool, sigma: f64| {
        let (mu, c2, _, _) = if exact { sensitivity(sigma) } else { (1.0, sigma * sigma, 0.0, 0.0) };
        let shot = if shot { rate } else { 0.0 };
        [mu * mu * shot, c2 * rate * rate, if exact { c2 * shot } else { 0.0 }]
    };
    let light = product(expected_e, model.signal_shot, model.prnu);
    let dark = product(model.dark_e, model.dark_shot, model.dcnu);
    let mut budget = [0.0; Cause::ALL.len()];
    let mut set = |cause: Cause, variance: f64| budget[cause as usize] = variance;
    set(Cause::SignalShot, light[0]);
    set(Cause::Prnu, light[1]);
    set(Cause::DarkShot, dark[0]);
    set(Cause::Dcnu, dark[1]);
    set(Cause::ShotTimesPattern, light[2] + dark[2]);
    set(Cause::Read, model.read_noise_e.powi(2));
    let electrons = electrons(model, expected_e, equations).moments;
    let unclipped: f64 = budget.iter().sum();
    // Below rounding nothing is clipped.
    let clipped = electrons.variance - unclipped;
    budget[Cause::FullWell as usize] = if exact && clipped.abs() > 1e-12 * unclipped { clipped } else { 0.0 };
    let mut budget = budget.map(|variance| variance * slope * slope);
    if let Some(adc) = adc.filter(|_| exact) {
        let tail = Tail::of(model, adc, expected_e);
        let mean = adc.bias_adu + slope * electrons.mean;
        let sigma = slope * electrons.std();
        // Codes without ends: moved up by whole codes until the lowest is far away, with as many more above.
        let up = (9.0 * sigma + 2.0 - mean).max(0.0).ceil();
        let top = mean + up + 9.0 * sigma + 2.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and `as` saturates")]
        let top = top as u32;
        let whole = adu(model, adc, expected_e, equations).moments.variance;
        let within = mean > 9.0 * sigma + 1.0 && mean + 9.0 * sigma + 1.0 < f64::from(adc.top_code());
        let endless = if within {
            whole
        } else {
            normal::rounded(mean + up, sigma, top, |edge| tail.exceeds(adc.electrons_at(edge - up))).0.variance
        };
        budget[Cause::Quantization as usize] = endless - electrons.variance * slope * slope;
        budget[Cause::Rails as usize] = whole - endless;
    }
    budget
}

impl AdcRecord {
    /// The charge that a level stands for, in e⁻.
    fn electrons_at(&self, level_adu: f64) -> f64 {
        (level_adu - self.bias_adu) / self.adu_per_e
    }
}

/// The distribution of a photosite's charge and read noise, as far as rounding asks for it.
enum Tail {
    /// Few electrons: counts are gone through one by one.
    Lattice(Lattice),
    /// Full well is within reach.
    Clipped(ClippedAndRead),
    /// Neither.
    Whole(NearlyNormal),
}

impl Tail {
    fn of(model: &NoiseModel, adc: &AdcRecord, expected_e: f64) -> Self {
        let charge = charge(model, expected_e);
        if let Some(lattice) = Lattice::of(model, adc, expected_e) {
            Self::Lattice(lattice)
        } else if charge.exceeds(model.full_well_e) > 1e-12 {
            Self::Clipped(ClippedAndRead { charge, full_well_e: model.full_well_e, read_noise_e: model.read_noise_e })
        } else {
            Self::Whole(charge.plus(NearlyNormal::normal(0.0, model.read_noise_e.powi(2))))
        }
    }

    /// P(charge and read noise > t), t in e⁻.
    fn exceeds(&self, t: f64) -> f64 {
        match self {
            Self::Lattice(lattice) => lattice.exceeds(t),
            Self::Clipped(clipped) => clipped.exceeds(t),
            Self::Whole(whole) => whole.exceeds(t),
        }
    }
}

/// A charge that is clipped at full well before read noise is added.
struct ClippedAndRead {
    charge: NearlyNormal,
    full_well_e: f64,
    read_noise_e: f64,
}

impl ClippedAndRead {
    /// P(min(Q, F) + R > t) = ∫ φ_R(r) [t − r < F] P(Q > t − r) dr, over r from t − F upward.
    fn exceeds(&self, t: f64) -> f64 {
        let sigma = self.read_noise_e;
        if sigma <= 0.0 {
            return if t < self.full_well_e { self.charge.exceeds(t) } else { 0.0 };
        }
        let from = ((t - self.full_well_e) / sigma).max(-9.0);
        if from >= 9.0 {
            return 0.0;
        }
        // Simpson's rule in steps below σ/10 on a smooth function: error below 10⁻⁸.
        let intervals = 200;
        let step = (9.0 - from) / f64::from(intervals);
        let value = |i: i32| {
            let z = from + step * f64::from(i);
            normal::density(z) * self.charge.exceeds(t - z * sigma)
        };
        let weight = |i: i32| if i == 0 || i == intervals { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
        (0..=intervals).map(|i| weight(i) * value(i)).sum::<f64>() * step / 3.0
    }
}

/// Few electrons and little read noise: counts are a lattice that codes can resolve, so every pair of counts of light
/// and dark is summed over, each with the normal spread that sensitivities and read-out give it.
struct Lattice {
    /// Probability, mean and standard deviation of each pair, in e⁻.
    pairs: Vec<(f64, f64, f64)>,
}

impl Lattice {
    /// The lattice, where it matters: the read noise is below ¾ of a code (above it, what the lattice adds to the
    /// moments is below e^(−2π²·0.75²) ≈ 10⁻⁵) and counts are below 200 on average.
    fn of(model: &NoiseModel, adc: &AdcRecord, expected_e: f64) -> Option<Self> {
        let resolved = model.read_noise_e * adc.adu_per_e < 0.75;
        let few = expected_e + model.dark_e < 200.0 && expected_e + model.dark_e < model.full_well_e / 4.0;
        if !(resolved && few) || model.poisson == PoissonKind::Gaussian {
            return None;
        }
        let light = counts(expected_e, model.signal_shot);
        let dark = counts(model.dark_e, model.dark_shot);
        let pair = |&(p, a): &(f64, f64), &(q, b): &(f64, f64)| {
            let variance = (a * model.prnu).powi(2) + (b * model.dcnu).powi(2) + model.read_noise_e.powi(2);
            (p * q, a + b, variance.sqrt())
        };
        let pairs = light.iter().flat_map(|a| dark.iter().map(move |b| pair(a, b))).filter(|p| p.0 > 1e-14).collect();
        Some(Self { pairs })
    }

    fn exceeds(&self, t: f64) -> f64 {
        let tail = |&(probability, mean, sigma): &(f64, f64, f64)| {
            probability * NearlyNormal::normal(mean, sigma * sigma).exceeds(t)
        };
        self.pairs.iter().map(tail).sum()
    }
}

/// Probabilities of the counts of a Poisson variable that are not negligible; one certain count without shot noise.
fn counts(rate: f64, shot: bool) -> Vec<(f64, f64)> {
    if !shot || rate <= 0.0 {
        return vec![(1.0, rate)];
    }
    let mut probability = (-rate).exp();
    let mut found = Vec::new();
    let mut count = 0.0;
    while count < rate + 12.0 * rate.sqrt() + 40.0 {
        if probability > 1e-16 {
            found.push((probability, count));
        }
        count += 1.0;
        probability *= rate / count;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

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
                    let mean = base + f64::from(twentieth) / 20.0;
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
                    let found = adu(&model, &adc, (mean + 10.0) / slope, Equations::Exact).moments;
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
                    let centre = mean.round();
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
                        let offset = code(f64::midpoint(pair[0], pair[1])) - centre;
                        first += probability * offset;
                        second += probability * offset * offset;
                    }
                    let variance = second - first * first;
                    assert!((found.mean - centre - first).abs() < 1e-9, "{sigma} {mean}: {}", found.mean);
                    assert!((found.variance - variance).abs() < 1e-9, "{sigma} {mean}: {}", found.variance - variance);
                }
            }
        }
    }

    /// Sheppard's corrections and the sum over codes are the same where the former are used.
    #[test]
    fn smooth_rounding_is_the_sum_over_codes() {
        let model = NoiseModel { read_noise_e: 15.7, ..paper_model() };
        for electrons_e in [0.0, 10.0, 400.0, 500.5, 3000.0, 30_000.0] {
            let found = adu(&model, &ADC, electrons_e, Equations::Exact);
            let charge = electrons(&model, electrons_e, Equations::Exact).moments;
            let (mean, sigma) = (ADC.bias_adu + ADC.adu_per_e * charge.mean, ADC.adu_per_e * charge.std());
            assert!(is_smooth(mean, sigma, &ADC), "{electrons_e}");
            let tail = Tail::of(&model, &ADC, electrons_e);
            let (sum, fourth) = normal::rounded(mean, sigma, 4095, |edge| tail.exceeds(ADC.electrons_at(edge)));
            assert!((found.moments.mean - sum.mean).abs() < 1e-9, "{electrons_e}");
            assert!((found.moments.variance - sum.variance).abs() < 1e-9 * sum.variance, "{electrons_e}");
            let kurtosis = fourth / sum.variance.powi(2);
            assert!((found.excess_kurtosis - kurtosis).abs() < 1e-6, "{} {kurtosis}", found.excess_kurtosis);
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
                    let found: f64 = budget(&model, None, electrons_e, equations).iter().sum();
                    let whole = electrons(&model, electrons_e, equations).moments.variance;
                    assert!((found - whole).abs() <= 1e-9 * whole, "{electrons_e}: {found} {whole}");
                    let found: f64 = budget(&model, Some(&ADC), electrons_e, equations).iter().sum();
                    let whole = adu(&model, &ADC, electrons_e, equations).moments.variance;
                    assert!((found - whole).abs() <= 1e-9 * whole + 1e-12, "{electrons_e} ADU: {found} {whole}");
                }
            }
        }
        let rounding = budget(&loud, Some(&ADC), 20_000.0, Equations::Exact)[Cause::Quantization as usize];
        assert!((rounding - 1.0 / 12.0).abs() < 1e-6);
        let cross = budget(&loud, None, 0.0, Equations::Exact)[Cause::ShotTimesPattern as usize];
        assert!((cross - 73.2138 * 0.04).abs() < 1e-4);
    }

    const ADC: AdcRecord = AdcRecord { bits: 12, bias_adu: 1753.0, adu_per_e: 0.058824 };

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
                for (p, count) in counts(rate, true) {
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
        let codes: Vec<(f64, f64)> =
            counts(5.0, true).iter().map(|&(p, n)| (p, (1753.0 + 0.058824 * n).round())).collect();
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
