//! Defective photosites: told by a map, found among dark frames and flats, and interpolated within their class.

use crate::error::{Error, Result};
use crate::frame::{Geometry, Rows, Window, to_sample};
use crate::metadata::FrameHeader;
use crate::numerics::normal::{cumulative, density};
use crate::numerics::robust::NORMAL_MEDIAN;
use crate::stages::saturation::{CORRECTED, DEFECTIVE, SATURATED, bits, with_mask};
use crate::stages::sites::SiteClasses;
use crate::stream::{Counts, RowSource, Stage};
use crate::units::Adu;
use std::collections::BTreeSet;

/// Defective photosites that a user knows.
pub enum DefectMap<S> {
    /// A frame of the same size whose samples are not zero there, and how many were not so far.
    Frame(S, usize),
    /// Columns and rows of the frame, in rows, and how many that are listed lie outside it.
    List(BTreeSet<[usize; 2]>, usize),
}

/// A frame whose samples are not zero at more than one photosite in so many is no map of defects.
const MOST_IN: usize = 2;

impl<S: RowSource> DefectMap<S> {
    /// A frame as a map of `frame`.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for one of another size or place.
    pub fn of_frame(map: S, frame: &FrameHeader) -> Result<Self> {
        let (its, theirs) = (&map.header().geometry, &frame.geometry);
        if [its.width, its.height] != [theirs.width, theirs.height] {
            let size = |width, height| format!("{width}x{height}");
            return Err(map.header().refuse(format!(
                "its size is {}, but that of {} is {}",
                size(its.width, its.height),
                frame.name,
                size(theirs.width, theirs.height)
            )));
        }
        Ok(Self::Frame(map, 0))
    }

    /// A list of columns and rows on the sensor, `x,y` in each line, or rows and columns where a heading says so, `row,column`, which may
    /// stand behind `#`; more columns that a heading names do not count, nor what else follows `#`, nor do photosites that a crop leaves out.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] naming the line that is none, and for a heading that does not tell columns from rows.
    pub fn of_list(text: &str, name: &str, frame: &FrameHeader) -> Result<Self> {
        let (mut found, mut outside) = (BTreeSet::new(), BTreeSet::new());
        let (mut may_be_heading, mut is_by_row, mut has_more) = (true, false, false);
        for (number, whole) in text.lines().enumerate() {
            let line = whole.split('#').next().unwrap_or_default().trim();
            if line.is_empty() {
                let comment = whole.trim_start_matches([' ', '\t', '#']);
                // More than two words are prose.
                let is_heading = may_be_heading && words(comment).count() == 2;
                is_by_row = begins_with_row(comment).filter(|_| is_heading).unwrap_or(is_by_row);
                continue;
            }
            if std::mem::take(&mut may_be_heading) && is_heading(line) {
                has_more = words(line).count() > 2;
                is_by_row = begins_with_row(line).ok_or_else(|| {
                    let problem = format!("its heading, `{line}`, does not tell columns from rows");
                    Error::format(
                        name,
                        format!("{problem}; write `column,row` or `row,column`, as the numbers below are"),
                    )
                })?;
                continue;
            }
            let place = || {
                let mut words = words(line);
                let place = [words.next()?.parse::<i64>().ok()?, words.next()?.parse().ok()?];
                // What else a heading names tells no place.
                (has_more || words.next().is_none()).then_some(if is_by_row { [place[1], place[0]] } else { place })
            };
            let [x, y] = place().ok_or_else(|| {
                let number = number + 1;
                Error::format(
                    name,
                    format!("line {number}, `{line}`, is no column and row of a photosite, such as 12,34"),
                )
            })?;
            let of_frame = |at: i64, axis: usize, extent: usize| {
                let at = at - i64::from(frame.geometry.origin[axis]);
                usize::try_from(at).ok().filter(|at| *at < extent)
            };
            // Those of the sensor that a crop leaves out do not count.
            if let Some((x, y)) = of_frame(x, 0, frame.geometry.width).zip(of_frame(y, 1, frame.geometry.height)) {
                found.insert([y, x]);
            } else {
                outside.insert([y, x]);
            }
        }
        Ok(Self::List(found, outside.len()))
    }

