//! The average of exposures of one scene, and what stays uncertain in it.

use super::floor::Floor;
use super::frame_levels::FrameLevels;
use super::notes::of_sigma_beside_defects;
use super::values;
use crate::analysis::statistics::{MarkedRows, Saturated};
use crate::error::{Error, Result};
use crate::formats::input::FrameReader;
use crate::formats::stack::FrameStack;
use crate::frame::to_sample;
use crate::metadata::{AverageRecord, Coverage, CutOffRecord, ExposuresRecord, FrameHeader};
use crate::numerics::averages::{CLIP, Combine, Kept, average};
use crate::numerics::running::Running;
use crate::sigma::{PixelLayers, is_layer};
use crate::stages::darks::Fitness;
use crate::stages::exposures::{Exposures, too_few};
use crate::stages::level_sums::{LevelSums, Unlike};
use crate::stages::masters::Averaging;
use crate::stages::saturation::{SATURATED, bits, with_mask};
use crate::stages::sites::SiteClasses;
use crate::stream::{RowSink, RowSource};
use crate::text::percent_in_decimals;
use crate::units::QuantityKind;
use clap::Args;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// How exposures are averaged.
#[derive(Debug, Clone, Args)]
pub struct AverageRequest {
    /// How frames are averaged: mean, median, or clipped, the mean without outliers
    #[arg(long, default_value = "mean", value_parser = values::choice::<Combine>())]
    combine: Combine,
    /// Standard deviations from the median beyond which `clipped` leaves samples out, again and again; of N samples none
    /// lies farther off than the root of N; by default 3
    #[arg(long, value_name = "KAPPA", value_parser = values::positive)]
    clip: Option<f64>,
    /// Add the standard deviation of each pixel as layers, by formula: what is drawn anew in each exposure averages out, fixed
    /// patterns do not. Frames that come with such layers leave with them anyway
    #[arg(long)]
    sigma: bool,
}

impl AverageRequest {
    /// Nothing averaged yet.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for limits of what clips nothing.
    pub fn begin(&self) -> Result<SharedAverage> {
        if self.clip.is_some() && self.combine != Combine::Clipped {
            return Err(
                Error::Usage("only the clipped mean has limits; give --combine clipped".into()).leave_out(&["clip"])
            );
        }
        let averaging = Averaging { combine: self.combine, clip: self.clip.unwrap_or(CLIP) };
        Ok(SharedAverage(Mutex::new(Average { averaging, wants_layers: self.sigma, seen: None })))
    }
}

/// An average that grows frame by frame.
pub struct SharedAverage(Mutex<Average>);

struct Average {
    averaging: Averaging,
    wants_layers: bool,
    seen: Option<Seen>,
}

struct Seen {
    exposures: Exposures,
    /// Whether frames came with layers of their uncertainty.
    had_layers: bool,
    samples: Samples,
    /// How often each pixel was saturated, and what else it was marked with.
    full: Vec<u32>,
    marks: Vec<u8>,
    /// The first frame by its samples, and a warning of one that is not like it.
    first: FrameLevels,
    unlike: Option<String>,
    /// How far codes are cut off at 0.
    floor: Floor,
}

impl Seen {
    /// Counts the marks of the pixels from one on.
    fn mark(&mut self, first: usize, marks: &[f32]) {
        let pixels = first..first + marks.len();
        let counts = self.full[pixels.clone()].iter_mut().zip(&mut self.marks[pixels]);
        for ((full, marks), mark) in counts.zip(marks) {
            let bits = bits(*mark);
            *full += u32::from(bits & SATURATED != 0);
            *marks |= (bits & !SATURATED).to_le_bytes()[0];
        }
    }

    /// Compares the samples of a frame with those of the first, which it may be.
    fn compare(&mut self, levels: FrameLevels, before: Option<CutOffRecord>) {
        self.floor.take(&levels, before);
        if self.samples.frames() < 2 {
            self.first = levels;
        } else if self.unlike.is_none() {
            self.unlike = levels.doubt_beside(&self.first);
        }
    }
}

/// What is kept of the samples.
enum Samples {
    Mean(Running),
    All(FrameStack),
}

impl Samples {
    fn frames(&self) -> usize {
        match self {
            Self::Mean(running) => running.count() as usize,
            Self::All(stack) => stack.frames(),
        }
    }
}

