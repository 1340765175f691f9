//! The scene: what light falls on which sensor, through which lens, for how long.

use crate::analysis::characterization::evaluation::{Filling, SampleExposure};
use crate::camera::optics::Exposure;
use crate::color::rgb::{Encoding, Primaries};
use crate::error::Result;
use crate::requests::sensor::SensorRequest;
use crate::requests::values;
use crate::units::RadianceUnit;
use clap::Args;
use std::path::PathBuf;

/// What light falls on which sensor.
#[derive(Debug, Clone, Args)]
pub struct Subject {
    /// Spectrum or library as CSV, spectral image as EXR, or picture in R, G, B; `-` or none for standard input
    #[arg(conflicts_with_all = ["electrons", "dark"])]
    pub input: Option<PathBuf>,
    /// The sensor.
    #[command(flatten)]
    pub sensor: SensorRequest,
}

/// A lens.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct Lens {
    /// Relative aperture
    #[arg(long, value_name = "N", default_value_t = 8.0, value_parser = values::f_number)]
    pub f_number: f64,
    /// Transmittance of the lens, 0 to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0, value_parser = values::fraction)]
    pub lens_transmittance: f64,
}

impl Lens {
    /// An exposure through this lens.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`].
    pub fn exposed(&self, exposure_s: f64) -> Result<Exposure> {
        let Self { f_number, lens_transmittance } = *self;
        Exposure { exposure_s, f_number, lens_transmittance }.checked()
    }
}

/// An exposure.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct ExposureChoice {
    /// Exposure time in s
    #[arg(id = "exposure", long, value_name = "S", default_value_t = 0.033, value_parser = values::seconds)]
    pub exposure_s: f64,
    /// The lens.
    #[command(flatten)]
    pub lens: Lens,
}

impl ExposureChoice {
    /// What was chosen.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`].
    pub fn chosen(&self) -> Result<Exposure> {
        self.lens.exposed(self.exposure_s)
    }
}

/// How strong the signal of a scene is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct SignalLevel {
    /// Choose the exposure time that puts the brightest class, on the axis, at this fraction of full well
    #[arg(long, value_name = "FRACTION", value_parser = values::filling, conflicts_with_all = ["electrons", "dark", "exposure"])]
    pub expose_to: Option<f64>,
    /// Expected electrons of R,G,B, given outright
    #[arg(long, value_name = "R,G,B", value_parser = values::electrons, allow_hyphen_values = true)]
    pub electrons: Option<[f64; 3]>,
    /// No light at all
    #[arg(long, conflicts_with = "electrons")]
    pub dark: bool,
}

impl SignalLevel {
    /// Electrons that are given outright; none of them in the dark.
    pub fn given(&self) -> Option<[f64; 3]> {
        if self.dark { Some([0.0; 3]) } else { self.electrons }
    }
}

/// Which spectrum of a file, and in which unit.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct SpectrumChoice {
    /// Unit of the radiance, such as "W m-2 sr-1 nm-1"; by default what the file says, or W cm-2 sr-1 nm-1
    #[arg(long, value_name = "UNIT", value_parser = values::radiance_unit, conflicts_with_all = ["electrons", "dark"])]
    pub radiance_unit: Option<RadianceUnit>,
    /// Column of the spectrum in a table
    #[arg(long, value_name = "NAME", conflicts_with_all = ["sample", "electrons", "dark"])]
    pub column: Option<String>,
    /// One spectrum of a library, counted from 0 (pixels row by row)
    #[arg(long, value_name = "N", conflicts_with_all = ["electrons", "dark"])]
    pub sample: Option<usize>,
}

/// How a picture in R, G, B becomes a scene.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct PictureChoice {
    /// How its samples stand for light: srgb, linear, or the power of them that it is; by default what the file says, linear
    /// for floats, srgb for integers
    #[arg(long, value_name = "srgb|linear|POWER", value_parser = values::encoding)]
    pub rgb: Option<Encoding>,
    /// Its primaries: srgb, display-p3, rec2020, adobe-rgb, acescg, aces, or x,y of R, G, B and white; by default what the
    /// file says, or srgb
    #[arg(long, value_name = "NAME|X,Y,...", value_parser = values::primaries, allow_hyphen_values = true)]
    pub primaries: Option<Primaries>,
    /// The light on the scene: a, d50, d55, d65, d75, e, a temperature such as 3200K, or a table of relative power (CSV); d65 by
    /// default
    #[arg(long, value_name = "NAME|FILE")]
    pub illuminant: Option<String>,
    /// Luminance of R = G = B = 1 in cd/m2; by default what the file says (whiteLuminance), or 1000
    #[arg(long, value_name = "CD_PER_M2", value_parser = values::positive)]
    pub luminance: Option<f64>,
}

impl PictureChoice {
    /// Whether any of it was chosen.
    pub fn is_given(&self) -> bool {
        *self != Self::default()
    }
}

/// How each sample of a library is exposed.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct SampleExposureChoice {
    /// Exposure time in s of every sample; with --expose-to, the aperture is chosen instead of the time
    #[arg(id = "exposure", long, value_name = "S", value_parser = values::seconds)]
    pub exposure_s: Option<f64>,
    /// The lens.
    #[command(flatten)]
    pub lens: Lens,
    /// Expose each sample so that its brightest class fills this fraction of full well; 0.75 where no --exposure is given
    #[arg(long, value_name = "FRACTION", value_parser = values::fraction)]
    pub expose_to: Option<f64>,
}

impl SampleExposureChoice {
    /// What was chosen.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`].
    pub fn chosen(&self) -> Result<SampleExposure> {
        // A time that is chosen for each sample makes no odds.
        let base = self.lens.exposed(self.exposure_s.unwrap_or(1.0))?;
        Ok(match (self.exposure_s, self.expose_to) {
            (Some(_), None) => SampleExposure::Fixed(base),
            (Some(_), Some(fraction)) => SampleExposure::Filled { base, fraction, by: Filling::Aperture },
            (None, fraction) => {
                let fraction = fraction.unwrap_or(DEFAULT_FILLING);
                SampleExposure::Filled { base, fraction, by: Filling::Time }
            }
        })
    }
}

/// Share of full well that samples are exposed to where nothing else is said: that of the tests of [HP2005, Sec. 4.1].
const DEFAULT_FILLING: f64 = 0.75;
