//! What the tags of an image say about its samples, or why it cannot be read.

use super::TiffTags;
use super::chunk::{Compression, Predictor};
use super::directory::{Directory, Source};
use crate::error::Result;
use crate::frame::Geometry;
use tiff::tags::{CompressionMethod, PhotometricInterpretation, Tag};

/// XPosition and YPosition, in units of the resolution: where the image lies on its page.
const POSITION: [Tag; 2] = [Tag::Unknown(286), Tag::Unknown(287)];
/// Photometric interpretation of a plane behind a color filter array (TIFF/EP, DNG).
const PHOTOMETRIC_CFA: u64 = 32803;
/// Photometric interpretation of the planes of a demosaicked raw (DNG).
const PHOTOMETRIC_LINEAR_RAW: u64 = 34892;
/// Chunks that decode together may have this many bytes; they are held in memory.
const MOST_DECODED_BYTES: u128 = 1 << 30;

/// How a sample is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stored {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F16,
    F32,
    F64,
}

impl Stored {
    /// Its short name.
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::F16 => "f16",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// Its bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// Where the samples of an image lie, and how they are stored. Strips are tiles as wide as the image.
#[derive(Debug)]
pub(super) struct Layout {
    pub geometry: Geometry,
    pub tags: TiffTags,
    pub stored: Stored,
    /// 8-bit MinIsWhite: the value meant is 255 − the value stored. Wider samples are taken as stored; OpenImageIO
    /// does the same.
    pub inverted: bool,
    pub compression: Compression,
    pub predictor: Predictor,
    /// Each chunk holds one channel only.
    pub planar: bool,
    pub tiled: bool,
    pub chunk_width: usize,
    pub chunk_rows: usize,
    /// Chunks beside each other.
    pub across: usize,
    /// Chunks below each other.
    pub down: usize,
    /// Offset and bytes of each chunk in the file: `[plane][down][across]`.
    pub chunks: Vec<(u64, u64)>,
}

impl Layout {
    /// Samples of one pixel in a chunk.
    pub fn chunk_channels(&self) -> usize {
        if self.planar { 1 } else { self.geometry.channels.len() }
    }

    /// Decoded bytes of a chunk's row.
    pub fn chunk_row_bytes(&self) -> usize {
        self.chunk_width * self.chunk_channels() * self.stored.bytes()
    }

    /// Number of planes.
    pub fn planes(&self) -> usize {
        if self.planar { self.geometry.channels.len() } else { 1 }
    }

