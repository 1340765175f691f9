//! Amplifiers that a sensor is read through, its taps: which photosite goes through which, and how they differ.

use crate::names::{Named, serde_by_name};
use serde::{Deserialize, Serialize};

/// Relative gains of amplifiers of one sensor that do not look like another unit.
const GAINS: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Most taps that columns go through by turns.
const MOST_COLUMNS: usize = 4;

/// Which photosites a tap reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TapLayout {
    /// Columns by turns: tap = column modulo their number.
    Columns,
    /// The left half of the columns, and the others.
    LeftRight,
    /// The upper half of the rows, and the others.
    TopBottom,
    /// Upper left, upper right, lower left, lower right.
    Quadrants,
}

impl Named for TapLayout {
    const ALL: &'static [Self] = &[Self::Columns, Self::LeftRight, Self::TopBottom, Self::Quadrants];

    fn name(self) -> &'static str {
        match self {
            Self::Columns => "columns",
            Self::LeftRight => "left-right",
            Self::TopBottom => "top-bottom",
            Self::Quadrants => "quadrants",
        }
    }
}

serde_by_name!(TapLayout);

/// The taps of a sensor, each of which makes codes of charge by itself:
///
/// y = round(bias + K g (n + o))        g = `gain`, o = `offset_e`, n with read noise of `read_noise_e`
///
/// A list that is left out says that they do not differ in it.
///
/// # Examples
///
/// ```
/// use cyanometer::camera::taps::{TapLayout, Taps};
///
/// let halves = Taps { layout: TapLayout::LeftRight, gain: vec![1.0, 1.01], offset_e: vec![], read_noise_e: vec![] };
/// assert_eq!([319, 320].map(|x| halves.tap([640, 480], [x, 7])), [0, 1]);
/// let turns = Taps { layout: TapLayout::Columns, ..halves };
/// assert_eq!([319, 320].map(|x| turns.tap([640, 480], [x, 7])), [1, 0]);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Taps {
    /// Which photosites each reads.
    pub layout: TapLayout,
    /// Slope of each over `adu_per_e`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gain: Vec<f64>,
    /// What each adds before its gain, e⁻.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offset_e: Vec<f64>,
    /// Read noise of each, rms e⁻, in place of that of the read-out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub read_noise_e: Vec<f64>,
}

impl Taps {
    fn lists(&self) -> [(&'static str, &[f64]); 3] {
        [("gain", &self.gain), ("offset_e", &self.offset_e), ("read_noise_e", &self.read_noise_e)]
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.lists().into_iter().map(|(_, list)| list.len()).max().unwrap_or_default()
    }

    /// How many halves it has of columns and of rows; the columns go by turns where there is one of each.
    pub fn halves(&self) -> [usize; 2] {
        match self.layout {
            TapLayout::Columns => [1, 1],
            TapLayout::LeftRight => [2, 1],
            TapLayout::TopBottom => [1, 2],
            TapLayout::Quadrants => [2, 2],
        }
    }

    /// The tap of a photosite, by column and row on a sensor of such a width and height.
    pub fn tap(&self, size: [u32; 2], at: [i64; 2]) -> usize {
        let [columns, rows] = self.halves();
        let half = |axis: usize| usize::from(at[axis] >= i64::from(size[axis] / 2));
        match (columns, rows) {
            (1, 1) => usize::try_from(at[0].rem_euclid(self.count().max(1) as i64)).unwrap_or_default(),
            (2, 1) => half(0),
            (1, _) => half(1),
            _ => 2 * half(1) + half(0),
        }
    }

    /// Relative gain of a tap.
    pub fn gain(&self, tap: usize) -> f64 {
        self.gain.get(tap).copied().unwrap_or(1.0)
    }

    /// Offset of a tap in e⁻.
    pub fn offset_e(&self, tap: usize) -> f64 {
        self.offset_e.get(tap).copied().unwrap_or(0.0)
    }

    /// Read noise of a tap of a sensor whose read-out has such one, e⁻.
    pub fn read_noise_e(&self, tap: usize, of_readout: f64) -> f64 {
        self.read_noise_e.get(tap).copied().unwrap_or(of_readout)
    }

    /// Checks that every number is possible for photosites of such a full well.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub(super) fn check(&self, full_well_e: f64) -> Result<(), String> {
        let count = self.count();
        if count == 0 {
            return Err("`taps` has none of `gain`, `offset_e` and `read_noise_e`; it says nothing".into());
        }
        let is_possible = match self.layout {
            TapLayout::Columns => (2..=MOST_COLUMNS).contains(&count),
            TapLayout::LeftRight | TapLayout::TopBottom => count == 2,
            TapLayout::Quadrants => count == 4,
        };
        if !is_possible {
            let wanted = match self.layout {
                TapLayout::Columns => "2 to 4",
                TapLayout::Quadrants => "4",
                _ => "2",
            };
            let layout = self.layout.name();
            return Err(format!("`taps` has numbers of {count} taps; the layout `{layout}` has {wanted}"));
        }
        for (key, list) in self.lists().into_iter().filter(|(_, list)| !list.is_empty()) {
            if list.len() != count {
                return Err(format!("`taps.{key}` has {} numbers, but there are {count} taps", list.len()));
            }
            for (tap, value) in list.iter().enumerate() {
                check_number(key, tap, *value, full_well_e)?;
            }
        }
        Ok(())
    }
}

fn check_number(key: &str, tap: usize, value: f64, full_well_e: f64) -> Result<(), String> {
    let problem = match key {
        "gain" if !GAINS.contains(&value) => {
            format!("it is relative to `adu_per_e`, {} to {}", GAINS.start(), GAINS.end())
        }
        "read_noise_e" if !(0.0..full_well_e).contains(&value) => {
            format!("it must be 0 to less than `full_well_e`, {full_well_e}")
        }
        "offset_e" if !(-full_well_e..full_well_e).contains(&value) => {
            format!("it must be smaller than `full_well_e`, {full_well_e}")
        }
        _ => return Ok(()),
    };
    Err(format!("`taps.{key}` is {value} for tap {tap}; {problem}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taps(layout: TapLayout, gain: &[f64]) -> Taps {
        Taps { layout, gain: gain.to_vec(), offset_e: vec![], read_noise_e: vec![] }
    }

    #[test]
    fn photosites_have_the_taps_of_their_places() {
        let size = [5, 6];
        let all = |taps: &Taps| -> Vec<Vec<usize>> {
            (1..5).map(|y| (-1..6).map(|x| taps.tap(size, [x, y])).collect()).collect()
        };
        assert_eq!(all(&taps(TapLayout::Columns, &[1.0; 3]))[0], [2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(all(&taps(TapLayout::LeftRight, &[1.0; 2]))[0], [0, 0, 0, 1, 1, 1, 1]);
        assert_eq!(all(&taps(TapLayout::TopBottom, &[1.0; 2])).concat()[7..21], [[0; 7], [1; 7]].concat());
        assert_eq!(all(&taps(TapLayout::Quadrants, &[1.0; 4]))[2], [2, 2, 2, 3, 3, 3, 3]);
    }
}
