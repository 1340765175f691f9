//! The spectral response of a sensor: what its classes make of light.

use crate::camera::optics::Exposure;
use crate::camera::sensor::Sensor;
use crate::error::{Error, Result};
use crate::numerics::planes::WeightedPlane;
use crate::numerics::quadrature::Rule;
use crate::spectrum::{Curve, WavelengthGrid, fold};
use crate::units::{LIGHT_M_PER_S, M_PER_NM, PLANCK_J_S};

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
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where the sensor's read-out tells no pitch of its photosites.
    pub fn electron_weights(
        &self,
        sensor: &Sensor,
        exposure: &Exposure,
        wavelengths_nm: &[f64],
        widths_nm: &[f64],
    ) -> Result<[Vec<f64>; 3]> {
        let photons_per_joule_nm = M_PER_NM / (PLANCK_J_S * LIGHT_M_PER_S);
        let factor = sensor.pixel_area_cm2()? * exposure.exposure_s_sr() * photons_per_joule_nm;
        Ok(self.quantum_efficiency.each_ref().map(|efficiency| {
            let weight = |(&nm, &width): (&f64, &f64)| {
                let transmittance = self.cover_glass.as_ref().map_or(1.0, |glass| glass.at(nm));
                factor * nm * efficiency.at(nm) * transmittance * width
            };
            wavelengths_nm.iter().zip(widths_nm).map(weight).collect()
        }))
    }

    /// [`Self::electron_weights`] on the points of a grid, with those wavelengths left out at which no class responds.
    ///
    /// # Errors
    ///
    /// As [`WavelengthGrid::points`] and [`Self::electron_weights`]; [`Error::Data`] when no class responds anywhere on the grid.
    pub fn weights_on(&self, sensor: &Sensor, exposure: &Exposure, grid: &WavelengthGrid) -> Result<GridWeights> {
        let (all_nm, widths) = grid.points()?;
        let all = self.electron_weights(sensor, exposure, &all_nm, &widths)?;
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
mod tests {
    use super::*;
    use crate::camera::sensor::tests::kaf5101ce;

    /// Equal energy of 1 W in every nm through a sensor that turns every photon into an electron.
    #[test]
    fn a_perfect_sensor_counts_photons() {
        let flat = Curve::new(vec![300.0, 900.0], vec![1.0, 1.0]).unwrap();
        let response = SpectralResponse { quantum_efficiency: [flat.clone(), flat.clone(), flat], cover_glass: None };
        let exposure = Exposure { exposure_s: 2.0, f_number: 0.5, lens_transmittance: 1.0 };
        let weights = response.electron_weights(&kaf5101ce(), &exposure, &[500.0], &[1.0]).unwrap();
        // Photon energy at 500 nm from hc = 1.986 445 857·10⁻²⁵ J m (CODATA 2018); π/(4·¼ + 1) = π/2 sr.
        let photons = 1.0 / (1.986_445_857e-25 / 500e-9);
        let expected = photons * 6.8e-4f64.powi(2) * 2.0 * std::f64::consts::FRAC_PI_2;
        assert!((weights[0][0] / expected - 1.0).abs() < 1e-9);
    }
}
