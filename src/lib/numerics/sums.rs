//! Sums over a block of samples about a center, on lanes that are the same at every width of vectors.
//!
//! Sample x goes to lane x mod [`LANES`]; lanes are added up at the end, first to last, then the last samples that fill no
//! lanes. A block in which anything is NaN
//! or infinite shows by sums that are not finite, since no sum over finite 32-bit samples overflows a double.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes that the compiler turns into vectors index several arrays"
)]

use super::vectors::{self, Instructions, Kernel};

/// Lanes of the sums.
pub const LANES: usize = 8;

/// Values at or beyond which samples are counted; NaN for no such value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Samples at or below it are counted.
    pub low: f32,
    /// Samples at or above it are counted.
    pub high: f32,
}

impl Limits {
    /// No limits.
    pub const NONE: Self = Self { low: f32::NAN, high: f32::NAN };

    /// Whether a sample lies at a limit or beyond.
    #[inline(always)]
    pub fn reached(self, sample: f32) -> bool {
        (sample <= self.low) | (sample >= self.high)
    }

    /// How many samples reach them, where the smallest and the largest are known.
    pub fn count<'a>(self, samples: impl Iterator<Item = &'a f32>, [min, max]: [f32; 2]) -> u64 {
        let is_any = self.reached(min) || self.reached(max);
        if is_any { samples.filter(|&&sample| self.reached(sample)).count() as u64 } else { 0 }
    }
}

/// What a block of samples of one variable sums up to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sums {
    /// Σ (x − c).
    pub first: f64,
    /// Σ (x − c)².
    pub second: f64,
    /// Smallest sample.
    pub min: f32,
    /// Largest sample.
    pub max: f32,
}

/// The lanes of [`Sums`].
#[derive(Clone, Copy)]
struct Lanes {
    first: [f64; LANES],
    second: [f64; LANES],
    min: [f32; LANES],
    max: [f32; LANES],
}

impl Lanes {
    const EMPTY: Self = Self {
        first: [0.0; LANES],
        second: [0.0; LANES],
        min: [f32::INFINITY; LANES],
        max: [f32::NEG_INFINITY; LANES],
    };

    /// Adds [`LANES`] samples; gives their deviations. A loop for each operation, which the compiler turns into vectors.
    #[inline(always)]
    fn add(&mut self, samples: &[f32; LANES], centers: &[f64; LANES]) -> [f64; LANES] {
        let mut deviations = [0.0; LANES];
        for lane in 0..LANES {
            deviations[lane] = f64::from(samples[lane]) - centers[lane];
        }
        self.add_deviations(&deviations);
        for lane in 0..LANES {
            self.min[lane] = if samples[lane] < self.min[lane] { samples[lane] } else { self.min[lane] };
        }
        for lane in 0..LANES {
            self.max[lane] = if self.max[lane] >= samples[lane] { self.max[lane] } else { samples[lane] };
        }
        deviations
    }

    #[inline(always)]
    fn add_deviations(&mut self, deviations: &[f64; LANES]) {
        for lane in 0..LANES {
            self.first[lane] += deviations[lane];
        }
        for lane in 0..LANES {
            self.second[lane] += deviations[lane] * deviations[lane];
        }
    }

    /// The sums of every `step`-th lane from `from`.
    #[inline(always)]
    fn sums(self, from: usize, step: usize) -> Sums {
        let [mut min, mut max] = [f32::INFINITY, f32::NEG_INFINITY];
        let Self { first, second, min: least, max: most } = stored(self);
        for lane in (from..LANES).step_by(step) {
            min = min.min(least[lane]);
            max = max.max(most[lane]);
        }
        let total = |lanes: &[f64; LANES]| lanes.iter().skip(from).step_by(step).sum();
        Sums { first: total(&first), second: total(&second), min, max }
    }
}

/// The lanes themselves, by way of memory: the compiler makes whole vectors of what is stored side by side, but halves
/// and single lanes of what it sees being added up one by one.
#[inline(never)]
fn stored<T>(lanes: T) -> T {
    lanes
}

