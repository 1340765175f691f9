//! What is known by name or comes with the programs: where it was found, and a line about it.

use super::cameras::Camera;
use super::csv::SpectralTable;
use super::data::{BUILT_IN, DATA_VARIABLE, OF_SPECTRA, Place, directories, known_cameras};
use super::files::read_file;
use super::input::{FrameReader, InputOptions};
use super::yaml;
use crate::analysis::characterization::CameraMatrix;
use crate::camera::sensor::Sensor;
use crate::color::illuminant::Illuminant;
use crate::names::Named;
use crate::stream::RowSource;
use std::path::{Path, PathBuf};

/// A kind of what is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Sensor files.
    Sensors,
    /// Matrix files.
    Matrices,
    /// Observers.
    Observers,
    /// Spectra, libraries and spectral images.
    Spectra,
    /// Lights.
    Illuminants,
    /// Charts of colors.
    Charts,
}

impl Named for Kind {
    const ALL: &'static [Self] =
        &[Self::Sensors, Self::Matrices, Self::Observers, Self::Spectra, Self::Illuminants, Self::Charts];

    fn name(self) -> &'static str {
        match self {
            Self::Sensors => "sensors",
            Self::Matrices => "matrices",
            Self::Observers => "observers",
            Self::Spectra => "spectra",
            Self::Illuminants => "illuminants",
            Self::Charts => "charts",
        }
    }

    fn other_names(self) -> &'static [&'static str] {
        match self {
            Self::Sensors => &["sensor", "cameras", "camera"],
            Self::Matrices => &["matrix"],
            Self::Observers => &["observer"],
            Self::Spectra => &["spectrum", "skies"],
            Self::Illuminants => &["illuminant", "lights"],
            Self::Charts => &["chart"],
        }
    }
}

impl Kind {
    fn title(self) -> &'static str {
        match self {
            Self::Sensors => "Sensors (--sensor NAME)",
            Self::Matrices => "Matrices (--matrix FILE)",
            Self::Observers => "Observers (all programs use the CIE 1931 2-degree one, which is built in)",
            Self::Spectra => {
                "Spectra and libraries (inputs of render-radiance, predict-noise and fit-matrix, by name from any directory)"
            }
            Self::Illuminants => "Illuminants (--illuminant, --adapt-to, --scene-white, --reference-light NAME)",
            Self::Charts => "Charts (--reference NAME)",
        }
    }

    /// Directories of data directories where such files lie.
    fn places(self) -> &'static [&'static str] {
        match self {
            Self::Sensors => &["sensors"],
            Self::Matrices => &["matrices", "sensors", ""],
            Self::Observers => &["observers"],
            Self::Spectra => &OF_SPECTRA,
            Self::Illuminants => &["illuminants"],
            Self::Charts => &["charts"],
        }
    }
}

/// Something that is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Known {
    /// Its name, as options take it.
    pub name: String,
    /// Where it was found.
    pub place: String,
    /// What it has and lacks, where that is told: its response and its read-out.
    pub has: Vec<String>,
    /// A line about it.
    pub about: String,
}

/// What is known of a kind; where two have one name, that which options take.
pub fn known(kind: Kind) -> Vec<Known> {
    let mut found: Vec<Known> = if kind == Kind::Illuminants { lights() } else { Vec::new() };
    for directory in directories() {
        for place in kind.places() {
            found.extend(files(&directory.join(place)).iter().filter_map(|path| of_file(kind, path)));
        }
    }
    found.extend(BUILT_IN.iter().filter_map(|(name, bytes)| {
        let path = Path::new(name);
        let is_there = path.parent().is_some_and(|parent| kind.places().iter().any(|place| Path::new(place) == parent));
        is_there.then(|| of_bytes(kind, path, bytes, "built in")).flatten()
    }));
    if kind == Kind::Sensors {
        found.extend(cameras());
    }
    let mut kept: Vec<Known> = Vec::new();
    for one in found {
        if !kept.iter().any(|known| known.name == one.name) {
            kept.push(one);
        }
    }
    kept
}

/// The cameras of the table of responses.
fn cameras() -> Vec<Known> {
    let Ok((place, cameras)) = known_cameras() else { return Vec::new() };
    let place = match place {
        Place::Directory(directory) => directory.display().to_string(),
        Place::BuiltIn => "built in".into(),
    };
    let one = |camera: Camera| {
        let (has, about) = (parts(&camera.sensor()), camera.about());
        Known { name: camera.name, place: place.clone(), has, about }
    };
    cameras.into_iter().map(one).collect()
}

/// What a sensor has and lacks.
fn parts(sensor: &Sensor) -> Vec<String> {
    let response = match &sensor.response {
        None => "none",
        Some(files) if files.quantum_efficiency.is_some() => "absolute",
        Some(files) if files.peak_quantum_efficiency.is_some() => "scaled",
        Some(_) => "relative",
    };
    let readout = match (&sensor.readout, sensor.assumed().filter(|key| key.starts_with("readout.")).count()) {
        (None, _) => "none".to_owned(),
        (Some(_), 0) => "yes".into(),
        (Some(_), count) => format!("yes, {count} assumed"),
    };
    vec![response.into(), readout]
}

/// The files of a directory by name.
fn files(directory: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(directory).into_iter().flatten();
    let mut paths: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file()).collect();
    paths.sort();
    paths
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
}

fn ends_in(path: &Path, ends: &[&str]) -> bool {
    path.extension().is_some_and(|end| ends.iter().any(|known| end.eq_ignore_ascii_case(known)))
}

