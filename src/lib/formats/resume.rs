//! What an earlier run has left complete.

use super::input::FrameReader;
use super::output::OutputOptions;
use super::places::{named, sidecar_path};
use super::yaml::{parse_metadata, write_metadata};
use crate::error::Result;
use crate::metadata::FrameHeader;
use std::fs::File;

/// Whether the frame `made` lies at a place already, whole: its sidecar says of it what this run would, and describes the samples
/// that the file holds. What is damaged, or cannot be read, is not complete.
///
/// # Errors
///
/// Those of [`write_metadata`].
pub fn is_complete(options: &OutputOptions, made: &FrameHeader) -> Result<bool> {
    // What is no file, such as a named pipe, keeps nothing.
    let Some(path) = named(options.path.as_deref()).filter(|path| path.is_file()) else { return Ok(false) };
    let sidecar = sidecar_path(path);
    let Some(found) = std::fs::read_to_string(&sidecar)
        .ok()
        .and_then(|text| parse_metadata(&sidecar.display().to_string(), &text).ok())
    else {
        return Ok(false);
    };
    let digest = found.samples.as_ref().map(|samples| samples.digest.clone());
    if write_metadata(&found.apart_from_storage())? != write_metadata(&made.metadata.clone().apart_from_storage())? {
        return Ok(false);
    }
    let stored = options.sample_type(made)?;
    let holds = |digest: String| {
        FrameReader::holds(File::open(path).ok()?, &path.display().to_string(), made, (&digest, stored)).ok()
    };
    Ok(digest.and_then(holds).unwrap_or(false))
}
