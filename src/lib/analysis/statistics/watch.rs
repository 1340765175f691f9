//! Keeps saturated pixels out of statistics, and counts them region by region.

use super::region::Region;
use crate::error::Result;
use crate::metadata::FrameHeader;
use crate::propagation::saturation;
use crate::stages::saturation::{FullLevels, MASK_LAYER, samples_tell};
use crate::stream::RowSource;

/// What becomes of pixels that were made of saturated samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Saturated {
    /// They are left out.
    #[default]
    LeftOut,
    /// They count as others do.
    Kept,
}

/// The rows of a frame without its layer of marks, marked pixels as NaN where they are left out.
pub(super) struct Watch<'a> {
    source: &'a mut dyn RowSource,
    header: FrameHeader,
    /// Place of the layer among the channels of the source.
    layer: Option<usize>,
    /// Channels of the source that are handed on: the first.
    kept: usize,
    /// Levels from which samples are full, where no layer says it.
    levels: Option<FullLevels>,
    leaves_out: bool,
    regions: Vec<Region>,
    counts: Vec<u64>,
    rows_read: usize,
    buffer: Vec<f32>,
    marks: Vec<f32>,
}

impl<'a> Watch<'a> {
    /// Watches `source`. Samples of photosites always count, as the records that they are, and so do the formulas that
    /// predict them.
    pub fn new(source: &'a mut dyn RowSource, saturated: Saturated, regions: &[Region]) -> Self {
        let mut header = source.header().clone();
        let layer = header.geometry.channels.iter().position(|channel| channel == MASK_LAYER);
        // What other programs call so is measured as any channel; ours comes last.
        let layer = layer.filter(|layer| *layer > 0 && !header.metadata.history.is_empty());
        if let Some(layer) = layer {
            header.geometry.channels.truncate(layer);
            if saturated == Saturated::Kept && header.leads_with_three_planes() {
                // What uncertainty says of marked pixels is infinite, and would leave them out.
                header.geometry.channels.truncate(3);
            }
        }
        let kept = header.geometry.channels.len();
        let levels =
            FullLevels::of(&header).filter(|levels| layer.is_none() && saturation::is_possible(&header, levels));
        let leaves_out = saturated == Saturated::LeftOut && (layer.is_some() || !samples_tell(&header));
        Self {
            source,
            header,
            layer,
            kept,
            levels,
            leaves_out,
            regions: regions.to_vec(),
            counts: vec![0; regions.len()],
            rows_read: 0,
            buffer: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// Saturated pixels of each region, and whether they were left out.
    pub fn seen(self) -> (Vec<u64>, bool) {
        (self.counts, self.leaves_out)
    }

    /// Takes in one row of the source: marks, counts, hands on.
    fn take(&mut self, row: &[f32], samples: &mut Vec<f32>) {
        let width = self.header.geometry.width;
        let y = self.rows_read;
        self.rows_read += 1;
        let start = samples.len();
        self.marks.clear();
        let found = match (self.layer, &self.levels) {
            (Some(layer), _) => {
                samples.extend_from_slice(&row[..self.kept * width]);
                self.marks.extend_from_slice(&row[layer * width..][..width]);
                self.marks.iter().any(|mark| *mark != 0.0)
            }
            (None, Some(levels)) => {
                samples.extend_from_slice(row);
                self.marks.resize(width, 0.0);
                // Layers of uncertainty follow the samples.
                let planes = row.chunks_exact(width).take(if self.header.leads_with_three_planes() { 3 } else { 1 });
                planes.enumerate().map(|(channel, line)| levels.mark(y, channel, line, &mut self.marks)).sum::<u64>()
                    > 0
            }
            (None, None) => {
                samples.extend_from_slice(row);
                false
            }
        };
        if !found {
            return;
        }
        for (region, count) in self.regions.iter().zip(&mut self.counts) {
            if (region.y..region.y + region.height).contains(&y) {
                let marks = &self.marks[region.x..region.x + region.width];
                *count += marks.iter().filter(|mark| **mark != 0.0).count() as u64;
            }
        }
        if self.leaves_out {
            for line in samples[start..].chunks_exact_mut(width) {
                for (sample, mark) in line.iter_mut().zip(&self.marks) {
                    *sample = if *mark == 0.0 { *sample } else { f32::NAN };
                }
            }
        }
    }
}

impl RowSource for Watch<'_> {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn natural_rows(&self) -> usize {
        self.source.natural_rows()
    }

    fn may_wait(&self) -> bool {
        self.source.may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        if self.layer.is_none() && self.levels.is_none() {
            return self.source.read(rows, samples);
        }
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        self.source.read(rows, &mut buffer)?;
        for row in buffer.chunks_exact(buffer.len() / rows.max(1)) {
            self.take(row, samples);
        }
        self.buffer = buffer;
        Ok(())
    }
}
