//! YAML, read with limits: metadata, sensors and matrices all come through here.

use super::foreign::yaml_complaint;
use crate::error::{Error, Result};
use crate::metadata::{METADATA_SCHEMA, Metadata};
use serde::Serialize;
use serde::de::{DeserializeOwned, Deserializer, Visitor, value};
use serde_yaml::{Mapping, Value};

/// A document may be this long.
const MAX_BYTES: usize = 1 << 20;
/// Brackets may nest this deep.
const MAX_BRACKETS: usize = 32;
/// A line may be indented by this many columns.
const MAX_INDENT: usize = 128;
/// A document may have this many anchors, aliases and tags each: a handful cannot blow up.
const MAX_REFERENCES: usize = 8;

/// Reads a document as what it is, before it is read as what it should be.
///
/// # Errors
///
/// [`Error::Format`] when the text is no YAML, holds a number that is not finite, or is no list of keys and values.
fn parse_raw(name: &str, text: &str) -> Result<Mapping> {
    let raw: Value = serde_yaml::from_str(text).map_err(|error| yaml_complaint(name, &error))?;
    if let Some(key) = not_finite(&raw) {
        return Err(Error::format(name, format!("`{key}` is not a finite number")));
    }
    match raw {
        Value::Mapping(mapping) => Ok(mapping),
        _ => Err(Error::format(name, "it is not a list of keys and values")),
    }
}

/// Reads one document, of which `raw` is the raw form, into a typed value and what of it the type does not know.
///
/// # Errors
///
/// [`Error::Format`] when the text is not of this type. The place is named where the parser knows it.
fn parse<T: DeserializeOwned + Serialize>(name: &str, raw: &Mapping, text: &str) -> Result<(T, Mapping)> {
    let typed: T = serde_yaml::from_str(text).map_err(|error| yaml_complaint(name, &error))?;
    let known = serde_yaml::to_value(&typed).map_err(|error| yaml_complaint(name, &error))?;
    let unknown = known.as_mapping().map(|known| unknown_keys(raw, known)).unwrap_or_default();
    Ok((typed, unknown))
}

/// Reads a file that people write by hand: an unknown key is an error that suggests the nearest known one.
///
/// # Errors
///
/// [`Error::Format`] when the text is no YAML of this kind, larger or deeper than any of ours, for a number that is not finite, and for
/// unknown keys.
pub fn parse_strict<T: DeserializeOwned + Serialize>(name: &str, bytes: &[u8]) -> Result<T> {
    let text = checked_text(name, bytes)?;
    let raw = parse_raw(name, text)?;
    let fields = field_names::<T>();
    // A misspelt key first: that another is missing then follows from it.
    if let Some(key) = raw.keys().map(|key| key.as_str().unwrap_or("?")).find(|key| !fields.contains(key)) {
        let nearest = fields
            .iter()
            .map(|known| (strsim::damerau_levenshtein(known, key), known))
            .min()
            .filter(|(distance, _)| *distance <= key.len().div_ceil(2))
            .map_or(String::new(), |(_, known)| format!("; did you mean `{known}`?"));
        return Err(Error::format(name, format!("unknown key `{key}`{nearest}")));
    }
    let (typed, unknown) = parse::<T>(name, &raw, text)?;
    match unknown.iter().next() {
        None => Ok(typed),
        Some((key, inner)) => {
            let inner = inner.as_mapping().and_then(|inner| inner.keys().next()).and_then(Value::as_str);
            let (key, inner) = (key.as_str().unwrap_or("?"), inner.unwrap_or("?"));
            Err(Error::format(name, format!("`{key}` has an unknown key `{inner}`; remove it")))
        }
    }
}

