//! Averages of repeated samples that were brought to one level from several, and how much noise each keeps.
//!
//! Of a sample at the share l of the mean level, shot noise has the variance l, other noise the same at all levels; brought to the mean
//! level both are over l². So samples of one place have variances of their own, and the law of their median is that of order statistics of
//! independent normal numbers that are not alike \[DN2003, Sec. 5.2]: a sum over which of them is in the middle.

use super::averages::{Combine, clipped, draw};
use super::gauss::{NODES, interpolated, panel};
use super::normal::{cumulative, density};
use crate::frame::to_sample;

/// Even numbers of samples up to which the distance of the two in the middle is integrated; that of more is exponential, which leaves less
/// than 1 % of the variance unsure.
const FEW: usize = 16;

/// What an average of leveled samples keeps, in variances of a sample of the mean level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeveledKept {
    /// Variance of the average.
    pub variance: f64,
    /// As [`lean`](super::averages::Kept::lean).
    pub lean: f64,
    /// By how much the average moves where all samples move by 1 before they are leveled.
    pub shift: f64,
}

/// What an average of samples of certain levels keeps, for any share of the noise that does not grow with the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leveled {
    /// Variance, lean and shift at the roots of that share.
    kept: [[f64; NODES]; 3],
    /// The least and the largest level, as shares of the mean.
    pub ends: [f64; 2],
}

impl Leveled {
    /// Of an average of samples that had such levels, in shares of their mean; what is clipped lies beyond `clip` standard deviations.
    pub fn of(combine: Combine, clip: f64, levels: &[f64]) -> Self {
        let mut kept = [[0.0; NODES]; 3];
        for (place, (root, _)) in panel(0.0, 1.0).enumerate() {
            let constant = root * root;
            let noises: Vec<f64> = levels.iter().map(|level| (1.0 - constant) * level + constant).collect();
            let samples: Vec<Sample> = levels
                .iter()
                .zip(&noises)
                .map(|(level, noise)| Sample { std: noise.sqrt() / level, skew: 1.0 / noise, shift: 1.0 / level })
                .collect();
            let found = match combine {
                Combine::Median if levels.len() > 2 => median(&samples),
                Combine::Clipped if levels.len() > 2 && clip < (levels.len() as f64).sqrt() => drawn(&samples, clip),
                _ => mean(&samples),
            };
            let LeveledKept { variance, lean, shift } = found;
            kept.iter_mut().zip([variance, lean, shift]).for_each(|(kept, value)| kept[place] = value);
        }
        let least = levels.iter().copied().fold(f64::INFINITY, f64::min);
        Self { kept, ends: [least, levels.iter().copied().fold(0.0, f64::max)] }
    }

    /// Where such a share of the variance at the mean level is that of noise that does not grow with the level.
    pub fn at(&self, constant: f64) -> LeveledKept {
        let place = 2.0 * constant.clamp(0.0, 1.0).sqrt() - 1.0;
        let [variance, lean, shift] = self.kept.map(|kept| interpolated(&kept, place));
        LeveledKept { variance, lean, shift }
    }
}

/// A sample that was leveled.
struct Sample {
    std: f64,
    /// Its κ₃/6κ₂ to that at the mean level, times the mean level.
    skew: f64,
    /// What moves it by 1 before it is leveled moves it by so much.
    shift: f64,
}

fn mean(samples: &[Sample]) -> LeveledKept {
    let n = samples.len() as f64;
    let sum = |of: fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / n;
    LeveledKept { variance: sum(|one| one.std * one.std) / n, lean: 0.0, shift: sum(|one| one.shift) }
}

