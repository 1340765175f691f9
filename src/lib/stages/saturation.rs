//! Saturation: which samples are full, and which pixels were made of them.
//!
//! As long as samples are those of photosites, their level tells it ([`FullLevels`]). What is made of several no longer
//! does: from there on a layer, [`MASK_LAYER`], marks the pixels that used a full one. [`Marked`] adds the layer to the rows
//! that come in, [`WithMask`] carries it through a stage, and [`Counted`] counts at the end.

use crate::cfa::{CfaPattern, FilterArray};
use crate::error::Result;
use crate::frame::{Rows, Window, mirror};
use crate::metadata::{AdcRecord, CorrectionRecord, FrameHeader};
use crate::stream::{Counts, Footprint, RowSink, RowSource, Stage};
use crate::units::QuantityKind;

/// The channel that marks pixels.
pub const MASK_LAYER: &str = "mask";

/// The bit of [`MASK_LAYER`] for a pixel that used a saturated sample.
pub const SATURATED: u32 = 1;

/// The bit for a defective photosite, or a pixel that used one.
pub const DEFECTIVE: u32 = 2;

/// The bit for a sample that was interpolated from others in place of a defective one, or a pixel that used it.
pub const CORRECTED: u32 = 4;

/// The bit for a sample of which a correction knows nothing, or a pixel that used it.
pub const BEYOND_MODEL: u32 = 8;

/// The bits and what they mean.
pub const MASK_BITS: [(u32, &str); 4] = [
    (SATURATED, "saturated"),
    (DEFECTIVE, "defective"),
    (CORRECTED, "corrected: interpolated from neighbors"),
    (BEYOND_MODEL, "beyond the model of a correction"),
];

/// The levels from which samples are full, by class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FullLevels {
    levels: [f32; 3],
    pattern: Option<CfaPattern>,
    origin: [i32; 2],
}

impl FullLevels {
    /// The levels of the frame's samples: full well of electrons; of ADU the white level of the class, or the code of full
    /// well where that is smaller, the least of several amplifiers. None where the metadata do not know, and of colors.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
        let levels = match metadata.quantity {
            QuantityKind::Electrons | QuantityKind::ExpectedElectrons => [readout?.full_well_e; 3],
            QuantityKind::Adu | QuantityKind::Unspecified => {
                let white = metadata.white_level_adu?;
                // Both levels are shifted alike by what was subtracted.
                let full_well_e = readout.map_or(f64::INFINITY, |readout| readout.full_well_e);
                let below_white = |adc: AdcRecord| adc.full_below_white(full_well_e);
                // Of several amplifiers the lowest counts.
                let of_taps = |adc: AdcRecord| match frame.taps() {
                    None => below_white(adc),
                    Some(taps) => (0..taps.count()).map(|tap| below_white(adc.of_tap(taps, tap))).fold(0.0, f64::max),
                };
                let missing = metadata.adc.map_or(0.0, of_taps);
                white.classes().map(|level| level - missing)
            }
            _ => return None,
        };
        #[expect(clippy::cast_possible_truncation, reason = "samples are floats, and so are their levels")]
        let levels = levels.map(|level| level as f32);
        let pattern = metadata.cfa.and_then(FilterArray::bayer);
        let levels = match (metadata.cfa, pattern) {
            // Of arrays whose classes are not followed the lowest counts.
            (Some(_), None) => [levels.into_iter().fold(f32::INFINITY, f32::min); 3],
            _ => levels,
        };
        levels.iter().all(|level| level.is_finite()).then_some(Self { levels, pattern, origin: frame.geometry.origin })
    }

    /// The levels of R, G and B.
    pub fn classes(&self) -> [f32; 3] {
        self.levels
    }

    /// The levels of even and odd columns in row `y` of a plane.
    pub(super) fn of_row(&self, y: usize, channel: usize) -> [f32; 2] {
        match self.pattern {
            Some(pattern) => pattern.row_classes(self.origin, y).map(|class| self.levels[class as usize]),
            None => [self.levels[channel.min(2)]; 2],
        }
    }

    /// Marks the full samples of row `y` of a channel.
    fn mark(&self, y: usize, channel: usize, samples: &[f32], marks: &mut [f32]) {
        let levels = self.of_row(y, channel);
        if full(samples, levels) > 0 {
            for (x, (sample, mark)) in samples.iter().zip(marks).enumerate() {
                if *sample >= levels[x % 2] {
                    *mark = SATURATED as f32;
                }
            }
        }
    }
}

