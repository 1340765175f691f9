//! Whether the photosites of a flat field respond as those behind the array that is said to be there.
//!
//! A Bayer pattern has its greens on one diagonal of each 2×2, and they make the same of the same light but for a few per cent; red and
//! blue, on the other, are equal by chance alone. Of an array that is taken for the one beside it the greens differ, and red and blue do not.
//! Red that is taken for blue shows in no flat of unknown light. Patches of many colors tell the same.

use super::{CfaPattern, FilterArray};

/// What photosites make of light that is even, at each place of the 2×2 at the sensor's corner, row by row.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Places {
    /// Means above what no light reads.
    pub signal: [f64; 4],
    /// What each scatters by, a variance.
    pub variance: [f64; 4],
}

/// The places of each diagonal, and the Bayer patterns that have their greens there.
const DIAGONALS: [([usize; 2], [CfaPattern; 2]); 2] =
    [([0, 3], [CfaPattern::Grbg, CfaPattern::Gbrg]), ([1, 2], [CfaPattern::Rggb, CfaPattern::Bggr])];
/// Greens differ by less than this share of the brightest place: by one or two in a hundred, and by what of red and blue leaks into them.
const OF_GREENS: f64 = 0.05;
/// Places without filters differ by less than this share of their mean: amplifiers do by one or two in a hundred.
const OF_NONE: f64 = 0.1;
/// Places that differ by no more than this share of what others do are alike.
const ALIKE: f64 = 0.25;
/// Standard deviations that are beyond chance.
const BEYOND: f64 = 6.0;

impl Places {
    /// What is wrong with an array, where it is not what the photosites are behind, or there is one and nothing tells it; other arrays than
    /// those of 2×2 are not looked at.
    pub fn doubt(&self, array: Option<FilterArray>) -> Option<String> {
        let brightest = self.signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mean = self.signal.iter().sum::<f64>() / 4.0;
        // NaN is no signal.
        if !(mean > 0.0 && brightest.is_finite()) {
            return None;
        }
        match array {
            Some(FilterArray::Bayer(pattern)) => self.doubt_of_bayer(pattern, brightest),
            Some(FilterArray::Monochrome) => {
                self.doubt_of_none(mean, " and unlike a monochrome sensor, whose PRNU that would be")
            }
            None => self.doubt_of_none(mean, ", which nothing tells"),
            Some(FilterArray::Other(_)) => None,
        }
        .map(|what| {
            let shares = self.signal.map(|signal| format!("{:.2}", signal / mean)).join(", ");
            format!("photosites of each 2x2 of the sensor have {shares} of their mean under even light, {what}")
        })
    }

    /// What is wrong with a Bayer pattern, where photosites saw lights of several colors and the other diagonal has the greens: those are
    /// then alike in all of them, which red and blue are not.
    pub fn doubt_in_colors(colors: &[Self], said: CfaPattern) -> Option<String> {
        let ([others, greens], [a, b]) = Self::diagonals(said);
        // Squares as shares of the brightest place, and in units of what chance makes of them.
        let of = |places: [usize; 2]| {
            let squares = colors.iter().map(|color| {
                let brightest = color.signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let unlike = color.unlike(places).powi(2);
                [unlike / brightest.powi(2), unlike / (color.variance[places[0]] + color.variance[places[1]])]
            });
            squares.fold([0.0; 2], |[shares, chances], [share, chance]| [shares + share, chances + chance])
        };
        let count = colors.len() as f64;
        let ([of_greens, chances], [of_others, _]) = (of(greens), of(others));
        let [of_greens, of_others] = [of_greens, of_others].map(|sum| (sum / count).sqrt());
        let is_wrong = of_greens > OF_GREENS && of_others <= ALIKE * of_greens;
        (is_wrong && chances > count + BEYOND * (2.0 * count).sqrt()).then(|| {
            format!(
                "the two greens of {said} differ by {:.1} % of the brightest class, rms, and red and blue by {:.1} %: is the pattern {a} or {b}?",
                100.0 * of_greens,
                100.0 * of_others
            )
        })
    }

