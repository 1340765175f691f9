//! The black level as the masked border of a frame has it: photosites beside the active area, which no light reaches.

use super::notes::Note;
use crate::camera::levels::BlackLevel;
use crate::error::{Error, Result};
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::places::in_stream;
use crate::frame::{Geometry, to_sample};
use crate::metadata::{BlackNoise, FrameHeader};
use crate::numerics::averages::{Combine, average, clipped_variance};
use crate::stream::RowSource;
use std::path::Path;

/// What a black level is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Border {
    /// The whole border: a level for each of the 2×2 sites.
    Whole,
    /// The same, and what the masked photosites of each row are off.
    Rows,
    /// The same, and what the masked photosites of each column are off.
    Columns,
}

/// Standard deviations beyond which photosites of the border do not count: hot ones, and those that light leaks into.
const CLIP: f64 = 4.0;

/// Reads a frame for the black level that its border has, and notes it in `frame`, the same frame's head; says what it is.
///
/// # Errors
///
/// [`Error::Usage`] for a frame that cannot be read twice; [`Error::Format`] for one of several planes, or whose metadata know no
/// masked photosites, or none beside each row or column; those of the reader.
pub fn measure_black(frame: &mut FrameHeader, options: &InputOptions, border: Border) -> Result<Note> {
    let is_file = options.path.as_deref().is_some_and(|path| path != Path::new("-"));
    if !is_file || in_stream(&frame.name) != frame.name {
        let problem = "a frame whose border tells its black level is read twice; name a file that holds it alone";
        return Err(Error::Usage(problem.into()));
    }
    if frame.geometry.channels.len() != 1 {
        return Err(frame.refuse(format!("it holds {}; the border of one plane is told", frame.holds())));
    }
    let areas = frame.metadata.masked_areas.clone();
    if areas.is_empty() {
        return Err(frame.refuse(
            "its metadata know no masked photosites (`masked_areas`); `import-raw --crop full` keeps those of a DNG that has any",
        ));
    }
    let origin = frame.geometry.origin;
    let Masked { sites, lines } = Masked::read(frame, &areas, options, border)?;
    if sites.iter().any(Vec::is_empty) {
        return Err(frame.refuse("not all of its 2x2 sites have masked photosites"));
    }
    let counts = sites.each_ref().map(Vec::len);
    let levels = sites.map(|mut of_site| average(Combine::Clipped, &mut of_site, CLIP).0);
    let above = |of_line: &[(usize, f32)], off: f64| -> Vec<f32> {
        of_line.iter().map(|(site, sample)| to_sample(f64::from(*sample) - levels[*site] - off)).collect()
    };
    let offs: Vec<Option<f64>> = match border {
        Border::Whole => vec![Some(0.0); lines.len()],
        _ => offs_of(&lines.iter().map(|of_line| above(of_line, 0.0)).collect::<Vec<_>>()),
    };
    let noise = noise(border, counts, &lines, |line| above(&lines[line], offs[line].unwrap_or_default()));
    // Counted from the sensor's corner.
    let deltas = |first: i32, what: &str| {
        let found: Option<Vec<f64>> = offs.iter().copied().collect();
        let found = found.ok_or_else(|| uncovered(frame, &offs, options, border, what))?;
        let first = usize::try_from(first).map_err(|_| frame.refuse("it begins before the sensor's corner"))?;
        Ok::<_, Error>([vec![0.0; first], found].concat())
    };
    let (by_row, by_column) = match border {
        Border::Whole => (Vec::new(), Vec::new()),
        Border::Rows => (deltas(origin[1], "rows")?, Vec::new()),
        Border::Columns => (Vec::new(), deltas(origin[0], "columns")?),
    };
    let level = BlackLevel::Sites(levels);
    let metadata = &mut frame.metadata;
    metadata.black_noise = Some(noise);
    metadata.set_black_adu(Some(level.uniform().map_or(level, BlackLevel::from)));
    let lines = match border {
        Border::Whole => String::new(),
        Border::Rows => format!("; rows are off by {}", range_of(&by_row[first_of(origin[1])..])),
        Border::Columns => format!("; columns are off by {}", range_of(&by_column[first_of(origin[0])..])),
    };
    (metadata.black_by_row, metadata.black_by_column) = (by_row, by_column);
    let [a, b, c, d] = levels;
    Ok(Note::Remark(format!(
        "{}: the {} photosites of its border read {a:.3}, {b:.3}, {c:.3} and {d:.3} ADU at the 2x2 sites, row by row{lines}",
        frame.name,
        counts.iter().sum::<usize>()
    )))
}

