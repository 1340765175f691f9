//! Saturation, from the sample that is full to the pixel that used it, its uncertainty and its statistics.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::cfa::{CfaPattern, Class};
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::frame::Geometry;
use cyanometer::masking::Masking;
use cyanometer::metadata::{AdcRecord, FrameHeader};
use cyanometer::propagation::saturation;
use cyanometer::sigma::WithSigma;
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::{DarkFrames, DarkStack};
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::saturation::FullLevels;
use cyanometer::stream::{Counts, MemoryFrame, RowSource, Stage};
use cyanometer::units::QuantityKind;
use serde_json::Value;
use std::fs;
use support::workshop::{BAD_DATA, Workshop};
use support::{at, crop, frame, header, readout, scatter};

const WHITE: f32 = 4095.0;

/// The head of a plane of codes from a real camera: levels, and no scene.
fn plane_header(width: usize, height: usize, pattern: CfaPattern) -> FrameHeader {
    let mut header = header(QuantityKind::Adu, Geometry::new(width, height, &["Y"]));
    header.metadata.cfa = Some(pattern.into());
    header.metadata.black_level_adu = Some(100.0.into());
    header.metadata.white_level_adu = Some(f64::from(WHITE).into());
    header.metadata.adc = Some(AdcRecord::new(12, 100.0, 0.1));
    header
}

/// Drives a frame through a stage with marks as they are needed.
fn masked<S: Stage>(input: &MemoryFrame, stage: &S) -> (MemoryFrame, Counts) {
    let masking = Masking::of(&input.header, false, stage.header(), true);
    let mut sink = MemoryFrame::new(masking.header(stage), Vec::new());
    let mut source = input.clone();
    let no_darks: Option<&mut DarkFrames<MemoryFrame>> = None;
    let counts = masking.run(stage, &mut source, no_darks, &mut sink, &mut |_| ()).unwrap();
    (sink, counts)
}

fn demosaicking(plane: &MemoryFrame, method: Method) -> Demosaic {
    Demosaic::new(&plane.header, method, Black::Auto, None).unwrap()
}

/// Demosaicking with its uncertainty, which has the layer of marks wherever samples may be full.
fn uncertain(plane: &MemoryFrame, method: Method) -> WithSigma<Demosaic> {
    WithSigma::of_demosaicking(demosaicking(plane, method)).unwrap()
}

/// Which pixels are marked is asked of the filters themselves: those that another value of the full sample changes.
#[test]
fn a_pixel_is_marked_where_another_value_of_a_full_sample_would_change_it() {
    let (width, height) = (9, 8);
    for (method, pattern) in Method::ALL.into_iter().flat_map(|method| CfaPattern::ALL.map(|pattern| (method, pattern)))
    {
        for origin in [[0, 0], [1, 0], [3, 5]] {
            let mut header = plane_header(width, height, pattern);
            header.geometry.origin = origin;
            let plane = frame(header, |x, y, _| 500.0 + 300.0 * scatter(x, y, 0));
            let stage = uncertain(&plane, method);
            for [x, y] in [[0, 0], [4, 3], [5, 3], [4, 4], [5, 4], [8, 7], [8, 0], [1, 6]] {
                let with = |value: f32| {
                    let mut plane = plane.clone();
                    plane.samples[y * width + x] = value;
                    plane
                };
                let (full, lower) = (with(WHITE), with(WHITE - 1000.0));
                let (made, counts) = masked(&full, &stage);
                let (other, none) = masked(&lower, &stage);
                assert_eq!((none.saturated_pixels, made.header.geometry.channels.len()), (0, 7));
                let changes = |x, y| (0..3).any(|channel| at(&made, x, y, channel) != at(&other, x, y, channel));
                let mut marked = 0;
                for (px, py) in (0..height).flat_map(|py| (0..width).map(move |px| (px, py))) {
                    let is_marked = at(&made, px, py, 6) == 1.0;
                    marked += u64::from(is_marked);
                    assert_eq!(is_marked, changes(px, py), "{method:?} {pattern:?} {origin:?} {x},{y} at {px},{py}");
                }
                assert_eq!(counts.saturated_pixels, marked);
            }
        }
    }
}

