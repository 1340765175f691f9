//! Random numbers keyed by what is drawn, not by when: Philox 4x32-10 \[Salmon2011].
//!
//! A draw is named by seed, frame, source of noise, photosite and sensor class. Whoever asks for it, in whatever order
//! and on whatever thread, gets the same number; a crop, a mosaic or a single photosite costs only its own draws.

pub mod gaussian;
pub mod philox;
pub mod poisson;

use crate::names::{Named, serde_by_name};
use philox::{LONGEST_RUN, Words, halves, philox4x32_10};
use poisson::Table;
use std::ops::Range;

/// A source of noise: those that the paper lists (Sec. 3.3), and those of sensors that are read by row and column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// Dark-current shot noise, temporal.
    Dcsn,
    /// Dark-current non-uniformity, a fixed pattern.
    Dcnu,
    /// Signal shot noise, temporal.
    Ssn,
    /// Photo-response non-uniformity, a fixed pattern.
    Prnu,
    /// Read-out noise, temporal.
    Ron,
    /// Noise common to a row, temporal.
    RowNoise,
    /// Noise common to a column, temporal.
    ColumnNoise,
    /// Offsets of photosites, a fixed pattern.
    Dsnu,
    /// Offsets of rows, a fixed pattern.
    DsnuRow,
    /// Offsets of columns, a fixed pattern.
    DsnuColumn,
    /// Photo-response non-uniformity of rows, a fixed pattern.
    PrnuRow,
    /// Photo-response non-uniformity of columns, a fixed pattern.
    PrnuColumn,
    /// Hot pixels, a fixed pattern whose charge has shot noise.
    HotPixels,
    /// Random telegraph signals of some photosites, temporal.
    Rts,
    /// Drift of the black level along rows, temporal.
    BlackDrift,
}

impl Source {
    /// All sources, first those of Eq. 9 in its order.
    pub const ALL: [Self; 15] = [
        Self::Dcsn,
        Self::Dcnu,
        Self::Ssn,
        Self::Prnu,
        Self::Ron,
        Self::RowNoise,
        Self::ColumnNoise,
        Self::Dsnu,
        Self::DsnuRow,
        Self::DsnuColumn,
        Self::PrnuRow,
        Self::PrnuColumn,
        Self::HotPixels,
        Self::Rts,
        Self::BlackDrift,
    ];

    /// Whether the source repeats from frame to frame of one sensor.
    pub fn is_fixed_pattern(self) -> bool {
        let is_temporal = matches!(
            self,
            Self::Dcsn | Self::Ssn | Self::Ron | Self::RowNoise | Self::ColumnNoise | Self::Rts | Self::BlackDrift
        );
        !is_temporal
    }
}

impl Named for Source {
    const ALL: &'static [Self] = &Self::ALL;

    fn name(self) -> &'static str {
        match self {
            Self::Dcsn => "dcsn",
            Self::Dcnu => "dcnu",
            Self::Ssn => "ssn",
            Self::Prnu => "prnu",
            Self::Ron => "ron",
            Self::RowNoise => "row_noise",
            Self::ColumnNoise => "column_noise",
            Self::Dsnu => "dsnu",
            Self::DsnuRow => "dsnu_row",
            Self::DsnuColumn => "dsnu_column",
            Self::PrnuRow => "prnu_row",
            Self::PrnuColumn => "prnu_column",
            Self::HotPixels => "hot_pixels",
            Self::Rts => "rts",
            Self::BlackDrift => "black_drift",
        }
    }
}

serde_by_name!(Source);

