//! Data files: sensors, the observer, curves; where they are found, and what is built in.

use super::csv::SpectralTable;
use super::digest::sha256;
use super::files::read_file;
use super::yaml;
use crate::analysis::characterization::CameraMatrix;
use crate::camera::response::SpectralResponse;
use crate::camera::sensor::{CurveFile, ResponseFiles, Sensor};
use crate::cfa::FilterArray;
use crate::color::illuminant::Illuminant;
use crate::color::upsampling::whole_nm;
use crate::error::{Error, Result};
use crate::spectrum::{Curve, Observer};
use std::path::{Path, PathBuf};

/// The environment variable that names directories with data files, like `sample_data`.
pub const DATA_VARIABLE: &str = "CYANOMETER_DATA";
/// The default sensor.
pub const DEFAULT_SENSOR: &str = "kaf-5101ce";

/// Files that every program carries, by their place in `sample_data`.
pub(super) const BUILT_IN: [(&str, &[u8]); 8] = [
    ("sensors/kaf-5101ce.yaml", include_bytes!("../../../sample_data/sensors/kaf-5101ce.yaml")),
    ("sensors/kaf5101ce_est_qe_1nm.csv", include_bytes!("../../../sample_data/sensors/kaf5101ce_est_qe_1nm.csv")),
    ("sensors/bg39_1mm.csv", include_bytes!("../../../sample_data/sensors/bg39_1mm.csv")),
    ("observers/cie1931_2deg_1nm.csv", include_bytes!("../../../sample_data/observers/cie1931_2deg_1nm.csv")),
    ("illuminants/cie_daylight_1nm.csv", include_bytes!("../../../sample_data/illuminants/cie_daylight_1nm.csv")),
    ("charts/colorchecker.csv", include_bytes!("../../../sample_data/charts/colorchecker.csv")),
    ("charts/colorchecker-2005.csv", include_bytes!("../../../sample_data/charts/colorchecker-2005.csv")),
    ("illuminants/cie_d65_1nm.csv", include_bytes!("../../../sample_data/illuminants/cie_d65_1nm.csv")),
];

/// A sensor with its curves.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedSensor {
    /// The description, digests of the curves filled in.
    pub sensor: Sensor,
    /// The curves of R, G and B; none where the response is unknown, or that of other classes.
    pub response: Option<SpectralResponse>,
}

