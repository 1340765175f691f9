//! What frames of a measurement must have in common, and what may be wrong with them.

use super::conditions::{Group, Head};
use crate::analysis::photon_transfer::{LEAST_VARIANCE, Print, SiteSurvey, Survey};
use crate::cfa::Places;
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, Metadata};
use crate::requests::independence::{are_copies, shared_noise};
use crate::requests::notes::Note;
use std::collections::HashMap;
use std::path::Path;

/// Makes sure that two frames are of one camera as far as they say.
///
/// # Errors
///
/// Where they differ.
pub fn check_alike(first: &FrameHeader, other: &FrameHeader) -> Result<()> {
    let Geometry { width, height, channels, .. } = &first.geometry;
    let differs = |what: &str| Err(other.refuse(format!("its {what} is not that of {}", first.name)));
    if (&other.geometry.width, &other.geometry.height) != (width, height) {
        let [w, h] = [other.geometry.width, other.geometry.height];
        return Err(other.refuse(format!("it is {w}x{h}, and {} is {width}x{height}", first.name)));
    }
    if other.geometry.channels.len() != channels.len() {
        return Err(other.refuse(format!("it holds {}, and {} {}", other.holds(), first.name, first.holds())));
    }
    if other.metadata.cfa != first.metadata.cfa {
        return differs("filter array");
    }
    if other.geometry.origin != first.geometry.origin {
        return differs("place on the sensor");
    }
    if other.metadata.quantity != first.metadata.quantity {
        return Err(other.refuse(format!("it holds {}, and {} {}", other.holds(), first.name, first.holds())));
    }
    if other.metadata.white_level_adu != first.metadata.white_level_adu {
        return differs("white level");
    }
    let are_others =
        |of: fn(&Metadata) -> Option<f64>| of(&first.metadata).zip(of(&other.metadata)).is_some_and(|(a, b)| a != b);
    if are_others(|metadata| metadata.iso_speed) {
        return differs("sensitivity (ISO)");
    }
    let settings = first.metadata.camera_settings.as_ref().zip(other.metadata.camera_settings.as_ref());
    if let Some((what, ..)) = settings.and_then(|(a, b)| a.other_than(b)) {
        return differs(what);
    }
    if are_others(Metadata::adu_per_e) {
        return differs("setting of the gain");
    }
    if are_others(Metadata::bias_adu) {
        return differs("bias");
    }
    let body = |frame: &FrameHeader| {
        let metadata = &frame.metadata;
        let name = metadata.sensor.as_ref().map(|sensor| sensor.name.clone()).or_else(|| metadata.camera.clone());
        (name, metadata.noise.as_ref().map(|noise| noise.sensor_seed))
    };
    let [(own, seed), (theirs, other_seed)] = [first, other].map(body);
    if own.is_some() && theirs.is_some() && own != theirs {
        return differs("camera");
    }
    if seed.is_some() && other_seed.is_some() && seed != other_seed {
        return Err(other.refuse(format!("its sensor seed is not that of {}: it is another camera's", first.name)));
    }
    Ok(())
}

/// Makes sure that no exposure comes twice; gives a warning where noise of one is that of another, taken under other conditions.
///
/// # Errors
///
/// For copies of an exposure.
pub fn check_apart(heads: &[Head]) -> Result<Option<String>> {
    let mut warning = None;
    let (mut by_digest, mut by_number) = (HashMap::new(), HashMap::new());
    for Head { header: head, .. } in heads {
        let metadata = &head.metadata;
        let digest = metadata.samples.as_ref().map(|samples| samples.digest.as_str());
        let same = digest.and_then(|digest| by_digest.insert(digest, head)).filter(|other| are_copies(head, other));
        if let Some(other) = same {
            let problem = format!("its samples are those of {}", other.name);
            return Err(head.refuse(problem + "; copies of one exposure do not count as two"));
        }
        let Some(noise) = &metadata.noise else { continue };
        let before: Option<&FrameHeader> = by_number.insert((noise.seed, noise.sensor_seed, noise.frame), head);
        let Some(other) = before.filter(|other| shared_noise(head, other).is_some()) else { continue };
        let (seed, frame) = (noise.seed, noise.frame);
        if metadata.scene == other.metadata.scene && metadata.exposure == other.metadata.exposure {
            return Err(head.refuse(format!("its noise is that of {}, of seed {seed} and frame {frame}", other.name)));
        }
        warning.get_or_insert_with(|| {
            format!(
                "{}: its noise is drawn from the numbers of {}, of seed {seed} and frame {frame}: levels are not independent, and \
                 intervals too narrow; draw each level with another `add-noise --seed`",
                head.name, other.name
            )
        });
    }
    Ok(warning)
}

