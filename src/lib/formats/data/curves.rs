//! The curves of a sensor's response, read and checked.

use super::places::{Place, read_beside};
use crate::camera::response::{Scale, SpectralResponse};
use crate::camera::sensor::{Counts, CurveFile, ResponseFiles};
use crate::cfa::{Class, FilterArray};
use crate::error::{Error, Result};
use crate::formats::csv::SpectralTable;
use crate::formats::digest::sha256;
use crate::formats::quantities::Share;
use crate::formats::response_table::{ResponseTable, TOLD_AT_AN_END, ends_early};
use crate::names::Named;
use crate::spectrum::{Curve, WavelengthGrid};

/// The curves of a response as they are read and checked.
pub(super) struct Curves<'a> {
    pub(super) place: &'a Place,
    /// The sensor file in messages.
    pub(super) sensor: &'a str,
    pub(super) array: Option<FilterArray>,
    /// What came up.
    pub(super) doubts: Vec<String>,
    /// What a file of another program says of the camera.
    pub(super) about: Option<String>,
}

impl Curves<'_> {
    /// Reads those that files hold, and notes the digests of these; gives those of R, G and B, unless the classes are others.
    pub(super) fn load(&mut self, files: &mut ResponseFiles) -> Result<Option<SpectralResponse>> {
        let found = match (&mut files.quantum_efficiency, &mut files.relative_response) {
            (Some(curve), _) => self.absolute(curve)?.map(|classes| (classes, Scale::Absolute)),
            (None, Some(curve)) => {
                let (classes, of_energy) = self.relative(curve)?;
                if let Some(heading) = of_energy.as_ref().filter(|_| files.counts == Some(Counts::Quanta)) {
                    let problem = format!(
                        "the heading `{heading}` of its response says that it counts energy, and `counts` quanta; mend the one that is wrong"
                    );
                    return Err(Error::format(self.sensor, problem));
                }
                let said = files.counts.or(of_energy.map(|_| Counts::Energy));
                let counts = said.unwrap_or_else(|| {
                    self.doubts.push(format!(
                        "nobody says whether its response counts energy or quanta; it is taken as {} (--counts)",
                        Counts::default().name()
                    ));
                    Counts::default()
                });
                files.counts = Some(counts);
                classes.map(|classes| (classes, Scale::Relative { counts, peak: files.peak_quantum_efficiency }))
            }
            (None, None) => None,
        };
        let cover_glass = match &mut files.cover_glass {
            Some(glass) => {
                let (name, bytes) = self.bytes(glass)?;
                let table = SpectralTable::parse(&name, &bytes)?;
                Some(self.share(&table, glass.column.as_deref(), Share::Transmittance)?)
            }
            None => None,
        };
        let of_efficiencies = found.as_ref().filter(|(_, scale)| *scale == Scale::Absolute);
        self.doubts.extend(of_efficiencies.and_then(|(classes, _)| doubt_of_ends(classes, cover_glass.as_ref())));
        Ok(found.map(|(quantum_efficiency, scale)| SpectralResponse { quantum_efficiency, cover_glass, scale }))
    }

    /// The file of a curve, with its name.
    fn bytes(&self, curve: &mut CurveFile) -> Result<(String, Vec<u8>)> {
        let (name, bytes) = read_beside(self.place, self.sensor, &curve.file)?;
        curve.sha256 = Some(sha256(&bytes));
        Ok((name, bytes))
    }

    /// Quantum efficiencies.
    fn absolute(&mut self, curve: &mut CurveFile) -> Result<Option<[Curve; 3]>> {
        let (name, bytes) = self.bytes(curve)?;
        let efficiencies = SpectralTable::parse(&name, &bytes)?;
        let class = |column: Option<&str>| self.share(&efficiencies, column, Share::QuantumEfficiency);
        if self.array.is_none_or(FilterArray::has_three_classes) {
            let classes = [class(Some("R"))?, class(Some("G"))?, class(Some("B"))?];
            self.doubts.extend(exchanged(&classes));
            self.doubts.extend(curve.column.as_ref().map(|column| {
                format!("`column: {column}` of its quantum efficiency does not count: each class has a column of its own, R, G and B")
            }));
            return Ok(Some(classes));
        }
        let filters = self.array.map_or_else(Vec::new, FilterArray::filters);
        if filters.is_empty() {
            class(curve.column.as_deref())?;
        }
        for filter in filters {
            class(Some(&filter.to_string()))?;
        }
        Ok(None)
    }

    /// A column of a table of efficiencies or transmittances, which says nothing else of itself.
    fn share(&self, table: &SpectralTable, column: Option<&str>, share: Share) -> Result<Curve> {
        let index = table.column_index(column)?;
        if let Some(problem) = table.stated(index).and_then(|stated| share.problem(&table.columns[index], stated)) {
            return Err(Error::format(table.name(), problem));
        }
        let key = match share {
            Share::QuantumEfficiency => "quantum_efficiency",
            Share::Transmittance => "cover_glass",
        };
        within_unit(self.sensor, key, table.curve_at(index)?.without_rounding())
    }

    /// Relative responses, which are of R, G and B alone, and the heading that says that they count energy.
    fn relative(&mut self, curve: &mut CurveFile) -> Result<(Option<[Curve; 3]>, Option<String>)> {
        let (name, bytes) = self.bytes(curve)?;
        let table = ResponseTable::parse(&name, &bytes, curve.column.as_deref())?;
        self.doubts.extend(table.doubts);
        self.about = table.about;
        let has_three = self.array.is_none_or(FilterArray::has_three_classes);
        Ok((Some(table.classes).filter(|_| has_three), table.of_energy))
    }
}

