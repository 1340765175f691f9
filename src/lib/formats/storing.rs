//! How frames are stored: what options choose, and what goes together.

use super::dng;
use super::exr::{ExrCompression, ExrSamples, Layers};
use super::format::SampleType;
use super::places::{STDOUT_NAME, is_waited_on, named};
use super::png;
use super::tiff::{TiffCompression, TiffSamples};
use super::viewable;
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, Metadata};
use crate::names::Named;
use crate::units::QuantityKind;
use std::path::{Path, PathBuf};

/// A file format for frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR.
    Exr,
    /// TIFF.
    Tiff,
    /// DNG, of planes of codes.
    Dng,
    /// PNG, of codes and sRGB.
    Png,
}

impl Named for Format {
    const ALL: &'static [Self] = &[Self::Exr, Self::Tiff, Self::Dng, Self::Png];

    fn name(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Tiff => "tiff",
            Self::Dng => "dng",
            Self::Png => "png",
        }
    }
}

/// How blocks are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CompressionKind {
    /// Not at all.
    None,
    /// Run lengths (EXR).
    Rle,
    /// Deflate by row (EXR).
    Zips,
    /// Deflate by 16 rows (EXR).
    Zip,
    /// Wavelets (EXR).
    Piz,
    /// Lempel-Ziv-Welch (TIFF).
    Lzw,
    /// Deflate (TIFF, PNG, and DNG of floats).
    Deflate,
}

impl Named for CompressionKind {
    const ALL: &'static [Self] = &[Self::None, Self::Rle, Self::Zips, Self::Zip, Self::Piz, Self::Lzw, Self::Deflate];

    fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Rle => "rle",
            Self::Zips => "zips",
            Self::Zip => "zip",
            Self::Piz => "piz",
            Self::Lzw => "lzw",
            Self::Deflate => "deflate",
        }
    }
}

impl CompressionKind {
    fn refused(self, format: &str, choices: &str) -> Error {
        let what = if self == Self::None {
            "not left uncompressed".to_owned()
        } else {
            format!("not compressed by {}", self.name())
        };
        Error::Usage(format!("{format} is {what}; it is one of {choices}"))
    }
}

/// How samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleKind {
    /// 32-bit float.
    F32,
    /// 16-bit float (EXR).
    F16,
    /// 16-bit unsigned (TIFF, DNG, PNG).
    U16,
}

impl Named for SampleKind {
    const ALL: &'static [Self] = &[Self::F32, Self::F16, Self::U16];

    fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
            Self::U16 => "u16",
        }
    }
}

/// Where and how a frame is written.
#[derive(Debug, Clone, Default)]
pub struct OutputOptions {
    /// The file; none or `-` for the standard output.
    pub path: Option<PathBuf>,
    /// The format; by the file's extension where none is given, EXR without one.
    pub format: Option<Format>,
    /// Compression; none by default.
    pub compression: Option<CompressionKind>,
    /// Sample type; by quantity where none is given.
    pub samples: Option<SampleKind>,
    /// Whether samples are scaled so that viewers show them.
    pub is_viewable: bool,
    /// Whether layers go into a second part of an EXR file.
    pub separates_layers: bool,
    /// Frames that follow in the same stream, at least; a named file does not tell.
    pub frames_to_come: u64,
    /// Files of as much that are made besides in the same run and are not there yet, at least.
    pub files_to_come: u64,
}

/// How a frame is encoded, once all options are settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Exr(ExrSamples, ExrCompression),
    Tiff(TiffSamples, TiffCompression),
    Dng(TiffSamples, TiffCompression),
    /// 16-bit integers, deflated.
    Png,
}

impl Encoding {
    /// Bytes that the samples of a frame take at least; none where nobody knows before they are compressed.
    pub(super) fn bytes(self, geometry: &Geometry) -> Option<u64> {
        let of_sample = match self {
            Self::Exr(ExrSamples::F32, ExrCompression::None)
            | Self::Tiff(TiffSamples::F32, TiffCompression::None)
            | Self::Dng(TiffSamples::F32, TiffCompression::None) => 4,
            Self::Exr(ExrSamples::F16, ExrCompression::None)
            | Self::Tiff(TiffSamples::U16, TiffCompression::None)
            | Self::Dng(TiffSamples::U16, TiffCompression::None) => 2,
            Self::Exr(..) | Self::Tiff(..) | Self::Dng(..) | Self::Png => return None,
        };
        let sides = [geometry.width, geometry.height, geometry.channels.len()];
        Some(sides.into_iter().fold(of_sample, |bytes, side| bytes.saturating_mul(side as u64)))
    }
}

