//! Comparison of images and colors, pixel by pixel: which white they are seen under, what each pair differs by.

mod white;

use crate::color::difference::{Difference, DifferenceReport, Differences};
use crate::color::{Space, lab_from_xyz, xyz_of_chromaticity};
use crate::error::{Error, Result};
use crate::frame::{Geometry, to_sample};
use crate::metadata::FrameHeader;
use crate::stream::{Band, RowSink, RowSource, fold, fold_into};
use crate::units::{Any, QuantityKind};
use rayon::prelude::*;
use serde::Serialize;
use white::{space_of, white};

pub use white::{ComparisonSettings, NUMBERS_WHITE_LUMINANCE};

/// Channels of a map of differences, in the order in which files have them.
pub const MAP_CHANNELS: [&str; 4] = ["delta_e_2000", "delta_e_76", "delta_e_94", "jnd"];

/// One of the two that are compared.
#[derive(Debug, Clone, PartialEq)]
pub enum Side<S> {
    /// An image.
    Frame(S),
    /// A color, the same against every pixel.
    Color([f64; 3]),
}

/// What is said of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparisonReport {
    /// Statistics by each formula.
    #[serde(flatten)]
    pub differences: DifferenceReport,
    /// Pairs compared.
    pub count: u64,
    /// Pairs left out because a color is NaN or infinite.
    pub not_finite: u64,
    /// XYZ of the white; none where both are L\*a\*b\*.
    pub white: Option<[f64; 3]>,
    /// What was compared, the reference first, each with its space.
    #[serde(skip)]
    pub sides: [String; 2],
}

/// Two images, an image and a color, or two colors; the first is the reference.
#[derive(Debug)]
pub struct Comparison<S> {
    sides: [Side<S>; 2],
    spaces: [Space; 2],
    white: Option<[f64; 3]>,
    /// That of the frames; none of two colors.
    geometry: Option<Geometry>,
    differences: Differences,
}

impl<S: RowSource> Comparison<S> {
    /// Compares a color or image with a reference.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] and [`Error::Format`] for frames that hold no colors or do not fit each other;
    /// [`Error::MissingKey`] where the luminance of the white is not known; [`Error::Usage`] for a white that cannot be.
    pub fn new(reference: Side<S>, color: Side<S>, settings: &ComparisonSettings) -> Result<Self> {
        let sides = [reference, color];
        let [first, second] = [sides[0].header(), sides[1].header()];
        let space = |header: Option<&FrameHeader>| match header {
            Some(header) => space_of(header, settings.space),
            None => Ok(settings.space.unwrap_or(Space::Xyz)),
        };
        let spaces = [space(first)?, space(second)?];
        if let Some((first, second)) = first.zip(second) {
            let [a, b] = [first, second].map(|header| (header.geometry.width, header.geometry.height));
            if a != b {
                return Err(second.refuse(format!(
                    "its size is {}x{}, but that of {} is {}x{}; compare images of one size",
                    b.0, b.1, first.name, a.0, a.1
                )));
            }
        }
        let white = white([first, second], spaces, settings)?;
        let geometry = first.or(second).map(|header| header.geometry.clone());
        Ok(Self { sides, spaces, white, geometry, differences: Differences::default() })
    }

    /// The frames among the two.
    pub fn frames(&self) -> impl Iterator<Item = &S> {
        self.sides.iter().filter_map(Side::frame)
    }

    /// The same, to close them.
    pub fn frames_mut(&mut self) -> impl Iterator<Item = &mut S> {
        self.sides.iter_mut().filter_map(Side::frame_mut)
    }

    /// Rows to compare; 0 of two colors.
    pub fn height(&self) -> usize {
        self.geometry.as_ref().map_or(0, |geometry| geometry.height)
    }

    /// XYZ of the white; none where both are L\*a\*b\*.
    pub fn white(&self) -> Option<[f64; 3]> {
        self.white
    }

    /// The head of the map of differences, with the metadata of the first frame.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for two colors, which have no map.
    pub fn map_header(&self) -> Result<FrameHeader> {
        let Some(header) = self.frames().next().map(S::header) else {
            return Err(Error::Usage("a map needs an image; two colors have no map of differences".into()));
        };
        let mut metadata = header.metadata.becoming(QuantityKind::ColorDifference);
        if let Some(record) = &mut metadata.color {
            record.white = self.white.or(record.white);
        }
        Ok(FrameHeader { name: header.name.clone(), geometry: header.geometry.with_channels(&MAP_CHANNELS), metadata })
    }

