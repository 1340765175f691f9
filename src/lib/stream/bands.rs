//! Bands of rows of one or several frames, read in step: each when the work on the last is done, or meanwhile.

use super::stage::RowSource;
use crate::error::{Error, Result};
use crate::frame::{Geometry, Window};
use crate::units::Quantity;
use std::ops::Range;
use std::sync::mpsc::{channel, sync_channel};
use std::thread::{self, ScopedJoinHandle};

/// Bands of each side that are under way at a time where reading, computing and writing overlap: one that is read or
/// written while the other is computed on.
pub(super) const UNDER_WAY: usize = 2;

/// Rows to work on, and those of each source that they depend on.
#[derive(Debug, Default)]
pub struct Band {
    rows: Range<usize>,
    parts: Vec<Part>,
}

/// What a band has of one source.
#[derive(Debug, Default)]
struct Part {
    frame_height: usize,
    width: usize,
    channels: usize,
    first_row: usize,
    samples: Vec<f32>,
}

impl Band {
    /// The frame's rows to work on.
    pub fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// What is seen of a source; sources count from 0, in the order in which they were given.
    ///
    /// # Panics
    ///
    /// When there are not so many sources.
    pub fn window<Q: Quantity>(&self, source: usize) -> Window<'_, Q> {
        let Part { frame_height, width, channels, first_row, samples } = &self.parts[source];
        Window::new(*frame_height, *first_row, *width, *channels, samples)
    }
}

/// The bands of frames, top to bottom.
pub(super) struct Bands<'a> {
    inputs: Vec<Input<'a>>,
    /// Rows that are wanted, from the first one on.
    rows: usize,
    /// Rows above and below that a row depends on.
    reach: usize,
    /// Rows that are asked for together.
    step: usize,
    band_rows: usize,
    /// The first row of the next band.
    first: usize,
}

/// A source, and where its reading stands.
struct Input<'a> {
    source: &'a mut dyn RowSource,
    /// Rows read so far.
    read: usize,
    /// The last of them, which the next band sees too, and the first of these.
    kept: Vec<f32>,
    kept_from: usize,
}

impl<'a> Bands<'a> {
    /// The first `rows` rows of each source in bands of a size for so many threads; `output` is the frame that is made of
    /// them, if any.
    pub fn new(
        sources: impl IntoIterator<Item = &'a mut dyn RowSource>,
        rows: usize,
        reach: usize,
        output: Option<&Geometry>,
        threads: usize,
    ) -> Self {
        let input = |source| Input { source, read: 0, kept: Vec::new(), kept_from: 0 };
        let inputs: Vec<Input<'a>> = sources.into_iter().map(input).collect();
        let geometries = || inputs.iter().map(|input| &input.source.header().geometry).chain(output);
        assert!(geometries().all(|geometry| rows <= geometry.height), "no frame has rows beyond its last");
        let natural = inputs.iter().map(|input| input.source.natural_rows()).fold(1, usize::max);
        let step = geometries().fold(natural, |step, geometry| geometry.step_rows(step));
        let band_rows = geometries().map(|geometry| geometry.band_rows(step, threads)).min().unwrap_or(1);
        Self { rows, reach, step, band_rows, first: 0, inputs }
    }

    /// Whether there is more than one band.
    pub fn are_several(&self) -> bool {
        self.band_rows < self.rows
    }

    /// Whether reading may wait for another program.
    fn may_wait(&self) -> bool {
        self.inputs.iter().any(|input| input.source.may_wait())
    }

    /// Reads what the next band needs; none after the last. `spare` is a band that has served.
    fn next(&mut self, mut spare: Band) -> Result<Option<Band>> {
        if self.first == self.rows {
            return Ok(None);
        }
        let end = (self.first + self.band_rows).min(self.rows);
        spare.parts.resize_with(self.inputs.len(), Part::default);
        for (input, part) in self.inputs.iter_mut().zip(&mut spare.parts) {
            // What a source decodes together is asked for together, the halo included.
            let needed = (end + self.reach).min(self.rows).saturating_sub(input.read);
            let wanted = needed.next_multiple_of(self.step).min(self.rows - input.read);
            input.next(wanted, end.saturating_sub(self.reach), part)?;
        }
        spare.rows = self.first..end;
        self.first = end;
        Ok(Some(spare))
    }

    /// Gives all bands to `work`; with `is_ahead`, the next ones are read on a thread of their own meanwhile.
    ///
    /// Where a source waits for another program, it is read in turn: a thread that waits could not be told to stop, and the
    /// pipe reads ahead itself.
    ///
    /// # Errors
    ///
    /// Those of the sources and of `work`, whichever meets the first band that goes wrong.
    pub fn each(self, is_ahead: bool, work: impl FnMut(&Band) -> Result<()>) -> Result<()> {
        if is_ahead && !self.may_wait() { self.ahead(work) } else { self.in_turn(work) }
    }

    fn in_turn(mut self, mut work: impl FnMut(&Band) -> Result<()>) -> Result<()> {
        let mut spare = Band::default();
        while let Some(band) = self.next(spare)? {
            work(&band)?;
            spare = band;
        }
        Ok(())
    }

    fn ahead(mut self, mut work: impl FnMut(&Band) -> Result<()>) -> Result<()> {
        thread::scope(|scope| {
            let (hand_on, read) = sync_channel::<Band>(1);
            let (give_back, spare) = channel::<Band>();
            for _ in 0..UNDER_WAY {
                // The receiver is at hand.
                drop(give_back.send(Band::default()));
            }
            let reader = thread::Builder::new().spawn_scoped(scope, move || -> Result<()> {
                // Either channel is closed where no more is wanted.
                while let Ok(spare) = spare.recv()
                    && let Some(band) = self.next(spare)?
                    && hand_on.send(band).is_ok()
                {}
                Ok(())
            });
            let reader = reader.map_err(|_| no_more_threads())?;
            let worked = read.iter().try_for_each(|band| {
                work(&band)?;
                drop(give_back.send(band));
                Ok(())
            });
            drop((read, give_back));
            // What the work met belongs to an earlier band than what the reader met.
            worked.and(ended(reader))
        })
    }
}

impl Input<'_> {
    /// Reads so many rows behind those that were kept, and keeps from `keep_from` on for the next band.
    fn next(&mut self, wanted: usize, keep_from: usize, part: &mut Part) -> Result<()> {
        let geometry = &self.source.header().geometry;
        let row_samples = geometry.row_samples();
        (part.frame_height, part.width, part.channels) = (geometry.height, geometry.width, geometry.channels.len());
        part.first_row = self.kept_from;
        std::mem::swap(&mut part.samples, &mut self.kept);
        self.kept.clear();
        if wanted > 0 {
            self.source.read(wanted, &mut part.samples)?;
            self.read += wanted;
        }
        self.kept_from = keep_from.max(part.first_row);
        self.kept.extend_from_slice(&part.samples[(self.kept_from - part.first_row) * row_samples..]);
        Ok(())
    }
}

/// The complaint where the system refuses another thread.
pub(super) fn no_more_threads() -> Error {
    Error::Data("the system starts no more threads".into()).change(&["threads"])
}

/// What a thread ended with; a panic goes on here.
pub(super) fn ended(thread: ScopedJoinHandle<'_, Result<()>>) -> Result<()> {
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}
