//! How unevenly flat fields were lit.

use serde::{Deserialize, Serialize};

/// What light falls on the places of the sensor, as a share of the mean over the frame: means over blocks of photosites, parabolas
/// through their centers. By it a frame was divided, with all that single photosites differ by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct Illumination {
    /// X, Y, width and height of the blocks together, on the sensor.
    area: [i32; 4],
    /// Columns and rows of blocks.
    blocks: [usize; 2],
    /// The share of each block, row by row.
    shares: Vec<f64>,
}

/// The same as it is written: the blocks of a row between blanks.
#[derive(Serialize, Deserialize)]
struct Written {
    area: [i32; 4],
    rows: Vec<String>,
}

impl From<Illumination> for Written {
    fn from(light: Illumination) -> Self {
        let shown = |row: &[f64]| row.iter().map(|share| format!("{share:.4}")).collect::<Vec<_>>().join(" ");
        Self { area: light.area, rows: light.shares.chunks(light.blocks[0]).map(shown).collect() }
    }
}

impl TryFrom<Written> for Illumination {
    type Error = String;

    fn try_from(Written { area, rows }: Written) -> Result<Self, String> {
        let share = |text: &str| text.parse().ok().filter(|share| (LEAST..f64::INFINITY).contains(share));
        let share = |text: &str| share(text).ok_or_else(|| format!("`{text}` is no share of light"));
        let of_row = |row: &String| row.split_whitespace().map(share).collect::<Result<Vec<f64>, String>>();
        let shares = rows.iter().map(of_row).collect::<Result<Vec<_>, String>>()?;
        let columns = shares.first().map_or(0, Vec::len);
        let is_grid = columns > 0 && shares.iter().all(|row| row.len() == columns);
        let is_area = area[2..].iter().all(|side| *side > 0)
            && [0, 1].iter().all(|axis| area[*axis].checked_add(area[axis + 2]).is_some());
        if !is_grid || !is_area {
            return Err("the blocks of an illumination are as many in each row, on an area of the sensor".into());
        }
        Ok(Self { area, blocks: [columns, rows.len()], shares: shares.concat() })
    }
}

impl Illumination {
    /// That of so many columns and rows of blocks, all of a size, on an area of the sensor.
    pub fn new(area: [i32; 4], blocks: [usize; 2], shares: Vec<f64>) -> Self {
        Self { area, blocks, shares: shares.into_iter().map(|share| share.max(LEAST)).collect() }
    }

    /// The least and the greatest share, of blocks and corners.
    pub fn ends(&self) -> [f64; 2] {
        let [left, top, width, height] = self.area;
        let [right, bottom] = [left + width - 1, top + height - 1];
        let corners = [[left, top], [right, top], [left, bottom], [right, bottom]].map(|corner| self.at(corner));
        let all = || self.shares.iter().copied().chain(corners);
        [all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max)]
    }

    /// The share at a photosite of the sensor; beyond the area as at its edge.
    pub fn at(&self, site: [i32; 2]) -> f64 {
        let [(column, across), (row, down)] = [0, 1].map(|axis| self.nearest(axis, site[axis]));
        let of_row = |row: usize| -> f64 {
            let shares = &self.shares[row * self.blocks[0] + column..];
            across.iter().zip(shares).map(|(weight, share)| weight * share).sum()
        };
        let rows = (row..self.blocks[1]).zip(down);
        rows.map(|(row, weight)| weight * of_row(row)).sum::<f64>().max(LEAST)
    }

    /// The first of the three blocks of a row, or column, that are nearest to a place, and the weights of a parabola through their
    /// centers: light falls off as one. Of two blocks it is a straight line.
    fn nearest(&self, axis: usize, site: i32) -> (usize, [f64; 3]) {
        let (count, length) = (self.blocks[axis], f64::from(self.area[axis + 2]));
        let from_edge = (f64::from(site) - f64::from(self.area[axis]) + 0.5).clamp(0.0, length);
        let place = from_edge / length * count as f64 - 0.5;
        match count {
            1 => (0, [1.0, 0.0, 0.0]),
            2 => (0, [1.0 - place, place, 0.0]),
            _ => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "from 0 to a number of blocks"
                )]
                let middle = (place.round().max(1.0) as usize).min(count - 2);
                let t = place - middle as f64;
                (middle - 1, [0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)])
            }
        }
    }
}

/// No place has less light, where noise or a parabola would make it so.
const LEAST: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_parabolas_between_blocks_and_beyond() {
        let falloff = |x: f64, y: f64| 1.0 - 4e-4 * (x - 19.5).powi(2) + 2e-3 * (x - 19.5) - 6e-3 * (y - 9.5);
        let shares = (0..8).map(|index| falloff(f64::from(index % 4) * 10.0 + 4.5, f64::from(index / 4) * 10.0 + 4.5));
        let light = Illumination::new([100, 50, 40, 20], [4, 2], shares.collect());
        for [x, y] in [[0, 0], [39, 19], [0, 19], [17, 3], [20, 10]] {
            let wanted = falloff(f64::from(x), f64::from(y));
            let found = light.at([100 + x, 50 + y]);
            assert!((found - wanted).abs() < 1e-9, "{x} {y}: {found} {wanted}");
        }
        assert_eq!(light.at([99, 50]), light.at([-9, 50]));
        let [least, most] = light.ends();
        assert!((least - falloff(0.0, 19.0)).abs() < 1e-9 && (most - falloff(24.5, 4.5)).abs() < 1e-9);
        let one = Illumination::new([0, 0, 8, 8], [1, 1], vec![1.0]);
        assert_eq!(one.at([3, 3]), 1.0);
    }

    #[test]
    fn it_is_written_by_rows_and_checked_when_it_is_read() {
        let light = Illumination::new([4, 2, 40, 20], [3, 2], vec![0.5, 1.0, 1.25, 0.75, 1.5, 1.0]);
        let text = serde_yaml::to_string(&light).unwrap();
        assert!(text.contains("0.5000 1.0000 1.2500"), "{text}");
        assert_eq!(serde_yaml::from_str::<Illumination>(&text).unwrap(), light);
        for (area, rows) in [
            ("[0, 0, 8, 8]", "['1 1', '1']"),
            ("[0, 0, 8, 8]", "[]"),
            ("[0, 0, 8, 8]", "['']"),
            ("[0, 0, 8, 8]", "['0 1']"),
            ("[0, 0, 8, 8]", "['nan 1']"),
            ("[0, 0, 0, 8]", "['1 1']"),
            ("[2147483647, 0, 8, 8]", "['1 1']"),
        ] {
            let found = serde_yaml::from_str::<Illumination>(&format!("area: {area}\nrows: {rows}\n"));
            assert!(found.is_err(), "{area} {rows}");
        }
    }
}
