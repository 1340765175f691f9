//! What a figure of a region shows beside its moments: histograms, profiles, autocorrelations and some of its pixels, each beside
//! what is predicted of it.

use super::histogram::Histogram;
use super::region::Region;
use crate::cfa::{Class, FilterArray};
use crate::metadata::FrameHeader;
use crate::numerics::normal::MeanVariance;
use crate::propagation::moments::common;
use crate::propagation::taps::pooled;
use crate::propagation::{FramePrediction, PixelMoments, Prediction, gains};
use crate::stream::{Passing, RowSource};
use crate::units::QuantityKind;
use nalgebra::Matrix3;
use std::collections::VecDeque;

/// Lags of the autocorrelation, in pixels, or in periods of a filter array.
pub const LAGS: usize = 8;
/// Profiles have at most so many points; each is the mean of as many rows or columns as it takes.
const MOST_POINTS: usize = 250;
/// So many pixels, evenly spread, are kept as they are.
const KEPT_PIXELS: usize = 500;
/// Of more channels the first are shown.
const MOST_CHANNELS: usize = 3;

/// What a region looks like.
#[derive(Debug, Clone)]
pub struct Portrait {
    /// Where it lies.
    pub region: Region,
    /// What the samples are.
    pub quantity: QuantityKind,
    /// Their unit.
    pub unit: String,
    /// What the frame holds, in words.
    pub holds: String,
    /// Each class of a CFA plane, or each of the first channels.
    pub groups: Vec<Likeness>,
    /// Pixels of the first three channels, evenly spread.
    pub pixels: Vec<[f64; 3]>,
    /// Whether all samples are codes, whole numbers that were rounded.
    pub is_whole: bool,
    /// Whether all samples are whole numbers, whatever they are.
    pub has_whole: bool,
    frame: FrameHeader,
    /// Columns and rows after which classes repeat themselves.
    period: [usize; 2],
    /// The group of each site of a period, row by row, of a CFA plane.
    classes: Option<Vec<Option<usize>>>,
    above: VecDeque<Vec<Line>>,
}

/// What a channel or a class looks like.
#[derive(Debug, Clone)]
pub struct Likeness {
    /// Its name.
    pub name: String,
    /// Samples by value.
    pub histogram: Histogram,
    /// Means of columns, and of rows, from the region's corner on.
    pub profiles: [Profile; 2],
    /// Correlations along x, and along y.
    pub correlations: [Vec<Correlation>; 2],
    /// What is predicted; none where nothing is.
    pub predicted: Option<Foreseen>,
    /// What deviations are counted from.
    center: Option<f64>,
    deviations: Pairs,
    products: [Vec<Pairs>; 2],
}

/// What is predicted of a channel or a class.
#[derive(Debug, Clone, PartialEq)]
pub struct Foreseen {
    /// Mean.
    pub mean: f64,
    /// Standard deviations of the normal laws that samples are of, in equal shares: one, or one for each phase of the array.
    pub stds: Vec<f64>,
    /// Whether few samples that stand out, as those of hot photosites, make so much of the spread that no normal law shows the others.
    pub has_few_far: bool,
    /// Whether full well clips so many electrons that no normal law shows them.
    pub is_clipped: bool,
    /// Standard deviation of a point of each profile; none where neighbors hang together in ways that are not followed.
    pub profile_std: Option<[f64; 2]>,
    /// Correlations along x, and along y, at each lag; none as before.
    pub correlations: Option<[Vec<f64>; 2]>,
}

/// Means along one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Rows or columns that make one point.
    pub step: usize,
    sums: Vec<(f64, u64)>,
}

/// A correlation of samples so far apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correlation {
    /// Pixels from one to the other.
    pub lag: usize,
    /// The correlation; none where there are no pairs, or the samples are all the same.
    pub value: Option<f64>,
    /// Its standard error where samples are independent: 1/√n of n pairs.
    pub error: f64,
}

/// Whether the inverse of a channel is shown: color temperatures, whose noise is even in it alone, and which are far apart where
/// colors differ by little.
fn is_inverse(frame: &FrameHeader, channel: &str) -> bool {
    frame.metadata.quantity == QuantityKind::Cct && channel == "CCT"
}

