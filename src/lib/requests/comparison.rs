//! Comparing colors: of images, or given as numbers.

use super::conversion::doubt_of_white;
use super::notes::{self, Note};
use super::values;
use crate::analysis::comparison::{Comparison, ComparisonSettings, Side};
use crate::analysis::statistics::Region;
use crate::color::{Space, White, chromaticity};
use crate::error::{Error, Result};
use crate::formats::format::SampleType;
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::pipe;
use crate::formats::register::check_inputs;
use crate::metadata::FrameHeader;
use crate::stream::RowSource;
use crate::units::QuantityKind;
use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// A frame to read, or a color given as numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameOrColor {
    /// A file, or `-`.
    Frame(PathBuf),
    /// Three numbers.
    Color([f64; 3]),
}

impl FrameOrColor {
    /// The file of a frame.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Frame(path) => Some(path),
            Self::Color(_) => None,
        }
    }

    /// Whether it is a frame that comes through a pipe.
    pub fn is_pipe(&self) -> bool {
        self.path().is_some_and(|path| pipe::is_input(Some(path)))
    }

    /// Whether the frame comes through the standard input.
    pub fn is_standard_input(&self) -> bool {
        *self == Self::Frame("-".into())
    }

    fn open(&self, part: usize, crop: Option<Region>, space: Option<Space>) -> Result<Side<FrameReader>> {
        match self {
            Self::Color(color) => Ok(Side::Color(*color)),
            Self::Frame(path) => {
                let options = InputOptions { path: Some(path.clone()), part, crop, ..InputOptions::default() };
                let reader = FrameReader::open(&options)?;
                if space.is_none() {
                    check_no_picture(&reader)?;
                }
                Ok(Side::Frame(reader))
            }
        }
    }
}

/// A parser for a file or a color: what exists is a file.
fn frame_or_color() -> impl TypedValueParser<Value = FrameOrColor> {
    OsStringValueParser::new().try_map(|text: OsString| -> std::result::Result<FrameOrColor, String> {
        let path = PathBuf::from(&text);
        let text = text.to_string_lossy();
        if text == "-" || path.exists() {
            return Ok(FrameOrColor::Frame(path));
        }
        if let Ok(color) = values::three_numbers(&text) {
            return Ok(FrameOrColor::Color(color));
        }
        let is_word = |part: &str| part.trim().parse::<f64>().is_err();
        if text.starts_with('-') || !text.split(',').all(is_word) {
            return Err("it is no option, no file, and no color, which is three numbers between commas".into());
        }
        Ok(FrameOrColor::Frame(path))
    })
}

/// What is compared, and under which white.
#[derive(Debug, Clone, Args)]
pub struct ColorPair {
    /// Reference: an image, or a color as X,Y,Z or L,a,b; X,Y,Z beside an image of relative XYZ are relative too
    #[arg(value_parser = frame_or_color(), allow_hyphen_values = true)]
    pub a: FrameOrColor,
    /// What is compared with it: an image, or a color as X,Y,Z or L,a,b
    #[arg(value_parser = frame_or_color(), allow_hyphen_values = true)]
    pub b: FrameOrColor,
    /// What colors given as numbers are, and what images without metadata hold; by default xyz
    #[arg(long, value_parser = values::one_of(&[Space::Xyz, Space::Lab]))]
    pub space: Option<Space>,
    /// White of XYZ and xyY: d65, d50, e, or its X,Y,Z on their scale, absolute or relative; by default that in the metadata of an
    /// image, or d65
    #[arg(long, value_name = "d65|d50|e|X,Y,Z", value_parser = values::white, allow_hyphen_values = true)]
    pub white: Option<White>,
    /// Luminance of the white in cd/m2; by default that in the metadata of an image, or 100 for colors given as numbers
    #[arg(long, value_name = "CD_PER_M2", value_parser = values::positive)]
    pub white_luminance: Option<f64>,
    /// Part of a multi-part EXR or FITS, or page of a TIFF, counted from 0, of both images
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub part: usize,
    /// Take a rectangle X,Y,W,H in pixels alone, of both images
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region, allow_hyphen_values = true)]
    pub crop: Option<Region>,
}