/// Refuses a plane of unknown array whose sites differ as those behind filters do.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_array(head: &FrameHeader, groups: &[Group], surveys: &[Survey]) -> Result<()> {
    /// Sites of one kind differ by less: amplifiers do by one or two in a hundred.
    const LEAST: f64 = 0.1;
    if head.metadata.cfa.is_some() || head.geometry.channels.len() > 1 || head.geometry.height < 2 {
        return Ok(());
    }
    let of_kind = |is_lit: bool| {
        let own = groups.iter().zip(surveys).filter(move |(group, _)| group.condition.is_lit == is_lit);
        own.map(|(_, survey)| survey)
    };
    // The brightest that is not full, above what is there without light.
    let is_whole = |survey: &&Survey| survey.sites.iter().all(|site| site.at_ends[0] == 0);
    let brightest = of_kind(true).filter(is_whole).max_by(|a, b| a.sites[0].mean.total_cmp(&b.sites[0].mean));
    let dark = of_kind(false).next().map_or([0.0; 4], |survey| survey.quad);
    let Some(bright) = brightest else { return Ok(()) };
    let signal: Vec<f64> = bright.quad.iter().zip(dark).map(|(bright, dark)| bright - dark).collect();
    let mean = signal.iter().sum::<f64>() / 4.0;
    let spread =
        signal.iter().copied().fold(f64::NEG_INFINITY, f64::max) - signal.iter().copied().fold(f64::INFINITY, f64::min);
    if mean > 0.0 && spread > LEAST * mean {
        let shares: Vec<String> = signal.iter().map(|signal| format!("{:.2}", signal / mean)).collect();
        let problem = format!(
            "{}: nothing says its filter array, and its photosites see unlike: those of each 2x2 have {} of their mean; for frames \
             without filters it is monochrome",
            head.name,
            shares.join(", ")
        );
        return Err(Error::Usage(problem).give(&["cfa"]));
    }
    Ok(())
}

/// A warning of an array, Bayer or none, that is not what the photosites of flats are behind.
pub fn doubt_of_array(head: &FrameHeader, groups: &[Group], surveys: &[Survey]) -> Option<Note> {
    /// Flats near such a share of the brightest are well above black, and below saturation.
    const SHARE: f64 = 0.5;
    /// More samples than this share at the largest code, and means do not follow the light.
    const FEW: f64 = 1e-3;
    let array = head.metadata.cfa.filter(|_| head.geometry.channels.len() == 1 && head.geometry.height >= 2)?;
    let mean = |survey: &Survey| survey.quad.iter().sum::<f64>() / 4.0;
    let of_kind = |is_lit: bool| {
        let own = groups.iter().zip(surveys).filter(move |(group, _)| group.condition.is_lit == is_lit);
        own.map(|(_, survey)| survey)
    };
    let at_top = |site: &SiteSurvey| site.at_ends[0] as f64 / (site.count() * site.frames) as f64;
    let is_whole = |survey: &&Survey| survey.sites.iter().all(|site| at_top(site) <= FEW);
    let dark = of_kind(false).min_by(|a, b| mean(a).total_cmp(&mean(b)));
    let black = dark.map_or([0.0; 4], |dark| dark.quad);
    let middle = SHARE * of_kind(true).map(mean).fold(0.0, f64::max) + (1.0 - SHARE) * dark.map_or(0.0, mean);
    let off = |survey: &Survey| (mean(survey) - middle).abs();
    let flat = of_kind(true).filter(is_whole).min_by(|a, b| off(a).total_cmp(&off(b)))?;
    let scatter = |survey: &Survey| {
        let all: usize = survey.sites.iter().map(SiteSurvey::count).sum();
        let of = |site: &SiteSurvey| site.variance + site.spatial.rest.value;
        4.0 * survey.sites.iter().map(of).fold(0.0, f64::max) / all as f64
    };
    let variance = scatter(flat) + dark.map_or(0.0, scatter);
    // The sensor's corner need not be the frame's.
    let [x0, y0] = head.geometry.origin.map(|origin| usize::from(origin & 1 != 0));
    let mut places = Places { signal: [0.0; 4], variance: [variance; 4] };
    for (place, (flat, black)) in flat.quad.iter().zip(black).enumerate() {
        places.signal[(place / 2 + y0) % 2 * 2 + (place + x0) % 2] = flat - black;
    }
    places.doubt(Some(array)).map(|doubt| Note::Warning(format!("{}: {doubt}", head.name)))
}

