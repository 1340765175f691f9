//! Black and white levels, and the table that makes samples linear.
//!
//! A DNG counts sites, rows and columns from the corner of its active area, the project from the sensor's.

use super::area::Rectangle;
use super::image::RawImage;
use super::storage::Sample;
use super::tags::{self, DngTag};
use crate::camera::levels::BlackLevel;
use crate::error::{Error, Result};
use crate::formats::tiff::TiffFile;

/// Most sites beside or below each other after which black levels repeat; those of filter arrays have at most 8.
const MOST_SITES: usize = 64;

/// The levels of a raw image, on the scale of its samples behind the table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Levels {
    /// By the 2×2 sites at the sensor's corner; none of levels that no such sites, rows and columns add up to.
    pub black: Option<BlackLevel>,
    /// Rows and columns after which the latter repeat.
    pub unrepresented: Option<[usize; 2]>,
    /// The highest black level.
    highest_black: f64,
    /// From which share of the range from black to white on samples may be far from linear, where that is below 1.
    linear_share: Option<f64>,
    /// What rows and columns of the sensor add; empty where none adds anything.
    pub black_by_row: Vec<f64>,
    pub black_by_column: Vec<f64>,
    pub white: f64,
    /// Linear values of stored ones.
    pub table: Option<Vec<f32>>,
}

impl Levels {
    /// Reads and checks the levels of an image whose active area lies at its place on the sensor, of which the image reaches so
    /// many columns and rows \[DNG2023, ch. 5, Mapping Raw Values to Linear Reference Values].
    ///
    /// # Errors
    ///
    /// When a table of them has the wrong length, numbers are none, or the black level is no less than the white level.
    pub fn read(
        file: &mut TiffFile,
        image: &RawImage,
        active: Rectangle,
        reach: [usize; 2],
        sample: Sample,
    ) -> Result<Self> {
        let white = tags::WHITE_LEVEL.levels(file, image.directory(), 1)?.map_or(sample.largest(), |white| white[0]);
        let Black { sites, highest, rows, columns, repeat } = Black::read(file, image, active)?;
        if highest >= white {
            return Err(file.problem(format!(
                "its BlackLevel, {highest}, is no less than its WhiteLevel, {white}; correct its tags"
            )));
        }
        let (of_rows, of_columns) = ([active.top, active.height, reach[1]], [active.left, active.width, reach[0]]);
        Ok(Self {
            black: sites,
            unrepresented: sites.is_none().then_some(repeat),
            highest_black: highest,
            linear_share: linear_share(file, image)?,
            black_by_row: deltas(file, image, tags::BLACK_DELTA_V, "rows", (of_rows, &rows))?,
            black_by_column: deltas(file, image, tags::BLACK_DELTA_H, "columns", (of_columns, &columns))?,
            white,
            table: table(file, image, sample)?,
        })
    }

    /// From which share of the range from black to white on, and from which level, samples may be far from linear.
    pub fn linear(&self) -> Option<(f64, f64)> {
        let black = self.highest_black;
        self.linear_share.map(|share| (share, black + share * (self.white - black)))
    }

    /// A doubt of a black level that is not known here, as nothing here has so many sites.
    pub fn doubt_of_black(&self) -> Option<String> {
        self.unrepresented.map(|[rows, columns]| {
            format!(
                "its black levels repeat after {rows}x{columns} sites (BlackLevelRepeatDim), and are no sum of those of 2x2 sites, rows and \
                 columns: none of them counts; dark frames come off with `correct-frame --dark`, and a mean level with `correct-frame --black N`"
            )
        })
    }

    /// A doubt of a white level that no sample reaches, so that none counts as saturated. Floats have no largest.
    pub fn doubt_of_white(&self, sample: Sample) -> Option<String> {
        let Sample::Integer { bits } = sample else { return None };
        let (largest, of) = match self.table.as_ref().and_then(|table| table.iter().copied().reduce(f32::max)) {
            Some(largest) => (f64::from(largest), "its LinearizationTable".to_owned()),
            None => (sample.largest(), format!("{bits} bits")),
        };
        (self.white > largest).then(|| {
            format!(
                "its WhiteLevel, {}, lies above the largest code of {of}, {largest}: no sample counts as saturated; correct its \
                 tags",
                self.white
            )
        })
    }
}

/// The black level of an active area.
#[derive(Debug, Clone, PartialEq)]
struct Black {
    /// By the sites at the sensor's corner; none where sites, rows and columns do not add up to it.
    sites: Option<BlackLevel>,
    highest: f64,
    /// What rows and columns of the area add, again and again; empty where none adds anything.
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// Rows and columns after which the file's levels repeat.
    repeat: [usize; 2],
}

