//! Whether frames that count as one are of one level, by their samples: overall, and from place to place.
//!
//! The median of samples whose levels lie s standard deviations apart scatters by s²/5 more than that of samples alike, up to s = ½; where they lie
//! far apart it is the sample of the level in the middle, with all of its noise.

use crate::frame::Geometry;

/// Blocks along a side at most, and photosites along the side of a block at least.
const MOST: usize = 16;
const LEAST_SIDE: usize = 16;
/// Samples in which one and the same resampling mixes others lie nearer.
const LEAST_LAG: usize = 16;
/// Pairs of samples of a block and class that tell their noise.
const LEAST_PAIRS: f64 = 64.0;

/// Where levels lie apart by more than the noise lets pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unlike {
    /// The share of the frame.
    pub share: f64,
    /// The median, over this, of what they differ by in standard deviations of a sample.
    pub spread: f64,
}

/// Sums over samples of several frames in step, by blocks and classes.
#[derive(Debug, Clone)]
pub(crate) struct LevelSums {
    frames: usize,
    classes: usize,
    size: [usize; 2],
    blocks: [usize; 2],
    /// Columns between samples that are compared.
    lag: usize,
    /// Of each frame, behind one another for each block and class.
    sums: Vec<f64>,
    cells: Vec<Cell>,
}

/// Of a block and class: how many samples, and squares of differences of differences, and how many.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    count: f64,
    squares: f64,
    pairs: f64,
}

impl Cell {
    /// The variance of a sample over exposures, the mean of all frames.
    fn variance(&self) -> Option<f64> {
        (self.pairs >= LEAST_PAIRS).then(|| 0.25 * self.squares / self.pairs)
    }
}

impl LevelSums {
    /// Of so many frames, whose classes come again after so many columns.
    pub(crate) fn of(frames: usize, classes: usize, geometry: &Geometry, period: usize) -> Self {
        let size = [geometry.width, geometry.height].map(|side| side.max(1));
        let blocks = size.map(|side| (side / LEAST_SIDE).clamp(1, MOST));
        let cells = vec![Cell::default(); blocks[0] * blocks[1] * classes];
        let lag = LEAST_LAG.next_multiple_of(period.max(1));
        Self { frames, classes, size, blocks, lag, sums: vec![0.0; cells.len() * frames], cells }
    }

    /// Takes in row `y` of one plane, whose classes are those of `of_row` again and again: the samples of each frame, where they count.
    pub(crate) fn take(&mut self, y: usize, of_row: &[usize], counts: impl Fn(usize) -> bool, rows: &[&[f32]]) {
        let row_of_blocks = y * self.blocks[1] / self.size[1] * self.blocks[0];
        let width = rows.first().map_or(0, |row| row.len());
        let is_good = |x: usize| counts(x) && rows.iter().all(|row| row[x].is_finite());
        let good: Vec<bool> = (0..width).map(is_good).collect();
        for x in (0..width).filter(|x| good[*x]) {
            let block = row_of_blocks + x * self.blocks[0] / self.size[0];
            let place = block * self.classes + of_row[x % of_row.len()];
            let cell = &mut self.cells[place];
            cell.count += 1.0;
            let sums = &mut self.sums[place * self.frames..][..self.frames];
            sums.iter_mut().zip(rows).for_each(|(sum, row)| *sum += f64::from(row[x]));
            if good.get(x + self.lag) == Some(&true) {
                for two in rows.windows(2) {
                    let apart = |x: usize| f64::from(two[1][x]) - f64::from(two[0][x]);
                    cell.squares += (apart(x) - apart(x + self.lag)).powi(2);
                }
                cell.pairs += self.frames.saturating_sub(1) as f64;
            }
        }
    }

    /// Means of each frame by class; 0 of a class without a sample.
    pub(crate) fn levels(&self) -> Vec<Vec<f64>> {
        let of = |frame: usize, class: usize| {
            let cells = (class..self.cells.len()).step_by(self.classes);
            let (sum, count) = cells.fold((0.0, 0.0), |(sum, count), cell| {
                (sum + self.sums[cell * self.frames + frame], count + self.cells[cell].count)
            });
            if count > 0.0 { sum / count } else { 0.0 }
        };
        (0..self.frames).map(|frame| (0..self.classes).map(|class| of(frame, class)).collect()).collect()
    }

    /// What the levels of the whole frames differ by, in standard deviations of a sample, in the class where that is most.
    pub(crate) fn spread(&self) -> f64 {
        let levels = self.levels();
        let of_class = |class: usize| {
            let cells = self.cells.iter().skip(class).step_by(self.classes);
            let (squares, pairs, count) = cells.fold((0.0, 0.0, 0.0), |(squares, pairs, count), cell| {
                (squares + cell.squares, pairs + cell.pairs, count + cell.count)
            });
            let variance = Cell { count, squares, pairs }.variance()?;
            let means: Vec<f64> = levels.iter().map(|of_frame| of_frame[class]).collect();
            spread(&means, variance, count)
        };
        (0..self.classes).filter_map(of_class).fold(0.0, f64::max)
    }

    /// Where levels lie so far apart, beyond factors by which each frame is brought to one level, that medians scatter by 5 % more than those of
    /// samples alike, in 5 % of the frames or more.
    pub(crate) fn unlike(&self, factors: Option<&[Vec<f64>]>) -> Option<Unlike> {
        const MOST_APART: f64 = 0.5;
        const LEAST_SHARE: f64 = 0.05;
        let (mut all, mut apart) = (0.0, Vec::new());
        for (place, cell) in self.cells.iter().enumerate() {
            let Some(variance) = cell.variance() else { continue };
            let factor = |frame: usize| factors.map_or(1.0, |factors| factors[frame][place % self.classes]);
            let sums = &self.sums[place * self.frames..][..self.frames];
            let means: Vec<f64> =
                sums.iter().enumerate().map(|(frame, sum)| factor(frame) * sum / cell.count).collect();
            let Some(spread) = spread(&means, variance, cell.count) else { continue };
            all += 1.0;
            apart.extend((spread > MOST_APART).then_some(spread));
        }
        apart.sort_by(f64::total_cmp);
        let share = apart.len() as f64 / f64::max(all, 1.0);
        (share > LEAST_SHARE).then(|| Unlike { share, spread: apart[apart.len() / 2] })
    }
}

/// What means of so many samples differ by beyond chance, in standard deviations of a sample; none of samples without noise.
fn spread(means: &[f64], variance: f64, count: f64) -> Option<f64> {
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let apart = means.iter().map(|of_frame| (of_frame - mean).powi(2)).sum::<f64>() / n;
    (variance > 0.0).then(|| ((apart - variance * (n - 1.0) / (n * count)).max(0.0) / variance).sqrt())
}
