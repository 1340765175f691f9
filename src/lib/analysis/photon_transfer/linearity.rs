//! How straight the response to light is \[EMVA1288, Sec. 7].
//!
//! A line is fitted to y = μ − μ_d against light between 5 and 95 % of saturation so that relative deviations count alike, weights
//! 1/y²; the deviations are δ = (y − line)/line.
//!
//! What the light of levels is uncertain by shows in how y departs from the straight line between its two neighbors, which a response
//! that bends smoothly hardly does \[Gasser1986]: the relative variance that all y have besides their own is that which makes the sum
//! of the squares of these residuals, over what they expect, as large as there are. Of n residuals it is known as well as a variance of
//! 18/35 n values.

use super::fit::{Line, Point, variance_besides};
use super::scatter::Component;
use crate::numerics::variance_components::Interval;
use crate::numerics::{quantiles, significance};

/// From this share of saturation to that the line is fitted [EMVA1288, Sec. 7.2].
pub const RANGE: [f64; 2] = [0.05, 0.95];

/// A level: light, signal, and what the signal scatters by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Photons, or seconds.
    pub light: f64,
    /// Mean above no light.
    pub signal: f64,
    /// Its variance, part by part.
    pub variance: [Component; 3],
    /// The relative variance of its light.
    pub light_variance: Component,
}

impl Response {
    /// What it scatters by, and that of light beside.
    fn scatter(&self, among: Component) -> Component {
        let [noise, black, levels] = self.variance;
        let square = self.signal * self.signal;
        Component::sum(&[noise, black, levels, self.light_variance.times(square), among.times(square)])
    }
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
    /// What is to be said of light that scatters from level to level, and whether it is a doubt.
    pub told: Option<(String, bool)>,
}

/// The linearity of levels whose `saturation` is known; none where fewer than three lie in the range.
pub fn linearity(levels: &[Response], saturation: f64, confidence: f64) -> Option<Linearity> {
    let range = RANGE.map(|share| share * saturation);
    let mut within: Vec<&Response> = levels
        .iter()
        .filter(|level| level.signal >= range[0] && level.signal <= range[1] && level.light > 0.0)
        .collect();
    if within.len() < 3 {
        return None;
    }
    within.sort_by(|a, b| a.light.total_cmp(&b.light));
    let point = |level: &&Response| Point { x: level.light, y: level.signal, weight: level.signal.powi(-2) };
    let line = Line::through(within.iter().map(point).collect::<Vec<_>>())?;
    let deviations: Vec<[f64; 2]> =
        within.iter().map(|level| [level.light, level.signal / line.at(level.light) - 1.0]).collect();
    // Any of the levels may be the extreme one by chance.
    let each = 1.0 - (1.0 - confidence) / within.len() as f64;
    let reach = quantiles::of_normal(f64::midpoint(1.0, each));
    let (among, told) = among_levels(&within);
    let extreme = |sign: f64| {
        let largest = |shift: f64| {
            let of = |(level, [_, deviation]): (&&Response, &[f64; 2])| {
                sign * deviation + shift * reach * level.scatter(among).known(each).sqrt() / line.at(level.light)
            };
            within.iter().zip(&deviations).map(of).fold(f64::NEG_INFINITY, f64::max)
        };
        let [low, value, high] = [-1.0, 0.0, 1.0].map(largest);
        if sign > 0.0 { Interval { value, low, high } } else { Interval { value: -value, low: -high, high: -low } }
    };
    Some(Linearity { line, extremes: [extreme(-1.0), extreme(1.0)], deviations, told })
}

/// The relative variance that light has from level to level besides what frames tell, and what is to be said of it.
fn among_levels(levels: &[&Response]) -> (Component, Option<(String, bool)>) {
    /// Less likely is beyond chance.
    const LEVEL: f64 = 1e-4;
    /// So large a scatter is doubted.
    const MUCH: f64 = 1e-3;
    /// Residuals overlap: so much of a value is each.
    const APART: f64 = 18.0 / 35.0;
    /// Of one value alone nothing would be known of the variance.
    const LEAST: f64 = 2.0;
    let residual = |three: &[&Response], share: f64| {
        let [before, level, after] = [three[0], three[1], three[2]];
        let width = after.light - before.light;
        let of_before = if width > 0.0 { (after.light - level.light) / width } else { 0.5 };
        let of_after = 1.0 - of_before;
        let missed = of_before * before.signal + of_after * after.signal - level.signal;
        let variance = |level: &Response| level.scatter(Component { variance: share, ..Component::NONE }).variance;
        missed.powi(2) / (of_before.powi(2) * variance(before) + of_after.powi(2) * variance(after) + variance(level))
    };
    let misfit = |share: f64| levels.windows(3).map(|three| residual(three, share)).sum::<f64>();
    let residuals = levels.len() as f64 - 2.0;
    let freedom = APART * residuals;
    let among = Component { variance: variance_besides(residuals, misfit, 1.0), freedom: freedom.max(LEAST) };
    let misfit = APART * misfit(0.0);
    let is_beyond = misfit > freedom && significance::of_chi_square(misfit, freedom) < LEVEL;
    let told = is_beyond.then(|| {
        let scatter = among.variance.sqrt();
        let text = format!(
            "light, or exposure time, scatters by {:.2} % from level to level beyond what frames of a level scatter by, which the \
             intervals of the linearity errors take in",
            scatter * 100.0
        );
        (text, scatter >= MUCH)
    });
    (among, told)
}