    /// Compares all pixels, band by band in step; memory is a few bands whatever the height.
    ///
    /// Rows are taken in one by one in their order, so the result is the same at any number of threads. Where a color is NaN
    /// or infinite the map is NaN. `progress` hears of the rows done so far.
    ///
    /// # Errors
    ///
    /// Those of the sources and of the sink.
    pub fn run(&mut self, map: Option<&mut dyn RowSink>, progress: &mut dyn FnMut(usize)) -> Result<()> {
        let Self { sides, spaces, white, geometry, differences } = self;
        let (spaces, white) = (*spaces, *white);
        let Some(geometry) = geometry else {
            if let [Side::Color(reference), Side::Color(color)] = sides {
                differences.add(&[difference([*reference, *color], spaces, white)]);
            }
            return Ok(());
        };
        let colors = sides.each_ref().map(Side::color);
        let compared = |band: &Band| -> Vec<Vec<Difference>> {
            let of_row = |y: usize| {
                let lines = Line::of_both(band, y, colors);
                (0..geometry.width).map(|x| difference(lines.map(|line| line.at(x)), spaces, white)).collect()
            };
            band.rows().into_par_iter().map(of_row).collect()
        };
        let frames = sides.iter_mut().filter_map(Side::frame_mut).map(|frame| -> &mut dyn RowSource { frame });
        let mut take_in = |band: &Band| {
            let rows = compared(band);
            rows.iter().for_each(|row| differences.add(row));
            rows
        };
        match map {
            None => fold(frames, geometry.height, |band| {
                take_in(band);
                progress(band.rows().end);
                Ok(())
            }),
            Some(map) => fold_into(frames, geometry.height, map, |band, outlet| {
                let rows = take_in(band);
                let row_samples = MAP_CHANNELS.len() * geometry.width;
                outlet.make(rows.len() * row_samples, |made| {
                    made.chunks_exact_mut(row_samples).zip(&rows).for_each(|(made, row)| draw(row, made));
                })?;
                progress(band.rows().end);
                Ok(())
            }),
        }
    }

    /// What was found so far.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] where no pair of colors is finite.
    pub fn report(&self) -> Result<ComparisonReport> {
        let describe = |i: usize| format!("{}, {}", self.sides[i].name(), self.spaces[i]);
        let (count, not_finite) = (self.differences.count(), self.differences.not_finite());
        let differences = self.differences.report().ok_or_else(|| {
            Error::Data(format!(
                "{}: no pixel can be compared with {}; in every pair a color is NaN or infinite",
                self.sides[0].name(),
                self.sides[1].name()
            ))
        })?;
        Ok(ComparisonReport { differences, count, not_finite, white: self.white, sides: [describe(0), describe(1)] })
    }
}

impl<S: RowSource> Side<S> {
    fn frame(&self) -> Option<&S> {
        match self {
            Self::Frame(frame) => Some(frame),
            Self::Color(_) => None,
        }
    }

    fn frame_mut(&mut self) -> Option<&mut S> {
        match self {
            Self::Frame(frame) => Some(frame),
            Self::Color(_) => None,
        }
    }

    fn color(&self) -> Option<[f64; 3]> {
        match self {
            Self::Frame(_) => None,
            Self::Color(color) => Some(*color),
        }
    }

    fn header(&self) -> Option<&FrameHeader> {
        self.frame().map(S::header)
    }

    fn name(&self) -> String {
        match self {
            Self::Frame(frame) => frame.header().name.clone(),
            Self::Color([a, b, c]) => format!("{a},{b},{c}"),
        }
    }
}

