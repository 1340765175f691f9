//! What the front door tells: what is known by name, the keys of files, and files to begin with.

use super::show;
use crate::error::{Error, Result};
use crate::formats::inventory::{self, Kind};
use crate::formats::keys::{KeyPage, tables};
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

/// Describes the keys of files: of the kinds that `words` name, or of all.
///
/// # Errors
///
/// As [`list`].
pub fn keys(words: &[OsString]) -> Result<()> {
    let pages = named::<KeyPage>("keys", words)?;
    let text = pages.iter().map(|page| page.table()).collect::<Vec<_>>().join("\n");
    write(if pages.is_empty() { tables() } else { text }.as_str())
}

/// Prints a file to begin with, of the one kind that `words` name.
///
/// # Errors
///
/// As [`list`].
pub fn template(words: &[OsString]) -> Result<()> {
    match named::<KeyPage>("template", words)?[..] {
        [page] => write(page.template()),
        _ => Err(Error::Usage(format!("template prints one file; name one of {}", known::<KeyPage>()))),
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
