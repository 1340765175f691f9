//! What is predicted of the samples of a region.

use super::cells::{self, Seen};
use super::check::{Expected, pair, rounding};
use super::grids::{self, Array, Grid, PlaneScatter};
use super::groups::{self, Part};
use super::region::Region;
use crate::cfa::Class;
use crate::numerics::normal::MeanVariance;
use crate::propagation::moments::common;
use crate::propagation::sampling::Sampling;
use crate::propagation::taps::{Group, TappedSites, pooled};
use crate::propagation::{LineCovariance, PixelMoments, Prediction, SiteCovariance, TappedPixels};
use nalgebra::{Matrix3, Vector3};

/// What is predicted of channels that are observed together; nothing by default.
#[derive(Debug, Clone, Default)]
pub(super) struct Predicted {
    /// Of each of them; of the first three where layers follow.
    pub channels: Vec<Expectation>,
    /// Covariance over all pixels of a large frame.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Standard deviations of the means.
    pub mean_std: Option<Vec<f64>>,
    /// What can be tested.
    pub tested: Option<Expected>,
}

/// What is expected of one channel of a sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expectation {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the population.
    pub std: f64,
    /// Standard error of the sample mean.
    pub mean_error: f64,
    /// Root of the expected sample variance.
    pub sample_std: f64,
    /// Relative standard error of the sample standard deviation.
    pub std_error: f64,
}

impl Predicted {
    /// Of `count` pixels of three planes that are drawn apart, but for what rows and columns share in a region.
    pub fn of_planes(classes: &[Prediction; 3], count: u64, region: Region, origin: [i32; 2]) -> Self {
        let sites = SiteCovariance::of(classes);
        let sampling = if sites.is_independent() {
            Sampling::independent(classes, count as f64)
        } else {
            grids::sampling(classes, &[Grid::of_planes(region, origin)])
        };
        let expected = Expected {
            mean: classes.map(|class| class.moments.mean),
            site_variances: classes.map(|class| class.moments.variance),
            site_thirds: classes.map(|class| class.third),
            site_kurtosis: classes.map(|class| class.excess_kurtosis),
            site_sixths: classes.map(|class| class.sixth),
            sampling,
            is_plane: true,
        };
        let population = if sites.is_independent() {
            expected.sampling.covariance
        } else {
            sites.row + sites.column + sites.own_of_planes()
        };
        Self::of_three(&population, expected)
    }

    /// Of three planes that several amplifiers have read.
    pub fn of_groups(sites: &TappedSites) -> Self {
        let sampling = sampling_of(sites, Seen::Planes);
        let population = sampling.covariance * ((sampling.count - 1.0) / sampling.count) + sampling.mean_covariance;
        Self::of_three(&population, Self::grouped(&pooled(&sites.groups), &sites.groups, sampling))
    }

    /// Of a class of a plane that several amplifiers have read.
    pub fn of_class_in_groups(sites: &TappedSites, class: Class) -> Self {
        let parts = groups::of_class(&sites.groups, class as usize);
        let prediction = pooled(&sites.groups)[class as usize];
        if parts.is_empty() {
            return Self::of_one(&prediction, 0);
        }
        let sampling = sampling_of(sites, Seen::Class(class));
        let count = sampling.count;
        let one = Self::of_one_with(Expectation::of_sampling(&prediction, &sampling), &prediction, count > 0.0);
        let alone: Vec<Group> =
            parts.iter().map(|(count, sites)| Group { counts: [*count; 3], sites: *sites }).collect();
        Self { tested: Some(Self::grouped(&[prediction; 3], &alone, sampling)), ..one }
    }

    /// Of a plane behind a filter array that several amplifiers have read.
    pub fn of_plane_in_groups(sites: &TappedSites) -> Self {
        let parts = groups::of_plane(&sites.groups);
        let alone: Vec<Group> =
            parts.iter().map(|(count, sites)| Group { counts: [*count; 3], sites: *sites }).collect();
        let prediction = pooled(&alone)[0];
        let sampling = sampling_of(sites, Seen::All);
        Self::of_one_with(Expectation::of_sampling(&prediction, &sampling), &prediction, sampling.count > 0.0)
    }

    /// What can be tested of groups: what their photosites have by themselves.
    fn grouped(whole: &[Prediction; 3], groups: &[Group], sampling: Sampling) -> Expected {
        let mean = whole.map(|class| class.moments.mean);
        let within = |k: usize, of: fn(&Prediction) -> f64| -> f64 {
            let n: f64 = groups.iter().map(|group| group.counts[k]).sum();
            groups.iter().map(|group| group.counts[k] * of(&group.sites[k])).sum::<f64>() / n
        };
        let variances = [0, 1, 2].map(|k| within(k, |site| site.moments.variance));
        let kurtosis = |k: usize| {
            if variances[k] > 0.0 { within(k, Prediction::fourth) / variances[k].powi(2) } else { 0.0 }
        };
        Expected {
            mean,
            site_variances: variances,
            site_thirds: whole.map(|class| class.third),
            site_kurtosis: [0, 1, 2].map(kurtosis),
            site_sixths: whole.map(|class| class.sixth),
            sampling,
            is_plane: true,
        }
    }

