//! The Philox 4x32 bijection with 10 rounds [Salmon2011, Sec. 3.3]: 128 random bits from a counter and a key.

/// Photosites of a run, whose numbers are made together, at most: few enough for the first-level cache.
pub const LONGEST_RUN: usize = 256;

/// Photosites that fill the widest vector; runs are made in multiples of it.
pub const VECTOR: usize = 16;

/// The words of a run of photosites, `[word][photosite]`.
pub type Words = [[u32; LONGEST_RUN]; 4];

const MULTIPLIERS: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// The Philox 4x32 bijection with 10 rounds: 128 random bits from a 128-bit counter and a 64-bit key.
///
/// Multipliers and Weyl constants of [Salmon2011, Table 2 and Sec. 4].
///
/// # Examples
///
/// ```
/// use cyanometer::random::philox::philox4x32_10;
///
/// // One of the known answers that are published with Random123.
/// assert_eq!(philox4x32_10([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
/// ```
#[inline(always)]
pub fn philox4x32_10(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
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
#[inline(always)]
pub(super) fn halves(word: u64) -> [u32; 2] {
    [word as u32, (word >> 32) as u32]
}

/// Fills the words of `length` photosites: photosite `i` has the counter `[first + i, second, third, fourth[i mod 2]]`.
#[inline(always)]
pub(super) fn fill(
    words: &mut Words,
    length: usize,
    key: [u32; 2],
    [first, second, third]: [u32; 3],
    fourth: [u32; 2],
) {
    let [a, b, c, d] = words.each_mut().map(|words| &mut words[..length]);
    let step = fourth[0] ^ fourth[1];
    let lanes = a.iter_mut().zip(b).zip(c).zip(d);
    for (index, (((a, b), c), d)) in (0_u32..).zip(lanes) {
        let last = fourth[0] ^ (step & (index & 1).wrapping_neg());
        [*a, *b, *c, *d] = philox4x32_10([first.wrapping_add(index), second, third, last], key);
    }
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of photosites")]
mod tests {
    use super::*;

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
    fn a_block_is_its_photosites_one_by_one() {
        let mut words = [[0; LONGEST_RUN]; 4];
        let (key, start, fourth) = ([7, 8], [u32::MAX - 3, 5, 6], [1 << 16, 2 << 16]);
        fill(&mut words, LONGEST_RUN, key, start, fourth);
        for index in 0..LONGEST_RUN as u32 {
            let counter = [start[0].wrapping_add(index), 5, 6, fourth[index as usize % 2]];
            assert_eq!(words.map(|word| word[index as usize]), philox4x32_10(counter, key));
        }
    }
}
