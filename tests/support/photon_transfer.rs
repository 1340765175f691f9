//! Cameras drawn from the ranges of real ones, simulated and measured by photon transfer.

use super::misses::CONFIDENCE;
use cyanometer::analysis::photon_transfer::{
    Asked, ClassFindings, Condition, Ends, Level, Settings, Site, full_mean, of_class, survey, survey_as,
};
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::readout::ReadOut;
use cyanometer::chain::{CameraSetup, uniform_frame};
use cyanometer::metadata::Scene;
use cyanometer::numerics::normal::NearlyNormal;
use cyanometer::random::Source;
use cyanometer::random::philox::philox4x32_10;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;

pub const QUANTUM_EFFICIENCY: f64 = 0.5;
/// Exposure time of the flats, and of the dark stack.
pub const FLAT_S: f64 = 0.02;

/// Uniform numbers of a camera.
pub struct Chance {
    pub camera: u32,
    pub drawn: u32,
}

impl Chance {
    pub fn uniform(&mut self) -> f64 {
        self.drawn += 1;
        let [word, ..] = philox4x32_10([self.camera, self.drawn, 0, 0], [0x5EED, 7]);
        (f64::from(word) + 0.5) / 4_294_967_296.0
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }
}

/// Whether rows and columns have noise and patterns of their own.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    Ccd,
    Cmos,
}

/// A camera drawn from the ranges of real ones.
pub fn camera(index: u32, kind: Kind) -> ReadOut {
    let mut chance = Chance { camera: index, drawn: 0 };
    let ccd = ccd(&mut chance);
    if kind == Kind::Ccd {
        return ccd;
    }
    let read_noise_e = ccd.read_noise_e;
    let mut share = |low: f64, high: f64| read_noise_e * chance.between(low, high);
    let (row_noise_e, column_noise_e) = (share(0.1, 0.5), share(0.05, 0.3));
    let (dsnu_e, dsnu_row_e, dsnu_column_e) = (share(0.2, 1.0), share(0.05, 0.5), share(0.1, 0.8));
    let prnu_row = ccd.prnu * chance.between(0.05, 0.3);
    let prnu_column = ccd.prnu * chance.between(0.05, 0.5);
    ReadOut { row_noise_e, column_noise_e, dsnu_e, dsnu_row_e, dsnu_column_e, prnu_row, prnu_column, ..ccd }
}

/// 0, 1, 2 or 3.
pub fn quarter(chance: &mut Chance) -> u32 {
    let at = chance.uniform();
    [0.25, 0.5, 0.75].into_iter().map(|bound| u32::from(at >= bound)).sum()
}

pub fn ccd(chance: &mut Chance) -> ReadOut {
    let full_well_e = chance.log_between(3000.0, 80_000.0);
    let bits = 10 + 2 * quarter(chance);
    let top = f64::from((1_u32 << bits) - 1);
    let bias_adu = (top * chance.between(0.01, 0.05)).round();
    let adu_per_e = (top - bias_adu) / full_well_e * chance.between(0.7, 1.4);
    // Noise that the converter sees: at least 0.6 codes.
    let least = 0.6 / adu_per_e;
    ReadOut {
        full_well_e,
        bits,
        bias_adu,
        adu_per_e,
        read_noise_e: chance.log_between(1.0, 30.0).max(least).min(full_well_e / 50.0),
        prnu: chance.log_between(0.002, 0.02),
        dcnu: chance.between(0.05, 0.2),
        dark_current_na_per_cm2: None,
        dark_current_e_per_s: Some(chance.log_between(5.0, 2000.0)),
        temperature_k: 300.0,
        ..super::readout()
    }
}

pub const SIZE: [usize; 2] = [96, 64];

