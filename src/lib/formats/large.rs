//! Large numbers that other programs put where they have no value, and that a photon radiance may have: what stands beside them tells.

use ndarray::{Array2, ArrayView1, s};
use std::collections::BTreeMap;

/// What marks a missing value, or is one of photons or frequencies.
const LARGE: [f64; 5] = [1e15, 1e20, 1e30, 1e35, 1e36];

/// So many times larger or smaller than its neighbors a true value may be.
const RANGE: f64 = 100.0;

/// No light has more photons, in any unit, without others that say so.
const BRIGHTEST: f64 = 1e20;

/// So many columns or rows may have such numbers; where there are more all count as marks.
const MOST: usize = 1 << 12;

/// The columns of a table, or its rows where these are curves, that have such numbers, and what is said of the first of each where it
/// is a mark.
#[derive(Debug)]
pub(super) struct Large {
    by_rows: bool,
    seen: BTreeMap<usize, String>,
}

impl Large {
    pub(super) fn of(by_rows: bool) -> Self {
        Self { by_rows, seen: BTreeMap::new() }
    }

    /// Whether a number at this place, from 0, may be a true one; `problem` is what is said of it where it turns out to be none.
    pub(super) fn take(&mut self, value: f64, [row, column]: [usize; 2], problem: impl FnOnce() -> String) -> bool {
        let lane = if self.by_rows { row } else { column };
        let may_be = LARGE.contains(&value) && (self.seen.len() < MOST || self.seen.contains_key(&lane));
        if may_be {
            self.seen.entry(lane).or_insert_with(problem);
        }
        may_be
    }

    /// Makes NaN of what is a mark, and notes the curves that it spoils.
    ///
    /// # Errors
    ///
    /// What is said of a mark among wavelengths.
    pub(super) fn judge(self, numbers: &mut Array2<f64>, spoiled: &mut BTreeMap<usize, String>) -> Result<(), String> {
        for (lane, problem) in self.seen {
            let mut values = if self.by_rows { numbers.slice_mut(s![lane, 1..]) } else { numbers.column_mut(lane) };
            if are_true(values.view()) {
                continue;
            }
            let curve = if self.by_rows { Some(lane) } else { lane.checked_sub(1) };
            let Some(curve) = curve else { return Err(problem) };
            spoiled.entry(curve).or_insert(problem);
            values.iter_mut().filter(|value| LARGE.contains(value)).for_each(|value| *value = f64::NAN);
        }
        Ok(())
    }
}

/// Whether the large numbers of a curve are values of it: most others lie within two decades of them, or there are no others.
fn are_true(values: ArrayView1<f64>) -> bool {
    let (large, others): (Vec<f64>, Vec<f64>) =
        values.iter().filter(|value| !value.is_nan()).partition(|value| LARGE.contains(value));
    let least = large.iter().copied().fold(f64::INFINITY, f64::min);
    let most = large.iter().copied().fold(0.0, f64::max);
    if others.is_empty() {
        return most <= BRIGHTEST;
    }
    let is_near = |value: &f64| (most / RANGE..=least * RANGE).contains(value);
    2 * others.into_iter().filter(is_near).count() >= values.iter().filter(|value| !LARGE.contains(value)).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_numbers_are_true_beside_their_like() {
        let are_true = |values: &[f64]| are_true(ArrayView1::from(values));
        for values in [
            &[1e15, 1e15, 1e15][..],
            &[1e20],
            &[1e15, 3e15, 2e14],
            &[0.0, 2e12, 4e14, 1e15, 1.5e15],
            &[8e19, 1e20, 1.3e20],
            &[1e30, 2e30],
            // Frequencies.
            &[1e15, 7.5e14, 6e14, 5e14],
        ] {
            assert!(are_true(values), "{values:?}");
        }
        for values in [
            &[0.5, 1e15, 0.6][..],
            &[1e20, 1e20, 0.1],
            &[0.0, 0.0, 1e20],
            &[1e30, 1e30],
            &[1e36],
            &[3e13, 2e13, 1e20],
            &[1e15, 1e36],
        ] {
            assert!(!are_true(values), "{values:?}");
        }
    }

    #[test]
    fn marks_spoil_their_curve() {
        let mut numbers = ndarray::array![[400.0, 1e15, 0.5], [500.0, 2e15, 1e15], [600.0, 1e15, 0.6]];
        let mut large = Large::of(false);
        for ((row, column), value) in numbers.indexed_iter() {
            assert_eq!(large.take(*value, [row, column], || format!("{row}, {column}")), *value == 1e15);
        }
        let mut spoiled = BTreeMap::new();
        large.judge(&mut numbers, &mut spoiled).unwrap();
        assert_eq!(spoiled, BTreeMap::from([(1, "1, 2".to_owned())]));
        assert!(numbers[(1, 2)].is_nan() && numbers[(2, 1)] == 1e15);
        let mut wavelengths = ndarray::array![[400.0, 1.0], [1e20, 2.0]];
        let mut large = Large::of(false);
        assert!(large.take(1e20, [1, 0], || "it".into()));
        assert_eq!(large.judge(&mut wavelengths, &mut BTreeMap::new()), Err("it".into()));
    }
}
