//! What comments of tables of spectra say about units.

use super::delimited::{self, MAX_COMMENTS};
use super::described;
use crate::units::{OtherUnit, Stated, WavelengthUnit, unit_of_heading, units_in};

/// What comments say about units.
#[derive(Debug, Default)]
pub(super) struct Comments {
    pub(super) units: Vec<Stated>,
    pub(super) other_quantity: Option<Stated>,
    pub(super) wavelength: Option<WavelengthUnit>,
}

impl Comments {
    /// Those of a table; what comments say of one column is none of it where they have `described_each` so.
    pub(super) fn of(text: &str, described_each: bool) -> Self {
        let mut found = Self::default();
        let (mut alone, mut described) = (None, 0);
        let mut speaks_of_radiance = false;
        for line in delimited::comments(text).take(MAX_COMMENTS) {
            found.wavelength = found.wavelength.or_else(|| wavelength(line));
            if described_each && described::column(line).is_some() {
                continue;
            }
            let other = other_quantity(line);
            // A radiance beside a factor is none.
            let is_scaled = matches!(&other, Some(Stated::Other { kind: OtherUnit::BesideFactor, .. }));
            found.units.extend(units_in(line).into_iter().filter(|_| !is_scaled));
            found.other_quantity = found.other_quantity.or(other);
            described += usize::from(is_other_column(line));
            match quantity_alone(line).filter(|_| alone.is_none()) {
                Some(quantity) => alone = Some(quantity),
                None => speaks_of_radiance |= words(line).iter().any(|word| word.starts_with("radiance")),
            }
        }
        // What describes one column of several is not the quantity of all.
        found.other_quantity = found.other_quantity.or(alone.filter(|_| described < 2 && !speaks_of_radiance));
        found
    }
}

/// The unit that a comment says wavelengths have; none that it speaks of in passing: `wavelength accuracy 0.5 cm-1`.
fn wavelength(comment: &str) -> Option<WavelengthUnit> {
    const COUNTED: [&str; 3] = ["wavelength", "wavenumber", "photon energ"];
    let counts =
        |clause: &&str| COUNTED.iter().any(|word| clause.to_lowercase().contains(word)) && !is_in_passing(clause);
    let mut clauses = comment.split([',', ';']).filter(counts);
    clauses.find_map(|clause| WavelengthUnit::of_heading(clause.trim()).ok().flatten())
}

/// Whether a clause about wavelengths is about how well they are known, how far apart, or what they were.
fn is_in_passing(clause: &str) -> bool {
    /// What such words begin with.
    const ABOUT: [&str; 20] = [
        "uncertain",
        "accura",
        "precis",
        "resol",
        "error",
        "repeatab",
        "reproduc",
        "stab",
        "drift",
        "shift",
        "offset",
        "calibrat",
        "fwhm",
        "bandwidth",
        "width",
        "step",
        "spacing",
        "interval",
        "sampling",
        "correct",
    ];
    let words = words(clause);
    let has = |wanted: &[&str]| words.iter().any(|word| wanted.contains(&word.as_str()));
    let was_another = has(&["from"]) && has(&["converted", "computed", "calculated", "derived", "transformed"]);
    was_another && !has(&["to", "into"]) || words.iter().any(|word| ABOUT.iter().any(|begin| word.starts_with(begin)))
}

/// The quantity that a comment such as `Unit: %` or `units of values = counts` states, where it is no spectral radiance.
fn other_quantity(comment: &str) -> Option<Stated> {
    let (before, stated) = comment.split_once([':', '='])?;
    let mut words = before.split(|c: char| !c.is_alphanumeric());
    let states = words.any(|word| ["unit", "units"].contains(&word.to_lowercase().as_str()));
    let is_no_radiance = |stated: &Stated| {
        is_other(stated) || matches!(stated, Stated::Other { kind: OtherUnit::Relative | OtherUnit::BesideFactor, .. })
    };
    states
        .then(|| unit_of_heading(stated).or_else(|| unit_of_heading(&format!("({})", stated.trim()))))?
        .filter(is_no_radiance)
}

/// Whether something is known to be no radiance.
fn is_other(stated: &Stated) -> bool {
    matches!(stated, Stated::Other { kind, .. } if kind.conversion().is_some())
}

