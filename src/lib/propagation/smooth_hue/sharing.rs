//! Smooth hue transition of photosites that share rows and columns: numerators and greens hang together. What is shared is normal and adds
//! to the second cumulants alone.
//!
//! A drift of the black level hangs on the place of a row among the knots: what is beyond the first order is the mean over some places, the
//! first order that over all.

use super::expansion::{HuePixel, HueSite};
use crate::cfa::{CfaPattern, Class};
use crate::propagation::drift;
use crate::propagation::gains;
use crate::propagation::moments::{Prediction, SiteCovariance};
use crate::stages::demosaic::stencil::PHASES;
use crate::stages::demosaic::weights::Weights;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Mean and covariance of the pixels of one phase, of such weights.
pub(super) fn of_phase(
    pattern: CfaPattern,
    phase: usize,
    mean: [f64; 3],
    sites: &[Prediction; 3],
    weights: &Weights,
) -> (Vector3<f64>, Matrix3<f64>) {
    let class = |[x, y]: [isize; 2]| {
        let [column, row] = PHASES[phase];
        pattern.class((column + x) as i64, (row + y) as i64) as usize
    };
    let site = |offset: [isize; 2]| {
        let k = class(offset);
        HueSite { offset, mean: mean[k], third: sites[k].third, fourth: sites[k].fourth() }
    };
    let pixel = HuePixel::of(pattern, phase, mean[Class::Green as usize], site);
    let shared = SiteCovariance::of(sites);
    let alone = shared.without_drift();
    let covariance = |place: f64| {
        let count = pixel.sites().len();
        DMatrix::from_fn(count, count, |a, b| {
            let [one, other] = [a, b].map(|index| pixel.sites()[index].offset);
            let pair = (class(one), class(other));
            let own = if a == b { shared.own[pair.0] } else { 0.0 };
            let row = if one[1] == other[1] { alone.row[pair] } else { 0.0 };
            let column = if one[0] == other[0] { alone.column[pair] } else { 0.0 };
            let drift = if shared.drifts() {
                let [one, other] = [one, other].map(|[_, row]| place + row as f64 / shared.drift_rows);
                shared.drift[pair] * drift::between(one, other)
            } else {
                0.0
            };
            own + row + column + drift
        })
    };
    if !shared.drifts() {
        let (shift, found) = pixel.moments(&covariance(0.0));
        return (Vector3::from(mean) + shift, found);
    }
    let (mut shift, mut beyond) = (Vector3::zeros(), Matrix3::zeros());
    let share = 1.0 / drift::PLACES.len() as f64;
    for place in drift::PLACES {
        let covariance = covariance(place);
        let (moved, found) = pixel.moments(&covariance);
        shift += share * moved;
        beyond += share * (found - pixel.first_order(&covariance));
    }
    (Vector3::from(mean) + shift, gains::pixel_covariance(weights, phase, &shared) + beyond)
}
