//! What full well makes of normal laws that it cuts.
//!
//! With g the moments of a reading at a charge, N the normal law and F full well,
//!
//! E g(min(N, F)) = E g(N) + ∫_F^∞ φ(q) \[g(F) − g(q)] dq        where the mean is below F,
//! E g(min(N, F)) = g(F) + ∫_f^F φ(q) \[g(q) − g(F)] dq + P(N < f) \[g(f) − g(F)]        where it is above, f its floor.
//!
//! The integrals are sums over panels that grow with the distance from F, since the laws that reach there are the wider the
//! farther they reach. Codes that read noise leaves visible are gone through one by one as long as the law is narrow, and about F;
//! farther off they are many to the law's width, and rounding is a uniform error. From the one to the other leads a weight that
//! is as smooth as a normal law, so that nothing is seen of the seam.

use super::effort;
use super::node::Node;
use super::reading::{Moments, Reading};
use super::straight::Straight;
use crate::numerics::gauss::{NODES, interpolated, panel};
use crate::numerics::normal::{cumulative, density};
use crate::numerics::rounding::REACH;

/// A place of an integral: charge, weight, and whether rounding is a uniform error there.
pub(super) struct Place {
    pub electrons: f64,
    pub weight: f64,
    pub is_smooth: bool,
}

/// Codes to a law's width from which rounding is a uniform error but for the ends.
pub(super) const MANY: f64 = 2.5;
/// Codes that are gone through one by one about an end of a wide law.
const ABOUT_ENDS: f64 = 15.0;
/// Width of the seam, in codes, as a standard deviation.
const SEAM: f64 = 1.3;
/// Places where laws are cut off below, beyond which they are not told apart.
const MOST_BREAKS: usize = 1200;
/// Half of the seam, in codes.
const HALF_SEAM: f64 = 8.0 * SEAM;

/// Where an integral begins and how far it goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub from: f64,
    /// 1 or −1.
    pub direction: f64,
    pub extent: f64,
    /// The narrowest law that is near the beginning.
    pub narrowest: f64,
    /// The widest of those that codes have to be gone through for wherever they reach; 0 where there is none.
    pub widest_narrow: f64,
    /// Noise that blurs the codes.
    pub noise_e: f64,
    /// The widest that a panel may be.
    pub widest_panel: f64,
}

impl Stretch {
    /// Places and weights; of integrands that break off at some charges, these are ends of panels.
    pub fn places(&self, reading: &Reading, breaks: &[f64]) -> Vec<Place> {
        let Self { from, direction, extent, .. } = *self;
        let code = reading.visible_code_e();
        let at = |distance: f64| from + direction * distance;
        let (fine, half_seam) = match code {
            Some(code) => (self.fine(code, reading), HALF_SEAM * code),
            None => (0.0, 0.0),
        };
        let mut ends = self.graded();
        if let Some(code) = code {
            self.add_codes(&mut ends, fine + 2.0 * half_seam, code, reading);
        }
        self.add_rails(&mut ends, reading);
        ends.extend(breaks.iter().map(|at| (at - from) * direction));
        ends.retain(|end| (0.0..=extent).contains(end));
        ends.sort_by(f64::total_cmp);
        let lower = reading.rails_e()[0];
        // The share of a place that codes are gone through for.
        let share = |distance: f64| -> f64 {
            let Some(code) = code else { return 1.0 };
            let near = |beyond: f64| cumulative((half_seam - beyond) / (SEAM * code));
            let of_end = near(distance - fine);
            let of_rail = near(at(distance) - lower - self.noise_e * REACH - ABOUT_ENDS * code);
            let above = if reading.rails_e()[1] < at(distance) + self.noise_e * REACH + 2.0 * code { 1.0 } else { 0.0 };
            1.0 - (1.0 - of_end) * (1.0 - of_rail) * (1.0 - above)
        };
        let mut places = Vec::new();
        for pair in ends.windows(2).filter(|pair| pair[1] - pair[0] > 1e-13 * extent) {
            for (distance, weight) in panel(pair[0], pair[1]) {
                let share = share(distance);
                let mut put = |weight: f64, is_smooth| {
                    if weight > 0.0 {
                        places.push(Place { electrons: at(distance), weight, is_smooth });
                    }
                };
                put(weight * share, false);
                put(weight * (1.0 - share), true);
            }
        }
        places
    }

    /// How far codes are gone through.
    fn fine(&self, code: f64, reading: &Reading) -> f64 {
        let of_law = ABOUT_ENDS * code + 2.0 * REACH * self.widest_narrow;
        let [lower, upper] = reading.rails_e().map(|rail| (rail - self.from).abs());
        let nearest = lower.min(upper);
        of_law + if nearest < (ABOUT_ENDS + HALF_SEAM) * code { nearest } else { 0.0 }
    }

