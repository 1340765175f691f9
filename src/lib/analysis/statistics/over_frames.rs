//! Statistics over frames of one scene: what is drawn anew in each, and what is the same in all.
//!
//! Of n pixels in N frames, with pixel means m over frames, frame means f over pixels, and s² the variances of the pixels over
//! frames, the two-way analysis of variance has
//!
//! - temporal variance T = n/(n − 1) · \[⟨s²⟩ − Var f], what pixels scatter by from frame to frame beside what all do together,
//! - variance of the means S = Var m, which T/N is a part of,
//! - fixed variance F = S − T/N,
//!
//! and the same of covariances of channels. What rows share is less between the pixels of a region than over a large frame, in T and
//! S as in the sample variance of a frame; what is predicted beside them is what is expected of that region.

use super::assessment::Assessment;
use super::laws::{self, Samplings};
use super::levels::Levels;
use super::measure::{check_testable, unfair};
use super::region::Region;
use super::repeated_report::{RepeatedChannel, RepeatedRegion, RepeatedReport};
use super::report::{ChannelReport, RegionReport, coverage};
use super::tally::{Tally, tallies};
use super::verdict::Verdict;
use super::watch::{Saturated, Watch};
use crate::error::{Error, Result};
use crate::metadata::{AverageRecord, ExposuresRecord, FrameHeader};
use crate::numerics::averages::Combine;
use crate::numerics::moments::Moments;
use crate::numerics::running::Running;
use crate::propagation::{Equations, FramePrediction, Repeated};
use crate::stages::exposures::{Exposures, too_few};
use crate::stages::saturation::with_mask;
use crate::stream::{MemoryFrame, Passing, RowSource};

/// What is asked of frames.
#[derive(Debug, Clone)]
pub struct OverFramesSettings {
    /// Rectangles to measure; the whole frame where there are none.
    pub regions: Vec<Region>,
    /// What becomes of saturated pixels.
    pub saturated: Saturated,
    /// Equations to predict by.
    pub equations: Equations,
    /// Chance of a false alarm, where predictions are tested.
    pub level: Option<f64>,
}

/// Statistics over frames that come one after another. Memory is 16 bytes for each sample of one frame, and does not grow with
/// their number.
#[derive(Debug)]
pub struct OverFrames {
    settings: OverFramesSettings,
    seen: Option<Seen>,
}

/// What was seen so far.
#[derive(Debug)]
struct Seen {
    exposures: Exposures,
    regions: Vec<Region>,
    pixels: Running,
    marks: Vec<u8>,
    of_frames: Vec<FrameTallies>,
}

/// What is kept of the tallies of a region: of all channels, then of each class.
#[derive(Debug, Clone, Default)]
struct FrameTallies {
    /// Means of the channels.
    means: Vec<Running>,
    /// Sums over frames of the covariances of the channels, row by row.
    covariances: Vec<Vec<f64>>,
    /// Clipped samples.
    clipped: Vec<Vec<u64>>,
}

impl OverFrames {
    /// Nothing was seen yet.
    pub fn new(settings: OverFramesSettings) -> Self {
        Self { settings, seen: None }
    }

    /// How many frames there were.
    pub fn frames(&self) -> u32 {
        self.seen.as_ref().map_or(0, |seen| seen.pixels.count())
    }

