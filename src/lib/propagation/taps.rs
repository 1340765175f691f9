//! Frames of sensors that are read through several amplifiers: which of them read what, and the frame as each reads it.
//!
//! Behind one amplifier a photosite is as any other, with the slope, the bias and the read noise of that. Over a frame or a region
//! photosites are groups of known sizes, one for each amplifier, and not drawn among them.

use super::divided::NOISY;
use super::divided_drift::pattern_of;
use super::drift;
use super::moments::{Equations, LineCovariance, Prediction, common};
use super::tap_lines::{Lit, TapLines};
use super::tapped_flat::{check_flat, flat_of};
use super::tapped_level::{self, Behind, Rectangle};
use super::unpredictable::{Predicted, Unpredictable};
use crate::camera::taps::TapLayout;
use crate::cfa::{CfaPattern, Class};
use crate::frame::Geometry;
use crate::metadata::{AdcRecord, AverageRecord, FlatRecord, FrameHeader};
use crate::names::Named;
use crate::numerics::normal::MeanVariance;
use crate::stages::demosaic::Method;
use nalgebra::Matrix3;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// Why nothing is said of what several amplifiers have read, where it is not told apart.
const MIXED: &str = "several amplifiers (`taps` of the sensor) have read it, and this is told of frames and crops behind one of them, \
                     with the reach of demosaicking";

/// The same where they read columns by turns.
const MIXED_BY_TURNS: &str = "several amplifiers (`taps` of the sensor) have read its columns by turns, and this is told of frames that one \
                              alone has read";

/// Whether amplifiers read the columns of a frame by turns.
pub(super) fn are_by_turns(frame: &FrameHeader) -> bool {
    frame.taps().is_some_and(|taps| taps.layout == TapLayout::Columns)
}

/// Photosites of a frame that one amplifier reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// How many of R, G and B there are.
    pub counts: [f64; 3],
    /// Their moments.
    pub sites: [Prediction; 3],
}

/// Photosites of a frame or a region that several amplifiers have read.
#[derive(Debug, Clone, PartialEq)]
pub struct TappedSites {
    /// Those of each.
    pub groups: Vec<Group>,
    /// What they share with others of their rows and columns; none where they share nothing.
    pub lines: Option<Box<TapLines>>,
    /// Where they are.
    pub cells: Cells,
    /// The covariance of what all samples of R, G and B are off together.
    pub level: Matrix3<f64>,
}

/// Photosites by rows and columns that are alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// How many rows there are of each kind.
    pub rows: Vec<f64>,
    /// How many columns there are of each kind.
    pub columns: Vec<f64>,
    /// One of each kind of both.
    pub all: Vec<Cell>,
    /// Whether amplifiers read columns by turns.
    pub are_by_turns: bool,
    /// The first row on the sensor.
    pub first_row: i64,
    /// The kind of each row from it on.
    pub kinds_of_rows: Vec<usize>,
}

/// Photosites of the rows of one kind and the columns of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// The kind of their rows.
    pub row: usize,
    /// The kind of their columns.
    pub column: usize,
    /// Which of the groups they are of.
    pub group: usize,
    /// Their class; none of three planes.
    pub class: Option<Class>,
}

impl Cell {
    /// Whether photosites of a class are among them.
    fn has(&self, class: Class) -> bool {
        self.class.is_none_or(|of| of == class)
    }
}

impl Cells {
    /// Whether they are of a plane behind a filter array.
    fn are_of_plane(&self) -> bool {
        self.all.iter().any(|cell| cell.class.is_some())
    }

    /// How many photosites there are in a cell.
    pub fn count(&self, cell: &Cell) -> f64 {
        self.rows[cell.row] * self.columns[cell.column]
    }

