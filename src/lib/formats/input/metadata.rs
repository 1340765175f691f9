//! The metadata of a frame: where they are found, and what in them is doubtful.

use super::changed::changed_since;
use crate::camera::levels::BlackLevel;
use crate::camera::optics::doubt_of_time;
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::formats::dng::{are_other_colors, written_white};
use crate::formats::files::{read_file, sidecar_path};
use crate::formats::format::SampleReader;
use crate::formats::viewable::{Scaling, is_scale};
use crate::formats::{misspelt, register, yaml, yaml_guard};
use crate::frame::{Geometry, to_sample};
use crate::metadata::{FrameHeader, Metadata};
use crate::stages::saturation::{MASK_LAYER, untold};
use crate::units::QuantityKind;
use std::path::Path;

/// The metadata of a frame, and where they were found.
pub(super) struct Found {
    pub(super) metadata: Metadata,
    /// What describes the samples, as messages call it: the sidecar, or what the frame itself holds.
    pub(super) sidecar: Option<String>,
    /// Where they were found.
    pub(super) place: FoundIn,
}

/// Where metadata were found, in order of trust.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum FoundIn {
    /// In the file of this name that the user gave.
    Given(String),
    /// In this file beside the frame.
    Sidecar(String),
    /// In the frame's own file.
    Embedded,
    /// In what the file format's own tags say.
    Tags,
}

/// The metadata in order of trust: those of the file `given`, sidecar, embedded, the format's own tags. An exposure time that they do
/// not tell is that of the tags.
pub(super) fn find_metadata(
    reader: &dyn SampleReader,
    name: &str,
    path: Option<&Path>,
    given: Option<&Path>,
) -> Result<Found> {
    let mut found = most_trusted(reader, name, path, given)?;
    // A file that is given stands for all that comes with the frame.
    if given.is_none() && found.metadata.time_s().is_none() {
        found.metadata.exposure_time_s = reader.own_tags().time_s();
    }
    Ok(found)
}

fn most_trusted(reader: &dyn SampleReader, name: &str, path: Option<&Path>, given: Option<&Path>) -> Result<Found> {
    path.map_or(Ok(()), register::note_sidecar)?;
    if let Some(path) = given {
        // Whoever gives metadata says that they are of these samples.
        let metadata = Metadata { seal: None, ..of_file(path)? };
        let shown = path.display().to_string();
        misspelt::check_misspelt(&shown, &metadata)?;
        // Ours were looked at when they were written, and a user may have changed them since.
        let doubts = if metadata.history.is_empty() { Vec::new() } else { metadata.doubts() };
        doubt_of_metadata(&shown, doubts.into_iter().chain(time_alone(&metadata)).chain(metadata.contradictions()));
        return Ok(Found { metadata, sidecar: None, place: FoundIn::Given(shown) });
    }
    if let Some(sidecar) = path.map(sidecar_path).filter(|sidecar| sidecar.is_file()) {
        let (metadata, shown) = (of_file(&sidecar)?, sidecar.display().to_string());
        // Another version may have written it: what is unknown is kept.
        let time = time_alone(&metadata).filter(|_| metadata.history.is_empty());
        let doubts = misspelt::misspelt(&metadata).into_iter().chain(metadata.contradictions()).chain(time);
        let mut changed = changed_since(&metadata, reader);
        if changed.is_empty() {
            changed = tagged_otherwise(&metadata, reader);
        }
        doubt_of_metadata(&shown, doubts.chain(changed));
        return Ok(Found { metadata, sidecar: Some(shown.clone()), place: FoundIn::Sidecar(shown) });
    }
    if let Some(text) = reader.embedded() {
        let describes = reader.describes_samples().then(|| "its metadata".to_owned());
        let metadata = yaml::parse_metadata(name, text)?;
        doubt_of_metadata(name, tagged_otherwise(&metadata, reader));
        return Ok(Found { metadata, sidecar: describes, place: FoundIn::Embedded });
    }
    check_unit(reader.own_tags(), name)?;
    Ok(Found { metadata: reader.own_tags().clone(), sidecar: None, place: FoundIn::Tags })
}

/// The metadata in a file of their own.
///
/// # Errors
///
/// [`Error::Disk`] and [`Error::Format`].
pub(super) fn of_file(path: &Path) -> Result<Metadata> {
    let shown = path.display().to_string();
    let bytes = read_file(path)?;
    let text = yaml_guard::checked_text(&bytes).map_err(|problem| Error::format(&shown, problem))?;
    yaml::parse_metadata(&shown, text)
}

