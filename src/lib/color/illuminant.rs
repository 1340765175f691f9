//! Illuminants that have a formula.

use super::upsampling::whole_nm;
use crate::spectrum::Curve;

/// CIE standard illuminant A, 360 to 830 nm by 1 nm.
///
/// S(λ) = 100 (560/λ)⁵ (exp(1.435·10⁷/(2848 · 560)) − 1) / (exp(1.435·10⁷/(2848 λ)) − 1), λ in nm        [CIE 015]
pub fn a() -> Curve {
    const C2_NM_K: f64 = 1.435e7;
    const TEMPERATURE_K: f64 = 2848.0;
    let photons = |nm: f64| (C2_NM_K / (TEMPERATURE_K * nm)).exp_m1();
    curve(|nm| 100.0 * (560.0 / nm).powi(5) * photons(560.0) / photons(nm))
}

/// Illuminant E: the same power at all wavelengths.
pub fn equal_energy() -> Curve {
    curve(|_| 100.0)
}

fn curve(power: impl Fn(f64) -> f64) -> Curve {
    let wavelengths: Vec<f64> = whole_nm().collect();
    let values = wavelengths.iter().map(|&nm| power(nm)).collect();
    // Ascending, finite, as many values as wavelengths.
    Curve::new(wavelengths, values).unwrap_or_else(|problem| unreachable!("{problem}"))
}

#[cfg(test)]
mod tests {
    use crate::formats::data::{load_illuminant, load_observer};

    /// [CIE 015, Table T.3]: x, y to five digits; the sum by 1 nm adds up to 2·10⁻⁵ (E).
    #[test]
    fn illuminants_have_the_published_chromaticities() {
        let observer = load_observer().unwrap();
        for (name, xy) in [("a", [0.447_58, 0.407_45]), ("d65", [0.312_72, 0.329_03]), ("e", [1.0 / 3.0, 1.0 / 3.0])] {
            let light = load_illuminant(name).unwrap();
            let sums = observer
                .matching
                .each_ref()
                .map(|curve| (360..=830).map(f64::from).map(|nm| curve.at(nm) * light.at(nm)).sum::<f64>());
            let total: f64 = sums.iter().sum();
            for i in 0..2 {
                assert!((sums[i] / total - xy[i]).abs() < 2.5e-5, "{name} {}", sums[i] / total);
            }
        }
    }
}
