//! How values of options are read.

use super::border::Border;
use crate::analysis::characterization::regression::Regression;
use crate::analysis::statistics::Region;
use crate::cfa::{CfaPattern, FilterArray};
use crate::color::illuminant::Illuminant;
use crate::color::rgb::{Encoding, NamedPrimaries, Primaries};
use crate::color::{White, chromaticity};
use crate::names::Named;
use crate::spectrum::{Observer, WavelengthGrid};
use crate::stages::black::Black;
use crate::stages::demosaic::Method;
use crate::units::{self, RadianceUnit};
use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use clap::{Arg, Command};
use std::ffi::OsStr;
use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;

/// A parser for a value by one of its names.
pub fn choice<T: Named>() -> impl TypedValueParser<Value = T> {
    one_of(T::ALL)
}

/// A parser for one of these values by its names.
pub fn one_of<T: Named>(values: &'static [T]) -> impl TypedValueParser<Value = T> {
    named_of(values, |_| None)
}

/// A parser for a demosaicking method; the name of a regression is told from others.
pub fn demosaicking() -> impl TypedValueParser<Value = Method> {
    named_of(Method::ALL.as_slice(), |name| {
        Regression::named(name)
            .map(|_| "that is a regression, `--regression` of fit-matrix; here a demosaicking method is wanted")
    })
}

/// A parser for a regression; the name of a demosaicking method is told from others.
pub fn regression() -> impl TypedValueParser<Value = Regression> {
    named_of(Regression::ALL.as_slice(), |name| {
        Method::named(name)
            .map(|_| "that is a demosaicking method; here a regression is wanted, and --demosaic takes the method")
    })
}

/// A parser for one of these values; `elsewhere` says of other names what they are.
fn named_of<T: Named>(
    values: &'static [T],
    elsewhere: fn(&str) -> Option<&'static str>,
) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(values.iter().flat_map(|value| value.all_names()));
    AnyCase { names, elsewhere }.try_map(|name| T::named(&name).ok_or("no value has this name"))
}

/// A parser for names that takes them in any case.
#[derive(Clone)]
struct AnyCase {
    names: PossibleValuesParser,
    /// What a name is that belongs to another option.
    elsewhere: fn(&str) -> Option<&'static str>,
}

impl TypedValueParser for AnyCase {
    type Value = String;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<String, clap::Error> {
        let known = self
            .possible_values()
            .and_then(|mut values| values.find(|known| value.eq_ignore_ascii_case(known.get_name())));
        match known {
            Some(known) => Ok(known.get_name().to_owned()),
            None => match value.to_str().and_then(self.elsewhere) {
                Some(meant) => {
                    let said = format!("{meant}; known here are {}", self.listed());
                    let refusing = StringValueParser::new().try_map(move |_| Err::<String, _>(said.clone()));
                    refusing.parse_ref(command, arg, value)
                }
                None => self.names.parse_ref(command, arg, value),
            },
        }
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        self.names.possible_values()
    }
}

impl AnyCase {
    fn listed(&self) -> String {
        let names = self.possible_values().into_iter().flatten();
        names.map(|name| name.get_name().to_owned()).collect::<Vec<_>>().join(", ")
    }
}

/// A parser for the name of an EXR file to write; other names without an extension may be devices.
pub fn exr_file() -> impl TypedValueParser<Value = PathBuf> {
    file_of_kind("exr", "end the name in .exr")
}

/// The same for the name of a PNG file.
pub fn png_file() -> impl TypedValueParser<Value = PathBuf> {
    file_of_kind("png", "end the name in .png")
}

fn file_of_kind(end: &'static str, advice: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path: PathBuf| match path.extension() {
        Some(other) if !other.eq_ignore_ascii_case(end) => Err(advice),
        _ => Ok(path),
    })
}

/// Reads numbers of exposures, `A..B`: from A to the one before B.
///
/// # Errors
///
/// What is wrong with the text, in words.
pub fn exposures(text: &str) -> Result<Range<u32>, String> {
    let wrong = || {
        let most = u32::MAX;
        format!("give the first number and the one behind the last, as in 0..100 for 0 to 99; numbers are 0 to {most}")
    };
    let (first, end) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| whole::<u32>(text).map_err(|_| wrong());
    let range = number(first)?..number(end)?;
    if range.is_empty() { Err(wrong()) } else { Ok(range) }
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

/// Reads the centers of four corner patches, `X,Y,X,Y,X,Y,X,Y`.
///
/// # Errors
///
/// What is expected, in words.
pub fn corners(text: &str) -> Result<[[f64; 2]; 4], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| number(part.trim()).ok()).collect();
    match numbers.as_deref() {
        Some([a, b, c, d, e, f, g, h]) => Ok([[*a, *b], [*c, *d], [*e, *f], [*g, *h]]),
        _ => {
            Err("give column and row of the centers of dark skin, bluish green, black and white: eight numbers".into())
        }
    }
}

