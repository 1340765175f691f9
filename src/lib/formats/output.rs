//! Writes frames: to named files, whole or not at all, and to pipes.

use super::atomic::{AtomicFile, Target};
use super::digest::SamplesDigest;
use super::dng::{self, DngWriter};
use super::exr::{self, ExrCompression, ExrSamples, ExrTags, ExrWriter, Layers, XYZ_PRIMARIES};
use super::format::U16_FULL_SCALE;
use super::icc;
use super::interleave::{between_codes, nearest_u16};
use super::places::{STDOUT_NAME, named, sidecar_path};
use super::png::{PngSettings, PngWriter};
use super::register;
use super::standard::open_stdout;
use super::storing::Encoding;
use super::tiff::{ExtraTag, TagValue, TiffSamples, TiffSettings, TiffTags, TiffWriter, exif_block};
use super::viewable::{self, Scaling, check_lossless};
use super::yaml;
use crate::color::{self, D65_XY, SRGB_PRIMARIES};
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, SamplesRecord, Seal};
use crate::stream::{Counts, RowSink};
use crate::text::visible;
use crate::units::{QuantityKind, RELATIVE_UNIT};
use half::f16;
use std::io::{IsTerminal, Write};
use std::path::Path;

pub use super::storing::{CompressionKind, Format, OutputOptions, SampleKind};

/// A frame that is being written.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::output::{FrameWriter, OutputOptions};
/// use cyanometer::stream::{Counts, RowSink};
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Adu);
/// # let geometry = Geometry::new(2, 2, &["Y"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// let directory = tempfile::tempdir().unwrap();
/// let path = directory.path().join("codes.tiff");
/// let options = OutputOptions { path: Some(path.clone()), ..OutputOptions::default() };
///
/// let mut writer = FrameWriter::create(&options, &header)?;
/// writer.write(&[1.0, 2.0, 3.0, 4.0])?;
/// // The file has its name once it is complete, and its sidecar beside it.
/// assert!(!path.exists());
/// writer.finish(Counts::default())?;
/// assert!(path.exists() && directory.path().join("codes.tiff.yaml").exists());
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub struct FrameWriter {
    encoder: Encoder,
    header: FrameHeader,
    name: String,
    /// The digest of what a reader will get, and the sidecar; only for named files.
    record: Option<(SamplesDigest, AtomicFile)>,
    encoding: Encoding,
    layers: Layers,
    scaling: Option<Scaling>,
    scaled: Vec<f32>,
    stored: Vec<f32>,
}

enum Encoder {
    /// Nothing is written before the first row is there, whose digest stands ahead of it.
    Waiting(Target),
    /// The head could not be written.
    GivenUp,
    Exr(Box<ExrWriter<Target>>),
    Tiff(Box<TiffWriter<Target>>),
    Dng(Box<DngWriter<Target>>),
    Png(Box<PngWriter<Target>>),
}

impl FrameWriter {
    /// Opens the output and its sidecar. The head of the frame is written with its first row.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where options do not go together, the output is a terminal, or it or its sidecar is a file that is
    /// read; [`Error::Disk`], also where there is no room for it.
    pub fn create(options: &OutputOptions, header: &FrameHeader) -> Result<Self> {
        let encoding = options.encoding(header)?;
        let sample_scale = options.scale(header, encoding)?;
        let mut header = header.clone();
        header.metadata.sample_scale = (sample_scale != 1.0).then_some(sample_scale);
        header.metadata.origin = Some(header.geometry.origin).filter(|origin| *origin != [0, 0]);
        let needs_seek = !matches!(encoding, Encoding::Exr(_, ExrCompression::None) | Encoding::Png);
        let target = Target::open(options.path.as_deref(), needs_seek)?;
        let name = target.name().to_owned();
        let follow = options.frames_to_come > 0 && target.named_file().is_none();
        let others = if follow { options.frames_to_come } else { options.files_to_come };
        encoding.bytes(&header.geometry).map_or(Ok(()), |bytes| target.check_room(bytes, others))?;
        header.metadata.frames_to_come = follow.then_some(options.frames_to_come);
        header.metadata.file = header.metadata.file.filter(|_| target.named_file().is_none());
        if matches!(encoding, Encoding::Exr(ExrSamples::F16, _)) {
            doubt_of_codes(&name, &header);
        }
        let sidecar = target.named_file().map(|path| AtomicFile::create(&sidecar_path(path))).transpose()?;
        let record = sidecar.map(|sidecar| (SamplesDigest::new(), sidecar));
        // What cannot be written is told before anything is computed.
        yaml::write_metadata(&header.metadata)?;
        let scaling = Scaling::of(header.geometry.width, &header.geometry.channels, sample_scale);
        let (scaled, stored) = (Vec::new(), Vec::new());
        let (encoder, layers) = (Encoder::Waiting(target), options.layers()?);
        Ok(Self { encoder, header, name, record, encoding, layers, scaling, scaled, stored })
    }

