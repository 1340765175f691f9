//! Dark and bias frames that count as one: what they make of it comes off a frame while its rows are read.

use crate::camera::levels::BlackLevels;
use crate::camera::readout::ReadOut;
use crate::camera::readout::dark_current_law;
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::frame::to_sample;
use crate::metadata::{AverageRecord, FrameHeader, MasterKind, MasterNoise, MasterRecord, Metadata};
use crate::numerics::averages::Combine;
use crate::stages::defects::{Survey, add};
use crate::stages::masters::{Averaging, Frames};
use crate::stages::saturation::DEFECTIVE;
use crate::stages::sites::SiteClasses;
use crate::stream::RowSource;
use crate::units::QuantityKind;

/// How dark frames are made fit for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DarkSettings {
    /// How frames of one kind are averaged.
    pub averaging: Averaging,
    /// Whether dark signals are brought to the exposure and the temperature of the frame.
    pub is_scaled: bool,
}

/// What is known of dark frames that fit each other, and how they count.
///
/// D = Σ w Mᵢ + (1 − Σ w) b
///
/// M are averages of frames alike, b the bias. Where dark signals are scaled, weights are such that the dose q = t i(T) of
/// what comes off is that of the frame, with t the exposure and i(T) of \[HP2005, Eq. 6]: the average of that dose alone;
/// else between the nearest two, w linear in the dose; else the nearest, and the bias, on the line through both.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkStack {
    head: FrameHeader,
    frames: u32,
    masters: Vec<Master>,
    /// What counts for the bias where no frames do.
    level: Option<BlackLevels>,
    warnings: Vec<String>,
    remarks: Vec<String>,
    /// Name and scene of the first that was lit.
    lit: Option<(String, String)>,
    /// Names of those whose metadata do not say that they are dark, or what sensor drew their noise.
    silent: Vec<String>,
}

/// An average, and which of the frames it is made of.
#[derive(Debug, Clone, PartialEq)]
struct Master {
    record: MasterRecord,
    members: Vec<usize>,
}

impl Master {
    fn of(kind: MasterKind, heads: &[&FrameHeader], members: Vec<usize>, averaging: Averaging) -> Result<Self> {
        let first = heads[members[0]];
        let metadata = &first.metadata;
        // Where charge has spilled over, what was drawn is not the noise that it tells.
        let has_spilled = |member: &usize| heads[*member].metadata.bloomed_photosites > Some(0);
        let is_told = !members.iter().any(has_spilled);
        let record = MasterRecord {
            kind,
            average: averaging.record_of(members.iter().map(|member| heads[*member]))?,
            weight: 1.0,
            exposure_s: metadata.exposure.map(|exposure| exposure.exposure_s),
            temperature_k: temperature_k(first),
            noise: metadata.noise.as_ref().filter(|_| is_told).map(MasterNoise::of),
            identity: identity(members.iter().map(|member| heads[*member])),
        };
        Ok(Self { record, members })
    }

    fn weighing(mut self, weight: f64) -> Self {
        self.record.weight = weight;
        self
    }
}

/// What tells frames from others, as far as their metadata do: digests of their samples, or seeds and numbers of exposures.
fn identity<'a>(frames: impl Iterator<Item = &'a FrameHeader>) -> Option<String> {
    let mut digest = blake3::Hasher::new();
    for frame in frames {
        let metadata = &frame.metadata;
        let own = match (&metadata.samples, &metadata.noise) {
            (Some(samples), _) => samples.digest.clone(),
            (None, Some(noise)) => format!("{} {} {}", noise.seed, noise.sensor_seed, noise.frame),
            (None, None) => return None,
        };
        digest.update(own.as_bytes());
        digest.update(b"\n");
    }
    Some(format!("blake3:{}", digest.finalize().to_hex()))
}

