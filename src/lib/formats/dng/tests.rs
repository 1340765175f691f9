//! Small files that the tests make, and those of a camera where they are at hand.

#![expect(clippy::cast_possible_truncation, reason = "tests, with values chosen to fit")]

use super::{DngReader, RawArea};
use crate::camera::levels::{BlackLevel, WhiteLevel};
use crate::cfa::FilterArray;
use crate::formats::format::SampleReader;
use crate::formats::ljpeg::tests::{Encoding, encode, samples};
use crate::metadata::FrameHeader;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Seek, Write};
use std::path::Path;

/// The tags of an image by number: type, and values as numbers (of ratios dividend and divisor).
type Tags = BTreeMap<u16, (u16, Vec<f64>)>;

/// An image: its tags, and the bytes of its strips or tiles.
#[derive(Debug, Clone, Default)]
struct Image {
    tags: Tags,
    chunks: Vec<Vec<u8>>,
    big_endian: bool,
}

const BYTE: u16 = 1;
const TEXT: u16 = 2;
const SHORT: u16 = 3;
const UNDEFINED: u16 = 7;
const LONG: u16 = 4;
const RATIO: u16 = 5;
const SIGNED_RATIO: u16 = 10;

impl Image {
    /// An image behind R G / G B of so many bits, without its samples.
    fn new(width: usize, height: usize, bits: u32) -> Self {
        let image = Self::default().with(256, LONG, &[width as f64]).with(257, LONG, &[height as f64]);
        let image = image.with(258, SHORT, &[f64::from(bits)]).with(259, SHORT, &[1.0]).with(262, SHORT, &[32803.0]);
        let image = image.with(277, SHORT, &[1.0]).with(33421, SHORT, &[2.0, 2.0]);
        image.with(33422, BYTE, &[0.0, 1.0, 1.0, 2.0]).with(50706, BYTE, &[1.0, 4.0, 0.0, 0.0])
    }

    fn with(mut self, tag: u16, kind: u16, values: &[f64]) -> Self {
        self.tags.insert(tag, (kind, values.to_vec()));
        self
    }

    fn without(mut self, tag: u16) -> Self {
        self.tags.remove(&tag);
        self
    }

    fn text(self, tag: u16, text: &str) -> Self {
        self.with(tag, TEXT, &text.bytes().chain([0]).map(f64::from).collect::<Vec<_>>())
    }

    fn size(&self) -> [usize; 2] {
        [256, 257].map(|tag| self.tags[&tag].1[0] as usize)
    }

    fn bits(&self) -> u32 {
        self.tags[&258].1[0] as u32
    }

    /// Samples in strips of so many rows, each made into bytes by `store`, from its samples and their number in a row.
    fn strips(mut self, all: &[u16], rows: usize, store: impl Fn(&Self, &[u16], usize) -> Vec<u8>) -> Self {
        let width = self.size()[0];
        self.chunks = all.chunks(rows * width).map(|strip| store(&self, strip, width)).collect();
        self.with(278, LONG, &[rows as f64])
    }

    /// The same in tiles; those at the edges hang over, and hold the last sample there.
    fn tiles(
        mut self,
        all: &[u16],
        [across, down]: [usize; 2],
        store: impl Fn(&Self, &[u16], usize) -> Vec<u8>,
    ) -> Self {
        let [width, height] = self.size();
        for top in (0..height).step_by(down) {
            for left in (0..width).step_by(across) {
                let rows = (top..top + down).map(|y| y.min(height - 1));
                let tile: Vec<u16> =
                    rows.flat_map(|y| (left..left + across).map(move |x| all[y * width + x.min(width - 1)])).collect();
                let stored = store(&self, &tile, across);
                self.chunks.push(stored);
            }
        }
        self.with(322, LONG, &[across as f64]).with(323, LONG, &[down as f64])
    }

    /// Samples as they are, packed where they have not 8 or 16 bits.
    fn plain(&self, samples: &[u16], row: usize) -> Vec<u8> {
        match self.bits() {
            8 => samples.iter().map(|sample| *sample as u8).collect(),
            16 if self.big_endian => samples.iter().flat_map(|sample| sample.to_be_bytes()).collect(),
            16 => samples.iter().flat_map(|sample| sample.to_le_bytes()).collect(),
            bits => samples.chunks(row).flat_map(|row| packed(row, bits)).collect(),
        }
    }

    /// The same, deflated.
    fn deflated(&self, samples: &[u16], row: usize) -> Vec<u8> {
        deflate(&self.plain(samples, row))
    }

    /// The bytes of a file with this image, and others below it.
    fn file(&self, below: &[Self]) -> Vec<u8> {
        let mut out = if self.big_endian { b"MM\0*\0\0\0\0".to_vec() } else { b"II*\0\0\0\0\0".to_vec() };
        let places: Vec<f64> = below.iter().map(|image| f64::from(image.append(self.big_endian, &mut out))).collect();
        let first = if places.is_empty() { self.clone() } else { self.clone().with(330, LONG, &places) };
        let place = first.append(self.big_endian, &mut out);
        out[4..8].copy_from_slice(&number(place.into(), LONG, self.big_endian));
        out
    }

