//! What comes to the law of a charge whose sensitivities are cut off at zero.
//!
//! A photosite of a count n whose sensitivity 1 + σ z would be negative holds nothing of it, rather than v = n (1 + σ z) < 0.
//! With w all else that it holds, each moment gains ∫ f(v) \[g(w) − g(w + v)] dv, f the density of v.

use super::counts::{Charge, Count};
use super::effort;
use super::ends::{MANY, Place, Stretch, difference};
use super::lookup::{Densities, Lookup};
use super::node::{Law, Node};
use super::reading::{Moments, Reading};
use super::steps::Steps;
use crate::numerics::normal::MeanVariance;
use crate::numerics::rounding::{REACH, SMOOTH};

/// Nodes of the other charge beyond which codes are not gone through for each.
const MANY_NODES: usize = 400;

/// Edges of codes that are told apart below the other charge.
const MOST_EDGES: u32 = 40;

/// Weights below this do not count.
const LEAST_WEIGHT: f64 = 1e-13;

/// The same of pairs of them.
const NEGLIGIBLE: f64 = 1e-17;

/// Whether full well cuts the law of a charge.
fn is_cut(count: &Count, full_well_e: f64) -> bool {
    count.spread > 0.0 && count.electrons + REACH * count.spread >= full_well_e
}

/// The same as normal laws, where full well is within reach and the other charge has a pattern, whose law full well cuts: charges
/// below zero leave, and come back as none.
pub(super) fn signed_nodes(law: &Law) -> Vec<Node> {
    let mut found = Vec::new();
    // Laws of more wells are cut off at their floors.
    if law.has_floors() {
        return found;
    }
    for (charge, other) in [(&law.light, &law.dark), (&law.dark, &law.light)] {
        let Some((counts, base)) = below_zero(charge).filter(|_| charge.is_rectified(law.full_well_e)) else {
            continue;
        };
        // Full well cuts counts before read noise blurs them.
        let mut others = plain(other, 0.0);
        others.retain(|other| is_cut(other, law.full_well_e));
        let Some(narrowest) = others.iter().map(|other| other.spread).min_by(f64::total_cmp) else { continue };
        let stretch = Stretch { widest_panel: 2.5 * narrowest, ..base };
        let densities = Densities::of(&counts, 0.0);
        for place in stretch.places(&Reading::electrons(0.0, 0.0), &[]) {
            let share = place.weight * densities.at(place.electrons);
            effort::spend(others.len() as u64);
            if effort::is_spent() {
                return Vec::new();
            }
            for other in &others {
                let weight = other.weight * share;
                if weight > LEAST_WEIGHT {
                    let node = Node { mean: other.electrons, std: other.spread, weight, floor: f64::NEG_INFINITY };
                    found.push(Node { mean: other.electrons + place.electrons, weight: -weight, ..node });
                    found.push(node);
                }
            }
        }
    }
    // Those of one mean are one.
    found.sort_by(|a, b| a.mean.total_cmp(&b.mean).then(a.std.total_cmp(&b.std)));
    found.dedup_by(|next, kept| {
        let is_same = next.mean == kept.mean && next.std == kept.std;
        kept.weight += if is_same { next.weight } else { 0.0 };
        is_same
    });
    found
}

/// All that rectification adds to a reading but for [`signed_nodes`]; `full` is full well where that is within reach.
pub(super) fn corrections(law: &Law, reading: &Reading, full: f64) -> Moments {
    let mut sum = [0.0; 4];
    // Laws of more wells are cut off at their floors.
    if law.has_floors() {
        return sum;
    }
    let others = |other: &Charge, signed: Vec<Count>| {
        let noise_e = if full == f64::INFINITY { law.read_noise_e.max(reading.noise_e) } else { 0.0 };
        let mut each = plain(other, noise_e);
        each.retain(|other| full == f64::INFINITY || !is_cut(other, full));
        each.extend_from_slice(&signed);
        let is_uncut = full == f64::INFINITY || other.most() < full;
        let few = is_uncut.then(|| other.counts(f64::INFINITY).into_iter().chain(signed).collect());
        Others { each, few }
    };
    let is_out_of_reach = |other: &Charge| reading.is_never_beyond(other.most());
    if law.light.is_rectified(law.full_well_e) && !is_out_of_reach(&law.dark) {
        add(&mut sum, 1.0, of_charge(&law.light, &others(&law.dark, Vec::new()), reading, full));
    }
    if law.dark.is_rectified(law.full_well_e) && !is_out_of_reach(&law.light) {
        let signed = if law.light.is_rectified(law.full_well_e) { signed(&law.light) } else { Vec::new() };
        add(&mut sum, 1.0, of_charge(&law.dark, &others(&law.light, signed), reading, full));
    }
    sum
}

