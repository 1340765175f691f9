//! What is predicted of a sample, and by which equations.

use crate::names::{Named, serde_by_name};
use crate::numerics::normal::MeanVariance;
use nalgebra::Matrix3;

/// Which equations to predict by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Equations {
    /// Exact moments.
    #[default]
    Exact,
    /// Those of \[HP2005], misprints mended.
    Paper,
}

impl Named for Equations {
    const ALL: &'static [Self] = &[Self::Exact, Self::Paper];

    fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Paper => "paper",
        }
    }
}

serde_by_name!(Equations);

/// Predicted moments of the samples of one class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Mean and variance over the photosites of a frame; fixed patterns count as variance.
    pub moments: MeanVariance,
    /// Third cumulant, for what is curved in the samples.
    pub third: f64,
    /// Excess kurtosis, for the spread of a sample variance.
    pub excess_kurtosis: f64,
    /// Sixth cumulant where photosites are unlike each other, for the law of a sample variance; 0 of others.
    pub sixth: f64,
    /// Variance of what all samples of the class in a frame are off together, which no number of them averages away.
    pub common: f64,
    /// What it shares with others of its row and of its column.
    pub lines: LineCovariance,
}

impl Prediction {
    /// The prediction of a variable with these cumulants.
    pub fn of_cumulants(mean: f64, variance: f64, third: f64, fourth: f64) -> Self {
        let of_spread = |cumulant: f64| if variance > 0.0 { cumulant } else { 0.0 };
        // No law has less than its skewness tells [Pearson1916]; a fourth cumulant that rounding has eaten up is no reason to trust in χ².
        let least = third / variance.powf(1.5);
        let excess_kurtosis = if variance > 0.0 { (fourth / variance.powi(2)).max(least * least - 2.0) } else { 0.0 };
        Self {
            moments: MeanVariance { mean, variance },
            third: of_spread(third),
            excess_kurtosis,
            sixth: 0.0,
            common: 0.0,
            lines: LineCovariance::default(),
        }
    }

    /// The prediction of a variable with these moments 1 to 4 about a center.
    pub(super) fn about(center: f64, [m1, m2, m3, m4]: &[f64; 4]) -> Self {
        let variance = m2 - m1 * m1;
        // What is left of a difference of squares that are equal to rounding is none.
        let variance = if variance < 4.0 * f64::EPSILON * m2 { 0.0 } else { variance };
        let third = m3 - 3.0 * m1 * m2 + 2.0 * m1.powi(3);
        let fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4) - 3.0 * variance * variance;
        Self::of_cumulants(center + m1, variance, third, fourth)
    }

    /// Moments 1 to 4 about a center, from which [`Self::about`] makes it.
    pub(super) fn moments_about(&self, center: f64) -> [f64; 4] {
        let MeanVariance { mean, variance } = self.moments;
        let (mean, third) = (mean - center, self.third);
        let square = mean * mean;
        [
            mean,
            square + variance,
            mean * (square + 3.0 * variance) + third,
            square * (square + 6.0 * variance) + 4.0 * mean * third + 3.0 * variance * variance + self.fourth(),
        ]
    }

    /// The same of samples that are so many times as large, that share nothing.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let MeanVariance { mean, variance } = self.moments;
        let square = factor * factor;
        let (third, fourth) = (self.third * factor.powi(3), self.fourth() * square * square);
        let scaled = Self::of_cumulants(factor * mean, square * variance, third, fourth);
        Self { sixth: self.sixth * square.powi(3), ..scaled }
    }

    /// Fourth cumulant.
    pub fn fourth(&self) -> f64 {
        self.excess_kurtosis * self.moments.variance.powi(2)
    }

    /// Fourth cumulant of what is a photosite's own, of such variance: what is shared is as good as normal, and no law has less than
    /// −2κ₂².
    pub fn fourth_of_own(&self, variance: f64) -> f64 {
        self.fourth().max(-2.0 * variance * variance)
    }
}

