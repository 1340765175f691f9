//! What is predicted of a frame, written into its metadata.

use super::frame::{FramePrediction, of_frame};
use super::moments::{Equations, Prediction};
use super::saturation;
use super::taps::pooled;
use crate::metadata::{FrameHeader, PredictedRecord};
use nalgebra::Matrix3;

/// Writes the predicted moments of a frame into its metadata, where there are any, and the shares of its classes that are
/// saturated.
pub fn note(frame: &mut FrameHeader, equations: Equations) {
    // A frame of which nothing can be predicted carries no prediction; `of_frame` tells why to whoever asks.
    frame.metadata.predicted = of_frame(frame, equations).ok().map(|prediction| {
        let of = |classes: [Prediction; 3]| {
            (classes.map(|class| class.moments.mean), classes.map(|class| class.moments.std()))
        };
        let stds = |covariance: &Matrix3<f64>| [0, 1, 2].map(|i| covariance[(i, i)].max(0.0).sqrt());
        let (mean, std) = match prediction {
            FramePrediction::Planes(classes) => of(classes),
            FramePrediction::Groups(sites) => of(pooled(&sites.groups)),
            FramePrediction::Pixels(pixels) => (pixels.mean, stds(&pixels.covariance)),
            FramePrediction::Tapped(pixels) => (pixels.mean, stds(&pixels.covariance)),
        };
        PredictedRecord { mean, std, saturated: saturation::expected(frame) }
    });
}
