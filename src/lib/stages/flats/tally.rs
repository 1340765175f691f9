//! What a first reading of flats adds up over their photosites.

use super::blocks::Blocks;
use crate::cfa::Places;
use std::f64::consts::PI;

/// Sums over the photosites of classes.
pub(super) struct Tally {
    pub(super) sums: Vec<f64>,
    pub(super) counts: Vec<u64>,
    /// Photosites that are neither saturated nor defective, in whole cells and beside them.
    pub(super) good: Vec<u64>,
    pub(super) full: Vec<u64>,
    pub(super) finite: Vec<u64>,
    /// Sizes of the differences between photosites of a class and the next ones in rows of whole cells: their sum, and how many.
    changes: Vec<[f64; 2]>,
    /// The last photosite of each class in a row.
    pub(super) last: Vec<Option<f64>>,
    /// Whether each cell of a row of cells is whole.
    pub(super) whole: Vec<bool>,
    /// How many rows of cells have so many whole ones: Σ n and Σ n².
    rows: [f64; 2],
    /// Whole cells in each column of cells.
    columns: Vec<f64>,
    /// Photosites of each class in whole cells that each of several amplifiers has read.
    pub(super) taps: Vec<Vec<u64>>,
    /// Sums over the photosites at each place of the 2×2 at the sensor's corner, in whole cells, and how many.
    places: [(f64, f64); 4],
    /// Sums over the photosites of whole cells by where they are.
    pub(super) blocks: Blocks,
}

impl Tally {
    pub(super) fn new(classes: usize, blocks: Blocks) -> Self {
        let none = || vec![0; classes];
        Self {
            sums: vec![0.0; classes],
            counts: none(),
            good: none(),
            full: none(),
            finite: none(),
            changes: vec![[0.0; 2]; classes],
            last: vec![None; classes],
            whole: Vec::new(),
            rows: [0.0; 2],
            columns: Vec::new(),
            taps: Vec::new(),
            places: [(0.0, 0.0); 4],
            blocks,
        }
    }

    /// Takes in a photosite of a class in a whole cell, right of those before in its row, at such a place of the 2×2 of the sensor.
    pub(super) fn take(&mut self, class: usize, place: usize, flat: f64) {
        let (sum, count) = &mut self.places[place];
        *sum += flat;
        *count += 1.0;
        self.sums[class] += flat;
        self.counts[class] += 1;
        if let Some(before) = self.last[class].replace(flat) {
            let [sum, count] = self.changes[class];
            self.changes[class] = [sum + (flat - before).abs(), count + 1.0];
        }
    }

    /// Takes in that an amplifier has read a photosite of a class in a whole cell.
    pub(super) fn take_tap(&mut self, tap: usize, class: usize) {
        let classes = self.sums.len();
        self.taps.resize(self.taps.len().max(tap + 1), vec![0; classes]);
        self.taps[tap][class] += 1;
    }

    /// Takes in which cells of a row of cells are whole.
    pub(super) fn take_line(&mut self) {
        self.columns.resize(self.whole.len().max(self.columns.len()), 0.0);
        let mut count = 0.0;
        for (of_column, whole) in self.columns.iter_mut().zip(&self.whole) {
            let one = f64::from(u8::from(*whole));
            *of_column += one;
            count += one;
        }
        self.rows[0] += count;
        self.rows[1] += count * count;
    }

    /// How many rows of cells there are, and how many columns, (Σ n)²/Σ n² of n whole cells in each; none of none.
    pub(super) fn cell_lines(&self) -> Option<[f64; 2]> {
        let squares = self.columns.iter().map(|n| n * n).sum();
        let lines = [self.rows, [self.rows[0], squares]].map(|[sum, squares]| sum * sum / squares);
        (self.rows[0] > 0.0).then_some(lines)
    }

    /// The standard deviation of a class by the differences of neighbors, which slopes and dark corners leave alone; none of few.
    ///
    /// σ = √π/2 ⟨|x − x′|⟩        of normal noise
    pub(super) fn scatter(&self, class: usize) -> Option<f64> {
        /// So many tell it to about 10 %.
        const LEAST: f64 = 64.0;
        let [sum, count] = self.changes[class];
        (count >= LEAST).then(|| 0.5 * PI.sqrt() * sum / count)
    }

    /// What each place of the 2×2 shows, where what photosites scatter by is known: that of the class that does most.
    pub(super) fn places(&self) -> Option<Places> {
        let scatter = (0..self.sums.len()).map(|class| self.scatter(class)).collect::<Option<Vec<f64>>>()?;
        let largest = scatter.into_iter().fold(0.0, f64::max);
        let signal = self.places.map(|(sum, count)| sum / count);
        Some(Places { signal, variance: self.places.map(|(_, count)| largest * largest / count) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;

    /// Three rows of four, four and two whole cells: 10²/36 rows; columns of three, three, two and two: 10²/26.
    #[test]
    fn lines_of_unlike_many_cells_count_as_fewer() {
        let mut tally = Tally::new(1, Blocks::of(&Geometry::new(8, 6, &["Y"]), 1));
        assert_eq!(tally.cell_lines(), None);
        for whole in [[true; 4], [true; 4], [true, true, false, false]] {
            tally.whole = whole.to_vec();
            tally.take_line();
        }
        assert_eq!(tally.cell_lines(), Some([100.0 / 36.0, 100.0 / 26.0]));
    }
}
