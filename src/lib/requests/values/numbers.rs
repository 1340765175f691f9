//! Numbers: what is wrong with one is said in words, and what looks like another unit is said in ours.

use crate::units;
use std::ops::Range;
use std::str::FromStr;

/// Reads numbers of exposures, `A..B`: from A to the one before B.
///
/// # Errors
///
/// What is wrong with the text, in words.
pub fn exposures(text: &str) -> Result<Range<u32>, String> {
    let wrong = || {
        let most = u32::MAX;
        format!("give the first number and the one behind the last, as in 0..100 for 0 to 99; numbers are 0 to {most}")
    };
    let (first, end) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| whole::<u32>(text).map_err(|_| wrong());
    let range = number(first)?..number(end)?;
    if range.is_empty() { Err(wrong()) } else { Ok(range) }
}

/// Reads `BLACK,WHITE`, the second above the first.
///
/// # Errors
///
/// What is expected, in words.
pub fn levels(text: &str) -> Result<[f64; 2], String> {
    match finite_list(text).as_deref() {
        Some([black, white]) if white > black => Ok([*black, *white]),
        _ => Err("give the black level and the white level above it, ADU".into()),
    }
}

/// Reads finite numbers between commas.
///
/// # Errors
///
/// What is expected, in words.
pub fn three_numbers(text: &str) -> Result<[f64; 3], String> {
    match finite_list(text).as_deref() {
        Some([a, b, c]) => Ok([*a, *b, *c]),
        _ => Err("give three numbers between commas".into()),
    }
}

/// Reads expected electrons `R,G,B`, none below zero.
///
/// # Errors
///
/// What is expected, in words.
pub fn electrons(text: &str) -> Result<[f64; 3], String> {
    let wrong = || "give the electrons of R,G,B between commas, none below 0 or above 3.4e38".to_owned();
    let found = three_numbers(text).map_err(|_| wrong())?;
    if found.iter().all(|e| (0.0..=f64::from(f32::MAX)).contains(e)) { Ok(found) } else { Err(wrong()) }
}

/// What stands between marks such as commas, all of it, each perhaps among blanks.
pub(super) fn list<T: FromStr>(text: &str, mark: char) -> Option<Vec<T>> {
    text.split(mark).map(|part| part.trim().parse().ok()).collect()
}

/// Finite numbers between commas.
pub(super) fn finite_list(text: &str) -> Option<Vec<f64>> {
    list(text, ',').filter(|numbers: &Vec<f64>| numbers.iter().all(|x| x.is_finite()))
}

/// Reads a finite number.
///
/// # Errors
///
/// What is expected, in words.
pub fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "give a number".into())
}

/// Reads a whole number that is not below zero: a seed, or the number of an exposure.
///
/// # Errors
///
/// What is expected, in words.
pub fn whole<T: FromStr + Bounded>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("give a whole number from 0 to {}", T::LARGEST))
}

/// Whole numbers and the largest of them.
pub trait Bounded {
    /// The largest.
    const LARGEST: u64;
}

impl Bounded for u64 {
    const LARGEST: u64 = u64::MAX;
}

impl Bounded for u32 {
    const LARGEST: u64 = u32::MAX as u64;
}

/// Reads a number above zero.
///
/// # Errors
///
/// What is expected, in words.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|x| *x > 0.0).ok_or_else(|| "give a number above 0".into())
}

/// Reads a number that is not below zero.
///
/// # Errors
///
/// What is expected, in words.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|x| *x >= 0.0).ok_or_else(|| "give a number that is not below 0".into())
}

/// Reads a time in s.
///
/// # Errors
///
/// What is expected, in words; what a text that looks like a time says in s.
pub fn seconds(text: &str) -> Result<f64, String> {
    let hint = in_seconds(text).map_or(String::new(), |time| format!("; it looks like {time} s"));
    positive(text).map_err(|_| format!("give a time in s, above 0{hint}"))
}

