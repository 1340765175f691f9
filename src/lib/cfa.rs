//! Which sensor class a photosite belongs to.
//!
//! [`CfaPattern`] is one of the four Bayer patterns, which most stages work on; [`FilterArray`] describes any array;
//! [`Places`] hold it against what flat fields show.

mod places;

pub use places::Places;

use serde::de::Visitor;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// A sensor class: a set of photosites under filters of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Class {
    /// Red, k = 1 of the paper.
    Red = 0,
    /// Green, k = 2.
    Green = 1,
    /// Blue, k = 3.
    Blue = 2,
}

impl Class {
    /// The three classes in the order of the planes.
    pub const ALL: [Self; 3] = [Self::Red, Self::Green, Self::Blue];

    /// The letter used in patterns and channel names.
    pub fn letter(self) -> &'static str {
        ["R", "G", "B"][self as usize]
    }
}

/// A Bayer pattern: the classes of the 2×2 photosites at the sensor's corner, row by row \[Bayer1976].
///
/// The corner is the sensor's photosite (0, 0). A crop that starts elsewhere keeps the pattern and says where it
/// starts, so the class of each photosite stays true.
///
/// # Examples
///
/// ```
/// use cyanometer::cfa::{CfaPattern, Class};
///
/// let pattern: CfaPattern = "rggb".parse()?;
/// assert_eq!(pattern.class(0, 0), Class::Red);
/// // A crop that starts at column 3, row 1 of the sensor starts with blue.
/// assert_eq!(pattern.row_classes([3, 1], 0), [Class::Blue, Class::Green]);
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CfaPattern {
    /// R G / G B
    Rggb,
    /// B G / G R
    Bggr,
    /// G R / B G
    Grbg,
    /// G B / R G
    Gbrg,
}

impl CfaPattern {
    /// All four patterns.
    pub const ALL: [Self; 4] = [Self::Rggb, Self::Bggr, Self::Grbg, Self::Gbrg];

    /// The class of the photosite in column `x` and row `y` of the sensor.
    pub fn class(self, x: i64, y: i64) -> Class {
        use Class::{Blue, Green, Red};
        let classes = match self {
            Self::Rggb => [Red, Green, Green, Blue],
            Self::Bggr => [Blue, Green, Green, Red],
            Self::Grbg => [Green, Red, Blue, Green],
            Self::Gbrg => [Green, Blue, Red, Green],
        };
        classes[usize::from(y & 1 != 0) * 2 + usize::from(x & 1 != 0)]
    }

    /// The classes of even and odd columns, counted from the frame's first, in the frame's row `row`, for a frame
    /// whose first photosite is `origin`.
    pub fn row_classes(self, origin: [i32; 2], row: usize) -> [Class; 2] {
        let x = i64::from(origin[0]);
        let y = i64::from(origin[1]) + row as i64;
        [self.class(x, y), self.class(x + 1, y)]
    }

    /// The pattern's name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rggb => "rggb",
            Self::Bggr => "bggr",
            Self::Grbg => "grbg",
            Self::Gbrg => "gbrg",
        }
    }
}

impl fmt::Display for CfaPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl<'de> Deserialize<'de> for CfaPattern {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Finds a name in any case inside the deserializer, which knows the place that a complaint is about.
        struct Find;
        impl Visitor<'_> for Find {
            type Value = CfaPattern;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a Bayer pattern, such as rggb")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<CfaPattern, E> {
                let names = CfaPattern::ALL.map(|pattern| format!("`{pattern}`")).join(", ");
                text.parse().map_err(|_| E::custom(format_args!("unknown variant `{text}`, expected one of {names}")))
            }
        }
        deserializer.deserialize_str(Find)
    }
}

impl FromStr for CfaPattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let lower = text.to_ascii_lowercase();
        Self::ALL
            .into_iter()
            .find(|pattern| pattern.name() == lower)
            .ok_or_else(|| "a pattern is rggb, bggr, grbg or gbrg".to_owned())
    }
}

/// What stands before the photosites of a sensor: a Bayer pattern, no filters at all, or another array.
///
/// Written as `rggb`, `monochrome`, or `6x6:` and the letters of the period at the sensor's corner, row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilterArray {
    /// One of the four Bayer patterns.
    Bayer(CfaPattern),
    /// No filters: all photosites are alike.
    Monochrome,
    /// Another array.
    Other(FilterPeriod),
}

/// Most columns, and most rows, after which a described array repeats itself.
const MAX_PERIOD: usize = 8;

