//! Pictures for people: 8-bit PNG of any frame.

use super::atomic::Target;
use super::foreign::png_complaint;
use crate::analysis::statistics::Region;
use crate::color::{linear_srgb_from_xyz, srgb_encode};
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::numerics::moments::Moments;
use crate::stream::{RowSource, fold};
use crate::units::{Any, QuantityKind};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use nalgebra::Vector3;
use std::io::Write;
use std::path::Path;

/// A picture may have this many pixels: it is held in memory.
const MAX_PIXELS: usize = 64 << 20;

/// Which samples become black and which white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// What no light reads, and the most that the stage can hold.
    Full,
    /// In each plane by itself, from so many standard deviations below its mean to as many above.
    Deviations(f64),
    /// From one value to another, in the unit of the samples.
    Values(f64, f64),
}

/// What of a frame to show, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureSettings {
    /// The part of the frame; all of it where there is none.
    pub region: Option<Region>,
    /// Every pixel becomes a square of so many.
    pub zoom: usize,
    /// What is black and what is white.
    pub range: Range,
}

/// Reads a frame and writes it as a PNG.
///
/// Electrons and ADU are shown plane by plane, R as red and so on, with the sRGB curve; XYZ in its colors under the
/// white that its metadata name; sRGB as it is.
///
/// # Errors
///
/// [`Error::Usage`] for a region outside the frame, a picture too large, or an output that is a terminal or a file that is read;
/// [`Error::Format`] for quantities that are no picture; those of the reader; [`Error::Disk`].
pub fn write_png(source: &mut dyn RowSource, settings: &PictureSettings, path: &Path) -> Result<()> {
    let frame = source.header().clone();
    let region = settings.region.unwrap_or(Region::whole(&frame));
    region.check(&frame)?;
    let size = [region.width * settings.zoom, region.height * settings.zoom];
    if size[0].checked_mul(size[1]).is_none_or(|pixels| pixels > MAX_PIXELS) {
        return Err(Error::Usage(format!(
            "{}: a picture of {}x{} is too large; show a part of it with --region",
            frame.name, size[0], size[1]
        )));
    }
    let planes = match frame.geometry.channels.len() {
        1 => 1,
        3 if frame.has_three_planes() => 3,
        _ => {
            return Err(frame.refuse(format!("it holds {}, which makes no picture", frame.holds())));
        }
    };
    let (kept, moments) = read_region(source, region, planes)?;
    let shade = Shade::new(&frame, settings.range, &moments)?;
    let bytes = shown(&kept, planes, region.width, settings.zoom, &shade);
    encode(&bytes, size, planes, path)
}

/// Samples of a region, laid out as a frame's, and their moments plane by plane.
fn read_region(source: &mut dyn RowSource, region: Region, planes: usize) -> Result<(Vec<f32>, Vec<Moments>)> {
    let mut kept = Vec::new();
    let mut moments = vec![Moments::new(1); planes];
    fold([source], region.y + region.height, |band| {
        let window = band.window::<Any>(0);
        for y in band.rows().filter(|y| *y >= region.y) {
            for (plane, moments) in moments.iter_mut().enumerate() {
                let line = &window.row(y.cast_signed(), plane)[region.x..][..region.width];
                moments.add(&[line]);
                kept.extend_from_slice(line);
            }
        }
        Ok(())
    })?;
    Ok((kept, moments))
}

/// Writes the bytes of a picture as a PNG.
fn encode(bytes: &[u8], size: [usize; 2], planes: usize, path: &Path) -> Result<()> {
    let mut file = Target::open(Some(path), false)?;
    let name = file.name().to_owned();
    let color = if planes == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
    let [width, height] = size.map(|length| u32::try_from(length).unwrap_or(u32::MAX));
    PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Adaptive)
        .write_image(bytes, width, height, color)
        .map_err(|error| png_complaint(&name, error))?;
    file.flush().map_err(|e| Error::disk(&name, "write", e))?;
    file.commit()
}