impl ColorPair {
    /// Whether one of the two comes through a pipe.
    pub fn is_pipe(&self) -> bool {
        self.a.is_pipe() || self.b.is_pipe()
    }

    /// Opens both, ready to be compared; with what came up.
    ///
    /// # Errors
    ///
    /// Those of readers, and of [`Comparison::new`].
    pub fn open(&self) -> Result<(Comparison<FrameReader>, Vec<Note>)> {
        check_inputs([&self.a, &self.b].into_iter().filter_map(FrameOrColor::path).map(Some))?;
        let Self { space, white, white_luminance, part, crop, .. } = *self;
        let is_frame = |side: &FrameOrColor| side.path().is_some();
        if (crop.is_some() || part > 0) && ![&self.a, &self.b].into_iter().any(is_frame) {
            let option: &[_] = if crop.is_some() { &["crop"] } else { &["part"] };
            return Err(Error::Usage("both are colors, of which there are no parts".into()).leave_out(option));
        }
        let settings = ComparisonSettings { space, white, white_luminance };
        let comparison = Comparison::new(self.a.open(part, crop, space)?, self.b.open(part, crop, space)?, &settings)?;
        let mut notes: Vec<Note> = self.doubt_of_negatives().into_iter().collect();
        if comparison.white().is_none() && (white.is_some() || white_luminance.is_some()) {
            let text = "both are L*a*b* already; --white and --white-luminance have no effect";
            notes.push(Note::Warning(text.into()));
        }
        let is_relative = comparison.frames().any(|frame| frame.header().metadata.is_relative());
        // Colors that are given have no scale that is known.
        let is_of_frames = comparison.frames().next().is_some();
        notes.extend(white.filter(|_| is_of_frames).and_then(|white| doubt_of_white(white, is_relative)));
        notes.extend(comparison.frames().flat_map(notes::of_reader));
        notes.extend(doubt_of_places(&comparison));
        notes.extend(doubt_of_lights(&comparison).filter(|_| white.is_none()));
        Ok((comparison, notes))
    }
}

impl ColorPair {
    /// A warning of numbers that are no color in XYZ, as those of L\*a\*b\* may not be.
    fn doubt_of_negatives(&self) -> Option<Note> {
        let is_negative =
            |side: &&FrameOrColor| matches!(side, FrameOrColor::Color(color) if color.iter().any(|x| *x < 0.0));
        let side = [&self.a, &self.b].into_iter().find(is_negative).filter(|_| self.space != Some(Space::Lab))?;
        let FrameOrColor::Color([x, y, z]) = side else { return None };
        let text = format!(
            "{x},{y},{z} counts as XYZ, in which colors have no negative numbers; L,a,b are given with --space lab"
        );
        Some(Note::Warning(text))
    }
}

/// Refuses planes R, G and B of whole numbers that nothing tells anything of: those of pictures are no XYZ.
fn check_no_picture(reader: &FrameReader) -> Result<()> {
    let header = reader.header();
    let is_picture = header.metadata.quantity == QuantityKind::Unspecified
        && header.leads_with_three_planes()
        && matches!(reader.sample_type(), Some(SampleType::U8 | SampleType::U16));
    if !is_picture {
        return Ok(());
    }
    Err(header
        .refuse(format!(
            "its samples are {}, as those of pictures, and nothing tells that they are XYZ",
            reader.stored_as()
        ))
        .give(&["space"]))
}