/// Frames of one kind whose dark signals are alike.
struct Group {
    dose: f64,
    members: Vec<usize>,
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
        let mut master = Master::of(MasterKind::Dark, &[&head], vec![0], Averaging::default())?;
        master.record.average = AverageRecord { frames, combine: Combine::Mean, clip: None };
        let (warnings, remarks) = (Vec::new(), Vec::new());
        Ok(Self { head, frames, masters: vec![master], level: None, warnings, remarks, lit, silent })
    }

    /// Frames with heads of their own, of which the mean counts; none of none.
    ///
    /// # Errors
    ///
    /// As [`Self::alike`], and [`Error::Format`] for a frame that does not show the photosites
    /// of the first.
    pub fn of<'a>(heads: impl IntoIterator<Item = &'a FrameHeader>) -> Result<Option<Self>> {
        let heads: Vec<&FrameHeader> = heads.into_iter().collect();
        Self::averaged(&heads, Averaging::default())
    }

    /// The same averaged in any way.
    fn averaged(heads: &[&FrameHeader], averaging: Averaging) -> Result<Option<Self>> {
        let Some((first, others)) = heads.split_first() else { return Ok(None) };
        let mut stack = Self::alike((*first).clone(), 1)?;
        for head in others {
            check_codes(head)?;
            check_alike(first, head)?;
            stack.warnings.extend(differences(first, head));
            stack.lit = stack.lit.or_else(|| lit(head));
            stack.silent.extend((!says_enough(head)).then(|| head.name.clone()));
            stack.frames += 1;
        }
        let name = averaging.name();
        match stack.frames {
            1 => {}
            2 => stack.head.name = format!("the {name} of {} and 1 other", first.name),
            frames => stack.head.name = format!("the {name} of {} and {} others", first.name, frames - 1),
        }
        stack.masters = vec![Master::of(MasterKind::Dark, heads, (0..heads.len()).collect(), averaging)?];
        Ok(Some(stack))
    }

    /// What comes off `frame`: dark frames as they are, or brought to its exposure and temperature; without them bias frames
    /// alone. None of none.
    ///
    /// # Errors
    ///
    /// Those of [`Self::of`]; [`Error::Usage`] for bias frames beside dark frames that are not scaled; [`Error::MissingKey`]
    /// where what scaling needs is not known: exposures, or the bias.
    pub fn matched(
        frame: &FrameHeader,
        darks: &[&FrameHeader],
        biases: &[&FrameHeader],
        settings: DarkSettings,
    ) -> Result<Option<Self>> {
        let heads: Vec<&FrameHeader> = darks.iter().chain(biases).copied().collect();
        let Some(mut stack) = Self::averaged(&heads, settings.averaging)? else { return Ok(None) };
        let master = |kind, members| Master::of(kind, &heads, members, settings.averaging);
        if darks.is_empty() {
            if settings.is_scaled {
                return Err(Error::Usage("there are no dark frames to scale".into()).give(&["dark"]));
            }
            // Their exposures are short, whatever they are.
            stack.warnings.clear();
            stack.masters = vec![master(MasterKind::Bias, (0..heads.len()).collect())?];
            return Ok(Some(stack));
        }
        if !settings.is_scaled {
            if biases.is_empty() {
                return Ok(Some(stack));
            }
            let problem = "dark frames hold the bias already, which counts apart only where they are scaled";
            return Err(Error::Usage(problem.into()).give(&["scale_dark"]));
        }
        stack.warnings.clear();
        let dose = Dose::of(frame, &heads, &mut stack.warnings);
        let wanted = dose.at(frame)?;
        let mut groups: Vec<Group> = Vec::new();
        for (member, head) in darks.iter().enumerate() {
            let dose = dose.at(head)?;
            match groups.iter_mut().find(|group| is_same(group.dose, dose)) {
                Some(group) => group.members.push(member),
                None => groups.push(Group { dose, members: vec![member] }),
            }
        }
        groups.sort_by(|a, b| a.dose.total_cmp(&b.dose));
        let of_group = |group: &Group| master(MasterKind::Dark, group.members.clone());
        let above = groups.iter().position(|group| group.dose > wanted || is_same(group.dose, wanted));
        let nearest_below = above.unwrap_or(groups.len()).checked_sub(1).map(|index| &groups[index]);
        stack.masters = match (nearest_below, above.map(|index| &groups[index])) {
            (_, Some(same)) if is_same(same.dose, wanted) => vec![of_group(same)?],
            (Some(below), Some(above)) => {
                let share = (wanted - below.dose) / (above.dose - below.dose);
                vec![of_group(below)?.weighing(1.0 - share), of_group(above)?.weighing(share)]
            }
            (Some(nearest), None) | (None, Some(nearest)) => {
                let mut masters = vec![of_group(nearest)?];
                let of_bias = match biases.first() {
                    // One whose exposure is not known counts as one of none.
                    Some(bias) => bias.metadata.exposure.map_or(Ok(0.0), |_| dose.at(bias))?,
                    None => 0.0,
                };
                if nearest.dose <= of_bias {
                    return Err(stack.head.refuse("its exposure is no longer than that of the bias frames"));
                }
                let scale = (wanted - of_bias) / (nearest.dose - of_bias);
                masters[0].record.weight = scale;
                if biases.is_empty() {
                    stack.level = Some(bias_level(frame, &mut stack.warnings)?.map(|level| level * (1.0 - scale)));
                } else {
                    let bias = master(MasterKind::Bias, (darks.len()..heads.len()).collect())?;
                    masters.push(bias.weighing(1.0 - scale));
                }
                masters
            }
            (None, None) => Vec::new(),
        };
        stack.frames = stack.masters.iter().map(|master| master.record.average.frames).sum();
        stack.tell_weights(frame, heads.len());
        Ok(Some(stack))
    }

    /// Says how masters count, and that some frames do not.
    fn tell_weights(&mut self, frame: &FrameHeader, given: usize) {
        let each = |Master { record, .. }: &Master| {
            let kind = if record.kind == MasterKind::Bias { "bias" } else { "dark" };
            let at = record.exposure_s.map_or(String::new(), |exposure_s| format!(" of {exposure_s} s"));
            format!("{:.6} times that of {} {kind} frames{at}", record.weight, record.average.frames)
        };
        let sum: Vec<String> = self.masters.iter().map(each).collect();
        self.remarks.push(format!("{}: what comes off is {}", frame.name, sum.join(" and ")));
        let unused = given - self.masters.iter().map(|master| master.members.len()).sum::<usize>();
        if unused > 0 {
            self.remarks.push(format!("{unused} frames do not count: others are nearer in exposure and temperature"));
        }
    }

    /// The head of what comes off: that of the first frame, but for the name.
    pub fn head(&self) -> &FrameHeader {
        &self.head
    }

    /// How many frames there are.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// The averages and their weights.
    pub fn masters(&self) -> Vec<MasterRecord> {
        self.masters.iter().map(|master| master.record.clone()).collect()
    }

    /// Whether they tell the bias alone.
    pub(super) fn is_bias(&self) -> bool {
        self.masters.iter().all(|master| master.record.kind == MasterKind::Bias)
    }

    /// What counts for the bias, times its weight, where no frames do.
    pub fn level(&self) -> Option<&BlackLevels> {
        self.level.as_ref()
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

    /// What a user should hear of them beside `frame`, from which they come off.
    pub(super) fn warnings_beside(&self, frame: &FrameHeader) -> Vec<String> {
        let is_scaled = !self.remarks.is_empty();
        let mut warnings = if is_scaled || self.is_bias() { Vec::new() } else { differences(frame, &self.head) };
        warnings.extend(self.taken_on_trust(frame));
        warnings.extend_from_slice(&self.warnings);
        warnings
    }

    /// What makes the dark signal of one differ from that of the first.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// How they count, for those who want to know.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}

/// The dose of dark current of frames, in s at some temperature: t i(T).
struct Dose {
    /// Whether all temperatures are known; else they count as the same.
    knows_temperatures: bool,
}

impl Dose {
    fn of(frame: &FrameHeader, heads: &[&FrameHeader], warnings: &mut Vec<String>) -> Self {
        let unknown = std::iter::once(&frame).chain(heads).find(|head| temperature_k(head).is_none());
        if let Some(head) = unknown {
            warnings.push(format!(
                "{}: its temperature is not known; dark signals are scaled by exposure alone",
                head.name
            ));
        }
        Self { knows_temperatures: unknown.is_none() }
    }

    fn at(&self, head: &FrameHeader) -> Result<f64> {
        let law = temperature_k(head).filter(|_| self.knows_temperatures).map_or(1.0, dark_current_law);
        Ok(head.exposure()?.exposure_s * law)
    }
}

/// Equal but for what a text with seven digits may have lost.
fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs()
}