/// Refuses samples that a file says are something else than codes and electrons, which most programs would take for codes.
///
/// # Errors
///
/// [`Error::Format`] naming the unit.
fn check_unit(tags: &Metadata, name: &str) -> Result<()> {
    if tags.quantity != QuantityKind::Unspecified || tags.unit == QuantityKind::Unspecified.unit() {
        return Ok(());
    }
    let problem = format!(
        "its samples are in `{}` (BUNIT), and neither in ADU (adu, dn, count) nor in electrons (electron, e-); if they are codes all \
         the same, give metadata that say so, --metadata FILE with `quantity: adu`",
        tags.unit
    );
    Err(Error::format(name, problem))
}

/// Where on the sensor a frame begins, of which its metadata say `told`: there, where the file itself does not say it. Where both do
/// and differ, what the user gave counts, with a warning.
///
/// # Errors
///
/// [`Error::Format`] where other metadata and the file itself differ: one of the two was changed by another program, and nothing
/// tells which.
pub(super) fn placed(
    reader: &dyn SampleReader,
    told: Option<[i32; 2]>,
    found_in: &FoundIn,
    name: &str,
) -> Result<[i32; 2]> {
    let own = reader.geometry().origin;
    let Some(told) = told.filter(|told| *told != own) else { return Ok(own) };
    if !reader.tells_place() {
        return Ok(told);
    }
    let words = |[column, row]: [i32; 2]| format!("column {column}, row {row}");
    let (told_words, own_words) = (words(told), words(own));
    let (by, advice) = match found_in {
        FoundIn::Given(file) => {
            register::doubt(format!(
                "{name}: it begins at {told_words} of the sensor by {file} (`origin`), which counts, and at {own_words} by the file itself"
            ));
            return Ok(told);
        }
        FoundIn::Sidecar(file) => (
            file.as_str(),
            format!(
                "if the file is right take `origin` out of {file}, else give metadata whose `origin` counts, --metadata FILE"
            ),
        ),
        FoundIn::Embedded | FoundIn::Tags => {
            ("its metadata", "give metadata whose `origin: [X, Y]` counts, --metadata FILE".to_owned())
        }
    };
    Err(Error::format(
        name,
        format!(
            "it begins at {told_words} of the sensor by {by} (`origin`), but at {own_words} by the file itself, so that another program \
             changed one of the two; {advice}"
        ),
    ))
}

/// A warning of a time without an f-number that looks like another unit. Keywords and tags are in s by their standards.
fn time_alone(metadata: &Metadata) -> Option<String> {
    metadata.exposure_time_s.and_then(doubt_of_time)
}

/// Warnings of tags that say another thing than the metadata of ours which come with them: another program changed one of the two.
fn tagged_otherwise(metadata: &Metadata, reader: &dyn SampleReader) -> Vec<String> {
    /// Tags hold numbers in few digits, and f-numbers by their names.
    const SAME: f64 = 0.03;
    let tags = reader.own_tags();
    if metadata.history.is_empty() || tags == metadata {
        return Vec::new();
    }
    let differ = |a: f64, b: f64| (a - b).abs() > SAME * a.abs().max(b.abs());
    let mut found = Vec::new();
    let mut compare = |what: &str, pair: Option<(f64, f64)>| {
        if let Some((told, tagged)) = pair.filter(|(told, tagged)| differ(*told, *tagged)) {
            found.push(format!("its {what} is {told}, but {tagged} by the tags of the file, which do not count"));
        }
    };
    let aperture = |metadata: &Metadata| metadata.exposure.map(|exposure| exposure.f_number);
    compare("exposure time in s", metadata.time_s().zip(tags.time_s()));
    compare("f-number", aperture(metadata).zip(aperture(tags)));
    compare("sensitivity (ISO)", metadata.iso_speed.zip(tags.iso_speed));
    // What was multiplied for viewers has other levels in the file.
    if metadata.sample_scale.is_none() {
        compare("black level in ADU", metadata.uniform_black_adu().zip(tags.uniform_black_adu()));
        found.extend(other_white(metadata, reader));
    }
    if are_other_colors(metadata, tags) {
        found.push(
            "its colors are others by the tags of the file (ColorMatrix1, AsShotNeutral), which do not count".into(),
        );
    }
    let own = reader.geometry().origin;
    // Levels of sites, from the frame's first photosite on.
    let sites = |metadata: &Metadata, origin: [i32; 2]| {
        let corner = origin.map(|first| usize::from(first.rem_euclid(2) == 1));
        metadata.black_level_adu.map(|black| black.beginning_at(corner))
    };
    let blacks = sites(metadata, metadata.origin.unwrap_or(own)).zip(sites(tags, own));
    let are_by_site = |(told, tagged): &(BlackLevel, BlackLevel)| told.uniform().and(tagged.uniform()).is_none();
    if let Some((told, tagged)) = blacks.filter(are_by_site).filter(|_| metadata.sample_scale.is_none()) {
        let [told, tagged] = [told, tagged].map(BlackLevel::sites);
        if told.iter().zip(tagged).any(|(told, tagged)| differ(*told, tagged)) {
            found.push(format!(
                "its black levels in ADU are {told:?}, but {tagged:?} by the tags of the file, which do not count"
            ));
        }
    }
    let first = |metadata: &Metadata, origin: [i32; 2]| {
        let pattern = metadata.cfa.and_then(FilterArray::bayer)?;
        Some([0, 1].map(|row| pattern.row_classes(origin, row)))
    };
    let place = metadata.origin.unwrap_or(own);
    let classes = first(metadata, place).zip(first(tags, own));
    // Of other arrays that have the same place.
    let arrays = metadata.cfa.zip(tags.cfa).filter(|(told, _)| told.bayer().is_none() && place == own);
    if classes.is_some_and(|(told, tagged)| told != tagged) || arrays.is_some_and(|(told, tagged)| told != tagged) {
        found.push("its filter array is another by the tags of the file, which do not count".into());
    }
    found
}

