//! Options that programs share, and how their values are read.

use crate::analysis::characterization::evaluation::{self, Filling};
use crate::analysis::characterization::regression::Regression;
use crate::analysis::statistics::Region;
use crate::camera::optics::Exposure;
use crate::cfa::CfaPattern;
use crate::color::White;
use crate::formats::data;
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::output::{CompressionKind, Format, OutputOptions, SampleKind};
use crate::formats::pipe;
use crate::random::Source;
use crate::stages::black::Black;
use crate::stages::demosaic::Method;
use crate::units::RadianceUnit;
use clap::Args;
use clap::builder::{OsStringValueParser, PathBufValueParser, PossibleValuesParser, TypedValueParser};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The demosaicking methods by their short and long names.
pub const METHODS: [(&str, Method); 8] = [
    ("bi", Method::Bilinear),
    ("bilinear", Method::Bilinear),
    ("shti", Method::SmoothHue),
    ("smooth-hue", Method::SmoothHue),
    ("eci", Method::EffectiveColor),
    ("effective-color", Method::EffectiveColor),
    ("mhc", Method::Malvar),
    ("malvar", Method::Malvar),
];

/// The regressions by their names.
pub const REGRESSIONS: [(&str, Regression); 4] = [
    ("sky-rad-ls", Regression::SkyRadLs),
    ("sky-rad-sppls", Regression::SkyRadSppls),
    ("max-ign-sppls", Regression::MaxIgnSppls),
    ("max-ign-positive-sppls", Regression::MaxIgnPositiveSppls),
];

/// The sources of noise by their names.
pub const SOURCES: [(&str, Source); 5] = [
    ("dcsn", Source::Dcsn),
    ("dcnu", Source::Dcnu),
    ("ssn", Source::Ssn),
    ("prnu", Source::Prnu),
    ("ron", Source::Ron),
];

/// A parser for one of a few words.
pub fn choice<T: Copy + Send + Sync + 'static>(
    words: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(words.iter().map(|(word, _)| *word)).map(move |word| {
        // The parser lets only these words through; the first stands in for what cannot be.
        words.iter().find(|(known, _)| *known == word).map_or(words[0].1, |(_, value)| *value)
    })
}

/// A frame to read.
#[derive(Debug, Clone, Args)]
pub struct Input {
    /// Frame to read, EXR or TIFF; `-` or none for standard input
    pub input: Option<PathBuf>,
    /// Part of a multi-part EXR, or page of a TIFF, counted from 0
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true)]
    pub part: usize,
    /// YAML file whose metadata replace those that come with the input
    #[arg(long, value_name = "FILE")]
    pub metadata: Option<PathBuf>,
}

impl Input {
    /// Whether the frame comes through a pipe.
    pub fn is_pipe(&self) -> bool {
        pipe::is_input(self.input.as_deref())
    }

    /// What to open; channels besides R, G, B or Y are left out.
    pub fn options(&self) -> InputOptions {
        InputOptions { path: self.input.clone(), part: self.part, metadata: self.metadata.clone(), all_channels: false }
    }
}

/// A sensor that counts instead of the one in the frame's metadata.
#[derive(Debug, Clone, Args)]
pub struct SensorChoice {
    /// Sensor, for a frame whose metadata names none, or another than it names
    #[arg(long, value_name = "NAME|FILE")]
    pub sensor: Option<String>,
}

impl SensorChoice {
    /// Puts the sensor, if one was chosen, into the metadata of a frame.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_sensor`].
    pub fn apply(&self, reader: &mut FrameReader) -> crate::error::Result<()> {
        if let Some(sensor) = &self.sensor {
            reader.header_mut().metadata.sensor = Some(data::load_sensor(sensor)?.sensor);
        }
        Ok(())
    }
}

