//! What frames of one condition tell: temporal and fixed-pattern variance of each grid of photosites, apart, and what each
//! scatters by.
//!
//! L frames y_k of one light and exposure are read in step. At a photosite ȳ is their mean and a_k = y_k − ȳ; over the n
//! photosites ā_k is what light and read-out drifted by as a whole, and β_k = Σ a_k (ȳ − m)/Σ (ȳ − m)² what light drifted by in
//! proportion, which shows where it is uneven. What is left is temporal noise,
//!
//! σ² = Σ_k Σ (a_k − ā_k − β_k (ȳ − m))²/((L − 1)(n − 2)),
//!
//! of two frames half the variance of their difference \[EMVA1288, Eq. 10]. Row and column noise make samples of a frame
//! correlated: what σ² and m scatter by is told from the scatter of rows and of columns beside that of photosites, clustered both
//! ways \[CameronEtAl2011].

use super::sites::Site;
use crate::error::{Error, Result};
use crate::frame::{Geometry, to_sample};
use crate::numerics::variance_components::{MeanSquare, MeanSquares, SquareSums};
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::stream::RowSource;
use rayon::prelude::*;

/// What a grid of photosites does under one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct SiteSurvey {
    /// Frames.
    pub frames: usize,
    /// Photosites, columns and rows.
    pub size: [usize; 2],
    /// Mean over frames and photosites.
    pub mean: f64,
    /// What temporal noise makes the mean scatter by: a variance.
    pub mean_variance: f64,
    /// Temporal variance of a sample.
    pub variance: f64,
    /// What it scatters by: a variance.
    pub variance_variance: f64,
    /// Samples at or above the top code, and at or below 0.
    pub at_ends: [u64; 2],
    /// Mean squares of the temporal noise.
    pub temporal: MeanSquares,
    /// Mean squares of the mean of the frames.
    pub spatial: MeanSquares,
    /// Means of the frames.
    pub frame_means: Vec<f64>,
}

impl SiteSurvey {
    /// How many photosites there are.
    pub fn count(&self) -> usize {
        self.size[0] * self.size[1]
    }
}

/// What frames of one condition tell.
#[derive(Debug, Clone)]
pub struct Survey {
    /// The frames' geometry.
    pub geometry: Geometry,
    /// The grids, as [`Site::of`] has them.
    pub sites: Vec<SiteSurvey>,
    /// The mean of the frames, laid out as `[row][channel][column]`, where it was kept.
    pub picture: Option<Vec<f32>>,
    /// The bits that codes have, of the first rows.
    pub bits: u32,
    /// Means of the sites of each 2x2, row by row, of the first rows of the first frame's first plane.
    pub quad: [f64; 4],
}

/// Reads all rows of frames of one condition, which are alike; at two or more. `top` is the largest code, where it is known; the
/// mean of the frames is kept where `keeps` says so. Memory is a few rows of each, and that mean.
///
/// # Errors
///
/// Those of the frames; [`Error::Data`] for samples that are not finite, and for grids of fewer than 2x2.
pub fn survey<S: RowSource>(frames: &mut [S], top: Option<f64>, keeps: bool) -> Result<Survey> {
    let header = frames[0].header().clone();
    let geometry = header.geometry.clone();
    let sites = Site::of(&header);
    if sites.iter().any(|site| site.size.iter().any(|extent| *extent < MIN_EXTENT)) {
        let [columns, rows] = [geometry.width, geometry.height];
        return Err(header.refuse(format!("{columns}x{rows} photosites are too few for statistics of each class")));
    }
    let mut tallies: Vec<Tally> = sites.iter().map(|site| Tally::new(site, frames.len(), top)).collect();
    let planes = geometry.channels.len();
    let mut picture = keeps.then(|| Vec::with_capacity(geometry.row_samples() * geometry.height));
    let step = frames.iter().map(|frame| geometry.band_rows(frame.natural_rows(), 1)).max().unwrap_or(1).max(1);
    let mut bands: Vec<Vec<f32>> = vec![Vec::new(); frames.len()];
    let mut sums: Vec<f64> = Vec::new();
    let (mut done, mut bits, mut quad) = (0, 0, [0.0; 4]);
    while done < geometry.height {
        let rows = step.min(geometry.height - done);
        frames.par_iter_mut().zip(&mut bands).try_for_each(|(frame, band)| {
            band.clear();
            frame.read(rows, band)
        })?;
        if done == 0 {
            bits = bands.iter().flatten().fold(0, |bits, sample| bits | whole(*sample));
            quad = quad_of(&bands[0], geometry.row_samples(), geometry.width);
        }
        for row in 0..rows {
            for (site, tally) in sites.iter().zip(&mut tallies).filter(|(site, _)| site.is_in_row(done + row)) {
                let from = (row * planes + site.plane) * geometry.width;
                tally.add(site, bands.iter().map(|band| &band[from..from + geometry.width]));
            }
        }
        if let Some(picture) = &mut picture {
            sums.clear();
            sums.resize(rows * geometry.row_samples(), 0.0);
            for band in &bands {
                sums.iter_mut().zip(band).for_each(|(sum, sample)| *sum += f64::from(*sample));
            }
            picture.extend(sums.iter().map(|sum| to_sample(sum / bands.len() as f64)));
        }
        done += rows;
    }
    let sites: Vec<SiteSurvey> = tallies.into_iter().map(Tally::finish).collect();
    if sites.iter().any(|site| !(site.mean.is_finite() && site.variance.is_finite())) {
        return Err(Error::format(&header.name, "it, or one with it, holds samples that are not finite"));
    }
    Ok(Survey { geometry, sites, picture, bits, quad })
}

