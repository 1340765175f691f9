//! Reading rows.

use super::area::{self, RawArea, Rectangle};
use super::describe;
use super::image::RawImage;
use super::levels::Levels;
use super::noise;
use super::opcodes::Said as Opcodes;
use super::samples::ChunkRows;
use super::storage::{Compression, Storage};
use super::tags;
use crate::camera::noise_profile::NoiseProfile;
use crate::error::{Error, Result};
use crate::formats::format::{FrameFormat, Readers, Reading, Rest, SampleReader, SampleType, Sign};
use crate::formats::register;
use crate::formats::tiff::TiffFile;
use crate::frame::Geometry;
use crate::metadata::METADATA_BEGIN;
use crate::metadata::Metadata;
use rayon::prelude::*;
use std::fs::File;
use std::ops::Range;

/// Decoded samples that are held take about so many bytes, or those of one row of tiles or strips if that is less, or one
/// row of the image if that is more.
const DECODED_BYTES: usize = 8 << 20;

/// Digital Negative: Adobe's raw format, which also cameras write.
pub const FORMAT: FrameFormat = FrameFormat {
    name: "a DNG",
    sign: Sign::Tags(|_, directory| Ok(tags::DNG_VERSION.is_in(directory))),
    reading: Reading::Rows(Readers {
        open: |file, name, part| {
            if part != 0 {
                return Err(Error::Usage(format!("{name}: it has no part {part}; of a DNG the raw image is part 0")));
            }
            Ok(Box::new(DngReader::open(file, name, RawArea::Active)?))
        },
        stream: None,
    }),
};

/// Reads rows of the raw image of a DNG: one plane behind a filter array, or of a monochrome sensor.
///
/// Reads strips and tiles; unsigned integers of 8 to 16 bits, packed or not, and floats of 16, 24 and 32 bits; no
/// compression, Deflate with any predictor, lossless JPEG; both byte orders; samples that a table makes linear. What it does
/// not read, it refuses by name. The sensor's corner is that of the stored image, so that the active area begins at its place.
///
/// Memory is the stored bytes of one row of tiles, or of one strip, and about 8 MiB of decoded samples: a strip that covers
/// the image is decoded a few rows at a time.
#[derive(Debug)]
pub struct DngReader {
    file: TiffFile,
    storage: Storage,
    /// Linear values of stored ones.
    table: Option<Vec<f32>>,
    /// From which share of the range on, and from which sample, they may be far from linear.
    linear: Option<(f64, f64)>,
    doubt_of_black: Option<&'static str>,
    area: Rectangle,
    geometry: Geometry,
    own_tags: Metadata,
    noise_profile: Option<NoiseProfile>,
    description: Option<String>,
    notes: Vec<String>,
    /// The stored row that [`SampleReader::read`] gives next.
    next_row: usize,
    /// Chunks of the row of chunks that is decoded in pieces.
    open: Vec<ChunkRows>,
    /// Stored rows that are decoded.
    held: Range<usize>,
    /// Their samples, `[down][across][row][column]`, by chunks or the pieces of them.
    decoded: Vec<f32>,
    /// Rows of a chunk, or of its piece, in there.
    piece_rows: usize,
}

