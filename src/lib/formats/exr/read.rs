//! Reads EXR parts, from files by their offset tables and from pipes as blocks come.

use super::read_ahead::ReadAhead;
use super::straight::{Offsets, Straight};
use super::{ExrTags, METADATA_ATTRIBUTE, PARALLEL_BLOCK_BYTES};
use crate::error::{Error, Result};
use crate::frame::{Geometry, bare_name, to_sample};
use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::compression::Compression;
use exr::error::Error as ExrError;
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, LineOrder, SampleType, Text};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData, magic_number};
use half::f16;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read};

/// A block (a tile, or the scanlines that are compressed together) may take this much memory, not more.
const MAX_BLOCK_BYTES: usize = 1 << 30;
/// All headers of a file may take this much.
const MAX_HEADER_BYTES: u64 = 64 << 20;

/// Reads a part of an EXR file or stream.
pub struct ExrReader {
    input: Input,
    name: String,
    meta: MetaData,
    part: usize,
    geometry: Geometry,
    tags: ExrTags,
    /// For each channel of the geometry, its place in the file's list.
    order: Vec<usize>,
    /// Where rows need no decoding: how they are laid out.
    straight: Option<Straight>,
    stored_as: &'static str,
    rows_read: usize,
    /// Decoded rows that were not asked for yet.
    ahead: Vec<f32>,
}

enum Input {
    /// Blocks come as they come.
    Pipe(ReadAhead<Box<dyn Read + Send>>),
    /// Blocks are found by the offset table; `position` is where the reader stands.
    File { reader: ReadAhead<File>, position: u64, length: u64, offsets: Offsets },
}

impl ExrReader {
    /// Opens part `part` of a file.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is damaged or not supported, naming it.
    pub fn open(file: File, name: &str, part: usize) -> Result<Self> {
        let length = file.metadata().map_err(|e| Error::disk(name, "read", e))?.len();
        let mut reader = ReadAhead::new(file);
        let meta = read_meta(&mut reader, name)?;
        let (order, geometry, tags, stored_as) = describe(&meta, part, name)?;
        let mut offsets = Offsets::new();
        for (index, header) in meta.headers.iter().enumerate() {
            // An entry takes 8 bytes, and its block at least 8 more.
            if header.chunk_count as u64 > length / 16 {
                return Err(cut_short(name));
            }
            let table = read_table(&mut reader, header.chunk_count, name)?;
            if index == part {
                offsets = table;
            }
        }
        let position = reader.stream_position().map_err(|e| Error::disk(name, "read", e))?;
        check_offsets(&offsets, length, name)?;
        let input = Input::File { reader, position, length, offsets };
        Ok(Self::new(input, name, meta, part, (order, geometry, tags, stored_as)))
    }

    /// Opens a stream that cannot seek: scanlines in increasing order, a single part.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is damaged, not supported, or needs a seek.
    pub fn stream(input: Box<dyn Read + Send>, name: &str) -> Result<Self> {
        let mut input = ReadAhead::new(input);
        let meta = read_meta(&mut input, name)?;
        let (order, geometry, tags, stored_as) = describe(&meta, 0, name)?;
        if meta.headers[0].line_order != LineOrder::Increasing {
            return Err(Error::format(
                name,
                "its rows are stored from bottom to top, which a pipe cannot turn round; name the file instead",
            ));
        }
        skip_table(&mut input, meta.headers[0].chunk_count, name)?;
        Ok(Self::new(Input::Pipe(input), name, meta, 0, (order, geometry, tags, stored_as)))
    }

    fn new(input: Input, name: &str, meta: MetaData, part: usize, description: Description) -> Self {
        let (order, geometry, tags, stored_as) = description;
        let straight = Straight::of(&meta, part, &order);
        let name = name.into();
        Self { input, name, meta, part, geometry, tags, order, straight, stored_as, rows_read: 0, ahead: Vec::new() }
    }

    /// Whether it reads a stream that cannot seek.
    pub fn is_stream(&self) -> bool {
        matches!(self.input, Input::Pipe(_))
    }

    fn header(&self) -> &Header {
        &self.meta.headers[self.part]
    }

