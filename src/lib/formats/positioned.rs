//! A file that is read from a place of its own, so that several readers may share it.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::FileExt;

/// A file, and where it is read; where the system's own mark stands does not matter, and does not move.
pub struct Positioned {
    file: File,
    at: u64,
}

impl Positioned {
    /// From where the file stands.
    ///
    /// # Errors
    ///
    /// What the file says.
    pub fn of(mut file: File) -> io::Result<Self> {
        let at = file.stream_position()?;
        Ok(Self { file, at })
    }

    /// The file.
    pub fn into_file(self) -> File {
        self.file
    }
}

impl Read for Positioned {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read_at(buffer, self.at)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for Positioned {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let from = |base: u64, delta: i64| base.checked_add_signed(delta).ok_or(io::ErrorKind::InvalidInput);
        self.at = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(delta) => from(self.at, delta)?,
            SeekFrom::End(delta) => from(self.file.metadata()?.len(), delta)?,
        };
        Ok(self.at)
    }
}
