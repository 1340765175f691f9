//! Wildcards that no shell has expanded: in quotes, for more files than a command line holds.

use clap::{ArgAction, Command};
use std::ffi::OsString;
use std::path::Path;

/// The words of a command line where each name of a file that is read, and that holds `*`, `?` or `[`, is replaced by those of the
/// files that match, in the order of their names, as a shell does. What is a file's own name, or matches none, stays as it is.
///
/// Inputs are expanded, and options that may be given more than once, which then are; `**` goes through directories.
pub(super) fn expanded(words: impl Iterator<Item = OsString>, command: &Command) -> Vec<OsString> {
    let mut found = Vec::new();
    let mut words = words;
    while let Some(word) = words.next() {
        let text = word.to_str().unwrap_or_default();
        if text == "--" {
            found.push(word);
            words.by_ref().for_each(|rest| found.extend(files(rest)));
            break;
        }
        let (name, value) = text.split_once('=').map_or((text, None), |(name, value)| (name, Some(value)));
        match Kind::of(name, command) {
            Kind::Flag => found.push(word),
            Kind::Repeated(option) => {
                let values = value.map(OsString::from).or_else(|| words.next());
                values.into_iter().flat_map(files).for_each(|file| found.extend([option.clone(), file]));
            }
            Kind::Single => {
                found.push(word.clone());
                found.extend(if value.is_none() { words.next() } else { None });
            }
            Kind::Word => found.extend(files(word)),
        }
    }
    found
}

/// What a word of a command line is.
enum Kind {
    /// No option.
    Word,
    /// An option without a value, or with one that is part of it.
    Flag,
    /// An option with a value.
    Single,
    /// One that may be given more than once, which names files.
    Repeated(OsString),
}

impl Kind {
    fn of(word: &str, command: &Command) -> Self {
        let option = match (word.strip_prefix("--"), word.strip_prefix('-')) {
            (Some(long), _) => command.get_arguments().find(|argument| argument.get_long() == Some(long)),
            (None, Some(short)) if short.chars().count() == 1 => {
                command.get_arguments().find(|argument| argument.get_short() == short.chars().next())
            }
            (None, Some(short)) if !short.is_empty() => return Self::Flag,
            // A single dash is the standard input.
            _ => return Self::Word,
        };
        let Some(option) = option else { return Self::Flag };
        let names_files =
            option.get_value_names().is_some_and(|names| names.iter().any(|name| name.as_str() == "FILE"));
        let needs_equals = option.is_require_equals_set();
        match option.get_action() {
            ArgAction::Append if names_files => Self::Repeated(word.into()),
            ArgAction::Append | ArgAction::Set if !needs_equals => Self::Single,
            _ => Self::Flag,
        }
    }
}

/// The files that a name stands for.
fn files(word: OsString) -> Vec<OsString> {
    let pattern = word.to_str().filter(|text| text.contains(['*', '?', '[']) && !Path::new(text).exists());
    let options = glob::MatchOptions { require_literal_leading_dot: true, ..glob::MatchOptions::new() };
    let matched = pattern.and_then(|pattern| glob::glob_with(pattern, options).ok());
    let names: Vec<OsString> = matched.into_iter().flatten().flatten().map(OsString::from).collect();
    if names.is_empty() { vec![word] } else { names }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;

    #[test]
    fn names_are_expanded_where_files_are_read() {
        let directory = tempfile::tempdir().unwrap();
        let place = |name: &str| directory.path().join(name).display().to_string();
        for name in ["b.exr", "a.exr", ".c.exr", "d.tif", "odd[1].tif"] {
            std::fs::write(place(name), "").unwrap();
        }
        let option = |long: &'static str, action| Arg::new(long).long(long).action(action).value_name("FILE");
        let command = Command::new("x")
            .arg(Arg::new("inputs").action(ArgAction::Append))
            .arg(option("dark", ArgAction::Append))
            .arg(option("output", ArgAction::Set).short('o'));
        let of = |words: &[&str]| -> Vec<String> {
            let found = expanded(words.iter().map(OsString::from), &command);
            found.into_iter().map(|word| word.into_string().unwrap()).collect()
        };
        let all = place("*.exr");
        let [a, b] = [place("a.exr"), place("b.exr")];
        assert_eq!(of(&[&all, "-"]), [&a, &b, "-"]);
        assert_eq!(of(&["--dark", &all, &b]), ["--dark", &a, "--dark", &b, &b]);
        assert_eq!(of(&[&format!("--dark={all}")]), ["--dark", &a, "--dark", &b]);
        // What is written is no file that is read.
        assert_eq!(of(&["-o", &all, "--output", &all]), ["-o", &all, "--output", &all]);
        assert_eq!(of(&["-v", "--", &all]), ["-v", "--", &a, &b]);
        // A file's own name, and what matches none.
        assert_eq!(of(&[&place("odd[1].tif"), &place("*.png")]), [place("odd[1].tif"), place("*.png")]);
    }
}
