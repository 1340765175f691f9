//! What a camera reads of the patches of a chart: means of the photosites of each class, without demosaicking.

use super::grid::{COLUMNS, Grid, ROWS};
use crate::camera::levels::BlackLevels;
use crate::cfa::{CfaPattern, Places};
use crate::error::Result;
use crate::metadata::FrameHeader;
use crate::stages::saturation::FullLevels;

/// Patches of the chart.
pub const PATCHES: usize = ROWS * COLUMNS;

/// So few photosites of a class make no mean.
const FEWEST_SITES: u64 = 16;

/// A patch is uneven where its photosites scatter by more than so many times what neighbors differ by.
const UNEVEN: f64 = 2.0;

/// So many pairs of neighbors tell that by themselves: the ratio of both variances is 1 within 1/√pairs, and ¼ is 4 of these off. Of fewer
/// two classes tell it.
const ENOUGH_PAIRS: u64 = 30;

/// Scatter beside the noise, as a share of the signal, that light and texture do not make within half a patch: an edge.
const EDGE: f64 = 0.1;

/// Of so few photosites no class of a patch is told to be cut off.
const ENOUGH_TO_CUT: u64 = 30;
/// The least share of photosites at their largest value where samples are cut off; of noise of two codes it is next to none.
const CUT_SHARE: f64 = 0.25;
/// The noise of what is full is less than this share of that of patches which are dimmer: of light brighter ones have more.
const CUT_NOISE: f64 = 0.25;
/// Signals of patches that tell the noise of a brighter one, as shares of its signal.
const DIMMER: std::ops::Range<f64> = 0.3..0.95;

/// What was read of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadPatch {
    /// Means of R, G and B as shares of white level less black level.
    pub signal: [f64; 3],
    /// Variances of these means, from the scatter of the photosites: s²/n of each class.
    pub variance: [f64; 3],
    /// Standard deviations of single photosites, shares of white level less black level.
    pub scatter: [f64; 3],
    /// The same from the differences of neighbors, which what varies slowly does not add to: of those along rows or along columns, which
    /// are less across an edge.
    pub noise: [f64; 3],
    /// Of these the fewer.
    pub pairs: [u64; 3],
    /// The largest sample of each class, ADU, and the next one below it.
    pub largest: [[f32; 2]; 3],
    /// How many are at the largest.
    pub at_largest: [u64; 3],
    /// Photosites of each class.
    pub count: [u64; 3],
    /// Photosites that are saturated.
    pub saturated: u64,
    /// What each place of the 2×2 at the sensor's corner makes of it.
    pub places: Places,
}

impl ReadPatch {
    /// Whether it scatters by far more than its noise: texture, glare, a gradient, an edge.
    pub fn is_uneven(&self) -> bool {
        let scatters = |class: &usize| self.scatter[*class] > UNEVEN * self.noise[*class];
        let classes = (0..3).filter(scatters);
        let weight = |class: usize| if self.pairs[class] < ENOUGH_PAIRS { 1 } else { 2 };
        classes.map(weight).sum::<u8>() >= 2
    }

    /// Whether it scatters as a patch does across which an edge runs.
    pub fn has_edge(&self) -> bool {
        let beside = |class: usize| self.scatter[class].powi(2) - self.noise[class].powi(2);
        self.is_uneven() && (0..3).any(|class| beside(class) > (EDGE * self.signal[class]).powi(2))
    }

    /// The distance of the two largest values of a class, ADU: a code, or a few.
    fn step(&self, class: usize) -> f64 {
        let [largest, next] = self.largest[class];
        f64::from(largest - next)
    }
}

