//! Samples above the level up to which a file says that they are linear in light.

use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::text::{in_decimals, percent_in_decimals};

/// How many samples lie above that level, and are not saturated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinearCheck {
    /// The share of the range between black and white, and the level, ADU.
    limit: (f64, f64),
    from: f32,
    white: f32,
    above: u64,
    count: u64,
}

impl LinearCheck {
    /// Of a frame whose file tells such a limit.
    pub fn of(frame: &FrameHeader, limit: (f64, f64)) -> Self {
        let white = frame.metadata.white_level_adu.map_or(f64::INFINITY, |white| white.largest());
        let [from, white] = [limit.1, white].map(crate::frame::to_sample);
        Self { limit, from, white, above: 0, count: 0 }
    }

    /// Looks at rows of the frame.
    pub fn look(&mut self, rows: &[f32]) {
        self.count += rows.len() as u64;
        self.above += rows.iter().filter(|sample| **sample > self.from && **sample < self.white).count() as u64;
    }

    /// Has the program warn of such samples, once all rows were looked at.
    pub fn end(&self, frame: &FrameHeader) {
        if self.above > 0 {
            let (share, level) = self.limit;
            let problem = format!(
                "lie above {} ADU and below saturation, where the response may be far from linear (LinearResponseLimit {share}): they count as \
                 linear; expose less, or pass over what is so bright",
                in_decimals(level, 1)
            );
            let (above, percent) = (self.above, percent_in_decimals(self.above as f64 / self.count.max(1) as f64, 2));
            let text = format!("{}: {above} of its samples ({percent} %) {problem}", frame.name);
            register::doubt_of_frame(problem, text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::units::QuantityKind;

    #[test]
    fn samples_between_the_limit_and_saturation_count() {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.white_level_adu = Some(4000.0.into());
        let mut frame = FrameHeader { name: "a".into(), geometry: Geometry::new(7, 1, &["Y"]), metadata };
        let above = |frame: &FrameHeader| {
            let mut check = LinearCheck::of(frame, (0.9, 3600.0));
            check.look(&[0.0, 3600.0, 3601.0, 3999.0, 4000.0, 4095.0, f32::NAN]);
            check.above
        };
        assert_eq!(above(&frame), 2);
        frame.metadata.white_level_adu = None;
        assert_eq!(above(&frame), 4);
    }
}
