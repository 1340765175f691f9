//! Strips and tiles: compression, predictors and byte order, undone and done.

use super::TiffCompression;
use flate2::{Decompress, FlushDecompress, Status};
use std::io::Write;
use weezl::BitOrder;

/// Compressions that we undo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Lzw,
    Deflate,
    PackBits,
}

impl Compression {
    /// How many bytes one stored byte can become at most. A file that promises more is damaged, and finding that out
    /// beforehand saves the memory for it.
    pub fn most_expansion(self) -> u128 {
        match self {
            Self::None => 1,
            // Two bytes repeat one 128 times.
            Self::PackBits => 64,
            // A match of 258 bytes in two bits.
            Self::Deflate => 1032,
            // A code of 12 bits for the longest string, of less than 4096 bytes.
            Self::Lzw => 2731,
        }
    }

    /// Undoes the compression, filling `decoded`. What `stored` holds beyond that is not looked at.
    pub fn decode(self, stored: &[u8], decoded: &mut [u8]) -> Result<(), Trouble> {
        let filled = match self {
            Self::None => {
                let filled = stored.len().min(decoded.len());
                decoded[..filled].copy_from_slice(&stored[..filled]);
                filled
            }
            Self::Lzw => decode_lzw(stored, decoded)?,
            Self::Deflate => decode_deflate(stored, decoded)?,
            Self::PackBits => decode_packbits(stored, decoded),
        };
        if filled == decoded.len() { Ok(()) } else { Err(Trouble::Short) }
    }
}

/// What can be wrong with a compressed chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Trouble {
    /// It ends early.
    Short,
    /// It is not what it says.
    Damaged,
    /// LZW with the bits in the order of before 1987.
    OldLzw,
}

impl Trouble {
    /// What to tell the user.
    pub fn text(self) -> &'static str {
        match self {
            Self::Short => "ends before its last row; it was cut short or damaged",
            Self::Damaged => "is damaged; its compressed data make no sense",
            Self::OldLzw => {
                "uses the LZW of old (bits reversed), which is not supported; rewrite it, for example with `tiffcp -c zip in.tif out.tif`"
            }
        }
    }
}

fn decode_lzw(stored: &[u8], decoded: &mut [u8]) -> Result<usize, Trouble> {
    // The clear code 256 comes first; seen from the other end it looks like this.
    if matches!(stored, [0, second, ..] if second & 1 == 1) {
        return Err(Trouble::OldLzw);
    }
    let mut decoder = weezl::decode::Decoder::with_tiff_size_switch(BitOrder::Msb, 8);
    let (mut read, mut filled) = (0, 0);
    while filled < decoded.len() {
        let step = decoder.decode_bytes(&stored[read..], &mut decoded[filled..]);
        read += step.consumed_in;
        filled += step.consumed_out;
        match step.status {
            Ok(weezl::LzwStatus::Ok) if step.consumed_in + step.consumed_out > 0 => {}
            Ok(_) => break,
            Err(_) => return Err(Trouble::Damaged),
        }
    }
    Ok(filled)
}

fn decode_deflate(stored: &[u8], decoded: &mut [u8]) -> Result<usize, Trouble> {
    let mut decoder = Decompress::new(true);
    loop {
        let read = usize::try_from(decoder.total_in()).unwrap_or(usize::MAX);
        let filled = usize::try_from(decoder.total_out()).unwrap_or(usize::MAX);
        let status = decoder.decompress(&stored[read..], &mut decoded[filled..], FlushDecompress::Finish);
        let now = usize::try_from(decoder.total_out()).unwrap_or(usize::MAX);
        match status {
            // Full. What is found wrong on the way there, as a checksum, is damage.
            _ if now == decoded.len() => return status.map(|_| now).map_err(|_| Trouble::Damaged),
            Ok(Status::StreamEnd) => return Ok(now),
            Ok(_) if now == filled && decoder.total_in() == read as u64 => return Ok(now),
            Ok(_) => {}
            Err(_) => return Err(Trouble::Damaged),
        }
    }
}

fn decode_packbits(stored: &[u8], decoded: &mut [u8]) -> usize {
    let (mut read, mut filled) = (0, 0);
    while filled < decoded.len() {
        let Some(&head) = stored.get(read) else { break };
        read += 1;
        let left = decoded.len() - filled;
        if head < 128 {
            let count = (usize::from(head) + 1).min(left).min(stored.len() - read);
            decoded[filled..filled + count].copy_from_slice(&stored[read..read + count]);
            read += usize::from(head) + 1;
            filled += count;
            if read > stored.len() {
                break;
            }
        } else if head > 128 {
            let Some(&byte) = stored.get(read) else { break };
            read += 1;
            let count = (257 - usize::from(head)).min(left);
            decoded[filled..filled + count].fill(byte);
            filled += count;
        }
    }
    filled
}

/// What was done to each row before compression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::formats) enum Predictor {
    None,
    /// Each sample is stored as the difference, as an integer, from the one of its channel before it.
    Horizontal,
    /// Bytes of equal weight stand together, the highest first, and each is stored as the difference from the one
    /// before it (Adobe Photoshop TIFF Technical Note 3).
    FloatingPoint,
}