    /// A warning of a list, `name`, of which nothing is in `frame`, or not all.
    pub fn doubt(&self, name: &str, frame: &FrameHeader) -> Option<String> {
        let Self::List(found, outside) = self else { return None };
        let Geometry { width, height, origin: [left, top], .. } = frame.geometry;
        let whose = format!("{}, whose {width}x{height} begin at column {left}, row {top} of the sensor", frame.name);
        match (found.len(), outside) {
            (0, _) => Some(format!("{name}: no photosite that it lists is in {whose}")),
            (_, 0) => None,
            (inside, outside) => {
                let all = inside + outside;
                Some(format!(
                    "{name}: it lists {all} photosites, {outside} of them outside {whose}; these do not count"
                ))
            }
        }
    }

    /// A warning of a frame that marked nothing, once all its rows are read.
    pub fn finding(&self) -> Option<String> {
        let Self::Frame(map, 0) = self else { return None };
        Some(format!("{}: it is 0 everywhere, and marks no photosite as defective", map.header().name))
    }

    /// Makes sure, once the last row is read, that a frame is a map.
    fn check_share(&self, rows_read: usize) -> Result<()> {
        let Self::Frame(map, marked) = self else { return Ok(()) };
        let Geometry { width, height, .. } = map.header().geometry;
        if rows_read < height || marked * MOST_IN <= width * height {
            return Ok(());
        }
        Err(map.header().refuse(format!(
            "{marked} of its {} samples are not 0, and would be defective photosites; a map is 0 where photosites are good",
            width * height
        )))
    }

    /// Marks the photosites of the rows from `first` on in the last channel of `samples`.
    pub(super) fn mark(
        &mut self,
        [first, rows, width]: [usize; 3],
        samples: &mut [f32],
        buffer: &mut Vec<f32>,
    ) -> Result<()> {
        let row_samples = samples.len() / rows.max(1);
        match self {
            Self::Frame(map, marked) => {
                let of_map = map.header().geometry.row_samples();
                buffer.clear();
                map.read(rows, buffer)?;
                for (row, map) in samples.chunks_exact_mut(row_samples).zip(buffer.chunks_exact(of_map)) {
                    let marks = &mut row[row_samples - width..];
                    for (mark, _) in marks.iter_mut().zip(&map[..width]).filter(|(_, sample)| **sample != 0.0) {
                        add(mark, DEFECTIVE);
                        *marked += 1;
                    }
                }
            }
            Self::List(list, _) => {
                for [y, x] in list.range([first, 0]..[first + rows, 0]) {
                    add(&mut samples[(y - first + 1) * row_samples - width + x], DEFECTIVE);
                }
            }
        }
        Ok(())
    }
}

/// The words of a line.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split([',', ' ', '\t', ';']).map(|word| word.trim_matches('"')).filter(|word| !word.is_empty())
}

/// Whether a line is words alone, as in `x,y` or `column row`.
fn is_heading(line: &str) -> bool {
    words(line).all(|word| word.chars().all(|c| c.is_alphabetic() || c == '_'))
}

/// Whether the first of all words means rows and the second columns; none where they are not one of each.
fn begins_with_row(line: &str) -> Option<bool> {
    const OF_ROW: [&str; 6] = ["row", "rows", "y", "line", "lines", "y_px"];
    const OF_COLUMN: [&str; 8] = ["column", "columns", "col", "cols", "x", "sample", "samples", "x_px"];
    let is_row = |word: &str| {
        let word = word.to_lowercase();
        OF_ROW.contains(&word.as_str()).then_some(true).or(OF_COLUMN.contains(&word.as_str()).then_some(false))
    };
    let mut meant = words(line).map(is_row);
    let [first, second] = [meant.next()??, meant.next()??];
    (first != second).then_some(first)
}

/// Adds bits to a mark.
pub(super) fn add(mark: &mut f32, more: u32) {
    *mark = (bits(*mark) | more) as f32;
}

/// The rows of a frame whose last channel is the layer of marks, those of a map added.
pub struct Mapped<'a, S> {
    frame: &'a mut dyn RowSource,
    map: &'a mut DefectMap<S>,
    rows_read: usize,
    buffer: Vec<f32>,
}

