//! Flat fields: what each photosite of a class makes of the same light, by which frames are divided.
//!
//! x / g,  g = F / ⟨F⟩,  F = M − D
//!
//! M is an average of frames that were lit evenly, D what no light reads in them, ⟨F⟩ the mean over the photosites of a class, where all
//! classes are whole: of cells of the filter array none of whose photosites is saturated or defective. So the means of all classes are of the
//! same places, and light that falls off towards the corners is the same share of each.

mod blocks;
mod leveling;
mod levels;
mod means;
mod tally;

use crate::camera::levels::BlackLevels;
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::{AverageRecord, FlatRecord, FrameHeader, MasterNoise, Scene};
use crate::stages::darks::{DarkFrames, DarkSettings, Fitness, Misfit, check_alike, check_codes, check_setting};
use crate::stages::defects::{DefectMap, Survey, add};
use crate::stages::masters::Frames;
use crate::stages::saturation::{DEFECTIVE, FullLevels, SATURATED};
use crate::stages::sites::SiteClasses;
use crate::stages::transfer::{Passage, Transfer};
use crate::stream::RowSource;
use blocks::Blocks;
use std::ops::Range;
use tally::Tally;

pub use levels::FlatLevels;
pub use means::FlatMeans;

/// What no light reads in flats.
#[derive(Debug)]
enum Pedestal<S> {
    Frames(Box<DarkFrames<S>>),
    Level(BlackLevels),
}

/// Flats read in step.
#[derive(Debug)]
pub struct FlatFrames<S> {
    frames: Frames<S>,
    head: FrameHeader,
    is_even: bool,
    average: AverageRecord,
    pedestal: Pedestal<S>,
    classes: SiteClasses,
    full: Option<FullLevels>,
    transfer: Option<Transfer>,
    passages: Vec<Passage<Transfer>>,
    rows_made: usize,
    made: Vec<f64>,
    /// What no light reads in the last rows.
    off: Vec<f64>,
    levels: Option<FlatLevels>,
    /// How what comes off goes with the flats.
    fitness: Fitness,
    warnings: Vec<String>,
}

impl<S: RowSource> FlatFrames<S> {
    /// Flats for `frame`; their own dark frames, or bias frames, come off first, or else `black`, or the black level that
    /// their metadata tell. With an efficiency of charge transfer, that is undone. None of none.
    ///
    /// # Errors
    ///
    /// [`Error::Order`](crate::error::Error::Order) and [`Error::Format`](crate::error::Error::Format) for flats that do not fit
    /// the frame, or on which no light fell; [`Error::MissingKey`](crate::error::Error::MissingKey) where nothing tells what no
    /// light reads in them; those of [`DarkFrames::matched`].
    pub fn of(
        frame: &FrameHeader,
        flats: Vec<S>,
        [darks, biases]: [Vec<S>; 2],
        black: Option<BlackLevels>,
        settings: DarkSettings,
        cte: Option<f64>,
    ) -> Result<Option<Self>> {
        let Some(first) = flats.first() else { return Ok(None) };
        let mut warnings = Vec::new();
        for flat in &flats {
            let head = flat.header();
            check_codes(head)?;
            check_alike(frame, head)?;
            let scene = head.metadata.scene.as_ref();
            if scene.is_some_and(Scene::is_dark) {
                return Err(head.refuse("no light fell on it; a flat field is lit evenly"));
            }
        }
        warnings.extend(flats.iter().find_map(|flat| doubt_of_filter(frame, flat.header())));
        let is_even = |flat: &S| flat.header().metadata.scene.as_ref().is_some_and(|scene| scene.uniform);
        let mut head = first.header().clone();
        head.metadata.bloomed_photosites =
            flats.iter().map(|flat| flat.header().metadata.bloomed_photosites).max().flatten();
        let is_even = flats.iter().all(is_even);
        let pedestal = match DarkFrames::matched(&head, darks, biases, settings)? {
            Some(darks) => {
                check_setting(&head, darks.stack().head())?;
                darks.stack().check_dark()?;
                warnings.extend(darks.stack().warnings_beside(&head));
                Pedestal::Frames(Box::new(darks))
            }
            None => {
                let known = black.map_or_else(|| head.black_levels(), |black| Ok(Some(black)))?;
                Pedestal::Level(known.ok_or_else(|| head.missing("black_level_adu"))?)
            }
        };
        let average = settings.averaging.record_of(flats.iter().map(RowSource::header))?;
        let count = flats.len();
        if count > 1 {
            head.name = format!("the {} of {} and {} more", settings.averaging.name(), head.name, count - 1);
        }
        let planes = head.geometry.channels.len();
        let classes = SiteClasses::of(&head, planes);
        let full = FullLevels::of(&of_sensor(&head, frame));
        let mut frames = Frames::new(flats, settings.averaging);
        frames.keep_largest();
        let transfer = cte.map(|cte| Transfer::undoing(cte, &head.geometry)).transpose()?;
        let passages =
            transfer.iter().flat_map(|transfer| (0..planes).map(|_| Passage::of(transfer.clone()))).collect();
        let made = Vec::new();
        Ok(Some(Self {
            frames,
            head,
            is_even,
            average,
            pedestal,
            classes,
            full,
            transfer,
            passages,
            rows_made: 0,
            made,
            off: Vec::new(),
            levels: None,
            fitness: Fitness::default(),
            warnings,
        }))
    }

