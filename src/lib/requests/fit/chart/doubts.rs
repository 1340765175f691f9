//! What may not be meant about a chart: by the scatter of its patches, by its neutral ones, and by what the matrix makes of them.

use super::super::super::notes::Note;
use crate::analysis::chart::fit::{ChartMatrix, Patch};
use crate::analysis::chart::neutrals::offsets;
use crate::analysis::chart::order::out_of_order;
use crate::analysis::chart::outliers::outliers;
use crate::analysis::chart::reading::{ReadPatch, cut_off};
use crate::cfa::Class;
use crate::error::Result;
use crate::spectrum::{Observer, not_in_order};
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

/// Warnings of patches that fit the colors of each other, and of others that lie far from what the rest makes of them.
pub(super) fn of_names(source: &str, patches: &[Patch], white: [f64; 3]) -> Vec<Note> {
    let Some(found) = outliers(patches, white) else { return Vec::new() };
    let off = |patch: usize| format!("{} {:.1}", patches[patch].name, found.delta_e[patch]);
    let usual = format!("Delta E*ab from where the matrix of the others has them, {:.1} in the median", found.median);
    let exchanged = found.exchanged.iter().map(|([one, other], then)| {
        format!(
            "{} and {} lie {usual}; exchanged they lie {:.1} and {:.1} off: are their names exchanged?",
            off(*one),
            off(*other),
            then[0],
            then[1]
        )
    });
    let far: Vec<String> = found.far.iter().map(|patch| off(*patch)).collect();
    let far = (!far.is_empty()).then(|| {
        format!("far off are {} {usual}: check the names, and the patches for glare, shade and dirt", far.join(", "))
    });
    exchanged.chain(far).map(|text| Note::Warning(format!("{source}: {text}"))).collect()
}

/// A warning of classes of a matrix that are not red, green and blue in this order.
///
/// # Errors
///
/// Those of [`out_of_order`].
pub(super) fn of_classes(
    source: &str,
    found: &ChartMatrix,
    observer: &Observer,
    is_frame: bool,
) -> Result<Option<Note>> {
    let check = if is_frame { "check the pattern of the filters, --cfa" } else { "check the columns R, G and B" };
    let told = out_of_order(found, observer)?
        .map(|mean_nm| format!("{source}: by the matrix {}; {check}", not_in_order(mean_nm)));
    Ok(told.map(Note::Warning))
}
