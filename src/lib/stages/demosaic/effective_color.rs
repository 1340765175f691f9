//! Effective color interpolation: everything through the differences K_R = G − R and K_B = G − B
//! [HP2005, Sec. 6.3; PeiTam2003].

use super::rows::{Line, Planes, pick};
use crate::numerics::vectors::Kernel;

/// The differences K of a row from five rows of photosites; what it gives at green sites is not used.
///
/// K_R at a green site is G − (R_above + R_below)/2 (the printed minus sign between the two is a misprint), or the same
/// with the red neighbors at its sides; that at a red site is the mean of the four around it. In samples x around a
/// red site, d sites away,
///
/// K = ¼ Σ x₁ − ⅛ Σ x₂ − ½ x₀
pub(super) struct Differences<'a> {
    pub(super) cfa: [Line<'a>; 5],
    pub(super) to: &'a mut [f32],
}

impl Kernel for Differences<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { cfa: [above2, above, line, below, below2], to } = self;
        let width = to.len();
        let [left2, left, here, right, right2] = [-2, -1, 0, 1, 2].map(|by| &line.wider(by)[..width]);
        let [up2, up, down, down2] = [above2, above, below, below2].map(|line| &line.wider(0)[..width]);
        for x in 0..width {
            let near = (left[x] + right[x]) + (up[x] + down[x]);
            let far = (left2[x] + right2[x]) + (up2[x] + down2[x]);
            to[x] = (0.25 * near - 0.125 * far) - 0.5 * here[x];
        }
    }
}

/// Fills a row of the output from its photosites and the differences above it, in it and below it.
///
/// With samples of at most M in size, values are off by at most 25·2⁻²⁴ M from those of the same samples in doubles.
pub(super) struct Row<'a> {
    pub(super) cfa: Line<'a>,
    pub(super) differences: [Line<'a>; 3],
    pub(super) masks: &'a [u32],
    pub(super) planes: Planes<'a>,
}

impl Kernel for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [above, line, below] = self.differences;
        let [own, green, other] = self.planes;
        let width = own.len();
        let (green, other, masks) = (&mut green[..width], &mut other[..width], &self.masks[..width]);
        let cfa = &self.cfa.beside(0)[..width];
        let [above_left, up, above_right] = [-1, 0, 1].map(|by| &above.beside(by)[..width]);
        let [left, here, right] = [-1, 0, 1].map(|by| &line.beside(by)[..width]);
        let [below_left, down, below_right] = [-1, 0, 1].map(|by| &below.beside(by)[..width]);
        for x in 0..width {
            let diagonals = (above_left[x] + below_left[x]) + (above_right[x] + below_right[x]);
            let restored = cfa[x] + here[x];
            own[x] = pick(masks[x], cfa[x], cfa[x] - 0.5 * (left[x] + right[x]));
            green[x] = pick(masks[x], restored, cfa[x]);
            other[x] = pick(masks[x], restored - 0.25 * diagonals, cfa[x] - 0.5 * (up[x] + down[x]));
        }
    }
}
