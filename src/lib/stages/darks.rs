//! Dark frames that count as one: their mean, taken off a frame while its rows are read.

use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::frame::to_sample;
use crate::metadata::{FrameHeader, Metadata};
use crate::stream::RowSource;
use crate::units::QuantityKind;

/// What is known of dark frames that fit each other.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkStack {
    head: FrameHeader,
    frames: u32,
    warnings: Vec<String>,
    /// Name and scene of the first that was lit.
    lit: Option<(String, String)>,
    /// Names of those whose metadata do not say that they are dark, or what sensor drew their noise.
    silent: Vec<String>,
}

impl DarkStack {
    /// So many frames with one head.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] and [`Error::Format`] unless they hold ADU
    /// as the converter gave them.
    pub fn alike(head: FrameHeader, frames: u32) -> Result<Self> {
        check_codes(&head)?;
        let (lit, silent) = (lit(&head), if says_enough(&head) { Vec::new() } else { vec![head.name.clone()] });
        Ok(Self { head, frames, warnings: Vec::new(), lit, silent })
    }

    /// Frames with heads of their own; none of none.
    ///
    /// # Errors
    ///
    /// As [`Self::alike`], and [`Error::Format`] for a frame that does not show the photosites
    /// of the first.
    pub fn of<'a>(heads: impl IntoIterator<Item = &'a FrameHeader>) -> Result<Option<Self>> {
        let mut heads = heads.into_iter();
        let Some(first) = heads.next() else { return Ok(None) };
        let mut stack = Self::alike(first.clone(), 1)?;
        for head in heads {
            check_codes(head)?;
            check_alike(first, head)?;
            stack.warnings.extend(differences(first, head));
            stack.lit = stack.lit.or_else(|| lit(head));
            stack.silent.extend((!says_enough(head)).then(|| head.name.clone()));
            stack.frames += 1;
        }
        match stack.frames {
            1 => {}
            2 => stack.head.name = format!("the mean of {} and 1 other", first.name),
            frames => stack.head.name = format!("the mean of {} and {} others", first.name, frames - 1),
        }
        Ok(Some(stack))
    }

    /// The head of the mean: that of the first frame, but for the name.
    pub fn head(&self) -> &FrameHeader {
        &self.head
    }

    /// How many there are.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Makes sure that no light fell on any of them, as far as their metadata tell.
    pub(super) fn check_dark(&self) -> Result<()> {
        match &self.lit {
            None => Ok(()),
            Some((name, scene)) => Err(Error::format(
                name,
                format!(
                    "its scene, {scene}, was lit; a dark frame is taken without light, as `render-radiance --dark` renders it"
                ),
            )),
        }
    }

    /// A warning where nothing says that they are dark frames of the sensor that took `frame`.
    pub(super) fn taken_on_trust(&self, frame: &FrameHeader) -> Option<String> {
        let named = match self.silent.as_slice() {
            [] if says_enough_of_sensor(frame) => return None,
            [] => self.head.name.clone(),
            [one] => one.clone(),
            [first, others @ ..] => format!("{first} and {} more", others.len()),
        };
        Some(format!(
            "{named}: the metadata do not tell whether it is a dark frame of the sensor that took {}",
            frame.name
        ))
    }

    /// What makes the dark signal of one differ from that of the first.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

/// Makes sure that a frame holds codes of photosites as the converter gave them, or another program's samples.
pub(super) fn check_codes(frame: &FrameHeader) -> Result<()> {
    let (metadata, holds) = (&frame.metadata, frame.holds());
    if metadata.demosaic.is_some() {
        return Err(frame.refuse(format!("it holds {holds}; corrections come before demosaicking")));
    }
    if metadata.correction.is_some() {
        return Err(frame.refuse(format!("it holds {holds} that is corrected already; correction is done once")));
    }
    match metadata.quantity {
        QuantityKind::Adu | QuantityKind::Unspecified => Ok(()),
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons => {
            Err(frame.out_of_order(format!("it holds {holds}, not ADU"), "digitize"))
        }
        _ => Err(frame.refuse(format!("it holds {holds}, not ADU of photosites"))),
    }
}

/// Name and scene of a frame on which light fell, as its metadata tell.
fn lit(frame: &FrameHeader) -> Option<(String, String)> {
    let scene = frame.metadata.scene.as_ref()?;
    (scene.expected_electrons != Some([0.0; 3])).then(|| (frame.name.clone(), scene.source.clone()))
}

/// Whether the metadata of a frame tell its scene and its sensor.
fn says_enough(frame: &FrameHeader) -> bool {
    frame.metadata.scene.is_some() && says_enough_of_sensor(frame)
}

/// Whether the metadata of a frame tell which sensor drew its noise; one without noise has any.
fn says_enough_of_sensor(frame: &FrameHeader) -> bool {
    frame.metadata.noise.is_some() || frame.metadata.scene.is_some() && frame.metadata.sensor.is_some()
}

