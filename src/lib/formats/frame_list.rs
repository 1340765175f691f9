//! Lists of flats and darks: a table, a YAML list, or the descriptor of an EMVA 1288 measurement.

use super::cells::numeric;
use super::files::read_file;
use super::{csv, delimited, keys, register, table, yaml};
use crate::camera::optics::doubt_of_time;
use crate::camera::readout::LEAST_TEMPERATURE_K;
use crate::error::{Error, Result};
use crate::names::{Named, serde_by_name};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashSet};
use std::path::{Path, PathBuf};

/// What a frame of a measurement shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameKind {
    /// Even light.
    Flat,
    /// No light.
    Dark,
}

serde_by_name!(FrameKind);

impl Named for FrameKind {
    const ALL: &'static [Self] = &[Self::Flat, Self::Dark];

    fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Dark => "dark",
        }
    }
}

/// A frame as a list has it; what it does not say, the frame's own metadata may.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ListedFrame {
    /// The file, as seen from the list.
    pub file: PathBuf,
    /// What it shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<FrameKind>,
    /// Exposure time in s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_s: Option<f64>,
    /// Photons per photosite during the exposure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photons: Option<f64>,
    /// Temperature of the sensor in K.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<f64>,
    /// The same in °C, in lists alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Any word that tells levels of light of one exposure time apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<String>,
    /// What a list of YAML says beside, such as notes.
    #[serde(flatten)]
    pub beside: serde_yaml::Mapping,
}

/// A list of frames, and what it says of all.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameList {
    /// The frames.
    pub frames: Vec<ListedFrame>,
    /// The largest code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white_level_adu: Option<f64>,
}

/// Columns of a table.
const COLUMNS: [&str; 7] = ["file", "kind", "exposure_s", "photons", "temperature_k", "temperature_c", "level"];
/// 0 °C in K.
const ZERO_CELSIUS_K: f64 = 273.15;

/// Reads a list; files are found beside it.
///
/// # Errors
///
/// Those of the disk; [`Error::Format`] for what is no such list, naming the line or the column.
pub fn read(path: &Path) -> Result<FrameList> {
    let name = path.display().to_string();
    let bytes = read_file(path)?;
    if let Some(format) = table::known_by(&bytes) {
        let problem = format!(
            "it is {}, a single frame; a list of flats and darks is wanted, a table with the columns {}, or the directory that they are in",
            format.name,
            COLUMNS.join(", ")
        );
        return Err(Error::format(&name, problem));
    }
    let text = delimited::decoded(&name, &bytes)?;
    if let Some(kind) = keys::kind_of(&text) {
        return Err(Error::format(&name, format!("it is {kind}; a list of flats and darks is wanted here")));
    }
    let mut list = if is_descriptor(&text) {
        descriptor(&name, &text)?
    } else if is_yaml(path, &text) {
        let is_plain = text.lines().any(|line| line.starts_with('-'));
        let whole = if is_plain { format!("frames:\n{text}") } else { text.into_owned() };
        let list: FrameList = yaml::parse_strict(&name, whole.as_bytes())?;
        check_names(&name, "key", &keys_of(&list.frames))?;
        list
    } else {
        FrameList { frames: of_table(&name, &bytes)?, white_level_adu: None }
    };
    if list.frames.is_empty() {
        return Err(Error::format(&name, "it lists no frames"));
    }
    let mut seen = HashSet::new();
    for frame in &mut list.frames {
        if let Some(celsius) = frame.temperature_c.take() {
            frame.temperature_k = frame.temperature_k.or(Some(celsius + ZERO_CELSIUS_K));
        }
        check(&name, frame)?;
        if !seen.insert(frame.file.clone()) {
            return Err(Error::format(
                &name,
                format!("{} is listed twice; frames of a pair are two files", frame.file.display()),
            ));
        }
    }
    doubt_of_times(&list.frames).into_iter().for_each(|doubt| register::doubt(format!("{name}: {doubt}")));
    let folder = path.parent().unwrap_or(Path::new(""));
    for frame in &mut list.frames {
        frame.file = folder.join(&frame.file);
    }
    Ok(list)
}

/// The descriptor of an EMVA 1288 measurement that lies in a folder, if there is one.
pub fn descriptor_in(folder: &Path) -> Option<PathBuf> {
    /// Descriptors are no larger, in bytes.
    const LARGEST: u64 = 1 << 22;
    let mut texts: Vec<PathBuf> =
        std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path())).collect();
    texts.retain(|path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("txt")));
    texts.sort();
    texts.into_iter().find(|path| {
        let is_small = path.metadata().is_ok_and(|file| file.is_file() && file.len() <= LARGEST);
        is_small && std::fs::read_to_string(path).is_ok_and(|text| is_descriptor(&text))
    })
}

