//! The matrix of a DNG for relative XYZ \[DNG2023, ch. 6].

use super::illuminants;
use super::image::RawImage;
use super::tags::{self, DngTag};
use crate::color;
use crate::color::calibration::{Calibration, Illuminated, Light};
use crate::error::{Error, Result};
use crate::formats::data::load_observer;
use crate::formats::files::open_named;
use crate::formats::register;
use crate::formats::tiff::TiffFile;
use crate::metadata::RelativeMatrix;
use crate::names::Named;
use nalgebra::Matrix3;
use std::path::Path;

/// The matrix for the light of the exposure, under the scene's own white; none where the file has none. Notes tell why one
/// that is there is passed over, and what of it does not count.
///
/// ColorMatrix counts, not ForwardMatrix, whose XYZ are adapted to D50.
///
/// # Errors
///
/// Those of the disk alone: no sample depends on it.
pub(super) fn relative_matrix(
    file: &mut TiffFile,
    image: &RawImage,
    notes: &mut Vec<String>,
) -> Result<Option<RelativeMatrix>> {
    if image.is_monochrome {
        return Ok(None);
    }
    if !has_matrix(image) {
        notes.extend(astray(image).map(|why| format!("its color matrix is passed over: {why}")));
        return Ok(None);
    }
    let found = match found(file, image, notes) {
        Err(Error::Format { problem, .. }) => Err(problem),
        other => other?,
    };
    match found {
        Ok(found) => {
            note_exposure(file, image, notes)?;
            Ok(Some(found))
        }
        Err(why) => {
            notes.push(format!("its color matrix is passed over: {why}"));
            Ok(None)
        }
    }
}

/// The matrix, or why it is passed over.
fn found(
    file: &mut TiffFile,
    image: &RawImage,
    notes: &mut Vec<String>,
) -> Result<std::result::Result<RelativeMatrix, String>> {
    // What is made for a picture is no scene any more.
    let reference = match tags::COLORIMETRIC_REFERENCE.one(file, &image.first) {
        Err(Error::Format { .. }) => None,
        other => other?,
    };
    if let Some(reference) = reference.filter(|reference| *reference != 0) {
        return Ok(Err(format!(
            "it leads to the colors of a picture, not of the scene (ColorimetricReference {reference})"
        )));
    }
    let light = match light(file, image)? {
        Ok(light) => light,
        Err(why) => {
            // What else may be wrong with them shows in any light.
            let others = mapped(file, image, Light::White(color::D65_XY), "d65", OwnMatrix::Color, &mut Vec::new())?;
            let advice =
                "`fit-matrix --from-raw FILE.dng --illuminant d65 -o m.yaml` makes one for a light that is named";
            return Ok(Err(others.map_or_else(|problem| problem, |_| format!("{why}; {advice}"))));
        }
    };
    mapped(file, image, light, "the white of the exposure", OwnMatrix::Color, notes)
}

/// The places of R, G and B in what a file tells of its classes; none of other classes \[DNG2023, CFAPlaneColor].
pub(super) fn plane_order(file: &mut TiffFile, image: &RawImage) -> Result<Option<[usize; 3]>> {
    let planes = tags::CFA_PLANE_COLOR.unsigned(file, image.directory(), 16)?.unwrap_or_else(|| vec![0, 1, 2]);
    let place = |class: u64| planes.iter().position(|plane| *plane == class);
    let [r, g, b] = [0, 1, 2].map(place);
    Ok((|| (planes.len() == 3).then_some([r?, g?, b?]))())
}

/// Whether there is a matrix for an illuminant.
fn has_matrix(image: &RawImage) -> bool {
    let [first, second, _] = tags::COLOR_MATRICES;
    [first, second].iter().any(|tag| tag.is_in(&image.first))
}

/// Why color matrices do not count that are there without ColorMatrix1 where it belongs.
fn astray(image: &RawImage) -> Option<&'static str> {
    let [.., third] = tags::COLOR_MATRICES;
    if third.is_in(&image.first) {
        Some("ColorMatrix1 is missing")
    } else if tags::COLOR_MATRICES.iter().any(|tag| tag.is_in(image.directory())) {
        Some("it stands in the directory of the samples, and counts in the first alone")
    } else {
        None
    }
}

/// Which of the matrices of a DNG.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OwnMatrix {
    /// ColorMatrix, to XYZ under the light itself.
    #[default]
    Color,
    /// ForwardMatrix, to XYZ adapted to D50.
    Forward,
}

impl Named for OwnMatrix {
    const ALL: &'static [Self] = &[Self::Color, Self::Forward];

    fn name(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Forward => "forward",
        }
    }
}