impl<'a, S: RowSource> Mapped<'a, S> {
    /// The rows of `frame`.
    pub fn new(frame: &'a mut dyn RowSource, map: &'a mut DefectMap<S>) -> Self {
        Self { frame, map, rows_read: 0, buffer: Vec::new() }
    }
}

impl<S: RowSource> RowSource for Mapped<'_, S> {
    fn header(&self) -> &FrameHeader {
        self.frame.header()
    }

    fn natural_rows(&self) -> usize {
        self.frame.natural_rows()
    }

    fn may_wait(&self) -> bool {
        let waits = if let DefectMap::Frame(map, _) = &*self.map { map.may_wait() } else { false };
        waits || self.frame.may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        self.frame.read(rows, samples)?;
        let width = self.frame.header().geometry.width;
        self.map.mark([self.rows_read, rows, width], &mut samples[start..], &mut self.buffer)?;
        self.rows_read += rows;
        self.map.check_share(self.rows_read)
    }
}

/// Standard deviations beyond which one tenth of a sample in so many is expected to lie by chance, on either side.
pub fn beyond_chance(samples: u64) -> f64 {
    let wanted = 0.05 / samples.max(1) as f64;
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if cumulative(-middle) > wanted { low = middle } else { high = middle }
    }
    high
}

/// The share of ordinary samples that lie beyond so many standard deviations, and that of their variance which goes with them.
pub fn lost_beyond(deviations: f64) -> [f64; 2] {
    let share = 2.0 * cumulative(-deviations);
    [share, 2.0 * deviations * density(deviations) / (1.0 - share)]
}

/// The limits of what is ordinary among the samples of each class: median and median deviation of at most 2¹⁷ of them.
#[derive(Debug)]
pub(super) struct Survey {
    classes: Vec<Vec<f32>>,
    every: usize,
    seen: Vec<usize>,
}

impl Survey {
    pub fn new(classes: usize, samples: usize) -> Self {
        const MOST: usize = 1 << 17;
        Self { classes: vec![Vec::new(); classes], every: samples.div_ceil(MOST).max(1), seen: vec![0; classes] }
    }

    pub fn take(&mut self, class: usize, value: f64) {
        if self.seen[class].is_multiple_of(self.every) && value.is_finite() {
            self.classes[class].push(to_sample(value));
        }
        self.seen[class] += 1;
    }

    /// Lower and upper limits of each class, so many standard deviations off; these are at least `least`.
    ///
    /// Of samples that an end cuts off below, such as codes at 0, the upper half tells where they would lie.
    pub fn limits(self, beyond: f64, least: f64) -> Vec<[f64; 2]> {
        let limits = |mut values: Vec<f32>| {
            if values.is_empty() {
                return [f64::NEG_INFINITY, f64::INFINITY];
            }
            values.sort_unstable_by(f32::total_cmp);
            let [center, _] = grouped_quantile(&values, 0.5);
            let mut off: Vec<f32> = values.iter().map(|value| to_sample((f64::from(*value) - center).abs())).collect();
            off.sort_unstable_by(f32::total_cmp);
            let [deviation, step] = grouped_quantile(&off, 0.5);
            // What is rounded may lie half a step farther off.
            let reach = beyond * (deviation / NORMAL_MEDIAN).max(least) + 0.5 * step;
            let high = if is_cut_off(&values) {
                let [[one, _], [two, step]] = [1.0, 2.0].map(|z| grouped_quantile(&values, cumulative(z)));
                let std = (two - one).max(least);
                one - std + beyond * std + 0.5 * step
            } else {
                f64::NEG_INFINITY
            };
            [center - reach, high.max(center + reach)]
        };
        self.classes.into_iter().map(limits).collect()
    }
}

/// Whether so many of sorted samples are the lowest that an end may be what makes them so.
fn is_cut_off(values: &[f32]) -> bool {
    const SHARE: f64 = 0.2;
    let at_end = values.partition_point(|value| *value <= values[0]);
    at_end as f64 > SHARE * values.len() as f64
}

