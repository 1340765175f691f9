//! The law of a photosite's charge, exactly: counts of light and dark, fixed patterns, full well, and what reads it.
//!
//! Given its two counts a photosite's charge is normal over the photosites of a frame, since the fixed patterns are; so its
//! law is a sum over counts of normal laws ([`Node`]). Those that full well is far above are read in closed form; to those
//! within its reach comes what full well takes from them, an integral over their charge ([`ends`](super::ends)); and to
//! those whose sensitivities are cut off at zero what that adds ([`rectified`](super::rectified)).

use super::counts::{Charge, Count};
use super::effort;
use super::ends::at_full_well;
use super::memory::Memory;
use super::moments::Prediction;
pub(super) use super::node::Law;
use super::node::{MANY_WELLS, Node};
use super::reading::{Asked, ENDLESS, Moments, Reading, codes_of};
use super::rectified::{corrections, signed_nodes};
use crate::frame::to_sample;
use crate::metadata::AdcRecord;
use crate::numerics::normal::NearlyNormal;
use crate::numerics::rounding::{REACH, Rounding, SMOOTH};
use crate::stages::noise::NoiseModel;
use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

/// Spreads below this, in e⁻, are none.
const LEAST_STD: f64 = 1e-6;

/// Evaluations that a normal law takes beside an end of the codes, more than others.
const OF_ENDS: u64 = 8;

/// Evaluations that working out normal laws takes as long as.
const OF_NORMALS: u64 = 60;

/// Weights below this do not count.
const LEAST_WEIGHT: f64 = 1e-19;

impl Law {
    pub fn of(model: &NoiseModel, expected_e: f64) -> Self {
        let charge = |rate: f64, is_shot: bool, pattern: f64| {
            let shot = is_shot.then_some(model.poisson);
            // Samples are single precision, which ties of codes show where nothing is drawn.
            let rate = if shot.is_none() { f64::from(to_sample(rate)) } else { rate };
            Charge { rate: rate.max(0.0), shot, pattern: if rate > 0.0 { pattern } else { 0.0 } }
        };
        let mut light = charge(expected_e, model.signal_shot, model.response());
        let mut dark = charge(model.dark_e, model.dark_shot, model.dcnu);
        // The sum of two counts without patterns is a count.
        if light.pattern <= 0.0 && dark.pattern <= 0.0 && light.shot == dark.shot {
            light.rate += dark.rate;
            dark.rate = 0.0;
        }
        let full_well_e = f64::from(to_sample(model.full_well_e));
        let (trap_e, are_few) = (model.tails.trap_e, model.tails.are_few);
        Self { light, dark, full_well_e, read_noise_e: model.added(), trap_e, are_few }
    }

    /// Whether full well is within reach of any photosite.
    pub fn reaches_full_well(&self) -> bool {
        self.light.most() + self.dark.most() >= self.full_well_e
    }

    /// Whether codes are the charge, a uniform error, and nothing else.
    pub fn is_plain(&self, adc: &AdcRecord) -> bool {
        // Photosites of next to no sensitivity have next to no spread.
        let spread_e = if self.is_rectified() { 0.0 } else { self.least_pattern_std() };
        adc.linearization.is_none()
            && (adc.adu_per_e * self.read_noise_e.hypot(spread_e) >= SMOOTH || self.counts_hide(adc))
            && !self.reaches_full_well()
            && (self.is_within(adc) || self.is_all_but_within(adc))
    }

    /// Whether next to none of what is read is beyond an end of the codes, of a charge that sensitivities of zero do not cut off: one in
    /// 10¹⁵, 8 standard deviations off, and what skewness adds to that above.
    fn is_all_but_within(&self, adc: &AdcRecord) -> bool {
        const DEVIATIONS: f64 = 8.0;
        !self.is_rectified() && self.ends_are_off(adc, DEVIATIONS)
    }

