//! Free space, looked at before what has no room is begun: a disk that is full ends other programs too.

use crate::error::{Error, Result};
use std::fs::File;
use std::io;
use std::path::Path;

/// Refuses an output of `bytes` in an open file where its file system has less free. Pipes, devices, and file systems that do not say
/// how large they are have room for all.
///
/// # Errors
///
/// [`Error::Disk`] naming the bytes that are needed and those that are free.
pub fn check(file: &File, name: &str, bytes: u64) -> Result<()> {
    let is_regular = file.metadata().is_ok_and(|about| about.is_file());
    refuse_beyond(name, bytes, is_regular.then(|| system::free(file)).flatten())
}

/// The same of files in a directory.
///
/// # Errors
///
/// As of [`check`].
pub fn check_directory(directory: &Path, name: &str, bytes: u64) -> Result<()> {
    refuse_beyond(name, bytes, File::open(directory).ok().and_then(|file| system::free(&file)))
}

fn refuse_beyond(name: &str, bytes: u64, free: Option<u64>) -> Result<()> {
    match free.filter(|free| bytes > *free) {
        Some(free) => {
            let problem =
                format!("it takes {bytes} bytes, and {free} are free there; write it elsewhere, smaller or compressed");
            Err(Error::disk(name, "write", io::Error::new(io::ErrorKind::StorageFull, problem)))
        }
        None => Ok(()),
    }
}

#[cfg(target_os = "linux")]
mod system {
    use std::fs::File;

    /// Bytes that the file system of an open file has free for such as have no privileges; none where it does not say.
    pub fn free(file: &File) -> Option<u64> {
        let about = rustix::fs::fstatvfs(file).ok().filter(|about| about.f_blocks > 0)?;
        Some(about.f_bavail.saturating_mul(about.f_frsize))
    }
}

/// On other systems nobody is asked.
#[cfg(not(target_os = "linux"))]
mod system {
    use std::fs::File;

    pub fn free(_: &File) -> Option<u64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_is_free_is_refused_and_pipes_are_not_asked() {
        let directory = tempfile::tempdir().unwrap();
        let file = File::create(directory.path().join("a")).unwrap();
        assert!(check(&file, "a", 1).is_ok() && check_directory(directory.path(), "a", 1).is_ok());
        // No file system is so large.
        for refused in [check(&file, "a", u64::MAX), check_directory(directory.path(), "a", u64::MAX)] {
            if cfg!(target_os = "linux") {
                let refused = refused.unwrap_err().to_string();
                let begin = format!("a: cannot write: it takes {} bytes, and ", u64::MAX);
                assert!(
                    refused.starts_with(&begin) && refused.ends_with("; write it elsewhere, smaller or compressed"),
                    "{refused}"
                );
            }
        }
        assert!(check(&File::open("/dev/null").unwrap(), "a", u64::MAX).is_ok());
    }
}
