//! Pixels that are made of photosites of several amplifiers, over a rectangle of a frame.
//!
//! A pixel hangs on its place by its phase in the filter array, by which amplifier reads each of its photosites, and by what is mirrored at
//! an edge of the plane. Places that have all these in common are one kind, of the mean Σ w μ and the covariance Σ w w′ σ² over its
//! photosites; over the rectangle there is so much of each kind, and what is between the means of kinds is variance like what is
//! within them.

use super::bent_lines::BentLine;
use super::curved::{self, PixelLaw};
use super::gains;
use super::pixel_moments::PixelMoments;
use super::sampling::Sampling;
use super::smooth_hue::hues;
use super::spaces::{Channels, Curved};
use super::tap_lines::TapLines;
use super::tapped_axis::Axis;
pub use super::tapped_factors::TapMoments;
use super::tapped_factors::{Factors, Loads, Site, first_order, loads, product};
use super::taps::Group;
use super::unpredictable::{Predicted, Unpredictable};
use crate::camera::taps::{TapLayout, Taps};
use crate::metadata::FrameHeader;
use crate::names::Named;
use crate::numerics::normal::{self, MeanVariance};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{self, PHASES, REACH, phase};
use crate::stages::demosaic::weights::{WeightTable, Weights};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// Why nothing is said of a frame that lies elsewhere than its record says.
const ELSEWHERE: &str =
    "it does not lie within the plane that it was demosaicked from (`demosaic.plane` of the metadata)";

/// Moments of the pixels of a rectangle of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TappedPixels {
    /// Mean of the three channels over all pixels, bias included.
    pub mean: [f64; 3],
    /// How far noise moves the mean where the channels are curved functions of the photosites.
    pub bias: [f64; 3],
    /// Covariance of the three channels over all pixels: what is within kinds of places, and between them.
    pub covariance: Matrix3<f64>,
    /// Photosites that these are made of, of each amplifier, in the unit that the weights act on.
    pub groups: Vec<Group>,
    /// Derivatives of the channels with respect to demosaicked R, G and B, on average.
    from_camera: Matrix3<f64>,
    space: Option<Curved>,
    pub(super) array: Array,
    /// By rows of kinds.
    pub(super) kinds: Vec<Kind>,
    pub(super) sampling: OnceLock<Sampling>,
}

/// Where the photosites of a plane are, and what reads them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Array {
    pub weights: Weights,
    taps: Taps,
    size: [u32; 2],
    pub moments: TapMoments,
    /// What rows, and columns, have beyond what is shared.
    pub bent: [Option<BentLine>; 2],
    /// Columns and rows.
    pub axes: [Axis; 2],
}

/// Pixels of one kind.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kind {
    /// Share of the pixels of the rectangle.
    share: f64,
    pub mean: [f64; 3],
    bias: [f64; 3],
    covariance: Matrix3<f64>,
    /// What of that is beyond the weights.
    pub beyond: Matrix3<f64>,
    pub sites: Vec<Site>,
    /// Weights of the three channels by offset.
    table: Vec<[f64; 3]>,
    from_camera: Matrix3<f64>,
    /// What it has of what rows and columns share; none where they share nothing.
    pub loads: Option<[Loads; 2]>,
    /// Where the channels are curved, those that they are curved in: their mean, and the derivatives of the channels by them.
    curved_in: Option<([f64; 3], Matrix3<f64>)>,
}

const SIDE: usize = 2 * REACH.unsigned_abs() + 1;

