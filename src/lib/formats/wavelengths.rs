//! Wavelengths in nm and in order, and whether they are what they are said to be: unlike, and those of light.

use super::misread::LONGEST_NM;
use crate::spectrum::{SHORTEST_NM, check_wavelengths};
use crate::units::WavelengthUnit;
use ndarray::{Array2, Axis};

/// Refuses wavelengths of which all but one are in order, and no other could be the one: a slip that sorting would hide.
fn check_order(wavelength_nm: &[f64]) -> std::result::Result<(), String> {
    /// Of fewer nobody can tell the order.
    const LEAST: usize = 4;
    let breaks = |is_before: fn(&f64, &f64) -> bool| {
        let in_order = |a: usize, b: usize| is_before(&wavelength_nm[a], &wavelength_nm[b]);
        let last = wavelength_nm.len() - 1;
        let broken: Vec<usize> = (0..last).filter(|place| !in_order(*place, place + 1)).collect();
        // The place left out, those on both sides must be in order, and nothing else may be broken.
        let mends = |place: usize| {
            let is_touched = |at: &usize| *at == place || at + 1 == place;
            broken.iter().all(is_touched) && (place == 0 || place == last || in_order(place - 1, place + 1))
        };
        let places = broken.first().map_or(0..0, |at| *at..at + 2);
        (broken.len(), places.filter(|place| mends(*place)).collect::<Vec<_>>())
    };
    let [up, down] = [breaks(|a, b| a < b), breaks(|a, b| a > b)];
    let (count, places) = if up.0 <= down.0 { up } else { down };
    match places.as_slice() {
        [place] if count > 0 && wavelength_nm.len() >= LEAST => {
            let own = wavelength_nm[*place];
            if wavelength_nm.iter().filter(|nm| **nm == own).count() > 1 {
                return Err(twice(own));
            }
            let nm = |place: usize| wavelength_nm.get(place).map(f64::to_string);
            let before = place.checked_sub(1).and_then(nm);
            let beside = match (before, nm(place + 1)) {
                (Some(before), Some(after)) => format!("between {before} and {after}"),
                (Some(before), None) => format!("behind {before}"),
                (None, after) => format!("before {}", after.unwrap_or_default()),
            };
            Err(format!(
                "the wavelength {} nm stands {beside} nm, and all others are in order: mend it, or put it in its place",
                own
            ))
        }
        _ => Ok(()),
    }
}

fn twice(nm: f64) -> String {
    format!("the wavelength {nm} nm stands there twice; leave out one")
}

/// Refuses a wavelength that stands twice among ascending ones.
fn check_unlike(wavelength_nm: &[f64]) -> std::result::Result<(), String> {
    match wavelength_nm.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(twice(pair[0])),
        None => Ok(()),
    }
}

/// Checks that ascending wavelengths are unlike, and look like nm.
///
/// # Errors
///
/// What is wrong, in words.
pub(super) fn check_nm(wavelength_nm: &[f64]) -> std::result::Result<(), String> {
    check_unlike(wavelength_nm)
        .and_then(|()| check_wavelengths(wavelength_nm))
        .and_then(|()| check_likely(wavelength_nm))
}

/// Below this they are no wavelengths of light in µm either.
const SHORTEST_UM: f64 = 0.1;

/// What people see, in nm.
const SEEN_NM: std::ops::RangeInclusive<f64> = 380.0..=780.0;

