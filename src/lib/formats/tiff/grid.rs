//! Strips and tiles: how many an image must have, and where they lie in its file.

use super::chunk::Compression;
use super::directory::{Directory, TiffFile};
use crate::error::Result;
use tiff::tags::Tag;

/// Chunks that decode together may have this many bytes; they are held in memory.
const MOST_DECODED_BYTES: u128 = 1 << 30;
/// So many they may have however small the file is; if more, then so many times what the file has.
const SMALL_BYTES: u128 = 64 << 20;
const MOST_EXPANSION: u128 = 64;

/// The strips or tiles of an image, as its tags say. Strips are tiles as wide as the image.
pub(super) struct Grid {
    pub tiled: bool,
    pub chunk_width: u64,
    pub chunk_rows: u64,
    /// Chunks beside each other.
    pub across: u64,
    /// Chunks below each other.
    pub down: u64,
    height: u64,
    /// How often the chunks that make up the image come: once, or once for each channel.
    planes: u64,
    /// Decoded bytes of a chunk's row.
    chunk_row_bytes: u128,
    compression: Compression,
}

/// What of the image its chunks depend on.
pub(super) struct Pixels {
    pub width: u64,
    pub height: u64,
    pub channels: u64,
    /// Each chunk holds one channel only.
    pub planar: bool,
    pub sample_bytes: usize,
    pub compression: Compression,
}

impl Grid {
    /// Reads the size of the chunks.
    ///
    /// # Errors
    ///
    /// When they have none.
    pub fn read(file: &mut TiffFile, directory: &Directory, pixels: &Pixels) -> Result<Self> {
        let &Pixels { width, height, channels, planar, sample_bytes, compression } = pixels;
        let tiled = directory.has(Tag::TileWidth) || directory.has(Tag::TileLength);
        let (chunk_width, chunk_rows) = if tiled {
            let width = file.one(directory, Tag::TileWidth)?;
            (width.unwrap_or_default(), file.one(directory, Tag::TileLength)?.unwrap_or_default())
        } else {
            (width, file.one(directory, Tag::RowsPerStrip)?.unwrap_or(height).min(height))
        };
        if ![chunk_width, chunk_rows].iter().all(|size| (1..1 << 32).contains(size)) {
            let what = if tiled { "tiles" } else { "strips" };
            return Err(file.problem(format!("the file is damaged; its {what} have no size")));
        }
        let planes = if planar { channels } else { 1 };
        Ok(Self {
            tiled,
            chunk_width,
            chunk_rows,
            across: width.div_ceil(chunk_width),
            down: height.div_ceil(chunk_rows),
            height,
            planes,
            chunk_row_bytes: u128::from(chunk_width) * u128::from(channels / planes) * sample_bytes as u128,
            compression,
        })
    }

    /// Reads where the chunks lie: offset and bytes of each, `[plane][down][across]`.
    ///
    /// # Errors
    ///
    /// When the list is too short, the file too short for what it says, or a piece too large for memory.
    pub fn chunks(&self, file: &mut TiffFile, directory: &Directory) -> Result<Vec<(u64, u64)>> {
        let needed = u128::from(self.across) * u128::from(self.down) * u128::from(self.planes);
        // Each chunk has an offset of at least two bytes, so a larger number cannot be true.
        let Some(needed) = u64::try_from(needed).ok().filter(|&n| n <= file.length) else {
            return Err(file.cut_short("the list of strips or tiles"));
        };
        let strip_tags = (Tag::StripOffsets, Tag::StripByteCounts);
        let tile_tags = (Tag::TileOffsets, Tag::TileByteCounts);
        let of_tiles = self.tiled && directory.has(Tag::TileOffsets);
        let (offset_tag, count_tag) = if of_tiles { tile_tags } else { strip_tags };
        let offsets = file.unsigned(directory, offset_tag, needed)?.unwrap_or_default();
        if (offsets.len() as u64) < needed {
            let found = offsets.len();
            return Err(file.problem(format!(
                "the file is damaged; it lists {found} of the {needed} strips or tiles that its size needs"
            )));
        }
        let counts = file.unsigned(directory, count_tag, needed)?;
        self.check_memory(file)?;
        self.check(file, &offsets, counts.as_deref())
    }

    /// Refuses pieces that do not fit into memory.
    fn check_memory(&self, file: &TiffFile) -> Result<()> {
        let pieces = u128::from(self.across) * u128::from(self.planes);
        let together = self.chunk_row_bytes * u128::from(self.chunk_rows) * pieces;
        let in_proportion = SMALL_BYTES.max(u128::from(file.length) * MOST_EXPANSION);
        if self.compression == Compression::None || together <= MOST_DECODED_BYTES.min(in_proportion) {
            return Ok(());
        }
        if together > in_proportion {
            return Err(file.problem(format!(
                "{} rows would become {} MiB at a time of a file of {} KiB; it is damaged, or compressed in pieces that are too large: rewrite it with smaller strips, for example with `tiffcp -s -r 64 in.tif out.tif`",
                self.chunk_rows,
                together >> 20,
                file.length >> 10
            )));
        }
        Err(file.problem(format!(
            "{} rows are compressed as one piece of {} MiB, more than fits into memory; rewrite it with smaller strips, for example with `tiffcp -s -r 64 in.tif out.tif`",
            self.chunk_rows,
            together >> 20
        )))
    }

    /// Pairs offsets with byte counts, and refuses a file that cannot hold what they promise.
    fn check(&self, file: &TiffFile, offsets: &[u64], counts: Option<&[u64]>) -> Result<Vec<(u64, u64)>> {
        let mut total_stored = 0u128;
        let mut chunks = Vec::with_capacity(offsets.len());
        for (index, &offset) in offsets.iter().enumerate() {
            // A tile is stored whole even where it hangs over the edge; the last strip of a plane is not.
            let rows = if self.tiled {
                self.chunk_rows
            } else {
                self.chunk_rows.min(self.height - index as u64 % self.down * self.chunk_rows)
            };
            let decoded = self.chunk_row_bytes * u128::from(rows);
            let stored = match counts {
                Some(counts) => counts.get(index).copied().unwrap_or_default(),
                // The byte count of what is not compressed is known without its tag.
                None if self.compression == Compression::None => u64::try_from(decoded).unwrap_or(u64::MAX),
                None => return Err(file.problem("the file is damaged; it lacks StripByteCounts")),
            };
            let what = if self.tiled { "tile" } else { "strip" };
            if !file.holds(offset, stored) {
                return Err(file.cut_short(&format!("{what} {index}")));
            }
            if decoded > u128::from(stored) * self.compression.most_expansion() {
                return Err(file.problem(format!(
                    "{what} {index} holds fewer bytes than its size needs; it was cut short or damaged"
                )));
            }
            total_stored += u128::from(stored);
            chunks.push((offset, stored));
        }
        if total_stored > u128::from(file.length) {
            return Err(file.problem("the file is damaged; its strips or tiles overlap"));
        }
        Ok(chunks)
    }
}
