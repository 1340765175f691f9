//! Text that comes from files, as it may be shown: nothing in it steers a terminal, and it ends somewhere.

use std::borrow::Cow;

/// A quotation in a message shows this many characters of its beginning and of its end.
const QUOTED: (usize, usize) = (80, 30);
/// A message shows this many characters of its beginning, where the file is named, and of its end, where the advice is.
const MESSAGE: (usize, usize) = (1200, 400);

/// Text whose lines stay, control characters apart from tabs shown as escapes.
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c == '\n' || c == '\t')
}

/// A message in one line of bounded length: control characters shown as escapes, what stands between backticks shortened,
/// then the whole.
pub fn one_line(message: &str) -> String {
    let parts: Vec<Cow<'_, str>> = message
        .split('`')
        .enumerate()
        .map(|(place, part)| if place % 2 == 1 { shortened(part, QUOTED) } else { part.into() })
        .collect();
    let whole = parts.join("`");
    escaped(&shortened(&whole, MESSAGE), |_| false).into_owned()
}

/// A count before a sentence about several things, such as `photosites were clipped`; of one it is in the singular.
pub fn counted(count: u64, what: &str) -> String {
    /// Whole words, each of which counts where it stands first among those of its line.
    const SINGULAR: [&[(&str, &str)]; 2] = [
        &[
            ("samples", "sample"),
            ("pixels", "pixel"),
            ("photosites", "photosite"),
            ("signals", "signal"),
            ("values", "value"),
            ("colors", "color"),
            ("bytes", "byte"),
            ("wavelengths", "wavelength"),
            ("flats", "flat"),
            ("darks", "dark"),
            ("frames", "frame"),
        ],
        &[
            ("are", "is"),
            ("were", "was"),
            ("have", "has"),
            ("had", "had"),
            ("do", "does"),
            ("expect", "expects"),
            ("stand", "stands"),
        ],
    ];
    if count != 1 {
        return format!("{count} {what}");
    }
    let mut words: Vec<&str> = what.split(' ').collect();
    for forms in SINGULAR {
        let first = words
            .iter()
            .enumerate()
            .find_map(|(place, word)| forms.iter().find(|(several, _)| several == word).map(|(_, one)| (place, *one)));
        if let Some((place, one)) = first {
            words[place] = one;
        }
    }
    let one = words.join(" ").replace("their ", "its ").replace(" they are", " it is").replace(" they lie", " it lies");
    format!("1 {}", one.replace("that it is large", "that they are large"))
}