    /// Of mixed pixels that several amplifiers have a part in.
    pub fn of_tapped(pixels: &TappedPixels) -> Self {
        let grouped = Self::grouped(&pooled(&pixels.groups), &pixels.groups, pixels.sampling().clone());
        Self::of_three(&pixels.covariance, Expected { mean: pixels.mean, is_plane: false, ..grouped })
    }

    /// Of mixed pixels that scatter as `sampling` says.
    pub fn of_pixels(mixture: &PixelMoments, sampling: Sampling) -> Self {
        let site_variances = mixture.sites.map(|site| site.moments.variance);
        let site_kurtosis = mixture.sites.map(|site| site.excess_kurtosis);
        let site_thirds = mixture.sites.map(|site| site.third);
        let site_sixths = mixture.sites.map(|site| site.sixth);
        let mean = mixture.mean;
        let expected =
            Expected { mean, site_variances, site_thirds, site_kurtosis, site_sixths, sampling, is_plane: false };
        Self::of_three(&mixture.covariance, expected)
    }

    /// The same where so many frames' worth of samples are averaged.
    #[must_use]
    pub fn repeated(mut self, frames: f64) -> Self {
        self.channels.iter_mut().for_each(|channel| channel.std_error /= frames.sqrt());
        if let Some(expected) = &mut self.tested {
            expected.sampling.spread.iter_mut().flatten().for_each(|spread| *spread /= frames);
        }
        self
    }

    fn of_three(covariance: &Matrix3<f64>, expected: Expected) -> Self {
        let sampling = &expected.sampling;
        let channel = |i: usize| {
            let (index, sample_variance) = (pair([i, i]), sampling.covariance[(i, i)]);
            Expectation {
                mean: expected.mean[i],
                std: covariance[(i, i)].max(0.0).sqrt(),
                mean_error: sampling.mean_covariance[(i, i)].sqrt(),
                sample_std: sample_variance.max(0.0).sqrt(),
                std_error: sampling.spread[index][index].sqrt() / (2.0 * sample_variance),
            }
        };
        Self {
            channels: (0..3).map(channel).collect(),
            covariance: Some((0..3).map(|i| (0..3).map(|j| covariance[(i, j)]).collect()).collect()),
            mean_std: Some((0..3).map(|i| sampling.mean_covariance[(i, i)].sqrt()).collect()),
            tested: Some(expected),
        }
    }

    /// Of `count` samples of one class of a CFA plane, independent but for what rows and columns share in the array.
    pub fn of_class(prediction: &Prediction, class: Class, count: u64, array: Option<&Array>) -> Self {
        let channels = grids::alike(prediction, class);
        let grids = array.filter(|_| !SiteCovariance::of(&channels).is_independent()).map(|array| array.grids(class));
        let sampling = match &grids {
            Some(grids) => grids::sampling(&channels, grids),
            None => Sampling::independent(&channels, count as f64),
        };
        let one = match &grids {
            Some(_) if count > 0 => {
                Self::of_one_that_is(Expectation::of_sampling(prediction, &sampling), prediction, count)
            }
            _ => Self::of_one(&channels[0], count),
        };
        let expected = Expected {
            mean: [prediction.moments.mean; 3],
            site_variances: [prediction.moments.variance; 3],
            site_thirds: [prediction.third; 3],
            site_kurtosis: [prediction.excess_kurtosis; 3],
            site_sixths: [prediction.sixth; 3],
            sampling,
            is_plane: true,
        };
        Self { tested: (count > 0).then_some(expected), ..one }
    }

    /// Of a CFA plane that has so many samples of each class, whose shares are not drawn; nothing of none.
    pub fn of_cfa_plane(classes: &[Prediction; 3], counts: [u64; 3], array: Option<&Array>) -> Self {
        let total = counts.iter().sum();
        let Some(prediction) = mixed(classes, counts) else { return Self::default() };
        match array.filter(|_| !SiteCovariance::of(classes).is_independent()) {
            Some(array) => {
                let expectation = Expectation::of_plane(&prediction, &array.of_plane(classes));
                Self::of_one_that_is(expectation, &prediction, total)
            }
            None => {
                let parts = classes.iter().zip(counts).filter(|(_, count)| *count > 0);
                let parts: Vec<Part> = parts.map(|(class, count)| (count as f64, [*class; 3])).collect();
                let expected = Expectation::of_sampling(&prediction, &groups::sampling(&parts));
                let mean_error = expected.mean_error.hypot(prediction.common.max(0.0).sqrt());
                Self::of_one_that_is(Expectation { mean_error, ..expected }, &prediction, total)
            }
        }
    }

