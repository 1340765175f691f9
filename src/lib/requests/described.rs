//! What a user says of a frame that does not say it itself.

use super::notes::Note;
use super::options::Input;
use super::other_sensor::of_another_sensor;
use super::values;
use crate::camera::levels::{BlackLevel, BlackLevels};
use crate::camera::optics::{Exposure, doubt_of_aperture, doubt_of_time};
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::formats::input::{FrameReader, InputOptions, OfCamera};
use crate::formats::register;
use crate::metadata::{CorrectionRecord, FrameHeader};
use crate::stages::black::{Black, is_said};
use crate::stream::RowSource;
use crate::units::QuantityKind;
use clap::Args;
use std::fmt::Display;

/// Exposures that differ by no more than this are the same, written with other digits.
const SAME_EXPOSURE: f64 = 1e-6;

/// Filter array, white level and exposure of a frame that does not say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct Described {
    /// Filter array of a single plane: rggb, bggr, grbg, gbrg, monochrome, or its period as 4x4:RRGGRRGGGGBBGGBB
    #[arg(long, value_name = "PATTERN", value_parser = str::parse::<FilterArray>)]
    pub cfa: Option<FilterArray>,
    /// The same by its other name.
    #[arg(long, hide = true, value_name = "PATTERN", value_parser = str::parse::<FilterArray>)]
    pub pattern: Option<FilterArray>,
    /// White level: the largest code, on the scale of the samples
    #[arg(long = "white", value_name = "N", value_parser = values::number)]
    pub white_level_adu: Option<f64>,
    /// Exposure time in s
    #[arg(id = "exposure", long, value_name = "S", value_parser = values::seconds)]
    pub exposure_s: Option<f64>,
    /// Relative aperture
    #[arg(long, value_name = "N", value_parser = values::f_number)]
    pub f_number: Option<f64>,
}

/// All that, and the black level, for programs whose `--black` is nothing else.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct DescribedWithBlack {
    /// All but the black level.
    #[command(flatten)]
    pub described: Described,
    /// Black level: the code of no light, 0 where it is off; or four, of the 2x2 sites at the sensor's corner, row by row
    #[arg(id = "black", long, value_name = "N[,N,N,N]", value_parser = values::black_level, allow_hyphen_values = true)]
    pub black_level_adu: Option<BlackLevel>,
}

/// A frame to read, and what a user says of it.
#[derive(Debug, Clone, Args)]
pub struct DescribedInput {
    /// The frame.
    #[command(flatten)]
    pub frame: Input,
    /// What is said of it.
    #[command(flatten)]
    pub described: DescribedWithBlack,
}

impl DescribedInput {
    /// Another frame, which is described as this is.
    pub fn with(&self, frame: Input) -> Self {
        Self { frame, ..self.clone() }
    }

    /// Opens the frame, as it is described; channels besides R, G, B or Y are left out.
    ///
    /// # Errors
    ///
    /// Those of [`DescribedWithBlack::open`].
    pub fn open(&self) -> Result<FrameReader> {
        self.described.open(&self.frame.options())
    }

    /// The same of planes without an array; the array that is named, which is none of theirs, comes beside them.
    ///
    /// # Errors
    ///
    /// Those of [`DescribedWithBlack::open`] and [`either`].
    pub fn open_planes(&self) -> Result<(FrameReader, Option<FilterArray>)> {
        let Self { frame, mut described } = self.clone();
        let array = either(described.described.cfa.take(), described.described.pattern.take())?;
        Ok((described.open(&frame.options())?, array))
    }

    /// The same with all channels; with the layer of marks behind one that is asked for.
    ///
    /// # Errors
    ///
    /// Those of [`DescribedWithBlack::open`].
    pub fn open_all(&self) -> Result<FrameReader> {
        let mut reader = self.described.open(&self.frame.options_for_all())?;
        reader.keep_mask();
        Ok(reader)
    }
}

