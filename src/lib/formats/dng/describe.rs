//! What a DNG's tags tell about its frame, in the project's terms.

use super::area::{self, Rectangle};
use super::color;
use super::image::RawImage;
use super::levels::Levels;
use super::tags;
use crate::cfa::{FILTERS, FilterArray};
use crate::error::{Error, Result};
use crate::formats::exposure::{self, ToldExposure};
use crate::formats::tiff::{Directory, TiffFile, passed_over, told_orientation};
use crate::metadata::Metadata;
use crate::text::visible;
use crate::units::QuantityKind;
use tiff::tags::Tag;

/// Longest name of a camera, bytes.
const LONGEST_NAME: usize = 128;

/// What is known of the frame, with notes on what is passed over; but for the exposure, which metadata tell where they are ours.
///
/// # Errors
///
/// When tags are damaged, or tell of an array that cannot be described.
pub(super) fn describe(
    file: &mut TiffFile,
    image: &RawImage,
    active: Rectangle,
    levels: &Levels,
    is_ours: bool,
    notes: &mut Vec<String>,
) -> Result<Metadata> {
    // No sample depends on it, but a file that is damaged here may be so elsewhere.
    tags::AS_SHOT_NEUTRAL.numbers(file, &image.first, 4)?;
    let mut metadata = Metadata::new(QuantityKind::Adu);
    metadata.cfa = Some(if image.is_monochrome { FilterArray::Monochrome } else { filters(file, image, active)? });
    metadata.black_level_adu = levels.black;
    metadata.black_by_row.clone_from(&levels.black_by_row);
    metadata.black_by_column.clone_from(&levels.black_by_column);
    metadata.white_level_adu = Some(levels.white.into());
    // No sample depends on these.
    let below = passed_over(exif(file, &image.first), "its Exif", notes)?;
    let directories: Vec<&Directory> = std::iter::once(&image.first).chain(&below).collect();
    let mut of_exposure = Vec::new();
    let exposure = told_exposure(file, &directories, &mut of_exposure);
    ToldExposure::describe(passed_over(exposure, "its exposure", &mut of_exposure)?, &mut metadata);
    notes.extend(of_exposure.into_iter().filter(|_| !is_ours));
    metadata.iso_speed = passed_over(told_sensitivity(file, &directories), "its sensitivity", notes)?;
    // No sample depends on it either.
    let model = file.text(&image.first, tags::UNIQUE_CAMERA_MODEL.tag()).unwrap_or_default();
    metadata.camera =
        model.map(|model| visible(model.trim()).into_owned()).filter(|model| (1..=LONGEST_NAME).contains(&model.len()));
    metadata.relative_matrix = color::relative_matrix(file, image, notes)?;
    if levels.table.is_some() {
        notes.push("samples are made linear by its LinearizationTable".into());
    }
    if let Some((share, level)) = levels.linear() {
        notes.push(format!("above {level} ADU its samples may be far from linear (LinearResponseLimit {share})"));
    }
    metadata.orientation = told_orientation(tags::ORIENTATION.one(file, &image.first)?, notes);
    Ok(metadata)
}

/// A doubt of the black level of an image without one, which then is 0 \[DNG2023, BlackLevel], though what photosites read without light may
/// be something else.
pub(super) fn doubt_of_black(image: &RawImage, active: Rectangle) -> Option<&'static str> {
    let directory = image.directory();
    let is_masked = tags::MASKED_AREAS.is_in(directory) || active != Rectangle::whole(image.size);
    let doubt = if is_masked {
        "it has masked photosites and no BlackLevel, which by DNG is then 0; what they read comes off with `import-raw --crop full` and \
         `correct-frame --black border`; give a level that is known"
    } else {
        "it has no BlackLevel, which by DNG is then 0; give the black level where it is known"
    };
    (!tags::BLACK_LEVEL.is_in(directory)).then_some(doubt)
}

