//! What is drawn anew in each exposure of codes: E v, the mean over photosites of the variance that each has over exposures.
//!
//! Given its sensitivities x and y, and its offset u, a photosite reads x P + y D + u beside read noise, P and D counts, cut off at full well.
//! Of its code k
//!
//! v = Var k,  P(k > c) = ∫ φ(z) P(x P + y D > e − u − r z) dz   over charges below full well, e the edge above the code c
//!
//! Few counts are gone through one by one; of many the first four cumulants tell P(x P + y D > n), by Edgeworth's series, to about the cube
//! of their skewness. E v is a sum over sensitivities in panels as wide as what a photosite scatters by, where an edge is within its reach.
//! Unlike the difference of the whole variance and that of the means it is as exact beside wide patterns as without any.

use super::counts::{Charge, Count};
use super::effort;
use super::law::Law;
use super::memory::Memory;
use super::one_photosite::{PANEL, beyond};
use super::pattern_nodes::{Knee, between, fine_sensitivities, sensitivities};
use super::reading::{Asked, Reading};
use super::sharp_counts::SharpCounts;
use crate::metadata::{AdcRecord, PoissonKind};
use crate::numerics::edges;
use crate::numerics::gauss::panel;
use crate::numerics::normal::{NearlyNormal, cumulative, density};
use crate::numerics::rounding::{REACH, Rounding, SMOOTH};

/// Counts and sensitivities that are gone through one by one at most, and at each of many offsets.
const AFFORDABLE: f64 = 150_000.0;
const AFFORDABLE_IF_MANY: f64 = 10_000.0;

/// Evaluations beyond which nothing is said.
const MOST: u64 = 8_000_000;

/// Where what changes with offsets does so over less than this of their standard deviation, nothing is said.
const LEAST_SMOOTH: f64 = 0.006;

/// The scale on which sensitivities stand for offsets: none is cut off at zero.
const OFFSET: f64 = 0.01;

/// Sensitivities that charges follow by no more than so many times what they scatter by take no panels.
const SHALLOW: f64 = 3.0;

/// Counts of a smaller read noise are told apart by this, in e⁻.
const FINEST_E: f64 = 0.1;

/// What does not count of a sum of probabilities.
const NOTHING: f64 = 1e-17;

/// What is drawn anew, and what is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Anew {
    /// E v.
    pub variance: f64,
    /// The variance of the means of photosites.
    pub fixed: f64,
}

impl Anew {
    /// E v of codes whose whole variance is known: by the lesser of the two shares, of which less is lost.
    pub fn of(self, whole: f64) -> f64 {
        if self.fixed < self.variance { whole - self.fixed } else { self.variance }
    }
}

/// That of codes of a law, whose read noise is what is drawn anew alone, at photosites of offsets of rms `offsets_e`; NaN where it takes too
/// long.
pub(super) fn drawn_anew(law: &Law, adc: &AdcRecord, ends: Rounding, offsets_e: f64) -> Anew {
    thread_local! { static KNOWN: Memory<(Law, Reading, f64), Anew> = const { Memory::new() }; }
    let key = (*law, law.of_codes(adc, ends), offsets_e);
    let none = Anew { variance: f64::NAN, fixed: f64::NAN };
    KNOWN.with(|known| {
        known.recall(key, |(law, reading, offsets_e)| {
            effort::within(MOST, || over_offsets(law, reading, *offsets_e)).map_or(none, |sums| sums.found())
        })
    })
}

/// Sums over photosites.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    variance: f64,
    mean: f64,
    square: f64,
}

impl Sums {
    /// Takes in photosites of such a share, their variance and mean.
    fn add(&mut self, weight: f64, [variance, mean]: [f64; 2]) {
        self.variance += weight * variance;
        self.mean += weight * mean;
        self.square += weight * mean * mean;
    }

    /// Takes in a share of what others have.
    fn take(&mut self, weight: f64, other: &Self) {
        self.variance += weight * other.variance;
        self.mean += weight * other.mean;
        self.square += weight * other.square;
    }

    fn found(&self) -> Anew {
        Anew { variance: self.variance, fixed: (self.square - self.mean * self.mean).max(0.0) }
    }
}

