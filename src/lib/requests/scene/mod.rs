//! Rendering a scene: from spectra, or electrons given outright, to the frame that a camera expects to collect.

mod illuminated;
mod layout;
mod light;
mod open;
mod picture;
mod request;
mod sums;

pub use request::Scene;
pub(super) use sums::own_xyz;

use super::notes::Note;
use crate::camera::optics::Exposure;
use crate::camera::sensor::Sensor;
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::spectrum::SpectralLibrary;
use crate::stages::render::Rendering;
use crate::stages::saturation::{Counted, FullLevels};
use crate::stream::{Counts, MemoryFrame, RowSink};
use crate::text::counted;
use light::{Judged, Light};
use open::Prepared;
use picture::Losses;

/// A scene that is ready to be drawn.
pub struct OpenScene {
    rendering: Rendering,
    light: Light,
    losses: Losses,
    judged: Option<Judged>,
    /// What came up.
    pub notes: Vec<Note>,
}

/// A uniform scene behind a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Uniform {
    /// The sensor.
    pub sensor: Sensor,
    /// The exposure.
    pub exposure: Exposure,
    /// Signal electrons of R, G and B.
    pub electrons: [f64; 3],
    /// Relative error of them by the sum over wavelengths; none where no spectrum was summed or none is possible.
    pub quadrature_error: Option<[f64; 3]>,
    /// Its radiance, where a spectrum was summed.
    pub radiance: Option<SpectralLibrary>,
    /// What came up.
    pub notes: Vec<Note>,
}

impl Scene {
    /// Loads the sensor, opens the light, settles the exposure and lays the frame out.
    ///
    /// # Errors
    ///
    /// Those of readers and sensor files; [`Error::Usage`] where the request makes no sense; [`Error::Data`] where it asks
    /// for a fraction of full well in the dark.
    pub fn open(&self) -> Result<OpenScene> {
        let prepared = self.prepare()?;
        let rendering = self.rendering(&prepared)?;
        let Prepared { light, mut found, .. } = prepared;
        found.notes.extend(self.cut(&light));
        Ok(OpenScene { rendering, light, losses: found.losses, judged: found.judged, notes: found.notes })
    }

    /// Renders the frame into memory.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], and those of the reader.
    pub fn render(&self) -> Result<(MemoryFrame, Vec<Note>)> {
        let mut open = self.open()?;
        let mut notes = std::mem::take(&mut open.notes);
        let mut frame = MemoryFrame::new(open.header().clone(), Vec::new());
        notes.extend(open.draw(&mut frame, &mut |_| ())?.1);
        Ok((frame, notes))
    }

    /// Sensor, exposure and signal electrons of a uniform scene, without a frame.
    ///
    /// # Errors
    ///
    /// As [`Self::open`]; [`Error::Usage`] for a spectral image of which no sample was chosen.
    pub fn uniform(&self) -> Result<Uniform> {
        let Prepared { sensor, exposure, light, found, .. } = self.prepare()?;
        match light {
            Light::Uniform { electrons, .. } => {
                let (quadrature_error, mut notes) = (found.metadata.quadrature_error, found.notes);
                notes.extend(found.losses.note());
                let radiance = found.radiance;
                Ok(Uniform { sensor, exposure, electrons, quadrature_error, radiance, notes })
            }
            Light::Image { source, .. } => {
                Err(Error::Usage(format!("{source}: it holds many spectra; choose one with --sample N")))
            }
        }
    }
}

impl OpenScene {
    /// The head of the frame.
    pub fn header(&self) -> &FrameHeader {
        &self.rendering.header
    }