    /// What two photosites of a class have in common in a row on average, `line` that of two by their groups, over so many of its
    /// successive columns from any on.
    fn in_rows(&self, class: Class, columns: f64, line: impl Fn(usize, usize) -> f64) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for row in 0..self.rows.len() {
            let mut counts: BTreeMap<usize, f64> = BTreeMap::new();
            for cell in self.all.iter().filter(|cell| cell.row == row && cell.has(class)) {
                *counts.entry(cell.group).or_default() += self.count(cell);
            }
            let (n, groups) = (counts.values().sum::<f64>(), counts.len() as f64);
            let same: f64 = counts.iter().map(|(g, count)| count * line(*g, *g)).sum();
            all += n;
            sum += if self.are_by_turns && counts.len() > 1 {
                let pairs = counts.keys().flat_map(|g| counts.keys().map(move |h| (*g, *h)));
                let cross: f64 = pairs.filter(|(g, h)| g != h).map(|(g, h)| line(g, h)).sum();
                // Each of the groups has q or q + 1 of the columns, r of them the latter, all r as likely.
                let (q, r) = ((columns / groups).floor(), columns.rem_euclid(groups));
                let [one, two] = [r / groups, r * (r - 1.0) / (groups * (groups - 1.0))];
                let even = q * q + 2.0 * q * r / groups;
                ((even + one) * groups * same + (even + two) * n * cross) / (columns * columns)
            } else {
                same
            };
        }
        if all > 0.0 { sum / all } else { 0.0 }
    }
}

impl TappedSites {
    /// The shares of all photosites that are of R, G and B.
    pub fn shares(&self) -> [f64; 3] {
        let counts = [0, 1, 2].map(|k| self.groups.iter().map(|group| group.counts[k]).sum::<f64>());
        let all: f64 = counts.iter().sum();
        counts.map(|count| if all > 0.0 { count / all } else { 0.0 })
    }

    fn share(&self, group: usize, class: usize) -> f64 {
        let all: f64 = self.groups.iter().map(|group| group.counts[class]).sum();
        if all > 0.0 { self.groups[group].counts[class] / all } else { 0.0 }
    }

    /// What two photosites of two classes share on average in a row but for its drift, in a column, and of the drift: behind one amplifier, or of
    /// a plane whose columns go by turns, behind any.
    fn between_classes(&self, k: usize, l: usize) -> [f64; 3] {
        let Some(lines) = &self.lines else { return [0.0; 3] };
        let is_plane = self.cells.are_of_plane();
        let groups = 0..self.groups.len();
        let of_lines: [&dyn Fn(usize, usize) -> f64; 3] =
            [&|a, b| lines.row_alone(a, b), &|a, b| lines.column[(a, b)], &|a, b| lines.drift(a, b)];
        of_lines.map(|line| {
            let of = |g: usize, h: usize| line(3 * g + k, 3 * h + l);
            if is_plane && self.cells.are_by_turns {
                let of_group =
                    |g: usize| groups.clone().map(|h| self.share(g, k) * self.share(h, l) * of(g, h)).sum::<f64>();
                return groups.clone().map(of_group).sum();
            }
            groups.clone().map(|g| 0.5 * (self.share(g, k) + self.share(g, l)) * of(g, g)).sum()
        })
    }

    /// Covariance of R, G and B over all photosites; off the diagonal that of two in one row and one column, or of three planes of one
    /// place, with what the means of amplifiers have in common.
    pub fn covariance(&self) -> Matrix3<f64> {
        let classes = pooled(&self.groups);
        let is_plane = self.cells.are_of_plane();
        let off = |group: &Group, i: usize| group.sites[i].moments.mean - classes[i].moments.mean;
        Matrix3::from_fn(|i, j| {
            if i == j {
                return classes[i].moments.variance;
            }
            let shared: f64 = self.between_classes(i, j).iter().sum();
            // Amplifiers move the classes together, but for those of a plane, which are other photosites.
            let of_place = |(g, group): (usize, &Group)| {
                let together = self.lines.as_ref().map_or(0.0, |lines| lines.together[g][(i, j)]);
                self.share(g, i) * (off(group, i) * off(group, j) + together)
            };
            let at_a_place: f64 = if is_plane { 0.0 } else { self.groups.iter().enumerate().map(of_place).sum() };
            shared + at_a_place
        })
    }