/// The mean over offsets: smooth over what patterns and a photosite scatter by, but where full photosites are at an edge.
fn over_offsets(law: &Law, reading: &Reading, offsets_e: f64) -> Sums {
    let exposed = Exposed::of(law, *reading, AFFORDABLE);
    if offsets_e <= 0.0 {
        return exposed.mean_over_patterns();
    }
    let spread_e = [law.light, law.dark].map(|charge| charge.pattern * charge.rate);
    // Patterns blur counts where they spread these by more.
    let pattern_e = if law.least_pattern_std() > 1.0 { spread_e[0].hypot(spread_e[1]) } else { 0.0 };
    let smooth = exposed.blur_e().hypot(pattern_e) / offsets_e;
    if smooth < LEAST_SMOOTH {
        effort::spend(u64::MAX);
        return Sums::default();
    }
    let places = if law.reaches_full_well() {
        let width = exposed.noise_e / offsets_e;
        between(-REACH, 3.0 * smooth.min(1.0), &exposed.knees_at_full(offsets_e, width))
    } else {
        fine_sensitivities(&Charge { rate: 1.0, shot: None, pattern: OFFSET }, OFFSET * smooth)
            .into_iter()
            .map(|(place, weight)| ((place - 1.0) / OFFSET, weight))
            .collect()
    };
    let mut sum = Sums::default();
    for (place, weight) in places {
        sum.take(weight, &Exposed::of(law, reading.off_by(offsets_e * place), AFFORDABLE_IF_MANY).mean_over_patterns());
        if effort::is_spent() {
            break;
        }
    }
    sum
}

/// A photosite that is exposed again and again.
struct Exposed<'a> {
    law: &'a Law,
    reading: Reading,
    adc: AdcRecord,
    ends: Rounding,
    noise_e: f64,
    jumps: Vec<(f64, f64)>,
    affordable: f64,
}

/// One axis of the sensitivities.
#[derive(Clone, Copy, PartialEq)]
enum Axis {
    Light,
    Dark,
}

impl<'a> Exposed<'a> {
    fn of(law: &'a Law, reading: Reading, affordable: f64) -> Self {
        let Asked::Codes(adc, ends) = reading.asked else { unreachable!("codes are asked for") };
        Self { law, reading, adc, ends, noise_e: law.read_noise_e, jumps: law.jumps(), affordable }
    }

    fn charge(&self, axis: Axis) -> &Charge {
        match axis {
            Axis::Light => &self.law.light,
            Axis::Dark => &self.law.dark,
        }
    }

    /// Standard deviation of the charge of a photosite of such sensitivities, e⁻.
    fn charge_std(&self, at: [f64; 2]) -> f64 {
        (at[0] * self.law.light.shot_std()).hypot(at[1] * self.law.dark.shot_std())
    }

    /// The same with read noise.
    fn std(&self, at: [f64; 2]) -> f64 {
        self.charge_std(at).hypot(self.noise_e)
    }

    /// What offsets are smoothed by, e⁻: what a photosite scatters by, or read noise where it holds so few counts that each shows.
    fn blur_e(&self) -> f64 {
        const MANY_E: f64 = 10.0;
        let std = self.std([1.0; 2]);
        let is_counted = [self.law.light, self.law.dark].iter().any(|charge| charge.shot == Some(PoissonKind::Exact));
        if is_counted && std < MANY_E { std.min(self.noise_e.max(FINEST_E)) } else { std }
    }

    /// Where offsets bring full photosites to an edge.
    fn knees_at_full(&self, offsets_e: f64, width: f64) -> Vec<Knee> {
        let mut found = Vec::new();
        for (_, jump_e) in &self.jumps {
            let full_e = self.law.full_well_e + self.reading.offset_e + jump_e;
            let mut code = self.ends.code(self.adc.level_at(full_e - REACH * offsets_e));
            let last = self.ends.code(self.adc.level_at(full_e + REACH * offsets_e));
            // Where there are more, panels are narrower than codes.
            while code < last && found.len() < 100 {
                found.push(Knee { z: (self.adc.electrons_at(code + 0.5) - full_e) / offsets_e, width });
                code += 1.0;
            }
        }
        found
    }

