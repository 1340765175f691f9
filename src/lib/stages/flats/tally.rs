//! What a first reading of flats adds up.

use std::f64::consts::PI;

/// Sums over the photosites of classes.
pub(super) struct Tally {
    pub sums: Vec<f64>,
    pub counts: Vec<u64>,
    /// Photosites that are neither saturated nor defective, in whole cells and beside them.
    pub good: Vec<u64>,
    pub full: Vec<u64>,
    pub finite: Vec<u64>,
    /// Sizes of the differences between photosites of a class and the next ones in rows of whole cells: their sum, and how many.
    changes: Vec<[f64; 2]>,
    /// The last photosite of each class in a row.
    pub last: Vec<Option<f64>>,
    /// Whether each cell of a row of cells is whole.
    pub whole: Vec<bool>,
}

impl Tally {
    /// Nothing yet, of so many classes.
    pub fn new(classes: usize) -> Self {
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
        }
    }

    /// Takes in a photosite of a class in a whole cell, right of those before in its row.
    pub fn take(&mut self, class: usize, flat: f64) {
        self.sums[class] += flat;
        self.counts[class] += 1;
        if let Some(before) = self.last[class].replace(flat) {
            let [sum, count] = self.changes[class];
            self.changes[class] = [sum + (flat - before).abs(), count + 1.0];
        }
    }

    /// The standard deviation of a class by the differences of neighbors, which slopes and dark corners leave alone; none of few.
    ///
    /// σ = √π/2 ⟨|x − x′|⟩        of normal noise
    pub fn scatter(&self, class: usize) -> Option<f64> {
        /// So many tell it to about 10 %.
        const LEAST: f64 = 64.0;
        let [sum, count] = self.changes[class];
        (count >= LEAST).then(|| 0.5 * PI.sqrt() * sum / count)
    }
}
