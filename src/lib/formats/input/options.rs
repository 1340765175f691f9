//! What to open, and how.

use crate::analysis::statistics::Region;
use crate::camera::sensor::Sensor;
use crate::cfa::FilterArray;
use crate::formats::headerless;
use crate::formats::sequence::Sequence;
use std::path::PathBuf;

/// What to open.
#[derive(Debug, Clone, Default)]
pub struct InputOptions {
    /// The file; none or `-` for the standard input.
    pub path: Option<PathBuf>,
    /// The frames that the next is taken of, instead of a file that holds one.
    pub sequence: Option<Sequence>,
    /// Part of a multi-part EXR, page of a TIFF, HDU of a FITS.
    pub part: usize,
    /// Whether a file of a single part is read whichever part is named.
    pub or_single_part: bool,
    /// How the samples lie in a file without a header; none where the file says what it is.
    pub raw: Option<headerless::Layout>,
    /// A file whose metadata count before all others.
    pub metadata: Option<PathBuf>,
    /// Whether channels besides R, G, B or Y are kept.
    pub all_channels: bool,
    /// The channel that is taken alone, as a single plane; none for those of the frame.
    pub channel: Option<String>,
    /// The rectangle that is taken alone; none for all of the frame. Its photosites keep their places on the sensor.
    pub crop: Option<Region>,
    /// Whether codes are made proportional to charge, by the linearization of their sensor.
    pub linearize: Linearizing,
    /// What a user says of the camera that took the frame and others, which counts where it does not say it itself.
    pub camera: OfCamera,
    /// Whether samples that are heaped at the top are told, where nothing else tells that they are saturated.
    pub tells_top: bool,
    /// Whether a plane behind a filter array is meant, which of several channels is found by its name where none is named.
    pub wants_plane: bool,
}

/// What a user says of a camera.
#[derive(Debug, Clone, Default)]
pub struct OfCamera {
    /// Filter array of a single plane.
    pub cfa: Option<FilterArray>,
    /// White level of codes.
    pub white_level_adu: Option<f64>,
    /// The file of metadata that describes a frame which has none: of the camera it holds for others of the same kind.
    pub description: Option<PathBuf>,
}

/// Whether codes are made proportional to charge as they are read.
#[derive(Debug, Clone, Default)]
pub enum Linearizing {
    /// They stay as they are.
    #[default]
    No,
    /// By the sensor of the metadata, or this one where they name none.
    As(Option<Box<Sensor>>),
}