    /// Writes the head of the frame, which tells of the samples to store what a reader can hold them against.
    fn begin(&mut self, samples: &[f32], to_store: &[f32]) -> Result<()> {
        let target = match std::mem::replace(&mut self.encoder, Encoder::GivenUp) {
            Encoder::Waiting(target) => target,
            begun => {
                self.encoder = begun;
                return Ok(());
            }
        };
        let Geometry { width, height, .. } = self.header.geometry;
        let row = self.header.geometry.row_samples().min(samples.len());
        let (mut digest, mut stored) = (SamplesDigest::new(), Vec::new());
        digest.update_rows(self.as_read(&mut stored, &samples[..row], &to_store[..row]), &self.header.geometry);
        self.header.metadata.seal = Some(Seal { size: [width, height], first_row: digest.finish() });
        self.encoder = self.encoder_of(target)?;
        Ok(())
    }

    /// Writes the head of the frame in its format.
    fn encoder_of(&self, target: Target) -> Result<Encoder> {
        let Self { name, header, encoding, .. } = self;
        let description = yaml::write_metadata(&header.metadata)?;
        let software = format!("cyanometer {}", env!("CARGO_PKG_VERSION"));
        let geometry = &header.geometry;
        let sample_scale = header.metadata.sample_scale.unwrap_or(1.0);
        Ok(match *encoding {
            Encoding::Exr(samples, compression) => {
                let (metadata, software) = (Some(description), Some(software));
                let tags = ExrTags { metadata, software, ..native_tags(header) };
                let writer = ExrWriter::create(target, name, geometry, samples, compression, self.layers, &tags)?;
                Encoder::Exr(Box::new(writer))
            }
            Encoding::Tiff(samples, compression) => {
                let scale = u16_scale(header.metadata.quantity, samples);
                let tags = TiffTags { description: Some(description), software: Some(software) };
                let full = if samples == TiffSamples::U16 { f64::from(U16_FULL_SCALE) } else { 1.0 };
                let profile = icc::profile(header, sample_scale, full)?.map(TagValue::Undefined);
                let extra = profile.into_iter().map(|value| ExtraTag { number: ICC_PROFILE, value }).collect();
                let exif = dng::of_exposure(&header.metadata);
                let settings = TiffSettings { samples, scale, compression, tags, extra, exif };
                Encoder::Tiff(Box::new(TiffWriter::create(target, name, geometry, settings)?))
            }
            Encoding::Dng(samples, compression) => {
                let texts = [description, software];
                Encoder::Dng(Box::new(DngWriter::create(target, name, header, samples, compression, texts)?))
            }
            Encoding::Png => {
                let scale = u16_scale(header.metadata.quantity, TiffSamples::U16);
                let is_srgb = header.metadata.quantity == QuantityKind::Srgb;
                let profile = icc::profile(header, sample_scale, f64::from(U16_FULL_SCALE))?;
                let exif = exif_block(&dng::of_exposure(&header.metadata), name)?;
                let settings = PngSettings { scale, is_srgb, description, software, profile, exif };
                Encoder::Png(Box::new(PngWriter::create(target, name, geometry, settings)?))
            }
        })
    }

