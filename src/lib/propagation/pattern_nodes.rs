//! Nodes over the sensitivities of photosites, max(0, 1 + σ z) with z normal, for what bends where readings end, or follows every edge of
//! the codes.

use super::counts::Charge;
use super::curved::NODES;
use crate::numerics::gauss::{hermite, panel};
use crate::numerics::normal::{cumulative, density};
use crate::numerics::rounding::REACH;
use std::sync::LazyLock;

/// Sensitivities at most where rounding shows.
const MOST_IF_FINE: f64 = 4096.0;

/// The sensitivities of the photosites to one charge, max(0, 1 + σ z).
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    pub rate: f64,
    pub sigma: f64,
    pub is_shot: bool,
    /// Widest panel, in standard deviations.
    widest: f64,
}

/// Where the mean of a reading bends, in standard deviations of the sensitivity, and how wide the bend is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knee {
    pub z: f64,
    pub width: f64,
}

impl Axis {
    /// Widest panel of what bends at knees alone, in standard deviations.
    const WIDEST: f64 = 3.0;

    pub fn of(charge: &Charge) -> Self {
        let rate = charge.rate.max(0.0);
        let sigma = if rate > 0.0 { charge.pattern } else { 0.0 };
        Self { rate, sigma, is_shot: charge.shot.is_some(), widest: Self::WIDEST }
    }

    /// The same for a function that changes over so many electrons wherever it is.
    pub fn followed_over(self, std_e: f64) -> Self {
        let panels = 2.0 * REACH / (3.0 * std_e / self.spread());
        let widest = 2.0 * REACH / panels.min(MOST_IF_FINE / 12.0);
        Self { widest: self.widest.min(widest), ..self }
    }

    /// Standard deviation of what the charge is over photosites, in e⁻.
    pub fn spread(&self) -> f64 {
        self.rate * self.sigma
    }

    /// Gauss and Hermite's rule for a function that bends only over many standard deviations of the sensitivity, w at least: n nodes are
    /// off by n!/√(2n)! w⁻²ⁿ of what bends, 2·10⁻¹⁰; none of what bends within less.
    fn smooth_rule(knees: &[Knee]) -> Option<&'static [(f64, f64)]> {
        const WIDTHS: [(f64, usize); 3] = [(5.0, 6), (3.0, 8), (2.0, 12)];
        static RULES: LazyLock<[Vec<(f64, f64)>; 3]> = LazyLock::new(|| WIDTHS.map(|(_, nodes)| hermite(nodes)));
        let narrowest = knees.iter().map(|knee| knee.width).fold(f64::INFINITY, f64::min);
        let rule = WIDTHS.iter().position(|(width, _)| narrowest >= *width)?;
        Some(&RULES[rule])
    }

    /// Sensitivities and their weights for a function that bends at `knees` and is smooth between: panels that grow with the
    /// distance from each. Where nothing bends it is straight, unless `is_curved`.
    pub fn points(&self, knees: &[Knee], is_curved: bool) -> Vec<(f64, f64)> {
        if self.sigma <= 0.0 {
            return vec![(1.0, 1.0)];
        }
        let lowest = (-1.0 / self.sigma).max(-REACH);
        // A mean that follows the charge is a straight line.
        if knees.is_empty() && lowest <= -REACH && !is_curved {
            return NODES.iter().map(|(z, weight)| (1.0 + self.sigma * z, *weight)).collect();
        }
        if let Some(rule) = Self::smooth_rule(knees).filter(|_| lowest <= -REACH && !is_curved) {
            return rule.iter().map(|(z, weight)| (1.0 + self.sigma * z, *weight)).collect();
        }
        // Those below zero are zero.
        let mut found = vec![(0.0, cumulative(lowest))];
        let places = between(lowest, self.widest, knees).into_iter();
        found.extend(places.map(|(z, weight)| (1.0 + self.sigma * z, weight)));
        found.retain(|(_, weight)| *weight > LEAST_WEIGHT);
        found
    }
}

/// Places of a normal variable above the lowest, and their weights, for a function that bends at `knees` and is smooth over `widest`
/// elsewhere: panels that grow with the distance from each.
pub(super) fn between(lowest: f64, widest: f64, knees: &[Knee]) -> Vec<(f64, f64)> {
    /// Bends narrower than this are ends of panels.
    const NARROWEST: f64 = 1e-7;
    let mut ends = vec![lowest, REACH];
    let mut end = -REACH;
    while end < REACH {
        ends.push(end);
        end += widest;
    }
    for knee in knees {
        ends.push(knee.z);
        let mut distance = 3.0 * knee.width.max(NARROWEST);
        while distance < widest {
            ends.extend([knee.z - distance, knee.z + distance]);
            distance *= 2.5;
        }
    }
    ends.retain(|end| (lowest..=REACH).contains(end));
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|next, kept| *next - *kept < 1e-9);
    let of_panel = |pair: &[f64]| panel(pair[0], pair[1]).map(|(z, weight)| (z, weight * density(z)));
    let all = ends.windows(2).flat_map(of_panel);
    all.filter(|(_, weight)| *weight > LEAST_WEIGHT).collect()
}

