//! Pixels that are made of photosites of several amplifiers, over a rectangle of a frame.
//!
//! A pixel hangs on its place by its phase in the filter array, by which amplifier reads each of its photosites, and by what is mirrored at
//! an edge of the plane. Places that have all these in common are one kind, of the mean Σ w μ and the covariance Σ w w′ σ² over its
//! photosites; over the rectangle there is so much of each kind, and what is between the means of kinds is variance like what is
//! within them.

use super::curved::{self, PixelLaw};
use super::gains;
use super::moments::Prediction;
use super::sampling::Sampling;
use super::spaces::{Channels, Curved};
use super::taps::Group;
use super::unpredictable::{Predicted, Unpredictable};
use crate::camera::taps::Taps;
use crate::metadata::FrameHeader;
use crate::names::Named;
use crate::numerics::normal::{self, MeanVariance};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{self, PHASES, REACH, phase};
use crate::stages::demosaic::weights::{WeightTable, Weights};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::ops::Range;
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
    /// By amplifier.
    sites: Vec<[Prediction; 3]>,
    /// Columns and rows.
    pub axes: [Axis; 2],
}

/// The lines of a plane along one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// The place on the sensor of the plane's first.
    first: i64,
    /// What reads each line of the plane, and its parity.
    codes: Vec<u8>,
    /// Those of the rectangle.
    pub lines: Range<usize>,
    /// The kinds of these.
    pub kinds: Vec<usize>,
    /// One of each kind, and how many there are.
    pub examples: Vec<(usize, f64)>,
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
    /// Where the channels are curved, those that they are curved in: their mean, and the derivatives of the channels by them.
    curved_in: Option<([f64; 3], Matrix3<f64>)>,
}

/// A photosite of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Site {
    pub offset: [isize; 2],
    pub class: usize,
    pub tap: usize,
    pub variance: f64,
    /// What it gives to the channels, to first order.
    pub weights: [f64; 3],
}

const SIDE: usize = 2 * REACH.unsigned_abs() + 1;

/// A code of no line.
const OUTSIDE: u8 = u8::MAX;

/// What a line of the rectangle has more than one beside it.
const WITHIN: u8 = 64;

impl Axis {
    /// Of a plane of so many lines from `first` on, of which `lines` are the rectangle's; `taps` reads a line.
    pub fn of(first: i64, length: usize, lines: Range<usize>, reach: usize, taps: impl Fn(i64) -> [usize; 2]) -> Self {
        let code = |line: i64| {
            let [a, b] = taps(line).map(|tap| u8::try_from(tap).unwrap_or_default());
            2 * (4 * a + b) + u8::from(line.rem_euclid(2) == 1)
        };
        let codes = (0..length).map(|place| code(first + place as i64)).collect();
        let mut axis = Self { first, codes, lines, kinds: Vec::new(), examples: Vec::new() };
        (axis.kinds, axis.examples) = axis.alike(axis.lines.clone(), reach, false);
        axis
    }

    /// The kinds of lines by what is around them, so far to either side, and one of each kind with their number; with `tells_rim` lines
    /// of the rectangle are told from those beside it.
    fn alike(&self, lines: Range<usize>, far: usize, tells_rim: bool) -> (Vec<usize>, Vec<(usize, f64)>) {
        let code = |place: Option<usize>| {
            let found = place.and_then(|place| Some((place, *self.codes.get(place)?)));
            found.map_or(OUTSIDE, |(place, code)| {
                code + if tells_rim && self.lines.contains(&place) { WITHIN } else { 0 }
            })
        };
        let far = far.cast_signed();
        let mut known: BTreeMap<Vec<u8>, usize> = BTreeMap::new();
        let mut examples: Vec<(usize, f64)> = Vec::new();
        let kinds = lines.map(|line| {
            let key = (-far..=far).map(|offset| code(line.checked_add_signed(offset))).collect();
            let kind = *known.entry(key).or_insert_with(|| {
                examples.push((line, 0.0));
                examples.len() - 1
            });
            examples[kind].1 += 1.0;
            kind
        });
        (kinds.collect(), examples)
    }

    /// Lines of the rectangle, one of each kind that differs in anything up to so far away, and how many there are.
    pub fn examples(&self, far: usize) -> Vec<(usize, f64)> {
        self.alike(self.lines.clone(), far, true).1
    }

