//! Random numbers keyed by what is drawn, not by when: Philox 4x32-10 \[Salmon2011].
//!
//! A draw is named by seed, frame, source of noise, photosite and sensor class. Whoever asks for it, in whatever order
//! and on whatever thread, gets the same number; a crop, a mosaic or a single photosite costs only its own draws.

pub mod gaussian;
pub mod philox;
pub mod poisson;

use philox::{BLOCK, Words, halves, philox4x32_10};
use poisson::Table;
use rand_core::TryRng;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;

/// A source of noise, as the paper lists them (Sec. 3.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Source {
    /// Dark-current shot noise, temporal.
    Dcsn = 0,
    /// Dark-current non-uniformity, a fixed pattern.
    Dcnu = 1,
    /// Signal shot noise, temporal.
    Ssn = 2,
    /// Photo-response non-uniformity, a fixed pattern.
    Prnu = 3,
    /// Read-out noise, temporal.
    Ron = 4,
}

impl Source {
    /// All sources in the order of Eq. 9.
    pub const ALL: [Self; 5] = [Self::Dcsn, Self::Dcnu, Self::Ssn, Self::Prnu, Self::Ron];

    /// The name used on the command line and in metadata.
    pub fn name(self) -> &'static str {
        ["dcsn", "dcnu", "ssn", "prnu", "ron"][self as usize]
    }

    /// Whether the source repeats from frame to frame of one sensor.
    pub fn is_fixed_pattern(self) -> bool {
        matches!(self, Self::Dcnu | Self::Prnu)
    }
}

/// The draws of one photosite from one source: a short stream of Philox blocks.
///
/// The key is the seed. The counter is `[x, y, frame, source · 2²⁴ + class · 2¹⁶ + block]` with `x` and `y` the
/// photosite's column and row on the sensor; a fixed pattern has the sensor's seed for key and frame 0.
#[derive(Debug, Clone)]
pub struct Draws {
    key: [u32; 2],
    counter: [u32; 4],
    block: [u32; 4],
    used: usize,
}

impl Draws {
    /// The stream of `source` in the photosite at `(x, y)` of `class`.
    pub fn new(seed: u64, frame: u32, source: Source, class: u8, x: i32, y: i32) -> Self {
        let counter =
            [x.cast_unsigned(), y.cast_unsigned(), frame, u32::from(source as u8) << 24 | u32::from(class) << 16];
        Self { key: halves(seed), counter, block: [0; 4], used: 4 }
    }

    fn word(&mut self) -> u32 {
        if self.used == 4 {
            self.block = philox4x32_10(self.counter, self.key);
            // 2¹⁶ blocks are 2¹⁸ words; no distribution here comes near that, and wrapping would only repeat words.
            let block = self.counter[3].wrapping_add(1) & 0xFFFF;
            self.counter[3] = self.counter[3] & 0xFFFF_0000 | block;
            self.used = 0;
        }
        self.used += 1;
        self.block[self.used - 1]
    }
}

