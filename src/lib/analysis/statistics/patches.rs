//! Patches of a chart: a frame that shows each pixel of a source as a rectangle of photosites, measured patch by patch.
//!
//! The scene is not uniform, but each patch is, and its means tell the level: the expected electrons are worked back from
//! them, and spread and covariance are predicted at these. The means are used up by that, and are not tested.

use super::assessment::Assessment;
use super::laws::{self, Known};
use super::levels::Levels;
use super::region::Region;
use super::report::{RegionReport, Report, coverage};
use super::tally::{Tally, tallies};
use super::watch::{Saturated, Watch};
use crate::color;
use crate::error::{Error, Result};
use crate::metadata::{FrameHeader, Scene};
use crate::names::Named;
use crate::numerics::moments::{self, Moments};
use crate::propagation::sampling::{Place, Sampling, SamplingBasis};
use crate::propagation::{self, Equations, FramePrediction, PixelMoments, Unpredictable};
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::REACH;
use crate::stages::demosaic::weights::WeightTable;
use crate::stream::RowSource;
use crate::units::QuantityKind;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;

/// A patch that lies whole within a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patch {
    /// Column and row in the chart.
    pub at: [usize; 2],
    /// Number, row by row, from 0; where the width of the chart is known.
    pub sample: Option<usize>,
    /// What demosaicking has not mixed with the neighbors.
    pub interior: Region,
}

/// The whole patches of a frame, of `size` photosites or of what the metadata say, laid out from the sensor's corner.
///
/// The chart is as wide as the source that the metadata name; a frame that names none, but starts at the sensor's corner
/// and ends with a whole patch, is the chart.
///
/// # Errors
///
/// [`Error::Usage`] where the size is not known, where a patch has no interior, and where no patch is whole.
pub fn of_frame(frame: &FrameHeader, size: Option<[usize; 2]>) -> Result<Vec<Patch>> {
    let usage = |problem: String| Error::Usage(format!("{}: {problem}", frame.name));
    let scene = frame.metadata.scene.as_ref();
    let recorded = scene.and_then(|scene| scene.patch).filter(|patch| *patch != [1, 1]);
    let Some(size) = size.or(recorded) else {
        return Err(usage("its metadata tell of no patches of several photosites".into()).give(&["patches"]));
    };
    let [width, height] = size;
    let method = frame.metadata.demosaic.as_ref().map(|record| record.method.as_str());
    let margin = method.map_or(0, |name| Method::named(name).map_or(REACH.unsigned_abs(), Method::reach));
    let least = 2 * margin + 1;
    if width.min(height) < least {
        return Err(usage(format!(
            "patches of {width}x{height} have no interior: {} mixes colors up to {margin} pixels from their edges; they \
             must be {least}x{least} at least",
            method.unwrap_or_default()
        )));
    }
    let geometry = &frame.geometry;
    let of_source = scene.filter(|_| recorded == Some(size)).and_then(|scene| scene.source_width);
    let of_frame = (geometry.origin == [0, 0] && geometry.width.is_multiple_of(width)).then(|| geometry.width / width);
    let columns = of_source.or(of_frame);
    let [across, down] =
        [whole(geometry.origin[0], geometry.width, width), whole(geometry.origin[1], geometry.height, height)];
    let count = across.len() as u128 * down.len() as u128;
    let most = most_patches(geometry.channels.len());
    if count > most as u128 {
        let problem = format!("it has {count} patches of {width}x{height}; {most} are measured at a time at most");
        return Err(usage(problem).change(&["patches"]));
    }
    if count == 0 {
        return Err(usage(format!(
            "no patch of {width}x{height} lies whole within the frame of {}x{}",
            geometry.width, geometry.height
        )));
    }
    let columns_of_patches: Vec<(usize, usize)> = across.collect();
    let mut patches = Vec::new();
    for (row, y) in down {
        for &(column, x) in &columns_of_patches {
            let interior =
                Region { x: x + margin, y: y + margin, width: width - 2 * margin, height: height - 2 * margin };
            let sample = columns.and_then(|columns| row.checked_mul(columns)?.checked_add(column));
            patches.push(Patch { at: [column, row], sample, interior });
        }
    }
    Ok(patches)
}

