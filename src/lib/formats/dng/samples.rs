//! Samples from the bytes of a strip or tile, a few rows at a time.

use super::storage::{Compression, Sample, Storage};
use crate::formats::ljpeg::LjpegRows;
use crate::formats::tiff::Predictor;
use flate2::{Decompress, FlushDecompress, Status};
use half::f16;

/// What is said of a strip or tile that ends early.
const SHORT: &str = "ends before its last row; it was cut short or damaged";

/// A strip or tile that gives its samples from its first row on.
#[derive(Debug)]
pub(super) struct ChunkRows {
    sample: Sample,
    width: usize,
    big_endian: bool,
    source: Source,
    /// A row of bytes.
    row: Vec<u8>,
}

#[derive(Debug)]
enum Source {
    /// The bytes of the rows that are asked for.
    Plain {
        bytes: Vec<u8>,
        read: usize,
    },
    Deflate {
        bytes: Vec<u8>,
        inflater: Box<Decompress>,
        predictor: Predictor,
        step: usize,
    },
    /// The stream, and how many samples of its row are given already: its rows need not be those of the tile.
    Ljpeg {
        rows: Box<LjpegRows>,
        held: Vec<u16>,
        given: usize,
    },
}

impl ChunkRows {
    /// Opens a chunk whose stored bytes are `bytes` and which has `stored_rows` rows; of one that is not compressed, they may be
    /// those of some rows.
    ///
    /// # Errors
    ///
    /// What is wrong, in words that follow the chunk's name.
    pub fn open(storage: &Storage, big_endian: bool, bytes: Vec<u8>, stored_rows: usize) -> Result<Self, String> {
        let (sample, width) = (storage.sample, storage.chunk_width);
        let source = match storage.compression {
            Compression::None => Source::Plain { bytes, read: 0 },
            Compression::Deflate(predictor, step) => {
                Source::Deflate { bytes, inflater: Box::new(Decompress::new(true)), predictor, step }
            }
            Compression::LosslessJpeg { largest_has_bits } => {
                let rows = LjpegRows::open(bytes, largest_has_bits)?;
                let wanted = width as u64 * stored_rows as u64;
                if rows.samples() != wanted {
                    let found = rows.samples();
                    return Err(format!("is damaged; its JPEG has {found} samples, and its size needs {wanted}"));
                }
                Source::Ljpeg { rows: Box::new(rows), held: Vec::new(), given: 0 }
            }
        };
        Ok(Self { sample, width, big_endian, source, row: vec![0; sample.row_bytes(width)] })
    }

    /// Fills `samples` with the next rows.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn read(&mut self, samples: &mut [f32]) -> Result<(), String> {
        if let Source::Ljpeg { rows, held, given } = &mut self.source {
            return copy_samples(rows, held, given, samples);
        }
        for line in samples.chunks_exact_mut(self.width) {
            self.next_row()?;
            convert(self.sample, &self.row, line);
        }
        Ok(())
    }

    /// Takes the next row of bytes, in the machine's order.
    fn next_row(&mut self) -> Result<(), String> {
        let Self { sample, big_endian, source, row, .. } = self;
        let (predictor, step) = match source {
            Source::Plain { bytes, read } => {
                let next = bytes.get(*read..*read + row.len()).ok_or(SHORT)?;
                row.copy_from_slice(next);
                *read += row.len();
                (Predictor::None, 1)
            }
            Source::Deflate { bytes, inflater, predictor, step } => {
                inflate(inflater, bytes, row)?;
                (*predictor, *step)
            }
            Source::Ljpeg { .. } => return Ok(()),
        };
        let row_bytes = row.len();
        predictor.undo(row, row_bytes, step, sample.bytes(), *big_endian);
        Ok(())
    }
}

/// Copies samples from the rows of a stream, which follow each other without gaps.
fn copy_samples(
    rows: &mut LjpegRows,
    held: &mut Vec<u16>,
    given: &mut usize,
    mut samples: &mut [f32],
) -> Result<(), String> {
    while !samples.is_empty() {
        if *given == held.len() {
            let row = rows.next()?;
            // A whole row of the stream is not held.
            if row.len() <= samples.len() {
                let (now, later) = samples.split_at_mut(row.len());
                widen(row, now);
                samples = later;
                continue;
            }
            held.clear();
            held.extend_from_slice(row);
            *given = 0;
        }
        let count = (held.len() - *given).min(samples.len());
        let (now, later) = samples.split_at_mut(count);
        widen(&held[*given..*given + count], now);
        *given += count;
        samples = later;
    }
    Ok(())
}

