//! What leaves a reading edge by edge of the codes, as charges below zero leave a charge.
//!
//! With g the moments of codes at the charge k, which rise by Δ at the edge e of two codes, S(v) the probability of a charge below
//! v, and φ the noise that blurs both,
//!
//! ∫ f(v) \[g(k) − g(k + v)] dv = Σ Δ_e T(e − k),  T(x) = ∫ S(v) φ(x − v) dv, v < 0,
//!
//! by parts. Edges are gone through near k and near the lowest code; between, where they are many to S, their sum is an
//! integral. From the one to the other leads a weight that is as smooth as a normal law, so that nothing is seen of the seam.

use super::counts::{Charge, Count};
use super::curved::NODES as HERMITE;
use super::effort;
use super::ends::{MANY, Stretch};
use super::lookup::{Densities, Lookup};
use super::reading::{Asked, Moments, Reading};
use crate::numerics::gauss::{NODES, interpolated, panel};
use crate::numerics::normal::{cumulative, density};
use crate::numerics::rounding::{REACH, Rounding};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

/// Codes that are gone through one by one at either end, beyond what narrow laws need.
const ABOUT_ENDS: f64 = 15.0;
/// Width of the seam, in codes, as a standard deviation.
const SEAM: f64 = 1.3;
/// Half of the seam, in codes.
const HALF_SEAM: f64 = 8.0 * SEAM;
/// Codes that are gone through without a seam.
const FEW: f64 = 200.0;
/// Evaluations of a normal law that a step takes as long as.
const OF_STEP: u64 = 4;
/// Panels of a blurred step.
const PANELS: usize = 12;

/// The probability of charges below v < 0, looked up, of counts that noise blurs too.
fn share_below(stretch: &Stretch, counts: &[Count], noise_e: f64) -> Lookup {
    let mut table = Lookup::new(stretch.narrowest.hypot(noise_e), stretch.extent + REACH * noise_e);
    let densities = Densities::of(counts, noise_e);
    let mut found = 0.0;
    let mut last = table.distance(Lookup::STEPS);
    let [mut sum, mut slope] = densities.with_slope(-last);
    for index in (0..table.values.len()).rev() {
        let next = table.distance(index);
        let [density, rise] = densities.with_slope(-next);
        // ∫ by Euler and Maclaurin.
        let width = last - next;
        found += 0.5 * width * (sum + density) + width * width / 12.0 * (slope - rise);
        table.values[index] = [found, -density * table.by_step(next)];
        (last, sum, slope) = (next, density, rise);
    }
    table
}

/// What is below zero of a charge, with noise, e⁻; and T about 0, where there is noise, by panels.
struct Blurred {
    charge: Charge,
    noise_e: f64,
    below: Lookup,
    near: Vec<[f64; NODES]>,
}

impl Blurred {
    /// As many as one scene asks for.
    const KEPT: usize = 12;

    /// What is known of a charge, or is worked out: stages, causes and kinds of photosites ask for the same.
    fn recall(charge: &Charge, noise_e: f64, work_out: impl FnOnce() -> Self) -> Rc<Self> {
        thread_local! { static KNOWN: RefCell<VecDeque<(Rc<Blurred>, u64)>> = const { RefCell::new(VecDeque::new()) }; }
        let is_same = |(known, _): &&(Rc<Self>, u64)| known.charge == *charge && known.noise_e == noise_e;
        KNOWN.with(|known| {
            let found = known.borrow().iter().find(is_same).cloned();
            if let Some((found, took)) = found {
                effort::spend(took);
                return found;
            }
            let (found, took) = effort::counted(|| Rc::new(work_out()));
            if !effort::is_spent() {
                let mut kept = known.borrow_mut();
                kept.truncate(Self::KEPT - 1);
                kept.push_front((found.clone(), took));
            }
            found
        })
    }
}

