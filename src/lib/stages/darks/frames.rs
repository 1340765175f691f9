//! Dark frames that are read in step with the frame that they come off.

use super::fitness::{Fitness, Misfit};
use super::stack::{DarkSettings, DarkStack, Master};
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::{FrameHeader, MasterKind, MasterRecord};
use crate::numerics::averages::Combine;
use crate::numerics::steps::Steps;
use crate::numerics::vectors::{self, Kernel};
use crate::stages::defects::{Survey, add};
use crate::stages::masters::{Averaging, Frames};
use crate::stages::saturation::DEFECTIVE;
use crate::stages::sites::SiteClasses;
use crate::stream::RowSource;

/// Dark frames read in step; memory is some rows of them, and what comes off.
#[derive(Debug)]
pub struct DarkFrames<S> {
    stack: DarkStack,
    masters: Vec<Frames<S>>,
    rows_made: usize,
    made: Vec<f64>,
    average: Vec<f64>,
    /// Photosites that were found to be off, and unstable, so far.
    found: [u64; 2],
    /// Sums of what they came off so far, and of what came off.
    sums: [f64; 2],
    /// How many samples these are.
    summed: u64,
    fitness: Fitness,
    /// How many masked photosites were left so far, the sum of what is left of them, and of its squares; in how many rows.
    border: [f64; 3],
    border_rows: u64,
}

impl<S: RowSource> DarkFrames<S> {
    /// The mean of all of `frames`; none of none.
    ///
    /// # Errors
    ///
    /// Those of [`DarkStack::of`].
    pub fn of(frames: Vec<S>) -> Result<Option<Self>> {
        let stack = DarkStack::of(frames.iter().map(S::header))?;
        Ok(stack.map(|stack| Self::new(stack, frames)))
    }

    /// What comes off `frame`, of dark and of bias frames; none of none.
    ///
    /// # Errors
    ///
    /// Those of [`DarkStack::matched`].
    pub fn matched(frame: &FrameHeader, darks: Vec<S>, biases: Vec<S>, settings: DarkSettings) -> Result<Option<Self>> {
        let heads = |frames: &[S]| frames.iter().map(|frame| frame.header().clone()).collect::<Vec<_>>();
        let (of_darks, of_biases) = (heads(&darks), heads(&biases));
        let [of_darks, of_biases] = [&of_darks, &of_biases].map(|heads| heads.iter().collect::<Vec<_>>());
        let stack = DarkStack::matched(frame, &of_darks, &of_biases, settings)?;
        Ok(stack.map(|stack| Self::new(stack, darks.into_iter().chain(biases).collect())))
    }

    fn new(stack: DarkStack, frames: Vec<S>) -> Self {
        let mut frames: Vec<Option<S>> = frames.into_iter().map(Some).collect();
        let master = |Master { record, members }: &Master| {
            let of_master = members.iter().filter_map(|member| frames[*member].take()).collect();
            Frames::new(of_master, Averaging::of(&record.average))
        };
        let masters = stack.masters.iter().map(master).collect();
        Self {
            stack,
            masters,
            rows_made: 0,
            made: Vec::new(),
            average: Vec::new(),
            found: [0; 2],
            sums: [0.0; 2],
            summed: 0,
            fitness: Fitness::default(),
            border: [0.0; 3],
            border_rows: 0,
        }
    }

    /// What is known of them.
    pub fn stack(&self) -> &DarkStack {
        &self.stack
    }

    /// Each of those that count.
    pub fn frames(&self) -> impl Iterator<Item = &S> {
        self.masters.iter().flat_map(Frames::frames)
    }

    /// The averages.
    pub fn masters_mut(&mut self) -> &mut [Frames<S>] {
        &mut self.masters
    }

    /// Photosites that were found to be off, and unstable, so far.
    pub fn found(&self) -> [u64; 2] {
        self.found
    }

    fn add_means(&mut self, seen: &TakenOff) {
        for (sum, lanes) in self.sums.iter_mut().zip(&seen.sums) {
            *sum += lanes.iter().sum::<f64>();
        }
        self.summed += seen.counts.iter().sum::<u64>();
    }

