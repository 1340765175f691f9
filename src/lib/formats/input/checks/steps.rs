//! Codes that lie several ADU apart, as those of fewer bits do that are stored times 2ⁿ, beside a sensor whose codes lie one apart, or beside
//! none.

use crate::camera::readout::ReadOut;
use crate::formats::register;
use crate::metadata::{AdcRecord, FrameHeader};
use crate::numerics::steps::Steps;
use crate::units::QuantityKind;

/// Fewer codes that are unlike may be multiples of a step by chance: of 2 with a chance of 2⁻¹⁶ or more.
const TELLING: usize = 16;

/// The step of the codes of a frame so far, and what is told of its sensor.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepCheck {
    steps: Steps,
    /// The first codes that are unlike, and how many they are.
    unlike: ([f32; TELLING], usize),
    largest: f32,
    sensor: Option<Told>,
}

/// What a sensor tells of its codes.
#[derive(Debug, Clone, Copy)]
struct Told {
    /// Noise beside that of a step of 1, ADU².
    read_adu2: f64,
    adu_per_e: f64,
    top_code: f64,
}

impl StepCheck {
    /// For codes of a camera; of one whose sensor is not named where nothing else tells their scale.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
        let is_open = metadata.history.is_empty() && metadata.white_level_adu.is_none();
        let are_codes = metadata.quantity == QuantityKind::Adu
            && metadata.noise.is_none()
            // What digitize wrote has the step of its sensor.
            && metadata.adc.is_none()
            && metadata.correction.is_none()
            && metadata.demosaic.is_none()
            && metadata.average.is_none();
        let told = |readout: &ReadOut| {
            let adu_per_e = metadata.adu_per_e().unwrap_or(readout.adu_per_e);
            let read_adu2 = (adu_per_e * readout.read_noise_e).powi(2);
            Told { read_adu2, adu_per_e, top_code: f64::from(AdcRecord::of_readout(readout).top_code()) }
        };
        let sensor = readout.map(told);
        let none = Self { steps: Steps::default(), unlike: Default::default(), largest: 0.0, sensor };
        (are_codes && (sensor.is_some() || is_open)).then_some(none)
    }

    /// Whether a sensor is named, whose codes lie one apart.
    pub fn knows_sensor(&self) -> bool {
        self.sensor.is_some()
    }

    /// Looks at rows of the frame, in its first plane.
    pub fn look(&mut self, rows: &[f32], frame: &FrameHeader) {
        let width = frame.geometry.width;
        for row in rows.chunks_exact(frame.geometry.row_samples().max(1)) {
            if self.steps.is_one() {
                return;
            }
            self.take(row[..width].iter().copied().filter(|sample| sample.is_finite()));
        }
    }

    fn take(&mut self, samples: impl Iterator<Item = f32> + Clone) {
        let (known, count) = &mut self.unlike;
        for sample in samples.clone() {
            if *count == TELLING {
                break;
            }
            if !known[..*count].contains(&sample) {
                known[*count] = sample;
                *count += 1;
            }
        }
        self.largest = samples.clone().fold(self.largest, f32::max);
        self.steps.take(samples.map(f64::from));
    }

    /// What its steps tell of the scale of its codes, or have of noise that the sensor does not tell, once all rows were looked at; none of
    /// what is 1 % of its read noise.
    fn doubt(&self) -> Option<String> {
        const LEAST: f64 = 0.01;
        let step = self.steps.step().filter(|step| *step > 1 && self.unlike.1 == TELLING)?;
        let Some(Told { read_adu2, adu_per_e, top_code }) = self.sensor else {
            return Some(format!(
                "its codes are multiples of {step}, as those of fewer bits are that are stored {step} times as large: black level, white \
                 level and matrix must be of such codes"
            ));
        };
        if f64::from(self.largest) > top_code {
            return Some(format!(
                "its codes are multiples of {step} up to {}, and those of its sensor end at {top_code}: they look {step} times as large as \
                 the camera made them; divide them, and the black level, by {step}",
                self.largest
            ));
        }
        let more = ((step as f64).powi(2) - 1.0) / 12.0;
        (more > LEAST * (read_adu2 + 1.0 / 12.0)).then(|| {
            format!(
                "its codes are multiples of {step}, and those of its sensor lie 1 ADU apart: the predictions lack a variance of {more:.1} ADU² of \
                 rounding, ({step}² − 1)/12; a `read_noise_e` of {:.3} in the sensor has it",
                (read_adu2 + more).sqrt() / adu_per_e
            )
        })
    }

    /// Has the program warn of steps that the sensor does not tell.
    pub fn end(&self, frame: &FrameHeader) {
        self.doubt().into_iter().for_each(|doubt| register::doubt(format!("{}: {doubt}", frame.name)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Codes of 12 bits times 16, 3.2 ADU for an electron and 10 ADU of read noise: (16² − 1)/12 = 21.25 ADU² more.
    #[test]
    fn codes_that_are_multiples_of_a_step_are_told_where_that_shows() {
        let doubt_of = |unlike: u8, step: f32, read_adu2: f64| {
            let sensor = Some(Told { read_adu2, adu_per_e: 3.2, top_code: 4095.0 });
            let mut check = StepCheck { steps: Steps::default(), unlike: Default::default(), largest: 0.0, sensor };
            check.take((0..900_u16).map(|code| step * f32::from(code * 7 % u16::from(unlike))));
            check.doubt()
        };
        let doubt = |step: f32, read_adu2: f64| doubt_of(41, step, read_adu2);
        // A few levels of a clean frame are multiples of something.
        assert_eq!(doubt_of(15, 1600.0, 100.0), None);
        let said = doubt(16.0, 100.0).unwrap();
        assert!(
            said.contains("multiples of 16") && said.contains("21.2 ADU²") && said.contains("of 3.441 in"),
            "{said}"
        );
        assert_eq!([doubt(1.0, 100.0), doubt(2.0, 100.0)], [None, None]);
        assert!(doubt(2.0, 10.0).is_some());
        // Above the last code of the sensor they are those of more bits.
        let said = doubt(128.0, 100.0).unwrap();
        assert!(said.contains("multiples of 128 up to 5120") && said.contains("end at 4095"), "{said}");
        // No sensor tells their scale.
        let mut check = StepCheck { steps: Steps::default(), unlike: Default::default(), largest: 0.0, sensor: None };
        check.take((0..900_u16).map(|code| 16.0 * f32::from(code)));
        assert!(check.doubt().unwrap().contains("stored 16 times as large"));
    }
}
