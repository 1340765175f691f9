//! The headers of an EXR as bytes, so that too many attributes are refused before any is made much of: each takes some
//! hundreds of bytes once it is told apart, however few it has in the file.

use crate::error::{Error, Result};
use std::io::{self, ErrorKind, Read};

/// So many attributes may the headers of a file have together.
const MOST: usize = 1 << 16;
/// The longest name or type.
const LONGEST_NAME: usize = 255;
/// Magic number, version and flags.
const HEAD_BYTES: u64 = 8;
/// The flag of files of several parts, in the sixth byte.
const SEVERAL_PARTS: u8 = 0x10;

/// The bytes of all headers. Where they make no sense it stops, and who reads them meets that again.
///
/// # Errors
///
/// [`Error::Format`] for too many attributes, [`Error::Disk`] where reading fails.
pub(super) fn headers(input: &mut impl Read, name: &str) -> Result<Vec<u8>> {
    let mut headers = Headers { input, bytes: Vec::new() };
    match headers.walk() {
        Ok(count) if count > MOST => {
            Err(Error::format(name, format!("its headers have more than {MOST} attributes; no image's have")))
        }
        Ok(_) => Ok(headers.bytes),
        Err(error) if matches!(error.kind(), ErrorKind::UnexpectedEof | ErrorKind::InvalidData) => Ok(headers.bytes),
        Err(error) => Err(Error::disk(name, "read", error)),
    }
}

/// What has been read.
struct Headers<'a, R> {
    input: &'a mut R,
    bytes: Vec<u8>,
}

impl<R: Read> Headers<'_, R> {
    /// Reads header by header; gives the number of attributes, or one that is too large.
    fn walk(&mut self) -> io::Result<usize> {
        self.take(HEAD_BYTES)?;
        let has_several = self.bytes[5] & SEVERAL_PARTS != 0;
        let mut count = 0;
        loop {
            let before = count;
            while count <= MOST && self.text()? > 0 {
                self.text()?;
                self.take(4)?;
                let size = self.bytes.last_chunk().map_or(-1, |size| i32::from_le_bytes(*size));
                self.take(u64::try_from(size).map_err(|_| ErrorKind::InvalidData)?)?;
                count += 1;
            }
            // Behind the last of several headers comes an empty one.
            if !has_several || count == before || count > MOST {
                return Ok(count);
            }
        }
    }

    /// Reads so many bytes.
    fn take(&mut self, bytes: u64) -> io::Result<()> {
        let read = self.input.take(bytes).read_to_end(&mut self.bytes)?;
        if read as u64 == bytes { Ok(()) } else { Err(ErrorKind::UnexpectedEof.into()) }
    }

    /// Reads a text and the NUL behind it; gives its length.
    fn text(&mut self) -> io::Result<usize> {
        for length in 0..=LONGEST_NAME {
            self.take(1)?;
            if self.bytes.last() == Some(&0) {
                return Ok(length);
            }
        }
        Err(ErrorKind::InvalidData.into())
    }
}
