//! Numbers of files with their units behind them, in the unit of the key that they stand at.

use super::{kelvin, of_per_cent};
use crate::text::in_decimals;

/// How other units of a kind become that of its keys.
type Units = &'static [(&'static [&'static str], f64)];

/// What a key ends in, the unit that its numbers are in, and the units that are written there, with what they are of it.
const KINDS: [(&str, &str, Units); 15] = [
    (
        "_na_per_cm2",
        "nA/cm2",
        &[
            (&["nA/cm2", "nA", "nAcm-2", "nApercm2"], 1.0),
            (&["pA/cm2", "pA", "pAcm-2", "pApercm2"], 1e-3),
            (&["uA/cm2", "uA", "uAcm-2", "uApercm2"], 1e3),
        ],
    ),
    (
        "_e_per_s",
        "e-/s",
        &[
            (&["e-/s", "e/s", "e-/s/px", "e/s/px", "e-/px/s", "e/px/s", "e-/pixel/s", "e/pixel/s", "e-s-1"], 1.0),
            (&["e-/min", "e/min"], 1.0 / 60.0),
            (&["e-/h", "e/h", "e-/px/h", "e/px/h"], 1.0 / 3600.0),
        ],
    ),
    ("e_per_adu", "e-/ADU", &[(&["e-/ADU", "e/ADU", "e-/DN", "e/DN"], 1.0)]),
    ("adu_per_e", "ADU/e-", &[(&["ADU/e-", "ADU/e", "DN/e-", "DN/e"], 1.0)]),
    ("_um", "um", &[(&["um", "micron", "microns"], 1.0), (&["nm"], 1e-3), (&["mm"], 1e3), (&["m"], 1e6)]),
    ("_nm", "nm", &[(&["nm"], 1.0), (&["um", "micron", "microns"], 1e3), (&["angstrom", "Å"], 0.1)]),
    ("_mm", "mm", &[(&["mm"], 1.0), (&["um"], 1e-3), (&["cm"], 10.0), (&["m"], 1e3)]),
    (
        "_e",
        "e-",
        &[(&["e-", "e", "electrons", "electron"], 1.0), (&["ke-", "ke", "k"], 1e3), (&["Me-", "Me", "M"], 1e6)],
    ),
    ("_adu", "ADU", &[(&["ADU", "DN", "counts", "LSB"], 1.0), (&["k", "kADU", "kDN"], 1e3)]),
    (
        "_s",
        "s",
        &[
            (&["s", "sec", "seconds"], 1.0),
            (&["ms", "msec"], 1e-3),
            (&["us", "usec"], 1e-6),
            (&["ns"], 1e-9),
            (&["min"], 60.0),
            (&["h"], 3600.0),
        ],
    ),
    ("_k", "K", &[(&["K", "kelvin"], 1.0)]),
    ("bits", "bits", &[(&["bits", "bit", "b"], 1.0)]),
    ("width", "photosites", PHOTOSITES),
    ("height", "photosites", PHOTOSITES),
    ("lens_transmittance", "1", FRACTIONS),
];

const PHOTOSITES: Units = &[(&["px", "pixels", "pixel", "photosites"], 1.0)];
const FRACTIONS: Units = &[(&["percent", "per cent", "pct"], 0.01), (&["permille", "‰"], 1e-3), (&["ppm"], 1e-6)];

/// Words of keys whose numbers are fractions of 1.
const OF_ONE: [&str; 6] = ["prnu", "dcnu", "share", "blooming", "quantum_efficiency", "cte"];

/// The unit of a key's numbers, by its name without those of the keys around it, and other units; none of a key without.
fn kind(key: &str) -> Option<(&'static str, Units)> {
    let of_name = KINDS.iter().find(|(end, ..)| key.ends_with(end)).map(|(_, unit, others)| (*unit, *others));
    of_name.or_else(|| OF_ONE.iter().any(|word| key.contains(word)).then_some(("1", FRACTIONS)))
}

/// The unit of a key's numbers, as its name tells it.
pub fn unit_of_key(key: &str) -> Option<&'static str> {
    kind(key).map(|(unit, _)| unit)
}

/// What a key's name ends in for its unit.
pub fn unit_ending(key: &str) -> Option<&'static str> {
    KINDS.iter().map(|(end, ..)| *end).find(|end| end.starts_with('_') && key.ends_with(end))
}

