//! The noise profile of a DNG.

use super::image::RawImage;
use super::tags;
use crate::camera::levels::WhiteLevel;
use crate::camera::noise_profile::NoiseProfile;
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::formats::tiff::{ExtraTag, TagValue, TiffFile};
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, Metadata, ProfileRecord};
use crate::propagation::linear::LinearNoise;
use crate::stages::noise::NoiseModel;

/// Most classes of a profile, as many as a filter array names filters.
const MOST_CLASSES: usize = 7;

/// The profile \[DNG2023, NoiseProfile], of the raw image or of the whole file; none where there is none. Notes tell why one that
/// is there is passed over.
///
/// # Errors
///
/// Those of the disk alone: no sample depends on it.
pub(super) fn profile(file: &mut TiffFile, image: &RawImage, notes: &mut Vec<String>) -> Result<Option<NoiseProfile>> {
    let tag = tags::NOISE_PROFILE;
    let Some(directory) = [image.directory(), &image.first].into_iter().find(|directory| tag.is_in(directory)) else {
        return Ok(None);
    };
    let numbers = match tag.numbers(file, directory, 2 * MOST_CLASSES as u64 + 1) {
        Err(Error::Format { problem, .. }) => {
            notes.push(format!("its noise profile is passed over: {problem}"));
            return Ok(None);
        }
        other => other?.unwrap_or_default(),
    };
    let (lines, rest) = numbers.as_chunks();
    if !rest.is_empty() || lines.is_empty() || numbers.iter().any(|number| !(0.0..=1.0).contains(number)) {
        notes.push("its noise profile is passed over: it is no pairs of numbers from 0 to 1 (NoiseProfile)".into());
        return Ok(None);
    }
    // Its lines are in the order of CFAPlaneColor.
    let order = super::color::plane_order(file, image)?.filter(|_| lines.len() == 3);
    let lines = order.map_or_else(|| lines.to_vec(), |order| order.map(|place| lines[place]).to_vec());
    Ok(Some(NoiseProfile { lines }))
}

/// The profile of a frame as its metadata keep it; none where its levels leave no range.
pub(super) fn record(profile: &NoiseProfile, metadata: &Metadata, geometry: &Geometry) -> Option<ProfileRecord> {
    let header = FrameHeader { name: String::new(), geometry: geometry.clone(), metadata: metadata.clone() };
    let black = header.black_levels().ok().flatten()?.largest([geometry.width, geometry.height], |_, _| None)[0];
    let range_adu = metadata.white_level_adu.map(WhiteLevel::largest)? - black;
    (range_adu > 0.0).then(|| ProfileRecord { lines: profile.lines.clone(), range_adu })
}

/// The tag of a frame with `range` ADU from black to white, where its metadata know the noise: that which was drawn, or that which
/// the raw file told.
pub(super) fn tag(header: &FrameHeader, cfa: FilterArray, range: f64) -> Option<ExtraTag> {
    let metadata = &header.metadata;
    // Dark frames bring noise of their own, and averages have less.
    let is_plain = metadata.correction.as_ref().is_none_or(|record| !record.took_frames() && record.is_plain());
    if !is_plain || metadata.average.is_some() {
        return None;
    }
    let numbers = match &metadata.noise {
        Some(_) => drawn(header, cfa, range)?,
        None => told(metadata, range)?,
    };
    Some(tags::NOISE_PROFILE.with(TagValue::Doubles(numbers)))
}

/// Variance over the signal x from 0 at black to 1 at white, S x + O for each class \[DNG2023, NoiseProfile], where the metadata
/// know all that it follows from.
fn drawn(header: &FrameHeader, cfa: FilterArray, range: f64) -> Option<Vec<f64>> {
    let metadata = &header.metadata;
    let (record, adc) = (metadata.noise.as_ref()?, metadata.adc.filter(|adc| !adc.is_bent())?);
    // Charge that moved makes neighbors alike, and amplifiers have one each.
    if record.cte.is_some() || header.taps().is_some() {
        return None;
    }
    let line = LinearNoise::of(&NoiseModel::of(header, record).ok()?, &adc);
    let planes = cfa.filters().len().max(1);
    let numbers = [line.slope_adu / range, line.offset_adu2 / (range * range)];
    // What takes too long to work out is no number.
    numbers.iter().all(|number| number.is_finite()).then(|| numbers.repeat(planes))
}

/// What the raw file told, of so many ADU from black to white; none once codes were made straight.
fn told(metadata: &Metadata, range: f64) -> Option<Vec<f64>> {
    let ProfileRecord { lines, range_adu } = metadata.noise_profile.as_ref()?;
    let scale = range_adu / range;
    let numbers: Vec<f64> = lines.iter().flat_map(|[slope, offset]| [slope * scale, offset * scale * scale]).collect();
    let is_sound = !numbers.is_empty() && numbers.iter().all(|number| (0.0..=1.0).contains(number));
    (is_sound && metadata.adc.is_none_or(|adc| !adc.is_linearized)).then_some(numbers)
}
