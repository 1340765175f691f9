//! Samples up to 1, as programs write them that count white as 1, where nothing tells a white level.

use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::text::in_digits;
use crate::units::QuantityKind;

/// The largest sample so far, and whether any is no whole number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ShareCheck {
    largest: f32,
    has_fraction: bool,
}

impl ShareCheck {
    /// For codes of a camera whose white level is not known.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let is_open = metadata.quantity == QuantityKind::Adu
            && metadata.history.is_empty()
            && metadata.white_level_adu.is_none()
            && metadata.adc.is_none();
        is_open.then(Self::default)
    }

    /// Looks at rows of the frame.
    pub fn look(&mut self, rows: &[f32]) {
        // What is above 1 is no share.
        if self.largest <= 1.0 {
            self.largest = rows.iter().copied().fold(self.largest, f32::max);
            self.has_fraction |= rows.iter().any(|sample| sample.fract() != 0.0);
        }
    }

    /// Has the program warn of shares, once all rows were looked at.
    pub fn end(&self, frame: &FrameHeader) {
        if self.has_fraction && self.largest > 0.0 && self.largest <= 1.0 {
            register::doubt(format!(
                "{}: its samples are fractions of up to {}, as of programs that count white as 1, and they count as ADU; if they are such, give \
                 1 as its white level, for relative XYZ, or multiply them by that of the camera",
                frame.name,
                in_digits(f64::from(self.largest), 4)
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_up_to_one_are_shares() {
        let of = |samples: &[f32]| {
            let mut check = ShareCheck::default();
            samples.chunks(2).for_each(|rows| check.look(rows));
            check.has_fraction && check.largest <= 1.0
        };
        assert!(of(&[0.0, 0.25, 0.75, 1.0]) && of(&[-0.01, 0.5]));
        // Codes of dark frames, and averages above 1.
        assert!(!of(&[0.0, 1.0, 1.0]) && !of(&[0.25, 0.5, 1.5, 0.5]));
    }
}
