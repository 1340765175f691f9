//! How the marks of saturated samples come through a stage: where they are made, carried, counted, or not needed.

use crate::error::Result;
use crate::metadata::FrameHeader;
use crate::propagation::saturation;
use crate::stages::correct::CorrectFrame;
use crate::stages::darks::{DarkFrames, DarkLimits, LessDarks};
use crate::stages::defects::{DefectMap, Mapped, Mend};
use crate::stages::flats::{FlatFrames, FlatMeans, Flattened};
use crate::stages::saturation::{Counted, FullLevels, Marked, WithMask, samples_tell, with_mask};
use crate::stream::{Counts, RowSink, RowSource, Stage, Through, run};
use crate::units::QuantityKind;

/// How the marks of saturated samples come through a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Need {
    /// No sample can be saturated, or nothing tells from what level on.
    Needless,
    /// What the stage makes are samples that tell by their level, and these are counted.
    Counted(FullLevels),
    /// The layer is made from the samples that come in.
    Made(FullLevels),
    /// The layer comes with the samples.
    Carried,
}

impl Need {
    fn of(input: &FrameHeader, is_masked: bool, output: &FrameHeader) -> Self {
        if is_masked {
            return Self::Carried;
        }
        let (levels, make): (_, fn(FullLevels) -> Self) = if samples_tell(output) {
            (FullLevels::of(output).map(|levels| (levels, output)), Self::Counted)
        } else {
            (FullLevels::of(input).map(|levels| (levels, input)), Self::Made)
        };
        match levels {
            Some((levels, frame)) if saturation::is_possible(frame, &levels) => make(levels),
            _ => Self::Needless,
        }
    }
}

/// The marks of saturated samples on their way through a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Masking {
    need: Need,
    /// Whether what is made has the layer.
    is_kept: bool,
}

impl Masking {
    /// What is needed between frames: `is_masked` where the layer comes with `input`, `holds_layers` where what is made can
    /// have it. A picture to look at has none; nor have demosaicked frames of a uniform scene whose law says that next to
    /// nothing is saturated, unless their uncertainty is told too.
    pub fn of(input: &FrameHeader, is_masked: bool, output: &FrameHeader, holds_layers: bool) -> Self {
        let need = Need::of(input, is_masked, output);
        let is_wanted = match need {
            Need::Needless | Need::Counted(_) => false,
            Need::Carried => true,
            Need::Made(_) => {
                let has_layers = output.geometry.channels.len() > 3;
                output.metadata.demosaic.is_none() || has_layers || !saturation::is_negligible(output)
            }
        };
        Self { need, is_kept: is_wanted && holds_layers && output.metadata.quantity != QuantityKind::Srgb }
    }

    /// The head of the frame that a stage makes.
    pub fn header<S: Stage>(self, stage: &S) -> FrameHeader {
        let mut header = stage.header().clone();
        if self.is_kept {
            header = with_mask(header);
        }
        if matches!(self.need, Need::Made(_)) {
            header.metadata.saturated_share = saturation::share_of_pixels(&header);
        }
        header
    }

