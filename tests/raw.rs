//! Raw files of cameras through the programs: `import-raw`, and the others on the raw itself.
//!
//! The frames of a camera are no part of this tree: the tests look for `shared/data/raw` beside it, and say where they are
//! skipped.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::stream::MemoryFrame;
use std::fs;
use std::path::{Path, PathBuf};
use support::TREE;
use support::dng::{dng, dng_as_told, dng_with_ratios};
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

/// A DNG of 12x10 samples of 16 bits, whose active area begins at column 3, row 2.
fn small() -> Vec<u8> {
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (300 + i * i % 977).to_le_bytes()).collect();
    let more: [(u16, &[u32]); 6] = [
        (50713, &[2, 2]),
        (50714, &[64, 65, 66, 67]),
        (50717, &[4000]),
        (50719, &[1, 1]),
        (50720, &[6, 4]),
        (50829, &[2, 3, 10, 12]),
    ];
    dng([12, 10], 16, 1, &strip, &more)
}

#[test]
fn each_part_comes_with_its_place_and_levels() {
    let shop = Workshop::new();
    fs::write(shop.path("raw.dng"), small()).unwrap();
    let whole: Vec<f32> = (0..120_u16).map(|i| f32::from(300 + i * i % 977)).collect();
    for (part, [left, top, width, height]) in
        [("active", [3, 2, 9, 8]), ("full", [0, 0, 12, 10]), ("default", [4, 3, 6, 4])]
    {
        for file in ["out.tiff", "out.exr"] {
            shop.run(&format!("import-raw raw.dng --crop {part} -o {file}"), &[]);
            let MemoryFrame { samples, header, .. } = shop.frame(file);
            let geometry = header.geometry;
            let rows = (top..top + height).flat_map(|y| whole[y * 12 + left..][..width].to_vec());
            assert_eq!(samples, rows.collect::<Vec<_>>(), "{part} {file}");
            assert_eq!((geometry.width, geometry.height), (width, height));
            assert_eq!(geometry.origin.map(|place| usize::try_from(place).unwrap()), [left, top]);
        }
        let sidecar = String::from_utf8(shop.bytes("out.tiff.yaml")).unwrap();
        // The pattern and the levels at the sensor's corner: those of the active area, an odd number of columns further on.
        for line in ["quantity: adu", "cfa: grbg", "white_level_adu: 4000", "program: import-raw"] {
            assert!(sidecar.contains(line), "{line} is not in\n{sidecar}");
        }
        let levels: Vec<&str> = sidecar.split("black_level_adu:").nth(1).unwrap().lines().take(5).collect();
        let levels: String = levels.concat().chars().filter(|c| c.is_ascii_digit() || *c == '.').collect();
        assert!(levels.replace(".0", "").starts_with("65646766"), "{sidecar}");
    }
}

/// The border is that of each frame, of several too: levels are the means of its masked photosites, by site.
#[test]
fn the_border_of_a_frame_tells_its_black_level() {
    let shop = Workshop::new();
    let sample = |frame: u16, i: u16| 300 + 50 * frame + i * i % 97;
    for frame in 0..2 {
        let strip: Vec<u8> = (0..120).flat_map(|i| sample(frame, i).to_le_bytes()).collect();
        let areas: [(u16, &[u32]); 4] =
            [(50714, &[0]), (50717, &[4000]), (50829, &[0, 4, 10, 12]), (50830, &[0, 0, 10, 4])];
        fs::write(shop.path(&format!("raw{frame}.dng")), dng([12, 10], 16, 1, &strip, &areas)).unwrap();
    }
    shop.run("import-raw raw0.dng raw1.dng --crop full -o {stem}.exr", &[]);
    shop.run("correct-frame raw0.exr raw1.exr --black border -o {stem}-less.exr", &[]);
    for frame in 0..2 {
        let whole: Vec<f64> = (0..120).map(|i| f64::from(sample(frame, i))).collect();
        let of_site = |i: usize| (i / 12 % 2, i % 12 % 2);
        let level = |site| {
            let masked: Vec<f64> = (0..120).filter(|i| i % 12 < 4 && of_site(*i) == site).map(|i| whole[i]).collect();
            masked.iter().sum::<f64>() / masked.len() as f64
        };
        let samples = shop.frame(&format!("raw{frame}-less.exr")).samples;
        for (i, sample) in samples.iter().enumerate() {
            // Singles of a few hundred.
            assert!((f64::from(*sample) - (whole[i] - level(of_site(i)))).abs() < 1e-4, "{frame} {i}");
        }
    }
}

