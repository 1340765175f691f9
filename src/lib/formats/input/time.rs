//! Exposure times beside samples: what the sensor would have collected in them without light, and light that no such time has.

use crate::camera::levels::OF_COOLED;
use crate::camera::optics::is_frame_time_in_ms;
use crate::formats::register;
use crate::metadata::{FrameHeader, TakenAs};
use crate::text::{in_digits, ms_in_s};
use crate::units::QuantityKind;

/// Times from here on may be ms or the denominator of a shutter, s.
const LEAST_S: f64 = 2.0;
/// So many times may a dark signal be off what the sensor predicts.
const TIMES: f64 = 10.0;
/// What is said of a frame that lacks the dark signal of its sensor.
pub const TOO_DARK: &str = "its sensor has a dark signal of";
/// Levels are told to so many ADU, and to such a share.
const NEAR: [f64; 2] = [4.0, 0.02];
/// Samples of a stretch, and one pair of rows in so many that is looked at.
const STRETCH: usize = 128;
const PAIRS: usize = 4;
/// Standard deviations by which the mean of a stretch may be low.
const Z: f64 = 6.0;
/// The share of the range above which the mean of a frame is bright, and where the range ends that nothing tells.
const BRIGHT: f64 = 0.25;
const LARGEST_CODE: f64 = 65_535.0;

/// What is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimeCheck {
    time_s: f64,
    /// The bias, and the least dark signal above it that the sensor has, ADU; none of a sensor that is not known, or whose signal does not
    /// show.
    dark: Option<[f64; 2]>,
    /// Whether the time is that of the file's own tags, and looks like ms.
    looks_like_ms: bool,
    row: usize,
    /// The least of means of stretches, each with what it may be low.
    darkest: f64,
    /// The count and the sum of the samples.
    sums: [f64; 2],
}

impl TimeCheck {
    /// Of codes of a camera whose time is told, by tags of the file where `is_tagged`.
    pub fn of(frame: &FrameHeader, is_tagged: bool) -> Option<Self> {
        let metadata = &frame.metadata;
        let are_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
        let are_made = metadata.adc.is_some() || metadata.noise.is_some() || metadata.demosaic.is_some();
        let time_s = metadata.time_s().filter(|time_s| *time_s >= LEAST_S)?;
        if !are_codes || are_made || metadata.correction.is_some() {
            return None;
        }
        let is_light = !matches!(metadata.taken_as, Some(TakenAs::Dark | TakenAs::Bias | TakenAs::Flat));
        let looks_like_ms = is_tagged && is_light && is_frame_time_in_ms(time_s);
        let dark = least_dark(frame, time_s);
        (looks_like_ms || dark.is_some()).then_some(Self {
            time_s,
            dark,
            looks_like_ms,
            row: 0,
            darkest: f64::INFINITY,
            sums: [0.0; 2],
        })
    }

    /// Looks at rows of the frame, in its first plane.
    pub fn look(&mut self, rows: &[f32], frame: &FrameHeader) {
        let width = frame.geometry.width.max(1);
        for row in rows.chunks_exact(frame.geometry.row_samples().max(1)) {
            if (self.row / 2).is_multiple_of(PAIRS) {
                // Whole stretches, or the whole of a short row.
                row[..width].chunks(STRETCH).filter(|part| part.len() == STRETCH.min(width)).for_each(|s| self.take(s));
            }
            self.row += 1;
        }
    }

    fn take(&mut self, stretch: &[f32]) {
        if !stretch.iter().all(|sample| sample.is_finite()) {
            return;
        }
        let n = stretch.len() as f64;
        let sum: f64 = stretch.iter().map(|sample| f64::from(*sample)).sum();
        let squares: f64 = stretch.iter().map(|sample| f64::from(*sample).powi(2)).sum();
        let mean = sum / n;
        let scatter = (squares / n - mean * mean).max(0.0).sqrt();
        self.darkest = self.darkest.min(mean + Z * scatter / n.sqrt());
        self.sums = [self.sums[0] + n, self.sums[1] + sum];
    }

    /// Whether the mean is that of a scene which is no night sky.
    fn is_bright(&self, frame: &FrameHeader) -> bool {
        let [count, sum] = self.sums;
        let metadata = &frame.metadata;
        let black = metadata.black_level_adu.map_or(0.0, |black| black.mean());
        let range = metadata.white_level_adu.map_or(LARGEST_CODE - black, |white| white.range_above(black));
        count > 0.0 && sum / count - black > BRIGHT * range
    }