    /// Appends chunks, values and directory; gives the place of the directory.
    fn append(&self, big_endian: bool, out: &mut Vec<u8>) -> u32 {
        let tiled = self.tags.contains_key(&322);
        let mut image = self.clone();
        if !self.chunks.is_empty() {
            let mut places = Vec::new();
            for chunk in &self.chunks {
                places.push(out.len() as f64);
                out.extend(chunk);
            }
            let counts: Vec<f64> = self.chunks.iter().map(|chunk| chunk.len() as f64).collect();
            let [offsets_tag, counts_tag] = if tiled { [324, 325] } else { [273, 279] };
            image = image.with(offsets_tag, LONG, &places).with(counts_tag, LONG, &counts);
        }
        let mut table = number(image.tags.len() as f64, SHORT, big_endian);
        for (tag, (kind, values)) in &image.tags {
            let mut bytes: Vec<u8> = values.iter().flat_map(|value| number(*value, *kind, big_endian)).collect();
            let count = if [RATIO, SIGNED_RATIO].contains(kind) { values.len() / 2 } else { values.len() };
            if bytes.len() > 4 {
                let place = out.len();
                out.extend(bytes);
                bytes = number(place as f64, LONG, big_endian);
            }
            bytes.resize(4, 0);
            table.extend(
                [number(f64::from(*tag), SHORT, big_endian), number(f64::from(*kind), SHORT, big_endian)].concat(),
            );
            table.extend([number(count as f64, LONG, big_endian), bytes].concat());
        }
        let place = u32::try_from(out.len()).unwrap();
        out.extend(table);
        out.extend([0; 4]);
        place
    }
}

/// One number of a type; of ratios the dividend or the divisor.
fn number(value: f64, kind: u16, big_endian: bool) -> Vec<u8> {
    let length = match kind {
        BYTE | TEXT | UNDEFINED => 1,
        SHORT => 2,
        _ => 4,
    };
    let whole = (value as i64).to_le_bytes();
    let bytes = whole[..length].iter().copied();
    if big_endian { bytes.rev().collect() } else { bytes.collect() }
}

fn packed(row: &[u16], bits: u32) -> Vec<u8> {
    let all: Vec<bool> = row.iter().flat_map(|sample| (0..bits).rev().map(move |bit| sample >> bit & 1 == 1)).collect();
    all.chunks(8).map(|eight| (0..8).fold(0, |byte, bit| byte << 1 | u8::from(eight.get(bit) == Some(&true)))).collect()
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(1));
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn open(bytes: &[u8], part: RawArea) -> crate::error::Result<DngReader> {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file.rewind().unwrap();
    DngReader::open(file, "a.dng", part)
}

/// All samples, read so many rows at a time.
fn read(mut reader: DngReader, step: usize) -> crate::error::Result<Vec<f32>> {
    let height = reader.geometry().height;
    let mut samples = Vec::new();
    let mut row = 0;
    while row < height {
        let rows = step.min(height - row);
        reader.read(rows, &mut samples)?;
        row += rows;
    }
    Ok(samples)
}

/// Samples of an image as floats.
fn all(image: &Image) -> Vec<f32> {
    let reader = open(&image.file(&[]), RawArea::Full).unwrap();
    read(reader, 5).unwrap()
}

fn floats(samples: &[u16]) -> Vec<f32> {
    samples.iter().map(|sample| f32::from(*sample)).collect()
}

fn refused(image: &Image) -> String {
    let found = open(&image.file(&[]), RawArea::Active).and_then(|reader| read(reader, 7));
    found.map_or_else(|error| error.to_string(), |_| "it is taken".into())
}

#[test]
fn samples_of_every_depth_are_read() {
    for bits in 8..=16 {
        let wanted = samples(37 * 23, bits, bits.into());
        for big_endian in [false, true] {
            let image = Image { big_endian, ..Image::new(37, 23, bits) };
            for rows in [1, 4, 23, 40] {
                let stored = image.clone().strips(&wanted, rows, Image::plain);
                assert_eq!(all(&stored), floats(&wanted), "{bits} bits in strips of {rows}");
                let stored = image.clone().with(259, SHORT, &[8.0]).strips(&wanted, rows, Image::deflated);
                assert_eq!(all(&stored), floats(&wanted), "{bits} bits in deflated strips of {rows}");
            }
            for size in [[16, 16], [37, 23], [48, 32], [5, 3]] {
                let stored = image.clone().tiles(&wanted, size, Image::plain);
                assert_eq!(all(&stored), floats(&wanted), "{bits} bits in tiles of {size:?}");
            }
        }
    }
}

#[test]
fn any_part_is_read_in_any_steps() {
    let wanted = samples(40 * 30, 14, 1);
    let jpeg = |with: Encoding| move |_: &Image, samples: &[u16], row: usize| encode(samples, row, &with);
    let one = Encoding { precision: 14, ..Encoding::default() };
    let two = Encoding { components: 2, predictor: 6, restart_rows: 2, ..one.clone() };
    let image = Image::new(40, 30, 14).with(50829, LONG, &[3.0, 7.0, 29.0, 38.0]);
    let image = image.with(50719, LONG, &[2.0, 1.0]).with(50720, RATIO, &[20.0, 1.0, 30.0, 3.0]);
    let as_jpeg = image.clone().with(259, SHORT, &[7.0]);
    for stored in [
        image.clone().strips(&wanted, 4, Image::plain),
        image.clone().tiles(&wanted, [16, 8], Image::plain),
        as_jpeg.clone().strips(&wanted, 30, jpeg(one)),
        as_jpeg.clone().tiles(&wanted, [16, 16], jpeg(two)),
    ] {
        let file = stored.file(&[]);
        let parts =
            [(RawArea::Active, [7, 3, 31, 26]), (RawArea::Full, [0, 0, 40, 30]), (RawArea::Default, [9, 4, 20, 10])];
        for (part, [left, top, width, height]) in parts {
            let rows = (top..top + height).flat_map(|y| wanted[y * 40 + left..][..width].to_vec());
            let rows: Vec<f32> = rows.map(f32::from).collect();
            for step in [1, 3, 8, 40] {
                let reader = open(&file, part).unwrap();
                assert_eq!(reader.geometry().origin, [left as i32, top as i32]);
                assert_eq!(read(reader, step).unwrap(), rows, "{part:?} by {step}");
            }
        }
    }
}