/// What frames scatter by besides noise, standard deviations.
#[derive(Clone, Copy, Default)]
pub struct Shake {
    /// Of the light from frame to frame, relative.
    pub light: f64,
    /// Of the black level from frame to frame, in codes.
    pub black_adu: f64,
    /// Of exposure times from level to level, relative.
    pub time: f64,
    /// How much the black level rises from each frame to the next, in codes: no scatter.
    pub drift_adu: f64,
}

/// Temperature of further darks, beside 300 K.
pub const WARM_K: f64 = 308.0;

impl Shake {
    pub fn is_any(self) -> bool {
        self.light + self.black_adu + self.time > 0.0
    }

    /// What the light, the black level in codes, and the time of a frame are changed by.
    pub fn drawn(self, index: u32, frame: u32, first: u32) -> [f64; 3] {
        // The sum of 12 uniform numbers is normal enough.
        let normal = |place: u32, which: u32| {
            let mut chance = Chance { camera: 10_000 * (which + 1) + index, drawn: 12 * place };
            (0..12).map(|_| chance.uniform()).sum::<f64>() - 6.0
        };
        let black_adu = self.black_adu * normal(frame, 1) + self.drift_adu * f64::from(frame);
        [1.0 + self.light * normal(frame, 0), black_adu, 1.0 + self.time * normal(first, 2)]
    }
}

/// Frames of one condition of a camera.
pub fn level(camera: (&ReadOut, u32, Shake), condition: Condition, expected_e: f64, frames: [u32; 2]) -> Level {
    level_in(camera, condition, expected_e, frames, None)
}

/// The same, where photosites of such a mean count as full.
pub fn level_in(
    (readout, index, shake): (&ReadOut, u32, Shake),
    condition: Condition,
    expected_e: f64,
    [frames, first]: [u32; 2],
    full: Option<f64>,
) -> Level {
    let mut taken: Vec<MemoryFrame> = (first..first + frames)
        .map(|frame| {
            let [of_light, black_adu, of_time] = shake.drawn(index, frame, first);
            let expected_e = expected_e * of_light * of_time;
            let mut sensor = super::sensor();
            sensor.readout = Some(ReadOut { bias_adu: readout.bias_adu + black_adu, ..readout.clone() });
            let exposure_s = condition.exposure_s.unwrap() * of_time;
            let exposure = Exposure { exposure_s, f_number: 8.0, lens_transmittance: 1.0 };
            let setup = CameraSetup::new(sensor, exposure);
            let head = setup.plane(SIZE, Scene::uniform("flat", [expected_e; 3])).unwrap();
            let light = uniform_frame(head, [expected_e; 3]).unwrap();
            let settings = NoiseSettings {
                seed: index.into(),
                sensor_seed: index.into(),
                frame,
                temperature_k: condition.temperature_k,
                ..NoiseSettings::default()
            };
            let noisy = light.through(&AddNoise::new(&light.header, &settings).unwrap()).unwrap().0;
            let digitized = noisy.through(&Digitize::new(&noisy.header, &AdcSettings::default()).unwrap()).unwrap().0;
            MemoryFrame::new(digitized.header, digitized.samples)
        })
        .collect();
    let top = f64::from((1_u32 << readout.bits) - 1);
    let sites = Site::of(&taken[0].header);
    let found =
        survey_as(&mut taken, &Asked { ends: Ends { top: Some(top), ..Ends::default() }, full, ..Asked::default() })
            .unwrap();
    let green = sites.iter().zip(found.sites).filter(|(site, _)| site.class == "G");
    Level::of(0, condition, green.map(|(_, survey)| survey).collect())
}

/// What a camera is found to be.
pub fn measured(readout: &ReadOut, index: u32) -> ClassFindings {
    let [flats, darks] = levels(readout, index);
    let found = found(&flats, &darks);
    assert_eq!(found.suspects, [], "{index}");
    found
}

pub fn settings() -> Settings {
    Settings { confidence: CONFIDENCE, photon_error: 0.0, are_codes: true, top: None, corrected: None }
}

