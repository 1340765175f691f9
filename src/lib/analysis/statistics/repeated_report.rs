//! What is said of several frames of one scene, their regions and channels.

use super::check::{Subject, Test};
use super::deviates::{Shown, forget_deviates};
use super::region::Region;
use super::verdict::Verdict;
use crate::metadata::Coverage;
use crate::units::QuantityKind;
use serde::Serialize;

/// Everything that is said of frames of one scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatedReport {
    /// How many frames.
    pub frames: u32,
    /// One entry per region; the whole frame where none was named.
    pub regions: Vec<RepeatedRegion>,
    /// Whether all predictions hold, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub check: Option<Verdict>,
    /// What predicted standard deviations count.
    pub uncertainty: Coverage,
    /// What frames differ in beside what tells exposures apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unlike: Option<String>,
    /// Why nothing is predicted, or nothing can be tested, where that is so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unpredicted: Option<String>,
}

/// What is said of a region.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatedRegion {
    /// The rectangle.
    pub region: Region,
    /// Pixels whose samples are finite in all frames.
    pub count: u64,
    /// Pixels that are not, or that are marked in any frame and left out.
    pub left_out: u64,
    /// Quantity of the samples.
    pub quantity: QuantityKind,
    /// Unit.
    pub unit: String,
    /// Statistics of each channel.
    pub channels: Vec<RepeatedChannel>,
    /// Statistics of the classes of a CFA plane.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<RepeatedChannel>,
    /// Covariance of the channels of a pixel from frame to frame; none where pixels are left out.
    pub temporal_covariance: Option<Vec<Vec<f64>>>,
    /// Covariance over pixels of what is the same in all frames.
    pub fixed_covariance: Option<Vec<Vec<f64>>>,
    /// The first as it is expected of this region, by formula.
    pub predicted_temporal_covariance: Option<Vec<Vec<f64>>>,
    /// The second by formula.
    pub predicted_fixed_covariance: Option<Vec<Vec<f64>>>,
    /// Predicted standard deviation of the mean over region and frames in each channel.
    pub patch_mean_std: Option<Vec<f64>>,
    /// Tests of the predictions, where they were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<Test>,
}

impl RepeatedRegion {
    /// The same as tests of it found it, where there are any.
    #[must_use]
    pub(super) fn tested(mut self, tests: Vec<Test>) -> Self {
        fn shown(channels: &mut [RepeatedChannel], of: fn(&mut RepeatedChannel) -> &mut Option<f64>) -> Shown<'_> {
            channels.iter_mut().map(|channel| (channel.name.clone(), of(channel))).collect()
        }
        let mut forget = |subject: Subject, of: fn(&mut RepeatedChannel) -> &mut Option<f64>| {
            let both = [&mut self.channels, &mut self.classes].map(|channels| shown(channels, of));
            forget_deviates(&tests, subject, both);
        };
        forget(Subject::Mean, |channel| &mut channel.z_mean);
        forget(Subject::TemporalVariance, |channel| &mut channel.z_temporal_std);
        forget(Subject::VarianceOfMeans, |channel| &mut channel.z_std_of_means);
        Self { tests, ..self }
    }
}

/// Statistics of one channel, or of one class of a CFA plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatedChannel {
    /// Name.
    pub name: String,
    /// Pixels.
    pub count: u64,
    /// Mean over pixels and frames.
    pub mean: Option<f64>,
    /// Standard deviation from frame to frame of a pixel, beside what all pixels of a frame do together.
    pub temporal_std: Option<f64>,
    /// Standard deviation over pixels of what is the same in all frames; −√|F| where the estimate F of its square is below zero.
    pub fixed_std: Option<f64>,
    /// Standard deviation over pixels of their means over frames.
    pub std_of_means: Option<f64>,
    /// Standard deviation over frames of their means over pixels.
    pub std_of_frame_means: Option<f64>,
    /// Samples at the ends of the range, of all frames.
    pub clipped: Option<u64>,
    /// Mean by formula.
    pub predicted_mean: Option<f64>,
    /// The others as they are expected of this region, by formula.
    pub predicted_temporal_std: Option<f64>,
    /// See [`Self::fixed_std`].
    pub predicted_fixed_std: Option<f64>,
    /// See [`Self::std_of_means`].
    pub predicted_std_of_means: Option<f64>,
    /// See [`Self::std_of_frame_means`].
    pub predicted_std_of_frame_means: Option<f64>,
    /// (mean − predicted) over its standard error.
    pub z_mean: Option<f64>,
    /// (temporal std ⁄ expected − 1) over its standard error.
    pub z_temporal_std: Option<f64>,
    /// The same of the standard deviation of means.
    pub z_std_of_means: Option<f64>,
    /// Standard error of the mean.
    pub mean_error: Option<f64>,
    /// Standard error of the temporal standard deviation.
    pub temporal_std_error: Option<f64>,
    /// Standard error of the fixed one; below twice that it is a bound rather than a number.
    pub fixed_std_error: Option<f64>,
}
