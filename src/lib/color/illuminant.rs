//! Lights: their spectra and their chromaticities.

use super::locus::{daylight, planckian};
use super::{D50_XY, D65_XY};
use crate::spectrum::Observer;
use crate::units::{BOLTZMANN_J_PER_K, LIGHT_M_PER_S, M_PER_NM, PLANCK_J_S};
use std::fmt;
use std::str::FromStr;

/// Temperatures of the CIE daylight locus, K.
const DAYLIGHT_K: [f64; 2] = [4000.0, 25_000.0];
/// The coldest black body that is taken for a light, K.
const COLDEST_K: f64 = 1000.0;
/// The second radiation constant of 1931, m K, and the temperature that it belongs to, by which the CIE defines A.
const A_C2_M_K: f64 = 1.4350e-2;
const A_K: f64 = 2848.0;

/// A light by its name or its temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Illuminant {
    /// CIE standard illuminant A, tungsten.
    A,
    /// Daylight of 5003 K.
    D50,
    /// Daylight of 5503 K.
    D55,
    /// CIE standard illuminant D65.
    D65,
    /// Daylight of 7504 K.
    D75,
    /// Equal energy.
    E,
    /// A temperature in K: below 4000 K a black body, from there to 25 000 K CIE daylight.
    Temperature(f64),
}

impl Illuminant {
    /// Those that have a name.
    pub const NAMED: [(&'static str, Self); 6] = [
        ("a", Self::A),
        ("d50", Self::D50),
        ("d55", Self::D55),
        ("d65", Self::D65),
        ("d75", Self::D75),
        ("e", Self::E),
    ];

    /// One of a temperature in K.
    ///
    /// # Errors
    ///
    /// In words, for a temperature that no light here has.
    pub fn of_temperature(temperature_k: f64) -> Result<Self, String> {
        if (COLDEST_K..=DAYLIGHT_K[1]).contains(&temperature_k) {
            return Ok(Self::Temperature(temperature_k));
        }
        Err(format!("give a temperature from {COLDEST_K} to {} K", DAYLIGHT_K[1]))
    }

    /// Its chromaticity for the 2° observer: as published of the illuminants [CIE 015, Table T.3], by formula of a temperature.
    pub fn white_xy(self, observer: &Observer) -> [f64; 2] {
        match self {
            Self::A => [0.447_57, 0.407_45],
            Self::D50 => D50_XY,
            Self::D55 => [0.332_42, 0.347_43],
            Self::D65 => D65_XY,
            Self::D75 => [0.299_02, 0.314_85],
            Self::E => [1.0 / 3.0; 2],
            Self::Temperature(kelvin) if kelvin < DAYLIGHT_K[0] => planckian(observer, kelvin),
            Self::Temperature(kelvin) => daylight_xy(kelvin),
        }
    }

    /// Its relative spectral power at a wavelength; `daylight` gives the components S₀, S₁ and S₂ there.
    pub fn power(self, wavelength_nm: f64, daylight: impl Fn(f64) -> [f64; 3]) -> f64 {
        let of_daylight = |xy| {
            let ([m1, m2], [s0, s1, s2]) = (daylight_shares(xy), daylight(wavelength_nm));
            s0 + m1 * s1 + m2 * s2
        };
        match self {
            Self::A => black_body(wavelength_nm, A_C2_M_K / A_K),
            Self::E => 1.0,
            // The temperatures of the illuminants are those that 1.4388/1.4380 makes of the whole numbers [CIE 015].
            Self::D50 => of_daylight(daylight_xy(5000.0 * 1.4388 / 1.4380)),
            Self::D55 => of_daylight(daylight_xy(5500.0 * 1.4388 / 1.4380)),
            Self::D65 => of_daylight(daylight_xy(6500.0 * 1.4388 / 1.4380)),
            Self::D75 => of_daylight(daylight_xy(7500.0 * 1.4388 / 1.4380)),
            Self::Temperature(kelvin) if kelvin < DAYLIGHT_K[0] => {
                black_body(wavelength_nm, PLANCK_J_S * LIGHT_M_PER_S / (BOLTZMANN_J_PER_K * kelvin))
            }
            Self::Temperature(kelvin) => of_daylight(daylight_xy(kelvin)),
        }
    }
}

/// λ⁻⁵ / (exp(c₂ / λ T) − 1), 1 at 560 nm; `length_m` is c₂ / T.
fn black_body(wavelength_nm: f64, length_m: f64) -> f64 {
    let [here, there] = [wavelength_nm, 560.0].map(|nm| nm * M_PER_NM);
    (there / here).powi(5) * (length_m / there).exp_m1() / (length_m / here).exp_m1()
}

/// The chromaticity of CIE daylight of a correlated color temperature from 4000 to 25 000 K [CIE 015, Eqs. 4.8–4.10].
fn daylight_xy(kelvin: f64) -> [f64; 2] {
    let t = 1e3 / kelvin;
    let x = if kelvin <= 7000.0 {
        ((-4.6070 * t + 2.9678) * t + 0.09911) * t + 0.244_063
    } else {
        ((-2.0064 * t + 1.9018) * t + 0.24748) * t + 0.237_040
    };
    [x, daylight(x)]
}

/// M₁ and M₂ of a daylight, rounded to three digits as the CIE has them [CIE 015, Eqs. 4.12–4.13].
fn daylight_shares([x, y]: [f64; 2]) -> [f64; 2] {
    let divisor = 0.0241 + 0.2562 * x - 0.7341 * y;
    let rounded = |value: f64| (value * 1e3).round() / 1e3;
    [-1.3515 - 1.7703 * x + 5.9114 * y, 0.0300 - 31.4424 * x + 30.0717 * y].map(|share| rounded(share / divisor))
}

impl FromStr for Illuminant {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = Self::NAMED.iter().find(|(name, _)| name.eq_ignore_ascii_case(text)).map(|(_, light)| *light);
        let kelvin = || text.trim_end_matches(['k', 'K']).trim().parse().ok();
        match named {
            Some(light) => Ok(light),
            None => match kelvin() {
                Some(kelvin) => Self::of_temperature(kelvin),
                None => Err("give a, d50, d55, d65, d75, e, or a temperature such as 3200K".into()),
            },
        }
    }
}