/// What the converter adds; where that is not known, the black level, with a warning.
fn bias_level(frame: &FrameHeader, warnings: &mut Vec<String>) -> Result<BlackLevels> {
    if let Some(adc) = frame.metadata.adc {
        return Ok(BlackLevels::uniform_at(adc.bias_adu));
    }
    let level = frame.black_levels()?.ok_or_else(|| frame.missing("black_level_adu"))?;
    warnings
        .push(format!("{}: its black level is taken for the bias, beside which dark signals are scaled", frame.name));
    Ok(level)
}

/// The temperature of the sensor in K as metadata tell it.
fn temperature_k(frame: &FrameHeader) -> Option<f64> {
    let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
    let of_sensor = readout.map(|readout| readout.temperature_k);
    frame.metadata.noise.as_ref().map(|noise| noise.temperature_k).or(of_sensor)
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
    if let Some((key, unit, its, theirs)) = other_codes(&frame.metadata, &dark.metadata) {
        return differs(key, format!("{theirs} {unit}"), format!("{its} {unit}"));
    }
    let seed = |metadata: &Metadata| metadata.noise.as_ref().map(|noise| noise.sensor_seed);
    match (seed(&frame.metadata), seed(&dark.metadata)) {
        (Some(a), Some(b)) if a != b => differs("sensor seed", b.to_string(), a.to_string()),
        _ => Ok(()),
    }
}

