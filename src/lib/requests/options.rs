//! Groups of options that several programs share.

use super::notes::Note;
use super::sensor::SensorRequest;
use super::values;
use crate::analysis::characterization::evaluation::{Filling, SampleExposure};
use crate::analysis::statistics::Region;
use crate::camera::levels::WhiteLevel;
use crate::camera::optics::Exposure;
use crate::camera::sensor::Sensor;
use crate::color::White;
use crate::color::rgb::{Encoding, Primaries};
use crate::error::{Error, Result};
use crate::formats::data::{self, SensorChanges};
use crate::formats::headerless::Layout;
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::output::{CompressionKind, Format, OutputOptions, SampleKind};
use crate::formats::pipe;
use crate::formats::places::{is_pattern, named, numbered, output_of};
use crate::formats::sequence::Sequence;
use crate::metadata::{FrameHeader, PoissonKind};
use crate::names::Named;
use crate::random::Source;
use crate::stages::noise::NoiseSettings;
use crate::units::{QuantityKind, RadianceUnit, kelvin};
use clap::{Args, Command};
use std::ffi::OsString;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A request as its options have it where `words` alone are given: what is declared as default is the default everywhere.
pub(super) fn defaults<R: Args>(words: &[OsString]) -> R {
    let command = R::augment_args(Command::new("defaults").no_binary_name(true));
    let parsed = command.try_get_matches_from(words).and_then(|matches| R::from_arg_matches(&matches));
    parsed.unwrap_or_else(|error| panic!("the defaults of a request contradict each other: {error}"))
}

/// A frame to read, or several.
#[derive(Debug, Clone, Args)]
pub struct Input {
    /// Frames to read, EXR, TIFF, DNG, PNG or FITS; `-` or none for standard input, which may bring several one after another
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Of which the next frame is taken.
    #[arg(skip)]
    pub sequence: Option<Sequence>,
    /// Part of a multi-part EXR or FITS, or page of a TIFF, counted from 0
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub part: usize,
    /// Read a file without a header: rows of u8, u16le, u16be or f32le, behind OFFSET bytes if given
    #[arg(long, value_name = "WxH:TYPE[:OFFSET]", value_parser = str::parse::<Layout>)]
    pub raw: Option<Layout>,
    /// YAML file whose metadata replace those that come with the input
    #[arg(long, value_name = "FILE")]
    pub metadata: Option<PathBuf>,
    /// Print YAML to begin such a file with, each key explained
    #[arg(long)]
    pub metadata_template: bool,
    /// Take one channel alone, by its name, as a single plane
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Take a rectangle X,Y,W,H in pixels alone; its photosites keep class, levels and noise
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region, allow_hyphen_values = true)]
    pub crop: Option<Region>,
}

impl Input {
    /// The first file; none for the standard input.
    pub fn path(&self) -> Option<&Path> {
        self.inputs.first().map(PathBuf::as_path)
    }

    /// The same with this file alone, or the frames of this sequence.
    pub fn only(&self, path: Option<&Path>, sequence: Option<Sequence>) -> Self {
        Self { inputs: path.into_iter().map(Path::to_owned).collect(), sequence, ..self.clone() }
    }

    /// Whether frames come through a pipe.
    pub fn is_pipe(&self) -> bool {
        pipe::is_input(self.path())
    }

    /// What to open; channels besides R, G, B or Y are left out.
    pub fn options(&self) -> InputOptions {
        let path = self.path().map(Path::to_owned);
        let Self { sequence, part, raw, metadata, channel, crop, .. } = self.clone();
        InputOptions { path, sequence, part, raw, metadata, channel, crop, ..InputOptions::default() }
    }

    /// The same with all channels.
    pub fn options_for_all(&self) -> InputOptions {
        InputOptions { all_channels: true, ..self.options() }
    }

    /// Another frame of the same camera, of which the same part of the sensor is read; its metadata are its own.
    pub fn beside(&self, path: &Path) -> InputOptions {
        let Self { raw, channel, crop, .. } = self.clone();
        InputOptions { path: Some(path.to_owned()), raw, channel, crop, ..InputOptions::default() }
    }
}

/// A sensor that counts instead of the one in the frame's metadata.
#[derive(Debug, Clone, Default, Args)]
pub struct SensorChoice {
    /// Sensor, for a frame whose metadata names none, or another than it names
    #[arg(long, value_name = "NAME|FILE")]
    pub sensor: Option<String>,
    /// Sensor whose read-out counts in place of that of the frame's sensor, or of --sensor
    #[arg(long, value_name = "NAME|FILE")]
    pub readout: Option<String>,
    /// Setting of the read-out of --readout, or of --sensor: one of those that its file has
    #[arg(long, value_name = "NAME")]
    pub setting: Option<String>,
}