    /// Whether so little is beyond an end that what lines share does not tell: one in 10¹⁰, 6.5 standard deviations off.
    pub fn is_nearly_within(&self, adc: &AdcRecord) -> bool {
        const DEVIATIONS: f64 = 6.5;
        self.is_within(adc) || !self.is_rectified() && self.ends_are_off(adc, DEVIATIONS)
    }

    /// Whether both ends are so many standard deviations off the mean, and off what skewness adds to these.
    fn ends_are_off(&self, adc: &AdcRecord, deviations: f64) -> bool {
        const SKEWED_E: f64 = 30.0;
        let of_skewness = (deviations * deviations - 1.0) / 6.0;
        let read = self.cumulants().plus(NearlyNormal::normal(0.0, self.read_noise_e.powi(2)));
        let reach = deviations * read.variance.sqrt();
        let skewed = if read.third > 0.0 { of_skewness * read.third / read.variance + SKEWED_E } else { 0.0 };
        adc.electrons_at(0.0) < read.mean - reach - self.trap_e
            && adc.electrons_at(f64::from(adc.top_code())) > read.mean + reach + skewed + self.trap_e
    }

    /// Whether counts and read noise together leave next to nothing of how codes are rounded, as much as read noise of [`SMOOTH`]
    /// codes alone would: of the ripple of m turns to a code each is a factor of the characteristic function at θ = 2π m K,
    ///
    /// |E e^(iθ x P)| ≤ e^(−λ (1 − cos xθ)) at the sensitivity x where that is most, and e^(−θ²σ²/2) of read noise.
    pub fn counts_hide(&self, adc: &AdcRecord) -> bool {
        const HIDDEN: f64 = 2.0 * PI * PI * SMOOTH * SMOOTH;
        const MOST_TURNS: u32 = 64;
        for turns in 1..=MOST_TURNS {
            let angle = TAU * adc.adu_per_e * f64::from(turns);
            if 0.5 * (angle * self.read_noise_e).powi(2) >= HIDDEN {
                return true;
            }
            if self.damping(angle) < HIDDEN {
                return false;
            }
        }
        false
    }

    /// Whether few counts, each a code or codes on from the last, show how these are rounded at next to all photosites as no less than a
    /// normal law of so many codes would, however many codes they scatter over.
    pub fn counts_show(&self, adc: &AdcRecord, std_codes: f64) -> bool {
        const FEW: [f64; 2] = [1000.0, 5000.0];
        const MOST_TURNS: u32 = 64;
        let noise_e = self.read_noise_e.max(1e-3);
        let few = FEW[usize::from(self.is_sharp())];
        if self.is_kind() || self.light.least_counts(noise_e) * self.dark.least_counts(noise_e) > few {
            return false;
        }
        // Within three standard deviations of the sensitivity in place of nine.
        let most = |charge: &Charge| Charge { pattern: charge.pattern / 3.0, ..*charge };
        let law = Self { light: most(&self.light), dark: most(&self.dark), ..*self };
        let hidden = 2.0 * (PI * std_codes).powi(2);
        let shows = |turns: u32| {
            let angle = TAU * adc.adu_per_e * f64::from(turns);
            law.damping(angle) + f64::from(turns).ln() < hidden
        };
        (1..=MOST_TURNS).any(shows)
    }

    /// Whether it is that of one of the many kinds of photosites that hot ones and jumps make, of each of which little may be worked out.
    fn is_kind(&self) -> bool {
        self.are_few || self.trap_e > 0.0
    }

    /// Whether read noise blurs next to nothing of where along their sensitivities the codes of photosites change.
    pub fn is_sharp(&self) -> bool {
        const NEXT_TO_NOTHING: f64 = 0.005;
        let differs = |charge: &Charge| charge.pattern * charge.rate;
        !self.is_kind()
            && self.read_noise_e <= NEXT_TO_NOTHING * differs(&self.light).max(differs(&self.dark))
            && (self.read_noise_e <= 0.0 || !self.reaches_full_well())
    }

