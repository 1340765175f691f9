//! Corrections of a frame of codes before demosaicking.

use super::border::measure_black;
use super::correction_doubts::{
    doubt_of_array, doubt_of_bytes, doubt_of_cut_off, doubt_of_limits, doubts_of_flats, said_of_levels,
};
use super::dark_levels::{DarkLevels, doubt_of_dark, doubt_of_one};
use super::described::{Described, doubt_of_black};
use super::independence::{Company, Role, check_contents, check_files};
use super::notes::Note;
use super::options::{Input, SensorChoice};
use super::values::{self, BlackChoice};
use super::white_above_darks::keep_white;
use crate::camera::levels::BlackLevels;
use crate::error::{Error, Result};
use crate::formats::files::{digest_of, read_file};
use crate::formats::input::{FrameReader, InputOptions, Linearizing, OfCamera};
use crate::formats::many::OneOfMany;
use crate::formats::register::check_inputs;
use crate::masking::Corrections;
use crate::metadata::{DefectsRecord, FlatRecord, FrameHeader};
use crate::numerics::averages::{CLIP, Combine};
use crate::stages::black::Black;
use crate::stages::correct::{CorrectFrame, CorrectionSettings};
use crate::stages::darks::{DarkFrames, DarkLimits, DarkSettings};
use crate::stages::defects::{DefectMap, beyond_chance};
use crate::stages::flats::{FlatFrames, FlatLevels, FlatMeans};
use crate::stages::masters::Averaging;
use crate::stream::{RowSource, Stage};
use clap::{ArgGroup, Args};
use std::path::{Path, PathBuf};

/// What is corrected, and by which frames.
#[derive(Debug, Clone, Args)]
#[command(group = ArgGroup::new("averaged").args(["dark", "bias", "flat"]).multiple(true))]
pub struct Correction {
    /// Make codes proportional to charge first, those of darks, bias frames and flats too, by the `linearization` of the sensor
    #[arg(long)]
    pub linearize: bool,
    /// The sensor that the frames come from.
    #[command(flatten)]
    pub sensor: SensorChoice,
    /// Black level to remove: auto (from the metadata), none, a number of ADU, or four of the 2x2 sites at the sensor's corner, row
    /// by row, or that of the masked border, which `import-raw --crop full` keeps: border (a level for each 2x2 site), rows or
    /// columns (and what each row or column is off)
    #[arg(
        id = "black",
        long,
        default_value = "none",
        value_name = "auto|none|N[,N,N,N]|border|rows|columns",
        value_parser = values::black_or_border,
        allow_hyphen_values = true
    )]
    pub black_choice: BlackChoice,
    /// Dark frame to subtract sample by sample, read with the --part, --raw, --channel and --crop of the input; given more than once,
    /// the average of all
    #[arg(long, value_name = "FILE", conflicts_with = "black")]
    pub dark: Vec<PathBuf>,
    /// Bias frame, of next to no exposure; any number. Comes off where there is no dark frame; beside dark frames it is what
    /// --scale-dark scales above
    #[arg(long, value_name = "FILE", conflicts_with = "black")]
    pub bias: Vec<PathBuf>,
    /// Bring dark signals to the exposure and the temperature of the frame: dark frames alike, else between the nearest two,
    /// else the nearest, scaled above the bias by exposure and by Eq. 6 of Haralabidis and Pilinis (2005)
    #[arg(long, requires = "dark")]
    pub scale_dark: bool,
    /// Flat field to divide by, lit evenly; any number. Each class is divided by its share of its own mean
    #[arg(long, value_name = "FILE")]
    pub flat: Vec<PathBuf>,
    /// Dark frame of the flats; any number. By default bias frames come off them, or their black level
    #[arg(long, value_name = "FILE", requires = "flat")]
    pub flat_dark: Vec<PathBuf>,
    /// How frames of a kind are averaged: mean, median, or clipped, the mean without outliers
    #[arg(long, default_value = "mean", value_parser = values::choice::<Combine>(), requires = "averaged")]
    pub combine: Combine,
    /// Standard deviations from the median beyond which `clipped` leaves samples out, again and again; of N samples none
    /// lies farther off than the root of N; by default 3
    #[arg(long, value_name = "KAPPA", value_parser = values::positive)]
    pub clip: Option<f64>,
    /// Defective photosites to interpolate: a frame that is not zero there, or a list (.txt, .csv) of column,row on the sensor
    #[arg(long, value_name = "FILE")]
    pub defects: Option<PathBuf>,
    /// Find defective photosites, beyond so many standard deviations of their class: hot and cold ones in dark or bias frames,
    /// unstable ones in five dark frames or more, dead ones in flats; by default so many that chance finds less than one
    /// in a frame
    #[arg(long, value_name = "SIGMA", value_parser = values::positive, num_args = 0..=1, require_equals = true)]
    pub find_defects: Option<Option<f64>>,
    /// Charge transfer efficiency to undo, above 0 and at most 1; the bias of the converter is left out of it
    #[arg(long, value_name = "X", value_parser = values::fraction)]
    pub cte: Option<f64>,
}