/// The specification asks that the number of samples is that of the tile, not that rows are those of it.
#[test]
fn rows_of_a_jpeg_need_not_be_those_of_its_tile() {
    let wanted = samples(24 * 16, 12, 3);
    for (row, components) in [(24, 1), (24, 2), (48, 1), (48, 4), (12, 1), (12, 3), (96, 2)] {
        let with = Encoding { precision: 12, components, predictor: 4, ..Encoding::default() };
        let image = Image::new(24, 16, 12).with(259, SHORT, &[7.0]);
        let stored = image.tiles(&wanted, [24, 16], |_, samples, _| encode(samples, row, &with));
        assert_eq!(all(&stored), floats(&wanted), "rows of {row} with {components} components");
    }
}

#[test]
fn differences_before_deflate_are_added_up() {
    let wanted = samples(24 * 10, 16, 9);
    for (predictor, step) in [(2.0, 1), (34892.0, 2), (34893.0, 4)] {
        for big_endian in [false, true] {
            let image = Image { big_endian, ..Image::new(24, 10, 16) };
            let image = image.with(259, SHORT, &[8.0]).with(317, SHORT, &[predictor]);
            let stored = image.strips(&wanted, 4, |image, samples, row| {
                let differences: Vec<u16> = samples
                    .iter()
                    .enumerate()
                    .map(|(at, sample)| sample.wrapping_sub(if at % row < step { 0 } else { samples[at - step] }))
                    .collect();
                deflate(&image.plain(&differences, row))
            });
            assert_eq!(all(&stored), floats(&wanted), "predictor {predictor}");
        }
    }
}

/// The bytes of a float from the highest on, which 16 bits of mantissa and 7 of exponent hold.
fn float_bytes(value: f32, bits: u32) -> Vec<u8> {
    match bits {
        16 => half::f16::from_f32(value).to_be_bytes().to_vec(),
        24 if value == 0.0 => vec![0; 3],
        24 => {
            let word = value.to_bits();
            let exponent = (word >> 23 & 0xFF) + 63 - 127;
            (word >> 31 << 23 | exponent << 16 | word >> 7 & 0xFFFF).to_be_bytes()[1..].to_vec()
        }
        _ => value.to_be_bytes().to_vec(),
    }
}

#[test]
fn floats_are_read_with_and_without_differences() {
    let wanted: Vec<f32> = samples(24 * 6, 9, 4).iter().map(|sample| f32::from(*sample) / 64.0 - 1.5).collect();
    for bits in [16, 24, 32] {
        let image = Image::new(24, 6, bits).with(339, SHORT, &[3.0]);
        let bytes: Vec<Vec<u8>> = wanted.iter().map(|value| float_bytes(*value, bits)).collect();
        for big_endian in [false, true] {
            let image = Image { big_endian, ..image.clone() };
            let ordered = bytes
                .iter()
                .map(|bytes| if big_endian { bytes.clone() } else { bytes.iter().rev().copied().collect::<Vec<u8>>() });
            let plain: Vec<u8> = ordered.flatten().collect();
            let strip = |chunk: Vec<u8>, compression: f64, predictor: f64| {
                let image = image.clone().with(259, SHORT, &[compression]).with(317, SHORT, &[predictor]);
                Image { chunks: vec![chunk], ..image }
            };
            assert_eq!(all(&strip(plain.clone(), 1.0, 1.0)), wanted, "{bits} bits");
            assert_eq!(all(&strip(deflate(&plain), 8.0, 1.0)), wanted, "{bits} bits, deflated");
            for (predictor, step) in [(3.0, 1), (34894.0, 2), (34895.0, 4)] {
                let differences: Vec<u8> = bytes
                    .chunks(24)
                    .flat_map(|row| {
                        let size = row[0].len();
                        let planes: Vec<u8> = (0..size).flat_map(|place| row.iter().map(move |b| b[place])).collect();
                        let less = |at: usize| planes[at].wrapping_sub(if at < step { 0 } else { planes[at - step] });
                        (0..planes.len()).map(less).collect::<Vec<u8>>()
                    })
                    .collect();
                assert_eq!(all(&strip(deflate(&differences), 8.0, predictor)), wanted, "{bits} bits, {predictor}");
            }
        }
    }
    // The specification's white level of floats is 1.
    let image = Image { chunks: vec![vec![0; 24 * 6 * 4]], ..Image::new(24, 6, 32).with(339, SHORT, &[3.0]) };
    let reader = open(&image.file(&[]), RawArea::Active).unwrap();
    assert_eq!(reader.own_tags().white_level_adu, Some(WhiteLevel::Uniform(1.0)));
    assert_eq!(reader.own_tags().black_level_adu, Some(BlackLevel::Uniform(0.0)));
}