/// A doubt of levels that the first directory has instead of that of the raw image below it, where they belong \[DNG2023, ch. 4].
pub(super) fn doubt_of_place(image: &RawImage) -> Option<String> {
    let tags = [tags::BLACK_LEVEL, tags::WHITE_LEVEL, tags::LINEARIZATION_TABLE, tags::ACTIVE_AREA];
    let is_misplaced = |tag: &tags::DngTag| tag.is_in(&image.first) && !tag.is_in(image.directory());
    let misplaced: Vec<_> = tags.into_iter().filter(is_misplaced).map(|tag| tag.1).collect();
    (!misplaced.is_empty()).then(|| {
        format!(
            "its {} stands in its first directory, not in that of the raw image, where DNG has it: it does not count; correct its tags",
            misplaced.join(" and ")
        )
    })
}

/// A doubt of an image whose noise was reduced before it was stored \[DNG2023, NoiseReductionApplied]; none where that is not known.
///
/// # Errors
///
/// Those of the disk.
pub(super) fn doubt_of_noise(file: &mut TiffFile, image: &RawImage) -> Result<Option<String>> {
    let told = match tags::NOISE_REDUCTION_APPLIED.exactly::<1>(file, image.directory()) {
        // Ratios of zeros stand for what is not known.
        Err(Error::Format { .. }) => None,
        other => other?,
    };
    Ok(told.filter(|[share]| *share > 0.0).map(|[share]| {
        format!(
            "noise was taken out of its samples before they were stored (NoiseReductionApplied {share}): what is measured and predicted of \
             their noise is not that of the sensor; turn the camera's noise reduction of raw files off"
        )
    }))
}

/// The notes on the part of the image that is read.
///
/// # Errors
///
/// When the tags of the default crop are damaged.
pub(super) fn note_area(
    file: &mut TiffFile,
    image: &RawImage,
    active: Rectangle,
    read: Rectangle,
    notes: &mut Vec<String>,
) -> Result<()> {
    let [width, height] = image.size;
    if read != Rectangle::whole(image.size) {
        notes.push(format!("of {width}x{height} stored samples, {} are read", read.in_words()));
    } else if active != read {
        notes.push(format!("its active area is {}; what lies outside is read too", active.in_words()));
    }
    match area::default_crop(file, image, active)? {
        Ok(crop) if crop != active && crop != read => {
            notes.push(format!("its default crop, {}, is not applied", crop.in_words()));
        }
        Ok(_) => {}
        Err(problem) => notes.push(format!("{problem}; it is passed over")),
    }
    Ok(())
}

/// The filter array at the sensor's corner; the file has that at the corner of the active area \[DNG2023, CFAPattern].
fn filters(file: &mut TiffFile, image: &RawImage, active: Rectangle) -> Result<FilterArray> {
    let directory = image.directory();
    let layout = tags::CFA_LAYOUT.one(file, directory)?.unwrap_or(1);
    if layout != 1 {
        return Err(file.problem(format!(
            "its photosites stand in staggered rows or columns (CFALayout {layout}), which is not supported"
        )));
    }
    let Some([rows, columns]) = tags::CFA_REPEAT.whole::<2>(file, directory)? else {
        return Err(file.problem("it is damaged; it lacks CFARepeatPatternDim, the size of its filter array"));
    };
    // The periods that can be described; others are refused when the letters are read.
    let count = rows.saturating_mul(columns).min(1 << 16);
    let codes = tags::CFA_PATTERN.unsigned(file, directory, count as u64 + 1)?.unwrap_or_default();
    if codes.is_empty() || codes.len() != count {
        let found = if codes.len() > count { "more".to_owned() } else { codes.len().to_string() };
        return Err(file.problem(format!(
            "it is damaged; its CFAPattern has {found} filters, and CFARepeatPatternDim asks for {rows}x{columns}"
        )));
    }
    let planes = tags::CFA_PLANE_COLOR.unsigned(file, directory, 16)?.unwrap_or_else(|| vec![0, 1, 2]);
    let mut letters = String::with_capacity(count);
    for code in &codes {
        let letter = usize::try_from(*code).ok().and_then(|code| FILTERS.chars().nth(code));
        let Some(letter) = letter.filter(|_| planes.contains(code)) else {
            return Err(
                file.problem(format!("it is damaged; its CFAPattern has a filter {code} that it does not name"))
            );
        };
        letters.push(letter);
    }
    let first = [active.left, active.top].map(|place| place as i64);
    FilterArray::beginning_at(first, columns, rows, &letters).map_err(|_| {
        file.problem(format!(
            "its filter array has a period of {columns}x{rows} sites (CFARepeatPatternDim); up to 8x8 are supported"
        ))
    })
}

