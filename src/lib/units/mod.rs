//! Constants of nature, conversions of units, and the quantities that samples can be in.
//!
//! Wavelengths are in nm, spectral radiance in W cm⁻² sr⁻¹ nm⁻¹, areas in cm², charge in electrons, luminance in
//! cd m⁻². Every conversion stands here; a bare power of ten elsewhere is a defect.

mod comment;
mod heading;
mod other;
mod quantity;
mod spectral;
mod spelling;
mod wavelength;
pub mod written;

pub use comment::units_in;
pub use heading::{is_per_cent, unit_of_heading};
pub use other::OtherUnit;
pub use spectral::{RadianceUnit, Stated};
pub use wavelength::WavelengthUnit;

use crate::names::{Named, serde_by_name};
use std::fmt;

/// Planck constant h in J s (exact, SI 2019).
pub const PLANCK_J_S: f64 = 6.626_070_15e-34;
/// Speed of light c in m s⁻¹ (exact).
pub const LIGHT_M_PER_S: f64 = 299_792_458.0;
/// Boltzmann constant k in J K⁻¹ (exact, SI 2019).
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;
/// Elementary charge in C (exact, SI 2019).
pub const ELEMENTARY_CHARGE_C: f64 = 1.602_176_634e-19;
/// Boltzmann constant in eV K⁻¹.
pub const BOLTZMANN_EV_PER_K: f64 = BOLTZMANN_J_PER_K / ELEMENTARY_CHARGE_C;
/// Maximum luminous efficacy K_m in lm W⁻¹.
pub const LUMINOUS_EFFICACY_LM_PER_W: f64 = 683.0;
/// Wavelength in vacuum times the energy of its photons, h c, in nm eV.
pub const NM_EV: f64 = PLANCK_J_S * LIGHT_M_PER_S / ELEMENTARY_CHARGE_C / M_PER_NM;
/// Meters in a nanometer.
pub const M_PER_NM: f64 = 1e-9;
/// Nanometers in a centimeter.
pub const NM_PER_CM: f64 = 1e7;
/// Centimeters in a micrometer.
pub const CM_PER_UM: f64 = 1e-4;
/// Millimeters in a micrometer.
pub const MM_PER_UM: f64 = 1e-3;
/// Square centimeters in a square meter.
pub const CM2_PER_M2: f64 = 1e4;

/// A fraction of one in per cent, to twelve digits: of 99.999 it is 0.99999, not what binary fractions make of it.
pub fn of_per_cent(x: f64) -> f64 {
    format!("{:.11e}", x / 100.0).parse().unwrap_or(x / 100.0)
}

/// A temperature in K of one in °C, to the hundredth that people read.
pub fn kelvin(celsius: f64) -> f64 {
    /// 0 °C in hundredths of a K (exact).
    const ZERO_CELSIUS: f64 = 27_315.0;
    (celsius * 100.0 + ZERO_CELSIUS).round() / 100.0
}

/// What the samples of a frame are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum QuantityKind {
    /// Nothing is known about the samples: another program's file without metadata.
    #[default]
    Unspecified,
    /// Spectral radiance, one channel per wavelength.
    SpectralRadiance,
    /// Expected signal electrons of each photosite, without noise and without dark signal.
    ExpectedElectrons,
    /// Electrons of one noisy exposure.
    Electrons,
    /// Codes of the analog-to-digital converter, or values on that scale (signed, fractional once the black level
    /// is off).
    Adu,
    /// Absolute CIE XYZ; Y in cd m⁻².
    Xyz,
    /// CIE chromaticities x, y and luminance Y in cd m⁻².
    Xyy,
    /// CIE 1976 L*a*b*.
    Lab,
    /// CIE 1976 L*u*v*.
    Luv,
    /// Correlated color temperature in K, distance from black bodies Duv, and luminance Y in cd m⁻².
    Cct,
    /// sRGB encoded for viewing, 0…1.
    Srgb,
    /// Linear light of the primaries of sRGB, white 1.
    LinearSrgb,
    /// Differences of colors, by each formula.
    ColorDifference,
}

serde_by_name!(QuantityKind);

