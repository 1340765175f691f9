//! Whether frames that count as independent are: noise that stands in two of them counts as if it were drawn twice.

use crate::error::{Error, Result};
use crate::formats::digest::SamplesDigest;
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::places::place;
use crate::metadata::{DrawnExposures, FrameHeader, TakenAs};
use crate::random::Source;
use crate::requests::options::Input;
use crate::stream::RowSource;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What a frame is taken for beside others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The frame that is corrected.
    Light,
    /// A dark frame.
    Dark,
    /// A bias frame.
    Bias,
    /// A flat field.
    Flat,
    /// A dark frame of the flats.
    FlatDark,
    /// An exposure of the scene.
    Exposure,
}

impl Role {
    fn in_words(self) -> &'static str {
        match self {
            Self::Light => "the frame itself",
            Self::Dark => "a dark frame",
            Self::Bias => "a bias frame",
            Self::Flat => "a flat",
            Self::FlatDark => "a dark frame of the flats",
            Self::Exposure => "an exposure",
        }
    }

    /// What is wrong with a frame that was taken as something else; `Err` where it cannot be meant.
    fn doubt_of(self, taken_as: TakenAs) -> std::result::Result<Option<&'static str>, ()> {
        match (self, taken_as) {
            (Self::Dark | Self::FlatDark | Self::Bias, TakenAs::Light | TakenAs::Flat)
            | (Self::Flat, TakenAs::Dark | TakenAs::Bias) => Err(()),
            (Self::Dark | Self::FlatDark, TakenAs::Bias) => Ok(Some("it has next to none of the dark signal")),
            (Self::Bias, TakenAs::Dark) => Ok(Some("its dark signal comes off too")),
            (Self::Flat, TakenAs::Light) => Ok(Some("a flat field is lit evenly")),
            _ => Ok(None),
        }
    }

    /// Whether frames of both may be the same: what comes off a frame may come off the flats too.
    fn may_be(self, other: Self) -> bool {
        let comes_off = |role| matches!(role, Self::Dark | Self::Bias);
        self != other && (comes_off(self) && other == Self::FlatDark || self == Self::FlatDark && comes_off(other))
    }
}

/// Makes sure that no file of several exposures of a scene is given twice.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_exposures(files: &[PathBuf]) -> Result<()> {
    let files: Vec<_> = files.iter().map(|file| (Role::Exposure, file.as_path())).collect();
    check_files(&files)
}

/// Makes sure that none of several exposures of a scene is a copy of another.
///
/// # Errors
///
/// Those of [`check_contents`].
pub fn check_copies(frames: &Input) -> Result<()> {
    if frames.inputs.len() < 2 {
        return Ok(());
    }
    let exposure = |file: &PathBuf| (Role::Exposure, frames.only(Some(file), None).options());
    check_contents(&frames.inputs.iter().map(exposure).collect::<Vec<_>>())
}

/// Makes sure that no file is given twice where that would count as two frames.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_files(files: &[(Role, &Path)]) -> Result<()> {
    let places: Vec<_> = files.iter().map(|(role, path)| (*role, place(Some(path)), path)).collect();
    for (index, (role, its, path)) in places.iter().enumerate().filter(|(_, (_, its, _))| its.is_some()) {
        let twice = places[..index].iter().find(|(other, place, _)| place == its && !other.may_be(*role));
        if let Some((other, ..)) = twice {
            let (path, role, other) = (path.display(), role.in_words(), other.in_words());
            let as_what = if role == other { format!("twice as {role}") } else { format!("as {other} and as {role}") };
            return Err(Error::Usage(format!(
                "{path}: it is given {as_what}; its noise would count as that of two exposures; name another file"
            )));
        }
    }
    Ok(())
}

/// Frames that are used beside each other.
#[derive(Debug, Clone, Default)]
pub struct Company(Vec<(Role, FrameHeader)>);

