//! Complaints about damaged files and options are in plain words: none is in those of the language the programs are made of.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

mod support;

use cyanometer::analysis::characterization::CameraMatrix;
use cyanometer::formats::yaml::{parse_metadata, parse_sensor, parse_strict};
use cyanometer::metadata::METADATA_TEMPLATE;
use support::TREE;
use support::workshop::Workshop;

/// What no user should have to know.
const FOREIGN: [&str; 23] = [
    "invalid type",
    "invalid value",
    "invalid length",
    "missing field",
    "unknown variant",
    "unknown field",
    "duplicate field",
    "did not match any variant",
    "expected struct",
    "expected a sequence",
    "a map",
    "untagged",
    "enum",
    "newtype",
    "f64",
    "f32",
    "u32",
    "u64",
    "usize",
    "invalid digit",
    "invalid float literal",
    "deserializ",
    "duplicate entry",
];

/// What stands where something else belongs.
const DAMAGES: [&str; 9] = ["", "many", "-3", "1.5", "[1, 2]", "{a: 1}", "true", "!tag 3", "[[1, 2], [3]]"];

#[track_caller]
fn is_plain(complaint: &str, of: &str) {
    let foreign: Vec<&&str> = FOREIGN.iter().filter(|words| complaint.contains(**words)).collect();
    assert!(foreign.is_empty(), "{of}: `{complaint}` has {foreign:?}");
}

/// Each value of a document in turn replaced by each of the damages, and each line left out.
fn damaged(text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().collect();
    let with = |index: usize, line: &str| {
        let mut lines = lines.clone();
        lines[index] = line;
        lines.join("\n")
    };
    let mut all = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let Some((key, _)) = line.split_once(':').filter(|_| !line.trim_start().starts_with('#')) else { continue };
        all.extend(DAMAGES.map(|damage| with(index, &format!("{key}: {damage}"))));
        all.push(with(index, ""));
        all.push(with(index, &format!("{line}\n{line}")));
    }
    assert!(all.len() > 30);
    all
}

/// The template of metadata with all its examples in use.
fn metadata() -> String {
    let is_example = |line: &str| {
        let key = line.trim_start().split(':').next().unwrap_or_default();
        line.starts_with("  ")
            || line.contains(": ") && key.chars().all(|c| c.is_ascii_lowercase() || c == '_')
            || line == "sensor:"
            || line == "relative_matrix:"
    };
    let used = METADATA_TEMPLATE.lines().map(|line| match line.strip_prefix("# ") {
        Some(example) if is_example(example) => format!("{example}\n"),
        _ => format!("{line}\n"),
    });
    used.collect()
}

#[test]
fn damaged_files_are_refused_in_plain_words() {
    let mut refused = 0;
    let mut check = |complaint: Option<String>, text: &str| {
        if let Some(complaint) = complaint {
            is_plain(&complaint, text);
            refused += 1;
        }
    };
    for text in damaged(&metadata()) {
        check(parse_metadata("m.yaml", &text).err().map(|error| error.to_string()), &text);
    }
    let sensor = std::fs::read_to_string(format!("{TREE}/sample_data/sensors/kaf-5101ce.yaml")).unwrap();
    for text in damaged(&sensor) {
        check(parse_sensor("s.yaml", text.as_bytes()).err().map(|error| error.to_string()), &text);
    }
    let matrix = "schema: cyanometer-matrix/1\nsensor: x\nxyz_from_camera: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n\
                  white_xy: [0.3, 0.3]\ncondition: 3\nrank: 3\n";
    for text in damaged(matrix) {
        check(parse_strict::<CameraMatrix>("x.yaml", text.as_bytes()).err().map(|error| error.to_string()), &text);
    }
    assert!(refused > 300, "{refused}");
}

#[test]
fn options_are_refused_in_plain_words() {
    let workshop = Workshop::new();
    for line in [
        "render-radiance --dark --threads x",
        "render-radiance --dark --threads -1",
        "render-radiance --dark --threads 1.5",
        "render-radiance --dark --part x",
        "render-radiance --dark --part 99999999999999999999999",
        "render-radiance sky.csv --sample 1,5",
        "render-radiance --dark --exposure x",
        "add-noise --seed x",
        "add-noise --seed 1e3",
        "add-noise --seed 99999999999999999999999",
        "digitize --bits x",
        "digitize --bits 300",
        "measure --level x",
        "fit-matrix --corners 1,2",
        "predict-noise --sweep x",
    ] {
        let output = workshop.attempt(line, b"");
        assert!(!output.status.success(), "{line}");
        is_plain(&String::from_utf8_lossy(&output.stderr), line);
    }
}
