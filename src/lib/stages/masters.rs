//! Frames of one kind that count as one: their average, sample by sample, while all are read in step.

use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::{AverageRecord, FrameHeader};
use crate::names::Named;
use crate::numerics::averages::{CLIP, Combine, average};
use crate::numerics::cut_off::AtZero;
use crate::stream::RowSource;
use rayon::prelude::*;

/// How frames are averaged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Averaging {
    /// Mean, median or clipped mean.
    pub combine: Combine,
    /// Standard deviations beyond which the last leaves samples out.
    pub clip: f64,
}

impl Default for Averaging {
    fn default() -> Self {
        Self { combine: Combine::Mean, clip: CLIP }
    }
}

impl Averaging {
    /// As a record has it.
    pub fn of(record: &AverageRecord) -> Self {
        Self { combine: record.combine, clip: record.clip.unwrap_or(CLIP) }
    }

    /// The record of so many frames.
    pub fn record(self, frames: usize) -> AverageRecord {
        let clip = (self.combine == Combine::Clipped).then_some(self.clip);
        AverageRecord { frames: u32::try_from(frames).unwrap_or(u32::MAX), combine: self.combine, clip }
    }

    /// The record of some frames, each of which may be an average of exposures itself.
    ///
    /// # Errors
    ///
    /// [`Error::Format`](crate::error::Error::Format) for averages that do not go into another: medians, and means of other numbers of frames.
    pub fn record_of<'a>(self, frames: impl IntoIterator<Item = &'a FrameHeader>) -> Result<AverageRecord> {
        let mut frames = frames.into_iter();
        let Some(first) = frames.next() else { return Ok(self.record(0)) };
        let before = |frame: &FrameHeader| frame.metadata.average.map(|record| record.average());
        let (own, mut count) = (before(first), 1);
        for frame in frames {
            count += 1;
            let differs = own.or(before(frame)).filter(|_| own != before(frame));
            let no_means = own.is_some_and(|own| [own.combine, self.combine].iter().any(|how| *how != Combine::Mean));
            if differs.is_some() || no_means {
                let how = differs.or(own).map_or("mean", |record| record.combine.name());
                return Err(frame.refuse(format!(
                    "it is to go with {} into an average, and one of the two is the {how} of several frames already; only means of as \
                     many frames make a mean again",
                    first.name
                )));
            }
        }
        let record = self.record(count);
        Ok(match own {
            None => record,
            Some(own) if count == 1 => own,
            Some(own) => AverageRecord { frames: own.frames.saturating_mul(record.frames), ..record },
        })
    }

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self.combine {
            Combine::Mean => "mean",
            Combine::Median => "median",
            Combine::Clipped => "clipped mean",
        }
    }
}

/// How samples are brought to one level before they are averaged: what no light reads comes off, and the rest is multiplied.
#[derive(Debug, Clone, Copy)]
pub struct Leveling<'a> {
    /// What comes off each sample of some rows.
    pub off: &'a [f64],
    /// What samples of each frame are multiplied by, class by class.
    pub factors: &'a [Vec<f64>],
    /// The class of each sample of these rows.
    pub classes: &'a [usize],
}

impl Leveling<'_> {
    fn sample(&self, frame: usize, place: usize, sample: f32) -> f32 {
        to_sample((f64::from(sample) - self.off[place]) * self.factors[frame][self.classes[place]])
    }
}

/// What the rows of all frames may take that an average needs at a time, where it is no mean.
const ALL_BYTES: usize = 64 << 20;

/// Samples of a frame that are worth a task of their own.
const SHARE: usize = 1 << 10;

/// Frames read in step. The mean needs some rows of one of them at a time, others some rows of each.
#[derive(Debug)]
pub struct Frames<S> {
    frames: Vec<S>,
    averaging: Averaging,
    band: Vec<f32>,
    clipped: u64,
    /// Whether the scatter among frames is kept too, and that of the last rows.
    keeps_scatter: bool,
    scatter: Vec<f64>,
    /// The same of the largest samples.
    keeps_largest: bool,
    largest: Vec<f32>,
    /// What was read of each frame so far.
    levels: Vec<Level>,
}

