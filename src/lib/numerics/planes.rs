//! Weighted sums over planes of samples: the integral over wavelength of every pixel of a spectral image.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over pixels that the compiler turns into vectors index several arrays"
)]

use super::vectors::{self, Instructions, Kernel};

/// Pixels that are summed together: their sums, three doubles each, stay in the level-1 cache.
pub const PIXELS: usize = 512;

/// Planes whose products are added between one store of a sum and the next.
const TOGETHER: usize = 4;

/// Pixels whose sums are kept in registers meanwhile, three doubles each: as many as registers hold.
const SIDE_BY_SIDE: usize = 16;

/// The same without wide vectors.
const FEW_SIDE_BY_SIDE: usize = 4;

/// A plane that counts, and its weights in the three sums.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedPlane {
    /// Its place among the planes.
    pub plane: usize,
    /// Its weights.
    pub weights: [f64; 3],
}

/// Σ_p w_kp x_p of up to [`PIXELS`] pixels, `P` side by side, k = 0, 1, 2; planes in order, products and sums in doubles.
///
/// A sum over n planes is within n · 2⁻⁵³ Σ |w x| of the exact one; it is the same to the bit on all sets of instructions.
struct Weighted<'a, const P: usize> {
    pixels: Pixels<'a>,
    sums: &'a mut [[f64; PIXELS]; 3],
}

/// Some pixels of planes of `stride` samples one after another, and the planes that count.
#[derive(Clone, Copy)]
struct Pixels<'a> {
    samples: &'a [f32],
    stride: usize,
    first: usize,
    count: usize,
    planes: &'a [WeightedPlane],
}

/// Sums pixels on one set of instructions, as many side by side as its registers hold.
fn sum_on(instructions: Instructions, pixels: Pixels<'_>, sums: &mut [[f64; PIXELS]; 3]) {
    match instructions {
        Instructions::Baseline => vectors::run_on(instructions, Weighted::<FEW_SIDE_BY_SIDE> { pixels, sums }),
        _ => vectors::run_on(instructions, Weighted::<SIDE_BY_SIDE> { pixels, sums }),
    }
}

impl<const P: usize> Kernel for Weighted<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { pixels: Pixels { samples, stride, first, count, planes }, sums } = self;
        let line = |plane: &WeightedPlane| &samples[plane.plane * stride + first..][..count];
        let mut sums = sums.each_mut().map(|sums| &mut sums[..count]);
        sums.iter_mut().for_each(|sums| sums.fill(0.0));
        let (groups, rest) = planes.as_chunks::<TOGETHER>();
        for (index, group) in groups.iter().enumerate() {
            let next = groups.get(index + 1).unwrap_or(group);
            let weights = group.map(|plane| plane.weights);
            add::<TOGETHER, P>(group.each_ref().map(line), next.each_ref().map(line), weights, &mut sums);
        }
        for plane in rest {
            add::<1, P>([line(plane)], [line(plane)], [plane.weights], &mut sums);
        }
    }
}

/// Adds the products of some planes to the sums, and has the planes that come `next` fetched meanwhile: their lines are too
/// short and too far apart for the processor to foresee.
#[inline(always)]
fn add<const N: usize, const P: usize>(
    lines: [&[f32]; N],
    next: [&[f32]; N],
    weights: [[f64; 3]; N],
    sums: &mut [&mut [f64]; 3],
) {
    let [red, green, blue] = sums;
    let count = red.len();
    let blocks = count / P;
    let [by_line, by_next] = [lines, next].map(|lines| lines.map(|line| line.as_chunks::<P>().0));
    for lines in by_line.iter().chain(&by_next) {
        // Told once, it need not be looked after at every block.
        assert!(lines.len() == blocks);
    }
    {
        let [red, green, blue] = [&mut *red, green, blue].map(|sums| &mut sums.as_chunks_mut::<P>().0[..blocks]);
        for block in 0..blocks {
            let (mut r, mut g, mut b) = (red[block], green[block], blue[block]);
            for plane in 0..N {
                vectors::prefetch(&by_next[plane][block]);
                let samples = by_line[plane][block].map(f64::from);
                for x in 0..P {
                    r[x] += weights[plane][0] * samples[x];
                    g[x] += weights[plane][1] * samples[x];
                    b[x] += weights[plane][2] * samples[x];
                }
            }
            (red[block], green[block], blue[block]) = (r, g, b);
        }
    }
    for x in blocks * P..count {
        for (line, weights) in lines.iter().zip(&weights) {
            let sample = f64::from(line[x]);
            red[x] += weights[0] * sample;
            green[x] += weights[1] * sample;
            blue[x] += weights[2] * sample;
        }
    }
}

/// Hands `take` the three sums of each of `width` pixels, first to last; `samples` are planes of `width` samples one after
/// another.
///
/// # Panics
///
/// When a plane lies beyond the samples.
pub fn weighted_sums(samples: &[f32], width: usize, planes: &[WeightedPlane], mut take: impl FnMut([f64; 3])) {
    let mut sums = [[0.0; PIXELS]; 3];
    for first in (0..width).step_by(PIXELS) {
        let count = PIXELS.min(width - first);
        sum_on(Instructions::widest(), Pixels { samples, stride: width, first, count, planes }, &mut sums);
        for x in 0..count {
            take(sums.each_ref().map(|sums| sums[x]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(width: usize, planes: usize) -> (Vec<f32>, Vec<WeightedPlane>) {
        let samples = (0..width * planes).map(|i| ((i * 7919) % 10_007) as f32 / 31.0).collect();
        let weighted = (0..planes).rev().map(|plane| {
            let weight = |k: usize| ((plane * 37 + k * 11) % 101) as f64 / 7.0;
            WeightedPlane { plane, weights: [weight(0), weight(1), weight(2)] }
        });
        (samples, weighted.collect())
    }

    #[test]
    fn every_set_of_instructions_gives_the_bits_of_the_plain_sum() {
        for (width, planes) in [(1, 1), (5, 3), (511, 8), (700, 43)] {
            let (samples, weighted) = scene(width, planes);
            let plain: Vec<[f64; 3]> = (0..width)
                .map(|x| {
                    [0, 1, 2].map(|k| {
                        let terms = weighted.iter().map(|p| p.weights[k] * f64::from(samples[p.plane * width + x]));
                        terms.fold(0.0, |sum, term| sum + term)
                    })
                })
                .collect();
            let mut found = Vec::new();
            weighted_sums(&samples, width, &weighted, |sums| found.push(sums));
            assert_eq!(found, plain);
            let count = width.min(PIXELS);
            for set in Instructions::ALL {
                let mut sums = [[0.0; PIXELS]; 3];
                let pixels = Pixels { samples: &samples, stride: width, first: 0, count, planes: &weighted };
                sum_on(set, pixels, &mut sums);
                assert!((0..count).all(|x| [0, 1, 2].map(|k| sums[k][x]) == plain[x]));
            }
        }
    }
}