/// The classes of each patch that are cut off, though no sample of it is at the level of saturated ones: many of one value, the largest, or of
/// far less noise than dimmer patches have. `range_adu` is white level less black level. Coarse codes, of less noise than a code, do not
/// tell it.
pub fn cut_off(read: &[ReadPatch], range_adu: f64) -> Vec<(usize, usize)> {
    let is_cut = |patch: &ReadPatch, class: usize| {
        let is_dimmer = |other: &&ReadPatch| {
            DIMMER.contains(&(other.signal[class] / patch.signal[class])) && other.count[class] >= ENOUGH_TO_CUT
        };
        let others: Vec<&ReadPatch> = read.iter().filter(is_dimmer).collect();
        let least = |of: &dyn Fn(&&ReadPatch) -> f64| others.iter().map(of).fold(f64::INFINITY, f64::min);
        let noise = range_adu * least(&|other| other.noise[class]);
        let step = least(&|other| other.step(class));
        if others.len() < 2 || patch.count[class] < ENOUGH_TO_CUT || !(2.0 * step..).contains(&noise) {
            return false;
        }
        let share = patch.at_largest[class] as f64 / patch.count[class] as f64;
        share >= CUT_SHARE || range_adu * patch.noise[class] < CUT_NOISE * noise
    };
    let open = read.iter().enumerate().filter(|(_, patch)| patch.saturated == 0);
    open.flat_map(|(index, patch)| (0..3).filter(move |class| is_cut(patch, *class)).map(move |class| (index, class)))
        .collect()
}

/// What is wrong with the Bayer pattern that a chart was read by, where its greens are red and blue.
pub fn doubt_of_pattern(read: &[ReadPatch], said: CfaPattern) -> Option<String> {
    let open: Vec<Places> = read.iter().filter(|patch| patch.saturated == 0).map(|patch| patch.places).collect();
    Places::doubt_in_colors(&open, said)
}

/// Sums of one class of one patch.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: u64,
    /// Mean and sum of squares about it, updated photosite by photosite.
    mean: f64,
    about_mean: f64,
    /// Pairs of neighbors along rows and along columns, and the squares of what they differ by.
    pairs: [u64; 2],
    of_differences: [f64; 2],
    saturated: u64,
    largest: [f32; 2],
    at_largest: u64,
}

impl Sums {
    fn add(&mut self, value: f64) {
        self.count += 1;
        let from_mean = value - self.mean;
        self.mean += from_mean / self.count as f64;
        self.about_mean += from_mean * (value - self.mean);
    }

    fn add_pair(&mut self, along: usize, difference: f64) {
        self.pairs[along] += 1;
        self.of_differences[along] += difference.powi(2);
    }

    fn note_largest(&mut self, sample: f32) {
        let [largest, next] = self.largest;
        if self.count == 1 || sample > largest {
            let before = if self.count == 1 { f32::NEG_INFINITY } else { largest };
            (self.largest, self.at_largest) = ([sample, before], 1);
        } else if sample == largest {
            self.at_largest += 1;
        } else if sample > next {
            self.largest[1] = sample;
        }
    }

    /// The standard deviation by the differences of neighbors, and how many pairs tell it.
    fn noise(&self) -> (f64, u64) {
        let by = |along: usize| (self.of_differences[along] / (2 * self.pairs[along].max(1)) as f64).sqrt();
        let fewest = self.pairs[0].min(self.pairs[1]);
        let told = [0, 1].into_iter().filter(|along| self.pairs[*along] > 0);
        (told.map(by).fold(f64::INFINITY, f64::min), fewest)
    }
}

/// Reads the patches of a chart from the rows of a frame.
#[derive(Debug)]
pub struct ChartReader {
    grid: Grid,
    pattern: CfaPattern,
    origin: [i32; 2],
    black: BlackLevels,
    full: [f32; 3],
    range: f64,
    width: usize,
    next_row: usize,
    sums: Vec<[Sums; 3]>,
    /// Of each patch the sums and counts at the places of the 2×2 at the sensor's corner.
    at_places: Vec<[(f64, u64); 4]>,
    /// Of the last even and the last odd row the patch and the value at each column.
    above: [Vec<Option<(usize, f64)>>; 2],
}