/// The temporal variance of darks in codes² of which photosites that are full spread over several codes.
const LEAST_OF_END: f64 = 1.0;

/// What codes look like that is not said of them: shifted, or ending at `largest`, below the code that is said to be that.
pub fn doubt_of_codes(list: &str, head: &FrameHeader, surveys: &[Survey], largest: Option<f64>) -> Vec<Note> {
    let shift = surveys.iter().fold(0, |bits, survey| bits | survey.bits).trailing_zeros();
    let shifted = (shift > 0 && shift < u32::BITS).then(|| {
        format!(
            "{list}: all codes are multiples of {}, as those that were shifted left by {shift} bits; numbers in ADU are of such codes, and \
             the error of rounding is taken as too small: shift them back",
            1_u32 << shift
        )
    });
    let top = head.metadata.white_level_adu.map(|white| white.largest());
    let ended = largest.zip(top).filter(|(end, top)| end < top).map(|(end, top)| {
        format!("{list}: the brightest flats are of the code {end} alone; that is the largest then, and not {top}, which is said to be")
    });
    shifted.into_iter().chain(ended).map(Note::Warning).collect()
}

/// The code that the brightest flats are alone, without any scatter, below the code that is said to be the largest: codes end there, as noise
/// of the read-out would spread those of photosites that are full; or as codes of 1 to 15 bits do.
pub fn end_below(said: f64, groups: &[Group], surveys: &[Survey]) -> Option<f64> {
    /// What a mean may be off a code, and the most variance of samples that are one code but for few.
    const NEXT_TO_NONE: f64 = 0.01;
    let lit = groups.iter().zip(surveys).filter(|(group, _)| group.condition.is_lit);
    let sites = lit.flat_map(|(_, survey)| &survey.sites);
    let brightest = sites.max_by(|a, b| a.mean.total_cmp(&b.mean))?;
    let end = brightest.mean.round();
    let scatter = brightest.variance.max(brightest.spatial.rest.value);
    let is_one_code = (0.0..NEXT_TO_NONE).contains(&(end - brightest.mean)) && scatter < NEXT_TO_NONE;
    let is_full_scale = (1..16).any(|bits| f64::from(bits).exp2() - 1.0 == end);
    let is_end = is_full_scale || noise_of_darks(groups, surveys) >= LEAST_OF_END;
    (is_one_code && is_end && end > 0.0 && end < said).then_some(end)
}

/// The temporal variance of darks at no time, by the shortest and the longest, in codes²: of the sites that have most.
fn noise_of_darks(groups: &[Group], surveys: &[Survey]) -> f64 {
    let noise = |survey: &Survey| survey.sites.iter().map(|site| site.variance).fold(0.0, f64::max);
    let darks = groups.iter().zip(surveys).filter(|(group, _)| !group.condition.is_lit);
    let mut of_times: Vec<[f64; 2]> =
        darks.map(|(group, survey)| [group.condition.exposure_s.unwrap_or(0.0), noise(survey)]).collect();
    of_times.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let least = of_times.iter().map(|[_, variance]| *variance).reduce(f64::min).unwrap_or(0.0);
    match of_times[..] {
        [[short_s, short], .., [long_s, long]] if long_s > short_s => {
            least.min(short - short_s * (long - short) / (long_s - short_s))
        }
        _ => least,
    }
}

