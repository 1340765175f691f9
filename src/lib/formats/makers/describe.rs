//! What a decoded file tells of a frame, checked, in the project's terms.

use super::wire::{Black, Head};
use super::{INSTEAD, wire};
use crate::camera::levels::BlackLevel;
use crate::cfa::FilterArray;
use crate::color;
use crate::color::calibration::{Calibration, Illuminated, Light};
use crate::error::{Error, Result};
use crate::formats::data::load_observer;
use crate::formats::dng::{RawArea, Rectangle, exposure_of, temperature_k};
use crate::formats::exposure::ToldExposure;
use crate::formats::tiff::told_orientation;
use crate::metadata::{Metadata, RelativeMatrix};
use crate::text::visible;
use crate::units::QuantityKind;
use nalgebra::Matrix3;

/// Most photosites beside or below each other; a sensor has no more.
const MOST_PHOTOSITES: usize = 1 << 20;
/// Most sites beside or below each other after which black levels repeat.
const MOST_SITES: usize = 64;
/// The largest code that 16 bits hold.
const LARGEST_CODE: f64 = 65535.0;

/// A frame of a decoded file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Described {
    /// The part that is read.
    pub area: Rectangle,
    pub metadata: Metadata,
    pub notes: Vec<String>,
}

/// What a head tells of a part of the file that the user calls `name`.
///
/// # Errors
///
/// [`Error::Format`] where the file holds what no sensor records, or its head is none of an image.
pub(super) fn describe(head: &Head, name: &str, part: RawArea) -> Result<Described> {
    let refuse = |problem: String| Error::format(name, problem);
    let Head { width, height, .. } = *head;
    if !(1..=MOST_PHOTOSITES).contains(&width) || !(1..=MOST_PHOTOSITES).contains(&height) {
        return Err(refuse(format!("it is damaged; it says that it has {width}x{height} samples, and no sensor has")));
    }
    if head.samples_per_site != 1 {
        return Err(refuse(format!(
            "it holds {} samples at each photosite: a reduced raw (sRAW, mRAW) or planes that are demosaicked, not what the sensor recorded; record full raws",
            head.samples_per_site
        )));
    }
    if head.rotated {
        return Err(refuse(format!("the rows of its sensor run at 45 degrees, which is not supported; {INSTEAD}")));
    }
    let mut notes = vec![format!("it is of a {}", head.camera)];
    let cfa = match &head.filters {
        None => FilterArray::Monochrome,
        Some(wire::Filters { columns, rows, letters }) => FilterArray::beginning_at([0, 0], *columns, *rows, letters)
            .map_err(|_| {
            refuse(format!("its filter array has a period of {columns}x{rows} sites; up to 8x8 are supported"))
        })?,
    };
    let (black, white) = levels(head).map_err(refuse)?;
    let area = area(head, part, &mut notes).map_err(refuse)?;
    let mut metadata = Metadata::new(QuantityKind::Adu);
    metadata.cfa = Some(cfa);
    metadata.camera = Some(visible(&head.camera).into_owned());
    metadata.black_level_adu = Some(black);
    metadata.white_level_adu = Some(white.into());
    let positive = |number: Option<f64>| number.filter(|number| *number > 0.0 && number.is_finite());
    let exposure = exposure_of(positive(head.exposure_s), positive(head.f_number), &mut notes);
    ToldExposure::describe(exposure, &mut metadata);
    metadata.relative_matrix = relative_matrix(head, cfa, &mut notes)?;
    metadata.iso_speed = head.iso.map(f64::from);
    metadata.orientation = told_orientation(head.orientation.map(usize::from), &mut notes);
    if head.images > 1 {
        notes.push(format!("of its {} raw images the first is read", head.images));
    }
    Ok(Described { area, metadata, notes })
}

