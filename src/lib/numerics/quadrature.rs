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

/// The points and weights that integrate from the first of some ascending `knots` to the last, exactly where the integrand
/// is a polynomial of degree 5 or less between neighbors: the rule of Gauss with three points.
///
/// # Examples
///
/// ```
/// use cyanometer::numerics::quadrature::between;
///
/// // ∫₀³ |x − 1|⁵ dx = (1 + 2⁶)/6, with the kink at a knot.
/// let (points, weights) = between(&[0.0, 1.0, 3.0]);
/// let sum: f64 = points.iter().zip(weights).map(|(x, w)| w * (x - 1.0).abs().powi(5)).sum();
/// assert!((sum - 65.0 / 6.0).abs() < 1e-14);
/// ```
pub fn between(knots: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let outer = 0.6_f64.sqrt();
    let of_piece = |pair: &[f64]| {
        let (center, half) = (f64::midpoint(pair[0], pair[1]), (pair[1] - pair[0]) / 2.0);
        [(-outer, 5.0 / 9.0), (0.0, 8.0 / 9.0), (outer, 5.0 / 9.0)].map(|(x, w)| (center + half * x, half * w))
    };
    knots.windows(2).flat_map(of_piece).unzip()
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
}