/// So many patches of frames of so many channels are measured at a time: what is kept of each until the report is written
/// takes some kilobytes, and for each pair of channels a number twice.
fn most_patches(channels: usize) -> usize {
    /// Of frames of a few channels: a chart of 256x256 patches.
    const MOST: usize = 1 << 16;
    /// Pairs of channels whose room is that of the rest.
    const FREE_PAIRS: usize = 128;
    MOST / (1 + moments::pairs(channels) / FREE_PAIRS)
}

/// Along one axis of a frame, the patches that lie whole within it: number, and first sample in the frame.
fn whole(origin: i32, length: usize, size: usize) -> Places {
    if size > length {
        return Places { origin: 0, size: 1, numbers: 0..0 };
    }
    let (origin, length, size) = (i64::from(origin), length as i64, size as i64);
    let first = (origin + size - 1).div_euclid(size).max(0);
    let end = (origin + length).div_euclid(size).max(first);
    Places { origin, size, numbers: first..end }
}

/// Patches along one axis.
struct Places {
    origin: i64,
    size: i64,
    numbers: Range<i64>,
}

impl Places {
    fn len(&self) -> u64 {
        (self.numbers.end - self.numbers.start).unsigned_abs()
    }
}

impl Iterator for Places {
    type Item = (usize, usize);

    fn next(&mut self) -> Option<Self::Item> {
        let index = self.numbers.next()?;
        Some((usize::try_from(index).ok()?, usize::try_from(index * self.size - self.origin).ok()?))
    }
}

/// Why nothing is said of patches that several amplifiers read.
const READ_BY_SEVERAL: &str = "its sensor is read through several amplifiers (`taps`); regions of a uniform scene are predicted, and \
                               patches not";

/// Why nothing is said of patches whose signal hangs on what else is in the frame.
const OTHER_LIGHT: &str = "the signal of each hangs on other light of the frame: by smear (`smear_line_s` of the sensor), or charge that was moved (--cte)";

/// Reads a whole frame and works out the statistics of the interiors of its patches.
///
/// Where the scene is uniform, or not rendered, predictions are those of the frame, or none.
///
/// # Errors
///
/// Those of [`of_frame`] and of the source.
pub fn measure(
    source: &mut dyn RowSource,
    size: Option<[usize; 2]>,
    saturated: Saturated,
    equations: Equations,
) -> Result<Report> {
    let patches = of_frame(source.header(), size)?;
    let regions: Vec<Region> = patches.iter().map(|patch| patch.interior).collect();
    let mut watch = Watch::new(source, saturated, &regions);
    let frame = watch.header().clone();
    let levels = Levels::of(&frame)?;
    let tallies = tallies(&mut watch, &regions, &levels, false)?;
    let (counts, left_out) = watch.seen();
    let mut unpredicted = None;
    let mut of_frame = laws::Laws::default();
    let known = match frame.taps() {
        None => of_frame.of(&frame, equations).checked(),
        Some(_) => Err(Unpredictable::Beyond(READ_BY_SEVERAL)),
    };
    let reports: Vec<RegionReport> = match known {
        Ok(known) => {
            let tallies = tallies.iter().zip(regions);
            tallies
                .map(|(tally, region)| as_uniform(known, tally, &frame, region).report(&frame, region, &levels))
                .collect()
        }
        Err(why) => {
            // Patches of a scene that is not uniform are predicted at their own means.
            unpredicted = (frame.metadata.scene.is_some() && !is_rendered(&frame) || frame.taps().is_some())
                .then(|| if frame.taps().is_some() { why.to_string() } else { OTHER_LIGHT.into() });
            let laws = Laws::of(&frame, &regions);
            let tallies = tallies.par_iter().zip(&regions);
            tallies
                .map(|(tally, region)| {
                    let prediction = at_means(tally, &frame, *region, equations);
                    let sampling = |mixture: &PixelMoments| laws.sampling(mixture, region.place(&frame));
                    let assessment = Assessment::new(tally, &frame, *region, prediction.as_ref(), sampling);
                    let mut report = assessment.report(&frame, *region, &levels);
                    for channel in report.channels.iter_mut().chain(&mut report.classes) {
                        (channel.predicted_mean, channel.z_mean) = (None, None);
                    }
                    report
                })
                .collect()
        }
    };
    let reports = reports.into_iter().zip(patches).zip(counts).map(|((report, patch), marks)| {
        let report = RegionReport { patch: Some(patch.at), sample: patch.sample, ..report };
        let report = report.with_marks(marks, left_out);
        let by_value = marks.beyond_model + if left_out { marks.saturated } else { 0 };
        if by_value > 0 { report.without_predictions() } else { report }
    });
    let reports = reports.collect();
    Ok(Report { regions: reports, check: None, uncertainty: coverage(&frame), unpredicted })
}