impl fmt::Display for Illuminant {
    /// As options have it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Temperature(kelvin) => write!(f, "{kelvin}K"),
            named => f.write_str(Self::NAMED.iter().find(|(_, light)| light == named).map_or("", |(name, _)| name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::chromaticity;
    use crate::formats::data::{load_daylight, load_observer};

    /// Chromaticities that the spectra sum to, against those published [CIE 015, Table T.3], to five digits; M₁ and M₂ of three
    /// digits leave the same as the published ones, and the published sums go to 780 nm by 5 nm.
    #[test]
    fn spectra_have_the_colors_that_are_published() {
        let (observer, daylight) = (load_observer().unwrap(), load_daylight().unwrap());
        for light in [Illuminant::A, Illuminant::D50, Illuminant::D55, Illuminant::D65, Illuminant::D75, Illuminant::E]
        {
            let mut xyz = [0.0; 3];
            for nm in (360..=830).map(f64::from) {
                let power = light.power(nm, |nm| daylight.each_ref().map(|curve| curve.at(nm)));
                for (sum, matching) in xyz.iter_mut().zip(&observer.matching) {
                    *sum += power * matching.at(nm);
                }
            }
            let (found, published) = (chromaticity(xyz), light.white_xy(&observer));
            assert!((0..2).all(|i| (found[i] - published[i]).abs() < 1e-4), "{light}: {found:?}, not {published:?}");
        }
    }

    /// Published beside each other: D65 is 6504 K, so that its chromaticity by formula is that of the illuminant.
    #[test]
    fn lights_are_known_by_name_and_temperature() {
        let observer = load_observer().unwrap();
        let xy = |text: &str| text.parse::<Illuminant>().unwrap().white_xy(&observer);
        for (kelvin, name) in [("5003", "d50"), ("6504K", "D65"), ("7504 K", "d75"), ("2856k", "A")] {
            let (found, named) = (xy(kelvin), xy(name));
            assert!((0..2).all(|i| (found[i] - named[i]).abs() < 2e-4), "{name}: {found:?}, not {named:?}");
        }
        for wrong in ["", "f2", "500K", "30000K", "nan", "-5000"] {
            assert!(wrong.parse::<Illuminant>().is_err(), "{wrong}");
        }
        for (name, light) in Illuminant::NAMED {
            assert_eq!((light.to_string().as_str(), name.parse()), (name, Ok(light)));
        }
        assert_eq!(Illuminant::Temperature(3200.0).to_string().parse(), Ok(Illuminant::Temperature(3200.0)));
    }
}
