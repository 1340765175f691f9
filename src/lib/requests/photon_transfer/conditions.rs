//! The frames of a measurement, told apart by light, exposure and temperature.

use super::corrections::{AsTaken, give_back};
use crate::analysis::photon_transfer::Condition;
use crate::camera::levels::WhiteLevel;
use crate::error::{Error, Result};
use crate::formats::format::SampleType;
use crate::formats::frame_list::{FrameKind, ListedFrame};
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::many::OneOfMany;
use crate::formats::places::is_waited_on;
use crate::metadata::{FrameHeader, TakenAs};
use crate::requests::described::{Described, DescribedWithBlack};
use crate::requests::notes::Note;
use crate::requests::options::Selection;
use crate::stream::RowSource;
use crate::units::QuantityKind;
use std::path::{Path, PathBuf};

/// Frames of one condition.
pub struct Group {
    /// The condition.
    pub condition: Condition,
    /// What tells its light apart.
    pub level: String,
    /// The frames.
    pub files: Vec<PathBuf>,
}

impl Group {
    /// Its files, as messages call them.
    pub fn named(&self) -> String {
        let name = |file: &PathBuf| file.display().to_string();
        match &self.files[..] {
            [one, other] => format!("{} and {}", name(one), name(other)),
            [one, others @ ..] if !others.is_empty() => format!("{} and {} more of its level", name(one), others.len()),
            files => files.iter().map(name).collect(),
        }
    }
}

/// What a frame says of itself.
pub struct Head {
    /// As it is described.
    pub header: FrameHeader,
    /// The exposure time in s, where the file tells it or a user does.
    pub exposure_s: Option<f64>,
    /// Whether marks of saturated samples come with it.
    pub has_marks: bool,
}

/// How each file is read, and what is said of all frames.
#[derive(Debug, Clone)]
pub struct Reading {
    /// What of a file is its frame.
    pub selection: Selection,
    /// A file of metadata in place of those of each frame.
    pub metadata: Option<PathBuf>,
    /// What is said of the frames; of an exposure the time alone counts.
    pub described: DescribedWithBlack,
}

impl Reading {
    /// The head of a frame, as it is described.
    ///
    /// # Errors
    ///
    /// Those of the file; [`Error::Order`] for a frame of another stage; [`Error::Usage`] for an exposure time that is not that
    /// of the list.
    pub fn head_of(&self, frame: &ListedFrame) -> Result<Head> {
        let reader = FrameReader::open(&self.options(&frame.file))?;
        let Described { white_level_adu, exposure_s: said_s, .. } = self.described.described;
        let holds_to = reader.sample_type().and_then(SampleType::full_scale).map(f64::from);
        if let Some((white, full)) = white_level_adu.zip(holds_to).filter(|(white, full)| white > full) {
            let problem =
                format!("{}: it holds codes to {full}, and the largest is said to be {white}", frame.file.display());
            return Err(Error::Usage(problem).change(&["white"]));
        }
        if let Some((said, listed)) = said_s.zip(frame.exposure_s).filter(|(said, listed)| differ(*said, *listed)) {
            let problem =
                format!("{}: its exposure time is {listed} s by the list, not {said} s", frame.file.display());
            return Err(Error::Usage(problem).leave_out(&["exposure"]));
        }
        let mut head = reader.header().clone();
        let exposure_s = self.described.apply_time(&mut head)?;
        let metadata = &head.metadata;
        let holds = head.holds();
        if metadata.demosaic.is_some()
            || !matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Electrons | QuantityKind::Unspecified)
        {
            let problem = format!("it holds {holds}; photon transfer takes frames before they are demosaicked");
            return Err(head.refuse(problem));
        }
        self.as_taken(&mut head);
        Ok(Head { header: head, exposure_s, has_marks: reader.has_mask() })
    }

    /// Gives a head the level that came off, where that is all; of other corrected samples only what is said tells a largest.
    fn as_taken(&self, head: &mut FrameHeader) {
        give_back(head);
        if head.metadata.correction.is_some() {
            head.metadata.white_level_adu = self.described.described.white_level_adu.map(WhiteLevel::from);
        }
    }

    /// Frames whose heads were seen, as they are described, so many of which others may have open besides.
    ///
    /// # Errors
    ///
    /// As [`Self::head_of`].
    pub fn open_all(&self, files: &[PathBuf], others: usize) -> Result<Vec<AsTaken>> {
        let options = files.iter().map(|file| self.options(file)).collect();
        let described = |mut frame: OneOfMany| {
            self.described.apply_time(frame.header_mut())?;
            Ok(AsTaken::of(frame))
        };
        OneOfMany::open_all(options, others)?.into_iter().map(described).collect()
    }

    /// What is read of a file.
    pub fn options(&self, file: &Path) -> InputOptions {
        InputOptions { metadata: self.metadata.clone(), ..self.selection.of(file) }
    }
}

/// Whether two exposure times differ by more than what is written with other digits.
fn differ(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() > 1e-3
}

/// Temperatures that lie so near to one another, in K, are those of one setting: sensors tell theirs frame by frame.
const SAME_TEMPERATURE_K: f64 = 0.5;

