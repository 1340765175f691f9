//! How flat fields are lit: means over blocks of their photosites.

use crate::frame::Geometry;
use crate::metadata::Illumination;

/// Blocks of a row, and of a column, at most: what light falls off by from one to the next is nearly straight.
const MOST: usize = 16;
/// Photosites along the side of a block at least, over which noise averages out.
const LEAST_SIDE: usize = 8;

/// Sums over blocks of photosites, of each class apart.
pub(super) struct Blocks {
    area: [i32; 4],
    size: [usize; 2],
    counts: [usize; 2],
    classes: usize,
    /// The sum of each class of each block, and of how many.
    sums: Vec<(f64, f64)>,
    /// Sums of the columns of cells within a block.
    run: Vec<f64>,
}

impl Blocks {
    /// Those of a frame with so many classes.
    pub(super) fn of(geometry: &Geometry, classes: usize) -> Self {
        let size = [geometry.width, geometry.height];
        let counts = size.map(|side| (side / LEAST_SIDE).clamp(1, MOST));
        let [width, height] = size.map(|side| i32::try_from(side).unwrap_or(i32::MAX));
        let [x, y] = geometry.origin;
        let sums = vec![(0.0, 0.0); counts[0] * counts[1] * classes];
        Self { area: [x, y, width, height], size, counts, classes, sums, run: Vec::new() }
    }

    /// Takes in the photosites of row `y` in cells of so many columns, where these are whole; of the classes `of_row`, again and again. A
    /// cell belongs to the block that its first column lies in, so that sums run from one block to the next.
    pub(super) fn take_row(&mut self, y: usize, columns: usize, row: &[f64], whole: &[bool], of_row: &[usize]) {
        let [across, down] = self.counts;
        let first = y * down / self.size[1] * across;
        self.run.resize(columns, 0.0);
        let mut begin = 0;
        for block in 0..across {
            let end = ((block + 1) * self.size[0]).div_ceil(across * columns).min(whole.len());
            self.run.fill(0.0);
            let mut count = 0_u32;
            for (cell, _) in
                row[begin * columns..].chunks_exact(columns).zip(&whole[begin..end]).filter(|(_, whole)| **whole)
            {
                self.run.iter_mut().zip(cell).for_each(|(sum, flat)| *sum += flat);
                count += 1;
            }
            for (place, added) in self.run.iter().enumerate() {
                let class = of_row[place % of_row.len()];
                let (sum, photosites) = &mut self.sums[(first + block) * self.classes + class];
                *sum += added;
                *photosites += f64::from(count);
            }
            begin = end;
        }
    }

    /// The illumination that they tell, of classes with such means; of a block without photosites that of the nearest that has some.
    pub(super) fn illumination(&self, means: &[f64]) -> Illumination {
        let share = |block: &[(f64, f64)]| {
            let lit = block.iter().zip(means).filter(|((_, count), _)| *count > 0.0);
            let (sum, count) =
                lit.fold((0.0, 0.0), |all, (of_class, mean)| (all.0 + of_class.0 / mean, all.1 + of_class.1));
            (count > 0.0).then(|| sum / count)
        };
        let known: Vec<Option<f64>> = self.sums.chunks(self.classes).map(share).collect();
        let columns = self.counts[0];
        let distance = |a: usize, b: usize| {
            (a % columns).abs_diff(b % columns).pow(2) + (a / columns).abs_diff(b / columns).pow(2)
        };
        let nearest = |block: usize| {
            let all = known.iter().enumerate().filter_map(|(other, share)| Some((distance(block, other), (*share)?)));
            all.min_by_key(|(distance, _)| *distance).map_or(1.0, |(_, share)| share)
        };
        let shares = known.iter().enumerate().map(|(block, share)| share.unwrap_or_else(|| nearest(block)));
        Illumination::new(self.area, self.counts, shares.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of 48×32 photosites of two classes: each falls off in the same way, whatever its mean; a block without any is as the next.
    #[test]
    fn classes_are_taken_together() {
        let geometry = Geometry { origin: [10, 20], ..Geometry::new(48, 32, &["plane"]) };
        let mut blocks = Blocks::of(&geometry, 2);
        for y in 0..32 {
            let light = if y < 8 { 1.0 } else { 1.5 };
            let level = |x: usize| [100.0, 700.0][(x + y) % 2] * if x < 16 { 0.5 } else { 1.25 } * light;
            let row: Vec<f64> = (0..48).map(level).collect();
            let whole: Vec<bool> = (0..24).map(|cell| cell < 16 || y < 16).collect();
            blocks.take_row(y, 2, &row, &whole, &[y % 2, (y + 1) % 2]);
        }
        let light = blocks.illumination(&[100.0, 700.0]);
        assert_eq!(blocks.sums.iter().map(|(_, count)| count).sum::<f64>(), f64::from(32 * 32 + 16 * 16));
        let shares = (0..24).map(|block| if block % 6 < 2 { 0.5 } else { 1.25 } * if block < 6 { 1.0 } else { 1.5 });
        let wanted = Illumination::new([10, 20, 48, 32], [6, 4], shares.collect());
        assert_eq!(light, wanted);
    }
}
