//! What few numbers that lie far off leave alone.

/// The median of absolute deviations of a normal law, in standard deviations.
pub const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;

/// The median of numbers, which it puts into another order; of an even count the upper one.
///
/// # Panics
///
/// Without any number.
///
/// # Examples
///
/// ```
/// assert_eq!(cyanometer::numerics::robust::median(&mut [3.0, 100.0, 1.0]), 3.0);
/// ```
pub fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
