//! Named files and the standard input: how they are opened and read.

pub use super::places::{STDIN_NAME, STDOUT_NAME, named, sidecar_path};

use super::places::is_stack;
use super::register;
use super::standard::open_stdin;
use crate::error::{Error, Result};
use crate::names::nearest;
use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;

/// Opens a named file.
///
/// # Errors
///
/// [`Error::Disk`], [`Error::Format`] for directories, and [`Error::Usage`] for a file that will be written.
fn open_path(path: &Path) -> Result<File> {
    let name = path.display().to_string();
    let failed = |e| Error::disk(&name, "open", e);
    let file = File::open(path).map_err(failed)?;
    let about = file.metadata().map_err(failed)?;
    if about.is_dir() && is_stack(path) {
        let problem =
            "it is a stack of frames; `stack-frames` takes them out, as in `stack-frames NAME.zarr | measure`";
        return Err(Error::format(&name, problem));
    }
    if about.is_dir() {
        return Err(Error::format(&name, "it is a directory; name a file in it"));
    }
    register::note_input(&about, &name)?;
    Ok(file)
}

/// Opens a named file, or the standard input for `-` or none. Gives the name for messages too.
///
/// # Errors
///
/// [`Error::Disk`]; [`Error::Format`] for directories; [`Error::Usage`] for a terminal, which would be waited on, for a
/// standard input that is read already, and for a file that will be written.
pub fn open_named(path: Option<&Path>) -> Result<(File, String)> {
    Ok(match named(path) {
        Some(path) => (open_path(path)?, path.display().to_string()),
        None => (open_stdin()?, STDIN_NAME.to_owned()),
    })
}

/// Copies a stream to a temporary file and stands at its start.
///
/// # Errors
///
/// [`Error::Disk`].
pub fn spool(stream: &mut impl Read, name: &str) -> Result<File> {
    let mut copied = || -> io::Result<File> {
        let mut copy = tempfile::tempfile()?;
        io::copy(stream, &mut copy)?;
        copy.rewind()?;
        Ok(copy)
    };
    copied().map_err(|e| Error::disk(name, "copy to a temporary file", e))
}

/// Reads a whole small file; `-` is the standard input.
///
/// # Errors
///
/// As [`open_named`] and [`read_table`].
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    let (file, name) = open_named(Some(path))?;
    read_table(file, &name)
}

/// A digest of a small file; none of one that cannot be read.
pub fn digest_of(path: &Path) -> Option<String> {
    read_file(path).ok().map(|bytes| format!("blake3:{}", blake3::hash(&bytes).to_hex()))
}

/// Reads what is small to its end, but no more than a table can be: a device may never end.
///
/// # Errors
///
/// [`Error::Disk`]; [`Error::Format`] when there is more.
pub fn read_table(input: impl Read, name: &str) -> Result<Vec<u8>> {
    /// A table may be this long.
    const MAX_BYTES: u64 = 256 << 20;
    let mut bytes = Vec::new();
    input.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|e| Error::disk(name, "read", e))?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(Error::format(name, "it is longer than 256 MiB; no table is"));
    }
    Ok(bytes)
}

/// What may be meant by the name of a file that is not there: the file in the same directory whose name is nearest; of a link where it leads.
pub fn hint_of_missing(path: &Path) -> Option<String> {
    if let Ok(target) = path.read_link() {
        return Some(format!("it is a link to `{}`, which is not there", target.display()));
    }
    /// A letter for so many may be off, and so many of an ending.
    const LETTERS: usize = 5;
    const ENDING: usize = 4;
    /// So many files are looked at.
    const LOOKED_AT: usize = 10_000;
    let typed = path.file_name()?.to_str()?;
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let files = directory.unwrap_or(Path::new(".")).read_dir().ok()?.take(LOOKED_AT).flatten();
    let mut names: Vec<String> = files.filter_map(|file| file.file_name().into_string().ok()).collect();
    names.retain(|name| name != typed);
    names.sort_unstable();
    let is_same_stem = |known: &str| Path::new(known).file_stem() == path.file_stem();
    let farthest = |known: &str| if is_same_stem(known) { ENDING } else { known.len().min(typed.len()) / LETTERS };
    // A frame with metadata beside it rather than a picture of it.
    let has_metadata = |name: &str| is_same_stem(name) && names.binary_search(&format!("{name}.yaml")).is_ok();
    let frames: Vec<&str> = names.iter().map(String::as_str).filter(|name| has_metadata(name)).collect();
    let known = if frames.is_empty() { names.iter().map(String::as_str).collect() } else { frames };
    let near = nearest(typed, known, farthest)?;
    Some(format!("did you mean `{}`?", path.with_file_name(near).display()))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn what_never_ends_is_not_read_for_ever() {
        let complaint = read_file(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(complaint.contains("longer than 256 MiB"), "{complaint}");
    }

    #[test]
    fn a_file_that_is_not_there_may_be_another() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["clear_zenith.csv", "a.exr", "b.exr"] {
            std::fs::write(directory.path().join(name), "").unwrap();
        }
        let told = |name: &str| hint_of_missing(&directory.path().join(name));
        let wanted = format!("did you mean `{}`?", directory.path().join("clear_zenith.csv").display());
        assert_eq!(told("clear_zenit.csv"), Some(wanted));
        assert!(["a.ex", "a.tiff"].iter().all(|name| told(name).unwrap().ends_with("a.exr`?")));
        for name in ["m.png", "m.tiff", "m.tiff.yaml"] {
            std::fs::write(directory.path().join(name), "").unwrap();
        }
        assert!(told("m.exr").unwrap().ends_with("m.tiff`?"));
        // One of the same stem, though another's name is nearer.
        std::fs::write(directory.path().join("clear"), "").unwrap();
        assert!(told("clear_zenith").unwrap().ends_with("clear_zenith.csv`?"));
        assert_eq!([told("hazy.csv"), told("dark.exr"), told("nodir/a.exr")], [None, None, None]);
    }

    /// Bytes as a file that stands at its start, or as what comes down a pipe, which holds them.
    pub(in crate::formats) fn of_bytes(bytes: &[u8], piped: bool) -> File {
        if piped {
            let (output, mut input) = io::pipe().unwrap();
            input.write_all(bytes).unwrap();
            return File::from(std::os::fd::OwnedFd::from(output));
        }
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        file.rewind().unwrap();
        file
    }
}
