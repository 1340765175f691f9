//! Poisson numbers by exact inverse transform, one 64-bit word each.
//!
//! The number that a word w stands for is u = (w + ½)/2⁶⁴, and its count the smallest k with P(X ≤ k) > u: a count
//! rises with the word and never falls with the rate, so near-equal rates get equal counts nearly everywhere. Most
//! counts follow in single precision from the upper half of the word: at rates from 10 by the expansion of the inverse
//! about the normal quantile, below by adding up probabilities. Both know how far they can be off; where the nearest
//! boundary between two counts is within that, [`quantile`] decides in double precision with all 64 bits.

mod exact;
mod table;

pub use exact::{LARGEST_RATE, probability, quantile, tails};
pub use table::Table;
pub(super) use table::fill as fill_by_tables;

use super::gaussian;
use super::philox::{LONGEST_RUN, VECTOR};

/// The rate from which on the expansion is used.
const EXPANSION_FROM: f32 = 10.0;
/// The rate up to which it is: counts about it have fractions that single precision resolves.
const EXPANSION_TO: f32 = 4_194_304.0;

/// The count as a continuous function of rate and normal quantile: the x with Q(x, λ) = Φ(z), whose floor is the count.
///
/// λ + √λ z + (2 + z²)/6 − (2z + z³)/72 λ^−½ + (−16 + 7z² + 3z⁴)/810 λ⁻¹ + (2684 z − 548 z³ − 207 z⁵)/155520 λ^−3/2
///
/// The first terms are those of \[Giles2016]; the last was found the same way, as a series in λ^−½ of the inverse of the
/// incomplete gamma ratio. Next comes a term of λ⁻².
pub(super) fn expansion(rate: f64, z: f64) -> f64 {
    let (root, square) = (rate.sqrt(), z * z);
    let leading = rate + root * z + (2.0 + square) / 6.0;
    if rate < f64::from(EXPANSION_FROM) {
        return leading;
    }
    let second = -z * (2.0 + square) / 72.0;
    let third = (-16.0 + square * (7.0 + 3.0 * square)) / 810.0;
    let fourth = z * (2684.0 - square * (548.0 + 207.0 * square)) / 155_520.0;
    leading + (second + (third + fourth / root) / root) / root
}

/// By how much the expansion in single precision may be off: rounding and the quantile's error grow with √λ, the terms
/// that were left out as (1 + z⁶)/λ². Both factors are twice the largest error found (see the tests).
#[inline(always)]
fn doubt(root: f32, inverse_rate: f32, square: f32) -> f32 {
    ROUNDING * (root + 4.0) + (LEFT_OUT[0] + LEFT_OUT[1] * square * square * square) * (inverse_rate * inverse_rate)
}

const ROUNDING: f32 = 2.4e-6;
const LEFT_OUT: [f32; 2] = [0.05, 3.0e-3];

/// Counts of a run by the expansion, for rates from [`EXPANSION_FROM`] to [`EXPANSION_TO`]; `unsure` is not 0 where
/// single precision does not settle one.
#[inline(always)]
fn by_expansion(counts: &mut [f32], unsure: &mut [u32], rates: &[f32], high: &[u32]) {
    let mut normals = [0.0; LONGEST_RUN];
    let normals = &mut normals[..high.len()];
    gaussian::bodies(normals, high);
    let lanes = counts.iter_mut().zip(unsure).zip(rates).zip(normals.iter().zip(high));
    for (((count, unsure), &rate), (&normal, &high)) in lanes {
        let (x, whole, doubt) = single(rate, normal);
        let floor = floor(x);
        let fraction = x - floor;
        *count = whole + floor;
        let settled = (fraction > doubt) & (fraction < 1.0 - doubt) & !gaussian::is_in_tail(high);
        *unsure = u32::from(!settled);
    }
}

/// The expansion in single precision: the part above the whole number of the rate, that whole number, and the doubt.
#[inline(always)]
fn single(rate: f32, z: f32) -> (f32, f32, f32) {
    let square = z * z;
    let root = rate.sqrt();
    let inverse = 1.0 / root;
    let inverse_rate = inverse * inverse;
    let first = 1.0 / 3.0 + square * (1.0 / 6.0);
    let second = z * (square * (-1.0 / 72.0) - 1.0 / 36.0);
    let third = square * (square * (3.0 / 810.0) + 7.0 / 810.0) - 16.0 / 810.0;
    let fourth = z * (2684.0 / 155_520.0 - square * (square * (207.0 / 155_520.0) + 548.0 / 155_520.0));
    let whole = floor(rate);
    let above = first + inverse * (second + inverse * (third + inverse * fourth));
    let x = root * z + (above + (rate - whole));
    (x, whole, doubt(root, inverse_rate, square))
}

/// The largest whole number not above a number between ±2²²; without the instruction that the baseline lacks.
#[inline(always)]
fn floor(x: f32) -> f32 {
    const SHIFT: f32 = 12_582_912.0;
    let nearest = (x + SHIFT) - SHIFT;
    nearest - if nearest > x { 1.0 } else { 0.0 }
}

