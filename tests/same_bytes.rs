//! The same bytes: on one thread and on seven, through files and pipes, on every set of vector instructions, in every locale;
//! and, as `cargo test --release` runs the same, however the programs were compiled.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs::{self, File};
use std::process::{Output, Stdio};
use support::dng::dng;
use support::workshop::Workshop;

const MATRIX: &str = "\
schema: cyanometer-matrix/1
sensor: kaf-5101ce
method: sky-rad-ls
unit: cd m-2 per (ADU s-1 sr-1)
xyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]]
";

/// Command lines, each on what those before it made, and the samples that they make: those of x86-64 with SSE2, AVX2 and
/// AVX-512, and of aarch64. A change here is a change of samples, which the changelog says first.
const KNOWN: [(&str, &str); 26] = [
    ("render-radiance SAMPLES/skies/sky912.exr --patch 6x5 --cfa grbg -o rates.exr", "blake3:2db94414f43002d2"),
    ("add-noise rates.exr --seed 7 -o noisy.exr", "blake3:c1b8bd99fd9601f5"),
    ("add-noise rates.exr --seed 7 --cte 0.9999 -o moved.exr", "blake3:867567a35a058ca9"),
    ("digitize noisy.exr -o codes.exr", "blake3:3116139da09d2b7f"),
    ("demosaic codes.exr --method bi -o bi.exr", "blake3:04b1bb40c2ba76de"),
    ("demosaic codes.exr --method shti -o shti.exr", "blake3:abfb343751d6b305"),
    ("demosaic codes.exr --method mhc -o mhc.exr", "blake3:17101b09391fabfd"),
    ("demosaic codes.exr --method eci -o eci.exr", "blake3:392fe55602668f70"),
    ("to-xyz eci.exr --matrix matrix.yaml --space lab -o lab.exr", "blake3:5736554b3633d736"),
    ("to-xyz eci.exr --matrix matrix.yaml --space xyz -o xyz.exr", "blake3:4edb1798ad2e123c"),
    ("to-xyz eci.exr --matrix matrix.yaml --space xyy -o xyy.exr", "blake3:2d594a68f3ab0589"),
    ("digitize noisy.exr --compression deflate -o codes.tiff", "blake3:3116139da09d2b7f"),
    ("add-noise rates.exr --seed 7 --frame 1 --poisson gaussian -o gaussian.exr", "blake3:44dcc45f9173b06e"),
    (
        "render-radiance SAMPLES/skies/measured_blue.csv --size 60x50 --vignetting -o scene.exr",
        "blake3:6ddca50f44189121",
    ),
    ("mosaic scene.exr --pattern bggr -o plane.exr", "blake3:74fb497ce12586ed"),
    ("render-radiance --dark --size 228x120 --cfa grbg -o light.exr", "blake3:d31c8a985ad8394e"),
    ("add-noise light.exr --seed 8 -o darkness.exr", "blake3:d71e3e68dc5d07a7"),
    ("digitize darkness.exr -o dark.exr", "blake3:af44f4185dc2b38a"),
    ("correct-frame codes.exr --dark dark.exr -o corrected.exr", "blake3:f8dd1dfab827f191"),
    ("correct-frame codes.exr --cte 0.9999 -o restored.exr", "blake3:63f777cd493035fd"),
    ("import-raw raw.dng --crop full -o raw.exr", "blake3:12c0d74bee5b4e8a"),
    ("digitize noisy.exr -o codes.dng", "blake3:3116139da09d2b7f"),
    ("correct-frame codes.dng --black auto --compression deflate -o black.dng", "blake3:1aaf6729b7f54811"),
    ("import-raw raw.dng -o again.dng", "blake3:12c0d74bee5b4e8a"),
    ("demosaic codes.exr --method eci --sigma -o sigma.exr", PREDICTED),
    ("to-xyz sigma.exr --matrix matrix.yaml --sigma -o sigma-xyz.exr", PREDICTED),
];

/// Samples that are predictions: the same in all circumstances, and as exact as the formulas are now.
const PREDICTED: &str = "blake3:";

/// What may differ from run to run: threads, instructions, language.
const CIRCUMSTANCES: [(usize, &str, &str); 4] =
    [(1, "baseline", "C"), (2, "avx2", "de_DE.UTF-8"), (7, "avx512", "tr_TR.UTF-8"), (3, "", "C.UTF-8")];

