//! Blooming: charge beyond full well spills over along its column.
//!
//! Of what a photosite has beyond its full well a share β is not drained but spills, half of it down the column and half up.
//! On its way it fills each photosite that has room, the nearest first, until nothing is left of it, or leaves the column at
//! its end. Where what comes from above meets what comes from below, the former has filled first.
//!
//! What flows past the row y of a column is, down and then up,
//!
//! dᵧ = max(0, dᵧ₋₁ − rᵧ) + β eᵧ/2,  uᵧ = max(0, uᵧ₊₁ − r′ᵧ) + β eᵧ/2,
//!
//! e what a photosite has beyond full well, r the room that it has, r′ what is left of it. Charge is conserved: what is drained,
//! what leaves at the ends, and what is in the wells at last is what was collected. [`Spill`] does it, row by row.

use super::smear::check_whole;
use super::{AddNoise, Charges, Line, Scratch, add, not_finite};
use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{FrameHeader, PoissonKind};
use crate::numerics::vectors::{self, Kernel};
use crate::random::spans;
use crate::stages::transfer::Transfer;
use crate::stream::{Counts, RowSink, Stage};
use crate::units::{Electrons, ExpectedElectrons};

/// Charge that spills along columns: rows go through [`down`](Self::down) from the first to the last, then through
/// [`up`](Self::up) from the last to the first.
///
/// Between the two, a row holds charges; where beyond full well, that which goes up besides it; and a negative one is that of a
/// photosite that took some up. In the end none is beyond full well.
///
/// # Examples
///
/// ```
/// use cyanometer::stages::noise::bloom::Spill;
///
/// // One column: of 60 electrons beyond full well half spill, 15 each way; the neighbors have room for 10 and 20.
/// let mut rows = [[80.0], [90.0], [160.0], [80.0], [0.0]];
/// let mut spill = Spill::new(100.0, 0.5, 1);
/// rows.iter_mut().for_each(|row| spill.down(row));
/// spill.turn();
/// rows.iter_mut().rev().for_each(|row| spill.up(row));
/// assert_eq!(rows.map(|[charge]: [f32; 1]| charge.abs()), [85.0, 100.0, 100.0, 95.0, 0.0]);
/// assert_eq!((spill.full(), spill.bloomed()), (1, 3));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Spill {
    full_well_e: f64,
    /// What of an excess spills to each side.
    half: f64,
    flows: Vec<f64>,
    full: u64,
    bloomed: u64,
    lost_e: f64,
}

impl Spill {
    /// Nothing yet; of what is beyond full well the share `blooming` spills.
    pub fn new(full_well_e: f64, blooming: f64, width: usize) -> Self {
        let full_well_e = f64::from(to_sample(full_well_e));
        Self { full_well_e, half: blooming / 2.0, flows: vec![0.0; width], full: 0, bloomed: 0, lost_e: 0.0 }
    }

    /// Takes the charges of the next row.
    pub fn down(&mut self, row: &mut [f32]) {
        let Self { full_well_e, half, .. } = *self;
        for (charge, flow) in row.iter_mut().zip(&mut self.flows) {
            let own = f64::from(*charge);
            if own > full_well_e {
                let each = half * (own - full_well_e);
                *flow += each;
                *charge = to_sample(full_well_e + each);
                self.full += 1;
            } else if *flow > 0.0 {
                *charge = fill(own, flow, full_well_e);
            }
        }
    }

    /// The last row is in; what has come to it leaves.
    pub fn turn(&mut self) {
        self.end();
    }

    /// Takes the row above the last one, as [`down`](Self::down) left it; the first of them is the last row.
    pub fn up(&mut self, row: &mut [f32]) {
        let full_well_e = self.full_well_e;
        for (charge, flow) in row.iter_mut().zip(&mut self.flows) {
            let own = f64::from(*charge);
            if own > full_well_e {
                *flow += own - full_well_e;
                *charge = to_sample(full_well_e);
            } else if *flow > 0.0 {
                *charge = fill(own, flow, full_well_e);
            }
            self.bloomed += u64::from(*charge < 0.0);
        }
    }