    /// Reads the tags of an image and checks them against each other and against the file's length.
    ///
    /// # Errors
    ///
    /// When tags are missing or contradict each other, when the file is too short for what they promise, or when the
    /// image is of a kind that is not supported.
    pub fn read(source: &mut Source, directory: &Directory) -> Result<Self> {
        let [width, height] = [Tag::ImageWidth, Tag::ImageLength]
            .map(|tag| source.one(directory, tag))
            .map(|size| size.map(|size| size.filter(|&size| (1..1 << 32).contains(&size))));
        let (Some(width), Some(height)) = (width?, height?) else {
            return Err(source.problem("the file is damaged; it gives the image no valid size"));
        };
        let channels = source.one(directory, Tag::SamplesPerPixel)?.unwrap_or(1);
        if channels == 0 || channels > u64::from(u16::MAX) {
            return Err(source.problem("the file is damaged; a pixel has no valid sample count"));
        }
        let compression = compression(source, directory)?;
        let stored = stored(source, directory, channels)?;
        let photometric = photometric(source, directory, channels)?;
        let predictor = predictor(source, directory, compression, stored)?;
        if source.one(directory, Tag::FillOrder)?.unwrap_or(1) != 1 {
            return Err(source.problem(
                "bits in reversed order (FillOrder 2) are not supported; rewrite it, for example with `tiffcp -f msb2lsb`",
            ));
        }
        let planar = match source.one(directory, Tag::PlanarConfiguration)?.unwrap_or(1) {
            1 => false,
            2 => channels > 1,
            other => {
                return Err(source.problem(format!("the file is damaged; its planar configuration is {other}")));
            }
        };

        // The chunks: how many there must be, and where.
        let tiled = directory.has(Tag::TileWidth) || directory.has(Tag::TileLength);
        let (chunk_width, chunk_rows) = if tiled {
            let [width, rows] = [Tag::TileWidth, Tag::TileLength]
                .map(|tag| source.one(directory, tag))
                .map(|size| size.map(Option::unwrap_or_default));
            (width?, rows?)
        } else {
            (width, source.one(directory, Tag::RowsPerStrip)?.unwrap_or(height).min(height))
        };
        if ![chunk_width, chunk_rows].iter().all(|size| (1..1 << 32).contains(size)) {
            let what = if tiled { "tiles" } else { "strips" };
            return Err(source.problem(format!("the file is damaged; its {what} have no size")));
        }
        let (across, down) = (width.div_ceil(chunk_width), height.div_ceil(chunk_rows));
        let planes = if planar { channels } else { 1 };
        let needed = u128::from(across) * u128::from(down) * u128::from(planes);
        // Each chunk has an offset of at least two bytes, so a larger number cannot be true.
        let Some(needed) = u64::try_from(needed).ok().filter(|&n| n <= source.length) else {
            return Err(source.cut_short("the list of strips or tiles"));
        };
        let strip_tags = (Tag::StripOffsets, Tag::StripByteCounts);
        let tile_tags = (Tag::TileOffsets, Tag::TileByteCounts);
        let (offset_tag, count_tag) = if tiled && directory.has(Tag::TileOffsets) { tile_tags } else { strip_tags };
        let offsets = source.unsigned(directory, offset_tag, needed)?.unwrap_or_default();
        if (offsets.len() as u64) < needed {
            let found = offsets.len();
            return Err(source.problem(format!(
                "the file is damaged; it lists {found} of the {needed} strips or tiles that its size needs"
            )));
        }
        let counts = source.unsigned(directory, count_tag, needed)?;

        let sizes = Sizes {
            height,
            chunk_rows,
            down,
            chunk_row_bytes: u128::from(chunk_width) * u128::from(channels / planes) * stored.bytes() as u128,
            tiled,
            compression,
        };
        if compression != Compression::None {
            let together = sizes.chunk_row_bytes * u128::from(chunk_rows) * u128::from(across) * u128::from(planes);
            if together > MOST_DECODED_BYTES {
                return Err(source.problem(format!(
                    "{chunk_rows} rows are compressed as one piece of {} MiB, more than fits into memory; rewrite it with smaller strips, for example with `tiffcp -r 64`",
                    together >> 20
                )));
            }
        }
        let chunks = sizes.check(source, &offsets, counts.as_deref())?;

        let size = |size: u64| usize::try_from(size).map_err(|_| source.cut_short("the image"));
        let (width, height, channels) = (size(width)?, size(height)?, size(channels)?);
        let (chunk_width, chunk_rows) = (size(chunk_width)?, size(chunk_rows)?);
        let (across, down) = (size(across)?, size(down)?);
        let geometry = Geometry {
            width,
            height,
            origin: origin(source, directory),
            channels: channel_names(channels, photometric),
        };
        let tags = TiffTags {
            description: source.text(directory, Tag::ImageDescription)?,
            // Nothing depends on it, so a damaged one is not worth refusing the image.
            software: source.text(directory, Tag::Software).unwrap_or_default(),
        };
        let inverted =
            stored == Stored::U8 && photometric == u64::from(PhotometricInterpretation::WhiteIsZero.to_u16());
        Ok(Self {
            geometry,
            tags,
            stored,
            inverted,
            compression,
            predictor,
            planar,
            tiled,
            chunk_width,
            chunk_rows,
            across,
            down,
            chunks,
        })
    }
}

/// What the check of all chunks against the file's length needs.
struct Sizes {
    height: u64,
    chunk_rows: u64,
    down: u64,
    chunk_row_bytes: u128,
    tiled: bool,
    compression: Compression,
}

impl Sizes {
    /// Pairs offsets with byte counts, and refuses a file that cannot hold what they promise.
    fn check(&self, source: &Source, offsets: &[u64], counts: Option<&[u64]>) -> Result<Vec<(u64, u64)>> {
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
                None => return Err(source.problem("the file is damaged; it lacks StripByteCounts")),
            };
            let what = if self.tiled { "tile" } else { "strip" };
            if !source.holds(offset, stored) {
                return Err(source.cut_short(&format!("{what} {index}")));
            }
            if decoded > u128::from(stored) * self.compression.most_expansion() {
                return Err(source.problem(format!(
                    "{what} {index} holds fewer bytes than its size needs; it was cut short or damaged"
                )));
            }
            total_stored += u128::from(stored);
            chunks.push((offset, stored));
        }
        if total_stored > u128::from(source.length) {
            return Err(source.problem("the file is damaged; its strips or tiles overlap"));
        }
        Ok(chunks)
    }
}

