//! Photosites whose counts nothing blurs: along their sensitivities to a charge the code of each count goes up in steps.

use super::counts::Count;
use super::effort;
use super::reading::{Asked, Reading};
use crate::metadata::AdcRecord;
use crate::numerics::normal::cumulative;
use crate::numerics::rounding::{REACH, Rounding};

/// The counts of a photosite, and how they are read.
pub(super) struct SharpCounts<'a> {
    /// Of the charge whose sensitivities are gone through, and the rms of these.
    pub counts: &'a [Count],
    pub sigma: f64,
    /// Of the other charge, and the sensitivity to it.
    pub others: &'a [Count],
    pub other: f64,
    /// What readings are off by, e⁻, and how often.
    pub jumps: &'a [(f64, f64)],
    pub full_e: f64,
    pub reading: &'a Reading,
}

/// Where a code goes up by one, in standard deviations of the sensitivity, and what that adds to the first two moments of the photosite.
struct Step {
    z: f64,
    adds: [f64; 2],
}

impl SharpCounts<'_> {
    /// The means over sensitivities of the variance of a photosite, of its mean, and of the square of that; none of more steps than `most`.
    pub fn over_sensitivities(&self, most: f64) -> Option<[f64; 3]> {
        let Asked::Codes(adc, ends) = self.reading.asked else { return None };
        let lowest = (-1.0 / self.sigma).max(-REACH);
        let [low, high] = [lowest, REACH].map(|z| (1.0 + self.sigma * z).max(0.0));
        let electrons: f64 = self.counts.iter().map(|count| count.electrons).sum();
        let pairs = self.counts.len() * self.others.len() * self.jumps.len();
        let codes = adc.sample_per_e(0.0).abs().max(adc.adu_per_e) * (high - low) * electrons;
        if pairs as f64 * (1.0 + codes / self.counts.len() as f64) > most {
            return None;
        }
        let mut steps = Vec::new();
        let mut moments = [0.0; 2];
        for count in self.counts {
            for beside in self.others {
                for (share, jump_e) in self.jumps {
                    let weight = count.weight * beside.weight * share;
                    let beside_e = self.other * beside.electrons;
                    let code_at = |place: f64| self.code(&adc, ends, place * count.electrons + beside_e, *jump_e);
                    let (mut code, last) = (code_at(low), code_at(high));
                    let sample = |code: f64| adc.sample(code) - self.reading.center;
                    let first = sample(code);
                    moments[0] += weight * first;
                    moments[1] += weight * first * first;
                    while code < last {
                        let charge_e = adc.electrons_at(code + 0.5) - self.reading.offset_e - jump_e;
                        let z = ((charge_e - beside_e) / count.electrons - 1.0) / self.sigma;
                        let [below, above] = [code, code + 1.0].map(sample);
                        let adds = [above - below, above * above - below * below].map(|step| weight * step);
                        steps.push(Step { z: z.clamp(lowest, REACH), adds });
                        code += 1.0;
                    }
                }
            }
        }
        // Each is sorted in among the others.
        effort::spend(16 * steps.len() as u64 + pairs as u64);
        steps.sort_by(|a, b| a.z.total_cmp(&b.z));
        Some(summed(moments, &steps, lowest))
    }

    /// The code of a charge.
    fn code(&self, adc: &AdcRecord, ends: Rounding, charge_e: f64, jump_e: f64) -> f64 {
        ends.code(adc.level_at(charge_e.min(self.full_e) + self.reading.offset_e + jump_e))
    }
}

/// The sums from step to step: those of no sensitivity have the first moments.
fn summed(mut moments: [f64; 2], steps: &[Step], lowest: f64) -> [f64; 3] {
    let mut found = [0.0; 3];
    let mut add = |share: f64, [mean, square]: [f64; 2]| {
        let values = [(square - mean * mean).max(0.0), mean, mean * mean];
        found.iter_mut().zip(values).for_each(|(sum, value)| *sum += share * value);
    };
    add(cumulative(lowest), moments);
    let mut from = lowest;
    for step in steps {
        add(between(from, step.z), moments);
        moments.iter_mut().zip(step.adds).for_each(|(moment, adds)| *moment += adds);
        from = step.z;
    }
    add(between(from, f64::INFINITY), moments);
    found
}

/// The probability of a normal variable between two places, exact in both tails.
fn between(from: f64, to: f64) -> f64 {
    if from > 0.0 { cumulative(-from) - cumulative(-to) } else { cumulative(to) - cumulative(from) }
}
