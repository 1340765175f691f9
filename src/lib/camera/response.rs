//! The spectral response of a sensor: what its classes make of light.

use crate::camera::optics::Exposure;
use crate::camera::sensor::{Counts, Sensor};
use crate::error::{Error, Result};
use crate::numerics::planes::WeightedPlane;
use crate::spectrum::{Between, Curve, WavelengthGrid, fold};
use crate::units::{LIGHT_M_PER_S, M_PER_NM, PLANCK_J_S};

/// How the curves of a response stand to quantum efficiencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// They are quantum efficiencies, in e⁻ per photon.
    Absolute,
    /// They are known up to a common factor.
    Relative {
        /// What they count.
        counts: Counts,
        /// The largest quantum efficiency of the classes, in e⁻ per photon, where it is known.
        peak: Option<f64>,
    },
}

/// What the classes of a sensor make of light, as functions of wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralResponse {
    /// Quantum efficiency of R, G and B in e⁻ per photon, or what stands for it by `scale`.
    pub quantum_efficiency: [Curve; 3],
    /// Transmittance of the cover glass; none means 1.
    pub cover_glass: Option<Curve>,
    /// What the curves are.
    pub scale: Scale,
}

impl SpectralResponse {
    /// A response in electrons per photon.
    pub fn absolute(quantum_efficiency: [Curve; 3], cover_glass: Option<Curve>) -> Self {
        Self { quantum_efficiency, cover_glass, scale: Scale::Absolute }
    }

    /// What is proportional to the quantum efficiency of a class at a wavelength in nm, by a factor that all classes have in
    /// common: of signals per watt, s(λ)/λ.
    fn shape(&self, class: &Curve, nm: f64) -> f64 {
        match self.scale {
            Scale::Relative { counts: Counts::Energy, .. } => class.at(nm) / nm,
            _ => class.at(nm),
        }
    }

    /// Electrons per photon of a [`Self::shape`] of 1. Between samples s(λ)/λ has no maximum, so that the largest is at one.
    fn efficiency_of_shape(&self, sensor: &Sensor) -> Result<f64> {
        let Scale::Relative { peak, .. } = self.scale else { return Ok(1.0) };
        let peak = peak.ok_or_else(|| {
            let problem = "its response is relative, without a scale: how many electrons a photon gives is not known";
            sensor.refuse(problem).give(&["peak_quantum_efficiency"])
        })?;
        let shapes = self
            .quantum_efficiency
            .iter()
            .flat_map(|class| class.wavelengths_nm().iter().map(|&nm| self.shape(class, nm)));
        Ok(peak / shapes.fold(0.0, f64::max))
    }

