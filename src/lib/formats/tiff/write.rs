//! Writing rows.

use super::chunk::{self, Predictor};
use super::first::FirstImage;
use super::tags::{self, ExtraTag, Field};
use super::{TiffCompression, TiffSamples, TiffTags};
use crate::error::{Error, Result};
use crate::formats::interleave::{interleave, interleave_u16};
use crate::frame::Geometry;
use rayon::prelude::*;
use std::io::{Seek, SeekFrom, Write};
use tiff::tags::{CompressionMethod, Tag, Type};

/// Uncompressed bytes of a strip, about.
const STRIP_BYTES: usize = 128 << 10;
/// Uncompressed bytes that are collected before they are compressed, in parallel, and written; or those of one strip
/// if that is more.
const COLLECTED_BYTES: usize = 4 << 20;

/// How a file is written.
#[derive(Debug, Clone, PartialEq)]
pub struct TiffSettings {
    /// How samples are stored.
    pub samples: TiffSamples,
    /// What each sample is multiplied with before it is rounded to an integer: 1 for ADU, 65535 for sRGB. Floats are
    /// written as they are.
    pub scale: f32,
    /// How strips are compressed.
    pub compression: TiffCompression,
    /// What the file says in words.
    pub tags: TiffTags,
    /// Tags besides those that the writer sets.
    pub extra: Vec<ExtraTag>,
    /// Those of Exif, in a directory of their own; there is none where these are none.
    pub exif: Vec<ExtraTag>,
}

/// Writes rows as a TIFF file: little-endian, interleaved strips, the directory at the end.
///
/// The bytes depend on what is written only, not on the number of rows per call or of threads. Memory is about 8 MiB, and
/// 16 bytes for each strip.
#[derive(Debug)]
pub struct TiffWriter<W: Write + Seek> {
    output: W,
    name: String,
    geometry: Geometry,
    settings: TiffSettings,
    /// The entries of the settings' extra tags.
    extra: Vec<Field>,
    big: bool,
    rows_per_strip: usize,
    rows: usize,
    /// Where the next byte goes.
    position: u64,
    /// Interleaved rows that are not written yet.
    collected: Vec<u8>,
    /// Offset and bytes of the strips written.
    strips: Vec<(u64, u64)>,
    unfit: u64,
    /// The photometric interpretation, where it is not that of gray or RGB.
    photometric: Option<u16>,
}

impl<W: Write + Seek> TiffWriter<W> {
    /// Starts a file that the user calls `name`.
    ///
    /// `output` must be empty and at its start. The file is a BigTIFF if it might not fit into 4 GiB.
    ///
    /// # Errors
    ///
    /// When the frame is larger than TIFF can say, an extra tag is one of the writer's own or given twice, or the disk
    /// refuses.
    pub fn create(output: W, name: &str, geometry: &Geometry, settings: TiffSettings) -> Result<Self> {
        let extra = tags::fields(&settings.extra, name)?;
        let big = needs_big_tiff(geometry, &settings, &extra);
        Self::begin(output, name, geometry, settings, extra, big)
    }

    /// [`TiffWriter::create`], told whether it is to be a BigTIFF.
    pub(super) fn begin(
        output: W,
        name: &str,
        geometry: &Geometry,
        settings: TiffSettings,
        extra: Vec<Field>,
        big: bool,
    ) -> Result<Self> {
        let fits = u32::try_from(geometry.width).is_ok()
            && u32::try_from(geometry.height).is_ok()
            && u16::try_from(geometry.channels.len()).is_ok();
        if !fits || geometry.height * geometry.row_samples() == 0 {
            return Err(Error::format(
                name,
                format!(
                    "a TIFF cannot hold {}x{} pixels of {} channels",
                    geometry.width,
                    geometry.height,
                    geometry.channels.len()
                ),
            ));
        }
        let rows_per_strip = rows_per_strip(geometry, settings.samples);
        let mut writer = Self {
            output,
            name: name.to_owned(),
            geometry: geometry.clone(),
            settings,
            extra,
            big,
            rows_per_strip,
            rows: 0,
            position: 0,
            collected: Vec::new(),
            strips: Vec::new(),
            unfit: 0,
            photometric: None,
        };
        // The offset of the directory follows in the end.
        if writer.big {
            writer.put(b"II\x2b\0\x08\0\0\0\0\0\0\0\0\0\0\0")?;
        } else {
            writer.put(b"II\x2a\0\0\0\0\0")?;
        }
        Ok(writer)
    }

    /// Says what one plane is, where it is not gray: a number of PhotometricInterpretation.
    pub(in crate::formats) fn set_photometric(&mut self, number: u16) {
        self.photometric = Some(number);
    }

