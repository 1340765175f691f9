//! Named files and the standard streams: how messages call them, how they are opened and told apart.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, IsTerminal, Read, Seek};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

/// How messages call the standard input.
pub const STDIN_NAME: &str = "standard input";
/// How messages call the standard output.
pub const STDOUT_NAME: &str = "standard output";

/// Identity of a file: device and inode.
pub type FileId = (u64, u64);

/// The path of a named file; none for `-`, which stands for the standard input or output.
pub fn named(path: Option<&Path>) -> Option<&Path> {
    path.filter(|path| *path != Path::new("-"))
}

/// Device and inode of a file.
pub fn file_id(metadata: &std::fs::Metadata) -> FileId {
    use std::os::unix::fs::MetadataExt;
    (metadata.dev(), metadata.ino())
}

/// The file at a path, so that it is not written over; none for pipes, devices, and what is not there or cannot be looked
/// at, which opening it will tell.
pub fn regular_file(path: &Path) -> Option<(FileId, String)> {
    let metadata = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    Some((file_id(&metadata), path.display().to_string()))
}

/// Opens a named file.
///
/// # Errors
///
/// [`Error::Disk`], and [`Error::Format`] for directories.
fn open_path(path: &Path) -> Result<File> {
    let name = path.display().to_string();
    let failed = |e| Error::disk(&name, "open", e);
    let file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.is_dir() {
        return Err(Error::format(&name, "it is a directory; name a file in it"));
    }
    Ok(file)
}

/// The standard input as a file.
///
/// # Errors
///
/// [`Error::Usage`] when it is a terminal, [`Error::Disk`].
fn open_stdin() -> Result<File> {
    let stdin = io::stdin();
    if stdin.is_terminal() {
        return Err(Error::Usage("no input: name a file, or pipe one in".into()));
    }
    let owned = stdin.as_fd().try_clone_to_owned().map_err(|e| Error::disk(STDIN_NAME, "open", e))?;
    Ok(File::from(owned))
}

/// Opens a named file, or the standard input where there is none. Gives the name for messages too.
///
/// # Errors
///
/// [`Error::Disk`]; [`Error::Format`] for directories; [`Error::Usage`] for a terminal, which would be waited on.
pub fn open_named(path: Option<&Path>) -> Result<(File, String)> {
    Ok(match path {
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

/// `frame.exr` → `frame.exr.yaml`.
pub fn sidecar_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".yaml");
    PathBuf::from(name)
}

/// The complaint about an output that would be written over its input.
pub fn same_file(output: &str, input: &str) -> Error {
    Error::Usage(format!("{output}: it is the same file as the input {input}; name another output"))
}

/// Reads a whole small file.
///
/// # Errors
///
/// [`Error::Disk`], [`Error::Format`] for directories, and as [`read_table`].
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    read_table(open_path(path)?, &path.display().to_string())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_never_ends_is_not_read_for_ever() {
        let complaint = read_file(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(complaint.contains("longer than 256 MiB"), "{complaint}");
    }
}