#[test]
fn levels_and_filters_hang_on_the_corner_of_the_sensor() {
    let image = Image::new(8, 6, 12).strips(&samples(48, 12, 1), 6, Image::plain);
    // Row 1, column 3: what stands at the corner of the active area belongs to an odd row and an odd column.
    let image = image.with(50829, LONG, &[1.0, 3.0, 6.0, 8.0]).with(50717, SHORT, &[4000.0]);
    let image = image.with(50713, SHORT, &[2.0, 2.0]).with(50714, RATIO, &[1.0, 2.0, 2.0, 1.0, 3.0, 1.0, 4.0, 1.0]);
    let rows = [1.0, 1.0, 2.0, 1.0, 3.0, 1.0, 4.0, 1.0, -5.0, 2.0];
    let image = image.with(50716, SIGNED_RATIO, &rows).with(50715, SIGNED_RATIO, &[0.0, 1.0].repeat(5));
    let reader = open(&image.file(&[]), RawArea::Active).unwrap();
    let metadata = reader.own_tags();
    assert_eq!(metadata.cfa, Some("bggr".parse().unwrap()));
    assert_eq!(metadata.black_level_adu, Some(BlackLevel::Sites([4.0, 3.0, 2.0, 0.5])));
    assert_eq!(metadata.black_by_row, [0.0, 1.0, 2.0, 3.0, 4.0, -2.5]);
    assert!(metadata.black_by_column.is_empty());
    assert_eq!(metadata.white_level_adu, Some(WhiteLevel::Uniform(4000.0)));
    assert_eq!(reader.geometry().origin, [3, 1]);

    // Periods that are those of 2x2 sites, said at length.
    let alike = image.clone().with(50713, SHORT, &[3.0, 3.0]).with(50714, SHORT, &[7.0; 9]);
    let reader = open(&alike.file(&[]), RawArea::Active).unwrap();
    assert_eq!(reader.own_tags().black_level_adu, Some(BlackLevel::Uniform(7.0)));
    let wide = image.with(50713, SHORT, &[1.0, 4.0]).with(50714, SHORT, &[1.0, 2.0, 1.0, 2.0]);
    let reader = open(&wide.file(&[]), RawArea::Active).unwrap();
    assert_eq!(reader.own_tags().black_level_adu, Some(BlackLevel::Sites([2.0, 1.0, 2.0, 1.0])));
}

/// Levels of more than 2x2 sites, by what they are said to be at each photosite: sums of sites, rows and columns to the bit; others are
/// not known, and are told.
#[test]
fn black_levels_that_repeat_after_more_sites_are_sums_or_not_known() {
    let image = Image::new(11, 9, 12).strips(&samples(99, 12, 1), 9, Image::plain).with(50717, SHORT, &[4000.0]);
    let image = image.with(50829, LONG, &[1.0, 3.0, 9.0, 11.0]).with(50716, SIGNED_RATIO, &[1.0, 4.0].repeat(8));
    for [rows, columns] in [[4, 4], [1, 3], [6, 1], [3, 5], [4, 2]] {
        let sum = |y: usize, x: usize| (100 + y * y * 3 % 17 + x * x * 5 % 13) as f64;
        let levels: Vec<f64> = (0..rows).flat_map(|y| (0..columns).map(move |x| sum(y, x))).collect();
        let told = image.clone().with(50713, SHORT, &[rows as f64, columns as f64]).with(50714, SHORT, &levels);
        let reader = open(&told.file(&[]), RawArea::Active).unwrap();
        let metadata = reader.own_tags().clone();
        let frame = FrameHeader { name: "a".into(), geometry: reader.geometry().clone(), metadata };
        let black = frame.black_levels().unwrap().unwrap();
        for (y, x) in (0..8).flat_map(|y| (0..8).map(move |x| (y, x))) {
            assert_eq!(black.row(y).at(x), sum(y % rows, x % columns) + 0.25, "{rows}x{columns} {y} {x}");
        }
    }
    // A color of a quad array each, of which the last is no sum.
    let quad: Vec<f64> = (0..16).map(|at| [64.0, 65.0, 66.0, 70.0][at / 8 * 2 + at % 4 / 2]).collect();
    let told = image.with(50713, SHORT, &[4.0, 4.0]).with(50714, SHORT, &quad);
    let reader = open(&told.file(&[]), RawArea::Active).unwrap();
    assert_eq!(reader.own_tags().black_level_adu, None);
    assert!(reader.own_tags().black_by_column.is_empty());
}

#[test]
fn other_arrays_are_told() {
    let image = Image::new(12, 12, 12).strips(&samples(144, 12, 1), 12, Image::plain);
    let trans = "GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG".bytes().map(|letter| match letter {
        b'R' => 0.0,
        b'G' => 1.0,
        _ => 2.0,
    });
    let trans: Vec<f64> = trans.collect();
    let image = image.with(33421, SHORT, &[6.0, 6.0]).with(33422, BYTE, &trans);
    let image = image.with(50829, LONG, &[2.0, 5.0, 12.0, 12.0]);
    let reader = open(&image.file(&[]), RawArea::Active).unwrap();
    let array = reader.own_tags().cfa.unwrap();
    assert_eq!(array.in_words(), "an X-Trans filter array");
    let at_corner: FilterArray = "6x6:GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG".parse().unwrap();
    assert!((0..12).all(|y| (0..12).all(|x| array.class(5 + x, 2 + y) == at_corner.class(x, y))));

    for photometric in [1.0, 34892.0] {
        let image = Image::new(4, 2, 16).with(262, SHORT, &[photometric]).without(33421).without(33422);
        let image = image.strips(&samples(8, 16, 1), 2, Image::plain);
        let reader = open(&image.file(&[]), RawArea::Active).unwrap();
        assert_eq!(reader.own_tags().cfa, Some(FilterArray::Monochrome));
    }
}