/// A number in so many significant digits, as people write it: 7.08, 0.0012, 1234, and 1.2e-5 where zeros would hide it.
pub fn in_digits(value: f64, significant: u8) -> String {
    let after_first = significant.max(1) - 1;
    match value.abs() {
        0.0 => "0".into(),
        1e-3..1e7 => {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a value within 0..9")]
            let digits = (f64::from(after_first) - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.*e}", usize::from(after_first)),
    }
}

/// A share of 1 in per cent, to so many significant digits, or to as many more as it takes that not nearly all reads as all: 99.96.
pub fn percent(share: f64, significant: u8) -> String {
    unlike_all(share, in_digits(100.0 * share, significant))
}

/// The same with so many decimals, or with two digits where it would read as none.
pub fn percent_in_decimals(share: f64, decimals: usize) -> String {
    let shown = format!("{:.decimals$}", 100.0 * share);
    let reads_none = share > 0.0 && shown.parse() == Ok(0.0);
    if reads_none { in_digits(100.0 * share, 2) } else { unlike_all(share, shown) }
}

/// What is `shown` of a share, but for one of less than 1 that would read as 100: that to the first digit of what it lacks.
fn unlike_all(share: f64, shown: String) -> String {
    let lacking = 1.0 - share;
    if !(lacking > 0.0 && shown.parse() == Ok(100.0)) {
        return shown;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 14 digits")]
    let digits = (-2.0 - lacking.log10().floor()).max(1.0) as usize;
    format!("{:.digits$}", 100.0 * share)
}

/// A number rounded to so many significant digits: 40000 of 39 871 in one or two.
pub fn about(value: f64, significant: u8) -> String {
    if value == 0.0 || !value.is_finite() {
        return in_digits(value, significant);
    }
    let unit = 10f64.powf(value.abs().log10().floor() - f64::from(significant.max(1) - 1));
    in_digits((value / unit).round() * unit, significant)
}

/// A time in ms beside what it is in s: 33.3 ms is 0.0333 s.
pub fn ms_in_s(ms: f64) -> String {
    format!("{ms} ms is {} s", in_decimals(ms / 1000.0, 12))
}

/// A number with so many decimals at most, none that say nothing: 4095, 0, -0.5.
pub fn in_decimals(value: f64, most: usize) -> String {
    let shown = format!("{value:.most$}");
    let short = if shown.contains('.') { shown.trim_end_matches('0').trim_end_matches('.') } else { &shown };
    if short == "-0" { "0".into() } else { short.to_owned() }
}

/// How many bytes, in words: all of them where they are few, else in three digits of what disks are sold by.
pub fn bytes_in_words(bytes: u64) -> String {
    const UNITS: [&str; 6] = ["kB", "MB", "GB", "TB", "PB", "EB"];
    if bytes < 10_000 {
        return counted(bytes, "bytes");
    }
    let (mut value, mut unit) = (bytes as f64 / 1e3, 0);
    while value >= 999.5 && unit + 1 < UNITS.len() {
        (value, unit) = (value / 1e3, unit + 1);
    }
    let more = if bytes == u64::MAX { "more than " } else { "" };
    format!("{more}{} {}", in_digits(value, 3), UNITS[unit])
}

/// Escapes what steers a terminal, directions of writing included, but for what is `plain`.
fn escaped(text: &str, plain: impl Fn(char) -> bool) -> Cow<'_, str> {
    let steers = |c: char| {
        let turns =
            matches!(c, '\u{061C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
        (c.is_control() || turns || matches!(c, '\u{2028}' | '\u{2029}')) && !plain(c)
    };
    if !text.contains(steers) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if steers(c) { shown.extend(c.escape_default()) } else { shown.push(c) }
    }
    shown.into()
}

/// The first and the last characters of what is longer than both together.
fn shortened(text: &str, (first, last): (usize, usize)) -> Cow<'_, str> {
    let Some((head, _)) = text.char_indices().nth(first) else { return text.into() };
    let Some((tail, _)) = text.char_indices().rev().nth(last.saturating_sub(1)) else { return text.into() };
    if tail <= head { text.into() } else { format!("{} […] {}", &text[..head], &text[tail..]).into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_all_or_none_does_not_read_so() {
        let shares = [0.0, 1e-9, 0.0012, 0.4, 0.99, 0.995, 76_773.0 / 76_800.0, 1.0 - 1.2e-7, 1.0];
        let wanted = ["0", "1.0e-7", "0.12", "40", "99", "99.5", "99.96", "99.99999", "100"];
        assert_eq!(shares.map(|share| percent(share, 2)), wanted);
        let wanted = ["0.0", "1.0e-7", "0.1", "40.0", "99.0", "99.5", "99.96", "99.99999", "100.0"];
        assert_eq!(shares.map(|share| percent_in_decimals(share, 1)), wanted);
    }

    #[test]
    fn nothing_steers_a_terminal() {
        assert_eq!(visible("a\tb\nc"), "a\tb\nc");
        assert_eq!(
            visible("\u{1b}[2J\u{9b}1m\u{7f}\r\u{202e}x\u{2028}"),
            "\\u{1b}[2J\\u{9b}1m\\u{7f}\\r\\u{202e}x\\u{2028}"
        );
        assert_eq!(one_line("a\tb\nµ"), "a\\tb\\nµ");
    }

    #[test]
    fn numbers_are_written_as_people_do() {
        for (value, digits, wanted) in [
            (7.08, 3, "7.08"),
            (0.001_234, 2, "0.0012"),
            (1234.5, 2, "1234"),
            (-0.0, 2, "0"),
            (1.23e-5, 2, "1.2e-5"),
            (3.2e9, 2, "3.2e9"),
        ] {
            assert_eq!(in_digits(value, digits), wanted);
        }
        for (value, wanted) in [(39_871.0, "40000"), (1.543, "1.5"), (0.0, "0"), (9.96e-4, "0.0010"), (2.34e8, "2.3e8")]
        {
            assert_eq!(about(value, 2), wanted);
        }
        for (value, wanted) in [(-0.04, "0"), (4095.0, "4095"), (-0.5, "-0.5"), (100.0, "100"), (f64::INFINITY, "inf")]
        {
            assert_eq!(in_decimals(value, 1), wanted);
        }
        for (bytes, wanted) in [
            (1, "1 byte"),
            (9_999, "9999 bytes"),
            (12_345, "12.3 kB"),
            (1_000_000, "1.00 MB"),
            (3_000_000_000, "3.00 GB"),
            (u64::MAX, "more than 18.4 EB"),
        ] {
            assert_eq!(bytes_in_words(bytes), wanted);
        }
    }

    #[test]
    fn one_thing_is_in_the_singular() {
        assert_eq!(counted(2, "photosites were clipped"), "2 photosites were clipped");
        for (what, one) in [
            ("photosites were clipped at full well", "1 photosite was clipped at full well"),
            ("samples are saturated, at full well", "1 sample is saturated, at full well"),
            (
                "pixels were made of samples: their values are wrong",
                "1 pixel was made of samples: its values are wrong",
            ),
            (
                "defective photosites were interpolated, and marked",
                "1 defective photosite was interpolated, and marked",
            ),
            ("pixels are NaN; they are left out", "1 pixel is NaN; it is left out"),
            (
                "colors have no temperature, which is NaN: they lie more than 0.05 from black bodies",
                "1 color has no temperature, which is NaN: it lies more than 0.05 from black bodies",
            ),
        ] {
            assert_eq!(counted(1, what), one);
        }
    }

    #[test]
    fn a_message_ends_somewhere() {
        let quoted = one_line(&format!("f.yaml: `{}` is no unit; give --unit", "é".repeat(100_000)));
        let wanted = format!("f.yaml: `{} […] {}` is no unit; give --unit", "é".repeat(80), "é".repeat(30));
        assert_eq!(quoted, wanted);
        let long = one_line(&format!("f.yaml: {}; give --unit", "x".repeat(100_000)));
        assert!(long.chars().count() < 1700 && long.starts_with("f.yaml: x") && long.ends_with("x; give --unit"));
        for short in ["`a` or `b`", "", "`", &"y".repeat(1600)] {
            assert_eq!(one_line(short), short);
        }
    }
}
