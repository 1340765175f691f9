//! The lens: what of a radiance reaches the sensor, and where.

use crate::error::{Error, Result};
use crate::text::ms_in_s;
use crate::units::MM_PER_UM;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// In air no lens has a smaller f-number.
const LEAST_F_NUMBER: f64 = 0.5;
/// Times from here on are those of the night, s.
const LONG_S: f64 = 5.0;
/// Times beyond are those of no single frame, s.
const LONGEST_S: f64 = 3600.0;
/// Frames per second whose times in ms, to [`SAME_TIME`], are no times that anybody sets in s: 41.7, 33.3, 16.7, 8.3 and 6.9. Others, 40, 20
/// and 10, are set at night.
const FRAME_RATES: [f64; 5] = [24.0, 30.0, 60.0, 120.0, 144.0];
/// Numbers in two digits differ by no more.
const SAME_TIME: f64 = 0.021;
/// Denominators of shutters that are no round times in s.
const SHUTTERS: [f64; 7] = [125.0, 160.0, 320.0, 640.0, 1250.0, 2500.0, 3200.0];
/// F-numbers from here on are beyond pinholes, and look like thousandths of the smallest lenses have and more.
const MOST_F_NUMBER: f64 = 1000.0 * LEAST_F_NUMBER;
/// Focal lengths below look like m, mm: the lenses of endoscopes have longer ones.
const LEAST_FOCAL_LENGTH_MM: f64 = 0.5;
/// Focal lengths from here on look like µm, mm.
const MOST_FOCAL_LENGTH_MM: f64 = 10_000.0;

/// Whether a time is one of the night.
pub fn is_long(time_s: f64) -> bool {
    time_s >= LONG_S
}

/// Whether a time is that of a frame of a video in ms, which nobody sets in s.
pub fn is_frame_time_in_ms(time_s: f64) -> bool {
    is_long(time_s) && FRAME_RATES.iter().any(|rate| (time_s * rate / 1000.0 - 1.0).abs() < SAME_TIME)
}

/// A warning of an exposure time that looks as if it were in ms, or the denominator of a fraction. Round times are those of the night.
pub fn doubt_of_time(time_s: f64) -> Option<String> {
    let long = || format!("an exposure of {time_s} s is long");
    match time_s {
        _ if !is_long(time_s) => None,
        _ if SHUTTERS.contains(&time_s) => Some(format!("{}; 1/{time_s} s is {} s", long(), 1.0 / time_s)),
        _ if time_s > LONGEST_S || is_frame_time_in_ms(time_s) => Some(format!("{}; {}", long(), ms_in_s(time_s))),
        _ => None,
    }
}

/// A warning of an f-number that looks as if it were in thousandths.
pub fn doubt_of_aperture(f_number: f64) -> Option<String> {
    (f_number >= MOST_F_NUMBER)
        .then(|| format!("an f-number of {f_number} is that of no lens; in thousandths it is {}", f_number / 1000.0))
}

/// A warning of a focal length that looks as if it were in m or µm.
pub fn doubt_of_focal_length(focal_length_mm: f64) -> Option<String> {
    let (unit, meant) = match focal_length_mm {
        short if short < LEAST_FOCAL_LENGTH_MM => ("m", short * 1000.0),
        long if long >= MOST_FOCAL_LENGTH_MM => ("um", long / 1000.0),
        _ => return None,
    };
    Some(format!(
        "a focal length of {focal_length_mm} mm is that of few lenses; {focal_length_mm} {unit} is {meant} mm"
    ))
}

/// Exposure time and lens setting.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Time in s.
    pub exposure_s: f64,
    /// Relative aperture N.
    pub f_number: f64,
    /// Transmittance of the lens, 0…1.
    pub lens_transmittance: f64,
}

impl Exposure {
    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] naming what is out of range.
    pub fn checked(self) -> Result<Self> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !positive(self.exposure_s) {
            return Err(Error::Usage(format!(
                "an exposure of {} s is impossible; give a time above 0",
                self.exposure_s
            )));
        }
        if !positive(self.f_number) {
            return Err(Error::Usage(format!(
                "an f-number of {} is impossible; give one above 0, such as 8",
                self.f_number
            )));
        }
        if !(positive(self.lens_transmittance) && self.lens_transmittance <= 1.0) {
            return Err(Error::Usage(format!(
                "a lens transmittance of {} is impossible; give a fraction above 0 and at most 1",
                self.lens_transmittance
            )));
        }
        if self.f_number < LEAST_F_NUMBER {
            return Err(Error::Usage(format!(
                "an f-number of {} is beyond any lens; it looks like the inverse of {}",
                self.f_number,
                1.0 / self.f_number
            )));
        }
        Ok(self)
    }

    /// Warnings of what looks as if it were in another unit.
    pub fn doubts(self) -> impl Iterator<Item = String> {
        doubt_of_time(self.exposure_s).into_iter().chain(doubt_of_aperture(self.f_number))
    }

    /// Irradiance on the axis per radiance, in sr.
    ///
    /// E/L = π T / (4N² + 1)        object at infinity, pupil magnification 1        [HP2005, Eq. 1a]
    pub fn image_illumination_sr(&self) -> f64 {
        PI * self.lens_transmittance / (4.0 * self.f_number.powi(2) + 1.0)
    }

    /// Radiant exposure per radiance, in s sr: what a camera's signal is proportional to.
    pub fn exposure_s_sr(&self) -> f64 {
        self.exposure_s * self.image_illumination_sr()
    }
}