/// A correction, ready to run.
pub struct OpenCorrection {
    /// What is subtracted as a constant, and the charge transfer that is undone.
    pub stage: CorrectFrame,
    /// What comes off and divides, sample by sample.
    pub corrections: Corrections<OneOfMany>,
    /// What came up.
    pub notes: Vec<Note>,
    /// What the mean of dark frames can be, and of those of the flats.
    levels: DarkLevels,
    levels_of_flats: Option<DarkLevels>,
}

/// The frame that is corrected, where it comes from, and what is said of it.
struct Light<'a> {
    frame: &'a FrameHeader,
    input: &'a Input,
    described: &'a Described,
}

impl Light<'_> {
    /// A complaint about an exposure that a frame beside this one does not tell, which no option supplies.
    fn in_its_own(&self, error: Error) -> Error {
        match error {
            Error::MissingKey { file, key: "exposure_time_s" } if file != self.frame.name => {
                let problem = format!(
                    "nothing tells its exposure time; write `exposure_time_s` into {file}.yaml, as --metadata-template shows"
                );
                Error::format(&file, problem)
            }
            other => other,
        }
    }
}

impl Correction {
    /// Makes sure that options have an effect, that no frame stands for two, and that files can be read as often as they must.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`].
    pub fn check(&self, input: &Input) -> Result<()> {
        if self.clip.is_some() && self.combine != Combine::Clipped {
            let problem = "only `--combine clipped` leaves samples out";
            return Err(Error::Usage(problem.into()).leave_out(&["clip"]));
        }
        let kinds = [
            (Role::Dark, &self.dark),
            (Role::Bias, &self.bias),
            (Role::Flat, &self.flat),
            (Role::FlatDark, &self.flat_dark),
        ];
        let files = kinds.into_iter().flat_map(|(role, paths)| paths.iter().map(move |path| (role, path.as_path())));
        let light = input.path().map(|path| (Role::Light, path));
        check_files(&light.into_iter().chain(files).collect::<Vec<_>>())?;
        let lists = [&self.dark, &self.bias, &self.flat, &self.flat_dark];
        let once = lists.into_iter().flatten().chain(&self.defects).map(PathBuf::as_path);
        check_inputs(once.map(Some).chain([input.path()]))?;
        let of_flats = [&self.flat, &self.flat_dark, &self.bias]
            .into_iter()
            .flatten()
            .chain(&self.defects)
            .filter(|_| !self.flat.is_empty());
        let for_defects = self.dark.iter().chain(&self.bias).filter(|_| self.find_defects.is_some());
        if of_flats.chain(for_defects).any(|path| path.as_os_str() == "-") {
            return Err(Error::Usage(
                "flats, and frames in which defects are found, are read twice, and a map of defects with flats; name files".into(),
            ));
        }
        if self.find_defects.is_some() && self.dark.is_empty() && self.bias.is_empty() && self.flat.is_empty() {
            let problem = "defects are found among dark frames, bias frames or flats";
            return Err(Error::Usage(problem.into()).give(&["dark", "flat"]));
        }
        Ok(())
    }