impl Company {
    /// Adds frames; those that are in it already do not count again.
    pub fn add<'a>(&mut self, role: Role, frames: impl IntoIterator<Item = &'a FrameHeader>) {
        for frame in frames {
            if !self.0.iter().any(|(its, known)| *its == role && known.name == frame.name) {
                self.0.push((role, frame.clone()));
            }
        }
    }

    /// Makes sure that frames have noise of their own, as far as metadata tell; gives warnings of those that share some with
    /// a frame of another kind, and of bias frames that are exposed for long.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for frames of one kind with the same noise, for frames of two kinds with the same samples, and for those that
    /// were taken as what they cannot be used as.
    pub fn check(&self) -> Result<Vec<String>> {
        let mut warnings = Vec::new();
        for (role, frame) in &self.0 {
            let Some(taken_as) = frame.metadata.taken_as else { continue };
            let (name, taken, used) = (&frame.name, taken_as.in_words(), role.in_words());
            match role.doubt_of(taken_as) {
                Ok(None) => {}
                Ok(Some(problem)) => {
                    warnings.push(format!("{name}: it was taken as {taken} and is used as {used}; {problem}"))
                }
                Err(()) => {
                    return Err(frame.refuse(format!(
                        "it was taken as {taken}, by its own header or metadata (`taken_as`), and is given as {used}; name another \
                         file, or correct what is said of it by `taken_as` in {name}.yaml"
                    )));
                }
            }
        }
        self.check_capture()?;
        for (index, (role, frame)) in self.0.iter().enumerate() {
            for (other_role, other) in self.0[..index].iter().filter(|(other, _)| !other.may_be(*role)) {
                let (name, its) = (&frame.name, &other.name);
                if are_copies(frame, other) {
                    return Err(frame.refuse(format!(
                        "its samples are those of {its}, by the digests of both; copies of one exposure do not count as two"
                    )));
                }
                let Some((seed, number)) = shared_noise(frame, other) else { continue };
                if role == other_role {
                    return Err(frame.refuse(format!(
                        "its noise is that of {its}, of seed {seed} and frame {number}, and does not average out; draw it \
                         with another `add-noise --frame`"
                    )));
                }
                warnings.push(format!(
                    "{name}: its noise is in part that of {its}, of seed {seed} and frame {number}, and predictions take the two \
                     for independent; draw one of them with another `add-noise --frame`"
                ));
            }
        }
        warnings.extend(self.long_biases());
        Ok(warnings)
    }

    /// Makes sure that frames show the same photosites, and that what their files tell to have come off is not taken off again.
    fn check_capture(&self) -> Result<()> {
        let told = || self.0.iter().filter_map(|(role, frame)| Some((*role, frame, frame.metadata.capture.as_ref()?)));
        let Some((_, first, capture)) = told().next() else { return Ok(()) };
        for (_, frame, other) in told() {
            if let Some(problem) = other.misfit(capture, &first.name) {
                return Err(frame.refuse(problem));
            }
        }
        let has = |roles: &[Role]| self.0.iter().any(|(role, _)| roles.contains(role));
        // Without its bias a dark comes off what has lost its own.
        let is_biased = |roles: [Role; 2]| {
            let is_so =
                |frame: &FrameHeader| frame.metadata.capture.as_ref().is_some_and(|told| told.is_calibrated('B'));
            !has(&[Role::Bias]) && self.0.iter().filter(|(role, _)| roles.contains(role)).all(|(_, frame)| is_so(frame))
        };
        let [lights, flats] = [[Role::Light, Role::Dark], [Role::Flat, Role::FlatDark]];
        let comes_off = |role: Role, letter: char| match (role, letter) {
            (role, 'B') if [lights, flats].iter().any(|roles| roles.contains(&role) && is_biased(*roles)) => None,
            (Role::Light, 'B' | 'D') => has(&[Role::Dark, Role::Bias]).then_some("a dark or bias frame comes off it"),
            (Role::Light, 'F') => has(&[Role::Flat]).then_some("it is divided by a flat"),
            (Role::Flat, 'B' | 'D') => has(&[Role::FlatDark]).then_some("a dark frame comes off it"),
            (Role::Flat, 'F') => Some("it is to divide others"),
            (Role::Dark | Role::FlatDark | Role::Bias, 'B') => Some("its level is to come off others"),
            (Role::Dark | Role::FlatDark | Role::Bias, 'D') => Some("its dark signal is to come off others"),
            _ => None,
        };
        let steps = [('B', "a bias"), ('D', "a dark"), ('F', "a flat")];
        for (role, frame, capture) in told() {
            let twice = steps.into_iter().filter(|(letter, _)| capture.is_calibrated(*letter));
            if let Some((step, what)) = twice.filter_map(|(letter, step)| Some((step, comes_off(role, letter)?))).next()
            {
                return Err(frame.refuse(format!(
                    "its file tells that {step} was taken off or divided out before (CALSTAT, `capture.calibrated`), and {what}: give the \
                     frame as the camera wrote it, or leave that step out"
                )));
            }
        }
        Ok(())
    }

    /// Whether the dark frames of the flats are those that come off the frame; none where some are.
    pub fn shares_darks(&self) -> Option<bool> {
        let of = |role: Role| self.0.iter().filter(move |(its, _)| *its == role).map(|(_, frame)| frame);
        let is_same =
            |a: &FrameHeader, b: &FrameHeader| a.name == b.name || are_copies(a, b) || shared_noise(a, b).is_some();
        let of_flats: Vec<&FrameHeader> = of(Role::FlatDark).collect();
        let shared = of_flats.iter().filter(|dark| of(Role::Dark).any(|other| is_same(dark, other))).count();
        match shared {
            0 => Some(false),
            _ if shared == of_flats.len() && shared == of(Role::Dark).count() => Some(true),
            _ => None,
        }
    }

    /// A warning for each bias frame that is exposed for longer than a frame from which it comes off.
    fn long_biases(&self) -> impl Iterator<Item = String> {
        let biases = self.0.iter().filter(|(role, _)| *role == Role::Bias);
        biases.filter_map(move |(_, bias)| {
            let its = bias.metadata.time_s()?;
            let others = self.0.iter().filter(|(role, _)| *role != Role::Bias);
            let (other, shorter) = others
                .filter_map(|(_, other)| Some((other, other.metadata.time_s()?)))
                .find(|(_, exposure_s)| its > exposure_s * (1.0 + SAME_EXPOSURE))?;
            Some(format!(
                "{}: its exposure is {its} s, longer than that of {}, {shorter} s; a bias frame has next to none, and its dark \
                 signal comes off too",
                bias.name, other.name
            ))
        })
    }
}

