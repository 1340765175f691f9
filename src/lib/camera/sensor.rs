//! The sensor: its description, what it makes of light, and its dark current.

use crate::camera::optics::Exposure;
use crate::cfa::CfaPattern;
use crate::error::{Error, Result};
use crate::numerics::planes::WeightedPlane;
use crate::numerics::quadrature::Rule;
use crate::spectrum::{Curve, WavelengthGrid, fold};
use crate::units::{BOLTZMANN_EV_PER_K, CM_PER_UM, LIGHT_M_PER_S, M_PER_NM, PLANCK_J_S};
use serde::{Deserialize, Serialize};

/// A table of a function of wavelength in a file beside the sensor file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CurveFile {
    /// Name of the file, without a directory.
    pub file: String,
    /// The column that counts; quantum efficiencies have the columns R, G and B.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// SHA-256 of the file, filled in when it is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
}

/// A sensor in numbers: what a sensor file holds and what metadata carries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// `cyanometer-sensor/1`.
    pub schema: String,
    /// Short name.
    pub name: String,
    /// What it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Where the numbers come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Photosites in a row.
    pub width: u32,
    /// Rows of photosites.
    pub height: u32,
    /// Distance of neighbouring photosites in µm.
    pub pixel_pitch_um: f64,
    /// Colour filter array.
    pub cfa: CfaPattern,
    /// Electrons per photon of the classes, columns R, G, B.
    pub quantum_efficiency: CurveFile,
    /// Transmittance of what covers the sensor, reflections included.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cover_glass: Option<CurveFile>,
    /// Charge that a photosite holds, in e⁻.
    pub full_well_e: f64,
    /// Dark-current density at 300 K in nA cm⁻², i_d of Eq. 6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark_current_na_per_cm2: Option<f64>,
    /// Dark current of a photosite at `temperature_k` in e⁻ s⁻¹, for sensors whose density is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark_current_e_per_s: Option<f64>,
    /// Operating temperature in K.
    pub temperature_k: f64,
    /// Dark-current non-uniformity: rms, fraction of 1.
    pub dcnu: f64,
    /// Photo-response non-uniformity: rms, fraction of 1.
    pub prnu: f64,
    /// Read noise: rms, e⁻.
    pub read_noise_e: f64,
    /// Bits of the converter.
    pub bits: u32,
    /// What the converter adds, ADU.
    pub bias_adu: f64,
    /// Slope of the converter, ADU per e⁻.
    pub adu_per_e: f64,
    /// Matrix from black-free ADU per s sr to absolute XYZ, where one is known: primaries for viewers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub xyz_from_camera: Option<[[f64; 3]; 3]>,
}

/// The schema that sensor files name.
pub const SENSOR_SCHEMA: &str = "cyanometer-sensor/1";