    /// The mean over sensitivities.
    fn mean_over_patterns(&self) -> Sums {
        let mut sum = Sums::default();
        if [self.law.light, self.law.dark].iter().all(|charge| charge.pattern <= 0.0 || charge.rate <= 0.0) {
            let moments = self.law.predict(&self.reading).moments;
            sum.add(1.0, [moments.variance, moments.mean - self.reading.center]);
            return sum;
        }
        let [light, dark] = [&self.law.light, &self.law.dark].map(|charge| Charge { pattern: 0.0, ..*charge });
        let noise_e = self.noise_e.max(1e-3);
        let least = light.least_counts(noise_e) * dark.least_counts(noise_e);
        if least <= self.affordable {
            let counts = [light, dark].map(|charge| {
                let mut counts = charge.counts(noise_e);
                counts.retain(|count| count.weight > 1e-15);
                counts
            });
            if let Some(sum) = self.by_counts(&counts) {
                return sum;
            }
        }
        self.over_panels()
    }

    /// The same count by count, at sensitivities that follow what read noise leaves; none where it takes too many.
    fn by_counts(&self, counts: &[Vec<Count>; 2]) -> Option<Sums> {
        let charges = [&self.law.light, &self.law.dark];
        let is_counted = charges.iter().any(|charge| charge.shot == Some(PoissonKind::Exact));
        let std = self.std([1.0; 2]);
        let finest = if is_counted { std.min(self.noise_e.max(FINEST_E)) } else { std };
        let [xs, ys] = charges.map(|charge| fine_sensitivities(charge, finest.max(1e-9)));
        if let Some(sum) = self.over_steps(counts, [&xs, &ys]) {
            return Some(sum);
        }
        let all = (xs.len() * ys.len()) as f64 * (counts[0].len() * counts[1].len()) as f64;
        if all > self.affordable {
            return None;
        }
        let mut sum = Sums::default();
        for y in ys.iter().take_while(|_| !effort::is_spent()) {
            xs.iter().for_each(|x| sum.add(x.1 * y.1, self.counted(counts, [x.0, y.0])));
        }
        Some(sum)
    }

    /// The same where nothing blurs what photosites read of each count: exact along the axis on which charges differ more, at the given
    /// sensitivities of the other; none of too many.
    fn over_steps(&self, counts: &[Vec<Count>; 2], places: [&[(f64, f64)]; 2]) -> Option<Sums> {
        const MOST_PAIRS: usize = 5000;
        let axis = self.wider();
        let [inner, outer] = match axis {
            Axis::Light => [0, 1],
            Axis::Dark => [1, 0],
        };
        let charge = self.charge(axis);
        let is_few = counts[0].len() * counts[1].len() <= MOST_PAIRS && self.affordable >= AFFORDABLE;
        if !is_few || !self.law.is_sharp() || !charge.is_counted() {
            return None;
        }
        let most = self.affordable / places[outer].len() as f64;
        let mut sum = Sums::default();
        for (other, weight) in places[outer] {
            let sharp = SharpCounts {
                counts: &counts[inner],
                sigma: charge.pattern,
                others: &counts[outer],
                other: *other,
                jumps: &self.jumps,
                full_e: self.law.full_well_e,
                reading: &self.reading,
            };
            let [variance, mean, square] = sharp.over_sensitivities(most)?;
            sum.take(*weight, &Sums { variance, mean, square });
        }
        Some(sum)
    }

    /// The axis along which charges differ more.
    fn wider(&self) -> Axis {
        let spread = |axis: Axis| self.charge(axis).rate.max(0.0) * self.charge(axis).pattern;
        if spread(Axis::Light) >= spread(Axis::Dark) { Axis::Light } else { Axis::Dark }
    }

    /// Variance and mean of one photosite, count by count.
    fn counted(&self, [lights, darks]: &[Vec<Count>; 2], [x, y]: [f64; 2]) -> [f64; 2] {
        effort::spend(2 * (self.jumps.len() * lights.len() * darks.len()) as u64);
        let full_e = self.law.full_well_e;
        let [mut mean, mut square] = [0.0; 2];
        for (share, offset_e) in &self.jumps {
            let reading = self.reading.off_by(*offset_e);
            let at_full = if full_e.is_finite() { reading.at(full_e, 0.0) } else { [0.0; 4] };
            for dark in darks {
                for light in lights {
                    let electrons = x * light.electrons + y * dark.electrons;
                    let spread = (x * light.spread).powi(2) + (y * dark.spread).powi(2);
                    let [first, second, ..] = if electrons >= full_e { at_full } else { reading.at(electrons, spread) };
                    let weight = share * light.weight * dark.weight;
                    mean += weight * first;
                    square += weight * second;
                }
            }
        }
        [(square - mean * mean).max(0.0), mean]
    }

