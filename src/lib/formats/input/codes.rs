//! Samples that metadata call codes and that cannot be: another program has scaled them and kept what they were called.

use crate::camera::levels::OF_ONE_SCALE;
use crate::error::{Error, Result};
use crate::formats::register;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::numerics::vectors::{self, Kernel};
use crate::units::QuantityKind;

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
        let largest = match (adc, white) {
            (Some(adc), _) => f64::from(adc.top_code()),
            (None, Some(white)) => OF_ONE_SCALE * white,
            (None, None) => return None,
        };
        Some(Self { largest: to_sample(largest), are_whole: adc.is_some(), is_ours, has_doubted: false })
    }

    /// Whether a sample is finite and no code. No branches, and no function, so that the loop over samples becomes vectors: beside 2²³ a
    /// sum holds whole numbers alone, and codes are below it.
    #[inline(always)]
    fn is_wrong(&self, sample: f32) -> bool {
        const WHOLE: f32 = 8_388_608.0;
        let is_code = (sample >= 0.0) & (sample + WHOLE - WHOLE == sample);
        (sample.abs() < f32::INFINITY) & ((sample > self.largest) | (self.are_whole & !is_code))
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
        if self.has_doubted || !vectors::run(AnyWrong { check: self, samples }) {
            return Ok(());
        }
        let Some(wrong) = samples.iter().find(|sample| self.is_wrong(**sample)) else { return Ok(()) };
        let what = match (self.are_whole, *wrong > self.largest) {
            (true, true) => format!("it has a sample of {wrong}, but codes of its converter end at {}", self.largest),
            (true, false) => {
                format!("it has a sample of {wrong}, but codes of its converter are whole numbers from 0 on")
            }
            (false, _) => {
                format!(
                    "it has a sample of {wrong}, but its white level is {} ADU",
                    f64::from(self.largest) / OF_ONE_SCALE
                )
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

/// Whether any of some samples is wrong.
struct AnyWrong<'a> {
    check: &'a CodeCheck,
    samples: &'a [f32],
}

impl Kernel for AnyWrong<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.samples.iter().fold(false, |any, sample| any | self.check.is_wrong(*sample))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::vectors::Instructions;

    /// What is wrong, one by one, on every set of instructions and at every place of a row.
    #[test]
    fn what_is_no_code_is_found_wherever_it_stands() {
        let check = |are_whole| CodeCheck { largest: 4095.0, are_whole, is_ours: true, has_doubted: false };
        let cases = [
            (0.0, false, false),
            (-0.0, false, false),
            (4095.0, false, false),
            (4096.0, true, true),
            (1e9, true, true),
            (f32::MAX, true, true),
            (0.5, false, true),
            (4094.9998, false, true),
            (1e-30, false, true),
            (-1.0, false, true),
            (f32::NAN, false, false),
            (f32::INFINITY, false, false),
            (f32::NEG_INFINITY, false, false),
        ];
        for (sample, is_above, is_no_code) in cases {
            for (are_whole, wrong) in [(false, is_above), (true, is_no_code)] {
                for place in 0..37 {
                    let mut samples: Vec<f32> = (0..37_u16).map(f32::from).collect();
                    samples[place] = sample;
                    for set in Instructions::ALL {
                        let kernel = AnyWrong { check: &check(are_whole), samples: &samples };
                        assert_eq!(vectors::run_on(set, kernel), wrong, "{sample} {are_whole} {place} {set:?}");
                    }
                }
            }
        }
    }
}
