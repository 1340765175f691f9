//! Dark and bias frames that count as one: what they make of it comes off a frame while its rows are read.

mod alike;
pub mod cut_off;
mod fitness;
mod frames;
mod stack;

pub(super) use alike::{check_alike, check_codes, check_setting};
pub use cut_off::CutOff;
pub(crate) use fitness::Fitness;
pub use fitness::{DRIFT, Misfit};
pub use frames::{DarkFrames, DarkLimits, LessDarks};
pub use stack::{DarkSettings, DarkStack};