    /// The mean over the two axes: the one along which charges differ more in panels, at few sensitivities of the other, which it smooths.
    fn over_panels(&self) -> Sums {
        let spread = |axis: Axis| self.charge(axis).rate.max(0.0) * self.charge(axis).pattern;
        let (inner, outer) = match self.wider() {
            Axis::Light => (Axis::Light, Axis::Dark),
            Axis::Dark => (Axis::Dark, Axis::Light),
        };
        let std = self.std([1.0; 2]).max(1e-9);
        let mut sum = Sums::default();
        for (place, weight) in sensitivities(self.charge(outer), std.hypot(spread(inner))) {
            sum.take(weight, &self.along(inner, place));
        }
        // Those without any of the wider one are not smoothed by it.
        let dead = match self.charge(inner) {
            charge if charge.pattern > 0.0 && charge.rate > 0.0 => cumulative(-1.0 / charge.pattern),
            _ => 0.0,
        };
        if dead > NOTHING {
            let scatter = std.min(self.std([0.0, 0.0]).max(0.1 * std));
            for (place, weight) in fine_sensitivities(self.charge(outer), scatter) {
                sum.add(dead * weight, self.by_edges(sensitivities_at(inner, 0.0, place)));
            }
        }
        sum
    }

    /// The integral over the sensitivities of one axis above zero, at one of the other.
    fn along(&self, axis: Axis, other: f64) -> Sums {
        let mut sum = Sums::default();
        let charge = self.charge(axis);
        if charge.pattern <= 0.0 || charge.rate <= 0.0 {
            sum.add(1.0, self.by_edges(sensitivities_at(axis, 1.0, other)));
            return sum;
        }
        let sigma = charge.pattern;
        let scatter = self.charge_std(sensitivities_at(axis, 1.0, other));
        if sigma * REACH < 1.0 && sigma * charge.rate <= SHALLOW * scatter {
            for (place, weight) in sensitivities(charge, scatter) {
                sum.add(weight, self.by_edges(sensitivities_at(axis, place, other)));
            }
            return sum;
        }
        let z_of = |place: f64| (place - 1.0) / sigma;
        let [lowest, highest] = [(1.0 - REACH * sigma).max(0.0), 1.0 + REACH * sigma];
        let at = |place: f64| sensitivities_at(axis, place, other);
        let mean_e = |place: f64| self.mean_e(at(place));
        let full_e = self.law.full_well_e;
        let full_at = (full_e - mean_e(0.0)) / charge.rate;
        let knee = self.charge_std(at(full_at.clamp(lowest, highest))) / charge.rate;
        let mut low = lowest;
        while low < highest && !effort::is_spent() {
            let least_e = mean_e(low) - REACH * self.charge_std(at(low));
            if least_e >= full_e {
                // All are full.
                sum.add(cumulative(-z_of(low)) - cumulative(-REACH), self.by_edges(at(low)));
                break;
            }
            let std = (self.std(at(low)) / charge.rate).max(1e-4 * low).max(1e-12);
            let mut high = (low + (PANEL * std).min(3.0 * sigma)).min(highest);
            // Towards full well panels are as narrow as the law of the charge is there.
            if knee < 0.5 * std {
                let (gap, floor) = (full_at - low, knee.max(1e-7 * std));
                let most = match gap {
                    _ if gap > 3.2 * floor => 0.6 * gap,
                    _ if gap > 0.0 => gap,
                    _ => (-1.5 * gap).max(3.0 * floor),
                };
                high = high.min(low + most);
            }
            let most_e = (mean_e(high) + REACH * self.charge_std(at(high))).min(full_e);
            let [off_low, off_high] = [self.jumps[0].1, self.jumps[self.jumps.len() - 1].1];
            if self.reading.is_one(least_e.min(full_e) + off_low, most_e + off_high) {
                // Nothing is drawn anew.
                let share = cumulative(z_of(high)) - cumulative(z_of(low));
                sum.add(share, [0.0, self.reading.at(mean_e(low).min(full_e), 0.0)[0]]);
                effort::spend(2);
            } else {
                for (place, weight) in panel(low, high) {
                    let weight = weight * density(z_of(place)) / sigma;
                    if weight > NOTHING {
                        sum.add(weight, self.by_edges(at(place)));
                    }
                }
            }
            low = high;
        }
        sum
    }

    fn mean_e(&self, at: [f64; 2]) -> f64 {
        at[0] * self.law.light.rate + at[1] * self.law.dark.rate
    }

