//! Photosites of a class gone through one by one: what fixed patterns make of each, and what is drawn anew at it.
//!
//! A photosite of sensitivities x to light and u to dark current, and of a fixed offset o, reads
//!
//! min(x P + u D, full well) + o + r
//!
//! P and D counts, r what is added anew. So the law of its codes is a sum over counts, and any average of exposures follows from it:
//! the cumulants of their mean, and the law of their median, which where noise is below a code hangs on where in a code all
//! photosites of a uniform scene lie. Sums over x, u and o are those over photosites.

use super::blur::blur_e;
use super::charge::{charge_at, sensitivities};
use super::counts::Charge;
use super::law::Law;
use super::lines::nodes;
use super::masters::{Dark, kept};
use super::memory::Memory;
use super::moments::Prediction;
use super::photosite::{Photosite, SKEW};
use super::reading::{Moments, Reading, codes_of};
use super::unlike::{Unlike, UnlikeSums};
use crate::metadata::{AdcRecord, AverageRecord, PoissonKind};
use crate::numerics::averages::{CLIP, Combine, is_clipped_by_code};
use crate::numerics::medians::median;
use crate::numerics::normal::MeanVariance;

/// Readings that are worked out at most.
const AFFORDABLE: usize = 400_000;

/// Pairs of counts of light and of dark signal beyond which both are taken for one, of the same mean and variance.
const MANY_PAIRS: usize = 400;

/// The standard deviation, in codes, of what is a photosite's own from which rounding is a uniform error of it: what else it does to
/// a variance is below 4σ² e^(−2π²σ²), 10⁻³.
const BLURRED: f64 = 0.6;

/// The same of a median, which rounding moves by e^(−2π²σ²)/π.
const VISIBLE: f64 = 0.6;

/// Codes over which photosites scatter so that each place in a code is as frequent as any other.
const MANY_CODES: f64 = 2.5;

/// Read noise, e⁻, below which every count moves beyond an edge by itself, by more than e^(−2π²σ²) or 2 % of what it counts; and the
/// least that is told apart.
const APART_E: f64 = 0.45;
const LEAST_E: f64 = 0.1;

/// Photosites of one class, and how many there are of each kind.
struct Population {
    law: Law,
    reading: Reading,
    lights: Vec<(f64, f64)>,
    darks: Vec<(f64, f64)>,
    offsets: Vec<(f64, f64)>,
    /// Counts of light and of dark signal, times their sensitivities; none where both are taken for one.
    counts: Option<[Vec<(f64, f64)>; 2]>,
    evaluations: usize,
}

/// Photosites that differ by `spread_e` and their weights, for a function as smooth as `blur_e`: no fewer than tell its fourth
/// cumulant; none of too many.
fn differing(spread_e: f64, blur_e: f64) -> Option<Vec<(f64, f64)>> {
    if spread_e <= 1e-3 * blur_e {
        return Some(vec![(0.0, 1.0)]);
    }
    let found = nodes(spread_e, blur_e.min(spread_e / 0.06));
    (found.iter().map(|(_, weight)| weight).sum::<f64>() > 0.5).then_some(found)
}

impl Population {
    /// Of photosites whose averages change over `share` of what is drawn anew in one exposure; none of too many.
    fn of(site: &Photosite, expected_e: f64, share: f64) -> Option<Self> {
        let model = &site.model;
        let law = Law { read_noise_e: model.read_noise(), ..Law::of(model, expected_e) };
        let reading = site.adc.map_or_else(|| law.of_electrons(), |adc| law.of_codes(&adc, codes_of(&adc)));
        let drawn_e = law.light.shot_std().hypot(law.dark.shot_std()).hypot(law.read_noise_e);
        let blur_e = (share * drawn_e).max(site.adc.map_or(0.0, |adc| 0.04 / adc.adu_per_e));
        let spreads_e =
            [law.light.pattern * law.light.rate, law.dark.pattern * law.dark.rate, model.offsets()].map(|e| e.max(0.0));
        let widest_e = spreads_e.into_iter().fold(0.0, f64::max);
        let are_counts_apart = law.read_noise_e < APART_E;
        let axis = |spread_e: f64| {
            // What photosites differ in most blurs counts for what else they differ in.
            let is_fine = are_counts_apart && (spread_e >= widest_e || widest_e < APART_E);
            differing(spread_e, if is_fine { blur_e.min(law.read_noise_e.max(LEAST_E)) } else { blur_e })
        };
        let sensitivities_of = |pattern: f64, spread_e: f64| -> Option<Vec<(f64, f64)>> {
            Some(axis(spread_e)?.into_iter().map(|(z, weight)| ((1.0 + pattern * z).max(0.0), weight)).collect())
        };
        let lights = sensitivities_of(law.light.pattern, spreads_e[0])?;
        let darks = sensitivities_of(law.dark.pattern, spreads_e[1])?;
        let offsets = axis(spreads_e[2])?.into_iter().map(|(z, weight)| (spreads_e[2] * z, weight)).collect();
        let counts = [&law.light, &law.dark].map(|charge| counts(charge, law.read_noise_e.max(1e-3)));
        let is_counted = |charge: &Charge| charge.shot == Some(PoissonKind::Exact);
        let [many, few] = counts.each_ref().map(Vec::len);
        let is_one = many * few > MANY_PAIRS && is_counted(&law.light) && is_counted(&law.dark);
        let found = Self {
            law,
            reading,
            evaluations: if is_one { many.max(few) } else { many * few },
            counts: (!is_one).then_some(counts),
            lights,
            darks,
            offsets,
        };
        let kinds = found.lights.len() * found.darks.len() * found.offsets.len();
        (kinds.saturating_mul(found.evaluations) <= AFFORDABLE)
            .then(|| Self { evaluations: kinds * found.evaluations, ..found })
    }

