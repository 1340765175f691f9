//! Frames that viewers show which know no levels: samples scaled by a power of two, which loses nothing.
//!
//! What is stored are the samples times [`Metadata::sample_scale`](crate::metadata::Metadata::sample_scale), layers of
//! standard deviations alike, and variances and covariances times its square; the layer of marks stays as it is.

use super::format::U16_FULL_SCALE;
use crate::error::{Error, Result};
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::stages::saturation::MASK_LAYER;
use crate::units::QuantityKind;

/// The difference of black and white, ΔE\*ab.
const DIFFERENCE_OF_WHITE: f64 = 100.0;

/// Scales beyond these would take samples out of the range of floats.
const LARGEST_EXPONENT: i32 = 60;

/// What the channels of a frame are multiplied with when they are stored.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scaling {
    width: usize,
    /// Of each channel: a power of two, but of another program's files.
    factors: Vec<f32>,
}

impl Scaling {
    /// That of a frame whose samples are stored times `scale`; none where all stay as they are.
    pub fn of(width: usize, channels: &[String], scale: f64) -> Option<Self> {
        let factor = |channel: &String| match channel.split_once('.') {
            Some(("covariance" | "variance", _)) => scale * scale,
            _ if channel == MASK_LAYER => 1.0,
            _ => scale,
        };
        (scale != 1.0).then(|| Self { width, factors: channels.iter().map(factor).map(to_sample).collect() })
    }

    /// Scales whole rows, `[row][channel][column]`.
    pub fn apply(&self, rows: &mut [f32]) {
        self.each(rows, |factor| factor);
    }

    /// Gives rows back what they were.
    pub fn undo(&self, rows: &mut [f32]) {
        self.each(rows, f32::recip);
    }

    fn each(&self, rows: &mut [f32], factor: impl Fn(f32) -> f32) {
        for (line, place) in rows.chunks_exact_mut(self.width).zip((0..self.factors.len()).cycle()) {
            let factor = factor(self.factors[place]);
            line.iter_mut().for_each(|sample| *sample *= factor);
        }
    }
}

/// Whether a number is a power of two by which samples can be scaled.
pub(super) fn is_scale(scale: f64) -> bool {
    let exponent = scale.log2();
    exponent.fract() == 0.0 && exponent.abs() <= f64::from(LARGEST_EXPONENT) && exponent.exp2() == scale
}

/// The power of two by which the white level of a frame comes into (½, 1]; where `fills_u16`, by which its largest code
/// comes into the upper half of 16 bits.
///
/// # Errors
///
/// [`Error::Format`] where nothing says what is white, and for what is no light.
pub(super) fn scale_of(frame: &FrameHeader, fills_u16: bool) -> Result<f64> {
    let metadata = &frame.metadata;
    let no_white = |remedy: &str| {
        frame.refuse(format!("nothing says which sample is white, so that it cannot be made viewable; {remedy}"))
    };
    let white = match metadata.quantity {
        QuantityKind::Srgb | QuantityKind::LinearSrgb => return Ok(1.0),
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons => {
            let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
            readout.ok_or_else(|| no_white("give a sensor with a full well"))?.full_well_e
        }
        QuantityKind::Adu | QuantityKind::Unspecified => {
            let white = metadata.white_level_adu.map(|white| white.largest());
            let top = metadata.adc.filter(|_| fills_u16).map(|adc| f64::from(adc.top_code()));
            top.or(white).ok_or_else(|| no_white("add `white_level_adu` to its metadata"))?
        }
        QuantityKind::ColorDifference => DIFFERENCE_OF_WHITE,
        QuantityKind::Xyz => {
            let white = metadata.color.as_ref().and_then(|color| color.white);
            let white = white.ok_or_else(|| no_white("give `to-xyz` --white-luminance CD_PER_M2"))?;
            white.into_iter().fold(f64::NEG_INFINITY, f64::max)
        }
        other => {
            return Err(frame.refuse(format!(
                "what it holds, {other}, is no light that viewers show; write it as it is, and make a picture with `preview` or `to-xyz \
                 --space srgb`"
            )));
        }
    };
    let full = if fills_u16 { f64::from(U16_FULL_SCALE) + 1.0 } else { 1.0 };
    // 4095 codes of 12 bits fill 16 as 4096 would.
    let whole = if fills_u16 { white.floor() + 1.0 } else { white };
    let exponent = -(whole / full).log2().ceil();
    let scale = exponent.exp2();
    match white > 0.0 && is_scale(scale) && (!fills_u16 || scale >= 1.0) {
        true => Ok(scale),
        false => Err(frame.refuse(format!("its white, {white}, cannot be scaled so that viewers show it"))),
    }
}

