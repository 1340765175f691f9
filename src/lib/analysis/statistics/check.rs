//! Is what was measured what was predicted? Tests of means, variances and correlations.

use crate::numerics::significance;
use crate::propagation::covariance::PAIRS;
use crate::propagation::sampling::Sampling;
use nalgebra::Matrix3;
use serde::Serialize;

/// What a test is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Subject {
    /// The mean of a channel: z.
    Mean,
    /// The variance of a channel: χ².
    Variance,
    /// The correlation of two channels: Fisher's z.
    Correlation,
    /// The variance of the means of rows: χ².
    VarianceOfRowMeans,
    /// The variance of the means of columns: χ².
    VarianceOfColumnMeans,
    /// Mean and variance together of a channel of which hardly a sample should leave its code, or whose variance hangs on
    /// few samples: Markov's inequality.
    Deviation,
    /// The variance of a channel over pixels of their means over frames: χ².
    VarianceOfMeans,
    /// The correlation of two channels in these means: Fisher's z.
    CorrelationOfMeans,
    /// The variance of a channel from frame to frame: χ².
    TemporalVariance,
    /// The correlation of two channels from frame to frame: Fisher's z.
    TemporalCorrelation,
    /// The variance over frames of the mean of a channel: χ².
    VarianceOfFrameMeans,
}

impl Subject {
    /// The same of means over frames.
    pub(super) fn of_means(self) -> Self {
        match self {
            Self::Variance => Self::VarianceOfMeans,
            Self::Correlation => Self::CorrelationOfMeans,
            other => other,
        }
    }
}

/// One test of one prediction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Test {
    /// What is tested.
    pub subject: Subject,
    /// The channel, or the two.
    pub channels: Vec<String>,
    /// What was measured.
    pub measured: f64,
    /// What is expected of a sample of this size.
    pub expected: f64,
    /// Deviation over its standard error, where it follows a law.
    pub z: Option<f64>,
    /// The same where no law is known but a bound, as of Chebyshev: it is no measure of chance.
    #[serde(skip)]
    pub bounded: Option<f64>,
    /// Effective degrees of freedom of a variance or a correlation.
    pub degrees_of_freedom: Option<f64>,
    /// Probability of a deviation at least as large by chance.
    pub p: f64,
}

impl Test {
    /// Whether its law is known to numbers. Where it is not nothing was tested: no number is no alarm.
    pub(super) fn is_sound(&self) -> bool {
        let numbers = [Some(self.measured), Some(self.expected), self.deviate(), self.degrees_of_freedom, Some(self.p)];
        numbers.into_iter().flatten().all(f64::is_finite)
    }

    /// Deviation over its standard error, whatever is known of its law.
    pub fn deviate(&self) -> Option<f64> {
        self.z.or(self.bounded)
    }

    /// The same with a deviate that follows a law, or none.
    pub(super) fn with(self, deviate: f64, has_law: bool) -> Self {
        let of = |wanted: bool| (has_law == wanted).then_some(deviate);
        Self { z: of(true), bounded: of(false), ..self }
    }
}

/// What was measured of channels that were observed together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured<'a> {
    pub names: &'a [String],
    pub mean: [f64; 3],
    pub covariance: Matrix3<f64>,
}

/// What is expected of it.
#[derive(Debug, Clone)]
pub(super) struct Expected {
    /// Mean.
    pub mean: [f64; 3],
    /// Variance of a photosite in steps² of what it is counted in, e⁻ or ADU: where it is so small that nearly all
    /// samples are the same, sums of them are not normal.
    pub site_variances: [f64; 3],
    /// Third cumulant of a photosite.
    pub site_thirds: [f64; 3],
    /// Excess kurtosis of a photosite: where it is large, few of the samples make up the variance.
    pub site_kurtosis: [f64; 3],
    /// Sixth cumulant of a photosite, where photosites are unlike each other; else 0.
    pub site_sixths: [f64; 3],
    /// How samples scatter.
    pub sampling: Sampling,
    /// Whether the channels are the classes of the photosites themselves.
    pub is_plane: bool,
}

