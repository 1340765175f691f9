//! Flats of unlike brightness, brought to one level before their median is taken.
//!
//! F = median of s (M − D) over frames M,  s = ⟨⟨M − D⟩⟩/⟨M − D⟩
//!
//! D is what no light reads, ⟨M − D⟩ the mean of a frame over the photosites of a class that are not saturated in any, and ⟨⟨M − D⟩⟩ that of
//! all frames. Of frames as they are the median would be that of the middle brightness, with the noise of one.

use super::levels::FlatLevels;
use super::{FlatFrames, Pedestal, is_full};
use crate::error::Result;
use crate::frame::to_sample;
use crate::numerics::averages::Combine;
use crate::stages::darks::Fitness;
use crate::stages::level_sums::LevelSums;
use crate::stages::masters::Leveling;
use crate::stream::RowSource;

impl<S: RowSource> FlatFrames<S> {
    /// Whether levels count in how they are averaged: not of means, nor of fewer than three frames.
    pub fn wants_levels(&self) -> bool {
        self.frames.averaging().combine != Combine::Mean && self.frames.frames().count() > 2
    }

    /// Reads all rows for the levels of the frames.
    ///
    /// # Errors
    ///
    /// Those of the frames; [`Error::Format`](crate::error::Error::Format) of one that is not lit.
    pub fn levels(mut self) -> Result<FlatLevels> {
        /// Where the standard deviation of a median is 0.2 % larger than that of samples alike.
        const APART: f64 = 0.1;
        let count = self.frames.frames().count();
        let geometry = self.head.geometry.clone();
        let (width, planes) = (geometry.width, geometry.channels.len());
        let mut sums = LevelSums::of(count, self.classes.count(), &geometry, self.classes.period()[0]);
        let step = (geometry.cached_rows() / count).max(1);
        while self.rows_made < geometry.height {
            let first = self.rows_made;
            let rows = step.min(geometry.height - first);
            self.read_off(rows)?;
            let samples = rows * geometry.row_samples();
            let mut each = self.frames.read_each(rows)?.to_vec();
            each.chunks_exact_mut(samples).for_each(|frame| {
                frame.iter_mut().zip(&self.off).for_each(|(sample, off)| *sample = to_sample(f64::from(*sample) - off));
            });
            for (index, largest) in self.frames.largest().chunks_exact(width).enumerate() {
                let (y, plane) = (first + index / planes, index % planes);
                let of_row = self.classes.row(y, plane);
                let lines: Vec<&[f32]> =
                    each.chunks_exact(samples).map(|frame| &frame[index * width..][..width]).collect();
                sums.take(y, &of_row, |x| !is_full(self.full, x, y, plane, largest[x]), &lines);
            }
            self.rows_made += rows;
        }
        let levels = sums.levels();
        let classes = 0..self.classes.count();
        let means: Vec<f64> =
            classes.clone().map(|class| levels.iter().map(|of| of[class]).sum::<f64>() / count as f64).collect();
        for (frame, levels) in self.frames.frames().zip(&levels) {
            let dim = classes.clone().find(|class| means[*class] != 0.0 && levels[*class] <= 0.0);
            if let Some(class) = dim {
                let problem =
                    format!("its mean is {:.1} ADU above what no light reads; a flat field is lit", levels[class]);
                return Err(frame.header().refuse(problem));
            }
        }
        let factor = |level: f64, mean: f64| if level > 0.0 { mean / level } else { 1.0 };
        let factors: Vec<Vec<f64>> = levels
            .iter()
            .map(|of| of.iter().zip(&means).map(|(level, mean)| factor(*level, *mean)).collect())
            .collect();
        let lit = classes.filter(|class| means[*class] > 0.0).count().max(1) as f64;
        let share = |of: &Vec<f64>| {
            of.iter().zip(&means).filter(|(_, mean)| **mean > 0.0).map(|(level, mean)| level / mean).sum::<f64>() / lit
        };
        let unlike = sums.unlike(Some(&factors));
        let factors = (sums.spread() > APART).then_some(factors);
        Ok(FlatLevels { factors, shares: levels.iter().map(share).collect(), unlike })
    }

    /// The same brought to one level.
    #[must_use]
    pub fn at(self, levels: Option<FlatLevels>) -> Self {
        Self { levels, ..self }
    }

    /// How bright they are, where that counts.
    pub fn leveled(&self) -> Option<&FlatLevels> {
        self.levels.as_ref()
    }

    /// Reads what no light reads in the next rows.
    fn read_off(&mut self, rows: usize) -> Result<()> {
        let (width, planes) = (self.head.geometry.width, self.head.geometry.channels.len());
        self.off.clear();
        match &mut self.pedestal {
            Pedestal::Frames(darks) => self.off.extend_from_slice(darks.next(rows)?),
            Pedestal::Level(level) => {
                for line in 0..rows * planes {
                    let black = level.row(self.rows_made + line / planes);
                    self.off.extend((0..width).map(|x| black.at(x)));
                }
            }
        }
        Ok(())
    }

    /// The class of each sample of the next rows.
    fn next_classes(&self, rows: usize) -> Vec<usize> {
        let (width, planes) = (self.head.geometry.width, self.head.geometry.channels.len());
        let lines = (0..rows * planes).map(|line| self.classes.row(self.rows_made + line / planes, line % planes));
        lines.flat_map(|of_row| of_row.into_iter().cycle().take(width).collect::<Vec<_>>()).collect()
    }

    /// Makes F of the next rows.
    pub(super) fn next(&mut self, rows: usize) -> Result<()> {
        let (width, planes) = (self.head.geometry.width, self.head.geometry.channels.len());
        self.read_off(rows)?;
        match self.levels.as_ref().and_then(|levels| levels.factors.as_ref()) {
            Some(factors) => {
                let classes = self.next_classes(rows);
                let leveling = Leveling { off: &self.off, factors, classes: &classes };
                self.frames.next_leveled(rows, Some(leveling), &mut self.made)?;
            }
            None => {
                self.frames.next(rows, &mut self.made)?;
                self.made.iter_mut().zip(&self.off).for_each(|(flat, off)| *flat -= off);
            }
        }
        if matches!(self.pedestal, Pedestal::Frames(_)) {
            let lines = self.made.chunks_exact(width).zip(self.off.chunks_exact(width)).enumerate();
            for (_, (flat, dark)) in lines.filter(|(index, _)| Fitness::looks_at(self.rows_made + index / planes)) {
                let flat: Vec<f32> = flat.iter().zip(dark).map(|(flat, dark)| to_sample(flat + dark)).collect();
                // Averages of any number scatter by less than one dark frame.
                self.fitness.take(&flat, dark, None);
            }
        }
        if self.transfer.is_some() {
            for (index, line) in self.made.chunks_exact_mut(width).enumerate() {
                let (y, passage) = (self.rows_made + index / planes, &mut self.passages[index % planes]);
                passage.entering(y).copy_from_slice(line);
                line.copy_from_slice(passage.leaving(y));
            }
        }
        self.rows_made += rows;
        Ok(())
    }
}
