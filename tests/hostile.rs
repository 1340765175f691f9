//! Input that was made to hurt: small files that say they are large, numbers of everything, text that takes parsers long. A
//! result or one line, within bounds of time and memory that go with the size of the file.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::error::Result;
use cyanometer::formats::exr::{ExrCompression, ExrReader, ExrSamples, ExrTags, ExrWriter, Layers};
use cyanometer::formats::fits::FitsReader;
use cyanometer::formats::format::SampleReader;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::read_ahead::Pipe;
use cyanometer::frame::Geometry;
use cyanometer::stream::RowSource;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::fs::{self, File, OpenOptions};
use std::io::{Cursor, Read, Seek, Write};
use std::process::Output;
use support::TREE;
use support::bounds::{Bounded, memory_for};
use support::dng::{dng, gray_jpeg};
use support::workshop::{BAD_DATA, Workshop};

/// Runs a line on a file within bounds that go with its size.
#[track_caller]
fn bounded(shop: &Workshop, line: &str, file: &str) -> Output {
    let memory = memory_for(fs::metadata(shop.path(file)).unwrap().len());
    let run = Bounded { shop, line, piped: None, memory };
    run.run().unwrap_or_else(|what| panic!("{what}"))
}

/// Runs a line that shall be refused, and gives the complaint.
#[track_caller]
fn refused(shop: &Workshop, line: &str, file: &str) -> String {
    let done = bounded(shop, line, file);
    assert!(!done.status.success(), "{line} is taken");
    String::from_utf8(done.stderr).unwrap()
}

/// An attribute of an EXR: name, type, length, value.
fn attribute(name: &str, kind: &str, value: &[u8]) -> Vec<u8> {
    let length = u32::try_from(value.len()).unwrap().to_le_bytes();
    [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &length, value].concat()
}

/// The begin of an EXR of f32 channels, up to its table of blocks; `more` are attributes of others' making.
fn exr_begin(channels: &[String], width: i32, height: i32, compression: u8, more: &[u8]) -> Vec<u8> {
    let mut list = Vec::new();
    for name in channels {
        list.extend(
            [name.as_bytes(), b"\0", &2_i32.to_le_bytes(), &[0; 4], &1_i32.to_le_bytes(), &1_i32.to_le_bytes()]
                .concat(),
        );
    }
    list.push(0);
    let window: Vec<u8> = [0, 0, width - 1, height - 1].iter().flat_map(|corner: &i32| corner.to_le_bytes()).collect();
    // The second flag says that names may be long.
    let mut bytes = vec![0x76, 0x2F, 0x31, 0x01, 2, 4, 0, 0];
    bytes.extend(attribute("channels", "chlist", &list));
    bytes.extend(attribute("compression", "compression", &[compression]));
    bytes.extend(attribute("dataWindow", "box2i", &window));
    bytes.extend(attribute("displayWindow", "box2i", &window));
    bytes.extend(attribute("lineOrder", "lineOrder", &[0]));
    bytes.extend(attribute("pixelAspectRatio", "float", &1_f32.to_le_bytes()));
    bytes.extend(attribute("screenWindowCenter", "v2f", &[0; 8]));
    bytes.extend(attribute("screenWindowWidth", "float", &1_f32.to_le_bytes()));
    bytes.extend(more);
    bytes.push(0);
    bytes
}

/// An EXR of one row, stored as it is.
fn exr_row(channels: &[String], samples: &[f32], more: &[u8]) -> Vec<u8> {
    let width = samples.len() / channels.len();
    let mut bytes = exr_begin(channels, i32::try_from(width).unwrap(), 1, 0, more);
    let block = bytes.len() as u64 + 8;
    bytes.extend(block.to_le_bytes());
    bytes.extend(0_i32.to_le_bytes());
    bytes.extend(i32::try_from(4 * samples.len()).unwrap().to_le_bytes());
    bytes.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
    bytes
}

