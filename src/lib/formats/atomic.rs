//! Outputs that are whole or not at all.
//!
//! A named file is written beside its target without a name, and gets one when it is complete: whatever ends the program, the
//! system takes the rest away. Where a file system knows no files without names, it is written under a temporary one, which
//! an error or a signal removes. Devices, named pipes and the standard output are written as they are.

use super::places::{STDOUT_NAME, named};
use super::standard::open_stdout;
use super::{free_space, pipe, register};
use crate::error::{Error, Result};
use std::fs::{File, OpenOptions, Permissions};
use std::io::{self, BufWriter, IsTerminal, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use tempfile::TempPath;

/// Temporary names to remove when the program is ended. Whoever makes one holds the lock until it stands here, and whoever
/// gives files their names holds it until all have them, so that a signal comes before or after.
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Held by whoever makes a file in a directory that has no name of its own yet, one file at a time, and by whoever ends the program.
static FILLING: Mutex<()> = Mutex::new(());

/// What temporary names begin with.
const PREFIX: &str = ".cyanometer-";

/// Lets a file be made in an [`AtomicDirectory`]: none is any more once a signal has come, or the directory would be filled while it
/// is removed, and stay. To be held for one file at a time, as a signal waits for it.
pub fn filling() -> MutexGuard<'static, ()> {
    FILLING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is half-written, for whoever ends the program at a signal; waits until files that are complete have their
/// names, and lets none be made any more.
pub fn remove_pending() {
    let filling = filling();
    let pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
    remove(&pending);
    // Held until the program has ended.
    std::mem::forget((filling, pending));
}

/// The same after a panic, which may have come while files got their names: then they get them.
pub fn remove_pending_now() {
    match PENDING.try_lock() {
        Ok(pending) => remove(&pending),
        Err(TryLockError::Poisoned(pending)) => remove(&pending.into_inner()),
        Err(TryLockError::WouldBlock) => {}
    }
}

fn remove(pending: &[PathBuf]) {
    for path in pending {
        // It may be gone already; there is nobody left to tell.
        drop(std::fs::remove_file(path).or_else(|_| std::fs::remove_dir_all(path)));
    }
}

/// Where an output goes that will be called `target`, symbolic links followed, and the directory that it is in.
fn place_of(target: &Path, name: &str) -> Result<(PathBuf, PathBuf)> {
    let resolved = std::fs::canonicalize(target).unwrap_or_else(|_| target.to_owned());
    let directory = match resolved.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    if directory.is_dir() {
        return Ok((resolved, directory));
    }
    Err(Error::format(name, format!("there is no directory `{}`; make it first", directory.display())))
}

/// A named file that gets its name when it is complete.
#[derive(Debug)]
pub struct AtomicFile {
    output: BufWriter<File>,
    /// The name that the file has meanwhile, where it must have one.
    temporary: Option<TempPath>,
    directory: PathBuf,
    target: PathBuf,
    name: String,
}

impl AtomicFile {
    /// Opens a file beside `target`; a symbolic link is followed.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`] when the directory is missing or cannot be written, [`Error::Usage`] when the target is read.
    pub fn create(target: &Path) -> Result<Self> {
        Self::begin(target, nameless::create)
    }

    /// The same, with a way to make files that have no name.
    fn begin(target: &Path, nameless: impl FnOnce(&Path, u32) -> Option<File>) -> Result<Self> {
        let name = target.display().to_string();
        let existing = std::fs::metadata(target).ok();
        existing.as_ref().map_or(Ok(()), |about| register::check_output(about, &name))?;
        if target.is_dir() {
            return Err(Error::format(&name, "it is a directory; name a file in it"));
        }
        if name.ends_with('/') {
            return Err(Error::format(&name, "there is no directory of this name, and a file is wanted; name one"));
        }
        let (resolved, directory) = place_of(target, &name)?;
        let permissions = existing.map_or(Permissions::from_mode(0o666), |about| about.permissions());
        let (file, temporary) = match nameless(&directory, permissions.mode()) {
            Some(file) => (file, None),
            None => create_temporary(&directory, permissions)
                .map(|(file, path)| (file, Some(path)))
                .map_err(|e| Error::disk(&name, "write", plain(&e)))?,
        };
        Ok(Self { output: BufWriter::with_capacity(1 << 16, file), temporary, directory, target: resolved, name })
    }

    /// The file as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Gives the file its name.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`]; nothing is left behind then.
    pub fn commit(self) -> Result<()> {
        Self::commit_all([self])
    }

    /// Gives files their names, one right after the other; a signal comes before the first or after the last.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`]; files that have no name yet are not left behind.
    pub fn commit_all(files: impl IntoIterator<Item = Self>) -> Result<()> {
        let mut files: Vec<Self> = files.into_iter().collect();
        for file in &mut files {
            file.output.flush().map_err(|e| Error::disk(&file.name, "write", e))?;
        }
        let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        for file in files {
            let Self { output, temporary, directory, target, name } = file;
            let named = match temporary {
                Some(temporary) => {
                    pending.retain(|path| *path != *temporary);
                    temporary.persist(&target).map_err(|e| e.error)
                }
                None => nameless::give_name(output.get_ref(), &directory, &target),
            };
            named.map_err(|e| Error::disk(&name, "write", plain(&e)))?;
        }
        Ok(())
    }
}

/// A directory that gets its name when all in it is complete.
#[derive(Debug)]
pub struct AtomicDirectory {
    /// The name that it has meanwhile; none once it has its own.
    temporary: Option<PathBuf>,
    target: PathBuf,
    name: String,
}

impl AtomicDirectory {
    /// Makes a directory beside `target`; a symbolic link is followed.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`] and [`Error::Format`] where there is no place for it.
    pub fn create(target: &Path) -> Result<Self> {
        let name = target.display().to_string();
        let (target, directory) = place_of(target, &name)?;
        let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        let permissions = Permissions::from_mode(0o777);
        let made = tempfile::Builder::new().prefix(PREFIX).permissions(permissions).tempdir_in(directory);
        let temporary = made.map_err(|e| Error::disk(&name, "write", plain(&e)))?.keep();
        pending.push(temporary.clone());
        Ok(Self { temporary: Some(temporary), target, name })
    }

    /// Where it is while it is filled.
    pub fn path(&self) -> &Path {
        self.temporary.as_deref().unwrap_or(&self.target)
    }

    /// The directory as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Gives it its name; what has that name already is removed.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`]; nothing is left behind then.
    pub fn commit(mut self) -> Result<()> {
        let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(temporary) = self.temporary.take() else { return Ok(()) };
        let is_there = self.target.symlink_metadata().is_ok();
        let named =
            if is_there { exchange(&temporary, &self.target) } else { std::fs::rename(&temporary, &self.target) };
        // Under the temporary name is now what was there before, or what could not get its name.
        if is_there || named.is_err() {
            drop(std::fs::remove_dir_all(&temporary));
        }
        pending.retain(|path| *path != temporary);
        named.map_err(|e| Error::disk(&self.name, "write", plain(&e)))
    }
}

impl Drop for AtomicDirectory {
    fn drop(&mut self) {
        let Some(temporary) = self.temporary.take() else { return };
        let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        // What cannot be removed is told by its name.
        drop(std::fs::remove_dir_all(&temporary));
        pending.retain(|path| *path != temporary);
    }
}

/// Exchanges the names of two directories: at once where the system can.
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        if renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).is_ok() {
            return Ok(());
        }
    }
    let directory = other.parent().unwrap_or(Path::new("."));
    let aside = tempfile::Builder::new().prefix(PREFIX).tempdir_in(directory)?;
    let kept = aside.path().join("kept");
    std::fs::rename(other, &kept)?;
    std::fs::rename(one, other)?;
    std::fs::rename(&kept, one)
}

