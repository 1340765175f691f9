//! Inflates what PNG holds, zlib \[RFC1950] of Deflate \[RFC1951], a piece at a time.
//!
//! What is no such stream to the letter is left to the crate `png`, which knows what to say of it.
#![expect(clippy::cast_possible_truncation, reason = "fields of a few bits")]

use super::codes::{Codes, DISTANCES, Damaged, END, LITERALS, STEP_BITS, Step, Tables, length};

/// How many bytes back a match may reach.
const WINDOW: usize = 1 << 15;
/// What is inflated behind the window before that moves on.
const PIECE: usize = 1 << 15;
/// What one turn may write beyond where it began: of each of two steps literals, a match, and the rest of its last copy.
const SLACK: usize = 2 * (3 + 512 + COPY);
const OUTPUT: usize = WINDOW + PIECE + SLACK;
/// Bytes that are copied at once.
const COPY: usize = 16;
/// Zeros behind the last input.
const PADDING: usize = 16;
/// No header of a block has more bytes.
const HEADER: usize = 1 << 10;

/// Bytes that a source has room for.
pub const ROOM: usize = (32 << 10) + 16;
const INPUT: usize = ROOM + HEADER + 8 + PADDING;

/// Where compressed bytes come from.
pub trait Source {
    /// Gives some of the next bytes in place of the first of `room`, which has [`ROOM`] at least, and tells how many; none where there are no more.
    ///
    /// # Errors
    ///
    /// Where they cannot be had, or are damaged.
    fn more(&mut self, room: &mut [u8]) -> Result<usize, Damaged>;
}

/// Where in its stream it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// Before the header of a block.
    Header,
    /// Before so many bytes that are stored as they are.
    Stored(usize),
    Codes,
    End,
}

/// A stream that is being inflated.
pub struct Inflate {
    input: Box<[u8; INPUT]>,
    /// So many bytes of the input are there, with zeros behind the last.
    there: usize,
    /// The byte of the input that is fetched next.
    at: usize,
    /// Whether no input is to come, and zeros stand behind it.
    is_all: bool,
    /// Bits that were fetched, and how many of them count.
    bits: u64,
    count: u32,
    place: Place,
    has_begun: bool,
    is_last: bool,
    output: Box<[u8; OUTPUT]>,
    /// Matches reach back to here.
    start: usize,
    /// What was inflated ends here, and what was taken of it here.
    end: usize,
    taken: usize,
    tables: Tables,
}

impl Inflate {
    /// Ready for a stream.
    pub fn new() -> Self {
        Self {
            input: Box::new([0; INPUT]),
            there: 0,
            at: 0,
            is_all: false,
            bits: 0,
            count: 0,
            place: Place::Header,
            has_begun: false,
            is_last: false,
            output: Box::new([0; OUTPUT]),
            start: WINDOW,
            end: WINDOW,
            taken: WINDOW,
            tables: Tables::new(),
        }
    }

    /// Makes ready for another stream.
    pub fn begin(&mut self) {
        (self.there, self.at, self.is_all, self.bits, self.count) = (0, 0, false, 0, 0);
        (self.place, self.has_begun, self.is_last) = (Place::Header, false, false);
        (self.start, self.end, self.taken) = (WINDOW, WINDOW, WINDOW);
    }

    /// Fills `into` with the next bytes.
    ///
    /// # Errors
    ///
    /// Where the stream ends before, or is damaged.
    pub fn read(&mut self, mut into: &mut [u8], source: &mut impl Source) -> Result<(), Damaged> {
        while !into.is_empty() {
            if self.taken == self.end {
                self.inflate(source)?;
            }
            let count = into.len().min(self.end - self.taken);
            if count == 0 {
                return Err(Damaged);
            }
            let (now, later) = into.split_at_mut(count);
            now.copy_from_slice(&self.output[self.taken..self.taken + count]);
            self.taken += count;
            into = later;
        }
        Ok(())
    }

    /// Inflates more; all before was taken.
    fn inflate(&mut self, source: &mut impl Source) -> Result<(), Damaged> {
        if self.end >= WINDOW + PIECE {
            let gone = self.end - WINDOW;
            self.output.copy_within(gone..self.end, 0);
            self.start = self.start.saturating_sub(gone);
            (self.end, self.taken) = (WINDOW, WINDOW);
        }
        while self.end < WINDOW + PIECE && self.place != Place::End {
            if self.at + PADDING > self.there {
                self.fill(PADDING, source)?;
            }
            match self.place {
                Place::Header => self.header(source)?,
                Place::Stored(left) => self.stored(left)?,
                Place::Codes => self.steps()?,
                Place::End => {}
            }
            // Zeros behind the end are no part of it.
            if self.is_all && self.at - self.count as usize / 8 > self.there - PADDING {
                return Err(Damaged);
            }
        }
        Ok(())
    }

