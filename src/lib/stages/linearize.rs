//! Codes made proportional to charge.

use crate::camera::taps::Taps;
use crate::error::Result;
use crate::frame::{Geometry, to_sample};
use crate::metadata::{AdcRecord, FrameHeader};
use crate::stages::darks::check_codes;
use crate::units::QuantityKind;

/// Makes codes straight, by the linearization of the sensor that they come from.
///
/// y = b + f(x − b)        b the bias, f of [`crate::camera::linearity::Linearization`], extended along its tangents beyond the codes
///
/// Of a sensor that is read through several amplifiers b is that of the amplifier of each photosite ([`AdcRecord::of_tap`]).
#[derive(Debug, Clone)]
pub struct Linearize {
    /// That of all photosites, or those of the amplifiers.
    converters: Vec<Straightened>,
    taps: Option<Places>,
}

/// A converter, and what becomes of each of its codes.
#[derive(Debug, Clone)]
struct Straightened {
    adc: AdcRecord,
    table: Vec<f32>,
}

/// Which amplifier reads which photosite of a frame.
#[derive(Debug, Clone)]
struct Places {
    taps: Taps,
    /// Width and height of the sensor.
    size: [u32; 2],
    /// Column and row of the first photosite.
    origin: [i64; 2],
    width: usize,
}

impl Places {
    fn of(frame: &FrameHeader) -> Option<Self> {
        let readout = frame.readout().ok()?;
        let Geometry { origin, width, .. } = frame.geometry;
        let size = [readout.width, readout.height];
        readout.taps.clone().map(|taps| Self { taps, size, origin: origin.map(i64::from), width })
    }
}

impl Linearize {
    /// What makes the samples of `frame` straight, in whose metadata they are so from now on, as are their levels. Of several amplifiers
    /// the black level becomes that of the bias of the read-out, and the white level the lowest that white becomes.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::Order`] and [`crate::error::Error::Format`] unless the frame holds codes as the converter gave them; [`crate::error::Error::Format`] where
    /// they are straight already, or nothing is known to make them so, or black levels differ among rows or columns;
    /// [`crate::error::Error::MissingKey`] where the metadata name no sensor.
    pub fn of(frame: &mut FrameHeader) -> Result<Self> {
        check_codes(frame)?;
        let known = frame.metadata.adc;
        let adc = known.map_or_else(|| frame.readout().map(AdcRecord::of_readout), Ok)?;
        if adc.is_linearized {
            return Err(frame.refuse("its codes are made straight already"));
        }
        let Some(curve) = adc.linearization else {
            return Err(frame.refuse("its sensor has no `linearization`; a sensor file can have one in its `readout`"));
        };
        let all = AdcRecord { is_linearized: true, ..adc };
        let taps = Places::of(frame);
        let adcs = all.of_taps(frame.taps());
        adcs.iter().try_for_each(|adc| curve.check_rises(adc.range())).map_err(|problem| frame.refuse(problem))?;
        let metadata = &mut frame.metadata;
        if metadata.black_by_row.iter().chain(&metadata.black_by_column).any(|delta| *delta != 0.0) {
            return Err(frame.refuse(
                "its black level differs among rows or columns, and codes are made straight before that is subtracted",
            ));
        }
        let lowest = |code: f64| adcs.iter().map(|adc| adc.sample(code)).fold(f64::INFINITY, f64::min);
        metadata.black_level_adu = metadata.black_level_adu.map(|level| level.map(|code| all.sample(code)));
        metadata.white_level_adu = metadata.white_level_adu.map(|level| level.map(lowest));
        *metadata = metadata.becoming(QuantityKind::Adu);
        metadata.adc = Some(match metadata.white_level_adu {
            // White of the others is above it.
            Some(white) if taps.is_some() => AdcRecord { white_adu: Some(white.largest()), ..all },
            Some(white) => all.with_white(white.largest()),
            None => all,
        });
        Ok(Self { converters: adcs.into_iter().map(Straightened::of).collect(), taps })
    }

    /// Makes the samples of a row of the frame straight, plane after plane.
    pub fn apply(&self, row: &mut [f32], y: usize) {
        let Some(Places { taps, size, origin, width }) = &self.taps else {
            row.iter_mut().for_each(|sample| *sample = self.converters[0].straight(*sample));
            return;
        };
        for plane in row.chunks_mut(*width) {
            for (x, sample) in plane.iter_mut().enumerate() {
                let tap = taps.tap(*size, [origin[0] + x as i64, origin[1] + y as i64]);
                *sample = self.converters[tap].straight(*sample);
            }
        }
    }
}

impl Straightened {
    fn of(adc: AdcRecord) -> Self {
        Self { adc, table: (0..=adc.top_code()).map(|code| to_sample(adc.sample(code.into()))).collect() }
    }

