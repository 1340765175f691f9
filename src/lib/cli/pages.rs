//! What the front door tells: what is known by name, the keys of files, and files to begin with.

use super::show;
use crate::error::{Error, Result};
use crate::formats::inventory::{self, Kind};
use crate::formats::keys::KeyPage;
use crate::names::Named;
use std::ffi::OsString;
use std::io::Write;

/// Lists what is known by name: of the kinds that `words` begin with, or of all; where other words follow, that of which these
/// are told.
///
/// # Errors
///
/// [`Error::Usage`] where the first word is another; [`Error::Disk`] where the list cannot be written.
pub fn list(words: &[OsString]) -> Result<()> {
    let is_kind = |word: &OsString| word.to_str().and_then(Kind::named).is_some();
    let count = words.iter().position(|word| !is_kind(word)).unwrap_or(words.len()).max(words.len().min(1));
    let (kinds, words) = words.split_at(count);
    let kinds = named::<Kind>("list", kinds)?;
    let kinds = if kinds.is_empty() { Kind::ALL.to_vec() } else { kinds };
    let words: Vec<String> = words.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    write(&kinds.into_iter().map(|kind| inventory::page(kind, &words)).collect::<Vec<_>>().join("\n"))
}

/// Describes the keys of files: of the kinds that `words` begin with, or of all; where other words follow, those in whose paths one of
/// these stands.
///
/// # Errors
///
/// [`Error::Usage`] where there are none; [`Error::Disk`] where they cannot be written.
pub fn keys(words: &[OsString]) -> Result<()> {
    let words: Vec<String> = words.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    let count = words.iter().position(|word| KeyPage::named(word).is_none()).unwrap_or(words.len());
    let (pages, words) = words.split_at(count);
    let pages: Vec<KeyPage> = pages.iter().filter_map(|page| KeyPage::named(page)).collect();
    let wanted = if pages.is_empty() { KeyPage::ALL } else { &pages };
    let text: Vec<String> = wanted.iter().filter_map(|page| page.table_of(words)).collect();
    if !text.is_empty() {
        return write(&text.join("\n"));
    }
    let asked = words.join("`, `");
    let known = match pages[..] {
        [page] => format!("there is no key `{asked}` in such files; `cyanometer keys {}` describes all", page.name()),
        _ => format!("keys knows no `{asked}`; name one of {}, or a part of a key", known::<KeyPage>()),
    };
    let is_one = |word: &&String| inventory::known(Kind::Sensors).iter().any(|one| one.name.eq_ignore_ascii_case(word));
    let sensor = words.iter().find(is_one);
    let sensor =
        sensor.map_or(String::new(), |name| format!("; `cyanometer list sensors {name}` tells of that sensor"));
    Err(Error::Usage(known + &sensor))
}

/// Prints a file to begin with, of the one kind that `words` name.
///
/// # Errors
///
/// As [`list`].
pub fn template(words: &[OsString]) -> Result<()> {
    match named::<KeyPage>("template", words)?[..] {
        [page] => write(page.template()),
        _ => {
            let kinds = known::<KeyPage>();
            Err(Error::Usage(format!(
                "template prints one file; name one of {kinds}, as in `cyanometer template sensor`"
            )))
        }
    }
}

/// The values that words name.
fn named<T: Named>(what: &str, words: &[OsString]) -> Result<Vec<T>> {
    let value = |word: &OsString| {
        let found = word.to_str().and_then(T::named);
        found.ok_or_else(|| {
            Error::Usage(format!("{what} knows no `{}`; name one of {}", word.to_string_lossy(), known::<T>()))
        })
    };
    words.iter().map(value).collect()
}

fn known<T: Named>() -> String {
    T::ALL.iter().map(|value| value.name()).collect::<Vec<_>>().join(", ")
}

fn write(text: &str) -> Result<()> {
    show(|| std::io::stdout().write_all(text.as_bytes()))
}