impl Array {
    /// Of the photosites of a frame, `groups` of them with their amplifiers, and what these share.
    fn of(frame: &FrameHeader, groups: &[(usize, Group)], lines: Option<&TapLines>, hues: [f64; 2]) -> Predicted<Self> {
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
            weights: WeightTable::of(method, record.cfa).about(hues),
            taps,
            size: [readout.width, readout.height],
            moments: TapMoments::of(&moments, lines),
            bent: lines.map_or([None, None], |lines| lines.bent.clone()),
            axes: axes.into(),
        })
    }

    fn on_sensor(&self, at: [usize; 2]) -> [i64; 2] {
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
    fn examples(&self) -> impl Iterator<Item = ([usize; 2], f64)> + '_ {
        let [columns, rows] = &self.axes;
        rows.examples.iter().flat_map(|(y, of_y)| columns.examples.iter().map(move |(x, of_x)| ([*x, *y], of_x * of_y)))
    }

    /// What photosites of two classes share on average in a row (axis 0) or column (1) that has both: behind one amplifier, or along rows
    /// whose columns go by turns, behind any.
    fn mean_of_line(&self, factors: &Factors, axis: usize, classes: [usize; 2]) -> f64 {
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

    /// The pixel of a column and row, of demosaicked channels.
    fn pixel(&self, at: [usize; 2], black: f64) -> ([f64; 3], Vec<Site>) {
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

impl Kind {
    fn of(array: &Array, at: [usize; 2], share: f64, black: f64, channels: &Channels) -> Predicted<Self> {
        let (mean, mut sites) = array.pixel(at, black);
        let through = |matrix: &Matrix3<f64>, values: [f64; 3]| -> [f64; 3] { (matrix * Vector3::from(values)).into() };
        sites.iter_mut().for_each(|site| site.weights = through(&channels.matrix, site.weights));
        let mut mean = through(&channels.matrix, mean.map(|mean| mean - channels.black));
        let own = |site: &Site| site.variance;
        let factors = array.moments.factors.as_ref();
        let mut covariance = first_order(&sites, own, factors);
        let (mut bias, mut beyond, mut from_camera) = ([0.0; 3], Matrix3::zeros(), channels.matrix);
        let mut curved_in = None;
        if let Some(space) = channels.space {
            if !space.is_quiet(mean, &covariance) {
                return Err(Unpredictable::Beyond(curved::VOID));
            }
            let local = space.about(mean)?;
            curved_in = Some((mean, local.jacobian));
            let law = PixelLaw::of(sites.iter().map(|site| (site.weights, &array.moments.sites[site.tap][site.class])));
            // What rows and columns share is in the covariance alone: it is normal.
            let law = PixelLaw { covariance, ..law };
            let found = curved::moments(mean, &[law], |xyz| space.value(xyz));
            (mean, covariance) = found.ok_or(Unpredictable::Beyond(curved::FAR_FROM_NORMAL))?;
            bias = [0, 1, 2].map(|i| mean[i] - local.value[i]);
            from_camera = local.jacobian * channels.matrix;
            sites.iter_mut().for_each(|site| site.weights = through(&local.jacobian, site.weights));
            beyond = covariance - first_order(&sites, own, factors);
        }
        let loads = factors.map(|factors| [0, 1].map(|axis| loads(&sites, &factors[axis], axis)));
        let mut table = vec![[0.0; 3]; SIDE * SIDE];
        for site in &sites {
            table[index(site.offset)] = site.weights;
        }
        Ok(Self { share, mean, bias, covariance, beyond, sites, table, from_camera, loads, curved_in })
    }

    /// What is the same in every exposure of what is curved beyond the weights, `fixed` the law of the means that photosites have over
    /// exposures, and `whole` what they share in one.
    fn curved_pattern(&self, fixed: &TapMoments, whole: Option<&[Factors; 2]>, space: Curved) -> Matrix3<f64> {
        let found = self.curved_in.and_then(|(mean, jacobian)| Some((mean, jacobian, jacobian.try_inverse()?)));
        let Some((mean, jacobian, back)) = found else { return Matrix3::zeros() };
        let before = |site: &Site| Site { weights: (back * Vector3::from(site.weights)).into(), ..*site };
        let sites: Vec<Site> = self.sites.iter().map(before).collect();
        let law = PixelLaw::of(sites.iter().map(|site| (site.weights, &fixed.sites[site.tap][site.class])));
        let law = PixelLaw { covariance: fixed.first_order(&sites), ..law };
        let whole = first_order(&sites, |site| site.variance, whole);
        let straight = jacobian * law.covariance * jacobian.transpose();
        curved::fixed(mean, &[(law, whole - law.covariance)], |channels| space.value(channels)) - straight
    }

    /// What the photosite `offset` away gives to the channels.
    pub fn weights(&self, offset: [isize; 2]) -> [f64; 3] {
        let is_near = offset.iter().all(|distance| distance.abs() <= REACH);
        if is_near { self.table[index(offset)] } else { [0.0; 3] }
    }

    /// To first order, the covariance of the channels (rows) with those of a pixel `lag` away (columns).
    pub fn covariance_with(&self, other: &Self, lag: [isize; 2]) -> Matrix3<f64> {
        let mut found = Matrix3::zeros();
        for Site { offset, variance, weights, .. } in &self.sites {
            let theirs = other.weights([offset[0] - lag[0], offset[1] - lag[1]]);
            for j in 0..3 {
                for i in 0..3 {
                    found[(i, j)] += variance * weights[i] * theirs[j];
                }
            }
        }
        found
    }
}

fn index([x, y]: [isize; 2]) -> usize {
    (y + REACH).cast_unsigned() * SIDE + (x + REACH).cast_unsigned()
}

impl TappedPixels {
    /// The pixels of a frame in such channels, after so much was subtracted from its photosites, of which each amplifier has a group; `lines`
    /// is what these share.
    pub(super) fn of(
        frame: &FrameHeader,
        channels: &Channels,
        black: f64,
        groups: &[(usize, Group)],
        lines: Option<&TapLines>,
    ) -> Predicted<Self> {
        let first = groups.first().map(|(_, group)| group.sites.map(|site| site.moments.mean - black));
        // Weights hang on hues after smooth hue transition alone, of one amplifier.
        let array = Array::of(frame, groups, lines, first.map_or([1.0; 2], hues))?;
        let [columns, rows] = array.axes.each_ref().map(|axis| &axis.examples);
        let count = array.axes.iter().map(|axis| axis.lines.len() as f64).product::<f64>();
        let mut kinds = Vec::with_capacity(columns.len() * rows.len());
        for (y, of_y) in rows {
            for (x, of_x) in columns {
                kinds.push(Kind::of(&array, [*x, *y], of_x * of_y / count, black, channels)?);
            }
        }
        let over = |of: &dyn Fn(&Kind) -> [f64; 3]| {
            [0, 1, 2].map(|i| kinds.iter().map(|kind| kind.share * of(kind)[i]).sum::<f64>())
        };
        let (mean, bias) = (over(&|kind| kind.mean), over(&|kind| kind.bias));
        let of_kind = |kind: &Kind| {
            let off = [0, 1, 2].map(|i| kind.mean[i] - mean[i]);
            kind.share * (kind.covariance + product(&off, &off))
        };
        let covariance = kinds.iter().map(of_kind).sum();
        let from_camera = kinds.iter().map(|kind| kind.share * kind.from_camera).sum();
        let groups = groups.iter().map(|(_, group)| *group).collect();
        let (space, sampling) = (channels.space, OnceLock::new());
        Ok(Self { mean, bias, covariance, groups, from_camera, space, array, kinds, sampling })
    }

    /// The same with mean and covariance of a large frame of one amplifier, of which these are the first order.
    pub(super) fn with_moments(mut self, moments: &PixelMoments) -> Self {
        let beyond = moments.beyond_weights();
        let further = [0, 1, 2].map(|i| moments.mean[i] - self.mean[i]);
        for kind in &mut self.kinds {
            kind.mean.iter_mut().zip(further).for_each(|(mean, further)| *mean += further);
            kind.covariance += beyond - kind.beyond;
            kind.beyond = beyond;
        }
        Self { mean: moments.mean, bias: moments.bias, covariance: moments.covariance, ..self }
    }

    /// The kind of the pixel in a column and row of the plane.
    pub(super) fn kind(&self, [x, y]: [usize; 2]) -> &Kind {
        let [columns, rows] = &self.array.axes;
        &self.kinds[rows.kind(y) * columns.examples.len() + columns.kind(x)]
    }

    /// Pixels of the rectangle.
    pub(super) fn count(&self) -> f64 {
        self.array.axes.iter().map(|axis| axis.lines.len() as f64).product()
    }

    /// How far the mean of a kind lies from that of all.
    pub(super) fn off(&self, kind: &Kind) -> [f64; 3] {
        [0, 1, 2].map(|i| kind.mean[i] - self.mean[i])
    }

    /// Pixels of the rectangle up to so far away from a place, and how far they are.
    pub(super) fn near(&self, at: [usize; 2], far: isize) -> impl Iterator<Item = (&Kind, [isize; 2])> {
        let lines = |axis: usize| {
            let all = &self.array.axes[axis].lines;
            all.start.max(at[axis].saturating_add_signed(-far))..all.end.min(at[axis].saturating_add_signed(far + 1))
        };
        let (columns, rows) = (lines(0), lines(1));
        let lag = move |to: [usize; 2]| [0, 1].map(|axis| to[axis].cast_signed() - at[axis].cast_signed());
        rows.flat_map(move |y| columns.clone().map(move |x| [x, y])).map(move |to| (self.kind(to), lag(to)))
    }

    /// Means and standard deviations of pixels of each kind.
    pub fn each_kind(&self) -> impl Iterator<Item = [(f64, f64); 3]> + '_ {
        let of = |kind: &Kind, i: usize| (kind.mean[i], kind.covariance[(i, i)].max(0.0).sqrt());
        self.kinds.iter().map(move |kind| [0, 1, 2].map(|i| of(kind, i)))
    }

    /// Covariance of what is between the means of kinds of places.
    pub fn between(&self) -> Matrix3<f64> {
        let of_kind = |kind: &Kind| {
            let off = self.off(kind);
            kind.share * product(&off, &off)
        };
        self.kinds.iter().map(of_kind).sum()
    }

    /// What is the same in every exposure of what is curved beyond the weights, within kinds of places.
    pub fn curved_pattern(&self, fixed: &TapMoments) -> Matrix3<f64> {
        let Some(space) = self.space else { return Matrix3::zeros() };
        let whole = self.array.moments.factors.as_ref();
        self.kinds.iter().map(|kind| kind.share * kind.curved_pattern(fixed, whole, space)).sum()
    }

    /// What is the same in every exposure to first order, within kinds of places.
    pub fn fixed(&self, fixed: &TapMoments) -> Matrix3<f64> {
        self.kinds.iter().map(|kind| kind.share * fixed.first_order(&kind.sites)).sum()
    }

    /// The covariance over all pixels to first order, within kinds of places.
    pub fn first_order(&self) -> Matrix3<f64> {
        let factors = self.array.moments.factors.as_ref();
        let of_kind = |kind: &Kind| kind.share * first_order(&kind.sites, |site| site.variance, factors);
        self.kinds.iter().map(of_kind).sum()
    }

    /// Whether photosites of a row or of a column share noise.
    pub fn has_lines(&self) -> bool {
        self.array.moments.factors.is_some()
    }

    /// Distance of a pixel from what the mean is without noise.
    pub fn noise_length(&self) -> MeanVariance {
        let (mut mean, mut square) = (0.0, 0.0);
        for kind in &self.kinds {
            let offset = Vector3::from([0, 1, 2].map(|i| kind.mean[i] - self.mean[i] + self.bias[i]));
            let length = normal::length(&offset, &kind.covariance);
            mean += kind.share * length.mean;
            square += kind.share * (length.variance + length.mean.powi(2));
        }
        MeanVariance { mean, variance: (square - mean * mean).max(0.0) }
    }

    /// To first order, the covariance of the mean of a patch well within the frame, over all its places or those of a phase: what is
    /// within kinds of places. Amplifiers of halves read all of it or nothing; of those that read columns by turns each has as many.
    pub fn patch_mean(&self, phase: Option<usize>, size: [usize; 2]) -> Matrix3<f64> {
        let [mut sums, mut counts] = [[0.0; PHASES.len()]; 2];
        for (at, count) in self.array.examples() {
            let [column, row] = self.array.on_sensor(at);
            let place = stencil::phase(column, row);
            sums[place] += count * self.array.own(at);
            counts[place] += count;
        }
        let variances =
            std::array::from_fn(|place| if counts[place] > 0.0 { sums[place] / counts[place] } else { 0.0 });
        let shared = self.array.moments.factors.as_ref().map(|factors| {
            [0, 1].map(|axis| Matrix3::from_fn(|k, l| self.array.mean_of_line(&factors[axis], axis, [k, l])))
        });
        let of = |phase| {
            let own = gains::patch_mean_by_place(&self.array.weights, phase, size, variances);
            let shared = shared
                .as_ref()
                .map(|[rows, columns]| gains::patch_mean(&self.array.weights, phase, size).of_lines([rows, columns]));
            own + shared.unwrap_or_default()
        };
        let covariance = match phase {
            Some(phase) => of(phase),
            None => (0..PHASES.len()).map(of).sum::<Matrix3<f64>>() / PHASES.len() as f64,
        };
        self.from_camera * covariance * self.from_camera.transpose()
    }

    /// The covariance over all pixels, to first order and within kinds of places, for photosites of such variances, by amplifier
    /// and class, of what is each photosite's own, or is the same along rows (0) or columns (1).
    pub fn within(&self, shared_by: Option<usize>, variance: impl Fn(usize, usize) -> f64) -> Matrix3<f64> {
        let Some(axis) = shared_by else {
            let own = |site: &Site| variance(site.tap, site.class);
            return self.kinds.iter().map(|kind| kind.share * first_order(&kind.sites, own, None)).sum();
        };
        let single = Factors::single(self.array.moments.own.len(), |tap, class| variance(tap, class).max(0.0).sqrt());
        let factors = if axis == 0 { [single, Factors::none()] } else { [Factors::none(), single] };
        let of_kind = |kind: &Kind| kind.share * first_order(&kind.sites, |_| 0.0, Some(&factors));
        self.kinds.iter().map(of_kind).sum()
    }
}