impl Sensor {
    /// Checks that every number is possible.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn check(&self) -> std::result::Result<(), String> {
        if self.schema != SENSOR_SCHEMA {
            return Err(format!("schema is `{}`, not `{SENSOR_SCHEMA}`", self.schema));
        }
        let positive = [
            ("pixel_pitch_um", self.pixel_pitch_um),
            ("full_well_e", self.full_well_e),
            ("temperature_k", self.temperature_k),
            ("adu_per_e", self.adu_per_e),
            ("width", f64::from(self.width)),
            ("height", f64::from(self.height)),
        ];
        for (key, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("`{key}` is {value}; it must be above 0"));
            }
        }
        let not_negative = [
            ("dark_current_na_per_cm2", self.dark_current_na_per_cm2.unwrap_or(0.0)),
            ("dark_current_e_per_s", self.dark_current_e_per_s.unwrap_or(0.0)),
            ("dcnu", self.dcnu),
            ("prnu", self.prnu),
            ("read_noise_e", self.read_noise_e),
        ];
        for (key, value) in not_negative {
            if !(0.0..f64::INFINITY).contains(&value) {
                return Err(format!("`{key}` is {value}; it must not be negative"));
            }
        }
        if !(1..=16).contains(&self.bits) {
            return Err(format!("`bits` is {}; it must be 1 to 16", self.bits));
        }
        if !self.bias_adu.is_finite() {
            return Err(format!("`bias_adu` is {}; it must be a finite number", self.bias_adu));
        }
        match (self.dark_current_na_per_cm2, self.dark_current_e_per_s) {
            (Some(_), None) | (None, Some(_)) => Ok(()),
            _ => Err("it must have one of `dark_current_na_per_cm2` and `dark_current_e_per_s`".into()),
        }
    }

    /// Area of a photosite in cm².
    pub fn pixel_area_cm2(&self) -> f64 {
        (self.pixel_pitch_um * CM_PER_UM).powi(2)
    }

    /// Dark current of a photosite in e⁻ s⁻¹ at a temperature in K.
    ///
    /// I = 2.5·10¹⁵ A_p i_d T^1.5 exp(−E_g / 2kT)        [HP2005, Eq. 6]
    ///
    /// A dark current that was measured at the sensor's own temperature is scaled by the same law.
    pub fn dark_current_e_per_s(&self, temperature_k: f64) -> f64 {
        /// Electrons per s, cm² and nA cm⁻² that Eq. 6 has in front of T^1.5.
        const PREFACTOR: f64 = 2.5e15;
        let law = |t: f64| t.powf(1.5) * (-silicon_band_gap_ev(t) / (2.0 * BOLTZMANN_EV_PER_K * t)).exp();
        match (self.dark_current_na_per_cm2, self.dark_current_e_per_s) {
            (Some(density), _) => PREFACTOR * self.pixel_area_cm2() * density * law(temperature_k),
            (None, Some(measured)) => measured * law(temperature_k) / law(self.temperature_k),
            (None, None) => 0.0,
        }
    }
}

/// Band gap of silicon in eV at a temperature in K.
///
/// E_g = 1.1557 − 7.021·10⁻⁴ T² / (1108 + T)        [Varshni1967, constants for silicon]
pub fn silicon_band_gap_ev(temperature_k: f64) -> f64 {
    1.1557 - 7.021e-4 * temperature_k.powi(2) / (1108.0 + temperature_k)
}

/// What the classes of a sensor make of light, as functions of wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralResponse {
    /// Quantum efficiency of R, G and B in e⁻ per photon.
    pub quantum_efficiency: [Curve; 3],
    /// Transmittance of the cover glass; none means 1.
    pub cover_glass: Option<Curve>,
}

impl SpectralResponse {
    /// Weights that turn spectral radiance at `wavelengths_nm` into electrons of the three classes.
    ///
    /// ρᵏ = Σ_j w_j L_j,  w_j = C C_opt λ_j Q_jᵏ G_j Δλ,  C = A_p Δt / (hc) · 10⁻⁹        [HP2005, Eq. 5]
    ///
    /// with λ in nm, A_p in cm² and L in W cm⁻² sr⁻¹ nm⁻¹; `widths_nm` are the Δλ of the rule of summation.
    pub fn electron_weights(
        &self,
        sensor: &Sensor,
        exposure: &Exposure,
        wavelengths_nm: &[f64],
        widths_nm: &[f64],
    ) -> [Vec<f64>; 3] {
        let photons_per_joule_nm = M_PER_NM / (PLANCK_J_S * LIGHT_M_PER_S);
        let factor = sensor.pixel_area_cm2() * exposure.exposure_s_sr() * photons_per_joule_nm;
        self.quantum_efficiency.each_ref().map(|efficiency| {
            let weight = |(&nm, &width): (&f64, &f64)| {
                let transmittance = self.cover_glass.as_ref().map_or(1.0, |glass| glass.at(nm));
                factor * nm * efficiency.at(nm) * transmittance * width
            };
            wavelengths_nm.iter().zip(widths_nm).map(weight).collect()
        })
    }

    /// [`Self::electron_weights`] on the points of a grid, with those wavelengths left out at which no class responds.
    ///
    /// # Errors
    ///
    /// As [`WavelengthGrid::points`]; [`Error::Data`] when no class responds anywhere on the grid.
    pub fn weights_on(&self, sensor: &Sensor, exposure: &Exposure, grid: &WavelengthGrid) -> Result<GridWeights> {
        let (all_nm, widths) = grid.points()?;
        let all = self.electron_weights(sensor, exposure, &all_nm, &widths);
        let kept: Vec<usize> = (0..all_nm.len()).filter(|&i| all.iter().any(|class| class[i] != 0.0)).collect();
        if kept.is_empty() {
            return Err(Error::Data(format!(
                "the sensor {} does not respond between {} and {} nm",
                sensor.name, grid.start_nm, grid.end_nm
            )));
        }
        let wavelengths_nm = kept.iter().map(|&i| all_nm[i]).collect();
        let weights = all.each_ref().map(|class| kept.iter().map(|&i| class[i]).collect());
        Ok(GridWeights { wavelengths_nm, weights, left_out: all_nm.len() - kept.len() })
    }
}