impl ChartReader {
    /// A reader of the chart in a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Format`](crate::error::Error::Format) unless the frame is a plane of ADU behind a Bayer array with levels;
    /// [`Error::MissingKey`](crate::error::Error::MissingKey) for levels that are not known.
    pub fn new(frame: &FrameHeader, grid: Grid) -> Result<Self> {
        let holds = frame.holds();
        let is_plane = frame.geometry.channels.len() == 1 && frame.metadata.demosaic.is_none();
        let pattern = frame.bayer("read of charts")?.filter(|_| is_plane);
        let Some(pattern) = pattern else {
            if is_plane && frame.metadata.cfa.is_none() {
                return Err(frame.missing("cfa"));
            }
            return Err(frame.refuse(format!(
                "it holds {holds}; a chart is read from the photosites, so that their noise is known: give the CFA plane of ADU"
            )));
        };
        let unknown = |key: &str| frame.refuse(format!("the metadata has no `{key}`")).give(&["levels"]);
        let black = frame.black_levels()?.ok_or_else(|| unknown("black_level_adu"))?;
        let (Some(white), Some(full)) = (frame.metadata.white_level_adu, FullLevels::of(frame)) else {
            return Err(unknown("white_level_adu"));
        };
        let [width, height] = [frame.geometry.width, frame.geometry.height];
        let highest = black.largest([width, height], |_, _| None)[0];
        let range = white.range_above(highest);
        if !(range > 0.0 && range.is_finite()) {
            return Err(frame.refuse("its white level is not above its black level; signals are counted between them"));
        }
        let inside = |[x, y]: [f64; 2]| x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64;
        if let Some([x, y]) = grid.corners().into_iter().find(|corner| !inside(*corner)) {
            return Err(
                frame.refuse(format!("the corner {x},{y} of the chart lies outside its {width}x{height} pixels"))
            );
        }
        let sums = vec![[Sums::default(); 3]; PATCHES];
        let at_places = vec![[(0.0, 0); 4]; PATCHES];
        let origin = frame.geometry.origin;
        let above = std::array::from_fn(|_| vec![None; width]);
        Ok(Self {
            grid,
            pattern,
            origin,
            black,
            full: full.classes(),
            range,
            width,
            next_row: 0,
            sums,
            at_places,
            above,
        })
    }

    /// White level less black level of the frame, ADU, of which signals are shares.
    pub fn range_adu(&self) -> f64 {
        self.range
    }

    /// The Bayer pattern that it is read by.
    pub fn pattern(&self) -> CfaPattern {
        self.pattern
    }

    /// Takes the next rows of the frame.
    pub fn take(&mut self, rows: &[f32]) {
        for row in rows.chunks_exact(self.width) {
            let y = self.next_row;
            self.next_row += 1;
            let classes = self.pattern.row_classes(self.origin, y);
            let black = self.black.row(y);
            // Of even and odd columns the last photosite and its patch.
            let mut last: [Option<(usize, f64)>; 2] = [None; 2];
            for (x, sample) in row.iter().enumerate() {
                let above = &mut self.above[y % 2][x];
                let Some(patch) = self.grid.patch(x as f64, y as f64) else {
                    (last[x % 2], *above) = (None, None);
                    continue;
                };
                let class = classes[x % 2] as usize;
                let value = (f64::from(*sample) - black.at(x)) / self.range;
                let sums = &mut self.sums[patch][class];
                sums.saturated += u64::from(sample.is_nan() || *sample >= self.full[class]);
                sums.add(value);
                sums.note_largest(*sample);
                let (sum, count) = &mut self.at_places[patch][place([x, y], self.origin)];
                (*sum, *count) = (*sum + value, *count + 1);
                for (along, neighbor) in [last[x % 2], *above].into_iter().enumerate() {
                    if let Some((_, before)) = neighbor.filter(|(other, _)| *other == patch) {
                        sums.add_pair(along, value - before);
                    }
                }
                (last[x % 2], *above) = (Some((patch, value)), Some((patch, value)));
            }
        }
    }

