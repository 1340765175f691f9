//! Levels of codes: what no light reads, and the largest there is.

use crate::cfa::Class;
use serde::{Deserialize, Serialize};

/// Black levels are told to a quarter: nothing of a camera reads less than this share of its bias.
pub const LEAST_OF_BIAS: f64 = 0.75;

/// How far off a black level codes without light may read, ADU: cameras tell it to such a share, and to so many ADU; a Canon Kiss X4 has 2056
/// for 2046 to 2050.
pub fn near_black(black_adu: f64) -> f64 {
    (0.02 * black_adu.abs()).max(8.0)
}

/// So many times less may the dark current of a sensor be where nothing tells that it is cooled: by 60 K or so.
pub const OF_COOLED: f64 = 1e3;

/// The least and the largest level of no light that go with a bias, ADU, where codes end at `top`: black levels count the dark signal of
/// their exposures, which is a few per cent of the range, or half the bias.
pub fn levels_of_bias(bias_adu: f64, top: f64) -> [f64; 2] {
    const MOST_OF_BIAS: f64 = 1.5;
    const OF_RANGE: f64 = 0.03;
    [LEAST_OF_BIAS * bias_adu, (MOST_OF_BIAS * bias_adu).max(bias_adu + OF_RANGE * (top - bias_adu))]
}

/// How many times each other levels of one scale of codes are at most: white levels are told a few per cent apart, and codes lie above
/// them by noise and by the habits of cameras; other scales are other numbers of bits.
pub const OF_ONE_SCALE: f64 = 1.5;

/// What no light reads: the same everywhere, or by the 2×2 sites at the sensor's corner, row by row.
///
/// Sites hang on the photosite's place on the sensor, as the filter array does, so that a crop keeps them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a black level is a number, or four for the 2x2 sites of the filter array row by row")]
pub enum BlackLevel {
    /// Everywhere.
    Uniform(f64),
    /// By site.
    Sites([f64; 4]),
}

impl From<f64> for BlackLevel {
    fn from(level: f64) -> Self {
        Self::Uniform(level)
    }
}

impl BlackLevel {
    /// Levels that repeat after so many columns and rows, row by row; none where they differ by more than 2×2 sites, or are
    /// fewer than that.
    pub fn repeating(columns: usize, rows: usize, levels: &[f64]) -> Option<Self> {
        if columns == 0 || rows == 0 || columns.checked_mul(rows) != Some(levels.len()) {
            return None;
        }
        let level = |x: usize, y: usize| levels[y % rows * columns + x % columns];
        // An odd period and two sites meet again after twice the period.
        let differs = (0..2 * rows).any(|y| (0..2 * columns).any(|x| level(x, y) != level(x % 2, y % 2)));
        let sites = Self::Sites([level(0, 0), level(1, 0), level(0, 1), level(1, 1)]);
        (!differs).then(|| sites.uniform().map_or(sites, Self::Uniform))
    }

    /// The same with the corner so many columns and rows further back.
    #[must_use]
    pub fn beginning_at(self, [column, row]: [usize; 2]) -> Self {
        let sites = self.sites();
        let site = |x: usize, y: usize| sites[(y + row) % 2 * 2 + (x + column) % 2];
        let moved = Self::Sites([site(0, 0), site(1, 0), site(0, 1), site(1, 1)]);
        moved.uniform().map_or(moved, Self::Uniform)
    }

    /// The levels of the four sites.
    pub fn sites(self) -> [f64; 4] {
        match self {
            Self::Uniform(level) => [level; 4],
            Self::Sites(levels) => levels,
        }
    }

    /// The level where all sites have the same.
    pub fn uniform(self) -> Option<f64> {
        let [first, rest @ ..] = self.sites();
        rest.iter().all(|level| *level == first).then_some(first)
    }

    /// The largest of the four.
    pub fn largest(self) -> f64 {
        self.sites().into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// The mean over the sites.
    pub fn mean(self) -> f64 {
        self.sites().into_iter().sum::<f64>() / 4.0
    }

    /// The same with another value in place of each.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::Uniform(level) => Self::Uniform(f(level)),
            Self::Sites(levels) => Self::Sites(levels.map(f)),
        }
    }
}

/// The largest code: of all classes alike, or of R, G and B.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a white level is a number, or three for R, G and B")]
pub enum WhiteLevel {
    /// Of all classes.
    Uniform(f64),
    /// Of R, G and B.
    Classes([f64; 3]),
}

