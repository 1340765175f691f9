//! Levels to go through, and the uncertainty that is wanted of them.

use crate::chain::Uncertainty;

/// Levels that a sweep may have besides 0.
const LEVELS_E: std::ops::RangeInclusive<f64> = 1e-9..=f32::MAX as f64;

/// Levels of the brightest class, in electrons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// The first.
    pub start_e: f64,
    /// The last.
    pub end_e: f64,
    /// How many there are.
    pub count: usize,
    /// Whether their ratios are equal rather than their differences.
    pub is_logarithmic: bool,
}

impl Sweep {
    /// Reads `START:END:COUNT`, `COUNT` with `log` or `lin` behind it.
    ///
    /// # Errors
    ///
    /// What is expected, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || "give START:END:COUNTlog or START:END:COUNTlin in electrons, such as 10:40000:50log".to_owned();
        let [start, end, count] = text.split(':').collect::<Vec<_>>().try_into().map_err(|_| wrong())?;
        let number = |text: &str| text.parse().ok().filter(|e: &f64| e.is_finite() && *e >= 0.0).ok_or_else(wrong);
        let (start_e, end_e) = (number(start)?, number(end)?);
        if [start_e, end_e].iter().any(|e| *e != 0.0 && !LEVELS_E.contains(e)) {
            return Err(format!(
                "the levels of a sweep are 0, or {:e} to {:.1e} electrons, the most that a sample holds",
                LEVELS_E.start(),
                LEVELS_E.end()
            ));
        }
        let count = &count.to_ascii_lowercase();
        let (count, is_logarithmic) = match (count.strip_suffix("log"), count.strip_suffix("lin")) {
            (Some(count), _) => (count, true),
            (_, Some(count)) => (count, false),
            _ => (count.as_str(), false),
        };
        let count = count.parse().ok().filter(|count| (1..=100_000).contains(count)).ok_or_else(wrong)?;
        if is_logarithmic && !(start_e > 0.0 && end_e > 0.0) {
            return Err("a logarithmic sweep starts and ends above 0 electrons".into());
        }
        Ok(Self { start_e, end_e, count, is_logarithmic })
    }

    /// The levels, one after another.
    pub fn levels(self) -> impl Iterator<Item = f64> {
        let Self { start_e, end_e, count, is_logarithmic } = self;
        (0..count).map(move |i| {
            let share = if count == 1 { 0.0 } else { i as f64 / (count - 1) as f64 };
            match i {
                0 => start_e,
                _ if i == count - 1 => end_e,
                _ if is_logarithmic => start_e * (end_e / start_e).powf(share),
                _ => start_e + share * (end_e - start_e),
            }
        })
    }
}

/// Reads a wanted uncertainty: `0.5%` or `0.1jnd`.
///
/// # Errors
///
/// What is expected, in words.
pub(super) fn uncertainty(text: &str) -> Result<Uncertainty, String> {
    let text = &text.to_ascii_lowercase();
    let positive = |text: &str| text.trim().parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
    let relative = text.strip_suffix('%').and_then(positive).map(|percent| Uncertainty::Relative(percent / 100.0));
    let jnd = text.strip_suffix("jnd").and_then(positive).map(Uncertainty::Jnd);
    relative
        .or(jnd)
        .ok_or_else(|| "give percent of the signal, such as 0.5%, or a color difference, such as 0.1jnd".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_start_and_end_where_they_say() {
        let sweep = Sweep::parse("10:40000:50log").unwrap();
        let levels: Vec<f64> = sweep.levels().collect();
        assert_eq!((levels.len(), levels[0], levels[49]), (50, 10.0, 40_000.0));
        assert!((levels[1] / levels[0] - 4000.0_f64.powf(1.0 / 49.0)).abs() < 1e-12);
        assert_eq!(Sweep::parse("0:10:3").unwrap().levels().collect::<Vec<_>>(), [0.0, 5.0, 10.0]);
        for wrong in ["10:40000", "0:10:3log", "a:b:c", "1:2:0log", "-1:2:3lin", "1e-300:1:3log", "1:1e39:3log"] {
            assert!(Sweep::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn uncertainties_are_in_per_cent_or_jnd() {
        assert_eq!(uncertainty("0.5%"), Ok(Uncertainty::Relative(0.005)));
        assert_eq!(uncertainty("0.1jnd"), Ok(Uncertainty::Jnd(0.1)));
        assert!(uncertainty("0.1").is_err() && uncertainty("-1%").is_err());
    }
}
