//! Sums of what is left of codes over the flat field that divides them, A/F, over photosites.

use super::charge::sensitivities;
use super::curved::NODES;
use super::moments::Prediction;

/// Sums of A/F over photosites.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quotients {
    pub weight: f64,
    /// Of E\[A/F], E\[(A/F)²], E F, κ₃(A/F), E A and E F².
    sums: [f64; 6],
    /// The share that is left out.
    pub left_out: f64,
    /// What the series may leave out of the variance at few photosites that are noisier than its limit.
    pub lost: f64,
    /// Of the variance that the noise of the flat field gives to that of samples.
    pub of_flat_noise: f64,
    /// Of what rounding is of the variance.
    pub rounding: f64,
}

impl Quotients {
    /// Takes in photosites of such a share.
    pub fn add(&mut self, weight: f64, values: [f64; 6]) {
        self.weight += weight;
        self.sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
    }

    /// Takes in others.
    pub fn take(&mut self, other: &Self) {
        self.weight += other.weight;
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, value)| *sum += value);
        self.left_out += other.left_out;
        self.lost += other.lost;
        self.of_flat_noise += other.of_flat_noise;
        self.rounding += other.rounding;
    }

    /// Means of all.
    pub fn means(&self) -> [f64; 6] {
        self.sums.map(|sum| sum / self.weight)
    }

    /// E\[A/F] and E F.
    pub fn ratio_and_flat(&self) -> [f64; 2] {
        let [first, _, flat, ..] = self.means();
        [first, flat]
    }

    /// The law of A/F over these photosites, with such fourth and sixth cumulants.
    pub fn law(&self, fourth: f64, sixth: f64) -> Prediction {
        let [first, square, _, third, ..] = self.means();
        Prediction { sixth, ..Prediction::of_cumulants(first, (square - first * first).max(0.0), third, fourth) }
    }
}

/// Sensitivities max(0, 1 + σ z) and their weights, few where none is near zero: of powers from the 14th on 13!! σ¹⁴ is left out, 6·10⁻⁹ at
/// σ = 1/9.
pub(super) fn few_sensitivities(sigma: f64) -> Vec<(f64, f64)> {
    if sigma <= 0.0 || sigma > 1.0 / 9.0 {
        return sensitivities(sigma);
    }
    NODES.map(|(z, weight)| (1.0 + sigma * z, weight)).to_vec()
}