    /// Takes in the next frame.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a region outside the frame; [`Error::Format`] for one that shows another scene or other pixels than the
    /// first, or the same exposure as another; those of the source.
    pub fn add(&mut self, source: &mut dyn RowSource) -> Result<()> {
        let whole = [Region::whole(source.header())];
        let regions = if self.settings.regions.is_empty() { &whole[..] } else { &self.settings.regions };
        regions.iter().try_for_each(|region| region.check(source.header()))?;
        let mut marks = self.seen.as_mut().map_or_else(Vec::new, |seen| std::mem::take(&mut seen.marks));
        let mut watch = Watch::new(source, self.settings.saturated, regions).keeping(&mut marks).without_layers();
        let frame = watch.header().clone();
        let untold =
            watch.untold().filter(|_| self.settings.level.is_some() && self.settings.saturated == Saturated::LeftOut);
        if let Some(pixels) = untold {
            return Err(unfair(&frame, &format!("{pixels}, and nothing marks which")));
        }
        let seen = match &mut self.seen {
            Some(seen) => {
                seen.exposures.take(&frame)?;
                seen
            }
            none => none.insert(Seen::of(&frame, regions)),
        };
        let levels = Levels::of(&frame)?;
        seen.pixels.begin();
        let (pixels, mut at) = (&mut seen.pixels, 0);
        let mut adding = Passing::new(&mut watch, |samples| {
            pixels.add(at, samples);
            at += samples.len();
        });
        let tallies = tallies(&mut adding, &seen.regions, &levels, false)?;
        for (of_region, tally) in seen.of_frames.iter_mut().zip(&tallies) {
            of_region.add(tally);
        }
        drop(watch);
        seen.marks = marks;
        Ok(())
    }

    /// What is known of all frames, and the frame of their means and variances: channels as in the frames, then `variance.NAME` of
    /// each, `[row][channel][column]`, and marks where there are any.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] of fewer than two frames, or where nothing can be tested that should be.
    pub fn finish(self) -> Result<(RepeatedReport, MemoryFrame)> {
        let Self { settings, seen } = self;
        let Some(seen) = seen.filter(|seen| seen.pixels.count() > 1) else {
            return too_few("statistics over frames are");
        };
        Ok((seen.report(&settings)?, seen.pixels_frame()))
    }
}

impl FrameTallies {
    fn add(&mut self, tally: &Tally) {
        let groups: Vec<&Moments> = std::iter::once(&tally.channels).chain(tally.classes.iter().flatten()).collect();
        let channels = |group: &Moments| group.channels();
        if self.means.is_empty() {
            self.means = groups.iter().map(|group| Running::new(channels(group))).collect();
            self.covariances = groups.iter().map(|group| vec![0.0; channels(group).pow(2)]).collect();
            self.clipped = groups.iter().map(|group| vec![0; channels(group)]).collect();
        }
        for (index, group) in groups.into_iter().enumerate() {
            self.means[index].begin();
            self.means[index].add_doubles(&group.mean);
            let of_pairs = self.covariances[index].iter_mut().enumerate();
            of_pairs.for_each(|(pair, sum)| {
                *sum += group.covariance(pair / channels(group), pair % channels(group)).unwrap_or(f64::NAN);
            });
            self.clipped[index].iter_mut().zip(&group.beyond).for_each(|(sum, beyond)| *sum += beyond);
        }
    }

    /// What is drawn anew, as moments of a frame that has it: from variances of the pixels, and the covariances of frames and of
    /// the means; the latter of more channels than one only where no pixel was left out.
    fn temporal(&self, index: usize, variances: &Moments, means: &Moments, frames: f64) -> Moments {
        let (channels, count) = (variances.channels(), variances.count);
        let share = count as f64 / (count as f64 - 1.0);
        let is_whole = means.not_finite == 0;
        // Beside what is the same in all frames its mean is none.
        Moments::known(count, vec![0.0; channels], |i, j| {
            if i == j {
                return share * (variances.mean[i] - self.means[index].variance(i));
            }
            let of_means = means.covariance(i, j).filter(|_| is_whole).unwrap_or(f64::NAN);
            (self.covariances[index][i * channels + j] - frames * of_means) / (frames - 1.0)
        })
    }
}

impl Seen {
    fn of(frame: &FrameHeader, regions: &[Region]) -> Self {
        Self {
            exposures: Exposures::of(frame),
            regions: regions.to_vec(),
            pixels: Running::new(frame.geometry.row_samples() * frame.geometry.height),
            marks: Vec::new(),
            of_frames: vec![FrameTallies::default(); regions.len()],
        }
    }

