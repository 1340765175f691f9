//! The analog-to-digital converter.

use crate::camera::taps::TapLayout;
use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{AdcRecord, FrameHeader};
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::stream::{Counts, Stage};
use crate::units::{Adu, Electrons, QuantityKind};

/// What a user may set of the converter; the sensor's own where nothing is given.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AdcSettings {
    /// Bits.
    pub bits: Option<u32>,
    /// Bias in ADU.
    pub bias_adu: Option<f64>,
    /// Slope in ADU per e⁻.
    pub adu_per_e: Option<f64>,
}

/// Reports each photosite's charge as the nearest code, clipped to the code range.
///
/// y = round(K·n + y₀)        n in e⁻, y₀ = bias        [HP2005, Eq. 12]
///
/// A sensor with a linearization f has y = round(f⁻¹(K·n) + y₀). One that is read through several amplifiers has K·g for K and
/// y₀ + K·g·o for y₀, g and o the gain and the offset of that which reads the photosite ([`Taps`](crate::camera::taps::Taps)); the levels in the metadata are
/// those of g = 1 and o = 0.
///
/// Rounding *is* the quantization noise (variance 1/12 ADU² while σ ≥ ½ ADU); nothing else is added for it. Ties go
/// away from zero. NaN stays NaN.
///
/// # Examples
///
/// ```
/// use cyanometer::stages::adc::{AdcSettings, Digitize};
/// use cyanometer::stream::MemoryFrame;
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Electrons);
/// # let geometry = Geometry::new(4, 1, &["Y"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// let electrons = MemoryFrame::new(header, vec![-10.0, 2.4, 2.6, 300.0]);
/// let settings = AdcSettings { bits: Some(8), bias_adu: Some(4.0), adu_per_e: Some(1.0) };
/// let (codes, counts) = electrons.through(&Digitize::new(&electrons.header, &settings)?)?;
/// assert_eq!(codes.samples, [0.0, 6.0, 7.0, 255.0]);
/// assert_eq!((counts.clipped_low, counts.clipped_high), (1, 1));
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Digitize {
    header: FrameHeader,
    /// That of all photosites, or those of the amplifiers.
    converters: Vec<Converter>,
    /// Width and height of a sensor that is read through several amplifiers.
    size: [u32; 2],
}

/// One converter, and the charges at which it does something else.
#[derive(Debug, Clone)]
struct Converter {
    adc: AdcRecord,
    clipping: Clipping,
    bent: Option<BentEdges>,
}

impl Converter {
    fn of(adc: AdcRecord) -> Self {
        Self { adc, clipping: Clipping::of(&adc), bent: adc.linearization.map(|_| BentEdges::of(&adc)) }
    }

    fn digitize(&self, instructions: Instructions, charges: &[f32], codes: &mut [f32]) -> Counts {
        match &self.bent {
            Some(edges) => edges.digitize(charges, codes),
            None => vectors::run_on(instructions, Row { adc: self.adc, clipping: self.clipping, charges, codes }),
        }
    }
}

impl Digitize {
    /// The converter for `input`.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless the frame holds electrons of photosites; [`Error::MissingKey`] when neither the metadata
    /// nor `settings` say how the converter is set; [`Error::Usage`] when it is set impossibly.
    pub fn new(input: &FrameHeader, settings: &AdcSettings) -> Result<Self> {
        let holds = input.holds();
        match input.metadata.quantity {
            QuantityKind::ExpectedElectrons | QuantityKind::Electrons if input.metadata.demosaic.is_none() => {}
            QuantityKind::Adu => {
                return Err(input.refuse(format!("it holds {holds}: it is digitized already")));
            }
            QuantityKind::Electrons => {
                return Err(input.refuse(format!("it holds {holds}: `digitize` goes before `demosaic`")));
            }
            _ => {
                return Err(input.out_of_order(format!("it holds {holds}, not electrons of photosites"), "add-noise"));
            }
        }
        let readout = input.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
        let needed = |key| input.missing(key);
        let of_sensor = readout.and_then(|readout| readout.linearization);
        let adc = AdcRecord {
            linearization: of_sensor,
            is_linearized: false,
            white_adu: None,
            bits: settings.bits.or(readout.map(|r| r.bits)).ok_or_else(|| needed("sensor.readout.bits"))?,
            bias_adu: settings
                .bias_adu
                .or(readout.map(|r| r.bias_adu))
                .ok_or_else(|| needed("sensor.readout.bias_adu"))?,
            adu_per_e: settings
                .adu_per_e
                .or(readout.map(|r| r.adu_per_e))
                .ok_or_else(|| needed("sensor.readout.adu_per_e"))?,
        };
        adc.check().map_err(Error::Usage)?;
        let adcs = adc.of_taps(input.taps());
        if let Some(curve) = adc.linearization {
            adcs.iter().try_for_each(|adc| curve.check_rises(adc.range())).map_err(Error::Usage)?;
        }
        let size = readout.map_or([0; 2], |readout| [readout.width, readout.height]);
        let mut metadata = input.metadata.becoming(QuantityKind::Adu);
        metadata.adc = Some(adc);
        // Expected electrons are those of light alone.
        let is_light = input.metadata.quantity == QuantityKind::ExpectedElectrons;
        let dark_signal_e = metadata.dark_signal_e.take().or(is_light.then_some(0.0));
        metadata.set_black_adu(dark_signal_e.map(|dark_e| adc.level_at(dark_e).into()));
        metadata.white_level_adu = Some(f64::from(adc.top_code()).into());
        let converters = adcs.into_iter().map(Converter::of).collect();
        Ok(Self { header: FrameHeader { metadata, ..input.clone() }, converters, size })
    }