    /// Ends the frame: gives a named file its name, and writes its sidecar. Gives the number of samples that 16 bits could
    /// not hold.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`]; the file is then not left behind.
    pub fn finish(mut self, counts: Counts) -> Result<u64> {
        self.begin(&[], &[])?;
        let mut did_not_fit = 0;
        let mut target = match self.encoder {
            Encoder::Waiting(_) | Encoder::GivenUp => return Err(given_up(&self.name)),
            Encoder::Exr(writer) => {
                let (mut target, patch) = writer.finish()?;
                if let Some(patch) = patch {
                    exr::patch_table(&mut target, &self.name, &patch)?;
                }
                target
            }
            Encoder::Tiff(writer) => {
                let (target, clamped) = writer.finish()?;
                did_not_fit = clamped;
                target
            }
            Encoder::Dng(writer) => writer.finish()?,
            Encoder::Png(writer) => {
                let (target, clamped) = writer.finish()?;
                did_not_fit = clamped;
                target
            }
        };
        target.flush().map_err(|e| Error::disk(&self.name, "write", e))?;
        let sidecar = match self.record {
            Some((digest, mut sidecar)) => {
                let mut metadata = self.header.metadata;
                let one_value = digest.is_of_one_value();
                metadata.samples = Some(SamplesRecord { one_value, ..counts.record(digest.finish()) });
                let text = yaml::write_metadata(&metadata)?;
                let written = sidecar.write_all(text.as_bytes()).and_then(|()| sidecar.flush());
                written.map_err(|e| Error::disk(sidecar.name(), "write", e))?;
                Some(sidecar)
            }
            None => None,
        };
        // Both files are complete before either gets its name.
        target.commit_with(sidecar)?;
        Ok(did_not_fit)
    }
}

fn given_up(name: &str) -> Error {
    Error::Data(format!("{name}: its head could not be written"))
}

/// What EXR attributes tell other software of a frame.
fn native_tags(header: &FrameHeader) -> ExrTags {
    let FrameHeader { metadata, .. } = header;
    let primaries = match metadata.quantity {
        QuantityKind::Xyz => Some(XYZ_PRIMARIES),
        QuantityKind::LinearSrgb => Some(SRGB_PRIMARIES),
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons | QuantityKind::Adu
            if header.leads_with_three_planes() =>
        {
            let matrix = metadata.sensor.as_ref().and_then(|sensor| sensor.xyz_from_camera);
            matrix.and_then(|matrix| color::implied_primaries(&matrix))
        }
        _ => None,
    };
    ExrTags {
        exposure_s: metadata.time_s().filter(|time_s| *time_s > 0.0),
        f_number: metadata.exposure.map(|e| e.f_number),
        iso_speed: metadata.iso_speed,
        // Absolute XYZ: unscaled (1, 1, 1) has Y = 1 cd m⁻²; linear sRGB that of its white. Of relative ones no luminance is known.
        white_luminance: match metadata.quantity {
            QuantityKind::Xyz => (metadata.unit != RELATIVE_UNIT).then_some(1.0),
            QuantityKind::LinearSrgb => metadata.white_luminance(),
            _ => None,
        }
        .map(|luminance| luminance / metadata.sample_scale.unwrap_or(1.0)),
        neutral_xy: match metadata.quantity {
            QuantityKind::Xyz => metadata.color.as_ref().and_then(|color| color.white).map(color::chromaticity),
            QuantityKind::LinearSrgb => Some(D65_XY),
            _ => None,
        },
        interop_id: interop_id(header).map(str::to_owned),
        primaries,
        ..ExrTags::default()
    }
}

/// The name of the color space \[CIF2025]; none of spaces that have none, as that of a camera.
fn interop_id(header: &FrameHeader) -> Option<&'static str> {
    match header.metadata.quantity {
        QuantityKind::LinearSrgb => Some("lin_rec709_scene"),
        QuantityKind::Xyz => {
            let [x, y] = color::chromaticity(header.metadata.color.as_ref()?.white?);
            let is_d65 = [x - D65_XY[0], y - D65_XY[1]].iter().all(|off| off.abs() < 1e-4);
            is_d65.then_some("lin_ciexyzd65_scene")
        }
        QuantityKind::Electrons | QuantityKind::ExpectedElectrons | QuantityKind::Adu
            if header.metadata.cfa.is_some() =>
        {
            Some("data")
        }
        QuantityKind::ColorDifference => Some("data"),
        _ => None,
    }
}

