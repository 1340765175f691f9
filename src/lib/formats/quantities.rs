//! What headings say of curves that are no radiances: lights, efficiencies, transmittances.

use crate::units::{NM_EV, OtherUnit, Stated, is_per_cent};

/// What is wrong with a light whose column says so; nothing where that is power per interval of wavelength, on any scale.
pub(super) fn of_light(column: &str, stated: &Stated) -> Option<String> {
    let Stated::Other { text, kind } = stated else { return None };
    let is_power = match kind {
        OtherUnit::Irradiance => !text.contains("eV"),
        // Of the largest, say.
        OtherUnit::Ratio => is_per_cent(&format!("{column} {text}")),
        OtherUnit::Mean
        | OtherUnit::Energy
        | OtherUnit::Intensity
        | OtherUnit::Power
        | OtherUnit::OtherAngle
        | OtherUnit::Megawatt
        | OtherUnit::Scaled
        | OtherUnit::BesideFactor
        | OtherUnit::Several
        | OtherUnit::Undivided
        | OtherUnit::Contradiction
        | OtherUnit::Relative
        | OtherUnit::Unknown => true,
        OtherUnit::Photons
        | OtherUnit::PerFrequency
        | OtherUnit::PerCentimeter
        | OtherUnit::AllWavelengths
        | OtherUnit::Photometric
        | OtherUnit::Reading
        | OtherUnit::Function
        | OtherUnit::PerIrradiance
        | OtherUnit::Temperature
        | OtherUnit::Emissivity
        | OtherUnit::Magnitude
        | OtherUnit::Depth
        | OtherUnit::Responsivity
        | OtherUnit::PerReading => false,
    };
    let what = match kind {
        OtherUnit::Irradiance => OtherUnit::PerFrequency.in_words(),
        // Words for radiances say what these are not.
        OtherUnit::PerIrradiance | OtherUnit::Temperature | OtherUnit::Emissivity | OtherUnit::Ratio => {
            "not the power of a light"
        }
        OtherUnit::Magnitude | OtherUnit::Depth | OtherUnit::Function => {
            "a logarithm or a root, not the power of a light"
        }
        kind => kind.in_words(),
    };
    let conversion = match kind {
        OtherUnit::Photons | OtherUnit::Function => kind.conversion(),
        _ => None,
    };
    let conversion = conversion.map_or_else(String::new, |conversion| format!(": {conversion}"));
    let wanted = "of a light its power per nm is wanted, on any scale";
    (!is_power).then(|| format!("its values are in `{text}`, {what}; {wanted}{conversion}"))
}

/// A share of light that a sensor file names a table of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Share {
    /// Electrons per photon.
    QuantumEfficiency,
    /// Of what is in front of the sensor.
    Transmittance,
}

