//! Bilinear interpolation: each missing sample is the mean of its nearest neighbors of that class [HP2005, Sec. 6.1].

use super::rows::{Line, Planes, pick};
use crate::numerics::vectors::Kernel;

/// Fills a row of the output from the photosites above it, in it and below it.
///
/// With samples of at most M in size, a mean is off by at most 2·2⁻²⁴ M from that of the same samples in doubles.
pub(super) struct Row<'a> {
    pub(super) cfa: [Line<'a>; 3],
    pub(super) masks: &'a [u32],
    pub(super) planes: Planes<'a>,
}

impl Kernel for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [above, line, below] = self.cfa;
        let [own, green, other] = self.planes;
        let width = own.len();
        let (green, other, masks) = (&mut green[..width], &mut other[..width], &self.masks[..width]);
        let [above_left, up, above_right] = [-1, 0, 1].map(|by| &above.beside(by)[..width]);
        let [left, here, right] = [-1, 0, 1].map(|by| &line.beside(by)[..width]);
        let [below_left, down, below_right] = [-1, 0, 1].map(|by| &below.beside(by)[..width]);
        for x in 0..width {
            let sides = left[x] + right[x];
            let ends = up[x] + down[x];
            let diagonals = (above_left[x] + below_left[x]) + (above_right[x] + below_right[x]);
            own[x] = pick(masks[x], here[x], 0.5 * sides);
            green[x] = pick(masks[x], 0.25 * (sides + ends), here[x]);
            other[x] = pick(masks[x], 0.25 * diagonals, 0.5 * ends);
        }
    }
}