/// What is full is told by class, above black, and by the full well where that lies below the largest code.
#[test]
fn levels_are_those_of_the_class_and_of_the_full_well() {
    let levels = |header: &FrameHeader| FullLevels::of(header).unwrap().classes();
    let mut header = plane_header(6, 4, CfaPattern::Rggb);
    // 40 000 e⁻ at 0.1 ADU lie at 4100, above the largest code.
    assert_eq!(levels(&header), [WHITE; 3]);
    header.metadata.adc = Some(AdcRecord::new(12, 100.0, 0.05));
    assert_eq!(levels(&header), [2100.0; 3]);
    header.metadata.adc = None;
    header.metadata.white_level_adu = Some(cyanometer::camera::levels::WhiteLevel::Classes([3000.0, 3500.0, 4000.0]));
    assert_eq!(levels(&header), [3000.0, 3500.0, 4000.0]);
    let plane = frame(header, |_, _, _| 3600.0);
    let (made, counts) = masked(&plane, &less_black(&plane));
    // Every red and green sample, each less the black level; no layer, as the levels still tell.
    assert_eq!((made.header.geometry.channels.len(), counts.saturated_samples), (1, 6 * 4 * 3 / 4));
    let mut electrons = support::header(QuantityKind::Electrons, Geometry::new(4, 4, &["R", "G", "B"]));
    let readout = readout();
    #[expect(clippy::cast_possible_truncation, reason = "a full well is a small number")]
    let least = (readout.full_well_e - 4.0 * readout.read_noise_e) as f32;
    assert_eq!(levels(&electrons), [least; 3]);
    electrons.metadata.sensor = None;
    assert_eq!(FullLevels::of(&electrons), None);
}

fn less_black(plane: &MemoryFrame) -> CorrectFrame {
    let settings = CorrectionSettings { black: Black::Auto, cte: None };
    CorrectFrame::new(&plane.header, &settings, None).unwrap()
}

/// A dark frame takes off more here than there: the marks are made before.
#[test]
fn marks_are_made_before_dark_frames_come_off() {
    let plane = frame(plane_header(8, 6, CfaPattern::Gbrg), |x, y, _| if (x, y) == (3, 2) { WHITE } else { 900.0 });
    let dark = frame(plane.header.clone(), |x, y, _| 90.0 + 40.0 * scatter(x, y, 1));
    let settings = CorrectionSettings { black: Black::None, cte: None };
    let stack = DarkStack::of([&dark.header]).unwrap();
    let stage = CorrectFrame::new(&plane.header, &settings, stack.as_ref()).unwrap();
    let masking = Masking::of(&plane.header, false, stage.header(), true);
    let mut sink = MemoryFrame::new(masking.header(&stage), Vec::new());
    let mut darks = DarkFrames::of(vec![dark.clone()]).unwrap().unwrap();
    let counts = masking.run(&stage, &mut plane.clone(), Some(&mut darks), &mut sink, &mut |_| ()).unwrap();
    assert_eq!((counts.saturated_pixels, sink.header.geometry.channels.len()), (1, 2));
    for (x, y) in (0..6).flat_map(|y| (0..8).map(move |x| (x, y))) {
        assert_eq!(at(&sink, x, y, 1), if (x, y) == (3, 2) { 1.0 } else { 0.0 });
        assert_eq!(at(&sink, x, y, 0), at(&plane, x, y, 0) - at(&dark, x, y, 0));
    }
}