    /// The least −ln |E e^(iθy)| of what any photosite reads, y in electrons, where nothing cuts it off.
    pub fn damping(&self, angle: f64) -> f64 {
        0.5 * (angle * self.read_noise_e).powi(2) + self.light.damping(angle) + self.dark.damping(angle)
    }

    /// The same, full photosites included, of which read noise alone hides anything.
    pub fn least_damping(&self, angle: f64) -> f64 {
        if self.reaches_full_well() { 0.5 * (angle * self.read_noise_e).powi(2) } else { self.damping(angle) }
    }

    /// Whether full well, or sensitivities of zero, cut the charge off.
    pub fn is_cut(&self) -> bool {
        self.reaches_full_well() || self.is_rectified()
    }

    /// Whether sensitivities of zero do.
    pub fn is_rectified(&self) -> bool {
        self.light.is_rectified(self.full_well_e) || self.dark.is_rectified(self.full_well_e)
    }

    /// The standard deviation, in e⁻, of a normal error that would leave of no ripple more than 1/m of what charge and read noise leave
    /// of any, m its turns to a code: of the one that they leave most of.
    pub fn blur_by_turns_e(&self, adc: &AdcRecord) -> f64 {
        const MOST_TURNS: u32 = 64;
        let spread_e = self.least_pattern_std();
        let left = |turns: u32| {
            let angle = TAU * adc.adu_per_e * f64::from(turns);
            f64::from(turns).ln() + 0.5 * (angle * spread_e).powi(2) + self.damping(angle)
        };
        let least = (1..=MOST_TURNS).map(left).fold(f64::INFINITY, f64::min);
        (2.0 * least).sqrt() / (TAU * adc.adu_per_e)
    }

    /// Whether no end of the codes is within reach.
    pub fn is_within(&self, adc: &AdcRecord) -> bool {
        let [low, high] = self.reach();
        adc.electrons_at(0.0) < low && adc.electrons_at(f64::from(adc.top_code())) > high
    }

    /// The same where all photosites have this share of the light, whose spread over them stays; shot noise is that of the
    /// light.
    pub fn gained(&self, share: f64) -> Self {
        let share = share.max(f64::MIN_POSITIVE);
        let light = Charge { rate: self.light.rate * share, pattern: self.light.pattern / share, ..self.light };
        Self { light, ..*self }
    }

    /// Whether the charge is so far above full well that its laws are cut off at floors.
    pub fn has_floors(&self) -> bool {
        self.light.rate + self.dark.rate > MANY_WELLS * self.full_well_e
    }

    /// The smallest spread that patterns give to counts that matter, e⁻.
    pub fn least_pattern_std(&self) -> f64 {
        self.light.least_pattern_std().hypot(self.dark.least_pattern_std())
    }

