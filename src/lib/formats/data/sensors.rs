//! Sensors by name or file, with what a user says in place of what their files say.

use super::curves::Curves;
use super::places::{BUILT_IN, Place, directories, find};
use crate::camera::response::SpectralResponse;
use crate::camera::sensor::{Counts, CurveFile, ResponseFiles, SENSOR_SCHEMA, Sensor};
use crate::error::{Error, Result};
use crate::formats::cameras::{self, Camera};
use crate::formats::files::read_file;
use crate::formats::yaml;
use crate::names::nearest;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The default sensor.
pub const DEFAULT_SENSOR: &str = "kaf-5101ce";

/// A sensor with its curves.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedSensor {
    /// The description, digests of the curves filled in, and what its response counts.
    pub sensor: Sensor,
    /// The curves of R, G and B; none where the response is unknown, or that of other classes.
    pub response: Option<SpectralResponse>,
    /// What was assumed, and what in its response may mislead: a warning each.
    doubts: Vec<String>,
    /// How it was read.
    remarks: Vec<String>,
}

/// What a user says of a sensor in place of what its file says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SensorChanges {
    /// The sensor whose read-out counts in place of its own: a name or a file.
    pub readout: Option<String>,
    /// The setting of its read-out, or of the other sensor's: one of those that the file names.
    pub setting: Option<String>,
    /// What its relative response counts.
    pub counts: Option<Counts>,
    /// The largest quantum efficiency that its relative response stands for.
    pub peak_quantum_efficiency: Option<f64>,
}

impl SensorChanges {
    /// Puts what is said into the description of a sensor.
    fn apply(&self, sensor: &mut Sensor) -> Result<()> {
        let given =
            [("counts", self.counts.is_some()), ("peak_quantum_efficiency", self.peak_quantum_efficiency.is_some())];
        let Some((setting, _)) = given.into_iter().find(|(_, given)| *given) else { return Ok(()) };
        let refused = |sensor: &Sensor, problem: &str| {
            let settings: &[&str] = if setting == "counts" { &["counts"] } else { &["peak_quantum_efficiency"] };
            Err(sensor.refuse(problem).leave_out(settings))
        };
        match &mut sensor.response {
            Some(files) if files.relative_response.is_some() => {
                files.counts = self.counts.or(files.counts);
                files.peak_quantum_efficiency = self.peak_quantum_efficiency.or(files.peak_quantum_efficiency);
                Ok(())
            }
            Some(_) => refused(sensor, "its response is not relative but in electrons per photon"),
            None => refused(sensor, "it has no response"),
        }
    }
}

impl LoadedSensor {
    /// What was assumed, and what is possible but may not be meant: a warning each.
    pub fn doubts(&self) -> Vec<String> {
        self.doubts.iter().cloned().chain(self.sensor.doubts()).collect()
    }

    /// How it was read.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// The curves of R, G and B.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where the response is unknown; [`Error::Format`] where it is that of other classes.
    pub fn response(&self) -> Result<&SpectralResponse> {
        self.response.as_ref().ok_or_else(|| match (&self.sensor.response, &self.sensor.readout) {
            (Some(_), Some(readout)) => {
                let array = readout.cfa.in_words();
                self.sensor.refuse(format!("it has {array}; only the response of the classes R, G and B is followed"))
            }
            _ => self.sensor.missing("sensor.response"),
        })
    }
}

/// Finds and reads a sensor with the curves that it names: a name among the installed, in-tree and built-in ones, or the path of a file.
///
/// Names are looked for in the directories of `CYANOMETER_DATA`, in `share/cyanometer` beside the program's directory,
/// in the `sample_data` of the tree that the program was built in, and among what is built in.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown name, with the nearest of those there are; [`Error::Disk`] and [`Error::Format`] for bad files.
pub fn load_sensor(name: &str) -> Result<LoadedSensor> {
    load_changed_sensor(name, &SensorChanges::default())
}