impl Sums {
    /// Adds one sample.
    #[inline(always)]
    fn add(&mut self, sample: f32, center: f64) {
        let deviation = f64::from(sample) - center;
        self.first += deviation;
        self.second += deviation * deviation;
        self.min = self.min.min(sample);
        self.max = self.max.max(sample);
    }
}

/// Adds products of deviations.
#[inline(always)]
fn add_products(to: &mut [f64; LANES], a: &[f64; LANES], b: &[f64; LANES]) {
    for lane in 0..LANES {
        to[lane] += a[lane] * b[lane];
    }
}

/// Sums over variables that are observed together, with Σ (xᵢ − cᵢ)(xⱼ − cⱼ) of the pairs i < j, row by row of the
/// triangle.
struct Together<'a, const VARIABLES: usize, const PAIRS: usize> {
    samples: [&'a [f32]; VARIABLES],
    centers: [f64; VARIABLES],
}

impl<const VARIABLES: usize, const PAIRS: usize> Kernel for Together<'_, VARIABLES, PAIRS> {
    type Output = ([Sums; VARIABLES], [f64; PAIRS]);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut lanes = [Lanes::EMPTY; VARIABLES];
        let mut products = [[0.0; LANES]; PAIRS];
        let centers = self.centers.map(|center| [center; LANES]);
        let parts = self.samples.map(<[f32]>::as_chunks::<LANES>);
        let whole = parts.iter().map(|(chunks, _)| chunks.len()).min().unwrap_or(0);
        let chunks = parts.map(|(chunks, _)| &chunks[..whole]);
        for index in 0..whole {
            let mut deviations = [[0.0; LANES]; VARIABLES];
            for i in 0..VARIABLES {
                deviations[i] = lanes[i].add(&chunks[i][index], &centers[i]);
            }
            Self::add_pairs(&mut products, &deviations);
        }
        let mut sums = lanes.map(|lanes| lanes.sums(0, 1));
        let mut products = products.map(|lanes| stored(lanes).iter().sum());
        for x in 0..parts[0].1.len() {
            let mut pair = 0;
            for i in 0..VARIABLES {
                sums[i].add(parts[i].1[x], self.centers[i]);
                for j in i + 1..VARIABLES {
                    let deviation = |i: usize| f64::from(parts[i].1[x]) - self.centers[i];
                    products[pair] += deviation(i) * deviation(j);
                    pair += 1;
                }
            }
        }
        (sums, products)
    }
}

impl<const VARIABLES: usize, const PAIRS: usize> Together<'_, VARIABLES, PAIRS> {
    #[inline(always)]
    fn add_pairs(products: &mut [[f64; LANES]; PAIRS], deviations: &[[f64; LANES]; VARIABLES]) {
        let mut pair = 0;
        for i in 0..VARIABLES {
            for j in i + 1..VARIABLES {
                add_products(&mut products[pair], &deviations[i], &deviations[j]);
                pair += 1;
            }
        }
    }
}

/// The sum of products alone.
struct Product<'a> {
    samples: [&'a [f32]; 2],
    centers: [f64; 2],
}

impl Kernel for Product<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut products = [0.0; LANES];
        let [(a, a_rest), (b, b_rest)] = self.samples.map(<[f32]>::as_chunks::<LANES>);
        let [center_a, center_b] = self.centers;
        for (a, b) in a.iter().zip(b) {
            let a = a.map(|sample| f64::from(sample) - center_a);
            let b = b.map(|sample| f64::from(sample) - center_b);
            add_products(&mut products, &a, &b);
        }
        let rest = a_rest.iter().zip(b_rest);
        let sum: f64 = stored(products).iter().sum();
        rest.fold(sum, |sum, (a, b)| sum + (f64::from(*a) - center_a) * (f64::from(*b) - center_b))
    }
}

/// Sums over samples of two variables that take turns, each about its own center.
struct Alternating<'a> {
    samples: &'a [f32],
    centers: [f64; 2],
}

impl Kernel for Alternating<'_> {
    type Output = [Sums; 2];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut lanes = Lanes::EMPTY;
        let centers = std::array::from_fn(|lane| self.centers[lane % 2]);
        let (chunks, rest) = self.samples.as_chunks::<LANES>();
        for samples in chunks {
            lanes.add(samples, &centers);
        }
        let mut sums = [lanes.sums(0, 2), lanes.sums(1, 2)];
        for (x, &sample) in rest.iter().enumerate() {
            sums[x % 2].add(sample, self.centers[x % 2]);
        }
        sums
    }
}