/// The largest code by the brightest flats, of which most samples are one code that none is above, where noise of the read-out would spread
/// those of photosites that are full: that of the darks which have least, as dark charge has none where photosites are full, or of
/// codes that end as those of 8 to 16 bits do. Samples at it are counted then.
pub fn end_of_codes(groups: &[Group], surveys: &mut [Survey]) -> Option<f64> {
    /// Most samples.
    const MOST: f64 = 0.5;
    let is_lit = |place: &usize| groups[*place].condition.is_lit;
    let dark_noise = noise_of_darks(groups, surveys);
    let lit = || (0..groups.len()).filter(is_lit).flat_map(|place| &surveys[place].sites);
    let largest = lit().filter_map(|site| site.largest).map(|(largest, _)| largest).fold(f64::NEG_INFINITY, f64::max);
    let is_most = |site: &SiteSurvey| {
        let (own, count) = site.largest.unwrap_or_default();
        own == largest && count as f64 > MOST * (site.count() * site.frames) as f64
    };
    let is_full_scale = (8..=16).any(|bits| f64::from(bits).exp2() - 1.0 == largest);
    if (dark_noise < LEAST_VARIANCE && !is_full_scale) || !lit().any(is_most) {
        return None;
    }
    for site in surveys.iter_mut().flat_map(|survey| &mut survey.sites) {
        site.at_ends[0] = site.largest.filter(|(own, _)| *own >= largest).map_or(0, |(_, count)| count);
    }
    Some(largest)
}

/// What is said where the largest code is not known, or taken from the brightest flats.
pub fn doubt_of_end(list: &str, taken: Option<f64>) -> Note {
    Note::Warning(match taken {
        Some(largest) => format!(
            "{list}: the largest code is not known; it is taken to be {largest}, which most samples of the brightest flats are, without \
             the noise of darks; give --white if it is another"
        ),
        None => format!(
            "{list}: the largest code is not known, so that clipped levels are told by their variance alone, and full photosites are not \
             told from a converter that ends; give --white"
        ),
    })
}

/// Warnings of frames of one condition whose means are plainly not those of one: a flat that is little above black is not far off a dark
/// by [`check_same_light`].
pub fn doubt_of_frames(groups: &[Group], surveys: &[Survey]) -> Vec<Note> {
    /// Of darks no black level moves by so many standard deviations of a sample.
    const MUCH: f64 = 5.0;
    /// By such a share of the light flats of one light do not differ.
    const SHARE: f64 = 0.5;
    /// Standard deviations of a mean that are far beyond chance.
    const BEYOND: f64 = 10.0;
    /// Means of so many darks tell by how much those of most differ, and so many times that is more than chance.
    const SEVERAL: usize = 3;
    const MOST: f64 = 6.0;
    let dark = |site: usize| {
        let darks = groups.iter().zip(surveys).filter(|(group, _)| !group.condition.is_lit);
        darks.map(|(_, survey)| survey.sites[site].mean).fold(f64::INFINITY, f64::min)
    };
    // A black level that moves does so at most exposure times.
    let range = |survey: &Survey| {
        let of = |site: &SiteSurvey| {
            let [low, high] = ends_of(&site.frame_means);
            site.frame_means[high] - site.frame_means[low]
        };
        survey.sites.iter().map(of).fold(0.0, f64::max)
    };
    let darks = groups.iter().zip(surveys).filter(|(group, _)| !group.condition.is_lit);
    let mut ranges: Vec<f64> = darks.map(|(_, survey)| range(survey)).collect();
    ranges.sort_by(f64::total_cmp);
    let of_most = if ranges.len() >= SEVERAL { MOST * ranges[(ranges.len() - 1) / 2] } else { 0.0 };
    let doubt = |(group, survey): (&Group, &Survey)| {
        survey.sites.iter().enumerate().find_map(|(index, site)| {
            let [low, high] = ends_of(&site.frame_means);
            let [least, most] = [low, high].map(|frame| site.frame_means[frame]);
            let light = Some(dark(index)).filter(|dark| dark.is_finite()).map_or(most, |dark| most - dark);
            let noise = (site.mean_variance * site.frames as f64).sqrt();
            let of_dark = || of_most.max(MUCH * site.variance.sqrt());
            let allowed = if group.condition.is_lit { SHARE * light } else { of_dark() };
            let is_far = most - least > allowed.max(BEYOND * noise).max(1.0);
            let [first, second] = [low, high].map(|frame| group.files[frame].display().to_string());
            let what = if group.condition.is_lit { "flats of one light" } else { "darks of one exposure" };
            is_far.then(|| {
                Note::Warning(format!(
                    "{first} and {second} are taken to be {what}, and their means are {least:.1} and {most:.1}: is the first a dark, the \
                     second a flat, or are they of other times?"
                ))
            })
        })
    };
    groups.iter().zip(surveys).filter_map(doubt).collect()
}