    /// The diagonals of red and blue and of the greens of a pattern, and the patterns that have their greens on the former.
    fn diagonals(said: CfaPattern) -> ([[usize; 2]; 2], [CfaPattern; 2]) {
        let [(others, patterns), (greens, _)] =
            if DIAGONALS[0].1.contains(&said) { [DIAGONALS[1], DIAGONALS[0]] } else { DIAGONALS };
        ([others, greens], patterns)
    }

    fn unlike(&self, [one, other]: [usize; 2]) -> f64 {
        (self.signal[one] - self.signal[other]).abs()
    }

    fn is_beyond_chance(&self, [one, other]: [usize; 2]) -> bool {
        self.unlike([one, other]) > BEYOND * (self.variance[one] + self.variance[other]).sqrt()
    }

    fn doubt_of_bayer(&self, said: CfaPattern, brightest: f64) -> Option<String> {
        let ([others, greens], [a, b]) = Self::diagonals(said);
        let [of_greens, of_others] = [greens, others].map(|places| self.unlike(places));
        let is_wrong = of_greens > OF_GREENS * brightest && of_others <= ALIKE * of_greens;
        (is_wrong && self.is_beyond_chance(greens)).then(|| {
            let [of_greens, of_others] = [(of_greens, greens), (of_others, others)]
                .map(|(unlike, [one, other])| 100.0 * unlike / self.signal[one].max(self.signal[other]));
            format!(
                "so that the two greens of {said} differ by {of_greens:.1} %, and red and blue by {of_others:.1} %: is the pattern {a} or {b}?"
            )
        })
    }

