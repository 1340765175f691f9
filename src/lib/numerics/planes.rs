//! Weighted sums over planes of samples: the integral over wavelength of every pixel of a spectral image.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over pixels that the compiler turns into vectors index several arrays"
)]

use super::vectors::{self, Kernel};

/// Pixels that are summed together: their sums, three doubles each, stay in the level-1 cache.
pub const PIXELS: usize = 512;

/// Planes whose products are added between one store of a sum and the next.
const TOGETHER: usize = 8;

/// A plane that counts, and its weights in the three sums.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedPlane {
    /// Its place among the planes.
    pub plane: usize,
    /// Its weights.
    pub weights: [f64; 3],
}

/// Σ_p w_kp x_p of up to [`PIXELS`] pixels, k = 0, 1, 2; planes in order, products and sums in doubles.
///
/// A sum over n planes is within n · 2⁻⁵³ Σ |w x| of the exact one; it is the same to the bit on all sets of instructions.
struct Weighted<'a> {
    samples: &'a [f32],
    stride: usize,
    first: usize,
    planes: &'a [WeightedPlane],
    sums: &'a mut [[f64; PIXELS]; 3],
    count: usize,
}

impl Kernel for Weighted<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { samples, stride, first, planes, sums, count } = self;
        let line = |plane: &WeightedPlane| &samples[plane.plane * stride + first..][..count];
        let [red, green, blue] = sums.each_mut().map(|sums| &mut sums[..count]);
        red.fill(0.0);
        green.fill(0.0);
        blue.fill(0.0);
        let (groups, rest) = planes.as_chunks::<TOGETHER>();
        for group in groups {
            let lines = group.each_ref().map(line);
            let weights = group.map(|plane| plane.weights);
            for x in 0..count {
                let (mut r, mut g, mut b) = (red[x], green[x], blue[x]);
                for (line, weights) in lines.iter().zip(&weights) {
                    let sample = f64::from(line[x]);
                    r += weights[0] * sample;
                    g += weights[1] * sample;
                    b += weights[2] * sample;
                }
                (red[x], green[x], blue[x]) = (r, g, b);
            }
        }
        for plane in rest {
            let weights = plane.weights;
            for (x, &sample) in line(plane).iter().enumerate() {
                let sample = f64::from(sample);
                red[x] += weights[0] * sample;
                green[x] += weights[1] * sample;
                blue[x] += weights[2] * sample;
            }
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
        vectors::run(Weighted { samples, stride: width, first, planes, sums: &mut sums, count });
        for x in 0..count {
            take(sums.each_ref().map(|sums| sums[x]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::vectors::{Instructions, run_on};

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
                let kernel =
                    Weighted { samples: &samples, stride: width, first: 0, planes: &weighted, sums: &mut sums, count };
                run_on(set, kernel);
                assert!((0..count).all(|x| [0, 1, 2].map(|k| sums[k][x]) == plain[x]));
            }
        }
    }
}
