//! Keeps saturated pixels out of statistics, and counts them region by region.

use super::region::Region;
use crate::error::Result;
use crate::metadata::FrameHeader;
use crate::propagation::saturation;
use crate::stages::saturation::{
    BEYOND_MODEL, CORRECTED, DEFECTIVE, FullLevels, MASK_LAYER, Marked, SATURATED, bits, samples_tell, untold,
};
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

/// Marked pixels of a region, by what the marks mean; one may have several.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Marks {
    pub saturated: u64,
    pub defective: u64,
    pub corrected: u64,
    pub beyond_model: u64,
    /// Those that are left out.
    pub left_out: u64,
}

impl Marks {
    fn add(&mut self, bits: u32, left_out: u32) {
        let has = |bit: u32| u64::from(bits & bit != 0);
        self.saturated += has(SATURATED);
        self.defective += has(DEFECTIVE);
        self.corrected += has(CORRECTED);
        self.beyond_model += has(BEYOND_MODEL);
        self.left_out += has(left_out);
    }
}

/// The rows of a frame without its layer of marks, marked pixels as NaN where they are left out.
pub(super) struct Watch<'a> {
    source: MarkedRows<'a>,
    header: FrameHeader,
    regions: Vec<Region>,
    counts: Vec<Marks>,
    rows_read: usize,
    buffer: Vec<f32>,
    /// Marks of all pixels, where they are kept: those that any frame had.
    seen: Option<&'a mut Vec<u8>>,
}

/// Rows as they come, or with the layer that their samples tell.
enum Watched<'a> {
    AsTheyCome(&'a mut dyn RowSource),
    Marked(Box<Marked<'a>>),
}

/// The rows of a frame with the layer of their marks, and which marks leave a pixel out of statistics.
pub struct MarkedRows<'a> {
    source: Watched<'a>,
    /// Place of the layer among the channels; none where no pixel can be marked.
    pub layer: Option<usize>,
    /// The bits whose pixels are left out.
    pub left_out: u32,
}

impl<'a> MarkedRows<'a> {
    /// The rows of `source`. Samples of photosites always count, as the records that they are.
    pub fn of(source: &'a mut dyn RowSource, saturated: Saturated) -> Self {
        let header = source.header();
        // What other programs call so is measured as any channel; ours comes last.
        let is_ours = |layer: &usize| *layer > 0 && !header.metadata.history.is_empty();
        let layer = header.geometry.channels.iter().position(|channel| channel == MASK_LAYER).filter(is_ours);
        let levels = FullLevels::of(header).filter(|levels| saturation::is_possible(header, levels));
        let (source, layer) = match (layer, levels) {
            (None, Some(levels)) => {
                let layer = header.geometry.channels.len();
                (Watched::Marked(Box::new(Marked::new(source, Some(levels)))), Some(layer))
            }
            _ => (Watched::AsTheyCome(source), layer),
        };
        let mut rows = Self { source, layer, left_out: !SATURATED };
        if saturated == Saturated::LeftOut && (rows.comes_with_layer() || !samples_tell(&rows.unmarked())) {
            rows.left_out = u32::MAX;
        }
        rows
    }

    /// The head of the frame without the layer and what follows it.
    pub fn unmarked(&self) -> FrameHeader {
        let mut header = self.header().clone();
        self.layer.iter().for_each(|layer| header.geometry.channels.truncate(*layer));
        header
    }

    /// Whether the frame has the layer itself.
    pub(super) fn comes_with_layer(&self) -> bool {
        self.layer.is_some() && matches!(self.source, Watched::AsTheyCome(_))
    }

    fn rows(&self) -> &dyn RowSource {
        match &self.source {
            Watched::AsTheyCome(source) => *source,
            Watched::Marked(source) => source.as_ref(),
        }
    }
}