/// The tag of ICC profiles in TIFF.
const ICC_PROFILE: u16 = 34675;

/// A warning of codes that f16 rounds: it counts by ones to 2048, by twos to 4096 and so on.
pub fn doubt_of_codes(name: &str, header: &FrameHeader) {
    let white = header.metadata.white_level_adu.map(|white| white.largest());
    let rounded = white.filter(|white| header.metadata.quantity == QuantityKind::Adu && *white > LARGEST_EXACT_F16);
    if let Some(white) = rounded {
        let step = 2_f64.powf((white / LARGEST_EXACT_F16).log2().ceil());
        register::doubt(format!(
            "{name}: f16 holds codes to {LARGEST_EXACT_F16} as they are, and rounds those above, by steps of {step} at the \
             white level, {white} ADU; f32 keeps all"
        ));
    }
}

/// The largest whole number below which f16 has all.
const LARGEST_EXACT_F16: f64 = 2048.0;

/// What f16 rounds to infinity, from halfway between the largest f16 and the next power of two on.
const F16_OVERFLOW: f32 = 65520.0;

/// What samples are multiplied with before they become 16-bit integers.
fn u16_scale(quantity: QuantityKind, samples: TiffSamples) -> f32 {
    if samples == TiffSamples::U16 && quantity == QuantityKind::Srgb { U16_FULL_SCALE } else { 1.0 }
}

impl RowSink for FrameWriter {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        let mut scaled = std::mem::take(&mut self.scaled);
        let to_store = match &self.scaling {
            None => samples,
            Some(scaling) => {
                scaled.clear();
                scaled.extend_from_slice(samples);
                scaling.apply(&mut scaled);
                self.check_scaled(scaling, samples, &scaled)?;
                &scaled
            }
        };
        self.check_f16(to_store)?;
        self.check_whole(samples)?;
        self.begin(samples, to_store)?;
        self.update_digest(samples, to_store);
        self.encode(to_store)?;
        self.scaled = scaled;
        Ok(())
    }
}

impl FrameWriter {
    /// Refuses samples that are not what they were, or what f16 makes of them, once they are scaled back.
    fn check_scaled(&self, scaling: &Scaling, samples: &[f32], scaled: &[f32]) -> Result<()> {
        match self.encoding {
            // What f16 makes of samples is the same at every scale, but for the smallest, and for what overflows unscaled.
            Encoding::Exr(ExrSamples::F16, _) => {
                let half = |sample: &f32| f16::from_f32(*sample).to_f32();
                let rounded: Vec<f32> = samples.iter().map(half).collect();
                let mut stored: Vec<f32> = scaled.iter().map(half).collect();
                scaling.undo(&mut stored);
                let differs = |(plain, stored): &(&f32, &f32)| plain.is_finite() && plain != stored;
                match rounded.iter().zip(&stored).find(differs) {
                    None => Ok(()),
                    Some((sample, _)) => Err(viewable::lost(&self.name, *sample)),
                }
            }
            Encoding::Tiff(TiffSamples::U16, _) | Encoding::Dng(TiffSamples::U16, _) | Encoding::Png => {
                check_lossless(&self.name, scaling, samples, scaled, U16_FULL_SCALE)
            }
            _ => check_lossless(&self.name, scaling, samples, scaled, f32::INFINITY),
        }
    }

    fn check_f16(&self, to_store: &[f32]) -> Result<()> {
        if !matches!(self.encoding, Encoding::Exr(ExrSamples::F16, _)) {
            return Ok(());
        }
        let overflows = |sample: &&f32| (F16_OVERFLOW..f32::INFINITY).contains(&sample.abs());
        match to_store.iter().find(overflows) {
            None => Ok(()),
            Some(sample) => Err(Error::Data(format!(
                "{}: the sample {sample} would become infinite as f16, which ends at 65504; write f32",
                self.name
            ))),
        }
    }

