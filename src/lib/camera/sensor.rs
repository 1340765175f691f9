//! The description of a sensor: what a sensor file holds and what metadata carries.

use crate::camera::readout::ReadOut;
use crate::cfa::CfaPattern;
use crate::error::{Error, Result};
use crate::names::{Named, serde_by_name};
use crate::units::of_per_cent;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A table of a function of wavelength in a file beside the sensor file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CurveFile {
    /// Name of the file, without a directory.
    pub file: String,
    /// The column that counts; responses have a column for each class, R, G and B, or `NAME R` and so on where this is `NAME`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// SHA-256 of the file, filled in when it is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
}

/// What a relative response counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Counts {
    /// Signal per watt: what signals divided by the power of a monochromator's light are.
    #[default]
    Energy,
    /// Signal per photon, as quantum efficiencies are.
    Quanta,
}

impl Named for Counts {
    const ALL: &'static [Self] = &[Self::Energy, Self::Quanta];

    fn name(self) -> &'static str {
        match self {
            Self::Energy => "energy",
            Self::Quanta => "quanta",
        }
    }
}

serde_by_name!(Counts);

/// Where the spectral response of a sensor is tabled: what a monochromator measures.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ResponseFiles {
    /// Electrons per photon of the classes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantum_efficiency: Option<CurveFile>,
    /// Response of the classes on a common scale that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_response: Option<CurveFile>,
    /// What the relative response counts; [`Counts::Energy`] where nobody says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts: Option<Counts>,
    /// Largest quantum efficiency that the relative response stands for, in electrons per photon: its scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_quantum_efficiency: Option<f64>,
    /// Transmittance of what covers the sensor, reflections included.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cover_glass: Option<CurveFile>,
}

impl ResponseFiles {
    /// What of a response differs from another, in words, as far as both tell; names of files and directories do not count.
    pub fn other_than(&self, other: &Self) -> Option<&'static str> {
        let contents = |of: fn(&Self) -> &Option<CurveFile>| {
            let [own, others] = [of(self).as_ref(), of(other).as_ref()];
            match (own, others) {
                (Some(own), Some(others)) => match (&own.sha256, &others.sha256) {
                    (Some(a), Some(b)) => a != b || own.column != others.column,
                    _ => false,
                },
                (own, others) => own.is_some() != others.is_some(),
            }
        };
        let numbers = |of: fn(&Self) -> Option<f64>| of(self).zip(of(other)).is_some_and(|(a, b)| a != b);
        let differs = [
            (
                "spectral response",
                contents(|files| &files.quantum_efficiency) || contents(|files| &files.relative_response),
            ),
            ("cover glass", contents(|files| &files.cover_glass)),
            ("kind of response, per watt or per photon,", self.counts.zip(other.counts).is_some_and(|(a, b)| a != b)),
            ("peak quantum efficiency", numbers(|files| files.peak_quantum_efficiency)),
        ];
        differs.into_iter().find(|(_, differs)| *differs).map(|(what, _)| what)
    }

    /// Checks that it is of one kind, with what belongs to that.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn check(&self) -> std::result::Result<(), String> {
        let relative =
            [("counts", self.counts.is_some()), ("peak_quantum_efficiency", self.peak_quantum_efficiency.is_some())];
        match (&self.quantum_efficiency, &self.relative_response) {
            (None, None) => return Err("`response` has none of `quantum_efficiency` and `relative_response`".into()),
            (Some(_), Some(_)) => {
                return Err("`response` has both `quantum_efficiency` and `relative_response`; leave out one".into());
            }
            (Some(_), None) => {
                if let Some((key, _)) = relative.iter().find(|(_, given)| *given) {
                    return Err(format!(
                        "`response` has `{key}`, which is of a `relative_response`; `quantum_efficiency` is in electrons per photon"
                    ));
                }
            }
            (None, Some(_)) => {}
        }
        match self.peak_quantum_efficiency {
            Some(peak) if !(peak > 0.0 && peak <= 1.0) => {
                let per_cent = if peak > 1.0 && peak <= 100.0 {
                    format!("; as per cent it is {}", of_per_cent(peak))
                } else {
                    String::new()
                };
                Err(format!("`peak_quantum_efficiency` is {peak}; it must be above 0 and at most 1{per_cent}"))
            }
            _ => Ok(()),
        }
    }
}

