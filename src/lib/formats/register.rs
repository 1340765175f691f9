//! What a running program reads and writes, so that no output is written over an input, whatever it is called.
//!
//! A program that starts [`keep`]s a register. From then on every file that is opened for reading is noted by its identity,
//! which links, symbolic or hard, do not change; every output is compared with all of them, and those that are announced
//! before the work with every file that is opened later. Library users who read a file and write it again later are left
//! alone: without [`keep`] there is no register.

use super::places::{STDIN_NAME, named, place, sidecar_path};
use crate::error::{Error, Result};
use std::collections::{HashMap, HashSet};
use std::fs::Metadata;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// Identity of a file: device and inode.
type FileId = (u64, u64);

/// Device and inode of a file.
fn file_id(about: &Metadata) -> FileId {
    use std::os::unix::fs::MetadataExt;
    (about.dev(), about.ino())
}

static REGISTER: Mutex<Option<Register>> = Mutex::new(None);

#[derive(Debug, Default)]
struct Register {
    inputs: HashMap<FileId, Input>,
    outputs: Vec<(FileId, String)>,
    reads_stdin: bool,
    doubts: Vec<Doubt>,
}

/// A file that is read.
#[derive(Debug)]
struct Input {
    name: String,
    modified: Option<SystemTime>,
}

fn register() -> MutexGuard<'static, Option<Register>> {
    // Whoever panics leaves it as it was.
    REGISTER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Begins a register; programs call it once, before they open anything.
pub fn keep() {
    *register() = Some(Register::default());
}

/// Notes a file that is read.
///
/// # Errors
///
/// [`Error::Usage`] where it is one of the outputs that were announced.
pub fn note_input(about: &Metadata, name: &str) -> Result<()> {
    match &mut *register() {
        Some(register) if about.is_file() => {
            let modified = about.modified().ok();
            register.note_input(file_id(about), Input { name: name.to_owned(), modified })
        }
        _ => Ok(()),
    }
}

/// Notes files that will be read, and their sidecars, before any is opened; what does not exist is told when it is.
///
/// # Errors
///
/// As [`note_input`].
pub fn note_inputs<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    paths.into_iter().filter_map(|path| named(Some(path))).try_for_each(|path| note_with_sidecar(path, true))
}

/// Notes a file, and its sidecar, that the first program of the pipe reads: it is not written over, and when it was changed is not
/// asked.
///
/// # Errors
///
/// As [`note_input`].
pub(super) fn note_upstream(path: &Path) -> Result<()> {
    note_with_sidecar(path, false)
}

/// Notes a file and its sidecar, as far as they are there; `counts` says whether it is asked when they were changed.
fn note_with_sidecar(path: &Path, counts: bool) -> Result<()> {
    let noted = |path: &Path| match (&mut *register(), std::fs::metadata(path)) {
        (Some(register), Ok(about)) if about.is_file() => {
            let modified = about.modified().ok().filter(|_| counts);
            register.note_input(file_id(&about), Input { name: path.display().to_string(), modified })
        }
        _ => Ok(()),
    };
    noted(path).and_then(|()| noted(&sidecar_path(path)))
}

/// The name of an input that was changed after `made`, among those whose names are `of_it`.
pub fn changed_after(made: SystemTime, of_it: impl Fn(&str) -> bool) -> Option<String> {
    let register = register();
    let mut inputs = register.iter().flat_map(|register| register.inputs.values());
    let is_newer = |input: &&Input| input.modified.is_some_and(|modified| modified > made) && of_it(&input.name);
    inputs.find(is_newer).map(|input| input.name.clone())
}

/// Notes the sidecar of a frame that is read, whether or not it is looked at.
///
/// # Errors
///
/// As [`note_input`].
pub(super) fn note_sidecar(frame: &Path) -> Result<()> {
    let sidecar = sidecar_path(frame);
    std::fs::metadata(&sidecar).map_or(Ok(()), |about| note_input(&about, &sidecar.display().to_string()))
}

/// Notes that the standard input is read.
///
/// # Errors
///
/// [`Error::Usage`] where it is read already: the second would get what the first has left.
pub(super) fn note_stdin() -> Result<()> {
    let is_read = register().as_mut().is_some_and(|register| std::mem::replace(&mut register.reads_stdin, true));
    if is_read { Err(read_twice()) } else { Ok(()) }
}

/// Makes sure, before it is waited for, that at most one of some inputs is the standard input: `-` or none.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_inputs<'a>(inputs: impl IntoIterator<Item = Option<&'a Path>>) -> Result<()> {
    let from_stdin = inputs.into_iter().filter(|input| named(*input).is_none()).count();
    if from_stdin > 1 { Err(read_twice()) } else { Ok(()) }
}

fn read_twice() -> Error {
    Error::Usage(format!("only one input can be the {STDIN_NAME}; name a file for the others"))
}