    /// Whether the file is a BigTIFF.
    pub(in crate::formats) fn is_big(&self) -> bool {
        self.big
    }

    /// Takes the next rows, laid out `[row][channel][column]`, as many as there are in `samples`.
    ///
    /// # Errors
    ///
    /// When the disk refuses.
    ///
    /// # Panics
    ///
    /// When these are not whole rows, or more than the frame has.
    pub fn write_rows(&mut self, samples: &[f32]) -> Result<()> {
        let row_samples = self.geometry.row_samples();
        assert!(samples.len().is_multiple_of(row_samples));
        let rows = samples.len() / row_samples;
        assert!(self.rows + rows <= self.geometry.height);
        self.rows += rows;
        let (row_bytes, strip_bytes) = (self.row_bytes(), self.rows_per_strip * self.row_bytes());
        let together = (COLLECTED_BYTES / strip_bytes).max(1) * strip_bytes;
        let mut rest = samples;
        while !rest.is_empty() {
            let missing = (together - self.collected.len()) / row_bytes * row_samples;
            let (now, later) = rest.split_at(missing.min(rest.len()));
            rest = later;
            self.collect(now);
            if self.collected.len() == together {
                self.write_strips()?;
            }
        }
        Ok(())
    }

    /// Writes what is left, and the directory. Gives the output back, and the number of samples that did not fit into
    /// 16 bits: beyond 0…65535 after scaling and rounding, which are stored as the nearer end, or NaN, stored as 0.
    ///
    /// # Errors
    ///
    /// When rows are missing, or the disk refuses.
    pub fn finish(mut self) -> Result<(W, u64)> {
        self.write_rest()?;
        let mut fields = self.fields();
        fields.extend(self.put_exif(&self.settings.exif.clone())?);
        self.end_with(fields)
    }

    /// Writes what is left, with a small picture before it: the file begins with the directory of `first`, below which the
    /// frame lies (SubIFDs). Gives back what [`Self::finish`] does.
    ///
    /// # Errors
    ///
    /// As [`Self::finish`].
    pub(in crate::formats) fn finish_below(mut self, first: &FirstImage) -> Result<(W, u64)> {
        self.write_rest()?;
        let fields = self.fields();
        let below = self.put_directory(fields)?;
        self.align()?;
        let pixels = self.position;
        self.put(&first.rgb)?;
        let mut fields = first.fields(&self.name)?;
        fields.extend(self.put_exif(&first.exif)?);
        fields.push(self.offsets(Tag::StripOffsets, std::iter::once(pixels)));
        fields.push(self.offsets(Tag::SubIfd, std::iter::once(below)));
        self.end_with(fields)
    }

    /// Writes the directory with which the file begins, and is done.
    fn end_with(mut self, mut fields: Vec<Field>) -> Result<(W, u64)> {
        fields.sort_by_key(|field| field.tag.to_u16());
        let directory = self.put_directory(fields)?;
        self.begin_with(directory)?;
        Ok((self.output, self.unfit))
    }

    /// Writes the directory of Exif; gives the field that leads to it, where there are tags.
    fn put_exif(&mut self, exif: &[ExtraTag]) -> Result<Option<Field>> {
        let fields = tags::fields(exif, &self.name)?;
        if fields.is_empty() {
            return Ok(None);
        }
        let place = self.put_directory(fields)?;
        Ok(Some(self.offsets(Tag::ExifDirectory, std::iter::once(place))))
    }

    /// Writes the rows that are left.
    fn write_rest(&mut self) -> Result<()> {
        if self.rows != self.geometry.height {
            let (rows, height) = (self.rows, self.geometry.height);
            return Err(Error::format(
                &self.name,
                format!("only {rows} of {height} rows were written; the file is not complete"),
            ));
        }
        self.write_strips()
    }

    fn row_bytes(&self) -> usize {
        self.geometry.row_samples() * self.settings.samples.bytes()
    }

    fn predictor(&self) -> Predictor {
        match (self.settings.compression, self.settings.samples) {
            (TiffCompression::None, _) => Predictor::None,
            (_, TiffSamples::U16) => Predictor::Horizontal,
            (_, TiffSamples::F32) => Predictor::FloatingPoint,
        }
    }

    /// Appends rows, interleaved and little-endian, to those collected.
    fn collect(&mut self, samples: &[f32]) {
        let start = self.collected.len();
        self.collected.resize(start + samples.len() * self.settings.samples.bytes(), 0);
        let rows = self.collected[start..].par_chunks_mut(self.geometry.row_samples() * self.settings.samples.bytes());
        let lines = samples.par_chunks(self.geometry.row_samples());
        let (channels, scale, kind) = (self.geometry.channels.len(), self.settings.scale, self.settings.samples);
        self.unfit += rows
            .zip(lines)
            .with_min_len(16)
            .map(|(row, samples)| match kind {
                TiffSamples::U16 => interleave_u16(samples, row, channels, scale, |low_high| low_high),
                TiffSamples::F32 => {
                    interleave(samples, row, channels, f32::to_le_bytes);
                    0
                }
            })
            .sum::<u64>();
    }

