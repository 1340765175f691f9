//! The examples say what is so: their numbers against laws and predictions.

#![allow(clippy::unwrap_used, reason = "an example that fails shall stop the test")]
#![allow(dead_code, reason = "what the examples print with is not called here")]

#[path = "../examples/a_stage_of_ones_own.rs"]
mod a_stage_of_ones_own;
#[path = "../examples/covariance_of_a_pixel.rs"]
mod covariance_of_a_pixel;
#[path = "../examples/noise_on_an_array.rs"]
mod noise_on_an_array;

use cyanometer::chain::ChainStage;
use cyanometer::stages::demosaic::Method;

/// Each level has 2¹⁶ photosites; five standard errors of a mean are 5 σ/2⁸, of a σ near enough 5 σ/√2¹⁷.
#[test]
fn noise_on_an_array_is_as_predicted() {
    for [mean, std, predicted_mean, predicted_std] in noise_on_an_array::wedge().unwrap() {
        assert!((mean - predicted_mean).abs() < 5.0 * predicted_std / 256.0, "{mean} {predicted_mean}");
        assert!((std / predicted_std - 1.0).abs() < 5.0 / 2f64.powf(8.5), "{std} {predicted_std}");
    }
}

/// Bilinear interpolation of photosites that are alike leaves (5/8, 9/16) of the variance of G and of R and B: the mean over
/// phases of the sums of squared weights. \[HP2005, Eq. 39]
#[test]
fn the_covariance_of_a_pixel_is_that_of_the_weights() {
    let prediction = covariance_of_a_pixel::predict(Method::Bilinear, [10_000.0; 3]).unwrap();
    let stage = |name| prediction.stages.iter().find(|stage| stage.stage == name).unwrap();
    let (codes, pixel) = (stage(ChainStage::Adu), stage(ChainStage::Demosaicked));
    for (channel, share) in [(0, 9.0 / 16.0), (1, 5.0 / 8.0), (2, 9.0 / 16.0)] {
        let ratio = pixel.covariance[channel][channel] / codes.covariance[channel][channel];
        assert!((ratio / share - 1.0).abs() < 1e-12, "{channel}: {ratio}");
    }
}

/// Shot noise over 10⁶ photosites: the standard error of a variance is its √2/1000.
#[test]
fn coupling_hides_noise_as_its_kernel_says() {
    let [before, after] = a_stage_of_ones_own::variance_over_mean(0.01).unwrap();
    let error = 2f64.sqrt() / 1000.0;
    assert!((before - 1.0).abs() < 5.0 * error, "{before}");
    // (1 − 4a)² + 4a² at a = 0.01. The variances are of the same draws: their ratio errs only by what neighbors correlate
    // by chance, twice 2a(1 − 4a) in either direction.
    assert!((after / before - 0.922).abs() < 5.0 * 2.0 * 0.0192 * error, "{}", after / before);
}
