//! A camera measured from flats and darks.

mod checks;
mod conditions;
mod corrections;
mod surveys;

use super::described::{Described, DescribedWithBlack};
use super::notes::Note;
use super::options::Selection;
use super::values;
use crate::analysis::photon_transfer::{
    Blur, ClassFindings, Condition, Level, PatternView, Settings, Site, Survey, Suspect, left_in_mean, pattern_view,
};
use crate::error::{Error, Result};
use crate::formats::frame_list::{self, FrameList};
use crate::metadata::FrameHeader;
use crate::text::counted;
use crate::units::QuantityKind;
use checks::{
    check_alike, check_apart, check_array, doubt_of_array, doubt_of_codes, doubt_of_end, doubt_of_frames,
    doubt_of_patterns,
};
use clap::Args;
use conditions::{Group, Reading, grouped, in_folder};
use corrections::{check_masters, check_same, corrected, in_words};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use surveys::Surveys;

/// Flats and darks, and what is asked of them.
#[derive(Debug, Clone, Args)]
pub struct PhotonTransfer {
    /// List of flats and darks: a table with the columns file, kind (flat or dark), exposure_s, photons, temperature_k or temperature_c, level; the same
    /// as YAML; an EMVA 1288 descriptor; or a directory of frames that say all that themselves
    #[arg(value_name = "LIST")]
    pub list: PathBuf,
    /// What of each file is its frame.
    #[command(flatten)]
    pub selection: Selection,
    /// YAML file whose metadata replace those that come with each of the frames
    #[arg(long, value_name = "FILE")]
    pub metadata: Option<PathBuf>,
    /// Print YAML to begin such a file with, each key explained
    #[arg(long)]
    pub metadata_template: bool,
    /// What is said of all frames.
    #[command(flatten)]
    pub described: DescribedWithBlack,
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
    /// The largest code, where it is known: as it is said, or as the brightest flats show it, where that is less.
    pub largest: Option<f64>,
    /// The probability that an interval holds its number.
    pub confidence: f64,
    /// Temperature of the sensor in K, where it is known.
    pub temperature_k: Option<f64>,
    /// What the frames were corrected by, and what that does to the numbers, where they were.
    pub corrected: Option<String>,
    /// What came up.
    pub notes: Vec<Note>,
}

impl PhotonTransfer {
    /// Reads all frames and measures the camera, with what only a figure shows where it `draws`.
    ///
    /// # Errors
    ///
    /// Those of the list and of the frames; [`Error::Data`] for frames that are no measurement.
    pub fn run(&self, draws: bool) -> Result<MeasuredCamera> {
        self.check()?;
        let list_name = self.list.display().to_string();
        let is_folder = self.list.is_dir();
        let FrameList { frames, white_level_adu } = self.frames()?;
        let read = self.reading(white_level_adu);
        let heads = frames.par_iter().map(|frame| read.head_of(frame)).collect::<Result<Vec<_>>>()?;
        let first = &heads.first().ok_or_else(|| Error::format(&list_name, "it holds no frames"))?.header;
        for head in &heads {
            check_same(first, &head.header)?;
            check_alike(first, &head.header)?;
        }
        check_masters(heads.iter().map(|head| (&head.header, head.exposure_s)))?;
        let corrected = corrected(first, heads.iter().any(|head| head.has_marks));
        let descriptor = is_folder.then(|| frame_list::descriptor_in(&self.list)).flatten();
        let grouped = grouped(&list_name, &frames, &heads);
        let (groups, mut notes) = grouped.map_err(|error| without_descriptor(error, descriptor.as_deref()))?;
        notes.extend(descriptor.map(|file| Note::Warning(beside_frames(&file))));
        notes.extend(check_apart(&heads)?.map(Note::Warning));
        if groups.iter().all(|group| !group.condition.is_lit) {
            return Err(Error::Data(format!("{list_name}: it has no two flats of one light and exposure")));
        }
        let are_codes = first.metadata.quantity != QuantityKind::Electrons;
        let mut taken = Surveys::of(first, &groups, &read, are_codes)?;
        let largest = taken.largest;
        if first.metadata.white_level_adu.is_none() && are_codes && corrected.is_none() {
            notes.push(doubt_of_end(&list_name, largest));
        }
        check_array(first, &groups, &taken.found)?;
        notes.extend(doubt_of_array(first, &groups, &taken.found));
        notes.extend(doubt_of_frames(&groups, &taken.found));
        notes.extend(doubt_of_patterns(&groups, &taken.found));
        let settings = Settings {
            confidence: self.confidence,
            photon_error: self.photon_error,
            are_codes,
            top: largest,
            corrected,
        };
        let temperature_k = main_temperature(&groups);
        let mut classes = taken.measured(temperature_k, &settings)?;
        if !settings.lost_dark() {
            taken.find_hot(&mut classes, temperature_k, settings.rounding())?;
        }
        let (surveys, largest) = (taken.found, taken.largest);
        notes.extend(doubt_of_codes(&list_name, first, &surveys, largest));
        let rounding = settings.rounding();
        let patterns = classes.par_iter().map(|class| patterns(first, class, &surveys, rounding, draws)).collect();
        notes.extend(doubts_of_levels(&classes, &groups));
        notes.extend(classes.iter().flat_map(notes_of));
        let count = |is_lit: bool| {
            groups.iter().filter(|group| group.condition.is_lit == is_lit).map(|group| group.files.len()).sum()
        };
        Ok(MeasuredCamera {
            list: list_name,
            head: first.clone(),
            classes,
            patterns,
            frames: [count(true), count(false)],
            largest,
            confidence: self.confidence,
            temperature_k,
            corrected: corrected.and_then(|corrected| in_words(first, corrected)),
            notes,
        })
    }

