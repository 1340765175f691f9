//! How the program that took a frame stored it.

use crate::names::{Named, serde_by_name};
use serde::{Deserialize, Serialize};

/// Which row of a picture a file begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirstRow {
    /// The top one, as the file tells.
    Top,
    /// The lowest, as the file tells.
    Bottom,
    /// Taken for the top one: the file does not tell.
    Untold,
}

serde_by_name!(FirstRow);

impl Named for FirstRow {
    const ALL: &'static [Self] = &[Self::Top, Self::Bottom, Self::Untold];

    fn name(self) -> &'static str {
        match self {
            Self::Top => "top",
            Self::Bottom => "bottom",
            Self::Untold => "untold",
        }
    }
}

/// How the program that took a frame stored it, as its file tells.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CaptureRecord {
    /// Column and row of the sensor, binned as the frame is, that it begins at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subframe: Option<[i64; 2]>,
    /// Which row the file began with; rows stand from the top one on all the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_row: Option<FirstRow>,
    /// What was taken off or divided by: B a bias, D a dark, F a flat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibrated: Option<String>,
}

impl CaptureRecord {
    /// Why the photosites of a frame are not those of another that was stored so.
    pub fn misfit(&self, other: &Self, its: &str) -> Option<String> {
        if let Some((here, there)) = self.subframe.zip(other.subframe).filter(|(here, there)| here != there) {
            let place = |[x, y]: [i64; 2]| format!("column {x} and row {y}");
            return Some(format!(
                "it begins at {} of the sensor, and {its} at {} (XORGSUBF, YORGSUBF): their photosites are others",
                place(here),
                place(there)
            ));
        }
        let order = "which row it begins with (ROWORDER)";
        match (self.first_row?, other.first_row?) {
            (FirstRow::Untold, FirstRow::Bottom) => Some(format!(
                "it does not tell {order}, and {its} begins with the lowest: write ROWORDER into its header, BOTTOM-UP where one program wrote both"
            )),
            (FirstRow::Bottom, FirstRow::Untold) => Some(format!(
                "it begins with the lowest row (ROWORDER), and {its} does not tell: write ROWORDER into that header, BOTTOM-UP where one program \
                 wrote both"
            )),
            _ => None,
        }
    }

    /// Whether a step was taken before, by its letter.
    pub fn is_calibrated(&self, letter: char) -> bool {
        self.calibrated.as_ref().is_some_and(|steps| steps.contains(letter))
    }
}
