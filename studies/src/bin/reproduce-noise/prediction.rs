//! What the paper's equations and the exact moments say of a frame.

use crate::camera::Camera;
use cyanometer::cfa::CfaPattern;
use cyanometer::frame::mirror;
use cyanometer::propagation::gains::{self, Gains};
use cyanometer::propagation::{self, Equations, Photosite, paper};
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::demosaic::stencil::{PHASES, REACH, phase};
use cyanometer::stages::demosaic::weights::{WeightTable, Weights};
use nalgebra::Matrix3;

/// Pattern of the sensor.
pub const PATTERN: CfaPattern = CfaPattern::Rggb;

/// An equation of the paper for the noise of demosaicked channels.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Equation {
    /// Eqs. 14 and 36 with the populations of the frame, 1/m for its mean.
    Bi14,
    /// Eq. 39 mended, 9/16 and 5/8.
    Bi39,
    /// Eq. 39 as printed, 0.53 and 5/8.
    Bi39Printed,
    /// Eq. 15 with the populations of the frame.
    Shti15,
    /// Eq. 48, which drops green.
    Shti48,
    /// Eqs. 16 and 17 with Table 8 for equal signals.
    EciEqual,
    /// Eqs. 16 and 17 with Table 8 for skies.
    EciSkies,
}

impl Equation {
    /// The method that it is of.
    pub fn method(self) -> Method {
        match self {
            Self::Bi14 | Self::Bi39 | Self::Bi39Printed => Method::Bilinear,
            Self::Shti15 | Self::Shti48 => Method::SmoothHue,
            Self::EciEqual | Self::EciSkies => Method::EffectiveColor,
        }
    }

    /// The covariance of demosaicked channels from that of the photosites.
    pub fn covariance(self, sites: &Sites, size: [usize; 2]) -> Matrix3<f64> {
        let Sites { mean, variance } = *sites;
        let by_paper = |size| paper::demosaicked(self.method(), variance, mean, size).unwrap_or_default();
        let diagonal = |chrominance: f64| {
            let [r, g, b] = variance;
            Matrix3::from_diagonal(&[chrominance * r, 0.625 * g, chrominance * b].into())
        };
        match self {
            Self::Bi39 => by_paper(None),
            Self::Bi14 | Self::Shti15 | Self::EciEqual => by_paper(Some(size)),
            Self::Bi39Printed => diagonal(0.53),
            Self::Shti48 => diagonal(0.75_f64.powi(2)),
            Self::EciSkies => paper::effective_color(variance, &paper::Coefficients::SKIES),
        }
    }

    /// The covariance of X, Y and Z: Eq. 19 for BI and SHTI, Eq. 20 for ECI.
    pub fn xyz(self, camera: &Camera, sites: &Sites, size: [usize; 2]) -> Matrix3<f64> {
        let camera_covariance = self.covariance(sites, size);
        let matrix = &camera.xyz_from_adu;
        if self.method() == Method::EffectiveColor {
            matrix * camera_covariance * matrix.transpose()
        } else {
            independent(matrix, &camera_covariance)
        }
    }
}

/// Eq. 19: squares add up, covariances are left out.
pub fn independent(matrix: &Matrix3<f64>, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal(&(matrix.map(|m| m * m) * covariance.diagonal()))
}

/// Means above black and variances of the photosites of R, G and B, in ADU.
#[derive(Clone, Copy)]
pub struct Sites {
    /// Mean above black.
    pub mean: [f64; 3],
    /// Variance.
    pub variance: [f64; 3],
}

impl Sites {
    /// By Eq. 11 of the paper times the slope, or exact.
    pub fn of(camera: &Camera, electrons: [f64; 3], equations: Equations) -> Self {
        let adc = &camera.adc;
        let black = adc.bias_adu + adc.adu_per_e * camera.model.dark_e;
        let moments =
            electrons.map(|e| Photosite::of_electrons(camera.model, equations).digitized(*adc).moments(e).moments);
        Self { mean: moments.map(|m| m.mean - black), variance: moments.map(|m| m.variance) }
    }
}