/// A TIFF of one row of bytes, all channels of a pixel together.
fn tiff_row(channels: u16, samples: &[u8]) -> Vec<u8> {
    let width = samples.len() / usize::from(channels);
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    let tags: [(u16, u16, u32); 9] = [
        (256, 4, u32::try_from(width).unwrap()),
        (257, 4, 1),
        (258, 3, 8),
        (259, 3, 1),
        (262, 3, 1),
        (273, 4, 8 + 2 + 9 * 12 + 4),
        (277, 3, channels.into()),
        (278, 4, 1),
        (279, 4, u32::try_from(samples.len()).unwrap()),
    ];
    bytes.extend(9_u16.to_le_bytes());
    for (tag, kind, value) in tags {
        bytes
            .extend([&tag.to_le_bytes()[..], &kind.to_le_bytes(), &1_u32.to_le_bytes(), &value.to_le_bytes()].concat());
    }
    bytes.extend([0; 4]);
    bytes.extend(samples);
    bytes
}

fn names(count: usize, name: impl Fn(usize) -> String) -> Vec<String> {
    let mut names: Vec<String> = (0..count).map(name).collect();
    names.sort();
    names
}

/// Time and memory for all pairs of channels would go by the square; each is measured by itself.
#[test]
fn many_channels_are_measured_one_by_one() {
    let shop = Workshop::new();
    let samples: Vec<f32> = (0..20_000 * 6).map(|i| (i % 1009) as f32).collect();
    fs::write(shop.path("many.exr"), exr_row(&names(20_000, |i| format!("c{i:05}")), &samples, &[])).unwrap();
    fs::write(shop.path("many.tiff"), tiff_row(u16::MAX, &[7; u16::MAX as usize])).unwrap();
    for (file, channels) in [("many.exr", 20_000), ("many.tiff", usize::from(u16::MAX))] {
        let done = bounded(&shop, &format!("measure {file} --output-format json"), file);
        let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
        let region = &report["regions"][0];
        assert_eq!(region["channels"].as_array().unwrap().len(), channels);
        assert!(region["covariance"].is_null());
        let expected = if file == "many.tiff" { 7.0 } else { samples[6 * 17..][..6].iter().sum::<f32>() / 6.0 };
        assert!((region["channels"][17]["mean"].as_f64().unwrap() - f64::from(expected)).abs() < 1e-6);
        assert_eq!(region["channels"][17]["std"].is_null(), file == "many.tiff");
    }
}

/// Names of layers are looked up, not compared one with another; so many attributes that each would take much memory are
/// refused.
#[test]
fn many_layers_and_attributes_take_little() {
    let shop = Workshop::new();
    let layers = names(60_000, |i| format!("layer{i}.Y"));
    fs::write(shop.path("layers.exr"), exr_row(&layers, &vec![1.5; layers.len()], &[])).unwrap();
    let more: Vec<u8> = (0..1_000_000).flat_map(|i| attribute(&format!("a{i}"), "x", &[])).collect();
    fs::write(shop.path("attributes.exr"), exr_row(&["Y".to_owned()], &[1.5], &more)).unwrap();
    assert!(bounded(&shop, "measure layers.exr", "layers.exr").status.success());
    let said = refused(&shop, "measure attributes.exr", "attributes.exr");
    assert_eq!(said, "measure: attributes.exr: its headers have more than 65536 attributes; no image's have\n");
    let some: Vec<u8> = (0..60_000).flat_map(|i| attribute(&format!("a{i}"), "x", &[])).collect();
    fs::write(shop.path("attributes.exr"), exr_row(&["Y".to_owned()], &[1.5], &some)).unwrap();
    assert!(bounded(&shop, "measure attributes.exr", "attributes.exr").status.success());
}

/// Memory is taken as samples come, not as headers declare them.
#[test]
fn what_a_header_declares_takes_no_memory() {
    let shop = Workshop::new();
    // A library of 100 bands, 7·10⁷ pixels.
    let bands = names(100, |i| format!("S0.{},000000nm", 400 + i));
    let mut library = exr_begin(&bands, 70_000, 1000, 0, &attribute("emissiveUnits", "string", b"W.m^-2.sr^-1.nm^-1"));
    let blocks = library.len() as u64 + 8000;
    library.extend((0..1000_u64).flat_map(|row| (blocks + row).to_le_bytes()));
    library.extend([0; 15_000]);
    fs::write(shop.path("library.exr"), library).unwrap();
    for line in ["fit-matrix library.exr", "render-radiance library.exr --patch 2x2 -o out.exr", "measure library.exr"]
    {
        drop(refused(&shop, line, "library.exr"));
    }
    // A chart of 10¹² patches, in patches of one pixel.
    fs::write(shop.path("chart.exr"), exr_begin(&["Y".to_owned()], 1_000_000, 1_000_000, 0, &[])).unwrap();
    drop(refused(&shop, "measure --patches=1x1 chart.exr", "chart.exr"));
    // One row of 2²⁸ samples that are said to be there, in a block of 1 GiB.
    for (compression, length) in [(0_u8, 1 << 30), (2, 100), (4, 100), (1, 100)] {
        let mut wide = exr_begin(&["Y".to_owned()], 1 << 28, 1, compression, &[]);
        wide.extend((wide.len() as u64 + 8).to_le_bytes());
        wide.extend(0_i32.to_le_bytes());
        wide.extend(i32::to_le_bytes(length));
        wide.extend([1; 100]);
        fs::write(shop.path("wide.exr"), wide).unwrap();
        drop(refused(&shop, "measure wide.exr", "wide.exr"));
    }
}