    /// Size, place and channels; the data window's corner is the origin.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Attributes.
    pub fn tags(&self) -> &ExrTags {
        &self.tags
    }

    /// How samples are stored: `f32`, `f16`, `u32` or `mixed`.
    pub fn stored_as(&self) -> &'static str {
        self.stored_as
    }

    /// Rows that decode together.
    pub fn natural_rows(&self) -> usize {
        self.header().max_block_pixel_size().height().min(self.geometry.height)
    }

    /// Appends the next `rows` rows, laid out as `[row][channel][column]`.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where a block is damaged or missing, [`Error::Disk`] where reading fails.
    pub fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let row = self.geometry.row_samples();
        let end = samples.len() + rows * row;
        let from_ahead = self.ahead.len().min(rows * row);
        samples.extend(self.ahead.drain(..from_ahead));
        while samples.len() < end {
            let start = samples.len();
            if self.read_straight((end - start) / row, samples)? {
                continue;
            }
            self.read_row_of_blocks(samples)?;
            if samples.len() > end {
                self.ahead.extend_from_slice(&samples[end..]);
                samples.truncate(end);
            }
            debug_assert!(samples.len() > start);
        }
        Ok(())
    }

    /// Takes some of the next `rows` rows that need no decoding; says whether there were any. What is not as it should be is
    /// left to [`Self::next_chunk`], which has the words for it.
    fn read_straight(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<bool> {
        let Some(straight) = &self.straight else { return Ok(false) };
        let (first, block) = (self.rows_read, straight.block_bytes);
        let left = self.geometry.height - first;
        let mut append = |blocks: &[u8]| {
            let fit = |(index, block): &(usize, &[u8])| straight.is_row(block, first + index);
            let fitting = blocks.chunks_exact(block).take(rows).enumerate().take_while(fit);
            fitting.map(|(_, block)| straight.append(block, samples)).count()
        };
        let taken = match &mut self.input {
            Input::Pipe(input) => {
                let taken = append(input.peek(block, left));
                input.skip(taken * block);
                taken
            }
            Input::File { reader, position, length, offsets } => {
                if !go_to(offsets.at(first), position, reader, *length, &self.name)? {
                    return Ok(false);
                }
                let taken = append(reader.peek(block, offsets.run(first, block, left)));
                reader.skip(taken * block);
                *position += (taken * block) as u64;
                taken
            }
        };
        self.rows_read += taken;
        Ok(taken > 0)
    }

    /// Decodes the next block of scanlines, or row of tiles.
    fn read_row_of_blocks(&mut self, samples: &mut Vec<f32>) -> Result<()> {
        let (first, natural) = (self.rows_read, self.natural_rows());
        let rows = natural.min(self.geometry.height - first);
        let across = match self.header().blocks {
            BlockDescription::ScanLines => 1,
            BlockDescription::Tiles(tiles) => self.geometry.width.div_ceil(tiles.tile_size.width()),
        };
        let start = samples.len();
        let mut done = 0;
        // A few blocks at a time: as many as make sense to decode in parallel, without holding a whole wide row twice.
        let batch = if self.header().max_block_byte_size() < PARALLEL_BLOCK_BYTES { 32 } else { 2 };
        while done < across {
            let count = batch.min(across - done);
            let chunks: Vec<Chunk> = (done..done + count)
                .map(|column| self.next_chunk(first / natural * across + column, column, first))
                .collect::<Result<_>>()?;
            let (meta, name) = (&self.meta, &self.name);
            let decode = |chunk| UncompressedBlock::decompress_chunk(chunk, meta, true).map_err(|e| damaged(name, &e));
            let blocks: Vec<UncompressedBlock> = if count > 1 {
                chunks.into_par_iter().map(decode).collect::<Result<_>>()?
            } else {
                chunks.into_iter().map(decode).collect::<Result<_>>()?
            };
            // Only now, when data have come, is memory given to the rows.
            samples.resize(start + rows * self.geometry.row_samples(), 0.0);
            for block in &blocks {
                self.place(block, first, rows, &mut samples[start..])?;
            }
            done += count;
        }
        self.rows_read += rows;
        Ok(())
    }

    /// Reads the chunk of block `index` (blocks counted row by row), which must lie at `column` and row `first`.
    fn next_chunk(&mut self, index: usize, column: usize, first: usize) -> Result<Chunk> {
        let name = &self.name;
        let chunk = match &mut self.input {
            Input::Pipe(input) => Chunk::read(input, &self.meta).map_err(|e| damaged(name, &e))?,
            Input::File { reader, position, length, offsets } => {
                if !go_to(offsets.at(index), position, reader, *length, name)? {
                    return Err(Error::format(name, "its table of blocks points outside the file; it is damaged"));
                }
                let mut counted = Counted { inner: reader, count: 0 };
                let chunk = Chunk::read(&mut counted, &self.meta).map_err(|e| damaged(name, &e))?;
                *position += counted.count;
                chunk
            }
        };
        let header = &self.meta.headers[self.part];
        let in_place = chunk.layer_index == self.part
            && match &chunk.compressed_block {
                CompressedBlock::ScanLine(block) => {
                    i64::from(block.y_coordinate) == i64::from(header.own_attributes.layer_position.y()) + first as i64
                }
                CompressedBlock::Tile(tile) => {
                    tile.coordinates.level_index == Vec2(0, 0)
                        && tile.coordinates.tile_index == Vec2(column, first / header.max_block_pixel_size().height())
                }
                _ => false,
            };
        if in_place {
            Ok(chunk)
        } else {
            Err(Error::format(name, format!("the block of row {first} is missing or out of order; it is damaged")))
        }
    }

    /// Puts a decoded block into rows that start at row `first`.
    fn place(&self, block: &UncompressedBlock, first: usize, rows: usize, samples: &mut [f32]) -> Result<()> {
        let header = self.header();
        let (width, channels) = (self.geometry.width, self.geometry.channels.len());
        let (left, top) = (block.index.pixel_position.x(), block.index.pixel_position.y());
        let (block_width, block_rows) = (block.index.pixel_size.width(), block.index.pixel_size.height());
        if top != first || block_rows != rows || left + block_width > width {
            return Err(Error::format(&self.name, "a block has another size than its header says; it is damaged"));
        }
        // Where each of the file's channels goes.
        let mut target = vec![0; channels];
        for (channel, &place) in self.order.iter().enumerate() {
            target[place] = channel;
        }
        let mut bytes = block.data.as_slice();
        for row in 0..block_rows {
            for (description, &channel) in header.channels.list.iter().zip(&target) {
                let size = description.sample_type.bytes_per_sample();
                let (line, rest) = bytes.split_at(block_width * size);
                bytes = rest;
                let start = (row * channels + channel) * width + left;
                let to = &mut samples[start..start + block_width];
                match description.sample_type {
                    SampleType::F32 => {
                        for (to, from) in to.iter_mut().zip(line.as_chunks().0) {
                            *to = f32::from_ne_bytes(*from);
                        }
                    }
                    SampleType::F16 => {
                        for (to, from) in to.iter_mut().zip(line.as_chunks().0) {
                            *to = f16::from_ne_bytes(*from).to_f32();
                        }
                    }
                    SampleType::U32 => {
                        for (to, from) in to.iter_mut().zip(line.as_chunks().0) {
                            *to = to_sample(f64::from(u32::from_ne_bytes(*from)));
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

/// Every block of a part must have a place of its own within the file.
fn check_offsets(offsets: &Offsets, length: u64, name: &str) -> Result<()> {
    let (extent, twice) = offsets.extent();
    if extent.is_some_and(|(first, last)| first == 0 || last >= length) {
        return Err(cut_short(name));
    }
    if twice {
        return Err(Error::format(name, "two entries of its table of blocks are the same; it is damaged"));
    }
    Ok(())
}

/// Goes to `offset` from `position`, where the reader stands; says whether that lies within the file.
fn go_to(offset: u64, position: &mut u64, reader: &mut ReadAhead<File>, length: u64, name: &str) -> Result<bool> {
    let delta = i64::try_from(offset).ok().zip(i64::try_from(*position).ok()).map(|(to, from)| to - from);
    let Some(delta) = delta.filter(|_| offset < length) else { return Ok(false) };
    if delta != 0 {
        reader.seek_relative(delta).map_err(|e| Error::disk(name, "read", e))?;
        *position = offset;
    }
    Ok(true)
}

/// Whether the bytes are the start of an EXR file that can be read without seeking: one part of scanlines.
pub fn is_streamable(head: &[u8]) -> bool {
    // Bytes 5 and 6 hold the flags: tiled 0x02, deep 0x08, multi-part 0x10 [OpenEXR file layout].
    head.len() >= 8 && head[..4] == magic_number::BYTES && head[5] & (0x02 | 0x08 | 0x10) == 0
}

fn read_meta(input: &mut impl Read, name: &str) -> Result<MetaData> {
    let meta = MetaData::read_from_buffered(input.take(MAX_HEADER_BYTES), false).map_err(|e| damaged(name, &e))?;
    // The strict check of the whole, as the crate makes it before it writes.
    for header in &meta.headers {
        let mut long_names = false;
        header
            .validate(meta.requirements.has_multiple_layers, &mut long_names, false)
            .map_err(|e| damaged(name, &e))?;
    }
    Ok(meta)
}

fn read_table(input: &mut impl Read, entries: usize, name: &str) -> Result<Offsets> {
    let mut table = Offsets::new();
    let mut entry = [0; 8];
    for _ in 0..entries {
        input.read_exact(&mut entry).map_err(|e| Error::disk(name, "read", e))?;
        table.push(u64::from_le_bytes(entry));
    }
    Ok(table)
}

/// Reads past an offset table, which may claim any length, without keeping it.
fn skip_table(input: &mut impl Read, entries: usize, name: &str) -> Result<()> {
    let length = 8 * entries as u64;
    match io::copy(&mut input.take(length), &mut io::sink()) {
        Ok(skipped) if skipped == length => Ok(()),
        Ok(_) => Err(cut_short(name)),
        Err(error) => Err(Error::disk(name, "read", error)),
    }
}

/// What a part holds: order of channels, geometry, attributes, sample type.
type Description = (Vec<usize>, Geometry, ExrTags, &'static str);

fn describe(meta: &MetaData, part: usize, name: &str) -> Result<Description> {
    let Some(header) = meta.headers.get(part) else {
        let last = meta.headers.len().saturating_sub(1);
        return Err(Error::Usage(format!("{name}: there is no part {part}; its parts are 0 to {last}")));
    };
    let refuse = |problem: &str| Err(Error::format(name, problem));
    if header.deep {
        return refuse("deep data are not supported; flatten them first, for example with `oiiotool --flatten`");
    }
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return refuse(SUBSAMPLED);
    }
    let is_read = match header.compression {
        Compression::Uncompressed | Compression::RLE | Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ => {
            true
        }
        // It cuts 32-bit floats to 24 bits, and loses nothing of the other types.
        Compression::PXR24 => header.channels.list.iter().all(|channel| channel.sample_type != SampleType::F32),
        _ => false,
    };
    if !is_read {
        return Err(Error::format(name, format!("its {} is not read here; {STORE_WITHOUT_LOSS}", header.compression)));
    }
    if header.max_block_byte_size() > MAX_BLOCK_BYTES {
        return refuse("its blocks are larger than 1 GiB; store it in smaller ones");
    }
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    if width == 0 || height == 0 || header.channels.list.is_empty() {
        return refuse("it has no samples");
    }
    let names: Vec<String> =
        header.channels.list.iter().map(|channel| String::from_utf8_lossy(channel.name.as_slice()).into()).collect();
    let order = canonical_order(&names);
    let origin = header.own_attributes.layer_position;
    let geometry = Geometry {
        width,
        height,
        origin: [origin.x(), origin.y()],
        channels: order.iter().map(|&place| names[place].clone()).collect(),
    };
    let stored_as = match header.channels.uniform_sample_type {
        Some(SampleType::F32) => "f32",
        Some(SampleType::F16) => "f16",
        Some(SampleType::U32) => "u32",
        None => "mixed",
    };
    Ok((order, geometry, read_tags(header), stored_as))
}

fn read_tags(header: &Header) -> ExrTags {
    let text = |text: &Text| String::from_utf8_lossy(text.as_slice()).into_owned();
    let own = &header.own_attributes;
    let other = |name: &str| match own.other.get(&Text::new_or_none(name)?)? {
        AttributeValue::Text(value) => Some(text(value)),
        _ => None,
    };
    let point = |Vec2(x, y): Vec2<f32>| [f64::from(x), f64::from(y)];
    ExrTags {
        metadata: other(METADATA_ATTRIBUTE),
        software: own.software_name.as_ref().map(text),
        exposure_s: own.exposure.map(f64::from),
        f_number: own.aperture.map(f64::from),
        white_luminance: own.white_luminance.map(f64::from),
        primaries: header
            .shared_attributes
            .chromaticities
            .map(|c| [point(c.red), point(c.green), point(c.blue), point(c.white)]),
        emissive_units: other("emissiveUnits"),
    }
}

/// The order in which channels are worked on: R, G, B (or Y; x, y, Y; L, a, b) first, the rest layer by layer as the file
/// has them, each again R, G, B (or the like) first. Where all belong to layers, as in `left.R`, what stands behind the
/// last dot counts.
fn canonical_order(names: &[String]) -> Vec<usize> {
    let place = |wanted: &str| {
        let exact = names.iter().position(|name| name == wanted);
        exact.or_else(|| names.iter().position(|name| bare_name(name) == wanted))
    };
    let leading: Vec<usize> = [&["R", "G", "B"][..], &["x", "y", "Y"], &["L", "a", "b"], &["X", "Y", "Z"], &["Y"]]
        .into_iter()
        .find_map(|set| set.iter().map(|name| place(name)).collect())
        .unwrap_or_default();
    let mut order: Vec<usize> = (0..names.len()).collect();
    let layer = |place: usize| names[place].len() - bare_name(&names[place]).len();
    let first_of_layer = |place: usize| {
        let prefix = &names[place].as_bytes()[..layer(place)];
        names.iter().position(|name| name.as_bytes().starts_with(prefix))
    };
    let rank = |place: usize| {
        ["R", "G", "B", "x", "y", "Y", "L", "a", "b"]
            .iter()
            .position(|name| *name == bare_name(&names[place]))
            .unwrap_or(9)
    };
    order.sort_by_key(|&place| {
        let leads = leading.iter().position(|leader| *leader == place);
        (leads.unwrap_or(leading.len()), if leads.is_none() { first_of_layer(place) } else { None }, rank(place))
    });
    order
}

const SUBSAMPLED: &str = "subsampled channels (luminance/chroma images) are not supported; convert it to RGB first";
const STORE_WITHOUT_LOSS: &str = "store it without loss as none, rle, zips, zip or piz";

fn cut_short(name: &str) -> Error {
    Error::format(name, "the file ends before its last row; it was cut short")
}

/// The crate's complaint as ours.
fn damaged(name: &str, error: &ExrError) -> Error {
    match error {
        ExrError::Io(source) if source.kind() == io::ErrorKind::UnexpectedEof => cut_short(name),
        ExrError::Io(source) => Error::disk(name, "read", io::Error::new(source.kind(), source.to_string())),
        // Before any header is given out, the crate refuses what is named better here.
        ExrError::NotSupported(what) if what.contains("subsampling") => Error::format(name, SUBSAMPLED),
        ExrError::Invalid(what) if what.contains("compression attribute") => {
            Error::format(name, format!("its compression is missing or of an unknown kind; {STORE_WITHOUT_LOSS}"))
        }
        ExrError::NotSupported(what) => Error::format(name, format!("this kind of EXR is not supported: {what}")),
        // The crate reports the end of the file as "invalid: reference to missing bytes".
        ExrError::Invalid(what) if what.contains("missing bytes") => cut_short(name),
        ExrError::Invalid(what) => Error::format(name, format!("it is no valid EXR file: {what}")),
        ExrError::Aborted => Error::format(name, "reading was given up"),
    }
}

/// Counts the bytes that pass, to know where a reader stands.
struct Counted<'a, R> {
    inner: &'a mut R,
    count: u64,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.count += read as u64;
        Ok(read)
    }
}