    /// Goes through the normal laws that make up that of the charge, as many as a sum over them needs that is smooth on the scale
    /// of `noise_e` beside their own spread; of those from which the ends take nothing, where that is what is asked, none.
    fn each_node(&self, noise_e: f64, reading: &Reading, mut of: impl FnMut(Node)) {
        let idle = reading.idle_e();
        let is_idle = |mean: f64, reach: f64| idle[0] < mean - reach && mean + reach < idle[1];
        // In tails normal laws are not as exact as what is asked of these.
        let is_of_tails = matches!(reading.asked, Asked::Beyond(_)) && !self.are_few;
        let is_met = |node: &Node| !is_idle(node.mean, REACH * node.std);
        if let Some(laws) = (!is_of_tails).then(|| self.as_normals(noise_e, reading.noise_e)).flatten() {
            effort::spend(OF_NORMALS);
            return laws.nodes().filter(is_met).for_each(of);
        }
        if let Some(nodes) = self.nodes_of_sum(noise_e) {
            effort::spend(nodes.len() as u64);
            return nodes.into_iter().filter(is_met).for_each(of);
        }
        let is_light_wider = self.light.shot_std() >= self.dark.shot_std();
        let (wide, narrow) = if is_light_wider { (&self.light, &self.dark) } else { (&self.dark, &self.light) };
        let given = self.least_pattern_std().hypot(noise_e);
        // Where laws are cut off at the count of the other charge, that is told apart to an electron.
        let ends_at = |charge: &Charge, by: &Charge| {
            by.is_rectified(self.full_well_e) && charge.pattern <= 0.0 && self.has_floors()
        };
        let [is_inner_told, is_outer_told] = [ends_at(narrow, wide), ends_at(wide, narrow)];
        let mut by_step: Vec<(u32, Vec<_>)> = Vec::new();
        for inner in narrow.counts(if is_inner_told { noise_e } else { wide.shot_std().hypot(given) }) {
            let spread = if is_outer_told { 0.0 } else { wide.least_pattern_std().hypot(inner.spread) };
            let smoothing = spread.hypot(noise_e);
            // Powers of √2, so that few sums over counts serve all.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number")]
            let rung = (2.0 * smoothing.clamp(1.0, 1e15).log2()).floor() as u32;
            if !by_step.iter().any(|(known, _)| *known == rung) {
                let smoothing = if rung == 0 { smoothing.min(1.0) } else { (f64::from(rung) / 2.0).exp2() };
                by_step.push((rung, wide.counts(smoothing)));
            }
            let outer = by_step.iter().find(|(known, _)| *known == rung).map(|(_, counts)| counts);
            effort::spend(outer.map_or(0, |counts| counts.len() as u64));
            if effort::is_spent() {
                return;
            }
            for outer in outer.into_iter().flatten() {
                let weight = inner.weight * outer.weight;
                let reach = REACH * (inner.spread + outer.spread);
                if weight <= LEAST_WEIGHT || is_idle(inner.electrons + outer.electrons, reach) {
                    continue;
                }
                let std = match [inner.spread, outer.spread] {
                    [one, 0.0] | [0.0, one] => one,
                    [inner, outer] => inner.hypot(outer),
                };
                let mean = inner.electrons + outer.electrons;
                // Below what the charge holds that differs less there is next to nothing.
                let differs = |charge: &Charge| charge.pattern * charge.rate;
                let floor = match differs(narrow).total_cmp(&differs(wide)) {
                    _ if !self.has_floors() => f64::NEG_INFINITY,
                    Ordering::Greater => outer.electrons,
                    Ordering::Less => inner.electrons,
                    Ordering::Equal => 0.0,
                };
                of(Node { mean, floor, std: if std < LEAST_STD { 0.0 } else { std }, weight });
            }
        }
    }

    /// The same by the sum n of both counts, where they are many pairs: given n each is binomial, and the variance over photosites,
    /// σ₁² n₁² + σ₂² n₂², which has its mean for all pairs of one sum, scatters by so small a share δ of all variance that moments
    /// change by δ²/8, 10⁻⁷, and by next to nothing from one count to the next: patterns, or what is added before anything is cut off,
    /// blur counts, or leave each apart.
    fn nodes_of_sum(&self, noise_e: f64) -> Option<Vec<Node>> {
        const MANY_PAIRS: f64 = 1000.0;
        const MOST_SCATTER: f64 = 1e-3;
        const BLURRED_E: f64 = 1.0;
        const APART_E: f64 = 0.1;
        let both = [&self.light, &self.dark];
        let is_cut = |charge: &Charge| charge.is_rectified(self.full_well_e);
        let spread_e = self.least_pattern_std();
        let widest_e = (self.light.pattern * self.light.rate).hypot(self.dark.pattern * self.dark.rate);
        if !both.into_iter().all(Charge::is_counted)
            || both.into_iter().any(is_cut)
            || spread_e.max(noise_e) < BLURRED_E && widest_e > APART_E
            || self.has_floors()
        {
            return None;
        }
        let [light, dark] = both;
        let rate = light.rate + dark.rate;
        let [p, q] = [light.rate / rate, dark.rate / rate];
        let scatter =
            (light.pattern.powi(2) * light.rate - dark.pattern.powi(2) * dark.rate).abs() * (rate * p * q).sqrt();
        let smoothing = spread_e.hypot(noise_e);
        let pairs = light.least_counts(smoothing) * dark.least_counts(smoothing);
        if pairs < MANY_PAIRS || 2.0 * scatter > MOST_SCATTER * rate {
            return None;
        }
        let node = |count: Count| {
            let n = count.electrons;
            let squares = [p, q].map(|share| (n * share).powi(2) + n * p * q);
            let variance = light.pattern.powi(2) * squares[0] + dark.pattern.powi(2) * squares[1];
            Node { mean: n, std: variance.sqrt(), weight: count.weight, floor: f64::NEG_INFINITY }
        };
        let counts = Charge { rate, pattern: 0.0, ..*light }.counts(smoothing);
        Some(counts.into_iter().map(node).filter(|node| node.weight > LEAST_WEIGHT).collect())
    }