    /// What a user should hear of them.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Each of the frames: flats, then what comes off them.
    pub fn frames(&self) -> impl Iterator<Item = &S> {
        self.frames.frames().chain(self.darks().into_iter().flat_map(DarkFrames::frames))
    }

    /// What comes off them, where that is frames.
    pub fn darks(&self) -> Option<&DarkFrames<S>> {
        if let Pedestal::Frames(darks) = &self.pedestal { Some(darks.as_ref()) } else { None }
    }

    /// What they are called: the name of the first, or of their average.
    pub fn name(&self) -> &str {
        &self.head.name
    }

    /// The head of the flats, with the sensor of the frame that they are for where theirs names none.
    pub fn head_beside(&self, frame: &FrameHeader) -> FrameHeader {
        of_sensor(&self.head, frame)
    }

    /// In which share of the flats their mean is below that of what came off, so far; none where that is a spot.
    pub fn below_darks(&self) -> Option<f64> {
        match self.fitness.misfit() {
            Some(Misfit::Below(share)) => Some(share),
            _ => None,
        }
    }

    /// A dark frame of theirs that has more samples below zero so far than codes of a camera do, and their share.
    pub fn darks_below_zero(&self) -> Option<(&str, f64)> {
        self.darks()?.below_zero_beside(&self.fitness, self.frames.are_fractional())
    }

    /// A dark frame of theirs most samples of which are exactly zero so far, and their share.
    pub fn darks_at_zero(&self) -> Option<(&str, f64)> {
        self.darks()?.at_zero_beside(&self.fitness)
    }

    /// The mean of what was read of the flats so far, as they are.
    pub fn mean(&self) -> Option<f64> {
        self.frames.level()
    }

    /// Samples of theirs that were clipped so far.
    pub fn clipped(&self) -> u64 {
        self.frames.clipped() + self.darks().map_or(0, DarkFrames::clipped)
    }

    /// Reads all rows for the means of the classes and, for defects beyond so many standard deviations, what is ordinary; photosites of
    /// `map`, and those beyond `limits`, ADU by class, are defective.
    ///
    /// # Errors
    ///
    /// Those of the frames; [`Error::Format`](crate::error::Error::Format) for a class that is not lit, or saturated for the most part,
    /// and where no cell is whole.
    pub fn survey(
        mut self,
        beyond: Option<f64>,
        mut map: Option<DefectMap<S>>,
        limits: Option<&[[f64; 2]]>,
    ) -> Result<FlatMeans> {
        let geometry = self.head.geometry.clone();
        let width = geometry.width;
        let classes = self.classes.count();
        let mut tally = Tally::new(classes, Blocks::of(&geometry, classes));
        let mut survey = beyond.map(|_| Survey::new(classes, width * geometry.height));
        let rows_of_cell = self.cell()[1];
        let step = geometry.cached_rows().next_multiple_of(rows_of_cell);
        let (mut marks, mut buffer) = (Vec::new(), Vec::new());
        while self.rows_made < geometry.height {
            let first = self.rows_made;
            let rows = step.min(geometry.height - first);
            self.next(rows)?;
            marks.clear();
            marks.resize(rows * width, 0.0);
            map.as_mut().map_or(Ok(()), |map| map.mark([first, rows, width], &mut marks, &mut buffer))?;
            for from in (0..rows).step_by(rows_of_cell) {
                self.take_cells(first, from..rows.min(from + rows_of_cell), &marks, limits, &mut tally);
            }
            if let Some(survey) = &mut survey {
                self.take_ordinary(first, survey);
            }
        }
        let limits = survey.zip(beyond).map(|(survey, beyond)| survey.limits(beyond, 1e-6));
        self.judged(&tally, limits)
    }

