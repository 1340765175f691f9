//! Writes scanline EXR files; without compression they need no seek.

use super::straight::encode;
use super::write_behind::WriteBehind;
use super::{
    DATA, ExrCompression, ExrSamples, ExrTags, INTEROP_ATTRIBUTE, Layers, METADATA_ATTRIBUTE, PARALLEL_BLOCK_BYTES,
    PART_NAMES, UNITS_ATTRIBUTE, is_layer,
};
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

/// Writes a scanline EXR file, of one part or with the layers in a second one.
///
/// Without compression every size is known, so headers and offset tables come first and nothing is patched.
pub struct ExrWriter<W> {
    output: WriteBehind<W>,
    name: String,
    /// Those of the parts.
    headers: Vec<Header>,
    parts: Vec<Part>,
    samples: ExrSamples,
    geometry: Geometry,
    rows_taken: usize,
    /// Where the offset tables of all parts begin, one behind another.
    table_at: u64,
    position: u64,
}

/// A part that is being written.
struct Part {
    /// For each of its channels, the place in the geometry.
    order: Vec<usize>,
    /// Bytes of the rows of a block that is to be compressed and not full yet.
    partial: Vec<u8>,
    /// Where each compressed block went.
    offsets: Vec<u64>,
}

/// Offset tables that must be put in once the file is written: where, and what.
pub type TablePatch = (u64, Vec<u8>);