/// Makes sure that none of some files has the very samples of another: noise is never drawn twice the same. Files whose samples are
/// all of one level, and those whose metadata tell that they have no noise, or each its own, are alone in being alike. Pipes are not
/// looked at.
///
/// # Errors
///
/// [`Error::Format`] for a copy; those of the files.
pub fn check_contents(files: &[(Role, InputOptions)]) -> Result<()> {
    let mut known: HashMap<_, Vec<(Role, &InputOptions)>> = HashMap::new();
    for (role, file) in files.iter().filter(|(_, file)| file.path.as_deref().is_some_and(Path::is_file)) {
        let alike = known.entry(begin_of(file)?).or_default();
        for (other, its) in alike.iter().filter(|(other, _)| !other.may_be(*role)) {
            let [mut a, mut b] = [FrameReader::open(its)?, FrameReader::open(file)?];
            if !may_be_copies(a.header(), b.header()) || !hold_the_same(&mut a, &mut b)? {
                continue;
            }
            let what = match *other == Role::Light {
                true => format!("a copy of the frame is not {}", role.in_words()),
                false => "copies of one exposure do not count as two".into(),
            };
            return Err(b.header().refuse(format!("its samples are those of {}, every one; {what}", a.header().name)));
        }
        alike.push((*role, file));
    }
    Ok(())
}

/// Samples by whose digest files are told apart before they are compared as a whole.
const BEGIN_SAMPLES: usize = 1 << 16;

/// Sides and channels of a frame, and a digest of its first rows.
fn begin_of(file: &InputOptions) -> Result<([usize; 2], Vec<String>, String)> {
    let mut reader = FrameReader::open(file)?;
    let geometry = reader.header().geometry.clone();
    let natural = reader.natural_rows().max(1);
    let rows = (BEGIN_SAMPLES / geometry.row_samples().max(1)).clamp(1, geometry.height.max(1));
    let (mut samples, mut read) = (Vec::new(), 0);
    while read < rows {
        let step = natural.min(geometry.height - read);
        reader.read(step, &mut samples)?;
        read += step;
    }
    let mut digest = SamplesDigest::new();
    digest.update(&samples[..rows * geometry.row_samples()]);
    Ok(([geometry.width, geometry.height], geometry.channels, digest.finish()))
}

/// Changes from sample to sample of exposures that are not alike by chance: so many, and such a share of all samples. Those of coarse
/// codes, whose changes are stuck photosites and patterns, may be.
const TELLING: usize = 16;
const TELLING_SHARE: f64 = 0.05;

