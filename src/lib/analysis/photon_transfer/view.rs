//! What a fixed pattern looks like: spectrograms, profiles, histogram, and the photosites that stand out.
//!
//! A spectrogram is the mean power of the Fourier transforms of all rows, or columns, of the pattern less its mean: white noise of
//! variance s² has power s² at every frequency \[EMVA1288, Sec. 8.3]. Profiles, histogram and defects are those of the pattern behind
//! the standard's high-pass filter, which takes from each photosite the mean of the 5x5 around it, and with it what light and lens
//! make uneven \[EMVA1288, Sec. 8.6]. Histogram and defects have the two rows and columns at each edge too, where the standard looks at
//! nothing: the level of these photosites is that of the plane through the 5x5 nearest to them, which in its middle is the mean. Photosites
//! count as the grid of their class does.

use super::level::Level;
use super::sites::Site;
use crate::numerics::robust::{NORMAL_MEDIAN, median};
use rustfft::{FftPlanner, num_complex::Complex};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Photosites on a side of the filter's box.
const BOX: usize = 5;
/// Bins of the histogram.
const BINS: usize = 256;
/// A photosite stands out beyond so many standard deviations of most.
pub const OUTSTANDING: f64 = 5.0;
/// So many of those that stand out most are named.
pub const NAMED: usize = 100;

/// What the mean of frames leaves uncertain of a photosite, in the unit of its pattern.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Blur {
    /// A standard deviation: of temporal noise.
    pub noise: f64,
    /// How far rounding may have it off, at most.
    pub hidden: f64,
}

impl Blur {
    /// Of the mean of the frames of a level, of codes whose error of rounding has such a variance.
    pub fn of(level: &Level, rounding: f64) -> Self {
        Self { noise: (level.variance / level.frames as f64).sqrt(), hidden: level.hidden(rounding).mean }
    }
}

/// A photosite that stands out.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Outlier {
    /// Column of the frame.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// How far it lies off those around it.
    pub deviation: f64,
}

/// What a figure shows of a fixed pattern.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternFigure {
    /// Frequency in cycles per photosite and power, along rows and along columns.
    pub spectra: [Vec<[f64; 2]>; 2],
    /// Value and photosites of each bin, behind the filter.
    pub histogram: Vec<[f64; 2]>,
    /// The same of a normal law of the spread of most.
    pub normal: Vec<[f64; 2]>,
    /// Distance from most and the share of photosites that are as far or farther, behind the filter.
    pub accumulated: Vec<[f64; 2]>,
    /// The same of the normal law.
    pub normal_accumulated: Vec<[f64; 2]>,
}

/// A fixed pattern of a class.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternView {
    /// Place and mean, column by column and row by row, behind the filter.
    pub profiles: [Vec<[f64; 2]>; 2],
    /// What only a figure shows, where one is asked for.
    pub figure: Option<PatternFigure>,
    /// Spread of most photosites behind the filter: that of a normal law with their median absolute deviation.
    pub spread: f64,
    /// How many stand out, and how many of a normal law would.
    pub outstanding: [f64; 2],
    /// Those that stand out, the most first, [`NAMED`] of them at most.
    pub outliers: Vec<Outlier>,
    /// Variances that columns and rows add as the filter shows them, without what varies smoothly and photosites that stand out, and what
    /// they scatter by, standard deviations.
    pub lines: [[f64; 2]; 2],
    /// The variance that single photosites add besides, without those that stand out and noise that is left in the means, and what it
    /// scatters by, a standard deviation.
    pub rest: [f64; 2],
}

/// What the filter leaves of the variance of single photosites, 1 − 1/25, and of that of whole rows or columns, 1 − 1/5, as of
/// their means.
const LEFT: [f64; 2] = [0.96, 0.8];

