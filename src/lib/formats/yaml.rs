//! YAML, read with limits: metadata, sensors and matrices all come through here.

use super::foreign::{yaml_complaint, yaml_problem};
use super::keys::{KINDS, KeyPage};
use super::other_keys;
use super::settings::{self, Settings};
use super::{yaml_guard, yaml_writer};
use crate::analysis::characterization::CameraMatrix;
use crate::camera::readout::ReadOut;
use crate::camera::sensor::{
    CurveFile, FLAT_SENSOR_SCHEMA, FlatSensor, Provenance, ResponseFiles, SENSOR_SCHEMA, Sensor,
};
use crate::error::{Error, Result};
use crate::metadata::{METADATA_SCHEMA, Metadata};
use crate::names::{Named, nearest};
use serde::Serialize;
use serde::de::{DeserializeOwned, Deserializer, Visitor, value};
use serde_yaml::{Mapping, Value};

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
        _ => Err(Error::format(
            name,
            "it is not a list of keys and values, as sensors, matrices and metadata in YAML are",
        )),
    }
}

/// Reads one document, of which `raw` is the raw form, into a typed value and what of it the type does not know.
///
/// # Errors
///
/// [`Error::Format`] when the text is not of this type. The place is named where the parser knows it.
fn parse<T: DeserializeOwned + Serialize>(name: &str, raw: &Mapping, text: &str) -> Result<(T, Mapping)> {
    // The raw form is quicker to read; only the text tells the place of what is wrong.
    let typed = serde_yaml::from_value(Value::Mapping(raw.clone())).or_else(|_| serde_yaml::from_str(text));
    let typed: T = typed.map_err(|error| yaml_complaint(name, &error))?;
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
    parse_parts(name, bytes, &[])
}

/// Reads a sensor file, with its parts or flat, in the setting of its own; unknown keys are errors as for [`parse_strict`], in the
/// parts too.
///
/// # Errors
///
/// As [`parse_strict`]; [`Error::Format`] where it has several settings and none of its own.
pub fn parse_sensor(name: &str, bytes: &[u8]) -> Result<Sensor> {
    parse_sensor_at(name, bytes, None).map(|(sensor, _)| sensor)
}

/// The same in a setting that it has, with what came up.
///
/// # Errors
///
/// As [`parse_sensor`]; [`Error::Format`] where it has no such setting.
pub fn parse_sensor_at(name: &str, bytes: &[u8], setting: Option<&str>) -> Result<(Sensor, Vec<String>)> {
    let raw = parse_raw(name, checked_text(name, bytes)?)?;
    check_schema(name, &raw, KeyPage::Sensor)?;
    let settings =
        if is_flat(&raw) { None } else { Settings::of(&raw).map_err(|problem| Error::format(name, problem))? };
    if let Some(settings) = settings {
        check_sensor(name, &raw)?;
        return at_setting(name, &settings, setting);
    }
    let sensor = parse_plain_sensor(name, bytes, &raw)?;
    if let Some(setting) = setting {
        check_only_setting(name, &sensor, setting)?;
    }
    Ok((sensor, Vec::new()))
}

/// The names of the settings that a sensor file has.
pub fn settings_of(bytes: &[u8]) -> Vec<String> {
    let raw = checked_text("", bytes).and_then(|text| parse_raw("", text));
    raw.ok().and_then(|raw| Settings::of(&raw).ok().flatten()).map_or_else(Vec::new, |settings| settings.names())
}

/// Makes sure that a setting is the one of a sensor that has no others.
///
/// # Errors
///
/// [`Error::Format`].
pub fn check_only_setting(name: &str, sensor: &Sensor, setting: &str) -> Result<()> {
    let own = sensor.readout.as_ref().and_then(|readout| readout.setting.as_deref());
    match own {
        Some(own) if own.eq_ignore_ascii_case(setting.trim()) => Ok(()),
        Some(own) => {
            Err(Error::format(name, format!("it has the setting `{own}` alone, not `{setting}`")).change(&["setting"]))
        }
        None => Err(Error::format(name, "it has no settings").leave_out(&["setting"])),
    }
}

