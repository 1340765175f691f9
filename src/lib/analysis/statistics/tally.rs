//! What was seen of the samples of a region.

use super::levels::Levels;
use super::lines::LineSums;
use super::region::Region;
use crate::cfa::Class;
use crate::error::Result;
use crate::frame::Window;
use crate::metadata::FrameHeader;
use crate::numerics::moments::{self, Moments};
use crate::numerics::sums::Limits;
use crate::stream::{RowSource, fold};
use rayon::prelude::*;

/// What one region has seen so far.
#[derive(Debug, Clone)]
pub(super) struct Tally {
    /// Of the channels, observed together.
    pub channels: Moments,
    /// Of the classes of a CFA plane, each by itself.
    pub classes: Option<[Moments; 3]>,
    /// Of rows and columns, where they are tested.
    pub lines: Option<LineSums>,
}

/// Pixels of a region that are worth a task of their own.
const SHARE: usize = 1 << 14;

/// Reads a whole frame and sums up its regions, each of which lies within it.
///
/// Each row of a region is summed by itself and merged in order, whatever the threads: the rows of one region side by side
/// where regions are few, or regions side by side.
pub(super) fn tallies(
    source: &mut dyn RowSource,
    regions: &[Region],
    levels: &Levels,
    are_tested: bool,
) -> Result<Vec<Tally>> {
    let frame = source.header().clone();
    let empty = || Tally::new(&frame, levels);
    let lines = |region: &Region| LineSums::of(&frame, *region).filter(|_| are_tested);
    let mut tallies: Vec<Tally> = regions.iter().map(|region| Tally { lines: lines(region), ..empty() }).collect();
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
                let sum_rows = || {
                    side_by_side.with_min_len((SHARE / region.width).max(1)).for_each(|(of_row, y)| {
                        of_row.clear();
                        of_row.add_row(&frame, window, y, *region, levels);
                    });
                };
                let lines = &mut tally.lines;
                rayon::join(sum_rows, || lines.iter_mut().for_each(|lines| lines.add_all(window, seen.clone())));
                for of_row in &of_rows[..seen.len()] {
                    tally.merge(of_row);
                }
            }
        } else {
            let met = regions.par_iter().zip(&mut tallies).filter(|(region, _)| !region.rows_among(&rows).is_empty());
            met.for_each_init(empty, |of_row, (region, tally)| {
                for y in region.rows_among(&rows) {
                    of_row.clear();
                    of_row.add_row(&frame, window, y, *region, levels);
                    tally.merge(of_row);
                }
                tally.lines.iter_mut().for_each(|lines| lines.add_all(window, region.rows_among(&rows)));
            });
        }
        Ok(())
    })?;
    Ok(tallies)
}

impl Tally {
    fn new(frame: &FrameHeader, levels: &Levels) -> Self {
        let classes = levels.array.map(|_| [const { 1 }; 3].map(Moments::new));
        Self { channels: Moments::new(frame.geometry.channels.len()), classes, lines: None }
    }

    fn clear(&mut self) {
        self.channels.clear();
        self.classes.iter_mut().flatten().for_each(Moments::clear);
    }

    /// Takes in row `y` of a region; the moments of a CFA plane are merged from those of its classes.
    fn add_row(&mut self, frame: &FrameHeader, window: Window<'_>, y: usize, region: Region, levels: &Levels) {
        let line = |channel: usize| &window.row(y.cast_signed(), channel)[region.x..][..region.width];
        let limits = levels.common_limits();
        let (Some(classes), Some(array)) = (&mut self.classes, levels.array) else {
            self.channels.add_within(region.width, line, limits.unwrap_or(Limits::NONE));
            if limits.is_none() {
                for (plane, beyond) in self.channels.beyond.iter_mut().enumerate() {
                    *beyond += beyond_limits(line(plane).iter(), levels.limits_of_plane(plane));
                }
            }
            return;
        };
        let Some(pattern) = array.bayer() else {
            let [x0, y0] = frame.geometry.origin.map(i64::from);
            for (class, moments) in Class::ALL.into_iter().zip(classes) {
                let is_seen = |x: usize| array.class(x0 + (region.x + x) as i64, y0 + y as i64) == Some(class);
                let seen = line(0).iter().enumerate().filter(|(x, _)| is_seen(*x));
                let samples: Vec<f32> = seen.map(|(_, sample)| *sample).collect();
                moments.add_within(samples.len(), |_| &samples, levels.limits(class));
                self.channels.merge(moments);
            }
            return;
        };
        let of_row = pattern.row_classes(frame.geometry.origin, y);
        let of_row = [0, 1].map(|parity| of_row[(region.x + parity) % 2]);
        if let Ok(moments) = classes.get_disjoint_mut(of_row.map(|class| class as usize)) {
            moments::add_alternating(moments, line(0), limits.unwrap_or(Limits::NONE));
        }
        for (parity, class) in of_row.into_iter().enumerate() {
            let moments = &mut classes[class as usize];
            if limits.is_none() {
                moments.beyond[0] += beyond_limits(line(0).iter().skip(parity).step_by(2), levels.limits(class));
            }
            self.channels.merge(moments);
        }
    }

    fn merge(&mut self, row: &Self) {
        self.channels.merge(&row.channels);
        for (mine, theirs) in self.classes.iter_mut().flatten().zip(row.classes.iter().flatten()) {
            mine.merge(theirs);
        }
    }
}

/// How many samples lie at limits or beyond.
fn beyond_limits<'a>(samples: impl Iterator<Item = &'a f32>, limits: Limits) -> u64 {
    samples.filter(|sample| limits.reached(**sample)).count() as u64
}
