//! The bytes of a file or stream, with a look at those to come.

use std::io::{self, Read, Seek, SeekFrom};

/// Bytes that are held: four rows of three planes of f32, 2700 columns wide; few enough to stay in a level-2 cache.
const CAPACITY: usize = 1 << 17;

/// A block that takes more is held all the same, up to this: a row of 471 bands of a wide spectral image.
const LARGEST: usize = 1 << 24;

/// Reads a file or stream through a buffer that whole blocks can be looked at in before they are taken.
pub struct ReadAhead<R> {
    inner: R,
    bytes: Vec<u8>,
    /// The bytes that are held and not taken yet.
    start: usize,
    end: usize,
}

/// What comes from another program.
pub type Pipe = ReadAhead<Box<dyn Read + Send>>;

impl Pipe {
    /// What comes of any stream.
    pub fn of(inner: impl Read + Send + 'static) -> Self {
        Self::new(Box::new(inner))
    }
}

impl<R: Read> ReadAhead<R> {
    /// Bytes of `inner` from where it stands.
    pub fn new(inner: R) -> Self {
        Self { inner, bytes: vec![0; CAPACITY], start: 0, end: 0 }
    }

    /// The next bytes, whole blocks of `block` bytes, at most `blocks`: those that are at hand; where none is, those that come
    /// with it, in as many reads as the first needs. None where the stream ends before, where reading fails, or where a block
    /// is larger than 16 MiB.
    ///
    /// They stay to be taken, by [`Self::skip`] or by reading them, which meets again, and then tells, what failed.
    pub fn peek(&mut self, block: usize, blocks: usize) -> &[u8] {
        if self.end - self.start < block {
            if self.bytes.len() < block && block <= LARGEST {
                self.bytes.resize(block, 0);
            }
            let wanted = (self.bytes.len() / block).min(blocks) * block;
            self.bytes.copy_within(self.start..self.end, 0);
            (self.start, self.end) = (0, self.end - self.start);
            while self.end < block.min(wanted) {
                match self.inner.read(&mut self.bytes[self.end..wanted]) {
                    Ok(0) => break,
                    Ok(read) => self.end += read,
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => break,
                }
            }
        }
        let whole = ((self.end - self.start) / block).min(blocks) * block;
        &self.bytes[self.start..self.start + whole]
    }

    /// The next bytes, at most `most` and fewer only where the stream ends; they stay to be taken.
    ///
    /// # Errors
    ///
    /// What the stream says.
    pub fn head(&mut self, most: usize) -> io::Result<&[u8]> {
        let most = most.min(CAPACITY);
        if self.end - self.start < most {
            self.bytes.copy_within(self.start..self.end, 0);
            (self.start, self.end) = (0, self.end - self.start);
        }
        while self.end - self.start < most {
            match self.inner.read(&mut self.bytes[self.end..]) {
                Ok(0) => break,
                Ok(read) => self.end += read,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(&self.bytes[self.start..self.end.min(self.start + most)])
    }

    /// What is read, where it stands behind the bytes that are held.
    pub fn into_inner(self) -> R {
        self.inner
    }

    /// Takes bytes that were looked at.
    pub fn skip(&mut self, bytes: usize) {
        self.start += bytes;
    }
}

impl<R: Read + Seek> ReadAhead<R> {
    /// Goes forth or back by `delta` bytes. Forth within what is held costs nothing; all else drops what is held.
    ///
    /// # Errors
    ///
    /// What the file says.
    pub fn seek_relative(&mut self, delta: i64) -> io::Result<()> {
        let held = self.end - self.start;
        match usize::try_from(delta) {
            Ok(forth) if forth <= held => self.start += forth,
            _ => {
                self.inner.seek(SeekFrom::Current(delta - held as i64))?;
                (self.start, self.end) = (0, 0);
            }
        }
        Ok(())
    }

    /// Where the next byte stands in the file.
    ///
    /// # Errors
    ///
    /// What the file says.
    pub fn stream_position(&mut self) -> io::Result<u64> {
        Ok(self.inner.stream_position()? - (self.end - self.start) as u64)
    }
}

impl<R: Read> Read for ReadAhead<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.start == self.end {
            if buffer.len() >= CAPACITY {
                return self.inner.read(buffer);
            }
            self.start = 0;
            self.end = self.inner.read(&mut self.bytes)?;
        }
        let count = buffer.len().min(self.end - self.start);
        buffer[..count].copy_from_slice(&self.bytes[self.start..self.start + count]);
        self.start += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a few bytes at a time, as a pipe may.
    struct Trickle<R>(R);

    impl<R: Read> Read for Trickle<R> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let count = buffer.len().min(7);
            self.0.read(&mut buffer[..count])
        }
    }

    #[test]
    fn blocks_come_whole_and_what_is_left_is_read_as_it_is() {
        let bytes: Vec<u8> = (0..=255).cycle().take(3 * CAPACITY + 5).collect();
        for (trickles, block) in [(false, 1000), (true, 1000), (false, CAPACITY + 9), (true, CAPACITY + 9)] {
            let inner: Box<dyn Read> =
                if trickles { Box::new(Trickle(bytes.as_slice())) } else { Box::new(bytes.as_slice()) };
            let mut reader = ReadAhead::new(inner);
            let mut seen = vec![0; 3];
            reader.read_exact(&mut seen).unwrap();
            loop {
                let blocks = reader.peek(block, 9);
                assert!(blocks.len().is_multiple_of(block) && blocks.len() <= 9 * block);
                seen.extend_from_slice(blocks);
                let taken = blocks.len();
                if taken == 0 {
                    break;
                }
                reader.skip(taken);
            }
            assert!(reader.peek(LARGEST + 1, 1).is_empty(), "a block that is too large to be held");
            reader.read_to_end(&mut seen).unwrap();
            assert!(seen == bytes);
        }
    }

    #[test]
    fn it_goes_forth_and_back() {
        let bytes: Vec<u8> = (0..4 * CAPACITY).map(|at| u8::try_from(at % 251).unwrap()).collect();
        let mut reader = ReadAhead::new(io::Cursor::new(&bytes));
        let mut at = 0_i64;
        for delta in [5, 100, CAPACITY as i64, -7, 0, -(CAPACITY as i64), 2 * CAPACITY as i64] {
            reader.seek_relative(delta).unwrap();
            at += delta;
            assert_eq!(reader.stream_position().unwrap(), at.cast_unsigned());
            let mut byte = [0];
            reader.read_exact(&mut byte).unwrap();
            assert_eq!(i64::from(byte[0]), at % 251);
            at += 1;
        }
    }
}