/// Natural vignetting of a frame centered on the optical axis.
///
/// cos⁴θ = 1 / (1 + tan²θ_H + tan²θ_V)²        [HP2005, Eq. 1b]
///
/// because cos(arctan t) = 1/√(1 + t²). The tangents are those of the photosites' centers, (j + ½ − N_H/2) · pitch / f;
/// the paper's range of indices in Eq. 2 has two values too many.
#[derive(Debug, Clone, PartialEq)]
pub struct Vignetting {
    /// tan²θ_H of each column.
    columns: Vec<f64>,
    /// tan²θ_V of each row.
    rows: Vec<f64>,
}

impl Vignetting {
    /// The vignetting of `width` × `height` photosites of `pixel_pitch_um` behind a lens of `focal_length_mm`.
    pub fn new(width: usize, height: usize, pixel_pitch_um: f64, focal_length_mm: f64) -> Self {
        let squares = |count: usize| {
            (0..count)
                .map(|i| {
                    let offset = i as f64 + 0.5 - count as f64 / 2.0;
                    (offset * pixel_pitch_um * MM_PER_UM / focal_length_mm).powi(2)
                })
                .collect()
        };
        Self { columns: squares(width), rows: squares(height) }
    }

    /// Whether it darkens no photosite by as much as half a unit in the last place of a sample, 2⁻²⁵ of it: a field of
    /// (almost) no extent.
    pub fn is_negligible(&self) -> bool {
        let largest = |squares: &[f64]| squares.iter().copied().fold(0.0, f64::max);
        let least = (1.0 + largest(&self.columns) + largest(&self.rows)).powi(2).recip();
        1.0 - least < f64::from(f32::EPSILON) / 4.0
    }

    /// cos⁴θ of each photosite in row `y`.
    pub fn row(&self, y: usize) -> impl Iterator<Item = f64> {
        let vertical = 1.0 + self.rows[y];
        self.columns.iter().map(move |horizontal| (vertical + horizontal).powi(-2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rational_form_is_the_fourth_power_of_the_cosine() {
        let vignetting = Vignetting::new(5, 4, 2000.0, 10.0);
        for y in 0..4 {
            for (x, factor) in vignetting.row(y).enumerate() {
                let tangent = |i: usize, count: f64| (i as f64 + 0.5 - count / 2.0) * 2.0 / 10.0;
                let angle = tangent(x, 5.0).hypot(tangent(y, 4.0)).atan();
                assert!((factor - angle.cos().powi(4)).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn impossible_settings_are_refused() {
        let good = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };
        assert!(good.checked().is_ok());
        for bad in [
            Exposure { exposure_s: -1.0, ..good },
            Exposure { exposure_s: f64::NAN, ..good },
            Exposure { f_number: 0.0, ..good },
            Exposure { lens_transmittance: 1.1, ..good },
            Exposure { f_number: 0.125, ..good },
        ] {
            assert!(bad.checked().is_err());
        }
        assert_eq!(good.doubts().count(), 0);
        let doubts: Vec<String> = Exposure { exposure_s: 33.0, f_number: 2800.0, ..good }.doubts().collect();
        assert_eq!(
            doubts,
            [
                "an exposure of 33 s is long; 33 ms is 0.033 s",
                "an f-number of 2800 is that of no lens; in thousandths it is 2.8"
            ]
        );
        for set in [
            0.033, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0, 120.0, 300.0, 500.0, 1800.0,
            3600.0,
        ] {
            assert_eq!(doubt_of_time(set), None, "{set}");
        }
        for meant in [33.0, 33.3, 16.67, 17.0, 8.33, 41.7, 6.94, 4000.0] {
            assert!(doubt_of_time(meant).is_some_and(|doubt| doubt.contains(&format!("{meant} ms is"))), "{meant}");
        }
        assert_eq!(doubt_of_time(125.0).unwrap(), "an exposure of 125 s is long; 1/125 s is 0.008 s");
        let said = |length| doubt_of_focal_length(length).unwrap_or_default();
        assert_eq!(said(0.05), "a focal length of 0.05 mm is that of few lenses; 0.05 m is 50 mm");
        assert_eq!(said(50_000.0), "a focal length of 50000 mm is that of few lenses; 50000 um is 50 mm");
        assert_eq!([said(2.0), said(50.0), said(2350.0)], [""; 3]);
    }
}