/// The same with what a user says in place of what the file says.
///
/// # Errors
///
/// Those of [`load_sensor`], and [`Error::Format`] for changes that the sensor does not take.
pub fn load_changed_sensor(name: &str, changes: &SensorChanges) -> Result<LoadedSensor> {
    let setting = changes.setting.as_deref();
    let own = setting.filter(|_| changes.readout.is_none());
    let Described { mut sensor, place, shown, mut doubts, mut remarks } = described(name, own)?;
    let mut replaced = Vec::new();
    if let Some(readout) = &changes.readout {
        let (other, of_other) = load_description(readout, setting)?;
        replaced = sensor.replace_readout(&other)?;
        remarks = of_other;
    }
    changes.apply(&mut sensor)?;
    sensor.check().map_err(|problem| Error::format(&shown, problem))?;
    let array = sensor.readout.as_ref().map(|readout| readout.cfa);
    let mut curves = Curves { place: &place, sensor: &shown, array, doubts: Vec::new(), about: None };
    let response = sensor.response.as_mut().map(|files| curves.load(files)).transpose()?;
    doubts.extend(curves.doubts);
    sensor.description = sensor.description.or(curves.about);
    let doubts = doubts.into_iter().map(|doubt| format!("sensor {}: {doubt}", sensor.name));
    let doubts = doubts.chain(replaced).collect();
    Ok(LoadedSensor { sensor, response: response.flatten(), doubts, remarks })
}

/// A sensor as [`load_sensor`] finds it, in a setting of its read-out, without the curves that it names; with how it was read.
///
/// # Errors
///
/// Those of [`load_sensor`].
pub fn load_description(name: &str, setting: Option<&str>) -> Result<(Sensor, Vec<String>)> {
    let Described { sensor, shown, remarks, .. } = described(name, setting)?;
    sensor.check().map_err(|problem| Error::format(&shown, problem))?;
    Ok((sensor, remarks))
}

/// A sensor as its file describes it.
struct Described {
    sensor: Sensor,
    place: Place,
    /// The file in messages.
    shown: String,
    doubts: Vec<String>,
    remarks: Vec<String>,
}

fn described(name: &str, setting: Option<&str>) -> Result<Described> {
    let path = Path::new(name);
    let of_file = |place: Place, shown: String, bytes: &[u8]| {
        let (sensor, told) = yaml::parse_sensor_at(&shown, bytes, setting)?;
        let remarks = told.into_iter().map(|told| format!("sensor {}: {told}", sensor.name)).collect();
        Ok(Described { sensor, place, shown, doubts: Vec::new(), remarks })
    };
    let alone = |found: Described| {
        let check = |setting| yaml::check_only_setting(&found.shown, &found.sensor, setting);
        setting.map_or(Ok(()), check).map(|()| found)
    };
    if path.components().count() > 1 || ends_in(path, &["yaml", "yml"]) || ends_in(path, &TABLES) {
        let place = Place::Directory(path.parent().map(Path::to_owned).unwrap_or_default());
        let bytes = read_file(path)?;
        let is_table = ends_in(path, &TABLES) || path.extension().is_none() && !has_schema(&bytes);
        if is_table {
            let (shown, none) = (name.to_owned(), Vec::new);
            return alone(Described { sensor: of_table(path), place, shown, doubts: none(), remarks: none() });
        }
        return of_file(place, name.to_owned(), &bytes);
    }
    let typed = cameras::normalized(name);
    let file = format!("sensors/{typed}.yaml");
    match find(&file)? {
        Some((Place::Directory(directory), bytes)) => {
            let shown = directory.join(file).display().to_string();
            of_file(Place::Directory(directory.join("sensors")), shown, &bytes)
        }
        Some((Place::BuiltIn, bytes)) => of_file(Place::BuiltIn, format!("sensor {name}"), &bytes),
        None => of_camera(&typed)?.ok_or_else(|| unknown_sensor(name, &typed)).and_then(alone),
    }
}

/// What files of responses end in.
const TABLES: [&str; 5] = ["csv", "tsv", "txt", "json", "gz"];

