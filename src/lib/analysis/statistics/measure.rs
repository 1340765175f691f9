//! Reads a frame and measures its regions.

use super::assessment::Assessment;
use super::laws::{Known, Laws, Samplings};
use super::levels::Levels;
use super::portrait::{Portrait, sitting};
use super::region::Region;
use super::report::{Report, coverage};
use super::tally::{Tally, tallies};
use super::verdict::Verdict;
use super::watch::{Marks, Saturated, Watch};
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::propagation::{Equations, FramePrediction, PixelMoments};
use crate::stream::RowSource;

/// Reads a whole frame and works out the statistics of its regions.
///
/// Rows are summed one by one and merged in order, so the result is the same at any number of threads. With a `level`,
/// every prediction is tested.
///
/// # Errors
///
/// [`Error::Usage`] for a region outside the frame, [`Error::Data`] where a test is wanted and nothing can be predicted,
/// and those of the source.
pub fn measure(
    source: &mut dyn RowSource,
    regions: &[Region],
    saturated: Saturated,
    equations: Equations,
    level: Option<f64>,
) -> Result<Report> {
    measure_among(&mut Laws::default(), source, regions, saturated, equations, level)
}

/// The same for one of several frames, which keep the laws that they have in common.
///
/// # Errors
///
/// Those of [`measure`].
pub fn measure_among(
    laws: &mut Laws,
    source: &mut dyn RowSource,
    regions: &[Region],
    saturated: Saturated,
    equations: Equations,
    level: Option<f64>,
) -> Result<Report> {
    Ok(measure_all(laws, source, regions, saturated, equations, level, false)?.0)
}

/// As [`measure`], and what a figure of the region shows, the whole frame where none is named.
///
/// # Errors
///
/// Those of [`measure`], and [`Error::Usage`] for more than one region.
pub fn measure_with_portrait(
    laws: &mut Laws,
    source: &mut dyn RowSource,
    regions: &[Region],
    saturated: Saturated,
    equations: Equations,
    level: Option<f64>,
) -> Result<(Report, Portrait)> {
    if regions.len() > 1 {
        let advice = "name one of these alone, or measure them without a plot";
        return Err(Error::Usage(format!("{}: a plot shows one region; {advice}", source.header().name)));
    }
    let (report, portrait) = measure_all(laws, source, regions, saturated, equations, level, true)?;
    let portrait = portrait.ok_or_else(|| Error::Data("no portrait was made".into()))?;
    Ok((report, portrait))
}

