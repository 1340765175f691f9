//! A rectangle of a frame.

use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::propagation::sampling::Place;
use serde::Serialize;
use std::ops::Range;

/// A rectangle of a frame, counted from the frame's own corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Region {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// The plane that a frame was demosaicked from, column, row, columns and rows on the sensor, where it is told.
fn mosaicked(frame: &FrameHeader) -> Option<[i64; 4]> {
    frame.metadata.demosaic.as_ref()?.plane
}

impl Region {
    /// All of a frame.
    pub fn whole(frame: &FrameHeader) -> Self {
        Self { x: 0, y: 0, width: frame.geometry.width, height: frame.geometry.height }
    }

    /// The head of a frame of which it is all.
    pub(super) fn header(&self, frame: &FrameHeader) -> FrameHeader {
        let mut made = frame.clone();
        let geometry = &mut made.geometry;
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "wraps as sensor columns do")]
        let moved = |origin: i32, by: usize| origin.wrapping_add(by as i32);
        geometry.origin = [moved(geometry.origin[0], self.x), moved(geometry.origin[1], self.y)];
        (geometry.width, geometry.height) = (self.width, self.height);
        made
    }

    /// The rows of the frame that belong to the region, among some.
    pub(super) fn rows_among(&self, rows: &Range<usize>) -> Range<usize> {
        self.y.max(rows.start)..(self.y + self.height).min(rows.end)
    }

    /// A place of the same sampling law.
    pub(super) fn place(&self, frame: &FrameHeader) -> Place {
        let geometry = &frame.geometry;
        let own = Place {
            frame: [geometry.width, geometry.height],
            origin: geometry.origin,
            corner: [self.x, self.y],
            size: [self.width, self.height],
        };
        // A crop of demosaicked pixels has samples mirrored where the plane that they were made of ends.
        let whole = mosaicked(frame)
            .filter(|_| frame.geometry.channels.len() > 1)
            .and_then(|plane| own.within(plane))
            .unwrap_or(own);
        whole.canonical(frame.readout().is_ok_and(|readout| readout.black_drift_e > 0.0))
    }

    /// Checks that the region has pixels and lies within a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] otherwise.
    pub fn check(&self, frame: &FrameHeader) -> Result<()> {
        let Self { x, y, width, height } = *self;
        let geometry = &frame.geometry;
        let inside = x.checked_add(width).is_some_and(|end| end <= geometry.width)
            && y.checked_add(height).is_some_and(|end| end <= geometry.height);
        if inside && width > 0 && height > 0 {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "{}: region {x},{y},{width},{height} does not lie within the frame of {}x{}",
            frame.name, geometry.width, geometry.height
        )))
    }
}