    /// The same of the lines that have a part in the rectangle.
    pub fn examples_around(&self, reach: usize, far: usize) -> Vec<(usize, f64)> {
        let around = self.lines.start.saturating_sub(reach)..(self.lines.end + reach).min(self.codes.len());
        self.alike(around, far, true).1
    }

    fn kind(&self, line: usize) -> usize {
        self.kinds[line - self.lines.start]
    }
}

impl Array {
    /// Of the photosites of a frame, `groups` of them with their amplifiers.
    fn of(frame: &FrameHeader, groups: &[(usize, Group)]) -> Predicted<Self> {
        let record = frame.metadata.demosaic.as_ref().ok_or(Unpredictable::Missing("demosaic"))?;
        let method = Method::named(&record.method)
            .ok_or(Unpredictable::Beyond("it was demosaicked by a method that is unknown here"))?;
        let readout = frame.readout().map_err(|_| Unpredictable::Missing("sensor.readout"))?;
        let taps = readout.taps.clone().ok_or(Unpredictable::Missing("sensor.readout.taps"))?;
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
        let none = [Prediction::of_cumulants(0.0, 0.0, 0.0, 0.0); 3];
        let mut sites = vec![none; taps.count()];
        for (tap, group) in groups {
            if let Some(sites) = sites.get_mut(*tap) {
                *sites = group.sites;
            }
        }
        Ok(Self {
            // No weight of the methods that are predicted hangs on hues.
            weights: WeightTable::of(method, record.cfa).about([1.0; 2]),
            taps,
            size: [readout.width, readout.height],
            sites,
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

    /// The moments of the photosite of a column and row of the plane.
    pub fn site(&self, at: [usize; 2]) -> &Prediction {
        let [x, y] = self.on_sensor(at);
        &self.sites[self.tap(at)][self.weights.pattern().class(x, y) as usize]
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
            let moments = self.sites[tap][class].moments;
            mean.iter_mut().zip(weights).for_each(|(mean, weight)| *mean += weight * (moments.mean - black));
            sites.push(Site { offset, class, tap, variance: moments.variance, weights });
        }
        (mean, sites)
    }
}

fn product(a: &[f64; 3], b: &[f64; 3]) -> Matrix3<f64> {
    Vector3::from(*a) * Vector3::from(*b).transpose()
}

impl Kind {
    fn of(array: &Array, at: [usize; 2], share: f64, black: f64, channels: &Channels) -> Predicted<Self> {
        let (mean, mut sites) = array.pixel(at, black);
        let through = |matrix: &Matrix3<f64>, values: [f64; 3]| -> [f64; 3] { (matrix * Vector3::from(values)).into() };
        sites.iter_mut().for_each(|site| site.weights = through(&channels.matrix, site.weights));
        let mut mean = through(&channels.matrix, mean.map(|mean| mean - channels.black));
        let first_order = |sites: &[Site]| -> Matrix3<f64> {
            sites.iter().map(|site| site.variance * product(&site.weights, &site.weights)).sum()
        };
        let mut covariance = first_order(&sites);
        let (mut bias, mut beyond, mut from_camera) = ([0.0; 3], Matrix3::zeros(), channels.matrix);
        let mut curved_in = None;
        if let Some(space) = channels.space {
            if !space.is_quiet(mean, &covariance) {
                return Err(Unpredictable::Beyond(curved::VOID));
            }
            let local = space.about(mean)?;
            curved_in = Some((mean, local.jacobian));
            let law = PixelLaw::of(sites.iter().map(|site| (site.weights, &array.sites[site.tap][site.class])));
            let found = curved::moments(mean, &[law], |xyz| space.value(xyz));
            (mean, covariance) = found.ok_or(Unpredictable::Beyond(curved::FAR_FROM_NORMAL))?;
            bias = [0, 1, 2].map(|i| mean[i] - local.value[i]);
            from_camera = local.jacobian * channels.matrix;
            sites.iter_mut().for_each(|site| site.weights = through(&local.jacobian, site.weights));
            beyond = covariance - first_order(&sites);
        }
        let mut table = vec![[0.0; 3]; SIDE * SIDE];
        for site in &sites {
            table[index(site.offset)] = site.weights;
        }
        Ok(Self { share, mean, bias, covariance, beyond, sites, table, from_camera, curved_in })
    }

    /// What is the same in every exposure of what is curved beyond the weights, `fixed` the law of the means that photosites of an
    /// amplifier and class have over exposures.
    fn curved_pattern(&self, fixed: impl Fn(usize, usize) -> Prediction, space: Curved) -> Matrix3<f64> {
        let found = self.curved_in.and_then(|(mean, jacobian)| Some((mean, jacobian, jacobian.try_inverse()?)));
        let Some((mean, jacobian, back)) = found else { return Matrix3::zeros() };
        let before = |site: &Site| -> [f64; 3] { (back * Vector3::from(site.weights)).into() };
        let of_sites: Vec<_> =
            self.sites.iter().map(|site| (before(site), site.variance, fixed(site.tap, site.class))).collect();
        let law = PixelLaw::of(of_sites.iter().map(|(weights, _, prediction)| (*weights, prediction)));
        let whole: Matrix3<f64> =
            of_sites.iter().map(|(weights, variance, _)| *variance * product(weights, weights)).sum();
        let first_order = jacobian * law.covariance * jacobian.transpose();
        curved::fixed(mean, &[(law, whole - law.covariance)], |channels| space.value(channels)) - first_order
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
    /// The pixels of a frame in such channels, after so much was subtracted from its photosites, of which each amplifier has a group.
    pub(super) fn of(
        frame: &FrameHeader,
        channels: &Channels,
        black: f64,
        groups: &[(usize, Group)],
    ) -> Predicted<Self> {
        let array = Array::of(frame, groups)?;
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

    /// The kind of the pixel in a column and row of the plane.
    pub(super) fn kind(&self, [x, y]: [usize; 2]) -> &Kind {
        let [columns, rows] = &self.array.axes;
        &self.kinds[rows.kind(y) * columns.examples.len() + columns.kind(x)]
    }

    /// Means and standard deviations of pixels of each kind.
    pub fn each_kind(&self) -> impl Iterator<Item = [(f64, f64); 3]> + '_ {
        let of = |kind: &Kind, i: usize| (kind.mean[i], kind.covariance[(i, i)].max(0.0).sqrt());
        self.kinds.iter().map(move |kind| [0, 1, 2].map(|i| of(kind, i)))
    }

    /// Covariance of what is between the means of kinds of places.
    pub fn between(&self) -> Matrix3<f64> {
        let of_kind = |kind: &Kind| {
            let off = [0, 1, 2].map(|i| kind.mean[i] - self.mean[i]);
            kind.share * product(&off, &off)
        };
        self.kinds.iter().map(of_kind).sum()
    }

    /// What is the same in every exposure of what is curved beyond the weights, within kinds of places; `fixed` is the law of the means
    /// that photosites of an amplifier and class have over exposures.
    pub fn curved_pattern(&self, fixed: impl Fn(usize, usize) -> Prediction) -> Matrix3<f64> {
        let Some(space) = self.space else { return Matrix3::zeros() };
        self.kinds.iter().map(|kind| kind.share * kind.curved_pattern(&fixed, space)).sum()
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
    /// within kinds of places.
    pub fn patch_mean(&self, phase: Option<usize>, size: [usize; 2]) -> Matrix3<f64> {
        let [mut sums, mut counts] = [[0.0; PHASES.len()]; 2];
        let [columns, rows] = &self.array.axes;
        for (y, of_y) in &rows.examples {
            for (x, of_x) in &columns.examples {
                let [column, row] = self.array.on_sensor([*x, *y]);
                let place = stencil::phase(column, row);
                sums[place] += of_x * of_y * self.array.site([*x, *y]).moments.variance;
                counts[place] += of_x * of_y;
            }
        }
        let variances =
            std::array::from_fn(|place| if counts[place] > 0.0 { sums[place] / counts[place] } else { 0.0 });
        let of = |phase| gains::patch_mean_by_place(&self.array.weights, phase, size, variances);
        let covariance = match phase {
            Some(phase) => of(phase),
            None => (0..PHASES.len()).map(of).sum::<Matrix3<f64>>() / PHASES.len() as f64,
        };
        self.from_camera * covariance * self.from_camera.transpose()
    }

    /// The covariance over all pixels, to first order and within kinds of places, for photosites of such variances, by amplifier
    /// and class.
    pub fn within(&self, variance: impl Fn(usize, usize) -> f64) -> Matrix3<f64> {
        let of_site = |site: &Site| variance(site.tap, site.class) * product(&site.weights, &site.weights);
        let of_kind = |kind: &Kind| kind.share * kind.sites.iter().map(of_site).sum::<Matrix3<f64>>();
        self.kinds.iter().map(of_kind).sum()
    }
}
