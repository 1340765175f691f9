//! Complaints of other crates, in our words.
//!
//! What these crates say is no interface: an update may change it. So it is looked at here only, and the tests provoke
//! each of their complaints in earnest.

use crate::error::Error;
use crate::text::in_decimals;
use crate::units::written;
use exr::error::Error as ExrError;
use image::ImageError;
use std::io;

/// What is said of EXR channels that are stored at fewer points than the others.
pub const SUBSAMPLED: &str = "subsampled channels (luminance/chroma images) are not supported; convert it to RGB first";
/// What to do about an EXR whose compression is not read.
pub const STORE_WITHOUT_LOSS: &str = "store it without loss as none, rle, zips, zip or piz";

/// What the crate `exr` complains of while it reads.
pub fn exr_complaint(name: &str, error: &ExrError) -> Error {
    match error {
        ExrError::Io(source) => Error::disk(name, "read", io::Error::new(source.kind(), source.to_string())),
        // Before any header is given out, the crate refuses what is named better here.
        ExrError::NotSupported(what) if what.contains("subsampling") => Error::format(name, SUBSAMPLED),
        ExrError::Invalid(what) if what.contains("compression attribute") => {
            Error::format(name, format!("its compression is missing or of an unknown kind; {STORE_WITHOUT_LOSS}"))
        }
        ExrError::NotSupported(what) => Error::format(name, format!("this kind of EXR is not supported: {what}")),
        // So the crate reports the end of the file.
        ExrError::Invalid(what) if what.contains("missing bytes") => Error::cut_short(name),
        ExrError::Invalid(what) => Error::format(name, format!("it is no valid EXR file: {what}")),
        ExrError::Aborted => Error::format(name, "reading was given up"),
    }
}

/// The line of a record of `rows`, from 1: its position is that behind the record before, and empty lines and comments may follow
/// there.
pub fn line_of(rows: &str, position: Option<&csv::Position>) -> u64 {
    let Some(position) = position else { return 0 };
    let behind = usize::try_from(position.byte()).ok().and_then(|byte| rows.get(byte..)).unwrap_or_default();
    let passed = behind.lines().take_while(|line| line.is_empty() || line.starts_with('#')).count();
    position.line() + passed as u64
}

/// What the crate `csv` complains of in `rows`: rows of different lengths, bytes that are no text.
pub fn csv_complaint(name: &str, rows: &str, error: &csv::Error) -> Error {
    let problem = match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = line_of(rows, pos.as_ref());
            let cells = if *len == 1 { "cell" } else { "cells" };
            // Of cells that something else parts, commas are those of decimals already.
            let row =
                usize::try_from(line).ok().and_then(|line| rows.lines().nth(line.checked_sub(1)?)).unwrap_or_default();
            let hint = if *len == 1 && row.trim_start().starts_with(char::is_alphabetic) {
                "; put a # before it if it is no row"
            } else if len > expected_len && row.contains(',') && !row.contains([';', '\t']) {
                "; part columns by semicolons or tabs where commas are those of decimals"
            } else {
                ""
            };
            format!("line {line} has {len} {cells}, the rows above it have {expected_len}{hint}")
        }
        _ => format!("it is not a CSV table: {error}"),
    };
    Error::format(name, problem)
}

/// What the crate `serde_yaml` complains of while it reads: what is no YAML, or not that of the type.
pub fn yaml_complaint(name: &str, error: &serde_yaml::Error) -> Error {
    Error::format(name, yaml_problem(error))
}

/// The same without the name of the file.
pub fn yaml_problem(error: &serde_yaml::Error) -> String {
    let text = error.to_string();
    match misfit(&text) {
        Some(problem) => problem,
        None if text.contains("more than one document") => "it holds more than one document; leave one".into(),
        None => not_yaml(&text).unwrap_or_else(|| refused_value(&text)),
    }
}