    /// What has come to the end of the columns leaves.
    fn end(&mut self) {
        self.lost_e += self.flows.iter().sum::<f64>();
        self.flows.fill(0.0);
    }

    /// Photosites whose own charge was beyond full well.
    pub fn full(&self) -> u64 {
        self.full
    }

    /// Photosites that took charge of others up.
    pub fn bloomed(&self) -> u64 {
        self.bloomed
    }

    /// Charge that has left at the ends of the columns, e⁻.
    pub fn lost_e(&self) -> f64 {
        self.lost_e + self.flows.iter().sum::<f64>()
    }
}

/// Fills a photosite that holds `own` from what flows past it; negative where it has taken any. What is no number has no room.
fn fill(own: f64, flow: &mut f64, full_well_e: f64) -> f32 {
    let room = full_well_e - own.abs();
    if room.is_nan() || room <= 0.0 {
        return to_sample(own);
    }
    let taken = room.min(*flow);
    *flow -= taken;
    to_sample(if taken < room { -(own.abs() + taken) } else { -full_well_e })
}

/// The charges of an exposure, whatever full well holds.
#[derive(Debug, Clone)]
pub struct Collected(AddNoise);

impl Collected {
    pub(super) fn of(noise: &AddNoise) -> Self {
        let mut noise = noise.clone();
        noise.model.full_well_e = f64::INFINITY;
        Self(noise)
    }
}

impl Stage for Collected {
    type Input = ExpectedElectrons;
    type Output = Electrons;

    fn header(&self) -> &FrameHeader {
        self.0.header()
    }

    fn apply(&self, input: Window<'_, ExpectedElectrons>, mut output: Rows<'_, Electrons>) -> Counts {
        let mut counts = Counts::default();
        for y in output.range() {
            for channel in 0..self.header().geometry.channels.len() {
                let line = self.0.line(y, channel);
                let (expected, charge) = (input.row(y.cast_signed(), channel), output.row(y, channel));
                let draw = Charges { line: &line, expected, charge, read_noise: None };
                counts = counts.plus(vectors::run_on(self.0.instructions, draw));
            }
        }
        counts
    }
}

/// Charges whose excess spills on its way into a sink.
pub struct Spilling<'a> {
    /// What goes down with them.
    pub spill: Spill,
    width: usize,
    sink: &'a mut dyn RowSink,
    row: Vec<f32>,
}

impl<'a> Spilling<'a> {
    /// Rows of one plane, so wide.
    pub fn new(spill: Spill, width: usize, sink: &'a mut dyn RowSink) -> Self {
        Self { spill, width, sink, row: Vec::new() }
    }
}

impl RowSink for Spilling<'_> {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        self.row.clear();
        self.row.extend_from_slice(samples);
        self.row.chunks_exact_mut(self.width).for_each(|row| self.spill.down(row));
        self.sink.write(&self.row)
    }
}

/// Reads out what is in the wells at last: the second half of [`AddNoise`], after charge has spilled.
#[derive(Debug, Clone, Copy)]
pub struct Reading<'a>(pub(super) &'a AddNoise);

impl Stage for Reading<'_> {
    type Input = Electrons;
    type Output = Electrons;

    fn header(&self) -> &FrameHeader {
        self.0.header()
    }

    fn reach(&self) -> usize {
        self.0.transfer.as_ref().map_or(0, Transfer::reach)
    }

    fn apply(&self, input: Window<'_, Electrons>, mut output: Rows<'_, Electrons>) -> Counts {
        let noise = self.0;
        let mut counts = Counts::default();
        let mut added = vec![0.0; input.width()];
        let rows = output.range();
        for channel in 0..self.header().geometry.channels.len() {
            let mut passage = noise.transfer.as_ref().map(Transfer::passage);
            for y in rows.start.saturating_sub(self.reach())..rows.end {
                let charges = input.row(y.cast_signed(), channel).iter().map(|charge| charge.abs());
                if let Some(passage) = &mut passage {
                    passage
                        .entering(y)
                        .iter_mut()
                        .zip(charges.clone())
                        .for_each(|(to, charge)| *to = f64::from(charge));
                }
                if y < rows.start {
                    continue;
                }
                let line = noise.line(y, channel);
                let noisy = output.row(y, channel);
                match &mut passage {
                    // As where nothing spills, to the bit.
                    Some(passage) => {
                        noisy.iter_mut().zip(passage.leaving(y)).for_each(|(to, charge)| *to = to_sample(*charge));
                        added.fill(0.0);
                        vectors::run_on(noise.instructions, Read { line: &line, samples: &mut added });
                        add(noisy, &added);
                    }
                    None => {
                        noisy.iter_mut().zip(charges).for_each(|(to, charge)| *to = charge);
                        vectors::run_on(noise.instructions, Read { line: &line, samples: noisy });
                    }
                }
                counts.not_finite += not_finite(noisy);
            }
        }
        counts
    }
}