/// A file of a kind; none where it is of another, or cannot be read.
fn of_file(kind: Kind, path: &Path) -> Option<Known> {
    if kind == Kind::Spectra && ends_in(path, &["exr"]) {
        let options = InputOptions { path: Some(path.to_owned()), all_channels: true, ..InputOptions::default() };
        let reader = FrameReader::open(&options).ok()?;
        let geometry = &reader.header().geometry;
        let [width, height, count] = [geometry.width, geometry.height, geometry.channels.len()];
        let about = format!("{} spectra ({width}x{height} pixels) of {count} wavelengths", width * height);
        let place = path.parent().map_or(String::new(), |directory| directory.display().to_string());
        return Some(Known { name: file_name(path), place, has: Vec::new(), about });
    }
    if !ends_in(path, &["csv", "yaml", "yml"]) {
        return None;
    }
    let directory = path.parent().map_or(String::new(), |directory| directory.display().to_string());
    of_bytes(kind, path, &read_file(path).ok()?, &directory)
}

/// The content of a file of a kind.
fn of_bytes(kind: Kind, path: &Path, bytes: &[u8], place: &str) -> Option<Known> {
    let shown = path.display().to_string();
    let stem = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let named = |name: String, about: String| Some(Known { name, place: place.into(), has: Vec::new(), about });
    let as_file = |about: String| Some(Known { name: shown.clone(), place: "file".into(), has: Vec::new(), about });
    let is_table = ends_in(path, &["csv"]);
    match kind {
        Kind::Sensors if !is_table => {
            let settings = yaml::settings_of(bytes);
            let own = yaml::parse_sensor(&shown, bytes);
            let sensor = match (own, settings.first()) {
                (Err(_), Some(first)) => yaml::parse_sensor_at(&shown, bytes, Some(first)).ok()?.0,
                (own, _) => own.ok()?,
            };
            let mut has = parts(&sensor);
            if let (false, Some(readout)) = (settings.is_empty(), has.last_mut()) {
                readout.push_str(&format!(", settings {}", settings.join(", ")));
            }
            named(stem, sensor.description.unwrap_or(sensor.name)).map(|known| Known { has, ..known })
        }
        Kind::Matrices if !is_table => {
            let matrix: CameraMatrix = yaml::parse_matrix(&shown, bytes).ok()?;
            let about = [Some("to XYZ".into()), matrix.sensor.map(|sensor| format!("of {sensor}")), matrix.method];
            as_file(about.into_iter().flatten().collect::<Vec<_>>().join(", "))
        }
        Kind::Observers if is_table => named(stem, first_comment(bytes)),
        Kind::Charts if is_table => named(stem, first_comment(bytes)),
        Kind::Spectra if is_table => {
            SpectralTable::parse(&shown, bytes).ok()?;
            named(file_name(path), first_comment(bytes))
        }
        _ => None,
    }
}

/// The first comment of a table.
fn first_comment(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let comment = text.lines().find_map(|line| line.strip_prefix('#'));
    comment.map_or_else(|| "(it says nothing of itself)".into(), |line| line.trim().to_owned())
}

/// The lights that are known by name.
fn lights() -> Vec<Known> {
    let about = |name: &str| match name {
        "a" => "incandescent light of 2856 K, CIE standard illuminant A".to_owned(),
        "d65" => "CIE standard illuminant D65, daylight of 6504 K".to_owned(),
        "e" => "equal energy".to_owned(),
        other => format!("CIE daylight {}", other.to_uppercase()),
    };
    let built_in =
        |name: &str, about: String| Known { name: name.into(), place: "built in".into(), has: Vec::new(), about };
    let named = Illuminant::NAMED.iter().map(|(name, _)| built_in(name, about(name)));
    named.chain([built_in("3200K", "a temperature: below 4000 K a black body, above CIE daylight".into())]).collect()
}

/// What is known of a kind, in words: that of which all of `words` are told, in any case.
pub fn page(kind: Kind, words: &[String]) -> String {
    let words: Vec<String> = words.iter().map(|word| word.to_lowercase()).collect();
    let cells = |one: &Known| [&[one.name.clone(), one.place.clone()], &one.has[..]].concat();
    let is_meant = |one: &Known| {
        let line = format!("{} {}", cells(one).join(" "), one.about).to_lowercase();
        words.iter().all(|word| line.contains(word))
    };
    let known: Vec<Known> = known(kind).into_iter().filter(is_meant).collect();
    let mut rows: Vec<(Vec<String>, String)> = known.iter().map(|one| (cells(one), one.about.clone())).collect();
    if kind == Kind::Sensors && !rows.is_empty() {
        let heads = ["NAME", "PLACE", "RESPONSE", "READ-OUT"].map(str::to_owned).to_vec();
        rows.insert(0, (heads, "ABOUT".into()));
    }
    let widest = |column: usize| rows.iter().filter_map(|(cells, _)| cells.get(column)).map(String::len).max();
    let line = |(cells, about): &(Vec<String>, String)| {
        let padded = cells.iter().enumerate().map(|(column, cell)| {
            let width = widest(column).unwrap_or_default();
            format!("  {cell:width$}")
        });
        format!("{}  {about}\n", padded.collect::<String>())
    };
    let lines: String = rows.iter().map(line).collect();
    let none = || match words.is_empty() {
        true => format!("  none; {DATA_VARIABLE} names directories to look in\n"),
        false => format!("  none of which `{}` is told\n", words.join(" ")),
    };
    format!("{}:\n{}", kind.title(), if rows.is_empty() { none() } else { lines })
}
