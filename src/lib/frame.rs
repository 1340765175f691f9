//! A frame is a geometry and rows of samples; a band is some of its rows. A stage sees a band through a [`Window`] and
//! fills the [`Rows`] of another; the quantity of the samples is in their types.
//!
//! Samples are `f32`, laid out as `[row][channel][column]`: each row of each channel is one contiguous slice.

use crate::units::{Any, Quantity};
use std::marker::PhantomData;

/// Size, place and channels of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Geometry {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Column and row, on the sensor, of the frame's first sample. A crop keeps it, so that the color filter array
    /// and the noise of each photosite stay true.
    pub origin: [i32; 2],
    /// Channel names in the order of the samples.
    pub channels: Vec<String>,
}

impl Geometry {
    /// A frame at the sensor's corner.
    pub fn new(width: usize, height: usize, channels: &[&str]) -> Self {
        let channels = channels.iter().map(|name| (*name).to_owned()).collect();
        Self { width, height, origin: [0, 0], channels }
    }

    /// The same place with other channels.
    pub fn with_channels(&self, channels: &[&str]) -> Self {
        Self { origin: self.origin, ..Self::new(self.width, self.height, channels) }
    }

    /// Column and row on the sensor of the frame's corner, and its width and height.
    pub fn on_sensor(&self) -> [i64; 4] {
        let [x, y] = self.origin.map(i64::from);
        [x, y, self.width as i64, self.height as i64]
    }

    /// Samples in one row of all channels.
    pub fn row_samples(&self) -> usize {
        self.width * self.channels.len()
    }

    /// Bytes of one row of all channels.
    fn row_bytes(&self) -> usize {
        (self.row_samples() * size_of::<f32>()).max(1)
    }

    /// Rows to ask a source for together that decodes `natural` of them at a time: so many, unless they are too large to
    /// hold more than once.
    pub fn step_rows(&self, natural: usize) -> usize {
        if natural.saturating_mul(self.row_bytes()) <= STEP_BYTES { natural } else { 1 }
    }

    /// Rows of a band for one thread that may begin at any row: as many as fit a cache.
    pub fn cached_rows(&self) -> usize {
        self.band_rows(1, 1)
    }

    /// Rows of a band for so many threads, a multiple of `step`, at least one step.
    pub fn band_rows(&self, step: usize, threads: usize) -> usize {
        let row_bytes = self.row_bytes();
        let band_bytes = if threads > 1 { SHARED_BAND_BYTES } else { BAND_BYTES };
        // Wide frames get at least 4 rows, so that the halo does not become most of the work, while these bytes hold them.
        let fitting = (band_bytes / row_bytes).max((WIDE_BYTES / row_bytes).min(4));
        (fitting / step * step).max(step).min(self.height.max(1))
    }
}

/// The size that a band aims at: those before and after a stage fit a level-2 cache, and memory that is touched for the
/// first time, which costs more than most arithmetic, stays little.
const BAND_BYTES: usize = 1 << 17;
/// The size of bands that several threads read, compute and write: large enough that handing them on costs little.
const SHARED_BAND_BYTES: usize = 1 << 20;
/// What 4 rows of a wide frame may take.
const WIDE_BYTES: usize = 4 << 20;
/// What the rows that a source decodes together may take.
const STEP_BYTES: usize = 4 << 20;

/// The rows of a frame that a stage can see: those it makes, and a halo above and below.
///
/// # Examples
///
/// ```
/// use cyanometer::frame::Window;
///
/// // Rows 1 and 2 of a frame of three rows: two columns, one channel.
/// let window: Window<'_> = Window::new(3, 1, 2, 1, &[3.0, 4.0, 5.0, 6.0]);
/// assert_eq!(window.row(2, 0), [5.0, 6.0]);
/// // Row 3 lies beyond the frame. Edges are mirrored, and the row at the edge does not come twice.
/// assert_eq!(window.row(3, 0), window.row(1, 0));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Window<'a, Q = Any> {
    frame_height: usize,
    first_row: usize,
    width: usize,
    channels: usize,
    samples: &'a [f32],
    quantity: PhantomData<Q>,
}

impl<'a, Q: Quantity> Window<'a, Q> {
    /// A window on `samples`, whose first row is the frame's row `first_row`.
    pub fn new(frame_height: usize, first_row: usize, width: usize, channels: usize, samples: &'a [f32]) -> Self {
        assert!(samples.len().is_multiple_of(width * channels));
        Self { frame_height, first_row, width, channels, samples, quantity: PhantomData }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Rows of the whole frame.
    pub fn frame_height(&self) -> usize {
        self.frame_height
    }

    /// All channels of the frame's row `y`, one after another.
    pub fn all_channels(&self, y: usize) -> &'a [f32] {
        let row_samples = self.channels * self.width;
        &self.samples[(y - self.first_row) * row_samples..][..row_samples]
    }

    /// One channel of the frame's row `y`; rows beyond the frame are mirrored as [`mirror`] says.
    pub fn row(&self, y: isize, channel: usize) -> &'a [f32] {
        let y = mirror(y, self.frame_height);
        let start = ((y - self.first_row) * self.channels + channel) * self.width;
        &self.samples[start..start + self.width]
    }
}