impl SensorChoice {
    /// Puts the sensor, if one was chosen, or its read-out into the metadata of a frame; gives what in its description may not
    /// be meant.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_sensor`].
    pub fn apply(&self, reader: &mut FrameReader) -> Result<Vec<Note>> {
        let own = reader.header_mut().metadata.sensor.clone();
        let setting = self.setting.as_deref();
        let (loaded, doubts, remarks) = match (&self.sensor, &self.readout, own) {
            (None, None, _) if setting.is_some() => {
                let problem = "a frame has the numbers of one setting, and files of sensors those of others";
                return Err(Error::Usage(problem.into()).give(&["sensor", "readout"]));
            }
            (None, None, _) => return Ok(Vec::new()),
            (Some(sensor), readout, _) => {
                let (readout, setting) = (readout.clone(), self.setting.clone());
                let changes = SensorChanges { readout, setting, ..SensorChanges::default() };
                let loaded = data::load_changed_sensor(sensor, &changes)?;
                (loaded.sensor.clone(), loaded.doubts(), loaded.remarks().to_vec())
            }
            (None, Some(readout), Some(mut own)) => {
                let (other, remarks) = data::load_description(readout, setting)?;
                let lost = own.replace_readout(&other)?;
                let doubts = lost.into_iter().chain(own.doubts()).collect();
                (own, doubts, remarks)
            }
            (None, Some(readout), None) => {
                let (other, remarks) = data::load_description(readout, setting)?;
                other.readout()?;
                let doubts = other.doubts();
                (other, doubts, remarks)
            }
        };
        let doubts = doubts.into_iter().chain(contradictions(reader.header_mut(), &loaded));
        let notes = doubts.map(Note::Warning).chain(remarks.into_iter().map(Note::Remark)).collect();
        reader.header_mut().metadata.sensor = Some(loaded);
        Ok(notes)
    }
}

/// What a frame says of itself that the read-out of a sensor does not.
fn contradictions(frame: &FrameHeader, sensor: &Sensor) -> Vec<String> {
    let Some(readout) = &sensor.readout else { return Vec::new() };
    let FrameHeader { name, metadata, .. } = frame;
    let is_codes = metadata.quantity == QuantityKind::Adu;
    let last_code = f64::from((1_u32 << readout.bits) - 1);
    let mut found = Vec::new();
    if let Some(cfa) = metadata.cfa.filter(|cfa| *cfa != readout.cfa) {
        found.push(format!("it has {}, and sensor {} has {}", cfa.in_words(), sensor.name, readout.cfa.in_words()));
    }
    if let Some(white) =
        metadata.white_level_adu.map(WhiteLevel::largest).filter(|white| is_codes && *white > last_code)
    {
        found.push(format!(
            "its white level, {white} ADU, is beyond the last code of sensor {}, {last_code}",
            sensor.name
        ));
    }
    found.into_iter().map(|what| format!("{name}: {what}")).collect()
}

/// A frame to write.
#[derive(Debug, Clone, Default, Args)]
pub struct Output {
    /// File to write, with a sidecar FILE.yaml; `-` or none for standard output. Of several frames DIR/, or a name with {stem},
    /// that of the input, {frame}, the number of the exposure, or {index}, that in the stream: {frame:05} has five digits
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Leave alone what is complete: a file whose samples are those that its sidecar describes, made by the same programs with the
    /// same options
    #[arg(long)]
    pub resume: bool,
    /// The number of the frame in its stream.
    #[arg(skip)]
    pub index: u64,
    /// What follows it.
    #[arg(skip)]
    pub following: Following,
    /// What is made of several frames.
    #[arg(skip)]
    pub makes: Makes,
    /// Format; by default that of the file's extension, or EXR; DNG for one plane of ADU alone
    #[arg(long, value_parser = values::choice::<Format>())]
    pub format: Option<Format>,
    /// Compression, without loss: rle, zips, zip, piz for EXR; lzw, deflate for TIFF; deflate for DNG of floats; none
    /// by default
    #[arg(long, value_parser = values::choice::<CompressionKind>())]
    pub compression: Option<CompressionKind>,
    /// How samples are stored: f32 or f16 in EXR, u16 or f32 in TIFF and DNG; by default f32, and u16 for codes in TIFF and
    /// DNG
    #[arg(long, value_name = "TYPE", value_parser = values::choice::<SampleKind>())]
    pub sample_type: Option<SampleKind>,
    /// Scale samples by a power of two so that image viewers show them: what is white comes into the upper half of 0 to 1 (EXR,
    /// TIFF of floats) or of 16 bits. Programs of this toolchain undo it to the bit
    #[arg(long)]
    pub viewable: bool,
}