    /// The mean of what they came off so far, and of what came off; none of none.
    pub fn means(&self) -> Option<[f64; 2]> {
        (self.summed > 0).then(|| self.sums.map(|sum| sum / self.summed as f64))
    }

    /// The mean of what was read of frames of a kind so far, and the name of the first; none of none.
    pub fn mean_of(&self, kind: MasterKind) -> Option<(&str, f64)> {
        let of_kind = self.masters.iter().zip(&self.stack.masters).filter(|(_, master)| master.record.kind == kind);
        of_kind.filter_map(|(frames, _)| Some((frames.frames().next()?.header().name.as_str(), frames.level()?))).next()
    }

    /// The mean of what came off so far, by those of the frames; none where a level counts with them.
    pub fn mean(&self) -> Option<f64> {
        let sum = || {
            let averages = self.masters.iter().zip(&self.stack.masters);
            averages.map(|(frames, master)| Some(master.record.weight * frames.level()?)).sum()
        };
        self.stack.level.is_none().then(sum).flatten()
    }

    /// A frame that counts as one with others whose mean is another than theirs, its mean, and the median of all.
    pub fn unlike(&self) -> Option<(&str, [f64; 2])> {
        self.masters.iter().find_map(Frames::unlike)
    }

    /// A dark frame that has more samples below zero so far than codes of a camera do, and their share, where what it came off does not lack its
    /// bias too.
    pub fn below_zero(&self) -> Option<(&str, f64)> {
        self.below_zero_beside(&self.fitness, self.fitness.is_fractional)
    }

    /// The same where what it came off looked so, and was no whole numbers where it `is_fractional`, as what a bias was taken off: where it comes
    /// near zero, or is none as the darks are, its bias may be off too.
    pub(in crate::stages) fn below_zero_beside(&self, beside: &Fitness, is_fractional: bool) -> Option<(&str, f64)> {
        /// Noise about zero is within so many times what neighbors differ by.
        const NEAR: f64 = 3.0;
        if beside.comes_near_zero(NEAR) == Some(true) {
            return None;
        }
        self.of_darks().filter(|frames| !(is_fractional && frames.are_fractional())).find_map(Frames::below_zero)
    }

    /// A dark frame most samples of which are exactly zero so far, and their share, where what it came off is far from zero everywhere.
    pub fn at_zero(&self) -> Option<(&str, f64)> {
        self.at_zero_beside(&self.fitness)
    }

    /// The same where what it came off looked so.
    pub(in crate::stages) fn at_zero_beside(&self, beside: &Fitness) -> Option<(&str, f64)> {
        /// Of black 0 light is farther off, in what neighbors differ by, from some 2000 electrons on.
        const FAR: f64 = 40.0;
        if beside.comes_near_zero(FAR) != Some(false) {
            return None;
        }
        self.of_darks().find_map(Frames::at_zero)
    }

    /// The averages, and how each counts.
    pub(super) fn averages(&self) -> impl Iterator<Item = (&Frames<S>, &MasterRecord)> {
        self.masters.iter().zip(self.stack.masters.iter().map(|master| &master.record))
    }

    /// Averages of dark frames.
    fn of_darks(&self) -> impl Iterator<Item = &Frames<S>> {
        let darks = self.masters.iter().zip(&self.stack.masters);
        darks.filter(|(_, master)| master.record.kind == MasterKind::Dark).map(|(frames, _)| frames)
    }

    /// The step that codes of what they came off lie apart by so far; 1 where they are no whole numbers.
    pub fn step_of_frame(&self) -> f64 {
        self.fitness.step_of_frame()
    }

    /// Whether their codes so far lie multiples of a power of two apart.
    pub fn are_multiples_of(&self, scale: u64) -> bool {
        self.fitness.are_darks_multiples_of(scale)
    }

    /// The mean of what is left of masked photosites of the frame so far, and its standard deviation, all of which may be that of whole rows;
    /// none without any.
    pub fn left_at_border(&self) -> Option<[f64; 2]> {
        let [count, sum, squares] = self.border;
        let mean = sum / count;
        let rows = (count > 0.0).then_some(self.border_rows.max(1))?;
        Some([mean, ((squares / count - mean * mean).max(0.0) / rows as f64).sqrt()])
    }