impl Described {
    /// Opens a frame, as it is described.
    ///
    /// # Errors
    ///
    /// Those of [`FrameReader::open`] and [`Self::apply`].
    pub fn open(&self, options: &InputOptions) -> Result<FrameReader> {
        let wants_plane = self.cfa.or(self.pattern).is_some();
        let mut reader = FrameReader::open(&InputOptions { tells_top: true, wants_plane, ..options.clone() })?;
        self.apply(reader.header_mut())?;
        Ok(reader)
    }

    /// Puts what is said into the metadata of a frame. One of unknown quantity whose array or levels are said is one of ADU.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where the metadata say another thing, for an array of a frame that has several planes, for levels of
    /// what is not ADU, for an f-number without an exposure time, and for impossible ones. A time may be said alone: dark signals need no
    /// f-number.
    pub fn apply(&self, frame: &mut FrameHeader) -> Result<()> {
        if let Some(cfa) = either(self.cfa, self.pattern)? {
            // Advice is about the name that was used.
            let option: &[_] = if self.cfa.is_some() { &["cfa"] } else { &["pattern"] };
            if frame.geometry.channels.len() != 1 {
                let problem = format!(
                    "{}: it holds {}, and a filter array stands before one; take that with --channel NAME, or leave out --{}",
                    frame.name,
                    frame.holds(),
                    option[0]
                );
                return Err(Error::Usage(problem));
            }
            let known = frame.metadata.cfa.filter(|known| *known != cfa);
            agree(frame, "filter array", known.map(|known| known.to_string()), option)?;
            frame.metadata.cfa = Some(cfa);
            frame.metadata.name_codes();
        }
        if let Some(white) = self.white_level_adu {
            check_codes(frame, &["white"])?;
            let known = frame.metadata.white_level_adu.filter(|known| *known != white.into());
            let lost_black = frame.metadata.correction.as_ref().is_some_and(CorrectionRecord::took_black);
            if lost_black && frame.metadata.white_level_adu.is_none() {
                let problem = format!(
                    "{}: black came off its samples before a white level was known, so that saturated ones are neither marked nor \
                     told by a level any more; correct it anew, with the white level given to `correct-frame`",
                    frame.name
                );
                return Err(Error::Usage(problem).leave_out(&["white"]));
            }
            agree(frame, "white level", known.map(|known| in_words(&known.classes())), &["white"])?;
            frame.metadata.white_level_adu = Some(white.into());
        }
        let Self { exposure_s, f_number, .. } = *self;
        let said = SaidExposure { exposure_s, f_number, lens_transmittance: None };
        let Some(said_s) = exposure_s.filter(|_| f_number.is_none() && frame.metadata.exposure.is_none()) else {
            return said.apply(frame);
        };
        let known_s = frame.metadata.exposure_time_s;
        agree(frame, "exposure time in s", other_than(exposure_s, known_s), &["exposure"])?;
        said.note_doubts();
        frame.metadata.exposure_time_s = known_s.or(Some(said_s));
        Ok(())
    }
}

/// What is said of an exposure.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SaidExposure {
    /// Exposure time in s.
    pub exposure_s: Option<f64>,
    /// Relative aperture.
    pub f_number: Option<f64>,
    /// Transmittance of the lens, 0 to 1. Of frames that were not rendered it is 1 in metadata where it is not known, and may
    /// be another.
    pub lens_transmittance: Option<f64>,
}

impl SaidExposure {
    /// Has a program warn of what is said and looks like another unit.
    fn note_doubts(self) {
        let doubts = self.exposure_s.and_then(doubt_of_time).into_iter();
        doubts.chain(self.f_number.and_then(doubt_of_aperture)).for_each(register::doubt);
    }

