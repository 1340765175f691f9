//! Units of wavelength.

use super::spelling::{Base, Length, Token, base, tokens};
use super::{NM_EV, NM_PER_CM};
use std::fmt;

/// The unit in which a file gives wavelengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WavelengthUnit {
    /// nm, ours.
    Nanometer,
    /// µm.
    Micrometer,
    /// 0.1 nm.
    Angstrom,
    /// m.
    Meter,
    /// cm⁻¹: wavenumbers instead, of which wavelengths in vacuum follow.
    PerCentimeter,
    /// eV: energies of photons instead, of which wavelengths in vacuum follow.
    ElectronVolt,
}

impl WavelengthUnit {
    pub(super) fn symbol(self) -> &'static str {
        match self {
            Self::Nanometer => Length::Nanometer.symbol(),
            Self::Micrometer => Length::Micrometer.symbol(),
            Self::Angstrom => Length::Angstrom.symbol(),
            Self::Meter => Length::Meter.symbol(),
            Self::PerCentimeter => "cm-1",
            Self::ElectronVolt => "eV",
        }
    }

    /// What an interval of one such unit at a wavelength in nm is in nm: of wavenumbers |dλ/dν| = λ²/10⁷, of energies
    /// |dλ/dE| = λ²/(h c).
    pub(super) fn in_nm(self, wavelength_nm: f64) -> f64 {
        match self {
            Self::Nanometer => 1.0,
            Self::Micrometer => 1e3,
            Self::Angstrom => 0.1,
            Self::Meter => 1e9,
            Self::PerCentimeter => wavelength_nm * wavelength_nm / NM_PER_CM,
            Self::ElectronVolt => wavelength_nm * wavelength_nm / NM_EV,
        }
    }

    /// A wavelength in nm, to the millionth of one: decimal fractions of µm become whole numbers again.
    pub fn nm(self, value: f64) -> f64 {
        /// Parts of a nanometer that are told apart.
        const PARTS: f64 = 1e6;
        match self {
            Self::Nanometer => value,
            Self::PerCentimeter => NM_PER_CM / value,
            Self::ElectronVolt => NM_EV / value,
            _ => (value * self.in_nm(1.0) * PARTS).round() / PARTS,
        }
    }

    /// Whether it counts what is inverse to wavelength, proportional to the energy of photons.
    pub fn is_of_energy(self) -> bool {
        matches!(self, Self::PerCentimeter | Self::ElectronVolt)
    }

    /// The unit that the heading of a column of wavelengths ends with: `wavelength (nm)`, `lambda_um`, `nu (cm-1)`; none where
    /// it names none.
    ///
    /// # Errors
    ///
    /// What it counts instead of wavelengths, in words.
    pub fn of_heading(heading: &str) -> Result<Option<Self>, &'static str> {
        let tokens = tokens(heading);
        let words = || tokens.iter().filter_map(Token::lower);
        let is_per_cm = |token: &Token| {
            let length = |word: &str| base(word) == Some(Base::Length(Length::Centimeter));
            matches!(token, Token::Factor { word, exponent: Some(-1) } if length(word))
        };
        if heading.contains("1/cm") || tokens.last().is_some_and(is_per_cm) {
            return Ok(Some(Self::PerCentimeter));
        }
        if words().any(|word| word.starts_with("wavenumber")) {
            return Err("wavenumbers without the unit cm-1");
        }
        if words().any(|word| matches!(word.as_str(), "hz" | "thz")) {
            return Err("frequencies");
        }
        // `12 pm` is a time.
        let is_length = |word: String| ["wavelength", "lambda", "wl"].iter().any(|begin| word.starts_with(begin));
        if tokens.last().and_then(Token::lower).as_deref() == Some("pm") && words().any(is_length) {
            return Err("wavelengths in picometers");
        }
        if words().any(|word| matches!(word.as_str(), "freq" | "frequency")) {
            return Err("frequencies (if they are wavenumbers, as MODTRAN calls them, write `FREQ (cm-1)`)");
        }
        if words().any(|word| matches!(word.as_str(), "mev" | "kev")) {
            return Err("energies of photons in another unit than eV");
        }
        if matches!(tokens.last(), Some(Token::Factor { word, exponent: None }) if base(word) == Some(Base::ElectronVolt))
        {
            return Ok(Some(Self::ElectronVolt));
        }
        if words().any(|word| matches!(word.as_str(), "ev" | "energy" | "energies")) {
            return Err("energies of photons without the unit eV (write it as in `energy_eV`)");
        }
        Ok(match tokens.last() {
            Some(Token::Factor { exponent: Some(-1), .. }) => return Err("wavenumbers without the unit cm-1"),
            // A single letter alone is a name.
            Some(Token::Factor { word, exponent: None }) if word.len() > 1 || tokens.len() > 1 => match base(word) {
                Some(Base::Length(Length::Nanometer)) => Some(Self::Nanometer),
                Some(Base::Length(Length::Micrometer)) => Some(Self::Micrometer),
                Some(Base::Length(Length::Angstrom)) => Some(Self::Angstrom),
                Some(Base::Length(Length::Meter)) => Some(Self::Meter),
                Some(Base::Length(Length::Millimeter | Length::Centimeter)) => {
                    return Err("centimeters or millimeters");
                }
                _ => None,
            },
            _ => None,
        })
    }
}