    /// Expected moments of a reading.
    pub fn expect(&self, reading: &Reading) -> Moments {
        if self.trap_e > 0.0 {
            let mut sum = [0.0; 4];
            for (share, offset_e) in self.jumps() {
                let found = Self { trap_e: 0.0, ..*self }.expect(&reading.off_by(offset_e));
                sum.iter_mut().zip(found).for_each(|(sum, moment)| *sum += share * moment);
            }
            return sum;
        }
        thread_local! { static KNOWN: Memory<(Law, Reading), Moments> = const { Memory::new() }; }
        KNOWN.with(|known| known.recall((*self, *reading), |(law, reading)| law.work_out(reading)))
    }

    /// What readings are off by, and how often.
    pub fn jumps(&self) -> Vec<(f64, f64)> {
        match self.trap_e {
            0.0 => vec![(1.0, 0.0)],
            trap_e => vec![(0.25, -trap_e), (0.5, 0.0), (0.25, trap_e)],
        }
    }

    fn work_out(&self, reading: &Reading) -> Moments {
        let full = self.full_well_e;
        let [least, most] = self.extent();
        if least >= full || reading.is_one(least, most.min(full)) {
            return reading.at(least.min(full), 0.0);
        }
        // Where the highest code hides full well, charges may go on beyond it.
        let is_full_hidden = full > reading.ends_e()[1];
        let is_full_far = is_full_hidden || !self.reaches_full_well();
        if is_full_far && let Some(found) = self.in_closed_form(reading) {
            return found;
        }
        self.sum_of_nodes(reading, is_full_far)
    }

    /// The sum over normal laws, which full well cuts unless it is far.
    pub(super) fn sum_of_nodes(&self, reading: &Reading, is_full_far: bool) -> Moments {
        let full = self.full_well_e;
        let mut sum = [0.0; 4];
        let mut add = |weight: f64, moments: Moments| {
            for (sum, moment) in sum.iter_mut().zip(moments) {
                *sum += weight * moment;
            }
        };
        let mut near = Vec::new();
        let at_full = if full.is_finite() { reading.at(full, 0.0) } else { [0.0; 4] };
        let [lower, upper] = reading.ends_e();
        let mut put = |node: Node| {
            let reach = REACH * node.std;
            effort::spend(if node.mean - reach < lower || node.mean + reach > upper { 2 + OF_ENDS } else { 2 });
            if effort::is_spent() {
                return;
            }
            if node.floor == f64::NEG_INFINITY && (is_full_far || node.mean + reach <= full) {
                add(node.weight, reading.at(node.mean, node.std * node.std));
            } else if node.mean - reach >= full || node.floor >= full {
                add(node.weight, at_full);
            } else if node.std <= 0.0 {
                add(node.weight, reading.at(node.mean, 0.0));
            } else {
                near.push(node);
            }
        };
        self.each_node(if is_full_far { reading.noise_e } else { 0.0 }, reading, &mut put);
        if !is_full_far {
            signed_nodes(self).into_iter().for_each(put);
        }
        if !near.is_empty() {
            // Of few what their law below full well shows of rounding does not count.
            let below_full = if self.are_few { reading.coarse() } else { *reading };
            add(1.0, at_full_well(&near, full, &below_full, at_full));
        }
        add(1.0, corrections(self, reading, if is_full_far { f64::INFINITY } else { full }));
        sum
    }

