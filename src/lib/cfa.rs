//! Which sensor class a photosite belongs to.

use serde::{Deserialize, Serialize};
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
        }
    }

    #[test]
    fn a_crop_keeps_the_class_of_each_photosite() {
        let pattern = CfaPattern::Rggb;
        assert_eq!(pattern.row_classes([3, -1], 2), [pattern.class(3, 1), pattern.class(4, 1)]);
        assert_eq!(pattern.class(-1, -1), Class::Blue);
    }
}
