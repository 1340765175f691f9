//! Saturation: which samples are full, and which pixels were made of them.
//!
//! As long as samples are those of photosites, their level tells it ([`FullLevels`]). What is made of several no longer
//! does: from there on a layer, [`MASK_LAYER`], marks the pixels that used a full one. [`Marked`] adds the layer to the rows
//! that come in, [`WithMask`] carries it through a stage, and [`Counted`] counts at the end.

use crate::camera::levels::WhiteLevel;
use crate::cfa::{CfaPattern, FilterArray};
use crate::error::Result;
use crate::frame::{Geometry, Rows, Window, mirror, to_sample};
use crate::metadata::{AdcRecord, CorrectionRecord, FrameHeader};
use crate::random::Source;
use crate::stages::transfer::uniform_share;
use crate::stream::{Counts, Footprint, RowSink, RowSource, Stage};
use crate::text::{percent, percent_in_decimals};
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

/// By so many standard deviations of what is added to it may a full charge be read lower: normal noise takes one in 31 600 below.
const READ_LOWER: f64 = 4.0;

/// The charge from which on samples count as full, in e⁻: that of full well, less what read-out may take off it. None without a
/// read-out.
///
/// s N − 4 σ, but N/2 at least        N full well, s what charge transfer leaves of uniform light, σ rms of what is added
///
/// A photosite whose charge is within 8 σ below full well may be marked too: its reading cannot be told from that of a full one.
pub fn least_full_e(frame: &FrameHeader) -> Option<f64> {
    let full_well_e = frame.metadata.sensor.as_ref()?.readout.as_ref()?.full_well_e;
    let left = frame.metadata.noise.as_ref().and_then(|noise| noise.cte).map_or(1.0, uniform_share);
    Some((left * full_well_e - READ_LOWER * added_to_charge_e(frame)).max(0.5 * full_well_e))
}

/// All that is added to charge when it is read, rms e⁻: what was drawn, or of frames that no noise is recorded of that of their
/// sensor, through the amplifier of the largest noise; none of codes that were made of no noise.
fn added_to_charge_e(frame: &FrameHeader) -> f64 {
    let metadata = &frame.metadata;
    let Some(readout) = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref()) else { return 0.0 };
    let is_of_camera = metadata.adc.is_none() && metadata.quantity != QuantityKind::ExpectedElectrons;
    let is_added = |source| metadata.noise.as_ref().map_or(is_of_camera, |noise| noise.sources.contains(&source));
    let parts = [
        (Source::Ron, readout.read_noises_e().fold(0.0, f64::max)),
        (Source::RowNoise, readout.row_noise_e),
        (Source::ColumnNoise, readout.column_noise_e),
        (Source::BlackDrift, readout.black_drift_e),
        (Source::Dsnu, readout.dsnu_e),
        (Source::DsnuRow, readout.dsnu_row_e),
        (Source::DsnuColumn, readout.dsnu_column_e),
        // ½ E a² of exponential amplitudes a is the square of their mean.
        (Source::Rts, readout.rts_share.sqrt() * readout.rts_amplitude_e),
    ];
    parts.into_iter().filter(|(source, _)| is_added(*source)).fold(0.0, |sum: f64, (_, part)| sum.hypot(part))
}

/// The levels from which samples are full, by class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FullLevels {
    levels: [f32; 3],
    /// Those of the 2×2 sites at the sensor's corner, row by row, where black levels that differed within a class came off.
    sites: Option<[f32; 4]>,
    pattern: Option<CfaPattern>,
    origin: [i32; 2],
}

