//! Black and white levels, and the table that makes samples linear.
//!
//! A DNG counts sites, rows and columns from the corner of its active area, the project from the sensor's.

use super::area::Rectangle;
use super::image::RawImage;
use super::storage::Sample;
use super::tags::{self, DngTag};
use crate::camera::levels::BlackLevel;
use crate::error::Result;
use crate::formats::tiff::TiffFile;

/// Most sites beside or below each other after which black levels repeat; those of filter arrays have at most 8.
const MOST_SITES: usize = 64;

/// The levels of a raw image, on the scale of its samples behind the table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Levels {
    pub black: BlackLevel,
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
    /// When a table of them has the wrong length, numbers are none, the black level is no less than the white level, or black
    /// differs by more than the 2×2 sites of a filter array.
    pub fn read(
        file: &mut TiffFile,
        image: &RawImage,
        active: Rectangle,
        reach: [usize; 2],
        sample: Sample,
    ) -> Result<Self> {
        let white = tags::WHITE_LEVEL.levels(file, image.directory(), 1)?.map_or(sample.largest(), |white| white[0]);
        let black = black(file, image, active)?;
        let highest = black.sites().into_iter().fold(f64::NEG_INFINITY, f64::max);
        if highest >= white {
            return Err(file.problem(format!(
                "its BlackLevel, {highest}, is no less than its WhiteLevel, {white}; correct its tags"
            )));
        }
        Ok(Self {
            black,
            black_by_row: deltas(file, image, tags::BLACK_DELTA_V, "rows", [active.top, active.height, reach[1]])?,
            black_by_column: deltas(
                file,
                image,
                tags::BLACK_DELTA_H,
                "columns",
                [active.left, active.width, reach[0]],
            )?,
            white,
            table: table(file, image, sample)?,
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

/// The black level by the sites at the sensor's corner.
fn black(file: &mut TiffFile, image: &RawImage, active: Rectangle) -> Result<BlackLevel> {
    let directory = image.directory();
    let [rows, columns] = tags::BLACK_REPEAT.whole::<2>(file, directory)?.unwrap_or([1, 1]);
    if ![rows, columns].iter().all(|side| (1..=MOST_SITES).contains(side)) {
        return Err(file.problem(format!(
            "it is damaged; its BlackLevelRepeatDim is {rows}x{columns}, and levels repeat after 1 to {MOST_SITES} sites"
        )));
    }
    let count = rows * columns;
    let levels = tags::BLACK_LEVEL.levels(file, directory, count)?.unwrap_or_else(|| vec![0.0; count]);
    let black = BlackLevel::repeating(columns, rows, &levels).ok_or_else(|| {
        file.problem(format!(
            "its black level differs by {rows}x{columns} sites (BlackLevelRepeatDim); levels of 2x2 sites are supported"
        ))
    })?;
    Ok(black.beginning_at([active.left, active.top]))
}

/// What rows or columns add to the black level, from the sensor's corner on: nothing outside the active area, which has
/// `count` of `all`, from `first` on.
fn deltas(
    file: &mut TiffFile,
    image: &RawImage,
    tag: DngTag,
    what: &str,
    [first, count, all]: [usize; 3],
) -> Result<Vec<f64>> {
    let found = tag.numbers(file, image.directory(), count as u64 + 1)?.unwrap_or_default();
    if found.iter().all(|delta| *delta == 0.0) {
        return Ok(Vec::new());
    }
    if found.len() != count {
        let number = if found.len() > count { "more".to_owned() } else { found.len().to_string() };
        let name = tag.1;
        return Err(file.problem(format!(
            "it is damaged; its {name} has {number} numbers, and the active area has {count} {what}"
        )));
    }
    let mut deltas = vec![0.0; all];
    deltas[first..first + count].copy_from_slice(&found);
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
