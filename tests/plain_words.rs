//! Complaints about damaged files and options are in plain words: none is in those of the language the programs are made of.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::characterization::CameraMatrix;
use cyanometer::formats::keys::KeyPage;
use cyanometer::formats::yaml::{parse_matrix, parse_metadata, parse_sensor, parse_strict};
use cyanometer::metadata::METADATA_TEMPLATE;
use cyanometer::names::Named;
use support::TREE;
use support::workshop::{BAD_DATA, Workshop};

/// What no user should have to know.
const FOREIGN: [&str; 31] = [
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
    "did not find",
    "mapping values",
    "while parsing",
    "while scanning",
    "cannot start any token",
    "end of stream",
    "expected one of",
    "recursion limit",
];

/// Lines that are no YAML, or none that is meant.
const NO_YAML: [&str; 17] = [
    "key value",
    "\tkey: 1",
    "key: 'x",
    "key: \"x",
    "key: [1",
    "key: {a: 1",
    "key: @x",
    "key: `x`",
    "key: a: b",
    "- 1",
    "key: \"\\q\"",
    "key: *x",
    "key: - 1",
    "%TAG",
    "key: 'a' b",
    "<<: 1",
    "key: ]",
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
fn what_is_no_yaml_is_refused_in_plain_words() {
    let mut refused = 0;
    for page in KeyPage::ALL {
        let lines: Vec<&str> = page.template().lines().collect();
        for index in 0..lines.len() {
            for wrong in NO_YAML {
                let mut lines = lines.clone();
                lines[index] = wrong;
                let text = lines.join("\n");
                let complaint = match page {
                    KeyPage::Sensor => parse_sensor("s.yaml", text.as_bytes()).err(),
                    KeyPage::Matrix => parse_matrix("m.yaml", text.as_bytes()).err(),
                    KeyPage::Metadata => parse_metadata("f.yaml", &text).err(),
                };
                if let Some(complaint) = complaint {
                    is_plain(&complaint.to_string(), &text);
                    refused += 1;
                }
            }
        }
    }
    assert!(refused > 500, "{refused}");
}

#[test]
fn files_in_place_of_others_are_called_by_their_kind() {
    let shop = Workshop::new();
    for page in ["sensor", "matrix"] {
        let text = shop.run(&format!("cyanometer template {page}"), &[]);
        std::fs::write(shop.path(&format!("{page}.yaml")), text).unwrap();
    }
    let sensor = String::from_utf8(shop.bytes("sensor.yaml")).unwrap();
    let curves = sensor.replace("# response:", "response:").replace("#   quantum_efficiency", "  quantum_efficiency");
    std::fs::write(shop.path("curves.yaml"), curves).unwrap();
    std::fs::write(shop.path("factor.csv"), "wavelength (nm),radiance x1000 [W m-2 sr-1 nm-1]\n400,1\n700,1\n")
        .unwrap();
    for (line, wanted) in [
        (
            "predict-noise --electrons 1,2,3 --sensor matrix.yaml",
            "matrix.yaml: it is a matrix file, for --matrix; a sensor file",
        ),
        (
            "predict-noise --electrons 1,2,3 --matrix sensor.yaml",
            "sensor.yaml: it is a sensor file, for --sensor; a matrix file",
        ),
        (
            "predict-noise --electrons 1,2,3 --sensor curves.yaml",
            "curves.yaml: it names a file that is not read: qe.csv: cannot open",
        ),
        ("render-radiance factor.csv -o no.exr", "`radiance x1000 [W m-2 sr-1 nm-1]`, a radiance beside a factor"),
    ] {
        let done = shop.attempt(line, &[]);
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.code() == Some(BAD_DATA) && said.contains(wanted), "{line}: {said}");
        is_plain(&said, line);
    }
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