/// Its black level is 0 by the specification, and what its border reads is something else as likely as not.
#[test]
fn masked_photosites_without_a_black_level_are_told() {
    let shop = Workshop::new();
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (300 + i).to_le_bytes()).collect();
    let said = |name: &str, areas: &[(u16, &[u32])]| {
        fs::write(shop.path(name), dng_as_told([12, 10], &strip, areas)).unwrap();
        String::from_utf8(shop.attempt(&format!("import-raw {name} -o out.exr"), &[]).stderr).unwrap()
    };
    let [white, active, masked]: [(u16, &[u32]); 3] =
        [(50717, &[4000]), (50829, &[0, 4, 10, 12]), (50830, &[0, 0, 10, 4])];
    assert!(said("masked.dng", &[white, active, masked]).contains("it has masked photosites and no BlackLevel"));
    assert_eq!(said("told.dng", &[(50714, &[256]), white, active, masked]), "");
    assert!(said("whole.dng", &[white]).contains("it has no BlackLevel, which by DNG is then 0; give the black level"));
}

/// Masks beside the active rows alone tell no row above them, and a rectangle leaves those out.
#[test]
fn rows_without_masked_photosites_are_left_out_by_a_rectangle() {
    let shop = Workshop::new();
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (300 + i % 5).to_le_bytes()).collect();
    let areas: [(u16, &[u32]); 4] =
        [(50714, &[0]), (50717, &[4000]), (50829, &[2, 4, 10, 12]), (50830, &[2, 0, 10, 4])];
    fs::write(shop.path("raw.dng"), dng([12, 10], 16, 1, &strip, &areas)).unwrap();
    shop.run("import-raw raw.dng --crop full -o raw.exr", &[]);
    let said = shop.said("correct-frame raw.exr --black rows -o out.exr", BAD_DATA);
    let wanted =
        "not all of its rows have masked photosites, and those that have lie in the rectangle 0,2,12,8; give --crop";
    assert!(said.contains(wanted), "{said}");
    shop.run("correct-frame raw.exr --crop 0,2,12,8 --black rows -o out.exr", &[]);
}

/// Levels above the directory of the raw image do not count; tags that give samples of a TIFF another meaning neither.
#[test]
fn tags_that_do_not_count_are_told() {
    let shop = Workshop::new();
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (300 + i).to_le_bytes()).collect();
    let whole = dng([12, 10], 16, 1, &strip, &[(50712, &[0, 10, 20])]);
    let change = |bytes: &mut [u8], from: &[u8], to: &[u8]| {
        let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
        bytes[at..at + to.len()].copy_from_slice(to);
    };
    // DNGVersion becomes a tag that nobody knows.
    let mut tiff = whole.clone();
    change(&mut tiff, &50706_u16.to_le_bytes(), &65000_u16.to_le_bytes());
    fs::write(shop.path("raw.tif"), &tiff).unwrap();
    let said = shop.said("preview raw.tif -o out.png", 0);
    assert!(said.contains("raw.tif: its LinearizationTable is not applied: it has no DNGVersion"), "{said}");
    let gray = [[6, 1, 4, 0, 1, 0, 0, 0].as_slice(), &32803_u32.to_le_bytes()].concat();
    change(&mut tiff, &gray, &[[6, 1, 4, 0, 1, 0, 0, 0].as_slice(), &0_u32.to_le_bytes()].concat());
    fs::write(shop.path("white.tif"), &tiff).unwrap();
    let said = shop.said("preview white.tif -o white.png", 0);
    assert!(said.contains("its PhotometricInterpretation is 0, by which white is 0"), "{said}");
}

