//! Reads EXR parts, from files by their offset tables and from pipes as blocks come.

use super::blocks::Blocks;
use super::header::{Contents, read_meta};
use super::straight::{Offsets, Straight};
use super::{PARALLEL_BLOCK_BYTES, PART_NAMES, is_layer};
use crate::color::rgb::Encoding;
use crate::error::{Error, Result};
use crate::formats::foreign::exr_complaint;
use crate::formats::format::{ColorTags, Rest, SampleReader, SampleType};
use crate::formats::positioned::Positioned;
use crate::formats::read_ahead::{Pipe, ReadAhead};
use crate::frame::{Geometry, to_sample};
use crate::metadata::Metadata;
use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::math::Vec2;
use exr::meta::attribute::{LineOrder, SampleType as ExrSampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use half::f16;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read, Seek};

/// Blocks that are decoded together may take this much, however little is stored of them.
const SMALL: u128 = 64 << 20;
/// Larger ones may take so many times what has been read of the image's blocks.
const MOST_EXPANSION: u64 = 64;

/// Reads a part of an EXR file or stream.
pub struct ExrReader {
    blocks: Blocks,
    name: String,
    meta: MetaData,
    part: usize,
    contents: Contents,
    /// Where rows need no decoding: how they are laid out.
    straight: Option<Straight>,
    rows_read: usize,
    /// Decoded rows that were not asked for yet.
    ahead: Vec<f32>,
    /// In a file of several parts or of tiles, the block that lies furthest behind.
    last: Option<LastBlock>,
}

/// A block of any part.
struct LastBlock {
    offset: u64,
    /// Where the size of what it stores stands, from its first byte on.
    size_at: u64,
    is_deep: bool,
}

impl ExrReader {
    /// Opens part `part` of what begins where a file stands.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is damaged or not supported, naming it.
    pub fn open(mut file: File, name: &str, part: usize) -> Result<Self> {
        let failed = |e| Error::disk(name, "read", e);
        let first = file.stream_position().map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len().saturating_sub(first);
        let mut reader = ReadAhead::new(Positioned::of(file).map_err(failed)?);
        let meta = read_meta(&mut reader, name)?;
        let contents = Contents::of(&meta, part, name)?;
        let mut offsets = Offsets::new();
        let mut last: Option<LastBlock> = None;
        for (index, header) in meta.headers.iter().enumerate() {
            // An entry takes 8 bytes, and its block at least 8 more.
            if header.chunk_count as u64 > length / 16 {
                return Err(Error::cut_short(name));
            }
            let table = read_table(&mut reader, header.chunk_count, name)?;
            let may_be_last = meta.requirements.is_multilayer() || header.blocks != BlockDescription::ScanLines;
            if may_be_last
                && let Some((_, offset)) = table.extent().0
                && last.as_ref().is_none_or(|last| last.offset < offset)
            {
                last = Some(LastBlock::of(header, &meta, offset));
            }
            if index == part {
                offsets = table;
            }
        }
        let position = reader.stream_position().map_err(failed)? - first;
        let blocks = Blocks::of_file(reader, name, position, length, offsets)?;
        Ok(Self { last, ..Self::new(blocks, name, meta, part, contents) })
    }

    /// Opens a stream that cannot seek: scanlines in increasing order, a single part.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is damaged, not supported, or needs a seek.
    pub fn stream(mut input: Pipe, name: &str) -> Result<Self> {
        let mut counted = Counted { inner: &mut input, count: 0 };
        let meta = read_meta(&mut counted, name)?;
        let contents = Contents::of(&meta, 0, name)?;
        if meta.headers[0].line_order != LineOrder::Increasing {
            return Err(Error::format(
                name,
                "its rows are stored from bottom to top, which a pipe cannot turn round; name the file instead",
            ));
        }
        let offsets = read_table(&mut counted, meta.headers[0].chunk_count, name)?;
        let position = counted.count;
        Ok(Self::new(Blocks::of_pipe(input, name, position, offsets), name, meta, 0, contents))
    }

    fn new(blocks: Blocks, name: &str, meta: MetaData, part: usize, contents: Contents) -> Self {
        let straight = Straight::of(&meta, part, &contents.order);
        let name = name.into();
        Self { blocks, name, meta, part, contents, straight, rows_read: 0, ahead: Vec::new(), last: None }
    }

