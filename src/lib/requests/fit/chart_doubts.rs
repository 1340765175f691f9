//! What may not be meant about a chart: by the scatter of its patches, and by its neutral ones.

use super::super::notes::Note;
use crate::analysis::chart::fit::Patch;
use crate::analysis::chart::neutrals::offsets;
use crate::analysis::chart::reading::{ReadPatch, cut_off};
use crate::cfa::Class;
use crate::text::in_digits;

/// Warnings of what was read of the patches of a chart in a frame: `name` names them, `range_adu` is white level less black level.
pub(super) fn of_patches(
    source: &str,
    read: &[ReadPatch],
    name: impl Fn(usize) -> String,
    range_adu: f64,
) -> Vec<Note> {
    let names = |of: &[usize]| of.iter().map(|index| name(*index)).collect::<Vec<_>>().join(", ");
    let uneven: Vec<usize> = (0..read.len()).filter(|index| read[*index].is_uneven()).collect();
    let edges = read.iter().filter(|patch| patch.has_edge()).count();
    let scatter = match uneven.len() {
        0 => None,
        // Texture and glare are where they are, and light does not fall off by as much within a patch.
        _ if 2 * edges >= read.len() => Some(format!(
            "{edges} of {} patches scatter as those do across which an edge runs: the corners are off; give the centers of the patches \
             themselves",
            read.len()
        )),
        _ => Some(format!(
            "more scatter than noise within {}: texture, glare, a gradient or an edge, or greens or amplifiers that differ; check the corners",
            names(&uneven)
        )),
    };
    let cut = cut_off(read, range_adu);
    let mut patches: Vec<usize> = cut.iter().map(|(patch, _)| *patch).collect();
    patches.dedup();
    let level = cut.iter().map(|(patch, class)| read[*patch].largest[*class][0]).fold(f32::NEG_INFINITY, f32::max);
    let of_cut = (!cut.is_empty()).then(|| {
        let letters = Class::ALL.into_iter().filter(|class| cut.iter().any(|(_, cut)| *cut == *class as usize));
        format!(
            "{} of {} scatter less than dimmer patches do and lie at {level} ADU or below: they are cut off below the white level, which is \
             too high, and count all the same",
            letters.map(Class::letter).collect::<Vec<_>>().join(", "),
            names(&patches)
        )
    });
    scatter.into_iter().chain(of_cut).map(|text| Note::Warning(format!("{source}: {text}"))).collect()
}

/// A warning of neutral patches whose signals are not proportional to their luminance. `range_adu` is white level less black level, where
/// signals are shares of what is known.
pub(super) fn of_neutrals(source: &str, patches: &[Patch], white: [f64; 3], range_adu: Option<f64>) -> Option<Note> {
    let found = offsets(patches, white).filter(|found| found.are_told())?;
    let (scale, unit) = range_adu.map_or((1.0, " of the range"), |range| (range, " ADU"));
    let of_class = |class: Class| {
        let [off, error] = [found.offset, found.error].map(|values| in_digits(scale * values[class as usize], 2));
        format!("{} {off} ± {error}", class.letter())
    };
    let offs: Vec<String> = Class::ALL.into_iter().map(of_class).collect();
    let cause = match found.offset[0] > 0.0 {
        true => {
            "the black level is too low by as much, or stray light adds it, in proportion to white, or the light falls off along the patches"
        }
        false => "the black level is too high by as much, or the light falls off along the patches",
    };
    Some(Note::Warning(format!(
        "{source}: its neutral patches are not in proportion to their luminance: where no light is they would read {}{unit}; {cause}",
        offs.join(", ")
    )))
}
