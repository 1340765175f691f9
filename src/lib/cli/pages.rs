//! What the front door tells: what is known by name, the keys of files, and files to begin with.

use super::show;
use crate::error::{Error, Result};
use crate::formats::inventory::{self, Kind};
use crate::formats::keys::{KeyPage, tables};
use crate::names::Named;
use std::ffi::OsString;
use std::io::Write;

/// Lists what is known by name: of the kinds that `words` name, or of all.
///
/// # Errors
///
/// [`Error::Usage`] for other words; [`Error::Disk`] where the list cannot be written.
pub fn list(words: &[OsString]) -> Result<()> {
    let kinds = named::<Kind>("list", words)?;
    let kinds = if kinds.is_empty() { Kind::ALL.to_vec() } else { kinds };
    write(&kinds.into_iter().map(inventory::page).collect::<Vec<_>>().join("\n"))
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
