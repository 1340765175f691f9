//! What the tags of a DNG tell of a frame of ours.

use super::image::{CFA, LINEAR_RAW};
use super::noise;
use super::preview::Preview;
use super::ratio::{ratio, signed};
use super::signals::{CameraColor, doubt_of_colors};
use super::tags;
use crate::camera::levels::{BlackLevels, WhiteLevel};
use crate::cfa::{FILTERS, FilterArray};
use crate::error::{Error, Result};
use crate::formats::tiff::{ExtraTag, TagValue, TiffSamples};
use crate::metadata::{FrameHeader, Metadata};
use crate::stages::saturation::FullLevels;

/// The version that is written, and the oldest that readers of integers and of floats must know.
const VERSION: [u8; 4] = [1, 4, 0, 0];
/// Readers of integers need nothing later.
const BACKWARD_OF_INTEGERS: [u8; 4] = [1, 1, 0, 0];
/// Floats came with this.
const BACKWARD_OF_FLOATS: [u8; 4] = [1, 4, 0, 0];
/// The version of Exif that tells of time and f-number.
const EXIF_VERSION: &[u8; 4] = b"0232";
/// sRGB among the color spaces of previews.
const SRGB: u32 = 2;
/// What cameras are called whose sensor has no name, and who made them.
const NAMELESS: &str = "cyanometer";

/// The tags of a frame.
#[derive(Debug)]
pub(super) struct Told {
    /// Those of the raw image.
    pub raw: Vec<ExtraTag>,
    /// Those of the first directory, which holds the picture.
    pub first: Vec<ExtraTag>,
    /// Those of Exif.
    pub exif: Vec<ExtraTag>,
    /// What the plane is.
    pub photometric: u16,
    /// The picture, without rows yet.
    pub preview: Preview,
    /// What to warn of.
    pub doubt: Option<String>,
}

impl Told {
    /// The tags of a frame that [`super::check_frame`] took, whose file the user calls `name`.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] for floats without a white level; [`Error::Format`] where the black level reaches the white
    /// level, or is not known for all rows and columns.
    pub fn of(header: &FrameHeader, name: &str, samples: TiffSamples) -> Result<Self> {
        let FrameHeader { geometry, metadata, .. } = header;
        let cfa = metadata.cfa.ok_or_else(|| header.missing("cfa"))?;
        let black = header.black_levels()?;
        let highest =
            black.as_ref().map_or(0.0, |black| black.largest([geometry.width, geometry.height], |_, _| None)[0]);
        let white = white(header, samples, highest)?;
        if f64::from(white) <= highest {
            return Err(Error::format(
                name,
                format!(
                    "a DNG has codes from black to white, and the black level of this frame, {highest} ADU, is no less than its white level, {white} ADU; write a TIFF"
                ),
            ));
        }
        let range = f64::from(white) - highest;
        // Levels are those of the samples that are stored; shares of the range are the same on any scale.
        let scale = metadata.sample_scale.unwrap_or(1.0);
        let stored = black.as_ref().map(|black| black.map(|level| level * scale));
        let color = CameraColor::of_frame(metadata).filter(|_| cfa.has_three_classes());

        let mut raw = places(header, cfa);
        raw.extend(stored.iter().flat_map(|black| black_levels(black, geometry.width)));
        if metadata.white_level_adu.is_some() {
            raw.push(tags::WHITE_LEVEL.with(TagValue::Longs(vec![scaled(white, scale)])));
        }
        raw.extend(noise::tag(header, cfa, range));
        Ok(Self {
            raw,
            first: of_file(metadata, samples, color.as_ref()),
            exif: of_exposure(metadata),
            photometric: if cfa == FilterArray::Monochrome { LINEAR_RAW } else { CFA },
            doubt: doubt_of_colors(metadata).filter(|_| color.is_none() && cfa.has_three_classes()),
            preview: Preview::new(geometry, cfa, stored, range * scale, color),
        })
    }
}

/// A level of codes among samples that are stored on a larger scale.
fn scaled(white: u32, scale: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it fills 16 bits at most")]
    let scaled = (f64::from(white) * scale) as u32;
    scaled
}