    /// Puts what is said into the metadata of a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where the metadata say another thing, for a part of an exposure without the others, and for impossible
    /// ones.
    pub fn apply(self, frame: &mut FrameHeader) -> Result<()> {
        if self == Self::default() {
            return Ok(());
        }
        let known = frame.metadata.exposure;
        let [time, f_number] = [frame.metadata.time_s(), known.map(|known| known.f_number)];
        let is_stated = |passed: &f64| *passed != 1.0 || frame.metadata.scene.is_some();
        let passed = known.map(|known| known.lens_transmittance).filter(is_stated);
        agree(frame, "exposure time in s", other_than(self.exposure_s, time), &["exposure"])?;
        agree(frame, "f-number", other_than(self.f_number, f_number), &["f_number"])?;
        agree(
            frame,
            "transmittance of the lens",
            other_than(self.lens_transmittance, passed),
            &["lens_transmittance"],
        )?;
        let [exposure_s, f_number] = [time.or(self.exposure_s), f_number.or(self.f_number)];
        let lens_transmittance = passed.or(self.lens_transmittance).unwrap_or(1.0);
        let Some((exposure_s, f_number)) = exposure_s.zip(f_number) else {
            let missing: &[_] = match (exposure_s, f_number) {
                (None, None) => &["exposure", "f_number"],
                (Some(_), _) => &["f_number"],
                _ => &["exposure"],
            };
            let problem = format!("{}: an exposure is a time and an f-number, and one is not known", frame.name);
            return Err(Error::Usage(problem).give(missing));
        };
        self.note_doubts();
        frame.metadata.exposure = Some(Exposure { exposure_s, f_number, lens_transmittance }.checked()?);
        frame.metadata.exposure_time_s = None;
        Ok(())
    }
}

/// Puts a black level into the metadata of a frame.
///
/// # Errors
///
/// [`Error::Usage`] where the metadata say another.
pub fn apply_black(frame: &mut FrameHeader, black: BlackLevel) -> Result<()> {
    let said = BlackLevels::of_sites(black, frame.geometry.origin);
    let differs = |known: &BlackLevels| known.has_deltas() || known.sites() != said.sites();
    let known = frame.black_levels()?.filter(|known| !is_no_level(frame, known) && differs(known));
    agree(frame, "black level", known.map(|known| in_words(&known.level().sites())), &["black"])?;
    frame.metadata.set_black_adu(Some(black));
    Ok(())
}

/// Whether a black level is the 0 of files that tell none, as by DNG, or of ones that tell it for want of another.
fn is_no_level(frame: &FrameHeader, known: &BlackLevels) -> bool {
    let metadata = &frame.metadata;
    known.uniform() == Some(0.0)
        && metadata.history.is_empty()
        && metadata.correction.is_none()
        && metadata.adc.is_none()
}

/// A filter array by the option `cfa`, or by `pattern`, which means the same.
///
/// # Errors
///
/// [`Error::Usage`] where both are given and differ.
pub fn either<T: PartialEq + Copy + Display>(cfa: Option<T>, pattern: Option<T>) -> Result<Option<T>> {
    match (cfa, pattern) {
        (Some(cfa), Some(pattern)) if cfa != pattern => {
            let problem =
                format!("two filter arrays are named, {cfa} by --cfa and {pattern} by --pattern, which are one option");
            Err(Error::Usage(problem).leave_out(&["pattern"]))
        }
        _ => Ok(cfa.or(pattern)),
    }
}

/// What no code of a camera is above: of converters of more than 16 bits the white level is to be told.
const LARGEST_CODE: f64 = 65_535.0;

/// Has a black level that comes off a frame held against its samples, and against masked photosites of it.
///
/// # Errors
///
/// Those of [`Black::levels`].
pub fn hold_black(reader: &mut FrameReader, black: Black) -> Result<()> {
    if let Black::Level(level) = black {
        reader.expect_black(level);
    }
    if black != Black::None {
        reader.compare_masked(black.levels(reader.header())?);
    }
    Ok(())
}

