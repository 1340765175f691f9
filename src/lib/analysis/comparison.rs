//! Comparison of images and colors, pixel by pixel: which white they are seen under, what each pair differs by.

use crate::color::difference::{Difference, DifferenceReport, Differences};
use crate::color::{D65_XY, Space, White, lab_from_xyz, xyz_of_chromaticity};
use crate::error::{Error, Result};
use crate::frame::{Geometry, bare_name, to_sample};
use crate::metadata::FrameHeader;
use crate::stream::{RowSink, RowSource};
use crate::units::QuantityKind;
use rayon::prelude::*;
use serde::Serialize;

/// Luminance of the white of colors that are given as numbers and name none: the 100 of CIE tables, cd m⁻².
pub const NUMBERS_WHITE_LUMINANCE: f64 = 100.0;

/// Channels of a map of differences, in the order in which files have them.
pub const MAP_CHANNELS: [&str; 4] = ["delta_e_2000", "delta_e_76", "delta_e_94", "jnd"];

/// Names of the planes that a frame of colors can lead with; L\*a\*b\* and xyY name themselves.
const PLANES: [([&str; 3], Option<Space>); 4] = [
    (["R", "G", "B"], None),
    (["X", "Y", "Z"], None),
    (["x", "y", "Y"], Some(Space::Xyy)),
    (["L", "a", "b"], Some(Space::Lab)),
];

/// One of the two that are compared.
#[derive(Debug, Clone, PartialEq)]
pub enum Side<S> {
    /// An image.
    Frame(S),
    /// A color, the same against every pixel.
    Color([f64; 3]),
}

