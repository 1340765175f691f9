//! The pixels of a picture: samples as they are, or means of squares of them.

use super::planes::Choice;
use crate::analysis::statistics::{MarkedRows, Region};
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::numerics::moments::Moments;
use crate::plot::ScaleBar;
use crate::stages::saturation::{FullLevels, bits, samples_tell};
use crate::stream::{RowSource, fold};
use crate::units::Any;
use rayon::prelude::*;

/// Which samples make a pixel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reduction {
    region: Region,
    /// Columns and rows of samples that make one pixel.
    step: [usize; 2],
    /// Whether squares that the region's edge cuts are left out: some may lack the class that is shown.
    is_whole: bool,
    /// The samples of each square that are shown: all, or those of a class.
    shown: usize,
}

/// The pixels of a picture.
#[derive(Debug, Clone)]
pub(super) struct Reduced {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Planes: one, or three.
    pub planes: usize,
    /// `[row][plane][column]`.
    pub samples: Vec<f32>,
}

impl Reduction {
    /// The smallest squares by which the picture of a region fits `most` pixels; behind a filter array, whole periods of it where
    /// there are any means.
    pub fn new(frame: &FrameHeader, region: Region, most: Option<usize>, choice: &Choice) -> Self {
        let least = most.map_or(1, |most| region.width.max(region.height).div_ceil(most.max(1)));
        let period = match frame.metadata.cfa {
            Some(array) if frame.geometry.channels.len() == 1 && (least > 1 || choice.filter.is_some()) => {
                array.period()
            }
            _ => [1, 1],
        };
        // Pixels stay square.
        let side = (least..).find(|side| period.iter().all(|period| side.is_multiple_of(*period))).unwrap_or(least);
        let of_period = |columns: usize, rows: usize| {
            let seen = Seen::of(frame, region, choice);
            seen.sites.iter().flatten().filter(|is_seen| **is_seen).count() * (side / columns) * (side / rows)
        };
        let shown = if choice.filter.is_some() { of_period(period[0], period[1]) } else { side * side };
        Self { region, step: [side; 2], is_whole: choice.filter.is_some(), shown }
    }

    /// Columns and rows of the picture.
    pub fn size(&self) -> [usize; 2] {
        let count =
            |length: usize, step: usize| if self.is_whole { (length / step).max(1) } else { length.div_ceil(step) };
        [count(self.region.width, self.step[0]), count(self.region.height, self.step[1])]
    }
}

impl Reduction {
    /// What makes a pixel, in words; none where that is a sample. `filter` is the class that is shown alone.
    pub fn in_words(&self, filter: Option<char>) -> Option<String> {
        let [columns, rows] = self.step;
        match (filter, self.shown) {
            (_, 1) if self.step == [1, 1] => None,
            (None, _) => {
                let [columns, rows] = [columns.min(self.region.width), rows.min(self.region.height)];
                Some(format!("each pixel the mean of {columns} × {rows} samples"))
            }
            (Some(filter), 1) => Some(format!("each pixel the {filter} of {columns} × {rows} photosites")),
            (Some(filter), shown) => {
                Some(format!("each pixel the mean of the {shown} {filter} of {columns} × {rows} photosites"))
            }
        }
    }
}

