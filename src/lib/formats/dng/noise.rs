//! The noise profile of a DNG.

use super::image::RawImage;
use super::tags;
use crate::camera::noise_profile::NoiseProfile;
use crate::error::{Error, Result};
use crate::formats::tiff::TiffFile;

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
    Ok(Some(NoiseProfile { lines: lines.to_vec() }))
}
