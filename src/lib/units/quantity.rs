//! Names and units of quantities that are no spectral radiance, by their words: `brightness temperature`, `Rrs`, `A/W`, `per band`.

use super::other::OtherUnit;
use super::spelling::{Base, Token, base, tokens};

/// Whether one of some words stands in a heading.
pub(super) fn names(heading: &str, words: &[&str]) -> bool {
    tokens(heading).iter().filter_map(Token::lower).any(|word| words.contains(&word.as_str()))
}

/// Units of what an instrument reads.
pub(super) const READINGS: [&str; 10] = ["counts", "count", "cts", "dn", "adu", "v", "mv", "uv", "volt", "volts"];

/// Whether a word is such a unit.
pub(super) fn is_reading(word: &str) -> bool {
    READINGS.contains(&word.to_lowercase().as_str())
}

/// Units of flux per frequency.
pub(super) const JANSKYS: [&str; 6] = ["jy", "mjy", "kjy", "ujy", "jansky", "janskys"];

/// What the name of a quantity is that is no light, or that of no direction.
pub(super) fn quantity_named(text: &str) -> Option<OtherUnit> {
    const ARCSECONDS: [&str; 4] = ["arcsec", "arcsecond", "arcseconds", "asec"];
    let words: Vec<String> = tokens(text).iter().filter_map(Token::lower).collect();
    let has = |wanted: &[&str]| words.iter().any(|word| wanted.contains(&word.as_str()));
    let has_pair = |first: &str, second: &[&str]| {
        words.windows(2).any(|pair| pair[0] == first && second.contains(&pair[1].as_str()))
    };
    // `optical depth 0.3`, `emissivity 0.98` may be names of spectra.
    let is_name = text.contains(|c: char| c.is_ascii_digit());
    if has(&["mag", "mags", "magnitude", "magnitudes"]) && has(&ARCSECONDS) {
        Some(OtherUnit::Magnitude)
    } else if has(&["responsivity", "responsivities"]) {
        Some(OtherUnit::Responsivity)
    } else if has(&["rrs", "brdf"]) || has_pair("sensing", &["reflectance", "reflectances"]) {
        Some(OtherUnit::PerIrradiance)
    } else if !is_name && has(&["emissivity", "emissivities"]) {
        Some(OtherUnit::Emissivity)
    } else if has(&["actinic"]) {
        Some(OtherUnit::Mean)
    } else if has(&["pfd", "ppfd"]) {
        Some(OtherUnit::Photons)
    } else if has(&["absorbance", "absorbances"]) {
        Some(OtherUnit::Depth)
    } else if !is_name && has(&["temperature", "temperatures"]) {
        Some(OtherUnit::Temperature)
    } else if !is_name && (has(&["aod", "aot"]) || has_pair("optical", &["depth", "depths", "thickness", "density"])) {
        Some(OtherUnit::Depth)
    } else {
        None
    }
}

/// What a unit is by the pieces that it has, whose names are those of nothing else.
pub(super) fn by_spelling(text: &str) -> Option<OtherUnit> {
    const CURRENTS: [&str; 8] = ["a", "ma", "ua", "na", "amp", "amps", "ampere", "amperes"];
    const ANGLES: [&str; 7] = ["arcsec", "arcsecond", "arcseconds", "arcmin", "deg", "degree", "degrees"];
    let tokens = tokens(text);
    let is_power_of = |word: &str| matches!(base(word), Some(Base::Power(_)));
    let is_current = |word: &str| CURRENTS.contains(&word.to_lowercase().as_str());
    let is_responsivity = match tokens.as_slice() {
        [Token::Factor { word, exponent: None }, Token::Per, Token::Factor { word: by, exponent: None }]
        | [Token::Factor { word, exponent: None }, Token::Factor { word: by, exponent: Some(-1) }] => {
            is_current(word) && is_power_of(by)
        }
        _ => false,
    };
    let is_of_angle = |token: &Token| match token {
        Token::Factor { word, exponent: Some(-2 | 2) } => ANGLES.contains(&word.to_lowercase().as_str()),
        _ => false,
    };
    let is_megawatt = |token: &Token| matches!(token, Token::Factor { word, .. } if word == "MW");
    let is_band = |token: &Token| token.lower().is_some_and(|word| INTERVALS.contains(&word.as_str()));
    let is_per = |token: &Token| *token == Token::Per;
    let mut behind_stroke = tokens.iter().skip_while(|token| !is_per(token));
    let is_inverse_sr = match tokens.as_slice() {
        [Token::Factor { word, exponent: Some(-1) }] | [Token::Per, Token::Factor { word, exponent: None }] => {
            base(word) == Some(Base::SolidAngle)
        }
        _ => false,
    };
    Some(match text.trim() {
        "K" | "kelvin" | "Kelvin" => OtherUnit::Temperature,
        "OD" => OtherUnit::Depth,
        _ if is_responsivity => OtherUnit::Responsivity,
        _ if is_inverse_sr => OtherUnit::PerIrradiance,
        _ if tokens.iter().any(is_megawatt) => OtherUnit::Megawatt,
        _ if names(text, &JANSKYS) => OtherUnit::PerFrequency,
        _ if tokens.iter().any(is_of_angle) => OtherUnit::OtherAngle,
        _ if behind_stroke.any(is_band) => OtherUnit::AllWavelengths,
        _ => return None,
    })
}