#[test]
fn a_table_makes_samples_linear() {
    let image = Image::new(4, 2, 8).strips(&[0, 1, 2, 3, 3, 2, 200, 255], 2, Image::plain);
    let image = image.with(50712, SHORT, &[0.0, 10.0, 1000.0, 60000.0]).with(50717, LONG, &[60000.0]);
    let reader = open(&image.file(&[]), RawArea::Active).unwrap();
    assert!(reader.notes().iter().any(|note| note.contains("LinearizationTable")));
    let wanted = [0.0, 10.0, 1000.0, 60000.0, 60000.0, 1000.0, 60000.0, 60000.0];
    assert_eq!(read(reader, 1).unwrap(), wanted);
}

#[test]
fn the_largest_image_of_full_size_is_the_raw_one() {
    let (small, large) = (samples(8 * 6, 14, 1), samples(16 * 12, 14, 2));
    let preview = Image::new(99, 99, 8).with(254, LONG, &[1.0]);
    let first = Image::new(8, 6, 14).with(254, LONG, &[1.0]).with(33434, RATIO, &[1.0, 30.0]);
    let below = [
        Image::new(8, 6, 14).strips(&small, 6, Image::plain),
        Image::new(16, 12, 14).strips(&large, 3, Image::plain),
        preview.clone(),
    ];
    let reader = open(&first.file(&below), RawArea::Active).unwrap();
    assert_eq!(
        reader.notes(),
        [String::from(
            "its exposure time of 0.03333333333333333 s tells dark frames apart and no more: it has no f-number (FNumber)"
        )]
    );
    assert_eq!(read(reader, 5).unwrap(), floats(&large));

    let complaint =
        |first: &Image, below: &[Image]| open(&first.file(below), RawArea::Active).err().unwrap().to_string();
    assert!(complaint(&preview, &[]).starts_with("a.dng: it is a DNG without a raw image"));
    let planes = Image::new(16, 12, 16).with(262, SHORT, &[34892.0]).with(277, SHORT, &[3.0]);
    assert!(complaint(&preview, &[planes]).starts_with("a.dng: it is a DNG whose planes are demosaicked (LinearRaw)"));
}

#[test]
fn exposure_and_metadata_of_ours_are_found() {
    let image = Image::new(4, 2, 16).strips(&samples(8, 16, 1), 2, Image::plain);
    let image = image.with(33434, RATIO, &[1.0, 50.0]).with(33437, RATIO, &[56.0, 10.0]).with(274, SHORT, &[6.0]);
    let image = image.text(270, "schema: cyanometer/1\nquantity: adu\n");
    let reader = open(&image.file(&[]), RawArea::Active).unwrap();
    let exposure = reader.own_tags().exposure.unwrap();
    assert_eq!((exposure.exposure_s, exposure.f_number, exposure.lens_transmittance), (0.02, 5.6, 1.0));
    assert!(reader.embedded().is_some_and(|text| text.contains("adu")));
    assert!(reader.notes().iter().any(|note| note.contains("Orientation")));
    // A lens without contacts.
    let image = image.with(33437, RATIO, &[0.0, 0.0]).text(270, "a chart");
    let reader = open(&image.file(&[]), RawArea::Active).unwrap();
    assert_eq!((reader.own_tags().exposure, reader.embedded()), (None, None));
}

/// 2⁻⁶ s at f/4.
#[test]
fn exposures_told_by_logarithms_alone_are_read() {
    let image = Image::new(4, 2, 16).strips(&samples(8, 16, 1), 2, Image::plain);
    let image = image.with(37377, SIGNED_RATIO, &[6.0, 1.0]).with(37378, RATIO, &[8.0, 2.0]);
    let reader = open(&image.file(&[]), RawArea::Active).unwrap();
    let exposure = reader.own_tags().exposure.unwrap();
    assert_eq!((exposure.exposure_s, exposure.f_number), (1.0 / 64.0, 4.0));
    assert_eq!(reader.notes().iter().filter(|note| note.contains("by logarithms alone")).count(), 2);
    // The numbers themselves count before them.
    let reader = open(&image.with(33434, RATIO, &[1.0, 60.0]).file(&[]), RawArea::Active).unwrap();
    assert_eq!(reader.own_tags().exposure.unwrap().exposure_s, 1.0 / 60.0);
}

/// Blue, green and red are the same camera as red, green and blue.
#[test]
fn classes_in_another_order_have_the_same_matrix_and_noise() {
    let tags = |order: [usize; 3]| {
        let rows = [[0.9, 0.1, -0.1], [-0.3, 1.2, 0.2], [0.1, 0.1, 0.7]];
        let ratios = |numbers: &[f64]| numbers.iter().flat_map(|number| [number * 1e4, 1e4]).collect::<Vec<_>>();
        let neutral = [0.5, 1.0, 0.6];
        let profile = [[1e-3, 1e-4], [2e-3, 2e-4], [3e-3, 3e-4]];
        let image = Image::new(4, 2, 16)
            .strips(&samples(8, 16, 1), 2, Image::plain)
            .with(50710, BYTE, &order.map(|class| class as f64))
            .with(50721, SIGNED_RATIO, &ratios(&order.map(|class| rows[class]).concat()))
            .with(50728, RATIO, &ratios(&order.map(|class| neutral[class])))
            .with(51041, RATIO, &ratios(&order.map(|class| profile[class]).concat()));
        let reader = open(&image.file(&[]), RawArea::Active).unwrap();
        let metadata = reader.own_tags().clone();
        (metadata.relative_matrix.unwrap().xyz_from_camera, metadata.noise_profile.unwrap().lines)
    };
    let (matrix, lines) = tags([0, 1, 2]);
    for order in [[2, 1, 0], [1, 2, 0]] {
        let (other, of_other) = tags(order);
        assert_eq!(of_other, lines);
        // Inverses of matrices of permuted rows differ by rounding.
        let off = matrix.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{order:?}: {other:?}, not {matrix:?}");
    }
}