    /// Makes the frame ready: its sensor, and codes that are proportional to charge.
    ///
    /// # Errors
    ///
    /// Those of [`SensorChoice::apply`] and [`FrameReader::linearize`]; [`Error::Usage`] for a black level of the border, which
    /// is that of codes.
    pub fn prepare(&self, reader: &mut FrameReader) -> Result<Vec<Note>> {
        let notes = self.sensor.apply(reader)?;
        if let BlackChoice::Known(Black::Level(level)) = self.black_choice {
            reader.expect_black(level);
        }
        if self.linearize {
            if matches!(self.black_choice, BlackChoice::Border(_)) {
                let problem = "the masked border tells the level of codes, not of those made proportional to charge";
                return Err(Error::Usage(problem.into()).leave_out(&["linearize"]));
            }
            reader.linearize()?;
        }
        Ok(notes)
    }

    /// The black level to subtract; what the border tells stands in the metadata.
    fn black(&self, frame: &FrameHeader) -> Black {
        match self.black_choice {
            // A number is one of codes as they come.
            BlackChoice::Known(Black::Level(level)) => {
                Black::Level(frame.metadata.adc.map_or(level, |adc| level.map(|code| adc.sample(code))))
            }
            BlackChoice::Known(black) => black,
            BlackChoice::Border(_) => Black::Auto,
        }
    }

    /// Has what comes off as a level held against masked photosites; that of the border is theirs.
    ///
    /// # Errors
    ///
    /// Those of [`Black::levels`].
    pub fn compare_masked(&self, reader: &mut FrameReader) -> Result<()> {
        if let BlackChoice::Known(black @ (Black::Auto | Black::Level(_))) = self.black_choice {
            reader.compare_masked(black.levels(reader.header())?);
        }
        Ok(())
    }

    fn settings(&self) -> DarkSettings {
        let averaging = Averaging { combine: self.combine, clip: self.clip.unwrap_or(CLIP) };
        DarkSettings { averaging, is_scaled: self.scale_dark }
    }

    fn files(&self) -> usize {
        // Frames in which defects are found are open twice.
        2 * (self.dark.len() + 2 * self.bias.len() + self.flat.len() + self.flat_dark.len()) + 2
    }

    /// Opens frames beside the input, as `how` has it.
    fn open_frames(&self, paths: &[PathBuf], light: &Light, how: &InputOptions) -> Result<Vec<OneOfMany>> {
        let camera = OfCamera { description: light.input.metadata.clone(), ..light.described.of_camera()? };
        let beside = |path: &PathBuf| InputOptions {
            linearize: how.linearize.clone(),
            tells_top: how.tells_top,
            camera: camera.clone(),
            ..light.input.beside(path)
        };
        let options: Vec<InputOptions> = paths.iter().map(beside).collect();
        let others = self.files() - paths.len();
        OneOfMany::open_all(options, others)
    }

    /// Opens frames of a kind, which join `company`; those that do not say of their camera what is said of that of the frame have this.
    fn frames(&self, role: Role, light: &Light, company: &mut Company) -> Result<Vec<OneOfMany>> {
        let paths = match role {
            Role::Light | Role::Exposure => return Ok(Vec::new()),
            Role::Dark => &self.dark,
            Role::Bias => &self.bias,
            Role::Flat => &self.flat,
            Role::FlatDark => &self.flat_dark,
        };
        let how = InputOptions {
            linearize: self.linearizing(light.frame),
            // The full well of a sensor that is named counts for flats too.
            tells_top: role == Role::Flat && light.frame.metadata.sensor.is_none(),
            ..InputOptions::default()
        };
        let frames = self.open_frames(paths, light, &how)?;
        company.add(role, frames.iter().map(OneOfMany::header));
        Ok(frames)
    }

    fn darks(&self, light: &Light, company: &mut Company) -> Result<Option<DarkFrames<OneOfMany>>> {
        // Bias frames beside darks that are not scaled may be those of flats.
        let biases = if self.is_bias_of_flats() { Vec::new() } else { self.frames(Role::Bias, light, company)? };
        let darks = self.frames(Role::Dark, light, company)?;
        DarkFrames::matched(light.frame, darks, biases, self.settings()).map_err(|error| light.in_its_own(error))
    }