/// Whether two frames have the same samples, which change from one to the next often enough to tell; they are read up to the first that
/// differs.
fn hold_the_same(a: &mut FrameReader, b: &mut FrameReader) -> Result<bool> {
    let (geometry, other) = (a.header().geometry.clone(), &b.header().geometry);
    if [geometry.width, geometry.height] != [other.width, other.height] || geometry.channels != other.channels {
        return Ok(false);
    }
    let step = geometry.step_rows(a.natural_rows().max(b.natural_rows())).max(1);
    let (mut of_a, mut of_b): (Vec<f32>, Vec<f32>) = (Vec::new(), Vec::new());
    let (mut changes, mut read) = (0, 0);
    while read < geometry.height {
        let rows = step.min(geometry.height - read);
        of_a.clear();
        of_b.clear();
        a.read(rows, &mut of_a)?;
        b.read(rows, &mut of_b)?;
        if of_a != of_b {
            return Ok(false);
        }
        changes += of_a.windows(2).filter(|pair| pair[0] != pair[1]).count();
        read += rows;
    }
    let samples = (geometry.row_samples() * geometry.height) as f64;
    Ok(changes >= TELLING && changes as f64 >= TELLING_SHARE * samples)
}

/// Exposures that differ by no more than this are the same, written with other digits.
const SAME_EXPOSURE: f64 = 1e-6;

/// Whether two frames have the same noisy samples, as their sidecars tell, and are not alike by chance: samples of one value, or
/// coarse codes of few photosites, of exposures that were each drawn by itself.
pub(super) fn are_copies(a: &FrameHeader, b: &FrameHeader) -> bool {
    let digest = |frame: &'_ FrameHeader| {
        let samples = frame.metadata.samples.as_ref().filter(|samples| !samples.one_value)?;
        Some(samples.digest.clone())
    };
    digest(a).is_some() && digest(a) == digest(b) && may_be_copies(a, b)
}

/// Whether frames with the same samples may be copies: not where noise is in neither, or was drawn for each by itself.
fn may_be_copies(a: &FrameHeader, b: &FrameHeader) -> bool {
    let are_drawn_apart = a.metadata.noise.is_some() && b.metadata.noise.is_some() && shared_noise(a, b).is_none();
    a.is_noisy() && b.is_noisy() && !are_drawn_apart
}

