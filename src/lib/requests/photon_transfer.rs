//! A camera measured from flats and darks.

use super::described::Described;
use super::independence::{are_copies, shared_noise};
use super::notes::Note;
use super::values;
use crate::analysis::photon_transfer::{
    ClassFindings, Condition, Level, PatternView, Settings, Site, SiteSurvey, Survey, left_in_mean, of_class,
    pattern_view, survey,
};
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::formats::format::SampleType;
use crate::formats::frame_list::{self, FrameKind, FrameList, ListedFrame};
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::many::OneOfMany;
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, Metadata};
use crate::stream::RowSource;
use crate::text::counted;
use crate::units::QuantityKind;
use clap::Args;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Flats and darks, and what is asked of them.
#[derive(Debug, Clone, Args)]
pub struct PhotonTransfer {
    /// List of flats and darks: a table with the columns file, kind (flat or dark), exposure_s, photons, temperature_k, level; the same
    /// as YAML; an EMVA 1288 descriptor; or a directory of frames that say all that themselves
    #[arg(value_name = "LIST")]
    pub list: PathBuf,
    /// Filter array of frames that do not say: rggb, bggr, grbg, gbrg, monochrome, or its period as 4x4:RRGGRRGGGGBBGGBB
    #[arg(long, value_name = "PATTERN", value_parser = str::parse::<FilterArray>)]
    pub cfa: Option<FilterArray>,
    /// The largest code, where frames do not say
    #[arg(long = "white", value_name = "N", value_parser = values::number)]
    pub white_level_adu: Option<f64>,
    /// Probability that an interval holds its number
    #[arg(long, value_name = "P", default_value_t = 0.95, value_parser = values::fraction)]
    pub confidence: f64,
    /// Relative standard uncertainty of the numbers of photons, all alike, as that of the radiometer
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0, value_parser = values::number)]
    pub photon_error: f64,
}

/// What was measured.
#[derive(Debug, Clone)]
pub struct MeasuredCamera {
    /// What the list was called.
    pub list: String,
    /// The frame that the others are like.
    pub head: FrameHeader,
    /// Each class of photosites, or each plane.
    pub classes: Vec<ClassFindings>,
    /// What the patterns of each look like, under light and in the dark.
    pub patterns: Vec<[Option<PatternView>; 2]>,
    /// Frames that counted, flats and darks.
    pub frames: [usize; 2],
    /// The probability that an interval holds its number.
    pub confidence: f64,
    /// Temperature of the sensor in K, where it is known.
    pub temperature_k: Option<f64>,
    /// What came up.
    pub notes: Vec<Note>,
}

/// Frames of one condition.
struct Group {
    condition: Condition,
    level: String,
    files: Vec<PathBuf>,
}

