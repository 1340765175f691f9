//! What the tags of an image say about its samples, or why it cannot be read.

use super::TiffTags;
use super::chunk::{Compression, Predictor};
use super::directory::{Directory, TiffFile};
use super::grid::{Grid, Pixels};
use crate::error::{Error, Result};
use crate::formats::format::SampleType;
use crate::frame::Geometry;
use tiff::tags::{CompressionMethod, PhotometricInterpretation, Tag};

/// XPosition and YPosition, in units of the resolution: where the image lies on its page.
const POSITION: [Tag; 2] = [Tag::Unknown(286), Tag::Unknown(287)];
/// Photometric interpretation of a plane behind a color filter array (TIFF/EP, DNG).
pub(super) const PHOTOMETRIC_CFA: u64 = 32803;
/// Photometric interpretation of the planes of a demosaicked raw (DNG).
const PHOTOMETRIC_LINEAR_RAW: u64 = 34892;

/// Where the samples of an image lie, and how they are stored. Strips are tiles as wide as the image.
#[derive(Debug)]
pub(super) struct Layout {
    pub geometry: Geometry,
    /// Whether the file has its place, which may be the corner.
    pub tells_place: bool,
    pub tags: TiffTags,
    pub stored: SampleType,
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
    /// Tags that were passed over, and why.
    pub notes: Vec<String>,
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
    pub fn read(file: &mut TiffFile, directory: &Directory) -> Result<Self> {
        let [width, height, channels] = size(file, directory)?;
        let compression = compression(file, directory)?;
        let stored = stored(file, directory, channels)?;
        let photometric = photometric(file, directory, channels)?;
        let predictor = predictor(file, directory, compression, stored)?;
        let planar = is_planar(file, directory, channels)?;
        let pixels = Pixels { width, height, channels, planar, sample_bytes: stored.bytes(), compression };
        let grid = Grid::read(file, directory, &pixels)?;
        let chunks = grid.chunks(file, directory)?;

        let size = |size: u64| usize::try_from(size).map_err(|_| file.cut_short("the image"));
        let (width, height, channels) = (size(width)?, size(height)?, size(channels)?);
        let (chunk_width, chunk_rows) = (size(grid.chunk_width)?, size(grid.chunk_rows)?);
        let (across, down) = (size(grid.across)?, size(grid.down)?);
        let mut notes = Vec::new();
        if stored.bytes() == 8 {
            notes.push("its samples of 64 bits are rounded to 32".into());
        }
        // No sample depends on these, so damaged ones are not worth refusing the image.
        let place = passed_over(place(file, directory), "its place on the sensor", &mut notes)?;
        let software = passed_over(file.text(directory, Tag::Software), "its tag Software", &mut notes)?;
        let tags = TiffTags { description: file.text(directory, Tag::ImageDescription)?, software };
        let origin = place.unwrap_or_default();
        let geometry = Geometry { width, height, origin, channels: channel_names(channels, photometric) };
        let inverted =
            stored == SampleType::U8 && photometric == u64::from(PhotometricInterpretation::WhiteIsZero.to_u16());
        Ok(Self {
            geometry,
            tells_place: place.is_some(),
            tags,
            stored,
            inverted,
            compression,
            predictor,
            planar,
            tiled: grid.tiled,
            chunk_width,
            chunk_rows,
            across,
            down,
            chunks,
            notes,
        })
    }
}

/// What was found, or, where the file is damaged there, nothing but a note.
pub(in crate::formats) fn passed_over<T: Default>(found: Result<T>, what: &str, notes: &mut Vec<String>) -> Result<T> {
    match found {
        Err(Error::Format { problem, .. }) => {
            notes.push(format!("{what} is passed over: {problem}"));
            Ok(T::default())
        }
        other => other,
    }
}

/// Width, height, and samples of a pixel.
fn size(file: &mut TiffFile, directory: &Directory) -> Result<[u64; 3]> {
    let [width, height] = [Tag::ImageWidth, Tag::ImageLength]
        .map(|tag| file.one(directory, tag))
        .map(|size| size.map(|size| size.filter(|&size| (1..1 << 32).contains(&size))));
    let (Some(width), Some(height)) = (width?, height?) else {
        return Err(file.problem("the file is damaged; it gives the image no valid size"));
    };
    let channels = file.one(directory, Tag::SamplesPerPixel)?.unwrap_or(1);
    if channels == 0 || channels > u64::from(u16::MAX) {
        return Err(file.problem("the file is damaged; a pixel has no valid sample count"));
    }
    Ok([width, height, channels])
}

