//! Frames of sensors that are read through several amplifiers: which of them read what, and the frame as each reads it.
//!
//! Behind one amplifier a photosite is as any other, with the slope, the bias and the read noise of that. Over a frame or a region
//! photosites are groups of known sizes, one for each amplifier, and not drawn among them.

use super::moments::{Equations, LineCovariance, Prediction};
use super::unpredictable::{Predicted, Unpredictable};
use crate::camera::taps::TapLayout;
use crate::cfa::{CfaPattern, Class};
use crate::frame::Geometry;
use crate::metadata::FrameHeader;
use crate::names::Named;
use crate::numerics::normal::MeanVariance;
use crate::stages::demosaic::Method;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Why nothing is said of what several amplifiers have read, where it is not told apart.
const MIXED: &str = "several amplifiers (`taps` of the sensor) have read it, and this is told of frames and crops behind one of them, \
                     with the reach of demosaicking";

/// The same where they read columns by turns.
const MIXED_BY_TURNS: &str = "several amplifiers (`taps` of the sensor) have read its columns by turns, and this is told of frames that one \
                              alone has read";

/// Why nothing is said of flat fields.
pub(super) const FLATTENED: &str = "it was divided by a flat field of a sensor that is read through several amplifiers (`taps`), and how their \
                         gains come off is not predicted";

/// Why nothing is said of what rows and columns share.
const WITH_LINES: &str = "its rows or columns share noise, and several amplifiers (`taps` of the sensor) read them; regions and crops \
                          behind one of these are predicted";

/// The same where no two columns beside each other are behind one amplifier.
const LINES_BY_TURNS: &str = "its rows or columns share noise, and several amplifiers (`taps` of the sensor) read its columns by turns, of which \
                              nothing is predicted but single columns before demosaicking";

/// Why nothing is said of what rows and columns share on the sensor of a frame.
pub(super) fn with_lines(frame: &FrameHeader) -> &'static str {
    if are_by_turns(frame) { LINES_BY_TURNS } else { WITH_LINES }
}

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

/// Lines of a frame that are alike: one of them, and how many there are.
fn kinds(first: i64, length: usize, kind: impl Fn(i64) -> [usize; 3]) -> Vec<(i64, f64)> {
    let mut found: BTreeMap<[usize; 3], (i64, f64)> = BTreeMap::new();
    for line in (0..length).map(|index| first + index as i64) {
        found.entry(kind(line)).or_insert((line, 0.0)).1 += 1.0;
    }
    found.into_values().collect()
}

/// The parts of a frame that each of its amplifiers reads; one where there is one.
pub(super) fn parts(frame: &FrameHeader) -> Vec<Part> {
    let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
    let Some(readout) = readout.filter(|readout| readout.taps.is_some()) else {
        return vec![Part { tap: 0, counts: [1.0; 3], frame: frame.clone() }];
    };
    let Geometry { width, height, origin, .. } = frame.geometry;
    let [x0, y0] = origin.map(i64::from);
    let lines = |axis: usize, first: i64, length: usize| {
        kinds(first, length, |line| {
            let [one, other] = readout.taps_of_line(axis, line);
            [one, other, usize::from(line.rem_euclid(2) == 1)]
        })
    };
    let (columns, rows) = (lines(0, x0, width), lines(1, y0, height));
    let pattern: Option<CfaPattern> = frame.metadata.cfa.and_then(|array| array.bayer());
    let mut found: BTreeMap<usize, [f64; 3]> = BTreeMap::new();
    for (y, of_rows) in &rows {
        for (x, of_columns) in &columns {
            let counts = found.entry(readout.tap([*x, *y])).or_default();
            for class in Class::ALL {
                let is_here = pattern.is_none_or(|pattern| pattern.class(*x, *y) == class);
                counts[class as usize] += if is_here { of_rows * of_columns } else { 0.0 };
            }
        }
    }
    found.into_iter().map(|(tap, counts)| Part { tap, counts, frame: of_tap(frame, tap) }).collect()
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
    is_demosaicked && parts(&with_footprint(frame)).len() > 1
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
    if frame.metadata.correction.as_ref().is_some_and(|correction| correction.flat.is_some()) {
        return Err(Unpredictable::Beyond(FLATTENED));
    }
    let geometry = frame.geometry.clone();
    match &mut parts(&with_footprint(frame))[..] {
        [one] => Ok(Cow::Owned(FrameHeader { geometry, ..one.frame.clone() })),
        _ => Err(Unpredictable::Beyond(if are_by_turns(frame) { MIXED_BY_TURNS } else { MIXED })),
    }
}

/// The groups of photosites of a frame, by `moments` of a frame that one amplifier reads; none where one reads all, or pixels are
/// made of several photosites.
///
/// # Errors
///
/// Those of `moments`, and [`Unpredictable::Beyond`] where photosites of several groups share noise.
pub(super) fn groups(
    frame: &FrameHeader,
    equations: Equations,
    moments: impl Fn(&FrameHeader, Equations) -> Predicted<[Prediction; 3]>,
) -> Predicted<Option<Vec<Group>>> {
    if frame.taps().is_none() || frame.metadata.demosaic.is_some() {
        return Ok(None);
    }
    if frame.metadata.correction.as_ref().is_some_and(|correction| correction.flat.is_some()) {
        return Err(Unpredictable::Beyond(FLATTENED));
    }
    let (parts, refused) = (parts(frame), with_lines(frame));
    if parts.len() < 2 {
        return Ok(None);
    }
    let mut found = Vec::new();
    for Part { counts, frame, .. } in parts {
        let sites = moments(&frame, equations)?;
        if sites.iter().any(|site| site.lines != LineCovariance::default()) {
            return Err(Unpredictable::Beyond(refused));
        }
        found.push(Group { counts, sites });
    }
    Ok(Some(found))
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