fn is_yaml(path: &Path, text: &str) -> bool {
    let is_named =
        path.extension().is_some_and(|end| end.eq_ignore_ascii_case("yaml") || end.eq_ignore_ascii_case("yml"));
    is_named || text.lines().any(|line| line.starts_with("frames:") || line.starts_with("- "))
}

/// A warning of times that look as if they were in ms: the longest of flats, or, as darks may last long, the shortest of all.
fn doubt_of_times(frames: &[ListedFrame]) -> Option<String> {
    let is_flat = |frame: &&ListedFrame| frame.kind == Some(FrameKind::Flat);
    let longest = frames.iter().filter(is_flat).filter_map(|frame| frame.exposure_s).reduce(f64::max);
    let shortest = || frames.iter().filter_map(|frame| frame.exposure_s).reduce(f64::min);
    longest.or_else(shortest).and_then(doubt_of_time)
}

fn check(name: &str, frame: &ListedFrame) -> Result<()> {
    let file = frame.file.display();
    let positive = [("exposure_s", frame.exposure_s), ("temperature_k", frame.temperature_k)];
    for (key, value) in positive {
        if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
            return Err(Error::format(name, format!("`{key}` of {file} is {value}; it must be above 0")));
        }
    }
    if let Some(kelvin) = frame.temperature_k.filter(|kelvin| *kelvin < LEAST_TEMPERATURE_K) {
        let problem = format!(
            "`temperature_k` of {file} is {kelvin}, which looks like degrees Celsius; `temperature_c` takes these"
        );
        return Err(Error::format(name, problem));
    }
    match frame.photons {
        Some(photons) if !(0.0..f64::INFINITY).contains(&photons) => {
            Err(Error::format(name, format!("`photons` of {file} is {photons}; it must not be negative")))
        }
        Some(photons) if photons > 0.0 && frame.kind == Some(FrameKind::Dark) => {
            Err(Error::format(name, format!("{file} is a dark with {photons} photons; it is a flat, or has none")))
        }
        _ => Ok(()),
    }
}

/// The keys that frames of a list of YAML have.
fn keys_of(frames: &[ListedFrame]) -> Vec<String> {
    let mappings = frames.iter().filter_map(|frame| serde_yaml::to_value(frame).ok()?.as_mapping().cloned());
    let keys = mappings.flat_map(|told| told.into_iter().map(|(key, _)| key.as_str().unwrap_or("?").to_owned()));
    keys.collect::<BTreeSet<String>>().into_iter().collect()
}

/// How words begin by which people call columns, the columns of a list that have that, and what is to be known of these.
const MEANT: [(&[&str], &[&str], &str); 7] = [
    (&["note", "comment", "remark", "description", "operator", "date", "timestamp"], &[], ""),
    (&["exposure", "texp", "time", "integration", "shutter"], &["exposure_s"], ", in s (20 ms are 0.02)"),
    (&["photon"], &["photons"], ", per photosite during the exposure"),
    (&["temp"], &["temperature_k", "temperature_c"], ""),
    (&["file", "name", "path", "frame", "image"], &["file"], ""),
    (&["kind", "type"], &["kind"], ", flat or dark"),
    (&["level", "light", "step"], &["level"], ""),
];

/// Refuses columns of a table, or keys, that are not known; those of notes, and of what a known one beside them has, are left alone,
/// with a warning.
fn check_names(name: &str, what: &str, names: &[String]) -> Result<()> {
    let is = |column: &str, word: &str| column.trim().eq_ignore_ascii_case(word);
    let is_known = |word: &str| COLUMNS.iter().any(|known| is(word, known));
    let mut ignored = Vec::new();
    for unknown in names.iter().filter(|column| !is_known(column)) {
        let words = unknown.to_lowercase();
        let words = words.split(|c: char| !c.is_alphanumeric());
        let is_called = |called: &[&str]| words.clone().any(|word| called.iter().any(|start| word.starts_with(start)));
        let meant = MEANT.iter().find(|(called, ..)| is_called(called));
        let are_blank = unknown.split_whitespace().all(is_known);
        let advice = match meant {
            _ if are_blank => ", parted by commas, semicolons or tabs".to_owned(),
            // Of notes, and beside the column that is meant, nothing is lacking.
            Some((_, own, _)) if own.is_empty() || names.iter().any(|column| own.iter().any(|own| is(column, own))) => {
                ignored.push(format!("`{unknown}`"));
                continue;
            }
            Some((_, own, numbers)) => format!("; call this one `{}`{numbers}, or leave it out", own.join("` or `")),
            None => "; leave this one out, or call it `note`".to_owned(),
        };
        let problem = format!("unknown {what} `{unknown}`; a list of frames has {}{advice}", COLUMNS.join(", "));
        return Err(Error::format(name, problem));
    }
    if !ignored.is_empty() {
        let are = if ignored.len() == 1 { " is" } else { "s are" };
        register::doubt(format!("{name}: the {what}{are} not looked at: {}", ignored.join(", ")));
    }
    Ok(())
}

