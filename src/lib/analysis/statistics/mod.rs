//! Statistics of frames and regions, beside what propagation predicts.

pub mod check;
pub mod patches;

use crate::cfa::Class;
use crate::error::{Error, Result};
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::numerics::moments::{self, Moments};
use crate::numerics::sums::Limits;
use crate::propagation::sampling::{Place, Sampling};
use crate::propagation::{self, Equations, FramePrediction, PixelMoments, Prediction, Unpredictable, gains};
use crate::stream::RowSource;
use crate::units::QuantityKind;
use check::{Expected, Measured, Test, Verdict};
use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::Serialize;

/// A rectangle of a frame, counted from the frame's own corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Region {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Region {
    /// The row after the last.
    fn end(&self) -> usize {
        self.y + self.height
    }

    /// A place of the same sampling law.
    fn place(&self, frame: &FrameHeader) -> Place {
        let geometry = &frame.geometry;
        let whole = Place {
            frame: [geometry.width, geometry.height],
            origin: geometry.origin,
            corner: [self.x, self.y],
            size: [self.width, self.height],
        };
        whole.canonical()
    }

    /// Checks that the region has pixels and lies within a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] otherwise.
    pub fn check(&self, frame: &FrameHeader) -> Result<()> {
        let Self { x, y, width, height } = *self;
        let geometry = &frame.geometry;
        let inside = x.checked_add(width).is_some_and(|end| end <= geometry.width)
            && y.checked_add(height).is_some_and(|end| end <= geometry.height);
        if inside && width > 0 && height > 0 {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "{}: region {x},{y},{width},{height} does not lie within the frame of {}x{}",
            frame.name, geometry.width, geometry.height
        )))
    }
}

/// Everything that is said of a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// One entry per region; the whole frame where none was named.
    pub regions: Vec<RegionReport>,
    /// Whether all predictions hold, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub check: Option<Verdict>,
    /// Why nothing is predicted of the frame as a whole, where that is so.
    #[serde(skip)]
    pub unpredicted: Option<Unpredictable>,
}

/// What is said of a region.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegionReport {
    /// The rectangle.
    pub region: Region,
    /// Column and row of the patch in its chart, where patches are measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patch: Option<[usize; 2]>,
    /// Number of the patch, row by row, from 0; where the width of the chart is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample: Option<usize>,
    /// Pixels whose samples are all finite.
    pub count: u64,
    /// Pixels left out because a sample is NaN or infinite.
    pub not_finite: u64,
    /// Quantity and unit of the samples.
    pub quantity: QuantityKind,
    /// Unit.
    pub unit: String,
    /// Statistics of each channel.
    pub channels: Vec<ChannelReport>,
    /// Statistics of the classes of a CFA plane.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<ChannelReport>,
    /// Sample covariance of the channels (divisor n − 1).
    pub covariance: Option<Vec<Vec<f64>>>,
    /// The same by formula.
    pub predicted_covariance: Option<Vec<Vec<f64>>>,
    /// Predicted standard deviation of the mean of the region in each channel.
    pub patch_mean_std: Option<Vec<f64>>,
    /// Tests of the predictions, where they were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<Test>,
}

/// Statistics of one channel, or of one class of a CFA plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelReport {
    /// Name.
    pub name: String,
    /// Finite samples.
    pub count: u64,
    /// Mean.
    pub mean: Option<f64>,
    /// Sample standard deviation (divisor n − 1).
    pub std: Option<f64>,
    /// Smallest sample.
    pub min: Option<f64>,
    /// Largest sample.
    pub max: Option<f64>,
    /// 20 log₁₀ of the mean above black over the standard deviation.
    pub snr_db: Option<f64>,
    /// Samples at the ends of the range: codes 0 and 2^bits − 1, or electrons at full well or above.
    pub clipped: Option<u64>,
    /// Mean by formula.
    pub predicted_mean: Option<f64>,
    /// Standard deviation by formula.
    pub predicted_std: Option<f64>,
    /// (mean − predicted) over its sampling error, which knows that demosaicked neighbours are correlated.
    pub z_mean: Option<f64>,
    /// (std / expected − 1) over its sampling error, that of independent samples √((2 + κ n⁄(n−1)) / 4n), κ the excess
    /// kurtosis.
    pub z_std: Option<f64>,
    /// Standard error of the mean: s/√n_eff. Where a prediction knows how demosaicked neighbours are correlated, n_eff is
    /// its effective number; elsewhere samples count as independent, in a CFA plane within each class.
    pub mean_error: Option<f64>,
    /// Standard error of the standard deviation: with a prediction s times its relative one, elsewhere s/√(2(n − 1)), that
    /// of independent normal samples; in a CFA plane from those of its classes.
    pub std_error: Option<f64>,
}

