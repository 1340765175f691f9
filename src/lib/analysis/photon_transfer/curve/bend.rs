//! What a response that bends does to the gain.

use super::super::fit::{Line, Point, variance_besides};
use super::{Beneath, Curve, Datum, Point4};
use crate::numerics::quantiles::of_student;

/// How much of the gain a response that bends makes it miss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// A share of the gain.
    pub missed: f64,
    /// What that scatters by, as levels miss a response that bends evenly.
    pub scatter: f64,
    /// Of how many levels that is known.
    pub freedom: f64,
}

impl Bend {
    /// Whether that is beyond what light that flickers from level to level makes of it.
    pub fn is_sure(&self) -> bool {
        is_sure(self.missed, self.scatter, self.freedom)
    }
}

/// How a response bends, as the light tells: signal over light is R + R ε x, whatever the light is counted in.
pub(super) struct Curvature {
    /// The line through it.
    line: Line,
    /// What its slope scatters by.
    scatter: f64,
    freedom: f64,
    /// The light that x is a share of.
    brightest: f64,
}

/// Whether a number of such scatter, known of so many levels, is beyond chance.
fn is_sure(number: f64, scatter: f64, freedom: f64) -> bool {
    /// What is as sure is.
    const SURE: f64 = 0.999;
    number.abs() > of_student(SURE, freedom) * scatter
}

impl Curve {
    /// How much of the gain a response that bends makes it miss; none of light that is not known, nor where darks do not tell black.
    ///
    /// Where a signal is R x (1 + ε x), of shot noise alone its variance is (1 + 2 ε x)² of that of a straight response over
    /// (1 + ε x): to first order 3 ε x more at signal K n, which the line through the levels takes for gain.
    ///
    /// What rounding hides of the black level is common to all levels: of what it lets the share be the least counts.
    pub fn bend(&self) -> Option<Bend> {
        if self.are_darks_clipped {
            return None;
        }
        let bends = [-1.0, 0.0, 1.0].map(|sign| self.bend_above(sign));
        let [Some(Bend { missed: low, .. }), Some(own), Some(Bend { missed: high, .. })] = bends else { return None };
        let missed = if low * high <= 0.0 {
            0.0
        } else if low.abs() < high.abs() {
            low
        } else {
            high
        };
        Some(Bend { missed, ..own })
    }

    /// The same where black is as much more as rounding may hide, times a sign.
    fn bend_above(&self, sign: f64) -> Option<Bend> {
        let Curvature { line, scatter, freedom, brightest } = self.curvature(sign)?;
        let missed = |bend: f64| {
            let at = |(place, &flat): (usize, &usize)| {
                let (x, signal) = (self.light(flat).unwrap_or(0.0) / brightest, self.above_black(flat, sign));
                let of_dark = self.charge_of_noise(flat) - self.signal(flat);
                Point { x: signal + of_dark, y: 3.0 * bend * x * signal, weight: self.weights.gain[place] }
            };
            let points: Vec<Point> = self.fitted.iter().enumerate().map(at).collect();
            let line = if self.is_offset_free { Line::through(points) } else { Line::through_zero(points) };
            line.map(|line| line.slope)
        };
        let scatter = missed(scatter / line.offset)?.abs();
        Some(Bend { missed: missed(line.slope / line.offset)?, scatter, freedom })
    }

    /// Photons, or the exposure time.
    fn light(&self, flat: usize) -> Option<f64> {
        self.flats[flat].photons.map(|photons| photons.value).or(self.flats[flat].exposure_s)
    }

    /// Mean above no light, where black is as much more as rounding may hide, times a sign.
    fn above_black(&self, flat: usize, sign: f64) -> f64 {
        self.signal(flat) - sign * self.hidden_beneath(flat)
    }

    /// The bend that the light tells; none of light that is not known.
    pub(super) fn curvature(&self, sign: f64) -> Option<Curvature> {
        let known: Vec<usize> =
            self.fitted.iter().copied().filter(|&flat| self.beneath[flat] != Beneath::Unknown).collect();
        let brightest = known.iter().filter_map(|&flat| self.light(flat)).fold(0.0, f64::max);
        let points = |share: f64| -> Option<Vec<Point>> {
            let point = |&flat: &usize| {
                let (x, signal) = (self.light(flat)? / brightest, self.above_black(flat, sign));
                let variance = self.signal_variance(flat) + share * signal * signal;
                (x > 0.0).then(|| Point { x, y: signal / x, weight: x * x / variance.max(f64::MIN_POSITIVE) })
            };
            known.iter().map(point).collect()
        };
        let misfit = |share: f64| {
            let points = points(share).unwrap_or_default();
            Line::through(points.clone()).map_or(0.0, |line| line.chi_square(points))
        };
        let freedom = points(0.0)?.len() as f64 - 2.0;
        if freedom < 1.0 {
            return None;
        }
        let points = points(variance_besides(freedom, misfit, 1.0))?;
        let line = Line::through(points.clone())?;
        let all: f64 = points.iter().map(|point| point.weight).sum();
        let middle = points.iter().map(|point| point.weight * point.x).sum::<f64>() / all;
        let spread: f64 = points.iter().map(|point| point.weight * (point.x - middle).powi(2)).sum();
        Some(Curvature { line, scatter: spread.sqrt().recip(), freedom, brightest })
    }

    /// The same curve with the darks that a response has which does not bend; none where the light does not tell surely that this does.
    ///
    /// A signal y = u (1 + c u) has the straight part u = 2 y/(1 + √(1 + 4 c y)).
    pub(super) fn straightened(&self) -> Option<Self> {
        let Curvature { line, scatter, freedom, .. } = self.curvature(0.0)?;
        if !is_sure(line.slope, scatter, freedom) {
            return None;
        }
        let ([means, _], bend) = (self.dark_lines()?, line.slope / line.offset.powi(2));
        let straight = |dark: &Point4| {
            let signal = dark.mean.value - means.offset;
            let value = 2.0 * signal / (1.0 + (1.0 + 4.0 * bend * signal).max(0.0).sqrt());
            Point4 { mean: Datum { value, ..dark.mean }, ..dark.clone() }
        };
        Some(Self { darks: self.darks.iter().map(straight).collect(), ..self.clone() })
    }
}
