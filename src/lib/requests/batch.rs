//! Several inputs, each with outputs of its own.

use crate::error::{Error, Result};
use crate::formats::keys::kind_of;
use crate::formats::places::{FRAME, INDEX, STEM, is_numbered, named, numbered, output_of, place, sidecar_path};
use crate::names::nearest;
use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::{Path, PathBuf};

/// An input, and where what is made of it goes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Job {
    /// None for the standard input.
    pub input: Option<PathBuf>,
    /// The frame; none for the standard output.
    pub frame: Option<PathBuf>,
    /// What is written beside the frame, as far as it was asked for.
    pub beside: Vec<Option<PathBuf>>,
}

/// The jobs for some inputs by patterns of their outputs ([`output_of`]): that of frames, which end in `extension` where it is a
/// directory, and those of what is written beside them. Names of what comes through a pipe are told by its frames, if at all.
///
/// # Errors
///
/// [`Error::Usage`] where two outputs would have one place, one of several inputs comes through a pipe, or what is written beside
/// the frames of a pipe needs a name.
pub fn jobs(inputs: &[PathBuf], frame: Option<&Path>, extension: &str, beside: &[Option<&Path>]) -> Result<Vec<Job>> {
    check_known(frame)?;
    let (Some(first), several) = (inputs.first(), inputs.len() > 1) else {
        beside.iter().try_for_each(|path| check_named(*path))?;
        let beside = beside.iter().map(|path| path.map(Path::to_owned)).collect();
        return Ok(vec![Job { input: None, frame: frame.map(Path::to_owned), beside }]);
    };
    if several && inputs.iter().any(|input| named(Some(input)).is_none()) {
        return Err(Error::Usage("the standard input cannot be one of several inputs; name a file".into()));
    }
    if named(Some(first)).is_none() {
        beside.iter().try_for_each(|path| check_named(*path))?;
    }
    // A sidecar beside its frame is no frame.
    let frames: HashSet<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    let is_sidecar = |input: &Path| {
        input.extension().is_some_and(|end| end == "yaml") && frames.contains(input.with_extension("").as_path())
    };
    let job = |input: &PathBuf| {
        let of = |pattern: Option<&Path>, extension| {
            pattern.map(|pattern| {
                let is_kept = named(Some(pattern)).is_none() || named(Some(input)).is_none();
                if is_kept { pattern.to_owned() } else { output_of(pattern, input, extension) }
            })
        };
        Job {
            input: Some(input.clone()),
            frame: of(frame, extension),
            beside: beside.iter().map(|pattern| of(*pattern, "yaml")).collect(),
        }
    };
    inputs.iter().filter(|input| several && !is_sidecar(input)).try_for_each(|input| check_frame(input))?;
    let jobs: Vec<Job> = inputs.iter().filter(|input| !is_sidecar(input)).map(job).collect();
    if several {
        check_apart(&jobs)?;
    }
    Ok(jobs)
}

/// Makes sure that one of several inputs is no file of ours that an option names.
fn check_frame(input: &Path) -> Result<()> {
    /// What they say that they are stands this near to their beginning.
    const LOOKED_AT: u64 = 1 << 12;
    let is_yaml = input.extension().is_some_and(|end| end == "yaml" || end == "yml") && input.is_file();
    let mut text = String::new();
    let read =
        is_yaml.then(|| std::fs::File::open(input).and_then(|file| file.take(LOOKED_AT).read_to_string(&mut text)));
    match read.and_then(|_| kind_of(&text)) {
        Some(kind) => Err(Error::Usage(format!("{}: it is no frame but {kind}", input.display()))),
        None => Ok(()),
    }
}

/// Makes sure that the directories of frames are there, before each frame complains of its own; those whose names hold numbers are
/// not known yet.
///
/// # Errors
///
/// [`Error::Data`] that names the first which is not.
pub fn check_directories(jobs: &[Job]) -> Result<()> {
    let mut last = None;
    let frames = || jobs.iter().filter_map(|job| named(job.frame.as_deref()));
    for (frame, directory) in frames().filter_map(|frame| Some((frame, frame.parent()?))) {
        let has_name = directory.to_string_lossy().contains(STEM);
        let is_known = !directory.as_os_str().is_empty() && numbered(directory, 0, 0).is_none() && !has_name;
        if is_known && last != Some(directory) && !directory.is_dir() {
            let problem = format!("there is no directory `{}`; make it first", directory.display());
            return Err(Error::format(&frame.display().to_string(), problem));
        }
        last = Some(directory);
    }
    Ok(())
}