/// A sensor in one of the settings of its file, all of which are looked at.
fn at_setting(name: &str, settings: &Settings, wanted: Option<&str>) -> Result<(Sensor, Vec<String>)> {
    let read = |called: &str, raw: &Mapping| {
        let sensor: Sensor = parse_made(called, raw, &sensor_parts())?;
        sensor.check().map_err(|problem| Error::format(called, problem))?;
        Ok(sensor)
    };
    let of_setting = |(setting, raw): (&str, Mapping)| read(&format!("{name}, in the setting `{setting}`"), &raw);
    // What is missing in all is told of the file itself.
    let own = read(name, &settings.base());
    if own.is_err() && settings.left_open().is_none() {
        return own.map(|sensor| (sensor, Vec::new()));
    }
    let all = settings.each().map(of_setting).collect::<Result<Vec<Sensor>>>()?;
    let names = settings.names().join("`, `");
    let place = match wanted {
        Some(wanted) => settings.find(wanted).map_err(|problem| Error::format(name, problem).change(&["setting"]))?,
        None => None,
    };
    let Some(chosen) = place.and_then(|place| all.into_iter().nth(place)) else {
        return match (own, settings.left_open(), wanted) {
            (Ok(own), _, Some(_)) => Ok((own, Vec::new())),
            (Ok(own), _, None) => Ok((
                own,
                vec![format!("its `readout` counts as it stands; it has the settings `{names}` too (--setting)")],
            )),
            (Err(_), Some(key), None) => {
                let problem = format!("its `readout` has no `{key}` but in its settings: `{names}`");
                Err(Error::format(name, problem).give(&["setting"]))
            }
            (Err(error), ..) => Err(error),
        };
    };
    let gain = settings.base().get("readout").and_then(|readout| readout.get("adu_per_e")).and_then(Value::as_f64);
    Ok(with_own_matrix(chosen, gain))
}

/// A sensor whose matrix is that of its file, where the gain was `gain`: XYZ of an ADU go with its inverse.
fn with_own_matrix(mut sensor: Sensor, gain: Option<f64>) -> (Sensor, Vec<String>) {
    let chosen = sensor.readout.as_ref().map(|readout| readout.adu_per_e);
    let told = match (&mut sensor.xyz_from_camera, gain, chosen) {
        (None, ..) => None,
        (Some(matrix), Some(gain), Some(chosen)) if gain > 0.0 => {
            if gain != chosen {
                matrix.as_flattened_mut().iter_mut().for_each(|element| *element *= gain / chosen);
            }
            None
        }
        (matrix, ..) => {
            *matrix = None;
            Some("its `xyz_from_camera` is of a gain that its file does not tell, and is left out".to_owned())
        }
    };
    (sensor, told.into_iter().collect())
}

/// Refuses another schema than ours, and a provenance of what there is not.
fn check_sensor(name: &str, raw: &Mapping) -> Result<()> {
    let schema = raw.get("schema").and_then(Value::as_str);
    if let Some(other) = schema.filter(|schema| *schema != SENSOR_SCHEMA) {
        let problem = format!("schema is `{other}`, not `{SENSOR_SCHEMA}` or `{FLAT_SENSOR_SCHEMA}`");
        return Err(Error::format(name, problem));
    }
    check_provenance(name, raw)
}

fn parse_plain_sensor(name: &str, bytes: &[u8], raw: &Mapping) -> Result<Sensor> {
    if !is_flat(raw) {
        check_sensor(name, raw)?;
        return parse_parts(name, bytes, &sensor_parts());
    }
    if let Some((part, _)) = sensor_parts().iter().find(|(part, _)| raw.contains_key(*part)) {
        return Err(Error::format(name, format!("`{part}` belongs to the schema `{SENSOR_SCHEMA}`; name that one")));
    }
    let [flat, parts] = [field_names::<FlatSensor>(), field_names::<ReadOut>()];
    let newer = raw.keys().filter_map(Value::as_str).find(|key| parts.contains(key) && !flat.contains(key));
    if let Some(key) = newer {
        let problem =
            format!("unknown key `{key}`; it is one of the schema `{SENSOR_SCHEMA}`, where it stands in `readout`");
        return Err(Error::format(name, problem));
    }
    parse_strict::<FlatSensor>(name, bytes).map(Sensor::from)
}