/// What is made of the raw itself is what is made of the import.
#[test]
fn programs_read_the_raw_as_its_import() {
    let shop = Workshop::new();
    fs::write(shop.path("raw.dng"), small()).unwrap();
    shop.run("import-raw raw.dng -o plane.tiff", &[]);
    for name in ["raw.dng", "plane.tiff"] {
        shop.run(&format!("demosaic {name} --method mhc --black auto -o {name}.exr"), &[]);
    }
    assert_eq!(shop.read("raw.dng.exr").0, shop.read("plane.tiff.exr").0);
    let piped = shop.run("import-raw", &small());
    fs::write(shop.path("piped.exr"), piped).unwrap();
    assert_eq!(shop.read("piped.exr").0, shop.read("plane.tiff").0);
    let verbose = shop.attempt("measure raw.dng -v", &[]);
    let said = String::from_utf8_lossy(&verbose.stderr);
    assert!(said.contains("measure: raw.dng: of 12x10 stored samples, 9x8 from column 3, row 2 are read"), "{said}");
}

/// What is written as a DNG is what is written as an EXR: samples, place and metadata, without the sidecar too.
#[test]
fn frames_come_back_from_a_dng() {
    let shop = Workshop::new();
    shop.run("render-radiance SAMPLES/skies/sky912.exr --patch 3x3 --expose-to 0.8 --cfa gbrg -o rates.exr", &[]);
    shop.run("add-noise rates.exr --seed 7 -o noisy.exr", &[]);
    for (line, options) in [
        ("digitize noisy.exr", ""),
        ("digitize noisy.exr --crop 3,1,29,17", ""),
        ("correct-frame codes.exr --black auto", ""),
        ("correct-frame codes.exr --black auto", " --compression deflate"),
        ("import-raw codes.dng", ""),
    ] {
        if line.contains("codes") {
            shop.run("digitize noisy.exr -o codes.exr", &[]);
            shop.run("digitize noisy.exr -o codes.dng", &[]);
        }
        shop.run(&format!("{line} -o out.exr"), &[]);
        shop.run(&format!("{line}{options} -o out.dng"), &[]);
        let [exr, with_sidecar] = ["out.exr", "out.dng"].map(|name| shop.frame(name));
        fs::rename(shop.path("out.dng"), shop.path("alone.dng")).unwrap();
        let piped = shop.run(&format!("{line}{options} --format dng"), &[]);
        assert!(piped == shop.bytes("alone.dng"), "{line}: file and pipe differ");
        let alone = shop.frame("alone.dng");
        let bits = |frame: &MemoryFrame| frame.samples.iter().map(|sample| sample.to_bits()).collect::<Vec<_>>();
        for frame in [&with_sidecar, &alone] {
            assert!(bits(frame) == bits(&exr), "{line}{options}");
            assert_eq!(frame.header.geometry, exr.header.geometry);
            let mut expected = exr.header.metadata.clone();
            expected.samples.clone_from(&frame.header.metadata.samples);
            assert_eq!(frame.header.metadata, expected, "{line}{options}");
        }
        for name in ["out.exr", "alone.dng"] {
            shop.run(&format!("demosaic {name} --method mhc -o {name}.rgb.exr"), &[]);
        }
        assert_eq!(shop.read("out.exr.rgb.exr").0, shop.read("alone.dng.rgb.exr").0, "{line}{options}");
    }
}