impl Output {
    /// Whether the frame goes through a pipe.
    pub fn is_pipe(&self) -> bool {
        pipe::is_output(self.output.as_deref())
    }

    /// Whether frames go one after another to one place: the standard output, a named pipe, a device.
    pub fn is_stream(&self) -> bool {
        let takes_any = |path: &Path| std::fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir());
        named(self.output.as_deref()).is_none_or(takes_any)
    }

    /// Makes sure that one frame, made of all that come, has one place.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a directory or a pattern.
    pub fn check_one(&self) -> Result<()> {
        match named(self.output.as_deref()).filter(|path| is_pattern(path)) {
            Some(path) => {
                let problem = format!("{}: one frame is made of all; name a single file", path.display());
                Err(Error::Usage(problem).change(&["output"]))
            }
            None => Ok(()),
        }
    }

    /// Whether a file is named whose format is EXR.
    pub fn is_exr(&self) -> bool {
        let ends_so = |path: &PathBuf| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("exr"));
        self.output.as_ref().is_some_and(ends_so) && self.format.is_none_or(|format| format == Format::Exr)
    }

    /// What names end in that nobody has chosen.
    pub fn extension(&self) -> &'static str {
        self.format.unwrap_or(Format::Exr).name()
    }

    /// Where and how to write a frame of several. Where it does not tell the number of its exposure, that in the stream counts.
    pub fn options_for(&self, made: &FrameHeader) -> OutputOptions {
        let options = self.options();
        let exposure = made.metadata.noise.as_ref().map(|noise| u64::from(noise.frame));
        let file = made.metadata.file.as_deref().map(Path::new);
        let named = |path: PathBuf| match file.filter(|_| named(Some(&path)).is_some()) {
            Some(file) => output_of(&path, file, self.extension()),
            None => path,
        };
        let numbered = |path: PathBuf| numbered(&path, exposure.unwrap_or(self.index), self.index).unwrap_or(path);
        let frames_to_come = self.following.frames();
        OutputOptions { path: options.path.map(named).map(numbered), frames_to_come, ..options }
    }

    /// Where and how to write.
    pub fn options(&self) -> OutputOptions {
        OutputOptions {
            path: self.output.clone(),
            format: self.format,
            compression: self.compression,
            samples: self.sample_type,
            is_viewable: self.viewable,
            frames_to_come: 0,
        }
    }
}

/// What is made of several frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Makes {
    /// A frame of each, one behind another.
    #[default]
    Frames,
    /// A report of each, which can stand without the others.
    Reports,
    /// One thing of all, which is whole or not at all.
    One,
}

/// What is made behind a frame in the same run, as far as it is known.
#[derive(Debug, Clone, Default)]
pub struct Following {
    /// The frames of the same input.
    pub sequence: Option<Sequence>,
    /// Exposures of each scene.
    pub exposures: u64,
    /// Those of the same scene that are left.
    pub exposures_left: u64,
    /// Inputs that are left.
    pub inputs_left: u64,
}

impl Following {
    /// How many frames that is, at least.
    pub fn frames(&self) -> u64 {
        let scenes = self.sequence.as_ref().map_or(0, Sequence::to_come).saturating_add(self.inputs_left);
        scenes.saturating_mul(self.exposures).saturating_add(self.exposures_left)
    }
}

/// What light falls on which sensor.
#[derive(Debug, Clone, Args)]
pub struct Subject {
    /// Spectrum or library as CSV, spectral image as EXR, or picture in R, G, B; `-` or none for standard input
    #[arg(conflicts_with_all = ["electrons", "dark"])]
    pub input: Option<PathBuf>,
    /// The sensor.
    #[command(flatten)]
    pub sensor: SensorRequest,
}

/// A lens.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct Lens {
    /// Relative aperture
    #[arg(long, value_name = "N", default_value_t = 8.0, value_parser = values::f_number)]
    pub f_number: f64,
    /// Transmittance of the lens, 0 to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0, value_parser = values::fraction)]
    pub lens_transmittance: f64,
}

impl Lens {
    /// An exposure through this lens.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`].
    pub fn exposed(&self, exposure_s: f64) -> Result<Exposure> {
        let Self { f_number, lens_transmittance } = *self;
        Exposure { exposure_s, f_number, lens_transmittance }.checked()
    }
}

