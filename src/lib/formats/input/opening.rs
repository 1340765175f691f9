//! Which reader opens a file: by its first bytes, and by whether it can seek.

use crate::error::{Error, Result};
use crate::formats::files::{STDIN_NAME, spool};
use crate::formats::format::{HEAD_BYTES, Opened, Readers, Streaming};
use crate::formats::places::in_stream;
use crate::formats::read_ahead::Pipe;
use crate::formats::{keys, pipe, table, tiff};
use crate::text::counted;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Whether an open file is one that can seek, and no pipe.
pub(super) fn is_file(input: &File, name: &str) -> Result<bool> {
    Ok(input.metadata().map_err(|e| Error::disk(name, "read", e))?.is_file())
}

/// Opens a part of a file or stream, or, where that may be, the single one of a file that has no others.
pub(super) fn open_part(input: File, name: &str, part: usize, or_single: bool) -> Opened {
    match is_file(&input, name)? {
        false => open_unseekable(input, name, part),
        true if or_single => open_part_or_single(input, name, part),
        true => open_seekable(input, name, part),
    }
}

/// Opens a file that can seek with the reader of its format.
fn open_seekable(mut input: File, name: &str, part: usize) -> Opened {
    let failed = |e| Error::disk(name, "read", e);
    let start = input.stream_position().map_err(failed)?;
    let head = head_of(&mut input, name)?;
    let readers = readers_of(&head, name)?;
    input.seek(SeekFrom::Start(start)).map_err(failed)?;
    open_whole(readers, &head, input, name, part)
}

/// The same of a part that is there, or of the single one of a file that has no others: averages of exposures, say, of which each was
/// a part of its file.
fn open_part_or_single(mut input: File, name: &str, part: usize) -> Opened {
    let failed = |e| Error::disk(name, "read", e);
    let start = input.stream_position().map_err(failed)?;
    let mut open = |part: usize| {
        // Copies of an open file share the place that is read next.
        input.seek(SeekFrom::Start(start)).map_err(failed)?;
        open_seekable(input.try_clone().map_err(failed)?, name, part)
    };
    let is_missing = |opened: &Opened| matches!(opened, Err(Error::Usage(_)));
    let opened = open(part);
    if is_missing(&opened) && (part == 1 || is_missing(&open(1))) { open(0) } else { opened }
}

/// Opens a stream.
fn open_unseekable(input: File, name: &str, part: usize) -> Opened {
    pipe::enlarge(&input);
    open_piped(Pipe::of(input), name, part)
}

/// Opens a stream with the reader of its format. One that cannot be read without seeking is first copied to a temporary
/// file.
pub(super) fn open_piped(mut input: Pipe, name: &str, part: usize) -> Opened {
    let head = input.head(HEAD_BYTES).map_err(|e| Error::disk(name, "read", e))?.to_vec();
    check_begun(&head, name)?;
    let readers = readers_of(&head, name)?;
    let is_streamed = |stream: &Streaming| (stream.is_streamable)(&head) && !(stream.has_parts && part != 0);
    if let Some(stream) = readers.stream.filter(is_streamed) {
        if part != 0 {
            return Err(Error::Usage(format!("{name}: it has no part {part}; it has a single one")));
        }
        return (stream.open)(input, name);
    }
    let spooled = spool(&mut input, name)?;
    open_whole(readers, &head, spooled, name, part)
}

/// Opens a file that begins with `head` with these readers, or, where its tags call for them, with others.
fn open_whole(readers: Readers, head: &[u8], input: File, name: &str, part: usize) -> Opened {
    let narrower = if tiff::begins_so(head) { table::by_tags(&input, name)? } else { None };
    (narrower.unwrap_or(readers).open)(input, name, part)
}

/// The first bytes, by which most formats are known.
pub(super) fn head_of(input: &mut File, name: &str) -> Result<Vec<u8>> {
    let mut head = Vec::new();
    input.take(HEAD_BYTES as u64).read_to_end(&mut head).map_err(|e| Error::disk(name, "read", e))?;
    check_begun(&head, name)?;
    Ok(head)
}

/// Makes sure that something comes.
fn check_begun(head: &[u8], name: &str) -> Result<()> {
    if !head.is_empty() {
        return Ok(());
    }
    if name == STDIN_NAME && pipe::has_failed() {
        return Err(Error::Upstream);
    }
    let hint = if name == STDIN_NAME { "; the program before it wrote nothing" } else { "" };
    Err(Error::format(name, format!("it is empty{hint}")))
}

/// An error in reading a stream, which is not worth telling where the program before has failed in the midst of a frame.
pub(super) fn of_upstream(error: Error, name: &str) -> Error {
    let is_told = matches!(error, Error::Format { .. }) && in_stream(name) == STDIN_NAME && pipe::has_failed();
    if is_told { Error::Upstream } else { error }
}

/// The readers of what a file begins as.
pub(super) fn readers_of(head: &[u8], name: &str) -> Result<Readers> {
    table::by_head(head, name)?.ok_or_else(|| {
        let hint = if head.len() < 8 {
            format!("; it has {} and no more", counted(head.len() as u64, "bytes"))
        } else if is_text(head) {
            text_hint(name)
        } else if head.starts_with(b"\x93NUMPY") {
            "; it is an array of NumPy, a headerless frame behind 128 bytes mostly".into()
        } else {
            String::new()
        };
        Error::format(name, format!("it is neither {} file{hint}", table::names_of_read()))
    })
}

/// What a text is that was taken for a frame: one of our YAML files, by what a named file says, or, as it may be, a spectrum.
fn text_hint(name: &str) -> String {
    /// What tells the kind of a file stands near its beginning.
    const LOOKED_AT: u64 = 1 << 16;
    if let Some(frame) = name.strip_suffix(".yaml").filter(|frame| Path::new(frame).is_file()) {
        return format!("; it holds the metadata of `{frame}`: name that");
    }
    let read = || -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        File::open(name)?.take(LOOKED_AT).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let is_file = std::fs::metadata(name).is_ok_and(|about| about.is_file());
    // What cannot be read again is told as any other text.
    let bytes = if is_file { read().unwrap_or_default() } else { Vec::new() };
    match keys::kind_of(&String::from_utf8_lossy(&bytes)) {
        Some(kind) => format!("; it is {kind}"),
        None => "; it looks like text (a spectrum goes into `render-radiance`)".into(),
    }
}

/// Whether bytes are the beginning of a text, the last character perhaps cut off.
fn is_text(head: &[u8]) -> bool {
    let whole = match std::str::from_utf8(head) {
        Ok(text) => text,
        Err(cut) if cut.error_len().is_none() => std::str::from_utf8(&head[..cut.valid_up_to()]).unwrap_or_default(),
        Err(_) => return false,
    };
    whole.chars().all(|character| !character.is_control() || character.is_whitespace())
}