impl LoadedSensor {
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

/// Where a data file was found: in a directory, or built in.
enum Place {
    Directory(PathBuf),
    BuiltIn,
}

/// Finds and reads a sensor with the curves that it names: a name among the installed, in-tree and built-in ones, or the path of a file.
///
/// Names are looked for in the directories of `CYANOMETER_DATA`, in `share/cyanometer` beside the program's directory,
/// in the `sample_data` of the tree that the program was built in, and among what is built in.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown name, listing those there are; [`Error::Disk`] and [`Error::Format`] for bad files.
pub fn load_sensor(name: &str) -> Result<LoadedSensor> {
    let path = Path::new(name);
    let is_path = path.components().count() > 1 || path.extension().is_some_and(|end| end == "yaml" || end == "yml");
    let (place, shown, bytes) = if is_path {
        let bytes = read_file(path)?;
        (Place::Directory(path.parent().map(Path::to_owned).unwrap_or_default()), name.to_owned(), bytes)
    } else {
        let file = format!("sensors/{}.yaml", name.to_ascii_lowercase());
        match find(&file)? {
            Some((Place::Directory(directory), bytes)) => {
                (Place::Directory(directory.join("sensors")), directory.join(file).display().to_string(), bytes)
            }
            Some((Place::BuiltIn, bytes)) => (Place::BuiltIn, format!("sensor {name}"), bytes),
            None => {
                return Err(Error::Usage(format!(
                    "there is no sensor `{name}`; known are {} (`cyanometer list`); for a file of your own give its path, ending in .yaml",
                    known_sensors().join(", ")
                )));
            }
        }
    };
    let mut sensor = yaml::parse_sensor(&shown, &bytes)?;
    sensor.check().map_err(|problem| Error::format(&shown, problem))?;
    let array = sensor.readout.as_ref().map(|readout| readout.cfa);
    let response = sensor.response.as_mut().map(|files| load_curves(files, array, &place, &shown)).transpose()?;
    Ok(LoadedSensor { sensor, response: response.flatten() })
}

/// Reads and checks the curves of a response, and notes the digests of their files; gives those of R, G and B, unless
/// its classes are others.
fn load_curves(
    files: &mut ResponseFiles,
    array: Option<FilterArray>,
    place: &Place,
    sensor: &str,
) -> Result<Option<SpectralResponse>> {
    let table = |curve: &mut CurveFile| -> Result<SpectralTable> {
        let (name, bytes) = read_beside(place, sensor, &curve.file)?;
        curve.sha256 = Some(sha256(&bytes));
        SpectralTable::parse(&name, &bytes)
    };
    let efficiencies = table(&mut files.quantum_efficiency)?;
    let class = |column: Option<&str>| within_unit(sensor, "quantum_efficiency", efficiencies.curve(column)?);
    let quantum_efficiency = if array.is_none_or(FilterArray::has_three_classes) {
        Some([class(Some("R"))?, class(Some("G"))?, class(Some("B"))?])
    } else {
        let filters = array.map_or_else(Vec::new, FilterArray::filters);
        if filters.is_empty() {
            class(files.quantum_efficiency.column.as_deref())?;
        }
        for filter in filters {
            class(Some(&filter.to_string()))?;
        }
        None
    };
    let cover_glass = match &mut files.cover_glass {
        Some(glass) => {
            let transmittance = table(glass)?.curve(glass.column.as_deref())?;
            Some(within_unit(sensor, "cover_glass", transmittance)?)
        }
        None => None,
    };
    Ok(quantum_efficiency.map(|quantum_efficiency| SpectralResponse { quantum_efficiency, cover_glass }))
}

/// Reads a matrix file.
///
/// # Errors
///
/// [`Error::Disk`] and [`Error::Format`].
pub fn load_matrix(path: &Path) -> Result<CameraMatrix> {
    let shown = path.display().to_string();
    let matrix = yaml::parse_matrix(&shown, &read_file(path)?)?;
    matrix.check().map_err(|problem| Error::format(&shown, problem))?;
    Ok(matrix)
}

/// The CIE 1931 2° observer, built in.
///
/// # Errors
///
/// None unless the built-in table is damaged.
pub fn load_observer() -> Result<Observer> {
    let name = "observers/cie1931_2deg_1nm.csv";
    let table = SpectralTable::parse(name, built_in(name).unwrap_or_default())?;
    Ok(Observer { matching: [table.curve(Some("xbar"))?, table.curve(Some("ybar"))?, table.curve(Some("zbar"))?] })
}

/// The components S₀, S₁ and S₂ of CIE daylight, built in.
///
/// # Errors
///
/// None unless the built-in table is damaged.
pub fn load_daylight() -> Result<[Curve; 3]> {
    let name = "illuminants/cie_daylight_1nm.csv";
    let table = SpectralTable::parse(name, built_in(name).unwrap_or_default())?;
    Ok([table.curve(Some("S0"))?, table.curve(Some("S1"))?, table.curve(Some("S2"))?])
}

/// The table of a chart, with its name in messages: one of the installed, in-tree and built-in ones, or the path of a file.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown name; those of readers.
pub fn chart(name: &str) -> Result<(String, Vec<u8>)> {
    let path = Path::new(name);
    if path.components().count() > 1 || path.extension().is_some_and(|end| !end.is_empty()) {
        return Ok((name.to_owned(), read_file(path)?));
    }
    let Some((_, bytes)) = find(&format!("charts/{}.csv", name.to_ascii_lowercase()))? else {
        return Err(Error::Usage(format!(
            "there is no chart `{name}`; known are colorchecker (made from November 2014 on) and colorchecker-2005 (made \
             before); for a table of your own give its path, ending in .csv"
        )));
    };
    Ok((name.to_owned(), bytes))
}

/// The relative spectral power of an illuminant, by its name or temperature, or a table of one curve. That of `d65` is the
/// published table.
///
/// # Errors
///
/// [`Error::Usage`] for another name, [`Error::Disk`] and [`Error::Format`] for a file that is no such table.
pub fn load_illuminant(name: &str) -> Result<Curve> {
    let d65 = "illuminants/cie_d65_1nm.csv";
    let path = Path::new(name);
    let curve = match (name, name.parse::<Illuminant>()) {
        (name, _) if name.eq_ignore_ascii_case("d65") => {
            SpectralTable::parse(d65, built_in(d65).unwrap_or_default())?.curve(None)?
        }
        (_, Ok(light)) => {
            let daylight = load_daylight()?;
            let components = |nm| daylight.each_ref().map(|component| component.at(nm));
            let wavelengths: Vec<f64> = whole_nm().collect();
            let values = wavelengths.iter().map(|&nm| light.power(nm, components)).collect();
            Curve::new(wavelengths, values).map_err(|problem| Error::format(name, problem))?
        }
        _ if path.extension().is_some() || path.components().count() > 1 => {
            SpectralTable::parse(name, &read_file(path)?)?.light()?
        }
        _ => {
            let problem = format!(
                "there is no illuminant `{name}`; known are a, d50, d55, d65, d75, e and temperatures such as 3200K; for others give a table, as CSV"
            );
            return Err(Error::Usage(problem));
        }
    };
    let (lowest, highest) = curve.extremes();
    if lowest < 0.0 || highest <= 0.0 {
        return Err(Error::format(name, "it is no light: its power is negative somewhere, or zero everywhere"));
    }
    Ok(curve)
}

/// An efficiency or a transmittance is a fraction.
fn within_unit(sensor: &str, key: &str, curve: Curve) -> Result<Curve> {
    let (low, high) = curve.extremes();
    if low < 0.0 || high > 1.0 {
        let per_cent = if low >= 0.0 && high <= 100.0 { ", and looks like per cent: divide it by 100" } else { "" };
        let problem = format!("`{key}` runs from {low} to {high}; it must lie within 0 and 1{per_cent}");
        return Err(Error::format(sensor, problem));
    }
    Ok(curve)
}

/// Reads a file that a sensor file names; a name with a directory in it is never opened.
fn read_beside(place: &Place, sensor: &str, file: &str) -> Result<(String, Vec<u8>)> {
    if Path::new(file).file_name().is_none_or(|name| name != file) {
        return Err(Error::format(sensor, format!("`{file}` must be the bare name of a file beside the sensor file")));
    }
    match place {
        Place::Directory(directory) => {
            let path = directory.join(file);
            let shown = path.display().to_string();
            // A named pipe, which a reader would wait on, is nothing that a user has named; what is missing, reading tells.
            if std::fs::metadata(&path).is_ok_and(|about| !about.is_file() && !about.is_dir()) {
                return Err(Error::format(&shown, "it is no file but a pipe or a device; a table must be a file"));
            }
            let bytes = read_file(&path).map_err(|error| match error {
                Error::Disk { .. } => Error::format(sensor, format!("it names a file that is not read: {error}")),
                other => other,
            })?;
            Ok((shown, bytes))
        }
        Place::BuiltIn => match built_in(&format!("sensors/{file}")) {
            Some(bytes) => Ok((file.to_owned(), bytes.to_vec())),
            None => Err(Error::format(sensor, format!("its file `{file}` is not built in"))),
        },
    }
}

fn built_in(file: &str) -> Option<&'static [u8]> {
    BUILT_IN.iter().find(|(name, _)| *name == file).map(|(_, bytes)| *bytes)
}