fn ends_in(path: &Path, ends: &[&str]) -> bool {
    path.extension().is_some_and(|end| ends.iter().any(|known| end.eq_ignore_ascii_case(known)))
}

/// Whether a file looks like one of ours.
fn has_schema(bytes: &[u8]) -> bool {
    String::from_utf8_lossy(bytes).lines().any(|line| line.starts_with("schema:"))
}

/// The sensor of a file of responses: a response alone.
fn of_table(path: &Path) -> Sensor {
    let text = |part: Option<&OsStr>| part.map(|part| part.to_string_lossy().into_owned()).unwrap_or_default();
    let file = CurveFile { file: text(path.file_name()), column: None, sha256: None };
    Sensor {
        schema: SENSOR_SCHEMA.into(),
        name: text(path.file_stem()),
        description: None,
        source: None,
        provenance: BTreeMap::new(),
        readout: None,
        response: Some(ResponseFiles { relative_response: Some(file), ..ResponseFiles::default() }),
        xyz_from_camera: None,
    }
}

/// The camera of a name.
fn of_camera(typed: &str) -> Result<Option<Described>> {
    let (place, cameras) = known_cameras()?;
    let Some(camera) = cameras.into_iter().find(|camera| camera.names().any(|name| name == typed)) else {
        return Ok(None);
    };
    let another = || format!("{typed} is another model, of which it is said that its sensor is the same");
    let doubts = camera.is_another(typed).then(another).into_iter().collect();
    let shown = format!("sensor {}", camera.name);
    Ok(Some(Described { shown, sensor: camera.sensor(), place, doubts, remarks: Vec::new() }))
}

/// The cameras of the table of responses, and where it is.
pub(in crate::formats) fn known_cameras() -> Result<(Place, Vec<Camera>)> {
    let file = format!("sensors/{}", cameras::INDEX);
    let (place, bytes) = find(&file)?.unwrap_or((Place::BuiltIn, Vec::new()));
    let place = match place {
        Place::Directory(directory) => Place::Directory(directory.join("sensors")),
        Place::BuiltIn => Place::BuiltIn,
    };
    Ok((place, Camera::all(&file, &bytes)?))
}

fn unknown_sensor(name: &str, typed: &str) -> Error {
    if Path::new(name).is_file() {
        return Error::format(
            name,
            "its name ends neither in .yaml, as those of sensor files do, nor in .csv, as those of responses; is it another file?",
        );
    }
    let known = known_sensors();
    let near = nearest(typed, known.iter().map(String::as_str), |known| known.len() / 3);
    let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    Error::Usage(format!(
        "there is no sensor `{name}`; `cyanometer list sensors` has those that there are, and for a file of your own give its \
         path{near}"
    ))
}