/// A quantile of sorted samples, and the step from it to the next larger one. Equal ones, such as codes, count as spread evenly over
/// half the way to their neighbors on either side.
fn grouped_quantile(values: &[f32], share: f64) -> [f64; 2] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the samples")]
    let place = ((share * values.len() as f64) as usize).min(values.len() - 1);
    let middle = values[place];
    let below = values.partition_point(|value| *value < middle);
    let upto = values.partition_point(|value| *value <= middle);
    let at =
        |index: Option<usize>| index.and_then(|index| values.get(index)).map_or(f64::from(middle), |v| f64::from(*v));
    let [low, center, high] = [at(below.checked_sub(1)), f64::from(middle), at(Some(upto))];
    let [from, to] = [f64::midpoint(low, center), f64::midpoint(center, high)];
    let within = (share * values.len() as f64 - below as f64) / (upto - below) as f64;
    [from + (to - from) * within, high - center]
}

/// Interpolates photosites that are marked as defective from good ones of their class, and marks them as corrected.
///
/// The mean of the nearest pairs on either side, in the row or the column, is exact where the scene is linear. Where there is
/// none, the mean of all good ones within reach counts, each by the inverse square of its distance; where there is none
/// of these the sample stays as it is, marked as defective alone.
#[derive(Debug, Clone)]
pub struct Mend {
    header: FrameHeader,
    classes: SiteClasses,
}

/// Photosites on either side that are looked at.
const REACH: usize = 4;

impl Mend {
    /// Of the frame `corrected`, whose layer of marks is added.
    pub fn new(corrected: &FrameHeader) -> Self {
        let classes = SiteClasses::of(corrected, corrected.geometry.channels.len());
        Self { header: with_mask(corrected.clone()), classes }
    }

    /// What stands for a sample; none where no good one is within reach.
    fn mended(&self, input: &Window<'_, Adu>, [x, y]: [usize; 2], plane: usize) -> Option<f64> {
        let (layer, class) = (input.channels() - 1, self.classes.class(x, y, plane));
        let at = |dx: isize, dy: isize| {
            let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
            let is_inside = x < input.width() && y < input.frame_height();
            let is_alike = is_inside && self.classes.class(x, y, plane) == class;
            let row = y.cast_signed();
            let is_good = is_alike && input.row(row, layer)[x] == 0.0;
            is_good.then(|| f64::from(input.row(row, plane)[x])).filter(|sample| sample.is_finite())
        };
        for step in 1..=REACH.cast_signed() {
            let pairs = [[step, 0], [0, step]].map(|[dx, dy]| at(dx, dy).zip(at(-dx, -dy)).map(|(a, b)| 0.5 * (a + b)));
            match pairs {
                [Some(a), Some(b)] => return Some(0.5 * (a + b)),
                [Some(one), None] | [None, Some(one)] => return Some(one),
                [None, None] => {}
            }
        }
        let reach = REACH.cast_signed();
        let (mut sum, mut weights) = (0.0, 0.0);
        for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
            if let Some(sample) = at(dx, dy) {
                let weight = 1.0 / (dx * dx + dy * dy).max(1) as f64;
                sum += weight * sample;
                weights += weight;
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }
}

impl Stage for Mend {
    type Input = Adu;
    type Output = Adu;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn reach(&self) -> usize {
        REACH
    }

