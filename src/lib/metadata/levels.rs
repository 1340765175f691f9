//! Levels beside the converter that gave the codes.

use super::{AdcRecord, CorrectionRecord, Metadata};
use crate::camera::levels::WhiteLevel;
use crate::units::QuantityKind;

/// What the last digits of a level lost, relative to it.
const LOST: f64 = 1e-9;

impl Metadata {
    /// Checks the converter of a frame, and the white level beside it; one that is not told is where codes end, less what came off
    /// alike of a class. Where frames came off, or several classes were made of each other, the level that is told stands, or none.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub(crate) fn complete_levels(&mut self) -> Result<(), String> {
        let Some(adc) = self.adc else { return Ok(()) };
        adc.check()?;
        let is_shift = self.correction.as_ref().is_none_or(CorrectionRecord::is_a_shift);
        if self.quantity != QuantityKind::Adu || !is_shift || self.demosaic.is_some() {
            return Ok(());
        }
        let off = self.correction.as_ref().map_or([0.0; 4], |record| record.black_adu.sites());
        let [least_off, most_off] =
            [off.into_iter().fold(f64::INFINITY, f64::min), off.into_iter().fold(0.0, f64::max)];
        let top = self.top_sample(adc);
        match self.white_level_adu {
            Some(white) if white.largest() > (top - least_off) + LOST * (top.abs() + least_off.abs()) => Err(format!(
                "its `white_level_adu` is {}, beyond the largest code of its converter of {} bits, {}; correct one of the two",
                white.largest(),
                adc.bits,
                top - least_off
            )),
            // By the sites of a class black may differ: no level tells then.
            None if least_off == most_off || self.correction.is_none() => {
                self.white_level_adu = Some(WhiteLevel::Uniform(adc.white_adu.unwrap_or(top) - most_off));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// The largest sample that a converter gives, that of the amplifier which gives the largest.
    fn top_sample(&self, adc: AdcRecord) -> f64 {
        let code = f64::from(adc.top_code());
        let taps = self.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref()?.taps.as_ref());
        adc.of_taps(taps).iter().map(|adc| adc.sample(code)).fold(f64::NEG_INFINITY, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(white: Option<f64>) -> Metadata {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.adc = Some(AdcRecord::new(12, 100.0, 0.1));
        metadata.white_level_adu = white.map(WhiteLevel::from);
        metadata
    }

    #[test]
    fn a_white_level_is_where_codes_end_or_below() {
        let completed = |mut metadata: Metadata| metadata.complete_levels().map(|()| metadata.white_level_adu);
        assert_eq!(completed(codes(None)), Ok(Some(4095.0.into())));
        assert_eq!(completed(codes(Some(4000.0))), Ok(Some(4000.0.into())));
        let said = completed(codes(Some(65_535.0))).unwrap_err();
        assert!(said.contains("is 65535, beyond the largest code of its converter of 12 bits, 4095"), "{said}");
        let less = |white, off: f64| Metadata {
            correction: Some(CorrectionRecord::of_black(off.into(), false)),
            ..codes(white)
        };
        assert_eq!(completed(less(None, 100.0)), Ok(Some(3995.0.into())));
        assert!(completed(less(Some(4095.0), 100.0)).is_err());
        // A bias below 0 is subtracted too.
        assert_eq!(completed(less(Some(4145.0), -50.0)), Ok(Some(4145.0.into())));
        assert_eq!(completed(Metadata { quantity: QuantityKind::Xyz, ..codes(None) }), Ok(None));
    }

    #[test]
    fn converters_that_cannot_be_are_refused() {
        let mut wide = codes(None);
        wide.adc = Some(AdcRecord::new(40, 100.0, 0.1));
        assert_eq!(wide.complete_levels().unwrap_err(), "a converter of 40 bits is impossible here; give 1 to 16");
    }
}
