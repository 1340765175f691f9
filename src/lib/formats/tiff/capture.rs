//! What the tags of an image tell of the camera: filter array, levels, exposure, as TIFF/EP, Exif and DNG have them.
//!
//! No sample depends on these tags. What is damaged, or of a kind that cannot be described here, is passed over with a note.

use super::directory::{Directory, TiffFile};
use super::layout::{Layout, PHOTOMETRIC_CFA, passed_over};
use crate::camera::levels::{BlackLevel, WhiteLevel};
use crate::cfa::{FILTERS, FilterArray};
use crate::error::Result;
use crate::formats::exposure::{self, ToldExposure};
use crate::formats::format::SampleType;
use crate::formats::register;
use crate::metadata::Metadata;
use crate::units::QuantityKind;
use tiff::tags::{PhotometricInterpretation, Tag};

/// CFARepeatPatternDim: rows and columns of the period.
const CFA_DIMENSIONS: Tag = Tag::Unknown(33421);
/// CFAPattern: the filters of the period, row by row.
const CFA_PATTERN: Tag = Tag::Unknown(33422);
/// ExposureTime in s, in the first directory (TIFF/EP) or in that of Exif.
const EXPOSURE_TIME: Tag = Tag::Unknown(33434);
/// FNumber, at the same places.
const F_NUMBER: Tag = Tag::Unknown(33437);
/// The directory of Exif.
const EXIF: Tag = Tag::Unknown(34665);
/// BlackLevelRepeatDim: rows and columns of the levels.
const BLACK_DIMENSIONS: Tag = Tag::Unknown(50713);
const BLACK_LEVEL: Tag = Tag::Unknown(50714);
/// What columns and rows add to the black level.
const BLACK_DELTAS: [Tag; 2] = [Tag::Unknown(50715), Tag::Unknown(50716)];
const WHITE_LEVEL: Tag = Tag::Unknown(50717);
const LINEARIZATION_TABLE: Tag = Tag::Unknown(50712);
/// ActiveArea: top, left, bottom, right; the pattern and the levels begin at its corner.
const ACTIVE_AREA: Tag = Tag::Unknown(50829);

/// Most sites of a period that is read.
const MOST_SITES: u64 = 64;

/// What the tags say, in the project's terms; what is passed over is told by the layout's notes.
///
/// A single plane behind filters that is stored in integers is one of ADU. Its black level stays unknown where no tag has it.
///
/// # Errors
///
/// [`crate::error::Error::Disk`] alone: damage is a note.
pub(super) fn read(file: &mut TiffFile, directory: &Directory, layout: &mut Layout) -> Result<Metadata> {
    let mut metadata = Metadata::new(QuantityKind::Unspecified);
    doubts(file, directory, layout)?;
    let notes = &mut layout.notes;
    let orientation = passed_over(file.one(directory, Tag::Orientation), "its Orientation", notes)?;
    metadata.orientation = told_orientation(orientation.and_then(|number| usize::try_from(number).ok()), notes);
    let exposure = passed_over(told_exposure(file, directory, notes), "its exposure", notes)?;
    ToldExposure::describe(exposure, &mut metadata);
    let is_cfa = [CFA_DIMENSIONS, CFA_PATTERN].iter().any(|tag| directory.has(*tag))
        || passed_over(file.one(directory, Tag::PhotometricInterpretation), "its color", notes)?
            == Some(PHOTOMETRIC_CFA);
    let channels = layout.geometry.channels.len();
    if !is_cfa {
        return Ok(metadata);
    }
    if channels != 1 {
        notes.push(format!("its tags of a color filter array are passed over: it has {channels} channels, not one"));
        return Ok(metadata);
    }
    let corner = passed_over(active_corner(file, directory), "its active area", notes)?;
    let [x, y] = layout.geometry.origin.map(i64::from);
    let first = [x + corner[0], y + corner[1]];
    metadata.cfa = passed_over(filters(file, directory, first), "its color filter array", notes)?;
    if is_integer(layout.stored) {
        metadata.quantity = QuantityKind::Adu;
        metadata.unit = QuantityKind::Adu.unit().into();
        metadata.black_level_adu = passed_over(black(file, directory, first), "its black level", notes)?;
        metadata.white_level_adu = passed_over(white(file, directory), "its white level", notes)?;
    }
    Ok(metadata)
}

/// Doubts of samples that tags give another meaning than the stored one, which counts.
fn doubts(file: &mut TiffFile, directory: &Directory, layout: &Layout) -> Result<()> {
    let photometric = file.one(directory, Tag::PhotometricInterpretation)?;
    let is_white_zero = photometric == Some(PhotometricInterpretation::WhiteIsZero.to_u16().into());
    let of_white = "its PhotometricInterpretation is 0, by which white is 0, and its samples count as they are stored, more for more \
                    light; invert them if 0 is white, or write 1 into the tag if not";
    let of_table = "its LinearizationTable is not applied: it has no DNGVersion, and is read as a TIFF; give it that tag, or apply the table";
    for (is_so, doubt) in
        [(is_white_zero && !layout.inverted, of_white), (directory.has(LINEARIZATION_TABLE), of_table)]
    {
        if is_so {
            register::doubt(file.problem(doubt).to_string());
        }
    }
    Ok(())
}

