//! Reading rows.

#[cfg(test)]
use super::TiffTags;
use super::capture;
use super::chunk::{Compression, Trouble};
use super::directory::{TiffFile, begins_so};
use super::layout::Layout;
use crate::error::Result;
use crate::formats::format::{ColorTags, FrameFormat, Readers, Reading, Rest, SampleReader, SampleType, Sign};
use crate::formats::register;
use crate::formats::rounded::Rounded;
use crate::frame::Geometry;
use crate::metadata::{METADATA_BEGIN, Metadata};
use half::f16;
use rayon::prelude::*;
use std::fs::File;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use tiff::tags::Tag;

/// Decoded bytes that are held at least, where the caller asks for so many: enough work for some threads.
const DECODED_BYTES: usize = 8 << 20;
/// Bytes as stored that are held at a time, or those of one chunk if that is more.
const STORED_BYTES: usize = 16 << 20;
/// What is not compressed is read in pieces of about this size.
const PIECE_BYTES: usize = 1 << 20;
/// Rows that take more than this as `f32` are not worth having together.
const NATURAL_BYTES: usize = 64 << 20;

/// TIFF, classic and BigTIFF.
pub const FORMAT: FrameFormat = FrameFormat {
    name: "a TIFF",
    sign: Sign::Bytes(begins_so),
    reading: Reading::Rows(Readers {
        open: |file, name, page| Ok(Box::new(TiffReader::open(file, name, page)?)),
        stream: None,
    }),
};

/// Reads rows of one image of a TIFF file.
///
/// Reads strips and tiles, interleaved and planar; 8, 16 and 32-bit integers, half, single and double floats; no
/// compression, PackBits, LZW and Deflate, these two with any predictor; both byte orders; classic TIFF and BigTIFF. Gray,
/// RGB, CMYK, planes behind a color filter array (photometric 32803) and demosaicked raws (34892). Extra samples are channels
/// like the others. What it does not read, it refuses by name.
///
/// Memory is the decoded bytes of one row of tiles or one strip, or about 8 MiB where these are smaller, and up to 16 MiB of
/// them as stored, or one strip or tile if that is more.
#[derive(Debug)]
pub struct TiffReader {
    file: TiffFile,
    layout: Layout,
    own_tags: Metadata,
    /// Whether it carries a color profile.
    has_profile: bool,
    /// The row that [`SampleReader::read`] gives next.
    next_row: usize,
    /// Rows of a piece: a chunk's rows; or fewer where samples are not compressed, so that any rows can be had.
    piece_rows: usize,
    /// The pieces that are decoded, in the order of [`TiffReader::piece_range`].
    decoded: Vec<u8>,
    held: Range<usize>,
    /// What is rounded off.
    rounded: Rounded,
}

impl TiffReader {
    /// Opens image number `page` (0 is the first) of a file, which the user calls `name`.
    ///
    /// # Errors
    ///
    /// When the file is no TIFF, is damaged or shorter than its tags say, or is of a kind that is not supported.
    pub fn open(file: File, name: &str, page: usize) -> Result<Self> {
        let mut file = TiffFile::open(file, name)?;
        let directory = file.directory(page)?;
        let mut layout = Layout::read(&mut file, &directory)?;
        let piece_rows = if layout.compression == Compression::None {
            let row_bytes = layout.chunk_row_bytes() * layout.across * layout.planes();
            layout.chunk_rows.min((PIECE_BYTES / row_bytes).max(1))
        } else {
            layout.chunk_rows
        };
        let own_tags = capture::read(&mut file, &directory, &mut layout)?;
        let has_profile = directory.has(Tag::IccProfile);
        let (decoded, rounded) = (Vec::new(), Rounded::default());
        Ok(Self { file, layout, own_tags, has_profile, next_row: 0, piece_rows, decoded, held: 0..0, rounded })
    }

    /// The texts in the image's tags.
    #[cfg(test)]
    pub(super) fn tags(&self) -> &TiffTags {
        &self.layout.tags
    }

