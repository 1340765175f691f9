//! The plain version of every method, in doubles and pixel by pixel, and how far the filters may lie from it.
//!
//! The bounds count roundings: u = 2⁻²⁴ is the share that rounding to a 32-bit float may change. Terms in u² are below
//! 10⁻⁵ of those in u and stand in the last digit of each bound.

use super::stencil::phase;
use super::weights::WeightTable;
use super::{Black, Demosaic, Method};
use crate::cfa::{CfaPattern, Class};
use crate::frame::{Geometry, Rows, Window, mirror};
use crate::metadata::{FrameHeader, Metadata};
use crate::numerics::vectors::Instructions;
use crate::stream::Counts;
use crate::units::QuantityKind;

/// A plane of photosites less a black level, edges mirrored.
struct Plane<'a> {
    samples: &'a [f32],
    width: usize,
    height: usize,
    black: f64,
    pattern: CfaPattern,
}

impl Plane<'_> {
    fn at(&self, x: isize, y: isize) -> f64 {
        f64::from(self.samples[mirror(y, self.height) * self.width + mirror(x, self.width)]) - self.black
    }

    fn class(&self, x: isize, y: isize) -> Class {
        self.pattern.class(x as i64, y as i64)
    }

    /// Mean of a function over the neighbors of another class than the pixel's own, which are beside it, above and below
    /// it, or diagonal to it, never both.
    fn mean(&self, x: isize, y: isize, class: Class, f: impl Fn(isize, isize) -> f64) -> f64 {
        let near = [[-1, 0], [1, 0], [0, -1], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]];
        let sites = near.iter().map(|[dx, dy]| [x + dx, y + dy]).filter(|&[x, y]| self.class(x, y) == class);
        let values: Vec<f64> = sites.map(|[x, y]| f(x, y)).collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    fn smooth_hue(&self, x: isize, y: isize, class: Class) -> f64 {
        let green = |x, y| match self.class(x, y) {
            Class::Green => self.at(x, y),
            _ => self.mean(x, y, Class::Green, |x, y| self.at(x, y)),
        };
        match class {
            here if here == self.class(x, y) => self.at(x, y),
            Class::Green => green(x, y),
            _ => green(x, y) * self.mean(x, y, class, |x, y| self.at(x, y) / green(x, y)),
        }
    }

    /// The sum of weighted samples; propagation takes the same weights.
    fn linear(&self, method: Method, x: isize, y: isize, class: Class) -> f64 {
        let weights = WeightTable::of(method, self.pattern).fixed(phase(x as i64, y as i64));
        weights[class as usize].sites().map(|([dx, dy], weight)| weight * self.at(x + dx, y + dy)).sum()
    }

    fn value(&self, method: Method, x: isize, y: isize, class: Class) -> f64 {
        match method {
            Method::SmoothHue => self.smooth_hue(x, y, class),
            _ => self.linear(method, x, y, class),
        }
    }

    /// The largest sample that a pixel is made of.
    fn largest(&self, method: Method, x: isize, y: isize) -> f64 {
        let reach = method.reach().cast_signed();
        let near = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| [dx, dy]));
        near.map(|[dx, dy]| self.at(x + dx, y + dy).abs()).fold(0.0, f64::max)
    }

    /// What the filter makes of it on a set of instructions, `[row][channel][column]`.
    fn filtered(&self, method: Method, set: Instructions) -> (Vec<f32>, Counts) {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(self.pattern.into());
        let geometry = Geometry::new(self.width, self.height, &["Y"]);
        let header = FrameHeader { name: "test".into(), geometry, metadata };
        let stage = Demosaic::new(&header, method, Black::Level(self.black.into()), None).unwrap();
        let mut made = vec![0.0; 3 * self.samples.len()];
        let window = Window::new(self.height, 0, self.width, 1, self.samples);
        let counts = stage.apply_on(set, window, Rows::new(0, self.width, 3, &mut made));
        (made, counts)
    }
}

