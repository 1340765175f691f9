//! Sums over a grid of photosites, row by row, and what they tell.

use super::falling::FallingSums;
use super::lanes::{center, depart, dot, fourth_powers, steps, sum};
use super::marks::Marks;
use super::neighbors::NeighborSums;
use super::row_drift::RowScatter;
use super::settings::Ends;
use super::site_survey::SiteSurvey;
use super::sites::Site;
use super::strangers::{RowSlopes, excess};
use super::stuck::StandIn;
use crate::numerics::variance_components::{MeanSquare, MeanSquares, SquareSums};
use crate::numerics::vectors::{self, Instructions, Kernel};
use std::ops::Range;

/// Sums over a grid, row by row.
pub struct Tally {
    size: [usize; 2],
    frames: usize,
    bottom: f64,
    top: f64,
    marks: Marks,
    at_ends: [u64; 2],
    at_top: Vec<[usize; 2]>,
    /// The mean of full photosites, and how many have it.
    full: (f64, u64),
    /// What stands in for photosites that are stuck, in the order of rows; and the first of them that is not reached yet.
    stand_ins: Vec<StandIn>,
    reached: usize,
    /// Samples of the first frame that are not those of the photosite before them in the row.
    uneven: u64,
    largest: (f64, u64),
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
    /// What each frame of a row has of their mean.
    slopes: RowSlopes,
    /// What neighbors have in common.
    neighbors: NeighborSums,
    /// How noise goes with ȳ.
    falling: FallingSums,
    /// Σ d², Σ d⁴ and Σ d⁸, d the differences of ȳ between neighbors in a row.
    steps: [f64; 3],
    /// Σ q, Σ q² and Σ q⁴, q the sum of squares of a photosite about its row.
    within: [f64; 3],
    /// Samples of the row, `[frame][column]`, their means, and q.
    samples: Vec<f64>,
    means: Vec<f64>,
    squared: Vec<f64>,
    /// ȳ − c of the row.
    above: Vec<f64>,
    instructions: Instructions,
}

impl Tally {
    /// Of such a grid in so many frames, whose codes have such ends and whose full photosites have such a mean, where these are known;
    /// photosites that are stuck have others stand in.
    pub fn new(site: &Site, frames: usize, ends: Ends, full: Option<f64>, stand_ins: Vec<StandIn>) -> Self {
        let columns = site.size[0];
        Self {
            size: site.size,
            frames,
            bottom: ends.bottom.unwrap_or(f64::NEG_INFINITY),
            top: ends.top.unwrap_or(f64::INFINITY),
            marks: Marks::new(columns, frames, most_at_top(site.size)),
            at_ends: [0; 2],
            at_top: Vec::new(),
            full: (full.unwrap_or(f64::INFINITY), 0),
            stand_ins,
            reached: 0,
            uneven: 0,
            largest: (f64::NEG_INFINITY, 0),
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
            slopes: RowSlopes::new(frames),
            neighbors: NeighborSums::new(columns, if frames == 2 { 1 } else { frames }),
            falling: FallingSums::default(),
            steps: [0.0; 3],
            within: [0.0; 3],
            samples: vec![0.0; columns * frames],
            means: vec![0.0; columns],
            squared: vec![0.0; columns],
            above: vec![0.0; columns],
            instructions: Instructions::widest(),
        }
    }

    /// Takes the marks of the row that is added next, which stand at such a place in those of each frame that has any.
    pub fn mark(&mut self, site: &Site, marks: &[Vec<f32>], place: Range<usize>) {
        self.marks.read(site, marks, place, self.row_means.len());
    }

    /// Adds a row: that which stands at such a place in the band of each frame.
    pub fn add(&mut self, site: &Site, bands: &[Vec<f32>], place: Range<usize>) {
        vectors::run_on(self.instructions, AddRow { tally: self, site, bands, place });
    }

    /// Means over the frames of the row that was added last.
    pub fn means(&self) -> &[f64] {
        &self.means
    }

