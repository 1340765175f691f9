//! What a stream is made of: sources of rows, stages, sinks of rows.

use super::counts::Counts;
use crate::error::Result;
use crate::frame::{Rows, Window};
use crate::metadata::FrameHeader;
use crate::units::Quantity;

/// Rows of a frame, top to bottom.
pub trait RowSource: Send {
    /// Geometry and metadata.
    fn header(&self) -> &FrameHeader;
    /// The number of rows that the source makes together; asking for multiples of it saves work.
    fn natural_rows(&self) -> usize;
    /// Whether the rows come from another program, which may take any time to give them.
    fn may_wait(&self) -> bool {
        false
    }
    /// Appends the next `rows` rows, laid out as `[row][channel][column]`.
    ///
    /// # Errors
    ///
    /// What the file's reader complains of. Rows beyond the last must not be asked for.
    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()>;
}

/// Takes rows, top to bottom.
pub trait RowSink: Send {
    /// Takes whole rows, laid out as `[row][channel][column]`.
    ///
    /// # Errors
    ///
    /// What the file's writer complains of.
    fn write(&mut self, samples: &[f32]) -> Result<()>;
}

/// Which pixels of the input a pixel of the output is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Footprint {
    /// The one at its place.
    Own,
    /// Those at offsets (column, row), by the parities of the frame's row and column: even row and column first, then odd
    /// columns. What lies beyond the edges is mirrored.
    Around([Vec<[isize; 2]>; 4]),
}

/// A step of the chain: a value with a method from band to band.
///
/// # Examples
///
/// ```
/// use cyanometer::frame::{Geometry, Rows, Window};
/// use cyanometer::metadata::{FrameHeader, Metadata};
/// use cyanometer::stream::{Counts, MemoryFrame, Stage};
/// use cyanometer::units::{Any, QuantityKind};
///
/// /// Exchanges left and right, whatever the samples are.
/// struct Flip(FrameHeader);
///
/// impl Stage for Flip {
///     type Input = Any;
///     type Output = Any;
///
///     fn header(&self) -> &FrameHeader {
///         &self.0
///     }
///
///     fn apply(&self, input: Window<'_>, mut output: Rows<'_>) -> Counts {
///         for y in output.range() {
///             for channel in 0..input.channels() {
///                 output.row(y, channel).copy_from_slice(input.row(y.cast_signed(), channel));
///                 output.row(y, channel).reverse();
///             }
///         }
///         Counts::default()
///     }
/// }
///
/// let (geometry, metadata) = (Geometry::new(2, 2, &["Y"]), Metadata::new(QuantityKind::Adu));
/// let header = FrameHeader { name: "example".into(), geometry, metadata };
/// let frame = MemoryFrame::new(header.clone(), vec![1.0, 2.0, 3.0, 4.0]);
/// let flipped = frame.through(&Flip(header.clone()))?.0;
/// assert_eq!(flipped.samples, [2.0, 1.0, 4.0, 3.0]);
/// assert_eq!(flipped.through(&Flip(header))?.0, frame);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub trait Stage: Sync {
    /// What the samples were.
    type Input: Quantity;
    /// What they become.
    type Output: Quantity;

    /// The head of the frame that comes out.
    fn header(&self) -> &FrameHeader;

    /// Rows above and below that a row of the output depends on.
    fn reach(&self) -> usize {
        0
    }

    /// Which pixels of the input a pixel of the output is made of.
    fn footprint(&self) -> Footprint {
        Footprint::Own
    }

    /// Fills `output` from `input`, which holds the same rows and [`Self::reach`] more on either side.
    ///
    /// What a row becomes must not depend on how the frame is cut into bands.
    fn apply(&self, input: Window<'_, Self::Input>, output: Rows<'_, Self::Output>) -> Counts;
}
