//! What a program does, from its arguments to results and notes; without a terminal, an exit, or a word to anyone.
//!
//! A request declares the options that it is made of, each once, with its help: a program takes it among its arguments, a
//! library's user sets what differs from the defaults. It gives its result together with [`Note`]s, which the command line
//! prints and others may read.
//!
//! ```
//! use cyanometer::requests::{NoisePrediction, Scene, SignalLevel};
//!
//! let level = SignalLevel { electrons: Some([8000.0, 12_000.0, 20_000.0]), ..SignalLevel::default() };
//! let (frame, _) = Scene { level, size: Some([64, 48]), ..Scene::default() }.render()?;
//! assert_eq!(frame.samples.len(), 64 * 48 * 3);
//!
//! let predicted = NoisePrediction { level, ..NoisePrediction::default() }.run()?;
//! assert_eq!(predicted.conditions.sensor, "kaf-5101ce");
//! # Ok::<(), cyanometer::error::Error>(())
//! ```

pub mod averaging;
pub mod batch;
pub mod border;
mod border_doubts;
mod border_lines;
pub mod comparison;
pub mod conversion;
pub mod correction;
mod correction_doubts;
mod dark_levels;
pub mod described;
pub mod fit;
mod floor;
mod frame_levels;
pub mod independence;
pub mod measurement;
pub mod options;
pub mod photon_transfer;
pub mod picture;
pub mod prediction;
pub mod sensor;
pub mod values;
mod white_above_darks;

mod notes;
mod other_sensor;
mod raw_files;
mod scene;

pub use comparison::ColorPair;
pub use conversion::Conversion;
pub use fit::Fit;
pub use notes::{
    Note, of_bent_codes, of_expected, of_levels, of_listed_defects, of_marks, of_over_frames, of_reader, of_sigma,
    of_sigma_beside_defects, of_slope, of_statistics,
};
pub use options::SignalLevel;
pub use prediction::NoisePrediction;
pub use raw_files::RawFiles;
pub use scene::{OpenScene, Scene, Uniform};