#[test]
#[allow(clippy::too_many_lines, reason = "a table of cases")]
fn what_cannot_be_read_is_refused_by_name() {
    let image = Image::new(8, 6, 12).strips(&samples(48, 12, 1), 6, Image::plain);
    let jpeg = |stream: Vec<u8>| Image { chunks: vec![stream], ..image.clone().with(259, SHORT, &[7.0]) };
    let whole = encode(&samples(48, 12, 1), 8, &Encoding { precision: 12, ..Encoding::default() });
    let mut lossy = whole.clone();
    let at = lossy.windows(2).position(|two| two == [0xFF, 0xC3]).unwrap();
    lossy[at + 1] = 0xC1;
    let float = |bits: f64| image.clone().with(339, SHORT, &[3.0]).with(258, SHORT, &[bits]);
    for (image, wanted) in [
        (image.clone().with(259, SHORT, &[34892.0]), "its raw image is lossy JPEG, which is not supported; convert it"),
        (image.clone().with(259, SHORT, &[52546.0]), "its raw image is JPEG XL, which is not supported; convert it"),
        (image.clone().with(259, SHORT, &[999.0]), "its raw image has compression 999, which is not known"),
        (image.clone().with(266, SHORT, &[2.0]), "bits in reversed order (FillOrder 2) are not supported"),
        (image.clone().with(258, SHORT, &[32.0]), "its raw samples have 32 bits in sample format 1"),
        (float(64.0), "its raw samples have 64 bits in sample format 3"),
        (image.clone().with(50974, LONG, &[2.0, 2.0]), "in another order than that of the sensor (SubTileBlockSize)"),
        (image.clone().with(50975, LONG, &[2.0]), "in another order than that of the sensor (RowInterleaveFactor)"),
        (image.clone().with(52547, LONG, &[2.0]), "in another order than that of the sensor (ColumnInterleaveFactor)"),
        (image.clone().without(258), "lacks BitsPerSample"),
        (image.clone().with(277, SHORT, &[2.0]), "its raw image has 2 samples at a photosite"),
        (
            image.clone().with(259, SHORT, &[8.0]).with(317, SHORT, &[2.0]),
            "has predictor 2, which does not exist for integers of 12 bits",
        ),
        (image.clone().with(50711, SHORT, &[2.0]), "staggered rows or columns (CFALayout 2)"),
        (image.clone().without(33421), "lacks CFARepeatPatternDim"),
        (
            image.clone().with(33421, SHORT, &[4.0, 4.0]),
            "its CFAPattern has 4 filters, and CFARepeatPatternDim asks for 4x4",
        ),
        (image.clone().with(33421, SHORT, &[65535.0, 65535.0]), "CFARepeatPatternDim asks for 65535x65535"),
        (image.clone().with(33421, SHORT, &[9.0, 2.0]).with(33422, BYTE, &[0.0; 18]), "a period of 2x9 sites"),
        (image.clone().with(33422, BYTE, &[0.0, 1.0, 1.0, 7.0]), "its CFAPattern has a filter 7"),
        (image.clone().with(50706, BYTE, &[99.0, 0.0, 0.0, 0.0]), "it asks for a reader of version 99.0 of DNG"),
        (
            image.clone().with(50829, LONG, &[0.0, 0.0, 7.0, 8.0]),
            "its ActiveArea, rows 0 to 7 and columns 0 to 8, does not lie",
        ),
        (image.clone().with(50829, LONG, &[4.0, 0.0, 3.0, 8.0]), "its ActiveArea"),
        (image.clone().with(50829, LONG, &[0.0, 0.0, 6.0]), "its tag ActiveArea has 3 of 4 numbers"),
        (image.clone().with(50714, SHORT, &[4095.0]), "its BlackLevel, 4095, is no less than its WhiteLevel, 4095"),
        (image.clone().with(50714, RATIO, &[1.0, 0.0]), "its tag BlackLevel has a number that is divided by zero"),
        (image.clone().with(50714, RATIO, &[0.0, 0.0]), "its tag BlackLevel has a number that is 0/0"),
        (image.clone().with(50713, SHORT, &[0.0, 2.0]), "its BlackLevelRepeatDim is 0x2"),
        (
            image.clone().with(50713, SHORT, &[2.0, 2.0]).with(50714, SHORT, &[1.0]),
            "its BlackLevel has 1 numbers, and 4 are asked for",
        ),
        (image.clone().with(50714, SHORT, &[1.0, 2.0, 3.0, 4.0]), "its BlackLevel has 4 numbers, and 1 is asked for"),
        (
            image.clone().with(50713, SHORT, &[2.0, 2.0]).with(50714, SHORT, &[1.0, 1.0, 2.0, 2.0, 1.0]),
            "its BlackLevel has 5 numbers, and 4 are asked for",
        ),
        (image.clone().with(50717, SHORT, &[4000.0, 4001.0]), "its WhiteLevel has 2 numbers, and 1 is asked for"),
        (image.clone().with(33422, BYTE, &[0.0, 1.0, 1.0, 2.0, 0.0]), "its CFAPattern has more filters"),
        (image.clone().with(50829, LONG, &[0.0, 0.0, 6.0, 8.0, 1.0]), "its tag ActiveArea has more than 4 numbers"),
        (
            image.clone().with(50716, SIGNED_RATIO, &[1.0, 1.0]),
            "its BlackLevelDeltaV has 1 numbers, and the active area has 6 rows",
        ),
        (
            image.clone().with(50715, SIGNED_RATIO, &[1.0; 18]),
            "its BlackLevelDeltaH has more numbers, and the active area has 8 columns",
        ),
        (image.clone().with(50717, RATIO, &[0.0, 0.0]), "its tag WhiteLevel"),
        (image.clone().with(50720, RATIO, &[8.0, 0.0, 6.0, 1.0]), "its tag DefaultCropSize has a number"),
        (image.clone().with(50728, RATIO, &[1.0, 0.0, 1.0, 1.0, 1.0, 1.0]), "its tag AsShotNeutral has a number"),
        (image.clone().with(50712, LONG, &[70000.0]), "its LinearizationTable has values of more than 16 bits"),
        (image.clone().with(256, LONG, &[4_294_967_295.0]), "gives the raw image no size"),
        (image.clone().with(256, LONG, &[0.0]), "gives the raw image no size"),
        (
            image.clone().with(257, LONG, &[7.0]).with(278, LONG, &[7.0]),
            "strip 0 holds fewer bytes than its size needs",
        ),
        (image.clone().with(278, LONG, &[0.0]), "its strips have no rows (RowsPerStrip 0)"),
        (image.clone().with(278, LONG, &[3.0]), "its tag StripOffsets lists 1 of 2 strips"),
        (image.clone().with(322, LONG, &[4.0]), "its tag TileLength is 0"),
        (jpeg(Vec::new()), "strip 0 holds fewer bytes than its size needs"),
        (jpeg(lossy), "strip 0 is a JPEG that loses something"),
        (jpeg(whole[..whole.len() - 9].to_vec()), "strip 0 ends before its last row"),
        (jpeg(encode(&samples(40, 12, 1), 8, &Encoding::default())), "its JPEG has 40 samples, and its size needs 48"),
        (
            Image { chunks: vec![vec![9; 99]], ..image.clone().with(259, SHORT, &[8.0]) },
            "its compressed data make no sense",
        ),
    ] {
        let said = refused(&image);
        assert!(said.starts_with("a.dng: ") && said.contains(wanted) && !said.contains('\n'), "{said}, not {wanted}");
    }
    // One level of each class, all alike, is one level.
    let alike = image.clone().with(50714, SHORT, &[64.0; 4]).with(50717, SHORT, &[4000.0; 3]);
    let reader = open(&alike.file(&[]), RawArea::Active).unwrap();
    assert_eq!(reader.own_tags().black_level_adu, Some(BlackLevel::Uniform(64.0)));
    assert_eq!(reader.own_tags().white_level_adu, Some(WhiteLevel::Uniform(4000.0)));
    let crop = image.clone().with(50719, LONG, &[1.0, 0.0]).with(50720, LONG, &[8.0, 6.0]);
    let reader = open(&crop.file(&[]), RawArea::Active).unwrap();
    assert!(reader.notes()[0].ends_with("does not lie in that area, which has 8x6; it is passed over"));
    assert!(open(&crop.file(&[]), RawArea::Default).is_err());
    // Of a crop between photosites those count that lie in it.
    let between = image.clone().with(50719, RATIO, &[1.0, 2.0, 2.0, 3.0]).with(50720, RATIO, &[7.0, 1.0, 13.0, 3.0]);
    let crop = open(&between.file(&[]), RawArea::Default).unwrap().geometry().clone();
    assert_eq!((crop.origin, [crop.width, crop.height]), ([1, 1], [6, 4]));
    let narrow = image.clone().with(50719, RATIO, &[1.0, 2.0, 0.0, 1.0]).with(50720, RATIO, &[1.0, 1.0, 6.0, 1.0]);
    assert!(open(&narrow.file(&[]), RawArea::Default).is_err());
}

