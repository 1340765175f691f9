//! What is drawn anew in each exposure at photosites that are unlike each other, and what averages keep of it.

use super::masters::kept;
use super::moments::{LineCovariance, Prediction};
use crate::metadata::AverageRecord;
use crate::numerics::averages::CLIP;

/// What is drawn anew in each exposure at the photosites of a class, in units of their samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Temporal {
    /// E v, mean over photosites of the variance over exposures.
    pub variance: f64,
    /// What rounding is of it.
    pub rounding: f64,
    /// How photosites differ; none where it is not known.
    pub unlike: Option<Unlike>,
    /// Third and fourth cumulant of one exposure over photosites, before anything came off.
    pub single: [f64; 2],
    /// What photosites of rows and of columns share of it.
    pub lines: LineCovariance,
}

/// How what is drawn anew differs from a normal law, and from photosite to photosite.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Unlike {
    /// E k₃ and E k₄.
    pub cumulants: [f64; 2],
    /// Var v.
    pub spread: f64,
    /// cov(v, m), κ(v, m, m) and cov(k₃, m).
    pub with_mean: [f64; 3],
    /// κ₃(m) and κ₄(m); none where they are not known but of one exposure.
    pub of_means: Option<[f64; 2]>,
}

/// Sums over photosites that [`Unlike`] follows from.
#[derive(Debug, Default)]
pub(super) struct UnlikeSums {
    weight: f64,
    /// Of m, v, k₃, k₄, v², v m, v m², m², k₃ m, m³ and m⁴.
    sums: [f64; 11],
}

impl UnlikeSums {
    /// Takes in photosites of such a share, the mean about some center.
    pub fn add(&mut self, weight: f64, [m, v, k3, k4]: [f64; 4]) {
        self.weight += weight;
        let values = [m, v, k3, k4, v * v, v * m, v * m * m, m * m, k3 * m, m.powi(3), m.powi(4)];
        self.sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
    }

    /// E v and what is known besides.
    pub fn found(&self) -> (f64, Unlike) {
        let [m, v, k3, k4, vv, vm, vmm, mm, km, m3, m4] = self.sums.map(|sum| sum / self.weight);
        let of_variance_and_mean = vm - v * m;
        let of_means = Prediction::about(0.0, &[m, mm, m3, m4]);
        let unlike = Unlike {
            cumulants: [k3, k4],
            spread: (vv - v * v).max(0.0),
            with_mean: [of_variance_and_mean, vmm - 2.0 * m * vm - v * mm + 2.0 * v * m * m, km - k3 * m],
            of_means: Some([of_means.third, of_means.fourth()]),
        };
        (v, unlike)
    }
}

impl Unlike {
    /// The same of samples that are so many times as large.
    pub(super) fn scaled(self, factor: f64) -> Self {
        let [third, fourth] = self.cumulants;
        let [vm, vmm, km] = self.with_mean;
        let (cube, square) = (factor.powi(3), factor.powi(4));
        Self {
            cumulants: [third * cube, fourth * square],
            spread: self.spread * square,
            with_mean: [vm * cube, vmm * square, km * square],
            of_means: self.of_means.map(|[third, fourth]| [third * cube, fourth * square]),
        }
    }
}

impl Temporal {
    /// The law of the average of exposures over photosites of which one exposure has the law `one`.
    pub(super) fn averaged(&self, one: &Prediction, record: &AverageRecord) -> Prediction {
        let before = (self.variance - self.rounding).max(0.0);
        let std_codes = if self.rounding > 0.0 { (before / (12.0 * self.rounding)).sqrt() } else { f64::INFINITY };
        let kept = kept(record.combine, record.frames, record.clip.unwrap_or(CLIP), std_codes.min(16.0));
        let k = kept.variance;
        let variance = one.moments.variance - self.variance + k * before + kept.rounding * self.rounding;
        let unlike = self.unlike.unwrap_or_default();
        let Unlike { cumulants: [third, fourth], spread, with_mean: [vm, vmm, km], of_means } = unlike;
        let lean = if before > 0.0 { third / (6.0 * before) * kept.lean } else { 0.0 };
        let (of_third, of_fourth) = match of_means {
            // What came off adds what it has beside one exposure.
            Some([of_m3, of_m4]) => (
                one.third - self.single[0] + of_m3 + 3.0 * vm * k + third * k * k,
                one.fourth() - self.single[1]
                    + of_m4
                    + 6.0 * vmm * k
                    + (4.0 * km + 3.0 * spread) * k * k
                    + fourth * k.powi(3),
            ),
            None => (
                one.third - 3.0 * vm * (1.0 - k) - third * (1.0 - k * k),
                one.fourth()
                    - 6.0 * vmm * (1.0 - k)
                    - (4.0 * km + 3.0 * spread) * (1.0 - k * k)
                    - fourth * (1.0 - k.powi(3)),
            ),
        };
        // No law has less.
        let of_fourth = of_fourth.max(-2.0 * variance * variance);
        let found = Prediction::of_cumulants(one.moments.mean + lean, variance.max(0.0), of_third, of_fourth);
        let less = |whole: [f64; 3], temporal: [f64; 3]| [0, 1, 2].map(|l| whole[l] - (1.0 - k) * temporal[l]);
        let lines = LineCovariance {
            row: less(one.lines.row, self.lines.row),
            column: less(one.lines.column, self.lines.column),
            drift: less(one.lines.drift, self.lines.drift),
            drift_rows: one.lines.drift_rows,
            together: one.lines.together,
            level: one.lines.level,
        };
        // Sixth cumulants mark photosites that are unlike each other.
        Prediction { sixth: one.sixth, common: one.common, lines, ..found }
    }

    /// Photosites whose samples, in one exposure, scatter (N − 1) times as much in variance as s² of N exposures does, about a
    /// mean of none.
    pub(super) fn of_variances(&self, frames: u32) -> Prediction {
        let n = f64::from(frames);
        let Unlike { cumulants: [third, fourth], spread, .. } = self.unlike.unwrap_or_default();
        // What is drawn anew has no less than −2 v² of its own.
        let least = -2.0 * (self.variance * self.variance + spread);
        let excess = (n - 1.0) * (fourth.max(least) / n + spread * (1.0 + 2.0 / (n - 1.0)));
        Prediction { lines: self.lines, ..Prediction::of_cumulants(0.0, self.variance, third, excess) }
    }
}
