//! The analogue-to-digital converter.

use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{AdcRecord, FrameHeader};
use crate::stage::{Counts, Stage};
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
/// Rounding *is* the quantisation noise (variance 1/12 ADU² while σ ≥ ½ ADU); nothing else is added for it. Ties go
/// away from zero. NaN stays NaN.
#[derive(Debug, Clone)]
pub struct Digitize {
    header: FrameHeader,
    adc: AdcRecord,
}

impl AdcRecord {
    /// The largest code, 2^bits − 1.
    pub fn top_code(&self) -> u32 {
        (1 << self.bits) - 1
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
            _ => {
                return Err(input.out_of_order(format!("it holds {holds}, not electrons of photosites"), "add-noise"));
            }
        }
        let sensor = input.metadata.sensor.as_ref();
        let needed = |key| input.missing(key, "--sensor NAME|FILE, or all of --bits, --bias and --slope");
        let adc = AdcRecord {
            bits: settings.bits.or(sensor.map(|s| s.bits)).ok_or_else(|| needed("sensor.bits"))?,
            bias_adu: settings.bias_adu.or(sensor.map(|s| s.bias_adu)).ok_or_else(|| needed("sensor.bias_adu"))?,
            adu_per_e: settings.adu_per_e.or(sensor.map(|s| s.adu_per_e)).ok_or_else(|| needed("sensor.adu_per_e"))?,
        };
        if !(1..=16).contains(&adc.bits) {
            return Err(Error::Usage(format!("a converter of {} bits is impossible here; give 1 to 16", adc.bits)));
        }
        if !adc.bias_adu.is_finite() {
            return Err(Error::Usage(format!("a bias of {} ADU is impossible", adc.bias_adu)));
        }
        if !(adc.adu_per_e > 0.0 && adc.adu_per_e.is_finite()) {
            return Err(Error::Usage(format!(
                "a slope of {} ADU per electron is impossible; give one above 0",
                adc.adu_per_e
            )));
        }
        let mut metadata = input.metadata.becoming(QuantityKind::Adu);
        metadata.adc = Some(adc);
        metadata.black_level_adu = Some(adc.bias_adu + adc.adu_per_e * metadata.dark_signal_e.take().unwrap_or(0.0));
        metadata.white_level_adu = Some(f64::from(adc.top_code()));
        Ok(Self { header: FrameHeader { metadata, ..input.clone() }, adc })
    }

    /// The head of the digitized frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }
}

impl Stage for Digitize {
    type Input = Electrons;
    type Output = Adu;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn apply(&self, input: Window<'_, Electrons>, mut output: Rows<'_, Adu>) -> Counts {
        let mut counts = Counts::default();
        let top = f64::from(self.adc.top_code());
        for y in output.range() {
            for channel in 0..input.channels() {
                for (&charge, code) in input.row(y.cast_signed(), channel).iter().zip(output.row(y, channel)) {
                    let level = (self.adc.bias_adu + self.adc.adu_per_e * f64::from(charge)).round();
                    counts.clipped_low += u64::from(level < 0.0);
                    counts.clipped_high += u64::from(level > top);
                    counts.not_finite += u64::from(level.is_nan());
                    // Rounding makes −0 of small negative levels; code 0 is one code, also to a digest.
                    *code = to_sample(level.clamp(0.0, top) + 0.0);
                }
            }
        }
        counts
    }
}
