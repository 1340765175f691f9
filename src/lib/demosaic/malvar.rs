//! The linear method of Malvar, He and Cutler: bilinear interpolation corrected by the curvature of the class that was
//! measured \[MHC2004].

use super::Tile;
use super::weights::Kernel;
use crate::cfa::Class;
use crate::frame::{Rows, to_sample};
use crate::stage::Counts;

/// Fills the rows of `output` from `tile`, whose margin is at least 2.
///
/// At a red or blue site, green is the mean of its four neighbours and half the curvature of the class measured there,
/// and the opposite class the mean of four diagonal neighbours and three quarters of that curvature; at a green site,
/// red and blue are the mean of their two neighbours and five eighths of the curvature of green.
pub(super) fn interpolate(tile: &Tile, output: &mut Rows<'_>) -> Counts {
    let mut counts = Counts::default();
    for y in output.range() {
        let row = y.cast_signed();
        let (class, parity) = tile.chrominance(row);
        let other = if class == Class::Red { Class::Blue } else { Class::Red };
        let [far_above, above, line, below, far_below] = [-2, -1, 0, 1, 2].map(|dy| tile.line(row + dy));
        let planes = output.three(y);
        #[expect(clippy::needless_range_loop, reason = "the three planes advance together")]
        for index in 0..tile.width {
            let x = index.cast_signed();
            let here = line.at(x);
            let far_sides = line.at(x - 2) + line.at(x + 2);
            let far_ends = far_above.at(x) + far_below.at(x);
            let sides = line.at(x - 1) + line.at(x + 1);
            let ends = above.at(x) + below.at(x);
            let diagonals = above.at(x - 1) + above.at(x + 1) + below.at(x - 1) + below.at(x + 1);
            let (own, green, opposite) = if x & 1 == parity {
                let curvature = 4.0 * here - far_sides - far_ends;
                (here, (2.0 * (sides + ends) + curvature) / 8.0, (2.0 * diagonals + 1.5 * curvature) / 8.0)
            } else {
                let beside = 5.0 * here - diagonals - far_sides + 0.5 * far_ends;
                let above_and_below = 5.0 * here - diagonals - far_ends + 0.5 * far_sides;
                ((4.0 * sides + beside) / 8.0, here, (4.0 * ends + above_and_below) / 8.0)
            };
            let mut keep = |class: Class, value: f64, bilinear: f64| {
                let mut sample = to_sample(value);
                if !sample.is_finite() {
                    // The corrections of samples near the end of the range may lie beyond it; their mean does not.
                    sample = to_sample(bilinear);
                    counts.undefined_hue += u64::from(sample.is_finite());
                }
                planes[class as usize][index] = sample;
            };
            if x & 1 == parity {
                keep(class, own, own);
                keep(Class::Green, green, (sides + ends) / 4.0);
                keep(other, opposite, diagonals / 4.0);
            } else {
                keep(class, own, sides / 2.0);
                keep(Class::Green, green, green);
                keep(other, opposite, ends / 2.0);
            }
        }
    }
    counts
}

/// Eighths of the 5×5 kernels of \[MHC2004, Fig. 2], top left quarter and centre lines: green at red or blue; red or
/// blue at green with its neighbours of that class beside it; red at blue, blue at red.
const GREEN: [[f64; 3]; 3] = [[0.0, 0.0, -1.0], [0.0, 0.0, 2.0], [-1.0, 2.0, 4.0]];
const BESIDE: [[f64; 3]; 3] = [[0.0, 0.0, 0.5], [0.0, -1.0, 0.0], [-1.0, 4.0, 5.0]];
const OPPOSITE: [[f64; 3]; 3] = [[0.0, 0.0, -1.5], [0.0, 2.0, 0.0], [-1.5, 0.0, 6.0]];

/// The weights of a class at a pixel with `class` giving what surrounds it.
pub(super) fn kernel(wanted: Class, class: impl Fn([isize; 2]) -> Class) -> Kernel {
    let (eighths, transposed) = match (class([0, 0]), wanted) {
        (here, wanted) if here == wanted => return Kernel::site([0, 0]),
        (_, Class::Green) => (&GREEN, false),
        (Class::Green, _) => (&BESIDE, class([1, 0]) != wanted),
        _ => (&OPPOSITE, false),
    };
    let mut kernel = Kernel::zero();
    for y in -2_isize..=2 {
        for x in -2_isize..=2 {
            let [row, column] = if transposed { [x, y] } else { [y, x] };
            let weight = eighths[2 - row.unsigned_abs()][2 - column.unsigned_abs()] / 8.0;
            kernel = kernel.plus(weight, &Kernel::site([x, y]));
        }
    }
    kernel
}