    /// Refuses codes that 16-bit integers would round, as those of floats that another program scaled; what is beyond their ends is
    /// counted, and told at the end.
    fn check_whole(&self, samples: &[f32]) -> Result<()> {
        let advice = match self.encoding {
            Encoding::Tiff(TiffSamples::U16, _) => "write 32-bit floats (f32)",
            Encoding::Png => "write an EXR or a TIFF of 32-bit floats (f32)",
            _ => return Ok(()),
        };
        match between_codes(samples).filter(|_| self.header.metadata.quantity == QuantityKind::Adu) {
            None => Ok(()),
            Some(sample) => Err(Error::Data(format!(
                "{}: the sample {sample} lies between codes, and 16-bit integers would round it; {advice}",
                self.name
            ))),
        }
    }

    /// Adds rows to the digest of the samples as a reader will get them.
    fn update_digest(&mut self, samples: &[f32], to_store: &[f32]) {
        let Some((mut digest, sidecar)) = self.record.take() else { return };
        let mut stored = std::mem::take(&mut self.stored);
        digest.update_rows(self.as_read(&mut stored, samples, to_store), &self.header.geometry);
        (self.stored, self.record) = (stored, Some((digest, sidecar)));
    }

    /// Samples as a reader will get them, with room for those that are others.
    fn as_read<'a>(&self, stored: &'a mut Vec<f32>, samples: &'a [f32], to_store: &[f32]) -> &'a [f32] {
        stored.clear();
        match self.encoding {
            Encoding::Exr(ExrSamples::F16, _) => {
                stored.extend(to_store.iter().map(|&sample| f16::from_f32(sample).to_f32()));
                self.scaling.iter().for_each(|scaling| scaling.undo(stored));
            }
            Encoding::Tiff(TiffSamples::U16, _) | Encoding::Dng(TiffSamples::U16, _) | Encoding::Png => {
                let scale = u16_scale(self.header.metadata.quantity, TiffSamples::U16);
                stored.extend(samples.iter().map(|sample| f32::from(nearest_u16(sample * scale))));
            }
            _ => return samples,
        }
        stored
    }
}

impl FrameWriter {
    fn encode(&mut self, samples: &[f32]) -> Result<()> {
        match &mut self.encoder {
            Encoder::Waiting(_) | Encoder::GivenUp => Err(given_up(&self.name)),
            Encoder::Exr(writer) => writer.write(samples),
            Encoder::Tiff(writer) => writer.write_rows(samples),
            Encoder::Dng(writer) => writer.write_rows(samples),
            Encoder::Png(writer) => writer.write_rows(samples),
        }
    }
}

/// Whether an output is the standard one.
pub fn is_stdout(path: Option<&Path>) -> bool {
    named(path).is_none()
}

/// Writes a text (a report, a matrix) to a named file or the standard output. A pipe that its reader has closed is no error:
/// what remains to be done is done.
///
/// # Errors
///
/// [`Error::Usage`] where the output is a file that is read; [`Error::Disk`].
pub fn write_text(path: Option<&Path>, text: &str) -> Result<()> {
    let written = match named(path) {
        Some(path) => write_all(Target::open_text(path)?, text.as_bytes()),
        None => {
            let mut output = open_stdout()?;
            let text = if output.is_terminal() { visible(text) } else { text.into() };
            output.write_all(text.as_bytes()).map_err(|e| Error::disk(STDOUT_NAME, "write", e))
        }
    };
    match written {
        Err(Error::ClosedPipe) => Ok(()),
        other => other,
    }
}

/// Writes what is complete in memory (a plot) to a named file or the standard output, which is no terminal.
///
/// # Errors
///
/// [`Error::Usage`] where the output is a terminal or a file that is read; [`Error::Disk`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_all(Target::open(Some(path), false)?, bytes)
}

fn write_all(mut target: Target, bytes: &[u8]) -> Result<()> {
    target.write_all(bytes).map_err(|e| Error::disk(target.name(), "write", e))?;
    target.commit()
}
