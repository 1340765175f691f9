//! Reading rows.

use super::plain::PlainRows;
use super::{DEFLATE_EXPANSION, PLACE};
use crate::color::rgb::{Encoding, NamedPrimaries};
use crate::error::{Error, Result};
use crate::formats::exposure::ToldExposure;
use crate::formats::foreign::png_damage;
use crate::formats::format::{ColorTags, FrameFormat, Readers, Reading, Rest, SampleReader, SampleType, Sign};
use crate::formats::tiff;
use crate::frame::Geometry;
use crate::metadata::{METADATA_BEGIN, Metadata};
use crate::units::QuantityKind;
use png::{BitDepth, ColorType, Info, Limits, ScaledFloat};
use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom};
use std::os::unix::fs::FileExt;

/// Portable Network Graphics.
pub const FORMAT: FrameFormat = FrameFormat {
    name: "a PNG",
    sign: Sign::Bytes(|head| head.starts_with(b"\x89PNG\r\n\x1A\n")),
    reading: Reading::Rows(Readers {
        open: |file, name, part| Ok(Box::new(PngReader::open(file, name, part)?)),
        stream: None,
    }),
};

/// What is asked of the system at once: where chunks before the samples are looked at alone, and where samples are read.
const HEAD_READ_BYTES: usize = 4 << 10;
const READ_BYTES: usize = 64 << 10;
/// What texts and color profiles may take.
const TEXT_BYTES: usize = 16 << 20;
/// What metadata in a compressed text may take.
const METADATA_BYTES: usize = 1 << 20;
/// What a row may take however small the file is; if more, then so many times what the file has.
const SMALL_BYTES: u64 = 64 << 20;
const MOST_EXPANSION: u64 = 64;

const CONVERT: &str = "convert it first, for example with `oiiotool in.png -o out.tif`";

/// Reads the rows of a PNG.
///
/// Channels are `Y`; `Y`, `A`; `R`, `G`, `B`; with `A`. Samples are those stored: a transfer function is not undone, alpha
/// is not divided by. Memory is a few rows, and texts of up to 16 MiB; of a plain picture, where it is not large, it is all of it.
pub struct PngReader {
    name: String,
    /// The file once more, and where it begins in there.
    file: File,
    start: u64,
    rows: Rows,
    rows_read: usize,
    geometry: Geometry,
    /// Whether the file has its place, which may be the corner.
    tells_place: bool,
    stored: SampleType,
    embedded: Option<String>,
    own_tags: Metadata,
    colors: ColorTags,
    notes: Vec<String>,
}

/// Who reads rows.
enum Rows {
    Plain(Box<PlainRows>),
    /// The crate, which reads all there are, and says what is wrong with them.
    Any(Box<png::Reader<BufReader<File>>>),
}

/// The crate at the first byte of a picture, of which it reads so many bytes at once.
fn begin(file: &File, start: u64, name: &str, capacity: usize) -> Result<png::Decoder<BufReader<File>>> {
    let failed = |e| Error::disk(name, "read", e);
    // Copies of an open file share the place that is read next.
    let mut copy = file.try_clone().map_err(failed)?;
    copy.seek(SeekFrom::Start(start)).map_err(failed)?;
    let input = BufReader::with_capacity(capacity, copy);
    Ok(png::Decoder::new_with_limits(input, Limits { bytes: TEXT_BYTES }))
}