    /// Frames of which departures are summed: the first of two departs as far as the second, to the other side.
    fn summed(&self) -> usize {
        if self.frames == 2 { 1 } else { self.frames }
    }

    /// What sums of squares over them are multiplied with.
    fn times(&self) -> f64 {
        (self.frames / self.summed()) as f64
    }

    #[inline(always)]
    fn gather(&mut self, site: &Site, bands: &[Vec<f32>], place: Range<usize>) {
        let columns = self.size[0];
        self.means.fill(0.0);
        let (row, at_top_before) = (self.row_means.len(), self.at_ends[0]);
        let of_row = self.stand_ins[self.reached..].iter().take_while(|stuck| stuck.row == row).count();
        let stand_ins = &self.stand_ins[self.reached..self.reached + of_row];
        self.reached += of_row;
        for (samples, band) in self.samples.chunks_exact_mut(columns).zip(bands) {
            site.gather(&band[place.clone()], samples);
            stand_ins.iter().for_each(|stuck| samples[stuck.column] = samples[stuck.by]);
            let (mut at_top, mut at_bottom) = (0, 0);
            for (mean, sample) in self.means.iter_mut().zip(samples) {
                *mean += *sample;
                at_top += u64::from(*sample >= self.top);
                at_bottom += u64::from(*sample <= self.bottom);
            }
            self.at_ends[0] += at_top;
            self.at_ends[1] += at_bottom;
        }
        if self.marks.is_any() {
            self.count_marks();
        }
        let mut reaches_top = self.at_ends[0] > at_top_before;
        if self.top == f64::INFINITY && !self.marks.is_any() {
            let largest = self.samples.iter().copied().fold(self.largest.0, f64::max);
            let before = if largest > self.largest.0 { 0 } else { self.largest.1 };
            let count: u64 = self.samples.iter().map(|sample| u64::from(*sample == largest)).sum();
            if largest > self.largest.0 {
                self.at_top.clear();
            }
            self.largest = (largest, before + count);
            reaches_top = count > 0;
        }
        if reaches_top {
            self.note_top(row);
        }
        let first = &self.samples[..columns];
        self.uneven += first.iter().zip(&first[1..]).map(|(one, next)| u64::from(one != next)).sum::<u64>();
    }

    /// Counts the samples of the row that marks call saturated and their level does not.
    fn count_marks(&mut self) {
        for (frame, samples) in self.samples.chunks_exact(self.size[0]).enumerate() {
            let is_told =
                |(column, sample): &(usize, &f64)| **sample < self.top && self.marks.is_saturated(frame, *column);
            self.at_ends[0] += samples.iter().enumerate().filter(is_told).count() as u64;
        }
    }

    /// Notes the photosites of a row that reach the top, as long as they are few.
    fn note_top(&mut self, row: usize) {
        let columns = self.size[0];
        let top = if self.top < f64::INFINITY { self.top } else { self.largest.0 };
        let most = most_at_top(self.size);
        let is_at_top = |frame: usize, column: usize| {
            self.marks.is_saturated(frame, column) || self.samples[frame * columns + column] >= top
        };
        if self.at_top.len() <= most {
            let reaches = |column: &usize| (0..self.frames).any(|frame| is_at_top(frame, *column));
            let own: Vec<[usize; 2]> =
                (0..columns).filter(reaches).take(most + 1).map(|column| [column, row]).collect();
            self.at_top.extend(own);
        }
    }

