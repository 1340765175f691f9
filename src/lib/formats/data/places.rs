//! Where data files are found: beside the file that names them, in directories, or built in.

use crate::error::{Error, Result};
use crate::formats::files::read_file;
use crate::formats::own_program::own_program;
use crate::formats::places::is_waited_on;
use crate::names::nearest;
use std::path::{Path, PathBuf};

/// The environment variable that names directories with data files, like `sample_data`.
pub const DATA_VARIABLE: &str = "CYANOMETER_DATA";

/// Files that every program carries, by their place in `sample_data`.
pub(in crate::formats) const BUILT_IN: [(&str, &[u8]); 13] = [
    ("sensors/kaf-5101ce.yaml", include_bytes!("../../../../sample_data/sensors/kaf-5101ce.yaml")),
    ("sensors/kaf5101ce_est_qe_1nm.csv", include_bytes!("../../../../sample_data/sensors/kaf5101ce_est_qe_1nm.csv")),
    ("sensors/rawtoaces.csv", include_bytes!("../../../../sample_data/sensors/rawtoaces.csv")),
    ("sensors/rawtoaces_cameras.csv", include_bytes!("../../../../sample_data/sensors/rawtoaces_cameras.csv")),
    ("sensors/imx219.yaml", include_bytes!("../../../../sample_data/sensors/imx219.yaml")),
    ("sensors/imx477.yaml", include_bytes!("../../../../sample_data/sensors/imx477.yaml")),
    ("sensors/ov5647.yaml", include_bytes!("../../../../sample_data/sensors/ov5647.yaml")),
    ("sensors/bg39_1mm.csv", include_bytes!("../../../../sample_data/sensors/bg39_1mm.csv")),
    ("observers/cie1931_2deg_1nm.csv", include_bytes!("../../../../sample_data/observers/cie1931_2deg_1nm.csv")),
    ("illuminants/cie_daylight_1nm.csv", include_bytes!("../../../../sample_data/illuminants/cie_daylight_1nm.csv")),
    ("charts/colorchecker.csv", include_bytes!("../../../../sample_data/charts/colorchecker.csv")),
    ("charts/colorchecker-2005.csv", include_bytes!("../../../../sample_data/charts/colorchecker-2005.csv")),
    ("illuminants/cie_d65_1nm.csv", include_bytes!("../../../../sample_data/illuminants/cie_d65_1nm.csv")),
];

/// Where a data file was found: in a directory, or built in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::formats) enum Place {
    Directory(PathBuf),
    BuiltIn,
}