/// A warning of a white level of tags that is neither that of the metadata nor what is written of it: the level of full well, where that is
/// below, and whole.
fn other_white(metadata: &Metadata, reader: &dyn SampleReader) -> Option<String> {
    let white = |metadata: &Metadata| metadata.white_level_adu.map(|white| white.largest());
    let (told, tagged) = white(metadata).zip(white(reader.own_tags()))?;
    let stored = reader.geometry();
    let origin = metadata.origin.unwrap_or(stored.origin);
    let geometry = Geometry { origin, ..stored.clone() };
    let frame = FrameHeader { name: String::new(), geometry, metadata: metadata.clone() };
    let is_written = [Some(told.floor()), written_white(&frame)].contains(&Some(tagged));
    let is_codes = metadata.quantity == QuantityKind::Adu;
    (is_codes && !is_written && told != tagged)
        .then(|| format!("its white level in ADU is {told}, but {tagged} by the tags of the file, which do not count"))
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
/// [`Error::Format`] for what is no power of two, but by tags of another program.
pub(super) fn take_scaling(
    reader: &dyn SampleReader,
    metadata: &mut Metadata,
    found_in: &FoundIn,
    name: &str,
) -> Result<Option<Scaling>> {
    let found = metadata.sample_scale.take();
    let embedded = reader
        .embedded()
        .filter(|_| *found_in != FoundIn::Embedded)
        .and_then(|text| yaml::parse_metadata(name, text).ok());
    let check = |scale: f64, name: &str, is_of_tags: bool| {
        // Those of other programs are no powers of two.
        let is_fine = if is_of_tags { scale > 0.0 && to_sample(scale).is_normal() } else { is_scale(scale) };
        if is_fine {
            return Ok(scale);
        }
        let problem = format!("its `sample_scale`, {scale}, is no power of two, as 0.25 and 16 are");
        Err(Error::format(name, problem))
    };
    // That of other metadata must be one, though it may not count.
    let told_by: &str = match found_in {
        FoundIn::Given(file) | FoundIn::Sidecar(file) => file,
        FoundIn::Embedded | FoundIn::Tags => name,
    };
    let found = found.map(|scale| check(scale, told_by, *found_in == FoundIn::Tags)).transpose()?;
    let scale = match embedded {
        Some(embedded) => check(embedded.sample_scale.unwrap_or(1.0), name, false)?,
        None => found.unwrap_or(1.0),
    };
    Ok(Scaling::of(reader.geometry().width, &reader.geometry().channels, scale))
}

/// A warning that pixels were made of saturated samples, where neither their level nor a layer tells which: TIFF has none, and other
/// programs drop those of EXR.
pub(super) fn doubt_of_marks(header: &FrameHeader, stored: &Geometry) {
    let is_marked = stored.channels.iter().any(|channel| channel == MASK_LAYER);
    if let Some(pixels) = untold(header, is_marked) {
        register::doubt(format!("{}: {pixels}, and nothing marks which; EXR would", header.name));
    }
}
