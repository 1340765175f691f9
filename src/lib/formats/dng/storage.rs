//! How the samples of a raw image are stored, and where its strips or tiles lie.

use super::image::RawImage;
use super::tags;
use crate::error::Result;
use crate::formats::format::SampleType;
use crate::formats::tiff::{Directory, Predictor, TiffFile};
use tiff::tags::Tag;

/// Most samples beside or below each other in a tile.
const MOST_IN_TILE: usize = 1 << 20;

/// How strips or tiles are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    /// Before it, differences are taken from the sample so many before.
    Deflate(Predictor, usize),
    /// Where the flag is set, 16 bits follow the size 16 too, as before version 1.1 of DNG.
    LosslessJpeg {
        largest_has_bits: bool,
    },
}

/// How a sample is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sample {
    /// An unsigned integer of 8 to 16 bits; rows of others than 8 and 16 are packed, the highest bit first, and end at a
    /// byte.
    Integer { bits: u32 },
    /// A float of 16, 24 or 32 bits; that of 24 has 7 bits of exponent.
    Float { bits: u32 },
}

impl Sample {
    fn bits(self) -> u32 {
        match self {
            Self::Integer { bits } | Self::Float { bits } => bits,
        }
    }

    /// Whole bytes of a sample; 1 where samples are packed.
    pub fn bytes(self) -> usize {
        match self.bits() {
            16 => 2,
            24 => 3,
            32 => 4,
            _ => 1,
        }
    }

    /// Bytes of a row of so many samples.
    pub fn row_bytes(self, samples: usize) -> usize {
        (samples * self.bits() as usize).div_ceil(8)
    }

    /// The type that holds it.
    pub fn stored_as(self) -> SampleType {
        match self {
            Self::Integer { bits: 8 } => SampleType::U8,
            Self::Integer { .. } => SampleType::U16,
            Self::Float { bits: 16 } => SampleType::F16,
            Self::Float { .. } => SampleType::F32,
        }
    }

    /// The largest code, or 1 of floats: the white level where the file gives none \[DNG2023, WhiteLevel].
    pub fn largest(self) -> f64 {
        match self {
            Self::Integer { bits } => f64::from((1u32 << bits) - 1),
            Self::Float { .. } => 1.0,
        }
    }
}

/// Where the samples of an image lie, and how they are stored. Strips are tiles as wide as the image.
#[derive(Debug)]
pub(super) struct Storage {
    pub sample: Sample,
    pub compression: Compression,
    pub tiled: bool,
    pub chunk_width: usize,
    pub chunk_rows: usize,
    /// Chunks beside each other.
    pub across: usize,
    height: usize,
    /// Offset and bytes of each chunk in the file, `[down][across]`.
    pub chunks: Vec<(u64, u64)>,
}

impl Storage {
    /// Reads the tags of an image and checks them against each other and against the file's length.
    ///
    /// # Errors
    ///
    /// When tags are missing or contradict each other, when the file cannot hold what they promise, or when the image is of
    /// a kind that is not supported.
    pub fn read(file: &mut TiffFile, image: &RawImage) -> Result<Self> {
        let directory = image.directory();
        if file.one(directory, Tag::FillOrder)?.unwrap_or(1) != 1 {
            return Err(file.problem("bits in reversed order (FillOrder 2) are not supported"));
        }
        // Rows and columns that are not stored in their own order.
        for tag in [tags::SUB_TILE_BLOCK, tags::ROW_INTERLEAVE, tags::COLUMN_INTERLEAVE] {
            let factors = tag.numbers(file, directory, 2)?.unwrap_or_default();
            if factors.iter().any(|factor| *factor != 1.0) {
                return Err(file.problem(format!(
                    "its samples are stored in another order than that of the sensor ({}), which is not supported; convert it to DNG 1.5 or before",
                    tag.1
                )));
            }
        }
        let sample = sample(file, directory)?;
        let compression = compression(file, image, sample)?;
        let tiled = directory.has(Tag::TileWidth) || directory.has(Tag::TileLength);
        let [width, height] = image.size;
        let mut side = |tag: Tag, default: u64| -> Result<usize> {
            let side = file.one(directory, tag)?.unwrap_or(default);
            let fits = usize::try_from(side).ok().filter(|side| (1..=MOST_IN_TILE).contains(side));
            fits.ok_or_else(|| file.problem(format!("it is damaged; its tag {tag:?} is {side}")))
        };
        let (chunk_width, chunk_rows) = if tiled {
            (side(Tag::TileWidth, 0)?, side(Tag::TileLength, 0)?)
        } else {
            // A number beyond all rows stands for one strip.
            let rows = file.one(directory, Tag::RowsPerStrip)?.unwrap_or(u64::MAX);
            if rows == 0 {
                return Err(file.problem("it is damaged; its strips have no rows (RowsPerStrip 0)"));
            }
            (width, usize::try_from(rows).unwrap_or(usize::MAX).min(height))
        };
        let mut storage = Self {
            sample,
            compression,
            tiled,
            chunk_width,
            chunk_rows,
            across: width.div_ceil(chunk_width),
            height,
            chunks: Vec::new(),
        };
        storage.chunks = storage.places(file, directory)?;
        Ok(storage)
    }