    /// The means or variances of pixels as a frame.
    fn plane(&self, of: impl Fn(usize) -> f64) -> MemoryFrame {
        #[expect(clippy::cast_possible_truncation, reason = "samples are single precision")]
        let samples = (0..self.pixels.means().len()).map(|index| of(index) as f32).collect();
        MemoryFrame::new(self.exposures.first().clone(), samples)
    }

    /// Means and variances together.
    fn pixels_frame(&self) -> MemoryFrame {
        let mut header = self.exposures.first().clone();
        let (channels, width) = (header.geometry.channels.clone(), header.geometry.width);
        header.geometry.channels.extend(channels.iter().map(|name| format!("variance.{name}")));
        let has_marks = self.marks.iter().any(|marks| *marks != 0);
        if has_marks {
            header = with_mask(header);
        }
        let average = AverageRecord { frames: self.pixels.count(), combine: Combine::Mean, clip: None };
        let metadata = &mut header.metadata;
        metadata.average = Some(ExposuresRecord::of(average, metadata.quantity, metadata.demosaic.is_some()));
        (metadata.predicted, metadata.uncertainty, metadata.saturated_share) = (None, None, None);
        let row_samples = self.exposures.first().geometry.row_samples();
        let mut samples = Vec::with_capacity(header.geometry.row_samples() * header.geometry.height);
        for y in 0..header.geometry.height {
            let row = y * row_samples..(y + 1) * row_samples;
            #[expect(clippy::cast_possible_truncation, reason = "samples are single precision")]
            {
                samples.extend(self.pixels.means()[row.clone()].iter().map(|mean| *mean as f32));
                samples.extend(row.map(|index| self.pixels.variance(index) as f32));
            }
            if has_marks {
                samples.extend(self.marks[y * width..(y + 1) * width].iter().map(|marks| f32::from(*marks)));
            }
        }
        MemoryFrame::new(header, samples)
    }

    fn report(&self, settings: &OverFramesSettings) -> Result<RepeatedReport> {
        let frame = self.exposures.first();
        let levels = Levels::of(frame)?;
        let count = self.pixels.count();
        let mut means = self.plane(|index| self.pixels.means()[index]);
        let means = tallies(&mut means, &self.regions, &levels, false)?;
        let mut variances = self.plane(|index| self.pixels.variance(index));
        let variances = tallies(&mut variances, &self.regions, &levels, false)?;
        let predicted_of = |frame: &FrameHeader| {
            let predicted = Repeated::of(frame, settings.equations, count).map_err(|why| why.to_string());
            match self.exposures.unlike() {
                Some(differs) if predicted.is_ok() => Err(differs.to_owned()),
                _ => predicted,
            }
        };
        // What several amplifiers have read differs from place to place.
        let of_frame = frame.taps().is_none().then(|| predicted_of(frame));
        let mut unpredicted = None;
        let mut samplings = [Samplings::default(), Samplings::default()];
        let mut regions = Vec::new();
        for (index, region) in self.regions.iter().enumerate() {
            let temporal = self.of_frames[index].temporal_tally(&variances[index], &means[index], f64::from(count));
            let of_place = of_frame.is_none().then(|| predicted_of(&region.header(frame)));
            let Some(predicted) = of_frame.as_ref().or(of_place.as_ref()) else { continue };
            unpredicted = unpredicted.or_else(|| why_not(predicted, settings.level.is_some()));
            let known = predicted.as_ref().ok().filter(|_| means[index].channels.not_finite == 0);
            let [of_means, of_variances] = &mut samplings;
            let assess = |tally, prediction: Option<&FramePrediction>, samplings: &mut Samplings| {
                Assessment::new(tally, frame, *region, prediction, |mixture| samplings.of(mixture, frame, *region))
            };
            // Lines that full well or an end of the codes cuts off scatter unlike.
            let bent = known.filter(|known| known.means.has_lines());
            let bent = bent.and_then(|_| laws::of_mean(frame, *region, settings.equations, count));
            let of_means = assess(&means[index], bent.as_ref().or(known.map(|known| &known.means)), of_means);
            let of_variances = assess(&temporal, known.map(|known| &known.variances), of_variances);
            let of_variances = of_variances.repeated(f64::from(count) - 1.0);
            let is_tested = settings.level.is_some() && known.is_some_and(|known| known.scatter.is_ok());
            let mut tests = if is_tested { of_means.tests_of_means() } else { Vec::new() };
            if is_tested {
                tests.extend(of_variances.tests_over_frames(&self.of_frames[index].variances_of_means(), count));
            }
            let [means, variances] =
                [&of_means, &of_variances].map(|made| made.of_region(made.report(frame, *region, &levels)));
            let is_known = known.is_some_and(|known| known.scatter.is_ok());
            let made = Made { means, variances, is_known, frames: count };
            regions.push(made.region(&self.of_frames[index], &of_variances.mean_stds(), tests));
        }
        if settings.level.is_some() {
            check_testable(frame)?;
            if let Some(why) = &unpredicted {
                return Err(Error::Data(format!("{}: nothing can be checked: {why}", frame.name)));
            }
            check_whole(&frame.name, &regions)?;
        }
        let check = match settings.level {
            Some(level) => {
                let tested = regions.iter().map(|region| (&region.tests[..], region.left_out));
                Some(Verdict::of(tested, level, &frame.name, None)?)
            }
            None => None,
        };
        let unlike = self.exposures.unlike().map(str::to_owned);
        Ok(RepeatedReport { frames: count, regions, check, uncertainty: coverage(frame), unlike, unpredicted })
    }
}