    /// The head of the digitized frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// What [`Stage::apply`] does, on one set of instructions; the bits are the same on all of them.
    pub fn apply_on(
        &self,
        instructions: Instructions,
        input: Window<'_, Electrons>,
        mut output: Rows<'_, Adu>,
    ) -> Counts {
        let mut counts = Counts::default();
        let mut scratch = Scratch::default();
        for y in output.range() {
            for channel in 0..input.channels() {
                let (charges, codes) = (input.row(y.cast_signed(), channel), output.row(y, channel));
                let of_row = match &self.converters[..] {
                    [one] => one.digitize(instructions, charges, codes),
                    _ => self.digitize_by_taps(instructions, y, (charges, codes), &mut scratch),
                };
                counts = counts.plus(of_row);
            }
        }
        counts
    }

    /// Digitizes row `y` of the frame, each photosite by the amplifier that reads it.
    fn digitize_by_taps(
        &self,
        instructions: Instructions,
        y: usize,
        (charges, codes): (&[f32], &mut [f32]),
        scratch: &mut Scratch,
    ) -> Counts {
        let Some(taps) = self.header.taps() else { return Counts::default() };
        let [x0, y0] = self.header.geometry.origin.map(i64::from);
        let converter = |x: usize| &self.converters[taps.tap(self.size, [x0 + x as i64, y0 + y as i64])];
        let width = charges.len();
        if taps.layout == TapLayout::Columns {
            let step = taps.count();
            let mut counts = Counts::default();
            for first in 0..step.min(width) {
                scratch.charges.clear();
                scratch.charges.extend(charges[first..].iter().step_by(step));
                scratch.codes.resize(scratch.charges.len(), 0.0);
                counts = counts.plus(converter(first).digitize(instructions, &scratch.charges, &mut scratch.codes));
                for (code, made) in codes[first..].iter_mut().step_by(step).zip(&scratch.codes) {
                    *code = *made;
                }
            }
            return counts;
        }
        let border = usize::try_from(i64::from(self.size[0] / 2) - x0).unwrap_or_default().min(width);
        let (left, right) = codes.split_at_mut(border);
        let halves = [(0, &charges[..border], left), (border, &charges[border..], right)];
        let of_half = |(first, charges, codes): (usize, &[f32], &mut [f32])| {
            if charges.is_empty() { Counts::default() } else { converter(first).digitize(instructions, charges, codes) }
        };
        halves.into_iter().map(of_half).fold(Counts::default(), Counts::plus)
    }
}

/// Memory for the samples of every so many columns.
#[derive(Debug, Default)]
struct Scratch {
    charges: Vec<f32>,
    codes: Vec<f32>,
}

/// The charges between the codes of a converter that is not straight: from the first on, they rise from −½ to ½ above the largest
/// code.
#[derive(Debug, Clone)]
struct BentEdges(Vec<f64>);

impl BentEdges {
    fn of(adc: &AdcRecord) -> Self {
        Self((0..=adc.top_code() + 1).map(|code| adc.electrons_at(f64::from(code) - 0.5)).collect())
    }