/// Of means of `count` lines behind the filter, as many are independent: neighbors share what is taken off them.
///
/// n/ν = Σ (1 − |k|/n) ρ_k²,  ρ_k = Σ h_i h_(i+k) / Σ h_i²
///
/// h the coefficients of the filter along one axis, 4/5 of a line and −1/5 of each of the two on both sides; the mean of n squares has a
/// relative variance of 2/ν then: 2.9/n of many.
fn independent_lines(count: f64) -> f64 {
    let coefficient = |at: usize| if at == BOX / 2 { 1.0 } else { 0.0 } - 1.0 / BOX as f64;
    let product = |apart: usize| (apart..BOX).map(|at| coefficient(at) * coefficient(at - apart)).sum::<f64>();
    let alike = |apart: usize| (1.0 - apart as f64 / count).max(0.0) * (product(apart) / product(0)).powi(2);
    count / (1.0 + 2.0 * (1..BOX).map(alike).sum::<f64>())
}

/// The variance between columns or rows that means of `count` photosites of such a mean square behind the filter tell, and what it
/// scatters by.
fn of_lines(means: &[f64], count: f64, square: f64) -> [f64; 2] {
    let all = means.iter().map(|mean| mean * mean).sum::<f64>() / means.len() as f64 / LEFT[1];
    [all - square / LEFT[0] / count, all * (2.0 / independent_lines(means.len() as f64)).sqrt()]
}

/// What columns and rows add, and what single photosites add besides noise that is left of such a standard deviation: variances of grids
/// behind the filter, each with what it scatters by.
fn parts_of(filtered: &[Grid], noise: f64) -> ([[f64; 2]; 2], [f64; 2]) {
    let values = || filtered.iter().flat_map(|grid| &grid.values);
    let count = values().count() as f64;
    let square = values().map(|value| value * value).sum::<f64>() / count;
    let lines = [0, 1].map(|axis| {
        let means: Vec<f64> = filtered.iter().flat_map(|grid| grid.profile(axis)).collect();
        let extent = [filtered[0].columns, filtered[0].rows][axis] as f64;
        of_lines(&means, filtered[0].values.len() as f64 / extent, square)
    });
    let in_lines = lines.iter().map(|[variance, _]| variance.max(0.0)).sum::<f64>() * LEFT[1];
    let scatter = (2.0 / count).sqrt() * (square / LEFT[0]).hypot(noise * noise);
    (lines, [(square - in_lines) / LEFT[0] - noise * noise, scatter])
}

/// What rounding may have a photosite off by beside those around it, in what it has one of them off by at most: of one way it and the
/// others the other. At a corner the plane takes these by weights the sizes of which add up to 1.8, 0.2 its own, and the rest counts 1.1 times.
const APART: [f64; 2] = [2.0, 2.7];

/// A grid of values.
struct Grid {
    columns: usize,
    rows: usize,
    values: Vec<f64>,
}

