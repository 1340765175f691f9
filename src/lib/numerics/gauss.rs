//! Gauss's quadrature over panels.

use nalgebra::DMatrix;
use std::sync::LazyLock;

/// Nodes of a panel.
pub const NODES: usize = 12;

/// Places and weights on −1 to 1: roots of the Legendre polynomial, by Newton's method from Tricomi's guess.
static PANEL: LazyLock<[(f64, f64); NODES]> = LazyLock::new(|| {
    let n = NODES as f64;
    std::array::from_fn(|i| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=NODES {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            let step = value / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
});

/// Weights of the barycentric formula for the polynomial through the places: (−1)ⁱ √((1 − xᵢ²) wᵢ).
static BARYCENTRIC: LazyLock<[f64; NODES]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let (x, weight) = PANEL[i];
        ((1.0 - x * x) * weight).sqrt() * if i % 2 == 0 { 1.0 } else { -1.0 }
    })
});

/// The polynomial through `values` at the places of a [`panel`] from −1 to 1, at `x`.
///
/// # Examples
///
/// ```
/// use cyanometer::numerics::gauss::{interpolated, panel};
///
/// let mut values = [0.0; 12];
/// values.iter_mut().zip(panel(-1.0, 1.0)).for_each(|(value, (x, _))| *value = x.exp());
/// // The polynomial through e^x is off by less than e 2⁻¹¹/12!.
/// assert!((interpolated(&values, 0.3) - 0.3f64.exp()).abs() < 3e-12);
/// ```
pub fn interpolated(values: &[f64; NODES], x: f64) -> f64 {
    let (mut above, mut below) = (0.0, 0.0);
    for ((value, (place, _)), weight) in values.iter().zip(PANEL.iter()).zip(BARYCENTRIC.iter()) {
        let distance = x - place;
        if distance == 0.0 {
            return *value;
        }
        above += weight / distance * value;
        below += weight / distance;
    }
    above / below
}

/// Places and weights of a rule of 12 nodes from `low` to `high`, exact for polynomials of degree 23.
///
/// # Examples
///
/// ```
/// let sum: f64 = cyanometer::numerics::gauss::panel(0.0, 2.0).map(|(x, weight)| weight * x.powi(23)).sum();
/// assert!((sum / (2f64.powi(24) / 24.0) - 1.0).abs() < 1e-13);
/// ```
pub fn panel(low: f64, high: f64) -> impl Iterator<Item = (f64, f64)> {
    let (middle, half) = (f64::midpoint(low, high), 0.5 * (high - low));
    PANEL.iter().map(move |(x, weight)| (middle + half * x, half * weight))
}

/// The same of a rule of 8 nodes, exact for polynomials of degree 15.
///
/// # Examples
///
/// ```
/// let sum: f64 = cyanometer::numerics::gauss::few(0.0, 2.0).map(|(x, weight)| weight * x.powi(15)).sum();
/// assert!((sum / (2f64.powi(16) / 16.0) - 1.0).abs() < 1e-12);
/// ```
pub fn few(low: f64, high: f64) -> impl Iterator<Item = (f64, f64)> {
    static FEW: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(8));
    between(&FEW, low, high)
}

/// The same of a rule of 5 nodes, exact for polynomials of degree 9.
///
/// # Examples
///
/// ```
/// let sum: f64 = cyanometer::numerics::gauss::fewest(0.0, 2.0).map(|(x, weight)| weight * x.powi(9)).sum();
/// assert!((sum / (2f64.powi(10) / 10.0) - 1.0).abs() < 1e-12);
/// ```
pub fn fewest(low: f64, high: f64) -> impl Iterator<Item = (f64, f64)> {
    static FEWEST: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(5));
    between(&FEWEST, low, high)
}

/// Gauss and Legendre's nodes and weights, which add up to 1: k/√(4k² − 1) beside a diagonal of 0.
fn legendre(nodes: usize) -> Vec<(f64, f64)> {
    by_recurrence(&DMatrix::from_fn(nodes, nodes, |i, j| {
        let k = i.max(j) as f64;
        if i.abs_diff(j) == 1 { k / (4.0 * k * k - 1.0).sqrt() } else { 0.0 }
    }))
}

/// Such nodes and weights from `low` to `high`.
fn between(rule: &'static [(f64, f64)], low: f64, high: f64) -> impl Iterator<Item = (f64, f64)> {
    let (middle, half) = (f64::midpoint(low, high), 0.5 * (high - low));
    rule.iter().map(move |(x, weight)| (middle + half * x, 2.0 * half * weight))
}

/// Gauss and Hermite's nodes and weights for a standard normal variable: eigenvalues of the matrix of the polynomials' recurrence, with
/// √k beside its diagonal of 0.
///
/// # Examples
///
/// ```
/// // The sixth moment is 15.
/// let sum: f64 = cyanometer::numerics::gauss::hermite(4).iter().map(|(z, weight)| weight * z.powi(6)).sum();
/// assert!((sum - 15.0).abs() < 1e-12);
/// ```
pub fn hermite(nodes: usize) -> Vec<(f64, f64)> {
    by_recurrence(&DMatrix::from_fn(nodes, nodes, |i, j| match i.abs_diff(j) {
        1 => (i.max(j) as f64).sqrt(),
        _ => 0.0,
    }))
}

/// Gauss and Laguerre's nodes and weights: eigenvalues of the matrix of the polynomials' recurrence, with 2k + 1 on its diagonal
/// and k beside it.
pub fn laguerre(nodes: usize) -> Vec<(f64, f64)> {
    by_recurrence(&DMatrix::from_fn(nodes, nodes, |i, j| match i.abs_diff(j) {
        0 => 2.0 * i as f64 + 1.0,
        1 => i.max(j) as f64,
        _ => 0.0,
    }))
}

/// Places and weights by the matrix of the recurrence \[Golub and Welsch 1969].
pub(crate) fn by_recurrence(recurrence: &DMatrix<f64>) -> Vec<(f64, f64)> {
    let solved = recurrence.clone().symmetric_eigen();
    let node = |(index, place): (usize, &f64)| (*place, solved.eigenvectors[(0, index)].powi(2));
    solved.eigenvalues.iter().enumerate().map(node).collect()
}