/// The normal laws of the other charge.
struct Others {
    /// As many as are told apart.
    each: Vec<Count>,
    /// As many as the mean of a polynomial takes; none where full well cuts them.
    few: Option<Vec<Count>>,
}

fn add(sum: &mut Moments, weight: f64, moments: Moments) {
    for (sum, moment) in sum.iter_mut().zip(moments) {
        *sum += weight * moment;
    }
}

/// The normal laws of the other charge, as many as a sum needs that is as smooth as such noise.
fn plain(other: &Charge, noise_e: f64) -> Vec<Count> {
    let mut nodes = other.counts(noise_e.hypot(other.least_pattern_std()).max(1e-3));
    nodes.retain(|node| node.weight > LEAST_WEIGHT);
    nodes
}

impl MeanVariance {
    /// Those of counts and their spreads.
    fn of_counts(counts: &[Count]) -> Self {
        let total: f64 = counts.iter().map(|count| count.weight).sum();
        let mean_of = |f: &dyn Fn(&Count) -> f64| counts.iter().map(|c| c.weight * f(c)).sum::<f64>() / total;
        let mean = mean_of(&|count| count.electrons);
        let variance = mean_of(&|count| (count.electrons - mean).powi(2) + count.spread.powi(2));
        Self { mean, variance: variance.max(0.0) }
    }
}

/// What rectification does to a charge itself: charges below zero leave, and come back as none.
fn signed(charge: &Charge) -> Vec<Count> {
    let Some((counts, stretch)) = below_zero(charge) else { return Vec::new() };
    let densities = Densities::of(&counts, 0.0);
    let reading = Reading::electrons(0.0, 0.0);
    let mut found = Vec::new();
    let mut gone = 0.0;
    for place in stretch.places(&reading, &[]) {
        let weight = place.weight * densities.at(place.electrons);
        gone += weight;
        found.push(Count { electrons: place.electrons, weight: -weight, spread: 0.0 });
    }
    found.retain(|node| node.weight.abs() > 1e-9);
    found.push(Count { electrons: 0.0, weight: gone, spread: 0.0 });
    found
}

/// The counts of a charge, rising, and the stretch below zero that their sensitivities reach.
fn below_zero(charge: &Charge) -> Option<(Vec<Count>, Stretch)> {
    let mut counts = charge.counts(charge.least_pattern_std().max(1e-3));
    counts.retain(|count| count.electrons > 0.0 && count.weight > LEAST_WEIGHT);
    let (first, last) = (counts.first()?, counts.last()?);
    let extent = REACH * last.spread - last.electrons;
    let narrowest = first.spread;
    let stretch = Stretch {
        from: 0.0,
        direction: -1.0,
        extent,
        narrowest,
        widest_narrow: 0.0,
        noise_e: 0.0,
        widest_panel: f64::INFINITY,
    };
    (extent > 0.0).then_some((counts, stretch))
}

/// The density below zero, looked up.
fn density_table(stretch: &Stretch, densities: &Densities) -> Lookup {
    let mut table = Lookup::new(stretch.narrowest, stretch.extent);
    for index in (0..table.values.len()).filter(|_| !effort::is_spent()) {
        let below = table.distance(index);
        let [density, rise] = densities.with_slope(-below);
        table.values[index] = [density, -rise * table.by_step(below)];
    }
    table
}

/// Charges to take off at which what is read breaks off, as the other charge spreads them out: full well, the ends of the codes,
/// and the edges of the codes next below.
fn seams(reading: &Reading, other: &MeanVariance, full: f64) -> Vec<f64> {
    let mut edges = vec![full];
    edges.extend(reading.rails_e());
    if let Some(code) = reading.visible_code_e() {
        let first = reading.edge_above(other.mean);
        let mut below = first;
        for _ in 0..MOST_EDGES {
            edges.push(below);
            below = reading.edge_below(below, code);
        }
    }
    let of_edge = |edge: f64| (-6..=6).map(move |step| edge - other.mean + 1.5 * f64::from(step) * other.std());
    edges.into_iter().filter(|edge| edge.is_finite()).flat_map(of_edge).collect()
}