impl Grid {
    fn of(site: &Site, width: usize, planes: usize, at: &(dyn Fn(usize) -> f64 + Sync)) -> Self {
        let [columns, rows] = site.size;
        let index = |x: usize, y: usize| {
            ((site.first[1] + y * site.step[1]) * planes + site.plane) * width + site.first[0] + x * site.step[0]
        };
        let values = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| at(index(x, y))).collect();
        Self { columns, rows, values }
    }

    fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len() as f64
    }

    fn turned(&self) -> Self {
        let values = (0..self.columns).flat_map(|x| (0..self.rows).map(move |y| self.values[y * self.columns + x]));
        Self { columns: self.rows, rows: self.columns, values: values.collect() }
    }

    /// Mean power of the rows, two by two: of z = x₁ + i x₂, |Z(f)|² + |Z(−f)|² is twice the power of both at f.
    fn spectrum(&self) -> Vec<[f64; 2]> {
        let (mean, columns) = (self.mean(), self.columns);
        let transform = FftPlanner::new().plan_fft_forward(columns);
        let mut power = vec![0.0; columns / 2 + 1];
        let mut line = vec![Complex::default(); columns];
        let mut scratch = vec![Complex::default(); transform.get_inplace_scratch_len()];
        for rows in self.values.chunks(2 * columns) {
            let (first, second) = rows.split_at(columns);
            line.iter_mut().zip(first).for_each(|(line, value)| *line = Complex::new(value - mean, 0.0));
            line.iter_mut().zip(second).for_each(|(line, value)| line.im = value - mean);
            transform.process_with_scratch(&mut line, &mut scratch);
            for (index, power) in power.iter_mut().enumerate() {
                *power += 0.5 * (line[index].norm_sqr() + line[(columns - index) % columns].norm_sqr());
            }
        }
        let scale = 1.0 / (columns * self.rows) as f64;
        power.iter().enumerate().map(|(index, power)| [index as f64 / columns as f64, power * scale]).collect()
    }

    /// Each value less the mean of the box around it, where there is one.
    fn high_passed(&self) -> Self {
        let margin = BOX / 2;
        let (columns, rows) = (self.columns - 2 * margin, self.rows - 2 * margin);
        // Sums over the box's rows, then over its columns.
        let mut sums = vec![0.0; self.columns];
        let mut values = Vec::with_capacity(columns * rows);
        for y in 0..rows {
            sums.fill(0.0);
            for line in self.values[y * self.columns..(y + BOX) * self.columns].chunks_exact(self.columns) {
                sums.iter_mut().zip(line).for_each(|(sum, value)| *sum += value);
            }
            let own = &self.values[(y + margin) * self.columns + margin..];
            let boxes = sums.windows(BOX).map(|sums| sums.iter().sum::<f64>() / (BOX * BOX) as f64);
            values.extend(own.iter().zip(boxes).map(|(own, around)| own - around));
        }
        Self { columns, rows, values }
    }

    /// A value less what those around it tell of it, which are those of the box nearest to it that are not told of: their mean, or at the edge
    /// their plane. At the edge noise is the same in it as behind the filter, as long as its own value counts among the others.
    fn above_others(&self, place: [usize; 2], told: &[bool]) -> f64 {
        let own = self.values[place[1] * self.columns + place[0]];
        match self.around(place, told) {
            Around { level, share } if self.is_at_edge(place) && share > 0.0 => {
                (own - level) * (LEFT[0] / (1.0 - share)).sqrt()
            }
            Around { level, .. } => own - level,
        }
    }

    /// What those of the box nearest to a place that are not told of tell of it.
    fn around(&self, [x, y]: [usize; 2], told: &[bool]) -> Around {
        let margin = BOX / 2;
        let first = |at: usize, extent: usize| at.saturating_sub(margin).min(extent - BOX);
        let [left, top] = [first(x, self.columns), first(y, self.rows)];
        let places = (top..top + BOX).flat_map(|row| (left..left + BOX).map(move |column| [column, row]));
        let untold = places.filter(|[column, row]| !told[row * self.columns + column]);
        let others = untold.map(|[column, row]| {
            let away = [column as f64 - x as f64, row as f64 - y as f64];
            (away, self.values[row * self.columns + column])
        });
        let others: Vec<Away> = others.collect();
        let count = others.len() as f64;
        let mean = |of: &dyn Fn(&Away) -> f64| others.iter().map(of).sum::<f64>() / count;
        if others.is_empty() {
            return Around { level: self.mean(), share: 0.0 };
        }
        let level = mean(&|(_, value)| *value);
        let is_own = if told[y * self.columns + x] { 0.0 } else { 1.0 };
        let even = Around { level, share: is_own / count };
        if !self.is_at_edge([x, y]) {
            return even;
        }
        // About their middle the plane is their mean and two slopes, by least squares.
        let [right, down] = [0, 1].map(|axis| mean(&|(away, _)| away[axis]));
        let off = |away: &[f64; 2]| [away[0] - right, away[1] - down];
        let product = |a: usize, b: usize| mean(&|(away, _)| off(away)[a] * off(away)[b]);
        let with = |axis: usize| mean(&|(away, value)| off(away)[axis] * (value - level));
        let (across, along, both) = (product(0, 0), product(1, 1), product(0, 1));
        let determinant = across * along - both * both;
        let weights = [along * right - both * down, across * down - both * right].map(|weight| weight / determinant);
        let leverage = (1.0 + weights[0] * right + weights[1] * down) / count;
        // Those that are left may lie on a line, or tell too little of a plane there.
        if leverage.is_nan() || leverage >= 0.5 {
            return even;
        }
        Around { level: level - weights[0] * with(0) - weights[1] * with(1), share: is_own * leverage }
    }

    /// Whether a place is so near the edge that there is no box around it.
    fn is_at_edge(&self, [x, y]: [usize; 2]) -> bool {
        let margin = BOX / 2;
        x.min(y) < margin || x + margin >= self.columns || y + margin >= self.rows
    }

    /// Index and value less those around it of all at the edge.
    fn at_edge(&self) -> Vec<(usize, f64)> {
        let told = vec![false; self.values.len()];
        let margin = BOX / 2;
        let within = margin..self.columns - margin;
        let place = |at: usize| [at % self.columns, at / self.columns];
        let of_row = |y: usize| {
            let is_whole = y < margin || y + margin >= self.rows;
            let right = if is_whole { 0 } else { within.end };
            let left = if is_whole { self.columns } else { within.start };
            (0..left).chain(right.max(left)..self.columns).map(move |x| y * self.columns + x)
        };
        let all = (0..self.rows).flat_map(of_row);
        all.map(|at| (at, self.above_others(place(at), &told))).collect()
    }

    /// The same with what those around tell in place of photosites that stand out.
    fn mended(&self, told: &[bool]) -> Self {
        let values = self.values.iter().enumerate().map(|(at, value)| {
            if told[at] { self.around([at % self.columns, at / self.columns], told).level } else { *value }
        });
        Self { columns: self.columns, rows: self.rows, values: values.collect() }
    }

    /// Means of the columns, or of the rows.
    fn profile(&self, axis: usize) -> Vec<f64> {
        let rows = self.values.chunks_exact(self.columns);
        if axis == 1 {
            return rows.map(|row| row.iter().sum::<f64>() / self.columns as f64).collect();
        }
        let mut sums = vec![0.0; self.columns];
        for row in rows {
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
        sums.iter().map(|sum| sum / self.rows as f64).collect()
    }
}

