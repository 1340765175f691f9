//! The black level: what no light reads, and what is left of it once something was subtracted.

use crate::camera::levels::{BlackLevel, BlackLevels, WhiteLevel};
use crate::cfa::CfaPattern;
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::FrameHeader;
use crate::units::QuantityKind;

/// What is subtracted before interpolation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Black {
    /// What the metadata says: bias plus mean dark signal, or a level for each photosite.
    Auto,
    /// Nothing.
    None,
    /// A level in the unit of the samples, or one for each of the 2×2 sites.
    Level(BlackLevel),
}

impl Black {
    /// What comes off each photosite of a frame.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where the metadata shall say it and do not; [`Error::Usage`] for a level of a frame that has
    /// lost its black; those of [`FrameHeader::black_levels`].
    pub fn levels(self, frame: &FrameHeader) -> Result<BlackLevels> {
        let metadata = &frame.metadata;
        let level = match self {
            Self::Level(level) if level.uniform() != Some(0.0) && is_off(frame)? => {
                let problem = format!("{}: its black level is off already, as its metadata say", frame.name);
                return Err(Error::Usage(problem).leave_out(&["black"]));
            }
            Self::Level(level) => level,
            Self::None => 0.0.into(),
            Self::Auto => match metadata.quantity {
                QuantityKind::Electrons => metadata.dark_signal_e.ok_or_else(|| frame.missing("dark_signal_e"))?.into(),
                QuantityKind::ExpectedElectrons => 0.0.into(),
                _ => return frame.black_levels()?.ok_or_else(|| frame.missing("black_level_adu")),
            },
        };
        Ok(BlackLevels::of_sites(level, frame.geometry.origin))
    }
}

/// Whether a number that a user gives is the black level of a frame of codes, whatever its metadata say: of a camera's, whose tags may be
/// wrong. What a converter is known of that we simulated has a black level, and a number takes a part of it off.
pub fn is_said(black: Black, frame: &FrameHeader) -> bool {
    matches!(black, Black::Level(_)) && frame.metadata.adc.is_none()
}

/// Whether a program has subtracted all of the black level.
fn is_off(frame: &FrameHeader) -> Result<bool> {
    let is_left = frame.black_levels()?.is_none_or(|black| black.uniform() != Some(0.0));
    Ok(frame.metadata.correction.as_ref().is_some_and(|record| record.took_black()) && !is_left)
}

/// What no light reads once `subtracted` is off; a frame of unknown black counts as black-free after a subtraction. None
/// where what is left differs among photosites.
pub fn black_left(before: Option<&BlackLevels>, subtracted: &BlackLevels) -> Option<f64> {
    match before {
        None => Some(0.0),
        Some(black) if black == subtracted => Some(0.0),
        Some(black) => Some(black.uniform()? - subtracted.uniform()?),
    }
}

/// The white level once `subtracted` is off; where that differs among photosites of a class, what the first of them reaches
/// that is full. Photosites of unknown classes count for all.
pub fn white_left(
    before: WhiteLevel,
    subtracted: &BlackLevels,
    geometry: &Geometry,
    pattern: Option<CfaPattern>,
) -> WhiteLevel {
    let [x0, y0] = geometry.origin.map(i64::from);
    let class = |x: usize, y: usize| pattern.map(|pattern| pattern.class(x0 + x as i64, y0 + y as i64));
    before.less(subtracted.largest([geometry.width, geometry.height], class))
}
