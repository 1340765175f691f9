//! The makers' own raw formats (NEF, CR2, CR3, ARW, RAF, ORF, RW2, PEF …), decoded by the crate `rawler` in a process of its own.
//!
//! `rawler` panics, aborts and takes memory on the word of damaged files. So a program that reads such a file starts itself
//! once more: the child, whose `main` begins with [`serve`], limits its own memory and time, reads the file from its standard
//! input, and hands back a head and rows of 16 bits; it opens nothing and writes to no file. The program believes nothing of it:
//! sizes, areas and levels are checked as those of any file, and whatever becomes of the child is one line about the file.
//!
//! `rawler` is LGPL-2.1; without the feature `makers-raw` nothing here is linked with it, and the files are refused.

#[cfg(feature = "makers-raw")]
mod child;
mod complete;
#[cfg(feature = "makers-raw")]
mod decode;
mod describe;
mod read;
mod wire;
mod worker;

pub use read::MakersReader;
pub use worker::Worker;

use std::process::ExitCode;

/// The first argument of a child, followed by what it is given.
const SERVE: &str = "@decode-for-parent";

/// What to do about a file that is not decoded.
const INSTEAD: &str = "convert it to DNG, or write its codes as a TIFF with `unprocessed_raw -T` of LibRaw";

/// The work of a child, where this process is one; none where it is a program that a user has started. Called first of all in
/// the `main` of a program that has a [`Worker`].
pub fn serve() -> Option<ExitCode> {
    let mut words = std::env::args_os().skip(1);
    if words.next().is_none_or(|word| word != SERVE) {
        return None;
    }
    #[cfg(feature = "makers-raw")]
    return Some(child::work(words));
    #[cfg(not(feature = "makers-raw"))]
    None
}
