//! Rows of plain pictures, as frames of codes are: one channel, not interlaced, a single picture.
//!
//! What is out of the ordinary, damage above all, is left to the crate `png`, which begins again and says what is wrong. So whatever is
//! read here must be whole: all that the crate holds against a file is held against it here too.

use super::codes::Damaged;
use super::inflate::{Inflate, ROOM, Source};
use crate::numerics::vectors::{self, Kernel};
use flate2::Crc;
use std::fs::File;
use std::mem;
use std::os::unix::fs::FileExt;
use std::sync::{Mutex, PoisonError};

/// The checksum of a chunk, and the length and kind of the next.
const BETWEEN: usize = 12;
/// Inflaters that are kept for the next files, about 130 KiB each.
const KEPT: usize = 64;

static KEPT_INFLATERS: Mutex<Vec<Inflate>> = Mutex::new(Vec::new());

/// Reads rows of 8 or 16 bits.
pub struct PlainRows {
    chunks: Chunks,
    /// None once all rows are read.
    inflate: Option<Inflate>,
    /// The row and that above it, behind a byte that names the filter of the row.
    row: Vec<u8>,
    above: Vec<u8>,
    sample_bytes: usize,
    left: usize,
}

impl PlainRows {
    /// Rows, so many of so many samples, whose first chunk of data, of `length` bytes, stands at such a place.
    pub fn new([width, height]: [usize; 2], sample_bytes: usize, place: u64, length: u64) -> Self {
        let row = vec![0; width * sample_bytes + 1];
        let chunks = Chunks { place, left: length, is_last: false, sum: crc_of_data() };
        Self { chunks, inflate: None, above: row.clone(), row, sample_bytes, left: height }
    }

    /// Appends the next rows.
    ///
    /// # Errors
    ///
    /// Where anything is out of the ordinary.
    pub fn read(&mut self, file: &File, rows: usize, samples: &mut Vec<f32>) -> Result<(), Damaged> {
        let mut inflate = self.inflate.take().unwrap_or_else(inflater);
        let mut source = Data { file, chunks: &mut self.chunks };
        for _ in 0..rows {
            inflate.read(&mut self.row, &mut source)?;
            let (filter, row) = self.row.split_first_mut().ok_or(Damaged)?;
            undo(*filter, row, &self.above[1..], self.sample_bytes)?;
            vectors::run(Widen { row, sample_bytes: self.sample_bytes, samples });
            mem::swap(&mut self.row, &mut self.above);
        }
        self.left = self.left.saturating_sub(rows);
        if self.left > 0 {
            self.inflate = Some(inflate);
            return Ok(());
        }
        // Checksums of what nobody needs count too.
        let mut passed = vec![0; ROOM];
        while source.more(&mut passed)? > 0 {}
        let mut kept = KEPT_INFLATERS.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() < KEPT {
            kept.push(inflate);
        }
        Ok(())
    }
}

/// One that is kept, or another.
fn inflater() -> Inflate {
    let kept = KEPT_INFLATERS.lock().unwrap_or_else(PoisonError::into_inner).pop();
    let mut inflate = kept.unwrap_or_else(Inflate::new);
    inflate.begin();
    inflate
}

/// Where in the chunks of data of a file it is.
struct Chunks {
    /// The place of the next byte, and how many are left of its chunk.
    place: u64,
    left: u64,
    /// Whether no such chunk follows.
    is_last: bool,
    sum: Crc,
}

/// The data of chunks.
struct Data<'a> {
    file: &'a File,
    chunks: &'a mut Chunks,
}

impl Source for Data<'_> {
    fn more(&mut self, room: &mut [u8]) -> Result<usize, Damaged> {
        let Self { file, chunks } = self;
        let mut read = 0;
        while read == 0 && !chunks.is_last {
            let count = usize::try_from(chunks.left).unwrap_or(usize::MAX).min(ROOM - BETWEEN);
            let is_end = count as u64 == chunks.left;
            let wanted = count + if is_end { BETWEEN } else { 0 };
            file.read_exact_at(&mut room[..wanted], chunks.place).map_err(|_| Damaged)?;
            chunks.place += wanted as u64;
            chunks.left -= count as u64;
            let (data, behind) = room[..wanted].split_at(count);
            chunks.sum.update(data);
            if is_end {
                let behind: [u8; BETWEEN] = behind.try_into().map_err(|_| Damaged)?;
                let [sum, length, kind] =
                    [0, 4, 8].map(|at| u32::from_be_bytes(std::array::from_fn(|i| behind[at + i])));
                if sum != chunks.sum.sum() {
                    return Err(Damaged);
                }
                chunks.is_last = kind.to_be_bytes() != *b"IDAT";
                chunks.left = length.into();
                chunks.sum = crc_of_data();
            }
            read = count;
        }
        Ok(read)
    }
}

/// That of a chunk of data that is to come: it is one of its kind too.
fn crc_of_data() -> Crc {
    let mut sum = Crc::new();
    sum.update(b"IDAT");
    sum
}

/// Undoes the filter of a row \[PNG2025, Sec. 9.2]; of the first row all above is 0.
fn undo(filter: u8, row: &mut [u8], above: &[u8], sample_bytes: usize) -> Result<(), Damaged> {
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
        _ => return Err(Damaged),
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
