//! Is what several frames of one scene have in common, and what is drawn anew in each, what was predicted?

use super::check::{
    Expected, FEW, FLAT, FREE, Measured, RARE, Subject, Test, correlation, of_any_law, of_few_products, pair, tests,
    variance,
};
use crate::numerics::significance;
use crate::propagation::covariance::PAIRS;

/// Tests the means over frames of pixels.
pub(super) fn tests_of_means(measured: &Measured<'_>, expected: &Expected) -> Vec<Test> {
    let tests = tests(measured, expected);
    tests.into_iter().map(|test| Test { subject: test.subject.of_means(), ..test }).collect()
}

/// Tests what is drawn anew in each of so many frames: variances and correlations of the channels `0..count` within frames, whose
/// scatter `expected` has, and the variances of the means of frames.
pub(super) fn tests_over_frames(
    measured: &Measured<'_>,
    variances_of_means: &[f64],
    expected: &Expected,
    frames: u32,
) -> Vec<Test> {
    let sampling = &expected.sampling;
    let (channels, freedom) = (measured.names.len(), f64::from(frames) - 1.0);
    // Sums over few samples off their usual step are like no normal law.
    let is_rare = |i: usize| {
        let site = if expected.is_plane { expected.site_variances[i] } else { expected.least_variance() };
        sampling.count * freedom * site < RARE || sampling.covariance[(i, i)].max(0.0).sqrt() <= expected.rounding(i)
    };
    let mut found = Vec::new();
    for i in (0..channels).filter(|i| !is_rare(*i)) {
        if sampling.count > 1.0 {
            found.push(temporal_variance(measured, expected, i, freedom));
        }
        if sampling.count * expected.least_variance() >= RARE {
            found.push(variance_of_frame_means(measured, expected, i, variances_of_means[i], freedom));
        }
    }
    for (index, [i, j]) in PAIRS.into_iter().enumerate() {
        if i != j && j < channels && ![i, j].into_iter().any(is_rare) && sampling.count >= 4.0 {
            let kurtosis = expected.product_kurtosis([i, j]) / freedom;
            let test = correlation(measured, sampling, index);
            let test = test.map(|test| if kurtosis > FREE { of_few_products(test, kurtosis) } else { test });
            found.extend(test.map(|test| Test { subject: Subject::TemporalCorrelation, ..test }));
        }
    }
    found
}

/// The same of what N frames make of it, of which each degree of freedom of the frames is as good as a frame: what rows and columns
/// share makes the law skewer by 1/(N − 1)² of its third cumulant.
fn temporal_variance(measured: &Measured<'_>, law: &Expected, i: usize, frames: f64) -> Test {
    let test = variance(measured, law, i);
    let scatter = law.sampling.spread[pair([i, i])][pair([i, i])];
    let (z, freedom) = (test.deviate().unwrap_or_default(), test.degrees_of_freedom.unwrap_or_default());
    let has_law = freedom >= FEW && law.site_kurtosis[i] >= FLAT && !law.is_heavy_in(i, frames);
    let thirds = law.sampling.variance_thirds.map(|thirds| thirds[i] / (frames * frames));
    let p = match thirds {
        _ if !has_law => of_any_law(z),
        Some(third) => significance::of_sum_of_squares(test.measured, [test.expected, scatter, third]),
        None => significance::of_chi_square(freedom * test.measured / test.expected, freedom),
    };
    Test { subject: Subject::TemporalVariance, p, ..test }.with(z, has_law)
}

/// The variance of the means of frames is like χ², whose freedom is less by what tails of photosites leave in the mean of so many, an excess
/// kurtosis g: the variance scatters by (2 + g)/(N − 1) of its square. Where few samples make up the means, as of frames that are nearly all full, it
/// follows no law that is known, and the bound of Chebyshev holds. Sums of codes are whole numbers, so that means which differ by less may be equal: if
/// each is off by half a step at most, the root of their variance is off by √(N/(N − 1)) of that at most, and so far it may be
/// larger.
fn variance_of_frame_means(measured: &Measured<'_>, expected: &Expected, i: usize, found: f64, freedom: f64) -> Test {
    let law = expected.sampling.mean_covariance[(i, i)];
    // Half a step of a sum of n photosites to its standard deviation, one of which has a variance in steps².
    let (site, count) = if expected.is_plane {
        (expected.sampling.count * law, expected.sampling.count)
    } else {
        (expected.least_variance(), expected.sampling.count / 4.0)
    };
    let half_step = 0.5 / (count * site).sqrt() * (1.0 + 1.0 / freedom).sqrt();
    let ratio = found / law;
    let kurtosis = expected.mean_kurtosis(i);
    let freedom = freedom * 2.0 / (2.0 + kurtosis);
    let (z, has_law) = ((ratio - 1.0) * (freedom / 2.0).sqrt(), kurtosis <= FREE);
    let p = if !has_law {
        of_any_law(z)
    } else if ratio > 1.0 {
        significance::of_chi_square(freedom * ratio, freedom)
    } else {
        let most = (ratio.sqrt() + half_step).powi(2);
        if most < 1.0 { significance::of_chi_square(freedom * most, freedom) } else { 1.0 }
    };
    let test = Test {
        subject: Subject::VarianceOfFrameMeans,
        channels: vec![measured.names[i].clone()],
        measured: found,
        expected: law,
        z: None,
        bounded: None,
        degrees_of_freedom: Some(freedom),
        p,
    };
    test.with(z, has_law)
}
