//! How straight the response to light is \[EMVA1288, Sec. 7].
//!
//! A line is fitted to y = μ − μ_d against light between 5 and 95 % of saturation so that relative deviations count alike, weights
//! 1/y²; the deviations are δ = (y − line)/line.

use super::fit::{Line, Point};
use crate::numerics::quantiles;
use crate::numerics::variance_components::Interval;

/// From this share of saturation to that the line is fitted [EMVA1288, Sec. 7.2].
pub const RANGE: [f64; 2] = [0.05, 0.95];

/// A level: light, signal, and what the signal scatters by, a variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Photons, or seconds.
    pub light: f64,
    /// Mean above no light.
    pub signal: f64,
    /// Its variance.
    pub variance: f64,
}

/// Deviations from the line.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearity {
    /// The line.
    pub line: Line,
    /// Light and relative deviation of each level of the range.
    pub deviations: Vec<[f64; 2]>,
    /// The least and the largest deviation; each interval holds for whichever level is the extreme one.
    pub extremes: [Interval; 2],
}

/// The linearity of levels whose `saturation` is known; none where fewer than three lie in the range.
pub fn linearity(levels: &[Response], saturation: f64, confidence: f64) -> Option<Linearity> {
    let range = RANGE.map(|share| share * saturation);
    let within: Vec<&Response> = levels
        .iter()
        .filter(|level| level.signal >= range[0] && level.signal <= range[1] && level.light > 0.0)
        .collect();
    if within.len() < 3 {
        return None;
    }
    let point = |level: &&Response| Point { x: level.light, y: level.signal, weight: level.signal.powi(-2) };
    let line = Line::through(within.iter().map(point).collect::<Vec<_>>())?;
    let deviations: Vec<[f64; 2]> =
        within.iter().map(|level| [level.light, level.signal / line.at(level.light) - 1.0]).collect();
    // Any of the levels may be the extreme one by chance.
    let each = 1.0 - (1.0 - confidence) / within.len() as f64;
    let reach = quantiles::of_normal(f64::midpoint(1.0, each));
    let extreme = |sign: f64| {
        let largest = |shift: f64| {
            let of = |(level, [_, deviation]): (&&Response, &[f64; 2])| {
                sign * deviation + shift * reach * level.variance.sqrt() / line.at(level.light)
            };
            within.iter().zip(&deviations).map(of).fold(f64::NEG_INFINITY, f64::max)
        };
        let [low, value, high] = [-1.0, 0.0, 1.0].map(largest);
        if sign > 0.0 { Interval { value, low, high } } else { Interval { value: -value, low: -high, high: -low } }
    };
    Some(Linearity { line, extremes: [extreme(-1.0), extreme(1.0)], deviations })
}
