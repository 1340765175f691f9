//! The mean sample of the photosites of a line, and the mean of its square, by what is added to their charge, where photosites are unlike
//! each other.
//!
//! Of hot photosites and others it is the mean over all kinds, M(v). Whether a reading jumps does not hang on its charge, and a jump is
//! added to that as v is, so that of shares s of amplitude a
//!
//! m(v) = (1 − Σ s) M(v) + Σ s \[M(v − a) + 2 M(v) + M(v + a)]/4
//!
//! and so the mean of the square. M is worked out at even distances only, and only where an end of the codes is within reach: elsewhere it is straight, or constant.

use super::effort;
use super::law::Law;
use super::reading::{Reading, codes_of};
use crate::metadata::AdcRecord;
use crate::numerics::rounding::REACH;
use std::cell::RefCell;
use std::collections::BTreeMap;

/// The standard deviation, in codes, of what blurs them from which rounding moves no mean by more than e^(−2π²σ²)/π, 10⁻⁹ of a code.
pub(super) const STRAIGHT: f64 = 1.0;

/// Distances in the width of what blurs the means: polynomials through [`POINTS`] places follow a normal blur to 7·10⁻⁶ of it.
const DISTANCE: f64 = 1.0 / 3.0;
const POINTS: usize = 8;

/// Photosites of a class that differ: the laws of all kinds and their shares, most photosites first; shares and amplitudes of jumps, e⁻.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kinds {
    pub laws: Vec<(f64, Law)>,
    pub jumps: Vec<(f64, f64)>,
}

impl Kinds {
    /// The law of most photosites.
    pub fn most(&self) -> &Law {
        &self.laws[0].1
    }

    /// Takes out those that are few of a frame.
    pub fn split_off_few(&mut self) -> Vec<(f64, Law)> {
        self.laws.extract_if(1.., |(_, law)| law.are_few).collect()
    }

    /// Those of lines whose photosites have this share of the light.
    pub fn gained(&self, share: f64) -> Self {
        let laws = self.laws.iter().map(|(weight, law)| (*weight, law.gained(share))).collect();
        Self { laws, jumps: self.jumps.clone() }
    }
}

/// The mean of a sample about a center, and of its square.
pub(super) type Pair = [f64; 2];

/// Adds so much of a pair.
fn add(sum: &mut Pair, times: f64, pair: Pair) {
    sum.iter_mut().zip(pair).for_each(|(sum, of)| *sum += times * of);
}

/// What few photosites of a class, unlike most, add to its mean and square, by what is added to the charge and by the share of the light:
/// polynomials of second degree through three places, for what lines share is less than what photosites have of their own, and of so few.
#[derive(Debug, Clone, Copy)]
pub(super) struct FewMeans {
    at: Pair,
    by_offset: Slopes,
    by_share: Slopes,
}

/// First and second coefficients of a polynomial in what is so many times a scale.
#[derive(Debug, Clone, Copy, Default)]
struct Slopes {
    scale: f64,
    first: Pair,
    second: Pair,
}

impl Slopes {
    /// Through `at` and what is `below` and `above`, a scale to either side.
    fn of(scale: f64, [below, at, above]: [Pair; 3]) -> Self {
        let first = [0, 1].map(|k| 0.5 * (above[k] - below[k]));
        let second = [0, 1].map(|k| 0.5 * (above[k] + below[k]) - at[k]);
        Self { scale, first, second }
    }

    fn add_to(&self, sum: &mut Pair, place: f64) {
        if self.scale > 0.0 {
            let x = place / self.scale;
            add(sum, x, self.first);
            add(sum, x * x, self.second);
        }
    }
}

