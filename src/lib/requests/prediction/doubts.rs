//! What is doubtful of predictions: converters that cut light off.

use crate::camera::readout::ReadOut;
use crate::cfa::Class;
use crate::chain::{ChainPrediction, ChainStage};
use crate::error::{Error, Result};
use crate::metadata::AdcRecord;
use crate::requests::notes::{Note, doubt_of_slope};
use crate::text::percent;

/// The share of the samples of a class from which what is told of noise and color is that of cut-off samples.
const TELLING: f64 = 0.01;

/// A warning of a converter whose slope looks like its inverse.
pub(super) fn of_converter(readout: &ReadOut) -> Option<Note> {
    doubt_of_slope(&AdcRecord::of_readout(readout), readout.full_well_e)
}

/// Refuses a patch that is not on the sensor.
///
/// # Errors
///
/// [`Error::Usage`] for it.
pub(super) fn check_place(readout: &ReadOut, patch: Option<[usize; 2]>, at: Option<[i64; 2]>) -> Result<()> {
    let Some(size) = patch else { return Ok(()) };
    let sides = [readout.width, readout.height];
    if (0..2).any(|axis| size[axis] as u64 > u64::from(sides[axis])) {
        let problem = format!(
            "a patch of {}x{} pixels is larger than the sensor, which has {}x{} photosites",
            size[0], size[1], sides[0], sides[1]
        );
        return Err(Error::Usage(problem).change(&["patch"]));
    }
    let Some(corner) = at else { return Ok(()) };
    let is_on =
        |axis: usize| (0..=i64::from(sides[axis]).saturating_sub_unsigned(size[axis] as u64)).contains(&corner[axis]);
    if is_on(0) && is_on(1) {
        return Ok(());
    }
    let [width, height] = sides;
    Err(Error::Usage(format!("the patch lies beyond the {width}x{height} photosites of the sensor"))
        .change(&["patch_at"]))
}

/// A warning of samples that the converter cuts off in a scene.
pub(super) fn of_cut(scene: &ChainPrediction) -> Option<Note> {
    // Light that fills most photosites is told before.
    let full = shares(scene, ChainStage::Electrons);
    let cut: Vec<String> = Class::ALL
        .into_iter()
        .zip(shares(scene, ChainStage::Adu).into_iter().zip(full))
        .filter(|(_, (share, full))| *share >= TELLING && *full < 0.5)
        .map(|(class, (share, _))| format!("{} % of {}", percent(share, 3), class.letter()))
        .collect();
    (!cut.is_empty()).then(|| of_text(&format!("{} are saturated", cut.join(", "))))
}

/// The same of the scenes of a library.
pub(super) fn of_cuts(scenes: &[&ChainPrediction]) -> Option<Note> {
    let is_cut = |scene: &ChainPrediction| shares(scene, ChainStage::Adu).iter().any(|share| *share >= TELLING);
    let count = scenes.iter().filter(|scene| is_cut(scene)).count();
    (count > 0).then(|| of_text(&format!("samples of {count} of {} spectra are saturated", scenes.len())))
}

fn of_text(what: &str) -> Note {
    let text = "noise and color are those of samples that are cut off; a shorter exposure keeps them below";
    Note::Warning(format!("{what}: {text}"))
}

/// The shares of samples of R, G and B that are saturated at a stage.
fn shares(scene: &ChainPrediction, of: ChainStage) -> [f64; 3] {
    scene.stages.iter().find(|stage| stage.stage == of).and_then(|stage| stage.saturated).unwrap_or_default()
}
