//! Writes YAML that our own reader takes, whatever strings it holds, and whose numbers are numbers to readers of YAML 1.1 too.

use super::yaml_guard::{checked_text, may_count, may_indent};
use crate::error::{Error, Result};
use serde::Serialize;
use serde_yaml::value::TaggedValue;
use serde_yaml::{Mapping, Number, Value};

/// What stands in for a string or number until the text around it is written; a string that holds it has a stand-in too.
const STAND_IN: &str = "QuotedStringNo";
/// Digits of a stand-in's number.
const DIGITS: usize = 8;

/// Writes a document. Strings that YAML has no plain form for, such as those with control characters, are quoted with
/// escapes; where the whole would not pass the reader's guard, brackets and marks in strings are escaped too.
///
/// # Errors
///
/// [`Error::Data`] when `what` cannot be written as YAML, or not so that it could be read again: it is too long or too deep.
pub fn write(what: &str, document: &impl Serialize) -> Result<String> {
    write_value(what, &value_of(what, document)?)
}

/// The same of a document in its raw form.
///
/// # Errors
///
/// As [`write()`].
pub fn write_value(what: &str, value: &Value) -> Result<String> {
    let text = escaping(what, value, &is_unprintable)?;
    if checked_text(text.as_bytes()).is_ok() {
        return Ok(text);
    }
    let text = escaping(what, value, &|c| is_unprintable(c) || may_count(c))?;
    checked_text(text.as_bytes()).map_err(|problem| unwritable(what, problem))?;
    Ok(text)
}

/// Writes a document that is not for our own reader: it may be as long and as deep as it likes.
///
/// # Errors
///
/// [`Error::Data`] when `what` cannot be written as YAML.
pub fn document(what: &str, document: &impl Serialize) -> Result<String> {
    escaping(what, &value_of(what, document)?, &is_unprintable)
}

fn value_of(what: &str, document: &impl Serialize) -> Result<Value> {
    serde_yaml::to_value(document).map_err(|error| unwritable(what, &error.to_string()))
}

fn escaping(what: &str, value: &Value, escaped: &dyn Fn(char) -> bool) -> Result<String> {
    let text = if has_escaped(value, escaped) { written(value, escaped) } else { serde_yaml::to_string(value) };
    text.map_err(|error| unwritable(what, &error.to_string()))
}

fn unwritable(what: &str, problem: &str) -> Error {
    Error::Data(format!("{what} cannot be written: {problem}"))
}

/// Characters that YAML has only as escapes, and those that break lines.
fn is_unprintable(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}' | '\u{2029}' | '\u{FEFF}' | '\u{FFFE}' | '\u{FFFF}')
}

/// The text of a value, the strings that hold what is to be `escaped` in quotes.
fn written(value: &Value, escaped: &dyn Fn(char) -> bool) -> std::result::Result<String, serde_yaml::Error> {
    let mut quoted = Vec::new();
    let text = serde_yaml::to_string(&stood_in(value, escaped, &mut quoted))?;
    let mut parts = text.split(STAND_IN);
    let mut whole = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (number, rest) = part.split_at_checked(DIGITS).unwrap_or_default();
        whole.push_str(number.parse().ok().and_then(|number: usize| quoted.get(number)).map_or("", String::as_str));
        whole.push_str(rest.trim_start_matches(PADDING));
    }
    Ok(whole)
}

/// What makes a stand-in as long as the string that it stands for: a key that is long is written in another way.
const PADDING: char = '_';

/// Whether a string has to be stood in for.
fn is_escaped(string: &str, escaped: &dyn Fn(char) -> bool) -> bool {
    let wants_quotes = escaped('[') && may_indent(string);
    wants_quotes || string.contains(escaped) || string.contains(STAND_IN)
}

/// Whether any of the strings of a value has to be.
fn has_escaped(value: &Value, escaped: &dyn Fn(char) -> bool) -> bool {
    match value {
        Value::String(string) => is_escaped(string, escaped),
        Value::Sequence(items) => items.iter().any(|item| has_escaped(item, escaped)),
        Value::Mapping(mapping) => {
            mapping.iter().any(|(key, value)| has_escaped(key, escaped) || has_escaped(value, escaped))
        }
        Value::Tagged(tagged) => has_escaped(&tagged.value, escaped),
        Value::Number(number) => with_point_and_sign(number).is_some(),
        Value::Null | Value::Bool(_) => false,
    }
}

/// A number with an exponent as readers of YAML 1.1 know it; none for one that is written so anyway. To them `1e-6`, which has no
/// point, and `1.5e300`, whose exponent has no sign, are text \[YAML 1.1, type float\].
fn with_point_and_sign(number: &Number) -> Option<String> {
    let text = number.to_string();
    let (mantissa, exponent) = text.split_once('e')?;
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with(['-', '+']) { "" } else { "+" };
    (!point.is_empty() || !sign.is_empty()).then(|| format!("{mantissa}{point}e{sign}{exponent}"))
}

