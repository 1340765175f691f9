//! What programs say beside their output.

use crate::text::one_line;
use std::io::Write;

/// Writes one line to the standard error.
pub(super) fn complain(program: &str, text: &str) {
    // In one piece, so that the lines of several programs do not mix. Where the standard error is closed there is nobody to tell.
    let line = format!("{program}: {}\n", one_line(text));
    drop(std::io::stderr().write_all(line.as_bytes()));
}
