//! Linear least squares by orthogonal factorization, with equations that must hold exactly.

use nalgebra::DMatrix;

/// Condition number from which regressors count as dependent: radiances are known to about six digits, and errors of that
/// size would change the solution by a hundredth of itself.
pub const LARGEST_CONDITION: f64 = 1e4;

/// Finds B that minimizes ‖A B − Y‖² + ‖P B‖² where C B = D holds exactly.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// A, shape observations × unknowns.
    pub regressors: &'a DMatrix<f64>,
    /// Y, shape observations × responses.
    pub responses: &'a DMatrix<f64>,
    /// Rows of A that belong to one observation, for the uncertainty of the solution.
    pub group: usize,
    /// P, shape any × unknowns.
    pub penalty: Option<&'a DMatrix<f64>>,
    /// C and D, shapes equations × unknowns and equations × responses; the equations are independent.
    pub equality: Option<(&'a DMatrix<f64>, &'a DMatrix<f64>)>,
}

/// The solution of a least-squares problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// `coefficients[i][j]` multiplies regressor i in response j.
    pub coefficients: DMatrix<f64>,
    /// Ratio of the largest to the smallest singular value of A.
    pub condition: f64,
    /// Number of independent regressors in A.
    pub rank: usize,
    /// Y − A B.
    pub residuals: DMatrix<f64>,
    /// Covariance of the coefficients of each response, by the jackknife: how they change when single observations are
    /// left out, the penalty staying as it is. None where one of them is indispensable.
    pub covariance: Option<Vec<DMatrix<f64>>>,
}

/// The observations do not determine the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Undetermined {
    /// Independent equations that there are.
    pub rank: usize,
    /// Unknowns of each response.
    pub unknowns: usize,
    /// Condition number of what is left to determine beside the equations: the largest singular value of all regressors,
    /// their columns scaled to unit length, over the smallest of what is left; infinite where there is too little.
    pub condition: f64,
}

