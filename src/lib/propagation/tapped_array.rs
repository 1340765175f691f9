//! The photosites of a plane that several amplifiers have read, and the pixels that are made of them.

use super::bent_lines::BentLine;
use super::drift::NUMBERS;
use super::moments::SiteCovariance;
use super::smooth_hue::hues;
use super::tap_lines::TapLines;
use super::tapped_axis::Axis;
use super::tapped_factors::{Factors, Site, TapMoments};
use super::tapped_hue::TappedHue;
use super::taps::Group;
use super::unpredictable::{Predicted, Unpredictable};
use crate::camera::taps::{TapLayout, Taps};
use crate::cfa::Class;
use crate::frame::mirror;
use crate::metadata::FrameHeader;
use crate::names::Named;
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{REACH, phase};
use crate::stages::demosaic::weights::{WeightTable, Weights};
use nalgebra::Matrix3;
use std::collections::BTreeMap;

/// Why nothing is said of a frame that lies elsewhere than its record says.
const ELSEWHERE: &str =
    "it does not lie within the plane that it was demosaicked from (`demosaic.plane` of the metadata)";

/// Where the photosites of a plane are, and what reads them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Array {
    pub weights: Weights,
    taps: Taps,
    size: [u32; 2],
    pub moments: TapMoments,
    /// What rows, and columns, have beyond what is shared.
    pub bent: [Option<BentLine>; 2],
    /// About what green is above black where smooth hue transition divides by it.
    pub green: Option<f64>,
    /// Columns and rows.
    pub axes: [Axis; 2],
}

impl Array {
    /// Of the photosites of a frame, `groups` of them with their amplifiers, and what these share.
    pub fn of(
        frame: &FrameHeader,
        groups: &[(usize, Group)],
        lines: Option<&TapLines>,
        mean: [f64; 3],
    ) -> Predicted<Self> {
        let record = frame.metadata.demosaic.as_ref().ok_or(Unpredictable::Missing("demosaic"))?;
        let method = Method::named(&record.method)
            .ok_or(Unpredictable::Beyond("it was demosaicked by a method that is unknown here"))?;
        let readout = frame.readout().map_err(|_| Unpredictable::Missing("sensor.readout"))?;
        // One amplifier reads all where no others are named.
        let one =
            || Taps { layout: TapLayout::Columns, gain: vec![1.0], offset_e: Vec::new(), read_noise_e: Vec::new() };
        let taps = readout.taps.clone().unwrap_or_else(one);
        let plane = record.plane.ok_or(Unpredictable::Missing("demosaic.plane"))?;
        let geometry = &frame.geometry;
        let extents = [geometry.width, geometry.height];
        let axis = |axis: usize| {
            let (first, length) = (plane[axis], usize::try_from(plane[axis + 2]).ok()?);
            let start = usize::try_from(i64::from(geometry.origin[axis]).checked_sub(first)?).ok()?;
            let lines = start..start.checked_add(extents[axis])?;
            let taps = |line: i64| readout.taps_of_line(axis, line);
            (lines.end <= length && !lines.is_empty()).then(|| Axis::of(first, length, lines, method.reach(), taps))
        };
        let axes = axis(0).zip(axis(1)).ok_or(Unpredictable::Beyond(ELSEWHERE))?;
        let moments: Vec<_> = groups.iter().map(|(tap, group)| (*tap, group.sites)).collect();
        Ok(Self {
            weights: WeightTable::of(method, record.cfa).about(hues(mean)),
            green: (method == Method::SmoothHue).then_some(mean[Class::Green as usize]),
            taps,
            size: [readout.width, readout.height],
            moments: TapMoments::of(&moments, lines),
            bent: lines.map_or([None, None], |lines| lines.bent.clone()),
            axes: axes.into(),
        })
    }

    pub fn on_sensor(&self, at: [usize; 2]) -> [i64; 2] {
        [0, 1].map(|axis| self.axes[axis].first + at[axis] as i64)
    }

    /// What reads the photosite of a column and row of the plane.
    pub fn tap(&self, at: [usize; 2]) -> usize {
        self.taps.tap(self.size, self.on_sensor(at))
    }

    /// What reads the photosite of a column and row of the plane, and its class.
    pub fn of_site(&self, at: [usize; 2]) -> [usize; 2] {
        let [x, y] = self.on_sensor(at);
        [self.tap(at), self.weights.pattern().class(x, y) as usize]
    }

    /// Where it stands in what lines share.
    pub fn place(&self, at: [usize; 2]) -> usize {
        let [tap, class] = self.of_site(at);
        self.moments.place(tap, class)
    }