    /// Why the time cannot well be in s, once all rows were looked at.
    fn doubt(&self, frame: &FrameHeader) -> Option<String> {
        let time_s = self.time_s;
        let (in_ms, of_shutter) = (ms_in_s(time_s), in_digits(time_s.recip(), 3));
        if let Some([bias, least]) = self.dark
            && self.darkest - bias < least - NEAR[0].max(NEAR[1] * bias.abs())
        {
            return Some(format!(
                "in its exposure of {time_s} s {TOO_DARK} {least:.0} ADU at least, and the darkest part of the frame is \
                 {:.0} ADU above the bias; {in_ms}, and 1/{time_s} s is {of_shutter} s, unless the sensor is cooled further than \
                 `sensor_temperature_k` tells, or the camera takes dark signal off itself",
                self.darkest - bias
            ));
        }
        (self.looks_like_ms && self.is_bright(frame)).then(|| {
            format!("an exposure of {time_s} s by its own tags is long for a frame that is as bright; {in_ms}")
        })
    }

    /// Has the program warn of a time that cannot well be in s.
    pub fn end(self, frame: &FrameHeader) {
        self.doubt(frame).into_iter().for_each(|doubt| register::doubt(format!("{}: {doubt}", frame.name)));
    }
}

/// The bias of the sensor that is named, and the least dark signal that it has in a time, ADU; none where that does not show.
fn least_dark(frame: &FrameHeader, time_s: f64) -> Option<[f64; 2]> {
    let metadata = &frame.metadata;
    let readout = metadata.sensor.as_ref()?.readout.as_ref()?;
    let temperature_k = metadata.sensor_temperature_k;
    let [ordinary_e, _] = readout.dark_charges_e(temperature_k.unwrap_or(readout.temperature_k), Some(time_s))?;
    let times = if temperature_k.is_some() { TIMES } else { TIMES * OF_COOLED };
    // A full photosite has no more.
    let least_e = (ordinary_e / times).min(0.5 * readout.full_well_e);
    let bias = readout.bias_adu;
    let least = readout.adu_per_e * least_e;
    (least > 2.0 * NEAR[0].max(NEAR[1] * bias.abs())).then_some([bias, least])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;

    /// A frame of 200 columns whose samples scatter about a level, and what is doubted of its time.
    fn doubt(metadata: Metadata, level: f32, scatter: f32) -> Option<String> {
        let frame = FrameHeader { name: "a".into(), geometry: Geometry::new(200, 16, &["Y"]), metadata };
        let mut check = TimeCheck::of(&frame, true)?;
        let sample = |i: u16| level + scatter * (f32::from(i * 7 % 11) - 5.0) / 5.0;
        check.look(&(0..3200).map(sample).collect::<Vec<_>>(), &frame);
        check.doubt(&frame)
    }

    fn tagged(time_s: f64, white: Option<f64>) -> Metadata {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.exposure_time_s = Some(time_s);
        metadata.white_level_adu = white.map(Into::into);
        metadata.black_level_adu = white.map(|_| 500.0.into());
        metadata
    }

    #[test]
    fn bright_frames_of_a_time_in_ms_are_doubted() {
        let text = "an exposure of 33 s by its own tags is long for a frame that is as bright; 33 ms is 0.033 s";
        assert_eq!(doubt(tagged(33.0, Some(4095.0)), 2000.0, 300.0).as_deref(), Some(text));
        assert_eq!(doubt(tagged(33.0, None), 26_000.0, 8000.0).as_deref(), Some(text));
        // Night skies, dark frames and flats, and times that are set.
        for (time_s, white, level, scatter) in [
            (33.0, Some(4095.0), 700.0, 300.0),
            (33.0, None, 2600.0, 800.0),
            (30.0, Some(4095.0), 2000.0, 300.0),
            (120.0, None, 26_000.0, 8000.0),
            (0.033, None, 26_000.0, 8000.0),
        ] {
            assert_eq!(doubt(tagged(time_s, white), level, scatter), None, "{time_s} {level}");
        }
        let dark = Metadata { taken_as: Some(TakenAs::Dark), ..tagged(33.0, Some(4095.0)) };
        assert_eq!(doubt(dark, 2000.0, 300.0), None);
    }
}
