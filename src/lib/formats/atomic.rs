//! Outputs that are whole or not at all.
//!
//! A named file is written beside its target and renamed when complete; on an error or an interrupt nothing is left.
//! Devices, named pipes and the standard output are written as they are.

use super::files::{FileId, STDOUT_NAME, file_id, same_file};
use super::pipe;
use crate::error::{Error, Result};
use std::fs::{File, OpenOptions, Permissions};
use std::io::{self, BufWriter, IsTerminal, Read, Seek, SeekFrom, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use tempfile::{NamedTempFile, TempPath};

/// Temporary files to remove when the program is interrupted.
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes what is half-written; for the handler of interrupts, which then ends the program.
pub fn remove_pending() {
    if let Ok(pending) = PENDING.lock() {
        for path in pending.iter() {
            // The file may be gone already; there is nobody left to tell.
            drop(std::fs::remove_file(path));
        }
    }
}

/// A named file that gets its name when it is complete.
#[derive(Debug)]
pub struct AtomicFile {
    output: BufWriter<File>,
    temporary: TempPath,
    target: PathBuf,
}

impl AtomicFile {
    /// Opens a temporary file beside `target`; a symbolic link is followed.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`] when the directory is missing or cannot be written.
    pub fn create(target: &Path) -> Result<Self> {
        let name = target.display().to_string();
        let resolved = std::fs::canonicalize(target).unwrap_or_else(|_| target.to_owned());
        if resolved.is_dir() {
            return Err(Error::format(&name, "it is a directory; name a file in it"));
        }
        let directory = match resolved.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        if !directory.is_dir() {
            return Err(Error::format(
                &name,
                format!("there is no directory `{}`; make it first", directory.display()),
            ));
        }
        let permissions = std::fs::metadata(&resolved).map_or(Permissions::from_mode(0o666), |m| m.permissions());
        let temporary: NamedTempFile = tempfile::Builder::new()
            .prefix(".cyanometer-")
            .permissions(permissions)
            .tempfile_in(&directory)
            .map_err(|e| Error::disk(&name, "write", plain(&e)))?;
        let (file, temporary) = temporary.into_parts();
        if let Ok(mut pending) = PENDING.lock() {
            pending.push(temporary.to_path_buf());
        }
        Ok(Self { output: BufWriter::with_capacity(1 << 16, file), temporary, target: resolved })
    }

    /// Gives the file its name.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`]; nothing is left behind then.
    pub fn commit(mut self) -> Result<()> {
        let name = self.target.display().to_string();
        self.output.flush().map_err(|e| Error::disk(&name, "write", e))?;
        let temporary = self.temporary.to_path_buf();
        self.temporary.persist(&self.target).map_err(|e| Error::disk(&name, "write", e.error))?;
        if let Ok(mut pending) = PENDING.lock() {
            pending.retain(|path| *path != temporary);
        }
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.output.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}

/// The system's error without the temporary file's name, which means nothing to the user.
fn plain(error: &io::Error) -> io::Error {
    error.raw_os_error().map_or_else(|| io::Error::from(error.kind()), io::Error::from_raw_os_error)
}

/// Where the bytes of a frame go.
#[derive(Debug)]
pub struct Target {
    name: String,
    path: Option<PathBuf>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// A regular file, named when complete.
    Named(AtomicFile),
    /// Bytes that leave at once, in order.
    Stream(BufWriter<File>),
    /// Bytes that must be complete before they leave, in a temporary file without a name.
    Spooled { spool: BufWriter<File>, output: File },
}

impl Target {
    /// Opens `path`, or the standard output where there is none. A stream is spooled when the writer needs to seek.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] when the output is a terminal or one of the files `inputs`; [`Error::Disk`].
    pub fn open(path: Option<&Path>, needs_seek: bool, inputs: &[(FileId, String)]) -> Result<Self> {
        let name = path.map_or_else(|| STDOUT_NAME.to_owned(), |path| path.display().to_string());
        let check = |metadata: &std::fs::Metadata| match inputs.iter().find(|(id, _)| *id == file_id(metadata)) {
            Some((_, input)) => Err(same_file(&name, input)),
            None => Ok(()),
        };
        let output = match path {
            None => {
                let stdout = io::stdout();
                if stdout.is_terminal() {
                    return Err(Error::Usage(
                        "a frame is binary and does not go to a terminal; pipe it on, or name a file with -o".into(),
                    ));
                }
                File::from(stdout.as_fd().try_clone_to_owned().map_err(|e| Error::disk(&name, "open", e))?)
            }
            Some(path) => {
                // What cannot be looked at cannot be written either, which is told when that is tried.
                let existing = std::fs::metadata(path).ok();
                existing.as_ref().map_or(Ok(()), check)?;
                if existing.is_none_or(|metadata| metadata.is_file() || metadata.is_dir()) {
                    let file = AtomicFile::create(path)?;
                    return Ok(Self { name, path: Some(path.to_owned()), kind: Kind::Named(file) });
                }
                OpenOptions::new().write(true).open(path).map_err(|e| Error::disk(&name, "open", e))?
            }
        };
        let about = output.metadata().map_err(|e| Error::disk(&name, "open", e))?;
        if about.is_file() {
            check(&about)?;
        }
        let kind = if needs_seek {
            let spool = tempfile::tempfile().map_err(|e| Error::disk(&name, "write", e))?;
            Kind::Spooled { spool: BufWriter::with_capacity(1 << 16, spool), output }
        } else {
            pipe::enlarge(&output);
            Kind::Stream(BufWriter::with_capacity(1 << 16, output))
        };
        Ok(Self { name, path: None, kind })
    }

    /// The output as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The regular file that is being written, if it is one.
    pub fn named_file(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Sends off what is spooled, gives a file its name.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn commit(self) -> Result<()> {
        let failed = |e| Error::disk(&self.name, "write", e);
        match self.kind {
            Kind::Named(file) => file.commit(),
            Kind::Stream(mut output) => output.flush().map_err(failed),
            Kind::Spooled { spool, mut output } => {
                let copy = || -> io::Result<()> {
                    let mut spool = spool.into_inner()?;
                    spool.seek(SeekFrom::Start(0))?;
                    let mut buffer = vec![0; 1 << 16];
                    loop {
                        match spool.read(&mut buffer)? {
                            0 => return output.flush(),
                            count => output.write_all(&buffer[..count])?,
                        }
                    }
                };
                copy().map_err(failed)
            }
        }
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.kind {
            Kind::Named(file) => file.write(bytes),
            Kind::Stream(output) | Kind::Spooled { spool: output, .. } => output.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::Named(file) => file.flush(),
            Kind::Stream(output) | Kind::Spooled { spool: output, .. } => output.flush(),
        }
    }
}

impl Seek for Target {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.kind {
            Kind::Named(file) => file.output.seek(to),
            Kind::Spooled { spool, .. } => spool.seek(to),
            Kind::Stream(_) => Err(io::Error::from(io::ErrorKind::NotSeekable)),
        }
    }
}
