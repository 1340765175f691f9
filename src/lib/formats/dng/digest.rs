//! The digest by which readers of a DNG see that its raw image is whole.

use crate::formats::tiff::TiffSamples;
use md5::Context;
use rayon::prelude::*;
use std::{fmt, mem};

/// Columns, and rows, of a tile.
const TILE: usize = 256;

/// The MD5 of a raw image \[DNG2023, NewRawImageDigest]: that of the MD5s of its tiles of 256×256 samples, row of tiles by row
/// of tiles, the last ones smaller; of a tile its samples row by row, little-endian.
///
/// The specification says that it is a digest of the image's data and no more; the tiles are those of Adobe's DNG SDK
/// (`dng_negative::FindNewRawImageDigest`), by which converters check it. They are none of the file's: the digest does not
/// hang on how samples are laid out and compressed.
pub(super) struct RawDigest {
    samples: TiffSamples,
    width: usize,
    rows: usize,
    tiles: Vec<Context>,
    whole: Context,
}

impl fmt::Debug for RawDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RawDigest").field("rows", &self.rows).finish_non_exhaustive()
    }
}

impl RawDigest {
    /// That of an image of so many columns, without rows yet.
    pub fn new(width: usize, samples: TiffSamples) -> Self {
        let tiles = vec![Context::new(); width.div_ceil(TILE)];
        Self { samples, width, rows: 0, tiles, whole: Context::new() }
    }

    /// Takes the next rows, whose samples are of the type.
    pub fn take(&mut self, mut samples: &[f32]) {
        while !samples.is_empty() {
            let missing = (TILE - self.rows % TILE) * self.width;
            let (now, later) = samples.split_at(missing.min(samples.len()));
            samples = later;
            let (width, kind) = (self.width, self.samples);
            self.tiles.par_iter_mut().enumerate().for_each(|(index, tile)| {
                for row in now.chunks_exact(width) {
                    consume(tile, &row[index * TILE..width.min((index + 1) * TILE)], kind);
                }
            });
            self.rows += now.len() / self.width;
            if self.rows.is_multiple_of(TILE) {
                self.finish_tiles();
            }
        }
    }

    /// The digest of all rows.
    pub fn finish(mut self) -> [u8; 16] {
        if !self.rows.is_multiple_of(TILE) {
            self.finish_tiles();
        }
        self.whole.finalize().0
    }

    fn finish_tiles(&mut self) {
        for tile in &mut self.tiles {
            self.whole.consume(mem::replace(tile, Context::new()).finalize().0);
        }
    }
}

/// Adds a part of a row.
fn consume(tile: &mut Context, part: &[f32], kind: TiffSamples) {
    let mut bytes = [0; 4 * TILE];
    let bytes = &mut bytes[..kind.bytes() * part.len()];
    for (place, sample) in bytes.chunks_exact_mut(kind.bytes()).zip(part) {
        match kind {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "codes of 16 bits")]
            TiffSamples::U16 => place.copy_from_slice(&(*sample as u16).to_le_bytes()),
            TiffSamples::F32 => place.copy_from_slice(&sample.to_le_bytes()),
        }
    }
    tile.consume(bytes);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(samples: &[f32], width: usize, kind: TiffSamples, rows: usize) -> [u8; 16] {
        let mut digest = RawDigest::new(width, kind);
        samples.chunks(rows * width).for_each(|rows| digest.take(rows));
        digest.finish()
    }

    /// One tile, by the MD5 of its bytes: those of `abc` have 900150983cd24fb0d6963f7d28e17f72 [RFC 1321].
    #[test]
    fn one_tile_is_the_digest_of_its_digest() {
        let codes = [0x6261, 0x0063].map(|code: u16| f32::from(code));
        let expected = md5::compute(md5::compute(b"abc\0").0).0;
        assert_eq!(digest(&codes, 2, TiffSamples::U16, 1), expected);
        let floats = [f32::from_le_bytes(*b"abc\0")];
        assert_eq!(digest(&floats, 1, TiffSamples::F32, 1), expected);
        assert_eq!(format!("{:x}", md5::compute(b"abc")), "900150983cd24fb0d6963f7d28e17f72");
    }

    #[test]
    fn it_does_not_hang_on_bands() {
        let codes: Vec<f32> = (0..301 * 519_u32).map(|i| (i.wrapping_mul(i) % 65_521) as f32).collect();
        let [first, others @ ..] = [1, 100, 256, 300, 519].map(|rows| digest(&codes, 301, TiffSamples::U16, rows));
        assert!(others.iter().all(|other| *other == first));
    }
}
