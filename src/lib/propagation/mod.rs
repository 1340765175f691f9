//! Moments by formula: what the noise of a uniform scene amounts to, before any number is drawn.
//!
//! Each stage has the **exact** moments and, where they differ, those of the **paper**. [`photosite`] knows photosites,
//! [`gains`] and [`pixel_moments`] what becomes of them when each pixel is a weighted sum of many, [`paper`] the equations
//! of \[HP2005], [`frame`] how the head of a frame leads to its moments.

mod amplitudes;
mod anew;
mod bent;
mod blur;
pub mod budget;
mod charge;
mod columns;
mod counts;
pub mod covariance;
mod curved;
mod divided;
pub mod drift;
mod effort;
mod ends;
mod exposures;
pub mod frame;
pub mod gains;
pub(crate) mod ground;
mod law;
mod level_variance;
mod line_means;
mod line_sampling;
mod line_sums;
pub mod linear;
mod lines;
mod lookup;
pub mod masters;
mod memory;
pub mod moments;
mod node;
mod offsets;
pub mod paper;
mod pattern;
mod pattern_nodes;
pub mod photosite;
mod pixel_drift;
mod pixel_gains;
mod pixel_light;
mod pixel_lines;
pub mod pixel_moments;
pub mod pixels;
mod place;
mod population;
mod reading;
mod record;
mod rectified;
mod repeated;
pub mod sampling;
pub mod saturation;
pub mod smooth_hue;
mod spaces;
mod steps;
mod straight;
mod tails;
pub mod tap_lines;
pub mod tapped;
mod tapped_axis;
mod tapped_factors;
mod tapped_sampling;
mod tapped_shares;
pub mod taps;
mod unlike;
mod unpredictable;

pub use exposures::Repeated;
pub use frame::{FramePrediction, Unpredictable, of_frame};
pub use moments::{Equations, LineCovariance, Prediction, SiteCovariance};
pub use photosite::Photosite;
pub use pixel_moments::PixelMoments;
pub use record::note;
pub use smooth_hue::hues;
pub use tapped::TappedPixels;
