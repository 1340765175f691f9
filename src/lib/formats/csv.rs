//! Tables of spectra as CSV, plain or gzipped.
//!
//! Two layouts are read: a column of wavelengths and one column per curve, or one row per spectrum under a header of
//! wavelengths. Units stand in the header, in a row of their own below it, or in comments; wavelengths without a unit are in
//! nm. What parts cells and what is a comment, `delimited` tells.

use super::cells::{Cells, MAX_COLUMNS, Text, numeric, unpacked};
use super::cut_off::doubt_of_radiances;
use super::delimited::{self, MAX_COMMENTS};
use super::described::Columns;
use super::factors::doubt_of_factor;
use super::foreign::{csv_complaint, line_of};
use super::misread::{self, is_units};
use super::quantities;
use super::radiance_unit::{self, Brightness, FileSays, times_white};
use super::register;
use super::remarks::Comments;
use super::spectral_heading::{self, Wavelengths, check_first_column, is_behind_index, refuse_index, without_first};
use super::thousands::Points;
use super::uncertainties;
use super::wavelengths::in_nm;
use crate::error::{Error, Result};
use crate::names::place_of;
use crate::spectrum::{Along, Between, Curve};
use crate::units::{OtherUnit, RadianceUnit, Stated, WavelengthUnit, unit_of_heading};
use csv::StringRecord;
use ndarray::{Array2, Axis};
use std::collections::BTreeMap;

/// The names of the columns of a table of any kind; `name` is the file in messages.
///
/// # Errors
///
/// [`Error::Format`] for what is no CSV table.
pub fn columns(name: &str, bytes: &[u8]) -> Result<Vec<String>> {
    let text = Text::of(name, bytes, false)?;
    let mut reader = text.reader(true);
    let headers = reader.headers().map_err(|error| csv_complaint(name, text.rows(), &error))?;
    if headers.is_empty() {
        return Err(Error::format(name, "it is empty; a table with a row of headings is wanted"));
    }
    Ok(headers.iter().take(MAX_COLUMNS).map(ToOwned::to_owned).collect())
}

/// Reads one column of a table of any kind as text; `name` is the file in messages.
///
/// # Errors
///
/// [`Error::Format`] for what is no CSV table, or has no such column, naming those that there are.
pub fn text_column(name: &str, bytes: &[u8], column: &str) -> Result<Vec<String>> {
    let text = Text::of(name, bytes, false)?;
    let not_csv = |error: csv::Error| csv_complaint(name, text.rows(), &error);
    let mut reader = text.reader(true);
    let headers = reader.headers().map_err(not_csv)?;
    let place = headers.iter().position(|header| header == column).ok_or_else(|| {
        let known: Vec<&str> = headers.iter().collect();
        Error::format(name, format!("it has no column `{column}`; it has {}", known.join(", ")))
    })?;
    reader.records().map(|record| record.map(|row| row[place].to_owned()).map_err(not_csv)).collect()
}

/// Curves over common wavelengths.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralTable {
    name: String,
    /// Wavelengths in nm, ascending.
    pub wavelength_nm: Vec<f64>,
    /// Names of the curves.
    pub columns: Vec<String>,
    /// Values, shape curves × wavelengths; those of a curve count where [`Self::check`] lets it pass.
    pub values: Array2<f64>,
    /// The curves that have a cell that is no number, and the complaint of it.
    spoiled: BTreeMap<usize, String>,
    /// What the heading of each curve says about its unit.
    headings: Vec<Option<Stated>>,
    /// What comments say about units.
    remarks: Vec<Stated>,
    /// What a comment that begins as `Unit:` says they are, where that is no radiance.
    other_quantity: Option<Stated>,
    /// The unit in which its wavelengths were given, or their wavenumbers, or the energies of their photons.
    counted_in: WavelengthUnit,
    /// Whether nothing says what its columns are.
    is_bare: bool,
    /// The numbers that comments give its curves, where they describe all columns.
    numbers: Option<Vec<usize>>,
    /// The curves whose points may be marks of thousands.
    points: Points,
}

