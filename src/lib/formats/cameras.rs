//! Cameras whose spectral response is known by name: those of rawtoaces-data, one table for all.

use super::foreign::csv_complaint;
use crate::camera::sensor::{CurveFile, ResponseFiles, SENSOR_SCHEMA, Sensor};
use crate::error::Result;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The table of all responses, among sensor files.
pub(super) const TABLE: &str = "rawtoaces.csv";
/// What is told of each of its cameras.
pub(super) const INDEX: &str = "rawtoaces_cameras.csv";

/// A camera of the table.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Camera {
    /// Maker and model in lower case, joined by hyphens.
    pub name: String,
    maker: String,
    model: String,
    /// Who wrote its document.
    creator: String,
    laboratory: String,
    equipment: String,
    date: String,
    /// Other names of the same model, between blanks.
    other_names: String,
    /// Names of other models with the same sensor, between blanks.
    same_sensor: String,
}

impl Camera {
    /// The cameras of an index; `name` is the file in messages.
    ///
    /// # Errors
    ///
    /// [`Error::Format`](crate::error::Error::Format) for what is no such index.
    pub(super) fn all(name: &str, index: &[u8]) -> Result<Vec<Self>> {
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(index);
        let text = std::str::from_utf8(index).unwrap_or_default();
        reader.deserialize().map(|row| row.map_err(|error| csv_complaint(name, text, &error))).collect()
    }

    /// Its names, those of other models with the same sensor last.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let others = self.other_names.split_whitespace().chain(self.same_sensor.split_whitespace());
        std::iter::once(self.name.as_str()).chain(others)
    }

    /// Whether a name is that of another model with the same sensor.
    pub(super) fn is_another(&self, name: &str) -> bool {
        self.same_sensor.split_whitespace().any(|other| other == name)
    }

    /// Maker and model, with its other names.
    pub fn about(&self) -> String {
        let others = self.names().skip(1).collect::<Vec<_>>().join(", ");
        let others = if others.is_empty() { others } else { format!("; also {others}") };
        format!("{} {}{others}", self.maker, self.model)
    }

    /// The sensor: a response alone, which its source does not say the meaning of.
    pub fn sensor(&self) -> Sensor {
        let measured = [("at ", &self.laboratory), ("with ", &self.equipment)];
        let measured = measured.into_iter().filter(|(_, what)| !what.is_empty());
        let measured: String = measured.map(|(word, what)| format!(", {word}{what}")).collect();
        let file = CurveFile { file: TABLE.into(), column: Some(self.name.clone()), sha256: None };
        Sensor {
            schema: SENSOR_SCHEMA.into(),
            name: self.name.clone(),
            description: Some(format!("{} {}", self.maker, self.model)),
            source: Some(format!("rawtoaces-data 1.1.0, Apache-2.0: {}{measured}, {}", self.creator, self.date)),
            provenance: BTreeMap::new(),
            readout: None,
            response: Some(ResponseFiles { relative_response: Some(file), ..ResponseFiles::default() }),
            xyz_from_camera: None,
        }
    }
}

/// A name as it is looked for: in lower case, what parts its words as hyphens.
pub(super) fn normalized(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_people_write_them() {
        for typed in ["nikon-d850", "Nikon D850", "NIKON_D850", " nikon  d850 "] {
            assert_eq!(normalized(typed), "nikon-d850");
        }
        assert_eq!(normalized("Fujifilm X-T3"), "fujifilm-x-t3");
    }

    #[test]
    fn a_camera_says_who_measured_it() {
        let index = "name,maker,model,creator,laboratory,equipment,date,other_names,same_sensor\n\
                     a-b,A,B,someone,a place,a device,2017-06-09,a-c a-d,a-e\n";
        let [camera] = &Camera::all("i", index.as_bytes()).unwrap()[..] else { panic!("not one") };
        assert_eq!(camera.names().collect::<Vec<_>>(), ["a-b", "a-c", "a-d", "a-e"]);
        assert_eq!([camera.is_another("a-e"), camera.is_another("a-c")], [true, false]);
        assert_eq!(camera.about(), "A B; also a-c, a-d, a-e");
        let sensor = camera.sensor();
        assert_eq!(sensor.check(), Ok(()));
        let source = "rawtoaces-data 1.1.0, Apache-2.0: someone, at a place, with a device, 2017-06-09";
        assert_eq!(sensor.source.as_deref(), Some(source));
        assert!(Camera::all("i", b"name,maker\na,b\n").is_err());
    }
}