/// Refuses a provenance of what no sensor file has, and keys of it that nobody knows.
fn check_provenance(name: &str, raw: &Mapping) -> Result<()> {
    let Some(told) = raw.get("provenance").and_then(Value::as_mapping) else { return Ok(()) };
    let of_sensors = || KeyPage::Sensor.keys().map(|[path, ..]| path).filter(|path| !path.starts_with("provenance"));
    let known = field_names::<Provenance>();
    for (key, origin) in told {
        let key = key.as_str().unwrap_or("?");
        let of_setting = key.strip_prefix(settings::IN_PROVENANCE).map(|key| format!("readout.{key}"));
        if !of_sensors().any(|path| path == of_setting.as_deref().unwrap_or(key)) {
            let near = nearest(key, of_sensors(), |path| path.len() / 2);
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            let problem = format!("`provenance` tells of `{key}`, which no sensor file has{near}");
            return Err(Error::format(name, problem));
        }
        let mut told = origin.as_mapping().into_iter().flat_map(Mapping::keys).filter_map(Value::as_str);
        if let Some(other) = told.find(|other| !known.contains(other)) {
            let problem = format!("unknown key `provenance.{key}.{other}`; there are `{}`", known.join("` and `"));
            return Err(Error::format(name, problem));
        }
    }
    Ok(())
}

/// Reads a matrix file; unknown keys are errors as for [`parse_strict`].
///
/// # Errors
///
/// As [`parse_strict`], and for files of another kind.
pub fn parse_matrix(name: &str, bytes: &[u8]) -> Result<CameraMatrix> {
    check_schema(name, &parse_raw(name, checked_text(name, bytes)?)?, KeyPage::Matrix)?;
    parse_strict(name, bytes)
}

/// Makes sure that a file says what it is, and that it is nothing else of ours.
fn check_schema(name: &str, raw: &Mapping, wanted: KeyPage) -> Result<()> {
    let [(.., kind, schema)] = KINDS.iter().filter(|(page, ..)| *page == wanted).collect::<Vec<_>>()[..] else {
        return Ok(());
    };
    let kind = kind.split(',').next().unwrap_or_default();
    match raw.get("schema") {
        None | Some(Value::Null) => Err(Error::format(
            name,
            format!(
                "it has no `schema`; {kind} begins with `schema: {schema}`, as `cyanometer template {}` shows",
                wanted.name()
            ),
        )),
        Some(found) => {
            let is_of = |begin: &str| found.as_str().is_some_and(|found| found.starts_with(begin));
            let other = KINDS.iter().find(|(page, begin, ..)| *page != wanted && is_of(begin));
            other.map_or(Ok(()), |(_, _, other, _)| {
                Err(Error::format(name, format!("it is {other}; {kind} is wanted here")))
            })
        }
    }
}

/// The parts of a sensor and their keys.
fn sensor_parts() -> [(&'static str, Keys); 2] {
    [("readout", field_names::<ReadOut>()), ("response", field_names::<ResponseFiles>())]
}

/// Names of keys.
pub(super) type Keys = &'static [&'static str];

/// Whether a sensor has all its keys side by side.
fn is_flat(sensor: &Mapping) -> bool {
    sensor.get("schema").and_then(Value::as_str) == Some(FLAT_SENSOR_SCHEMA)
}

/// A flat sensor in its parts, with what nobody knows of.
fn regrouped(flat: &Mapping) -> std::result::Result<Mapping, serde_yaml::Error> {
    let typed: FlatSensor = serde_yaml::from_value(Value::Mapping(flat.clone()))?;
    let known = serde_yaml::to_value(&typed)?;
    let unknown = known.as_mapping().map(|known| unknown_keys(flat, known)).unwrap_or_default();
    match serde_yaml::to_value(Sensor::from(typed))? {
        Value::Mapping(mut made) => {
            merge(&mut made, &unknown);
            Ok(made)
        }
        _ => Ok(Mapping::new()),
    }
}

