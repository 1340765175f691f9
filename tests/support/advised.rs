//! Whether what programs say names options that they have: looked at in whatever any test makes them say.

use super::workshop::{path_of, programs};
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use std::sync::{Mutex, OnceLock, PoisonError};

/// What installations ask every program for, and the other name of --cfa; no help lists them.
pub const UNLISTED: [&str; 4] = ["manual", "completions", "summary", "pattern"];

/// The long options of a program, as its help lists them; none of what is no program of ours.
pub fn options_of(program: &str) -> Option<BTreeSet<String>> {
    static KNOWN: OnceLock<Mutex<BTreeMap<String, BTreeSet<String>>>> = OnceLock::new();
    if !programs().iter().any(|known| known == program) {
        return None;
    }
    let mut known = KNOWN.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = known.get(program) {
        return Some(found.clone());
    }
    let help = Command::new(path_of(program)).arg("--help").output().unwrap().stdout;
    let help = String::from_utf8(help).unwrap();
    let names = help.lines().filter_map(|line| {
        let line = line.trim_start();
        let long = line.strip_prefix('-')?.split_once("--").map(|(_, long)| long).or(line.strip_prefix("--"))?;
        Some(long.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).next()?.to_owned())
    });
    let found: BTreeSet<String> = names.collect();
    known.insert(program.to_owned(), found.clone());
    Some(found)
}

/// The long options that a text names.
pub fn named(text: &str) -> Vec<String> {
    let words = text.split(|c: char| c.is_whitespace() || "`,;()[]|='\"".contains(c));
    let long = words.filter_map(|word| word.strip_prefix("--"));
    long.map(|name| name.trim_end_matches(['.', ':', '?']).to_owned()).filter(|name| !name.is_empty()).collect()
}

/// An option that a message of a program names and that this, or the one whose command it quotes, has not; with that program.
pub fn wrong_option(program: &str, message: &str) -> Option<(String, String)> {
    let is_there = |program: &str, name: &String| {
        UNLISTED.contains(&name.as_str()) || options_of(program).is_none_or(|known| known.contains(name))
    };
    let of_quoted = message.split('`').skip(1).step_by(2).find_map(|quoted| {
        let other = quoted.split(' ').next()?;
        let name = named(quoted).into_iter().find(|name| !is_there(other, name))?;
        Some((other.to_owned(), name))
    });
    let outside = message.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    // `it is a matrix file, for --matrix`: of whatever program.
    let outside = outside.split(", for --").enumerate().map(|(index, part)| match index {
        0 => part,
        _ => part.split_once([';', ',', ' ']).map_or("", |(_, rest)| rest),
    });
    let outside = outside.collect::<Vec<_>>().join(" ");
    let own = || named(&outside).into_iter().find(|name| !is_there(program, name));
    of_quoted.or_else(|| own().map(|name| (program.to_owned(), name)))
}

/// Looks at all that a program said on its standard error.
#[track_caller]
pub fn check(line: &str, said: &str) {
    let program = line.split(' ').next().unwrap_or_default();
    for message in said.lines().filter_map(|message| message.strip_prefix(&format!("{program}: "))) {
        if let Some((of, name)) = wrong_option(program, message) {
            panic!("{line}: it names --{name}, which {of} does not have: {message}");
        }
    }
}
