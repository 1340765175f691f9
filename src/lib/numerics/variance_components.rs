//! Variances that rows, columns and single places of a table add, apart from each other, with intervals that hold.
//!
//! x_rc = μ + ρ_r + γ_c + ε_rc. In a table of R rows and C columns the mean squares of the analysis of variance expect
//!
//! - rows: C Σ (x̄_r − x̄)²/(R − 1), σ_ε² + C σ_ρ²
//! - columns: R Σ (x̄_c − x̄)²/(C − 1), σ_ε² + R σ_γ²
//! - what is left: σ_ε²
//!
//! and each, where the three are normal, is distributed as its expectation times χ²/ν, independently of the others
//! \[Searle1992]. A linear combination of mean squares has the interval of \[TingEtAl1990], the modified large-sample one,
//! without its small cross terms.
//!
//! Where the places are no normal sample, a mean square scatters by more: by 2 value²/ν + κ₄/n, κ₄ the fourth cumulant of a place and n
//! as many as there are \[ONeill2014]. It is taken for one of normal places of as much freedom as has that scatter.

use super::quantiles;

/// A mean square: an estimate of a variance whose distribution is known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeanSquare {
    /// Its value.
    pub value: f64,
    /// Degrees of freedom ν: its variance is 2 value²/ν.
    pub freedom: f64,
}

impl MeanSquare {
    /// What it scatters by, a variance.
    pub fn variance(&self) -> f64 {
        if self.freedom > 0.0 { 2.0 * self.value * self.value / self.freedom } else { 0.0 }
    }

    /// The same of `count` places whose fourth cumulant is such; of tails that are shorter than normal it is as it was.
    #[must_use]
    pub fn with_tails(self, cumulant: f64, count: f64) -> Self {
        let (square, more) = (2.0 * self.value * self.value, cumulant.max(0.0) / count);
        if more > 0.0 && square > 0.0 {
            return Self { freedom: square / (square / self.freedom + more), ..self };
        }
        self
    }
}

/// The mean squares of a table, or of several tables alike that were drawn apart.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeanSquares {
    /// Of the means of rows.
    pub rows: MeanSquare,
    /// Of the means of columns.
    pub columns: MeanSquare,
    /// Of what is left.
    pub rest: MeanSquare,
}

/// Sums of squares of one or several tables of one size.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SquareSums {
    /// Σ (x − x̄)² over all places.
    pub all: f64,
    /// C Σ (x̄_r − x̄)².
    pub rows: f64,
    /// R Σ (x̄_c − x̄)².
    pub columns: f64,
}

impl MeanSquares {
    /// Each as [`MeanSquare::with_tails`] has it.
    #[must_use]
    pub fn with_tails(self, cumulant: f64, count: f64) -> Self {
        let [rows, columns, rest] =
            [self.rows, self.columns, self.rest].map(|square| square.with_tails(cumulant, count));
        Self { rows, columns, rest }
    }

    /// Of tables of so many rows and columns, from sums over all of them; `tables` are as many as have means of their own.
    pub fn of(sums: SquareSums, [columns, rows]: [usize; 2], tables: f64) -> Self {
        let [c, r] = [columns as f64, rows as f64];
        let square =
            |sum: f64, freedom: f64| MeanSquare { value: sum.max(0.0) / (tables * freedom), freedom: tables * freedom };
        Self {
            rows: square(sums.rows, r - 1.0),
            columns: square(sums.columns, c - 1.0),
            rest: square(sums.all - sums.rows - sums.columns, (r - 1.0) * (c - 1.0)),
        }
    }
}

/// A number, and what it lies between with the stated confidence.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// The lower end.
    pub low: f64,
    /// The upper end.
    pub high: f64,
}

impl Interval {
    /// A normal estimate of such variance, at such confidence.
    pub fn normal(value: f64, variance: f64, confidence: f64) -> Self {
        let reach = quantiles::of_normal(f64::midpoint(1.0, confidence)) * variance.max(0.0).sqrt();
        Self { value, low: value - reach, high: value + reach }
    }

    /// The interval of a rising function of the number.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self { value: f(self.value), low: f(self.low), high: f(self.high) }
    }

    /// The interval of the quotient θ = a/b of this number and another, whose errors have such a correlation ρ: of the θ at which the interval of
    /// a − θ b, √(δ_a² + θ² δ_b² − 2 ρ θ δ_a δ_b) to either side, ends at 0, with δ the distances of the ends of both numbers \[DonnerZou2012].
    /// Of normal numbers that is the interval of Fieller. Of a divisor that is not told from 0 it is that of small errors.
    #[must_use]
    pub fn over(self, by: Self, correlation: f64) -> Self {
        let (a, b) = (self.value, by.value);
        if a < 0.0 {
            let Self { value, low, high } = Self { value: -a, low: -self.high, high: -self.low }.over(by, -correlation);
            return Self { value: -value, low: -high, high: -low };
        }
        let end = |of_a: f64, of_b: f64, sign: f64| {
            let rest = b * b - of_b * of_b;
            if by.low <= 0.0 || rest <= 0.0 {
                let [own, other] = [of_a / b, a / b * of_b / b].map(f64::abs);
                return a / b + sign * (own * own + other * other - 2.0 * correlation * own * other).max(0.0).sqrt();
            }
            let middle = a * b - correlation * of_a * of_b;
            (middle + sign * (middle * middle - (a * a - of_a * of_a) * rest).max(0.0).sqrt()) / rest
        };
        Self { value: a / b, low: end(a - self.low, by.high - b, -1.0), high: end(self.high - a, b - by.low, 1.0) }
    }

    /// The interval of the root of a variance, none of it below 0: of an estimate below 0 that of 0, which reaches as far up, as a variance
    /// that chance has below 0 is not known to be none.
    #[must_use]
    pub fn root(self) -> Self {
        let above = if self.value < 0.0 { Self { high: self.high - self.value, ..self } } else { self };
        above.map(|variance| variance.max(0.0).sqrt())
    }
}

