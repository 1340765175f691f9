//! What the samples of an honest frame of codes are at least and at most, by its metadata: each of them, and their mean.
//!
//! Charge is never negative, so that the mean code of a frame is its bias at least, whatever its light, dark signal, exposure and
//! temperature. What is added to charge as it is read has a mean of 0, and is off from it over a frame of W × H photosites by no
//! more than
//!
//! z √(σ²/WH + (row² + row′²)/H + (column² + column′²)/W + drift² min(1, 2 D/H)) + a (λ + 2√(λ L) + L)/WH
//!
//! σ² = read noise² + offsets², row′ and column′ fixed offsets of lines, D rows of drift from one level to the next, of which a
//! frame holds H/D whose shares of its mean are D/H each, λ = WH times the share of photosites that jump, a the mean height of
//! jumps. The last part is the tail of a compound Poisson sum of exponential numbers, which L = z²/2 bounds as z does that of a normal
//! one; the same of Poisson numbers drawn as normal ones, which are below 0 too, takes z²/4WH more.

use crate::camera::readout::ReadOut;
use crate::metadata::{AdcRecord, CorrectionRecord, FrameHeader, Metadata};
use crate::units::QuantityKind;

/// Standard deviations that no frame is off by: 6e-16 of them are.
const Z: f64 = 8.0;

/// Of samples in 32 bits some arithmetic was made: so much of the largest number.
const ROUNDING: f64 = 1e-6;

/// What samples lie within.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The least and the largest sample.
    pub samples: [f64; 2],
    /// The least mean, where noise is known.
    pub mean: Option<f64>,
}

impl Bounds {
    /// Those of the measured samples of a frame whose converter is known. None of others, and of those that were divided or restored.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let adc = metadata.adc.filter(|adc| adc.check().is_ok())?;
        let Some([least_off, most_off]) = taken_off(metadata) else { return Self::less_frames(metadata, adc) };
        let converters: Vec<AdcRecord> = match frame.taps() {
            None => vec![adc],
            Some(taps) => (0..taps.count()).map(|tap| adc.of_tap(taps, tap)).collect(),
        };
        let extreme = |code: f64| converters.iter().map(move |adc| adc.sample(code));
        let lowest = extreme(0.0).fold(f64::INFINITY, f64::min) - most_off;
        let highest = extreme(adc.top_code().into()).fold(f64::NEG_INFINITY, f64::max) - least_off;
        let lost = ROUNDING * (highest.abs() + lowest.abs() + least_off.abs() + most_off.abs());
        let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
        let means = readout.map(|readout| converters.iter().map(|adc| least_mean(frame, readout, *adc)));
        let mean = means.and_then(|mut means| means.try_fold(f64::INFINITY, |least, mean| Some(least.min(mean?))));
        Some(Self { samples: [lowest - lost, highest + lost], mean: mean.map(|mean| mean - most_off - lost) })
    }

    /// Those of samples that frames came off, each times its weight, which hold codes too. What their mean is hangs on these frames.
    fn less_frames(metadata: &Metadata, adc: AdcRecord) -> Option<Self> {
        let record = metadata.correction.as_ref().filter(|record| record.took_frames() && record.is_plain())?;
        let weights: f64 = record.masters.iter().map(|master| master.weight.abs()).sum();
        let most = (1.0 + ROUNDING) * adc.sample(adc.top_code().into()).abs().max(1.0) * weights.max(1.0);
        let of_planes = metadata.demosaic.as_ref().map_or([0.0; 4], |record| record.black.sites());
        let most = most + of_planes.into_iter().fold(0.0, |most: f64, off| most.max(off.abs()));
        let is_adu = metadata.quantity == QuantityKind::Adu;
        is_adu.then_some(Self { samples: [-most, most], mean: None })
    }
}

/// The least and the most that came off a frame; none where frames did, or what rows and columns add, and where something else was
/// done to its samples.
pub fn taken_off(metadata: &Metadata) -> Option<[f64; 2]> {
    let correction = metadata.correction.as_ref();
    let demosaic = metadata.demosaic.as_ref();
    let are_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
    if !are_codes
        || !correction.is_none_or(CorrectionRecord::is_a_shift)
        || demosaic.is_some_and(|record| record.black_deltas)
    {
        return None;
    }
    let of_record = correction.map_or([0.0; 4], |record| record.black_adu.sites());
    let of_planes = demosaic.map_or([0.0; 4], |record| record.black.sites());
    let off: [f64; 4] = std::array::from_fn(|site| of_record[site] + of_planes[site]);
    Some([off.into_iter().fold(f64::INFINITY, f64::min), off.into_iter().fold(f64::NEG_INFINITY, f64::max)])
}

