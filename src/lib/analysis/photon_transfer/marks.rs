//! Marks beside the samples of frames that were corrected, whose levels no longer tell which are saturated.

use super::sites::Site;
use crate::frame::Geometry;
use crate::metadata::FrameHeader;
use crate::stages::saturation::{MASK_LAYER, SATURATED, bits};
use std::ops::Range;

/// Whether the layer of marks stands behind the channels of a frame.
pub fn is_marked(frame: &FrameHeader) -> bool {
    let channels = &frame.geometry.channels;
    channels.len() > 1 && channels.last().is_some_and(|last| last == MASK_LAYER)
}

/// The head of a frame but for the layer of marks.
pub fn without_marks(frame: &FrameHeader) -> FrameHeader {
    let mut header = frame.clone();
    if is_marked(frame) {
        header.geometry.channels.pop();
    }
    header
}

/// Takes the layer of marks, the last of their channels, out of so many rows; `geometry` is that without it.
pub fn split_off(samples: &mut Vec<f32>, marks: &mut Vec<f32>, rows: usize, geometry: &Geometry) {
    let own = geometry.row_samples();
    let stored = own + geometry.width;
    marks.clear();
    for row in 0..rows {
        marks.extend_from_slice(&samples[row * stored + own..(row + 1) * stored]);
        samples.copy_within(row * stored..row * stored + own, row * own);
    }
    samples.truncate(rows * own);
}

/// Marks of a row of a grid in all frames, and which of its photosites were mended in any of them.
pub struct Marks {
    columns: usize,
    frames: usize,
    /// `[frame][column]`; empty where no frame has any.
    row: Vec<f64>,
    /// More than so many mended photosites are not named.
    most: usize,
    /// Columns and rows of photosites that are marked as defective, interpolated or unknown, row by row.
    pub mended: Vec<[usize; 2]>,
}

impl Marks {
    /// None yet, of a grid in so many frames, of which `most` mended photosites and one more are named.
    pub fn new(columns: usize, frames: usize, most: usize) -> Self {
        Self { columns, frames, row: Vec::new(), most, mended: Vec::new() }
    }

    /// Takes those of row `row` of the grid, which stand at such a place in those of each frame that has any.
    pub fn read(&mut self, site: &Site, marks: &[Vec<f32>], place: Range<usize>, row: usize) {
        self.row.clear();
        if marks.iter().all(Vec::is_empty) {
            return;
        }
        self.row.resize(self.columns * self.frames, 0.0);
        for (own, marks) in self.row.chunks_exact_mut(self.columns).zip(marks).filter(|(_, marks)| !marks.is_empty()) {
            site.gather(&marks[place.clone()], own);
        }
        let is_mended = |column: &usize| (0..self.frames).any(|frame| self.of(frame, *column) & !SATURATED != 0);
        let own = (0..self.columns).filter(is_mended).map(|column| [column, row]);
        let own: Vec<[usize; 2]> = own.take((self.most + 1).saturating_sub(self.mended.len())).collect();
        self.mended.extend(own);
    }

    /// Whether any frame has marks in this row.
    pub fn is_any(&self) -> bool {
        !self.row.is_empty()
    }

    /// Whether a sample of the row is marked as saturated.
    pub fn is_saturated(&self, frame: usize, column: usize) -> bool {
        self.of(frame, column) & SATURATED != 0
    }

    fn of(&self, frame: usize, column: usize) -> u32 {
        #[expect(clippy::cast_possible_truncation, reason = "marks are small whole numbers")]
        self.row.get(frame * self.columns + column).map_or(0, |mark| bits(*mark as f32))
    }
}
