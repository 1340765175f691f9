//! Fixed patterns and temporal noise, each parted into what rows, columns and single photosites add.
//!
//! The mean of L frames holds the pattern and 1/L of the temporal noise; each part of that comes off its part of the pattern
//! \[EMVA1288, Sec. 8.2]. What light adds is that of the flats less that of the darks, over the mean between them.

use super::level::Level;
use super::rounding::Hidden;
use super::row_drift::{RowDrift, RowScatter, are_smooth, drift_among};
use super::site_survey::SiteSurvey;
use crate::numerics::variance_components::{Interval, MeanSquare, MeanSquares, combination};

/// A part of a variance between photosites.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Total,
    /// What rows add.
    Row,
    /// What columns add.
    Column,
    /// What is left to single photosites.
    Pixel,
}

impl Part {
    /// How much of each mean square is this part of the variance, in a table of so many columns and rows.
    fn shares(self, [columns, rows]: [usize; 2]) -> [f64; 3] {
        let [of_row, of_column] = [1.0 / columns as f64, 1.0 / rows as f64];
        match self {
            Self::Total => [of_row, of_column, 1.0 - of_row - of_column],
            Self::Row => [of_row, 0.0, -of_row],
            Self::Column => [0.0, of_column, -of_column],
            Self::Pixel => [0.0, 0.0, 1.0],
        }
    }
}

/// The mean squares of rows, columns and what is left of all grids, each with its share in a part of a variance that the grids share, which
/// are counted by their photosites.
fn all_terms(
    level: &Level,
    part: Part,
    of: impl Fn(usize) -> (MeanSquares, [usize; 2]),
    factor: f64,
) -> Vec<(f64, MeanSquare)> {
    let count: f64 = level.sites.iter().map(|site| site.count() as f64).sum();
    let mut terms = Vec::new();
    for (index, site) in level.sites.iter().enumerate() {
        let (squares, size) = of(index);
        let [rows, columns, rest] = part.shares(size).map(|share| share * factor * site.count() as f64 / count);
        terms.extend([(rows, squares.rows), (columns, squares.columns), (rest, squares.rest)]);
    }
    terms
}

/// Those that have a share.
fn terms(
    level: &Level,
    part: Part,
    of: impl Fn(usize) -> (MeanSquares, [usize; 2]),
    factor: f64,
) -> Vec<(f64, MeanSquare)> {
    let mut terms = all_terms(level, part, of, factor);
    terms.retain(|(share, _)| *share != 0.0);
    terms
}

/// A drift that is left in rows, so much of its variance, makes them alike, and fewer.
fn fewer(squares: MeanSquares, drift: Option<RowDrift>, [columns, _]: [usize; 2], left: f64) -> MeanSquares {
    let kept = drift.map_or(1.0, |drift| drift.kept_freedom(squares.rows.value / columns as f64, left));
    MeanSquares { rows: MeanSquare { freedom: squares.rows.freedom * kept, ..squares.rows }, ..squares }
}

/// Terms of the fixed pattern of a level.
fn fixed_terms(level: &Level, part: Part, factor: f64) -> Vec<(f64, MeanSquare)> {
    let drift = drift_of(&[level]);
    let frames = level.frames as f64;
    let spatial =
        |index: usize| (fewer(level.sites[index].spatial, drift, size(level, index), 1.0 / frames), size(level, index));
    let temporal =
        |index: usize| (fewer(level.sites[index].temporal, drift, size(level, index), 1.0), size(level, index));
    let mut found = terms(level, part, spatial, factor);
    found.extend(terms(level, part, temporal, -factor / frames));
    found
}

fn size(level: &Level, index: usize) -> [usize; 2] {
    level.sites[index].size
}

/// Variance that a part of the fixed pattern has at a level.
pub fn fixed(level: &Level, part: Part, confidence: f64) -> Interval {
    combination(&fixed_terms(level, part, 1.0), confidence)
}

/// What rounding hides of the variances that the pattern and the temporal noise of a level are parted into, whose samples spread by both.
pub fn hidden_pattern(level: &Level, rounding: f64) -> Hidden {
    /// The value hangs on none.
    const ANY: f64 = 0.95;
    if rounding <= 0.0 {
        return Hidden::default();
    }
    let pattern = fixed(level, Part::Total, ANY).value.max(0.0);
    let [own, all] = [0.0, pattern].map(|pattern| level.hidden_beneath(pattern));
    Hidden { variance: own.variance + all.variance, ..all }
}