impl Reduced {
    /// Reads the rows of a region, and counts what they hold where a tally is wanted.
    ///
    /// # Errors
    ///
    /// Those of the source.
    pub fn read(
        source: &mut dyn RowSource,
        reduction: &Reduction,
        choice: &Choice,
        mut tally: Option<&mut Tally>,
    ) -> Result<Self> {
        let frame = source.header().clone();
        let Reduction { region, step, .. } = *reduction;
        let [columns, rows] = reduction.size();
        let planes = choice.channels.len();
        let mut samples = vec![f32::NAN; columns * rows * planes];
        let mut sums = Sums::new(columns * planes);
        let is_seen = Seen::of(&frame, region, choice);
        fold([source], region.y + region.height, |band| {
            let window = band.window::<Any>(0);
            for y in band.rows().filter(|y| *y >= region.y) {
                if let Some(tally) = &mut tally {
                    let line = |channel: usize| &window.row(y.cast_signed(), channel)[region.x..][..region.width];
                    let planes: Vec<&[f32]> = choice.channels.iter().map(|channel| line(*channel)).collect();
                    tally.add_row(y, &planes, tally.layer.map(line));
                }
                let row = (y - region.y) / step[1];
                if row >= rows {
                    continue;
                }
                let made = &mut samples[row * columns * planes..][..columns * planes];
                for ((plane, channel), made) in choice.channels.iter().enumerate().zip(made.chunks_exact_mut(columns)) {
                    let line = &window.row(y.cast_signed(), *channel)[region.x..][..region.width];
                    if step == [1, 1] {
                        made.copy_from_slice(line);
                    } else {
                        sums.add(plane * columns..(plane + 1) * columns, line, step[0], &is_seen, y);
                    }
                }
                let is_last = (y + 1 - region.y).is_multiple_of(step[1]) || y + 1 == region.y + region.height;
                if step != [1, 1] && is_last {
                    sums.finish(made);
                }
            }
            Ok(())
        })?;
        Ok(Self { size: [columns, rows], planes, samples })
    }

    /// The samples of a plane, row by row.
    pub fn plane(&self, plane: usize) -> impl Iterator<Item = &[f32]> {
        self.samples.chunks_exact(self.size[0]).skip(plane).step_by(self.planes)
    }

    /// Whether any pixel has a number.
    pub fn has_numbers(&self) -> bool {
        self.samples.iter().any(|sample| sample.is_finite())
    }

    /// What is said of a plane.
    pub fn moments(&self, plane: usize) -> Moments {
        let mut moments = Moments::new(1);
        self.plane(plane).for_each(|line| moments.add(&[line]));
        moments
    }

    /// The same of the inverses of what is above 0, which color temperatures are seen by.
    pub fn inverse_moments(&self, plane: usize) -> Moments {
        let mut moments = Moments::new(1);
        for line in self.plane(plane) {
            let inverses: Vec<f32> =
                line.iter().map(|sample| if *sample > 0.0 { sample.recip() } else { f32::NAN }).collect();
            moments.add(&[&inverses]);
        }
        moments
    }

    /// The values that have these shares of the finite pixels of a plane below them, linear between neighbors: type 7 of
    /// \[Hyndman1996]. None where no pixel is finite.
    pub fn quantiles<const N: usize>(&self, plane: usize, shares: [f64; N]) -> Option<[f64; N]> {
        quantiles(self.plane(plane).flatten().copied(), shares)
    }

    /// The same of the pixels of all planes together.
    pub fn quantiles_of_all<const N: usize>(&self, shares: [f64; N]) -> Option<[f64; N]> {
        quantiles(self.samples.iter().copied(), shares)
    }

    /// The bytes of the first plane, its numbers along the colors of a bar.
    pub fn in_false_color(&self, bar: &ScaleBar, missing: [u8; 3]) -> Vec<u8> {
        let color = bar.colors_of(missing);
        self.samples.par_iter().map(|sample| color(*sample)).collect::<Vec<_>>().into_flattened()
    }
}

fn quantiles<const N: usize>(samples: impl Iterator<Item = f32>, shares: [f64; N]) -> Option<[f64; N]> {
    let mut finite: Vec<f32> = samples.filter(|sample| sample.is_finite()).collect();
    finite.par_sort_unstable_by(f32::total_cmp);
    let last = finite.len().checked_sub(1)?;
    Some(shares.map(|share| {
        let rank = share * last as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to the last")]
        let below = (rank.floor() as usize).min(last);
        let [low, high] = [finite[below], finite[(below + 1).min(last)]].map(f64::from);
        low + (rank - below as f64) * (high - low)
    }))
}