/// A complaint of ours about a value, which the parser puts the path of its keys before, and the place behind.
fn refused_value(text: &str) -> String {
    let (what, place) = match text.rsplit_once(" at line ") {
        Some((what, place)) => (what, format!(" (line {})", place.replace(" column ", ", column "))),
        None => (text, String::new()),
    };
    let is_path = |path: &str| {
        path.starts_with(|c: char| c.is_ascii_lowercase())
            && path.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_.[]".contains(&byte))
    };
    match what.split_once(": ").filter(|(path, _)| is_path(path)) {
        Some((path, problem)) => format!("in `{path}`, {problem}{place}"),
        None => format!("it is not as expected: {what}{place}"),
    }
}

/// A complaint about what is no YAML at all, in our words, with the place; none for another.
fn not_yaml(text: &str) -> Option<String> {
    /// What the parser says, what it means, and whether the place is that where the thing began.
    const MEANINGS: [(&str, &str, bool); 13] = [
        (
            "mapping values are not allowed",
            "a colon and a blank stand within a value, or a key is indented more than those above it; put the value in quotes, or indent keys alike",
            false,
        ),
        (
            "did not find expected key",
            "a key and a colon are wanted; keys side by side are indented alike, and a value with quotes in it stands wholly in quotes",
            false,
        ),
        ("did not find expected ',' or ']'", "a list in brackets lacks a comma or its `]`", true),
        ("did not find expected ',' or '}'", "keys in braces lack a comma or their `}`", true),
        ("did not find expected '-' indicator", "an entry of the list, which begins with `- `, is wanted", false),
        ("could not find expected ':'", "a key lacks its colon, or the blank behind it, at or above this place", false),
        ("did not find expected node content", "a value is missing, or brackets are not closed", false),
        (
            "cannot start any token",
            "a tab, or a value that begins with a character such as @, % or `; indent by blanks, and put the value in quotes",
            false,
        ),
        ("tab character", "a tab; indent by blanks", false),
        ("unexpected end of stream", "a quote that is not closed", true),
        (
            "block sequence entries are not allowed",
            "an entry of a list stands where none can; begin it on a line of its own",
            false,
        ),
        ("unknown escape character", "a backslash within double quotes; use single quotes", false),
        ("EOF while parsing", "it ends where something is wanted", false),
    ];
    const SIGNS: [&str; 13] = [
        "did not find ",
        "could not find ",
        "found ",
        "mapping ",
        "block ",
        "while ",
        "control characters",
        "invalid ",
        "incomplete ",
        "unknown anchor",
        "recursion limit",
        "repetition limit",
        "expected a mapping",
    ];
    let known = MEANINGS.iter().find(|(said, ..)| text.contains(said));
    if known.is_none() && !SIGNS.iter().any(|sign| text.starts_with(sign)) {
        return None;
    }
    let places = text.match_indices(" at line ").map(|(at, begin)| {
        let place = &text[at + begin.len()..];
        place.split(',').next().unwrap_or_default().replace(" column ", ", column ")
    });
    let places: Vec<String> = places.collect();
    let place = if known.is_some_and(|(.., is_begin)| *is_begin) { places.last() } else { places.first() };
    let place = place.map_or(String::new(), |place| format!(" (line {place})"));
    Some(format!("it is no valid YAML{}{place}", known.map_or(String::new(), |(_, meaning, _)| format!(": {meaning}"))))
}

