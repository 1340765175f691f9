//! The law of the median of samples that take few values, as codes do whose noise is small.
//!
//! The k-th of N samples in rising order reaches a code where no less than N − k + 1 of them do, a binomial law \[DN2003,
//! Sec. 2.1].

use statrs::function::beta::checked_beta_reg;

/// Probabilities below this do not count.
const NEGLIGIBLE: f64 = 1e-14;

/// Codes at most on either side of the one that the median is near.
const MOST_CODES: u32 = 4000;

/// Moments 1 to 4 about zero of the median of an odd number of samples, or of the mean of the two in the middle of an even one.
/// A sample reaches the code c, a whole number, with the probability `at_least(c)`, and counts as `value(c)`; `near` is a code
/// near the median.
///
/// # Examples
///
/// ```
/// use cyanometer::numerics::medians::median;
///
/// // Of three throws of a coin the median is 1 where two or three are.
/// let coin = |code: f64| if code <= 0.0 { 1.0 } else if code > 1.0 { 0.0 } else { 0.5 };
/// assert!(median(3, 0.0, coin, |code| code).iter().all(|moment| (moment - 0.5).abs() < 1e-14));
/// // Of two it is their mean: 0, ½ or 1, one half as often as both others.
/// assert!((median(2, 0.0, coin, |code| code)[1] - 0.375).abs() < 1e-14);
/// ```
pub fn median(count: u32, near: f64, at_least: impl Fn(f64) -> f64, value: impl Fn(f64) -> f64) -> [f64; 4] {
    let mut moments = [0.0; 4];
    let mut add = |probability: f64, value: f64| {
        let mut power = probability;
        for moment in &mut moments {
            power *= value;
            *moment += power;
        }
    };
    let half = f64::from(count / 2);
    let steps = Steps::around(count, near, at_least);
    let pairs = libm::lgamma(2.0 * half + 1.0) - 2.0 * libm::lgamma(half + 1.0);
    // One half of an even number of samples is at or below the one code, the other half at or above the other.
    let apart = |low: usize, high: usize| {
        let below = |place: usize| 1.0 - steps.one(place + 1);
        (pairs + half * (below(low).ln() + steps.one(high).ln())).exp()
    };
    for low in 0..steps.codes() {
        let mut both = steps.lower(low) - steps.lower(low + 1);
        let own = value(steps.lowest + low as f64);
        let others = if count.is_multiple_of(2) { low + 1..steps.codes() } else { 0..0 };
        for high in others {
            let beneath = |high| if low > 0 { apart(low - 1, high) } else { 0.0 };
            let share = apart(low, high) - apart(low, high + 1) - beneath(high) + beneath(high + 1);
            both -= share;
            add(share, 0.5 * (own + value(steps.lowest + high as f64)));
        }
        add(both, own);
    }
    moments
}

/// The codes that those in the middle may have.
struct Steps {
    lowest: f64,
    /// Probabilities to reach each code above the lowest: of a sample, and of the lower in the middle.
    reached: Vec<[f64; 2]>,
}

impl Steps {
    fn around(count: u32, near: f64, at_least: impl Fn(f64) -> f64) -> Self {
        let step = |code: f64| {
            let one = at_least(code).clamp(0.0, 1.0);
            // More than half must reach a code for the lower in the middle to; for the upper, half of an even number will do.
            [one, at_least_so_many(count / 2 + 1, count, one), at_least_so_many(count - count / 2, count, one)]
        };
        let down = (0..MOST_CODES).map(|offset| step(near - f64::from(offset)));
        let mut all: Vec<[f64; 3]> = down.take_while(|[_, lower, _]| *lower < 1.0 - NEGLIGIBLE).collect();
        all.reverse();
        let lowest = near - all.len() as f64;
        let up = (1..=MOST_CODES).map(|offset| step(near + f64::from(offset)));
        all.extend(up.take_while(|[_, _, upper]| *upper > NEGLIGIBLE));
        Self { lowest, reached: all.into_iter().map(|[one, lower, _]| [one, lower]).collect() }
    }

    fn codes(&self) -> usize {
        self.reached.len() + 1
    }

    fn at(&self, place: usize) -> [f64; 2] {
        match place {
            0 => [1.0; 2],
            _ => self.reached.get(place - 1).copied().unwrap_or([0.0; 2]),
        }
    }

    /// The probability that a sample reaches the code of such place, counted from the lowest.
    fn one(&self, place: usize) -> f64 {
        self.at(place)[0]
    }

    /// The same of the lower in the middle.
    fn lower(&self, place: usize) -> f64 {
        self.at(place)[1]
    }
}

/// The probability that no less than `needed` of `count` samples are so, each with the probability `one`.
fn at_least_so_many(needed: u32, count: u32, one: f64) -> f64 {
    let [a, b] = [needed, count - needed + 1].map(f64::from);
    if one <= 0.0 || one >= 1.0 { one } else { checked_beta_reg(a, b, one).unwrap_or(f64::NAN) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three kinds of code, and every way to draw so many: the median of each, times its probability.
    #[test]
    fn medians_of_all_ways_to_draw_have_these_moments() {
        let shares = [0.2, 0.5, 0.3];
        let at_least = |code: f64| match code {
            _ if code <= 7.0 => 1.0,
            _ if code <= 8.0 => 0.8,
            _ if code <= 9.0 => 0.3,
            _ => 0.0,
        };
        for count in [2_u32, 3, 4, 7, 8] {
            for near in [6.0, 7.0, 8.0, 10.0] {
                let mut expected = [0.0; 4];
                for way in 0..3_usize.pow(count) {
                    let mut drawn: Vec<usize> = (0..count).map(|place| way / 3_usize.pow(place) % 3).collect();
                    let probability: f64 = drawn.iter().map(|code| shares[*code]).product();
                    drawn.sort_unstable();
                    let [low, high] = [(count - 1) / 2, count / 2].map(|place| drawn[place as usize] as f64 + 7.0);
                    let median = 0.5 * (low + high) - 8.5;
                    for (power, moment) in (1..).zip(&mut expected) {
                        *moment += probability * median.powi(power);
                    }
                }
                let found = median(count, near, at_least, |code| code - 8.5);
                for (found, expected) in found.into_iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-12, "{count} {near}: {found} {expected}");
                }
            }
        }
    }
}