/// Moments of the samples of each plane, or of each class of a CFA plane.
pub(super) struct Tally {
    /// What each is called, and what was seen of it.
    pub groups: Vec<(String, Moments)>,
    /// Pixels that marks leave out, and of the others those of which a sample is not finite.
    pub left_out: [u64; 2],
    /// Samples among those counted that are at full well or the white level, where the samples tell it.
    pub full: u64,
    /// The level of each group from which they are.
    levels: Vec<Option<f32>>,
    /// Place of the layer of marks among the channels.
    layer: Option<usize>,
    /// The marks that leave a pixel out.
    marks: u32,
    is_out: Vec<bool>,
    /// Photosites of each class; empty of other frames.
    classes: Vec<Seen>,
    line: Vec<f32>,
}

impl Tally {
    /// Nothing seen yet of what is shown.
    pub fn new(frame: &FrameHeader, rows: &MarkedRows, region: Region, choice: &Choice) -> Self {
        let filters = choice.filters(frame);
        let of_class = |filter: &char| Choice { channels: vec![0], filter: Some(*filter), called: None };
        let classes = filters.iter().map(|filter| Seen::of(frame, region, &of_class(filter))).collect();
        let full = FullLevels::of(frame).filter(|_| samples_tell(frame)).map(|levels| levels.classes());
        let level = |place: Option<usize>| full.and_then(|levels| levels.get(place?).copied());
        let levels = match filters.as_slice() {
            [] => choice.channels.iter().map(|channel| level(Some(*channel))).collect(),
            filters => filters.iter().map(|filter| level("RGB".find(*filter))).collect(),
        };
        let names = match filters.as_slice() {
            [] => choice.names(frame),
            filters => filters.iter().map(char::to_string).collect(),
        };
        Self {
            groups: names.into_iter().map(|name| (name, Moments::new(1))).collect(),
            left_out: [0; 2],
            full: 0,
            levels,
            // The layer itself is shown with all that it says.
            layer: rows.layer.filter(|layer| !choice.channels.contains(layer)),
            marks: rows.left_out,
            is_out: Vec::new(),
            classes,
            line: Vec::new(),
        }
    }

    /// Takes in a row of all planes. A pixel counts as `measure` counts it: without marks that leave it out, and with finite
    /// samples in all planes.
    fn add_row(&mut self, y: usize, planes: &[&[f32]], marks: Option<&[f32]>) {
        let width = planes.first().map_or(0, |line| line.len());
        let is_marked = |x: usize| marks.is_some_and(|marks| bits(marks[x]) & self.marks != 0);
        let is_finite = |x: usize| planes.iter().all(|line| line[x].is_finite());
        self.is_out.clear();
        for x in 0..width {
            let reasons = [is_marked(x), !is_finite(x)];
            let reason = reasons.iter().position(|is_so| *is_so);
            reason.iter().for_each(|reason| self.left_out[*reason] += 1);
            self.is_out.push(reason.is_some());
        }
        if self.classes.is_empty() {
            for (((_, moments), line), level) in self.groups.iter_mut().zip(planes).zip(&self.levels) {
                self.line.clear();
                self.line
                    .extend(line.iter().zip(&self.is_out).filter(|(_, is_out)| !**is_out).map(|(sample, _)| *sample));
                self.full += full(&self.line, *level);
                moments.add(&[&self.line]);
            }
            return;
        }
        for (((_, moments), seen), level) in self.groups.iter_mut().zip(&self.classes).zip(&self.levels) {
            let Some(sites) = seen.row(y) else { continue };
            self.line.clear();
            let counted = planes[0].iter().zip(&self.is_out).zip(sites.iter().cycle());
            let counted = counted.filter(|((_, is_out), is_seen)| **is_seen && !**is_out);
            self.line.extend(counted.map(|((sample, _), _)| *sample));
            self.full += full(&self.line, *level);
            moments.add(&[&self.line]);
        }
    }
}

/// How many samples are at a level or above, where one is known.
fn full(samples: &[f32], level: Option<f32>) -> u64 {
    level.map_or(0, |level| samples.iter().filter(|sample| **sample >= level).count() as u64)
}

/// Which photosites of a row are of the class that is shown.
struct Seen {
    /// For each row and column of the period, counted from the region's corner; empty where all are.
    sites: Vec<Vec<bool>>,
    first_row: usize,
}