impl Expected {
    /// Skewness of the mean of a channel: that of independent samples, κ₃⁄(σ³ √n); of pixels the largest that classes give, of
    /// which a channel has a quarter at least.
    fn mean_skewness(&self, channel: usize) -> f64 {
        let of_class = |k: usize, count: f64| self.site_thirds[k] / self.site_variances[k].powf(1.5) / count.sqrt();
        let count = self.sampling.count;
        if self.is_plane {
            if self.sampling.variance_thirds.is_some() {
                // What is shared is normal, and makes the mean no skewer.
                return self.site_thirds[channel]
                    / (count * count)
                    / self.sampling.mean_covariance[(channel, channel)].powf(1.5);
            }
            return of_class(channel, count);
        }
        let skews = (0..3).map(|k| of_class(k, count / 4.0)).filter(|skewness| skewness.is_finite());
        skews.fold(0.0, |most, skewness| if skewness.abs() > f64::abs(most) { skewness } else { most })
    }

    /// Third cumulant of a sample variance of independent samples, but for their sixth cumulant:
    /// (12 κ₄ κ₂ + 4 κ₃² + 8 κ₂³)⁄n² \[Fisher1930]; of photosites that are unlike each other with κ₆.
    fn variance_third(&self, channel: usize) -> f64 {
        let (second, third) = (self.site_variances[channel], self.site_thirds[channel]);
        let fourth = self.site_kurtosis[channel] * second * second;
        let of_sites = 12.0 * fourth * second + 4.0 * third * third + self.site_sixths[channel];
        let square = self.sampling.count.powi(2);
        match self.sampling.variance_thirds {
            Some(thirds) if self.is_plane => of_sites.max(0.0) / square + thirds[channel],
            Some(thirds) => thirds[channel],
            None => (of_sites + 8.0 * second.powi(3)) / square,
        }
    }