/// An interval of a part of the variance of a level with what rounding hides of it.
pub fn with_hidden(Interval { value, low, high }: Interval, part: Part, level: &Level, rounding: f64) -> Interval {
    /// Steps that are hidden are not made up for by more than this.
    const MOST: f64 = 0.9;
    let Hidden { variance, step, .. } = hidden_pattern(level, rounding);
    if part == Part::Row || part == Part::Column {
        // Means of rows, or columns, are steps of samples that spread.
        return Interval { value, low: low / (1.0 + step).powi(2), high: high / (1.0 - step.min(MOST)).powi(2) };
    }
    Interval { value, low: low - variance, high: high + variance }
}

/// Variance that a part of the pattern has under light beyond that in the dark.
pub fn of_light(flat: &Level, dark: &Level, part: Part, confidence: f64) -> Interval {
    let mut found = fixed_terms(flat, part, 1.0);
    found.extend(fixed_terms(dark, part, -1.0));
    combination(&found, confidence)
}

/// What temporal noise of whole columns, and of whole rows, leaves in the mean of a level's frames: variances, and what they scatter by.
pub fn left_in_mean(level: &Level) -> [[f64; 2]; 2] {
    /// That of a standard deviation to both sides.
    const ONE: f64 = 0.682_689_492_137_085_9;
    [Part::Column, Part::Row].map(|part| {
        let Interval { value, low, high } = temporal_of(&[level], part, ONE, |site| site.temporal);
        [value.max(0.0), (high - low) / 2.0].map(|of| of / level.frames as f64)
    })
}

/// Variance that a part of the temporal noise has, over several levels that have it alike; of rows without what drifts along them.
pub fn temporal(levels: &[&Level], part: Part, confidence: f64) -> Interval {
    temporal_of(levels, part, confidence, squares_of(levels, part))
}

/// The mean squares that tell a part of the temporal noise of levels.
fn squares_of(levels: &[&Level], part: Part) -> impl Fn(&SiteSurvey) -> MeanSquares + Copy {
    let is_apart = part == Part::Row && are_smooth(&row_scatters(levels));
    let drift = if is_apart { None } else { drift_of(levels) };
    move |site: &SiteSurvey| {
        if is_apart {
            return MeanSquares { rows: site.row_scatter.mean_square_apart(), ..site.temporal };
        }
        fewer(site.temporal, drift, site.size, 1.0)
    }
}

/// The correlation of what a part of the temporal noise of several levels is found to be with what the whole variance of one of them is found
/// to be: both are made of the same mean squares M, with shares c and g in them.
///
/// Σ c g V(M)/√(Σ c² V(M) · V(v))        the first sum over the mean squares of the one level, the second over those of all
pub fn correlation_with_variance(levels: &[&Level], part: Part, of: &Level) -> f64 {
    let squares = squares_of(levels, part);
    let weight = |level: &Level| level.frames as f64 - 1.0;
    let all: f64 = levels.iter().map(|level| weight(level)).sum();
    let terms = |level: &Level, part: Part, factor: f64| {
        all_terms(level, part, |index| (squares(&level.sites[index]), level.sites[index].size), factor)
    };
    let (mut own, mut both) = (0.0, 0.0);
    for level in levels {
        let of_part = terms(level, part, weight(level) / all);
        own += of_part.iter().map(|(share, square)| share * share * square.variance()).sum::<f64>();
        if std::ptr::eq(*level, of) {
            let with = of_part.iter().zip(terms(level, Part::Total, 1.0));
            both += with.map(|((c, square), (g, _))| c * g * square.variance()).sum::<f64>();
        }
    }
    let scatter = (own * of.variance_variance).sqrt();
    if scatter > 0.0 { (both / scatter).clamp(-1.0, 1.0) } else { 0.0 }
}

/// The drift of the black level along rows over several levels that have it alike, in samples²; none where none is told.
pub fn drift_of(levels: &[&Level]) -> Option<RowDrift> {
    drift_among(&row_scatters(levels))
}

fn row_scatters(levels: &[&Level]) -> Vec<RowScatter> {
    levels.iter().flat_map(|level| &level.sites).map(|site| site.row_scatter).collect()
}

fn temporal_of(
    levels: &[&Level],
    part: Part,
    confidence: f64,
    of: impl Fn(&SiteSurvey) -> MeanSquares + Copy,
) -> Interval {
    let weight = |level: &Level| level.frames as f64 - 1.0;
    let all: f64 = levels.iter().map(|level| weight(level)).sum();
    let of_level = |level: &&Level| {
        let (level, share) = (*level, weight(level) / all);
        terms(level, part, move |index| (of(&level.sites[index]), level.sites[index].size), share)
    };
    combination(&levels.iter().flat_map(of_level).collect::<Vec<_>>(), confidence)
}