/// An exposure.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct ExposureChoice {
    /// Exposure time in s
    #[arg(id = "exposure", long, value_name = "S", default_value_t = 0.033, value_parser = values::seconds)]
    pub exposure_s: f64,
    /// The lens.
    #[command(flatten)]
    pub lens: Lens,
}

impl ExposureChoice {
    /// What was chosen.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`].
    pub fn chosen(&self) -> Result<Exposure> {
        self.lens.exposed(self.exposure_s)
    }
}

/// How strong the signal of a scene is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct SignalLevel {
    /// Choose the exposure time that puts the brightest class, on the axis, at this fraction of full well
    #[arg(long, value_name = "FRACTION", value_parser = values::filling, conflicts_with_all = ["electrons", "dark", "exposure"])]
    pub expose_to: Option<f64>,
    /// Expected electrons of R,G,B, given outright
    #[arg(long, value_name = "R,G,B", value_parser = values::electrons, allow_hyphen_values = true)]
    pub electrons: Option<[f64; 3]>,
    /// No light at all
    #[arg(long, conflicts_with = "electrons")]
    pub dark: bool,
}

impl SignalLevel {
    /// Electrons that are given outright; none of them in the dark.
    pub fn given(&self) -> Option<[f64; 3]> {
        if self.dark { Some([0.0; 3]) } else { self.electrons }
    }
}

/// Which spectrum of a file, and in which unit.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct SpectrumChoice {
    /// Unit of the radiance, such as "W m-2 sr-1 nm-1"; by default what the file says, or W cm-2 sr-1 nm-1
    #[arg(long, value_name = "UNIT", value_parser = values::radiance_unit, conflicts_with_all = ["electrons", "dark"])]
    pub radiance_unit: Option<RadianceUnit>,
    /// Column of the spectrum in a table
    #[arg(long, value_name = "NAME", conflicts_with_all = ["sample", "electrons", "dark"])]
    pub column: Option<String>,
    /// One spectrum of a library, counted from 0 (pixels row by row)
    #[arg(long, value_name = "N", conflicts_with_all = ["electrons", "dark"])]
    pub sample: Option<usize>,
}

/// How a picture in R, G, B becomes a scene.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct PictureChoice {
    /// How its samples stand for light: srgb, linear, or the power of them that it is; by default what the file says, linear
    /// for floats, srgb for integers
    #[arg(long, value_name = "srgb|linear|POWER", value_parser = values::encoding)]
    pub rgb: Option<Encoding>,
    /// Its primaries: srgb, display-p3, rec2020, adobe-rgb, acescg, aces, or x,y of R, G, B and white; by default what the
    /// file says, or srgb
    #[arg(long, value_name = "NAME|X,Y,...", value_parser = values::primaries, allow_hyphen_values = true)]
    pub primaries: Option<Primaries>,
    /// The light on the scene: d65, a, e, or a table of relative power (CSV); d65 by default
    #[arg(long, value_name = "NAME|FILE")]
    pub illuminant: Option<String>,
    /// Luminance of R = G = B = 1 in cd/m2; 1000 by default
    #[arg(long, value_name = "CD_PER_M2", value_parser = values::positive)]
    pub luminance: Option<f64>,
}

impl PictureChoice {
    /// Whether any of it was chosen.
    pub fn is_given(&self) -> bool {
        *self != Self::default()
    }
}

/// How each sample of a library is exposed.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct SampleExposureChoice {
    /// Exposure time in s of every sample; with --expose-to, the aperture is chosen instead of the time
    #[arg(id = "exposure", long, value_name = "S", value_parser = values::seconds)]
    pub exposure_s: Option<f64>,
    /// The lens.
    #[command(flatten)]
    pub lens: Lens,
    /// Expose each sample so that its brightest class fills this fraction of full well; 0.75 where no --exposure is given
    #[arg(long, value_name = "FRACTION", value_parser = values::fraction)]
    pub expose_to: Option<f64>,
}

impl SampleExposureChoice {
    /// What was chosen.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`].
    pub fn chosen(&self) -> Result<SampleExposure> {
        // A time that is chosen for each sample makes no odds.
        let base = self.lens.exposed(self.exposure_s.unwrap_or(1.0))?;
        Ok(match (self.exposure_s, self.expose_to) {
            (Some(_), None) => SampleExposure::Fixed(base),
            (Some(_), Some(fraction)) => SampleExposure::Filled { base, fraction, by: Filling::Aperture },
            (None, fraction) => {
                let fraction = fraction.unwrap_or(DEFAULT_FILLING);
                SampleExposure::Filled { base, fraction, by: Filling::Time }
            }
        })
    }
}

