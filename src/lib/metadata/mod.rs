//! What is known about a frame: its quantity, its camera, and everything that was done to it.

mod black_noise;
mod capture;
mod converter;
mod correction;
mod difference;
mod header;
mod illumination;
mod levels;
mod ranges;
mod records;
mod samples;

pub use black_noise::BlackNoise;
pub use capture::{CaptureRecord, FirstRow};
pub use converter::AdcRecord;
pub use correction::{
    AverageRecord, CorrectionRecord, CutOffRecord, DefectsRecord, DrawnExposures, ExposureSet, ExposuresRecord,
    FlatRecord, MasterKind, MasterNoise, MasterRecord,
};
pub use difference::Difference;
pub use header::FrameHeader;
pub use illumination::Illumination;
pub use records::{
    AdaptationRecord, CameraSettings, ColorRecord, Coverage, DemosaicRecord, HistoryEntry, LeftOut, MatrixResidual,
    NoiseRecord, PoissonKind, PredictedRecord, ProfileRecord, RelativeMatrix, Scene, TakenAs, UpsamplingRecord,
};
pub use samples::{SamplesRecord, Seal};

use crate::camera::levels::{BlackLevel, WhiteLevel};
use crate::camera::optics::{self, Exposure};
use crate::camera::sensor::Sensor;
use crate::cfa::FilterArray;
use crate::names::Named;
use crate::units::QuantityKind;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use serde_yaml::Mapping;

/// The schema that metadata names.
pub const METADATA_SCHEMA: &str = "cyanometer/1";

/// Metadata to begin with, for people: all keys that describe a frame, each explained.
pub const METADATA_TEMPLATE: &str = include_str!("template.yaml");

/// What metadata in a text of a file begin with; other programs put their own words there.
pub const METADATA_BEGIN: &str = "schema: cyanometer/";

/// Metadata of a frame, as YAML stores it. Keys that this version does not know are kept in `unknown`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// `cyanometer/1`.
    pub schema: String,
    /// What the samples are.
    #[serde(default)]
    pub quantity: QuantityKind,
    /// Unit of the samples, for people.
    #[serde(default)]
    pub unit: String,
    /// What stood before the photosites of a single plane; absent for planes that are complete.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cfa: Option<FilterArray>,
    /// Columns and rows of the sensor before the first stored sample, where the frame does not begin at its corner. It stands in files
    /// and streams alone: of a frame that is read, [`crate::frame::Geometry`] has the place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<[i32; 2]>,
    /// What no light reads in a frame of electrons: the mean dark signal, e⁻.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark_signal_e: Option<f64>,
    /// What no light reads in a frame of ADU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub black_level_adu: Option<BlackLevel>,
    /// What each row of the sensor, from its corner on, adds to the black level.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub black_by_row: Vec<f64>,
    /// What each column of the sensor adds to the black level.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub black_by_column: Vec<f64>,
    /// What the black level is uncertain by, where it was measured in the masked border.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub black_noise: Option<BlackNoise>,
    /// Rectangles of photosites that no light reaches, in the frame or not: X, Y, width and height on the sensor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masked_areas: Vec<[i64; 4]>,
    /// The largest code, on the scale of the samples. Where the black level differed among photosites of a class, that
    /// which the first of them reaches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white_level_adu: Option<WhiteLevel>,
    /// The sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<Sensor>,
    /// The camera, as its raw file calls it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// The sensitivity that the camera was set to, ISO, as its raw file tells it; no number of ours hangs on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso_speed: Option<f64>,
    /// What else the camera was set to, as its file tells it in units of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_settings: Option<CameraSettings>,
    /// How the program that took the frame stored it, as its file tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capture: Option<CaptureRecord>,
    /// How a picture is turned to be seen upright, as Exif numbers it, 1 to 8; rows and columns are those of the sensor all the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<u16>,
    /// The noise of the codes as the raw file tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_profile: Option<ProfileRecord>,
    /// The temperature of the sensor during the exposure, as its file tells it; where none does, that of the sensor's read-out counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_temperature_k: Option<f64>,
    /// Exposure time and lens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<Exposure>,
    /// The exposure time in s of a frame whose f-number is not known, as that of a telescope; [`Self::time_s`] gives either.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_time_s: Option<f64>,
    /// What the frame was taken as, where its file tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken_as: Option<TakenAs>,
    /// The camera's own matrix for relative XYZ, as its raw file has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_matrix: Option<RelativeMatrix>,
    /// What the camera looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
    /// Relative error that the sum over wavelengths makes in the expected electrons of R, G and B, against the integral of
    /// what is linear between samples: of the scene's spectrum, or of the brightest pixel in the first row of an image or
    /// chart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quadrature_error: Option<[f64; 3]>,
    /// The noise that was drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseRecord>,
    /// The converter, as it was set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adc: Option<AdcRecord>,
    /// The exposures that the frame is the average of, where it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub average: Option<ExposuresRecord>,
    /// Which exposures these are, as far as their metadata tell.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub averaged: Vec<DrawnExposures>,
    /// What was taken back before demosaicking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correction: Option<CorrectionRecord>,
    /// How the missing classes were interpolated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub demosaic: Option<DemosaicRecord>,
    /// How colors were computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<ColorRecord>,
    /// Moments of every sample by formula, where the scene is uniform.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted: Option<PredictedRecord>,
    /// What the layers of standard deviations count, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<Coverage>,
    /// Expected share of the pixels that were made of saturated samples, by the law of a uniform scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturated_share: Option<f64>,
    /// Photosites of the exposure that took up charge which spilled over along their columns, where its sensor blooms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bloomed_photosites: Option<u64>,
    /// What the bits of the layer `mask` mean, where the frame has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mask_bits: Vec<String>,
    /// What was left out because the scene did not need it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
    /// The programs that made the frame, first to last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub history: Vec<HistoryEntry>,
    /// What stored samples were multiplied with, a power of two, so that viewers show them; readers undo it. Covariances were
    /// by its square, and marks not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_scale: Option<f64>,
    /// How many frames at least follow this one in its stream, where that was known; programs that read it take it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames_to_come: Option<u64>,
    /// Which of several files the frame was read from, as the user named it, by the first program of a pipe; in streams alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Which samples these metadata were written with. It stands in files and streams alone: of a frame that is read it was compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seal: Option<Seal>,
    /// What is known only after the last row; in sidecars alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<SamplesRecord>,
    /// What this version does not know, passed on as it came.
    #[serde(skip)]
    pub unknown: Mapping,
}

