//! Round trips; files of other makers, put together by hand; damage. The crate `tiff` is the second opinion.

#![expect(clippy::cast_possible_truncation, reason = "tests, with values chosen to fit")]

use super::tags::{Field, OF_THE_WRITER, fields};
use super::write::needs_big_tiff;
use super::*;
use crate::error::Result;
use crate::formats::format::SampleReader;
use crate::frame::Geometry;
use std::fs::File;
use std::io::{Cursor, Write};

const COMPRESSIONS: [TiffCompression; 3] = [TiffCompression::None, TiffCompression::Lzw, TiffCompression::Deflate];

/// Samples that repeat in parts and do not in others; whole numbers from 0 to 65535 for `U16`.
fn samples(count: usize, kind: TiffSamples) -> Vec<f32> {
    let mut state = 1u64;
    (0..count)
        .map(|index| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let noise = (state >> 48) as f32;
            match kind {
                _ if index % 97 < 20 => 512.0,
                TiffSamples::U16 => noise,
                TiffSamples::F32 => (noise - 20_000.0) * 1.37e-3,
            }
        })
        .collect()
}

fn frame(width: usize, height: usize, channels: usize) -> Geometry {
    let names: Vec<String> = match channels {
        1 => vec!["Y".into()],
        2 => vec!["Y".into(), "A".into()],
        3 | 4 => ["R", "G", "B", "A"][..channels].iter().map(|name| (*name).into()).collect(),
        _ => (0..channels).map(|channel| format!("C{channel}")).collect(),
    };
    Geometry { width, height, origin: [0, 0], channels: names }
}

fn settings(samples: TiffSamples, compression: TiffCompression, tags: &TiffTags) -> TiffSettings {
    TiffSettings { samples, scale: 1.0, compression, tags: tags.clone(), extra: Vec::new(), exif: Vec::new() }
}

fn write(
    geometry: &Geometry,
    kind: TiffSamples,
    compression: TiffCompression,
    tags: &TiffTags,
    samples: &[f32],
    rows_at_once: usize,
) -> (Vec<u8>, u64) {
    let output = Cursor::new(Vec::new());
    let mut writer = TiffWriter::create(output, "out.tif", geometry, settings(kind, compression, tags)).unwrap();
    for rows in samples.chunks(rows_at_once * geometry.row_samples()) {
        writer.write_rows(rows).unwrap();
    }
    let (output, unfit) = writer.finish().unwrap();
    (output.into_inner(), unfit)
}

fn open(bytes: &[u8], page: usize) -> Result<TiffReader> {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    TiffReader::open(file, "in.tif", page)
}

fn read_all(reader: &mut TiffReader, rows_at_once: usize) -> Result<Vec<f32>> {
    let geometry = reader.geometry().clone();
    let mut samples = vec![f32::NAN; geometry.row_samples() * geometry.height];
    for (index, rows) in samples.chunks_mut(rows_at_once * geometry.row_samples()).enumerate() {
        reader.read_rows(index * rows_at_once, rows.len() / geometry.row_samples(), rows)?;
    }
    Ok(samples)
}

fn complaint(bytes: &[u8]) -> String {
    let result = open(bytes, 0).and_then(|mut reader| read_all(&mut reader, 16));
    let text = result.expect_err("it should be refused").to_string();
    assert!(!text.contains('\n') && text.starts_with("in.tif: "), "{text}");
    text
}

#[test]
fn what_is_written_is_read() {
    for (width, height) in [(1, 1), (1, 7), (7, 1), (300, 200), (40_000, 3)] {
        for channels in [1, 2, 3, 4, 5, 31] {
            let geometry = frame(width, height, channels);
            for kind in [TiffSamples::U16, TiffSamples::F32] {
                let samples = samples(geometry.row_samples() * height, kind);
                for compression in COMPRESSIONS {
                    let case = format!("{geometry:?} {kind:?} {compression:?}");
                    let (bytes, unfit) = write(&geometry, kind, compression, &TiffTags::default(), &samples, height);
                    assert_eq!(unfit, 0);
                    let mut reader = open(&bytes, 0).unwrap();
                    assert_eq!(*reader.geometry(), geometry, "{case}");
                    let stored = if kind == TiffSamples::U16 { "u16" } else { "f32" };
                    assert_eq!(reader.stored_as().unwrap().name(), stored);
                    assert!(read_all(&mut reader, height).unwrap() == samples, "{case}");
                    assert!(read_all(&mut reader, 11).unwrap() == samples, "{case}");
                }
            }
        }
    }
}

