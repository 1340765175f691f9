//! Comments of tables that tell of a factor, which no program applies.

use super::delimited::{self, MAX_COMMENTS};

/// What says that values are to be multiplied or divided, or that those of the file were; `multiplied by` alone tells of a step before.
const WORDS: [&str; 17] = [
    "values multiplied by",
    "values scaled by",
    "been multiplied by",
    "in units of 10^",
    "scale factor",
    "scale_factor",
    "scalefactor",
    "scaling factor",
    "multiply by",
    "multiply with",
    "multiply values",
    "multiply all",
    "be multiplied",
    "multiplier",
    "divide by",
    "divide values",
    "be divided",
];

/// A warning of a comment that tells of a factor other than 1.
pub(super) fn doubt_of_factor(text: &str) -> Option<String> {
    const SHOWN: usize = 80;
    let line = delimited::comments(text).take(MAX_COMMENTS).find(|line| tells(line))?;
    let shown: String = line.trim().chars().take(SHOWN).collect();
    Some(format!("its comment `{shown}` tells of a factor, and none is applied: values count as they are written"))
}

/// What is a factor where a number follows alone: a scale may be one of a map.
const SCALES: [&str; 6] = ["scale:", "scale =", "scale=", "scaling:", "scaling =", "factor:"];

fn tells(line: &str) -> bool {
    let lower = line.to_lowercase();
    let behind = |words: &[&str]| {
        let place = words.iter().find_map(|word| lower.find(word).map(|at| (at, at + word.len())))?;
        Some((&lower[..place.0], &lower[place.1..]))
    };
    if let Some((before, rest)) = behind(&WORDS) {
        return !is_denied(before, rest) && number(rest) != Some(1.0);
    }
    if let Some((_, rest)) = behind(&SCALES) {
        return number(rest).is_some_and(|number| number != 1.0);
    }
    has_sign(&lower)
}

/// The number that a text begins with, behind marks.
fn number(text: &str) -> Option<f64> {
    let mut parts = text.split(|letter: char| letter.is_whitespace() || ":=,;()".contains(letter));
    parts.find(|part| !part.is_empty())?.parse().ok()
}

/// Whether the words about a factor say that there is none: `no scale factor was applied`, `scale factor: none`.
fn is_denied(before: &str, rest: &str) -> bool {
    const DENIALS: [&str; 7] = ["no", "not", "none", "never", "without", "nor", "isn't"];
    let words = |text: &str| -> Vec<String> {
        text.split(|letter: char| !(letter.is_alphanumeric() || letter == '\'')).map(str::to_owned).collect()
    };
    let is_one = |word: &String| DENIALS.contains(&word.as_str());
    let (before, rest) = (words(before), words(rest));
    before.iter().rev().filter(|word| !word.is_empty()).take(3).any(is_one)
        || rest.iter().filter(|word| !word.is_empty()).take(3).any(is_one)
}

/// Whether a factor stands behind its sign, as in `x10^-3`, `× 1000` or `* 1e-6`: none that a unit begins with, none that is the
/// second side of something, and no coordinate (`x 0.23`).
fn has_sign(line: &str) -> bool {
    const POWERS: [&str; 7] = ["w", "mw", "uw", "µw", "kw", "nw", "erg"];
    let mut signs = line.char_indices().filter(|(_, letter)| "x×*".contains(*letter));
    signs.any(|(at, sign)| {
        let (before, rest) = (&line[..at], &line[at + sign.len_utf8()..]);
        let behind = rest.trim_start();
        if before.chars().next_back().is_some_and(|letter| letter.is_alphanumeric() || "*^".contains(letter)) {
            return false;
        }
        let end = behind.find(|letter: char| !(letter.is_numeric() || ".^+-−⁻e{}".contains(letter)));
        let (factor, rest_of_line) = behind.split_at(end.unwrap_or(behind.len()));
        let exponent = factor.strip_prefix("10").unwrap_or_default();
        let is_power = exponent.starts_with(['^', '-', '−', '⁻', '²', '³', '⁴', '⁵', '⁶']);
        let number = factor.parse::<f64>().ok().filter(|factor| *factor >= 10.0 || *factor > 0.0 && *factor < 1.0);
        let last = before.trim_end().chars().next_back();
        let is_side = last.is_some_and(char::is_numeric);
        let is_apart = behind.len() < rest.len();
        // A letter apart from its number is a coordinate, but behind what it multiplies.
        let is_of_ten = number.is_some_and(|factor| (factor.log10() - factor.log10().round()).abs() < 1e-9);
        let multiplies = sign != 'x' || last.is_some_and(|letter| letter.is_alphabetic() || letter == ')');
        let is_number =
            number.is_some() && !is_side && if is_apart { is_of_ten && multiplies } else { sign != '*' || is_of_ten };
        let next = rest_of_line.trim_start().split(|letter: char| !letter.is_alphanumeric()).next().unwrap_or_default();
        (is_power || is_number) && !POWERS.contains(&next)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_told_from_what_was_done() {
        for line in [
            "scale factor 1e-3",
            "Scale factor: 0.01",
            "multiply by 10",
            "values must be multiplied by 1e-3",
            "divide by 100",
            "values multiplied by 1000",
            "in units of 10^-4",
            "x10^-3",
            "radiance (W m-2 sr-1 nm-1) x 10^-3",
            "values × 10⁻⁶",
            "L * 1e-6",
            "x100",
            "values x 1000",
            "Scale: 1000",
            "scale = 0.01",
            "1 x 10^-3",
        ] {
            assert!(doubt_of_factor(&format!("# {line}\nnm,L\n400,1\n")).is_some(), "{line}");
        }
        for line in [
            "scale factor 1",
            "multiplied by 100000 and rounded",
            "scaled to 0.31",
            "scaling factor = 1.0",
            "no scale factor was applied",
            "scale factor: none",
            "values were not multiplied by anything; scale factor not applied",
            "Scale: 1",
            "scale: linear",
            "patches of 40 x 30 pixels",
            "640x480",
            "Unit: x10^-3 W m-2 sr-1 nm-1",
            "x and y of the sun",
            "Color (CIE 1931): x 0.23224, y 0.233, Y 1002.51 cd m-2.",
            "x 0.1, y 0.3",
            "id = y * 80 + x of the pixel",
            "flux 10",
        ] {
            assert_eq!(doubt_of_factor(&format!("# {line}\nnm,L\n400,1\n")), None, "{line}");
        }
    }
}