    /// Variance and mean of one photosite, edge by edge; where it scatters over many codes that are straight, over fewer places.
    fn by_edges(&self, at: [f64; 2]) -> [f64; 2] {
        if effort::is_spent() {
            return [0.0; 2];
        }
        let charge = self.law.cumulants_at(at);
        let whole = charge.plus(NearlyNormal::normal(0.0, self.noise_e.powi(2)));
        let full_e = self.law.full_well_e;
        let reach = REACH * whole.variance.sqrt();
        let level = |electrons: f64| self.adc.level_at(electrons + self.reading.offset_e);
        let lowest_e = (whole.mean - reach).min(full_e - REACH * self.noise_e) + self.jumps[0].1;
        let highest_e = (whole.mean + reach).min(full_e + REACH * self.noise_e) + self.jumps[self.jumps.len() - 1].1;
        let [base, last] = [lowest_e, highest_e].map(|electrons| self.ends.code(level(electrons)));
        let is_near_full = charge.mean + REACH * charge.variance.sqrt() >= full_e;
        let [slow, fast] = [whole.variance.sqrt(), self.noise_e].map(|std_e| match self.adc.linearization {
            Some(_) => 0.0,
            None => self.adc.adu_per_e * std_e,
        });
        if !is_near_full && slow >= SMOOTH && base > self.ends.lowest && last < self.ends.highest {
            // Rounding is a uniform error, and nothing ends.
            let of_jumps: f64 = self.jumps.iter().map(|(share, offset_e)| share * offset_e * offset_e).sum();
            let variance = self.adc.adu_per_e.powi(2) * (whole.variance + of_jumps) + 1.0 / 12.0;
            effort::spend(1);
            return [variance, level(whole.mean) - self.reading.center];
        }
        let sample = |code: f64| self.adc.sample(code);
        let [mut mean, mut square] = [0.0; 2];
        let mut add = |edge: f64, weight: f64| {
            let edge_e = self.adc.electrons_at(edge) - self.reading.offset_e;
            let share = |(share, offset_e): &(f64, f64)| {
                share * beyond(edge_e - offset_e, [&charge, &whole], self.noise_e, full_e)
            };
            let beyond: f64 = self.jumps.iter().map(share).sum();
            let [below, above] = [edge - 0.5, edge + 0.5].map(|code| sample(code) - sample(base));
            mean += weight * beyond * (above - below);
            square += weight * beyond * (above * above - below * below);
        };
        // From there on full well shows, which read noise alone blurs.
        let full_at = level(full_e - REACH * self.noise_e + self.jumps[0].1).floor() - slow;
        let knee = if is_near_full { full_at.clamp(base, last) } else { last };
        let knee = if self.adc.linearization.is_some() { base } else { knee.floor() };
        let places = edges::over(base, knee, slow, &mut add) + edges::over(knee, last, fast, &mut add);
        effort::spend((places + 1) * 2 * self.jumps.len() as u64);
        [(square - mean * mean).max(0.0), sample(base) - self.reading.center + mean]
    }
}

/// Sensitivities to light and to dark current.
fn sensitivities_at(axis: Axis, along: f64, other: f64) -> [f64; 2] {
    match axis {
        Axis::Light => [along, other],
        Axis::Dark => [other, along],
    }
}

#[cfg(test)]
mod tests {
    use super::super::moments::Equations;
    use super::super::photosite::Photosite;
    use super::*;
    use crate::stages::noise::{LineNoise, NoiseModel, Tails};

    /// Codes of more than the noise beside full well, wide patterns and offsets: against sums over all counts at each of thousands of
    /// sensitivities (scipy, outside this library), which are good to 10⁻⁷ with read noise, and to 3·10⁻⁴ without, where they step from
    /// count to count. Where counts are many Edgeworth's series is off by their skewness squared, 10⁻³ at 800.
    #[test]
    fn what_is_drawn_anew_is_exact_where_full_well_meets_coarse_codes() {
        for (light_e, prnu, [full_well_e, read_noise_e, dsnu_e], (bits, adu_per_e, bias_adu), expected, most_off) in [
            (20_000.0, 0.3, [16_000.0, 0.0, 0.0], (5, 0.0012, 0.3), 0.016_745_367, 5e-4),
            (30_000.0, 0.2, [26_000.0, 20.0, 0.0], (1, 0.0002, -4.7), 0.188_189_153, 1e-6),
            (5_000.0, 0.1, [4_200.0, 3.0, 0.0], (4, 0.002, 0.3), 0.005_762_777, 1e-6),
            (800.0, 0.05, [780.0, 6.0, 30.0], (4, 0.01, 0.1), 0.070_116_849, 2e-3),
        ] {
            let model = NoiseModel {
                dark_e: 0.0,
                dcnu: 0.0,
                prnu,
                read_noise_e,
                full_well_e,
                dark_shot: true,
                signal_shot: true,
                poisson: PoissonKind::Exact,
                lines: LineNoise { dsnu_e, ..LineNoise::default() },
                tails: Tails::default(),
            };
            let adc = AdcRecord::new(bits, bias_adu, adu_per_e);
            let site = Photosite::of_electrons(model, Equations::Exact).digitized(adc);
            let found = site.temporal_variance(light_e, site.moments(light_e).moments.variance);
            assert!((found / expected - 1.0).abs() < most_off, "{full_well_e}: {found} {expected}");
        }
    }

