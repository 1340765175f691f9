//! What was changed in a sidecar since a frame was written.

use crate::formats::format::SampleReader;
use crate::formats::yaml;
use crate::metadata::Metadata;
use serde_yaml::Value;

/// So many keys are named.
const MOST_NAMED: usize = 3;

/// Warnings of what a sidecar says otherwise than the metadata that our program wrote into the frame's file: it was changed since.
/// What it says besides is no contradiction.
pub(super) fn changed_since(sidecar: &Metadata, reader: &dyn SampleReader) -> Vec<String> {
    let own = reader.embedded().and_then(|text| yaml::parse_metadata("", text).ok());
    // A sidecar with another history is that of another frame, as its digest tells.
    let Some(own) = own.filter(|own| !own.history.is_empty() && own.history == sidecar.history) else {
        return Vec::new();
    };
    let [told, written] =
        [sidecar.clone(), own].map(|metadata| serde_yaml::to_value(metadata.apart_from_storage()).ok());
    let mut found = Vec::new();
    told.zip(written).inspect(|(told, written)| compare("", told, written, &mut found));
    let left = found.len().saturating_sub(MOST_NAMED);
    if left > 0 {
        found.truncate(MOST_NAMED);
        found.push(format!("{left} more of its keys say another thing than the file of the frame; the sidecar counts"));
    }
    found
}

/// Looks for values of the key `path` that differ, or are gone.
fn compare(path: &str, told: &Value, written: &Value, found: &mut Vec<String>) {
    if let (Value::Mapping(told), Value::Mapping(written)) = (told, written) {
        for (key, written) in written {
            let name = key.as_str().unwrap_or("?");
            let path = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
            match told.get(key) {
                Some(told) => compare(&path, told, written, found),
                None => found.push(format!("it has no `{path}`, as the file of the frame has; the sidecar counts")),
            }
        }
        return;
    }
    if told != written {
        let words = |value: &Value| match value {
            Value::Mapping(_) | Value::Sequence(_) => None,
            value => serde_yaml::to_string(value).ok().map(|text| text.trim().to_owned()),
        };
        found.push(match words(told).zip(words(written)) {
            Some((told, written)) => {
                format!("its `{path}` is {told}, but {written} in the file of the frame; the sidecar counts")
            }
            None => format!("its `{path}` is another than in the file of the frame; the sidecar counts"),
        });
    }
}
