//! Free space, looked at before what has no room is begun: a disk that is full ends other programs too.

use crate::error::{Error, Result};
use crate::text::bytes_in_words;
use std::fs::File;
use std::io;
use std::path::Path;

/// Refuses an output of `bytes` in an open file, and so many `others` of as much, where its file system has less free. Pipes, devices, and file systems that do not say
/// how large they are have room for all.
///
/// # Errors
///
/// [`Error::Disk`] naming the bytes that are needed and those that are free.
pub fn check(file: &File, name: &str, bytes: u64, others: u64) -> Result<()> {
    let is_regular = file.metadata().is_ok_and(|about| about.is_file());
    let all = bytes.saturating_mul(others.saturating_add(1));
    refuse_beyond(name, (all, others), is_regular.then(|| system::free(file)).flatten())
}

/// The same of files in a directory.
///
/// # Errors
///
/// As of [`check`].
pub fn check_directory(directory: &Path, name: &str, bytes: u64) -> Result<()> {
    refuse_beyond(name, (bytes, 0), File::open(directory).ok().and_then(|file| system::free(&file)))
}

fn refuse_beyond(name: &str, (bytes, others): (u64, u64), free: Option<u64>) -> Result<()> {
    match free.filter(|free| bytes > *free) {
        Some(free) => {
            let [mut needed, mut there] = [bytes, free].map(bytes_in_words);
            if needed == there {
                (needed, there) = (format!("{bytes} bytes"), free.to_string());
            }
            let takes = match others {
                0 => "it takes".to_owned(),
                1 => "with the other that follows it takes".to_owned(),
                others => format!("with the {others} others that follow it takes"),
            };
            let problem =
                format!("{takes} {needed}, and {there} are free there; write elsewhere, smaller or compressed");
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
        assert!(check(&file, "a", 1, 0).is_ok() && check_directory(directory.path(), "a", 1).is_ok());
        // No file system is so large.
        for refused in [check(&file, "a", u64::MAX, 0), check_directory(directory.path(), "a", u64::MAX)] {
            if cfg!(target_os = "linux") {
                let refused = refused.unwrap_err().to_string();
                let begin = "a: cannot write: it takes more than 18.4 EB, and ";
                assert!(
                    refused.starts_with(begin)
                        && refused.ends_with(" are free there; write elsewhere, smaller or compressed"),
                    "{refused}"
                );
            }
        }
        assert!(check(&File::open("/dev/null").unwrap(), "a", u64::MAX, 0).is_ok());
        // As much as is free, for each of two.
        if let Some(free) = system::free(&file) {
            let refused = check(&file, "a", free / 2 + free / 4, 1).unwrap_err().to_string();
            assert!(refused.contains("cannot write: with the other that follows it takes "), "{refused}");
        }
    }
}