    /// A charge that all is expected about.
    fn about_e(&self) -> f64 {
        (self.light.rate + self.dark.rate).min(self.full_well_e)
    }

    /// What is read of the electrons.
    pub fn of_electrons(&self) -> Reading {
        Reading::electrons(self.read_noise_e, self.about_e())
    }

    /// What is read of the codes between such ends.
    pub fn of_codes(&self, adc: &AdcRecord, ends: Rounding) -> Reading {
        Reading::codes(*adc, ends, self.read_noise_e, self.about_e())
    }

    /// What is predicted of a reading.
    pub fn predict(&self, reading: &Reading) -> Prediction {
        Prediction::about(reading.center, &self.expect(reading))
    }

    /// Mean slope of the codes by what is added to the charge, ADU per e⁻: that of the mean over a tenth of a code to either
    /// side.
    pub fn mean_slope(&self, adc: &AdcRecord) -> f64 {
        let step = 0.1 / adc.sample_per_e(self.about_e()).abs().max(f64::MIN_POSITIVE);
        let reading = self.of_codes(adc, codes_of(adc));
        let [above, below] = [step, -step].map(|offset_e| self.expect(&Reading { offset_e, ..reading })[0]);
        (above - below) / (2.0 * step)
    }

    /// Whether no end of the codes is within reach of what is read, full photosites included.
    pub fn is_read_within(&self, adc: &AdcRecord) -> bool {
        let [low, high] = self.reach();
        let [lower, upper] = [0.0, f64::from(adc.top_code())].map(|code| adc.electrons_at(code));
        lower < low && upper > high.min(self.full_well_e + REACH * self.read_noise_e + self.trap_e)
    }

    /// The variance that codes without ends would have; none where the ends are out of reach.
    pub fn endless_variance(&self, adc: &AdcRecord) -> Option<f64> {
        (!self.is_read_within(adc)).then(|| self.predict(&self.of_codes(adc, ENDLESS)).moments.variance)
    }

    /// The least and the largest charge, full well apart.
    pub fn extent(&self) -> [f64; 2] {
        [self.light.least() + self.dark.least(), self.light.most() + self.dark.most()]
    }

    /// The same with read noise.
    pub fn reach(&self) -> [f64; 2] {
        let (noise_e, [least, most]) = (REACH * self.read_noise_e + self.trap_e, self.extent());
        [least - noise_e, most + noise_e]
    }

    /// The probability that charge and read noise together are no less than a level.
    pub fn is_read_from(&self, level_e: f64) -> f64 {
        // A level that a count reaches counts as reached, whatever its last bits.
        let below = level_e - 1e-12 * level_e.abs().max(1.0);
        // Where none or all lie beyond, there is nothing to sum.
        let [least, most] = self.extent().map(|charge| charge.min(self.full_well_e));
        let reach = REACH * self.read_noise_e + self.trap_e;
        if most + reach < below {
            return 0.0;
        }
        if least - reach > below {
            return 1.0;
        }
        self.expect(&Reading::beyond(self.read_noise_e, below))[0].clamp(0.0, 1.0)
    }

    /// The probability that the charge, before full well and read noise, is no less than a level.
    pub fn reaches(&self, level_e: f64) -> f64 {
        Self { read_noise_e: 0.0, trap_e: 0.0, full_well_e: f64::INFINITY, ..*self }.is_read_from(level_e)
    }
}