/// The matrix of a DNG for a light by its chromaticity and name, or for that of the exposure.
///
/// # Errors
///
/// [`Error::Format`] for files that are no DNG, and where they tell no such matrix; those of the disk.
pub fn own_matrix(path: &Path, light_named: Option<([f64; 2], String)>, which: OwnMatrix) -> Result<RelativeMatrix> {
    let (file, name) = open_named(Some(path))?;
    let mut file = TiffFile::open(file, &name)?;
    let image = RawImage::find(&mut file)?;
    if !has_matrix(&image) && !tags::DNG_VERSION.is_in(&image.first) {
        return Err(Error::format(&name, "it is no DNG, whose tags tell a color matrix"));
    }
    if image.is_monochrome {
        return Err(Error::format(&name, "it is monochrome, and has no colors"));
    }
    if !has_matrix(&image) {
        let why = astray(&image).map_or_else(String::new, |why| format!(": {why}"));
        return Err(Error::format(&name, format!("it tells no color matrix (ColorMatrix1){why}")));
    }
    let mut notes = Vec::new();
    let (light, named) = match light_named {
        Some((xy, named)) => (Ok(Light::White(xy)), named),
        None => (light(&mut file, &image)?, "the white of the exposure".into()),
    };
    let found = match light {
        Ok(light) => mapped(&mut file, &image, light, &named, which, &mut notes)?,
        Err(why) => Err(format!("{why}; name a light by --illuminant or --temperature")),
    };
    notes.into_iter().for_each(|note| register::doubt(format!("{name}: {note}")));
    found.map_err(|why| Error::format(&name, why))
}

/// The matrix for a light, or why there is none.
fn mapped(
    file: &mut TiffFile,
    image: &RawImage,
    light: Light,
    named: &str,
    which: OwnMatrix,
    notes: &mut Vec<String>,
) -> Result<std::result::Result<RelativeMatrix, String>> {
    // All of them have the signals in the order of CFAPlaneColor.
    let Some(order) = plane_order(file, image)? else {
        return Ok(Err("its classes are others than R, G and B (CFAPlaneColor)".into()));
    };
    let (calibration, first) = match calibration(file, image, notes)? {
        Ok(found) => found,
        Err(why) => return Ok(Err(why)),
    };
    let (tag, adapted) = match which {
        OwnMatrix::Color => ("ColorMatrix", "not adapted"),
        OwnMatrix::Forward => ("ForwardMatrix", "adapted to D50"),
    };
    let name = match (&calibration.second, &calibration.third) {
        (_, Some(_)) => format!("{tag}1, {tag}2 and {tag}3"),
        (Some(_), None) => format!("{tag}1 and {tag}2"),
        (None, None) => format!("{tag}{first}"),
    };
    let observer = load_observer()?;
    let mapped = match which {
        OwnMatrix::Color => calibration.mapped(&observer, light),
        OwnMatrix::Forward => calibration.mapped_forward(&observer, light),
    };
    Ok(mapped.map(|mapped| RelativeMatrix {
        xyz_from_camera: color::rows_of(&mapped.xyz_from_camera).map(|row| order.map(|place| row[place])),
        white_xy: mapped.white_xy,
        method: format!("{name} of the DNG, for {named}, {adapted}"),
    }))
}

/// The light of the exposure.
fn light(file: &mut TiffFile, image: &RawImage) -> Result<std::result::Result<Light, String>> {
    if let Some(neutral) = tags::AS_SHOT_NEUTRAL.exactly::<3>(file, &image.first)? {
        return Ok(Ok(Light::Neutral(neutral)));
    }
    let white = tags::AS_SHOT_WHITE_XY.exactly::<2>(file, &image.first)?;
    Ok(white
        .map(Light::White)
        .ok_or_else(|| "nothing tells the white of the exposure (AsShotNeutral or AsShotWhiteXY)".to_owned()))
}