/// Reads metadata; keys that this version does not know are kept.
///
/// # Errors
///
/// [`Error::Format`] as for [`parse_strict`], unknown keys apart; also when the schema is another one or a number is
/// impossible.
pub fn parse_metadata(name: &str, text: &str) -> Result<Metadata> {
    let text = checked_text(name, text.as_bytes())?;
    let (mut metadata, unknown) = parse::<Metadata>(name, &parse_raw(name, text)?, text)?;
    if metadata.schema != METADATA_SCHEMA {
        return Err(Error::format(
            name,
            format!("its schema is `{}`, but this version reads `{METADATA_SCHEMA}`", metadata.schema),
        ));
    }
    if let Some(sensor) = &metadata.sensor {
        sensor.check().map_err(|problem| Error::format(name, format!("in `sensor`, {problem}")))?;
    }
    if let Some(exposure) = metadata.exposure {
        exposure.checked().map_err(|error| Error::format(name, error.to_string()))?;
    }
    metadata.unknown = unknown;
    Ok(metadata)
}

/// Writes metadata, unknown keys included.
///
/// # Errors
///
/// [`Error::Data`] when it cannot be written as YAML.
pub fn write_metadata(metadata: &Metadata) -> Result<String> {
    let wrong = |error: serde_yaml::Error| Error::Data(format!("the metadata cannot be written: {error}"));
    let mut value = serde_yaml::to_value(metadata).map_err(wrong)?;
    if let Value::Mapping(mapping) = &mut value {
        merge(mapping, &metadata.unknown);
    }
    // What no reader takes must not be written.
    if let Some(key) = not_finite(&value) {
        return Err(Error::Data(format!(
            "the metadata cannot be written: `{key}` is not a finite number; choose less extreme settings"
        )));
    }
    serde_yaml::to_string(&value).map_err(wrong)
}

/// Checks length, encoding and nesting before any parser sees the text.
fn checked_text<'a>(name: &str, bytes: &'a [u8]) -> Result<&'a str> {
    let refuse = |problem: &str| Err(Error::format(name, problem));
    if bytes.len() > MAX_BYTES {
        return refuse("it is longer than 1 MiB; no metadata, sensor or matrix is");
    }
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return refuse("it is UTF-16 text; save it as UTF-8");
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return refuse("it is not UTF-8 text") };
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
    let mut depth = 0_usize;
    for bracket in text.bytes() {
        match bracket {
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_BRACKETS {
            return refuse("its brackets nest too deep");
        }
    }
    let indent = |line: &str| line.len() - line.trim_start_matches([' ', '-', '?', ':', '\t']).len();
    if text.lines().any(|line| indent(line) > MAX_INDENT) {
        return refuse("its lines nest too deep");
    }
    for mark in ['&', '*', '!'] {
        let mut before = '\n';
        let mut count = 0;
        for character in text.chars() {
            let starts = before.is_whitespace() || "[{,:-?".contains(before);
            count += usize::from(character == mark && starts);
            before = character;
        }
        if count > MAX_REFERENCES {
            return refuse("it has too many anchors, aliases or tags; write the values out");
        }
    }
    Ok(text)
}

/// The key of a number that is NaN or infinite.
fn not_finite(value: &Value) -> Option<String> {
    let inside = |key: String, value: &Value| match value {
        Value::Number(number) if number.as_f64().is_some_and(|x| !x.is_finite()) => Some(key),
        other => not_finite(other).map(|inner| format!("{key}.{inner}")),
    };
    match value {
        Value::Mapping(mapping) => {
            mapping.iter().find_map(|(key, value)| inside(key.as_str().unwrap_or("?").to_owned(), value))
        }
        Value::Sequence(items) => items.iter().enumerate().find_map(|(index, value)| inside(index.to_string(), value)),
        Value::Tagged(tagged) => not_finite(&tagged.value),
        _ => None,
    }
}

/// What `raw` has and `known` has not, key by key.
fn unknown_keys(raw: &Mapping, known: &Mapping) -> Mapping {
    let mut unknown = Mapping::new();
    for (key, value) in raw {
        match (known.get(key), value) {
            // An explicit null stands for an absent value, which is not written again.
            (None, Value::Null) => {}
            (None, _) => {
                unknown.insert(key.clone(), value.clone());
            }
            (Some(Value::Mapping(known)), Value::Mapping(raw)) => {
                let inner = unknown_keys(raw, known);
                if !inner.is_empty() {
                    unknown.insert(key.clone(), Value::Mapping(inner));
                }
            }
            _ => {}
        }
    }
    unknown
}

