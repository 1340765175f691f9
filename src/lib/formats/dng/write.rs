//! Writing rows.

use super::digest::RawDigest;
use super::preview::Preview;
use super::tags;
use super::tell::Told;
use crate::error::{Error, Result};
use crate::formats::register;
use crate::formats::tiff::{
    ExtraTag, FirstImage, TagValue, TiffCompression, TiffSamples, TiffSettings, TiffTags, TiffWriter,
};
use crate::metadata::FrameHeader;
use crate::units::QuantityKind;
use std::io::{Seek, Write};

/// Makes sure that a frame is one that a DNG holds: a plane of ADU behind a filter array, or of a monochrome sensor. The file
/// is to be called `name`.
///
/// # Errors
///
/// [`Error::Order`] naming the program that should come first; [`Error::Usage`] where there is none; [`Error::MissingKey`]
/// for a plane whose filter array or black level is unknown.
pub fn check_frame(header: &FrameHeader, name: &str) -> Result<()> {
    let FrameHeader { geometry, metadata, .. } = header;
    let problem =
        format!("a DNG holds codes behind a filter array, one plane of ADU, and this frame is {}", header.holds());
    let order = |first| Err(Error::Order { file: name.into(), problem: problem.clone(), first });
    let planes = geometry.channels.len();
    let is_raw = metadata.demosaic.is_none();
    match metadata.quantity {
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons if is_raw && header.has_three_planes() => {
            order("mosaic` and `digitize")
        }
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons if is_raw && planes == 1 => order("digitize"),
        QuantityKind::Adu if is_raw && header.has_three_planes() => order("mosaic"),
        QuantityKind::Adu if is_raw && planes == 1 && metadata.cfa.is_none() => Err(header.missing("cfa")),
        // A DNG that does not tell its black level says that it is 0.
        QuantityKind::Adu if is_raw && planes == 1 && metadata.black_level_adu.is_none() => {
            Err(header.missing("black_level_adu"))
        }
        QuantityKind::Adu if is_raw && planes == 1 => match geometry.origin {
            [left, top] if left >= 0 && top >= 0 => Ok(()),
            [left, top] => Err(Error::Usage(format!(
                "{name}: a DNG cannot say that a frame begins at column {left}, row {top} of the sensor; write an EXR"
            ))),
        },
        _ => Err(Error::Usage(format!("{name}: {problem}; write an EXR or a TIFF"))),
    }
}

/// Writes rows of a plane as a DNG \[DNG2023]: the raw image in strips, as 16-bit integers or 32-bit floats, and a picture of
/// up to 256×256 pixels in the first directory, above it.
///
/// The bytes depend on what is written only. Memory is that of [`TiffWriter`], and the picture.
#[derive(Debug)]
pub struct DngWriter<W: Write + Seek> {
    tiff: TiffWriter<W>,
    name: String,
    samples: TiffSamples,
    preview: Preview,
    digest: RawDigest,
    first: Vec<ExtraTag>,
    exif: Vec<ExtraTag>,
    texts: [String; 2],
}

impl<W: Write + Seek> DngWriter<W> {
    /// Starts a file that the user calls `name`, of a frame that [`check_frame`] takes; `description` and `software` are its
    /// tags of that name.
    ///
    /// `output` must be empty and at its start.
    ///
    /// # Errors
    ///
    /// When levels are none that a DNG can tell, the file would pass 4 GiB, integers shall be compressed, or the disk refuses.
    pub fn create(
        output: W,
        name: &str,
        header: &FrameHeader,
        samples: TiffSamples,
        compression: TiffCompression,
        [description, software]: [String; 2],
    ) -> Result<Self> {
        let Told { raw, first, exif, photometric, preview, doubt } = Told::of(header, name, samples)?;
        // Of several files it is said once: it is the same of all.
        doubt.into_iter().for_each(register::doubt);
        let settings =
            TiffSettings { samples, scale: 1.0, compression, tags: TiffTags::default(), extra: raw, exif: Vec::new() };
        let mut tiff = TiffWriter::create(output, name, &header.geometry, settings)?;
        if tiff.is_big() {
            return Err(Error::format(name, "a DNG holds up to 4 GiB, and this frame might pass that; write a TIFF"));
        }
        tiff.set_photometric(photometric);
        let digest = RawDigest::new(header.geometry.width, samples);
        Ok(Self { tiff, name: name.into(), samples, preview, digest, first, exif, texts: [description, software] })
    }

    /// Takes the next rows, as many as there are in `samples`.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] for a sample that is no integer of 16 bits, where these are written; [`Error::Disk`].
    ///
    /// # Panics
    ///
    /// When these are not whole rows, or more than the frame has.
    pub fn write_rows(&mut self, samples: &[f32]) -> Result<()> {
        let is_code = |sample: f32| (0.0..=65_535.0).contains(&sample) && sample.fract() == 0.0;
        if self.samples == TiffSamples::U16
            && let Some(sample) = samples.iter().find(|sample| !is_code(**sample))
        {
            return Err(Error::Data(format!(
                "{}: the sample {sample} is no code of 16 bits; write 32-bit floats (f32)",
                self.name
            )));
        }
        self.preview.take(samples);
        self.digest.take(samples);
        self.tiff.write_rows(samples)
    }

    /// Writes what is left, the picture and the directories. Gives the output back.
    ///
    /// # Errors
    ///
    /// When rows are missing, or the disk refuses.
    pub fn finish(self) -> Result<W> {
        let size = self.preview.sides.map(|side| u16::try_from(side).unwrap_or(u16::MAX));
        let [description, software] = self.texts;
        let mut extra = self.first;
        extra.push(tags::NEW_RAW_IMAGE_DIGEST.with(TagValue::Bytes(self.digest.finish().to_vec())));
        let first = FirstImage { size, rgb: self.preview.finish(), description, software, extra, exif: self.exif };
        Ok(self.tiff.finish_below(&first)?.0)
    }
}