impl From<f64> for WhiteLevel {
    fn from(level: f64) -> Self {
        Self::Uniform(level)
    }
}

impl WhiteLevel {
    /// The levels of R, G and B.
    pub fn classes(self) -> [f64; 3] {
        match self {
            Self::Uniform(level) => [level; 3],
            Self::Classes(levels) => levels,
        }
    }

    /// The level where all classes have the same.
    pub fn uniform(self) -> Option<f64> {
        let [red, green, blue] = self.classes();
        (red == green && green == blue).then_some(red)
    }

    /// The largest of the three.
    pub fn largest(self) -> f64 {
        self.classes().into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// What signals of all classes are shares of, above a black level: the same for all, as their charge counts alike. Where black
    /// differs among photosites, it is the largest that limits it \[DNG2023, ch. 5, Mapping Raw Values to Linear Reference
    /// Values].
    pub fn range_above(self, black: f64) -> f64 {
        self.classes().into_iter().fold(f64::INFINITY, f64::min) - black
    }

    /// The lower of two, class by class.
    #[must_use]
    pub fn lower(self, other: Self) -> Self {
        match (self, other) {
            (Self::Uniform(one), Self::Uniform(other)) => Self::Uniform(one.min(other)),
            (one, other) => {
                let [one, other] = [one, other].map(Self::classes);
                Self::Classes([0, 1, 2].map(|k| one[k].min(other[k])))
            }
        }
    }

    /// What is left of it once `blacks` of R, G and B are subtracted.
    #[must_use]
    pub fn less(self, blacks: [f64; 3]) -> Self {
        match (self, blacks) {
            (Self::Uniform(level), [red, green, blue]) if red == green && green == blue => Self::Uniform(level - red),
            (levels, blacks) => {
                let levels = levels.classes();
                Self::Classes([0, 1, 2].map(|k| levels[k] - blacks[k]))
            }
        }
    }

    /// The same with another value in place of each.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::Uniform(level) => Self::Uniform(f(level)),
            Self::Classes(levels) => Self::Classes(levels.map(f)),
        }
    }
}

/// The black level at every photosite of a frame.
///
/// b(x, y) = site(x mod 2, y mod 2) + Δrow(y) + Δcolumn(x)        as `BlackLevel`, `BlackLevelDeltaV` and
/// `BlackLevelDeltaH` of \[DNG2023]
#[derive(Debug, Clone, PartialEq)]
pub struct BlackLevels {
    /// As it was given, by the sites at the sensor's corner.
    level: BlackLevel,
    /// Of the 2×2 sites at the frame's corner.
    sites: [f64; 4],
    /// What each row of the frame adds; empty where no row adds anything.
    by_row: Vec<f64>,
    /// What each column of the frame adds; empty where no column adds anything.
    by_column: Vec<f64>,
}

/// The black level of the photosites of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowBlack<'a> {
    /// The same for all.
    Uniform(f64),
    /// By even and odd columns of the frame, and what each column adds.
    Varying([f64; 2], &'a [f64]),
}

impl RowBlack<'_> {
    /// The level in column `x`.
    #[inline]
    pub fn at(&self, x: usize) -> f64 {
        match self {
            Self::Uniform(level) => *level,
            Self::Varying(pair, by_column) => pair[x % 2] + by_column.get(x).copied().unwrap_or(0.0),
        }
    }
}

impl BlackLevels {
    /// The same level everywhere.
    pub fn uniform_at(level: f64) -> Self {
        Self::of_sites(level.into(), [0; 2])
    }

    /// The levels of a frame whose first photosite is `origin` on the sensor, where no row or column adds to them.
    pub fn of_sites(level: BlackLevel, origin: [i32; 2]) -> Self {
        let from = origin.map(|at| usize::from(at & 1 != 0));
        Self { level, sites: level.beginning_at(from).sites(), by_row: Vec::new(), by_column: Vec::new() }
    }

    /// The levels of the frame of `size` (columns, rows) whose first photosite is `origin` on the sensor; deltas are counted
    /// from the sensor's corner.
    ///
    /// # Errors
    ///
    /// What is wrong, in words, where deltas do not reach as far as the frame.
    pub fn new(
        level: BlackLevel,
        by_row: &[f64],
        by_column: &[f64],
        origin: [i32; 2],
        size: [usize; 2],
    ) -> Result<Self, String> {
        Ok(Self {
            by_row: part("black_by_row", "rows", by_row, origin[1], size[1])?,
            by_column: part("black_by_column", "columns", by_column, origin[0], size[0])?,
            ..Self::of_sites(level, origin)
        })
    }

