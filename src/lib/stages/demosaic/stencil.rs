//! Weights on the sites around a pixel, and the places of a pixel in the period of the filter array.

use crate::frame::mirror;

/// The farthest row or column that any method's weights reach.
pub const REACH: isize = 3;
const SIDE: usize = 2 * REACH.unsigned_abs() + 1;

/// Weights on the sites around a pixel, up to [`REACH`] rows and columns away.
#[derive(Debug, Clone, PartialEq)]
pub struct Stencil([f64; SIDE * SIDE]);

fn index([x, y]: [isize; 2]) -> usize {
    assert!(x.abs() <= REACH && y.abs() <= REACH, "no weight reaches {x},{y}");
    ((y + REACH) * SIDE.cast_signed() + x + REACH).cast_unsigned()
}

impl Stencil {
    /// No weight anywhere.
    pub fn zero() -> Self {
        Self([0.0; SIDE * SIDE])
    }

    /// Weight 1 on one site, `offset` (column, row) away.
    pub fn site(offset: [isize; 2]) -> Self {
        let mut stencil = Self::zero();
        stencil.0[index(offset)] = 1.0;
        stencil
    }

    /// The weight on the site `offset` (column, row) away.
    pub fn at(&self, offset: [isize; 2]) -> f64 {
        self.0[index(offset)]
    }

    /// This and `factor` times another.
    #[must_use]
    pub fn plus(mut self, factor: f64, other: &Self) -> Self {
        for (mine, theirs) in self.0.iter_mut().zip(&other.0) {
            *mine += factor * theirs;
        }
        self
    }

    /// The sum of weights on sites: offset (column, row), weight; a site may come more than once.
    pub fn of_sites(sites: impl Iterator<Item = ([isize; 2], f64)>) -> Self {
        let mut stencil = Self::zero();
        sites.for_each(|(offset, weight)| stencil.0[index(offset)] += weight);
        stencil
    }

    /// The same about the pixel `at` (column, row) of a frame of that size, what lies beyond its edges folded back: sites
    /// that coincide add their weights.
    #[must_use]
    pub fn folded(&self, at: [usize; 2], frame: [usize; 2]) -> Self {
        let back = |offset: isize, axis: usize| {
            mirror(at[axis].cast_signed() + offset, frame[axis]).cast_signed() - at[axis].cast_signed()
        };
        Self::of_sites(self.sites().map(|([x, y], weight)| ([back(x, 0), back(y, 1)], weight)))
    }

    /// The sites that have weight: offset (column, row), weight.
    pub fn sites(&self) -> impl Iterator<Item = ([isize; 2], f64)> + '_ {
        offsets().zip(self.0).filter(|(_, weight)| *weight != 0.0)
    }
}

/// All offsets that a stencil has, in its own order.
fn offsets() -> impl Iterator<Item = [isize; 2]> {
    (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| [x, y]))
}

/// A place in the 2×2 period of a color filter array: parities of the sensor's column and row.
pub const PHASES: [[isize; 2]; 4] = [[0, 0], [1, 0], [0, 1], [1, 1]];

/// The phase, as an index into [`PHASES`], of the sensor's column `x` and row `y`.
pub fn phase(x: i64, y: i64) -> usize {
    usize::from(y & 1 != 0) * 2 + usize::from(x & 1 != 0)
}