/// Of marked pixels sigma is infinite; of others it is what it was without the layer.
#[test]
fn the_uncertainty_of_a_marked_pixel_is_infinite() {
    let mut header = plane_header(12, 10, CfaPattern::Rggb);
    header.metadata.adc = Some(AdcRecord::new(12, 100.0, 0.1));
    let plane = frame(header, |x, y, _| if (x, y) == (6, 5) { WHITE } else { 700.0 });
    let stage = WithSigma::of_demosaicking(demosaicking(&plane, Method::EffectiveColor)).unwrap();
    let (made, counts) = masked(&plane, &stage);
    let plain = support::through(&plane, &stage);
    assert_eq!(made.header.geometry.channels[3..], ["sigma.R", "sigma.G", "sigma.B", "mask"]);
    assert!(counts.saturated_pixels > 0);
    for (x, y) in (0..10).flat_map(|y| (0..12).map(move |x| (x, y))) {
        for channel in 0..6 {
            let expected = at(&plain, x, y, channel);
            let is_unknown = channel >= 3 && at(&made, x, y, 6) != 0.0;
            assert_eq!(at(&made, x, y, channel), if is_unknown { f32::INFINITY } else { expected });
        }
    }
}

/// Marks of a crop are those of the whole, away from its edges; a scene whose law keeps it far below has none to make.
#[test]
fn marks_do_not_hang_on_the_frame() {
    let plane =
        frame(plane_header(24, 20, CfaPattern::Grbg), |x, y, _| if scatter(x, y, 2) > 0.9 { WHITE } else { 600.0 });
    let whole = masked(&plane, &uncertain(&plane, Method::Malvar)).0;
    let part = crop(&plane, 5, 3, 15, 12);
    let of_part = masked(&part, &uncertain(&part, Method::Malvar)).0;
    support::assert_same(&crop(&of_part, 2, 2, 11, 8), &crop(&whole, 7, 5, 11, 8), "marks of a crop");

    let shop = Workshop::new();
    for (electrons, is_possible) in [("9000,20000,30000", false), ("9000,20000,39500", true)] {
        shop.pipe(&format!(
            "render-radiance --electrons {electrons} --size 16x12 | add-noise --without ron -q | digitize -q -o c.exr"
        ));
        let header = shop.frame("c.exr").header;
        let levels = FullLevels::of(&header).unwrap();
        assert_eq!(saturation::is_possible(&header, &levels), is_possible, "{electrons}");
    }
}

/// The law of a uniform scene against its frames: samples by class, and pixels by what they use. Samples are independent
/// draws; of pixels neighbors share sites, at most 25 each, so that their number scatters at most √25 times as much.
#[test]
fn shares_are_those_that_the_law_expects() {
    let shop = Workshop::new();
    shop.pipe(
        "render-radiance --electrons 38900,39300,39700 --size 200x160 | mosaic | add-noise --seed 5 -q | digitize -q -o c.exr",
    );
    let plane = shop.frame("c.exr");
    let header = plane.header.clone();
    let shares = saturation::shares(&header).unwrap();
    let levels = FullLevels::of(&header).unwrap().classes();
    for class in Class::ALL {
        let of_class = (0..160).flat_map(|y| (0..200).map(move |x| (x, y)));
        let of_class: Vec<f32> = of_class
            .filter(|(x, y)| CfaPattern::Rggb.class(*x as i64, *y as i64) == class)
            .map(|(x, y)| at(&plane, x, y, 0))
            .collect();
        let (n, share) = (of_class.len() as f64, shares[class as usize]);
        let full = of_class.iter().filter(|sample| **sample >= levels[class as usize]).count() as f64;
        let sigma = (n * share * (1.0 - share)).sqrt();
        assert!(share > 1e-3 && (full - n * share).abs() < 5.0 * sigma, "{class:?}: {full} of {n}, expected {share}");
    }
    for method in Method::ALL {
        let (made, counts) = masked(&plane, &demosaicking(&plane, method));
        let (n, share) = (200.0 * 160.0, made.header.metadata.saturated_share.unwrap());
        let sigma = (25.0 * n * share * (1.0 - share)).sqrt();
        let found = counts.saturated_pixels as f64;
        assert!((found - n * share).abs() < 4.0 * sigma, "{method:?}: {found}, expected {}", n * share);
    }
}