fn made(shop: &Workshop, line: &str, (threads, vectors, locale): (usize, &str, &str), input: Stdio) -> Output {
    let mut command = shop.command(&format!("{line} --threads {threads}"));
    command.env("CYANOMETER_VECTORS", vectors).env("LC_ALL", locale).env("LANG", locale);
    let output = command.stdin(input).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line} --threads {threads} on {vectors}: {said}");
    output
}

#[test]
fn samples_are_the_known_ones() {
    let shop = Workshop::new();
    fs::write(shop.path("matrix.yaml"), MATRIX).unwrap();
    let strip: Vec<u8> = (0..60_u16 * 50).flat_map(|i| (i.wrapping_mul(i) % 4001).to_be_bytes()).collect();
    fs::write(shop.path("raw.dng"), dng([60, 50], 16, 1, &strip, &[])).unwrap();
    let mut others = Vec::new();
    for (line, digest) in KNOWN {
        let name = line.split("-o ").nth(1).unwrap();
        for circumstances in CIRCUMSTANCES {
            made(&shop, line, circumstances, Stdio::null());
            let found = shop.sidecar(name).samples.unwrap().digest;
            if !found.starts_with(digest) {
                others.push(format!("{line} in {circumstances:?}: {}", &found[..23]));
            }
        }
    }
    assert!(others.is_empty(), "{}", others.join("\n"));
}

/// All bytes, metadata and all, of what goes through pipes; and the samples of a file are those of the pipe.
#[test]
fn no_circumstance_changes_a_byte() {
    let shop = Workshop::new();
    fs::write(shop.path("matrix.yaml"), MATRIX).unwrap();
    let strip: Vec<u8> = (0..60_u16 * 50).flat_map(|i| (i.wrapping_mul(i) % 4001).to_be_bytes()).collect();
    fs::write(shop.path("raw.dng"), dng([60, 50], 16, 1, &strip, &[])).unwrap();
    for (line, _) in KNOWN {
        let (words, name) = line.split_once(" -o ").unwrap();
        made(&shop, line, CIRCUMSTANCES[0], Stdio::null());
        let format = match name.rsplit_once('.') {
            Some((_, "exr")) => String::new(),
            Some((_, end)) => format!(" --format {end}"),
            None => panic!("{name}"),
        };
        let line = format!("{words}{format}");
        let [first, others @ ..] = CIRCUMSTANCES.map(|now| made(&shop, &line, now, Stdio::null()).stdout);
        assert!(others.iter().all(|other| *other == first), "{line}: bytes hang on circumstances");
        fs::write(shop.path("streamed"), &first).unwrap();
        assert!(same_samples(&shop.read("streamed").0, &shop.read(name).0), "{line}: file and pipe differ");
        // Its first file through the standard input.
        let mut parts = words.split(' ');
        let (program, input) = (parts.next().unwrap(), parts.next().unwrap());
        if input.ends_with(".exr") && shop.path(input).exists() {
            let rest: Vec<&str> = parts.collect();
            let piped = format!("{program} - {}{format}", rest.join(" ")).replace("  ", " ");
            for circumstances in [CIRCUMSTANCES[0], CIRCUMSTANCES[2]] {
                let stdin = Stdio::from(File::open(shop.path(input)).unwrap());
                fs::write(shop.path("streamed"), made(&shop, piped.trim_end(), circumstances, stdin).stdout).unwrap();
                assert!(same_samples(&shop.read("streamed").0, &shop.read(name).0), "{piped}: another than of a file");
            }
        }
    }
}

/// Tables and reports too.
#[test]
fn reports_are_the_same_in_all_circumstances() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 90,900,9000 --size 300x200 --cfa rggb -o rates.exr", &[]);
    shop.run("add-noise rates.exr -o noisy.exr", &[]);
    shop.run("digitize noisy.exr -o codes.exr", &[]);
    shop.run("demosaic codes.exr -o rgb.exr", &[]);
    for line in [
        "measure codes.exr --output-format json --check",
        "measure rgb.exr --output-format csv",
        "measure rgb.exr --patches=20x20 --output-format json",
        "predict-noise --electrons 90,900,9000 --output-format json",
        "predict-noise SAMPLES/skies/measured_blue.csv --sweep 1:40000:9log --output-format csv",
        "fit-matrix SAMPLES/skies/sky912.exr --output-format json",
        "preview rgb.exr -o -",
    ] {
        let [first, others @ ..] = CIRCUMSTANCES.map(|now| made(&shop, line, now, Stdio::null()).stdout);
        assert!(!first.is_empty() && others.iter().all(|other| *other == first), "{line}");
    }
}

fn same_samples(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}
