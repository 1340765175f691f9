//! Rows or columns of the masked photosites of a frame: what each is off by, and what lines have in common.

use crate::frame::to_sample;
use crate::numerics::averages::{Combine, average, clipped_variance};
use crate::numerics::robust::{NORMAL_MEDIAN, median};
use std::f64::consts::{FRAC_PI_2, SQRT_2};

/// Standard deviations that no border is off by.
pub(super) const Z: f64 = 8.0;

/// Standard deviations beyond which photosites of the border do not count: hot ones, and those that light leaks into.
pub(super) const CLIP: f64 = 4.0;

/// Lines of photosites, by the place of what tells them in an origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    /// Told by x.
    Columns,
    /// Told by y.
    Rows,
}

impl Axis {
    /// In the order of places.
    pub(super) const BOTH: [Self; 2] = [Self::Columns, Self::Rows];

    /// The word for several.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Columns => "columns",
            Self::Rows => "rows",
        }
    }
}

/// What lines are off by: the mean of what lies within [`CLIP`] standard deviations of their median; none of an empty one. The deviation
/// is that of the photosites of all lines about the medians of theirs: of few photosites none lies far out by its own, which a hot one
/// makes.
pub(super) fn offs_of(lines: &[Vec<f32>]) -> Vec<Option<f64>> {
    let median = |line: &Vec<f32>| (!line.is_empty()).then(|| average(Combine::Median, &mut line.clone(), CLIP).0);
    let medians: Vec<Option<f64>> = lines.iter().map(median).collect();
    let reach = CLIP * scatter(&mut left_of(lines, &medians), medians.iter().flatten().count()).sqrt();
    let off = |(line, median): (&Vec<f32>, &Option<f64>)| {
        let median = (*median)?;
        let near: Vec<f64> =
            line.iter().map(|sample| f64::from(*sample)).filter(|sample| (sample - median).abs() <= reach).collect();
        Some(if near.is_empty() { median } else { near.iter().sum::<f64>() / near.len() as f64 })
    };
    lines.iter().zip(&medians).map(off).collect()
}

/// The variance of masked photosites about what so many lines are off.
pub(super) fn scatter(left: &mut [f32], lines: usize) -> f64 {
    let degrees = left.len().saturating_sub(lines).max(1) as f64 / left.len().max(1) as f64;
    clipped_variance(left, CLIP) / degrees
}

/// What lines of samples are off less what each is off.
pub(super) fn left_of(lines: &[Vec<f32>], offs: &[Option<f64>]) -> Vec<f32> {
    let above = |(line, off): (&Vec<f32>, &Option<f64>)| -> Vec<f32> {
        line.iter().map(|sample| to_sample(f64::from(*sample) - off.unwrap_or_default())).collect()
    };
    lines.iter().zip(offs).flat_map(above).collect()
}

/// The variance that the photosites of a line have in common, by the analysis of variance of lines of n of N photosites in all, which
/// scatter by σ² within: E Σ n (x̄ − x̄₀)² = (lines − 1) σ² + (N − Σ n²/N) times it \[Searle1992].
pub(super) fn variance_of_lines(lines: &[Vec<f32>]) -> f64 {
    let offs = offs_of(lines);
    let told: Vec<[f64; 2]> =
        lines.iter().zip(&offs).filter_map(|(line, off)| Some([line.len() as f64, (*off)?])).collect();
    let within = scatter(&mut left_of(lines, &offs), told.len());
    let [all, squares, sum] =
        told.iter().fold([0.0; 3], |[all, squares, sum], [n, off]| [all + n, squares + n * n, sum + n * off]);
    let between: f64 = told.iter().map(|[n, off]| n * (off - sum / all).powi(2)).sum();
    let freedom = all - squares / all;
    if freedom > 0.0 { ((between - (told.len() as f64 - 1.0) * within) / freedom).max(0.0) } else { 0.0 }
}

/// By how much the mean of a border is not that of most of its lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lean {
    pub axis: Axis,
    /// The median over photosites of the means of their lines, above the mean of all, ADU.
    pub median: f64,
    /// Its standard deviation, by what lines differ by from the next, which a lit part leaves alone.
    pub deviation: f64,
}