    /// Compresses and writes the rows collected; whole strips, but for the frame's last.
    fn write_strips(&mut self) -> Result<()> {
        let (row_bytes, channels) = (self.row_bytes(), self.geometry.channels.len());
        let (predictor, compression) = (self.predictor(), self.settings.compression);
        let mut collected = std::mem::take(&mut self.collected);
        if compression == TiffCompression::None {
            for strip in collected.chunks(self.rows_per_strip * row_bytes) {
                self.put_strip(strip)?;
            }
        } else {
            let strips: Vec<std::io::Result<Vec<u8>>> = collected
                .par_chunks_mut(self.rows_per_strip * row_bytes)
                .map(|strip| {
                    predictor.apply(strip, row_bytes, channels);
                    chunk::encode(compression, strip)
                })
                .collect();
            for strip in strips {
                let strip = strip.map_err(|source| Error::disk(&self.name, "compress", source))?;
                self.put_strip(&strip)?;
            }
        }
        collected.clear();
        self.collected = collected;
        Ok(())
    }

    fn put_strip(&mut self, strip: &[u8]) -> Result<()> {
        self.strips.push((self.position, strip.len() as u64));
        self.put(strip)
    }

    /// Writes bytes at the end.
    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.output.write_all(bytes).map_err(|source| Error::disk(&self.name, "write", source))?;
        self.position += bytes.len() as u64;
        Ok(())
    }

    /// Writes a directory at the end, of fields in the order of their tags; gives its offset.
    fn put_directory(&mut self, fields: Vec<Field>) -> Result<u64> {
        // What does not fit into an entry stands before the directory.
        let mut entries: Vec<u8> = Vec::new();
        let count = fields.len() as u64;
        for Field { tag, kind, count, mut bytes } in fields {
            entries.extend(tag.to_u16().to_le_bytes());
            entries.extend(kind.to_u16().to_le_bytes());
            self.append_offset(&mut entries, count);
            let inline = if self.big { 8 } else { 4 };
            if bytes.len() <= inline {
                bytes.resize(inline, 0);
                entries.extend(bytes);
            } else {
                self.align()?;
                self.append_offset(&mut entries, self.position);
                self.put(&bytes)?;
            }
        }
        self.align()?;
        let directory = self.position;
        let mut table = Vec::with_capacity(entries.len() + 16);
        if self.big {
            table.extend(count.to_le_bytes());
        } else {
            table.extend(count.to_le_bytes().into_iter().take(2));
        }
        table.extend(entries);
        self.append_offset(&mut table, 0);
        self.put(&table)?;
        if !self.big && self.position > u64::from(u32::MAX) {
            return Err(Error::format(&self.name, "the file came out larger than 4 GiB; write it without compression"));
        }
        Ok(directory)
    }

    /// Writes the offset of the first directory into the header.
    fn begin_with(&mut self, directory: u64) -> Result<()> {
        let mut offset = Vec::new();
        self.append_offset(&mut offset, directory);
        self.output
            .seek(SeekFrom::Start(if self.big { 8 } else { 4 }))
            .and_then(|_| self.output.write_all(&offset))
            .and_then(|()| self.output.seek(SeekFrom::End(0)))
            .map_err(|source| Error::disk(&self.name, "write", source))?;
        Ok(())
    }

    /// Goes on at an even place, as the specification asks.
    fn align(&mut self) -> Result<()> {
        if self.position % 2 == 1 { self.put(&[0]) } else { Ok(()) }
    }

    /// Appends an offset or a count: four bytes, or eight in a BigTIFF.
    fn append_offset(&self, bytes: &mut Vec<u8>, offset: u64) {
        bytes.extend(offset.to_le_bytes().into_iter().take(if self.big { 8 } else { 4 }));
    }

    /// All fields of the directory, in the order of their tags.
    fn fields(&self) -> Vec<Field> {
        let mut fields = self.sample_fields();
        fields.extend(self.place_fields());
        let texts = &self.settings.tags;
        fields.extend(texts.description.as_ref().map(|text| Field::text(Tag::ImageDescription, text)));
        fields.extend(texts.software.as_ref().map(|text| Field::text(Tag::Software, text)));
        fields.extend(self.extra.iter().cloned());
        fields.sort_by_key(|field| field.tag.to_u16());
        fields
    }

    /// How samples are stored, and where.
    fn sample_fields(&self) -> Vec<Field> {
        let channels = self.geometry.channels.len();
        let (bits, format) = match self.settings.samples {
            TiffSamples::U16 => (16, 1),
            TiffSamples::F32 => (32, 3),
        };
        let compression = match self.settings.compression {
            TiffCompression::None => CompressionMethod::None,
            TiffCompression::Lzw => CompressionMethod::LZW,
            TiffCompression::Deflate => CompressionMethod::Deflate,
        };
        let (usual, colors) = if channels < 3 { (1, 1) } else { (2, 3) };
        let photometric = self.photometric.unwrap_or(usual);
        let mut fields = vec![
            long(Tag::ImageWidth, self.geometry.width),
            long(Tag::ImageLength, self.geometry.height),
            shorts(Tag::BitsPerSample, bits, channels),
            shorts(Tag::Compression, compression.to_u16(), 1),
            shorts(Tag::PhotometricInterpretation, photometric, 1),
            self.offsets(Tag::StripOffsets, self.strips.iter().map(|strip| strip.0)),
            shorts(Tag::SamplesPerPixel, u16::try_from(channels).unwrap_or(u16::MAX), 1),
            long(Tag::RowsPerStrip, self.rows_per_strip),
            self.offsets(Tag::StripByteCounts, self.strips.iter().map(|strip| strip.1)),
            shorts(Tag::PlanarConfiguration, 1, 1),
            shorts(Tag::SampleFormat, format, channels),
        ];
        match self.predictor() {
            Predictor::None => {}
            Predictor::Horizontal => fields.push(shorts(Tag::Predictor, 2, 1)),
            Predictor::FloatingPoint => fields.push(shorts(Tag::Predictor, 3, 1)),
        }
        if channels > colors {
            fields.push(shorts(Tag::ExtraSamples, 0, channels - colors));
        }
        fields
    }

    /// The frame's place on the sensor, in pixels.
    fn place_fields(&self) -> Vec<Field> {
        let mut fields =
            vec![ratio(Tag::XResolution, 1), ratio(Tag::YResolution, 1), shorts(Tag::ResolutionUnit, 1, 1)];
        if let [Ok(x), Ok(y)] = self.geometry.origin.map(u32::try_from)
            && [x, y] != [0, 0]
        {
            fields.extend([ratio(Tag::Unknown(286), x), ratio(Tag::Unknown(287), y)]);
        }
        fields
    }

    /// A field of offsets or byte counts.
    fn offsets(&self, tag: Tag, values: impl Iterator<Item = u64>) -> Field {
        let mut bytes = Vec::new();
        values.for_each(|value| self.append_offset(&mut bytes, value));
        Field::new(tag, if self.big { Type::LONG8 } else { Type::LONG }, bytes)
    }
}

