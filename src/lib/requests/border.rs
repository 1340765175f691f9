//! The black level as the masked border of a frame has it: photosites beside the active area, which no light reaches.

use super::notes::Note;
use crate::camera::levels::BlackLevel;
use crate::error::{Error, Result};
use crate::formats::input::{FrameReader, InputOptions};
use crate::frame::Geometry;
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
    if !is_file {
        return Err(Error::Usage("a frame whose border tells its black level is read twice; name a file".into()));
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
    let mut reader = FrameReader::open(options)?;
    let Geometry { width, height, origin, .. } = frame.geometry.clone();
    let [x0, y0] = origin.map(i64::from);
    let mut sites: [Vec<f32>; 4] = Default::default();
    let mut rows = vec![Vec::new(); height];
    let mut columns = vec![Vec::new(); width];
    let mut samples = Vec::new();
    for (y, of_row) in rows.iter_mut().enumerate() {
        samples.clear();
        reader.read(1, &mut samples)?;
        for (x, sample) in samples[..width].iter().enumerate().filter(|(_, sample)| sample.is_finite()) {
            let place = [x0 + x as i64, y0 + y as i64];
            if areas.iter().any(|[left, top, wide, high]| {
                (*left..left + wide).contains(&place[0]) && (*top..top + high).contains(&place[1])
            }) {
                let site = usize::from(place[1] & 1 != 0) * 2 + usize::from(place[0] & 1 != 0);
                sites[site].push(*sample);
                match border {
                    Border::Whole => {}
                    Border::Rows => of_row.push((site, *sample)),
                    Border::Columns => columns[x].push((site, *sample)),
                }
            }
        }
    }
    if sites.iter().any(Vec::is_empty) {
        return Err(frame.refuse("not all of its 2x2 sites have masked photosites"));
    }
    let counts = sites.each_ref().map(Vec::len);
    let scatter =
        sites.each_ref().map(|of_site| clipped_variance(&mut of_site.clone(), CLIP)).iter().sum::<f64>() / 4.0;
    let count: usize = counts.iter().sum();
    let levels = sites.map(|mut of_site| average(Combine::Clipped, &mut of_site, CLIP).0);
    // Of a mean of so many, the fewest that one has.
    let of_mean = |fewest: Option<usize>| fewest.map_or(0.0, |count| scatter / count.max(1) as f64);
    let fewest = |lines: &[Vec<(usize, f32)>]| lines.iter().map(Vec::len).min();
    frame.metadata.black_noise = Some(BlackNoise {
        site_adu2: of_mean(counts.into_iter().min()),
        row_adu2: of_mean(fewest(&rows).filter(|_| border == Border::Rows)),
        column_adu2: of_mean(fewest(&columns).filter(|_| border == Border::Columns)),
    });
    let off = |of_line: &[(usize, f32)]| {
        let mut off: Vec<f32> =
            of_line.iter().map(|(site, sample)| sample - crate::frame::to_sample(levels[*site])).collect();
        (!off.is_empty()).then(|| average(Combine::Clipped, &mut off, CLIP).0)
    };
    // Counted from the sensor's corner.
    let deltas = |lines: &[Vec<(usize, f32)>], first: i32, what: &str| {
        let found: Option<Vec<f64>> = lines.iter().map(|of_line| off(of_line)).collect();
        let found = found.ok_or_else(|| frame.refuse(format!("not all of its {what} have masked photosites")))?;
        let first = usize::try_from(first).map_err(|_| frame.refuse("it begins before the sensor's corner"))?;
        Ok::<_, Error>([vec![0.0; first], found].concat())
    };
    let (by_row, by_column) = match border {
        Border::Whole => (Vec::new(), Vec::new()),
        Border::Rows => (deltas(&rows, origin[1], "rows")?, Vec::new()),
        Border::Columns => (Vec::new(), deltas(&columns, origin[0], "columns")?),
    };
    let level = BlackLevel::Sites(levels);
    let metadata = &mut frame.metadata;
    metadata.set_black_adu(Some(level.uniform().map_or(level, BlackLevel::from)));
    let lines = match border {
        Border::Whole => String::new(),
        Border::Rows => format!("; rows are off by {}", range_of(&by_row[first_of(origin[1])..])),
        Border::Columns => format!("; columns are off by {}", range_of(&by_column[first_of(origin[0])..])),
    };
    (metadata.black_by_row, metadata.black_by_column) = (by_row, by_column);
    let [a, b, c, d] = levels;
    Ok(Note::Remark(format!(
        "{}: the {count} photosites of its border read {a:.3}, {b:.3}, {c:.3} and {d:.3} ADU at the 2x2 sites, row by row{lines}",
        frame.name
    )))
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