impl Lean {
    /// That of lines of samples above the mean of all; none of fewer than two.
    pub(super) fn of(axis: Axis, lines: &[Vec<f32>]) -> Option<Self> {
        let told = || lines.iter().zip(offs_of(lines)).filter_map(|(line, off)| Some((line.len(), off?)));
        let offs: Vec<f64> = told().map(|(_, off)| off).collect();
        let mut steps: Vec<f64> = offs.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        if steps.is_empty() {
            return None;
        }
        let of_line = median(&mut steps) / (SQRT_2 * NORMAL_MEDIAN);
        let mut by_photosite: Vec<f64> = told().flat_map(|(count, off)| std::iter::repeat_n(off, count)).collect();
        let deviation = of_line * (FRAC_PI_2 / offs.len() as f64).sqrt();
        Some(Self { axis, median: median(&mut by_photosite), deviation })
    }

    /// The one of two that tells more.
    pub(super) fn larger(self, other: Self) -> Self {
        let beyond = |lean: &Self| lean.median.abs() - Z * lean.deviation;
        if beyond(&self) < beyond(&other) { other } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::gaussian::quantile;

    /// One hot photosite among eight of a line; lines without any.
    #[test]
    fn a_hot_photosite_moves_no_line() {
        let noise = |line: usize, x: usize| to_sample(((line * 37 + x * 101) % 13) as f64 - 6.0);
        let mut lines: Vec<Vec<f32>> = (0..40).map(|line| (0..8).map(|x| noise(line, x)).collect()).collect();
        let plain = offs_of(&lines);
        for (line, off) in plain.iter().enumerate() {
            let mean = lines[line].iter().map(|sample| f64::from(*sample)).sum::<f64>() / 8.0;
            assert!((off.unwrap() - mean).abs() < 1e-12);
        }
        lines[20][3] = 1300.0;
        lines.push(Vec::new());
        let found = offs_of(&lines);
        let others: f64 = [0, 1, 2, 4, 5, 6, 7].iter().map(|x| f64::from(noise(20, *x))).sum::<f64>() / 7.0;
        assert!((found[20].unwrap() - others).abs() < 1e-12, "{:?}", found[20]);
        assert_eq!((found[19], found[40]), (plain[19], None));
    }

    /// Offsets that rows have in common, of 400 rows of 8 photosites: the variance of 400 normal ones is known to 7 % of it, by which 0.35 of
    /// it are five deviations.
    #[test]
    fn lines_tell_what_they_have_in_common() {
        let normal = |i: usize| quantile((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5555_5555);
        let lines = |of_line: f64| -> Vec<Vec<f32>> {
            let sample = |line: usize, x: usize| to_sample(of_line * normal(line) + 4.0 * normal(1000 + 8 * line + x));
            (0..400).map(|line| (0..8).map(|x| sample(line, x)).collect()).collect()
        };
        for of_line in [3.0, 10.0] {
            let ratio = variance_of_lines(&lines(of_line)) / (of_line * of_line);
            assert!((ratio - 1.0).abs() < 0.35, "{of_line}: {ratio}");
        }
        assert!(variance_of_lines(&lines(0.0)) < 1.0, "{}", variance_of_lines(&lines(0.0)));
    }

    /// A tenth of the columns lit: most of them lie below the mean by a tenth of the light; without light by noise alone.
    #[test]
    fn a_lit_part_leans() {
        let columns = |lit: f64| -> Vec<Vec<f32>> {
            let level = |x: usize| if x < 36 { -0.1 * lit } else { 0.9 * lit };
            (0..40)
                .map(|x| (0..32).map(|y| to_sample(level(x) + ((x * 37 + y * 101) % 13) as f64 - 6.0)).collect())
                .collect()
        };
        let lean = |lit: f64| Lean::of(Axis::Columns, &columns(lit)).unwrap();
        assert!((lean(1000.0).median + 100.0).abs() < 2.0 && lean(1000.0).deviation < 1.0, "{:?}", lean(1000.0));
        assert!(lean(0.0).median.abs() < 1.0);
        assert_eq!(Lean::of(Axis::Rows, &[vec![1.0, 2.0]]), None);
    }
}