/// A matrix whose illuminant is known counts without the other; what has other than its numbers does not.
#[test]
fn matrices_of_unknown_illuminants_are_passed_over() {
    let matrix =
        |scale: f64| [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].map(|element| [element * scale, 10.0]).concat();
    let image = Image::new(8, 6, 12).strips(&samples(48, 12, 1), 6, Image::plain);
    let image = image.with(50728, RATIO, &[9.0, 10.0, 10.0, 10.0, 9.0, 10.0]).with(50721, SIGNED_RATIO, &matrix(9.0));
    let both = image.clone().with(50722, SIGNED_RATIO, &matrix(8.0));
    let told = |image: &Image| {
        let reader = open(&image.file(&[]), RawArea::Active).unwrap();
        let method = reader.own_tags().relative_matrix.as_ref().map(|matrix| matrix.method.clone());
        (method.unwrap_or_default(), reader.notes().join("; "))
    };
    let illuminants =
        |one: f64, other: f64| told(&both.clone().with(50778, SHORT, &[one]).with(50779, SHORT, &[other]));
    assert!(illuminants(17.0, 21.0).0.starts_with("ColorMatrix1 and ColorMatrix2 of the DNG"));
    let (method, notes) = illuminants(255.0, 21.0);
    assert!(method.starts_with("ColorMatrix2 of the DNG"), "{method}: {notes}");
    assert!(notes.contains("its ColorMatrix2 counts alone") && notes.contains("(CalibrationIlluminant1)"), "{notes}");
    assert!(illuminants(17.0, 0.0).0.starts_with("ColorMatrix1 of the DNG"));
    let (method, notes) = illuminants(0.0, 255.0);
    assert!(method.starts_with("ColorMatrix1 of the DNG"), "{method}: {notes}");
    assert!(notes.contains("the temperatures of the illuminants are not known, as of one alone"), "{notes}");
    // x, y of D65.
    let data = [0, 3127, 10_000, 3290, 10_000].map(u32::to_le_bytes).concat().into_iter().skip(2).map(f64::from);
    let with_data = both.clone().with(50778, SHORT, &[17.0]).with(50779, SHORT, &[255.0]);
    let (method, notes) = told(&with_data.with(52534, UNDEFINED, &data.collect::<Vec<_>>()));
    assert!(method.starts_with("ColorMatrix1 and ColorMatrix2 of the DNG"), "{method}: {notes}");
    assert!(told(&both.clone().without(50721).with(50779, SHORT, &[21.0])).0.starts_with("ColorMatrix2 of the DNG"));
    // Three, by their lights; a third that is not known does not count, and one of the others does.
    let third =
        both.clone().with(50778, SHORT, &[17.0]).with(50779, SHORT, &[21.0]).with(52531, SIGNED_RATIO, &matrix(7.0));
    let (method, notes) = told(&third.clone().with(52529, SHORT, &[14.0]));
    assert!(method.starts_with("ColorMatrix1, ColorMatrix2 and ColorMatrix3 of the DNG"), "{method}: {notes}");
    let (method, notes) = told(&third);
    assert!(method.starts_with("ColorMatrix1 and ColorMatrix2 of the DNG"), "{method}: {notes}");
    assert!(notes.contains("its ColorMatrix3 does not count") && notes.contains("(CalibrationIlluminant3)"), "{notes}");
    for (image, wanted) in [
        (third.clone().with(52529, SHORT, &[10.0]), "two of its three illuminants are one light"),
        (third.clone().without(50722), "it has one for a third illuminant (ColorMatrix3), but ColorMatrix2 is missing"),
        (
            image.clone().with(50879, SHORT, &[1.0]),
            "the colors of a picture, not of the scene (ColorimetricReference 1)",
        ),
    ] {
        let (method, notes) = told(&image);
        assert!(method.is_empty() && notes.contains(wanted), "{method}: {notes}");
    }
    let long = told(&image.clone().with(50721, SIGNED_RATIO, &[1.0; 24]));
    assert!(long.0.is_empty() && long.1.contains("its tag ColorMatrix1 has more than 9 numbers"), "{}", long.1);
    let four = told(&image.with(50728, RATIO, &[1.0; 8]));
    assert!(four.0.is_empty() && four.1.contains("its tag AsShotNeutral has more than 3 numbers"), "{}", four.1);
}