    /// Ends of panels that grow with the distance.
    fn graded(&self) -> Vec<f64> {
        let mut ends = vec![0.0];
        let mut distance = 0.0;
        while distance < self.extent {
            let width = (1.5 * self.narrowest).max(distance / 3.0).max(self.extent * 1e-9);
            distance += width.min(self.widest_panel.max(self.extent * 1e-3));
            ends.push(distance.min(self.extent));
        }
        ends
    }

    /// Ends of panels on which a polynomial follows the laws that reach there: half as wide as a rule needs to sum them.
    fn smooth_panels(&self, breaks: &[f64]) -> Vec<f64> {
        let graded = self.graded();
        let halves = graded.windows(2).map(|pair| f64::midpoint(pair[0], pair[1]));
        let broken = breaks.iter().map(|at| (at - self.from) * self.direction);
        let mut ends: Vec<f64> = graded.iter().copied().chain(halves).chain(broken).collect();
        ends.retain(|end| (0.0..=self.extent).contains(end));
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        ends
    }

    /// Edges of codes, and of what blurs them, as far as codes are gone through and about the lower rail.
    fn add_codes(&self, ends: &mut Vec<f64>, fine: f64, code: f64, reading: &Reading) {
        let [lower, upper] = reading.rails_e();
        let blur = self.noise_e;
        let zone = (2.0 * HALF_SEAM + ABOUT_ENDS) * code + REACH * blur;
        let mut add = |low: f64, high: f64| {
            let mut edge = reading.edge_above(low.max(lower - code));
            while edge < high.min(upper + code) {
                let distance = (edge - self.from) * self.direction;
                ends.push(distance);
                if blur > 0.0 {
                    // A step that is blurred but little has panels of its own.
                    let layers = if blur < 0.1 * code { [3.0 * blur, 9.0 * blur] } else { [0.5 * code; 2] };
                    ends.extend(layers.into_iter().flat_map(|layer| [distance - layer, distance + layer]));
                }
                edge = reading.edge_beyond(edge, code);
            }
        };
        let [near, far] = [self.from, self.from + self.direction * fine.min(self.extent)];
        add(near.min(far) - code, near.max(far) + code);
        let end = self.from + self.direction * self.extent;
        if lower.is_finite() && self.from.min(end) < lower + zone {
            add(self.from.min(end).max(lower - zone), self.from.max(end).min(lower + zone));
        }
    }

    /// Rails, and what blurs them.
    fn add_rails(&self, ends: &mut Vec<f64>, reading: &Reading) {
        for rail in reading.rails_e().into_iter().filter(|rail| rail.is_finite()) {
            let distance = (rail - self.from) * self.direction;
            let blurs = (-6..=6).map(|step| distance + 1.5 * f64::from(step) * self.noise_e);
            ends.extend(blurs.filter(|_| self.noise_e > 0.0));
            ends.push(distance);
        }
    }
}

/// A density that is dear to work out, between ends of panels on which it is smooth: on each the polynomial through it at the
/// places of Gauss's rule, worked out when it is first asked for.
struct Interpolant<F> {
    ends: Vec<f64>,
    values: Vec<Option<[f64; NODES]>>,
    of: F,
}

impl<F: Fn(f64) -> f64> Interpolant<F> {
    fn new(ends: Vec<f64>, of: F) -> Self {
        let values = vec![None; ends.len().saturating_sub(1)];
        Self { ends, values, of }
    }

    /// Places at which the density is worked out at most.
    fn places(&self) -> usize {
        self.values.len() * NODES
    }

    /// The density at a distance, by the barycentric formula; `charge_at` is the charge at a distance.
    fn at(&mut self, distance: f64, charge_at: impl Fn(f64) -> f64) -> f64 {
        let index = self.ends.partition_point(|end| *end <= distance).clamp(1, self.values.len()) - 1;
        let (low, high) = (self.ends[index], self.ends[index + 1]);
        let of = &self.of;
        let values = self.values[index].get_or_insert_with(|| {
            let mut values = [0.0; NODES];
            values.iter_mut().zip(panel(low, high)).for_each(|(value, (place, _))| *value = of(charge_at(place)));
            values
        });
        interpolated(values, (distance - f64::midpoint(low, high)) / (0.5 * (high - low)))
    }
}

