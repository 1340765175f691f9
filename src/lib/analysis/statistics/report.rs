//! What is said of a frame, its regions and their channels.

use super::check::{Subject, Test};
use super::deviates::{Shown, forget_deviates};
use super::region::Region;
use super::verdict::Verdict;
use super::watch::Marks;
use crate::metadata::{Coverage, FrameHeader};
use crate::units::QuantityKind;
use serde::Serialize;

/// Everything that is said of a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// One entry per region; the whole frame where none was named.
    pub regions: Vec<RegionReport>,
    /// Whether all predictions hold, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub check: Option<Verdict>,
    /// What predicted standard deviations, and layers of them, count.
    pub uncertainty: Coverage,
    /// Why nothing is predicted of the frame as a whole, where that is so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unpredicted: Option<String>,
}

/// What standard deviations of a frame count.
pub(super) fn coverage(frame: &FrameHeader) -> Coverage {
    Coverage::of_colors(frame.metadata.color.as_ref())
}

/// What is said of a region.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegionReport {
    /// The rectangle.
    pub region: Region,
    /// Column and row of the patch in its chart, where patches are measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patch: Option<[usize; 2]>,
    /// Number of the patch, row by row, from 0; where the width of the chart is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample: Option<usize>,
    /// Pixels whose samples are all finite.
    pub count: u64,
    /// Pixels left out because a sample is NaN or infinite.
    pub not_finite: u64,
    /// Pixels that were made of saturated samples, which are left out unless they are asked for; of the samples of
    /// photosites those at full well or the white level, which are not.
    pub saturated: u64,
    /// Pixels that are, or used, defective photosites, which are left out.
    #[serde(skip_serializing_if = "is_zero")]
    pub defective: u64,
    /// Pixels that are, or used, samples interpolated in their place, which are left out.
    #[serde(skip_serializing_if = "is_zero")]
    pub corrected: u64,
    /// Pixels of which a correction knows nothing, which are left out.
    #[serde(skip_serializing_if = "is_zero")]
    pub beyond_model: u64,
    /// Whether saturated pixels are left out.
    #[serde(skip)]
    pub leaves_saturated_out: bool,
    /// Quantity and unit of the samples.
    pub quantity: QuantityKind,
    /// Unit.
    pub unit: String,
    /// Statistics of each channel.
    pub channels: Vec<ChannelReport>,
    /// Statistics of the classes of a CFA plane.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<ChannelReport>,
    /// Sample covariance of the channels (divisor n − 1).
    pub covariance: Option<Vec<Vec<f64>>>,
    /// The same by formula.
    pub predicted_covariance: Option<Vec<Vec<f64>>>,
    /// Predicted standard deviation of the mean of the region in each channel.
    pub patch_mean_std: Option<Vec<f64>>,
    /// Tests of the predictions, where they were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<Test>,
}

impl RegionReport {
    /// The same with so many marked pixels; those that were left out were taken as not finite before.
    #[must_use]
    pub(super) fn with_marks(self, marks: Marks, leaves_saturated_out: bool) -> Self {
        let Marks { saturated, defective, corrected, beyond_model, left_out } = marks;
        let not_finite = self.not_finite.saturating_sub(left_out);
        Self { not_finite, saturated, defective, corrected, beyond_model, leaves_saturated_out, ..self }
    }

    /// The same as tests of it found it, where there are any.
    #[must_use]
    pub(super) fn tested(mut self, tests: Vec<Test>) -> Self {
        fn shown(channels: &mut [ChannelReport], of: fn(&mut ChannelReport) -> &mut Option<f64>) -> Shown<'_> {
            channels.iter_mut().map(|channel| (channel.name.clone(), of(channel))).collect()
        }
        let mut forget = |subject: Subject, of: fn(&mut ChannelReport) -> &mut Option<f64>| {
            let both = [&mut self.channels, &mut self.classes].map(|channels| shown(channels, of));
            forget_deviates(&tests, subject, both);
        };
        forget(Subject::Mean, |channel| &mut channel.z_mean);
        forget(Subject::Variance, |channel| &mut channel.z_std);
        Self { tests, ..self }
    }

    /// The same with nothing predicted: what is left where pixels are left out by their values follows no formula.
    #[must_use]
    pub(super) fn without_predictions(self) -> Self {
        let without = |channel: ChannelReport| ChannelReport {
            predicted_mean: None,
            predicted_std: None,
            z_mean: None,
            z_std: None,
            ..channel
        };
        Self {
            channels: self.channels.into_iter().map(without).collect(),
            classes: self.classes.into_iter().map(without).collect(),
            predicted_covariance: None,
            patch_mean_std: None,
            ..self
        }
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Statistics of one channel, or of one class of a CFA plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelReport {
    /// Name.
    pub name: String,
    /// Finite samples.
    pub count: u64,
    /// Mean.
    pub mean: Option<f64>,
    /// Sample standard deviation (divisor n − 1).
    pub std: Option<f64>,
    /// Smallest sample.
    pub min: Option<f64>,
    /// Largest sample.
    pub max: Option<f64>,
    /// 20 log₁₀ of the mean above black over the standard deviation.
    pub snr_db: Option<f64>,
    /// Samples at the ends of the range: code 0 and the white level of its class, or electrons at full well or above.
    pub clipped: Option<u64>,
    /// Mean by formula.
    pub predicted_mean: Option<f64>,
    /// Standard deviation by formula.
    pub predicted_std: Option<f64>,
    /// (mean − predicted) over its sampling error, which knows that demosaicked neighbors are correlated.
    pub z_mean: Option<f64>,
    /// (std / expected − 1) over its sampling error, that of independent samples √((2 + κ n⁄(n−1)) / 4n), κ the excess
    /// kurtosis.
    pub z_std: Option<f64>,
    /// Standard error of the mean: s/√n_eff. Where a prediction knows how demosaicked neighbors are correlated, n_eff is
    /// its effective number; elsewhere samples count as independent, in a CFA plane within each class.
    pub mean_error: Option<f64>,
    /// Standard error of the standard deviation: with a prediction s times its relative one, elsewhere s/√(2(n − 1)), that
    /// of independent normal samples; in a CFA plane from those of its classes.
    pub std_error: Option<f64>,
}

impl ChannelReport {
    /// Takes out what hangs on how far samples hang together.
    pub(super) fn forget_errors(&mut self) {
        (self.z_mean, self.z_std, self.mean_error, self.std_error) = (None, None, None, None);
    }
}