/// Covariances of a photosite with another of class R, G or B in its row, and in its column.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineCovariance {
    /// In its row.
    pub row: [f64; 3],
    /// In its column.
    pub column: [f64; 3],
    /// What of that in its row is drift of the black level, which rows near it share in part.
    pub drift: [f64; 3],
    /// Rows from one knot of the drift to the next; 0 where there is none.
    pub drift_rows: f64,
    /// Of three planes: what samples of one place share with one of another class beyond what they do by row and by column.
    pub together: [f64; 3],
    /// What all samples in a frame are off together with all of another class, beyond [`Prediction::common`]: rows and columns share noise
    /// of the level of a flat field.
    pub level: [f64; 3],
}

impl LineCovariance {
    /// What is left where a part of it is taken off.
    #[must_use]
    pub fn less(&self, part: &Self) -> Self {
        let less = |whole: [f64; 3], part: [f64; 3]| [0, 1, 2].map(|l| whole[l] - part[l]);
        Self {
            row: less(self.row, part.row),
            column: less(self.column, part.column),
            drift: less(self.drift, part.drift),
            drift_rows: self.drift_rows,
            together: less(self.together, part.together),
            level: less(self.level, part.level),
        }
    }
}

impl LineCovariance {
    /// The same of samples of which the products with R, G and B are so many times as large.
    #[must_use]
    pub(super) fn scaled(&self, by: [f64; 3]) -> Self {
        let scaled = |covariances: [f64; 3]| [0, 1, 2].map(|l| by[l] * covariances[l]);
        Self {
            row: scaled(self.row),
            column: scaled(self.column),
            drift: scaled(self.drift),
            drift_rows: self.drift_rows,
            together: scaled(self.together),
            level: scaled(self.level),
        }
    }
}

/// Covariance of what all samples of R, G and B in a frame are off together.
pub fn common(sites: &[Prediction; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&sites.map(|site| site.common).into()) + Matrix3::from_fn(|k, l| sites[k].lines.level[l])
}

/// The covariance of photosites: what each has by itself, and what those of a row and of a column share, by classes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiteCovariance {
    /// Variances of what is their own.
    pub own: [f64; 3],
    /// Covariance of two in a row, also of one class.
    pub row: Matrix3<f64>,
    /// The same in a column.
    pub column: Matrix3<f64>,
    /// What of that in a row is drift of the black level, which rows near it share in part.
    pub drift: Matrix3<f64>,
    /// Rows from one knot of the drift to the next.
    pub drift_rows: f64,
    /// Of three planes: what samples of one place share with one of another class beyond what they do by row and by column.
    pub together: Matrix3<f64>,
}

impl SiteCovariance {
    /// That of photosites that share nothing.
    pub fn independent(own: [f64; 3]) -> Self {
        let none = Matrix3::zeros();
        Self { own, row: none, column: none, drift: none, drift_rows: 0.0, together: none }
    }

    /// That of photosites of these moments.
    pub fn of(sites: &[Prediction; 3]) -> Self {
        let own = |k: usize| {
            let LineCovariance { row, column, .. } = sites[k].lines;
            let shared = row[k] + column[k];
            let variance = sites[k].moments.variance;
            if shared == 0.0 { variance } else { (variance - shared).max(0.0) }
        };
        Self {
            own: [0, 1, 2].map(own),
            row: Matrix3::from_fn(|k, l| sites[k].lines.row[l]),
            column: Matrix3::from_fn(|k, l| sites[k].lines.column[l]),
            drift: Matrix3::from_fn(|k, l| sites[k].lines.drift[l]),
            drift_rows: sites[0].lines.drift_rows,
            together: Matrix3::from_fn(|k, l| sites[k].lines.together[l]),
        }
    }

    /// Covariance of what three samples of one place have apart from rows and columns.
    pub fn own_of_planes(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.own.into()) + self.together
    }

    /// Whether photosites share nothing.
    pub fn is_independent(&self) -> bool {
        self.row == Matrix3::zeros() && self.column == Matrix3::zeros()
    }

    /// The same without the drift of the black level.
    #[must_use]
    pub fn without_drift(&self) -> Self {
        Self { row: self.row - self.drift, drift: Matrix3::zeros(), ..*self }
    }

    /// Whether rows share the drift of the black level.
    pub fn drifts(&self) -> bool {
        self.drift != Matrix3::zeros()
    }

    /// What photosites share beyond themselves: in a row and in a column.
    pub fn lines(&self) -> [&Matrix3<f64>; 2] {
        [&self.row, &self.column]
    }
}