/// Laws that are cut off at floors and so wide that each is one polynomial from its floor to full well: sums of those whose
/// floors are below a charge.
struct Flat {
    /// Ends of the stretch.
    ends: [f64; 2],
    /// Floors, rising, and the sums up to each.
    sums: Vec<(f64, [f64; NODES])>,
}

impl Flat {
    fn of(nodes: &[Node], full: f64, extent: f64, direction: f64) -> Option<Self> {
        let is_flat = |node: &Node| node.floor.is_finite() && node.std > extent;
        if direction > 0.0 || !nodes.iter().all(is_flat) {
            return None;
        }
        let ends = [full - extent, full];
        let mut nodes: Vec<&Node> = nodes.iter().collect();
        nodes.sort_by(|a, b| a.floor.total_cmp(&b.floor));
        let mut sums: Vec<(f64, [f64; NODES])> = Vec::new();
        let mut sum = [0.0; NODES];
        for node in nodes {
            for (sum, (electrons, _)) in sum.iter_mut().zip(panel(ends[0], ends[1])) {
                let z = (electrons - node.mean) / node.std;
                *sum += if z.abs() < REACH { node.weight * density(z) / node.std } else { 0.0 };
            }
            match sums.last_mut() {
                Some((floor, last)) if *floor == node.floor => *last = sum,
                _ => sums.push((node.floor, sum)),
            }
        }
        Some(Self { ends, sums })
    }

    fn at(&self, electrons: f64) -> f64 {
        let below = self.sums.partition_point(|(floor, _)| *floor < electrons);
        let [low, high] = self.ends;
        let x = (electrons - f64::midpoint(low, high)) / (0.5 * (high - low));
        below.checked_sub(1).map_or(0.0, |index| interpolated(&self.sums[index].1, x))
    }
}

/// Σ over normal laws that full well cuts of what is read of them.
pub(super) fn at_full_well(near: &[Node], full: f64, reading: &Reading, at_full: Moments) -> Moments {
    // Where the highest code is out of reach of full well it may as well not be.
    let [_, upper] = reading.rails_e();
    let code = reading.visible_code_e().unwrap_or(0.0);
    let open = if upper > full + REACH * reading.noise_e + 2.0 * code { reading.without_highest() } else { *reading };
    let (below, above): (Vec<Node>, Vec<Node>) =
        near.iter().partition(|node| node.mean <= full && node.floor == f64::NEG_INFINITY);
    let mut sum = [0.0; 4];
    for node in &below {
        add(&mut sum, node.weight, open.at(node.mean, node.std * node.std));
    }
    for node in &above {
        add(&mut sum, node.weight, at_full);
        if node.floor.is_finite() {
            let share = cumulative((node.floor - node.mean) / node.std);
            add(&mut sum, node.weight * share, difference(open.at(node.floor, 0.0), at_full));
        }
    }
    for (nodes, direction) in [(below, 1.0), (above, -1.0)] {
        add_beyond(&mut sum, nodes, direction, full, [&open, reading], at_full);
    }
    sum
}

fn add(sum: &mut Moments, weight: f64, moments: Moments) {
    for (sum, moment) in sum.iter_mut().zip(moments) {
        *sum += weight * moment;
    }
}

/// What is read of normal laws so far beyond full well, or below it, that it is the same for all charges, less what is read at full well.
fn of_even(nodes: &[Node], [full, direction, even]: [f64; 3], reading: &Reading, at_full: Moments) -> Moments {
    let from = full + direction * even;
    let beyond = |node: &Node| node.weight * cumulative(direction * (node.mean - from) / node.std);
    let share: f64 = nodes.iter().map(beyond).sum();
    difference(reading.at(from, 0.0), at_full).map(|moment| share * moment)
}

