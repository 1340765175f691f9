//! Cyanometer: from the spectral radiance of a sky to what a Bayer camera records, and on to CIE XYZ, with the
//! uncertainty of the numbers at every step.
//!
//! The programs are thin; the work is here. A module uses its own floor and lower ones (a test reads the sources and
//! enforces it).
//!
//! | floor | modules | what they know |
//! |---|---|---|
//! | 0 words | [`error`], [`units`], [`frame`], [`cfa`] | no files, no chance |
//! | 1 mathematics | [`numerics`], [`random`] | no camera |
//! | 2 physics | [`spectrum`], [`optics`], [`sensor`], [`metadata`], [`stage`], [`render`], [`transfer`], [`noise`], [`adc`], [`correct`], [`mosaic`], [`demosaic`], [`color`], [`propagation`], [`statistics`], [`characterization`] | pure functions of bands and parameters, in the order light meets them |
//! | 3 files | [`formats`], [`report`] | bytes to frames and back |
//! | 4 command line | [`cli`] | options, complaints, exit |
//!
//! # The chain
//!
//! Every step is a [`stage::Stage`]: a value with a method from band to band. [`stage::run`] drives one from a
//! [`stage::RowSource`] to a [`stage::RowSink`]; memory is a few bands whatever the height of the frame. Each sees the
//! frame's head, [`metadata::FrameHeader`], and refuses a frame that comes at the wrong time.
//!
//! # Units
//!
//! Wavelengths in nm, spectral radiance in W cm⁻² sr⁻¹ nm⁻¹, charge in electrons, codes in ADU, luminance in cd m⁻².
//! Samples are 32-bit floats whose quantity is in the type of the window on them; scalars are doubles with the unit in the name.
//!
//! Sources are cited as `[HP2005, Eq. 11]`; the keys resolve in `docs/references.md`.

pub mod cfa;
pub mod error;
pub mod frame;
pub mod units;

pub mod numerics;
pub mod random;

pub mod adc;
pub mod characterization;
pub mod color;
pub mod correct;
pub mod demosaic;
pub mod metadata;
pub mod mosaic;
pub mod noise;
pub mod optics;
pub mod propagation;
pub mod render;
pub mod sensor;
pub mod spectrum;
pub mod stage;
pub mod statistics;
pub mod transfer;

pub mod formats;
pub mod report;

pub mod cli;