/// A run of photosites of one row, at most [`LONGEST_RUN`], whose draws are made together.
///
/// One and a half Philox blocks a photosite hold all words that its five draws need but in one case of a thousand:
///
/// | key | first word of the counter | third | fourth | words |
/// |---|---|---|---|---|
/// | seed | column | frame | class · 2¹⁶ | SSN, DCSN and RON high, RON low |
/// | seed | column | frame | class · 2¹⁶ + 1 | SSN and DCSN low |
/// | sensor seed | column less bit 7 | 0 | 2²⁴ + class · 2¹⁶ | DCNU and PRNU high where bit 7 is 0, then where it is 1 |
/// | sensor seed | column less bit 7 | 0 | 2²⁴ + class · 2¹⁶ + 1 | their low words |
/// | sensor seed | column less bits 6 and 7 | 1 | 2²⁴ + class · 2¹⁶ | DSNU high where these bits are 0, 1, 2, 3 |
/// | sensor seed | column less bits 6 and 7 | 1 | 2²⁴ + class · 2¹⁶ + 1 | their low words |
/// | sensor seed | column less bits 6 and 7 | 2 | as of DSNU | hot pixels |
/// | sensor seed | column less bits 6 and 7 | 3 | as of DSNU | traps |
/// | seed | column | frame | class · 2¹⁶ + 2 | jumps of a photosite with a trap: the first word |
///
/// The second word of the counter is the row; column and row are those on the sensor. Each draw has a 64-bit word of its
/// own; low words that have a block of their own are made only where the high ones do not settle a number.
///
/// # Examples
///
/// ```
/// use cyanometer::random::{Run, RunWords, Source};
///
/// /// The read noise of photosites from `column` on, as normal numbers.
/// fn read_noise(column: i32, numbers: &mut [f32]) {
///     let (seed, sensor_seed, frame, place) = (7, 1, 0, [column, 40]);
///     let run = Run { seed, sensor_seed, frame, place, classes: [0, 1], length: numbers.len() };
///     let mut words = RunWords::default();
///     run.make_temporal(&mut words);
///     run.normals(&words, Source::Ron, numbers);
/// }
///
/// // A photosite has the same draw wherever a run begins.
/// let (mut whole, mut part) = ([0.0; 64], [0.0; 32]);
/// read_noise(0, &mut whole);
/// read_noise(32, &mut part);
/// assert_eq!(whole[32..], part);
/// ```
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
    /// Photosites, a multiple of [`VECTOR`](philox::VECTOR). Those that follow the last of [`spans`] get any words.
    pub length: usize,
}

/// Cuts the columns of a row, the first of which is `column` on the sensor, into runs: each within [`LONGEST_RUN`] columns of
/// the sensor that share their patterns' words.
pub fn spans(column: i32, width: usize) -> impl Iterator<Item = Range<usize>> {
    let offset = column.rem_euclid(COLUMNS) as usize;
    let ends = (1..).map(move |block| (block * LONGEST_RUN).saturating_sub(offset).min(width));
    let starts = std::iter::once(0).chain(ends.clone());
    starts.zip(ends).take_while(|(start, end)| start < end).map(|(start, end)| start..end)
}

/// [`LONGEST_RUN`] as a number of columns.
#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "256")]
const COLUMNS: i32 = LONGEST_RUN as i32;

/// Columns between two photosites that share a block of their patterns.
const HALF: usize = LONGEST_RUN / 2;

/// Columns between two neighbors among the four photosites that share a block of their offsets.
const QUARTER: usize = LONGEST_RUN / 4;

/// The bits of a column in which these differ.
#[expect(clippy::cast_possible_truncation, reason = "192")]
const QUARTER_BITS: u32 = (LONGEST_RUN - QUARTER) as u32;

/// The bit of a column in which two such photosites differ.
#[expect(clippy::cast_possible_truncation, reason = "128")]
const HALF_BIT: u32 = HALF as u32;

/// Memory for the words of a run.
#[derive(Debug)]
pub struct RunWords {
    temporal: Words,
    /// What two photosites share.
    shared: Words,
    /// High words of DCNU and PRNU.
    pattern: [[u32; LONGEST_RUN]; 2],
    /// High words of DSNU.
    offset: [u32; LONGEST_RUN],
}