/// Sums over up to three variables observed together, all of one length; products of the pairs (0, 1), (0, 2), (1, 2).
pub fn together<const VARIABLES: usize, const PAIRS: usize>(
    samples: [&[f32]; VARIABLES],
    centers: [f64; VARIABLES],
) -> ([Sums; VARIABLES], [f64; PAIRS]) {
    const { assert!(PAIRS == VARIABLES * (VARIABLES - 1) / 2) };
    assert!(samples.iter().all(|line| line.len() == samples[0].len()));
    let widest = if VARIABLES == 1 { Instructions::up_to_256_bits() } else { Instructions::widest() };
    vectors::run_on(widest, Together { samples, centers })
}

/// Σ (x − c₀)(y − c₁) over two variables, all of one length.
pub fn product(samples: [&[f32]; 2], centers: [f64; 2]) -> f64 {
    vectors::run(Product { samples, centers })
}

/// Sums over the samples at even and at odd places.
pub fn alternating(samples: &[f32], centers: [f64; 2]) -> [Sums; 2] {
    vectors::run_on(Instructions::up_to_256_bits(), Alternating { samples, centers })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::vectors::{Instructions, run_on};

    fn samples(count: usize, seed: usize) -> Vec<f32> {
        (0..count).map(|i| 1e3 + ((i * 7919 + seed * 104_729) % 10_007) as f32 / 31.0).collect()
    }

    #[test]
    fn every_set_of_instructions_gives_the_same_bits() {
        for count in [1, 7, 8, 1003] {
            let (a, b, c) = (samples(count, 1), samples(count, 2), samples(count, 3));
            let made = Instructions::ALL.map(|set| {
                let together: ([Sums; 3], [f64; 3]) =
                    run_on(set, Together { samples: [&a, &b, &c], centers: [1000.1, 1100.3, 1200.7] });
                (together, run_on(set, Alternating { samples: &a, centers: [1000.1, 1100.3] }))
            });
            assert!(made.iter().all(|sums| *sums == made[0]), "{count}");
        }
    }

    /// Sums of integers are exact.
    #[test]
    fn tails_count_as_any_sample_does() {
        for count in 1..40_usize {
            let a: Vec<f32> = (0..count).map(|i| i as f32).collect();
            let b: Vec<f32> = (0..count).map(|i| (i * i % 7) as f32).collect();
            let ([sums, _], [product]) = together([&a, &b], [3.0, 2.0]);
            let deviations = || a.iter().map(|x| f64::from(*x) - 3.0);
            assert_eq!(sums.first, deviations().sum::<f64>());
            assert_eq!(sums.second, deviations().map(|d| d * d).sum::<f64>());
            assert_eq!(product, deviations().zip(&b).map(|(d, y)| d * (f64::from(*y) - 2.0)).sum::<f64>());
            assert_eq!((sums.min, sums.max), (0.0, (count - 1) as f32));
            let limits = Limits { low: f32::NAN, high: 30.0 };
            assert_eq!(limits.count(a.iter(), [sums.min, sums.max]), count.saturating_sub(30) as u64);
            let [even, odd] = alternating(&a, [0.0, 1.0]);
            assert_eq!(even.first, a.iter().step_by(2).map(|x| f64::from(*x)).sum::<f64>());
            assert_eq!(odd.first, a.iter().skip(1).step_by(2).map(|x| f64::from(*x) - 1.0).sum::<f64>());
        }
    }

    #[test]
    fn what_is_not_finite_shows_in_the_sums() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for at in [0, 5, 20] {
                let mut a = samples(21, 1);
                a[at] = bad;
                let ([sums], []) = together([&a], [1000.0]);
                assert!(!sums.first.is_finite());
            }
        }
        let huge = [f32::MAX; 2048];
        let ([sums], []) = together([&huge], [f64::from(-f32::MAX)]);
        assert!(sums.first.is_finite() && sums.second.is_finite());
    }
}