/// Takes off what is read of normal laws beyond full well (`direction` 1), or adds what is read below it of those whose mean lies
/// beyond (−1), less what is read there of full photosites. `open` is the reading without a highest code where that is out of reach.
fn add_beyond(
    sum: &mut Moments,
    mut nodes: Vec<Node>,
    direction: f64,
    full: f64,
    [open, reading]: [&Reading; 2],
    at_full: Moments,
) {
    let sign = -direction;
    let code = reading.visible_code_e().unwrap_or(0.0);
    if nodes.is_empty() {
        return;
    }
    nodes.sort_by(|a, b| a.mean.total_cmp(&b.mean));
    let reach = |node: &Node| (REACH * node.std + direction * (node.mean - full)).min(full - node.floor);
    let farthest = nodes.iter().map(reach).fold(0.0, f64::max);
    let has_floors = nodes.iter().any(|node| node.floor.is_finite());
    if let Some(straight) = Straight::of(open, full, full + direction * farthest).filter(|_| !has_floors) {
        effort::spend(nodes.len() as u64);
        nodes.iter().for_each(|node| add(sum, sign * node.weight, straight.beyond(node, direction)));
        return;
    }
    let even = reading.even_from(full, direction).filter(|even| *even < farthest && !has_floors);
    if let Some(even) = even {
        add(sum, sign, of_even(&nodes, [full, direction, even], reading, at_full));
    }
    let farthest = even.unwrap_or(farthest);
    let stds = nodes.iter().map(|node| node.std);
    let is_narrow = |std: &f64| *std < MANY * code;
    let widest = stds.clone().fold(0.0, f64::max);
    let stretch = Stretch {
        from: full,
        direction,
        extent: farthest,
        narrowest: stds.clone().fold(f64::INFINITY, f64::min),
        widest_narrow: stds.filter(is_narrow).fold(0.0, f64::max),
        noise_e: reading.noise_e,
        widest_panel: f64::INFINITY,
    };
    let mut floors: Vec<f64> = nodes.iter().map(|node| node.floor).filter(|floor| floor.is_finite()).collect();
    floors.sort_by(f64::total_cmp);
    floors.dedup();
    // So many are a step so small each that nothing is seen of them.
    if floors.len() > MOST_BREAKS {
        floors.clear();
    }
    let share_at = |electrons: f64| -> f64 {
        let at = |node: &Node| {
            let z = (electrons - node.mean) / node.std;
            if z.abs() < REACH && electrons > node.floor { node.weight * density(z) / node.std } else { 0.0 }
        };
        let within = |mean: f64| nodes.partition_point(|node| node.mean < mean);
        let reach = REACH * widest;
        let near = &nodes[within(electrons - reach)..within(electrons + reach)];
        effort::spend(near.len() as u64);
        near.iter().map(at).sum()
    };
    let flat = Flat::of(&nodes, full, farthest, direction);
    let share_at = |electrons: f64| flat.as_ref().map_or_else(|| share_at(electrons), |flat| flat.at(electrons));
    let places = stretch.places(open, &floors);
    let mut shares = Interpolant::new(stretch.smooth_panels(&floors), share_at);
    // Codes may cut panels that one rule would do for into many.
    let is_cut_fine = places.len() > 2 * shares.places();
    effort::spend(places.len() as u64);
    for place in places {
        if effort::is_spent() {
            return;
        }
        let distance = (place.electrons - full) * direction;
        let share = if is_cut_fine { shares.at(distance, |d| full + direction * d) } else { share_at(place.electrons) };
        if share != 0.0 {
            let moments = if place.is_smooth { open.smooth_at(place.electrons) } else { open.at(place.electrons, 0.0) };
            add(sum, sign * share * place.weight, difference(moments, at_full));
        }
    }
}

pub(super) fn difference(a: Moments, b: Moments) -> Moments {
    [0, 1, 2, 3].map(|j| a[j] - b[j])
}

#[cfg(test)]
mod tests {
    use crate::metadata::PoissonKind;
    use crate::numerics::normal::{cumulative, density};
    use crate::propagation::law::Law;
    use crate::random::poisson::probability;
    use crate::stages::noise::{LineNoise, NoiseModel, Tails};

    /// The share that is read from a level on, below full well and above it: against a sum over counts and sensitivities.
    #[test]
    fn shares_beyond_a_level_are_those_of_the_clipped_charge() {
        let [full, noise_e, prnu] = [1000.0, 5.0, 0.02];
        let model = NoiseModel {
            dark_e: 0.0,
            dcnu: 0.0,
            prnu,
            read_noise_e: noise_e,
            full_well_e: full,
            dark_shot: true,
            signal_shot: true,
            poisson: PoissonKind::Exact,
            lines: LineNoise::default(),
            tails: Tails::default(),
        };
        for (rate, level) in [(950.0, 980.0), (1080.0, 980.0), (1080.0, 1003.0), (900.0, 990.5)] {
            let mut expected = 0.0;
            let step = 0.01;
            for count in 600..1500 {
                let count = f64::from(count);
                let weight = probability(count, rate);
                if weight < 1e-16 {
                    continue;
                }
                for index in 0..1600 {
                    let z = -8.0 + step * (f64::from(index) + 0.5);
                    let charge = (count * (1.0 + prnu * z)).min(full);
                    expected += weight * step * density(z) * cumulative((charge - level) / noise_e);
                }
            }
            let found = Law::of(&model, rate).is_read_from(level);
            // The bend at full well costs the sum over z step²/24 times the change of slope there.
            assert!((found - expected).abs() < 2e-6, "{rate} {level}: {found} {expected}");
        }
    }
}