/// Adds to one row what is added when it is read.
struct Read<'a> {
    line: &'a Line<'a>,
    samples: &'a mut [f32],
}

impl Kernel for Read<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { line, samples } = self;
        let mut scratch = Scratch::default();
        for span in spans(line.first_column, samples.len()) {
            let run = line.run(&span);
            run.make_temporal(&mut scratch.words);
            let samples = &mut samples[span.clone()];
            if line.model.read_noise_e > 0.0 {
                add(samples, line.read_noise(&run, &mut scratch, &span));
            }
            line.add_jumps(&run, &mut scratch, samples);
            line.add_offsets(&run, &mut scratch, span, samples);
        }
    }
}

impl AddNoise {
    /// Whether charge beyond full well spills, so that rows wait for each other: those that [`Self::collected`] makes go through
    /// [`Self::spill`], down and up, and then through [`Self::reading`]. In one piece a band needs all rows of the frame.
    pub fn blooms(&self) -> bool {
        self.blooming > 0.0
    }

    /// The charges that are collected, whatever full well holds.
    pub fn collected(&self) -> Collected {
        Collected::of(self)
    }

    /// What reads charges that have spilled.
    pub fn reading(&self) -> Reading<'_> {
        Reading(self)
    }

    /// Makes sure that charge, where it spills, does between photosites that are there: not in three planes, of which each would be by
    /// itself, nor where rows of the sensor are missing.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for such frames; [`Error::Usage`] where charges are drawn that may be negative.
    pub fn check_columns(&self) -> Result<()> {
        if !self.blooms() {
            return Ok(());
        }
        if self.header.metadata.cfa.is_none() {
            return Err(self.header.refuse(
                "its sensor blooms: charge spills between photosites of all classes of a column, which three planes do not have; \
                 run `mosaic` first",
            ));
        }
        check_whole(&self.header, "charge beyond full well spills along whole columns", "blooming")?;
        if self.record.poisson == PoissonKind::Gaussian {
            return Err(Error::Usage(
                "the sensor blooms, and charges that `--poisson gaussian` draws may be negative, of which none spills; draw them exactly"
                    .into(),
            ));
        }
        Ok(())
    }

    /// The whole exposure of a sensor whose charge spills, from a window that has all rows.
    pub(super) fn apply_to_all(&self, input: Window<'_, ExpectedElectrons>, output: Rows<'_, Electrons>) -> Counts {
        let (width, height) = (input.width(), input.frame_height());
        let row_samples = width * self.header.geometry.channels.len();
        let mut charges = vec![0.0; row_samples * height];
        let collected = Rows::new(0, width, row_samples / width, &mut charges);
        let counts = Collected::of(self).apply(input, collected);
        let mut spill = self.spill(row_samples);
        charges.chunks_exact_mut(row_samples).for_each(|row| spill.down(row));
        spill.turn();
        charges.chunks_exact_mut(row_samples).rev().for_each(|row| spill.up(row));
        let charges = Window::new(height, 0, width, row_samples / width, &charges);
        // Each band collects and spills all anew; the first of them tells of it.
        let is_first = output.range().start == 0;
        let read = Reading(self).apply(charges, output);
        let before = if is_first { Counts { full_well: spill.full(), ..counts } } else { Counts::default() };
        before.plus(read)
    }

    /// What spills of the charge of its frame, rows of so many samples.
    pub fn spill(&self, row_samples: usize) -> Spill {
        Spill::new(self.model.full_well_e, self.blooming, row_samples)
    }
}
