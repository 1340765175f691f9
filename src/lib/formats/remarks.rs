//! What comments of tables of spectra say about units.

use super::delimited;
use crate::units::{OtherUnit, Stated, WavelengthUnit, unit_of_heading, units_in};

/// What comments say about units.
#[derive(Debug, Default)]
pub(super) struct Comments {
    pub(super) units: Vec<Stated>,
    pub(super) other_quantity: Option<Stated>,
    pub(super) wavelength: Option<WavelengthUnit>,
}

impl Comments {
    /// Those of a table.
    pub(super) fn of(text: &str) -> Self {
        let mut found = Self::default();
        let (mut alone, mut described) = (None, 0);
        let mut speaks_of_radiance = false;
        for line in delimited::comments(text).take(MAX_COMMENTS) {
            let other = other_quantity(line);
            // A radiance beside a factor is none.
            let is_scaled = matches!(&other, Some(Stated::Other { kind: OtherUnit::BesideFactor, .. }));
            found.units.extend(units_in(line).into_iter().filter(|_| !is_scaled));
            found.other_quantity = found.other_quantity.or(other);
            described += usize::from(column_described(line).is_some());
            match quantity_alone(line).filter(|_| alone.is_none()) {
                Some(quantity) => alone = Some(quantity),
                None => speaks_of_radiance |= words(line).iter().any(|word| word.starts_with("radiance")),
            }
            let counts = |clause: &&str| {
                ["wavelength", "wavenumber", "photon energ"].iter().any(|word| clause.to_lowercase().contains(word))
            };
            let mut clauses = line.split([',', ';']).filter(counts);
            let unit = clauses.find_map(|clause| WavelengthUnit::of_heading(clause.trim()).ok().flatten());
            found.wavelength = found.wavelength.or(unit);
        }
        // What describes one column of several is not the quantity of all.
        found.other_quantity = found.other_quantity.or(alone.filter(|_| described < 2 && !speaks_of_radiance));
        found
    }
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
    let mut left = match column_described(comment) {
        Some(column) => comment.replacen(&column, "", 1),
        None => comment.to_owned(),
    };
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

/// The number of the column, behind that of wavelengths, that a comment begins with: `Column 2: radiance`.
fn column_described(comment: &str) -> Option<String> {
    let words = words(comment);
    let [first, number, ..] = words.as_slice() else { return None };
    let is_other = number.parse::<usize>().is_ok_and(|number| number > 1);
    (["column", "col"].contains(&first.as_str()) && is_other).then(|| number.clone())
}

/// The words of a comment, in small letters.
fn words(comment: &str) -> Vec<String> {
    let words = comment.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

/// So many comments are searched for units.
pub(super) const MAX_COMMENTS: usize = 1000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_that_name_a_quantity_and_nothing_else_count() {
        let other = |text: &str| Comments::of(text).other_quantity;
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