/// Whether photosites of a survey are full or at an end of the codes, so that patterns and noise follow the light no more: more samples than
/// few are there, or flats that are dimmer are as noisy.
fn is_at_end(survey: &Survey, mut dimmer: impl Iterator<Item = [f64; 2]>) -> bool {
    /// The share of samples that are few: stuck photosites.
    const FEW: f64 = 1e-3;
    /// Flats below such a share of a mean are dimmer.
    const DIMMER: f64 = 0.97;
    let is_cut_off = |site: &SiteSurvey| {
        let samples = (site.count() * site.frames) as f64;
        let at_end = site.at_ends[0].max(site.at_ends[1]) as f64;
        at_end > FEW * samples || site.full as f64 > FEW * site.count() as f64
    };
    let [mean, variance] = level_of(survey);
    let is_quieter = |[other, noise]: [f64; 2]| other < DIMMER * mean && noise >= variance;
    survey.sites.iter().any(is_cut_off) || dimmer.any(is_quieter)
}

/// Mean and temporal variance of a survey, over its grids.
fn level_of(survey: &Survey) -> [f64; 2] {
    let count = survey.sites.len() as f64;
    [|site: &SiteSurvey| site.mean, |site: &SiteSurvey| site.variance]
        .map(|of| survey.sites.iter().map(of).sum::<f64>() / count)
}

/// Warnings of frames whose fixed pattern is not that of the others of their condition, by most of the grids; of most of them it would be
/// the others that differ, or light that changes where photosites are nearly full.
pub fn doubt_of_patterns(groups: &[Group], surveys: &[Survey]) -> Vec<Note> {
    let lit = || groups.iter().zip(surveys).filter(|(group, _)| group.condition.is_lit).map(|(_, survey)| survey);
    let doubt = |(group, survey): (&Group, &Survey)| {
        let are_told = |frame: &usize| {
            2 * survey.sites.iter().filter(|site| site.strangers.contains(frame)).count() > survey.sites.len()
        };
        let strangers: Vec<usize> = (0..group.files.len()).filter(are_told).collect();
        if 2 * strangers.len() >= group.files.len() || group.condition.is_lit && is_at_end(survey, lit().map(level_of))
        {
            return None;
        }
        let first = group.files[*strangers.first()?].display();
        let more = if strangers.len() > 1 { format!(" and {} more", strangers.len() - 1) } else { String::new() };
        let others = if group.condition.is_lit { "flats of its light" } else { "darks of its time" };
        Some(Note::Warning(format!(
            "{first}{more}: its fixed pattern is not that of the other {others}: is it turned, mirrored or moved, or of another camera or temperature? \
             Temporal noise and patterns are wrong with it"
        )))
    };
    groups.iter().zip(surveys).filter_map(doubt).collect()
}

/// Places of the least and of the largest.
fn ends_of(means: &[f64]) -> [usize; 2] {
    let mut order: Vec<usize> = (0..means.len()).collect();
    order.sort_by(|a, b| means[*a].total_cmp(&means[*b]));
    [order[0], order[order.len() - 1]]
}

