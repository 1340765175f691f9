//! What other programs and data sheets call the keys of sensor files.

/// Their names, the key here, and how the two stand to each other.
const OTHER_KEYS: [(&str, &str, &str); 9] = [
    ("e_per_adu", "adu_per_e", "its inverse"),
    ("gain_e_per_adu", "adu_per_e", "its inverse"),
    ("egain", "adu_per_e", "its inverse"),
    ("gain", "adu_per_e", "in ADU per electron"),
    ("conversion_gain", "adu_per_e", "in ADU per electron"),
    ("temperature_c", "temperature_k", "in K, 273.15 more than degrees Celsius"),
    ("temperature", "temperature_k", "in K, 273.15 more than degrees Celsius"),
    ("black_level", "bias_adu", "in ADU"),
    ("pixel_size_um", "pixel_pitch_um", "in um"),
];

/// What another's key is called among these, and what it means there.
pub(super) fn here(typed: &str, known: &[String]) -> Option<String> {
    let lower = typed.to_lowercase();
    let is_it = |(other, key, _): &&(&str, &str, &str)| *other == lower && known.iter().any(|known| known == key);
    OTHER_KEYS.iter().find(is_it).map(|(_, key, hint)| format!("here it is `{key}`, {hint}"))
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
}