/// A complaint of the crate `serde` in our words: a path of keys, what does not fit its type, and the place. None for another.
fn misfit(text: &str) -> Option<String> {
    const KINDS: [&str; 9] = [
        "invalid type: ",
        "invalid value: ",
        "invalid length ",
        "missing field ",
        "unknown variant ",
        "duplicate field ",
        "duplicate entry with key ",
        "untagged and internally tagged enums do not support enum input",
        "data did not match any variant",
    ];
    let (begin, kind) = KINDS.iter().filter_map(|kind| Some((text.find(kind)?, *kind))).min()?;
    let path = text[..begin].trim_end_matches(": ");
    let (what, place) = match text.rfind(" at line ") {
        Some(place) if place > begin => (&text[begin + kind.len()..place], &text[place + " at ".len()..]),
        _ => (text.get(begin + kind.len()..).unwrap_or_default(), ""),
    };
    let key = if path.is_empty() || path == "." { "it".to_owned() } else { format!("`{path}`") };
    let place = if place.is_empty() { String::new() } else { format!(" ({})", place.replace(" column", ", column")) };
    let (found, expected) = what.split_once(", expected ").unwrap_or((what, ""));
    Some(match kind {
        "missing field " => format!("{key} has no {what}{place}"),
        "duplicate entry with key " => format!("{key} has `{}` twice{place}", what.trim_matches('"')),
        other if other.starts_with("untagged") => format!("{key} is a tagged value, which has no meaning here{place}"),
        "duplicate field " => format!("{key} has {what} twice{place}"),
        "unknown variant " if expected.is_empty() => format!("{key} is {found}, which is none of its names{place}"),
        "unknown variant " => {
            let names = expected.trim_start_matches("one of ");
            format!("{key} is {found}; known are {names}{place}")
        }
        "invalid length " => {
            let entries = if found == "1" { "entry" } else { "entries" };
            format!("{key} has {found} {entries}, not {}{place}", wanted(expected))
        }
        "data did not match any variant" => format!("{key} has none of the forms that are read{place}"),
        _ => {
            let hint = remedy(path, found, expected).map_or(String::new(), |hint| format!("; {hint}"));
            format!("{key} is {}, not {}{place}{hint}", given(found), wanted(expected))
        }
    })
}

/// What to write at a key instead of a value that `serde` found, where that can be told: a number with a comma, a unit, a per cent sign or quotes,
/// a name of a file where keys are wanted.
fn remedy(path: &str, found: &str, expected: &str) -> Option<String> {
    let text = found.strip_prefix("string \"").and_then(|text| text.strip_suffix('"'));
    match (text, expected) {
        (Some(text), "f32" | "f64" | "u8" | "u16" | "u32" | "u64" | "usize") => {
            let is_number = |text: &str| text.parse::<f64>().is_ok_and(f64::is_finite);
            let share = text.strip_suffix('%').map(str::trim).and_then(|text| text.parse::<f64>().ok());
            let point = text.replacen(',', ".", 1);
            let is_whole = !expected.starts_with('f');
            match share {
                Some(percent) => Some(format!("write it as a fraction of 1, {}", in_decimals(percent / 100.0, 9))),
                None if is_number(text) => Some("leave out its quotes".into()),
                None if has_thousands(text) => Some(match text.replace(',', "") {
                    // A comma of decimals would be one, before no point.
                    whole if is_number(&point) && !is_whole => format!("write {whole}, or {point} where that is meant"),
                    whole => format!("write {whole}"),
                }),
                None if is_number(&point) => Some(format!("write {point}")),
                None => written::respelled(path, text),
            }
        }
        (None, "u8" | "u16" | "u32" | "u64" | "usize") => {
            let number = found.split_once('`')?.1.strip_suffix('`')?;
            let value: f64 = number.parse().ok()?;
            (value >= 0.0 && value.fract() == 0.0).then(|| format!("write {value}"))
        }
        (Some(text), other)
            if other.starts_with("struct") && text.rsplit_once('.').is_some_and(|(_, end)| end.len() < 5) =>
        {
            Some(format!("a file is named so: {{file: {text}}}"))
        }
        _ => None,
    }
}

/// Whether all commas of a number can be marks of thousands: up to three digits before the first, not `0`, and three behind each.
fn has_thousands(text: &str) -> bool {
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (whole, decimals) = unsigned.split_once('.').unwrap_or((unsigned, ""));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let mut groups = whole.split(',');
    let first = groups.next().unwrap_or_default();
    let mut behind = groups.peekable();
    behind.peek().is_some()
        && (1..=3).contains(&first.len())
        && !first.starts_with('0')
        && are_digits(first)
        && are_digits(decimals)
        && behind.all(|group| group.len() == 3 && are_digits(group))
}