    /// How the codes of frames beside `frame` are read.
    fn linearizing(&self, frame: &FrameHeader) -> Linearizing {
        match self.linearize {
            true => Linearizing::As(frame.metadata.sensor.clone().map(Box::new)),
            false => Linearizing::No,
        }
    }

    fn is_bias_of_flats(&self) -> bool {
        !self.dark.is_empty() && !self.scale_dark && !self.flat.is_empty() && self.flat_dark.is_empty()
    }

    fn flats(&self, light: &Light, company: &mut Company) -> Result<Option<FlatFrames<OneOfMany>>> {
        let is_scaled = self.scale_dark && !self.flat_dark.is_empty();
        let needs_bias = self.flat_dark.is_empty() || is_scaled;
        let biases = if needs_bias { self.frames(Role::Bias, light, company)? } else { Vec::new() };
        let darks = self.frames(Role::FlatDark, light, company)?;
        let flats = self.frames(Role::Flat, light, company)?;
        let black = match self.black(light.frame) {
            Black::Level(level) => Some(BlackLevels::of_sites(level, light.frame.geometry.origin)),
            _ => None,
        };
        let settings = DarkSettings { is_scaled, ..self.settings() };
        let found = FlatFrames::of(light.frame, flats, [darks, biases], black, settings, self.cte);
        found.map_err(|error| match error {
            // Beside frames that come off there is no --black.
            Error::MissingKey { file, key: "black_level_adu" } if !self.dark.is_empty() => {
                Error::format(&file, "nothing tells what no light reads in it").give(&["flat_dark", "bias"])
            }
            other => light.in_its_own(other),
        })
    }

    /// Reads flats for what they are on the whole: their levels, where these count, and the means of their classes.
    fn surveyed(
        &self,
        light: &Light,
        flats: Option<FlatFrames<OneOfMany>>,
        beyond: Option<f64>,
    ) -> Result<Option<(FlatFrames<OneOfMany>, FlatMeans)>> {
        let Some(flats) = flats else { return Ok(None) };
        let again = || self.flats(light, &mut Company::default());
        let levels = if flats.wants_levels() { again()?.map(FlatFrames::levels).transpose()? } else { None };
        let means = self.flat_means(light, flats.at(levels.clone()), beyond, levels.as_ref())?;
        Ok(again()?.map(|flats| (flats.at(levels), means)))
    }

    /// Reads flats for the means of their classes; where defects are looked for twice, so that what is found does not count.
    fn flat_means(
        &self,
        light: &Light,
        flats: FlatFrames<OneOfMany>,
        beyond: Option<f64>,
        levels: Option<&FlatLevels>,
    ) -> Result<FlatMeans> {
        let map = || self.map(light);
        let found = flats.survey(beyond, map()?, None)?;
        let Some(limits) = found.limits() else { return Ok(found) };
        match self.flats(light, &mut Company::default())? {
            Some(flats) => Ok(flats.at(levels.cloned()).survey(None, map()?, Some(limits))?.within(limits)),
            None => Ok(found),
        }
    }

    fn map(&self, light: &Light) -> Result<Option<DefectMap<OneOfMany>>> {
        let Some(path) = &self.defects else { return Ok(None) };
        let is_list =
            path.extension().is_some_and(|end| ["txt", "csv"].iter().any(|list| end.eq_ignore_ascii_case(list)));
        if !is_list {
            let mut map = self.open_frames(std::slice::from_ref(path), light, &InputOptions::default())?;
            return map.pop().map(|map| DefectMap::of_frame(map, light.frame)).transpose();
        }
        let (bytes, name) = (read_file(path)?, path.display().to_string());
        let text = String::from_utf8(bytes).map_err(|_| Error::format(&name, "it is no text"))?;
        DefectMap::of_list(&text, &name, light.frame).map(Some)
    }