    /// Columns and rows of a cell of the array, or of the frame where that is smaller.
    fn cell(&self) -> [usize; 2] {
        let ([columns, rows], geometry) = (self.classes.period(), &self.head.geometry);
        [columns.min(geometry.width), rows.min(geometry.height)].map(|side| side.max(1))
    }

    /// Takes in the rows `rows` of a band that begins at row `first`: a row of cells, or what is left of one at the end.
    fn take_cells(
        &self,
        first: usize,
        rows: Range<usize>,
        marks: &[f32],
        limits: Option<&[[f64; 2]]>,
        tally: &mut Tally,
    ) {
        let (width, planes) = (self.head.geometry.width, self.head.geometry.channels.len());
        let [columns, rows_of_cell] = self.cell();
        let cells = if rows.len() == rows_of_cell { width / columns } else { 0 };
        tally.whole.clear();
        tally.whole.resize(cells, true);
        let lines = rows.flat_map(|row| (0..planes).map(move |plane| (row, plane)));
        for (row, plane) in lines.clone() {
            let (from, y) = ((row * planes + plane) * width, first + row);
            let of_row = self.classes.row(y, plane);
            let (flats, largest) = (&self.made[from..][..width], &self.frames.largest()[from..][..width]);
            for (x, (flat, largest)) in flats.iter().zip(largest).enumerate() {
                let class = of_row[x % of_row.len()];
                let is_full = is_full(self.full, x, y, plane, *largest);
                let is_ordinary = limits.is_none_or(|limits| (limits[class][0]..=limits[class][1]).contains(flat));
                let is_good = flat.is_finite() && !is_full && is_ordinary && marks[row * width + x] == 0.0;
                tally.finite[class] += u64::from(flat.is_finite());
                tally.full[class] += u64::from(flat.is_finite() && is_full);
                tally.good[class] += u64::from(is_good);
                if let Some(whole) = tally.whole.get_mut(x / columns) {
                    *whole &= is_good;
                }
            }
        }
        tally.take_line();
        let readout = self.head.readout().ok().filter(|readout| readout.taps.is_some());
        for (row, plane) in lines {
            let of_row = self.classes.row(first + row, plane);
            tally.last.fill(None);
            let [x0, y0] = self.head.geometry.origin.map(|origin| usize::from(origin & 1 != 0));
            let of_rows = (first + row + y0) % 2 * 2;
            let line = &self.made[(row * planes + plane) * width..][..width];
            tally.blocks.take_row(first + row, columns, line, &tally.whole, &of_row);
            for (cell, flats) in line.chunks_exact(columns).enumerate() {
                if tally.whole.get(cell) != Some(&true) {
                    continue;
                }
                for (x, flat) in (cell * columns..).zip(flats) {
                    let class = of_row[x % of_row.len()];
                    tally.take(class, of_rows + (x + x0) % 2, *flat);
                    if let Some(readout) = readout {
                        let [first_x, first_y] = self.head.geometry.origin.map(i64::from);
                        tally.take_tap(readout.tap([first_x + x as i64, first_y + (first + row) as i64]), class);
                    }
                }
            }
        }
    }

    /// Takes in all rows of a band that begins at row `first` for what is ordinary.
    fn take_ordinary(&self, first: usize, survey: &mut Survey) {
        let (width, planes) = (self.head.geometry.width, self.head.geometry.channels.len());
        for (index, line) in self.made.chunks_exact(width).enumerate() {
            let of_row = self.classes.row(first + index / planes, index % planes);
            line.iter().enumerate().for_each(|(x, flat)| survey.take(of_row[x % of_row.len()], *flat));
        }
    }

