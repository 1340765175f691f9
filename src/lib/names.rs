//! Values of short fixed lists by their names: what options take and files hold.

use serde::de::{Deserializer, Error, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// A value of a short fixed list, known by a name on the command line and in files.
pub trait Named: Copy + Send + Sync + 'static {
    /// All values, in the order in which help lists them.
    const ALL: &'static [Self];

    /// The name that is written.
    fn name(self) -> &'static str;

    /// Other names that are read as well.
    fn other_names(self) -> &'static [&'static str] {
        &[]
    }

    /// All names: the one that is written, then the others.
    fn all_names(self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.name()).chain(self.other_names().iter().copied())
    }

    /// The value of a name, in any case.
    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|value| value.all_names().any(|known| known.eq_ignore_ascii_case(name)))
    }
}

/// The place of a name among those that are known: as it is typed, or, where one alone is so, in another case.
pub fn place_of<'a>(typed: &str, known: impl Iterator<Item = &'a str> + Clone) -> Option<usize> {
    let mut others = known.clone().enumerate().filter(|(_, name)| name.eq_ignore_ascii_case(typed));
    let other = || others.next().filter(|_| others.next().is_none()).map(|(place, _)| place);
    known.clone().position(|name| name == typed).or_else(other)
}

/// The known name that is nearest to one that is typed, by letters that are added, left out, changed or swapped, the first of
/// several; none where all are farther than `farthest` allows a known name to be.
pub fn nearest<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
    farthest: impl Fn(&str) -> usize,
) -> Option<&'a str> {
    let known: Vec<&str> = known.into_iter().collect();
    if let Some(same) = known.iter().find(|known| **known == typed) {
        return Some(same);
    }
    // One that goes on where another ends, as with its unit, is meant rather than one that looks like it.
    let begin = typed.to_owned() + "_";
    if let Some(longer) = known.iter().filter(|known| known.starts_with(&begin)).min_by_key(|known| known.len()) {
        return Some(longer);
    }
    let distances = known.into_iter().map(|known| (strsim::damerau_levenshtein(known, typed), known));
    distances
        .filter(|(distance, known)| *distance <= farthest(known))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}

/// Reads a value that a file holds by its name.
///
/// # Errors
///
/// The names that there are.
pub(crate) fn deserialize<'de, T: Named, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    /// Finds the value inside the deserializer, which knows the place that a complaint is about.
    struct Find<T>(PhantomData<T>);
    impl<T: Named> Visitor<'_> for Find<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a name")
        }

        fn visit_str<E: Error>(self, name: &str) -> Result<T, E> {
            T::named(name).ok_or_else(|| {
                let known: Vec<String> = T::ALL.iter().map(|value| format!("`{}`", value.name())).collect();
                E::custom(format_args!("unknown variant `{name}`, expected one of {}", known.join(", ")))
            })
        }
    }
    from.deserialize_str(Find(PhantomData))
}

/// Makes files hold a value by its name.
macro_rules! serde_by_name {
    ($type:ty) => {
        impl serde::Serialize for $type {
            fn serialize<S: serde::Serializer>(&self, into: S) -> std::result::Result<S::Ok, S::Error> {
                into.serialize_str($crate::names::Named::name(*self))
            }
        }

        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
                $crate::names::deserialize(from)
            }
        }
    };
}
pub(crate) use serde_by_name;

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Meal {
        Breakfast,
        Lunch,
    }

    impl Named for Meal {
        const ALL: &'static [Self] = &[Self::Breakfast, Self::Lunch];

        fn name(self) -> &'static str {
            match self {
                Self::Breakfast => "breakfast",
                Self::Lunch => "lunch",
            }
        }

        fn other_names(self) -> &'static [&'static str] {
            match self {
                Self::Breakfast => &[],
                Self::Lunch => &["dinner"],
            }
        }
    }

    serde_by_name!(Meal);

    #[test]
    fn a_name_is_found_in_another_case_where_no_other_is_so() {
        let place = |typed: &str| place_of(typed, ["x", "y", "Y", "sigma.Y"].into_iter());
        assert_eq!(["y", "Y", "X", "SIGMA.y", "z"].map(place), [Some(1), Some(2), Some(0), Some(3), None]);
        assert_eq!(place_of("A", ["a", "ä", "a"].into_iter()), None);
    }

    #[test]
    fn one_name_is_written_and_all_are_read() {
        assert_eq!(serde_json::to_string(&[Meal::Breakfast, Meal::Lunch]).unwrap(), r#"["breakfast","lunch"]"#);
        assert_eq!(Meal::named("dinner"), Some(Meal::Lunch));
        assert_eq!(serde_yaml::from_str::<Vec<Meal>>("[dinner, breakfast]").unwrap(), [Meal::Lunch, Meal::Breakfast]);
        let complaint = serde_yaml::from_str::<Meal>("supper").unwrap_err().to_string();
        assert!(complaint.contains("unknown variant `supper`, expected one of `breakfast`, `lunch`"), "{complaint}");
    }
}
