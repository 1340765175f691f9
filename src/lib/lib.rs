//! Cyanometer: from the spectral radiance of a sky to what a Bayer camera records, and on to CIE XYZ, with the
//! uncertainty of the numbers at every step.
//!
//! The programs are thin; the work is below them. A module uses its own floor and lower ones (a test reads the sources and
//! enforces it).
//!
//! | floor | modules | what they know |
//! |---|---|---|
//! | 0 words | [`error`], [`text`], [`units`], [`names`], [`cfa`], [`frame`] | no files, no chance |
//! | 1 mathematics | [`numerics`], [`random`], [`plot`] | no camera, no file |
//! | 2 light and camera | [`spectrum`], [`color`], [`camera`] | curves, color spaces, lens and sensor in numbers; no frame |
//! | 3 frames in motion | [`metadata`], [`stream`] | what is known of a frame, and how its rows move |
//! | 4 stages | [`stages`] | what each step does to rows, in the order in which light meets them |
//! | 5 prediction | [`propagation`] | moments by formula, from the head of a frame |
//! | 6 the chain | [`chain`], [`sigma`], [`masking`] | stages and predictions together |
//! | 7 analysis | [`analysis`] | statistics beside predictions, differences, matrices |
//! | 8 files | [`formats`] | bytes to frames and back |
//! | 9 requests | [`requests`] | what a program does, from its arguments to results and notes |
//! | 10 reports | [`report`] | tables and figures |
//! | 11 command line | [`cli`] | complaints, progress, exit |
//! | 12 programs | [`programs`] | the arguments of each |
//!
//! # The chain
//!
//! What turns one frame into another, band by band, is a [`stream::Stage`]: a value with a method from band to band.
//! [`stream::run`] drives one from a [`stream::RowSource`] to a [`stream::RowSink`]; memory is a few bands whatever the
//! height of the frame. Each sees the frame's head, [`metadata::FrameHeader`], and refuses a frame that comes at the wrong
//! time. Rendering starts a chain, so that it is no stage but fills a sink; statistics end one.
//!
//! `examples/` has three short programs: noise on an array, the covariance of a pixel by formula, a stage of one's own.
//!
//! # Units
//!
//! Wavelengths in nm, spectral radiance in W cm⁻² sr⁻¹ nm⁻¹, charge in electrons, codes in ADU, luminance in cd m⁻².
//! Samples are 32-bit floats. Stages that take one quantity alone say so in the type of the window on them; where a stage
//! serves several, as the mosaic does, the head of the frame tells which it is. Scalars are doubles with the unit in the
//! name.
//!
//! Sources are cited as `[HP2005, Eq. 11]`; the keys resolve in `docs/references.md`.

pub mod cfa;
pub mod error;
pub mod frame;
pub mod names;
pub mod text;
pub mod units;

pub mod numerics;
pub mod plot;
pub mod random;

pub mod camera;
pub mod color;
pub mod spectrum;

pub mod metadata;
pub mod stream;

pub mod stages;

pub mod propagation;

pub mod chain;
pub mod masking;
pub mod sigma;

pub mod analysis;

pub mod formats;

pub mod requests;

pub mod report;

pub mod cli;

// Unit tests have no use for them, and need not wait until they are compiled.
#[cfg(not(test))]
pub mod programs;