/// Photosites at twice full well, below the largest code: all but one in 31 600 are read from the level on, whatever is added behind
/// full well, as electrons, as codes and once black is off; a scene 5 % below full well has no marks. The law says the same.
#[test]
fn full_photosites_are_marked_whatever_is_read_behind_them() {
    let shop = Workshop::new();
    let readout = "width: 200, height: 160, cfa: rggb, full_well_e: 20000, dark_current_e_per_s: 5, temperature_k: 293, dcnu: 0.2, \
                   prnu: 0.02, read_noise_e: 15, row_noise_e: 6, column_noise_e: 3, dsnu_e: 8, bits: 14, bias_adu: 500, adu_per_e: 0.5";
    let sensor = format!("schema: cyanometer-sensor/2\nname: deep\nreadout: {{{readout}}}\n");
    fs::write(shop.path("deep.yaml"), sensor).unwrap();
    let marked = |name: &str| {
        let plane = shop.frame(name);
        let levels = FullLevels::of(&plane.header).unwrap().classes();
        assert_eq!(levels, [levels[0]; 3]);
        let shares = saturation::shares(&plane.header);
        (plane.samples.iter().filter(|sample| **sample >= levels[0]).count(), shares)
    };
    for (electrons, is_full) in [("40000,60000,30000", true), ("18000,12000,18000", false)] {
        shop.pipe(&format!(
            "render-radiance --sensor deep.yaml --electrons {electrons} --size 200x160 -q | mosaic -q | add-noise --seed 3 -q -o n.exr"
        ));
        shop.run("digitize n.exr -q -o c.exr", &[]);
        shop.run("correct-frame c.exr --black auto -q -o b.exr", &[]);
        for name in ["n.exr", "c.exr", "b.exr"] {
            let (count, shares) = marked(name);
            // 32 000 photosites: one is missed on average, more than 8 in one of 10⁶ frames; twice that for fixed offsets.
            assert_eq!((32_000 - 16..=32_000).contains(&count), is_full, "{name} {electrons}: {count}");
            assert_eq!(count == 0, !is_full, "{name} {electrons}: {count}");
            let expected = shares.unwrap().map(|share| share > 0.9999);
            assert_eq!(expected, [is_full; 3], "{name} {electrons}: {shares:?}");
        }
    }
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

/// Blue is clipped: each program says how many, files keep it, statistics leave it out, and a check refuses.
#[test]
fn a_clipped_blue_is_known_to_the_end() {
    let shop = Workshop::with_frames();
    let said = |line: &str, what: &str| {
        let output = shop.attempt(line, &[]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(text.contains(what), "{line}: {text}");
        assert!(output.status.success(), "{line}: {text}");
        output.stdout
    };
    said(
        "render-radiance --electrons 15000,25000,60000 --size 40x30 -o e.exr",
        "B expects 60000 e-, but full well is 40000 e-: these samples will be saturated",
    );
    said("add-noise e.exr -o n.exr", "1200 photosites were clipped at full well");
    said("digitize n.exr -o d.exr", "1200 samples were clipped to the largest code");
    said("mosaic d.exr -o c.exr", "300 samples are saturated");
    said("demosaic c.exr --sigma -o rgb.exr", "1200 pixels were made of saturated samples");
    said("to-xyz rgb.exr --sigma --matrix matrix.yaml -o xyz.exr", "1200 pixels were made of saturated samples");
    for name in ["rgb.exr", "xyz.exr"] {
        let report = json(&said(&format!("measure {name} --output-format json"), "are left out of the statistics"));
        let region = &report["regions"][0];
        assert_eq!((&region["saturated"], &region["count"]), (&Value::from(1200), &Value::from(0)));
        let kept = json(&said(&format!("measure {name} --keep-saturated --output-format json"), "1200"));
        assert_eq!(kept["regions"][0]["count"], 1200);
        assert_eq!(shop.read(name).1.saturated_share, Some(1.0));
        let sidecar = String::from_utf8(shop.bytes(&format!("{name}.yaml"))).unwrap();
        assert!(sidecar.contains("saturated: 1200"), "{sidecar}");
    }
    // One channel brings its marks.
    for line in ["measure rgb.exr --channel R", "measure xyz.exr --channel Z", "measure xyz.exr --channel sigma.Z"] {
        let report = json(&said(&format!("{line} --output-format json"), "1200"));
        let region = &report["regions"][0];
        assert_eq!((&region["saturated"], &region["count"]), (&Value::from(1200), &Value::from(0)), "{line}");
    }
    let refused = shop.attempt("measure xyz.exr --check", &[]);
    let text = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(BAD_DATA));
    assert!(text.contains("nothing can be checked: 1200 pixels") && text.contains("give --keep-saturated"), "{text}");
    said("measure xyz.exr --check --keep-saturated", "1200");
    // A picture to look at has no layer, nor has a TIFF, and the warning is the same.
    said("demosaic c.exr -o rgb.tiff", "1200 pixels were made of saturated samples");
    assert_eq!(shop.frame("rgb.tiff").header.geometry.channels, ["R", "G", "B"]);
    said("to-xyz rgb.exr --space srgb --matrix matrix.yaml -o s.tiff", "1200 pixels were made of saturated samples");
    assert_eq!(shop.frame("s.tiff").header.geometry.channels, ["R", "G", "B"]);
}

/// An average says how many of its pixels are saturated, whether its format marks them or not.
#[test]
fn averages_tell_of_saturation_in_every_format() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 15000,25000,60000 --size 20x10 --quiet -o e.exr", &[]);
    shop.run("add-noise e.exr --quiet --frames 0..3 -o n{frame}.exr", &[]);
    for name in ["mean.exr", "mean.tiff"] {
        let output = shop.attempt(&format!("average-frames n0.exr n1.exr n2.exr -o {name}"), &[]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && text.contains("200 pixels were made of saturated samples"), "{text}");
        let sidecar = String::from_utf8(shop.bytes(&format!("{name}.yaml"))).unwrap();
        assert!(sidecar.contains("saturated: 200"), "{sidecar}");
    }
}

