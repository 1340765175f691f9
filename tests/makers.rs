//! The makers' own raw formats through `import-raw`: a small NEF, whole, damaged, and among others.

#![cfg(feature = "makers-raw")]
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::levels::BlackLevel;
use cyanometer::cfa::{CfaPattern, FilterArray};
use cyanometer::stream::MemoryFrame;
use std::fs;
use support::bounds::{Bounded, memory_for};
use support::dng::dng;
use support::makers::nef;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

const SIZE: [u32; 2] = [64, 48];

fn codes() -> Vec<u16> {
    (0..64_u16 * 48).map(|i| (i.wrapping_mul(977) ^ i >> 3) & 0xEFF).collect()
}

fn shop() -> Workshop {
    let shop = Workshop::new();
    fs::write(shop.path("a.nef"), nef(SIZE, &codes())).unwrap();
    shop
}

/// rawler's table for the D700: the active area without two columns at each side, the matrices of which D65's is used alone where
/// the white is near; black 0 and white 3972 of 12 bits.
#[test]
fn each_part_comes_with_its_place_pattern_and_levels() {
    let shop = shop();
    let codes = codes();
    for (part, [left, top, width, height]) in
        [("active", [2, 0, 60, 48]), ("full", [0, 0, 64, 48]), ("default", [15, 6, 32, 36])]
    {
        for line in [
            format!("import-raw a.nef --crop {part} -o out.exr"),
            format!("import-raw a.nef --crop {part} -o out.tiff"),
        ] {
            shop.run(&line, &[]);
            let MemoryFrame { samples, header, .. } = shop.frame(line.rsplit(' ').next().unwrap());
            let rows = (top..top + height).flat_map(|y| &codes[y * 64 + left..][..width]);
            assert!(samples.iter().copied().eq(rows.map(|code| f32::from(*code))), "{line}");
            assert_eq!(header.geometry.origin.map(|place| usize::try_from(place).unwrap()), [left, top]);
            let metadata = header.metadata;
            assert_eq!(metadata.cfa, Some(FilterArray::Bayer(CfaPattern::Rggb)));
            assert_eq!(metadata.black_level_adu, Some(BlackLevel::Uniform(0.0)));
            assert_eq!(metadata.white_level_adu, Some(3972.0.into()));
            let exposure = metadata.exposure.unwrap();
            assert_eq!((exposure.exposure_s, exposure.f_number), (0.004, 5.6));
            assert!(metadata.relative_matrix.is_some());
        }
    }
    let piped = shop.run("import-raw --crop full", &nef(SIZE, &codes));
    fs::write(shop.path("piped.exr"), piped).unwrap();
    shop.run("import-raw a.nef --crop full -o full.exr", &[]);
    assert_eq!(shop.read("piped.exr").0, shop.read("full.exr").0);
    let said = shop.attempt("import-raw a.nef -v -o out.exr", &[]).stderr;
    let said = String::from_utf8(said).unwrap();
    for note in ["it is of a Nikon D700", "its Orientation, ", "of 64x48 stored samples"] {
        assert!(said.contains(note), "{said}");
    }
    assert_eq!(shop.sidecar("out.exr").iso_speed, Some(200.0));
}

/// The import goes on like any frame, by the camera's own matrix.
#[test]
fn an_import_goes_through_the_chain() {
    let shop = shop();
    shop.run("import-raw a.nef -o plane.dng --write-matrix m.yaml", &[]);
    shop.run("demosaic plane.dng --method bi -o rgb.exr", &[]);
    shop.run("to-xyz rgb.exr --quiet -o own.exr", &[]);
    shop.run("to-xyz rgb.exr --matrix m.yaml -o file.exr", &[]);
    assert_eq!(shop.frame("own.exr").samples, shop.frame("file.exr").samples);
    // White by the matrix is what the multipliers make equal.
    let matrix = shop.frame("plane.dng").header.metadata.relative_matrix.unwrap();
    let white: Vec<f64> = matrix.xyz_from_camera.iter().map(|row| row[0] / 2.0 + row[1] + row[2] / 1.5).collect();
    let sum: f64 = white.iter().sum();
    assert!((white[0] / sum - matrix.white_xy[0]).abs() < 1e-6 && (white[1] / sum - matrix.white_xy[1]).abs() < 1e-6);
}