    /// Reads rows `first_row..first_row + rows` into `samples`, laid out `[row][channel][column]`.
    ///
    /// The values are those stored, integers not scaled; integers beyond 2²⁴ and doubles are rounded to `f32`. 8-bit
    /// MinIsWhite is inverted, wider MinIsWhite is not.
    ///
    /// # Errors
    ///
    /// When the disk refuses, or a strip or tile is damaged or cut short.
    ///
    /// # Panics
    ///
    /// When the rows are not those of the image, or `samples` has not their size.
    pub fn read_rows(&mut self, first_row: usize, rows: usize, samples: &mut [f32]) -> Result<()> {
        let end = first_row + rows;
        let row_samples = self.layout.geometry.row_samples();
        assert!(end <= self.layout.geometry.height && samples.len() == rows * row_samples);
        let mut row = first_row;
        let mut rest = samples;
        while row < end {
            let piece = self.piece_of(row);
            if !self.held.contains(&piece) {
                self.hold(piece..self.piece_of(end - 1) + 1)?;
            }
            let until = self.piece_range(self.held.end - 1).end.min(end);
            let (now, later) = rest.split_at_mut((until - row) * row_samples);
            let this = &*self;
            let overflown = AtomicBool::new(false);
            now.par_chunks_mut(row_samples)
                .with_min_len((PIECE_BYTES / size_of::<f32>() / row_samples).max(1))
                .enumerate()
                .for_each(|(index, samples)| this.convert_row(row + index, samples, &overflown));
            if overflown.into_inner() {
                return Err(self.file.problem("it has samples beyond 3.4e38, the largest of single precision"));
            }
            let mut rounded = self.rounded;
            for (row, samples) in (row..until).zip(now.chunks_exact(row_samples)) {
                if let Some(values) = self.in_doubles(row, row_samples) {
                    rounded.take(self.layout.stored, &values, samples, self.layout.geometry.width);
                }
            }
            self.rounded = rounded;
            (row, rest) = (until, later);
        }
        Ok(())
    }

    /// Pieces in a chunk.
    fn pieces_in_chunk(&self) -> usize {
        self.layout.chunk_rows.div_ceil(self.piece_rows)
    }

    /// The piece that holds a row.
    fn piece_of(&self, row: usize) -> usize {
        row / self.layout.chunk_rows * self.pieces_in_chunk() + row % self.layout.chunk_rows / self.piece_rows
    }

    /// The image's rows in a piece.
    fn piece_range(&self, piece: usize) -> Range<usize> {
        let (chunk, part) = (piece / self.pieces_in_chunk(), piece % self.pieces_in_chunk());
        let chunk_first = chunk * self.layout.chunk_rows;
        let chunk_end = (chunk_first + self.layout.chunk_rows).min(self.layout.geometry.height);
        let first = chunk_first + part * self.piece_rows;
        first..(first + self.piece_rows).min(chunk_end)
    }

    /// Bytes that a chunk takes in a decoded piece.
    fn piece_bytes(&self) -> usize {
        self.piece_rows * self.layout.chunk_row_bytes()
    }

    /// Chunks that a row of the image passes through, in all planes.
    fn chunks_in_piece(&self) -> usize {
        self.layout.planes() * self.layout.across
    }

    /// Decodes as many of the pieces as are to be held at a time, at least the first.
    fn hold(&mut self, pieces: Range<usize>) -> Result<()> {
        self.held = 0..0;
        let one = self.piece_bytes() * self.chunks_in_piece();
        let fitting = (DECODED_BYTES / one).clamp(1, pieces.len());
        let pieces = pieces.start..pieces.start + fitting;
        self.decoded.clear();
        if self.decoded.try_reserve_exact(one * fitting).is_err() {
            let mebibytes = one >> 20;
            return Err(self.file.problem(format!(
                "its strips or tiles need {mebibytes} MiB of memory at a time, and there is not so much; rewrite it with smaller ones, for example with `tiffcp -s -r 64 in.tif out.tif`"
            )));
        }
        self.decoded.resize(one * fitting, 0);

        // Reads one after another, decodes in parallel.
        let mut decoded = std::mem::take(&mut self.decoded);
        let mut rest = &mut decoded[..];
        let mut jobs = Vec::new();
        let mut pending = 0;
        for piece in pieces.clone() {
            for plane in 0..self.layout.planes() {
                for across in 0..self.layout.across {
                    let (place, later) = rest.split_at_mut(self.piece_bytes());
                    rest = later;
                    let job = self.job(piece, plane, across, place)?;
                    pending += job.stored.len();
                    jobs.push(job);
                    if pending > STORED_BYTES {
                        self.decode(std::mem::take(&mut jobs))?;
                        pending = 0;
                    }
                }
            }
        }
        self.decode(jobs)?;
        self.decoded = decoded;
        self.held = pieces;
        Ok(())
    }

