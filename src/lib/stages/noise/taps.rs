//! Read noise of sensors that are read through several amplifiers.

use crate::camera::readout::ReadOut;
use crate::frame::to_sample;
use crate::metadata::{FrameHeader, NoiseRecord};
use crate::random::Source;

/// Read noise of the frame's columns, e⁻, above the border of a sensor that is read through taps and below; empty where all
/// photosites have that of the model.
#[derive(Debug, Clone, Default)]
pub(super) struct ReadNoise {
    first_below: i64,
    halves: [Vec<f32>; 2],
}

impl ReadNoise {
    /// Of a frame.
    pub fn of(frame: &FrameHeader, readout: &ReadOut, record: &NoiseRecord) -> Self {
        let Some(taps) = &readout.taps else { return Self::default() };
        if taps.read_noise_e.is_empty() || !record.sources.contains(&Source::Ron) {
            return Self::default();
        }
        let first_below = i64::from(readout.height / 2);
        let x0 = i64::from(frame.geometry.origin[0]);
        let of_column = |x: usize, y: i64| taps.read_noise_e(readout.tap([x0 + x as i64, y]), readout.read_noise_e);
        let of_row = |y: i64| (0..frame.geometry.width).map(|x| to_sample(of_column(x, y))).collect();
        Self { first_below, halves: [first_below - 1, first_below].map(of_row) }
    }

    /// Of a row of the sensor.
    pub fn row(&self, row: i32) -> &[f32] {
        &self.halves[usize::from(i64::from(row) >= self.first_below)]
    }
}