/// Sampling laws of the places of patches, at any level; none where the weights hang on the level.
struct Laws(Vec<(Place, SamplingBasis)>);

impl Laws {
    fn of(frame: &FrameHeader, regions: &[Region]) -> Self {
        let record = frame.metadata.demosaic.as_ref().filter(|_| is_rendered(frame));
        let method = record.and_then(|record| Some((Method::named(&record.method)?, record.cfa)));
        let table = method.map(|(method, cfa)| WeightTable::of(method, cfa)).filter(|table| !table.depends_on_hue());
        let Some(table) = table else { return Self(Vec::new()) };
        let mut places: Vec<Place> = Vec::new();
        for place in regions.iter().map(|region| region.place(frame)) {
            if !places.contains(&place) {
                places.push(place);
            }
        }
        let weights = table.about([1.0; 2]);
        Self(places.into_par_iter().map(|place| (place, SamplingBasis::of(&weights, &place))).collect())
    }

    fn sampling(&self, mixture: &PixelMoments, place: Place) -> Sampling {
        // The law of what rows and columns share is none of nine.
        let is_independent = mixture.site_covariance().is_independent();
        let known = self.0.iter().find(|(of, _)| is_independent && *of == place);
        let mut sampling = match known {
            Some((_, basis)) => basis.sampling(&mixture.sites).through(&mixture.from_camera),
            None => Sampling::of(&mixture.weights, &mixture.sites, &place),
        };
        sampling.covariance += mixture.beyond_weights();
        sampling
    }
}

/// Whether the frame was rendered and nothing was done to it that leaves a patch without a level of its own: smear hangs on
/// what else is in its columns.
fn is_rendered(frame: &FrameHeader) -> bool {
    let has_smear = frame.metadata.noise.as_ref().is_some_and(|noise| noise.smear_per_row > 0.0);
    frame.metadata.scene.is_some() && !frame.metadata.is_transferred() && !has_smear
}

/// A patch of a uniform scene.
fn as_uniform<'a>(known: &mut Known, tally: &'a Tally, frame: &FrameHeader, region: Region) -> Assessment<'a> {
    let of_region = known.are_by_place(frame).then(|| known.of_region(frame, region));
    let Known { prediction, samplings, .. } = known;
    let prediction = of_region.as_deref().unwrap_or(prediction);
    let sampling = |mixture: &PixelMoments| samplings.of(mixture, frame, region);
    Assessment::new(tally, frame, region, prediction.as_ref().ok(), sampling)
}

/// What is predicted of a uniform scene whose means are those of a tally; where full well or an end of the codes cuts off what rows or columns
/// share, with how it scatters in its region.
fn at_means(tally: &Tally, frame: &FrameHeader, region: Region, equations: Equations) -> Option<FramePrediction> {
    if !is_rendered(frame) || frame.taps().is_some() {
        return None;
    }
    let measured = expected_electrons(frame, means(tally)?)?;
    let (uniform, found) = at_level(measured, frame, equations)?;
    if !found.has_lines() {
        return Some(found);
    }
    let by_place = laws::of_samples(&uniform, region, equations).ok().filter(laws::is_by_place);
    Some(by_place.unwrap_or(found))
}