fn of_table(name: &str, bytes: &[u8]) -> Result<Vec<ListedFrame>> {
    let columns = csv::columns(name, bytes)?;
    check_names(name, "column", &columns)?;
    let column = |wanted: &str| -> Result<Option<Vec<String>>> {
        let found = columns.iter().find(|column| column.trim().eq_ignore_ascii_case(wanted));
        found.map(|column| csv::text_column(name, bytes, column)).transpose()
    };
    let files = column("file")?.ok_or_else(|| Error::format(name, "it has no column `file`"))?;
    let [kind, level] = [column("kind")?, column("level")?];
    let numbers = |wanted: &str| -> Result<Vec<Option<f64>>> {
        let Some(cells) = column(wanted)? else { return Ok(vec![None; files.len()]) };
        let read = |(row, cell): (usize, &String)| match cell.trim() {
            "" => Ok(None),
            cell => numeric(cell).map(Some).ok_or_else(|| {
                Error::format(name, format!("`{cell}` in row {} of `{wanted}` is not a number", row + 1))
            }),
        };
        cells.iter().enumerate().map(read).collect()
    };
    let [exposure_s, photons, kelvin, celsius] =
        [numbers("exposure_s")?, numbers("photons")?, numbers("temperature_k")?, numbers("temperature_c")?];
    let kind_of = |row: usize| -> Result<Option<FrameKind>> {
        match kind.as_ref().map_or("", |cells| cells[row].trim()) {
            "" => Ok(None),
            cell => FrameKind::named(cell).map(Some).ok_or_else(|| {
                Error::format(name, format!("`{cell}` in row {} of `kind` is neither flat nor dark", row + 1))
            }),
        }
    };
    let frame = |(row, file): (usize, &String)| {
        let level = level.as_ref().map(|cells| cells[row].trim().to_owned()).filter(|level| !level.is_empty());
        Ok(ListedFrame {
            file: file.trim().into(),
            kind: kind_of(row)?,
            exposure_s: exposure_s[row],
            photons: photons[row],
            temperature_k: kelvin[row],
            temperature_c: celsius[row],
            level,
            ..ListedFrame::default()
        })
    };
    files.iter().enumerate().map(frame).collect()
}

/// Lines of a descriptor that say something, with their numbers.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

fn is_descriptor(text: &str) -> bool {
    let is_line = |(_, line): (usize, &str)| {
        let mut words = line.split_whitespace();
        matches!(words.next(), Some("v" | "n" | "b" | "d" | "i")) && words.next().is_some()
    };
    lines(text).next().is_some() && lines(text).take(4).all(is_line)
}