/// Share of full well that samples are exposed to where nothing else is said: that of the tests of [HP2005, Sec. 4.1].
const DEFAULT_FILLING: f64 = 0.75;

/// Which noise, at which temperature.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct NoiseChoice {
    /// Sources to leave out, between commas; their means stay: dcsn, dcnu, ssn, prnu, ron; row_noise,
    /// column_noise, dsnu, dsnu_row, dsnu_column, prnu_row, prnu_column, black_drift; hot_pixels, rts
    #[arg(long, value_delimiter = ',', value_name = "SOURCES", value_parser = values::choice::<Source>())]
    pub without: Vec<Source>,
    /// Temperature of the sensor in K; by default the sensor's own
    #[arg(id = "temperature", long, value_name = "K", value_parser = values::kelvin)]
    pub temperature_k: Option<f64>,
}

impl NoiseChoice {
    /// A warning of a temperature that looks like °C; next to none, which leaves out the dark signal, is meant.
    pub fn doubt(&self) -> Option<Note> {
        /// Temperatures, in K, that no silicon works at.
        const COLD_K: std::ops::Range<f64> = 2.0..70.0;
        let cold = self.temperature_k.filter(|kelvin| COLD_K.contains(kelvin))?;
        let meant = kelvin(cold);
        Some(Note::Warning(format!("a temperature of {cold} K looks like degrees Celsius, which is {meant} K")))
    }

    /// The noise of the seeds 0.
    pub fn settings(&self) -> NoiseSettings {
        NoiseSettings { without: self.without.clone(), temperature_k: self.temperature_k, ..NoiseSettings::default() }
    }
}

/// Which noise of which exposure, or none.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct DrawnNoise {
    /// Seed of the temporal noise
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u64>, conflicts_with = "clean")]
    pub seed: u64,
    /// Seed of the fixed patterns: another number, another sensor
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u64>, conflicts_with = "clean")]
    pub sensor_seed: u64,
    /// Number of the exposure: another number, other temporal noise
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u32>, conflicts_with = "clean")]
    pub frame: u32,
    /// Exposures to draw of each scene, from A to the one before B: one frame after another, each as --frame draws it
    #[arg(long, value_name = "A..B", value_parser = values::exposures, conflicts_with_all = ["clean", "frame"])]
    pub frames: Option<Range<u32>>,
    /// Which.
    #[command(flatten)]
    pub choice: NoiseChoice,
    /// Leave all sources out: the clean partner of noisy exposures, their mean, dark signal included
    #[arg(long, conflicts_with = "without")]
    pub clean: bool,
    /// How Poisson numbers are drawn: exact, or gaussian to see what that approximation costs
    #[arg(long, default_value = PoissonKind::default().name(), value_parser = values::choice::<PoissonKind>(), conflicts_with = "clean")]
    pub poisson: PoissonKind,
    /// Charge transfer efficiency: the share of a packet that each move to the output takes along, above 0 and at most 1;
    /// by default transfer is left out
    #[arg(long, value_name = "X", value_parser = values::fraction)]
    pub cte: Option<f64>,
}

impl DrawnNoise {
    /// The noise of one of the exposures, where there are several.
    pub fn settings(&self, exposure: Option<u32>) -> NoiseSettings {
        let Self { seed, sensor_seed, frame, clean, poisson, cte, .. } = *self;
        let frame = exposure.unwrap_or(frame);
        NoiseSettings { seed, sensor_seed, frame, clean, poisson, cte, ..self.choice.settings() }
    }
}

/// The white that colors refer to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct WhiteChoice {
    /// White of L*a*b*: d65, d50, e, or its X,Y,Z on the scale of the XYZ: cd/m2, or relative by a matrix that says so
    #[arg(long, default_value_t, value_name = "d65|d50|e|X,Y,Z", value_parser = values::white, allow_hyphen_values = true)]
    pub white: White,
    /// Luminance of the white d65, d50 or e in cd/m2; by default that at which the camera saturates
    #[arg(long, value_name = "CD_PER_M2", value_parser = values::positive)]
    pub white_luminance: Option<f64>,
}

impl WhiteChoice {
    /// Makes sure that a luminance is given to a white that has none of its own.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`].
    pub fn check(&self) -> Result<()> {
        match self.white {
            White::Absolute(_) if self.white_luminance.is_some() => {
                Err(Error::Usage("a white of X,Y,Z has its luminance already".into()).leave_out(&["white_luminance"]))
            }
            _ => Ok(()),
        }
    }
}