/// Frames of one light whose means differ by more than this share were taken under several.
const SAME_LIGHT: f64 = 0.1;

/// Makes sure that no frame of one condition is a copy of one of another.
///
/// # Errors
///
/// [`Error::Data`].
pub fn check_no_copies(groups: &[Group], surveys: &[Survey]) -> Result<()> {
    let mut known: HashMap<Print, &Path> = HashMap::new();
    for (group, survey) in groups.iter().zip(surveys) {
        for (file, print) in group.files.iter().zip(&survey.prints) {
            if let Some(other) = known.insert(*print, file) {
                let [one, other] = [other.display(), file.display()];
                let problem = format!("{one} and {other}: their samples are the same, or differ by one number alone");
                let problem = problem + ", and they are said to be of different light or time";
                return Err(Error::Data(problem + "; copies of one exposure do not count as two"));
            }
        }
    }
    Ok(())
}

/// Makes sure that means of frames at the photosites of a grid are those of one light, of codes that reach so far.
///
/// # Errors
///
/// [`Error::Data`].
pub fn check_same_light(group: &Group, site: &SiteSurvey, reach: f64) -> Result<()> {
    /// The black level moves by so many standard deviations of a sample, and light may not.
    const MUCH: f64 = 5.0;
    let means = &site.frame_means;
    let [least, most] =
        [means.iter().copied().fold(f64::INFINITY, f64::min), means.iter().copied().fold(0.0, f64::max)];
    // Of codes near the black level a tenth is little light.
    let by_share = SAME_LIGHT * most.max(reach / 10.0);
    let by_noise = if group.condition.is_lit { 0.0 } else { MUCH * site.variance.sqrt() };
    if most - least > by_share.max(by_noise) {
        let at = |wanted: f64| {
            means.iter().position(|mean| *mean == wanted).map_or(Path::new("?"), |index| &group.files[index])
        };
        let (first, second) = (at(least).display(), at(most).display());
        return Err(Error::Data(if group.condition.is_lit {
            format!(
                "{first} and {second} are taken to be of one light and exposure, and their means are {least:.4} and {most:.4}; one is \
                 a dark, or a list tells exposures apart, by `exposure_s`, and levels of light by `photons` or `level`"
            )
        } else {
            format!(
                "{first} and {second} are taken to be darks of one exposure, and their means are {least:.4} and {most:.4}; one saw \
                 light, or their times differ, which `exposure_s` of a list tells"
            )
        }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::photon_transfer::{Condition, survey};
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;
    use std::path::PathBuf;

    /// A dim flat among darks of its exposure time, and a dark among dim flats, are named; a black level that moves a little is not.
    #[test]
    fn frames_that_are_not_of_one_condition_are_named() {
        let frame = |level: f32, seed: usize| {
            let geometry = Geometry::new(16, 16, &["Y"]);
            let header = FrameHeader { name: "a".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
            let noise = |place: usize| ((place * 7919 + seed * 104_729 + place * seed * 31) % 9) as f32;
            MemoryFrame::new(header, (0..256).map(|place| level + noise(place)).collect())
        };
        let group = |is_lit: bool| Group {
            condition: Condition { is_lit, ..Condition::default() },
            level: String::new(),
            files: ["a", "b", "c"].map(PathBuf::from).to_vec(),
        };
        let groups = [group(false), group(true)];
        let of = |darks: [f32; 3], flats: [f32; 3]| {
            let surveys = [darks, flats].map(|levels| {
                let mut frames = [frame(levels[0], 1), frame(levels[1], 2), frame(levels[2], 3)];
                survey(&mut frames, Some(4095.0), false).unwrap()
            });
            doubt_of_frames(&groups, &surveys).iter().map(|note| note.text().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(of([100.0, 100.0, 102.0], [160.0, 164.0, 158.0]), Vec::<String>::new());
        let told = of([100.0, 150.0, 100.0], [200.0, 200.0, 200.0]);
        assert!(told.len() == 1 && told[0].contains(" and b are taken to be darks of one exposure"), "{told:?}");
        let told = of([100.0, 100.0, 100.0], [200.0, 200.0, 100.0]);
        assert!(told.len() == 1 && told[0].starts_with("c and ") && told[0].contains("flats of one light"), "{told:?}");
    }

    /// A camera of RGGB of which a frame begins at an odd column is told from GRBG and from one without filters, and the patterns that fit are
    /// named, though one photosite is at the largest code in all frames; what is said rightly is not doubted, nor a flat of little light.
    #[test]
    fn an_array_that_does_not_fit_is_named() {
        const SIDE: usize = 128;
        let groups = [group(false), group(true), group(true)];
        let doubt = |array: &str, scale: f32| {
            let of = |light: f32| {
                let frame = |frame: usize| {
                    let mut geometry = Geometry::new(SIDE, SIDE, &["Y"]);
                    geometry.origin = [3, 0];
                    let mut metadata = Metadata::new(QuantityKind::Adu);
                    metadata.cfa = Some(array.parse().unwrap());
                    let sample = |place: usize| {
                        let [x, y] = [place % SIDE + 3, place / SIDE];
                        let response = [0.5, 1.0, 1.01, 0.6][y % 2 * 2 + x % 2];
                        let noise = ((place * 7919 + frame * 104_729 + place * frame * 31) % 9) as f32;
                        if place == 40 { 4095.0 } else { 64.0 + light * response + noise }
                    };
                    let header = FrameHeader { name: "a".into(), geometry, metadata };
                    MemoryFrame::new(header, (0..SIDE * SIDE).map(sample).collect())
                };
                survey(&mut [frame(1), frame(2)], Some(4095.0), false).unwrap()
            };
            let surveys = [of(0.0), of(500.0 * scale), of(1000.0 * scale)];
            let mut geometry = Geometry::new(SIDE, SIDE, &["Y"]);
            geometry.origin = [3, 0];
            let mut metadata = Metadata::new(QuantityKind::Adu);
            metadata.cfa = Some(array.parse().unwrap());
            let head = FrameHeader { name: "a".into(), geometry, metadata };
            doubt_of_array(&head, &groups, &surveys).map(|note| note.text().to_owned())
        };
        for array in ["rggb", "bggr"] {
            assert_eq!(doubt(array, 1.0), None);
        }
        for array in ["grbg", "gbrg"] {
            let told = doubt(array, 1.0).unwrap();
            assert!(
                told.contains(&format!("greens of {array} differ by 16.")) && told.ends_with("rggb or bggr?"),
                "{told}"
            );
        }
        assert!(doubt("monochrome", 1.0).unwrap().ends_with("is the array rggb or bggr?"));
        assert_eq!(doubt("monochrome", 1e-3), None);
        assert_eq!(doubt("grbg", 1e-3), None);
    }

    /// One of four flats is named; two of four are not, nor one that is clipped, or as quiet as a dimmer flat, whose pattern changes with
    /// little light.
    #[test]
    fn patterns_of_full_photosites_and_of_most_frames_are_not_doubted() {
        let told = |strangers: &[usize], at_top: u64, scales: [f32; 2]| {
            let mut surveys =
                [(100.0, scales[0]), (1000.0, scales[1])].map(|(level, scale)| ended(level, scale, 4095.0, None));
            surveys[1].sites[0].strangers = strangers.to_vec();
            surveys[1].sites[0].at_ends[0] = at_top;
            let files = ["a", "b", "c", "d"].map(PathBuf::from).to_vec();
            let groups = [0, 1].map(|_| Group { files: files.clone(), ..group(true) });
            doubt_of_patterns(&groups, &surveys).iter().map(|note| note.text().to_owned()).collect::<Vec<_>>()
        };
        let one = told(&[1], 0, [1.0, 3.0]);
        assert!(one.len() == 1 && one[0].starts_with("b: its fixed pattern is not that of the other flats"), "{one:?}");
        assert!(told(&[0, 1], 0, [1.0, 3.0]).is_empty());
        assert!(told(&[1], 40, [1.0, 3.0]).is_empty());
        assert!(told(&[1], 0, [3.0, 1.0]).is_empty());
    }

    /// A survey of two frames of a level with noise of this scale, the codes of which end at `end`; `white` is what is said to be their end.
    fn ended(level: f32, scale: f32, end: f32, white: Option<f64>) -> Survey {
        const SIDE: usize = 16;
        let noise = |place: usize, frame: usize| ((place * 7919 + frame * 104_729 + place * frame * 31) % 9) as f32;
        let frame = |frame: usize| {
            let geometry = Geometry::new(SIDE, SIDE, &["Y"]);
            let header = FrameHeader { name: "a".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
            let sample = |place: usize| (level + scale * noise(place, frame)).min(end);
            MemoryFrame::new(header, (0..SIDE * SIDE).map(sample).collect())
        };
        survey(&mut [frame(1), frame(2)], white, false).unwrap()
    }

    fn group(is_lit: bool) -> Group {
        Group { condition: Condition { is_lit, ..Condition::default() }, level: String::new(), files: Vec::new() }
    }

    /// Flats of one code alone below that which is said to be the largest are the end of codes, where darks are noisy or codes of 8 bits end
    /// there; not where they scatter, nor where that is the largest.
    #[test]
    fn codes_that_end_below_what_is_said_end_there() {
        let of = |level: f32, scale: f32, end: f32| ended(level, scale, end, Some(4095.0));
        let groups = [false, true, true].map(group);
        let end = |dark_scale: f32, end: f32, said: f64| {
            let surveys = [of(10.0, dark_scale, end), of(100.0, 1.0, end), of(5000.0, 1.0, end)];
            end_below(said, &groups, &surveys)
        };
        assert_eq!(end(1.0, 3900.0, 4095.0), Some(3900.0));
        assert_eq!(end(1.0, 3900.0, 3900.0), None);
        assert_eq!(end(0.0, 3900.0, 4095.0), None);
        assert_eq!(end(0.0, 255.0, 4095.0), Some(255.0));
        let noisy = [of(10.0, 1.0, 4095.0), of(100.0, 1.0, 4095.0), of(3900.0, 1.0, 4095.0)];
        assert_eq!(end_below(4095.0, &groups, &noisy), None);
    }

    /// Flats that pile up at one code, while darks are noisy, end the codes there, and samples at it count as clipped; flats of full
    /// photosites, which are as noisy as darks, do not, nor do those beside darks without noise.
    #[test]
    fn the_largest_code_is_taken_from_flats_of_one_code() {
        let of = |level: f32, scale: f32, end: f32| ended(level, scale, end, None);
        let groups = [false, true, true].map(group);
        let end_of = |surveys: &mut [Survey]| end_of_codes(&groups, surveys);
        let mut ended = [of(10.0, 1.0, 255.0), of(100.0, 1.0, 255.0), of(254.0, 1.0, 255.0)];
        assert_eq!(end_of(&mut ended), Some(255.0));
        let at_end: Vec<u64> = ended.iter().map(|survey| survey.sites[0].at_ends[0]).collect();
        assert!(at_end[..2] == [0, 0] && at_end[2] > 400, "{at_end:?}");
        assert_eq!(end_of(&mut [of(10.0, 1.0, 255.0), of(100.0, 1.0, 255.0), of(200.0, 1.0, 255.0)]), None);
        // Darks without noise do not spread what is full, unless codes end there whatever noise does.
        assert_eq!(end_of(&mut [of(10.0, 0.0, 250.0), of(100.0, 1.0, 250.0), of(254.0, 1.0, 250.0)]), None);
        assert_eq!(end_of(&mut [of(10.0, 0.0, 255.0), of(100.0, 1.0, 255.0), of(254.0, 1.0, 255.0)]), Some(255.0));
        // Nor does noise that only longer darks have, that of their charge.
        let groups = [group(false), group(false), group(true), group(true)];
        let mut of_charge = [of(10.0, 0.0, 250.0), of(20.0, 1.0, 250.0), of(100.0, 1.0, 250.0), of(254.0, 1.0, 250.0)];
        assert_eq!(end_of_codes(&groups, &mut of_charge), None);
    }
}
