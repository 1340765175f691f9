//! Comments of tables that tell of a factor, which no program applies.

use super::delimited;

/// So many comments are searched.
const MAX_COMMENTS: usize = 1000;

/// What says that values are to be multiplied or divided, or that those of the file were; `multiplied by` alone tells of a step before.
const WORDS: [&str; 16] = [
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

fn tells(line: &str) -> bool {
    let lower = line.to_lowercase();
    let Some(rest) = WORDS.iter().find_map(|word| lower.find(word).map(|at| &lower[at + word.len()..])) else {
        return false;
    };
    let number =
        rest.split(|letter: char| letter.is_whitespace() || ":=,;()".contains(letter)).find(|part| !part.is_empty());
    number.and_then(|number| number.parse::<f64>().ok()) != Some(1.0)
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
        ] {
            assert!(doubt_of_factor(&format!("# {line}\nnm,L\n400,1\n")).is_some(), "{line}");
        }
        for line in ["scale factor 1", "multiplied by 100000 and rounded", "scaled to 0.31", "scaling factor = 1.0"] {
            assert_eq!(doubt_of_factor(&format!("# {line}\nnm,L\n400,1\n")), None, "{line}");
        }
    }
}