    /// Few counts, each a code or more from the next, which shot noise of several codes does not hide: against sums over counts between all
    /// places at which the code of one changes (scipy, outside this library), and over 6001 sensitivities with read noise.
    #[test]
    fn few_counts_are_told_by_their_steps() {
        for ([light_e, prnu], [dark_e, dcnu], read_noise_e, (adu_per_e, bias_adu), [anew, fixed]) in [
            ([0.3, 0.05], [0.0, 0.0], 0.0, (5.3, 100.3), [9.285_107_949_634, 0.015_171_862_549]),
            (
                [0.282_717_396_710_107_9, 0.053_565_264_998_106_044],
                [0.007_475_195_553_989_94, 0.0],
                0.0,
                (5.292_245_362_827_655, 30.128_889_132_083_817),
                [8.412_822_477_215, 0.014_174_032_841],
            ),
            ([2.0, 0.1], [0.0, 0.0], 0.0, (1.0, 100.3), [2.360_877_140_864, 0.060_169_133_365]),
            ([3.0, 0.0], [5.0, 0.1], 0.3, (1.0, 100.3), [8.256_309_516_406, 0.252_850_920_269]),
        ] {
            let model = NoiseModel {
                dark_e,
                dcnu,
                prnu,
                read_noise_e,
                full_well_e: 40_000.0,
                dark_shot: true,
                signal_shot: true,
                poisson: PoissonKind::Exact,
                lines: LineNoise::default(),
                tails: Tails::default(),
            };
            let adc = AdcRecord::new(12, bias_adu, adu_per_e);
            let site = Photosite::of_electrons(model, Equations::Exact).digitized(adc);
            let whole = site.moments(light_e).moments.variance;
            let found = site.temporal_variance(light_e, whole);
            // Read noise leaves sensitivities that go by the mean count a few millionths of the pattern.
            let most_off = if read_noise_e > 0.0 { 5e-6 * fixed } else { 1e-9 };
            assert!((found - anew).abs() < most_off, "{light_e}: {found} {anew}");
            assert!((whole - found - fixed).abs() < most_off, "{light_e}: {} {fixed}", whole - found);
        }
    }

    /// Full photosites half a code off, whose offsets scatter by as much as read noise, a tenth of a code: the code of one of offset u is the
    /// higher of two with Φ(u/r), which is uniform over photosites. Its variance is 1/12, of 1/4 in all, however wide the light scatters.
    #[test]
    fn full_photosites_show_their_offsets_by_how_codes_are_rounded() {
        for (light_e, prnu) in [(2600.0, 0.0), (2600.0, 0.01), (26_000.0, 0.0)] {
            let model = NoiseModel {
                dark_e: 0.0,
                dcnu: 0.0,
                prnu,
                read_noise_e: 1.0,
                full_well_e: 2005.0,
                dark_shot: true,
                signal_shot: true,
                poisson: PoissonKind::Exact,
                lines: LineNoise { dsnu_e: 1.0, ..LineNoise::default() },
                tails: Tails::default(),
            };
            let site = Photosite::of_electrons(model, Equations::Exact).digitized(AdcRecord::new(10, 128.0, 0.1));
            let whole = site.moments(light_e).moments.variance;
            let anew = site.temporal_variance(light_e, whole);
            assert!((whole - 0.25).abs() < 1e-9, "{light_e}: {whole}");
            assert!((anew - 1.0 / 6.0).abs() < 1e-7, "{light_e}: {anew}");
        }
    }
}
