//! Frames scaled for viewers: what they hold, and that our programs read from them what they do from others, to the bit.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::stream::RowSource;
use std::fs;
use std::path::Path;
use support::workshop::Workshop;

const MATRIX: &str = "\
schema: cyanometer-matrix/1
sensor: kaf-5101ce
method: sky-rad-ls
unit: cd m-2 per (ADU s-1 sr-1)
xyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]]
";

/// A pipeline, each command on the file of the one before it, and the greatest sample that its file may hold by right: white.
const STAGES: [(&str, &str, f64); 6] = [
    ("render-radiance SAMPLES/skies/sky912.exr --patch 6x5 --expose-to 0.75", "rates.exr", 1.0),
    ("add-noise rates.exr --seed 7", "noisy.exr", 1.0),
    ("digitize noisy.exr", "codes.tiff", 65_536.0),
    ("mosaic codes.tiff", "plane.tiff", 65_536.0),
    ("demosaic plane.tiff --sigma --method eci", "rgb.exr", 1.0),
    ("to-xyz rgb.exr --matrix matrix.yaml --sigma --white-luminance 40000", "xyz.exr", 1.0),
];

fn set_up() -> Workshop {
    let bench = Workshop::new();
    fs::write(bench.path("matrix.yaml"), MATRIX).unwrap();
    bench
}

/// The samples that a program of ours reads, all channels.
fn samples(path: &Path) -> Vec<u32> {
    let options = InputOptions { path: Some(path.into()), all_channels: true, ..InputOptions::default() };
    let mut reader = FrameReader::open(&options).unwrap();
    let mut samples = Vec::new();
    for _ in 0..reader.header().geometry.height {
        reader.read(1, &mut samples).unwrap();
    }
    assert_eq!(reader.mismatch(), None);
    assert_eq!(reader.header().metadata.sample_scale, None);
    samples.into_iter().map(f32::to_bits).collect()
}

/// What is stored: the same read without what the metadata say of scales, and of codes, which scaled ones would not be.
fn stored(path: &Path, all_channels: bool) -> Vec<f32> {
    let mut bytes = fs::read(path).unwrap();
    for (known, unknown) in
        [("sample_scale:", "sample_shape:"), ("\nadc:", "\nabc:"), ("\nwhite_level_adu:", "\nwhite_level_abc:")]
    {
        let place = bytes.windows(known.len()).position(|window| window == known.as_bytes());
        place.into_iter().for_each(|place| bytes[place..][..known.len()].copy_from_slice(unknown.as_bytes()));
    }
    let copy = path.with_file_name(format!("bare-{}", path.file_name().unwrap().to_str().unwrap()));
    fs::write(&copy, bytes).unwrap();
    let mut reader =
        FrameReader::open(&InputOptions { path: Some(copy), all_channels, ..InputOptions::default() }).unwrap();
    let mut samples = Vec::new();
    for _ in 0..reader.header().geometry.height {
        reader.read(1, &mut samples).unwrap();
    }
    samples
}

/// A scale at every stage, none, and one at every other: the samples that are read are the same, and what is stored fills the
/// range up to white by more than half of what the scene does: 0.75 of full well.
#[test]
fn a_pipeline_of_scaled_frames_has_the_samples_of_one_of_unscaled_ones() {
    let plain = set_up();
    let scaled = set_up();
    let mixed = set_up();
    for (index, (command, file, white)) in STAGES.into_iter().enumerate() {
        plain.run(&format!("{command} -o {file}"), &[]);
        scaled.run(&format!("{command} --viewable -o {file}"), &[]);
        mixed.run(&format!("{command}{} -o {file}", if index % 2 == 0 { " --viewable" } else { "" }), &[]);
        let expected = samples(&plain.path(file));
        assert_eq!(expected, samples(&scaled.path(file)), "{file}");
        assert_eq!(expected, samples(&mixed.path(file)), "{file}");
        let highest = stored(&scaled.path(file), false).into_iter().fold(0.0, f32::max);
        assert!((0.3..=1.0).contains(&(f64::from(highest) / white)), "{file}: {highest}");
        let digest = |bench: &Workshop| {
            let text = fs::read_to_string(bench.path(&format!("{file}.yaml"))).unwrap();
            text.lines().find(|line| line.contains("digest: ")).unwrap().to_owned()
        };
        assert_eq!(digest(&plain), digest(&scaled), "{file}");
    }
    // For viewers what is no color stands apart.
    let second_part = |bench: &Workshop| {
        let options = InputOptions { path: Some(bench.path("xyz.exr")), part: 1, ..InputOptions::default() };
        FrameReader::open(&options).is_ok()
    };
    assert!(second_part(&scaled) && !second_part(&plain));
}

