//! Lines of the CIE 1931 diagram: black bodies, daylight, clear skies, and the boundary.

use crate::spectrum::Observer;
use crate::units::{BOLTZMANN_J_PER_K, LIGHT_M_PER_S, M_PER_NM, PLANCK_J_S};

/// The x of the CIE daylight locus, from 25 000 K to 4000 K [CIE 015].
pub const DAYLIGHT_X: [f64; 2] = [0.250, 0.380];

/// The x of the skies that [`clear_sky`] was fitted to.
pub const CLEAR_SKY_X: [f64; 2] = [0.237, 0.322];

/// Where the observer's tables begin and end, nm.
const VISIBLE_NM: [i32; 2] = [360, 830];

fn visible_nm() -> impl Iterator<Item = f64> {
    (VISIBLE_NM[0]..=VISIBLE_NM[1]).map(f64::from)
}

/// The tristimulus values of one wavelength at unit radiance, but for a common factor.
fn matching(observer: &Observer, wavelength_nm: f64) -> [f64; 3] {
    observer.matching.each_ref().map(|curve| curve.at(wavelength_nm))
}

/// Not a number where all three values are zero.
fn chromaticity([x, y, z]: [f64; 3]) -> [f64; 2] {
    let sum = x + y + z;
    [x / sum, y / sum]
}

/// Chromaticity of a black body.
///
/// L(λ) ∝ λ⁻⁵ / (exp(h c / λ k T) − 1)
///
/// λ in vacuum, summed from 360 to 830 nm by 1 nm. The observer's wavelengths are those of standard air; the difference
/// (index 1.00028) is left out; at 6500 K it would move x and y by 3·10⁻⁵. Temperatures below some 100 K leave
/// nothing to sum.
pub fn planckian(observer: &Observer, temperature_k: f64) -> [f64; 2] {
    let mut xyz = [0.0; 3];
    for wavelength_nm in visible_nm() {
        let wavelength_m = wavelength_nm * M_PER_NM;
        let photon_over_thermal = PLANCK_J_S * LIGHT_M_PER_S / (wavelength_m * BOLTZMANN_J_PER_K * temperature_k);
        let radiance = wavelength_m.powi(-5) / photon_over_thermal.exp_m1();
        for (sum, value) in xyz.iter_mut().zip(matching(observer, wavelength_nm)) {
            *sum += radiance * value;
        }
    }
    chromaticity(xyz)
}

/// The y of the CIE daylight locus at x within [`DAYLIGHT_X`].
///
/// y = −3.000 x² + 2.870 x − 0.275        [CIE 015]
pub fn daylight(x: f64) -> f64 {
    (-3.000 * x + 2.870) * x - 0.275
}

/// The y of measured clear skies at x within [`CLEAR_SKY_X`].
///
/// y = −4.9088 x² + 3.8004 x − 0.3836
///
/// A parabola through the skies of \[Kider2014], which lie 0.0033 (rms) about it.
pub fn clear_sky(x: f64) -> f64 {
    (-4.9088 * x + 3.8004) * x - 0.3836
}

/// Chromaticity of one wavelength from 360 to 830 nm.
pub fn monochromatic(observer: &Observer, wavelength_nm: f64) -> [f64; 2] {
    chromaticity(matching(observer, wavelength_nm))
}