/// Reads a descriptor of the reference implementation's form: `n` bits, width, height; `b` exposure in ns and photons, `d` exposure
/// in ns, each before its images, `i` the path of one.
fn descriptor(name: &str, text: &str) -> Result<FrameList> {
    /// Seconds of the descriptor's unit.
    const S_PER_NS: f64 = 1e-9;
    let mut list = FrameList::default();
    let mut condition: Option<(FrameKind, f64, Option<f64>, String)> = None;
    for (number, line) in lines(text) {
        let wrong = |what: &str| Error::format(name, format!("line {number}, `{line}`: {what}"));
        let (sign, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let words: Vec<&str> = rest.split_whitespace().collect();
        let value = |index: usize| {
            let cell = words.get(index).copied().unwrap_or_default();
            numeric(cell).ok_or_else(|| wrong("a number is missing"))
        };
        match sign {
            "v" => {}
            "n" => {
                let bits = value(0)?;
                if !(1.0..=16.0).contains(&bits) {
                    return Err(wrong("the bits of a sample are 1 to 16"));
                }
                list.white_level_adu = Some(bits.exp2() - 1.0);
            }
            "b" => condition = Some((FrameKind::Flat, value(0)? * S_PER_NS, Some(value(1)?), number.to_string())),
            "d" => condition = Some((FrameKind::Dark, value(0)? * S_PER_NS, None, number.to_string())),
            "i" => {
                let (kind, exposure_s, photons, level) =
                    condition.clone().ok_or_else(|| wrong("an image stands before any line `b` or `d`"))?;
                // Paths are those of Windows.
                let file = rest.trim().replace('\\', "/").into();
                let frame = ListedFrame {
                    file,
                    kind: Some(kind),
                    exposure_s: Some(exposure_s),
                    photons,
                    level: Some(level),
                    ..ListedFrame::default()
                };
                list.frames.push(frame);
            }
            _ => return Err(wrong("it begins with none of v, n, b, d and i")),
        }
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        (folder, path)
    }

    #[test]
    fn the_three_forms_are_read() {
        let (folder, path) = written(
            "list.csv",
            "file,kind,exposure_s,photons,temperature_c\na.tiff,flat,0.01,120,20\nb.tiff,Dark,0.01,,20\n",
        );
        let list = read(&path).unwrap();
        let frame = |file: &str, kind, photons| ListedFrame {
            file: folder.path().join(file),
            kind: Some(kind),
            exposure_s: Some(0.01),
            photons,
            temperature_k: Some(293.15),
            ..ListedFrame::default()
        };
        assert_eq!(
            list.frames,
            [frame("a.tiff", FrameKind::Flat, Some(120.0)), frame("b.tiff", FrameKind::Dark, None)]
        );
        let (_folder, path) = written("list.yaml", "- file: a.tiff\n  kind: Flat\n- file: b.tiff\n  kind: DARK\n");
        assert_eq!(read(&path).unwrap().frames.len(), 2);
        let (folder, path) = written(
            "data.txt",
            "# measured\nv 3.0\nn 12 640 480\nb 40000.0 120,5\ni images\\b_0.png\nd 40000.0\ni images\\d_0.png\n",
        );
        let list = read(&path).unwrap();
        assert_eq!(list.white_level_adu, Some(4095.0));
        assert_eq!(list.frames[0].file, folder.path().join("images/b_0.png"));
        assert_eq!((list.frames[0].exposure_s, list.frames[0].photons), (Some(40_000.0 * 1e-9), Some(120.5)));
        assert_eq!(list.frames[1].kind, Some(FrameKind::Dark));
    }

    /// What parts the cells, and what marks decimals, is told as in other tables, though most columns are words.
    #[test]
    fn tables_are_parted_as_others_are() {
        for text in [
            "file,kind,exposure_s\na b.tiff,flat,0.02\nc.tiff,dark,0.02\n",
            "File,KIND,Exposure_s\na b.tiff,flat,0.02\nc.tiff,dark,0.02\n",
            "file;kind;exposure_s\na b.tiff;flat;0,02\nc.tiff;dark;0,02\n",
            "file;kind;exposure_s\r\na b.tiff;flat;0.02\r\nc.tiff;dark;0.02\r\n",
            "file\tkind\texposure_s\na b.tiff\tflat\t0,02\nc.tiff\tdark\t2e-2\n",
            "exposure_s;kind;file\n0,02;flat;a b.tiff\n0,02;dark;c.tiff\n",
            "# taken today\nfile;kind;photons;exposure_s\na b.tiff;flat;;0,02\nc.tiff;dark;;0,02\n",
            "file,kind,exposure_s\n\"a b.tiff\",flat,\"0,02\"\nc.tiff,dark,\"0,02\"\n",
            "file;exposure_s;kind\na b.tiff;0,02;flat\nc.tiff;0,02;dark\n",
        ] {
            let (folder, path) = written("list.csv", text);
            let frames = read(&path).unwrap_or_else(|error| panic!("{text}: {error}")).frames;
            let shown: Vec<_> = frames.iter().map(|frame| (frame.file.clone(), frame.kind, frame.exposure_s)).collect();
            let frame = |file: &str, kind| (folder.path().join(file), Some(kind), Some(0.02));
            assert_eq!(shown, [frame("a b.tiff", FrameKind::Flat), frame("c.tiff", FrameKind::Dark)], "{text}");
        }
    }

    #[test]
    fn a_frame_is_no_list_of_frames() {
        for (bytes, kind) in [(&b"\x76\x2f\x31\x01\0"[..], "an EXR"), (b"\x89PNG\r\n\x1a\n\0", "a PNG")] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a");
            std::fs::write(&path, bytes).unwrap();
            let said = read(&path).unwrap_err().to_string();
            assert!(
                said.contains(&format!("it is {kind}, a single frame; a list of flats and darks is wanted")),
                "{said}"
            );
        }
    }

    #[test]
    fn times_in_ms_are_told_apart_from_long_darks() {
        let doubt = |rows: &str| {
            let (_folder, path) = written("list.csv", &format!("file,kind,exposure_s\n{rows}"));
            doubt_of_times(&read(&path).unwrap().frames)
        };
        let long = Some("an exposure of 33 s is long; 33 ms is 0.033 s".to_owned());
        assert_eq!(doubt("a,flat,1\nb,flat,33\nc,dark,60\n"), long);
        assert_eq!(doubt("a,flat,0.01\nb,dark,60\n"), None);
        assert_eq!(doubt("a,dark,33\nb,,60\n"), long);
        assert_eq!(doubt("a,dark,0.01\nb,dark,60\n"), None);
    }

    /// What is no number of a frame, and what a column beside it says, is left alone.
    #[test]
    fn notes_are_not_looked_at() {
        for head in [
            "file,note,exposure_s",
            "file,Comments,exposure_s",
            "file,exposure [ms],exposure_s",
            "file,frame number,exposure_s",
        ] {
            let (_folder, path) = written("list.csv", &format!("{head}\na,20,0.02\n"));
            let frames = read(&path).unwrap_or_else(|error| panic!("{head}: {error}")).frames;
            assert_eq!((frames.len(), frames[0].exposure_s), (1, Some(0.02)), "{head}");
        }
        let (_folder, path) =
            written("list.yaml", "- file: a\n  exposure_s: 0.02\n  note: 20\n  date: {taken: 2026}\n");
        assert_eq!(read(&path).unwrap().frames[0].exposure_s, Some(0.02));
    }

    #[test]
    fn mistakes_are_named() {
        for (file, text, wanted) in [
            ("list.csv", "name,kind\na,flat\n", "unknown column `name`"),
            (
                "list.csv",
                "file kind\na flat\n",
                "`file kind`; a list of frames has file, kind, exposure_s, photons, temperature_k, ",
            ),
            ("list.csv", "file,ExposureTime\na,1\n", "level; call this one `exposure_s`, in s"),
            ("list.csv", "file,Exposure (s)\na,1\n", "`Exposure (s)`; a list of frames has file, "),
            (
                "list.csv",
                "file,exposure_ms\na,1\n",
                "level; call this one `exposure_s`, in s (20 ms are 0.02), or leave it out",
            ),
            ("list.csv", "file,temp\na,1\n", "level; call this one `temperature_k` or `temperature_c`"),
            ("list.csv", "file,gain_db\na,1\n", "`gain_db`; a list of frames has file, kind, exposure_s, photons, "),
            ("list.csv", "file,gain_db\na,1\n", "level; leave this one out, or call it `note`"),
            ("list.csv", "file kind\na flat\n", "level, parted by commas, semicolons or tabs"),
            ("list.csv", "file,kind\na,light\n", "`light` in row 1 of `kind` is neither flat nor dark"),
            ("list.csv", "file,exposure_s\na,-1\n", "`exposure_s` of a is -1; it must be above 0"),
            ("list.csv", "file,kind,photons\na,dark,5\n", "a is a dark with 5 photons"),
            ("list.csv", "file,exposure_s\na,fast\n", "`fast` in row 1 of `exposure_s` is not a number"),
            ("list.yaml", "- file: a\n  texp: 1\n", "unknown key `texp`; a list of frames has file, kind, exposure_s"),
            ("list.yaml", "- file: a\n  texp: 1\n", "level; call this one `exposure_s`, in s (20 ms are 0.02)"),
            (
                "list.yaml",
                "- file: a\n  exposure_s: fast\n",
                "`frames[0].exposure_s` is `fast`, not a number (line 3, column 15)",
            ),
            ("data.txt", "n 12 640 480\ni a.png\n", "line 2, `i a.png`: an image stands before any line"),
            ("data.txt", "n 40 640 480\nb 1 2\n", "the bits of a sample are 1 to 16"),
        ] {
            let (_folder, path) = written(file, text);
            let said = read(&path).unwrap_err().to_string();
            assert!(said.contains(wanted), "{said}");
        }
    }
}