    /// Opens what `frame` is corrected by, and reads flats, and frames in which defects are found, for what they are on the
    /// whole. `described` is what a user says of the frame.
    ///
    /// # Errors
    ///
    /// Those of the frames, of [`Company::check`] and of [`CorrectFrame::new`]; [`Error::Usage`] for what makes no sense.
    pub fn open(&self, frame: &mut FrameHeader, input: &Input, described: &Described) -> Result<OpenCorrection> {
        let mut notes = Vec::new();
        match self.black_choice {
            BlackChoice::Border(border) => notes.extend(measure_black(frame, &input.options(), border)?),
            BlackChoice::Known(black) => notes.extend(doubt_of_black(frame, black)?),
        }
        let frame = &*frame;
        let light = &Light { frame, input, described };
        let mut company = Company::default();
        company.add(Role::Light, [frame]);
        let again = &mut Company::default();
        let darks = self.darks(light, &mut company)?;
        let is_more = !self.flat.is_empty() || self.defects.is_some() || self.linearize;
        if !self.flat.is_empty() && darks.is_none() && self.black(frame) == Black::None {
            let problem = "a flat field divides what is above black, which must come off first";
            return Err(Error::Usage(problem.into()).give(&["dark", "bias", "black"]));
        }
        let settings = CorrectionSettings { black: self.black(frame), cte: self.cte };
        let mut stage = CorrectFrame::of(frame, &settings, darks.as_ref().map(DarkFrames::stack), is_more)?;
        let off = self.dark.first().or(self.bias.first()).filter(|_| !self.scale_dark).map(PathBuf::as_path);
        notes.extend(keep_white(stage.header_mut(), frame, off, input)?);
        let geometry = &frame.geometry;
        let samples = (geometry.row_samples() * geometry.height) as u64;
        let beyond = self.find_defects.map(|given| given.unwrap_or_else(|| beyond_chance(samples)));
        let flats = self.flats(light, &mut company)?;
        let mut warnings = [stage.warnings(), &company.check()?].concat();
        self.check_contents(light)?;
        warnings.extend((!self.dark.is_empty()).then(|| doubt_of_dark(frame)).flatten());
        let dark_limits = match beyond.zip(self.darks(light, again).transpose()) {
            Some((beyond, darks)) => Some(darks?.survey(beyond)?),
            None => None,
        };
        let flats = self.surveyed(light, flats, beyond)?;
        if let Some((flats, means)) = &flats {
            warnings.extend_from_slice(flats.warnings());
            warnings.extend(doubts_of_flats(flats, means, frame));
        }
        warnings.extend(self.find_defects.flatten().and_then(doubt_of_limits));
        let sources =
            darks.iter().flat_map(DarkFrames::frames).chain(flats.iter().flat_map(|(flats, _)| flats.frames()));
        let mut remarks: Vec<String> = sources.flat_map(|source| source.notes().to_vec()).collect();
        remarks.extend(darks.iter().flat_map(|darks| darks.stack().remarks().to_vec()));
        remarks.extend(flats.iter().filter_map(|(flats, _)| said_of_levels(flats)));
        let on_trust = darks.as_ref().and_then(|darks| darks.stack().taken_on_trust(frame));
        remarks.extend(on_trust.clone().filter(|text| !warnings.contains(text)));
        let levels = DarkLevels::of(frame, darks.as_ref().map(DarkFrames::stack), on_trust.is_some());
        let levels_of_flats = flats.as_ref().map(|(flats, _)| DarkLevels::of_flats(frame, flats));
        let defects = self.defects_record(beyond, dark_limits.as_ref(), flats.is_some());
        warnings.extend(defects.as_ref().and_then(|_| doubt_of_array(frame)));
        let shares_masters = company.shares_darks().unwrap_or_else(|| {
            let problem =
                "some of the dark frames come off both frame and flats: predictions take their noise for independent";
            warnings.push(format!("{}: {problem}; give the same to both, or to each its own", frame.name));
            false
        });
        let of_flats = flats.as_ref().map(|(flats, means)| FlatRecord { shares_masters, ..flats.record(means) });
        stage.note_further(of_flats, defects);
        let map = self.map(light)?;
        let list = self.defects.as_deref().map(|path| path.display().to_string()).unwrap_or_default();
        warnings.extend(map.as_ref().and_then(|map| map.doubt(&list, frame)));
        notes.extend(warnings.into_iter().map(Note::Warning).chain(remarks.into_iter().map(Note::Remark)));
        let corrections = Corrections { darks, dark_limits, flats, map, found: [0; 3] };
        Ok(OpenCorrection { stage, corrections, notes, levels, levels_of_flats })
    }