/// The full well of the sensor of a frame; infinite where it is not known.
fn full_well_e(frame: &FrameHeader) -> f64 {
    let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
    readout.map_or(f64::INFINITY, |readout| readout.full_well_e)
}

/// The units of the channels as they are shown.
fn unit(frame: &FrameHeader) -> String {
    let unit = &frame.metadata.unit;
    match unit.strip_prefix("K,").filter(|_| frame.metadata.quantity == QuantityKind::Cct) {
        Some(others) => format!("MK-1,{others}"),
        None => unit.clone(),
    }
}

/// Sums over pairs of halves of deviations.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Pairs {
    count: u64,
    first: f64,
    second: f64,
    product: f64,
}

/// Samples of one group in one row, as halves of deviations, NaN where they do not count.
#[derive(Debug, Clone)]
struct Line {
    group: usize,
    deviations: Vec<f32>,
}

impl Portrait {
    /// Of a region that nothing was seen of yet, and what is predicted of it.
    pub(super) fn new(frame: &FrameHeader, region: Region, prediction: Option<&FramePrediction>) -> Self {
        let array =
            frame.metadata.cfa.filter(|array| frame.geometry.channels.len() == 1 && !array.filters().is_empty());
        let period = array.map_or([1, 1], FilterArray::period);
        let [x0, y0] = [0, 1].map(|axis| i64::from(frame.geometry.origin[axis]) + [region.x, region.y][axis] as i64);
        let site = |array: FilterArray, place: usize| {
            let class = array.class(x0 + (place % period[0]) as i64, y0 + (place / period[0]) as i64);
            class.map(|class| class as usize)
        };
        let classes = array.map(|array| (0..period[0] * period[1]).map(|place| site(array, place)).collect::<Vec<_>>());
        let names: Vec<String> = match &classes {
            Some(_) => Class::ALL.map(|class| class.letter().to_owned()).to_vec(),
            None => {
                let shown = frame.geometry.channels.len().min(MOST_CHANNELS);
                let names = (0..shown).map(|index| frame.channel_name(index).to_owned());
                names.map(|name| if is_inverse(frame, &name) { format!("1/{name}") } else { name }).collect()
            }
        };
        let steps = [0, 1].map(|axis| {
            let length = [region.width, region.height][axis];
            length.div_ceil(MOST_POINTS).next_multiple_of(period[axis])
        });
        let share = |index: usize| match &classes {
            Some(sites) => sites.iter().filter(|site| **site == Some(index)).count() as f64 / sites.len() as f64,
            None => 1.0,
        };
        let size = [region.width, region.height];
        let foreseen = |index: usize| {
            let prediction = prediction.filter(|_| names.len() == 3 && frame.metadata.quantity != QuantityKind::Cct)?;
            let foreseen = Foreseen::of(prediction, index, share(index), steps, size, frame);
            let is_clipped = frame.metadata.quantity == QuantityKind::Electrons && foreseen.reaches(full_well_e(frame));
            Some(Foreseen { is_clipped, ..foreseen })
        };
        let is_codes = frame.metadata.quantity == QuantityKind::Adu;
        let groups = names.iter().enumerate();
        let groups = groups.map(|(index, name)| Likeness::new(name, size, steps, is_codes, foreseen(index))).collect();
        Self {
            region,
            quantity: frame.metadata.quantity,
            unit: unit(frame),
            holds: frame.holds(),
            groups,
            pixels: Vec::new(),
            is_whole: is_codes,
            has_whole: true,
            frame: frame.clone(),
            period,
            classes,
            above: VecDeque::new(),
        }
    }

    /// The name of the frame.
    pub fn name(&self) -> &str {
        &self.frame.name
    }

    /// Forgets what was predicted, which does not hold for what is left where pixels are left out by their values.
    pub(super) fn forget_predictions(&mut self) {
        self.groups.iter_mut().for_each(|group| group.predicted = None);
    }

