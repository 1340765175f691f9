//! What a camera read of the patches of a chart: in a frame, or as a table of means.

use super::super::super::notes::{self, Note};
use crate::analysis::chart::grid::Grid;
use crate::analysis::chart::reading::{ChartReader, ReadPatch, doubt_of_pattern};
use crate::error::{Error, Result};
use crate::formats::chart::load_patches;
use crate::formats::input::FrameReader;
use crate::metadata::FrameHeader;
use crate::stream::RowSource;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// What a camera read of patches.
pub(super) struct Seen {
    /// Where from.
    pub(super) source: String,
    pub(super) names: Option<Vec<String>>,
    pub(super) signals: Vec<Vector3<f64>>,
    pub(super) covariances: Vec<Matrix3<f64>>,
    /// Patches that do not count, and why.
    pub(super) left_out: Vec<(usize, String)>,
    pub(super) frame: Option<FrameHeader>,
    /// White level less black level, where means are not shares of it already.
    pub(super) range_adu: Option<f64>,
    pub(super) notes: Vec<Note>,
    /// What was read of the patches of a chart in a frame; none of a table.
    pub(super) read: Vec<ReadPatch>,
}

/// What a camera read of the patches of a chart if it is turned.
pub(super) struct Turned {
    pub(super) corners: [[f64; 2]; 4],
    pub(super) seen: Seen,
}

/// Means of a table; `levels` are black and white level, ADU, where its means are not shares of the range between them.
///
/// # Errors
///
/// Those of [`load_patches`]; [`Error::Format`] for means that are no shares.
pub(super) fn see_table(path: &Path, levels: Option<[f64; 2]>) -> Result<Seen> {
    let table = load_patches(path)?;
    let [black, white] = levels.unwrap_or([0.0, 1.0]);
    let range = white - black;
    if levels.is_none() && table.means.as_flattened().iter().any(|mean| *mean > 1.0) {
        let problem = "its means are above 1; shares of white level less black level are not";
        return Err(Error::format(&path.display().to_string(), problem).give(&["levels"]));
    }
    let share = |mean: &[f64; 3]| Vector3::from(mean.map(|value| (value - black) / range));
    let is_full = |mean: &[f64; 3]| mean.iter().any(|value| *value >= white);
    let full = table.means.iter().enumerate().filter(|(_, mean)| is_full(mean));
    Ok(Seen {
        source: path.display().to_string(),
        left_out: full.map(|(index, _)| (index, "its mean is at the white level".to_owned())).collect(),
        signals: table.means.iter().map(share).collect(),
        covariances: table.covariances.iter().map(|covariance| covariance / (range * range)).collect(),
        names: table.names,
        frame: None,
        range_adu: levels.map(|_| range),
        notes: Vec::new(),
        read: Vec::new(),
    })
}

/// Means of the patches in a frame, and those that there would be if the corners were given from another on.
///
/// # Errors
///
/// Those of readers and of [`ChartReader`]; [`Error::Format`] for a Bayer pattern whose greens are red and blue.
pub(super) fn see_frame(mut reader: FrameReader, corners: [[f64; 2]; 4]) -> Result<(Seen, Vec<Turned>)> {
    let frame = reader.header().clone();
    let mut charts = Vec::new();
    for turns in 0..corners.len() {
        let mut corners = corners;
        corners.rotate_left(turns);
        let grid = Grid::new(corners).map_err(|problem| Error::Usage(format!("--corners: {problem}")))?;
        charts.push((corners, ChartReader::new(&frame, grid)?));
    }
    let range_adu = charts.first().map(|(_, chart)| chart.range_adu());
    let pattern = charts.first().map(|(_, chart)| chart.pattern());
    frame.black_levels()?.into_iter().for_each(|black| reader.compare_masked(black));
    let height = frame.geometry.height;
    let step = frame.geometry.band_rows(frame.geometry.step_rows(reader.natural_rows()), 1);
    let (mut rows, mut done) = (Vec::new(), 0);
    while done < height {
        rows.clear();
        let count = step.min(height - done);
        reader.read(count, &mut rows)?;
        charts.iter_mut().for_each(|(_, chart)| chart.take(&rows));
        done += count;
    }
    let mut all = charts.into_iter().map(|(corners, chart)| (corners, chart.finish()));
    let read = all.next().map_or(Ok(Vec::new()), |(_, read)| read).map_err(|problem| frame.refuse(problem))?;
    if let Some(problem) = pattern.and_then(|pattern| doubt_of_pattern(&read, pattern)) {
        return Err(frame.refuse(format!("of the patches of the chart {problem}")));
    }
    let turned =
        all.filter_map(|(corners, read)| Some(Turned { corners, seen: seen_in(&frame, &read.ok()?, Vec::new()) }));
    let turned = turned.collect();
    let mut notes = notes::of_reader(&reader);
    let least = read.iter().flat_map(|patch| patch.count).min().unwrap_or(0);
    notes.push(Note::Remark(format!("{}: {least} photosites or more of each class in a patch", frame.name)));
    Ok((Seen { range_adu, ..seen_in(&frame, &read, notes) }, turned))
}

/// What was read of the patches of a chart in a frame.
fn seen_in(frame: &FrameHeader, read: &[ReadPatch], notes: Vec<Note>) -> Seen {
    let full = read.iter().enumerate().filter(|(_, patch)| patch.saturated > 0);
    Seen {
        source: frame.name.clone(),
        names: None,
        left_out: full.map(|(index, patch)| (index, format!("{} photosites are saturated", patch.saturated))).collect(),
        read: read.to_vec(),
        signals: read.iter().map(|patch| Vector3::from(patch.signal)).collect(),
        covariances: read
            .iter()
            .map(|patch: &ReadPatch| Matrix3::from_diagonal(&Vector3::from(patch.variance)))
            .collect(),
        frame: Some(frame.clone()),
        range_adu: None,
        notes,
    }
}