/// A warning of a level to subtract that is not what the metadata say of no light, or far from the bias of the sensor that is named.
///
/// # Errors
///
/// [`Error::Usage`] for one that is not below the white level, or where none is known the codes of 16 bits.
pub fn doubt_of_black(frame: &FrameHeader, black: Black) -> Result<Option<Note>> {
    let black = match black {
        Black::None => return Ok(None),
        Black::Auto => {
            let known = frame.black_levels()?.filter(|known| !known.has_deltas()).map(|known| known.level());
            return Ok(known.and_then(|known| {
                of_another_sensor(frame, known, &format!("its black level, {} ADU,", in_words(&known.sites())))
                    .map(Note::Warning)
            }));
        }
        Black::Level(black) => black,
    };
    let (level, said) = (black.largest(), in_words(&black.sites()));
    let white = frame.metadata.white_level_adu.map(|white| white.largest());
    let are_codes = matches!(frame.metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
    if let Some(white) = white.filter(|white| are_codes && level >= *white) {
        let problem = format!("{}: --black {said} is not below the white level, {white} ADU", frame.name);
        return Err(Error::Usage(problem).change(&["black", "white"]));
    }
    if white.is_none() && level >= LARGEST_CODE && frame.metadata.quantity == QuantityKind::Adu {
        let problem =
            format!("{}: --black {said} is not below {LARGEST_CODE}, the largest code of 16 bits", frame.name);
        return Err(Error::Usage(problem).change(&["black"]));
    }
    let other = other_black(frame, black).or_else(|| of_another_sensor(frame, black, &format!("--black {said}")));
    Ok(other.map(Note::Warning))
}

/// A warning of a level to subtract that the metadata contradict.
fn other_black(frame: &FrameHeader, black: BlackLevel) -> Option<String> {
    let levels = match frame.metadata.quantity {
        QuantityKind::Electrons | QuantityKind::ExpectedElectrons => {
            frame.metadata.dark_signal_e.map(|level| [level; 4])
        }
        _ => frame.metadata.black_level_adu.map(BlackLevel::sites),
    }?;
    let [low, high] = levels.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], at| [l.min(*at), h.max(*at)]);
    // A level that is rounded, or one for four sites, is meant.
    let is_near = match black {
        BlackLevel::Uniform(level) => (low.floor()..=high.ceil()).contains(&level),
        BlackLevel::Sites(said) => levels.iter().zip(said).all(|(known, said)| (known - said).abs() < 1.0),
    };
    let which = match is_said(Black::Level(black), frame) {
        true => "it counts in place of that",
        false => "what is left of that counts as black further on",
    };
    (!is_near).then(|| {
        format!(
            "{}: --black {} is not the black level of its metadata, {}, which --black auto takes; {which}",
            frame.name,
            in_words(&black.sites()),
            in_words(&levels)
        )
    })
}

impl Described {
    /// What is said of the camera, and counts for frames beside that do not say it.
    ///
    /// # Errors
    ///
    /// Those of [`either`].
    pub fn of_camera(&self) -> Result<OfCamera> {
        Ok(OfCamera { cfa: either(self.cfa, self.pattern)?, white_level_adu: self.white_level_adu, description: None })
    }
}

impl DescribedWithBlack {
    /// Opens a frame, as it is described.
    ///
    /// # Errors
    ///
    /// Those of [`FrameReader::open`] and [`Self::apply`].
    pub fn open(&self, options: &InputOptions) -> Result<FrameReader> {
        let wants_plane = self.described.cfa.or(self.described.pattern).is_some();
        let mut reader = FrameReader::open(&InputOptions { tells_top: true, wants_plane, ..options.clone() })?;
        self.apply(reader.header_mut())?;
        Ok(reader)
    }

    /// Puts what is said into the metadata of a frame.
    ///
    /// # Errors
    ///
    /// As [`Described::apply`], with the black level of what is not ADU or has another.
    pub fn apply(&self, frame: &mut FrameHeader) -> Result<()> {
        self.described.apply(frame)?;
        if let Some(black) = self.black_level_adu {
            check_codes(frame, &["black"])?;
            apply_black(frame, black)?;
        }
        Ok(())
    }
}