    /// Whether the second part holds layers of the first, which is of ours.
    pub(super) fn has_layers(&self) -> bool {
        let [image, layers] = &self.meta.headers[..] else { return false };
        let named = |header: &Header, name: &str| {
            header.own_attributes.layer_name.as_ref().is_some_and(|text| text.as_slice() == name.as_bytes())
        };
        let window = |header: &Header| (header.layer_size, header.own_attributes.layer_position);
        let counts = |header: &Header| {
            let of_layers = header
                .channels
                .list
                .iter()
                .filter(|channel| std::str::from_utf8(channel.name.as_slice()).is_ok_and(is_layer));
            (of_layers.count(), header.channels.list.len())
        };
        let is_image = self.contents.tags.metadata.is_some() && counts(image).0 == 0;
        let are_layers = counts(layers).0 == counts(layers).1 && window(layers) == window(image);
        is_image && are_layers && named(image, PART_NAMES[0]) && named(layers, PART_NAMES[1])
    }

    /// What lies behind this part and `other`, once both have been read.
    pub(super) fn rest_behind(&mut self, other: &Self) -> Result<Rest> {
        if !(self.is_done() && other.is_done()) {
            return Ok(Rest::Nothing);
        }
        self.blocks.end_with(&other.blocks);
        self.blocks.rest()
    }

    fn is_done(&self) -> bool {
        self.ahead.is_empty() && self.rows_read == self.contents.geometry.height
    }

    fn header(&self) -> &Header {
        &self.meta.headers[self.part]
    }

    /// Takes some of the next `rows` rows that need no decoding; says whether there were any. What is not as it should be is
    /// left to [`Self::next_chunk`], which has the words for it.
    fn read_straight(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<bool> {
        let Some(straight) = &self.straight else { return Ok(false) };
        let (first, block) = (self.rows_read, straight.block_bytes);
        let left = self.contents.geometry.height - first;
        let blocks = self.blocks.peek(first, block, left)?;
        let fit = |(index, block): &(usize, &[u8])| straight.is_row(block, first + index);
        let fitting = blocks.chunks_exact(block).take(rows).enumerate().take_while(fit);
        let taken = fitting.map(|(_, block)| straight.append(block, samples)).count();
        self.blocks.skip(taken * block);
        self.rows_read += taken;
        Ok(taken > 0)
    }

    /// Decodes the next block of scanlines, or row of tiles.
    fn read_row_of_blocks(&mut self, samples: &mut Vec<f32>) -> Result<()> {
        let (first, natural) = (self.rows_read, self.natural_rows());
        let rows = natural.min(self.contents.geometry.height - first);
        let across = match self.header().blocks {
            BlockDescription::ScanLines => 1,
            BlockDescription::Tiles(tiles) => self.contents.geometry.width.div_ceil(tiles.tile_size.width()),
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
            self.check_proportion(rows, count)?;
            let (meta, name) = (&self.meta, &self.name);
            let decode =
                |chunk| UncompressedBlock::decompress_chunk(chunk, meta, true).map_err(|e| exr_complaint(name, &e));
            let blocks: Vec<UncompressedBlock> = if count > 1 {
                chunks.into_par_iter().map(decode).collect::<Result<_>>()?
            } else {
                chunks.into_iter().map(decode).collect::<Result<_>>()?
            };
            // Only now, when data have come, is memory given to the rows.
            samples.resize(start + rows * self.contents.geometry.row_samples(), 0.0);
            for block in &blocks {
                self.place(block, first, rows, &mut samples[start..])?;
            }
            done += count;
        }
        self.rows_read += rows;
        Ok(())
    }

    /// Refuses `count` blocks of so many rows each that become out of all proportion to what is stored of them, and rows of
    /// tiles that do: where nothing but a header says how large they are, small files would take much memory.
    fn check_proportion(&self, rows: usize, count: usize) -> Result<()> {
        let Geometry { width, .. } = self.contents.geometry;
        let columns = self.header().max_block_pixel_size().width().min(width);
        let pixel = self.header().channels.bytes_per_pixel as u128;
        let block = columns as u128 * rows as u128 * pixel * count as u128;
        let row = width as u128 * rows as u128 * pixel;
        let within = |bytes: u128, stored: u64| bytes <= u128::from(stored.saturating_mul(MOST_EXPANSION)).max(SMALL);
        if within(block, self.blocks.stored()) && within(row, self.blocks.known()) {
            return Ok(());
        }
        let (mebibytes, stored) = (block >> 20, self.blocks.stored() >> 10);
        Err(Error::format(
            &self.name,
            format!(
                "its first blocks hold {stored} KiB and would become {mebibytes} MiB; it is damaged, or stored in blocks that are too large: store it in smaller ones"
            ),
        ))
    }

    /// Reads the chunk of block `index` (blocks counted row by row), which must lie at `column` and row `first`.
    fn next_chunk(&mut self, index: usize, column: usize, first: usize) -> Result<Chunk> {
        let chunk = self.blocks.chunk(index, &self.meta, self.part)?;
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
            Err(Error::format(
                &self.name,
                format!("the block of row {first} is missing or out of order; it is damaged"),
            ))
        }
    }