/// What `serde` found, in our words.
fn given(found: &str) -> String {
    if let Some(quoted) = found.strip_prefix("string \"").and_then(|text| text.strip_suffix('"')) {
        return format!("`{quoted}`");
    }
    match found {
        "sequence" => "a list".into(),
        "map" => "a list of keys and values".into(),
        "unit value" | "null" | "Option value" => "empty".into(),
        other => match other.split_once('`') {
            Some((_, value)) => format!("`{value}"),
            None if other.contains("variant") => "a tagged value".into(),
            None => other.into(),
        },
    }
}

/// What `serde` expected, in our words.
fn wanted(expected: &str) -> String {
    let count = || expected.rsplit(' ').next().filter(|last| last.parse::<u32>().is_ok());
    match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number from 0 on".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        "f32" | "f64" => "a number".into(),
        "a string" | "string" | "a borrowed string" => "text".into(),
        "a boolean" | "bool" => "true or false".into(),
        "a sequence" | "sequence" => "a list".into(),
        "map" | "a map" => "a list of keys and values".into(),
        other if other.starts_with("struct") => "a list of keys and values".into(),
        other if ["an array", "a tuple", "tuple"].iter().any(|begin| other.starts_with(begin)) => {
            count().map_or("a list".into(), |count| format!("a list of {count}"))
        }
        other if other.starts_with("sequence of ") => {
            format!("a list of {}", other.trim_start_matches("sequence of ").trim_end_matches(" elements"))
        }
        other if other.contains("enum") || other.contains("variant") || other.contains("tag") => {
            "one of the forms that are read".into()
        }
        other => other.into(),
    }
}

/// What the standard library complains of where a text is no number, in our words; other complaints as they are.
pub fn number_complaint(complaint: &str) -> String {
    match complaint {
        "invalid digit found in string" => "a whole number is wanted".into(),
        "invalid float literal" => "a number is wanted".into(),
        "cannot parse integer from empty string" | "cannot parse float from empty string" => "it is empty".into(),
        "number too large to fit in target type" => "it is too large".into(),
        "number too small to fit in target type" => "it is too small".into(),
        other => match other.split_once(" is not in ").and_then(|(_, range)| range.split_once("..")) {
            Some((low, high)) => match high.strip_prefix('=') {
                Some("") | None if high.trim_start_matches('=').is_empty() => format!("it is {low} at least"),
                Some(high) => format!("it lies within {low} and {high}"),
                None => format!("it lies within {low} and {high}, which is too large"),
            },
            None => other.into(),
        },
    }
}

/// What the crate `image` complains of while it writes a PNG.
pub fn png_complaint(name: &str, error: ImageError) -> Error {
    match error {
        ImageError::IoError(source) => Error::disk(name, "write", source),
        other => Error::format(name, format!("it cannot be written as PNG: {other}")),
    }
}

/// What the crate `png` complains of while it writes.
pub fn png_refusal(name: &str, error: png::EncodingError) -> Error {
    match error {
        png::EncodingError::IoError(source) => Error::disk(name, "write", source),
        other => Error::format(name, format!("it cannot be written as PNG: {other}")),
    }
}