/// Charges below zero that leave, as codes see it.
pub(super) struct Steps<'a> {
    stretch: &'a Stretch,
    counts: &'a [Count],
    ends: Rounding,
    /// Electrons to a code.
    code_e: f64,
    reading: &'a Reading,
    charge: &'a Charge,
    sharp: Rc<Blurred>,
    /// The same with the noise that was asked for last, and the step that it blurs.
    blurred: Option<Rc<Blurred>>,
    /// Distance, in codes, up to which narrow laws need all codes.
    fine: f64,
}

impl<'a> Steps<'a> {
    /// None where codes are not straight.
    pub fn new(charge: &'a Charge, stretch: &'a Stretch, counts: &'a [Count], reading: &'a Reading) -> Option<Self> {
        let Asked::Codes(adc, ends) = reading.asked else { return None };
        if adc.linearization.is_some() {
            return None;
        }
        let code_e = 1.0 / adc.adu_per_e;
        let narrow = counts.iter().map(|count| count.spread).filter(|spread| *spread < MANY * code_e);
        let fine = ABOUT_ENDS + 2.0 * REACH * narrow.fold(0.0, f64::max) / code_e;
        let sharp = Blurred::recall(charge, 0.0, || {
            let below = share_below(stretch, counts, 0.0);
            Blurred { charge: *charge, noise_e: 0.0, below, near: Vec::new() }
        });
        Some(Self { charge, stretch, counts, ends, code_e, reading, sharp, blurred: None, fine })
    }

    /// Gets ready for a noise, e⁻.
    fn prepare(&mut self, noise_e: f64) {
        if noise_e <= 0.0 || self.blurred.as_ref().is_some_and(|known| known.noise_e == noise_e) {
            return;
        }
        let width = 2.0 * REACH * noise_e / PANELS as f64;
        let of_panel = |index: usize| {
            let low = -REACH * noise_e + width * index as f64;
            let mut values = [0.0; NODES];
            let places = panel(low, low + width);
            values.iter_mut().zip(places).for_each(|(value, (x, _))| *value = self.blur(x, noise_e));
            values
        };
        let found = Blurred::recall(self.charge, noise_e, || {
            let below = share_below(self.stretch, self.counts, noise_e);
            Blurred { charge: *self.charge, noise_e, below, near: (0..PANELS).map(of_panel).collect() }
        });
        self.blurred = Some(found);
    }

    /// T near 0 by sums: what lies below 0 of the noise about x.
    fn blur(&self, x: f64, noise_e: f64) -> f64 {
        let (low, high) = (x - REACH * noise_e, (x + REACH * noise_e).min(0.0));
        // As narrow as what is summed: noise, or the law itself.
        let panels = ((high - low) / (2.5 * noise_e).min(1.5 * self.stretch.narrowest)).ceil().clamp(1.0, 400.0);
        let width = (high - low) / panels;
        let mut sum = 0.0;
        let mut index = 0.0;
        while index < panels {
            effort::spend(NODES as u64);
            let of_panel = panel(low + index * width, low + (index + 1.0) * width);
            sum +=
                of_panel.map(|(v, weight)| weight * self.sharp.below.at(v) * density((x - v) / noise_e)).sum::<f64>();
            index += 1.0;
        }
        sum / noise_e
    }