/// Refuses the first key that is neither among `fields` nor, within a part, among the part's, and suggests the nearest.
fn check_keys(name: &str, raw: &Mapping, fields: Keys, parts: &[(&str, Keys)]) -> Result<()> {
    let of_part = |(part, fields): &(&str, Keys)| fields.iter().map(|key| format!("{part}.{key}")).collect::<Vec<_>>();
    let known: Vec<String> = fields.iter().map(|key| (*key).to_owned()).chain(parts.iter().flat_map(of_part)).collect();
    let spelled = |key: &Value| key.as_str().unwrap_or("?").to_owned();
    let inside = parts.iter().filter_map(|(part, _)| Some((part, raw.get(*part)?.as_mapping()?)));
    let inside = inside.flat_map(|(part, keys)| keys.keys().map(move |key| format!("{part}.{}", spelled(key))));
    let Some(key) = raw.keys().map(spelled).chain(inside).find(|key| !known.contains(key)) else { return Ok(()) };
    let last = |path: &'_ str| path.rsplit('.').next().unwrap_or_default().to_owned();
    let typed = last(&key);
    // A key of the same part comes first, where another is as near.
    let part = &key[..key.len() - typed.len()];
    let (same, other): (Vec<&String>, Vec<&String>) =
        known.iter().partition(|known| known.strip_suffix(&last(known)) == Some(part));
    let ordered: Vec<&String> = same.into_iter().chain(other).collect();
    let names: Vec<String> = ordered.iter().map(|known| last(known)).collect();
    if let Some(here) = other_keys::here(&typed, &names) {
        return Err(Error::format(name, format!("unknown key `{key}`; {here}")));
    }
    let found = nearest(&typed, names.iter().map(String::as_str), |_| typed.len().div_ceil(2));
    let place = found.and_then(|found| names.iter().position(|name| name == found));
    let nearest = place.map_or(String::new(), |place| format!("; did you mean `{}`?", ordered[place]));
    Err(Error::format(name, format!("unknown key `{key}`{nearest}")))
}

/// [`parse_strict`] of a document with parts, each of which has keys of its own.
fn parse_parts<T: DeserializeOwned + Serialize>(name: &str, bytes: &[u8], parts: &[(&str, Keys)]) -> Result<T> {
    let text = checked_text(name, bytes)?;
    let raw = parse_raw(name, text)?;
    // A misspelled key first: that another is missing then follows from it.
    check_keys(name, &raw, field_names::<T>(), parts)?;
    let (typed, unknown) = parse::<T>(name, &raw, text)?;
    check_unknown(name, &unknown, parts)?;
    Ok(typed)
}

/// The same of a document that was made of another, whose places it does not know.
fn parse_made<T: DeserializeOwned + Serialize>(name: &str, raw: &Mapping, parts: &[(&str, Keys)]) -> Result<T> {
    check_keys(name, raw, field_names::<T>(), parts)?;
    let typed: T = serde_yaml::from_value(Value::Mapping(raw.clone())).map_err(|error| yaml_complaint(name, &error))?;
    let known = serde_yaml::to_value(&typed).map_err(|error| yaml_complaint(name, &error))?;
    let unknown = known.as_mapping().map(|known| unknown_keys(raw, known)).unwrap_or_default();
    check_unknown(name, &unknown, parts)?;
    Ok(typed)
}

/// Refuses keys that are not written back, unless they are known.
fn check_unknown(name: &str, unknown: &Mapping, parts: &[(&str, Keys)]) -> Result<()> {
    // A key that is not written back may be one of those that are left out where they are 0.
    let of_curve = field_names::<CurveFile>();
    let is_known = |key: &str, inner: &str| parts.iter().any(|(part, fields)| *part == key && fields.contains(&inner));
    for (key, inner) in unknown {
        let key = key.as_str().unwrap_or("?");
        for (inner, value) in inner.as_mapping().into_iter().flatten() {
            let inner = inner.as_str().unwrap_or("?");
            match value.as_mapping() {
                Some(nested) if is_known(key, inner) => {
                    other_keys::check_within(name, &format!("{key}.{inner}"), nested, of_curve)?
                }
                _ if is_known(key, inner) => {}
                _ => return Err(Error::format(name, format!("`{key}` has an unknown key `{inner}`; remove it"))),
            }
        }
    }
    Ok(())
}

/// Reads metadata; keys that this version does not know are kept. A flat sensor gets its parts.
///
/// # Errors
///
/// [`Error::Format`] as for [`parse_strict`], unknown keys apart; also when the schema is another one or a number is
/// impossible.
pub fn parse_metadata(name: &str, text: &str) -> Result<Metadata> {
    let text = checked_text(name, text.as_bytes())?;
    let mut raw = parse_raw(name, text)?;
    check_schema(name, &raw, KeyPage::Metadata)?;
    let mut text = std::borrow::Cow::from(text);
    if let Some(sensor) = raw.get("sensor").and_then(Value::as_mapping).filter(|sensor| is_flat(sensor)) {
        let wrong = |error| Error::format(name, format!("in `sensor`, {}", yaml_problem(&error)));
        let sensor = regrouped(sensor).map_err(wrong)?;
        raw.insert("sensor".into(), sensor.into());
        text = serde_yaml::to_string(&raw).map_err(wrong)?.into();
    }
    let (mut metadata, unknown) = parse::<Metadata>(name, &raw, &text)?;
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
    if let Some(time_s) = metadata.exposure_time_s.filter(|time_s| !(0.0..f64::INFINITY).contains(time_s)) {
        return Err(Error::format(name, format!("its `exposure_time_s` is {time_s}, which is no time")));
    }
    metadata.check_ranges().map_err(|problem| Error::format(name, format!("its {problem}")))?;
    metadata.complete_levels().map_err(|problem| Error::format(name, problem))?;
    metadata.unknown = unknown;
    Ok(metadata)
}

