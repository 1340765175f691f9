//! Values by name.

use crate::analysis::characterization::regression::Regression;
use crate::names::Named;
use crate::stages::demosaic::Method;
use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use clap::{Arg, Command};
use std::ffi::OsStr;

/// A parser for a value by one of its names.
pub fn choice<T: Named>() -> impl TypedValueParser<Value = T> {
    one_of(T::ALL)
}

/// A parser for one of these values by its names.
pub fn one_of<T: Named>(values: &'static [T]) -> impl TypedValueParser<Value = T> {
    named_of(values, |_| None)
}

/// A parser for a demosaicking method; the name of a regression is told from others.
pub fn demosaicking() -> impl TypedValueParser<Value = Method> {
    named_of(Method::ALL.as_slice(), |name| {
        Regression::named(name)
            .map(|_| "that is a regression, `--regression` of fit-matrix; here a demosaicking method is wanted")
    })
}

/// A parser for a regression; the name of a demosaicking method is told from others.
pub fn regression() -> impl TypedValueParser<Value = Regression> {
    named_of(Regression::ALL.as_slice(), |name| {
        Method::named(name)
            .map(|_| "that is a demosaicking method; here a regression is wanted, and --demosaic takes the method")
    })
}

/// A parser for one of these values; `elsewhere` says of other names what they are.
fn named_of<T: Named>(
    values: &'static [T],
    elsewhere: fn(&str) -> Option<&'static str>,
) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(values.iter().flat_map(|value| value.all_names()));
    AnyCase { names, elsewhere }.try_map(|name| T::named(&name).ok_or("no value has this name"))
}

/// A parser for names that takes them in any case.
#[derive(Clone)]
struct AnyCase {
    names: PossibleValuesParser,
    /// What a name is that belongs to another option.
    elsewhere: fn(&str) -> Option<&'static str>,
}

impl TypedValueParser for AnyCase {
    type Value = String;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<String, clap::Error> {
        let known = self
            .possible_values()
            .and_then(|mut values| values.find(|known| value.eq_ignore_ascii_case(known.get_name())));
        match known {
            Some(known) => Ok(known.get_name().to_owned()),
            None => match value.to_str().and_then(self.elsewhere) {
                Some(meant) => {
                    let said = format!("{meant}; known here are {}", self.listed());
                    let refusing = StringValueParser::new().try_map(move |_| Err::<String, _>(said.clone()));
                    refusing.parse_ref(command, arg, value)
                }
                None => self.names.parse_ref(command, arg, value),
            },
        }
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        self.names.possible_values()
    }
}

impl AnyCase {
    fn listed(&self) -> String {
        let names = self.possible_values().into_iter().flatten();
        names.map(|name| name.get_name().to_owned()).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Space;
    use crate::stages::demosaic::Method;

    fn read<P: TypedValueParser>(parser: P, text: &str) -> Option<P::Value>
    where
        P::Value: Clone + Send + Sync + 'static,
    {
        let command = clap::Command::new("test")
            .arg(clap::Arg::new("value").value_parser(clap::builder::ValueParser::new(parser)));
        command.try_get_matches_from(["test", text]).ok()?.remove_one("value")
    }

    #[test]
    fn values_are_read_by_all_their_names_and_no_others() {
        for method in Method::ALL {
            for name in method.names() {
                assert_eq!(read(choice::<Method>(), name), Some(method));
            }
        }
        assert_eq!(read(choice::<Method>(), "nearest"), None);
        let some = || one_of(&[Space::Xyz, Space::Lab]);
        assert_eq!((read(some(), "lab"), read(some(), "srgb")), (Some(Space::Lab), None));
    }
}