fn widen(stored: &[u16], samples: &mut [f32]) {
    samples.iter_mut().zip(stored).for_each(|(sample, stored)| *sample = f32::from(*stored));
}

/// Fills `row` with what is inflated next.
fn inflate(inflater: &mut Decompress, bytes: &[u8], row: &mut [u8]) -> Result<(), String> {
    let mut filled = 0;
    while filled < row.len() {
        let (taken, given) = (inflater.total_in(), inflater.total_out());
        let rest = usize::try_from(taken).ok().and_then(|taken| bytes.get(taken..)).ok_or(SHORT)?;
        let status = inflater
            .decompress(rest, &mut row[filled..], FlushDecompress::None)
            .map_err(|_| "is damaged; its compressed data make no sense")?;
        filled += usize::try_from(inflater.total_out() - given).unwrap_or_default();
        let stands = inflater.total_in() == taken && inflater.total_out() == given;
        if filled < row.len() && (status == Status::StreamEnd || stands) {
            return Err(SHORT.into());
        }
    }
    Ok(())
}

/// Samples from a row of bytes, numbers of several bytes in the machine's order.
fn convert(sample: Sample, row: &[u8], samples: &mut [f32]) {
    match sample {
        Sample::Integer { bits: 8 } => samples.iter_mut().zip(row).for_each(|(out, byte)| *out = f32::from(*byte)),
        Sample::Integer { bits: 16 } => each::<2>(row, samples, |bytes| f32::from(u16::from_ne_bytes(bytes))),
        Sample::Integer { bits } => unpack(row, bits, samples),
        Sample::Float { bits: 16 } => each::<2>(row, samples, |bytes| f16::from_ne_bytes(bytes).to_f32()),
        Sample::Float { bits: 24 } => each::<3>(row, samples, float_of_24_bits),
        Sample::Float { .. } => each::<4>(row, samples, f32::from_ne_bytes),
    }
}

fn each<const BYTES: usize>(row: &[u8], samples: &mut [f32], value: impl Fn([u8; BYTES]) -> f32) {
    samples.iter_mut().zip(row.as_chunks::<BYTES>().0).for_each(|(sample, bytes)| *sample = value(*bytes));
}

/// Samples of 9 to 15 bits that stand one after another, the highest bit first.
fn unpack(row: &[u8], bits: u32, samples: &mut [f32]) {
    let mut first = 0;
    for sample in samples {
        let begin = first / 8;
        let eight = match row.get(begin..).and_then(|rest| rest.first_chunk::<8>()) {
            Some(eight) => *eight,
            None => {
                let mut last = [0; 8];
                let rest = row.get(begin..).unwrap_or_default();
                last[..rest.len()].copy_from_slice(rest);
                last
            }
        };
        let value = u64::from_be_bytes(eight) << (first % 8) >> (64 - bits);
        #[expect(clippy::cast_precision_loss, reason = "at most 15 bits")]
        let value = value as f32;
        *sample = value;
        first += bits as usize;
    }
}

/// A float of 1 bit of sign, 7 of exponent less 64, and 16 of mantissa \[DNG2023, Floating Point Image Data].
fn float_of_24_bits(bytes: [u8; 3]) -> f32 {
    let [high, middle, low] = if cfg!(target_endian = "big") { bytes } else { [bytes[2], bytes[1], bytes[0]] };
    let sign = u32::from(high >> 7) << 31;
    let exponent = u32::from(high & 0x7F);
    let mantissa = u32::from(middle) << 8 | u32::from(low);
    let magnitude = match (exponent, mantissa) {
        // Denormal: mantissa times 2 to the 1 − 63 − 16, exact in single precision.
        (0, mantissa) => mantissa as f32 * 2f32.powi(-78),
        (127, 0) => f32::INFINITY,
        (127, _) => f32::NAN,
        (exponent, mantissa) => f32::from_bits((exponent + 127 - 63) << 23 | mantissa << 7),
    };
    f32::from_bits(magnitude.to_bits() | sign)
}
