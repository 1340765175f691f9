//! Rows of plain pictures, as frames of codes are: one channel, not interlaced, a single picture. libdeflate inflates such a picture at once.
//!
//! What is out of the ordinary, damage above all, is left to the crate `png`, which begins again and says what is wrong. So whatever is
//! read here must be whole: all that the crate holds against a file is held against it here too. libdeflate alone takes a few codes that no
//! stream may have; but then the sum behind the stream must be that of the picture, and the crate does not look at that.

use super::DEFLATE_EXPANSION;
use crate::numerics::vectors::{self, Kernel};
use flate2::Crc;
use libdeflater::Decompressor;
use std::cell::RefCell;
use std::fs::File;
use std::mem;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The checksum of a chunk, and the length and kind of the next.
const BETWEEN: usize = 12;
/// What a picture may take, packed and inflated each.
const PICTURE_BYTES: usize = 64 << 20;
/// What all pictures may take that are being read, and the buffers that are kept for the next.
const ALL_BYTES: usize = 128 << 20;
/// Buffers that are kept at most.
const KEPT: usize = 64;

/// What is left to the crate.
#[derive(Debug, PartialEq, Eq)]
pub struct Unusual;

/// Reads rows of 8 or 16 bits.
pub struct PlainRows {
    /// Where the file has the first chunk of data, of `length` bytes, and all behind it.
    data: Range<u64>,
    length: usize,
    /// That of a row, with the byte that names its filter.
    row_bytes: usize,
    sample_bytes: usize,
    height: usize,
    rows_read: usize,
    /// All rows, with the bytes that name their filters; none before the first is read and once the last is.
    picture: Option<Buffer>,
}

impl PlainRows {
    /// Rows, so many of so many samples, of a file that has its first chunk of data, of `length` bytes, and all behind it in such a place.
    pub fn new([width, height]: [usize; 2], sample_bytes: usize, data: Range<u64>, length: u64) -> Self {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let row_bytes = width.saturating_mul(sample_bytes).saturating_add(1);
        Self { data, length, row_bytes, sample_bytes, height, rows_read: 0, picture: None }
    }

    /// Appends the next rows.
    ///
    /// # Errors
    ///
    /// Where anything is out of the ordinary.
    pub fn read(&mut self, file: &File, rows: usize, samples: &mut Vec<f32>) -> Result<(), Unusual> {
        let mut picture = match self.picture.take() {
            Some(picture) => picture,
            None => self.inflate(file)?,
        };
        let all = picture.first(self.row_bytes * self.height)?;
        // Of the first row all above is 0.
        let zeros = if self.rows_read == 0 { vec![0; self.row_bytes] } else { Vec::new() };
        for _ in 0..rows {
            let (before, rest) = all.split_at_mut_checked(self.rows_read * self.row_bytes).ok_or(Unusual)?;
            let above = before.rchunks(self.row_bytes).next().unwrap_or(&zeros);
            let (filter, row) = rest.get_mut(..self.row_bytes).and_then(<[u8]>::split_first_mut).ok_or(Unusual)?;
            undo(*filter, row, &above[1..], self.sample_bytes)?;
            vectors::run(Widen { row, sample_bytes: self.sample_bytes, samples });
            self.rows_read += 1;
        }
        if self.rows_read < self.height {
            self.picture = Some(picture);
        }
        Ok(())
    }

    fn inflate(&self, file: &File) -> Result<Buffer, Unusual> {
        thread_local! {
            static DECOMPRESSOR: RefCell<Decompressor> = RefCell::new(Decompressor::new());
        }
        if self.rows_read > 0 {
            return Err(Unusual);
        }
        let packed_bytes = of_picture(usize::try_from(self.data.end.saturating_sub(self.data.start)).ok())?;
        let inflated_bytes = of_picture(self.row_bytes.checked_mul(self.height))?;
        let mut packed = Buffer::of(packed_bytes)?;
        let packed = packed.first(packed_bytes)?;
        file.read_exact_at(packed, self.data.start).map_err(|_| Unusual)?;
        let gathered = gather(packed, self.length)?;
        // A header's word alone takes no memory.
        if inflated_bytes as u64 > gathered as u64 * DEFLATE_EXPANSION {
            return Err(Unusual);
        }
        let mut picture = Buffer::of(inflated_bytes)?;
        let inflated = picture.first(inflated_bytes)?;
        let inflate =
            |inflater: &RefCell<Decompressor>| inflater.borrow_mut().zlib_decompress(&packed[..gathered], inflated);
        if DECOMPRESSOR.with(inflate) == Ok(inflated_bytes) { Ok(picture) } else { Err(Unusual) }
    }
}

/// So many bytes, if a picture may take them.
fn of_picture(bytes: Option<usize>) -> Result<usize, Unusual> {
    bytes.filter(|bytes| *bytes <= PICTURE_BYTES).ok_or(Unusual)
}