/// What one region has seen so far.
#[derive(Debug, Clone)]
struct Tally {
    channels: Moments,
    classes: [Moments; 3],
}

/// Which samples of a frame count as clipped: codes at or beyond either end, electrons at full well or above.
fn rails(frame: &FrameHeader) -> Limits {
    let metadata = &frame.metadata;
    // What transfer or its undoing has mixed lies at no rail any more; nor does a code less a dark frame's.
    let transferred = metadata.noise.as_ref().is_some_and(|noise| noise.cte.is_some());
    if metadata.correction.is_some() || (transferred && metadata.quantity == QuantityKind::Electrons) {
        return Limits::NONE;
    }
    let limits = match metadata.quantity {
        QuantityKind::Adu if metadata.demosaic.is_none() => {
            metadata.white_level_adu.map(|white| Limits { low: 0.0, high: to_sample(white) })
        }
        QuantityKind::Electrons if metadata.demosaic.is_none() => {
            let full_well_e = metadata.sensor.as_ref().map(|sensor| sensor.full_well_e);
            full_well_e.map(|e| Limits { high: to_sample(e), ..Limits::NONE })
        }
        _ => None,
    };
    limits.unwrap_or(Limits::NONE)
}

/// Reads a whole frame and works out the statistics of its regions.
///
/// Rows are summed one by one and merged in order, so the result is the same at any number of threads. With a `level`,
/// every prediction is tested.
///
/// # Errors
///
/// [`Error::Usage`] for a region outside the frame, [`Error::Data`] where a test is wanted and nothing can be predicted,
/// and those of the source.
pub fn measure(
    source: &mut dyn RowSource,
    regions: &[Region],
    equations: Equations,
    level: Option<f64>,
) -> Result<Report> {
    let frame = source.header().clone();
    let geometry = &frame.geometry;
    let whole = [Region { x: 0, y: 0, width: geometry.width, height: geometry.height }];
    let regions = if regions.is_empty() { &whole } else { regions };
    for region in regions {
        region.check(&frame)?;
    }
    let rails = rails(&frame);
    // Laws hang on the head of the frame alone: they are worked out while the programs before this one make its rows.
    let prediction = propagation::of_frame(&frame, equations);
    let mut samplings = Samplings::default();
    if let Ok(FramePrediction::Pixels(mixture)) = &prediction {
        for region in regions {
            samplings.of(mixture, &frame, *region);
        }
    }
    let tallies = tallies(source, &frame, regions, rails)?;
    if level.is_some() && frame.metadata.noise.as_ref().is_some_and(|noise| noise.cte.is_some()) {
        return Err(Error::Data(format!(
            "{}: nothing can be checked: charge transfer mixes neighbours, differently from place to place",
            frame.name
        )));
    }
    let regions = regions
        .iter()
        .zip(&tallies)
        .map(|(region, tally)| {
            let sampling = |mixture: &PixelMoments| samplings.of(mixture, &frame, *region);
            tally.report(&frame, *region, rails, prediction.as_ref().ok(), sampling, level.is_some())
        })
        .collect();
    let mut report = Report { regions, check: None, unpredicted: prediction.err() };
    if let Some(level) = level {
        let regions = report.regions.iter().map(|region| (&region.tests[..], region.not_finite));
        report.check = Some(Verdict::of(regions, level, &frame.name, report.unpredicted)?);
    }
    Ok(report)
}