/// Words for parts of a spectrum of no width that is said.
const INTERVALS: [&str; 6] = ["band", "bands", "bin", "bins", "channel", "interval"];

/// Whether a text says that values are per part of a spectrum, beside a unit that says per what: `per band`, `/bin`, `per 5 nm`.
pub(super) fn is_per_interval(text: &str) -> bool {
    let lower = text.to_lowercase();
    let behind_per = |text: &str, is_so: fn(&str) -> bool| {
        let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        words.windows(2).any(|pair| pair[0] == "per" && is_so(pair[1]))
    };
    let is_number = |word: &str| word.starts_with(|c: char| c.is_ascii_digit()) && !["1", "1nm"].contains(&word);
    behind_per(&lower, is_number) || behind_per(&lower.replace('/', " per "), |word| INTERVALS.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{Stated, unit_of_heading};

    #[test]
    fn quantities_that_are_no_radiance_are_told() {
        use OtherUnit::{
            AllWavelengths, Depth, Emissivity, Intensity, Irradiance, Magnitude, Mean, OtherAngle, PerFrequency,
            PerIrradiance, Photons, Power, Ratio, Responsivity, Temperature,
        };
        for (text, kind) in [
            ("Rrs (sr-1)", PerIrradiance),
            ("Rrs", PerIrradiance),
            ("x (1/sr)", PerIrradiance),
            ("brightness temperature (K)", Temperature),
            ("brightness temperature", Temperature),
            ("uu [K]", Temperature),
            ("sky brightness (mag/arcsec2)", Magnitude),
            ("sky brightness mag/arcsec2", Magnitude),
            ("emissivity", Emissivity),
            ("aerosol optical depth", Depth),
            ("AOD", Depth),
            ("optical density", Depth),
            ("absorbance", Depth),
            ("absorptance", Ratio),
            ("actinic flux", Mean),
            ("actinic flux (W m-2 nm-1)", Irradiance),
            ("spectral intensity (W/sr/nm)", Intensity),
            ("W sr-1 nm-1", Intensity),
            ("spectral flux (W/nm)", Power),
            ("radiant exitance", Irradiance),
            ("R (A/W)", Responsivity),
            ("R [mA W-1]", Responsivity),
            ("responsivity", Responsivity),
            ("sky (Jy/sr)", PerFrequency),
            ("MJy/sr", PerFrequency),
            ("radiance (W/m2/deg2/nm)", OtherAngle),
            ("radiance (W m-2 arcsec-2 nm-1)", OtherAngle),
            ("radiance (W/(m2 sr bin))", AllWavelengths),
            ("relative photon flux", Photons),
            ("PFD", Photons),
        ] {
            let found = unit_of_heading(text);
            assert!(matches!(&found, Some(Stated::Other { kind: found, .. }) if *found == kind), "{text}: {found:?}");
        }
        for text in
            ["optical depth 0.3", "emissivity 0.98", "temperature 5000", "K", "OD", "A", "deg 45", "no absorption"]
        {
            assert_eq!(unit_of_heading(text), None, "{text}");
        }
    }

    #[test]
    fn values_per_part_of_a_spectrum_are_told() {
        for text in [
            "radiance (W m-2 sr-1 nm-1 per band)",
            "radiance (W/m2/sr/nm) per 5 nm",
            "radiance (W m-2 sr-1 nm-1)/bin",
            "L W m-2 sr-1 nm-1 per band",
        ] {
            let found = unit_of_heading(text);
            let is_told = matches!(found, Some(Stated::Other { kind: OtherUnit::BesideFactor, .. }));
            assert!(is_told, "{text}: {found:?}");
        }
        for text in [
            "radiance (watts per square meter per steradian per nanometer)",
            "radiance (W m-2 sr-1 nm-1), band 5",
            "spectral_radiance_w_per_m2_sr_nm",
        ] {
            assert!(matches!(unit_of_heading(text), Some(Stated::Radiance(_))), "{text}");
        }
    }
}