    #[inline(always)]
    fn add_gathered(&mut self) {
        let columns = self.size[0];
        let count = columns as f64;
        let mut share = 1.0 / self.frames as f64;
        if self.row_means.is_empty() {
            self.means.iter_mut().for_each(|mean| *mean *= share);
            (self.center, share) = (sum(&self.means) / count, 1.0);
        }
        let about = [share, self.center];
        let [above, squares] = center(&mut self.means, &mut self.above, &mut self.column_means, about);
        let (full, _) = self.full;
        if full < f64::INFINITY {
            self.full.1 += self.means.iter().map(|mean| u64::from(*mean >= full)).sum::<u64>();
        }
        self.row_means.push(above);
        self.squares += squares;
        self.steps.iter_mut().zip(steps(&self.above)).for_each(|(sum, of_row)| *sum += of_row);
        self.squared.fill(0.0);
        let (summed, times, row) = (self.summed(), self.times(), self.row_means.len() - 1);
        let mut all = 0.0;
        let columns_of = self.column_sums.chunks_exact_mut(columns);
        for ((index, samples), of_columns) in
            self.samples.chunks_exact_mut(columns).enumerate().zip(columns_of).take(summed)
        {
            let [of_row, product, square] =
                depart(samples, &self.means, &self.above, [of_columns, &mut self.column_squares]);
            self.frame_sums[index] += of_row;
            self.products[index] += product;
            self.slopes.add(product - of_row * above / count, squares - above * above / count);
            self.row_sums.push(of_row);
            self.neighbors.add(index, row, samples);
            all += square;
            let about = of_row / count;
            for (squared, sample) in self.squared.iter_mut().zip(&*samples) {
                let departure = *sample - about;
                *squared += departure * departure;
            }
        }
        if let Some(&of_row) = self.row_sums.last().filter(|_| summed < self.frames) {
            self.row_sums.push(-of_row);
        }
        self.row_squares.push(times * all);
        self.falling.add(&self.squared, &self.above);
        self.within[0] += times * sum(&self.squared);
        self.within[1] += times * times * dot(&self.squared, &self.squared);
        self.within[2] += times.powi(4) * fourth_powers(&self.squared);
    }

    /// Fourth cumulant of single photosites: that of differences, m₄ − 3 m₂², is twice as large.
    fn fourth(&self) -> f64 {
        let steps = ((self.size[0] - 1) * self.size[1]) as f64;
        let [second, fourth, _] = self.steps.map(|sum| sum / steps);
        ((fourth - 3.0 * second * second) / 2.0).max(0.0)
    }