/// Black and white level.
fn levels(head: &Head) -> std::result::Result<(BlackLevel, f64), String> {
    let Black { columns, rows, levels } = &head.black;
    if ![columns, rows].iter().all(|side| (1..=MOST_SITES).contains(*side)) {
        return Err(format!("its black level repeats after {columns}x{rows} sites; levels of 2x2 sites are supported"));
    }
    let black = BlackLevel::repeating(*columns, *rows, levels);
    let Some(black) = black else {
        return Err(format!("its black level differs by {columns}x{rows} sites; levels of 2x2 sites are supported"));
    };
    let Some((white, others)) = head.white.split_first() else { return Err("it tells no white level".into()) };
    if others.iter().any(|other| other != white) {
        return Err("its white levels differ, and it does not tell of which photosites each is".into());
    }
    let highest = black.sites().into_iter().fold(f64::NEG_INFINITY, f64::max);
    let is_level = |level: f64| (0.0..=LARGEST_CODE).contains(&level);
    if !(black.sites().into_iter().all(is_level) && is_level(*white) && highest < *white) {
        return Err(format!("its black level, {highest}, and its white level, {white}, are none of codes of 16 bits"));
    }
    Ok((black, *white))
}

/// The part that is read.
fn area(head: &Head, part: RawArea, notes: &mut Vec<String>) -> std::result::Result<Rectangle, String> {
    let size = [head.width, head.height];
    let whole = Rectangle::whole(size);
    let inside = |area: Option<[usize; 4]>, what: &str| match area {
        None => Ok(None),
        Some([left, top, width, height]) => {
            let fits =
                |from: usize, side: usize, all: usize| side > 0 && from.checked_add(side).is_some_and(|end| end <= all);
            let area = Rectangle { left, top, width, height };
            if fits(left, width, size[0]) && fits(top, height, size[1]) {
                return Ok(Some(area));
            }
            Err(format!(
                "its {what}, {}, does not lie in the {}x{} samples that are stored",
                area.in_words(),
                size[0],
                size[1]
            ))
        }
    };
    let active = inside(head.active, "active area")?.unwrap_or(whole);
    let crop = match inside(head.default_crop, "default crop") {
        Ok(crop) => crop,
        Err(why) if part == RawArea::Default => return Err(why),
        Err(why) => {
            notes.push(format!("{why}; it is passed over"));
            None
        }
    };
    let area = match part {
        RawArea::Active => active,
        RawArea::Full => whole,
        RawArea::Default => crop.unwrap_or(active),
    };
    if area != whole {
        notes.push(format!("of {}x{} stored samples, {} are read", size[0], size[1], area.in_words()));
    } else if active != area {
        notes.push(format!("its active area is {}; what lies outside is read too", active.in_words()));
    }
    if let Some(crop) = crop.filter(|crop| *crop != active && *crop != area) {
        notes.push(format!("its default crop, {}, is not applied", crop.in_words()));
    }
    Ok(area)
}

/// The matrix for the light of the exposure, under the scene's own white; none where the file tells none. Notes tell why.
fn relative_matrix(head: &Head, cfa: FilterArray, notes: &mut Vec<String>) -> Result<Option<RelativeMatrix>> {
    if head.matrices.is_empty() || !cfa.has_three_classes() {
        return Ok(None);
    }
    let observer = load_observer()?;
    let found = calibration(head).and_then(|calibration| calibration.mapped(&observer, neutral(head)?));
    match found {
        Ok(mapped) => Ok(Some(RelativeMatrix {
            xyz_from_camera: color::rows_of(&mapped.xyz_from_camera),
            white_xy: mapped.white_xy,
            method: "color matrices of the camera's model in rawler, for the white of the exposure, not adapted".into(),
        })),
        Err(why) => {
            notes.push(format!("its color matrix is passed over: {why}"));
            Ok(None)
        }
    }
}

/// The matrices for the lowest and the highest of the temperatures that are known, or the one there is.
fn calibration(head: &Head) -> std::result::Result<Calibration, String> {
    let is_one = |elements: &[f64]| elements.len() == 9 && elements.iter().all(|element| element.is_finite());
    let set = |(illuminant, elements): &(u16, Vec<f64>)| Illuminated {
        temperature_k: temperature_k((*illuminant).into()).unwrap_or(0.0),
        white_xy: None,
        color_matrix: Matrix3::from_row_slice(elements),
        camera_calibration: Matrix3::identity(),
        forward_matrix: None,
    };
    let mut sets: Vec<Illuminated> = head.matrices.iter().filter(|(_, matrix)| is_one(matrix)).map(set).collect();
    if sets.len() > 1 {
        sets.retain(|set| set.temperature_k > 0.0);
    }
    sets.sort_by(|a, b| a.temperature_k.total_cmp(&b.temperature_k));
    let [first, .., last] = sets.as_slice() else {
        let one = sets.first().ok_or("no matrix of it is one of three classes for an illuminant with a temperature")?;
        return Ok(Calibration { first: *one, second: None, third: None, analog_balance: [1.0; 3] });
    };
    Ok(Calibration { first: *first, second: Some(*last), third: None, analog_balance: [1.0; 3] })
}