    /// Makes sure that no frame beside `light` is a copy of it, or of another.
    fn check_contents(&self, light: &Light) -> Result<()> {
        let kinds = [
            (Role::Dark, &self.dark),
            (Role::Bias, &self.bias),
            (Role::Flat, &self.flat),
            (Role::FlatDark, &self.flat_dark),
        ];
        let beside = |role: Role| move |path: &PathBuf| (role, light.input.beside(path));
        let itself = InputOptions { sequence: None, ..light.input.options() };
        let others = kinds.into_iter().flat_map(|(role, paths)| paths.iter().map(beside(role)));
        let files: Vec<_> = std::iter::once((Role::Light, itself)).chain(others).collect();
        check_contents(&files)
    }

    /// How defective photosites are told, where they are: by a list or map, and in frames, beyond so many standard deviations.
    fn defects_record(
        &self,
        beyond: Option<f64>,
        dark_limits: Option<&DarkLimits>,
        has_flats: bool,
    ) -> Option<DefectsRecord> {
        let found_in = |is_there: bool, what: &str| is_there.then(|| what.to_owned());
        let map = self.defects.as_deref();
        (map.is_some() || beyond.is_some()).then(|| DefectsRecord {
            map: map.and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned()),
            digest: map.and_then(digest_of),
            found_beyond: beyond,
            found_in: [
                found_in(dark_limits.is_some(), "level of dark frames"),
                found_in(dark_limits.is_some_and(|limits| limits.tell_unstable()), "scatter of dark frames"),
                found_in(beyond.is_some() && has_flats, "flat field"),
            ]
            .into_iter()
            .flatten()
            .collect(),
        })
    }
}

impl OpenCorrection {
    /// What was found while the frame was corrected.
    pub fn findings(&self) -> Vec<Note> {
        let Corrections { darks, dark_limits, flats, map, found } = &self.corrections;
        let clipped =
            darks.as_ref().map_or(0, DarkFrames::clipped) + flats.as_ref().map_or(0, |(flats, _)| flats.clipped());
        let [off, unstable, dead] = found;
        let said = [
            (clipped > 0).then(|| format!("{clipped} samples of averaged frames were clipped")),
            (dark_limits.is_some() || *dead > 0).then(|| {
                format!(
                    "found {off} photosites off in dark frames, {unstable} unstable ones, {dead} off in flats or unlit"
                )
            }),
        ];
        let level = darks.as_ref().and_then(|darks| self.levels.doubt(&self.header().name, darks));
        let unlike = darks.as_ref().and_then(DarkFrames::unlike);
        let cut_off = darks.as_ref().and_then(|darks| Some((darks.cut_off()?, darks.means()?)));
        let cut_off =
            cut_off.filter(|_| level.is_none()).and_then(|(cut, [all, off])| doubt_of_cut_off(&cut, all - off));
        let cut_off_flats = flats.as_ref().and_then(|(flats, _)| {
            let (darks, light) = (flats.darks()?, flats.mean()?);
            doubt_of_cut_off(&darks.cut_off()?, light - darks.mean()?)
        });
        let bytes = darks.as_ref().and_then(|darks| doubt_of_bytes(darks.frames(), darks.means()?[0]));
        let bytes_of_flats =
            flats.as_ref().and_then(|(flats, _)| doubt_of_bytes(flats.darks()?.frames(), flats.mean()?));
        let bytes = bytes.into_iter().chain(bytes_of_flats);
        let of_flats = flats.as_ref().zip(self.levels_of_flats.as_ref());
        let of_flats = of_flats.map_or(Vec::new(), |((flats, _), levels)| levels.doubts_of_flats(flats));
        let level = level
            .into_iter()
            .chain(unlike.map(doubt_of_one))
            .chain(of_flats)
            .chain(cut_off)
            .chain(cut_off_flats)
            .chain(bytes);
        let doubt = map.as_ref().and_then(DefectMap::finding).into_iter().chain(level).map(Note::Warning);
        said.into_iter().flatten().map(Note::Remark).chain(doubt).collect()
    }

    /// The head of the frame that is made.
    pub fn header(&self) -> &FrameHeader {
        self.stage.header()
    }
}