impl OutputOptions {
    /// How a frame is encoded.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where options do not go together, or the format cannot hold the frame, as [`dng::check_frame`] says of a DNG
    /// and [`png::check_frame`] of a PNG.
    pub(super) fn encoding(&self, header: &FrameHeader) -> Result<Encoding> {
        let format = self.format()?;
        let quantity = header.metadata.quantity;
        if format == Format::Tiff && header.geometry.channels.iter().any(|name| name.contains('.')) {
            return Err(Error::Usage("a TIFF has no names for the layers of standard deviations; write an EXR".into()));
        }
        if format == Format::Tiff && quantity == QuantityKind::ColorDifference {
            return Err(Error::Usage(
                "a TIFF has no names for the channels of a map of differences; write an EXR".into(),
            ));
        }
        if format != Format::Exr && self.separates_layers {
            return Err(Error::Usage("an EXR alone has layers; write one, or leave --separate-layers out".into()));
        }
        // An average of codes lies between them, as do codes that were made straight.
        let Metadata { demosaic, correction, average, adc, .. } = &header.metadata;
        let is_straight = adc.is_some_and(|adc| adc.is_linearized);
        let changed = demosaic.is_some() || correction.is_some() || average.is_some() || is_straight;
        let fits_u16 = quantity == QuantityKind::Adu && !changed || quantity == QuantityKind::Srgb;
        let compression = self.compression.unwrap_or(CompressionKind::None);
        match format {
            Format::Exr => {
                let samples = exr_samples(self.samples.unwrap_or(SampleKind::F32))?;
                Ok(Encoding::Exr(samples, exr_compression(compression)?))
            }
            Format::Tiff => {
                let default = if fits_u16 { SampleKind::U16 } else { SampleKind::F32 };
                let samples = tiff_samples("TIFF", self.samples.unwrap_or(default), fits_u16, quantity)?;
                Ok(Encoding::Tiff(samples, tiff_compression(compression)?))
            }
            Format::Dng => {
                let place = named(self.path.as_deref()).map(|path| path.display().to_string());
                dng::check_frame(header, &place.unwrap_or_else(|| STDOUT_NAME.into()))?;
                let default = if fits_u16 { SampleKind::U16 } else { SampleKind::F32 };
                let samples = tiff_samples("DNG", self.samples.unwrap_or(default), fits_u16, quantity)?;
                if self.is_viewable && samples == TiffSamples::F32 {
                    let problem = "a DNG of floats tells converters its white level, a whole number";
                    return Err(Error::Usage(problem.into()).leave_out(&["viewable"]));
                }
                Ok(Encoding::Dng(samples, dng_compression(compression, samples)?))
            }
            Format::Png => {
                check_png(self.samples, self.compression, fits_u16, quantity)?;
                png::check_frame(header)?;
                Ok(Encoding::Png)
            }
        }
    }

    /// The type in which samples of a frame are stored.
    ///
    /// # Errors
    ///
    /// Those of [`Self::encoding`].
    pub(super) fn sample_type(&self, header: &FrameHeader) -> Result<SampleType> {
        Ok(match self.encoding(header)? {
            Encoding::Exr(ExrSamples::F32, _)
            | Encoding::Tiff(TiffSamples::F32, _)
            | Encoding::Dng(TiffSamples::F32, _) => SampleType::F32,
            Encoding::Exr(ExrSamples::F16, _) => SampleType::F16,
            Encoding::Tiff(TiffSamples::U16, _) | Encoding::Dng(TiffSamples::U16, _) | Encoding::Png => SampleType::U16,
        })
    }

    /// What stored samples are multiplied with.
    ///
    /// # Errors
    ///
    /// Those of [`viewable::scale_of`].
    pub(super) fn scale(&self, header: &FrameHeader, encoding: Encoding) -> Result<f64> {
        let fills_u16 = matches!(
            encoding,
            Encoding::Tiff(TiffSamples::U16, _) | Encoding::Dng(TiffSamples::U16, _) | Encoding::Png
        );
        if self.is_viewable { viewable::scale_of(header, fills_u16) } else { Ok(1.0) }
    }

    /// Where the layers of an EXR stand: apart where that is asked for, and in files for viewers.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where they cannot stand apart: a pipe carries one part.
    pub(super) fn layers(&self) -> Result<Layers> {
        let file = named(self.path.as_deref());
        match (self.separates_layers, file) {
            (false, Some(file)) if self.is_viewable && !is_waited_on(file) => Ok(Layers::InAPartOfTheirOwn),
            (false, _) => Ok(Layers::BesideTheImage),
            (true, Some(_)) => Ok(Layers::InAPartOfTheirOwn),
            (true, None) => Err(Error::Usage(
                "layers stand in a part of their own in files alone; name the output, or leave --separate-layers out"
                    .into(),
            )),
        }
    }