    fn apply(&self, input: Window<'_, Adu>, mut output: Rows<'_, Adu>) -> Counts {
        let mut counts = Counts::default();
        let layer = input.channels() - 1;
        for y in output.range() {
            let row = y.cast_signed();
            let marks = input.row(row, layer);
            let defective: Vec<usize> = (0..marks.len()).filter(|x| bits(marks[*x]) & DEFECTIVE != 0).collect();
            let mut made = vec![true; defective.len()];
            for plane in 0..layer {
                let samples = output.row(y, plane);
                samples.copy_from_slice(input.row(row, plane));
                for (x, made) in defective.iter().zip(&mut made) {
                    match self.mended(&input, [*x, y], plane) {
                        Some(sample) => samples[*x] = to_sample(sample),
                        None => *made = false,
                    }
                }
                counts.not_finite += samples.iter().filter(|sample| !sample.is_finite()).count() as u64;
            }
            let to = output.row(y, layer);
            to.copy_from_slice(marks);
            for (x, _) in defective.iter().zip(&made).filter(|(_, made)| **made) {
                add(&mut to[*x], CORRECTED);
            }
            counts.defective += defective.len() as u64;
            counts.corrected += made.iter().filter(|made| **made).count() as u64;
            counts.saturated_pixels += marks.iter().filter(|mark| bits(**mark) & SATURATED != 0).count() as u64;
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::Metadata;
    use crate::random::gaussian::quantile;
    use crate::stream::MemoryFrame as Plain;
    use crate::units::QuantityKind;

    /// Codes of a normal variable, each of its quantiles once, so that chance plays no part: as many as chance would find lie beyond the
    /// limits, less than one in a frame, whatever the noise is beside a code and wherever its mean lies.
    #[test]
    fn rounding_makes_no_defects() {
        const COUNT: u64 = 30_000;
        for sigma in [0.1, 0.4, 0.57, 0.6, 1.04, 1.77, 2.11, 4.0, 30.0] {
            for mean in [100.0, 100.2, 100.37, 100.5] {
                let code = |i: u64| (mean + sigma * quantile(u64::MAX / COUNT * i + u64::MAX / COUNT / 2)).round();
                let mut survey = Survey::new(1, 30_000);
                (0..COUNT).for_each(|i| survey.take(0, code(i)));
                let [low, high] = survey.limits(beyond_chance(COUNT), 0.25)[0];
                let found = (0..COUNT).filter(|i| !(low..=high).contains(&code(*i))).count();
                assert!(found <= 1, "{sigma} {mean}: {found} beyond {low} {high}");
                // Nor are they so wide that a defect of twice the noise's reach, and two codes, is missed.
                assert!(high - mean < 2.0 * 6.0 * f64::max(sigma, 0.25) + 2.0, "{sigma} {mean}: {high}");
            }
        }
    }

    /// Columns come first, unless a heading says that rows do.
    #[test]
    fn headings_of_lists_count() {
        let geometry = Geometry::new(10, 10, &["Y"]);
        let frame = FrameHeader { name: "f".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
        let found = |text: &str| match DefectMap::<Plain>::of_list(text, "list.txt", &frame) {
            Ok(DefectMap::List(found, 0)) => found.into_iter().map(|[y, x]| format!("{x},{y}")).collect(),
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        };
        for heading in
            ["", "x,y\n", "column,row\n", "# Column, Row\n", "# bad ones\n", "col row\n", "\"sample\";\"line\"\n"]
        {
            assert_eq!(found(&format!("{heading}5,6 # hot\n")), "5,6", "{heading}");
        }
        for heading in [
            "row,column\n",
            "y,x\n",
            "# row column\n",
            "# hot\n# y,x\n",
            "line;sample\n",
            "Row,Col\n",
            "rows\tcolumns\n",
        ] {
            assert_eq!(found(&format!("{heading}6,5\n")), "5,6", "{heading}");
        }
        for heading in ["i,j\n", "x,x\n", "defects\n", "level,row,column\n"] {
            assert!(found(&format!("{heading}6,5\n")).contains("does not tell columns from rows"), "{heading}");
        }
        // More columns count for nothing where the heading names them, and are refused where it does not.
        assert_eq!(found("row,column,kind\n6,5,hot\n"), "5,6");
        assert!(found("6,5,hot\n").contains("line 1, `6,5,hot`, is no column and row"));
        assert_eq!(found("# lines x to y\n5,6\n"), "5,6");
        // Behind a place a comment is none.
        assert_eq!(found("5,6\n# row,column\n"), "5,6");
    }

    /// Most of a class at code 0, where its mean lies below: those above tell how far the others would lie.
    #[test]
    fn samples_that_an_end_cuts_off_make_no_defects() {
        const COUNT: u64 = 30_000;
        for sigma in [0.6, 2.11, 30.0] {
            for below in [0.0, 0.5, 1.0] {
                let normal = |i: u64| quantile(u64::MAX / COUNT * i + u64::MAX / COUNT / 2);
                let code = |i: u64| (sigma * (normal(i) - below)).round().max(0.0);
                let mut survey = Survey::new(1, 30_000);
                (0..COUNT).for_each(|i| survey.take(0, code(i)));
                let [_, high] = survey.limits(beyond_chance(COUNT), 0.25)[0];
                let found = (0..COUNT).filter(|i| code(*i) > high).count();
                assert!(found <= 1 && high < 2.0 * 6.0 * sigma + 2.0, "{sigma} {below}: {found} beyond {high}");
            }
        }
    }
}