    /// Takes in row `y` of the frame, of all channels.
    fn add_row(&mut self, y: usize, row: &[f32]) {
        let Region { x, y: top, width, height } = self.region;
        if !(top..top + height).contains(&y) {
            return;
        }
        let (y, frame_width) = (y - top, self.frame.geometry.width);
        let channels = if self.classes.is_some() { 1 } else { self.groups.len() };
        let line = |channel: usize| &row[channel * frame_width + x..][..width];
        let is_inverse: Vec<bool> =
            (0..channels).map(|channel| is_inverse(&self.frame, self.frame.channel_name(channel))).collect();
        let mut lines = Vec::new();
        for (channel, is_inverse) in is_inverse.into_iter().enumerate() {
            for offset in 0..self.period[0] {
                let of_site = |sites: &Vec<Option<usize>>| sites[y % self.period[1] * self.period[0] + offset];
                let Some(group) = self.classes.as_ref().map_or(Some(channel), of_site) else { continue };
                let mut samples: Vec<f32> =
                    line(channel).iter().skip(offset).step_by(self.period[0]).copied().collect();
                if is_inverse {
                    samples.iter_mut().for_each(|kelvin| *kelvin = 1e6 / *kelvin);
                }
                self.has_whole &= samples.iter().all(|sample| !sample.is_finite() || sample.fract() == 0.0);
                self.is_whole &= self.has_whole;
                let deviations = self.groups[group].take(&samples, y, offset, self.period[0]);
                lines.push(Line { group, deviations });
            }
        }
        for line in &lines {
            self.groups[line.group].pair(0, &line.deviations, None);
        }
        for lag in 1..=LAGS {
            let Some(above) = (lag * self.period[1]).checked_sub(1).and_then(|back| self.above.get(back)) else {
                continue;
            };
            for (line, above) in lines.iter().zip(above) {
                self.groups[line.group].pair(lag, &above.deviations, Some(&line.deviations));
            }
        }
        self.above.push_front(lines);
        self.above.truncate(LAGS * self.period[1]);
        self.keep_pixels(y, line);
    }

    /// Keeps some pixels of the row.
    fn keep_pixels<'a>(&mut self, y: usize, line: impl Fn(usize) -> &'a [f32]) {
        if self.groups.len() < 3 || self.classes.is_some() {
            return;
        }
        let Region { width, height, .. } = self.region;
        // Odd, so that all phases of a filter array come.
        let stride = (width * height).div_ceil(KEPT_PIXELS) | 1;
        let first = (y * width).next_multiple_of(stride) - y * width;
        let lines = [line(0), line(1), line(2)];
        for x in (first..width).step_by(stride) {
            self.pixels.push(lines.map(|line| f64::from(line[x])));
        }
    }

    /// Works out what needs all rows.
    fn finish(&mut self) {
        for group in &mut self.groups {
            let variance = group.deviations.covariance();
            for axis in 0..2 {
                let period = self.period[axis];
                let of = |(index, pairs): (usize, &Pairs)| Correlation {
                    lag: (index + 1) * period,
                    value: (pairs.count > 0 && variance > 0.0).then(|| pairs.covariance() / variance),
                    error: 1.0 / (pairs.count as f64).sqrt(),
                };
                group.correlations[axis] = group.products[axis].iter().enumerate().map(of).collect();
            }
        }
    }
}

impl Foreseen {
    /// Of a channel or a class of which photosites have this share, whose profiles are of points of so many rows and columns.
    fn of(
        prediction: &FramePrediction,
        index: usize,
        share: f64,
        steps: [usize; 2],
        size: [usize; 2],
        frame: &FrameHeader,
    ) -> Self {
        let (is_moved, is_codes) = (frame.metadata.is_transferred(), frame.metadata.quantity == QuantityKind::Adu);
        // A point of the profile along x is of some columns, as high as the region; along y of some rows, as wide.
        let patches = [[steps[0].min(size[0]), size[1]], [size[0], steps[1].min(size[1])]];
        let foreseen = match prediction {
            FramePrediction::Planes(classes) => {
                let class = &classes[index];
                let variance = class.moments.variance;
                let [row, column] = [class.lines.row[index], class.lines.column[index]];
                // Of classes of which not every line has photosites, one in two has.
                let lines = |count: usize| if share < 0.5 { (count as f64 / 2.0).max(1.0) } else { count as f64 };
                let mean_std = |[columns, rows]: [usize; 2]| {
                    let own = (variance - row - column) / (share * (columns * rows) as f64);
                    (own + row / lines(rows) + column / lines(columns) + class.common + class.lines.level[index])
                        .max(0.0)
                        .sqrt()
                };
                let correlation = |shared: f64| vec![if shared > 0.0 { shared / variance } else { 0.0 }; LAGS];
                Self {
                    mean: class.moments.mean,
                    stds: vec![variance.max(0.0).sqrt()],
                    has_few_far: stands_out(class, is_codes),
                    is_clipped: false,
                    profile_std: Some(patches.map(mean_std)),
                    correlations: Some([correlation(row), correlation(column)]),
                }
            }
            FramePrediction::Groups(sites) => {
                let MeanVariance { mean, variance } = pooled(&sites.groups)[index].moments;
                Self::of_moments(mean, variance)
            }
            FramePrediction::Pixels(mixture) => Self::of_pixels(mixture, index, patches),
            FramePrediction::Tapped(pixels) => Self::of_moments(pixels.mean[index], pixels.covariance[(index, index)]),
        };
        // Of a level that drifts from row to row no profile is told.
        let drifts = matches!(prediction, FramePrediction::Planes(classes) if classes[index].lines.drift != [0.0; 3]);
        let is_moved = is_moved || drifts;
        if is_moved { Self { profile_std: None, correlations: None, ..foreseen } } else { foreseen }
    }

