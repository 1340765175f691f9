//! What is made of demosaicked channels, as predictions know it: XYZ, and colors that are straight or curved in them.

use super::curved;
use super::unpredictable::{Predicted, Unpredictable};
use crate::color::luv::{luv_about, luv_from_xyz};
use crate::color::{self, Local};
use crate::metadata::Metadata;
use crate::units::QuantityKind;
use nalgebra::Matrix3;

/// Why nothing is said of other colors.
pub(super) const OTHER_COLORS: &str = "of colors XYZ, xyY, L*a*b*, L*u*v* and linear sRGB are predicted";

/// Channels that are made of demosaicked ones: `matrix` times these less `black`, in a space that is curved in that, or as they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Channels {
    pub matrix: Matrix3<f64>,
    pub black: f64,
    pub space: Option<Curved>,
}

impl Channels {
    /// Those of a frame whose photosites are of such a quantity.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Missing`] where the metadata do not say how they were made, [`Unpredictable::Beyond`] for other colors.
    pub fn of(metadata: &Metadata, of_sites: QuantityKind) -> Predicted<Self> {
        let Some(record) = &metadata.color else {
            let is_camera = metadata.quantity == of_sites;
            let camera = Self { matrix: Matrix3::identity(), black: 0.0, space: None };
            return if is_camera { Ok(camera) } else { Err(Unpredictable::Missing("color")) };
        };
        let xyz = record.xyz_from_adu(metadata.exposure).ok_or(Unpredictable::Missing("exposure"))?;
        let space = Curved::of(metadata)?;
        let matrix = match metadata.quantity {
            QuantityKind::LinearSrgb => color::linear_srgb_from_xyz(white(metadata)?) * xyz,
            QuantityKind::Xyz => xyz,
            _ if space.is_some() => xyz,
            _ => return Err(Unpredictable::Beyond(OTHER_COLORS)),
        };
        Ok(Self { matrix, black: record.black_adu, space })
    }
}

/// A space that is curved in XYZ; L*a*b* and L*u*v* with their white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Curved {
    Xyy,
    Lab([f64; 3]),
    Luv([f64; 3]),
}

/// Whether samples are of such a space.
pub(super) fn is_curved(quantity: QuantityKind) -> bool {
    matches!(quantity, QuantityKind::Xyy | QuantityKind::Lab | QuantityKind::Luv)
}

/// The white that colors of a frame refer to.
///
/// # Errors
///
/// [`Unpredictable::Missing`] where there is none.
pub(super) fn white(metadata: &Metadata) -> Predicted<[f64; 3]> {
    metadata.color.as_ref().and_then(|record| record.white).ok_or(Unpredictable::Missing("color.white"))
}

impl Curved {
    /// The space of a frame; none of a straight one.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Missing`] where it needs a white that is not known.
    pub fn of(metadata: &Metadata) -> Predicted<Option<Self>> {
        Ok(match metadata.quantity {
            QuantityKind::Xyy => Some(Self::Xyy),
            QuantityKind::Lab => Some(Self::Lab(white(metadata)?)),
            QuantityKind::Luv => Some(Self::Luv(white(metadata)?)),
            _ => None,
        })
    }

    /// The space about a color.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`] where that has no chromaticity.
    pub fn about(self, xyz: [f64; 3]) -> Predicted<Local> {
        let found = match self {
            Self::Xyy => color::xyy_about(xyz),
            Self::Lab(white) => Some(color::lab_about(xyz, white)),
            Self::Luv(white) => luv_about(xyz, white),
        };
        found.ok_or(Unpredictable::Beyond("its mean has no chromaticity"))
    }

    /// A color in the space.
    pub fn value(self, xyz: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Xyy => {
                let [x, y, z] = xyz;
                [x / (x + y + z), y / (x + y + z), y]
            }
            Self::Lab(white) => color::lab_from_xyz(xyz, white),
            Self::Luv(white) => luv_from_xyz(xyz, white),
        }
    }

    /// Whether noise is so small a share of X, Y and Z that its moments can be propagated; L*a*b* is straight in what is dark.
    pub fn is_quiet(self, mean: [f64; 3], covariance: &Matrix3<f64>) -> bool {
        let is_straight = |i: usize, brightest: f64| match self {
            Self::Lab(white) => brightest < color::LAB_STRAIGHT_BELOW * white[i],
            Self::Xyy | Self::Luv(_) => false,
        };
        (0..3).all(|i| {
            let (mean, std) = (mean[i], covariance[(i, i)].max(0.0).sqrt());
            is_straight(i, mean + 6.0 * std) || std <= curved::LARGEST_SHARE * mean
        })
    }
}