/// The first words of quantities, and those that stand with them.
const QUANTITIES: [&str; 22] = [
    "irradiance",
    "irradiances",
    "exitance",
    "radiance",
    "radiances",
    "photon",
    "photons",
    "reflectance",
    "reflectances",
    "transmittance",
    "albedo",
    "emissivity",
    "actinic",
    "flux",
    "intensity",
    "brightness",
    "temperature",
    "optical",
    "depth",
    "density",
    "rrs",
    "counts",
];
/// What else stands beside them.
const FILLERS: [&str; 31] = [
    "spectral",
    "spectrum",
    "radiant",
    "in",
    "of",
    "the",
    "are",
    "is",
    "all",
    "data",
    "value",
    "values",
    "unit",
    "units",
    "column",
    "columns",
    "col",
    "wavelength",
    "wavelengths",
    "nm",
    "um",
    "and",
    "global",
    "direct",
    "diffuse",
    "horizontal",
    "normal",
    "total",
    "downwelling",
    "upwelling",
    "measured",
];

/// The quantity that a comment names, with its unit or without, and nothing besides: `spectral irradiance, mW m-2 nm-1`, `Column 2:
/// Reflectance`; none that is a radiance, or that has a value there.
fn quantity_alone(comment: &str) -> Option<Stated> {
    let stated = unit_of_heading(comment).filter(is_other)?;
    let described = described::column(comment).filter(|_| is_other_column(comment));
    let mut left = described.map_or(comment, |(_, said)| said).to_owned();
    for unit in units_in(comment) {
        if let Stated::Other { text, .. } = unit {
            // `of an irradiance of 3 W m-2`
            if text.starts_with(|c: char| c.is_ascii_digit()) {
                return None;
            }
            left = left.replacen(&text, " ", 1);
        }
    }
    let left = words(&left);
    let is_one = |word: &String| QUANTITIES.contains(&word.as_str());
    let is_alone = left.iter().all(|word| is_one(word) || FILLERS.contains(&word.as_str())) && left.iter().any(is_one);
    is_alone.then_some(stated)
}

/// Whether a comment describes a column behind that of wavelengths: `Column 2: radiance`.
fn is_other_column(comment: &str) -> bool {
    described::column(comment).is_some_and(|(number, _)| number > 1)
}

/// The words of a comment, in small letters.
fn words(comment: &str) -> Vec<String> {
    let words = comment.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_wavelengths_in_passing_is_no_unit_of_theirs() {
        let unit = |comment: &str| Comments::of(&format!("# {comment}\nwavelength,L\n400,1\n"), false).wavelength;
        for comment in [
            "wavelength uncertainty 0.002 um",
            "wavelength accuracy 0.5 cm-1",
            "wavelength resolution 20 cm-1",
            "wavelengths converted from um",
            "wavelength calibrated with Hg lamp (A)",
            "wavelength step 0.001 um",
        ] {
            assert_eq!(unit(comment), None, "{comment}");
        }
        for comment in [
            "wavelength in um",
            "wavelengths converted from nm to um",
            "wavelength accuracy 0.5 nm, wavelengths in um",
            "wavelength unit: um",
        ] {
            assert_eq!(unit(comment), Some(WavelengthUnit::Micrometer), "{comment}");
        }
    }

    #[test]
    fn comments_that_name_a_quantity_and_nothing_else_count() {
        let other = |text: &str| Comments::of(text, false).other_quantity;
        for text in [
            "# irradiance in mW/(m2 nm)\nnm,value\n400,1\n",
            "# spectral irradiance, mW m-2 nm-1\n400,1\n",
            "# spectral irradiance\nnm,value\n400,1\n",
            "# radiance in photons/s/m2/sr/nm\nnm,value\n400,1\n",
            "# photon radiance\nnm,L\n400,1\n",
            "# Column 2: Reflectance\n400,1\n",
            "# wavelength in nm, irradiance in W m-2 nm-1\na,b\n400,1\n",
            "# by me\n# reflectance\nnm,L\n400,1\n",
        ] {
            assert!(other(text).is_some(), "{text}");
        }
        for text in [
            "# of an irradiance of 3 W m-2\nnm,L\n400,1\n",
            "# solar spectrum: kurudz, W m-2 nm-1\nnm,L\n400,1\n",
            "# computed from an irradiance in W m-2 nm-1\nnm,L\n400,1\n",
            "# albedo 0.2\nnm,L\n400,1\n",
            "# Column 2: radiance\n# Column 3: irradiance\nnm,L,E\n400,1,1\n",
            "# Column 2: L\n# Column 3: irradiance\nnm,L,E\n400,1,1\n",
            "# irradiance\n# radiance of a white\nnm,L\n400,1\n",
            "# sky at noon\nnm,L\n400,1\n",
        ] {
            assert_eq!(other(text), None, "{text}");
        }
    }
}
