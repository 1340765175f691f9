//! What one photosite reads, of many electrons: by the first four cumulants of its charge, and Edgeworth's series.

use super::counts::Charge;
use super::effort;
use super::law::Law;
use crate::metadata::PoissonKind;
use crate::numerics::gauss::panel;
use crate::numerics::normal::{NearlyNormal, cumulative, density};
use crate::numerics::rounding::REACH;

/// Width of a panel, in standard deviations: 12 nodes leave 10⁻⁹ of a product of normal laws.
pub(super) const PANEL: f64 = 4.0;

impl Law {
    /// Cumulants of the charge over exposures at a photosite of such sensitivities to light and to dark current, which full well leaves alone.
    pub(super) fn cumulants_at(&self, [x, y]: [f64; 2]) -> NearlyNormal {
        let of = |charge: &Charge, factor: f64| {
            let shot = |kind| if charge.shot == Some(kind) { charge.rate } else { 0.0 };
            let counted = shot(PoissonKind::Exact);
            let variable = NearlyNormal {
                mean: charge.rate,
                variance: counted + shot(PoissonKind::Gaussian),
                third: counted,
                fourth: counted,
            };
            variable.scaled(factor)
        };
        of(&self.light, x).plus(of(&self.dark, y))
    }
}

/// The probability that a charge, cut off at full well, and read noise exceed an edge, or reach it; the law of the charge, and of both together.
pub(super) fn beyond(edge_e: f64, [charge, whole]: [&NearlyNormal; 2], noise_e: f64, full_e: f64) -> f64 {
    let reach = REACH * noise_e;
    if edge_e > full_e + reach {
        return 0.0;
    }
    let std = charge.variance.sqrt();
    if std <= 0.0 {
        let off = charge.mean.min(full_e) - edge_e;
        return if noise_e > 0.0 {
            cumulative(off / noise_e)
        } else if off >= 0.0 {
            1.0
        } else {
            0.0
        };
    }
    // Where no charge that is read so is full.
    if edge_e <= full_e - reach || charge.mean + REACH * std < full_e {
        return whole.exceeds(edge_e);
    }
    // From charges that none exceeds, or full well, on to those that all do.
    let [from, to] = [charge.mean + REACH * std, charge.mean - REACH * std].map(|end| (edge_e - end) / noise_e);
    let from = from.max((edge_e - full_e) / noise_e).max(-REACH);
    let to = to.clamp(from, REACH.max(from));
    let mut sum = cumulative(-to);
    let panels = ((to - from) / PANEL.min(PANEL * std / noise_e)).ceil().max(1.0);
    let width = (to - from) / panels;
    let mut low = from;
    while low < to - 0.5 * width && width > 0.0 {
        effort::spend(6);
        for (z, weight) in panel(low, low + width) {
            sum += weight * density(z) * charge.exceeds(edge_e - noise_e * z);
        }
        low += width;
    }
    sum.clamp(0.0, 1.0)
}