/// A time that is written with its unit, or as a fraction such as `1/30`, in s.
fn in_seconds(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches("ec").to_ascii_lowercase();
    let (amount, divisor) = [("ms", 1e3), ("us", 1e6), ("µs", 1e6), ("s", 1.0), ("", 1.0)]
        .into_iter()
        .find_map(|(unit, divisor)| Some((text.strip_suffix(unit)?.trim(), divisor)))?;
    let amount = match amount.split_once('/') {
        Some((above, below)) => positive(above.trim()).ok()? / positive(below.trim()).ok()?,
        None => positive(amount).ok()?,
    };
    (amount > 0.0).then_some(amount / divisor)
}

/// Reads a relative aperture.
///
/// # Errors
///
/// What is expected, in words.
pub fn f_number(text: &str) -> Result<f64, String> {
    let lower = text.to_ascii_lowercase();
    let number = lower.strip_prefix("f/").or_else(|| lower.strip_prefix('f')).and_then(|rest| positive(rest).ok());
    let hint = number.map_or(String::new(), |n| format!("; it looks like {n}"));
    positive(text).map_err(|_| format!("give a number above 0{hint}"))
}

/// Reads a fraction above 0 and at most 1.
///
/// # Errors
///
/// What is expected, in words.
pub fn fraction(text: &str) -> Result<f64, String> {
    let wrong = || format!("give a fraction above 0 and at most 1{}", per_cent(text));
    positive(text).ok().filter(|x| *x <= 1.0).ok_or_else(wrong)
}

/// Reads a fraction of full well, which may be more than 1.
///
/// # Errors
///
/// What is expected, in words.
pub fn filling(text: &str) -> Result<f64, String> {
    match positive(text) {
        Ok(found) if per_cent(text).is_empty() => Ok(found),
        Ok(_) | Err(_) if !per_cent(text).is_empty() => Err(format!("give a fraction of full well{}", per_cent(text))),
        other => other,
    }
}

/// What to say of a number that looks like per cent where a fraction is wanted; nothing of others.
fn per_cent(text: &str) -> String {
    let marked = text.trim().strip_suffix('%').and_then(|rest| positive(rest.trim()).ok());
    let found = marked.or_else(|| number(text).ok().filter(|x| (PER_CENT_FROM..=100.0).contains(x)));
    found.map_or(String::new(), |x| format!("; {text} looks like per cent, which is {}", units::of_per_cent(x)))
}

/// From here on a number looks like per cent; below, like a fraction that is too large.
const PER_CENT_FROM: f64 = 5.0;

/// Reads a temperature in K.
///
/// # Errors
///
/// What is expected, in words.
pub fn kelvin(text: &str) -> Result<f64, String> {
    let text = text.strip_suffix(['K', 'k']).map_or(text, str::trim_end);
    let marked = text.strip_suffix(['C', 'c']).map(|number| number.trim_end_matches(['°', ' ']));
    let celsius = match marked {
        Some(degrees) => number(degrees).ok(),
        None => number(text).ok().filter(|x| (-200.0..=0.0).contains(x)),
    };
    let hint =
        celsius.map_or(String::new(), |x| format!("; {x} looks like degrees Celsius, which is {} K", units::kelvin(x)));
    positive(text).map_err(|_| format!("give a temperature in K, above 0{hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_looks_like_another_unit_is_said_in_ours() {
        let of_time = |text: &str| seconds(text).unwrap_err();
        assert_eq!(seconds("0.033"), Ok(0.033));
        for (text, time) in
            [("33ms", "0.033"), ("33 ms", "0.033"), ("1/50", "0.02"), ("2s", "2"), ("2 sec", "2"), ("50us", "0.00005")]
        {
            assert_eq!(of_time(text), format!("give a time in s, above 0; it looks like {time} s"));
        }
        for text in ["0", "-1", "fast", "1/0", "ms"] {
            assert_eq!(of_time(text), "give a time in s, above 0");
        }
        assert_eq!(f_number("8"), Ok(8.0));
        assert_eq!(f_number("f/5.6"), Err("give a number above 0; it looks like 5.6".into()));
        let share = |text| fraction(text).unwrap_err();
        assert_eq!(
            share("99.999"),
            "give a fraction above 0 and at most 1; 99.999 looks like per cent, which is 0.99999"
        );
        assert_eq!(share("75%"), "give a fraction above 0 and at most 1; 75% looks like per cent, which is 0.75");
        assert_eq!(filling("75%"), Err("give a fraction of full well; 75% looks like per cent, which is 0.75".into()));
    }
}