impl Seen {
    fn of(frame: &FrameHeader, region: Region, choice: &Choice) -> Self {
        let first_row = region.y;
        let (Some(filter), Some(array)) = (choice.filter, frame.metadata.cfa) else {
            return Self { sites: Vec::new(), first_row };
        };
        let [x0, y0] = frame.geometry.origin.map(i64::from);
        let [columns, rows] = array.period();
        let site =
            |x: usize, y: usize| array.filter(x0 + (region.x + x) as i64, y0 + (region.y + y) as i64) == Some(filter);
        let sites = (0..rows).map(|y| (0..columns).map(|x| site(x, y)).collect()).collect();
        Self { sites, first_row }
    }

    fn row(&self, y: usize) -> Option<&[bool]> {
        (!self.sites.is_empty()).then(|| &self.sites[(y - self.first_row) % self.sites.len()][..])
    }
}

/// Sums over squares of finite samples.
struct Sums {
    sums: Vec<f64>,
    counts: Vec<u32>,
}

impl Sums {
    fn new(length: usize) -> Self {
        Self { sums: vec![0.0; length], counts: vec![0; length] }
    }

    /// Takes in a line, `step` samples for each of the sums in `places`.
    fn add(&mut self, places: std::ops::Range<usize>, line: &[f32], step: usize, seen: &Seen, y: usize) {
        let seen = seen.row(y);
        let sums = self.sums[places.clone()].iter_mut().zip(&mut self.counts[places]);
        for ((sum, count), (place, samples)) in sums.zip(line.chunks(step).enumerate()) {
            for (x, sample) in samples.iter().enumerate() {
                let is_seen = seen.is_none_or(|sites| sites[(place * step + x) % sites.len()]);
                if is_seen && sample.is_finite() {
                    *sum += f64::from(*sample);
                    *count += 1;
                }
            }
        }
    }

