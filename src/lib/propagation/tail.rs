//! The distribution of a photosite's charge and read noise, as far as rounding to codes asks for it.

use super::charge::charge;
use crate::metadata::{AdcRecord, PoissonKind};
use crate::numerics::normal::{self, NearlyNormal};
use crate::stages::noise::NoiseModel;

impl AdcRecord {
    /// The charge that a level stands for, in e⁻.
    pub(super) fn electrons_at(&self, level_adu: f64) -> f64 {
        (level_adu - self.bias_adu) / self.adu_per_e
    }
}

/// The distribution of a photosite's charge and read noise, as far as rounding asks for it.
pub(super) enum Tail {
    /// Few electrons: counts are gone through one by one.
    Lattice(Lattice),
    /// Full well is within reach.
    Clipped(ClippedAndRead),
    /// Neither.
    Whole(NearlyNormal),
}

impl Tail {
    pub(super) fn of(model: &NoiseModel, adc: &AdcRecord, expected_e: f64) -> Self {
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
    pub(super) fn exceeds(&self, t: f64) -> f64 {
        match self {
            Self::Lattice(lattice) => lattice.exceeds(t),
            Self::Clipped(clipped) => clipped.exceeds(t),
            Self::Whole(whole) => whole.exceeds(t),
        }
    }
}

/// A charge that is clipped at full well before read noise is added.
pub(super) struct ClippedAndRead {
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
pub(super) struct Lattice {
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
pub(super) fn counts(rate: f64, shot: bool) -> Vec<(f64, f64)> {
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
