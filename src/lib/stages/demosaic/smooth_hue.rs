//! Smooth hue transition interpolation: green bilinearly, red and blue through their ratios to green
//! [HP2005, Sec. 6.2; Cok1987].

use super::rows::{Excess, Line, Planes, pick};
use crate::numerics::vectors::Kernel;

/// Green and the hue x/G of a row from three rows of photosites, where they measured red or blue; what it gives at green
/// sites is not used.
///
/// Hues are taken about the black level that the rows have lost.
pub(super) struct Hues<'a> {
    pub(super) cfa: [Line<'a>; 3],
    pub(super) green: &'a mut [f32],
    pub(super) hue: &'a mut [f32],
}

impl Kernel for Hues<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { cfa: [above, line, below], green, hue } = self;
        let width = green.len();
        let hue = &mut hue[..width];
        let [left, here, right] = [-1, 0, 1].map(|by| &line.wider(by)[..width]);
        let [up, down] = [above, below].map(|line| &line.wider(0)[..width]);
        for x in 0..width {
            // Quarters first: a sum beyond the range of floats would make hues of zero.
            let sides = 0.25 * left[x] + 0.25 * right[x];
            green[x] = sides + (0.25 * up[x] + 0.25 * down[x]);
            hue[x] = here[x] / green[x];
        }
    }
}

/// Fills a row of the output from its photosites and greens, and the hues above it, in it and below it; tells whether
/// some of it is not finite, as where green is zero there is no hue.
///
/// Values made of positive samples are off by at most 8·2⁻²⁴ of themselves from those of the same samples in doubles.
pub(super) struct Row<'a> {
    pub(super) cfa: Line<'a>,
    pub(super) green: Line<'a>,
    pub(super) hues: [Line<'a>; 3],
    pub(super) masks: &'a [u32],
    pub(super) planes: Planes<'a>,
}

impl Kernel for Row<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let [above, line, below] = self.hues;
        let [own, green, other] = self.planes;
        let width = own.len();
        let (green, other, masks) = (&mut green[..width], &mut other[..width], &self.masks[..width]);
        let (cfa, restored) = (&self.cfa.beside(0)[..width], &self.green.beside(0)[..width]);
        let [above_left, up, above_right] = [-1, 0, 1].map(|by| &above.beside(by)[..width]);
        let [left, right] = [-1, 1].map(|by| &line.beside(by)[..width]);
        let [below_left, down, below_right] = [-1, 0, 1].map(|by| &below.beside(by)[..width]);
        let mut infinite = Excess::default();
        for x in 0..width {
            let diagonals = (above_left[x] + below_left[x]) + (above_right[x] + below_right[x]);
            let here = pick(masks[x], restored[x], cfa[x]);
            let by_sides = pick(masks[x], cfa[x], here * (0.5 * (left[x] + right[x])));
            let by_rows = here * pick(masks[x], 0.25 * diagonals, 0.5 * (up[x] + down[x]));
            infinite.note(by_sides, f32::INFINITY);
            infinite.note(here, f32::INFINITY);
            infinite.note(by_rows, f32::INFINITY);
            own[x] = by_sides;
            green[x] = here;
            other[x] = by_rows;
        }
        infinite.is_found()
    }
}
