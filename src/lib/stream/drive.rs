//! Drives a frame through a stage: bands that move between a few buffers, on one thread or on several.

use super::bands::Bands;
use super::counts::Counts;
use super::outlet::with_outlet;
use super::stage::{RowSink, RowSource, Stage};
use crate::error::Result;
use crate::frame::{Rows, Window};
use rayon::prelude::*;
use std::ops::Range;

/// Drives a whole frame through a stage, band by band; memory is a few bands whatever the height.
///
/// On one thread, bands are read, computed and written in turn. On several, bands are cut into as many pieces as there
/// are threads, and the next band is read and the last one written meanwhile. `progress` hears of the rows done so far.
///
/// # Errors
///
/// Those of the source and the sink, whichever meets the first band that goes wrong.
///
/// # Examples
///
/// ```
/// use cyanometer::stages::mosaic::Mosaic;
/// use cyanometer::stream::{MemoryFrame, Stage, run};
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Adu);
/// # let geometry = Geometry::new(4, 100, &["R", "G", "B"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// // Any reader of frames is a source, any writer a sink; so is a frame in memory.
/// let mut source = MemoryFrame::new(header.clone(), vec![7.0; 4 * 3 * 100]);
/// let stage = Mosaic::new(&header, None)?;
/// let mut sink = MemoryFrame::new(stage.header().clone(), Vec::new());
/// let mut rows_done = 0;
/// run(&stage, &mut source, &mut sink, &mut |rows| rows_done = rows)?;
/// assert_eq!(rows_done, 100);
/// assert_eq!(sink.samples, vec![7.0; 4 * 100]);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub fn run<S: Stage>(
    stage: &S,
    source: &mut dyn RowSource,
    sink: &mut dyn RowSink,
    progress: &mut dyn FnMut(usize),
) -> Result<Counts> {
    let threads = rayon::current_num_threads();
    let output = &stage.header().geometry;
    let height = source.header().geometry.height;
    let bands = Bands::new([source], height, stage.reach(), Some(output), threads);
    let overlaps = threads > 1 && bands.are_several();
    let mut counts = Counts::default();
    with_outlet(sink, overlaps, |outlet| {
        bands.each(overlaps, |band| {
            let samples = band.rows().len() * output.row_samples();
            let counted = outlet.make(samples, |made| make(stage, band.window(0), band.rows(), made, threads))?;
            counts = counts.plus(counted);
            progress(band.rows().end);
            Ok(())
        })
    })?;
    Ok(counts)
}

/// Makes such rows in `made`, and gives what was counted.
pub(super) fn make<S: Stage>(
    stage: &S,
    window: Window<'_, S::Input>,
    rows: Range<usize>,
    made: &mut [f32],
    threads: usize,
) -> Counts {
    let output = &stage.header().geometry;
    let apply = |first: usize, samples: &mut [f32]| {
        stage.apply(window, Rows::new(first, output.width, output.channels.len(), samples))
    };
    if threads == 1 {
        return apply(rows.start, made);
    }
    let piece_rows = rows.len().div_ceil(threads);
    let pieces = made.par_chunks_mut(piece_rows * output.row_samples()).enumerate();
    let counts = pieces.map(|(piece, samples)| apply(rows.start + piece * piece_rows, samples));
    counts.reduce(Counts::default, Counts::plus)
}
