//! Where two records differ, in words.

use serde::Serialize;
use serde_yaml::Value;

/// The first key in which two records differ, and what each has there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Keys from the outside in, with dots between them.
    pub key: String,
    /// The values of the first and of the second.
    pub values: [String; 2],
}

impl Difference {
    /// That of two records; none of equal ones, and of what has no keys.
    pub fn of<T: Serialize>(records: [&T; 2]) -> Option<Self> {
        let [first, second] = records.map(|record| serde_yaml::to_value(record).ok());
        between(first?, second?)
    }
}

fn between(first: Value, second: Value) -> Option<Difference> {
    if first == second {
        return None;
    }
    let within = |key: &str, found: Option<Difference>| {
        found.map(|Difference { key: inner, values }| {
            let key = if inner.is_empty() || inner.starts_with('[') {
                format!("{key}{inner}")
            } else {
                format!("{key}.{inner}")
            };
            Difference { key, values }
        })
    };
    match (first, second) {
        (Value::Mapping(first), Value::Mapping(mut second)) => {
            let of_first = first.into_iter().find_map(|(key, value)| {
                let other = second.remove(&key).unwrap_or(Value::Null);
                within(&word(&key), between(value, other))
            });
            of_first.or_else(|| {
                second.into_iter().find_map(|(key, value)| within(&word(&key), between(Value::Null, value)))
            })
        }
        (Value::Sequence(first), Value::Sequence(second)) if first.len() == second.len() => {
            let mut pairs = first.into_iter().zip(second).enumerate();
            pairs.find_map(|(index, (first, second))| within(&format!("[{index}]"), between(first, second)))
        }
        (first, second) => Some(Difference { key: String::new(), values: [first, second].map(|value| word(&value)) }),
    }
}

/// A value in few words.
fn word(value: &Value) -> String {
    match value {
        Value::Null => "not known".into(),
        Value::Bool(flag) => flag.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Sequence(values) => format!("{} values", values.len()),
        Value::Mapping(_) => "known".into(),
        Value::Tagged(tagged) => word(&tagged.value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_key_that_differs_is_told_with_both_values() {
        let differ = |a: &str, b: &str| {
            let [a, b] = [a, b].map(|text| serde_yaml::from_str::<Value>(text).unwrap());
            Difference::of([&a, &b]).map(|Difference { key, values: [a, b] }| format!("{key}: {a}, {b}"))
        };
        assert_eq!(differ("{a: 1, b: {c: 2}}", "{b: {c: 2}, a: 1}"), None);
        assert_eq!(differ("{a: 1, b: {c: 2}}", "{a: 1, b: {c: 3}}").unwrap(), "b.c: 2, 3");
        assert_eq!(differ("{a: [1, {d: x}]}", "{a: [1, {d: y}]}").unwrap(), "a[1].d: x, y");
        assert_eq!(differ("{a: [1, 2]}", "{a: [1, 2, 3]}").unwrap(), "a: 2 values, 3 values");
        assert_eq!(differ("{a: 1}", "{a: 1, b: {c: 2}}").unwrap(), "b: not known, known");
        assert_eq!(differ("{a: 1, b: 7}", "{a: 1}").unwrap(), "b: 7, not known");
    }
}