/// Checks that wavelengths look like nm.
fn check_likely(wavelength_nm: &[f64]) -> std::result::Result<(), String> {
    let [first, .., last] = wavelength_nm else { return Ok(()) };
    let range = format!("its wavelengths run from {first} to {last} nm");
    let name = "name their unit in the heading, such as";
    if *last < SHORTEST_UM {
        return Err(format!("{range}, which no light has; its first column must hold wavelengths"));
    }
    if *last < SHORTEST_NM {
        let are_seen = |unit: WavelengthUnit| {
            let [one, other] = [*first, *last].map(|value| unit.nm(value));
            one.min(other) <= *SEEN_NM.end() && one.max(other) >= *SEEN_NM.start()
        };
        let like = match [WavelengthUnit::Micrometer, WavelengthUnit::ElectronVolt].map(are_seen) {
            [false, true] => "energies of photons in eV; name their unit in the heading, such as `energy_eV`".into(),
            [true, true] => format!("micrometers, or energies of photons in eV; {name} `wavelength_um` or `energy_eV`"),
            _ => format!("micrometers; {name} `wavelength_um`"),
        };
        return Err(format!("{range}, which looks like {like}"));
    }
    if *first > LONGEST_NM {
        return Err(format!(
            "{range}, which looks like angstroms or wavenumbers; {name} `wavelength_angstrom` or `wavenumber_cm-1`"
        ));
    }
    Ok(())
}

/// Refuses wavelengths that no light has in the unit that is said of them, where all are those of light in another.
fn check_stated(wavelengths: &[f64], stated: WavelengthUnit) -> std::result::Result<(), String> {
    const HEADINGS: [(WavelengthUnit, &str); 6] = [
        (WavelengthUnit::Nanometer, "wavelength_nm"),
        (WavelengthUnit::Micrometer, "wavelength_um"),
        (WavelengthUnit::Angstrom, "wavelength_angstrom"),
        (WavelengthUnit::PerCentimeter, "wavenumber_cm-1"),
        (WavelengthUnit::Meter, "wavelength_m"),
        (WavelengthUnit::ElectronVolt, "energy_eV"),
    ];
    let are_seen = |unit: WavelengthUnit| {
        let is_seen = |value: &f64| (SHORTEST_NM..=LONGEST_NM).contains(&unit.nm(*value));
        (wavelengths.iter().any(is_seen), wavelengths.iter().all(is_seen))
    };
    let other = HEADINGS.iter().find(|(unit, _)| are_seen(*unit).1);
    match other.filter(|_| !are_seen(stated).0 && wavelengths.len() > 1) {
        Some((other, heading)) => {
            let [low, high] = wavelengths
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(*value), high.max(*value)]);
            let problem = format!("its wavelengths are said to be in {stated}, but {low} to {high} look like {other}");
            Err(format!("{problem}; mend what says so, as in the heading `{heading}`"))
        }
        None => Ok(()),
    }
}

/// Wavelengths of a unit, of nm where none is said, in nm and ascending, and the curves over them.
///
/// # Errors
///
/// What is wrong with them, in words.
pub(super) fn in_nm(
    mut wavelengths: Vec<f64>,
    values: Array2<f64>,
    unit: Option<WavelengthUnit>,
) -> std::result::Result<(Vec<f64>, Array2<f64>), String> {
    unit.map_or(Ok(()), |unit| check_stated(&wavelengths, unit))?;
    let unit = unit.unwrap_or(WavelengthUnit::Nanometer);
    wavelengths.iter_mut().for_each(|wavelength| *wavelength = unit.nm(*wavelength));
    check_order(&wavelengths)?;
    let (wavelength_nm, values) = sorted(wavelengths, values);
    check_nm(&wavelength_nm)?;
    Ok((wavelength_nm, values))
}

/// Wavelengths in ascending order, and the curves over them.
fn sorted(wavelength_nm: Vec<f64>, values: Array2<f64>) -> (Vec<f64>, Array2<f64>) {
    if wavelength_nm.is_sorted() {
        return (wavelength_nm, values);
    }
    let mut order: Vec<usize> = (0..wavelength_nm.len()).collect();
    order.sort_by(|a, b| wavelength_nm[*a].total_cmp(&wavelength_nm[*b]));
    (order.iter().map(|place| wavelength_nm[*place]).collect(), values.select(Axis(1), &order))
}
