//! The bytes of an EXR file on their way, gathered to large writes.

use std::io::{self, Write};

/// Bytes that are gathered: few enough to stay in a level-2 cache.
const CAPACITY: usize = 1 << 17;

/// Gathers what is written, and lets it be made in place.
pub(super) struct WriteBehind<W> {
    inner: W,
    bytes: Vec<u8>,
    filled: usize,
}

impl<W: Write> WriteBehind<W> {
    /// Writes to `inner`.
    pub fn new(inner: W) -> Self {
        Self { inner, bytes: vec![0; CAPACITY], filled: 0 }
    }

    /// Room for the next bytes, at least `least` of them (a few); those that are put there count once they are
    /// [`Self::add`]ed.
    ///
    /// # Errors
    ///
    /// What the output says.
    pub fn room(&mut self, least: usize) -> io::Result<&mut [u8]> {
        if CAPACITY - self.filled < least {
            self.send()?;
        }
        Ok(&mut self.bytes[self.filled..])
    }

    /// Adds so many bytes that were put into the room.
    pub fn add(&mut self, bytes: usize) {
        self.filled += bytes;
    }

    fn send(&mut self) -> io::Result<()> {
        let filled = std::mem::take(&mut self.filled);
        self.inner.write_all(&self.bytes[..filled])
    }

    /// Ends: sends off all bytes, and gives back the output.
    ///
    /// # Errors
    ///
    /// What the output says.
    pub fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        Ok(self.inner)
    }
}

impl<W: Write> Write for WriteBehind<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.len() >= CAPACITY {
            self.send()?;
            return self.inner.write(bytes);
        }
        if bytes.len() > CAPACITY - self.filled {
            self.send()?;
        }
        self.bytes[self.filled..self.filled + bytes.len()].copy_from_slice(bytes);
        self.filled += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.send()?;
        self.inner.flush()
    }
}
