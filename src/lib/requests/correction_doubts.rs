//! What a user should hear of flats, of limits, and of dark frames that are cut off, by which a frame is corrected.

use crate::formats::format::SampleType;
use crate::formats::many::OneOfMany;
use crate::metadata::FrameHeader;
use crate::stages::darks::CutOff;
use crate::stages::defects::lost_beyond;
use crate::stages::flats::{FlatFrames, FlatLevels, FlatMeans};
use crate::stream::RowSource;
use crate::text::percent_in_decimals;

/// The share of a variance that limits may take unsaid.
const LEAST_LOST: f64 = 1e-3;

/// Less is beneath what black levels are told to, ADU.
pub(super) const LEAST_EXCESS_ADU: f64 = 0.02;

/// A warning of limits, in standard deviations, that mark so many ordinary photosites that variances fall short.
pub(super) fn doubt_of_limits(beyond: f64) -> Option<String> {
    let [share, variance] = lost_beyond(beyond);
    (variance > LEAST_LOST).then(|| {
        format!(
            "limits of {beyond} standard deviations mark ordinary photosites too, {:.2} % of them; up to {:.1} % of the variance \
             of the frames they are found in goes with them, which no prediction knows",
            100.0 * share,
            100.0 * variance
        )
    })
}

/// A warning of a plane that tells no filter array, whose defects are filled.
pub(super) fn doubt_of_array(frame: &FrameHeader) -> Option<String> {
    let is_untold = frame.metadata.cfa.is_none() && frame.geometry.channels.len() == 1;
    is_untold.then(|| {
        format!(
            "{}: nothing tells its filter array, and defects are filled from the photosites beside them, whatever their color; give --cfa \
             (`monochrome` of a sensor without filters)",
            frame.name
        )
    })
}

/// What is wrong with flats by which `frame` is divided.
pub(super) fn doubts_of_flats<S: RowSource>(
    flats: &FlatFrames<S>,
    means: &FlatMeans,
    frame: &FrameHeader,
) -> impl Iterator<Item = String> {
    let name = flats.name();
    let unlike = flats.leveled().and_then(|levels| doubt_of_unlike(name, levels));
    let of_means = [doubt_of_full(means), doubt_of_noise(name, means, frame), means.doubt.clone()];
    unlike.into_iter().chain(of_means.into_iter().flatten())
}

/// A warning of flats that are saturated.
fn doubt_of_full(means: &FlatMeans) -> Option<String> {
    (means.full > 0).then(|| {
        format!(
            "{} photosites of the flats are saturated; they are marked, and the means of all classes are those of places where none is",
            means.full
        )
    })
}

/// A warning of flats whose noise makes what is divided by them too bright: ⟨1/F⟩ is 1 + ρ over ⟨F⟩, ρ the relative variance. What they scatter by
/// from photosite to photosite is noise and response; that of the sensor which is named is known.
fn doubt_of_noise(name: &str, means: &FlatMeans, frame: &FrameHeader) -> Option<String> {
    /// A bias that shows beside the standard error of a mean over few thousand photosites; responses differ by less than its root, 4.5 %.
    const LEAST: f64 = 0.002;
    let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
    let bias = means.scatter.powi(2) - readout.map_or(0.0, |readout| readout.prnu.powi(2));
    (bias > LEAST).then(|| {
        format!(
            "{name}: the flats scatter by {:.1} % of their level from photosite to photosite; as far as that is noise, what is divided by them is \
             {:.2} % too bright, as the mean of 1/F is above 1/⟨F⟩; average more flats, or brighter ones",
            100.0 * means.scatter,
            100.0 * bias
        )
    })
}

/// A warning of frames without light whose samples are cut off at code 0, which came off a frame of such a mean beyond.
pub(super) fn doubt_of_cut_off(cut: &CutOff, left_adu: f64) -> Option<String> {
    /// A share of the light that does not show.
    const LEAST_SHARE: f64 = 0.005;
    let CutOff { name, share, excess_adu } = cut;
    (*excess_adu > LEAST_EXCESS_ADU.max(LEAST_SHARE * left_adu)).then(|| {
        format!(
            "{name}: {} % of the samples of these dark or bias frames are 0, where codes are cut off; as far as they are normal their mean is \
             {excess_adu:.2} ADU too high, and what they come off, {left_adu:.2} ADU on average, is too low by as much; have the camera add an offset, \
             or take off its bias, --black",
            percent_in_decimals(*share, 0)
        )
    })
}

/// A warning of frames without light that are stored in 8 bits, unlike a frame of such a mean that they came off: nothing tells their scale.
pub(super) fn doubt_of_bytes<'a>(darks: impl IntoIterator<Item = &'a OneOfMany>, light_adu: f64) -> Option<String> {
    const LARGEST: f64 = 255.0;
    // White levels that both tell are compared before.
    let is_small = |dark: &&OneOfMany| {
        dark.stored_as() == Some(SampleType::U8) && dark.header().metadata.white_level_adu.is_none()
    };
    let dark = darks.into_iter().find(is_small).filter(|_| light_adu > LARGEST)?;
    Some(format!(
        "{}: it is stored in 8 bits, and what it comes off averages {light_adu:.1} ADU, which 8 bits do not hold: unless its codes were small \
         enough as they are, its scale is another; take it in the bits of the frame",
        dark.header().name
    ))
}

/// What is said of flats that were brought to one level before their median or clipped mean.
pub(super) fn said_of_levels<S: RowSource>(flats: &FlatFrames<S>) -> Option<String> {
    let (name, [low, high]) = (flats.name(), ends(flats.leveled()?.shares()?));
    Some(format!(
        "{name}: the flats are from {low:.3} to {high:.3} times as bright as their mean; each was brought to one level before they were combined"
    ))
}

/// A warning of flats whose light differs from place to place, whatever their level.
fn doubt_of_unlike(name: &str, levels: &FlatLevels) -> Option<String> {
    let unlike = levels.unlike?;
    Some(format!(
        "{name}: in {} % of the flats their light differs, each brought to one level, by {:.1} times the noise of one; there the median or \
         clipped mean takes the flat in the middle, with the noise of one, and nothing is predicted of the frame; --combine mean takes all",
        percent_in_decimals(unlike.share, 0),
        unlike.spread
    ))
}

fn ends(shares: &[f64]) -> [f64; 2] {
    shares.iter().fold([f64::INFINITY, 0.0], |[low, high], share| [low.min(*share), high.max(*share)])
}