    /// Drives a frame, less the mean of dark frames where there are any, through a stage; `progress` hears the rows done.
    ///
    /// # Errors
    ///
    /// Those of the source, the darks and the sink.
    pub fn run<S: Stage, D: RowSource>(
        self,
        stage: &S,
        frame: &mut dyn RowSource,
        darks: Option<&mut DarkFrames<D>>,
        sink: &mut dyn RowSink,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Counts> {
        let mut marked;
        let frame: &mut dyn RowSource = match self.need {
            Need::Made(levels) => {
                marked = Marked::new(frame, Some(levels));
                &mut marked
            }
            _ => frame,
        };
        let mut less_darks;
        let source: &mut dyn RowSource = match darks {
            Some(darks) => {
                less_darks = LessDarks::new(frame, darks);
                &mut less_darks
            }
            None => frame,
        };
        match self.need {
            Need::Needless => run(stage, source, sink, progress),
            Need::Counted(levels) => {
                let mut counted = Counted::new(sink, stage.header(), levels);
                let counts = run(stage, source, &mut counted, progress)?;
                Ok(Counts { saturated_samples: counted.count, ..counts })
            }
            Need::Made(_) | Need::Carried => {
                let masked = WithMask::new(stage);
                let row_samples = masked.header().geometry.row_samples();
                let kept = if self.is_kept { row_samples } else { stage.header().geometry.row_samples() };
                run(&masked, source, &mut FirstSamples { sink, row_samples, kept }, progress)
            }
        }
    }
}

/// What comes off a frame, divides it, and tells its defective photosites, each read in step with it.
pub struct Corrections<S> {
    /// Dark and bias frames.
    pub darks: Option<DarkFrames<S>>,
    /// What is ordinary among them, where defects are looked for.
    pub dark_limits: Option<DarkLimits>,
    /// Flats and the means of their classes.
    pub flats: Option<(FlatFrames<S>, FlatMeans)>,
    /// Defects that are known.
    pub map: Option<DefectMap<S>>,
    /// Photosites that were found to be off in dark frames, unstable there, and off in flats.
    pub found: [u64; 3],
}

impl<S: RowSource> Corrections<S> {
    /// Whether photosites may be marked for another reason than saturation.
    pub fn may_mark(&self) -> bool {
        self.dark_limits.is_some() || self.flats.is_some() || self.map.is_some()
    }

    /// Corrects `frame`, whose layer of marks comes with it where `is_masked`, in the order of a camera's signal backwards:
    /// black level, or dark frames; charge transfer (both by `stage`, which dark frames come before, as transfer is linear);
    /// flat field; defects. The layer of marks is the last channel of what is made; `holds_layers` where the sink takes it.
    ///
    /// # Errors
    ///
    /// Those of the sources and the sink.
    pub fn run(
        &mut self,
        stage: &CorrectFrame,
        frame: &mut dyn RowSource,
        [is_masked, holds_layers]: [bool; 2],
        sink: &mut dyn RowSink,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Counts> {
        let levels = FullLevels::of(frame.header()).filter(|levels| saturation::is_possible(frame.header(), levels));
        let mut marked;
        let mut source: &mut dyn RowSource = frame;
        if !is_masked {
            marked = Marked::new(source, levels);
            source = &mut marked;
        }
        let mut mapped;
        if let Some(map) = &mut self.map {
            mapped = Mapped::new(source, map);
            source = &mut mapped;
        }
        let mut less_darks;
        if let Some(darks) = &mut self.darks {
            less_darks = match &self.dark_limits {
                Some(limits) => LessDarks::marking(source, darks, limits),
                None => LessDarks::new(source, darks),
            };
            source = &mut less_darks;
        }
        let masked = WithMask::new(stage);
        let mut through = Through::new(&masked, source);
        let mend = Mend::new(stage.header());
        let row_samples = mend.header().geometry.row_samples();
        let kept = if holds_layers { row_samples } else { stage.header().geometry.row_samples() };
        let mut sink = FirstSamples { sink, row_samples, kept };
        let counts = match &mut self.flats {
            Some((flats, means)) => {
                let mut flattened = Flattened::new(&mut through, flats, means);
                let counts = run(&mend, &mut flattened, &mut sink, progress)?;
                self.found[2] = flattened.found;
                counts
            }
            None => run(&mend, &mut through, &mut sink, progress)?,
        };
        self.found[..2].copy_from_slice(&self.darks.as_ref().map_or([0; 2], DarkFrames::found));
        Ok(counts)
    }
}

/// Hands on the first samples of each row: channels that follow them stay behind.
struct FirstSamples<'a> {
    sink: &'a mut dyn RowSink,
    row_samples: usize,
    kept: usize,
}

impl RowSink for FirstSamples<'_> {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        if self.kept == self.row_samples {
            return self.sink.write(samples);
        }
        samples.chunks_exact(self.row_samples).try_for_each(|row| self.sink.write(&row[..self.kept]))
    }
}
