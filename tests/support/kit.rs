//! A camera, and a kit of frames that its frames are corrected by, in memory.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use super::{sensor, through};
use cyanometer::analysis::statistics::{ChannelReport, Saturated, measure};
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::CfaPattern;
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::masking::Corrections;
use cyanometer::metadata::{FrameHeader, Metadata, Scene};
use cyanometer::propagation::Equations;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::{DarkFrames, DarkSettings};
use cyanometer::stages::defects::DefectMap;
use cyanometer::stages::flats::FlatFrames;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::saturation::with_mask;
use cyanometer::stream::{MemoryFrame, Stage};
use cyanometer::units::QuantityKind;
use std::collections::BTreeSet;

/// A camera, and the numbers of its exposures.
pub struct Camera {
    pub readout: ReadOut,
    pub size: [usize; 2],
    pub cfa: Option<CfaPattern>,
    pub seed: u64,
    pub frames: std::cell::Cell<u32>,
}

impl Camera {
    /// One exposure of a uniform scene, in codes.
    pub fn expose(&self, electrons: [f64; 3], exposure_s: f64, temperature_k: f64) -> MemoryFrame {
        let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
        let mut camera = sensor();
        camera.readout = Some(self.readout.clone());
        metadata.sensor = Some(camera);
        metadata.exposure = Some(Exposure { exposure_s, f_number: 8.0, lens_transmittance: 1.0 });
        metadata.scene = Some(Scene::uniform("test", electrons));
        metadata.cfa = self.cfa.map(Into::into);
        let channels: &[&str] = if self.cfa.is_some() { &["Y"] } else { &["R", "G", "B"] };
        let geometry = Geometry::new(self.size[0], self.size[1], channels);
        let header = FrameHeader { name: "test".into(), geometry, metadata };
        let scene = super::frame(header, |x, y, channel| {
            let class = self.cfa.map_or(channel, |cfa| cfa.class(x as i64, y as i64) as usize);
            to_sample(electrons[class])
        });
        let frame = self.frames.replace(self.frames.get() + 1);
        let settings = NoiseSettings {
            seed: self.seed,
            sensor_seed: self.seed + 1,
            frame,
            temperature_k: Some(temperature_k),
            ..Default::default()
        };
        let noisy = through(&scene, &AddNoise::new(&scene.header, &settings).unwrap());
        let codes = through(&noisy, &Digitize::new(&noisy.header, &AdcSettings::default()).unwrap());
        if self.readout.linearization.is_some() { super::straightened(&codes) } else { codes }
    }

    /// So many frames without light.
    pub fn darks(&self, count: usize, exposure_s: f64, temperature_k: f64) -> Vec<MemoryFrame> {
        (0..count).map(|_| self.expose([0.0; 3], exposure_s, temperature_k)).collect()
    }
}

/// What a frame is corrected by.
#[derive(Default)]
pub struct Kit {
    pub darks: Vec<MemoryFrame>,
    pub biases: Vec<MemoryFrame>,
    pub flats: Vec<MemoryFrame>,
    pub flat_darks: Vec<MemoryFrame>,
    pub settings: DarkSettings,
    pub defects: BTreeSet<[usize; 2]>,
    pub black: Option<Black>,
}

impl Kit {
    /// The corrected frame; its layer of marks is the last channel where there is one.
    pub fn correct(&self, frame: &MemoryFrame) -> MemoryFrame {
        let darks = DarkFrames::matched(&frame.header, self.darks.clone(), self.biases.clone(), self.settings).unwrap();
        let flats = || {
            let is_scaled = self.settings.is_scaled && !self.flat_darks.is_empty();
            let needs_bias = is_scaled || self.flat_darks.is_empty();
            let biases = if needs_bias { self.biases.clone() } else { Vec::new() };
            let settings = DarkSettings { is_scaled, ..self.settings };
            FlatFrames::of(&frame.header, self.flats.clone(), [self.flat_darks.clone(), biases], None, settings, None)
                .unwrap()
        };
        let settings = CorrectionSettings { black: self.black.unwrap_or(Black::None), cte: None };
        let mut stage =
            CorrectFrame::of(&frame.header, &settings, darks.as_ref().map(DarkFrames::stack), true).unwrap();
        let map = || Some(DefectMap::List(self.defects.clone(), 0));
        let flats = flats().map(|surveyed| (flats().unwrap(), surveyed.survey(None, map(), None).unwrap()));
        stage.note_further(flats.as_ref().map(|(flats, means)| flats.record(means)), None);
        let mut corrections = Corrections { darks, dark_limits: None, flats, map: map(), found: [0; 3] };
        let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
        let mut made = MemoryFrame::new(with_mask(stage.header().clone()), Vec::new());
        corrections.run(&stage, &mut source, [false, true], &mut made, &mut |_| ()).unwrap();
        // Only what programs made has a layer of marks.
        made.header.metadata.history.push(cyanometer::cli::history_entry("correct-frame", std::iter::empty()));
        made
    }
}

/// What is said of the classes of a corrected frame.
pub fn classes(frame: &MemoryFrame) -> Vec<ChannelReport> {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    let report = measure(&mut source, &[], Saturated::LeftOut, Equations::Exact, None).unwrap();
    let why = report.unpredicted.map(|why| why.to_string());
    let region = report.regions.into_iter().next().unwrap();
    let classes = if region.classes.is_empty() { region.channels } else { region.classes };
    assert!(classes.iter().all(|class| class.z_std.is_some()), "nothing predicted: {why:?}");
    classes
}

/// Numbers from 0 to 1 that follow from a seed.
pub struct Chance(pub u64);

impl Chance {
    /// The next of them.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / 2_f64.powi(53)
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn whole(&mut self, low: usize, high: usize) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small whole numbers")]
        let step = (self.next() * (high + 1 - low) as f64) as usize;
        low + step
    }
}
