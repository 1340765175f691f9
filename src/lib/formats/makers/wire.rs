//! What a child says: an answer, JSON behind its length, and the rows of an image as little-endian words of 16 bits.

use serde::{Deserialize, Serialize};

/// Most bytes of an answer.
pub(super) const MOST_ANSWER_BYTES: u32 = 1 << 20;

/// What became of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Answer {
    /// It is decoded; the rows follow.
    Image(Box<Head>),
    /// It is not, for this reason.
    Refused(String),
    /// The decoder panicked with these words.
    GaveUp(String),
}

/// What a decoded file tells. Places are those of the stored image, from its first column and row on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Head {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1 of what a sensor records.
    pub samples_per_site: usize,
    /// Whether rows and columns of the sensor run at 45 degrees to those that are stored.
    pub rotated: bool,
    /// The filters from the first site on; none of a monochrome sensor.
    pub filters: Option<Filters>,
    /// What no light reads.
    pub black: Black,
    /// The largest codes, of all classes or of each.
    pub white: Vec<f64>,
    /// Left, top, width and height of what sees light.
    pub active: Option<[usize; 4]>,
    /// Those of what converters show.
    pub default_crop: Option<[usize; 4]>,
    /// Who made the camera, and which it is.
    pub camera: String,
    /// Camera from XYZ, by the number of its illuminant (Exif, LightSource).
    pub matrices: Vec<(u16, Vec<f64>)>,
    /// What R, G and B are multiplied by for the white of the exposure.
    pub white_balance: [Option<f64>; 3],
    pub exposure_s: Option<f64>,
    pub f_number: Option<f64>,
    pub iso: Option<u32>,
    pub orientation: Option<u16>,
    /// Raw images in the file.
    pub images: usize,
}

/// A period of a filter array: letters row by row.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Filters {
    pub columns: usize,
    pub rows: usize,
    pub letters: String,
}

/// A period of black levels, row by row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Black {
    pub columns: usize,
    pub rows: usize,
    pub levels: Vec<f64>,
}