    /// The frames of the list, or of the directory.
    fn frames(&self) -> Result<FrameList> {
        if self.list.is_dir() {
            return Ok(FrameList { frames: in_folder(&self.list)?, white_level_adu: None });
        }
        frame_list::read(&self.list)
    }

    /// How each file is read; a list may tell the largest code.
    fn reading(&self, white_level_adu: Option<f64>) -> Reading {
        let Self { selection, metadata, described, .. } = self.clone();
        let white_level_adu = described.described.white_level_adu.or(white_level_adu);
        let said = Described { white_level_adu, ..described.described };
        Reading { selection, metadata, described: DescribedWithBlack { described: said, ..described } }
    }

    /// Makes sure that its numbers are possible.
    fn check(&self) -> Result<()> {
        let usage = |problem: &str, key: &'static [&'static str]| Err(Error::Usage(problem.into()).change(key));
        if !(0.0..1.0).contains(&self.photon_error) {
            return usage("an uncertainty is a fraction: 0 or more, and below 1", &["photon_error"]);
        }
        if self.confidence >= 1.0 {
            return usage("no interval holds its number for certain", &["confidence"]);
        }
        if self.described.described.white_level_adu.is_some_and(|white| white <= 0.0) {
            return usage("the largest code is above 0", &["white"]);
        }
        Ok(())
    }
}

/// What is said of the descriptor of a measurement that lies in a directory of frames.
fn beside_frames(descriptor: &Path) -> String {
    format!(
        "{}: it describes an EMVA 1288 measurement, and is not read; given in place of the directory it tells light and exposure of its \
         frames",
        descriptor.display()
    )
}

/// The same beside what is wrong with frames of which a directory does not tell enough.
fn without_descriptor(error: Error, descriptor: Option<&Path>) -> Error {
    match descriptor {
        Some(file) => Error::Usage(format!("{error}; {}", beside_frames(file))),
        None => error,
    }
}

/// Warnings of frames that may not be what they are said to be, each level once.
fn doubts_of_levels(classes: &[ClassFindings], groups: &[Group]) -> Vec<Note> {
    let mut told: Vec<usize> = Vec::new();
    let mut warnings = Vec::new();
    for Suspect { place, problem } in classes.iter().flat_map(|class| &class.suspects) {
        if !told.contains(place) {
            told.push(*place);
            warnings.push(Note::Warning(format!("{}: {problem}", groups[*place].named())));
        }
    }
    warnings
}

