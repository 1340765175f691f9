//! The matrix that trades errors of color against noise.
//!
//! A pixel's color is off by the error of the matrix and by noise. About the color xᵢ of sample i, with the Jacobian Jᵢ of
//! L*a*b* there, the expected square of ΔE*ab is
//!
//! |Jᵢ (M ρᵢ − xᵢ)|² + w tr(Jᵢ M Σᵢ Mᵀ Jᵢᵀ)
//!
//! Σᵢ being the covariance of a demosaicked pixel at the sample's exposure and w = 1. The mean of n independent pixels has
//! w = 1/n; w = 0 is the best matrix where there is no noise. With Σᵢ = L Lᵀ each column of L is one more sample, of the
//! color 0: the sum over all samples is one least-squares problem in the nine elements of M.

use crate::color::{lab_about, matrix};
use crate::numerics::least_squares::{Fit, Problem, Undetermined, ridge_rows};
use nalgebra::{DMatrix, Matrix3, Vector3};
use serde::Serialize;

/// What the fit needs to know of one training sample.
#[derive(Debug, Clone, PartialEq)]
pub struct NoisySample {
    /// Camera signals, ADU above black per s sr.
    pub camera: [f64; 3],
    /// True XYZ, Y in cd m⁻².
    pub xyz: [f64; 3],
    /// White of L*a*b*, XYZ.
    pub white: [f64; 3],
    /// Covariance of the camera signals of a demosaicked pixel, (ADU per s sr)².
    pub covariance: Matrix3<f64>,
}

/// The training samples with their noise, and what noise weighs.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseTerms {
    /// The samples, in the order in which they are fitted.
    pub samples: Vec<NoisySample>,
    /// Weight of noise: 1 for single pixels, 1/n for the mean of n independent ones.
    pub weight: f64,
}

/// What a matrix leaves of errors, rms ΔE*ab to first order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TradeOff {
    /// Weight of noise that the matrix was fitted with.
    pub noise_weight: f64,
    /// Rms error of colors without noise.
    pub model_delta_e: f64,
    /// Rms noise of a single pixel.
    pub noise_delta_e: f64,
}

impl NoisySample {
    fn jacobian(&self) -> Matrix3<f64> {
        lab_about(self.xyz, self.white).jacobian
    }

    /// A root of the covariance: Σ = L Lᵀ, also where it is singular.
    fn root(&self) -> Matrix3<f64> {
        let parts = self.covariance.symmetric_eigen();
        parts.eigenvectors * Matrix3::from_diagonal(&parts.eigenvalues.map(|value| value.max(0.0).sqrt()))
    }
}

/// The three rows that say what Jᵢ M s is, in the nine elements of M row by row.
fn rows(jacobian: &Matrix3<f64>, signal: &Vector3<f64>, factor: f64, out: &mut DMatrix<f64>, first: usize) {
    for k in 0..3 {
        for i in 0..3 {
            for j in 0..3 {
                out[(first + k, 3 * i + j)] = factor * jacobian[(k, i)] * signal[j];
            }
        }
    }
}

impl NoiseTerms {
    /// Fits the nine elements, with one weight of the squared errors for each sample, or none where all are alike.
    pub(super) fn fit(
        &self,
        weights: &[f64],
        ridge: f64,
        kept: Option<&(DMatrix<f64>, DMatrix<f64>)>,
    ) -> Result<Fit, Undetermined> {
        let count = self.samples.len();
        let (mut regressors, mut responses) = (DMatrix::zeros(3 * count, 9), DMatrix::zeros(3 * count, 1));
        let noise_rows = if self.weight > 0.0 { 9 * count } else { 0 };
        let mut penalty = DMatrix::zeros(noise_rows, 9);
        for (index, sample) in self.samples.iter().enumerate() {
            let jacobian = sample.jacobian();
            let weight = weights.get(index).map_or(1.0, |weight| weight.sqrt());
            rows(&jacobian, &sample.camera.into(), weight, &mut regressors, 3 * index);
            let color = jacobian * Vector3::from(sample.xyz) * weight;
            responses.rows_mut(3 * index, 3).copy_from(&color);
            if self.weight > 0.0 {
                let root = sample.root();
                for column in 0..3 {
                    let factor = weight * self.weight.sqrt();
                    let signal = root.column(column).into_owned();
                    rows(&jacobian, &signal, factor, &mut penalty, 9 * index + 3 * column);
                }
            }
        }
        if let Some(more) = ridge_rows(&regressors, ridge) {
            penalty = penalty.resize_vertically(noise_rows + 9, 0.0);
            penalty.rows_mut(noise_rows, 9).copy_from(&more);
        }
        let equality = kept.map(|(signal, color)| {
            let mut left = DMatrix::zeros(3, 9);
            rows(&Matrix3::identity(), &Vector3::from_iterator(signal.iter().copied()), 1.0, &mut left, 0);
            (left, color.transpose())
        });
        let problem = Problem {
            regressors: &regressors,
            responses: &responses,
            group: 3,
            penalty: Some(&penalty).filter(|penalty| penalty.nrows() > 0),
            equality: equality.as_ref().map(|(left, right)| (left, right)),
        };
        problem.solve()
    }

    /// What a matrix leaves of errors and noise on these samples.
    pub fn trade_off(&self, xyz_from_camera: &[[f64; 3]; 3]) -> TradeOff {
        let matrix = matrix(xyz_from_camera);
        let (mut model, mut noise) = (0.0, 0.0);
        for sample in &self.samples {
            let jacobian = sample.jacobian();
            let error = matrix * Vector3::from(sample.camera) - Vector3::from(sample.xyz);
            model += (jacobian * error).norm_squared();
            noise += (jacobian * matrix * sample.root()).norm_squared();
        }
        let rms = |sum: f64| (sum / self.samples.len() as f64).sqrt();
        TradeOff { noise_weight: self.weight, model_delta_e: rms(model), noise_delta_e: rms(noise) }
    }
}