impl SpectralTable {
    /// Reads a table; `name` is the file in messages.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] naming line and column of what is no number where that spoils all curves, or what the table lacks.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self> {
        let bytes = unpacked(name, bytes)?;
        let text = Text::of(name, &bytes, true);
        let parsed = text.and_then(|text| Self::of_text(name, &text));
        parsed.map_err(|error| misread::explained(name, &bytes).unwrap_or(error))
    }

    fn of_text(name: &str, text: &Text) -> Result<Self> {
        let mut reader = text.reader(false);
        let first = first_record(name, text, &mut reader)?;
        let has_header = numeric(&first[0]).is_none();
        if has_header {
            let comments: Vec<&str> = delimited::comments(&text.decoded).take(MAX_COMMENTS).collect();
            misread::check_heading(name, text.rows(), &first, &comments)?;
        }
        let heads = if has_header { heading_wavelengths(name, text, &first)? } else { None };
        let by_rows = heads.is_some();
        let above_columns = has_header && !by_rows;
        let below = if above_columns { record_below(name, text.rows(), &mut reader)? } else { None };
        let (units, at_hand) = units_of(&first, below, has_header);
        // Names, or times, before wavelengths are no numbers.
        let misplaced =
            |error| if above_columns { check_first_column(name, &first).err().unwrap_or(error) } else { error };
        let layout = (by_rows, text.separator());
        let cells = Cells::read(name, text.rows(), &mut reader, at_hand.as_ref(), layout).map_err(misplaced)?;
        let (first, units, cells) = match above_columns && is_behind_index(&first, &cells.numbers) {
            true => (without_first(&first), units.as_ref().map(without_first), cells.without_first(name)?),
            false => (first, units, cells),
        };
        if above_columns {
            check_first_column(name, &first)?;
        }
        let Cells { numbers, labels, spoiled, points } = cells;
        misread::check_shape(name, &numbers, has_header)?;
        let (width, values) = (numbers.ncols(), numbers.slice(ndarray::s![.., 1..]));
        let heading = Some(&first).filter(|_| has_header);
        let said = Columns::of(name, &text.decoded, if by_rows { 0 } else { width }, heading, units.as_ref())?;
        let unit_of_heads = heads.as_ref().and_then(|heads| heads.unit);
        let of_heads = heads.as_ref().and_then(|heads| heads.quantity.clone());
        let (wavelengths, columns, values) = match heads {
            Some(heads) => (heads.values, labels, values.to_owned()),
            None => (numbers.column(0).to_vec(), said.names(width), values.t().to_owned()),
        };
        let comments = Comments::of(&text.decoded, said.are_described());
        doubt_of_factor(&text.decoded).into_iter().for_each(|doubt| register::doubt(format!("{name}: {doubt}")));
        let of_rows = of_heads.or_else(|| unit_of_heading(&first[0]).filter(|_| by_rows));
        let headings = headings(&columns, units.as_ref(), &said, of_rows.as_ref());
        let heading = units.as_ref().unwrap_or(&first).get(0).filter(|cell| has_header && !is_of_radiance(cell));
        let stated = |said: Option<&str>| wavelength_unit(said).map_err(|problem| Error::format(name, problem));
        let unit = match unit_of_heads {
            Some(unit) => Some(unit),
            None => stated(heading)?.or(stated(said.first())?).or(comments.wavelength),
        };
        if !(by_rows || unit.is_some() && said.is_first_named()) {
            refuse_index(name, &numbers)?;
        }
        let are_swapped = || spectral_heading::are_swapped(&numbers).filter(|_| unit.is_none() && !by_rows);
        let (wavelength_nm, values) = in_nm(wavelengths, values, unit)
            .map_err(|problem| Error::format(name, are_swapped().unwrap_or(problem)))?;
        let numbers = said.are_described().then(|| (2..=columns.len() + 1).collect());
        let Comments { units: remarks, other_quantity, .. } = comments;
        let table = Self {
            name: name.to_owned(),
            wavelength_nm,
            columns,
            values,
            spoiled,
            headings,
            remarks,
            other_quantity,
            counted_in: unit.unwrap_or(WavelengthUnit::Nanometer),
            is_bare: said.are_bare(),
            numbers,
            points,
        };
        Ok(table.without_uncertainties())
    }

    /// Itself without curves that are uncertainties of others, which are told.
    fn without_uncertainties(self) -> Self {
        let Some(kept) = uncertainties::others(&self.columns) else { return self };
        register::doubt(uncertainties::told(&self.name, &self.columns, &kept));
        let place = |index: &usize| kept.iter().position(|kept| kept == index);
        Self {
            columns: kept.iter().map(|index| self.columns[*index].clone()).collect(),
            values: self.values.select(Axis(0), &kept),
            spoiled: self.spoiled.iter().filter_map(|(index, said)| Some((place(index)?, said.clone()))).collect(),
            headings: kept.iter().map(|index| self.headings[*index].clone()).collect(),
            points: self.points.kept(&kept),
            numbers: self.numbers.map(|numbers| kept.iter().map(|index| numbers[*index]).collect()),
            ..self
        }
    }

    /// The file as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Refuses a curve of which a cell is no number.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] naming its line and column.
    pub fn check(&self, index: usize) -> Result<()> {
        self.spoiled.get(&index).map_or(Ok(()), |problem| Err(Error::format(&self.name, problem.clone())))
    }

    /// The place of a column; the first, where none is named.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] naming the columns that there are.
    pub fn column_index(&self, column: Option<&str>) -> Result<usize> {
        let Some(column) = column else { return Ok(0) };
        let is_it = |name: &&str| name.eq_ignore_ascii_case(column);
        let alike = self.columns.iter().filter(|name| name.as_str() == column || without_unit(name) == column).count();
        if alike > 1 {
            let problem = format!(
                "{alike} columns are called `{column}`; give each a name of its own, with its unit behind it in brackets"
            );
            return Err(Error::format(&self.name, problem));
        }
        let exact = place_of(column, self.columns.iter().map(String::as_str));
        // Of columns that a comment names, too.
        let counted = || {
            let number = column.to_ascii_lowercase().strip_prefix("column")?.parse::<usize>().ok()?;
            match &self.numbers {
                Some(numbers) => numbers.iter().position(|of| *of == number),
                None => number.checked_sub(1).filter(|place| *place < self.columns.len()),
            }
        };
        // The name of `sky (mW m-2 sr-1 nm-1)` is `sky`, where no other column's is.
        let bare = || {
            let mut places = (0..self.columns.len()).filter(|place| is_it(&without_unit(&self.columns[*place])));
            places.next().filter(|_| places.next().is_none())
        };
        exact.or_else(bare).or_else(counted).ok_or_else(|| {
            let some: Vec<&str> = self.columns.iter().take(8).map(String::as_str).collect();
            let is_one = |number: usize| match &self.numbers {
                Some(numbers) => numbers.contains(&number),
                None => (1..=self.columns.len()).contains(&number),
            };
            let by_number = match column.parse().is_ok_and(is_one) {
                true => format!("; by its place it is column{column}"),
                false => String::new(),
            };
            Error::Usage(format!("{}: there is no column `{column}`; it has {}{by_number}", self.name, some.join(", ")))
        })
    }

    /// A column as a curve.
    ///
    /// # Errors
    ///
    /// As [`Self::column_index`], and [`Error::Format`] for values that make no curve.
    pub fn curve(&self, column: Option<&str>) -> Result<Curve> {
        self.curve_at(self.column_index(column)?)
    }

    /// The same of a column by its place: between rows straight in wavelength, or in wavenumber where that is what they have.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for values that make no curve.
    pub fn curve_at(&self, index: usize) -> Result<Curve> {
        self.check(index)?;
        let between = Between::new(&self.wavelength_nm, self.along(), false);
        let values = between.values(|row| self.values[(index, row)]);
        Curve::new(between.wavelength_nm, values).map_err(|problem| Error::format(&self.name, problem))
    }

    /// What its rows go along.
    fn along(&self) -> Along {
        if self.counted_in.is_of_energy() { Along::Wavenumber } else { Along::Wavelength }
    }

    /// The wavelengths at which its radiances are taken, `given` the unit that the user says they have: those of its rows, and more
    /// where they are no straight lines in nm between these.
    pub fn between(&self, given: Option<RadianceUnit>) -> Between {
        let of_file = self.headings.iter().flatten().chain(&self.remarks);
        let of_file = of_file.filter_map(|says| match says {
            Stated::Radiance(unit) => Some(*unit),
            Stated::Other { .. } => None,
        });
        let is_bent = given.into_iter().chain(of_file).any(RadianceUnit::is_per_wavenumber);
        Between::new(&self.wavelength_nm, self.along(), is_bent)
    }

    /// A curve of radiances in W cm⁻² sr⁻¹ nm⁻¹ at the wavelengths of [`Self::between`].
    ///
    /// # Errors
    ///
    /// Those of [`Self::radiance_unit`].
    pub fn radiances(&self, index: usize, given: Option<RadianceUnit>, between: &Between) -> Result<Vec<f64>> {
        let (unit, _) = self.radiance_unit(index, given)?;
        let mut radiances = between.values(|row| self.values[(index, row)]);
        let of_nm = between.wavelength_nm.iter().map(|nm| unit.in_w_per_cm2_sr_nm(*nm));
        radiances.iter_mut().zip(of_nm).for_each(|(value, factor)| *value *= factor);
        Ok(radiances)
    }

    /// The unit of a curve of radiances, with a warning where it is assumed; `given` is what the user says.
    ///
    /// # Errors
    ///
    /// Those of [`Self::check`] and [`radiance_unit::settle`].
    pub fn radiance_unit(&self, index: usize, given: Option<RadianceUnit>) -> Result<(RadianceUnit, Option<String>)> {
        self.check(index)?;
        let heading = self.stated(index);
        let place = "in the heading, as in `radiance (W m-2 sr-1 nm-1)`";
        if self.counted_in.is_of_energy() && heading.is_none() && self.remarks.is_empty() && given.is_none() {
            let what = if self.counted_in == WavelengthUnit::ElectronVolt { "photon energy" } else { "wavenumber" };
            let problem =
                format!("it is by {what} and does not say whether its radiance is per nm or per {}", self.counted_in);
            return Err(Error::format(&self.name, problem).give(&["radiance_unit"]));
        }
        let like_uvspec = misread::LIKE_UVSPEC;
        if self.is_like_uvspec() && given.is_none() {
            let problem = format!("{like_uvspec}; --radiance-unit is for values that are radiances after all");
            return Err(Error::format(&self.name, problem));
        }
        let of_uvspec =
            self.uvspec().map(|_| format!("{}: {like_uvspec}; it is `{}`", self.name, misread::UVSPEC[index]));
        // Of several columns a refusal names the one.
        let is_other = matches!(heading, Some(Stated::Other { kind, .. }) if kind.conversion().is_some());
        let of_column = format!("{}: column `{}`", self.name, self.columns[index]);
        let name = if is_other && self.columns.len() > 1 { &of_column } else { &self.name };
        let says = FileSays { name, heading, remarks: &self.remarks, place };
        let (unit, assumed) = radiance_unit::settle(says, given)?;
        let samples = self.values.row(index).into_iter().zip(&self.wavelength_nm);
        let brightest = samples.map(|(value, nm)| value * unit.in_w_per_cm2_sr_nm(*nm)).fold(0.0, f64::max);
        let times = times_white(brightest);
        let doubt = self.points.check(&self.name, index, times)?;
        let is_assumed = heading.is_none() && self.remarks.is_empty() && given.is_none();
        let bright = Brightness::of([times]).judge(&self.name, unit, is_assumed)?;
        Ok((unit, of_uvspec.or(assumed).or(doubt).or(bright)))
    }

    /// What a heading, or a comment about all columns, says that a curve is.
    pub(super) fn stated(&self, index: usize) -> Option<&Stated> {
        let names_radiance = self.remarks.iter().any(|remark| matches!(remark, Stated::Radiance(_)));
        let other = self.other_quantity.as_ref().filter(|_| !names_radiance);
        self.headings.get(index).and_then(Option::as_ref).or(other)
    }

    /// Whether it has as many columns as what uvspec writes by default, and says nothing of them.
    fn is_like_uvspec(&self) -> bool {
        self.is_bare && self.columns.len() == misread::UVSPEC.len() && self.remarks.is_empty()
    }

    /// What its columns are where they go with each other as those do that libRadtran's uvspec writes by default, none of which is a
    /// radiance.
    pub fn uvspec(&self) -> Option<&'static str> {
        (self.is_like_uvspec() && misread::holds_direct_light(&self.values)).then_some(misread::LIKE_UVSPEC)
    }

    /// The columns of which nothing says that they hold anything but radiances.
    pub fn likely_radiances(&self) -> Vec<&str> {
        let is_other =
            |says: &Option<Stated>| matches!(says, Some(Stated::Other { kind, .. }) if kind.conversion().is_some());
        let all = self.columns.iter().zip(&self.headings).enumerate();
        let likely = all.filter(|(index, (_, says))| !is_other(says) && !self.spoiled.contains_key(index));
        likely.map(|(_, (column, _))| column.as_str()).collect()
    }

    /// Its one column as the relative power of a light, per interval of wavelength.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where it is by wavenumber, or says that it is another quantity; for several columns, and for values that make no
    /// curve.
    pub fn light(&self) -> Result<Curve> {
        let is_per_wavenumber =
            matches!(self.headings.first(), Some(Some(Stated::Radiance(unit))) if unit.is_per_wavenumber());
        if self.counted_in.is_of_energy() || is_per_wavenumber {
            let what = if self.counted_in == WavelengthUnit::ElectronVolt { "photon energy" } else { "wavenumber" };
            let problem = format!("a light by {what} is not read; give its power per nm by wavelength");
            return Err(Error::format(&self.name, problem));
        }
        let count = self.columns.len();
        if count > 1 {
            let names = self.columns.iter().take(8).map(String::as_str).collect::<Vec<_>>().join(", ");
            let problem =
                format!("it holds {count} spectra, {names}, and a light is one; leave one, behind its wavelengths");
            return Err(Error::format(&self.name, problem));
        }
        match self.stated(0).and_then(|stated| quantities::of_light(&self.columns[0], stated)) {
            Some(problem) => Err(Error::format(&self.name, problem)),
            None => self.curve(None),
        }
    }

    /// A warning of values in a curve of radiances that no light has: below zero, nothing but zeros, or cut off to zeros.
    pub fn doubt_of_values(&self, index: usize) -> Option<String> {
        let which = if self.columns.len() > 1 { format!(": `{}`", self.columns[index]) } else { String::new() };
        let values = self.values.row(index).to_vec();
        let doubt = doubt_of_radiances(&format!("{}{which}", self.name), &self.wavelength_nm, &values);
        let is_none = values.iter().all(|value| *value == 0.0);
        doubt.map(|doubt| if is_none { format!("{doubt}: is it the right column?") } else { doubt })
    }
}