/// A row of a frame, or a color that stands for all its pixels.
#[derive(Clone, Copy)]
enum Line<'a> {
    Planes([&'a [f32]; 3]),
    Color([f64; 3]),
}

impl<'a> Line<'a> {
    /// Row `y` of both sides; `colors` are those that are no frame.
    fn of_both(band: &'a Band, y: usize, colors: [Option<[f64; 3]>; 2]) -> [Self; 2] {
        let mut frames = 0..;
        colors.map(|color| match color {
            Some(color) => Self::Color(color),
            None => {
                let window = band.window::<Any>(frames.next().unwrap_or_default());
                Self::Planes([0, 1, 2].map(|plane| window.row(y.cast_signed(), plane)))
            }
        })
    }

    fn at(self, x: usize) -> [f64; 3] {
        match self {
            Self::Planes(planes) => planes.map(|plane| f64::from(plane[x])),
            Self::Color(color) => color,
        }
    }
}

/// Draws a row of the map, [`MAP_CHANNELS`] one after another.
fn draw(row: &[Difference], made: &mut [f32]) {
    let planes: [fn(&Difference) -> f64; 4] = [|d| d.delta_e_2000, |d| d.delta_e_76, |d| d.delta_e_94, Difference::jnd];
    for (plane, line) in planes.iter().zip(made.chunks_exact_mut(row.len())) {
        line.iter_mut().zip(row).for_each(|(sample, pixel)| *sample = to_sample(plane(pixel)));
    }
}

/// The difference of a pair of colors, the reference first.
fn difference(colors: [[f64; 3]; 2], spaces: [Space; 2], white: Option<[f64; 3]>) -> Difference {
    let lab = |i: usize| match (spaces[i], white) {
        (Space::Xyz, Some(white)) => lab_from_xyz(colors[i], white),
        (Space::Xyy, Some(white)) => {
            let [x, y, luminance] = colors[i];
            lab_from_xyz(xyz_of_chromaticity([x, y], luminance), white)
        }
        _ => colors[i],
    };
    Difference::between(lab(0), lab(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{D65_XY, White};
    use crate::metadata::{ColorRecord, Metadata};
    use crate::stream::MemoryFrame;

    const WHITE: [f64; 3] = [3000.0, 3100.0, 3200.0];

    fn frame(quantity: QuantityKind, white: Option<[f64; 3]>, channels: &[&str]) -> MemoryFrame {
        let mut metadata = Metadata::new(quantity);
        metadata.color = white.map(|white| ColorRecord {
            range_adu: None,
            xyz_from_camera: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            method: None,
            black_adu: 0.0,
            white: Some(white),
            scene_white_xy: None,
            adapted: None,
            matrix_residual: None,
            scene_error: None,
        });
        let header = FrameHeader { name: "frame".into(), geometry: Geometry::new(2, 1, channels), metadata };
        let samples = vec![1.0; header.geometry.row_samples()];
        MemoryFrame::new(header, samples)
    }

    fn xyz(white: Option<[f64; 3]>) -> Side<MemoryFrame> {
        Side::Frame(frame(QuantityKind::Xyz, white, &["R", "G", "B"]))
    }

    fn lab(white: Option<[f64; 3]>) -> Side<MemoryFrame> {
        Side::Frame(frame(QuantityKind::Lab, white, &["L", "a", "b"]))
    }

    const GRAY: Side<MemoryFrame> = Side::Color([20.0, 20.0, 20.0]);

    fn white_of(
        a: Side<MemoryFrame>,
        b: Side<MemoryFrame>,
        space: Option<Space>,
        white: Option<White>,
        white_luminance: Option<f64>,
    ) -> Result<Option<[f64; 3]>> {
        Comparison::new(a, b, &ComparisonSettings { space, white, white_luminance }).map(|made| made.white())
    }

    #[test]
    fn the_white_is_the_one_asked_for_else_recorded_else_d65() {
        let d65 = |luminance| Some(xyz_of_chromaticity(D65_XY, luminance));
        let other = Some([1.0, 2.0, 3.0]);
        let found = |a, b| white_of(a, b, None, None, None).unwrap();
        assert_eq!(found(GRAY, GRAY), d65(100.0));
        assert_eq!(found(xyz(Some(WHITE)), GRAY), Some(WHITE));
        assert_eq!(found(GRAY, xyz(Some(WHITE))), Some(WHITE));
        assert_eq!(found(xyz(Some(WHITE)), xyz(other)), Some(WHITE));
        assert_eq!(found(xyz(None), xyz(other)), other);
        // L*a*b* cannot be seen under another white; XYZ can.
        assert_eq!(found(xyz(other), lab(Some(WHITE))), Some(WHITE));
        assert_eq!(found(lab(Some(WHITE)), lab(None)), None);
        assert_eq!(white_of(GRAY, GRAY, Some(Space::Lab), None, None).unwrap(), None);
        let asked = |white, luminance| white_of(xyz(Some(WHITE)), GRAY, None, white, luminance).unwrap();
        assert_eq!(asked(Some(White::D65), None), d65(3100.0));
        assert_eq!(asked(Some(White::D65), Some(50.0)), d65(50.0));
        assert_eq!(asked(Some(White::Absolute([1.0, 2.0, 3.0])), None), other);
        assert_eq!(asked(None, Some(6200.0)), Some([6000.0, 6200.0, 6400.0]));
        assert_eq!(white_of(xyz(None), GRAY, None, None, Some(80.0)).unwrap(), d65(80.0));
        assert_eq!(white_of(GRAY, GRAY, None, Some(White::EqualEnergy), Some(3.0)).unwrap().unwrap()[1], 3.0);
    }

    #[test]
    fn whites_that_are_unknown_or_disagree_are_errors() {
        let other = Some([1.0, 2.0, 3.0]);
        let absolute = Some(White::Absolute([1.0, 2.0, 3.0]));
        let refused = |a, b, white, luminance| white_of(a, b, None, white, luminance).unwrap_err().bare();
        for white in [None, Some(White::D65)] {
            assert!(matches!(refused(xyz(None), GRAY, white, None), Error::MissingKey { key: "color.white", .. }));
        }
        assert!(matches!(refused(lab(Some(WHITE)), lab(other), None, None), Error::Format { .. }));
        assert!(matches!(refused(lab(Some(WHITE)), xyz(None), absolute, None), Error::Format { .. }));
        assert!(matches!(refused(lab(Some(WHITE)), GRAY, None, Some(1.0)), Error::Format { .. }));
        assert!(matches!(refused(GRAY, GRAY, absolute, Some(1.0)), Error::Usage(_)));
        let impossible = Some(White::Absolute([1.0, 0.0, 1.0]));
        assert!(matches!(refused(GRAY, GRAY, impossible, None), Error::Usage(_)));
    }

    /// xyY and L\*a\*b\* are the same colors as the XYZ that they were made of.
    #[test]
    fn a_color_does_not_differ_from_itself_in_another_space() {
        let color = [700.0, 900.0, 1500.0];
        let xyy = crate::color::xyy_from_xyz(color, D65_XY);
        let lab = lab_from_xyz(color, WHITE);
        for (space, same) in [(Space::Xyy, xyy), (Space::Lab, lab)] {
            let none = difference([color, same], [Space::Xyz, space], Some(WHITE));
            assert!(none.delta_e_76 < 1e-10 && none.delta_e_2000 < 1e-10, "{space} {none:?}");
        }
    }

    /// Every difference by itself beside what comes out of bands, on one thread and on several; with a NaN and a layer.
    #[test]
    fn maps_and_statistics_do_not_depend_on_threads_or_bands() {
        let (width, height) = (700, 300);
        let colors = |seed: usize, channels: &[&str]| {
            let mut made = frame(QuantityKind::Lab, None, channels);
            made.header.geometry = Geometry::new(width, height, channels);
            let count = made.header.geometry.row_samples() * height;
            made.samples = (0..count).map(|i| to_sample(((i * 7919 + seed) % 1009) as f64 / 10.0)).collect();
            made
        };
        let mut reference = colors(3, &["L", "a", "b"]);
        reference.samples[5] = f32::NAN;
        let other = colors(11, &["L", "a", "b", "sigma.L"]);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let sides = [&reference, &other].map(|frame| Side::Frame(frame.clone()));
                let [a, b] = sides;
                let mut comparison = Comparison::new(a, b, &ComparisonSettings::default()).unwrap();
                let mut map = MemoryFrame::new(comparison.map_header().unwrap(), Vec::new());
                let mut rows_done = 0;
                comparison.run(Some(&mut map), &mut |rows| rows_done = rows).unwrap();
                assert_eq!(rows_done, height);
                (comparison.report().unwrap(), map.samples)
            })
        };
        let (report, map) = run(1);
        let (again, same_map) = run(3);
        assert_eq!(report, again);
        let bits = |samples: &[f32]| samples.iter().map(|sample| sample.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&map), bits(&same_map));
        assert_eq!((report.count, report.not_finite), ((width * height - 1) as u64, 1));
        let mut worst: f64 = 0.0;
        for y in 0..height {
            for x in 0..width {
                let at = |frame: &MemoryFrame| {
                    let row = frame.header.geometry.row_samples();
                    [0, 1, 2].map(|plane| f64::from(frame.samples[y * row + plane * width + x]))
                };
                let pair = Difference::between(at(&reference), at(&other));
                let expected = [pair.delta_e_2000, pair.delta_e_76, pair.delta_e_94, pair.jnd()].map(to_sample);
                for (plane, expected) in expected.into_iter().enumerate() {
                    let found = map[(y * 4 + plane) * width + x];
                    assert!(found == expected || (found.is_nan() && (x, y) == (5, 0)), "{x} {y} {plane}");
                }
                worst = worst.max(pair.delta_e_2000);
            }
        }
        assert_eq!(report.differences.delta_e_2000.summary.max, worst);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let compare = |a, b| Comparison::new(a, b, &ComparisonSettings::default());
        let mut wide = frame(QuantityKind::Lab, None, &["L", "a", "b"]);
        wide.header.geometry.width = 9;
        wide.header.name = "wide".into();
        let error = compare(lab(None), Side::Frame(wide)).unwrap_err().to_string();
        assert_eq!(error, "wide: its size is 9x1, but that of frame is 2x1; compare images of one size");
        assert!(matches!(compare(GRAY, GRAY).unwrap().map_header(), Err(Error::Usage(_))));
        let mut lost = frame(QuantityKind::Lab, None, &["L", "a", "b"]);
        lost.samples.fill(f32::NAN);
        let mut comparison = compare(Side::Frame(lost), lab(None)).unwrap();
        comparison.run(None, &mut |_| ()).unwrap();
        assert!(matches!(comparison.report(), Err(Error::Data(_))));
    }
}