/// What those around a photosite tell of it.
struct Around {
    level: f64,
    /// What of the photosite's own value is in that.
    share: f64,
}

/// The pattern of a class whose grids are `sites` in a picture of so many columns and planes, of which `at` gives the value at an
/// index, as uncertain as `blur` says, with what a figure shows where it `draws`; none of a grid that the filter leaves nothing of.
///
/// Where rounded means of quiet photosites are mostly one number their median deviation tells no spread: none is less than that of noise,
/// and what rounding may be off by, of a photosite one way and of those around it the other, does not stand out.
pub fn pattern_view(
    sites: &[&Site],
    [width, planes]: [usize; 2],
    at: &(dyn Fn(usize) -> f64 + Sync),
    blur: Blur,
    draws: bool,
) -> Option<PatternView> {
    if sites.iter().any(|site| site.size.iter().any(|extent| *extent < 2 * BOX)) {
        return None;
    }
    let grids: Vec<Grid> = sites.iter().map(|site| Grid::of(site, width, planes, at)).collect();
    let filtered: Vec<Grid> = grids.iter().map(Grid::high_passed).collect();
    let profiles = [0, 1].map(|axis| {
        let mut all: Vec<[f64; 2]> = Vec::new();
        for (site, grid) in sites.iter().zip(&filtered) {
            let place = |index: usize| (site.first[axis] + (index + BOX / 2) * site.step[axis]) as f64;
            all.extend(grid.profile(axis).iter().enumerate().map(|(index, mean)| [place(index), *mean]));
        }
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        all
    });
    let edges: Vec<Vec<(usize, f64)>> = grids.iter().map(Grid::at_edge).collect();
    let at_edge = edges.iter().flatten().map(|(_, value)| *value);
    let mut values: Vec<f64> = filtered.iter().flat_map(|grid| grid.values.iter().copied()).chain(at_edge).collect();
    let middle = median(&mut values);
    let mut absolute: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    let least = if blur.hidden > 0.0 { LEFT[0].sqrt() * blur.noise } else { 0.0 };
    let spread = (median(&mut absolute) / NORMAL_MEDIAN).max(least);
    let far = APART.map(|apart| if spread > 0.0 { OUTSTANDING * spread + apart * blur.hidden } else { f64::INFINITY });
    let (mut outliers, told) = outliers(sites, &grids, (&filtered, &edges), middle, far);
    let expected = crate::numerics::significance::of_normal(OUTSTANDING) * values.len() as f64;
    let outstanding = [outliers.len() as f64, expected];
    outliers.truncate(NAMED);
    // A hot photosite would be a part of its column and of its row, and of all around it behind the filter.
    let mended: Vec<Grid> = grids.iter().zip(&told).map(|(grid, told)| grid.mended(told).high_passed()).collect();
    let (lines, rest) = parts_of(&mended, blur.noise);
    let figure = draws.then(|| {
        let (histogram, normal) = histogram(&values, middle, spread);
        let (accumulated, normal_accumulated) = accumulated(absolute, spread);
        PatternFigure { spectra: spectra(&grids), histogram, normal, accumulated, normal_accumulated }
    });
    Some(PatternView { profiles, figure, spread, outstanding, outliers, lines, rest })
}