/// What a user may set of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ComparisonSettings {
    /// What frames without metadata hold, and colors given as numbers are; XYZ where none is given.
    pub space: Option<Space>,
    /// The white of XYZ and xyY.
    pub white: Option<White>,
    /// Luminance of the white in cd m⁻².
    pub white_luminance: Option<f64>,
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
        self.sides.iter_mut().filter_map(|side| match side {
            Side::Frame(frame) => Some(frame),
            Side::Color(_) => None,
        })
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
    pub fn run(&mut self, mut map: Option<&mut dyn RowSink>, progress: &mut dyn FnMut(usize)) -> Result<()> {
        let Self { sides, spaces, white, geometry, differences } = self;
        let (spaces, white) = (*spaces, *white);
        let Some(geometry) = geometry else {
            if let [Side::Color(reference), Side::Color(color)] = sides {
                differences.add(&[difference([*reference, *color], spaces, white)]);
            }
            return Ok(());
        };
        let natural = sides.iter().filter_map(Side::frame).map(S::natural_rows).fold(1, usize::max);
        let band_rows = geometry.band_rows(geometry.step_rows(natural), 1);
        let mut bands = [Vec::new(), Vec::new()];
        let mut made = Vec::new();
        let mut first = 0;
        while first < geometry.height {
            let rows = band_rows.min(geometry.height - first);
            for (side, band) in sides.iter_mut().zip(&mut bands) {
                if let Side::Frame(frame) = side {
                    band.clear();
                    frame.read(rows, band)?;
                }
            }
            let views = [0, 1].map(|i| View::of(&sides[i], &bands[i]));
            let compared: Vec<Vec<Difference>> = (0..rows)
                .into_par_iter()
                .map(|row| {
                    let at = |x: usize| difference(views.map(|view| view.at(row, x)), spaces, white);
                    (0..geometry.width).map(at).collect()
                })
                .collect();
            made.clear();
            for row in &compared {
                differences.add(row);
                if map.is_some() {
                    let planes: [fn(&Difference) -> f64; 4] =
                        [|d| d.delta_e_2000, |d| d.delta_e_76, |d| d.delta_e_94, Difference::jnd];
                    planes.iter().for_each(|plane| made.extend(row.iter().map(|pixel| to_sample(plane(pixel)))));
                }
            }
            if let Some(map) = &mut map {
                map.write(&made)?;
            }
            first += rows;
            progress(first);
        }
        Ok(())
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

/// A band of a frame, or a color that stands for all its pixels.
#[derive(Clone, Copy)]
enum View<'a> {
    Band { samples: &'a [f32], width: usize, row_samples: usize },
    Color([f64; 3]),
}

impl<'a> View<'a> {
    fn of<S: RowSource>(side: &Side<S>, samples: &'a [f32]) -> Self {
        match side {
            Side::Frame(frame) => {
                let geometry = &frame.header().geometry;
                Self::Band { samples, width: geometry.width, row_samples: geometry.row_samples() }
            }
            Side::Color(color) => Self::Color(*color),
        }
    }

    fn at(self, row: usize, x: usize) -> [f64; 3] {
        match self {
            Self::Band { samples, width, row_samples } => {
                [0, 1, 2].map(|plane| f64::from(samples[row * row_samples + plane * width + x]))
            }
            Self::Color(color) => color,
        }
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

/// The space of a frame's colors: as its metadata say; or as was stated; or as its channels are called; or XYZ.
fn space_of(frame: &FrameHeader, stated: Option<Space>) -> Result<Space> {
    let holds = frame.holds();
    let channels = frame.geometry.channels.iter().map(|name| bare_name(name)).take(3);
    let named = PLANES.iter().find(|(planes, _)| channels.clone().eq(*planes));
    let space = match frame.metadata.quantity {
        QuantityKind::Xyz => Space::Xyz,
        QuantityKind::Xyy => Space::Xyy,
        QuantityKind::Lab => Space::Lab,
        QuantityKind::Unspecified => stated.or(named.and_then(|(_, space)| *space)).unwrap_or(Space::Xyz),
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons | QuantityKind::Adu => {
            return Err(frame.out_of_order(format!("it holds {holds}, not colors"), "to-xyz"));
        }
        QuantityKind::Srgb => {
            return Err(frame.refuse(format!(
                "it holds {holds}, a picture whose colors may be clipped; run `to-xyz --space lab` instead"
            )));
        }
        QuantityKind::SpectralRadiance => {
            return Err(frame.out_of_order(format!("it holds {holds}, not colors"), "render-radiance"));
        }
        QuantityKind::ColorDifference => {
            return Err(frame.refuse(format!("it holds {holds}; give the images that it was made of")));
        }
    };
    match named {
        Some(_) => Ok(space),
        None => Err(frame.refuse(format!("it holds {holds}; a color is three planes, the first three channels"))),
    }
}

/// Whether two whites are equal but for what a text with seven digits may have lost.
fn agree(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs())
}

fn in_words([x, y, z]: [f64; 3]) -> String {
    format!("XYZ {x:.6} {y:.6} {z:.6}")
}

/// The white that XYZ and xyY are seen under; none where both are L\*a\*b\*.
///
/// It is the one asked for, else that of a frame of L\*a\*b\*, else that which the reference or the other records, else D65. Where
/// only its luminance is asked for, it is scaled.
fn white(
    headers: [Option<&FrameHeader>; 2],
    spaces: [Space; 2],
    settings: &ComparisonSettings,
) -> Result<Option<[f64; 3]>> {
    let recorded = [0, 1].map(|i| {
        let header: &FrameHeader = headers[i]?;
        Some((header, header.metadata.color.as_ref()?.white?))
    });
    let is_lab = spaces.map(|space| space == Space::Lab);
    let of_lab = [0, 1].map(|i| recorded[i].filter(|_| is_lab[i]));
    if let [Some((first, a)), Some((second, b))] = of_lab
        && !agree(a, b)
    {
        return Err(second.refuse(format!(
            "its L*a*b* refer to the white {}, those of {} to {}; make both with the same `to-xyz --white`",
            in_words(b),
            first.name,
            in_words(a)
        )));
    }
    if is_lab == [true, true] {
        return Ok(None);
    }
    let of_lab = of_lab[0].or(of_lab[1]);
    let known = of_lab.or(recorded[0]).or(recorded[1]).map(|(_, white)| white);
    let luminance = || {
        let unknown = (0..2).find_map(|i| headers[i].filter(|_| !is_lab[i]));
        match (settings.white_luminance.or(known.map(|white| white[1])), unknown) {
            (Some(luminance), _) => Ok(luminance),
            (None, Some(frame)) => Err(frame.missing("color.white")),
            (None, None) => Ok(NUMBERS_WHITE_LUMINANCE),
        }
    };
    let white = match (settings.white, known) {
        (Some(White::Absolute(_)), _) if settings.white_luminance.is_some() => {
            return Err(
                Error::Usage("a white of X,Y,Z has its luminance already".into()).leave_out(&["white_luminance"])
            );
        }
        (Some(White::Absolute(white)), _) => white,
        (Some(White::EqualEnergy), _) => xyz_of_chromaticity([1.0 / 3.0, 1.0 / 3.0], luminance()?),
        (None, Some(known)) => match settings.white_luminance {
            Some(luminance) => known.map(|value| value * luminance / known[1]),
            None => known,
        },
        (Some(White::D65) | None, _) => xyz_of_chromaticity(D65_XY, luminance()?),
    };
    if !white.iter().all(|&value| value > 0.0 && value.is_finite()) {
        return Err(Error::Usage(format!("a white of {} is impossible; all three must be above 0", in_words(white))));
    }
    match of_lab {
        Some((frame, other)) if !agree(other, white) => {
            let problem = format!("its L*a*b* refer to the white {}, not to {}", in_words(other), in_words(white));
            Err(frame.refuse(problem).leave_out(&["white", "white_luminance"]))
        }
        _ => Ok(Some(white)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::{ColorRecord, Metadata};
    use crate::stream::MemoryFrame;

    const WHITE: [f64; 3] = [3000.0, 3100.0, 3200.0];

    fn frame(quantity: QuantityKind, white: Option<[f64; 3]>, channels: &[&str]) -> MemoryFrame {
        let mut metadata = Metadata::new(quantity);
        metadata.color = white.map(|white| ColorRecord {
            xyz_from_camera: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            method: None,
            black_adu: 0.0,
            white: Some(white),
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

    const GREY: Side<MemoryFrame> = Side::Color([20.0, 20.0, 20.0]);

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
        assert_eq!(found(GREY, GREY), d65(100.0));
        assert_eq!(found(xyz(Some(WHITE)), GREY), Some(WHITE));
        assert_eq!(found(GREY, xyz(Some(WHITE))), Some(WHITE));
        assert_eq!(found(xyz(Some(WHITE)), xyz(other)), Some(WHITE));
        assert_eq!(found(xyz(None), xyz(other)), other);
        // L*a*b* cannot be seen under another white; XYZ can.
        assert_eq!(found(xyz(other), lab(Some(WHITE))), Some(WHITE));
        assert_eq!(found(lab(Some(WHITE)), lab(None)), None);
        assert_eq!(white_of(GREY, GREY, Some(Space::Lab), None, None).unwrap(), None);
        let asked = |white, luminance| white_of(xyz(Some(WHITE)), GREY, None, white, luminance).unwrap();
        assert_eq!(asked(Some(White::D65), None), d65(3100.0));
        assert_eq!(asked(Some(White::D65), Some(50.0)), d65(50.0));
        assert_eq!(asked(Some(White::Absolute([1.0, 2.0, 3.0])), None), other);
        assert_eq!(asked(None, Some(6200.0)), Some([6000.0, 6200.0, 6400.0]));
        assert_eq!(white_of(xyz(None), GREY, None, None, Some(80.0)).unwrap(), d65(80.0));
        assert_eq!(white_of(GREY, GREY, None, Some(White::EqualEnergy), Some(3.0)).unwrap().unwrap()[1], 3.0);
    }

    #[test]
    fn whites_that_are_unknown_or_disagree_are_errors() {
        let other = Some([1.0, 2.0, 3.0]);
        let absolute = Some(White::Absolute([1.0, 2.0, 3.0]));
        let refused = |a, b, white, luminance| white_of(a, b, None, white, luminance).unwrap_err();
        for white in [None, Some(White::D65)] {
            assert!(matches!(refused(xyz(None), GREY, white, None), Error::MissingKey { key: "color.white", .. }));
        }
        assert!(matches!(refused(lab(Some(WHITE)), lab(other), None, None), Error::Format { .. }));
        assert!(matches!(refused(lab(Some(WHITE)), xyz(None), absolute, None), Error::Format { .. }));
        assert!(matches!(refused(lab(Some(WHITE)), GREY, None, Some(1.0)), Error::Format { .. }));
        assert!(matches!(refused(GREY, GREY, absolute, Some(1.0)), Error::Usage(_)));
        let impossible = Some(White::Absolute([1.0, 0.0, 1.0]));
        assert!(matches!(refused(GREY, GREY, impossible, None), Error::Usage(_)));
    }

    #[test]
    fn frames_say_what_they_hold_or_are_refused() {
        let space = |quantity, channels: &[&str], stated| {
            space_of(&frame(quantity, None, channels).header, stated).map_err(|error| error.to_string())
        };
        use QuantityKind::{Adu, ColorDifference, Lab, Srgb, Unspecified, Xyy, Xyz};
        assert_eq!(space(Xyz, &["R", "G", "B", "sigma.R"], Some(Space::Lab)), Ok(Space::Xyz));
        assert_eq!(space(Lab, &["R", "G", "B"], None), Ok(Space::Lab));
        assert_eq!(space(Xyy, &["x", "y", "Y"], None), Ok(Space::Xyy));
        assert_eq!(space(Unspecified, &["left.R", "left.G", "left.B"], None), Ok(Space::Xyz));
        assert_eq!(space(Unspecified, &["R", "G", "B", "A"], Some(Space::Lab)), Ok(Space::Lab));
        assert_eq!(space(Unspecified, &["L", "a", "b"], None), Ok(Space::Lab));
        for (quantity, channels) in [(Unspecified, &["Y"][..]), (Xyz, &["Y"]), (Unspecified, &["C0", "C1", "C2"])] {
            assert!(space(quantity, channels, None).is_err_and(|error| error.contains("three planes")));
        }
        let first = space(Adu, &["R", "G", "B"], None).unwrap_err();
        assert_eq!(first, "frame: it holds three planes of ADU, not colors; run `to-xyz` first");
        assert!(space(Srgb, &["R", "G", "B"], None).is_err_and(|error| error.contains("to-xyz --space lab")));
        assert!(space(ColorDifference, &MAP_CHANNELS, None).is_err());
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
        assert!(matches!(compare(GREY, GREY).unwrap().map_header(), Err(Error::Usage(_))));
        let mut lost = frame(QuantityKind::Lab, None, &["L", "a", "b"]);
        lost.samples.fill(f32::NAN);
        let mut comparison = compare(Side::Frame(lost), lab(None)).unwrap();
        comparison.run(None, &mut |_| ()).unwrap();
        assert!(matches!(comparison.report(), Err(Error::Data(_))));
    }
}