/// The largest code, rounded down: the tag holds whole numbers, and a saturated sample shall be so. Of classes that differ the
/// largest, so that no sample is clipped. The tag is the code of a saturated photosite: where full well lies below the last code,
/// but not at the `highest` black level, that counts. Integers need none: it is the largest that 16 bits hold
/// \[DNG2023, WhiteLevel].
fn white(header: &FrameHeader, samples: TiffSamples, highest: f64) -> Result<u32> {
    match (white_of(header, highest), samples) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "what does not fit becomes the nearer end"
        )]
        (Some(white), _) => Ok(white.floor() as u32),
        (None, TiffSamples::U16) => Ok(u16::MAX.into()),
        (None, TiffSamples::F32) if header.metadata.correction.as_ref().is_some_and(|record| record.took_frames()) => {
            Err(header.refuse(
                "a DNG of floats tells its white level, and how far the dark frames lowered that of this frame is not known: no \
                 `black_level_adu` says what they took off; write an EXR or a TIFF, or add it to the metadata of the frame (a \
                 sidecar, or --metadata FILE)",
            ))
        }
        (None, TiffSamples::F32) => Err(header.missing("white_level_adu")),
    }
}

/// The level that the tag tells of a frame, before it is rounded down; none of a frame whose white level is not known.
fn white_of(header: &FrameHeader, highest: f64) -> Option<f64> {
    let full = FullLevels::of(header).map(|full| full.classes().map(f64::from).into_iter().fold(0.0, f64::max));
    let largest = header.metadata.white_level_adu.map(WhiteLevel::largest);
    largest.map(|white| full.filter(|full| full.floor() > highest).unwrap_or(white))
}

/// The WhiteLevel that is written of a frame; none where it does not hang on metadata alone.
pub(in crate::formats) fn written_white(header: &FrameHeader) -> Option<f64> {
    let black = header.black_levels().ok()?;
    let size = [header.geometry.width, header.geometry.height];
    let highest = black.as_ref().map_or(0.0, |black| black.largest(size, |_, _| None)[0]);
    white_of(header, highest).map(|white| white.floor().max(0.0))
}

/// The filter array, and which samples are shown: all.
fn places(header: &FrameHeader, cfa: FilterArray) -> Vec<ExtraTag> {
    let geometry = &header.geometry;
    let [width, height] = [geometry.width, geometry.height].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    let mut found = vec![
        tags::NEW_SUBFILE_TYPE.with(TagValue::Longs(vec![0])),
        tags::DEFAULT_SCALE.with(TagValue::Ratios(vec![[1, 1]; 2])),
        tags::DEFAULT_CROP_ORIGIN.with(TagValue::Longs(vec![0, 0])),
        tags::DEFAULT_CROP_SIZE.with(TagValue::Longs(vec![width, height])),
        tags::ACTIVE_AREA.with(TagValue::Longs(vec![0, 0, height, width])),
    ];
    if cfa != FilterArray::Monochrome {
        let [columns, rows] = cfa.period();
        let [left, top] = geometry.origin.map(i64::from);
        let sites = (0..rows as i64).flat_map(|y| (0..columns as i64).map(move |x| [x, y]));
        let pattern = sites.filter_map(|[x, y]| cfa.filter(left + x, top + y)).map(code).collect();
        let dimensions = [rows, columns].map(|side| u16::try_from(side).unwrap_or(u16::MAX));
        found.extend([
            tags::CFA_REPEAT.with(TagValue::Shorts(dimensions.to_vec())),
            tags::CFA_PATTERN.with(TagValue::Bytes(pattern)),
            tags::CFA_PLANE_COLOR.with(TagValue::Bytes(cfa.filters().into_iter().map(code).collect())),
            tags::CFA_LAYOUT.with(TagValue::Shorts(vec![1])),
        ]);
    }
    found
}

/// The number of a filter.
fn code(filter: char) -> u8 {
    let place = FILTERS.chars().position(|letter| letter == filter);
    place.and_then(|place| u8::try_from(place).ok()).unwrap_or(u8::MAX)
}