impl Metadata {
    /// Metadata of a quantity, with nothing else known.
    pub fn new(quantity: QuantityKind) -> Self {
        Self {
            schema: METADATA_SCHEMA.into(),
            quantity,
            unit: quantity.unit().into(),
            cfa: None,
            origin: None,
            dark_signal_e: None,
            black_level_adu: None,
            black_by_row: Vec::new(),
            black_by_column: Vec::new(),
            black_noise: None,
            masked_areas: Vec::new(),
            white_level_adu: None,
            sensor: None,
            camera: None,
            iso_speed: None,
            camera_settings: None,
            capture: None,
            orientation: None,
            noise_profile: None,
            sensor_temperature_k: None,
            exposure: None,
            exposure_time_s: None,
            taken_as: None,
            relative_matrix: None,
            scene: None,
            quadrature_error: None,
            noise: None,
            adc: None,
            average: None,
            averaged: Vec::new(),
            correction: None,
            demosaic: None,
            color: None,
            predicted: None,
            uncertainty: None,
            saturated_share: None,
            bloomed_photosites: None,
            mask_bits: Vec::new(),
            left_out: Vec::new(),
            history: Vec::new(),
            sample_scale: None,
            frames_to_come: None,
            file: None,
            seal: None,
            samples: None,
            unknown: Mapping::new(),
        }
    }

    /// What a file of the frame and its sidecar share: all that is known before the samples are, and does not hang on where and how
    /// they are stored.
    pub(crate) fn apart_from_storage(self) -> Self {
        Self { seal: None, samples: None, sample_scale: None, file: None, frames_to_come: None, ..self }
    }

    /// The same record about samples of another quantity: what held for the old samples alone is dropped.
    pub fn becoming(&self, quantity: QuantityKind) -> Self {
        Self {
            quantity,
            unit: quantity.unit().into(),
            predicted: None,
            uncertainty: None,
            samples: None,
            mask_bits: Vec::new(),
            ..self.clone()
        }
    }

    /// Whether its colors are on the scale of relative XYZ.
    pub fn is_relative(&self) -> bool {
        let relative = self.quantity.relative_unit();
        let is_named = relative != self.quantity.unit() && self.unit == relative;
        is_named || self.color.as_ref().is_some_and(ColorRecord::is_relative)
    }