/// How the image is compressed, if we can undo it.
fn compression(source: &mut Source, directory: &Directory) -> Result<Compression> {
    let number = source.one(directory, Tag::Compression)?.unwrap_or(1);
    let method = u16::try_from(number).map(CompressionMethod::from_u16_exhaustive);
    let name = match method {
        Ok(CompressionMethod::None) => return Ok(Compression::None),
        Ok(CompressionMethod::LZW) => return Ok(Compression::Lzw),
        Ok(CompressionMethod::Deflate | CompressionMethod::OldDeflate) => {
            return Ok(Compression::Deflate);
        }
        Ok(CompressionMethod::PackBits) => return Ok(Compression::PackBits),
        Ok(CompressionMethod::Huffman | CompressionMethod::Fax3 | CompressionMethod::Fax4) => {
            return Err(source.problem(
                "fax compression is for black and white pages, which are not supported; give an image with 8 bits or more per sample",
            ));
        }
        Ok(CompressionMethod::JPEG | CompressionMethod::ModernJPEG) => "JPEG",
        Ok(CompressionMethod::ZSTD) => "ZSTD",
        Ok(CompressionMethod::WebP) => "WebP",
        Ok(CompressionMethod::Unknown(34887)) => "LERC",
        Ok(CompressionMethod::Unknown(34925)) => "LZMA",
        Ok(CompressionMethod::Unknown(33003..=33005 | 34712)) => "JPEG 2000",
        Ok(CompressionMethod::Unknown(50002 | 52546)) => "JPEG XL",
        _ => {
            return Err(source.problem(format!("compression {number} is not known; the file is damaged or needs to be rewritten by the program that made it")));
        }
    };
    Err(source.problem(format!(
        "{name} compression is not supported; rewrite it, for example with `tiffcp -c zip in.tif out.tif`"
    )))
}

/// How samples are stored, if they are of a kind that we read.
fn stored(source: &mut Source, directory: &Directory, channels: u64) -> Result<Stored> {
    let mut same = |tag: Tag, missing: u64| -> Result<u64> {
        let values = source.unsigned(directory, tag, channels)?.unwrap_or_default();
        // One value stands for all channels, though the specification asks for one each.
        if values.len() > 1 && (values.len() as u64) < channels {
            return Err(source.problem(format!("the file is damaged; tag {tag:?} has too few values for its channels")));
        }
        let first = values.first().copied().unwrap_or(missing);
        if values.iter().any(|&value| value != first) {
            return Err(source.problem(
                "channels that are stored in different ways are not supported; convert all of them to 16 bit or to float",
            ));
        }
        Ok(first)
    };
    let bits = same(Tag::BitsPerSample, 1)?;
    let format = same(Tag::SampleFormat, 1)?;
    Ok(match (format, bits) {
        // 4 is "undefined", which everyone takes for unsigned.
        (1 | 4, 8) => Stored::U8,
        (1 | 4, 16) => Stored::U16,
        (1 | 4, 32) => Stored::U32,
        (2, 8) => Stored::I8,
        (2, 16) => Stored::I16,
        (2, 32) => Stored::I32,
        (3, 16) => Stored::F16,
        (3, 32) => Stored::F32,
        (3, 64) => Stored::F64,
        (1 | 2 | 4, 1) => {
            return Err(source.problem(
                "black and white images of 1 bit are not supported; give an image with 8 bits or more per sample",
            ));
        }
        (1 | 2 | 4, 2..=31) => {
            return Err(source.problem(format!(
                "{bits}-bit packed samples are not supported; unpack them to 16 bit or float (`oiiotool in.tif -d uint16 -o out.tif` does, but scales {} to 65535)",
                (1u64 << bits) - 1
            )));
        }
        (1 | 2 | 4, 33..=64) => {
            return Err(source.problem(format!(
                "{bits}-bit integers are not supported; convert it to float, for example with `oiiotool in.tif -d float -o out.tif`"
            )));
        }
        (3, 24) => {
            return Err(source.problem(
                "24-bit floats are not supported; convert it, for example with `oiiotool in.tif -d float -o out.tif`",
            ));
        }
        (5 | 6, _) => {
            return Err(
                source.problem("complex samples are not supported; write real and imaginary part as two channels")
            );
        }
        _ => {
            return Err(
                source.problem(format!("the file is damaged; sample format {format} with {bits} bits does not exist"))
            );
        }
    })
}

