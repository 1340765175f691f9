//! What is said of the exposure of a chart's frame.

use super::super::described::SaidExposure;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};

/// What is said of the exposure of a chart's frame, by the options that tell how the samples of a library are exposed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ChartExposure(pub(super) SaidExposure);

impl ChartExposure {
    /// The options, by the name that they have here.
    pub(super) const OPTIONS: [&str; 3] = ["exposure", "f_number", "lens_transmittance"];
}

impl Args for ChartExposure {
    /// None of its own: those of a library's samples.
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl FromArgMatches for ChartExposure {
    fn from_arg_matches(found: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let is_of_library = matches!(found.try_contains_id("library"), Ok(true));
        let [exposure_s, f_number, lens_transmittance] = Self::OPTIONS.map(|option| {
            let is_known = found.try_contains_id(option).is_ok() && !is_of_library;
            if is_known && found.value_source(option) == Some(ValueSource::CommandLine) {
                found.try_get_one::<f64>(option).ok().flatten().copied()
            } else {
                None
            }
        });
        Ok(Self(SaidExposure { exposure_s, f_number, lens_transmittance }))
    }

    fn update_from_arg_matches(&mut self, found: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(found)?;
        Ok(())
    }
}