/// What makes the codes of two frames of one sensor mean other charges, as far as both tell: its key and unit, and both numbers.
fn other_codes(a: &Metadata, b: &Metadata) -> Option<(&'static str, &'static str, f64, f64)> {
    let both = |of: fn(&Metadata) -> Option<f64>| of(a).zip(of(b));
    let slopes = both(Metadata::adu_per_e).map(|(a, b)| ("adu_per_e", "ADU per electron", a, b));
    let biases = both(Metadata::bias_adu).map(|(a, b)| ("bias_adu", "ADU", a, b));
    slopes.into_iter().chain(biases).find(|(.., a, b)| !is_same(*a, *b))
}

/// What makes the dark signal of two frames differ.
pub(super) fn differences(frame: &FrameHeader, dark: &FrameHeader) -> Vec<String> {
    let exposure_s = |frame: &FrameHeader| frame.metadata.exposure.map(|exposure| exposure.exposure_s);
    let pairs = [
        ("exposure", "s", exposure_s(dark).zip(exposure_s(frame))),
        ("temperature", "K", temperature_k(dark).zip(temperature_k(frame))),
    ];
    let warn = |(what, unit, pair): (&str, &str, Option<(f64, f64)>)| {
        let (its, theirs) = pair.filter(|(a, b)| !is_same(*a, *b))?;
        Some(format!(
            "{}: its {what} is {its} {unit}, but that of {} is {theirs} {unit}; their dark signals differ",
            dark.name, frame.name
        ))
    };
    let added = |frame: &FrameHeader| frame.readout().map(ReadOut::added_e).ok();
    let other = added(dark).zip(added(frame)).and_then(|(its, theirs)| {
        let mut both = its.into_iter().zip(theirs);
        let ((key, its), (_, theirs)) = both.find(|((_, its), (_, theirs))| its != theirs)?;
        Some(format!(
            "{}: its {key} is {its}, but that of {} is {theirs}, which predictions take for both",
            dark.name, frame.name
        ))
    });
    pairs.into_iter().filter_map(warn).chain(other).collect()
}

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
        Self { stack, masters, rows_made: 0, made: Vec::new(), average: Vec::new(), found: [0; 2] }
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
        while self.rows_made < geometry.height {
            let first = self.rows_made;
            self.next(geometry.cached_rows().min(geometry.height - first))?;
            for (index, line) in self.made.chunks_exact(width).enumerate() {
                let of_row = classes.row(first + index / planes, index % planes);
                for (x, dark) in line.iter().enumerate() {
                    let class = of_row[x % of_row.len()];
                    levels.take(class, *dark);
                    if has_scatter {
                        scatters.take(class, self.masters[0].scatter()[index * width + x].cbrt());
                    }
                }
            }
        }
        // Rounding alone scatters by as much.
        let levels = levels.limits(beyond, 0.25);
        let scatters = has_scatter.then(|| scatters.limits(beyond, 1e-3));
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
    pub(super) fn next(&mut self, rows: usize) -> Result<&[f64]> {
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
    /// `frame` less `darks`, which fit it as [`CorrectFrame::new`](super::correct::CorrectFrame::new) makes sure. What
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
        let darks = self.darks.next(rows)?;
        for (row, darks) in samples[start..].chunks_exact_mut(of_frame).zip(darks.chunks_exact(of_dark)) {
            for (sample, dark) in row.iter_mut().zip(darks) {
                *sample = to_sample(f64::from(*sample) - dark);
            }
        }
        self.mark(self.darks.rows_made - rows, &mut samples[start..]);
        Ok(())
    }
}