/// How a number came to be known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// By whoever wrote the file.
    Measured,
    /// By others, who published it.
    Published,
    /// It follows from other numbers.
    Derived,
    /// It is not known, and taken to be so.
    Assumed,
}

impl Named for Origin {
    const ALL: &'static [Self] = &[Self::Measured, Self::Published, Self::Derived, Self::Assumed];

    fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Published => "published",
            Self::Derived => "derived",
            Self::Assumed => "assumed",
        }
    }
}

serde_by_name!(Origin);

/// Where a number comes from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// How it came to be known.
    pub kind: Origin,
    /// By whom, where, from what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
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
    /// Where single numbers come from, by the path of their keys, such as `readout.read_noise_e`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub provenance: BTreeMap<String, Provenance>,
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
        if let Some(files) = &self.response {
            files.check()?;
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
        let assumed = self.assumed().collect::<Vec<_>>().join(", ");
        let assumed = (!assumed.is_empty()).then(|| format!("not known but assumed: {assumed}"));
        doubts.into_iter().chain(assumed).map(|doubt| format!("{}: {doubt}", self.called())).collect()
    }

    /// The keys whose values are assumed.
    pub fn assumed(&self) -> impl Iterator<Item = &str> {
        let is_assumed = |(_, origin): &(&String, &Provenance)| origin.kind == Origin::Assumed;
        self.provenance.iter().filter(is_assumed).map(|(key, _)| key.as_str())
    }

    /// Takes the read-out of another sensor, and what is told of it, in place of its own; gives what is lost by that, a warning
    /// each. The name says both.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where the other has none.
    pub fn replace_readout(&mut self, other: &Self) -> Result<Vec<String>> {
        let readout = other.readout()?.clone();
        let mut lost = Vec::new();
        if self.readout.is_some() {
            lost.push(format!("{}: its own read-out does not count, that of {} does", self.called(), other.called()));
        }
        if self.xyz_from_camera.take().is_some() {
            lost.push(format!("{}: its `xyz_from_camera` is of its own read-out and is left out", self.called()));
        }
        let parts = |of: fn(&Self) -> &Option<String>| match (of(self), of(other)) {
            (Some(own), Some(others)) => Some(format!("{own}; read-out: {others}")),
            (own, None) => own.clone(),
            (None, Some(others)) => Some(format!("read-out: {others}")),
        };
        (self.description, self.source) = (parts(|sensor| &sensor.description), parts(|sensor| &sensor.source));
        let is_of_readout = |key: &str| key.split('.').next() == Some("readout");
        self.provenance.retain(|key, _| !is_of_readout(key));
        let of_readout = other.provenance.iter().filter(|(key, _)| is_of_readout(key));
        self.provenance.extend(of_readout.map(|(key, origin)| (key.clone(), origin.clone())));
        self.name = format!("{}+{}", self.name, other.name);
        self.readout = Some(readout);
        Ok(lost)
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
            provenance: BTreeMap::new(),
            readout: Some(ReadOut {
                setting: None,
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
                black_drift_e: 0.0,
                black_drift_rows: 0.0,
                dsnu_e: 0.0,
                dsnu_row_e: 0.0,
                dsnu_column_e: 0.0,
                prnu_row: 0.0,
                prnu_column: 0.0,
                hot_pixel_share: 0.0,
                hot_pixel_dark_current_e_per_s: 0.0,
                rts_share: 0.0,
                rts_amplitude_e: 0.0,
                smear_line_s: 0.0,
                blooming: 0.0,
                bits: flat.bits,
                bias_adu: flat.bias_adu,
                adu_per_e: flat.adu_per_e,
                linearization: None,
                taps: None,
            }),
            response: Some(ResponseFiles {
                quantum_efficiency: Some(flat.quantum_efficiency),
                cover_glass: flat.cover_glass,
                ..ResponseFiles::default()
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
            provenance: BTreeMap::new(),
            readout: Some(readout()),
            response: Some(ResponseFiles {
                quantum_efficiency: Some(CurveFile { file: "qe.csv".into(), column: None, sha256: None }),
                ..ResponseFiles::default()
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
    fn a_readout_is_replaced_with_what_is_told_of_it() {
        let origin = |kind| Provenance { kind, note: None };
        let told = |keys: &[(&str, Origin)]| -> BTreeMap<String, Provenance> {
            keys.iter().map(|(key, kind)| ((*key).to_owned(), origin(*kind))).collect()
        };
        let mut own = Sensor {
            source: Some("here".into()),
            provenance: told(&[
                ("readout.prnu", Origin::Measured),
                ("response", Origin::Assumed),
                ("readoutx", Origin::Derived),
            ]),
            xyz_from_camera: Some([[1.0; 3]; 3]),
            ..kaf5101ce()
        };
        let other = Sensor {
            name: "other".into(),
            source: Some("there".into()),
            provenance: told(&[("readout.bits", Origin::Assumed), ("name", Origin::Measured)]),
            readout: Some(ReadOut { bits: 14, ..readout() }),
            ..kaf5101ce()
        };
        let lost = own.replace_readout(&other).unwrap();
        assert!(lost[0].contains("its own read-out does not count, that of sensor other does"), "{lost:?}");
        assert!(lost[1].contains("`xyz_from_camera`") && lost.len() == 2, "{lost:?}");
        assert_eq!((own.name.as_str(), own.readout().unwrap().bits), ("kaf-5101ce+other", 14));
        assert_eq!((own.source.as_deref(), own.xyz_from_camera), (Some("here; read-out: there"), None));
        let kept: Vec<&str> = own.provenance.keys().map(String::as_str).collect();
        assert_eq!(kept, ["readout.bits", "readoutx", "response"]);
        assert_eq!(own.doubts(), ["sensor kaf-5101ce+other: not known but assumed: readout.bits, response"]);
        let bare = Sensor { readout: None, ..other };
        assert!(own.replace_readout(&bare).unwrap_err().to_string().contains("no `readout`"));
        // Nothing is lost where there was nothing.
        let mut bare = bare;
        assert!(bare.replace_readout(&own).unwrap().is_empty());
    }

    #[test]
    fn a_response_is_absolute_or_relative() {
        let curve = || Some(CurveFile { file: "qe.csv".into(), column: None, sha256: None });
        let relative = ResponseFiles { relative_response: curve(), ..ResponseFiles::default() };
        let absolute = ResponseFiles { quantum_efficiency: curve(), ..ResponseFiles::default() };
        let said = |files: ResponseFiles| files.check().unwrap_err();
        assert!(said(ResponseFiles::default()).contains("none of"));
        assert!(said(ResponseFiles { quantum_efficiency: curve(), ..relative.clone() }).contains("both"));
        let counted = ResponseFiles { counts: Some(Counts::Quanta), ..absolute.clone() };
        assert!(said(counted).contains("`counts`, which is of a `relative_response`"));
        let per_cent = ResponseFiles { peak_quantum_efficiency: Some(45.0), ..relative.clone() };
        assert!(said(per_cent).contains("as per cent it is 0.45"));
        for peak in [0.0, -0.1, f64::NAN, f64::INFINITY] {
            let wrong = ResponseFiles { peak_quantum_efficiency: Some(peak), ..relative.clone() };
            assert!(said(wrong).contains("above 0 and at most 1"));
        }
        assert_eq!((absolute.check(), relative.check()), (Ok(()), Ok(())));
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
