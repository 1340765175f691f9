//! Writes scanline EXR files; without compression they need no seek.

use super::straight::encode;
use super::write_behind::WriteBehind;
use super::{ExrCompression, ExrSamples, ExrTags, INTEROP_ATTRIBUTE, METADATA_ATTRIBUTE, PARALLEL_BLOCK_BYTES};
use crate::error::{Error, Result};
use crate::frame::{Geometry, to_sample};
use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, ChannelList, Chromaticities, IntegerBounds, LineOrder, SampleType, Text,
};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::meta::{BlockDescription, Requirements, magic_number};
use rayon::prelude::*;
use std::io::{self, Seek, SeekFrom, Write};

/// Writes a scanline EXR file, single part.
///
/// Without compression every size is known, so header and offset table come first and nothing is patched.
pub struct ExrWriter<W> {
    output: WriteBehind<W>,
    name: String,
    header: Header,
    samples: ExrSamples,
    geometry: Geometry,
    /// For each of the file's channels, its place in the geometry.
    order: Vec<usize>,
    rows_taken: usize,
    /// Bytes of the rows of a block that is to be compressed and not full yet.
    partial: Vec<u8>,
    /// Where each compressed block went.
    offsets: Vec<u64>,
    table_at: u64,
    position: u64,
}

/// An offset table that must be put in once the file is written: where, and what.
pub type TablePatch = (u64, Vec<u8>);

impl<W: Write> ExrWriter<W> {
    /// Writes header and offset table.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`] where writing fails, [`Error::Data`] for a frame larger than the format can hold.
    pub fn create(
        output: W,
        name: &str,
        geometry: &Geometry,
        samples: ExrSamples,
        compression: ExrCompression,
        tags: &ExrTags,
    ) -> Result<Self> {
        let mut order: Vec<usize> = (0..geometry.channels.len()).collect();
        order.sort_by(|&a, &b| geometry.channels[a].as_bytes().cmp(geometry.channels[b].as_bytes()));
        let header = file_header(name, geometry, &order, samples, compression, tags)?;
        let mut head = Vec::new();
        let requirements = Requirements {
            file_format_version: 2,
            is_single_layer_and_tiled: false,
            has_long_names: geometry.channels.iter().any(|channel| channel.len() > 31),
            has_deep_data: false,
            has_multiple_layers: false,
        };
        let encoded = magic_number::write(&mut head)
            .and_then(|()| requirements.write(&mut head))
            .and_then(|()| Header::write_all(std::slice::from_ref(&header), &mut head, false));
        encoded.map_err(|error| Error::format(name, format!("its header cannot be written: {error}")))?;
        let table_at = head.len() as u64;
        let blocks = header.chunk_count as u64;
        let data_at = table_at + 8 * blocks;
        // An uncompressed block is one row: y coordinate and size in 4 bytes each, then the samples.
        let block_bytes = 8 + header.max_block_byte_size() as u64;
        let mut writer = Self {
            output: WriteBehind::new(output),
            name: name.into(),
            header,
            samples,
            geometry: geometry.clone(),
            order,
            rows_taken: 0,
            partial: Vec::new(),
            offsets: Vec::new(),
            table_at,
            position: data_at,
        };
        writer.put(&head)?;
        // Entry by entry: the table of a frame of 2^31 rows takes 16 GiB.
        for block in 0..blocks {
            let offset = if compression == ExrCompression::None { data_at + block * block_bytes } else { 0 };
            writer.put(&offset.to_le_bytes())?;
        }
        Ok(writer)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.output.write_all(bytes).map_err(|e| Error::disk(&self.name, "write", e))
    }

    /// Takes rows laid out as `[row][channel][column]`.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`] where writing fails.
    pub fn write(&mut self, samples: &[f32]) -> Result<()> {
        let is_compressed = self.header.compression != Compression::Uncompressed;
        for row in samples.chunks_exact(self.geometry.row_samples()) {
            if is_compressed {
                self.gather(row);
                self.rows_taken += 1;
                self.compress_full_blocks()?;
            } else {
                self.put_row(row).map_err(|e| Error::disk(&self.name, "write", e))?;
                self.rows_taken += 1;
            }
        }
        Ok(())
    }