/// A header of FITS that declares an array.
fn fits_begin(bitpix: i32, width: u64, height: u64, more: &str) -> Vec<u8> {
    let cards = [
        "SIMPLE  =                    T".to_owned(),
        format!("BITPIX  = {bitpix}"),
        "NAXIS   = 2".to_owned(),
        format!("NAXIS1  = {width}"),
        format!("NAXIS2  = {height}"),
        more.to_owned(),
        "END".to_owned(),
    ];
    let text: String = cards.iter().map(|card| format!("{card:<80}")).collect();
    format!("{text:<2880}").into_bytes()
}

/// FITS, PNG and files without a header say that they are large.
#[test]
fn frames_of_others_take_no_memory_that_is_declared() {
    let shop = Workshop::new();
    let largest = i32::MAX as u64;
    for (name, order) in [("up.fits", "ROWORDER= 'BOTTOM-UP'"), ("down.fits", "ROWORDER= 'TOP-DOWN'")] {
        for (width, height) in [(largest, largest), (largest, 1), (1, largest)] {
            let bytes = [fits_begin(-64, width, height, order), vec![0; 8000]].concat();
            fs::write(shop.path(name), bytes).unwrap();
            cut_short(&shop, name, "");
        }
    }
    fs::write(shop.path("few.raw"), [0; 8000]).unwrap();
    for layout in ["2147483647x2147483647:f32le", "2147483647x1:u8", "1x2147483647:u16be", "1x1:u8:9999999999999999999"]
    {
        cut_short(&shop, "few.raw", &format!(" --raw {layout}"));
    }
    // Headers of many cards, none of them of any use but one.
    let cards: String = (0..400_000).map(|i| format!("{:<80}", format!("KEY{i:05}= {i}"))).collect();
    let mut long = fits_begin(8, 2, 1, "");
    long.truncate(5 * 80);
    long.extend(cards.into_bytes());
    long.extend(format!("{:<80}", "END").into_bytes());
    long.resize(long.len().next_multiple_of(2880), b' ');
    long.extend([1, 2]);
    fs::write(shop.path("long.fits"), long).unwrap();
    assert!(bounded(&shop, "measure long.fits", "long.fits").status.success());
    // A row of 1 GiB in a PNG of 1 MB, and one that cannot be there.
    for (width, packed) in [(1_u32 << 30, 1 << 30), (1 << 30, 1000)] {
        fs::write(shop.path("wide.png"), png_of_zeros(width, packed)).unwrap();
        drop(refused(&shop, "measure wide.png", "wide.png"));
    }
}

/// Has a file refused that is shorter than it says, whole and down a pipe.
#[track_caller]
fn cut_short(shop: &Workshop, file: &str, options: &str) {
    for line in ["measure", "mosaic --pattern rggb -o out.exr", "demosaic --pattern rggb --black 0 -o out.exr"] {
        drop(refused(shop, &format!("{line} {file}{options}"), file));
        let path = shop.path(file);
        let memory = memory_for(fs::metadata(&path).unwrap().len());
        let line = format!("{line}{options}");
        let run = Bounded { shop, line: &line, piped: Some(&path), memory }.run();
        assert!(!run.unwrap_or_else(|what| panic!("{what}")).status.success(), "{line} is taken");
    }
}

