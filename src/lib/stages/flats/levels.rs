//! How bright flats are that count as one.

use crate::stages::level_sums::Unlike;

/// How bright flats are, by which they are brought to one level.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatLevels {
    /// What each frame is multiplied by, class by class; none where they are alike as they are.
    pub(super) factors: Option<Vec<Vec<f64>>>,
    /// The light of each in shares of the mean.
    pub(super) shares: Vec<f64>,
    /// Where they were lit unlike each other.
    pub unlike: Option<Unlike>,
}

impl FlatLevels {
    /// The light of each in shares of the mean, where they are brought to one level.
    pub fn shares(&self) -> Option<&[f64]> {
        self.factors.is_some().then_some(self.shares.as_slice())
    }
}