/// The complaint about a frame not all of whose lines have masked photosites, with the rectangle that leaves such lines out where
/// the others lie together.
fn uncovered(frame: &FrameHeader, offs: &[Option<f64>], options: &InputOptions, border: Border, what: &str) -> Error {
    let has = |off: &Option<f64>| off.is_some();
    let problem = format!("not all of its {what} have masked photosites");
    let ends = offs.iter().position(has).zip(offs.iter().rposition(has));
    let Some((first, last)) = ends.filter(|(first, last)| offs[*first..=*last].iter().all(has)) else {
        return frame.refuse(problem);
    };
    // A rectangle is counted from the first sample that is stored.
    let [x, y] = options.crop.map_or([0, 0], |crop| [crop.x, crop.y]);
    let (Geometry { width, height, .. }, count) = (&frame.geometry, last - first + 1);
    let rectangle = match border {
        Border::Columns => format!("{},{y},{count},{height}", x + first),
        _ => format!("{x},{},{width},{count}", y + first),
    };
    frame.refuse(format!("{problem}, and those that have lie in the rectangle {rectangle}")).give(&["crop"])
}

/// The samples of masked photosites.
struct Masked {
    /// Those of each of the 2×2 sites, row by row.
    sites: [Vec<f32>; 4],
    /// Those of each row, or column, with their site; the whole border is one line.
    lines: Vec<Vec<(usize, f32)>>,
}

impl Masked {
    /// Reads those of a frame within `areas`, left, top, width and height on the sensor.
    fn read(frame: &FrameHeader, areas: &[[i64; 4]], options: &InputOptions, border: Border) -> Result<Self> {
        // The next frame of several is not meant.
        let mut reader = FrameReader::open(&InputOptions { sequence: None, ..options.clone() })?;
        let Geometry { width, height, origin, .. } = frame.geometry.clone();
        let [x0, y0] = origin.map(i64::from);
        let mut sites: [Vec<f32>; 4] = Default::default();
        let count = match border {
            Border::Whole => 1,
            Border::Rows => height,
            Border::Columns => width,
        };
        let mut lines = vec![Vec::new(); count];
        let mut samples = Vec::new();
        for y in 0..height {
            samples.clear();
            reader.read(1, &mut samples)?;
            for (x, sample) in samples[..width].iter().enumerate().filter(|(_, sample)| sample.is_finite()) {
                let place = [x0 + x as i64, y0 + y as i64];
                if areas.iter().any(|[left, top, wide, high]| {
                    (*left..left + wide).contains(&place[0]) && (*top..top + high).contains(&place[1])
                }) {
                    let site = usize::from(place[1] & 1 != 0) * 2 + usize::from(place[0] & 1 != 0);
                    sites[site].push(*sample);
                    let line = match border {
                        Border::Whole => 0,
                        Border::Rows => y,
                        Border::Columns => x,
                    };
                    lines[line].push((site, *sample));
                }
            }
        }
        Ok(Self { sites, lines })
    }
}