/// The directory of Exif.
fn exif(file: &mut TiffFile, first: &Directory) -> Result<Option<Directory>> {
    let Some(offset) = tags::EXIF.one(file, first)? else { return Ok(None) };
    file.directory_below(offset as u64).map(Some)
}

/// The sensitivity that the camera was set to, ISO. What 16 bits do not hold is 65535 in the one tag and stands in the other
/// \[Exif3, PhotographicSensitivity].
fn told_sensitivity(file: &mut TiffFile, directories: &[&Directory]) -> Result<Option<f64>> {
    const BEYOND: f64 = 65_535.0;
    let mut number = |tag: tags::DngTag| -> Result<Option<f64>> {
        let Some(directory) = directories.iter().find(|directory| tag.is_in(directory)) else { return Ok(None) };
        Ok(tag.numbers(file, directory, 1)?.map(|numbers| numbers[0]).filter(|number| *number > 0.0))
    };
    match number(tags::PHOTOGRAPHIC_SENSITIVITY)? {
        Some(BEYOND) => Ok(number(tags::ISO_SPEED)?.or(Some(BEYOND))),
        found => Ok(found),
    }
}

/// Exposure time and f-number, or the time alone.
fn told_exposure(
    file: &mut TiffFile,
    directories: &[&Directory],
    notes: &mut Vec<String>,
) -> Result<Option<ToldExposure>> {
    // Lenses without contacts leave zeros.
    let mut number = |tag: tags::DngTag| -> Result<Option<f64>> {
        let Some(directory) = directories.iter().find(|directory| tag.is_in(directory)) else { return Ok(None) };
        Ok(file.ratio(directory, tag.tag())?.filter(|number| *number > 0.0))
    };
    let (time, aperture) = (number(tags::EXPOSURE_TIME)?, number(tags::F_NUMBER)?);
    // Logarithms, rounded, which some files have alone: Tv = −log₂ t, Av = 2 log₂ N [Exif, Annex C].
    let mut of_logarithm = |known: Option<f64>, tag: tags::DngTag, factor: f64| -> Result<Option<f64>> {
        let directory = directories.iter().find(|directory| known.is_none() && tag.is_in(directory));
        let Some(directory) = directory else { return Ok(known) };
        let number = file.ratio(directory, tag.tag())?.map(|logarithm| (factor * logarithm).exp2());
        let number = number.filter(|number| *number > 0.0 && number.is_finite());
        if number.is_some() {
            notes.push(format!("its exposure is told by logarithms alone, which cameras round ({})", tag.1));
        }
        Ok(number)
    };
    let time = of_logarithm(time, tags::SHUTTER_SPEED_VALUE, -1.0)?;
    let aperture = of_logarithm(aperture, tags::APERTURE_VALUE, 0.5)?;
    Ok(exposure_of(time, aperture, notes))
}

/// The exposure of a raw file that tells so much of it; notes tell what is passed over.
pub(in crate::formats) fn exposure_of(
    exposure_s: Option<f64>,
    f_number: Option<f64>,
    notes: &mut Vec<String>,
) -> Option<ToldExposure> {
    let found = exposure::of_parts(exposure_s, f_number, ["ExposureTime", "FNumber"], notes);
    if matches!(found, Some(ToldExposure::Whole(_))) {
        notes.push("its lens is taken to lose no light: the file does not tell the transmittance".into());
    }
    found
}

/// The text of the first directory's ImageDescription.
///
/// # Errors
///
/// When it is damaged.
pub(super) fn description(file: &mut TiffFile, first: &Directory) -> Result<Option<String>> {
    file.text(first, Tag::ImageDescription)
}