/// Reads `BLACK,WHITE`, the second above the first.
///
/// # Errors
///
/// What is expected, in words.
pub fn levels(text: &str) -> Result<[f64; 2], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| number(part.trim()).ok()).collect();
    match numbers.as_deref() {
        Some([black, white]) if white > black => Ok([*black, *white]),
        _ => Err("give the black level and the white level above it, ADU".into()),
    }
}

/// Reads the temperature of a light in K, and keeps it as a light's name.
///
/// # Errors
///
/// What is expected, in words.
pub fn temperature(text: &str) -> Result<String, String> {
    let kelvin = kelvin(text)?;
    Illuminant::of_temperature(kelvin).map(|light| light.to_string())
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
    let wrong = || "give the electrons of R,G,B between commas, none below 0 or above 3.4e38".to_owned();
    let found = three_numbers(text).map_err(|_| wrong())?;
    if found.iter().all(|e| (0.0..=f64::from(f32::MAX)).contains(e)) { Ok(found) } else { Err(wrong()) }
}

/// Reads a finite number.
///
/// # Errors
///
/// What is expected, in words.
pub fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "give a number".into())
}

/// Reads a whole number that is not below zero: a seed, or the number of an exposure.
///
/// # Errors
///
/// What is expected, in words.
pub fn whole<T: FromStr + Bounded>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("give a whole number from 0 to {}", T::LARGEST))
}

/// Whole numbers and the largest of them.
pub trait Bounded {
    /// The largest.
    const LARGEST: u64;
}

impl Bounded for u64 {
    const LARGEST: u64 = u64::MAX;
}