    /// Puts a decoded block into rows that start at row `first`.
    fn place(&self, block: &UncompressedBlock, first: usize, rows: usize, samples: &mut [f32]) -> Result<()> {
        let header = self.header();
        let (width, channels) = (self.contents.geometry.width, self.contents.geometry.channels.len());
        let (left, top) = (block.index.pixel_position.x(), block.index.pixel_position.y());
        let (block_width, block_rows) = (block.index.pixel_size.width(), block.index.pixel_size.height());
        if top != first || block_rows != rows || left + block_width > width {
            return Err(Error::format(&self.name, "a block has another size than its header says; it is damaged"));
        }
        // Where each of the file's channels goes.
        let mut target = vec![0; channels];
        for (channel, &place) in self.contents.order.iter().enumerate() {
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
                    ExrSampleType::F32 => {
                        for (to, from) in to.iter_mut().zip(line.as_chunks().0) {
                            *to = f32::from_ne_bytes(*from);
                        }
                    }
                    ExrSampleType::F16 => {
                        for (to, from) in to.iter_mut().zip(line.as_chunks().0) {
                            *to = f16::from_ne_bytes(*from).to_f32();
                        }
                    }
                    ExrSampleType::U32 => {
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

impl SampleReader for ExrReader {
    fn geometry(&self) -> &Geometry {
        &self.contents.geometry
    }

    /// The data window always has a corner.
    fn tells_place(&self) -> bool {
        true
    }

    fn stored_as(&self) -> Option<SampleType> {
        self.contents.stored_as
    }

    fn natural_rows(&self) -> usize {
        self.header().max_block_pixel_size().height().min(self.contents.geometry.height)
    }

    fn may_wait(&self) -> bool {
        self.blocks.is_pipe()
    }

    fn embedded(&self) -> Option<&str> {
        self.contents.tags.metadata.as_deref()
    }

    fn own_tags(&self) -> &Metadata {
        &self.contents.own_tags
    }

    /// Samples are linear; without the attribute `chromaticities` the primaries are those of BT.709, by the format's rules.
    fn colors(&self) -> ColorTags {
        let primaries = self.contents.tags.primaries;
        let is_one = |luminance: &f64| *luminance > 0.0 && luminance.is_finite();
        let white_luminance = self.contents.tags.white_luminance.filter(is_one);
        ColorTags { primaries, encoding: Some(Encoding::Linear), white_luminance, unread: None }
    }

    fn notes(&self) -> &[String] {
        &self.contents.notes
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let row = self.contents.geometry.row_samples();
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

    fn rest(&mut self) -> Result<Rest> {
        if !self.is_done() {
            return Ok(Rest::Nothing);
        }
        if let Some(LastBlock { offset, size_at, is_deep }) = self.last {
            self.blocks.end_with_block(offset, size_at, is_deep)?;
        }
        self.blocks.rest()
    }
}

impl LastBlock {
    /// The block at a place, which is one of this part \[OpenEXR file layout].
    fn of(header: &Header, meta: &MetaData, offset: u64) -> Self {
        let part_number = if meta.requirements.is_multilayer() { 4 } else { 0 };
        let place = if header.blocks == BlockDescription::ScanLines { 4 } else { 16 };
        Self { offset, size_at: part_number + place, is_deep: header.deep }
    }
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
