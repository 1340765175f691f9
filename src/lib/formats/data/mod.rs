//! Data files: sensors, the observer, curves; where they are found, and what is built in.

mod curves;
mod places;
mod sensors;

pub(super) use places::{BUILT_IN, OF_SPECTRA, Place, directories, near_spectrum, without_data};
pub use places::{DATA_VARIABLE, spectrum_file};
pub(super) use sensors::known_cameras;
pub use sensors::{DEFAULT_SENSOR, LoadedSensor, SensorChanges, load_changed_sensor, load_description, load_sensor};

use self::places::{built_in, find};
use super::csv::SpectralTable;
use super::files::read_file;
use super::yaml;
use crate::analysis::characterization::CameraMatrix;
use crate::color::illuminant::Illuminant;
use crate::color::upsampling::whole_nm;
use crate::error::{Error, Result};
use crate::spectrum::{Curve, Observer};
use std::io;
use std::path::Path;

/// Reads a matrix file.
///
/// # Errors
///
/// [`Error::Disk`] and [`Error::Format`].
pub fn load_matrix(path: &Path) -> Result<CameraMatrix> {
    let shown = path.display().to_string();
    let bytes = read_file(path).map_err(|error| match error {
        Error::Disk { file, source, .. } if source.kind() == io::ErrorKind::NotFound => {
            let problem = match load_sensor(&file) {
                Ok(sensor) => {
                    // Responses of the library have neither a read-out nor a scale.
                    let lacks = if sensor.sensor.readout.is_none() { " --readout FILE --peak-quantum-efficiency SHARE" } else { "" };
                    format!(
                        "that is a sensor, and a file of a matrix is wanted; `fit-matrix sky912.exr --sensor {file}{lacks} -o matrix.yaml` \
                         makes one for it"
                    )
                }
                Err(_) => {
                    "there is no such file; `fit-matrix` makes a matrix, as in `fit-matrix sky912.exr -o matrix.yaml`".into()
                }
            };
            Error::format(&file, problem)
        }
        other => other,
    })?;
    let matrix = yaml::parse_matrix(&shown, &bytes)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_observer_integrates_to_the_equal_energy_white() {
        let observer = load_observer().unwrap();
        let sums = observer.matching.each_ref().map(|curve| (360..=830).map(|nm| curve.at(f64::from(nm))).sum::<f64>());
        // Equal energy has x = y = ⅓ to the rounding of the tables (CIE 015, Table T.4: 0.33333 to 0.33334).
        let total: f64 = sums.iter().sum();
        assert!(sums.iter().all(|sum| (sum / total - 1.0 / 3.0).abs() < 1e-4), "{sums:?}");
    }

    /// Two rows that are the same in decimals, and one that is nearly the sum of others.
    #[test]
    fn matrices_that_lose_a_dimension_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("m.yaml");
        for (last, is_read) in
            [("[8.7e-4, 4.5e-5, 4.4e-5]", false), ("[0.0, 0.0, 0.0]", false), ("[1.0e-4, -1.6e-4, 5.3e-4]", true)]
        {
            let text = format!(
                "schema: cyanometer-matrix/1\nmethod: sky-rad-ls\nunit: cd m-2 per (ADU s-1 sr-1)\nxyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], \
                 [3.7e-4, 3.1e-4, -2.6e-5], {last}]\n"
            );
            std::fs::write(&path, text).unwrap();
            let said = load_matrix(&path).err().map_or(String::new(), |error| error.to_string());
            assert_eq!(
                said.contains("is singular: three signals would not give three stimuli"),
                !is_read,
                "{last}: {said}"
            );
        }
    }
}