/// Places of a grid that are near its edge, and how far they are off.
type Edge = Vec<(usize, f64)>;

/// Columns and rows from one place to another, and the value there.
type Away = ([f64; 2], f64);

/// Those that stand out, the most first, and which of each grid. One that stands out is left out of the means around its neighbors, which
/// would stand out to the other side by a 25th of it, and more at the edge.
fn outliers(
    sites: &[&Site],
    grids: &[Grid],
    (filtered, edges): (&[Grid], &[Edge]),
    middle: f64,
    far: [f64; 2],
) -> (Vec<Outlier>, Vec<Vec<bool>>) {
    let (mut outliers, mut all_told) = (Vec::new(), Vec::new());
    let off = |value: f64| (value - middle).abs();
    for (index, (site, grid)) in sites.iter().zip(grids).enumerate() {
        let (filtered, margin) = (&filtered[index], BOX / 2);
        let of_grid = |at: usize| (at / filtered.columns + margin) * grid.columns + at % filtered.columns + margin;
        let inner = filtered.values.iter().enumerate().filter(|(_, value)| off(**value) > far[0]);
        let at_edge = edges[index].iter().filter(|(_, value)| off(*value) > far[1]);
        let all = inner.map(|(at, value)| (of_grid(at), *value)).chain(at_edge.copied());
        // Numbers that are not negative are in the order of their bits.
        let mut all: BinaryHeap<(u64, Reverse<usize>)> =
            all.map(|(at, value)| (off(value).to_bits(), Reverse(at))).collect();
        let mut told = vec![false; grid.values.len()];
        while let Some((_, Reverse(at))) = all.pop() {
            let [x, y] = [at % grid.columns, at / grid.columns];
            let deviation = grid.above_others([x, y], &told);
            if off(deviation) <= far[usize::from(grid.is_at_edge([x, y]))] {
                continue;
            }
            // Without those that have been told of it may be less far off than another.
            let own = (off(deviation).to_bits(), Reverse(at));
            if all.peek().is_some_and(|next| own.0 < next.0) {
                all.push(own);
                continue;
            }
            told[at] = true;
            let place = |axis: usize, of: usize| site.first[axis] + of * site.step[axis];
            outliers.push(Outlier { x: place(0, x), y: place(1, y), deviation });
        }
        all_told.push(told);
    }
    outliers.sort_by(|a, b| b.deviation.abs().total_cmp(&a.deviation.abs()));
    (outliers, all_told)
}

/// Spectrograms along rows and along columns, the mean of those of the grids.
fn spectra(grids: &[Grid]) -> [Vec<[f64; 2]>; 2] {
    let all = |is_turned: bool| {
        let of = |grid: &Grid| if is_turned { grid.turned().spectrum() } else { grid.spectrum() };
        mean_of(grids.iter().map(of).collect())
    };
    let (rows, columns) = rayon::join(|| all(false), || all(true));
    [rows, columns]
}