impl Named for QuantityKind {
    const ALL: &'static [Self] = &[
        Self::Unspecified,
        Self::SpectralRadiance,
        Self::ExpectedElectrons,
        Self::Electrons,
        Self::Adu,
        Self::Xyz,
        Self::Xyy,
        Self::Lab,
        Self::Luv,
        Self::Cct,
        Self::Srgb,
        Self::LinearSrgb,
        Self::ColorDifference,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Unspecified => "unspecified",
            Self::SpectralRadiance => "spectral_radiance",
            Self::ExpectedElectrons => "expected_electrons",
            Self::Electrons => "electrons",
            Self::Adu => "adu",
            Self::Xyz => "xyz",
            Self::Xyy => "xyy",
            Self::Lab => "lab",
            Self::Luv => "luv",
            Self::Cct => "cct",
            Self::Srgb => "srgb",
            Self::LinearSrgb => "linear_srgb",
            Self::ColorDifference => "color_difference",
        }
    }
}

impl QuantityKind {
    /// The unit of the samples, in ASCII.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Unspecified => "unspecified",
            Self::SpectralRadiance => "W cm-2 sr-1 nm-1",
            Self::ExpectedElectrons | Self::Electrons => "e-",
            Self::Adu => "ADU",
            Self::Xyz => "cd m-2",
            Self::Xyy => "1, 1, cd m-2",
            Self::Cct => "K, 1, cd m-2",
            Self::Lab | Self::Luv | Self::Srgb | Self::LinearSrgb | Self::ColorDifference => "1",
        }
    }

    /// The programs that take what ends the chain, colors and what is made of them; nothing of what a stage before it holds.
    pub fn takers(self) -> &'static str {
        match self {
            Self::Xyz => "`to-xyz --space`, `color-difference`, `measure` and `preview`",
            Self::Xyy | Self::Lab => "`color-difference`, `measure` and `preview`",
            Self::Luv | Self::Cct | Self::Srgb | Self::LinearSrgb | Self::ColorDifference => "`measure` and `preview`",
            Self::Unspecified | Self::SpectralRadiance | Self::ExpectedElectrons | Self::Electrons | Self::Adu => "",
        }
    }

    /// The unit of colors that follow from relative XYZ; [`Self::unit`] of those that have no luminance.
    pub fn relative_unit(self) -> &'static str {
        match self {
            Self::Xyz => RELATIVE_UNIT,
            Self::Xyy => "1, 1, relative",
            Self::Cct => "K, 1, relative",
            other => other.unit(),
        }
    }
}

/// Unit of relative XYZ: Y = 1 for the white by which the first class of a camera reaches its white level.
pub const RELATIVE_UNIT: &str = "relative";

/// A unit in ASCII as it is printed: cd m⁻² of `cd m-2`, e⁻ of `e-`.
pub fn typeset(unit: &str) -> String {
    let mut raised = false;
    let raise = |c: char| {
        raised = match c {
            '-' | '^' => true,
            digit => raised && digit.is_ascii_digit(),
        };
        match (c, raised) {
            ('-', _) => '⁻',
            (digit @ '0'..='9', true) => {
                ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize - '0' as usize]
            }
            (other, _) => other,
        }
    };
    unit.chars().map(raise).filter(|c| *c != '^').collect()
}

impl fmt::Display for QuantityKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unspecified => "samples of unknown quantity",
            Self::SpectralRadiance => "spectral radiance",
            Self::ExpectedElectrons => "expected electrons",
            Self::Electrons => "electrons",
            Self::Adu => "ADU",
            Self::Xyz => "XYZ",
            Self::Xyy => "xyY",
            Self::Lab => "L*a*b*",
            Self::Luv => "L*u*v*",
            Self::Cct => "color temperatures",
            Self::Srgb => "sRGB",
            Self::LinearSrgb => "linear sRGB",
            Self::ColorDifference => "color differences",
        })
    }
}

/// A quantity as a type, so that a [`crate::frame::Window`] on one cannot enter a function that takes another.
pub trait Quantity: Copy + Send + Sync + 'static {}

macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {
        $($(#[$doc])* #[derive(Debug, Clone, Copy)] pub struct $name; impl Quantity for $name {})*
    };
}

quantities! {
    /// Expected signal electrons, free of noise.
    ExpectedElectrons,
    /// Electrons of an exposure.
    Electrons,
    /// Codes of the converter.
    Adu,
    /// CIE XYZ, or a space derived from it.
    Tristimulus,
    /// Whatever the file holds: for stages that only move or count samples.
    Any,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectral_radiance_is_in_our_unit() {
        assert_eq!(QuantityKind::SpectralRadiance.unit(), RadianceUnit::default().to_string());
    }
}