/// A frame to write.
#[derive(Debug, Clone, Args)]
pub struct Output {
    /// File to write, with a sidecar FILE.yaml; `-` or none for standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Format; by default that of the file's extension, or EXR
    #[arg(long, value_parser = choice(&[("exr", Format::Exr), ("tiff", Format::Tiff)]))]
    pub format: Option<Format>,
    /// Compression, without loss: rle, zips, zip, piz for EXR; lzw, deflate for TIFF; none by default
    #[arg(long, value_parser = choice(&CompressionKind::NAMES))]
    pub compression: Option<CompressionKind>,
    /// How samples are stored: f32 or f16 in EXR, u16 or f32 in TIFF; by default f32, and u16 for codes in TIFF
    #[arg(long, value_name = "TYPE", value_parser = choice(&[("f32", SampleKind::F32), ("f16", SampleKind::F16), ("u16", SampleKind::U16)]))]
    pub sample_type: Option<SampleKind>,
}

impl Output {
    /// Whether the frame goes through a pipe.
    pub fn is_pipe(&self) -> bool {
        pipe::is_output(self.output.as_deref())
    }

    /// Where and how to write.
    pub fn options(&self) -> OutputOptions {
        OutputOptions {
            path: self.output.clone(),
            format: self.format,
            compression: self.compression,
            samples: self.sample_type,
        }
    }
}

/// When to show a progress bar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProgressWhen {
    /// On terminals.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// How each sample of a library is exposed.
#[derive(Debug, Clone, Copy, Args)]
pub struct SampleExposure {
    /// Exposure time in s of every sample; with --expose-to, the aperture is chosen instead of the time
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    pub exposure: Option<f64>,
    /// Relative aperture
    #[arg(long, value_name = "N", default_value_t = 8.0, value_parser = positive, allow_negative_numbers = true)]
    pub f_number: f64,
    /// Transmittance of the lens, 0 to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0, value_parser = fraction, allow_negative_numbers = true)]
    pub lens_transmittance: f64,
    /// Expose each sample so that its brightest class fills this fraction of full well; 0.75 where no --exposure is given
    #[arg(long, value_name = "FRACTION", value_parser = fraction, allow_negative_numbers = true)]
    pub expose_to: Option<f64>,
}

impl SampleExposure {
    /// What was chosen.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`].
    pub fn chosen(&self) -> crate::error::Result<evaluation::SampleExposure> {
        // A time that is chosen for each sample makes no odds.
        let base = Exposure {
            exposure_s: self.exposure.unwrap_or(1.0),
            f_number: self.f_number,
            lens_transmittance: self.lens_transmittance,
        }
        .checked()?;
        Ok(match (self.exposure, self.expose_to) {
            (Some(_), None) => evaluation::SampleExposure::Fixed(base),
            (Some(_), Some(fraction)) => evaluation::SampleExposure::Filled { base, fraction, by: Filling::Aperture },
            (None, fraction) => {
                let fraction = fraction.unwrap_or(DEFAULT_FILLING);
                evaluation::SampleExposure::Filled { base, fraction, by: Filling::Time }
            }
        })
    }
}

/// Share of full well that samples are exposed to where nothing else is said: that of the tests of [HP2005, Sec. 4.1].
const DEFAULT_FILLING: f64 = 0.75;

/// How the program runs and talks.
#[derive(Debug, Clone, Args)]
pub struct General {
    /// Threads to use; by default one where frames come or go through a pipe, as each program of a pipeline has its own, and
    /// otherwise all. The result does not depend on it
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Whether frames come or go through a pipe.
    #[arg(skip)]
    pub pipeline: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Say what is read, and what is left out
    #[arg(short, long)]
    pub verbose: bool,
    /// Progress bar on standard error
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = choice(&[("auto", ProgressWhen::Auto), ("always", ProgressWhen::Always), ("never", ProgressWhen::Never)]))]
    pub progress: ProgressWhen,
}

impl General {
    /// The same for a program that makes a frame of a frame.
    pub fn between(&self, input: &Input, output: &Output) -> Self {
        self.clone().in_pipeline(input.is_pipe() || output.is_pipe())
    }

