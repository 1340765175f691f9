//! Codes that lie several ADU apart, as those of fewer bits do that are stored times 2ⁿ, beside a sensor whose codes lie one apart.

use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::numerics::steps::Steps;
use crate::units::QuantityKind;

/// Fewer codes that are unlike may be multiples of a step by chance: of 2 with a chance of 2⁻¹⁶ or more.
const TELLING: usize = 16;

/// The step of the codes of a frame so far, and what noise its sensor tells, ADU², beside that of a step of 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepCheck {
    steps: Steps,
    /// The first codes that are unlike, and how many they are.
    unlike: ([f32; TELLING], usize),
    read_adu2: f64,
    adu_per_e: f64,
}

impl StepCheck {
    /// For codes of a camera whose sensor is named.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let metadata = &frame.metadata;
        let readout = metadata.sensor.as_ref()?.readout.as_ref()?;
        let are_codes = metadata.quantity == QuantityKind::Adu
            && metadata.noise.is_none()
            // What digitize wrote has the step of its sensor.
            && metadata.adc.is_none()
            && metadata.correction.is_none()
            && metadata.demosaic.is_none()
            && metadata.average.is_none();
        let adu_per_e = metadata.adu_per_e().unwrap_or(readout.adu_per_e);
        let read_adu2 = (adu_per_e * readout.read_noise_e).powi(2);
        are_codes.then(|| Self { steps: Steps::default(), unlike: Default::default(), read_adu2, adu_per_e })
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
        self.steps.take(samples.map(f64::from));
    }

    /// What its steps have of noise that the sensor does not tell, once all rows were looked at; none of what is 1 % of its read noise.
    fn doubt(&self) -> Option<String> {
        const LEAST: f64 = 0.01;
        let step = self.steps.step().filter(|step| *step > 1 && self.unlike.1 == TELLING)?;
        let more = ((step as f64).powi(2) - 1.0) / 12.0;
        (more > LEAST * (self.read_adu2 + 1.0 / 12.0)).then(|| {
            format!(
                "its codes are multiples of {step}, and those of its sensor lie 1 ADU apart: the predictions lack a variance of {more:.1} ADU² of \
                 rounding, ({step}² − 1)/12; a `read_noise_e` of {:.3} in the sensor has it",
                (self.read_adu2 + more).sqrt() / self.adu_per_e
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
            let mut check =
                StepCheck { steps: Steps::default(), unlike: Default::default(), read_adu2, adu_per_e: 3.2 };
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
    }
}