/// A PNG of one row of gray bytes that declares so many, of which `packed` zeros are there.
fn png_of_zeros(width: u32, packed: usize) -> Vec<u8> {
    let chunk = |name: &[u8; 4], data: &[u8]| {
        let mut sum = flate2::Crc::new();
        sum.update(name);
        sum.update(data);
        let length = u32::try_from(data.len()).unwrap().to_be_bytes();
        [&length[..], name, data, &sum.sum().to_be_bytes()].concat()
    };
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    std::io::copy(&mut std::io::repeat(0).take(packed as u64 + 1), &mut encoder).unwrap();
    let data = encoder.finish().unwrap();
    let header = [&width.to_be_bytes()[..], &1_u32.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let parts = [chunk(b"IHDR", &header), chunk(b"IDAT", &data), chunk(b"IEND", &[])];
    [&b"\x89PNG\r\n\x1A\n"[..], &parts.concat()].concat()
}

/// What deflate makes of nothing: a thousand times as much.
#[test]
fn a_block_out_of_all_proportion_is_refused() {
    let shop = Workshop::new();
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    for _ in 0..1 << 10 {
        encoder.write_all(&[0; 1 << 20]).unwrap();
    }
    let packed = encoder.finish().unwrap();
    let mut bytes = exr_begin(&["Y".to_owned()], 1 << 28, 1, 2, &[]);
    bytes.extend((bytes.len() as u64 + 8).to_le_bytes());
    bytes.extend(0_i32.to_le_bytes());
    bytes.extend(i32::try_from(packed.len()).unwrap().to_le_bytes());
    bytes.extend(&packed);
    fs::write(shop.path("packed.exr"), bytes).unwrap();
    let said = refused(&shop, "measure packed.exr", "packed.exr");
    assert!(said.contains("would become 1024 MiB"), "{said}");
    // The same as a TIFF, of bytes.
    let mut tiff = tiff_row(1, &[0]);
    for (tag, value) in [(256_u16, 1_u32 << 30), (259, 8), (279, u32::try_from(packed.len()).unwrap())] {
        let place = tiff.chunks_exact(2).skip(5).position(|bytes| bytes == tag.to_le_bytes()).unwrap();
        tiff[10 + 2 * place + 8..][..4].copy_from_slice(&value.to_le_bytes());
    }
    tiff.pop();
    tiff.extend(packed);
    fs::write(shop.path("packed.tiff"), tiff).unwrap();
    let said = refused(&shop, "measure packed.tiff", "packed.tiff");
    assert!(said.contains("would become 1024 MiB"), "{said}");
}

/// Statistics of each patch are kept until the report is written.
#[test]
fn as_many_patches_as_a_report_can_hold() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 100,200,300 --size 260x256 -o e.exr", &[]);
    shop.run("add-noise e.exr -o n.exr", &[]);
    let said = refused(&shop, "measure --patches=1x1 n.exr", "n.exr");
    assert_eq!(
        said,
        "measure: n.exr: it has 66560 patches of 1x1; 65536 are measured at a time at most; give another \
         --patches=WxH\n"
    );
    let done = bounded(&shop, "measure --patches=2x1 n.exr --output-format csv", "n.exr");
    let lines = done.stdout.iter().filter(|byte| **byte == b'\n').count();
    assert!(done.status.success() && lines > 130 * 256, "{lines}");
}

#[test]
fn text_that_takes_parsers_long_is_refused_at_once() {
    let shop = Workshop::with_frames();
    // A bracket in quotes closes none: these nest, and seem not to.
    for (unit, end) in [("[\"]\",", ""), ("[ #]\n ", ""), ("{']':", ""), ("[\"\n]\",", "")] {
        fs::write(shop.path("deep.yaml"), unit.repeat((1 << 20) / unit.len() - 1) + end).unwrap();
        for line in ["predict-noise --dark --sensor deep.yaml", "measure noisy.exr --metadata deep.yaml"] {
            let said = refused(&shop, line, "deep.yaml");
            assert!(said.contains("more than 10000 brackets"), "{said}");
        }
        // What is not too much is left to the parser.
        fs::write(shop.path("deep.yaml"), unit.repeat(9_999)).unwrap();
        drop(refused(&shop, "measure noisy.exr --metadata deep.yaml", "deep.yaml"));
    }
    let mut row = b"nm".to_vec();
    row.resize(40 << 20, b',');
    fs::write(shop.path("row.csv"), row).unwrap();
    for line in ["render-radiance row.csv -o out.exr", "fit-matrix SAMPLES/skies/sky912.exr --labels row.csv:a"] {
        let said = refused(&shop, line, "row.csv");
        assert!(said.contains("more than 33554432 numbers"), "{said}");
    }
}

