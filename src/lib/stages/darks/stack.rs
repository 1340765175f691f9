//! How dark and bias frames count as one.

use super::alike::{check_codes, check_setting, differences, is_same, lit, says_enough, says_enough_of_sensor};
use crate::camera::levels::BlackLevels;
use crate::camera::readout::dark_current_law;
use crate::error::{Error, Result};
use crate::metadata::{AverageRecord, FrameHeader, MasterKind, MasterNoise, MasterRecord};
use crate::numerics::averages::Combine;
use crate::stages::masters::Averaging;

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
    pub(super) head: FrameHeader,
    frames: u32,
    pub(super) masters: Vec<Master>,
    /// What counts for the bias where no frames do.
    pub(super) level: Option<BlackLevels>,
    warnings: Vec<String>,
    remarks: Vec<String>,
    /// Name and scene of the first that was lit.
    lit: Option<(String, String)>,
    /// Names of those whose metadata do not say that they are dark, or what sensor drew their noise.
    silent: Vec<String>,
}

/// An average, and which of the frames it is made of.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Master {
    pub record: MasterRecord,
    pub members: Vec<usize>,
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
            exposure_s: metadata.time_s(),
            temperature_k: first.metadata.temperature_k(),
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

impl Group {
    /// Frames by their doses, rising.
    fn of(darks: &[&FrameHeader], dose: &Dose) -> Result<Vec<Self>> {
        let mut groups: Vec<Self> = Vec::new();
        for (member, head) in darks.iter().enumerate() {
            let dose = dose.at(head)?;
            match groups.iter_mut().find(|group| is_same(group.dose, dose)) {
                Some(group) => group.members.push(member),
                None => groups.push(Self { dose, members: vec![member] }),
            }
        }
        groups.sort_by(|a, b| a.dose.total_cmp(&b.dose));
        Ok(groups)
    }
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
            check_setting(first, head)?;
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
        let groups = Group::of(darks, &dose)?;
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
                    Some(bias) => bias.metadata.time_s().map_or(Ok(0.0), |_| dose.at(bias))?,
                    None => 0.0,
                };
                if nearest.dose <= of_bias {
                    let dark = darks[nearest.members[0]];
                    return Err(dark.refuse("its exposure is no longer than that of the bias frames"));
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
    pub fn is_bias(&self) -> bool {
        self.masters.iter().all(|master| master.record.kind == MasterKind::Bias)
    }

    /// What counts for the bias, times its weight, where no frames do.
    pub fn level(&self) -> Option<&BlackLevels> {
        self.level.as_ref()
    }

    /// Makes sure that no light fell on any of them, as far as their metadata tell.
    pub(in crate::stages) fn check_dark(&self) -> Result<()> {
        match &self.lit {
            None => Ok(()),
            Some((name, scene)) => Err(Error::format(
                name,
                format!(
                    "its scene, `{scene}`, was lit; a dark frame is taken without light, as `render-radiance --dark` renders it"
                ),
            )),
        }
    }

    /// What is said where nothing says that they are dark frames of the sensor that took `frame`.
    pub fn taken_on_trust(&self, frame: &FrameHeader) -> Option<String> {
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

    /// Whether `frame` tells its sensor, and what was drawn, more than they do, or they more than it: files of one camera tell alike.
    fn tells_less_than(&self, frame: &FrameHeader) -> bool {
        let (its, theirs) = (&frame.metadata, &self.head.metadata);
        let is_drawn = its.noise.is_some() || theirs.noise.is_some();
        is_drawn || its.camera.is_some() != theirs.camera.is_some()
    }

    /// What a user should hear of them beside `frame`, from which they come off.
    pub(in crate::stages) fn warnings_beside(&self, frame: &FrameHeader) -> Vec<String> {
        let is_scaled = !self.remarks.is_empty();
        let mut warnings = if is_scaled || self.is_bias() { Vec::new() } else { differences(frame, &self.head) };
        warnings.extend(self.taken_on_trust(frame).filter(|_| self.tells_less_than(frame)));
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
        // Without any time no temperature matters.
        let needs_none = |head: &FrameHeader| head.metadata.time_s() == Some(0.0);
        let is_unknown = |head: &&&FrameHeader| head.metadata.temperature_k().is_none() && !needs_none(head);
        let unknown = std::iter::once(&frame).chain(heads).find(is_unknown);
        if let Some(head) = unknown {
            warnings.push(format!(
                "{}: its temperature is not known; dark signals are scaled by exposure alone",
                head.name
            ));
        }
        Self { knows_temperatures: unknown.is_none() }
    }

    fn at(&self, head: &FrameHeader) -> Result<f64> {
        let law = head.metadata.temperature_k().filter(|_| self.knows_temperatures).map_or(1.0, dark_current_law);
        Ok(head.metadata.time_s().ok_or_else(|| head.missing("exposure_time_s"))? * law)
    }
}

/// What the converter adds; where that is not known, the black level, with a warning, or the bias of the sensor.
fn bias_level(frame: &FrameHeader, warnings: &mut Vec<String>) -> Result<BlackLevels> {
    if let Some(adc) = frame.metadata.adc {
        return Ok(BlackLevels::uniform_at(adc.bias_adu));
    }
    let Some(level) = frame.black_levels()? else {
        let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
        let bias = readout.map(|readout| BlackLevels::uniform_at(readout.bias_adu));
        return bias.ok_or_else(|| {
            let problem = "dark signals are scaled above the bias of the converter, and neither its metadata nor a sensor tell that, nor a \
                           black level (`black_level_adu`)";
            frame.refuse(problem).give(&["bias", "sensor"])
        });
    };
    warnings
        .push(format!("{}: its black level is taken for the bias, beside which dark signals are scaled", frame.name));
    Ok(level)
}
