//! What was seen of the samples of a region.

use super::region::Region;
use crate::error::Result;
use crate::frame::{Window, to_sample};
use crate::metadata::FrameHeader;
use crate::numerics::moments::{self, Moments};
use crate::numerics::sums::Limits;
use crate::stream::{RowSource, fold};
use crate::units::QuantityKind;
use rayon::prelude::*;

/// What one region has seen so far.
#[derive(Debug, Clone)]
pub(super) struct Tally {
    /// Of the channels, observed together.
    pub channels: Moments,
    /// Of the classes of a CFA plane, each by itself.
    pub classes: Option<[Moments; 3]>,
}

/// Which samples of a frame count as clipped: codes at or beyond either end, electrons at full well or above.
pub(super) fn rails(frame: &FrameHeader) -> Limits {
    let metadata = &frame.metadata;
    // What transfer or its undoing has mixed lies at no rail any more; nor does a code less a dark frame's.
    let transferred = metadata.noise.as_ref().is_some_and(|noise| noise.cte.is_some());
    if metadata.correction.is_some() || (transferred && metadata.quantity == QuantityKind::Electrons) {
        return Limits::NONE;
    }
    let limits = match metadata.quantity {
        QuantityKind::Adu if metadata.demosaic.is_none() => {
            metadata.white_level_adu.map(|white| Limits { low: 0.0, high: to_sample(white) })
        }
        QuantityKind::Electrons if metadata.demosaic.is_none() => {
            let full_well_e = metadata.sensor.as_ref().map(|sensor| sensor.full_well_e);
            full_well_e.map(|e| Limits { high: to_sample(e), ..Limits::NONE })
        }
        _ => None,
    };
    limits.unwrap_or(Limits::NONE)
}

/// Pixels of a region that are worth a task of their own.
const SHARE: usize = 1 << 14;

/// Reads a whole frame and sums up its regions, each of which lies within it.
///
/// Each row of a region is summed by itself and merged in order, whatever the threads: the rows of one region side by side
/// where regions are few, or regions side by side.
pub(super) fn tallies(source: &mut dyn RowSource, regions: &[Region], rails: Limits) -> Result<Vec<Tally>> {
    let frame = source.header().clone();
    let empty = || Tally::new(&frame);
    let mut tallies: Vec<Tally> = regions.iter().map(|_| empty()).collect();
    let mut of_rows: Vec<Tally> = Vec::new();
    fold([source], frame.geometry.height, |band| {
        let (rows, window) = (band.rows(), band.window(0));
        if regions.len() < rayon::current_num_threads() {
            for (region, tally) in regions.iter().zip(&mut tallies) {
                let seen = region.rows_among(&rows);
                if seen.len() > of_rows.len() {
                    of_rows.resize_with(seen.len(), empty);
                }
                let side_by_side = of_rows[..seen.len()].par_iter_mut().zip(seen.clone());
                side_by_side.with_min_len((SHARE / region.width).max(1)).for_each(|(of_row, y)| {
                    of_row.clear();
                    of_row.add_row(&frame, window, y, *region, rails);
                });
                for of_row in &of_rows[..seen.len()] {
                    tally.merge(of_row);
                }
            }
        } else {
            let met = regions.par_iter().zip(&mut tallies).filter(|(region, _)| !region.rows_among(&rows).is_empty());
            met.for_each_init(empty, |of_row, (region, tally)| {
                for y in region.rows_among(&rows) {
                    of_row.clear();
                    of_row.add_row(&frame, window, y, *region, rails);
                    tally.merge(of_row);
                }
            });
        }
        Ok(())
    })?;
    Ok(tallies)
}

impl Tally {
    fn new(frame: &FrameHeader) -> Self {
        let channels = frame.geometry.channels.len();
        let is_cfa_plane = channels == 1 && frame.metadata.cfa.is_some();
        let classes = is_cfa_plane.then(|| [const { 1 }; 3].map(Moments::new));
        Self { channels: Moments::new(channels), classes }
    }

    fn clear(&mut self) {
        self.channels.clear();
        self.classes.iter_mut().flatten().for_each(Moments::clear);
    }

    /// Takes in row `y` of a region; the moments of a CFA plane are merged from those of its two classes.
    fn add_row(&mut self, frame: &FrameHeader, window: Window<'_>, y: usize, region: Region, rails: Limits) {
        let line = |channel: usize| &window.row(y.cast_signed(), channel)[region.x..][..region.width];
        let Some((moments, pattern)) = self.classes.as_mut().zip(frame.metadata.cfa) else {
            return self.channels.add_within(region.width, line, rails);
        };
        let classes = pattern.row_classes(frame.geometry.origin, y);
        let classes = [0, 1].map(|parity| classes[(region.x + parity) % 2] as usize);
        if let Ok(moments) = moments.get_disjoint_mut(classes) {
            moments::add_alternating(moments, line(0), rails);
        }
        for class in classes {
            self.channels.merge(&moments[class]);
        }
    }

    fn merge(&mut self, row: &Self) {
        self.channels.merge(&row.channels);
        for (mine, theirs) in self.classes.iter_mut().flatten().zip(row.classes.iter().flatten()) {
            mine.merge(theirs);
        }
    }
}