    /// Looks at what is left of row `y` of the first plane of a frame.
    fn look_at_border(&mut self, frame: &FrameHeader, y: usize, row: &[f32]) {
        let [left, top] = frame.geometry.origin.map(i64::from);
        let at = top + y as i64;
        let mut has_any = false;
        for [x0, y0, width, height] in &frame.metadata.masked_areas {
            if !(*y0..y0.saturating_add(*height)).contains(&at) {
                continue;
            }
            let column = |x: i64| usize::try_from(x - left).unwrap_or(0).min(frame.geometry.width);
            for sample in row[column(*x0)..column(x0.saturating_add(*width))].iter().filter(|sample| sample.is_finite())
            {
                let sample = f64::from(*sample);
                self.border = [self.border[0] + 1.0, self.border[1] + sample, self.border[2] + sample * sample];
                has_any = true;
            }
        }
        self.border_rows += u64::from(has_any);
    }

    /// Why they cannot well be dark frames of what they came off so far.
    pub fn misfit(&self) -> Option<Misfit> {
        self.fitness.misfit()
    }

    /// What makes sums of codes of what comes off: the number of frames of a mean, of a median 1, or 2 of an even number; none of several averages, of scaled
    /// and of clipped ones.
    fn factor(&self) -> Option<f64> {
        let [Master { record, .. }] = self.stack.masters.as_slice() else { return None };
        let frames = record.average.frames;
        match record.average.combine {
            _ if record.weight != 1.0 || self.stack.level.is_some() => None,
            _ if frames == 1 => Some(1.0),
            Combine::Mean => Some(frames.into()),
            Combine::Median => Some(if frames.is_multiple_of(2) { 2.0 } else { 1.0 }),
            Combine::Clipped => None,
        }
    }

    /// Samples of theirs that were clipped so far.
    pub fn clipped(&self) -> u64 {
        self.masters.iter().map(Frames::clipped).sum()
    }

    pub(super) fn natural_rows(&self) -> usize {
        self.frames().map(S::natural_rows).fold(1, usize::max)
    }

    pub(super) fn may_wait(&self) -> bool {
        self.frames().any(S::may_wait)
    }

    /// Reads all rows for what is ordinary among what comes off, within so many standard deviations; and among variances
    /// from frame to frame, where there are frames enough of the first average.
    ///
    /// # Errors
    ///
    /// Those of the frames.
    pub fn survey(mut self, beyond: f64) -> Result<DarkLimits> {
        let geometry = self.stack.head.geometry.clone();
        let (width, planes) = (geometry.width, geometry.channels.len());
        let classes = SiteClasses::of(&self.stack.head, planes);
        let survey = || Survey::new(classes.count(), width * geometry.height);
        let [mut levels, mut scatters] = [survey(), survey()];
        let has_scatter = self.keep_scatter();
        let (factor, mut steps) = (self.factor(), Steps::default());
        while self.rows_made < geometry.height {
            let first = self.rows_made;
            self.next(geometry.cached_rows().min(geometry.height - first))?;
            for (index, line) in self.made.chunks_exact(width).enumerate() {
                let of_row = classes.row(first + index / planes, index % planes);
                for (x, dark) in line.iter().enumerate() {
                    let class = of_row[x % of_row.len()];
                    levels.take(class, *dark);
                    if let Some(factor) = factor.filter(|_| !steps.is_one()) {
                        steps.take(std::iter::once(dark * factor));
                    }
                    if has_scatter {
                        scatters.take(class, self.masters[0].scatter()[index * width + x].cbrt());
                    }
                }
            }
        }
        // Rounding alone scatters by as much.
        let levels = levels.limits(beyond, 0.25);
        let count = self.masters.first().map_or(2, |master| master.frames().count().max(2)) as f64;
        let scatters = has_scatter.then(|| {
            let limits = scatters.limits(beyond, 1e-3);
            limits.into_iter().map(|limits| of_variances(limits, beyond, count, steps.least())).collect()
        });
        Ok(DarkLimits { levels, scatters, classes })
    }

