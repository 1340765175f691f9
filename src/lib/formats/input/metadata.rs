//! The metadata of a frame: where they are found, and what in them is doubtful.

use crate::error::{Error, Result};
use crate::formats::files::{read_file, sidecar_path};
use crate::formats::format::SampleReader;
use crate::formats::viewable::{Scaling, is_scale};
use crate::formats::{register, yaml, yaml_guard};
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, Metadata};
use crate::stages::saturation::{MASK_LAYER, samples_tell};
use std::path::Path;

/// The metadata of a frame, and where they were found.
pub(super) struct Found {
    pub(super) metadata: Metadata,
    /// What describes the samples, as messages call it: the sidecar, or what the frame itself holds.
    pub(super) sidecar: Option<String>,
    /// Whether they are those that the file itself holds.
    pub(super) is_embedded: bool,
}

/// The metadata in order of trust: those of the file `given`, sidecar, embedded, the format's own tags.
pub(super) fn find_metadata(
    reader: &dyn SampleReader,
    name: &str,
    path: Option<&Path>,
    given: Option<&Path>,
) -> Result<Found> {
    path.map_or(Ok(()), register::note_sidecar)?;
    let beside = |metadata, sidecar| Found { metadata, sidecar, is_embedded: false };
    let from_file = |path: &Path| -> Result<Metadata> {
        let shown = path.display().to_string();
        let bytes = read_file(path)?;
        let text = yaml_guard::checked_text(&bytes).map_err(|problem| Error::format(&shown, problem))?;
        yaml::parse_metadata(&shown, text)
    };
    if let Some(path) = given {
        let metadata = from_file(path)?;
        let shown = path.display().to_string();
        yaml::check_misspelt(&shown, &metadata)?;
        doubt_of_metadata(&shown, metadata.contradictions());
        return Ok(beside(metadata, None));
    }
    if let Some(sidecar) = path.map(sidecar_path).filter(|sidecar| sidecar.is_file()) {
        let (metadata, shown) = (from_file(&sidecar)?, sidecar.display().to_string());
        // Another version may have written it: what is unknown is kept.
        doubt_of_metadata(&shown, yaml::misspelt(&metadata).into_iter().chain(metadata.contradictions()));
        return Ok(beside(metadata, Some(shown)));
    }
    if let Some(text) = reader.embedded() {
        let describes = reader.describes_samples().then(|| "its metadata".to_owned());
        return Ok(Found { metadata: yaml::parse_metadata(name, text)?, sidecar: describes, is_embedded: true });
    }
    Ok(beside(reader.own_tags().clone(), None))
}

/// Warnings of what a file of metadata says.
fn doubt_of_metadata(name: &str, problems: impl IntoIterator<Item = String>) {
    problems.into_iter().for_each(|problem| register::doubt(format!("{name}: {problem}")));
}

/// What stored samples were multiplied with, which the metadata no longer say then. What the file itself says of it counts:
/// metadata beside it may have been made for another.
///
/// # Errors
///
/// [`Error::Format`] for what is no power of two.
pub(super) fn take_scaling(
    reader: &dyn SampleReader,
    metadata: &mut Metadata,
    is_embedded: bool,
    name: &str,
) -> Result<Option<Scaling>> {
    let found = metadata.sample_scale.take();
    let embedded = reader.embedded().filter(|_| !is_embedded).and_then(|text| yaml::parse_metadata(name, text).ok());
    let scale = embedded.map_or(found, |embedded| embedded.sample_scale).unwrap_or(1.0);
    if !is_scale(scale) {
        let problem = format!("its `sample_scale`, {scale}, is no power of two, as 0.25 and 16 are");
        return Err(Error::format(name, problem));
    }
    Ok(Scaling::of(reader.geometry().width, &reader.geometry().channels, scale))
}

/// A warning that pixels were made of saturated samples, where neither their level nor a layer tells which: TIFF has none.
pub(super) fn doubt_of_marks(header: &FrameHeader, stored: &Geometry) {
    let is_told = samples_tell(header) || stored.channels.iter().any(|channel| channel == MASK_LAYER);
    let saturated = header.metadata.samples.as_ref().and_then(|samples| samples.saturated);
    if let Some(count) = saturated.filter(|count| *count > 0 && !is_told) {
        register::doubt(format!(
            "{}: {count} of its pixels were made of saturated samples, by its sidecar, and nothing marks which; EXR would",
            header.name
        ));
    }
}