impl PngReader {
    /// Opens a file, which has a single part.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for another part; [`Error::Format`] for what is damaged or of a kind that is not read.
    pub fn open(mut file: File, name: &str, part: usize) -> Result<Self> {
        if part != 0 {
            return Err(Error::Usage(format!("{name}: it has no part {part}; it has a single one")));
        }
        let failed = |e| Error::disk(name, "read", e);
        let start = file.stream_position().map_err(failed)?;
        let length = file.seek(SeekFrom::End(0)).map_err(failed)?.saturating_sub(start);
        let mut decoder = begin(&file, start, name, HEAD_READ_BYTES)?;
        let damage = |error| png_damage(name, error);
        let header = decoder.read_header_info().map_err(damage)?;
        let refuse = |problem: String| Error::format(name, problem);
        let (channels, stored) = kind(header).map_err(refuse)?;
        let size = [header.width, header.height].map(u64::from);
        check_size(size, channels.len() as u64 * stored.bytes() as u64, length).map_err(refuse)?;
        let [width, height] = size.map(|side| usize::try_from(side).unwrap_or(usize::MAX));
        let reader = decoder.read_info().map_err(damage)?;
        let embedded = embedded(reader.info());
        // Of what our programs made the metadata tell how samples are encoded.
        let mut own_tags = Metadata::new(QuantityKind::Unspecified);
        let mut notes = if embedded.is_some() { Vec::new() } else { notes(reader.info()) };
        if let Some(exif) = reader.info().exif_metadata.as_deref().filter(|_| embedded.is_none()) {
            ToldExposure::describe(tiff::exposure_of_block(exif, name, &mut notes)?, &mut own_tags);
        }
        let before = Before::of(&file, start).ok();
        let place = before.as_ref().and_then(|before| before.place);
        let origin = place.unwrap_or_default();
        let is_plain = channels.len() == 1 && reader.info().animation_control.is_none();
        let rows = match before.filter(|_| is_plain) {
            Some(Before { data, .. }) => {
                let place = data.data..start + length;
                Rows::Plain(Box::new(PlainRows::new([width, height], stored.bytes(), place, data.length)))
            }
            None => Rows::Any(Box::new(begin(&file, start, name, READ_BYTES)?.read_info().map_err(damage)?)),
        };
        Ok(Self {
            name: name.into(),
            start,
            rows,
            rows_read: 0,
            geometry: Geometry { origin, ..Geometry::new(width, height, channels) },
            tells_place: place.is_some(),
            stored,
            embedded,
            own_tags,
            colors: colors(reader.info()),
            notes,
            file,
        })
    }

    /// Has the crate read on behind the rows that were read.
    fn leave_to_crate(&self) -> Result<png::Reader<BufReader<File>>> {
        let damage = |error| png_damage(&self.name, error);
        let decoder = begin(&self.file, self.start, &self.name, READ_BYTES)?;
        let mut reader = decoder.read_info().map_err(damage)?;
        for _ in 0..self.rows_read {
            reader.next_row().map_err(damage)?;
        }
        Ok(reader)
    }
}

/// A chunk of a file: the place of its data, how many bytes they have, and its kind.
struct Chunk {
    data: u64,
    length: u64,
    kind: [u8; 4],
}

impl Chunk {
    /// The first one of a picture that begins at a place.
    fn first(file: &File, start: u64) -> io::Result<Self> {
        const SIGNATURE_BYTES: u64 = 8;
        Self::at(file, start + SIGNATURE_BYTES)
    }

    fn at(file: &File, place: u64) -> io::Result<Self> {
        let mut head = [0; 8];
        file.read_exact_at(&mut head, place)?;
        let [a, b, c, d, kind @ ..] = head;
        Ok(Self { data: place + 8, length: u32::from_be_bytes([a, b, c, d]).into(), kind })
    }

    /// The place behind it: a checksum of four bytes follows the data.
    fn end(&self) -> u64 {
        self.data + self.length + 4
    }
}

/// What chunks before the samples say, and the first of samples.
struct Before {
    /// The place on the sensor.
    place: Option<[i32; 2]>,
    data: Chunk,
}

impl Before {
    /// Of a picture that begins at such a place.
    ///
    /// # Errors
    ///
    /// Where the file ends before the samples: who reads these says so.
    fn of(file: &File, start: u64) -> io::Result<Self> {
        let mut place = None;
        let mut chunk = Chunk::first(file, start)?;
        while chunk.kind != *b"IDAT" {
            if (chunk.kind, chunk.length) == (PLACE, 9) && place.is_none() {
                let mut told = [0; 9];
                file.read_exact_at(&mut told, chunk.data)?;
                let [a, b, c, d, e, f, g, h, unit] = told;
                place = Some((unit == 0).then(|| [[a, b, c, d], [e, f, g, h]].map(i32::from_be_bytes)));
            }
            chunk = Chunk::at(file, chunk.end())?;
        }
        Ok(Self { place: place.flatten(), data: chunk })
    }
}

/// The place behind the last chunk.
///
/// # Errors
///
/// Where the file ends before it.
fn end(file: &File, start: u64) -> io::Result<u64> {
    let mut chunk = Chunk::first(file, start)?;
    while chunk.kind != *b"IEND" {
        chunk = Chunk::at(file, chunk.end())?;
    }
    Ok(chunk.end())
}