/// What noise takes off the mean of a frame without light at most, ADU, by its sensor and its converter, or that of the sensor; none
/// where noise reaches the largest code.
pub fn most_off_bias(frame: &FrameHeader, readout: &ReadOut) -> Option<f64> {
    let adc = frame.metadata.adc.unwrap_or_else(|| AdcRecord::of_readout(readout));
    let off = |adc: AdcRecord| Some(adc.bias_adu - least_mean(frame, readout, adc)?);
    match readout.taps.as_ref() {
        None => off(adc),
        Some(taps) => (0..taps.count()).try_fold(0.0, |most: f64, tap| Some(most.max(off(adc.of_tap(taps, tap))?))),
    }
}

/// The least mean of samples of one converter before anything came off; none where noise reaches the largest code, which cuts the
/// mean.
fn least_mean(frame: &FrameHeader, readout: &ReadOut, adc: AdcRecord) -> Option<f64> {
    let read_noise = readout.read_noises_e().fold(0.0, f64::max);
    let own = read_noise.hypot(readout.dsnu_e);
    let [rows, columns] =
        [readout.row_noise_e.hypot(readout.dsnu_row_e), readout.column_noise_e.hypot(readout.dsnu_column_e)];
    let [width, height] = [frame.geometry.width.max(1) as f64, frame.geometry.height.max(1) as f64];
    let all = width * height;
    let drift = readout.black_drift_e.powi(2) * (2.0 * readout.black_drift_rows / height).min(1.0);
    let of_mean = (own.powi(2) / all + rows.powi(2) / height + columns.powi(2) / width + drift).sqrt();
    let tail = Z * Z / 2.0;
    let jumping = readout.rts_share * all;
    let jumps = readout.rts_amplitude_e * (jumping + 2.0 * (jumping * tail).sqrt() + tail) / all;
    let jumps = if jumping > 0.0 { jumps } else { 0.0 };
    let one = own.hypot(rows).hypot(columns).hypot(readout.black_drift_e);
    let most = adc.level_at(Z * one + readout.rts_amplitude_e * tail * f64::from(u8::from(jumping > 0.0)));
    if most >= f64::from(adc.top_code()) {
        return None;
    }
    // Of codes that bend the mean is off by more than the code of the mean, and by less than that of one photosite.
    let off_e = if adc.linearization.is_some() { Z * one + jumps } else { Z * of_mean + jumps };
    let level = adc.level_at(-off_e - tail / 2.0 / all);
    Some(adc.sample(level) - 1.0_f64.max(adc.sample_slope(adc.bias_adu)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::readout::tests::kaf5101ce;
    use crate::camera::sensor::tests::kaf5101ce as sensor;
    use crate::frame::Geometry;

    fn frame(readout: ReadOut) -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.adc = Some(AdcRecord::of_readout(&readout));
        metadata.sensor = Some(crate::camera::sensor::Sensor { readout: Some(readout), ..sensor() });
        FrameHeader { name: "codes".into(), geometry: Geometry::new(100, 50, &["Y"]), metadata }
    }

    #[test]
    fn a_mean_is_the_bias_less_what_noise_takes() {
        let bounds = Bounds::of(&frame(kaf5101ce())).unwrap();
        // 8 standard deviations of a mean of 5000, 32/5000 electrons, and 1 for what codes round.
        let readout = kaf5101ce();
        let off_e = 8.0 * readout.read_noise_e / 5000_f64.sqrt() + 16.0 / 5000.0 * 1.0;
        let expected = readout.bias_adu - readout.adu_per_e * off_e - 1.0;
        assert!((bounds.mean.unwrap() - expected).abs() < 0.02, "{bounds:?} {expected}");
        assert!(bounds.samples[0] > -0.01 && bounds.samples[1] < 4095.01);
        let less = |black: f64| {
            let mut frame = frame(kaf5101ce());
            frame.metadata.correction = Some(CorrectionRecord::of_black(black.into(), false));
            Bounds::of(&frame).unwrap()
        };
        assert!((less(1753.0).mean.unwrap() - (expected - 1753.0)).abs() < 0.02);
        assert!((less(1753.0).samples[0] + 1753.0).abs() < 0.02);
    }

    #[test]
    fn nothing_is_known_of_noise_that_is_cut_and_of_samples_that_were_divided() {
        let loud = frame(ReadOut { bias_adu: 4000.0, read_noise_e: 300.0, ..kaf5101ce() });
        assert_eq!(Bounds::of(&loud).unwrap().mean, None);
        let mut divided = frame(kaf5101ce());
        divided.metadata.correction =
            Some(CorrectionRecord { cte: Some(0.99), ..CorrectionRecord::of_black(1753.0.into(), false) });
        assert_eq!(Bounds::of(&divided), None);
    }
}