/// The uniform scene whose predicted means lead back to such electrons, and what is predicted of it: where full well or an end of the codes holds
/// means back it is brighter, or darker, than these; none where no level is known to lead there.
fn at_level(measured: [f64; 3], frame: &FrameHeader, equations: Equations) -> Option<(FrameHeader, FramePrediction)> {
    /// Distances below this share of shot noise, or of an electron, do not count.
    const NEAR: f64 = 0.02;
    const STEPS: usize = 12;
    /// Where a mean follows its level by less, noise of the mean is most of what is told of the level.
    const LEAST_SLOPE: f64 = 0.3;
    let scene = frame.metadata.scene.as_ref()?;
    let at = |level: [f64; 3]| {
        let mut uniform = frame.clone();
        uniform.metadata.scene = Some(Scene { uniform: true, expected_electrons: Some(level), ..scene.clone() });
        let found = propagation::of_frame(&uniform, equations).ok()?;
        let means = match &found {
            FramePrediction::Planes(sites) => sites.map(|site| site.moments.mean),
            FramePrediction::Pixels(pixels) => pixels.mean,
            FramePrediction::Groups(_) | FramePrediction::Tapped(_) => return None,
        };
        Some((uniform, found, means))
    };
    let mut level = measured;
    let mut before: Option<([f64; 3], [f64; 3])> = None;
    for _ in 0..STEPS {
        let (uniform, found, means) = at(level)?;
        let reached = electrons_of(frame, means)?;
        let off = [0, 1, 2].map(|k| measured[k] - reached[k]);
        let is_near = |k: usize| off[k].abs() <= NEAR * level[k].max(1.0).sqrt() || level[k] <= 0.0 && off[k] <= 0.0;
        if (0..3).all(is_near) {
            return Some((uniform, found));
        }
        let slope = |k: usize| match before {
            Some((of_level, of_mean)) if (level[k] - of_level[k]).abs() > 1e-6 => {
                (reached[k] - of_mean[k]) / (level[k] - of_level[k])
            }
            _ => 1.0,
        };
        let slopes = [0, 1, 2].map(slope);
        if slopes.iter().any(|slope| !(LEAST_SLOPE..).contains(slope)) {
            return None;
        }
        before = Some((level, reached));
        level = [0, 1, 2].map(|k| if is_near(k) { level[k] } else { (level[k] + off[k] / slopes[k]).max(0.0) });
    }
    None
}

/// Means of the three planes, or of the classes of one; NaN for a class of which there is none.
fn means(tally: &Tally) -> Option<[f64; 3]> {
    let Tally { channels, classes, .. } = tally;
    if channels.count == 0 {
        return None;
    }
    let of_class = |class: &Moments| if class.count > 0 { class.mean[0] } else { f64::NAN };
    let of_planes = || channels.mean.first_chunk().copied();
    classes.as_ref().map_or_else(of_planes, |classes| Some(classes.each_ref().map(of_class)))
}

/// Expected signal electrons of R, G and B in a patch whose samples have these means; 0 for a class of which the means
/// do not tell, or tell less than nothing. None where the metadata do not say enough.
///
/// Noise moves the means of L\*a\*b\* and xyY to second order, σ²/μ², far below the sampling error of a spread; full well and the ends of the
/// codes hold them back, which [`measure`] takes into account where they leave a level to work back to.
pub fn expected_electrons(frame: &FrameHeader, means: [f64; 3]) -> Option<[f64; 3]> {
    electrons_of(frame, means).map(|electrons| electrons.map(|e| if e.is_finite() { e.max(0.0) } else { 0.0 }))
}