/// Distances of all from all are kept: of 10⁴ spectra, 800 MB.
#[test]
fn a_library_is_too_large_to_choose_from() {
    let shop = Workshop::new();
    let bands = names(24, |i| format!("S0.{},000000nm", 360 + 20 * i));
    let samples: Vec<f32> = (0..24 * 10_000).map(|i| 1.0 + (i * 7919 % 101) as f32).collect();
    fs::write(
        shop.path("library.exr"),
        exr_row(&bands, &samples, &attribute("emissiveUnits", "string", b"W.m^-2.sr^-1.nm^-1")),
    )
    .unwrap();
    let said = refused(&shop, "fit-matrix library.exr --train 20", "library.exr");
    assert!(said.contains("10000 samples to choose from, and 8192 are the most"), "{said}");
    assert!(bounded(&shop, "fit-matrix library.exr", "library.exr").status.success());
}

/// Metadata may say that one plane is XYZ.
#[test]
fn one_plane_of_xyz_is_no_picture() {
    let shop = Workshop::with_frames();
    let said = refused(&shop, "preview plane.exr --metadata xyz.exr.yaml -o out.png", "plane.exr");
    assert_eq!(
        said,
        "preview: plane.exr: a single plane of XYZ is no picture; give --range LOW,HIGH, or --false-color\n"
    );
    assert!(
        bounded(&shop, "preview plane.exr --metadata xyz.exr.yaml --range 0,1 -o out.png", "plane.exr")
            .status
            .success()
    );
}

/// Nobody has named it: it stands in a sensor file, and reading it would wait for a writer.
#[test]
fn a_pipe_among_data_files_is_not_waited_for() {
    let shop = Workshop::new();
    for file in ["kaf-5101ce.yaml", "bg39_1mm.csv"] {
        fs::copy(format!("{TREE}/sample_data/sensors/{file}"), shop.path(file)).unwrap();
    }
    let made = shop.command("mkfifo kaf5101ce_est_qe_1nm.csv").status().unwrap();
    assert!(made.success());
    let said = refused(&shop, "predict-noise --dark --sensor ./kaf-5101ce.yaml", "kaf-5101ce.yaml");
    assert_eq!(
        said,
        "predict-noise: ./kaf5101ce_est_qe_1nm.csv: it is no file but a pipe or a device; a table must be a file\n"
    );
}

#[test]
fn bytes_behind_a_frame_are_told() {
    let shop = Workshop::with_frames();
    for (more, compression) in [(&b"x"[..], "none"), (b"a second frame", "none"), (b"x", "zip")] {
        shop.run(&format!("mosaic noisy.exr --compression {compression} -o long.exr"), &[]);
        fs::remove_file(shop.path("long.exr.yaml")).unwrap();
        OpenOptions::new().append(true).open(shop.path("long.exr")).unwrap().write_all(more).unwrap();
        for (line, name) in [("digitize long.exr -o out.exr", "long.exr"), ("digitize -o out.exr", "standard input")] {
            let done = shop.attempt(line, &shop.bytes("long.exr"));
            let said = String::from_utf8(done.stderr).unwrap();
            let wanted =
                format!("digitize: {name}: behind its last row come bytes that are no part of it; cut them off\n");
            assert_eq!((said, done.status.code()), (wanted, Some(BAD_DATA)));
            assert!(!shop.path("out.exr").exists(), "{line}");
        }
    }
}

/// A FITS of 2x2 codes, with an empty extension behind it.
fn fits() -> Vec<u8> {
    let part = |cards: &[&str], data: &[u8]| {
        let mut bytes: Vec<u8> =
            cards.iter().chain(&["END"]).flat_map(|card| format!("{card:80}").into_bytes()).collect();
        bytes.resize(bytes.len().next_multiple_of(2880), b' ');
        bytes.extend_from_slice(data);
        bytes.resize(bytes.len().next_multiple_of(2880), 0);
        bytes
    };
    let image = ["BITPIX  = 8", "NAXIS   = 2", "NAXIS1  = 2", "NAXIS2  = 2"];
    let first = part(&[&["SIMPLE  =                    T"], &image[..]].concat(), &[1, 2, 3, 4]);
    [first, part(&["XTENSION= 'IMAGE   '", "BITPIX  = 8", "NAXIS   = 0", "PCOUNT  = 0", "GCOUNT  = 1"], &[])].concat()
}

