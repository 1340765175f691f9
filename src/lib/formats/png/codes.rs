//! Codes of Deflate, and tables that tell by the next bits what is to be done \[RFC1951, Sec. 3.2].
#![expect(clippy::cast_possible_truncation, reason = "fields of a few bits")]

/// What is no stream, or ends too early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damaged;

/// Bits that the table of steps is entered with: more would take the place of what is inflated in the nearest cache.
pub const STEP_BITS: u32 = 11;
/// Bits that those of single symbols are.
const SYMBOL_BITS: u32 = 10;
const DISTANCE_BITS: u32 = 9;
/// Bits of the longest code.
pub const LONGEST: usize = 15;
/// Symbols of literals and lengths.
pub const LITERALS: usize = 288;
/// Symbols of distances.
pub const DISTANCES: usize = 32;
/// What ends a block.
pub const END: usize = 256;

const LENGTH_BASE: [u16; 29] =
    [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
const LENGTH_EXTRA: [u8; 29] = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];

/// The least length that a symbol stands for, and how many bits extend it.
pub fn length(symbol: usize) -> Option<(usize, u32)> {
    let index = symbol.checked_sub(END + 1)?;
    Some((usize::from(*LENGTH_BASE.get(index)?), u32::from(LENGTH_EXTRA[index])))
}

/// The least distance that a symbol stands for, and how many bits extend it.
fn distance(symbol: usize) -> Option<(u32, u32)> {
    let symbol = symbol as u32;
    match symbol {
        0..4 => Some((symbol + 1, 0)),
        4..30 => Some((1 + ((2 + symbol % 2) << (symbol / 2 - 1)), symbol / 2 - 1)),
        _ => None,
    }
}

/// Codes of an alphabet in their order.
pub struct Codes {
    /// How many codes of each length there are.
    counts: [u16; LONGEST + 1],
    /// The symbols, by length and then by value.
    symbols: [u16; LITERALS],
}

impl Codes {
    /// Of no symbol.
    pub const NONE: Self = Self { counts: [0; LONGEST + 1], symbols: [0; LITERALS] };

    /// Takes the lengths of the codes of all symbols; gives how many bit patterns of [`LONGEST`] bits begin with no code.
    ///
    /// # Errors
    ///
    /// Where there are more codes than patterns.
    pub fn set(&mut self, lengths: &[u8]) -> Result<u32, Damaged> {
        self.counts = [0; LONGEST + 1];
        lengths.iter().for_each(|length| self.counts[usize::from(*length)] += 1);
        self.counts[0] = 0;
        let mut left = 1_u32 << LONGEST;
        let mut places = [0_u16; LONGEST + 2];
        for length in 1..=LONGEST {
            left = left.checked_sub(u32::from(self.counts[length]) << (LONGEST - length)).ok_or(Damaged)?;
            places[length + 1] = places[length] + self.counts[length];
        }
        for (symbol, length) in lengths.iter().enumerate().filter(|(_, length)| **length > 0) {
            let place = &mut places[usize::from(*length)];
            self.symbols[usize::from(*place)] = symbol as u16;
            *place += 1;
        }
        Ok(left)
    }

    /// The symbol whose code bits begin with, and how many of them that is.
    ///
    /// # Errors
    ///
    /// Where they begin with none.
    pub fn decode(&self, bits: u64) -> Result<(usize, u32), Damaged> {
        let (mut code, mut first, mut index) = (0_u32, 0_u32, 0_u32);
        for length in 1..=LONGEST {
            code |= (bits >> (length - 1) & 1) as u32;
            let count = u32::from(self.counts[length]);
            if code < first + count {
                return Ok((usize::from(self.symbols[(index + code - first) as usize]), length as u32));
            }
            index += count;
            first = (first + count) << 1;
            code <<= 1;
        }
        Err(Damaged)
    }