    fn of_one(prediction: &Prediction, count: u64) -> Self {
        Self::of_one_that_is(Expectation::of(prediction, count), prediction, count)
    }

    fn of_one_that_is(expectation: Expectation, prediction: &Prediction, count: u64) -> Self {
        Self::of_one_with(expectation, prediction, count > 0)
    }

    fn of_one_with(expectation: Expectation, prediction: &Prediction, is_any: bool) -> Self {
        let std = prediction.moments.std();
        Self {
            channels: vec![expectation],
            covariance: Some(vec![vec![std * std]]),
            mean_std: is_any.then(|| vec![expectation.mean_error]),
            tested: None,
        }
    }
}

impl Expectation {
    /// Whether samples scatter, and by more than the rounding of single precision.
    pub fn is_resolved(&self) -> bool {
        self.std > rounding(self.mean)
    }

    /// Of samples that scatter as `sampling` says.
    fn of_sampling(prediction: &Prediction, sampling: &Sampling) -> Self {
        let variance = sampling.covariance[(0, 0)];
        Self {
            mean: prediction.moments.mean,
            std: prediction.moments.std(),
            mean_error: sampling.mean_covariance[(0, 0)].sqrt(),
            sample_std: variance.max(0.0).sqrt(),
            std_error: sampling.spread[0][0].sqrt() / (2.0 * variance),
        }
    }

    /// Of all photosites of a plane.
    fn of_plane(prediction: &Prediction, scatter: &PlaneScatter) -> Self {
        let MeanVariance { mean, variance } = scatter.sample;
        Self {
            mean: prediction.moments.mean,
            std: prediction.moments.std(),
            mean_error: scatter.mean_variance.sqrt(),
            sample_std: mean.max(0.0).sqrt(),
            std_error: variance.sqrt() / (2.0 * mean),
        }
    }

    /// Of `count` independent samples.
    fn of(prediction: &Prediction, count: u64) -> Self {
        let n = count as f64;
        let std = prediction.moments.std();
        // Var(s²) = σ⁴ (2/(n−1) + κ/n); the standard deviation has a quarter of its relative variance.
        let std_error = ((2.0 / (n - 1.0) + prediction.excess_kurtosis / n).max(0.0) / 4.0).sqrt();
        Self {
            mean: prediction.moments.mean,
            std,
            // Of a class alone all channels are alike.
            mean_error: (std * std / n + prediction.common + prediction.lines.level[0]).sqrt(),
            sample_std: std,
            std_error,
        }
    }
}

/// How samples scatter that several amplifiers have read.
fn sampling_of(sites: &TappedSites, seen: Seen) -> Sampling {
    let parts = || match seen {
        Seen::Planes => groups::of_planes(&sites.groups),
        Seen::Class(class) => groups::of_class(&sites.groups, class as usize),
        Seen::All => groups::of_plane(&sites.groups),
    };
    let found =
        sites.lines.as_ref().map_or_else(|| groups::sampling(&parts()), |lines| cells::sampling(sites, lines, seen));
    let of_classes = |weights: [f64; 3]| {
        let weights = Vector3::from(weights);
        Matrix3::from_element(weights.dot(&(sites.level * weights)))
    };
    let level = match seen {
        Seen::Planes => sites.level,
        Seen::Class(class) => of_classes([0, 1, 2].map(|k| if k == class as usize { 1.0 } else { 0.0 })),
        Seen::All => of_classes(sites.shares()),
    };
    Sampling { mean_covariance: found.mean_covariance + level, ..found }
}

/// The prediction for samples of three classes, so many of each, taken as those of one variable; none of none.
fn mixed(classes: &[Prediction; 3], counts: [u64; 3]) -> Option<Prediction> {
    let total: u64 = counts.iter().sum();
    if total == 0 {
        return None;
    }
    let shares = counts.map(|count| count as f64 / total as f64);
    let mean: f64 = shares.iter().zip(classes).map(|(w, p)| w * p.moments.mean).sum();
    let offsets = classes.each_ref().map(|p| p.moments.mean - mean);
    let variance: f64 = (0..3).map(|k| shares[k] * (classes[k].moments.variance + offsets[k].powi(2))).sum();
    let fourth: f64 = (0..3)
        .map(|k| {
            let (v, d) = (classes[k].moments.variance, offsets[k]);
            shares[k] * ((3.0 + classes[k].excess_kurtosis) * v * v + 6.0 * v * d * d + d.powi(4))
        })
        .sum();
    let excess_kurtosis = if variance > 0.0 { fourth / variance.powi(2) - 3.0 } else { 0.0 };
    let of_classes = Vector3::from(shares);
    let common = of_classes.dot(&(common(classes) * of_classes));
    Some(Prediction {
        moments: MeanVariance { mean, variance },
        third: 0.0,
        excess_kurtosis,
        sixth: 0.0,
        common,
        lines: LineCovariance::default(),
    })
}
