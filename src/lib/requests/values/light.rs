//! Light and color: wavelengths, units of radiance, illuminants, whites and primaries.

use super::numbers::{finite_list, kelvin, list, positive, three_numbers};
use crate::color::illuminant::Illuminant;
use crate::color::rgb::{Encoding, NamedPrimaries, Primaries};
use crate::color::{White, chromaticity};
use crate::names::Named;
use crate::spectrum::{Observer, WavelengthGrid};
use crate::units::{OtherUnit, RadianceUnit, Stated, unit_of_heading};

/// Reads the temperature of a light in K, and keeps it as a light's name.
///
/// # Errors
///
/// What is expected, in words.
pub fn temperature(text: &str) -> Result<String, String> {
    let kelvin = kelvin(text)?;
    Illuminant::of_temperature(kelvin).map(|light| light.to_string())
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
    let wrong = || "give a light such as a, d50, d65, e or 3200K, its x,y, or its X,Y,Z, all above 0".to_owned();
    match finite_list(text).as_deref() {
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
    match list(text, ',').as_deref().map(<[f64]>::as_chunks::<2>) {
        Some(([red, green, blue, white], [])) => Ok([*red, *green, *blue, *white]),
        _ => {
            let names: Vec<&str> = NamedPrimaries::ALL.iter().map(|set| set.name()).collect();
            Err(format!("give one of {}, or x,y of R, G, B and white, eight numbers", names.join(", ")))
        }
    }
}

/// Reads a unit of spectral radiance.
///
/// # Errors
///
/// The units that there are.
pub fn radiance_unit(text: &str) -> Result<RadianceUnit, String> {
    RadianceUnit::parse(text).ok_or_else(|| {
        let names: Vec<String> = RadianceUnit::USUAL.iter().map(ToString::to_string).collect();
        let found = unit_of_heading(text).or_else(|| unit_of_heading(&format!("({text})")));
        let what = match found {
            Some(Stated::Other { kind, .. }) if kind != OtherUnit::Unknown => format!("that is {}; ", kind.in_words()),
            _ => String::new(),
        };
        format!("{what}known units are {} and the like", names.join("; "))
    })
}

/// Reads wavelengths `START:END:STEP`.
///
/// # Errors
///
/// What is expected, in words.
pub fn wavelengths(text: &str) -> Result<WavelengthGrid, String> {
    match list(text, ':').as_deref() {
        Some(&[start_nm, end_nm, step_nm]) => {
            let grid = WavelengthGrid { start_nm, end_nm, step_nm, ..WavelengthGrid::default() };
            grid.points().map(|_| grid).map_err(|error| error.to_string())
        }
        _ => Err(format!("give START:END:STEP in nm, such as {}", WavelengthGrid::default())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_something_else_are_told() {
        let said = |text: &str| radiance_unit(text).unwrap_err();
        assert!(said("W m-2 nm-1").starts_with("that is an irradiance, which has no sr-1; known units are W cm-2"));
        assert!(said("W cm-2 sr-1 cm-1").contains("per cm-1 of wavenumber is `/ cm-1`"));
        assert!(said("bananas").starts_with("known units are "));
        assert!(
            said("a.u.").starts_with("that is of no scale, which does not tell how bright the light is; known units")
        );
        assert!(said("%").starts_with("that is a ratio"));
    }

    #[test]
    fn what_help_shows_is_read_again() {
        assert_eq!(wavelengths(&WavelengthGrid::default().to_string()), Ok(WavelengthGrid::default()));
        for chosen in [White::D65, White::EqualEnergy, White::Absolute([95.047, 1e2, 108.883])] {
            assert_eq!(white(&chosen.to_string()), Ok(chosen));
        }
    }
}
