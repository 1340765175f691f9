//! Variance as a straight line of the signal: what raw converters are told of noise.

use super::charge::sensitivity;
use super::moments::Equations;
use super::photosite::Photosite;
use crate::metadata::AdcRecord;
use crate::stages::noise::NoiseModel;

/// Variance of codes over exposures, on average over photosites, σ² = slope · s + offset over their mean s above black, both in ADU.
///
/// slope = K (μ² + c₂)/μ, offset = K² (κ + σ_R²) + 1/12
///
/// with K in ADU per e⁻; μ and c₂ mean and variance of the sensitivities (μ = 1 and c₂ = PRNU², but for patterns cut off at
/// zero); κ the shot noise of the dark signal; σ_R the read noise; 1/12 for rounding. It is
/// [`super::Photosite`]'s exact variance where nothing is clipped, less the fixed patterns: that of the
/// response, c₂ (s/μ)², and those that no light has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearNoise {
    /// ADU² per ADU.
    pub slope_adu: f64,
    /// ADU².
    pub offset_adu2: f64,
}

impl LinearNoise {
    /// The line of a photosite that a converter reads.
    pub fn of(model: &NoiseModel, adc: &AdcRecord) -> Self {
        let (mean, pattern, ..) = sensitivity(model.response());
        let shot = if model.signal_shot { mean * mean + pattern } else { 0.0 };
        let unlimited = NoiseModel { full_well_e: f64::INFINITY, ..*model };
        let dark = Photosite::of_electrons(unlimited, Equations::Exact);
        let no_light = dark.temporal_variance(0.0, dark.moments(0.0).moments.variance);
        let gain = adc.adu_per_e;
        Self { slope_adu: gain * shot / mean, offset_adu2: gain * gain * no_light + 1.0 / 12.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::PoissonKind;
    use crate::stages::noise::{LineNoise, Tails};

    /// The exact moments of codes, at three signals that no end of the range is near. Patterns that are cut off at zero have
    /// theirs by quadrature, good to 10⁻⁷ here; the others are formulas.
    #[test]
    fn it_is_the_exact_variance_less_the_patterns() {
        let adc = AdcRecord::new(16, 800.0, 0.8);
        for (prnu, dcnu, shot) in [(0.0, 0.0, true), (0.008, 0.2, true), (0.3, 0.5, true), (0.01, 0.1, false)] {
            let model = NoiseModel {
                dark_e: 73.0,
                dcnu,
                prnu,
                read_noise_e: 12.0,
                full_well_e: 1e6,
                dark_shot: true,
                signal_shot: shot,
                poisson: PoissonKind::Exact,
                lines: LineNoise::default(),
                tails: Tails::default(),
            };
            let line = LinearNoise::of(&model, &adc);
            let photosite = Photosite::of_electrons(model, Equations::Exact).digitized(adc);
            let dark = photosite.moments(0.0).moments;
            let tolerance = if prnu > 0.1 || dcnu > 0.1 { 1e-7 } else { 1e-12 };
            let (_, dark_pattern, ..) = sensitivity(dcnu);
            let no_light = line.offset_adu2 + dark_pattern * (adc.adu_per_e * model.dark_e).powi(2);
            assert!((dark.variance / no_light - 1.0).abs() < tolerance, "{} {line:?}", dark.variance);
            for expected_e in [100.0, 2000.0, 20_000.0] {
                let found = photosite.moments(expected_e).moments;
                let signal = found.mean - dark.mean;
                let (mean, pattern, ..) = sensitivity(prnu);
                let variance = line.slope_adu * signal + no_light + pattern * (signal / mean).powi(2);
                assert!(
                    (found.variance / variance - 1.0).abs() < tolerance,
                    "{expected_e}: {} {variance}",
                    found.variance
                );
            }
        }
    }
}