/// A file with a temporary name in a directory.
fn create_temporary(directory: &Path, permissions: Permissions) -> io::Result<(File, TempPath)> {
    let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
    let made = tempfile::Builder::new().prefix(PREFIX).permissions(permissions).tempfile_in(directory)?;
    pending.push(made.path().to_path_buf());
    Ok(made.into_parts())
}

/// Files that have no name while they are written.
#[cfg(target_os = "linux")]
mod nameless {
    use super::PREFIX;
    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, open};
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::{Path, PathBuf};

    /// A file without a name in a directory; none where the file system has no such files, or where no name could be given
    /// to it.
    pub fn create(directory: &Path, mode: u32) -> Option<File> {
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        let file = File::from(open(directory, flags, Mode::from_raw_mode(mode)).ok()?);
        place_of(&file).symlink_metadata().ok()?;
        Some(file)
    }

    /// Where the system shows an open file.
    fn place_of(file: &File) -> PathBuf {
        PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()))
    }

    /// Gives a file its name. What has that name already is replaced by way of a temporary one.
    pub fn give_name(file: &File, directory: &Path, target: &Path) -> io::Result<()> {
        let link =
            |path: &Path| linkat(CWD, place_of(file), CWD, path, AtFlags::SYMLINK_FOLLOW).map_err(io::Error::from);
        match link(target) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                let temporary = tempfile::Builder::new().prefix(PREFIX).make_in(directory, link)?.into_temp_path();
                temporary.persist(target).map_err(|error| error.error)
            }
            done => done,
        }
    }
}