/// Whether each chunk holds one channel only.
fn is_planar(file: &mut TiffFile, directory: &Directory, channels: u64) -> Result<bool> {
    if file.one(directory, Tag::FillOrder)?.unwrap_or(1) != 1 {
        return Err(file.problem(
            "bits in reversed order (FillOrder 2) are not supported; rewrite it, for example with `tiffcp -f msb2lsb in.tif out.tif`",
        ));
    }
    match file.one(directory, Tag::PlanarConfiguration)?.unwrap_or(1) {
        1 => Ok(false),
        2 => Ok(channels > 1),
        other => Err(file.problem(format!("the file is damaged; its planar configuration is {other}"))),
    }
}

/// How the image is compressed, if we can undo it.
fn compression(file: &mut TiffFile, directory: &Directory) -> Result<Compression> {
    let number = file.one(directory, Tag::Compression)?.unwrap_or(1);
    let method = u16::try_from(number).map(CompressionMethod::from_u16_exhaustive);
    let name = match method {
        Ok(CompressionMethod::None) => return Ok(Compression::None),
        Ok(CompressionMethod::LZW) => return Ok(Compression::Lzw),
        Ok(CompressionMethod::Deflate | CompressionMethod::OldDeflate) => {
            return Ok(Compression::Deflate);
        }
        Ok(CompressionMethod::PackBits) => return Ok(Compression::PackBits),
        Ok(CompressionMethod::Huffman | CompressionMethod::Fax3 | CompressionMethod::Fax4) => {
            return Err(file.problem(
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
            return Err(file.problem(format!("compression {number} is not known; the file is damaged or needs to be rewritten by the program that made it")));
        }
    };
    Err(file.problem(format!(
        "{name} compression is not supported; rewrite it, for example with `tiffcp -c zip in.tif out.tif`"
    )))
}

/// How samples are stored, if they are of a kind that we read.
fn stored(file: &mut TiffFile, directory: &Directory, channels: u64) -> Result<SampleType> {
    let mut same = |tag: Tag, missing: u64| -> Result<u64> {
        let values = file.unsigned(directory, tag, channels)?.unwrap_or_default();
        // One value stands for all channels, though the specification asks for one each.
        if values.len() > 1 && (values.len() as u64) < channels {
            return Err(file.problem(format!("the file is damaged; tag {tag:?} has too few values for its channels")));
        }
        let first = values.first().copied().unwrap_or(missing);
        if values.iter().any(|&value| value != first) {
            return Err(file.problem(
                "channels that are stored in different ways are not supported; convert all of them to 16 bit or to float",
            ));
        }
        Ok(first)
    };
    let bits = same(Tag::BitsPerSample, 1)?;
    let format = same(Tag::SampleFormat, 1)?;
    Ok(match (format, bits) {
        // 4 is "undefined", which everyone takes for unsigned.
        (1 | 4, 8) => SampleType::U8,
        (1 | 4, 16) => SampleType::U16,
        (1 | 4, 32) => SampleType::U32,
        (1 | 4, 64) => SampleType::U64,
        (2, 8) => SampleType::I8,
        (2, 16) => SampleType::I16,
        (2, 32) => SampleType::I32,
        (2, 64) => SampleType::I64,
        (3, 16) => SampleType::F16,
        (3, 32) => SampleType::F32,
        (3, 64) => SampleType::F64,
        _ => return Err(file.problem(no_sample_type(format, bits))),
    })
}

/// Why samples of this format and so many bits are not read.
fn no_sample_type(format: u64, bits: u64) -> String {
    match (format, bits) {
        (1 | 2 | 4, 1) => {
            "black and white images of 1 bit are not supported; give an image with 8 bits or more per sample".into()
        }
        (1 | 2 | 4, 2..=31) => format!(
            "{bits}-bit packed samples are not supported; unpack them to 16 bit or float (`oiiotool in.tif -d uint16 -o out.tif` does, but scales {} to 65535)",
            (1u64 << bits) - 1
        ),
        (1 | 2 | 4, 33..=63) => format!(
            "{bits}-bit integers are not supported; convert it to float, for example with `oiiotool in.tif -d float -o out.tif`"
        ),
        (3, 24) => {
            "24-bit floats are not supported; convert it, for example with `oiiotool in.tif -d float -o out.tif`".into()
        }
        (5 | 6, _) => "complex samples are not supported; write real and imaginary part as two channels".into(),
        _ => format!("the file is damaged; sample format {format} with {bits} bits does not exist"),
    }
}

/// The number of the photometric interpretation, if it is one whose samples mean themselves.
fn photometric(file: &mut TiffFile, directory: &Directory, channels: u64) -> Result<u64> {
    use PhotometricInterpretation as P;
    let usual = if channels < 3 { P::BlackIsZero } else { P::RGB };
    let number = file.one(directory, Tag::PhotometricInterpretation)?.unwrap_or_else(|| usual.to_u16().into());
    let needed = match u16::try_from(number).ok().and_then(P::from_u16) {
        Some(P::WhiteIsZero | P::BlackIsZero) => 1,
        Some(P::RGB) => 3,
        Some(P::CMYK) => 4,
        Some(P::RGBPalette) => {
            return Err(file.problem(
                "palette images are not supported; convert it to RGB, for example with `oiiotool in.tif -o out.tif`",
            ));
        }
        Some(P::TransparencyMask) => {
            return Err(file.problem("this image is a transparency mask for another; pick another image"));
        }
        Some(P::YCbCr) => {
            return Err(file.problem(
                "YCbCr images are not supported; convert it to RGB, for example with `tiff2rgba in.tif out.tif`",
            ));
        }
        Some(P::CIELab | P::IccLab | P::ItuLab) => {
            return Err(file.problem("L*a*b* images in integers are not supported; convert it to RGB or XYZ first"));
        }
        _ if number == PHOTOMETRIC_CFA || number == PHOTOMETRIC_LINEAR_RAW => 1,
        _ => {
            return Err(file
                .problem(format!("photometric interpretation {number} is not supported; convert it to gray or RGB")));
        }
    };
    if channels < needed {
        return Err(
            file.problem(format!("the file is damaged; its color needs {needed} channels and it has {channels}"))
        );
    }
    Ok(number)
}

/// The predictor, if it fits the samples. Only LZW and Deflate have one; with others the tag means nothing.
fn predictor(
    file: &mut TiffFile,
    directory: &Directory,
    compression: Compression,
    stored: SampleType,
) -> Result<Predictor> {
    let number = file.one(directory, Tag::Predictor)?.unwrap_or(1);
    let float = matches!(stored, SampleType::F16 | SampleType::F32 | SampleType::F64);
    match number {
        _ if !matches!(compression, Compression::Lzw | Compression::Deflate) => Ok(Predictor::None),
        1 => Ok(Predictor::None),
        2 => Ok(Predictor::Horizontal),
        3 if float => Ok(Predictor::FloatingPoint),
        _ => Err(file
            .problem(format!("the file is damaged; predictor {number} does not exist for {} samples", stored.name()))),
    }
}

/// The frame's place on the sensor, as OpenImageIO stores it: the position times the resolution.
///
/// # Errors
///
/// When a tag of it is damaged, or the place is not a whole number.
fn place(file: &mut TiffFile, directory: &Directory) -> Result<Option<[i32; 2]>> {
    let mut pixels = |position: Tag, resolution: Tag| {
        let Some(position) = file.ratio(directory, position)? else { return Ok(None) };
        let resolution = file.ratio(directory, resolution)?.filter(|&r| r > 0.0).unwrap_or(1.0);
        let pixels = position * resolution;
        let whole = pixels.round();
        // Ratios of 32-bit numbers, so a whole number can come out beside itself by rounding only.
        if (pixels - whole).abs() >= 1e-6 || !(0.0..2e9).contains(&whole) {
            return Err(file.problem(format!("it is {pixels}, no whole number of pixels")));
        }
        #[expect(clippy::cast_possible_truncation, reason = "whole and below 2e9")]
        Ok(Some(whole as i32))
    };
    let (x, y) = (pixels(POSITION[0], Tag::XResolution)?, pixels(POSITION[1], Tag::YResolution)?);
    Ok(x.zip(y).map(|(x, y)| [x, y]))
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