/// Whole numbers of 32 bits that look random.
fn scattered(seed: u32) -> impl Iterator<Item = u32> {
    (0_u32..).map(move |i| {
        let mixed = (i ^ seed.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
        let mixed = (mixed ^ (mixed >> 13)).wrapping_mul(0xc2b2_ae35);
        mixed ^ (mixed >> 16)
    })
}

const SIZES: [[usize; 2]; 9] = [[2, 2], [2, 5], [3, 2], [3, 3], [5, 4], [17, 9], [131, 7], [577, 4], [1025, 3]];

/// All methods on all patterns and sizes; 577 and 1025 columns are cut into strips.
fn for_all(samples: impl Fn(u32) -> f32, black: f64, check: impl Fn(&Plane<'_>, Method, &str)) {
    for method in Method::ALL {
        for pattern in CfaPattern::ALL {
            for [width, height] in SIZES {
                let samples: Vec<f32> =
                    scattered(u32::try_from(width).unwrap()).take(width * height).map(&samples).collect();
                let plane = Plane { samples: &samples, width, height, black, pattern };
                check(&plane, method, &format!("{method:?} {pattern} {width}x{height}"));
            }
        }
    }
}

/// Roundings of the arithmetic, as each filter's file has them, and one of each sample when black is subtracted, times
/// the sum of the sizes of the weights: 1, 2½ and 5 at most. Smooth hue transition divides and multiplies, so the bound
/// is on shares of the value: 3 of the pixel's green, 5 of a hue, 2 of their mean and one of the product.
fn bound(method: Method, largest: f64, value: f64) -> f64 {
    let [of_largest, of_value] = match method {
        Method::Bilinear => [3.0, 0.0],
        Method::SmoothHue => [0.0, 11.0],
        Method::EffectiveColor => [30.0, 0.0],
        Method::Malvar => [12.5, 0.0],
    };
    let u = 2.0_f64.powi(-24);
    u * (of_largest * largest + of_value * value.abs()) * (1.0 + 1e-5)
}

#[test]
fn the_filters_are_as_near_their_plain_versions_as_their_roundings_allow() {
    // With 10-bit fractions and a black level that is no float; positive where a quotient's error is bounded.
    for (offset, methods) in
        [(2000.0, &Method::ALL[..]), (-1.0e3, &[Method::Bilinear, Method::EffectiveColor, Method::Malvar])]
    {
        let sample = |bits: u32| (bits % 4_194_304) as f32 / 1024.0 + offset;
        for_all(sample, 102.345_678_9, |plane, method, what| {
            if !methods.contains(&method) {
                return;
            }
            let (made, counts) = plane.filtered(method, Instructions::widest());
            assert_eq!(counts, Counts::default());
            for (index, &found) in made.iter().enumerate() {
                let (x, y) = ((index % plane.width).cast_signed(), (index / plane.width / 3).cast_signed());
                let class = Class::ALL[index / plane.width % 3];
                let value = plane.value(method, x, y, class);
                let off = (f64::from(found) - value).abs();
                let bound = bound(method, plane.largest(method, x, y), value);
                assert!(off <= bound, "{what}: {class:?} at {x},{y} is {found}, not {value}: {off} of {bound}");
            }
        });
    }
}

/// Among them zeros, NaN, infinities, and samples whose sums lie beyond the range of floats.
fn strange(bits: u32) -> f32 {
    match bits % 97 {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        3..6 => f32::MAX,
        6..9 => f32::MIN,
        9 => f32::from_bits(bits >> 9),
        10..30 => 0.0,
        _ => (bits >> 16) as f32 / 16.0 - 2000.0,
    }
}

#[test]
fn every_set_of_instructions_gives_the_same_bits() {
    for samples in [strange, |bits| (bits >> 8) as f32 / 256.0] {
        for_all(samples, 17.3, |plane, method, what| {
            let (expected, counts) = plane.filtered(method, Instructions::Baseline);
            let expected: Vec<u32> = expected.into_iter().map(f32::to_bits).collect();
            for set in Instructions::ALL {
                let (made, counted) = plane.filtered(method, set);
                // Which NaN a sum of two NaN is, is not told.
                let differing = made.iter().zip(&expected).position(|(made, expected)| {
                    made.to_bits() != *expected && !(made.is_nan() && f32::from_bits(*expected).is_nan())
                });
                assert_eq!(differing, None, "{what} on {set:?}");
                assert_eq!(counted, counts, "{what} on {set:?}");
            }
        });
    }
}

/// A sample that is no number, or one beyond what sums can hold, changes what reaches it and not one bit of the rest;
/// and the measured sample stays what it is.
#[test]
fn what_is_far_from_a_strange_sample_does_not_feel_it() {
    for_all(
        |bits| (bits >> 20) as f32 + 1.0,
        0.0,
        |plane, method, what| {
            let (expected, _) = plane.filtered(method, Instructions::widest());
            for strange in [f32::NAN, f32::NEG_INFINITY, f32::MAX] {
                let mut samples = plane.samples.to_vec();
                let [column, row] = [plane.width / 2, plane.height / 2];
                samples[row * plane.width + column] = strange;
                let (made, _) = Plane { samples: &samples, ..*plane }.filtered(method, Instructions::widest());
                for (index, (made, expected)) in made.iter().zip(&expected).enumerate() {
                    let (x, y, class) = (index % plane.width, index / plane.width / 3, index / plane.width % 3);
                    if x.abs_diff(column).max(y.abs_diff(row)) > method.reach() {
                        assert_eq!(made.to_bits(), expected.to_bits(), "{what}: {x},{y}");
                    }
                    if [x, y] == [column, row] && class == plane.class(x.cast_signed(), y.cast_signed()) as usize {
                        assert_eq!(made.to_bits(), strange.to_bits(), "{what}: {x},{y}");
                    }
                }
            }
        },
    );
}

/// Means of the largest floats are the largest float; what lies beyond the range has the bilinear value and is counted.
#[test]
fn means_of_large_samples_do_not_overflow() {
    for_all(
        |_| f32::MAX,
        0.0,
        |plane, method, what| {
            let (made, counts) = plane.filtered(method, Instructions::widest());
            assert!(made.iter().all(|&sample| sample == f32::MAX), "{what}");
            assert!(method != Method::Bilinear || counts == Counts::default(), "{what}");
        },
    );
}
