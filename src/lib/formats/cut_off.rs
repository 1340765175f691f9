//! Radiances that no light has, and zeros that stand for what was not measured: at an end that is cut off, or in a gap.

use crate::spectrum::WavelengthGrid;
use crate::text::about;
use std::ops::Range;

/// The share of the largest value that a measured spectrum does not fall from to 0 at once.
const LEAST_SHARE: f64 = 0.1;
/// So many rows beside zeros are a spectrum: fewer may be lines, or a step made by hand.
const LEAST_ROWS: usize = 8;

/// A warning of the radiances of `whose` spectrum: below zero, nothing but zeros, or cut off to zeros.
pub fn doubt_of_radiances(whose: &str, wavelength_nm: &[f64], values: &[f64]) -> Option<String> {
    let count = values.iter().filter(|value| **value < 0.0).count();
    let least = values.iter().copied().fold(0.0, f64::min);
    if values.iter().all(|value| *value == 0.0) {
        return Some(format!("{whose}: all radiances are 0"));
    }
    if count > 0 {
        let all = values.len();
        return Some(format!("{whose}: {count} of {all} radiances are below 0, down to {least}, which no light is"));
    }
    doubt(wavelength_nm, values).map(|doubt| format!("{whose}: {doubt}"))
}

/// A warning of zeros beside large values of a curve, inside the wavelengths that light is summed over; none of lines, which have few rows,
/// and of steps, which are level.
fn doubt(wavelength_nm: &[f64], values: &[f64]) -> Option<String> {
    let largest = values.iter().copied().fold(0.0, f64::max);
    let WavelengthGrid { start_nm, end_nm, .. } = WavelengthGrid::default();
    let is_seen = |place: usize| wavelength_nm[place] > start_nm && wavelength_nm[place] < end_nm;
    let falls = |near: usize, run: &[f64]| {
        let is_large = values[near] >= LEAST_SHARE * largest;
        is_large && run.len() == LEAST_ROWS && run.iter().all(|value| *value > 0.0) && is_varied(run)
    };
    let below = |zeros: &Range<usize>| falls(zeros.end, ahead(values, zeros.end));
    let above = |zeros: &Range<usize>| falls(zeros.start - 1, behind(values, zeros.start));
    let share = |near: usize| about(100.0 * values[near] / largest, 2);
    let said = zeros(values).into_iter().filter_map(|zeros| {
        let [first, last] = [wavelength_nm[zeros.start], wavelength_nm[zeros.end - 1]];
        let is_large = [zeros.start > 0 && above(&zeros), zeros.end < values.len() && below(&zeros)];
        match (zeros.start == 0, zeros.end == values.len(), is_large) {
            (true, false, [_, true]) if is_seen(zeros.end - 1) => {
                Some(format!("up to {last} nm, beside {} % of its largest", share(zeros.end)))
            }
            (false, true, [true, _]) if is_seen(zeros.start) => {
                Some(format!("from {first} nm on, beside {} % of its largest", share(zeros.start - 1)))
            }
            (false, false, [true, true]) if is_seen(zeros.start) => {
                let at = if first == last { first.to_string() } else { format!("{first} to {last}") };
                let [before, behind] = [zeros.start - 1, zeros.end].map(share);
                Some(format!("at {at} nm, between {before} and {behind} % of its largest"))
            }
            _ => None,
        }
    });
    let said: Vec<String> = said.collect();
    (!said.is_empty()).then(|| {
        let all = said.join("; ");
        format!("it is exactly 0 {all}, which counts as no light; where nothing was measured leave the rows out")
    })
}

/// The rows that are 0, those that stand together in one.
fn zeros(values: &[f64]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for place in (0..values.len()).filter(|place| values[*place] == 0.0) {
        match found.last_mut().filter(|last| last.end == place) {
            Some(last) => last.end += 1,
            None => found.push(place..place + 1),
        }
    }
    found
}

/// The rows from a place on, and those before it.
fn ahead(values: &[f64], place: usize) -> &[f64] {
    &values[place..values.len().min(place + LEAST_ROWS)]
}

fn behind(values: &[f64], place: usize) -> &[f64] {
    &values[place.saturating_sub(LEAST_ROWS)..place]
}

/// Whether most neighbors differ.
fn is_varied(run: &[f64]) -> bool {
    2 * run.windows(2).filter(|pair| pair[0] != pair[1]).count() > run.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sky over 350 to 850 nm, by 5 nm, times a share.
    fn sky(share: impl Fn(f64) -> f64) -> Option<String> {
        let nm: Vec<f64> = (0..=100).map(|row| 350.0 + 5.0 * f64::from(row)).collect();
        let values: Vec<f64> = nm.iter().map(|nm| (nm / 450.0).powf(-3.2) * share(*nm)).collect();
        doubt(&nm, &values)
    }

    fn inside(nm: f64, [from, to]: [f64; 2]) -> f64 {
        if (from..=to).contains(&nm) { 1.0 } else { 0.0 }
    }

    #[test]
    fn spectra_that_are_cut_off_are_told() {
        let told = sky(|nm| inside(nm, [450.0, 650.0])).unwrap();
        assert!(
            told.starts_with("it is exactly 0 up to 445 nm, beside 100 % of its largest; from 655 nm on, beside 31 %"),
            "{told}"
        );
        let told = sky(|nm| 1.0 - inside(nm, [500.0, 500.0])).unwrap();
        assert!(told.starts_with("it is exactly 0 at 500 nm, between "), "{told}");
        let told = sky(|nm| 1.0 - inside(nm, [500.0, 520.0])).unwrap();
        assert!(told.starts_with("it is exactly 0 at 500 to 520 nm, between "), "{told}");
    }

    #[test]
    fn lines_steps_and_what_falls_to_zero_are_none() {
        // An LED, to four decimals; a spectrum that ends where nothing is summed; one without zeros; nothing.
        assert_eq!(sky(|nm| (1e4 * (-((nm - 520.0) / 20.0).powi(2)).exp()).round()), None);
        assert_eq!(sky(|nm| inside(nm, [360.0, 900.0])), None);
        assert_eq!(sky(|_| 1.0), None);
        assert_eq!(sky(|_| 0.0), None);
        assert_eq!(doubt(&[549.0, 550.0, 551.0], &[0.0, 1.0, 0.0]), None);
        let nm: Vec<f64> = (0..200).map(|row| 380.0 + 2.0 * f64::from(row)).collect();
        let step: Vec<f64> = nm.iter().map(|nm| inside(*nm, [500.0, 600.0])).collect();
        assert_eq!(doubt(&nm, &step), None);
        // Lines of three rows each.
        let lines: Vec<f64> = (0..200).map(|row| [0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 0.4][row % 7]).collect();
        assert_eq!(doubt(&nm, &lines), None);
    }
}
