//! The chain stage by stage, of a frame in memory.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use super::{sensor, through};
use cyanometer::camera::readout::ReadOut;
use cyanometer::color::{Space, White};
use cyanometer::frame::to_sample;
use cyanometer::metadata::{AverageRecord, ExposuresRecord, Scene};
use cyanometer::numerics::averages::{CLIP, Combine, average};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::{DarkFrames, LessDarks};
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{MemoryFrame, Stage, run};
use cyanometer::units::QuantityKind;

pub fn with_readout(frame: &mut MemoryFrame, change: impl Fn(&mut ReadOut)) {
    let sensor = frame.header.metadata.sensor.as_mut().unwrap();
    change(sensor.readout.as_mut().unwrap());
    sensor.readout.as_ref().unwrap().check().unwrap();
}

pub fn settings(seed: u64) -> NoiseSettings {
    NoiseSettings { seed, sensor_seed: seed, ..Default::default() }
}

pub fn noisy(scene: &MemoryFrame, settings: &NoiseSettings) -> MemoryFrame {
    through(scene, &AddNoise::new(&scene.header, settings).unwrap())
}

pub fn digitized(frame: &MemoryFrame) -> MemoryFrame {
    through(frame, &Digitize::new(&frame.header, &AdcSettings::default()).unwrap())
}

pub fn plane_of(codes: &MemoryFrame) -> MemoryFrame {
    through(codes, &Mosaic::new(&codes.header, None).unwrap())
}

pub fn demosaicked(plane: &MemoryFrame, method: Method) -> MemoryFrame {
    through(plane, &Demosaic::new(&plane.header, method, Black::Auto, None).unwrap())
}

pub fn color_settings(space: Space) -> ColorSettings {
    ColorSettings {
        is_relative: false,
        xyz_from_camera: sensor().xyz_from_camera.unwrap(),
        method: None,
        residual: None,
        space,
        white: White::D65,
        white_luminance: None,
    }
}

pub fn colored(camera: &MemoryFrame, space: Space) -> MemoryFrame {
    through(camera, &ToXyz::new(&camera.header, &color_settings(space)).unwrap())
}

/// A plane less the mean of so many dark frames of the same sensor.
pub fn less_darks(plane: &MemoryFrame, light: &MemoryFrame, seed: u64, frames: u32) -> MemoryFrame {
    let mut dark = light.clone();
    dark.samples.fill(0.0);
    dark.header.metadata.scene = Some(Scene::uniform("test", [0.0; 3]));
    let taken = |frame| plane_of(&digitized(&noisy(&dark, &NoiseSettings { frame, ..settings(seed) })));
    let mut darks = DarkFrames::of((1..=frames).map(taken).collect()).unwrap().unwrap();
    let settings = CorrectionSettings { black: Black::None, cte: None };
    let stage = CorrectFrame::new(&plane.header, &settings, Some(darks.stack())).unwrap();
    let mut source = MemoryFrame::new(plane.header.clone(), plane.samples.clone());
    let mut corrected = MemoryFrame::new(stage.header().clone(), Vec::new());
    run(&stage, &mut LessDarks::new(&mut source, &mut darks), &mut corrected, &mut |_| ()).unwrap();
    MemoryFrame::new(corrected.header, corrected.samples)
}

/// The average of planes, and a record of it.
pub fn averaged(planes: &[MemoryFrame], combine: Combine) -> MemoryFrame {
    let mut made = planes[0].clone();
    let mut across = vec![0.0; planes.len()];
    for (index, sample) in made.samples.iter_mut().enumerate() {
        across.iter_mut().zip(planes).for_each(|(across, plane)| *across = plane.samples[index]);
        *sample = to_sample(average(combine, &mut across, CLIP).0);
    }
    let frames = u32::try_from(planes.len()).unwrap();
    let clip = (combine == Combine::Clipped).then_some(CLIP);
    let record = ExposuresRecord::of(AverageRecord { frames, combine, clip }, QuantityKind::Adu, false);
    made.header.metadata.average = Some(record);
    made
}
