//! What is predicted of several exposures of one scene: of their means, and of what is drawn anew in each.

use super::frame::{FramePrediction, Sites};
use super::moments::{Equations, Prediction};
use super::repeated::is_linear;
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::{AverageRecord, FrameHeader};
use crate::numerics::averages::Combine;

/// Why nothing is said of exposures of what is curved.
const CURVED_APART: &str = "what of the scatter is fixed is told of what is linear in the samples of photosites alone: not of smooth \
                            hue transition, nor of xyY, L*a*b* and the like";

/// Why nothing is said of exposures of averages.
const AVERAGES: &str = "the frames are averages themselves";

/// Why the scatter of statistics over frames is not known.
const UNLIKE: &str = "how statistics over frames scatter is not predicted of hot pixels and random telegraph signals";

/// What is predicted of exposures of one scene.
pub struct Repeated {
    /// Of the frame of their means.
    pub means: FramePrediction,
    /// Of a frame whose sample covariance scatters N − 1 times as much, in variance, as what is drawn anew in N exposures.
    pub variances: FramePrediction,
    /// Why how far measured statistics scatter is not known, where it is not.
    pub scatter: Predicted<()>,
}

impl Repeated {
    /// Of so many exposures that differ from a frame in what is drawn anew alone.
    ///
    /// # Errors
    ///
    /// As [`super::of_frame`], and [`Unpredictable::Beyond`] for what is not linear in the samples of photosites.
    pub fn of(frame: &FrameHeader, equations: Equations, frames: u32) -> Predicted<Self> {
        if frame.metadata.average.is_some() {
            return Err(Unpredictable::Beyond(AVERAGES));
        }
        let sites = Sites::of(frame, equations)?;
        if !is_linear(frame) {
            return Err(Unpredictable::Beyond(CURVED_APART));
        }
        let temporal = sites.photosite.temporal_of(sites.expected_e)?;
        let mean = AverageRecord { frames, combine: Combine::Mean, clip: None };
        let of = |moments: [Prediction; 3]| Sites { moments, ..sites.clone() }.frame(frame);
        let has_tails = temporal.iter().any(|temporal| temporal.unlike.is_none());
        Ok(Self {
            means: of([0, 1, 2].map(|k| temporal[k].averaged(&sites.moments[k], &mean)))?,
            variances: of(temporal.map(|temporal| temporal.of_variances(frames)))?,
            scatter: if has_tails { Err(Unpredictable::Beyond(UNLIKE)) } else { Ok(()) },
        })
    }
}