    /// Keeps the scatter of the frames of the first average, where they are enough; gives whether they are.
    fn keep_scatter(&mut self) -> bool {
        let is_enough = self.masters.first().is_some_and(|master| master.frames().count() >= ENOUGH_TO_SCATTER);
        if is_enough {
            self.masters[0].keep_scatter();
        }
        is_enough
    }

    /// What comes off the next `rows` rows, `[row][channel][column]`; doubles, as samples would round it.
    pub(in crate::stages) fn next(&mut self, rows: usize) -> Result<&[f64]> {
        let geometry = &self.stack.head.geometry;
        let (row_samples, width) = (geometry.row_samples(), geometry.width);
        self.made.clear();
        self.made.resize(rows * row_samples, 0.0);
        for (master, Master { record, .. }) in self.masters.iter_mut().zip(&self.stack.masters) {
            master.next(rows, &mut self.average)?;
            for (sum, average) in self.made.iter_mut().zip(&self.average) {
                *sum += record.weight * average;
            }
        }
        if let Some(level) = &self.stack.level {
            for (index, line) in self.made.chunks_exact_mut(width).enumerate() {
                let black = level.row(self.rows_made + index / (row_samples / width));
                line.iter_mut().enumerate().for_each(|(x, sum)| *sum += black.at(x));
            }
        }
        self.rows_made += rows;
        Ok(&self.made)
    }
}

/// The limits of cube roots of variances of so many frames of codes, which step so far: no nearer than chance takes those of one law, and
/// higher by what rounding adds to a variance where a mean lies between two codes.
fn of_variances([low, high]: [f64; 2], beyond: f64, count: f64, step: f64) -> [f64; 2] {
    let center = f64::midpoint(low, high);
    // Wilson and Hilferty's standard deviation of the cube root of a variance \[WH1931].
    let by_chance = center * (1.0 + beyond * (2.0 / (9.0 * (count - 1.0))).sqrt());
    let between_codes = 0.25 * step * step * count / (count - 1.0);
    [low, (high.max(by_chance).powi(3) + between_codes).cbrt()]
}

/// Frames from which on their scatter tells unstable photosites.
const ENOUGH_TO_SCATTER: usize = 5;

/// What is ordinary among dark frames, by class.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkLimits {
    levels: Vec<[f64; 2]>,
    /// Of cube roots of variances, which are nearly normal \[WH1931].
    scatters: Option<Vec<[f64; 2]>>,
    classes: SiteClasses,
}

impl DarkLimits {
    /// Whether frames were enough to tell unstable photosites.
    pub fn tell_unstable(&self) -> bool {
        self.scatters.is_some()
    }
}

/// The rows of a frame less what dark frames make, all read in step.
pub struct LessDarks<'a, S> {
    frame: &'a mut dyn RowSource,
    darks: &'a mut DarkFrames<S>,
    limits: Option<&'a DarkLimits>,
}

impl<'a, S: RowSource> LessDarks<'a, S> {
    /// `frame` less `darks`, which fit it as [`CorrectFrame::new`](crate::stages::correct::CorrectFrame::new) makes sure. What
    /// channels it has behind those of the darks stay as they are.
    pub fn new(frame: &'a mut dyn RowSource, darks: &'a mut DarkFrames<S>) -> Self {
        Self { frame, darks, limits: None }
    }

    /// The same; photosites beyond `limits` are marked as defective in the last channel of `frame`, the layer of marks.
    pub fn marking(frame: &'a mut dyn RowSource, darks: &'a mut DarkFrames<S>, limits: &'a DarkLimits) -> Self {
        darks.keep_scatter();
        Self { limits: Some(limits), ..Self::new(frame, darks) }
    }

