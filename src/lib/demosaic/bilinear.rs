//! Bilinear interpolation: each missing sample is the mean of its nearest neighbours of that class [HP2005, Sec. 6.1].

use super::Tile;
use crate::cfa::Class;
use crate::frame::{Rows, to_sample};
use crate::stage::Counts;

/// Fills the rows of `output` from `tile`, whose margin is at least 1.
pub(super) fn interpolate(tile: &Tile, output: &mut Rows<'_>) -> Counts {
    for y in output.range() {
        let row = y.cast_signed();
        let (class, parity) = tile.chrominance(row);
        let other = if class == Class::Red { Class::Blue } else { Class::Red };
        let [line, above, below] = [row, row - 1, row + 1].map(|y| tile.line(y));
        let planes = output.three(y);
        #[expect(clippy::needless_range_loop, reason = "the three planes advance together")]
        for index in 0..tile.width {
            let x = index.cast_signed();
            let vertical = (above.at(x) + below.at(x)) / 2.0;
            let (own, green, opposite) = if x & 1 == parity {
                (line.at(x), (line.sides(x) + vertical) / 2.0, (above.sides(x) + below.sides(x)) / 2.0)
            } else {
                (line.sides(x), line.at(x), vertical)
            };
            planes[class as usize][index] = to_sample(own);
            planes[Class::Green as usize][index] = to_sample(green);
            planes[other as usize][index] = to_sample(opposite);
        }
    }
    Counts::default()
}