    /// The means of what was taken in.
    fn judged(&self, tally: &Tally, limits: Option<Vec<[f64; 2]>>) -> Result<FlatMeans> {
        let Tally { sums, counts, good, full, finite, .. } = tally;
        let classes = 0..self.classes.count();
        if classes.clone().any(|class| 2 * full[class] > finite[class]) {
            return Err(self
                .head
                .refuse("most samples of a class are saturated; expose flat fields to half of full well"));
        }
        // A class that a crop has no photosite of has no cell either.
        if classes.clone().any(|class| finite[class] > 0 && counts[class] == 0)
            || counts.iter().all(|count| *count == 0)
        {
            return Err(self.head.refuse(
                "nowhere are the photosites of all classes side by side neither saturated nor defective; expose flat fields to half of \
                 full well",
            ));
        }
        let means: Vec<f64> = sums.iter().zip(counts).map(|(sum, count)| sum / (*count).max(1) as f64).collect();
        for class in classes.filter(|class| counts[*class] > 0) {
            let mean = means[class];
            let scattering = match tally.scatter(class) {
                _ if mean.is_nan() || mean <= 0.0 => String::new(),
                Some(scatter) if scatter > mean => format!(", and scatters by {scatter:.1} ADU"),
                _ => continue,
            };
            return Err(self.head.refuse(format!(
                "its mean is {mean:.1} ADU above what no light reads{scattering}; a flat field is lit"
            )));
        }
        let left_out = good.iter().zip(counts).map(|(good, count)| good - count).collect();
        let doubt = self.doubt_of_array(tally);
        let illumination = tally.blocks.illumination(&means);
        let (cell_lines, tap_photosites) = (tally.cell_lines(), tally.taps.clone());
        let full = full.iter().sum();
        let share = |class: usize| Some(tally.scatter(class)? / means[class]).filter(|_| counts[class] > 0);
        let scatter = (0..self.classes.count()).filter_map(share).fold(0.0, f64::max);
        Ok(FlatMeans {
            means,
            photosites: counts.clone(),
            left_out,
            cell_lines,
            tap_photosites,
            full,
            scatter,
            limits,
            illumination,
            doubt,
        })
    }

    /// What is wrong with the array that they are said to be behind, Bayer or none, or that nothing tells, where what photosites scatter by
    /// is known.
    fn doubt_of_array(&self, tally: &Tally) -> Option<String> {
        if self.head.geometry.channels.len() > 1 {
            return None;
        }
        let (name, doubt) = (&self.head.name, tally.places()?.doubt(self.head.metadata.cfa)?);
        // Behind filters that count as none all classes have one mean.
        let is_one = self.classes.count() == 1;
        let lost =
            if is_one { " Divided as photosites of one class, frames lose the colors of their light" } else { "" };
        Some(format!("{name}: {doubt}{lost}"))
    }

    /// What metadata keep of them.
    pub fn record(&self, means: &FlatMeans) -> FlatRecord {
        let (masters, black_adu) = match &self.pedestal {
            Pedestal::Frames(darks) => (darks.stack().masters(), None),
            Pedestal::Level(level) => (Vec::new(), level.uniform()),
        };
        let metadata = &self.head.metadata;
        let levels = self.levels.as_ref();
        let unlike = levels.and_then(|levels| levels.unlike).map_or(0.0, |unlike| unlike.spread);
        // Frames may be medians themselves.
        let of_average = |flat: &S| flat.header().metadata.average.map_or(0.0, |average| average.unlike_levels);
        let before = self.frames.frames().map(of_average).fold(0.0, f64::max);
        FlatRecord {
            average: self.average,
            levels: levels.and_then(FlatLevels::shares).map_or_else(Vec::new, <[f64]>::to_vec),
            unlike_levels: unlike.max(before),
            means_adu: means.means.clone(),
            photosites: means.photosites.clone(),
            left_out: means.left_out.clone(),
            cell_lines: means.cell_lines,
            area: Some(self.head.geometry.on_sensor()),
            tap_photosites: means.tap_photosites.clone(),
            converters: Vec::new(),
            even: self.is_even,
            illumination: (!self.is_even).then(|| means.illumination.clone()),
            exposure_s: metadata.time_s(),
            temperature_k: metadata.temperature_k(),
            // Where charge has spilled over, what was drawn is not the noise that it tells.
            noise: metadata.noise.as_ref().filter(|_| metadata.bloomed_photosites <= Some(0)).map(MasterNoise::of),
            black_adu,
            masters,
            shares_masters: false,
        }
    }
}

