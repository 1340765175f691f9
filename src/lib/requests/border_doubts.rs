//! What speaks against a black level that the masked border of a frame tells: that light reaches it, or that it is not the border.

use super::border_lines::{Lean, Z};
use super::dark_levels::most_dark_signal;
use super::other_sensor::of_another_sensor;
use crate::camera::levels::{BlackLevel, near_black};
use crate::error::Result;
use crate::metadata::FrameHeader;
use crate::numerics::cut_off::AtZero;
use crate::text::percent_in_decimals;

/// The level of a border.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeasuredLevel {
    /// Of the 2×2 sites.
    pub levels: [f64; 4],
    /// What each is uncertain by, a variance.
    pub site_adu2: f64,
    /// How uneven the border is.
    pub lean: Option<Lean>,
    /// How many of its photosites read 0, and 1.
    pub low: AtZero,
}

impl MeasuredLevel {
    /// Warnings of a level that is not that of no light, by the metadata of the frame, which do not know it yet.
    ///
    /// # Errors
    ///
    /// Those of [`FrameHeader::black_levels`].
    pub(super) fn doubts(&self, frame: &FrameHeader) -> Result<Vec<String>> {
        let known = frame.black_levels()?.filter(|known| !known.has_deltas()).map(|known| known.level());
        // That of a DNG which tells none is 0 by the specification.
        let told = known.filter(|known| known.uniform() != Some(0.0));
        let other = told.and_then(|known| self.other_level(frame, known));
        let of_sensor = || {
            let level = BlackLevel::Sites(self.levels);
            of_another_sensor(frame, level, &format!("the level of its border, {:.1} ADU,", level.mean()))
        };
        Ok(other.or_else(of_sensor).into_iter().chain(self.unevenness(frame)).chain(self.cut_off(frame)).collect())
    }

    /// A warning of a level that is another than that of the metadata, by more than habit, noise and the dark signal of the exposure.
    fn other_level(&self, frame: &FrameHeader, known: BlackLevel) -> Option<String> {
        let noise = Z * self.site_adu2.sqrt();
        let differs = |[read, known]: &[f64; 2]| {
            let off = near_black(*known) + noise;
            read - known < -off || read - known > off + most_dark_signal(frame, *known)
        };
        let [read, known] =
            std::iter::zip(self.levels, known.sites()).map(|(read, known)| [read, known]).find(differs)?;
        Some(format!(
            "{}: its masked photosites (`masked_areas`) read {read:.1} ADU, and its metadata have a black level of {known:.1} ADU; one of the two \
             is wrong",
            frame.name
        ))
    }

    /// A warning of a border whose samples are cut off at code 0.
    fn cut_off(&self, frame: &FrameHeader) -> Option<String> {
        /// Of less the tails of no law are known, and levels are told to so many ADU.
        const LEAST_SHARE: f64 = 0.01;
        const LEAST_ADU: f64 = 0.02;
        let excess = self.low.excess(1.0).filter(|excess| self.low.share() > LEAST_SHARE && *excess > LEAST_ADU)?;
        Some(format!(
            "{}: {} % of its masked photosites (`masked_areas`) read 0, where codes are cut off; as far as they are normal their mean is {excess:.2} \
             ADU too high, and the frame too low by as much behind it; have the camera add an offset, or give its bias, --black",
            frame.name,
            percent_in_decimals(self.low.share(), 0)
        ))
    }

    /// A warning of a border of which a part is at another level.
    fn unevenness(&self, frame: &FrameHeader) -> Option<String> {
        let mean = BlackLevel::Sites(self.levels).mean();
        let lean = self.lean.filter(|lean| lean.median.abs() > near_black(mean) + Z * lean.deviation)?;
        Some(format!(
            "{}: its masked photosites (`masked_areas`) are uneven: their mean is {mean:.1} ADU, but half of their {} are at {:.1} ADU; does light \
             reach the others?",
            frame.name,
            lean.axis.name(),
            mean + lean.median
        ))
    }
}