impl PhotonTransfer {
    /// Reads all frames and measures the camera.
    ///
    /// # Errors
    ///
    /// Those of the list and of the frames; [`Error::Data`] for frames that are no measurement.
    pub fn run(&self) -> Result<MeasuredCamera> {
        if !(0.0..1.0).contains(&self.photon_error) {
            return Err(
                Error::Usage("an uncertainty is a fraction: 0 or more, and below 1".into()).change(&["photon_error"])
            );
        }
        if self.confidence >= 1.0 {
            return Err(Error::Usage("no interval holds its number for certain".into()).change(&["confidence"]));
        }
        if self.white_level_adu.is_some_and(|white| white <= 0.0) {
            return Err(Error::Usage("the largest code is above 0".into()).change(&["white"]));
        }
        let list_name = self.list.display().to_string();
        let is_folder = self.list.is_dir();
        let FrameList { frames, white_level_adu } = if is_folder {
            FrameList { frames: in_folder(&self.list)?, white_level_adu: None }
        } else {
            frame_list::read(&self.list)?
        };
        let white_level_adu = self.white_level_adu.or(white_level_adu);
        let described = Described { cfa: self.cfa, white_level_adu, ..Described::default() };
        let heads = frames.par_iter().map(|frame| head_of(frame, &described)).collect::<Result<Vec<_>>>()?;
        let Some(first) = heads.first() else {
            return Err(Error::format(&list_name, "it holds no frames"));
        };
        for head in &heads {
            check_alike(first, head)?;
        }
        let mut notes = Vec::new();
        let mut groups: Vec<Group> = Vec::new();
        for (frame, head) in frames.iter().zip(&heads) {
            let (condition, level) = condition(frame, head)?;
            let known = groups.iter_mut().find(|group| group.condition == condition && group.level == level);
            match known {
                Some(group) => group.files.push(frame.file.clone()),
                None => groups.push(Group { condition, level, files: vec![frame.file.clone()] }),
            }
        }
        notes.extend(check_apart(&heads)?.map(Note::Warning));
        let single: Vec<&Group> = groups.iter().filter(|group| group.files.len() < 2).collect();
        if let Some(one) = single.first() {
            let others = if single.len() > 1 { format!(" and {} more", single.len() - 1) } else { String::new() };
            notes.push(Note::Warning(format!(
                "{}{others}: no other frame has its light and exposure; temporal noise takes two, so it is left out",
                one.files[0].display()
            )));
        }
        groups.retain(|group| group.files.len() >= 2);
        if groups.iter().all(|group| !group.condition.is_lit) {
            return Err(Error::Data(format!("{list_name}: it has no two flats of one light and exposure")));
        }
        let top = first.metadata.white_level_adu.map(|white| white.largest());
        let are_codes = first.metadata.quantity != QuantityKind::Electrons;
        if top.is_none() && are_codes {
            notes.push(Note::Warning(format!(
                "{list_name}: the largest code is not known, so that clipped levels are told by their variance alone; give --white"
            )));
        }
        let stacks = stacks(&groups);
        let surveys = groups.par_iter().enumerate();
        let surveys = surveys.map(|(place, group)| survey_of(group, &described, top, stacks.contains(&place)));
        let mut surveys = surveys.collect::<Result<Vec<_>>>()?;
        check_array(first, &groups, &surveys)?;
        notes.extend(doubt_of_codes(&list_name, first, &groups, &surveys));
        let settings = Settings { confidence: self.confidence, photon_error: self.photon_error, are_codes };
        let temperature_k = main_temperature(&groups);
        let classes = classes(first, &groups, &surveys, temperature_k, &settings);
        for place in classes.iter().flat_map(|class| class.stacks).flatten().map(|(place, _)| place) {
            if surveys[place].picture.is_none() {
                surveys[place] = survey_of(&groups[place], &described, top, true)?;
            }
        }
        let patterns = classes.par_iter().map(|class| patterns(first, class, &surveys)).collect();
        for class in &classes {
            if let Some(efficiency) = class.get("quantum_efficiency").filter(|efficiency| efficiency.low > 1.0) {
                notes.push(Note::Warning(format!(
                    "{}: a quantum efficiency of {:.0} % cannot be: photons are those of a photosite during the exposure, and codes \
                     proportional to light",
                    class.name,
                    efficiency.value * 100.0
                )));
            }
            notes.extend(class.doubts.iter().map(|doubt| Note::Warning(format!("{}: {doubt}", class.name))));
            notes.extend(class.notes.iter().map(|note| Note::Remark(format!("{}: {note}", class.name))));
        }
        let count = |is_lit: bool| {
            groups.iter().filter(|group| group.condition.is_lit == is_lit).map(|group| group.files.len()).sum()
        };
        Ok(MeasuredCamera {
            list: list_name,
            head: first.clone(),
            classes,
            patterns,
            frames: [count(true), count(false)],
            confidence: self.confidence,
            temperature_k,
            notes,
        })
    }
}

/// Makes sure that no exposure comes twice; gives a warning where noise of one is that of another, taken under other conditions.
fn check_apart(heads: &[FrameHeader]) -> Result<Option<String>> {
    let mut warning = None;
    let (mut by_digest, mut by_number) = (HashMap::new(), HashMap::new());
    for head in heads {
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
                 intervals too narrow; draw each level with a --seed or --frames of its own",
                head.name, other.name
            )
        });
    }
    Ok(warning)
}