/// Variance from the density of the sample in the middle, or of the lower of two: Var ½(X + Y) = Var X − ¼ E(Y − X)² of symmetric ones.
fn median(samples: &[Sample]) -> LeveledKept {
    let n = samples.len();
    let below = (n - 1) / 2;
    let mut kept = LeveledKept { variance: 0.0, lean: 0.0, shift: 0.0 };
    let mut apart = 0.0;
    for (x, width) in places(samples) {
        let under: Vec<f64> = samples.iter().map(|one| cumulative(x / one.std)).collect();
        let ways = ways(under.iter().map(|p| [1.0 - p, *p]), n);
        let (mut all, mut next, mut above) = (0.0, 0.0, 0.0);
        for (one, p) in samples.iter().zip(&under) {
            let (z, steep) = (x / one.std, density(x / one.std) / one.std);
            let share = width * steep * without(&ways, *p, below);
            all += share;
            kept.variance += share * x * x;
            kept.lean += share * (z * z - 1.0) * one.skew;
            kept.shift += share * one.shift;
            next += steep;
            above += 1.0 - p;
        }
        if n.is_multiple_of(2) && n > FEW && above > 0.0 {
            let rate = next * (below + 1) as f64 / above;
            apart += if rate > 0.0 { 2.0 * all / (rate * rate) } else { 0.0 };
        }
        if n.is_multiple_of(2) && n <= FEW && all > 1e-12 {
            apart += 2.0 * width * apart_beyond(samples, &under, x, next);
        }
    }
    LeveledKept { variance: kept.variance - 0.25 * apart, ..kept }
}

/// ∫ P(one half of them is at or below x, the other above y) dy over y from x on; `rate` is the sum of their densities at x.
fn apart_beyond(samples: &[Sample], under: &[f64], x: f64, rate: f64) -> f64 {
    let widest = samples.iter().map(|one| one.std).fold(0.0, f64::max);
    let farthest = (9.0 * widest - x).max(0.0);
    let of_distance = |distance: f64| {
        let each = samples.iter().zip(under).map(|(one, p)| [cumulative(-(x + distance) / one.std), *p]);
        ways(each, samples.len() / 2)[samples.len() / 2]
    };
    let unit = (0.5 / rate.max(1e-300)).min(0.25 * farthest);
    growing(unit, farthest)
        .windows(2)
        .flat_map(|ends| panel(ends[0], ends[1]))
        .map(|(d, step)| step * of_distance(d))
        .sum()
}

/// 0, and ends of panels that grow by half from a unit on, up to the farthest.
fn growing(unit: f64, farthest: f64) -> Vec<f64> {
    let mut ends = vec![0.0];
    let mut end = unit;
    while end < farthest && unit > 0.0 {
        ends.push(end);
        end *= 1.5;
    }
    ends.push(farthest);
    ends
}

/// Places and weights for integrals over what the median is of samples.
fn places(samples: &[Sample]) -> Vec<(f64, f64)> {
    let narrow = 1.0 / samples.iter().map(|one| 1.0 / one.std).sum::<f64>();
    let widest = samples.iter().map(|one| one.std).fold(0.0, f64::max);
    let ends = growing(narrow * (samples.len() as f64).sqrt(), 9.0 * widest);
    let right: Vec<(f64, f64)> = ends.windows(2).flat_map(|ends| panel(ends[0], ends[1])).collect();
    right.iter().map(|(x, width)| (-x, *width)).chain(right.iter().copied()).collect()
}

/// Probabilities that none, one, and up to `most` of independent events happen; each fails or happens with such probabilities, or neither.
fn ways(events: impl Iterator<Item = [f64; 2]>, most: usize) -> Vec<f64> {
    let mut ways = vec![0.0; most + 1];
    ways[0] = 1.0;
    for [fails, happens] in events {
        for count in (0..=most).rev() {
            ways[count] = fails * ways[count] + if count > 0 { happens * ways[count - 1] } else { 0.0 };
        }
    }
    ways
}

/// The probability of `count` events where one of all, of such a probability, is left out: from the end where rounding does not grow.
fn without(ways: &[f64], happens: f64, count: usize) -> f64 {
    let fails = 1.0 - happens;
    let mut left = 0.0;
    if happens <= 0.5 {
        for ways in &ways[..=count] {
            left = (ways - happens * left) / fails;
        }
    } else {
        for ways in ways[count + 1..].iter().rev() {
            left = (ways - fails * left) / happens;
        }
    }
    left.max(0.0)
}