/// The interval of Σ c·MS over independent mean squares, two-sided.
pub fn combination(terms: &[(f64, MeanSquare)], confidence: f64) -> Interval {
    let tail = (1.0 - confidence) / 2.0;
    let value = terms.iter().map(|(c, square)| c * square.value).sum();
    let (mut below, mut above) = (0.0, 0.0);
    for (c, MeanSquare { value, freedom }) in terms.iter().filter(|(_, square)| square.freedom > 0.0) {
        let down = 1.0 - freedom / quantiles::of_chi_square(1.0 - tail, *freedom);
        let up = freedom / quantiles::of_chi_square(tail, *freedom) - 1.0;
        let [down, up] = if *c > 0.0 { [down, up] } else { [up, down] };
        below += (c * value * down).powi(2);
        above += (c * value * up).powi(2);
    }
    let value: f64 = value;
    Interval { value, low: value - below.sqrt(), high: value + above.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table worked out by hand: rows 1 and 3 apart, columns by 2, nothing left.
    #[test]
    fn sums_of_squares_part_rows_from_columns() {
        // 1 3 5 / 5 7 9: x̄ = 5, rows 3 and 7, columns 3, 5 and 7.
        let sums = SquareSums { all: 40.0, rows: 3.0 * 8.0, columns: 2.0 * 8.0 };
        let squares = MeanSquares::of(sums, [3, 2], 1.0);
        assert_eq!(squares.rows, MeanSquare { value: 24.0, freedom: 1.0 });
        assert_eq!(squares.columns, MeanSquare { value: 8.0, freedom: 2.0 });
        assert_eq!(squares.rest, MeanSquare { value: 0.0, freedom: 2.0 });
    }

    /// Of 100 exponential places of mean 1, κ₄ = 6: the variance of a variance is about 8/100, that of 25 normal ones.
    #[test]
    fn tails_take_freedom() {
        let found = MeanSquare { value: 1.0, freedom: 100.0 }.with_tails(6.0, 100.0);
        assert!((found.freedom - 25.0).abs() < 1e-12);
        let short = MeanSquare { value: 1.0, freedom: 100.0 }.with_tails(-1.2, 100.0);
        assert_eq!(short.freedom, 100.0);
    }

    /// A variance of −3 to −1 about −2 is one of 0 to 1: chance has it below 0, and does not make it none.
    #[test]
    fn roots_of_variances_below_none_are_no_points() {
        let below = Interval { value: -2.0, low: -3.0, high: -1.0 };
        assert_eq!(below.root(), Interval { value: 0.0, low: 0.0, high: 1.0 });
        let above = Interval { value: 4.0, low: -1.0, high: 9.0 };
        assert_eq!(above.root(), Interval { value: 2.0, low: 0.0, high: 3.0 });
    }

    /// Of 10 ± 2 over 5 ± 1: 24 θ² − 100 θ + 96 = 0 at 1.5 and 8/3; of errors that are half alike 24 θ² − 98 θ + 96 = 0; of a divisor that is known the
    /// ends over that.
    #[test]
    fn quotients_end_where_differences_are_none() {
        let [a, b] = [Interval { value: 10.0, low: 8.0, high: 12.0 }, Interval { value: 5.0, low: 4.0, high: 6.0 }];
        let apart = a.over(b, 0.0);
        assert!((apart.low - 1.5).abs() < 1e-12 && (apart.high - 8.0 / 3.0).abs() < 1e-12, "{apart:?}");
        let alike = a.over(b, 0.5);
        let root = f64::sqrt(98.0 * 98.0 - 4.0 * 24.0 * 96.0);
        assert!((alike.low - (98.0 - root) / 48.0).abs() < 1e-12, "{alike:?}");
        assert!((alike.high - (98.0 + root) / 48.0).abs() < 1e-12, "{alike:?}");
        let below = Interval { value: -10.0, low: -12.0, high: -8.0 }.over(b, 0.0);
        assert!((below.low + 8.0 / 3.0).abs() < 1e-12 && (below.high + 1.5).abs() < 1e-12, "{below:?}");
        let known = a.over(Interval { value: 5.0, low: 5.0, high: 5.0 }, 0.3);
        assert!((known.low - 1.6).abs() < 1e-12 && (known.high - 2.4).abs() < 1e-12, "{known:?}");
        let untold = a.over(Interval { value: 1.0, low: -1.0, high: 3.0 }, 0.0);
        assert!((untold.high - 10.0 - f64::hypot(2.0, 20.0)).abs() < 1e-12, "{untold:?}");
    }

    /// The interval of a single mean square is that of χ²: of 10 degrees of freedom, 10/20.4831 to 10/3.24697 times it.
    #[test]
    fn one_mean_square_has_the_interval_of_chi_square() {
        let found = combination(&[(1.0, MeanSquare { value: 1.0, freedom: 10.0 })], 0.95);
        assert!((found.low - 10.0 / 20.4831).abs() < 1e-5 && (found.high - 10.0 / 3.24697).abs() < 1e-4, "{found:?}");
    }
}