    /// The same, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.rendering.header
    }

    /// Draws the whole frame into a sink; gives how many samples full well will clip and what came up meanwhile. `progress` hears
    /// the number of rows that are done.
    ///
    /// # Errors
    ///
    /// Those of reader and sink.
    pub fn draw(self, sink: &mut dyn RowSink, progress: &mut dyn FnMut(usize)) -> Result<(Counts, Vec<Note>)> {
        let Self { rendering, light, losses, judged, .. } = self;
        // Of a uniform scene it was said before.
        let is_known = matches!(light, Light::Uniform { .. });
        let mut counts = Counts::default();
        match FullLevels::of(&rendering.header) {
            Some(levels) => {
                let mut counted = Counted::new(sink, &rendering.header, levels);
                light.draw(&rendering, &mut counted, progress)?;
                counts.saturated_samples = counted.count;
            }
            None => light.draw(&rendering, sink, progress)?,
        }
        let full = counts.saturated_samples;
        let text = "samples expect full well or more, and will be saturated; a shorter exposure, or --expose-to 0.8 in place of \
                    --exposure, keeps them below";
        let saturated = (full > 0 && !is_known).then(|| Note::Warning(counted(full, text)));
        let bright = judged.and_then(|judged| judged.note());
        Ok((counts, losses.note().into_iter().chain(bright).chain(saturated).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cfa::CfaPattern;
    use crate::formats::data::DEFAULT_SENSOR;
    use crate::numerics::quadrature::Rule;
    use crate::requests::options::{SignalLevel, Subject};
    use crate::requests::sensor::SensorRequest;
    use nalgebra::{Matrix3, Vector3};

    const TREE: &str = env!("CARGO_MANIFEST_DIR");

    fn given(electrons: [f64; 3]) -> Scene {
        let level = SignalLevel { electrons: Some(electrons), ..SignalLevel::default() };
        Scene { level, size: Some([5, 4]), ..Scene::default() }
    }

    fn spectrum(file: &str) -> Scene {
        let input = Some(format!("{TREE}/sample_data/{file}").into());
        Scene { subject: Subject { input, sensor: SensorRequest::default() }, ..Scene::default() }
    }

    #[test]
    fn the_defaults_are_those_of_the_paper() {
        let scene = Scene::default();
        assert_eq!((scene.subject.sensor.sensor.as_str(), &scene.subject.input), (DEFAULT_SENSOR, &None));
        let exposure = scene.exposure.chosen().unwrap();
        assert_eq!(exposure, Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
        assert_eq!((scene.wavelengths, scene.quadrature), (None, Rule::Rectangle));
        assert_eq!((scene.vignetting_focal_length_mm(), scene.focal_length_mm), (None, 50.0));
    }

    #[test]
    fn a_uniform_scene_is_rendered_into_memory() {
        let (frame, notes) = given([100.0, 200.0, 300.0]).render().unwrap();
        assert_eq!((frame.header.geometry.width, frame.header.geometry.height), (5, 4));
        let row = [100.0, 200.0, 300.0].map(|e| [e; 5]).concat();
        assert_eq!(frame.samples, [row.clone(), row.clone(), row.clone(), row].concat());
        assert_eq!(notes, []);
        let scene = frame.header.metadata.scene.unwrap();
        assert_eq!((scene.uniform, scene.expected_electrons), (true, Some([100.0, 200.0, 300.0])));

        let (plane, _) = Scene { cfa: Some(CfaPattern::Rggb), ..given([1.0, 2.0, 3.0]) }.render().unwrap();
        assert_eq!(plane.samples[..10], [1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 3.0, 2.0, 3.0, 2.0]);
    }

    #[test]
    fn a_frame_and_the_formula_expect_the_same_of_a_spectrum() {
        let scene = Scene { size: Some([2, 2]), ..spectrum("skies/clear_zenith.csv") };
        let (frame, _) = scene.render().unwrap();
        let uniform = scene.uniform().unwrap();
        assert_eq!(frame.header.metadata.scene.unwrap().expected_electrons, Some(uniform.electrons));
        assert_eq!(frame.header.metadata.quadrature_error, uniform.quadrature_error);
        let filled = Scene { level: SignalLevel { expose_to: Some(0.5), ..SignalLevel::default() }, ..scene };
        let filled = filled.uniform().unwrap();
        let brightest = filled.electrons.into_iter().fold(0.0, f64::max);
        assert!((brightest / (0.5 * filled.sensor.readout().unwrap().full_well_e) - 1.0).abs() < 1e-12, "{brightest}");
        assert!(matches!(&filled.notes[0], Note::Remark(text) if text.starts_with("exposure ")), "{:?}", filled.notes);
    }

    /// XYZ of the spectrum are those that no camera changes; what a matrix makes of the electrons beside them is its error.
    #[test]
    fn a_uniform_scene_tells_the_xyz_of_its_spectrum() {
        let scene = Scene { size: Some([2, 2]), ..spectrum("skies/clear_zenith.csv") };
        let metadata = scene.open().unwrap().header().metadata.clone();
        let told = metadata.scene.as_ref().unwrap().true_xyz.unwrap();
        assert_eq!(told, own_xyz(&scene.uniform().unwrap().radiance.unwrap()).unwrap());
        let electrons = metadata.scene.as_ref().unwrap().expected_electrons.unwrap();
        let adu_per_e = metadata.adu_per_e().unwrap();
        let off = [0.1, -0.25, 0.0];
        let ratio = |k: usize| told[k] * (1.0 + off[k]) / (adu_per_e * electrons[k]);
        let xyz_from_adu = Matrix3::from_diagonal(&Vector3::new(ratio(0), ratio(1), ratio(2)));
        let found = metadata.scene_error(&xyz_from_adu).unwrap();
        // A few roundings of doubles.
        assert!(found.iter().zip(off).all(|(found, off)| (found - off).abs() < 1e-14), "{found:?}");
        let filled = SignalLevel { expose_to: Some(0.5), ..SignalLevel::default() };
        let filled = Scene { level: filled, ..scene.clone() }.open().unwrap();
        assert_eq!(filled.header().metadata.scene.as_ref().unwrap().true_xyz, Some(told));

        for unknown in [Scene { vignetting: true, size: None, ..scene }, given([1.0; 3])] {
            let metadata = unknown.open().unwrap().header().metadata.clone();
            assert_eq!((metadata.scene.as_ref().unwrap().true_xyz, metadata.scene_error(&xyz_from_adu)), (None, None));
        }
    }

    #[test]
    fn what_makes_no_scene_is_refused() {
        let complaint = |scene: Scene| scene.render().unwrap_err().to_string();
        assert!(complaint(Scene { patch: Some([2, 2]), ..given([1.0; 3]) }).contains("the scene is uniform"));
        let dark = SignalLevel { dark: true, expose_to: Some(0.5), ..SignalLevel::default() };
        assert!(complaint(Scene { level: dark, ..Scene::default() }).contains("the sensor sees none of its light"));
        let library = spectrum("skies/kider2014.exr").uniform().unwrap_err().to_string();
        assert!(library.contains("choose one with --sample N"), "{library}");
    }
}