/// Sums over finite samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Level {
    count: f64,
    sum: f64,
    squares: f64,
    /// How many are below zero, exactly zero, exactly one, and no whole numbers.
    below_zero: f64,
    at_zero: f64,
    at_one: f64,
    fractional: f64,
}

impl Level {
    /// Takes in samples, in lanes of their own so that one sum need not wait for another.
    fn take(&mut self, samples: &[f32]) {
        const LANES: usize = 8;
        let mut lanes = [[0.0_f64; LANES]; 7];
        for chunk in samples.chunks(LANES) {
            for (lane, sample) in chunk.iter().enumerate() {
                let (one, sample) = if sample.is_finite() { (1.0, f64::from(*sample)) } else { (0.0, 0.0) };
                lanes[0][lane] += one;
                lanes[1][lane] += sample;
                lanes[2][lane] += sample * sample;
                lanes[3][lane] += if sample < 0.0 { 1.0 } else { 0.0 };
                lanes[4][lane] += if sample == 0.0 { one } else { 0.0 };
                lanes[5][lane] += if sample == 1.0 { 1.0 } else { 0.0 };
                lanes[6][lane] += if sample.fract() == 0.0 { 0.0 } else { 1.0 };
            }
        }
        let [count, sum, squares, below_zero, at_zero, at_one, fractional] = lanes.map(|lane| lane.iter().sum::<f64>());
        self.count += count;
        self.sum += sum;
        self.squares += squares;
        self.below_zero += below_zero;
        self.at_zero += at_zero;
        self.at_one += at_one;
        self.fractional += fractional;
    }
}

impl<S: RowSource> Frames<S> {
    /// Frames that fit each other.
    pub fn new(frames: Vec<S>, averaging: Averaging) -> Self {
        Self {
            frames,
            averaging,
            band: Vec::new(),
            clipped: 0,
            keeps_scatter: false,
            scatter: Vec::new(),
            keeps_largest: false,
            largest: Vec::new(),
            levels: Vec::new(),
        }
    }

    /// The frame whose mean so far is farthest from the median of those of all, its mean, and that median; none where means differ by no
    /// more than those of dark frames do.
    pub fn unlike(&self) -> Option<(&str, [f64; 2])> {
        /// Black levels drift by less, in ADU and as a share.
        const DRIFT: [f64; 2] = [4.0, 0.02];
        /// Standard deviations, all of which may be those of whole lines.
        const Z: f64 = 8.0;
        let mut means: Vec<f64> = self.levels.iter().map(|level| level.sum / level.count).collect();
        let of_frames = means.clone();
        means.sort_by(f64::total_cmp);
        let median = f64::midpoint(*means.get(means.len().checked_sub(1)? / 2)?, means[means.len() / 2]);
        let off = |index: &usize| (of_frames[*index] - median).abs();
        let farthest = (0..of_frames.len()).max_by(|a, b| off(a).total_cmp(&off(b)))?;
        let Level { count, sum, squares, .. } = self.levels[farthest];
        let head = self.frames[farthest].header();
        let lines = head.geometry.width.min(head.geometry.height).max(1) as f64;
        let scatter = (squares / count - (sum / count).powi(2)).max(0.0);
        let allowed = DRIFT[0].max(DRIFT[1] * median.abs()) + Z * (scatter / lines).sqrt();
        (off(&farthest) > allowed).then(|| (head.name.as_str(), [of_frames[farthest], median]))
    }

    /// The mean of what was read of all of them so far; none of nothing.
    pub fn level(&self) -> Option<f64> {
        let [sum, count] = self.levels.iter().fold([0.0; 2], |[sum, count], of| [sum + of.sum, count + of.count]);
        (count > 0.0).then(|| sum / count)
    }

    /// The first frame that has more samples below zero so far than codes of a camera do, and their share.
    pub fn below_zero(&self) -> Option<(&str, f64)> {
        /// Programs that average codes, or take out what stands out, leave fewer.
        const MOST: f64 = 0.05;
        let shares = self.levels.iter().map(|level| level.below_zero / level.count);
        let (frame, share) = self.frames.iter().zip(shares).find(|(_, share)| *share > MOST)?;
        Some((frame.header().name.as_str(), share))
    }