    /// Whether more than about 2 % of its samples would be above a ceiling.
    fn reaches(&self, ceiling: f64) -> bool {
        const DEVIATIONS: f64 = 2.0;
        self.stds.iter().any(|std| self.mean + DEVIATIONS * std > ceiling)
    }

    /// Of what no more is told than its moments.
    fn of_moments(mean: f64, variance: f64) -> Self {
        let stds = vec![variance.max(0.0).sqrt()];
        Self { mean, stds, has_few_far: false, is_clipped: false, profile_std: None, correlations: None }
    }

    fn of_pixels(mixture: &PixelMoments, index: usize, patches: [[usize; 2]; 2]) -> Self {
        let PixelMoments { weights, sites, .. } = mixture;
        let site_covariance = mixture.site_covariance();
        let of = |covariance: Matrix3<f64>| covariance[(index, index)];
        let whole = of(gains::mean_pixel_covariance(weights, &site_covariance));
        let beyond = (mixture.covariance[(index, index)] - whole).max(0.0);
        let common = of(mixture.from_camera * common(sites) * mixture.from_camera.transpose());
        let correlation = |lag: [isize; 2]| {
            let phases = [0, 1, 2, 3].map(|phase| of(gains::lagged_covariance(weights, phase, lag, &site_covariance)));
            phases.iter().sum::<f64>() / (4.0 * whole)
        };
        let lags = || (1..=LAGS).map(usize::cast_signed);
        Self {
            mean: mixture.mean[index],
            stds: [0, 1, 2, 3]
                .map(|phase| (of(gains::pixel_covariance(weights, phase, &site_covariance)) + beyond).max(0.0).sqrt())
                .to_vec(),
            has_few_far: sites.iter().any(|site| stands_out(site, false)),
            is_clipped: false,
            profile_std: Some(patches.map(|patch| {
                (of(gains::patch_covariance(weights, None, patch, &site_covariance)) + common).max(0.0).sqrt()
            })),
            correlations: Some([
                lags().map(|lag| correlation([lag, 0])).collect(),
                lags().map(|lag| correlation([0, lag])).collect(),
            ]),
        }
    }
}

/// Whether few photosites that stand out have a tenth of the variance or more: a normal law of all of it is too wide for the others.
///
/// Of those that are off by x, E x² ≥ (E x⁴)²/E x⁶ (Cauchy and Schwarz), where the fourth and the sixth cumulant are theirs: the least
/// that they have. Of amplitudes that fall off exponentially they have 2.5 times that, a quarter. E x⁶/E x⁴ is the square of how far off
/// they are; what is within three standard deviations does not stand out. Codes with a spread of less than half of one have such
/// cumulants of being rounded.
fn stands_out(site: &Prediction, is_codes: bool) -> bool {
    const LEAST: f64 = 0.1;
    const FAR: f64 = 3.0;
    const SMOOTH: f64 = 0.5;
    let (variance, fourth, sixth) = (site.moments.variance, site.fourth(), site.sixth);
    let is_rounded = is_codes && variance < SMOOTH * SMOOTH;
    fourth > 0.0 && sixth > FAR * FAR * variance * fourth && fourth * fourth >= LEAST * variance * sixth && !is_rounded
}