/// How many samples of a row are at the levels of even and odd columns, or above.
fn full(samples: &[f32], [even, odd]: [f32; 2]) -> u64 {
    let (pairs, last) = samples.as_chunks::<2>();
    let of_pairs: u64 = pairs
        .chunks(1 << 16)
        .map(|pairs| {
            let is_full = |[a, b]: &[f32; 2]| u32::from(*a >= even) + u32::from(*b >= odd);
            u64::from(pairs.iter().map(is_full).sum::<u32>())
        })
        .sum();
    of_pairs + last.iter().filter(|sample| **sample >= even).count() as u64
}

/// Whether the samples of a frame tell by their level whether they are full: those of photosites, less at most a level that
/// is the same at all of a class.
pub fn samples_tell(frame: &FrameHeader) -> bool {
    let metadata = &frame.metadata;
    let is_of_photosites = matches!(
        metadata.quantity,
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons | QuantityKind::Adu | QuantityKind::Unspecified
    );
    let is_shifted = metadata.correction.as_ref().is_none_or(CorrectionRecord::is_a_shift);
    // Of an average some samples may have been full.
    is_of_photosites && is_shifted && metadata.demosaic.is_none() && metadata.average.is_none()
}

/// The head of a frame that has the layer of marks behind its channels.
pub fn with_mask(mut frame: FrameHeader) -> FrameHeader {
    frame.geometry.channels.push(MASK_LAYER.into());
    frame.metadata.mask_bits = MASK_BITS.iter().map(|(bit, meaning)| format!("{bit} {meaning}")).collect();
    frame
}

/// The rows of a source and, behind its channels, the layer that marks full samples of its planes: the first three where
/// they are those of colors, otherwise the first. What follows says how uncertain these are.
pub struct Marked<'a> {
    source: &'a mut dyn RowSource,
    levels: Option<FullLevels>,
    header: FrameHeader,
    planes: usize,
    rows_read: usize,
    buffer: Vec<f32>,
}

impl<'a> Marked<'a> {
    /// The rows of `source`, whose samples are full from `levels` on; none where no level is known or reached.
    pub fn new(source: &'a mut dyn RowSource, levels: Option<FullLevels>) -> Self {
        let header = with_mask(source.header().clone());
        let planes = if header.leads_with_three_planes() { 3 } else { 1 };
        Self { source, levels, header, planes, rows_read: 0, buffer: Vec::new() }
    }
}

impl RowSource for Marked<'_> {
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
        let width = self.header.geometry.width;
        self.buffer.clear();
        self.source.read(rows, &mut self.buffer)?;
        for row in self.buffer.chunks_exact(self.header.geometry.row_samples() - width) {
            samples.extend_from_slice(row);
            let marks = samples.len();
            samples.resize(marks + width, 0.0);
            for (channel, line) in row.chunks_exact(width).take(self.planes).enumerate() {
                if let Some(levels) = self.levels {
                    levels.mark(self.rows_read, channel, line, &mut samples[marks..]);
                }
            }
            self.rows_read += 1;
        }
        Ok(())
    }
}

/// A stage whose input has the layer of marks behind its channels, and whose output gets one: a pixel is marked that used a
/// marked one, and what layers say of its uncertainty becomes infinite.
pub struct WithMask<'a, S> {
    stage: &'a S,
    header: FrameHeader,
    footprint: Footprint,
}

impl<'a, S: Stage> WithMask<'a, S> {
    /// A stage with the layer.
    pub fn new(stage: &'a S) -> Self {
        let header = with_mask(stage.header().clone());
        Self { stage, header, footprint: stage.footprint() }
    }