/// Reads a whole frame and sums up its regions, each of which lies within it.
///
/// Each row of a region is summed by itself and merged in order, whatever the threads: the rows of one region side by side
/// where regions are few, or regions side by side.
fn tallies(source: &mut dyn RowSource, frame: &FrameHeader, regions: &[Region], rails: Limits) -> Result<Vec<Tally>> {
    let geometry = &frame.geometry;
    let empty = || Tally::new(geometry.channels.len());
    let mut tallies: Vec<Tally> = regions.iter().map(|_| empty()).collect();
    let mut of_rows: Vec<Tally> = Vec::new();
    let band_rows = geometry.band_rows(geometry.step_rows(source.natural_rows()), 1);
    let mut samples = Vec::new();
    let mut first = 0;
    while first < geometry.height {
        let rows = band_rows.min(geometry.height - first);
        samples.clear();
        source.read(rows, &mut samples)?;
        let row = |y: usize| &samples[(y - first) * geometry.row_samples()..][..geometry.row_samples()];
        let seen = |region: &Region| region.y.max(first)..region.end().min(first + rows);
        if regions.len() < rayon::current_num_threads() {
            for (region, tally) in regions.iter().zip(&mut tallies) {
                let seen = seen(region);
                if seen.len() > of_rows.len() {
                    of_rows.resize_with(seen.len(), empty);
                }
                let rows = of_rows[..seen.len()].par_iter_mut().zip(seen.clone());
                rows.with_min_len((SHARE / region.width).max(1)).for_each(|(of_row, y)| {
                    of_row.clear();
                    of_row.add_row(frame, y, row(y), *region, rails);
                });
                for of_row in &of_rows[..seen.len()] {
                    tally.merge(of_row);
                }
            }
        } else {
            let met = regions.par_iter().zip(&mut tallies).filter(|(region, _)| !seen(region).is_empty());
            met.for_each_init(empty, |of_row, (region, tally)| {
                for y in seen(region) {
                    of_row.clear();
                    of_row.add_row(frame, y, row(y), *region, rails);
                    tally.merge(of_row);
                }
            });
        }
        first += rows;
    }
    Ok(tallies)
}

/// Pixels of a region that are worth a task of their own.
const SHARE: usize = 1 << 14;

/// Sampling laws by place: regions of one size and phase share one.
#[derive(Default)]
struct Samplings(Vec<(Place, Sampling)>);

impl Samplings {
    /// The law of a region of a frame of mixed pixels.
    fn of(&mut self, mixture: &PixelMoments, frame: &FrameHeader, region: Region) -> Sampling {
        let place = region.place(frame);
        if let Some((_, known)) = self.0.iter().find(|(of, _)| *of == place) {
            return known.clone();
        }
        let mut made = Sampling::of(&mixture.weights, &mixture.sites, &place);
        made.covariance += beyond_weights(mixture);
        self.0.push((place, made.clone()));
        made
    }
}

/// What is predicted of the covariance beyond the weights: the second order of smooth hue transition, or the paper's
/// equations.
fn beyond_weights(mixture: &PixelMoments) -> Matrix3<f64> {
    let variances = mixture.sites.map(|site| site.moments.variance);
    mixture.covariance - gains::mean_pixel(&mixture.weights).covariance(variances)
}

impl Tally {
    fn new(channels: usize) -> Self {
        Self { channels: Moments::new(channels), classes: [const { 1 }; 3].map(Moments::new) }
    }

    fn clear(&mut self) {
        self.channels.clear();
        self.classes.iter_mut().for_each(Moments::clear);
    }

    /// Takes in a row of a region; the moments of a CFA plane are merged from those of its two classes.
    fn add_row(&mut self, frame: &FrameHeader, y: usize, row: &[f32], region: Region, rails: Limits) {
        let width = frame.geometry.width;
        let line = |channel: usize| &row[channel * width + region.x..][..region.width];
        let Some(pattern) = frame.metadata.cfa.filter(|_| self.channels.channels() == 1) else {
            return self.channels.add_within(region.width, line, rails);
        };
        let classes = pattern.row_classes(frame.geometry.origin, y);
        let classes = [0, 1].map(|parity| classes[(region.x + parity) % 2] as usize);
        if let Ok(moments) = self.classes.get_disjoint_mut(classes) {
            moments::add_alternating(moments, line(0), rails);
        }
        for class in classes {
            self.channels.merge(&self.classes[class]);
        }
    }

