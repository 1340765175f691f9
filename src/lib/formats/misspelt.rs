//! Unknown keys of metadata that look like known ones, or stand in another place than these.

use super::keys::KeyPage;
use crate::error::{Error, Result};
use crate::metadata::Metadata;
use crate::names::nearest;
use serde_yaml::Mapping;
use std::collections::BTreeSet;

/// Refuses unknown keys of metadata that a user wrote where they look like known ones. Other unknown keys are kept.
///
/// # Errors
///
/// [`Error::Format`] naming both.
pub fn check_misspelt(name: &str, metadata: &Metadata) -> Result<()> {
    misspelt(metadata).map_or(Ok(()), |problem| Err(Error::format(name, problem)))
}

/// The first unknown key of metadata that looks like a known one beside it, or is called as one elsewhere.
pub fn misspelt(metadata: &Metadata) -> Option<String> {
    if metadata.unknown.is_empty() {
        return None;
    }
    let of_sensor = KeyPage::Sensor.keys().map(|[path, ..]| format!("sensor.{path}"));
    let known: BTreeSet<String> = KeyPage::Metadata.keys().map(|[path, ..]| path.to_owned()).chain(of_sensor).collect();
    within(&metadata.unknown, "", &known)
}

/// The same of the keys of a part, whose path ends in a point where it is not all.
fn within(unknown: &Mapping, part: &str, known: &BTreeSet<String>) -> Option<String> {
    unknown.iter().find_map(|(key, value)| {
        let typed = key.as_str()?;
        let path = format!("{part}{typed}");
        if known.contains(&path) {
            // A known key stands here for those within it that are not, or is not written where it is 0.
            return within(value.as_mapping()?, &format!("{path}."), known);
        }
        let meant = beside(typed, part, known).or_else(|| elsewhere(typed, part, known))?;
        Some(format!("unknown key `{path}`; did you mean `{meant}`?"))
    })
}

/// The known key of a part that a typed one looks like.
fn beside(typed: &str, part: &str, known: &BTreeSet<String>) -> Option<String> {
    let names = || known.iter().filter_map(|path| path.strip_prefix(part)).filter(|name| !name.contains('.'));
    let found = nearest(&typed.to_lowercase(), names(), |known| (known.len() / 4).min(2))?;
    Some(format!("{part}{found}"))
}

/// The known key that is called as one in a part where it is none: first that of the same group, then that which is in none.
fn elsewhere(typed: &str, part: &str, known: &BTreeSet<String>) -> Option<String> {
    let group = part.split_once('.').map(|(group, _)| format!("{group}."))?;
    let is_called_so = |path: &&String| path.starts_with(&group) && path.rsplit('.').next() == Some(typed);
    known.iter().find(is_called_so).or_else(|| known.get(typed)).cloned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> Option<String> {
        let unknown = serde_yaml::from_str(text).unwrap();
        misspelt(&Metadata { unknown, ..Metadata::new(crate::units::QuantityKind::Adu) })
    }

    #[test]
    fn keys_are_told_wherever_they_look_like_known_ones() {
        for (text, wanted) in [
            ("exposure: {iso_speed: 400}", Some(("exposure.iso_speed", "iso_speed"))),
            ("exposure: {f_numbr: 8}", Some(("exposure.f_numbr", "exposure.f_number"))),
            ("exposre: {f_number: 8}", Some(("exposre", "exposure"))),
            ("camera_settings: {black_level_adu: 8}", Some(("camera_settings.black_level_adu", "black_level_adu"))),
            (
                "sensor: {readout: {read_niose_e: 8}}",
                Some(("sensor.readout.read_niose_e", "sensor.readout.read_noise_e")),
            ),
            ("sensor: {cfa: rggb}", Some(("sensor.cfa", "sensor.readout.cfa"))),
            // What is known and not written, what is nobody's, and what others have in groups of their own.
            ("sensor: {readout: {prnu_row: 0}}", None),
            ("exposure: {shutter: electronic}", None),
            ("observatory: {iso_speed: 400}", None),
        ] {
            let wanted = wanted.map(|(key, meant)| format!("unknown key `{key}`; did you mean `{meant}`?"));
            assert_eq!(said(text), wanted, "{text}");
        }
    }
}
