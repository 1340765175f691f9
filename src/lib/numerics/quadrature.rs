//! Weights of a sum that stands for an integral over an even grid.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// How an integral is approximated by a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// Every point counts alike: Eq. 5a of \[HP2005].
    #[default]
    Rectangle,
    /// The end points count half.
    Trapezoid,
    /// Composite Simpson rule, 1 4 2 4 … 2 4 1 thirds.
    Simpson,
}

/// The weights of `points` points a distance `step` apart.
///
/// # Errors
///
/// [`Error::Usage`] when Simpson's rule is asked for an even number of points: it needs pairs of intervals.
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