fn measure_all(
    laws: &mut Laws,
    source: &mut dyn RowSource,
    regions: &[Region],
    saturated: Saturated,
    equations: Equations,
    level: Option<f64>,
    is_drawn: bool,
) -> Result<(Report, Option<Portrait>)> {
    let whole = [Region::whole(source.header())];
    let regions = if regions.is_empty() { &whole } else { regions };
    for region in regions {
        region.check(source.header())?;
    }
    let mut watch = Watch::new(source, saturated, regions);
    let frame = watch.header().clone();
    let levels = Levels::of(&frame)?;
    let at_hand = at_hand(&mut watch, regions, (saturated, &levels), level.is_some() && !is_drawn)?;
    // Laws hang on the head of the frame alone: they are worked out while the programs before this one make its rows.
    let known = laws.of(&frame, equations);
    let are_by_place = known.are_by_place(&frame);
    let of_regions: Option<Vec<_>> =
        are_by_place.then(|| regions.iter().map(|region| known.of_region(&frame, *region)).collect());
    let Known { prediction, samplings, .. } = known;
    if let Ok(FramePrediction::Pixels(mixture)) = prediction {
        for region in regions {
            samplings.of(mixture, &frame, *region);
        }
    }
    let mut portrait = is_drawn.then(|| {
        let of_taps = of_regions.as_ref().filter(|_| frame.taps().is_some());
        let of_region = of_taps.map_or(&*prediction, |of_regions| &*of_regions[0]);
        let is_alike =
            |drawn: &&FramePrediction| !matches!(drawn, FramePrediction::Groups(_) | FramePrediction::Tapped(_));
        let drawn = of_region.as_ref().ok().filter(is_alike);
        Portrait::new(&frame, regions[0], drawn)
    });
    let tallies = match (at_hand, &mut portrait) {
        (Some(tallies), _) => tallies,
        (None, Some(portrait)) => tallies(&mut sitting(&mut watch, portrait), regions, &levels, level.is_some())?,
        (None, None) => tallies(&mut watch, regions, &levels, level.is_some())?,
    };
    if level.is_some() {
        check_fair(&watch, saturated)?;
    }
    let (counts, left_out) = watch.seen();
    let is_fair = |marks: &Marks| marks.beyond_model + if left_out { marks.saturated } else { 0 } == 0;
    if !is_fair(&counts[0]) {
        portrait.iter_mut().for_each(Portrait::forget_predictions);
    }
    let report = |(index, ((region, tally), marks)): (usize, ((&Region, &Tally), &Marks))| {
        let sampling = |mixture: &PixelMoments| match of_regions {
            None => samplings.of(mixture, &frame, *region),
            Some(_) => Samplings::default().of(mixture, &frame, *region),
        };
        let prediction = of_regions.as_ref().map_or(&*prediction, |of_regions| &*of_regions[index]);
        // What is left where pixels are left out by their values follows no formula; those of defects are any.
        let prediction = prediction.as_ref().ok().filter(|_| is_fair(marks));
        let assessment = Assessment::new(tally, &frame, *region, prediction, sampling);
        let of_lines = tally.lines.iter().flat_map(|lines| lines.tests(&frame, prediction));
        let tests = if level.is_some() { assessment.tests().into_iter().chain(of_lines).collect() } else { Vec::new() };
        assessment.report(&frame, *region, &levels).with_marks(*marks, left_out).tested(tests)
    };
    let regions = regions.iter().zip(&tallies).zip(&counts).enumerate().map(report).collect();
    let unpredicted = match &of_regions {
        None => prediction.as_ref().err(),
        Some(of_regions) => of_regions.iter().find_map(|prediction| (**prediction).as_ref().err()),
    };
    let unpredicted = unpredicted.map(ToString::to_string);
    let mut report = Report { regions, check: None, uncertainty: coverage(&frame), unpredicted };
    if let Some(level) = level {
        if prediction.is_ok() {
            check_planes(&frame)?;
        }
        let regions = report.regions.iter().map(|region| (&region.tests[..], region.not_finite));
        report.check = Some(Verdict::of(regions, level, &frame.name, report.unpredicted.as_deref())?);
    }
    Ok((report, portrait))
}

/// The sums of a frame that is to be checked and that nobody has to be waited for: what can be checked is known before anything is worked
/// out; none of others.
fn at_hand(
    watch: &mut Watch<'_>,
    regions: &[Region],
    (saturated, levels): (Saturated, &Levels),
    is_checked: bool,
) -> Result<Option<Vec<Tally>>> {
    if !is_checked || watch.may_wait() {
        return Ok(None);
    }
    let found = tallies(watch, regions, levels, true)?;
    check_fair(watch, saturated)?;
    Ok(Some(found))
}

/// Makes sure that a frame all of whose rows were seen can be checked.
fn check_fair(watch: &Watch<'_>, saturated: Saturated) -> Result<()> {
    let frame = watch.header();
    check_testable(frame)?;
    check_unmarked(frame, watch.marks(), watch.untold().filter(|_| saturated == Saturated::LeftOut))
}

/// Makes sure that no pixel was left out for its value, or should be: `untold` says how many, where nothing marks which.
fn check_unmarked(frame: &FrameHeader, (counts, left_out): (&[Marks], bool), untold: Option<String>) -> Result<()> {
    let marked = counts.iter().map(|marks| marks.saturated).find(|count| *count > 0).filter(|_| left_out);
    let why = match (marked, untold) {
        (Some(pixels), _) => {
            format!("{pixels} pixels used saturated samples; without them the others are no fair sample")
        }
        (None, Some(pixels)) => format!("{pixels}, and nothing marks which"),
        (None, None) => return Ok(()),
    };
    Err(unfair(frame, &why))
}

/// Refuses to check a frame of which pixels are left out for their values, or should be.
pub(super) fn unfair(frame: &FrameHeader, why: &str) -> Error {
    Error::Data(format!("{}: nothing can be checked: {why}", frame.name)).give(&["keep_saturated"])
}

/// Makes sure that samples are not mixed in a way that no test knows.
pub(super) fn check_testable(frame: &FrameHeader) -> Result<()> {
    if frame.metadata.is_transferred() {
        return Err(Error::Data(format!(
            "{}: nothing can be checked: charge transfer mixes neighbors, differently from place to place",
            frame.name
        )));
    }
    Ok(())
}