impl DngReader {
    /// Opens a part of the raw image of a file, which the user calls `name`.
    ///
    /// # Errors
    ///
    /// When the file is no DNG, is damaged or shorter than its tags say, or is of a kind that is not supported.
    pub fn open(file: File, name: &str, part: RawArea) -> Result<Self> {
        let mut file = TiffFile::open(file, name)?;
        let image = RawImage::find(&mut file)?;
        let active = area::active(&mut file, &image)?;
        let area = match part {
            RawArea::Active => active,
            RawArea::Full => Rectangle::whole(image.size),
            RawArea::Default => area::default_crop(&mut file, &image, active)?.map_err(|why| file.problem(why))?,
        };
        let storage = Storage::read(&mut file, &image)?;
        let description = describe::description(&mut file, &image.first)?;
        let place = image.place(&mut file, description.as_deref())?;
        // Pattern and levels are those at the sensor's corner.
        let on_sensor = active.moved(place);
        let reach = [0, 1].map(|k| image.size[k] + place[k]);
        let levels = Levels::read(&mut file, &image, on_sensor, reach, storage.sample)?;
        let mut notes = Vec::new();
        describe::note_area(&mut file, &image, active, area, &mut notes)?;
        let is_ours = description.as_deref().is_some_and(|text| text.starts_with(METADATA_BEGIN));
        let mut own_tags = describe::describe(&mut file, &image, on_sensor, &levels, is_ours, &mut notes)?;
        let opcodes = Opcodes::of(&mut file, &image)?;
        notes.extend(opcodes.notes);
        let doubts = describe::doubt_of_place(&image).into_iter().chain(opcodes.doubts).chain(levels.doubt_of_black());
        let of_noise = describe::doubt_of_noise(&mut file, &image)?;
        doubts.chain(of_noise).for_each(|doubt| register::doubt(format!("{name}: {doubt}")));
        // Codes in JPEG have as many bits as that says, whatever the tag.
        let is_jpeg = matches!(storage.compression, Compression::LosslessJpeg { .. });
        if let Some(doubt) = levels.doubt_of_white(storage.sample).filter(|_| !is_ours && !is_jpeg) {
            register::doubt(format!("{name}: {doubt}"));
        }
        if part == RawArea::Full {
            own_tags.masked_areas = area::masked(&mut file, &image, active, place)?;
        }
        let noise_profile = noise::profile(&mut file, &image, &mut notes)?;
        let origin = [area.left + place[0], area.top + place[1]].map(|place| i32::try_from(place).unwrap_or(i32::MAX));
        let geometry = Geometry { origin, ..Geometry::new(area.width, area.height, &["Y"]) };
        own_tags.noise_profile = noise_profile.as_ref().and_then(|found| noise::record(found, &own_tags, &geometry));
        // Decoding begins with the row of chunks that the area begins in.
        let begin = area.top / storage.chunk_rows * storage.chunk_rows;
        Ok(Self {
            file,
            storage,
            linear: levels.linear(),
            doubt_of_black: describe::doubt_of_black(&image, active).filter(|_| !is_ours),
            table: levels.table,
            area,
            geometry,
            own_tags,
            noise_profile,
            description,
            notes,
            next_row: area.top,
            open: Vec::new(),
            held: begin..begin,
            decoded: Vec::new(),
            piece_rows: 0,
        })
    }

    /// Samples of a row of chunks.
    fn row_samples(&self) -> usize {
        self.storage.across * self.storage.chunk_width
    }

    /// Rows that are decoded together of chunks that are decoded in pieces.
    fn rows_at_once(&self) -> usize {
        (DECODED_BYTES / size_of::<f32>() / self.row_samples()).clamp(1, self.storage.chunk_rows)
    }

    /// Decodes the next rows, whatever number is asked for: as many rows of chunks as are held at a time, or a piece of one.
    fn decode(&mut self) -> Result<()> {
        let chunk_rows = self.storage.chunk_rows;
        let stored_end = self.area.top + self.area.height;
        let first = self.held.end;
        let (down, within) = (first / chunk_rows, first % chunk_rows);
        let fitting = DECODED_BYTES / size_of::<f32>() / self.row_samples() / chunk_rows;
        let many = if within == 0 { (stored_end - first).div_ceil(chunk_rows).min(fitting) } else { 0 };
        let (last_down, rows) =
            if many > 0 { (down + many, chunk_rows) } else { (down + 1, self.rows_at_once().min(chunk_rows - within)) };
        let mut chunks = std::mem::take(&mut self.open);
        if within == 0 || self.storage.compression == Compression::None {
            chunks.clear();
        }
        if chunks.is_empty() {
            chunks = self.open_chunks(down..last_down, within, rows)?;
        }

        self.piece_rows = rows;
        let piece = rows * self.storage.chunk_width;
        let mut decoded = std::mem::take(&mut self.decoded);
        decoded.resize(chunks.len() * piece, 0.0);
        let table = self.table.as_deref();
        let results: Vec<std::result::Result<(), String>> = chunks
            .par_iter_mut()
            .zip(decoded.par_chunks_mut(piece))
            .enumerate()
            .map(|(index, (chunk, samples))| {
                // The last strip is shorter, and rows below the area are of no use.
                let begin = first + index / self.storage.across * rows;
                let kept = rows.min(stored_end.saturating_sub(begin)) * self.storage.chunk_width;
                let samples = &mut samples[..kept];
                chunk.read(samples)?;
                if let Some(table) = table {
                    linearize(samples, table);
                }
                Ok(())
            })
            .collect();
        for (index, result) in results.into_iter().enumerate() {
            result.map_err(|what| self.chunk_problem(down * self.storage.across + index, &what))?;
        }
        self.decoded = decoded;
        let behind = if many > 0 { (last_down * chunk_rows).min(stored_end) } else { (first + rows).min(stored_end) };
        self.held = first..behind;
        if many == 0 && within + rows < chunk_rows {
            self.open = chunks;
        }
        Ok(())
    }