    /// Luminance of the white that its colors refer to, in cd m⁻²; none where they are relative, or name none.
    pub fn white_luminance(&self) -> Option<f64> {
        let white = self.color.as_ref().and_then(|color| color.white).filter(|_| !self.is_relative());
        white.map(|[_, luminance, _]| luminance).filter(|luminance| *luminance > 0.0 && luminance.is_finite())
    }

    /// What its camera is called: by its sensor, and by its raw file.
    pub fn camera_names(&self) -> impl Iterator<Item = &str> {
        self.sensor.iter().map(|sensor| sensor.name.as_str()).chain(self.camera.as_deref())
    }

    /// The black level in ADU; none where none is known, or where it differs among photosites.
    pub fn uniform_black_adu(&self) -> Option<f64> {
        let is_level = |deltas: &[f64]| deltas.iter().all(|delta| *delta == 0.0);
        let level = self.black_level_adu.and_then(BlackLevel::uniform);
        level.filter(|_| is_level(&self.black_by_row) && is_level(&self.black_by_column))
    }

    /// Slope of the converter in ADU per e⁻: as it was set, or as the sensor has it.
    pub fn adu_per_e(&self) -> Option<f64> {
        let of_sensor = || self.sensor.as_ref()?.readout.as_ref().map(|readout| readout.adu_per_e);
        self.adc.map(|adc| adc.adu_per_e).or_else(of_sensor)
    }

    /// Relative error of X, Y and Z that a matrix makes of the scene's own spectrum, without noise: M K n / H beside the XYZ of
    /// the spectrum. None where these, the electrons or the slope of straight codes are not known, or XYZ are 0.
    ///
    /// `xyz_from_adu` takes codes above black to absolute XYZ, exposure included.
    pub fn scene_error(&self, xyz_from_adu: &Matrix3<f64>) -> Option<[f64; 3]> {
        let scene = self.scene.as_ref()?;
        let (own, electrons) = (scene.true_xyz?, scene.expected_electrons?);
        let adu_per_e = self.adu_per_e()?;
        let is_curved = self.adc.is_some_and(|adc| adc.is_bent());
        let xyz = xyz_from_adu * Vector3::from(electrons.map(|n| adu_per_e * n));
        let off: [f64; 3] = std::array::from_fn(|i| xyz[i] / own[i] - 1.0);
        (!is_curved && off.iter().all(|part| part.is_finite())).then_some(off)
    }

    /// The temperature of the sensor in K: that which noise was drawn for, or which the exposure had, or else that of its read-out.
    pub fn temperature_k(&self) -> Option<f64> {
        let of_sensor = || self.sensor.as_ref()?.readout.as_ref().map(|readout| readout.temperature_k);
        let drawn = self.noise.as_ref().map(|noise| noise.temperature_k);
        drawn.or(self.sensor_temperature_k).or_else(of_sensor)
    }

    /// The exposure time in s, with an f-number or without.
    pub fn time_s(&self) -> Option<f64> {
        self.exposure.map(|exposure| exposure.exposure_s).or(self.exposure_time_s)
    }

    /// What the converter adds, in ADU: as it was set, or as the sensor has it.
    pub fn bias_adu(&self) -> Option<f64> {
        let of_sensor = || self.sensor.as_ref()?.readout.as_ref().map(|readout| readout.bias_adu);
        self.adc.map(|adc| adc.bias_adu).or_else(of_sensor)
    }

    /// Whether charge transfer was simulated, which mixes neighbors.
    pub fn is_transferred(&self) -> bool {
        self.noise.as_ref().is_some_and(|noise| noise.cte.is_some())
    }

    /// What is possible, but may not be meant: a warning each.
    pub fn doubts(&self) -> Vec<String> {
        let black = self.black_level_adu.map(BlackLevel::largest);
        let levels = black.zip(self.white_level_adu).filter(|(black, white)| *black >= white.largest());
        let of_levels = levels.map(|(black, white)| {
            format!("the black level, {black} ADU, is no less than the white level, {} ADU", white.largest())
        });
        let of_sensor = self.sensor.iter().flat_map(Sensor::doubts);
        let of_lens = self.scene.as_ref().and_then(|scene| scene.vignetting_focal_length_mm);
        let of_lens = of_lens.and_then(optics::doubt_of_focal_length);
        let of_exposure = self.exposure.into_iter().flat_map(Exposure::doubts);
        of_exposure.chain(of_lens).chain(of_levels).chain(of_sensor).collect()
    }