/// The first row of a table.
fn first_record(name: &str, text: &Text, reader: &mut csv::Reader<&[u8]>) -> Result<StringRecord> {
    let refuse = |problem: &str| Err(Error::format(name, problem));
    let mut first = StringRecord::new();
    if !reader.read_record(&mut first).map_err(|e| csv_complaint(name, text.rows(), &e))? {
        return refuse(if text.decoded.trim().is_empty() { "it is empty" } else { "it holds no rows" });
    }
    if text.is_ambiguous(&first) {
        return refuse(
            "its commas part columns or decimals, nobody can tell which; part its columns by semicolons, tabs or blanks, or \
             give it a header",
        );
    }
    Ok(first)
}

/// The row of units `below` a heading, where it is one; else what of the table has been read: that row, or the `first` one where there is no
/// heading.
fn units_of(
    first: &StringRecord,
    below: Option<StringRecord>,
    has_header: bool,
) -> (Option<StringRecord>, Option<StringRecord>) {
    match below {
        Some(record) if is_units(first, &record) => (Some(record), None),
        record => (None, record.or_else(|| (!has_header).then(|| first.clone()))),
    }
}

/// The record below the header, if there is one.
fn record_below(name: &str, text: &str, reader: &mut csv::Reader<&[u8]>) -> Result<Option<StringRecord>> {
    let mut record = StringRecord::new();
    let is_there = reader.read_record(&mut record).map_err(|e| csv_complaint(name, text, &e))?;
    Ok(is_there.then_some(record))
}

/// The wavelengths of a heading above rows of spectra.
fn heading_wavelengths(name: &str, text: &Text, heading: &StringRecord) -> Result<Option<Wavelengths>> {
    let line = line_of(text.rows(), heading.position());
    let below = delimited::rows(text.rows()).nth(1).unwrap_or_default();
    let below = below.split(text.separator()).next().unwrap_or_default().trim();
    spectral_heading::wavelengths(name, line, heading, below)
}

/// What headings say about the unit of each curve: those of its column in a row of units and in the header; where curves are
/// rows, that of the row, or what the header says `of_rows`.
fn headings(
    columns: &[String],
    units: Option<&StringRecord>,
    said: &Columns,
    of_rows: Option<&Stated>,
) -> Vec<Option<Stated>> {
    let unit_below = |index: usize, column: &str| {
        let cell = units?.get(index + 1)?;
        let both = unit_of_heading(&format!("{column} ({cell})"));
        let is_contradiction = matches!(&both, Some(Stated::Other { kind: OtherUnit::Contradiction, .. }));
        let alone = || unit_of_heading(cell).or_else(|| unit_of_heading(&format!("({cell})")));
        if is_contradiction { both } else { alone() }
    };
    let one = |(index, column): (usize, &String)| {
        let of_column = || unit_of_heading(column).or_else(|| said.unit_of(index));
        unit_below(index, column).or_else(of_column).or_else(|| of_rows.cloned())
    };
    columns.iter().enumerate().map(one).collect()
}

