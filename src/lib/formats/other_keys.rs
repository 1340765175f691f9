//! What other programs and data sheets call the keys of sensor files.

use crate::error::{Error, Result};
use crate::names::nearest;
use crate::units::written;
use serde_yaml::Mapping;

/// Their names, the key here, and how the two stand to each other.
const OTHER_KEYS: [(&str, &str, &str); 22] = [
    ("e_per_adu", "adu_per_e", "its inverse"),
    ("gain_e_per_adu", "adu_per_e", "its inverse"),
    ("egain", "adu_per_e", "its inverse"),
    ("gain", "adu_per_e", "in ADU per electron"),
    ("conversion_gain", "adu_per_e", "in ADU per electron"),
    ("temperature_c", "temperature_k", "in K, 273.15 more than degrees Celsius"),
    ("temperature", "temperature_k", "in K, 273.15 more than degrees Celsius"),
    ("black_level", "bias_adu", "in ADU"),
    ("pixel_size_um", "pixel_pitch_um", "in um"),
    ("pixel_size", "pixel_pitch_um", "in um"),
    ("gain_db", "adu_per_e", "in ADU per electron, at that gain of the camera"),
    ("bit_depth", "bits", "bits of the converter"),
    ("bitdepth", "bits", "bits of the converter"),
    ("adc_bits", "bits", "bits of the converter"),
    ("dsnu", "dsnu_e", "in e-"),
    ("offset", "bias_adu", "in ADU"),
    ("qe", "quantum_efficiency", "electrons per photon, within `response`"),
    ("spectral_response", "relative_response", "on any scale, within `response`"),
    ("responsivity", "relative_response", "on any scale, within `response`"),
    ("sensitivity", "relative_response", "on any scale, within `response`"),
    ("ssf", "relative_response", "on any scale, within `response`"),
    ("ir_filter", "cover_glass", "its transmittance, within `response`"),
];

/// Endings of names for units that no key here has.
const OTHER_UNITS: [&str; 14] = [
    "_adu_per_s",
    "_pa_per_cm2",
    "_percent",
    "_per_cent",
    "_pct",
    "_adu",
    "_dn",
    "_mv",
    "_uv",
    "_v",
    "_ke",
    "_ms",
    "_us",
    "_c",
];

/// Refuses keys of the mapping at a known key that are not written back; `of_curve` are those that the file of a curve of the response
/// has.
pub(super) fn check_within(name: &str, path: &str, unknown: &Mapping, of_curve: &[&str]) -> Result<()> {
    let known = if path.starts_with("response.") { of_curve } else { &[] };
    let mut keys = unknown.keys().map(|key| key.as_str().unwrap_or("?"));
    let Some(key) = keys.find(|key| !known.contains(key)) else { return Ok(()) };
    let meant = nearest(key, known.iter().copied(), |_| key.len().div_ceil(2));
    let advice = meant.map_or_else(|| "remove it".to_owned(), |meant| format!("did you mean `{meant}`?"));
    Err(Error::format(name, format!("`{path}` has an unknown key `{key}`; {advice}")))
}

/// What another's key is called among these, and what it means there.
pub(super) fn here(typed: &str, known: &[String]) -> Option<String> {
    let lower = typed.to_lowercase();
    let is_it = |(other, key, _): &&(&str, &str, &str)| *other == lower && known.iter().any(|known| known == key);
    let by_name = OTHER_KEYS.iter().find(is_it).map(|(_, key, hint)| format!("here it is `{key}`, {hint}"));
    by_name.or_else(|| in_another_unit(&lower, known))
}

/// The known key that is called as a typed one but for the unit at its end, in its own unit.
fn in_another_unit(typed: &str, known: &[String]) -> Option<String> {
    let ending = OTHER_UNITS.into_iter().find(|end| typed.ends_with(end)).or_else(|| written::unit_ending(typed))?;
    let stem = &typed[..typed.len() - ending.len()];
    let is_so = |key: &&String| {
        let own = written::unit_ending(key).unwrap_or_default();
        written::unit_of_key(key).is_some() && key.strip_suffix(own) == Some(stem)
    };
    // Of two the one by time goes with another by time.
    let by_time = |key: &&&String| key.ends_with("_per_s") == ending.ends_with("_per_s");
    let all: Vec<&String> = known.iter().filter(is_so).collect();
    let key = all.iter().find(by_time).or(all.first())?;
    let unit = written::unit_of_key(key)?;
    let hint = match (ending, unit) {
        ("_percent" | "_per_cent" | "_pct", "1") => "a fraction of 1, per cent over 100".to_owned(),
        (_, "1") => "a fraction of 1".to_owned(),
        ("_adu" | "_dn", "e-") | ("_adu_per_s", "e-/s") => format!("in {unit}, ADU over `adu_per_e`"),
        ("_e", "ADU") => "in ADU, electrons times `adu_per_e`".to_owned(),
        _ => format!("in {unit}"),
    };
    Some(format!("here it is `{key}`, {hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_others_are_told_by_ours() {
        let known = ["adu_per_e", "bits"].map(str::to_owned);
        assert_eq!(here("E_per_ADU", &known).as_deref(), Some("here it is `adu_per_e`, its inverse"));
        assert_eq!([here("bits", &known), here("temperature_c", &known)], [None, None]);
    }

    #[test]
    fn keys_in_another_unit_are_told_by_ours() {
        let known =
            ["bits", "width", "read_noise_e", "prnu", "dark_current_na_per_cm2", "dark_current_e_per_s", "bias_adu"];
        let known = known.map(str::to_owned);
        for (typed, wanted) in [
            ("read_noise_adu", "`read_noise_e`, in e-, ADU over `adu_per_e`"),
            ("read_noise_mv", "`read_noise_e`, in e-"),
            ("prnu_percent", "`prnu`, a fraction of 1, per cent over 100"),
            ("dark_current_adu_per_s", "`dark_current_e_per_s`, in e-/s, ADU over `adu_per_e`"),
            ("dark_current_pa_per_cm2", "`dark_current_na_per_cm2`, in nA/cm2"),
            ("bias_e", "`bias_adu`, in ADU, electrons times `adu_per_e`"),
            ("bit_depth", "`bits`, bits of the converter"),
        ] {
            assert_eq!(here(typed, &known), Some(format!("here it is {wanted}")), "{typed}");
        }
        assert_eq!(here("red_noise_e", &known), None);
    }
}