    /// The first frame most samples of which are exactly zero so far, and their share.
    pub fn at_zero(&self) -> Option<(&str, f64)> {
        const MOST: f64 = 0.5;
        let shares = self.levels.iter().map(|level| level.at_zero / level.count);
        let (frame, share) = self.frames.iter().zip(shares).find(|(_, share)| *share > MOST)?;
        Some((frame.header().name.as_str(), share))
    }

    /// How many samples of all so far are the lowest codes; none of any that are no codes as a converter gave them.
    pub fn lowest_codes(&self) -> Option<AtZero> {
        let one = |level: &Level| AtZero { count: level.count, zeros: level.at_zero, ones: level.at_one };
        let are_codes = self.levels.iter().all(|level| level.below_zero == 0.0 && level.fractional == 0.0);
        are_codes.then(|| self.levels.iter().map(one).fold(AtZero::default(), AtZero::plus))
    }

    /// Whether most samples of all so far are no whole numbers, as no camera writes them.
    pub fn are_fractional(&self) -> bool {
        let [fractional, count] =
            self.levels.iter().fold([0.0; 2], |[some, all], level| [some + level.fractional, all + level.count]);
        2.0 * fractional > count
    }

    /// Each of them.
    pub fn frames(&self) -> impl Iterator<Item = &S> {
        self.frames.iter()
    }

    /// Keeps the scatter of each sample among the frames from now on.
    pub fn keep_scatter(&mut self) {
        self.keeps_scatter = true;
    }

    /// Variances among the frames, of the rows that were averaged last; empty where they are not kept.
    pub fn scatter(&self) -> &[f64] {
        &self.scatter
    }

    /// Keeps the largest of each sample among the frames from now on.
    pub fn keep_largest(&mut self) {
        self.keeps_largest = true;
    }

    /// The largest among the frames, of the rows that were averaged last; empty where they are not kept.
    pub fn largest(&self) -> &[f32] {
        &self.largest
    }

    /// How they are averaged.
    pub fn averaging(&self) -> Averaging {
        self.averaging
    }

    /// Samples that were clipped so far.
    pub fn clipped(&self) -> u64 {
        self.clipped
    }

    /// Averages the next `rows` rows, `[row][channel][column]`.
    ///
    /// # Errors
    ///
    /// Those of the frames.
    pub fn next(&mut self, rows: usize, made: &mut Vec<f64>) -> Result<()> {
        self.next_leveled(rows, None, made)
    }

    /// The same of samples that are brought to one level first, which means do not need.
    ///
    /// # Errors
    ///
    /// Those of the frames.
    pub fn next_leveled(&mut self, rows: usize, leveling: Option<Leveling>, made: &mut Vec<f64>) -> Result<()> {
        made.clear();
        self.scatter.clear();
        self.largest.clear();
        let row_samples = self.frames.first().map_or(0, |frame| frame.header().geometry.row_samples());
        if self.averaging.combine == Combine::Mean {
            return self.mean(rows * row_samples, rows, made);
        }
        let row_bytes = (self.frames.len() * row_samples * size_of::<f32>()).max(1);
        let mut left = rows;
        while left > 0 {
            let step = (ALL_BYTES / row_bytes).clamp(1, left);
            self.average(step * row_samples, step, leveling, made)?;
            left -= step;
        }
        Ok(())
    }

    fn mean(&mut self, samples: usize, rows: usize, made: &mut Vec<f64>) -> Result<()> {
        made.resize(samples, 0.0);
        let count = self.frames.len() as f64;
        // Of samples less those of the first frame, so that nothing is lost.
        let mut first: Vec<f32> = Vec::new();
        let mut sums = vec![[0.0_f64; 2]; if self.keeps_scatter { samples } else { 0 }];
        self.levels.resize(self.frames.len(), Level::default());
        for (frame, level) in self.frames.iter_mut().zip(&mut self.levels) {
            self.band.clear();
            frame.read(rows, &mut self.band)?;
            level.take(&self.band);
            for (sum, &sample) in made.iter_mut().zip(&self.band) {
                *sum += f64::from(sample);
            }
            if self.keeps_largest {
                self.largest.resize(samples, f32::NEG_INFINITY);
                raise(&mut self.largest, &self.band);
            }
            if self.keeps_scatter {
                if first.is_empty() {
                    first.clone_from(&self.band);
                }
                for ((sums, sample), first) in sums.iter_mut().zip(&self.band).zip(&first) {
                    let off = f64::from(*sample) - f64::from(*first);
                    sums[0] += off;
                    sums[1] += off * off;
                }
            }
        }
        made.iter_mut().for_each(|sum| *sum /= count);
        self.scatter.extend(sums.iter().map(|[sum, square]| (square - sum * sum / count).max(0.0) / (count - 1.0)));
        Ok(())
    }

