//! Standard deviations beside pixels: a stage that wraps demosaicking or conversion and adds their layers.
//!
//! The noise of each pixel follows from the sensor's noise model at the pixel's own level ([`PixelNoise`]), so that scenes
//! need not be uniform.

use crate::camera::levels::BlackLevel;
use crate::color::Space;
use crate::error::Result;
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{Coverage, FrameHeader};
use crate::propagation::covariance::{stds, through};
use crate::propagation::pixels::PixelNoise;
use crate::stages::demosaic::Demosaic;
pub use crate::stages::from_xyz::COVARIANCE_LAYER;
use crate::stages::from_xyz::layers_of;
use crate::stages::to_xyz::ToXyz;
use crate::stream::{Counts, Footprint, Stage};
use crate::units::QuantityKind;
use nalgebra::{Matrix3, Vector3};

/// Whether a channel is a layer that tells how uncertain pixels are, by its name.
pub fn is_layer(name: &str) -> bool {
    ["sigma.", "covariance.", "variance."].iter().any(|kind| name.starts_with(kind))
}

/// A stage that makes three planes of pixels whose noise can be told from the noise of demosaicked R, G and B.
pub trait Propagating: Stage {
    /// Names of the layers, in the order in which files have them.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::Usage`] where what the stage makes has no uncertainty to tell.
    fn layers(&self) -> Result<Vec<&'static str>>;

    /// Fills the layers of row `y`, one plane after another, from the rows that the stage saw and the three planes that it
    /// made; gives the number of pixels where propagation is void.
    fn fill_layers(
        &self,
        noise: &PixelNoise,
        input: &Window<'_, Self::Input>,
        y: usize,
        made: [&[f32]; 3],
        layers: &mut [f32],
    ) -> u64;
}

/// A stage and, beside each pixel that it makes, how uncertain the pixel is.
#[derive(Debug, Clone)]
pub struct WithSigma<S> {
    stage: S,
    header: FrameHeader,
    noise: PixelNoise,
}

impl WithSigma<Demosaic> {
    /// Demosaicking with a layer of standard deviations.
    ///
    /// # Errors
    ///
    /// Those of [`PixelNoise::of`].
    pub fn of_demosaicking(stage: Demosaic) -> Result<Self> {
        let noise = PixelNoise::of(stage.header())?;
        Self::new(stage, noise)
    }
}

impl WithSigma<ToXyz> {
    /// The conversion of `input` with a layer of standard deviations and, for XYZ, one of the six covariances. Spaces that are
    /// curved in XYZ are taken to first order.
    ///
    /// # Errors
    ///
    /// Those of [`PixelNoise::of`]; [`crate::error::Error::Usage`] for sRGB, a picture.
    pub fn of_conversion(stage: ToXyz, input: &FrameHeader) -> Result<Self> {
        stage.layers()?;
        Self::new(stage, PixelNoise::of(input)?)
    }
}

impl<S: Propagating> WithSigma<S> {
    fn new(stage: S, noise: PixelNoise) -> Result<Self> {
        let mut header = stage.header().clone();
        header.geometry.channels.extend(stage.layers()?.into_iter().map(str::to_owned));
        header.metadata.uncertainty = Some(Coverage::of_colors(header.metadata.color.as_ref()));
        Ok(Self { stage, header, noise })
    }

    /// The head of the frame that comes out, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }
}

impl<S: Propagating> Stage for WithSigma<S> {
    type Input = S::Input;
    type Output = S::Output;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn reach(&self) -> usize {
        self.stage.reach()
    }

    fn footprint(&self) -> Footprint {
        self.stage.footprint()
    }

    fn apply(&self, input: Window<'_, S::Input>, mut output: Rows<'_, S::Output>) -> Counts {
        let mut counts = self.stage.apply(input, output.reborrow());
        for y in output.range() {
            let (made, layers) = output.three_and_rest(y);
            counts.propagation_void +=
                self.stage.fill_layers(&self.noise, &input, y, made.map(|plane| &*plane), layers);
        }
        counts
    }
}

/// The layers that tell how uncertain pixels are of a frame whose own samples tell their levels: demosaicked, or XYZ of it.
#[derive(Debug, Clone)]
pub struct PixelLayers {
    noise: PixelNoise,
    names: Vec<&'static str>,
    color: Option<Color>,
}

/// How XYZ follow from R, G and B of the camera, and these from XYZ.
#[derive(Debug, Clone)]
struct Color {
    xyz_from_adu: Matrix3<f64>,
    adu_from_xyz: Matrix3<f64>,
    black_adu: f64,
}

