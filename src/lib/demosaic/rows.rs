//! Rows of one plane on their way through a filter: a few at a time, the last over the first, with mirrored margins, so
//! that the inner loops have neither edges nor branches.

use crate::frame::{mirror, to_sample};
use crate::numerics::vectors::{self, Instructions, Kernel};

/// Columns of margin on either side: no method reaches farther.
const MARGIN: usize = 3;

/// Rows that a ring holds: those that the farthest reaching method looks at, up to a power of two.
const DEPTH: usize = 8;

/// Where samples begin to be large: sums of samples below it, of any method, stay far below the largest float.
const LARGE: f32 = 1.329_228e36; // 2¹²⁰

/// The last rows of a plane.
pub(super) struct Ring {
    width: usize,
    samples: Vec<f32>,
    /// Whether a row holds large samples, or any that are not finite.
    is_large: [bool; DEPTH],
}

/// One row of a plane and its margins.
#[derive(Clone, Copy)]
pub(super) struct Line<'a>(&'a [f32]);

impl<'a> Line<'a> {
    /// The row seen from `by` columns beside each: its columns, `by` added.
    #[inline(always)]
    pub(super) fn beside(self, by: isize) -> &'a [f32] {
        let width = self.0.len() - 2 * MARGIN;
        &self.0[MARGIN.wrapping_add_signed(by)..][..width]
    }

    /// The sample of column `x`, which may lie in the margin.
    fn at(self, x: isize) -> f64 {
        f64::from(self.0[MARGIN.wrapping_add_signed(x)])
    }
}

impl Ring {
    /// Room for rows of `width` columns.
    pub(super) fn new(width: usize) -> Self {
        Self { width, samples: vec![0.0; DEPTH * (width + 2 * MARGIN)], is_large: [false; DEPTH] }
    }

    fn place(y: isize) -> usize {
        y.rem_euclid(DEPTH.cast_signed()).cast_unsigned()
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

    /// Fills the columns of row `y` by a function, and mirrors its margins.
    pub(super) fn fill<T>(&mut self, y: isize, make: impl FnOnce(&mut [f32]) -> T) -> T {
        let stride = self.width + 2 * MARGIN;
        let line = &mut self.samples[Self::place(y) * stride..][..stride];
        let made = make(&mut line[MARGIN..MARGIN + self.width]);
        for x in 1..=MARGIN {
            line[MARGIN - x] = line[MARGIN + mirror(-x.cast_signed(), self.width)];
            let right = self.width - 1 + x;
            line[MARGIN + right] = line[MARGIN + mirror(right.cast_signed(), self.width)];
        }
        made
    }

    /// Fills row `y` with samples less a black level.
    pub(super) fn load(&mut self, instructions: Instructions, y: isize, samples: &[f32], black: f64) {
        let is_large = self.fill(y, |to| vectors::run_on(instructions, Subtract { samples, black, to }));
        self.is_large[Self::place(y)] = is_large;
    }

    /// Whether any of the rows up to `reach` from `y` holds large samples.
    pub(super) fn has_large(&self, y: isize, reach: usize) -> bool {
        let reach = reach.cast_signed();
        (y - reach..=y + reach).any(|y| self.is_large[Self::place(y)])
    }
}

/// Subtracts a black level, in doubles, as it need not be a float; tells whether large samples are left.
struct Subtract<'a> {
    samples: &'a [f32],
    black: f64,
    to: &'a mut [f32],
}

impl Kernel for Subtract<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let mut large = Excess::default();
        for (to, &sample) in self.to.iter_mut().zip(self.samples) {
            *to = to_sample(f64::from(sample) - self.black);
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

/// For each column of a row, all bits where its photosite measured red or blue, none where it measured green.
#[derive(Clone, Copy)]
pub(super) struct Sites<'a>(&'a [u32]);

impl<'a> Sites<'a> {
    /// Room for [`Self::new`] over `width` columns.
    pub(super) fn alternating(width: usize) -> Vec<u32> {
        (0..=width).map(|x| if x % 2 == 0 { u32::MAX } else { 0 }).collect()
    }

    /// Red or blue at the columns of parity `parity`, from [`Self::alternating`].
    pub(super) fn new(alternating: &'a [u32], parity: usize) -> Self {
        Self(&alternating[parity..][..alternating.len() - 1])
    }

    /// The first `width` columns.
    #[inline(always)]
    pub(super) fn masks(self, width: usize) -> &'a [u32] {
        &self.0[..width]
    }
}

/// Of two values, the first where the mask of [`Sites`] is set.
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