/// The matrices for one illuminant, two or three, and the number of the first. Of two, one whose illuminant has no known temperature is passed
/// over, with a note; of two such the first counts, as Adobe's DNG SDK has it, and a third of an unknown illuminant does not.
fn calibration(
    file: &mut TiffFile,
    image: &RawImage,
    notes: &mut Vec<String>,
) -> Result<std::result::Result<(Calibration, usize), String>> {
    let directory = &image.first;
    let analog_balance = tags::ANALOG_BALANCE.exactly::<3>(file, directory)?.unwrap_or([1.0; 3]);
    if !analog_balance.iter().all(|gain| *gain > 0.0) {
        return Ok(Err("AnalogBalance has a number that is not above 0".into()));
    }
    match three(file, image, notes)? {
        Err(why) => return Ok(Err(why)),
        Ok(Some([first, second, third])) => {
            let (second, third) = (Some(second), Some(third));
            return Ok(Ok((Calibration { first, second, third, analog_balance }, 1)));
        }
        Ok(None) => {}
    }
    let sets = [illuminated(file, image, 0)?, illuminated(file, image, 1)?];
    let mut sets: Vec<(usize, Illuminated)> =
        (1..).zip(sets).filter_map(|(number, set)| Some((number, set?))).collect();
    let is_known = |(_, set): &(usize, Illuminated)| set.temperature_k != 0.0;
    if sets.len() > 1 && !sets.iter().all(is_known) {
        let why = if sets.iter().any(is_known) {
            sets.retain(is_known);
            "the temperature of the other's illuminant is not known"
        } else {
            sets.truncate(1);
            "the temperatures of the illuminants are not known, as of one alone"
        };
        let kept = sets[0].0;
        let tags = if sets[0].1.temperature_k == 0.0 {
            "CalibrationIlluminant1, CalibrationIlluminant2".to_owned()
        } else {
            format!("CalibrationIlluminant{}", 3 - kept)
        };
        notes.push(format!("its ColorMatrix{kept} counts alone: {why} ({tags})"));
    }
    let Some(((number, first), second)) = sets.split_first() else {
        return Ok(Err("it has no color matrix (ColorMatrix1)".into()));
    };
    let second = second.first().map(|(_, set)| *set);
    Ok(Ok((Calibration { first: *first, second, third: None, analog_balance }, *number)))
}

/// The matrices for three illuminants; none of fewer, or where that of the third is not known, with a note. Else why they do not count.
fn three(
    file: &mut TiffFile,
    image: &RawImage,
    notes: &mut Vec<String>,
) -> Result<std::result::Result<Option<[Illuminated; 3]>, String>> {
    let [.., third] = tags::COLOR_MATRICES;
    if !third.is_in(&image.first) {
        return Ok(Ok(None));
    }
    let mut sets = Vec::new();
    for index in 0..tags::COLOR_MATRICES.len() {
        let Some(set) = illuminated(file, image, index)? else {
            let missing = tags::COLOR_MATRICES[index].1;
            return Ok(Err(format!("it has one for a third illuminant (ColorMatrix3), but {missing} is missing")));
        };
        let white_xy = illuminants::white_of_illuminant(file, &image.first, index)?;
        sets.push(Illuminated { white_xy, ..set });
    }
    let whites: Vec<Option<[f64; 2]>> = sets.iter().map(|set| set.white_xy).collect();
    if let Some(unknown) = whites.iter().position(Option::is_none) {
        let tag = tags::CALIBRATION_ILLUMINANTS[unknown].1;
        notes.push(format!("its ColorMatrix3 does not count: nothing tells the light of one of the three ({tag})"));
        return Ok(Ok(None));
    }
    let [one, two, three] = [0, 1, 2].map(|index| whites[index]);
    if one == two || one == three || two == three {
        return Ok(Err("two of its three illuminants are one light (CalibrationIlluminant1 to 3)".into()));
    }
    Ok(Ok(<[Illuminated; 3]>::try_from(sets).ok()))
}

/// The matrices for the illuminant of an index (0, 1, 2); none without a color matrix. The temperature is 0 where it is not known.
fn illuminated(file: &mut TiffFile, image: &RawImage, index: usize) -> Result<Option<Illuminated>> {
    let directory = &image.first;
    let mut matrix = |tag: DngTag| -> Result<Option<Matrix3<f64>>> {
        Ok(tag.exactly::<9>(file, directory)?.map(|elements| Matrix3::from_row_slice(&elements)))
    };
    let Some(color_matrix) = matrix(tags::COLOR_MATRICES[index])? else { return Ok(None) };
    let forward_matrix = matrix(tags::FORWARD_MATRICES[index])?;
    let camera_calibration = matrix(tags::CAMERA_CALIBRATIONS[index])?;
    let mut signature = |tag: DngTag| file.text(directory, tag.tag());
    // Those of the camera count where the profile was made for them.
    let [of_camera, of_profile] = tags::CALIBRATION_SIGNATURES;
    let counts = signature(of_camera)?.unwrap_or_default() == signature(of_profile)?.unwrap_or_default();
    let camera_calibration = camera_calibration.filter(|_| counts).unwrap_or_else(Matrix3::identity);
    let temperature_k = illuminants::temperature_of(file, directory, index)?.unwrap_or(0.0);
    Ok(Some(Illuminated { temperature_k, white_xy: None, color_matrix, camera_calibration, forward_matrix }))
}

/// Notes what a converter would brighten its picture by.
fn note_exposure(file: &mut TiffFile, image: &RawImage, notes: &mut Vec<String>) -> Result<()> {
    let brighter = match tags::BASELINE_EXPOSURE.exactly::<1>(file, &image.first) {
        Err(Error::Format { .. }) => None,
        other => other?,
    };
    if let Some([stops]) = brighter.filter(|[stops]| *stops != 0.0) {
        notes.push(format!("its BaselineExposure of {stops} EV, a hint for pictures, is not applied"));
    }
    Ok(())
}