impl Predictor {
    /// Brings decoded rows into the machine's byte order and adds the differences up again, which are those from the sample
    /// `channels` before.
    pub fn undo(self, rows: &mut [u8], row_bytes: usize, channels: usize, sample_bytes: usize, big_endian: bool) {
        if self != Self::FloatingPoint && big_endian != cfg!(target_endian = "big") {
            match sample_bytes {
                2 => swap::<2>(rows),
                3 => swap::<3>(rows),
                4 => swap::<4>(rows),
                8 => swap::<8>(rows),
                _ => {}
            }
        }
        match self {
            Self::None => {}
            Self::Horizontal => {
                for row in rows.chunks_exact_mut(row_bytes) {
                    match sample_bytes {
                        1 => {
                            add_up::<1, u8>(row, channels, u8::from_ne_bytes, u8::wrapping_add, u8::to_ne_bytes);
                        }
                        2 => {
                            add_up::<2, u16>(row, channels, u16::from_ne_bytes, u16::wrapping_add, u16::to_ne_bytes);
                        }
                        4 => {
                            add_up::<4, u32>(row, channels, u32::from_ne_bytes, u32::wrapping_add, u32::to_ne_bytes);
                        }
                        _ => {
                            add_up::<8, u64>(row, channels, u64::from_ne_bytes, u64::wrapping_add, u64::to_ne_bytes);
                        }
                    }
                }
            }
            Self::FloatingPoint => {
                let mut planes = vec![0; row_bytes];
                for row in rows.chunks_exact_mut(row_bytes) {
                    planes.copy_from_slice(row);
                    add_up::<1, u8>(&mut planes, channels, u8::from_ne_bytes, u8::wrapping_add, u8::to_ne_bytes);
                    match sample_bytes {
                        2 => from_planes::<2>(&planes, row),
                        3 => from_planes::<3>(&planes, row),
                        4 => from_planes::<4>(&planes, row),
                        _ => from_planes::<8>(&planes, row),
                    }
                }
            }
        }
    }

    /// Takes the differences of little-endian rows of `sample_bytes`: 2 for [`Predictor::Horizontal`], 4 for
    /// [`Predictor::FloatingPoint`].
    pub fn apply(self, rows: &mut [u8], row_bytes: usize, channels: usize) {
        let mut plain = vec![0; row_bytes];
        for row in rows.chunks_exact_mut(row_bytes) {
            match self {
                Self::None => return,
                Self::Horizontal => {
                    plain.copy_from_slice(row);
                    let step = 2 * channels;
                    let (_, later) = row.split_at_mut(step);
                    let pairs = plain[step..].chunks_exact(2).zip(plain.chunks_exact(2));
                    for (out, (now, before)) in later.chunks_exact_mut(2).zip(pairs) {
                        let [now, before] = [now, before].map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]));
                        out.copy_from_slice(&now.wrapping_sub(before).to_le_bytes());
                    }
                }
                Self::FloatingPoint => {
                    let samples = row_bytes / 4;
                    for (index, sample) in row.chunks_exact(4).enumerate() {
                        for (weight, byte) in sample.iter().enumerate() {
                            plain[(3 - weight) * samples + index] = *byte;
                        }
                    }
                    let (first, later) = row.split_at_mut(channels);
                    first.copy_from_slice(&plain[..channels]);
                    for (out, (now, before)) in later.iter_mut().zip(plain[channels..].iter().zip(&plain)) {
                        *out = now.wrapping_sub(*before);
                    }
                }
            }
        }
    }
}

/// Reverses the bytes of each sample.
fn swap<const BYTES: usize>(rows: &mut [u8]) {
    for sample in rows.as_chunks_mut::<BYTES>().0 {
        sample.reverse();
    }
}

/// Adds to each sample the one of its channel before it.
fn add_up<const BYTES: usize, T: Copy + Default>(
    row: &mut [u8],
    channels: usize,
    from: fn([u8; BYTES]) -> T,
    add: fn(T, T) -> T,
    to: fn(T) -> [u8; BYTES],
) {
    let samples = row.as_chunks_mut::<BYTES>().0;
    if channels == 1 {
        let mut sum = T::default();
        for sample in samples {
            sum = add(sum, from(*sample));
            *sample = to(sum);
        }
    } else {
        for index in channels..samples.len() {
            samples[index] = to(add(from(samples[index]), from(samples[index - channels])));
        }
    }
}

/// Puts the bytes of each sample together, which stand in planes from the highest to the lowest.
fn from_planes<const BYTES: usize>(planes: &[u8], row: &mut [u8]) {
    let (samples, _) = row.as_chunks_mut::<BYTES>();
    let count = samples.len();
    for (weight, plane) in planes.chunks_exact(count.max(1)).take(BYTES).enumerate() {
        let place = if cfg!(target_endian = "big") { weight } else { BYTES - 1 - weight };
        for (sample, byte) in samples.iter_mut().zip(plane) {
            sample[place] = *byte;
        }
    }
}

/// Compresses one strip.
///
/// # Errors
///
/// Never in practice: the encoders write to memory.
pub(super) fn encode(compression: TiffCompression, strip: &[u8]) -> std::io::Result<Vec<u8>> {
    match compression {
        TiffCompression::None => Ok(strip.to_vec()),
        TiffCompression::Lzw => {
            weezl::encode::Encoder::with_tiff_size_switch(BitOrder::Msb, 8).encode(strip).map_err(std::io::Error::other)
        }
        TiffCompression::Deflate => {
            let level = flate2::Compression::new(1);
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::with_capacity(strip.len() / 2), level);
            encoder.write_all(strip)?;
            encoder.finish()
        }
    }
}
