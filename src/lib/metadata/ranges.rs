//! Numbers of metadata that cannot be, as those of a sensor file.

use super::Metadata;
use crate::camera::readout::check_temperature;
use std::ops::Range;

impl Metadata {
    /// Checks numbers that a person may have written beside a frame, of which no other part of the metadata tells more.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub(crate) fn check_ranges(&self) -> Result<(), String> {
        /// Noise is drawn without a dark signal at next to none.
        const NEXT_TO_NONE_K: Range<f64> = 1.0..2.0;
        if let Some(kelvin) = self.sensor_temperature_k {
            check_temperature("sensor_temperature_k", kelvin)?;
        }
        let drawn = self.noise.as_ref();
        if let Some(kelvin) = drawn.map(|noise| noise.temperature_k).filter(|kelvin| !NEXT_TO_NONE_K.contains(kelvin)) {
            check_temperature("noise.temperature_k", kelvin)?;
        }
        let black = self.black_noise;
        let not_negative = [
            ("noise.dark_e", drawn.map(|noise| noise.dark_e)),
            ("noise.hot_pixel_e", drawn.map(|noise| noise.hot_pixel_e)),
            ("noise.smear_per_row", drawn.map(|noise| noise.smear_per_row)),
            ("black_noise.site_adu2", black.map(|noise| noise.site_adu2)),
            ("black_noise.row_adu2", black.map(|noise| noise.row_adu2)),
            ("black_noise.column_adu2", black.map(|noise| noise.column_adu2)),
        ];
        for (key, value) in not_negative {
            if let Some(value) = value.filter(|value| !(0.0..f64::INFINITY).contains(value)) {
                return Err(format!("`{key}` is {value}; it must not be negative"));
            }
        }
        if let Some(cte) = drawn.and_then(|noise| noise.cte).filter(|cte| !(*cte > 0.0 && *cte <= 1.0)) {
            return Err(format!("`noise.cte` is {cte}; it must be above 0, and 1 at most"));
        }
        match self.masked_areas.iter().find(|[_, _, width, height]| *width < 0 || *height < 0) {
            Some([x, y, width, height]) => Err(format!(
                "`masked_areas` has [{x}, {y}, {width}, {height}]; an area is X, Y, width and height on the sensor"
            )),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::BlackNoise;
    use crate::units::QuantityKind;

    #[test]
    fn numbers_that_cannot_be_are_told() {
        let problem = |change: &dyn Fn(&mut Metadata)| {
            let mut metadata = Metadata::new(QuantityKind::Adu);
            change(&mut metadata);
            metadata.check_ranges().err().unwrap_or_default()
        };
        for (kelvin, wanted) in [
            (20.0, "`sensor_temperature_k` is 20; it is in K, and 20 looks like degrees Celsius, which is 293.15 K"),
            (-20.0, "`sensor_temperature_k` is -20; it is in K, and -20 looks like degrees Celsius, which is 253.15 K"),
            (29_315.0, "`sensor_temperature_k` is 29315, which is the temperature of no sensor in K"),
            (f64::NAN, "`sensor_temperature_k` is NaN, which is the temperature of no sensor in K"),
            (77.0, ""),
            (293.15, ""),
        ] {
            assert_eq!(problem(&|metadata| metadata.sensor_temperature_k = Some(kelvin)), wanted);
        }
        let noise = BlackNoise { site_adu2: -1.0, row_adu2: 0.0, column_adu2: 0.0 };
        assert!(problem(&|metadata| metadata.black_noise = Some(noise)).contains("must not be negative"));
        assert!(problem(&|metadata| metadata.masked_areas = vec![[0, 0, -4, 8]]).contains("[0, 0, -4, 8]"));
        assert_eq!(problem(&|metadata| metadata.masked_areas = vec![[-2, 0, 4, 8]]), "");
    }
}