/// Makes sure that the planes of a frame are those that are predicted: one of a filter array, or three.
fn check_planes(frame: &FrameHeader) -> Result<()> {
    let names = &frame.geometry.channels;
    match names.iter().find(|name| name.starts_with("variance.")) {
        None => Ok(()),
        Some(name) => Err(Error::Data(format!(
            "{}: nothing can be checked: beside means over frames it holds their variances ({name}), as `measure --pixels` writes them, \
             and these are tested where the frames are: `measure --over frames --check`",
            frame.name
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cfa::CfaPattern;
    use crate::frame::Geometry;
    use crate::metadata::{FrameHeader, Metadata};
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;

    fn frame(channels: &[&str], width: usize, height: usize, f: impl Fn(usize) -> f32) -> MemoryFrame {
        let geometry = Geometry::new(width, height, channels);
        let samples = (0..geometry.row_samples() * height).map(f).collect();
        let header = FrameHeader { name: "test".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
        MemoryFrame::new(header, samples)
    }

    #[test]
    fn regions_see_their_own_samples() {
        let mut ramp = frame(&["Y"], 10, 8, |i| i as f32);
        let region = Region { x: 2, y: 3, width: 3, height: 2 };
        let report = measure(&mut ramp, &[region], Saturated::LeftOut, Equations::Exact, None).unwrap();
        let channel = &report.regions[0].channels[0];
        assert_eq!((channel.min, channel.max, channel.mean), (Some(32.0), Some(44.0), Some(38.0)));
        let outside = Region { x: 8, ..region };
        let again =
            measure(&mut frame(&["Y"], 10, 8, |i| i as f32), &[outside], Saturated::LeftOut, Equations::Exact, None);
        assert!(again.unwrap_err().to_string().contains("does not lie within"));
    }

    #[test]
    fn classes_of_a_plane_are_told_apart_wherever_the_region_starts() {
        let mut plane = frame(&["Y"], 8, 6, |i| [10.0, 20.0, 20.0, 30.0][(i / 8 % 2) * 2 + i % 2]);
        plane.header.metadata.cfa = Some(CfaPattern::Rggb.into());
        let region = Region { x: 1, y: 1, width: 5, height: 4 };
        let report = measure(&mut plane, &[region], Saturated::LeftOut, Equations::Exact, None).unwrap();
        let means: Vec<_> = report.regions[0].classes.iter().map(|class| class.mean).collect();
        assert_eq!(means, [Some(10.0), Some(20.0), Some(30.0)]);
    }

    /// Of independent normal samples 1/√n and 1/√(2(n − 1)) of the standard deviation; of a plane, those of its classes.
    #[test]
    fn errors_are_those_of_independent_samples() {
        let noise = |i: usize| ((i * 7919 + i * i * 31) % 1009) as f32 / 1009.0;
        let report =
            measure(&mut frame(&["Y"], 40, 30, noise), &[], Saturated::LeftOut, Equations::Exact, None).unwrap();
        let channel = &report.regions[0].channels[0];
        let std = channel.std.unwrap();
        assert!((channel.mean_error.unwrap() / std * 1200_f64.sqrt() - 1.0).abs() < 1e-12);
        assert!((channel.std_error.unwrap() / std * 2398_f64.sqrt() - 1.0).abs() < 1e-12);
        // Classes 100 apart: the error of the mean is that of their own scatter, not of their distance.
        let mut plane = frame(&["Y"], 40, 30, |i| noise(i) + 100.0 * [1.0, 2.0, 2.0, 3.0][(i / 40 % 2) * 2 + i % 2]);
        plane.header.metadata.cfa = Some(CfaPattern::Rggb.into());
        let report = measure(&mut plane, &[], Saturated::LeftOut, Equations::Exact, None).unwrap();
        let (whole, classes) = (&report.regions[0].channels[0], &report.regions[0].classes);
        let of_classes = |k: usize| classes[k].mean_error.unwrap() * [0.25, 0.5, 0.25][k];
        let expected = (0..3).map(|k| of_classes(k).powi(2)).sum::<f64>().sqrt();
        assert!((whole.mean_error.unwrap() / expected - 1.0).abs() < 1e-9);
        assert!(whole.std.unwrap() > 70.0 && whole.std_error.unwrap() < 0.01);
    }

    #[test]
    fn one_sample_has_a_mean_and_no_spread() {
        let report =
            measure(&mut frame(&["Y"], 1, 1, |_| 7.0), &[], Saturated::LeftOut, Equations::Exact, None).unwrap();
        let channel = &report.regions[0].channels[0];
        assert_eq!((channel.mean, channel.std, channel.snr_db), (Some(7.0), None, None));
        assert_eq!(report.regions[0].covariance, None);
    }
}
