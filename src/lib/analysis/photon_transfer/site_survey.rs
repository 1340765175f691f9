//! What frames of one condition tell of a grid of photosites.

use super::falling::Falling;
use super::row_drift::RowScatter;
use crate::numerics::variance_components::MeanSquares;

/// What a grid of photosites does under one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct SiteSurvey {
    /// Frames.
    pub frames: usize,
    /// Photosites, columns and rows.
    pub size: [usize; 2],
    /// Mean over frames and photosites.
    pub mean: f64,
    /// What temporal noise makes the mean scatter by: a variance.
    pub mean_variance: f64,
    /// Temporal variance of a sample.
    pub variance: f64,
    /// What it scatters by: a variance.
    pub variance_variance: f64,
    /// Samples at or above the top code, and at or below 0.
    pub at_ends: [u64; 2],
    /// Columns and rows of the grid's photosites that have samples at the top code, or at the largest sample where that is not known, row by
    /// row; none where they are many.
    pub at_top: Vec<[usize; 2]>,
    /// Columns and rows of those that are marked as defective or interpolated in any of the frames, row by row; more than a hundredth of all are
    /// cut short.
    pub mended: Vec<[usize; 2]>,
    /// Photosites whose means are at or above that of full ones, where that is known.
    pub full: u64,
    /// The largest sample, and how many are it, where no top code is known.
    pub largest: Option<(f64, u64)>,
    /// Mean squares of the temporal noise.
    pub temporal: MeanSquares,
    /// How rows go with their neighbors.
    pub row_scatter: RowScatter,
    /// Mean squares of the mean of the frames.
    pub spatial: MeanSquares,
    /// Fourth cumulant of the mean of the frames at single photosites, 0 or more, by the differences of neighbors: half of theirs.
    pub fourth: f64,
    /// Sums that tell how many photosites make up that cumulant: Σ d⁴ and 2 Σ d⁸, d the differences of neighbors.
    pub of_steps: [f64; 2],
    /// The same of the scatter of the temporal variance: Σ q² and Σ q⁴, q the sum of squares of a photosite over the frames.
    pub of_noise: [f64; 2],
    /// Means of the frames.
    pub frame_means: Vec<f64>,
    /// Excess kurtosis of the temporal noise, and what it scatters by, a variance.
    pub excess: [f64; 2],
    /// The correlation of the temporal noise of neighbors, in a row and in a column, beyond that of photosites farther apart, each with what it
    /// scatters by, a variance.
    pub neighbors: [[f64; 2]; 2],
    /// How the temporal noise of photosites goes with their means.
    pub falling: Falling,
    /// Frames whose fixed pattern is not that of the others.
    pub strangers: Vec<usize>,
    /// Two frames whose samples are the same, or differ by one number alone, though they vary from photosite to photosite.
    pub copies: Option<[usize; 2]>,
}

impl SiteSurvey {
    /// How many photosites there are.
    pub fn count(&self) -> usize {
        self.size[0] * self.size[1]
    }
}