/// Whatever is cut off or changed: a result or an error, and what is cut off is never taken.
#[test]
fn damage_anywhere_is_no_panic() {
    let wanted = samples(16 * 12, 12, 2);
    let with = Encoding { precision: 12, components: 2, ..Encoding::default() };
    let image = Image::new(16, 12, 12).with(50714, SHORT, &[20.0]).with(33434, RATIO, &[1.0, 2.0]);
    let jpeg = image.clone().with(259, SHORT, &[7.0]);
    let deflated = image.clone().with(259, SHORT, &[8.0]);
    for stored in [
        image.clone().strips(&wanted, 5, Image::plain),
        deflated.strips(&wanted, 5, Image::deflated),
        jpeg.tiles(&wanted, [8, 8], |_, samples, row| encode(samples, row, &with)),
    ] {
        let file = stored.file(&[]);
        let attempt = |bytes: &[u8]| open(bytes, RawArea::Active).and_then(|reader| read(reader, 3));
        for length in 0..file.len() - 4 {
            assert!(attempt(&file[..length]).is_err(), "{length} of {}", file.len());
        }
        for (at, byte) in (0..file.len()).flat_map(|at| [0, 1, 0x7F, 0xFF].map(|byte| (at, byte))) {
            let mut changed = file.clone();
            changed[at] = byte;
            drop(attempt(&changed));
        }
    }
}

/// The directory of the camera's files; says so where there is none.
fn camera_file(name: &str) -> Option<DngReader> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().skip(1);
    let file = beside.map(|above| above.join("shared/data/raw").join(name)).find(|path| path.is_file());
    if file.is_none() {
        eprintln!("skipped: there is no shared/data/raw/{name} beside the tree");
    }
    file.map(|path| DngReader::open(File::open(path).unwrap(), name, RawArea::Full).unwrap())
}

/// The same frame of a Canon Kiss X4, packed in 14 bits and as lossless JPEG.
#[test]
fn a_cameras_frame_is_the_same_packed_and_as_jpeg() {
    let names = ["colorchart_kissx4_ml_uncompressed14.dng", "colorchart_kissx4_ml_ljpeg.dng"];
    let [Some(packed), Some(jpeg)] = names.map(camera_file) else { return };
    for reader in [&packed, &jpeg] {
        assert_eq!((reader.geometry().width, reader.geometry().height), (1888, 1182));
        let metadata = reader.own_tags();
        assert_eq!(metadata.black_level_adu, Some(BlackLevel::Uniform(2056.0)));
        assert_eq!(metadata.white_level_adu, Some(WhiteLevel::Uniform(15000.0)));
        // The active area begins at an even column and row.
        assert_eq!(metadata.cfa, Some("rggb".parse().unwrap()));
    }
    let [packed, jpeg] = [packed, jpeg].map(|reader| read(reader, 100).unwrap());
    assert!(packed == jpeg);
    // The masked border on the left, by who provides the file: 132 columns, mean 2048.8, standard deviation 17.0.
    let border: Vec<f64> =
        packed.chunks(1888).skip(26).flat_map(|row| row[8..140].iter().copied().map(f64::from)).collect();
    let mean = border.iter().sum::<f64>() / border.len() as f64;
    let deviation = (border.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / border.len() as f64).sqrt();
    assert!((mean - 2048.8).abs() < 0.5 && (deviation - 17.0).abs() < 0.5, "{mean} {deviation}");
}