impl FrameTallies {
    fn temporal_tally(&self, variances: &Tally, means: &Tally, frames: f64) -> Tally {
        let of_classes = variances.classes.as_ref().zip(means.classes.as_ref());
        Tally {
            channels: self.temporal(0, &variances.channels, &means.channels, frames),
            classes: of_classes
                .map(|(variances, means)| [0, 1, 2].map(|k| self.temporal(k + 1, &variances[k], &means[k], frames))),
            lines: None,
        }
    }

    /// Variances over frames of the means of the channels, and of each class.
    fn variances_of_means(&self) -> Vec<Vec<f64>> {
        let of_group = |group: &Running| (0..group.means().len()).map(|i| group.variance(i)).collect();
        self.means.iter().map(of_group).collect()
    }
}

/// Why nothing is predicted, or nothing can be tested where that is asked.
fn why_not(predicted: &std::result::Result<Repeated, String>, is_asked: bool) -> Option<String> {
    match predicted {
        Ok(known) => known.scatter.err().filter(|_| is_asked).map(|why| why.to_string()),
        Err(why) => Some(why.clone()),
    }
}

/// Makes sure that no pixel was left out of a region.
fn check_whole(frame: &str, regions: &[RepeatedRegion]) -> Result<()> {
    match regions.iter().map(|region| region.left_out).find(|pixels| *pixels > 0) {
        None => Ok(()),
        Some(pixels) => Err(Error::Data(format!(
            "{frame}: nothing can be checked: {pixels} pixels are saturated, otherwise marked or not finite in a frame; without them \
             the others are no fair sample"
        ))
        .give(&["keep_saturated"])),
    }
}

/// What reports of a region say of means over frames, and of what is drawn anew.
struct Made {
    means: RegionReport,
    variances: RegionReport,
    /// Whether it is known how far they scatter.
    is_known: bool,
    frames: u32,
}

