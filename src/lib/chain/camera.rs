//! One camera: how it is set, the heads of its frames, and its stages from expected electrons to demosaicked codes.

use crate::camera::optics::Exposure;
use crate::camera::sensor::Sensor;
use crate::cfa::{CfaPattern, Class};
use crate::error::Result;
use crate::frame::{Geometry, to_sample};
use crate::metadata::{FrameHeader, Metadata, Scene};
use crate::stages::adc::{AdcSettings, Digitize};
use crate::stages::black::Black;
use crate::stages::correct::{CorrectFrame, CorrectionSettings};
use crate::stages::darks::DarkStack;
use crate::stages::demosaic::{Demosaic, Method};
use crate::stages::mosaic::Mosaic;
use crate::stages::noise::{AddNoise, NoiseSettings};
use crate::stages::to_xyz::{ColorSettings, ToXyz};
use crate::stream::{MemoryFrame, Stage};
use crate::units::QuantityKind;

/// A camera as it is set.
///
/// # Examples
///
/// ```
/// use cyanometer::camera::optics::Exposure;
/// use cyanometer::chain::{CameraSetup, uniform_frame};
/// use cyanometer::formats::data::load_sensor;
/// use cyanometer::metadata::Scene;
///
/// let exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };
/// let setup = CameraSetup::new(load_sensor("kaf-5101ce")?.sensor, exposure);
/// let electrons = [4000.0, 8000.0, 6000.0];
/// let expected = uniform_frame(setup.plane([8, 6], Scene::uniform("a patch", electrons))?, electrons)?;
/// let stages = setup.stages(&expected.header)?;
/// let (charge, _) = expected.through(&stages.add_noise)?;
/// let (codes, _) = charge.through(&stages.digitize)?;
/// let (rgb, _) = codes.through(&stages.demosaic)?;
/// assert_eq!(rgb.samples.len(), 8 * 6 * 3);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSetup {
    /// The sensor.
    pub sensor: Sensor,
    /// Exposure time and lens.
    pub exposure: Exposure,
    /// Noise sources, seeds, temperature.
    pub noise: NoiseSettings,
    /// Pattern of the filter array; the sensor's own where none is given.
    pub pattern: Option<CfaPattern>,
    /// Dark frames whose mean is subtracted; none where the black level is subtracted as a constant.
    pub dark_frames: u32,
    /// Demosaicking method.
    pub method: Method,
}

impl CameraSetup {
    /// A sensor at an exposure, with all of its noise, the paper's best method, and nothing subtracted but black.
    pub fn new(sensor: Sensor, exposure: Exposure) -> Self {
        let noise = NoiseSettings::default();
        Self { sensor, exposure, noise, pattern: None, dark_frames: 0, method: Method::EffectiveColor }
    }

    /// The pattern of the filter array.
    ///
    /// # Errors
    ///
    /// Those of [`Sensor::bayer`].
    pub fn pattern(&self) -> Result<CfaPattern> {
        self.pattern.map_or_else(|| self.sensor.bayer(), Ok)
    }

    /// The head of three planes of expected electrons, columns and rows, at the sensor's corner.
    pub fn planes(&self, size: [usize; 2], scene: Scene) -> FrameHeader {
        self.head(Geometry::new(size[0], size[1], &["R", "G", "B"]), scene)
    }

    /// The head of the plane of expected electrons behind the filter array, columns and rows, at the sensor's corner.
    ///
    /// # Errors
    ///
    /// Those of [`Self::pattern`].
    pub fn plane(&self, size: [usize; 2], scene: Scene) -> Result<FrameHeader> {
        let mut head = self.head(Geometry::new(size[0], size[1], &["Y"]), scene);
        head.metadata.cfa = Some(self.pattern()?.into());
        Ok(head)
    }

    fn head(&self, geometry: Geometry, scene: Scene) -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
        metadata.sensor = Some(self.sensor.clone());
        metadata.exposure = Some(self.exposure);
        let name = scene.source.clone();
        metadata.scene = Some(scene);
        FrameHeader { name, geometry, metadata }
    }

    /// The head of the plane that the filter array leaves of three which several amplifiers read: each class lies behind some of them alone, so that its
    /// photosites are not those of its plane. Other heads stay.
    ///
    /// # Errors
    ///
    /// Those of the mosaic.
    pub(super) fn behind_array(&self, head: &FrameHeader) -> Result<FrameHeader> {
        if head.taps().is_none() || head.metadata.cfa.is_some() {
            return Ok(head.clone());
        }
        Ok(Mosaic::new(head, self.pattern)?.header().clone())
    }

    /// The stages that a frame of expected electrons goes through.
    ///
    /// # Errors
    ///
    /// Those of the stages.
    pub fn stages(&self, expected: &FrameHeader) -> Result<CameraStages> {
        let add_noise = AddNoise::new(expected, &self.noise)?;
        let digitize = Digitize::new(add_noise.header(), &AdcSettings::default())?;
        let correct = match self.dark_frames {
            0 => None,
            frames => {
                let mut dark = digitize.header().clone();
                dark.metadata.scene = Some(Scene::uniform("dark", [0.0; 3]));
                let darks = DarkStack::alike(dark, frames)?;
                let nothing_else = CorrectionSettings { black: Black::None, cte: None };
                Some(CorrectFrame::new(digitize.header(), &nothing_else, Some(&darks))?)
            }
        };
        let codes = correct.as_ref().map_or(digitize.header(), Stage::header);
        let mosaic = match codes.metadata.cfa {
            Some(_) => None,
            None => Some(Mosaic::new(codes, self.pattern)?),
        };
        let plane = mosaic.as_ref().map_or(codes, Stage::header);
        let demosaic = Demosaic::new(plane, self.method, Black::Auto, None)?;
        Ok(CameraStages { add_noise, digitize, correct, mosaic, demosaic })
    }
}

/// The stages of a camera, first to last.
#[derive(Debug, Clone)]
pub struct CameraStages {
    /// From expected electrons to those of one exposure.
    pub add_noise: AddNoise,
    /// To codes.
    pub digitize: Digitize,
    /// To codes less dark frames, where there are any.
    pub correct: Option<CorrectFrame>,
    /// To the plane behind the filter array, where the frame is not behind it from the beginning.
    pub mosaic: Option<Mosaic>,
    /// To sensor RGB.
    pub demosaic: Demosaic,
}

impl CameraStages {
    /// The conversion of sensor RGB to colors.
    ///
    /// # Errors
    ///
    /// Those of [`ToXyz::new`].
    pub fn to_xyz(&self, settings: &ColorSettings) -> Result<ToXyz> {
        ToXyz::new(self.demosaic.header(), settings)
    }
}

/// A frame of expected electrons, three planes or the plane behind a Bayer array, that are the same at all photosites of a
/// class.
///
/// # Errors
///
/// [`Error::Format`](crate::error::Error::Format) for another array.
pub fn uniform_frame(head: FrameHeader, electrons: [f64; 3]) -> Result<MemoryFrame> {
    let Geometry { width, height, origin, .. } = head.geometry;
    let expected = |class: Class| to_sample(electrons[class as usize]);
    let samples = match head.bayer("filled with electrons")? {
        Some(pattern) => (0..height)
            .flat_map(|y| {
                let classes = pattern.row_classes(origin, y).map(expected);
                (0..width).map(move |x| classes[x % 2])
            })
            .collect(),
        None => {
            let row: Vec<f32> =
                Class::ALL.into_iter().flat_map(|class| std::iter::repeat_n(expected(class), width)).collect();
            row.repeat(height)
        }
    };
    Ok(MemoryFrame::new(head, samples))
}
