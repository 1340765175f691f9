//! Files of others, whole and damaged, through every program that reads such a file, as a file and down a pipe: a result or
//! one line, within bounds of time and memory.
//!
//! The files are those of a corpus that is no part of this tree: the directory that `CYANOMETER_CORPUS` names, or
//! `shared/corpus` beside the tree. Its `MANIFEST.csv` says of each what it is. Without it the tests say that they are
//! skipped.
//!
//! Each file goes through `measure` and one other program, in turn, so that each program meets every sixteenth file or so of
//! each kind; with `CYANOMETER_CORPUS_ALL` set, through all.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::formats::input::{FrameReader, InputOptions};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use support::TREE;
use support::bounds::{Bounded, memory_for};
use support::workshop::Workshop;

/// A file of the corpus.
struct Entry {
    path: PathBuf,
    /// `exr`, `tiff`, `dng` or `yaml`.
    kind: String,
    /// What the manifest expects of a reader.
    expected: String,
}

/// The files that the manifest lists; none, and a word about it, where there is no corpus.
fn corpus() -> Vec<Entry> {
    let named = std::env::var_os("CYANOMETER_CORPUS").map(PathBuf::from);
    let beside = Path::new(TREE).ancestors().skip(1).map(|above| above.join("shared/corpus"));
    let found = named.into_iter().chain(beside).find(|directory| directory.join("MANIFEST.csv").is_file());
    let Some(directory) = found else {
        eprintln!("skipped: there is no corpus; name its directory in CYANOMETER_CORPUS");
        return Vec::new();
    };
    let mut manifest = csv::Reader::from_path(directory.join("MANIFEST.csv")).unwrap();
    let headers = manifest.headers().unwrap().clone();
    let column = |name: &str| headers.iter().position(|header| header == name).unwrap();
    let (file, expected) = (column("file"), column("expected"));
    let entries = manifest.records().map(|record| {
        let record = record.unwrap();
        let kind = record[file].split('/').next().unwrap().to_owned();
        Entry { path: directory.join(&record[file]), kind, expected: record[expected].to_owned() }
    });
    entries.collect()
}

/// Lines for a frame: `IN` is the file, or `-` where it comes down a pipe; `OUT` is the output.
const FRAMES: [&str; 18] = [
    "measure IN --output-format json",
    "measure --patches=8x8 IN --output-format json",
    "measure --metadata codes.exr.yaml IN",
    "preview IN --range 0,1 -o OUT",
    "preview --metadata xyz.exr.yaml IN -o OUT",
    "add-noise --metadata expected.exr.yaml IN -o OUT",
    "digitize --metadata noisy.exr.yaml IN -o OUT",
    "mosaic --metadata codes.exr.yaml IN -o OUT",
    "demosaic --pattern rggb --black 0 IN -o OUT",
    "demosaic --metadata plane.exr.yaml IN -o OUT",
    "correct-frame --metadata plane.exr.yaml --black auto IN -o OUT",
    "correct-frame plane.exr --dark IN -o OUT",
    "to-xyz --metadata rgb.exr.yaml --matrix matrix.yaml IN -o OUT",
    "color-difference IN xyz.exr",
    "color-difference --metadata xyz.exr.yaml IN xyz.exr",
    "render-radiance IN --size 8x6 -o OUT",
    "predict-noise IN",
    "fit-matrix IN -o OUT",
];

/// Lines for raw files, besides those for frames.
const RAWS: [&str; 3] =
    ["import-raw IN -o OUT", "import-raw IN --crop full -o OUT", "import-raw IN --crop default -o OUT"];

/// Lines for text: sensors, matrices, metadata, tables.
const TEXTS: [&str; 9] = [
    "predict-noise --dark --sensor FILE",
    "digitize noisy.exr --sensor FILE -o OUT",
    "render-radiance --electrons 1,2,3 --size 8x6 --sensor FILE -o OUT",
    "measure noisy.exr --metadata IN",
    "add-noise expected.exr --metadata IN -o OUT",
    "preview codes.exr --metadata IN -o OUT",
    "to-xyz rgb.exr --matrix IN -o OUT",
    "predict-noise --electrons 1,2,3 --matrix IN",
    "render-radiance IN --size 8x6 -o OUT",
];

/// What the manifest calls damage and is none here: in a TIFF, what no sample depends on, tags of filter arrays, which is told; in
/// a DNG an array of 3x3 sites, which no camera has but metadata describe, and no tag of DNG, without which it is a plain TIFF.
const UNREAD: [&str; 3] = ["tiff/damaged/self__cfa_", "self__cfa_3x3", "self__no_version"];

/// A line and the file that it is for.
struct Case<'a> {
    entry: &'a Entry,
    line: &'static str,
    number: usize,
}