/// Letters of filters, in the order of their numbers in CFAPattern \[TIFF/EP]: red, green, blue, cyan, magenta, yellow, white.
pub const FILTERS: &str = "RGBCMYW";

/// The period of an array that is no Bayer pattern, at the sensor's corner; the smallest that there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FilterPeriod {
    columns: usize,
    rows: usize,
    /// Letters row by row; 0 behind the last.
    letters: [u8; MAX_PERIOD * MAX_PERIOD],
}

impl FilterPeriod {
    /// The period of so many columns and rows that is written row by row.
    fn new(columns: usize, rows: usize, letters: &[u8]) -> Self {
        let mut kept = [0; MAX_PERIOD * MAX_PERIOD];
        kept[..letters.len()].copy_from_slice(letters);
        Self { columns, rows, letters: kept }
    }

    fn letters(&self) -> &[u8] {
        &self.letters[..self.columns * self.rows]
    }

    /// The letter of the photosite in column `x` and row `y` of the sensor.
    fn letter(&self, x: i64, y: i64) -> u8 {
        let place = |at: i64, period: usize| usize::try_from(at.rem_euclid(period as i64)).unwrap_or_default();
        self.letters[place(y, self.rows) * self.columns + place(x, self.columns)]
    }

    /// The same array by its smallest period.
    fn reduced(self) -> Self {
        let is_period = |columns: usize, rows: usize| {
            let part = Self { columns, rows, letters: Self::new(columns, rows, &self.corner(columns, rows)).letters };
            self.sites().all(|[x, y]| part.letter(x, y) == self.letter(x, y))
        };
        let smallest = |most: usize, fits: &dyn Fn(usize) -> bool| (1..=most).find(|&n| fits(n)).unwrap_or(most);
        let columns = smallest(self.columns, &|n| self.columns.is_multiple_of(n) && is_period(n, self.rows));
        let rows = smallest(self.rows, &|n| self.rows.is_multiple_of(n) && is_period(columns, n));
        Self::new(columns, rows, &self.corner(columns, rows))
    }

    fn sites(&self) -> impl Iterator<Item = [i64; 2]> + use<> {
        let (columns, rows) = (self.columns as i64, self.rows as i64);
        (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y]))
    }

    /// The letters of so many columns and rows at the corner.
    fn corner(&self, columns: usize, rows: usize) -> Vec<u8> {
        (0..rows as i64).flat_map(|y| (0..columns as i64).map(move |x| self.letter(x, y))).collect()
    }

    /// X-Trans in any phase: 6×6 sites, 8 red, 20 green, 8 blue.
    fn is_x_trans(&self) -> bool {
        let count = |letter: u8| self.letters().iter().filter(|found| **found == letter).count();
        [self.columns, self.rows] == [6, 6] && [b'R', b'G', b'B'].map(count) == [8, 20, 8]
    }

    /// A Bayer pattern each of whose photosites is four.
    fn is_quad_bayer(&self) -> bool {
        let whole = Self::new(2, 2, &[(0, 0), (2, 0), (0, 2), (2, 2)].map(|(x, y)| self.letter(x, y)));
        [self.columns, self.rows] == [4, 4]
            && bayer_of(whole.letters()).is_some()
            && self.sites().all(|[x, y]| self.letter(x, y) == whole.letter(x / 2, y / 2))
    }
}

/// The Bayer pattern of 2×2 letters.
fn bayer_of(letters: &[u8]) -> Option<CfaPattern> {
    CfaPattern::ALL.into_iter().find(|pattern| pattern.name().as_bytes().eq_ignore_ascii_case(letters))
}

impl FilterArray {
    /// The Bayer pattern; none of another array.
    pub fn bayer(self) -> Option<CfaPattern> {
        match self {
            Self::Bayer(pattern) => Some(pattern),
            Self::Monochrome | Self::Other(_) => None,
        }
    }

    /// The class of the photosite in column `x` and row `y` of the sensor; none where its filter is not red, green or blue.
    pub fn class(self, x: i64, y: i64) -> Option<Class> {
        match self {
            Self::Bayer(pattern) => Some(pattern.class(x, y)),
            Self::Monochrome => None,
            Self::Other(period) => {
                Class::ALL.into_iter().find(|class| class.letter().as_bytes() == [period.letter(x, y)])
            }
        }
    }

    /// Columns and rows after which it repeats itself.
    pub fn period(self) -> [usize; 2] {
        match self {
            Self::Bayer(_) => [2, 2],
            Self::Monochrome => [1, 1],
            Self::Other(period) => [period.columns, period.rows],
        }
    }