#[test]
fn several_files_are_imported_at_once() {
    let shop = shop();
    fs::write(shop.path("b.dng"), dng([12, 10], 16, 1, &[7; 240], &[])).unwrap();
    fs::create_dir(shop.path("out")).unwrap();
    shop.run("import-raw a.nef b.dng -o out/ --format tiff", &[]);
    shop.run("import-raw a.nef -o alone.tiff", &[]);
    let [together, alone] = ["out/a.tiff", "alone.tiff"].map(|name| shop.frame(name));
    assert_eq!((together.samples, together.header.metadata), (alone.samples, alone.header.metadata));
    assert_eq!(shop.frame("out/b.tiff").samples, [f32::from(0x0707_u16); 120]);
    // One that fails does not stop the others.
    fs::write(shop.path("c.nef"), b"MM\0*").unwrap();
    let done = shop.attempt("import-raw c.nef a.nef b.dng none.nef -o {stem}.exr", &[]);
    let said = String::from_utf8(done.stderr).unwrap();
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!((done.status.code(), lines.len()), (Some(BAD_DATA), 3), "{said}");
    assert!(
        lines[0].starts_with("import-raw: c.nef: ") && lines[1].starts_with("import-raw: none.nef: cannot open"),
        "{said}"
    );
    assert_eq!(lines[2], "import-raw: 2 of 4 inputs failed; the others are done");
    assert!(shop.path("a.exr").exists() && shop.path("b.exr").exists() && !shop.path("c.exr").exists());
    for (line, wanted) in [
        (
            "import-raw a.nef b.dng -o x.tiff",
            "x.tiff: what is made of a.nef and of b.dng would both go there; give -o DIR/",
        ),
        ("import-raw a.nef b.dng -o {stem}.dng", "b.dng: it is the same file as the input b.dng"),
    ] {
        let done = shop.attempt(line, &[]);
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(said.contains(wanted), "{line}: {said}");
        assert_eq!(done.status.code(), Some(if line.ends_with("{stem}.dng") { BAD_DATA } else { BAD_USAGE }), "{said}");
    }
}

#[test]
fn other_programs_say_who_reads_it() {
    let shop = shop();
    let done = shop.attempt("measure a.nef", &[]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(said, "measure: a.nef: it is a Nikon NEF, a maker's own raw format; run `import-raw` first\n");
}

/// A file cut at any place, and with bytes changed: a frame or one line, in bounds.
#[test]
fn damaged_files_are_a_frame_or_one_line() {
    let shop = shop();
    let whole = nef(SIZE, &codes());
    let attempt = |bytes: &[u8]| {
        fs::write(shop.path("d.nef"), bytes).unwrap();
        drop(fs::remove_file(shop.path("d.exr")));
        let memory = memory_for(bytes.len() as u64);
        let run = Bounded { shop: &shop, line: "import-raw d.nef -o d.exr", piped: None, memory };
        run.run().unwrap_or_else(|what| panic!("{what}"))
    };
    for end in (0..whole.len()).step_by(499).chain([whole.len() - 1]) {
        let done = attempt(&whole[..end]);
        assert_eq!(done.status.code(), Some(BAD_DATA), "{end}");
    }
    // All that is not the plane is before it.
    let begin = whole.len() - 64 * 48 * 3 / 2;
    let mut random = 7_u32;
    for place in (0..begin).step_by(11) {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let mut changed = whole.clone();
        changed[place] = [0, 255, changed[place] ^ 128, random.to_be_bytes()[0]][place % 4];
        attempt(&changed);
    }
}