    /// Tells of each code of up to so many bits its symbol, its bits as they come, and how many they are.
    fn each(&self, most_bits: u32, mut tell: impl FnMut(usize, usize, u32)) {
        let (mut code, mut index) = (0_usize, 0);
        for bits in 1..=most_bits {
            for _ in 0..self.counts[bits as usize] {
                tell(usize::from(self.symbols[index]), code.reverse_bits() >> (usize::BITS - bits), bits);
                index += 1;
                code += 1;
            }
            code <<= 1;
        }
    }
}

/// What is to be done by the next bits: up to two literals are given out, or a match is, or it takes more bits than the table is entered with.
///
/// From the lowest bit: 8 that tell how many bits all of it has, the last of which says that it takes more; 6 how many its codes have, which those
/// that extend the distance follow; 2 how many literals there are; 16 of the least distance; 16 of the length of the match, which may be 0; 16 of
/// the literals.
#[derive(Clone, Copy)]
pub struct Step(u64);

impl Step {
    /// What takes more bits.
    const MORE: Self = Self(1 << 7);
    /// What stands for the distance where there is no match: that something is copied from there, which what follows overwrites, takes no branch.
    const NO_MATCH: u64 = 1 << 10;

    fn literal(value: usize, bits: u32) -> Self {
        Self(u64::from(bits) | u64::from(bits) << 8 | 1 << 14 | Self::NO_MATCH << 16 | (value as u64) << 48)
    }

    /// Another literal behind one.
    fn with(self, value: usize, bits: u32) -> Self {
        Self(self.0 + (u64::from(bits) | u64::from(bits) << 8 | 1 << 14 | (value as u64) << 56))
    }

    /// A match, the codes of whose length and distance have so many bits; the least distance, and how many bits extend it.
    fn of_match(length: usize, code_bits: u32, least: u32, extra: u32) -> Self {
        Self(u64::from(code_bits + extra) | u64::from(code_bits) << 8 | u64::from(least) << 16 | (length as u64) << 32)
    }

    /// Whether it takes more bits than the table is entered with.
    #[inline(always)]
    pub fn takes_more(self) -> bool {
        self.0 & Self::MORE.0 != 0
    }

    /// How many bits all of it has.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0 as u32 & 63
    }

    /// The distance, where its bits are followed by others.
    #[inline(always)]
    pub fn back(self, bits: u64) -> usize {
        let extra = (bits & !(u64::MAX << (self.0 & 63))) >> (self.0 >> 8 & 63);
        (self.0 >> 16 & 0xFFFF) as usize + extra as usize
    }

    /// The length of the match.
    #[inline(always)]
    pub fn length(self) -> usize {
        (self.0 >> 32 & 0x1FF) as usize
    }

    /// Two literals, and how many of them count.
    #[inline(always)]
    pub fn literals(self) -> ([u8; 2], usize) {
        (((self.0 >> 48) as u16).to_le_bytes(), (self.0 >> 14 & 3) as usize)
    }
}

/// The code of a distance: 16 bits of the least, 4 of the length of the code, the others of that and what extends it; 0 where there is none.
#[derive(Clone, Copy)]
struct Distance(u32);

impl Distance {
    fn of(symbol: usize, bits: u32) -> Self {
        Self(distance(symbol).map_or(0, |(least, extra)| least | bits << 16 | extra << 20))
    }
}

/// The codes of a block.
pub struct Tables {
    /// What is to be done by the next bits.
    pub steps: Box<[Step; 1 << STEP_BITS]>,
    /// Symbols of literals and lengths, and from bit 16 on the bits of their codes; 0 where these have more.
    symbols: Box<[u32; 1 << SYMBOL_BITS]>,
    distances: Box<[Distance; 1 << DISTANCE_BITS]>,
    literal_codes: Codes,
    distance_codes: Codes,
}

impl Tables {
    /// Of no code.
    pub fn new() -> Self {
        Self {
            steps: Box::new([Step::MORE; 1 << STEP_BITS]),
            symbols: Box::new([0; 1 << SYMBOL_BITS]),
            distances: Box::new([Distance(0); 1 << DISTANCE_BITS]),
            literal_codes: Codes::NONE,
            distance_codes: Codes::NONE,
        }
    }