impl Samples {
    /// Where medians or clipped means are of exposures of unlike levels. Those in which noise was drawn are of one scene.
    fn unlike_levels(&mut self, first: &FrameHeader, averaging: Averaging) -> Result<Option<Unlike>> {
        let Self::All(stack) = self else { return Ok(None) };
        let frames = stack.frames();
        if averaging.combine == Combine::Mean || frames < 3 || first.metadata.noise.is_some() {
            return Ok(None);
        }
        let (width, height) = (first.geometry.width, first.geometry.height);
        let planes = first.geometry.channels.iter().position(|name| is_layer(name));
        let planes = planes.unwrap_or(first.geometry.channels.len());
        let classes = SiteClasses::of(first, planes);
        let mut sums = LevelSums::of(frames, classes.count(), &first.geometry, classes.period()[0]);
        let mut all = Vec::new();
        for y in (0..height).filter(|y| Fitness::looks_at(*y)) {
            stack.read(y * planes * width, planes * width, &mut all)?;
            for plane in 0..planes {
                let rows: Vec<&[f32]> =
                    all.chunks_exact(planes * width).map(|row| &row[plane * width..][..width]).collect();
                sums.take(y, &classes.row(y, plane), |_| true, &rows);
            }
        }
        Ok(sums.unlike(None))
    }
}

/// A warning of exposures whose light differs, of which there is no median.
fn doubt_of_levels(first: &str, name: &str, Unlike { share, spread }: Unlike) -> String {
    format!(
        "{first}: in {} % of it the light of the exposures differs, by {spread:.1} times the noise of one; there their {name} is the exposure in \
         the middle, with the noise of one, and nothing is predicted of it; --combine mean takes all, and correct-frame brings flats to one level",
        percent_in_decimals(share, 0)
    )
}

impl SharedAverage {
    /// Takes in the next frame.
    ///
    /// # Errors
    ///
    /// Those of [`Exposures::take`], of the frame and of the disk; [`Error::Format`] for what has no meaningful average.
    pub fn add(&self, frame: &mut FrameReader) -> Result<()> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).add(frame)
    }

    /// The average.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] of fewer than two frames; [`Error::Usage`] and others where its uncertainty cannot be told.
    pub fn finish(self) -> Result<Averaged> {
        let Average { averaging, wants_layers, seen } = self.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        match seen.filter(|seen| seen.samples.frames() > 1) {
            Some(seen) => Averaged::of(seen, averaging, wants_layers),
            None => too_few("an average is"),
        }
    }
}

/// Makes sure that the mean of such samples means something.
fn check(frame: &FrameHeader) -> Result<()> {
    let advice = match frame.metadata.quantity {
        QuantityKind::Xyy | QuantityKind::Lab | QuantityKind::Luv | QuantityKind::Cct | QuantityKind::Srgb => {
            "which are not linear in light; average XYZ, and convert the average"
        }
        QuantityKind::ColorDifference => "which has no sign; average the colors",
        QuantityKind::ExpectedElectrons => "without noise, which has nothing to average",
        _ => return Ok(()),
    };
    Err(frame.refuse(format!("it holds {}, {advice}", frame.holds())))
}