#[test]
fn pipes_and_half_floats_are_scaled_too() {
    let bench = set_up();
    bench.run("render-radiance --electrons 3000,5000,7000 --size 32x24 -o rates.exr", &[]);
    bench.run("add-noise rates.exr --seed 7 --viewable --sample-type f16 -o half.exr", &[]);
    bench.run("add-noise rates.exr --seed 7 --sample-type f16 -o plain.exr", &[]);
    // Powers of two do not change what f16 rounds to.
    assert_eq!(samples(&bench.path("half.exr")), samples(&bench.path("plain.exr")));
    bench.run("digitize plain.exr --viewable --compression deflate -o a.tiff", &[]);
    bench.run("digitize half.exr --viewable --format tiff --compression lzw -o b.tiff", &[]);
    assert_eq!(samples(&bench.path("a.tiff")), samples(&bench.path("b.tiff")));
}

/// What lies beside a file may be of another: what the file says of itself counts.
#[test]
fn the_scale_is_that_of_the_file_itself() {
    let bench = set_up();
    bench.run("render-radiance --electrons 3000,5000,7000 --size 32x24 -o rates.exr", &[]);
    bench.run("digitize rates.exr -q -o codes.tiff", &[]);
    bench.run("digitize rates.exr -q --viewable -o shown.tiff", &[]);
    let expected = samples(&bench.path("codes.tiff"));
    fs::copy(bench.path("codes.tiff.yaml"), bench.path("shown.tiff.yaml")).unwrap();
    assert_eq!(samples(&bench.path("shown.tiff")), expected);
    fs::remove_file(bench.path("shown.tiff.yaml")).unwrap();
    assert_eq!(samples(&bench.path("shown.tiff")), expected);
}

#[test]
fn what_cannot_be_scaled_is_refused() {
    let bench = set_up();
    bench.run("render-radiance --electrons 3000,5000,7000 --size 32x24 -o rates.exr", &[]);
    bench.run("digitize rates.exr -q -o codes.exr", &[]);
    bench.run("mosaic codes.exr -o plane.exr", &[]);
    bench.run("demosaic plane.exr -o rgb.exr", &[]);
    for (line, complaint) in [
        // As f16 these are below the smallest normal number, and would lose digits.
        (
            "render-radiance --electrons 0.3,1.1,3.3 --size 8x6 --viewable --sample-type f16 -o half.exr",
            "would not be the same once it is scaled back; write f32",
        ),
        (
            "correct-frame plane.exr --black auto --viewable -o plane.dng",
            "a DNG of floats tells converters its white level, a whole number; leave out --viewable",
        ),
        (
            "to-xyz rgb.exr --matrix matrix.yaml --space lab --white d65 --white-luminance 9000 --viewable -o lab.exr",
            "is no light that viewers show",
        ),
    ] {
        let output = bench.attempt(line, &[]);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && told.contains(complaint), "{line}: {told}");
    }
}

/// Codes of a DNG fill 16 bits, and its levels go with them, black with its fraction; what we read are the codes, bit by bit.
#[test]
fn a_dng_of_scaled_codes_has_scaled_levels() {
    let bench = set_up();
    bench.run("render-radiance --electrons 3000,5000,7000 --size 32x24 --cfa rggb -o rates.exr", &[]);
    bench.run("add-noise rates.exr -o noisy.exr", &[]);
    bench.run("digitize noisy.exr -o plain.dng", &[]);
    bench.run("digitize noisy.exr --viewable -o scaled.dng", &[]);
    let told = |name: &str| {
        fs::copy(bench.path(name), bench.path("alone.dng")).unwrap();
        let mut bytes = bench.bytes(name);
        // Metadata that nobody knows: the tags alone count.
        let at = bytes.windows(7).position(|window| window == b"schema:").unwrap();
        bytes[at] = b'x';
        fs::write(bench.path("alone.dng"), bytes).unwrap();
        bench.frame("alone.dng")
    };
    let [plain, scaled] = [told("plain.dng"), told("scaled.dng")];
    let level =
        |frame: &cyanometer::stream::MemoryFrame| frame.header.metadata.black_level_adu.unwrap().uniform().unwrap();
    assert!((level(&scaled) - 16.0 * level(&plain)).abs() < 1e-4 && level(&plain).fract() != 0.0);
    assert_eq!(scaled.header.metadata.white_level_adu, Some((16.0 * 4095.0).into()));
    assert!(plain.samples.iter().zip(&scaled.samples).all(|(code, stored)| 16.0 * code == *stored));
    assert_eq!(bench.frame("scaled.dng").samples, plain.samples);
    assert_eq!(bench.sidecar("scaled.dng").samples, bench.sidecar("plain.dng").samples);
}

