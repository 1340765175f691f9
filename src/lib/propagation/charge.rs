//! Cumulants of the charge of a photosite, light and dark, before full well and read-out.

use crate::metadata::PoissonKind;
use crate::numerics::gauss::panel;
use crate::numerics::normal::{NearlyNormal, cumulative, density};
use crate::stages::noise::{NoiseModel, rectified_mean, rectified_mean_square};

/// Central moments 2, 3 and 4 of a photosite's sensitivity max(0, N), N normal with mean 1 and standard deviation σ.
pub(super) fn sensitivity(sigma: f64) -> (f64, f64, f64, f64) {
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
pub(super) fn product(rate: f64, shot: bool, kind: PoissonKind, sigma: f64) -> NearlyNormal {
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
    let light = product(expected_e, model.signal_shot, model.poisson, model.response());
    light.plus(product(model.dark_e, model.dark_shot, model.poisson, model.dcnu))
}

/// Sensitivities max(0, 1 + σ z) and their weights.
pub(super) fn sensitivities(sigma: f64) -> Vec<(f64, f64)> {
    /// Standard deviations beyond which nothing counts.
    const REACH: f64 = 8.0;
    const PANELS: u32 = 4;
    if sigma <= 0.0 {
        return vec![(1.0, 1.0)];
    }
    let lowest = (-1.0 / sigma).max(-REACH);
    let width = (REACH - lowest) / f64::from(PANELS);
    let mut found = vec![(0.0, cumulative(lowest))];
    for index in 0..PANELS {
        let low = lowest + width * f64::from(index);
        found.extend(panel(low, low + width).map(|(z, weight)| (1.0 + sigma * z, weight * density(z))));
    }
    found.retain(|(_, weight)| *weight > 1e-14);
    found
}

/// Cumulants of the charge over exposures at a photosite of sensitivities x to light and u to dark current.
pub(super) fn charge_at(model: &NoiseModel, expected_e: f64, [x, u]: [f64; 2]) -> NearlyNormal {
    let count = |rate: f64, is_shot: bool| {
        let counted = if is_shot { rate } else { 0.0 };
        let beyond = if model.poisson == PoissonKind::Exact { counted } else { 0.0 };
        NearlyNormal { mean: rate, variance: counted, third: beyond, fourth: beyond }
    };
    let light = count(expected_e, model.signal_shot).scaled(x);
    light.plus(count(model.dark_e, model.dark_shot).scaled(u))
}