    /// The same for a program whose frames come or go through a pipe, or do not.
    pub fn in_pipeline(self, pipeline: bool) -> Self {
        Self { pipeline, ..self }
    }
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(threads @ 1..=1024) => Ok(threads),
        _ => Err("give a whole number from 1 to 1024".into()),
    }
}

/// A frame to read, or a color given as numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameOrColor {
    /// A file, or `-`.
    Frame(PathBuf),
    /// Three numbers.
    Color([f64; 3]),
}

impl FrameOrColor {
    /// The file of a frame.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Frame(path) => Some(path),
            Self::Color(_) => None,
        }
    }

    /// Whether it is a frame that comes through a pipe.
    pub fn is_pipe(&self) -> bool {
        self.path().is_some_and(|path| pipe::is_input(Some(path)))
    }

    /// Whether the frame comes through the standard input.
    pub fn is_standard_input(&self) -> bool {
        *self == Self::Frame("-".into())
    }
}

/// A parser for a file or a color: what exists is a file.
pub fn frame_or_color() -> impl TypedValueParser<Value = FrameOrColor> {
    OsStringValueParser::new().try_map(|text: OsString| -> Result<FrameOrColor, String> {
        let path = PathBuf::from(&text);
        let text = text.to_string_lossy();
        if text == "-" || path.exists() {
            return Ok(FrameOrColor::Frame(path));
        }
        if let Ok(color) = three_numbers(&text) {
            return Ok(FrameOrColor::Color(color));
        }
        let is_word = |part: &str| part.trim().parse::<f64>().is_err();
        if text.starts_with('-') || !text.split(',').all(is_word) {
            return Err("it is no option, no file, and no color, which is three numbers between commas".into());
        }
        Ok(FrameOrColor::Frame(path))
    })
}

/// A parser for the name of an EXR file to write; other names without an extension may be devices.
pub fn exr_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path: PathBuf| match path.extension() {
        Some(end) if !end.eq_ignore_ascii_case("exr") => Err("end the name in .exr"),
        _ => Ok(path),
    })
}

/// Reads `WIDTHxHEIGHT`, both at least 1.
///
/// # Errors
///
/// What is expected, in words.
pub fn size(text: &str) -> Result<[usize; 2], String> {
    let parse = |part: &str| part.parse::<usize>().ok().filter(|n| (1..=i32::MAX as usize).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(width, height)| Some([parse(width)?, parse(height)?]))
        .ok_or_else(|| "a size is WIDTHxHEIGHT in photosites, such as 1332x1000".into())
}

/// Reads finite numbers between commas.
///
/// # Errors
///
/// What is expected, in words.
pub fn three_numbers(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> =
        text.split(',').filter_map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match (numbers.as_slice(), text.split(',').count()) {
        ([a, b, c], 3) => Ok([*a, *b, *c]),
        _ => Err("give three numbers between commas".into()),
    }
}

/// Reads expected electrons `R,G,B`, none below zero.
///
/// # Errors
///
/// What is expected, in words.
pub fn electrons(text: &str) -> Result<[f64; 3], String> {
    let wrong = || "give the electrons of R,G,B between commas, none below 0".to_owned();
    let found = three_numbers(text).map_err(|_| wrong())?;
    if found.iter().all(|e| *e >= 0.0) { Ok(found) } else { Err(wrong()) }
}

/// Reads a finite number.
///
/// # Errors
///
/// What is expected, in words.
pub fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "give a number".into())
}

/// Reads a number above zero.
///
/// # Errors
///
/// What is expected, in words.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|x| *x > 0.0).ok_or_else(|| "give a number above 0".into())
}

/// Reads a number that is not below zero.
///
/// # Errors
///
/// What is expected, in words.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|x| *x >= 0.0).ok_or_else(|| "give a number that is not below 0".into())
}

