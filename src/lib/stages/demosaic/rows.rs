//! Rows of one plane on their way through a filter: a few at a time, the last over the first, strip by strip of columns,
//! with margins, so that the inner loops have neither edges nor branches and stay in the level-1 cache.

use crate::camera::levels::RowBlack;
use crate::frame::{mirror, to_sample};
use crate::numerics::vectors::{self, Instructions, Kernel};
use std::ops::Range;

/// Columns of margin on either side: no method reaches farther.
const MARGIN: usize = 3;

/// Rows that a ring holds: those that the farthest reaching method looks at, up to a power of two.
const DEPTH: usize = 8;

/// Columns of a strip at most: even, so that all strips begin with the same class.
const STRIP: usize = 512;

/// Where samples begin to be large: sums of samples below it, of any method, stay far below the largest float.
const LARGE: f32 = 1.329_228e36; // 2¹²⁰

/// Cuts `width` columns into strips of about the same size, whole vectors but for the last.
pub(super) fn strips(width: usize) -> impl Iterator<Item = Range<usize>> {
    let size = width.div_ceil(width.div_ceil(STRIP)).next_multiple_of(64);
    (0..width).step_by(size).map(move |first| first..(first + size).min(width))
}

/// The last rows of a strip of a plane.
pub(super) struct Ring {
    /// Columns of the strip.
    width: usize,
    samples: Vec<f32>,
    /// Whether a row holds large samples, or any that are not finite.
    is_large: [bool; DEPTH],
    /// Room for the black level of each column, where it differs.
    blacks: Vec<f64>,
}

/// One row of a strip and its margins.
#[derive(Clone, Copy)]
pub(super) struct Line<'a>(&'a [f32]);

impl<'a> Line<'a> {
    /// The columns of the strip, each moved by `by`.
    #[inline(always)]
    pub(super) fn beside(self, by: isize) -> &'a [f32] {
        let width = self.0.len() - 2 * MARGIN;
        &self.0[MARGIN.wrapping_add_signed(by)..][..width]
    }

    /// The columns of the strip and one more on either side, each moved by `by`.
    #[inline(always)]
    pub(super) fn wider(self, by: isize) -> &'a [f32] {
        let width = self.0.len() - 2 * MARGIN;
        &self.0[(MARGIN - 1).wrapping_add_signed(by)..][..width + 2]
    }

    /// The sample of the strip's column `x`, which may lie in the margin.
    fn at(self, x: isize) -> f64 {
        f64::from(self.0[MARGIN.wrapping_add_signed(x)])
    }
}

impl Ring {
    /// Room for rows of any strip.
    pub(super) fn new() -> Self {
        let samples = vec![0.0; DEPTH * (STRIP + 2 * MARGIN)];
        Self { width: 0, samples, is_large: [false; DEPTH], blacks: Vec::new() }
    }

    /// Begins a strip of `width` columns.
    pub(super) fn begin(&mut self, width: usize) {
        self.width = width;
    }

    fn place(y: isize) -> usize {
        y.rem_euclid(DEPTH.cast_signed()).cast_unsigned()
    }

    fn line_mut(&mut self, y: isize) -> &mut [f32] {
        let stride = self.width + 2 * MARGIN;
        &mut self.samples[Self::place(y) * stride..][..stride]
    }

    /// The row `y`, one of the last that were filled.
    pub(super) fn line(&self, y: isize) -> Line<'_> {
        let stride = self.width + 2 * MARGIN;
        Line(&self.samples[Self::place(y) * stride..][..stride])
    }

    /// The rows about `y`, as many above and below as the array has room for.
    pub(super) fn about<const ROWS: usize>(&self, y: isize) -> [Line<'_>; ROWS] {
        std::array::from_fn(|index| self.line(y + index.cast_signed() - (ROWS / 2).cast_signed()))
    }

    /// The columns of row `y` and one more on either side, to be filled.
    pub(super) fn wider_mut(&mut self, y: isize) -> &mut [f32] {
        let width = self.width;
        &mut self.line_mut(y)[MARGIN - 1..][..width + 2]
    }

    /// Fills row `y` of the strip that begins at column `first` with the samples of a whole row less their black level.
    pub(super) fn load(
        &mut self,
        instructions: Instructions,
        y: isize,
        row: &[f32],
        first: usize,
        black: RowBlack<'_>,
    ) {
        let end = (first + self.width + MARGIN).min(row.len());
        let begin = first.saturating_sub(MARGIN);
        let mut blacks = std::mem::take(&mut self.blacks);
        let line = self.line_mut(y);
        // Where a column of the row stands in the line.
        let place = |column: usize| column + MARGIN - first;
        let (samples, to) = (&row[begin..end], &mut line[place(begin)..place(end)]);
        let is_large = match black {
            RowBlack::Uniform(black) => {
                let single = to_sample(black);
                // A difference of floats that is rounded to a double on its way to a float is the same float, as doubles
                // have more than twice the digits; a black level that is no float is taken off in doubles.
                if f64::from(single).to_bits() == black.to_bits() {
                    vectors::run_on(instructions, Subtract { samples, less_black: |sample| sample - single, to })
                } else {
                    let less_black = |sample| to_sample(f64::from(sample) - black);
                    vectors::run_on(instructions, Subtract { samples, less_black, to })
                }
            }
            RowBlack::Varying(..) => {
                blacks.clear();
                blacks.extend((begin..end).map(|column| black.at(column)));
                vectors::run_on(instructions, SubtractEach { samples, blacks: &blacks, to })
            }
        };
        for index in (0..place(begin)).chain(place(end)..line.len()) {
            let column = (index + first).cast_signed() - MARGIN.cast_signed();
            line[index] = line[place(mirror(column, row.len()))];
        }
        self.is_large[Self::place(y)] = is_large;
        self.blacks = blacks;
    }

    /// Whether any of the rows up to `reach` from `y` holds large samples.
    pub(super) fn has_large(&self, y: isize, reach: usize) -> bool {
        let reach = reach.cast_signed();
        (y - reach..=y + reach).any(|y| self.is_large[Self::place(y)])
    }
}