/// Who looks at a frame hears of its marks, as often as the layer has them.
#[test]
fn pictures_and_differences_tell_of_marked_pixels() {
    let shop = Workshop::new();
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    // Green is beyond the largest code in most photosites.
    shop.run("render-radiance --electrons 8000,39900,20000 --size 32x24 -o e.exr", &[]);
    let quiet =
        ["add-noise e.exr --quiet -o n.exr", "digitize n.exr --quiet -o c.exr", "mosaic c.exr --quiet -o p.exr"];
    let more =
        ["demosaic p.exr --sigma --quiet -o rgb.exr", "to-xyz rgb.exr --matrix matrix.yaml --sigma --quiet -o xyz.exr"];
    for line in quiet.into_iter().chain(more) {
        shop.run(line, &[]);
    }
    let options = InputOptions { path: Some(shop.path("xyz.exr")), all_channels: true, ..Default::default() };
    let mut reader = FrameReader::open(&options).unwrap();
    let mut samples = Vec::new();
    RowSource::read(&mut reader, 24, &mut samples).unwrap();
    let channels = samples.len() / (32 * 24);
    let marked =
        samples.chunks_exact(32).skip(channels - 1).step_by(channels).flatten().filter(|mark| **mark != 0.0).count();
    assert!(marked > 0);
    let text =
        format!("xyz.exr: {marked} of the pixels read were made of saturated samples; they are taken as they are\n");
    for line in ["preview xyz.exr -o a.png", "color-difference 1,1,1 xyz.exr"] {
        let done = shop.attempt(line, &[]);
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.success() && said.contains(&text), "{line}: {said}");
    }
}

