//! Units of radiance that comments name, of which a number before one may be a value of something.

use super::other::OtherUnit;
use super::spectral::{Found, Stated, as_written, units_among};
use super::spelling::{Token, tokens};

/// The units of radiance, or of what may be taken for it, that a comment names, first to last. A power of ten before one is part of it
/// where units are told, as in `radiance in 1e-3 W m-2 sr-1 nm-1`; elsewhere it is a value: `noise floor 1e-5 W m-2 sr-1 nm-1`.
pub fn units_in(comment: &str) -> Vec<Stated> {
    let tokens = tokens(comment);
    let one = |found: &Found| {
        let is_scaled = matches!((&found.says, &tokens[found.begin]), (Stated::Radiance(_), Token::Number(_)));
        let pieces = &tokens[found.begin..found.end];
        let written = as_written(comment, pieces).filter(|_| is_scaled);
        let tells =
            written.and_then(|unit| comment.split_once(unit)).is_some_and(|(before, behind)| tells(before, behind));
        match is_scaled && !tells {
            true => {
                let plain = || pieces.iter().map(Token::shown).collect::<Vec<_>>().join(" ");
                Stated::Other { text: written.map_or_else(plain, ToOwned::to_owned), kind: OtherUnit::Scaled }
            }
            false => found.written_in(comment, &tokens),
        }
    };
    units_among(&tokens).iter().map(one).collect()
}

/// What words about values begin with.
const OF_VALUES: [&str; 22] = [
    "nois",
    "floor",
    "limit",
    "detect",
    "saturat",
    "accura",
    "uncertain",
    "precis",
    "resol",
    "maxim",
    "minim",
    "nedl",
    "nesr",
    "error",
    "thresh",
    "level",
    "sigma",
    "offset",
    "backgr",
    "peak",
    "dark",
    "full",
];
/// What stands between words for units and a unit.
const BETWEEN: [&str; 14] =
    ["of", "the", "is", "are", "spectral", "radiance", "radiances", "value", "values", "data", "l", "all", "x", "1"];

/// Whether what stands before and behind a number and its unit tells the unit of numbers elsewhere, and not a value.
fn tells(before: &str, behind: &str) -> bool {
    let [before, behind] = [before, behind].map(str::to_lowercase);
    let words = |text: &str| -> Vec<String> {
        text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(ToOwned::to_owned).collect()
    };
    let is_for_units = |word: &String| ["unit", "units"].contains(&word.as_str());
    let is_between = |word: &String| BETWEEN.contains(&word.as_str());
    let before = before.trim_end().trim_end_matches(['"', '\'', '`', '$']).trim_end();
    let words_before = words(before);
    if words_before
        .iter()
        .any(|word| ["max", "min"].contains(&word.as_str()) || OF_VALUES.iter().any(|begin| word.starts_with(begin)))
    {
        return false;
    }
    match words_before.iter().rev().find(|word| !is_between(word)) {
        Some(word) => {
            is_for_units(word) || before.ends_with(['(', '[']) || words_before.last().is_some_and(|last| last == "in")
        }
        None if words_before.is_empty() => words(&behind).iter().all(|word| is_for_units(word) || is_between(word)),
        None => before.ends_with(['(', '[']),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::RadianceUnit;

    #[test]
    fn numbers_before_units_are_told_from_values() {
        let milli = Some(Stated::Radiance(RadianceUnit::USUAL[2]));
        for comment in [
            "radiance in 1e-3 W m-2 sr-1 nm-1",
            "in units of 10^-3 W m-2 sr-1 nm-1",
            "Unit: 0.001 W m-2 sr-1 nm-1",
            "units = 1e-3 W/m2/sr/nm",
            "unit of radiance 1e-3 W m-2 sr-1 nm-1",
            "Unit: 1 x 10^-3 W m-2 sr-1 nm-1",
            "unit of spectral radiance: 10⁻³ W m⁻² sr⁻¹ nm⁻¹",
            "wavelength in nm, radiance [10^-3 W m-2 sr-1 nm-1]",
            "radiance (1E-3 W/m2/sr/nm), by me",
            "1e-3 W m-2 sr-1 nm-1",
            "(1e-3 W m-2 sr-1 nm-1)",
        ] {
            assert_eq!(units_in(comment).pop(), milli, "{comment}");
        }
        for comment in [
            "noise floor 1e-5 W m-2 sr-1 nm-1",
            "noise-equivalent radiance: 1e-5 W m-2 sr-1 nm-1",
            "noise (1e-5 W m-2 sr-1 nm-1)",
            "detection limit 0.0001 W m-2 sr-1 nm-1",
            "saturation radiance 0.1 W m-2 sr-1 nm-1",
            "NEdL = 1E-4 mW/cm2/um/sr",
            "max 0.1 W m-2 sr-1 nm-1",
            "accuracy +/- 0.001 W m-2 sr-1 nm-1",
            "step 10 nm; dark level 0.01 W m-2 sr-1 nm-1",
            "radiance 0.01 W m-2 sr-1 nm-1 at 550 nm",
            "radiance = 0.01 W m-2 sr-1 nm-1",
            "1e-2 W m-2 sr-1 nm-1 full scale",
            "0.01 W m-2 sr-1 nm-1 were seen",
        ] {
            let found = units_in(comment);
            let is_value = matches!(found.as_slice(), [Stated::Other { kind: OtherUnit::Scaled, .. }]);
            assert!(is_value, "{comment}: {found:?}");
        }
    }

    #[test]
    fn units_over_what_an_instrument_reads_are_none_of_radiance() {
        use crate::units::unit_of_heading;
        for unit in [
            "W m-2 sr-1 nm-1 / count",
            "W m-2 sr-1 nm-1 count-1",
            "mW/m2/sr/nm/DN",
            "uW cm-2 sr-1 nm-1 per ADU",
            "(W m-2 sr-1 nm-1)/V",
            "W m-2 sr-1 nm-1 V-1",
        ] {
            for found in [
                units_in(&format!("raw counts; calibration in {unit}")).pop(),
                unit_of_heading(&format!("calibration ({unit})")),
                unit_of_heading(unit),
            ] {
                assert!(matches!(found, Some(Stated::Other { kind: OtherUnit::PerReading, .. })), "{unit}: {found:?}");
            }
        }
        let found = unit_of_heading("R (counts/(W m-2 sr-1 nm-1))");
        assert!(matches!(found, Some(Stated::Other { kind: OtherUnit::Responsivity, .. })), "{found:?}");
        let found = unit_of_heading("gain (W/(m2 sr nm count))");
        assert!(matches!(found, Some(Stated::Other { kind: OtherUnit::PerReading, .. })), "{found:?}");
        for comment in ["nm W/m2/sr/nm DN", "radiance W m-2 sr-1 nm-1, counts DN", "L/(W m-2 sr-1 nm-1)"] {
            assert!(matches!(units_in(comment).as_slice(), [Stated::Radiance(_)]), "{comment}");
        }
    }
}
