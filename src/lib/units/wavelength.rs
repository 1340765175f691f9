//! Units of wavelength.

use super::spelling::{Base, Length, Token, base, tokens};

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
}

impl WavelengthUnit {
    pub(super) fn symbol(self) -> &'static str {
        match self {
            Self::Nanometer => Length::Nanometer.symbol(),
            Self::Micrometer => Length::Micrometer.symbol(),
            Self::Angstrom => Length::Angstrom.symbol(),
            Self::Meter => Length::Meter.symbol(),
        }
    }

    /// What one such unit is in nm.
    pub(super) fn in_nm(self) -> f64 {
        match self {
            Self::Nanometer => 1.0,
            Self::Micrometer => 1e3,
            Self::Angstrom => 0.1,
            Self::Meter => 1e9,
        }
    }

    /// A wavelength in nm, to the millionth of one: decimal fractions of µm become whole numbers again.
    pub fn nm(self, value: f64) -> f64 {
        /// Parts of a nanometer that are told apart.
        const PARTS: f64 = 1e6;
        if self == Self::Nanometer { value } else { (value * self.in_nm() * PARTS).round() / PARTS }
    }

    /// The unit that the heading of a column of wavelengths ends with: `wavelength (nm)`, `lambda_um`; none where it names
    /// none.
    ///
    /// # Errors
    ///
    /// What it counts instead of wavelengths, in words.
    pub fn of_heading(heading: &str) -> Result<Option<Self>, &'static str> {
        let tokens = tokens(heading);
        let words = || tokens.iter().filter_map(Token::lower);
        if words().any(|word| word.starts_with("wavenumber")) || heading.contains("1/cm") {
            return Err("wavenumbers");
        }
        if words().any(|word| matches!(word.as_str(), "hz" | "thz" | "frequency")) {
            return Err("frequencies");
        }
        if words().any(|word| matches!(word.as_str(), "ev" | "energy")) {
            return Err("energies of photons");
        }
        Ok(match tokens.last() {
            Some(Token::Factor { exponent: Some(-1), .. }) => return Err("wavenumbers"),
            // A single letter alone is a name.
            Some(Token::Factor { word, exponent: None }) if word.len() > 1 || tokens.len() > 1 => match base(word) {
                Some(Base::Length(Length::Nanometer)) => Some(Self::Nanometer),
                Some(Base::Length(Length::Micrometer)) => Some(Self::Micrometer),
                Some(Base::Length(Length::Angstrom)) => Some(Self::Angstrom),
                Some(Base::Length(Length::Meter)) => Some(Self::Meter),
                _ => None,
            },
            _ => None,
        })
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
            ("wavelength", None),
            ("A", None),
            ("id", None),
        ] {
            assert_eq!(WavelengthUnit::of_heading(heading), Ok(unit), "{heading}");
        }
        for heading in ["wavenumber", "nu (cm-1)", "k [cm^-1]", "1/cm", "frequency (THz)", "energy_eV"] {
            assert!(WavelengthUnit::of_heading(heading).is_err(), "{heading}");
        }
        assert_eq!(WavelengthUnit::Micrometer.nm(0.57), 570.0);
        assert_eq!(WavelengthUnit::Angstrom.nm(5550.0), 555.0);
    }
}