/// Directories that may hold data files, first to last.
pub(super) fn directories() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> =
        std::env::var_os(DATA_VARIABLE).map(|list| std::env::split_paths(&list).collect()).unwrap_or_default();
    if let Ok(program) = std::env::current_exe() {
        let above: Vec<&Path> = program.ancestors().skip(1).collect();
        found.extend(above.get(1).map(|prefix| prefix.join("share/cyanometer")));
        found.extend(above.iter().take(4).map(|directory| directory.join("sample_data")));
    }
    found
}

fn find(file: &str) -> Result<Option<(Place, Vec<u8>)>> {
    for directory in directories() {
        let path = directory.join(file);
        if path.is_file() {
            return Ok(Some((Place::Directory(directory), read_file(&path)?)));
        }
    }
    Ok(built_in(file).map(|bytes| (Place::BuiltIn, bytes.to_vec())))
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
    names.sort();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_sensor_is_built_in_and_complete() {
        let loaded = load_sensor(DEFAULT_SENSOR).unwrap();
        assert_eq!(loaded.sensor.readout().unwrap().full_well_e, 40_000.0);
        // Table 1 of the data file's source: Kodak publishes peak efficiencies of 0.31, 0.34 and 0.31.
        for (curve, peak) in loaded.response().unwrap().quantum_efficiency.iter().zip([0.31, 0.34, 0.31]) {
            assert!((curve.extremes().1 - peak).abs() < 0.005);
        }
        assert!(loaded.sensor.response.unwrap().quantum_efficiency.sha256.is_some());
    }

    #[test]
    fn unknown_sensors_are_answered_with_the_known_ones() {
        let message = load_sensor("kaf-5101").unwrap_err().to_string();
        assert!(message.contains("kaf-5101ce"), "{message}");
    }

    #[test]
    fn the_observer_integrates_to_the_equal_energy_white() {
        let observer = load_observer().unwrap();
        let sums = observer.matching.each_ref().map(|curve| (360..=830).map(|nm| curve.at(f64::from(nm))).sum::<f64>());
        // Equal energy has x = y = ⅓ to the rounding of the tables (CIE 015, Table T.4: 0.33333 to 0.33334).
        let total: f64 = sums.iter().sum();
        assert!(sums.iter().all(|sum| (sum / total - 1.0 / 3.0).abs() < 1e-4), "{sums:?}");
    }

    #[test]
    fn no_path_in_a_sensor_file_is_opened() {
        for file in ["../qe.csv", "/etc/passwd", "a/b.csv", ".."] {
            assert!(read_beside(&Place::BuiltIn, "s.yaml", file).unwrap_err().to_string().contains("bare name"));
        }
    }
}