impl FewMeans {
    /// Of such kinds about the center that `about` has, where what is added has the rms `offset_e`, and the share of the light `response`;
    /// none of no kinds.
    pub fn of(few: &[(f64, Law)], about: &Law, adc: Option<AdcRecord>, [offset_e, response]: [f64; 2]) -> Option<Self> {
        // Places of Gauss's rule for three.
        const PLACE: f64 = 1.732_050_807_568_877_2;
        if few.is_empty() {
            return None;
        }
        let all = |share: f64| {
            let laws = few.iter().map(|(weight, law)| (*weight, law.gained(share))).collect();
            LineMeans::of(&Kinds { laws, jumps: Vec::new() }, about, adc, f64::INFINITY)
        };
        let middle = all(1.0);
        let at = middle.quiet(0.0);
        let [offset_e, response] = [offset_e, response].map(|spread| PLACE * spread);
        let by_offset = match offset_e > 0.0 {
            true => Slopes::of(offset_e, [middle.quiet(-offset_e), at, middle.quiet(offset_e)]),
            false => Slopes::default(),
        };
        let by_share = match response > 0.0 {
            true => Slopes::of(response, [all(1.0 - response).quiet(0.0), at, all(1.0 + response).quiet(0.0)]),
            false => Slopes::default(),
        };
        Some(Self { at, by_offset, by_share })
    }

    /// Of lines with this share of the light.
    pub fn gained(&self, share: f64) -> Self {
        let mut at = self.at;
        self.by_share.add_to(&mut at, share - 1.0);
        Self { at, ..*self }
    }

    fn at(&self, offset_e: f64) -> Pair {
        let mut found = self.at;
        self.by_offset.add_to(&mut found, offset_e);
        found
    }
}

/// The photosites of a class in one line.
pub(super) struct LineMeans {
    kinds: Vec<Kind>,
    few: Option<FewMeans>,
    jumps: Vec<(f64, f64)>,
    reading: Reading,
    adc: Option<AdcRecord>,
    /// Charges at which the codes end.
    ends_e: [f64; 2],
    spacing_e: f64,
    known: RefCell<BTreeMap<i64, Pair>>,
}

/// Photosites that are alike.
struct Kind {
    share: f64,
    law: Law,
    /// Mean and variance of the charge, what is beyond full well left out, with what is added as it is read; none where something of how
    /// codes are rounded is left.
    charge_e: Option<Pair>,
    /// The least and the largest that is read, but for what is added.
    reach_e: [f64; 2],
}

impl LineMeans {
    /// Of samples about the center that `about` has, where no less than `blur_e` blurs codes.
    pub fn of(kinds: &Kinds, about: &Law, adc: Option<AdcRecord>, blur_e: f64) -> Self {
        let reading = adc.map_or_else(|| about.of_electrons(), |adc| about.of_codes(&adc, codes_of(&adc)));
        // What hides codes is what all have of their own, or what each kind has.
        let is_smooth = |law: &Law| {
            // Of full photosites no counts hide them.
            let are_hidden_by_counts = |adc: &AdcRecord| !law.reaches_full_well() && law.counts_hide(adc);
            let is_hidden = |adc: AdcRecord| adc.adu_per_e * blur_e >= STRAIGHT || are_hidden_by_counts(&adc);
            adc.is_none_or(|adc| adc.linearization.is_none() && is_hidden(adc))
        };
        let ends_e = adc.map_or([f64::NEG_INFINITY, f64::INFINITY], |adc| {
            [0.0, f64::from(adc.top_code())].map(|code| adc.electrons_at(code))
        });
        let kind = |(share, law): &(f64, Law)| {
            let electrons = law.of_electrons();
            let charge_e = || {
                let [first, second, ..] = law.expect(&electrons);
                [first + electrons.center, second - first * first]
            };
            let [least, most] = law.extent().map(|charge| charge.min(law.full_well_e));
            let noise_e = REACH * law.read_noise_e;
            let reach_e = [least - noise_e, most + noise_e];
            // Of those that an end is within reach of it is not asked.
            let is_asked = adc.is_none_or(|_| reach_e[0] > ends_e[0] && reach_e[1] < ends_e[1]);
            Kind { share: *share, law: *law, charge_e: (is_asked && is_smooth(law)).then(charge_e), reach_e }
        };
        Self {
            kinds: kinds.laws.iter().map(kind).collect(),
            few: None,
            jumps: kinds.jumps.clone(),
            reading,
            adc,
            ends_e,
            spacing_e: DISTANCE * blur_e,
            known: RefCell::default(),
        }
    }

