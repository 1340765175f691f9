//! The entropy-coded part: Huffman codes of the sizes of differences, and the differences behind them.

use super::damaged;

/// Bits that are looked up at once. Codes of the sizes that noise makes are shorter, so that the search for longer ones is
/// rare; the table, 8 KiB, stays in the nearest cache.
const LOOKUP_BITS: u32 = 12;
/// The size for which no bits follow: the difference is 32768.
const LARGEST: u16 = 16;

/// A table of Huffman codes, for decoding \[T81, Annex C, F.2.2.3].
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Table {
    /// By the next bits, the bits of code and difference together times 256, and the size; 0 where the code is longer, where
    /// there is none, and where it is that of [`LARGEST`].
    lookup: Box<[u16; 1 << LOOKUP_BITS]>,
    /// For each length from 1 on, the first code behind those of this length, as the highest of 16 bits.
    ends: [u32; 16],
    /// For each length the first code of it.
    first_codes: [u32; 16],
    /// For each length, where the sizes of its codes begin.
    first_sizes: [usize; 16],
    sizes: Vec<u8>,
    /// Whether 16 bits follow the size 16 too, as programs wrote it before version 1.1 of DNG.
    largest_has_bits: bool,
}

impl Table {
    /// The table of so many codes of each length, and their sizes in the order of the codes.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn new(counts: [u8; 16], sizes: &[u8], largest_has_bits: bool) -> Result<Self, String> {
        if sizes.len() != counts.iter().map(|count| usize::from(*count)).sum::<usize>() || sizes.is_empty() {
            return Err(damaged("has a table of codes of the wrong length"));
        }
        if sizes.iter().any(|size| u16::from(*size) > LARGEST) {
            return Err(damaged("has differences of more than 16 bits"));
        }
        let mut table = Self {
            lookup: Box::new([0; 1 << LOOKUP_BITS]),
            ends: [0; 16],
            first_codes: [0; 16],
            first_sizes: [0; 16],
            sizes: sizes.to_vec(),
            largest_has_bits,
        };
        let (mut code, mut next) = (0u32, 0);
        for (index, (count, length)) in counts.into_iter().zip(1..).enumerate() {
            table.first_codes[index] = code;
            table.first_sizes[index] = next;
            for _ in 0..count {
                if code >= 1 << length {
                    return Err(damaged("has more codes than there can be"));
                }
                table.enter(code, length, u16::from(sizes[next]));
                code += 1;
                next += 1;
            }
            table.ends[index] = code << (16 - length);
            code <<= 1;
        }
        Ok(table)
    }

    /// Enters a code into the table of those that are looked up.
    fn enter(&mut self, code: u32, length: u32, size: u16) {
        if length > LOOKUP_BITS || size == LARGEST && !self.largest_has_bits {
            return;
        }
        let unused = LOOKUP_BITS - length;
        let first = (code << unused) as usize;
        let together = length + u32::from(size);
        let entry = u16::try_from(together << 8).unwrap_or_default() | size;
        self.lookup[first..first + (1 << unused)].fill(entry);
    }

    /// The length and the size of the code that the highest bits begin with, found by search; none where there is no such
    /// code.
    #[cold]
    fn search(&self, bits: u64) -> Option<(u32, u32)> {
        let next = (bits >> 48) as u32;
        let (index, length) = (0..).zip(1..=16).find(|(index, _)| next < self.ends[*index])?;
        let place = (next >> (16 - length)).checked_sub(self.first_codes[index])?;
        let size = self.sizes.get(self.first_sizes[index] + place as usize)?;
        Some((length, u32::from(*size)))
    }
}

/// Where in the bytes the next bit is.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bits {
    /// The next bits, from the highest on; those below [`Self::count`] are, where not zero, those that follow.
    held: u64,
    count: u32,
    /// The next byte that is not held.
    position: usize,
}