/// Files that have no name while they are written: there are none on this system.
#[cfg(not(target_os = "linux"))]
mod nameless {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    pub fn create(_: &Path, _: u32) -> Option<File> {
        None
    }

    pub fn give_name(_: &File, _: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
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

/// The system's error without the temporary file's name, which means nothing to the user. Where that is wrapped around it, its number
/// stands in the text alone.
fn plain(error: &io::Error) -> io::Error {
    let in_text = || {
        let text = error.to_string();
        let (_, number) = text.split_once("(os error ")?;
        number.split_once(')')?.0.parse().ok()
    };
    error.raw_os_error().or_else(in_text).map_or_else(|| io::Error::from(error.kind()), io::Error::from_raw_os_error)
}

fn binary_to_terminal(path: Option<&Path>) -> Error {
    let problem = "a frame or a picture is binary and does not go to a terminal; pipe it on, or name a file with -o";
    Error::Usage(match named(path) {
        Some(path) => format!("{}: {problem}", path.display()),
        None => problem.into(),
    })
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
    /// Opens `path`, or the standard output for `-` or none. A stream is spooled when the writer needs to seek.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] when the output is a terminal or a file that is read; [`Error::Disk`].
    pub fn open(path: Option<&Path>, needs_seek: bool) -> Result<Self> {
        let target = Self::open_any(path, needs_seek)?;
        match &target.kind {
            Kind::Stream(output) if output.get_ref().is_terminal() => Err(binary_to_terminal(path)),
            Kind::Spooled { output, .. } if output.is_terminal() => Err(binary_to_terminal(path)),
            _ => Ok(target),
        }
    }

    /// Opens the output for a text, which may go to a terminal.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], terminals apart.
    pub fn open_text(path: &Path) -> Result<Self> {
        Self::open_any(Some(path), false)
    }

    fn open_any(path: Option<&Path>, needs_seek: bool) -> Result<Self> {
        let path = named(path);
        let name = path.map_or_else(|| STDOUT_NAME.to_owned(), |path| path.display().to_string());
        let output = match path {
            None => open_stdout()?,
            Some(path) => {
                // What cannot be looked at cannot be written either, which is told when that is tried.
                let existing = std::fs::metadata(path).ok();
                if existing.is_none_or(|about| about.is_file() || about.is_dir()) {
                    let file = AtomicFile::create(path)?;
                    return Ok(Self { name, path: Some(path.to_owned()), kind: Kind::Named(file) });
                }
                OpenOptions::new().write(true).open(path).map_err(|e| Error::disk(&name, "open", e))?
            }
        };
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

    /// Refuses an output of so many bytes, and as many `others` beside it, where a file that it goes to has no room for all.
    ///
    /// # Errors
    ///
    /// Those of [`free_space::check`].
    pub fn check_room(&self, bytes: u64, others: u64) -> Result<()> {
        let check = |file: &File| free_space::check(file, &self.name, bytes, others);
        match &self.kind {
            Kind::Named(file) => check(file.output.get_ref()),
            Kind::Stream(output) => check(output.get_ref()),
            Kind::Spooled { spool, output } => check(spool.get_ref()).and_then(|()| check(output)),
        }
    }

    /// Sends off what is spooled, gives a file its name.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn commit(self) -> Result<()> {
        self.commit_with(None)
    }

    /// The same; a file and its sidecar get their names together.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`].
    pub fn commit_with(self, sidecar: Option<AtomicFile>) -> Result<()> {
        let failed = |e| Error::disk(&self.name, "write", e);
        match self.kind {
            Kind::Named(file) => AtomicFile::commit_all(std::iter::once(file).chain(sidecar)),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// File systems without files that have no name are not at hand everywhere.
    #[test]
    fn a_temporary_name_serves_where_files_need_one() {
        let directory = tempfile::tempdir().unwrap();
        let target = directory.path().join("out.exr");
        let names = || {
            let entries = std::fs::read_dir(directory.path()).unwrap();
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect::<Vec<_>>()
        };
        for round in 0..2 {
            let mut file = AtomicFile::begin(&target, |_, _| None).unwrap();
            file.write_all(&[round]).unwrap();
            assert!(names().iter().any(|name| name.starts_with(PREFIX)), "{:?}", names());
            assert!(PENDING.lock().unwrap().iter().any(|path| path.parent() == Some(directory.path())));
            file.commit().unwrap();
            assert_eq!((names(), std::fs::read(&target).unwrap()), (vec!["out.exr".to_owned()], vec![round]));
            assert!(!PENDING.lock().unwrap().iter().any(|path| path.parent() == Some(directory.path())));
        }
        drop(AtomicFile::begin(&target, |_, _| None).unwrap());
        assert_eq!((names(), std::fs::read(&target).unwrap()), (vec!["out.exr".to_owned()], vec![1]));
    }

    /// While a thread makes files in it, and the directories on the way, as one that writes a stack does until the program has ended.
    #[test]
    fn a_directory_goes_while_it_is_being_filled() {
        use std::sync::atomic::{AtomicBool, Ordering};
        for _ in 0..20 {
            let directory = tempfile::tempdir().unwrap();
            let filled = directory.path().join("filled");
            let (ends, begun) = (AtomicBool::new(false), std::sync::Barrier::new(2));
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    let fill = |index: u32| {
                        let _one = filling();
                        std::fs::create_dir_all(filled.join("part")).unwrap();
                        std::fs::write(filled.join("part").join(index.to_string()), [0]).unwrap();
                    };
                    (0..50).for_each(fill);
                    begun.wait();
                    (50..).take_while(|_| !ends.load(Ordering::Relaxed)).for_each(fill);
                });
                begun.wait();
                let stopped = filling();
                remove(std::slice::from_ref(&filled));
                std::thread::sleep(std::time::Duration::from_millis(1));
                let is_there = filled.exists();
                ends.store(true, Ordering::Relaxed);
                drop(stopped);
                assert!(!is_there);
            });
        }
    }

    #[test]
    fn a_file_has_no_name_before_it_is_whole() {
        let directory = tempfile::tempdir().unwrap();
        let entries = || std::fs::read_dir(directory.path()).unwrap().count();
        if nameless::create(directory.path(), 0o666).is_none() {
            // This file system has no such files.
            return;
        }
        let target = directory.path().join("out.exr");
        for before in [0, 1] {
            let mut file = AtomicFile::create(&target).unwrap();
            file.write_all(&[before]).unwrap();
            assert_eq!(entries(), usize::from(before));
            file.commit().unwrap();
            assert_eq!((entries(), std::fs::read(&target).unwrap()), (1, vec![before]));
        }
    }
}