    fn merge(&mut self, row: &Self) {
        self.channels.merge(&row.channels);
        for (mine, theirs) in self.classes.iter_mut().zip(&row.classes) {
            mine.merge(theirs);
        }
    }

    fn report(
        &self,
        frame: &FrameHeader,
        region: Region,
        rails: Limits,
        prediction: Option<&FramePrediction>,
        sampling: impl FnOnce(&PixelMoments) -> Sampling,
        with_tests: bool,
    ) -> RegionReport {
        let metadata = &frame.metadata;
        let black = match metadata.quantity {
            QuantityKind::Adu => metadata.black_level_adu.unwrap_or(0.0),
            QuantityKind::Electrons => metadata.dark_signal_e.unwrap_or(0.0),
            _ => 0.0,
        };
        let channels = self.channels.channels();
        let count = self.channels.count;
        let has_rails = !rails.high.is_nan();
        // Layers of standard deviations may follow the three planes of a demosaicked frame.
        let three = channels == 3 || (channels > 3 && metadata.demosaic.is_some());
        let whole = (three && count > 0).then_some(prediction).flatten().map(|prediction| match prediction {
            FramePrediction::Planes(classes) => {
                let mean = classes.map(|class| class.moments.mean);
                let sampling = Sampling::independent(classes, count as f64);
                let covariance = sampling.covariance;
                Whole { mean, covariance, sites: classes.map(|c| c.moments.variance), sampling, is_plane: true }
            }
            FramePrediction::Pixels(mixture) => Whole {
                mean: mixture.mean,
                covariance: mixture.covariance,
                sites: mixture.sites.map(|site| site.moments.variance),
                sampling: sampling(mixture),
                is_plane: false,
            },
        });
        let planes = match prediction {
            Some(FramePrediction::Planes(classes)) if channels == 1 => Some(classes),
            _ => None,
        };
        let channel_report = |index: usize| {
            let name = frame.channel_name(index).to_owned();
            let expectation = match (&whole, planes) {
                (Some(whole), _) if index < 3 => Some(whole.expectation(index)),
                (None, Some(classes)) if metadata.cfa.is_some() => {
                    self.mixture(classes).map(|prediction| Expectation::of(&prediction, count))
                }
                _ => None,
            };
            let clipped = has_rails.then_some(self.channels.beyond[index]);
            let mut report = ChannelReport::new(name, &self.channels, index, black, clipped, expectation);
            if metadata.cfa.is_some() && channels == 1 {
                (report.mean_error, report.std_error) = self.plane_errors();
            }
            report
        };
        let reports: Vec<ChannelReport> = (0..channels).map(channel_report).collect();
        let classes = match metadata.cfa {
            Some(_) if channels == 1 => Class::ALL
                .into_iter()
                .map(|class| {
                    let index = class as usize;
                    let moments = &self.classes[index];
                    let clipped = has_rails.then_some(moments.beyond[0]);
                    let expectation = planes.map(|classes| Expectation::of(&classes[index], moments.count));
                    ChannelReport::new(class.letter().into(), moments, 0, black, clipped, expectation)
                })
                .collect(),
            _ => Vec::new(),
        };
        let covariance_row = |i| (0..channels).map(|j| self.channels.covariance(i, j)).collect::<Option<Vec<f64>>>();
        let covariance: Option<Vec<Vec<f64>>> = (0..channels).map(covariance_row).collect();
        let predicted_covariance = match &whole {
            Some(whole) => Some((0..3).map(|i| (0..3).map(|j| whole.covariance[(i, j)]).collect()).collect()),
            None => {
                reports.first().and_then(|y| y.predicted_std).filter(|_| channels == 1).map(|std| vec![vec![std * std]])
            }
        };
        let patch_mean_std = match &whole {
            Some(whole) => Some((0..3).map(|i| whole.sampling.mean_covariance[(i, i)].sqrt()).collect()),
            None => reports
                .first()
                .and_then(|y| y.predicted_std)
                .filter(|_| channels == 1 && count > 0)
                .map(|std| vec![std / (count as f64).sqrt()]),
        };
        let tests = match (&whole, planes) {
            _ if !with_tests => Vec::new(),
            (Some(whole), _) => {
                let names: Vec<String> = reports.iter().take(3).map(|channel| channel.name.clone()).collect();
                let mean = [0, 1, 2].map(|i| self.channels.mean[i]);
                let covariance = covariance.as_ref().map_or_else(Matrix3::zeros, |c| Matrix3::from_fn(|i, j| c[i][j]));
                whole.tests(&Measured { names: &names, mean, covariance })
            }
            (None, Some(classes)) if metadata.cfa.is_some() => self.class_tests(classes),
            _ => Vec::new(),
        };
        RegionReport {
            region,
            patch: None,
            sample: None,
            count,
            not_finite: self.channels.not_finite,
            quantity: metadata.quantity,
            unit: metadata.unit.clone(),
            channels: reports,
            classes,
            covariance,
            predicted_covariance,
            patch_mean_std,
            tests,
        }
    }