    /// Charges of a photosite, full well included, and how often they come.
    fn charges(&self, [x, u]: [f64; 2]) -> Vec<(f64, f64)> {
        let full = self.law.full_well_e;
        if let Some([lights, darks]) = &self.counts {
            let of_dark = |&(dark, weight): &(f64, f64)| {
                lights.iter().map(move |(light, of_light)| ((x * light + u * dark).min(full), weight * of_light))
            };
            return darks.iter().flat_map(of_dark).collect();
        }
        let (light, dark) = (self.law.light.rate, self.law.dark.rate);
        let (mean, variance) = (x * light + u * dark, x * x * light + u * u * dark);
        if mean <= 0.0 {
            return vec![(0.0, 1.0)];
        }
        let size = variance / mean;
        let charge = Charge { rate: mean / size, pattern: 0.0, ..self.law.light };
        let found = counts(&charge, self.law.read_noise_e.max(1e-3) / size);
        found.into_iter().map(|(count, weight)| ((count * size).min(full), weight)).collect()
    }

    /// Goes through all photosites: the share of each kind, its charges, and its reading.
    fn each(&self, mut of: impl FnMut(f64, &[(f64, f64)], &Reading)) {
        for &(x, of_x) in &self.lights {
            for &(u, of_u) in &self.darks {
                let charges = self.charges([x, u]);
                for &(offset_e, of_offset) in &self.offsets {
                    of(of_x * of_u * of_offset, &charges, &self.reading.off_by(offset_e));
                }
            }
        }
    }

    fn unlike(&self) -> Unlike {
        let mut sums = UnlikeSums::default();
        self.each(|weight, charges, reading| {
            let found = Prediction::about(0.0, &moments(charges, reading));
            let MeanVariance { mean, variance } = found.moments;
            sums.add(weight, [mean, variance, found.third, found.fourth()]);
        });
        sums.found().1
    }

    /// The law of the median of so many exposures.
    fn median(&self, adc: &AdcRecord, count: u32) -> Prediction {
        let ends = codes_of(adc);
        let mut sum = [0.0; 4];
        let mut whole = 0.0;
        self.each(|weight, charges, reading| {
            let noise_e = self.law.read_noise_e;
            // Ties go upward.
            let reached = |level_e: f64| {
                let beyond =
                    Reading::beyond(noise_e, level_e - 1e-12 * level_e.abs().max(1.0)).off_by(reading.offset_e);
                charges.iter().map(|(charge, weight)| weight * beyond.at(*charge, 0.0)[0]).sum()
            };
            let at_least = |code: f64| match code {
                _ if code <= ends.lowest => 1.0,
                _ if code > ends.highest => 0.0,
                _ => reached(adc.electrons_at(code - 0.5)),
            };
            let mean_e: f64 = charges.iter().map(|(charge, weight)| charge * weight).sum();
            let near = ends.code(adc.level_at(mean_e + reading.offset_e));
            let found = median(count, near, at_least, |code| adc.sample(code) - reading.center);
            sum.iter_mut().zip(found).for_each(|(sum, moment)| *sum += weight * moment);
            whole += weight;
        });
        Prediction::about(self.reading.center, &sum.map(|sum| sum / whole))
    }
}

/// Counts of a charge without its pattern.
fn counts(charge: &Charge, smoothing: f64) -> Vec<(f64, f64)> {
    let mut found = Charge { pattern: 0.0, ..*charge }.counts(smoothing);
    found.retain(|count| count.weight > 1e-13);
    found.into_iter().map(|count| (count.electrons, count.weight)).collect()
}

fn moments(charges: &[(f64, f64)], reading: &Reading) -> Moments {
    let mut sum = [0.0; 4];
    for (charge, weight) in charges {
        sum.iter_mut().zip(reading.at(*charge, 0.0)).for_each(|(sum, moment)| *sum += weight * moment);
    }
    sum
}

impl Photosite {
    /// How what is drawn anew at photosites differs from a normal law, and from photosite to photosite; nothing of dark frames or flats
    /// that came off.
    pub(super) fn unlike(&self, expected_e: f64) -> Unlike {
        thread_local! { static KNOWN: Memory<(Photosite, f64), Unlike> = const { Memory::new() }; }
        KNOWN.with(|known| known.recall((*self, expected_e), |(site, expected_e)| site.unlike_of(*expected_e)))
    }

