//! Which of a DNG's images is the raw one.

use super::tags::{self, DngTag};
use crate::error::Result;
use crate::formats::tiff::{Directory, TiffFile};
use crate::metadata::METADATA_BEGIN;
use tiff::tags::Tag;

/// Photometric interpretation of a plane behind a color filter array.
pub(super) const CFA: u16 = 32803;
/// That of demosaicked planes, or of one plane without a filter array.
pub(super) const LINEAR_RAW: u16 = 34892;
/// That of gray.
const BLACK_IS_ZERO: u16 = 1;
/// Directories that a raw file may have below its first: images of any size, masks, depth.
const MOST_DIRECTORIES: u64 = 64;
/// Most photosites beside or below each other; a sensor has no more.
const MOST_PHOTOSITES: usize = 1 << 20;
/// What Software begins with in files that are written here.
const SOFTWARE: &str = "cyanometer ";
/// The version of the specification that is followed \[DNG2023].
const VERSION: [usize; 4] = [1, 7, 1, 0];

/// The raw image of a file.
#[derive(Debug)]
pub(super) struct RawImage {
    /// The file's first directory, which tells what holds for all of its images.
    pub first: Directory,
    /// That of the raw image, where it is another.
    below: Option<Directory>,
    /// Whether it has no filter array.
    pub is_monochrome: bool,
    /// Columns and rows that are stored.
    pub size: [usize; 2],
    /// The version of the specification that the file was written by.
    pub version: [usize; 4],
}

/// What an image in the file is.
enum Kind {
    /// A raw one that can be read.
    Raw { is_monochrome: bool, size: [usize; 2] },
    /// Three planes or more that were raw once.
    Demosaicked,
    /// A smaller one, a mask, or a picture.
    Other,
}

impl RawImage {
    /// Finds the largest raw image of full resolution, in the first directory or right below it \[DNG2023, ch. 2].
    ///
    /// # Errors
    ///
    /// When the file is damaged, asks for a reader of a later specification, or holds no such image.
    pub fn find(file: &mut TiffFile) -> Result<Self> {
        let first = file.directory(0)?;
        let version = version(file, &first)?;
        let offsets = tags::SUB_IFDS.unsigned(file, &first, MOST_DIRECTORIES)?.unwrap_or_default();
        let mut kinds = vec![(None, Kind::of(file, &first)?)];
        for offset in offsets {
            let directory = file.directory_below(offset)?;
            let kind = Kind::of(file, &directory)?;
            kinds.push((Some(directory), kind));
        }
        let was_demosaicked = kinds.iter().any(|(_, kind)| matches!(kind, Kind::Demosaicked));
        let raws = kinds.into_iter().filter_map(|(directory, kind)| match kind {
            Kind::Raw { is_monochrome, size } => Some((directory, is_monochrome, size)),
            Kind::Demosaicked | Kind::Other => None,
        });
        // The first of several that are as large.
        let largest = raws.reduce(|a, b| if b.2[0] * b.2[1] > a.2[0] * a.2[1] { b } else { a });
        match largest {
            Some((below, is_monochrome, size)) => Ok(Self { first, below, is_monochrome, size, version }),
            None if was_demosaicked => Err(file.problem(
                "it is a DNG whose planes are demosaicked (LinearRaw); take the camera's own file, or what it was made of",
            )),
            None => Err(file.problem(
                "it is a DNG without a raw image, with pictures or previews alone; take the camera's own file",
            )),
        }
    }

    /// Columns and rows of the sensor before the stored image: none, but in files that are written here, whose description or
    /// Software says so; another program may have changed one of the two.
    ///
    /// # Errors
    ///
    /// When such a file says what no sensor has.
    pub fn place(&self, file: &mut TiffFile, description: Option<&str>) -> Result<[usize; 2]> {
        let is_described = description.is_some_and(|text| text.starts_with(METADATA_BEGIN));
        let is_ours = is_described || {
            let software = file.text(&self.first, Tag::Software).unwrap_or_default();
            software.is_some_and(|software| software.starts_with(SOFTWARE))
        };
        if !is_ours {
            return Ok([0, 0]);
        }
        let mut along = |tag: DngTag| match tag.one(file, self.directory())? {
            Some(place) if place > MOST_PHOTOSITES => {
                Err(file.problem(format!("it is damaged; its {} is {place}, and no sensor is so large", tag.1)))
            }
            place => Ok(place.unwrap_or(0)),
        };
        Ok([along(tags::X_POSITION)?, along(tags::Y_POSITION)?])
    }

    /// The directory of the raw image.
    pub fn directory(&self) -> &Directory {
        self.below.as_ref().unwrap_or(&self.first)
    }
}

impl Kind {
    fn of(file: &mut TiffFile, directory: &Directory) -> Result<Self> {
        if file.one(directory, Tag::NewSubfileType)?.unwrap_or(0) != 0 {
            return Ok(Self::Other);
        }
        let planes = file.one(directory, Tag::SamplesPerPixel)?.unwrap_or(1);
        let photometric = file.one(directory, Tag::PhotometricInterpretation)?;
        let is_monochrome = match (photometric.and_then(|number| u16::try_from(number).ok()), planes) {
            (Some(CFA), 1) => false,
            (Some(LINEAR_RAW | BLACK_IS_ZERO), 1) => true,
            (Some(LINEAR_RAW), _) => return Ok(Self::Demosaicked),
            (Some(CFA), _) => {
                return Err(file.problem(format!("its raw image has {planes} samples at a photosite, not one")));
            }
            _ => return Ok(Self::Other),
        };
        let mut side = |tag: Tag| -> Result<usize> {
            let side = file.one(directory, tag)?.and_then(|side| usize::try_from(side).ok());
            side.filter(|side| (1..=MOST_PHOTOSITES).contains(side)).ok_or_else(|| {
                file.problem(format!("it is damaged; its tag {tag:?} gives the raw image no size that a sensor has"))
            })
        };
        Ok(Self::Raw { is_monochrome, size: [side(Tag::ImageWidth)?, side(Tag::ImageLength)?] })
    }
}

/// The version that the file was written by; refuses one that says that readers of ours do not understand it.
fn version(file: &mut TiffFile, first: &Directory) -> Result<[usize; 4]> {
    let mut read = |tag: DngTag| tag.whole::<4>(file, first);
    let written = read(tags::DNG_VERSION)?.unwrap_or([1, 0, 0, 0]);
    let [major, minor, ..] = written;
    let needed = read(tags::DNG_BACKWARD_VERSION)?.unwrap_or([major, minor, 0, 0]);
    if needed > VERSION {
        let [major, minor, ..] = needed;
        return Err(file.problem(format!(
            "it asks for a reader of version {major}.{minor} of DNG (DNGBackwardVersion), and 1.7 is the last known here; convert it to that"
        )));
    }
    Ok(written)
}
