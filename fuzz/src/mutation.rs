//! Changes of documents that leave them documents: other values, keys that are missing. Changes of single bytes seldom get
//! past the parser.

use libfuzzer_sys::fuzzer_mutate;
use serde_yaml::{Mapping, Value};

/// Changes `data[..size]`, a document: every other time as one, otherwise, or where that is not possible, its bytes. Gives the
/// new size.
pub fn of_text(data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let text = std::str::from_utf8(&data[..size]).ok().filter(|_| seed % 2 == 0);
    match text.and_then(|text| changed(text, seed)) {
        Some(text) if text.len() <= max_size => {
            data[..text.len()].copy_from_slice(text.as_bytes());
            text.len()
        }
        _ => fuzzer_mutate(data, size, max_size),
    }
}

/// Numbers and words that are at an edge of something.
const EDGES: [&str; 30] = [
    "0",
    "1",
    "-1",
    "2",
    "0.5",
    "1.0e-308",
    "1.0e308",
    "-1.0e308",
    "1.0e20",
    "1.0e-20",
    "1.0e5",
    "12",
    "16",
    "64",
    "255",
    "65535",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "null",
    "''",
    "[]",
    "{}",
    "[0, 0, 0]",
    "[1, 2, 3]",
    "[1.0e300, 1.0e-300, 0]",
    "[[0, 0, 0], [0, 0, 0], [0, 0, 0]]",
    "[3, 5]",
    "true",
    "[1, 2, 3, 4]",
];

/// Words that metadata know.
const WORDS: [&str; 22] = [
    "adu",
    "electrons",
    "expected_electrons",
    "xyz",
    "xyy",
    "lab",
    "srgb",
    "unspecified",
    "spectral_radiance",
    "color_difference",
    "rggb",
    "bggr",
    "grbg",
    "gbrg",
    "mono",
    "eci",
    "shti",
    "bi",
    "mhc",
    "dcsn",
    "ssn",
    "prnu",
];

/// A row of numbers that follows from the first.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap_or_default() % end.max(1)
    }
}

/// The document with one to three values or keys changed; none where it is none.
pub fn changed(text: &str, seed: u32) -> Option<String> {
    let mut dice = Dice(seed.into());
    let mut document: Value = serde_yaml::from_str(text).ok()?;
    for _ in 0..=dice.below(3) {
        let mut place = dice.below(count(&document));
        change(&mut document, &mut place, &mut dice);
    }
    serde_yaml::to_string(&document).ok()
}

/// Values of a document, those that hold others too.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Mapping(mapping) => mapping.values().map(count).sum::<usize>(),
        Value::Sequence(items) => items.iter().map(count).sum(),
        _ => 0,
    }
}

/// Changes the value of which so many come before; says whether it was met.
fn change(value: &mut Value, place: &mut usize, dice: &mut Dice) -> bool {
    if *place == 0 {
        *value = another(value, dice);
        return true;
    }
    *place -= 1;
    match value {
        Value::Mapping(mapping) => {
            let keys: Vec<Value> = mapping.keys().cloned().collect();
            for key in keys {
                if *place == 0 && dice.below(3) == 0 {
                    mapping.remove(&key);
                    return true;
                }
                if mapping.get_mut(&key).is_some_and(|inner| change(inner, place, dice)) {
                    return true;
                }
            }
            false
        }
        Value::Sequence(items) => items.iter_mut().any(|inner| change(inner, place, dice)),
        _ => false,
    }
}

fn another(value: &Value, dice: &mut Dice) -> Value {
    let edge = |dice: &mut Dice| serde_yaml::from_str(EDGES[dice.below(EDGES.len())]).unwrap_or_default();
    match value {
        Value::Number(number) if dice.below(2) == 0 => {
            let factor = [2.0, 0.5, 1e3, 1e-3, -1.0, 1.0 + 1e-9, 1e12, 1e-12][dice.below(8)];
            number.as_f64().map_or(Value::Null, |number| Value::from(number * factor))
        }
        Value::String(_) if dice.below(4) > 0 => WORDS[dice.below(WORDS.len())].into(),
        Value::Mapping(_) if dice.below(4) > 0 => Value::Mapping(Mapping::new()),
        Value::Sequence(items) if dice.below(2) == 0 => {
            let kept = dice.below(items.len() + 2);
            Value::Sequence(items.iter().cycle().take(kept).cloned().collect())
        }
        _ => edge(dice),
    }
}