    /// The same with another value in place of each, of what rows and columns add too.
    #[must_use]
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        let all = |deltas: &[f64]| deltas.iter().map(|delta| f(*delta)).collect();
        Self {
            level: self.level.map(&f),
            sites: self.sites.map(&f),
            by_row: all(&self.by_row),
            by_column: all(&self.by_column),
        }
    }

    /// The level by the sites at the sensor's corner, without what rows and columns add.
    pub fn level(&self) -> BlackLevel {
        self.level
    }

    /// The levels of the 2×2 sites at the frame's corner, row by row, without what rows and columns add.
    pub fn sites(&self) -> [f64; 4] {
        self.sites
    }

    /// What each row of the frame adds; empty where no row adds anything.
    pub fn by_row(&self) -> &[f64] {
        &self.by_row
    }

    /// What each column of the frame adds; empty where no column adds anything.
    pub fn by_column(&self) -> &[f64] {
        &self.by_column
    }

    /// Whether any row or column adds to it.
    pub fn has_deltas(&self) -> bool {
        !(self.by_row.is_empty() && self.by_column.is_empty())
    }

    /// The level where it is the same at all photosites.
    pub fn uniform(&self) -> Option<f64> {
        BlackLevel::Sites(self.sites).uniform().filter(|_| !self.has_deltas())
    }

    /// The level of the photosites in row `y` of the frame.
    pub fn row(&self, y: usize) -> RowBlack<'_> {
        if let Some(level) = self.uniform() {
            return RowBlack::Uniform(level);
        }
        let delta = self.by_row.get(y).copied().unwrap_or(0.0);
        RowBlack::Varying([0, 1].map(|x| self.sites[y % 2 * 2 + x] + delta), &self.by_column)
    }

    /// The largest level among the photosites of R, G and B in a frame of `size`, whose classes are told by column and row
    /// of the frame; of all photosites where `class` names none of that class.
    ///
    /// Classes repeat after two columns and two rows.
    pub fn largest(&self, size: [usize; 2], class: impl Fn(usize, usize) -> Option<Class>) -> [f64; 3] {
        let extreme = |deltas: &[f64], parity: usize| {
            let most = deltas.iter().skip(parity).step_by(2).copied().fold(f64::NEG_INFINITY, f64::max);
            if most.is_finite() { most } else { 0.0 }
        };
        let [mut found, mut of_all] = [[f64::NEG_INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for (y, x) in (0..size[1].min(2)).flat_map(|y| (0..size[0].min(2)).map(move |x| (y, x))) {
            let level = self.sites[y * 2 + x] + extreme(&self.by_row, y) + extreme(&self.by_column, x);
            of_all = of_all.map(|most| most.max(level));
            if let Some(class) = class(x, y) {
                let most = &mut found[class as usize];
                *most = most.max(level);
            }
        }
        [0, 1, 2].map(|k| if found[k].is_finite() { found[k] } else { of_all[k] })
    }

    /// A level that no photosite is below.
    pub fn smallest(&self) -> f64 {
        let least = |deltas: &[f64]| deltas.iter().copied().reduce(f64::min).unwrap_or(0.0);
        let site = self.sites.into_iter().fold(f64::INFINITY, f64::min);
        site + least(&self.by_row) + least(&self.by_column)
    }
}

/// The deltas of the `count` rows or columns from `first` on; none where none are given, or all are zero.
fn part(key: &str, what: &str, deltas: &[f64], first: i32, count: usize) -> Result<Vec<f64>, String> {
    if deltas.is_empty() {
        return Ok(Vec::new());
    }
    let kept = usize::try_from(first).ok().and_then(|first| deltas.get(first..first.checked_add(count)?));
    let none_if_zero = |deltas: &[f64]| if deltas.iter().all(|d| *d == 0.0) { Vec::new() } else { deltas.to_vec() };
    kept.map(none_if_zero).ok_or_else(|| {
        format!(
            "`{key}` has the levels of {} {what}, but the frame has {what} {first} to {} of the sensor",
            deltas.len(),
            i64::from(first) + count as i64 - 1
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SITES: BlackLevel = BlackLevel::Sites([10.0, 20.0, 30.0, 40.0]);

    fn at(levels: &BlackLevels, x: usize, y: usize) -> f64 {
        levels.row(y).at(x)
    }

    #[test]
    fn sites_and_deltas_add_up_as_in_a_dng() {
        let levels = BlackLevels::new(SITES, &[0.0, 1.0, 2.0], &[0.0, 0.1, 0.2, 0.3], [0, 0], [4, 3]).unwrap();
        assert_eq!(at(&levels, 0, 0), 10.0);
        assert_eq!(at(&levels, 3, 1), 40.0 + 1.0 + 0.3);
        assert_eq!(at(&levels, 2, 2), 10.0 + 2.0 + 0.2);
        assert_eq!(levels.uniform(), None);
        assert_eq!(levels.smallest(), 10.0);
        let class =
            |x: usize, y: usize| [[Class::Red, Class::Green], [Class::Green, Class::Blue]].get(y)?.get(x).copied();
        assert_eq!(levels.largest([4, 3], class), [10.0 + 2.0 + 0.2, 30.0 + 1.0 + 0.2, 40.0 + 1.0 + 0.3]);
    }

    #[test]
    fn a_crop_keeps_the_level_of_each_photosite() {
        let (rows, columns) = ([0.0, 1.0, 2.0, 3.0], [0.0, 0.1, 0.2, 0.3, 0.4]);
        let whole = BlackLevels::new(SITES, &rows, &columns, [0, 0], [5, 4]).unwrap();
        for [x0, y0] in [[1, 0], [0, 1], [3, 1]] {
            let size = [5 - x0, 4 - y0];
            let origin = [x0, y0].map(|at| i32::try_from(at).unwrap());
            let crop = BlackLevels::new(SITES, &rows, &columns, origin, size).unwrap();
            for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
                assert_eq!(at(&crop, x, y), at(&whole, x + x0, y + y0));
            }
        }
        // Before the sensor's corner sites go on, as the filter array does; deltas do not.
        let before = BlackLevels::new(SITES, &[], &[], [-1, -1], [2, 2]).unwrap();
        assert_eq!(at(&before, 0, 0), 40.0);
        let complaint = BlackLevels::new(SITES, &rows, &[], [0, 2], [5, 4]).unwrap_err();
        assert_eq!(complaint, "`black_by_row` has the levels of 4 rows, but the frame has rows 2 to 5 of the sensor");
        assert!(BlackLevels::new(SITES, &[], &columns, [-1, 0], [2, 2]).is_err());
    }

    #[test]
    fn what_is_the_same_everywhere_is_one_number() {
        let same = BlackLevel::Sites([7.0; 4]);
        assert_eq!((same.uniform(), SITES.uniform()), (Some(7.0), None));
        let zeros = BlackLevels::new(same, &[0.0; 3], &[0.0; 3], [0, 0], [3, 3]).unwrap();
        assert_eq!(zeros.uniform(), Some(7.0));
        assert_eq!(WhiteLevel::Classes([9.0; 3]).uniform(), Some(9.0));
        assert_eq!(WhiteLevel::from(9.0).less([1.0; 3]), WhiteLevel::Uniform(8.0));
        assert_eq!(WhiteLevel::from(9.0).less([1.0, 2.0, 3.0]), WhiteLevel::Classes([8.0, 7.0, 6.0]));
    }

    /// A number stays a number in files.
    #[test]
    fn the_short_form_stays_short() {
        let written = |level: &BlackLevel| serde_yaml::to_string(level).unwrap();
        assert_eq!(written(&1753.0.into()), "1753.0\n");
        assert_eq!(serde_yaml::from_str::<BlackLevel>("64").unwrap(), BlackLevel::Uniform(64.0));
        assert_eq!(serde_yaml::from_str::<BlackLevel>("[10, 20, 30, 40.0]").unwrap(), SITES);
        let complaint = serde_yaml::from_str::<BlackLevel>("[1, 2, 3]").unwrap_err().to_string();
        assert!(complaint.contains("or four for the 2x2 sites"), "{complaint}");
        assert_eq!(serde_yaml::from_str::<WhiteLevel>("[1, 2, 3]").unwrap(), WhiteLevel::Classes([1.0, 2.0, 3.0]));
    }
}