/// Reads the size of a patch, `WIDTHxHEIGHT`, at least 2 pixels and at most 1024 on a side.
///
/// # Errors
///
/// What is expected, in words.
pub fn patch(text: &str) -> Result<[usize; 2], String> {
    let wrong = || "a patch is WIDTHxHEIGHT in pixels, from 2x2 to 1024x1024".to_owned();
    size(text).ok().filter(|size| size.iter().all(|side| (2..=1024).contains(side))).ok_or_else(wrong)
}

/// Reads a fraction above 0 and at most 1.
///
/// # Errors
///
/// What is expected, in words.
pub fn fraction(text: &str) -> Result<f64, String> {
    positive(text).ok().filter(|x| *x <= 1.0).ok_or_else(|| "give a fraction above 0 and at most 1".into())
}

/// Reads a black level: `auto`, `none`, or a number.
///
/// # Errors
///
/// What is expected, in words.
pub fn black(text: &str) -> Result<Black, String> {
    match text {
        "auto" => Ok(Black::Auto),
        "none" => Ok(Black::None),
        level => number(level).map(Black::Level).map_err(|_| "give auto, none or a number".into()),
    }
}

/// Reads a region `X,Y,W,H`.
///
/// # Errors
///
/// What is expected, in words.
pub fn region(text: &str) -> Result<Region, String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([x, y, width, height]) => Ok(Region { x: *x, y: *y, width: *width, height: *height }),
        _ => Err("a region is X,Y,W,H in pixels, counted from the frame's corner".into()),
    }
}

/// Reads a white: `d65`, `e`, or absolute X,Y,Z.
///
/// # Errors
///
/// What is expected, in words.
pub fn white(text: &str) -> Result<White, String> {
    match text {
        "d65" => Ok(White::D65),
        "e" => Ok(White::EqualEnergy),
        numbers => three_numbers(numbers)
            .map(White::Absolute)
            .map_err(|_| "give d65, e, or the white's X,Y,Z between commas".into()),
    }
}

/// Reads a column and row of the sensor, `X,Y`.
///
/// # Errors
///
/// What is expected, in words.
pub fn place(text: &str) -> Result<[i64; 2], String> {
    let numbers: Option<Vec<i64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([x, y]) => Ok([*x, *y]),
        _ => Err("give the column and row X,Y of the sensor".into()),
    }
}

/// Reads a colour filter array's pattern.
///
/// # Errors
///
/// What is expected, in words.
pub fn pattern(text: &str) -> Result<CfaPattern, String> {
    text.parse()
}

/// Reads a unit of spectral radiance.
///
/// # Errors
///
/// The units that there are.
pub fn radiance_unit(text: &str) -> Result<RadianceUnit, String> {
    RadianceUnit::parse(text).ok_or_else(|| {
        let names: Vec<&str> = RadianceUnit::ALL.into_iter().map(RadianceUnit::name).collect();
        format!("known units are {}", names.join("; "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_is_a_file_or_a_color() {
        let read = |text: &str| {
            let command = clap::Command::new("test")
                .arg(clap::Arg::new("side").value_parser(frame_or_color()).allow_hyphen_values(true));
            let matches = command.try_get_matches_from(["test", text]).ok()?;
            matches.get_one::<FrameOrColor>("side").cloned()
        };
        assert_eq!(read("-1.5, 2e1,-3"), Some(FrameOrColor::Color([-1.5, 20.0, -3.0])));
        assert_eq!(read("-").map(|side| side.is_standard_input()), Some(true));
        assert_eq!(read("Cargo.toml"), Some(FrameOrColor::Frame("Cargo.toml".into())));
        // What looks like no color may be a file that is missing; its reader says so.
        assert_eq!(read("sky,blue.exr"), Some(FrameOrColor::Frame("sky,blue.exr".into())));
        for wrong in ["1,2", "1,2,3,4", "1,2,x", "inf,1,2", "--spac", "-x"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }
}
