//! Groups of options that several programs share.

mod frames;
mod noise;
mod scene;
mod sensor;

pub use frames::{Following, Input, Makes, Output, Selection};
pub use noise::{DrawnNoise, NoiseChoice};
pub use scene::{ExposureChoice, Lens, PictureChoice, SampleExposureChoice, SignalLevel, SpectrumChoice, Subject};
pub use sensor::SensorChoice;

use super::values;
use crate::color::White;
use crate::error::{Error, Result};
use clap::{Args, Command};
use std::ffi::OsString;

/// A request as its options have it where `words` alone are given: what is declared as default is the default everywhere.
pub(super) fn defaults<R: Args>(words: &[OsString]) -> R {
    let command = R::augment_args(Command::new("defaults").no_binary_name(true));
    let parsed = command.try_get_matches_from(words).and_then(|matches| R::from_arg_matches(&matches));
    parsed.unwrap_or_else(|error| panic!("the defaults of a request contradict each other: {error}"))
}

/// The white that colors refer to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct WhiteChoice {
    /// White of L*a*b*: d65 by default, d50, e, or its X,Y,Z on the scale of the XYZ: cd/m2, or relative by a matrix that says so
    #[arg(long, value_name = "d65|d50|e|X,Y,Z", value_parser = values::white, allow_hyphen_values = true)]
    pub white: Option<White>,
    /// Luminance of the white d65, d50 or e in cd/m2; by default that at which the camera saturates
    #[arg(long, value_name = "CD_PER_M2", value_parser = values::positive)]
    pub white_luminance: Option<f64>,
}

impl WhiteChoice {
    /// Makes sure that a luminance is given to a white that has none of its own.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`].
    pub fn check(&self) -> Result<()> {
        match self.white {
            Some(White::Absolute(_)) if self.white_luminance.is_some() => {
                Err(Error::Usage("a white of X,Y,Z has its luminance already".into()).leave_out(&["white_luminance"]))
            }
            _ => Ok(()),
        }
    }

    /// The white that is given, or D65.
    pub fn or_daylight(&self) -> White {
        self.white.unwrap_or_default()
    }
}
