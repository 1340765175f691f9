//! Smooth hue transition interpolation: green bilinearly, red and blue through their ratios to green
//! [HP2005, Sec. 6.2; Cok1987].

use super::{Tile, restore_from_hues};
use crate::frame::Rows;
use crate::stage::Counts;

/// Fills the rows of `output` from `tile`, whose margin is at least 2.
///
/// Hues are taken about the black level that the tile has lost. Where green is zero there is no hue; the bilinear value
/// stands in and is counted.
pub(super) fn interpolate(tile: &Tile, output: &mut Rows<'_>) -> Counts {
    let columns = tile.columns(1);
    let green = tile.derive(1, |y, line| {
        let (_, parity) = tile.chrominance(y);
        let [cfa, above, below] = [y, y - 1, y + 1].map(|y| tile.line(y));
        for (x, sample) in columns.clone().zip(line) {
            *sample =
                if x & 1 == parity { (cfa.sides(x) + (above.at(x) + below.at(x)) / 2.0) / 2.0 } else { cfa.at(x) };
        }
    });
    let hue = green.derive(0, |y, line| {
        let (cfa, green) = (tile.line(y), green.line(y));
        for (x, ratio) in columns.clone().zip(line) {
            *ratio = cfa.at(x) / green.at(x);
        }
    });
    restore_from_hues(tile, &green, &hue, output, |green, ratio| green * ratio)
}