impl FullLevels {
    /// The levels of the frame's samples: of electrons [`least_full_e`]; of ADU the white level of the class, or the code of that
    /// charge where it is smaller, the least of several amplifiers. None where the metadata do not know, and of colors.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let levels = match metadata.quantity {
            QuantityKind::Electrons | QuantityKind::ExpectedElectrons => [least_full_e(frame)?; 3],
            QuantityKind::Adu | QuantityKind::Unspecified => levels_of_codes(frame)?,
            _ => return None,
        };
        let pattern = metadata.cfa.and_then(FilterArray::bayer);
        let levels = match (metadata.cfa, pattern) {
            // Of arrays whose classes are not followed the lowest counts.
            (Some(_), None) => [levels.into_iter().fold(f64::INFINITY, f64::min); 3],
            _ => levels,
        };
        let of_site = |above: [f64; 4], site: usize| to_sample(levels[class_at(pattern, SITES[site])] + above[site]);
        let sites = above_class(frame).map(|above| std::array::from_fn(|site| of_site(above, site)));
        let levels = levels.map(to_sample);
        let found = Self { levels, sites, pattern, origin: frame.geometry.origin };
        levels.iter().all(|level| level.is_finite()).then_some(found)
    }

    /// The levels of R, G and B; where they differ among the photosites of a class, the lowest.
    pub fn classes(&self) -> [f32; 3] {
        self.levels
    }

    /// The levels of even and odd columns in row `y` of a plane.
    pub(super) fn of_row(&self, y: usize, channel: usize) -> [f32; 2] {
        if let Some(sites) = self.sites {
            let is_odd = |axis: usize, further: i64| usize::from((i64::from(self.origin[axis]) + further) & 1 != 0);
            return [0, 1].map(|x| sites[2 * is_odd(1, y as i64) + is_odd(0, x)]);
        }
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

/// The 2×2 sites at the sensor's corner, column and row, row by row.
const SITES: [[i64; 2]; 4] = [[0, 0], [1, 0], [0, 1], [1, 1]];

/// The class of a site; the first where there are no classes.
fn class_at(pattern: Option<CfaPattern>, [x, y]: [i64; 2]) -> usize {
    pattern.map_or(0, |pattern| pattern.class(x, y) as usize)
}

/// What came off the codes of a frame at each of the 2×2 sites, where nothing else was done to them.
fn taken_off(frame: &FrameHeader) -> Option<[f64; 4]> {
    match &frame.metadata.correction {
        None => Some([0.0; 4]),
        Some(record) => record.is_a_shift().then(|| record.black_adu.sites()),
    }
}

/// The most that came off a class.
fn most_of_class(off: [f64; 4], pattern: Option<CfaPattern>, class: usize) -> f64 {
    let of_class = SITES.into_iter().zip(off).filter(|(site, _)| class_at(pattern, *site) == class);
    of_class.map(|(_, off)| off).fold(f64::NEG_INFINITY, f64::max)
}

/// How far the sites of a plane are full above the level of their class: that is lowered by the most that came off any of them
/// ([`super::black::white_left`]). None where it is the same for all.
fn above_class(frame: &FrameHeader) -> Option<[f64; 4]> {
    let Geometry { width, height, .. } = frame.geometry;
    // A single row or column may lack the site off which most came.
    let is_plane = !frame.leads_with_three_planes() && width > 1 && height > 1;
    let off = taken_off(frame).filter(|_| is_plane)?;
    let pattern = frame.metadata.cfa.and_then(FilterArray::bayer);
    let above: [f64; 4] =
        std::array::from_fn(|site| most_of_class(off, pattern, class_at(pattern, SITES[site])) - off[site]);
    above.iter().any(|above| *above > 0.0).then_some(above)
}

/// The levels of full codes by class.
fn levels_of_codes(frame: &FrameHeader) -> Option<[f64; 3]> {
    let metadata = &frame.metadata;
    let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
    let white = metadata.white_level_adu.map(WhiteLevel::classes);
    // Of several amplifiers the lowest counts.
    let of_taps = |adc: AdcRecord, level: &dyn Fn(AdcRecord) -> f64| {
        adc.of_taps(frame.taps()).into_iter().map(level).fold(f64::INFINITY, f64::min)
    };
    let least_e = least_full_e(frame).unwrap_or(f64::INFINITY);
    if let Some(adc) = metadata.adc {
        // Both levels are shifted alike by what was subtracted.
        let above_white = of_taps(adc, &|adc| -adc.full_below_white(least_e));
        return Some(white?.map(|level| level + above_white));
    }
    // Frames of cameras do not tell their converter: that of the sensor which is named counts.
    let Some((readout, off)) = readout.zip(taken_off(frame)) else { return white };
    let adc = AdcRecord::of_readout(readout);
    let pattern = metadata.cfa.and_then(FilterArray::bayer);
    let off = |class: usize| most_of_class(off, pattern, if pattern.is_some() { class } else { 0 });
    let full = of_taps(adc, &|adc| adc.full_code(readout.full_well_e));
    let least = of_taps(adc, &|adc| adc.full_code(least_e));
    // Where full well is no less than the largest code, or than white, it is these that saturate, and nothing is read behind them.
    let of_class = |class: usize, white: f64| match full - off(class) {
        full_code if full_code < white && full < adc.top_code().into() => least - off(class),
        full_code => white.min(full_code),
    };
    match white {
        Some(white) => Some([0, 1, 2].map(|class| of_class(class, white[class]))),
        None => (metadata.quantity == QuantityKind::Adu && samples_tell(frame))
            .then(|| [0, 1, 2].map(|class| of_class(class, f64::INFINITY))),
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

/// How many pixels of a frame were made of saturated samples, counted or expected by the law of its scene, in words, where neither
/// their level nor, as `is_marked` says, a layer tells which. None where none are known to be, and where not one is expected in a
/// thousand such frames.
pub fn untold(frame: &FrameHeader, is_marked: bool) -> Option<String> {
    const LEAST_PIXELS: f64 = 1e-3;
    if is_marked || samples_tell(frame) {
        return None;
    }
    if let Some(samples) = &frame.metadata.samples {
        let counted = samples.saturated.filter(|count| *count > 0)?;
        return Some(format!("{counted} of its pixels were made of saturated samples, by its sidecar"));
    }
    let pixels = frame.geometry.width as f64 * frame.geometry.height as f64;
    let share = frame.metadata.saturated_share.filter(|share| share * pixels >= LEAST_PIXELS)?;
    let percent = if share >= 1e-3 { percent_in_decimals(share, 1) } else { percent(share, 2) };
    Some(format!("{percent} % of its pixels are made of saturated samples, by the law of its scene"))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::levels::BlackLevel;
    use crate::camera::sensor::tests::kaf5101ce;
    use crate::metadata::{Metadata, NoiseRecord, PoissonKind};

    /// Codes of a camera that tells no converter, whose sensor is named: full well is at 1753 + 0.058824 · 20000 = 2929.48 ADU, and four
    /// standard deviations of 15.7 e⁻ lower at 2925.79 ADU.
    fn codes() -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(CfaPattern::Rggb.into());
        let mut sensor = kaf5101ce();
        sensor.readout.as_mut().unwrap().full_well_e = 20_000.0;
        metadata.sensor = Some(sensor);
        metadata.white_level_adu = Some(4095.0.into());
        FrameHeader { name: "codes".into(), geometry: Geometry::new(4, 4, &["Y"]), metadata }
    }

    #[test]
    fn the_full_well_of_a_sensor_that_is_named_counts() {
        let mut frame = codes();
        let full = |frame: &FrameHeader| FullLevels::of(frame).map(|levels| levels.classes());
        assert_eq!(full(&frame), Some([2925.0; 3]));
        frame.metadata.white_level_adu = Some(WhiteLevel::Classes([2900.0, 3000.0, 4095.0]));
        assert_eq!(full(&frame), Some([2900.0, 2925.0, 2925.0]));
        // A frame that does not say its white level has that of the sensor.
        frame.metadata.white_level_adu = None;
        assert_eq!(full(&frame), Some([2925.0; 3]));
        frame.metadata.quantity = QuantityKind::Unspecified;
        assert_eq!(full(&frame), None);
        // What came off lowers both.
        let mut less = codes();
        less.metadata.correction = Some(CorrectionRecord::of_black(100.0.into(), false));
        less.metadata.white_level_adu = Some(3995.0.into());
        assert_eq!(full(&less), Some([2825.0; 3]));
        // How much dark frames took off is not known.
        let dark = CorrectionRecord { dark_frames: 1, ..CorrectionRecord::of_black(0.0.into(), false) };
        less.metadata.correction = Some(dark);
        assert_eq!(full(&less), Some([3995.0; 3]));
        less.metadata.white_level_adu = None;
        assert_eq!(full(&less), None);
        // A full well that was made of the white level is that, whatever its last digit lost.
        let mut made = codes();
        let readout = made.metadata.sensor.as_mut().unwrap().readout.as_mut().unwrap();
        for adu_per_e in [0.3, 0.7, 1.1, 1.0 / 3.0] {
            (readout.adu_per_e, readout.full_well_e) = (adu_per_e, (4095.0 - readout.bias_adu) / adu_per_e);
            let adc = AdcRecord::of_readout(readout);
            assert_eq!(AdcRecord { bits: 16, ..adc }.full_code(readout.full_well_e), 4095.0);
        }
        // Nothing is read behind the largest code, nor behind a white level that is no higher than full well.
        made.metadata.white_level_adu = None;
        assert_eq!(full(&made), Some([4095.0; 3]));
        frame = codes();
        frame.metadata.white_level_adu = Some(2929.0.into());
        assert_eq!(full(&frame), Some([2929.0; 3]));
    }

    /// What is drawn counts, of electrons and of codes; of what nothing is drawn nothing.
    #[test]
    fn what_is_added_to_full_well_lowers_the_level() {
        let mut frame = codes();
        let readout = frame.metadata.sensor.as_mut().unwrap().readout.as_mut().unwrap();
        (readout.read_noise_e, readout.row_noise_e, readout.dsnu_e) = (12.0, 4.0, 3.0);
        let full = |frame: &FrameHeader| FullLevels::of(frame).map(|levels| levels.classes()[0]);
        frame.metadata.quantity = QuantityKind::Electrons;
        // √(12² + 4² + 3²) = 13.
        assert_eq!(full(&frame), Some(20_000.0 - 4.0 * 13.0));
        frame.metadata.quantity = QuantityKind::ExpectedElectrons;
        assert_eq!(full(&frame), Some(20_000.0));
        frame.metadata.quantity = QuantityKind::Adu;
        frame.metadata.adc = Some(AdcRecord::new(12, 1000.0, 0.1));
        assert_eq!(full(&frame), Some(3000.0));
        frame.metadata.noise = Some(NoiseRecord {
            sources: vec![Source::Ssn, Source::RowNoise, Source::Dsnu],
            seed: 0,
            sensor_seed: 0,
            frame: 0,
            temperature_k: 300.0,
            dark_e: 0.0,
            hot_pixel_e: 0.0,
            poisson: PoissonKind::Exact,
            cte: None,
            smear_per_row: 0.0,
        });
        assert_eq!(full(&frame), Some(2998.0));
        frame.metadata.noise.as_mut().unwrap().cte = Some(0.999);
        assert_eq!(full(&frame), Some((1000.0_f32 + 2000.0 * 0.998_001 - 2.0).floor()));
        // Converters that are full before the photosite saturate at their last code.
        frame.metadata.adc = Some(AdcRecord::new(12, 2200.0, 0.1));
        assert_eq!(full(&frame), Some(4095.0));
    }

    /// Two greens of different black levels: what is full in one is lower than in the other, once these are off.
    #[test]
    fn each_site_is_full_at_its_own_level() {
        let mut frame = codes();
        frame.metadata.sensor = None;
        let off = [100.0, 120.0, 90.0, 50.0];
        frame.metadata.correction = Some(CorrectionRecord::of_black(BlackLevel::Sites(off), false));
        // As `correct-frame --black auto` leaves it.
        frame.metadata.white_level_adu = Some(WhiteLevel::Classes([3995.0, 3975.0, 4045.0]));
        for origin in [[0, 0], [1, 0], [2, 5]] {
            frame.geometry.origin = origin;
            let levels = FullLevels::of(&frame).unwrap();
            assert_eq!(levels.classes(), [3995.0, 3975.0, 4045.0]);
            for y in 0..4_u8 {
                let is_odd = |axis: usize, further: u8| usize::from((origin[axis] + i32::from(further)) % 2 == 1);
                let expected = [0, 1].map(|x| to_sample(4095.0 - off[2 * is_odd(1, y) + is_odd(0, x)]));
                assert_eq!(levels.of_row(y.into(), 0), expected, "{origin:?} {y}");
            }
        }
        // A single row may lack the green that is lower: the lowest counts.
        frame.geometry = Geometry { origin: [0, 1], ..Geometry::new(4, 1, &["Y"]) };
        assert_eq!(FullLevels::of(&frame).unwrap().of_row(0, 0), [3975.0, 4045.0]);
    }
}