pub fn found(flats: &[Level], darks: &[Level]) -> ClassFindings {
    of_class("G", flats, darks, darks, &settings())
}

/// Flats and darks of a camera.
pub fn levels(readout: &ReadOut, index: u32) -> [Vec<Level>; 2] {
    let [flats, darks, _] = levels_of((readout, index, Shake::default()));
    [flats, darks]
}

/// Flats and darks of a camera, and darks at [`WARM_K`].
pub fn levels_of(camera: (&ReadOut, u32, Shake)) -> [Vec<Level>; 3] {
    let readout = camera.0;
    let lit = |photons: f64| Condition {
        is_lit: true,
        exposure_s: Some(FLAT_S),
        photons: Some(photons),
        temperature_k: None,
    };
    let dark =
        |exposure_s: f64| Condition { is_lit: false, exposure_s: Some(exposure_s), photons: None, temperature_k: None };
    let end = readout.full_well_e.min((f64::from((1_u32 << readout.bits) - 1) - readout.bias_adu) / readout.adu_per_e);
    let shares = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.05, 1.3];
    let mut number = 0;
    let mut next = |frames: u32| {
        number += frames;
        number - frames
    };
    let flats: Vec<Level> = shares
        .iter()
        .map(|share| {
            let frames = if *share == 0.5 { 8 } else { 2 };
            level(camera, lit(share * end / QUANTUM_EFFICIENCY), share * end, [frames, next(frames)])
        })
        .collect();
    let full = full_mean(&flats);
    let mut darks_at = |temperature_k: f64| -> Vec<Level> {
        let of = |(time, frames): &(f64, u32)| {
            let condition = Condition { temperature_k: Some(temperature_k), ..dark(*time) };
            level_in(camera, condition, 0.0, [*frames, next(*frames)], full)
        };
        [(FLAT_S, 8), (0.1, 2), (0.25, 2), (0.5, 4), (1.0, 4)].iter().map(of).collect()
    };
    let (darks, warm) =
        (darks_at(readout.temperature_k), if camera.2.is_any() { darks_at(WARM_K) } else { Vec::new() });
    [flats, darks, warm]
}

/// The code from which on codes are the largest, in electrons above black.
fn top_e(readout: &ReadOut) -> f64 {
    (f64::from((1_u32 << readout.bits) - 1) + 0.5 - readout.bias_adu) / readout.adu_per_e
}

/// The expected temporal variance of a signal of so many electrons, in electrons², over the photosites: a normal law in 21 steps.
pub fn expected_variance(readout: &ReadOut, signal: f64) -> f64 {
    let dark = readout.dark_current_e_per_s(readout.temperature_k) * FLAT_S;
    let steps = (-10..=10).map(|step| f64::from(step) / 2.5);
    let (mut sum, mut weights) = (0.0, 0.0);
    for step in steps {
        let rate = signal * (1.0 + readout.prnu * step) + dark;
        let held = NearlyNormal::normal(rate, rate).clipped_above(readout.full_well_e);
        let read =
            NearlyNormal::normal(held.mean, held.variance + readout.read_noise_e.powi(2)).clipped_above(top_e(readout));
        let weight = (-0.5 * step * step).exp();
        sum += weight * read.variance;
        weights += weight;
    }
    sum / weights
}

/// The signal of the largest temporal variance, in electrons.
pub fn saturation(readout: &ReadOut) -> f64 {
    let end = top_e(readout).min(readout.full_well_e);
    let variance = |signal: &f64| expected_variance(readout, *signal);
    let levels = (500..=1400).map(|share| f64::from(share) / 1000.0 * end);
    levels.max_by(|a, b| variance(a).total_cmp(&variance(b))).unwrap()
}