    /// Covariance of the mean of so many columns and rows of photosites, on average over their places; of amplifiers of halves of the sensor
    /// behind one.
    pub fn patch_mean(&self, [columns, rows]: [usize; 2]) -> Matrix3<f64> {
        let of_drift = |lines: &TapLines| {
            lines.drift.as_ref().map_or(0.0, |drift| drift::of_mean_of_rows(rows, drift.rows_per_knot))
        };
        let drift_share = self.lines.as_ref().map_or(0.0, |lines| of_drift(lines));
        let [columns, rows] = [columns as f64, rows as f64];
        let over = |k: usize, of: &dyn Fn(usize) -> f64| -> f64 {
            (0..self.groups.len()).map(|g| self.share(g, k) * of(g)).sum()
        };
        Matrix3::from_fn(|k, l| {
            let Some(lines) = &self.lines else {
                let variance = |g: usize| self.groups[g].sites[k].moments.variance;
                return if k == l { over(k, &variance) / (columns * rows) } else { 0.0 };
            };
            if k != l {
                let [row, column, drift] = self.between_classes(k, l);
                let together = over(k, &|g| lines.together[g][(k, l)]);
                return row / rows + column / columns + together / (columns * rows) + drift * drift_share;
            }
            let own = over(k, &|g| lines.own(3 * g + k, self.groups[g].sites[k].moments.variance));
            let column = over(k, &|g| lines.column[(3 * g + k, 3 * g + k)]);
            let in_rows = |of: &dyn Fn(usize, usize) -> f64| {
                self.cells.in_rows(Class::ALL[k], columns, |g, h| of(3 * g + k, 3 * h + k))
            };
            let [row, drift] = [in_rows(&|a, b| lines.row_alone(a, b)), in_rows(&|a, b| lines.drift(a, b))];
            own / (columns * rows) + row / rows + column / columns + drift * drift_share
        })
    }
}

/// Photosites of one amplifier, before anything is predicted.
pub(super) struct Part {
    /// Which of them.
    pub tap: usize,
    /// How many of R, G and B there are.
    pub counts: [f64; 3],
    /// The frame as if all were read through it.
    pub frame: FrameHeader,
}

/// The frame as if all of it were read through one of its amplifiers.
pub(super) fn of_tap(frame: &FrameHeader, tap: usize) -> FrameHeader {
    let mut made = frame.clone();
    let taps = frame.taps().cloned();
    let of_all = made.metadata.adc.or_else(|| frame.readout().ok().map(AdcRecord::of_readout));
    let flat = made.metadata.correction.as_mut().and_then(|correction| correction.flat.as_mut());
    if let (Some(flat), Some(adc), Some(taps)) = (flat, of_all, &taps) {
        flat.converters = (0..flat.tap_photosites.len()).map(|tap| adc.of_tap(taps, tap)).collect();
    }
    if let (Some(adc), Some(taps)) = (&mut made.metadata.adc, taps) {
        *adc = adc.of_tap(&taps, tap);
    }
    if let Some(readout) = made.metadata.sensor.as_mut().and_then(|sensor| sensor.readout.as_mut()) {
        *readout = readout.of_tap(tap);
    }
    made
}

/// The frame as if one amplifier of relative gain 1 and no offset read it.
pub(super) fn as_if_one(frame: &FrameHeader) -> Cow<'_, FrameHeader> {
    if frame.taps().is_none() {
        return Cow::Borrowed(frame);
    }
    let mut made = frame.clone();
    if let Some(readout) = made.metadata.sensor.as_mut().and_then(|sensor| sensor.readout.as_mut()) {
        readout.taps = None;
    }
    Cow::Owned(made)
}

/// The same; what several divided by a flat field as the first of them reads it, whose samples all have the same slope.
pub(super) fn as_one_reads(frame: &FrameHeader) -> Cow<'_, FrameHeader> {
    match frame.taps().and_then(|_| flat_of(frame)) {
        Some(_) => Cow::Owned(of_tap(frame, 0)),
        None => as_if_one(frame),
    }
}