/// Channels and samples; or why such a picture is not read.
fn kind(info: &Info<'_>) -> std::result::Result<(&'static [&'static str], SampleType), String> {
    if info.interlaced {
        return Err(format!("it is interlaced (Adam7), so that its rows do not come in order; {CONVERT}"));
    }
    let channels: &[&str] = match info.color_type {
        ColorType::Grayscale => &["Y"],
        ColorType::GrayscaleAlpha => &["Y", "A"],
        ColorType::Rgb => &["R", "G", "B"],
        ColorType::Rgba => &["R", "G", "B", "A"],
        ColorType::Indexed => return Err(format!("its colors are those of a palette, which is not read; {CONVERT}")),
    };
    match info.bit_depth {
        BitDepth::Eight => Ok((channels, SampleType::U8)),
        BitDepth::Sixteen => Ok((channels, SampleType::U16)),
        packed => Err(format!("its samples have {} bits, which are not unpacked; {CONVERT}", packed as u8)),
    }
}

/// Refuses what a file of so many bytes cannot hold, and rows that take too much memory.
fn check_size([width, height]: [u64; 2], pixel_bytes: u64, length: u64) -> std::result::Result<(), String> {
    let row_bytes = width.saturating_mul(pixel_bytes);
    if row_bytes.saturating_mul(height) > length.saturating_mul(DEFLATE_EXPANSION) {
        return Err(format!("it is too short for {width}x{height} pixels; it was cut short or damaged"));
    }
    if row_bytes > SMALL_BYTES.max(length.saturating_mul(MOST_EXPANSION)) {
        return Err(format!("each of its rows takes {} MiB; cut it into narrower ones", row_bytes >> 20));
    }
    Ok(())
}

/// The project's metadata among the texts that stand before the samples.
fn embedded(info: &Info<'_>) -> Option<String> {
    let plain = info.uncompressed_latin1_text.iter().map(|chunk| Some(chunk.text.clone()));
    let packed = info.compressed_latin1_text.iter().map(|chunk| {
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(METADATA_BYTES).ok()?;
        chunk.get_text().ok()
    });
    let international = info.utf8_text.iter().map(|chunk| {
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(METADATA_BYTES).ok()?;
        chunk.get_text().ok()
    });
    plain.chain(packed).chain(international).flatten().find(|text| text.starts_with(METADATA_BEGIN))
}

/// What the chunks say of colors: cICP before iCCP before sRGB before gAMA and cHRM \[PNG2025, Sec. 4.3]. Where none does, sRGB
/// is taken.
fn colors(info: &Info<'_>) -> ColorTags {
    let named = |primaries: NamedPrimaries, encoding| ColorTags {
        primaries: Some(primaries.chromaticities()),
        encoding: Some(encoding),
        ..ColorTags::default()
    };
    let unread = |what: String| ColorTags { unread: Some(what), ..ColorTags::default() };
    if let Some(code) = info.coding_independent_code_points {
        // Numbers of ITU-T H.273.
        let primaries = match code.color_primaries {
            1 => Some(NamedPrimaries::Srgb),
            9 => Some(NamedPrimaries::Rec2020),
            12 => Some(NamedPrimaries::DisplayP3),
            _ => None,
        };
        let encoding = match code.transfer_function {
            8 => Some(Encoding::Linear),
            13 => Some(Encoding::Srgb),
            _ => None,
        };
        return match (primaries, encoding, code.is_video_full_range_image) {
            (Some(primaries), Some(encoding), true) => named(primaries, encoding),
            _ => unread(format!(
                "its color space (cICP {}-{}-{}-{})",
                code.color_primaries,
                code.transfer_function,
                code.matrix_coefficients,
                u8::from(code.is_video_full_range_image)
            )),
        };
    }
    if info.icc_profile.is_some() {
        return unread("its color profile (iCCP)".into());
    }
    if info.srgb.is_some() {
        return named(NamedPrimaries::Srgb, Encoding::Srgb);
    }
    let point = |(x, y): (ScaledFloat, ScaledFloat)| [x, y].map(|value| f64::from(value.into_scaled()) / 1e5);
    let exponent = info.gama_chunk.map(|gamma| 1e5 / f64::from(gamma.into_scaled()));
    ColorTags {
        primaries: info.chrm_chunk.map(|at| [at.red, at.green, at.blue, at.white].map(point)),
        encoding: Some(exponent.filter(|power| power.is_finite()).map_or(Encoding::Srgb, Encoding::Power)),
        ..ColorTags::default()
    }
}

/// What the chunks say that no sample is changed by.
fn notes(info: &Info<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    let encoded = match (info.srgb, info.gama_chunk) {
        (Some(_), _) => Some("sRGB".to_owned()),
        // The chunk holds the exponent of the encoding: 1 is linear.
        (None, Some(gamma)) if (gamma.into_value() - 1.0).abs() > 1e-4 => {
            Some(format!("the exponent {} (gAMA)", gamma.into_value()))
        }
        _ => None,
    };
    if let Some(encoded) = encoded {
        notes.push(format!("its samples are encoded by {encoded}; they are taken as stored, not made linear"));
    }
    if info.icc_profile.is_some() {
        notes.push("its color profile (iCCP) is passed over; samples are taken as stored".into());
    }
    if info.coding_independent_code_points.is_some() {
        notes.push("its color space (cICP) is passed over; samples are taken as stored".into());
    }
    if let Some(bits) = info.sbit.as_deref() {
        let bits: Vec<String> = bits.iter().map(u8::to_string).collect();
        notes
            .push(format!("its samples were scaled up from {} bits (sBIT); they are taken as stored", bits.join(", ")));
    }
    if info.trns.is_some() {
        notes.push("the color that it calls transparent (tRNS) is taken as any other".into());
    }
    if info.animation_control.is_some() {
        notes.push("it is animated; its first picture is read".into());
    }
    notes
}

impl SampleReader for PngReader {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn tells_place(&self) -> bool {
        self.tells_place
    }

    fn stored_as(&self) -> Option<SampleType> {
        Some(self.stored)
    }

    fn natural_rows(&self) -> usize {
        1
    }

    fn embedded(&self) -> Option<&str> {
        self.embedded.as_deref()
    }

    fn own_tags(&self) -> &Metadata {
        &self.own_tags
    }

    fn colors(&self) -> ColorTags {
        self.colors.clone()
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let channels = self.geometry.channels.len();
        samples.reserve(rows * self.geometry.row_samples());
        if let Rows::Plain(plain) = &mut self.rows {
            let before = samples.len();
            if plain.read(&self.file, rows, samples).is_ok() {
                self.rows_read += rows;
                return Ok(());
            }
            samples.truncate(before);
            self.rows = Rows::Any(Box::new(self.leave_to_crate()?));
        }
        let Rows::Any(reader) = &mut self.rows else { return Ok(()) };
        for _ in 0..rows {
            let row = reader.next_row().map_err(|error| png_damage(&self.name, error))?;
            let Some(row) = row else { return Err(Error::cut_short(&self.name)) };
            for channel in 0..channels {
                match self.stored {
                    SampleType::U8 => {
                        samples.extend(row.data()[channel..].iter().step_by(channels).map(|byte| f32::from(*byte)));
                    }
                    _ => {
                        let (stored, _) = row.data().as_chunks::<2>();
                        let sample = |bytes: &[u8; 2]| f32::from(u16::from_be_bytes(*bytes));
                        // A loop over all of a slice runs in vectors.
                        if channels == 1 {
                            samples.extend(stored.iter().map(sample));
                        } else {
                            samples.extend(stored[channel..].iter().step_by(channels).map(sample));
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn rest(&mut self) -> Result<Rest> {
        let found = end(&self.file, self.start).and_then(|end| {
            self.file.seek(SeekFrom::Start(end))?;
            Rest::unread(&mut BufReader::new(&self.file), false)
        });
        found.map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => Error::cut_short(&self.name),
            _ => Error::disk(&self.name, "read", error),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use png::Encoder;
    use std::io::Write;

    fn encoded(
        color: ColorType,
        depth: BitDepth,
        data: &[u8],
        set: impl Fn(&mut Encoder<'_, &mut Vec<u8>>),
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        let bits = color.samples() * depth as usize;
        let height = 2;
        let width = data.len() / height * 8 / bits;
        let mut encoder = Encoder::new(&mut bytes, u32::try_from(width).unwrap(), 2);
        encoder.set_color(color);
        encoder.set_depth(depth);
        set(&mut encoder);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    fn opened(bytes: &[u8], part: usize) -> Result<PngReader> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        file.rewind().unwrap();
        PngReader::open(file, "in.png", part)
    }

    fn complaint(bytes: &[u8]) -> String {
        let read = opened(bytes, 0).and_then(|mut reader| reader.read(2, &mut Vec::new()));
        read.unwrap_err().to_string()
    }

    #[test]
    fn rows_come_channel_by_channel() {
        let data: Vec<u8> = (0..48).collect();
        for (color, names) in [
            (ColorType::Grayscale, &["Y"][..]),
            (ColorType::GrayscaleAlpha, &["Y", "A"]),
            (ColorType::Rgb, &["R", "G", "B"]),
            (ColorType::Rgba, &["R", "G", "B", "A"]),
        ] {
            for (depth, stored) in [(BitDepth::Eight, "u8"), (BitDepth::Sixteen, "u16")] {
                let mut reader = opened(&encoded(color, depth, &data, |_| {}), 0).unwrap();
                let geometry = reader.geometry().clone();
                assert_eq!(geometry.channels, names);
                assert_eq!(reader.stored_as().unwrap().name(), stored);
                assert_eq!(reader.own_tags().quantity, QuantityKind::Unspecified);
                assert!(reader.notes().is_empty() && reader.embedded().is_none());
                let mut samples = Vec::new();
                reader.read(1, &mut samples).unwrap();
                reader.read(1, &mut samples).unwrap();
                let bytes = usize::from(depth == BitDepth::Sixteen) + 1;
                let at = |y: usize, channel: usize, x: usize| {
                    let first = ((y * geometry.width + x) * names.len() + channel) * bytes;
                    data[first..first + bytes].iter().fold(0.0, |value, byte| value * 256.0 + f32::from(*byte))
                };
                let mut wanted = Vec::new();
                for (y, channel) in (0..2).flat_map(|y| (0..names.len()).map(move |channel| (y, channel))) {
                    wanted.extend((0..geometry.width).map(|x| at(y, channel, x)));
                }
                assert_eq!(samples, wanted, "{names:?} {stored}");
            }
        }
    }

    #[test]
    fn chunks_are_told_and_ours_are_found() {
        let gray = |set: &dyn Fn(&mut Encoder<'_, &mut Vec<u8>>)| {
            opened(&encoded(ColorType::Grayscale, BitDepth::Eight, &[7; 4], set), 0).unwrap()
        };
        let notes = |set: &dyn Fn(&mut Encoder<'_, &mut Vec<u8>>)| gray(set).notes().concat();
        assert_eq!(
            notes(&|encoder| encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual)),
            "its samples are encoded by sRGB; they are taken as stored, not made linear"
        );
        assert_eq!(
            notes(&|encoder| encoder.set_source_gamma(ScaledFloat::new(0.5))),
            "its samples are encoded by the exponent 0.5 (gAMA); they are taken as stored, not made linear"
        );
        assert_eq!(notes(&|encoder| encoder.set_source_gamma(ScaledFloat::new(1.0))), "");
        assert!(notes(&|encoder| encoder.set_trns(vec![0, 7])).contains("(tRNS)"));
        let ours = "schema: cyanometer/1\nquantity: adu\n";
        for kind in 0..3 {
            let reader = gray(&|encoder| {
                encoder.add_text_chunk("Comment".into(), "made by hand".into()).unwrap();
                let (keyword, text) = ("Description".into(), ours.into());
                let added = match kind {
                    0 => encoder.add_text_chunk(keyword, text),
                    1 => encoder.add_ztxt_chunk(keyword, text),
                    _ => encoder.add_itxt_chunk(keyword, text),
                };
                added.unwrap();
            });
            assert_eq!(reader.embedded(), Some(ours));
        }
    }

    #[test]
    fn what_is_not_read_is_refused_by_name() {
        assert_eq!(
            complaint(&encoded(ColorType::Grayscale, BitDepth::Four, &[7; 4], |_| {})),
            format!("in.png: its samples have 4 bits, which are not unpacked; {CONVERT}")
        );
        let palette =
            encoded(ColorType::Indexed, BitDepth::Eight, &[0; 4], |encoder| encoder.set_palette(vec![1, 2, 3]));
        assert!(complaint(&palette).contains("those of a palette"));
        let whole = encoded(ColorType::Grayscale, BitDepth::Eight, &[7; 4], |_| {});
        assert_eq!(opened(&whole, 1).err().unwrap().to_string(), "in.png: it has no part 1; it has a single one");
        let interlaced = with_header(&whole, 28, &[1]);
        assert!(complaint(&interlaced).contains("it is interlaced (Adam7)"));
        let high = with_header(&whole, 20, &1_000_000_u32.to_be_bytes());
        assert!(complaint(&high).contains("too short for 2x1000000 pixels"));
    }

    /// The same with other bytes in the header, whose checksum is made good.
    fn with_header(whole: &[u8], place: usize, bytes: &[u8]) -> Vec<u8> {
        let mut changed = whole.to_vec();
        changed[place..place + bytes.len()].copy_from_slice(bytes);
        let mut sum = flate2::Crc::new();
        sum.update(&changed[12..29]);
        changed[29..33].copy_from_slice(&sum.sum().to_be_bytes());
        changed
    }

    /// What a reader gives, or complains of, a band of rows at a time.
    fn all_rows(opened: Result<PngReader>) -> std::result::Result<Vec<u32>, String> {
        let mut reader = opened.map_err(|error| error.to_string())?;
        let mut samples = Vec::new();
        let height = reader.geometry().height;
        for first in (0..height).step_by(5) {
            reader.read(5.min(height - first), &mut samples).map_err(|error| error.to_string())?;
        }
        reader.rest().map_err(|error| error.to_string())?;
        Ok(samples.into_iter().map(f32::to_bits).collect())
    }

    /// The same by the crate alone.
    fn all_rows_of_crate(bytes: &[u8]) -> std::result::Result<Vec<u32>, String> {
        all_rows(opened(bytes, 0).and_then(|mut reader| {
            reader.rows = Rows::Any(Box::new(reader.leave_to_crate()?));
            Ok(reader)
        }))
    }

    /// Whether all rows of a file were read without the crate.
    fn is_plain_to_the_end(bytes: &[u8]) -> bool {
        let mut reader = opened(bytes, 0).unwrap();
        reader.read(reader.geometry().height, &mut Vec::new()).unwrap();
        matches!(reader.rows, Rows::Plain(_))
    }

    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let mut bytes = [kind, data].concat();
        let mut sum = flate2::Crc::new();
        sum.update(&bytes);
        bytes.extend(sum.sum().to_be_bytes());
        [&u32::try_from(data.len()).unwrap().to_be_bytes()[..], &bytes].concat()
    }

    /// A gray picture 23 wide of so many rows, of chunks of so many bytes of data; a row is filtered by the filters in turn.
    fn gray(depth: BitDepth, rows: u32, level: u32, chunk_bytes: usize) -> Vec<u8> {
        of_data([23, rows], depth, &packed(&filtered(depth, rows), level), chunk_bytes)
    }

    fn filtered(depth: BitDepth, rows: u32) -> Vec<u8> {
        let row_bytes = 23 * depth as usize / 8;
        let mut state = 1_u64;
        let mut bytes = Vec::new();
        for row in 0..rows {
            // Filters of noise are as good as noise: whatever the bytes are, they are some picture, filtered.
            bytes.push(u8::try_from(row % 5).unwrap());
            for _ in 0..row_bytes {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                bytes.push((state >> 59).to_le_bytes()[0] * 8);
            }
        }
        bytes
    }

    fn packed(bytes: &[u8], level: u32) -> Vec<u8> {
        use flate2::{Compression, write::ZlibEncoder};
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(level));
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    /// A gray picture of such data, an empty chunk before.
    fn of_data([width, height]: [u32; 2], depth: BitDepth, data: &[u8], chunk_bytes: usize) -> Vec<u8> {
        let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[depth as u8, 0, 0, 0, 0]].concat();
        let mut bytes = [b"\x89PNG\r\n\x1A\n".to_vec(), chunk(b"IHDR", &header), chunk(b"IDAT", &[])].concat();
        data.chunks(chunk_bytes).for_each(|data| bytes.extend(chunk(b"IDAT", data)));
        bytes.extend(chunk(b"IEND", &[]));
        bytes
    }

    #[test]
    fn plain_rows_are_those_of_the_crate_to_the_bit() {
        for depth in [BitDepth::Eight, BitDepth::Sixteen] {
            for (rows, level) in [(1, 6), (31, 0), (31, 1), (31, 6), (31, 9), (4000, 0), (4000, 6)] {
                for chunk_bytes in [7, 8192, 40_000, 1 << 20] {
                    let bytes = gray(depth, rows, level, chunk_bytes);
                    let wanted = all_rows_of_crate(&bytes).unwrap();
                    assert_eq!(wanted.len(), 23 * rows as usize);
                    assert!(all_rows(opened(&bytes, 0)) == Ok(wanted), "{depth:?} {rows} {level} {chunk_bytes}");
                    assert!(is_plain_to_the_end(&bytes));
                }
            }
        }
    }

    /// Wherever a byte is another, or the file ends, samples and complaints are those of the crate.
    #[test]
    fn damage_is_what_the_crate_calls_it() {
        for level in [0, 1, 9] {
            let whole = gray(BitDepth::Sixteen, 11, level, 300);
            let same = |bytes: &[u8], what: &str| {
                assert_eq!(all_rows(opened(bytes, 0)), all_rows_of_crate(bytes), "{level} {what}");
            };
            for at in 0..whole.len() {
                let mut changed = whole.clone();
                changed[at] ^= 1 << (at % 8);
                same(&changed, &format!("byte {at}"));
                // The same where the checksum is that of what is wrong.
                same(&with_sums(&changed), &format!("byte {at} with its checksum"));
                same(&whole[..at], &format!("cut to {at}"));
            }
        }
    }

    /// Bytes behind the stream, rows behind the picture and none for the last, another sum behind the stream or none.
    #[test]
    fn streams_of_another_length_are_what_the_crate_takes_them_for() {
        let rows = filtered(BitDepth::Eight, 31);
        let stream = packed(&rows, 6);
        let end = stream.len() - 4;
        let longer = packed(&[&rows[..], &[3; 24]].concat(), 6);
        let shorter = packed(&rows[..30 * 24], 6);
        let sum = [&stream[..end], &[1, 2, 3, 4]].concat();
        let streams = [[&stream[..], &[7; 50]].concat(), longer, shorter, sum, stream[..end].to_vec()];
        for (which, data) in streams.iter().enumerate() {
            for chunk_bytes in [50, 1 << 20] {
                let bytes = of_data([23, 31], BitDepth::Eight, data, chunk_bytes);
                assert_eq!(all_rows(opened(&bytes, 0)), all_rows_of_crate(&bytes), "{which} {chunk_bytes}");
            }
        }
        // A header that says more than the data can be is not believed where other chunks make the file long.
        let mut bytes = of_data([23, 40_000], BitDepth::Eight, &packed(&rows[..48], 6), 1 << 20);
        bytes.extend(chunk(b"teXt", &[b'a'; 2000]));
        assert_eq!(all_rows(opened(&bytes, 0)), all_rows_of_crate(&bytes));
    }

    /// What takes more than 64 MiB is left to the crate, which streams it.
    #[test]
    fn large_pictures_are_streamed() {
        for (height, is_plain) in [(63, true), (64, false)] {
            let rows = vec![0; height * ((1 << 20) + 1)];
            let size = [1 << 20, u32::try_from(height).unwrap()];
            let mut reader = opened(&of_data(size, BitDepth::Eight, &packed(&rows, 1), 1 << 20), 0).unwrap();
            let mut samples = Vec::new();
            reader.read(1, &mut samples).unwrap();
            assert!(samples.len() == 1 << 20 && samples.iter().all(|sample| *sample == 0.0));
            assert_eq!(matches!(reader.rows, Rows::Plain(_)), is_plain);
        }
    }

    /// The same with checksums of what the chunks hold, as far as these follow one another.
    fn with_sums(bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        let mut at = 8;
        while let Some(length) = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>()).copied() {
            let end = at + 8 + u32::from_be_bytes(length) as usize;
            if end + 4 > bytes.len() {
                break;
            }
            let mut sum = flate2::Crc::new();
            sum.update(&bytes[at + 4..end]);
            bytes[end..end + 4].copy_from_slice(&sum.sum().to_be_bytes());
            at = end + 4;
        }
        bytes
    }
}