/// Weights below this do not count.
const LEAST_WEIGHT: f64 = 1e-17;

/// Sensitivities and their weights, as many as the means over exposures need, which follow them the more steeply the less
/// temporal noise there is, in e⁻.
pub(super) fn sensitivities(charge: &Charge, temporal: f64) -> Vec<(f64, f64)> {
    sensitivities_by(charge, temporal, 0.02)
}

/// The same of means that follow every edge of the codes.
pub(super) fn fine_sensitivities(charge: &Charge, temporal: f64) -> Vec<(f64, f64)> {
    sensitivities_by(charge, temporal, 2.0 * 1.3 * REACH / MOST_IF_FINE)
}

/// Steepness up to which few sensitivities tell a mean, and how many: Gauss and Hermite's rule of n nodes is off by n!/(2n)! of its 2n-th
/// power, times the 2n-th derivative of what bends: 10⁻¹², and 5·10⁻⁹ of a bend as narrow as the steepest is for.
const SHALLOW: [(f64, usize); 4] = [(1.8e-3, 2), (0.018, 3), (0.05, 4), (0.3, 6)];
static FEW: LazyLock<[Vec<(f64, f64)>; 4]> = LazyLock::new(|| SHALLOW.map(|(_, nodes)| hermite(nodes)));

/// Sensitivities and their weights for means that are smooth on the scale of such read noise, in e⁻, which hides the codes, and bend where
/// these end: few where patterns are less; else as [`sensitivities`].
pub(super) fn smooth_sensitivities(charge: &Charge, temporal: f64, noise_e: f64) -> Vec<(f64, f64)> {
    let steepness = charge.pattern * charge.rate / noise_e;
    let is_cut = charge.pattern * REACH >= 1.0;
    match SHALLOW.iter().position(|(shallow, _)| steepness <= *shallow) {
        Some(rule) if steepness > 0.0 && !is_cut => {
            FEW[rule].iter().map(|(z, weight)| (1.0 + charge.pattern * z, *weight)).collect()
        }
        _ => sensitivities(charge, temporal),
    }
}

fn sensitivities_by(charge: &Charge, temporal: f64, narrowest: f64) -> Vec<(f64, f64)> {
    let sigma = charge.pattern;
    if sigma <= 0.0 || charge.rate <= 0.0 {
        return vec![(1.0, 1.0)];
    }
    let steepness = sigma * charge.rate / temporal;
    let scale = (1.0 / (1.0 + steepness * steepness).sqrt()).max(narrowest);
    let lowest = (-1.0 / sigma).max(-REACH);
    if lowest <= -REACH && steepness <= SHALLOW[3].0 {
        return FEW[3].iter().map(|(z, weight)| (1.0 + sigma * z, *weight)).collect();
    }
    if lowest <= -REACH {
        let step = scale / 1.3;
        let steps = (REACH / step).ceil();
        let mut z = -steps * step;
        let mut found = Vec::new();
        while z <= steps * step + 0.5 * step {
            found.push((1.0 + sigma * z, step * density(z)));
            z += step;
        }
        return found;
    }
    // Those below zero are zero.
    let mut found = vec![(0.0, cumulative(lowest))];
    let panels = ((REACH - lowest) / (3.0 * scale)).ceil();
    let width = (REACH - lowest) / panels;
    let mut low = lowest;
    while low < REACH - 0.5 * width {
        found.extend(panel(low, low + width).map(|(z, weight)| (1.0 + sigma * z, weight * density(z))));
        low += width;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a bend that is as wide as the noise, E Φ(a + s z) = Φ(a/√(1 + s²)); each rule at the steepest that it is for.
    #[test]
    fn few_sensitivities_follow_bends() {
        for (steepness, nodes, within) in [(1.7e-3, 2, 2e-12), (0.017, 3, 2e-12), (0.049, 4, 2e-12), (0.29, 6, 5e-9)] {
            let (rate, noise_e) = (200.0, 5.0);
            let charge = Charge { rate, shot: None, pattern: steepness * noise_e / rate };
            let found = smooth_sensitivities(&charge, 12.0, noise_e);
            assert_eq!(found.len(), nodes);
            for a in [-4.0, -1.5, 0.0, 0.7, 3.0] {
                let mean: f64 =
                    found.iter().map(|(x, weight)| weight * cumulative(a + (x - 1.0) * rate / noise_e)).sum();
                assert!((mean - cumulative(a / steepness.hypot(1.0))).abs() < within, "{steepness} {a}: {mean}");
            }
        }
    }
}