#[test]
fn mistakes_with_raws_are_told() {
    let shop = Workshop::with_frames();
    fs::write(shop.path("raw.dng"), small()).unwrap();
    fs::write(shop.path("short.dng"), &small()[..150]).unwrap();
    fs::write(shop.path("xl.dng"), dng([4, 2], 16, 52546, &[0; 16], &[])).unwrap();
    fs::write(shop.path("a.cr2"), b"II*\0\x10\0\0\0CR\x02\0\0\0\0\0").unwrap();
    shop.run("mosaic codes.exr -o plane.tiff", &[]);
    for (line, status, wanted) in [
        (
            "import-raw codes.exr -o out.exr",
            BAD_DATA,
            "codes.exr: it is no raw file of a camera; the other programs read",
        ),
        ("import-raw plane.tiff -o out.exr", BAD_DATA, "plane.tiff: it is no raw file of a camera; the other programs"),
        ("import-raw short.dng -o out.exr", BAD_DATA, "short.dng: the table of tags lies beyond the end of the file"),
        (
            "import-raw xl.dng -o out.exr",
            BAD_DATA,
            "xl.dng: its raw image is JPEG XL, which is not supported; convert it",
        ),
        ("import-raw a.cr2 -o out.exr", BAD_DATA, "a.cr2: it is a Canon CR2 that cannot be decoded ("),
        (
            "import-raw matrix.yaml -o out.exr",
            BAD_DATA,
            "matrix.yaml: it is neither an EXR nor a DNG nor a PNG nor a FITS nor a TIFF file",
        ),
        (
            "import-raw raw.dng --crop all -o out.exr",
            BAD_USAGE,
            "`all` is no value for --crop <active|full|default|X,Y,W,H>: give active, full, default, or X,Y,W,H",
        ),
        ("import-raw raw.dng -o raw.dng", BAD_USAGE, "raw.dng: "),
        ("import-raw raw.dng --metadata xyz.exr.yaml -o out.exr", BAD_DATA, "raw.dng: its metadata say that it holds"),
        ("measure raw.dng --part 1", BAD_USAGE, "raw.dng: it has no part 1; of a DNG the raw image is part 0"),
    ] {
        let output = shop.attempt(line, &[]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            said.starts_with(&format!("import-raw: {wanted}")) || said.starts_with(&format!("measure: {wanted}")),
            "{said}"
        );
        assert_eq!((output.status.code(), said.lines().count()), (Some(status), 1), "{line}: {said}");
        assert!(!shop.path("out.exr").exists(), "{line}");
    }
}

/// A white level above the largest code marks no sample as saturated; that code itself, or a level below, does.
#[test]
fn a_white_level_that_no_code_reaches_is_told() {
    let shop = Workshop::new();
    let said = |bits: u32, more: &[(u16, &[u32])]| {
        let strip = vec![1; 12 * 10 * bits as usize / 8];
        fs::write(shop.path("raw.dng"), dng([12, 10], bits, 1, &strip, more)).unwrap();
        shop.said("import-raw raw.dng -o plane.exr", 0)
    };
    for (bits, white) in [(12, 4095), (12, 3900), (16, 65_535)] {
        assert_eq!(said(bits, &[(50714, &[64]), (50717, &[white])]), "", "{bits} {white}");
    }
    for (bits, white, largest) in [(12, 16_383, 4095), (16, 70_000, 65_535)] {
        let warning = format!(
            "import-raw: warning: raw.dng: its WhiteLevel, {white}, lies above the largest code of {bits} bits, {largest}: no sample \
             counts as saturated; correct its tags\n"
        );
        assert_eq!(said(bits, &[(50714, &[64]), (50717, &[white])]), warning);
    }
}