    /// The mean about the center where so much is added to the charge, and that of the square.
    pub fn at(&self, offset_e: f64) -> Pair {
        if self.jumps.is_empty() {
            return self.quiet(offset_e);
        }
        let middle = self.looked_up(offset_e);
        let mut found = middle;
        for (share, amplitude_e) in &self.jumps {
            for side_e in [-amplitude_e, *amplitude_e] {
                add(&mut found, 0.25 * share, self.looked_up(offset_e + side_e));
            }
            add(&mut found, -0.5 * share, middle);
        }
        found
    }

    /// The same beside few others.
    pub fn beside(self, few: Option<FewMeans>) -> Self {
        Self { few, ..self }
    }

    /// The same where they are smooth on another scale.
    pub fn smooth_over(self, blur_e: f64) -> Self {
        // Jumps are looked up too, as blurred as codes are.
        let spacing_e = if self.jumps.is_empty() { DISTANCE * blur_e } else { self.spacing_e };
        Self { spacing_e, ..self }
    }

    /// As [`Self::at`], by places at even distances, of which many lie near each other.
    pub fn near(&self, offset_e: f64) -> Pair {
        if self.jumps.is_empty() && self.spacing_e.is_finite() { self.looked_up(offset_e) } else { self.at(offset_e) }
    }

    /// M at a place, by those at even distances around it.
    fn looked_up(&self, offset_e: f64) -> Pair {
        let place = offset_e / self.spacing_e;
        let below = place.floor();
        let t = place - below;
        #[expect(clippy::cast_possible_truncation, reason = "places within reach of jumps")]
        let first = below as i64 - (POINTS as i64 / 2 - 1);
        let value = |index: i64| {
            let worked_out = || self.quiet(index as f64 * self.spacing_e);
            *self.known.borrow_mut().entry(index).or_insert_with(worked_out)
        };
        if t == 0.0 {
            return value(first + POINTS as i64 / 2 - 1);
        }
        let (mut sum, mut all) = ([0.0; 2], 0.0);
        // Barycentric: (−1)ʲ C(7, j).
        let mut binomial = 1.0;
        for point in 0..POINTS {
            let distance = t + (POINTS / 2 - 1) as f64 - point as f64;
            let weight = binomial / distance;
            add(&mut sum, weight, value(first + point as i64));
            all += weight;
            binomial *= -((POINTS - 1 - point) as f64) / (point + 1) as f64;
        }
        sum.map(|sum| sum / all)
    }

    /// M, by each kind; nothing of use where no more work is allowed.
    fn quiet(&self, offset_e: f64) -> Pair {
        if effort::is_spent() {
            return [0.0; 2];
        }
        let reading = self.reading.off_by(offset_e);
        let [lower, upper] = self.ends_e;
        let is_within = |[low, high]: [f64; 2]| self.adc.is_none() || low + offset_e > lower && high + offset_e < upper;
        let about = |mean: f64, variance: f64| [mean, variance + mean * mean];
        let pair = |kind: &Kind| match (kind.charge_e.filter(|_| is_within(kind.reach_e)), self.adc) {
            (Some([charge_e, variance]), None) => about(charge_e - reading.center + offset_e, variance),
            (Some([charge_e, variance]), Some(adc)) => {
                let mean = adc.sample(adc.level_at(charge_e + offset_e)) - reading.center;
                about(mean, adc.adu_per_e * adc.adu_per_e * variance + 1.0 / 12.0)
            }
            (None, _) => {
                let [first, second, ..] = kind.law.expect(&reading);
                [first, second]
            }
        };
        let mut found = self.few.map_or([0.0; 2], |few| few.at(offset_e));
        self.kinds.iter().for_each(|kind| add(&mut found, kind.share, pair(kind)));
        found
    }
}