/// A sample as a code; of what is no whole number all bits.
fn whole(sample: f32) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "what does not fit is no code")]
    let code = sample as u32;
    if f64::from(code) == f64::from(sample) { code } else { u32::MAX }
}

/// Means of the sites of each 2x2 of the first plane of some rows.
fn quad_of(band: &[f32], row_samples: usize, width: usize) -> [f64; 4] {
    let (mut sums, mut counts) = ([0.0; 4], [0_u32; 4]);
    for (y, row) in band.chunks_exact(row_samples).enumerate() {
        for (x, sample) in row[..width].iter().enumerate() {
            let site = y % 2 * 2 + x % 2;
            sums[site] += f64::from(*sample);
            counts[site] += 1;
        }
    }
    [0, 1, 2, 3].map(|site| sums[site] / f64::from(counts[site].max(1)))
}

/// Fewer rows or columns have no variance between them worth the name.
const MIN_EXTENT: usize = 4;

/// Sums over a grid, row by row.
struct Tally {
    size: [usize; 2],
    frames: usize,
    top: f64,
    at_ends: [u64; 2],
    /// About which ȳ is summed.
    center: f64,
    /// Σ y of each frame.
    frame_sums: Vec<f64>,
    /// Σ a_k² of each row, and of each column.
    row_squares: Vec<f64>,
    column_squares: Vec<f64>,
    /// Σ a_k of each row, frame after frame, and of each column, `[frame][column]`.
    row_sums: Vec<f64>,
    column_sums: Vec<f64>,
    /// Σ (ȳ − c) of each row and column.
    row_means: Vec<f64>,
    column_means: Vec<f64>,
    /// Σ (ȳ − c)².
    squares: f64,
    /// Σ a_k (ȳ − c) of each frame.
    products: Vec<f64>,
    /// Σ q and Σ q², q the sum of squares of a photosite about its row.
    within: [f64; 2],
    /// Samples of the row, `[frame][column]`, their means, and q.
    samples: Vec<f64>,
    means: Vec<f64>,
    squared: Vec<f64>,
    /// ȳ − c of the row.
    above: Vec<f64>,
    instructions: Instructions,
}

impl Tally {
    fn new(site: &Site, frames: usize, top: Option<f64>) -> Self {
        let columns = site.size[0];
        Self {
            size: site.size,
            frames,
            top: top.unwrap_or(f64::INFINITY),
            at_ends: [0; 2],
            center: 0.0,
            frame_sums: vec![0.0; frames],
            row_squares: Vec::with_capacity(site.size[1]),
            column_squares: vec![0.0; columns],
            row_sums: Vec::with_capacity(site.size[1] * frames),
            column_sums: vec![0.0; columns * frames],
            row_means: Vec::with_capacity(site.size[1]),
            column_means: vec![0.0; columns],
            squares: 0.0,
            products: vec![0.0; frames],
            within: [0.0; 2],
            samples: vec![0.0; columns * frames],
            means: vec![0.0; columns],
            squared: vec![0.0; columns],
            above: vec![0.0; columns],
            instructions: Instructions::widest(),
        }
    }