/// A DNG of a sensor without a matrix has no colors: it is said once, and not of darks.
#[test]
fn a_dng_without_colors_is_told() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 900,1500,1200 --size 8x6 | mosaic | add-noise -o lit.exr");
    shop.pipe("render-radiance --dark --size 8x6 | mosaic | add-noise -o dark.exr");
    assert_eq!(shop.said("digitize lit.exr -o out.dng", 0), "");
    for name in ["lit.exr", "dark.exr"] {
        let mut frame = shop.frame(name);
        frame.header.metadata.sensor.as_mut().unwrap().xyz_from_camera = None;
        shop.write(name, &frame.header, &frame.samples);
    }
    fs::copy(shop.path("lit.exr"), shop.path("more.exr")).unwrap();
    let said = shop.said("digitize lit.exr more.exr -o {stem}.dng", 0);
    assert!(said.starts_with("digitize: warning: the DNG has no colors (ColorMatrix1, AsShotNeutral)"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert_eq!(shop.said("digitize dark.exr -o out.dng", 0), "");
    assert_eq!(shop.said("digitize lit.exr -o out.tiff", 0), "");
}

/// Ratios as numbers of 32 bits.
fn ratios(numbers: &[u32]) -> Vec<u32> {
    numbers.iter().flat_map(|number| [*number, 10_000]).collect()
}

/// The matrix of the raw goes along to XYZ, or into a file; without one the programs say so.
#[test]
fn a_raw_brings_its_matrix_along() {
    let shop = Workshop::new();
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (300 + i * i % 977).to_le_bytes()).collect();
    let matrix = ratios(&[6000, 0, 0, 0, 10_000, 0, 0, 0, 7000]);
    let neutral = ratios(&[5000, 10_000, 6000]);
    // The tags of these numbers are ratios where there are twice as many.
    let colors: [(u16, &[u32]); 3] = [(50714, &[64]), (50721, &matrix), (50728, &neutral)];
    fs::write(shop.path("colors.dng"), dng_with_ratios([12, 10], &strip, &colors)).unwrap();
    fs::write(shop.path("raw.dng"), small()).unwrap();
    shop.run("import-raw colors.dng -o plane.exr --write-matrix m.yaml", &[]);
    shop.run("demosaic colors.dng --method bi -o rgb.exr", &[]);
    // That XYZ are relative is said where nobody asked for it: once of all frames, and of a matrix that says so with -v alone.
    let said = |line: &str| String::from_utf8(shop.attempt(line, &[]).stderr).unwrap();
    let warning = "to-xyz: warning: XYZ are relative, Y = 1 for the white that saturates the camera, by ColorMatrix1 of the DNG, \
                   for the white of the exposure, not adapted; cd/m2 take a calibrated matrix, --matrix FILE\n";
    fs::copy(shop.path("rgb.exr"), shop.path("more.exr")).unwrap();
    let warned = said("to-xyz rgb.exr more.exr -o {stem}-own.exr");
    assert_eq!(warned, warning);
    assert_eq!(said("to-xyz rgb.exr --quiet -o own.exr"), "");
    shop.run("to-xyz rgb.exr --matrix m.yaml -o file.exr", &[]);
    assert!(said("to-xyz rgb.exr --matrix m.yaml -v -o told.exr").contains("to-xyz: m.yaml: XYZ are relative, Y = 1"));
    // It is for shares of the range, whatever that is.
    assert!(!String::from_utf8(shop.bytes("m.yaml")).unwrap().contains("range_adu"));
    let [own, file] = ["own.exr", "file.exr"].map(|name| shop.frame(name));
    assert_eq!(own.samples, file.samples);
    assert_eq!(own.header.metadata.unit, "relative");
    // (CM)⁻¹ of the neutral: X : Y : Z = 5/6 : 1 : 6/7. Its largest signal is that of green, for which CM has 1.
    let found = own.header.metadata.relative_matrix.unwrap();
    let diagonal = [0, 1, 2].map(|i| found.xyz_from_camera[i][i]);
    let wanted = [1.0 / 0.6, 1.0, 1.0 / 0.7];
    assert!((0..3).all(|i| (diagonal[i] - wanted[i]).abs() < 1e-12), "{diagonal:?}");
    let sum = 5.0 / 6.0 + 1.0 + 6.0 / 7.0;
    assert!((found.white_xy[0] - 5.0 / 6.0 / sum).abs() < 1e-12 && (found.white_xy[1] - 1.0 / sum).abs() < 1e-12);
    shop.run("demosaic raw.dng --method bi --black auto -o none.exr", &[]);
    for (line, status, wanted) in [
        (
            "to-xyz none.exr -o x.exr",
            BAD_USAGE,
            "to-xyz: none.exr: neither its sensor nor its raw file tells a matrix; of a DNG `import-raw FILE.dng -v` tells what its matrix \
             lacks, and what makes one; give --matrix\n",
        ),
        (
            "import-raw raw.dng -o x.exr --write-matrix x.yaml",
            BAD_DATA,
            "import-raw: raw.dng: it tells no matrix: that takes ColorMatrix1 and AsShotNeutral or AsShotWhiteXY (-v tells what is \
             passed over); leave out --write-matrix\n",
        ),
        (
            "import-raw colors.dng -o x.exr --write-matrix x.exr.yaml",
            BAD_USAGE,
            "import-raw: the matrix and the frame have the same place; name a file for each\n",
        ),
    ] {
        let output = shop.attempt(line, &[]);
        assert_eq!(String::from_utf8_lossy(&output.stderr), wanted);
        assert_eq!(output.status.code(), Some(status), "{line}");
        assert!(!shop.path("x.exr").exists() && !shop.path("x.yaml").exists(), "{line}");
    }
}