/// What a careful user should know of what was found of a class.
fn notes_of(class: &ClassFindings) -> Vec<Note> {
    let beyond = class.get("quantum_efficiency").filter(|efficiency| efficiency.low > 1.0).map(|efficiency| {
        format!(
            "a quantum efficiency of {:.0} % cannot be: photons are those of a photosite during the exposure, and codes \
             proportional to light",
            efficiency.value * 100.0
        )
    });
    let of_class = |text: &String| format!("{}: {text}", class.name);
    let warnings = beyond.iter().chain(&class.doubts).map(|doubt| Note::Warning(of_class(doubt)));
    warnings.chain(class.notes.iter().map(|note| Note::Remark(of_class(note)))).collect()
}

/// What the patterns of a class look like: that of light, a share of the signal, and that of the dark, in samples.
fn patterns(
    head: &FrameHeader,
    class: &ClassFindings,
    surveys: &[Survey],
    rounding: f64,
    draws: bool,
) -> [Option<PatternView>; 2] {
    let sites = Site::of(head);
    let own: Vec<&Site> = sites.iter().filter(|site| site.class == class.name).collect();
    let size = [head.geometry.width, head.geometry.channels.len()];
    let picture = |stack: usize| {
        let (place, signal) = class.stacks[stack]?;
        surveys[place].picture.as_deref().map(|picture| (picture, signal))
    };
    // Temporal noise that is left in the means is no pattern, nor is that of rows and columns.
    let left = |stack: usize| {
        let (place, _) = class.stacks[stack]?;
        let own = sites.iter().zip(&surveys[place].sites).filter(|(site, _)| site.class == class.name);
        let level = Level::of(place, Condition::default(), own.map(|(_, survey)| survey.clone()).collect());
        (level.frames >= 2).then(|| (left_in_mean(&level), Blur::of(&level, rounding)))
    };
    let [(of_flat, flat_blur), (of_dark, dark_blur)] = [0, 1].map(|stack| left(stack).unwrap_or_default());
    let without = |mut view: PatternView, left: [[f64; 2]; 2]| {
        for ([variance, scatter], [left, of_left]) in view.lines.iter_mut().zip(left) {
            (*variance, *scatter) = (*variance - left, scatter.hypot(of_left));
            // It came off that of single photosites as a part of rows and columns, and as one of all noise.
            view.rest[0] += left;
        }
        view
    };
    let of_dark_alone = || {
        let (dark, _) = picture(1)?;
        let view = pattern_view(&own, size, &|index| f64::from(dark[index]), dark_blur, draws)?;
        Some(without(view, of_dark))
    };
    let of_light = || {
        let ((flat, signal), (dark, _)) = picture(0).zip(picture(1))?;
        let share = |index: usize| (f64::from(flat[index]) - f64::from(dark[index])) / signal;
        let (noise, hidden) = (flat_blur.noise.hypot(dark_blur.noise), flat_blur.hidden + dark_blur.hidden);
        let view = pattern_view(&own, size, &share, Blur { noise: noise / signal, hidden: hidden / signal }, draws)?;
        let of_axis = |axis: usize| {
            let ([flat, of_flat], [dark, of_dark]) = (of_flat[axis], of_dark[axis]);
            [flat + dark, of_flat.hypot(of_dark)].map(|of| of / (signal * signal))
        };
        Some(without(view, [0, 1].map(of_axis)))
    };
    let (light, dark) = rayon::join(of_light, of_dark_alone);
    [light, dark]
}

/// The temperature at which most flats were taken.
fn main_temperature(groups: &[Group]) -> Option<f64> {
    let lit = || groups.iter().filter(|group| group.condition.is_lit);
    let count = |wanted: f64| lit().filter(|group| group.condition.temperature_k == Some(wanted)).count();
    lit().filter_map(|group| group.condition.temperature_k).max_by_key(|temperature| count(*temperature))
}

/// What a report calls the number of frames.
pub fn frames_in_words([flats, darks]: [usize; 2]) -> String {
    format!("{} and {}", counted(flats as u64, "flats"), counted(darks as u64, "darks"))
}