impl Bounded for u32 {
    const LARGEST: u64 = u32::MAX as u64;
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

/// Reads a time in s.
///
/// # Errors
///
/// What is expected, in words; what a text that looks like a time says in s.
pub fn seconds(text: &str) -> Result<f64, String> {
    let hint = in_seconds(text).map_or(String::new(), |time| format!("; it looks like {time} s"));
    positive(text).map_err(|_| format!("give a time in s, above 0{hint}"))
}

/// A time that is written with its unit, or as a fraction such as `1/30`, in s.
fn in_seconds(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches("ec").to_ascii_lowercase();
    let (amount, divisor) = [("ms", 1e3), ("us", 1e6), ("µs", 1e6), ("s", 1.0), ("", 1.0)]
        .into_iter()
        .find_map(|(unit, divisor)| Some((text.strip_suffix(unit)?.trim(), divisor)))?;
    let amount = match amount.split_once('/') {
        Some((above, below)) => positive(above.trim()).ok()? / positive(below.trim()).ok()?,
        None => positive(amount).ok()?,
    };
    (amount > 0.0).then_some(amount / divisor)
}

/// Reads a relative aperture.
///
/// # Errors
///
/// What is expected, in words.
pub fn f_number(text: &str) -> Result<f64, String> {
    let lower = text.to_ascii_lowercase();
    let number = lower.strip_prefix("f/").or_else(|| lower.strip_prefix('f')).and_then(|rest| positive(rest).ok());
    let hint = number.map_or(String::new(), |n| format!("; it looks like {n}"));
    positive(text).map_err(|_| format!("give a number above 0{hint}"))
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
    let wrong = || format!("give a fraction above 0 and at most 1{}", per_cent(text));
    positive(text).ok().filter(|x| *x <= 1.0).ok_or_else(wrong)
}

/// Reads a fraction of full well, which may be more than 1.
///
/// # Errors
///
/// What is expected, in words.
pub fn filling(text: &str) -> Result<f64, String> {
    match positive(text) {
        Ok(found) if per_cent(text).is_empty() => Ok(found),
        Ok(_) | Err(_) if !per_cent(text).is_empty() => Err(format!("give a fraction of full well{}", per_cent(text))),
        other => other,
    }
}

/// What to say of a number that looks like per cent where a fraction is wanted; nothing of others.
fn per_cent(text: &str) -> String {
    let marked = text.trim().strip_suffix('%').and_then(|rest| positive(rest.trim()).ok());
    let found = marked.or_else(|| number(text).ok().filter(|x| (PER_CENT_FROM..=100.0).contains(x)));
    found.map_or(String::new(), |x| format!("; {text} looks like per cent, which is {}", hundredth(x)))
}

/// A hundredth, to twelve digits: 99.999 is 0.99999, not what binary fractions make of it.
fn hundredth(x: f64) -> f64 {
    format!("{:.11e}", x / 100.0).parse().unwrap_or(x / 100.0)
}

/// From here on a number looks like per cent; below, like a fraction that is too large.
const PER_CENT_FROM: f64 = 5.0;

/// Reads a temperature in K.
///
/// # Errors
///
/// What is expected, in words.
pub fn kelvin(text: &str) -> Result<f64, String> {
    let text = text.strip_suffix(['K', 'k']).map_or(text, str::trim_end);
    let celsius = number(text).ok().filter(|x| (-200.0..=0.0).contains(x));
    let hint =
        celsius.map_or(String::new(), |x| format!("; {x} looks like degrees Celsius, which is {} K", units::kelvin(x)));
    positive(text).map_err(|_| format!("give a temperature in K, above 0{hint}"))
}

/// Reads a black level: `auto`, `none`, or a number.
///
/// # Errors
///
/// What is expected, in words.
pub fn black(text: &str) -> Result<Black, String> {
    match text.to_ascii_lowercase().as_str() {
        "auto" => Ok(Black::Auto),
        "none" => Ok(Black::None),
        level => number(level).map(Black::Level).map_err(|_| "give auto, none or a number".into()),
    }
}

/// Reads a black level as [`black`] does, or the border that tells it: `border`, `rows` or `columns`.
///
/// # Errors
///
/// What is expected, in words.
pub fn black_or_border(text: &str) -> Result<BlackChoice, String> {
    match text.to_ascii_lowercase().as_str() {
        "border" => Ok(BlackChoice::Border(Border::Whole)),
        "rows" => Ok(BlackChoice::Border(Border::Rows)),
        "columns" => Ok(BlackChoice::Border(Border::Columns)),
        other => black(other)
            .map(BlackChoice::Known)
            .map_err(|expected| expected.replace(" or a", ", border, rows, columns or a")),
    }
}

/// A black level that is known, or is told by the masked border.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BlackChoice {
    /// One that is known.
    Known(Black),
    /// That of the border.
    Border(Border),
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

/// Reads a white: `d65`, `d50`, `e`, or X,Y,Z.
///
/// # Errors
///
/// What is expected, in words.
pub fn white(text: &str) -> Result<White, String> {
    match text.to_ascii_lowercase().as_str() {
        "d65" => Ok(White::D65),
        "d50" => Ok(White::D50),
        "e" => Ok(White::EqualEnergy),
        numbers => three_numbers(numbers)
            .map(White::Absolute)
            .map_err(|_| "give d65, d50, e, or the white's X,Y,Z between commas".into()),
    }
}

/// Reads the color of a light: an illuminant or a temperature, x,y, or X,Y,Z.
///
/// # Errors
///
/// What is expected, in words.
pub fn light(text: &str) -> Result<LightColor, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    let wrong = || "give a light such as a, d50, d65, e or 3200K, its x,y, or its X,Y,Z, all above 0".to_owned();
    match numbers.as_deref() {
        Some([x, y]) if *x > 0.0 && *y > 0.0 && x + y < 1.0 => Ok(LightColor::Chromaticity([*x, *y])),
        Some([x, y, z]) if [x, y, z].iter().all(|value| **value > 0.0) => {
            Ok(LightColor::Chromaticity(chromaticity([*x, *y, *z])))
        }
        Some([_, _, ..]) => Err(wrong()),
        _ => text.parse().map(LightColor::Illuminant).map_err(|_| wrong()),
    }
}

/// The color of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightColor {
    /// That of an illuminant.
    Illuminant(Illuminant),
    /// Its chromaticity.
    Chromaticity([f64; 2]),
}

impl LightColor {
    /// Its chromaticity for an observer.
    pub fn xy(self, observer: &Observer) -> [f64; 2] {
        match self {
            Self::Illuminant(illuminant) => illuminant.white_xy(observer),
            Self::Chromaticity(xy) => xy,
        }
    }
}

/// Reads how samples stand for light: `srgb`, `linear`, or a power of them.
///
/// # Errors
///
/// What is expected, in words.
pub fn encoding(text: &str) -> Result<Encoding, String> {
    match text.to_ascii_lowercase().as_str() {
        "srgb" => Ok(Encoding::Srgb),
        "linear" => Ok(Encoding::Linear),
        power => positive(power)
            .map(Encoding::Power)
            .map_err(|_| "give srgb, linear, or the power of the samples that light is, such as 2.2".into()),
    }
}