    /// Has so many bytes of input at hand, or all there are.
    fn fill(&mut self, least: usize, source: &mut impl Source) -> Result<(), Damaged> {
        while self.at + least > self.there && !self.is_all {
            // Bytes of which bits were fetched that may go back stay.
            let gone = self.at.saturating_sub(8);
            self.input.copy_within(gone..self.there, 0);
            (self.at, self.there) = (self.at - gone, self.there - gone);
            let more = source.more(&mut self.input[self.there..])?;
            self.there += more;
            if more == 0 {
                self.is_all = true;
                self.input[self.there..self.there + PADDING].fill(0);
                self.there += PADDING;
            }
        }
        Ok(())
    }

    /// Has 56 bits at hand.
    fn fetch(&mut self) {
        while self.count < 56 {
            let byte = self.input[..self.there].get(self.at).copied().unwrap_or_default();
            self.bits |= u64::from(byte) << self.count;
            self.count += 8;
            self.at += 1;
        }
    }

    /// Takes bits.
    fn take(&mut self, count: u32) -> usize {
        if self.count < count {
            self.fetch();
        }
        let value = self.bits & ((1 << count) - 1);
        self.bits >>= count;
        self.count -= count;
        value as usize
    }

    fn header(&mut self, source: &mut impl Source) -> Result<(), Damaged> {
        if self.is_last {
            self.place = Place::End;
            return Ok(());
        }
        self.fill(HEADER, source)?;
        if !self.has_begun {
            self.has_begun = true;
            let [method, flags] = [self.take(8), self.take(8)];
            let is_zlib = method & 15 == 8 && method >> 4 < 8 && flags & 32 == 0 && (method << 8 | flags) % 31 == 0;
            if !is_zlib {
                return Err(Damaged);
            }
        }
        self.is_last = self.take(1) == 1;
        match self.take(2) {
            0 => {
                self.take(self.count % 8);
                let [length, inverse] = [self.take(16), self.take(16)];
                if length ^ inverse != 0xFFFF {
                    return Err(Damaged);
                }
                self.at -= self.count as usize / 8;
                (self.bits, self.count) = (0, 0);
                self.place = Place::Stored(length);
            }
            1 => {
                let mut lengths = [8; LITERALS];
                lengths[144..256].fill(9);
                lengths[256..280].fill(7);
                self.tables.set(&lengths, &[5; DISTANCES])?;
                self.place = Place::Codes;
            }
            2 => self.codes()?,
            _ => return Err(Damaged),
        }
        Ok(())
    }

    /// Reads the codes of a block.
    fn codes(&mut self) -> Result<(), Damaged> {
        const ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
        let (literals, distances, own) = (self.take(5) + 257, self.take(5) + 1, self.take(4) + 4);
        if literals > 286 || distances > 30 {
            return Err(Damaged);
        }
        let mut lengths = [0; ORDER.len()];
        for place in &ORDER[..own] {
            lengths[*place] = self.take(3) as u8;
        }
        let mut codes = Codes::NONE;
        if codes.set(&lengths)? != 0 {
            return Err(Damaged);
        }
        let mut lengths = [0_u8; LITERALS + DISTANCES];
        let (all, mut done) = (literals + distances, 0);
        while done < all {
            self.fetch();
            let (symbol, bits) = codes.decode(self.bits)?;
            self.take(bits);
            let (value, times) = match symbol {
                16 => (*lengths[..done].last().ok_or(Damaged)?, self.take(2) + 3),
                17 => (0, self.take(3) + 3),
                18 => (0, self.take(7) + 11),
                length => (length as u8, 1),
            };
            lengths[..all].get_mut(done..done + times).ok_or(Damaged)?.fill(value);
            done += times;
        }
        if lengths[END] == 0 {
            return Err(Damaged);
        }
        self.tables.set(&lengths[..literals], &lengths[literals..all])?;
        self.place = Place::Codes;
        Ok(())
    }

    fn stored(&mut self, left: usize) -> Result<(), Damaged> {
        if left == 0 {
            self.place = Place::Header;
            return Ok(());
        }
        let there = self.there - if self.is_all { PADDING } else { 0 };
        let count = left.min(there.saturating_sub(self.at)).min(WINDOW + PIECE - self.end);
        if count == 0 {
            return Err(Damaged);
        }
        self.output[self.end..self.end + count].copy_from_slice(&self.input[self.at..self.at + count]);
        self.at += count;
        self.end += count;
        self.place = Place::Stored(left - count);
        Ok(())
    }

