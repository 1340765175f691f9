//! The law of the electrons that light, or the dark signal, sets free in a photosite, as a sum over counts.

use super::memory::Print;
use crate::metadata::PoissonKind;
use crate::random::poisson::probability;
use nalgebra::DMatrix;
use std::cell::RefCell;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::rc::Rc;

/// One of the two charges of a photosite: a count times a sensitivity max(0, 1 + σ z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Charge {
    /// Expected electrons.
    pub rate: f64,
    /// Whether it has shot noise, and of which kind.
    pub shot: Option<PoissonKind>,
    /// σ, the rms of the sensitivities.
    pub pattern: f64,
}

impl Print for Charge {
    fn print(&self, before: u64) -> u64 {
        [self.rate, self.pattern].print(before)
    }
}

/// A count, its weight, and the standard deviation of what it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Count {
    pub electrons: f64,
    pub weight: f64,
    pub spread: f64,
}

/// Rates above which counts are certain: the spread is below the rounding of a sample.
const CERTAIN: f64 = 1e15;

/// Counts whose probability is below this share of the largest do not count.
const NEGLIGIBLE: f64 = 1e-20;

/// Steps to the standard deviation of what is summed, a product of normal laws: the error of the sum is below e^(−2π²·1.3²),
/// 10⁻¹⁴.
const STEPS_TO_SIGMA: f64 = 1.3;
/// Steps to the standard deviation of a count: for the smallest rate λ of which every second count is left out, 16, the error is
/// e^(−2λ).
const STEPS_TO_SHOT: f64 = 2.0;

impl Charge {
    /// Standard deviation of the count.
    pub fn shot_std(&self) -> f64 {
        if self.is_certain() { 0.0 } else { self.rate.sqrt() }
    }

    /// Whether its electrons are counted.
    pub fn is_counted(&self) -> bool {
        self.shot == Some(PoissonKind::Exact) && self.shot_std() > 0.0
    }

    fn is_certain(&self) -> bool {
        self.shot.is_none() || self.rate <= 0.0 || self.rate > CERTAIN
    }

    /// Whether sensitivities below zero, which count as zero, matter: one in 10⁶ photosites, or any where the charge is so near
    /// full well that few photosites hold less.
    pub fn is_rectified(&self, full_well_e: f64) -> bool {
        let least = if self.rate > 0.25 * full_well_e { 1.0 / 9.0 } else { 0.205 };
        self.pattern > least && self.rate > 0.0
    }

    /// The smallest standard deviation of the fixed pattern among counts that matter.
    pub fn least_pattern_std(&self) -> f64 {
        (self.rate - 9.5 * self.shot_std()).max(0.0) * self.pattern
    }

    /// The least −ln |E e^(iθn)| of the counts n of any photosite, which its sensitivity stretches.
    pub fn damping(&self, angle: f64) -> f64 {
        if self.is_certain() {
            return 0.0;
        }
        let [least, most] = [(1.0 - 9.0 * self.pattern).max(0.0), 1.0 + 9.0 * self.pattern].map(|x| x * angle);
        match self.shot {
            Some(PoissonKind::Gaussian) => 0.5 * self.rate * least * least,
            // Whole turns leave all.
            _ if (most / TAU).floor() >= (least / TAU).ceil() => 0.0,
            _ => self.rate * (1.0 - least.cos()).min(1.0 - most.cos()),
        }
    }

    /// A charge that next to none of the photosites exceeds.
    pub fn most(&self) -> f64 {
        let count = self.rate + 9.5 * self.shot_std() + if self.is_certain() { 0.0 } else { 40.0 };
        count * (1.0 + 9.0 * self.pattern)
    }

    /// The same at the lower end.
    pub fn least(&self) -> f64 {
        let count = self.rate - 9.5 * self.shot_std();
        match self.shot {
            Some(PoissonKind::Gaussian) if count < 0.0 => count * (1.0 + 9.0 * self.pattern),
            _ => count.max(0.0) * (1.0 - 9.0 * self.pattern).max(0.0),
        }
    }

    /// No more than the number of [`Self::counts`], without a pattern.
    pub fn least_counts(&self, smoothing: f64) -> f64 {
        let sigma = self.rate.sqrt();
        if self.is_certain() || self.shot == Some(PoissonKind::Gaussian) || smoothing >= 3.0 * sigma {
            return 1.0;
        }
        // Weights of 10⁻¹⁵ are 8 standard deviations off.
        (14.0 * sigma / self.step(smoothing).floor().max(1.0)).max(1.0)
    }