/// The black level by site, and what rows and columns add. The tag holds nothing below zero: there, columns take it.
fn black_levels(black: &BlackLevels, width: usize) -> Vec<ExtraTag> {
    let sites = black.sites();
    let below = sites.into_iter().fold(0.0, f64::min);
    let (dimensions, count) =
        if sites.iter().all(|site| *site == sites[0]) { (vec![1; 2], 1) } else { (vec![2; 2], 4) };
    let levels = sites[..count].iter().map(|site| ratio(site - below)).collect();
    let mut found =
        vec![tags::BLACK_REPEAT.with(TagValue::Shorts(dimensions)), tags::BLACK_LEVEL.with(TagValue::Ratios(levels))];
    let deltas =
        |deltas: &[f64], plus: f64| TagValue::SignedRatios(deltas.iter().map(|delta| signed(delta + plus)).collect());
    let columns = black.by_column();
    if !columns.is_empty() {
        found.push(tags::BLACK_DELTA_H.with(deltas(columns, below)));
    } else if below < 0.0 {
        found.push(tags::BLACK_DELTA_H.with(deltas(&vec![0.0; width], below)));
    }
    if !black.by_row().is_empty() {
        found.push(tags::BLACK_DELTA_V.with(deltas(black.by_row(), 0.0)));
    }
    found
}

/// What holds for the whole file: version, camera, colors.
fn of_file(metadata: &Metadata, samples: TiffSamples, color: Option<&CameraColor>) -> Vec<ExtraTag> {
    let backward = if samples == TiffSamples::U16 { BACKWARD_OF_INTEGERS } else { BACKWARD_OF_FLOATS };
    let model = camera_name(metadata);
    let mut found = vec![
        tags::DNG_VERSION.with(TagValue::Bytes(VERSION.to_vec())),
        tags::DNG_BACKWARD_VERSION.with(TagValue::Bytes(backward.to_vec())),
        tags::UNIQUE_CAMERA_MODEL.with(TagValue::Text(model.clone())),
        tags::MAKE.with(TagValue::Text(NAMELESS.into())),
        tags::MODEL.with(TagValue::Text(model)),
        tags::ORIENTATION
            .with(TagValue::Shorts(vec![metadata.orientation.filter(|o| (1..=8).contains(o)).unwrap_or(1)])),
        tags::PREVIEW_COLOR_SPACE.with(TagValue::Longs(vec![SRGB])),
    ];
    if let Some(color) = color {
        let matrix = color.camera_from_xyz.as_flattened().iter().map(|element| signed(*element)).collect();
        found.extend([
            tags::CALIBRATION_ILLUMINANT_1.with(TagValue::Shorts(vec![color.illuminant])),
            tags::COLOR_MATRIX_1.with(TagValue::SignedRatios(matrix)),
            tags::AS_SHOT_NEUTRAL.with(TagValue::Ratios(color.neutral.map(ratio).to_vec())),
        ]);
    }
    found
}

/// Exposure and sensitivity, as Exif has them; no tags where they are unknown.
pub(in crate::formats) fn of_exposure(metadata: &Metadata) -> Vec<ExtraTag> {
    let aperture = metadata.exposure.map(|exposure| exposure.f_number);
    let settings = [(tags::EXPOSURE_TIME, metadata.time_s()), (tags::F_NUMBER, aperture)];
    let settings = settings.into_iter().filter_map(|(tag, value)| Some((tag, ratio(value?))));
    let mut found: Vec<ExtraTag> = settings
        .filter(|(_, [above, _])| *above > 0)
        .map(|(tag, ratio)| tag.with(TagValue::Ratios(vec![ratio])))
        .collect();
    found.extend(metadata.iso_speed.into_iter().flat_map(of_sensitivity));
    if !found.is_empty() {
        found.push(tags::EXIF_VERSION.with(TagValue::Undefined(EXIF_VERSION.to_vec())));
    }
    found
}

/// A sensitivity, ISO, to a whole number: what 16 bits do not hold is 65535, and stands in a tag of its own besides.
fn of_sensitivity(iso: f64) -> Vec<ExtraTag> {
    let [above, below] = ratio(iso.round());
    let whole = above.checked_div(below).unwrap_or(0);
    let short = u16::try_from(whole).unwrap_or(u16::MAX);
    let mut found = vec![tags::PHOTOGRAPHIC_SENSITIVITY.with(TagValue::Shorts(vec![short]))];
    if u32::from(short) < whole {
        found.push(tags::ISO_SPEED.with(TagValue::Longs(vec![whole])));
    }
    if whole > 0 { found } else { Vec::new() }
}

/// The name of the sensor, or else of the camera, in the letters that the tags allow.
fn camera_name(metadata: &Metadata) -> String {
    let name = metadata.camera_names().map(str::trim).find(|name| !name.is_empty()).unwrap_or(NAMELESS);
    let ascii: String = name.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '_' }).collect();
    if ascii.is_empty() { NAMELESS.into() } else { ascii }
}