    fn digitize(&self, charges: &[f32], codes: &mut [f32]) -> Counts {
        let Self(edges) = self;
        let top = edges.len() - 2;
        let mut counts = Counts::default();
        for (&charge, code) in charges.iter().zip(codes) {
            let below = edges.partition_point(|edge| *edge <= f64::from(charge));
            counts.clipped_low += u64::from(below == 0 && !charge.is_nan());
            counts.clipped_high += u64::from(below == edges.len());
            counts.not_finite += u64::from(charge.is_nan());
            *code = if charge.is_nan() { charge } else { below.saturating_sub(1).min(top) as f32 };
        }
        counts
    }
}

impl Stage for Digitize {
    type Input = Electrons;
    type Output = Adu;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn apply(&self, input: Window<'_, Electrons>, output: Rows<'_, Adu>) -> Counts {
        self.apply_on(Instructions::widest(), input, output)
    }
}

/// Added to a number from 0 to 2⁵¹ and taken away, it leaves the nearest whole number: doubles have no fractions there.
const WHOLE_DOUBLES: f64 = (1_u64 << 52) as f64;

/// The same for numbers from 0 to 2²² in single precision.
const WHOLE_SINGLES: f32 = (1_u32 << 23) as f32;

/// The charges from which levels are clipped: levels rise with the charge, also as doubles.
#[derive(Debug, Clone, Copy)]
struct Clipping {
    /// The largest charge whose level rounds to less than 0.
    low: f32,
    /// The smallest charge whose level rounds to more than the largest code.
    high: f32,
}

impl Clipping {
    /// Those of a converter. Ties go away from zero, so that −½ rounds to less than 0.
    fn of(adc: &AdcRecord) -> Self {
        let top = f64::from(adc.top_code());
        let first = |holds: &dyn Fn(f64) -> bool| first_float(|charge| holds(adc.level(charge)));
        Self { low: first(&|level| level > -0.5).next_down(), high: first(&|level| level >= top + 0.5) }
    }
}

/// The smallest float for which something holds that holds for all larger ones, infinity among them.
fn first_float(holds: impl Fn(f32) -> bool) -> f32 {
    // Floats in their order are those of sign and size taken as whole numbers.
    let float = |rank: i64| {
        let size = f32::from_bits(u32::try_from(rank.unsigned_abs()).unwrap_or(u32::MAX));
        if rank < 0 { -size } else { size }
    };
    let infinity = i64::from(f32::INFINITY.to_bits());
    let (mut below, mut above) = (-infinity, infinity);
    while above - below > 1 {
        let between = below + (above - below) / 2;
        if holds(float(between)) { above = between } else { below = between }
    }
    float(above)
}

impl AdcRecord {
    /// The code of a charge; NaN of NaN.
    #[inline(always)]
    fn code(&self, charge: f32) -> f32 {
        let top = f64::from(self.top_code());
        let level = self.level(charge);
        // Comparisons that a NaN passes.
        let above = if 0.0 > level { 0.0 } else { level };
        let within = if top < above { top } else { above };
        // To even at ties, and 0 of −0; the difference is exact, and one half only where a tie went down.
        let even = (within + WHOLE_DOUBLES) - WHOLE_DOUBLES;
        let tie = if within - even >= 0.5 { 1.0 } else { 0.0 };
        to_sample(even + tie)
    }

    /// The level of a charge, in ADU, before it is rounded.
    #[inline(always)]
    fn level(&self, charge: f32) -> f64 {
        self.bias_adu + self.adu_per_e * f64::from(charge)
    }
}

/// Digitizes a row.
struct Row<'a> {
    adc: AdcRecord,
    clipping: Clipping,
    charges: &'a [f32],
    codes: &'a mut [f32],
}

/// Samples whose doubts are looked for together.
const SETTLED_TOGETHER: usize = 16;

impl Row<'_> {
    /// How far a level in single precision may be off, in ADU, where it lies within the codes: bias and slope are rounded,
    /// then their product with the charge and the sum, each by 2⁻²⁴ of itself, and none is larger than bias and top code
    /// together; twice that.
    fn doubt(&self) -> f64 {
        2.0 * 5.0 * (self.adc.bias_adu.abs() + f64::from(self.adc.top_code())) * 0.5 * f64::from(f32::EPSILON)
    }
}