impl Average {
    fn add(&mut self, frame: &mut FrameReader) -> Result<()> {
        check(frame.header())?;
        let mut rows = MarkedRows::of(frame, Saturated::Kept);
        let all = rows.header().clone();
        let mut header = rows.unmarked();
        let planes = header.geometry.channels.iter().position(|name| is_layer(name));
        header.geometry.channels.truncate(planes.unwrap_or(header.geometry.channels.len()));
        let (kept, width, height) = (header.geometry.row_samples(), header.geometry.width, header.geometry.height);
        let layer = rows.layer;
        let averaging = self.averaging;
        let seen = match &mut self.seen {
            Some(seen) => {
                averaging.record_of([seen.exposures.first(), &header])?;
                seen.exposures.take(&header)?;
                seen.had_layers |= planes.is_some();
                seen
            }
            none => {
                let samples = match averaging.combine {
                    Combine::Mean => Samples::Mean(Running::new(kept * height)),
                    _ => Samples::All(FrameStack::new(kept * height)?),
                };
                let (full, marks) = (vec![0; width * height], vec![0; width * height]);
                none.insert(Seen {
                    exposures: Exposures::of(&header),
                    had_layers: planes.is_some(),
                    samples,
                    full,
                    marks,
                    first: FrameLevels::default(),
                    unlike: None,
                    floor: Floor::default(),
                })
            }
        };
        if let Samples::Mean(running) = &mut seen.samples {
            running.begin();
        }
        let step = rows.natural_rows().max(64).min(height.max(1));
        let (mut buffer, mut band, mut levels) = (Vec::new(), Vec::new(), FrameLevels::of(&all.name));
        let mut y = 0;
        while y < height {
            let count = step.min(height - y);
            buffer.clear();
            band.clear();
            rows.read(count, &mut buffer)?;
            for (index, row) in buffer.chunks_exact(all.geometry.row_samples()).enumerate() {
                band.extend_from_slice(&row[..kept]);
                if Fitness::looks_at(y + index) {
                    levels.take(&row[..kept]);
                }
                if let Some(layer) = layer {
                    seen.mark((y + index) * width, &row[layer * width..][..width]);
                }
            }
            match &mut seen.samples {
                Samples::Mean(running) => running.add(y * kept, &band),
                Samples::All(stack) => stack.add(&band)?,
            }
            y += count;
        }
        seen.compare(levels, all.metadata.average.and_then(|average| average.cut_off));
        Ok(())
    }
}

/// What an average is made of, ready to be written.
pub struct Averaged {
    /// Its head.
    pub header: FrameHeader,
    seen: Seen,
    averaging: Averaging,
    layers: Option<PixelLayers>,
    has_marks: bool,
    /// Saturated pixels.
    pub saturated: u64,
    /// Warnings.
    pub warnings: Vec<String>,
}

impl Averaged {
    fn of(mut seen: Seen, averaging: Averaging, wants_layers: bool) -> Result<Self> {
        let mut header = seen.exposures.first().clone();
        let frames = seen.samples.frames();
        let mut record = averaging.record(frames);
        let mut warnings = Vec::new();
        let metadata = &mut header.metadata;
        let own = record;
        let first = seen.exposures.first().clone();
        let apart = seen.samples.unlike_levels(&first, averaging)?;
        if let Some(before) = &metadata.average {
            record = AverageRecord { frames: before.frames.saturating_mul(record.frames), ..record };
        }
        let name = averaging.name();
        metadata.averaged = seen.exposures.drawn();
        let unlike_levels = apart.map_or(0.0, |apart| apart.spread);
        let record = ExposuresRecord::of(record, metadata.quantity, metadata.demosaic.is_some());
        let cut_off = seen.floor.cut_off(&first, own);
        metadata.average = Some(ExposuresRecord { unlike_levels, cut_off, ..record });
        warnings.extend(cut_off.and_then(|cut| seen.floor.doubt(&first, cut)));
        /// Codes over which what is averaged scatters, so that rounding counts for nothing.
        const MANY_CODES: f64 = 16.0;
        // Each frame's black level has the noise of its own border, which is averaged as that of the frames.
        let kept = Kept::of(own.combine, own.frames, own.clip.unwrap_or(CLIP), MANY_CODES).variance;
        metadata.black_noise = seen.exposures.black_noise().map(|noise| noise.times(kept));
        (metadata.predicted, metadata.uncertainty, metadata.saturated_share, metadata.samples) =
            (None, None, None, None);
        metadata.mask_bits.clear();
        if let Some(differs) = seen.exposures.unlike() {
            metadata.scene = None;
            let colored = if seen.exposures.differ_in_matrix() {
                ", and the matrix and the white of the first make its colors (`relative_matrix`)"
            } else {
                ""
            };
            warnings.push(format!("{differs}; nothing is predicted of their average{colored}"));
        }
        warnings.extend(seen.unlike.take());
        if let Some(apart) = apart {
            warnings.push(doubt_of_levels(&first.name, name, apart));
        }
        // A median is what it would be while fewer than half of its samples are full.
        let least = if averaging.combine == Combine::Median { frames.div_ceil(2) } else { 1 };
        let mut saturated = 0;
        for (marks, full) in seen.marks.iter_mut().zip(&seen.full) {
            if *full as usize >= least {
                *marks |= SATURATED.to_le_bytes()[0];
                saturated += 1;
            }
        }
        header.name = format!("the {name} of {frames} frames, the first {}", header.name);
        let layers = match wants_layers || seen.had_layers {
            true => Some(PixelLayers::of(&header)?),
            false => None,
        };
        if let Some(layers) = &layers {
            warnings.extend(of_sigma_beside_defects(&header).map(|note| note.text().to_owned()));
            header.geometry.channels.extend(layers.names().iter().map(|name| (*name).to_owned()));
            header.metadata.uncertainty = Some(Coverage::of_colors(header.metadata.color.as_ref()));
        }
        let has_marks = seen.marks.iter().any(|marks| *marks != 0);
        Ok(Self { header, seen, averaging, layers, has_marks, saturated, warnings })
    }