/// Adds what is unknown back; keys that the type has written win.
fn merge(into: &mut Mapping, unknown: &Mapping) {
    for (key, value) in unknown {
        match (into.get_mut(key), value) {
            (Some(Value::Mapping(into)), Value::Mapping(inner)) => merge(into, inner),
            (Some(_), _) => {}
            (None, _) => {
                into.insert(key.clone(), value.clone());
            }
        }
    }
}

/// The names of a struct's fields, as its derived `Deserialize` asks for them.
fn field_names<T: DeserializeOwned>() -> &'static [&'static str] {
    struct Ask<'a>(&'a mut &'static [&'static str]);
    impl<'de> Deserializer<'de> for Ask<'_> {
        type Error = value::Error;

        fn deserialize_any<V: Visitor<'de>>(self, _: V) -> std::result::Result<V::Value, value::Error> {
            Err(serde::de::Error::custom("only structs have fields"))
        }

        fn deserialize_struct<V: Visitor<'de>>(
            self,
            _: &'static str,
            fields: &'static [&'static str],
            visitor: V,
        ) -> std::result::Result<V::Value, value::Error> {
            *self.0 = fields;
            self.deserialize_any(visitor)
        }

        serde::forward_to_deserialize_any! {
            bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct
            newtype_struct seq tuple tuple_struct map enum identifier ignored_any
        }
    }
    let mut fields: &'static [&'static str] = &[];
    // The answer is in `fields`; the error that ends the asking says nothing.
    drop(T::deserialize(Ask(&mut fields)));
    fields
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::QuantityKind;
    use serde::Deserialize;

    #[derive(Debug, Serialize, Deserialize)]
    struct Small {
        gain: f64,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        read_noise_e: Option<f64>,
    }

    #[test]
    fn a_misspelt_key_is_answered_with_the_right_one() {
        let complaint = |text: &str| parse_strict::<Small>("s.yaml", text.as_bytes()).unwrap_err().to_string();
        assert_eq!(
            complaint("gain: 1\nread_niose_e: 3\n"),
            "s.yaml: unknown key `read_niose_e`; did you mean `read_noise_e`?"
        );
        assert!(complaint("gain: .nan\n").contains("`gain` is not a finite number"));
        assert!(complaint("gain: one\n").contains("line 1"), "{}", complaint("gain: one\n"));
        assert!(complaint("gain: 1\n---\ngain: 2\n").contains("more than one document"));
    }

    #[test]
    fn unknown_metadata_is_passed_on_at_every_depth() {
        let text = "schema: cyanometer/1\nquantity: adu\nobserver: [me]\nexposure: {exposure_s: 1.0, f_number: 8.0, \
                    lens_transmittance: 1.0, iso: 100}\n";
        let metadata = parse_metadata("x", text).unwrap();
        assert_eq!(metadata.quantity, QuantityKind::Adu);
        let again = write_metadata(&metadata).unwrap();
        assert!(again.contains("observer:") && again.contains("iso: 100"), "{again}");
        assert_eq!(parse_metadata("x", &again).unwrap(), Metadata { unit: String::new(), ..metadata });
    }

    #[test]
    fn what_cannot_be_read_again_is_not_written() {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.black_level_adu = Some(f64::INFINITY);
        let complaint = write_metadata(&metadata).unwrap_err().to_string();
        assert!(complaint.contains("`black_level_adu` is not a finite number"), "{complaint}");
    }

    #[test]
    fn bombs_are_refused_before_they_are_parsed() {
        let nest = "[".repeat(100_000);
        let deep: String = (0..200).map(|i| format!("{}a:\n", " ".repeat(i))).collect();
        let aliases = format!("a: &a [1]\nb: [{}]\n", "*a,".repeat(50));
        for text in [nest, deep, aliases, "- ".repeat(100_000)] {
            assert!(parse_strict::<Small>("bomb", text.as_bytes()).is_err());
        }
    }
}