    /// Takes the lengths of the codes of all symbols.
    ///
    /// # Errors
    ///
    /// Where these are no whole codes; of distances there may be none, or one of a single bit.
    pub fn set(&mut self, literals: &[u8], distances: &[u8]) -> Result<(), Damaged> {
        if self.literal_codes.set(literals)? != 0 {
            return Err(Damaged);
        }
        let left = self.distance_codes.set(distances)?;
        let is_single = left == 1 << (LONGEST - 1) && self.distance_codes.counts[1] == 1;
        if left != 0 && left != 1 << LONGEST && !is_single {
            return Err(Damaged);
        }
        let Self { symbols, distances, literal_codes, distance_codes, .. } = self;
        symbols.fill(0);
        literal_codes.each(SYMBOL_BITS, |symbol, code, bits| {
            symbols[code..].iter_mut().step_by(1 << bits).for_each(|place| *place = symbol as u32 | bits << 16);
        });
        distances.fill(Distance(0));
        distance_codes.each(DISTANCE_BITS, |symbol, code, bits| {
            distances[code..].iter_mut().step_by(1 << bits).for_each(|place| *place = Distance::of(symbol, bits));
        });
        self.join();
        Ok(())
    }

    /// Makes steps of what one symbol and the next stand for.
    fn join(&mut self) {
        let Self { steps, symbols, distances, literal_codes, .. } = self;
        steps.fill(Step::MORE);
        literal_codes.each(STEP_BITS, |symbol, code, bits| {
            if symbol < END {
                let first = Step::literal(symbol, bits);
                for (next, place) in steps[code..].iter_mut().step_by(1 << bits).enumerate() {
                    let second = symbols[next & ((1 << SYMBOL_BITS) - 1)];
                    let (symbol, of_second) = ((second & 0xFFFF) as usize, second >> 16);
                    let are_two = second != 0 && symbol < END && bits + of_second <= STEP_BITS;
                    *place = if are_two { first.with(symbol, of_second) } else { first };
                }
            }
            let Some((least, extra)) = length(symbol).filter(|(_, extra)| bits + extra < STEP_BITS) else { return };
            let all = bits + extra;
            for more in 0..1 << extra {
                let code = code + (more << bits);
                for (next, place) in steps[code..].iter_mut().step_by(1 << all).enumerate() {
                    let Distance(told) = distances[next & ((1 << DISTANCE_BITS) - 1)];
                    let code_bits = all + (told >> 16 & 15);
                    let step = Step::of_match(least + more, code_bits, told & 0xFFFF, told >> 20);
                    *place = if told != 0 && code_bits <= STEP_BITS { step } else { Step::MORE };
                }
            }
        });
    }

    /// The symbol of a literal or length whose code bits begin with, and how many of them that is.
    ///
    /// # Errors
    ///
    /// Where they begin with none.
    pub fn symbol(&self, bits: u64) -> Result<(usize, u32), Damaged> {
        match self.symbols[bits as usize & ((1 << SYMBOL_BITS) - 1)] {
            0 => self.literal_codes.decode(bits),
            told => Ok(((told & 0xFFFF) as usize, told >> 16)),
        }
    }

    /// The distance that bits begin with, and how many of them that is.
    ///
    /// # Errors
    ///
    /// Where they begin with none.
    pub fn distance(&self, bits: u64) -> Result<(usize, u32), Damaged> {
        let Distance(told) = match self.distances[bits as usize & ((1 << DISTANCE_BITS) - 1)] {
            Distance(0) => {
                let (symbol, code_bits) = self.distance_codes.decode(bits)?;
                Distance::of(symbol, code_bits)
            }
            told => told,
        };
        if told == 0 {
            return Err(Damaged);
        }
        let (code_bits, extra) = (told >> 16 & 15, told >> 20);
        let more = bits >> code_bits & ((1 << extra) - 1);
        Ok((((told & 0xFFFF) as usize) + more as usize, code_bits + extra))
    }
}