impl Made {
    fn region(
        self,
        of_frames: &FrameTallies,
        mean_stds: &[Vec<f64>],
        tests: Vec<super::check::Test>,
    ) -> RepeatedRegion {
        let Self { means, variances, .. } = &self;
        let n = f64::from(self.frames);
        let less = |whole: Option<&Vec<Vec<f64>>>, temporal: Option<&Vec<Vec<f64>>>| -> Option<Vec<Vec<f64>>> {
            let rows = whole?.iter().zip(temporal?);
            let row = |(whole, temporal): (&Vec<f64>, &Vec<f64>)| {
                whole.iter().zip(temporal).map(|(s, t)| s - t / n).collect()
            };
            Some(rows.map(row).collect())
        };
        let channel = |group: usize, index: usize, of_means: &ChannelReport, of_variances: &ChannelReport| {
            let std_of_frame_means = of_frames.means[group].variance(index).max(0.0).sqrt();
            let predicted = mean_stds.get(group).and_then(|stds| stds.get(index)).copied();
            let clipped = of_means.clipped.map(|_| of_frames.clipped[group][index]);
            self.channel(of_means, of_variances, [Some(std_of_frame_means), predicted], clipped)
        };
        let channels = means.channels.iter().zip(&variances.channels).enumerate();
        let classes = means.classes.iter().zip(&variances.classes).enumerate();
        let region = RepeatedRegion {
            region: means.region,
            count: means.count,
            left_out: means.not_finite,
            quantity: means.quantity,
            unit: means.unit.clone(),
            channels: channels
                .map(|(index, (of_means, of_variances))| channel(0, index, of_means, of_variances))
                .collect(),
            classes: classes
                .map(|(index, (of_means, of_variances))| channel(index + 1, 0, of_means, of_variances))
                .collect(),
            temporal_covariance: finite(variances.covariance.clone()),
            fixed_covariance: finite(less(means.covariance.as_ref(), variances.covariance.as_ref())),
            predicted_temporal_covariance: variances.predicted_covariance.clone(),
            predicted_fixed_covariance: less(
                means.predicted_covariance.as_ref(),
                variances.predicted_covariance.as_ref(),
            ),
            patch_mean_std: means.patch_mean_std.clone().filter(|_| self.is_known),
            tests: Vec::new(),
        };
        region.tested(tests)
    }

    fn channel(
        &self,
        means: &ChannelReport,
        variances: &ChannelReport,
        [std_of_frame_means, predicted_std_of_frame_means]: [Option<f64>; 2],
        clipped: Option<u64>,
    ) -> RepeatedChannel {
        let n = f64::from(self.frames);
        let less = |whole: f64, temporal: f64| {
            let variance = whole * whole - temporal * temporal / n;
            variance.signum() * variance.abs().sqrt()
        };
        let both = |whole: Option<f64>, temporal: Option<f64>| whole.zip(temporal).map(|(s, t)| less(s, t));
        let fixed = both(means.std, variances.std);
        // Of s = √S and t = √T with errors d: d F = 2 √(s² d_s² + t² d_t²/N²), and half of it over √F is that of √F.
        let of_fixed = || {
            let [(s, of_s), (t, of_t)] =
                [means, variances].map(|of| Some((of.std?, of.std_error?))).map(Option::unwrap_or_default);
            let error = 2.0 * (s * of_s).hypot(t * of_t / n);
            fixed.map(|fixed| error / (2.0 * fixed.abs().max(error.sqrt() / 2.0)))
        };
        let known = |value: Option<f64>| value.filter(|_| self.is_known);
        RepeatedChannel {
            name: means.name.clone(),
            count: means.count,
            mean: means.mean,
            temporal_std: variances.std,
            fixed_std: fixed,
            std_of_means: means.std,
            std_of_frame_means,
            clipped,
            predicted_mean: means.predicted_mean,
            predicted_temporal_std: variances.predicted_std,
            predicted_fixed_std: both(means.predicted_std, variances.predicted_std),
            predicted_std_of_means: means.predicted_std,
            predicted_std_of_frame_means,
            z_mean: known(means.z_mean),
            z_temporal_std: known(variances.z_std),
            z_std_of_means: known(means.z_std),
            mean_error: means.mean_error,
            temporal_std_error: variances.std_error,
            fixed_std_error: of_fixed(),
        }
    }
}

/// A covariance whose elements are all known.
fn finite(covariance: Option<Vec<Vec<f64>>>) -> Option<Vec<Vec<f64>>> {
    covariance.filter(|rows| rows.iter().flatten().all(|value| value.is_finite()))
}