/// Makes sure that a dark frame shows the photosites of `frame`, of the same sensor as far as metadata tell.
pub(super) fn check_alike(frame: &FrameHeader, dark: &FrameHeader) -> Result<()> {
    let differs = |what: &str, its: String, theirs: String| {
        Err(dark.refuse(format!("its {what} is {its}, but that of {} is {theirs}", frame.name)))
    };
    let (a, b) = (&frame.geometry, &dark.geometry);
    if [a.width, a.height] != [b.width, b.height] {
        return differs("size", format!("{}x{}", b.width, b.height), format!("{}x{}", a.width, a.height));
    }
    if a.origin != b.origin {
        let place = |[column, row]: [i32; 2]| format!("{column},{row}");
        return differs("place on the sensor", place(b.origin), place(a.origin));
    }
    if a.channels.len() != b.channels.len() {
        return differs("number of planes", b.channels.len().to_string(), a.channels.len().to_string());
    }
    let (a, b) = (frame.metadata.cfa, dark.metadata.cfa);
    if a != b {
        let name = |cfa: Option<FilterArray>| cfa.map_or("none".to_owned(), |cfa| cfa.to_string());
        return differs("pattern", name(b), name(a));
    }
    let sensor = |metadata: &Metadata| metadata.sensor.as_ref().map(|sensor| sensor.name.clone());
    if let (Some(a), Some(b)) = (sensor(&frame.metadata), sensor(&dark.metadata))
        && a != b
    {
        return differs("sensor", b, a);
    }
    let seed = |metadata: &Metadata| metadata.noise.as_ref().map(|noise| noise.sensor_seed);
    match (seed(&frame.metadata), seed(&dark.metadata)) {
        (Some(a), Some(b)) if a != b => differs("sensor seed", b.to_string(), a.to_string()),
        _ => Ok(()),
    }
}

/// What makes the dark signal of two frames differ.
pub(super) fn differences(frame: &FrameHeader, dark: &FrameHeader) -> Vec<String> {
    let exposure_s = |frame: &FrameHeader| frame.metadata.exposure.map(|exposure| exposure.exposure_s);
    let temperature_k = |frame: &FrameHeader| {
        let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
        let of_sensor = readout.map(|readout| readout.temperature_k);
        frame.metadata.noise.as_ref().map(|noise| noise.temperature_k).or(of_sensor)
    };
    let pairs = [
        ("exposure", "s", exposure_s(dark).zip(exposure_s(frame))),
        ("temperature", "K", temperature_k(dark).zip(temperature_k(frame))),
    ];
    let warn = |(what, unit, pair): (&str, &str, Option<(f64, f64)>)| {
        // Equal but for what a text with seven digits may have lost.
        let (its, theirs) = pair.filter(|(a, b)| (a - b).abs() > 1e-6 * b.abs())?;
        Some(format!(
            "{}: its {what} is {its} {unit}, but that of {} is {theirs} {unit}; their dark signals differ",
            dark.name, frame.name
        ))
    };
    pairs.into_iter().filter_map(warn).collect()
}

/// Dark frames read in step; memory is some rows of one, and their mean.
#[derive(Debug)]
pub struct DarkFrames<S> {
    frames: Vec<S>,
    stack: DarkStack,
    band: Vec<f32>,
    mean: Vec<f64>,
}

impl<S: RowSource> DarkFrames<S> {
    /// All of `frames`; none of none.
    ///
    /// # Errors
    ///
    /// Those of [`DarkStack::of`].
    pub fn of(frames: Vec<S>) -> Result<Option<Self>> {
        let stack = DarkStack::of(frames.iter().map(S::header))?;
        Ok(stack.map(|stack| Self { frames, stack, band: Vec::new(), mean: Vec::new() }))
    }

    /// What is known of them.
    pub fn stack(&self) -> &DarkStack {
        &self.stack
    }

    /// Each of them.
    pub fn frames(&self) -> &[S] {
        &self.frames
    }

    /// The same, to close them.
    pub fn frames_mut(&mut self) -> &mut [S] {
        &mut self.frames
    }

    /// The mean of the next `rows` rows, `[row][channel][column]`; doubles, as samples would round it.
    fn next_mean(&mut self, rows: usize) -> Result<&[f64]> {
        self.mean.clear();
        self.mean.resize(rows * self.stack.head.geometry.row_samples(), 0.0);
        for frame in &mut self.frames {
            self.band.clear();
            frame.read(rows, &mut self.band)?;
            for (sum, &sample) in self.mean.iter_mut().zip(&self.band) {
                *sum += f64::from(sample);
            }
        }
        let count = self.frames.len() as f64;
        self.mean.iter_mut().for_each(|sum| *sum /= count);
        Ok(&self.mean)
    }
}

/// The rows of a frame less the mean of dark frames, all read in step.
pub struct LessDarks<'a, S> {
    frame: &'a mut dyn RowSource,
    darks: &'a mut DarkFrames<S>,
}

impl<'a, S: RowSource> LessDarks<'a, S> {
    /// `frame` less `darks`, which fit it as [`CorrectFrame::new`](super::correct::CorrectFrame::new) makes sure. What
    /// channels it has behind those of the darks stay as they are.
    pub fn new(frame: &'a mut dyn RowSource, darks: &'a mut DarkFrames<S>) -> Self {
        Self { frame, darks }
    }
}

impl<S: RowSource> RowSource for LessDarks<'_, S> {
    fn header(&self) -> &FrameHeader {
        self.frame.header()
    }

    fn natural_rows(&self) -> usize {
        self.darks.frames.iter().map(S::natural_rows).fold(self.frame.natural_rows(), usize::max)
    }

    fn may_wait(&self) -> bool {
        self.frame.may_wait() || self.darks.frames.iter().any(S::may_wait)
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let start = samples.len();
        self.frame.read(rows, samples)?;
        let of_frame = self.frame.header().geometry.row_samples();
        let of_dark = self.darks.stack.head.geometry.row_samples();
        let means = self.darks.next_mean(rows)?;
        for (row, means) in samples[start..].chunks_exact_mut(of_frame).zip(means.chunks_exact(of_dark)) {
            for (sample, dark) in row.iter_mut().zip(means) {
                *sample = to_sample(f64::from(*sample) - dark);
            }
        }
        Ok(())
    }
}