/// Moves the data of chunks, the first of which has so many, together to the front; tells how many they are in all.
fn gather(bytes: &mut [u8], mut length: usize) -> Result<usize, Unusual> {
    let (mut at, mut gathered) = (0, 0);
    loop {
        let end = length.checked_add(at).ok_or(Unusual)?;
        let behind = bytes.get(end..).and_then(<[u8]>::first_chunk::<BETWEEN>).ok_or(Unusual)?;
        let [sum, next, kind] = [0, 4, 8].map(|at| u32::from_be_bytes(std::array::from_fn(|i| behind[at + i])));
        let mut wanted = Crc::new();
        wanted.update(b"IDAT");
        wanted.update(&bytes[at..end]);
        if sum != wanted.sum() {
            return Err(Unusual);
        }
        if at > gathered {
            bytes.copy_within(at..end, gathered);
        }
        gathered += length;
        if kind.to_be_bytes() != *b"IDAT" {
            return Ok(gathered);
        }
        at = end + BETWEEN;
        length = usize::try_from(next).map_err(|_| Unusual)?;
    }
}

/// Bytes that count among those of all pictures, and are kept for the next.
struct Buffer(Vec<u8>);

impl Buffer {
    /// So many bytes at least: a power of 2, as packed pictures of a camera differ in their lengths.
    fn of(bytes: usize) -> Result<Self, Unusual> {
        let bytes = bytes.next_power_of_two();
        let kept = pool().take(bytes)?;
        Ok(Self(kept.unwrap_or_else(|| vec![0; bytes])))
    }

    fn first(&mut self, bytes: usize) -> Result<&mut [u8], Unusual> {
        self.0.get_mut(..bytes).ok_or(Unusual)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        pool().keep(mem::take(&mut self.0));
    }
}

static POOL: Mutex<Pool> = Mutex::new(Pool { kept: Vec::new(), bytes: 0 });

fn pool() -> MutexGuard<'static, Pool> {
    POOL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Buffers that are kept.
struct Pool {
    kept: Vec<Vec<u8>>,
    /// What they and those in use have.
    bytes: usize,
}

impl Pool {
    /// A buffer of so many bytes that is kept, or none where another may be made, for which those that are kept may be given up.
    fn take(&mut self, bytes: usize) -> Result<Option<Vec<u8>>, Unusual> {
        // That which was used last.
        if let Some(place) = self.kept.iter().rposition(|kept| kept.len() == bytes) {
            return Ok(Some(self.kept.remove(place)));
        }
        while self.bytes + bytes > ALL_BYTES {
            self.bytes -= self.kept.pop().ok_or(Unusual)?.len();
        }
        self.bytes += bytes;
        Ok(None)
    }

    /// Takes a buffer back.
    fn keep(&mut self, buffer: Vec<u8>) {
        if self.kept.len() < KEPT {
            self.kept.push(buffer);
        } else {
            self.bytes -= buffer.len();
        }
    }
}

/// Undoes the filter of a row \[PNG2025, Sec. 9.2]; of the first row all above is 0.
fn undo(filter: u8, row: &mut [u8], above: &[u8], sample_bytes: usize) -> Result<(), Unusual> {
    match filter {
        0 => {}
        1 => {
            for at in sample_bytes..row.len() {
                row[at] = row[at].wrapping_add(row[at - sample_bytes]);
            }
        }
        2 => row.iter_mut().zip(above).for_each(|(byte, above)| *byte = byte.wrapping_add(*above)),
        3 => {
            for at in 0..row.len() {
                let left = at.checked_sub(sample_bytes).map_or(0, |left| row[left]);
                row[at] = row[at].wrapping_add(left.midpoint(above[at]));
            }
        }
        4 => {
            for at in 0..row.len() {
                let [left, corner] = at.checked_sub(sample_bytes).map_or([0; 2], |left| [row[left], above[left]]);
                row[at] = row[at].wrapping_add(paeth(left, above[at], corner));
            }
        }
        _ => return Err(Unusual),
    }
    Ok(())
}

/// That of three neighbors that is nearest to left + above − corner; of those as near the first \[PNG2025, Sec. 9.4].
fn paeth(left: u8, above: u8, corner: u8) -> u8 {
    let [a, b, c] = [left, above, corner].map(i16::from);
    let [from_left, from_above, from_corner] = [b - c, a - c, a + b - 2 * c].map(i16::abs);
    if from_left <= from_above && from_left <= from_corner {
        left
    } else if from_above <= from_corner {
        above
    } else {
        corner
    }
}

/// Appends the samples of a row.
struct Widen<'a> {
    row: &'a [u8],
    sample_bytes: usize,
    samples: &'a mut Vec<f32>,
}

impl Kernel for Widen<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        if self.sample_bytes == 1 {
            self.samples.extend(self.row.iter().map(|byte| f32::from(*byte)));
        } else {
            let (samples, _) = self.row.as_chunks::<2>();
            self.samples.extend(samples.iter().map(|bytes| f32::from(u16::from_be_bytes(*bytes))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pictures_together_are_bounded() {
        let mut pool = Pool { kept: Vec::new(), bytes: 0 };
        assert_eq!(pool.take(ALL_BYTES - 16), Ok(None));
        assert_eq!(pool.take(32), Err(Unusual));
        assert_eq!(pool.take(16), Ok(None));
        assert_eq!(pool.take(1), Err(Unusual));
        // What is kept is used again, or makes room for others.
        pool.keep(vec![7; 16]);
        assert_eq!(pool.take(16), Ok(Some(vec![7; 16])));
        pool.keep(vec![7; 16]);
        assert_eq!(pool.take(8), Ok(None));
        assert_eq!((pool.kept.len(), pool.bytes), (0, ALL_BYTES - 8));
        (0..=KEPT).for_each(|_| pool.keep(vec![0; 2]));
        assert_eq!((pool.kept.len(), pool.bytes), (KEPT, ALL_BYTES - 10));
    }
}
