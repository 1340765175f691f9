//! Takes in the rows of one or several frames, band by band: what ends a chain, or makes one frame of several.

use super::bands::{Band, Bands};
use super::outlet::{Outlet, with_outlet};
use super::stage::{RowSink, RowSource};
use crate::error::Result;

/// Gives the next `rows` rows of all sources to `take`, in step, band by band; memory is a few bands whatever the height.
/// Rows count from 0, where the sources stand.
///
/// On several threads, the next band is read while `take` works on the last. What it makes of the rows must not depend on
/// how they are cut into bands.
///
/// # Errors
///
/// Those of the sources and of `take`, whichever meets the first band that goes wrong; of two sources the one given first.
///
/// # Panics
///
/// When a source has fewer rows.
pub fn fold<'a>(
    sources: impl IntoIterator<Item = &'a mut dyn RowSource>,
    rows: usize,
    take: impl FnMut(&Band) -> Result<()>,
) -> Result<()> {
    let threads = rayon::current_num_threads();
    let bands = Bands::new(sources, rows, 0, None, threads);
    let is_ahead = threads > 1 && bands.are_several();
    bands.each(is_ahead, take)
}

/// As [`fold`], and writes the rows of a frame that `take` makes meanwhile.
///
/// # Errors
///
/// Those of the sources, of `take` and of the sink, whichever meets the first band that goes wrong.
///
/// # Panics
///
/// When a source has fewer rows.
pub fn fold_into<'a>(
    sources: impl IntoIterator<Item = &'a mut dyn RowSource>,
    rows: usize,
    sink: &mut dyn RowSink,
    mut take: impl FnMut(&Band, &mut Outlet<'_>) -> Result<()>,
) -> Result<()> {
    let threads = rayon::current_num_threads();
    let bands = Bands::new(sources, rows, 0, None, threads);
    let overlaps = threads > 1 && bands.are_several();
    with_outlet(sink, overlaps, |outlet| bands.each(overlaps, |band| take(band, outlet)))
}