    /// Reads the bytes of one chunk of a piece.
    fn job<'a>(&mut self, piece: usize, plane: usize, across: usize, place: &'a mut [u8]) -> Result<Job<'a>> {
        let layout = &self.layout;
        let (down, part) = (piece / self.pieces_in_chunk(), piece % self.pieces_in_chunk());
        let chunk = (plane * layout.down + down) * layout.across + across;
        let (offset, stored) = layout.chunks[chunk];
        let range = self.piece_range(piece);
        // Tiles are stored whole, also those that hang over the lower edge.
        let rows = if layout.tiled && layout.compression != Compression::None { self.piece_rows } else { range.len() };
        let decoded = &mut place[..rows * layout.chunk_row_bytes()];
        if layout.compression == Compression::None {
            let skip = part * self.piece_rows * layout.chunk_row_bytes();
            self.file.read_at(offset + skip as u64, decoded)?;
            return Ok(Job { chunk, stored: Vec::new(), decoded });
        }
        // No compression makes data so much longer; what is beyond cannot be needed.
        let most = 2 * decoded.len() as u64 + 1024;
        let mut bytes = vec![0; usize::try_from(stored.min(most)).unwrap_or_default()];
        self.file.read_at(offset, &mut bytes)?;
        Ok(Job { chunk, stored: bytes, decoded })
    }

    /// Decodes chunks, all of them or up to an error.
    fn decode(&self, jobs: Vec<Job>) -> Result<()> {
        let layout = &self.layout;
        let results: Vec<(usize, std::result::Result<(), Trouble>)> = jobs
            .into_par_iter()
            .map(|Job { chunk, stored, decoded }| {
                let result = match layout.compression {
                    Compression::None => Ok(()),
                    compression => compression.decode(&stored, decoded),
                };
                layout.predictor.undo(
                    decoded,
                    layout.chunk_row_bytes(),
                    layout.chunk_channels(),
                    layout.stored.bytes(),
                    self.file.big_endian,
                );
                (chunk, result)
            })
            .collect();
        for (chunk, result) in results {
            if let Err(trouble) = result {
                let what = if layout.tiled { "tile" } else { "strip" };
                return Err(self.file.problem(format!("{what} {chunk} {}", trouble.text())));
            }
        }
        Ok(())
    }

    /// Converts one row of the held pieces; tells of finite samples that are not of single precision.
    fn convert_row(&self, row: usize, samples: &mut [f32], overflown: &AtomicBool) {
        match self.layout.stored {
            SampleType::U8 => self.convert(row, samples, |[byte]: [u8; 1]| f32::from(byte)),
            SampleType::I8 => self.convert(row, samples, |bytes| f32::from(i8::from_ne_bytes(bytes))),
            SampleType::U16 => self.convert(row, samples, |bytes| f32::from(u16::from_ne_bytes(bytes))),
            SampleType::I16 => self.convert(row, samples, |bytes| f32::from(i16::from_ne_bytes(bytes))),
            SampleType::U32 => self.convert(row, samples, |bytes| u32::from_ne_bytes(bytes) as f32),
            SampleType::I32 => self.convert(row, samples, |bytes| i32::from_ne_bytes(bytes) as f32),
            SampleType::U64 => self.convert(row, samples, |bytes| u64::from_ne_bytes(bytes) as f32),
            SampleType::I64 => self.convert(row, samples, |bytes| i64::from_ne_bytes(bytes) as f32),
            SampleType::F16 => self.convert(row, samples, |bytes| f16::from_ne_bytes(bytes).to_f32()),
            SampleType::F32 => self.convert(row, samples, f32::from_ne_bytes),
            SampleType::F64 => self.convert(row, samples, |bytes| {
                let value = f64::from_ne_bytes(bytes);
                #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what is promised")]
                let sample = value as f32;
                if sample.is_infinite() && value.is_finite() {
                    overflown.store(true, Ordering::Relaxed);
                }
                sample
            }),
        }
        if self.layout.inverted {
            for sample in samples {
                *sample = 255.0 - *sample;
            }
        }
    }

    /// The samples of a row of the held pieces as they are stored, where single precision may round them and the row is looked at.
    fn in_doubles(&self, row: usize, row_samples: usize) -> Option<Vec<f64>> {
        let stored = self.layout.stored;
        if !Rounded::looks_at(stored, row) {
            return None;
        }
        let mut values = vec![0.0; row_samples];
        match stored {
            SampleType::U32 => self.convert(row, &mut values, |bytes| u32::from_ne_bytes(bytes).into()),
            SampleType::I32 => self.convert(row, &mut values, |bytes| i32::from_ne_bytes(bytes).into()),
            SampleType::U64 => self.convert(row, &mut values, |bytes| u64::from_ne_bytes(bytes) as f64),
            SampleType::I64 => self.convert(row, &mut values, |bytes| i64::from_ne_bytes(bytes) as f64),
            _ => self.convert(row, &mut values, f64::from_ne_bytes),
        }
        Some(values)
    }

    /// Converts one row, sample by sample with `value`.
    fn convert<T, const BYTES: usize>(&self, row: usize, samples: &mut [T], value: impl Fn([u8; BYTES]) -> T + Copy) {
        let layout = &self.layout;
        let piece = self.piece_of(row);
        let row_bytes = layout.chunk_row_bytes();
        let within = (row - self.piece_range(piece).start) * row_bytes;
        let first_chunk = (piece - self.held.start) * self.chunks_in_piece();
        let width = layout.geometry.width;
        let channels = layout.chunk_channels();
        for plane in 0..layout.planes() {
            let samples = &mut samples[plane * channels * width..][..channels * width];
            for across in 0..layout.across {
                let chunk = first_chunk + plane * layout.across + across;
                let stored = &self.decoded[chunk * self.piece_bytes() + within..][..row_bytes];
                let first = across * layout.chunk_width;
                let columns = first..(first + layout.chunk_width).min(width);
                match channels {
                    1 => separate::<T, 1, BYTES>(stored, samples, width, columns, value),
                    2 => separate::<T, 2, BYTES>(stored, samples, width, columns, value),
                    3 => separate::<T, 3, BYTES>(stored, samples, width, columns, value),
                    4 => separate::<T, 4, BYTES>(stored, samples, width, columns, value),
                    _ => {
                        let (stored, _) = stored.as_chunks::<BYTES>();
                        for channel in 0..channels {
                            let line = &mut samples[channel * width..][columns.clone()];
                            let stored = stored[channel..].iter().step_by(channels);
                            for (sample, bytes) in line.iter_mut().zip(stored) {
                                *sample = value(*bytes);
                            }
                        }
                    }
                }
            }
        }
    }
}