    /// Gives the means, NaN where nothing was seen, and begins anew.
    fn finish(&mut self, means: &mut [f32]) {
        for ((sum, count), mean) in self.sums.iter_mut().zip(&mut self.counts).zip(means) {
            *mean = to_sample(*sum / f64::from(*count));
            (*sum, *count) = (0.0, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;

    fn reduced(
        channels: &[&str],
        size: [usize; 2],
        fit: Option<usize>,
        class: Option<&str>,
        f: impl Fn(usize, usize, usize) -> f32,
    ) -> Reduced {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        if channels.len() == 1 {
            metadata.cfa = Some("grbg".parse().unwrap());
        }
        let geometry = Geometry { origin: [3, 1], ..Geometry::new(size[0], size[1], channels) };
        let mut samples = Vec::new();
        for y in 0..size[1] {
            for channel in 0..channels.len() {
                samples.extend((0..size[0]).map(|x| f(x, y, channel)));
            }
        }
        let mut frame = MemoryFrame::new(FrameHeader { name: "f".into(), geometry, metadata }, samples);
        let choice = Choice::of(&frame.header, class, false).unwrap();
        let reduction = Reduction::new(&frame.header, Region::whole(&frame.header), fit, &choice);
        Reduced::read(&mut frame, &reduction, &choice, None).unwrap()
    }

    #[test]
    fn pixels_are_means_of_squares_also_of_cut_ones_without_what_is_not_finite() {
        // Rows of 5 and 7 columns by squares of 3: the last have 1 column, 2 rows.
        let value = |x: usize, y: usize, channel: usize| {
            if (x, y) == (0, 0) { f32::NAN } else { (x * x + 10 * y + 100 * channel) as f32 }
        };
        let made = reduced(&["R", "G", "B"], [7, 5], Some(3), None, value);
        assert_eq!((made.size, made.planes), ([3, 2], 3));
        for (place, sample) in made.samples.iter().enumerate() {
            let (row, plane, column) = (place / 9, place / 3 % 3, place % 3);
            let square: Vec<f32> = (3 * row..(3 * row + 3).min(5))
                .flat_map(|y| (3 * column..(3 * column + 3).min(7)).map(move |x| value(x, y, plane)))
                .filter(|sample| sample.is_finite())
                .collect();
            let mean = square.iter().sum::<f32>() / square.len() as f32;
            assert!((sample - mean).abs() < 1e-4, "{place}: {sample}, not {mean}");
        }
    }

    #[test]
    fn a_class_is_shown_by_its_own_photosites_alone() {
        // The corner is column 3, row 1 of the sensor, GRBG: G B / R G would stand at the even ones, here G B... by the pattern.
        let pattern: crate::cfa::CfaPattern = "grbg".parse().unwrap();
        let value = |x: usize, y: usize, _| {
            1000.0 * f32::from(pattern.class(3 + x as i64, 1 + y as i64) as u8) + (x / 2) as f32
        };
        for (class, level) in [("R", 0.0), ("G", 1000.0), ("B", 2000.0)] {
            let made = reduced(&["Y"], [9, 6], None, Some(class), value);
            assert_eq!(made.size, [4, 3]);
            assert_eq!(made.samples[..4], [level, level + 1.0, level + 2.0, level + 3.0], "{class}");
        }
        let words = |fit: Option<usize>, class: Option<&str>| {
            let mut metadata = Metadata::new(QuantityKind::Adu);
            metadata.cfa = Some("grbg".parse().unwrap());
            let geometry = Geometry { origin: [3, 1], ..Geometry::new(12, 12, &["Y"]) };
            let frame = FrameHeader { name: "f".into(), geometry, metadata };
            let choice = Choice::of(&frame, class, false).unwrap();
            Reduction::new(&frame, Region::whole(&frame), fit, &choice).in_words(choice.filter)
        };
        for (fit, class, wanted) in [
            (None, None, None),
            (Some(3), None, Some("each pixel the mean of 4 × 4 samples")),
            (None, Some("R"), Some("each pixel the R of 2 × 2 photosites")),
            (None, Some("G"), Some("each pixel the mean of the 2 G of 2 × 2 photosites")),
            (Some(3), Some("B"), Some("each pixel the mean of the 4 B of 4 × 4 photosites")),
        ] {
            assert_eq!(words(fit, class).as_deref(), wanted);
        }
        let geometry = Geometry::new(20, 3, &["Y"]);
        let narrow = FrameHeader { name: "f".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
        let choice = Choice::of(&narrow, None, false).unwrap();
        let words = Reduction::new(&narrow, Region::whole(&narrow), Some(4), &choice).in_words(None);
        assert_eq!(words.as_deref(), Some("each pixel the mean of 5 × 3 samples"));
        // Squares are whole periods: no class counts more in one than in another.
        let made = reduced(&["Y"], [12, 12], Some(4), None, |x, y, _| {
            1000.0 * f32::from(pattern.class(3 + x as i64, 1 + y as i64) as u8)
        });
        assert_eq!((made.size, made.samples[0]), ([3, 3], 1000.0));
        assert!(made.samples.iter().all(|sample| *sample == 1000.0));
    }

    #[test]
    fn quantiles_are_those_of_the_finite_pixels() {
        let made = reduced(&["R", "G", "B"], [10, 11], None, None, |x, y, channel| match (x, y) {
            (0..=8, 0) => f32::INFINITY,
            _ => ((y * 10 + x) * 37 % 110 + 1000 * channel) as f32,
        });
        let sorted = {
            let mut all: Vec<f64> = made.plane(1).flatten().filter(|s| s.is_finite()).map(|s| f64::from(*s)).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        assert_eq!(sorted.len(), 101);
        assert_eq!(
            made.quantiles(1, [0.0, 0.25, 0.995, 1.0]).unwrap(),
            [sorted[0], sorted[25], 0.5 * (sorted[99] + sorted[100]), sorted[100]]
        );
        assert_eq!(reduced(&["R", "G", "B"], [1, 1], None, None, |_, _, _| f32::NAN).quantiles(0, [0.5]), None);
    }
}