    /// Two frames whose samples are the same but for one number that all of one are more: then all rows and columns of both depart
    /// alike, but for that. Frames that are one value but for few photosites, as full ones and those of no noise, may well be the same.
    fn copies(&self) -> Option<[usize; 2]> {
        /// Of frames of noise more of the samples differ from the next.
        const VARIED: f64 = 0.05;
        if self.uneven as f64 <= VARIED * (self.size[0] * self.size[1]) as f64 {
            return None;
        }
        /// What rounding leaves of one difference of sums, to the first of them and a code.
        const ROUNDED: f64 = 1e-9;
        let [columns, rows] = self.size.map(|extent| extent as f64);
        let are_one = |mut differences: Box<dyn Iterator<Item = f64> + '_>, count: f64| {
            let Some(first) = differences.next() else { return true };
            let allowed = ROUNDED * (first.abs() + count);
            differences.all(|difference| (difference - first).abs() <= allowed)
        };
        if self.frames == 2 {
            // The first of both departs by half of the number everywhere, and its squares are those of that.
            let sums = || self.row_sums.iter().step_by(2);
            let is_even = |(sum, square): (&f64, &f64)| {
                let of_mean = self.times() * sum * sum / columns;
                (square - of_mean).abs() <= ROUNDED * (of_mean + columns)
            };
            let are_even = sums().zip(&self.row_squares).all(is_even);
            return (are_even && are_one(Box::new(sums().copied()), columns)).then_some([0, 1]);
        }
        let column = |frame: usize| &self.column_sums[frame * self.size[0]..][..self.size[0]];
        let are_same = |[one, other]: &[usize; 2]| {
            let of_rows = self.row_sums.chunks_exact(self.frames).map(|sums| sums[*one] - sums[*other]);
            let of_columns = column(*one).iter().zip(column(*other)).map(|(one, other)| one - other);
            are_one(Box::new(of_rows), columns) && are_one(Box::new(of_columns), rows)
        };
        (1..self.frames).flat_map(|other| (0..other).map(move |one| [one, other])).find(are_same)
    }

    /// Gives the second of two frames what the first departed by, to the other side.
    fn complete(&mut self) {
        let times = self.times();
        self.column_squares.iter_mut().for_each(|square| *square *= times);
        if self.summed() < self.frames {
            self.frame_sums[1] = -self.frame_sums[0];
            self.products[1] = -self.products[0];
            let (first, second) = self.column_sums.split_at_mut(self.size[0]);
            second.iter_mut().zip(first).for_each(|(second, first)| *second = -*first);
        }
    }

    /// Of the mean of the frames, whose mean over photosites is so far above the center.
    fn spatial_sums(&self, above: f64) -> SquareSums {
        let [columns, rows] = self.size.map(|extent| extent as f64);
        let about = |sums: &[f64], each: f64| sums.iter().map(|sum| (sum / each - above).powi(2)).sum::<f64>() * each;
        SquareSums {
            all: self.squares - rows * columns * above * above,
            rows: about(&self.row_means, columns),
            columns: about(&self.column_means, rows),
        }
    }

    /// What the rows tell.
    pub fn finish(mut self) -> SiteSurvey {
        let copies = self.copies();
        self.complete();
        let [columns, rows] = self.size.map(|extent| extent as f64);
        let n = rows * columns;
        let (frames, times) = (self.frames as f64, self.times());
        let above: f64 = self.row_means.iter().sum::<f64>() / n;
        let mean = self.center + above;
        let spatial = self.spatial_sums(above);
        let spatial_sum = spatial.all;
        let drifts: Vec<f64> = self.frame_sums.iter().map(|sum| sum / n).collect();
        let is_uneven = spatial_sum > f64::EPSILON * n * mean * mean;
        let slope =
            |(product, drift): (&f64, &f64)| if is_uneven { (product - above * n * drift) / spatial_sum } else { 0.0 };
        let slopes: Vec<f64> = self.products.iter().zip(&drifts).map(slope).collect();
        // What is left of rows and of columns once the drift is out.
        let left = |sum: f64, each: f64, frame: usize, of_mean: f64| {
            sum / each - drifts[frame] - slopes[frame] * (of_mean / each - above)
        };
        let of_frame = |frame: usize| -> Vec<f64> {
            let of_rows = self.row_sums.chunks_exact(self.frames).zip(&self.row_means);
            of_rows.map(|(sums, of_mean)| left(sums[frame], columns, frame, *of_mean)).collect()
        };
        let of_rows: Vec<Vec<f64>> = (0..self.frames).map(of_frame).collect();
        let by_rows: f64 = of_rows.iter().flatten().map(|left| left * left).sum();
        let row_scatter = RowScatter::of(&of_rows, frames - 1.0, self.size[0]);
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
        let noise_of_mean = of_mean(&temporal);
        let fourth = self.fourth();
        let spatial = MeanSquares::of(spatial, self.size, 1.0).with_tails(fourth, n);
        let variance = all.max(0.0) / ((frames - 1.0) * (n - 2.0));
        // Photosites of unlike noise, as those that jump, make it scatter by more than normal ones alike do.
        let temporal = temporal.with_tails(self.temporal_tails(variance), 1.0);
        SiteSurvey {
            frames: self.frames,
            size: self.size,
            mean,
            mean_variance: noise_of_mean / (n * frames),
            variance,
            variance_variance: self.variance_variance(&drifts, n, self.in_lines(&temporal)),
            at_ends: self.at_ends,
            at_top: if self.at_top.len() <= most_at_top(self.size) { self.at_top } else { Vec::new() },
            mended: self.marks.mended,
            full: self.full.1,
            largest: (self.top == f64::INFINITY).then_some(self.largest),
            strangers: std::mem::take(&mut self.slopes).strangers(self.size, &spatial, &temporal),
            temporal,
            row_scatter,
            spatial,
            excess: excess([self.within[0], self.within[1]], self.frames, n),
            falling: self.falling.finish(frames, times),
            neighbors: self.neighbors.finish(self.frames),
            fourth,
            // A photosite has two neighbors.
            of_steps: [self.steps[1], self.steps[2] * 2.0],
            of_noise: [self.within[1], self.within[2]],
            frame_means: drifts.iter().map(|drift| mean + drift).collect(),
            copies,
        }
    }

    /// What the sum of the squares of all photosites scatters by, a variance, as they do apart from rows and columns.
    fn apart(&self) -> f64 {
        let [columns, rows] = self.size.map(|extent| extent as f64);
        let [sum, squares, _] = self.within;
        // Sums of squares about the rows have lost a share of 1/columns.
        (squares - sum * sum / (rows * columns)).max(0.0) * (1.0 + 2.0 / columns)
    }

    /// What such a temporal variance scatters by beyond that of as many normal samples, a variance.
    fn temporal_tails(&self, variance: f64) -> f64 {
        let freedom = (self.frames as f64 - 1.0) * (self.size[0] * self.size[1]) as f64;
        (self.apart() / (freedom * freedom) - 2.0 * variance * variance / freedom).max(0.0)
    }

    /// What the sum of the squares of all photosites scatters by as they have rows, and columns, in common, variances: (L − 1) times the mean
    /// square of N lines, of N − 1 values in each of L − 1 frames, of which that of places apart comes off.
    ///
    /// 2 (L − 1) (N − 1) (M² − M_rest²)
    fn in_lines(&self, temporal: &MeanSquares) -> [f64; 2] {
        let [columns, rows] = self.size.map(|extent| extent as f64);
        let of = |square: &MeanSquare, lines: f64| {
            let beyond = square.value * square.value - temporal.rest.value * temporal.rest.value;
            2.0 * (self.frames as f64 - 1.0) * (lines - 1.0) * beyond.max(0.0)
        };
        [of(&temporal.rows, rows), of(&temporal.columns, columns)]
    }

    /// What the temporal variance scatters by: photosites apart, and what they have in common in rows and columns. Rows beside rows and columns beside
    /// columns are compared besides, so that light which varies smoothly over the frame does not count; what they scatter by beyond that counts where
    /// it is beyond chance.
    fn variance_variance(&self, drifts: &[f64], n: f64, in_lines: [f64; 2]) -> f64 {
        /// Excess kurtosis of the square of a normal number, as of the noise of a line.
        const OF_SQUARES: f64 = 12.0;
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
        let apart = self.apart();
        let together = |sums: &[f64], in_lines: f64| {
            let steps: f64 = sums.windows(2).map(|two| (two[1] - two[0]).powi(2)).sum();
            let scatter = 0.5 * steps / (sums.len() as f64 - 1.0) * sums.len() as f64;
            let known = apart + in_lines;
            let of_lines = if known > 0.0 { in_lines / known } else { 0.0 };
            let error = ((3.0 + OF_SQUARES * of_lines * of_lines) / sums.len() as f64).sqrt();
            in_lines + beyond_chance(scatter, known, error)
        };
        let freedom = (self.frames as f64 - 1.0) * n;
        (apart + together(&of_rows, in_lines[0]) + together(&of_columns, in_lines[1])) / (freedom * freedom)
    }
}

/// So many photosites of a grid that reach the top are few.
fn most_at_top([columns, rows]: [usize; 2]) -> usize {
    columns * rows / 100
}

/// Gathers a row of each frame and adds it.
struct AddRow<'a> {
    tally: &'a mut Tally,
    site: &'a Site,
    bands: &'a [Vec<f32>],
    place: Range<usize>,
}

impl Kernel for AddRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.tally.gather(self.site, self.bands, self.place);
        self.tally.add_gathered();
    }
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