/// Sums of probabilities in single precision are within half of this of the true ones, for rates up to 10.
const SUM_DOUBT: f32 = 4.0e-6;
/// Terms that a sum may have: P(X > 47) is 10⁻¹⁷ at a rate of 10.
const TERMS: usize = 48;

/// 1/k.
const RECIPROCALS: [f32; TERMS + 1] = {
    let mut table = [0.0; TERMS + 1];
    let mut k = 1;
    while k <= TERMS {
        table[k] = 1.0 / k as f32;
        k += 1;
    }
    table
};

/// Counts of a run by adding up probabilities, for rates up to [`EXPANSION_FROM`].
#[inline(always)]
fn by_sum(counts: &mut [f32], unsure: &mut [u32], rates: &[f32], high: &[u32]) {
    let counts = counts.as_chunks_mut::<VECTOR>().0.iter_mut();
    let words = rates.as_chunks::<VECTOR>().0.iter().zip(high.as_chunks::<VECTOR>().0);
    for ((counts, unsure), (rates, high)) in counts.zip(unsure.as_chunks_mut::<VECTOR>().0).zip(words) {
        let (mut share, mut term, mut sum) = ([0.0_f32; VECTOR], [0.0_f32; VECTOR], [0.0_f32; VECTOR]);
        for lane in 0..VECTOR {
            // Halved, so that it converts as a signed number.
            share[lane] = ((high[lane] >> 1).cast_signed() as f32 + 0.5) * (1.0 / 2_147_483_648.0);
            term[lane] = exponential(rates[lane]);
            counts[lane] = 0.0;
            unsure[lane] = 0;
        }
        for step in RECIPROCALS[1..].chunks_exact(4) {
            let mut open = 0;
            for reciprocal in step {
                for lane in 0..VECTOR {
                    sum[lane] += term[lane];
                    let beyond = share[lane] - sum[lane];
                    counts[lane] += if beyond > 0.0 { 1.0 } else { 0.0 };
                    unsure[lane] |= u32::from(beyond.abs() < SUM_DOUBT);
                    open |= u32::from(beyond > -SUM_DOUBT);
                    term[lane] *= rates[lane] * reciprocal;
                }
            }
            if open == 0 {
                break;
            }
        }
    }
}

/// e^−x for x from 0 to 10, relative error below 3·10⁻⁷.
#[inline(always)]
fn exponential(x: f32) -> f32 {
    const SHIFT: f32 = 12_582_912.0;
    let shifted = x * -std::f32::consts::LOG2_E + SHIFT;
    let power = shifted - SHIFT;
    let r = (-x - power * 0.693_359_4) - power * -2.121_944_4e-4;
    // e^r for |r| ≤ ½ ln 2: Taylor to r⁷/7!, which leaves 5·10⁻⁹.
    let mut sum = 1.0 / 5040.0;
    for factorial in [720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0_f32] {
        sum = sum * r + 1.0 / factorial;
    }
    let scale = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
    sum * scale
}

/// Fills a run with counts at `rates`; one of 0 or less, or NaN, gives 0. `low` gives the lower half of the word of a
/// photosite. Lengths are multiples of [`VECTOR`], at most [`LONGEST_RUN`].
#[inline(always)]
pub(super) fn fill(counts: &mut [f32], rates: &[f32], high: &[u32], low: impl Fn(usize) -> u32) {
    let mut unsure = [0; LONGEST_RUN];
    let unsure = &mut unsure[..rates.len()];
    let within = |rate: f32| (EXPANSION_FROM..=EXPANSION_TO).contains(&rate);
    if rates.iter().fold(true, |all, &rate| all & within(rate)) {
        by_expansion(counts, unsure, rates, high);
    } else {
        of_all_rates(counts, unsure, rates, high);
    }
    for_unsure(unsure, |index| counts[index] = settle(rates[index], high[index], low(index)));
}

/// Calls `mend` with the place of every flag that is not 0, in order; few are.
#[inline(always)]
fn for_unsure(unsure: &[u32], mut mend: impl FnMut(usize)) {
    for (first, flags) in unsure.as_chunks::<VECTOR>().0.iter().enumerate() {
        if flags.iter().fold(0, |any, flag| any | flag) != 0 {
            for (lane, _) in flags.iter().enumerate().filter(|(_, flag)| **flag != 0) {
                mend(first * VECTOR + lane);
            }
        }
    }
}