/// The weights of a method about a scene.
pub fn weights(method: Method, sites: &Sites) -> Weights {
    WeightTable::new(method, PATTERN).about(propagation::hues(sites.mean))
}

/// The expected sample covariance (divisor n − 1) of all pixels of a frame, edges and all.
///
/// E\[s²\] = (mean variance of a pixel − variance of the mean) n/(n − 1)
pub fn of_frame(method: Method, sites: &Sites, size: [usize; 2]) -> Matrix3<f64> {
    let weights = weights(method, sites);
    let count = (size[0] * size[1]) as f64;
    let pixel = frame_pixel(&weights, size).covariance(sites.variance);
    let mean = gains::mean_patch_mean(&weights, size).covariance(sites.variance);
    (pixel - mean) * (count / (count - 1.0))
}

/// Gains of the covariance of a pixel over all pixels of a frame whose edges are mirrored.
fn frame_pixel(weights: &Weights, [width, height]: [usize; 2]) -> Gains {
    let mut gains = Gains::zero();
    for (y, rows) in distinct(height) {
        for (x, columns) in distinct(width) {
            let pixel = phase(x as i64, y as i64);
            let (px, py) = (PHASES[pixel][0], PHASES[pixel][1]);
            // What mirroring lays on each site.
            let mut sites: Vec<([usize; 2], usize, [f64; 3])> = Vec::new();
            for dy in -REACH..=REACH {
                for dx in -REACH..=REACH {
                    let site = [mirror(x.cast_signed() + dx, width), mirror(y.cast_signed() + dy, height)];
                    let weight = [0, 1, 2].map(|channel| weights.stencil(pixel, channel).at([dx, dy]));
                    if let Some(found) = sites.iter_mut().find(|(at, _, _)| *at == site) {
                        found.2 = [0, 1, 2].map(|channel| found.2[channel] + weight[channel]);
                    } else {
                        let class = PATTERN.class((px + dx) as i64, (py + dy) as i64);
                        sites.push((site, class as usize, weight));
                    }
                }
            }
            let share = rows * columns / (width * height) as f64;
            for (_, class, weight) in sites {
                gains.own[class] += Matrix3::from_fn(|i, j| share * weight[i] * weight[j]);
            }
        }
    }
    gains
}

/// Places along an axis of even length that differ in what is mirrored into their reach, and how many there are of each.
fn distinct(length: usize) -> Vec<(usize, f64)> {
    let reach = REACH.unsigned_abs() + 1;
    let inner = (length - 2 * reach) as f64 / 2.0;
    let one = |place| (place, 1.0);
    let middle = [(reach, inner), (reach + 1, inner)];
    (0..reach).map(one).chain(middle).chain((length - reach..length).map(one)).collect()
}

/// How many independent pixels the variance of a frame's pixels is as sure as one of, over the number of pixels:
/// Σ over lags of the squared autocovariance, relative to the squared variance, its inverse.
pub fn effective_share(weights: &Weights, variance: [f64; 3]) -> [f64; 3] {
    let mut squares = [0.0; 3];
    let mut whole = [0.0; 3];
    let reach = 2 * REACH;
    for phase in 0..4 {
        for y in -reach..=reach {
            for x in -reach..=reach {
                let covariance = gains::autocovariance(weights, phase, [x, y]).covariance(variance);
                for channel in 0..3 {
                    squares[channel] += covariance[(channel, channel)].powi(2) / 4.0;
                    if [x, y] == [0, 0] {
                        whole[channel] += covariance[(channel, channel)] / 4.0;
                    }
                }
            }
        }
    }
    [0, 1, 2].map(|channel| whole[channel].powi(2) / squares[channel])
}

/// Square roots of the diagonal.
pub fn roots(covariance: &Matrix3<f64>) -> [f64; 3] {
    [0, 1, 2].map(|i| covariance[(i, i)].max(0.0).sqrt())
}