    /// The least variance of a photosite.
    pub(super) fn least_variance(&self) -> f64 {
        self.site_variances.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Whether photosites are unlike each other.
    fn has_tails(&self) -> bool {
        self.site_sixths.iter().any(|sixth| *sixth != 0.0)
    }

    /// Whether the sixth cumulant of photosites of a class makes up their fourth: it is that of what makes them unlike each other alone,
    /// and where full well or single counts make the tails it is less than any law has, m₂ m₆ ≥ m₄² about the mean.
    fn knows_tails(&self, class: usize) -> bool {
        let (third, square) = (self.site_thirds[class], self.site_variances[class].powi(2));
        let (second, fourth) = (self.site_variances[class], self.site_kurtosis[class] * square);
        let sixth_moment =
            self.site_sixths[class] + 15.0 * fourth * second + 10.0 * third * third + 15.0 * second * square;
        self.has_tails() && sixth_moment * second >= (fourth + 3.0 * square).powi(2)
    }

    /// Whether so few photosites make up the variance of a channel that it is not like χ², in a way that nothing is known of.
    fn is_heavy(&self, channel: usize) -> bool {
        self.is_heavy_in(channel, 1.0)
    }

    /// The same of as many samples in so many frames.
    pub(super) fn is_heavy_in(&self, channel: usize, frames: f64) -> bool {
        let classes = if self.is_plane { channel..channel + 1 } else { 0..3 };
        let of_class = |class: usize| {
            let kurtosis = self.site_kurtosis[class];
            kurtosis > 1.0 && self.sampling.count * frames < HEAVY * kurtosis && !self.knows_tails(class)
        };
        classes.into_iter().any(of_class)
    }

    /// Excess kurtosis of the sum of products of two channels whose photosites are independent, at most: ((κ + 3)(κ′ + 3) − 9)⁄n
    /// with κ, κ′ those of photosites. None that matters where they hardly have any.
    pub(super) fn product_kurtosis(&self, channels: [usize; 2]) -> f64 {
        let most = |channel: usize| {
            let (classes, count) = self.classes_of(channel);
            (classes.map(|class| self.site_kurtosis[class]).fold(0.0, f64::max), count)
        };
        let [(one, count), (other, _)] = channels.map(most);
        if one.max(other) > 1.0 { ((one + 3.0) * (other + 3.0) - 9.0) / count } else { 0.0 }
    }

    /// The classes that a channel is made of, and the least number of photosites of each.
    fn classes_of(&self, channel: usize) -> (std::ops::Range<usize>, f64) {
        if self.is_plane { (channel..channel + 1, self.sampling.count) } else { (0..3, self.sampling.count / 4.0) }
    }

    /// Excess kurtosis of the mean of a channel of photosites that are unlike each other, at most.
    pub(super) fn mean_kurtosis(&self, channel: usize) -> f64 {
        let (classes, count) = self.classes_of(channel);
        classes.map(|k| self.site_kurtosis[k] / count).fold(0.0, f64::max)
    }

    /// The same of its variance, about: of N exponential numbers among many normal ones, N p⁻¹ of which there are and
    /// κ₄ = 24 p h⁴, κ₆ = 720 p h⁶, it is 70 f²/N, with f the share of the scatter that they make.
    fn variance_kurtosis(&self, channel: usize) -> f64 {
        let (classes, count) = self.classes_of(channel);
        let of_class = |k: usize| {
            let fourth = self.site_kurtosis[k] * self.site_variances[k].powi(2);
            let many = count * 37.5 * fourth.powi(3) / self.site_sixths[k].powi(2);
            let share = self.site_kurtosis[k] / (self.site_kurtosis[k] + 2.0);
            if fourth > 0.0 && self.site_sixths[k] > 0.0 { 70.0 * share * share / many } else { 0.0 }
        };
        classes.map(of_class).fold(0.0, f64::max)
    }

    /// Skewness of a sample variance of pixels, at most: that of as many photosites of one class as there are.
    fn pixel_variance_skewness(&self) -> f64 {
        let (classes, count) = self.classes_of(0);
        let of_class = |k: usize| {
            let (second, third) = (self.site_variances[k], self.site_thirds[k]);
            let fourth = self.site_kurtosis[k] * second * second;
            let cumulant = 12.0 * fourth * second + 4.0 * third * third + 8.0 * second.powi(3) + self.site_sixths[k];
            cumulant / (fourth + 2.0 * second * second).powf(1.5) / count.sqrt()
        };
        classes.map(of_class).filter(|skewness| skewness.is_finite()).fold(0.0, f64::max)
    }

    /// What rounding may take a sample of a channel off by: pixels that are made of several samples are rounded as the largest of
    /// them is, by up to 30 · 2⁻²⁴ of it and more where a matrix follows.
    pub(super) fn rounding(&self, channel: usize) -> f64 {
        if self.is_plane {
            return rounding(self.mean[channel]);
        }
        8.0 * self.mean.iter().copied().map(rounding).fold(0.0, f64::max)
    }
}

/// Fewer samples off their usual step than this make sums that are no normal deviates.
pub(super) const RARE: f64 = 25.0;

/// Fewer effective degrees of freedom than this, and a variance follows no χ² well enough: the inequality of Chebyshev holds
/// of any law.
pub(super) const FEW: f64 = 12.0;

/// Excess kurtosis below which a law has hardly more than two values, and a sample variance is a function of the mean.
pub(super) const FLAT: f64 = -1.0;

/// Channels that are correlated more closely than this are functions of each other: nothing is left to chance.
const TIED: f64 = 1.0 - 1e-9;

/// Samples to a unit of excess kurtosis below which the variance hangs on too few of them to be like χ²: at 1000 its skewness is
/// that of χ² to a few hundredths.
const HEAVY: f64 = 1000.0;

/// Excess kurtosis beyond which a statistic of photosites that are unlike each other follows no law that its third cumulant tells:
/// at 4 standard deviations 0.05 makes tails half as large again.
pub(super) const FREE: f64 = 0.05;

/// Tests the channels `0..count` and their correlations.
pub(super) fn tests(measured: &Measured<'_>, expected: &Expected) -> Vec<Test> {
    let sampling = &expected.sampling;
    let channels = measured.names.len();
    let least = expected.least_variance();
    let is_rare = |i: usize| {
        let variance = if expected.is_plane { expected.site_variances[i] } else { least };
        let is_enough = sampling.count * variance >= RARE;
        // Where samples scatter by less than their rounding, neither mean nor variance follows a law that is known.
        let is_rounded = sampling.covariance[(i, i)].max(0.0).sqrt() <= expected.rounding(i);
        !is_enough || is_rounded || expected.is_heavy(i)
    };
    let mut found = Vec::new();
    for i in 0..channels {
        if is_rare(i) {
            found.push(deviation(measured, expected, i));
        } else {
            found.push(mean(measured, expected, i));
            if sampling.count > 1.0 {
                found.push(variance(measured, expected, i));
            }
        }
    }
    for (index, [i, j]) in PAIRS.into_iter().enumerate() {
        // Four pixels are the fewest whose correlation says anything.
        let is_free = |i: usize| expected.has_tails() && expected.variance_kurtosis(i) > FREE;
        if i != j && j < channels && ![i, j].into_iter().any(|i| is_rare(i) || is_free(i)) && sampling.count >= 4.0 {
            let kurtosis = expected.product_kurtosis([i, j]);
            let test = correlation(measured, sampling, index);
            found.extend(test.map(|test| if kurtosis > FREE { of_few_products(test, kurtosis) } else { test }));
        }
    }
    found
}

/// What rounding to single precision may take a sample of this mean off by, with some room.
pub(super) fn rounding(mean: f64) -> f64 {
    4.0 * f64::from(f32::EPSILON) * mean.abs()
}

/// Where a pair of channels stands in [`PAIRS`].
pub(super) fn pair(channels: [usize; 2]) -> usize {
    PAIRS.iter().position(|known| *known == channels).unwrap_or_default()
}

fn mean(measured: &Measured<'_>, expected: &Expected, i: usize) -> Test {
    let error = expected.sampling.mean_covariance[(i, i)].sqrt();
    let z = (measured.mean[i] - expected.mean[i]) / error;
    let skewness = expected.mean_skewness(i);
    let has_law = !expected.has_tails() || expected.mean_kurtosis(i) <= FREE;
    let test = Test {
        subject: Subject::Mean,
        channels: vec![measured.names[i].clone()],
        measured: measured.mean[i],
        expected: expected.mean[i],
        z: None,
        bounded: None,
        degrees_of_freedom: None,
        p: if !has_law {
            of_any_law(z)
        } else if expected.is_plane {
            significance::of_skewed(z, skewness)
        } else {
            significance::of_skewed(z, skewness).max(significance::of_skewed(z, -skewness))
        },
    };
    test.with(z, has_law)
}

/// The bound of Chebyshev, 1/z².
pub(super) fn of_any_law(z: f64) -> f64 {
    (1.0 / (z * z)).min(1.0)
}

/// s²/E s² is like χ²_ν/ν with ν = 2 (E s²)²/var s², exact in mean and variance \[Satterthwaite1946]. Where ν is small, or
/// samples have two values, the probability is Chebyshev's bound, var s²/(s² − E s²)². Of independent samples with tails
/// heavier than normal ones the law has the third cumulant that theirs give.
pub(super) fn variance(measured: &Measured<'_>, law: &Expected, i: usize) -> Test {
    let expected = law.sampling.covariance[(i, i)];
    let pair = pair([i, i]);
    let scatter = law.sampling.spread[pair][pair];
    let freedom = 2.0 * expected * expected / scatter;
    let found = measured.covariance[(i, i)];
    let z = (found - expected) / scatter.sqrt();
    let has_law = freedom >= FEW
        && (!law.is_plane || law.site_kurtosis[i] >= FLAT)
        && (!law.has_tails() || law.variance_kurtosis(i) <= FREE);
    let test = Test {
        subject: Subject::Variance,
        channels: vec![measured.names[i].clone()],
        measured: found,
        expected,
        z: None,
        bounded: None,
        degrees_of_freedom: Some(freedom),
        p: if !has_law {
            of_any_law(z)
        } else if law.has_tails() && !law.is_plane {
            let skewness = law
                .pixel_variance_skewness()
                .max(law.sampling.variance_thirds.map_or(0.0, |thirds| thirds[i] / scatter.powf(1.5)));
            significance::of_sum_of_squares(found, [expected, scatter, skewness * scatter.powf(1.5)])
                .max(significance::of_chi_square(freedom * found / expected, freedom))
        } else if law.sampling.variance_thirds.is_some() || (law.is_plane && law.site_kurtosis[i] > 0.0) {
            significance::of_sum_of_squares(found, [expected, scatter, law.variance_third(i)])
        } else {
            significance::of_chi_square(freedom * found / expected, freedom)
        },
    };
    test.with(z, has_law)
}

/// artanh r about artanh ρ + ρ/2ν, with variance 1/(ν − 2), as of ν + 1 independent normal pairs \[Fisher1921].
///
/// The effective ν makes 1/ν the variance to first order: r = s_ij/√(s_ii s_jj) varies as its differential does,
/// dr = ds_ij/√(s_ii s_jj) − ½ r (ds_ii/s_ii + ds_jj/s_jj), and artanh r by dr/(1 − ρ²). None of channels that are functions
/// of each other, nor where ν is too small for the law of the transformed correlation to be normal.
pub(super) fn correlation(measured: &Measured<'_>, sampling: &Sampling, index: usize) -> Option<Test> {
    let [i, j] = PAIRS[index];
    let correlation = |c: &Matrix3<f64>| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt();
    let (found, expected) = (correlation(&measured.covariance), correlation(&sampling.covariance));
    if !found.is_finite() || expected.abs() > TIED {
        return None;
    }
    let c = &sampling.covariance;
    let terms = [
        (index, 1.0 / (c[(i, i)] * c[(j, j)]).sqrt()),
        (pair([i, i]), -0.5 * expected / c[(i, i)]),
        (pair([j, j]), -0.5 * expected / c[(j, j)]),
    ];
    let variance: f64 =
        terms.iter().flat_map(|(a, f)| terms.iter().map(move |(b, g)| f * g * sampling.spread[*a][*b])).sum();
    let freedom = (1.0 - expected * expected).powi(2) / variance;
    if freedom < FEW {
        return None;
    }
    let center = expected.atanh() + expected / (2.0 * freedom);
    let off = found.clamp(-1.0, 1.0).atanh() - center;
    let z = off * (freedom - 2.0).sqrt();
    let few = if sampling.variance_thirds.is_some() { of_few_lines(expected, off, freedom) } else { 0.0 };
    Some(Test {
        subject: Subject::Correlation,
        channels: vec![measured.names[i].clone(), measured.names[j].clone()],
        measured: found,
        expected,
        z: Some(z),
        bounded: None,
        degrees_of_freedom: Some(freedom),
        p: significance::of_normal(z).max(few),
    })
}

/// The probability of a correlation that is lower by such a difference of artanh r where it is that of what few rows or columns share, S
/// beside what is a photosite's own, D: artanh r = ½ ln(1 + 2S/D), and S is like χ² of k degrees of freedom, which its logarithm is far from
/// normal below. 2 (ρ/(1 + ρ))²/k is the variance of artanh r. None of one that is higher, whose tail is shorter than normal.
fn of_few_lines(expected: f64, off: f64, freedom: f64) -> f64 {
    if expected <= 0.0 || off >= 0.0 {
        return 0.0;
    }
    let lines = 2.0 * (freedom - 2.0) * (expected / (1.0 + expected)).powi(2);
    let ratio = |artanh: f64| (2.0 * artanh).exp_m1();
    let share = ratio(expected.atanh() + off) / ratio(expected.atanh());
    significance::of_chi_square(lines * share, lines)
}

/// The same where few products of samples make up the covariance, as where two that are far off meet by chance: Markov's inequality
/// of the second and the fourth power, P(|z| ≥ t) ≤ min(1/t², (3 + κ)/t⁴), of z = √ν (r − ρ)/(1 − ρ²), whose variance is 1.
pub(super) fn of_few_products(test: Test, kurtosis: f64) -> Test {
    let (found, expected) = (test.measured, test.expected);
    let freedom = test.degrees_of_freedom.unwrap_or_default();
    let z = freedom.sqrt() * (found - expected) / (1.0 - expected * expected);
    let bound = of_any_law(z).min((3.0 + kurtosis) / z.powi(4));
    Test { p: test.p.max(bound), ..test }.with(z, false)
}

/// Where hardly a sample should deviate: P(mean square deviation ≥ d²) ≤ E d²/d² by Markov's inequality. What single
/// precision rounds off is no deviation.
fn deviation(measured: &Measured<'_>, expected: &Expected, i: usize) -> Test {
    let n = expected.sampling.count;
    let offset = measured.mean[i] - expected.mean[i];
    let spread = if n > 1.0 { measured.covariance[(i, i)] * (n - 1.0) / n } else { 0.0 };
    let found = offset * offset + spread;
    let population: f64 =
        expected.sampling.covariance[(i, i)] * (n - 1.0).max(0.0) / n + expected.sampling.mean_covariance[(i, i)];
    let p = if found <= population + expected.rounding(i).powi(2) { 1.0 } else { (population / found).clamp(0.0, 1.0) };
    Test {
        subject: Subject::Deviation,
        channels: vec![measured.names[i].clone()],
        measured: found.sqrt(),
        expected: population.sqrt(),
        z: None,
        bounded: None,
        degrees_of_freedom: None,
        p,
    }
}