    /// What was read of the patches, row by row.
    ///
    /// # Errors
    ///
    /// In words, where the chart is too small in the frame.
    pub fn finish(self) -> std::result::Result<Vec<ReadPatch>, String> {
        let fewest = self.sums.as_flattened().iter().map(|sums| sums.count).min().unwrap_or(0);
        if fewest < FEWEST_SITES {
            return Err(format!(
                "a patch of the chart has {fewest} photosites of a class; the means take {FEWEST_SITES} at least"
            ));
        }
        let read = |(sums, at_places): ([Sums; 3], [(f64, u64); 4])| {
            let variance = |s: Sums| s.about_mean / (s.count - 1) as f64;
            let noise = sums.map(|s| s.noise().0).into_iter().fold(0.0, f64::max);
            ReadPatch {
                places: Places {
                    signal: at_places.map(|(sum, count)| sum / count as f64),
                    variance: at_places.map(|(_, count)| noise * noise / count as f64),
                },
                signal: sums.map(|s| s.mean),
                variance: sums.map(|s| variance(s) / s.count as f64),
                scatter: sums.map(|s| variance(s).sqrt()),
                noise: sums.map(|s| s.noise().0),
                pairs: sums.map(|s| s.noise().1),
                largest: sums.map(|s| s.largest),
                at_largest: sums.map(|s| s.at_largest),
                count: sums.map(|s| s.count),
                saturated: sums.iter().map(|s| s.saturated).sum(),
            }
        };
        Ok(self.sums.into_iter().zip(self.at_places).map(read).collect())
    }
}

