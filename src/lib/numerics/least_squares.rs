//! Linear least squares by orthogonal factorisation.

use crate::error::{Error, Result};
use nalgebra::DMatrix;

/// The solution of a least-squares problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// `coefficients[i][j]` multiplies regressor i in response j.
    pub coefficients: DMatrix<f64>,
    /// Ratio of the largest to the smallest singular value of the regressors.
    pub condition: f64,
}

/// Finds B that minimises ‖A B − Y‖, rows of `regressors` A and `responses` Y being observations.
///
/// A = QR by Householder reflections after its columns are scaled to unit length, so that Aᵀ A is never formed. The
/// condition number is that of A as given.
///
/// # Errors
///
/// [`Error::Data`] when the observations do not determine B: fewer of them than regressors, or a condition number
/// above 10¹⁰ (beyond it, rounding of 32-bit data alone changes B by more than itself).
pub fn fit(regressors: &DMatrix<f64>, responses: &DMatrix<f64>) -> Result<Fit> {
    let (observations, unknowns) = regressors.shape();
    if observations < unknowns {
        return Err(Error::Data(format!(
            "{observations} training samples cannot determine {unknowns} coefficients per channel; give at least \
             {unknowns}"
        )));
    }
    let singular = regressors.singular_values();
    let condition = singular.max() / singular.min();
    if !(1.0..=1e10).contains(&condition) {
        return Err(Error::Data(format!(
            "the training samples do not determine the matrix (condition number {condition:.1e}); give more varied ones"
        )));
    }
    let mut scaled = regressors.clone();
    let lengths: Vec<f64> = scaled.column_iter().map(|column| column.norm()).collect();
    for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let factors = scaled.qr();
    let right = factors.q().transpose() * responses;
    let mut coefficients = factors
        .r()
        .solve_upper_triangular(&right)
        .ok_or_else(|| Error::Data("the training samples do not determine the matrix".into()))?;
    for (mut row, length) in coefficients.row_iter_mut().zip(&lengths) {
        row /= *length;
    }
    Ok(Fit { coefficients, condition })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_relation_is_found_again() {
        let truth = DMatrix::from_row_slice(3, 2, &[1.0, -2.0, 0.5, 4.0, 1e-3, 7.0]);
        let regressors = DMatrix::from_fn(9, 3, |i, j| ((i * 7 + j * 5) % 11) as f64 * 1000f64.powf(j as f64));
        let fit = fit(&regressors, &(&regressors * &truth)).unwrap();
        // The last response reaches 7·10⁷; its rounding divided by a column's scale is what a coefficient may be off.
        for ((i, _), error) in
            (0..3).flat_map(|i| (0..2).map(move |j| (i, j))).zip((fit.coefficients - truth).transpose().iter())
        {
            assert!(error.abs() < 7e7 * 100.0 * f64::EPSILON / 1000f64.powi(i), "{i} {error}");
        }
    }

    #[test]
    fn samples_that_determine_nothing_are_refused() {
        let same = DMatrix::from_fn(20, 3, |i, j| (i + 1) as f64 * (j + 1) as f64);
        let message = fit(&same, &same).unwrap_err().to_string();
        assert!(message.contains("do not determine"), "{message}");
        let few = DMatrix::from_element(2, 3, 1.0);
        assert!(fit(&few, &few).unwrap_err().to_string().contains("at least 3"));
    }
}