    /// Tests of the classes of a CFA plane, each by itself.
    fn class_tests(&self, classes: &[Prediction; 3]) -> Vec<Test> {
        let seen = Class::ALL.into_iter().filter(|class| self.classes[*class as usize].count > 0);
        seen.flat_map(|class| {
            let (moments, prediction) = (&self.classes[class as usize], classes[class as usize]);
            let sampling = Sampling::independent(&[prediction; 3], moments.count as f64);
            let whole = Whole {
                mean: [prediction.moments.mean; 3],
                covariance: sampling.covariance,
                sites: [prediction.moments.variance; 3],
                sampling,
                is_plane: true,
            };
            let names = [class.letter().to_owned()];
            let covariance = Matrix3::from_element(moments.covariance(0, 0).unwrap_or(0.0));
            whole.tests(&Measured { names: &names, mean: [moments.mean[0]; 3], covariance })
        })
        .collect()
    }

    /// Standard errors of mean and standard deviation of a CFA plane, whose classes have shares w that are not drawn.
    ///
    /// x̄ = Σ w x̄ₖ,  s² ≈ Σ w (sₖ² + (x̄ₖ − x̄)²),  so that to first order
    /// var x̄ = Σ w² sₖ²/nₖ,  var s² = Σ w² (2 sₖ⁴/(nₖ − 1) + 4 (x̄ₖ − x̄)² sₖ²/nₖ)
    fn plane_errors(&self) -> (Option<f64>, Option<f64>) {
        let total = self.channels.count as f64;
        let (mut of_mean, mut of_variance) = (0.0, 0.0);
        for class in self.classes.iter().filter(|class| class.count > 0) {
            let Some(variance) = class.covariance(0, 0) else { return (None, None) };
            let (n, offset) = (class.count as f64, class.mean[0] - self.channels.mean[0]);
            let share = (n / total).powi(2);
            of_mean += share * variance / n;
            of_variance += share * (2.0 * variance * variance / (n - 1.0) + 4.0 * offset * offset * variance / n);
        }
        let std = self.channels.std(0);
        let of_std = std.map(|std| if std > 0.0 { of_variance.sqrt() / (2.0 * std) } else { 0.0 });
        (std.map(|_| of_mean.sqrt()), of_std)
    }

    /// The prediction for a plane in which the classes are mixed as the region has them.
    fn mixture(&self, predictions: &[Prediction; 3]) -> Option<Prediction> {
        let total: u64 = self.classes.iter().map(|class| class.count).sum();
        if total == 0 {
            return None;
        }
        let shares = self.classes.each_ref().map(|class| class.count as f64 / total as f64);
        let mean: f64 = shares.iter().zip(predictions).map(|(w, p)| w * p.moments.mean).sum();
        let offsets = predictions.each_ref().map(|p| p.moments.mean - mean);
        let variance: f64 = (0..3).map(|k| shares[k] * (predictions[k].moments.variance + offsets[k].powi(2))).sum();
        let fourth: f64 = (0..3)
            .map(|k| {
                let (v, d) = (predictions[k].moments.variance, offsets[k]);
                shares[k] * ((3.0 + predictions[k].excess_kurtosis) * v * v + 6.0 * v * d * d + d.powi(4))
            })
            .sum();
        let excess_kurtosis = if variance > 0.0 { fourth / variance.powi(2) - 3.0 } else { 0.0 };
        let moments = crate::numerics::normal::MeanVariance { mean, variance };
        Some(Prediction { moments, excess_kurtosis })
    }
}