/// Which place of the 2×2 at the sensor's corner a photosite has, of a frame whose first is `origin`.
fn place([x, y]: [usize; 2], origin: [i32; 2]) -> usize {
    let odd = |at: usize, first: i32| (at + usize::from(first & 1 != 0)) % 2;
    2 * odd(y, origin[1]) + odd(x, origin[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cfa::FilterArray;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::units::QuantityKind;

    const SIZE: [usize; 2] = [240, 170];

    fn header() -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(FilterArray::from(CfaPattern::Rggb));
        metadata.black_level_adu = Some(100.0.into());
        metadata.white_level_adu = Some(1100.0.into());
        let geometry = Geometry { origin: [3, 1], ..Geometry::new(SIZE[0], SIZE[1], &["Y"]) };
        FrameHeader { name: "chart".into(), geometry, metadata }
    }

    fn grid() -> Grid {
        Grid::new([[20.0, 25.0], [220.0, 25.0], [220.0, 145.0], [20.0, 145.0]]).unwrap()
    }

    /// A chart 40 photosites a patch, whose codes are 100 + 10 (patch + 1) of red, twice that of green, three times of blue, and
    /// what `more` adds.
    fn read(more: impl Fn(usize, usize, usize) -> f32) -> Vec<ReadPatch> {
        let frame = header();
        let mut reader = ChartReader::new(&frame, grid()).unwrap();
        for y in 0..SIZE[1] {
            let classes = CfaPattern::Rggb.row_classes(frame.geometry.origin, y);
            let code = |x: usize| {
                let patch = (x / 40).min(COLUMNS - 1) + COLUMNS * (y.saturating_sub(5) / 40).min(ROWS - 1);
                100.0 + 10.0 * (patch + 1) as f32 * (1 + classes[x % 2] as usize) as f32 + more(patch, x, y)
            };
            let row: Vec<f32> = (0..SIZE[0]).map(code).collect();
            reader.take(&row);
        }
        reader.finish().unwrap()
    }

    /// Means are exact, by class, where nothing scatters; a quarter of the photosites are red, half green. What is saturated is
    /// counted.
    #[test]
    fn means_are_those_of_the_photosites_of_each_class() {
        let patches = read(|patch, x, y| if patch == 7 && x == 60 && y == 65 { 2000.0 } else { 0.0 });
        for (index, patch) in patches.iter().enumerate().filter(|(index, _)| *index != 7) {
            for (class, signal) in patch.signal.into_iter().enumerate() {
                let expected = 0.01 * (index + 1) as f64 * (class + 1) as f64;
                assert!((signal - expected).abs() < 1e-12, "{index} {class}: {signal}");
            }
            assert_eq!((patch.variance, patch.saturated, patch.is_uneven()), ([0.0; 3], 0, false));
            let [red, green, blue] = patch.count;
            // 17 columns and rows within ±0.21 · 40; half of an odd number.
            assert!(red + green + blue == 17 * 17 && (144..=145).contains(&green));
        }
        assert_eq!(patches[7].saturated, 1);
    }

    /// Scatter of a known size: ± 8 in turn by rows of a class has the standard deviation 8; neighbors in a row agree, so that it
    /// counts as uneven, while alternating photosites do not.
    #[test]
    fn scatter_that_neighbors_do_not_share_is_no_unevenness() {
        let patches = read(|_, x, y| if (x / 2 + y / 2) % 2 == 0 { 8.0 } else { -8.0 });
        for patch in &patches {
            for class in 0..3 {
                // Of n codes that are half above: s² = 64 n/(n − 1), but for one row or column too many of 9.
                assert!((patch.scatter[class] / 0.008 - 1.0).abs() < 0.02, "{patch:?}");
                assert!((patch.noise[class] / (0.008 * 2f64.sqrt()) - 1.0).abs() < 1e-9 && !patch.is_uneven());
                let expected = patch.scatter[class].powi(2) / patch.count[class] as f64;
                assert!((patch.variance[class] / expected - 1.0).abs() < 1e-12);
            }
        }
        let stripes = read(|_, _, y| if (y / 2) % 2 == 0 { 8.0 } else { -8.0 });
        assert!(stripes.iter().all(ReadPatch::is_uneven));
    }

    /// Noise of up to 15 codes, the same number of each, as `share` of it.
    fn noise(x: usize, y: usize, share: f32) -> f32 {
        (share * (((x * 7 + y * 13 + x * y) % 31) as f32 - 15.0)).round()
    }

    /// The last patch, the brightest of all, cut off at its mean or far below, and of a tenth of the noise of others.
    #[test]
    fn patches_that_are_cut_off_are_told() {
        let cut = |more: &dyn Fn(usize, usize, usize) -> f32| cut_off(&read(more), 1000.0);
        let last = vec![(23, 0), (23, 1), (23, 2)];
        let capped = |cap: f32| move |patch, x, y| noise(x, y, 1.0).min(if patch == 23 { cap } else { f32::MAX });
        assert_eq!(cut(&capped(f32::MAX)), []);
        assert_eq!(cut(&capped(0.0)), last);
        assert_eq!(cut(&capped(-20.0)), last);
        assert_eq!(cut(&|patch, x, y| noise(x, y, if patch == 23 { 0.1 } else { 1.0 })), last);
        // Half of the noise is that of patches which are as dim as these are.
        assert_eq!(cut(&|patch, x, y| noise(x, y, if patch == 23 { 0.5 } else { 1.0 })), []);
        // Codes coarser than their noise are of one value for the most part everywhere.
        assert_eq!(cut(&|_, x, y| noise(x, y, 0.03)), []);
    }

    /// An edge at a column: neighbors in a row differ across it, those in a column do not.
    #[test]
    fn edges_are_told_whichever_way_they_run() {
        let edges = |is_beyond: &dyn Fn(usize, usize) -> bool| {
            let patches = read(|_, x, y| noise(x, y, 0.2) + if is_beyond(x, y) { 100.0 } else { 0.0 });
            patches.iter().filter(|patch| patch.has_edge()).count()
        };
        assert_eq!(edges(&|_, _| false), 0);
        assert_eq!(edges(&|x, _| x % 40 > 24), PATCHES);
        assert_eq!(edges(&|_, y| (y + 35) % 40 > 24), PATCHES);
    }

    #[test]
    fn what_is_no_chart_is_told() {
        let said = |frame: &FrameHeader, grid| ChartReader::new(frame, grid).unwrap_err().to_string();
        let outside = Grid::new([[20.0, 25.0], [260.0, 25.0], [220.0, 145.0], [20.0, 145.0]]).unwrap();
        assert!(said(&header(), outside).contains("outside its 240x170 pixels"));
        let mut three = header();
        three.geometry = three.geometry.with_channels(&["R", "G", "B"]);
        three.metadata.cfa = None;
        assert!(said(&three, grid()).contains("give the CFA plane"));
        let mut silent = header();
        silent.metadata.white_level_adu = None;
        assert!(said(&silent, grid()).contains("white_level_adu"));
        let small = Grid::new([[20.0, 25.0], [40.0, 25.0], [40.0, 37.0], [20.0, 37.0]]).unwrap();
        let mut reader = ChartReader::new(&header(), small).unwrap();
        reader.take(&vec![100.0; SIZE[0] * SIZE[1]]);
        assert!(reader.finish().unwrap_err().contains("photosites of a class"));
    }
}