/// Lines of a frame that are alike: one of them, and how many there are; and of which kind each is.
fn kinds(first: i64, length: usize, kind: impl Fn(i64) -> [usize; 3]) -> (Vec<(i64, f64)>, Vec<usize>) {
    let mut found: BTreeMap<[usize; 3], (i64, f64)> = BTreeMap::new();
    let all = || (0..length).map(|index| first + index as i64);
    for line in all() {
        found.entry(kind(line)).or_insert((line, 0.0)).1 += 1.0;
    }
    let places: BTreeMap<[usize; 3], usize> = found.keys().copied().zip(0..).collect();
    let of_lines = all().map(|line| places[&kind(line)]).collect();
    (found.into_values().collect(), of_lines)
}

/// The amplifiers that have read a frame, and which photosites each; none where the sensor has one.
fn cells(frame: &FrameHeader) -> Option<(Vec<usize>, Cells)> {
    frame.taps().and_then(|_| all_cells(frame))
}

/// The same where the sensor has one, too.
fn all_cells(frame: &FrameHeader) -> Option<(Vec<usize>, Cells)> {
    let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref())?;
    let Geometry { width, height, origin, .. } = frame.geometry;
    let [x0, y0] = origin.map(i64::from);
    let lines = |axis: usize, first: i64, length: usize| {
        kinds(first, length, |line| {
            let [one, other] = readout.taps_of_line(axis, line);
            [one, other, usize::from(line.rem_euclid(2) == 1)]
        })
    };
    let ((columns, _), (rows, kinds_of_rows)) = (lines(0, x0, width), lines(1, y0, height));
    let pattern: Option<CfaPattern> = frame.metadata.cfa.and_then(|array| array.bayer());
    let both = || rows.iter().flat_map(|(y, _)| columns.iter().map(move |(x, _)| [*x, *y]));
    let taps: BTreeSet<usize> = both().map(|at| readout.tap(at)).collect();
    let taps: Vec<usize> = taps.into_iter().collect();
    let cell = |(index, [x, y]): (usize, [i64; 2])| Cell {
        row: index / columns.len(),
        column: index % columns.len(),
        group: taps.binary_search(&readout.tap([x, y])).unwrap_or_default(),
        class: pattern.map(|pattern| pattern.class(x, y)),
    };
    let all = both().enumerate().map(cell).collect();
    let counts = |lines: &[(i64, f64)]| lines.iter().map(|(_, count)| *count).collect();
    let (rows, columns) = (counts(&rows), counts(&columns));
    let are_by_turns = are_by_turns(frame);
    Some((taps, Cells { rows, columns, all, are_by_turns, first_row: y0, kinds_of_rows }))
}

/// The parts of a frame that each of its amplifiers reads; one where there is one.
pub(super) fn parts(frame: &FrameHeader) -> Vec<Part> {
    let Some((taps, cells)) = cells(frame) else {
        return vec![Part { tap: 0, counts: [1.0; 3], frame: frame.clone() }];
    };
    let count = |group: usize, class: Class| -> f64 {
        let is_here = |cell: &&Cell| cell.group == group && cell.has(class);
        cells.all.iter().filter(is_here).map(|cell| cells.count(cell)).sum()
    };
    let part = |(group, tap): (usize, &usize)| Part {
        tap: *tap,
        counts: Class::ALL.map(|class| count(group, class)),
        frame: of_tap(frame, *tap),
    };
    taps.iter().enumerate().map(part).collect()
}