impl Problem<'_> {
    /// Solves the problem in the null space of its equations [GolubVanLoan2013, Sec. 6.2.3].
    ///
    /// Columns are scaled to unit length first. With the orthogonal factors Cᵀ = Q₁ R of the equations and the rest Q₂ of
    /// the space, B = Q₁ R⁻ᵀ D + Q₂ Z meets them whatever Z is, and Z follows from A Q₂ = Q_A R_A by Householder
    /// reflections: Aᵀ A is never formed. The jackknife follows from the same factors: without group g of the rows, Z
    /// changes by R_A⁻¹ Q_gᵀ (I − Q_g Q_gᵀ)⁻¹ e_g, e_g the residuals.
    ///
    /// # Errors
    ///
    /// [`Undetermined`] where fewer than the unknowns are determined, or a condition number above
    /// [`LARGEST_CONDITION`].
    pub fn solve(&self) -> Result<Fit, Undetermined> {
        let unknowns = self.regressors.ncols();
        let observed = self.regressors.nrows();
        let penalty_rows = self.penalty.map_or(0, DMatrix::nrows);
        let mut stacked = self.regressors.clone().resize_vertically(observed + penalty_rows, 0.0);
        if let Some(penalty) = self.penalty {
            stacked.rows_mut(observed, penalty_rows).copy_from(penalty);
        }
        let lengths: Vec<f64> = stacked.column_iter().map(|column| column.norm()).collect();
        let too_little = |rank| Undetermined { rank, unknowns, condition: f64::INFINITY };
        if lengths.iter().any(|length| !(*length > 0.0 && length.is_finite())) {
            return Err(too_little(lengths.iter().filter(|length| **length > 0.0).count()));
        }
        for (mut column, length) in stacked.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let space = Space::of(self.equality, &lengths, self.responses.ncols()).ok_or_else(|| too_little(0))?;
        let free = space.free.ncols();
        let reduced = &stacked * &space.free;
        // What is left beside the equations counts relative to all there is: small remainders may be rounding alone.
        let all = if stacked.is_empty() { 0.0 } else { stacked.singular_values().max() };
        let left = if reduced.is_empty() { Vec::new() } else { reduced.singular_values().as_slice().to_vec() };
        let condition = match left.iter().copied().reduce(f64::min) {
            Some(smallest) if reduced.nrows() >= free => all / smallest,
            _ => f64::INFINITY,
        };
        if free > 0 && !(1.0..=LARGEST_CONDITION).contains(&condition) {
            let rank = left.iter().filter(|&&value| value > all / LARGEST_CONDITION).count();
            return Err(Undetermined { rank: rank + unknowns - free, unknowns, condition });
        }
        let mut right = self.responses.clone().resize_vertically(observed + penalty_rows, 0.0);
        right -= &stacked * &space.particular;
        let factors = reduced.qr();
        let (q, r) = (factors.q(), factors.r());
        let z = r.solve_upper_triangular(&(q.transpose() * right)).ok_or_else(|| too_little(unknowns - free))?;
        let mut coefficients = space.exact(&(&space.particular + &space.free * z));
        unscale(&mut coefficients, &lengths);
        let residuals = self.responses - self.regressors * &coefficients;
        let singular = self.regressors.singular_values();
        Ok(Fit {
            covariance: self.jackknife(&q, &r, &space.free, &residuals, &lengths),
            condition: singular.max() / singular.min(),
            rank: rank(self.regressors),
            coefficients,
            residuals,
        })
    }

    /// Covariance of each response's coefficients when observations are left out one at a time \[Efron1982]:
    /// (n − 1)/n Σ (Δ − Δ̄)(Δ − Δ̄)ᵀ.
    fn jackknife(
        &self,
        q: &DMatrix<f64>,
        r: &DMatrix<f64>,
        free: &DMatrix<f64>,
        residuals: &DMatrix<f64>,
        lengths: &[f64],
    ) -> Option<Vec<DMatrix<f64>>> {
        let groups = self.regressors.nrows() / self.group;
        if groups * self.group <= free.ncols() || free.ncols() == 0 {
            return None;
        }
        let mut changes = Vec::with_capacity(groups);
        for group in 0..groups {
            let part = q.rows(group * self.group, self.group);
            let rest = DMatrix::identity(self.group, self.group) - part * part.transpose();
            let errors = residuals.rows(group * self.group, self.group).into_owned();
            // A group without which nothing is determined leaves nothing of the identity.
            if rest.clone().symmetric_eigenvalues().min() < 1e-9 {
                return None;
            }
            let lifted = part.transpose() * rest.lu().solve(&errors)?;
            let mut change = free * r.solve_upper_triangular(&lifted)?;
            unscale(&mut change, lengths);
            changes.push(change);
        }
        let count = groups as f64;
        let responses = (0..self.responses.ncols()).map(|response| {
            let columns: Vec<_> = changes.iter().map(|change| change.column(response).into_owned()).collect();
            let mut mean = columns[0].clone() * 0.0;
            columns.iter().for_each(|column| mean += column);
            mean /= count;
            let unknowns = self.regressors.ncols();
            columns.iter().fold(DMatrix::zeros(unknowns, unknowns), |sum, column| {
                let deviation = column - &mean;
                sum + &deviation * deviation.transpose() * ((count - 1.0) / count)
            })
        });
        Some(responses.collect())
    }
}

/// Rows that add the share `ridge` of each column's own sum of squares to it; none for no ridge.
pub fn ridge_rows(columns: &DMatrix<f64>, ridge: f64) -> Option<DMatrix<f64>> {
    let lengths: Vec<f64> = columns.column_iter().map(|column| ridge.sqrt() * column.norm()).collect();
    (ridge > 0.0).then(|| DMatrix::from_diagonal(&lengths.into()))
}

fn unscale(coefficients: &mut DMatrix<f64>, lengths: &[f64]) {
    for (mut row, length) in coefficients.row_iter_mut().zip(lengths) {
        row /= *length;
    }
}