/// Makes sure that the output of what has no name does without.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_named(output: Option<&Path>) -> Result<()> {
    if !named(output).is_some_and(takes_a_name) {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "the standard input tells no name for {STEM} or a directory; name the output, of several frames with {{frame}}"
    )))
}

/// Makes sure that a pattern has no places but those for names and numbers that there are.
///
/// # Errors
///
/// [`Error::Usage`] naming the place that there is none for, and the nearest that there is.
pub fn check_known(pattern: Option<&Path>) -> Result<()> {
    const PLACES: [&str; 3] = ["stem", FRAME, INDEX];
    let text = pattern.map(|pattern| pattern.to_string_lossy().into_owned()).unwrap_or_default();
    let is_word = |place: &str| !place.is_empty() && place.chars().all(|c| c.is_ascii_alphanumeric() || c == ':');
    let places = text.split('{').skip(1).filter_map(|rest| Some(rest.split_once('}')?.0));
    for place in places.filter(|place| is_word(place)) {
        let whole = format!("{{{place}}}");
        if whole != STEM && numbered(Path::new(&whole), 0, 0).is_none() {
            let near = nearest(place.split(':').next().unwrap_or_default(), PLACES, |known| known.len() / 2);
            let near = near.map_or_else(|| "; there".to_owned(), |near| format!("; did you mean {{{near}}}? There"));
            return Err(Error::Usage(format!(
                "{text}: nothing stands for {whole}{near} are {STEM}, {{frame}} and {{index}}, and {{frame:05}} for five digits"
            )));
        }
    }
    let opened = text.rsplit_once('{').map(|(_, rest)| rest).filter(|rest| !rest.contains('}'));
    let meant = opened.and_then(|rest| PLACES.into_iter().find(|place| rest.starts_with(place)));
    meant.map_or(Ok(()), |place| {
        Err(Error::Usage(format!("{text}: the brace of {{{place} is not closed; write {{{place}}}")))
    })
}

fn takes_a_name(pattern: &Path) -> bool {
    output_of(pattern, Path::new("a"), "b") != pattern
}

/// Makes sure that no two outputs, the sidecars of frames among them, have one place.
fn check_apart(jobs: &[Job]) -> Result<()> {
    let mut taken = HashMap::new();
    for Job { input, frame, beside } in jobs {
        let input = input.as_deref().unwrap_or(Path::new("-")).display();
        let sidecar = frame.as_deref().map(sidecar_path);
        // Numbers of frames are not known yet; two that meet are told then.
        let is_known = |output: &&PathBuf| named(Some(output)).is_some() && !is_numbered(output);
        for output in [frame, &sidecar].into_iter().chain(beside).flatten().filter(is_known) {
            if let Some(other) = taken.insert(place(Some(output)), input.to_string()) {
                return Err(Error::Usage(format!(
                    "{}: what is made of {other} and of {input} would both go there; give -o DIR/, or names with {STEM}, and inputs \
                     whose names differ",
                    output.display()
                )));
            }
        }
    }
    Ok(())
}

/// Makes sure that a file for each of several frames has a pattern for a name, before any is read.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_each_named(inputs: &[PathBuf], output: Option<&Path>) -> Result<()> {
    check_known(output)?;
    match output.filter(|output| inputs.len() > 1 && !takes_a_name(output) && !is_numbered(output)) {
        Some(output) => Err(Error::Usage(format!(
            "{}: one of each of {} frames would go there; give a directory, or a name with {STEM}, {{frame}} or {{index}}",
            output.display(),
            inputs.len()
        ))),
        None => Ok(()),
    }
}

