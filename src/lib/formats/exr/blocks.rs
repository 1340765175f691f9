//! The blocks of a part as they are stored: found by the offset table in a file, met one after another in a pipe.
//!
//! A block says itself how long it is: memory is given to it only as its bytes come. In a pipe the table must tell where
//! each block lies as in a file, so that both are read or refused alike.

use super::straight::Offsets;
use crate::error::{Error, Result};
use crate::formats::format::Rest;
use crate::formats::positioned::Positioned;
use crate::formats::read_ahead::{Pipe, ReadAhead};
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use std::io::{self, Read};

/// Where the bytes come from.
enum Input {
    /// Another program.
    Pipe(Pipe),
    /// A file of so many bytes from the frame's first on.
    File(ReadAhead<Positioned>, u64),
    /// Handed to whoever reads on behind the frame.
    Gone(io::Empty),
}

/// The blocks of a part.
pub(super) struct Blocks {
    input: Input,
    name: String,
    /// Where the reader stands.
    position: u64,
    /// The end of the block that lies furthest behind.
    end: u64,
    /// Bytes of blocks that have been read.
    stored: u64,
    offsets: Offsets,
}

impl Blocks {
    /// Those of a frame from whose first byte on a file has `length` bytes; the reader stands at its `position`.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where the table points outside the file, or twice to the same place.
    pub fn of_file(
        reader: ReadAhead<Positioned>,
        name: &str,
        position: u64,
        length: u64,
        offsets: Offsets,
    ) -> Result<Self> {
        let (extent, twice) = offsets.extent();
        if extent.is_some_and(|(first, last)| first == 0 || last >= length) {
            return Err(Error::cut_short(name));
        }
        if twice {
            return Err(Error::format(name, "two entries of its table of blocks are the same; it is damaged"));
        }
        Ok(Self::new(Input::File(reader, length), name, position, offsets))
    }

    /// Those of a pipe, of which `position` bytes have been read.
    pub fn of_pipe(reader: Pipe, name: &str, position: u64, offsets: Offsets) -> Self {
        Self::new(Input::Pipe(reader), name, position, offsets)
    }

    fn new(input: Input, name: &str, position: u64, offsets: Offsets) -> Self {
        Self { input, name: name.into(), position, end: position, stored: 0, offsets }
    }

    /// Whether they come from another program.
    pub fn is_pipe(&self) -> bool {
        matches!(self.input, Input::Pipe(_))
    }

    /// Bytes of blocks that have been read.
    pub fn stored(&self) -> u64 {
        self.stored
    }

    /// Bytes that may belong to the image: those of the file, or what has come.
    pub fn known(&self) -> u64 {
        match self.input {
            Input::File(_, length) => length,
            Input::Pipe(_) | Input::Gone(_) => self.stored,
        }
    }

    /// Goes to block `index`; says whether the table has told the truth about it.
    fn go_to(&mut self, index: usize) -> Result<bool> {
        let offset = self.offsets.at(index);
        match &mut self.input {
            Input::Pipe(_) | Input::Gone(_) => Ok(offset == self.position),
            Input::File(reader, length) => {
                let delta =
                    i64::try_from(offset).ok().zip(i64::try_from(self.position).ok()).map(|(to, from)| to - from);
                let Some(delta) = delta.filter(|_| offset < *length) else { return Ok(false) };
                if delta != 0 {
                    reader.seek_relative(delta).map_err(|e| Error::disk(&self.name, "read", e))?;
                    self.position = offset;
                }
                Ok(true)
            }
        }
    }

    /// A look at the bytes of blocks of `bytes` bytes each, one behind another from block `index` on, at most `most`;
    /// nothing where they do not lie so.
    ///
    /// # Errors
    ///
    /// What the file says.
    pub fn peek(&mut self, index: usize, bytes: usize, most: usize) -> Result<&[u8]> {
        if !self.go_to(index)? {
            return Ok(&[]);
        }
        let run = self.offsets.run(index, bytes, most);
        Ok(match &mut self.input {
            Input::Pipe(reader) => reader.peek(bytes, run),
            Input::File(reader, _) => reader.peek(bytes, run),
            Input::Gone(_) => &[],
        })
    }

    /// Takes bytes that were looked at.
    pub fn skip(&mut self, bytes: usize) {
        match &mut self.input {
            Input::Pipe(reader) => reader.skip(bytes),
            Input::File(reader, _) => reader.skip(bytes),
            Input::Gone(_) => {}
        }
        self.passed(bytes as u64);
        self.stored += bytes as u64;
    }

    fn passed(&mut self, bytes: u64) {
        self.position += bytes;
        self.end = self.end.max(self.position);
    }