/// What is expected of three channels together.
struct Whole {
    mean: [f64; 3],
    /// Over all pixels of a large frame.
    covariance: Matrix3<f64>,
    /// Variances of the photosites.
    sites: [f64; 3],
    sampling: Sampling,
    is_plane: bool,
}

impl Whole {
    fn expectation(&self, i: usize) -> Expectation {
        let index = check::pair([i, i]);
        let expected = self.sampling.covariance[(i, i)];
        Expectation {
            mean: self.mean[i],
            std: self.covariance[(i, i)].max(0.0).sqrt(),
            mean_error: self.sampling.mean_covariance[(i, i)].sqrt(),
            sample_std: expected.max(0.0).sqrt(),
            std_error: self.sampling.spread[index][index].sqrt() / (2.0 * expected),
        }
    }

    fn tests(&self, measured: &Measured<'_>) -> Vec<Test> {
        let expected =
            Expected { mean: self.mean, site_variances: self.sites, sampling: &self.sampling, is_plane: self.is_plane };
        check::tests(measured, &expected)
    }
}

/// What is expected of one channel of a sample.
#[derive(Debug, Clone, Copy)]
struct Expectation {
    mean: f64,
    /// Of the population.
    std: f64,
    /// Standard error of the sample mean.
    mean_error: f64,
    /// Root of the expected sample variance.
    sample_std: f64,
    /// Relative standard error of the sample standard deviation.
    std_error: f64,
}

impl Expectation {
    /// Of `count` independent samples.
    fn of(prediction: &Prediction, count: u64) -> Self {
        let n = count as f64;
        let std = prediction.moments.std();
        // Var(s²) = σ⁴ (2/(n−1) + κ/n); the standard deviation has a quarter of its relative variance.
        let std_error = ((2.0 / (n - 1.0) + prediction.excess_kurtosis / n).max(0.0) / 4.0).sqrt();
        Self { mean: prediction.moments.mean, std, mean_error: std / n.sqrt(), sample_std: std, std_error }
    }
}

