//! Samples that metadata call codes and that cannot be: another program has scaled them and kept what they were called.

use crate::error::{Error, Result};
use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::units::QuantityKind;

/// Codes lie above the white level by noise and by the habits of cameras, but never by as much: what does is on another scale.
const MOST_WHITES: f32 = 1.5;

/// What the codes of a frame may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CodeCheck {
    /// What no sample is above.
    largest: f32,
    /// Whether they are whole numbers from 0 on, as a converter gives them.
    are_whole: bool,
    /// Whether metadata of ours, or a user, call them so, or else tags of a file.
    is_ours: bool,
    has_doubted: bool,
}

impl CodeCheck {
    /// What the metadata of a frame say of it; none where they say nothing, or where samples are no codes any more.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let are_codes = metadata.quantity == QuantityKind::Adu
            && metadata.correction.is_none()
            && metadata.demosaic.is_none()
            && metadata.average.is_none();
        if !are_codes {
            return None;
        }
        let is_ours = !metadata.history.is_empty();
        let adc = metadata.adc.filter(|adc| !adc.is_linearized && is_ours);
        let white = metadata.white_level_adu.map(|white| white.largest()).filter(|white| *white > 0.0);
        #[expect(clippy::cast_possible_truncation, reason = "codes are far below")]
        let largest = match (adc, white) {
            (Some(adc), _) => adc.top_code() as f32,
            (None, Some(white)) => MOST_WHITES * white as f32,
            (None, None) => return None,
        };
        Some(Self { largest, are_whole: adc.is_some(), is_ours, has_doubted: false })
    }

    /// Looks at rows of the frame, in the channels that are planes.
    ///
    /// # Errors
    ///
    /// Those of [`Self::check`].
    pub fn look(&mut self, rows: &[f32], frame: &FrameHeader) -> Result<()> {
        let planes = if frame.leads_with_three_planes() { 3 } else { 1 };
        let kept = planes * frame.geometry.width;
        let mut rows = rows.chunks_exact(frame.geometry.row_samples().max(1));
        rows.try_for_each(|row| self.check(&row[..kept], &frame.name))
    }

    /// Looks at samples.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where they are not what metadata of ours call them; where tags of the file do, it is a doubt.
    fn check(&mut self, samples: &[f32], name: &str) -> Result<()> {
        let is_wrong = |sample: &&f32| {
            sample.is_finite()
                && (**sample > self.largest || self.are_whole && (**sample < 0.0 || sample.fract() != 0.0))
        };
        let Some(wrong) = samples.iter().find(is_wrong).filter(|_| !self.has_doubted) else { return Ok(()) };
        let what = match (self.are_whole, *wrong > self.largest) {
            (true, true) => format!("it has a sample of {wrong}, but codes of its converter end at {}", self.largest),
            (true, false) => {
                format!("it has a sample of {wrong}, but codes of its converter are whole numbers from 0 on")
            }
            (false, _) => {
                format!("it has a sample of {wrong}, but its white level is {} ADU", self.largest / MOST_WHITES)
            }
        };
        if !self.is_ours {
            self.has_doubted = true;
            register::doubt(format!("{name}: {what}; one of the two is on another scale"));
            return Ok(());
        }
        Err(Error::format(
            name,
            format!(
                "{what}, by its metadata: another program has scaled its samples, or the metadata are those of another frame; give \
                 metadata that are right, --metadata FILE"
            ),
        ))
    }
}