/// Weights that turn radiance into electrons of the three classes.
#[derive(Debug, Clone, PartialEq)]
pub struct GridWeights {
    /// Wavelengths in nm.
    pub wavelengths_nm: Vec<f64>,
    /// Electrons per unit of radiance at each wavelength, for R, G and B.
    pub weights: [Vec<f64>; 3],
    /// How many wavelengths were left out because no class responds there.
    pub left_out: usize,
}

impl GridWeights {
    /// The camera for radiances that are sampled at `sampled_nm`, and the share of its response that lies beyond them.
    pub fn camera(&self, sampled_nm: &[f64]) -> (Camera, f64) {
        let folded = self.weights.each_ref().map(|weights| fold(sampled_nm, &self.wavelengths_nm, weights));
        let uncovered = folded.iter().map(|class| class.uncovered).fold(0.0, f64::max);
        (Camera { weights: folded.map(|class| class.weights) }, uncovered)
    }
}

/// A sensor behind a lens at a set exposure, for radiances on one set of wavelengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Electrons per unit of radiance at each wavelength, for R, G and B.
    weights: [Vec<f64>; 3],
}

impl Camera {
    /// Signal electrons of R, G and B from a radiance in W cm⁻² sr⁻¹ nm⁻¹.
    ///
    /// # Examples
    ///
    /// ```
    /// use cyanometer::camera::optics::Exposure;
    /// use cyanometer::camera::sensor::SpectralResponse;
    /// use cyanometer::formats::data::load_sensor;
    /// use cyanometer::numerics::quadrature::Rule;
    /// use cyanometer::spectrum::{Curve, WavelengthGrid};
    ///
    /// // A photosite of 6.8 µm that turns half of all photons into electrons.
    /// let mut sensor = load_sensor("kaf-5101ce")?.sensor;
    /// sensor.pixel_pitch_um = 6.8;
    /// let half = || Curve::new(vec![400.0, 700.0], vec![0.5, 0.5]).unwrap();
    /// let response = SpectralResponse { quantum_efficiency: [half(), half(), half()], cover_glass: None };
    /// let exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };
    /// let grid = WavelengthGrid { start_nm: 550.0, end_nm: 550.0, step_nm: 1.0, quadrature: Rule::Rectangle };
    /// let (camera, _) = response.weights_on(&sensor, &exposure, &grid)?.camera(&[549.0, 550.0, 551.0]);
    ///
    /// // 10⁻⁶ W cm⁻² sr⁻¹ nm⁻¹ over 1 nm, 4.624·10⁻⁷ cm², π/257 sr, 33 ms: 1.865·10⁻¹⁶ J, photons of 3.612·10⁻¹⁹ J.
    /// let [red, ..] = camera.electrons(&[1e-6; 3]);
    /// assert!((red / (0.5 * 516.5) - 1.0).abs() < 1e-4, "{red}");
    /// # Ok::<(), cyanometer::error::Error>(())
    /// ```
    pub fn electrons(&self, radiance: &[f64]) -> [f64; 3] {
        self.weights.each_ref().map(|weights| weights.iter().zip(radiance).map(|(w, l)| w * l).sum())
    }

    /// The planes of a spectral image that this camera sees, `channels` the place of each wavelength and `factor` the W
    /// cm⁻² sr⁻¹ nm⁻¹ of a sample of 1. Planes to which no class responds are left out: they would add zeros.
    pub fn planes(&self, channels: &[usize], factor: f64) -> Vec<WeightedPlane> {
        let weights = (0..channels.len()).map(|i| self.weights.each_ref().map(|class| class[i] * factor));
        let planes = channels.iter().zip(weights).map(|(&plane, weights)| WeightedPlane { plane, weights });
        planes.filter(|plane| plane.weights != [0.0; 3]).collect()
    }