/// The rows that a stage fills in.
///
/// # Examples
///
/// ```
/// use cyanometer::frame::Rows;
///
/// // Rows 5 and 6 of a frame: two columns, one channel.
/// let mut samples = [0.0; 4];
/// let mut rows: Rows<'_> = Rows::new(5, 2, 1, &mut samples);
/// for y in rows.range() {
///     rows.row(y, 0).fill(y as f32);
/// }
/// assert_eq!(samples, [5.0, 5.0, 6.0, 6.0]);
/// ```
#[derive(Debug)]
pub struct Rows<'a, Q = Any> {
    /// The frame's row that comes first.
    pub first_row: usize,
    width: usize,
    channels: usize,
    samples: &'a mut [f32],
    quantity: PhantomData<Q>,
}

impl<'a, Q: Quantity> Rows<'a, Q> {
    /// Rows on `samples`, the first being the frame's row `first_row`.
    pub fn new(first_row: usize, width: usize, channels: usize, samples: &'a mut [f32]) -> Self {
        assert!(samples.len().is_multiple_of(width * channels));
        Self { first_row, width, channels, samples, quantity: PhantomData }
    }

    /// The same rows, to be filled by another for a while.
    pub fn reborrow(&mut self) -> Rows<'_, Q> {
        Rows { samples: &mut *self.samples, ..*self }
    }

    /// The frame's rows that are to be filled.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first_row..self.first_row + self.samples.len() / (self.width * self.channels)
    }

    /// One channel of the frame's row `y`.
    pub fn row(&mut self, y: usize, channel: usize) -> &mut [f32] {
        let start = ((y - self.first_row) * self.channels + channel) * self.width;
        &mut self.samples[start..start + self.width]
    }

    /// The first three channels of the frame's row `y`.
    ///
    /// # Panics
    ///
    /// When the rows do not have three channels.
    pub fn three(&mut self, y: usize) -> [&mut [f32]; 3] {
        self.three_and_rest(y).0
    }

    /// The first three channels of the frame's row `y`, and all samples of those that follow.
    ///
    /// # Panics
    ///
    /// When the rows do not have three channels.
    pub fn three_and_rest(&mut self, y: usize) -> ([&mut [f32]; 3], &mut [f32]) {
        assert!(self.channels >= 3);
        let start = (y - self.first_row) * self.channels * self.width;
        let row = &mut self.samples[start..start + self.channels * self.width];
        let (first, rest) = row.split_at_mut(self.width);
        let (second, rest) = rest.split_at_mut(self.width);
        let (third, rest) = rest.split_at_mut(self.width);
        ([first, second, third], rest)
    }
}

/// What three planes of one frame are called.
pub const THREE_PLANES: [[&str; 3]; 5] =
    [["R", "G", "B"], ["x", "y", "Y"], ["L", "a", "b"], ["L", "u", "v"], ["CCT", "Duv", "Y"]];

/// A channel's name without that of its layer: `R` of `left.R`.
pub fn bare_name(channel: &str) -> &str {
    channel.rsplit('.').next().unwrap_or(channel)
}

/// Rounds a double to the nearest sample.
#[expect(clippy::cast_possible_truncation, reason = "the one place where double results become 32-bit samples")]
pub fn to_sample(value: f64) -> f32 {
    value as f32
}

/// Mirrors an index into `0..length` without repeating the edge: …2 1 | 0 1 2…, which keeps the phase of a color
/// filter array whose period is 2.
pub fn mirror(index: isize, length: usize) -> usize {
    if length == 1 {
        return 0;
    }
    let period = 2 * (length - 1);
    let folded = index.unsigned_abs() % period;
    if folded < length { folded } else { period - folded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirroring_does_not_repeat_the_edge() {
        let seen: Vec<usize> = (-5..9).map(|i| mirror(i, 4)).collect();
        assert_eq!(seen, [1, 2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1, 2]);
        assert_eq!((-3..4).map(|i| mirror(i, 2)).collect::<Vec<_>>(), [1, 0, 1, 0, 1, 0, 1]);
        assert_eq!(mirror(-7, 1), 0);
    }

    #[test]
    fn bands_hold_what_fits_the_cache_in_whole_steps() {
        let frame = Geometry::new(1_024, 2_000, &["R", "G", "B"]);
        assert_eq!([1, 2].map(|threads| frame.band_rows(1, threads)), [10, 85]);
        assert_eq!([1, 2].map(|threads| frame.band_rows(32, threads)), [32, 64]);
        let frame = Geometry::new(30_000, 2_000, &["R", "G", "B"]);
        assert_eq!([1, 2].map(|threads| frame.band_rows(1, threads)), [4, 4]);
        assert_eq!(frame.band_rows(32, 1), 32);
        assert_eq!(Geometry::new(10, 7, &["Y"]).band_rows(16, 1), 7);
        // A block of 32 such rows takes 11.5 MB: it is taken row by row; a small one whole.
        assert_eq!(frame.step_rows(32), 1);
        assert_eq!(Geometry::new(1_332, 1_000, &["R", "G", "B"]).step_rows(32), 32);
    }
}