    /// What a chunk is called.
    pub fn chunk_name(&self) -> &'static str {
        if self.tiled { "tile" } else { "strip" }
    }

    /// Rows that are stored in a chunk of this row of chunks: tiles are stored whole also where they hang over the lower edge,
    /// the last strip is not.
    pub fn stored_rows(&self, down: usize) -> usize {
        if self.tiled { self.chunk_rows } else { self.chunk_rows.min(self.height - down * self.chunk_rows) }
    }

    /// Reads where the chunks lie.
    fn places(&self, file: &mut TiffFile, directory: &Directory) -> Result<Vec<(u64, u64)>> {
        let needed = self.across as u64 * self.height.div_ceil(self.chunk_rows) as u64;
        // Each has an offset of two bytes at least.
        if needed > file.length() {
            return Err(file.cut_short("the list of strips or tiles"));
        }
        let of_tiles = self.tiled && directory.has(Tag::TileOffsets);
        let (offsets, counts) =
            if of_tiles { (Tag::TileOffsets, Tag::TileByteCounts) } else { (Tag::StripOffsets, Tag::StripByteCounts) };
        let mut list = |tag: Tag| -> Result<Vec<u64>> {
            let list = file.unsigned(directory, tag, needed)?.unwrap_or_default();
            if (list.len() as u64) < needed {
                return Err(file.problem(format!(
                    "it is damaged; its tag {tag:?} lists {} of {needed} {}s",
                    list.len(),
                    self.chunk_name()
                )));
            }
            Ok(list)
        };
        let places: Vec<(u64, u64)> = list(offsets)?.into_iter().zip(list(counts)?).collect();
        let mut total = 0u128;
        for (index, &(offset, stored)) in places.iter().enumerate() {
            if !file.holds(offset, stored) {
                return Err(file.cut_short(&format!("{} {index}", self.chunk_name())));
            }
            if u128::from(stored) < self.least_bytes(index / self.across) {
                return Err(file.problem(format!(
                    "{} {index} holds fewer bytes than its size needs; it was cut short or damaged",
                    self.chunk_name()
                )));
            }
            total += u128::from(stored);
        }
        if total > u128::from(file.length()) {
            return Err(file.problem(format!("it is damaged; its {}s overlap", self.chunk_name())));
        }
        Ok(places)
    }

    /// The fewest bytes that a chunk of this row of chunks can take.
    fn least_bytes(&self, down: usize) -> u128 {
        let rows = self.stored_rows(down) as u128;
        let row_bytes = self.sample.row_bytes(self.chunk_width) as u128;
        match self.compression {
            Compression::None => rows * row_bytes,
            // A match of 258 bytes in two bits.
            Compression::Deflate(..) => rows * row_bytes / 1032,
            // A bit a sample.
            Compression::LosslessJpeg { .. } => rows * self.chunk_width as u128 / 8,
        }
    }
}

/// How samples are stored, if they are of a kind that we read.
fn sample(file: &mut TiffFile, directory: &Directory) -> Result<Sample> {
    let Some(bits) = file.one(directory, Tag::BitsPerSample)? else {
        return Err(file.problem("it is damaged; its raw image lacks BitsPerSample"));
    };
    let format = file.one(directory, Tag::SampleFormat)?.unwrap_or(1);
    match (format, u32::try_from(bits)) {
        (1, Ok(bits @ 8..=16)) => Ok(Sample::Integer { bits }),
        (3, Ok(bits @ (16 | 24 | 32))) => Ok(Sample::Float { bits }),
        _ => Err(file.problem(format!(
            "its raw samples have {bits} bits in sample format {format}, which is not supported; unsigned integers of 8 to 16 bits and floats of 16, 24 and 32 are"
        ))),
    }
}

/// How the image is compressed, if we can undo it.
fn compression(file: &mut TiffFile, image: &RawImage, sample: Sample) -> Result<Compression> {
    let directory = image.directory();
    let number = file.one(directory, Tag::Compression)?.unwrap_or(1);
    let convert = "convert it without lossy compression from the camera's own file";
    match number {
        1 => Ok(Compression::None),
        7 if matches!(sample, Sample::Integer { .. }) => {
            Ok(Compression::LosslessJpeg { largest_has_bits: image.version < [1, 1, 0, 0] })
        }
        7 => Err(file.problem("it is damaged; floats are not compressed as lossless JPEG")),
        8 | 32946 => {
            let (predictor, step) = predictor(file, directory, sample)?;
            Ok(Compression::Deflate(predictor, step))
        }
        34892 => Err(file.problem(format!("its raw image is lossy JPEG, which is not supported; {convert}"))),
        50002 | 52546 => Err(file.problem(format!(
            "its raw image is JPEG XL, which is not supported; {convert}, for example by a converter to DNG 1.6"
        ))),
        _ => Err(file.problem(format!(
            "its raw image has compression {number}, which is not known; the file is damaged, or a converter to DNG rewrites it"
        ))),
    }
}

/// What was done before Deflate: differences, and how many samples before those stand from which they are \[DNG2023,
/// Predictor].
fn predictor(file: &mut TiffFile, directory: &Directory, sample: Sample) -> Result<(Predictor, usize)> {
    let number = file.one(directory, Tag::Predictor)?.unwrap_or(1);
    let is_float = matches!(sample, Sample::Float { .. });
    let is_packed = !sample.bits().is_multiple_of(8);
    match number {
        1 => Ok((Predictor::None, 1)),
        2 | 34892 | 34893 if !is_packed && sample != (Sample::Float { bits: 24 }) => {
            let step = if number == 2 { 1 } else { 2 << (number - 34892) };
            Ok((Predictor::Horizontal, step))
        }
        3 | 34894 | 34895 if is_float => {
            let step = if number == 3 { 1 } else { 2 << (number - 34894) };
            Ok((Predictor::FloatingPoint, step))
        }
        _ => Err(file.problem(format!(
            "its raw image has predictor {number}, which does not exist for {} of {} bits; it is damaged",
            if is_float { "floats" } else { "integers" },
            sample.bits()
        ))),
    }
}