/// A value whose strings with something to be `escaped`, and numbers of another form, are stood in for by places in `quoted`.
fn stood_in(value: &Value, escaped: &dyn Fn(char) -> bool, quoted: &mut Vec<String>) -> Value {
    let mut stand_in = |whole: String| {
        let start = format!("{STAND_IN}{:0DIGITS$}", quoted.len());
        let padding = whole.len().saturating_sub(start.len());
        quoted.push(whole);
        Value::String(start + &PADDING.to_string().repeat(padding))
    };
    match value {
        Value::String(string) if is_escaped(string, escaped) => stand_in(in_quotes(string, escaped)),
        Value::Number(number) => with_point_and_sign(number).map_or_else(|| value.clone(), stand_in),
        Value::Sequence(items) => items.iter().map(|item| stood_in(item, escaped, quoted)).collect::<Vec<_>>().into(),
        Value::Mapping(mapping) => {
            let pairs =
                mapping.iter().map(|(key, value)| (stood_in(key, escaped, quoted), stood_in(value, escaped, quoted)));
            Value::Mapping(pairs.collect::<Mapping>())
        }
        Value::Tagged(tagged) => {
            let value = stood_in(&tagged.value, escaped, quoted);
            Value::Tagged(Box::new(TaggedValue { tag: tagged.tag.clone(), value }))
        }
        Value::String(_) | Value::Null | Value::Bool(_) => value.clone(),
    }
}

/// A string in double quotes.
fn in_quotes(string: &str, escaped: &dyn Fn(char) -> bool) -> String {
    let mut quoted = String::with_capacity(string.len() + 2);
    quoted.push('"');
    for c in string.chars() {
        match (c, u32::from(c)) {
            ('"' | '\\', _) => quoted.extend(['\\', c]),
            _ if !escaped(c) => quoted.push(c),
            (_, code @ ..0x100) => quoted.push_str(&format!("\\x{code:02X}")),
            (_, code @ ..0x1_0000) => quoted.push_str(&format!("\\u{code:04X}")),
            (_, code) => quoted.push_str(&format!("\\U{code:08X}")),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What YAML, the guard or the stand-ins might stumble over.
    const HOSTILE: [&str; 32] = [
        "[",
        "]",
        "{",
        "}",
        "&",
        " & ",
        "*",
        " *a",
        "!",
        " !x",
        "'",
        "\"",
        "\\",
        "\n",
        "\r",
        "\t",
        "\0",
        "\u{1b}[2J",
        "\u{7f}",
        "\u{85}",
        "\u{2028}",
        "\u{feff}",
        "\u{ffff}",
        "é",
        "𝄞",
        ": ",
        " #",
        "- ",
        "?",
        "---",
        "~",
        "QuotedStringNo00000000_",
    ];

    fn strings() -> impl Strategy<Value = String> {
        let part = prop_oneof![prop::sample::select(&HOSTILE[..]).prop_map(str::to_owned), any::<String>()];
        let parts = prop::collection::vec((part, prop_oneof![4 => Just(1_usize), 1 => 1..200_usize]), 0..8);
        parts.prop_map(|parts| parts.into_iter().map(|(part, times)| part.repeat(times)).collect())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// What is written passes the guard, and is what it was.
        #[test]
        fn what_is_written_can_be_read(keys in prop::collection::vec(strings(), 0..4), values in prop::collection::vec(strings(), 0..12)) {
            let mut document = Mapping::new();
            for key in keys {
                document.insert(key.into(), values.first().cloned().unwrap_or_default().into());
            }
            document.insert("list".into(), values.into_iter().map(Value::from).collect::<Vec<_>>().into());
            let text = write("it", &document).unwrap();
            prop_assert!(checked_text(text.as_bytes()).is_ok());
            prop_assert_eq!(serde_yaml::from_str::<Mapping>(&text).unwrap(), document, "{}", text);
        }
    }

    #[test]
    fn plain_strings_stay_plain() {
        let text = write("it", &["L*a*b* [cd/m2]", "--seed", "a!"]).unwrap();
        assert_eq!(text, "- L*a*b* [cd/m2]\n- --seed\n- a!\n");
    }

    /// The pattern is that of floats in YAML 1.1, decimal, <https://yaml.org/type/float.html>, with the point that it needs.
    #[test]
    fn numbers_are_numbers_to_readers_of_yaml_1_1() {
        let is_float = |text: &str| {
            let text = text.strip_prefix('-').unwrap_or(text);
            let (mantissa, exponent) = text.split_once('e').map_or((text, None), |(m, e)| (m, Some(e)));
            let are_digits = |digits: &str| digits.bytes().all(|digit| digit.is_ascii_digit());
            let (whole, fraction) = mantissa.split_once('.').unwrap_or_default();
            let is_signed = |e: &str| e.strip_prefix(['-', '+']).is_some_and(|e| !e.is_empty() && are_digits(e));
            !whole.is_empty() && are_digits(whole) && are_digits(fraction) && exponent.is_none_or(is_signed)
        };
        let numbers = [1e-6, -1e-6, 1.5e-7, 1e20, -2.5e300, 5e-324, f64::MAX, 0.1, 3.0, -0.0];
        let text = write("it", &numbers).unwrap();
        assert!(text.starts_with("- 1.0e-6\n- -1.0e-6\n- 1.5e-7\n"), "{text}");
        assert!(text.lines().all(|line| is_float(&line[2..])), "{text}");
        assert_eq!(serde_yaml::from_str::<Vec<f64>>(&text).unwrap(), numbers);
        // Text stays text, and what is no finite number what it was.
        assert_eq!(write("it", &["1e-6", "1.5e300"]).unwrap(), "- '1e-6'\n- '1.5e300'\n");
        assert_eq!(write("it", &[f64::INFINITY]).unwrap(), "- .inf\n");
    }

    #[test]
    fn what_is_too_much_is_refused() {
        let complaint = write("the metadata", &["x".repeat(1 << 20)]).unwrap_err().to_string();
        assert!(complaint.starts_with("the metadata cannot be written: it is longer than 1 MiB"), "{complaint}");
        let deep = (0..100).fold(Value::Null, |inner, _| Value::Mapping([("a".into(), inner)].into_iter().collect()));
        assert!(write("it", &deep).unwrap_err().to_string().contains("nest too deep"));
    }
}