/// Reads primaries: a name, or x,y of R, G, B and white.
///
/// # Errors
///
/// What is expected, in words.
pub fn primaries(text: &str) -> Result<Primaries, String> {
    if let Some(known) = NamedPrimaries::named(text) {
        return Ok(known.chromaticities());
    }
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref().map(<[f64]>::as_chunks::<2>) {
        Some(([red, green, blue, white], [])) => Ok([*red, *green, *blue, *white]),
        _ => {
            let names: Vec<&str> = NamedPrimaries::ALL.iter().map(|set| set.name()).collect();
            Err(format!("give one of {}, or x,y of R, G, B and white, eight numbers", names.join(", ")))
        }
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

/// Reads a color filter array's pattern.
///
/// # Errors
///
/// What is expected, in words.
pub fn pattern(text: &str) -> Result<CfaPattern, String> {
    text.parse()
}

/// The same among filter arrays of any kind.
///
/// # Errors
///
/// What is expected, in words.
pub fn bayer(text: &str) -> Result<FilterArray, String> {
    pattern(text).map(FilterArray::from)
}

/// Reads a unit of spectral radiance.
///
/// # Errors
///
/// The units that there are.
pub fn radiance_unit(text: &str) -> Result<RadianceUnit, String> {
    RadianceUnit::parse(text).ok_or_else(|| {
        let names: Vec<String> = RadianceUnit::USUAL.iter().map(ToString::to_string).collect();
        format!("known units are {} and the like", names.join("; "))
    })
}

/// Reads wavelengths `START:END:STEP`.
///
/// # Errors
///
/// What is expected, in words.
pub fn wavelengths(text: &str) -> Result<WavelengthGrid, String> {
    let numbers: Option<Vec<f64>> = text.split(':').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([start_nm, end_nm, step_nm]) => {
            let (start_nm, end_nm, step_nm) = (*start_nm, *end_nm, *step_nm);
            let grid = WavelengthGrid { start_nm, end_nm, step_nm, ..WavelengthGrid::default() };
            grid.points().map(|_| grid).map_err(|error| error.to_string())
        }
        _ => Err(format!("give START:END:STEP in nm, such as {}", WavelengthGrid::default())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Space;
    use crate::stages::demosaic::Method;

    fn read<P: TypedValueParser>(parser: P, text: &str) -> Option<P::Value>
    where
        P::Value: Clone + Send + Sync + 'static,
    {
        let command = clap::Command::new("test")
            .arg(clap::Arg::new("value").value_parser(clap::builder::ValueParser::new(parser)));
        command.try_get_matches_from(["test", text]).ok()?.remove_one("value")
    }

    #[test]
    fn values_are_read_by_all_their_names_and_no_others() {
        for method in Method::ALL {
            for name in method.names() {
                assert_eq!(read(choice::<Method>(), name), Some(method));
            }
        }
        assert_eq!(read(choice::<Method>(), "nearest"), None);
        let some = || one_of(&[Space::Xyz, Space::Lab]);
        assert_eq!((read(some(), "lab"), read(some(), "srgb")), (Some(Space::Lab), None));
    }

    #[test]
    fn what_looks_like_another_unit_is_said_in_ours() {
        let of_time = |text: &str| seconds(text).unwrap_err();
        assert_eq!(seconds("0.033"), Ok(0.033));
        for (text, time) in
            [("33ms", "0.033"), ("33 ms", "0.033"), ("1/50", "0.02"), ("2s", "2"), ("2 sec", "2"), ("50us", "0.00005")]
        {
            assert_eq!(of_time(text), format!("give a time in s, above 0; it looks like {time} s"));
        }
        for text in ["0", "-1", "fast", "1/0", "ms"] {
            assert_eq!(of_time(text), "give a time in s, above 0");
        }
        assert_eq!(f_number("8"), Ok(8.0));
        assert_eq!(f_number("f/5.6"), Err("give a number above 0; it looks like 5.6".into()));
        let share = |text| fraction(text).unwrap_err();
        assert_eq!(
            share("99.999"),
            "give a fraction above 0 and at most 1; 99.999 looks like per cent, which is 0.99999"
        );
        assert_eq!(share("75%"), "give a fraction above 0 and at most 1; 75% looks like per cent, which is 0.75");
        assert_eq!(filling("75%"), Err("give a fraction of full well; 75% looks like per cent, which is 0.75".into()));
    }

    #[test]
    fn what_help_shows_is_read_again() {
        assert_eq!(wavelengths(&WavelengthGrid::default().to_string()), Ok(WavelengthGrid::default()));
        for chosen in [White::D65, White::EqualEnergy, White::Absolute([95.047, 1e2, 108.883])] {
            assert_eq!(white(&chosen.to_string()), Ok(chosen));
        }
    }
}