impl SampleReader for TiffReader {
    /// Channels are `Y`; `Y`, `A`; `R`, `G`, `B`; with `A`; `C`, `M`, `Y`, `K`; or else `C0`, `C1` …
    fn geometry(&self) -> &Geometry {
        &self.layout.geometry
    }

    fn tells_place(&self) -> bool {
        self.layout.tells_place
    }

    fn stored_as(&self) -> Option<SampleType> {
        Some(self.layout.stored)
    }

    /// Rows that decode together, where these are not too many.
    fn natural_rows(&self) -> usize {
        let row_bytes = self.layout.geometry.row_samples() * size_of::<f32>();
        if self.layout.chunk_rows.saturating_mul(row_bytes) <= NATURAL_BYTES {
            self.layout.chunk_rows
        } else {
            self.piece_rows.min((PIECE_BYTES / row_bytes).max(1))
        }
    }

    fn embedded(&self) -> Option<&str> {
        self.layout.tags.description.as_deref().filter(|text| text.starts_with(METADATA_BEGIN))
    }

    fn own_tags(&self) -> &Metadata {
        &self.own_tags
    }

    fn colors(&self) -> ColorTags {
        let unread = self.has_profile.then(|| "its color profile (ICC)".to_owned());
        ColorTags { unread, ..ColorTags::default() }
    }

    fn notes(&self) -> &[String] {
        &self.layout.notes
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        samples.resize(start + rows * self.layout.geometry.row_samples(), 0.0);
        self.read_rows(self.next_row, rows, &mut samples[start..])?;
        self.next_row += rows;
        if self.next_row == self.layout.geometry.height {
            self.rounded.doubt(&self.file.name).into_iter().for_each(register::doubt);
        }
        Ok(())
    }

    fn rest(&mut self) -> Result<Rest> {
        self.file.rest(&self.layout.chunks)
    }
}

/// One chunk on its way.
struct Job<'a> {
    chunk: usize,
    stored: Vec<u8>,
    decoded: &'a mut [u8],
}

/// Takes the interleaved channels of a chunk's row apart; with their number known, the compiler unrolls it.
fn separate<T, const CHANNELS: usize, const BYTES: usize>(
    stored: &[u8],
    samples: &mut [T],
    width: usize,
    columns: Range<usize>,
    value: impl Fn([u8; BYTES]) -> T,
) {
    let (stored, _) = stored.as_chunks::<BYTES>();
    let (pixels, _) = stored.as_chunks::<CHANNELS>();
    for channel in 0..CHANNELS {
        let line = &mut samples[channel * width..][columns.clone()];
        for (sample, pixel) in line.iter_mut().zip(pixels) {
            *sample = value(pixel[channel]);
        }
    }
}