/// A warning of efficiencies whose table ends before they have faded, inside the wavelengths that light is summed over: they are 0
/// beyond.
fn doubt_of_ends(classes: &[Curve; 3], cover_glass: Option<&Curve>) -> Option<String> {
    let grid = WavelengthGrid::default();
    let passed = |nm: f64| cover_glass.map_or(1.0, |glass| glass.at(nm));
    let cut = Class::ALL.into_iter().zip(classes).flat_map(|(class, curve)| {
        let all = curve.wavelengths_nm();
        let largest = all.iter().map(|nm| curve.at(*nm) * passed(*nm)).fold(0.0, f64::max);
        let ends = [all.first(), all.last()]
            .into_iter()
            .flatten()
            .filter(move |nm| **nm > grid.start_nm && **nm < grid.end_nm);
        let shares = ends.map(move |nm| (nm, curve.at(*nm) * passed(*nm) / largest));
        let told = shares.filter(|(_, share)| *share > TOLD_AT_AN_END);
        told.map(move |(nm, share)| format!("{} has {:.1} % at {nm} nm", class.letter(), 100.0 * share))
            .collect::<Vec<_>>()
    });
    let cut: Vec<String> = cut.collect();
    (!cut.is_empty()).then(|| ends_early("quantum efficiency", &cut.join(", ")))
}

/// A warning of efficiencies of R and B that stand in each other's place, as far as no infrared counts, which B may let through.
fn exchanged([red, _, blue]: &[Curve; 3]) -> Option<String> {
    const SEEN_NM: std::ops::RangeInclusive<u16> = 400..=680;
    /// Curves that are alike are no more apart.
    const APART_NM: f64 = 1.0;
    let mean = |curve: &Curve| {
        let [moment, sum] = SEEN_NM.map(f64::from).fold([0.0; 2], |[moment, sum], nm| {
            let value = curve.at(nm);
            [moment + value * nm, sum + value]
        });
        moment / sum
    };
    let [red, blue] = [red, blue].map(mean);
    (red + APART_NM < blue).then(|| {
        format!(
            "the mean wavelengths of its quantum efficiencies of R and B up to {} nm are {red:.0} and {blue:.0} nm, which is not the order \
             of their names",
            SEEN_NM.end()
        )
    })
}

/// An efficiency or a transmittance is a fraction.
fn within_unit(sensor: &str, key: &str, curve: Curve) -> Result<Curve> {
    let (low, high) = curve.extremes();
    if low < 0.0 || high > 1.0 {
        /// From here on it is no fraction that is a little too large.
        const PER_CENT: f64 = 2.0;
        let per_cent = if low >= 0.0 && (PER_CENT..=100.0).contains(&high) {
            ", and looks like per cent: divide it by 100"
        } else {
            ""
        };
        let problem = format!("`{key}` runs from {low} to {high}; it must lie within 0 and 1{per_cent}");
        return Err(Error::format(sensor, problem));
    }
    Ok(curve)
}