/// How a file says that its picture is turned, where it is; a note tells that nothing is turned here.
pub(in crate::formats) fn told_orientation(number: Option<usize>, notes: &mut Vec<String>) -> Option<u16> {
    let found = number.and_then(|number| u16::try_from(number).ok()).filter(|number| (2..=8).contains(number));
    if let Some(number) = found {
        notes.push(format!(
            "rows and columns stay those that are stored: its Orientation, {number}, is kept for a DNG that is made of it"
        ));
    }
    found
}

fn is_integer(stored: SampleType) -> bool {
    !matches!(stored, SampleType::F16 | SampleType::F32 | SampleType::F64)
}

/// Exposure time and f-number, or the time alone; the transmittance of the lens, which no tag has, is 1.
pub(super) fn told_exposure(
    file: &mut TiffFile,
    directory: &Directory,
    notes: &mut Vec<String>,
) -> Result<Option<ToldExposure>> {
    let below = passed_over(file.below(directory, EXIF), "its Exif", notes)?;
    let mut found = [None; 2];
    for directory in [Some(directory), below.as_ref()].into_iter().flatten() {
        for (value, tag) in found.iter_mut().zip([EXPOSURE_TIME, F_NUMBER]) {
            if value.is_none() {
                // Lenses without contacts leave zeros, and cameras that do not know the time.
                *value = file.ratio(directory, tag)?.filter(|number| *number > 0.0);
            }
        }
    }
    Ok(exposure::of_parts(found[0], found[1], ["ExposureTime", "FNumber"], notes))
}

/// Left and top of the active area; [0, 0] where none is named.
fn active_corner(file: &mut TiffFile, directory: &Directory) -> Result<[i64; 2]> {
    let corner = file.unsigned(directory, ACTIVE_AREA, 2)?.unwrap_or_default();
    let [top, left] = [0, 1].map(|at| corner.get(at).and_then(|number| i64::try_from(*number).ok()).unwrap_or(0));
    Ok([left, top])
}

/// The array that begins at the photosite `first` of the sensor.
///
/// # Errors
///
/// Where the tags are damaged, one of them is missing, or the array is of a kind that cannot be described.
fn filters(file: &mut TiffFile, directory: &Directory, first: [i64; 2]) -> Result<Option<FilterArray>> {
    let size = file.unsigned(directory, CFA_DIMENSIONS, 3)?.filter(|size| size.len() == 2);
    let pattern = file.numbers(directory, CFA_PATTERN, MOST_SITES + 1)?;
    let (Some(size), Some(pattern)) = (size, pattern) else {
        return Err(file.problem("its tags do not say which filters stand where"));
    };
    let side = |at: usize| size.get(at).and_then(|side| usize::try_from(*side).ok()).unwrap_or(0);
    let letter = |code: f64| {
        (0_u8..).zip(FILTERS.chars()).find(|(number, _)| f64::from(*number) == code).map(|(_, letter)| letter)
    };
    let Some(letters) = pattern.iter().map(|code| letter(*code)).collect::<Option<String>>() else {
        return Err(file.problem("it has filters of a kind that is not known"));
    };
    let (rows, columns) = (side(0), side(1));
    FilterArray::beginning_at(first, columns, rows, &letters).map(Some).map_err(|_| {
        file.problem(format!("a period of {columns}x{rows} sites in {} numbers cannot be described", letters.len()))
    })
}

/// The black level by the sites at the sensor's corner; of `first` on the levels repeat.
fn black(file: &mut TiffFile, directory: &Directory, first: [i64; 2]) -> Result<Option<BlackLevel>> {
    let Some(levels) = file.numbers(directory, BLACK_LEVEL, MOST_SITES + 1)? else { return Ok(None) };
    if BLACK_DELTAS.iter().any(|tag| directory.has(*tag)) {
        return Err(file.problem("it differs among rows or columns, which is read of a DNG alone"));
    }
    let size = file.unsigned(directory, BLACK_DIMENSIONS, 3)?.unwrap_or_else(|| vec![1, 1]);
    let (rows, columns) = match size[..] {
        [rows @ 1..=2, columns @ 1..=2] if rows * columns == levels.len() as u64 => (rows, columns),
        _ => return Err(file.problem(format!("{} levels do not repeat after two rows and columns", levels.len()))),
    };
    if let Some(level) = levels.iter().find(|level| !level.is_finite()) {
        return Err(file.problem(format!("it is {level}")));
    }
    let place = |at: i64, first: i64, period: u64| (at - first).rem_euclid(period.cast_signed()).cast_unsigned();
    let level = |x: i64, y: i64| {
        let site = place(y, first[1], rows) * columns + place(x, first[0], columns);
        usize::try_from(site).ok().and_then(|site| levels.get(site).copied()).unwrap_or(f64::NAN)
    };
    let sites = BlackLevel::Sites([level(0, 0), level(1, 0), level(0, 1), level(1, 1)]);
    Ok(Some(sites.uniform().map_or(sites, BlackLevel::Uniform)))
}