    /// Weights that turn spectral radiance at `wavelengths_nm` into electrons of the three classes.
    ///
    /// ρᵏ = Σ_j w_j L_j,  w_j = C C_opt λ_j Q_jᵏ G_j Δλ,  C = A_p Δt / (hc) · 10⁻⁹        [HP2005, Eq. 5]
    ///
    /// with λ in nm, A_p in cm² and L in W cm⁻² sr⁻¹ nm⁻¹; `widths_nm` are the Δλ of the rule of summation.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where the sensor's read-out tells no pitch of its photosites; [`Error::Format`] where the response
    /// is relative and has no scale.
    pub fn electron_weights(
        &self,
        sensor: &Sensor,
        exposure: &Exposure,
        wavelengths_nm: &[f64],
        widths_nm: &[f64],
    ) -> Result<[Vec<f64>; 3]> {
        let photons_per_joule_nm = M_PER_NM / (PLANCK_J_S * LIGHT_M_PER_S);
        let factor = sensor.pixel_area_cm2()?
            * exposure.exposure_s_sr()
            * photons_per_joule_nm
            * self.efficiency_of_shape(sensor)?;
        Ok(self.quantum_efficiency.each_ref().map(|efficiency| {
            let weight = |(&nm, &width): (&f64, &f64)| {
                let transmittance = self.cover_glass.as_ref().map_or(1.0, |glass| glass.at(nm));
                factor * nm * self.shape(efficiency, nm) * transmittance * width
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
        self.weights_at(sensor, exposure, grid, grid.points()?)
    }

    /// The same for the integral over the extent of the grid of a radiance that is linear between `sampled_nm`, as the tables
    /// of the response are between their own wavelengths: exact but for rounding.
    ///
    /// # Errors
    ///
    /// As [`Self::weights_on`].
    pub fn weights_between(
        &self,
        sensor: &Sensor,
        exposure: &Exposure,
        grid: &WavelengthGrid,
        sampled_nm: &[f64],
    ) -> Result<GridWeights> {
        let knots = self.knots_nm().chain(sampled_nm.iter().copied());
        self.weights_at(sensor, exposure, grid, grid.points_between(knots))
    }

    /// The wavelengths of all tables.
    pub fn knots_nm(&self) -> impl Iterator<Item = f64> {
        let curves = self.quantum_efficiency.iter().chain(&self.cover_glass);
        curves.flat_map(|curve| curve.wavelengths_nm().iter().copied())
    }

    /// The share of the response to a radiance that is the same everywhere which lies beyond the extent of a grid, of the
    /// class that loses most.
    pub fn beyond(&self, grid: &WavelengthGrid) -> f64 {
        let (start_nm, end_nm) =
            self.knots_nm().fold((grid.start_nm, grid.end_nm), |(a, b), nm| (a.min(nm), b.max(nm)));
        let (points, widths) = WavelengthGrid { start_nm, end_nm, ..*grid }
            .points_between(self.knots_nm().chain([grid.start_nm, grid.end_nm]));
        let share = |efficiency: &Curve| {
            let (mut inside, mut all) = (0.0, 0.0);
            for (&nm, &width) in points.iter().zip(&widths) {
                let response = nm
                    * self.shape(efficiency, nm)
                    * self.cover_glass.as_ref().map_or(1.0, |glass| glass.at(nm))
                    * width;
                all += response;
                inside += if (grid.start_nm..=grid.end_nm).contains(&nm) { response } else { 0.0 };
            }
            if all > 0.0 { 1.0 - inside / all } else { 0.0 }
        };
        self.quantum_efficiency.iter().map(share).fold(0.0, f64::max)
    }

    fn weights_at(
        &self,
        sensor: &Sensor,
        exposure: &Exposure,
        grid: &WavelengthGrid,
        (all_nm, widths): (Vec<f64>, Vec<f64>),
    ) -> Result<GridWeights> {
        let all = self.electron_weights(sensor, exposure, &all_nm, &widths)?;
        let kept: Vec<usize> = (0..all_nm.len()).filter(|&i| all.iter().any(|class| class[i] != 0.0)).collect();
        if kept.is_empty() {
            let (start_nm, end_nm) = (grid.start_nm, grid.end_nm);
            return Err(Error::Data(if start_nm == end_nm {
                format!(
                    "from {start_nm} to {end_nm} nm there is nothing to sum over; for light of one wavelength give it some width, as from {} to {} nm",
                    start_nm - 0.5,
                    end_nm + 0.5
                )
            } else {
                format!("the sensor {} does not respond between {start_nm} and {end_nm} nm", sensor.name)
            }));
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

    /// What each sample of a radiance in W cm⁻² sr⁻¹ nm⁻¹ adds to the signal electrons of R, G and B.
    pub fn shares(&self, radiance: &[f64]) -> [Vec<f64>; 3] {
        self.weights.each_ref().map(|weights| weights.iter().zip(radiance).map(|(w, l)| w * l).collect())
    }

    /// The planes of a spectral image that this camera sees, `channels` the places that its wavelengths lie `between`, and `factors`
    /// the W cm⁻² sr⁻¹ nm⁻¹ of a sample of 1 at each of these. Planes to which no class responds are left out: they would add zeros.
    pub fn planes(&self, channels: &[usize], between: &Between, factors: &[f64]) -> Vec<WeightedPlane> {
        let of_class = |class: &Vec<f64>| {
            between.folded(class.iter().zip(factors).map(|(weight, factor)| weight * factor).collect(), channels.len())
        };
        let classes = self.weights.each_ref().map(of_class);
        let weights = (0..channels.len()).map(|i| classes.each_ref().map(|class| class[i]));
        let planes = channels.iter().zip(weights).map(|(&plane, weights)| WeightedPlane { plane, weights });
        planes.filter(|plane| plane.weights != [0.0; 3]).collect()
    }

    /// Relative error of [`Self::electrons`] of R, G and B, `exact` the camera that integrates between all samples; none
    /// where a sum stands for an integral of zero.
    pub fn quadrature_error(&self, exact: &Self, radiance: &[f64]) -> Option<[f64; 3]> {
        let (sum, integral) = (self.electrons(radiance), exact.electrons(radiance));
        let error = |k: usize| {
            let error = (sum[k] - integral[k]).abs();
            if error == 0.0 { Some(0.0) } else { Some(error / integral[k].abs()).filter(|error| error.is_finite()) }
        };
        Some([error(0)?, error(1)?, error(2)?])
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
        let response = SpectralResponse::absolute([flat.clone(), flat.clone(), flat], None);
        let exposure = Exposure { exposure_s: 2.0, f_number: 0.5, lens_transmittance: 1.0 };
        let weights = response.electron_weights(&kaf5101ce(), &exposure, &[500.0], &[1.0]).unwrap();
        // Photon energy at 500 nm from hc = 1.986 445 857·10⁻²⁵ J m (CODATA 2018); π/(4·¼ + 1) = π/2 sr.
        let photons = 1.0 / (1.986_445_857e-25 / 500e-9);
        let expected = photons * 6.8e-4f64.powi(2) * 2.0 * std::f64::consts::FRAC_PI_2;
        assert!((weights[0][0] / expected - 1.0).abs() < 1e-9);
    }

    /// Signals per watt are quantum efficiencies times wavelength: a response that is one and the other, and has the same
    /// peak, gives the same electrons; and so does any common factor of it.
    #[test]
    fn a_response_per_watt_is_one_per_photon_times_wavelength() {
        let nm: Vec<f64> = (0..=40).map(|i| 380.0 + 10.0 * f64::from(i)).collect();
        let bell = |peak: f64, height: f64| -> Vec<f64> {
            nm.iter().map(|nm| height * (-((nm - peak) / 50.0_f64).powi(2)).exp()).collect()
        };
        let efficiencies = [bell(600.0, 0.3), bell(530.0, 0.45), bell(460.0, 0.4)];
        let curve = |values: Vec<f64>| Curve::new(nm.clone(), values).unwrap();
        let absolute = SpectralResponse::absolute(efficiencies.clone().map(curve), None);
        let relative = |counts: Counts, factor: f64, peak: Option<f64>| {
            let value = |(q, nm): (&f64, &f64)| factor * q * if counts == Counts::Energy { *nm } else { 1.0 };
            let classes = efficiencies.each_ref().map(|class| curve(class.iter().zip(&nm).map(value).collect()));
            SpectralResponse { quantum_efficiency: classes, cover_glass: None, scale: Scale::Relative { counts, peak } }
        };
        let exposure = Exposure { exposure_s: 2.0, f_number: 8.0, lens_transmittance: 1.0 };
        let weights = |response: &SpectralResponse| {
            response.electron_weights(&kaf5101ce(), &exposure, &nm, &vec![10.0; nm.len()])
        };
        let wanted = weights(&absolute).unwrap();
        for counts in [Counts::Energy, Counts::Quanta] {
            for factor in [1.0, 3.7e-3, 1e5] {
                let found = weights(&relative(counts, factor, Some(0.45))).unwrap();
                let pairs = found.iter().flatten().zip(wanted.iter().flatten());
                // A few roundings of doubles.
                assert!(pairs.clone().all(|(a, b)| (a / b - 1.0).abs() < 1e-14), "{counts:?}, {factor}");
            }
            let half = weights(&relative(counts, 1.0, Some(0.225))).unwrap();
            assert!((half[1][15] / wanted[1][15] - 0.5).abs() < 1e-14);
        }
        let refused = weights(&relative(Counts::Energy, 1.0, None)).unwrap_err().to_string();
        assert!(refused.contains("its response is relative, without a scale"), "{refused}");
        // The share beyond a grid hangs on no scale.
        let grid = WavelengthGrid { start_nm: 420.0, ..WavelengthGrid::default() };
        let beyond = [absolute.beyond(&grid), relative(Counts::Quanta, 2.0, None).beyond(&grid)];
        assert!((beyond[0] - beyond[1]).abs() < 1e-14 && beyond[0] > 0.01, "{beyond:?}");
    }

    /// A triangle of light, 0.1 nm wide at its foot, that no whole nanometer meets, through an efficiency that rises with
    /// wavelength: ∫ λ Q L dλ by the moments of a triangle, λ₀ (λ₀/1000) + σ²/1000 of its area, σ² = w²/24.
    #[test]
    fn a_line_between_steps_is_whole_in_the_integral_and_the_sum_admits_its_loss() {
        let rising = Curve::new(vec![300.0, 1000.0], vec![0.3, 1.0]).unwrap();
        let response = SpectralResponse::absolute([rising.clone(), rising.clone(), rising], None);
        let exposure = Exposure { exposure_s: 2.0, f_number: 8.0, lens_transmittance: 1.0 };
        let (grid, sensor) = (WavelengthGrid::default(), kaf5101ce());
        let line_nm = [300.0, 589.25, 589.3, 589.35, 900.0];
        let radiance = [0.0, 0.0, 1e-6, 0.0, 0.0];
        assert!(grid.is_coarser_than(&line_nm));
        let exact = response.weights_between(&sensor, &exposure, &grid, &line_nm).unwrap().camera(&line_nm).0;
        let per_nm = response.electron_weights(&sensor, &exposure, &[500.0], &[1.0]).unwrap()[0][0] / (500.0 * 0.5);
        let expected = per_nm * 1e-6 * 0.05 * (589.3_f64.powi(2) + 0.1_f64.powi(2) / 24.0) / 1000.0;
        assert!((exact.electrons(&radiance)[0] / expected - 1.0).abs() < 1e-12);
        let sum = response.weights_on(&sensor, &exposure, &grid).unwrap().camera(&line_nm).0;
        assert_eq!(sum.electrons(&radiance), [0.0; 3]);
        assert_eq!(sum.quadrature_error(&exact, &radiance), Some([1.0; 3]));
        // (830² − 360²) of (1000² − 300²), both weighted with λ Q ∝ λ²: cubes.
        let inside = (0.83_f64.powi(3) - 0.36_f64.powi(3)) / (1.0 - 0.3_f64.powi(3));
        assert!((response.beyond(&grid) - (1.0 - inside)).abs() < 1e-12);
    }
}