impl fmt::Display for WavelengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wavelengths_are_read_as_people_write_them() {
        for (heading, unit) in [
            ("wavelength_nm", Some(WavelengthUnit::Nanometer)),
            ("Wavelength (nm)", Some(WavelengthUnit::Nanometer)),
            ("nm", Some(WavelengthUnit::Nanometer)),
            ("lambda [µm]", Some(WavelengthUnit::Micrometer)),
            ("wl_um", Some(WavelengthUnit::Micrometer)),
            ("wavelength in micrometers", Some(WavelengthUnit::Micrometer)),
            ("wavelength (A)", Some(WavelengthUnit::Angstrom)),
            ("Å", Some(WavelengthUnit::Angstrom)),
            ("Wavelength, Angstrom", Some(WavelengthUnit::Angstrom)),
            ("wavelength (m)", Some(WavelengthUnit::Meter)),
            ("nu (cm-1)", Some(WavelengthUnit::PerCentimeter)),
            ("k [cm^-1]", Some(WavelengthUnit::PerCentimeter)),
            ("wavenumber_cm-1", Some(WavelengthUnit::PerCentimeter)),
            ("1/cm", Some(WavelengthUnit::PerCentimeter)),
            ("energy_eV", Some(WavelengthUnit::ElectronVolt)),
            ("Photon energy [eV]", Some(WavelengthUnit::ElectronVolt)),
            ("E/eV", Some(WavelengthUnit::ElectronVolt)),
            ("eV", Some(WavelengthUnit::ElectronVolt)),
            ("wavelength", None),
            ("12 pm", None),
            ("A", None),
            ("id", None),
        ] {
            assert_eq!(WavelengthUnit::of_heading(heading), Ok(unit), "{heading}");
        }
        for heading in [
            "wavenumber",
            "wavenumber (um-1)",
            "frequency (THz)",
            "FREQ",
            "energy",
            "E (keV)",
            "wavelength (cm)",
            "lambda_mm",
            "wavelength (pm)",
        ] {
            assert!(WavelengthUnit::of_heading(heading).is_err(), "{heading}");
        }
        assert_eq!(WavelengthUnit::Micrometer.nm(0.57), 570.0);
        assert_eq!(WavelengthUnit::Angstrom.nm(5550.0), 555.0);
        // h c = 1.239 841 984… eV µm, CODATA 2018.
        assert!((WavelengthUnit::ElectronVolt.nm(2.0) - 619.920_992).abs() < 1e-6);
        // The sodium D2 line in vacuum, NIST ASD: 589.158 nm, 16 973.37 cm⁻¹.
        assert!((WavelengthUnit::PerCentimeter.nm(16_973.37) - 589.158).abs() < 5e-4);
    }
}