/// Counts of a run whose rates are not all the expansion's: each by its own method.
#[inline(always)]
fn of_all_rates(counts: &mut [f32], unsure: &mut [u32], rates: &[f32], high: &[u32]) {
    let (mut held, mut few, mut few_unsure) = ([0.0; LONGEST_RUN], [0.0; LONGEST_RUN], [0; LONGEST_RUN]);
    let (held, few, few_unsure) = (&mut held[..rates.len()], &mut few[..rates.len()], &mut few_unsure[..rates.len()]);
    if rates.iter().any(|&rate| rate >= EXPANSION_FROM) {
        for (held, &rate) in held.iter_mut().zip(rates) {
            *held = rate.clamp(EXPANSION_FROM, EXPANSION_TO);
        }
        by_expansion(counts, unsure, held, high);
    }
    if rates.iter().any(|&rate| rate < EXPANSION_FROM) {
        for (held, &rate) in held.iter_mut().zip(rates) {
            *held = rate.clamp(0.0, EXPANSION_FROM);
        }
        by_sum(few, few_unsure, held, high);
    }
    let lanes = counts.iter_mut().zip(unsure).zip(rates).zip(few.iter().zip(few_unsure));
    for (((count, unsure), &rate), (&few, &mut few_unsure)) in lanes {
        let (is_few, is_some) = (rate < EXPANSION_FROM, rate > 0.0);
        let settled = if is_few { few } else { *count };
        let doubt = if is_few { few_unsure } else { *unsure | u32::from(rate > EXPANSION_TO) };
        *count = if is_some { settled } else { 0.0 };
        *unsure = if is_some { doubt } else { 0 };
    }
}

#[cold]
#[inline(never)]
fn settle(rate: f32, high: u32, low: u32) -> f32 {
    crate::frame::to_sample(quantile(f64::from(rate), u64::from(high) << 32 | u64::from(low)))
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of photosites, and shares of 2³²")]
mod tests {
    use super::*;
    use crate::random::philox::philox4x32_10;

    /// The words at which counts change are where a wrong step would show: there the expansion must say the boundary to
    /// within half of its doubt.
    #[test]
    fn the_expansion_is_off_by_at_most_half_its_doubt() {
        let mut worst = 0.0_f64;
        let mut rate = EXPANSION_FROM;
        while rate <= EXPANSION_TO {
            for sigma in -364..=364 {
                let rate = f64::from(rate);
                let boundary = expansion(rate, f64::from(sigma) / 100.0).round();
                if boundary < 1.0 {
                    continue;
                }
                let (below, above) = tails(boundary - 1.0, rate);
                let tail = (below.min(above) * 4_294_967_296.0) as u32;
                let high = if below < above { tail } else { !tail };
                if gaussian::is_in_tail(high) {
                    continue;
                }
                let (x, whole, doubt) = single(crate::frame::to_sample(rate), gaussian::body(high));
                // A word's upper half stands for 2³² words; the boundary is somewhere among them.
                let error = (f64::from(x) + f64::from(whole) - boundary).abs() / f64::from(doubt);
                worst = worst.max(error);
            }
            rate *= 1.0371;
        }
        assert!(worst < 0.5, "{worst}");
    }

    fn block(rates: &[f32; LONGEST_RUN], seed: u32) -> ([f32; LONGEST_RUN], [u32; LONGEST_RUN], [u32; LONGEST_RUN]) {
        let mut words = [[0; LONGEST_RUN]; 4];
        super::super::philox::fill(&mut words, LONGEST_RUN, [seed, 0], [0, 0, 0], [0, 0]);
        let mut counts = [0.0; LONGEST_RUN];
        fill(&mut counts, rates, &words[0], |index| words[1][index]);
        (counts, words[0], words[1])
    }

    #[test]
    fn blocks_are_their_quantiles_one_by_one() {
        let rate_at = |n: u32| {
            let exponent = philox4x32_10([n, 0, 0, 0], [1, 1])[0] as f32 / 4_294_967_296.0;
            1e-3 * 10_f32.powf(exponent * 9.5)
        };
        for seed in 0..2000 {
            // Blocks of one rate, blocks about 10, and blocks of all rates.
            let rates: [f32; LONGEST_RUN] = std::array::from_fn(|index| match seed % 3 {
                0 => rate_at(seed),
                1 => 8.0 + (index % 17) as f32 * 0.25,
                _ => rate_at(seed * 256 + index as u32),
            });
            let (counts, high, low) = block(&rates, seed);
            for index in 0..LONGEST_RUN {
                let word = u64::from(high[index]) << 32 | u64::from(low[index]);
                let expected = crate::frame::to_sample(quantile(f64::from(rates[index]), word));
                assert_eq!(counts[index], expected, "rate {} word {word:#x}", rates[index]);
            }
        }
    }

    #[test]
    fn sums_are_off_by_at_most_half_their_doubt() {
        let mut worst = 0.0_f64;
        for step in 0..=400 {
            let rate = step as f32 * 0.025;
            let (mut term, mut sum) = (exponential(rate), 0.0_f32);
            assert!((f64::from(term) / (-f64::from(rate)).exp() - 1.0).abs() < 3e-7);
            for (k, reciprocal) in RECIPROCALS[1..].iter().enumerate() {
                sum += term;
                term *= rate * reciprocal;
                let exact = if rate > 0.0 { tails(k as f64, f64::from(rate)).0 } else { 1.0 };
                worst = worst.max((f64::from(sum) - exact).abs());
            }
        }
        assert!(worst < 0.5 * f64::from(SUM_DOUBT), "{worst:e}");
    }
}