impl Default for RunWords {
    fn default() -> Self {
        let empty = [0; LONGEST_RUN];
        Self { temporal: [empty; 4], shared: [empty; 4], pattern: [empty; 2], offset: empty }
    }
}

const PATTERN: u32 = 1 << 24;

/// Third words of the counters of fixed offsets, hot pixels and traps.
const OFFSET: u32 = 1;
/// See [`OFFSET`].
const HOT: u32 = 2;
/// See [`OFFSET`].
const TRAP: u32 = 3;

/// A photosite of a run that is unlike most, and by how much: an exponential number of mean 1.
pub type Unlike = (usize, f64);

impl Run {
    fn fourth(&self) -> [u32; 2] {
        self.classes.map(|class| u32::from(class) << 16)
    }

    /// Column and row of a photosite as words of a counter.
    #[expect(clippy::cast_possible_truncation, reason = "a run is short, and columns wrap as a sensor's do")]
    fn counter(&self, index: usize) -> [u32; 2] {
        let [x, y] = self.place.map(i32::cast_unsigned);
        [x.wrapping_add(index as u32), y]
    }

    /// Makes the words of the temporal sources.
    #[inline(always)]
    pub fn make_temporal(&self, words: &mut RunWords) {
        let [x, y] = self.counter(0);
        philox::fill(&mut words.temporal, self.length, halves(self.seed), [x, y, self.frame], self.fourth());
    }

    /// Makes the high words of the fixed patterns.
    #[inline(always)]
    pub fn make_pattern(&self, words: &mut RunWords) {
        let first = self.place[0].rem_euclid(COLUMNS) as usize;
        let end = (first + self.length).min(LONGEST_RUN);
        let is_in_one_half = first / HALF == (end - 1) / HALF;
        let made = if is_in_one_half { first % HALF..(end - 1) % HALF + 1 } else { 0..HALF };
        let [even, odd] = self.fourth().map(|class| class | PATTERN);
        let fourth = if (first - made.start).is_multiple_of(2) { [even, odd] } else { [odd, even] };
        #[expect(clippy::cast_possible_truncation, reason = "below 256")]
        let x = (self.place[0].cast_unsigned() & !(LONGEST_RUN as u32 - 1)) + made.start as u32;
        let y = self.place[1].cast_unsigned();
        philox::fill(&mut words.shared, made.len(), halves(self.sensor_seed), [x, y, 0], fourth);
        for half in first / HALF..=(end - 1) / HALF {
            let columns = first.max(half * HALF)..end.min((half + 1) * HALF);
            let from = columns.start - half * HALF - made.start..columns.end - half * HALF - made.start;
            for (source, pattern) in words.pattern.iter_mut().enumerate() {
                pattern[columns.start - first..columns.end - first]
                    .copy_from_slice(&words.shared[2 * half + source][from.clone()]);
            }
        }
    }

    /// Makes the high words of the fixed offsets of photosites.
    #[inline(always)]
    pub fn make_offsets(&self, words: &mut RunWords) {
        self.make_single(words, OFFSET);
    }

    /// Makes high words of which each photosite has one, those of four in a block.
    #[inline(always)]
    fn make_single(&self, words: &mut RunWords, kind: u32) {
        let first = self.place[0].rem_euclid(COLUMNS) as usize;
        let end = (first + self.length).min(LONGEST_RUN);
        let is_in_one = first / QUARTER == (end - 1) / QUARTER;
        let made = if is_in_one { first % QUARTER..(end - 1) % QUARTER + 1 } else { 0..QUARTER };
        let [even, odd] = self.fourth().map(|class| class | PATTERN);
        let fourth = if (first - made.start).is_multiple_of(2) { [even, odd] } else { [odd, even] };
        #[expect(clippy::cast_possible_truncation, reason = "below 256")]
        let x = (self.place[0].cast_unsigned() & !(LONGEST_RUN as u32 - 1)) + made.start as u32;
        let y = self.place[1].cast_unsigned();
        philox::fill(&mut words.shared, made.len(), halves(self.sensor_seed), [x, y, kind], fourth);
        for quarter in first / QUARTER..=(end - 1) / QUARTER {
            let columns = first.max(quarter * QUARTER)..end.min((quarter + 1) * QUARTER);
            let before = quarter * QUARTER + made.start;
            words.offset[columns.start - first..columns.end - first]
                .copy_from_slice(&words.shared[quarter][columns.start - before..columns.end - before]);
        }
    }