    /// Decodes by the codes of the block, as long as there are input and room.
    fn steps(&mut self) -> Result<(), Damaged> {
        let Self { input, output, tables, is_all, there, .. } = self;
        let input = &input[..*there];
        let last = input.len().saturating_sub(if *is_all { 8 } else { PADDING });
        let mut at = self.at;
        let mut run = Run { bits: self.bits, count: self.count, start: self.start, end: self.end };
        while run.end < WINDOW + PIECE && at <= last {
            let Some(word) = input[at..].first_chunk::<8>() else { break };
            run.bits |= u64::from_le_bytes(*word) << run.count;
            at += ((63 - run.count) >> 3) as usize;
            run.count |= 56;
            // Two steps take 48 bits at most, and so does what follows.
            if run.step(&tables.steps, output)? && run.step(&tables.steps, output)? || run.count < 48 {
                continue;
            }
            let (symbol, bits) = tables.symbol(run.bits)?;
            run.pass(bits);
            match symbol {
                0..END => {
                    output[run.end] = symbol as u8;
                    run.end += 1;
                }
                END => {
                    self.place = Place::Header;
                    break;
                }
                _ => {
                    let (least, extra) = length(symbol).ok_or(Damaged)?;
                    let length = least + (run.bits & ((1 << extra) - 1)) as usize;
                    run.pass(extra);
                    let (back, bits) = tables.distance(run.bits)?;
                    run.pass(bits);
                    run.copy(output, back, length)?;
                }
            }
        }
        (self.at, self.bits, self.count, self.end) = (at, run.bits, run.count, run.end);
        Ok(())
    }
}

/// What changes from step to step.
struct Run {
    bits: u64,
    count: u32,
    start: usize,
    end: usize,
}

impl Run {
    #[inline(always)]
    fn pass(&mut self, bits: u32) {
        self.bits >>= bits;
        self.count -= bits;
    }

    /// Does what the next bits say; or tells that it takes more of them. Without a branch that noise decides, which processors do not foresee.
    #[inline(always)]
    fn step(&mut self, steps: &[Step; 1 << STEP_BITS], output: &mut [u8; OUTPUT]) -> Result<bool, Damaged> {
        let step = steps[self.bits as usize & ((1 << STEP_BITS) - 1)];
        if step.takes_more() {
            return Ok(false);
        }
        let (literals, count) = step.literals();
        output[self.end..self.end + 2].copy_from_slice(&literals);
        self.end += count;
        let back = step.back(self.bits);
        self.pass(step.bits());
        self.copy(output, back, step.length())?;
        Ok(true)
    }

    /// Copies what stands so far back; of no length something, which what follows overwrites.
    #[inline(always)]
    fn copy(&mut self, output: &mut [u8; OUTPUT], back: usize, length: usize) -> Result<(), Damaged> {
        let from = self.end.wrapping_sub(back);
        if from < self.start {
            too_far(length)?;
        }
        if back < COPY {
            repeat(output, self.end, back, length);
        } else {
            let bytes = output.get(from..from.wrapping_add(COPY)).and_then(<[u8]>::first_chunk::<COPY>);
            let bytes = *bytes.ok_or(Damaged)?;
            output[self.end..self.end + COPY].copy_from_slice(&bytes);
            if length > COPY {
                copy_rest(output, self.end, from, length);
            }
        }
        self.end += length;
        Ok(())
    }
}

/// A match cannot reach back so far; what stands for none may.
#[cold]
#[inline(never)]
fn too_far(length: usize) -> Result<(), Damaged> {
    if length > 0 { Err(Damaged) } else { Ok(()) }
}

/// Writes the last `back` bytes again and again, fewer than are copied at once.
#[inline(never)]
fn repeat(output: &mut [u8; OUTPUT], end: usize, back: usize, length: usize) {
    let mut bytes = [0; COPY];
    bytes[..back].copy_from_slice(&output[end - back..end]);
    for at in back..COPY {
        bytes[at] = bytes[at - back];
    }
    let whole = COPY - COPY % back;
    for done in (0..length).step_by(whole) {
        output[end + done..end + done + COPY].copy_from_slice(&bytes);
    }
}

