//! The black level: what no light reads, and what is left of it once something was subtracted.

use crate::metadata::FrameHeader;
use crate::units::QuantityKind;

/// What is subtracted before interpolation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Black {
    /// What the metadata says: bias plus mean dark signal.
    Auto,
    /// Nothing.
    None,
    /// A level in the unit of the samples.
    Level(f64),
}

impl Black {
    /// The level for a frame; zero where the metadata knows of none.
    pub fn level(self, frame: &FrameHeader) -> f64 {
        let metadata = &frame.metadata;
        match self {
            Self::Level(level) => level,
            Self::None => 0.0,
            Self::Auto => match metadata.quantity {
                QuantityKind::Electrons => metadata.dark_signal_e.unwrap_or(0.0),
                QuantityKind::ExpectedElectrons => 0.0,
                _ => metadata.black_level_adu.unwrap_or(0.0),
            },
        }
    }
}

/// What no light reads once `subtracted` is off; a frame of unknown black counts as black-free after a subtraction.
pub fn black_left(before: Option<f64>, subtracted: f64) -> f64 {
    before.map_or(0.0, |black| black - subtracted)
}