/// The frame with what its pixels are made of, as far as the plane reaches that they were made of, or else the sensor.
pub(super) fn with_footprint(frame: &FrameHeader) -> Cow<'_, FrameHeader> {
    let Some(record) = &frame.metadata.demosaic else { return Cow::Borrowed(frame) };
    let of_sensor = || frame.readout().map_or([0; 4], |readout| [0, 0, readout.width.into(), readout.height.into()]);
    let [x, y, width, height] = record.plane.unwrap_or_else(of_sensor);
    let reach = Method::named(&record.method).map_or(3, Method::reach) as i64;
    let mut grown = frame.clone();
    let geometry = &mut grown.geometry;
    let extents = [&mut geometry.width, &mut geometry.height];
    let ends = [[x, x.saturating_add(width)], [y, y.saturating_add(height)]];
    for ((origin, extent), [least, most]) in geometry.origin.iter_mut().zip(extents).zip(ends) {
        let (first, end) = (i64::from(*origin), i64::from(*origin) + *extent as i64);
        let (grown_first, grown_end) = (first.min((first - reach).max(least)), end.max((end + reach).min(most)));
        *origin = i32::try_from(grown_first).unwrap_or(*origin);
        *extent = usize::try_from(grown_end - grown_first).unwrap_or(*extent);
    }
    Cow::Owned(grown)
}

/// Whether a frame is of pixels that several amplifiers have a part in.
pub(super) fn are_mixed(frame: &FrameHeader) -> bool {
    let is_demosaicked = frame.taps().is_some() && frame.metadata.demosaic.is_some();
    is_demosaicked && (flat_of(frame).is_some() || parts(&with_footprint(frame)).len() > 1)
}

/// The frame as the one amplifier reads it that reads all of its photosites, those included that its pixels are made of.
///
/// # Errors
///
/// [`Unpredictable::Beyond`] where there are several, and where the gains of others count.
pub(super) fn of_one(frame: &FrameHeader) -> Predicted<Cow<'_, FrameHeader>> {
    if frame.taps().is_none() {
        return Ok(Cow::Borrowed(frame));
    }
    check_flat(frame)?;
    let geometry = frame.geometry.clone();
    match &mut parts(&with_footprint(frame))[..] {
        [one] => Ok(Cow::Owned(FrameHeader { geometry, ..one.frame.clone() })),
        _ => Err(Unpredictable::Beyond(if are_by_turns(frame) { MIXED_BY_TURNS } else { MIXED })),
    }
}

/// The photosites of a frame that several amplifiers have read, by `sites` of a frame that one amplifier reads; none where one reads all,
/// or pixels are made of several photosites.
///
/// # Errors
///
/// Those of `sites`, and [`Unpredictable::Beyond`] where no formula tells what photosites of several groups share.
pub(super) fn sites(
    frame: &FrameHeader,
    equations: Equations,
    sites: impl Fn(&FrameHeader, Equations) -> Predicted<(Lit, [Prediction; 3], Option<AverageRecord>)>,
) -> Predicted<Option<TappedSites>> {
    if frame.taps().is_none() || frame.metadata.demosaic.is_some() {
        return Ok(None);
    }
    check_flat(frame)?;
    let (parts, flat) = (parts(frame), flat_of(frame));
    let Some((_, cells)) = cells(frame).filter(|_| parts.len() > 1 || flat.is_some()) else { return Ok(None) };
    let (mut groups, mut lit, mut average) = (Vec::new(), Vec::new(), None);
    for Part { counts, frame, .. } in parts {
        let (photosite, sites, of_average) = sites(&frame, equations)?;

        groups.push(Group { counts, sites });
        lit.push(photosite);
        average = of_average;
    }
    let moments: Vec<[Prediction; 3]> = groups.iter().map(|group| group.sites).collect();
    let is_shared = moments.iter().flatten().any(|site| site.lines != LineCovariance::default());
    let lines = if is_shared { TapLines::of(&lit, &moments, average.as_ref())? } else { None };
    let level = match flat {
        Some(flat) => level_of_flat(frame, flat, |frame| {
            let (lit, moments, _) = sites(frame, equations)?;
            Ok((lit, moments))
        })?,
        None => level(&groups),
    };
    Ok(Some(TappedSites { groups, lines: lines.map(Box::new), cells, level }))
}

/// Photosites of a frame of which each amplifier has such a group, in the order of [`parts`], that share such lines.
pub(super) fn of_groups(frame: &FrameHeader, groups: Vec<Group>, lines: Option<TapLines>) -> Option<TappedSites> {
    let (_, cells) = cells(frame)?;
    let level = level(&groups);
    Some(TappedSites { groups, lines: lines.map(Box::new), cells, level })
}