#[inline(never)]
fn copy_rest(output: &mut [u8; OUTPUT], end: usize, from: usize, length: usize) {
    for done in (COPY..length).step_by(COPY) {
        output.copy_within(from + done..from + done + COPY, end + done);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::write::ZlibEncoder;
    use flate2::{Compression, Decompress, FlushDecompress};
    use std::io::Write;

    /// Bytes that come a few at a time.
    struct Pieces<'a>(&'a [u8], usize);

    impl Source for Pieces<'_> {
        fn more(&mut self, room: &mut [u8]) -> Result<usize, Damaged> {
            let (now, later) = self.0.split_at(self.1.min(self.0.len()));
            room[..now.len()].copy_from_slice(now);
            self.0 = later;
            Ok(now.len())
        }
    }

    /// So many bytes of a stream that comes, and is taken, a few bytes at a time.
    fn inflated(stream: &[u8], length: usize, [piece, taken]: [usize; 2]) -> Result<Vec<u8>, Damaged> {
        let (mut inflate, mut source) = (Inflate::new(), Pieces(stream, piece));
        let mut bytes = vec![0; length];
        for part in bytes.chunks_mut(taken) {
            inflate.read(part, &mut source)?;
        }
        Ok(bytes)
    }

    fn packed(bytes: &[u8], level: u32) -> Vec<u8> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(level));
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    /// So many bytes below `values`, all of one chance, or those of less bits more often.
    fn noise(count: usize, values: u32, is_even: bool) -> Vec<u8> {
        let mut state = 7_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as u32
        };
        (0..count).map(|_| ((draw() % values) >> if is_even { 0 } else { draw() % 8 }) as u8).collect()
    }

    #[test]
    fn what_was_packed_comes_out() {
        // A match can be of the distance 32768, and of 1, which repeats a byte.
        let far = [noise(32_768, 256, true), noise(32_768, 256, true), vec![7; 5000]].concat();
        let words: Vec<u8> =
            (0..60_000_u32).flat_map(|word| [((word * word) >> 9) as u8, 0, (word >> 12) as u8]).collect();
        let all = [noise(200_000, 40, false), noise(70_000, 256, true), noise(300_000, 3, true), far, words, vec![5]];
        for (which, bytes) in all.iter().enumerate() {
            for level in 0..=9 {
                let stream = packed(bytes, level);
                for parts in [[1 << 15, 1281], [1000, 1 << 20], [13, 3]] {
                    assert!(inflated(&stream, bytes.len(), parts).as_ref() == Ok(bytes), "{which} {level} {parts:?}");
                }
                assert_eq!(inflated(&stream, bytes.len() + 1, [1 << 15, 1 << 20]), Err(Damaged));
            }
        }
    }

    /// Another inflater, which is not held to the checksum behind the stream, has the same bytes wherever one is changed.
    #[test]
    fn damage_is_no_other_stream() {
        let bytes = [noise(700, 30, false), vec![9; 50], noise(200, 4, true)].concat();
        for level in [0, 1, 6] {
            let stream = packed(&bytes, level);
            let mut refused = 0;
            for bit in 16..8 * (stream.len() - 4) {
                let mut changed = stream.clone();
                changed[bit / 8] ^= 1 << (bit % 8);
                let mut wanted = vec![0; bytes.len()];
                let mut other = Decompress::new(false);
                let end = other.decompress(&changed[2..], &mut wanted, FlushDecompress::None);
                match inflated(&changed, bytes.len(), [100, 100]) {
                    Ok(found) => {
                        assert!(end.is_ok() && other.total_out() == bytes.len() as u64, "{level} {bit}");
                        assert!(found == wanted, "{level} {bit}");
                    }
                    Err(Damaged) => refused += 1,
                }
            }
            assert!(refused > 0);
            for length in 0..stream.len() - 4 {
                let cut = inflated(&stream[..length], bytes.len(), [100, 100]);
                // The last byte may hold what ends the last block alone.
                assert!(
                    cut == Err(Damaged) || length + 1 == stream.len() - 4 && cut.as_ref() == Ok(&bytes),
                    "{length}"
                );
            }
        }
    }

    /// A byte, and a match of three behind it by the codes that are fixed, the distance being 1 or 2: nothing stands two back.
    #[test]
    fn matches_reach_back_to_the_first_byte() {
        for (distance, wanted) in [("00000", Ok(b"aaaa".to_vec())), ("00001", Err(Damaged))] {
            // The last block, fixed; `a`; length 3; distance; end.
            let bits = ["1", "10", "10010001", "0000001", distance, "0000000"].concat();
            let mut stream = vec![0x78, 0x9C];
            for byte in bits.as_bytes().chunks(8) {
                stream.push(byte.iter().rev().fold(0, |byte, bit| byte << 1 | (bit - b'0')));
            }
            assert_eq!(inflated(&stream, 4, [100, 100]), wanted);
        }
    }
}
