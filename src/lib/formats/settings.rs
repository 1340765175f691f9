//! Read-out settings of a sensor file: what of its read-out changes with gain, ISO or conversion gain.
//!
//! `readout` holds the numbers of one setting, or what all have in common; each entry of `readout.settings` has a name and what
//! differs. Chosen are whole read-outs: nothing is interpolated between settings, since no law tells how noise goes with gain.

use serde_yaml::{Mapping, Value};

/// The key that holds the entries.
pub(super) const SETTINGS: &str = "settings";
/// The key of the name in an entry.
const NAME: &str = "name";
/// Where single numbers of all entries come from, before the key.
pub(super) const IN_PROVENANCE: &str = "readout.settings.";
/// What no setting changes.
const COMMON: [&str; 6] = ["width", "height", "pixel_pitch_um", "cfa", "setting", SETTINGS];
/// The two forms of a dark current, of which a setting may have the other.
const DARK_CURRENTS: [&str; 2] = ["dark_current_na_per_cm2", "dark_current_e_per_s"];

/// The entries of a sensor file, with the file without them.
#[derive(Debug)]
pub(super) struct Settings {
    base: Mapping,
    entries: Vec<(String, Mapping)>,
}

/// A name as names are compared: in any case, with any blanks between its words.
fn plain(name: &str) -> String {
    name.split_whitespace().map(str::to_lowercase).collect::<Vec<_>>().join(" ")
}

/// A name, or a number that is one.
fn name_of(value: &Value) -> Option<String> {
    match value {
        Value::String(name) => Some(name.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    }
    .filter(|name| !plain(name).is_empty())
}

impl Settings {
    /// Those of a file; none where it has none.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn of(raw: &Mapping) -> Result<Option<Self>, String> {
        let readout = raw.get("readout").and_then(Value::as_mapping);
        let Some(listed) = readout.and_then(|readout| readout.get(SETTINGS)).filter(|listed| !listed.is_null()) else {
            return Ok(None);
        };
        let Some(listed) = listed.as_sequence().filter(|listed| !listed.is_empty()) else {
            return Err("`readout.settings` is not a list of settings, each `- {name: NAME, ...}`".into());
        };
        let mut entries: Vec<(String, Mapping)> = Vec::new();
        for (number, entry) in listed.iter().enumerate() {
            let number = number + 1;
            let Some(mut keys) = entry.as_mapping().cloned() else {
                return Err(format!("entry {number} of `readout.settings` is not a list of keys and values"));
            };
            let Some(name) = keys.remove(NAME).as_ref().and_then(name_of) else {
                return Err(format!("entry {number} of `readout.settings` has no `name`"));
            };
            let spelled = |key: &Value| key.as_str().unwrap_or("?").to_owned();
            if let Some(key) = keys.keys().map(spelled).find(|key| COMMON.contains(&key.as_str())) {
                return Err(format!(
                    "in the setting `{name}`, `{key}` is what no setting changes; it belongs to `readout`"
                ));
            }
            if keys.is_empty() {
                return Err(format!("the setting `{name}` has no numbers"));
            }
            if entries.iter().any(|(known, _)| plain(known) == plain(&name)) {
                return Err(format!("two of `readout.settings` are named `{name}`"));
            }
            entries.push((name, keys));
        }
        let mut base = raw.clone();
        if let Some(readout) = base.get_mut("readout").and_then(Value::as_mapping_mut) {
            readout.remove(SETTINGS);
        }
        let found = Self { base, entries };
        match found.own().and_then(|own| found.entries.iter().find(|(name, _)| plain(name) == plain(&own))) {
            Some((name, _)) => Err(format!("two settings are named `{name}`: that of `readout` itself, and another")),
            None => Ok(Some(found)),
        }
    }

    /// The name of the setting that `readout` itself is of, where it has one.
    fn own(&self) -> Option<String> {
        self.base.get("readout")?.as_mapping()?.get("setting").and_then(name_of)
    }

    /// All names, that of `readout` itself first.
    pub fn names(&self) -> Vec<String> {
        self.own().into_iter().chain(self.entries.iter().map(|(name, _)| name.clone())).collect()
    }

    /// The file of `readout` itself, without settings.
    pub fn base(&self) -> Mapping {
        let mut made = self.base.clone();
        tell(&mut made, &[]);
        made
    }

    /// A key that all entries have and `readout` itself has not, so that it cannot do without one.
    pub fn left_open(&self) -> Option<String> {
        let readout = self.base.get("readout")?.as_mapping()?;
        let (_, first) = self.entries.first()?;
        let is_open =
            |key: &&Value| !readout.contains_key(*key) && self.entries.iter().all(|(_, keys)| keys.contains_key(*key));
        first.keys().find(is_open).and_then(Value::as_str).map(str::to_owned)
    }

    /// The file in each of the entries.
    pub fn each(&self) -> impl Iterator<Item = (&str, Mapping)> {
        self.entries.iter().map(|(name, keys)| (name.as_str(), self.with(name, keys)))
    }

    /// The place of the setting of a name among the entries; none for that of `readout` itself.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn find(&self, name: &str) -> Result<Option<usize>, String> {
        if self.own().is_some_and(|own| plain(&own) == plain(name)) {
            return Ok(None);
        }
        let place = self.entries.iter().position(|(known, _)| plain(known) == plain(name));
        place.map(Some).ok_or_else(|| {
            format!(
                "it has no setting `{name}`; there are `{}`, and nothing is told between them",
                self.names().join("`, `")
            )
        })
    }

    fn with(&self, name: &str, keys: &Mapping) -> Mapping {
        let mut made = self.base.clone();
        let changed: Vec<&str> = keys.keys().filter_map(Value::as_str).collect();
        if let Some(readout) = made.get_mut("readout").and_then(Value::as_mapping_mut) {
            if changed.iter().any(|key| DARK_CURRENTS.contains(key)) {
                DARK_CURRENTS.iter().for_each(|key| drop(readout.remove(*key)));
            }
            for (key, value) in keys {
                match value {
                    // Written out, it is what the setting has not.
                    Value::Null => drop(readout.remove(key)),
                    _ => drop(readout.insert(key.clone(), value.clone())),
                }
            }
            readout.insert("setting".into(), name.into());
        }
        tell(&mut made, &changed);
        made
    }
}

/// Leaves in the provenance what is told of the numbers of a setting, which has changed some of those of the file.
fn tell(sensor: &mut Mapping, changed: &[&str]) {
    let Some(told) = sensor.get_mut("provenance").and_then(Value::as_mapping_mut) else { return };
    let all: Vec<(String, Value)> =
        told.iter().filter_map(|(path, origin)| Some((path.as_str()?.to_owned(), origin.clone()))).collect();
    told.clear();
    let is_changed = |path: &str| changed.contains(&path.split('.').next().unwrap_or_default());
    for (path, origin) in all {
        match (path.strip_prefix(IN_PROVENANCE), path.strip_prefix("readout.")) {
            (Some(key), _) if is_changed(key) => drop(told.insert(format!("readout.{key}").into(), origin)),
            (Some(_), _) => {}
            (None, Some(key)) if is_changed(key) => {}
            _ => drop(told.insert(path.into(), origin)),
        }
    }
}