    /// T at so many electrons above the charge.
    fn step(&self, x: f64, noise_e: f64) -> f64 {
        if noise_e <= 0.0 {
            return if x <= 0.0 { self.sharp.below.at(x) } else { 0.0 };
        }
        let reach = REACH * noise_e;
        match self.blurred.as_deref().filter(|known| known.noise_e == noise_e) {
            _ if x >= reach => 0.0,
            Some(Blurred { below, .. }) if x <= -reach => below.at(x),
            Some(Blurred { near, .. }) => {
                let place = (x + reach) / (2.0 * reach) * PANELS as f64;
                let index = place.floor().min(PANELS as f64 - 1.0);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "one of the panels")]
                let values = &near[index as usize];
                interpolated(values, 2.0 * (place - index) - 1.0)
            }
            _ if x <= -reach => HERMITE.iter().map(|(z, weight)| weight * self.sharp.below.at(x + noise_e * z)).sum(),
            _ => self.blur(x, noise_e),
        }
    }

    /// Whether steps of this noise are known, or quickly found.
    pub fn is_known(&mut self, noise_e: f64, is_only: bool) -> bool {
        if is_only {
            self.prepare(noise_e);
        }
        is_only || noise_e < 0.4 * self.stretch.narrowest
    }

    /// What leaves at a charge with such noise.
    pub fn moments(&self, electrons: f64, noise_e: f64) -> Moments {
        let Asked::Codes(adc, _) = self.reading.asked else { return [0.0; 4] };
        let level = adc.level_at(electrons + self.reading.offset_e);
        let blur = REACH * noise_e / self.code_e;
        // Edges are half a code above codes.
        let edge_below = |level: f64| (level - 0.5).floor() + 0.5;
        let top = edge_below((level + blur).min(self.ends.highest - 0.5));
        let reach = level - self.stretch.extent / self.code_e - blur;
        let lowest = self.ends.lowest + 0.5;
        let last = reach.max(lowest);
        let mut sum = [0.0; 4];
        let mut add = |edge: f64, weight: f64| {
            if weight != 0.0 {
                let x = edge - (self.reading.center);
                let rises = [1.0, 2.0 * x, 3.0 * x * x + 0.25, 4.0 * x.powi(3) + x];
                sum.iter_mut().zip(rises).for_each(|(sum, rise)| *sum += weight * rise);
            }
        };
        let step = |edge: f64| {
            effort::spend(OF_STEP);
            self.step((edge - level) * self.code_e, noise_e)
        };
        // The weights of what is gone through one by one, from the charge down, and from the lowest code up.
        let near = level.min(top) - blur - self.fine - HALF_SEAM;
        let far = lowest + ABOUT_ENDS + HALF_SEAM;
        let is_railed = reach < lowest;
        let share = |edge: f64| {
            let of_charge = cumulative((edge - near) / SEAM);
            let of_rail = if is_railed { cumulative((far - edge) / SEAM) } else { 0.0 };
            1.0 - (1.0 - of_charge) * (1.0 - of_rail)
        };
        let mut edge = top;
        if top - last < FEW || near - HALF_SEAM < far + HALF_SEAM && is_railed {
            while edge >= last {
                add(edge, step(edge));
                edge -= 1.0;
            }
            return sum;
        }
        while edge >= last && edge > near - HALF_SEAM {
            add(edge, share(edge) * step(edge));
            edge -= 1.0;
        }
        edge = lowest;
        while is_railed && edge < far + HALF_SEAM {
            add(edge, share(edge) * step(edge));
            edge += 1.0;
        }
        for pair in self.panels(level, near, if is_railed { far } else { f64::NEG_INFINITY }, last) {
            for (edge, weight) in panel(pair[0], pair[1]) {
                add(edge, weight * (1.0 - share(edge)) * step(edge));
            }
        }
        sum
    }

    /// Panels between the ends, in codes: narrow in the seams, and growing with the distance.
    fn panels(&self, level: f64, near: f64, far: f64, last: f64) -> Vec<[f64; 2]> {
        let (start, end) = (near + HALF_SEAM, if far.is_finite() { far - HALF_SEAM } else { last });
        let mut found = Vec::new();
        let mut high = start;
        while high > end {
            let in_seam = high > near - HALF_SEAM || high <= far + HALF_SEAM;
            let widest = 1.5 * self.stretch.narrowest.max((level - high) * self.code_e / 4.5) / self.code_e;
            let mut low = high - widest.min(if in_seam { 3.0 * SEAM } else { f64::INFINITY });
            if far.is_finite() && high > far + HALF_SEAM {
                low = low.max(far + HALF_SEAM);
            }
            if high > near - HALF_SEAM {
                low = low.max(near - HALF_SEAM);
            }
            found.push([low.max(end), high]);
            high = low;
        }
        found
    }
}
