//! Table 8: correlation coefficients of ECI, by the weights and as simulated, and what r′₂ may have been.

use crate::prediction::PATTERN;
use cyanometer::cfa::Class;
use cyanometer::numerics::moments::Moments;
use cyanometer::propagation::gains;
use cyanometer::propagation::paper::Coefficients;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::demosaic::stencil::PHASES;
use cyanometer::stages::demosaic::weights::WeightTable;
use nalgebra::{Matrix3, Vector3};

/// The coefficients in the order of Table 8, then those of Eq. 20.
pub const NAMES: [&str; 11] =
    ["r₁", "r₂", "r′₁ (R)", "r′₂ (R)", "r₃ (R)", "r′₁ (B)", "r′₂ (B)", "r₃ (B)", "r_rg", "r_rb", "r_gb"];

/// Coefficients as a list.
pub fn list(r: &Coefficients) -> [f64; 11] {
    [
        r.r1,
        r.r2,
        r.r1_prime[0],
        r.r2_prime[0],
        r.r3[0],
        r.r1_prime[1],
        r.r2_prime[1],
        r.r3[1],
        r.red_green,
        r.red_blue,
        r.green_blue,
    ]
}

/// Coefficients from a list.
pub fn unlist(list: [f64; 11]) -> Coefficients {
    let [r1, r2, r1_red, r2_red, r3_red, r1_blue, r2_blue, r3_blue, red_green, red_blue, green_blue] = list;
    Coefficients {
        r1,
        r2,
        r1_prime: [r1_red, r1_blue],
        r2_prime: [r2_red, r2_blue],
        r3: [r3_red, r3_blue],
        red_green,
        red_blue,
        green_blue,
    }
}

const RED: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0);
const GREEN: Vector3<f64> = Vector3::new(0.0, 1.0, 0.0);
const BLUE: Vector3<f64> = Vector3::new(0.0, 0.0, 1.0);

/// The correlation of two mixtures of the channels of a pixel.
fn correlation(covariance: &Matrix3<f64>, a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    let of = |a: Vector3<f64>, b: Vector3<f64>| (a.transpose() * covariance * b)[0];
    of(a, b) / (of(a, a) * of(b, b)).sqrt()
}

/// Covariances of demosaicked pixels: at the sites of R, G and B, and over all.
pub struct Covariances {
    classes: [Matrix3<f64>; 3],
    all: Matrix3<f64>,
}

impl Covariances {
    /// By the weights, at given variances of the photosites.
    pub fn by_weights(variances: [f64; 3]) -> Self {
        let weights = WeightTable::new(Method::EffectiveColor, PATTERN).about([1.0, 1.0]);
        let class = |class: Class| {
            let phases: Vec<usize> = (0..PHASES.len()).filter(|&phase| weights.class(phase, [0, 0]) == class).collect();
            let sum: Matrix3<f64> =
                phases.iter().map(|&phase| gains::pixel(&weights, phase).covariance(variances)).sum();
            sum / phases.len() as f64
        };
        Self { classes: Class::ALL.map(class), all: gains::mean_pixel(&weights).covariance(variances) }
    }

    /// Of the pixels of a frame.
    pub fn of(classes: &[Moments; 3]) -> Self {
        let mut all = Moments::new(3);
        classes.iter().for_each(|class| all.merge(class));
        Self { classes: classes.each_ref().map(crate::camera::covariance), all: crate::camera::covariance(&all) }
    }

    /// What Table 8 has, in the order of [`NAMES`].
    pub fn table(&self) -> [f64; 11] {
        let [red, green, blue] = &self.classes;
        [
            correlation(red, RED, GREEN - RED),
            correlation(blue, BLUE, GREEN - BLUE),
            correlation(green, GREEN, GREEN - RED),
            correlation(blue, GREEN, GREEN - RED),
            correlation(red, GREEN, RED),
            correlation(green, GREEN, GREEN - BLUE),
            correlation(red, GREEN, GREEN - BLUE),
            correlation(blue, GREEN, BLUE),
            correlation(&self.all, RED, GREEN),
            correlation(&self.all, RED, BLUE),
            correlation(&self.all, GREEN, BLUE),
        ]
    }

    /// Readings of r′₂, red and blue, in the order of [`READINGS`].
    pub fn readings(&self) -> [[f64; 2]; READINGS.len()] {
        let [red, green, blue] = &self.classes;
        let interpolated = red + blue;
        [
            [correlation(blue, GREEN, GREEN - RED), correlation(red, GREEN, GREEN - BLUE)],
            [correlation(red, GREEN, GREEN - RED), correlation(blue, GREEN, GREEN - BLUE)],
            [correlation(&interpolated, GREEN, GREEN - RED), correlation(&interpolated, GREEN, GREEN - BLUE)],
            [
                correlation(&(green * 2.0 + blue), GREEN, GREEN - RED),
                correlation(&(green * 2.0 + red), GREEN, GREEN - BLUE),
            ],
            [correlation(&self.all, GREEN, GREEN - RED), correlation(&self.all, GREEN, GREEN - BLUE)],
            [correlation(green, GREEN, GREEN - RED), correlation(green, GREEN, GREEN - BLUE)],
        ]
    }
}

/// What the text may mean by “the correlation between the interpolated green pixels and the K_R domain”.
pub const READINGS: [&str; 6] = [
    "green where the other class is measured, with the mean K there: what Eq. 57 takes it for",
    "green where the same class is measured, with K there",
    "interpolated green at both, with K there",
    "green wherever the class is interpolated, with the mean K there",
    "demosaicked green and K over all pixels",
    "measured green with the mean K there, which is r′₁",
];

/// Mean of lists.
pub fn mean<const N: usize>(lists: impl Iterator<Item = [f64; N]>) -> [f64; N] {
    let mut count = 0.0;
    let mut sum = [0.0; N];
    for list in lists {
        count += 1.0;
        for (sum, value) in sum.iter_mut().zip(list) {
            *sum += value;
        }
    }
    sum.map(|sum| sum / count)
}
