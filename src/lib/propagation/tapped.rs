//! Pixels that are made of photosites of several amplifiers, over a rectangle of a frame.
//!
//! A pixel hangs on its place by its phase in the filter array, by which amplifier reads each of its photosites, and by what is mirrored at
//! an edge of the plane. Places that have all these in common are one kind, of the mean Σ w μ and the covariance Σ w w′ σ² over its
//! photosites; over the rectangle there is so much of each kind, and what is between the means of kinds is variance like what is
//! within them.

use super::curved::{self, PixelLaw};
use super::gains;
use super::moments::SiteCovariance;
use super::pixel_moments::{PixelMoments, is_bent_by, is_covariance};
use super::sampling::Sampling;
use super::smooth_hue::{self, FirstOrder};
use super::spaces::{Channels, Curved};
use super::tap_lines::TapLines;
use super::tapped_array::Array;
pub use super::tapped_factors::TapMoments;
use super::tapped_factors::{Factors, Loads, Shared, Site, first_order, product};
use super::taps::{Group, pooled};
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::FrameHeader;
use crate::numerics::normal::{self, MeanVariance};
use crate::stages::demosaic::stencil::{self, PHASES, REACH};
use nalgebra::{Matrix3, Vector3};
use std::sync::OnceLock;

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
    /// How far green is from where smooth hue transition would divide by zero, behind the amplifier where that is nearest; none by other methods.
    pub of_hue: Option<FirstOrder>,
    /// Derivatives of the channels with respect to demosaicked R, G and B, on average.
    from_camera: Matrix3<f64>,
    space: Option<Curved>,
    pub(super) array: Array,
    /// By rows of kinds.
    pub(super) kinds: Vec<Kind>,
    pub(super) sampling: OnceLock<Sampling>,
    /// The covariance of what all pixels are off together.
    pub(super) level: Matrix3<f64>,
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
    pub loads: Option<[Loads; 3]>,
    /// Where the channels are curved, those that they are curved in: their mean, and the derivatives of the channels by them.
    curved_in: Option<([f64; 3], Matrix3<f64>)>,
}

const SIDE: usize = 2 * REACH.unsigned_abs() + 1;

