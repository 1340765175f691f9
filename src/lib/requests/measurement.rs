//! Statistics of a frame beside what propagation predicts.

use super::independence::check_exposures;
use super::options::{Input, Output};
use super::{batch, values};
use crate::analysis::statistics::portrait::Portrait;
use crate::analysis::statistics::{
    Laws, OverFrames, OverFramesSettings, Region, RepeatedReport, Report, Saturated, measure_among,
    measure_with_portrait, patches,
};
use crate::error::Result;
use crate::formats::places::{output_of, sidecar_path};
use crate::formats::plots::PlotFormat;
use crate::formats::register;
use crate::formats::sequence::Sequence;
use crate::metadata::FrameHeader;
use crate::names::Named;
use crate::propagation::Equations;
use crate::stream::{MemoryFrame, RowSource};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What to measure of a frame, and what to make of it.
#[derive(Debug, Clone, Args)]
pub struct Measurement {
    /// Rectangle X,Y,W,H in pixels; may be given more than once; by default the whole frame
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region, allow_hyphen_values = true)]
    region: Vec<Region>,
    /// Measure each patch of a chart, as --patch of render-radiance draws them or as WxH says, less the rim that
    /// demosaicking mixes
    #[arg(long, value_name = "WxH", num_args = 0..=1, require_equals = true, value_parser = values::size, conflicts_with_all = ["region", "check", "plot"])]
    patches: Option<Option<[usize; 2]>>,
    /// Keep pixels in the statistics that were made of saturated samples
    #[arg(long)]
    keep_saturated: bool,
    /// Equations to predict by: exact, or those of the paper
    #[arg(long, default_value = Equations::default().name(), value_parser = values::choice::<Equations>())]
    equations: Equations,
    /// Test every prediction, and exit with status 1 when one does not hold, which the report says (`passed`), or when nothing
    /// can be checked, of which there is no report
    #[arg(long)]
    check: bool,
    /// Chance of a false alarm that --check accepts, all tests together
    #[arg(long, value_name = "P", default_value_t = 1e-4, value_parser = values::fraction, requires = "check")]
    level: f64,
    /// Measure over all frames that come, exposures of one scene, in place of each by itself: what scatters from frame to frame, and
    /// what is the same in all
    #[arg(long, value_name = "WHAT", value_parser = values::choice::<Over>(), conflicts_with_all = ["patches", "plot"])]
    over: Option<Over>,
    /// Write an EXR of the mean of each pixel over frames, and of its variance as the layer `variance.NAME`, divisor N − 1
    #[arg(long, value_name = "FILE", requires = "over")]
    pixels: Option<PathBuf>,
    /// Scale the samples of --pixels by a power of two so that viewers show them; programs of this toolchain undo it to the bit.
    /// Variances stand apart, in a second part
    #[arg(long, requires = "pixels")]
    viewable: bool,
    /// Draw the region as an SVG or PNG file: histogram with the predicted law over it, means of columns and rows with the predicted
    /// band of one standard deviation, autocorrelation beside the predicted, of XYZ chromaticities with the ellipses of the measured
    /// and of the predicted covariance
    #[arg(long, value_name = "FILE.svg|png")]
    pub plot: Option<PathBuf>,
}

/// Statistics over frames that come one after another.
pub struct SharedFrames(Mutex<OverFrames>);

impl SharedFrames {
    /// Takes in the next frame.
    ///
    /// # Errors
    ///
    /// Those of [`OverFrames::add`].
    pub fn add(&self, source: &mut dyn RowSource) -> Result<()> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).add(source)
    }

    /// What is known of all, and the frame of means and variances.
    ///
    /// # Errors
    ///
    /// Those of [`OverFrames::finish`].
    pub fn finish(self) -> Result<(RepeatedReport, MemoryFrame)> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner).finish()
    }
}

/// What statistics are taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Over {
    /// The frames that come.
    Frames,
}

impl Named for Over {
    const ALL: &'static [Self] = &[Self::Frames];

    fn name(self) -> &'static str {
        "frames"
    }
}

impl Measurement {
    /// Registers what will be written, and makes sure that its names do for so many inputs.
    ///
    /// # Errors
    ///
    /// Those of [`check_exposures`] where frames are taken together, [`register::announce`], [`register::note_inputs`], [`batch::check_each_named`] and [`batch::check_one_report`].
    pub fn announce(&self, inputs: &[PathBuf], report: Option<&Path>) -> Result<()> {
        let pixels = self.pixels.as_deref();
        let sidecar = pixels.map(sidecar_path);
        register::announce(&[report, self.plot.as_deref(), pixels, sidecar.as_deref()])?;
        register::note_inputs(inputs.iter().map(PathBuf::as_path))?;
        if self.over.is_some() {
            check_exposures(inputs)?;
        }
        batch::check_each_named(inputs, self.plot.as_deref())?;
        batch::check_one_report(report)
    }

    /// What is asked of all frames together, where that is.
    pub fn over_frames(&self) -> Option<SharedFrames> {
        let settings = OverFramesSettings {
            regions: self.region.clone(),
            saturated: self.saturated(),
            equations: self.equations,
            level: self.check.then_some(self.level),
        };
        self.over.map(|Over::Frames| SharedFrames(Mutex::new(OverFrames::new(settings))))
    }

    /// Where and how the frame of means and variances is written, where one is asked for.
    pub fn pixels_output(&self) -> Option<Output> {
        let output =
            |path: &PathBuf| Output { output: Some(path.clone()), viewable: self.viewable, ..Output::default() };
        self.pixels.as_ref().map(output)
    }

    /// The input of a frame: where it is drawn into a file, no bytes but frames may come behind.
    pub fn settled(&self, input: &Input) -> Input {
        let sequence = input.sequence.clone();
        let sequence = if self.plot.is_some() { sequence.map(Sequence::settled) } else { sequence };
        Input { sequence, ..input.clone() }
    }

    fn saturated(&self) -> Saturated {
        if self.keep_saturated { Saturated::Kept } else { Saturated::LeftOut }
    }

    /// The same for a frame of several, with a plot of its own: that of its file, and of this number in its stream.
    pub fn for_frame(&self, path: Option<&Path>, index: u64, frame: &FrameHeader) -> Self {
        let Some(plot) = &self.plot else { return self.clone() };
        let file = path.or(frame.metadata.file.as_deref().map(Path::new));
        let plot = file.map_or_else(|| plot.clone(), |file| output_of(plot, file, "svg"));
        let plot = Output { output: Some(plot), index, ..Output::default() }.options_for(frame).path;
        Self { plot, ..self.clone() }
    }

    /// Measures a frame, with the laws of those before it where it has them too; what a figure shows comes with the report where one
    /// is wanted.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`](crate::error::Error::Usage) for a plot of another format or of several regions; those of [`measure_among`].
    pub fn of(&self, source: &mut dyn RowSource, laws: &mut Laws) -> Result<(Report, Option<Portrait>)> {
        let level = self.check.then_some(self.level);
        let saturated = self.saturated();
        match (self.patches, &self.plot) {
            (Some(size), _) => Ok((patches::measure(source, size, saturated, self.equations)?, None)),
            (None, None) => Ok((measure_among(laws, source, &self.region, saturated, self.equations, level)?, None)),
            (None, Some(path)) => {
                PlotFormat::of_path(path)?;
                let (report, portrait) =
                    measure_with_portrait(laws, source, &self.region, saturated, self.equations, level)?;
                Ok((report, Some(portrait)))
            }
        }
    }
}