fn known_sensors() -> Vec<String> {
    let mut names: Vec<String> = directories()
        .iter()
        .filter_map(|directory| std::fs::read_dir(directory.join("sensors")).ok())
        .flatten()
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .chain(BUILT_IN.iter().map(|(name, _)| PathBuf::from(name)))
        .filter(|path| path.extension().is_some_and(|end| end == "yaml"))
        .filter_map(|path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned()))
        .collect();
    names.extend(
        known_cameras()
            .into_iter()
            .flat_map(|(_, cameras)| cameras)
            .flat_map(|camera| camera.names().map(str::to_owned).collect::<Vec<_>>()),
    );
    names.sort();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::response::Scale;

    #[test]
    fn the_default_sensor_is_built_in_and_complete() {
        let loaded = load_sensor(DEFAULT_SENSOR).unwrap();
        assert_eq!(loaded.sensor.readout().unwrap().full_well_e, 40_000.0);
        // Table 1 of the data file's source: Kodak publishes peak efficiencies of 0.31, 0.34 and 0.31.
        for (curve, peak) in loaded.response().unwrap().quantum_efficiency.iter().zip([0.31, 0.34, 0.31]) {
            assert!((curve.extremes().1 - peak).abs() < 0.005);
        }
        assert!(loaded.sensor.response.unwrap().quantum_efficiency.unwrap().sha256.is_some());
    }

    #[test]
    fn cameras_are_known_by_all_their_names() {
        let camera = load_sensor("nikon-d850").unwrap();
        assert_eq!((&camera, camera.sensor.name.as_str()), (&load_sensor("Nikon D850").unwrap(), "nikon-d850"));
        let files = camera.sensor.response.clone().unwrap();
        assert_eq!((files.counts, files.peak_quantum_efficiency), (Some(Counts::Energy), None));
        assert!(files.relative_response.unwrap().sha256.is_some() && camera.sensor.readout.is_none());
        let [doubt] = &camera.doubts()[..] else { panic!("{:?}", camera.doubts()) };
        assert!(doubt.starts_with("sensor nikon-d850: nobody says whether its response counts energy or quanta"));
        assert_eq!(load_sensor("Canon Kiss X5").unwrap().sensor.name, "canon-eos-600d");
        let alike = load_sensor("nikon-d800").unwrap();
        assert_eq!(alike.sensor.name, "nikon-d800e");
        assert!(alike.doubts()[0].contains("nikon-d800 is another model"), "{:?}", alike.doubts());
        let near = load_sensor("nikon-d580").unwrap_err().to_string();
        assert!(
            near.contains("there is no sensor `nikon-d580`;") && near.ends_with("; did you mean `nikon-d850`?"),
            "{near}"
        );
    }

    #[test]
    fn what_is_said_of_a_relative_response_counts() {
        let changes = SensorChanges {
            counts: Some(Counts::Quanta),
            peak_quantum_efficiency: Some(0.4),
            ..SensorChanges::default()
        };
        let changed = load_changed_sensor("nikon-d850", &changes).unwrap();
        assert_eq!(changed.response.unwrap().scale, Scale::Relative { counts: Counts::Quanta, peak: Some(0.4) });
        assert!(changed.doubts.is_empty(), "{:?}", changed.doubts);
        let refused = |changes| load_changed_sensor(DEFAULT_SENSOR, &changes).unwrap_err().to_string();
        let said = refused(SensorChanges { counts: Some(Counts::Energy), ..SensorChanges::default() });
        assert!(
            said.ends_with("its response is not relative but in electrons per photon; leave out `counts`"),
            "{said}"
        );
        let said = refused(SensorChanges { peak_quantum_efficiency: Some(0.4), ..SensorChanges::default() });
        assert!(said.ends_with("leave out `peak_quantum_efficiency`"), "{said}");
        let said = load_changed_sensor(
            "nikon-d850",
            &SensorChanges { peak_quantum_efficiency: Some(40.0), ..SensorChanges::default() },
        );
        assert!(said.unwrap_err().to_string().contains("as per cent it is 0.4"));
    }

    /// All of rawtoaces-data are there, whole, and say nothing that is not so.
    #[test]
    fn every_camera_of_the_table_is_read() {
        let (_, cameras) = known_cameras().unwrap();
        assert_eq!(cameras.len(), 52);
        let mut normalized = Vec::new();
        for camera in &cameras {
            assert_eq!(cameras::normalized(&camera.name), camera.name);
            let loaded = load_sensor(&camera.name).unwrap();
            let classes = &loaded.response().unwrap().quantum_efficiency;
            assert!(classes.iter().all(|class| class.wavelengths_nm().len() == 81));
            assert_eq!(classes.iter().map(|class| class.extremes().1).fold(0.0, f64::max), 1e5, "{}", camera.name);
            if loaded.doubts().iter().any(|doubt| doubt.contains("normalized by itself")) {
                normalized.push(camera.name.as_str());
            }
            assert!(loaded.doubts().iter().all(|doubt| !doubt.contains("order of their names")), "{}", camera.name);
        }
        // Their files have a largest response of 1 in every class.
        assert_eq!(normalized, ["arri-d21", "nikon-d5100"]);
    }

    #[test]
    fn unknown_sensors_are_answered_with_the_known_ones() {
        let message = load_sensor("kaf-5101").unwrap_err().to_string();
        assert!(message.contains("kaf-5101ce"), "{message}");
    }
}
