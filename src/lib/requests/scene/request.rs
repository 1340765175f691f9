//! What is to be rendered: the options of a scene.

use crate::cfa::CfaPattern;
use crate::names::Named;
use crate::numerics::quadrature::Rule;
use crate::requests::options::{ExposureChoice, PictureChoice, SignalLevel, SpectrumChoice, Subject, defaults};
use crate::requests::values;
use crate::spectrum::WavelengthGrid;
use clap::Args;

/// What is to be rendered, and how.
#[derive(Debug, Clone, Args)]
pub struct Scene {
    /// Light and sensor.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the frame in photosites; by default the sensor's, or that of the patches of an image
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = values::size)]
    pub size: Option<[usize; 2]>,
    /// Exposure time and lens.
    #[command(flatten)]
    pub exposure: ExposureChoice,
    /// Focal length in mm, for --vignetting
    #[arg(id = "focal-length", long, value_name = "MM", default_value_t = 50.0, value_parser = values::positive, requires = "vignetting")]
    pub focal_length_mm: f64,
    /// Darken the frame away from its center by the fourth power of the cosine
    #[arg(long)]
    pub vignetting: bool,
    /// How strong the signal is.
    #[command(flatten)]
    pub level: SignalLevel,
    /// Wavelengths to sum over, in nm; by default 360:830:1, or all of a spectrum's own between these where any are closer
    #[arg(long, value_name = "START:END:STEP", value_parser = values::wavelengths, conflicts_with_all = ["electrons", "dark"])]
    pub wavelengths: Option<WavelengthGrid>,
    /// Rule of summation
    #[arg(long, default_value = Rule::default().name(), value_parser = values::choice::<Rule>(), conflicts_with_all = ["electrons", "dark"])]
    pub quadrature: Rule,
    /// Which spectrum of a file.
    #[command(flatten)]
    pub spectrum: SpectrumChoice,
    /// Photosites that show one pixel of an image, by default 1x1; or one spectrum of a table, to show them all
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub patch: Option<[usize; 2]>,
    /// Render only the plane that the mosaic of this pattern keeps: rggb, bggr, grbg or gbrg
    #[arg(long, value_name = "PATTERN", value_parser = values::pattern)]
    pub cfa: Option<CfaPattern>,
    /// The same by its other name.
    #[arg(long, hide = true, value_name = "PATTERN", value_parser = values::pattern)]
    pub pattern: Option<CfaPattern>,
    /// Part of a multi-part EXR, counted from 0
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub part: usize,
    /// How a picture becomes a scene.
    #[command(flatten)]
    pub picture: PictureChoice,
}

impl Default for Scene {
    /// The radiance that comes through the standard input, on the default sensor behind the paper's lens, at its exposure,
    /// and over its wavelengths.
    fn default() -> Self {
        defaults(&[])
    }
}

impl Scene {
    /// The focal length, where vignetting is wanted.
    pub(super) fn vignetting_focal_length_mm(&self) -> Option<f64> {
        self.vignetting.then_some(self.focal_length_mm)
    }
}