/// Singular values that are not small beside the largest, columns scaled to unit length.
fn rank(matrix: &DMatrix<f64>) -> usize {
    let mut scaled = matrix.clone();
    for mut column in scaled.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let singular = scaled.singular_values();
    singular.iter().filter(|&&value| value > singular.max() / LARGEST_CONDITION).count()
}

/// The solutions of C B = D, in scaled unknowns: one of them, and the directions in which they may differ.
struct Space {
    particular: DMatrix<f64>,
    free: DMatrix<f64>,
    equations: Option<(DMatrix<f64>, DMatrix<f64>)>,
}

impl Space {
    /// None where the equations are dependent.
    fn of(equality: Option<(&DMatrix<f64>, &DMatrix<f64>)>, lengths: &[f64], responses: usize) -> Option<Self> {
        let unknowns = lengths.len();
        let identity = DMatrix::identity(unknowns, unknowns);
        let Some((left, right)) = equality else {
            return Some(Self { particular: DMatrix::zeros(unknowns, responses), free: identity, equations: None });
        };
        let count = left.nrows();
        let mut scaled = left.clone();
        for (mut column, length) in scaled.column_iter_mut().zip(lengths) {
            column /= *length;
        }
        if count > unknowns || rank(&scaled.transpose()) < count {
            return None;
        }
        let mut with_identity = DMatrix::zeros(unknowns, count + unknowns);
        with_identity.columns_mut(0, count).copy_from(&scaled.transpose());
        with_identity.columns_mut(count, unknowns).copy_from(&identity);
        let all = with_identity.qr().q();
        let free = all.columns(count, unknowns - count).into_owned();
        let mut space = Self { particular: DMatrix::zeros(unknowns, responses), free, equations: None };
        space.equations = Some((scaled, right.clone()));
        space.particular = space.exact(&space.particular);
        Some(space)
    }