    /// The low word of DSNU.
    fn single_low(&self, index: usize, kind: u32) -> u32 {
        let [x, y] = self.counter(index);
        let counter = [x & !QUARTER_BITS, y, kind, self.fourth()[index % 2] | PATTERN | 1];
        philox4x32_10(counter, halves(self.sensor_seed))[(x & QUARTER_BITS) as usize / QUARTER]
    }

    /// The low words of SSN and DCSN.
    fn low(&self, index: usize) -> [u32; 4] {
        let [x, y] = self.counter(index);
        philox4x32_10([x, y, self.frame, self.fourth()[index % 2] | 1], halves(self.seed))
    }

    /// The low words of DCNU and PRNU.
    fn pattern_low(&self, index: usize) -> [u32; 2] {
        let [x, y] = self.counter(index);
        let counter = [x & !HALF_BIT, y, 0, self.fourth()[index % 2] | PATTERN | 1];
        let [a, b, c, d] = philox4x32_10(counter, halves(self.sensor_seed));
        if x & HALF_BIT == 0 { [a, b] } else { [c, d] }
    }

    /// Fills `numbers` with standard normal numbers of RON, DCNU, PRNU or DSNU, or of the word that SSN and DCSN have. Sources
    /// of rows and columns have none here, but [`of_row`] and [`of_column`].
    #[inline(always)]
    pub fn normals(&self, words: &RunWords, source: Source, numbers: &mut [f32]) {
        let (temporal, pattern) = (&words.temporal, &words.pattern);
        let length = self.length;
        match source {
            Source::Ssn => gaussian::fill(numbers, &temporal[0][..length], |index| self.low(index)[0]),
            Source::Dcsn => gaussian::fill(numbers, &temporal[1][..length], |index| self.low(index)[1]),
            Source::Ron => gaussian::fill(numbers, &temporal[2][..length], |index| temporal[3][index]),
            Source::Dcnu => gaussian::fill(numbers, &pattern[0][..length], |index| self.pattern_low(index)[0]),
            Source::Prnu => gaussian::fill(numbers, &pattern[1][..length], |index| self.pattern_low(index)[1]),
            Source::Dsnu => gaussian::fill(numbers, &words.offset[..length], |index| self.single_low(index, OFFSET)),
            _ => numbers.fill(0.0),
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

    /// The photosites of the run that are hot, or have a trap, of a sensor on which such a share is; in order.
    ///
    /// A photosite is one of them where its word, a place u in 0 to 1, is below the share; u over the share is as even, and
    /// −ln of it the excess.
    #[inline(always)]
    pub fn find_unlike(&self, words: &mut RunWords, source: Source, share: f64, found: &mut Vec<Unlike>) {
        let kind = if source == Source::HotPixels { HOT } else { TRAP };
        self.make_single(words, kind);
        found.clear();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, as is meant")]
        let highest = (share * 2f64.powi(32)).floor() as u32;
        for (index, &high) in words.offset[..self.length].iter().enumerate() {
            if high <= highest {
                let word = u64::from(high) << 32 | u64::from(self.single_low(index, kind));
                let place = (word as f64 + 0.5) * 2f64.powi(-64) / share;
                if place < 1.0 {
                    found.push((index, -libm::log(place)));
                }
            }
        }
    }

    /// Which way the reading of a photosite with a trap is off in the exposure: −1, 0 or 1, with probabilities ¼, ½ and ¼.
    pub fn jump(&self, index: usize) -> f32 {
        let [x, y] = self.counter(index);
        let [word, ..] = philox4x32_10([x, y, self.frame, self.fourth()[index % 2] | 2], halves(self.seed));
        match word >> 30 {
            0 => -1.0,
            3 => 1.0,
            _ => 0.0,
        }
    }

    /// Draws dark counts again at places of the run, each at its own rate: Poisson numbers, or normal ones of their variance.
    pub fn recount(&self, words: &RunWords, is_exact: bool, places: &[(usize, f32)], numbers: &mut [f32]) {
        let length = places.len().next_multiple_of(philox::VECTOR);
        let Some(last) = places.len().checked_sub(1) else { return };
        let place = |index: usize| places[index.min(last)];
        let [mut rates, mut counts] = [[0.0; LONGEST_RUN]; 2];
        let mut high = [0; LONGEST_RUN];
        for index in 0..length {
            (rates[index], high[index]) = (place(index).1, words.temporal[1][place(index).0]);
        }
        let low = |index: usize| self.low(place(index).0)[1];
        let (rates, counts) = (&rates[..length], &mut counts[..length]);
        if is_exact {
            poisson::fill(counts, rates, &high[..length], low);
        } else {
            gaussian::fill(counts, &high[..length], low);
            for (count, rate) in counts.iter_mut().zip(rates) {
                *count = rate + rate.sqrt() * *count;
            }
        }
        for ((index, _), count) in places.iter().zip(counts) {
            numbers[*index] = *count;
        }
    }
}

/// The draws of a whole row or column, as standard normal numbers.
///
/// | key | first and second word of the counter | third | fourth | words |
/// |---|---|---|---|---|
/// | seed | 0, row | frame | 2²⁵ | row noise |
/// | sensor seed | 0, row | 0 | 2²⁵ + 2²⁴ | DSNU and PRNU of the row |
/// | seed | column, 0 | frame | 2²⁵ + 1 | column noise |
/// | sensor seed | column, 0 | 0 | 2²⁵ + 2²⁴ + 1 | DSNU and PRNU of the column |
/// | seed | 0, knot | frame | 2²⁵ + 2 | drift of the black level at a knot, [`of_knot`] |
///
/// Each number has two words, the high one first. All classes of a row share its draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineDraws {
    /// Of noise that is drawn anew in each frame.
    pub temporal: f64,
    /// Of fixed offsets.
    pub offset: f64,
    /// Of the fixed response.
    pub response: f64,
}

const LINE: u32 = 1 << 25;

/// The draws of a row of the sensor.
pub fn of_row([seed, sensor_seed]: [u64; 2], frame: u32, row: i32) -> LineDraws {
    of_line([seed, sensor_seed], frame, [0, row.cast_unsigned()], LINE)
}

/// The draws of a column of the sensor.
pub fn of_column([seed, sensor_seed]: [u64; 2], frame: u32, column: i32) -> LineDraws {
    of_line([seed, sensor_seed], frame, [column.cast_unsigned(), 0], LINE | 1)
}

/// The draw of the black level of a frame at a knot of its drift.
pub fn of_knot(seed: u64, frame: u32, knot: i32) -> f64 {
    let [a, b, ..] = philox4x32_10([0, knot.cast_unsigned(), frame, LINE | 2], halves(seed));
    normal(a, b)
}

/// The standard normal number of two words, the high one first.
fn normal(high: u32, low: u32) -> f64 {
    gaussian::quantile(u64::from(high) << 32 | u64::from(low))
}

fn of_line([seed, sensor_seed]: [u64; 2], frame: u32, [x, y]: [u32; 2], fourth: u32) -> LineDraws {
    let [a, b, ..] = philox4x32_10([x, y, frame, fourth], halves(seed));
    let [c, d, e, f] = philox4x32_10([x, y, 0, fourth | PATTERN], halves(sensor_seed));
    LineDraws { temporal: normal(a, b), offset: normal(c, d), response: normal(e, f) }
}

#[cfg(test)]
mod tests {
    use super::philox::VECTOR;
    use super::*;

