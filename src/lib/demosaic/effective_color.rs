//! Effective colour interpolation: everything through the differences K_R = G − R and K_B = G − B
//! [HP2005, Sec. 6.3; PeiTam2003].

use super::{Tile, restore_from_hues};
use crate::frame::Rows;
use crate::stage::Counts;

/// Fills the rows of `output` from `tile`, whose margin is at least 3.
///
/// K_R at a green site is G − (R_above + R_below)/2 (the printed minus sign between the two is a misprint), or the same
/// with the red neighbours at its sides.
pub(super) fn interpolate(tile: &Tile, output: &mut Rows<'_>) -> Counts {
    let columns = tile.columns(2);
    let green = tile.derive(2, |y, line| {
        let (_, parity) = tile.chrominance(y);
        let [cfa, above, below, above2, below2] = [y, y - 1, y + 1, y - 2, y + 2].map(|y| tile.line(y));
        for (x, sample) in columns.clone().zip(line) {
            let own = cfa.at(x);
            *sample = if x & 1 == parity {
                let left = cfa.at(x - 1) - (cfa.at(x - 2) + own) / 2.0;
                let right = cfa.at(x + 1) - (own + cfa.at(x + 2)) / 2.0;
                let up = above.at(x) - (above2.at(x) + own) / 2.0;
                let down = below.at(x) - (own + below2.at(x)) / 2.0;
                own + (left + right + up + down) / 4.0
            } else {
                own
            };
        }
    });
    let hue = green.derive(0, |y, line| {
        let (cfa, green) = (tile.line(y), green.line(y));
        for (x, difference) in columns.clone().zip(line) {
            *difference = green.at(x) - cfa.at(x);
        }
    });
    restore_from_hues(tile, &green, &hue, output, |green, difference| green - difference)
}