    /// What a black level may be below the bias: a code that a user rounded, or what one of few masked photosites is off.
    fn black_off_adu(&self) -> f64 {
        /// Standard deviations.
        const Z: f64 = 5.0;
        self.black_noise.map_or(1.0, |noise| (Z * noise.site_adu2.sqrt()).max(1.0))
    }

    /// What it says of the same thing in two ways that do not agree: a warning each.
    pub fn contradictions(&self) -> Vec<String> {
        let mut known = QuantityKind::ALL.iter().filter(|kind| **kind != QuantityKind::Unspecified);
        // Other programs' names of units, of samples that are known.
        let is_counted =
            matches!(self.quantity, QuantityKind::ExpectedElectrons | QuantityKind::Electrons | QuantityKind::Adu);
        let unit = match self.unit.to_lowercase().as_str() {
            _ if !is_counted => self.unit.as_str(),
            "e" | "e⁻" | "electron" | "electrons" => QuantityKind::Electrons.unit(),
            "adu" | "dn" | "lsb" | "counts" => QuantityKind::Adu.unit(),
            _ => self.unit.as_str(),
        };
        let is_of_another = known.any(|kind| kind.unit() == unit);
        // One of several channels has the unit of its own.
        let is_own = unit == self.quantity.unit() || self.quantity.unit().split(", ").any(|own| own == unit);
        let unit = (is_of_another && !is_own).then(|| {
            format!(
                "its unit is `{}`, but that of its quantity, {}, is `{}`",
                self.unit,
                self.quantity,
                self.quantity.unit()
            )
        });
        let are_codes = self.quantity == QuantityKind::Adu && self.correction.is_none() && self.demosaic.is_none();
        let bias = self.bias_adu().filter(|_| are_codes);
        let black = self.black_level_adu.map(|level| level.sites().into_iter().fold(f64::INFINITY, f64::min));
        let level =
            black.zip(bias).filter(|(black, bias)| *black < bias - self.black_off_adu()).map(|(black, bias)| {
                format!("its black level, {black} ADU, is below the bias of its converter, {bias} ADU")
            });
        let times = self.exposure.zip(self.exposure_time_s).filter(|(exposure, alone)| exposure.exposure_s != *alone);
        let time = times.map(|(exposure, alone)| {
            format!(
                "its `exposure_time_s`, {alone} s, is not the time of its `exposure`, {} s, which counts",
                exposure.exposure_s
            )
        });
        unit.into_iter().chain(level).chain(time).collect()
    }

    /// Takes samples of unknown quantity for codes.
    pub fn name_codes(&mut self) {
        if self.quantity == QuantityKind::Unspecified {
            self.quantity = QuantityKind::Adu;
            self.unit = QuantityKind::Adu.unit().into();
        }
    }

    /// Sets a black level that no row or column adds to.
    pub fn set_black_adu(&mut self, level: Option<BlackLevel>) {
        self.black_level_adu = level;
        self.black_by_row.clear();
        self.black_by_column.clear();
    }

    /// Notes that something was left out.
    pub fn leave_out(&mut self, program: &str, what: impl Into<String>, why: impl Into<String>) {
        self.left_out.push(LeftOut { program: program.into(), what: what.into(), why: why.into() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A black level of the masked border is below the bias by what chance makes of so few photosites: of a variance of 1 ADU² by 5.
    #[test]
    fn a_black_level_may_be_below_the_bias_by_what_it_is_uncertain() {
        let told = |black: f64, site_adu2: Option<f64>| {
            let mut metadata = Metadata::new(QuantityKind::Adu);
            metadata.adc = Some(AdcRecord::new(12, 400.0, 0.05));
            let bias = metadata.bias_adu().unwrap();
            metadata.black_level_adu = Some((bias + black).into());
            metadata.black_noise = site_adu2.map(|site_adu2| BlackNoise { site_adu2, row_adu2: 0.0, column_adu2: 0.0 });
            metadata.contradictions()
        };
        for (black, site_adu2, is_told) in [
            (0.0, None, false),
            (-0.9, None, false),
            (-1.1, None, true),
            (-1.1, Some(1.0), false),
            (-5.1, Some(1.0), true),
            (-0.9, Some(1e-4), false),
        ] {
            let text = told(black, site_adu2);
            assert_eq!(
                text.iter().any(|text| text.contains("below the bias of its converter")),
                is_told,
                "{black} {text:?}"
            );
        }
    }
}