/// Zeros fill up; all else behind the last byte that belongs to a frame is refused, in files and in pipes.
#[test]
fn bytes_behind_a_frame_of_any_format_are_told() {
    let shop = Workshop::with_frames();
    for (line, name) in [
        ("digitize noisy.exr -o codes.tiff", "codes.tiff"),
        ("digitize noisy.exr --format tiff --viewable -o scaled.tiff", "scaled.tiff"),
        ("mosaic noisy.exr --format tiff --compression deflate -o electrons.tiff", "electrons.tiff"),
        ("mosaic codes.tiff -o codes.dng", "codes.dng"),
        ("preview codes.tiff -o picture.png", "picture.png"),
    ] {
        shop.run(line, &[]);
        drop(fs::remove_file(shop.path(&format!("{name}.yaml"))));
    }
    fs::write(shop.path("plane.fits"), fits()).unwrap();
    let junk = "behind its last row come bytes that are no part of it; cut them off";
    let another = |format: &str| {
        format!(
            "behind it comes {format}; a stream has one frame, or several that are EXR of one part in scanlines: give each a file of its own"
        )
    };
    for (name, format) in [
        ("codes.tiff", "a TIFF"),
        ("scaled.tiff", "a TIFF"),
        ("electrons.tiff", "a TIFF"),
        ("codes.dng", "a TIFF"),
        ("picture.png", "a PNG"),
        ("plane.fits", "a FITS"),
    ] {
        let whole = shop.bytes(name);
        for (more, wanted) in [
            (&b""[..], None),
            (&[0; 3000], None),
            (b"junk", Some(junk.to_owned())),
            (b"\0\0junk", Some(junk.to_owned())),
            (&[&[0; 70_000][..], b"junk"].concat(), Some(junk.to_owned())),
            (&whole, Some(another(format))),
        ] {
            let bytes = [&whole, more].concat();
            fs::write(shop.path(name), &bytes).unwrap();
            for line in [format!("measure {name}"), "measure".to_owned()] {
                let done = shop.attempt(&line, &bytes);
                let said = String::from_utf8(done.stderr).unwrap();
                let status = if wanted.is_some() { BAD_DATA } else { 0 };
                assert_eq!(done.status.code(), Some(status), "{line}, {} more bytes: {said}", more.len());
                assert!(wanted.as_ref().is_none_or(|wanted| said.contains(wanted)), "{line}: {said}");
            }
        }
    }
}

fn read_file(bytes: &[u8]) -> Result<Vec<f32>> {
    let mut file: File = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file.rewind().unwrap();
    let mut reader =
        FrameReader::open_file(file, "in", None, &InputOptions { all_channels: true, ..Default::default() })?;
    let (height, mut samples) = (reader.header().geometry.height, Vec::new());
    for _ in 0..height {
        reader.read(1, &mut samples)?;
    }
    Ok(samples)
}

fn read_pipe(bytes: &[u8]) -> Result<Vec<f32>> {
    let mut reader = ExrReader::stream(Pipe::of(Cursor::new(bytes.to_vec())), "in")?;
    let (height, mut samples) = (reader.geometry().height, Vec::new());
    for _ in 0..height {
        reader.read(1, &mut samples)?;
    }
    Ok(samples)
}