impl DescribedWithBlack {
    /// Puts what is said into the metadata of a frame of which the exposure time counts and the lens does not, and gives that
    /// time in s; 0 is none.
    ///
    /// # Errors
    ///
    /// As [`Self::apply`], but a time needs no f-number.
    pub fn apply_time(&self, frame: &mut FrameHeader) -> Result<Option<f64>> {
        let Described { exposure_s: said_s, f_number, .. } = self.described;
        let known = frame.metadata.exposure;
        let known_s = frame.metadata.time_s().filter(|time_s| *time_s > 0.0);
        agree(frame, "exposure time in s", other_than(said_s, known_s), &["exposure"])?;
        agree(frame, "f-number", other_than(f_number, known.map(|known| known.f_number)), &["f_number"])?;
        let described = Described { exposure_s: None, f_number: None, ..self.described };
        Self { described, ..*self }.apply(frame)?;
        SaidExposure { exposure_s: said_s, f_number, lens_transmittance: None }.note_doubts();
        Ok(known_s.or(said_s))
    }
}

/// What is known of an exposure, in words, where it is not what is said.
fn other_than(said: Option<f64>, known: Option<f64>) -> Option<String> {
    let differs = |known: &f64| said.is_some_and(|said| (said / known - 1.0).abs() > SAME_EXPOSURE);
    known.filter(differs).map(|known| known.to_string())
}

/// Makes sure that a frame is one of ADU, of which a level is said by `option`.
fn check_codes(frame: &mut FrameHeader, option: &'static [&'static str]) -> Result<()> {
    frame.metadata.name_codes();
    if frame.metadata.quantity == QuantityKind::Adu {
        return Ok(());
    }
    let problem = format!("{}: it holds {}, which have no level of codes", frame.name, frame.holds());
    Err(Error::Usage(problem).leave_out(option))
}

/// Makes sure that the metadata of a frame do not say another thing, `other`, than `option` does.
fn agree(frame: &FrameHeader, what: &str, other: Option<String>, option: &'static [&'static str]) -> Result<()> {
    let Some(other) = other else { return Ok(()) };
    let problem = format!("{}: the {what} is {other} by its metadata, which --metadata FILE can replace", frame.name);
    Err(Error::Usage(problem).leave_out(option))
}