impl Share {
    fn in_words(self) -> &'static str {
        match self {
            Self::QuantumEfficiency => "a quantum efficiency",
            Self::Transmittance => "a transmittance",
        }
    }

    /// What is wrong with a column of it that says that it is something else, or in per cent.
    pub(super) fn problem(self, column: &str, stated: &Stated) -> Option<String> {
        const OTHER_RATIOS: [&str; 5] = ["reflect", "albedo", "absorptance", "absorptivity", "emissivity"];
        let Stated::Other { text, kind } = stated else { return None };
        let both = format!("{column} {text}").to_lowercase();
        let wanted = self.in_words();
        let is_percent = both.contains('%') || both.contains("percent") || both.contains("pct");
        let what = match kind {
            OtherUnit::Responsivity if self == Self::QuantumEfficiency => format!(
                "a responsivity S; the quantum efficiency is S h c / (e wavelength), {NM_EV:.3} S / wavelength of S in A/W and nm"
            ),
            OtherUnit::Responsivity => format!("a responsivity; {wanted} is wanted"),
            OtherUnit::Depth => {
                format!("a logarithm; {wanted} is wanted: 10^-value of a density or absorbance, e^-value of a depth")
            }
            OtherUnit::Function => format!("a logarithm or a root; {wanted} is wanted, in fractions of 1"),
            OtherUnit::Emissivity => format!("another share of light; {wanted} is wanted"),
            OtherUnit::Ratio if OTHER_RATIOS.iter().any(|word| both.contains(word)) => {
                format!("another share of light; {wanted} is wanted: what is neither reflected nor absorbed")
            }
            OtherUnit::Ratio if is_percent => {
                "in per cent; fractions of 1 are wanted: divide its values by 100, or take the `%` away where they are fractions".into()
            }
            _ => return None,
        };
        Some(format!("its `{column}` is {what}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::csv::SpectralTable;

    fn light(text: &str) -> String {
        let table = SpectralTable::parse("t", text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"));
        table.light().map_or_else(|error| error.to_string(), |_| "read".into())
    }

    #[test]
    fn lights_are_power_per_wavelength() {
        for (heading, wanted) in [
            ("photon flux (umol m-2 s-1 nm-1)", "a unit of photons"),
            ("relative photon flux", "a unit of photons"),
            ("log10 power", "a logarithm or a root, not the power of a light"),
            ("reflectance", "`reflectance`, not the power of a light"),
            ("reflectance (%)", "not the power of a light"),
            ("E (mW/(m2 cm-1))", "per interval of frequency or wavenumber"),
            ("E (W m-2 eV-1)", "per interval of frequency or wavenumber"),
            ("L (cd/m2/nm)", "of light as the eye weights it"),
            ("sky (counts)", "what an instrument reads"),
        ] {
            let found = light(&format!("nm,{heading}\n400,1\n500,2\n"));
            let is_told =
                found.contains(wanted) && found.contains("of a light its power per nm is wanted, on any scale");
            assert!(is_told, "{heading}: {found}");
        }
        assert!(light("# photon flux\nnm,x\n400,1\n500,2\n").contains("a unit of photons"));
        for heading in [
            "power",
            "relative power",
            "E (W m-2 nm-1)",
            "L (W m-2 sr-1 nm-1)",
            "L (mW cm-2 sr-1 um-1)",
            "L (a.u.)",
            "power (%)",
            "radiant intensity (W sr-1 nm-1)",
            "flux (W/nm)",
            "D65",
            "MW",
        ] {
            assert_eq!(light(&format!("nm,{heading}\n400,1\n500,2\n")), "read", "{heading}");
        }
    }

    #[test]
    fn a_light_is_one_column() {
        let found = light("nm,a,D65\n400,1,2\n500,2,3\n");
        assert!(found.contains("it holds 2 spectra, a, D65, and a light is one; leave one"), "{found}");
        assert_eq!(light("nm,a,uncertainty\n400,1,2\n500,2,3\n"), "read");
    }

    #[test]
    fn shares_of_light_are_told_from_what_is_none() {
        let problem = |share: Share, heading: &str| {
            let table = SpectralTable::parse("t", format!("nm,{heading}\n400,0.1\n500,0.2\n").as_bytes()).unwrap();
            table.stated(0).and_then(|stated| share.problem(&table.columns[0], stated))
        };
        for (heading, wanted) in [
            ("R (A/W)", "a responsivity S; the quantum efficiency is S h c / (e wavelength), 1239.842 S / wavelength"),
            ("responsivity", "a responsivity S"),
            ("R (%)", "in per cent; fractions of 1 are wanted"),
            ("absorptance", "another share of light"),
        ] {
            let found = problem(Share::QuantumEfficiency, heading).unwrap_or_default();
            assert!(found.starts_with(&format!("its `{heading}` is {wanted}")), "{heading}: {found}");
        }
        for (heading, wanted) in [
            ("optical density", "a logarithm; a transmittance is wanted"),
            ("T (%)", "in per cent"),
            ("transmittance (%)", "in per cent"),
            ("absorptance", "another share of light"),
            ("reflectance", "another share of light"),
            ("T [A/W]", "a responsivity; a transmittance is wanted"),
        ] {
            let found = problem(Share::Transmittance, heading).unwrap_or_default();
            assert!(found.starts_with(&format!("its `{heading}` is {wanted}")), "{heading}: {found}");
        }
        for heading in ["T", "transmittance", "transmission", "tau_i_1mm", "R", "R (e-/photon)", "QE"] {
            assert_eq!(problem(Share::Transmittance, heading), None, "{heading}");
            assert_eq!(problem(Share::QuantumEfficiency, heading), None, "{heading}");
        }
    }
}