/// What lines are off by: the mean of what lies within [`CLIP`] standard deviations of their median; none of an empty one. The deviation
/// is that of the photosites of all lines about the medians of theirs: of few photosites none lies far out by its own, which a hot one
/// makes.
fn offs_of(lines: &[Vec<f32>]) -> Vec<Option<f64>> {
    let median = |line: &Vec<f32>| (!line.is_empty()).then(|| average(Combine::Median, &mut line.clone(), CLIP).0);
    let medians: Vec<Option<f64>> = lines.iter().map(median).collect();
    let about = |(line, median): (&Vec<f32>, &Option<f64>)| -> Vec<f32> {
        median.iter().flat_map(|median| line.iter().map(move |sample| to_sample(f64::from(*sample) - median))).collect()
    };
    let mut left: Vec<f32> = lines.iter().zip(&medians).flat_map(about).collect();
    let reach = CLIP * scatter(&mut left, medians.iter().flatten().count()).sqrt();
    let off = |(line, median): (&Vec<f32>, &Option<f64>)| {
        let median = (*median)?;
        let near: Vec<f64> =
            line.iter().map(|sample| f64::from(*sample)).filter(|sample| (sample - median).abs() <= reach).collect();
        Some(if near.is_empty() { median } else { near.iter().sum::<f64>() / near.len() as f64 })
    };
    lines.iter().zip(&medians).map(off).collect()
}

/// The variance of masked photosites about what so many lines are off.
fn scatter(left: &mut [f32], lines: usize) -> f64 {
    let degrees = left.len().saturating_sub(lines).max(1) as f64 / left.len().max(1) as f64;
    clipped_variance(left, CLIP) / degrees
}

/// What such a black level is uncertain by: samples scatter about the level of their site and what their line is off, which is
/// none of it.
fn noise(
    border: Border,
    of_sites: [usize; 4],
    lines: &[Vec<(usize, f32)>],
    left_of: impl Fn(usize) -> Vec<f32>,
) -> BlackNoise {
    let mut left: Vec<f32> = (0..lines.len()).flat_map(left_of).collect();
    let told = lines.iter().filter(|of_line| !of_line.is_empty()).count();
    let scatter = scatter(&mut left, told);
    // Of a mean of so many, the fewest that one has.
    let of_mean = |count: usize| scatter / count.max(1) as f64;
    let of_lines = |kind: Border| {
        let fewest = lines.iter().map(Vec::len).min().filter(|_| border == kind);
        fewest.map_or(0.0, of_mean)
    };
    BlackNoise {
        site_adu2: of_mean(of_sites.into_iter().min().unwrap_or_default()),
        row_adu2: of_lines(Border::Rows),
        column_adu2: of_lines(Border::Columns),
    }
}

/// Where the lines of a frame begin among those of the sensor, none of which come before its corner.
fn first_of(origin: i32) -> usize {
    usize::try_from(origin).unwrap_or_default()
}

/// The smallest and the largest of some numbers of ADU, in words.
fn range_of(off: &[f64]) -> String {
    let [low, high] =
        off.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], off| [low.min(*off), high.max(*off)]);
    format!("{low:.3} to {high:.3} ADU")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One hot photosite among eight of a line; lines without any.
    #[test]
    fn a_hot_photosite_moves_no_line() {
        let noise = |line: usize, x: usize| to_sample(((line * 37 + x * 101) % 13) as f64 - 6.0);
        let mut lines: Vec<Vec<f32>> = (0..40).map(|line| (0..8).map(|x| noise(line, x)).collect()).collect();
        let plain = offs_of(&lines);
        for (line, off) in plain.iter().enumerate() {
            let mean = lines[line].iter().map(|sample| f64::from(*sample)).sum::<f64>() / 8.0;
            assert!((off.unwrap() - mean).abs() < 1e-12);
        }
        lines[20][3] = 1300.0;
        lines.push(Vec::new());
        let found = offs_of(&lines);
        let others: f64 = [0, 1, 2, 4, 5, 6, 7].iter().map(|x| f64::from(noise(20, *x))).sum::<f64>() / 7.0;
        assert!((found[20].unwrap() - others).abs() < 1e-12, "{:?}", found[20]);
        assert_eq!((found[19], found[40]), (plain[19], None));
    }
}