/// Seed and number of an exposure whose noise is in both of two frames, or of which both are averages.
pub(super) fn shared_noise(a: &FrameHeader, b: &FrameHeader) -> Option<(u64, u32)> {
    let (its, other) = (a.metadata.noise.as_ref()?, b.metadata.noise.as_ref()?);
    let is_shared = |source: &&Source| !source.is_fixed_pattern() && other.sources.contains(source);
    its.sources.iter().find(is_shared).filter(|_| its.sensor_seed == other.sensor_seed)?;
    let others = b.drawn();
    let common =
        |run: DrawnExposures| others.iter().find_map(|other| run.common(*other)).map(|number| (run.seed, number));
    a.drawn().into_iter().find_map(common)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::optics::Exposure;
    use crate::frame::Geometry;
    use crate::metadata::{Metadata, NoiseRecord, PoissonKind, SamplesRecord};
    use crate::stream::Counts;
    use crate::units::QuantityKind;

    fn frame(name: &str, seed: u64, number: u32, sources: &[Source]) -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.noise = Some(NoiseRecord {
            sources: sources.to_vec(),
            seed,
            sensor_seed: 0,
            frame: number,
            temperature_k: 293.0,
            dark_e: 1.0,
            hot_pixel_e: 0.0,
            poisson: PoissonKind::Exact,
            cte: None,
            smear_per_row: 0.0,
        });
        FrameHeader { name: name.into(), geometry: Geometry::new(4, 4, &["Y"]), metadata }
    }

    fn checked(frames: &[(Role, FrameHeader)]) -> Result<Vec<String>> {
        let mut company = Company::default();
        frames.iter().for_each(|(role, frame)| company.add(*role, [frame]));
        company.check()
    }

    #[test]
    fn noise_counts_once() {
        let [a, b, c] = [(7, 0), (7, 1), (7, 0)].map(|(seed, number)| frame("x", seed, number, &Source::ALL));
        let named = |frame: &FrameHeader, name: &str| FrameHeader { name: name.into(), ..frame.clone() };
        let (a, b, c) = (named(&a, "a"), named(&b, "b"), named(&c, "c"));
        assert!(checked(&[(Role::Dark, a.clone()), (Role::Dark, b.clone())]).unwrap().is_empty());
        let twice = checked(&[(Role::Dark, a.clone()), (Role::Dark, c.clone())]).unwrap_err().to_string();
        assert!(twice.starts_with("c: its noise is that of a, of seed 7 and frame 0"), "{twice}");
        let of_light = checked(&[(Role::Light, a.clone()), (Role::Dark, b.clone()), (Role::Dark, c.clone())]).unwrap();
        assert!(of_light.len() == 1 && of_light[0].starts_with("c: its noise is in part that of a"), "{of_light:?}");
        // What comes off a frame may come off the flats.
        assert!(checked(&[(Role::Dark, a.clone()), (Role::FlatDark, c.clone())]).unwrap().is_empty());
        // Fixed patterns are meant to be the same; sources of which one frame has none are not shared.
        let [fixed, read, shot] = [Source::Prnu, Source::Ron, Source::Ssn].map(|source| frame("y", 7, 0, &[source]));
        assert!(checked(&[(Role::Dark, fixed.clone()), (Role::Dark, named(&fixed, "z"))]).unwrap().is_empty());
        assert!(checked(&[(Role::Light, read), (Role::Dark, shot)]).unwrap().is_empty());
    }

    #[test]
    fn copies_are_told_by_their_digests() {
        let with_digest = |name: &str, sources: &[Source], number| {
            let mut frame = frame(name, 1, number, sources);
            let record: SamplesRecord = Counts::default().record("blake3:01".into());
            frame.metadata.samples = Some(record);
            frame
        };
        let copies =
            |sources: &[Source]| [0, 1].map(|number| (Role::Flat, with_digest(&number.to_string(), sources, number)));
        // Those of cameras, whose noise nobody drew.
        let of_camera = || {
            copies(&[Source::Ron]).map(|(role, mut frame)| {
                (frame.metadata.noise, frame.metadata.scene) = (None, None);
                (role, frame)
            })
        };
        let error = checked(&of_camera()).unwrap_err().to_string();
        assert!(error.starts_with("1: its samples are those of 0, by the digests of both"), "{error}");
        // Exposures without noise are alike; so are, by chance, those of coarse codes that were each drawn, and those of one value.
        assert!(checked(&copies(&[])).unwrap().is_empty());
        assert!(checked(&copies(&[Source::Ron])).unwrap().is_empty());
        let dull = of_camera().map(|(role, mut frame)| {
            frame.metadata.samples.as_mut().unwrap().one_value = true;
            (role, frame)
        });
        assert!(checked(&dull).unwrap().is_empty());
    }

    #[test]
    fn a_long_bias_is_told() {
        let exposed = |name: &str, number, exposure_s| {
            let mut frame = frame(name, 1, number, &Source::ALL);
            frame.metadata.exposure = Some(Exposure { exposure_s, f_number: 8.0, lens_transmittance: 1.0 });
            frame
        };
        let of = |bias_s| {
            let frames = [(Role::Light, exposed("light", 0, 0.5)), (Role::Bias, exposed("bias", 1, bias_s))];
            checked(&frames).unwrap()
        };
        assert!(of(0.5).is_empty() && of(0.001).is_empty());
        assert!(of(0.6)[0].starts_with("bias: its exposure is 0.6 s, longer than that of light, 0.5 s"));
    }

    #[test]
    fn a_file_is_one_exposure() {
        let [a, b] = ["a.exr", "./a.exr"].map(Path::new);
        let said = |files: &[(Role, &Path)]| check_files(files).map_err(|error| error.to_string());
        assert_eq!(said(&[(Role::Dark, a), (Role::FlatDark, b)]), Ok(()));
        let twice = said(&[(Role::Dark, a), (Role::Dark, b)]).unwrap_err();
        assert!(twice.starts_with("./a.exr: it is given twice as a dark frame; its noise would count"), "{twice}");
        let itself = said(&[(Role::Light, a), (Role::Dark, a)]).unwrap_err();
        assert!(itself.starts_with("a.exr: it is given as the frame itself and as a dark frame;"), "{itself}");
        // The standard input is no file.
        assert_eq!(said(&[(Role::Light, Path::new("-")), (Role::Dark, Path::new("-"))]), Ok(()));
    }
}