impl RowSource for MarkedRows<'_> {
    fn header(&self) -> &FrameHeader {
        self.rows().header()
    }

    fn natural_rows(&self) -> usize {
        self.rows().natural_rows()
    }

    fn may_wait(&self) -> bool {
        self.rows().may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        match &mut self.source {
            Watched::AsTheyCome(source) => source.read(rows, samples),
            Watched::Marked(source) => source.read(rows, samples),
        }
    }
}

impl<'a> Watch<'a> {
    /// Watches `source`. Samples of photosites always count, as the records that they are, and so do the formulas that
    /// predict them.
    pub fn new(source: &'a mut dyn RowSource, saturated: Saturated, regions: &[Region]) -> Self {
        let source = MarkedRows::of(source, saturated);
        let mut header = source.unmarked();
        if saturated == Saturated::Kept && source.comes_with_layer() && header.leads_with_three_planes() {
            // What uncertainty says of marked pixels is infinite, and would leave them out.
            header.geometry.channels.truncate(3);
        }
        Self {
            source,
            header,
            regions: regions.to_vec(),
            counts: vec![Marks::default(); regions.len()],
            rows_read: 0,
            buffer: Vec::new(),
            seen: None,
        }
    }

    /// The same without the layers that may follow three planes.
    #[must_use]
    pub fn without_layers(mut self) -> Self {
        if self.header.leads_with_three_planes() {
            self.header.geometry.channels.truncate(3);
        }
        self
    }

    /// Adds the marks of all pixels to those that are there.
    #[must_use]
    pub fn keeping(mut self, seen: &'a mut Vec<u8>) -> Self {
        let geometry = &self.header.geometry;
        seen.resize(geometry.width * geometry.height, 0);
        self.seen = Some(seen);
        self
    }

    /// How many pixels are made of saturated samples, in words, where nothing marks which.
    pub fn untold(&self) -> Option<String> {
        untold(self.source.header(), self.source.comes_with_layer())
    }

    /// Marked pixels of each region so far, and whether saturated ones are left out.
    pub fn marks(&self) -> (&[Marks], bool) {
        (&self.counts, self.source.left_out & SATURATED != 0)
    }

    /// Marked pixels of each region, and whether saturated ones were left out.
    pub fn seen(self) -> (Vec<Marks>, bool) {
        (self.counts, self.source.left_out & SATURATED != 0)
    }

    /// Takes in one row of samples and its marks: counts, and leaves out.
    fn take(&mut self, marks: &[f32], samples: &mut [f32]) {
        let (y, left_out) = (self.rows_read, self.source.left_out);
        self.rows_read += 1;
        if marks.iter().all(|mark| *mark == 0.0) {
            return;
        }
        if let Some(seen) = &mut self.seen {
            let seen = &mut seen[y * marks.len()..][..marks.len()];
            // All that have a meaning are below 256.
            seen.iter_mut().zip(marks).for_each(|(seen, mark)| *seen |= bits(*mark).to_le_bytes()[0]);
        }
        for (region, count) in self.regions.iter().zip(&mut self.counts) {
            if (region.y..region.y + region.height).contains(&y) {
                let marks = &marks[region.x..region.x + region.width];
                marks.iter().for_each(|mark| count.add(bits(*mark), left_out));
            }
        }
        for line in samples.chunks_exact_mut(marks.len()) {
            for (sample, mark) in line.iter_mut().zip(marks) {
                *sample = if bits(*mark) & left_out == 0 { *sample } else { f32::NAN };
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
        let is_whole = self.source.header().geometry.channels.len() == self.header.geometry.channels.len();
        if self.source.layer.is_none() && is_whole {
            return self.source.read(rows, samples);
        }
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        self.source.read(rows, &mut buffer)?;
        let geometry = &self.header.geometry;
        let (width, kept) = (geometry.width, geometry.row_samples());
        for row in buffer.chunks_exact(buffer.len() / rows.max(1)) {
            let start = samples.len();
            samples.extend_from_slice(&row[..kept]);
            if let Some(layer) = self.source.layer {
                self.take(&row[layer * width..][..width], &mut samples[start..]);
            }
        }
        self.buffer = buffer;
        Ok(())
    }
}