impl PixelLayers {
    /// Those of a frame.
    ///
    /// # Errors
    ///
    /// Those of [`PixelNoise::of`]; [`crate::error::Error::Format`] for other colors than XYZ.
    pub fn of(frame: &FrameHeader) -> Result<Self> {
        let metadata = &frame.metadata;
        let Some(record) = &metadata.color else {
            let noise = PixelNoise::of(frame)?;
            return Ok(Self { noise, names: vec!["sigma.R", "sigma.G", "sigma.B"], color: None });
        };
        if metadata.quantity != QuantityKind::Xyz {
            return Err(frame.refuse(format!(
                "it holds {}, of whose average no standard deviations can be told; average XYZ",
                frame.holds()
            )));
        }
        let xyz_from_adu = record.xyz_from_adu(metadata.exposure).ok_or_else(|| frame.missing("exposure"))?;
        let adu_from_xyz = xyz_from_adu.try_inverse().ok_or_else(|| frame.refuse("its matrix has no inverse"))?;
        // The levels are those of the camera's signals.
        let mut camera = frame.clone();
        camera.metadata.set_black_adu(Some(BlackLevel::from(record.black_adu)));
        let noise = PixelNoise::of(&camera)?;
        let color = Color { xyz_from_adu, adu_from_xyz, black_adu: record.black_adu };
        Ok(Self { noise, names: layers_of(Space::Xyz)?, color: Some(color) })
    }

    /// Their names, in the order in which files have them.
    pub fn names(&self) -> &[&'static str] {
        &self.names
    }

    /// Fills the layers of row `y`, one plane after another, from its three planes; gives the number of pixels where propagation is
    /// void.
    pub fn fill(&self, y: usize, planes: &[f32], layers: &mut [f32]) -> u64 {
        let width = planes.len() / 3;
        let at = |x: usize| [0, 1, 2].map(|plane| f64::from(planes[plane * width + x]));
        match &self.color {
            None => fill(width, layers, |x| {
                let (covariance, holds) = self.noise.covariance([x, y], at(x));
                (stds(&covariance).into_iter(), holds)
            }),
            Some(color) => fill(width, layers, |x| {
                let rgb = color.adu_from_xyz * Vector3::from(at(x));
                let (camera, holds) = self.noise.covariance([x, y], [0, 1, 2].map(|k| rgb[k] + color.black_adu));
                let covariance = through(&camera, &color.xyz_from_adu);
                (covariance.into_iter().chain(stds(&covariance)), holds)
            }),
        }
    }
}

impl Propagating for Demosaic {
    fn layers(&self) -> Result<Vec<&'static str>> {
        Ok(vec!["sigma.R", "sigma.G", "sigma.B"])
    }

    fn fill_layers(&self, noise: &PixelNoise, _: &Window<'_>, y: usize, made: [&[f32]; 3], layers: &mut [f32]) -> u64 {
        fill(made[0].len(), layers, |x| {
            let (covariance, holds) = noise.covariance([x, y], made.map(|plane| f64::from(plane[x])));
            (stds(&covariance).into_iter(), holds)
        })
    }
}

impl Propagating for ToXyz {
    fn layers(&self) -> Result<Vec<&'static str>> {
        layers_of(self.space())
    }

    fn fill_layers(
        &self,
        noise: &PixelNoise,
        input: &Window<'_, Self::Input>,
        y: usize,
        _: [&[f32]; 3],
        layers: &mut [f32],
    ) -> u64 {
        let planes = [0, 1, 2].map(|channel| input.row(y.cast_signed(), channel));
        fill(input.width(), layers, |x| {
            let rgb = planes.map(|plane| f64::from(plane[x]));
            let (camera, holds) = noise.covariance([x, y], rgb);
            let of_xyz = through(&camera, self.xyz_from_adu());
            let xyz = self.xyz(rgb).into();
            let covariance = match (self.space(), self.coordinates().jacobian(xyz)) {
                (Space::Xyz, _) => of_xyz,
                (_, Some(jacobian)) => through(&of_xyz, &jacobian),
                (_, None) => {
                    let [first, second, third] = self.coordinates().variances_without_chromaticity(xyz, of_xyz[3]);
                    [first, f64::NAN, f64::NAN, second, f64::NAN, third]
                }
            };
            let shown = if self.space() == Space::Xyz { covariance.len() } else { 0 };
            (covariance.into_iter().take(shown).chain(stds(&covariance)), holds)
        })
    }
}

/// Fills planes of `width` samples, one after another, with the values of each pixel; gives the number of pixels whose
/// values do not hold.
fn fill<V: Iterator<Item = f64>>(width: usize, planes: &mut [f32], values: impl Fn(usize) -> (V, bool)) -> u64 {
    let mut void = 0;
    for x in 0..width {
        let (values, holds) = values(x);
        void += u64::from(!holds);
        for (plane, value) in values.enumerate() {
            planes[plane * width + x] = to_sample(value);
        }
    }
    void
}