/// Takes the black level off samples; tells whether large ones are left.
struct Subtract<'a, F> {
    samples: &'a [f32],
    less_black: F,
    to: &'a mut [f32],
}

impl<F: Fn(f32) -> f32> Kernel for Subtract<'_, F> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let mut large = Excess::default();
        for (to, &sample) in self.to.iter_mut().zip(self.samples) {
            *to = (self.less_black)(sample);
            large.note(*to, LARGE);
        }
        large.is_found()
    }
}

/// Takes its own black level off each sample; tells whether large ones are left.
struct SubtractEach<'a> {
    samples: &'a [f32],
    blacks: &'a [f64],
    to: &'a mut [f32],
}

impl Kernel for SubtractEach<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let mut large = Excess::default();
        for ((to, &sample), black) in self.to.iter_mut().zip(self.samples).zip(self.blacks) {
            *to = to_sample(f64::from(sample) - black);
            large.note(*to, LARGE);
        }
        large.is_found()
    }
}

/// Whether any number of many is as large as a limit, or none at all: kept in integers, which are counted in any order.
#[derive(Clone, Copy, Default)]
pub(super) struct Excess(u32);

impl Excess {
    /// Notes whether `value` is not below `limit` in size.
    #[inline(always)]
    pub(super) fn note(&mut self, value: f32, limit: f32) {
        // Positive floats rise with their bits; the sum reaches the highest bit where they reach those of the limit.
        self.0 |= (value.to_bits() & 0x7fff_ffff) + (0x8000_0000 - limit.to_bits());
    }

    /// Whether there was one.
    #[inline(always)]
    pub(super) fn is_found(self) -> bool {
        self.0 >> 31 != 0
    }
}

/// All bits and none in turn.
static ALTERNATING: [u32; STRIP + 1] = {
    let mut masks = [0; STRIP + 1];
    let mut x = 0;
    while x <= STRIP {
        masks[x] = u32::MAX;
        x += 2;
    }
    masks
};

/// For each of the first `width` columns, all bits where the photosite measured red or blue, at columns of parity
/// `parity`, and none where it measured green.
pub(super) fn masks(parity: usize, width: usize) -> &'static [u32] {
    &ALTERNATING[parity..][..width]
}

/// Of two values, the first where the mask is set.
#[inline(always)]
pub(super) fn pick(mask: u32, chrominance: f32, green: f32) -> f32 {
    f32::from_bits((chrominance.to_bits() & mask) | (green.to_bits() & !mask))
}

/// A row of the output: the plane of the class that the row measures beside green, green, and the plane of the other.
pub(super) type Planes<'a> = [&'a mut [f32]; 3];

/// Replaces what was interpolated and is not finite by the bilinear value, in doubles; gives how many are finite then.
///
/// Sums of large samples may lie beyond the range of floats, quotients have no value where green is zero; the mean of
/// finite samples always is one. What is not finite because a sample is not stays so.
pub(super) fn mend([above, line, below]: [Line<'_>; 3], parity: usize, planes: Planes<'_>) -> u64 {
    let mut mended = 0;
    let [own, green, other] = planes;
    let columns = own.iter_mut().zip(green).zip(other).enumerate();
    for (index, ((own, green), other)) in columns {
        let mut keep = |sample: &mut f32, bilinear: &dyn Fn(isize) -> f64| {
            if !sample.is_finite() {
                *sample = to_sample(bilinear(index.cast_signed()));
                mended += u64::from(sample.is_finite());
            }
        };
        let sides = |line: Line<'_>, x: isize| (line.at(x - 1) + line.at(x + 1)) / 2.0;
        let vertical = |x: isize| (above.at(x) + below.at(x)) / 2.0;
        if index % 2 == parity {
            keep(green, &|x| (sides(line, x) + vertical(x)) / 2.0);
            keep(other, &|x| (sides(above, x) + sides(below, x)) / 2.0);
        } else {
            keep(own, &|x| sides(line, x));
            keep(other, &vertical);
        }
    }
    mended
}