/// What to write at a key for a number that has a unit behind it; none for a text that is no such.
pub fn respelled(key: &str, text: &str) -> Option<String> {
    let key = key.rsplit('.').next().unwrap_or_default().split('[').next().unwrap_or_default();
    let text = text.trim();
    if let Some(time) = text.split_once('/').and_then(|(above, below)| Some(number(above)? / number(below)?)) {
        let is_time = key.ends_with("_s") && !key.ends_with("_per_s") && time.is_finite();
        return is_time.then(|| format!("write {}, which is {text} in s", in_digits(time)));
    }
    let ends = text.char_indices().map(|(place, c)| place + c.len_utf8()).rev();
    let (value, end) = ends.filter(|end| *end < text.len()).find_map(|end| Some((number(&text[..end])?, end)))?;
    let (bare, written) = (text[..end].trim(), text[end..].trim());
    if !written.starts_with(|c: char| c.is_alphabetic() || ['%', '‰', '°'].contains(&c)) {
        return None;
    }
    let Some((unit, others)) = kind(key) else {
        return Some(format!("it is a number in the unit of the key, without `{written}`"));
    };
    let is_inverse =
        unit == "ADU/e-" && ["e-/adu", "e/adu", "e-/dn", "e/dn"].contains(&plain(written).to_lowercase().as_str());
    let is_celsius = unit == "K" && ["C", "°C", "degC", "celsius", "Celsius"].contains(&plain(written).as_str());
    let converted = match factor(others, written) {
        Some(1.0) => return Some(format!("write {bare}, without `{written}`, the unit of the key")),
        Some(factor) => value * factor,
        None if is_celsius => kelvin(value),
        None if is_inverse && value > 0.0 => 1.0 / value,
        None if plain(written) == "%" && unit == "1" => of_per_cent(value),
        None => {
            let unit = if unit == "1" { "a fraction of 1".into() } else { format!("a number in {unit}") };
            return Some(format!("it is {unit}, which `{written}` is not"));
        }
    };
    let unit = if unit == "1" { "as a fraction of 1".into() } else { format!("in {unit}") };
    Some(format!("write {}, which is {text} {unit}", in_digits(converted)))
}

/// What a unit that is written is of the key's.
fn factor(units: Units, written: &str) -> Option<f64> {
    let written = plain(written);
    let by = |is_it: &dyn Fn(&str) -> bool| {
        let found = units.iter().find(|(names, _)| names.iter().any(|name| is_it(name)));
        found.map(|(_, factor)| *factor)
    };
    // `mA` and `MA` are two.
    by(&|name| plain(name) == written).or_else(|| by(&|name| plain(name).eq_ignore_ascii_case(&written)))
}

/// A unit in plain letters, without what is between them.
fn plain(unit: &str) -> String {
    let plain = unit.replace(['µ', 'μ'], "u").replace('²', "2").replace(['⁻', '−'], "-").replace("cm^", "cm");
    plain.chars().filter(|c| !matches!(c, ' ' | '*' | '·' | '(' | ')')).collect()
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// A number in nine digits that count, none that say nothing.
fn in_digits(value: f64) -> String {
    /// Numbers from here to there are written without an exponent.
    const PLAIN: std::ops::Range<f64> = 1e-4..1e9;
    let rounded: f64 = format!("{value:.8e}").parse().unwrap_or(value);
    if rounded == 0.0 || PLAIN.contains(&rounded.abs()) { in_decimals(rounded, 12) } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_with_units_are_told_in_the_unit_of_their_key() {
        for (key, text, wanted) in [
            ("readout.full_well_e", "40k", "write 40000, which is 40k in e-"),
            ("readout.full_well_e", "40 ke-", "write 40000, which is 40 ke- in e-"),
            ("readout.pixel_pitch_um", "6800nm", "write 6.8, which is 6800nm in um"),
            ("pixel_pitch_um", "6.8 µm", "write 6.8, without `µm`, the unit of the key"),
            ("temperature_k", "60 C", "write 333.15, which is 60 C in K"),
            ("temperature_k", "-20°C", "write 253.15, which is -20°C in K"),
            ("temperature_k", "333 K", "write 333, without `K`, the unit of the key"),
            ("dark_current_na_per_cm2", "68 pA", "write 0.068, which is 68 pA in nA/cm2"),
            ("dark_current_na_per_cm2", "68 pA/cm^2", "write 0.068, which is 68 pA/cm^2 in nA/cm2"),
            ("dark_current_na_per_cm2", "68 nA/cm²", "write 68, without `nA/cm²`, the unit of the key"),
            ("dark_current_na_per_cm2", "68 e-/s", "it is a number in nA/cm2, which `e-/s` is not"),
            ("hot_pixel_dark_current_e_per_s", "36 e-/h", "write 0.01, which is 36 e-/h in e-/s"),
            ("adu_per_e", "4 e-/ADU", "write 0.25, which is 4 e-/ADU in ADU/e-"),
            ("adu_per_e", "12 dB", "it is a number in ADU/e-, which `dB` is not"),
            ("taps.read_noise_e[1]", "3 ADU", "it is a number in e-, which `ADU` is not"),
            ("exposure_s", "33ms", "write 0.033, which is 33ms in s"),
            ("exposure_s", "1/50", "write 0.02, which is 1/50 in s"),
            ("prnu", "8000 ppm", "write 0.008, which is 8000 ppm as a fraction of 1"),
            ("dcnu", "2 e-", "it is a fraction of 1, which `e-` is not"),
            ("bits", "12 bit", "write 12, without `bit`, the unit of the key"),
            ("f_number", "8 m", "it is a number in the unit of the key, without `m`"),
        ] {
            assert_eq!(respelled(key, text).as_deref(), Some(wanted), "{key}: {text}");
        }
        assert_eq!(
            [respelled("bits", "many"), respelled("adu_per_e", "1/4"), respelled("bits", "12")],
            [None, None, None]
        );
    }
}