    /// Relative error of [`Self::electrons`] of R, G and B by `rule`, as the same camera at twice the step tells it; none
    /// where no estimate is possible.
    pub fn quadrature_error(&self, rule: Rule, at_twice_the_step: &Self, radiance: &[f64]) -> Option<[f64; 3]> {
        let (fine, coarse) = (self.electrons(radiance), at_twice_the_step.electrons(radiance));
        let [red, green, blue] = [0, 1, 2].map(|k| rule.relative_error(fine[k], coarse[k]));
        Some([red?, green?, blue?])
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The default sensor without its curves.
    pub(crate) fn kaf5101ce() -> Sensor {
        Sensor {
            schema: SENSOR_SCHEMA.into(),
            name: "kaf-5101ce".into(),
            description: None,
            source: None,
            width: 2654,
            height: 1996,
            pixel_pitch_um: 6.8,
            cfa: CfaPattern::Rggb,
            quantum_efficiency: CurveFile { file: "qe.csv".into(), column: None, sha256: None },
            cover_glass: None,
            full_well_e: 40_000.0,
            dark_current_na_per_cm2: Some(0.068558),
            dark_current_e_per_s: None,
            temperature_k: 333.0,
            dcnu: 0.2,
            prnu: 0.008,
            read_noise_e: 15.7,
            bits: 12,
            bias_adu: 1753.0,
            adu_per_e: 0.058824,
            xyz_from_camera: None,
        }
    }

    /// Table 1 gives 40 mV s⁻¹ at 333 K and 720 mV for 40 000 e⁻; MODEL's recomputation of Eq. 6 gives 2218.6 e⁻ s⁻¹.
    #[test]
    fn the_dark_current_is_that_of_the_data_sheet() {
        let current = kaf5101ce().dark_current_e_per_s(333.0);
        assert!((current - 2218.6).abs() < 0.05, "{current}");
        assert!((current * 0.018 - 39.93).abs() < 0.005);
        assert!((current * 0.033 - 73.21).abs() < 0.005);
    }

    #[test]
    fn a_measured_dark_current_follows_the_same_law() {
        let by_density = kaf5101ce();
        let measured = Sensor {
            dark_current_na_per_cm2: None,
            dark_current_e_per_s: Some(by_density.dark_current_e_per_s(333.0)),
            ..kaf5101ce()
        };
        for t in [200.0, 300.0, 350.0] {
            let ratio = measured.dark_current_e_per_s(t) / by_density.dark_current_e_per_s(t);
            assert!((ratio - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn impossible_sensors_are_refused_by_key() {
        let complaint = |sensor: Sensor| sensor.check().unwrap_err();
        assert!(complaint(Sensor { read_noise_e: f64::NAN, ..kaf5101ce() }).contains("read_noise_e"));
        assert!(complaint(Sensor { adu_per_e: 0.0, ..kaf5101ce() }).contains("adu_per_e"));
        assert!(complaint(Sensor { bits: 17, ..kaf5101ce() }).contains("bits"));
        assert!(complaint(Sensor { dark_current_na_per_cm2: None, ..kaf5101ce() }).contains("one of"));
        assert_eq!(kaf5101ce().check(), Ok(()));
    }

    /// Equal energy of 1 W in every nm through a sensor that turns every photon into an electron.
    #[test]
    fn a_perfect_sensor_counts_photons() {
        let flat = Curve::new(vec![300.0, 900.0], vec![1.0, 1.0]).unwrap();
        let response = SpectralResponse { quantum_efficiency: [flat.clone(), flat.clone(), flat], cover_glass: None };
        let exposure = Exposure { exposure_s: 2.0, f_number: 0.5, lens_transmittance: 1.0 };
        let weights = response.electron_weights(&kaf5101ce(), &exposure, &[500.0], &[1.0]);
        // Photon energy at 500 nm from hc = 1.986 445 857·10⁻²⁵ J m (CODATA 2018); π/(4·¼ + 1) = π/2 sr.
        let photons = 1.0 / (1.986_445_857e-25 / 500e-9);
        let expected = photons * 6.8e-4f64.powi(2) * 2.0 * std::f64::consts::FRAC_PI_2;
        assert!((weights[0][0] / expected - 1.0).abs() < 1e-9);
    }
}