/// Reads a file that a sensor file names; a name with a directory in it is never opened.
pub(super) fn read_beside(place: &Place, sensor: &str, file: &str) -> Result<(String, Vec<u8>)> {
    if Path::new(file).file_name().is_none_or(|name| name != file) {
        return Err(Error::format(sensor, format!("`{file}` must be the bare name of a file beside the sensor file")));
    }
    match place {
        Place::Directory(directory) => {
            let path = directory.join(file);
            let shown = path.display().to_string();
            // A named pipe, which a reader would wait on, is nothing that a user has named; what is missing, reading tells.
            if is_waited_on(&path) {
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

pub(super) fn built_in(file: &str) -> Option<&'static [u8]> {
    BUILT_IN.iter().find(|(name, _)| *name == file).map(|(_, bytes)| *bytes)
}

/// Directories that may hold data files, first to last.
pub(in crate::formats) fn directories() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> =
        std::env::var_os(DATA_VARIABLE).map(|list| std::env::split_paths(&list).collect()).unwrap_or_default();
    if let Ok(program) = own_program() {
        let above: Vec<&Path> = program.ancestors().skip(1).collect();
        found.extend(above.get(1).map(|prefix| prefix.join("share/cyanometer")));
        found.extend(above.iter().take(4).map(|directory| directory.join("sample_data")));
    }
    found
}

/// Directories of data directories in which spectra lie.
pub(in crate::formats) const OF_SPECTRA: [&str; 2] = ["skies", "spectra"];

/// Why a spectrum of no file here is none of the sample data either, and what helps; none where there are data.
pub(in crate::formats) fn without_data(path: &Path) -> Option<String> {
    let is_of_data = path.components().count() == 1 || path.starts_with("sample_data");
    let has_spectra = |directory: &PathBuf| OF_SPECTRA.iter().any(|place| directory.join(place).is_dir());
    if !is_of_data || directories().iter().any(has_spectra) {
        return None;
    }
    let why = match own_program() {
        Ok(_) => "the sample data are not installed beside the programs (`scripts/install` does that)".to_owned(),
        Err(error) => format!("where the programs lie, and sample data with them, this system does not tell ({error})"),
    };
    Some(format!("{why}: let {DATA_VARIABLE} name their directory, or see `cyanometer demo`, which carries two skies"))
}

/// The file of a spectrum, a library or what is told of one: that of this name, or, of a bare name of no file where the program runs,
/// that of a data directory.
pub fn spectrum_file(path: &Path) -> PathBuf {
    let is_bare = path.file_name().is_some_and(|name| path == Path::new(name));
    if !is_bare || path.symlink_metadata().is_ok() {
        return path.to_owned();
    }
    let places = || OF_SPECTRA.iter().map(|place| Path::new(place).join(path));
    let known = directories().into_iter().flat_map(|directory| places().map(move |file| directory.join(file)));
    known.into_iter().find(|file| file.is_file()).unwrap_or_else(|| path.to_owned())
}

/// The spectrum of a data directory that a name of no file may mean: the nearest, also without the end of its name, or the first
/// that has a word of it.
pub(in crate::formats) fn near_spectrum(path: &Path) -> Option<String> {
    let typed = path.file_name()?.to_str()?.to_lowercase();
    let of = |directory: PathBuf| {
        std::fs::read_dir(directory)
            .into_iter()
            .flatten()
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
    };
    let mut known: Vec<String> = directories()
        .iter()
        .flat_map(|directory| OF_SPECTRA.map(|place| directory.join(place)))
        .flat_map(of)
        .filter(|name| name.ends_with(".csv") || name.ends_with(".exr"))
        .collect();
    known.sort();
    known.dedup();
    // Of a name with a directory that very file.
    match path == Path::new(path.file_name()?) {
        true => near(&typed, &known),
        false => known.into_iter().find(|name| *name == typed),
    }
}

/// The known name that is nearest to a typed one, or the first that has a word like one of it.
fn near(typed: &str, known: &[String]) -> Option<String> {
    /// Shorter words are in too many names.
    const SHORTEST: usize = 4;
    let stem = |name: &str| name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned();
    let words = |name: &str| -> Vec<String> {
        let of = stem(name);
        of.split(|c: char| !c.is_alphabetic()).filter(|word| word.len() >= SHORTEST).map(str::to_owned).collect()
    };
    let stems: Vec<String> = known.iter().map(|name| stem(name)).collect();
    let by_stem = nearest(&stem(typed), stems.iter().map(String::as_str), |known| known.len() / 3);
    let of_stem = |found: &str| stems.iter().position(|stem| stem == found).map(|place| known[place].clone());
    let shares_word = |name: &&String| {
        let own = words(name);
        words(typed)
            .iter()
            .any(|word| nearest(word, own.iter().map(String::as_str), |known| known.len() / SHORTEST).is_some())
    };
    by_stem.and_then(of_stem).or_else(|| known.iter().find(shares_word).cloned())
}

pub(super) fn find(file: &str) -> Result<Option<(Place, Vec<u8>)>> {
    for directory in directories() {
        let path = directory.join(file);
        if path.is_file() {
            return Ok(Some((Place::Directory(directory), read_file(&path)?)));
        }
    }
    Ok(built_in(file).map(|bytes| (Place::BuiltIn, bytes.to_vec())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_like_a_known_one_is_found() {
        let known = ["clear_zenith.csv", "clear_zenith30.csv", "measured_blue.csv", "sky912.exr"].map(str::to_owned);
        for (typed, wanted) in [
            ("clear_zenth.csv", Some("clear_zenith.csv")),
            ("clear_zenith", Some("clear_zenith.csv")),
            ("clear-zenith30", Some("clear_zenith30.csv")),
            ("zenit-sky", Some("clear_zenith.csv")),
            ("blue_sky.csv", Some("measured_blue.csv")),
            ("mesured", Some("measured_blue.csv")),
            ("sky921.exr", Some("sky912.exr")),
            ("mine.csv", None),
            ("radiance.csv", None),
        ] {
            assert_eq!(near(typed, &known).as_deref(), wanted, "{typed}");
        }
    }

    #[test]
    fn no_path_in_a_sensor_file_is_opened() {
        for file in ["../qe.csv", "/etc/passwd", "a/b.csv", ".."] {
            assert!(read_beside(&Place::BuiltIn, "s.yaml", file).unwrap_err().to_string().contains("bare name"));
        }
    }
}
