//! Exposures as tags and keywords of files tell them: a time and an f-number, or the time alone.

use crate::camera::optics::Exposure;
use crate::metadata::Metadata;

/// What a file tells of its exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToldExposure {
    /// Time and f-number, behind a lens that loses no light.
    Whole(Exposure),
    /// The time in s alone, by which dark frames are told apart.
    Time(f64),
}

impl ToldExposure {
    /// Puts what is told, if anything, into metadata.
    pub fn describe(told: Option<Self>, metadata: &mut Metadata) {
        match told {
            Some(Self::Whole(exposure)) => metadata.exposure = Some(exposure),
            Some(Self::Time(time_s)) => metadata.exposure_time_s = Some(time_s),
            None => {}
        }
    }
}

/// The exposure of a file that tells so much of it; notes tell what is passed over. What the file calls time and f-number is
/// `named`.
pub fn of_parts(
    exposure_s: Option<f64>,
    f_number: Option<f64>,
    named: [&str; 2],
    notes: &mut Vec<String>,
) -> Option<ToldExposure> {
    let [time_name, aperture_name] = named;
    let time_s = exposure_s.filter(|time_s| (0.0..f64::INFINITY).contains(time_s));
    match (exposure_s, f_number) {
        (Some(exposure_s), Some(f_number)) => {
            match (Exposure { exposure_s, f_number, lens_transmittance: 1.0 }).checked() {
                Ok(exposure) => return Some(ToldExposure::Whole(exposure)),
                Err(problem) => {
                    let rest =
                        time_s.map_or(String::new(), |time| format!("; its time of {time} s tells dark frames apart"));
                    notes.push(format!("its exposure is passed over: {problem}{rest}"));
                }
            }
        }
        (Some(time), None) if time_s.is_none() => {
            notes.push(format!("its exposure time of {time} s ({time_name}) is passed over: there is none"));
        }
        (Some(time), None) => notes.push(format!(
            "its exposure time of {time} s tells dark frames apart and no more: it has no f-number ({aperture_name})"
        )),
        (None, Some(aperture)) => {
            notes.push(format!("its f-number of {aperture} is passed over: it has no exposure time ({time_name})"));
        }
        (None, None) => {}
    }
    time_s.map(ToldExposure::Time)
}