/// The picture's bytes, of rows `[channel][column]`; each pixel becomes a square of `zoom` by `zoom`.
fn shown(rows: &[f32], planes: usize, columns: usize, zoom: usize, shade: &Shade) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rows.len() * zoom * zoom);
    for row in rows.chunks_exact(columns * planes) {
        let start = bytes.len();
        for x in 0..columns {
            let pixel: Vec<f64> = (0..planes).map(|plane| f64::from(row[plane * columns + x])).collect();
            let shown = shade.apply(&pixel);
            for _ in 0..zoom {
                bytes.extend_from_slice(&shown);
            }
        }
        for _ in 1..zoom {
            bytes.extend_from_within(start..start + columns * zoom * planes);
        }
    }
    bytes
}

/// From samples to display values.
enum Shade {
    /// Each plane by itself, from its black to its white.
    Planes(Vec<(f64, f64)>),
    /// XYZ through the matrix to linear sRGB.
    Xyz(nalgebra::Matrix3<f64>),
    /// Encoded already.
    Encoded,
}

impl Shade {
    fn new(frame: &FrameHeader, range: Range, moments: &[Moments]) -> Result<Self> {
        let metadata = &frame.metadata;
        let lowest = moments.iter().map(|plane| plane.min[0]).fold(f64::INFINITY, f64::min);
        let highest = moments.iter().map(|plane| plane.max[0]).fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = match range {
            Range::Values(low, high) => (low, high),
            Range::Deviations(count) => {
                let about = |plane: &Moments| {
                    let spread = count * plane.std(0).unwrap_or(0.0);
                    (plane.mean[0] - spread, plane.mean[0] + spread)
                };
                return Self::planes(frame, moments.iter().map(about).collect());
            }
            Range::Full => match metadata.quantity {
                QuantityKind::Srgb => return Ok(Self::Encoded),
                QuantityKind::Xyz if moments.len() != 3 => {
                    return Err(frame.refuse("a single plane of XYZ is no picture; give --range LOW,HIGH"));
                }
                QuantityKind::Xyz => {
                    let white = metadata.color.as_ref().and_then(|color| color.white);
                    let white = white.ok_or_else(|| {
                        frame.refuse(
                            "the metadata name no white; give --range LOW,HIGH, or make it anew with `to-xyz \
                             --white-luminance CD_PER_M2`",
                        )
                    })?;
                    return Ok(Self::Xyz(linear_srgb_from_xyz(white)));
                }
                QuantityKind::ExpectedElectrons | QuantityKind::Electrons => {
                    let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
                    let full = readout.map_or(highest, |readout| readout.full_well_e);
                    (metadata.dark_signal_e.unwrap_or(0.0), full)
                }
                QuantityKind::Adu => {
                    let black = frame.black_levels()?.map_or(0.0, |black| black.smallest());
                    let white = metadata.white_level_adu.unwrap_or(highest.into());
                    if moments.len() == 3 {
                        return Self::planes(frame, white.classes().map(|white| (black, white)).to_vec());
                    }
                    (black, white.largest())
                }
                QuantityKind::LinearSrgb => (0.0, 1.0),
                QuantityKind::Unspecified => (lowest.min(0.0), highest),
                other => {
                    return Err(frame
                        .refuse(format!("{other} is no picture; give --range LOW,HIGH, or show what it was made of")));
                }
            },
        };
        Self::planes(frame, vec![(low, high); moments.len()])
    }

    fn planes(frame: &FrameHeader, ranges: Vec<(f64, f64)>) -> Result<Self> {
        match ranges.iter().find(|(low, high)| !(low < high && (high - low).is_finite())) {
            None => Ok(Self::Planes(ranges)),
            Some((low, high)) => Err(Error::Usage(format!(
                "{}: a range from {low} to {high} shows nothing; give another with --range",
                frame.name
            ))),
        }
    }

    fn apply(&self, pixel: &[f64]) -> Vec<u8> {
        let encoded: Vec<f64> = match self {
            Self::Encoded => pixel.to_vec(),
            Self::Planes(ranges) => {
                let shade = |(value, (low, high)): (&f64, &(f64, f64))| (value - low) / (high - low);
                pixel.iter().zip(ranges).map(|pair| srgb_encode(shade(pair).clamp(0.0, 1.0))).collect()
            }
            Self::Xyz(matrix) => {
                let linear = matrix * Vector3::from_fn(|i, _| pixel.get(i).copied().unwrap_or(0.0));
                linear.iter().map(|value| srgb_encode(value.clamp(0.0, 1.0))).collect()
            }
        };
        // NaN is shown as black.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
        encoded.iter().map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8).collect()
    }
}