/// The cases of one set of lines: of each file the first line and one of the others, or all.
fn cases<'a>(entries: &'a [Entry], kinds: &[&str], lines: &[&'static str]) -> Vec<Case<'a>> {
    let all = std::env::var_os("CYANOMETER_CORPUS_ALL").is_some();
    let mut cases = Vec::new();
    for (place, entry) in entries.iter().filter(|entry| kinds.contains(&entry.kind.as_str())).enumerate() {
        let turn = 1 + place % (lines.len() - 1);
        for (at, line) in lines.iter().enumerate() {
            if all || at == 0 || at == turn {
                cases.push(Case { entry, line, number: cases.len() });
            }
        }
    }
    cases
}

/// Runs a case by file and by pipe; says what is not as it should be.
fn check(shop: &Workshop, case: &Case<'_>) -> Vec<String> {
    let path = &case.entry.path;
    let memory = memory_for(fs::metadata(path).unwrap().len());
    let file = path.display().to_string();
    let out = |route: &str| {
        format!("out{}-{route}.{}", case.number, if case.line.starts_with("preview") { "png" } else { "exr" })
    };
    let spelled = |input: &str, route: &str| {
        let line = case.line.replace("IN", input).replace("FILE", &file);
        line.replace("OUT", &out(route))
    };
    let mut wrong = Vec::new();
    let mut done: Vec<Output> = Vec::new();
    for (route, input) in [("file", file.as_str()), ("pipe", "-")] {
        // Sensors have names: they come as files alone.
        if route == "pipe" && case.line.contains("FILE") {
            continue;
        }
        let line = spelled(input, route);
        let run = Bounded { shop, line: &line, piped: (route == "pipe").then_some(path), memory };
        match run.run() {
            Ok(output) => done.push(output),
            Err(what) => wrong.push(what),
        }
        for name in [out(route), format!("{}.yaml", out(route))] {
            drop(fs::remove_file(shop.path(&name)));
        }
    }
    if let [by_file, by_pipe] = &done[..] {
        let said = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
        let same = by_file.status == by_pipe.status && by_file.stdout == by_pipe.stdout;
        // Rows that are stored from bottom to top need a seek; a pipe says what to do instead.
        if !same && !said(by_pipe).contains("name the file instead") {
            let line = spelled(&file, "file");
            wrong.push(format!("{line}: by file {}, by pipe {}", said(by_file), said(by_pipe)));
        }
    }
    let must_fail = case.entry.expected.starts_with("nonzero exit, one-line");
    let is_plain = FRAMES[0] == case.line;
    if is_plain
        && must_fail
        && !UNREAD.iter().any(|part| file.contains(part))
        && done.iter().any(|output| output.status.success())
    {
        wrong.push(format!("{file}: taken, though the manifest wants it refused"));
    }
    if is_plain && case.entry.expected == "decode exactly" {
        let said = done.iter().filter(|output| !output.status.success());
        let said = said.map(|output| String::from_utf8_lossy(&output.stderr).into_owned());
        // Compressions that are not read, or lose something, are refused by name.
        let is_unread = |said: &String| {
            let compression = said.contains("compression");
            compression && ["not read here", "not supported", "unknown kind"].iter().any(|word| said.contains(word))
        };
        wrong.extend(said.filter(|said| !is_unread(said)));
    }
    wrong
}

/// Runs all cases, on as many threads as there are processors.
fn check_all(cases: &[Case<'_>]) {
    let shop = Workshop::with_frames();
    let (next, wrong) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    wrong.lock().unwrap().extend(check(&shop, case));
                }
            });
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

#[test]
fn frames_of_others_give_a_result_or_a_line() {
    let entries = corpus();
    check_all(&cases(&entries, &["exr", "tiff", "dng"], &FRAMES));
}

#[test]
fn raws_of_others_give_a_result_or_a_line() {
    let entries = corpus();
    check_all(&cases(&entries, &["dng"], &RAWS));
}

#[test]
fn texts_of_others_give_a_result_or_a_line() {
    let entries = corpus();
    check_all(&cases(&entries, &["yaml"], &TEXTS));
}

/// Files with a maker's own data, which may name more bytes: a program warns of these.
const PRIVATE: [&str; 1] = ["custom_dir_EXIF_GPS"];

/// Reads all rows of a part of a file.
fn read_whole(path: &Path, part: usize) -> cyanometer::error::Result<()> {
    let options = InputOptions { path: Some(path.to_owned()), part, all_channels: true, ..InputOptions::default() };
    FrameReader::open(&options)?.drain()
}

/// Whether a TIFF has another image, read or not.
fn is_of_several(path: &Path) -> bool {
    !read_whole(path, 1).err().is_some_and(|error| error.to_string().contains("there is no image 1"))
}

/// Of every whole file that is read, bytes behind it are told: directories, parts and levels that nobody asked for belong to it.
#[test]
fn bytes_behind_whole_files_are_told() {
    let directory = tempfile::tempdir().unwrap();
    let longer = directory.path().join("longer");
    let mut read = 0;
    for entry in
        corpus().iter().filter(|entry| entry.kind != "yaml" && entry.path.to_string_lossy().contains("/valid/"))
    {
        if read_whole(&entry.path, 0).is_err() {
            continue;
        }
        read += 1;
        fs::write(&longer, [fs::read(&entry.path).unwrap().as_slice(), b"junk"].concat()).unwrap();
        let told = read_whole(&longer, 0).err().map(|error| error.to_string()).unwrap_or_default();
        let wanted = "behind its last row come bytes that are no part of it; cut them off";
        let has_private = PRIVATE.iter().any(|name| entry.path.to_string_lossy().contains(name));
        let is_warned_of = has_private || entry.kind == "tiff" && is_of_several(&entry.path);
        assert!(told.ends_with(wanted) || is_warned_of && told.is_empty(), "{}: {told}", entry.path.display());
    }
    eprintln!("{read} files");
}
