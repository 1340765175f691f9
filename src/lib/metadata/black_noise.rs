//! What a black level is uncertain by.

use serde::{Deserialize, Serialize};

/// What a black level is uncertain by that was measured in the masked border of the frame, variances in ADU².
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BlackNoise {
    /// Of the level of each of the 2×2 sites, common to all its photosites.
    pub site_adu2: f64,
    /// Of what a row is off, common to its photosites.
    pub row_adu2: f64,
    /// Of what a column is off.
    pub column_adu2: f64,
}

impl BlackNoise {
    fn each(&self, of: impl Fn(f64) -> f64) -> Self {
        let Self { site_adu2, row_adu2, column_adu2 } = *self;
        Self { site_adu2: of(site_adu2), row_adu2: of(row_adu2), column_adu2: of(column_adu2) }
    }

    /// So many times each.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        self.each(|variance| factor * variance)
    }

    /// The sums of each.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            site_adu2: self.site_adu2 + other.site_adu2,
            row_adu2: self.row_adu2 + other.row_adu2,
            column_adu2: self.column_adu2 + other.column_adu2,
        }
    }

    /// 1 for each that there is.
    #[must_use]
    pub fn signs(&self) -> Self {
        self.each(|variance| if variance > 0.0 { 1.0 } else { 0.0 })
    }
}
