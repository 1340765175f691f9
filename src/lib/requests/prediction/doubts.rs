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

/// A warning of a patch whose place has a noise of its own: it is predicted as anywhere in the middle of the sensor, by its place in the period of
/// the filters, and by all amplifiers on average.
///
/// # Errors
///
/// [`Error::Usage`] for a patch that is not on the sensor.
pub(super) fn of_place(readout: &ReadOut, patch: Option<([usize; 2], [i64; 2])>, reach: usize) -> Result<Option<Note>> {
    let Some((size, [x, y])) = patch else { return Ok(None) };
    let sides = [(x, size[0], readout.width), (y, size[1], readout.height)];
    let room = |(begin, extent, side): (i64, usize, u32)| {
        begin.min(i64::from(side).saturating_sub(begin).saturating_sub_unsigned(extent as u64))
    };
    let room = sides.map(room).into_iter().min().unwrap_or(0);
    if room < 0 {
        let problem =
            format!("the patch lies beyond the {}x{} photosites of the sensor", readout.width, readout.height);
        return Err(Error::Usage(problem).change(&["patch_at"]));
    }
    let why = if readout.taps.is_some() {
        "which amplifiers read it is not asked, and its noise is that of all on average"
    } else if room < reach as i64 {
        "at the edge of the sensor samples are mirrored, but its noise is that in the middle, up to a tenth less"
    } else {
        return Ok(None);
    };
    let text = format!(
        "of the place of the patch that in the period of the filters alone counts: {why}; `measure --region` of a frame predicts it there"
    );
    Ok(Some(Note::Warning(text)))
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