    /// Reads the bytes of chunks, one after another, and opens them; those of others than compressed chunks are the rows from
    /// `within` on.
    fn open_chunks(&mut self, downs: Range<usize>, within: usize, rows: usize) -> Result<Vec<ChunkRows>> {
        let Self { storage, file, .. } = self;
        let mut stored = Vec::new();
        for down in downs {
            let stored_rows = storage.stored_rows(down);
            for across in 0..storage.across {
                let index = down * storage.across + across;
                let (offset, length) = storage.chunks[index];
                let row_bytes = storage.sample.row_bytes(storage.chunk_width) as u64;
                let (skip, length) = match storage.compression {
                    Compression::None => {
                        (within as u64 * row_bytes, rows.min(stored_rows.saturating_sub(within)) as u64 * row_bytes)
                    }
                    // Neither makes data so much longer; what is beyond cannot be needed.
                    _ => (0, length.min(8 * stored_rows as u64 * row_bytes + (64 << 10))),
                };
                let mut bytes = vec![0; usize::try_from(length).unwrap_or_default()];
                file.read_at(offset + skip, &mut bytes)?;
                stored.push((index, bytes, stored_rows));
            }
        }
        let big_endian = file.big_endian();
        let opened: Vec<_> = stored
            .into_par_iter()
            .map(|(index, bytes, rows)| (index, ChunkRows::open(storage, big_endian, bytes, rows)))
            .collect();
        opened.into_iter().map(|(index, chunk)| chunk.map_err(|what| self.chunk_problem(index, &what))).collect()
    }

    /// What is wrong with a chunk.
    fn chunk_problem(&self, index: usize, what: &str) -> Error {
        self.file.problem(format!("{} {index} {what}", self.storage.chunk_name()))
    }

    /// The samples of a row that is held, those of the area.
    fn copy_row(&self, row: usize, samples: &mut [f32]) {
        let Storage { across, chunk_width, .. } = self.storage;
        let (down, within) = ((row - self.held.start) / self.piece_rows, (row - self.held.start) % self.piece_rows);
        let mut rest = samples;
        let mut column = self.area.left;
        while !rest.is_empty() {
            let (chunk, from) = (column / chunk_width, column % chunk_width);
            let begin = ((down * across + chunk) * self.piece_rows + within) * chunk_width;
            let count = (chunk_width - from).min(rest.len());
            let (now, later) = rest.split_at_mut(count);
            now.copy_from_slice(&self.decoded[begin + from..][..count]);
            (rest, column) = (later, column + count);
        }
    }
}

/// Linear values of stored ones; those beyond the end of the table have its last \[DNG2023, LinearizationTable].
fn linearize(samples: &mut [f32], table: &[f32]) {
    let last = table.len() - 1;
    for sample in samples {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, of 16 bits")]
        let index = (*sample as usize).min(last);
        *sample = table[index];
    }
}

impl SampleReader for DngReader {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn stored_as(&self) -> Option<SampleType> {
        Some(if self.table.is_some() { SampleType::U16 } else { self.storage.sample.stored_as() })
    }

    /// Any: rows that were decoded together are held until they are asked for.
    fn natural_rows(&self) -> usize {
        1
    }

    fn embedded(&self) -> Option<&str> {
        self.description.as_deref().filter(|text| text.starts_with(METADATA_BEGIN))
    }

    fn own_tags(&self) -> &Metadata {
        &self.own_tags
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn noise_profile(&self) -> Option<&NoiseProfile> {
        self.noise_profile.as_ref()
    }

    fn linear_limit(&self) -> Option<(f64, f64)> {
        self.linear
    }

    fn doubt_of_black(&self) -> Option<&'static str> {
        self.doubt_of_black
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        let width = self.area.width;
        samples.resize(start + rows * width, 0.0);
        let (mut rest, end) = (&mut samples[start..], self.next_row + rows);
        while self.next_row < end {
            if !self.held.contains(&self.next_row) {
                self.decode()?;
                continue;
            }
            let count = self.held.end.min(end) - self.next_row;
            let (now, later) = std::mem::take(&mut rest).split_at_mut(count * width);
            for (row, line) in now.chunks_exact_mut(width).enumerate() {
                self.copy_row(self.next_row + row, line);
            }
            rest = later;
            self.next_row += count;
        }
        Ok(())
    }

    fn rest(&mut self) -> Result<Rest> {
        self.file.rest(&self.storage.chunks)
    }
}