    /// Adds a row: that of each frame.
    fn add<'a>(&mut self, site: &Site, rows: impl Iterator<Item = &'a [f32]>) {
        for (samples, row) in self.samples.chunks_exact_mut(self.size[0]).zip(rows) {
            site.gather(row, samples);
        }
        vectors::run_on(self.instructions, AddRow(self));
    }

    #[inline(always)]
    fn add_gathered(&mut self) {
        let columns = self.size[0];
        let count = columns as f64;
        self.means.fill(0.0);
        for samples in self.samples.chunks_exact(columns) {
            let (mut at_top, mut at_bottom) = (0, 0);
            for (mean, sample) in self.means.iter_mut().zip(samples) {
                *mean += sample;
                at_top += u64::from(*sample >= self.top);
                at_bottom += u64::from(*sample <= 0.0);
            }
            self.at_ends[0] += at_top;
            self.at_ends[1] += at_bottom;
        }
        let share = 1.0 / self.frames as f64;
        self.means.iter_mut().for_each(|mean| *mean *= share);
        if self.row_means.is_empty() {
            self.center = sum(&self.means) / count;
        }
        for ((above, mean), of_column) in self.above.iter_mut().zip(&self.means).zip(&mut self.column_means) {
            *above = mean - self.center;
            *of_column += *above;
        }
        self.row_means.push(sum(&self.above));
        self.squares += dot(&self.above, &self.above);
        self.squared.fill(0.0);
        let mut all = 0.0;
        let columns_of = self.column_sums.chunks_exact_mut(columns);
        for ((index, samples), of_columns) in self.samples.chunks_exact_mut(columns).enumerate().zip(columns_of) {
            for ((sample, mean), of_column) in samples.iter_mut().zip(&self.means).zip(of_columns) {
                *sample -= mean;
                *of_column += *sample;
            }
            let of_row = sum(samples);
            self.frame_sums[index] += of_row;
            self.products[index] += dot(samples, &self.above);
            self.row_sums.push(of_row);
            all += dot(samples, samples);
            let about = of_row / count;
            for ((squared, of_column), sample) in self.squared.iter_mut().zip(&mut self.column_squares).zip(&*samples) {
                *of_column += sample * sample;
                *squared += (sample - about).powi(2);
            }
        }
        self.row_squares.push(all);
        self.within[0] += sum(&self.squared);
        self.within[1] += dot(&self.squared, &self.squared);
    }

    fn finish(self) -> SiteSurvey {
        let [columns, rows] = self.size.map(|extent| extent as f64);
        let n = rows * columns;
        let frames = self.frames as f64;
        let above: f64 = self.row_means.iter().sum::<f64>() / n;
        let mean = self.center + above;
        let spatial_sum = self.squares - n * above * above;
        let about = |sums: &[f64], each: f64| sums.iter().map(|sum| (sum / each - above).powi(2)).sum::<f64>() * each;
        let spatial = SquareSums {
            all: spatial_sum,
            rows: about(&self.row_means, columns),
            columns: about(&self.column_means, rows),
        };
        let drifts: Vec<f64> = self.frame_sums.iter().map(|sum| sum / n).collect();
        let is_uneven = spatial_sum > f64::EPSILON * n * mean * mean;
        let slopes: Vec<f64> = self
            .products
            .iter()
            .zip(&drifts)
            .map(|(product, drift)| if is_uneven { (product - above * n * drift) / spatial_sum } else { 0.0 })
            .collect();
        // What is left of rows and of columns once the drift is out.
        let left = |sum: f64, each: f64, frame: usize, of_mean: f64| {
            sum / each - drifts[frame] - slopes[frame] * (of_mean / each - above)
        };
        let by_rows: f64 = self
            .row_sums
            .chunks_exact(self.frames)
            .zip(&self.row_means)
            .flat_map(|(sums, of_mean)| sums.iter().enumerate().map(move |(frame, sum)| (frame, *sum, *of_mean)))
            .map(|(frame, sum, of_mean)| left(sum, columns, frame, of_mean).powi(2))
            .sum();
        let by_columns: f64 = self
            .column_sums
            .chunks_exact(self.size[0])
            .enumerate()
            .flat_map(|(frame, sums)| {
                sums.iter().zip(&self.column_means).map(move |(sum, of_mean)| (frame, *sum, *of_mean))
            })
            .map(|(frame, sum, of_mean)| left(sum, rows, frame, of_mean).powi(2))
            .sum();
        let all: f64 = self.row_squares.iter().sum::<f64>()
            - n * drifts.iter().map(|drift| drift * drift).sum::<f64>()
            - spatial_sum * slopes.iter().map(|slope| slope * slope).sum::<f64>();
        let sums = SquareSums { all, rows: columns * by_rows, columns: rows * by_columns };
        let temporal = MeanSquares::of(sums, self.size, frames - 1.0);
        let variance = all.max(0.0) / ((frames - 1.0) * (n - 2.0));
        SiteSurvey {
            frames: self.frames,
            size: self.size,
            mean,
            mean_variance: of_mean(&temporal) / (n * frames),
            variance,
            variance_variance: self.variance_variance(&drifts, n),
            at_ends: self.at_ends,
            temporal,
            spatial: MeanSquares::of(spatial, self.size, 1.0),
            frame_means: drifts.iter().map(|drift| mean + drift).collect(),
        }
    }

    /// What the temporal variance scatters by. Rows beside rows and columns beside columns are compared, so that light which
    /// varies smoothly over the frame does not count; what they scatter by beyond photosites counts where it is beyond chance.
    fn variance_variance(&self, drifts: &[f64], n: f64) -> f64 {
        let drift_squares: f64 = drifts.iter().map(|drift| drift * drift).sum();
        let [columns, rows] = self.size.map(|extent| extent as f64);
        let centered = |square: f64, sums: &mut dyn Iterator<Item = f64>, each: f64| {
            square - 2.0 * sums.zip(drifts).map(|(sum, drift)| sum * drift).sum::<f64>() + each * drift_squares
        };
        let of_rows: Vec<f64> = self
            .row_squares
            .iter()
            .zip(self.row_sums.chunks_exact(self.frames))
            .map(|(square, sums)| centered(*square, &mut sums.iter().copied(), columns))
            .collect();
        let of_columns: Vec<f64> = self
            .column_squares
            .iter()
            .enumerate()
            .map(|(x, square)| {
                let mut sums = (0..self.frames).map(|frame| self.column_sums[frame * self.size[0] + x]);
                centered(*square, &mut sums, rows)
            })
            .collect();
        let [sum, squares] = self.within;
        // Sums of squares about the rows have lost a share of 1/columns.
        let apart = (squares - sum * sum / n).max(0.0) * (1.0 + 2.0 / columns);
        let together = |sums: &[f64]| {
            let steps: f64 = sums.windows(2).map(|two| (two[1] - two[0]).powi(2)).sum();
            let scatter = 0.5 * steps / (sums.len() as f64 - 1.0) * sums.len() as f64;
            beyond_chance(scatter, apart, (3.0 / sums.len() as f64).sqrt())
        };
        let freedom = (self.frames as f64 - 1.0) * n;
        (apart + together(&of_rows) + together(&of_columns)) / (freedom * freedom)
    }
}

