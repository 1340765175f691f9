//! How values of options are read.

mod light;
mod named;
mod numbers;
mod places;

pub use light::{LightColor, encoding, light, primaries, radiance_unit, temperature, wavelengths, white};
pub use named::{choice, demosaicking, one_of, regression};
pub use numbers::{
    Bounded, electrons, exposures, f_number, filling, fraction, kelvin, levels, not_negative, number, positive,
    seconds, three_numbers, whole,
};
pub use places::{corners, patch, place, region, size};

use self::numbers::finite_list;
use super::border::Border;
use crate::camera::levels::BlackLevel;
use crate::cfa::{CfaPattern, FilterArray};
use crate::stages::black::Black;
use clap::builder::{PathBufValueParser, TypedValueParser};
use std::path::PathBuf;

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

/// Reads a black level: a number, or four between commas, of the 2×2 sites row by row.
///
/// # Errors
///
/// What is expected, in words.
pub fn black_level(text: &str) -> Result<BlackLevel, String> {
    match finite_list(text).as_deref() {
        Some([level]) => Ok(BlackLevel::Uniform(*level)),
        Some([a, b, c, d]) => Ok(BlackLevel::Sites([*a, *b, *c, *d])),
        _ => Err("give a number, or four between commas for the 2x2 sites row by row".into()),
    }
}

/// Reads a black level: `auto`, `none`, or a number, or four by site.
///
/// # Errors
///
/// What is expected, in words.
pub fn black(text: &str) -> Result<Black, String> {
    match text.to_ascii_lowercase().as_str() {
        "auto" => Ok(Black::Auto),
        "none" => Ok(Black::None),
        level => {
            black_level(level).map(Black::Level).map_err(|_| "give auto, none, a number, or four between commas".into())
        }
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
            .map_err(|expected| expected.replace("none, ", "none, border, rows, columns, ")),
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