    /// The head of the frame that is written: with the layer of marks where there are any, and the format holds it.
    pub fn marked(&self, holds_layers: bool) -> FrameHeader {
        if self.has_marks && holds_layers { with_mask(self.header.clone()) } else { self.header.clone() }
    }

    /// Writes all rows; `progress` hears the rows done. Gives the number of pixels where propagation is void.
    ///
    /// # Errors
    ///
    /// Those of the sink and of the disk.
    pub fn write(
        &mut self,
        holds_layers: bool,
        sink: &mut dyn RowSink,
        progress: &mut dyn FnMut(usize),
    ) -> Result<u64> {
        /// What the rows of all frames may take at a time.
        const ALL_BYTES: usize = 64 << 20;
        let first = &self.seen.exposures.first().geometry;
        let (kept, width, height) = (first.row_samples(), first.width, first.height);
        let row_bytes = self.seen.samples.frames() * kept * size_of::<f32>();
        let step = (ALL_BYTES / row_bytes.max(1)).clamp(1, 256);
        let (mut void, mut made, mut all, mut out) = (0, Vec::new(), Vec::new(), Vec::new());
        let row_out = self.marked(holds_layers).geometry.row_samples();
        let has_marks = self.has_marks && holds_layers;
        let mut y = 0;
        while y < height {
            let rows = step.min(height - y);
            made.clear();
            match &mut self.seen.samples {
                Samples::Mean(running) => {
                    made.extend(running.means()[y * kept..(y + rows) * kept].iter().map(|mean| to_sample(*mean)));
                }
                Samples::All(stack) => {
                    stack.read(y * kept, rows * kept, &mut all)?;
                    made.resize(rows * kept, 0.0);
                    across(&all, self.averaging, &mut made);
                }
            }
            out.clear();
            out.resize(rows * row_out, 0.0);
            let layers = self.layers.as_ref();
            let marks = &self.seen.marks;
            let of_row = |(index, (made, out)): (usize, (&[f32], &mut [f32]))| {
                let at = y + index;
                out[..kept].copy_from_slice(made);
                let end = out.len() - if has_marks { width } else { 0 };
                let void = layers.map_or(0, |layers| layers.fill(at, made, &mut out[kept..end]));
                if has_marks {
                    let of_row = marks[at * width..(at + 1) * width].iter();
                    out[end..].iter_mut().zip(of_row).for_each(|(out, marks)| *out = f32::from(*marks));
                }
                void
            };
            let rows_made = made.par_chunks_exact(kept).zip(out.par_chunks_exact_mut(row_out));
            void += rows_made.enumerate().map(of_row).sum::<u64>();
            sink.write(&out)?;
            y += rows;
            progress(y);
        }
        Ok(void)
    }
}

/// The averages of samples of which all frames' are given, one frame behind another.
fn across(all: &[f32], averaging: Averaging, made: &mut [f32]) {
    /// Samples that are worth a task of their own.
    const SHARE: usize = 1 << 10;
    let (count, samples) = (all.len() / made.len().max(1), made.len());
    made.par_chunks_mut(SHARE).enumerate().for_each(|(share, made)| {
        let mut of_site = Vec::with_capacity(count);
        for (index, made) in made.iter_mut().enumerate() {
            of_site.clear();
            of_site.extend((0..count).map(|frame| all[frame * samples + share * SHARE + index]));
            *made = to_sample(average(averaging.combine, &mut of_site, averaging.clip).0);
        }
    });
}