/// The number of the photometric interpretation, if it is one whose samples mean themselves.
fn photometric(source: &mut Source, directory: &Directory, channels: u64) -> Result<u64> {
    use PhotometricInterpretation as P;
    let usual = if channels < 3 { P::BlackIsZero } else { P::RGB };
    let number = source.one(directory, Tag::PhotometricInterpretation)?.unwrap_or_else(|| usual.to_u16().into());
    let needed = match u16::try_from(number).ok().and_then(P::from_u16) {
        Some(P::WhiteIsZero | P::BlackIsZero) => 1,
        Some(P::RGB) => 3,
        Some(P::CMYK) => 4,
        Some(P::RGBPalette) => {
            return Err(source.problem(
                "palette images are not supported; convert it to RGB, for example with `oiiotool in.tif -o out.tif`",
            ));
        }
        Some(P::TransparencyMask) => {
            return Err(source.problem("this image is a transparency mask for another; pick another image"));
        }
        Some(P::YCbCr) => {
            return Err(source.problem(
                "YCbCr images are not supported; convert it to RGB, for example with `tiff2rgba in.tif out.tif`",
            ));
        }
        Some(P::CIELab | P::IccLab | P::ItuLab) => {
            return Err(source.problem("L*a*b* images in integers are not supported; convert it to RGB or XYZ first"));
        }
        _ if number == PHOTOMETRIC_CFA || number == PHOTOMETRIC_LINEAR_RAW => 1,
        _ => {
            return Err(source
                .problem(format!("photometric interpretation {number} is not supported; convert it to gray or RGB")));
        }
    };
    if channels < needed {
        return Err(
            source.problem(format!("the file is damaged; its color needs {needed} channels and it has {channels}"))
        );
    }
    Ok(number)
}

/// The predictor, if it fits the samples. Only LZW and Deflate have one; with others the tag means nothing.
fn predictor(
    source: &mut Source,
    directory: &Directory,
    compression: Compression,
    stored: Stored,
) -> Result<Predictor> {
    let number = source.one(directory, Tag::Predictor)?.unwrap_or(1);
    let float = matches!(stored, Stored::F16 | Stored::F32 | Stored::F64);
    match number {
        _ if !matches!(compression, Compression::Lzw | Compression::Deflate) => Ok(Predictor::None),
        1 => Ok(Predictor::None),
        2 => Ok(Predictor::Horizontal),
        3 if float => Ok(Predictor::FloatingPoint),
        _ => Err(source
            .problem(format!("the file is damaged; predictor {number} does not exist for {} samples", stored.name()))),
    }
}

/// The frame's place on the sensor, as OpenImageIO stores it: the position times the resolution. [0, 0] where that is
/// not a whole number.
fn origin(source: &mut Source, directory: &Directory) -> [i32; 2] {
    let mut pixels = |position: Tag, resolution: Tag| {
        let resolution = source.ratio(directory, resolution).filter(|&r| r > 0.0).unwrap_or(1.0);
        let pixels = source.ratio(directory, position)? * resolution;
        let whole = pixels.round();
        // Ratios of 32-bit numbers, so a whole number can come out beside itself by rounding only.
        let is_whole = (pixels - whole).abs() < 1e-6 && (0.0..2e9).contains(&whole);
        #[expect(clippy::cast_possible_truncation, reason = "whole and below 2e9")]
        is_whole.then_some(whole as i32)
    };
    let (x, y) = (pixels(POSITION[0], Tag::XResolution), pixels(POSITION[1], Tag::YResolution));
    match (x, y) {
        (Some(x), Some(y)) => [x, y],
        _ => [0, 0],
    }
}

/// What the channels are called.
fn channel_names(channels: usize, photometric: u64) -> Vec<String> {
    let cmyk = photometric == u64::from(PhotometricInterpretation::CMYK.to_u16());
    let known: &[&str] = match channels {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        4 if cmyk => &["C", "M", "Y", "K"],
        4 => &["R", "G", "B", "A"],
        _ => return (0..channels).map(|channel| format!("C{channel}")).collect(),
    };
    known.iter().map(|&name| name.to_owned()).collect()
}