fn long(tag: Tag, value: usize) -> Field {
    Field::new(tag, Type::LONG, value.to_le_bytes()[..4].to_vec())
}

/// The same number, so many times.
fn shorts(tag: Tag, value: u16, count: usize) -> Field {
    Field::new(tag, Type::SHORT, value.to_le_bytes().repeat(count))
}

/// A whole number as a ratio.
fn ratio(tag: Tag, value: u32) -> Field {
    Field::new(tag, Type::RATIONAL, [value, 1].iter().flat_map(|part| part.to_le_bytes()).collect())
}

/// Rows of all strips but the last.
fn rows_per_strip(geometry: &Geometry, samples: TiffSamples) -> usize {
    let row_bytes = geometry.row_samples() * samples.bytes();
    (STRIP_BYTES / row_bytes.max(1)).clamp(1, geometry.height.max(1))
}

/// Whether the file might not fit into the 4 GiB of a classic TIFF.
pub(super) fn needs_big_tiff(geometry: &Geometry, settings: &TiffSettings, extra: &[Field]) -> bool {
    let row_bytes = geometry.row_samples() * settings.samples.bytes();
    let data = geometry.height as u128 * row_bytes as u128;
    let worst = match settings.compression {
        TiffCompression::None => data,
        TiffCompression::Deflate => data + data / 10,
        // Codes of up to 12 bits, each for one byte where nothing repeats.
        TiffCompression::Lzw => data + data / 2,
    };
    let strips = geometry.height.div_ceil(rows_per_strip(geometry, settings.samples)) as u128;
    let texts = [&settings.tags.description, &settings.tags.software];
    let text_bytes: usize = texts.into_iter().flatten().map(String::len).sum();
    // Twelve bytes for each entry of a classic directory, and one to be even.
    let extra_bytes: usize = extra.iter().map(|field| field.bytes.len() + 13).sum();
    let directory = 4096 + 16 * strips + 6 * geometry.channels.len() as u128 + text_bytes as u128 + extra_bytes as u128;
    worst + directory > u128::from(u32::MAX)
}
