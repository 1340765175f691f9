//! What comes to the law of a charge whose sensitivities are cut off at zero.
//!
//! A photosite of a count n whose sensitivity 1 + σ z would be negative holds nothing of it, rather than v = n (1 + σ z) < 0.
//! With w all else that it holds, each moment gains ∫ f(v) \[g(w) − g(w + v)] dv, f the density of v.

use super::counts::{Charge, Count};
use super::ends::{Stretch, difference};
use super::law::Law;
use super::reading::{Moments, Reading};
use crate::numerics::normal::density;
use crate::numerics::rounding::{REACH, SMOOTH};

/// Nodes of the other charge beyond which codes are not gone through for each.
const MANY_NODES: usize = 400;

/// All that rectification adds to a reading; `full` is full well where that is within reach.
pub(super) fn corrections(law: &Law, reading: &Reading, full: f64) -> Moments {
    let mut sum = [0.0; 4];
    if law.light.is_rectified() {
        add(&mut sum, 1.0, of_charge(&law.light, &plain(&law.dark, law, reading), reading, full));
    }
    if law.dark.is_rectified() {
        let mut others = plain(&law.light, law, reading);
        if law.light.is_rectified() {
            others.extend(signed(&law.light));
        }
        add(&mut sum, 1.0, of_charge(&law.dark, &others, reading, full));
    }
    sum
}

fn add(sum: &mut Moments, weight: f64, moments: Moments) {
    for (sum, moment) in sum.iter_mut().zip(moments) {
        *sum += weight * moment;
    }
}

/// The normal laws of the other charge.
fn plain(other: &Charge, law: &Law, reading: &Reading) -> Vec<Count> {
    let mut nodes = other.counts(law.read_noise_e.max(reading.noise_e).hypot(other.least_pattern_std()).max(1e-3));
    nodes.retain(|node| node.weight > 1e-13);
    nodes
}

/// What rectification does to a charge itself: charges below zero leave, and come back as none.
fn signed(charge: &Charge) -> Vec<Count> {
    let Some((counts, stretch)) = below_zero(charge) else { return Vec::new() };
    let reading = Reading::electrons(0.0, 0.0);
    let mut found = Vec::new();
    let mut gone = 0.0;
    for place in stretch.places(&reading) {
        let weight = place.weight * density_at(&counts, place.electrons, f64::INFINITY);
        gone += weight;
        found.push(Count { electrons: place.electrons, weight: -weight, spread: 0.0 });
    }
    found.push(Count { electrons: 0.0, weight: gone, spread: 0.0 });
    found
}

/// The counts of a charge, rising, and the stretch below zero that their sensitivities reach.
fn below_zero(charge: &Charge) -> Option<(Vec<Count>, Stretch)> {
    let mut counts = charge.counts(charge.least_pattern_std().max(1e-3));
    counts.retain(|count| count.electrons > 0.0 && count.weight > 1e-17);
    let (first, last) = (counts.first()?, counts.last()?);
    let extent = REACH * last.spread - last.electrons;
    let narrowest = first.spread;
    let stretch = Stretch { from: 0.0, direction: -1.0, extent, narrowest, widest_narrow: 0.0, noise_e: 0.0 };
    (extent > 0.0).then_some((counts, stretch))
}

/// Density of the charge at `electrons` < 0, of counts up to `most`.
fn density_at(counts: &[Count], electrons: f64, most: f64) -> f64 {
    let at = |count: &Count| {
        let z = (electrons - count.electrons) / count.spread;
        if z > -REACH { count.weight * density(z) / count.spread } else { 0.0 }
    };
    counts.iter().take_while(|count| count.electrons <= most).map(at).sum()
}

fn of_charge(charge: &Charge, others: &[Count], reading: &Reading, full: f64) -> Moments {
    let mut sum = [0.0; 4];
    let Some((counts, base)) = below_zero(charge) else { return sum };
    let code = reading.visible_code_e();
    // Shared places where no code is to be gone through; then the density is worked out once.
    let is_shared = others.len() > MANY_NODES || code.is_none();
    let shared: Vec<(f64, f64)> = if is_shared {
        let blind = Stretch { noise_e: 0.0, ..base };
        let finest = reading.noise_e.max(if is_shared && code.is_some() { f64::INFINITY } else { 0.0 });
        let narrow = Stretch { narrowest: blind.narrowest.min(finest.max(1e-3)), ..blind };
        let places = narrow.places(&Reading::electrons(0.0, 0.0));
        places.iter().map(|place| (place.electrons, place.weight * density_at(&counts, place.electrons, full))).collect()
    } else {
        Vec::new()
    };
    for other in others {
        let variance = other.spread * other.spread;
        let still = reading.at(other.electrons.min(full), variance);
        if is_shared {
            for &(below, weight) in &shared {
                let at = (other.electrons + below).min(full);
                let moved = if code.is_some() { smooth(reading, at, variance) } else { reading.at(at, variance) };
                add(&mut sum, other.weight * weight, difference(still, moved));
            }
            continue;
        }
        let noise_e = reading.noise_e.hypot(other.spread);
        let blurred = Reading { noise_e, ..*reading };
        let is_hidden = code.is_some_and(|code| noise_e > SMOOTH * code);
        // Codes are gone through as far as the density reaches.
        let widest_narrow = if is_hidden { 0.0 } else { base.extent / (2.0 * REACH) };
        let stretch = Stretch { from: other.electrons, widest_narrow, noise_e, ..base };
        for place in stretch.places(&blurred) {
            let share = density_at(&counts, place.electrons - other.electrons, full - other.electrons);
            if share > 0.0 {
                let at = place.electrons.min(full);
                let moved = if place.is_smooth { blurred.smooth_at(at) } else { blurred.at(at, 0.0) };
                add(&mut sum, other.weight * share * place.weight, difference(still, moved));
            }
        }
    }
    sum
}

/// Moments where codes are many to what blurs them together.
fn smooth(reading: &Reading, electrons: f64, variance: f64) -> Moments {
    Reading { noise_e: reading.noise_e.hypot(variance.sqrt()), ..*reading }.smooth_at(electrons)
}