    /// Photosites of the rectangle, one of each kind of place, and how many there are.
    pub fn examples(&self) -> impl Iterator<Item = ([usize; 2], f64)> + '_ {
        let [columns, rows] = &self.axes;
        rows.examples.iter().flat_map(|(y, of_y)| columns.examples.iter().map(move |(x, of_x)| ([*x, *y], of_x * of_y)))
    }

    /// What photosites of two classes share on average in a row (axis 0) or column (1) that has both: behind one amplifier, or along rows
    /// whose columns go by turns, behind any.
    pub fn mean_of_line(&self, factors: &Factors, axis: usize, classes: [usize; 2]) -> f64 {
        let by_turns = axis == 0 && self.taps.layout == TapLayout::Columns;
        // Of each line, how many photosites of both classes each amplifier has.
        let mut lines: BTreeMap<usize, BTreeMap<usize, [f64; 2]>> = BTreeMap::new();
        for (at, count) in self.examples() {
            let [x, y] = self.on_sensor(at);
            let class = self.weights.pattern().class(x, y) as usize;
            let counts = lines.entry(at[1 - axis]).or_default().entry(self.tap(at)).or_default();
            (0..2).filter(|i| classes[*i] == class).for_each(|i| counts[i] += count);
        }
        let (mut sum, mut all) = (0.0, 0.0);
        let of = |a: usize, b: usize| factors.between([a, classes[0]], [b, classes[1]]);
        for counts in lines.values() {
            let whole = counts.values().fold([0.0; 2], |sum, counts| [sum[0] + counts[0], sum[1] + counts[1]]);
            if whole.contains(&0.0) {
                continue;
            }
            for (a, [one, _]) in counts {
                sum += match by_turns {
                    true => counts.iter().map(|(b, [_, other])| one * other / whole[1] * of(*a, *b)).sum(),
                    false => one * of(*a, *a),
                };
            }
            all += whole[0];
        }
        if all > 0.0 { sum / all } else { 0.0 }
    }

    /// The drift of rows as a patch meets it, by shares of its places: of amplifiers that read columns by turns that of all together.
    pub fn drifts(&self) -> Vec<(f64, SiteCovariance)> {
        let Some(drift) = self.moments.shared.as_ref().and_then(|shared| shared.drift.as_ref()) else { return vec![] };
        let mut counts: BTreeMap<usize, [f64; 3]> = BTreeMap::new();
        for (at, count) in self.examples() {
            let [tap, class] = self.of_site(at);
            counts.entry(tap).or_default()[class] += count;
        }
        let of_loads = |loads: [[f64; NUMBERS]; 3]| {
            let between = |k: usize, l: usize| loads[k].iter().zip(loads[l]).map(|(one, other)| one * other).sum();
            let drift_matrix = Matrix3::from_fn(between);
            let none = SiteCovariance::independent([0.0; 3]);
            SiteCovariance { row: drift_matrix, drift: drift_matrix, drift_rows: drift.rows_per_knot, ..none }
        };
        let load = |tap: usize, class: usize| drift.factors.load(tap, class);
        if self.taps.layout == TapLayout::Columns {
            let mean = |class: usize| {
                let all: f64 = counts.values().map(|counts| counts[class]).sum();
                let sum = |part: usize| -> f64 {
                    counts.iter().map(|(tap, counts)| counts[class] * load(*tap, class)[part]).sum()
                };
                std::array::from_fn(|part| if all > 0.0 { sum(part) / all } else { 0.0 })
            };
            return vec![(1.0, of_loads([0, 1, 2].map(mean)))];
        }
        let all: f64 = counts.values().flatten().sum();
        let of_tap = |(tap, counts): (&usize, &[f64; 3])| {
            (counts.iter().sum::<f64>() / all, of_loads([0, 1, 2].map(|class| load(*tap, class))))
        };
        counts.iter().map(of_tap).collect()
    }

    /// What of its variance is its own.
    pub fn own(&self, at: [usize; 2]) -> f64 {
        let [tap, class] = self.of_site(at);
        self.moments.own[tap][class]
    }

    /// The same of its third and fourth cumulants.
    pub fn own_cumulants(&self, at: [usize; 2]) -> [f64; 2] {
        let [tap, class] = self.of_site(at);
        self.moments.cumulants[tap][class]
    }

    /// The pixel of a column and row, of demosaicked channels, by smooth hue transition.
    pub fn hue(&self, at: [usize; 2], black: f64) -> Option<TappedHue> {
        let [x, y] = self.on_sensor(at);
        let size = self.axes.each_ref().map(|axis| axis.codes.len());
        let of_site = |offset: [isize; 2]| {
            let to = [0, 1].map(|axis| mirror(at[axis].cast_signed() + offset[axis], size[axis]));
            ([0, 1].map(|axis| to[axis].cast_signed() - at[axis].cast_signed()), self.of_site(to))
        };
        let pattern = self.weights.pattern();
        self.green.map(|green| TappedHue::of(pattern, phase(x, y), [black, green], &self.moments, of_site))
    }

    /// The pixel of a column and row, of demosaicked channels, by a method that is linear.
    pub fn pixel(&self, at: [usize; 2], black: f64) -> ([f64; 3], Vec<Site>) {
        let [x, y] = self.on_sensor(at);
        let phase = phase(x, y);
        let size = self.axes.each_ref().map(|axis| axis.codes.len());
        let stencils = [0, 1, 2].map(|channel| self.weights.stencil(phase, channel).folded(at, size));
        let (mut mean, mut sites) = ([0.0; 3], Vec::new());
        for offset in (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| [x, y])) {
            let weights = stencils.each_ref().map(|stencil| stencil.at(offset));
            if weights == [0.0; 3] {
                continue;
            }
            let class = self.weights.class(phase, offset) as usize;
            // What lies beyond an edge is folded back.
            let tap = self.tap([0, 1].map(|axis| at[axis].saturating_add_signed(offset[axis])));
            let of_site = self.moments.sites[tap][class].moments.mean;
            mean.iter_mut().zip(weights).for_each(|(mean, weight)| *mean += weight * (of_site - black));
            sites.push(Site { offset, class, tap, variance: self.moments.own[tap][class], weights });
        }
        (mean, sites)
    }
}