/// Shares of photosites at such distances or beyond, and those of a normal law: all that are far, few of those that are not.
fn accumulated(mut distances: Vec<f64>, spread: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    /// From one rank to the next, beyond the first.
    const STEP: f64 = 1.05;
    distances.sort_unstable_by(|a, b| b.total_cmp(a));
    let (mut measured, mut rank) = (Vec::new(), 1);
    while rank <= distances.len() {
        measured.push([distances[rank - 1], rank as f64 / distances.len() as f64]);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a rank")]
        let next = (rank as f64 * STEP) as usize;
        rank = next.max(rank + 1);
    }
    let far = distances.first().copied().unwrap_or(0.0);
    let law = |index: usize| {
        let distance = far * index as f64 / BINS as f64;
        [distance, crate::numerics::significance::of_normal(distance / spread)]
    };
    let normal = if spread > 0.0 { (0..=BINS).map(law).collect() } else { Vec::new() };
    (measured, normal)
}

fn mean_of(spectra: Vec<Vec<[f64; 2]>>) -> Vec<[f64; 2]> {
    let count = spectra.len() as f64;
    let shortest = spectra.iter().map(Vec::len).min().unwrap_or(0);
    let power = |index: usize| spectra.iter().map(|spectrum| spectrum[index][1]).sum::<f64>() / count;
    (0..shortest).map(|index| [spectra[0][index][0], power(index)]).collect()
}

/// Photosites in each bin, and what a normal law has there.
fn histogram(values: &[f64], mean: f64, spread: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let [low, high] = values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(*value), high.max(*value)]);
    let width = (high - low) / BINS as f64;
    if width.is_nan() || width <= 0.0 {
        return (Vec::new(), Vec::new());
    }
    // Whole steps, about whose values bins lie: others would have one value more than their neighbors, or one less.
    let (low, width) = match step_of(values) {
        Some(step) => (low - 0.5 * step, (width / step).ceil() * step),
        None => (low, width),
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a bin")]
    let bin_of = |value: f64| (((value - low) / width) as usize).min(BINS - 1);
    let mut counts = vec![0.0; bin_of(high) + 1];
    values.iter().for_each(|value| counts[bin_of(*value)] += 1.0);
    let center = |bin: usize| low + (bin as f64 + 0.5) * width;
    let law = |bin: usize| {
        let density = crate::numerics::normal::density((center(bin) - mean) / spread) / spread;
        [center(bin), density * width * values.len() as f64]
    };
    let measured = counts.iter().enumerate().map(|(bin, count)| [center(bin), *count]).collect();
    (measured, (0..counts.len()).map(law).collect())
}