/// A scale that is no power of two is refused also where the file has metadata of its own, which count.
#[test]
fn a_scale_that_cannot_be_is_refused_wherever_it_stands() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 3000,5000,7000 --size 8x6 -o rates.exr", &[]);
    let own = fs::read_to_string(shop.path("rates.exr.yaml")).unwrap();
    for (scale, is_refused) in [("3", true), ("0", true), ("-2", true), ("0.25", false)] {
        fs::write(shop.path("given.yaml"), format!("{own}sample_scale: {scale}\n")).unwrap();
        let output = shop.attempt("measure rates.exr --metadata given.yaml", &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let wanted = format!("given.yaml: its `sample_scale`, {scale}, is no power of two");
        assert_eq!((output.status.success(), said.contains(&wanted)), (!is_refused, is_refused), "{said}");
    }
}

/// The white of XYZ that are there already can be named: it is recorded, and they are scaled by it.
#[test]
fn a_white_of_xyz_is_recorded_and_scales_them() {
    let bench = set_up();
    let xyz = [[50.0, 60.0, 70.0], [1.0, 2.0, 3.0]];
    bench.write_colors("xyz.exr", cyanometer::units::QuantityKind::Xyz, &xyz);
    let white = |name: &str| bench.sidecar(name).color.and_then(|color| color.white);
    bench.run("to-xyz xyz.exr -o same.exr", &[]);
    assert_eq!(white("same.exr"), None);
    for (option, scale, luminance) in
        [("--white-luminance 100000", -17, 100_000.0), ("--white-luminance 100 --white d50", -7, 100.0)]
    {
        bench.run(&format!("to-xyz xyz.exr {option} --viewable -o t.exr"), &[]);
        assert_eq!(white("t.exr").map(|white| white[1]), Some(luminance));
        assert_eq!(bench.sidecar("t.exr").sample_scale, Some(2.0_f64.powi(scale)));
        assert_eq!(bench.frame("t.exr").samples, bench.frame("xyz.exr").samples);
    }
    // A luminance alone keeps the color of a white that the frame records, and colors without a white refer to that.
    bench.run("to-xyz t.exr --white-luminance 200 -o brighter.exr", &[]);
    assert_eq!(white("brighter.exr"), white("t.exr").map(|white| white.map(|value| 2.0 * value)));
    bench.run("to-xyz t.exr --space lab -o lab.exr", &[]);
    assert_eq!(white("lab.exr"), white("t.exr"));
    bench.run("to-xyz t.exr --white d65 --space lab -o daylight.exr", &[]);
    assert_eq!(white("daylight.exr").map(|white| white[1]), Some(100.0));
    assert_ne!(white("daylight.exr"), white("t.exr"));
    let said = bench.said("to-xyz xyz.exr --white d50 -o t.exr", 1);
    assert!(said.contains("nothing tells how bright white is in it; give --white-luminance"), "{said}");
    let said = bench.said("to-xyz xyz.exr --white 1,0,1 -o t.exr", 2);
    assert!(said.contains("is impossible; all three must be above 0"), "{said}");
}

/// Means over frames are scaled, and variances by the square, in a part of their own; maps of differences by 100 as white.
#[test]
fn reports_of_pixels_are_scaled_too() {
    let bench = set_up();
    bench.run("render-radiance --electrons 3000,5000,7000 --size 6x4 -o rates.exr", &[]);
    bench.run("add-noise rates.exr --seed 7 --frames 0..3 -o {frame}.exr", &[]);
    let measure = "measure 0.exr 1.exr 2.exr --over frames -o report.txt --pixels";
    bench.run(&format!("{measure} plain.exr"), &[]);
    bench.run(&format!("{measure} shown.exr --viewable"), &[]);
    let scale = bench.sidecar("shown.exr").sample_scale.unwrap();
    let [plain, shown] = ["plain.exr", "shown.exr"].map(|name| bench.frame(name));
    assert_eq!(shown.samples, plain.samples);
    assert!(bench.bytes("shown.exr").windows(8).any(|window| window == b"variance"));
    let (stored, known) = (stored(&bench.path("shown.exr"), true), samples(&bench.path("plain.exr")));
    let ratio = |layer: usize| f64::from(stored[layer * 6]) / f64::from(f32::from_bits(known[layer * 6]));
    assert_eq!([ratio(0), ratio(3)], [scale, scale * scale]);

    bench.write_colors("a.exr", cyanometer::units::QuantityKind::Xyz, &[[50.0, 60.0, 70.0], [1.0, 2.0, 3.0]]);
    bench.write_colors("b.exr", cyanometer::units::QuantityKind::Xyz, &[[51.0, 59.0, 70.0], [1.1, 2.0, 3.0]]);
    let compare = "color-difference a.exr b.exr --white-luminance 100 -o report.txt --map";
    bench.run(&format!("{compare} plain.exr"), &[]);
    bench.run(&format!("{compare} shown.exr --viewable"), &[]);
    assert_eq!(bench.sidecar("shown.exr").sample_scale, Some(1.0 / 128.0));
    assert_eq!(bench.frame("shown.exr").samples, bench.frame("plain.exr").samples);
}
