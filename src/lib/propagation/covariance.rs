//! Covariances of three channels, six numbers each.

use nalgebra::Matrix3;

/// The pairs of channels whose covariances are kept, in their order.
pub const PAIRS: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

/// The six covariances of a pixel's three channels, in the order of [`PAIRS`].
pub type Covariance = [f64; 6];

/// `matrix` Σ `matrix`ᵀ of a covariance in the order of [`PAIRS`].
pub fn through(covariance: &Covariance, matrix: &Matrix3<f64>) -> Covariance {
    let whole = symmetric(covariance);
    let made = matrix * whole * matrix.transpose();
    PAIRS.map(|[i, j]| made[(i, j)])
}

/// The symmetric matrix of six covariances.
pub fn symmetric(covariance: &Covariance) -> Matrix3<f64> {
    let [rr, rg, rb, gg, gb, bb] = *covariance;
    Matrix3::new(rr, rg, rb, rg, gg, gb, rb, gb, bb)
}

/// Standard deviations of the three channels.
pub fn stds(covariance: &Covariance) -> [f64; 3] {
    [covariance[0], covariance[3], covariance[5]].map(std_of)
}

/// The standard deviation of a variance that rounding may have made negative; of none, none.
pub fn std_of(variance: f64) -> f64 {
    if variance < 0.0 { 0.0 } else { variance.sqrt() }
}
