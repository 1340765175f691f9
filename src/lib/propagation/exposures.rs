//! What is predicted of several exposures of one scene: of their means, and of what is drawn anew in each.

use super::frame::{self, FramePrediction, Sites};
use super::lines::Axis;
use super::moments::{Equations, Prediction};
use super::photosite::Photosite;
use super::repeated::{is_linear, without_fixed};
use super::tapped_anew::{self, Read};
use super::tapped_flat;
use super::unlike::Temporal;
use super::unpredictable::{Predicted, Unpredictable};
use crate::frame::Geometry;
use crate::metadata::{AdcRecord, AverageRecord, ExposuresRecord, FrameHeader};
use crate::numerics::averages::Combine;
use crate::stages::noise::NoiseModel;

/// Why nothing is said of exposures of what is curved.
const CURVED_APART: &str = "what of the scatter is fixed is told of what is linear in the samples of photosites alone: not of smooth \
                            hue transition, nor of xyY, L*a*b* and the like";

/// Why nothing is said of exposures of averages.
const AVERAGES: &str = "the frames are averages themselves";

/// Why the scatter of statistics over frames is not known.
const UNLIKE: &str = "how statistics over frames scatter is not predicted of hot pixels and random telegraph signals";

/// Why the scatter of statistics over frames is not known where what is drawn anew differs from line to line.
const BY_LINES: &str = "rows or columns have fixed offsets or gains, and what is drawn anew hangs on these: shot noise on gains, and what an end \
                        of the codes or their steps leave on offsets; how far statistics over frames scatter by that is not predicted";

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
        if frame.taps().is_some() && tapped_flat::flat_of(frame).is_some() {
            return Err(Unpredictable::Beyond(tapped_flat::FLATTENED));
        }
        if !is_linear(frame) {
            // What is not known of a single exposure is said first.
            if frame.taps().is_none() {
                Sites::of(frame, equations)?;
            }
            return Err(Unpredictable::Beyond(CURVED_APART));
        }
        let mean = AverageRecord { frames, combine: Combine::Mean, clip: None };
        if let Some((read, variances)) = tapped_anew::drawn_anew(frame, equations, frames)? {
            let scatter = |Read { sites, temporal }: &Read| scatter_of(frame, sites, temporal, frames);
            let scatter = read.iter().try_for_each(scatter);
            let means = frame::of_frame(&averaged(frame, mean), equations)?;
            return Ok(Self { means, variances, scatter });
        }
        let sites = Sites::of(frame, equations)?;
        let temporal = sites.photosite.temporal_of(sites.expected_e)?;
        let of = |moments: [Prediction; 3]| Sites { moments, ..sites.clone() }.frame(frame);
        Ok(Self {
            means: of([0, 1, 2].map(|k| temporal[k].averaged(&sites.moments[k], &mean)))?,
            variances: of(temporal.each_ref().map(|temporal| temporal.of_variances(frames)))?,
            scatter: scatter_of(frame, &sites, &temporal, frames),
        })
    }
}

/// The head of such an average of exposures as a frame is one of.
fn averaged(frame: &FrameHeader, average: AverageRecord) -> FrameHeader {
    let mut averaged = frame.clone();
    let metadata = &mut averaged.metadata;
    metadata.average = Some(ExposuresRecord::of(average, metadata.quantity, metadata.demosaic.is_some()));
    averaged
}

/// Why how far statistics over so many frames scatter is not known, of photosites that one amplifier reads, where it is not.
fn scatter_of(frame: &FrameHeader, sites: &Sites, temporal: &[Temporal; 3], frames: u32) -> Predicted<()> {
    if temporal.iter().any(|temporal| temporal.unlike.is_none()) {
        return Err(Unpredictable::Beyond(UNLIKE));
    }
    if sites.photosite.hangs_on_lines(sites.expected_e, &frame.geometry, frames) {
        return Err(Unpredictable::Beyond(BY_LINES));
    }
    Ok(())
}

impl Photosite {
    /// Whether what is drawn anew hangs so much on what rows or columns have for good that means over them scatter by it, beside what
    /// N frames leave to chance: more than 3 % of its standard deviation.
    ///
    /// n (v(u) − v)² > 0.06 · 2 v²/(N − 1)        v the variance over exposures, u the rms of what a line has, n photosites of a line
    fn hangs_on_lines(&self, expected_e: [f64; 3], geometry: &Geometry, frames: u32) -> bool {
        const NEGLIGIBLE: f64 = 0.06;
        if self.flat.is_some() {
            return self.gains_show_over(expected_e, geometry, frames);
        }
        let Some(adc) = self.adc.filter(|_| !self.has_tails()) else { return false };
        let model = NoiseModel { lines: without_fixed(self.model.lines), ..self.model };
        let of = |class: usize, offset_e: f64, gain: f64| {
            let adc = AdcRecord { bias_adu: adc.bias_adu + adc.adu_per_e * offset_e, ..adc };
            let site = Self { model, adc: Some(adc), ..*self };
            site.temporal(class, gain * expected_e[class], false).variance
        };
        let shows = |axis: Axis| {
            let [_, offset_e, response] = axis.parts(&self.model.lines);
            if offset_e == 0.0 && response == 0.0 {
                return false;
            }
            // Every other photosite of a line is of a class.
            let along = match axis {
                Axis::Row => geometry.width,
                Axis::Column => geometry.height,
            };
            (0..3).any(|class| {
                let own = of(class, 0.0, 1.0);
                let chance = 2.0 * own * own / f64::from(frames.max(2) - 1);
                [1.0, -1.0].into_iter().any(|sign| {
                    let off = of(class, sign * offset_e, 1.0 + sign * response) - own;
                    0.5 * along as f64 * off * off > NEGLIGIBLE * chance
                })
            })
        };
        Axis::ALL.into_iter().any(shows)
    }
}