/// Codes without a header, and the full well of a sensor that is named: 1753 + 0.058824 · 5000 = 2047.12 ADU, far below white.
#[test]
fn the_full_well_of_a_sensor_marks_frames_of_cameras_and_their_flats() {
    let shop = Workshop::new();
    let readout = "width: 8, height: 6, cfa: rggb, full_well_e: 5000, dark_current_e_per_s: 1, temperature_k: 293, dcnu: 0, prnu: 0, \
                   read_noise_e: 3, bits: 12, bias_adu: 1753, adu_per_e: 0.058824";
    let sensor = format!("schema: cyanometer-sensor/2\nname: low\nreadout: {{{readout}}}\n");
    fs::write(shop.path("low.yaml"), sensor).unwrap();
    let plane = |name: &str, full: &[u16]| {
        let code = |at: u16| if full.contains(&at) { 2047 } else { 1900 + at };
        fs::write(shop.path(name), (0..48).flat_map(|at| code(at).to_le_bytes()).collect::<Vec<u8>>()).unwrap();
    };
    plane("light.raw", &[3, 20]);
    plane("flat.raw", &[30]);
    let said = |command: &str| {
        let command = command.split_whitespace().collect::<Vec<_>>().join(" ");
        String::from_utf8(shop.attempt(&command, &[]).stderr).unwrap()
    };
    let how = "--raw 8x6:u16le --cfa rggb --black 1753";
    for white in ["", "--white 4095"] {
        let told = said(&format!("correct-frame light.raw {how} {white} --sensor low.yaml -o black.exr"));
        assert!(told.contains("2 samples are saturated"), "{told}");
        let told = said(&format!("demosaic light.raw {how} {white} --sensor low.yaml -o rgb.exr"));
        assert!(told.contains("pixels were made of saturated samples"), "{told}");
        let told =
            said(&format!("correct-frame light.raw {how} {white} --sensor low.yaml --flat flat.raw -o flat.exr"));
        assert!(told.contains("1 photosites of the flats are saturated; they are marked"), "{told}");
        let options = InputOptions { path: Some(shop.path("flat.exr")), ..Default::default() };
        let mut marks = FrameReader::open(&options).unwrap();
        marks.keep_mask();
        let mut samples = Vec::new();
        marks.read(6, &mut samples).unwrap();
        // Rows of samples, each before that of its marks.
        let mask: Vec<f32> = samples.chunks_exact(8).skip(1).step_by(2).flatten().copied().collect();
        let marked: Vec<usize> = (0..48).filter(|at| mask[*at] != 0.0).collect();
        assert_eq!(marked, [3, 20, 30]);
    }
    let told = said(&format!("correct-frame light.raw {how} --white 4095 -o black.exr"));
    assert!(!told.contains("saturated"), "{told}");
}

/// TIFF has no marks: the pixels that a sidecar counts are no fewer in what is made of them.
#[test]
fn counts_of_saturated_pixels_outlive_a_file_without_marks() {
    let shop = Workshop::new();
    let codes = (0..192_u16).flat_map(|at| (if at == 100 { 4095_u16 } else { 900 + at % 7 }).to_le_bytes());
    fs::write(shop.path("light.raw"), codes.collect::<Vec<u8>>()).unwrap();
    let raw = "--raw 16x12:u16le --cfa rggb --black 100 --white 4095";
    shop.said(&format!("demosaic light.raw {raw} -o rgb.tiff"), 0);
    fs::write(shop.path("m.yaml"), "schema: cyanometer-matrix/1\nunit: relative XYZ per (white level - black level)\nxyz_from_camera: [[0.5, 0.3, 0.2], [0.2, 0.7, 0.1], [0.0, 0.1, 0.9]]\n").unwrap();
    shop.said("to-xyz rgb.tiff --matrix m.yaml -o xyz.tiff", 0);
    let counted = |name: &str| {
        let sidecar = String::from_utf8(shop.bytes(name)).unwrap();
        sidecar.lines().find_map(|line| line.trim().strip_prefix("saturated: ").map(str::to_owned)).unwrap()
    };
    assert!(counted("rgb.tiff.yaml").parse::<u32>().unwrap() > 8);
    assert_eq!(counted("xyz.tiff.yaml"), counted("rgb.tiff.yaml"));
}