    /// Reads the next `rows` rows of each frame, one behind another.
    ///
    /// # Errors
    ///
    /// Those of the frames.
    pub fn read_each(&mut self, rows: usize) -> Result<&[f32]> {
        self.largest.clear();
        let samples = self.frames.first().map_or(0, |frame| rows * frame.header().geometry.row_samples());
        self.read_all(samples, rows)?;
        Ok(&self.band)
    }

    fn read_all(&mut self, samples: usize, rows: usize) -> Result<()> {
        self.band.clear();
        self.levels.resize(self.frames.len(), Level::default());
        for (frame, level) in self.frames.iter_mut().zip(&mut self.levels) {
            let from = self.band.len();
            frame.read(rows, &mut self.band)?;
            level.take(&self.band[from..]);
        }
        if self.keeps_largest {
            let start = self.largest.len();
            self.largest.resize(start + samples, f32::NEG_INFINITY);
            self.band.chunks_exact(samples.max(1)).for_each(|frame| raise(&mut self.largest[start..], frame));
        }
        Ok(())
    }

    fn average(&mut self, samples: usize, rows: usize, leveling: Option<Leveling>, made: &mut Vec<f64>) -> Result<()> {
        self.read_all(samples, rows)?;
        let start = made.len();
        made.resize(start + samples, 0.0);
        let kept = self.scatter.len();
        self.scatter.resize(if self.keeps_scatter { kept + samples } else { 0 }, 0.0);
        let Self { averaging, band, frames, keeps_scatter, .. } = self;
        let (averaging, band, count) = (*averaging, &*band, frames.len());
        let share = |first: usize, made: &mut [f64], scatter: Option<&mut [f64]>| {
            let mut of_site = Vec::with_capacity(count);
            let mut clipped = 0;
            let mut variances = Vec::new();
            for (index, made) in made.iter_mut().enumerate() {
                of_site.clear();
                let place = first + index;
                of_site.extend((0..count).map(|frame| match &leveling {
                    None => band[frame * samples + place],
                    Some(leveling) => leveling.sample(frame, start + place, band[frame * samples + place]),
                }));
                if scatter.is_some() {
                    variances.push(variance(&of_site));
                }
                let (average, left_out) = average(averaging.combine, &mut of_site, averaging.clip);
                *made = average;
                clipped += left_out;
            }
            if let Some(scatter) = scatter {
                scatter.copy_from_slice(&variances);
            }
            clipped
        };
        let shares = made[start..].par_chunks_mut(SHARE).enumerate();
        self.clipped += if *keeps_scatter {
            let scatters = self.scatter[kept..].par_chunks_mut(SHARE);
            shares.zip(scatters).map(|((index, made), scatter)| share(index * SHARE, made, Some(scatter))).sum::<u64>()
        } else {
            shares.map(|(index, made)| share(index * SHARE, made, None)).sum::<u64>()
        };
        Ok(())
    }
}

/// Raises each of `largest` to the sample of a frame.
fn raise(largest: &mut [f32], frame: &[f32]) {
    largest.iter_mut().zip(frame).for_each(|(largest, sample)| *largest = largest.max(*sample));
}

/// The variance of samples of one photosite.
fn variance(samples: &[f32]) -> f64 {
    let count = samples.len() as f64;
    let mean = samples.iter().map(|sample| f64::from(*sample)).sum::<f64>() / count;
    samples.iter().map(|sample| (f64::from(*sample) - mean).powi(2)).sum::<f64>() / (count - 1.0)
}
