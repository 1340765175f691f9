//! Numbers whose comment names their unit, `EXPTIME = 33.0 / [ms] exposure`.

use super::header::Header;
use crate::text::in_decimals;
use crate::units::kelvin;

/// A unit of a quantity, whose first one its keywords are read in.
#[derive(Debug)]
pub(super) struct Unit {
    /// What it is called in messages, and between brackets.
    name: &'static str,
    /// Others of its names between brackets, where case does not count.
    short: &'static [&'static str],
    /// Its names that mean nothing else anywhere in a comment.
    words: &'static [&'static str],
    /// How a number of this unit reads in the first one.
    in_first: fn(f64) -> f64,
}

/// Times; in s.
pub(super) const TIME: [Unit; 7] = [
    Unit { name: "s", short: &[], words: &["s", "sec", "secs", "second", "seconds"], in_first: |s| s },
    Unit {
        name: "ms",
        short: &[],
        words: &["ms", "msec", "msecs", "millisec", "millisecs", "millisecond", "milliseconds"],
        in_first: |ms| ms / 1e3,
    },
    Unit {
        name: "us",
        short: &["us"],
        words: &["usec", "usecs", "microsec", "microsecs", "microsecond", "microseconds"],
        in_first: |us| us / 1e6,
    },
    Unit { name: "ns", short: &["ns"], words: &["nsec", "nanosecond", "nanoseconds"], in_first: |ns| ns / 1e9 },
    Unit { name: "min", short: &["mins"], words: &["minute", "minutes"], in_first: |min| min * 60.0 },
    Unit { name: "h", short: &["hr", "hrs"], words: &["hour", "hours"], in_first: |h| h * 3600.0 },
    Unit { name: "d", short: &["day", "days"], words: &[], in_first: |d| d * 86_400.0 },
];

/// Temperatures; in K.
pub(super) const TEMPERATURE: [Unit; 3] = [
    Unit { name: "K", short: &["k"], words: &["kelvin", "kelvins"], in_first: |kelvin| kelvin },
    Unit {
        name: "degrees Celsius",
        short: &["c", "degc", "deg c", "deg_c", "deg", "degree", "degrees", "degrees c"],
        words: &["celsius", "centigrade"],
        in_first: kelvin,
    },
    Unit {
        name: "degrees Fahrenheit",
        short: &["f", "degf", "deg f", "deg_f"],
        words: &["fahrenheit"],
        in_first: |fahrenheit| kelvin((fahrenheit - 32.0) / 1.8),
    },
];

/// Lengths of optics; in mm.
pub(super) const LENGTH: [Unit; 4] = [
    Unit { name: "mm", short: &[], words: &["mm", "millimeter", "millimeters"], in_first: |mm| mm },
    Unit { name: "cm", short: &[], words: &["cm", "centimeter", "centimeters"], in_first: |cm| cm * 10.0 },
    Unit { name: "m", short: &["m"], words: &["meter", "meters"], in_first: |m| m * 1e3 },
    Unit { name: "in", short: &["inch", "inches"], words: &[], in_first: |inches| inches * 25.4 },
];

/// The number of a keyword in the first of `units`. It counts as `assumed`, unless its comment begins with another unit between
/// brackets \[FITS4, Sec. 4.3.2], which a note tells; a word for another one further on is a doubt.
pub(super) fn number_of(
    header: &Header,
    key: &str,
    units: &'static [Unit],
    assumed: &str,
    notes: &mut Vec<String>,
    doubts: &mut Vec<String>,
) -> Option<f64> {
    let number = header.number(key)?;
    let usual = units.iter().find(|unit| unit.name == assumed)?;
    let (read, first) = (|unit: &Unit| (unit.in_first)(number), units[0].name);
    let shown = |unit: &Unit| in_decimals(read(unit), 12);
    if let Some(unit) = bracketed(header.comment(key), units) {
        if unit.name != usual.name {
            notes.push(format!("its {key} is in {}, as its comment begins: {} {first}", unit.name, shown(unit)));
        }
        return Some(read(unit));
    }
    if let Some(unit) = named(header.comment(key), units).filter(|unit| unit.name != usual.name && number != 0.0) {
        doubts.push(format!(
            "its {key} of {number} counts as {assumed}, as is the rule, and its comment tells {}; {number} {} is {} {first}, which a \
             comment that begins with [{}] says",
            unit.name,
            unit.name,
            shown(unit),
            unit.short.first().unwrap_or(&unit.name)
        ));
    }
    Some(read(usual))
}

/// The unit between brackets at the start of a comment; none where there is none, or another.
fn bracketed(comment: &str, units: &'static [Unit]) -> Option<&'static Unit> {
    let (inside, _) = comment.strip_prefix('[')?.split_once(']')?;
    let inside = inside.trim().trim_end_matches('.').to_ascii_lowercase();
    let is = |unit: &&Unit| unit.name == inside || unit.short.contains(&&*inside) || unit.words.contains(&&*inside);
    units.iter().find(is)
}

/// The first unit that a comment names.
fn named(comment: &str, units: &'static [Unit]) -> Option<&'static Unit> {
    let lower = comment.to_ascii_lowercase();
    let mut words = lower.split(|letter: char| !letter.is_ascii_alphabetic() && letter != '\'');
    words.find_map(|word| units.iter().find(|unit| unit.words.contains(&word)))
}