impl Kernel for Row<'_> {
    type Output = Counts;

    #[inline(always)]
    fn run(self) -> Counts {
        let doubt = self.doubt();
        let Self { adc, clipping, charges, codes } = self;
        let (mut low, mut high, mut nan) = (0_u32, 0_u32, 0_u32);
        for &charge in charges {
            low += u32::from(charge <= clipping.low);
            high += u32::from(charge >= clipping.high);
            nan += u32::from(charge.is_nan());
        }
        let counts =
            Counts { clipped_low: low.into(), clipped_high: high.into(), not_finite: nan.into(), ..Counts::default() };
        let settled = charges.len() / SETTLED_TOGETHER * SETTLED_TOGETHER;
        let (bias, slope, top) = (to_sample(adc.bias_adu), to_sample(adc.adu_per_e), to_sample(adc.top_code().into()));
        let is_worthwhile = doubt < 0.01 && slope.is_normal();
        let (charges, last) = charges.split_at(if is_worthwhile { settled } else { 0 });
        let (codes, last_codes) = codes.split_at_mut(charges.len());
        let sure = to_sample(0.5 - doubt);
        let chunks = charges.as_chunks::<SETTLED_TOGETHER>().0.iter().zip(codes.as_chunks_mut::<SETTLED_TOGETHER>().0);
        for (charges, codes) in chunks {
            let mut unsure = 0_u32;
            for (&charge, code) in charges.iter().zip(&mut *codes) {
                let level = bias + slope * charge;
                let above = if level > 0.0 { level } else { 0.0 };
                let within = if above < top { above } else { top };
                let nearest = (within + WHOLE_SINGLES) - WHOLE_SINGLES;
                *code = nearest;
                // A charge that is no number is in doubt too.
                unsure |= u32::from(((within - nearest).abs() >= sure) | level.is_nan());
            }
            if unsure != 0 {
                for (&charge, code) in charges.iter().zip(codes) {
                    *code = adc.code(charge);
                }
            }
        }
        for (&charge, code) in last.iter().zip(last_codes) {
            *code = adc.code(charge);
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, one charge at a time.
    fn plain(adc: &AdcRecord, charge: f32, counts: &mut Counts) -> f32 {
        let top = f64::from(adc.top_code());
        let level = (adc.bias_adu + adc.adu_per_e * f64::from(charge)).round();
        counts.clipped_low += u64::from(level < 0.0);
        counts.clipped_high += u64::from(level > top);
        counts.not_finite += u64::from(level.is_nan());
        to_sample(level.clamp(0.0, top) + 0.0)
    }

    /// Ties and their neighbors at every code of 16 bits, the ends of the range, and floats of all sizes.
    #[test]
    fn codes_are_those_of_the_plain_version_on_every_set_of_instructions() {
        let ties = (-4..=2 * 65_540).map(|halves: i32| 0.5 * halves as f32);
        let mut charges: Vec<f32> = ties.flat_map(|tie| [tie.next_down(), tie, tie.next_up()]).collect();
        // A step that is prime to 2³² leads through all kinds of bits: NaN, infinities, subnormals and both signs.
        charges.extend((0..50_000_u32).map(|i| f32::from_bits(i.wrapping_mul(2_654_435_769))));
        charges.extend([f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -0.0, 0.0, f32::MIN, f32::MAX, 1e-45, -1e-45]);
        // The double below one half is what adding one half and cutting off would make a 1 of.
        for (bias_adu, adu_per_e) in [(0.0, 1.0), (0.5_f64.next_down(), 1.0), (-0.5, 1.0), (102.4, 0.1), (-17.3, 3e-4)]
        {
            for bits in [1, 12, 16] {
                let adc = AdcRecord::new(bits, bias_adu, adu_per_e);
                let clipping = Clipping::of(&adc);
                let mut expected = Counts::default();
                let plain: Vec<u32> =
                    charges.iter().map(|&charge| plain(&adc, charge, &mut expected).to_bits()).collect();
                for set in Instructions::ALL {
                    let mut codes = vec![0.0; charges.len()];
                    let counts = vectors::run_on(set, Row { adc, clipping, charges: &charges, codes: &mut codes });
                    assert_eq!(counts, expected);
                    let differing = (0..plain.len()).find(|&i| codes[i].to_bits() != plain[i] && !codes[i].is_nan());
                    assert_eq!(differing.map(|i| (charges[i], codes[i])), None, "{set:?} {adc:?}");
                    assert!(codes.iter().zip(&charges).all(|(code, charge)| code.is_nan() == charge.is_nan()));
                }
            }
        }
    }
}
