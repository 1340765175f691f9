//! What a user says of a camera, put into the metadata of frames that do not say it.

use super::metadata::{FoundIn, of_file};
use super::options::OfCamera;
use crate::error::Result;
use crate::metadata::{FrameHeader, Metadata};
use crate::units::QuantityKind;

/// Puts what a file of metadata says of the camera into those of a frame which has none but its tags, where these do not say it. What it
/// says of an exposure, of the light and of what was done to samples is that of another frame.
///
/// # Errors
///
/// Those of the file.
pub(super) fn describe(metadata: &mut Metadata, found_in: &FoundIn, said: &OfCamera) -> Result<()> {
    let Some(path) = said.description.as_deref().filter(|_| *found_in == FoundIn::Tags) else { return Ok(()) };
    let described = of_file(path)?;
    if metadata.quantity == QuantityKind::Unspecified {
        (metadata.quantity, metadata.unit) = (described.quantity, described.unit);
    }
    metadata.cfa = metadata.cfa.or(described.cfa);
    metadata.origin = metadata.origin.or(described.origin);
    metadata.white_level_adu = metadata.white_level_adu.or(described.white_level_adu);
    if metadata.black_level_adu.is_none() {
        metadata.black_level_adu = described.black_level_adu;
        (metadata.black_by_row, metadata.black_by_column) = (described.black_by_row, described.black_by_column);
    }
    metadata.adc = metadata.adc.or(described.adc);
    metadata.sensor = metadata.sensor.take().or(described.sensor);
    metadata.camera = metadata.camera.take().or(described.camera);
    Ok(())
}

/// Puts the array and the white level that are said into the metadata of codes that do not say them.
pub(super) fn say(frame: &mut FrameHeader, said: &OfCamera) {
    let is_plane = frame.geometry.channels.len() == 1;
    let metadata = &mut frame.metadata;
    let cfa = said.cfa.filter(|_| metadata.cfa.is_none() && is_plane);
    let are_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
    let white = said.white_level_adu.filter(|_| metadata.white_level_adu.is_none() && are_codes);
    if cfa.is_none() && white.is_none() {
        return;
    }
    metadata.cfa = metadata.cfa.or(cfa);
    metadata.white_level_adu = metadata.white_level_adu.or(white.map(Into::into));
    metadata.name_codes();
}