/// What the crate `png` complains of while it reads.
pub fn png_damage(name: &str, error: png::DecodingError) -> Error {
    use png::DecodingError::{Format, IoError, LimitsExceeded, Parameter};
    match error {
        IoError(source) => Error::disk(name, "read", source),
        Format(what) => {
            let what = what.to_string();
            Error::format(name, format!("it is damaged: {}", what.trim().trim_end_matches('.')))
        }
        LimitsExceeded => Error::format(name, "its texts or its color profile take more than 16 MiB; remove them"),
        Parameter(what) => Error::format(name, format!("it cannot be read: {what}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::csv::SpectralTable;
    use crate::formats::exr::{ExrCompression, ExrReader, ExrSamples, ExrTags, ExrWriter, Layers, patch_table};
    use crate::formats::format::SampleReader;
    use crate::formats::read_ahead::Pipe;
    use crate::formats::yaml::parse_strict;
    use crate::frame::Geometry;
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageEncoder};
    use serde::{Deserialize, Serialize};

    /// An EXR of 6x4 pixels with a channel `Y`.
    fn exr() -> Vec<u8> {
        let geometry = Geometry::new(6, 4, &["Y"]);
        let (samples, compression) = (ExrSamples::F32, ExrCompression::Zips);
        let tags = ExrTags::default();
        let mut writer =
            ExrWriter::create(Vec::new(), "a.exr", &geometry, samples, compression, Layers::BesideTheImage, &tags)
                .unwrap();
        writer.write(&[0.5; 24]).unwrap();
        let (bytes, table) = writer.finish().unwrap();
        let mut file = io::Cursor::new(bytes);
        patch_table(&mut file, "a.exr", &table.unwrap()).unwrap();
        file.into_inner()
    }

    /// Where in the file the value of an attribute begins.
    fn value_of(bytes: &[u8], attribute: &str) -> usize {
        let begin = format!("{attribute}\0");
        let name = bytes.windows(begin.len()).position(|bytes| bytes == begin.as_bytes()).unwrap() + begin.len();
        name + bytes[name..].iter().position(|byte| *byte == 0).unwrap() + 1 + 4
    }

    fn exr_refused(bytes: Vec<u8>) -> String {
        let read = ExrReader::stream(Pipe::of(io::Cursor::new(bytes)), "a.exr")
            .and_then(|mut reader| reader.read(4, &mut Vec::new()));
        read.unwrap_err().to_string()
    }

    #[test]
    fn exr_says_what_is_expected_of_it() {
        let whole = exr();
        let value = |attribute| value_of(&whole, attribute);
        let with = |place: usize, bytes: &[u8]| {
            let mut changed = whole.clone();
            changed[place..place + bytes.len()].copy_from_slice(bytes);
            exr_refused(changed)
        };
        // A channel: its name and a NUL, its type, four bytes, and every how many columns and rows it has samples.
        let sampling = value("channels") + 2 + 8;
        assert_eq!(with(sampling, &[2, 0, 0, 0, 2]), format!("a.exr: {SUBSAMPLED}"));
        let unknown = format!("a.exr: its compression is missing or of an unknown kind; {STORE_WITHOUT_LOSS}");
        assert_eq!(with(value("compression"), &[99]), unknown);
        // The name of the attribute, its type, which is called the same, and a length in four bytes stand before the value.
        assert_eq!(with(value("compression") - 4 - 12 - 12, b"K"), unknown);
        for length in [8, 40, 300, whole.len() - 1] {
            let cut_short = "a.exr: the file ends before its last row; it was cut short";
            assert_eq!(exr_refused(whole[..length].to_vec()), cut_short);
        }
        assert_eq!(
            with(4, &[3]),
            "a.exr: this kind of EXR is not supported: file versions other than 2.0 are not supported"
        );
        let malformed =
            "a.exr: it is no valid EXR file: compressed ZIP1 data (invalid: zlib-compressed data malformed)";
        assert_eq!(with(whole.len() - 8, &[0xFF; 8]), malformed);
    }

    #[test]
    fn csv_says_where_a_table_is_none() {
        let refused = |bytes: &[u8]| SpectralTable::parse("t.csv", bytes).unwrap_err().to_string();
        assert_eq!(refused(b"nm,L\n400,1\n410\n"), "t.csv: line 3 has 1 cell, the rows above it have 2");
        assert_eq!(refused(b"nm,L\n400,\xFF\n"), "t.csv: line 2, column 2: `\u{FF}` is no number");
        // Lines are counted as an editor does, whatever stands between rows.
        for ends in ["\n", "\r\n"] {
            let refused = |text: &str| refused(text.replace('\n', ends).as_bytes());
            assert_eq!(
                refused("# a\n\nnm,L\n400,1\n\n# b\n\n410\n"),
                "t.csv: line 8 has 1 cell, the rows above it have 2"
            );
            assert_eq!(refused("# a\n\nnm,L\n400,1\n\n# b\n410,x\n"), "t.csv: line 7, column 2: `x` is no number");
            assert_eq!(refused("\n% a\nnm L\n400 1\n\n410 x\n"), "t.csv: line 6, column 2: `x` is no number");
            let wanted = "t.csv: line 3, column 1: `4OO` is no number";
            assert!(refused("# a\n\n4OO,1\n410,2\n").starts_with(wanted));
        }
    }

    #[derive(Debug, Serialize, Deserialize)]
    struct Sensor {
        bits: u32,
    }

    #[test]
    fn yaml_says_where_a_document_is_none() {
        let refused = |text: &str| parse_strict::<Sensor>("s.yaml", text.as_bytes()).unwrap_err().to_string();
        for (text, wanted) in [
            ("bits: many\n", "`bits` is `many`, not a whole number from 0 on (line 1, column 7)"),
            ("bits: \"12\"\n", "`bits` is `12`, not a whole number from 0 on (line 1, column 7); leave out its quotes"),
            ("bits: 12.0\n", "`bits` is `12.0`, not a whole number from 0 on (line 1, column 7); write 12"),
            (
                "bits: 12 bit\n",
                "`bits` is `12 bit`, not a whole number from 0 on (line 1, column 7); write 12, without `bit`, the unit of the key",
            ),
            ("bits: -1\n", "`bits` is `-1`, not a whole number from 0 on (line 1, column 7)"),
            ("bits: [1]\n", "`bits` is a list, not a whole number from 0 on (line 1, column 7)"),
            ("bits: {a: 1}\n", "`bits` is a list of keys and values, not a whole number from 0 on (line 1, column 7)"),
            ("bits: 12\n---\nbits: 14\n", "it holds more than one document; leave one"),
            ("{}\n", "it has no `bits`"),
            ("bits: [\n", "it is no valid YAML: a value is missing, or brackets are not closed (line 2, column 1)"),
            ("bits: [12\n", "it is no valid YAML: a list in brackets lacks a comma or its `]` (line 1, column 7)"),
            ("bits: \"12\n", "it is no valid YAML: a quote that is not closed (line 1, column 7)"),
            (
                "bits: a: 12\n",
                "it is no valid YAML: a colon and a blank stand within a value, or a key is indented more than those above it; put \
                 the value in quotes, or indent keys alike (line 1, column 8)",
            ),
            (
                "bits: 12\nwidth 3\n",
                "it is no valid YAML: a key lacks its colon, or the blank behind it, at or above this place (line 3, column 1)",
            ),
        ] {
            assert_eq!(refused(text), format!("s.yaml: {wanted}"));
        }
    }

    #[test]
    fn values_that_we_refuse_are_told_with_their_keys() {
        let complaint = |text: &str| yaml_problem(&serde_yaml::from_str::<ReadOut>(text).unwrap_err());
        let refused = complaint("cfa: rgbg\n");
        assert!(
            refused.starts_with("in `cfa`, `rgbg` is no filter array; one is ")
                && refused.ends_with(" (line 1, column 6)"),
            "{refused}"
        );
        let lists = complaint("xy: [0.3]\n");
        assert_eq!(lists, "`xy` has 1 entry, not a list of 2 (line 1, column 5)");
        assert_eq!(refused_value("no such thing: ever"), "it is not as expected: no such thing: ever");
    }

    #[derive(Debug, Deserialize)]
    #[expect(dead_code, reason = "nothing is read")]
    struct ReadOut {
        #[serde(default)]
        cfa: Option<crate::cfa::FilterArray>,
        #[serde(default)]
        xy: Option<[f64; 2]>,
    }

    #[test]
    fn values_of_yaml_are_told_as_they_should_be() {
        let told = |text: &str, expected| remedy("full_well_e", &format!("string \"{text}\""), expected);
        for (text, expected, wanted) in [
            ("15,7", "f64", Some("write 15.7")),
            ("32,000", "f64", Some("write 32000, or 32.000 where that is meant")),
            ("-1,234.5", "f64", Some("write -1234.5")),
            ("1,234,567", "f64", Some("write 1234567")),
            ("1,920", "u32", Some("write 1920")),
            ("0,125", "f64", Some("write 0.125")),
            ("1234,567", "f64", Some("write 1234.567")),
            ("12,3456", "f64", Some("write 12.3456")),
            ("15.7 e-", "f64", Some("write 15.7, without `e-`, the unit of the key")),
            ("33ms", "f64", Some("it is a number in e-, which `ms` is not")),
            ("40k", "f64", Some("write 40000, which is 40k in e-")),
            ("0.8%", "f64", Some("write it as a fraction of 1, 0.008")),
            ("1.5", "f64", Some("leave out its quotes")),
            ("qe.csv", "struct CurveFile", Some("a file is named so: {file: qe.csv}")),
            ("many", "f64", None),
            ("rggb", "a boolean", None),
        ] {
            assert_eq!(told(text, expected).as_deref(), wanted, "{text}");
        }
    }

    #[test]
    fn png_says_whether_it_was_the_disk() {
        let written = PngEncoder::new(&mut Vec::new()).write_image(&[0; 12], 1, 1, ExtendedColorType::Rgb32F);
        assert_eq!(
            png_complaint("a.png", written.unwrap_err()).to_string(),
            "a.png: it cannot be written as PNG: The encoder or decoder for Png does not support the color type `Rgb32F`"
        );
        let mut small = [0; 4];
        let written = PngEncoder::new(small.as_mut_slice()).write_image(&[0], 1, 1, ExtendedColorType::L8);
        let complaint = png_complaint("a.png", written.unwrap_err()).to_string();
        assert_eq!(complaint, "a.png: cannot write: failed to write whole buffer");
    }

    #[test]
    fn a_damaged_png_is_told_from_one_that_was_cut_short() {
        let mut whole = Vec::new();
        let codes: Vec<u8> = (0..=255).collect();
        PngEncoder::new(&mut whole).write_image(&codes, 16, 16, ExtendedColorType::L8).unwrap();
        let refused = |bytes: &[u8]| {
            let decoder = png::Decoder::new_with_limits(io::Cursor::new(bytes), png::Limits { bytes: 1000 });
            let read = decoder.read_info().and_then(|mut reader| reader.next_frame(&mut [0; 256]));
            png_damage("a.png", read.unwrap_err()).to_string()
        };
        let cut_short = "a.png: the file ends before its last row; it was cut short";
        assert_eq!(refused(&whole[..20]), cut_short);
        assert_eq!(refused(&whole[..80]), cut_short);
        let with = |place: usize, byte: u8| {
            let mut changed = whole.clone();
            changed[place] = byte;
            refused(&changed)
        };
        assert!(with(19, 17).starts_with("a.png: it is damaged: CRC error: expected 0x"));
        let samples = whole.windows(4).position(|bytes| bytes == b"IDAT").unwrap() + 4;
        let damaged = with(samples, 0xFF);
        assert!(damaged.starts_with("a.png: it is damaged: Corrupt deflate stream. "), "{damaged}");
        // A text before the samples that says that it is longer than it may be.
        let place = samples - 8;
        let text = [&5000_u32.to_be_bytes()[..], b"tEXtComment\0", &[b'x'; 6000]].concat();
        let long = [&whole[..place], &text, &whole[place..]].concat();
        assert!(refused(&long).ends_with("take more than 16 MiB; remove them"));
    }
}
