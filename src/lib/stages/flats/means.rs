//! What a first reading of flats tells.

use crate::metadata::Illumination;

/// What a first reading of flats tells.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatMeans {
    /// Mean of each class above what no light reads, where all classes are whole, ADU; 0 of a class without a photosite.
    pub(super) means: Vec<f64>,
    /// How many photosites of each class these are the means of, and how many good ones beside them.
    pub(super) photosites: Vec<u64>,
    pub(super) left_out: Vec<u64>,
    /// How many rows and columns of cells these are.
    pub(super) cell_lines: Option<[f64; 2]>,
    /// How many of these photosites each of several amplifiers has read.
    pub(super) tap_photosites: Vec<Vec<u64>>,
    /// Photosites that are saturated in a flat.
    pub full: u64,
    /// What F scatters by from photosite to photosite, noise and response, in shares of the mean; of the class where that is most.
    pub scatter: f64,
    /// Ordinary values of F by class, ADU.
    pub(super) limits: Option<Vec<[f64; 2]>>,
    /// How they were lit.
    pub(super) illumination: Illumination,
    /// What is wrong with the array that they are said to be behind.
    pub doubt: Option<String>,
}

impl FlatMeans {
    /// Ordinary values of F by class, ADU, where defects are looked for.
    pub fn limits(&self) -> Option<&[[f64; 2]]> {
        self.limits.as_deref()
    }

    /// The same with ordinary values of F, ADU by class, beyond which photosites are defective.
    pub fn within(self, limits: &[[f64; 2]]) -> Self {
        Self { limits: Some(limits.to_vec()), ..self }
    }
}