/// Each byte of small files, changed in some ways: a file is taken if and only if a pipe is, and gives the same samples.
#[test]
fn damaged_files_and_pipes_are_taken_or_refused_alike() {
    for compression in [ExrCompression::None, ExrCompression::Zips, ExrCompression::Rle, ExrCompression::Piz] {
        let geometry = Geometry::new(5, 36, &["R", "G", "B"]);
        let tags = ExrTags::default();
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.exr");
        let samples: Vec<f32> = (0..5 * 36 * 3).map(|i| (i * 31 % 17) as f32).collect();
        let mut writer = ExrWriter::create(
            Vec::new(),
            "a.exr",
            &geometry,
            ExrSamples::F32,
            compression,
            Layers::BesideTheImage,
            &tags,
        )
        .unwrap();
        writer.write(&samples).unwrap();
        let (mut whole, patch) = writer.finish().unwrap();
        if let Some(patch) = patch {
            fs::write(&path, &whole).unwrap();
            let mut file = OpenOptions::new().read(true).write(true).open(&path).unwrap();
            cyanometer::formats::exr::patch_table(&mut file, "a.exr", &patch).unwrap();
            whole = fs::read(&path).unwrap();
        }
        assert!(read_file(&whole).is_ok() && read_pipe(&whole).is_ok());
        let mut both = [0, 0];
        for place in 4..whole.len() {
            for change in [0x01, 0x80, 0xFF] {
                let mut bytes = whole.clone();
                bytes[place] ^= change;
                // What is tiled, deep or of several parts is copied to a file before it is read.
                if bytes[5] & 0x1A != 0 {
                    continue;
                }
                let bits = |read: Result<Vec<f32>>| read.map(|s| s.into_iter().map(f32::to_bits).collect::<Vec<_>>());
                let (file, pipe) = (bits(read_file(&bytes)), bits(read_pipe(&bytes)));
                match (file, pipe) {
                    (Ok(file), Ok(pipe)) => assert_eq!(file, pipe, "{place} {change}"),
                    (Err(_), Err(_)) => both[1] += 1,
                    // Rows stored from bottom to top cannot be turned round in a pipe, which says so.
                    (_, Err(error)) if error.to_string().contains("from bottom to top") => {}
                    (file, pipe) => {
                        panic!("{compression:?}, byte {place} ^ {change}: {:?} {:?}", file.err(), pipe.err())
                    }
                }
                both[0] += 1;
            }
        }
        assert!(both[1] > both[0] / 20, "hardly any change was met: {both:?}");
    }
}

/// The same of FITS, of one plane and of three, from the top and from the bottom; and of PNG, which are taken as files alone.
#[test]
fn damaged_frames_of_others_are_taken_or_refused_alike() {
    let stream = |bytes: &[u8]| -> Result<Vec<f32>> {
        let mut reader = FitsReader::stream(Pipe::of(Cursor::new(bytes.to_vec())), "in")?;
        let (height, mut samples) = (reader.geometry().height, Vec::new());
        for _ in 0..height {
            reader.read(1, &mut samples)?;
        }
        Ok(samples)
    };
    let bits = |read: Result<Vec<f32>>| read.map(|s| s.into_iter().map(f32::to_bits).collect::<Vec<_>>());
    let three = fits_begin(16, 3, 4, "NAXIS3  = 3");
    for (mut whole, samples) in [
        (fits_begin(16, 3, 4, "ROWORDER= 'TOP-DOWN'"), 2 * 12),
        (fits_begin(-32, 3, 4, "ROWORDER= 'BOTTOM-UP'"), 4 * 12),
        (fits_begin(8, 3, 4, "BSCALE  = 1.5E0 / of 1"), 12),
        ([&three[..170], b"3", &three[171..]].concat(), 2 * 36),
    ] {
        let cards = whole.chunks(80).position(|card| card.starts_with(b"END")).unwrap() + 1;
        // Codes of 16 bits with a sign that are none without one.
        whole.extend(
            (0..samples).map(|byte| u8::try_from(byte * 7 % 251).unwrap() & if byte % 2 == 0 { 0x3F } else { 0xFF }),
        );
        whole.resize(whole.len().next_multiple_of(2880), 0);
        assert_eq!(bits(read_file(&whole)).unwrap(), bits(stream(&whole)).unwrap());
        let mut refused = 0;
        // The first nine bytes tell what it is.
        for place in (9..80 * cards).chain(2880..2880 + samples) {
            for change in [0x01, 0x02, 0x10, 0x80, 0xFF] {
                let mut bytes = whole.clone();
                bytes[place] ^= change;
                match (bits(read_file(&bytes)), bits(stream(&bytes))) {
                    (Ok(file), Ok(pipe)) => assert_eq!(file, pipe, "{place} {change}"),
                    (Err(_), Err(_)) => refused += 1,
                    (file, pipe) => panic!("byte {place} ^ {change}: {:?} {:?}", file.err(), pipe.err()),
                }
            }
        }
        assert!(refused > 20, "hardly any change was met: {refused}");
    }
    let whole = png_of_zeros(9, 9);
    assert!(read_file(&whole).is_ok());
    let refused = (8..whole.len()).flat_map(|place| [0x01, 0x80, 0xFF].map(|change| (place, change)));
    let refused = refused.filter(|(place, change)| {
        let mut bytes = whole.clone();
        bytes[*place] ^= change;
        read_file(&bytes).is_err()
    });
    assert!(refused.count() > 60);
}

