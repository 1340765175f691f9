//! The description of a sensor: what a sensor file holds and what metadata carries.

use crate::camera::readout::ReadOut;
use crate::cfa::CfaPattern;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A table of a function of wavelength in a file beside the sensor file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CurveFile {
    /// Name of the file, without a directory.
    pub file: String,
    /// The column that counts; quantum efficiencies have a column for each class, R, G and B.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// SHA-256 of the file, filled in when it is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
}

/// Where the spectral response of a sensor is tabled: what a monochromator measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResponseFiles {
    /// Electrons per photon of the classes.
    pub quantum_efficiency: CurveFile,
    /// Transmittance of what covers the sensor, reflections included.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cover_glass: Option<CurveFile>,
}

/// A sensor in numbers: its read-out and its spectral response, either of which may be unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// `cyanometer-sensor/2`.
    pub schema: String,
    /// Short name.
    pub name: String,
    /// What it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Where the numbers come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Geometry, wells, noise, converter; unknown to a database of spectral responses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout: Option<ReadOut>,
    /// Spectral response; unknown to photon transfer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub response: Option<ResponseFiles>,
    /// Matrix from black-free ADU per s sr to absolute XYZ, where one is known: primaries for viewers. It hangs on read-out
    /// and response together, and is known of many a camera of which neither is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub xyz_from_camera: Option<[[f64; 3]; 3]>,
}

/// The schema that sensor files name.
pub const SENSOR_SCHEMA: &str = "cyanometer-sensor/2";

impl Sensor {
    /// Checks that it says something, and that every number is possible.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn check(&self) -> std::result::Result<(), String> {
        if self.schema != SENSOR_SCHEMA {
            return Err(format!("schema is `{}`, not `{SENSOR_SCHEMA}` or `{FLAT_SENSOR_SCHEMA}`", self.schema));
        }
        match &self.readout {
            Some(readout) => readout.check(),
            None if self.response.is_none() && self.xyz_from_camera.is_none() => {
                Err("it must have one of `readout`, `response` and `xyz_from_camera`".into())
            }
            None => Ok(()),
        }
    }

    /// What is possible, but may not be meant: a warning each.
    pub fn doubts(&self) -> Vec<String> {
        let doubts = self.readout.as_ref().map(ReadOut::doubts).unwrap_or_default();
        doubts.into_iter().map(|doubt| format!("{}: {doubt}", self.called())).collect()
    }

    /// The read-out.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where it is unknown.
    pub fn readout(&self) -> Result<&ReadOut> {
        self.readout.as_ref().ok_or_else(|| self.missing("sensor.readout"))
    }

    /// Distance of neighboring photosites in µm.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where it is unknown.
    pub fn pixel_pitch_um(&self) -> Result<f64> {
        self.readout()?.pixel_pitch_um.ok_or_else(|| self.missing("sensor.readout.pixel_pitch_um"))
    }

    /// Area of a photosite in cm².
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where the pitch is unknown.
    pub fn pixel_area_cm2(&self) -> Result<f64> {
        self.readout()?.pixel_area_cm2().ok_or_else(|| self.missing("sensor.readout.pixel_pitch_um"))
    }

    /// The Bayer pattern of its filter array.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where the read-out is unknown; [`Error::Format`] naming another array than Bayer's.
    pub fn bayer(&self) -> Result<CfaPattern> {
        let cfa = self.readout()?.cfa;
        cfa.bayer().ok_or_else(|| self.refuse(format!("it has {}; only Bayer arrays are followed", cfa.in_words())))
    }

    /// An [`Error::MissingKey`] about this sensor.
    pub fn missing(&self, key: &'static str) -> Error {
        Error::MissingKey { file: self.called(), key }
    }

    /// An [`Error::Format`] about this sensor.
    pub fn refuse(&self, problem: impl Into<String>) -> Error {
        Error::format(&self.called(), problem)
    }

    fn called(&self) -> String {
        format!("sensor {}", self.name)
    }
}

/// The schema of sensor files that have all keys side by side.
pub const FLAT_SENSOR_SCHEMA: &str = "cyanometer-sensor/1";