    fn straight(&self, sample: f32) -> f32 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "NaN and what is below 0 become 0")]
        let code = sample as usize;
        match self.table.get(code) {
            Some(straight) if code as f32 == sample => *straight,
            _ => to_sample(self.adc.sample(f64::from(sample))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::linearity::Linearization;
    use crate::camera::sensor::tests::kaf5101ce;
    use crate::camera::taps::TapLayout;
    use crate::cfa::CfaPattern;
    use crate::error::Error;
    use crate::metadata::Metadata;
    use crate::stages::saturation::FullLevels;

    fn bent() -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(CfaPattern::Rggb.into());
        let linearization = Some(Linearization::polynomial(vec![1.0, 1e-5]).unwrap());
        metadata.adc = Some(AdcRecord { linearization, ..AdcRecord::new(12, 100.0, 0.05) });
        metadata.black_level_adu = Some(110.0.into());
        metadata.white_level_adu = Some(4095.0.into());
        FrameHeader { name: "codes".into(), geometry: Geometry::new(4, 3, &["Y"]), metadata }
    }

    #[test]
    fn codes_and_levels_become_straight_alike() {
        let mut frame = bent();
        let linearize = Linearize::of(&mut frame).unwrap();
        let mut samples = [110.0, 4095.0, 100.0, 1100.5, -0.0, f32::NAN, f32::INFINITY];
        linearize.apply(&mut samples, 0);
        assert_eq!(samples[..3], [110.001, 4095.0 + 1e-5 * 3995.0 * 3995.0, 100.0].map(to_sample));
        assert_eq!(samples[3], to_sample(1100.5 + 1e-5 * 1000.5 * 1000.5));
        assert_eq!(samples[4], to_sample(1e-5 * 1e4));
        assert!(samples[5].is_nan() && samples[6] == f32::INFINITY);
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        near(frame.metadata.uniform_black_adu().unwrap(), 110.001);
        near(frame.metadata.white_level_adu.unwrap().largest(), 4095.0 + 1e-5 * 3995.0 * 3995.0);
        assert!(frame.metadata.adc.unwrap().is_linearized);
    }

    #[test]
    fn what_cannot_be_made_straight_is_refused() {
        let refused = |change: &dyn Fn(&mut FrameHeader)| {
            let mut frame = bent();
            change(&mut frame);
            Linearize::of(&mut frame).unwrap_err()
        };
        let said = |change: &dyn Fn(&mut FrameHeader)| refused(change).to_string();
        assert!(said(&|f| f.metadata.adc = Some(AdcRecord::new(12, 100.0, 0.05))).contains("no `linearization`"));
        assert!(said(&|f| f.metadata.black_by_row = vec![1.0]).contains("rows or columns"));
        assert!(matches!(refused(&|f| f.metadata.adc = None), Error::MissingKey { key: "sensor", .. }));
        assert!(matches!(refused(&|f| f.metadata.quantity = QuantityKind::Electrons), Error::Order { .. }));
        let mut once = bent();
        Linearize::of(&mut once).unwrap();
        assert!(Linearize::of(&mut once).unwrap_err().to_string().contains("already"));
    }

    /// Each photosite by the bias of what reads it, at its place on the sensor; white is the lowest that it becomes.
    #[test]
    fn every_amplifier_begins_at_its_own_bias() {
        let mut frame = bent();
        frame.geometry.origin = [1, 0];
        let mut sensor = kaf5101ce();
        let taps = Taps {
            layout: TapLayout::Columns,
            gain: vec![1.0, 1.1],
            offset_e: vec![0.0, -400.0],
            read_noise_e: vec![],
        };
        sensor.readout.as_mut().unwrap().taps = Some(taps);
        frame.metadata.sensor = Some(sensor);
        let linearize = Linearize::of(&mut frame).unwrap();
        let mut samples = [1100.0; 4];
        linearize.apply(&mut samples, 0);
        // 100 − 0.05·1.1·400 = 78 is the bias of odd columns, the first of the frame.
        let [even, odd] = [100.0, 78.0].map(|bias: f64| to_sample(1100.0 + 1e-5 * (1100.0 - bias).powi(2)));
        assert_eq!(samples, [odd, even, odd, even]);
        let white = frame.metadata.white_level_adu.unwrap().largest();
        assert!((white - (4095.0 + 1e-5 * 3995.0 * 3995.0)).abs() < 1e-9, "{white}");
        assert!((frame.metadata.uniform_black_adu().unwrap() - 110.001).abs() < 1e-9);
    }

    /// Full well at code 3900, and a white level that is set to 3000, 3950 and the highest code: the lower of both, straight.
    #[test]
    fn samples_are_full_from_the_lower_of_full_well_and_white() {
        for (white, full) in [(3000.0, 3000.0), (3950.0, 3900.0), (4095.0, 3900.0)] {
            let mut frame = bent();
            let adc = frame.metadata.adc.unwrap();
            let mut sensor = kaf5101ce();
            sensor.readout.as_mut().unwrap().full_well_e = adc.electrons_at(3900.0);
            frame.metadata.sensor = Some(sensor);
            frame.metadata.white_level_adu = Some(white.into());
            Linearize::of(&mut frame).unwrap();
            let straight = AdcRecord { is_linearized: true, ..adc }.sample(full);
            assert!((f64::from(FullLevels::of(&frame).unwrap().classes()[0]) - straight).abs() < 0.6, "{white}");
        }
    }
}