/// By normal samples that are drawn here, always the same: known to 2 % of the variance.
fn drawn(samples: &[Sample], clip: f64) -> LeveledKept {
    const TRIALS: u32 = 6000;
    /// How far all are moved, in standard deviations at the mean level.
    const MOVED: f64 = 0.2;
    let (mut normals, mut at, mut moved) = (vec![0.0_f32; samples.len()], Vec::new(), Vec::new());
    let (mut square, mut shift) = (0.0, 0.0);
    for trial in 0..TRIALS {
        draw(trial, &mut normals);
        let of = |off: f64| {
            let all = samples.iter().zip(&normals);
            all.map(move |(one, z)| to_sample(one.std * f64::from(*z) + off * one.shift))
        };
        at.clear();
        moved.clear();
        at.extend(of(0.0));
        moved.extend(of(MOVED));
        let [own, beside] = [clipped(&mut at, clip).0, clipped(&mut moved, clip).0];
        square += own * own;
        shift += (beside - own) / MOVED;
    }
    let trials = f64::from(TRIALS);
    LeveledKept { variance: square / trials, lean: 0.0, shift: shift / trials }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::averages::{CLIP, Kept, average};

    /// Samples of one level keep what those of the tables of `averages` do.
    #[test]
    fn samples_of_one_level_are_those_of_the_tables() {
        for (count, variance) in [(3_u32, 0.448_671), (5, 0.286_834), (7, 0.210_447), (4, 0.298_2), (6, 0.214_737)] {
            let kept = Leveled::of(Combine::Median, CLIP, &vec![1.0; count as usize]);
            for share in [0.0, 0.3, 1.0] {
                let LeveledKept { variance: found, lean, shift } = kept.at(share);
                assert!((found / variance - 1.0).abs() < 1e-4, "{count}: {found}");
                let alike = Kept::of(Combine::Median, count, CLIP, 1.0);
                assert!((lean - alike.lean).abs() < 1e-4 && (shift - 1.0).abs() < 1e-6, "{count}: {lean} {shift}");
            }
        }
    }

    /// Normal numbers of another seed at levels of twilight, divided by their levels; a common offset before that.
    #[test]
    fn averages_of_leveled_samples_keep_what_they_should() {
        let many: Vec<f64> = (0..24).map(|i| 0.4 + 1.2 * f64::from(i) / 23.0).collect();
        let levels: [&[f64]; 4] = [&[0.214, 0.643, 2.143], &[0.3, 0.5, 1.4, 1.8], &[0.2, 0.4, 0.8, 1.4, 2.2], &many];
        let trials = 6000_u32;
        let cases = levels.into_iter().flat_map(|levels| {
            [Combine::Median, Combine::Clipped].map(|how| (levels, how, Leveled::of(how, 1.5, levels)))
        });
        for (levels, combine, leveled, constant) in
            cases.flat_map(|(levels, how, leveled)| [0.02, 0.6].map(|constant| (levels, how, leveled, constant)))
        {
            let mut normals = vec![0.0; levels.len()];
            let (mut square, mut moved) = (0.0, 0.0);
            for trial in 0..trials {
                draw(trial + 200_000, &mut normals);
                let one = |off: f64| {
                    let of = |(level, z): (&f64, &f32)| {
                        to_sample((((1.0 - constant) * level + constant).sqrt() * f64::from(*z) + off) / level)
                    };
                    average(combine, &mut levels.iter().zip(&normals).map(of).collect::<Vec<_>>(), 1.5).0
                };
                let own = one(0.0);
                square += own * own;
                moved += (one(0.2) - own) / 0.2;
            }
            let n = f64::from(trials);
            let kept = leveled.at(constant);
            // 4 standard errors of a variance, what is drawn in working the clipped mean out, and what exponentials leave.
            let tolerance = 4.0 * (2.0 / n).sqrt()
                + if combine == Combine::Clipped { 0.05 } else { 0.0 }
                + if levels.len() > FEW { 0.01 } else { 0.0 };
            let said = format!("{combine:?} {levels:?} {constant}: {} {moved} {kept:?}", square / n);
            assert!((square / n / kept.variance - 1.0).abs() < tolerance, "{said}");
            // Which sample is in the middle changes as all move by a fifth of a standard deviation.
            assert!((moved / n / kept.shift - 1.0).abs() < 0.06, "{said}");
        }
    }
}