    /// Marks rows of the frame from `first` on.
    fn mark(&mut self, first: usize, samples: &mut [f32]) {
        let Some(limits) = self.limits else { return };
        let geometry = &self.darks.stack.head.geometry;
        let (width, planes) = (geometry.width, geometry.channels.len());
        let of_frame = self.frame.header().geometry.row_samples();
        let DarkFrames { masters, made, found, .. } = &mut *self.darks;
        let scatter = masters[0].scatter();
        for (index, line) in made.chunks_exact(width).enumerate() {
            let marks = &mut samples[(index / planes + 1) * of_frame - width..][..width];
            let of_row = limits.classes.row(first + index / planes, index % planes);
            for (x, (dark, mark)) in line.iter().zip(marks).enumerate() {
                let class = of_row[x % of_row.len()];
                let [low, high] = limits.levels[class];
                let is_off = !(low..=high).contains(dark);
                let is_unstable = limits.scatters.as_ref().is_some_and(|scatters| {
                    scatter.get(index * width + x).is_some_and(|scatter| scatter.cbrt() > scatters[class][1])
                });
                if is_off || is_unstable {
                    add(mark, DEFECTIVE);
                    found[usize::from(!is_off)] += 1;
                }
            }
        }
    }
}

/// Sums run in so many lanes.
const LANES: usize = 8;

/// Sums over finite samples of what dark frames came off, and of these; and how many there are.
#[derive(Default)]
struct TakenOff {
    sums: [[f64; LANES]; 2],
    counts: [u64; LANES],
}

/// Takes a row of dark frames off a row of samples.
struct TakeOff<'a> {
    row: &'a mut [f32],
    darks: &'a [f64],
    seen: &'a mut TakenOff,
}

impl TakeOff<'_> {
    #[inline(always)]
    fn one(sample: &mut f32, dark: f64, lane: usize, seen: &mut TakenOff) {
        let level = f64::from(*sample);
        let left = level - dark;
        let counts = left.is_finite();
        seen.sums[0][lane] += if counts { level } else { 0.0 };
        seen.sums[1][lane] += if counts { dark } else { 0.0 };
        seen.counts[lane] += u64::from(counts);
        *sample = to_sample(left);
    }
}

impl Kernel for TakeOff<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let length = self.row.len().min(self.darks.len());
        let (row, rest) = self.row[..length].as_chunks_mut::<LANES>();
        let (darks, rest_of_darks) = self.darks[..length].as_chunks::<LANES>();
        let mut seen = std::mem::take(self.seen);
        for (samples, darks) in row.iter_mut().zip(darks) {
            for lane in 0..LANES {
                Self::one(&mut samples[lane], darks[lane], lane, &mut seen);
            }
        }
        for (lane, (sample, dark)) in rest.iter_mut().zip(rest_of_darks).enumerate() {
            Self::one(sample, *dark, lane, &mut seen);
        }
        *self.seen = seen;
    }
}

impl<S: RowSource> RowSource for LessDarks<'_, S> {
    fn header(&self) -> &FrameHeader {
        self.frame.header()
    }

    fn natural_rows(&self) -> usize {
        self.frame.natural_rows().max(self.darks.natural_rows())
    }

    fn may_wait(&self) -> bool {
        self.frame.may_wait() || self.darks.may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        self.frame.read(rows, samples)?;
        let of_frame = self.frame.header().geometry.row_samples();
        let of_dark = self.darks.stack.head.geometry.row_samples();
        let mut seen = TakenOff::default();
        let (factor, first, width) = (self.darks.factor(), self.darks.rows_made, self.frame.header().geometry.width);
        let mut fitness = self.darks.fitness;
        let darks = self.darks.next(rows)?;
        let rows_of_both = samples[start..].chunks_exact_mut(of_frame).zip(darks.chunks_exact(of_dark));
        for (y, (row, darks)) in rows_of_both.enumerate() {
            if Fitness::looks_at(first + y) {
                let planes = row.chunks_exact(width).zip(darks.chunks_exact(width));
                planes.for_each(|(frame, darks)| fitness.take(frame, darks, factor));
            }
            vectors::run(TakeOff { row, darks, seen: &mut seen });
        }
        self.darks.fitness = fitness;
        self.darks.add_means(&seen);
        let head = self.frame.header();
        if !head.metadata.masked_areas.is_empty() {
            for (y, row) in samples[start..].chunks_exact(of_frame).enumerate() {
                self.darks.look_at_border(head, first + y, &row[..width]);
            }
        }
        self.mark(self.darks.rows_made - rows, &mut samples[start..]);
        Ok(())
    }
}