/// The step of values that lie on a lattice, as means of codes over few frames do; none of others.
fn step_of(values: &[f64]) -> Option<f64> {
    /// So many values tell it, each so far behind the one before that none of their neighbors is left out by rule.
    const LOOKED_AT: usize = 4096;
    const STRIDE: usize = 7919;
    /// Of a step, how far off its place a value may be that was rounded.
    const OFF: f64 = 1e-3;
    let mut some: Vec<f64> =
        (0..LOOKED_AT.min(values.len())).map(|index| values[index * STRIDE % values.len()]).collect();
    some.sort_unstable_by(f64::total_cmp);
    let (first, range) = (*some.first()?, some.last()? - some.first()?);
    let gaps = some.windows(2).map(|pair| pair[1] - pair[0]);
    let step = gaps.filter(|gap| *gap > OFF * OFF * range).min_by(f64::total_cmp)?;
    let is_on = |value: &f64| {
        let steps = (value - first) / step;
        (steps - steps.round()).abs() < OFF * steps.max(1.0)
    };
    // Nearly as many steps as values are no lattice that could be seen.
    (range / step < some.len() as f64 / 4.0 && values.iter().all(is_on)).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::philox::philox4x32_10;

    /// Means of codes over two frames lie half a code apart: bins have as many of these each, so that the counts of an even law are even.
    #[test]
    fn bins_go_with_the_steps_of_values() {
        for codes in [300, 1000] {
            let values: Vec<f64> = (0..20 * codes).map(|index| 0.5 * f64::from(index % codes) - 7.3).collect();
            let (measured, law) = histogram(&values, 0.0, 1.0);
            let whole = &measured[..measured.len() - 1];
            assert!(
                whole.iter().all(|[_, count]| *count == measured[0][1]) && whole.len() > BINS / 2 - 2,
                "{measured:?}"
            );
            assert_eq!(
                (law.len(), measured.iter().map(|[_, count]| count).sum::<f64>()),
                (measured.len(), 20.0 * f64::from(codes))
            );
        }
        let uneven: Vec<f64> = (0..1000).map(|index| f64::from(index).sqrt()).collect();
        assert_eq!(step_of(&uneven), None);
    }

    /// Of a pattern of even noise two photosites beside each other that stand out by 200 and 40 spreads do, and none of those around them,
    /// which are 8 spreads below the mean of 5x5 that has the first in it.
    #[test]
    fn neighbors_of_what_stands_out_do_not() {
        const SIDE: usize = 40;
        let site = Site { class: "Y".into(), plane: 0, first: [0, 0], step: [1, 1], size: [SIDE, SIDE] };
        let noise = |index: usize| {
            f64::from(philox4x32_10([u32::try_from(index).unwrap(), 0, 0, 0], [1, 2])[0]) / 4_294_967_296.0 - 0.5
        };
        let at = |index: usize| match index {
            820 => 100.0,
            822 => -20.0,
            _ => noise(index),
        };
        let view = pattern_view(&[&site], [SIDE, 1], &at, Blur::default(), false).unwrap();
        let places: Vec<[usize; 2]> = view.outliers.iter().map(|outlier| [outlier.x, outlier.y]).collect();
        assert_eq!((places, view.outstanding[0]), (vec![[20, 20], [22, 20]], 2.0));
        assert!((view.outliers[1].deviation + 20.0 * 23.0 / 24.0).abs() < 1.0, "{:?}", view.outliers[1]);
    }

    /// Lines of variance 1 that are filtered as columns are: over 4000 draws of 60 what their variance is found to be scatters as is told, within
    /// 5 standard deviations of a standard deviation, √(1/8000); as if they were independent it was a sixth too small.
    #[test]
    fn variances_of_lines_scatter_as_is_told() {
        const DRAWS: u32 = 4000;
        const LINES: u32 = 60;
        let normal = |draw: u32, line: u32| {
            let words = (0..3).flat_map(|part| philox4x32_10([draw, line, part, 0], [5, 6]));
            words.map(|word| f64::from(word) / 4_294_967_296.0).sum::<f64>() - 6.0
        };
        let found: Vec<[f64; 2]> = (0..DRAWS)
            .map(|draw| {
                let lines: Vec<f64> = (0..LINES).map(|line| normal(draw, line)).collect();
                let filtered = |around: &[f64]| around[BOX / 2] - around.iter().sum::<f64>() / BOX as f64;
                of_lines(&lines.windows(BOX).map(filtered).collect::<Vec<f64>>(), 1.0, 0.0)
            })
            .collect();
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| found.iter().map(of).sum::<f64>() / f64::from(DRAWS);
        let variance = mean(&|found| found[0]);
        let scatter = mean(&|found| (found[0] - variance).powi(2)).sqrt();
        let told = mean(&|found| found[1]);
        // Squares of normal numbers have tails: the fourth cumulant of the mean of 39 independent ones adds a share of 3/39 to the variance of
        // its variance.
        let allowed = 5.0 * ((2.0 + 12.0 / 39.0) / f64::from(DRAWS)).sqrt() / 2.0;
        assert!((variance - 1.0).abs() < 5.0 * told / f64::from(DRAWS).sqrt(), "{variance}");
        assert!((scatter / told - 1.0).abs() < allowed && allowed < 0.07, "{scatter} {told}");
    }

    /// Of even noise on a slope of three standard deviations a photosite, which nothing stands out of, photosites in corners and at edges do, and
    /// none of those around them: a hot one in a corner with a dim one near it, and a dim one in the last row. The law of those that stand out by
    /// chance is of all photosites.
    #[test]
    fn what_stands_out_at_the_edge_is_found_there() {
        const SIZE: [usize; 2] = [48, 32];
        let site = Site { class: "Y".into(), plane: 0, first: [0, 0], step: [1, 1], size: SIZE };
        let slope = |index: usize| {
            let [word, ..] = philox4x32_10([u32::try_from(index).unwrap(), 0, 0, 0], [1, 5]);
            f64::from(word) / 4_294_967_296.0 + 0.9 * (index % SIZE[0]) as f64 - 0.9 * (index / SIZE[0]) as f64
        };
        let viewed = |bad: &[([usize; 2], f64)]| {
            let value = |index: usize| {
                let [x, y] = [index % SIZE[0], index / SIZE[0]];
                slope(index) + bad.iter().filter(|(place, _)| *place == [x, y]).map(|(_, off)| off).sum::<f64>()
            };
            let view = pattern_view(&[&site], [SIZE[0], 1], &value, Blur::default(), true).unwrap();
            let places: Vec<[usize; 2]> = view.outliers.iter().map(|outlier| [outlier.x, outlier.y]).collect();
            let drawn: f64 = view.figure.unwrap().histogram.iter().map(|[_, count]| count).sum();
            (places, view.outstanding, drawn)
        };
        let all = (SIZE[0] * SIZE[1]) as f64;
        let expected = crate::numerics::significance::of_normal(OUTSTANDING) * all;
        assert_eq!(viewed(&[]), (vec![], [0.0, expected], all));
        let bad = [([0, 0], 2000.0), ([20, 31], -300.0), ([2, 1], -100.0)];
        assert_eq!(viewed(&bad), (bad.map(|(place, _)| place).to_vec(), [3.0, expected], all));
        let column: Vec<([usize; 2], f64)> = (0..8).map(|y| ([47, y], 500.0)).collect();
        let (mut places, ..) = viewed(&column);
        places.sort_unstable();
        assert_eq!(places, column.iter().map(|(place, _)| *place).collect::<Vec<_>>());
    }

    /// Of noise of variance 1/12 alone twelve photosites that stand out by thousands of spreads, one of them at the edge, make no rows and
    /// columns beyond what means of 56 vary by, 5 standard deviations of √(2/56) of that, and leave single photosites their variance, within 5 of
    /// what it scatters by.
    #[test]
    fn what_stands_out_is_no_part_of_rows_and_columns() {
        const SIDE: usize = 60;
        let site = Site { class: "Y".into(), plane: 0, first: [0, 0], step: [1, 1], size: [SIDE, SIDE] };
        let at = |index: usize| {
            let [word, ..] = philox4x32_10([u32::try_from(index).unwrap(), 0, 0, 0], [1, 4]);
            let hot = if index % 311 == 1 { 3000.0 } else { 0.0 };
            f64::from(word) / 4_294_967_296.0 + hot
        };
        let view = pattern_view(&[&site], [SIDE, 1], &at, Blur::default(), false).unwrap();
        let of_means = 1.0 / 12.0 / 56.0;
        assert!(view.lines.iter().all(|[variance, _]| variance.abs() < of_means), "{:?}", view.lines);
        let [variance, scatter] = view.rest;
        assert!((variance - 1.0 / 12.0).abs() < 5.0 * scatter && scatter < 0.01, "{:?}", view.rest);
    }

    /// Of means that are mostly one code, and of every twentieth photosite between it and the next, one that is 5 codes off stands out.
    #[test]
    fn what_rounding_makes_does_not_stand_out() {
        const SIDE: usize = 60;
        let site = Site { class: "Y".into(), plane: 0, first: [0, 0], step: [1, 1], size: [SIDE, SIDE] };
        let chance = |index: usize, key: u32| {
            f64::from(philox4x32_10([u32::try_from(index).unwrap(), 0, 0, 0], [1, key])[0]) / 4_294_967_296.0
        };
        let at = |index: usize| match index {
            1830 => 105.0,
            _ if chance(index, 2) < 0.05 => 100.0 + chance(index, 3),
            _ => 100.0,
        };
        let counted = |blur: Blur| pattern_view(&[&site], [SIDE, 1], &at, blur, false).unwrap().outstanding[0];
        assert_eq!(counted(Blur { noise: 0.04, hidden: 0.4 }), 1.0);
        assert!(counted(Blur::default()) > 100.0);
    }
}