impl Kind {
    fn of(array: &Array, at: [usize; 2], share: f64, black: f64, channels: &Channels) -> Predicted<Self> {
        let (mean, moved, mut sites, further) = match array.hue(at, black) {
            Some(hue) => (hue.mean, hue.bias, hue.sites, hue.beyond),
            None => {
                let (mean, sites) = array.pixel(at, black);
                (mean, [0.0; 3], sites, Matrix3::zeros())
            }
        };
        let through = |matrix: &Matrix3<f64>, values: [f64; 3]| -> [f64; 3] { (matrix * Vector3::from(values)).into() };
        sites.iter_mut().for_each(|site| site.weights = through(&channels.matrix, site.weights));
        let mut bias = through(&channels.matrix, moved);
        let noiseless = through(&channels.matrix, mean.map(|mean| mean - channels.black));
        let mut mean = [0, 1, 2].map(|i| noiseless[i] + bias[i]);
        let own = |site: &Site| site.variance;
        let shared = array.moments.shared.as_ref();
        let mut beyond = channels.matrix * further * channels.matrix.transpose();
        let mut covariance = first_order(&sites, own, shared) + beyond;
        if array.green.is_some() && !is_covariance(&covariance) {
            return Err(Unpredictable::Beyond(smooth_hue::VOID));
        }
        let mut from_camera = channels.matrix;
        let mut curved_in = None;
        if let Some(space) = channels.space {
            if !space.is_quiet(mean, &covariance) {
                return Err(Unpredictable::Beyond(curved::VOID));
            }
            if is_bent_by(mean, &covariance, &beyond) {
                return Err(Unpredictable::Beyond(curved::FAR_FROM_NORMAL));
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
            beyond = covariance - first_order(&sites, own, shared);
        }
        let loads = shared.map(|shared| shared.loads(&sites));
        let mut table = vec![[0.0; 3]; SIDE * SIDE];
        for site in &sites {
            table[index(site.offset)] = site.weights;
        }
        Ok(Self { share, mean, bias, covariance, beyond, sites, table, from_camera, loads, curved_in })
    }

    /// What is the same in every exposure of what is curved beyond the weights, `fixed` the law of the means that photosites have over
    /// exposures, and `whole` what they share in one.
    fn curved_pattern(&self, fixed: &TapMoments, whole: Option<&Shared>, space: Curved) -> Matrix3<f64> {
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
        // What smooth hue transition divides by is about the same behind all; pixels have weights of their own place.
        let all: Vec<Group> = groups.iter().map(|(_, group)| *group).collect();
        let array = Array::of(frame, groups, lines, pooled(&all).map(|class| class.moments.mean - black))?;
        let first_order = |group: &Group| {
            let mean = group.sites.map(|site| site.moments.mean - black);
            FirstOrder::of(mean, group.sites.map(|site| site.moments.variance))
        };
        let least = |a: &FirstOrder, b: &FirstOrder| a.green_over_noise.total_cmp(&b.green_over_noise);
        let of_hue = all.iter().map(first_order).min_by(least).filter(|_| array.green.is_some());
        if of_hue.is_some_and(|found| !found.holds) {
            return Err(Unpredictable::Beyond(smooth_hue::VOID));
        }
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
        let (space, sampling) = (channels.space, OnceLock::new());
        let level = Matrix3::zeros();
        Ok(Self { mean, bias, covariance, groups: all, of_hue, from_camera, space, array, kinds, sampling, level })
    }

    /// The same where all photosites of R, G and B are off together with such a covariance: each channel as the class that it is named for.
    #[must_use]
    pub(super) fn with_level(mut self, of_sites: &Matrix3<f64>) -> Self {
        self.level = self.from_camera * of_sites * self.from_camera.transpose();
        self
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
        let whole = self.array.moments.shared.as_ref();
        self.kinds.iter().map(|kind| kind.share * kind.curved_pattern(fixed, whole, space)).sum()
    }

    /// What is the same in every exposure to first order, within kinds of places.
    pub fn fixed(&self, fixed: &TapMoments) -> Matrix3<f64> {
        self.kinds.iter().map(|kind| kind.share * fixed.first_order(&kind.sites)).sum()
    }

    /// The covariance over all pixels to first order, within kinds of places.
    pub fn first_order(&self) -> Matrix3<f64> {
        let shared = self.array.moments.shared.as_ref();
        let of_kind = |kind: &Kind| kind.share * first_order(&kind.sites, |site| site.variance, shared);
        self.kinds.iter().map(of_kind).sum()
    }

    /// Whether photosites of a row or of a column share noise.
    pub fn has_lines(&self) -> bool {
        self.array.moments.shared.is_some()
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
        let shared = self.array.moments.shared.as_ref().map(|shared| {
            [0, 1].map(|axis| Matrix3::from_fn(|k, l| self.array.mean_of_line(&shared.lines[axis], axis, [k, l])))
        });
        let drifts = self.array.drifts();
        let of = |phase| {
            let own = gains::patch_mean_by_place(&self.array.weights, phase, size, variances);
            let shared = shared
                .as_ref()
                .map(|[rows, columns]| gains::patch_mean(&self.array.weights, phase, size).of_lines([rows, columns]));
            let drift = |(share, sites): &(f64, SiteCovariance)| {
                *share * gains::patch_covariance(&self.array.weights, Some(phase), size, sites)
            };
            own + shared.unwrap_or_default() + drifts.iter().map(drift).sum::<Matrix3<f64>>()
        };
        let covariance = match phase {
            Some(phase) => of(phase),
            None => (0..PHASES.len()).map(of).sum::<Matrix3<f64>>() / PHASES.len() as f64,
        };
        self.from_camera * covariance * self.from_camera.transpose()
    }

    /// The covariance over all pixels, to first order and within kinds of places, for photosites of such variances, by amplifier
    /// and class, of what is each photosite's own, or is the same along rows (0) or columns (1), or `drifts` along these.
    pub fn within(
        &self,
        shared_by: Option<usize>,
        drifts: bool,
        variance: impl Fn(usize, usize) -> f64,
    ) -> Matrix3<f64> {
        let Some(axis) = shared_by else {
            let own = |site: &Site| variance(site.tap, site.class);
            return self.kinds.iter().map(|kind| kind.share * first_order(&kind.sites, own, None)).sum();
        };
        let single = Factors::single(self.array.moments.own.len(), |tap, class| variance(tap, class).max(0.0).sqrt());
        let drift = self.array.moments.shared.as_ref().and_then(|shared| shared.drift.as_ref());
        let shared = Shared::single(axis, single, drift.filter(|_| drifts).map(|drift| drift.rows_per_knot));
        let of_kind = |kind: &Kind| kind.share * first_order(&kind.sites, |_| 0.0, Some(&shared));
        self.kinds.iter().map(of_kind).sum()
    }
}