/// A warning of images whose colors are not in one light: what is white in one has a color in the other.
fn doubt_of_lights(comparison: &Comparison<FrameReader>) -> Option<Note> {
    /// Chromaticities in texts of four digits.
    const NEAR: f64 = 1e-4;
    let heads = comparison.frames().map(RowSource::header);
    let mut whites = heads.filter_map(|head| Some((head, head.metadata.color.as_ref()?.white?)));
    let [(first, a), (second, b)] = [whites.next()?, whites.next()?];
    let [[x, y], [other_x, other_y]] = [a, b].map(chromaticity);
    let is_far = (x - other_x).abs().max((y - other_y).abs()) > NEAR;
    (comparison.white().is_some() && is_far).then(|| {
        Note::Warning(format!(
            "{}: its white has x {other_x:.4}, y {other_y:.4}, that of {} x {x:.4}, y {y:.4}: both are seen under the latter unless --white \
             names another, and where one was adapted to another light that counts as a difference of colors",
            second.name, first.name
        ))
    })
}

/// A warning of images that show other parts of the sensor, so that pixels are compared that saw other light.
fn doubt_of_places(comparison: &Comparison<FrameReader>) -> Option<Note> {
    let mut heads = comparison.frames().map(RowSource::header);
    let [first, second] = [heads.next()?, heads.next()?];
    let place = |head: &FrameHeader| format!("column {}, row {}", head.geometry.origin[0], head.geometry.origin[1]);
    (first.geometry.origin != second.geometry.origin).then(|| {
        Note::Warning(format!(
            "{}: it begins at {} of the sensor, but {} at {}: pixels are compared that show other places",
            second.name,
            place(second),
            first.name,
            place(first)
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_is_a_file_or_a_color() {
        let read = |text: &str| {
            let command = clap::Command::new("test")
                .arg(clap::Arg::new("side").value_parser(frame_or_color()).allow_hyphen_values(true));
            let matches = command.try_get_matches_from(["test", text]).ok()?;
            matches.get_one::<FrameOrColor>("side").cloned()
        };
        assert_eq!(read("-1.5, 2e1,-3"), Some(FrameOrColor::Color([-1.5, 20.0, -3.0])));
        assert_eq!(read("-").map(|side| side.is_standard_input()), Some(true));
        assert_eq!(read("Cargo.toml"), Some(FrameOrColor::Frame("Cargo.toml".into())));
        // What looks like no color may be a file that is missing; its reader says so.
        assert_eq!(read("sky,blue.exr"), Some(FrameOrColor::Frame("sky,blue.exr".into())));
        for wrong in ["1,2", "1,2,3,4", "1,2,x", "inf,1,2", "--spac", "-x"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn negative_numbers_of_xyz_are_told() {
        let said = |space| {
            let (a, b) = (FrameOrColor::Color([50.0, 2.67, -79.8]), FrameOrColor::Color([50.0, 0.0, 0.0]));
            let pair = ColorPair { a, b, space, white: None, white_luminance: None, part: 0, crop: None };
            pair.open().unwrap().1
        };
        let wanted =
            "50,2.67,-79.8 counts as XYZ, in which colors have no negative numbers; L,a,b are given with --space lab";
        for space in [None, Some(Space::Xyz)] {
            assert_eq!(said(space), [Note::Warning(wanted.into())]);
        }
        assert_eq!(said(Some(Space::Lab)), []);
    }

    #[test]
    fn colors_that_need_no_white_say_so() {
        let color = |lightness: f64| FrameOrColor::Color([lightness, 0.0, 0.0]);
        let white = Some(White::D65);
        let pair = ColorPair {
            a: color(50.0),
            b: color(53.0),
            space: Some(Space::Lab),
            white,
            white_luminance: None,
            part: 0,
            crop: None,
        };
        let (mut comparison, notes) = pair.open().unwrap();
        assert!(matches!(&notes[..], [Note::Warning(text)] if text.contains("have no effect")), "{notes:?}");
        comparison.run(None, &mut |_| ()).unwrap();
        assert_eq!(comparison.report().unwrap().differences.delta_e_76.summary.mean, 3.0);
    }
}