    /// Every photosite has the same high words wherever the run begins that they are made in, those of the documented
    /// blocks.
    #[test]
    fn words_belong_to_photosites() {
        let width = 700;
        for column in [0, 1, 100, 127, 128, 129, 250, 255, 256, -3, -300, i32::MAX - 100] {
            let mut covered = 0;
            for span in spans(column, width) {
                assert_eq!(span.start, covered);
                covered = span.end;
                let place = [column.wrapping_add(i32::try_from(span.start).unwrap()), -7];
                let length = span.len().next_multiple_of(VECTOR);
                let run = Run { seed: 3, sensor_seed: 1 << 40, frame: 9, place, classes: [2, 1], length };
                let mut words = RunWords::default();
                run.make_temporal(&mut words);
                run.make_pattern(&mut words);
                run.make_offsets(&mut words);
                for index in 0..span.len() {
                    let x = place[0].wrapping_add(i32::try_from(index).unwrap()).cast_unsigned();
                    let y = (-7_i32).cast_unsigned();
                    let class = [2_u32, 1][index % 2] << 16;
                    let temporal = philox4x32_10([x, y, 9, class], [3, 0]);
                    assert_eq!(words.temporal.map(|word| word[index]), temporal);
                    let block = |last: u32| philox4x32_10([x & !128, y, 0, (1 << 24) | class | last], [0, 1 << 8]);
                    let slot = if x & 128 == 0 { 0 } else { 2 };
                    assert_eq!(
                        words.pattern.map(|word| word[index]),
                        [block(0)[slot], block(0)[slot + 1]],
                        "{column} {index}"
                    );
                    assert_eq!(run.pattern_low(index), [block(1)[slot], block(1)[slot + 1]]);
                    let block = |last: u32| philox4x32_10([x & !192, y, 1, (1 << 24) | class | last], [0, 1 << 8]);
                    let slot = (x & 192) as usize / 64;
                    assert_eq!(words.offset[index], block(0)[slot], "{column} {index}");
                    assert_eq!(run.single_low(index, OFFSET), block(1)[slot]);
                }
            }
            assert_eq!(covered, width);
        }
    }