/// A file of a camera; none, and a word about it, where it is not at hand.
fn of_camera(name: &str) -> Option<PathBuf> {
    let beside = Path::new(TREE).ancestors().skip(1).map(|above| above.join("shared/data/raw").join(name));
    let found = beside.into_iter().find(|path| path.is_file());
    if found.is_none() {
        eprintln!("skipped: there is no shared/data/raw/{name} beside the tree");
    }
    found
}

/// A frame of a Canon Kiss X4, stored packed and as lossless JPEG: a color chart beside a masked border.
#[test]
fn a_cameras_frame_is_imported_and_demosaicked() {
    let names = ["colorchart_kissx4_ml_uncompressed14.dng", "colorchart_kissx4_ml_ljpeg.dng"];
    let [Some(packed), Some(jpeg)] = names.map(of_camera) else { return };
    let shop = Workshop::new();
    for (path, name) in [(&packed, "packed"), (&jpeg, "jpeg")] {
        for part in ["active", "full", "default"] {
            shop.attempt(&format!("import-raw {} --crop {part} -o {name}-{part}.tiff", path.display()), &[]);
        }
    }
    for (part, size, origin) in
        [("active", [1734, 1156], [152, 26]), ("full", [1888, 1182], [0, 0]), ("default", [1734, 1156], [152, 26])]
    {
        let [packed, jpeg] = ["packed", "jpeg"].map(|name| shop.frame(&format!("{name}-{part}.tiff")));
        assert!(packed.samples == jpeg.samples, "{part}");
        let geometry = packed.header.geometry;
        assert_eq!(([geometry.width, geometry.height], geometry.origin), (size, origin), "{part}");
    }
    shop.attempt("demosaic jpeg-active.tiff --method mhc --black auto -o rgb.exr", &[]);
    let MemoryFrame { samples: rgb, header, .. } = shop.frame("rgb.exr");
    let geometry = header.geometry;
    // The chart is brighter than black, and green the most: it was taken by daylight.
    let mean = |class: usize| {
        let rows = rgb.chunks(geometry.row_samples()).map(|row| &row[class * geometry.width..][..geometry.width]);
        rows.flatten().map(|sample| f64::from(*sample)).sum::<f64>() / (geometry.width * geometry.height) as f64
    };
    let [red, green, blue] = [0, 1, 2].map(mean);
    assert!(green > red && green > blue && red.min(blue) > 100.0, "{red} {green} {blue}");
}

/// The chart by the camera's own matrix: its grays are in a line with one another, its patches on their side of them.
#[test]
fn a_charts_colors_follow_from_the_cameras_own_matrix() {
    let Some(chart) = of_camera("colorchart_kissx4_ml_uncompressed14.dng") else { return };
    let shop = Workshop::new();
    shop.run(&format!("demosaic {} --method bi -o rgb.exr", chart.display()), &[]);
    // That they are relative is a warning, as nobody asked for it.
    shop.run("to-xyz rgb.exr --space xyy --quiet -o xyy.exr", &[]);
    let MemoryFrame { samples, header, .. } = shop.frame("xyy.exr");
    assert_eq!(header.metadata.unit, "1, 1, relative");
    let (width, row) = (header.geometry.width, header.geometry.row_samples());
    let mean = |[x, y]: [usize; 2]| {
        [0, 1, 2].map(|channel| {
            let rows = samples[y * row..(y + 40) * row].chunks(row);
            let sum: f64 = rows.flat_map(|row| &row[channel * width + x..][..40]).map(|v| f64::from(*v)).sum();
            sum / 1600.0
        })
    };
    // Corners of squares within patches; rows and columns as the chart shows them.
    let [white, gray, dark] = [[680, 910], [900, 910], [1120, 910]].map(mean);
    assert!(white[2] > 1.5 * gray[2] && gray[2] > 2.0 * dark[2], "{white:?} {gray:?} {dark:?}");
    assert!((white[0] - gray[0]).abs() < 0.01 && (white[1] - gray[1]).abs() < 0.01, "{white:?} {gray:?}");
    let [blue, green, red, yellow] = [[685, 810], [795, 810], [905, 810], [1015, 810]].map(mean);
    assert!(blue[0] < white[0] - 0.05 && blue[1] < white[1] - 0.05, "{blue:?} {white:?}");
    assert!(green[1] > white[1] + 0.05, "{green:?} {white:?}");
    assert!(red[0] > white[0] + 0.1, "{red:?} {white:?}");
    assert!(yellow[0] > white[0] + 0.03 && yellow[1] > white[1] + 0.03 && yellow[2] > red[2], "{yellow:?} {white:?}");
}