/// Stacks that no system gives: no thread can be started, as where the number of processes is limited.
#[test]
fn one_thread_works_where_the_system_starts_no_more() {
    let shop = Workshop::with_frames();
    for line in [
        "digitize noisy.exr -o out.exr",
        "digitize --threads 4 --compression zip noisy.exr -o out.exr",
        "measure noisy.exr",
    ] {
        let done = shop.command(line).env("RUST_MIN_STACK", "70368744177664").output().unwrap();
        assert!(done.status.success() && done.stderr.is_empty(), "{line}: {}", String::from_utf8_lossy(&done.stderr));
    }
    assert_eq!(shop.frame("out.exr").samples, shop.frame("codes.exr").samples);
}

#[test]
fn where_there_is_no_memory_it_is_said_in_a_line() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 100,200,300 --size 3000000x2 -o wide.exr", &[]);
    let files = shop.files();
    for line in
        ["add-noise wide.exr -o out.exr", "measure wide.exr", "mosaic wide.exr --compression deflate -o out.tiff"]
    {
        let mut command = shop.command("sh -c");
        let mut words = line.split(' ');
        command.arg("ulimit -v 60000; exec \"$0\" \"$@\"").arg(support::workshop::path_of(words.next().unwrap()));
        let done = command.args(words).env("MALLOC_ARENA_MAX", "1").output().unwrap();
        let said = String::from_utf8(done.stderr).unwrap();
        let program = line.split(' ').next().unwrap();
        assert!(said.starts_with(&format!("{program}: the system gives no more memory; ")), "{line}: {said}");
        assert_eq!((said.lines().count(), done.status.code()), (1, Some(BAD_DATA)), "{line}: {said}");
        assert_eq!(shop.files(), files, "{line}");
    }
}

/// A strip that covers the image is decoded a few rows at a time: small files of large and of wide images, all of whose samples
/// are there, and such that say so alone.
#[test]
fn large_raws_in_small_files_stream() {
    let shop = Workshop::new();
    let zeros = |samples: usize| {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(&vec![0; 2 * samples]).unwrap();
        encoder.finish().unwrap()
    };
    for (file, bytes) in [
        ("deflated.dng", dng([8000, 4000], 16, 8, &zeros(8000 * 4000), &[])),
        ("wide.dng", dng([1 << 20, 30], 16, 8, &zeros(30 << 20), &[])),
        ("jpeg.dng", dng([8000, 4000], 16, 7, &gray_jpeg([8000, 4000]), &[])),
    ] {
        fs::write(shop.path(file), bytes).unwrap();
        let done = bounded(&shop, &format!("measure {file}"), file);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    let mut jpeg = gray_jpeg([8000, 4000]);
    jpeg.truncate(500_000);
    for (file, bytes, wanted) in [
        ("short.dng", dng([8000, 4000], 16, 7, &jpeg, &[]), "strip 0 holds fewer bytes than its size needs"),
        ("bomb.dng", dng([1 << 20, 1 << 20], 16, 8, &zeros(1 << 20), &[]), "strip 0 holds fewer bytes than its size"),
        ("size.dng", dng([u32::MAX, 4], 16, 8, &zeros(1 << 20), &[]), "gives the raw image no size that a sensor has"),
        (
            "cut.dng",
            dng([8000, 4000], 16, 8, &[zeros(7000 * 4000), vec![0; 9999]].concat(), &[]),
            "strip 0 ends before its last row",
        ),
    ] {
        fs::write(shop.path(file), bytes).unwrap();
        let said = refused(&shop, &format!("measure {file}"), file);
        assert!(said.starts_with(&format!("measure: {file}: ")) && said.contains(wanted), "{said}");
    }
}