/// Whether a heading is that of a quantity other than wavelength.
fn is_of_radiance(heading: &str) -> bool {
    let is_energy = WavelengthUnit::of_heading(heading) == Ok(Some(WavelengthUnit::ElectronVolt));
    // `photon energy (eV)` is no number of photons.
    let is_other = |stated: &Stated| match stated {
        Stated::Other { kind: OtherUnit::Unknown, .. } => true,
        Stated::Other { kind: OtherUnit::Photons, .. } => is_energy,
        _ => false,
    };
    unit_of_heading(heading).is_some_and(|stated| !is_other(&stated))
}

/// The unit of wavelengths that their heading names.
fn wavelength_unit(heading: Option<&str>) -> std::result::Result<Option<WavelengthUnit>, String> {
    WavelengthUnit::of_heading(heading.unwrap_or_default()).map_err(|counted| {
        format!("its first column holds {counted}; wavelengths are wanted, under a heading such as `wavelength_nm`")
    })
}

/// A heading without the unit in brackets behind it.
fn without_unit(heading: &str) -> &str {
    let opening = heading.ends_with(')').then_some('(').or_else(|| heading.ends_with(']').then_some('['));
    opening.and_then(|bracket| heading.rfind(bracket)).map_or(heading, |at| heading[..at].trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    #[test]
    fn both_layouts_give_the_same_curves() {
        let by_columns = SpectralTable::parse("a", b"# sky\nwavelength_nm,a,b\n400,1,2\n410,3,4\n").unwrap();
        let by_rows = SpectralTable::parse("b", b"id,400,410\nx,1,3\ny,2,4\n").unwrap();
        assert_eq!(by_columns.values, by_rows.values);
        assert_eq!(by_columns.wavelength_nm, by_rows.wavelength_nm);
        assert_eq!(by_rows.columns, ["x", "y"]);
        assert_eq!(by_columns.curve(Some("b")).unwrap().at(405.0), 3.0);
    }

    #[test]
    fn cells_are_parted_by_commas_semicolons_or_tabs() {
        let by_commas = SpectralTable::parse("a", b"# a; b\nnm,L (W/m2/sr/nm)\n400,1\n410,3\n").unwrap();
        for separator in [";", "\t", "; "] {
            let text = format!("\u{FEFF}# a, b\n\nnm{separator}L (W/m2/sr/nm)\n400{separator}1\n410{separator}3\n");
            assert_eq!(SpectralTable::parse("a", text.as_bytes()).unwrap(), by_commas);
        }
    }

    #[test]
    fn a_slip_that_sorting_would_hide_is_told() {
        let read = |nm: &[f64]| {
            let rows: String = nm.iter().map(|nm| format!("{nm},1\n")).collect();
            SpectralTable::parse("t", format!("nm,L\n{rows}").as_bytes()).map(drop).map_err(|error| error.to_string())
        };
        for (nm, place) in [
            (&[400.0, 410.0, 240.0, 430.0][..], "240 nm stands between 410 and 430 nm"),
            (&[400.0, 410.0, 4200.0, 430.0, 440.0], "4200 nm stands between 410 and 430 nm"),
            (&[700.0, 690.0, 860.0, 670.0, 660.0], "860 nm stands between 690 and 670 nm"),
            (&[4000.0, 410.0, 420.0, 430.0], "4000 nm stands before 410 nm"),
            (&[400.0, 410.0, 420.0, 43.0], "43 nm stands behind 420 nm"),
            (&[400.0, 410.0, 420.0, 430.0, 405.0], "405 nm stands behind 430 nm"),
        ] {
            let found = read(nm).unwrap_err();
            assert!(found.starts_with(&format!("t: the wavelength {place}, and all others are in order")), "{found}");
        }
        // In order, the other way, two changed places, three, nobody can tell.
        for nm in [
            &[400.0, 410.0, 420.0, 430.0][..],
            &[430.0, 420.0, 410.0, 400.0],
            &[400.0, 420.0, 410.0, 430.0],
            &[400.0, 450.0, 410.0, 440.0, 420.0, 430.0],
            &[500.0, 510.0, 520.0, 400.0, 410.0, 420.0],
            &[410.0, 400.0, 420.0],
        ] {
            assert_eq!(read(nm), Ok(()), "{nm:?}");
        }
    }

    /// The same table as people and programs write it.
    #[test]
    fn tables_are_read_as_people_have_them() {
        let values = ndarray::array![[0.5, 1.25, 3.0]];
        let utf16 = |unit: fn(u16) -> [u8; 2], text: &str| {
            [&unit(0xFEFF)[..], &text.encode_utf16().flat_map(unit).collect::<Vec<u8>>()].concat()
        };
        let text = "nm;L\r\n400;0,5\r\n410;1,25\r\n420;3\r\n";
        let mut tables: Vec<Vec<u8>> = vec![utf16(u16::to_le_bytes, text), utf16(u16::to_be_bytes, text)];
        tables.extend([tables[0][2..].to_vec(), tables[1][2..].to_vec()]);
        tables.extend(
            [
                text,
                "nm;L\r\n400;0,5\r\n410;1,25\r\n420;3\r\n\u{1A}",
                "nm\tL\n400,0\t0,5\n410,0\t1,25\n420,0\t3,0\n",
                "\"400,0\",\"0,5\"\n\"410,0\",\"1,25\"\n\"420,0\",\"3,0\"\n",
                "wavelength (nm, vacuum)\tL\n400\t0,5\n410\t1,25\n420\t3\n",
                "400 0,5\n410 1,25\n420 3,0\n",
                "nm L\n400 0,5\n410 1,25\n420 3\n",
                "nm L\n400,0 0,5\n410,0 1,25\n420,0 3,0\n",
                "wavelength (nm) L\n420 3,0\n400 0,5\n410 1,25\n",
                "  400.000  5.000000e-01 \n  410.000  1.250000e+00 \n  420.000  3.000000e+00 \n",
                "  400,000  5,0e-01\n  410,000  1,25\n  420,000  3,0\n",
                " WAVELENGTH (nm)   TOTAL RAD\n 400.  0.5D+00\n 410.  0.125D+01\n 420.  3.0D0\n",
                "lambda [nm] L [W/(m2 sr nm)]\n400 0.5\n410 1.25\n420 3\n",
                "wavelength (nm) spectral radiance (W m-2 sr-1 nm-1)\n400 0.5\n410 1.25\n420 3\n",
                "wavelength nm\tradiance of sky\n400 0.5\n410 1.25\n420 3\n",
                "wavelength (nm)   radiance (W m-2 sr-1 nm-1)\n400   0.5\n410 1.25\n420  3\n",
                "# a, b\n; c; d\n% e\n// f\n! g\n  # h\n400 0.5\n\n410 1.25\n420 3\n",
                "nm,L,\n400,0.5,\n410,1.25,\n420,3,\n,,\n",
                "nm,\n400,0.5\n410,1.25\n420,3\n",
                "nm,L\n400,0.5,\n410,1.25,\n420,3,\n",
                "nm,L\n400,0.5\n410,1.25,\n420,3,,\n",
                "nm;L;;\n400;0,5;;\n410;1,25;;\n420;3;;\n",
                "id;400;410;420\nsky;0,5;1,25;3\n",
                "id,400,410,420\n2024 05 01,0.5,1.25,3\n",
                "id,400,410,420\nsky; noon,0.5,1.25,3\n",
                ";400;410;420\nsky;0,5;1,25;3\n",
                "nm,L\r400,0.5\r410,1.25\r420,3\r",
                "nm,L\n420,3\n410,1.25\n400,0.5\n",
                "id,410,420,400\nx,1.25,3,0.5\n",
                "angstrom L\n4100 1.25\n4000 0.5\n4200 3\n",
                "nu_cm-1 L\n25000 0.5\n24390.243902439024 1.25\n23809.52380952381 3\n",
                "% wavenumber in cm-1\n25000 0.5\n24390.243902439024 1.25\n23809.52380952381 3\n",
            ]
            .map(|text| text.as_bytes().to_vec()),
        );
        for bytes in tables {
            let table = SpectralTable::parse("a", &bytes).unwrap();
            let shown = String::from_utf8_lossy(&bytes);
            assert_eq!(table.values, values, "{shown}");
            // 10⁷ divided by a rounded wavenumber.
            let near = |(a, b): (&f64, f64)| (a - b).abs() < 1e-12 * b;
            assert!(table.wavelength_nm.iter().zip([400.0, 410.0, 420.0]).all(near), "{shown}: {table:?}");
        }
        let latin1 = SpectralTable::parse("a", b"nm,L (\xB5W/cm\xB2/sr/nm)\n400,1\n").unwrap();
        assert_eq!(latin1.radiance_unit(0, None).unwrap().0, RadianceUnit::USUAL[4]);
    }

    /// What is no number spoils its own curve alone.
    #[test]
    fn columns_that_are_not_wanted_may_hold_anything() {
        let values = [0.5, 1.25, 3.0];
        for text in [
            "nm,L,note\n400,0.5,good\n410,1.25,\n420,3,bad\n",
            "nm,L,note\n400,0.5,\n410,1.25,\n420,3,\n",
            "nm,L,note,\n400,0.5,x,\n410,1.25,,\n420,3,,\n",
            "nm,note,L\n400,,0.5\n410,\"a, b\",1.25\n420,x,3\n",
            "nm;note;L\n400;gut;0,5\n410;schlecht, naß;1,25\n420;;3\n",
            "nm\tL\tM\n400\t0.5\t1\n410\t1.25\t\n420\t3\t7\n",
            "nm L note\n400 0.5 good\n410 1.25 bad\n420 3 good\n",
            "nm note L\n400 gut 0,5\n410 schlecht 1,25\n420 gut 3,0\n",
            "nm\tnote\tL\n400\tgut\t0,5\n410\tschlecht\t1,25\n420\tgut\t3\n",
            "nm L note\n400 0,5 good\n410 1,25 bad\n420 3,0 good\n",
            "nm L note\n400 0.5 (good)\n410 1.25 (bad)\n420 3 [good]\n",
            "nm,L,M\n400,0.5,1\n410,1.25,nan\n420,3,7\n",
            "id,400,410,420\nL,0.5,1.25,3\nnote,1,,2\n",
        ] {
            let table = SpectralTable::parse("a", text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"));
            let curve = table.curve(Some("L")).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!([400.0, 410.0, 420.0].map(|nm| curve.at(nm)), values, "{text}");
            let other = table.columns.iter().find(|name| *name != "L").unwrap();
            let refused = table.curve(Some(other)).unwrap_err().to_string();
            assert!(refused.starts_with("a: line "), "{text}: {refused}");
            let index = table.column_index(Some(other)).unwrap();
            assert_eq!(table.radiance_unit(index, Some(RadianceUnit::USUAL[1])).unwrap_err().to_string(), refused);
            assert_eq!(table.likely_radiances(), ["L"]);
        }
        let complaint = |text: &str| SpectralTable::parse("t", text.as_bytes()).unwrap_err().to_string();
        // Nothing is left of these.
        assert!(complaint("nm,L,M\n400,1,x\n410,,2\n").starts_with("t: line 3, column 2 is empty"));
        assert!(complaint("nm,L,M\n400,1,2\n41O,1,2\n").starts_with("t: line 3, column 1: `41O` is no number"));
        // Cells that are lacking, or are too many, belong to no column.
        assert!(complaint("nm L flag\n400 0.5 good\n410 1.25\n").starts_with("t: line 3 has 2 cells"));
        assert_eq!(complaint("nm;L\n400;1\n410;1;2\n"), "t: line 3 has 3 cells, the rows above it have 2");
        assert!(complaint("nm L\n360.5 0,05\n361.5 0,06\n").contains("decimal points and decimal commas"));
        let refused = complaint("id,L\n360 0,05\n370 0,06\n");
        assert!(refused.starts_with("t: line 1: 1 word stands above 2 columns that are parted by blanks"), "{refused}");
    }

    /// Planck's law per wavenumber, 2hc²ν³/(exp(hcν/kT) − 1), becomes that per wavelength, 2hc²/λ⁵/(exp(hc/λkT) − 1).
    #[test]
    fn radiances_per_wavenumber_become_those_per_wavelength() {
        use crate::units::{BOLTZMANN_J_PER_K, LIGHT_M_PER_S, PLANCK_J_S};
        let (h, c) = (PLANCK_J_S, LIGHT_M_PER_S);
        let denominator = |per_m: f64| (h * c * per_m / (BOLTZMANN_J_PER_K * 5800.0)).exp_m1();
        let mut text = "wavenumber (cm-1),L (mW/(m2 sr cm-1))\n".to_owned();
        for per_cm in [25_000.0, 20_000.0, 12_500.0] {
            let per_m: f64 = per_cm * 100.0;
            // In W m⁻² sr⁻¹ per m⁻¹; 1 cm⁻¹ is 100 m⁻¹, 1 W 1000 mW.
            let radiance = 2.0 * h * c * c * per_m.powi(3) / denominator(per_m) * 100.0 * 1e3;
            text += &format!("{per_cm},{radiance:e}\n");
        }
        let table = SpectralTable::parse("a", text.as_bytes()).unwrap();
        assert_eq!(table.wavelength_nm, [400.0, 500.0, 800.0]);
        let (unit, warning) = table.radiance_unit(0, None).unwrap();
        assert_eq!(unit.to_string(), "mW m-2 sr-1 / cm-1");
        // As the disk of the sun is.
        assert!(warning.unwrap().contains("40000 times as bright as a white cloud in the sun: is that its unit?"));
        for (value, nm) in table.values.row(0).iter().zip(&table.wavelength_nm) {
            let meters = nm * 1e-9;
            // W m⁻² sr⁻¹ per m is 10⁻¹³ W cm⁻² sr⁻¹ nm⁻¹.
            let wanted = 2.0 * h * c * c / meters.powi(5) / denominator(1.0 / meters) * 1e-13;
            let found = value * unit.in_w_per_cm2_sr_nm(*nm);
            assert!((found / wanted - 1.0).abs() < 1e-12, "{nm}: {found} {wanted}");
        }
        // Between the rows it is straight in wavenumber, and then turned: of few rows as of all that lie on the same lines.
        let between = table.between(None);
        let found = table.radiances(0, None, &between).unwrap();
        let per_cm1 = table.values.row(0);
        for (nm, radiance) in between.wavelength_nm.iter().zip(&found) {
            let per_cm = 1e7 / nm;
            let (row, share) =
                if per_cm > 20_000.0 { (0, (25_000.0 - per_cm) / 5_000.0) } else { (1, (20_000.0 - per_cm) / 7_500.0) };
            let line = per_cm1[row] + share * (per_cm1[row + 1] - per_cm1[row]);
            // mW m⁻² sr⁻¹ per cm⁻¹ are 10⁻⁷ W cm⁻², and ν²/10⁷ cm⁻¹ a nm.
            let wanted = line * 1e-7 * per_cm * per_cm / 1e7;
            assert!((radiance / wanted - 1.0).abs() < 1e-12, "{nm}: {radiance} {wanted}");
        }
        assert_eq!(between.wavelength_nm.len(), 401);
        // Radiances per wavenumber that stand by wavelength are straight in that.
        let by_nm = SpectralTable::parse("a", b"nm,L (mW/(m2 sr cm-1))\n400,1\n800,3\n").unwrap();
        let between = by_nm.between(None);
        let middle = by_nm.radiances(0, None, &between).unwrap()[200];
        assert!(
            (between.wavelength_nm[200], (middle / (2.0 * 1e-7 * 1e7 / 600f64.powi(2)) - 1.0).abs() < 1e-12)
                == (600.0, true)
        );
        let given = RadianceUnit::parse("mW/(m2 sr cm-1)");
        let by_nm = SpectralTable::parse("a", b"nm,L\n400,1\n800,3\n").unwrap();
        assert_eq!(by_nm.between(given).wavelength_nm.len(), 401);
        assert_eq!(by_nm.between(None).wavelength_nm, [400.0, 800.0]);
        // So is a curve of wavenumbers.
        let curve = SpectralTable::parse("a", b"nu (cm-1),T\n12500,0\n25000,1\n").unwrap().curve(None).unwrap();
        assert!((curve.at(500.0) - 0.6).abs() < 1e-12);
        let silent = SpectralTable::parse("a", b"nu (cm-1),L\n20000,1\n25000,1\n").unwrap();
        let refused = silent.radiance_unit(0, None).unwrap_err().to_string();
        assert!(refused.contains("whether its radiance is per nm or per cm-1; give `radiance_unit`"), "{refused}");
        assert!(silent.light().unwrap_err().to_string().contains("a light by wavenumber is not read"));
    }

    #[test]
    fn complaints_name_the_place() {
        let complaint = |text: &str| SpectralTable::parse("t.csv", text.as_bytes()).unwrap_err().to_string();
        assert_eq!(complaint("nm,L\n400,1\n410,x\n"), "t.csv: line 3, column 2: `x` is no number");
        assert_eq!(
            complaint("nm,L\n410,1\n400,2\n410,3\n"),
            "t.csv: the wavelength 410 nm stands there twice; leave out one"
        );
        let missing = "leave out the row of a missing value, or fill it in";
        assert_eq!(complaint("nm,L\n400,nan\n"), format!("t.csv: line 2, column 2: `nan` is no number; {missing}"));
        assert_eq!(complaint("nm,L\n400,1\n410,\n420,1\n"), format!("t.csv: line 3, column 2 is empty; {missing}"));
        assert_eq!(complaint(""), "t.csv: it is empty");
        assert_eq!(complaint("# a\n"), "t.csv: it holds no rows");
        assert_eq!(complaint("nm,L\n400,1\n410\n"), "t.csv: line 3 has 1 cell, the rows above it have 2");
        let marks = "part columns by semicolons or tabs where commas are those of decimals";
        let wanted = format!("t.csv: line 2 has 3 cells, the rows above it have 2; {marks}");
        assert_eq!(complaint("nm,L\n400,1,5\n"), wanted);
        assert!(complaint("400,1,5\n410,2,5\n").contains("its commas part columns or decimals, nobody can tell which"));
        assert!(complaint("nm;L\n400.5;1,5\n").contains("decimal points and decimal commas"));
        assert!(complaint("a b c\n400 1\n410 2\n").contains("line 1: 3 words stand above 2 columns"));
        assert!(complaint("FREQ,L\n14000,1\n").contains("holds frequencies"));
    }

    #[test]
    fn what_stands_above_a_heading_is_told() {
        let complaint = |text: &str| SpectralTable::parse("t", text.as_bytes()).unwrap_err().to_string();
        let mark = "; put a # before what is no table";
        let long: String = (0..40).map(|line| format!("word {line}: value\n")).collect();
        for (text, lines) in [
            (
                "Instrument: A\nDate: 2020-01-01\n\nnm,L\n400,1\n410,2\n",
                "lines 1 to 2 stand above the heading of its columns, line 4",
            ),
            (
                "A title, with commas\nWavelength,L\n400,1\n410,2\n",
                "line 1 stands above the heading of its columns, line 2",
            ),
            (
                "Serial\t4711\nDate\tMay\nnm\tL\n400\t1\n410\t2\n",
                "lines 1 to 2 stand above the heading of its columns, line 3",
            ),
            ("Sky, measured\nid,400,410\na,1,2\n", "line 1 stands above the heading of its columns, line 2"),
            (&format!("{long}nm L\n400 1\n410 2\n"), "lines 1 to 40 stand above the heading of its columns, line 41"),
        ] {
            assert_eq!(complaint(text), format!("t: {lines}{mark}"), "{text}");
        }
        // A row of units belongs to the heading; what else is wrong is told of a table without such lines.
        assert!(
            complaint("wavelength,L\nnm,W/(m2 sr nm)\n400,1\n410,x\n").contains("line 4, column 2: `x` is no number")
        );
    }

    #[test]
    fn factors_in_comments_are_told() {
        let table =
            SpectralTable::parse("t", b"# Units: W m-2 sr-1 nm-1 (x 1000)\nwavelength,L\n350,51\n600,12\n").unwrap();
        let refused = table.radiance_unit(0, None).unwrap_err().to_string();
        assert!(refused.contains("a radiance beside a factor"), "{refused}");
    }

    #[test]
    fn tables_that_are_something_else_are_told() {
        let complaint = |text: &str| SpectralTable::parse("t", text.as_bytes()).unwrap_err().to_string();
        let yaml = "schema: cyanometer-matrix/1\nunit: nits\nxyz_from_camera:\n- [1, 0, 0]\n";
        assert_eq!(complaint(yaml), "t: it is a matrix file, for --matrix; a table is wanted here, as CSV");
        assert_eq!(complaint("\u{1}\0ab,c\n"), "t: it is not a CSV table but a binary file");
        for (text, what) in [
            (
                "PK\u{3}\u{4}\0\0",
                "a spreadsheet or another archive (ZIP); a table is wanted here: save its sheet as CSV",
            ),
            ("%PDF-1.7\n1 2\n", "a PDF; a table is wanted here, as CSV"),
            ("<!DOCTYPE html>\n<p>400,1\n", "a page of HTML or XML; a table is wanted here, as CSV"),
            (" {\"nm\": [400]}\n", "JSON; a table is wanted here, as CSV"),
        ] {
            assert_eq!(complaint(text), format!("t: it is {what}"));
        }
        let nameless = "its first row holds wavelengths, and its rows are spectra without names";
        assert!(complaint("400,410,420\n0.1,0.2,0.3\n0.2,0.3,0.4\n").contains(nameless));
        assert!(complaint("700;600;500\n1e-5;2e-5;3e-5\n").contains(nameless));
        assert!(complaint("1e-5,2e-5\n3e-5,4e-5\n").contains("which no light has"));
        // Columns without a heading: wavelengths go down, values go along.
        assert!(SpectralTable::parse("t", b"400 101 102\n410 103 104\n").is_ok());
        let uvspec = |columns: usize| -> String {
            (0..3).map(|row| format!("{}.0{}\n", 400 + 10 * row, " 1.0e-5".repeat(columns))).collect()
        };
        let unit = |text: &str, given| SpectralTable::parse("t", text.as_bytes()).unwrap().radiance_unit(0, given);
        let refused = unit(&uvspec(6), None).unwrap_err().to_string();
        assert!(refused.contains("what libRadtran's uvspec writes by default"), "{refused}");
        assert!(unit(&uvspec(5), None).is_ok());
        let (_, warned) = unit(&uvspec(6), Some(RadianceUnit::USUAL[2])).unwrap();
        assert!(warned.is_some_and(|warned| warned.ends_with("by `output_user lambda uu`; it is `edir`")));
        // Of `output_user lambda uu` no column is a share of another at all wavelengths.
        let radiances = "400.0 1 2 3 4 5 6\n410.0 1 2 3 4.1 5 6\n420.0 1 2 3 4.2 5 6\n";
        assert_eq!(unit(radiances, Some(RadianceUnit::USUAL[2])).unwrap().1, None);
    }

    #[test]
    fn tables_that_blow_up_are_refused() {
        let row = format!("500{}\n", ",1".repeat(1 << 20));
        let complaint = |text: &[u8]| SpectralTable::parse("t", text).unwrap_err().to_string();
        assert!(complaint(row.repeat(33).as_bytes()).contains("more than 33554432 numbers"));
        let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
        for _ in 0..257 {
            packed.write_all(&[b'#'; 1 << 20]).unwrap();
        }
        let packed = packed.finish().unwrap();
        let most = (packed.len() * 64) >> 20;
        assert!((17..256).contains(&most));
        assert!(complaint(&packed).contains(&format!("more than {most} MiB; no table of its size does")));
    }

    /// The unit is found wherever tables name it, that of the heading first.
    #[test]
    fn a_table_may_name_its_units_anywhere() {
        let watts = RadianceUnit::parse("W m-2 sr-1 nm-1");
        for text in [
            "nm,radiance_W_per_m2_sr_nm\n400,1\n500,2\n",
            "nm,radiance (W m-2 sr-1 nm-1)\n400,1\n500,2\n",
            "# Unit: W/m²/sr/nm\nnm,L\n400,1\n500,2\n",
            "wavelength,radiance\nnm,W/(m2 sr nm)\n400,1\n500,2\n",
            "# computed from an irradiance in W m-2 nm-1\num,L [W/m2/sr/nm]\n0.4,1\n0.5,2\n",
            "# Wavelength: um, radiance: W m-2 sr-1 nm-1\nwavelength,L\n0.4,1\n0.5,2\n",
            "id W/m2/sr/nm,400,500\nx,1,2\n",
        ] {
            let table = SpectralTable::parse("a", text.as_bytes()).unwrap();
            assert_eq!(table.wavelength_nm, [400.0, 500.0], "{text}");
            assert_eq!(table.radiance_unit(0, None).unwrap(), (watts.unwrap(), None), "{text}");
            assert_eq!(table.radiance_unit(0, watts).unwrap(), (watts.unwrap(), None), "{text}");
            let other = table.radiance_unit(0, Some(RadianceUnit::default())).unwrap_err().to_string();
            assert!(other.ends_with("not W cm-2 sr-1 nm-1; leave out `radiance_unit`"), "{other}");
        }
    }

    #[test]
    fn other_quantities_are_refused_whatever_is_said_of_their_unit() {
        let unit = |text: &str, given| SpectralTable::parse("a", text.as_bytes()).unwrap().radiance_unit(0, given);
        let watts = RadianceUnit::USUAL[1];
        let given = Some(watts);
        for given in [None, given] {
            for (text, quantity, conversion) in [
                (
                    "nm,L (W m-2 sr-1)\n400,1\n",
                    "`W m-2 sr-1`, a radiance over all",
                    "divide the value of each band by the width",
                ),
                ("nm,reflectance (%)\n400,1\n", "`reflectance (%)`, a ratio", "as a fraction of 1, by the radiance"),
                ("nm,sky\nnm,%\n400,1\n", "`%`, a ratio", "as a fraction of 1, by the radiance"),
                ("nm,sky (counts)\n400,1\n", "`counts`, what an instrument reads", "by the calibration"),
                ("nm,L (J m-2 sr-1 nm-1)\n400,1\n", "of energy, a radiance summed over time", "by the time in s"),
                ("# Unit: W m-2 sr-1\nnm,L\n400,1\n", "`W m-2 sr-1`, a radiance over all", "the width of the band"),
                ("# units of values = reflectance\nnm,L\n400,1\n", "a ratio", "as a fraction of 1, by the radiance"),
                ("# Unit: %\nnm,L\n400,1\n", "`%`, a ratio", "as a fraction of 1, by the radiance"),
                (
                    "# irradiance in mW/(m2 nm)\nnm;value\n400;1\n",
                    "`mW/(m2 nm)`, an irradiance",
                    "those of one direction",
                ),
                ("# photon radiance\nnm,L\n400,1\n", "a unit of photons", "by the energy of its photons"),
                (
                    "nm,Rrs (sr-1)\n400,1\n",
                    "`Rrs (sr-1)`, a radiance over an irradiance",
                    "by the irradiance that it is of",
                ),
                ("nm,brightness temperature (K)\n400,1\n", "a temperature, not the radiance", "Planck's law"),
                ("# lambda uu [K]\n400 280\n", "a temperature, not the radiance", "Planck's law"),
            ] {
                let refused = unit(text, given).unwrap_err().to_string();
                assert!(refused.contains(quantity) && refused.contains(conversion), "{text}: {refused}");
                assert!(!refused.contains("radiance_unit"), "{refused}");
            }
        }
        // In passing comments may speak of other things.
        for text in [
            "# of an irradiance of 3 W m-2\nnm,L\n400,1\n",
            "# Unit: W m-2 sr-1 nm-1, band radiance: W m-2 sr-1\nnm,L\n400,1\n",
            "# wavelength unit: nm\nnm,L\n400,1\n",
        ] {
            assert_eq!(unit(text, given).unwrap().0, watts, "{text}");
        }
        let (_, warned) = unit("# from W m-2 nm-1 of the sun\nnm,L\n400,1\n", given).unwrap();
        let wanted = "a: a comment speaks of `W m-2 nm-1`, an irradiance, which has no sr-1; its values count as W m-2 sr-1 nm-1";
        assert!(warned.as_ref().is_some_and(|warned| warned.starts_with(wanted)), "{warned:?}");
        assert_eq!(unit("# of an irradiance of 3 W m-2\nnm,L\n400,1\n", given).unwrap().1, None);
        // 1 erg is 10⁻⁷ J.
        for text in [
            "nm,L (erg s-1 cm-2 sr-1 nm-1)\n400,1\n",
            "nm,L\nnm,erg/(s cm2 sr nm)\n400,1\n",
            "# Unit: erg s-1 cm-2 sr-1 nm-1\nnm,L\n400,1\n",
            "nm,radiance_erg_per_s_cm2_sr_nm\n400,1\n",
        ] {
            let found = unit(text, None).unwrap().0;
            assert!((found.in_w_per_cm2_sr_nm(500.0) / 1e-7 - 1.0).abs() < 1e-15, "{text}");
            assert_eq!(unit(text, RadianceUnit::parse("erg/s/cm2/sr/nm")).unwrap().0, found);
        }
    }

    #[test]
    fn what_is_no_radiance_or_says_nothing_is_told() {
        let unit = |text: &str, given| SpectralTable::parse("a", text.as_bytes()).unwrap().radiance_unit(0, given);
        let watts = RadianceUnit::USUAL[1];
        let given = Some(watts);
        let refused = |text: &str, given| unit(text, given).unwrap_err().to_string();
        for given in [None, given] {
            assert!(
                refused("nm,E (W m-2 nm-1)\n400,1\n", given).contains("`W m-2 nm-1`, an irradiance, which has no sr-1")
            );
            assert!(refused("nm,photon_radiance\n400,1\n", given).contains("a unit of photons"));
            assert!(refused("nm,uavgdir\n400,1\n", given).contains("a mean over all directions"));
        }
        let spoken_of = refused("# irradiance at ground, W/(m2 nm)\nnm,E\n400,1\n", None);
        assert!(spoken_of.contains("its comments speak of `W/(m2 nm)`, an irradiance"), "{spoken_of}");
        assert!(
            spoken_of.contains("those of one direction") && spoken_of.ends_with("radiances after all"),
            "{spoken_of}"
        );
        for text in [
            "nm,irradiance (W m-2 sr-1 nm-1)\n400,1e-3\n",
            "nm,irradiance\nnm,W m-2 sr-1 nm-1\n400,1e-3\n",
            "nm,radiance (W m-2 nm-1)\n400,1e-3\n",
            "nm,radiance\nnm,W m-2 nm-1\n400,1e-3\n",
        ] {
            assert!(refused(text, None).contains("the name of one quantity beside the unit of another"), "{text}");
            assert_eq!(unit(text, given).unwrap().0, watts, "{text}");
        }
        let table = |text: &str| SpectralTable::parse("a", text.as_bytes()).unwrap();
        let of_uvspec = table("lambda edir edn uavgdir uu\n400 1 1 1 1\n410 1 1 1 1\n");
        assert_eq!(of_uvspec.likely_radiances(), ["uu"]);
        assert!(refused("nm,L (100 W m-2 sr-1 nm-1)\n400,1\n", None).contains("a number before it"));
        assert_eq!(unit("nm,L (100 W m-2 sr-1 nm-1)\n400,1\n", given).unwrap().0, watts);
        assert_eq!(
            unit("nm,L (1e-3 W m-2 sr-1 nm-1)\n400,1\n", None).unwrap().0,
            RadianceUnit::parse("mW m-2 sr-1 nm-1").unwrap()
        );
        let both = "# from W m-2 sr-1 nm-1 to W cm-2 sr-1 nm-1\nnm,L\n400,1\n";
        assert!(refused(both, None).contains("name the units of radiance W m-2 sr-1 nm-1 and W cm-2 sr-1 nm-1"));
        assert_eq!(unit(both, given).unwrap().0, watts);
        let (assumed, warning) = unit("nm,L\n400,1e-6\n", None).unwrap();
        assert_eq!(assumed, RadianceUnit::default());
        assert!(warning.unwrap().contains("taken as W cm-2 sr-1 nm-1"));
        assert_eq!(unit("nm,L\n400,1\n", given).unwrap(), (watts, None));
        // A clear sky in W m⁻² sr⁻¹ nm⁻¹.
        assert!(refused("nm,L\n400,0.1\n", None).contains("1500 times as bright as a white cloud in the sun"));
    }

    #[test]
    fn wavelengths_that_look_like_something_else_are_refused() {
        let complaint = |text: &str| SpectralTable::parse("t", text.as_bytes()).unwrap_err().to_string();
        assert!(complaint("wavelength,L\n0.4,1\n0.7,2\n").contains("0.4 to 0.7 nm, which looks like micrometers"));
        assert!(complaint("wavelength,L\n4000,1\n7000,2\n").contains("looks like angstroms or wavenumbers"));
        for (text, said) in [
            (
                "wavelength (um),L\n360,1\n830,2\n",
                "in um, but 360 to 830 look like nm; mend what says so, as in the heading `wavelength_nm`",
            ),
            ("wavelength (A),L\n830,1\n360,2\n", "in angstrom, but 360 to 830 look like nm"),
            ("nu (cm-1),L\n360,1\n830,2\n", "in cm-1, but 360 to 830 look like nm"),
            ("wavelength (m),L\n360,1\n830,2\n", "in m, but 360 to 830 look like nm"),
            (
                "nm,L\n0.4,1\n0.7,2\n",
                "in nm, but 0.4 to 0.7 look like um; mend what says so, as in the heading `wavelength_um`",
            ),
            ("nm,L\n4000,1\n7000,2\n", "in nm, but 4000 to 7000 look like angstrom"),
            ("id nm,0.4,0.7\na,1,2\n", "in nm, but 0.4 to 0.7 look like um"),
            ("# wavelength in um\nlambda L\n400 1\n700 1\n", "in um, but 400 to 700 look like nm"),
        ] {
            assert!(complaint(text).contains(said), "{text}: {}", complaint(text));
        }
        // A part of what is long, or short, is light.
        for text in ["nm,L\n300,1\n4000,2\n", "nm,L\n1500,1\n4000,2\n", "um,L\n0.3,1\n10,2\n", "nm,L\n90,1\n150,2\n"] {
            assert!(SpectralTable::parse("t", text.as_bytes()).is_ok(), "{text}");
        }
        assert!(complaint("nu,L\n14000,1\n25000,2\n").contains("`wavenumber_cm-1`"));
        let table = SpectralTable::parse("t", b"nm,a,b\n400,1,1\n500,1,-2\n").unwrap();
        assert_eq!(table.doubt_of_values(0), None);
        assert_eq!(
            table.doubt_of_values(1).unwrap(),
            "t: `b`: 1 of 2 radiances are below 0, down to -2, which no light is"
        );
    }
}