    /// Counts and weights that sums over a function of the count need which is as smooth as a normal law of the standard
    /// deviation `smoothing`: every count where that is next to nothing.
    pub fn counts(&self, smoothing: f64) -> Vec<Count> {
        let one = |spread| vec![Count { electrons: self.rate, weight: 1.0, spread }];
        if self.is_certain() {
            return one(self.rate * self.pattern);
        }
        let sigma = self.rate.sqrt();
        if self.shot == Some(PoissonKind::Gaussian) {
            if self.pattern <= 0.0 {
                return one(sigma);
            }
            let step = (self.step(smoothing) / sigma).max(5e-3);
            let steps = (9.0 / step).ceil();
            let mut z = -steps * step;
            let mut found = Vec::new();
            while z <= 9.0 + step {
                let electrons = self.rate + sigma * z;
                found.push(Count { electrons, weight: (-0.5 * z * z).exp(), spread: electrons.abs() * self.pattern });
                z += step;
            }
            return normalized(found);
        }
        let step = self.step(smoothing).floor().max(1.0);
        // Narrow beside what it is summed with: Gauss's quadrature for the law of the counts themselves.
        self.poisson(if smoothing >= 3.0 * sigma && self.rate >= 8.0 { GAUSS } else { step })
    }

    /// Gauss and Charlier's nodes, exact for polynomials of degree 19: eigenvalues of the matrix of the polynomials' recurrence, with
    /// λ + k on its diagonal and √(λ k) beside it.
    fn gauss(rate: f64) -> Vec<(f64, f64)> {
        const NODES: usize = 10;
        let sigma = rate.sqrt();
        // About the rate, so that nothing is lost of large ones.
        let recurrence = DMatrix::from_fn(NODES, NODES, |i, j| match i.abs_diff(j) {
            0 => i as f64,
            1 => sigma * (i.max(j) as f64).sqrt(),
            _ => 0.0,
        });
        let solved = recurrence.symmetric_eigen();
        let count = |(index, offset): (usize, &f64)| {
            let weight: f64 = solved.eigenvectors[(0, index)];
            (rate + offset, weight * weight)
        };
        let mut found: Vec<(f64, f64)> = solved.eigenvalues.iter().enumerate().map(count).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    /// The product of two normal laws is narrower than either.
    fn step(&self, smoothing: f64) -> f64 {
        let both = 1.0 / (1.0 / self.rate + 1.0 / (smoothing * smoothing).max(1e-12)).sqrt();
        (both / STEPS_TO_SIGMA).min(self.rate.sqrt() / STEPS_TO_SHOT)
    }

    fn poisson(&self, step: f64) -> Vec<Count> {
        let known = PROBABILITIES.with_borrow_mut(|known| known.recall(self.rate, step));
        let count = |&(electrons, weight): &(f64, f64)| Count { electrons, weight, spread: electrons * self.pattern };
        known.iter().map(count).collect()
    }
}

/// What stands for the step where Gauss's quadrature is asked for.
const GAUSS: f64 = 0.0;

/// Counts and their probabilities that were asked for last, by the rate and the step between them.
#[derive(Default)]
struct Probabilities {
    known: HashMap<[u64; 2], Rc<[(f64, f64)]>>,
    kept: usize,
}

thread_local! { static PROBABILITIES: RefCell<Probabilities> = RefCell::default(); }

impl Probabilities {
    /// So many counts are kept, 8 MB.
    const MOST: usize = 500_000;

    fn recall(&mut self, rate: f64, step: f64) -> Rc<[(f64, f64)]> {
        let key = [rate, step].map(f64::to_bits);
        if let Some(found) = self.known.get(&key) {
            return Rc::clone(found);
        }
        let found = if step == GAUSS { Charge::gauss(rate) } else { Self::work_out(rate, step) };
        let found: Rc<[(f64, f64)]> = found.into();
        if self.kept + found.len() > Self::MOST {
            *self = Self::default();
        }
        self.kept += found.len();
        self.known.insert(key, Rc::clone(&found));
        found
    }

    fn work_out(rate: f64, step: f64) -> Vec<(f64, f64)> {
        let mode = rate.floor();
        let first = probability(mode, rate);
        let mut found = Vec::new();
        for upward in [false, true] {
            let (mut electrons, mut weight) = (mode, first);
            loop {
                let next = if upward { electrons + step } else { electrons - step };
                if next < 0.0 {
                    break;
                }
                weight = match (step > 1.0, upward) {
                    (true, _) => probability(next, rate),
                    (_, true) => weight * rate / next,
                    (_, false) => weight * electrons / rate,
                };
                electrons = next;
                if weight < NEGLIGIBLE * first {
                    break;
                }
                found.push((electrons, weight));
            }
            if !upward {
                found.reverse();
                found.push((mode, first));
            }
        }
        let sum: f64 = found.iter().map(|(_, weight)| weight).sum();
        found.iter_mut().for_each(|(_, weight)| *weight /= sum);
        found
    }
}

fn normalized(mut found: Vec<Count>) -> Vec<Count> {
    let sum: f64 = found.iter().map(|count| count.weight).sum();
    found.iter_mut().for_each(|count| count.weight /= sum);
    found
}