impl Bits {
    /// Holds 56 bits or more, zeros behind the last byte.
    #[inline(always)]
    fn refill(&mut self, bytes: &[u8]) {
        if let Some(next) = bytes.get(self.position..).and_then(|rest| rest.first_chunk::<8>()) {
            self.held |= u64::from_be_bytes(*next) >> self.count;
            self.position += ((63 - self.count) >> 3) as usize;
            self.count |= 56;
        } else {
            self.refill_at_end(bytes);
        }
    }

    #[cold]
    fn refill_at_end(&mut self, bytes: &[u8]) {
        while self.count <= 56 {
            let next = bytes.get(self.position).copied().unwrap_or_default();
            self.held |= u64::from(next) << (56 - self.count);
            self.position += 1;
            self.count += 8;
        }
    }

    /// Whether more bits were taken than there are.
    pub fn is_beyond(&self, bytes: &[u8]) -> bool {
        self.position as u64 * 8 - u64::from(self.count) > bytes.len() as u64 * 8
    }

    /// The next difference, modulo 2¹⁶ \[T81, H.1.2.2]; none where there is no such code.
    #[inline(always)]
    fn difference(&mut self, bytes: &[u8], table: &Table) -> Option<u16> {
        self.refill(bytes);
        let entry = u32::from(table.lookup[(self.held >> (64 - LOOKUP_BITS)) as usize]);
        let (length, size) = if entry != 0 {
            ((entry >> 8) - (entry & 0xFF), entry & 0xFF)
        } else {
            let (length, size) = table.search(self.held)?;
            if size == u32::from(LARGEST) && !table.largest_has_bits {
                self.held <<= length;
                self.count -= length;
                return Some(1 << 15);
            }
            (length, size)
        };
        let behind = self.held << length;
        // No bits are left of a shift by 64, which the language does not have.
        let value = (behind >> 1) >> (63 - size);
        // Differences whose first bit is 0 are negative, and one less in magnitude than their bits' complement.
        let negative = !(behind.cast_signed() >> 63).cast_unsigned();
        self.held = behind << size;
        self.count -= length + size;
        Some(low_16(value.wrapping_sub(negative & ((1 << size) - 1))))
    }

    /// Fills `out` with the next differences of components that take turns, each with its table.
    ///
    /// # Errors
    ///
    /// For a code that the table does not have.
    pub fn differences(&mut self, bytes: &[u8], tables: &[&Table], out: &mut [u16]) -> Result<(), String> {
        // The state stays in registers.
        let mut bits = *self;
        let done = match tables {
            [one] => out.iter_mut().try_for_each(|out| {
                *out = bits.difference(bytes, one)?;
                Some(())
            }),
            [even, odd] => out.as_chunks_mut::<2>().0.iter_mut().try_for_each(|[first, second]| {
                *first = bits.difference(bytes, even)?;
                *second = bits.difference(bytes, odd)?;
                Some(())
            }),
            _ => out.iter_mut().zip(tables.iter().cycle()).try_for_each(|(out, table)| {
                *out = bits.difference(bytes, table)?;
                Some(())
            }),
        };
        *self = bits;
        done.ok_or_else(|| if bits.is_beyond(bytes) { super::SHORT.into() } else { damaged("has a code that is none") })
    }
}

/// The lowest 16 bits.
#[expect(clippy::cast_possible_truncation, reason = "arithmetic modulo 2^16")]
fn low_16(value: u64) -> u16 {
    value as u16
}

/// Takes out the zeros that are stuffed behind each byte of ones, in place, up to a marker or the end: gives the bytes that
/// are left, and where the marker stands \[T81, F.1.2.3].
pub(super) fn unstuff(bytes: &mut [u8]) -> (usize, usize) {
    let (mut from, mut to) = (0, 0);
    loop {
        let run = bytes[from..].iter().position(|byte| *byte == 0xFF).unwrap_or(bytes.len() - from);
        bytes.copy_within(from..from + run, to);
        from += run;
        to += run;
        match bytes.get(from + 1) {
            Some(0) => {
                bytes[to] = 0xFF;
                to += 1;
                from += 2;
            }
            // Markers may have any number of these before them.
            Some(0xFF) => from += 1,
            _ => return (to, from),
        }
    }
}
