//! Counts at one rate, looked up.

use super::exact::{quantile, tails};
use super::{LONGEST_RUN, for_unsure, settle};

/// The counts of all words at one rate, by the upper halves of the words.
///
/// The range of words is cut into 4096 cells. A cell knows its first count and the one place where the count steps up
/// within it; the few cells in the tails that have more steps are searched, and words next to a step left to
/// [`quantile`]. So the counts are those of [`quantile`], to the bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    rate: f32,
    cells: Box<[(f32, u32); CELLS]>,
    /// Count of the smallest words.
    first: f32,
    /// Upper halves of the words at which the count steps up, in rising order.
    steps: Vec<u32>,
}

const CELL_BITS: u32 = 12;
const CELLS: usize = 1 << CELL_BITS;

/// Rates of which tables are made: their few thousand steps take less than a millisecond or two.
const LARGEST: f32 = 1e5;

impl Table {
    /// The counts at `rate`; none for a rate of 0 or less, or too large.
    pub fn new(rate: f32) -> Option<Self> {
        if !(rate > 0.0 && rate <= LARGEST) {
            return None;
        }
        let exact_rate = f64::from(rate);
        let (first, last) = (quantile(exact_rate, 0), quantile(exact_rate, u64::MAX));
        let mut steps = Vec::new();
        let mut count = first;
        while count < last {
            let (below, above) = tails(count, exact_rate);
            let share = if below < above { below } else { 1.0 - above };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of 2³², below it")]
            steps.push((share * 4_294_967_296.0) as u32);
            count += 1.0;
        }
        let first = crate::frame::to_sample(first);
        let mut cells = Box::new([(f32::NAN, u32::MAX); CELLS]);
        let mut passed = 0;
        for (start, cell) in (0..=u32::MAX).step_by(1 << (32 - CELL_BITS)).zip(cells.iter_mut()) {
            let end = start | (u32::MAX >> CELL_BITS);
            let within = steps[passed..].iter().take_while(|step| **step <= end).count();
            let base = first + passed as f32;
            match within {
                0 => *cell = (base, u32::MAX),
                1 => *cell = (base, steps[passed]),
                _ => {}
            }
            passed += within;
        }
        Some(Self { rate, cells, first, steps })
    }

    /// The rate, e⁻.
    pub fn rate(&self) -> f32 {
        self.rate
    }

    /// A count by its step, where several lie in one cell.
    #[cold]
    #[inline(never)]
    fn search(&self, high: u32, low: impl Fn() -> u32) -> f32 {
        let passed = self.steps.partition_point(|step| *step < high);
        let is_near = |step: &u32| step.abs_diff(high) <= 1;
        if self.steps[passed.saturating_sub(1)..].iter().take(3).any(is_near) {
            return settle(self.rate, high, low());
        }
        self.first + passed as f32
    }
}

/// Counts of a run at the rates of two tables, by turns. `low` gives the lower half of the word of a photosite.
#[inline(always)]
pub(in crate::random) fn fill(counts: &mut [f32], tables: [&Table; 2], high: &[u32], low: impl Fn(usize) -> u32) {
    let mut unsure = [0; LONGEST_RUN];
    let unsure = &mut unsure[..high.len()];
    look_up(counts, unsure, tables, high);
    for_unsure(unsure, |index| counts[index] = tables[index % 2].search(high[index], || low(index)));
}

/// One by one, on the baseline: wide vectors fetch from tables more slowly than scalars do.
#[inline(never)]
fn look_up(counts: &mut [f32], unsure: &mut [u32], tables: [&Table; 2], high: &[u32]) {
    let (even, odd) = (&*tables[0].cells, &*tables[1].cells);
    let pairs = counts.as_chunks_mut::<2>().0.iter_mut().zip(unsure.as_chunks_mut::<2>().0);
    for (([count0, count1], [unsure0, unsure1]), [high0, high1]) in pairs.zip(high.as_chunks::<2>().0) {
        (*count0, *unsure0) = of_cell(even, *high0);
        (*count1, *unsure1) = of_cell(odd, *high1);
    }
}

#[inline(always)]
fn of_cell(cells: &[(f32, u32); CELLS], high: u32) -> (f32, u32) {
    let (base, step) = cells[(high >> (32 - CELL_BITS)) as usize];
    let count = base + if high > step { 1.0 } else { 0.0 };
    let is_near = high.wrapping_sub(step).wrapping_add(1) <= 2;
    (count, u32::from(is_near | base.is_nan()))
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of photosites")]
mod tests {
    use super::*;
    use crate::random::philox::fill as fill_words;

    #[test]
    fn tables_give_the_counts_of_quantiles() {
        for (seed, rate) in (0..).zip([1e-3, 0.4, 3.0, 9.99, 10.0, 73.21, 199.9, 4321.5, 30_000.0, 1e5]) {
            let table = Table::new(rate).unwrap();
            for x in 0..40 {
                let mut words = [[0; LONGEST_RUN]; 4];
                fill_words(&mut words, LONGEST_RUN, [seed, 9], [x, 0, 0], [0, 0]);
                // Some words at the steps, and some in the tails.
                for (index, high) in words[0].iter_mut().enumerate().filter(|(index, _)| index % 3 == 0) {
                    let step = table.steps[(index * 31 + x as usize) % table.steps.len()];
                    *high = step.wrapping_add(index as u32 % 5).wrapping_sub(2);
                }
                for (index, high) in words[0].iter_mut().enumerate().filter(|(index, _)| index % 3 == 1) {
                    *high = if index % 2 == 0 { *high >> (index % 32) } else { !(*high >> (index % 32)) };
                }
                let mut counts = [0.0; LONGEST_RUN];
                fill(&mut counts, [&table, &table], &words[0], |index| words[1][index]);
                for index in 0..LONGEST_RUN {
                    let word = u64::from(words[0][index]) << 32 | u64::from(words[1][index]);
                    let expected = crate::frame::to_sample(quantile(f64::from(rate), word));
                    assert_eq!(counts[index], expected, "rate {rate} word {word:#x}");
                }
            }
        }
        assert!([0.0, -1.0, f32::NAN, 2e5].into_iter().all(|rate| Table::new(rate).is_none()));
    }
}
