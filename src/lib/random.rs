//! Random numbers keyed by what is drawn, not by when: Philox 4x32-10 \[Salmon2011].
//!
//! A draw is named by seed, frame, source of noise, photosite and sensor class. Whoever asks for it, in whatever order
//! and on whatever thread, gets the same number; a crop, a mosaic or a single photosite costs only its own draws.

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

/// The Philox 4x32 bijection with 10 rounds: 128 random bits from a 128-bit counter and a 64-bit key.
///
/// Multipliers and Weyl constants of \[Salmon2011], Table 2 and Sec. 4.
pub fn philox4x32_10(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    const MULTIPLIERS: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
    const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];
    for round in 0..10 {
        if round > 0 {
            key = [key[0].wrapping_add(WEYL[0]), key[1].wrapping_add(WEYL[1])];
        }
        let [low0, high0] = halves(u64::from(MULTIPLIERS[0]) * u64::from(counter[0]));
        let [low1, high1] = halves(u64::from(MULTIPLIERS[1]) * u64::from(counter[2]));
        counter = [high1 ^ counter[1] ^ key[0], low1, high0 ^ counter[3] ^ key[1], low0];
    }
    counter
}

/// The low and the high 32 bits.
#[expect(clippy::cast_possible_truncation, reason = "taking the halves of a 64-bit word is what this is for")]
fn halves(word: u64) -> [u32; 2] {
    [word as u32, (word >> 32) as u32]
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::Rng;

    /// The known answers that D. E. Shaw Research publishes with Random123 (`kat_vectors`, philox4x32, 10 rounds).
    #[test]
    fn philox_gives_the_published_known_answers() {
        let answers = [
            ([0; 4], [0; 2], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
            ([u32::MAX; 4], [u32::MAX; 2], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
            (
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0],
                [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
            ),
        ];
        for (counter, key, answer) in answers {
            assert_eq!(philox4x32_10(counter, key), answer);
        }
    }

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