    /// Reads the block `index` of a part.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where it does not lie where the table says, is longer than it can be, or is cut short.
    pub fn chunk(&mut self, index: usize, meta: &MetaData, part: usize) -> Result<Chunk> {
        if !self.go_to(index)? {
            return Err(Error::format(
                &self.name,
                "its table of blocks points elsewhere than its blocks lie; it is damaged",
            ));
        }
        let header: &Header = &meta.headers[part];
        let layer_index = if meta.requirements.is_multilayer() { self.number()? } else { 0 };
        let layer_index = usize::try_from(layer_index).unwrap_or(usize::MAX);
        let compressed_block = match header.blocks {
            BlockDescription::ScanLines => {
                let y_coordinate = self.number()?;
                let compressed_pixels_le = self.bytes(header)?;
                CompressedBlock::ScanLine(CompressedScanLineBlock { y_coordinate, compressed_pixels_le })
            }
            BlockDescription::Tiles(_) => {
                let numbers = [self.number()?, self.number()?, self.number()?, self.number()?];
                let [x, y, level_x, level_y] = numbers.map(|number| usize::try_from(number).unwrap_or(usize::MAX));
                let coordinates = TileCoordinates {
                    tile_index: exr::math::Vec2(x, y),
                    level_index: exr::math::Vec2(level_x, level_y),
                };
                let compressed_pixels_le = self.bytes(header)?;
                CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
            }
        };
        Ok(Chunk { layer_index, compressed_block })
    }

    /// Reads a number of a block's head.
    fn number(&mut self) -> Result<i32> {
        let mut bytes = [0; 4];
        self.reader().read_exact(&mut bytes).map_err(|e| Error::disk(&self.name, "read", e))?;
        self.passed(4);
        Ok(i32::from_le_bytes(bytes))
    }

    /// Reads the bytes of a block behind their number.
    fn bytes(&mut self, header: &Header) -> Result<Vec<u8>> {
        /// So much memory is given on the word of a block.
        const AT_ONCE: usize = 1 << 20;
        let said = self.number()?;
        let Some(length) = usize::try_from(said).ok().filter(|length| *length <= header.max_block_byte_size()) else {
            return Err(Error::format(&self.name, "a block says that it is longer than its samples; it is damaged"));
        };
        let mut bytes = Vec::new();
        bytes.reserve_exact(length.min(AT_ONCE));
        self.reader().take(length as u64).read_to_end(&mut bytes).map_err(|e| Error::disk(&self.name, "read", e))?;
        if bytes.len() < length {
            return Err(Error::cut_short(&self.name));
        }
        self.passed(length as u64);
        self.stored += length as u64;
        Ok(bytes)
    }

    fn reader(&mut self) -> &mut dyn Read {
        match &mut self.input {
            Input::Pipe(reader) => reader,
            Input::File(reader, _) => reader,
            Input::Gone(nothing) => nothing,
        }
    }

    /// The blocks of another part of the same frame may lie further behind.
    pub fn end_with(&mut self, other: &Self) {
        self.end = self.end.max(other.end);
    }

    /// A block of the frame at `offset` tells the size of what it stores at its byte `size_at`: a deep one in two numbers, of a
    /// table and of samples.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where the file ends before it does; [`Error::Disk`].
    pub fn end_with_block(&mut self, offset: u64, size_at: u64, is_deep: bool) -> Result<()> {
        let Input::File(reader, length) = &mut self.input else { return Ok(()) };
        let mut sizes = [0; 16];
        let sizes = if is_deep { &mut sizes[..] } else { &mut sizes[..4] };
        let stored = offset + size_at + sizes.len() as u64;
        if stored > *length {
            return Err(Error::cut_short(&self.name));
        }
        let to = (offset + size_at).cast_signed() - self.position.cast_signed();
        let read = reader.seek_relative(to).and_then(|()| reader.read_exact(sizes));
        read.map_err(|e| Error::disk(&self.name, "read", e))?;
        self.position = stored;
        let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte));
        let size = sizes.chunks(8).map(number).fold(0, u64::saturating_add);
        self.end = self.end.max(stored.saturating_add(size));
        if self.end > *length {
            return Err(Error::cut_short(&self.name));
        }
        Ok(())
    }

    /// Hands out what lies behind the blocks, once all of a frame have been read.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn rest(&mut self) -> Result<Rest> {
        match std::mem::replace(&mut self.input, Input::Gone(io::empty())) {
            Input::Pipe(reader) => Ok(Rest::Pipe(reader)),
            Input::File(mut reader, length) if length > self.end => {
                let behind = self.end.cast_signed() - self.position.cast_signed();
                let at = reader.seek_relative(behind).and_then(|()| reader.stream_position());
                let at = at.map_err(|e| Error::disk(&self.name, "read", e))?;
                Ok(Rest::File(reader.into_inner().into_file(), at))
            }
            Input::File(..) | Input::Gone(_) => Ok(Rest::Nothing),
        }
    }
}