#[test]
fn the_crate_reads_the_same() {
    use tiff::decoder::{Decoder, DecodingResult};
    // Not 4: the crate leaves out extra samples that are not said to be alpha, and then undoes predictors wrongly.
    for channels in [1, 3] {
        let geometry = frame(300, 200, channels);
        for kind in [TiffSamples::U16, TiffSamples::F32] {
            let samples = samples(300 * 200 * channels, kind);
            for compression in COMPRESSIONS {
                let (bytes, _) = write(&geometry, kind, compression, &TiffTags::default(), &samples, 64);
                let found: Vec<f32> = match Decoder::new(Cursor::new(bytes)).unwrap().read_image().unwrap() {
                    DecodingResult::U16(found) => found.into_iter().map(f32::from).collect(),
                    DecodingResult::F32(found) => found,
                    _ => panic!("stored as something else"),
                };
                let pixels = found.len() / channels;
                assert_eq!(pixels, 300 * 200, "{channels} {kind:?} {compression:?}");
                for pixel in 0..pixels {
                    for channel in 0..channels {
                        let (row, column) = (pixel / 300, pixel % 300);
                        let ours = samples[(row * channels + channel) * 300 + column];
                        assert_eq!(
                            found[pixel * channels + channel],
                            ours,
                            "{channels} {kind:?} {compression:?} {row} {column}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn what_the_crate_writes_is_read() {
    use tiff::encoder::{Compression as C, Predictor as P, TiffEncoder, colortype::RGB16};
    let pixels: Vec<u16> = (0..90 * 70 * 3).map(|i: u32| (i * 7919 % 65_521) as u16).collect();
    // Without LZW or Deflate a predictor means nothing to libtiff, and so to us; the crate would use it nevertheless.
    for (compression, predictor) in [
        (C::Uncompressed, P::None),
        (C::Packbits, P::None),
        (C::Lzw, P::Horizontal),
        (C::Deflate(tiff::encoder::compression::DeflateLevel::Fast), P::Horizontal),
    ] {
        let mut bytes = Cursor::new(Vec::new());
        TiffEncoder::new(&mut bytes)
            .unwrap()
            .with_compression(compression)
            .with_predictor(predictor)
            .write_image::<RGB16>(90, 70, &pixels)
            .unwrap();
        let found = read_all(&mut open(&bytes.into_inner(), 0).unwrap(), 9).unwrap();
        for (index, pixel) in pixels.chunks(3).enumerate() {
            for (channel, sample) in pixel.iter().enumerate() {
                let (row, column) = (index / 90, index % 90);
                assert_eq!(found[(row * 3 + channel) * 90 + column], f32::from(*sample));
            }
        }
    }
}

#[test]
fn the_crate_still_cannot_read_for_us() {
    use tiff::decoder::{Decoder, DecodingResult};
    let read = |photometric: u32| {
        let bytes = Made::gray(4, 1).with(262, &[photometric]).bytes();
        Decoder::new(Cursor::new(bytes)).and_then(|mut decoder| decoder.read_image())
    };
    assert!(matches!(read(1), Ok(DecodingResult::U16(plain)) if plain == [0, 1, 2, 3]));
    assert!(matches!(read(0), Ok(DecodingResult::U16(inverted)) if inverted == [65_535, 65_534, 65_533, 65_532]));
    assert!(read(32_803).is_err());
}

#[test]
fn bytes_depend_on_the_samples_only() {
    let geometry = frame(300, 1500, 3);
    for kind in [TiffSamples::U16, TiffSamples::F32] {
        let samples = samples(geometry.row_samples() * 1500, kind);
        for compression in COMPRESSIONS {
            let write = |rows| write(&geometry, kind, compression, &TiffTags::default(), &samples, rows).0;
            let whole = write(1500);
            assert!(whole == write(1) && whole == write(77));
            let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            assert!(whole == one_thread.install(|| write(500)));
        }
    }
}

#[test]
fn tags_and_origin_come_back() {
    let tags =
        TiffTags { description: Some("# cyanometer\nunit: e⁻\n".into()), software: Some("digitize 0.1".into()) };
    for origin in [[0, 0], [10, 7], [0, 5], [1 << 30, 1]] {
        let geometry = Geometry { origin, ..frame(5, 4, 1) };
        let (bytes, _) = write(&geometry, TiffSamples::U16, TiffCompression::None, &tags, &[1.0; 20], 4);
        let reader = open(&bytes, 0).unwrap();
        assert_eq!((reader.tags(), reader.geometry()), (&tags, &geometry));
    }
    // TIFF has no negative positions.
    let geometry = Geometry { origin: [-1, 3], ..frame(5, 4, 1) };
    let (bytes, _) = write(&geometry, TiffSamples::U16, TiffCompression::None, &tags, &[1.0; 20], 4);
    assert_eq!(open(&bytes, 0).unwrap().geometry().origin, [0, 0]);
}

#[test]
fn rounds_and_clamps_to_sixteen_bits_and_counts_what_did_not_fit() {
    let values = [
        (0.49, 0.0),
        (0.51, 1.0),
        (1.5, 2.0),
        (2.5, 2.0),
        (65_535.4, 65_535.0),
        (-0.4, 0.0),
        (32_767.51, 32_768.0),
        // Those that do not fit:
        (-0.6, 0.0),
        (65_535.6, 65_535.0),
        (1e30, 65_535.0),
        (f32::INFINITY, 65_535.0),
        (f32::NEG_INFINITY, 0.0),
        (f32::NAN, 0.0),
    ];
    let (given, wanted): (Vec<f32>, Vec<f32>) = values.into_iter().unzip();
    let geometry = frame(13, 1, 1);
    let (bytes, unfit) = write(&geometry, TiffSamples::U16, TiffCompression::Lzw, &TiffTags::default(), &given, 1);
    assert_eq!(unfit, 6);
    assert_eq!(read_all(&mut open(&bytes, 0).unwrap(), 1).unwrap(), wanted);

    let all: Vec<f32> = (0..=u16::MAX).map(f32::from).collect();
    let scaled: Vec<f32> = all.iter().map(|code| code / 65_535.0).collect();
    let geometry = frame(256, 256, 1);
    let settings = settings(TiffSamples::U16, TiffCompression::None, &TiffTags::default());
    let settings = TiffSettings { scale: 65_535.0, ..settings };
    let mut writer = TiffWriter::create(Cursor::new(Vec::new()), "out.tif", &geometry, settings).unwrap();
    writer.write_rows(&scaled).unwrap();
    let (bytes, unfit) = writer.finish().unwrap();
    assert_eq!(unfit, 0);
    assert_eq!(read_all(&mut open(&bytes.into_inner(), 0).unwrap(), 256).unwrap(), all);
}

#[test]
fn big_tiff_when_it_must_be() {
    let tags = TiffTags::default();
    let big = |height, compression| {
        let settings = settings(TiffSamples::F32, compression, &tags);
        needs_big_tiff(&frame(10_000, height, 1), &settings, &[])
    };
    // 4 GiB are 107 374 rows of 40 kB.
    assert!(!big(107_000, TiffCompression::None) && big(107_374, TiffCompression::None));
    assert!(!big(97_000, TiffCompression::Deflate) && big(98_000, TiffCompression::Deflate));
    assert!(!big(71_000, TiffCompression::Lzw) && big(72_000, TiffCompression::Lzw));

    let geometry = Geometry { origin: [3, 4], ..frame(300, 200, 3) };
    for kind in [TiffSamples::U16, TiffSamples::F32] {
        let samples = samples(300 * 200 * 3, kind);
        let settings = settings(kind, TiffCompression::Deflate, &tags);
        let output = Cursor::new(Vec::new());
        let mut writer = TiffWriter::begin(output, "out.tif", &geometry, settings, Vec::new(), true).unwrap();
        writer.write_rows(&samples).unwrap();
        let bytes = writer.finish().unwrap().0.into_inner();
        assert_eq!(bytes[2], 43);
        let mut reader = open(&bytes, 0).unwrap();
        assert_eq!(*reader.geometry(), geometry);
        assert!(read_all(&mut reader, 200).unwrap() == samples);
        assert!(tiff::decoder::Decoder::new(Cursor::new(bytes)).unwrap().read_image().is_ok());
    }
}

/// A tag of each type, one with a value that fits into its entry and one with a value that does not.
fn extra_tags() -> Vec<ExtraTag> {
    let values = [
        TagValue::Bytes(vec![1, 4, 0, 255]),
        TagValue::Bytes((0..9).collect()),
        TagValue::Undefined(vec![7, 8]),
        TagValue::Undefined((1..=20).collect()),
        TagValue::Text("abc".into()),
        TagValue::Text("a camera of ours".into()),
        TagValue::Shorts(vec![2, 65_535]),
        TagValue::Shorts(vec![1, 2, 3, 4, 5]),
        TagValue::Longs(vec![u32::MAX]),
        TagValue::Longs(vec![1, 2, 3]),
        TagValue::SignedShorts(vec![-2, 5]),
        TagValue::SignedShorts(vec![i16::MIN, i16::MAX, 0, -1, 1]),
        TagValue::SignedLongs(vec![-7]),
        TagValue::SignedLongs(vec![i32::MIN, i32::MAX, -1]),
        TagValue::Ratios(vec![[1, 30]]),
        TagValue::Ratios(vec![[u32::MAX, 7], [0, 1]]),
        TagValue::SignedRatios(vec![[-1, 3]]),
        TagValue::SignedRatios(vec![[i32::MIN, 10_000], [5, -2]]),
        TagValue::Floats(vec![-0.1]),
        TagValue::Floats(vec![1e30, f32::MIN_POSITIVE, 3.0]),
        TagValue::Doubles(vec![-0.1]),
        TagValue::Doubles(vec![1e300, 2.0]),
    ];
    // From the highest number to the lowest: some before those of the writer, some between, some behind.
    let numbers = [254, 271, 272, 306, 315, 316, 318].into_iter().chain(50_700..);
    let mut tags: Vec<ExtraTag> = numbers.zip(values).map(|(number, value)| ExtraTag { number, value }).collect();
    tags.reverse();
    tags
}

/// Any value as numbers, or bytes.
fn as_numbers(value: &TagValue) -> Vec<f64> {
    match value {
        TagValue::Bytes(bytes) | TagValue::Undefined(bytes) => bytes.iter().map(|&byte| byte.into()).collect(),
        TagValue::Text(_) => Vec::new(),
        TagValue::Shorts(numbers) => numbers.iter().map(|&number| number.into()).collect(),
        TagValue::Longs(numbers) => numbers.iter().map(|&number| number.into()).collect(),
        TagValue::SignedShorts(numbers) => numbers.iter().map(|&number| number.into()).collect(),
        TagValue::SignedLongs(numbers) => numbers.iter().map(|&number| number.into()).collect(),
        TagValue::Ratios(ratios) => ratios.iter().map(|[a, b]| f64::from(*a) / f64::from(*b)).collect(),
        TagValue::SignedRatios(ratios) => ratios.iter().map(|[a, b]| f64::from(*a) / f64::from(*b)).collect(),
        TagValue::Floats(numbers) => numbers.iter().map(|&number| number.into()).collect(),
        TagValue::Doubles(numbers) => numbers.clone(),
    }
}

#[test]
fn tags_of_the_caller_come_back() {
    let geometry = Geometry { origin: [3, 4], ..frame(30, 20, 3) };
    let samples = samples(1800, TiffSamples::U16);
    let texts = TiffTags { description: Some("a frame".into()), software: Some("a program".into()) };
    for big in [false, true] {
        let settings = settings(TiffSamples::U16, TiffCompression::Lzw, &texts);
        let extra = fields(&extra_tags(), "out.tif").unwrap();
        let output = Cursor::new(Vec::new());
        let mut writer = TiffWriter::begin(output, "out.tif", &geometry, settings, extra, big).unwrap();
        writer.write_rows(&samples).unwrap();
        let bytes = writer.finish().unwrap().0.into_inner();
        assert_eq!(bytes[2], if big { 43 } else { 42 });

        let mut reader = open(&bytes, 0).unwrap();
        assert_eq!((reader.tags(), reader.geometry()), (&texts, &geometry));
        assert!(read_all(&mut reader, 20).unwrap() == samples);
        let mut spooled = tempfile::tempfile().unwrap();
        spooled.write_all(&bytes).unwrap();
        let mut file = TiffFile::open(spooled, "out.tif").unwrap();
        let directory = file.directory(0).unwrap();
        let numbers: Vec<u16> = directory.numbers().collect();
        assert!(numbers.is_sorted() && numbers.len() > extra_tags().len() + 15, "{numbers:?}");
        let mut witness = tiff::decoder::Decoder::new(Cursor::new(&bytes)).unwrap();
        for ExtraTag { number, value } in extra_tags() {
            let tag = tiff::tags::Tag::from_u16_exhaustive(number);
            if let TagValue::Text(text) = &value {
                assert_eq!(file.text(&directory, tag).unwrap().as_ref(), Some(text));
                assert_eq!(witness.get_tag_ascii_string(tag).unwrap(), *text);
            } else {
                let wanted = as_numbers(&value);
                assert_eq!(file.numbers(&directory, tag, u64::MAX).unwrap().unwrap(), wanted, "{value:?}");
                assert_eq!(as_the_crate_reads(&witness.get_tag(tag).unwrap()), wanted, "{value:?}");
            }
        }
        assert!(witness.read_image().is_ok());
    }
}

fn as_the_crate_reads(value: &tiff::decoder::ifd::Value) -> Vec<f64> {
    use tiff::decoder::ifd::Value as V;
    match value {
        V::List(values) => values.iter().flat_map(as_the_crate_reads).collect(),
        V::Byte(number) => vec![(*number).into()],
        V::Short(number) => vec![(*number).into()],
        V::Unsigned(number) => vec![(*number).into()],
        V::SignedShort(number) => vec![(*number).into()],
        V::Signed(number) => vec![(*number).into()],
        V::Rational(a, b) => vec![f64::from(*a) / f64::from(*b)],
        V::SRational(a, b) => vec![f64::from(*a) / f64::from(*b)],
        V::Float(number) => vec![(*number).into()],
        V::Double(number) => vec![*number],
        other => panic!("{other:?}"),
    }
}

#[test]
fn tags_that_would_stand_twice_are_refused() {
    let tag = |number| ExtraTag { number, value: TagValue::Shorts(vec![1]) };
    let complaint = |tags: &[ExtraTag]| fields(tags, "out.tif").unwrap_err().to_string();
    for number in OF_THE_WRITER {
        let wanted = format!("out.tif: the tag {number} is set by the writer of the file; it cannot be added");
        assert_eq!(complaint(&[tag(271), tag(number)]), wanted);
    }
    assert_eq!(complaint(&[tag(271), tag(50_706), tag(271)]), "out.tif: the tag 271 is given twice");
    let empty = ExtraTag { number: 271, value: TagValue::Shorts(Vec::new()) };
    assert_eq!(complaint(&[empty]), "out.tif: the tag 271 has no value");

    // And no tag that the writer sets is missing from its list.
    for channels in [1, 5] {
        for kind in [TiffSamples::U16, TiffSamples::F32] {
            let geometry = Geometry { origin: [3, 4], ..frame(30, 20, channels) };
            let tags = TiffTags { description: Some("a frame".into()), software: Some("a program".into()) };
            let samples = samples(600 * channels, kind);
            let mut file = tempfile::tempfile().unwrap();
            file.write_all(&write(&geometry, kind, TiffCompression::Lzw, &tags, &samples, 20).0).unwrap();
            let directory = TiffFile::open(file, "out.tif").unwrap().directory(0).unwrap();
            assert!(directory.numbers().count() >= 19);
            assert!(directory.numbers().all(|number| OF_THE_WRITER.contains(&number)));
        }
    }
}

#[test]
fn long_tags_may_call_for_a_big_tiff() {
    let settings = settings(TiffSamples::F32, TiffCompression::None, &TiffTags::default());
    let geometry = frame(10_000, 107_000, 1);
    let field = |bytes| Field::new(tiff::tags::Tag::Unknown(51_009), tiff::tags::Type::UNDEFINED, vec![0; bytes]);
    // 4 GiB less 107 000 rows of 40 kB leave 15 MB.
    assert!(!needs_big_tiff(&geometry, &settings, &[field(10 << 20)]));
    assert!(needs_big_tiff(&geometry, &settings, &[field(16 << 20)]));
}

#[test]
fn an_incomplete_frame_is_not_finished() {
    let geometry = frame(5, 4, 1);
    let settings = settings(TiffSamples::F32, TiffCompression::None, &TiffTags::default());
    let mut writer = TiffWriter::create(Cursor::new(Vec::new()), "out.tif", &geometry, settings).unwrap();
    writer.write_rows(&[0.0; 15]).unwrap();
    let text = writer.finish().map(|_| ()).unwrap_err().to_string();
    assert_eq!(text, "out.tif: only 3 of 4 rows were written; the file is not complete");
}

/// A file put together by hand: fields with numbers, and chunks as they are to stand in the file.
#[derive(Clone)]
struct Made {
    big_endian: bool,
    big_tiff: bool,
    fields: Vec<(u16, Vec<u32>)>,
    chunks: Vec<Vec<u8>>,
}

impl Made {
    /// A gray image of one strip, 16-bit little-endian: 0, 1, 2 …
    fn gray(width: u32, height: u32) -> Self {
        let strip = (0..width * height).flat_map(|value| (value as u16).to_le_bytes()).collect();
        let fields = vec![
            (256, vec![width]),
            (257, vec![height]),
            (258, vec![16]),
            (259, vec![1]),
            (262, vec![1]),
            (277, vec![1]),
            (278, vec![height]),
        ];
        Self { big_endian: false, big_tiff: false, fields, chunks: vec![strip] }
    }

    fn with(mut self, tag: u16, values: &[u32]) -> Self {
        self.fields.retain(|field| field.0 != tag);
        self.fields.push((tag, values.to_vec()));
        self
    }

    fn bytes(&self) -> Vec<u8> {
        let number = |value: u64, bytes: usize| {
            let mut number = value.to_le_bytes()[..bytes].to_vec();
            if self.big_endian {
                number.reverse();
            }
            number
        };
        let (offset_bytes, count_bytes) = if self.big_tiff { (8, 8) } else { (4, 2) };
        let mut out = if self.big_endian { b"MM".to_vec() } else { b"II".to_vec() };
        if self.big_tiff {
            out.extend([number(43, 2), number(8, 2), number(0, 2)].concat());
        } else {
            out.extend(number(42, 2));
        }
        let link = out.len();
        out.extend(number(0, offset_bytes));
        let (mut offsets, mut counts) = (Vec::new(), Vec::new());
        for chunk in &self.chunks {
            offsets.push(u32::try_from(out.len()).unwrap());
            counts.push(u32::try_from(chunk.len()).unwrap());
            out.extend(chunk);
        }
        let mut fields = self.fields.clone();
        let tiled = fields.iter().any(|field| field.0 == 322);
        let tags = if tiled { (324, 325) } else { (273, 279) };
        for field in [(tags.0, offsets), (tags.1, counts)] {
            if fields.iter().all(|known| known.0 != field.0) {
                fields.push(field);
            }
        }
        fields.sort();
        let mut table = number(fields.len() as u64, count_bytes);
        for (tag, values) in &fields {
            table.extend(number(u64::from(*tag), 2));
            table.extend(number(4, 2));
            table.extend(number(values.len() as u64, offset_bytes));
            let mut value: Vec<u8> = values.iter().flat_map(|value| number(u64::from(*value), 4)).collect();
            if value.len() > offset_bytes {
                let place = out.len() as u64;
                out.extend(value);
                value = number(place, offset_bytes);
            }
            value.resize(offset_bytes, 0);
            table.extend(value);
        }
        table.extend(number(0, offset_bytes));
        let directory = number(out.len() as u64, offset_bytes);
        out[link..link + offset_bytes].copy_from_slice(&directory);
        out.extend(table);
        out
    }
}

#[test]
fn every_kind_of_sample_is_read_in_both_byte_orders() {
    type Bytes = fn(f32) -> Vec<u8>;
    let kinds: [(&str, u32, u32, Bytes); 9] = [
        ("u8", 8, 1, |v| (v as u8).to_be_bytes().into()),
        ("i8", 8, 2, |v| (v as i8).to_be_bytes().into()),
        ("u16", 16, 1, |v| (v as u16).to_be_bytes().into()),
        ("i16", 16, 2, |v| (v as i16).to_be_bytes().into()),
        ("u32", 32, 1, |v| (v as u32).to_be_bytes().into()),
        ("i32", 32, 2, |v| (v as i32).to_be_bytes().into()),
        ("f16", 16, 3, |v| half::f16::from_f32(v).to_be_bytes().into()),
        ("f32", 32, 3, |v| v.to_be_bytes().into()),
        ("f64", 64, 3, |v| f64::from(v).to_be_bytes().into()),
    ];
    for (name, bits, format, bytes) in kinds {
        let values: Vec<f32> = match name {
            "u8" => vec![0.0, 1.0, 2.0, 128.0, 255.0, 3.0],
            "i8" => vec![0.0, -1.0, -128.0, 127.0, 5.0, 3.0],
            "u16" => vec![0.0, 1.0, 65_535.0, 32_768.0, 7.0, 256.0],
            "u32" => vec![0.0, 1.0, 65_536.0, 4_294_966_784.0, 7.0, 256.0],
            _ => vec![0.0, -1.0, 3.0, -1024.0, 1000.0, 2.0],
        };
        for big_endian in [false, true] {
            for big_tiff in [false, true] {
                let mut made = Made::gray(3, 2).with(258, &[bits]).with(339, &[format]);
                (made.big_endian, made.big_tiff) = (big_endian, big_tiff);
                made.chunks = vec![Vec::new()];
                for value in &values {
                    let mut sample = bytes(*value);
                    if !big_endian {
                        sample.reverse();
                    }
                    made.chunks[0].extend(sample);
                }
                let mut reader = open(&made.bytes(), 0).unwrap();
                assert_eq!(reader.stored_as().unwrap().name(), name);
                assert_eq!(read_all(&mut reader, 1).unwrap(), values, "{name} {big_endian}");
            }
        }
    }
}

#[test]
fn tiles_and_planes_are_put_together() {
    // 5x7 pixels of 3 channels; tiles of 4x4 and strips of 3 rows; value = 100·channel + 10·row + column.
    let value = |channel: usize, row: usize, column: usize| 100 * channel + 10 * row + column;
    let mut wanted = Vec::new();
    for row in 0..7 {
        for channel in 0..3 {
            wanted.extend((0..5).map(|column| value(channel, row, column) as f32));
        }
    }
    for (tiled, planar) in [(false, false), (false, true), (true, false), (true, true)] {
        for (method, big_endian) in [(1, false), (8, true), (32_773, false)] {
            let mut made = Made::gray(5, 7).with(262, &[2]).with(277, &[3]).with(258, &[16; 3]);
            made = made.with(284, &[if planar { 2 } else { 1 }]).with(259, &[method]);
            let (width, rows) = if tiled { (4, 4) } else { (5, 3) };
            made = if tiled { made.with(322, &[4]).with(323, &[4]) } else { made.with(278, &[3]) };
            made.big_endian = big_endian;
            made.chunks.clear();
            for plane in 0..if planar { 3 } else { 1 } {
                for top in (0..7).step_by(rows) {
                    for left in (0..5).step_by(width) {
                        let mut chunk = Vec::new();
                        for row in top..if tiled { top + rows } else { 7.min(top + rows) } {
                            for column in left..left + width {
                                for channel in if planar { plane..plane + 1 } else { 0..3 } {
                                    let value = value(channel, row, column) as u16;
                                    chunk.extend(if big_endian { value.to_be_bytes() } else { value.to_le_bytes() });
                                }
                            }
                        }
                        made.chunks.push(match method {
                            8 => chunk::encode(TiffCompression::Deflate, &chunk).unwrap(),
                            // Packed as literals of two bytes.
                            32_773 => chunk.chunks(2).flat_map(|pair| [1, pair[0], pair[1]]).collect(),
                            _ => chunk,
                        });
                    }
                }
            }
            let mut reader = open(&made.bytes(), 0).unwrap();
            for rows in [1, 2, 3, 7] {
                assert_eq!(read_all(&mut reader, rows).unwrap(), wanted, "{tiled} {planar} {method} {rows}");
            }
            // And upward.
            for row in (0..7).rev() {
                let mut samples = [0.0; 15];
                reader.read_rows(row, 1, &mut samples).unwrap();
                assert_eq!(samples, wanted[row * 15..][..15]);
            }
        }
    }
}

#[test]
fn a_damaged_place_is_passed_over_and_said() {
    let place = |made: Made| {
        let reader = open(&made.bytes(), 0).unwrap();
        (reader.geometry().origin, reader.notes().to_vec())
    };
    assert_eq!(place(Made::gray(4, 2).with(286, &[3]).with(287, &[5])), ([3, 5], Vec::new()));
    assert_eq!(place(Made::gray(4, 2).with(286, &[3])), ([0, 0], Vec::new()));
    let (origin, notes) = place(Made::gray(4, 2).with(286, &[3_000_000_000]).with(287, &[5]));
    assert_eq!(origin, [0, 0]);
    assert_eq!(notes, ["its place on the sensor is passed over: it is 3000000000, no whole number of pixels"]);
    let mut bytes = Made::gray(4, 2).with(286, &[3]).with(287, &[5]).bytes();
    let entry = bytes.windows(4).position(|four| four == [30, 1, 4, 0]).unwrap();
    bytes[entry + 2] = 99;
    let reader = open(&bytes, 0).unwrap();
    assert_eq!(reader.geometry().origin, [0, 0]);
    assert!(reader.notes()[0].contains("has type 99"), "{:?}", reader.notes());
}

#[test]
fn white_is_zero_is_inverted_as_openimageio_does() {
    let mut made = Made::gray(4, 1).with(262, &[0]);
    assert_eq!(read_all(&mut open(&made.bytes(), 0).unwrap(), 1).unwrap(), [0.0, 1.0, 2.0, 3.0]);
    made = made.with(258, &[8]);
    made.chunks = vec![vec![0, 1, 254, 255]];
    assert_eq!(read_all(&mut open(&made.bytes(), 0).unwrap(), 1).unwrap(), [255.0, 254.0, 1.0, 0.0]);
}

#[test]
fn a_color_filter_array_is_one_plane() {
    let made = Made::gray(4, 2).with(262, &[32_803]);
    let mut reader = open(&made.bytes(), 0).unwrap();
    assert_eq!(reader.geometry(), &frame(4, 2, 1));
    let wanted: Vec<f32> = (0u8..8).map(f32::from).collect();
    assert_eq!(read_all(&mut reader, 2).unwrap(), wanted);
}

#[test]
fn what_is_not_supported_is_refused_by_name() {
    let gray = || Made::gray(4, 2);
    let refused = |made: Made, words: &str| {
        let text = complaint(&made.bytes());
        assert!(text.contains(words), "{text}");
    };
    refused(gray().with(258, &[12]), "12-bit packed samples");
    refused(gray().with(258, &[1]), "1 bit");
    refused(gray().with(258, &[48]), "48-bit integers");
    refused(gray().with(339, &[6]), "complex");
    refused(gray().with(259, &[50_000]), "ZSTD");
    refused(gray().with(259, &[7]), "JPEG");
    refused(gray().with(259, &[4]), "fax");
    refused(gray().with(262, &[3]), "palette");
    refused(gray().with(262, &[2]), "needs 3 channels");
    refused(gray().with(262, &[6]).with(277, &[3]), "YCbCr");
    refused(gray().with(266, &[2]), "FillOrder 2");
    refused(gray().with(277, &[2]).with(258, &[16, 8]), "stored in different ways");
}

#[test]
fn a_page_is_picked_and_circles_are_noticed() {
    let mut bytes = Made::gray(4, 2).bytes();
    let text = open(&bytes, 1).unwrap_err().to_string();
    assert_eq!(text, "in.tif: there is no image 1 (counted from 0); the file holds one");

    // A second directory, the same but one row less; linked from the first, and then to the first.
    let first = u32::from_le_bytes(bytes[4..8].try_into().unwrap());
    let second = u32::try_from(bytes.len()).unwrap();
    let table = bytes[first as usize..].to_vec();
    let link = bytes.len() - 4;
    bytes[link..].copy_from_slice(&second.to_le_bytes());
    bytes.extend(table);
    let height = second as usize + 2 + 12 + 8;
    bytes[height] = 1;
    assert_eq!(open(&bytes, 0).unwrap().geometry().height, 2);
    assert_eq!(open(&bytes, 1).unwrap().geometry().height, 1);
    assert!(open(&bytes, 2).unwrap_err().to_string().contains("the file holds 2"));
    let link = bytes.len() - 4;
    bytes[link..].copy_from_slice(&first.to_le_bytes());
    assert!(open(&bytes, 1).is_ok());
    assert!(open(&bytes, 2).unwrap_err().to_string().contains("run in a circle"));
}

#[test]
fn a_file_that_was_cut_short_is_never_read_as_zeros() {
    let geometry = frame(30, 20, 1);
    for kind in [TiffSamples::U16, TiffSamples::F32] {
        let samples = samples(600, kind);
        for compression in COMPRESSIONS {
            let (bytes, _) = write(&geometry, kind, compression, &TiffTags::default(), &samples, 20);
            for length in 0..bytes.len() {
                let result = open(&bytes[..length], 0).and_then(|mut reader| read_all(&mut reader, 20));
                // Only the link to the next directory, which is none, can be missed without harm.
                assert!(result.is_err() || length >= bytes.len() - 4, "{length} of {}", bytes.len());
            }
        }
    }
    // The strip is shorter than its rows, though the file goes on.
    assert!(complaint(&Made::gray(4, 2).with(279, &[15]).bytes()).contains("cut short"));
    let strip: Vec<u8> = (0..16).collect();
    for (method, compression) in [(5, TiffCompression::Lzw), (8, TiffCompression::Deflate)] {
        let mut made = Made::gray(4, 2).with(259, &[method]);
        made.chunks = vec![chunk::encode(compression, &strip[..14]).unwrap()];
        assert!(complaint(&made.bytes()).contains("strip 0 ends before its last row"));
        made.chunks = vec![chunk::encode(compression, &strip).unwrap()];
        assert_eq!(read_all(&mut open(&made.bytes(), 0).unwrap(), 2).unwrap()[7], 3854.0);
    }
    let mut made = Made::gray(4, 2).with(259, &[32_773]);
    made.chunks = vec![vec![15, 1, 2, 3]];
    assert!(complaint(&made.bytes()).contains("strip 0 ends before its last row"));
}

#[test]
fn huge_promises_are_refused_before_memory_is_taken() {
    let gray = |width, height| Made::gray(4, 2).with(256, &[width]).with(257, &[height]);
    for method in [1, 5, 8, 32_773] {
        for (width, height) in [(u32::MAX, u32::MAX), (u32::MAX, 1), (1, u32::MAX), (65_535, 65_535)] {
            let made = gray(width, height).with(259, &[method]);
            complaint(&made.clone().with(278, &[height]).bytes());
            complaint(&made.clone().with(278, &[1]).bytes());
            complaint(&made.clone().with(277, &[65_535]).with(258, &[16]).bytes());
            complaint(&made.with(322, &[u32::MAX]).with(323, &[u32::MAX]).bytes());
        }
    }
    // Enough bytes for it, but too large a piece for memory.
    let mut made = gray(40_000, 40_000).with(259, &[8]).with(278, &[40_000]);
    made.chunks = vec![vec![0; 4 << 20]];
    assert!(complaint(&made.bytes()).contains("40000 rows would become 3051 MiB at a time of a file of 4096 KiB"));
    made.chunks = vec![vec![0; 48 << 20]];
    assert!(complaint(&made.bytes()).contains("compressed as one piece of 3051 MiB"));
    // Strips that share their bytes.
    let made = Made::gray(4, 2).with(257, &[400]).with(278, &[2]);
    let made = made.with(273, &[8; 200]).with(279, &[16; 200]);
    assert!(complaint(&made.bytes()).contains("overlap"));
}

#[test]
fn a_single_strip_that_is_not_compressed_may_be_huge() {
    // 3 GB on paper; the file is sparse.
    let (width, height) = (30_000u32, 50_000u32);
    let mut made = Made::gray(width, 1).with(257, &[height]).with(278, &[height]);
    made = made.with(279, &[width * height * 2]).with(273, &[1 << 20]);
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(&made.bytes()).unwrap();
    file.set_len(4_000_000_000).unwrap();
    let mark = (1u64 << 20) + (u64::from(width) * (u64::from(height) - 1) + 5) * 2;
    std::io::Seek::seek(&mut file, std::io::SeekFrom::Start(mark)).unwrap();
    file.write_all(&777u16.to_le_bytes()).unwrap();
    let mut reader = TiffReader::open(file, "in.tif", 0).unwrap();
    assert!(reader.natural_rows() * 30_000 <= 1 << 20);
    let mut samples = vec![f32::NAN; 30_000 * 3];
    reader.read_rows(49_997, 3, &mut samples).unwrap();
    assert_eq!(samples[60_005], 777.0);
    assert_eq!(samples.iter().sum::<f32>(), 777.0);
}

#[test]
fn damage_anywhere_is_an_error_or_other_samples_but_no_panic() {
    let mut state = 7u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as usize % below
    };
    let mut tiles = Made::gray(40, 40).with(322, &[16]).with(323, &[16]).with(259, &[5]);
    tiles.chunks = vec![chunk::encode(TiffCompression::Lzw, &[9; 512]).unwrap(); 9];
    let mut files = vec![tiles.bytes()];
    for compression in COMPRESSIONS {
        let geometry = frame(30, 20, 3);
        let samples = samples(1800, TiffSamples::F32);
        let tags = TiffTags::default();
        files.push(write(&geometry, TiffSamples::F32, compression, &tags, &samples, 20).0);
    }
    for file in files {
        for _ in 0..1500 {
            let mut bytes = file.clone();
            for _ in 0..=random(3) {
                let from_end = random(2) == 0;
                let place = if from_end { bytes.len() - 1 - random(220) } else { random(bytes.len()) };
                bytes[place] = [0, 1, 255, 128, random(256) as u8][random(5)];
            }
            if let Ok(mut reader) = open(&bytes, 0) {
                let geometry = reader.geometry().clone();
                let rows = reader.natural_rows().min(geometry.height);
                let mut samples = vec![0.0; rows * geometry.row_samples()];
                for row in (0..geometry.height - rows + 1).step_by(rows).take(50) {
                    if reader.read_rows(row, rows, &mut samples).is_err() {
                        break;
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_no_tiff_is_told_so() {
    assert_eq!(complaint(b""), "in.tif: the file is empty");
    for bytes in [&b"II*"[..], b"\x89PNG\r\n\x1a\n0123", b"II*\0\0\0\0\0", b"MM\0*\xff\xff\xff\xff"] {
        complaint(bytes);
    }
    assert!(TiffReader::open(File::open(".").unwrap(), "in.tif", 0).is_err());
}