/// The same as the means are, below 0 and NaN too.
fn electrons_of(frame: &FrameHeader, means: [f64; 3]) -> Option<[f64; 3]> {
    let metadata = &frame.metadata;
    let straight = metadata.adc.filter(|adc| !adc.is_bent());
    let camera_signals = |xyz: [f64; 3]| -> Option<[f64; 3]> {
        let record = metadata.color.as_ref()?;
        let adu_from_xyz = record.xyz_from_adu(metadata.exposure)?.try_inverse()?;
        Some((adu_from_xyz * Vector3::from(xyz) / straight?.adu_per_e).into())
    };
    let [first, second, third] = means;
    Some(match metadata.quantity {
        QuantityKind::ExpectedElectrons => means,
        QuantityKind::Electrons => means.map(|mean| mean - metadata.dark_signal_e.unwrap_or(0.0)),
        QuantityKind::Adu => {
            let adc = metadata.adc?;
            let black = metadata.uniform_black_adu()?;
            means.map(|mean| adc.electrons_between(black, mean))
        }
        QuantityKind::Xyz => camera_signals(means)?,
        QuantityKind::Xyy => camera_signals(color::xyz_of_chromaticity([first, second], third))?,
        QuantityKind::Lab => camera_signals(color::xyz_from_lab(means, metadata.color.as_ref()?.white?))?,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::optics::Exposure;
    use crate::cfa::CfaPattern;
    use crate::color::{lab_from_xyz, xyy_from_xyz};
    use crate::frame::Geometry;
    use crate::metadata::{AdcRecord, ColorRecord, DemosaicRecord, Metadata};
    use crate::stream::MemoryFrame;

    /// A chart of 5 columns in patches of 8x6.
    fn chart(width: usize, height: usize, origin: [i32; 2]) -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Electrons);
        metadata.scene = Some(Scene {
            source: "chart".into(),
            uniform: false,
            expected_electrons: None,
            true_xyz: None,
            vignetting_focal_length_mm: None,
            patch: Some([8, 6]),
            source_width: Some(5),
            brightest_e: None,
            upsampling: None,
        });
        let geometry = Geometry { origin, ..Geometry::new(width, height, &["R", "G", "B"]) };
        FrameHeader { name: "chart.exr".into(), geometry, metadata }
    }

    fn with_demosaic(mut frame: FrameHeader, method: &str) -> FrameHeader {
        let (cfa, black) = (CfaPattern::Rggb, 0.0.into());
        frame.metadata.demosaic =
            Some(DemosaicRecord { method: method.into(), cfa, black, black_deltas: false, plane: None });
        frame
    }

    #[test]
    fn patches_are_laid_out_from_the_sensors_corner() {
        let patches = of_frame(&chart(40, 18, [0, 0]), None).unwrap();
        assert_eq!(patches.len(), 15);
        let second_row = Patch { at: [1, 1], sample: Some(6), interior: Region { x: 8, y: 6, width: 8, height: 6 } };
        assert_eq!(patches[6], second_row);
        // A rim of the method's reach is left out.
        let patches = of_frame(&with_demosaic(chart(40, 18, [0, 0]), "shti"), None).unwrap();
        assert_eq!(patches[6].interior, Region { x: 10, y: 8, width: 4, height: 2 });
        // The last column and row are cut.
        let patches = of_frame(&chart(39, 17, [0, 0]), None).unwrap();
        assert_eq!(patches.iter().map(|patch| patch.sample).collect::<Vec<_>>(), [0, 1, 2, 3, 5, 6, 7, 8].map(Some));
    }

    #[test]
    fn a_crop_keeps_the_numbers_of_its_whole_patches() {
        // Sensor columns 3 to 27 and rows 6 to 16: the patches of columns 1 and 2, row 1.
        let patches = of_frame(&chart(25, 11, [3, 6]), None).unwrap();
        let region = |x| Region { x, y: 0, width: 8, height: 6 };
        assert_eq!(
            patches,
            [(1, 6, 5), (2, 7, 13)].map(|(column, sample, x)| Patch {
                at: [column, 1],
                sample: Some(sample),
                interior: region(x)
            })
        );
        // Of another chart the width is known only where the frame shows it whole.
        let samples = |width, origin| {
            let patches = of_frame(&chart(width, 6, origin), Some([4, 3])).unwrap();
            patches.iter().map(|patch| patch.sample).collect::<Vec<_>>()
        };
        assert_eq!(samples(8, [0, 0]), [0, 1, 2, 3].map(Some));
        assert_eq!(samples(9, [0, 0]), [None; 4]);
        assert_eq!(samples(8, [4, 0]), [None; 4]);
        // What lies before the sensor's corner is no chart.
        let patches = of_frame(&chart(24, 6, [-8, 0]), None).unwrap();
        assert_eq!(
            patches.iter().map(|patch| (patch.at, patch.interior.x)).collect::<Vec<_>>(),
            [([0, 0], 8), ([1, 0], 16)]
        );
    }

    #[test]
    fn what_has_no_patches_is_refused() {
        let complaint = |frame: &FrameHeader, size| of_frame(frame, size).unwrap_err().to_string();
        let mut plain = chart(40, 18, [0, 0]);
        for patch in [Some([1, 1]), None] {
            plain.metadata.scene.as_mut().unwrap().patch = patch;
            assert!(complaint(&plain, None).contains("give `patches`"));
        }
        assert!(complaint(&chart(10, 5, [4, 3]), None).contains("no patch of 8x6 lies whole within the frame of 10x5"));
        let camera = with_demosaic(chart(40, 18, [0, 0]), "eci");
        assert!(complaint(&camera, None).contains("patches of 8x6 have no interior"));
        assert!(complaint(&camera, None).ends_with("they must be 7x7 at least"));
        assert!(complaint(&camera, Some([41, 7])).contains("lies whole"));
    }

    /// Every stage leads back to the electrons that it came from; doubles carry the condition of the matrix, about 10.
    #[test]
    fn means_of_every_stage_lead_back_to_electrons() {
        let electrons = [700.0, 1500.0, 2900.0];
        let mut frame = chart(8, 6, [0, 0]);
        let check = |frame: &FrameHeader, means: [f64; 3]| {
            let found = expected_electrons(frame, means).unwrap();
            for (found, expected) in found.into_iter().zip(electrons) {
                assert!((found / expected - 1.0).abs() < 1e-12, "{:?}: {found} {expected}", frame.metadata.quantity);
            }
        };
        frame.metadata.dark_signal_e = Some(30.0);
        check(&frame, electrons.map(|e| e + 30.0));
        assert_eq!(expected_electrons(&frame, [10.0, f64::NAN, 31.0]), Some([0.0, 0.0, 1.0]));
        frame.metadata.quantity = QuantityKind::Adu;
        assert_eq!(expected_electrons(&frame, electrons), None);
        frame.metadata.adc = Some(AdcRecord::new(14, 100.0, 0.25));
        frame.metadata.black_level_adu = Some(107.5.into());
        check(&frame, electrons.map(|e| 0.25 * e + 107.5));

        let exposure = Exposure { exposure_s: 0.02, f_number: 5.6, lens_transmittance: 1.0 };
        let xyz_from_camera = [[0.4, 0.3, 0.2], [0.2, 0.7, 0.1], [0.01, 0.1, 0.9]];
        let white = [950.0, 1000.0, 1080.0];
        frame.metadata.exposure = Some(exposure);
        frame.metadata.color = Some(ColorRecord {
            range_adu: None,
            xyz_from_camera,
            method: None,
            black_adu: 7.0,
            white: Some(white),
            scene_white_xy: None,
            adapted: None,
            matrix_residual: None,
            scene_error: None,
        });
        let camera = Vector3::from(electrons.map(|e| 0.25 * e));
        let xyz: [f64; 3] = (color::matrix(&xyz_from_camera) / exposure.exposure_s_sr() * camera).into();
        for (quantity, means) in [
            (QuantityKind::Xyz, xyz),
            (QuantityKind::Xyy, xyy_from_xyz(xyz, [0.3, 0.3])),
            (QuantityKind::Lab, lab_from_xyz(xyz, white)),
        ] {
            frame.metadata.quantity = quantity;
            check(&frame, means);
        }
        frame.metadata.quantity = QuantityKind::Srgb;
        assert_eq!(expected_electrons(&frame, electrons), None);
    }

    /// The same numbers as of the same rectangles; predictions only where the frame was rendered.
    #[test]
    fn patches_are_measured_as_regions_are() {
        let header = chart(37, 18, [2, 0]);
        let samples: Vec<f32> = (0..37 * 3 * 18).map(|i| ((i * 7919) % 1013) as f32).collect();
        let frame = || MemoryFrame::new(header.clone(), samples.clone());
        let patches = measure(&mut frame(), None, Saturated::LeftOut, Equations::Exact).unwrap();
        let regions: Vec<Region> = patches.regions.iter().map(|report| report.region).collect();
        assert_eq!(regions.len(), 9);
        let plain =
            super::super::measure::measure(&mut frame(), &regions, Saturated::LeftOut, Equations::Exact, None).unwrap();
        for (patch, region) in patches.regions.iter().zip(&plain.regions) {
            assert!(patch.patch.is_some() && patch.sample.is_some() && region.patch.is_none());
            assert_eq!(patch.covariance, region.covariance);
            for (a, b) in patch.channels.iter().zip(&region.channels) {
                assert_eq!((a.count, a.mean, a.std, a.min, a.max), (b.count, b.mean, b.std, b.min, b.max));
            }
        }
        let mut other = frame();
        other.header.metadata.scene = None;
        let unknown = measure(&mut other, Some([8, 6]), Saturated::LeftOut, Equations::Exact).unwrap();
        assert!(
            unknown.regions.iter().flat_map(|region| &region.channels).all(|channel| channel.predicted_std.is_none())
        );
    }
}