/// The read-out of the sensor that made a DNG comes back from its noise profile: the slope is K (1 + PRNU²), the offset that of
/// read noise, dark signal and rounding.
#[test]
fn a_dng_tells_the_read_out_that_made_it() {
    let shop = Workshop::new();
    shop.run("render-radiance SAMPLES/skies/sky912.exr --patch 3x3 --expose-to 0.8 --cfa rggb -o rates.exr", &[]);
    shop.run("add-noise rates.exr --seed 7 -o noisy.exr", &[]);
    shop.run("digitize noisy.exr -o codes.dng", &[]);
    shop.run("import-raw codes.dng -o out.exr --write-readout r.yaml", &[]);
    let metadata = shop.frame("out.exr").header.metadata;
    let sensor = metadata.sensor.unwrap();
    let readout = sensor.readout.unwrap();
    let mut told: serde_yaml::Value = serde_yaml::from_slice(&shop.bytes("r.yaml")).unwrap();
    let of = |key: &str| told["readout"][key].as_f64().unwrap();
    let expected = readout.adu_per_e * (1.0 + readout.prnu.powi(2));
    assert!((of("adu_per_e") / expected - 1.0).abs() < 1e-9);
    let white = metadata.white_level_adu.unwrap().largest();
    assert!((of("full_well_e") * expected / (white - of("bias_adu")) - 1.0).abs() < 1e-9);
    let noise = metadata.noise.as_ref().unwrap();
    // DCNU multiplies the count of the dark signal, its shot noise too; its pattern is the same in all frames, and not told.
    let dark = noise.dark_e * (1.0 + readout.dcnu.powi(2));
    let pattern_e = noise.dark_e * readout.dcnu * readout.adu_per_e / expected;
    let variance = (readout.adu_per_e / expected).powi(2) * (readout.read_noise_e.powi(2) + dark);
    assert!((of("read_noise_e").powi(2) / variance - 1.0).abs() < 1e-3);
    // By that the noise of the codes is told as by the sensor, once it has the patterns that the profile has no place for.
    told["readout"]["prnu"] = readout.prnu.into();
    told["readout"]["dsnu_e"] = pattern_e.into();
    fs::write(shop.path("r.yaml"), serde_yaml::to_string(&told).unwrap()).unwrap();
    let codes = shop.frame("out.exr");
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "codes of 12 bits")]
    let bytes = codes.samples.iter().flat_map(|code| (*code as u16).to_le_bytes());
    fs::write(shop.path("plain.raw"), bytes.collect::<Vec<u8>>()).unwrap();
    let (size, black) = (&codes.header.geometry, codes.header.metadata.uniform_black_adu().unwrap());
    let how = format!("--raw {}x{}:u16le --cfa rggb --black {black} --white {white}", size.width, size.height);
    shop.run(
        &format!("demosaic plain.raw {how} --exposure 0.033 --f-number 8 --sensor r.yaml --sigma -o own.exr"),
        &[],
    );
    shop.run("demosaic codes.dng --sigma -o full.exr", &[]);
    let [own, full] = ["own.exr", "full.exr"].map(|name| {
        let frame = shop.frame_with(name, &["sigma.R", "sigma.G", "sigma.B"]);
        let sigma = frame.samples.chunks_exact(frame.header.geometry.width).skip(3).step_by(6);
        sigma.flatten().map(|sample| f64::from(*sample)).filter(|sample| sample.is_finite()).sum::<f64>()
    });
    assert!((own / full - 1.0).abs() < 0.05, "{own} {full}");
    fs::write(shop.path("raw.dng"), small()).unwrap();
    let refused = shop.attempt("import-raw raw.dng -o none.exr --write-readout none.yaml", &[]);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(said.starts_with("import-raw: raw.dng: it tells no noise: that takes the NoiseProfile of a DNG"), "{said}");
    assert!(!shop.path("none.exr").exists() && !shop.path("none.yaml").exists());
}