    /// The letter of the filter before the photosite in column `x` and row `y` of the sensor; none of a monochrome sensor.
    pub fn filter(self, x: i64, y: i64) -> Option<char> {
        match self {
            Self::Bayer(pattern) => pattern.class(x, y).letter().chars().next(),
            Self::Monochrome => None,
            Self::Other(period) => Some(period.letter(x, y).into()),
        }
    }

    /// The letters of its filters, each once; none of a monochrome sensor.
    pub fn filters(self) -> Vec<char> {
        match self {
            Self::Bayer(_) => vec!['R', 'G', 'B'],
            Self::Monochrome => Vec::new(),
            Self::Other(period) => FILTERS
                .chars()
                .filter(|filter| period.letters().iter().any(|letter| char::from(*letter) == *filter))
                .collect(),
        }
    }

    /// Whether its photosites are of the classes R, G and B and no other.
    pub fn has_three_classes(self) -> bool {
        self.filters() == ['R', 'G', 'B']
    }

    /// What a sensor has, in words: `an X-Trans filter array`.
    pub fn in_words(self) -> String {
        match self {
            Self::Bayer(pattern) => format!("a Bayer filter array, {pattern}"),
            Self::Monochrome => "no color filters (monochrome)".into(),
            Self::Other(period) if period.is_x_trans() => "an X-Trans filter array".into(),
            Self::Other(period) if period.is_quad_bayer() => "a quad Bayer filter array".into(),
            Self::Other(period) => format!("a filter array of {}x{} sites", period.columns, period.rows),
        }
    }
}

impl FilterArray {
    /// The array whose period of `columns` and `rows` sites, in letters row by row, begins at the photosite `first` of the
    /// sensor.
    ///
    /// # Errors
    ///
    /// What is expected, in words, as of [`FilterArray::from_str`].
    pub fn beginning_at(first: [i64; 2], columns: usize, rows: usize, letters: &str) -> Result<Self, String> {
        let mut corner = String::with_capacity(letters.len());
        let place = |at: usize, first: i64, period: usize| {
            usize::try_from((at as i64 - first).rem_euclid(period as i64)).unwrap_or_default()
        };
        if letters.len() == columns.saturating_mul(rows) && letters.is_ascii() {
            for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
                let site = place(y, first[1], rows) * columns + place(x, first[0], columns);
                corner.extend(letters.get(site..=site));
            }
        }
        format!("{columns}x{rows}:{corner}").parse()
    }
}

impl From<CfaPattern> for FilterArray {
    fn from(pattern: CfaPattern) -> Self {
        Self::Bayer(pattern)
    }
}

impl fmt::Display for FilterArray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bayer(pattern) => pattern.fmt(f),
            Self::Monochrome => f.write_str("monochrome"),
            Self::Other(period) => {
                let letters: String = period.letters().iter().copied().map(char::from).collect();
                write!(f, "{}x{}:{letters}", period.columns, period.rows)
            }
        }
    }
}

impl Serialize for FilterArray {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for FilterArray {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Parses inside the deserializer, which knows the place that a complaint is about.
        struct Parse;
        impl Visitor<'_> for Parse {
            type Value = FilterArray;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a filter array, such as rggb")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<FilterArray, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_str(Parse)
    }
}