    /// Marks the pixels of row `y`; gives whether there are any.
    fn mark(&self, input: &Window<'_, S::Input>, y: usize, marks: &mut [f32]) -> bool {
        let layer = input.channels() - 1;
        marks.fill(0.0);
        match &self.footprint {
            Footprint::Own => marks.copy_from_slice(input.row(y.cast_signed(), layer)),
            Footprint::Around(offsets) => {
                let reach = self.stage.reach().cast_signed();
                let rows = y.cast_signed() - reach..=y.cast_signed() + reach;
                if rows.clone().all(|row| input.row(row, layer).iter().all(|mark| *mark == 0.0)) {
                    return false;
                }
                let width = input.width();
                for (x, mark) in marks.iter_mut().enumerate() {
                    let used = offsets[y % 2 * 2 + x % 2].iter().map(|[dx, dy]| {
                        bits(input.row(y.cast_signed() + dy, layer)[mirror(x.cast_signed() + dx, width)])
                    });
                    *mark = used.fold(0, |all, bits| all | bits) as f32;
                }
            }
        }
        marks.iter().any(|mark| *mark != 0.0)
    }
}

/// The bits of a mark.
pub fn bits(mark: f32) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "marks are small whole numbers; NaN is 0"
    )]
    let bits = mark as u32;
    bits
}

impl<S: Stage> Stage for WithMask<'_, S> {
    type Input = S::Input;
    type Output = S::Output;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn reach(&self) -> usize {
        self.stage.reach()
    }

    fn apply(&self, input: Window<'_, S::Input>, mut output: Rows<'_, S::Output>) -> Counts {
        let mut counts = self.stage.apply(input, output.reborrow());
        let layer = self.header.geometry.channels.len() - 1;
        for y in output.range() {
            let marks = output.row(y, layer);
            if !self.mark(&input, y, marks) {
                continue;
            }
            counts.saturated_pixels += marks.iter().filter(|mark| bits(**mark) & SATURATED != 0).count() as u64;
            counts.marked_pixels += marks.iter().filter(|mark| bits(**mark) & !SATURATED != 0).count() as u64;
            let marked: Vec<usize> = (0..marks.len()).filter(|x| marks[*x] != 0.0).collect();
            for (channel, name) in self.header.geometry.channels.iter().enumerate() {
                if let Some(unknown) = of_unknown(name) {
                    let line = output.row(y, channel);
                    marked.iter().for_each(|x| line[*x] = unknown);
                }
            }
        }
        counts
    }
}

/// What a layer of uncertainties says of a pixel of which nothing is known: infinite variances, and no covariances.
fn of_unknown(layer: &str) -> Option<f32> {
    match layer.split_once('.')? {
        ("sigma", _) => Some(f32::INFINITY),
        ("covariance", of) => {
            let is_variance = of.chars().next() == of.chars().next_back();
            Some(if is_variance { f32::INFINITY } else { 0.0 })
        }
        _ => None,
    }
}

/// Counts the full samples that go into a sink.
pub struct Counted<'a> {
    sink: &'a mut dyn RowSink,
    levels: FullLevels,
    width: usize,
    channels: usize,
    rows_written: usize,
    /// How many there were.
    pub count: u64,
}

impl<'a> Counted<'a> {
    /// Counts what goes into `sink`, rows of the frame `header`.
    pub fn new(sink: &'a mut dyn RowSink, header: &FrameHeader, levels: FullLevels) -> Self {
        let (width, channels) = (header.geometry.width, header.geometry.channels.len());
        Self { sink, levels, width, channels, rows_written: 0, count: 0 }
    }
}

impl RowSink for Counted<'_> {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        for row in samples.chunks_exact(self.width * self.channels) {
            for (channel, line) in row.chunks_exact(self.width).enumerate() {
                self.count += full(line, self.levels.of_row(self.rows_written, channel));
            }
            self.rows_written += 1;
        }
        self.sink.write(samples)
    }
}