    /// Writes a row as a block, in the file's order of channels.
    fn put_row(&mut self, row: &[f32]) -> io::Result<()> {
        let size = i32::try_from(self.header.max_block_byte_size()).unwrap_or(i32::MAX);
        self.output.write_all(&self.row_coordinate(self.rows_taken).to_le_bytes())?;
        self.output.write_all(&size.to_le_bytes())?;
        let (width, bytes) = (self.geometry.width, self.samples.bytes());
        for &channel in &self.order {
            let mut line = &row[channel * width..(channel + 1) * width];
            while !line.is_empty() {
                let room = self.output.room(bytes)?;
                let (now, later) = line.split_at(line.len().min(room.len() / bytes));
                encode(now, self.samples, &mut room[..now.len() * bytes]);
                self.output.add(now.len() * bytes);
                line = later;
            }
        }
        Ok(())
    }

    /// Appends a row to what is to be compressed, in the file's order of channels.
    fn gather(&mut self, row: &[f32]) {
        let (width, bytes) = (self.geometry.width, self.samples.bytes());
        for &channel in &self.order {
            let start = self.partial.len();
            self.partial.resize(start + width * bytes, 0);
            encode(&row[channel * width..(channel + 1) * width], self.samples, &mut self.partial[start..]);
        }
    }

    fn row_coordinate(&self, row: usize) -> i32 {
        self.geometry.origin[1].wrapping_add(i32::try_from(row).unwrap_or(i32::MAX))
    }

    /// Compresses what is pending once it fills enough blocks to keep the threads busy, or at the end.
    fn compress_full_blocks(&mut self) -> Result<()> {
        let block_bytes = self.header.max_block_byte_size();
        let together = (PARALLEL_BLOCK_BYTES / block_bytes).clamp(1, 2 * rayon::current_num_threads());
        let last = self.rows_taken == self.geometry.height;
        if self.partial.is_empty() || !(last || self.partial.len() >= together * block_bytes) {
            return Ok(());
        }
        let lines = self.header.compression.scan_lines_per_block();
        let pending = std::mem::take(&mut self.partial);
        let first_row = self.rows_taken - pending.len() / (block_bytes / lines);
        // A single block is moved, not copied: on wide frames it is the largest thing in memory.
        let blocks: Vec<Vec<u8>> = match pending.len() <= block_bytes {
            true => vec![pending],
            false => pending.chunks(block_bytes).map(<[u8]>::to_vec).collect(),
        };
        let compress = |(index, data): (usize, Vec<u8>)| {
            let row = first_row + index * lines;
            let block = UncompressedBlock {
                index: exr::block::BlockIndex {
                    layer: 0,
                    pixel_position: Vec2(0, row),
                    pixel_size: Vec2(self.geometry.width, data.len() / (block_bytes / lines)),
                    level: Vec2(0, 0),
                },
                data,
            };
            block
                .compress_to_chunk(std::slice::from_ref(&self.header))
                .map_err(|error| Error::format(&self.name, format!("a block cannot be compressed: {error}")))
        };
        let chunks: Vec<Chunk> = blocks.into_par_iter().enumerate().map(compress).collect::<Result<Vec<_>>>()?;
        for chunk in chunks {
            let CompressedBlock::ScanLine(block) = &chunk.compressed_block else { continue };
            self.offsets.push(self.position);
            let size = i32::try_from(block.compressed_pixels_le.len()).unwrap_or(i32::MAX);
            let head = [block.y_coordinate.to_le_bytes(), size.to_le_bytes()].concat();
            self.put(&head)?;
            self.put(&block.compressed_pixels_le)?;
            self.position += 8 + block.compressed_pixels_le.len() as u64;
        }
        Ok(())
    }

    /// Ends the file; gives back the output and, after compression, the offset table to patch in.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`] where writing fails.
    pub fn finish(self) -> Result<(W, Option<TablePatch>)> {
        assert_eq!(self.rows_taken, self.geometry.height, "a frame was ended before its last row");
        let output = self.output.finish().map_err(|e| Error::disk(&self.name, "write", e))?;
        let table = self.offsets.iter().flat_map(|offset| offset.to_le_bytes()).collect();
        let patch = (self.header.compression != Compression::Uncompressed).then_some((self.table_at, table));
        Ok((output, patch))
    }
}