impl Black {
    fn read(file: &mut TiffFile, image: &RawImage, active: Rectangle) -> Result<Self> {
        let directory = image.directory();
        let repeat = tags::BLACK_REPEAT.whole::<2>(file, directory)?.unwrap_or([1, 1]);
        if !repeat.iter().all(|side| (1..=MOST_SITES).contains(side)) {
            let [rows, columns] = repeat;
            return Err(file.problem(format!(
                "it is damaged; its BlackLevelRepeatDim is {rows}x{columns}, and levels repeat after 1 to {MOST_SITES} sites"
            )));
        }
        let count = repeat[0] * repeat[1];
        let levels = tags::BLACK_LEVEL.levels(file, directory, count)?.unwrap_or_else(|| vec![0.0; count]);
        let black = Self::of(repeat, &levels);
        Ok(Self { sites: black.sites.map(|sites| sites.beginning_at([active.left, active.top])), ..black })
    }

    /// Levels that repeat after so many rows and columns, row by row, as those of 2×2 sites, and what rows and columns add:
    ///
    /// L(y, x) = S(y mod 2, x mod 2) + a(y) + b(x),  a = b = 0 of the first two
    fn of(repeat: [usize; 2], levels: &[f64]) -> Self {
        /// What sums of ratios are off by, ADU.
        const ROUNDING: f64 = 1e-9;
        // An odd period and two sites meet again after twice the period.
        let [rows, columns] = repeat.map(|side| side * (1 + side % 2));
        let level = |y: usize, x: usize| levels[y % repeat[0] * repeat[1] + x % repeat[1]];
        let of_rows: Vec<f64> = (0..rows).map(|y| level(y, 0) - level(y % 2, 0)).collect();
        let of_columns: Vec<f64> = (0..columns).map(|x| level(0, x) - level(0, x % 2)).collect();
        let is_sum = |y: usize, x: usize| {
            let scale = 1.0 + level(y, x).abs();
            (level(y % 2, x % 2) + of_rows[y] + of_columns[x] - level(y, x)).abs() <= ROUNDING * scale
        };
        let are_sums = (0..rows).all(|y| (0..columns).all(|x| is_sum(y, x)));
        let sites = BlackLevel::Sites([level(0, 0), level(0, 1), level(1, 0), level(1, 1)]);
        let unless_none = |deltas: Vec<f64>| {
            let are_none = !are_sums || deltas.iter().all(|delta| *delta == 0.0);
            if are_none { Vec::new() } else { deltas }
        };
        Self {
            sites: are_sums.then(|| sites.uniform().map_or(sites, BlackLevel::Uniform)),
            highest: levels.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            rows: unless_none(of_rows),
            columns: unless_none(of_columns),
            repeat,
        }
    }
}

/// The share of the range from black to white from which on the response may be far from linear \[DNG2023, LinearResponseLimit]; none
/// of 1, of all of it. What is no share tells nothing.
fn linear_share(file: &mut TiffFile, image: &RawImage) -> Result<Option<f64>> {
    let told = match tags::LINEAR_RESPONSE_LIMIT.exactly::<1>(file, &image.first) {
        Err(Error::Format { .. }) => None,
        other => other?,
    };
    Ok(told.map(|[share]| share).filter(|share| *share > 0.0 && *share < 1.0))
}

/// What rows or columns add to the black level, from the sensor's corner on: nothing outside the active area, which has
/// `count` of `all`, from `first` on; with what they add again and again.
fn deltas(
    file: &mut TiffFile,
    image: &RawImage,
    tag: DngTag,
    what: &str,
    ([first, count, all], again): ([usize; 3], &[f64]),
) -> Result<Vec<f64>> {
    let found = tag.numbers(file, image.directory(), count as u64 + 1)?.unwrap_or_default();
    let is_level = found.iter().all(|delta| *delta == 0.0);
    if is_level && again.is_empty() {
        return Ok(Vec::new());
    }
    if !is_level && found.len() != count {
        let number = if found.len() > count { "more".to_owned() } else { found.len().to_string() };
        let name = tag.1;
        return Err(file.problem(format!(
            "it is damaged; its {name} has {number} numbers, and the active area has {count} {what}"
        )));
    }
    let mut deltas = vec![0.0; all];
    for (place, delta) in deltas[first..first + count].iter_mut().enumerate() {
        let own = if is_level { 0.0 } else { found[place] };
        *delta = own + again.get(place % again.len().max(1)).copied().unwrap_or(0.0);
    }
    Ok(deltas)
}

/// The linear values of stored ones; those beyond the end of the table have its last.
fn table(file: &mut TiffFile, image: &RawImage, sample: Sample) -> Result<Option<Vec<f32>>> {
    /// Stored values that there can be.
    const VALUES: u64 = 1 << 16;
    let tag = tags::LINEARIZATION_TABLE;
    let Some(values) = tag.unsigned(file, image.directory(), VALUES)? else { return Ok(None) };
    if values.is_empty() {
        return Err(file.problem("it is damaged; its LinearizationTable is empty"));
    }
    if matches!(sample, Sample::Float { .. }) {
        return Err(file.problem("it is damaged; a LinearizationTable is for integers, and its samples are floats"));
    }
    let values = values.into_iter().map(|value| u16::try_from(value).map(f32::from));
    let values: std::result::Result<Vec<f32>, _> = values.collect();
    values.map(Some).map_err(|_| file.problem("it is damaged; its LinearizationTable has values of more than 16 bits"))
}