    fn unlike_of(&self, expected_e: f64) -> Unlike {
        let law = Law::of(&self.model, expected_e);
        let is_blurred = |adc: &AdcRecord| {
            let mut own = self.model;
            (own.prnu, own.dcnu, own.lines.prnu_row, own.lines.prnu_column) = (0.0, 0.0, 0.0, 0.0);
            (own.lines.dsnu_e, own.lines.dsnu_row_e, own.lines.dsnu_column_e) = (0.0, 0.0, 0.0);
            !adc.is_bent() && law.is_within(adc) && adc.adu_per_e * blur_e(&own, adc, expected_e) >= BLURRED
        };
        let is_open = !law.reaches_full_well() && self.adc.as_ref().is_none_or(is_blurred);
        match Population::of(self, expected_e, 1.0).filter(|_| !is_open) {
            Some(population) => population.unlike(),
            None => self.nearly_normal(&law, expected_e),
        }
    }

    /// The same of charges that full well and codes leave as they are, or, of too many to go through, as normal ones.
    fn nearly_normal(&self, law: &Law, expected_e: f64) -> Unlike {
        let [lights, darks] = [self.model.response(), self.model.dcnu].map(sensitivities);
        let mut sums = UnlikeSums::default();
        for (&(x, of_x), &(u, of_u)) in lights.iter().flat_map(|x| darks.iter().map(move |u| (x, u))) {
            let charge = charge_at(&self.model, expected_e, [x, u]);
            let MeanVariance { mean, variance } = charge.clipped_above(law.full_well_e);
            let share = if charge.variance > 0.0 { (variance / charge.variance).sqrt() } else { 0.0 };
            let (reading, slope) = match self.adc {
                Some(adc) => (law.of_codes(&adc, codes_of(&adc)), adc.sample_per_e(mean)),
                None => (law.of_electrons(), 1.0),
            };
            let moments = Reading { noise_e: self.model.read_noise(), ..reading }.at(mean, variance);
            let found = Prediction::about(0.0, &moments);
            // What counts are skewed by; where they are cut off, less.
            let shot = charge.scaled(slope * share);
            let sample =
                [found.moments.mean, found.moments.variance, found.third + shot.third, found.fourth() + shot.fourth];
            sums.add(of_x * of_u, sample);
        }
        sums.found().1
    }

    /// Whether what an average of exposures is hangs on where in a code the mean of a photosite lies.
    pub(super) fn is_average_by_code(&self, expected_e: f64, record: &AverageRecord) -> bool {
        let Some(adc) = self.adc else { return false };
        let std_codes = Dark::mean_of(self.model, 1).std_codes(&adc, expected_e);
        let clip = record.clip.unwrap_or(CLIP);
        match record.combine {
            Combine::Mean => false,
            Combine::Median => std_codes * kept(Combine::Median, record.frames, clip, 16.0).variance.sqrt() < VISIBLE,
            Combine::Clipped => is_clipped_by_code(record.frames, clip, std_codes),
        }
    }

    /// Whether photosites lie anywhere in a code, each place as often as any other.
    pub(super) fn is_spread_over_codes(&self, expected_e: f64) -> bool {
        let Some(adc) = self.adc else { return true };
        let patterns_e = (self.pattern(self.model.response()).sqrt() * expected_e)
            .hypot(self.pattern(self.model.dcnu).sqrt() * self.model.dark_e)
            .hypot(self.model.offsets());
        adc.adu_per_e * patterns_e >= MANY_CODES
    }

    /// Whether exposures are so far from normal that their medians and clipped means follow no law of normal samples: full well or an
    /// end of the codes cuts them off, or their counts are few.
    pub(super) fn is_far_from_normal(&self, expected_e: f64) -> bool {
        let law = Law::of(&self.model, expected_e);
        let counted = |is_shot: bool, rate: f64| if is_shot { rate } else { 0.0 };
        let rate = counted(self.model.signal_shot, expected_e) + counted(self.model.dark_shot, self.model.dark_e);
        let variance = rate + self.model.read_noise().powi(2);
        let third = if self.model.poisson == PoissonKind::Exact { rate } else { 0.0 };
        law.is_cut() || self.adc.is_some_and(|adc| !law.is_within(&adc)) || third > SKEW * variance.powf(1.5)
    }

    /// The law of medians of so many exposures, photosite by photosite; none of too many, nor of what is no codes.
    pub(super) fn median_of(&self, expected_e: f64, count: u32) -> Option<Prediction> {
        let adc = self.adc?;
        let share = kept(Combine::Median, count, CLIP, 16.0).variance.sqrt();
        let population = Population::of(self, expected_e, share)?;
        let std_codes = Dark::mean_of(self.model, 1).std_codes(&adc, expected_e);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "no less than 4")]
        let codes = (16.0 * share * std_codes + 4.0) as usize;
        (population.evaluations.saturating_mul(codes) <= 10 * AFFORDABLE).then(|| population.median(&adc, count))
    }
}