impl FromStr for FilterArray {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(pattern) = text.parse() {
            return Ok(Self::Bayer(pattern));
        }
        if text.eq_ignore_ascii_case("monochrome") {
            return Ok(Self::Monochrome);
        }
        let wrong = || {
            format!(
                "`{text}` is no filter array; one is rggb, bggr, grbg, gbrg, monochrome, or its period of at most \
                 {MAX_PERIOD}x{MAX_PERIOD} sites row by row in the letters {FILTERS}, as 4x4:RRGGRRGGGGBBGGBB"
            )
        };
        let (size, letters) = text.split_once(':').ok_or_else(wrong)?;
        let side = |text: &str| text.parse().ok().filter(|n| (1..=MAX_PERIOD).contains(n)).ok_or_else(wrong);
        let (columns, rows) = size.split_once(['x', 'X']).ok_or_else(wrong)?;
        let (columns, rows, letters) = (side(columns)?, side(rows)?, letters.to_ascii_uppercase());
        if letters.len() != columns * rows || !letters.chars().all(|letter| FILTERS.contains(letter)) {
            return Err(wrong());
        }
        let period = FilterPeriod::new(columns, rows, letters.as_bytes()).reduced();
        Ok(bayer_of(period.letters()).filter(|_| period.columns == 2).map_or(Self::Other(period), Self::Bayer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_spell_their_corner() {
        for pattern in CfaPattern::ALL {
            let corner: String =
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| pattern.class(x, y).letter()).concat().to_lowercase();
            assert_eq!(corner, pattern.name());
            assert_eq!(pattern.name().parse(), Ok(pattern));
            // In any case in files, too.
            let upper = pattern.name().to_uppercase();
            assert_eq!(serde_yaml::from_str::<CfaPattern>(&upper).unwrap(), pattern);
        }
        let complaint = serde_yaml::from_str::<CfaPattern>("rgbg").unwrap_err().to_string();
        assert!(
            complaint.contains("unknown variant `rgbg`, expected one of `rggb`, `bggr`, `grbg`, `gbrg`"),
            "{complaint}"
        );
    }

    #[test]
    fn a_crop_keeps_the_class_of_each_photosite() {
        let pattern = CfaPattern::Rggb;
        assert_eq!(pattern.row_classes([3, -1], 2), [pattern.class(3, 1), pattern.class(4, 1)]);
        assert_eq!(pattern.class(-1, -1), Class::Blue);
    }

    /// X-Trans as Fujifilm's cameras have it.
    const X_TRANS: &str = "6x6:GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG";

    #[test]
    fn arrays_are_read_as_they_are_written() {
        for text in ["rggb", "bggr", "monochrome", X_TRANS, "4x4:RRGGRRGGGGBBGGBB", "2x2:CYGM", "1x2:RG"] {
            let array: FilterArray = text.parse().unwrap();
            assert_eq!(array.to_string(), text);
        }
        for wrong in
            ["rgbw", "", "2x2:RGG", "2x2:RGGX", "9x1:RRRRRRRRR", "0x0:", "2x:RG", "6x6", "ax2:RG", "2x2:RG\u{dc}"]
        {
            assert!(wrong.parse::<FilterArray>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_array_has_one_name() {
        let read = |text: &str| text.parse::<FilterArray>().unwrap();
        assert_eq!(read("2x2:grbg"), FilterArray::Bayer(CfaPattern::Grbg));
        assert_eq!(read("4x4:RGRGGBGBRGRGGBGB"), FilterArray::Bayer(CfaPattern::Rggb));
        assert_eq!(read("4x2:CMCMYWYW").to_string(), "2x2:CMYW");
        // Four in a row are no pattern of two by two.
        assert_eq!(read("4x1:RGGB").to_string(), "4x1:RGGB");
        assert_eq!(read(X_TRANS).in_words(), "an X-Trans filter array");
        assert_eq!(read("4x4:GGBBGGBBRRGGRRGG").in_words(), "a quad Bayer filter array");
        assert_eq!(read("2x4:RGGBGRBG").in_words(), "a filter array of 2x4 sites");
    }

    #[test]
    fn a_period_may_begin_anywhere() {
        let at = |first| FilterArray::beginning_at(first, 2, 2, "RGGB").unwrap().to_string();
        assert_eq!([at([0, 0]), at([1, 0]), at([0, -1]), at([3, 5])], ["rggb", "grbg", "gbrg", "bggr"]);
        let period = FilterArray::beginning_at([4, 1], 6, 6, &X_TRANS[4..]).unwrap();
        let corner: FilterArray = X_TRANS.parse().unwrap();
        assert!((0..36).all(|i| period.class(i % 6 + 4, i / 6 + 1) == corner.class(i % 6, i / 6)));
        for (columns, rows, letters) in [(2, 2, "RGG"), (0, 0, ""), (9, 1, "RRRRRRRRR"), (2, 1, "RX"), (2, 1, "\u{dc}")]
        {
            assert!(FilterArray::beginning_at([1, 1], columns, rows, letters).is_err());
        }
    }

    #[test]
    fn classes_of_any_array_repeat_from_the_sensors_corner() {
        let array: FilterArray = X_TRANS.parse().unwrap();
        assert_eq!(array.class(4, 0), Some(Class::Red));
        assert_eq!(array.class(4 - 6, 6), Some(Class::Red));
        assert_eq!(array.class(-1, -1), array.class(5, 5));
        assert!(array.has_three_classes() && array.bayer().is_none());
        let with_white: FilterArray = "2x2:RGBW".parse().unwrap();
        assert_eq!((with_white.class(1, 1), with_white.class(0, 1)), (None, Some(Class::Blue)));
        assert_eq!(with_white.filters(), ['R', 'G', 'B', 'W']);
        assert!(!with_white.has_three_classes());
        for pattern in CfaPattern::ALL {
            assert_eq!(FilterArray::from(pattern).class(3, 6), Some(pattern.class(3, 6)));
        }
    }
}