    #[test]
    fn every_part_of_the_name_changes_the_draw() {
        let words_of = |run: Run| {
            let mut words = RunWords::default();
            run.make_temporal(&mut words);
            run.make_pattern(&mut words);
            (words.temporal.map(|word| word[0]), words.pattern.map(|word| word[0]))
        };
        let base = Run { seed: 1, sensor_seed: 5, frame: 2, place: [3, 4], classes: [0, 1], length: VECTOR };
        let (temporal, pattern) = words_of(base);
        assert_eq!(words_of(base), (temporal, pattern));
        for other in [Run { seed: 1 << 32, ..base }, Run { frame: 3, ..base }] {
            let (other_temporal, other_pattern) = words_of(other);
            assert!(other_temporal.iter().zip(temporal).all(|(other, word)| *other != word));
            assert_eq!(other_pattern, pattern, "a fixed pattern is that of the sensor");
        }
        let (other_temporal, other_pattern) = words_of(Run { sensor_seed: 5 << 32, ..base });
        assert_eq!(other_temporal, temporal);
        assert!(other_pattern.iter().zip(pattern).all(|(other, word)| *other != word));
        for other in [Run { classes: [1, 0], ..base }, Run { place: [4, 3], ..base }, Run { place: [-3, 4], ..base }] {
            let (other_temporal, other_pattern) = words_of(other);
            assert!(other_temporal.iter().zip(temporal).all(|(other, word)| *other != word));
            assert!(other_pattern.iter().zip(pattern).all(|(other, word)| *other != word));
        }
        // Sources: all words of a photosite are different ones.
        let all: std::collections::BTreeSet<u32> = temporal.into_iter().chain(pattern).collect();
        assert_eq!(all.len(), temporal.len() + pattern.len());
    }
}