/// Refuses a plane of unknown array whose sites differ as those behind filters do.
fn check_array(head: &FrameHeader, groups: &[Group], surveys: &[Survey]) -> Result<()> {
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

/// What codes look like that is not said of them: shifted, or ending below the code that is said to be the largest.
fn doubt_of_codes(list: &str, head: &FrameHeader, groups: &[Group], surveys: &[Survey]) -> Vec<Note> {
    let shift = surveys.iter().fold(0, |bits, survey| bits | survey.bits).trailing_zeros();
    let shifted = (shift > 0 && shift < u32::BITS).then(|| {
        format!(
            "{list}: all codes are multiples of {}, as those that were shifted left by {shift} bits; numbers in ADU are of such codes, and \
             the error of rounding is taken as too small: shift them back",
            1_u32 << shift
        )
    });
    let top = head.metadata.white_level_adu.map(|white| white.largest());
    let lit = groups.iter().zip(surveys).filter(|(group, _)| group.condition.is_lit);
    let brightest = lit.flat_map(|(_, survey)| &survey.sites).map(|site| site.mean).fold(0.0, f64::max);
    let end = (1..16).map(|bits| f64::from(bits).exp2() - 1.0).find(|end| (end - brightest).abs() < 0.01);
    let ended = end.zip(top).filter(|(end, top)| end < top).map(|(end, top)| {
        format!("{list}: the brightest flats are of the code {end} alone; that is the largest then, and not {top}, which is said to be")
    });
    shifted.into_iter().chain(ended).map(Note::Warning).collect()
}

/// Reads the frames of a condition.
fn survey_of(group: &Group, described: &Described, top: Option<f64>, keeps: bool) -> Result<Survey> {
    /// Files that other groups may have open meanwhile.
    const OTHERS: usize = 64;
    let mut frames = OneOfMany::open_all(group.files.iter().map(|file| options(file)).collect(), OTHERS)?;
    for frame in &mut frames {
        described.apply(frame.header_mut())?;
    }
    let found = survey(&mut frames, top, keeps)?;
    for site in &found.sites {
        if let Some((frame, mean)) =
            site.frame_means.iter().enumerate().find(|(_, mean)| top.is_some_and(|top| **mean > top))
        {
            let (file, top) = (group.files[frame].display(), top.unwrap_or_default());
            let problem = format!("{file}: its mean is {mean:.1}, above the largest code, {top}; name the right one");
            return Err(Error::Usage(problem).change(&["white"]));
        }
        check_same_light(group, &site.frame_means, top)?;
    }
    let within = |mean: f64| mean > 0.0 && top.is_none_or(|top| mean < top);
    let is_same = |site: &SiteSurvey| site.variance == 0.0 && within(site.mean) && site.spatial.rest.value > 0.0;
    if found.sites.iter().all(is_same) {
        let problem =
            format!("{} and {}: their samples are the same", group.files[0].display(), group.files[1].display());
        return Err(Error::Data(problem + "; copies of one exposure do not count as two"));
    }
    Ok(found)
}

/// The conditions of the most frames, one with light and one without, where they are alone in that.
fn stacks(groups: &[Group]) -> Vec<usize> {
    let of_kind = |is_lit: bool| {
        let own = || groups.iter().enumerate().filter(move |(_, group)| group.condition.is_lit == is_lit);
        let most = own().map(|(_, group)| group.files.len()).max()?;
        let mut with_most = own().filter(move |(_, group)| group.files.len() == most).map(|(place, _)| place);
        with_most.next().filter(|_| with_most.next().is_none())
    };
    [true, false].into_iter().filter_map(of_kind).collect()
}

/// What the patterns of a class look like: that of light, a share of the signal, and that of the dark, in samples.
fn patterns(head: &FrameHeader, class: &ClassFindings, surveys: &[Survey]) -> [Option<PatternView>; 2] {
    let sites = Site::of(head);
    let own: Vec<&Site> = sites.iter().filter(|site| site.class == class.name).collect();
    let size = [head.geometry.width, head.geometry.channels.len()];
    let picture = |stack: usize| {
        let (place, signal) = class.stacks[stack]?;
        surveys[place].picture.as_deref().map(|picture| (picture, signal))
    };
    // Temporal noise of rows and columns that is left in the means is no pattern.
    let left = |stack: usize| {
        let (place, _) = class.stacks[stack]?;
        let own = sites.iter().zip(&surveys[place].sites).filter(|(site, _)| site.class == class.name);
        let level = Level::of(place, Condition::default(), own.map(|(_, survey)| survey.clone()).collect());
        (level.frames >= 2).then(|| left_in_mean(&level))
    };
    let [of_flat, of_dark] = [0, 1].map(|stack| left(stack).unwrap_or_default());
    let without = |mut view: PatternView, left: [f64; 2]| {
        view.lines.iter_mut().zip(left).for_each(|([variance, _], left)| *variance -= left);
        view
    };
    let dark = picture(1).and_then(|(dark, _)| pattern_view(&own, size, &|index| f64::from(dark[index])));
    let dark = dark.map(|view| without(view, of_dark));
    let light = picture(0).zip(picture(1)).and_then(|((flat, signal), (dark, _))| {
        let view = pattern_view(&own, size, &|index| (f64::from(flat[index]) - f64::from(dark[index])) / signal);
        view.map(|view| without(view, [0, 1].map(|axis| (of_flat[axis] + of_dark[axis]) / (signal * signal))))
    });
    [light, dark]
}

/// Frames of one light whose means differ by more than this share were taken under several.
const SAME_LIGHT: f64 = 0.1;

fn check_same_light(group: &Group, means: &[f64], top: Option<f64>) -> Result<()> {
    let [least, most] =
        [means.iter().copied().fold(f64::INFINITY, f64::min), means.iter().copied().fold(0.0, f64::max)];
    // Of codes near the black level a tenth is little light.
    let scale = top.map_or(most, |top| most.max(top / 10.0));
    if most - least > SAME_LIGHT * scale {
        let at = |wanted: f64| {
            means.iter().position(|mean| *mean == wanted).map_or(Path::new("?"), |index| &group.files[index])
        };
        let (first, second) = (at(least).display(), at(most).display());
        return Err(Error::Data(if group.condition.is_lit {
            format!(
                "{first} and {second} are taken to be of one light and exposure, and their means are {least:.4} and {most:.4}; tell \
                 exposures apart in a list, by `exposure_s`, and levels of light by `photons` or `level`"
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

fn options(file: &Path) -> InputOptions {
    InputOptions { path: Some(file.to_owned()), ..InputOptions::default() }
}

/// The head of a frame, as it is described.
fn head_of(frame: &ListedFrame, described: &Described) -> Result<FrameHeader> {
    let reader = FrameReader::open(&options(&frame.file))?;
    let holds_to = reader.sample_type().and_then(SampleType::full_scale).map(f64::from);
    if let Some((white, full)) = described.white_level_adu.zip(holds_to).filter(|(white, full)| white > full) {
        let problem =
            format!("{}: it holds codes to {full}, and the largest is said to be {white}", frame.file.display());
        return Err(Error::Usage(problem).change(&["white"]));
    }
    let mut head = reader.header().clone();
    described.apply(&mut head)?;
    let metadata = &head.metadata;
    let holds = head.holds();
    if metadata.demosaic.is_some()
        || !matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Electrons | QuantityKind::Unspecified)
    {
        return Err(head.refuse(format!("it holds {holds}; photon transfer takes frames before they are demosaicked")));
    }
    if metadata.correction.is_some() {
        return Err(head.refuse("it is corrected already; photon transfer takes frames as the camera gives them"));
    }
    Ok(head)
}

/// Makes sure that two frames are of one camera as far as they say.
fn check_alike(first: &FrameHeader, other: &FrameHeader) -> Result<()> {
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

/// The condition of a frame, by the list and by what it says itself, and what tells its light apart.
fn condition(frame: &ListedFrame, head: &FrameHeader) -> Result<(Condition, String)> {
    let metadata = &head.metadata;
    let own = metadata.exposure.map(|exposure| exposure.exposure_s);
    if let (Some(listed), Some(own)) = (frame.exposure_s, own)
        && (listed / own - 1.0).abs() > 1e-3
    {
        return Err(head.refuse(format!("it was exposed for {own} s, and the list says {listed} s")));
    }
    let electrons = metadata.scene.as_ref().and_then(|scene| scene.expected_electrons);
    let by_scene = electrons.map(|electrons| if electrons == [0.0; 3] { FrameKind::Dark } else { FrameKind::Flat });
    if let (Some(listed), Some(own)) = (frame.kind, by_scene)
        && listed != own
    {
        return Err(head.refuse("the list and its metadata differ on whether light fell on it"));
    }
    let kind = frame.kind.or(by_scene).or_else(|| by_name(&frame.file));
    let kind = kind.ok_or_else(|| {
        head.refuse("nothing says whether it is a flat or a dark; name it in a list, or put it into a folder `flats` or `darks`")
    })?;
    let level = frame.level.clone().or_else(|| electrons.map(|electrons| format!("{electrons:?}")));
    let noise = metadata.noise.as_ref().map(|noise| noise.temperature_k);
    let condition = Condition {
        is_lit: kind == FrameKind::Flat,
        exposure_s: frame.exposure_s.or(own),
        photons: frame.photons.filter(|_| kind == FrameKind::Flat),
        temperature_k: frame.temperature_k.or(noise),
    };
    Ok((condition, level.unwrap_or_default()))
}

/// What a frame shows by the name of its file or folder.
fn by_name(file: &Path) -> Option<FrameKind> {
    let names = [file.file_stem(), file.parent().and_then(Path::file_name)];
    names.into_iter().flatten().find_map(|name| {
        let name = name.to_string_lossy().to_lowercase();
        let has = |words: &[&str]| words.iter().any(|word| name.contains(word));
        match (has(&["flat", "bright"]), has(&["dark", "bias"])) {
            (true, false) => Some(FrameKind::Flat),
            (false, true) => Some(FrameKind::Dark),
            _ => None,
        }
    })
}

/// The frames in a folder and in those within it, in the order of their names; sidecars and texts are none.
fn in_folder(folder: &Path) -> Result<Vec<ListedFrame>> {
    const OTHERS: [&str; 8] = ["yaml", "yml", "csv", "txt", "json", "md", "svg", "xml"];
    let failed = |error| Error::disk(&folder.display().to_string(), "read", error);
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        entries.push(entry.map_err(failed)?.path());
    }
    entries.sort();
    let mut found = Vec::new();
    for path in entries {
        let is_hidden = path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
        let end = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if is_hidden || OTHERS.contains(&end.as_str()) {
            continue;
        }
        if path.is_dir() {
            found.extend(in_folder(&path)?);
        } else {
            found.push(ListedFrame {
                file: path,
                kind: None,
                exposure_s: None,
                photons: None,
                temperature_k: None,
                temperature_c: None,
                level: None,
            });
        }
    }
    Ok(found)
}

/// The temperature at which most flats were taken.
fn main_temperature(groups: &[Group]) -> Option<f64> {
    let lit = || groups.iter().filter(|group| group.condition.is_lit);
    let count = |wanted: f64| lit().filter(|group| group.condition.temperature_k == Some(wanted)).count();
    lit().filter_map(|group| group.condition.temperature_k).max_by_key(|temperature| count(*temperature))
}

/// What is measured of each class.
fn classes(
    head: &FrameHeader,
    groups: &[Group],
    surveys: &[Survey],
    temperature_k: Option<f64>,
    settings: &Settings,
) -> Vec<ClassFindings> {
    let sites = Site::of(head);
    let mut names: Vec<&str> = Vec::new();
    for site in &sites {
        if !names.contains(&site.class.as_str()) {
            names.push(&site.class);
        }
    }
    let level = |name: &str, index: usize| {
        let own = sites.iter().zip(&surveys[index].sites).filter(|(site, _)| site.class == name);
        Level::of(index, groups[index].condition, own.map(|(_, survey)| survey.clone()).collect())
    };
    let light = |level: &Level| {
        let Condition { photons, exposure_s, .. } = level.condition;
        [photons.or(exposure_s).unwrap_or(0.0), level.mean]
    };
    let by_photons =
        groups.iter().filter(|group| group.condition.is_lit).all(|group| group.condition.photons.is_some());
    let of = |name: &&str| {
        let of_kind = |is_lit: bool| -> Vec<Level> {
            let wanted = |index: &usize| {
                let condition = &groups[*index].condition;
                condition.is_lit == is_lit
                    && (condition.temperature_k == temperature_k || condition.temperature_k.is_none())
            };
            (0..groups.len()).filter(wanted).map(|index| level(name, index)).collect()
        };
        let [mut flats, darks] = [of_kind(true), of_kind(false)];
        flats.sort_by(|a, b| {
            let ([light_a, mean_a], [light_b, mean_b]) = (light(a), light(b));
            let by_light = if by_photons { light_a.total_cmp(&light_b) } else { std::cmp::Ordering::Equal };
            by_light.then(mean_a.total_cmp(&mean_b))
        });
        let all: Vec<Level> = (0..groups.len())
            .filter(|&index| !groups[index].condition.is_lit)
            .map(|index| level(name, index))
            .collect();
        of_class(name, &flats, &darks, &all, settings)
    };
    names.par_iter().map(of).collect()
}

/// What a report calls the number of frames.
pub fn frames_in_words([flats, darks]: [usize; 2]) -> String {
    format!("{} and {}", counted(flats as u64, "flats"), counted(darks as u64, "darks"))
}