/// Levels in words: one where all are the same.
fn in_words(levels: &[f64]) -> String {
    let is_one = levels.iter().all(|level| level == &levels[0]);
    let shown: Vec<String> = levels.iter().take(if is_one { 1 } else { levels.len() }).map(f64::to_string).collect();
    shown.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;

    fn frame(quantity: QuantityKind, channels: &[&str]) -> FrameHeader {
        let geometry = Geometry::new(4, 4, channels);
        FrameHeader { name: "in".into(), geometry, metadata: Metadata::new(quantity) }
    }

    #[test]
    fn what_is_said_counts() {
        let mut plane = frame(QuantityKind::Unspecified, &["Y"]);
        Described::default().apply(&mut plane).unwrap();
        assert_eq!(plane, frame(QuantityKind::Unspecified, &["Y"]));
        let said = Described {
            cfa: Some("gbrg".parse().unwrap()),
            pattern: None,
            white_level_adu: Some(4095.0),
            exposure_s: Some(0.5),
            f_number: Some(4.0),
        };
        DescribedWithBlack { described: said, black_level_adu: Some(64.0.into()) }.apply(&mut plane).unwrap();
        let metadata = &plane.metadata;
        assert_eq!((metadata.quantity, metadata.unit.as_str()), (QuantityKind::Adu, QuantityKind::Adu.unit()));
        assert_eq!((metadata.cfa, metadata.white_level_adu), (said.cfa, Some(4095.0.into())));
        assert_eq!(metadata.black_level_adu, Some(64.0.into()));
        let exposure = Exposure { exposure_s: 0.5, f_number: 4.0, lens_transmittance: 1.0 };
        assert_eq!(metadata.exposure, Some(exposure));
        // What the frame says already may be said again.
        let before = plane.clone();
        DescribedWithBlack { described: said, black_level_adu: Some(64.0.into()) }.apply(&mut plane).unwrap();
        assert_eq!(plane, before);
    }

    #[test]
    fn what_contradicts_the_metadata_is_refused() {
        let mut known = frame(QuantityKind::Adu, &["Y"]);
        known.metadata.cfa = Some("rggb".parse().unwrap());
        known.metadata.white_level_adu = Some(4095.0.into());
        known.metadata.black_level_adu = Some(BlackLevel::Sites([1.0, 2.0, 3.0, 4.0]));
        known.metadata.exposure = Some(Exposure { exposure_s: 0.5, f_number: 4.0, lens_transmittance: 1.0 });
        let none = Described::default();
        let cases = [
            (Described { cfa: Some("bggr".parse().unwrap()), ..none }, None, "filter array is rggb", "cfa"),
            (Described { white_level_adu: Some(1.0), ..none }, None, "white level is 4095", "white"),
            (none, Some(1.0.into()), "black level is 1,2,3,4", "black"),
            (none, Some(BlackLevel::Sites([1.0, 2.0, 4.0, 3.0])), "black level is 1,2,3,4", "black"),
            (Described { exposure_s: Some(0.6), ..none }, None, "exposure time in s is 0.5", "exposure"),
            (Described { f_number: Some(8.0), ..none }, None, "f-number is 4", "f_number"),
        ];
        for (described, black_level_adu, said, option) in cases {
            let error = DescribedWithBlack { described, black_level_adu }.apply(&mut known.clone()).unwrap_err();
            let rest = "by its metadata, which --metadata FILE can replace";
            assert_eq!(error.to_string(), format!("in: the {said} {rest}; leave out `{option}`"));
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let said = |described: Described, frame: &mut FrameHeader| described.apply(frame).unwrap_err().to_string();
        let mut plane = frame(QuantityKind::Unspecified, &["Y"]);
        let aperture = Described { f_number: Some(4.0), ..Described::default() };
        assert_eq!(
            said(aperture, &mut plane),
            "in: an exposure is a time and an f-number, and one is not known; give `exposure`"
        );
        // A time is said alone, and once; an f-number may come later.
        let time = |exposure_s| Described { exposure_s: Some(exposure_s), ..Described::default() };
        time(1.0).apply(&mut plane).unwrap();
        assert_eq!((plane.metadata.exposure, plane.metadata.time_s()), (None, Some(1.0)));
        let rest = "by its metadata, which --metadata FILE can replace; leave out `exposure`";
        assert_eq!(said(time(2.0), &mut plane), format!("in: the exposure time in s is 1 {rest}"));
        aperture.apply(&mut plane).unwrap();
        let exposure = Exposure { exposure_s: 1.0, f_number: 4.0, lens_transmittance: 1.0 };
        assert_eq!((plane.metadata.exposure, plane.metadata.exposure_time_s), (Some(exposure), None));
        let mut three = frame(QuantityKind::Electrons, &["R", "G", "B"]);
        let cfa = Described { cfa: Some("rggb".parse().unwrap()), ..Described::default() };
        assert_eq!(
            said(cfa, &mut three),
            "in: it holds three planes of electrons, and a filter array stands before one; take that with --channel NAME, or leave out --cfa"
        );
        let white = Described { white_level_adu: Some(1.0), ..Described::default() };
        let complaint = "in: it holds three planes of electrons, which have no level of codes; leave out ";
        assert_eq!(said(white, &mut three), format!("{complaint}`white`"));
        let black = DescribedWithBlack { black_level_adu: Some(1.0.into()), ..DescribedWithBlack::default() }
            .apply(&mut three)
            .unwrap_err();
        assert_eq!(black.to_string(), format!("{complaint}`black`"));
    }
}