    fn doubt_of_none(&self, mean: f64, unlike: &str) -> Option<String> {
        let order = |f: fn(f64, f64) -> bool| {
            (1..4).fold(0, |best, at| if f(self.signal[at], self.signal[best]) { at } else { best })
        };
        let ends = [order(|a, b| a < b), order(|a, b| a > b)];
        let spread = self.unlike(ends);
        let are_alike = |pairs: [[usize; 2]; 2]| pairs.into_iter().all(|pair| self.unlike(pair) <= ALIKE * spread);
        // Rows, or columns, that differ from the next are read by amplifiers of their own.
        let is_read_out = are_alike([[0, 1], [2, 3]]) || are_alike([[0, 2], [1, 3]]);
        if spread <= OF_NONE * mean || is_read_out || !self.is_beyond_chance(ends) {
            return None;
        }
        // Greens are more alike than red and blue, where these are not alike by chance.
        let least = DIAGONALS.map(|(places, _)| self.unlike(places)).into_iter().fold(f64::INFINITY, f64::min);
        let is_fitting = |places: [usize; 2]| {
            let unlike = self.unlike(places);
            unlike <= ALIKE * spread && ALIKE * unlike <= least
        };
        let fitting: Vec<[CfaPattern; 2]> =
            DIAGONALS.into_iter().filter(|(greens, _)| is_fitting(*greens)).map(|(_, patterns)| patterns).collect();
        let is_it = match fitting[..] {
            [[a, b]] => format!("is the array {a} or {b}?"),
            [] => "what filters are there?".to_owned(),
            _ => "which Bayer pattern is there?".to_owned(),
        };
        Some(format!("as behind filters{unlike}: {is_it}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubt(array: &str, signal: [f64; 4]) -> Option<String> {
        Places { signal, variance: [1.0; 4] }.doubt(Some(array.parse().unwrap()))
    }

    /// Of red 500, greens of about 1000 and blue 575 each pattern is told from those with their greens on the other diagonal, which are
    /// named, and from no filters.
    #[test]
    fn the_patterns_that_fit_are_named() {
        let [red, green, other, blue] = [500.0, 1000.0, 1015.0, 575.0];
        let rggb = [red, green, other, blue];
        let grbg = [green, red, blue, other];
        for said in ["rggb", "bggr"] {
            assert_eq!(doubt(said, rggb), None);
            let told = doubt(said, grbg).unwrap();
            assert!(
                told.ends_with(&format!(
                    "the two greens of {said} differ by 13.0 %, and red and blue by 1.5 %: is the pattern grbg or gbrg?"
                )),
                "{told}"
            );
        }
        for said in ["grbg", "gbrg"] {
            assert_eq!(doubt(said, grbg), None);
            assert!(doubt(said, rggb).unwrap().ends_with("is the pattern rggb or bggr?"));
        }
        for (signal, patterns) in [(rggb, "rggb or bggr"), (grbg, "grbg or gbrg")] {
            let told = doubt("monochrome", signal).unwrap();
            assert!(told.ends_with(&format!("is the array {patterns}?")), "{told}");
        }
        let untold = Places { signal: rggb, variance: [1.0; 4] }.doubt(None).unwrap();
        assert!(untold.ends_with("as behind filters, which nothing tells: is the array rggb or bggr?"), "{untold}");
        assert_eq!(Places { signal: [700.0; 4], variance: [1.0; 4] }.doubt(None), None);
        assert!(
            doubt("monochrome", [500.0, 1000.0, 1000.0, 500.0]).unwrap().ends_with("which Bayer pattern is there?")
        );
        assert!(doubt("monochrome", [500.0, 1000.0, 700.0, 850.0]).unwrap().ends_with("what filters are there?"));
    }

    /// Greens that differ by 2 %, greens into which much of strong red leaks, equal red and blue, a monochrome sensor whose places differ by
    /// 5 %, or whose columns are read by amplifiers of their own, noise of little light, and no light raise no doubt.
    #[test]
    fn what_a_sensor_may_do_is_not_doubted() {
        for (array, signal) in [
            ("rggb", [500.0, 1000.0, 1020.0, 505.0]),
            ("rggb", [1000.0, 95.0, 140.0, 60.0]),
            ("rggb", [800.0, 100.0, 130.0, 805.0]),
            ("rggb", [500.0, 1000.0, 1000.0, 500.0]),
            ("grbg", [700.0; 4]),
            ("monochrome", [975.0, 1025.0, 1000.0, 1000.0]),
            ("monochrome", [900.0, 1050.0, 905.0, 1040.0]),
            ("monochrome", [900.0, 905.0, 1040.0, 1050.0]),
            ("monochrome", [4.0, 7.0, 2.0, 6.0]),
            ("rggb", [5.0, 7.0, 2.0, 5.0]),
            ("rggb", [-1.0, 2.0, -3.0, 1.0]),
            ("2x2:RGBW", [500.0, 1000.0, 300.0, 2000.0]),
        ] {
            assert_eq!(doubt(array, signal), None, "{array} {signal:?}");
        }
    }

    /// Patches of many colors tell a pattern from those with their greens on the other diagonal, whatever red and blue are in each; greens
    /// that differ a little, patches of one color, in which red and blue are alike, and no light do not.
    #[test]
    fn colors_tell_the_pattern() {
        let colors = [[500.0, 300.0, 100.0], [100.0, 300.0, 500.0], [400.0, 400.0, 400.0], [100.0, 200.0, 120.0]];
        let rggb = colors.map(|[r, g, b]| Places { signal: [r, g, 1.02 * g, b], variance: [1.0; 4] });
        let doubt = |colors: &[Places], said: &str| {
            let Ok(FilterArray::Bayer(pattern)) = said.parse() else { return None };
            Places::doubt_in_colors(colors, pattern)
        };
        for said in ["grbg", "gbrg"] {
            let told = doubt(&rggb, said).unwrap();
            let end = "and red and blue by 1.6 %: is the pattern rggb or bggr?";
            assert!(
                told.starts_with(&format!("the two greens of {said} differ by 56.8 % of")) && told.ends_with(end),
                "{told}"
            );
            assert_eq!(doubt(&rggb[2..3], said), None);
        }
        assert_eq!([doubt(&rggb, "rggb"), doubt(&rggb, "bggr"), doubt(&[], "grbg")], [None, None, None]);
        let dark = rggb.map(|place| Places { variance: [1e6; 4], ..place });
        assert_eq!(doubt(&dark, "grbg"), None);
    }
}