/// A sensor as [`FLAT_SENSOR_SCHEMA`] has it, read-out and response side by side, all of them known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlatSensor {
    schema: String,
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    description: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    source: Option<String>,
    width: u32,
    height: u32,
    pixel_pitch_um: f64,
    cfa: CfaPattern,
    quantum_efficiency: CurveFile,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cover_glass: Option<CurveFile>,
    full_well_e: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dark_current_na_per_cm2: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dark_current_e_per_s: Option<f64>,
    temperature_k: f64,
    dcnu: f64,
    prnu: f64,
    read_noise_e: f64,
    bits: u32,
    bias_adu: f64,
    adu_per_e: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    xyz_from_camera: Option<[[f64; 3]; 3]>,
}

impl From<FlatSensor> for Sensor {
    fn from(flat: FlatSensor) -> Self {
        Self {
            schema: SENSOR_SCHEMA.into(),
            name: flat.name,
            description: flat.description,
            source: flat.source,
            readout: Some(ReadOut {
                width: flat.width,
                height: flat.height,
                pixel_pitch_um: Some(flat.pixel_pitch_um),
                cfa: flat.cfa.into(),
                full_well_e: flat.full_well_e,
                dark_current_na_per_cm2: flat.dark_current_na_per_cm2,
                dark_current_e_per_s: flat.dark_current_e_per_s,
                temperature_k: flat.temperature_k,
                dcnu: flat.dcnu,
                prnu: flat.prnu,
                read_noise_e: flat.read_noise_e,
                row_noise_e: 0.0,
                column_noise_e: 0.0,
                dsnu_e: 0.0,
                dsnu_row_e: 0.0,
                dsnu_column_e: 0.0,
                prnu_row: 0.0,
                prnu_column: 0.0,
                bits: flat.bits,
                bias_adu: flat.bias_adu,
                adu_per_e: flat.adu_per_e,
                linearization: None,
            }),
            response: Some(ResponseFiles {
                quantum_efficiency: flat.quantum_efficiency,
                cover_glass: flat.cover_glass,
            }),
            xyz_from_camera: flat.xyz_from_camera,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::camera::readout::tests::kaf5101ce as readout;

    /// The default sensor without its curves.
    pub(crate) fn kaf5101ce() -> Sensor {
        Sensor {
            schema: SENSOR_SCHEMA.into(),
            name: "kaf-5101ce".into(),
            description: None,
            source: None,
            readout: Some(readout()),
            response: Some(ResponseFiles {
                quantum_efficiency: CurveFile { file: "qe.csv".into(), column: None, sha256: None },
                cover_glass: None,
            }),
            xyz_from_camera: None,
        }
    }

    #[test]
    fn a_sensor_says_something() {
        assert_eq!(kaf5101ce().check(), Ok(()));
        assert_eq!(Sensor { readout: None, ..kaf5101ce() }.check(), Ok(()));
        assert_eq!(Sensor { response: None, ..kaf5101ce() }.check(), Ok(()));
        let silent = Sensor { readout: None, response: None, ..kaf5101ce() };
        assert!(silent.check().unwrap_err().contains("one of `readout`"));
        assert_eq!(Sensor { xyz_from_camera: Some([[1.0; 3]; 3]), ..silent }.check(), Ok(()));
        assert!(Sensor { schema: "sensor".into(), ..kaf5101ce() }.check().is_err());
        let impossible = Sensor { readout: Some(ReadOut { bits: 0, ..readout() }), ..kaf5101ce() };
        assert!(impossible.check().unwrap_err().contains("bits"));
    }

    #[test]
    fn what_is_missing_is_named() {
        let key = |error: Error| match error {
            Error::MissingKey { key, .. } => key,
            other => panic!("{other}"),
        };
        let responding = Sensor { readout: None, ..kaf5101ce() };
        assert_eq!(key(responding.readout().unwrap_err()), "sensor.readout");
        assert_eq!(key(responding.pixel_pitch_um().unwrap_err()), "sensor.readout");
        let without = ReadOut { pixel_pitch_um: None, ..readout() };
        let without = Sensor { readout: Some(without), ..kaf5101ce() };
        assert_eq!(key(without.pixel_pitch_um().unwrap_err()), "sensor.readout.pixel_pitch_um");
        assert_eq!(key(without.pixel_area_cm2().unwrap_err()), "sensor.readout.pixel_pitch_um");
        let quad = ReadOut { cfa: "4x4:RRGGRRGGGGBBGGBB".parse().unwrap(), ..readout() };
        let complaint = Sensor { readout: Some(quad), ..kaf5101ce() }.bayer().unwrap_err().to_string();
        assert!(complaint.contains("sensor kaf-5101ce: it has a quad Bayer filter array"), "{complaint}");
    }
}