/// The boundary of all chromaticities: the spectrum from 360 to 830 nm by 1 nm, and the first point again, which the
/// purple line leads to.
pub fn boundary(observer: &Observer) -> Vec<[f64; 2]> {
    let first = f64::from(VISIBLE_NM[0]);
    visible_nm().chain([first]).map(|nm| monochromatic(observer, nm)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::data::load_observer;

    #[track_caller]
    fn assert_near(found: [f64; 2], expected: [f64; 2], tolerance: f64) {
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
        assert!(near, "{found:?}, not {expected:?}");
    }

    #[test]
    fn black_bodies_have_the_published_chromaticities() {
        let observer = load_observer().unwrap();
        // Illuminant A: 2848 K with the c₂ of 1931, 1.4350·10⁻² m K. The spectrum depends on c₂/T only [CIE 015].
        let second_radiation_constant = PLANCK_J_S * LIGHT_M_PER_S / BOLTZMANN_J_PER_K;
        let temperature_k = 2848.0 * second_radiation_constant / 1.4350e-2;
        assert!((temperature_k - 2855.5).abs() < 0.05, "{temperature_k}");
        // Published to five digits; a sum from 380 to 780 nm by 5 nm has y larger by 0.6·10⁻⁵.
        assert_near(planckian(&observer, temperature_k), [0.44757, 0.40745], 1.2e-5);
        // Published to four digits.
        assert_near(planckian(&observer, 6500.0), [0.3135, 0.3237], 1e-4);
        // The end of the locus, published to three digits.
        assert_near(planckian(&observer, 1e9), [0.240, 0.234], 5e-4);
    }

    #[test]
    fn equal_energy_lies_beside_5455_kelvin() {
        // In the uv of 1960, E lies 0.0044 below the locus (four digits).
        let uv = |[x, y]: [f64; 2]| [4.0 * x, 6.0 * y].map(|value| value / (12.0 * y - 2.0 * x + 3.0));
        let distance = |t: f64| {
            let (black, equal) = (uv(planckian(&load_observer().unwrap(), t)), uv([1.0 / 3.0; 2]));
            f64::hypot(black[0] - equal[0], black[1] - equal[1])
        };
        assert!((distance(5455.0) - 0.0044).abs() < 5e-5, "{}", distance(5455.0));
        assert!(distance(5455.0) < distance(5400.0).min(distance(5510.0)));
    }

    #[test]
    fn the_daylight_locus_passes_by_the_daylight_illuminants() {
        // D50, D55, D65 and D75. Their spectra are rounded, which leaves them 1.1·10⁻⁴ below the parabola [CIE 015].
        for [x, y] in [[0.34567, 0.35850], [0.33242, 0.34743], [0.31272, 0.32903], [0.29902, 0.31485]] {
            assert!((daylight(x) - y - 1e-4).abs() < 3e-5, "{x}: {}", daylight(x));
        }
    }

    #[test]
    fn measured_clear_skies_lie_above_black_bodies_the_more_the_bluer() {
        let observer = load_observer().unwrap();
        let mut last = 0.012;
        for x in [0.24, 0.26, 0.28, 0.30, 0.32] {
            // The Planckian y at the same x, by bisection.
            let (mut low, mut high) = (4000.0, 1e8);
            while high / low > 1.0 + 1e-9 {
                let middle = f64::sqrt(low * high);
                if planckian(&observer, middle)[0] > x { low = middle } else { high = middle }
            }
            let above = clear_sky(x) - planckian(&observer, low)[1];
            assert!((0.0..last).contains(&above), "{x}: {above}");
            last = above;
        }
    }

    #[test]
    fn the_boundary_is_the_spectrum_closed_by_the_purple_line() {
        let observer = load_observer().unwrap();
        // CIE 1931 spectral chromaticities, published to four digits.
        for (nm, xy) in [(450.0, [0.1566, 0.0177]), (520.0, [0.0743, 0.8338]), (600.0, [0.6270, 0.3725])] {
            assert_near(monochromatic(&observer, nm), xy, 5.1e-5);
        }
        let boundary = boundary(&observer);
        assert_eq!((boundary.len(), boundary[0]), (472, boundary[471]));
        assert!(boundary.iter().flatten().all(|value| (0.0..1.0).contains(value)));
        // It goes once around white.
        let white = [1.0 / 3.0; 2];
        let turns = boundary.windows(2).map(|pair| {
            let side = |p: [f64; 2]| f64::atan2(p[1] - white[1], p[0] - white[0]);
            let turn = side(pair[1]) - side(pair[0]);
            turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round()
        });
        assert!((turns.sum::<f64>().abs() - std::f64::consts::TAU).abs() < 1e-9);
    }
}