impl ChannelReport {
    fn new(
        name: String,
        moments: &Moments,
        index: usize,
        black: f64,
        clipped: Option<u64>,
        expectation: Option<Expectation>,
    ) -> Self {
        let count = moments.count;
        let seen = |value: f64| (count > 0).then_some(value);
        let mean = seen(moments.mean[index]);
        let std = moments.std(index);
        let ratio_db = |mean: f64, std: f64| {
            let ratio = (mean - black) / std;
            (ratio > 0.0 && ratio.is_finite()).then(|| 20.0 * ratio.log10())
        };
        let spread = expectation.filter(|expected| expected.std > 0.0);
        let n = count as f64;
        // Errors of independent normal samples, relative to their standard deviation.
        let independent = (1.0 / n.sqrt(), (2.0 * (n - 1.0)).sqrt().recip());
        let known = |expected: Expectation| (expected.mean_error / expected.sample_std, expected.std_error);
        let is_known = |errors: &(f64, f64)| errors.0.is_finite() && errors.1.is_finite();
        let (mean_error, std_error) = expectation.map(known).filter(is_known).unwrap_or(independent);
        Self {
            name,
            count,
            mean,
            std,
            min: seen(moments.min[index]),
            max: seen(moments.max[index]),
            snr_db: mean.zip(std).and_then(|(mean, std)| ratio_db(mean, std)),
            clipped,
            predicted_mean: expectation.map(|expected| expected.mean),
            predicted_std: expectation.map(|expected| expected.std),
            z_mean: mean.zip(spread).map(|(mean, expected)| (mean - expected.mean) / expected.mean_error),
            z_std: std.zip(spread).map(|(std, expected)| (std / expected.sample_std - 1.0) / expected.std_error),
            mean_error: std.map(|std| std * mean_error),
            std_error: std.map(|std| std * std_error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cfa::CfaPattern;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::stream::MemoryFrame;

    fn frame(channels: &[&str], width: usize, height: usize, f: impl Fn(usize) -> f32) -> MemoryFrame {
        let geometry = Geometry::new(width, height, channels);
        let samples = (0..geometry.row_samples() * height).map(f).collect();
        let header = FrameHeader { name: "test".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
        MemoryFrame::new(header, samples)
    }

    #[test]
    fn regions_see_their_own_samples() {
        let mut ramp = frame(&["Y"], 10, 8, |i| i as f32);
        let region = Region { x: 2, y: 3, width: 3, height: 2 };
        let report = measure(&mut ramp, &[region], Equations::Exact, None).unwrap();
        let channel = &report.regions[0].channels[0];
        assert_eq!((channel.min, channel.max, channel.mean), (Some(32.0), Some(44.0), Some(38.0)));
        let outside = Region { x: 8, ..region };
        let again = measure(&mut frame(&["Y"], 10, 8, |i| i as f32), &[outside], Equations::Exact, None);
        assert!(again.unwrap_err().to_string().contains("does not lie within"));
    }

    #[test]
    fn classes_of_a_plane_are_told_apart_wherever_the_region_starts() {
        let mut plane = frame(&["Y"], 8, 6, |i| [10.0, 20.0, 20.0, 30.0][(i / 8 % 2) * 2 + i % 2]);
        plane.header.metadata.cfa = Some(CfaPattern::Rggb);
        let region = Region { x: 1, y: 1, width: 5, height: 4 };
        let report = measure(&mut plane, &[region], Equations::Exact, None).unwrap();
        let means: Vec<_> = report.regions[0].classes.iter().map(|class| class.mean).collect();
        assert_eq!(means, [Some(10.0), Some(20.0), Some(30.0)]);
    }

    /// Of independent normal samples 1/√n and 1/√(2(n − 1)) of the standard deviation; of a plane, those of its classes.
    #[test]
    fn errors_are_those_of_independent_samples() {
        let noise = |i: usize| ((i * 7919 + i * i * 31) % 1009) as f32 / 1009.0;
        let report = measure(&mut frame(&["Y"], 40, 30, noise), &[], Equations::Exact, None).unwrap();
        let channel = &report.regions[0].channels[0];
        let std = channel.std.unwrap();
        assert!((channel.mean_error.unwrap() / std * 1200_f64.sqrt() - 1.0).abs() < 1e-12);
        assert!((channel.std_error.unwrap() / std * 2398_f64.sqrt() - 1.0).abs() < 1e-12);
        // Classes 100 apart: the error of the mean is that of their own scatter, not of their distance.
        let mut plane = frame(&["Y"], 40, 30, |i| noise(i) + 100.0 * [1.0, 2.0, 2.0, 3.0][(i / 40 % 2) * 2 + i % 2]);
        plane.header.metadata.cfa = Some(CfaPattern::Rggb);
        let report = measure(&mut plane, &[], Equations::Exact, None).unwrap();
        let (whole, classes) = (&report.regions[0].channels[0], &report.regions[0].classes);
        let of_classes = |k: usize| classes[k].mean_error.unwrap() * [0.25, 0.5, 0.25][k];
        let expected = (0..3).map(|k| of_classes(k).powi(2)).sum::<f64>().sqrt();
        assert!((whole.mean_error.unwrap() / expected - 1.0).abs() < 1e-9);
        assert!(whole.std.unwrap() > 70.0 && whole.std_error.unwrap() < 0.01);
    }

    #[test]
    fn one_sample_has_a_mean_and_no_spread() {
        let report = measure(&mut frame(&["Y"], 1, 1, |_| 7.0), &[], Equations::Exact, None).unwrap();
        let channel = &report.regions[0].channels[0];
        assert_eq!((channel.mean, channel.std, channel.snr_db), (Some(7.0), None, None));
        assert_eq!(report.regions[0].covariance, None);
    }
}
