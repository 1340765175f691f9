//! The frame that shows a scene: its size, its patches, and what its metadata say.

use super::light::Light;
use super::open::Prepared;
use super::request::Scene;
use super::sums::own_xyz;
use crate::camera::optics::Vignetting;
use crate::camera::sensor::Sensor;
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::{self, FrameHeader};
use crate::requests::described::either;
use crate::requests::notes::Note;
use crate::stages::render::Rendering;

/// How much of the frame a pixel of the source takes, and how much there is of both.
struct Extent {
    size: [usize; 2],
    patch: [usize; 2],
    /// Pixels of a row of the source; none of a uniform scene.
    source_width: Option<usize>,
}

impl Scene {
    /// Settles size, metadata and layout of the frame.
    pub(super) fn rendering(&self, prepared: &Prepared) -> Result<Rendering> {
        let Prepared { sensor, exposure, light, brightest_e, found } = prepared;
        let Extent { size, patch, source_width } = self.extent(light, sensor)?;
        let cfa = either(self.cfa, self.pattern)?;
        let (source, uniform) = match light {
            Light::Uniform { electrons, source } => (source, Some(*electrons)),
            Light::Image { source, .. } => (source, None),
        };
        let wanted = self.vignetting_focal_length_mm();
        let vignetting = match wanted {
            Some(focal_length) => Some(Vignetting::new(size[0], size[1], sensor.pixel_pitch_um()?, focal_length)),
            None => None,
        };
        let is_negligible = vignetting.as_ref().is_some_and(Vignetting::is_negligible);
        let vignetting = vignetting.filter(|_| !is_negligible);
        let mut metadata = found.metadata.clone();
        let mut leave_out = |what: &str, why: &str| metadata.leave_out("render-radiance", what, why);
        if is_negligible {
            leave_out("vignetting", "it changes no sample by half a unit in the last place");
        }
        if cfa.is_some() {
            leave_out("two of the three planes at each photosite", "the mosaic drops them");
        }
        if vignetting.is_none() && patch[0] * patch[1] > 1 {
            let what = "all photosites of a patch but one of each class";
            leave_out(what, "without vignetting they expect the same");
        }
        let is_uniform = uniform.is_some() && vignetting.is_none();
        metadata.cfa = cfa.map(Into::into);
        metadata.sensor = Some(sensor.clone());
        metadata.exposure = Some(*exposure);
        metadata.scene = Some(metadata::Scene {
            source: source.clone(),
            uniform: is_uniform,
            expected_electrons: uniform.filter(|_| is_uniform),
            true_xyz: found.radiance.as_ref().filter(|_| is_uniform).and_then(|radiance| own_xyz(radiance).ok()),
            vignetting_focal_length_mm: wanted.filter(|_| !is_negligible),
            patch: uniform.is_none().then_some(patch),
            source_width,
            brightest_e: *brightest_e,
            upsampling: found.upsampling.clone(),
        });
        let channels: &[&str] = if cfa.is_some() { &["Y"] } else { &["R", "G", "B"] };
        let geometry = Geometry::new(size[0], size[1], channels);
        let header = FrameHeader { name: "the frame".into(), geometry, metadata };
        Ok(Rendering { header, patch, vignetting, cfa })
    }

    /// A warning of pixels of an image that the frame has no room for.
    pub(super) fn cut(&self, light: &Light) -> Option<Note> {
        let Light::Image { width, height, source, .. } = light else { return None };
        let ([columns, rows], [across, down]) = (self.size?, self.patch.unwrap_or([1, 1]));
        (columns < width * across || rows < height * down).then(|| {
            Note::Warning(format!(
                "{source}: --size {columns}x{rows} shows a corner of its {width}x{height} pixels in patches of {across}x{down}; \
                 without --size the frame shows all"
            ))
        })
    }

    fn extent(&self, light: &Light, sensor: &Sensor) -> Result<Extent> {
        match light {
            Light::Uniform { .. } if self.patch.is_some() => {
                Err(Error::Usage("--patch is for the pixels of a spectral image, but the scene is uniform".into()))
            }
            Light::Uniform { .. } => {
                let of_sensor = || sensor.readout().map(|readout| [readout.width as usize, readout.height as usize]);
                let size = self.size.map_or_else(of_sensor, Ok)?;
                Ok(Extent { size, patch: size, source_width: None })
            }
            Light::Image { width, height, source, .. } => {
                let patch = self.patch.unwrap_or([1, 1]);
                let whole = [*width * patch[0], *height * patch[1]];
                let size = self.size.unwrap_or(whole);
                if size[0] > whole[0] || size[1] > whole[1] {
                    let [columns, rows] = [size[0].div_ceil(*width), size[1].div_ceil(*height)];
                    let all = [width * columns, height * rows];
                    let all = match all == size {
                        true => String::new(),
                        false => format!(", without --size, in {}x{} photosites", all[0], all[1]),
                    };
                    return Err(Error::Usage(format!(
                        "{source}: its {width}x{height} pixels in patches of {}x{} make {}x{} photosites, fewer than --size {}x{}; \
                         give --patch {columns}x{rows} to show them all{all}, or --sample N to show one everywhere",
                        patch[0], patch[1], whole[0], whole[1], size[0], size[1]
                    )));
                }
                Ok(Extent { size, patch, source_width: Some(*width) })
            }
        }
    }
}
