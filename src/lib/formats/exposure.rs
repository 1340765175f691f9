//! Exposures as tags and keywords of files tell them: a time and an f-number, which count together.

use crate::camera::optics::Exposure;

/// The exposure of a file that tells so much of it, where both are known, behind a lens that loses no light; notes tell what is
/// passed over. What the file calls time and f-number is `named`.
pub fn of_parts(
    exposure_s: Option<f64>,
    f_number: Option<f64>,
    named: [&str; 2],
    notes: &mut Vec<String>,
) -> Option<Exposure> {
    let [time_name, aperture_name] = named;
    match (exposure_s, f_number) {
        (Some(exposure_s), Some(f_number)) => {
            let found = Exposure { exposure_s, f_number, lens_transmittance: 1.0 }.checked();
            return found.map_err(|problem| notes.push(format!("its exposure is passed over: {problem}"))).ok();
        }
        (Some(time), None) => {
            notes.push(format!("its exposure time of {time} s is passed over: it has no f-number ({aperture_name})"));
        }
        (None, Some(aperture)) => {
            notes.push(format!("its f-number of {aperture} is passed over: it has no exposure time ({time_name})"));
        }
        (None, None) => {}
    }
    None
}
