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
        for line in delimited::comments(text).take(MAX_COMMENTS) {
            let other = other_quantity(line);
            // A radiance beside a factor is none.
            let is_scaled = matches!(&other, Some(Stated::Other { kind: OtherUnit::BesideFactor, .. }));
            found.units.extend(units_in(line).into_iter().filter(|_| !is_scaled));
            found.other_quantity = found.other_quantity.or(other);
            let counts = |clause: &&str| {
                ["wavelength", "wavenumber", "photon energ"].iter().any(|word| clause.to_lowercase().contains(word))
            };
            let mut clauses = line.split([',', ';']).filter(counts);
            let unit = clauses.find_map(|clause| WavelengthUnit::of_heading(clause.trim()).ok().flatten());
            found.wavelength = found.wavelength.or(unit);
        }
        found
    }
}

/// The quantity that a comment such as `Unit: %` or `units of values = counts` states, where it is no spectral radiance.
fn other_quantity(comment: &str) -> Option<Stated> {
    let (before, stated) = comment.split_once([':', '='])?;
    let mut words = before.split(|c: char| !c.is_alphanumeric());
    let states = words.any(|word| ["unit", "units"].contains(&word.to_lowercase().as_str()));
    let is_no_radiance =
        |kind: OtherUnit| kind.conversion().is_some() || matches!(kind, OtherUnit::Relative | OtherUnit::BesideFactor);
    let is_other = |stated: &Stated| matches!(stated, Stated::Other { kind, .. } if is_no_radiance(*kind));
    states
        .then(|| unit_of_heading(stated).or_else(|| unit_of_heading(&format!("({})", stated.trim()))))?
        .filter(is_other)
}

/// So many comments are searched for units.
pub(super) const MAX_COMMENTS: usize = 1000;