/// The signals of white, by what they are multiplied with to be alike.
fn neutral(head: &Head) -> std::result::Result<Light, String> {
    match head.white_balance {
        [Some(red), Some(green), Some(blue)] if [red, green, blue].iter().all(|factor| *factor > 0.0) => {
            Ok(Light::Neutral([red, green, blue].map(|factor| green / factor)))
        }
        _ => Err("nothing tells the white of the exposure (white balance as shot)".into()),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cfa::Class;

    /// A head of 6x4 samples.
    pub(in crate::formats::makers) fn head() -> Head {
        Head {
            width: 6,
            height: 4,
            samples_per_site: 1,
            rotated: false,
            filters: Some(wire::Filters { columns: 2, rows: 2, letters: "GRBG".into() }),
            black: Black { columns: 2, rows: 2, levels: vec![1.0, 2.0, 3.0, 4.5] },
            white: vec![4095.0],
            active: Some([1, 1, 4, 3]),
            default_crop: Some([2, 1, 2, 2]),
            camera: "Nikon D700".into(),
            matrices: vec![
                (21, vec![0.8, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.9]),
                (17, vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.7]),
            ],
            white_balance: [Some(2.0), Some(1.0), Some(1.5)],
            exposure_s: Some(0.004),
            f_number: Some(5.6),
            iso: Some(200),
            orientation: Some(6),
            images: 1,
        }
    }

    fn described(head: &Head, part: RawArea) -> Described {
        describe(head, "a.nef", part).unwrap()
    }

    #[test]
    fn a_head_becomes_metadata_at_the_corner_of_the_stored_image() {
        let head = head();
        for (part, [left, top, width, height]) in
            [(RawArea::Active, [1, 1, 4, 3]), (RawArea::Full, [0, 0, 6, 4]), (RawArea::Default, [2, 1, 2, 2])]
        {
            let Described { area, metadata, notes } = described(&head, part);
            assert_eq!(area, Rectangle { left, top, width, height });
            // Whatever part is read, pattern and levels are those at the corner.
            let cfa = metadata.cfa.unwrap();
            assert_eq!(
                [cfa.class(0, 0), cfa.class(1, 0), cfa.class(0, 1)],
                [Class::Green, Class::Red, Class::Blue].map(Some)
            );
            assert_eq!(metadata.black_level_adu, Some(BlackLevel::Sites([1.0, 2.0, 3.0, 4.5])));
            assert_eq!(metadata.white_level_adu, Some(4095.0.into()));
            assert_eq!(metadata.exposure.map(|exposure| exposure.f_number), Some(5.6));
            assert_eq!(metadata.iso_speed, Some(200.0));
            let said = notes.join("\n");
            assert!(["Nikon D700", "its Orientation, 6, is kept"].iter().all(|text| said.contains(text)), "{said}");
        }
    }

    /// With matrices that are diagonal, and alike for both illuminants, XYZ of white are what the signals of white are divided
    /// by: X : Y : Z = (1/2)/a : 1/b : (1/1.5)/c.
    #[test]
    fn the_matrix_is_that_of_the_white_of_the_exposure() {
        let [a, b, c] = [0.8, 1.0, 0.9];
        let diagonal = vec![a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c];
        let same = Head { matrices: vec![(21, diagonal.clone()), (17, diagonal)], ..head() };
        let found = described(&same, RawArea::Active).metadata.relative_matrix.unwrap();
        let xyz = [0.5 / a, 1.0 / b, 1.0 / 1.5 / c];
        let sum: f64 = xyz.iter().sum();
        assert!((found.white_xy[0] - xyz[0] / sum).abs() < 1e-12 && (found.white_xy[1] - xyz[1] / sum).abs() < 1e-12);
        let none = Head { white_balance: [None; 3], ..head() };
        let Described { metadata, notes, .. } = described(&none, RawArea::Active);
        assert_eq!(metadata.relative_matrix, None);
        assert!(notes.iter().any(|note| note.contains("nothing tells the white of the exposure")), "{notes:?}");
    }

    #[test]
    fn other_arrays_are_taken_as_they_are() {
        let x_trans = "RBGBRGGGRGGBGGBGGRBRGRBGGGBGGRGGRGGB";
        let filters = Some(wire::Filters { columns: 6, rows: 6, letters: x_trans.into() });
        let black = Black { columns: 6, rows: 6, levels: vec![1024.0; 36] };
        let metadata = described(&Head { filters, black, ..head() }, RawArea::Active).metadata;
        assert_eq!(metadata.cfa.unwrap().in_words(), "an X-Trans filter array");
        assert_eq!(metadata.black_level_adu, Some(1024.0.into()));
        let quad = Some(wire::Filters { columns: 4, rows: 4, letters: "RRGGRRGGGGBBGGBB".into() });
        let metadata = described(&Head { filters: quad, ..head() }, RawArea::Active).metadata;
        assert_eq!(metadata.cfa.unwrap().in_words(), "a quad Bayer filter array");
        let metadata = described(&Head { filters: None, ..head() }, RawArea::Active).metadata;
        assert_eq!((metadata.cfa, metadata.relative_matrix), (Some(FilterArray::Monochrome), None));
    }

    #[test]
    fn what_is_no_raw_image_is_refused() {
        let black = |columns, rows, levels: &[f64]| Black { columns, rows, levels: levels.to_vec() };
        for (head, wanted) in [
            (Head { width: 0, ..head() }, "it is damaged; it says that it has 0x4 samples"),
            (Head { height: usize::MAX, ..head() }, "it is damaged; it says that it has 6x18446744073709551615"),
            (
                Head { samples_per_site: 3, ..head() },
                "it holds 3 samples at each photosite: a reduced raw (sRAW, mRAW) or planes",
            ),
            (Head { rotated: true, ..head() }, "the rows of its sensor run at 45 degrees"),
            (
                Head { filters: Some(wire::Filters { columns: 12, rows: 12, letters: "G".repeat(144) }), ..head() },
                "its filter array has a period of 12x12 sites",
            ),
            (
                Head { filters: Some(wire::Filters { columns: 2, rows: 2, letters: "RG".into() }), ..head() },
                "its filter array has a period of 2x2 sites",
            ),
            (Head { black: black(3, 1, &[1.0, 2.0, 3.0]), ..head() }, "its black level differs by 3x1 sites"),
            (Head { black: black(0, 0, &[]), ..head() }, "its black level repeats after 0x0 sites"),
            (Head { black: black(2, 2, &[1.0]), ..head() }, "its black level differs by 2x2 sites"),
            (Head { black: black(1, 1, &[f64::NAN]), ..head() }, "its black level"),
            (
                Head { black: black(1, 1, &[4095.0]), ..head() },
                "its black level, 4095, and its white level, 4095, are none",
            ),
            (Head { white: vec![], ..head() }, "it tells no white level"),
            (Head { white: vec![1e9], ..head() }, "its black level, 4.5, and its white level, 1000000000, are none"),
            (Head { white: vec![9.0, 10.0], ..head() }, "its white levels differ"),
            (
                Head { active: Some([0, 0, 7, 4]), ..head() },
                "its active area, 7x4 from column 0, row 0, does not lie in the 6x4",
            ),
            (
                Head { active: Some([usize::MAX, 0, 7, 4]), ..head() },
                "its active area, 7x4 from column 18446744073709551615",
            ),
            (Head { active: Some([0, 0, 0, 4]), ..head() }, "its active area, 0x4"),
        ] {
            let complaint = describe(&head, "a.nef", RawArea::Active).unwrap_err().to_string();
            assert!(complaint.starts_with(&format!("a.nef: {wanted}")), "{complaint}");
        }
        let crop = Head { default_crop: Some([5, 0, 2, 4]), ..head() };
        assert!(described(&crop, RawArea::Active).notes.iter().any(|note| note.ends_with("; it is passed over")));
        assert!(describe(&crop, "a.nef", RawArea::Default).is_err());
    }
}
