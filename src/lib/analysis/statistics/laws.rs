//! What the head of a frame says of its samples, worked out once for all frames that have the same.

use super::region::Region;
use crate::metadata::{AverageRecord, ExposuresRecord, FrameHeader};
use crate::numerics::averages::Combine;
use crate::propagation::moments;
use crate::propagation::sampling::{Place, Sampling};
use crate::propagation::{self, Equations, FramePrediction, PixelMoments, Unpredictable};
use nalgebra::Matrix3;
use std::sync::Arc;

/// The laws of a frame, kept for the frames after it: exposures of one scene differ in what no law hangs on.
#[derive(Default)]
pub struct Laws(Option<Known>);

pub(super) struct Known {
    head: FrameHeader,
    equations: Equations,
    pub prediction: Result<FramePrediction, Unpredictable>,
    pub samplings: Samplings,
    is_bent: bool,
    /// Of regions of a frame that are told by their places.
    regions: Vec<(Region, Arc<Result<FramePrediction, Unpredictable>>)>,
}

impl Known {
    /// The same where something is predicted.
    ///
    /// # Errors
    ///
    /// Why nothing is.
    pub fn checked(&mut self) -> Result<&mut Self, Unpredictable> {
        match &self.prediction {
            Ok(_) => Ok(self),
            Err(why) => Err(*why),
        }
    }

    /// Whether regions of a frame differ by their places, beyond what their size tells: several amplifiers have read it, or full well or an
    /// end of the codes cuts off what rows and columns share.
    pub fn are_by_place(&self, frame: &FrameHeader) -> bool {
        frame.taps().is_some() || self.is_bent
    }

    /// What is predicted of a region of such a frame, with how it scatters.
    pub fn of_region(&mut self, frame: &FrameHeader, region: Region) -> Arc<Result<FramePrediction, Unpredictable>> {
        if let Some((_, known)) = self.regions.iter().find(|(of, _)| *of == region) {
            return Arc::clone(known);
        }
        let found = Arc::new(of_samples(frame, region, self.equations));
        if let Ok(FramePrediction::Tapped(pixels)) = &*found {
            pixels.sampling();
        }
        self.regions.push((region, Arc::clone(&found)));
        found
    }
}

/// What is predicted of the samples of a region of a frame; pixels that do not say where they were mirrored were so at its edges.
pub(super) fn of_samples(
    frame: &FrameHeader,
    region: Region,
    equations: Equations,
) -> Result<FramePrediction, Unpredictable> {
    let mut header = region.header(frame);
    if let Some(record) = header.metadata.demosaic.as_mut().filter(|_| frame.taps().is_none()) {
        record.plane.get_or_insert(frame.geometry.on_sensor());
    }
    propagation::of_samples(&header, equations)
}

impl Laws {
    /// Those of a frame.
    pub(super) fn of(&mut self, frame: &FrameHeader, equations: Equations) -> &mut Known {
        let head = frame.without_exposure();
        let known = self.0.take().filter(|known| known.equations == equations && known.head == head);
        self.0.insert(known.unwrap_or_else(|| {
            let prediction = propagation::of_frame(frame, equations);
            let has_lines = prediction.as_ref().is_ok_and(FramePrediction::has_lines);
            let of_whole = || of_samples(frame, Region::whole(frame), equations);
            let is_bent = has_lines && of_whole().is_ok_and(|found| is_by_place(&found));
            Known { prediction, samplings: Samplings::default(), is_bent, regions: Vec::new(), head, equations }
        }))
    }
}

/// What is predicted of the mean over so many such frames in a region, where its rows or columns scatter unlike: by their places.
pub(super) fn of_mean(
    frame: &FrameHeader,
    region: Region,
    equations: Equations,
    frames: u32,
) -> Option<FramePrediction> {
    let mut averaged = frame.clone();
    let metadata = &mut averaged.metadata;
    if metadata.average.is_some() {
        return None;
    }
    let average = AverageRecord { frames, combine: Combine::Mean, clip: None };
    metadata.average = Some(ExposuresRecord::of(average, metadata.quantity, metadata.demosaic.is_some()));
    of_samples(&averaged, region, equations).ok().filter(is_by_place)
}

/// Whether photosites are told by their places.
pub(super) fn is_by_place(found: &FramePrediction) -> bool {
    matches!(found, FramePrediction::Groups(_) | FramePrediction::Tapped(_))
}

/// Sampling laws by place: regions of one size and phase share one.
#[derive(Default)]
pub(super) struct Samplings(Vec<(Place, Sampling)>);

impl Samplings {
    /// The law of a region of a frame of mixed pixels.
    pub fn of(&mut self, mixture: &PixelMoments, frame: &FrameHeader, region: Region) -> Sampling {
        let place = region.place(frame);
        if let Some((_, known)) = self.0.iter().find(|(of, _)| *of == place) {
            return known.clone();
        }
        let mut made = Sampling::of(&mixture.weights, &mixture.sites, &place);
        made.covariance += mixture.beyond_weights();
        made.mean_covariance += common(mixture);
        self.0.push((place, made.clone()));
        made
    }
}

/// What all pixels are off together: each channel as the class that it is named for.
fn common(mixture: &PixelMoments) -> Matrix3<f64> {
    mixture.from_camera * moments::common(&mixture.sites) * mixture.from_camera.transpose()
}