/// Puts an offset table into its place.
///
/// # Errors
///
/// [`Error::Disk`] where writing fails.
pub fn patch_table<W: Write + Seek>(output: &mut W, name: &str, (at, table): &TablePatch) -> Result<()> {
    let patch = |output: &mut W| -> io::Result<()> {
        output.seek(SeekFrom::Start(*at))?;
        output.write_all(table)?;
        output.seek(SeekFrom::End(0))?;
        output.flush()
    };
    patch(output).map_err(|e| Error::disk(name, "write", e))
}

fn file_header(
    name: &str,
    geometry: &Geometry,
    order: &[usize],
    samples: ExrSamples,
    compression: ExrCompression,
    tags: &ExrTags,
) -> Result<Header> {
    let too_large = || Error::Data(format!("{name}: the frame is larger than an EXR file can hold"));
    let limit = i32::MAX as usize;
    if geometry.width > limit || geometry.height > limit || geometry.row_samples() * samples.bytes() * 32 > limit {
        return Err(too_large());
    }
    let sample_type = if samples == ExrSamples::F32 { SampleType::F32 } else { SampleType::F16 };
    let channels = order
        .iter()
        .map(|&place| ChannelDescription {
            name: text(&geometry.channels[place]),
            sample_type,
            quantize_linearly: false,
            sampling: Vec2(1, 1),
        })
        .collect();
    let size = Vec2(geometry.width, geometry.height);
    let origin = Vec2(geometry.origin[0], geometry.origin[1]);
    let compression = match compression {
        ExrCompression::None => Compression::Uncompressed,
        ExrCompression::Rle => Compression::RLE,
        ExrCompression::Zips => Compression::ZIP1,
        ExrCompression::Zip => Compression::ZIP16,
        ExrCompression::Piz => Compression::PIZ,
    };
    let (own, shared) = attributes(tags, origin, size);
    let blocks = BlockDescription::ScanLines;
    let mut header = Header {
        channels: ChannelList::new(channels),
        compression,
        blocks,
        line_order: LineOrder::Increasing,
        layer_size: size,
        deep: false,
        deep_data_version: None,
        chunk_count: 0,
        max_samples_per_pixel: None,
        shared_attributes: shared,
        own_attributes: own,
    };
    header.chunk_count = exr::meta::compute_chunk_count(compression, size, blocks);
    Ok(header)
}

/// The attributes of a part, and those of the whole file.
fn attributes(tags: &ExrTags, origin: Vec2<i32>, size: Vec2<usize>) -> (LayerAttributes, ImageAttributes) {
    let point = |[x, y]: [f64; 2]| Vec2(to_sample(x), to_sample(y));
    let mut own = LayerAttributes { layer_position: origin, ..LayerAttributes::default() };
    own.software_name = tags.software.as_ref().map(text);
    own.exposure = tags.exposure_s.map(to_sample);
    own.aperture = tags.f_number.map(to_sample);
    own.white_luminance = tags.white_luminance.map(to_sample);
    own.adopted_neutral = tags.neutral_xy.map(point);
    // The crate keeps other attributes in hash maps; one entry alone in each has the same order in every run.
    if let Some(metadata) = &tags.metadata {
        own.other.insert(Text::new_or_panic(METADATA_ATTRIBUTE), AttributeValue::Text(text(metadata)));
    }
    let mut shared = ImageAttributes::new(IntegerBounds::new(origin, size));
    if let Some(name) = &tags.interop_id {
        shared.other.insert(Text::new_or_panic(INTEROP_ATTRIBUTE), AttributeValue::Text(text(name)));
    }
    shared.chromaticities = tags.primaries.map(|[red, green, blue, white]| Chromaticities {
        red: point(red),
        green: point(green),
        blue: point(blue),
        white: point(white),
    });
    (own, shared)
}

/// A text as the crate holds it.
fn text(string: &String) -> Text {
    Text::from_slice_unchecked(string.as_bytes())
}