/// The mean sensitivity of a camera's green photosites.
pub fn mean_sensitivity(readout: &ReadOut, index: u32) -> f64 {
    const LEVEL_E: f64 = 1000.0;
    let mut sensor = super::sensor();
    sensor.readout = Some(ReadOut { full_well_e: 1e6, ..readout.clone() });
    let exposure = Exposure { exposure_s: FLAT_S, f_number: 8.0, lens_transmittance: 1.0 };
    let head = CameraSetup::new(sensor, exposure).plane(SIZE, Scene::uniform("flat", [LEVEL_E; 3])).unwrap();
    let light = uniform_frame(head, [LEVEL_E; 3]).unwrap();
    let of_response = [Source::Prnu, Source::PrnuRow, Source::PrnuColumn];
    let without = Source::ALL.into_iter().filter(|source| !of_response.contains(source)).collect();
    let settings = NoiseSettings { sensor_seed: index.into(), without, ..NoiseSettings::default() };
    let mut pattern = vec![light.through(&AddNoise::new(&light.header, &settings).unwrap()).unwrap().0; 2];
    let dark = pattern[0].header.metadata.dark_signal_e.unwrap();
    let pattern: Vec<MemoryFrame> =
        pattern.drain(..).map(|frame| MemoryFrame::new(frame.header, frame.samples)).collect();
    let sites = Site::of(&pattern[0].header);
    let found = survey(&mut pattern.clone(), None, false).unwrap();
    let green: Vec<f64> =
        sites.iter().zip(found.sites).filter(|(site, _)| site.class == "G").map(|(_, survey)| survey.mean).collect();
    (green.iter().sum::<f64>() / green.len() as f64 - dark) / LEVEL_E
}

/// What a camera is.
pub fn truths(readout: &ReadOut, index: u32) -> Vec<(&'static str, f64)> {
    // The responsivity is that of the photosites there are.
    let efficiency = QUANTUM_EFFICIENCY * mean_sensitivity(readout, index);
    let current = readout.dark_current_e_per_s(readout.temperature_k);
    let dark_e = current * FLAT_S;
    let dark_pattern = readout.dcnu * dark_e;
    let ReadOut { row_noise_e, column_noise_e, dsnu_e, dsnu_row_e, dsnu_column_e, prnu_row, prnu_column, .. } =
        *readout;
    let dark_noise_e = readout.read_noise_e.hypot(row_noise_e).hypot(column_noise_e);
    let dark_variance = dark_noise_e.powi(2) + 1.0 / 12.0 / readout.adu_per_e.powi(2);
    let dsnu_pixel_e = dsnu_e.hypot(dark_pattern);
    vec![
        ("gain_adu_per_e", readout.adu_per_e),
        ("responsivity_adu_per_photon", readout.adu_per_e * efficiency),
        ("quantum_efficiency", efficiency),
        ("dark_noise_e", dark_noise_e),
        ("threshold_e", 0.5 + (0.25 + dark_variance).sqrt()),
        ("row_noise_e", row_noise_e),
        ("column_noise_e", column_noise_e),
        ("pixel_noise_e", readout.read_noise_e),
        ("saturation_e", saturation(readout)),
        ("linearity_error_min", 0.0),
        ("linearity_error_max", 0.0),
        ("prnu", readout.prnu.hypot(prnu_row).hypot(prnu_column)),
        ("prnu_row", prnu_row),
        ("prnu_column", prnu_column),
        ("prnu_pixel", readout.prnu),
        ("dsnu_e", dsnu_pixel_e.hypot(dsnu_row_e).hypot(dsnu_column_e)),
        ("dsnu_pixel_e", dsnu_pixel_e),
        ("dsnu_row_e", dsnu_row_e),
        ("dsnu_column_e", dsnu_column_e),
        ("dsnu_offset_e", dsnu_e),
        ("dcnu", readout.dcnu),
        ("dark_current_e_per_s", current),
        // Fixed patterns multiply counts, so that the temporal variance goes by the square of what a photosite has.
        ("dark_current_from_variance_e_per_s", current * (1.0 + readout.dcnu.powi(2))),
    ]
}