/// The covariance of what all samples of R, G and B are off together that several amplifiers have read, and that such a flat field divided, by
/// `sites` of a frame that one amplifier reads.
///
/// # Errors
///
/// Those of `sites`, and [`Unpredictable::Beyond`] where no formula tells.
pub(super) fn level_of_flat(
    frame: &FrameHeader,
    flat: &FlatRecord,
    sites: impl Fn(&FrameHeader) -> Predicted<(Lit, [Prediction; 3])>,
) -> Predicted<Matrix3<f64>> {
    let readout = frame.readout().map_err(|_| Unpredictable::Missing("sensor.readout"))?;
    let pattern = pattern_of(frame);
    let rectangle = |area: [i64; 4]| Rectangle::of(readout, pattern, area);
    let has_read = |tap: &usize| flat.tap_photosites[*tap].iter().any(|count| *count > 0);
    let behind = |tap: usize| {
        let (lit, moments) = sites(&of_tap(frame, tap))?;
        Ok(Behind { tap, lit, means: moments.map(|site| site.moments.mean) })
    };
    let all = (0..flat.tap_photosites.len()).filter(has_read).map(behind).collect::<Predicted<Vec<_>>>()?;
    let here = rectangle(frame.geometry.on_sensor());
    let of_level = flat.area.map_or_else(|| rectangle(frame.geometry.on_sensor()), rectangle);
    tapped_level::level(flat, [&here, &of_level], &all).ok_or(Unpredictable::Beyond(NOISY))
}

/// The covariance of what all samples of R, G and B are off together, of photosites of one group; several have none.
pub(super) fn level(groups: &[Group]) -> Matrix3<f64> {
    match groups {
        [one] => common(&one.sites),
        _ => Matrix3::zeros(),
    }
}

/// Photosites of a frame that one amplifier reads, of such moments, as one group; none where they do not follow what they share on a curve,
/// unless `always`.
///
/// # Errors
///
/// [`Unpredictable::Beyond`] where no formula tells what they share.
pub(super) fn one_group(
    frame: &FrameHeader,
    lit: &Lit,
    sites: [Prediction; 3],
    average: Option<&AverageRecord>,
    always: bool,
) -> Predicted<Option<TappedSites>> {
    let lines = TapLines::of(std::slice::from_ref(lit), &[sites], average)?;
    let lines = lines.filter(|lines| always || lines.are_bent());
    let (Some(lines), Some((_, cells))) = (lines, all_cells(frame)) else { return Ok(None) };
    let count = |class: Class| cells.all.iter().filter(|cell| cell.has(class)).map(|cell| cells.count(cell)).sum();
    let groups = vec![Group { counts: Class::ALL.map(count), sites }];
    let level = level(&groups);
    Ok(Some(TappedSites { groups, lines: Some(Box::new(lines)), cells, level }))
}

/// Mean, variance and third cumulant of photosites of groups taken together, by classes; their excess kurtosis is what they have on
/// average.
pub fn pooled(groups: &[Group]) -> [Prediction; 3] {
    [0, 1, 2].map(|k| {
        let n: f64 = groups.iter().map(|group| group.counts[k]).sum();
        let sum = |of: &dyn Fn(&Prediction) -> f64| -> f64 {
            let parts = groups.iter().map(|group| group.counts[k] * of(&group.sites[k]));
            if n > 0.0 { parts.sum::<f64>() / n } else { 0.0 }
        };
        let mean = sum(&|site| site.moments.mean);
        let within = sum(&|site| site.moments.variance);
        let between = sum(&|site| (site.moments.mean - mean).powi(2));
        let found = Prediction::of_cumulants(mean, within, sum(&|site| site.third), sum(&Prediction::fourth));
        let moments = MeanVariance { mean, variance: within + between };
        Prediction { moments, sixth: sum(&|site| site.sixth), ..found }
    })
}