/// The largest code.
fn white(file: &mut TiffFile, directory: &Directory) -> Result<Option<WhiteLevel>> {
    let Some(levels) = file.numbers(directory, WHITE_LEVEL, 2)? else { return Ok(None) };
    match levels[..] {
        [level] if level > 0.0 && level.is_finite() => Ok(Some(WhiteLevel::Uniform(level))),
        _ => Err(file.problem("it is no single number above 0")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::optics::Exposure;
    use crate::cfa::CfaPattern;
    use crate::formats::format::SampleReader;
    use crate::formats::tiff::{
        ExtraTag, TagValue, TiffCompression, TiffReader, TiffSamples, TiffSettings, TiffTags, TiffWriter,
    };
    use crate::frame::Geometry;
    use std::io::{Cursor, Write};

    fn pattern(rows: u16, columns: u16, filters: &[u8]) -> Vec<(u16, TagValue)> {
        vec![(33421, TagValue::Shorts(vec![rows, columns])), (33422, TagValue::Bytes(filters.to_vec()))]
    }

    /// What a frame of 4x4 pixels with these tags tells, and the notes.
    fn told(geometry: &Geometry, samples: TiffSamples, tags: &[(u16, TagValue)]) -> (Metadata, Vec<String>) {
        let extra = tags.iter().map(|(number, value)| ExtraTag { number: *number, value: value.clone() }).collect();
        let (compression, tags) = (TiffCompression::None, TiffTags::default());
        let settings = TiffSettings { samples, scale: 1.0, compression, tags, extra, exif: Vec::new() };
        let mut writer = TiffWriter::create(Cursor::new(Vec::new()), "out.tif", geometry, settings).unwrap();
        writer.write_rows(&vec![7.0; geometry.row_samples() * geometry.height]).unwrap();
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&writer.finish().unwrap().0.into_inner()).unwrap();
        let reader = TiffReader::open(file, "in.tif", 0).unwrap();
        (reader.own_tags().clone(), reader.notes().to_vec())
    }

    fn plane() -> Geometry {
        Geometry::new(4, 4, &["Y"])
    }

    #[test]
    fn a_plane_behind_filters_is_one_of_codes() {
        let tags = [
            pattern(2, 2, &[1, 0, 2, 1]),
            vec![
                (33434, TagValue::Ratios(vec![[1, 250]])),
                (33437, TagValue::Ratios(vec![[28, 10]])),
                (50713, TagValue::Shorts(vec![2, 2])),
                (50714, TagValue::Ratios(vec![[64, 1], [65, 1], [66, 1], [67, 1]])),
                (50717, TagValue::Longs(vec![4095])),
            ],
        ]
        .concat();
        let (metadata, notes) = told(&plane(), TiffSamples::U16, &tags);
        assert_eq!(notes, [""; 0]);
        assert_eq!(metadata.quantity, QuantityKind::Adu);
        assert_eq!(metadata.cfa, Some(CfaPattern::Grbg.into()));
        assert_eq!(metadata.black_level_adu, Some(BlackLevel::Sites([64.0, 65.0, 66.0, 67.0])));
        assert_eq!(metadata.white_level_adu, Some(4095.0.into()));
        let exposure = Exposure { exposure_s: 0.004, f_number: 2.8, lens_transmittance: 1.0 };
        assert_eq!(metadata.exposure, Some(exposure));
        // Elsewhere on the sensor the same sites have other places, and nothing is known that no tag says.
        let elsewhere = Geometry { origin: [1, 2], ..plane() };
        let metadata = told(&elsewhere, TiffSamples::U16, &tags).0;
        assert_eq!(metadata.cfa, Some(CfaPattern::Rggb.into()));
        assert_eq!(metadata.black_level_adu, Some(BlackLevel::Sites([65.0, 64.0, 67.0, 66.0])));
        let metadata = told(&plane(), TiffSamples::U16, &pattern(2, 2, &[0, 1, 1, 2])).0;
        assert_eq!((metadata.black_level_adu, metadata.white_level_adu, metadata.exposure), (None, None, None));
        // An active area moves the corner, floats are of unknown quantity.
        let area = [pattern(2, 2, &[0, 1, 1, 2]), vec![(50829, TagValue::Longs(vec![1, 0, 4, 4]))]].concat();
        assert_eq!(told(&plane(), TiffSamples::U16, &area).0.cfa, Some(CfaPattern::Gbrg.into()));
        let metadata = told(&plane(), TiffSamples::F32, &pattern(2, 2, &[0, 1, 1, 2])).0;
        assert_eq!((metadata.quantity, metadata.cfa), (QuantityKind::Unspecified, Some(CfaPattern::Rggb.into())));
    }

    #[test]
    fn turned_pictures_say_so_and_times_of_zero_are_none() {
        let tags = [(274, TagValue::Shorts(vec![6])), (33434, TagValue::Ratios(vec![[0, 1]]))];
        let (metadata, notes) = told(&plane(), TiffSamples::U16, &[&pattern(2, 2, &[0, 1, 1, 2]), &tags[..]].concat());
        assert_eq!((metadata.orientation, metadata.exposure_time_s), (Some(6), None));
        assert!(notes.concat().contains("its Orientation, 6, is kept"), "{notes:?}");
    }

    #[test]
    fn other_arrays_are_described_or_passed_over() {
        let x_trans: Vec<u8> = "GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG"
            .bytes()
            .filter_map(|letter| FILTERS.bytes().position(|filter| filter == letter))
            .map(|code| u8::try_from(code).unwrap())
            .collect();
        let (metadata, notes) = told(&plane(), TiffSamples::U16, &pattern(6, 6, &x_trans));
        assert_eq!(notes, [""; 0]);
        assert_eq!(metadata.cfa.unwrap().in_words(), "an X-Trans filter array");
        for (tags, why) in [
            (pattern(2, 2, &[0, 1, 1, 9]), "it has filters of a kind that is not known"),
            (pattern(2, 2, &[0, 1, 1]), "a period of 2x2 sites in 3 numbers cannot be described"),
            (pattern(9, 1, &[0; 9]), "a period of 1x9 sites in 9 numbers cannot be described"),
            (vec![(33421, TagValue::Shorts(vec![2, 2]))], "its tags do not say which filters stand where"),
        ] {
            let (metadata, notes) = told(&plane(), TiffSamples::U16, &tags);
            assert_eq!((metadata.cfa, metadata.quantity), (None, QuantityKind::Adu));
            assert_eq!(notes, [format!("its color filter array is passed over: {why}")]);
        }
        let three = Geometry::new(4, 4, &["R", "G", "B"]);
        let (metadata, notes) = told(&three, TiffSamples::U16, &pattern(2, 2, &[0, 1, 1, 2]));
        assert_eq!((metadata.cfa, metadata.quantity), (None, QuantityKind::Unspecified));
        assert_eq!(notes, ["its tags of a color filter array are passed over: it has 3 channels, not one"]);
    }

    #[test]
    fn levels_and_exposures_that_say_too_little_are_passed_over() {
        let note = |tags: &[(u16, TagValue)]| {
            let (metadata, notes) = told(&plane(), TiffSamples::U16, &[&pattern(2, 2, &[0, 1, 1, 2]), tags].concat());
            assert_eq!((metadata.black_level_adu, metadata.white_level_adu, metadata.exposure), (None, None, None));
            notes.concat()
        };
        let black = (50714, TagValue::Longs(vec![64]));
        for (tags, wanted) in [
            (
                vec![black, (50715, TagValue::SignedRatios(vec![[1, 2]; 4]))],
                "its black level is passed over: it differs",
            ),
            (vec![(50714, TagValue::Longs(vec![1, 2, 3]))], "its black level is passed over: 3 levels do not repeat"),
            (vec![(50714, TagValue::Ratios(vec![[1, 0]]))], "its black level is passed over: it is inf"),
            (vec![(50717, TagValue::Longs(vec![0]))], "its white level is passed over: it is no single number above 0"),
            (
                vec![(33434, TagValue::Ratios(vec![[1, 8]]))],
                "its exposure time of 0.125 s tells dark frames apart and no more: it has no f-number (FNumber)",
            ),
            (
                vec![(33437, TagValue::Ratios(vec![[8, 1]]))],
                "its f-number of 8 is passed over: it has no exposure time (ExposureTime)",
            ),
            (
                vec![(33434, TagValue::Ratios(vec![[1, 8]])), (33437, TagValue::Ratios(vec![[0, 1]]))],
                "its exposure time of 0.125 s tells dark frames apart and no more: it has no f-number (FNumber)",
            ),
            (vec![(34665, TagValue::Longs(vec![9_999_999]))], "its Exif is passed over: the table of tags lies beyond"),
        ] {
            let found = note(&tags);
            assert!(found.starts_with(wanted), "{found}");
        }
    }
}