/// A warning of a flat through another filter than `frame`, as far as both tell it.
fn doubt_of_filter(frame: &FrameHeader, flat: &FrameHeader) -> Option<String> {
    let settings = flat.metadata.camera_settings.as_ref().zip(frame.metadata.camera_settings.as_ref());
    let [its, theirs] = settings.and_then(|(flat, frame)| flat.other_filter(frame))?;
    Some(format!(
        "{}: it was taken through the filter `{its}`, and {} through `{theirs}`: dust and the responses of photosites to its light are others; \
         give flats through the same filter",
        flat.name, frame.name
    ))
}

/// The head of flats whose metadata name no sensor with that of the frame that they are for, where both were taken with the same settings:
/// what a user names counts for both.
fn of_sensor(flats: &FrameHeader, frame: &FrameHeader) -> FrameHeader {
    let mut head = flats.clone();
    if head.metadata.sensor.is_none() && check_setting(frame, flats).is_ok() {
        head.metadata.sensor.clone_from(&frame.metadata.sensor);
    }
    head
}

fn is_full(full: Option<FullLevels>, x: usize, y: usize, plane: usize, sample: f32) -> bool {
    full.is_some_and(|full| sample >= full.of_row(y, plane)[x % 2])
}

/// The rows of a frame, whose last channel is the layer of marks, divided by a flat field.
///
/// A photosite whose flat field is not above zero is marked as defective and not divided; one whose flats are saturated is marked
/// as saturated.
pub struct Flattened<'a, S> {
    frame: &'a mut dyn RowSource,
    flats: &'a mut FlatFrames<S>,
    means: &'a FlatMeans,
    /// Photosites that were found defective.
    pub found: u64,
}

impl<'a, S: RowSource> Flattened<'a, S> {
    /// `frame` divided by `flats`.
    pub fn new(frame: &'a mut dyn RowSource, flats: &'a mut FlatFrames<S>, means: &'a FlatMeans) -> Self {
        Self { frame, flats, means, found: 0 }
    }
}

impl<S: RowSource> RowSource for Flattened<'_, S> {
    fn header(&self) -> &FrameHeader {
        self.frame.header()
    }

    fn natural_rows(&self) -> usize {
        self.flats.frames().map(S::natural_rows).fold(self.frame.natural_rows(), usize::max)
    }

    fn may_wait(&self) -> bool {
        self.frame.may_wait() || self.flats.frames().any(S::may_wait)
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let (start, first) = (samples.len(), self.flats.rows_made);
        self.frame.read(rows, samples)?;
        self.flats.next(rows)?;
        let geometry = &self.flats.head.geometry;
        let (width, planes) = (geometry.width, geometry.channels.len());
        let of_frame = self.frame.header().geometry.row_samples();
        for (index, row) in samples[start..].chunks_exact_mut(of_frame).enumerate() {
            let y = first + index;
            let (row, marks) = row.split_at_mut(of_frame - width);
            for (plane, line) in row.chunks_exact_mut(width).take(planes).enumerate() {
                let from = (index * planes + plane) * width;
                let of_row = self.flats.classes.row(y, plane);
                let (flats, largest) = (&self.flats.made[from..], &self.flats.frames.largest()[from..]);
                for (x, (sample, mark)) in line.iter_mut().zip(marks.iter_mut()).enumerate() {
                    let class = of_row[x % of_row.len()];
                    let flat = flats[x];
                    let gain = flat / self.means.means[class];
                    if is_full(self.flats.full, x, y, plane, largest[x]) {
                        add(mark, SATURATED);
                    }
                    let is_lit = gain > 0.0 && gain.is_finite();
                    let limits = self.means.limits.as_ref().map(|limits| limits[class]);
                    if !is_lit || limits.is_some_and(|[low, high]| !(low..=high).contains(&flat)) {
                        add(mark, DEFECTIVE);
                        self.found += 1;
                    }
                    if is_lit {
                        *sample = to_sample(f64::from(*sample) / gain);
                    }
                }
            }
        }
        Ok(())
    }
}