/// The same at places that are shared, where no code is to be gone through: the density is worked out once.
fn of_shared(
    (counts, base): (&[Count], &Stretch),
    others: &[Count],
    few: Option<&Vec<Count>>,
    reading: &Reading,
    full: f64,
) -> Moments {
    let mut sum = [0.0; 4];
    let code = reading.visible_code_e();
    let spread_out = MeanVariance::of_counts(others);
    // Codes that the other charge covers by many are a uniform error.
    let is_many = code.is_some_and(|code| spread_out.std() > MANY * code);
    let finest = reading.noise_e.max(if code.is_some() { f64::INFINITY } else { 0.0 });
    let narrow = Stretch { noise_e: 0.0, narrowest: base.narrowest.min(finest.max(1e-3)), ..*base };
    let places = narrow.places(&Reading::electrons(0.0, 0.0), &seams(reading, &spread_out, full));
    let densities = Densities::of(counts, 0.0);
    let share = |place: &Place| (place.electrons, place.weight * densities.at(place.electrons));
    let shared: Vec<(f64, f64)> = places.iter().map(share).collect();
    let gone: f64 = shared.iter().map(|(_, weight)| weight).sum();
    // Whatever leaves such laws, the ends take nothing from them.
    let idle = reading.idle_e();
    let is_idle = |other: &Count| {
        let reach = REACH * other.spread;
        idle[0] < other.electrons - base.extent - reach && other.electrons + reach < idle[1]
    };
    for other in others.iter().filter(|other| !is_idle(other)) {
        add(&mut sum, other.weight * gone, reading.at(other.electrons.min(full), other.spread.powi(2)));
    }
    // What is moved is a polynomial where codes are many, or none, and nothing ends.
    let is_polynomial = reading.is_endless() && (is_many || code.is_none());
    for other in few.filter(|_| is_polynomial).map_or(others, Vec::as_slice).iter().filter(|other| !is_idle(other)) {
        let variance = other.spread * other.spread;
        for &(below, weight) in &shared {
            if weight * other.weight.abs() < NEGLIGIBLE {
                continue;
            }
            let at = (other.electrons + below).min(full);
            let is_free = is_many && reading.is_free_at(at, variance);
            let moved = if is_free { smooth(reading, at, variance) } else { reading.at(at, variance) };
            add(&mut sum, -other.weight * weight, moved);
        }
        effort::spend(shared.len() as u64);
        if effort::is_spent() {
            break;
        }
    }
    sum
}

fn of_charge(charge: &Charge, others: &Others, reading: &Reading, full: f64) -> Moments {
    let mut sum = [0.0; 4];
    let Some((counts, base)) = below_zero(charge) else { return sum };
    let Others { each: others, few } = others;
    let code = reading.visible_code_e();
    if others.len() > MANY_NODES || code.is_none() {
        return of_shared((&counts, &base), others, few.as_ref(), reading, full);
    }
    // Codes are gone through as far as laws reach that are narrow.
    let spreads = counts.iter().map(|count| count.spread);
    let narrow = spreads.filter(|spread| *spread < MANY * code.unwrap_or(0.0)).fold(0.0, f64::max);
    let densities = Densities::of(&counts, 0.0);
    let mut steps = Steps::new(charge, &base, &counts, reading);
    let mut table = None;
    let is_only = others.windows(2).all(|pair| pair[0].spread == pair[1].spread);
    for other in others {
        if effort::is_spent() {
            break;
        }
        let noise_e = reading.noise_e.hypot(other.spread);
        let is_hidden = code.is_some_and(|code| noise_e > SMOOTH * code);
        if let Some(steps) = &mut steps
            && !is_hidden
            && other.electrons <= full
            && steps.is_known(noise_e, is_only)
        {
            add(&mut sum, other.weight, steps.moments(other.electrons, noise_e));
            continue;
        }
        let still = reading.at(other.electrons.min(full), other.spread * other.spread);
        let blurred = Reading { noise_e, ..*reading };
        if table.is_none() && others.len() > 8 {
            table = Some(density_table(&base, &densities));
        }
        let widest_narrow = if is_hidden { 0.0 } else { narrow };
        let stretch = Stretch { from: other.electrons, widest_narrow, noise_e, ..base };
        let places = stretch.places(&blurred, &[]);
        effort::spend(places.len() as u64);
        for place in places {
            let below = place.electrons - other.electrons;
            let share = match &table {
                Some(table) => table.at(below),
                None => densities.at(below),
            };
            if share * place.weight * other.weight.abs() > LEAST_WEIGHT {
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
