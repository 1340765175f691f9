//! Frames in and out of stacks on disk: the same bytes, whole or not at all, and nothing damaged that is not told.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs;
use std::path::{Path, PathBuf};
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

fn said(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Five exposures, with some photosites at full well, at every stage: electrons, codes, planes, demosaicked with standard deviations and
/// marks, XYZ with covariances and marks.
fn stages(shop: &Workshop) -> Vec<Vec<u8>> {
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    shop.run("render-radiance --electrons 9000,39950,5000 --size 24x16 -o scene.exr", &[]);
    let mut stages = Vec::new();
    let mut frames = Vec::new();
    for line in [
        "add-noise scene.exr --seed 5 --frames 3..8",
        "digitize",
        "mosaic",
        "demosaic --sigma",
        "to-xyz --matrix matrix.yaml --sigma",
    ] {
        let output = shop.attempt(line, &frames);
        assert!(output.status.success(), "{line}: {}", said(&output));
        frames = output.stdout;
        stages.push(frames.clone());
    }
    stages
}

/// All files below a directory.
fn files_below(directory: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(files_below(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

/// Streams come out to the byte as they went in, at every stage, compressed or not, and some of them alone as they were.
#[test]
fn streams_come_out_as_they_went_in() {
    let shop = Workshop::new();
    for (index, frames) in stages(&shop).iter().enumerate() {
        for options in ["", " --compression deflate"] {
            let name = format!("s{index}.zarr");
            shop.run(&format!("stack-frames -o {name}{options}"), frames);
            assert!(shop.run(&format!("stack-frames {name}"), &[]) == *frames, "{name}{options}");
        }
    }
    // Frames that are chosen are those that follow one another in the stream, whose last knows that none follows.
    let some = shop.run("stack-frames s2.zarr --frames 1..3", &[]);
    shop.run("stack-frames s2.zarr -o all-{frame}.exr", &[]);
    shop.run("stack-frames -o some-{frame}.exr", &some);
    assert!(["4", "5"].iter().all(|n| shop.bytes(&format!("all-{n}.exr")) == shop.bytes(&format!("some-{n}.exr"))));
    // Stacks go into stacks.
    shop.run("stack-frames s2.zarr -o copy.zarr --compression deflate", &[]);
    let files = |name: &str| -> Vec<Vec<u8>> {
        files_below(&shop.path(name)).iter().map(|path| fs::read(path).unwrap()).collect()
    };
    assert!(files("s2.zarr").len() == 7 && files("s2.zarr") == files("copy.zarr"));
}

/// Files come out as they went in, sidecars and what they counted included.
#[test]
fn files_come_out_as_they_went_in() {
    let shop = Workshop::new();
    let stages = stages(&shop);
    fs::create_dir(shop.path("in")).unwrap();
    fs::create_dir(shop.path("out")).unwrap();
    for frames in [&stages[1], &stages[4]] {
        shop.attempt("stack-frames -o in/a{frame}.exr", frames);
        shop.attempt("digitize --bits 12 -o in/a{frame}.exr", &stages[0]);
        shop.run("stack-frames in/*.exr -o s.zarr", &[]);
        shop.run("stack-frames s.zarr -o out/{stem}.exr", &[]);
        for path in files_below(&shop.path("in")) {
            let other = shop.path("out").join(path.file_name().unwrap());
            assert!(fs::read(&path).unwrap() == fs::read(other).unwrap(), "{}", path.display());
        }
    }
    let full = shop.sidecar("out/a4.exr").samples.unwrap().clipped_high.unwrap();
    assert!(full > 0);
    // A frame of a stack has the marks and layers that programs look for.
    shop.run("stack-frames -o xyz.zarr", &stages[4]);
    shop.run("stack-frames -o xyz.exr", &shop.run("stack-frames xyz.zarr --frames 0..1", &[]));
    assert_eq!(shop.frame("xyz.exr").header.geometry.channels, ["R", "G", "B"]);
    let report = shop.attempt("measure xyz.exr --output-format json", &[]);
    assert!(said(&report).contains("pixels were made of saturated samples") && report.status.success());
    assert!(String::from_utf8(report.stdout).unwrap().contains("sigma"));
}

/// f16 in a stack is what it is in an EXR; what a type does not hold is refused.
#[test]
fn samples_keep_what_their_type_holds() {
    let shop = Workshop::new();
    let stages = stages(&shop);
    shop.run("stack-frames -o h.zarr --sample-type f16", &stages[0]);
    shop.run("stack-frames h.zarr -o h{index}.exr", &[]);
    shop.run("stack-frames -o e{index}.exr --sample-type f16", &stages[0]);
    for index in 0..5 {
        assert!(shop.read(&format!("h{index}.exr")).0 == shop.read(&format!("e{index}.exr")).0);
    }
    let refused = shop.attempt("stack-frames -o u.zarr --sample-type u16", &stages[3]);
    assert!(said(&refused).contains("is no whole number from 0 to 65535"), "{}", said(&refused));
    shop.attempt("render-radiance --electrons 70000,70000,70000 --size 4x4 -o bright.exr", &[]);
    let refused = shop.attempt("stack-frames bright.exr -o u.zarr --sample-type f16", &[]);
    assert!(said(&refused).contains("would become infinite as f16"), "{}", said(&refused));
    assert!(!shop.path("u.zarr").exists());
}

/// A stack has its name when it is whole. What was there stays until then, and what is no stack stays.
#[test]
fn a_stack_is_whole_or_not_at_all() {
    let shop = Workshop::new();
    let stages = stages(&shop);
    shop.run("stack-frames -o s.zarr", &stages[1]);
    let before = shop.files();
    let cut = &stages[2][..stages[2].len() - 100];
    assert_eq!(shop.attempt("stack-frames -o s.zarr", cut).status.code(), Some(BAD_DATA));
    assert_eq!(shop.files(), before);
    assert!(shop.run("stack-frames s.zarr", &[]) == stages[1]);
    shop.run("stack-frames -o s.zarr", &stages[2]);
    assert!(shop.run("stack-frames s.zarr", &[]) == stages[2]);
    assert_eq!(shop.files(), before);
    fs::create_dir(shop.path("mine.zarr")).unwrap();
    fs::write(shop.path("mine.zarr/notes"), "mine").unwrap();
    for (line, status, wanted) in [
        ("stack-frames -o mine.zarr", BAD_DATA, "a directory is there that is no stack"),
        ("stack-frames -o s.zarr scene.exr none.exr", BAD_DATA, "1 of 2 inputs failed; nothing is made of the others"),
        ("stack-frames s.zarr -o s.zarr", BAD_USAGE, "it is the same file as the input"),
        ("stack-frames s.zarr -o new/s.zarr", BAD_DATA, "there is no directory `new`; make it first"),
        ("stack-frames s.zarr --frames 2..6", BAD_USAGE, "its frames are 0..5; give another --frames"),
        ("stack-frames s.zarr scene.exr", BAD_USAGE, "s.zarr is a stack and scene.exr is none"),
        ("stack-frames scene.exr --frames 0..1", BAD_USAGE, "leave out --frames"),
        ("stack-frames none.zarr", BAD_DATA, "none.zarr: cannot open: no such file or directory"),
        ("stack-frames mine.zarr", BAD_DATA, "it is neither a stack nor another array of Zarr"),
        ("stack-frames -o a.zarr --format exr", BAD_USAGE, "leave out --format"),
        ("stack-frames -o a.zarr --viewable", BAD_USAGE, "leave out --viewable"),
        ("stack-frames -o a.zarr --resume", BAD_USAGE, "leave out --resume"),
        ("stack-frames -o a.zarr --compression zip", BAD_USAGE, "give another --compression"),
        ("stack-frames -o {stem}.zarr", BAD_USAGE, "which has a plain name"),
        ("stack-frames s.zarr scene.exr -o a.zarr", BAD_USAGE, "take one kind at a time"),
        ("stack-frames -o codes.exr s.zarr", BAD_USAGE, "another frame of this run went there"),
        ("measure s.zarr", BAD_DATA, "`stack-frames` takes them out"),
    ] {
        let output = shop.attempt(line, &stages[1]);
        assert_eq!(output.status.code(), Some(status), "{line}: {}", said(&output));
        assert!(said(&output).contains(wanted), "{line}: {}", said(&output));
    }
    // One frame of the last went out before the second met it.
    fs::remove_file(shop.path("codes.exr")).unwrap();
    fs::remove_file(shop.path("codes.exr.yaml")).unwrap();
    assert_eq!(
        shop.files(),
        [&["mine.zarr".to_owned()], &before[..]]
            .concat()
            .iter()
            .cloned()
            .collect::<std::collections::BTreeSet<_>>()
            .into_iter()
            .collect::<Vec<_>>()
    );
    let mixed = [stages[1].clone(), stages[2].clone()].concat();
    let output = shop.attempt("stack-frames -o a.zarr", &mixed);
    assert!(said(&output).contains("frames of a stack have one form"), "{}", said(&output));
}

/// A file of a stack that is gone, or has another bit or byte, is an error, but for what describes arrays, which has no digest of its
/// own: there nothing but the description of a frame can be another.
#[test]
fn damage_is_told() {
    let shop = Workshop::new();
    let stages = stages(&shop);
    let frames = &stages[4];
    for options in ["", " --compression deflate"] {
        shop.run(&format!("stack-frames -o s.zarr{options}"), frames);
        let files = files_below(&shop.path("s.zarr"));
        assert_eq!(files.len(), 13, "{files:?}");
        let mut state = 1_u64;
        let mut draw = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            usize::try_from(state >> 33).unwrap() % below
        };
        for path in &files {
            let whole = fs::read(path).unwrap();
            let what = path.strip_prefix(shop.path("s.zarr")).unwrap().display().to_string();
            let is_description = what.ends_with("zarr.json");
            fs::remove_file(path).unwrap();
            let output = shop.attempt("stack-frames s.zarr", &[]);
            // Names of channels are for others; without their description sigma and mask are not known to be there but by names.
            let is_needed = !what.starts_with("channel") && !what.starts_with("layer");
            assert_eq!(output.status.success(), !is_needed, "{what} is gone: {}", said(&output));
            for round in 0..12 {
                let mut other = whole.clone();
                let at = draw(other.len());
                match round % 3 {
                    0 => other.truncate(at),
                    1 => other[at] ^= 1 << draw(8),
                    _ => other[at] = other[at].wrapping_add(1 + u8::try_from(draw(255)).unwrap()),
                }
                fs::write(path, other).unwrap();
                let output = shop.attempt("stack-frames s.zarr", &[]);
                let code = output.status.code().unwrap_or(-1);
                assert!([0, BAD_USAGE, BAD_DATA].contains(&code), "{what}, byte {at}: {code} {}", said(&output));
                let is_same = output.stdout == *frames;
                let is_told = code != 0 && !said(&output).is_empty();
                assert!(is_same || is_told || is_description, "{what}, round {round}, byte {at}: {}", said(&output));
            }
            fs::write(path, whole).unwrap();
        }
        assert!(shop.run("stack-frames s.zarr", &[]) == *frames);
    }
}