    /// The nearest solution of the equations: what is off is taken away by their pseudo-inverse, twice for rounding.
    fn exact(&self, near: &DMatrix<f64>) -> DMatrix<f64> {
        let mut found = near.clone();
        if let Some((left, right)) = &self.equations {
            let factors = left.transpose().qr();
            for _ in 0..2 {
                let off = right - left * &found;
                let lower = factors.r().transpose();
                found += factors.q() * lower.solve_lower_triangular(&off).unwrap_or_else(|| off.clone() * 0.0);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain<'a>(regressors: &'a DMatrix<f64>, responses: &'a DMatrix<f64>) -> Problem<'a> {
        Problem { regressors, responses, group: 1, penalty: None, equality: None }
    }

    /// Numbers without order, the same every time.
    fn scatter(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
        let mut state = seed;
        DMatrix::from_fn(rows, columns, |_, _| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 2f64.powi(53) - 0.4
        })
    }

    #[test]
    fn an_exact_relation_is_found_again() {
        let truth = DMatrix::from_row_slice(3, 2, &[1.0, -2.0, 0.5, 4.0, 1e-3, 7.0]);
        let regressors = DMatrix::from_fn(9, 3, |i, j| ((i * 7 + j * 5) % 11) as f64 * 1000f64.powf(j as f64));
        let responses = &regressors * &truth;
        let fit = plain(&regressors, &responses).solve().unwrap();
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
        let refused = plain(&same, &same).solve().unwrap_err();
        assert_eq!((refused.rank, refused.unknowns), (1, 3));
        let few = scatter(2, 3, 1);
        assert_eq!(plain(&few, &few).solve().unwrap_err().rank, 2);
        // A sample that is kept exact counts as one more, unless it is among them.
        let other = scatter(1, 3, 2);
        let value = scatter(1, 3, 3);
        let kept = Problem { equality: Some((&other, &value)), ..plain(&few, &few) };
        assert!(kept.solve().is_ok());
        let again = few.rows(0, 1).into_owned();
        let refused = Problem { equality: Some((&again, &value)), ..plain(&few, &few) }.solve().unwrap_err();
        assert_eq!(refused.rank, 2);
        // Rounding beside the one that is kept determines nothing, though it points everywhere.
        let near = DMatrix::from_fn(6, 3, |i, j| few[(0, j)] * (1.0 + 1e-9 * scatter(6, 3, 20)[(i, j)]));
        let of_near = scatter(6, 3, 21);
        let refused = Problem { equality: Some((&again, &value)), ..plain(&near, &of_near) }.solve().unwrap_err();
        assert_eq!((refused.rank, refused.unknowns), (1, 3));
        let nothing = DMatrix::zeros(1, 3);
        assert!(Problem { equality: Some((&nothing, &value)), ..plain(&few, &few) }.solve().is_err());
    }

    /// The optimum under equations has a gradient that is a combination of them: Aᵀ(Y − A B) = Cᵀ Λ.
    #[test]
    fn equations_hold_and_the_rest_is_least() {
        let (regressors, responses) = (scatter(30, 5, 4), scatter(30, 2, 5));
        let (left, right) = (scatter(2, 5, 6), scatter(2, 2, 7));
        let fit = Problem { equality: Some((&left, &right)), ..plain(&regressors, &responses) }.solve().unwrap();
        assert!((&left * &fit.coefficients - &right).amax() < 1e-14);
        let gradient = regressors.transpose() * &fit.residuals;
        let multipliers = (&left * left.transpose()).lu().solve(&(&left * &gradient)).unwrap();
        assert!((gradient - left.transpose() * multipliers).amax() < 1e-12);
    }

    #[test]
    fn a_penalty_is_observations_of_zero() {
        let (regressors, responses, penalty) = (scatter(12, 3, 8), scatter(12, 2, 9), scatter(3, 3, 10));
        let with = Problem { penalty: Some(&penalty), ..plain(&regressors, &responses) }.solve().unwrap();
        let mut all = regressors.clone().resize_vertically(15, 0.0);
        all.rows_mut(12, 3).copy_from(&penalty);
        let zeros = responses.resize_vertically(15, 0.0);
        assert!((with.coefficients - plain(&all, &zeros).solve().unwrap().coefficients).amax() < 1e-13);
    }

    /// The covariance beside fits that are made again without each group of rows.
    #[test]
    fn the_jackknife_is_that_of_fits_without_an_observation() {
        let (regressors, responses) = (scatter(24, 3, 11), scatter(24, 2, 12));
        let (left, right) = (scatter(1, 3, 13), scatter(1, 2, 14));
        for group in [1, 3] {
            let problem = Problem { group, equality: Some((&left, &right)), ..plain(&regressors, &responses) };
            let found = problem.solve().unwrap().covariance.unwrap();
            let count = 24 / group;
            let without: Vec<DMatrix<f64>> = (0..count)
                .map(|out| {
                    let kept: Vec<usize> = (0..24).filter(|row| row / group != out).collect();
                    let (a, y) = (regressors.select_rows(&kept), responses.select_rows(&kept));
                    Problem { group, equality: Some((&left, &right)), ..plain(&a, &y) }.solve().unwrap().coefficients
                })
                .collect();
            let mean = without.iter().fold(DMatrix::zeros(3, 2), |sum, fit| sum + fit) / count as f64;
            for (response, covariance) in found.iter().enumerate() {
                let direct = without.iter().fold(DMatrix::zeros(3, 3), |sum, fit| {
                    let off = (fit - &mean).column(response).into_owned();
                    sum + &off * off.transpose() * ((count as f64 - 1.0) / count as f64)
                });
                assert!(
                    (covariance - &direct).amax() < 1e-12 * direct.amax().max(1.0),
                    "{group} {covariance} {direct}"
                );
            }
        }
        // Three rows for three unknowns: each is indispensable.
        let few = scatter(3, 3, 15);
        assert_eq!(plain(&few, &few).solve().unwrap().covariance, None);
    }
}