    /// Whether the file has names for layers beside the samples.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where nothing says which format it is.
    pub fn holds_layers(&self) -> Result<bool> {
        Ok(self.format()? == Format::Exr)
    }

    /// The format, by the file's extension where none is given.
    fn format(&self) -> Result<Format> {
        let path = named(self.path.as_deref());
        let extension = path.and_then(Path::extension).map(|end| end.to_string_lossy().to_ascii_lowercase());
        match (self.format, extension.as_deref()) {
            (Some(format), _) => Ok(format),
            (None, Some("exr") | None) => Ok(Format::Exr),
            (None, Some("tif" | "tiff")) => Ok(Format::Tiff),
            (None, Some("dng")) => Ok(Format::Dng),
            (None, Some("png")) => Ok(Format::Png),
            (None, Some(end)) => Err(Error::Usage(format!(
                "{}: `.{end}` names no format that is written here; end the name in .exr, .tiff, .dng or .png (for a stack of frames in .zarr, by `stack-frames`), or give --format",
                path.unwrap_or(Path::new("-")).display()
            ))),
        }
    }
}

fn exr_samples(samples: SampleKind) -> Result<ExrSamples> {
    match samples {
        SampleKind::F32 => Ok(ExrSamples::F32),
        SampleKind::F16 => Ok(ExrSamples::F16),
        SampleKind::U16 => Err(Error::Usage("EXR stores f32 or f16; for u16 write a TIFF".into())),
    }
}

fn exr_compression(compression: CompressionKind) -> Result<ExrCompression> {
    match compression {
        CompressionKind::None => Ok(ExrCompression::None),
        CompressionKind::Rle => Ok(ExrCompression::Rle),
        CompressionKind::Zips => Ok(ExrCompression::Zips),
        CompressionKind::Zip => Ok(ExrCompression::Zip),
        CompressionKind::Piz => Ok(ExrCompression::Piz),
        CompressionKind::Lzw | CompressionKind::Deflate => {
            Err(compression.refused("EXR", "none, rle, zips, zip or piz"))
        }
    }
}

fn tiff_samples(format: &str, samples: SampleKind, fits_u16: bool, quantity: QuantityKind) -> Result<TiffSamples> {
    match samples {
        SampleKind::F32 => Ok(TiffSamples::F32),
        SampleKind::U16 if fits_u16 => Ok(TiffSamples::U16),
        SampleKind::U16 => Err(Error::Usage(format!("u16 would round or clip {quantity}; write f32"))),
        SampleKind::F16 => Err(Error::Usage(format!("{format} stores u16 or f32 here; for f16 write an EXR"))),
    }
}

fn tiff_compression(compression: CompressionKind) -> Result<TiffCompression> {
    match compression {
        CompressionKind::None => Ok(TiffCompression::None),
        CompressionKind::Lzw => Ok(TiffCompression::Lzw),
        CompressionKind::Deflate => Ok(TiffCompression::Deflate),
        _ => Err(compression.refused("TIFF", "none, lzw or deflate")),
    }
}

/// Codes have no compression that all readers of raw files know; floats have Deflate.
fn dng_compression(compression: CompressionKind, samples: TiffSamples) -> Result<TiffCompression> {
    match (compression, samples) {
        (CompressionKind::None, _) => Ok(TiffCompression::None),
        (CompressionKind::Deflate, TiffSamples::F32) => Ok(TiffCompression::Deflate),
        (_, TiffSamples::F32) => Err(compression.refused("DNG of floats", "none or deflate")),
        (_, TiffSamples::U16) => Err(Error::Usage(format!(
            "DNG of 16-bit codes is not compressed by {}; leave it uncompressed, or write 32-bit floats (f32) and deflate",
            compression.name()
        ))),
    }
}

/// Refuses what a PNG does not store.
fn check_png(
    samples: Option<SampleKind>,
    compression: Option<CompressionKind>,
    fits_u16: bool,
    quantity: QuantityKind,
) -> Result<()> {
    if !fits_u16 {
        return Err(Error::Usage(format!(
            "the 16-bit integers of a PNG would round or clip {quantity}; write a TIFF or an EXR, or make a picture with `to-xyz \
             --space srgb` or `preview`"
        )));
    }
    if samples.is_some_and(|samples| samples != SampleKind::U16) {
        return Err(Error::Usage("PNG stores u16; for floats write a TIFF or an EXR".into()));
    }
    match compression {
        None | Some(CompressionKind::Deflate) => Ok(()),
        Some(other) => Err(other.refused("PNG", "deflate")),
    }
}
