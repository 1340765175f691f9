//! What of a command line goes into a frame's history.

use crate::metadata::HistoryEntry;
use std::collections::HashSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Options that say where and how the output is stored, how the program talks, or what else it makes: the samples of a frame do not
/// depend on them.
const NOT_RECORDED: [(&str, bool); 14] = [
    ("--output", true),
    ("--output-format", true),
    ("--map", true),
    ("--write-matrix", true),
    ("--write-readout", true),
    ("--format", true),
    ("--compression", true),
    ("--sample-type", true),
    ("--frames", true),
    ("--resume", false),
    ("--threads", true),
    ("--progress", true),
    ("--quiet", false),
    ("--verbose", false),
];

/// A command line as frames remember it, each with its own input.
#[derive(Debug)]
pub(super) struct Signature {
    words: Vec<String>,
    /// The place of the input among them, where there are several.
    place: Option<usize>,
}

impl Signature {
    /// That of some arguments, in which several inputs stand for each.
    pub fn of(arguments: impl Iterator<Item = OsString>, inputs: &[PathBuf]) -> Self {
        let others: HashSet<&Path> =
            if inputs.len() > 1 { inputs.iter().map(PathBuf::as_path).collect() } else { HashSet::new() };
        let (mut words, mut place) = (Vec::new(), None);
        for word in arguments {
            if others.contains(Path::new(&word)) {
                place = place.or(Some(words.len()));
            } else {
                // A file's name may be no UTF-8; the history is.
                words.push(word.to_string_lossy().into_owned());
            }
        }
        Self { words, place }
    }

    /// The entry of a frame that is made of `input`, with what its own arguments would be.
    pub fn entry(&self, program: &str, input: Option<&Path>, own: impl Iterator<Item = String>) -> HistoryEntry {
        let (before, behind) = self.words.split_at(self.place.unwrap_or_default());
        let input = input.filter(|_| self.place.is_some()).map(|path| path.to_string_lossy().into_owned());
        let words = before.iter().cloned().chain(input).chain(behind.iter().cloned());
        history_entry(program, words.chain(own))
    }
}

/// A history entry from a program's arguments.
pub fn history_entry(program: &str, arguments: impl Iterator<Item = String>) -> HistoryEntry {
    let mut recorded = Vec::new();
    let mut skip_value = false;
    for argument in arguments {
        if std::mem::take(&mut skip_value) {
            continue;
        }
        let long = argument.split('=').next().unwrap_or_default();
        if let Some((_, takes_value)) = NOT_RECORDED.iter().find(|(name, _)| *name == long) {
            skip_value = *takes_value && !argument.contains('=');
            continue;
        }
        // Short options: flags q and v, and o with its value attached or next.
        if let Some(letters) = argument.strip_prefix('-').filter(|rest| !rest.is_empty() && !rest.starts_with('-'))
            && letters.trim_start_matches(['q', 'v']).chars().next().is_none_or(|c| c == 'o')
        {
            skip_value = letters.ends_with('o') && letters.trim_start_matches(['q', 'v']) == "o";
            continue;
        }
        recorded.push(argument);
    }
    HistoryEntry { program: program.into(), version: env!("CARGO_PKG_VERSION").into(), arguments: recorded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_the_output_goes_is_not_recorded() {
        let recorded =
            |line: &str| history_entry("add-noise", line.split_whitespace().map(ToOwned::to_owned)).arguments.join(" ");
        assert_eq!(recorded("in.exr --seed 7 -o out.exr"), "in.exr --seed 7");
        assert_eq!(recorded("--output=x.exr --seed=7 -vq -qo y.exr --threads 2"), "--seed=7");
        assert_eq!(recorded("-oout.exr -v - --without ron"), "- --without ron");
        assert_eq!(recorded("--compression zip --exposure -1"), "--exposure -1");
        assert_eq!(recorded("a.exr -1,2,3 --map d.exr --output-format json -o d.json"), "a.exr -1,2,3");
    }

    #[test]
    fn each_of_several_inputs_is_remembered_alone() {
        let line = "--seed 7 a.exr b.exr -o {stem}-n.exr c.exr --frames 3..9 --resume";
        let inputs = ["a.exr", "b.exr", "c.exr"].map(PathBuf::from);
        let signature = Signature::of(line.split_whitespace().map(OsString::from), &inputs);
        let own = ["--frame", "4"].map(ToOwned::to_owned);
        let entry = signature.entry("add-noise", Some(Path::new("b.exr")), own.into_iter());
        assert_eq!(entry.arguments.join(" "), "--seed 7 b.exr --frame 4");
        // One input stays where it stands.
        let signature = Signature::of("--crop 0,0,2,2 a.exr".split_whitespace().map(OsString::from), &inputs[..1]);
        let entry = signature.entry("mosaic", Some(Path::new("a.exr")), std::iter::empty());
        assert_eq!(entry.arguments.join(" "), "--crop 0,0,2,2 a.exr");
    }
}