/// Makes sure that a file about to be written is none that is read.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_output(about: &Metadata, name: &str) -> Result<()> {
    match &*register() {
        Some(register) if about.is_file() => register.check_output(file_id(about), name),
        _ => Ok(()),
    }
}

/// Makes sure, before any work, that outputs are neither files that are read, then or later, nor one another.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn announce(outputs: &[Option<&Path>]) -> Result<()> {
    let mut places = HashSet::new();
    for output in outputs.iter().filter_map(|path| named(*path)) {
        let name = output.display().to_string();
        if !places.insert(place(Some(output))) {
            return Err(Error::Usage(format!("{name}: two outputs cannot be one file")));
        }
        if let Some(register) = &mut *register()
            && let Ok(about) = std::fs::metadata(output)
            && about.is_file()
        {
            register.check_output(file_id(&about), &name)?;
            register.outputs.push((file_id(&about), name));
        }
    }
    Ok(())
}

/// Notes what makes a result doubtful and was found out too late to refuse it: an image that its sidecar does not describe.
pub(crate) fn doubt(text: String) {
    doubt_alike(None, text);
}

/// Notes the same of what many frames may have in common: of several of a kind the first is told, and how many more there are.
pub(crate) fn doubt_of_frame(kind: String, text: String) {
    doubt_alike(Some(kind), text);
}

fn doubt_alike(kind: Option<String>, text: String) {
    if let Some(register) = &mut *register()
        && !register.doubts.iter().any(|doubt| doubt.texts.contains(&text))
    {
        match register.doubts.iter_mut().find(|doubt| kind.is_some() && doubt.kind == kind) {
            Some(alike) => alike.texts.push(text),
            None => register.doubts.push(Doubt { kind, texts: vec![text] }),
        }
    }
}

/// Whether one of the doubts that came up since is such.
pub(crate) fn has_doubt(is_such: impl Fn(&str) -> bool) -> bool {
    register()
        .as_ref()
        .is_some_and(|register| register.doubts.iter().flat_map(|doubt| &doubt.texts).any(|text| is_such(text)))
}

/// The doubts that came up since the last call, for a program to warn of.
pub fn doubts() -> Vec<String> {
    let doubts = register().as_mut().map(|register| std::mem::take(&mut register.doubts)).unwrap_or_default();
    doubts.into_iter().flat_map(Doubt::told).collect()
}

/// What makes a result doubtful, of one or of several frames alike.
#[derive(Debug)]
struct Doubt {
    kind: Option<String>,
    texts: Vec<String>,
}

impl Doubt {
    /// Each of few; of several the first, and how many more there are.
    fn told(mut self) -> Vec<String> {
        const FEW: usize = 2;
        let more = self.texts.len().saturating_sub(1);
        if more >= FEW {
            // Frames may be read at once.
            self.texts.sort();
            self.texts.truncate(1);
            self.texts.iter_mut().for_each(|text| *text = format!("{text}; so it is in {more} more frames"));
        }
        self.texts
    }
}

impl Register {
    fn note_input(&mut self, id: FileId, input: Input) -> Result<()> {
        if let Some((_, output)) = self.outputs.iter().find(|(output, _)| *output == id) {
            return Err(same_file(output, &input.name));
        }
        self.inputs.entry(id).or_insert(input);
        Ok(())
    }

    fn check_output(&self, id: FileId, name: &str) -> Result<()> {
        self.inputs.get(&id).map_or(Ok(()), |input| Err(same_file(name, &input.name)))
    }
}

/// The complaint about an output that would be written over an input.
fn same_file(output: &str, input: &str) -> Error {
    Error::Usage(format!("{output}: it is the same file as the input {input}; name another output"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_one_doubt_are_counted() {
        let of = |texts: &[&str]| Doubt { kind: None, texts: texts.iter().map(|text| (*text).into()).collect() }.told();
        assert_eq!(of(&["b: full"]), ["b: full"]);
        assert_eq!(of(&["b: full", "a: full"]), ["b: full", "a: full"]);
        assert_eq!(of(&["b: full", "a: full", "c: full"]), ["a: full; so it is in 2 more frames"]);
    }

    #[test]
    fn an_input_is_known_whichever_comes_first() {
        let mut register = Register::default();
        let input = |name: &str| Input { name: name.into(), modified: None };
        register.note_input((1, 1), input("sky.csv")).unwrap();
        register.check_output((1, 2), "out.csv").unwrap();
        let complaint = register.check_output((1, 1), "link.csv").unwrap_err().to_string();
        assert_eq!(complaint, "link.csv: it is the same file as the input sky.csv; name another output");
        register.outputs.push(((1, 3), "plot.svg".into()));
        let complaint = register.note_input((1, 3), input("s.yaml")).unwrap_err().to_string();
        assert_eq!(complaint, "plot.svg: it is the same file as the input s.yaml; name another output");
    }
}