impl Likeness {
    fn new(name: &str, size: [usize; 2], steps: [usize; 2], is_codes: bool, predicted: Option<Foreseen>) -> Self {
        let profile =
            |axis: usize| Profile { step: steps[axis], sums: vec![(0.0, 0); size[axis].div_ceil(steps[axis])] };
        Self {
            name: name.to_owned(),
            histogram: Histogram::new(is_codes),
            profiles: [profile(0), profile(1)],
            correlations: [Vec::new(), Vec::new()],
            predicted,
            center: None,
            deviations: Pairs::default(),
            products: [vec![Pairs::default(); LAGS], vec![Pairs::default(); LAGS]],
        }
    }

    /// Mean of the samples seen.
    pub fn mean(&self) -> Option<f64> {
        let Pairs { count, first, .. } = self.deviations;
        self.center.filter(|_| count > 0).map(|center| center + 2.0 * first / count as f64)
    }

    /// Standard deviation of the samples seen.
    pub fn std(&self) -> Option<f64> {
        (self.deviations.count > 1).then(|| 2.0 * self.deviations.covariance().max(0.0).sqrt())
    }

    /// Takes in samples of row `y`, whose columns are `offset` and every `stride` from there on, and gives the halves of
    /// their deviations, which no sample makes too large for one.
    fn take(&mut self, samples: &[f32], y: usize, offset: usize, stride: usize) -> Vec<f32> {
        let finite = || samples.iter().copied().filter(|sample| sample.is_finite());
        self.center = self.center.or_else(|| finite().next().map(f64::from));
        let center = self.center.unwrap_or_default();
        self.histogram.add(finite().map(f64::from));
        let [columns, rows] = &mut self.profiles;
        for (place, sample) in samples.iter().enumerate().filter(|(_, sample)| sample.is_finite()) {
            columns.add(offset + place * stride, f64::from(*sample));
            rows.add(y, f64::from(*sample));
        }
        let deviations: Vec<f32> =
            samples.iter().map(|sample| crate::frame::to_sample(0.5 * (f64::from(*sample) - center))).collect();
        self.deviations.add(&deviations, &deviations);
        deviations
    }

    /// Takes in the pairs along x of a line (lag 0), or those of two lines that are `lag` apart along y.
    fn pair(&mut self, lag: usize, first: &[f32], second: Option<&[f32]>) {
        match second {
            Some(second) => self.products[1][lag - 1].add(first, second),
            None => {
                for (lag, pairs) in (1..).zip(&mut self.products[0]) {
                    pairs.add(first, first.get(lag..).unwrap_or_default());
                }
            }
        }
    }
}

impl Pairs {
    fn add(&mut self, first: &[f32], second: &[f32]) {
        for (a, b) in first.iter().zip(second) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            if a.is_finite() && b.is_finite() {
                self.count += 1;
                self.first += a;
                self.second += b;
                self.product += a * b;
            }
        }
    }

    fn covariance(&self) -> f64 {
        let n = self.count as f64;
        self.product / n - self.first / n * (self.second / n)
    }
}

impl Profile {
    fn add(&mut self, place: usize, sample: f64) {
        let (sum, count) = &mut self.sums[place / self.step];
        *sum += sample;
        *count += 1;
    }

    /// The middle of each point's rows or columns, and their mean; those without samples are left out.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        let seen = self.sums.iter().enumerate().filter(|(_, (_, count))| *count > 0);
        seen.map(|(place, (sum, count))| {
            [(place * self.step) as f64 + 0.5 * (self.step - 1) as f64, sum / *count as f64]
        })
    }
}

/// A source whose rows a portrait is made of as they pass.
pub(super) fn sitting<'a>(source: &'a mut dyn RowSource, portrait: &'a mut Portrait) -> impl RowSource {
    let geometry = &source.header().geometry;
    let (row_samples, height) = (geometry.row_samples(), geometry.height);
    let mut y = 0;
    Passing::new(source, move |samples| {
        for row in samples.chunks_exact(row_samples) {
            portrait.add_row(y, row);
            y += 1;
        }
        if y == height {
            portrait.finish();
        }
    })
}