impl TryRng for Draws {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.word())
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let low = u64::from(self.word());
        Ok(u64::from(self.word()) << 32 | low)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(4) {
            chunk.copy_from_slice(&self.word().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

/// A run of photosites of one row, at most [`BLOCK`], whose draws are made together.
///
/// Two Philox blocks a photosite hold all words that its five draws need but in one case of a thousand:
///
/// | key, third word of the counter | fourth word | words |
/// |---|---|---|
/// | seed, frame | class · 2¹⁶ | SSN, DCSN and RON high, RON low |
/// | seed, frame | class · 2¹⁶ + 1 | SSN and DCSN low, made only where the high words leave a count in doubt |
/// | sensor seed, 0 | 2²⁴ + class · 2¹⁶ | DCNU high and low, PRNU high and low |
///
/// The first two words of the counter are column and row on the sensor. Each draw has a 64-bit word of its own.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    /// Seed of the temporal noise.
    pub seed: u64,
    /// Seed of the fixed patterns.
    pub sensor_seed: u64,
    /// Number of the exposure.
    pub frame: u32,
    /// Column of the first photosite, and row, on the sensor.
    pub place: [i32; 2],
    /// Sensor classes of the first photosite and of the second; they alternate.
    pub classes: [u8; 2],
    /// Photosites, a multiple of [`LANES`].
    pub length: usize,
}

/// Memory for the words of a run.
#[derive(Debug)]
pub struct RunWords {
    temporal: Words,
    pattern: Words,
}

impl Default for RunWords {
    fn default() -> Self {
        Self { temporal: [[0; BLOCK]; 4], pattern: [[0; BLOCK]; 4] }
    }
}

const PATTERN: u32 = 1 << 24;

impl Run {
    fn fourth(&self) -> [u32; 2] {
        self.classes.map(|class| u32::from(class) << 16)
    }

    /// Makes the words of the temporal sources.
    #[inline(always)]
    pub fn make_temporal(&self, words: &mut RunWords) {
        let [x, y] = self.place.map(i32::cast_unsigned);
        philox::fill(&mut words.temporal, self.length, halves(self.seed), [x, y, self.frame], self.fourth());
    }

    /// Makes the words of the fixed patterns.
    #[inline(always)]
    pub fn make_pattern(&self, words: &mut RunWords) {
        let [x, y] = self.place.map(i32::cast_unsigned);
        let fourth = self.fourth().map(|class| class | PATTERN);
        philox::fill(&mut words.pattern, self.length, halves(self.sensor_seed), [x, y, 0], fourth);
    }

    /// The low words of SSN and DCSN.
    fn low(&self, index: usize) -> [u32; 4] {
        let [x, y] = self.place.map(i32::cast_unsigned);
        #[expect(clippy::cast_possible_truncation, reason = "a run is short, and columns wrap as a sensor's do")]
        let counter = [x.wrapping_add(index as u32), y, self.frame, self.fourth()[index % 2] | 1];
        philox4x32_10(counter, halves(self.seed))
    }

    /// Fills `numbers` with standard normal numbers of RON, DCNU or PRNU, or of the word that SSN and DCSN have.
    #[inline(always)]
    pub fn normals(&self, words: &RunWords, source: Source, numbers: &mut [f32]) {
        let (temporal, pattern) = (&words.temporal, &words.pattern);
        let length = self.length;
        match source {
            Source::Ssn => gaussian::fill(numbers, &temporal[0][..length], |index| self.low(index)[0]),
            Source::Dcsn => gaussian::fill(numbers, &temporal[1][..length], |index| self.low(index)[1]),
            Source::Ron => gaussian::fill(numbers, &temporal[2][..length], |index| temporal[3][index]),
            Source::Dcnu => gaussian::fill(numbers, &pattern[0][..length], |index| pattern[1][index]),
            Source::Prnu => gaussian::fill(numbers, &pattern[2][..length], |index| pattern[3][index]),
        }
    }

    /// Fills `counts` with the Poisson numbers of SSN, or of DCSN, at `rates`; one of 0 or less, or NaN, gives 0.
    #[inline(always)]
    pub fn counts(&self, words: &RunWords, source: Source, rates: &[f32], counts: &mut [f32]) {
        let word = usize::from(source == Source::Dcsn);
        poisson::fill(counts, rates, &words.temporal[word][..self.length], |index| self.low(index)[word]);
    }

    /// The same at the rates of two tables by turns, the first for the first photosite.
    #[inline(always)]
    pub fn counts_of(&self, words: &RunWords, source: Source, tables: [&Table; 2], counts: &mut [f32]) {
        let word = usize::from(source == Source::Dcsn);
        let low = |index: usize| self.low(index)[word];
        poisson::fill_by_tables(counts, tables, &words.temporal[word][..self.length], low);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::Rng;

    #[test]
    fn every_part_of_the_name_changes_the_draw() {
        let first = |mut draws: Draws| draws.next_u64();
        let base = first(Draws::new(1, 2, Source::Ssn, 0, 3, 4));
        assert_eq!(base, first(Draws::new(1, 2, Source::Ssn, 0, 3, 4)));
        for other in [
            Draws::new(1 << 32, 2, Source::Ssn, 0, 3, 4),
            Draws::new(1, 3, Source::Ssn, 0, 3, 4),
            Draws::new(1, 2, Source::Ron, 0, 3, 4),
            Draws::new(1, 2, Source::Ssn, 1, 3, 4),
            Draws::new(1, 2, Source::Ssn, 0, 4, 3),
            Draws::new(1, 2, Source::Ssn, 0, -3, 4),
        ] {
            assert_ne!(base, first(other));
        }
    }
}
