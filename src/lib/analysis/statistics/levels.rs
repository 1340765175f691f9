//! The levels of a frame that statistics need: where samples are clipped, and what no light reads.

use crate::camera::levels::BlackLevels;
use crate::cfa::{Class, FilterArray};
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::numerics::sums::Limits;
use crate::units::QuantityKind;
use std::ops::Range;

/// Levels of a frame.
#[derive(Debug, Clone)]
pub(super) struct Levels {
    /// The filter array of a plane whose classes R, G and B are told apart.
    pub array: Option<FilterArray>,
    rails: Rails,
    /// None where the metadata do not know it.
    black: Option<BlackLevels>,
}

/// Which samples of a frame count as clipped.
#[derive(Debug, Clone, Copy)]
enum Rails {
    /// The same of all planes and classes.
    All(Limits),
    /// By class.
    Classes([Limits; 3]),
}

/// Mean black level of a region, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeanBlack {
    /// Of all its photosites.
    pub whole: f64,
    /// Of those of R, G and B.
    pub classes: [f64; 3],
}

impl Levels {
    /// The levels of a frame.
    ///
    /// # Errors
    ///
    /// Those of [`FrameHeader::black_levels`].
    pub fn of(frame: &FrameHeader) -> Result<Self> {
        let metadata = &frame.metadata;
        let black = match metadata.quantity {
            QuantityKind::Adu => frame.black_levels()?,
            QuantityKind::Electrons => metadata.dark_signal_e.map(BlackLevels::uniform_at),
            QuantityKind::Unspecified => None,
            _ => Some(BlackLevels::uniform_at(0.0)),
        };
        let is_plane = frame.geometry.channels.len() == 1;
        let array = metadata.cfa.filter(|array| is_plane && array.has_three_classes());
        Ok(Self { array, rails: Rails::of(frame), black })
    }

    /// Whether any samples count as clipped.
    pub fn has_rails(&self) -> bool {
        match self.rails {
            Rails::All(limits) => !limits.high.is_nan(),
            Rails::Classes(_) => true,
        }
    }

    /// The limits that all classes share; none where they differ.
    pub fn common_limits(&self) -> Option<Limits> {
        match self.rails {
            Rails::All(limits) => Some(limits),
            Rails::Classes(_) => None,
        }
    }

    /// The limits of a class.
    pub fn limits(&self, class: Class) -> Limits {
        match self.rails {
            Rails::All(limits) => limits,
            Rails::Classes(limits) => limits[class as usize],
        }
    }

    /// The limits of a plane, by its place.
    pub fn limits_of_plane(&self, index: usize) -> Limits {
        match (self.rails, Class::ALL.get(index)) {
            (Rails::All(limits), _) => limits,
            (Rails::Classes(limits), Some(class)) => limits[*class as usize],
            (Rails::Classes(_), None) => Limits::NONE,
        }
    }

    /// The mean black level of a region: columns and rows of the frame; NaN where it is not known.
    pub fn mean_black(&self, frame: &FrameHeader, columns: Range<usize>, rows: Range<usize>) -> MeanBlack {
        let Some(levels) = &self.black else {
            return MeanBlack { whole: f64::NAN, classes: [f64::NAN; 3] };
        };
        if let Some(level) = levels.uniform() {
            return MeanBlack { whole: level, classes: [level; 3] };
        }
        let [x0, y0] = frame.geometry.origin.map(i64::from);
        let (mut sums, mut counts) = ([0.0; 4], [0_u64; 4]);
        for y in rows {
            let black = levels.row(y);
            for x in columns.clone() {
                let class = self.array.and_then(|array| array.class(x0 + x as i64, y0 + y as i64));
                let level = black.at(x);
                for place in class.map(|class| class as usize).into_iter().chain([3]) {
                    sums[place] += level;
                    counts[place] += 1;
                }
            }
        }
        let mean = |place: usize| sums[place] / counts[place] as f64;
        MeanBlack { whole: mean(3), classes: [0, 1, 2].map(mean) }
    }
}

impl Rails {
    /// Codes at or beyond either end, electrons at full well or above.
    fn of(frame: &FrameHeader) -> Self {
        let metadata = &frame.metadata;
        // What transfer or its undoing has mixed lies at no rail any more; nor does a code less a dark frame's, or an average.
        let is_mixed = metadata.correction.is_some() || metadata.average.is_some();
        if is_mixed || (metadata.is_transferred() && metadata.quantity == QuantityKind::Electrons) {
            return Self::All(Limits::NONE);
        }
        let codes = |white: f64| Limits { low: 0.0, high: to_sample(white) };
        let rails = match metadata.quantity {
            QuantityKind::Adu if metadata.demosaic.is_none() => metadata.white_level_adu.map(|white| {
                // Of a plane whose classes are unknown only the highest code is surely clipped.
                let is_told_apart =
                    frame.has_three_planes() || metadata.cfa.is_some_and(FilterArray::has_three_classes);
                match white.uniform() {
                    Some(white) => Self::All(codes(white)),
                    None if is_told_apart => Self::Classes(white.classes().map(codes)),
                    None => Self::All(codes(white.largest())),
                }
            }),
            QuantityKind::Electrons if metadata.demosaic.is_none() => {
                let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
                readout.map(|readout| Self::All(Limits { high: to_sample(readout.full_well_e), ..Limits::NONE }))
            }
            _ => None,
        };
        rails.unwrap_or(Self::All(Limits::NONE))
    }
}