/// Adds the row that was gathered.
struct AddRow<'a>(&'a mut Tally);

impl Kernel for AddRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.add_gathered();
    }
}

/// Sums run in so many lanes, whatever the instructions.
const LANES: usize = 8;

#[inline(always)]
fn sum(values: &[f64]) -> f64 {
    let (whole, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for values in whole {
        for (lane, value) in lanes.iter_mut().zip(values) {
            *lane += value;
        }
    }
    lanes.iter().sum::<f64>() + rest.iter().sum::<f64>()
}

/// Σ a b.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((whole_a, rest_a), (whole_b, rest_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut lanes = [0.0; LANES];
    for (a, b) in whole_a.iter().zip(whole_b) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum::<f64>() + rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum::<f64>()
}

/// What a scatter has beyond another that it should equal, to a relative error; nothing where that may be chance.
fn beyond_chance(scatter: f64, other: f64, error: f64) -> f64 {
    if scatter > other * (1.0 + 2.0 * error) { scatter - other } else { 0.0 }
}

/// What a photosite's share of the variance of a frame's mean is: that of places apart, and what rows and columns add.
fn of_mean(temporal: &MeanSquares) -> f64 {
    let MeanSquares { rows, columns, rest } = temporal;
    let added = |of: &MeanSquare| beyond_chance(of.value, rest.value, (2.0 / of.freedom).sqrt());
    rest.value + added(rows) + added(columns)
}