/// The frames by their conditions, and what a careful user should know of that.
///
/// # Errors
///
/// Where a frame and the list differ, or neither tells enough.
pub fn grouped(list: &str, frames: &[ListedFrame], heads: &[Head]) -> Result<(Vec<Group>, Vec<Note>)> {
    let found = frames.iter().zip(heads).map(|(frame, head)| condition(frame, head)).collect::<Result<Vec<_>>>()?;
    let temperatures = settings(found.iter().filter_map(|(condition, _)| condition.temperature_k).collect());
    let mut groups: Vec<Group> = Vec::new();
    for (frame, (mut condition, level)) in frames.iter().zip(found) {
        condition.temperature_k = condition.temperature_k.map(|kelvin| setting_of(kelvin, &temperatures));
        let known = groups.iter_mut().find(|group| group.condition == condition && group.level == level);
        match known {
            Some(group) => group.files.push(frame.file.clone()),
            None => groups.push(Group { condition, level, files: vec![frame.file.clone()] }),
        }
    }
    let mut notes: Vec<Note> = temperatures.iter().filter(|[low, high]| low < high).map(taken_as_one).collect();
    notes.extend(doubt_of_times(list, &groups));
    let single: Vec<&Group> = groups.iter().filter(|group| group.files.len() < 2).collect();
    if let Some(one) = single.first() {
        let others = if single.len() > 1 { format!(" and {} more", single.len() - 1) } else { String::new() };
        notes.push(Note::Warning(format!(
            "{}{others}: no other frame has its light and exposure; temporal noise takes two, so it is left out",
            one.files[0].display()
        )));
    }
    groups.retain(|group| group.files.len() >= 2);
    Ok((groups, notes))
}

/// The lowest and the highest temperature of each setting.
fn settings(mut temperatures: Vec<f64>) -> Vec<[f64; 2]> {
    temperatures.sort_by(f64::total_cmp);
    let mut found: Vec<[f64; 2]> = Vec::new();
    for kelvin in temperatures {
        match found.last_mut().filter(|[_, high]| kelvin - *high <= SAME_TEMPERATURE_K) {
            Some([_, high]) => *high = kelvin,
            None => found.push([kelvin; 2]),
        }
    }
    found
}

/// What stands for the setting that a temperature belongs to: the middle, or the temperature itself where it is alone.
fn setting_of(kelvin: f64, settings: &[[f64; 2]]) -> f64 {
    let own = settings.iter().find(|[low, high]| (*low..=*high).contains(&kelvin));
    own.map_or(kelvin, |[low, high]| if low < high { f64::midpoint(*low, *high) } else { kelvin })
}

fn taken_as_one([low, high]: &[f64; 2]) -> Note {
    let text = format!("temperatures from {low} K to {high} K are taken as one");
    // Dark current doubles in 5 to 10 K.
    if high - low > 2.0 * SAME_TEMPERATURE_K {
        Note::Warning(text + ", as none of them is far from the next; take frames at settings apart")
    } else {
        Note::Remark(text)
    }
}

/// Exposure times that are none of flats in s.
fn doubt_of_times(list: &str, groups: &[Group]) -> Option<Note> {
    /// Flats are not exposed so long.
    const LONG_S: f64 = 100.0;
    let lit = groups.iter().filter(|group| group.condition.is_lit);
    let longest = lit.filter_map(|group| group.condition.exposure_s).fold(0.0, f64::max);
    (longest >= LONG_S).then(|| {
        Note::Warning(format!(
            "{list}: flats are exposed for up to {longest} s; exposure times are in s: of ms, dark current would be a thousandth"
        ))
    })
}

/// The condition of a frame, by the list and by what it says itself, and what tells its light apart.
fn condition(frame: &ListedFrame, Head { header: head, exposure_s, .. }: &Head) -> Result<(Condition, String)> {
    let metadata = &head.metadata;
    let own = *exposure_s;
    if let (Some(listed), Some(own)) = (frame.exposure_s, own)
        && differ(listed, own)
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
    let by_header = metadata.taken_as.and_then(|taken_as| match taken_as {
        TakenAs::Light => None,
        TakenAs::Dark | TakenAs::Bias => Some(FrameKind::Dark),
        TakenAs::Flat => Some(FrameKind::Flat),
    });
    let otherwise = frame.kind.or(by_scene).or_else(|| by_name(&frame.file));
    if let (Some(otherwise), Some(told), Some(taken_as)) = (otherwise, by_header, metadata.taken_as)
        && otherwise != told
    {
        return Err(head.refuse(format!(
            "it was taken as {}, by its own header or metadata (`taken_as`), but the list or its name says another thing",
            taken_as.in_words()
        )));
    }
    let kind = otherwise.or(by_header);
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
pub fn in_folder(folder: &Path) -> Result<Vec<ListedFrame>> {
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
        if is_waited_on(&path) {
            let problem =
                "it is neither a file nor a directory, and would be waited on; take it out of the folder of frames";
            return Err(Error::format(&path.display().to_string(), problem));
        }
        if path.is_dir() {
            found.extend(in_folder(&path)?);
        } else {
            found.push(ListedFrame { file: path, ..ListedFrame::default() });
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sensor that tells its temperature frame by frame stays at one setting; 5 K on is another.
    #[test]
    fn temperatures_near_each_other_are_one() {
        let found = settings(vec![293.2, 298.0, 293.0, 293.4, 298.0]);
        assert_eq!(found, [[293.0, 293.4], [298.0, 298.0]]);
        assert_eq!(setting_of(293.4, &found), 293.2);
        assert_eq!(setting_of(298.0, &found), 298.0);
        assert!(matches!(taken_as_one(&found[0]), Note::Remark(_)));
        assert!(matches!(taken_as_one(&[293.0, 294.5]), Note::Warning(_)));
    }
}