/// Makes sure that a report of all frames, which goes to one file, is not named by a pattern.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_one_report(output: Option<&Path>) -> Result<()> {
    let is_pattern = |output: &&Path| is_numbered(output) || output.to_string_lossy().contains(STEM);
    match output.filter(is_pattern) {
        Some(output) => Err(Error::Usage(format!(
            "{}: the reports of all frames go to one file, which has a plain name; each says which frame it is of",
            output.display()
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planned(inputs: &[&str], frame: Option<&str>, beside: &[Option<&str>]) -> std::result::Result<Vec<Job>, String> {
        let inputs: Vec<PathBuf> = inputs.iter().map(PathBuf::from).collect();
        let beside: Vec<Option<&Path>> = beside.iter().map(|path| path.map(Path::new)).collect();
        jobs(&inputs, frame.map(Path::new), "exr", &beside).map_err(|error| error.to_string())
    }

    #[test]
    fn places_that_there_are_not_are_told() {
        for (pattern, said) in [
            ("{steam}.png", "nothing stands for {steam}; did you mean {stem}? There are {stem}"),
            ("{fram:04}.png", "nothing stands for {fram:04}; did you mean {frame}?"),
            ("{xyz}.png", "nothing stands for {xyz}; there are {stem}"),
            ("a-{stem.png", "the brace of {stem is not closed; write {stem}"),
        ] {
            let found = check_known(Some(Path::new(pattern))).unwrap_err().to_string();
            assert!(found.contains(said), "{found}");
        }
        for pattern in ["{stem}-{frame:04}.png", "{index}.png", "a{.png", "{}.png", "plain.png"] {
            assert!(check_known(Some(Path::new(pattern))).is_ok(), "{pattern}");
        }
    }

    #[test]
    fn each_input_has_outputs_of_its_own() {
        let plan = planned(&["a/x.nef", "b/y.dng"], Some("out/"), &[Some("{stem}-m.yaml"), None]).unwrap();
        let frames: Vec<_> = plan.iter().map(|job| job.frame.clone().unwrap()).collect();
        assert_eq!(frames, [PathBuf::from("out/x.exr"), PathBuf::from("out/y.exr")]);
        assert_eq!(plan[1].beside, [Some(PathBuf::from("y-m.yaml")), None]);
        // One input goes where it is told, or through a pipe.
        assert_eq!(planned(&["x.nef"], Some("{stem}.tiff"), &[]).unwrap()[0].frame, Some(PathBuf::from("x.tiff")));
        assert_eq!(planned(&["x.nef"], None, &[]).unwrap()[0].frame, None);
        // Names of what comes through a pipe come with it, and numbers of frames.
        assert_eq!(planned(&["-"], Some("{stem}.exr"), &[]).unwrap()[0].frame, Some(PathBuf::from("{stem}.exr")));
        assert!(planned(&["x.nef", "y.nef"], Some("o-{frame}.tiff"), &[]).is_ok());
        let several = ["x.nef", "y.nef"].map(PathBuf::from);
        assert!(check_each_named(&several, Some(Path::new("p.svg"))).is_err());
        assert!(check_each_named(&several, Some(Path::new("{stem}.svg"))).is_ok());
        assert!(check_each_named(&several[..1], Some(Path::new("p.svg"))).is_ok());
        assert!(
            check_one_report(Some(Path::new("{stem}.csv"))).is_err()
                && check_one_report(Some(Path::new("a.csv"))).is_ok()
        );
        assert_eq!(
            planned(&[], Some("x.tiff"), &[None]).unwrap(),
            [Job { frame: Some("x.tiff".into()), beside: vec![None], ..Job::default() }]
        );
    }

    #[test]
    fn outputs_that_would_meet_are_refused() {
        for (inputs, frame, beside, wanted) in [
            (
                &["a/x.nef", "b/x.dng"][..],
                Some("out/"),
                None,
                "out/x.exr: what is made of a/x.nef and of b/x.dng would both",
            ),
            (
                &["x.nef", "y.nef"],
                Some("o.tiff"),
                None,
                "o.tiff: what is made of x.nef and of y.nef would both go there",
            ),
            (&["x.nef", "y.nef"], Some("{stem}.exr"), Some("m.yaml"), "m.yaml: what is made of x.nef and of y.nef"),
            (
                &["x.nef", "y.nef"],
                Some("{stem}.exr"),
                Some("{stem}.exr.yaml"),
                "x.exr.yaml: what is made of x.nef and of x.nef",
            ),
            (&["x.nef", "-"], Some("out/"), None, "the standard input cannot be one of several inputs; name a file"),
            (
                &["-"],
                Some("out/"),
                Some("{stem}.yaml"),
                "the standard input tells no name for {stem} or a directory; name",
            ),
        ] {
            let complaint = planned(inputs, frame, &[beside]).unwrap_err();
            assert!(complaint.starts_with(wanted), "{complaint}");
        }
    }
}