impl<W: Write> ExrWriter<W> {
    /// Writes headers and offset tables.
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
        layers: Layers,
        tags: &ExrTags,
    ) -> Result<Self> {
        let orders = orders(geometry, layers);
        let is_divided = orders.len() > 1;
        let mut headers = Vec::new();
        for (order, part_name) in orders.iter().zip(PART_NAMES) {
            let mut header = file_header(name, geometry, order, samples, compression, tags)?;
            if is_divided {
                header.own_attributes.layer_name = Some(Text::new_or_panic(part_name));
            }
            if !headers.is_empty() {
                mark_as_data(&mut header);
            }
            headers.push(header);
        }
        let mut head = Vec::new();
        let requirements = Requirements {
            file_format_version: 2,
            is_single_layer_and_tiled: false,
            has_long_names: geometry.channels.iter().any(|channel| channel.len() > 31),
            has_deep_data: false,
            has_multiple_layers: is_divided,
        };
        let encoded = magic_number::write(&mut head)
            .and_then(|()| requirements.write(&mut head))
            .and_then(|()| Header::write_all(&headers, &mut head, is_divided));
        encoded.map_err(|error| Error::format(name, format!("its header cannot be written: {error}")))?;
        let table_at = head.len() as u64;
        let blocks = headers.iter().map(|header| header.chunk_count as u64).sum::<u64>();
        let parts = orders.into_iter().map(|order| Part { order, partial: Vec::new(), offsets: Vec::new() }).collect();
        let mut writer = Self {
            output: WriteBehind::new(output),
            name: name.into(),
            headers,
            parts,
            samples,
            geometry: geometry.clone(),
            rows_taken: 0,
            table_at,
            position: table_at + 8 * blocks,
        };
        writer.put(&head)?;
        writer.put_tables(compression)?;
        Ok(writer)
    }

    /// Writes the offset tables: those of uncompressed blocks as they will be, others empty.
    fn put_tables(&mut self, compression: ExrCompression) -> Result<()> {
        let (first, is_plain) = (self.position, compression == ExrCompression::None);
        // An uncompressed block is one row; of several parts, each part's row follows that of the part before it.
        let sizes: Vec<u64> = (0..self.parts.len()).map(|part| self.block_bytes(part)).collect();
        for part in 0..self.parts.len() {
            let before = sizes[..part].iter().sum::<u64>();
            // Entry by entry: the table of a frame of 2^31 rows takes 16 GiB.
            for block in 0..self.headers[part].chunk_count as u64 {
                let offset = if is_plain { first + before + block * sizes.iter().sum::<u64>() } else { 0 };
                self.put(&offset.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// Bytes of an uncompressed block: the part's number where there are several, y coordinate and size in 4 bytes each, then
    /// the samples.
    fn block_bytes(&self, part: usize) -> u64 {
        let number = if self.parts.len() > 1 { 4 } else { 0 };
        number + 8 + self.headers[part].max_block_byte_size() as u64
    }

    /// The head of a block of `bytes` bytes that begins at row `y`.
    fn block_head(&self, part: usize, y: i32, bytes: usize) -> Vec<u8> {
        let size = i32::try_from(bytes).unwrap_or(i32::MAX);
        let number = i32::try_from(part).ok().filter(|_| self.parts.len() > 1);
        number.into_iter().chain([y, size]).flat_map(i32::to_le_bytes).collect()
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
        let is_compressed = self.is_compressed();
        for row in samples.chunks_exact(self.geometry.row_samples()) {
            for part in 0..self.parts.len() {
                if is_compressed {
                    self.gather(part, row);
                } else {
                    self.put_row(part, row).map_err(|e| Error::disk(&self.name, "write", e))?;
                }
            }
            self.rows_taken += 1;
            for part in 0..self.parts.len() {
                self.compress_full_blocks(part)?;
            }
        }
        Ok(())
    }

    fn is_compressed(&self) -> bool {
        self.headers[0].compression != Compression::Uncompressed
    }

    /// Writes a row as a block, in the part's order of channels.
    fn put_row(&mut self, part: usize, row: &[f32]) -> io::Result<()> {
        let size = self.headers[part].max_block_byte_size();
        let head = self.block_head(part, self.row_coordinate(self.rows_taken), size);
        self.output.write_all(&head)?;
        let (width, bytes) = (self.geometry.width, self.samples.bytes());
        for &channel in &self.parts[part].order {
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

    /// Appends a row to what is to be compressed, in the part's order of channels.
    fn gather(&mut self, part: usize, row: &[f32]) {
        let (width, bytes) = (self.geometry.width, self.samples.bytes());
        let Part { order, partial, .. } = &mut self.parts[part];
        for &channel in order.iter() {
            let start = partial.len();
            partial.resize(start + width * bytes, 0);
            encode(&row[channel * width..(channel + 1) * width], self.samples, &mut partial[start..]);
        }
    }

    fn row_coordinate(&self, row: usize) -> i32 {
        self.geometry.origin[1].wrapping_add(i32::try_from(row).unwrap_or(i32::MAX))
    }

    /// Compresses what is pending once it fills enough blocks to keep the threads busy, or at the end.
    fn compress_full_blocks(&mut self, part: usize) -> Result<()> {
        let block_bytes = self.headers[part].max_block_byte_size();
        let together = (PARALLEL_BLOCK_BYTES / block_bytes).clamp(1, 2 * rayon::current_num_threads());
        let last = self.rows_taken == self.geometry.height;
        let gathered = self.parts[part].partial.len();
        if gathered == 0 || !(last || gathered >= together * block_bytes) {
            return Ok(());
        }
        let lines = self.headers[part].compression.scan_lines_per_block();
        let pending = std::mem::take(&mut self.parts[part].partial);
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
                    layer: part,
                    pixel_position: Vec2(0, row),
                    pixel_size: Vec2(self.geometry.width, data.len() / (block_bytes / lines)),
                    level: Vec2(0, 0),
                },
                data,
            };
            block
                .compress_to_chunk(&self.headers)
                .map_err(|error| Error::format(&self.name, format!("a block cannot be compressed: {error}")))
        };
        let chunks: Vec<Chunk> = blocks.into_par_iter().enumerate().map(compress).collect::<Result<Vec<_>>>()?;
        for chunk in chunks {
            let CompressedBlock::ScanLine(block) = &chunk.compressed_block else { continue };
            self.parts[part].offsets.push(self.position);
            let head = self.block_head(part, block.y_coordinate, block.compressed_pixels_le.len());
            self.put(&head)?;
            self.put(&block.compressed_pixels_le)?;
            self.position += (head.len() + block.compressed_pixels_le.len()) as u64;
        }
        Ok(())
    }

    /// Ends the file; gives back the output and, after compression, the offset tables to patch in.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`] where writing fails.
    pub fn finish(self) -> Result<(W, Option<TablePatch>)> {
        assert_eq!(self.rows_taken, self.geometry.height, "a frame was ended before its last row");
        let is_compressed = self.is_compressed();
        let output = self.output.finish().map_err(|e| Error::disk(&self.name, "write", e))?;
        let offsets = self.parts.iter().flat_map(|part| &part.offsets);
        let patch = is_compressed.then(|| (self.table_at, offsets.flat_map(|offset| offset.to_le_bytes()).collect()));
        Ok((output, patch))
    }
}

/// Puts offset tables into their place.
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

/// For each part the places of its channels in the geometry, by their names.
fn orders(geometry: &Geometry, layers: Layers) -> Vec<Vec<usize>> {
    let is_apart = |place: &usize| layers == Layers::InAPartOfTheirOwn && is_layer(&geometry.channels[*place]);
    let (beside, image): (Vec<usize>, Vec<usize>) = (0..geometry.channels.len()).partition(is_apart);
    let mut orders = if beside.is_empty() || image.is_empty() {
        vec![(0..geometry.channels.len()).collect::<Vec<usize>>()]
    } else {
        vec![image, beside]
    };
    for order in &mut orders {
        order.sort_by(|&a, &b| geometry.channels[a].as_bytes().cmp(geometry.channels[b].as_bytes()));
    }
    orders
}

/// Says of a part that its channels are no colors. What holds for the whole file stays with the first.
fn mark_as_data(header: &mut Header) {
    let own = LayerAttributes { layer_position: header.own_attributes.layer_position, ..LayerAttributes::default() };
    header.own_attributes = LayerAttributes { layer_name: header.own_attributes.layer_name.take(), ..own };
    let name = (Text::new_or_panic(INTEROP_ATTRIBUTE), AttributeValue::Text(Text::new_or_panic(DATA)));
    header.shared_attributes.other = std::iter::once(name).collect();
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
    own.iso_speed = tags.iso_speed.map(to_sample);
    own.white_luminance = tags.white_luminance.map(to_sample);
    own.adopted_neutral = tags.neutral_xy.map(point);
    // The crate keeps other attributes in hash maps; one entry alone in each has the same order in every run.
    if let Some(metadata) = &tags.metadata {
        own.other.insert(Text::new_or_panic(METADATA_ATTRIBUTE), AttributeValue::Text(text(metadata)));
    }
    if let (Some(unit), None) = (&tags.emissive_units, &tags.metadata) {
        own.other.insert(Text::new_or_panic(UNITS_ATTRIBUTE), AttributeValue::Text(text(unit)));
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
