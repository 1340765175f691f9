//! Weights of a sum that stands for an integral over an even grid.

use crate::error::{Error, Result};
use crate::names::{Named, serde_by_name};

/// How an integral is approximated by a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// Every point counts alike: Eq. 5a of \[HP2005].
    #[default]
    Rectangle,
    /// The end points count half.
    Trapezoid,
    /// Composite Simpson rule, 1 4 2 4 … 2 4 1 thirds.
    Simpson,
}

impl Named for Rule {
    const ALL: &'static [Self] = &[Self::Rectangle, Self::Trapezoid, Self::Simpson];

    fn name(self) -> &'static str {
        match self {
            Self::Rectangle => "rectangle",
            Self::Trapezoid => "trapezoid",
            Self::Simpson => "simpson",
        }
    }
}

serde_by_name!(Rule);

/// The weights of `points` points a distance `step` apart.
///
/// # Errors
///
/// [`Error::Usage`] when Simpson's rule is asked for an even number of points: it needs pairs of intervals.
///
/// # Examples
///
/// ```
/// use cyanometer::numerics::quadrature::{Rule, weights};
///
/// // Simpson's rule is exact for cubics: ∫₀² x³ dx = 4.
/// let sum: f64 = weights(Rule::Simpson, 5, 0.5)?.iter().zip(0..).map(|(w, i)| w * (0.5 * f64::from(i)).powi(3)).sum();
/// assert!((sum - 4.0).abs() < 1e-15);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub fn weights(rule: Rule, points: usize, step: f64) -> Result<Vec<f64>> {
    let mut weights = vec![step; points];
    match rule {
        Rule::Rectangle => {}
        Rule::Trapezoid if points > 1 => {
            weights[0] = step / 2.0;
            weights[points - 1] = step / 2.0;
        }
        Rule::Simpson if points > 1 => {
            if points.is_multiple_of(2) {
                return Err(Error::Usage(format!(
                    "Simpson's rule needs an odd number of wavelengths, not {points}; change the end or the step, or \
                     use the trapezoid rule"
                )));
            }
            for (index, weight) in weights.iter_mut().enumerate() {
                let thirds = if index == 0 || index == points - 1 { 1.0 } else { 2.0 + 2.0 * (index % 2) as f64 };
                *weight = step * thirds / 3.0;
            }
        }
        Rule::Trapezoid | Rule::Simpson => {}
    }
    Ok(weights)
}

impl Rule {
    /// The power of the step that the error of a sum goes by, for a smooth integrand: 1 for the rectangle, whose ends
    /// count whole, 2 for the trapezoid, 4 for Simpson's rule.
    pub fn order(self) -> i32 {
        match self {
            Self::Rectangle => 1,
            Self::Trapezoid => 2,
            Self::Simpson => 4,
        }
    }

    /// Whether the rule also fits every second of so many points.
    pub fn can_double(self, points: usize) -> bool {
        let intervals = points.saturating_sub(1);
        let divisor = if self == Self::Simpson { 4 } else { 2 };
        intervals > 0 && intervals.is_multiple_of(divisor)
    }

    /// Estimate of the relative error of a sum at one step, from that at twice the step \[Richardson1911].
    ///
    /// |I_h − I| / |I_h| ≈ |I_h − I_2h| / ((2ᵖ − 1) |I_h|)        p of [`Self::order`]
    ///
    /// Where the integrand vanishes at both ends the rectangle is as good as the trapezoid, and the estimate three times
    /// too large. None where the sum is zero and the other is not.
    pub fn relative_error(self, fine: f64, coarse: f64) -> Option<f64> {
        let error = (fine - coarse).abs() / (2_f64.powi(self.order()) - 1.0);
        if error == 0.0 { Some(0.0) } else { Some(error / fine.abs()).filter(|error| error.is_finite()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simpson_is_exact_for_cubics_and_the_trapezoid_for_lines() {
        let integral = |rule, power: i32| -> f64 {
            weights(rule, 11, 0.1).unwrap().iter().enumerate().map(|(i, w)| w * (i as f64 * 0.1).powi(power)).sum()
        };
        assert!((integral(Rule::Simpson, 3) - 0.25).abs() < 1e-15);
        assert!((integral(Rule::Trapezoid, 1) - 0.5).abs() < 1e-15);
        assert!((integral(Rule::Rectangle, 0) - 1.1).abs() < 1e-15);
        assert!(weights(Rule::Simpson, 10, 0.1).is_err());
    }

    /// For ∫₀¹ eˣ dx the leading term of the error is all but the whole of it: the next is smaller by about h, h² and h².
    #[test]
    fn step_doubling_tells_the_error() {
        let sum = |rule, points: usize| -> f64 {
            let step = 1.0 / (points - 1) as f64;
            weights(rule, points, step).unwrap().iter().enumerate().map(|(i, w)| w * (i as f64 * step).exp()).sum()
        };
        let exact = 1.0_f64.exp_m1();
        for (rule, points) in [(Rule::Rectangle, 201), (Rule::Trapezoid, 41), (Rule::Simpson, 41)] {
            assert!(rule.can_double(points));
            let (fine, coarse) = (sum(rule, points), sum(rule, points.div_ceil(2)));
            let (estimate, error) = (rule.relative_error(fine, coarse).unwrap(), (fine / exact - 1.0).abs());
            assert!((estimate / error - 1.0).abs() < 0.01, "{rule:?}: {estimate:e} {error:e}");
        }
        let doubling =
            [1, 2, 3, 4, 5].map(|points| [Rule::Rectangle, Rule::Simpson].map(|rule| rule.can_double(points)));
        assert_eq!(doubling, [[false; 2], [false; 2], [true, false], [false; 2], [true; 2]]);
        assert_eq!(
            (Rule::Rectangle.relative_error(0.0, 0.0), Rule::Rectangle.relative_error(0.0, 1.0)),
            (Some(0.0), None)
        );
    }
}