/// Writes metadata, unknown keys included.
///
/// # Errors
///
/// [`Error::Data`] when it cannot be written as YAML that is read again.
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
    yaml_writer::write_value("the metadata", &value)
}

/// The text of a document that a parser may see.
fn checked_text<'a>(name: &str, bytes: &'a [u8]) -> Result<&'a str> {
    yaml_guard::checked_text(bytes).map_err(|problem| Error::format(name, problem))
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
pub(super) fn field_names<T: DeserializeOwned>() -> Keys {
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
    fn the_template_of_metadata_holds_as_it_is_and_with_all_its_examples() {
        use crate::metadata::METADATA_TEMPLATE;
        let metadata = parse_metadata("template", METADATA_TEMPLATE).unwrap();
        assert_eq!(metadata, Metadata { unit: String::new(), ..Metadata::new(QuantityKind::Adu) });
        // Examples are what has a key behind `# `, and what is indented below one.
        let is_example = |line: &str| {
            let key = line.trim_start().split(':').next().unwrap_or_default();
            line.starts_with("  ")
                || line.contains(": ") && key.chars().all(|c| c.is_ascii_lowercase() || c == '_')
                || line == "sensor:"
                || line == "relative_matrix:"
        };
        let used = METADATA_TEMPLATE.lines().map(|line| match line.strip_prefix("# ") {
            Some(example) if is_example(example) => format!("{example}\n"),
            _ => format!("{line}\n"),
        });
        let all = parse_metadata("template", &used.collect::<String>()).unwrap();
        assert!(all.unknown.is_empty(), "{:?}", all.unknown);
        let sensor = all.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref()).unwrap();
        assert_eq!(sensor.check(), Ok(()));
        let given = serde_yaml::to_value(&all).unwrap().as_mapping().unwrap().len();
        assert_eq!(given, 22, "a key of the template is not read");
    }

    #[test]
    fn a_misspelled_key_is_answered_with_the_right_one() {
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
    fn a_provenance_is_of_keys_that_there_are_and_goes_on() {
        let text = |told: &str| {
            format!(
                "schema: cyanometer-sensor/2\nname: s\nxyz_from_camera: [[1,0,0],[0,1,0],[0,0,1]]\nprovenance:\n  {told}\n"
            )
        };
        let complaint = |told: &str| parse_sensor("s.yaml", text(told).as_bytes()).unwrap_err().to_string();
        let told = "readout.prnu: {kind: measured, note: by me}";
        let sensor = parse_sensor("s.yaml", text(told).as_bytes()).unwrap();
        assert_eq!(sensor.provenance["readout.prnu"].note.as_deref(), Some("by me"));
        let metadata = Metadata { sensor: Some(sensor), ..Metadata::new(QuantityKind::Adu) };
        let again = parse_metadata("m", &write_metadata(&metadata).unwrap()).unwrap();
        assert_eq!(again.sensor, metadata.sensor);
        let misspelled = complaint("readout.pnru: {kind: measured}");
        assert!(misspelled.ends_with("which no sensor file has; did you mean `readout.prnu`?"), "{misspelled}");
        let other = complaint("readout.prnu: {kind: measured, nota: x}");
        assert!(other.ends_with("unknown key `provenance.readout.prnu.nota`; there are `kind` and `note`"), "{other}");
        let guessed = complaint("readout.prnu: {kind: guessed}");
        assert!(guessed.contains("`measured`") && guessed.contains("`assumed`"), "{guessed}");
        assert!(complaint("readout.prnu: {note: x}").contains("kind"));
        assert!(complaint("readout.prnu: measured").contains("readout.prnu"));
    }

    #[test]
    fn what_cannot_be_read_again_is_not_written() {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.black_level_adu = Some(f64::INFINITY.into());
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