/// Refuses samples that scaling changes: `scaled` is what was made of `samples`.
///
/// # Errors
///
/// [`Error::Data`], naming the first of them.
pub(super) fn check_lossless(name: &str, scaling: &Scaling, samples: &[f32], scaled: &[f32], end: f32) -> Result<()> {
    let mut back = scaled.to_vec();
    scaling.undo(&mut back);
    let differs = |((sample, back), scaled): &((&f32, &f32), &f32)| {
        (sample != back || **scaled > end) && !(sample.is_nan() && back.is_nan())
    };
    match samples.iter().zip(&back).zip(scaled).find(differs) {
        None => Ok(()),
        Some(((sample, _), _)) => Err(lost(name, *sample)),
    }
}

/// The complaint of a sample that scaling changes.
pub(super) fn lost(name: &str, sample: f32) -> Error {
    Error::Data(format!(
        "{name}: the sample {sample} would not be the same once it is scaled back; write f32, or leave --viewable out"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::{AdcRecord, Metadata};

    fn codes(white: f64, bits: Option<u32>) -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.white_level_adu = Some(white.into());
        metadata.adc = bits.map(|bits| AdcRecord::new(bits, 0.0, 1.0));
        FrameHeader { name: "codes".into(), geometry: Geometry::new(1, 1, &["Y"]), metadata }
    }

    #[test]
    fn white_comes_into_the_upper_half() {
        for (white, bits, fills_u16, expected) in [
            (4095.0, Some(12), true, 16.0),
            (3700.0, Some(12), true, 16.0),
            (4095.0, None, true, 16.0),
            (4096.0, None, true, 8.0),
            (15_000.0, None, true, 4.0),
            (65_535.0, Some(16), true, 1.0),
            (4095.0, Some(12), false, 1.0 / 4096.0),
            (4096.0, None, false, 1.0 / 4096.0),
            (4097.0, None, false, 1.0 / 8192.0),
            (0.75, None, false, 1.0),
            (0.5, None, false, 2.0),
        ] {
            assert_eq!(scale_of(&codes(white, bits), fills_u16).unwrap(), expected, "{white} {bits:?} {fills_u16}");
        }
        for (white, fills_u16) in [(0.0, false), (-3.0, false), (70_000.0, true), (f64::INFINITY, false)] {
            assert!(scale_of(&codes(white, None), fills_u16).is_err(), "{white}");
        }
    }

    #[test]
    fn layers_scale_with_their_unit() {
        let channels = ["R", "sigma.R", "covariance.XX", MASK_LAYER].map(String::from);
        let scaling = Scaling::of(1, &channels, 0.25).unwrap();
        let mut rows = [8.0, 8.0, 8.0, 8.0];
        scaling.apply(&mut rows);
        assert_eq!(rows, [2.0, 2.0, 0.5, 8.0]);
        scaling.undo(&mut rows);
        assert_eq!(rows, [8.0; 4]);
        assert_eq!(Scaling::of(1, &channels, 1.0), None);
    }

    #[test]
    fn what_would_be_lost_is_refused() {
        let scaling = Scaling::of(3, &["Y".to_owned()], 16.0).unwrap();
        let samples = [4095.0, f32::NAN, f32::INFINITY];
        let mut scaled = samples;
        scaling.apply(&mut scaled);
        assert!(check_lossless("out", &scaling, &samples, &scaled, f32::INFINITY).is_ok());
        assert!(check_lossless("out", &scaling, &samples, &scaled, U16_FULL_SCALE).is_err());
        let scaling = Scaling::of(1, &["Y".to_owned()], 2.0_f64.powi(-20)).unwrap();
        let samples = [f32::MIN_POSITIVE * 1.000_001];
        let mut scaled = samples;
        scaling.apply(&mut scaled);
        assert!(check_lossless("out", &scaling, &samples, &scaled, f32::INFINITY).is_err());
    }

    #[test]
    fn a_scale_is_a_power_of_two() {
        assert!([1.0, 16.0, 1.0 / 65_536.0].into_iter().all(is_scale));
        assert!(![0.0, -1.0, 3.0, f64::NAN, f64::INFINITY, 1e-300].into_iter().any(is_scale));
    }
}
